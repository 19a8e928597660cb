# SPDX-License-Identifier: Apache-2.0
"""A calibration made with other axes, cameras or windows is rejected by name wherever it would be
used: by capture, status, calibration set, and by reconstruct on the daemon and on a PC."""
import glob
import json
import os
import re
import subprocess
import unittest
import zlib

from daemon_process import TIMEOUT_S, DaemonTest
from reconstruct_test import Surfaces, lines_of, framed_index

VERGENCE = os.environ["VERGENCE"]
SESSION = os.path.join(os.environ["VERGENCE_SESSIONS"], "cylinder_1x")
DEGREE_Q4 = 165  # a pulse of 10.3 us
SIDES = ("left", "right")
AXES = ("zoom", "focus", "iris")


def framed(body):
    return f"{body}crc32 {zlib.crc32(body.encode()):08x}\n"


def pan_deg(pulse_q4):
    """Of an HS-322HD: 1500 us is the middle, 9442 sixteenths of a us are a radian."""
    return (pulse_q4 - 24000) / 9442 * 57.29577951308232


def with_origin(text, pair, instrument="rig", cameras=("unknown", "unknown")):
    """Version 2 of a calibration, of the axes and the window of a line of an index."""
    body = text[:text.index("crc32 ")].replace("vergence-calibration 1", "vergence-calibration 2")
    body += f"instrument {instrument}\n"
    for side, camera in zip(SIDES, cameras):
        pan, *lens = (int(number.split(":")[0]) for number in
                      re.search(rf"{side}_before=(\S+)", pair).group(1).split(","))
        window = re.search(rf"{side}_window=(\S+)", pair).group(1).replace(",", " ")
        size = re.search(rf"{side}_size=(\d+)x(\d+)", pair).groups()
        body = re.sub(rf"{side}_size_px .*", f"{side}_size_px {size[0]} {size[1]}", body)
        body += f"{side}_camera {camera}\n{side}_window_px {window}\n"
        body += f"{side}_pan_deg {pan_deg(pan):.3f} 0.000\n"
        body += "".join(f"{side}_{axis}_counts {mean_q4 / 16:.3f} 1.000\n"
                        for axis, mean_q4 in zip(AXES, lens))
    return framed(body + "scale_sigma 0.000100000\nyaw_sigma_rad 0.000020000\n")


def calibration_of(folder):
    path, = glob.glob(os.path.join(folder, "calibration-*.txt"))
    with open(path, encoding="ascii") as file:
        return file.read()


def pair_of(folder):
    return next(line for line in lines_of(folder) if line.startswith("pair "))


class Instrument(DaemonTest):
    def test_moved_axes_and_windows(self):
        client = self.client()

        def works(command):
            answer = client.ask_json(command)
            self.assertTrue(answer["ok"], (command, answer))
            return answer["result"]

        def refused(command, *words):
            answer = client.ask_json(command)
            self.assertEqual(answer["error"], "MISMATCH", (command, answer))
            for word in words:
                self.assertIn(word, answer["message"])
            return answer

        for command in ("bringup", "window 128 96", "exposure 2000", "pan 3.57 right=-3.27",
                        "zoom 422", "focus 500", "iris 800", "capture before"):
            works(command)
        before = os.path.join(self.files, "before")
        self.assertTrue(any(line.startswith("instrument ") for line in lines_of(before)))
        with open(os.path.join(self.files, "rig.txt"), "w", encoding="ascii") as file:
            file.write(with_origin(calibration_of(SESSION), pair_of(before)))
        works("calibration set rig.txt")
        self.assertEqual(works("status")["calibration"]["match"], "yes")
        works("capture there")

        for move, back, name in (("pan 4.57 side=left", "pan 3.57 side=left", "left pan"),
                                 ("zoom 430 side=right", "zoom 422 side=right", "right zoom"),
                                 ("focus 491 side=left", "focus 500 side=left", "left focus"),
                                 ("window 96 96", "window 128 96", "window")):
            works(move)
            refused("capture away", name, "accept-mismatch")
            self.assertFalse(os.path.exists(os.path.join(self.files, "away")))
            status = works("status")["calibration"]
            self.assertEqual(status["match"], "no")
            self.assertIn(name, status["mismatch"])
            refused("calibration set rig.txt", name, "accept-mismatch")
            works(back)
            if name == "left pan":
                works("capture back")  # as far as can be determined
        works("pan 4.57 side=left")
        kept = works("capture anyway accept-mismatch=yes")
        self.assertIn("left pan", kept["accepted_mismatch"])
        self.assertIn("command text=capture%20accept-mismatch=yes",
                      [" ".join(line.split()[:2]) for line in lines_of(
                          os.path.join(self.files, "anyway"))])
        self.assertIn("left pan", works("calibration set rig.txt accept-mismatch=yes")
                      ["accepted_mismatch"])
        works("bringup")  # the servo positions are unknown until set
        works("window 128 96")
        refused("capture unset", "left pan", "not set", "accept-mismatch")
        self.assertIn("left pan", works("status")["calibration"]["mismatch"])
        works("calibration forget")
        works("capture free")
        # One of another program states no axes: it is saved with the present ones.
        with open(os.path.join(self.files, "foreign.txt"), "w", encoding="ascii") as file:
            body = calibration_of(SESSION)
            body = re.sub(r"(left|right)_size_px .*", r"\1_size_px 128 96", body)
            file.write(framed(body[:body.index("crc32 ")]))
        works("pan 3.57 right=-3.27")
        self.assertIn("recorded", works("calibration set foreign.txt")["axes"])
        works("capture with_axes")
        works("pan 4.57 side=left")
        refused("capture turned", "left pan", "3.5", "accept-mismatch")
        works("calibration forget")
        works("window 96 96")
        works("calibration set foreign.txt")  # the window may be set later
        answer = client.ask_json("capture small")
        self.assertEqual(answer["error"], "SIZE_MISMATCH", answer)
        accepted = works("capture small accept-mismatch=yes")["accepted_mismatch"]
        status = works("status")["calibration"]["mismatch"]
        for said in (answer["message"], accepted, status):
            for word in ("96x96", "128x96", "window"):
                self.assertIn(word, said)
        # It is of no use to a pair of another size.
        self.assertNotIn("calibration", {line.split()[0] for line in lines_of(
            os.path.join(self.files, "small"))})
        works("window 128 96")
        works("capture fitting")


class Pairs(Surfaces):
    """The recorded pair, whose index and calibration are changed."""
    def changed(self, name, change, **origin):
        """A session with the recorded pair's calibration, and a pair that differs."""
        folder = self.session(name, calibration=False, window="688,568,1")
        pair = pair_of(folder)
        text = with_origin(calibration_of(SESSION), pair, **origin)
        lines = lines_of(folder)
        lines = [change(line) if line.startswith("pair ") else line for line in lines]
        lines.insert(1, f"calibration file={zlib.crc32(text.encode()):08x}")
        if "cameras" in origin:
            lines = [line for line in lines if not line.startswith("instrument ")]
            lines.insert(1, "instrument left_camera=B right_camera=A left_servo=24000,9442 "
                            "right_servo=24000,9442 pan_repeatability_urad=5236 "
                            "lens_repeatability_counts=4 lens_zoom_ppm=4187")
        with open(os.path.join(folder, "session.index"), "wb") as file:
            file.write(framed_index(lines))
        with open(os.path.join(folder, f"calibration-{zlib.crc32(text.encode()):08x}.txt"), "w",
                  encoding="ascii") as file:
            file.write(text)
        return folder

    @staticmethod
    def moved(side, place, by):
        """Changes a number of both positions of a side."""
        def change(line):
            for when in ("before", "after"):
                numbers = re.search(rf"{side}_{when}=(\S+)", line).group(1).split(",")
                number, *sigma = numbers[place].split(":")
                numbers[place] = ":".join([str(int(number) + by * (16 if sigma else 1)), *sigma])
                line = re.sub(rf"{side}_{when}=\S+", f"{side}_{when}=" + ",".join(numbers), line)
            return line
        return change

    def on_pc(self, *arguments):
        return subprocess.run([VERGENCE, "reconstruct", *arguments], capture_output=True, text=True,
                              timeout=TIMEOUT_S)

    def test_reconstruct_refuses_by_name(self):
        cases = (("left pan", self.moved("left", 0, DEGREE_Q4), {}),
                 ("right zoom", self.moved("right", 1, 5), {}),
                 ("left focus", self.moved("left", 2, -5), {}),
                 ("window", lambda line: re.sub(r"_window=688,568", "_window=0,0", line), {}),
                 ("swapped", lambda line: line, {"cameras": ("A", "B")}),
                 ("instrument", lambda line: line, {"instrument": "bench"}))
        for number, (word, change, origin) in enumerate(cases):
            folder = self.changed(f"s{number}", change, **origin)
            error, text = self.refused(f"reconstruct s{number} pair=1 scale=0.5")
            self.assertEqual(error, "MISMATCH")
            self.assertIn(word, text)
            self.assertIn("accept-mismatch", text)
            out = os.path.join(self.folder, f"out{number}")
            done = self.on_pc(folder, "--scale", "0.5", "--out", out)
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertIn(word, done.stderr)
            self.assertIn("ERR MISMATCH", done.stderr)
            self.assertIn("--accept-mismatch", done.stderr)
            self.assertEqual(len(done.stderr.splitlines()), 1)
            self.assertFalse(os.path.exists(out))
            reported = subprocess.run([VERGENCE, "info", folder], capture_output=True, text=True,
                                  timeout=TIMEOUT_S)
            self.assertEqual(reported.returncode, 3, reported.stderr)
            self.assertIn("ERR MISMATCH", reported.stderr)
            for text in (reported.stdout, reported.stderr):
                self.assertIn(word, text)

    def test_every_output_of_an_accepted_mismatch_reports_so(self):
        folder = self.changed("moved", self.moved("left", 1, 5))
        figures = self.asked("reconstruct moved pair=1 scale=0.5 accept-mismatch=yes files=all")
        self.assertIn("left zoom", figures["accepted_mismatch"])
        with open(os.path.join(self.files, "surface-moved-1", "reasons.pgm"), "rb") as file:
            self.assertIn(b"left zoom is at", file.read())
        out = os.path.join(self.folder, "accepted")
        done = self.on_pc(folder, "--scale", "0.5", "--out", out, "--accept-mismatch")
        self.assertEqual(done.returncode, 0, done.stderr)
        for text in (done.stdout, done.stderr):
            self.assertIn("left zoom", text)
            self.assertNotIn("or accept it", text)
            self.assertNotIn("is assumed to be", text)
        with open(os.path.join(out, "result.json"), encoding="utf-8") as file:
            result = json.load(file)
        self.assertEqual(result["calibration"]["match"], "no, accepted")
        for name in ("mesh.ply", "points.pcd", "mesh.glb", "report.html", "disparity.png",
                     "depth.png", "reasons.png", "left_rectified.png", "right_rectified.png"):
            with open(os.path.join(out, name), "rb") as file:
                self.assertIn(b"left zoom is at", file.read(), name)

    def test_the_common_deviation(self):
        folder = self.changed("same", lambda line: line)
        figures = self.asked("reconstruct same pair=1 scale=0.5")
        out = os.path.join(self.folder, "same")
        done = self.on_pc(folder, "--scale", "0.5", "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("accepted", done.stderr + done.stdout)
        reported = subprocess.run([VERGENCE, "info", folder], capture_output=True, text=True,
                              timeout=TIMEOUT_S)
        self.assertEqual((reported.returncode, reported.stderr), (0, ""))
        self.assertIn(", matches", reported.stdout)
        self.assertIn("common ", done.stdout)
        with open(os.path.join(out, "result.json"), encoding="utf-8") as file:
            result = json.load(file)
        self.assertEqual(result["calibration"]["match"], "yes")
        self.assertEqual(result["format_version"], 2)
        common_mm = result["depth_sigma_common_mm"]
        # 0.3 degrees of two servos 250 mm apart, and 4 counts of two zooms.
        depth_mm, degree_rad = result["depth_mm"]["median"], 5236e-6
        expected_mm = (2 * (depth_mm ** 2 / result["calibration"]["baseline_mm"] * degree_rad) ** 2 +
                       2 * (depth_mm * 4 * 4187e-6 / 2) ** 2) ** 0.5
        self.assertAlmostEqual(common_mm / expected_mm, 1, delta=0.01)
        self.assertGreater(common_mm, 50)
        self.assertAlmostEqual(figures["depth_sigma_common"], common_mm, delta=0.01 * common_mm)
        report = open(os.path.join(out, "report.html"), encoding="utf-8").read()
        self.assertIn("common sigma", report)
        self.assertRegex(report, r"common to all points ± [0-9.]+ mm")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""The capture at all zooms that is kept in tests/data, from its corners and positions to a calibration."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest
import zlib

from pairs import run

KEPT = pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tests" / "data" / "zoom_capture"
# The simulated rig's lenses, without the ripple of their cams.
TRUTH = subprocess.run([os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True, check=True).stdout
# A lens approached from above rests half of its play above what its potentiometer reads.
HALF_PLAY_COUNTS = 2
# A third of a count and the ripple, and what the corners leave open at the long end.
LIMIT_PX, LIMIT_RELATIVE = 16, 5e-4
BOARD = ("--board", "10x7", "--square", "24", "--charuco", "4x4_50", "--marker", "17")


def focal_lengths(calibration, zoom, focus):
    done = run("info", str(calibration), "--at", f"zoom={zoom},focus={focus},pan=3,right_pan=-3")
    assert done.returncode == 0, done.stderr
    return [float(one) for one in re.findall(r"focal length (\S+) x", done.stdout)[:2]]


def kept_events():
    """The kept capture's events, without their CRC."""
    return [line.rsplit(" ", 1)[0].split(" ") for line in (KEPT / "session.index").read_text().splitlines()]


def write_index(folder, events):
    index = b""
    for event in events:
        index += " ".join(event).encode() + b" "
        index += b"%08x\n" % zlib.crc32(index[:-1])
    folder.mkdir()
    (folder / "session.index").write_bytes(index)


def write_exchanged(folder):
    """The kept capture as a rig records it whose cameras, lenses and servos were exchanged; a third of its
    pairs."""
    events = []
    for number, (kind, *words) in enumerate(kept_events()):
        if kind in ("pair", "instrument"):
            if kind == "pair" and number % 3:
                continue
            values = dict(word.split("=", 1) for word in words)
            other = {"left": "right", "right": "left"}
            words = [key + "=" + values[re.sub("^(left|right)(?=_)", lambda side: other[side[0]], key)]
                     for key in values]
        events.append([kind, *words])
    write_index(folder, events)


class ZoomCapture(unittest.TestCase):
    def test_the_kept_capture_is_solved_without_its_frames(self):
        with tempfile.TemporaryDirectory() as out:
            done = run("calibrate", str(KEPT), *BOARD, "--corners", str(KEPT / "corners.vnl"), "--out",
                       out + "/solved")
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(out + "/solved/calibration.json", encoding="utf-8") as file:
                found = json.load(file)
            self.assertEqual(found["zooms"], 13)
            self.assertGreater(found["corners"], 16000)
            self.assertLess(found["rms_px"], 0.02)
            self.assertLess(found["held_out_focal"], 0.002)
            self.assertTrue(found["verdict"]["good"])
            self.assertIn(found["verdict"]["sentence"], done.stdout)
            noise = found["corner_noise"]
            noted, = re.findall(r"corner%20noise%20([\d.]+)%20([\d.]+)%2030", (KEPT / "session.index").read_text())
            corner_px2 = sum(float(px) ** 2 for px in noted) / 2
            self.assertAlmostEqual(noise["model_px"] ** 2 + corner_px2, found["rms_px"] ** 2)
            self.assertIn(f"; corner noise {corner_px2 ** 0.5:.3f} px (30 still frames of the first board); the "
                          f"rest of the residual, {noise['model_px']:.3f} px, is the model.", done.stdout)
            self.assertRegex(done.stdout, r"a length of 100 mm at 15\d\d mm is known to \+- [123]\.\d mm")
            for length in found["length_sigma"]:
                self.assertLess(length["own_mm"], 0.6 * length["read_mm"])
            page = pathlib.Path(out, "solved", "calibration.html").read_text(encoding="utf-8")
            for column in ("motors as read", "own matches", "a second zoom", "board in view"):
                self.assertEqual(page.count(f"<th>{column}</th>"), 3)
            self.check_focal_lengths(out, out + "/solved/instrument.zoom")

    def check_focal_lengths(self, out, calibration):
        """Those of both cameras are the simulated rig's with the rings at the same positions."""
        pathlib.Path(out, "truth.zoom").write_bytes(TRUTH)
        for zoom in (301, 320, 350, 400, 500, 650, 838):
            with self.subTest(zoom=zoom):
                found = focal_lengths(calibration, zoom, 600)
                expected = focal_lengths(out + "/truth.zoom", zoom + HALF_PLAY_COUNTS, 600 + HALF_PLAY_COUNTS)
                for one, other in zip(found, expected):
                    self.assertLess(abs(one - other), LIMIT_PX + LIMIT_RELATIVE * other)

    def test_exchanged_sides_are_not_good(self):
        with tempfile.TemporaryDirectory() as out:
            write_exchanged(pathlib.Path(out, "exchanged"))
            done = run("calibrate", out + "/exchanged", *BOARD, "--corners", str(KEPT / "corners.vnl"),
                       "--quiet", "--out", out + "/solved")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (5, 1), done.stderr)
            self.assertIn("Not good: left and right are exchanged", done.stderr)
            text = pathlib.Path(out, "solved", "instrument.zoom").read_text(encoding="ascii")
            self.assertIn("\nnote NOT GOOD: left and right are exchanged", text)
            page = pathlib.Path(out, "solved", "calibration.html").read_text(encoding="utf-8")
            self.assertEqual(page.count("left and right are exchanged"), 1)

    def test_a_model_of_one_zoom_is_refused(self):
        done = run("calibrate", str(KEPT), *BOARD, "--corners", str(KEPT / "corners.vnl"), "--model", "rational",
                   "--out", "nowhere")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        self.assertIn("--model", done.stderr)

    def test_without_corners_the_frames_are_missed(self):
        done = run("calibrate", str(KEPT), *BOARD, "--out", "nowhere")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        self.assertIn("frame-", done.stderr)


if __name__ == "__main__":
    unittest.main()

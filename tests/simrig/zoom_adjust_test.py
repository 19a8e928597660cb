# SPDX-License-Identifier: Apache-2.0
"""`vergence reconstruct` with a calibration of all zooms: rendered pairs of a rig whose servos and rings
are not where they read, refined alone and by a pair at another zoom, against the same surface
with the true cameras; and what cannot be adjusted, in one line each."""
import json
import math
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy

from recorded import Session

VERGENCE = os.environ["VERGENCE"]
SIMRIG = pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tools" / "simrig"
RENDER = pathlib.Path(os.environ["SIMRIG"]).parent / "simrig-render"
TEXT = subprocess.run([os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True, check=True).stdout
COLUMN, ROW, WIDTH, HEIGHT = 544, 408, 960, 720
PAN_DEG, FOCUS = 3.97, 544.0
WIDE, TELE = 340.0, 700.0
# What no reading shows: degrees of both servos, counts of both zoom rings.
OFF_DEG, OFF_COUNTS = (0.15, -0.2), (0.8, -0.6)
INSTRUMENT = ("left_camera= right_camera= left_servo=24000,9442 right_servo=24000,9442 "
              "pan_repeatability_urad=5236 lens_repeatability_counts=4 lens_zoom_ppm=4187")
SIDES = ("left", "right")


def axes(zoom, extra_deg=0):
    """As a session states them, of both sides."""
    stated = []
    for sign in (1, -1):
        pulse = 24000 + round((sign * PAN_DEG + extra_deg) * 9442 * numpy.pi / 180)
        stated.append(f"{pulse},{16 * zoom:.0f}:4,{16 * FOCUS:.0f}:4,7952:4")
    return stated


def render(folder, zoom, turned_deg=0, scene=SIMRIG / "scenes/cylinder.yaml"):
    """Both frames, with the servos off, and the left one turned more; the truth is in `folder`."""
    folder.mkdir()
    frames = []
    running = [subprocess.Popen(
        [RENDER, scene, SIMRIG / "rigs/default.yaml", "--out", folder / side,
         "--camera", side, "--zoom", str(zoom + OFF_COUNTS[number]), "--focus", str(FOCUS), "--iris",
         "497", "--exposure", "150000", "--window", f"{COLUMN},{ROW},{WIDTH},{HEIGHT}", "--seed",
         str(number), "--pan", str((1, -1)[number] * PAN_DEG + OFF_DEG[number] +
                                   (turned_deg if number == 0 else 0))])
        for number, side in enumerate(SIDES)]
    for side, process in zip(SIDES, running):
        if process.wait(200) != 0:
            raise RuntimeError("simrig-render failed")
        data = (folder / f"{side}.pgm").read_bytes()[-2 * WIDTH * HEIGHT:]
        frames.append(numpy.frombuffer(data, ">u2").reshape(HEIGHT, WIDTH).astype("uint16"))
    return frames


class ZoomAdjust(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-refine-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.zoom = cls.folder / "instrument.zoom"
        cls.zoom.write_bytes(TEXT)
        session = Session(cls.folder / "scene", "rig", INSTRUMENT)
        session.zoom_calibration(TEXT)

        def pair(frames, zoom, extra_deg=0):
            session.pair(*frames, layout="grbg", axes=axes(zoom, extra_deg),
                         window=f"{COLUMN},{ROW},1")
        pair(render(cls.folder / "wide", WIDE), WIDE)
        tele = render(cls.folder / "tele", TELE)
        pair(tele, TELE)
        pair(render(cls.folder / "turned", TELE, turned_deg=0.2), TELE)
        pair(tele, TELE, extra_deg=1)  # as if the servos had been set in between
        pair([numpy.full((HEIGHT, WIDTH), 300, "uint16")] * 2, TELE)
        session.end()

    def run_on(self, *options, calibration=None):
        given = [] if calibration == "session" else ["--calibration", calibration or self.zoom]
        return subprocess.run(
            [VERGENCE, "reconstruct", self.folder / "scene", *given, "--near", "1500", "--far", "2700", "--scale", "0.25", "--files",
             "result.json", "--out", self.folder / "out", *map(str, options)],
            capture_output=True, text=True, timeout=200)

    def figures(self, *options, **calibration):
        done = self.run_on(*options, **calibration)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads((self.folder / "out/result.json").read_text()), done

    def measure(self, folder, *options):
        """`vergence measure`, in a summary and result.json."""
        out = self.folder / "out"
        done = subprocess.run([VERGENCE, "measure", folder, *map(str, options), "--files", "result.json",
                               "--out", out], capture_output=True, text=True, timeout=200)
        return done, json.loads((out / "result.json").read_text()) if done.returncode == 0 else None

    def test_a_known_size_in_view_gives_the_distance(self):
        scene = pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tests/data/zoom_capture/board.yaml"
        session = Session(self.folder / "board", "rig", INSTRUMENT)
        session.zoom_calibration(TEXT)
        session.pair(*render(self.folder / "seen", 440, scene=scene), layout="grbg", axes=axes(440),
                     window=f"{COLUMN},{ROW},1")
        session.note("# measure fit=300")
        session.note("# measure surface pair=1 near=1500.000 far=2700.000 scale=0.25")
        session.end()
        board = ["--board", "10x7", "--square", "24", "--charuco", "4x4_50", "--marker", "17"]
        true = self.folder / "board.calibration"
        subprocess.run([VERGENCE, "info", self.folder / "seen", "--convert", true], check=True,
                       capture_output=True, timeout=60)
        truth_mm = self.measure(session.path, "--calibration", true,
                                "--accept-mismatch")[1]["depth_mm"]["median"]
        alone = self.measure(session.path)[1]
        self.assertIsNone(alone["self_calibration"]["known_size"])

        def assert_better(figures, done, points, share):
            found = figures["self_calibration"]
            self.assertEqual(found["known_size"]["points"], points)
            self.assertAlmostEqual(found["known_size"]["depth_sigma_without_mm"],
                                   alone["self_calibration"]["depth_sigma_mm"], delta=1e-6)
            self.assertLess(found["depth_sigma_mm"], share * alone["self_calibration"]["depth_sigma_mm"])
            self.assertRegex(done.stdout, r"known size  \d+ points: all depths at \d+ mm together .* -> ")
            # This calibration does not know the ripple of the lenses' cams.
            self.assertLess(abs(figures["depth_mm"]["median"] - truth_mm),
                            4 * figures["depth_sigma_common_mm"])
        done, figures = self.measure(session.path, *board)
        assert_better(figures, done, 70, 0.2)
        # Two of its corners as marks.
        subprocess.run([VERGENCE, "calibrate", session.path, "--touch-up", self.zoom, *board, "--out",
                        self.folder / "looked"], capture_output=True, timeout=200, check=True)
        corners = {}
        for line in (self.folder / "looked/corners.vnl").read_text().splitlines():
            if line.startswith("frame-"):
                frame, *place = line.split()
                corners.setdefault(frame, []).append(place[:2])
        left, right = (corners[next(name for name in corners if word.endswith(name[6:14]))]
                       for word in next(line for line in (session.path / "session.index").read_text().split("\n")
                                        if line.startswith("pair ")).split() if "_frame=" in word)
        both = [i for i, places in enumerate(zip(left, right)) if "-" not in (*places[0], *places[1])]
        ends = both[0], both[-1]
        length = 24 * math.hypot(ends[1] % 10 - ends[0] % 10, ends[1] // 10 - ends[0] // 10)
        marks = [",".join((*left[end], *right[end])) for end in ends]
        done, figures = self.measure(session.path, "--length", length, "--from", marks[0], "--to", marks[1])
        assert_better(figures, done, 2, 0.9)
        # Marks of different things are refused, a wrong size is noticed.
        elsewhere = ",".join(str(float(value) + 40 * (i == 3)) for i, value in enumerate(marks[0].split(",")))
        done, _ = self.measure(session.path, "--length", length, "--from", elsewhere, "--to", marks[1])
        self.refused(done, 3, "the board or the length does not fit it")
        done, _ = self.measure(session.path, "--length", 1.25 * length, "--from", marks[0], "--to", marks[1])
        self.assertIn("the known size does not fit", done.stderr)
        done, _ = self.measure(session.path, *board[:3], "27", *board[4:6], "--marker", "19.125")
        self.assertIn("the known size does not fit", done.stderr)
        self.assertNotIn("the known size", self.measure(session.path)[0].stderr)
        for options, code, words in ((board[:2], 2, "--square"), (["--length", 3], 2, "--from"),
                                     ([*board, "--length", 3, "--from", marks[0], "--to", marks[1]], 2,
                                      "cannot be combined"),
                                     (["--board", "13x9", "--square", 30], 3, "no picture shows a board")):
            done, _ = self.measure(session.path, *options)
            self.refused(done, code, "vergence measure: ", words)

    def true_depth(self, folder, pair):
        true = self.folder / f"{folder}.calibration"
        subprocess.run([VERGENCE, "info", self.folder / folder, "--convert", true], check=True,
                       capture_output=True, timeout=60)
        figures, _ = self.figures("--pair", pair, "--accept-mismatch", calibration=true)
        self.assertIsNone(figures["self_calibration"])
        return figures["depth_mm"]["p99"]

    def assert_depth(self, figures, true_mm):
        # Of the farthest points: a median lies between two surfaces, on whichever has more points.
        far_mm, median_mm = (figures["depth_mm"][of] for of in ("p99", "median"))
        sigma_mm = figures["depth_sigma_common_mm"] * (far_mm / median_mm) ** 2
        self.assertLess(abs(far_mm - true_mm), 4 * sigma_mm + 2)

    def test_each_pair_is_refined_as_well_as_it_says(self):
        for folder, pair, other in (("wide", 1, 2), ("tele", 2, 1)):
            depth_mm = self.true_depth(folder, pair)
            alone, done = self.figures("--pair", pair)
            found = alone["self_calibration"]
            self.assertIn("cameras     corrected by", done.stdout)
            self.assertIsNone(found["with_pair"])
            self.assertGreater(found["rows_before_px"], 0.4)
            self.assertLess(found["rows_px"], 0.3)
            self.assertLess(found["depth_sigma_mm"], 0.8 * found["depth_sigma_before_mm"])
            self.assertIn(found["health"], ("good", "touch up"))
            self.assert_depth(alone, depth_mm)
            both, done = self.figures("--pair", pair, "--with-pair", other)
            found = both["self_calibration"]
            self.assertIn(f"pair {other}: pan stood still", done.stdout)
            self.assertTrue(found["with_pair"]["used"])
            self.assertGreater(found["with_pair"]["points"], 50)
            for turn, sigma in zip(found["with_pair"]["turn_deg"], found["with_pair"]["turn_sigma_deg"]):
                self.assertLess(abs(turn), 4 * sigma)
            self.assertLess(both["depth_sigma_common_mm"],
                            (0.9 if folder == "wide" else 0.6) * alone["depth_sigma_common_mm"])
            self.assert_depth(both, depth_mm)

    def test_the_session_itself_has_the_calibration(self):
        options = ("--pair", 2, "--with-pair", 1, "--files", "result.json,points.pcd")
        surfaces = []
        for source in (None, "session"):
            figures, done = self.figures(*options, calibration=source)
            surfaces.append((figures["self_calibration"], figures["depth_mm"],
                             (self.folder / "out/points.pcd").read_bytes()))
            self.assertNotIn("--calibration", done.stderr)
        self.assertEqual(*surfaces)
        path, = (self.folder / "scene").glob("zoom-*.txt")
        path.write_bytes(TEXT + b" ")
        try:
            self.refused(self.run_on(*options, calibration="session"), 3, path.name)
        finally:
            path.write_bytes(TEXT)

    def test_a_camera_that_turned_between_is_found(self):
        figures, done = self.figures("--pair", 3, "--with-pair", 1)
        other = figures["self_calibration"]["with_pair"]
        self.assertFalse(other["used"])
        self.assertAlmostEqual(other["turn_deg"][0], 0.2, delta=4 * other["turn_sigma_deg"][0])
        self.assertIn("the left camera turned by 0.", done.stderr)
        self.assertNotIn("stood still", done.stdout)

    def refused(self, done, code, *words):
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        line, = done.stderr.splitlines()
        for word in words:
            self.assertIn(word, line)

    def test_what_cannot_help_is_refused(self):
        self.refused(self.run_on("--pair", 4, "--with-pair", 1), 3, "MISMATCH", "pan moved", "4 and 1")
        self.refused(self.run_on("--pair", 2, "--with-pair", 2), 3, "cannot help itself")
        self.refused(self.run_on("--pair", 2, "--with-pair", 9), 3, "no pair 9")
        done = self.run_on("--pair", 2, "--bracket", 9)  # its old name
        self.assertIn("note: --bracket is now --with-pair\n", done.stderr)
        self.assertIn("no pair 9", done.stderr)
        one = self.folder / "one.calibration"
        subprocess.run([VERGENCE, "info", self.zoom, "--at", f"{self.folder / 'scene'}:2", "--convert",
                        one], check=True, capture_output=True, timeout=60)
        self.refused(self.run_on("--pair", 2, "--with-pair", 1, calibration=one), 3, "all zooms")
        done = self.run_on("--pair", 2, "--with-pair", 3)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("pair 3 cannot help", done.stderr)

    def test_without_texture_the_deviation_of_the_prior_is_said(self):
        done = self.run_on("--pair", 5)
        self.assertEqual(done.returncode, 4, done.stdout)
        self.assertRegex(done.stderr, r"only \d+ points of the pair match.* deviation of \d{2,3} mm")


if __name__ == "__main__":
    unittest.main()

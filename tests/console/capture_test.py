# SPDX-License-Identifier: Apache-2.0
"""`vergence calibrate capture` on the simulated rig: a simulated person moves the board, the capture is
interrupted and resumed, and the same setting shows the same corners as when the kept capture was
recorded."""
import importlib.machinery
import importlib.util
import os
import pathlib
import signal
import subprocess
import tempfile
import unittest

import numpy

from daemon_process import SIMRIG, VERGENCED, DaemonTest
from waiting import TIMEOUT_S

KEPT = pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tests" / "data" / "zoom_capture"
BUILD = pathlib.Path(VERGENCED).parents[1]


def load(path):
    """A script without an extension, as a module."""
    loader = importlib.machinery.SourceFileLoader(path.name, str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(path.name, loader))
    loader.exec_module(module)
    return module


def corners(path, frame):
    """Number of the corner: its place and standard deviation, of one frame."""
    seen, index, sigma = {}, 0, 0
    with open(path, encoding="ascii") as file:
        for line in file:
            if line.startswith("## a corner of level 0"):
                sigma = float(line.split()[-2])
            words = line.split()
            if words[0] != frame:
                continue
            if words[1] != "-":
                seen[index] = (float(words[1]), float(words[2]), sigma * 2 ** float(words[3]))
            index += 1
    return seen


def frames(session):
    """Names of the frames of the first pair."""
    with open(session / "session.index", encoding="ascii") as file:
        for line in file:
            if line.startswith("pair "):
                words = dict(word.split("=", 1) for word in line.split() if "=" in word)
                return [f"frame-{words[side]}.pnm" for side in ("left_frame", "right_frame")]
    raise AssertionError("no pair")


def homography_rest(one, other):
    """Differences (px) that remain after the best homography between two lists of places: none for a
    plane seen by a camera that turned a little."""
    rows = []
    scale = 1000.0
    for (x, y), (u, v) in zip(one / scale, other / scale):
        rows.append([x, y, 1, 0, 0, 0, -u * x, -u * y, -u])
        rows.append([0, 0, 0, x, y, 1, -v * x, -v * y, -v])
    h = numpy.linalg.svd(numpy.array(rows))[2][-1].reshape(3, 3)
    mapped = numpy.c_[one / scale, numpy.ones(len(one))] @ h.T
    return mapped[:, :2] / mapped[:, 2:] * scale - other


@unittest.skipUnless(SIMRIG, "the simulated rig needs -DVERGENCE_FPGA=ON")
class Capture(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.make = load(KEPT / "make")

    def capture(self, session, *options, until=None, keys=None):
        """Runs `make` of the kept capture; exit code and output."""
        words = [KEPT / "make", "--into", session, BUILD, "--focus", "distance", "--no-sweep", *options]
        words += ["--until", until] if until else []
        words += ["--keys", keys] if keys is not None else []
        done = subprocess.run(words, capture_output=True, text=True, timeout=4 * TIMEOUT_S)
        return done.returncode, done.stdout, done.stderr

    def test_a_setting_shows_the_same_corners_and_a_capture_goes_on(self):
        with tempfile.TemporaryDirectory() as work:
            session = pathlib.Path(work) / "zooms"
            code, shown, said = self.capture(session, until="  the board is")
            self.assertEqual(code, 130, shown + said)
            self.assertIn("interrupted; the pairs so far are in", said)
            for name, kept in zip(frames(session), frames(KEPT)):
                fresh = corners(session / "corners.vnl", name)
                recorded = corners(KEPT / "corners.vnl", kept)
                both = sorted(fresh.keys() & recorded.keys())
                self.assertGreater(len(both), 60)
                # The servo does not rest at the same angle twice.
                rest = homography_rest(numpy.array([recorded[i][:2] for i in both]),
                                       numpy.array([fresh[i][:2] for i in both]))
                self.assertLess(numpy.sqrt(numpy.mean(rest ** 2)), 0.03)
            info = subprocess.run([os.environ["VERGENCE"], "info", session], capture_output=True,
                                  text=True, check=True).stdout
            self.assertRegex(info, r"pairs +1\n")

            # It continues; another board than before is refused.
            code, shown, said = self.capture(session, keys="q")
            self.assertEqual(code, 0, said)
            self.assertIn("has 1 pairs of 1 positions", shown)
            self.assertIn("position 2 of 12: ", shown)
            code, shown, said = self.capture(session, "--board", "9x7", keys="q")
            self.assertEqual((code, said.count("\n")), (3, 1), said)
            self.assertIn("corners", said)
            self.assertTrue((session / "guide.svg").read_text().startswith("<svg"))

    def test_a_board_out_of_view_is_named_and_costs_nothing(self):
        with tempfile.TemporaryDirectory() as work:
            session = pathlib.Path(work) / "zooms"
            code, shown, said = self.capture(session, "--range", "100:110", keys="\nq")
            self.assertEqual(code, 0, said)
            self.assertIn("left camera: ", shown)
            self.assertIn(": 0 pairs", shown)
            self.assertFalse((session / "session.index").exists())

    def test_mistakes_are_one_line(self):
        for words, code, said in ((["zooms", "--board", "10x7", "--square", "24"], 2, "--charuco"),
                                  (["zooms", *self.make.BOARD, "--range", "900:800"], 2, "--range"),
                                  (["zooms", *self.make.BOARD, "--connect", "unix:none"], 3, "none")):
            done = subprocess.run([os.environ["VERGENCE"], "calibrate", "capture", *words],
                                  capture_output=True, text=True, timeout=TIMEOUT_S)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (code, 1), done.stderr)
            self.assertIn(said, done.stderr)


class SmallFrames(DaemonTest):
    """A daemon that serves one capture of three zooms after the other, with small frames."""
    scene = str(KEPT / "board.yaml")

    @classmethod
    def start(cls):
        super().start()
        cls.make = load(KEPT / "make")
        cls.control("move board 0 0 -100 8 6 -3")
        for line in ("bringup", "window 640 512"):
            assert cls.vergence(*line.split()).returncode == 0

    @classmethod
    def control(cls, *commands):
        done = subprocess.run([pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tools/simrig/control",
                               f"unix:{cls.rig_path}", *commands], check=True, capture_output=True,
                              text=True)
        return done.stdout

    def capture(self, session, *options, meanwhile=None):
        """Runs a capture of one position; `meanwhile`, a control command, is given after the second
        pair. Exit code and output."""
        command = subprocess.Popen(
            [os.environ["VERGENCE"], "calibrate", "capture", session, *self.make.BOARD, "--connect",
             f"unix:{self.path}", "--zooms", "4", "--no-sweep", "--positions", "1", "--range",
             "1699:1700", *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True)
        shown, wide = "", 0  # pairs at the widest zoom: before and after the cameras turned
        with command:
            command.stdin.write("\n")
            command.stdin.flush()
            for line in command.stdout:
                shown += line
                wide += line.startswith("    8.5 mm: ")
                if wide == 2 and meanwhile is not None:
                    self.control(meanwhile)
                    meanwhile = None
            said = command.stderr.read()
        return command.returncode, shown, said

    def refused(self, text, meanwhile=None):
        """A capture fails in one line."""
        with tempfile.TemporaryDirectory() as work:
            code, shown, said = self.capture(work + "/zooms", "--focus", "distance",
                                             meanwhile=meanwhile)
            self.assertEqual((code, said.count("\n")), (3, 1), shown + said)
            self.assertRegex(said, text)
            self.assertFalse(os.path.exists(work + "/zooms/incoming"))


class BoardMoved(SmallFrames):
    def test_a_board_that_moves_and_a_lens_that_jams_are_named(self):
        self.refused("moved during the position.*same command", "move board 30 0 -100 8 6 -3")
        self.control("move board 0 0 -100 8 6 -3")
        self.refused("JAMMED.*zoom", "fault lens left zoom jam")


class Light(SmallFrames):
    def test_a_board_that_becomes_too_bright_is_exposed_again(self):
        with tempfile.TemporaryDirectory() as work:
            code, shown, said = self.capture(work + "/zooms", "--focus", "distance",
                                             meanwhile="light 3")
            self.assertEqual(code, 0, said)
            # The last time, and never twice at one setting.
            before, after = shown.rsplit("exposed for the board", 1)
            self.assertGreater(int(before.split("white at ")[-1].split(" %")[0]), 80)
            self.assertEqual(after.count(" mm: "), 1, shown)
            # One position is not enough for a calibration, which is said.
            self.assertIn("; 4 of 4 zooms have fewer than 4 boards", shown)
            self.assertRegex(shown, r"3 pairs in \d+\.\d minutes")


class Autofocus(SmallFrames):
    settings = ("rig.focus_nearest=900 mm",)  # the lens's own scale is wrong

    def test_the_longest_zoom_is_focused_by_its_pictures(self):
        with tempfile.TemporaryDirectory() as work:
            code, shown, said = self.capture(work + "/zooms")
            self.assertEqual(code, 0, said)
            self.assertNotIn("autofocus failed", shown)
            for side in ("left", "right"):
                there = self.control(f"sharp {side} 920 660 200 200")
                self.assertLess(float(there.split("median: ")[1].split("blur_px: ")[1].split("}")[0]),
                                0.7, there)


class WrongLens(SmallFrames):
    settings = ("rig.focal_length_tele=40 mm",)

    def test_a_picture_that_does_not_grow_with_the_reading_is_named(self):
        self.refused("(Left|Right) lens: its picture grew .*read-back")


if __name__ == "__main__":
    unittest.main()

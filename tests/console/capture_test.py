# SPDX-License-Identifier: Apache-2.0
"""`vergence calibrate capture` on the simulated rig: what it says of boards, lenses and light, how it is
interrupted and continues. With VERGENCE_CAPTURE=whole (tests/slow_tests.py) also what takes processor
minutes: noise of still frames, autofocus, and the same corners as in the kept capture."""
import importlib.machinery
import importlib.util
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import unittest

import numpy

from daemon_process import SIMRIG, VERGENCED, DaemonTest
from waiting import TIMEOUT_S

slow = unittest.skipUnless(os.environ.get("VERGENCE_CAPTURE") == "whole", "slow: capture_whole_test")
KEPT = pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tests" / "data" / "zoom_capture"
# The first place in the kept capture. Another part of the sensor would be shown another one.
FIRST = "position 1 of 12: 1241 mm away, 57 mm left, 0 mm down, turned 12 -14 -8 deg"
HOME = "move board 0 0 500 8 6 -3"


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


class Mistakes(unittest.TestCase):
    def test_mistakes_are_one_line(self):
        board = load(KEPT / "make").BOARD
        for words, code, said in ((["zooms", "--board", "10x7", "--square", "24"], 2, "--charuco"),
                                  (["zooms", *board, "--near", "900", "--far", "800"], 2, "--near"),
                                  (["zooms", *board, "--connect", "unix:none"], 3, "none")):
            done = subprocess.run([os.environ["VERGENCE"], "calibrate", "capture", *words],
                                  capture_output=True, text=True, timeout=TIMEOUT_S)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (code, 1), done.stderr)
            self.assertIn(said, done.stderr)

    @unittest.skipUnless(SIMRIG, "the simulated rig needs -DVERGENCE_FPGA=ON")
    def test_the_script_that_made_the_kept_capture_runs(self):
        with tempfile.TemporaryDirectory() as work:
            done = subprocess.run([KEPT / "make", "--into", work + "/capture", "--keys", "q",
                                   pathlib.Path(VERGENCED).parents[1], "--focus", "distance"],
                                  capture_output=True, text=True, timeout=TIMEOUT_S)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(": 0 pairs", done.stdout)


class CaptureTest(DaemonTest):
    """A daemon that serves one capture after the other, of a part of the sensor."""
    scene = str(KEPT / "board.yaml")
    window = "320 256"

    @classmethod
    def start(cls):
        super().start()
        cls.make = load(KEPT / "make")
        cls.control(HOME)
        for line in ("bringup", "window " + cls.window):
            assert cls.vergence(*line.split()).returncode == 0

    @classmethod
    def control(cls, *commands):
        done = subprocess.run([pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tools/simrig/control",
                               f"unix:{cls.rig_path}", *commands], check=True, capture_output=True,
                              text=True)
        return done.stdout

    def capture(self, session, *options, keys="\n", each=lambda command, line: None,
                window=("--keep-window",)):
        """Runs a capture from straight ahead; `each` is called with each line that it prints. Exit code
        and output."""
        self.vergence("pan", "0", "right=0")
        command = subprocess.Popen(
            [os.environ["VERGENCE"], "calibrate", "capture", session, *self.make.BOARD, "--connect",
             f"unix:{self.path}", *window, *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True)
        shown = ""
        with command:
            command.stdin.write(keys)
            command.stdin.flush()
            for line in command.stdout:
                shown += line
                each(command, line)
            said = command.stderr.read()
        return command.returncode, shown, said


@slow
class Fresh(CaptureTest):
    window = "1400 560"

    def test_a_setting_shows_the_same_corners_as_in_the_kept_capture(self):
        person = self.make.Person(f"unix:{self.rig_path}", 1)

        def each(command, line):
            if self.make.PLACE.match(line):
                person.move(FIRST)
            elif line.startswith("  the board is"):
                command.send_signal(signal.SIGINT)

        with tempfile.TemporaryDirectory() as work:
            session = pathlib.Path(work) / "zooms"
            code, shown, said = self.capture(session, "--focus", "distance", "--near", "1240",
                                             "--far", "1242", each=each)
            self.assertEqual(code, 130, shown + said)
            for name, kept in zip(frames(session), frames(KEPT)):
                fresh = corners(session / "corners.vnl", name)
                recorded = corners(KEPT / "corners.vnl", kept)
                both = sorted(fresh.keys() & recorded.keys())
                self.assertGreater(len(both), 60)
                # The servo does not rest at the same angle twice.
                rest = homography_rest(numpy.array([recorded[i][:2] for i in both]),
                                       numpy.array([fresh[i][:2] for i in both]))
                sigma = numpy.sqrt(numpy.mean([recorded[i][2] ** 2 + fresh[i][2] ** 2 for i in both]))
                self.assertLess(numpy.sqrt(numpy.mean(rest ** 2)), 1.5 * sigma)


class OnePosition(CaptureTest):
    """Captures of one position of the board."""
    words = ("--zooms", "4", "--no-noise", "--no-sweep", "--positions", "1", "--near", "2299", "--far", "2300")

    def meanwhile(self, control, pairs=2):
        """For capture's `each`: gives a control command after so many pairs."""
        wide = []  # pairs at the widest zoom: before and after the cameras turned

        def each(_, line):
            if line.startswith("    8.5 mm: "):
                wide.append(line)
                if len(wide) == pairs:
                    self.control(control)
        return each

    def refused(self, text, *meanwhile):
        """A capture fails in one line."""
        with tempfile.TemporaryDirectory() as work:
            each = {"each": self.meanwhile(*meanwhile)} if meanwhile else {}
            code, shown, said = self.capture(work + "/zooms", *self.words, "--focus", "distance",
                                             **each)
            self.assertEqual((code, said.count("\n")), (3, 1), shown + said)
            self.assertRegex(said, text)
            self.assertFalse(os.path.exists(work + "/zooms/incoming"))


class Board(OnePosition):
    def test_a_capture_is_interrupted_and_continues(self):
        def interrupt(command, line):
            if line.startswith("  the board is"):
                command.send_signal(signal.SIGINT)

        with tempfile.TemporaryDirectory() as work:
            session = pathlib.Path(work) / "zooms"
            words = [*self.words[:-6], "--focus", "distance"]
            code, shown, said = self.capture(session, *words, each=interrupt)
            self.assertEqual(code, 130, shown + said)
            self.assertIn("interrupted; the pairs so far are in", said)
            info = subprocess.run([os.environ["VERGENCE"], "info", session], capture_output=True,
                                  text=True, check=True).stdout
            self.assertRegex(info, r"pairs +1\n")
            code, shown, said = self.capture(session, *words, keys="q\n")
            self.assertEqual(code, 0, said)
            self.assertIn("has 1 pairs of 1 positions", shown)
            self.assertIn("position 2 of 12: ", shown)
            # Another window than before, and another board.
            self.vergence("window", "320", "240")
            code, shown, said = self.capture(session, *words, keys="q\n")
            self.vergence("window", *self.window.split())
            self.assertEqual((code, said.count("\n")), (3, 1), said)
            self.assertRegex(said, r"begun with a left window of 320 x 256 px .* it is 320 x 240")
            code, shown, said = self.capture(session, *words, "--board", "9x7", keys="q\n")
            self.assertEqual((code, said.count("\n")), (3, 1), said)
            self.assertIn("begun with --board 10x7 ", said)
            self.assertTrue((session / "guide.svg").read_text().startswith("<svg"))

    def test_a_board_out_of_view_is_named_and_costs_nothing(self):
        self.control("move board 900 0 500 8 6 -3")
        with tempfile.TemporaryDirectory() as work:
            session = pathlib.Path(work) / "zooms"
            code, shown, said = self.capture(session, *self.words, "--focus", "distance",
                                             keys="\nq\n")
            self.assertEqual(code, 0, said)
            self.assertIn("left camera: ", shown)
            self.assertIn(": 0 pairs", shown)
            self.assertFalse((session / "session.index").exists())
        self.control(HOME)

    def test_a_board_that_moves_and_a_lens_that_jams_are_named(self):
        self.refused("moved during the position.*same command", "move board 40 0 500 8 6 -3")
        self.control(HOME)
        # Early: the lenses may move on before this hears of the pair.
        self.refused("JAMMED.*zoom", "fault lens left zoom jam", 1)
        # Before anyone holds a board.
        with tempfile.TemporaryDirectory() as work:
            code, shown, said = self.capture(work + "/zooms", *self.words, keys="")
            self.control("fault lens left zoom free")
            self.assertEqual((code, said.count("\n")), (3, 1), shown + said)
            self.assertRegex(said, "JAMMED.*zoom")
            self.assertNotIn("position", shown)

    def test_the_whole_sensor_is_set_unless_the_window_is_to_be_kept(self):
        with tempfile.TemporaryDirectory() as work:
            for window, size in ((("--keep-window",), "320"), ((), "2048")):
                code, shown, said = self.capture(work + "/zooms", *self.words, keys="q\n",
                                                 window=window)
                self.assertEqual(code, 0, said)
                self.assertRegex(self.vergence("window").stdout, rf"width: *{size}")
        self.assertEqual(self.vergence("window", *self.window.split()).returncode, 0)
        self.assertIn("window: 2048 x 1536 px, the whole sensor (it was 320 x 256)", shown)

    @slow
    def test_a_board_that_becomes_too_bright_is_exposed_again(self):
        with tempfile.TemporaryDirectory() as work:
            words = [word for word in self.words if word != "--no-noise"]
            code, shown, said = self.capture(work + "/zooms", *words, "--focus", "distance",
                                             each=self.meanwhile("light 3"))
            self.control("light 1")
            self.assertEqual(code, 0, said)
            # Before the light changes, still frames show the noise of a corner.
            noise = re.search(r"30 still frames for .*\n  corner noise (0\.\d+) and (0\.\d+) px\n", shown)
            self.assertIsNotNone(noise, shown)
            index = pathlib.Path(work, "zooms", "session.index").read_text(encoding="ascii")
            kept = re.search(r"#%20corner%20noise%20(\S+)%20(\S+)%2030 ", index)
            for one, other in zip(noise.groups(), kept.groups()):
                self.assertAlmostEqual(float(one), float(other), delta=0.0006)
                self.assertGreater(float(one), 0.002)
                self.assertLess(float(one), 0.1)
            before, after = shown.rsplit("exposed for the board", 1)
            self.assertGreater(int(before.split("white at ")[-1].split(" %")[0]), 80)
            self.assertEqual(after.count(" mm: "), 1, shown)
            # One position is not enough for a calibration, which is said.
            self.assertIn("; 4 of 4 zooms have fewer than 4 boards", shown)
            # Ten counts of play below the end of the motor's range.
            self.assertIn("4 zooms from 8.5 to 83.6 mm", shown)
            self.assertRegex(shown, r"3 pairs in \d+\.\d minutes")
            self.assertIn(" corners (captures 2", shown)


@slow
class Autofocus(OnePosition):
    # The lens's own scale is wrong by 50 counts, 1.4 px of blur.
    settings = ("rig.lens_focus_min=380 counts", "rig.lens_focus_max=560 counts")

    def test_the_longest_zoom_is_focused_by_its_pictures(self):
        with tempfile.TemporaryDirectory() as work:
            code, shown, said = self.capture(work + "/zooms", *self.words)
            self.assertEqual(code, 0, said)
            self.assertNotIn("autofocus failed", shown)
            for side in ("left", "right"):
                there = self.control(f"sharp {side} 960 704 128 128").split("median: ")[1]
                self.assertLess(float(there.split("blur_px: ")[1].split("}")[0]), 0.7, there)
            # What was learned of focus moves the nearest distance: a board there is no error.
            refused = self.vergence("focus", "790mm")
            self.assertIn("out of range", refused.stdout + refused.stderr)
            code, shown, said = self.capture(work + "/near", *self.words[:-4], "--near", "790",
                                             "--far", "800", keys="q\n")
            self.assertEqual(code, 0, said)


@slow
class WrongLens(OnePosition):
    settings = ("rig.focal_length_tele=40 mm",)

    def test_a_picture_that_does_not_grow_with_the_reading_is_named(self):
        self.refused("(Left|Right) lens: its picture grew .*read-back")


del CaptureTest, OnePosition  # they have no tests of their own

if __name__ == "__main__":
    unittest.main()

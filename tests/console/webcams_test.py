# SPDX-License-Identifier: Apache-2.0
"""The commands of FIRST_HOUR.md for two webcams, on a fake kernel whose cameras show the board in view
after view and then the scene."""
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import cv2
import numpy

from daemon_process import TIMEOUT_S, VERGENCED
from fake_devices import FRAME_US, preloaded, show
from waiting import wait_until

VERGENCE = os.environ["VERGENCE"]
ROOT = os.environ["VERGENCE_SOURCE"]
sys.path.insert(0, os.path.join(ROOT, "tests", "command"))

import boards  # noqa: E402

COMMANDS = 7


def commands():
    """The commands of the page's block, in order."""
    with open(os.path.join(ROOT, "FIRST_HOUR.md"), encoding="utf-8") as file:
        block = re.findall(r"^```sh webcams\n(.*?)^```", file.read(), re.S | re.M)
    return [line for line in block[0].splitlines() if line.strip() and not line.startswith("#")]


def painted():
    """The board's texture with additional texture on its squares, so that there is a surface to
    measure."""
    texture = boards.board_texture().astype(float)
    random = numpy.random.default_rng(5)
    spots = cv2.GaussianBlur(random.normal(size=texture.shape), (0, 0), 4)
    return numpy.clip(texture + 18 * spots / spots.std(), 0, 255).astype(numpy.uint8)


class Webcams(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = scratch.name
        self.pictures = [self.place(name) for name in ("left.ppm", "right.ppm")]
        with open(self.place("script"), "w", encoding="ascii") as file:
            file.write("".join(f"video /dev/video{device} YUYV {picture} {FRAME_US}\n"
                               for device, picture in zip((0, 2), self.pictures)))
        programs = [os.path.dirname(program) for program in (VERGENCE, VERGENCED)]
        self.environment = {**preloaded(self.place("script")), "PATH": os.pathsep.join(
            [*programs, os.environ["PATH"]])}
        self.quiet = {**self.environment, "LD_PRELOAD": ""}
        self.show(boards.pairs(poses=boards.POSES[:1])[0])

    def place(self, *names):
        return os.path.join(self.folder, *names)

    def show(self, *pairs):
        """Shows a pair to the two cameras; several in turn, another in each frame."""
        for path, images in zip(self.pictures, zip(*pairs)):
            show(path, *(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB) for image in images))
        time.sleep(2 * FRAME_US * 1e-6)  # frames in flight have arrived

    def run_one(self, command):
        done = subprocess.run(["bash", "-c", command], cwd=self.folder, env=self.quiet, text=True,
                              capture_output=True, timeout=300)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout}{done.stderr}")
        return done.stdout

    def start(self, command):
        """Starts the daemon, as the shell does with &: the next command does not wait."""
        self.assertTrue(command.endswith(" &"), command)
        daemon = subprocess.Popen(["bash", "-c", "exec " + command[:-1]], cwd=self.folder,
                                  env=self.environment, stdin=subprocess.DEVNULL)
        self.addCleanup(self.stop, daemon)
        return daemon

    def stop(self, daemon):
        daemon.send_signal(signal.SIGTERM)
        self.assertEqual(daemon.wait(TIMEOUT_S), 0)

    def is_whole(self, session):
        index = pathlib.Path(self.folder, "files", session, "session.index")
        return index.exists() and b"\nend" in index.read_bytes()

    def capture_views(self, command):
        """Shows the board in another pose whenever the loop asks for it."""
        loop = subprocess.Popen(["bash", "-c", command], cwd=self.folder, env=self.quiet,
                                stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT)
        self.addCleanup(loop.kill)
        views = boards.pairs(poses=boards.POSES + [(18, -10, 30, 20, 10, 30),
                                                   (-15, 18, -25, -30, 0, 60),
                                                   (28, 10, 0, 0, 50, 120), (-8, -30, 12, 40, 0, 0),
                                                   (0, 15, -14, -40, 40, 130)])
        for number, pair in enumerate(views, 1):
            self.show(pair)
            loop.stdin.write(b"\n")
            loop.stdin.flush()
            wait_until(lambda name=f"board-{number:02d}": self.is_whole(name),
                       f"view {number} never came")
        output_text, _ = loop.communicate(timeout=TIMEOUT_S)
        self.assertEqual(loop.returncode, 0, output_text)
        self.assertEqual(output_text.count(b"\nOK\n"), 1 + len(views), output_text)

    def look(self):
        """The page's commands that show what was captured."""
        with open(os.path.join(ROOT, "FIRST_HOUR.md"), encoding="utf-8") as file:
            text = re.sub(r"\n +", " ", file.read())
        shown = re.findall(r"`(vergence (?:--connect unix:rig.sock view|\w+ files/scene"
                           r"(?: --png --out seen)?))`", text)
        self.assertEqual([command.split()[1] for command in shown], ["--connect", "info", "export"])
        written, output_text, _ = map(self.run_one, shown)
        name = re.search(r"written: (\S+),", written)[1]
        self.assertEqual(cv2.imread(self.place(name)).shape[:2], (480, 2 * 640))
        self.assertIn("640 x 480 px", output_text)
        self.assertEqual(sorted(name for name in os.listdir(self.place("seen")) if name[0] != "."),
                         ["scene-pair1-left.png", "scene-pair1-right.png"])

    def refused(self, command, *words):
        done = subprocess.run(["bash", "-c", command], cwd=self.folder, env=self.quiet, text=True,
                              capture_output=True, timeout=300)
        output_text = done.stdout + done.stderr
        self.assertNotEqual(done.returncode, 0, output_text)
        for word in words:
            self.assertIn(word, output_text)

    def measure(self, daemon):
        """Nothing moves, and the calibration is of this one state: light, a pair, the surface."""
        running = self.start(daemon.replace("store=none", "store=measured"))
        ask = "vergence --connect unix:rig.sock"
        self.run_one(f"{ask} send calibrated/rig.calibration measured.txt")
        self.refused(f"{ask} measure thing", "no calibration is saved")
        self.run_one(f"{ask} bringup")
        self.run_one(f"{ask} calibration set measured.txt")
        self.refused(f"{ask} measure thing fit=300", "calibration of all zooms")
        done = self.run_one(f"{ask} measure thing near=300 far=1500")
        # Cameras of a fake kernel show the same at each exposure: no reason to ask for light.
        self.assertRegex(done, r"sentence: points good to 0\.\d+ mm at 5\d\d mm, .*; 9\d(\.\d)? % of the "
                               r"subject measured; the light could not be set: [^;]*\n")
        self.assertEqual(re.findall(r"step ([a-z ]+):", done), ["light", "pair", "merged pair", "surface"])
        self.assertTrue(os.path.exists(self.place("thing-surface", "report.html")))
        self.show(*([boards.picture(painted(), boards.pose(12, 20, 4, 10, 0, 30 + way), right, seed=50)
                     for right in (False, True)] for way in (0, 40, 80, 20, 60)))
        self.refused(f"{ask} measure moves", "MOVED", "pair: ", "keep scene and light constant")
        self.assertFalse(os.path.exists(self.place("files", "moves")))
        self.stop(running)

    def exchange_cameras(self, daemon):
        """The calibration detects by the ports that left and right are swapped."""
        text = pathlib.Path(self.folder, "calibrated", "rig.calibration").read_text()
        cameras = [re.search(rf"^{side}_camera (.*)$", text, re.M)[1] for side in ("left", "right")]
        self.assertNotIn("unknown", cameras)
        self.assertNotEqual(*cameras)
        self.start(daemon.replace("/dev/video0", "/dev/video1").replace("/dev/video2", "/dev/video0")
                   .replace("/dev/video1", "/dev/video2").replace("store=none", "store=store"))
        ask = "vergence --connect unix:rig.sock"
        self.run_one(f"{ask} bringup")
        self.run_one(f"{ask} capture exchanged")
        self.run_one("cp calibrated/rig.calibration files/rig.txt")
        swapped = ("MISMATCH", "swapped", *cameras)
        self.refused(f"{ask} calibration set rig.txt", *swapped)
        self.run_one(f"{ask} calibration set rig.txt accept-mismatch=yes")
        self.assertRegex(self.run_one(f"{ask} capture again"), "accepted_mismatch: .*swapped")
        self.assertRegex(self.run_one(f"{ask} status"), "(?s)mismatch: .*swapped")
        self.refused(f"{ask} reconstruct exchanged", *swapped)
        self.refused("vergence reconstruct files/exchanged --calibration calibrated/rig.calibration "
                     "--near 300 --far 1500 --out exchanged", *swapped[1:])

    def test_the_commands_from_two_webcams_to_a_surface(self):
        lines = commands()
        self.assertEqual(len(lines), COMMANDS)
        folder, board, daemon, views, calibrate, capture, reconstruct = lines
        self.run_one(folder)
        self.folder = self.place(re.search(r"&& cd (\S+)$", folder)[1])
        self.run_one(board)
        self.assertGreater(os.path.getsize(self.place("board.pdf")), 1000)
        running = self.start(daemon)
        self.capture_views(views)
        self.assertIn("\nGood: 15 boards", self.run_one(calibrate))
        self.show([boards.picture(painted(), boards.pose(12, 20, 4, 10, 0, 30), right, seed=50)
                   for right in (False, True)])
        self.assertIn("skew", self.run_one(capture))
        self.look()
        self.run_one(reconstruct)
        measured = json.loads(self.run_one(
            f"/usr/bin/python3 {os.path.join(ROOT, 'tools/demo.d/measure_board.py')} surface "
            "calibrated/calibration.json"))
        self.assertEqual(measured["true_square_mm"], boards.SQUARE_MM)
        self.assertGreaterEqual(measured["corners"], 50)
        self.assertAlmostEqual(measured["square_mm"], boards.SQUARE_MM, delta=0.1)
        self.assertLess(measured["plane_rms_mm"], 0.5)
        self.assertLessEqual(measured["off_plane"], 1)
        self.stop(running)
        self.measure(daemon)
        self.exchange_cameras(daemon)


if __name__ == "__main__":
    unittest.main()

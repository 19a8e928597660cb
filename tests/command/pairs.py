# SPDX-License-Identifier: Apache-2.0
"""Small synthetic pairs with exact truth, and helpers of the command tests."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import cv2
import numpy

VERGENCE = os.environ["VERGENCE"]
BOARD = os.environ["VERGENCE_BOARD"]
SEED = int(os.environ.get("VERGENCE_SEED", "20090915"))

WIDTH, HEIGHT = 240, 160
FOCAL_PX, BASELINE_MM = 500.0, 100.0
FAR_PX, NEAR_PX = 12, 30  # disparities of the wall and of the box in front of it
BOX = (slice(50, 120), slice(90, 170))


def run(*arguments, program=VERGENCE, **options):
    """The finished process, with text output."""
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True,
                          timeout=120, **options)


def texture(random, height, width):
    """Grey noise without structure that could confuse a matcher."""
    noise = random.integers(0, 256, (height, width)).astype(numpy.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 1.0)
    return cv2.normalize(smooth, None, 20, 235, cv2.NORM_MINMAX).astype(numpy.uint8)


def make_pair(seed=SEED, width=WIDTH, height=HEIGHT):
    """Left and right image (colour, BGR) of a box in front of a wall, and the true disparity."""
    random = numpy.random.default_rng(seed)
    wall, box = (numpy.dstack([texture(random, height, width + 64) for _ in range(3)])
                 for _ in range(2))
    truth = numpy.full((height, width), FAR_PX, numpy.float32)
    truth[BOX] = NEAR_PX
    left = wall[:, :width].copy()
    left[BOX] = box[:, :width][BOX]
    right = wall[:, FAR_PX:FAR_PX + width].copy()
    moved = (BOX[0], slice(BOX[1].start - NEAR_PX, BOX[1].stop - NEAR_PX))
    right[moved] = box[:, :width][BOX]
    return left, right, truth


def grey(image):
    return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


RECTIFIED = ["--rectified", "--focal", FOCAL_PX, "--baseline", BASELINE_MM, "--disparity", "0:48"]


class Fixture(unittest.TestCase):
    """A test case with an empty directory and a pair in it."""

    def setUp(self):
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="vergence-test-"))
        self.addCleanup(shutil.rmtree, self.directory, ignore_errors=True)
        self.left, self.right, self.truth = make_pair()
        self.left_path = self.save("left.png", self.left)
        self.right_path = self.save("right.png", self.right)
        self.out = self.directory / "out"

    def save(self, name, image):
        path = self.directory / name
        self.assertTrue(cv2.imwrite(str(path), image), path)
        return path

    def calibration_text(self, width=WIDTH, height=HEIGHT, focal_px=FOCAL_PX):
        """Our own text for the pair, written by the converter."""
        source = self.directory / "calib.txt"
        matrix = f"[{focal_px} 0 {(width - 1) / 2}; 0 {focal_px} {(height - 1) / 2}; 0 0 1]"
        source.write_text(f"cam0={matrix}\ncam1={matrix}\ndoffs=0\nbaseline={BASELINE_MM}\n"
                          f"width={width}\nheight={height}\nndisp=48\n")
        path = self.directory / f"rig{width}x{height}.txt"
        done = run("info", source, "--convert", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        return path

    def reconstruct(self, *arguments, program=VERGENCE, left=None, right=None):
        """Runs the command on the pair and checks that it succeeded."""
        done = run("reconstruct", left or self.left_path, right or self.right_path, "--out",
                   self.out, *(arguments or RECTIFIED), program=program)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def disparity(self):
        """disparity.pfm as OpenCV reads it."""
        return cv2.imread(str(self.out / "disparity.pfm"), cv2.IMREAD_UNCHANGED)

    def assert_near_truth(self, density=0.6):
        found = self.disparity()
        self.assertEqual(found.shape, self.truth.shape)
        valid = numpy.isfinite(found)
        self.assertGreater(valid.mean(), density)
        self.assertGreater((abs(found - self.truth)[valid] < 0.5).mean(), 0.97)

    def names(self):
        """All files and directories below the test's directory except the given inputs."""
        return sorted(str(p.relative_to(self.directory)) for p in self.directory.rglob("*")
                      if p not in (self.left_path, self.right_path))

    def assert_refused(self, done, code, *words):
        """The run failed with this code and one clear line that contains the words, and left no
        files."""
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertTrue(done.stderr.startswith("vergence"), done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)
        self.assertFalse(self.out.exists())
        left_over = [n for n in self.names() if n.rsplit("/")[-1].startswith(".vergence")]
        self.assertEqual(left_over, [])

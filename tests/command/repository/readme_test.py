# SPDX-License-Identifier: Apache-2.0
"""Every command in the README's shell blocks runs, in the order given, on a pair made here."""
import os
import re
import subprocess
import tempfile
import unittest

import cv2
import numpy

import boards

ROOT = os.environ["VERGENCE_SOURCE"]
WIDTH, HEIGHT, SHIFT_PX, FOCAL_PX, BASELINE_MM = 640, 480, 24, 600.0, 100.0


def write_pair(folder):
    """A textured wall at FOCAL * BASELINE / SHIFT = 2500 mm, seen by two ideal cameras."""
    random = numpy.random.default_rng(7)
    texture = cv2.GaussianBlur(random.normal(size=(HEIGHT, WIDTH + SHIFT_PX)), (0, 0), 1.2)
    texture = numpy.clip(128 + 110 * texture, 0, 255).astype(numpy.uint8)
    cv2.imwrite(os.path.join(folder, "left.png"), texture[:, :WIDTH])
    cv2.imwrite(os.path.join(folder, "right.png"), texture[:, SHIFT_PX:])
    truth = numpy.full((HEIGHT, WIDTH), SHIFT_PX, numpy.float32)
    cv2.imwrite(os.path.join(folder, "truth.pfm"), truth)


def write_calibration(folder):
    """The two files that OpenCV's stereo_calib sample writes."""
    os.mkdir(folder)
    camera = numpy.array([[FOCAL_PX, 0, WIDTH / 2], [0, FOCAL_PX, HEIGHT / 2], [0, 0, 1.0]])
    files = {"intrinsics.yml": {"M1": camera, "D1": numpy.zeros((1, 5)), "M2": camera,
                                "D2": numpy.zeros((1, 5))},
             "extrinsics.yml": {"R": numpy.eye(3), "T": numpy.array([[-BASELINE_MM], [0.0], [0.0]])}}
    for name, values in files.items():
        storage = cv2.FileStorage(os.path.join(folder, name), cv2.FILE_STORAGE_WRITE)
        for key, value in values.items():
            storage.write(key, value)
        storage.release()


def commands():
    with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
        blocks = re.findall(r"^```sh\n(.*?)^```", file.read(), re.S | re.M)
    return [line for block in blocks for line in block.splitlines()
            if line.strip() and not line.startswith("#")]


class Readme(unittest.TestCase):
    def test_every_command_runs(self):
        lines = commands()
        self.assertGreaterEqual(len(lines), 5)
        with tempfile.TemporaryDirectory() as folder:
            write_pair(folder)
            write_calibration(os.path.join(folder, "calibration"))
            boards.write(os.path.join(folder, "pictures"), boards.pairs())
            path = os.path.dirname(os.environ["VERGENCE"]) + os.pathsep + os.environ["PATH"]
            for line in lines:
                done = subprocess.run(["bash", "-c", line], cwd=folder, text=True,
                                      capture_output=True, env={**os.environ, "PATH": path})
                self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")
            depth = cv2.imread(os.path.join(folder, "result", "depth.png"), cv2.IMREAD_UNCHANGED)
            middle = numpy.median(depth[depth > 0])
            self.assertAlmostEqual(middle, FOCAL_PX * BASELINE_MM / SHIFT_PX, delta=5)

    def test_the_named_files_exist(self):
        with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
            text = file.read()
        for target in re.findall(r"\]\(([^)#]+)\)", text) + re.findall(r"`((?:tools|tests)/[\w./]+)`",
                                                                         text):
            self.assertTrue(os.path.exists(os.path.join(ROOT, target)), target)


if __name__ == "__main__":
    unittest.main()

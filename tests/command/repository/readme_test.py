# SPDX-License-Identifier: Apache-2.0
"""The commands of the READMEs: those in shell blocks run, in the order given, on generated pictures;
those in tables exist and have the options shown."""
import os
import re
import subprocess
import tempfile
import unittest

import cv2
import numpy

import boards
from results import result_names

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


def text_of(document):
    with open(os.path.join(ROOT, document), encoding="utf-8") as file:
        return file.read()


def commands(document):
    blocks = re.findall(r"^```sh\n(.*?)^```", text_of(document), re.S | re.M)
    return [line for block in blocks for line in block.splitlines()
            if line.strip() and not line.startswith("#")]


class Readme(unittest.TestCase):
    def run_all(self, document, folder):
        """Runs the commands of a document in a folder with a pair, its calibration and pictures."""
        lines = commands(document)
        self.assertGreaterEqual(len(lines), 5)
        write_pair(folder)
        write_calibration(os.path.join(folder, "calibration"))
        boards.write(os.path.join(folder, "pictures"), boards.pairs())
        path = os.path.dirname(os.environ["VERGENCE"]) + os.pathsep + os.environ["PATH"]
        for line in lines:
            done = subprocess.run(["bash", "-c", line], cwd=folder, text=True,
                                  capture_output=True, env={**os.environ, "PATH": path})
            self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")

    def check_depth(self, folder):
        depth = cv2.imread(os.path.join(folder, "result", "depth.png"), cv2.IMREAD_UNCHANGED)
        middle = numpy.median(depth[depth > 0])
        self.assertAlmostEqual(middle, FOCAL_PX * BASELINE_MM / SHIFT_PX, delta=5)

    def test_every_command_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            self.run_all("README.md", folder)
            self.check_depth(folder)

    def test_every_command_of_the_tools_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            self.run_all("tools/README.md", folder)
            self.check_depth(folder)

    def test_every_command_of_the_calibration_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            self.run_all("calib/README.md", folder)
            names = {"rig.calibration", "calibration.html", "calibration.json", "corners.vnl"}
            self.assertEqual(set(result_names(os.path.join(folder, "calibrated"))), names)

    def test_scripts_have_the_options_shown(self):
        """The scripts take hours or change the system: only their help texts are read."""
        for document in ("tools/README.md", "tests/study/bench/README.md"):
            shown = re.findall(r"^\| `(tools/\w+)([^`]*)`", text_of(document), re.M)
            self.assertGreaterEqual(len(shown), 5)
            for tool, words in shown:
                done = subprocess.run([os.path.join(ROOT, tool), "--help"], text=True,
                                      capture_output=True)
                self.assertEqual(done.returncode, 0, done.stderr)
                for word in re.findall(r"(?<!\w)--[a-z-]+|(?<= )[a-z]+", words):
                    self.assertIn(word, done.stdout, tool)

    def test_commands_have_the_options_shown(self):
        """Those of a rig with motorized zooms, which other tests run: see console/capture_test."""
        rows = re.findall(r"^\| `vergence (calibrate capture|calibrate|reconstruct) ([^`]*)`",
                          text_of("README.md"), re.M)
        self.assertGreaterEqual(len(rows), 5)
        for command, words in rows:
            done = subprocess.run([os.environ["VERGENCE"], *command.split(), "--help"], text=True,
                                  capture_output=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            for word in re.findall(r"--[a-z-]+", words):
                self.assertIn(word, done.stdout, command)

    def test_the_named_files_exist(self):
        for page in ("README.md", "tests/README.md"):
            text = text_of(page)
            folder = os.path.join(ROOT, os.path.dirname(page))
            links = [os.path.join(folder, target)
                     for target in re.findall(r"\]\(([^)#]+)\)", text)]
            names = re.findall(r"`((?:tools|tests|firmware|daemon|calib|fpga)/[\w./]+)`", text)
            for target in links + [os.path.join(ROOT, name) for name in names]:
                self.assertTrue(os.path.exists(target), target)
        for document in ("calib/README.md", "tools/README.md", "tests/study/bench/README.md"):
            folder = os.path.join(ROOT, os.path.dirname(document))
            for target in re.findall(r"\]\(([^)#]+)\)", text_of(document)):
                self.assertTrue(os.path.exists(os.path.join(folder, target)), (document, target))

    def test_first_hour_is_linked(self):
        """Its commands are run by console/first_hour_test and console/webcams_test."""
        anchors = re.findall(r"\(FIRST_HOUR\.md#([\w-]+)\)", text_of("README.md"))
        headings = re.findall(r"^## (.*)$", text_of("FIRST_HOUR.md"), re.M)
        self.assertLessEqual(set(anchors), {name.lower().replace(" ", "-") for name in headings})
        self.assertGreaterEqual(len(anchors), 2)


if __name__ == "__main__":
    unittest.main()

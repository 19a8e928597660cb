# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the calibration on eight of opencv-doc's pairs."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).with_name("calibration_bench.py")
VERGENCE = os.environ["VERGENCE"]
SAMPLES = pathlib.Path(os.environ["VERGENCE_OPENCV_SAMPLES"])


class CalibrationBench(unittest.TestCase):
    def setUp(self):
        self.here = pathlib.Path(tempfile.mkdtemp(prefix="vergence-calibration-bench-"))
        self.addCleanup(shutil.rmtree, self.here)

    def run_bench(self, folder, *more):
        return subprocess.run([sys.executable, "-B", str(SCRIPT), str(folder), "--board", "9x6",
                               "--square", "30", "--vergence", VERGENCE, "--samples", str(SAMPLES),
                               "--cache", str(self.here / "cache"), "--quick", *more],
                              capture_output=True, text=True, timeout=900, check=False)

    def test_table_of_all_methods(self):
        # Sides by folder; a picture of another size is excluded.
        for side in ("left", "right"):
            (self.here / "pictures" / side).mkdir(parents=True)
            for number in range(1, 9):
                shutil.copy(SAMPLES / f"{side}0{number}.jpg", self.here / "pictures" / side)
                name = self.here / "pictures" / side / f"{side}0{number}.jpg"
                name.rename(name.with_name(f"{number}.jpg"))
            shutil.copy(SAMPLES / f"{side}.jpg", self.here / "pictures" / side / "99.jpg")
        done = self.run_bench(self.here / "pictures", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        result = json.loads(done.stdout)
        self.assertEqual(result["pairs"], 8)
        for name, line in result["methods"].items():
            if name == "OpenCV, SB":
                continue  # it misses a board, and too many in halves
            with self.subTest(name):
                self.assertNotIn("error", line)
                self.assertEqual((line["views"], line["pairs"]), (8, 8))
                self.assertLess(abs(line["baseline_mm"] - 99.8), 2)
                self.assertLess(line["rows_common_px"], 0.6)
                self.assertGreater(line["seconds"], 0)
                self.assertGreater(line["ratio"], 0)
        for name in ("vergence", "OpenCV, window 5", "mrcal, OpenCV's corners"):
            self.assertLess(result["methods"][name]["held_out_common_px"], 0.4)

    def test_one_method_and_mistakes(self):
        pictures = self.here / "pictures"
        pictures.mkdir()
        done = self.run_bench(pictures)
        self.assertEqual(done.returncode, 1)
        self.assertIn("0 pairs", done.stderr)
        for side in ("left", "right"):
            for number in range(1, 6):
                shutil.copy(SAMPLES / f"{side}0{number}.jpg", pictures)
        done = self.run_bench(pictures, "--only", "window 5")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("OpenCV, window 5", done.stdout)
        self.assertNotIn("mrcal", done.stdout)


if __name__ == "__main__":
    unittest.main()

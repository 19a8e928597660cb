# SPDX-License-Identifier: Apache-2.0
"""The capture at all zooms that is kept in tests/data, from its corners and positions to a calibration."""
import json
import os
import pathlib
import tempfile
import unittest

from pairs import run

KEPT = pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tests" / "data" / "zoom_capture"
BOARD = ("--board", "10x7", "--square", "24", "--charuco", "4x4_50", "--marker", "17")


class ZoomCapture(unittest.TestCase):
    def test_the_kept_capture_is_solved_without_its_frames(self):
        with tempfile.TemporaryDirectory() as out:
            done = run("calibrate", str(KEPT), *BOARD, "--corners", str(KEPT / "corners.vnl"), "--out",
                       out + "/solved")
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(out + "/solved/calibration.json", encoding="utf-8") as file:
                found = json.load(file)
            self.assertEqual(found["zooms"], 13)
            self.assertGreater(found["corners"], 13000)
            self.assertLess(found["rms_px"], 0.02)
            self.assertLess(found["held_out_focal"], 0.002)
            self.assertTrue(os.path.exists(out + "/solved/instrument.zoom"))

    def test_without_corners_the_frames_are_missed(self):
        done = run("calibrate", str(KEPT), *BOARD, "--out", "nowhere")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        self.assertIn("frame-", done.stderr)


if __name__ == "__main__":
    unittest.main()

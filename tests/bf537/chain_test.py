# SPDX-License-Identifier: Apache-2.0
"""The whole chain on the instrument's own processor: bring-up, pan, zoom, exposure, a pair by DMA, its surface.
The surface is that which a PC makes of the same pair, byte for byte."""
import json
import math
import os
import pathlib
import subprocess
import tempfile
import unittest
import zlib

from bf537_board import Board, require_tool_chain
from waiting import TIMEOUT_S

setUpModule = require_tool_chain
RIG = ("--scene", "cylinder", "--rig", "perfect")
AIM = ("bringup", "window 160 120", "pan 3.97 right=-3.97", "zoom 310", "autoexpose")
SEARCH = {"near": "1700", "far": "1900", "preset": "board"}


def calibration_of(pan_deg, zoom_counts):
    """The true one of the perfect rig, of the middle 160 x 120 pixels of its sensors."""
    focal_px = (8.5 + (zoom_counts - 300) / 550 * 76.5) / 0.0032
    pan = math.radians(pan_deg)
    lines = ["vergence-calibration 1", "id chain", "date unknown", "note the true cameras", "rectified no"]
    for side in ("left", "right"):
        lines += [f"{side}_size_px 160 120", f"{side}_focal_px {focal_px:.9f} {focal_px:.9f}",
                  f"{side}_centre_px 79.500000000 59.500000000", f"{side}_k1 {0:.12f}", f"{side}_k2 {0:.10f}",
                  f"{side}_tangential {0:.12f} {0:.12f}", f"{side}_k3 {0:.8f}"]
    lines += [f"rotation_right_left_rad {0:.12f} {2 * pan:.12f} {0:.12f}",
              f"translation_right_left_mm {-250 * math.cos(pan):.9f} {0:.9f} {250 * math.sin(pan):.9f}",
              f"depth_range_mm {0:.3f} {0:.3f}", f"rms_px {0:.6f}"]
    body = "".join(line + "\n" for line in lines)
    return body + f"crc32 {zlib.crc32(body.encode()):08x}\n"


def vergence(*words, folder):
    return subprocess.run([os.environ["VERGENCE"], *words], check=True, capture_output=True, text=True, cwd=folder,
                          timeout=TIMEOUT_S).stdout


class Chain(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_the_surface_is_that_of_a_pc(self):
        board = Board(RIG)
        self.addCleanup(board.close)
        board.wait_prompt()
        self.assertRegex(board.type("reconstruct"), "ERR MISSING reconstruct: no pair")
        for line in AIM:
            self.assertRegex(board.type(line), r"\nOK\n", line)
        self.assertRegex(board.type("capture"), r"width: 160 px\n")
        self.assertRegex(board.type("reconstruct"), "ERR MISSING reconstruct: no calibration")

        def client(*words):
            done = board.client(*words, cwd=self.folder)
            self.assertEqual(done.returncode, 0, (words, done.stdout, done.stderr))
            return done.stdout

        state = json.loads(client("--json", "status"))["result"]
        (self.folder / "chain.txt").write_text(calibration_of(state["left"]["pan"], state["left"]["zoom"]))
        client("send", "chain.txt")
        self.assertIn("id: chain", client("calibration", "set", "chain.txt"))
        client("fetch", "pair-1")
        client("reconstruct", *(f"{name}={value}" for name, value in SEARCH.items()), "--out", "dsp")
        vergence("reconstruct", "pair-1/left.pgm", "pair-1/right.pgm", "--bayer", "grbg", "--calibration", "chain.txt",
                 *(word for name, value in SEARCH.items() for word in (f"--{name}", value)), "--out", "pc",
                 folder=self.folder)
        result = json.loads((self.folder / "dsp/result.json").read_text())
        self.assertGreater(result["counts"]["vertices"], 5000, result["counts"])
        for name in ("disparity.pfm", "reasons.png", "depth.png"):
            self.assertEqual((self.folder / "dsp" / name).read_bytes(), (self.folder / "pc" / name).read_bytes(), name)


if __name__ == "__main__":
    unittest.main()

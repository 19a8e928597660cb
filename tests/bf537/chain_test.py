# SPDX-License-Identifier: Apache-2.0
"""The whole chain on the instrument's own processor: the README's commands from bring-up to a surface by the
calibration of all zooms, then zoom by what is wanted, and focus. The surface is that which a PC makes of the same
pair, byte for byte."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from bf537_board import Board, require_tool_chain
from waiting import TIMEOUT_S

setUpModule = require_tool_chain
RIG = ("--scene", "cylinder", "--rig", "perfect")
DISTANCE_MM = 1800
README = (pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "firmware/bf537/README.md").read_text(encoding="utf-8")
COMMANDS = [line.split() for line in re.findall(r"(?m)^vergence --connect serial:dsp (.*)$", README)]


def vergence(*words, folder):
    return subprocess.run([os.environ["VERGENCE"], *words], check=True, capture_output=True, text=True, cwd=folder,
                          timeout=TIMEOUT_S).stdout


class Chain(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def assert_distance(self, mm):
        self.assertAlmostEqual(mm, DISTANCE_MM, delta=0.02 * DISTANCE_MM)

    def test_the_surface_is_that_of_a_pc(self):
        board = Board(RIG)
        self.addCleanup(board.close)
        board.wait_prompt()
        self.assertRegex(board.type("reconstruct"), "ERR MISSING reconstruct: no pair")
        (self.folder / "tests").symlink_to(pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tests")
        for words in COMMANDS:
            if words[0] == "send":
                self.assertRegex(board.type("zoom fit=100 distance=1800"), "ERR MISSING zoom: .* calibration")
            done = board.client(*words, cwd=self.folder)
            self.assertEqual(done.returncode, 0, (words, done.stdout, done.stderr))
        result = json.loads((self.folder / "surface/result.json").read_text())
        self.assertGreater(result["counts"]["vertices"], 4000, result["counts"])
        self.assert_distance(result["depth_mm"]["median"])
        self.assertEqual(board.client("fetch", "pair-1", cwd=self.folder).returncode, 0)
        search = [word for option in COMMANDS[-1] if "=" in option for word in ("--" + option).split("=")]
        (self.folder / "state.txt").write_text(result["calibration"]["text"])
        vergence("reconstruct", "pair-1/left.pgm", "pair-1/right.pgm", "--bayer", "grbg", "--calibration", "state.txt",
                 "--preset", "board", *search, "--out", "pc", folder=self.folder)
        for name in ("disparity.pfm", "reasons.png", "depth.png"):
            dsp, pc = ((self.folder / made / name).read_bytes() for made in ("surface", "pc"))
            self.assertEqual(dsp, pc, name)
        for line in ("window 96 96", "zoom density=3 distance=1800"):
            self.assertRegex(board.type(line), r"\nOK\n", line)
        found = re.findall(r"verdict: focused\n(?:.*\n){3}  distance: ([\d.]+) mm\n", board.type("autofocus"))
        self.assertEqual(len(found), 2)
        for mm in found:
            self.assert_distance(float(mm))


if __name__ == "__main__":
    unittest.main()

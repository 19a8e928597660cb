# SPDX-License-Identifier: Apache-2.0
"""One placement of each board meets the board's clocks, inside the bridge's share of the device."""
import os
import subprocess
import sys
import tempfile
import unittest

SOURCE = os.environ.get("VERGENCE_SOURCE") or os.path.join(os.path.dirname(__file__), "..", "..")
TOOL = os.path.join(SOURCE, "fpga", "tools", "synth.py")
FILES = {"xc3s": "bridge.edif", "hx8k": "bridge.bin", "up5k": "bridge.bin"}


class Synthesis(unittest.TestCase):
    def test_each_board_from_one_command(self):
        with tempfile.TemporaryDirectory(prefix="synthesis-") as folder:
            done = subprocess.run([sys.executable, "-B", TOOL, *FILES, "--seeds", "1", "--out", folder],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            for target, name in FILES.items():
                self.assertGreater(os.path.getsize(os.path.join(folder, target, name)), 100_000)


if __name__ == "__main__":
    unittest.main()

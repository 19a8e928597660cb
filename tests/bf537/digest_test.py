# SPDX-License-Identifier: Apache-2.0
"""The core computes the same bytes on the simulated BF537 as on this machine: the short form of the line that
tests/command/repository/portable_test.py compares between other processors."""
import os
import pathlib
import subprocess
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])


def output_of(*words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True).stdout.strip()


class Digest(unittest.TestCase):
    def test_the_processor_prints_the_line_of_this_machine(self):
        tool = ROOT / "tools/bfin-toolchain"
        if subprocess.run([tool, "--where"], capture_output=True, check=False).returncode != 0:
            self.skipTest("requires the tool chain of the Blackfin: run tools/bfin-toolchain once")
        program = pathlib.Path(output_of(ROOT / "tools/cross", "bfin")) / "firmware/bf537-digest"
        here = output_of(os.environ["CORE_DIGEST"], "--short")
        self.assertRegex(here, r"^math [0-9a-f]{8}  ")
        there = output_of(output_of(tool, "--simulator"), "--model", "bf537", program, "--short")
        self.assertEqual(there.split("  "), here.split("  "))


if __name__ == "__main__":
    unittest.main()

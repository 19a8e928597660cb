# SPDX-License-Identifier: Apache-2.0
"""The core computes the same bytes on the simulated BF537 as on this machine: the short form of the line that
tests/command/repository/portable_test.py compares between other processors, and the surface of a recorded pair by
`reconstruct` for Linux without an MMU."""
import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
PAIR = ROOT / "tests/sessions/small"
RECONSTRUCT = (PAIR / "frame-eca283d0.pnm", PAIR / "frame-9dc312fc.pnm", "--bayer", "grbg", "--calibration",
               PAIR / "calibration-7efa7ee4.txt", "--near", 1700, "--far", 1900, "--scale", 0.4, "--preset", "board")


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

    def test_reconstruct_for_linux_gives_the_surface_of_this_machine(self):
        build = ROOT / "tools/cross.d/build_fdpic"
        if subprocess.run([build, "--where"], capture_output=True, check=False).returncode != 0:
            self.skipTest("requires the C library of Linux on the Blackfin: run tools/cross fdpic once")
        program = pathlib.Path(output_of(ROOT / "tools/cross", "fdpic")) / "daemon/vergence-reconstruct"
        simulator = pathlib.Path(output_of(ROOT / "tools/bfin-toolchain", "--where")) / "bin/bfin-elf-run"
        words = [str(word) for word in RECONSTRUCT]
        there = subprocess.run([simulator, "--environment", "user", program, *words], check=True,
                               capture_output=True).stdout
        with tempfile.TemporaryDirectory() as folder:
            output_of(os.environ["VERGENCE"], "reconstruct", *words, "--out", folder)
            here = pathlib.Path(folder, "surface.compact").read_bytes()
        # The head states versions and times, the end is the CRC of all.
        rows_here, rows_there = (surface[surface.index(b"\nrows\n"):-4] for surface in (here, there))
        self.assertGreater(len(rows_here), 4000)
        self.assertEqual(rows_there, rows_here)


if __name__ == "__main__":
    unittest.main()

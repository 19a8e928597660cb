# SPDX-License-Identifier: Apache-2.0
"""No read or write of the bus, at any clock, changes the period or the width of the pulses."""
import os
import subprocess
import tempfile
import unittest

SOURCE = os.environ.get("VERGENCE_SOURCE") or os.path.join(os.path.dirname(__file__), "..", "..")


class Motion(unittest.TestCase):
    def test_the_bus_around_the_start_of_a_frame(self):
        fpga = os.path.join(SOURCE, "fpga")
        with tempfile.TemporaryDirectory(prefix="motion-") as folder:
            program = os.path.join(folder, "motion_bench")
            subprocess.run(
                ["iverilog", "-g2005", "-y", os.path.join(fpga, "rtl"), "-o", program,
                 os.path.join(SOURCE, "tests", "hdl", "motion_bench.v"),
                 os.path.join(fpga, "generated", "register_file.v")],
                check=True, capture_output=True)
            text = subprocess.run(["vvp", "-n", program], stdout=subprocess.PIPE, text=True,
                                  check=True, timeout=300).stdout
        self.assertRegex(text, r"^PASS [1-9][0-9]\n", text)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""I2C target and register file alone, at the limits of each bus speed and of the board's
clock.
"""
import os
import subprocess
import tempfile
import unittest

SOURCE = os.environ.get("VERGENCE_SOURCE") or os.path.join(os.path.dirname(__file__), "..", "..")

# Shortest SCL low and high in ns, SDA after the edge of SCL, half period of clk_i in ps, step
# between aborted bits.
SETTINGS = {
    "100 kHz": (4700, 4000, 0, 20000, 11),
    "400 kHz": (1300, 600, 0, 20000, 5),
    "1 MHz, fast clock": (500, 260, 0, 18182, 5),
    "1 MHz, slow clock": (500, 260, 0, 22222, 1),
    "1 MHz, late data": (500, 260, 400, 20000, 5),
}


class Control(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="control-")
        cls.program = os.path.join(cls.folder.name, "control_bench")
        fpga = os.path.join(SOURCE, "fpga")
        subprocess.run(
            ["iverilog", "-g2005", "-y", os.path.join(fpga, "rtl"), "-o", cls.program,
             os.path.join(SOURCE, "tests", "hdl", "control_bench.v"),
             os.path.join(fpga, "generated", "register_file.v")],
            check=True, capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_every_speed(self):
        running = {}
        for name, (low, high, hold, clock, step) in SETTINGS.items():
            command = ["vvp", "-n", self.program, f"+low_ns={low}", f"+high_ns={high}",
                       f"+hold_ns={hold}", f"+clock_ps={clock}", f"+step={step}"]
            running[name] = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        for name, process in running.items():
            with self.subTest(speed=name):
                text = process.communicate()[0]
                self.assertRegex(text, r"^PASS [1-9][0-9]{2,}\n", text)


if __name__ == "__main__":
    unittest.main()

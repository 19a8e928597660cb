# SPDX-License-Identifier: Apache-2.0
"""Tests the sensor router with an independent master and sensors under icarus:
fpga/cocotb/test_router.py. TRANSFERS (per speed), EVERY (step between interruptions) and SEED may
be set.
"""
import os
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

ROOT = os.path.realpath(os.environ.get("VERGENCE_SOURCE",
                                       os.path.join(os.path.dirname(__file__), "..", "..")))
FPGA = os.path.join(ROOT, "fpga")
MODULES = ("i2c_router", "i2c_bus_clear", "glitch_filter", "sync_bit", "bus_condition")
TESTS = 13
TIMEOUT_S = 900


def output(*words):
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()


class Router(unittest.TestCase):
    def test_router(self):
        found = subprocess.run([os.path.join(ROOT, "tools", "fpga_python")], capture_output=True,
                               text=True)
        if found.returncode != 0:
            self.skipTest(found.stderr.strip())
        python = os.path.join(found.stdout.strip(), "python3")
        config = (python, "-m", "cocotb_tools.config")
        with tempfile.TemporaryDirectory(prefix="router-") as folder:
            image = os.path.join(folder, "bench.vvp")
            subprocess.run(["iverilog", "-g2005", "-s", "router_bench", "-o", image,
                            os.path.join(FPGA, "cocotb", "router_bench.v"),
                            *(os.path.join(FPGA, "rtl", name + ".v") for name in MODULES)],
                           check=True)
            results = os.path.join(folder, "results.xml")
            done = subprocess.run(
                ["vvp", "-m", output(*config, "--lib-name-path", "vpi", "icarus"), image],
                cwd=folder, capture_output=True, text=True, timeout=TIMEOUT_S, env={
                    "TRANSFERS": "30", "EVERY": "4", **os.environ,
                    "PYTHONPATH": os.path.join(FPGA, "cocotb"), "PYTHONDONTWRITEBYTECODE": "1",
                    "GPI_USERS": output(*config, "--libpython") + ";" +
                                 output(*config, "--pygpi-entry-point"), "PYGPI_PYTHON_BIN": python,
                    "COCOTB_TEST_MODULES": "test_router", "TOPLEVEL": "router_bench",
                    "COCOTB_TOPLEVEL": "router_bench", "TOPLEVEL_LANG": "verilog",
                    "COCOTB_RESULTS_FILE": results})
            self.assertTrue(os.path.exists(results), done.stdout[-2000:] + done.stderr[-2000:])
            cases = list(xml.etree.ElementTree.parse(results).iter("testcase"))
            bad = [case.get("name") for case in cases if case.find("failure") is not None or
                   case.find("error") is not None]
            self.assertEqual((bad, len(cases)), ([], TESTS), done.stdout[-4000:])


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""The files generated from the register map are up to date, and wrong maps are rejected."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest

SOURCE = os.environ.get("VERGENCE_SOURCE") or os.path.join(os.path.dirname(__file__), "..", "..")
FPGA = os.path.join(SOURCE, "fpga")


def environment():
    """Directory of the programs of the Python environment with the parser of SystemRDL."""
    return subprocess.run([os.path.join(SOURCE, "tools", "fpga_python")], check=True,
                          capture_output=True, text=True).stdout.strip()


class Map(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.python = os.path.join(environment(), "python3")

    def run_tool(self, *arguments):
        return subprocess.run(
            [self.python, "-B", os.path.join(FPGA, "tools", "registers.py"), *arguments],
            capture_output=True, text=True)

    def test_nothing_is_stale(self):
        done = self.run_tool("--check")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_stale_file_is_named(self):
        with tempfile.TemporaryDirectory(prefix="map-") as folder:
            generated = os.path.join(folder, "generated")
            shutil.copytree(os.path.join(FPGA, "generated"), generated)
            names = sorted(os.listdir(generated))
            self.assertGreaterEqual(len(names), 6)
            for name in names:
                path = os.path.join(generated, name)
                with open(path, "a", encoding="utf-8") as file:
                    file.write("\n")
                done = self.run_tool("--check", "--into", generated)
                self.assertEqual(done.returncode, 1, name)
                self.assertIn(name, done.stderr)
                self.assertEqual(self.run_tool("--into", generated).returncode, 0)
                self.assertEqual(self.run_tool("--check", "--into", generated).returncode, 0)

    def test_wrong_maps_are_refused(self):
        with open(os.path.join(FPGA, "registers.rdl"), encoding="utf-8") as file:
            text = file.read()
        mistakes = {
            "reset value outside": ("max = 25000;", "max = 19999;"),
            "low bits that are not stored": ("value[15:0] = 640;", "value[15:0] = 641;"),
            "codes must run": ("encode = camera_source; max = 2; desc = \"Requested",
                               "encode = camera_source; max = 1; desc = \"Requested"),
            "low word must follow": ("frame_time_low @0x8C", "frame_time_low @0x8E"),
            "not valid SystemRDL": ("addrmap bridge {", "addrmap bridge { reg"),
        }
        with tempfile.TemporaryDirectory(prefix="map-") as folder:
            path = os.path.join(folder, "registers.rdl")
            for sentence, (good, bad) in mistakes.items():
                with self.subTest(mistake=sentence):
                    self.assertEqual(text.count(good), 1)
                    with open(path, "w", encoding="utf-8") as file:
                        file.write(text.replace(good, bad))
                    done = self.run_tool("--map", path, "--into", folder)
                    self.assertEqual(done.returncode, 2, done.stderr)
                    self.assertIn(sentence, done.stderr)

    def test_the_header_compiles_alone(self):
        header = os.path.join(FPGA, "generated", "bridge_registers.h")
        for command in (["cc", "-std=c11", "-x", "c"], ["c++", "-std=c++17", "-x", "c++"]):
            done = subprocess.run(
                [*command, "-Wall", "-Wextra", "-Werror", "-fsyntax-only", header],
                capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_vectors_know_both_outcomes(self):
        path = os.path.join(FPGA, "generated", "bridge_registers.json")
        with open(path, encoding="utf-8") as file:
            registers = json.load(file)["registers"]
        for register in registers:
            outcomes = {write["accepted"] for write in register["writes"]}
            self.assertEqual(True in outcomes, "WRITE" in register["flags"], register["name"])
        self.assertGreater(sum(len(register["writes"]) for register in registers), 500)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""fpga/tools/cdc.py finds each kind of wrong crossing; the bridge has none."""
import os
import subprocess
import sys
import tempfile
import json
import unittest

ROOT = os.environ.get("VERGENCE_SOURCE", os.path.join(os.path.dirname(__file__), "..", ".."))
HERE = os.path.join(os.path.realpath(ROOT), "tests", "hdl")
WRONG = {"bits: word (clk_a_i) -> torn_1 (clk_b_i)", "clock: gated (gated) -> gated (gated)",
         "logic: flag (clk_a_i) -> mixed_1 (clk_b_i)", "logic: other (clk_a_i) -> mixed_1 (clk_b_i)",
         "logic: other (clk_a_i) -> single (clk_b_i)", "reset: flag (clk_a_i) -> cleared (clk_b_i)"}


def run(*arguments):
    return subprocess.run([sys.executable, "-B", os.path.join(ROOT, "fpga", "tools", "cdc.py"),
                           *arguments], capture_output=True, text=True)


class Cdc(unittest.TestCase):
    def judged(self, waivers):
        with open(os.path.join(HERE, "cdc", "settings.json"), encoding="ascii") as file:
            settings = json.load(file)
        settings["waivers"] = waivers
        with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
            json.dump(settings, file)
            file.flush()
            return run("--settings", file.name)

    def test_each_wrong_crossing_is_found(self):
        done = self.judged([])
        lines = done.stdout.splitlines()
        self.assertEqual((done.returncode, set(lines[:-1]), done.stderr), (1, WRONG, ""))
        self.assertIn("4 synchroniser", lines[-1])

    def test_a_waiver_takes_what_it_names(self):
        done = self.judged([{"kind": "logic", "from": "*", "to": "mixed_1", "reason": "for the test"}])
        self.assertEqual(set(done.stdout.splitlines()[:-1]),
                         {line for line in WRONG if "mixed_1" not in line})

    def test_a_waiver_without_use_is_found(self):
        done = self.judged([{"kind": "logic", "from": "no", "to": "no", "reason": "for the test"}])
        self.assertIn("unused waiver: logic no -> no", done.stdout)

    def test_the_bridge(self):
        done = run()
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)


if __name__ == "__main__":
    unittest.main()

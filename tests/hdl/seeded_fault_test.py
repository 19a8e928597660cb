# SPDX-License-Identifier: Apache-2.0
"""The mutations of the Verilog in tools/campaign fpga can still be applied."""
import json
import pathlib
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLE = json.loads((ROOT / "fpga/tools/seeded_faults.json").read_text())


class SeededFaults(unittest.TestCase):
    def test_each_text_stands_once_in_its_file(self):
        for entry in TABLE:
            with self.subTest(entry["name"]):
                text = (ROOT / "fpga" / entry["file"]).read_text()
                self.assertEqual(text.count(entry["replace"]), 1)
                self.assertNotEqual(entry["replace"], entry["with"])

    def test_each_program_has_one(self):
        programs = {"hdl_" + path.stem for path in (ROOT / "tests/hdl").glob("*_test.cpp")}
        self.assertEqual(programs - {entry["test"] for entry in TABLE}, set())


if __name__ == "__main__":
    unittest.main()

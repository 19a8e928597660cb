# SPDX-License-Identifier: Apache-2.0
"""No stage of the stereo pipeline costs more cycles of the BF537 than was accepted: the simulator counts the
same ones in every run. `tools/bench bf537 --write` accepts new counts."""
import json
import os
import pathlib
import subprocess
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
MORE_PERCENT = 3


class CyclesTest(unittest.TestCase):
    def test_no_stage_costs_more_than_accepted(self):
        if subprocess.run([ROOT / "tools/bfin-toolchain", "--where"], capture_output=True, check=False).returncode:
            self.skipTest("requires the tool chain of the Blackfin: run tools/bfin-toolchain once")
        done = subprocess.run([ROOT / "tools/bench", "bf537", "--quick", "--json"], check=True, capture_output=True,
                              text=True)
        stages = json.loads(done.stdout)["stages"]
        accepted = json.loads(pathlib.Path(__file__).with_name("cycles.json").read_text(encoding="utf-8"))
        self.assertEqual(stages.keys(), accepted.keys())
        for name, kilocycles in accepted.items():
            with self.subTest(name):
                self.assertLessEqual(stages[name]["kilocycles"], kilocycles * (1 + MORE_PERCENT / 100),
                                     f"{name} costs more: if it must, tools/bench bf537 --write accepts it")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""The commands of FIRST_HOUR.md for the simulated rig, run as written by a user without root. Those for
webcams: webcams_test.py."""
import json
import os
import pathlib
import re
import subprocess
import unittest

from as_user import VERGENCE, UserTest
from daemon_process import SIMRIG, VERGENCED

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
BUILD = '$(tools/build --where demo)'


def commands(block):
    text = (ROOT / "FIRST_HOUR.md").read_text(encoding="utf-8")
    (found,) = re.findall(rf"^```sh {block}\n(.*?)^```", text, re.S | re.M)
    return [line for line in found.splitlines() if line.strip() and not line.startswith("#")]


class Page(unittest.TestCase):
    def test_every_block_has_its_test(self):
        text = (ROOT / "FIRST_HOUR.md").read_text(encoding="utf-8")
        self.assertEqual(re.findall(r"^```(\S.*)$", text, re.M),
                         ["sh build", "sh simulated", "sh webcams"])

    def test_the_named_files_exist(self):
        text = (ROOT / "FIRST_HOUR.md").read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)#]+)\)", text) + re.findall(r"`(tests/[\w./]+)`", text):
            self.assertTrue((ROOT / target).exists(), target)

    def test_build(self):
        """demo_test runs tools/demo; here this test's build stands in for the demo's."""
        demo, path = commands("build")
        self.assertEqual(demo, "tools/demo --quick")
        self.assertEqual(path.count(BUILD), 2)
        build = pathlib.Path(VERGENCE).parent.parent
        line = path.replace(BUILD, str(build)) + " && command -v vergence vergenced"
        done = subprocess.run(["bash", "-c", line], cwd=ROOT, capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.stdout.split(), [VERGENCE, VERGENCED], done.stderr)


@unittest.skipUnless(SIMRIG, "the simulated rig requires -DVERGENCE_FPGA=ON")
class FirstHour(UserTest):
    def test_from_nothing_to_a_measured_object(self):
        programs = {os.path.dirname(program) for program in (VERGENCE, VERGENCED)}
        self.environment["PATH"] = os.pathsep.join([*programs, os.environ["PATH"]])
        (self.home / "tools").symlink_to(ROOT / "tools")
        rig, daemon, *lines = commands("simulated")
        self.begin_until("listening on", "bash", "-c", "exec " + rig.removesuffix(" &"))
        self.begin_daemon("bash", "-c", "exec " + daemon.removesuffix(" &"))
        self.assertGreaterEqual(len(lines), 8)
        printed = {}
        for line in lines:
            done = self.run_as_user("bash", "-c", line)
            self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")
            printed[line] = done.stdout
        result = json.loads((self.home / "surface" / "result.json").read_text(encoding="utf-8"))
        self.assertGreater(result["counts"]["vertices"], 1000000)
        self.assertTrue((self.home / "surface" / "report.html").exists())
        # The object that the last command compares: most of its texture measured, to half a pixel.
        table = printed[lines[-1]]
        measured, error_px = re.search(r"^textured +\d+ +([\d.]+) % +([\d.]+) px", table, re.M).groups()
        self.assertGreater(float(measured), 85, table)
        self.assertLess(float(error_px), 0.5, table)


if __name__ == "__main__":
    unittest.main()

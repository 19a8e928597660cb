# SPDX-License-Identifier: Apache-2.0
"""The README's first hour without hardware, typed exactly as written by a user without root."""
import json
import os
import pathlib
import re
import unittest

from as_user import VERGENCE, UserTest
from daemon_process import SIMRIG, VERGENCED

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])


def commands():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    block = re.findall(r"^```sh simulated\n(.*?)^```", text, re.S | re.M)
    return [line for line in block[0].splitlines() if line.strip() and not line.startswith("#")]


@unittest.skipUnless(SIMRIG, "the simulated rig needs -DVERGENCE_FPGA=ON")
class FirstHour(UserTest):
    def test_from_nothing_to_a_surface(self):
        programs = {os.path.dirname(program) for program in (VERGENCE, VERGENCED)}
        self.environment["PATH"] = os.pathsep.join([*programs, os.environ["PATH"]])
        (self.home / "tools").symlink_to(ROOT / "tools")
        rig, daemon, *lines = commands()
        self.begin_until("listening on", "bash", "-c", "exec " + rig.removesuffix(" &"))
        self.begin_daemon("bash", "-c", "exec " + daemon.removesuffix(" &"))
        self.assertGreaterEqual(len(lines), 6)
        for line in lines:
            done = self.run_as_user("bash", "-c", line)
            self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")
        result = json.loads((self.home / "surface" / "result.json").read_text(encoding="utf-8"))
        self.assertGreater(result["counts"]["vertices"], 1000000)
        self.assertTrue((self.home / "surface" / "report.html").exists())


if __name__ == "__main__":
    unittest.main()

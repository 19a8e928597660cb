# SPDX-License-Identifier: Apache-2.0
"""The commands of FIRST_HOUR.md for the simulated rig, run as written by a user without root. Those for
webcams: webcams_test.py."""
import json
import os
import pathlib
import re
import signal
import subprocess
import unittest

from as_user import AS_USER, VERGENCE, UserTest
from daemon_process import SIMRIG, TIMEOUT_S, VERGENCED
from waiting import wait_until

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
BUILD = '$(tools/build --where demo)'


def pasted(block):
    text = (ROOT / "FIRST_HOUR.md").read_text(encoding="utf-8")
    (found,) = re.findall(rf"^```sh {block}\n(.*?)^```", text, re.S | re.M)
    return found


def commands(block):
    return [line for line in pasted(block).splitlines() if line.strip() and not line.startswith("#")]


class Page(unittest.TestCase):
    def test_every_block_has_its_test(self):
        text = (ROOT / "FIRST_HOUR.md").read_text(encoding="utf-8")
        self.assertEqual(re.findall(r"^```(\S.*)$", text, re.M),
                         ["sh build", "sh simulated", "sh zooms", "sh webcams"])

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
    """Blocks as pasted: each one script, in an empty folder, without waiting in between."""

    def setUp(self):
        super().setUp()
        programs = {os.path.dirname(program) for program in (VERGENCE, VERGENCED)}
        self.environment["PATH"] = os.pathsep.join([*programs, os.environ["PATH"]])

    def paste(self, name):
        """The output of a block."""
        script = pasted(name)
        with open(self.folder / "output", "w+", encoding="utf-8") as file:
            # What it leaves in the background belongs to its group of processes.
            shell = subprocess.Popen([*AS_USER, "bash", "-e", "-c", script], cwd=self.home,
                                     env=self.environment, stdin=subprocess.DEVNULL, stdout=file,
                                     stderr=file, start_new_session=True)
            self.addCleanup(self.end_group, shell.pid)
            shell.wait(20 * TIMEOUT_S)
            file.seek(0)
            text = file.read()
        self.assertEqual(shell.returncode, 0, text)
        return text

    @staticmethod
    def end_group(group):
        try:
            os.killpg(group, signal.SIGTERM)
            wait_until(lambda: os.killpg(group, 0))  # until none is left
        except ProcessLookupError:
            pass

    def test_from_nothing_to_a_measured_object(self):
        (self.home / "tests").symlink_to(ROOT / "tests")  # the block begins in the folder of the page
        text = self.paste("simulated")
        folder = self.home / "first-hour"
        result = json.loads((folder / "scene-surface" / "result.json").read_text(encoding="utf-8"))
        self.assertGreater(result["counts"]["vertices"], 200000)
        self.assertTrue((folder / "scene-surface" / "report.html").exists())
        self.assertEqual(sorted(path.name for path in self.home.iterdir() if path.name[0] != "."),
                         ["first-hour", "tests"])
        # The object that simrig-compare shows last: most of its texture is measured, and all of it is off by
        # what is predicted for a pair alone.
        table = re.findall(r"^textured +\d+ +([\d.]+) % +[\d.]+ px +([\d.]+) mm", text, re.M)
        measured, error_mm = table[-1]
        self.assertGreater(float(measured), 85, text)
        self.assertLess(float(error_mm), 3 * result["depth_sigma_common_mm"], text)
        # The plan names what the whole measurement does beyond a quick one.
        self.assertIn("step iris: f/", text)
        self.assertIn("written: view-", text)

    def test_all_zooms_and_a_board_that_moves(self):
        (self.home / "tests").symlink_to(ROOT / "tests")  # the block begins in the folder of the page
        text = self.paste("zooms")
        folder = self.home / "zooms"
        result = json.loads((folder / "surface" / "result.json").read_text(encoding="utf-8"))
        self.assertLess(result["depth_sigma_common_mm"], 20)
        self.assertAlmostEqual(result["depth_mm"]["median"], 1810, delta=60)
        self.assertIn("with pair   pair 1: pan stood still", text)
        mark = re.search(r"as a mark +([\d.,]+) ", text)[1].split(",")
        self.assertEqual(len(mark), 4, text)
        # Before and after the move, at both distances.
        away = [int(number) for number in re.findall(r"corners, (\d+) mm away", text)]
        self.assertEqual(len(away), 2, text)
        self.assertAlmostEqual(away[0] - away[1], 100, delta=25)
        squares = re.findall(r"^refined +squares ([\d.]+) mm", text, re.M)
        self.assertEqual([abs(float(square) - 24) < 1 for square in squares], [True, True], text)
        self.assertEqual(text.count("\nGood: the squares agree"), 2, text)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of tools/regress, whose modules can be imported after this one."""
import json
import os
import pathlib
import shutil
import subprocess
import sys

from pairs import VERGENCE, Fixture

SOURCE = pathlib.Path(os.environ["VERGENCE_SOURCE"])
sys.path.insert(0, str(SOURCE / "tools" / "regress.d"))
sys.dont_write_bytecode = True


def regress(*arguments, timeout=300):
    return subprocess.run([SOURCE / "tools" / "regress", "--vergence", VERGENCE,
                           *map(str, arguments)], capture_output=True, text=True, timeout=timeout)


class Recorded(Fixture):
    """A directory with a pair, its calibration and options."""

    def setUp(self):
        super().setUp()
        self.folder = self.directory / "recorded"
        self.folder.mkdir()
        shutil.copy(self.left_path, self.folder / "left.png")
        shutil.copy(self.right_path, self.folder / "right.png")
        shutil.copy(self.calibration_text(), self.folder / "calibration.txt")
        (self.folder / "regress").mkdir()
        self.pictures = self.directory / "pictures"
        self.options(arguments=["--disparity", "0:48"])

    def options(self, **keys):
        (self.folder / "regress" / "options.json").write_text(json.dumps(keys))

    def accept(self, reason="first"):
        done = regress("--accept", reason, self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def compare(self, code, *arguments):
        done = regress("--out", self.pictures, *arguments, self.folder)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done

    def refused(self, *words):
        done = self.compare(3)
        self.assertEqual(done.stdout, "")
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

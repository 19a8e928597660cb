# SPDX-License-Identifier: Apache-2.0
"""tools/regress: the recorded sessions match their references, and a change is reported."""
import json
import os
import pathlib
import shutil
import subprocess
import unittest

from pairs import VERGENCE, Fixture

SOURCE = pathlib.Path(os.environ["VERGENCE_SOURCE"])
SESSIONS = sorted(path.parent for path in
                  pathlib.Path(os.environ["VERGENCE_SESSIONS"]).glob("*/session.index"))
MAX_BYTES = 2_000_000


class Regress(Fixture):
    def setUp(self):
        super().setUp()
        self.folder = self.directory / "recorded"
        (self.folder / "regress").mkdir(parents=True)
        shutil.copy(self.left_path, self.folder / "left.png")
        shutil.copy(self.right_path, self.folder / "right.png")
        shutil.copy(self.calibration_text(), self.folder / "calibration.txt")
        self.options(arguments=["--disparity", "0:48"])

    def options(self, **keys):
        (self.folder / "regress" / "options.json").write_text(json.dumps(keys))

    def regress(self, code, *arguments):
        done = subprocess.run([SOURCE / "tools" / "regress", "--vergence", VERGENCE, "--out",
                               self.directory / "pictures", *arguments],
                              capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout if code < 2 else done.stderr

    def test_a_change_is_reported_and_a_tolerance_respected(self):
        self.regress(0, "--accept", "because it is the first", self.folder)
        same = self.regress(0, self.folder)
        self.assertIn("because it is the first", same)
        self.assertNotIn("BAD", same)
        self.assertTrue((self.directory / "pictures" / "recorded-pair.png").exists())
        self.options(arguments=["--disparity", "0:20"])
        self.assertIn("BAD", self.regress(1, self.folder))
        self.options(arguments=["--disparity", "0:48", "--no-refine"],
                     tolerance={"disparity_px": 1})
        self.assertNotIn("BAD  disparity_off", self.regress(1, self.folder))
        self.options(arguments=["--disparity", "0:20"])
        self.regress(0, "--accept", "fewer disparities", self.folder)
        self.regress(0, self.folder)

    def test_what_cannot_be_measured_is_named(self):
        for folder, word in ((self.directory / "nosuch", "nosuch"), (self.folder, "--accept")):
            self.assertIn(word, self.regress(3, folder))
        for arguments, word in (([], "DIR"), (["--accept"], "--accept"), (["--x", "d"], "--x")):
            self.assertIn(word, self.regress(2, *arguments))

    def test_recorded_sessions_are_as_accepted(self):
        self.assertGreaterEqual(len(SESSIONS), 3)
        for session in SESSIONS:
            size = sum(path.stat().st_size for path in session.rglob("*") if path.is_file())
            self.assertLessEqual(size, MAX_BYTES, session)
        self.assertEqual(self.regress(0, *SESSIONS).count(": as accepted on"), len(SESSIONS))


if __name__ == "__main__":
    unittest.main()

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
        return self.regress_into_cache(code, "--out", self.directory / "pictures", *arguments)

    def regress_into_cache(self, code, *arguments):
        done = subprocess.run([SOURCE / "tools" / "regress", "--vergence", VERGENCE, *arguments],
                              capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout if code < 2 else done.stderr

    def test_a_change_is_reported_and_a_tolerance_respected(self):
        self.regress(0, "--accept", "because it is the first", self.folder)
        same = self.regress(0, self.folder)
        self.assertIn("because it is the first", same)
        self.assertNotIn("BAD", same)
        self.options(arguments=["--disparity", "0:20"])
        self.assertIn("BAD", self.regress(1, self.folder))
        self.options(arguments=["--disparity", "0:48", "--no-refine"])
        self.assertIn("BAD  map ", self.regress(1, self.folder))
        self.options(arguments=["--disparity", "0:48", "--no-refine"],
                     tolerance={"disparity_px": 1})
        self.assertNotRegex(self.regress(1, self.folder), "BAD  (map|disparity)")
        self.options(arguments=["--disparity", "0:20"])
        self.regress(0, "--accept", "fewer disparities", self.folder)
        self.regress(0, self.folder)
        # What git has to keep of a change.
        sizes = [path.stat().st_size for path in (self.folder / "regress").iterdir()]
        self.assertLess(sum(sizes), 20000)

    def test_a_deviation_leaves_maps_and_a_picture_in_the_folder_that_is_named(self):
        self.regress(0, "--accept", "because it is the first", self.folder)
        self.options(arguments=["--disparity", "0:20"])
        found = self.directory / "pictures" / "recorded-pair"
        self.assertIn(str(found), self.regress(1, self.folder))
        for name in ("now/disparity.pfm", "reference/disparity.pfm", "now/reasons.png",
                     "difference.png"):
            self.assertTrue((found / name).exists(), name)
        shutil.rmtree(self.directory / "pictures")  # a cache may be emptied
        self.assertIn("no map of the reference", self.regress(1, self.folder))
        self.assertTrue((found / "difference.png").exists())
        self.assertFalse((found / "reference").exists())

    def test_a_block_that_moves_is_seen_where_quantiles_are_not(self):
        self.regress(0, "--accept", "because it is the first", self.folder)
        path = self.folder / "regress" / "reference.json"
        reference = json.loads(path.read_text())
        pair = reference["pairs"][0]
        pair["map_crc32"] = "0" * 8
        share, middle = pair["blocks"][4].split()[5].split(":")
        pair["blocks"][4] = pair["blocks"][4].replace(f"{share}:{middle}",
                                                      f"{share}:{float(middle) + 0.5:.3f}", 1)
        path.write_text(json.dumps(reference))
        keys = {"disparity_px": 0.25, "points_mm": 1, "shares_percent": 1, "figures_percent": 1}
        self.options(arguments=["--disparity", "0:48"], tolerance=keys)
        self.assertEqual(self.regress(1, self.folder).count("BAD  "), 1)
        self.options(arguments=["--disparity", "0:48"], tolerance={**keys, "blocks_off_percent": 3})
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
        # Where they are not, the maps outlive the test.
        same = self.regress_into_cache(0, *SESSIONS)
        self.assertEqual(same.count(": as accepted on"), len(SESSIONS))


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of `vergence calibrate`."""
import json
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import boards
from pairs import VERGENCE


class Fixture(unittest.TestCase):
    """A folder with ten good pairs, to be spoiled."""

    @classmethod
    def setUpClass(cls):
        cls.made = boards.pairs()

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-calibrate-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.pictures = self.folder / "pictures"
        self.pictures.mkdir()
        self.out = self.folder / "out"

    def good(self):
        boards.write(self.pictures, self.made)

    def run_on(self, *operands, board=None, out=None, **options):
        arguments = [VERGENCE, "calibrate", *map(str, operands or [self.pictures]),
                     *map(str, boards.OPTIONS if board is None else board), "--out",
                     str(out or self.out)]
        return subprocess.run(arguments, capture_output=True, text=True, timeout=300, **options)

    def figures(self):
        return json.loads((self.out / "calibration.json").read_text())

    def assert_good(self, done, pairs=10):
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("Good: ", done.stdout.splitlines()[-1])
        figures = self.figures()
        self.assertEqual(figures["fit"]["pairs_used"], pairs, done.stderr)
        self.assertLess(figures["fit"]["rms_px"], 0.1)
        rig = figures["rig"]
        self.assertLess(abs(rig["baseline_mm"] - boards.BASELINE_MM),
                        5 * rig["baseline_sigma_mm"] + 0.05)
        return figures

    def assert_not_good(self, done, *words):
        """Written, and marked."""
        self.assertEqual(done.returncode, 5, done.stdout + done.stderr)
        last = done.stderr.splitlines()[-1]
        self.assertTrue(last.startswith("vergence calibrate: Not good: "), last)
        for word in words:
            self.assertIn(word, last)
        self.assertNotIn("Good: ", done.stdout)
        self.assertFalse(self.figures()["verdict"]["good"])
        self.assertIn("note NOT GOOD: ", (self.out / "rig.calibration").read_text())

    def assert_refused(self, done, code, *words):
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertEqual(done.stdout, "")
        last = done.stderr.splitlines()[-1]
        self.assertTrue(last.startswith("vergence calibrate: "), done.stderr)
        for word in words:
            self.assertIn(word, last)
        for line in done.stderr.splitlines()[:-1]:
            self.assertTrue(line.startswith("vergence: note: "), line)
        self.assertEqual([p.name for p in self.folder.iterdir() if p.name != "pictures"], [])

    def note(self, done, name):
        """The one note that names a picture."""
        lines = [line for line in done.stderr.splitlines()
                 if line.startswith("vergence: note: ") and name in line]
        self.assertEqual(len(lines), 1, done.stderr)
        return lines[0]

# SPDX-License-Identifier: Apache-2.0
"""tests/slow_tests.py: the table is of tests and files that exist, and a change names its tests."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
sys.path.insert(0, str(ROOT / "tests"))

import slow_tests  # noqa: E402

AUTHOR = ("-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false")


class Table(unittest.TestCase):
    def test_it_names_files_of_the_tree(self):
        missing = [path for guarded in slow_tests.GUARDS.values() for path in guarded
                   if not (ROOT / path).exists()]
        self.assertEqual(missing, [])

    @unittest.skipUnless("VERGENCE_BUILD" in os.environ, "which tests there are, the build knows")
    def test_it_names_tests(self):
        listed = subprocess.run(["ctest", "--test-dir", os.environ["VERGENCE_BUILD"], "-N"],
                                capture_output=True, text=True, check=True).stdout
        names = re.findall(r"Test +#\d+: (\S+)", listed)
        if "hdl/lint" not in names:
            self.skipTest("needs -DVERGENCE_FPGA=ON")
        none = [name for name in slow_tests.GUARDS
                if not any(re.fullmatch(name, test) for test in names)]
        self.assertEqual(none, [])
        # What is left out is what the table names.
        self.assertIsNone(re.search(slow_tests.exclude(), "hdl/symbols_test_0"))
        self.assertIsNotNone(re.search(slow_tests.exclude(), "hdl/symbols_test_1"))


class Changes(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.git("init", "-q", "-b", "main")
        self.write("README.md", "calib/a.cpp")
        self.commit()

    def git(self, *words):
        subprocess.run(["git", "-C", str(self.root), *AUTHOR, *words], check=True,
                       capture_output=True)

    def write(self, *paths):
        for path in paths:
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            with open(self.root / path, "a", encoding="ascii") as file:
                file.write("x\n")

    def commit(self):
        self.git("add", "-A")
        self.git("commit", "-q", "-m", "x")

    def test_a_change_names_the_tests_that_guard_it(self):
        self.write("README.md")
        self.commit()
        self.assertEqual(slow_tests.advice(self.root), "")
        self.write("calib/a.cpp")
        self.assertIn("simrig/true_calibration_test", slow_tests.advice(self.root))
        self.assertNotIn("install_test", slow_tests.advice(self.root))
        self.commit()
        self.assertIn("simrig/true_calibration_test", slow_tests.advice(self.root))
        self.write("daemon/install/new.service")  # git does not know it yet
        self.assertIn("command/install_test", slow_tests.advice(self.root))

    def test_a_branch_is_compared_with_where_it_left(self):
        self.git("checkout", "-q", "-b", "mine")
        for path in ("calib/a.cpp", "README.md", "README.md"):
            self.write(path)
            self.commit()
        self.assertIn("bench/calibration", slow_tests.advice(self.root))
        self.assertEqual(slow_tests.advice(self.root, "HEAD~1"), "")

    def test_without_git_it_reports_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(slow_tests.advice(pathlib.Path(folder)), "")


if __name__ == "__main__":
    unittest.main()

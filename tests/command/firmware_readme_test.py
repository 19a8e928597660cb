# SPDX-License-Identifier: Apache-2.0
"""firmware/README.md: the test commands select tests, and the files it names exist."""
import os
import re
import subprocess
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
BUILD = os.path.dirname(os.path.dirname(os.environ["VERGENCE"]))
FIRMWARE = os.path.join(ROOT, "firmware")
with open(os.path.join(FIRMWARE, "README.md"), encoding="utf-8") as file:
    TEXT = file.read()


def output(*words):
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout


class Readme(unittest.TestCase):
    def test_the_commands_exist_and_select_tests(self):
        known = output(os.path.join(ROOT, "tools", "test"), "--help")
        commands = re.findall(r"^tools/test (.*?)--only '(\S+)'", TEXT, re.M)
        self.assertGreaterEqual(len(commands), 3)
        for options, regex in commands:
            for option in options.split():
                self.assertIn(option, known)
            listed = output("ctest", "--test-dir", BUILD, "-N", "-R", regex)
            self.assertRegex(listed, r"Total Tests: [1-9]", regex)
        for campaign in re.findall(r"^tools/campaign (\w+)", TEXT, re.M):
            self.assertIn(campaign, output(os.path.join(ROOT, "tools", "campaign"), "--help"))

    def test_the_named_files_exist(self):
        files = {name for _, _, names in os.walk(FIRMWARE) for name in names}
        named = re.findall(r"`(?:\w+/)?(\w+\.(?:c|h|md))`", TEXT)
        self.assertGreater(len(named), 25)
        for name in named:
            self.assertIn(name, files)
        for link in re.findall(r"\]\(([^)#]+)\)", TEXT):
            self.assertTrue(os.path.exists(os.path.join(FIRMWARE, link)), link)


if __name__ == "__main__":
    unittest.main()

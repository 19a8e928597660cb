# SPDX-License-Identifier: Apache-2.0
"""firmware/README.md: the test commands select tests."""
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


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""The manual pages that the build generates from the option tables: complete and well-formed."""
import glob
import os
import re
import shutil
import subprocess
import unittest

from pairs import VERGENCE, run

DAEMON = os.path.dirname(os.environ["VERGENCE_BOARD"])
PAGES = {os.path.basename(path): path
         for pattern in (os.path.join(os.path.dirname(VERGENCE), "install", "man", "man*", "*"),
                         os.path.join(DAEMON, "*.[1-9]"))
         for path in glob.glob(pattern)}


def shown(page):
    """The page as the user sees it, without line breaks."""
    done = subprocess.run(["man", "--warnings", "--no-hyphenation", "-l", PAGES[page]], text=True,
                          capture_output=True, env={**os.environ, "MANWIDTH": "200", "LC_ALL": "C"})
    assert (done.returncode, done.stderr) == (0, ""), (page, done.stderr)
    return " ".join(done.stdout.split())


class Manuals(unittest.TestCase):
    def test_each_command_has_a_page_with_all_its_options(self):
        commands = re.findall(r"^  ([a-z]+(?: [a-z]+)?)  ", run("--help").stdout, re.M)
        self.assertLessEqual({"reconstruct", "calibrate capture"}, set(commands))
        front = shown("vergence.1")
        for command in (*commands, "connect"):
            name = command.replace(" ", "-")
            text = shown(f"vergence-{name}.1")
            page = run("help", *command.split()).stdout
            options = re.findall(r"^    (--\S+(?: \S+)?)$", page, re.M)
            self.assertGreater(len(options), 1, command)
            for option in options:
                self.assertIn(f" {option} ", text)
            for line in page.partition("\nExamples\n")[2].splitlines():
                self.assertIn(" ".join(line.split()), text)
            self.assertIn(f"vergence-{name}(1)", front)

    def test_the_daemon_has_its_pages(self):
        vergenced = os.path.join(DAEMON, "vergenced")
        text = shown("vergenced.8")
        for option in re.findall(r"^    (--\S+)", run("--help", program=vergenced).stdout, re.M):
            self.assertIn(f" {option} ", text)
        text = shown("vergenced.conf.5")
        # Its defaults are those of the service.
        service = {**os.environ, "RUNTIME_DIRECTORY": "/run/vergence"}
        lines = re.findall(r"^#?([a-z][\w.]*) = (.*)$",
                           run("--help-config", program=vergenced, env=service).stdout, re.M)
        self.assertGreater(len(lines), 50)
        for key, value in lines:
            self.assertIn(f" {key} {value} ", text)
        text = shown("vergence-console.7")
        for usage in ("capture [NAME]", "pan [ANGLE]", "fetch NAME", "replay SESSION"):
            self.assertIn(usage, text)

    def test_they_are_well_formed(self):
        self.assertTrue(shutil.which("mandoc"), "mandoc is missing: tools/install_packages test")
        self.assertGreater(len(PAGES), 10)
        done = subprocess.run(["mandoc", "-Tlint", *PAGES.values()], capture_output=True, text=True)
        self.assertEqual((done.stdout, done.stderr, done.returncode), ("", "", 0))
        for page in PAGES:
            shown(page)  # by groff, which must not warn


if __name__ == "__main__":
    unittest.main()

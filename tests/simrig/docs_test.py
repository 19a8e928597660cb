# SPDX-License-Identifier: Apache-2.0
"""Runs every command of the simulated rig's README, and `vergence simulate`."""
import os
import re
import subprocess
import unittest

import cv2

from simrig_client import FILES, TIMEOUT_S, SIMRIG, Bench

VERGENCE = os.environ["VERGENCE"]


class Docs(Bench):
    def setUp(self):
        super().setUp()
        self.text = (FILES / "README.md").read_text(encoding="utf-8")

    def blocks(self, language):
        return re.findall(rf"^```{language}\n(.*?)^```", self.text, re.S | re.M)

    def test_every_command_runs(self):
        (client,) = self.blocks("python")
        (self.folder / "hello.py").write_text(client)
        path = os.path.dirname(VERGENCE) + os.pathsep + os.environ["PATH"]
        output_text = ""
        for block in self.blocks("sh"):
            done = subprocess.run(["bash", "-ec", block], cwd=self.folder, text=True,
                                  capture_output=True, timeout=2 * TIMEOUT_S,
                                  env={**os.environ, "PATH": path})
            self.assertEqual((done.returncode, done.stderr), (0, ""), block + done.stdout)
            output_text += done.stdout
        self.assertIn("at 0.200 s the bridge is 5b1d", output_text)
        self.assertIn("all answered as in the log", output_text)
        for name in ("left", "right"):
            picture = cv2.imread(str(self.folder / "pictures" / f"{name}.png"))
            self.assertEqual(picture.shape, (1536, 2048, 3))
            self.assertTrue(30 < picture.mean() < 225, "neither black nor white")
        drawing = (self.folder / "pictures" / "rig.svg").read_text()
        for word in ("From above", "From the side", "pupils", "optical axes cross"):
            self.assertIn(word, drawing)
        self.assertFalse((self.folder / "rig.sock").exists())

    def test_the_tables_are_complete(self):
        header = (FILES / "protocol" / "simrig_protocol.h").read_text(encoding="utf-8")
        lists = re.findall(r"^enum simrig_(?:type|status) \{(.*?)^\};", header, re.S | re.M)
        self.assertEqual(len(lists), 2)
        for name, number in re.findall(r"^    SIMRIG_(\w+) = (-?\d+)", "".join(lists), re.M):
            self.assertIn(f"\n| {number} | {name} ", self.text)
        for command in subprocess.run([SIMRIG, "--help-control"], capture_output=True,
                                      text=True, check=True).stdout.splitlines():
            if not command.startswith(" "):
                for word in command.split("  ")[0].replace(" ...", "").split()[:2]:
                    self.assertIn(word.replace("|", "\\|"), self.text)

    def test_the_named_files_exist(self):
        for target in re.findall(r"\]\(([^)#]+)\)", self.text):
            self.assertTrue((FILES / target).exists(), target)

    def test_simulate(self):
        def run(*arguments):
            return subprocess.run([VERGENCE, "simulate", *arguments], capture_output=True,
                                  text=True, timeout=TIMEOUT_S, cwd=self.folder)
        done = run("--help")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("still_life", done.stdout)
        for arguments, code, word in ((["--zom", "2"], 2, "--zoom"), (["a", "b"], 2, "b"),
                                      (["nosuch"], 3, "still_life"),
                                      (["plane", "--zoom", "12"], 2, "zoom"),
                                      (["plane", "--pty"], 2, "--wall"),
                                      (["plane", "--listen", "x"], 2, "unix:PATH"),
                                      (["--replay", "nosuch"], 3, "nosuch"),
                                      (["plane", "--view", "/dev/null/x"], 1, "/dev/null/x")):
            done = run(*arguments)
            self.assertEqual((done.returncode, done.stdout), (code, ""), arguments)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(word, done.stderr)


if __name__ == "__main__":
    unittest.main()

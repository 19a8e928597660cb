# SPDX-License-Identifier: Apache-2.0
"""`measure` of the simulated rig through the shipped client, recorded: the recording replays bit for
bit, and a PC makes the same surface of it, with the decisions in its report."""
import json
import os
import pathlib
import subprocess
import unittest

from daemon_process import TIMEOUT_S, DaemonTest

VERGENCE = os.environ["VERGENCE"]
TEXT = subprocess.run([os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True, check=True).stdout


class MeasureRecord(DaemonTest):
    scene = "cylinder"

    def run_here(self, *words):
        done = subprocess.run([VERGENCE, *map(str, words)], capture_output=True, text=True, cwd=self.here,
                              timeout=4 * TIMEOUT_S, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def test_a_pc_makes_the_same_surface(self):
        self.here = pathlib.Path(self.folder) / "pc"
        self.here.mkdir()
        files = pathlib.Path(self.files)
        (files / "instrument.zoom").write_bytes(TEXT)
        client = self.client()
        for command in ("calibration set instrument.zoom", "record start r1", "bringup", "window 320 240"):
            self.assertEqual(client.ask(command)[-1], "OK", command)
        # 320 px show 216 mm at 1x.
        done = self.run_here("--connect", f"unix:{self.path}", "measure", "cup", "fit=120", "--quick")
        self.assertTrue(done.stdout.endswith("OK\n"), done.stdout)
        lines = dict(line.split(": ", 1) for line in done.stdout.splitlines() if ": " in line)
        self.assertEqual((lines["name"], lines["session"]), ("cup", "r1"))
        self.assertEqual(client.ask("record stop")[-1], "OK")
        # What the instrument made was brought here; the recording was not finished then.
        theirs = self.here / lines["result"]
        self.assertEqual(sorted(os.listdir(self.here)), [lines["result"]])
        self.assertIn('after "record stop"', lines["note"])
        replayed = json.loads(self.run_here("replay", files / "r1", "--json").stdout)
        self.assertEqual((replayed["same"], replayed["pairs"]), (True, int(lines["captures"])))
        # What is for the pictures is not swallowed where they stay at the instrument.
        done = subprocess.run([VERGENCE, "--connect", f"unix:{self.path}", "reconstruct", "--board", "9x6"],
                              capture_output=True, text=True, cwd=self.here, timeout=TIMEOUT_S, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("--board requires the pictures", done.stdout + done.stderr)
        self.run_here("measure", files / "r1", "--files", "mesh.ply,report.html")
        self.assertEqual((self.here / "r1-surface/mesh.ply").read_bytes(), (theirs / "mesh.ply").read_bytes())
        report = (self.here / "r1-surface/report.html").read_text(encoding="utf-8")
        for words in ("Decisions", "wide pair", "coarse surface"):
            self.assertTrue(words in report, words)


if __name__ == "__main__":
    unittest.main()

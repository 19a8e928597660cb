# SPDX-License-Identifier: Apache-2.0
"""Every command with every argument at, inside and beyond its limits and with nonsense, on the
simulated rig and on two cameras: each line is answered, the limits that help states hold, and the
daemon lives. VERGENCE_RUNS lines, drawn by VERGENCE_SEED; "tools/campaign console" runs many."""
import glob
import json
import os
import random
import select
import shutil
import unittest

from argument_lines import Commands
from daemon_process import TIMEOUT_S, DaemonTest
from fake_devices import DeviceTest

RUNS = int(os.environ.get("VERGENCE_RUNS", "300"))
SEED = int(os.environ.get("VERGENCE_SEED", "20261128"))
SESSION = os.path.join(os.path.dirname(__file__), os.pardir, os.pardir, "sessions",
                       "small")
# A command that lasts longer is cancelled, as by Ctrl-C. In a campaign some may last.
PATIENCE_S, MUCH_PATIENCE_S = 0.4, 30
MUCH_PATIENCE = 0.05 if RUNS > 300 else 0


class Arguments:
    """Part of a test with a daemon."""
    prepare = ("bringup",)

    def begin(self):
        print(f"VERGENCE_SEED={SEED} VERGENCE_RUNS={RUNS}", flush=True)
        self.chance = random.Random(SEED)
        shutil.copytree(SESSION, os.path.join(self.files, "one"))
        shutil.copy(*glob.glob(os.path.join(SESSION, "calibration-*.txt")), os.path.join(self.files, "two"))
        self.answers = self.cancelled = 0
        self.user = self.program()
        self.run_again(self.prepare)

    def program(self):
        """A client whose lines are answered in JSON, also those too long for it to be asked."""
        user = self.client()
        user.send("@json\n")
        self.assertTrue(json.loads(user.line())["ok"])
        return user

    def run_again(self, commands):
        for command in commands:
            self.answer_to(command)

    def answer_to(self, line, patience_s=TIMEOUT_S):
        """Of a command that lasts longer than this, once it is cancelled."""
        self.user.send((line + "\n").encode(errors="surrogateescape"))
        if not select.select([self.user.socket], [], [], patience_s)[0]:
            self.cancelled += 1
            self.user.send("\x03")
        while True:
            text = self.user.line()
            self.assertIsNotNone(text, f"no answer to {line!r}")
            answer = json.loads(text)
            if "event" not in answer:
                return answer
            self.user.send("\x03")  # a round of watch

    def try_line(self, line):
        patience_s = MUCH_PATIENCE_S if self.chance.random() < MUCH_PATIENCE else PATIENCE_S
        try:
            answer = self.answer_to(line.text, patience_s)
        except (OSError, ValueError) as error:
            self.fail(f"{line.text!r}: {error}")
        self.answers += 1
        if answer["ok"]:
            self.assertIsNot(line.good, False, f"a value beyond its limit: {line.text!r}")
        else:
            self.assertRegex(answer["message"], r"\A[^\x00-\x1f\x7f]+\Z", line.text)
        if line.good:
            self.assertNotRegex(answer["message"], "is too (small|large|short|long) ", line.text)
        if line.command == "quit" and answer["ok"]:
            self.user = self.program()
        if answer["error"] == "NOT_READY":
            self.run_again(self.prepare)
        elif line.command == "window":
            self.run_again(self.prepare[1:])

    def hunt(self, runs):
        commands = Commands(self.answer_to, self.chance)
        lines = commands.at_limits()
        self.chance.shuffle(lines)
        for line in lines[:runs // 2]:
            self.try_line(line)
        while self.answers < runs:
            self.try_line(commands.random())
        print(f"{self.answers} answers, {self.cancelled} cancelled", flush=True)


class OnTheRig(Arguments, DaemonTest):
    # Small frames: what is searched for does not need large ones.
    prepare = ("bringup", "window 64 48", "exposure 1000", "calibration set two accept-mismatch=yes")

    def test_each_line_is_answered(self):
        self.begin()
        self.hunt(RUNS * 3 // 5)


class OnTwoCameras(Arguments, DeviceTest):
    def test_each_line_is_answered(self):
        self.serve(self.cameras(20000), "profile=two-cameras")
        self.begin()
        self.hunt(RUNS * 2 // 5)


if __name__ == "__main__":
    unittest.main()

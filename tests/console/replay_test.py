# SPDX-License-Identifier: Apache-2.0
"""Recordings replayed at the console and on a PC: identical, or with the place of the difference.
The recordings are of two cameras that replay another session's frames, so no rig is needed."""
import glob
import json
import os
import shutil
import subprocess
import unittest
import zlib

from daemon_process import TIMEOUT_S, VERGENCE, VERGENCED
from played_pairs import SESSION, PlayedPairs, lines_of, write_index

COMMANDS = ["bringup", "status", "window 672 400", "exposure 7000", "view", "capture", "wait 0.1",
            "health", "capture static=yes"]


def calls_of(folder):
    """The recorded calls without their checksum."""
    with open(os.path.join(folder, "calls.log"), encoding="ascii") as file:
        return [line for line in file.read().splitlines() if not line.startswith("crc32 ")]


def write_calls(folder, lines):
    text = "\n".join(lines) + "\n"
    with open(os.path.join(folder, "calls.log"), "w", encoding="ascii") as file:
        file.write(f"{text}crc32 {zlib.crc32(text.encode()):08x}\n")


class Replay(PlayedPairs):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.recorded = os.path.join(cls.files, "whole")
        cls.record("whole", COMMANDS)

    def copy(self, name):
        folder = os.path.join(self.files, name)
        shutil.copytree(self.recorded, folder)
        return folder

    def played(self, name):
        """At the console, then on a PC: both give the same result."""
        answer = self.first.ask_json(f"replay {name}")
        done = subprocess.run([VERGENCE, "replay", os.path.join(self.files, name), "--json"],
                              capture_output=True, text=True, timeout=TIMEOUT_S)
        if answer["error"] not in ("OK", "VERIFY"):
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (3, "", 1),
                             done.stderr)
            return answer
        reported = json.loads(done.stdout)
        result = answer["result"]
        self.assertEqual(done.returncode, 0 if answer["ok"] else 1)
        self.assertEqual(reported["same"], answer["ok"])
        for key in ("commands", "calls", "pairs", "build"):
            self.assertEqual(reported[key], result[key])
        if not answer["ok"]:
            self.assertEqual(reported["difference"]["call"], result["call"])
            self.assertEqual(done.stderr.count("\n"), 1)
            self.assertTrue(reported["difference"]["text"].endswith(answer["message"][-40:]))
        return answer

    def commands_of(self, name):
        return [line[len("command text="):].replace("%20", " ")
                for line in lines_of(os.path.join(self.files, name))
                if line.startswith("command ")]

    def test_a_recording_replays_identically(self):
        self.assertEqual(self.commands_of("whole"), COMMANDS)
        self.assertIn("setting text=rig.skew_limit%20=%205000%20ms", lines_of(self.recorded))
        answer = self.played("whole")
        self.assertTrue(answer["ok"], answer)
        result = answer["result"]
        self.assertEqual((result["commands"], result["pairs"], result["cut_off"]),
                         (len(COMMANDS), 2, "no"))
        self.assertGreater(result["calls"], 30)
        done = subprocess.run([VERGENCE, "replay", self.recorded], capture_output=True, text=True,
                              timeout=TIMEOUT_S)
        self.assertRegex(done.stdout, "identical: 9 commands, [0-9]+ calls, 2 pairs$")

    def test_what_is_not_there_is_missing(self):
        with self.client() as client:
            for command in ("replay", "reconstruct"):
                self.assertRegex(client.ask(f"{command} nope")[-1], "^ERR MISSING nope: ")

    def test_the_sessions_of_the_project_play(self):
        sessions = glob.glob(os.path.join(os.path.dirname(SESSION), "*", "session.index"))
        self.assertGreaterEqual(len(sessions), 3)
        for index in sessions:
            done = subprocess.run([VERGENCE, "replay", os.path.dirname(index), "--json"],
                                  capture_output=True, text=True, timeout=TIMEOUT_S)
            self.assertEqual((done.returncode, done.stderr), (0, ""), index)
            reported = json.loads(done.stdout)
            self.assertEqual((reported["same"], reported["cut_off"], reported["pairs"]), (True, False, 1))
            self.assertGreaterEqual(reported["commands"], 8)
        done = subprocess.run([VERGENCE, "replay", os.path.dirname(sessions[0])],
                              capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertRegex(done.stdout, ", 1 pair$")

    def test_all_commands_are_recorded(self):
        self.record("noted", ["bringup", "gain", "watch 0.1 \"exposure side=left\" count=2",
                              "bugreport", "exposure 8000", "help", "version", "safe", "bringup"])
        self.assertEqual(self.commands_of("noted"), [
            "bringup", "gain", "exposure side=left", "exposure side=left", "status", "health",
            "exposure 8000", "safe", "bringup"])  # registers are rejected: two cameras have none
        self.assertTrue(self.played("noted")["ok"])

    def test_refused_commands_are_not_played(self):
        """The reason of the rejection is not in the recording: a name, another recording, a
        file."""
        self.record("refused", ["bringup"], stop=False)
        for command in ("capture foo", "record start refused", "pan 3 side=left", "zoom 3",
                        "calibration set nothing", "exposure 1e9", "capture"):
            ok = self.first.ask(command)[-1] == "OK"
            self.assertEqual(ok, command == "capture", command)
        self.assertEqual(self.first.ask("record stop")[-1], "OK")
        self.assertEqual(self.commands_of("refused"), ["bringup", "capture"])
        answer = self.played("refused")
        self.assertTrue(answer["ok"], answer)
        self.assertEqual((answer["result"]["commands"], answer["result"]["pairs"]), (2, 1))

    def test_pairs_after_another_bringup(self):
        self.record("twice", ["bringup", "capture", "capture", "bringup", "capture"])
        numbers = [line.split()[1] for line in lines_of(os.path.join(self.files, "twice"))
                   if line.startswith("pair ")]
        self.assertEqual(numbers, ["number=1", "number=2", "number=3"])
        answer = self.played("twice")
        self.assertTrue(answer["ok"], answer)
        # As recorded by versions that counted from the bring-up.
        folder = os.path.join(self.files, "twice")
        write_index(folder, [line.replace("number=3 ", "number=1 ") for line in lines_of(folder)])
        self.assertTrue(self.played("twice")["ok"])

    def test_settings_that_the_recording_does_not_fit(self):
        folder = self.copy("settings")
        lines = lines_of(folder)
        place = next(i for i, line in enumerate(lines) if line.startswith("setting "))
        for setting, word in (("rig.lenses%20=%20v3lc", "lens controller"),
                              ("rig.skew_limit%20=%200.001%20ms", None),
                              ("rig.bridge%20=%20yes", "")):
            write_index(folder, [*lines[:place], f"setting text={setting}", *lines[place:]])
            answer = self.played("settings")
            if word is None:
                self.assertNotEqual(answer["error"], "IO")
            else:
                self.assertFalse(answer["ok"])
                self.assertIn(word, answer["message"])
        self.assertEqual(self.first.ask("version")[-1], "OK")

    def test_a_call_that_differs(self):
        folder = self.copy("call")
        lines = calls_of(folder)
        number = next(i for i, line in enumerate(lines) if "control 0 7000" in line)
        lines[number] = lines[number].replace(" 7000 =", " 7001 =")
        write_calls(folder, lines)
        answer = self.played("call")
        self.assertEqual(answer["error"], "VERIFY", answer)
        self.assertEqual(answer["result"]["command"], COMMANDS.index("exposure 7000") + 1)
        calls = [line for line in lines[:number + 1] if " = " in line]
        self.assertEqual(answer["result"]["call"], len(calls))
        self.assertRegex(answer["message"], "expected .*'camera0 control 0 7001'.* got "
                         "'camera0 control 0 7000'")

    def test_a_pair_that_differs(self):
        folder = self.copy("pair")
        lines = [line.replace("left_exposure_us=", "left_exposure_us=1")
                 if line.startswith("pair number=2") else line for line in lines_of(folder)]
        write_index(folder, lines)
        answer = self.played("pair")
        self.assertEqual((answer["error"], answer["result"]["pairs"]), ("VERIFY", 1))
        self.assertRegex(answer["message"], "pair 2: expected left_exposure_us=1(\\d+), got "
                         "left_exposure_us=\\1")

    def test_commands_that_differ(self):
        folder = self.copy("less")
        lines = lines_of(folder)
        write_index(folder, [line for line in lines if "health" not in line])
        answer = self.played("less")
        self.assertEqual(answer["error"], "VERIFY", answer)
        write_index(folder, [line for line in lines if "capture%20static" not in line])
        self.assertIn("not captured", self.played("less")["message"])
        lines = [line for line in lines if not line.startswith("pair number=2")]
        write_index(folder, [line for line in lines if "capture%20static" not in line])
        self.assertRegex(self.played("less")["message"], "the last \\d+ recorded calls ")
        write_index(folder, [line.replace("health", "dance") for line in lines])
        self.assertIn("cannot replay the command \"dance\"", self.played("less")["message"])
        write_index(folder, [line.replace("5000%20ms", "none") for line in lines])
        self.assertIn("rig.skew_limit", self.played("less")["message"])

    def test_a_session_that_is_not_a_recording(self):
        silent = os.path.join(self.files, "silent")
        shutil.copytree(SESSION, silent)
        write_index(silent, [line for line in lines_of(silent) if not line.startswith("command ")])
        self.assertIn("no commands", self.played("silent")["message"])
        os.mkdir(os.path.join(self.files, "nothing"))
        self.assertEqual(self.played("nothing")["error"], "ARGUMENT")
        folder = self.copy("empty")
        os.unlink(os.path.join(folder, "calls.log"))
        self.assertIn("no calls", self.played("empty")["message"])
        for path in glob.glob(os.path.join(self.copy("torn"), "frame-*")):
            os.truncate(path, 100)
        self.assertEqual(self.played("torn")["error"], "VERIFY")

    def test_a_cancelled_command(self):
        self.record("cancelled", ["bringup"], stop=False)
        self.first.begin("wait 100000")
        self.first.send("\x03")
        self.assertEqual(self.first.answer()[-1][:13], "ERR CANCELLED")
        for command in ("exposure 8000", "capture", "record stop"):
            self.assertEqual(self.first.ask(command)[-1], "OK")
        answer = self.played("cancelled")
        self.assertTrue(answer["ok"], answer)
        self.assertEqual(answer["result"]["pairs"], 1)
        # The same commands to a daemon that replays the recording, without cancelling there.
        done = subprocess.run(
            [VERGENCED, f"backend=replay {os.path.join(self.files, 'cancelled')}", "socket=none",
             "console=stdio", f"files={self.files}", "store=none", *self.settings],
            input="bringup\nwait 100000\nexposure 8000\ncapture again\n", text=True,
            capture_output=True, timeout=TIMEOUT_S)
        ends = [line[:13] for line in done.stdout.splitlines() if line[:3] in ("OK", "ERR")]
        self.assertEqual(ends, ["OK", "ERR CANCELLED", "OK", "OK"], done.stdout + done.stderr)

    def test_a_cancelled_bugreport_cancels_no_other_command(self):
        """It is recorded as the commands that it runs."""
        self.record("report", [], stop=False)
        cancelled, tries = 0, 0
        while cancelled < 3:
            tries += 1
            self.assertLess(tries, 1000, "it is always faster")
            self.first.send("@progress bugreport\n")
            self.assertEqual(self.first.line()[:4], "... ")  # it runs
            self.first.send("\x03")
            cancelled += self.first.answer()[-1][:13] == "ERR CANCELLED"
        for command in ("bringup", "capture", "record stop"):
            self.assertEqual(self.first.ask(command)[-1], "OK")
        calls = [line for line in calls_of(os.path.join(self.files, "report")) if "cancel" in line]
        self.assertEqual(calls, [])
        answer = self.played("report")
        self.assertTrue(answer["ok"], answer)

    def test_a_daemon_that_ends(self):
        self.record("ended", COMMANDS, stop=False)
        self.end(self.daemon)
        self.start()
        self.first = self.client()
        self.assertEqual(self.commands_of("ended"), [*COMMANDS, "safe"])
        answer = self.played("ended")
        self.assertTrue(answer["ok"], answer)
        self.assertEqual(answer["result"]["cut_off"], "no")


if __name__ == "__main__":
    unittest.main()

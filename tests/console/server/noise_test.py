# SPDX-License-Identifier: Apache-2.0
"""The shipped client over a serial line that loses and changes bytes: every command is answered as
over a good line or soon fails with one line; only requested commands run, each at most once."""
import json
import os
import random
import subprocess
import time
import unittest
from urllib.parse import unquote

from bad_line import BadLine
from daemon_process import TIMEOUT_S, ConsoleTest, framed
from waiting import wait_until

# All of it takes two minutes, mostly of waiting; without this a short part, always with the same noise.
WHOLE = os.environ.get("VERGENCE_NOISE") == "whole"
CLEAN, FAINT, NOISY, LOUD = 0, 0.0001, 0.001, 0.002
SOON_S = 60  # each attempt has a deadline, and their number is limited


class Lines:
    """A program at a serial line."""

    def __init__(self, line):
        self.slave, self.left = line.slave, b""

    def ask(self, text):
        """The answer line."""
        os.write(self.slave, text.encode() + b"\n")
        return self.line()

    def line(self):
        while b"\n" not in self.left:
            self.left += os.read(self.slave, 4096).replace(b"\x16", b"")
        line, self.left = self.left.split(b"\n", 1)
        return line.decode().strip()


class Noise(ConsoleTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.content = random.Random(5).randbytes(30000)
        with open(os.path.join(cls.files, "frame.bin"), "wb") as file:
            file.write(cls.content)

    def setUp(self):
        seed = int(os.environ.get("VERGENCE_TEST_SEED",
                                  random.randrange(1 << 32) if WHOLE else 20090915))
        print(f"VERGENCE_TEST_SEED={seed}")
        self.line = BadLine(self.console, seed, 0, 0)
        self.addCleanup(self.line.close)
        self.first = self.client()

    def corrupt(self, rate):
        self.line.lost = self.line.changed = rate

    def begin(self, *words, **options):
        return super().begin(*words, where=f"serial:{self.line.name}", text=True, **options)

    def ask(self, *words, **options):
        """Exit code, answer, and error output."""
        begin = time.monotonic()
        process = self.begin(*words, **options)
        output, reported = process.communicate(timeout=3 * TIMEOUT_S)
        self.assertLess(time.monotonic() - begin, SOON_S, (words, output, reported))
        return process.returncode, output, reported

    def check_failed(self, words, code, output, reported):
        """No connection, in one line; with --json as an answer."""
        self.assertEqual(code, 3, (words, output, reported))
        if "--json" in words:
            answer = json.loads(output.splitlines()[-1])
            self.assertEqual((answer["ok"], reported), (False, ""))
        else:
            self.assertEqual((output, reported.count("\n")), ("", 1))

    def recorded(self, name):
        """The waits in a recording."""
        with open(os.path.join(self.files, name, "session.index"), encoding="ascii") as file:
            return [unquote(line.split()[1].removeprefix("text=")) for line in file
                    if line.startswith("command text=wait")]

    def test_answers_are_right(self):
        wanted = {}
        some = (("version",), ("status",), ("help", "pan"), ("gain",), ("fly",))
        for words in some if WHOLE else some[1:3]:
            for form in ((), ("--json",)):
                wanted[form + words] = self.ask(*form, *words)
                over_socket = self.vergence(*form, *words)
                self.assertEqual(wanted[form + words], (
                    over_socket.returncode, over_socket.stdout, over_socket.stderr))
        for rate in (NOISY, LOUD) if WHOLE else (NOISY,):
            good = 0
            self.corrupt(rate)
            for words, answer in wanted.items():
                got = self.ask(*words)
                if got == answer:
                    good += 1
                else:
                    self.check_failed(words, *got)
            print(f"rate {rate}: {good} of {len(wanted)} answered")
            self.assertGreater(good, 0)

    def test_only_requested_commands_run_and_once(self):
        self.assertEqual(self.first.ask("bringup")[-1], "OK")
        self.assertEqual(self.first.ask("record start noise")[-1], "OK")
        done, asked = [], []
        self.corrupt(LOUD)
        for i in range(12 if WHOLE else 3):
            command = f"wait 0.{i + 100}"
            words = ("--json",) * (i % 2) + tuple(command.split())
            asked.append(command)
            code, output, reported = self.ask(*words)
            if code == 0:
                self.assertEqual(reported, "")
                last = output.splitlines()[-1]
                self.assertTrue(last == "OK" or json.loads(last)["ok"], output)
                done.append(command)
            else:
                self.check_failed(words, code, output, reported)
        self.corrupt(CLEAN)
        self.assertEqual(self.ask("wait", "0")[0], 0)
        self.assertEqual(self.first.ask("record stop")[-1], "OK")
        carried_out = self.recorded("noise")[:-1]
        print(f"{len(done)} of {len(asked)} answered")
        self.assertEqual(len(set(carried_out)), len(carried_out))
        self.assertEqual(carried_out, [command for command in asked if command in carried_out])
        self.assertEqual([command for command in done if command not in carried_out], [])
        self.assertGreater(len(done), 0)

    def test_rounds_of_a_watch(self):
        """Rounds that arrive are right, and missing ones are reported."""
        for form in ((), ("--json",)):
            one = self.ask(*form, "watch", "0.1", "status", "count=1")[1].removesuffix("OK\n")
            for rate in (CLEAN, NOISY) if WHOLE else (NOISY,):
                self.corrupt(rate)
                code, output, reported = self.ask(*form, "watch", "0.1", "status", "count=20")
                self.corrupt(CLEAN)
                lines = output.splitlines()
                whole = code == 0
                if form:
                    self.assertEqual((json.loads(lines[-1])["ok"], reported), (whole, ""))
                    rounds = [json.loads(line) for line in lines[:-1]]
                    wanted = {"event": "watch", "result": {"state": "down", "profile": "rig"}}
                    self.assertEqual([line for line in rounds if line != wanted], [])
                else:
                    # A line that falls silent between two rounds ends with their blank line.
                    end = "OK\n" if whole else "\n\n"
                    rounds = output.removesuffix(end).split("\n\n")
                    self.assertEqual({line.strip() for line in rounds}, {one.strip()})
                    self.assertEqual(reported.count("\n"), 0 if whole else 1)
                if whole:
                    self.assertEqual(len(rounds), 20 - len(form), output)
                else:
                    self.assertRegex(output + reported, "rounds of the watch may be missing|"
                                                        "no undamaged answer arrives")

    @unittest.skipUnless(WHOLE, "waits for longer than any silence is tolerated")
    def test_a_command_that_takes_long(self):
        """The client waits while there are heartbeats, and asks again if the end was lost."""
        self.first.send("wait 100000\n")
        process = self.begin("status")
        with self.assertRaises(subprocess.TimeoutExpired):
            process.wait(12)  # longer than any tolerated silence
        self.first.send("\x03")
        self.assertEqual(self.first.answer()[-1], "ERR CANCELLED cancelled")
        output, reported = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual((process.returncode, output), (0, "state: down\nprofile: rig\nOK\n"), reported)
        # Said once, unless the noise took it.
        self.assertRegex(reported, r"^(vergence: the instrument is busy: .* another client's wait .*\n)?$")

    def test_a_line_that_falls_silent(self):
        for form, more in (((), 0), (("--json",), 40), ((), 120)) if WHOLE else ((("--json",), 40),):
            process = self.begin(*form, "wait", "100000")
            carried = self.line.carried
            wait_until(lambda: self.line.carried >= carried + 60)
            self.line.limit = self.line.carried + more
            begin = time.monotonic()
            output, reported = process.communicate(timeout=TIMEOUT_S)
            self.assertLess(time.monotonic() - begin, 20)
            self.check_failed(form, process.returncode, output, reported)
            self.line.limit = None

    def test_commands_over_a_framed_line(self):
        """The raw lines, without the client."""
        line = Lines(self.line)
        # After leftovers of others: the echo, and the answer to a word that is not a command.
        answer = line.ask("\x03\rlisten")
        while not answer.startswith("ERR"):
            answer = line.line()
        answer = line.ask("@framed")
        while answer != "OK":
            answer = line.line()  # of the prompt
        self.assertEqual(line.ask("wait 0")[:7], "ERR CRC")
        self.assertIn('"error": "CRC"', line.ask("@json wait 0"))
        self.assertEqual(line.ask(framed("wait 0", "text"))[:4], "OK #")
        self.assertEqual(line.ask(framed("wait 0", "text,once"))[:10], "ERR SYNTAX")
        self.assertEqual(line.ask(framed("wait 0.6", "text").replace("0.6", "0.7"))[:7], "ERR CRC")
        self.assertEqual(line.ask(framed("wait 0", "text").replace("text", "test"))[:7], "ERR CRC")
        self.assertEqual(line.ask("@terminal"), "OK")

    def test_files(self):
        self.corrupt(FAINT)
        there = os.path.join(self.folder, "noisy")
        for _ in range(20):
            code, output, reported = self.ask("fetch", "frame.bin", there)
            if code == 0:
                break
            self.check_failed(("fetch",), code, output, reported)
        with open(there, "rb") as file:
            self.assertEqual(file.read(), self.content)


if __name__ == "__main__":
    unittest.main()

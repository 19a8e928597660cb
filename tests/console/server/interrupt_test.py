# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, pasted text and closed readers in the shipped client: it ends at once, no unwanted
command runs, and no line is mixed up with another."""
import glob
import json
import os
import random
import signal
import subprocess
import unittest

from daemon_process import TIMEOUT_S, DaemonTest
from terminal_user import TerminalUser
from waiting import wait_until

INTERRUPTED = 130


class Interrupt(DaemonTest):
    def begin(self, *words, **options):
        return super().begin(*words, text=True, cwd=self.folder, **options)

    def check_interrupted(self, process):
        try:
            output, _ = process.communicate(timeout=TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.fail("it does not end")
        # Before its handler is installed the signal itself ends it.
        self.assertIn(process.returncode, (INTERRUPTED, -signal.SIGINT))
        return output

    def test_a_script(self):
        script = os.path.join(self.folder, "script")
        with open(script, "w", encoding="ascii") as file:
            file.write("version\n" * 200000)
        seed = int(os.environ.get("VERGENCE_TEST_SEED", random.randrange(1 << 32)))
        print(f"VERGENCE_TEST_SEED={seed}")
        chance = random.Random(seed)
        for words in ([], ["--keep-going"], ["--json"]) * 3:
            with open(script, encoding="ascii") as file:
                process = self.begin(*words, stdin=file)
                process.stdout.readline()
                # Something must read, or it would only block.
                for _ in range(chance.randrange(200)):
                    process.stdout.readline()
                process.send_signal(signal.SIGINT)
                self.check_interrupted(process)

    def part_bytes(self, local):
        """The size of the incomplete file, fetched or sent."""
        parts = [f"{local}.part", *glob.glob(os.path.join(self.files, ".*"))]
        return sum(os.path.getsize(part) for part in parts if os.path.exists(part))

    def test_files(self):
        content = random.Random(6).randbytes(12 << 20)
        with open(os.path.join(self.files, "big"), "wb") as file:
            file.write(content)
        local = os.path.join(self.folder, "big")
        for words in (["fetch", "big"], ["send", "big", "back"]):
            for transferred in (1 << 20, 2 << 20, 4 << 20):
                process = self.begin(*words)
                wait_until(lambda limit=transferred: self.part_bytes(local) >= limit)
                process.send_signal(signal.SIGINT)
                self.check_interrupted(process)
            # It resumes from there.
            done = self.vergence(*words, cwd=self.folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            for path in (local, os.path.join(self.files, "back" if "send" in words else "big")):
                with open(path, "rb") as file:
                    self.assertEqual(file.read(), content)

    def test_invalid_lines(self):
        # The rest of a long line, or what follows a zero byte, is not a command.
        script = "# " + "x" * 511 + "log 1\n" + "wait\0 0\n" + "wait 0\n" + "y" * 5000 + "\nwait 0"
        done = self.vergence("--keep-going", input=script)
        self.assertEqual((done.returncode, done.stdout), (1, "OK\nOK\n"))
        self.assertEqual(done.stderr, "vergence: the line is longer than 512 characters\n"
                         "vergence: the line contains a control character\n"
                         "vergence: the line is longer than 512 characters\n")
        done = self.vergence("--keep-going", "--json", input=script + "\n\"x\n@text wait 0\n")
        answers = [json.loads(line) for line in done.stdout.splitlines()]
        self.assertEqual(done.stderr, "")
        self.assertEqual([answer["ok"] for answer in answers],
                         [False, False, True, False, True, False, False])
        self.assertEqual({answer["error"] for answer in answers if not answer["ok"]}, {"SYNTAX"})
        # The maximum length, with another system's line end.
        done = self.vergence(input="wait 0".ljust(512) + "\r\n")
        self.assertEqual((done.returncode, done.stdout), (0, "OK\n"), done.stderr)

    def test_a_reader_that_goes_away(self):
        process = self.begin("watch", "0.1", "version")
        for _ in range(3):
            process.stdout.readline()
        process.stdout.close()
        self.assertEqual(process.wait(TIMEOUT_S), 141)
        self.assertEqual(process.stderr.read(), "")

    def test_ctrl_c_drops_pasted_text(self):
        terminal_user = TerminalUser.of(self)
        terminal_user.type("wait 100000\rversion\rlog 1\r")
        terminal_user.until(lambda: "waiting" in terminal_user.screen.lines[-1])
        terminal_user.type("\x03")
        terminal_user.until(lambda: terminal_user.line_count("ERR CANCELLED cancelled") and terminal_user.at_prompt())
        self.run_another(terminal_user)
        self.assertFalse(terminal_user.lines_with("build"))
        # All at once.
        terminal_user.type("version\rlog 1\r\x03")
        self.run_another(terminal_user)
        self.assertFalse(terminal_user.lines_with("build"))
        # Completion still works, and so does the next line.
        terminal_user.type("vers\t\r")
        terminal_user.until(lambda: terminal_user.lines_with("build") and terminal_user.at_prompt())

    @staticmethod
    def run_another(terminal_user):
        """Runs a line, whose answer follows all output of the lines before. It is typed again if it
        came so early that Ctrl-C dropped it, too."""
        begun = terminal_user.line_count("OK")

        def ran():
            terminal_user.type("wait 0\r")
            terminal_user.look(1)
            return terminal_user.line_count("OK") > begun and terminal_user.at_prompt()
        wait_until(ran, lambda: terminal_user.screen.lines[-8:])

    def test_a_user_fetches(self):
        with open(os.path.join(self.files, "huge"), "wb") as file:
            file.write(bytes(14 << 20))
        terminal_user = TerminalUser.of(self)
        # Its local file would be in the tests' directory.
        local = os.path.join(self.folder, "huge")
        for i in range(3):
            terminal_user.type(f"fetch huge {local}\r")
            terminal_user.until(lambda: "[" in terminal_user.screen.lines[-1])  # its bar
            terminal_user.until(lambda i=i: terminal_user.screen.lines[-1].count("#") >= 3 * i)
            terminal_user.type("\x03")
            terminal_user.until(lambda i=i: terminal_user.line_count("vergence: interrupted") == i + 1 and
                         terminal_user.at_prompt())
        terminal_user.type("version\r")
        terminal_user.until(lambda: terminal_user.line_count("OK") == 1 and terminal_user.at_prompt())

    def test_ctrl_c_behind_lines_sent_ahead(self):
        """A program gets an answer for each line that was not run."""
        other = self.client()
        self.assertEqual(other.ask("wait 0"), ["OK"])
        for ahead in (1, 600):
            client = self.client()
            client.send("wait 100000\n" + "version\n" * ahead + "\x03")
            for _ in range(ahead + 1):
                self.assertEqual(client.answer(), ["ERR CANCELLED cancelled"])
            self.assertEqual(client.ask("version")[-1], "OK")
        # One that goes cancels, however much it has sent.
        client.send("wait 100000\n" + 5000 * "version\n")
        client.socket.close()
        self.assertEqual(other.ask("wait 0"), ["OK"])

    def test_what_is_sent_ahead_waits_for_its_turn(self):
        client = self.client()
        client.send("wait 1\n" + 5000 * "wait 0\n" + "version\n")
        for _ in range(5001):
            self.assertEqual(client.answer(), ["OK"])
        self.assertEqual(client.answer()[0][:7], "version")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""A person at the serial console: editing keys, history, completion, Ctrl-C, garbage."""
import os
import random
import re
import signal
import subprocess
import threading
import unittest

from daemon_process import ConsoleTest


class Console(ConsoleTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.terminal = cls.console

    def setUp(self):
        while self.terminal.read(0):
            pass
        seen = self.terminal.text.count("^C")
        self.terminal.send("\x03")
        self.terminal.wait(lambda t: t.text.count("^C") > seen and t.at_prompt())

    def typed(self, keys, line):
        self.terminal.send(keys)
        self.terminal.wait_line("vergence> " + line)

    def test_an_answer(self):
        shown = self.terminal.run("status")
        self.assertEqual((shown[0], shown[-1]), ("state: down", "OK"))
        shown = self.terminal.run("stauts")
        self.assertEqual(shown,
                         ['ERR ARGUMENT unknown command "stauts" (did you mean "status"?)'])
        self.assertEqual(self.terminal.run("   "), [])

    def test_what_other_programs_call_it_leads_to_the_word(self):
        client = self.client()
        for line, word in (("snapshot", "capture"), ("focus auto", "autofocus"), ("ls", "files"),
                           ("exposure auto side=left", "autoexpose"), ("gain auto", "autoexpose")):
            self.assertIn(f'(did you mean "{word}"?)', client.ask(line)[-1])
        self.assertIn('(did you mean "near" and "far"?)',
                      client.ask("reconstruct scene depth=500:900")[-1])

    def test_every_proposed_word_exists(self):
        client = self.client()
        path = os.path.join(os.environ["VERGENCE_SOURCE"], "firmware", "console", "synonyms.c")
        with open(path, encoding="utf-8") as file:
            tables = re.findall(r"synonym (commands|options)\[\] = \{\n(.*?)\n\};", file.read(), re.S)
        commands, options = (re.findall(r'\{"([^"]+)", "([^"]+)"\}', text) for _, text in tables)
        self.assertGreater(min(len(commands), len(options)), 20)
        names = [name for group in client.ask_json("help")["result"].values() for name in group]
        for typed, meant in commands:
            self.assertIn(meant, names, typed)
            self.assertNotIn(typed, names)
        known = set()
        for name in names:
            known |= set(re.findall(r"\b([a-z][\w-]*)=", "\n".join(client.ask(f"help {name}"))))
        for page in (["reconstruct"], ["calibrate"], ["calibrate", "capture"], ["info"], ["connect"]):
            text = subprocess.run([os.environ["VERGENCE"], "help", *page], capture_output=True,
                                  text=True, check=True).stdout
            known |= set(re.findall(r"--([a-z][\w-]*)", text))
        for typed, meant in options:
            for word in meant.split():
                self.assertIn(word, known, typed)

    def test_editing_keys(self):
        left, right, home, end, delete = "\x1b[D", "\x1b[C", "\x1b[H", "\x1b[F", "\x1b[3~"
        self.typed("abd" + left + "c", "abcd")
        self.typed(home + "x" + end + "y", "xabcdy")
        self.typed("\x01" + delete + "\x05\x7f", "abcd")
        self.typed(left + left + "\x0b", "ab")
        self.typed("\x15", "")
        self.typed("one two  \x17", "one")
        self.typed("\x17", "")
        self.typed("ab\x02\x02\x06-\x1bOH+", "+a-b")
        self.typed(right + right + right + right + right + "!", "+a-b!")
        self.typed("\x1b[1~<\x1b[4~>", "<+a-b!>")
        self.typed("\x0c", "<+a-b!>")
        self.typed("\x01\x04", "+a-b!>")

    def test_umlauts_are_one_key(self):
        self.typed("aäb\x1b[D\x1b[D\x7f", "äb")
        self.typed("\x1b[C\x7f", "b")

    def test_history(self):
        self.terminal.run("version")
        self.terminal.run("log 1")
        self.terminal.run("log 1")  # not stored twice
        up, down = "\x1b[A", "\x1b[B"
        self.typed("new" + up, "log 1")
        self.typed(up, "version")
        self.typed(down, "log 1")
        self.typed(down, "new")
        self.typed("\x10\x10\x0e", "log 1")

    def test_completion(self):
        self.typed("stat\t", "status")
        self.typed("\x15zoom si\tl\t", "zoom side=left")
        self.typed("\x15calibration \tsh\t", "calibration show")
        self.assertIn("show set forget accept-mismatch= unit=", [line.strip() for line in self.terminal.screen.lines])
        self.typed("\x15help ver\t", "help version")
        self.typed("\x15registers left chip_v\t", "registers left chip_version")
        self.typed("\x15config rig.wid\t", "config rig.width")
        bells = self.terminal.screen.bells
        self.typed("\x15registers bri\tchip_v\t", "registers bridge chip_v")
        self.typed("\x15qqq\t", "qqq")
        self.terminal.wait(lambda t: t.screen.bells > bells)

    def test_completion_of_what_there_is(self):
        for path in ("one/session.index", "one/frame-1.pgm", "only/x", "o n/x", "rig.txt"):
            os.makedirs(os.path.dirname(os.path.join(self.files, path)), exist_ok=True)
            with open(os.path.join(self.files, path), "w", encoding="ascii"):
                pass
        self.typed("\x15fetch r\t", "fetch rig.txt")
        self.typed("\x15fetch one/fr\t", "fetch one/frame-1.pgm")
        self.typed("\x15fetch onl\t\t", "fetch only/x")
        self.typed("\x15calibration set r\t", "calibration set rig.txt")
        self.typed("\x15files onl\t", "files only")
        self.typed("\x15replay o\t", "replay one")
        self.typed("\x15reconstruct o\t0", "reconstruct one 0")
        self.typed("\x15fetch on\t", "fetch on")
        self.terminal.send("\t")
        self.terminal.wait(lambda t: any(sorted(line.split()) == ["one/", "only/"]
                                         for line in t.screen.lines))
        bells = self.terminal.screen.bells
        self.typed("\x15fetch ../\t", "fetch ../")
        self.typed("\x15fetch nowhere/\t", "fetch nowhere/")
        self.terminal.wait(lambda t: t.screen.bells >= bells + 2)

    def test_a_long_line_scrolls(self):
        text = "".join(chr(ord("a") + i % 26) for i in range(300))
        self.terminal.send("help " + text)
        self.terminal.wait(lambda t: t.screen.lines[-1].rstrip().endswith(text[-50:]))
        self.assertLessEqual(len(self.terminal.screen.lines[-1].rstrip()), 79)
        self.terminal.send("\x01")
        self.terminal.wait(lambda t: t.screen.lines[-1].startswith("vergence> help abc"))
        self.assertIn("is too long", self.terminal.run("")[0])
        bells = self.terminal.screen.bells
        self.terminal.send(1000 * "x")
        self.terminal.wait(lambda t: t.screen.bells > bells)

    def test_ctrl_c_cancels_what_runs(self):
        self.terminal.send("wait 100000\r")
        self.terminal.wait(lambda t: t.screen.lines[-1].startswith("waiting"))
        self.terminal.send("\x03")
        self.terminal.wait(lambda t: any(line.rstrip() == "ERR CANCELLED cancelled"
                                         for line in t.screen.lines))
        self.terminal.wait_prompt()
        self.terminal.send("watch 0.1 version\r")
        self.terminal.wait(lambda t: t.text.count("version: ") > 3)
        self.terminal.send("\x03")
        self.terminal.wait_prompt()

    def test_ctrl_c_cancels_what_waits_for_another_client(self):
        other = self.client()
        other.begin("wait 100000")
        begin = len(self.terminal.screen.lines)
        self.terminal.send("status\r")
        self.terminal.wait_line("waiting for another client's wait".ljust(45) + f"[{26 * '.'}]   0 %")
        self.terminal.send("\x03")
        self.terminal.wait_prompt()
        self.assertIn("ERR CANCELLED cancelled",
                      [line.strip() for line in self.terminal.screen.lines[begin:]])
        # The answer erases the bar.
        self.terminal.send("status\r")
        self.terminal.wait(lambda t: t.screen.lines[-1].startswith("waiting for another"))
        other.send("\x03")
        self.terminal.wait_prompt()
        self.assertEqual([line.strip() for line in self.terminal.screen.lines[-4:-1]],
                         ["state: down", "profile: rig", "OK"])

    def waiting(self):
        """Another client, whose command runs until it is cancelled."""
        other = self.client()
        other.send("@progress wait 100000\n")
        other.line()
        return other

    def since(self, begin):
        return [line.strip() for line in self.terminal.screen.lines[begin:]]

    def test_ctrl_c_behind_pasted_text(self):
        for noise in ("version\r" * 500, "x" * 10000):
            self.terminal.text = ""
            begin = len(self.terminal.screen.lines)
            self.terminal.send("wait 100000\r" + noise + "\x03")
            self.terminal.wait(lambda t, begin=begin: t.at_prompt() and
                               "ERR CANCELLED cancelled" in self.since(begin))
            self.assertNotIn("build", self.terminal.text)
        self.assertEqual(self.terminal.run("wait 0"), ["OK"])

    def test_more_ahead_than_fits_waits(self):
        """The daemon reads on when there is room: nothing is lost, and all of it is run."""
        self.terminal.send("@program\r")
        self.terminal.wait(lambda t: "OK\r\n" in t.text)
        self.terminal.text = ""
        other = self.waiting()
        sender = threading.Thread(target=self.terminal.send,
                                  args=("status\n" + "wait 0\n" * 5000 + "version\n@terminal\n",))
        sender.start()
        other.send("\x03")
        self.terminal.wait(lambda t: t.text.count("OK\n") == 5002 and t.at_prompt())
        sender.join()
        self.assertNotIn("ERR", self.terminal.text)
        self.assertEqual(self.terminal.text.count("build"), 1)
        self.assertEqual(self.terminal.run("wait 0"), ["OK"])

    def test_type_ahead(self):
        begin = len(self.terminal.screen.lines)
        self.terminal.send("wait 1\rversion\r")
        self.terminal.wait(lambda t: sum(line.strip() == "OK" for line in
                                         t.screen.lines[begin:]) == 2)
        self.terminal.wait_prompt()

    def test_the_terminal_restarts_after_its_end(self):
        for keys in ("\x04", "quit\r"):
            begin = len(self.terminal.screen.lines)
            self.terminal.send(keys)
            self.terminal.wait(lambda t: any("lists the commands" in line
                                             for line in t.screen.lines[begin:]))
            self.terminal.wait_prompt()
        self.assertEqual(self.terminal.run("version")[-1], "OK")

    def test_nothing_but_plain_characters_is_sent(self):
        # Screen rejects any other character, so no escape sequence was sent, whatever TERM is.
        self.terminal.run("help")
        self.assertNotIn("\x1b", self.terminal.text)

    def test_garbage(self):
        seed = int(os.environ.get("VERGENCE_TEST_SEED", random.randrange(1 << 32)))
        print(f"VERGENCE_TEST_SEED={seed}")
        chance = random.Random(seed)
        for _ in range(30):
            # No line of it may be a command.
            data = bytes(chance.choice([b for b in range(256) if b not in (10, 13)])
                         for _ in range(chance.randrange(1, 700)))
            self.terminal.send(data)
            self.terminal.read(0.02)
        self.terminal.send("\x03\x03")
        while self.terminal.read(0.5):
            pass
        self.terminal.wait_prompt()
        self.assertEqual(self.terminal.run("version")[-1], "OK")

    def test_output_is_complete_however_late_it_is_read(self):
        # Each key before a long line redraws all of it: at once more than the daemon buffers for a
        # client that does not read.
        self.daemon.send_signal(signal.SIGSTOP)
        self.terminal.send("a" * 200 + "\x01" + "b\x7f" * 1930 + "see\x03\x03")
        self.daemon.send_signal(signal.SIGCONT)
        self.terminal.wait(lambda t: "see" in t.text and t.at_prompt())
        self.assertEqual(self.terminal.run("version")[-1], "OK")


if __name__ == "__main__":
    unittest.main()

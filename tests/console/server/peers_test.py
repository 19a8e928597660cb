# SPDX-License-Identifier: Apache-2.0
"""The shipped client before its first request: what is at the other end, where its script comes
from, and its command line."""
import json
import os
import select
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

from daemon_process import TIMEOUT_S, VERGENCE, DaemonTest, Terminal
from terminal_user import TerminalUser

INTERRUPTED = 130
BUSY_S = 20  # that a program may have to wait for a processor
SILENT = b"vergence: vergenced does not answer yet; Ctrl-C gives up\n"
NO_ANSWER = "invalid answer from vergenced"


class Peers(DaemonTest):
    def stop_daemon(self):
        self.daemon.send_signal(signal.SIGSTOP)
        self.addCleanup(self.daemon.send_signal, signal.SIGCONT)

    def wait_line(self, file):
        """The next line as it arrives, without waiting for the end of the process."""
        self.assertTrue(select.select([file], [], [], TIMEOUT_S)[0], "no notification came")
        return file.readline()

    def check_given_up(self, process, words):
        """No answer: exit code 3 and one line, or its JSON."""
        output, reported = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(process.returncode, 3, (words, output, reported))
        if "--json" in words:
            self.assertEqual((json.loads(output)["error"], reported), ("TIMEOUT", b""))
        else:
            self.assertEqual((output, reported.count(b"\n")), (b"", 1), reported)
            self.assertTrue(reported.startswith(b"vergence: "), reported)

    def test_a_daemon_that_stands_still_is_given_up(self):
        self.stop_daemon()
        kinds = (["wait", "0"], ["--json", "wait", "0"], ["fetch", "none"], [], ["--json"])
        begin = time.monotonic()
        processes = [self.begin(*words, stdin=subprocess.DEVNULL) for words in kinds]
        for words, process in zip(kinds, processes):
            self.check_given_up(process, words)
        # 4.5 s, plus the delay of a busy machine.
        self.assertLess(time.monotonic() - begin, 4.5 + BUSY_S)

    def test_a_silent_peer_is_given_up(self):
        """A program at a port, a port that accepts nothing more, a device."""
        port = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(port.close)
        path = os.path.join(self.folder, "full.sock")
        full = socket.socket(socket.AF_UNIX)
        self.addCleanup(full.close)
        full.bind(path)
        full.listen(0)
        waiting = socket.socket(socket.AF_UNIX)
        self.addCleanup(waiting.close)
        waiting.connect(path)
        device = Terminal()
        self.addCleanup(device.close)
        chatty = Terminal()
        self.addCleanup(chatty.close)
        places = [f"tcp:127.0.0.1:{port.getsockname()[1]}", f"unix:{path}", f"serial:{device.name}",
                  f"serial:{chatty.name}"]
        begin = time.monotonic()
        processes = [self.begin("version", where=where) for where in places]
        while any(process.poll() is None for process in processes):
            self.assertLess(time.monotonic() - begin, 4.5 + BUSY_S)
            chatty.send("$GPGGA,1\r\n")
            for ready in select.select([device.master, chatty.master], [], [], 0.02)[0]:
                os.read(ready, 4096)
            time.sleep(0.01)  # a device that sends all the time, but not at full speed
        for where, process in zip(places, processes):
            self.check_given_up(process, [where])
        print(f"given up after {time.monotonic() - begin:.2f} s")

    def test_ctrl_c_at_one_that_does_not_answer(self):
        begin = self.fake()
        for words in (["status"], ["--json", "status"], []):
            process, peer = begin(*words)
            self.assertEqual(peer.recv(4096), b"@text\n")
            process.send_signal(signal.SIGINT)
            output, reported = process.communicate(timeout=TIMEOUT_S)
            self.assertEqual(process.returncode, INTERRUPTED, (output, reported))
            if "--json" in words:
                self.assertEqual((json.loads(output)["error"], reported), ("CANCELLED", b""))
            else:
                self.assertEqual((output, reported), (b"", b"vergence: interrupted\n"))

    def test_a_user_at_a_daemon_that_stands_still(self):
        terminal = Terminal(raw=False)
        self.addCleanup(terminal.close)
        self.stop_daemon()
        process = self.begin(stdin=terminal.slave)
        self.assertEqual(self.wait_line(process.stderr), SILENT)
        process.send_signal(signal.SIGINT)
        _, reported = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual((process.returncode, reported), (INTERRUPTED, b"vergence: interrupted\n"))

    def test_a_long_command_is_waited_for_in_silence(self):
        """A watch is silent between its rounds, and that is not reported as an error."""
        done = self.vergence("watch", "6", "version", "count=2")
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def listen(self):
        """A socket that listens, and its path."""
        path = tempfile.mktemp(dir=self.folder)
        server = socket.socket(socket.AF_UNIX)
        self.addCleanup(server.close)
        server.bind(path)
        server.listen()
        return server, path

    def fake(self, *output_text):
        """Starts a process with a peer that sends these one after the other, one per request, and
        then nothing more."""
        server, path = self.listen()

        def begin(*words):
            process = self.begin(*words, where=f"unix:{path}")
            peer = server.accept()[0]
            self.addCleanup(peer.close)
            peer.settimeout(TIMEOUT_S)
            for text in output_text:
                peer.recv(4096)
                peer.sendall(text)
            return process, peer

        return begin

    def test_the_second_ctrl_c_reports_what_it_does(self):
        begin = self.fake(b"OK\n")
        for words in (["status"], ["--json", "status"]):
            process, peer = begin(*words)
            self.assertIn(b"status\n", peer.recv(4096))
            process.send_signal(signal.SIGINT)
            self.assertEqual(peer.recv(4096), b"\x03")
            process.send_signal(signal.SIGINT)
            output, reported = process.communicate(timeout=TIMEOUT_S)
            why = "interrupted twice: ended before vergenced confirmed the cancellation"
            self.assertEqual(process.returncode, INTERRUPTED)
            if "--json" in words:
                answer = json.loads(output)
                self.assertEqual((answer["ok"], answer["error"], answer["message"], reported),
                                 (False, "CANCELLED", why, b""))
            else:
                self.assertEqual((output, reported.decode()), (b"", f"vergence: {why}\n"))

    def test_a_peer_that_is_not_vergenced(self):
        begin = self.fake(b"SSH-2.0-OpenSSH_9.6\r\n")
        for words in (["status"], ["--json", "status"], ["fetch", "x"], []):
            process, _ = begin(*words)
            output, reported = process.communicate(timeout=TIMEOUT_S)
            self.assertEqual(process.returncode, 3, (output, reported))
            if "--json" in words:
                answer = json.loads(output)
                self.assertEqual((answer["error"], answer["message"], reported),
                                 ("VERSION", NO_ANSWER, b""))
            else:
                self.assertEqual((output, reported.decode()), (b"", f"vergence: {NO_ANSWER}\n"))

    def test_what_a_peer_reports_commands_no_terminal(self):
        evil = b"name: a\x1b]0;x\x07\x7f\xc2\x9b1m\x9bz\tb \xc3\xa9 \xe2\x82\xac"
        good = "name: a\\x1b]0;x\\x07\\x7f\\xc2\\x9b1m\\x9bz\\x09b \u00e9 \u20ac"
        begin = self.fake(b"OK\n", evil + b"\nERR IO " + evil + b"\n")
        process, _ = begin("status")
        output, reported = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual((output.decode(), reported.decode()), (f"{good}\n", f"ERR IO {good}\n"))
        # A peer that rejects it.
        process, _ = self.fake(b"ERR BUSY \x1b[2J\n")("status")
        output, reported = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(reported, b"ERR BUSY \\x1b[2J\n")
        # JSON stays JSON.
        line = b'{"ok":\ttrue, "result": {"name": "\x7f\xc2\x9b\xc3\xa9"}}\r \n'
        process, _ = self.fake(b"OK\n", line)("--json", "status")
        output, reported = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(json.loads(output)["result"]["name"], "\x7f\x9b\u00e9")
        self.assertEqual([byte for byte in output[:-1] if byte < 32 or byte == 127], [])
        self.assertNotIn(b"\x9b", output)

    def test_what_a_peer_reports_is_shown_in_its_order(self):
        """U+202E, U+2066 and U+2028 as bytes in text, as escapes in JSON."""
        turned = "name: a\u202eb\u2066c\u2028d"
        process, _ = self.fake(b"OK\n", turned.encode() + b"\nOK\n")("status")
        output, _ = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(output.decode(), "name: a\\xe2\\x80\\xaeb\\xe2\\x81\\xa6c"
                                          "\\xe2\\x80\\xa8d\nOK\n")
        line = json.dumps({"ok": True, "result": {"name": turned}}, ensure_ascii=False)
        process, _ = self.fake(b"OK\n", line.encode() + b"\n")("--json", "status")
        output, _ = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual(json.loads(output)["result"]["name"], turned)
        self.assertTrue(output.isascii(), output)

    def test_a_line_that_is_too_long_is_reported(self):
        process, _ = self.fake(b"OK\n", b"a: 1\nb: " + b"x" * 300000 + b"\nc: 2\nOK\n")("status")
        output, reported = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual((process.returncode, reported), (0, b""))
        self.assertEqual(output.decode().splitlines(),
                         ["a: 1", "(a line of more than 256 kB is left out)", "c: 2", "OK"])

    def test_what_a_peer_reports_to_a_user(self):
        server, path = self.listen()
        output_text = (b"OK\n", b"a\x1b[2Jb\nERR IO \xc2\x9b\n",
                b"words: show\x1b\nOK\n")

        def serve():
            with server.accept()[0] as peer:
                for text in output_text:
                    peer.recv(4096)
                    peer.sendall(text)
                peer.recv(4096)

        thread = threading.Thread(target=serve)
        thread.start()
        self.addCleanup(thread.join, TIMEOUT_S)
        terminal_user = TerminalUser(path)
        self.addCleanup(terminal_user.close)
        # No control character reaches the screen.
        self.assertEqual(terminal_user.run("show"), ["a\\x1b[2Jb", "ERR IO \\xc2\\x9b"])
        terminal_user.send("sh\t")
        terminal_user.wait_line("vergence> show?")

    def test_a_script_that_breaks_off(self):
        """Complete lines before the break run; a line cut by it does not."""
        for words in ([], ["--keep-going"]):
            here, there = socket.socketpair()
            with there:
                there.sendall(b"x")  # left unread, the other end's close is an error
                here.sendall(b"wait 0\nversi")
                here.close()
                done = self.vergence(*words, stdin=there)
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (1, "OK\n", "vergence: cannot read standard input: Connection "
                              "reset by peer\n"))

    def test_quit_ends_a_script(self):
        for script in ("quit\nstatus\n", " quit # now\nfly\n", "quit"):
            done = self.vergence(input=script)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "OK\n", ""))
        done = self.vergence("--json", input="quit\nstatus\n")
        self.assertEqual((done.returncode, done.stdout.count("\n"), done.stderr), (0, 1, ""))
        done = self.vergence("--keep-going", input="fly\nquit 3\nwait 0\nquit\nstatus\n")
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")),
                         (1, "OK\nOK\n", 2))

    def test_options_in_the_wrong_place(self):
        for words, why in (
                (["--json", "--connect", "unix:/x", "version"],
                 '"--connect ADDRESS" must come first: put "--json" between ADDRESS and the command'),
                (["--keep-going", "--connect=unix:/x"],
                 '"--connect ADDRESS" must come first: put "--keep-going" between ADDRESS and the '
                 "command"),
                (["--connect", "unix:/x", "pan", "--json"],
                 'put "--json" between ADDRESS and the command'),
                (["--connect", "unix:/x", "pan", "left", "--keep-going"],
                 'put "--keep-going" between ADDRESS and the command'),
                (["--connect", "unix:", "status"], 'invalid address "unix:" (expected unix:PATH)'),
                (["--connect", "serial:", "status"],
                 'invalid address "serial:" (expected serial:DEVICE)')):
            done = subprocess.run([VERGENCE, *words], capture_output=True, text=True,
                                  timeout=TIMEOUT_S, stdin=subprocess.DEVNULL)
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (2, "", f"vergence: {why}\n"))
        # A whole line as one argument is only for the daemon.
        done = self.vergence("help --json")
        self.assertEqual((done.returncode, done.stderr[:4]), (1, "ERR "))


if __name__ == "__main__":
    unittest.main()

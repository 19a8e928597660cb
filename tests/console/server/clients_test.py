# SPDX-License-Identifier: Apache-2.0
"""Programs at the socket: answers as text and JSON, several at once, and those that misbehave."""
import json
import os
import random
import resource
import signal
import socket
import stat
import subprocess
import time
import unittest
import zlib

from daemon_process import TIMEOUT_S, VERGENCE, VERGENCED, Client, DaemonTest, replaced, framed
from waiting import wait_until


class Clients(DaemonTest):
    settings = ("clients=6", "queue=2", "reader_timeout=1s")

    def setUp(self):
        self.first = self.seated()
        self.assertEqual(self.first.ask("wait 0")[-1], "OK")

    def seated(self):
        """A client that is served. Slots of closed connections become free soon, not at once."""
        def served():
            client = self.client()
            try:
                if client.ask("version")[-1] == "OK":
                    return client
            except OSError:
                pass  # rejected before it sent a line
            client.socket.close()
            return None
        return wait_until(served, "no seat becomes free")

    def test_answers_as_text(self):
        lines = self.first.ask("version")
        self.assertEqual([line.split(":")[0] for line in lines], ["version", "build", "OK"])
        answer = self.first.ask("zoom")
        self.assertEqual(len(answer), 1)
        self.assertRegex(answer[0], "^ERR NOT_READY zoom: .*bringup")
        self.first.send("\n   \n# a comment\nquit\n")
        self.assertEqual(self.first.line(), "OK")
        self.assertIsNone(self.first.line())

    def test_answers_as_json(self):
        answer = self.first.ask_json("status")
        self.assertEqual((answer["ok"], answer["error"], answer["code"]), (True, "OK", 0))
        self.assertEqual(answer["result"], {"state": "down", "profile": "rig"})
        answer = self.first.ask_json("fly")
        self.assertEqual((answer["ok"], answer["error"], answer["message"]), (
            False, "ARGUMENT", 'unknown command "fly" ("help" lists all commands)'))
        self.first.send("@json\nversion\n@text version\nversion\n@text\nversion\n")
        self.assertTrue(json.loads(self.first.line())["ok"])
        self.assertIn("build", json.loads(self.first.line())["result"])
        self.assertEqual(self.first.answer()[-1], "OK")
        self.assertIn("build", json.loads(self.first.line())["result"])
        self.assertEqual(self.first.answer(), ["OK"])
        self.assertEqual(self.first.answer()[-1], "OK")
        self.assertEqual(self.first.ask("@yaml version")[0][:10], "ERR SYNTAX")

    def test_progress(self):
        self.first.send("@json,progress wait 2\n@progress wait 2\n")
        events = []
        while "ok" not in (events[-1] if events else {}):
            events.append(json.loads(self.first.line()))
        self.assertGreater(len(events), 1)
        self.assertEqual((events[0]["event"], events[0]["what"], events[0]["total"]),
                         ("progress", "waiting", 2000))
        lines = self.first.answer()
        self.assertEqual((lines[0], lines[-1]), ("... waiting 0/2000", "OK"))

    def test_framed(self):
        self.first.send(framed("version"))
        line = self.first.line()
        head, _, crc_text = line.rpartition(', "crc": "')
        self.assertEqual(crc_text, f'{zlib.crc32(head.encode()):08X}"}}')
        self.assertTrue(json.loads(line)["ok"])
        self.first.send(framed("version").replace("version", "vErsion"))
        self.assertEqual(json.loads(self.first.line())["error"], "CRC")
        self.first.send(framed("log 1", "text"))
        lines = [self.first.line()]
        while not lines[-1].startswith("OK"):
            lines.append(self.first.line())
        text = "\n".join(lines)
        self.assertEqual(text[-8:], f"{zlib.crc32(text[:-8].encode()):08X}")
        self.assertEqual(text[-10:-8], " #")
        # Everything after @ is covered by the CRC, and crc is the last option.
        self.first.send(framed("version", "json,progress").replace("progress", "progresx"))
        self.assertEqual(json.loads(self.first.line())["error"], "CRC")
        line = framed("version", "text").replace("@text,", "@").replace(" ", ",text ", 1)
        self.first.send(line)
        self.assertEqual(self.first.line()[:10], "ERR SYNTAX")

    def test_help_is_complete(self):
        groups = self.first.ask_json("help")["result"]
        self.assertEqual(list(groups), ["daily", "look", "move", "light", "measure", "files", "service"])
        self.assertEqual(len(groups["daily"]), 11)
        commands = [name for group in groups.values() for name in group]
        self.assertEqual(len(commands), len(set(commands)))
        wanted = ("help status health selftest pan zoom focus iris exposure gain window capture "
                  "reconstruct record replay calibration registers watch log config version "
                  "bugreport quit").split()
        self.assertEqual([name for name in wanted if name not in commands], [])
        for name in commands:
            self.assertTrue(self.first.ask_json(f"help {name}")["result"]["usage"].startswith(name))

    def test_two_clients_wait_for_each_other_and_a_full_queue_reports_so(self):
        others = [self.client() for _ in range(4)]
        self.first.begin("wait 100000")
        for i in range(2):
            self.assertEqual(others[i].begin("wait 0"),
                             f"... waiting for another client's wait 0/{i + 1}")
        self.assertEqual(others[2].ask("wait 0"), [
            "ERR BUSY too many commands are waiting: try again later"])
        # Commands without the rig do not wait for it.
        self.assertEqual(others[3].ask("version")[-1], "OK")
        self.first.send("\x03")
        self.assertEqual(self.first.begun_answer(), ["ERR CANCELLED cancelled"])
        self.assertEqual(others[0].begun_answer(), ["OK"])
        self.assertEqual(others[1].begun_answer(), ["OK"])

    def test_lines_ahead_of_ctrl_c_are_answered_and_not_run(self):
        self.first.begin("wait 100000")
        self.first.send("@json record start never\n\n# a comment\nversion\nnosuch\nstat\x03")
        self.assertEqual(self.first.begun_answer(), ["ERR CANCELLED cancelled"])
        answer = json.loads(self.first.line())
        self.assertEqual((answer["ok"], answer["error"]), (False, "CANCELLED"))
        self.assertEqual(self.first.answer(), ["ERR CANCELLED cancelled"])
        self.assertIn("nosuch", self.first.answer()[0])
        self.assertEqual(self.first.ask_json("record")["result"]["recording"], "nothing")
        # The same if both arrive at once.
        for _ in range(20):
            self.first.send("wait 1000\n\x03")
            self.assertEqual(self.first.answer(), ["ERR CANCELLED cancelled"])

    def test_what_waits_for_others_is_cancelled_at_once(self):
        others = [self.seated() for _ in range(3)]
        self.first.begin("wait 100000")
        # Their queue places are free at once.
        others[0].begin("status\nversion")
        others[1].send("@json,progress watch 0.1 status\n")
        self.assertEqual(json.loads(others[1].line())["event"], "progress")
        for other, answer in ((others[0], "ERR CANCELLED cancelled"), (others[1], "CANCELLED")):
            begin = time.monotonic()
            other.send("\x03")
            line = other.line()
            while "progress" in line:  # the place of the other one is free
                line = other.line()
            self.assertIn(answer, line)
            self.assertLess(time.monotonic() - begin, 5)
            if other is others[0]:
                self.assertEqual(other.answer(), ["ERR CANCELLED cancelled"])
            self.assertEqual(other.ask("@text version")[-1], "OK")
        for _ in range(4):
            gone = self.seated()
            gone.begin("status")
            gone.socket.close()
        for words in (["status"], ["view"], ["--json", "status"]):
            process = self.begin(*words, text=True)
            said = process.stdout if "--json" in words else process.stderr
            self.assertIn("waiting for another client's wait", said.readline())
            begin = time.monotonic()
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(TIMEOUT_S), 130)
            self.assertLess(time.monotonic() - begin, 5)
            self.assertIn("CANCELLED", said.read())
            self.assertEqual(process.stderr.read(), "")
        self.first.send("\x03")
        self.assertEqual(self.first.begun_answer(), ["ERR CANCELLED cancelled"])

    def test_too_many_clients(self):
        clients = [self.seated() for _ in range(5)]
        self.assertEqual(clients[-1].ask("version")[-1], "OK")
        with Client(self.path) as late:
            self.assertEqual(late.line(), "ERR BUSY too many clients: try again later")
            self.assertIsNone(late.line())
        # Also a client that writes first, before or after the daemon closes the connection.
        for i in range(8):
            with Client(self.path) as late:
                try:
                    for _ in range(20 * i):
                        late.send("version\n")
                except OSError:
                    pass
                self.assertEqual(late.line(), "ERR BUSY too many clients: try again later")
            done = self.vergence("version")
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (1, "", "ERR BUSY too many clients: try again later\n"))
            done = self.vergence("--json", "version")
            self.assertEqual((done.returncode, done.stderr), (1, ""))
            self.assertEqual(json.loads(done.stdout),
                             {"result": {}, "ok": False, "error": "BUSY", "code": -37,
                              "message": "too many clients: try again later"})
            done = self.vergence("fetch", "x", os.path.join(self.folder, "x"))
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (1, "", "ERR BUSY too many clients: try again later\n"))

    def test_half_closed(self):
        self.first.send("version\nwait 1\nversion")
        self.first.socket.shutdown(socket.SHUT_WR)
        answers = [self.first.answer()[-1] for _ in range(3)]
        self.assertEqual((answers, self.first.line()), (["OK", "OK", "OK"], None))

    def test_a_client_that_is_killed(self):
        for _ in range(3):
            process = self.begin("wait", "100000")
            self.wait_running()
            process.send_signal(signal.SIGKILL)
            process.wait()
        self.assertEqual(self.first.ask("wait 0"), ["OK"])

    def test_a_client_that_never_reads(self):
        input_paused = self.client()
        input_paused.socket.settimeout(0.2)
        end = time.monotonic() + TIMEOUT_S
        dropped = False
        while not dropped and time.monotonic() < end:
            begin = time.monotonic()
            self.assertEqual(self.first.ask("version")[-1], "OK")
            self.assertLess(time.monotonic() - begin, 5)
            try:
                input_paused.socket.send(200 * b"help\n")
            except TimeoutError:
                pass
            except OSError:
                dropped = True
        self.assertTrue(dropped)
        self.assertIn("a client does not read: dropped", "\n".join(self.first.ask("log 5")))

    def test_very_long_lines_and_garbage(self):
        self.first.send("x" * 513 + "\nversion\n")
        self.assertEqual(self.first.line(),
                         "ERR SYNTAX the line is longer than 512 characters")
        self.assertEqual(self.first.answer()[-1], "OK")
        self.first.send("y" * 100000 + "\nversion\n")
        self.assertEqual(self.first.line(),
                         "ERR SYNTAX the line is longer than 512 characters")
        self.assertEqual(self.first.answer()[-1], "OK")
        self.first.send(b"ver\0sion\n")
        self.assertEqual(self.first.line(), "ERR SYNTAX the line contains a control character")
        seed = int(os.environ.get("VERGENCE_TEST_SEED", random.randrange(1 << 32)))
        print(f"VERGENCE_TEST_SEED={seed}")
        chance = random.Random(seed)
        for _ in range(200):
            self.first.send(bytes(chance.randrange(256) for _ in range(chance.randrange(400))))
        self.first.send("\n\x03\nversion\nquit\n")
        lines = []
        while (line := self.first.line()) is not None:
            lines.append(line)
        self.assertEqual(lines[-2:], ["OK", "OK"])

    def test_the_client_reports_an_output_that_fails(self):
        read_end, write_end = os.pipe()
        os.close(read_end)
        # No further request is sent.
        with os.fdopen(write_end, "wb") as closed, open("/dev/full", "wb") as full:
            for output, code, reported in ((closed, 141, ""),
                                       (full, 1, "vergence: writing to standard output failed: No "
                                        "space left on device\n")):
                done = subprocess.run([VERGENCE, "--connect", f"unix:{self.path}"],
                                      input="version\nnix\n", stdout=output,
                                      stderr=subprocess.PIPE, text=True, timeout=TIMEOUT_S)
                self.assertEqual((done.returncode, done.stderr), (code, reported))

    def test_the_socket_is_for_owner_and_group(self):
        self.assertEqual(stat.S_IMODE(os.stat(self.path).st_mode), 0o660)

    def test_a_second_daemon_does_not_take_the_socket(self):
        done = subprocess.run([VERGENCED, *replaced(self.arguments(), "store=none")],
                              capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual(done.returncode, 3)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertEqual(self.first.ask("version")[-1], "OK")

    def test_all_threads_are_confined(self):
        tasks = f"/proc/{self.daemon.pid}/task"
        for task in os.listdir(tasks):
            with open(f"{tasks}/{task}/status", encoding="utf-8") as file:
                lines = dict(line.split(":", 1) for line in file if ":" in line)
            self.assertEqual((lines["Seccomp"].strip(), lines["NoNewPrivs"].strip()), ("2", "1"))

    def test_files_stay_where_they_are(self):
        with open(os.path.join(self.files, "a b.txt"), "w", encoding="utf-8") as file:
            file.write("hello")
        os.symlink("/etc/passwd", os.path.join(self.files, "link"))
        self.addCleanup(os.remove, os.path.join(self.files, "link"))
        self.assertEqual(self.first.ask_json('fetch "a b.txt"')["result"],
                         {"size": 5, "crc": f"{zlib.crc32(b'hello'):08X}"})
        self.assertEqual(self.first.ask_json('fetch "a b.txt" offset=1 bytes=3')["result"]["data"], "ZWxs")
        self.assertEqual(self.first.ask_json('fetch "a b.txt" offset=9')["result"]["bytes"], 0)
        for name in ("link", "../rig.sock", "/etc/passwd", "..", ".", "a/../../x", ".hidden", "no"):
            self.assertFalse(self.first.ask_json(f"fetch {name}")["ok"], name)
        self.assertIn("  - file a b.txt, size 5 bytes", self.first.ask("files"))
        self.assertEqual(self.first.ask_json("files")["units"], {"files[].size": "bytes"})
        self.assertEqual(self.first.ask_json("help fetch")["result"]["offset"]["expected"],
                         "an integer from 0 to 1000000000000000 bytes")
        self.assertRegex(self.first.ask('fetch "a b.txt" offset=-1')[-1],
                         '^ERR RANGE fetch: offset "-1" .*from 0 to 1000000000000000 bytes')

    def test_calibration(self):
        self.assertEqual(self.first.ask("calibration")[0][:11], "ERR MISSING")
        self.assertEqual(self.first.ask("calibration set")[0][:11], "ERR MISSING")
        with open(os.path.join(self.files, "bad.txt"), "w", encoding="utf-8") as file:
            file.write("vergence calibration 99\n")
        answer = self.first.ask("calibration set bad.txt")[0]
        self.assertTrue(answer.startswith("ERR ") and "bad.txt:1" in answer, answer)
        for command, words in (
                ("calibration forget", "^ERR MISSING calibration: "),
                ("calibration show x", '^ERR ARGUMENT calibration: .*FILE "x".*"set"'),
                ("calibration forget x", '^ERR ARGUMENT calibration: .*FILE "x".*"set"'),
                ("record stop x", '^ERR ARGUMENT record: .*NAME "x".*"start"')):
            answer = self.first.ask(command)
            self.assertEqual(len(answer), 1, answer)
            self.assertRegex(answer[0], words)


class NoDescriptors(DaemonTest):
    """A daemon that may open no more files than it has."""
    settings = ("clients=12",)

    def busy_s(self):
        with open(f"/proc/{self.daemon.pid}/stat", encoding="ascii") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def test_excess_clients_wait_and_nothing_spins(self):
        first = self.client()
        self.assertEqual(first.ask("version")[-1], "OK")
        # At most one more: the lowest free descriptor is used next.
        highest = max(map(int, os.listdir(f"/proc/{self.daemon.pid}/fd")))
        resource.prlimit(self.daemon.pid, resource.RLIMIT_NOFILE, (highest + 2, highest + 2))
        others = [self.client() for _ in range(8)]
        begun_s = self.busy_s()
        time.sleep(1)
        self.assertLess(self.busy_s() - begun_s, 0.5)
        self.assertEqual(first.ask("version")[-1], "OK")
        for other in others[:-1]:
            other.socket.close()
        self.assertEqual(others[-1].ask("version")[-1], "OK")

if __name__ == "__main__":
    unittest.main()

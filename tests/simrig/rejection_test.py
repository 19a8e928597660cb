# SPDX-License-Identifier: Apache-2.0
"""Bad input to the real process: one line, or a closed connection with its reason; the right exit
code; never a hang; nothing left behind."""
import os
import signal
import stat
import struct
import unittest

from simrig_client import ADVANCE, BAD_REQUEST, BRIDGE, CONTROLLER, FAILED, SCENE, Bench, Gone


class StartUp(Bench):
    def refuse(self, code, arguments, *words):
        self.assert_refused(self.run_simrig(*arguments), code, *words)

    def test_wrong_usage(self):
        listen = ["--listen", "tcp:0", "--scene", self.scene]
        for arguments, word in (
                ([], "--listen or --view"), (["--listen", "tcp:0"], "--scene is required"),
                (["--scen", "x", "--listen", "tcp:0"], "unknown option '--scen'"),
                ([*listen, "--seed"], "--seed"), ([*listen, "extra"], "'extra'"),
                ([*listen, "--seed", "-1"], "from 0 to 4294967295"),
                ([*listen, "--seed", "1e3"], "not '1e3'"), ([*listen, "--threads", "0"], "1 to 64"),
                ([*listen, "--zoom", "11"], "from 1 to 10"), ([*listen, "--zoom", "nan"], "nan"),
                ([*listen, "--pty"], "--wall"), ([*listen, "--log", ""], "empty"),
                ([*listen, "--wall", "--log", "x"], "--log"), ([*listen, "--until", "3"], "--from"),
                ([*listen, "--replay", "x"], "--replay allows"),
                (["--replay", "x", "--every-clock"], "log"),
                (["--from", "x", "--every-clock", "--listen", "tcp:0"], "log"),
                (["--replay", "x", "--begin", "5"], "log"),
                (["--scene", "x", "--listen", "tcp:0", "--begin", "-1"],
                 "0 to 1000000, not '-1'"),
                (["--scene", "x", "--listen", "tcp:0", "--begin", "5", "--wall"],
                 "--begin excludes --wall")):
            self.refuse(2, arguments, word, "see simrig --help")

    def test_help_and_version(self):
        for option, word in (("--help", "usage: simrig"), ("--help-control", "fault camera"),
                             ("--version", "protocol 1")):
            done = self.run_simrig("--scene", "x", option)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn(word, done.stdout)

    def test_where_to_listen(self):
        (self.folder / "s.sock.new").write_text("x")
        for where, word in (("here", "neither unix:PATH nor tcp:PORT"), ("tcp:x", "'x'"),
                            ("tcp:70000", "70000"), ("tcp:-1", "-1"), ("tcp:", "''"),
                            ("unix:", "1 to 103"), ("unix:" + "x" * 200, "1 to 103")):
            self.refuse(2, ["--scene", "none.yaml", "--listen", where], word)
        for where, word in (("unix:no/such", "no/such"),
                            ("unix:scene.yaml", "scene.yaml exists and is not a socket"),
                            ("unix:s.sock", "s.sock.new exists and is not a socket")):
            self.refuse(1, ["--scene", self.scene, "--listen", where], word)
        for option in (("--zoom", "3"), ("--focus", "900")):
            self.refuse(2, ["--scene", "none.yaml", "--listen", "unix:s", *option], "--view")
        self.assertEqual(self.scene.read_text(), SCENE)
        self.assertEqual((self.folder / "s.sock.new").read_text(), "x")

    def test_in_use(self):
        first = self.start(where="tcp:0")
        port = first.where.rpartition(":")[2]
        self.refuse(1, ["--scene", self.scene, "--listen", f"tcp:{port}"], "in use")
        path = self.folder / "s.sock"
        second = self.start(where=f"unix:{path}")
        self.assertEqual(stat.S_IMODE(path.stat().st_mode) & 0o077, 0, "open to others")
        self.refuse(1, ["--scene", self.scene, "--listen", f"unix:{path}"], "in use")
        self.assertTrue(second.client().time_us() >= 0)
        # A killed process leaves its socket, which is replaced.
        second.process.kill()
        second.process.wait()
        self.assertTrue(path.exists())
        third = self.start(where=f"unix:{path}")
        self.assertEqual(third.stop(), 0)
        self.assertFalse(path.exists())

    def bad_file(self, name, content):
        path = self.folder / name
        path.write_bytes(content)
        return path

    def test_bad_scenes_rigs_and_scripts(self):
        listen = ["--listen", f"unix:{self.folder}/n.sock"]
        os.mkfifo(self.folder / "pipe.yaml")
        bad_yaml = self.bad_file("bad.yaml", b"room: [\n")
        control = self.bad_file("control.yaml", b"room: \"\\q\x07\x1b[2J\"\n")
        deep = self.bad_file("deep.yaml", b"[" * 100000)
        wrong = self.bad_file("wrong.yaml", SCENE.replace("lux: 0", "lux: x").encode())
        large = self.bad_file("large.yaml", b"# \n" * 2000000)
        for name, word in (("nosuch", "still_life"), ("./nosuch", "cannot be read"),
                           (self.folder / "pipe.yaml", "not a file"),
                           (f"{self.folder}/", "not a file"), ("/dev/zero", "not a file"),
                           (bad_yaml, "bad.yaml:"), (control, "YAML"),
                           (deep, "deep.yaml"), (wrong, "wrong.yaml:7: not a number"),
                           (large, "too long")):
            self.refuse(3, ["--scene", name, *listen], word)
        for name, word in (("nosuch", "perfect"), (bad_yaml, "bad.yaml:"), (wrong, "wrong.yaml:"),
                           ("/dev/null", "not a file")):
            self.refuse(3, ["--scene", self.scene, "--rig", name, *listen], word)
        script = self.bad_file("script", b"# faults\n\nat 1 fault servo left jam\nat 2 fault cat\n")
        self.refuse(3, ["--scene", self.scene, "--script", script, *listen], f"{script}:4: ", "cat")
        self.refuse(3, ["--scene", self.scene, "--script", self.folder, *listen], "not a file")
        self.refuse(3, ["--scene", self.scene, "--script", "nosuch", *listen], "nosuch")
        self.assertFalse((self.folder / "n.sock").exists())

    def test_bad_logs(self):
        listen = ["--scene", self.scene, "--listen", f"unix:{self.folder}/n.sock"]
        self.refuse(1, [*listen, "--log", "/dev/full"], "No space left")
        self.refuse(1, [*listen, "--log", "no/such"], "No such file")
        log = self.folder / "run.log"
        running = self.start("--log", log)
        running.client().read(BRIDGE, 0)
        self.assertEqual(running.stop(), 0)
        good = log.read_bytes()
        for name, content, word in (("short", good[:-3], "within"), ("head", good[:9], "within"),
                                    ("empty", b"", "not a log"), ("text", b"x" * 99, "not a log"),
                                    ("bad", good[:-30] + b"\xff" * 30, "damaged")):
            path = self.bad_file(name, content)
            done = self.run_simrig("--replay", path)
            self.assertEqual((done.returncode, done.stdout), (3, ""), name)
            self.assertIn("simrig: ", done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)
            if name != "bad":
                self.assertIn(word, done.stderr)
        self.refuse(3, ["--replay", "nosuch"], "nosuch")
        self.scene.write_text(SCENE + "\n")
        self.refuse(3, ["--replay", log], "has changed")
        self.assertFalse((self.folder / "n.sock").exists())


class Clients(Bench):
    def setUp(self):
        super().setUp()
        self.running = self.start()

    def raw(self):
        return self.running.client(greet=False)

    def assert_alive(self):
        client = self.running.client(CONTROLLER)
        client.time_us()
        client.close()

    def test_another_protocol(self):
        for sent in (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"\xff" * 4096):
            client = self.raw()
            client.socket.sendall(sent)
            _, _, status, text = client.receive()
            self.assertEqual(status, BAD_REQUEST)
            self.assertIn(b"16777216", text)
            self.assert_closed(client)
        self.assert_alive()

    def test_bad_commands(self):
        client = self.running.client(CONTROLLER)
        for line in ("", "dance", "scene", "scene nosuch", "scene /dev/zero", "truth", "truth up x",
                     "truth left x", "view x", "fault", "fault cat", "fault servo left", "at",
                     "at x fault bus ok", "at 5", "at 5 status", "at -1 fault bus ok",
                     "at 1e9 fault bus ok", "fault camera left torn 10", "fault serial late -1",
                     "fault serial garbage 1.5", "move", "move cat 1 2 3", "move board 1 2",
                     "move board 1 2 x", "move board 1 2 nan", "move board 1 2 3 4", "restore x",
                     "snapshot", "snapshot a b", "status x", "help x", "fault bus ok extra",
                     "scene \x1b[2J\n"):
            text = self.assert_rejection(FAILED, client.control, line)
            self.assertTrue(text and "\x1b" not in text, line)
        self.assertIn("time_s", client.control("status"))

    def test_signals(self):
        for how in (signal.SIGINT, signal.SIGTERM):
            running = self.start()
            path = running.where.partition(":")[2]
            board = running.client()
            board.send(ADVANCE, struct.pack("<QI", 80000 * 10 ** 6, 0))
            self.assertEqual(running.stop(how), 0)
            self.assertEqual(running.complaint(), "")
            self.assertFalse(os.path.exists(path))
            self.assertRaises(Gone, board.receive)

    def test_silent_ones_make_room(self):
        silent = [self.raw() for _ in range(32)]
        self.assertIn("time_s", self.running.client(CONTROLLER).control("status"))
        self.assert_closed(silent[0])
        self.assert_alive()


if __name__ == "__main__":
    unittest.main()

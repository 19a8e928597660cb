# SPDX-License-Identifier: Apache-2.0
"""Access: web pages, programs without the token, clients that never send a line."""
import http.client
import json
import os
import re
import socket
import stat
import subprocess
import sys
import tempfile
import time
import unittest

from daemon_process import TIMEOUT_S, VERGENCE, VERGENCED, Client, DaemonTest

GREETING_S = 10


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Tcp(Client):
    """A program at the daemon's port."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), TIMEOUT_S)
        self.left = b""

    def line(self):
        try:
            return super().line()
        except ConnectionResetError:
            return None


def post(connection, body):
    """Sends what a browser page can send without permission; returns whether there was any
    answer."""
    try:
        connection.request("POST", "/", body, {"Content-Type": "text/plain"})
        connection.getresponse()
    except (http.client.HTTPException, OSError) as error:
        return not isinstance(error, (http.client.RemoteDisconnected, ConnectionError))
    return True


class WithPort(DaemonTest):
    """A daemon with a port."""

    @classmethod
    def arguments(cls):
        cls.port = free_port()
        cls.where = f"tcp:127.0.0.1:{cls.port}"
        cls.token = os.path.join(cls.folder, "token")
        return [*super().arguments(), f"tcp_port={cls.port}", f"tcp_token={cls.token}"]

    def tcp(self):
        client = Tcp(self.port)
        self.addCleanup(client.socket.close)
        return client

    def the_token(self):
        with open(self.token, encoding="ascii") as file:
            return file.read().strip()



class Port(WithPort):
    def pan(self):
        return self.client().ask_json("status")["result"]["left"]["pan"]

    def test_a_web_page_moves_nothing(self):
        client = self.client()
        self.assertEqual(client.ask("bringup")[-1], "OK")
        self.assertEqual(client.ask("pan 1 side=left")[-1], "OK")
        page = http.client.HTTPConnection("127.0.0.1", self.port, timeout=TIMEOUT_S)
        self.addCleanup(page.close)
        answered = post(page, "pan 5 side=left\n")
        # What was sent with it has been read or never will be, as later requests are handled later.
        self.assertAlmostEqual(self.pan(), 1, delta=0.1)
        self.assertFalse(answered)
        # A proxy may forward the page to the Unix socket, with a path of any length.
        for path in ("/", "/" + 600 * "x"):
            client = self.client()
            client.send(f"POST {path} HTTP/1.1\r\nHost: x\r\n\r\npan 5 side=left\n")
            with self.assertRaises((AssertionError, ConnectionError)):
                client.answer()
        self.assertAlmostEqual(self.pan(), 1, delta=0.1)

    def test_nothing_runs_before_the_token(self):
        for first in ("bugreport", "@text", "@json bugreport", "@token", "@token x",
                      "@token " + 64 * "0", f"@token {self.the_token()[:-1]}",
                      f"@token {self.the_token()}0", f" @token {self.the_token()}",
                      f"@token  {self.the_token()}", "x" * 700, "\0", "# a comment"):
            with self.subTest(first):
                client = self.tcp()
                client.send(first + "\n")
                self.assertTrue(client.line().startswith("ERR REFUSED "))
                self.assertIsNone(client.line())
                # Together with the following lines.
                client = self.tcp()
                client.send(f"{first}\n@token {self.the_token()}\nbugreport\n")
                self.assertIn((client.line() or "ERR REFUSED ")[:12], "ERR REFUSED ")
                self.assertIsNone(client.line())
        self.assertEqual(os.listdir(self.files), [])

    def test_with_the_token_it_is_like_the_socket(self):
        client = self.tcp()
        client.send(f"\n@token {self.the_token()}\r\nversion\n@json version\n")
        self.assertEqual(client.line(), "OK")
        self.assertEqual(client.answer()[-1], "OK")
        self.assertIn('"ok": true', client.line())
        # A tunnel may lead from a port here to the socket there, which needs no token.
        client = self.client()
        self.assertEqual(client.ask("@token x"), ["OK"])
        self.assertEqual(client.ask("version")[-1], "OK")

    def test_the_client_finds_it(self):
        done = self.vergence("--token", self.token, "version", where=self.where)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        other = os.path.join(self.folder, "other")
        with open(other, "w", encoding="ascii") as file:
            file.write(64 * "0" + "\n")
        os.chmod(other, 0o600)
        done = self.vergence("--token", other, "version", where=self.where)
        self.assertEqual((done.returncode, done.stderr[:12]), (1, "ERR REFUSED "))
        for name, content, mode, word in (("none", None, 0, "No such file"),
                                          ("open", 64 * "0", 0o644, "chmod 600"),
                                          ("short", 63 * "0", 0o600, "64")):
            path = os.path.join(self.folder, name)
            if content:
                with open(path, "w", encoding="ascii") as file:
                    file.write(content)
                os.chmod(path, mode)
            done = self.vergence("--token", path, "version", where=self.where)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
            self.assertIn(path, done.stderr)
            self.assertIn(word, done.stderr)

    def test_the_file(self):
        about = os.stat(self.token)
        self.assertEqual((stat.S_IMODE(about.st_mode), about.st_size), (0o600, 65))
        self.assertRegex(self.the_token(), "^[0-9a-f]{64}$")


class DefaultPlace(WithPort):
    """The daemon makes the file where the client looks for it."""

    @classmethod
    def arguments(cls):
        cls.environment = {"XDG_STATE_HOME": os.path.join(cls.folder, "state")}
        arguments = [word for word in super().arguments() if not word.startswith("tcp_token=")]
        cls.token = os.path.join(cls.folder, "state", "vergence", "tcp_token")
        return arguments

    def test_the_client_finds_it(self):
        done = self.vergence("version", where=self.where, env={**os.environ, **self.environment})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        # Without a token the message names the file.
        done = self.vergence("version", where=self.where,
                             env={**os.environ, "XDG_STATE_HOME": os.path.join(self.folder, "x")})
        self.assertEqual((done.returncode, done.stderr[:12]), (1, "ERR REFUSED "))
        self.assertIn("--token", done.stderr)

    def test_it_outlives_a_restart(self):
        before = self.the_token()
        self.end(self.daemon)
        self.start()
        self.assertEqual(self.the_token(), before)


class Refused(unittest.TestCase):
    def test_a_file_that_others_can_read(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        for mode, content, word in ((0o640, 64 * "0" + "\n", "chmod 600"),
                                    (0o604, 64 * "0" + "\n", "chmod 600"),
                                    (0o600, "", "remove"), (0o600, 64 * "g" + "\n", "remove")):
            with self.subTest(oct(mode)):
                self.check(mode, content, word)

    def check(self, mode, content, word):
        path = os.path.join(self.folder, "token")
        with open(path, "w", encoding="ascii") as file:
            file.write(content)
        os.chmod(path, mode)
        done = subprocess.run(
            [VERGENCED, "profile=two-cameras", "backend=linux", "left_camera=/dev/none",
             "right_camera=/dev/none2", "store=none", "files=none", "socket=none",
             "log_level=error", f"tcp_port={free_port()}", f"tcp_token={path}"],
            capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        self.assertIn(f"tcp_token = {path}: ", done.stderr)
        self.assertIn(word, done.stderr)


class Network(unittest.TestCase):
    """The setting tcp_network, in a network of the test's own: its machine has an address inside
    and one outside."""

    def test_it_serves_that_network_only(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        done = subprocess.run(
            ["unshare", "--map-root-user", "--net", "sh", "-ec",
             "for at in 127.0.0.1/8 192.0.2.1/24 198.51.100.1/24; do ip addr add $at dev lo; done; "
             'ip link set lo up; exec "$@"', "sh", sys.executable, "-B", __file__, folder.name],
            capture_output=True, text=True, timeout=4 * TIMEOUT_S)
        if done.stderr.startswith("unshare:"):
            self.skipTest(f"no network of its own: {done.stderr}")
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stderr)
        results = json.loads(done.stdout)
        for source, line in (("127.0.0.1", "OK"), ("192.0.2.1", "OK"),
                             ("198.51.100.1", "ERR REFUSED your address")):
            self.assertEqual(results["answers"][source][:len(line)], line, results)
        # A browser there can reach the port, but has no token.
        self.assertEqual(results["answers"]["page"], "")
        log = results["log"].splitlines()
        risk = [line for line in log if "tcp_network = 192.0.2.0/24" in line]
        self.assertEqual(len(risk), 1, log)
        self.assertIn("without encryption", risk[0])
        self.assertIn("warning", risk[0])
        refused = [line for line in log if "198.51.100.1" in line]
        self.assertEqual(len(refused), 1, log)
        self.assertIn("outside of tcp_network: refused", refused[0])
        self.assertEqual(results["transfer"], [0, 0, 0, 0], results)


def run_in_network(folder):
    """Prints what clients at several addresses get."""
    port, token = 4300, os.path.join(folder, "token")
    daemon = subprocess.Popen(
        [VERGENCED, "profile=two-cameras", "backend=linux", "left_camera=/dev/none",
         "right_camera=/dev/none2", "store=none", f"files={folder}/files", f"log={folder}/log",
         f"socket={folder}/v.sock", f"tcp_port={port}", "tcp_network=192.0.2.0/24",
         f"tcp_token={token}"], stderr=subprocess.DEVNULL)
    answers = {}
    try:
        DaemonTest.wait_for(f"{folder}/v.sock")
        with open(token, encoding="ascii") as file:
            greeting = f"@token {file.read().strip()}\n"
        for name, source, first in (("127.0.0.1", "127.0.0.1", greeting),
                                    ("192.0.2.1", "192.0.2.1", greeting),
                                    ("198.51.100.1", "198.51.100.1", greeting),
                                    ("page", "192.0.2.1", "POST / HTTP/1.1\r\n\r\n")):
            host = "127.0.0.1" if source == "127.0.0.1" else "192.0.2.1"
            with socket.create_connection((host, port), TIMEOUT_S, (source, 0)) as client:
                try:
                    client.sendall(first.encode())
                    answers[name] = client.recv(4096).decode()
                except ConnectionResetError:
                    answers[name] = ""
        transfer = over_tcp(folder, ["--token", token], f"tcp:192.0.2.1:{port}")
    finally:
        daemon.terminate()
        daemon.wait(TIMEOUT_S)
    with open(f"{folder}/log", encoding="utf-8") as file:
        print(json.dumps({"answers": answers, "transfer": transfer, "log": file.read()}))


def over_tcp(folder, token, where):
    """The exit codes of send, fetch and bugreport, and of a comparison of the files."""
    sent, fetched = f"{folder}/sent", f"{folder}/fetched"
    with open(sent, "wb") as file:
        file.write(os.urandom(100000))

    def run(*words):
        return subprocess.run([VERGENCE, "--connect", where, *token, *words], cwd=folder,
                              capture_output=True, text=True, timeout=TIMEOUT_S)
    codes = [run("send", sent, "data").returncode, run("fetch", "data", fetched).returncode]
    report = re.search(r"bugreport-[0-9-]*\.txt", run("bugreport").stdout)
    codes.append(run("fetch", report[0]).returncode if report else 9)
    with open(sent, "rb") as first, open(fetched, "rb") as second:
        codes.append(int(first.read() != second.read()))
    return codes


class Readme(unittest.TestCase):
    """The example of the manual, at a port that is free."""

    def test_it_runs(self):
        readme = os.path.join(os.environ["VERGENCE_SOURCE"], "daemon", "manual.md")
        with open(readme, encoding="utf-8") as file:
            block = re.search(r"^vergenced (tcp_port=.*) &\nvergence (.*)$", file.read(), re.M)
        port = str(free_port())
        serve, ask = (words.replace("4300", port).split() for words in block.groups())
        with tempfile.TemporaryDirectory() as folder:
            log = os.path.join(folder, "log")
            daemon = subprocess.Popen([VERGENCED, *serve, f"log={log}"], cwd=folder)
            self.addCleanup(daemon.wait, TIMEOUT_S)
            self.addCleanup(daemon.terminate)
            DaemonTest.wait_for(os.path.join(folder, "rig.token"))
            done = subprocess.run([VERGENCE, *ask], cwd=folder, capture_output=True, text=True,
                                  timeout=TIMEOUT_S)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn("state: down", done.stdout)
            daemon.terminate()
            daemon.wait(TIMEOUT_S)


class Silent(WithPort):
    """Silent clients do not block others and are dropped."""
    settings = ("clients=3",)

    def test_they_hold_no_slots(self):
        talker = self.client()
        self.assertEqual(talker.ask("version")[-1], "OK")
        silent = [self.client() for _ in range(6)] + [self.tcp() for _ in range(6)]
        for _ in range(200):
            with Client(self.path) as client:
                self.assertEqual(client.ask("version")[-1], "OK")
        done = self.vergence("--token", self.token, "version", where=self.where)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        # Clients that have greeted keep their slots.
        others = [self.client(), self.client()]
        for client in others:
            self.assertEqual(client.ask("version")[-1], "OK")
        self.assertIn("ERR BUSY", self.vergence("version").stderr)
        self.assertEqual(talker.ask("version")[-1], "OK")
        for client in (*others, *silent):
            client.socket.close()

    def test_they_are_dropped(self):
        talker, nothing, garbage = (self.client() for _ in range(3))
        begin = time.monotonic()
        self.assertEqual(talker.ask("version")[-1], "OK")
        self.assertTrue(garbage.ask("fly")[-1].startswith("ERR ARGUMENT"))
        nothing.send("versi")
        for client in (nothing, garbage):
            self.assertTrue(client.line().startswith("ERR TIMEOUT"))
            self.assertIsNone(client.line())
        self.assertGreater(time.monotonic() - begin, GREETING_S - 0.5)
        half = self.tcp()
        half.send("@token")
        self.assertTrue(half.line().startswith("ERR TIMEOUT"))
        self.assertIsNone(half.line())
        # A client that was silent after its first line stays.
        self.assertEqual(talker.ask("version")[-1], "OK")


if __name__ == "__main__":
    if len(sys.argv) == 2 and os.path.isdir(sys.argv[1]):
        run_in_network(sys.argv[1])
    else:
        unittest.main()

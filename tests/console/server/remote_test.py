# SPDX-License-Identifier: Apache-2.0
"""The shipped client: a single command, a script, a person, files over a line that loses bytes."""
import contextlib
import json
import os
import pathlib
import pty
import random
import resource
import select
import shutil
import signal
import socket
import stat
import subprocess
import threading
import time
import tty
import unittest
import zlib

import numpy

from bad_line import BadLine
from daemon_process import TIMEOUT_S, VERGENCE, VERGENCED, ConsoleTest
from recorded import add_notes
from terminal_user import TerminalUser
from waiting import wait_until


class Remote(ConsoleTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.content = random.Random(5).randbytes(100000)
        os.makedirs(os.path.join(cls.files, "session"), exist_ok=True)
        with open(os.path.join(cls.files, "session", "frame.bin"), "wb") as file:
            file.write(cls.content)

    def path_of(self, name):
        return os.path.join(self.folder, name)

    def test_one_command(self):
        done = self.vergence("wait", "0.5")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "OK\n", ""))
        done = self.vergence("pan", "-3", "--side", "left")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertTrue(done.stderr.startswith("ERR NOT_READY pan: "), done.stderr)
        done = self.vergence("--json", "status")
        self.assertEqual((done.returncode, json.loads(done.stdout)["ok"]), (0, True))
        done = self.vergence("--json", "fly")
        self.assertEqual((done.returncode, json.loads(done.stdout)["error"]), (1, "ARGUMENT"))
        done = self.vergence("watch", "0.1", "log 1", "--count", "2")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_script(self):
        done = self.vergence(input="# first\nversion\n\nfly\nversion\n")
        self.assertEqual((done.returncode, done.stdout.count("build")), (1, 1))
        done = self.vergence("--keep-going", input="fly\nversion")
        self.assertEqual((done.returncode, done.stdout.count("build")), (1, 1))
        done = self.vergence(input="@json version\n")
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (1, "", 'vergence: "@json": lines beginning with @ are reserved for the client '
                          "(use --json for JSON)\n"))
        done = self.vergence(input="version\nwait 0\n")
        self.assertEqual((done.returncode, done.stdout.count("OK\n")), (0, 2))

    def test_no_connection(self):
        for where in ("unix:/no/such", "tcp:127.0.0.1:1", "serial:/dev/null", "serial:/no/such"):
            done = self.vergence("version", where=where)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (3, "", 1),
                             done.stderr)

    def test_a_place_that_makes_no_sense(self):
        for where, why in (
                ("carrier:pigeon", "expected unix:PATH, tcp:HOST:PORT or serial:DEVICE"),
                ("foo.sock", "expected unix:PATH, tcp:HOST:PORT or serial:DEVICE"),
                ("tcp:nowhere", "expected tcp:HOST:PORT"),
                ("tcp:127.0.0.1:73324", 'invalid port "73324"'),
                ("tcp:127.0.0.1:99999", 'invalid port "99999"'),
                ("tcp:127.0.0.1:0", 'invalid port "0" (expected 1 to 65535)'),
                ("tcp:127.0.0.1:18446744073709551617", "invalid port"),
                ("tcp:127.0.0.1:", 'invalid port ""'),
                ("tcp:127.0.0.1:8o", 'invalid port "8o"'),
                (f"serial:{self.console.name}:12345", "unsupported speed 12345"),
                (f"serial:{self.console.name}:4295082496", "expected serial:DEVICE:BAUD"),
                ("unix:/" + 200 * "x", "path too long")):
            done = self.vergence("version", where=where)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1),
                             done.stderr)
            self.assertIn(why, done.stderr)

    def test_what_fails_is_json_too(self):
        """Every error is one object on standard output, without other text."""
        nowhere = "unix:/no/such"
        for where, words, code, error in (
                (nowhere, ["version"], 3, "IO"),
                (nowhere, ["fetch", "x"], 3, "IO"),
                ("tcp:127.0.0.1:1", ["version"], 3, "IO"),
                ("serial:/dev/null", ["version"], 3, None),
                ("serial:/no/such", ["version"], 3, None),
                ("carrier:pigeon", ["version"], 2, "ARGUMENT"),
                ("tcp:127.0.0.1:0", ["version"], 2, "ARGUMENT"),
                (None, ["help", 600 * "x"], 2, "SYNTAX"),
                (None, ["help", '"x'], 1, "ARGUMENT"),
                (None, ['"x'], 1, "SYNTAX"),
                (None, ["@text", "version"], 1, "SYNTAX")):
            done = self.vergence("--json", *words, where=where)
            self.assertEqual((done.returncode, done.stderr), (code, ""), (where, words))
            answer = json.loads(done.stdout)
            self.assertEqual((answer["ok"], answer["result"]), (False, {}))
            self.assertLess(answer["code"], 0)
            self.assertNotEqual(answer["message"], "")
            self.assertIn(answer["error"], (error or answer["error"],))

    def stand_in(self, answers, fetching=lambda: None):
        """A daemon in front of the real one that answers `measure` itself, and calls `fetching` before a block
        of a file."""
        path = self.path_of("measures.sock")
        server = socket.socket(socket.AF_UNIX)
        server.bind(path)
        server.listen(1)
        self.addCleanup(os.remove, path)
        self.addCleanup(server.close)
        asked = []

        def pass_back(real, client):
            with contextlib.suppress(OSError):
                while data := real.recv(65536):
                    client.sendall(data)

        def serve():
            while answers:
                with server.accept()[0] as client, socket.socket(socket.AF_UNIX) as real:
                    real.connect(self.path)
                    threading.Thread(target=pass_back, args=(real, client), daemon=True).start()
                    with client.makefile("rb") as lines:
                        for line in lines:
                            command = line.split(b" ", 1)[-1].decode().strip()
                            if command.startswith("measure "):
                                asked.append(command)
                                client.sendall(answers.pop(0).encode())
                            else:
                                if " offset=" in command:
                                    fetching()
                                real.sendall(line)
                    real.shutdown(socket.SHUT_RDWR)  # the other thread still reads from it
        threading.Thread(target=serve, daemon=True).start()
        return f"unix:{path}", asked

    def make_surface(self, result):
        """A compact surface, made of a flat scene, in `result`. Returns its mesh."""
        generator = numpy.random.default_rng(7)
        row = generator.integers(0, 256, (96, 150), numpy.uint8)
        for name, first in (("l.pgm", 0), ("r.pgm", 10)):
            with open(self.path_of(name), "wb") as file:
                file.write(b"P5\n128 96\n255\n" + row[:, first:first + 128].tobytes())
        done = subprocess.run([VERGENCE, "reconstruct", self.path_of("l.pgm"), self.path_of("r.pgm"), "--rectified",
                               "--disparity", "0:32", "--out", self.path_of("flat")], capture_output=True, text=True,
                              timeout=TIMEOUT_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        shutil.copy(self.path_of("flat/surface.compact"), result)
        return pathlib.Path(self.path_of("flat/mesh.ply")).read_bytes()

    def test_measure_brings_the_session_and_makes_the_surface_here(self):
        session = pathlib.Path(self.files) / "cup"
        shutil.copytree(os.path.join(os.environ["VERGENCE_SOURCE"], "tests/sessions/small"), session)
        self.addCleanup(shutil.rmtree, session)
        add_notes(session, "# measure fit=900", "# measure surface pair=1 scale=0.5")
        result = pathlib.Path(self.files) / "surface-cup-1"
        result.mkdir()
        self.addCleanup(shutil.rmtree, result)
        theirs = self.make_surface(result)
        text = "name: cup\nsession: {}\nsentence: good\n{}OK\n"
        made = "result: surface-cup-1\n"
        as_json = {"ok": True, "result": {"name": "cup", "session": "cup", "result": "surface-cup-1"}}
        where, asked = self.stand_in([
            "... aim: it is left 3/40\n" + text.format("cup", made),
            json.dumps(as_json) + "\n", text.format("cup", ""), text.format("r1", made),
            text.format("cup", made).replace("cup\n", "../cup\n"), text.format("cup", made)])
        place = pathlib.Path(self.path_of("pc"))
        place.mkdir()

        def measure(*words, program=os.environ["VERGENCE"], json_too=(), fresh=True, name="cup"):
            if fresh:
                shutil.rmtree(place / "cup", ignore_errors=True)
            return subprocess.run([program, "--connect", where, *json_too, "measure", name, *words],
                                  capture_output=True, text=True, timeout=TIMEOUT_S, cwd=place)
        done = measure("fit=900", "--quick", "--out", "made")
        # A session of 128 x 96 px: too small for a good surface, but it has a report.
        self.assertIn(done.returncode, (0, 4), done.stderr)
        self.assertIn("written: cup, ", done.stdout)
        self.assertEqual(sorted(os.listdir(place / "cup")), sorted(os.listdir(session)))
        self.assertIn("searched", done.stdout + "searched" * (done.returncode == 4))
        self.assertIn("aim: it is left\n", done.stderr)  # also where that is not a terminal
        # Faults of the part that is made here: nothing is measured.
        for words, code, why in ((["--board", "10x7"], 2, "--square"), (["--board=x"], 2, "board"),
                                 (["length=300"], 2, "--from"), (["--out"], 1, "--out requires a value")):
            for json_too in ([], ["--json"]):
                done = measure(*words, json_too=json_too)
                self.assertEqual((done.returncode, bool(done.stdout)),
                                 (1 if json_too else code, bool(json_too)), done.stderr)
                self.assertIn(why, done.stderr + done.stdout)
        (place / "cup").mkdir()
        done = measure(fresh=False)
        self.assertEqual((done.returncode, done.stdout), (1, ""), done.stderr)
        self.assertIn("cup exists here", done.stderr)
        done = measure(name="--plan", fresh=False)
        self.assertEqual((done.returncode, done.stdout), (1, ""), done.stderr)
        self.assertIn("NAME is missing", done.stderr)
        done = measure(json_too=["--json"])
        self.assertEqual(done.stderr.count("\n"), int(done.returncode == 4), done.stderr)
        self.assertEqual(json.loads(done.stdout)["result"]["fetched"], "cup")
        done = measure("plan", fresh=False)
        self.assertEqual((done.returncode, done.stdout), (0, text.format("cup", "")))
        done = measure()  # while it records
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("written: surface-cup-1.compact, ", done.stdout)
        self.assertIn('"record stop"', done.stdout)
        self.assertEqual((place / "surface-cup-1/mesh.ply").read_bytes(), theirs)
        self.assertTrue((place / "surface-cup-1/report.html").exists())
        self.assertFalse((place / "surface-cup-1.compact").exists())
        done = measure()
        self.assertEqual(done.returncode, 3, done.stdout)
        self.assertIn("invalid answer", done.stderr)
        done = measure(program=VERGENCE)  # the client of the board makes no surface with a report
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("this program makes none", done.stdout)
        self.assertEqual(asked, ["measure cup fit=900 --quick", "measure cup", "measure cup plan",
                                 "measure cup", "measure cup", "measure cup"])

    def test_a_result_that_is_not_fetched_is_named(self):
        session = pathlib.Path(self.files) / "mug"
        shutil.copytree(os.path.join(os.environ["VERGENCE_SOURCE"], "tests/sessions/small"), session)
        self.addCleanup(shutil.rmtree, session)
        add_notes(session, "# measure fit=900", "# measure surface pair=1 scale=0.5")
        answer = "name: mug\nsession: mug\nresult: surface-mug-1\nsentence: good\nOK\n"
        running = []
        where, _ = self.stand_in([answer], lambda: running[0].send_signal(signal.SIGINT))
        here = pathlib.Path(self.path_of("stopped"))
        here.mkdir()
        running.append(subprocess.Popen([os.environ["VERGENCE"], "--connect", where, "measure", "mug"], text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=here))
        output, errors = running[0].communicate(timeout=TIMEOUT_S)
        self.assertEqual((running[0].returncode, output.count("OK")), (130, 0))
        self.assertIn('mug is complete on the instrument: "fetch mug", then "vergence measure mug"', errors)
        # No program takes what is here for a session before the rest is.
        self.assertFalse((here / "mug/session.index").exists())
        done = self.vergence("fetch", "mug", cwd=here)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(sorted(os.listdir(here / "mug")), sorted(os.listdir(session)))

    def test_a_connection_that_breaks(self):
        path = self.path_of("breaks.sock")
        first_output = (b"", b'{"result": {', b"what?\n", b"\xff\x00\n", b'{"ok": tr')
        for output_text in (*first_output, *(b"OK\n" + output_text for output_text in first_output)):
            for words in (["version"], ["--json", "version"], ["--json", "fetch", "x"]):
                with socket.socket(socket.AF_UNIX) as server:
                    server.bind(path)
                    server.listen()
                    process = subprocess.Popen(
                        [VERGENCE, "--connect", f"unix:{path}", *words], stdout=subprocess.PIPE,
                        stderr=subprocess.PIPE)
                    with server.accept()[0] as peer:
                        peer.recv(1)
                        peer.sendall(output_text)
                        peer.shutdown(socket.SHUT_WR)
                        output, reported = process.communicate(timeout=TIMEOUT_S)
                os.remove(path)
                self.assertEqual(process.returncode, 3, (output_text, words, output, reported))
                if "--json" in words:
                    self.assertEqual((json.loads(output)["ok"], reported), (False, b""))
                else:
                    self.assertEqual(reported.count(b"\n"), 1)

    def test_a_name_of_any_characters(self):
        names = ('q"x', "a\\b", 'two "words"', "c\\\"d", "#e")
        for name in names:
            with open(os.path.join(self.files, name), "wb") as file:
                file.write(name.encode())
            self.addCleanup(os.remove, os.path.join(self.files, name))
            target = self.path_of("fetched")
            done = self.vergence("fetch", name, target)
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(target, "rb") as file:
                self.assertEqual(file.read(), name.encode())
            os.remove(target)
            with open(self.path_of("sent"), "wb") as file:
                file.write(name.encode() * 2)
            self.assertEqual(self.vergence("send", self.path_of("sent"), name).returncode, 0)
            with open(os.path.join(self.files, name), "rb") as file:
                self.assertEqual(file.read(), name.encode() * 2)
        self.fetch_a_directory_of_any_name()
        done = self.vergence("fetch", 'x"' * 250, self.path_of("long"))
        self.assertEqual((done.returncode != 0, done.stderr.count("\n")), (True, 1), done.stderr)

    def fetch_a_directory_of_any_name(self):
        name = 'of "any\\name'
        os.mkdir(os.path.join(self.files, name))
        self.addCleanup(shutil.rmtree, os.path.join(self.files, name))
        # More than are listed at a time: the next list starts after the last name.
        files = [f'"{i}\\' for i in range(612)]
        for file in files:
            with open(os.path.join(self.files, name, file), "wb"):
                pass
        done = self.vergence("fetch", name, self.path_of("of any name"))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(sorted(os.listdir(self.path_of("of any name"))), sorted(files))

    def test_ctrl_c(self):
        process = self.begin("wait", "100000", text=True)
        self.wait_running()
        process.send_signal(2)
        _, errors = process.communicate(timeout=TIMEOUT_S)
        self.assertEqual((process.returncode, errors), (130, "ERR CANCELLED cancelled\n"))

    def test_fetch(self):
        there = self.path_of("got")
        done = self.vergence("fetch", "session/frame.bin", there)
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (0, f"written: {there}, 100000 bytes\nOK\n", ""))
        with open(there, "rb") as file:
            self.assertEqual(file.read(), self.content)
        done = self.vergence("fetch", "session/none.bin", there)
        self.assertEqual(done.returncode, 1)
        os.remove(there)
        done = self.vergence("--json", "fetch", "session/frame.bin", there)
        self.assertEqual((done.returncode, json.loads(done.stdout), done.stderr),
                         (0, {"result": {"file": there, "size": 100000},
                              "units": {"size": "bytes"}, "ok": True, "error": "OK", "code": 0,
                              "message": ""}, ""))
        with open(there, "rb") as file:
            self.assertEqual(file.read(), self.content)
        done = self.vergence("--json", "fetch", "session/none.bin", there)
        answer = json.loads(done.stdout)
        self.assertEqual((done.returncode, done.stderr), (1, ""))
        raw = self.client().ask_json("fetch session/none.bin")
        self.assertEqual(answer, raw)
        self.assertFalse(answer["ok"])
        os.remove(there)
        # A user's own file of that name stays.
        for own in (b"something else", self.content + b"longer"):
            with open(there + ".part", "wb") as file:
                file.write(own)
            done = self.vergence("fetch", "session/frame.bin", there)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
            self.assertIn("is not the beginning of session/frame.bin", done.stderr)
            with open(there + ".part", "rb") as file:
                self.assertEqual(file.read(), own)
        # What an earlier attempt left is used.
        with open(there + ".part", "wb") as file:
            file.write(self.content[:1000])
        self.assertEqual(self.vergence("fetch", "session/frame.bin", there).returncode, 0)
        with open(there, "rb") as file:
            self.assertEqual(file.read(), self.content)
        done = self.vergence("fetch", "session/frame.bin", "/no/such/folder/x")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))

    def test_fetch_replaces_nothing(self):
        there, other = self.path_of("mine"), self.path_of("same")
        for path, content in ((there, b"mine"), (other, self.content)):
            with open(path, "wb") as file:
                file.write(content)
            self.addCleanup(os.remove, path)
        done = self.vergence("fetch", "session/frame.bin", there)
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (1, "", f"vergence: {there}: exists with other contents (give another name: "
                          "fetch NAME FILE, or remove it)\n"))
        self.assertFalse(os.path.exists(there + ".part"))
        with open(there, "rb") as file:
            self.assertEqual(file.read(), b"mine")
        # The same file once more costs nothing.
        done = self.vergence("fetch", "session/frame.bin", other)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_fetch_writes_files_alone(self):
        pipe, folder, other = (self.path_of(name) for name in ("pipe", "folder", "other"))
        os.mkfifo(pipe)
        os.mkfifo(other + ".part")
        os.mkdir(folder)
        os.symlink(pipe, self.path_of("link"))
        for there, why in (
                (pipe, f"{pipe}: exists and is not a file (give another name)"),
                (self.path_of("link"), f"{self.path_of('link')}: exists and is not a file (give "
                 "another name)"),
                (folder, f"{folder}: exists and is not a file (it is a directory: give a name "
                 "in it)"),
                (other, f"{other}.part: exists and is not a file (remove it)")):
            done = self.vergence("fetch", "session/frame.bin", there)
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (1, "", f"vergence: {why}\n"))
        for path in (pipe, other + ".part"):
            self.assertTrue(stat.S_ISFIFO(os.lstat(path).st_mode))
        self.assertFalse(os.path.exists(pipe + ".part"))

    def test_a_full_disk_is_reported_and_the_partial_file_kept(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (60000, 60000))

        os.mkdir(self.path_of("full"))
        file, folder = self.path_of("full/frame.bin"), self.path_of("full/session")
        for name, there, part in (("session/frame.bin", file, file),
                                  ("session", folder, f"{folder}/frame.bin")):
            # The first attempt fails within a block, the others before their first byte.
            for words in ((), (), ("--json",)):
                done = self.vergence(*words, "fetch", name, there, preexec_fn=limit)
                why = f"{part}.part: File too large"
                self.assertEqual(done.returncode, 1, (words, done))
                if words:
                    answer = json.loads(done.stdout)
                    self.assertEqual((answer["ok"], answer["error"], answer["message"]),
                                     (False, "FULL", why))
                    self.assertEqual(done.stderr, "")
                else:
                    self.assertEqual((done.stdout, done.stderr), ("", f"vergence: {why}\n"))
                self.assertEqual(os.path.getsize(part + ".part"), 60000)
            done = self.vergence("fetch", name, there)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            with open(part, "rb") as whole:
                self.assertEqual(whole.read(), self.content)

    def test_fetch_a_directory(self):
        there, here = os.path.join(self.files, "c1"), self.path_of("c1")
        os.mkdir(there)
        # More than are listed at a time.
        content = {f"f{i:03}.bin": random.Random(i).randbytes(i) for i in range(612)}
        content["a b"] = b"blank"
        for name, data in content.items():
            with open(os.path.join(there, name), "wb") as file:
                file.write(data)
        total = sum(map(len, content.values()))

        def fetched(*words):
            done = self.vergence(*words, "fetch", "c1", cwd=self.folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(sorted(os.listdir(here)), sorted(content))
            for name, data in content.items():
                with open(os.path.join(here, name), "rb") as file:
                    self.assertEqual(file.read(), data, name)
            return done.stdout

        self.assertEqual(fetched(), f"written: c1, 613 files, {total} bytes\nOK\n")
        # Again, and after an interrupted attempt.
        os.remove(os.path.join(here, "f600.bin"))
        with open(os.path.join(here, "f600.bin.part"), "wb") as file:
            file.write(content["f600.bin"][:100])
        self.assertEqual(json.loads(fetched("--json"))["result"],
                         {"directory": "c1", "files": 613, "size": total})

        def refused(why, to="c1"):
            done = self.vergence("fetch", "c1", to, cwd=self.folder)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (1, "",
                                                                           f"vergence: {why}\n"))

        os.remove(os.path.join(here, "f000.bin"))
        with open(os.path.join(here, "f300.bin"), "ab") as file:
            file.write(b"x")
        refused("c1/f300.bin: exists with other contents (give another name than c1)")
        os.rename(os.path.join(here, "f300.bin"), os.path.join(here, "mine"))
        refused("c1/mine: exists and is not part of it (give another name than c1)")
        self.assertFalse(os.path.exists(os.path.join(here, "f000.bin")))
        with open(self.path_of("plain"), "w", encoding="ascii") as file:
            file.write("x")
        refused("plain: exists and is not a directory (give another name)", "plain")
        refused("no/such: No such file or directory", "no/such")
        os.mkdir(os.path.join(there, "deep"))
        refused("c1: contains the directory deep (fetch it, and files, by name)", "new")
        self.assertFalse(os.path.exists(self.path_of("new")))

    def test_a_user(self):
        terminal_user = TerminalUser.of(self)
        screen = terminal_user.screen
        terminal_user.type("vers\t\r")
        terminal_user.until(lambda: terminal_user.at_prompt() and "OK" in screen.lines)
        terminal_user.type("zoom 3\x01\x1b[C\x1b[C\x1b[C\x1b[C side=r\t")
        terminal_user.until(lambda: screen.lines[-1].rstrip() == "vergence> zoom side=right  3")
        terminal_user.type("\x03fetch sess\tfr\t")
        terminal_user.until(lambda: screen.lines[-1].rstrip() == "vergence> fetch session/frame.bin")
        terminal_user.type("\x03wait 100000\r")
        terminal_user.until(lambda: "waiting" in screen.lines[-1])
        terminal_user.type("\x03")
        terminal_user.until(lambda: terminal_user.line_count("ERR CANCELLED cancelled") and terminal_user.at_prompt())
        terminal_user.type("\x04")
        self.assertEqual(terminal_user.process.wait(TIMEOUT_S), 0)

    def test_history(self):
        """It survives the client, killed or not, and Ctrl-R finds a line in it."""
        first = TerminalUser.of(self)
        for line in ("wait 0 # one", "wait 0.1 # two", "wait 0 # three"):
            first.run(line)
        first.process.kill()
        first.process.wait()
        second = TerminalUser.of(self)
        second.type("\x12two")
        second.until(lambda: any("bck:two" in line or "wait 0.1 # two" in line
                                 for line in second.screen.lines))
        second.type("\r")
        second.until(lambda: second.line_count("OK") == 1 and second.at_prompt())
        second.type(4 * "\x1b[A")
        second.until(lambda: second.screen.lines[-1].rstrip() == "vergence> wait 0 # one")
        second.type("\x03\x04")
        self.assertEqual(second.process.wait(TIMEOUT_S), 0)
        path = os.path.join(self.folder, "vergence", "history")
        self.assertEqual(os.stat(path).st_mode & 0o777, 0o600)

    def through(self, lost, changed, seed=None):
        seed = seed or int(os.environ.get("VERGENCE_TEST_SEED", random.randrange(1 << 32)))
        print(f"VERGENCE_TEST_SEED={seed}")
        line = BadLine(self.console, seed, lost, changed)
        self.addCleanup(line.close)
        return line

    def test_a_serial_line(self):
        line = self.through(0, 0)
        done = self.vergence("version", where=f"serial:{line.name}")
        self.assertEqual((done.returncode, done.stdout.count("\n")), (0, 3), done.stderr)
        done = self.vergence("--json", "status", where=f"serial:{line.name}:921600")
        self.assertTrue(json.loads(done.stdout)["ok"])
        done = self.vergence("fetch", "session/frame.bin", self.path_of("serial"),
                             where=f"serial:{line.name}")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        with open(self.path_of("serial"), "rb") as file:
            self.assertEqual(file.read(), self.content)

    def test_a_greeting_answered_late_is_no_part_of_the_answer(self):
        """What was left of the line's last user answers for it, and its own answer comes behind the first request."""
        board, slave = pty.openpty()
        self.addCleanup(os.close, board)
        self.addCleanup(os.close, slave)
        tty.setraw(slave)
        body = '{"result": {}, "ok": true, "error": "OK", "code": 0, "message": ""'
        answers = {"@json": f'{body}, "crc": "{zlib.crc32(body.encode()):08X}"}}', "@": f"OK #{zlib.crc32(b'OK #'):08X}"}

        def serve(answer):
            heard = b""
            for ending, reply in ((b"@framed\r", "OK\r\n"), (b" pan 3\n", f"\rvergence> @framed\r\nOK\r\n{answer}\r\n"),
                                  (b"@terminal\r", "OK\r\n\rvergence> ")):
                while not heard.endswith(ending):
                    heard += os.read(board, 4096)
                os.write(board, reply.encode())
        for words, answer in (((), answers["@"]), (("--json",), answers["@json"])):
            thread = threading.Thread(target=serve, args=(answer,), daemon=True)
            thread.start()
            done = self.vergence(*words, "pan", "3", where=f"serial:{os.ttyname(slave)}")
            self.assertEqual((done.returncode, done.stdout), (0, f"{body}}}\n" if words else "OK\n"), done.stderr)
            thread.join(TIMEOUT_S)
            # It has waited for the last answer, so that the next user of the line finds it quiet.
            self.assertEqual(select.select([slave], [], [], 0)[0], [])

    @staticmethod
    def is_claimed(path):
        """Whether a process has locked it. Locking it to find out would refuse a client that begins."""
        about = os.stat(path)
        place = f" {os.major(about.st_dev):02x}:{os.minor(about.st_dev):02x}:{about.st_ino} "
        with open("/proc/locks", encoding="ascii") as locks:
            return any("FLOCK" in lock and place in lock for lock in locks)

    def test_a_serial_line_is_one_client_s(self):
        line = self.through(0, 0)
        first = self.begin("wait", "100000", where=f"serial:{line.name}")
        wait_until(lambda: self.is_claimed(line.name))
        for words in ((), ("--json",)):
            done = self.vergence(*words, "version", where=f"serial:{line.name}")
            self.assertEqual(done.returncode, 3, done)
            self.assertIn(f"{line.name}: in use by another program",
                          done.stdout + done.stderr)
            self.assertEqual((done.stdout + done.stderr).count("\n"), 1)
        first.send_signal(signal.SIGINT)
        first.wait(TIMEOUT_S)
        done = self.vergence("version", where=f"serial:{line.name}")
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_the_console_s_line_is_one_daemon_s(self):
        self.assertTrue(self.is_claimed(self.console.name))
        done = subprocess.run(
            [VERGENCED, "store=none", "files=none", f"socket={self.folder}/second.sock",
             f"console={self.console.name}"], stdin=subprocess.DEVNULL, capture_output=True,
            text=True, timeout=TIMEOUT_S, check=False)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn(f"console = {self.console.name}: in use by another program",
                      done.stderr)

    def test_a_serial_line_that_breaks(self):
        line = self.through(0, 0)
        there = self.path_of("broken")
        line.limit = line.carried + 60000
        begin = time.monotonic()
        done = self.vergence("fetch", "session/frame.bin", there, where=f"serial:{line.name}")
        self.assertLess(time.monotonic() - begin, 25)
        self.assertEqual((done.returncode, os.path.exists(there)), (3, False), done.stderr)
        had = os.path.getsize(there + ".part")
        self.assertGreater(had, 10000)
        line.limit, before = None, line.carried
        done = self.vergence("fetch", "session/frame.bin", there, where=f"serial:{line.name}")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess(line.carried - before, (len(self.content) - had) * 1.6 + 3000)
        with open(there, "rb") as file:
            self.assertEqual(file.read(), self.content)


if __name__ == "__main__":
    unittest.main()

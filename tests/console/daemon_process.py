# SPDX-License-Identifier: Apache-2.0
"""Shared by the console's tests: a simulated rig, a vergenced in front of it, its clients, and a
terminal that shows what a person would see."""
import json
import os
import pty
import select
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import tty
import unittest
import zlib

from waiting import TIMEOUT_S, wait_until

VERGENCED = os.environ["VERGENCED"]
VERGENCE = os.environ["VERGENCE_BOARD"]
SIMRIG = os.environ.get("SIMRIG", "")
# Independent of the user that runs the tests: the system's defaults, with the log on standard
# error.
os.environ["STATE_DIRECTORY"] = "/var/lib/vergence"


def small_stack(kib):
    """A launcher for programs whose stack may not grow, and whose C library creates threads with
    such stacks; a sanitizer's frames are several times as large."""
    with open(VERGENCED, "rb") as program:
        limit_kib = 8 * kib if b"__asan_init" in program.read() else kib
    return ("sh", "-c", f'ulimit -s {limit_kib}; exec "$@"', "sh")


class Screen:
    """The last line of a terminal that supports only characters, CR, LF, HT, BEL and BS."""

    def __init__(self):
        self.lines, self.column, self.bells = [""], 0, 0

    def feed(self, text):
        for character in text:
            if character == "\r":
                self.column = 0
            elif character == "\n":
                self.lines.append("")
            elif character == "\b":
                self.column = max(0, self.column - 1)
            elif character == "\a":
                self.bells += 1
            elif character == "\t":
                self.column = self.column // 8 * 8 + 8
            else:
                assert character >= " ", f"a control character: {character!r}"
                line = self.lines[-1].ljust(self.column)
                self.lines[-1] = line[:self.column] + character + line[self.column + 1:]
                self.column += 1


class Terminal:
    """A pseudo terminal with a person at it; not `raw`, as a PC program finds it."""

    def __init__(self, raw=True):
        self.master, slave = pty.openpty()
        if raw:
            tty.setraw(slave)
        self.slave, self.name = slave, os.ttyname(slave)
        self.screen, self.text = Screen(), ""

    def close(self):
        os.close(self.master)
        os.close(self.slave)

    def send(self, data):
        data = data.encode() if isinstance(data, str) else data
        while data:
            data = data[os.write(self.master, data):]

    def read(self, timeout_s):
        """Output received within the time; "" if none."""
        if not select.select([self.master], [], [], timeout_s)[0]:
            return ""
        text = os.read(self.master, 65536).decode(errors="replace")
        self.text += text
        self.screen.feed(text)
        return text

    def wait(self, condition):
        """Until condition(self) holds, or fails."""
        end = time.monotonic() + TIMEOUT_S
        while not condition(self):
            if time.monotonic() > end:
                raise AssertionError(f"never seen; the screen: {self.screen.lines[-8:]}")
            self.read(0.1)

    def wait_line(self, line):
        """Waits until the last line of the screen is this, with the cursor at its end or inside
        it."""
        self.wait(lambda t: t.screen.lines[-1].rstrip() == line.rstrip())

    def at_prompt(self):
        return self.screen.lines[-1].rstrip() == "vergence>"

    def wait_prompt(self):
        self.wait(Terminal.at_prompt)

    def run(self, line):
        """Types a line; returns what is shown up to the next prompt."""
        begin = len(self.screen.lines)
        self.send(line + "\r")
        self.wait(lambda t: len(t.screen.lines) > begin and t.at_prompt())
        return [shown.rstrip() for shown in self.screen.lines[begin:-1]]


class Client:
    """A program at the daemon's socket."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(TIMEOUT_S)
        self.socket.connect(path)
        self.left = b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, text):
        self.socket.sendall(text.encode() if isinstance(text, str) else text)

    def line(self):
        """The next line; None at the end."""
        while b"\n" not in self.left:
            data = self.socket.recv(65536)
            if not data:
                return None
            self.left += data
        line, self.left = self.left.split(b"\n", 1)
        return line.decode(errors="replace")

    def take(self, wanted):
        """Exactly so many bytes."""
        while len(self.left) < wanted:
            block = self.socket.recv(1 << 20)
            if not block:
                raise AssertionError(f"the end after {len(self.left)} of {wanted} bytes")
            self.left += block
        data, self.left = self.left[:wanted], self.left[wanted:]
        return data

    def ask(self, command):
        """The lines of the answer, the last is OK or ERR."""
        self.send(command + "\n")
        return self.answer()

    def answer(self):
        lines = []
        while not lines or not (lines[-1] == "OK" or lines[-1].startswith("ERR ")):
            line = self.line()
            if line is None:
                raise AssertionError(f"the end instead of an answer: {lines}")
            lines.append(line)
        return lines

    def begin(self, command):
        """Sends it; returns its first report: it runs, or waits for another client's command."""
        self.send(f"@progress {command}\n")
        line = self.line()
        if line is None or not line.startswith("... "):
            raise AssertionError(f"no report: {line}")
        return line

    def begun_answer(self):
        """The answer to begin(), without further reports."""
        return [line for line in self.answer() if not line.startswith("... ")]

    def ask_json(self, command, prefix="json"):
        self.send(f"@{prefix} {command}\n")
        return json.loads(self.line())


def replaced(words, *settings):
    """The command line with these settings replacing those of the same keys, as no key may be given
    twice."""
    keys = {setting.split("=")[0] for setting in settings}
    return [*(word for word in words if word.split("=")[0] not in keys), *settings]


class DaemonTest(unittest.TestCase):
    """One daemon per class, with a simulated rig behind it."""
    settings = ()
    scene = "plane"
    has_socket = True
    error_file = None
    environment = {}
    launcher = ()  # arguments before the daemon's

    @classmethod
    def setUpClass(cls):
        if not SIMRIG:
            raise unittest.SkipTest("the simulated rig needs -DVERGENCE_FPGA=ON")
        cls.folder = tempfile.mkdtemp(prefix="console")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.rig_path = os.path.join(cls.folder, "rig.sock")
        cls.begin_rig()
        cls.path = os.path.join(cls.folder, "v.sock")
        cls.files = os.path.join(cls.folder, "files")
        cls.daemon = None
        cls.start()

    @classmethod
    def begin_rig(cls, *words):
        cls.rig = subprocess.Popen(
            [SIMRIG, "--scene", cls.scene, "--listen", f"unix:{cls.rig_path}", *words],
            stdout=subprocess.PIPE)
        cls.addClassCleanup(cls.rig.stdout.close)
        cls.addClassCleanup(cls.end, cls.rig)
        # It listens earlier, and answers from then on.
        assert b"listening on" in cls.rig.stdout.readline()

    @classmethod
    def start(cls):
        cls.log = open(os.path.join(cls.folder, "stderr"), "ab")
        cls.addClassCleanup(cls.log.close)
        arguments = cls.arguments()
        # The leak check needs another process, which a confined daemon may not create.
        leaks = {} if "confine=no" in arguments else {"ASAN_OPTIONS": "detect_leaks=0"}
        cls.daemon = subprocess.Popen([*cls.launcher, VERGENCED, *arguments],
                                      stdin=subprocess.DEVNULL, stderr=cls.log,
                                      env={**os.environ, **leaks, **cls.environment})
        cls.addClassCleanup(cls.end, cls.daemon)
        cls.wait_for(cls.path)

    @classmethod
    def arguments(cls):
        return [f"backend=sim unix:{cls.rig_path}", f"socket={cls.path}", f"files={cls.files}",
                f"store={os.path.join(cls.folder, 'store')}", *cls.settings]

    @staticmethod
    def wait_for(path):
        wait_until(lambda: os.path.exists(path), f"{path} does not come")

    @staticmethod
    def end(process):
        """Ends it orderly; a crash fails the test."""
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(TIMEOUT_S)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
        assert process.returncode in (0, -signal.SIGTERM, 143), f"ended with {process.returncode}"

    @classmethod
    def output_text(cls):
        """The daemon's output on standard error."""
        with open(os.path.join(cls.folder, "stderr"), encoding="utf-8") as file:
            return file.read()

    def tearDown(self):
        self.assertIsNone(self.daemon.poll(), "the daemon has gone")

    def client(self):
        client = Client(self.path)
        self.addCleanup(client.socket.close)
        return client

    def wait_running(self, command="wait", ahead=1):
        """Waits until this command runs and a further one would be the `ahead`-th behind it. Needs
        a free slot for a client."""
        def reached():
            with Client(self.path) as probe:
                try:
                    probe.send("@progress status\n")
                    line = probe.line()
                    if line is not None and line.startswith("... "):
                        probe.send("\x03")
                        probe.begun_answer()  # its place is free before another client looks
                except OSError:  # rejected before it sent a line
                    return False
                return line == f"... waiting for another client's {command} 0/{ahead}"
        wait_until(reached, f"{command} does not run")

    def begin(self, *words, where=None, **options):
        """Starts the shipped client; it is killed at the end of the test."""
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
        process = subprocess.Popen([VERGENCE, "--connect", where or f"unix:{self.path}", *words],
                                   **pipes)
        for end in (process.stderr, process.stdout):
            if end:
                self.addCleanup(end.close)
        self.addCleanup(process.kill)
        return process

    @classmethod
    def vergence(cls, *words, where=None, program=VERGENCE, **options):
        """The shipped client."""
        return subprocess.run(
            [program, "--connect", where or f"unix:{cls.path}", *words], capture_output=True,
            text=True, timeout=2 * TIMEOUT_S, **options)


class ConsoleTest(DaemonTest):
    """One daemon per class that serves a terminal too."""

    @classmethod
    def setUpClass(cls):
        cls.console = Terminal()
        cls.addClassCleanup(cls.console.close)
        cls.settings = (f"console={cls.console.name}",)
        super().setUpClass()
        cls.console.wait_prompt()


def framed(command, words="json"):
    """A request with its CRC."""
    return f"@{words},crc={zlib.crc32(f'@{words},{command}'.encode()):08X} {command}\n"

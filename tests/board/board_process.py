# SPDX-License-Identifier: Apache-2.0
"""Shared by the board's tests: tools/board as a person runs it, at a terminal, and a shell on the board.
A test that fails shows all that the serial line said."""
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import tty
import unittest
import zlib

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
BOARD = ROOT / "tools/board"
# The build with simrig and vergence, and the folder of the image; "": tools/board makes them.
PROGRAMS = os.environ.get("VERGENCE_PROGRAMS", "")
IMAGE = os.environ.get("VERGENCE_IMAGE", "")
VERGENCE = os.environ.get("VERGENCE", "vergence")
# Limits for a machine that does much else; the figures are in firmware/system/README.md.
BOOT_LIMIT_S, COMMAND_LIMIT_S, END_LIMIT_S = 600, 900, 60
ANSWER_LIMIT_S = 15  # of the console, whatever became of the daemon
# Ways to end or to stop what runs on the board. The last one leaves the system's watchdog alone.
KILL, STOP = "kill -9 $(pidof vergenced)", "kill -STOP $(pidof vergenced)"
WATCHDOG_LIMIT_S = 60
STOP_ALL = "kill -STOP $(pidof supervise) $(pidof vergenced)"
# Both cameras look at the cylinder.
SCENE = ("--scene", "cylinder", "--seed", "3")
AIM = ("bringup", "pan 3.57 right=-3.272", "iris 800", "exposure 9000")
DEPTH = ("near=1600", "far=2300")
SURFACE = ("mesh.ply", "points.pcd", "disparity.pfm")
# The board's programs and the PC's may be of different commits while one works on them.
BUILD_ID = re.compile(rb"^(comment|#) vergence [^\n]*\n", re.M)
PROMPT = r"(?:\r?vergence> )+"  # the editor may show it twice


def board_command(*words, image_folder=None):
    given = ["--image", str(image_folder or IMAGE)] if image_folder or IMAGE else []
    given += ["--programs", PROGRAMS] if PROGRAMS and "--rig" not in words else []
    return [str(BOARD), *given, *words]


class Board:
    """tools/board at a pseudo terminal, with DIR `folder`."""

    def __init__(self, folder, *words, image_folder=None):
        self.folder = pathlib.Path(folder)
        self.master, slave = pty.openpty()
        self.text, self.seen = "", 0
        self.final = ""  # all that it said, once it is closed
        self.errors = open(self.folder / "errors", "w+b")
        tty.setraw(slave)
        self.process = subprocess.Popen(
            board_command("--dir", str(folder), *words, image_folder=image_folder), stdin=slave,
            stdout=slave, stderr=self.errors, start_new_session=True)
        os.close(slave)

    def console(self):
        """All that the serial line said, and the tool."""
        log = self.folder / "console.log"
        said = log.read_text(encoding="utf-8", errors="replace") if log.exists() else ""
        return f"---- the serial line\n{said}\n---- the terminal\n{self.text}\n{self.report()}"

    def read(self, timeout_s):
        """False at the end."""
        if not select.select([self.master], [], [], timeout_s)[0]:
            return True
        try:
            data = os.read(self.master, 1 << 16)
        except OSError:
            return False
        self.text += data.decode(errors="replace")
        return data != b""

    def wait(self, pattern, limit_s):
        """What is shown up to this regular expression, from where the last wait ended."""
        end = time.monotonic() + limit_s
        while not (found := re.search(pattern, self.text[self.seen:], re.M | re.S)):
            if time.monotonic() > end:
                raise AssertionError(f"not within {limit_s} s: {pattern}")
            if not self.read(0.2):
                raise AssertionError(f"the board ended before: {pattern}")
        text = self.text[self.seen:self.seen + found.end()]
        self.seen += found.end()
        return text

    def wait_prompt(self, limit_s=BOOT_LIMIT_S):
        return self.wait(f"^{PROMPT}$", limit_s)

    def send(self, keys):
        os.write(self.master, keys.encode())

    def type(self, line, limit_s=COMMAND_LIMIT_S):
        """The answer to a line that is typed at the prompt."""
        self.send(line + "\r")
        text = self.wait(rf"[\r\n](?:OK|ERR [^\r\n]*)[\r\n]+{PROMPT}$", limit_s).replace("\r", "")
        return text.split("\n", 1)[1].rsplit("\n", 1)[0].strip()

    def shell(self, command, limit_s=COMMAND_LIMIT_S):
        """What a command prints in the root shell of the bench's second console."""
        with socket.socket(socket.AF_UNIX) as line:
            line.settimeout(limit_s)
            line.connect(str(self.folder / "shell.sock"))
            # The marks are put together by the shell, so that its echo is not taken for them.
            line.sendall(f"echo be''gin; {command}; echo en''d\n".encode())
            text = ""
            while not (found := re.search(r"^begin\r?\n(.*?)^end\r?$", text, re.M | re.S)):
                data = line.recv(1 << 16)
                if not data:
                    raise AssertionError(f"the shell ended: {text}")
                text += data.decode(errors="replace")
        return found[1].replace("\r", "").strip()

    def restart(self):
        """Resets the board; the shell's line stays open till it has, however busy the machine is."""
        with socket.socket(socket.AF_UNIX) as line:
            line.connect(str(self.folder / "shell.sock"))
            line.sendall(b"reboot -f\n")
            self.wait("^U-Boot 20", COMMAND_LIMIT_S)

    def report(self):
        """What the tool wrote on standard error."""
        return (self.folder / "errors").read_text(encoding="utf-8", errors="replace")

    def wait_end(self, limit_s=END_LIMIT_S):
        """Exit code."""
        end = time.monotonic() + limit_s
        while self.process.poll() is None:
            if time.monotonic() > end:
                raise AssertionError(f"does not end within {limit_s} s")
            self.read(0.1)
        while self.read(0):
            if not select.select([self.master], [], [], 0)[0]:
                break
        return self.process.returncode

    def close(self):
        """Ends it, and keeps what it said."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(END_LIMIT_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        while select.select([self.master], [], [], 0)[0] and self.read(0):
            pass
        self.final = self.console()
        self.errors.close()
        os.close(self.master)


def processor_s(number):
    """Processor time that a process has used, s."""
    fields = pathlib.Path(f"/proc/{number}/stat").read_text(encoding="utf-8").rsplit(") ", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def child_of(process, name):
    """The process number of a child with this program."""
    for entry in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            number, rest = entry.read_text(encoding="utf-8", errors="replace").split(" (", 1)
        except OSError:
            continue  # it has just ended
        program, rest = rest.rsplit(") ", 1)
        if program == name and int(rest.split()[1]) == process.pid:
            return int(number)
    raise AssertionError(f"no child {name}")


class BoardTest(unittest.TestCase):
    """`board` of a test, or of its class, is closed after it and shown when the test fails."""

    board = None

    def run(self, result=None):
        before = len(result.failures) + len(result.errors) if result else 0
        super().run(result)
        if result and len(result.failures) + len(result.errors) > before and self.board:
            text = self.board.final or self.board.console()
            sys.stderr.write(f"\n{self.id()} failed.\n{text}\n")

    @classmethod
    def new_folder(cls):
        folder = tempfile.mkdtemp(prefix="board-test-")
        cls.addClassCleanup(shutil.rmtree, folder)
        return pathlib.Path(folder)

    def servos_are_driven(self, rig):
        """Left and right: whether there are pulses at the pins of the simulated rig's bridge."""
        done = subprocess.run([ROOT / "tools/simrig/control", f"unix:{rig}", "status"],
                              capture_output=True, text=True, check=True)
        return [word == "true" for word in re.findall(r"pan_driven: (\w+)", done.stdout)]

    def assert_answers_again(self, begin_s):
        """The console, within its time since then."""
        self.board.wait_prompt(60)
        self.assertRegex(self.board.type("status"), r"OK$")
        needed_s = time.monotonic() - begin_s
        print(f"{self.id()}: the console answers after {needed_s:.1f} s")
        self.assertLess(needed_s, ANSWER_LIMIT_S)

    def assert_board_starts_again(self):
        """By the system's watchdog."""
        self.board.wait("^U-Boot 20", WATCHDOG_LIMIT_S)
        begin_s = time.monotonic()
        self.board.wait_prompt()
        self.assertRegex(self.board.type("status"), r"OK$")
        print(f"{self.id()}: the console answers {time.monotonic() - begin_s:.1f} s after the reset")

    @classmethod
    def begin(cls, *words, **options):
        """A board for the whole class."""
        cls.board = Board(cls.new_folder(), *words, **options)

    def start(self, *words, **options):
        self.board = Board(self.new_folder(), *words, **options)
        self.addCleanup(self.board.close)
        return self.board


class SurfaceTest(BoardTest):
    """With vergence(*words): the PC's client."""

    def on_host(self, *words):
        done = subprocess.run([str(word) for word in words], cwd=self.board.folder, text=True,
                              capture_output=True, timeout=COMMAND_LIMIT_S, check=False)
        self.assertEqual(done.returncode, 0, f"{words}: {done.stdout}{done.stderr}")
        return done.stdout

    def take_pair(self, name, window):
        """And sends the calibration, which a simulated rig knows. A small window keeps it quick."""
        for line in (*AIM, f"window {window}", f"capture {name}"):
            self.vergence(*line.split())
        self.on_host(ROOT / "tools/simrig/control", f"unix:{self.board.folder}/rig.sock",
                     "truth left left", "truth right right")
        (self.board.folder / "rig.calibration").unlink(missing_ok=True)  # of an earlier test
        self.on_host(VERGENCE, "info", ".", "--convert", "rig.calibration")
        self.vergence("send", "rig.calibration")

    def assert_surface_is_the_pc_s(self, window):
        """To the byte."""
        folder = self.board.folder
        self.take_pair("first", window)
        self.vergence("calibration", "set", "rig.calibration")
        self.vergence("capture", "scene")  # with the calibration
        self.vergence("reconstruct", "scene", *DEPTH)
        self.vergence("fetch", "scene")  # the surface was, in its compact form
        near, far = (word.split("=")[1] for word in DEPTH)
        self.on_host(VERGENCE, "reconstruct", "scene", "--near", near, "--far", far, "--out", "surface")
        for name in SURFACE:
            on_board, on_host = (BUILD_ID.sub(b"", (folder / where / name).read_bytes())
                                 for where in ("surface-scene-1", "surface"))
            self.assertEqual(zlib.crc32(on_board), zlib.crc32(on_host), name)
        columns, rows = map(int, window.split())
        self.assertGreater((folder / "surface" / "mesh.ply").stat().st_size, 2 * columns * rows)

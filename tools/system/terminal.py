# SPDX-License-Identifier: Apache-2.0
"""The person's end of the serial line."""
import contextlib
import os
import pty
import re
import select
import termios
import time
import tty

from machine import REFUSED
from problem import Problem

LEAVE = b"\x1d"  # Ctrl-]
# The editor may show the prompt more than once.
FIRST_PROMPT = re.compile(rb"(vergence> )$")
ANSWER = re.compile(rb"[\r\n](OK|ERR)(?: [^\r\n]*)?[\r\n]+(?:\r?vergence> )+$")
BOOT_LIMIT_S = 120
BLOCK_BYTES = 1 << 16
RECENT_BYTES = 1 << 14
TOKEN = re.compile(rb"^token: ([0-9a-f]{64})\r?\n", re.M)
# What U-Boot prints when it refuses something.
U_BOOT_ERROR = re.compile(rb"[^\r\n]*(?:bad |error|failed|could not|not found|exceeded|wrong|invalid)[^\r\n]*", re.I)


class Line:
    """The serial line. All that arrives is written to a log, and shown. `check()` raises Problem when what
    is behind the board has ended, and `check_end()` when the board did not switch itself off."""

    def __init__(self, socket, folder, shown, check, check_end):
        self.socket, self.folder, self.shown = socket, folder, shown
        self.check, self.check_end = check, check_end
        self.log = open(folder / "console.log", "wb", buffering=0)
        self.recent = self.unshown = b""

    def fileno(self):
        return self.socket.fileno()

    def wait(self, *others):
        """Waits for the line or one of the others; returns those that can be read, after a second none."""
        ready = select.select([self, *others], [], [], 1)[0]
        self.check()
        return ready

    def send(self, data):
        try:
            self.socket.sendall(data)
        except OSError:
            pass  # switched off: read() reports it

    def read(self):
        """What has arrived; b"" when the board is off."""
        try:
            data = self.socket.recv(BLOCK_BYTES)
        except OSError:
            data = b""
        self.log.write(data)
        if self.shown:
            self.show(data)
        self.recent = (self.recent + data)[-RECENT_BYTES:]
        if REFUSED in self.recent:
            raise Problem(f"U-Boot started no system: {reason(self.recent)}")
        if not data:
            self.check_end()
        if token := TOKEN.search(self.recent):
            save_token(self.folder / "token", token[1])
            self.recent = self.recent[token.end():]
        return data

    def show(self, data):
        """Unchanged on a terminal, else whole lines, without what a carriage return overwrites there:
        the prompt before a typed line, progress."""
        if not os.isatty(1):
            *lines, self.unshown = (self.unshown + data).split(b"\n")
            data = b"".join(line.rstrip(b"\r").rsplit(b"\r", 1)[-1] + b"\n" for line in lines)
        os.write(1, data)


def save_token(path, token):
    """The answer to the command "token": clients over TCP present it."""
    path.unlink(missing_ok=True)
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(token + b"\n")


def reason(text):
    """The last line of U-Boot that says why; it is followed by one that says only that."""
    lines = [line.decode(errors="replace").strip() for line in U_BOOT_ERROR.findall(text)]
    lines = [line for line in lines if "can't get kernel image" not in line]
    return lines[-1] if lines else "see above"


class Typist:
    """Types lines, the first at the prompt and each other one when the last is answered."""

    def __init__(self, line, lines):
        self.line, self.lines = line, list(lines)
        self.shown = b""
        self.failed = False
        self.awaited = FIRST_PROMPT
        self.ready = False  # at a prompt, with nothing unanswered

    def heard(self, data):
        self.shown = (self.shown + data)[-RECENT_BYTES:]
        if found := self.awaited.search(self.shown):
            self.ready = True
            self.failed = self.failed or found[1] == b"ERR"
            self.type_next()

    def add(self, line):
        self.lines.append(line)
        self.type_next()

    def type_next(self):
        if self.ready and self.lines:
            self.ready, self.shown, self.awaited = False, b"", ANSWER
            self.line.send(self.lines.pop(0).encode() + b"\r")

    def done(self):
        return self.ready and not self.lines


@contextlib.contextmanager
def raw_terminal(fd):
    """Each key at once and unchanged, as it is at a serial line."""
    before = termios.tcgetattr(fd)
    tty.setraw(fd)
    try:
        yield
    finally:
        termios.tcsetattr(fd, termios.TCSADRAIN, before)


def attend(line, lines, say):
    """Types the lines, shows the line, and passes on what the user types, until they leave or the
    board is off; exit code. The standard input may also be a script."""
    if not os.isatty(0):
        return attend_script(line, lines)
    say("Ctrl-] leaves")
    with raw_terminal(0):
        left = attend_person(line, lines)
    say("left; the board is off" if left else "the board is off")
    return 0


def attend_person(line, lines):
    typist = Typist(line, lines)
    while True:
        ready = line.wait(0)
        if 0 in ready:
            keys = os.read(0, BLOCK_BYTES)
            before, leave, _ = keys.partition(LEAVE)
            line.send(before)
            if leave or not keys:
                return True
        if line in ready:
            data = line.read()
            if not data:
                return False
            typist.heard(data)


def await_prompt(line):
    end = time.monotonic() + BOOT_LIMIT_S
    while not FIRST_PROMPT.search(line.recent):
        if line in line.wait() and not line.read():
            raise Problem("the board switched itself off")
        if time.monotonic() > end:
            raise Problem(f"no prompt within {BOOT_LIMIT_S} s")


def attend_script(line, lines):
    """Types the lines, then those of the standard input."""
    typist = Typist(line, lines)
    await_prompt(line)
    typist.heard(line.recent)
    left, more = b"", True
    while more or not typist.done():
        ready = line.wait(*([0] if more else []))
        if 0 in ready:
            data = os.read(0, BLOCK_BYTES)
            more = data != b""
            *whole, left = (left + data).split(b"\n") if more else (left, b"")
            for text in (part.decode(errors="replace").strip() for part in whole):
                if text and not text.startswith("#"):  # these have no answer
                    typist.add(text)
        if line in ready:
            data = line.read()
            if not data:
                raise Problem("the board switched itself off")
            typist.heard(data)
    if os.isatty(1):
        print()  # after the prompt
    return 1 if typist.failed else 0


def is_our_link(path):
    """Whether it is what `serve` makes: a link to a pseudo terminal."""
    return path.is_symlink() and os.readlink(path).startswith("/dev/pts/")


def serve(line, path, say):
    """Offers the line as a pseudo terminal, until the board is off or the user ends it."""
    master, slave = pty.openpty()
    tty.setraw(slave)  # it stays open, so that a client may come and leave
    if is_our_link(path):
        path.unlink()
    try:
        path.symlink_to(os.ttyname(slave))
    except OSError as error:
        raise Problem(f"--serial {path}: {error.strerror.lower()}") from error
    say(f"serial line: vergence --connect serial:{path} (Ctrl-C ends the board)")
    try:
        while True:
            ready = line.wait(master)
            if master in ready:
                line.send(os.read(master, BLOCK_BYTES))
            if line in ready:
                data = line.read()
                if not data:
                    say("the board is off")
                    return 0
                # As on a wire: what no program reads is lost.
                if select.select([], [master], [], 0)[1]:
                    os.write(master, data)
    finally:
        if is_our_link(path):
            path.unlink()

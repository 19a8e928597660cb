# SPDX-License-Identifier: Apache-2.0
"""Somebody at a PC's terminal."""
import fcntl
import os
import pty
import select
import struct
import subprocess
import termios
import time

from daemon_process import PATIENCE_S, VERGENCE, Screen


class Person:
    """Somebody at a terminal, with the client in it."""

    def __init__(self, path):
        self.master, slave = pty.openpty()
        self.process = subprocess.Popen([VERGENCE, "--connect", f"unix:{path}"], stdin=slave,
                                        stdout=slave, stderr=slave,
                                        env={**os.environ, "TERM": "dumb"})
        os.close(slave)
        self.screen = Screen()
        self.until(self.at_prompt)

    @classmethod
    def of(cls, test):
        """One at the daemon of a DaemonTest, who goes when the test ends."""
        person = cls(test.path)
        test.addCleanup(person.close)
        return person

    def set_columns(self, columns):
        """Changes the width of the window, which nobody knows at first."""
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))

    def at_prompt(self):
        return self.screen.lines[-1].rstrip() == "vergence>"

    def type(self, text):
        data = text.encode()
        while data:
            data = data[os.write(self.master, data[:512]):]
            self.look(0)

    def look(self, timeout_s):
        while select.select([self.master], [], [], timeout_s)[0]:
            timeout_s = 0
            try:
                self.screen.feed(os.read(self.master, 65536).decode())
            except OSError:
                return

    def until(self, condition):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            if time.monotonic() > end:
                raise AssertionError(self.screen.lines[-8:])
            self.look(0.1)

    def said(self, line):
        """How often; a bar that stood there was wiped with blanks."""
        return sum(said.rstrip() == line for said in self.screen.lines)

    def close(self):
        self.process.kill()
        self.process.wait()
        os.close(self.master)

# SPDX-License-Identifier: Apache-2.0
"""A person at a PC's terminal."""
import fcntl
import os
import subprocess
import termios

from daemon_process import VERGENCE, Terminal


class TerminalUser(Terminal):
    """A person at a terminal that runs the client."""

    def __init__(self, path):
        super().__init__(raw=False)
        # Its controlling terminal, so that Ctrl-C is a signal; the history is beside the socket.
        self.process = subprocess.Popen(
            [VERGENCE, "--connect", f"unix:{path}"], stdin=self.slave, stdout=self.slave,
            stderr=self.slave, start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
            env={**os.environ, "TERM": "dumb", "XDG_STATE_HOME": os.path.dirname(path),
                 # libedit does not free the names of functions that were added to it.
                 "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0"})
        self.wait_prompt()

    @classmethod
    def of(cls, test):
        """A person at a DaemonTest's daemon, closed when the test ends."""
        terminal_user = cls(test.path)
        test.addCleanup(terminal_user.close)
        return terminal_user

    def type(self, text):
        """Pastes a text, which may be more than the terminal buffers before it is read."""
        data = text.encode()
        while data:
            data = data[os.write(self.master, data[:512]):]
            self.look(0)

    def look(self, timeout_s):
        """Reads everything available."""
        while self.read(timeout_s):
            timeout_s = 0

    def until(self, condition):
        self.wait(lambda _: condition())

    def line_count(self, line):
        """Counts a line; an erased progress bar leaves blanks."""
        return sum(output_text.rstrip() == line for output_text in self.screen.lines)

    def lines_with(self, text):
        return [line for line in self.screen.lines if text in line]

    def close(self):
        self.process.kill()
        self.process.wait()
        super().close()

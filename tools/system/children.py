# SPDX-License-Identifier: Apache-2.0
"""The processes that belong to a board. They end with it, also if it is killed."""
import ctypes
import signal
import subprocess
import time

from problem import Problem

START_LIMIT_S = END_LIMIT_S = 60
PR_SET_PDEATHSIG = 1
LIBC = ctypes.CDLL(None, use_errno=True)


def end_with_parent():
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def reason(process, log):
    """The last line that a program wrote before it ended."""
    text = log.read_text(encoding="utf-8", errors="replace").strip()
    code = process.returncode
    # What a program writes while all is well says nothing about a signal.
    if code < 0:
        return f"killed by signal {-code}"
    return text.splitlines()[-1] if text else f"exit code {code}"


class Children:
    def __init__(self):
        self.started = []
        self.needed = []  # (process, log, what it is) of those without which the board is of no use

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process, _ in reversed(self.started):
            if process.poll() is None:
                process.terminate()
        for process, _ in reversed(self.started):
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def start(self, command, log):
        """Starts a program whose output goes to the file `log`, without a terminal."""
        with open(log, "wb") as file:
            process = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL,
                                       stdout=file, stderr=file, preexec_fn=end_with_parent,
                                       start_new_session=True)
        self.started.append((process, log))
        return process

    def need_last(self, what):
        """check() refuses to go on without the program that was started last."""
        self.needed.append((*self.started[-1], what))

    def check(self):
        for process, log, what in self.needed:
            if process.poll() is not None:
                raise Problem(f"{what} ended: {reason(process, log)}")

    def ended_well(self, process, what):
        """Raises Problem unless this program, which ends now, ends orderly."""
        log, = (log for started, log in self.started if started is process)
        try:
            process.wait(END_LIMIT_S)
        except subprocess.TimeoutExpired:
            raise Problem(f"{what} closed the line and goes on (log: {log})") from None
        if process.returncode != 0:
            raise Problem(f"{what} ended: {reason(process, log)}")

    def wait(self, ready, what):
        """Waits until ready() holds for the program that was started last."""
        process, log = self.started[-1]
        end = time.monotonic() + START_LIMIT_S
        while not ready():
            if process.poll() is not None:
                raise Problem(f"{what} ended: {reason(process, log)}")
            if time.monotonic() > end:
                raise Problem(f"{what} is not ready after {START_LIMIT_S} s (log: {log})")
            time.sleep(0.02)

# SPDX-License-Identifier: Apache-2.0
"""The simulated rig and the daemon in front of it, as demo, figures and experiments start them."""
import json
import os
import pathlib
import re
import subprocess
import threading
import time

TOOLS = pathlib.Path(__file__).resolve().parents[1]
TIMEOUT_S = 4 * 3600  # for what hangs: a busy machine takes long for a simulated rig
# The lenses at the start: turned by hand, nearly closed and out of focus.
TURNED_BY_HAND = tuple(f"ring {side} {axis} {position}" for side, axis, position in
                       (("left", "iris", 420), ("right", "iris", 440), ("left", "focus", 760),
                        ("right", "focus", 380)))


# All that was started and has not ended; interrupted: nothing more is started.
running, interrupted = set(), threading.Event()


class Failed(Exception):
    """A step failed; the text says why."""


def spawn(command, **options):
    if interrupted.is_set():
        raise Failed("interrupted")
    program = subprocess.Popen([str(word) for word in command], **options)
    running.add(program)
    return program


def interrupt():
    """Ends all programs, so that the threads that wait for them fail and end as well."""
    interrupted.set()
    for program in tuple(running):
        program.terminate()


def run(command, **options):
    """The standard output of a program."""
    program = spawn(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
    try:
        output, errors = program.communicate(timeout=TIMEOUT_S)
    except BaseException:
        stop(program)
        raise
    running.discard(program)
    if program.returncode != 0:
        raise Failed(f"{' '.join(map(str, command))}: {output}{errors}".strip())
    return output


def start(command, log, ready):
    """Starts a program in the background and waits for the file `ready`."""
    with open(log, "w", encoding="utf-8") as file:
        program = spawn(command, stdout=file, stderr=file)
    while not ready.exists() and program.poll() is None:
        time.sleep(0.05)
    if program.poll() is not None:
        raise Failed(f"{command[0]}: {log.read_text(encoding='utf-8').strip() or 'does not answer'}")
    return program


def stop(program):
    program.terminate()
    try:
        program.wait(60)
    except subprocess.TimeoutExpired:
        program.kill()
        program.wait()
    running.discard(program)


class Instrument:
    """A cold rig with its daemon, which serves the calibration; both end with the block. What the rig
    and the daemon write comes into the folder `work`: files/ has the sessions."""

    def __init__(self, programs, work, scene, seed=1, calibration=None, threads=None):
        self.vergence, self.vergenced = programs
        self.work, self.files = work, work / "files"
        self.rig, self.daemon = f"unix:{work}/rig.sock", f"unix:{work}/vergenced.sock"
        self.scene, self.seed, self.calibration = scene, seed, calibration
        self.threads = threads or os.cpu_count() or 1
        self.started = []

    def __enter__(self):
        self.files.mkdir(parents=True)
        try:
            self.started.append(start(
                [self.vergence, "simulate", self.scene, "--listen", self.rig, "--files", self.work, "--seed",
                 self.seed, "--threads", self.threads], self.work / "rig.log", self.work / "rig.sock"))
            self.control(*TURNED_BY_HAND)
            self.started.append(start(
                [self.vergenced, f"backend=sim {self.rig}", f"socket={self.work}/vergenced.sock",
                 f"files={self.files}", f"store={self.work}/store", "log=none"],
                self.work / "vergenced.log", self.work / "vergenced.sock"))
            if self.calibration:
                (self.files / "instrument.zoom").write_bytes(pathlib.Path(self.calibration).read_bytes())
                self.command("calibration set instrument.zoom")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for program in reversed(self.started):
            stop(program)

    def command(self, line, **options):
        """What the console replies to a command."""
        return run([self.vergence, "--connect", self.daemon, *line.split()], **options)

    def figures(self, line, **options):
        """The same as a table."""
        reply = run([self.vergence, "--connect", self.daemon, "--json", *line.split()], **options)
        return json.loads(reply.splitlines()[-1])["result"]

    def measure(self, name, words, folder):
        """One measurement as a user makes it: the reply as a table. The session comes into folder/NAME, the
        surface with its report into folder/NAME-surface."""
        return self.figures(f"measure {name} {words}", cwd=folder)

    def control(self, *commands):
        """To the simulated world."""
        return run([TOOLS / "simrig/control", self.rig, *commands])

    def truth(self, session, number, folder):
        """The world's truth about a pair of a session, as simrig-compare reads it."""
        index = (session / "session.index").read_text(encoding="utf-8")
        pair = re.search(rf"^pair number={number} .*", index, re.M)
        if pair is None:
            raise Failed(f"{session}: has no pair {number}")
        begin_us = [re.search(rf" {side}_begin_us=(\d+)", pair[0])[1] for side in ("left", "right")]
        folder.mkdir()
        for side, begin in zip(("left", "right"), begin_us):
            self.control(f"truth {side} {side} {begin}")
            for path in self.work.glob(f"{side}[._]*"):
                path.rename(folder / path.name)

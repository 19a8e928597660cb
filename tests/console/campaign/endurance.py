# SPDX-License-Identifier: Apache-2.0
"""usage: endurance.py [--hours N] [--seed N] [--verbose]

Runs vergenced on a simulated rig in virtual time for N hours (default 24), with random commands
and random faults: parts that jam, are unplugged, silent, stuck or send garbage; clients that
vanish, never read, send garbage or are killed. Prints a line for each virtual hour, and the
progress when SIGINT or SIGTERM ends it.

It fails if the daemon ends, its memory grows by more than 2 MiB or its descriptors by any after
the first hour (or the first half of a shorter run), the bridge's watchdog fires while the daemon
reports that it is ready, a bring-up fails without a fault, a command fails without a reason, or
does not end.

The seed determines the commands and faults; where a cancelled command stops depends on the
machine. A failure is printed with the commands before it, and the simulated rig's log is kept:
"vergence simulate --replay" repeats it. --verbose prints each command with
the time of the rig. VERGENCED, VERGENCE_BOARD and SIMRIG name the programs, VERGENCE_SOURCE the
sources.

Exit code: 0 nothing found; 1 a failure was found and printed; 2 wrong usage; 130 interrupted.
"""
import argparse
import collections
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

TESTS = os.path.join(os.path.dirname(__file__), os.pardir, os.pardir)
sys.path += [os.path.join(TESTS, name) for name in ("console", "simrig", "command")]
from daemon_process import SIMRIG, VERGENCE, VERGENCED, Client  # noqa: E402
from simrig_client import CONTROLLER, Client as RigClient, Gone  # noqa: E402

COMMAND_S = 900  # wall-clock limit of one command
GROWTH_KIB = 2048
LATELY = 60  # commands and faults printed with a failure
SIDES = ("left", "right")
STATUS_FIRED = 1 << 2
REPAIRS = tuple([f"servo {side} free" for side in SIDES] +
                [f"lens {side} {ring} free" for side in SIDES
                 for ring in ("zoom", "focus", "iris")] +
                [f"camera {side} ok" for side in SIDES] + ["bus ok", "serial ok"])


class Found(Exception):
    """A failure."""


class Interrupted(Exception):
    """SIGINT or SIGTERM."""


class Endurance:
    def __init__(self, folder, hours, seed, verbose):
        self.folder, self.hours, self.verbose = folder, hours, verbose
        self.chance = random.Random(seed)
        self.faulty = 0  # commands until faults are repaired; 0: no faults
        self.ready = False
        self.input_paused = []
        self.reported, self.bringups, self.commands, self.cancelled = 0, 0, 0, 0
        self.gap_ms, self.base = 0.0, None
        self.began_s, self.at_s = 0.0, 0.0
        self.files = os.path.join(folder, "files")
        self.path = os.path.join(folder, "v.sock")
        self.rig, self.daemon, self.control_connection, self.client = None, None, None, None
        self.seed = seed
        self.lately = collections.deque(maxlen=LATELY)
        self.rig_log = os.path.join(folder, "rig.log")

    def start(self):
        rig_path = os.path.join(self.folder, "rig.sock")
        # Long times from the start, so that microsecond counters wrap at any moment.
        begin_s = self.chance.randrange(900000)
        self.rig = subprocess.Popen([SIMRIG, "--scene", "plane", "--seed", str(self.seed), "--listen",
                                     f"unix:{rig_path}", "--log", self.rig_log, "--begin",
                                     str(begin_s)], stdout=subprocess.DEVNULL)
        self.await_path(rig_path, self.rig)
        quiet = os.environ.get("ASAN_OPTIONS", "") + (
            ":detect_leaks=0:quarantine_size_mb=1:thread_local_quarantine_size_kb=64")
        self.daemon = subprocess.Popen(
            [VERGENCED, f"backend=sim unix:{rig_path}", f"socket={self.path}",
             f"files={self.files}", f"store={os.path.join(self.folder, 'store')}",
             "reader_timeout=1s", f"log={os.path.join(self.folder, 'log')}"],
            stdin=subprocess.DEVNULL, env={**os.environ, "ASAN_OPTIONS": quiet})
        self.await_path(self.path, self.daemon)
        self.control_connection = RigClient(f"unix:{rig_path}", CONTROLLER)
        self.control_connection.socket.settimeout(COMMAND_S)
        self.client = self.new_client()
        self.bringup()
        self.must("settings save")

    @staticmethod
    def await_path(path, process):
        end = time.monotonic() + COMMAND_S
        while not os.path.exists(path):
            if process.poll() is not None or time.monotonic() > end:
                raise Found(f"{path} does not come")
            time.sleep(0.02)

    def new_client(self):
        client = Client(self.path)
        client.socket.settimeout(COMMAND_S)
        return client

    def report(self, what):
        line = f"{self.passed_s():10.3f} s  {what}"
        self.lately.append(line)
        if self.verbose:
            print(line, flush=True)

    # ---- one command

    def ask(self, command):
        """Returns the answer in JSON, which must always come."""
        self.report(command)
        self.commands += 1
        try:
            answer = self.client.ask_json(command)
        except (TimeoutError, TypeError, OSError) as error:
            raise Found(f"\"{command}\" has no answer: {self.how_it_ended(error)}") from error
        if not answer["ok"]:
            self.reported += 1
            self.report(f"  {answer['message']}")
            if "watchdog fired" in answer["message"]:
                raise Found(f"{command}: {answer['message']}")
        return answer

    def how_it_ended(self, error):
        try:
            return f"the daemon ended with {self.daemon.wait(5)}"
        except subprocess.TimeoutExpired:
            return repr(error)

    def bringup(self):
        answer = self.ask("bringup")
        if not answer["ok"]:
            raise Found(f"nothing is broken, but: bringup: {answer['message']}")
        self.bringups += 1
        self.ready = True
        self.must("window 64 48")

    def must(self, command):
        """Runs a command that works while there are no faults."""
        answer = self.ask(command)
        if not answer["ok"] and self.faulty == 0 and self.ready:
            raise Found(f"nothing is broken, but: {command}: {answer['message']}")
        return answer

    def check_watchdog(self):
        """Checks the bridge's own state while the daemon reports that all is well."""
        self.ready = self.ask("status")["result"]["state"] == "ready"
        if not self.ready:
            return
        answer = self.ask("registers bridge status")
        if answer["ok"] and int(answer["result"]["status"], 0) & STATUS_FIRED:
            raise Found("the bridge's watchdog has fired, and the daemon says it is ready")

    # ---- what may happen

    def ordinary(self):
        pick, side = self.chance, self.chance.choice(("left", "right", "both"))
        command = pick.choice((
            f"pan {pick.uniform(-25, 25):.2f} side={side}",
            f"zoom {pick.randrange(300, 850)} side={side}",
            f"focus {pick.randrange(300, 850)} side={side}",
            f"iris {pick.randrange(300, 850)} side={side}",
            f"exposure {pick.randrange(100, 40000)} side={side}",
            f"gain {pick.uniform(1, 15):.2f} side={side}",
            f"window {16 * pick.randrange(1, 9)} {16 * pick.randrange(1, 7)}", "capture x",
            "capture x static=yes", "status", "health", "registers bridge", "registers left",
            "selftest", "log 20", "help", "config", "files", "bugreport", "view", "safe",
            "record start r", "record stop", "settings save", "settings restore"))
        if command.startswith("capture"):
            shutil.rmtree(os.path.join(self.files, "x"), ignore_errors=True)
            if self.ask("record")["result"]["recording"] != "nothing":
                command = command.replace(" x", "", 1)
        if command == "record start r":
            self.record()
        elif command == "record stop":
            self.ask(command)  # nothing may be running
        elif command == "safe":
            self.must(command)
            self.ready = False
        else:
            self.must(command)

    def record(self):
        self.ask("record stop")
        shutil.rmtree(os.path.join(self.files, "r"), ignore_errors=True)
        self.ready = False  # it starts with the instrument down
        self.must("record start r")
        if self.faulty == 0:
            self.bringup()

    def break_something(self):
        pick, side = self.chance, self.chance.choice(SIDES)
        ring = pick.choice(("zoom", "focus", "iris"))
        what = pick.choice((
            f"servo {side} jam", f"lens {side} {ring} jam", f"camera {side} unplug",
            f"camera {side} silent", f"camera {side} stuck",
            f"camera {side} torn {pick.randrange(10)}", "bus sda", "bus scl", "serial silent",
            f"serial late {pick.randrange(10, 2000)}", f"serial split {pick.randrange(1, 200)}",
            f"serial garbage {pick.uniform(0.01, 1):.2f}",
            f"serial lost {pick.uniform(0.01, 1):.2f}"))
        self.report(f"fault {what}")
        self.control_connection.control(f"fault {what}")
        self.faulty = pick.randrange(1, 6)

    def mend(self):
        self.report("all faults are repaired")
        for repair in REPAIRS:
            self.control_connection.control(f"fault {repair}")
        self.faulty = 0
        self.bringup()

    def cancel(self):
        """Sends Ctrl-C during a command."""
        command = self.chance.choice(("bringup", "pan 20 right=-20", "zoom 800", "capture x",
                                      "selftest", "wait 1000"))
        shutil.rmtree(os.path.join(self.files, "x"), ignore_errors=True)
        self.report(f"{command}, and Ctrl-C")
        self.client.send(f"@json {command}\n")
        time.sleep(self.chance.uniform(0, 0.1))
        self.client.send("\x03")
        self.commands += 1
        self.cancelled += 1
        answer = json.loads(self.client.line() or "{}")
        if "ok" not in answer:
            raise Found(f"{command} was cancelled and has no answer")

    def vanish(self):
        client = self.new_client()
        client.send(self.chance.choice((b"wait 1000\n", b"bringup\n", b"@json pan 2 side=left",
                                        b"zoom 700\nfocus 600\n", b"")))
        time.sleep(self.chance.uniform(0, 0.1))
        client.socket.close()
        self.cancelled += 1

    def be_killed(self):
        process = subprocess.Popen([VERGENCE, "--connect", f"unix:{self.path}", "wait", "1000"],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(self.chance.uniform(0, 0.3))
        process.kill()
        process.wait()
        self.cancelled += 1

    def stop_reading(self):
        client = self.new_client()
        client.socket.settimeout(0.05)
        try:
            client.send(400 * b"help\n")
        except OSError:
            pass
        self.input_paused.append(client)

    def send_garbage(self):
        with self.new_client() as client:
            client.send(self.chance.randbytes(self.chance.randrange(1, 3000)) + b"\n\x03\n")
            client.socket.shutdown(socket.SHUT_WR)
            while client.line() is not None:
                pass

    def step(self):
        pick = self.chance
        if self.faulty > 0:
            self.faulty -= 1
            if self.faulty == 0:
                self.mend()
        elif pick.random() < 0.06:
            self.break_something()
        elif not self.ready:
            self.bringup()
        kind = pick.random()
        if kind < 0.35:
            self.must(f"wait {pick.uniform(0.1, 30):.1f}")
        elif kind < 0.88:
            self.ordinary()
        else:
            act = pick.choice((self.cancel, self.vanish, self.be_killed, self.stop_reading,
                               self.send_garbage))
            self.report(f"a client: {act.__name__}")
            act()
        self.check_watchdog()

    # ---- the account

    def settle(self):
        """Only one client, no recording and no faults."""
        self.mend()
        for client in self.input_paused:
            client.socket.close()
        self.input_paused = []
        self.ask("record stop")
        self.ask("wait 1")
        health = self.ask("health")["result"]
        self.gap_ms = max(self.gap_ms, health["watchdog"]["longest_gap"])
        if self.gap_ms >= health["watchdog"]["period"]:
            raise Found(f"between two feeds of the watchdog {self.gap_ms} ms have passed")

    def measure(self):
        """Resident memory (KiB) and descriptors, once closed connections are gone."""
        end = time.monotonic() + 60
        fds = -1
        while fds != len(os.listdir(f"/proc/{self.daemon.pid}/fd")) and time.monotonic() < end:
            fds = len(os.listdir(f"/proc/{self.daemon.pid}/fd"))
            time.sleep(0.5)
        with open(f"/proc/{self.daemon.pid}/status", encoding="ascii") as file:
            lines = dict(line.split(":", 1) for line in file if ":" in line)
        return int(lines["VmRSS"].split()[0]), fds

    def now_s(self):
        return self.control_connection.time_us() * 1e-6

    def passed_s(self):
        self.at_s = self.now_s()
        return self.at_s - self.began_s

    def account(self):
        self.settle()
        memory, fds = self.measure()
        hours = self.passed_s() / 3600
        print(f"{hours:8.3f} h  {memory:6d} KiB  {fds:3d} descriptors  {self.commands:7d} commands"
              f"  {self.cancelled:5d} cancelled  {self.reported:6d} failures"
              f"  {self.bringups:5d} bring-ups  {self.gap_ms:8.3f} ms longest gap", flush=True)
        if self.base is None:
            self.base = (memory, fds)
        if memory > self.base[0] + GROWTH_KIB:
            raise Found(f"memory grew from {self.base[0]} to {memory} KiB")
        if fds > self.base[1]:
            raise Found(f"descriptors grew from {self.base[1]} to {fds}")

    def run(self):
        self.began_s = self.now_s()
        every_s = min(3600.0, self.hours * 1800)
        due_s = every_s
        while self.passed_s() < self.hours * 3600:
            self.step()
            if self.passed_s() >= due_s:
                self.account()
                due_s += every_s
        self.account()
        self.daemon.send_signal(signal.SIGTERM)
        if self.daemon.wait(COMMAND_S) != 0:
            raise Found(f"the daemon ended with {self.daemon.returncode}")

    def close(self):
        for process in (self.daemon, self.rig):
            if process is not None and process.poll() is None:
                process.kill()
                process.wait()


def interrupt(number, _):
    raise Interrupted(number)


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("\n", maxsplit=1)[0][7:])
    parser.add_argument("--hours", type=float, default=24)
    parser.add_argument("--seed", type=int, default=20090915)
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    if not 0.01 <= options.hours <= 10000:
        parser.error("--hours: 0.01 to 10000")
    signal.signal(signal.SIGINT, interrupt)
    signal.signal(signal.SIGTERM, interrupt)
    folder = tempfile.mkdtemp(prefix="endurance")
    run = Endurance(folder, options.hours, options.seed, options.verbose)
    code, how = 0, "nothing found"
    print(f"seed {options.seed}, {options.hours:g} virtual hours", flush=True)
    try:
        run.start()
        run.run()
    except Found as found:
        code, how = 1, f"FOUND: {found}"
    except Gone:
        code, how = 1, "FOUND: the simulated rig has gone"
    except Interrupted:
        code, how = 130, "interrupted"
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    hours = (run.at_s - run.began_s) / 3600
    run.close()
    print(f"{hours:.3f} of {options.hours:g} virtual hours: {how}", flush=True)
    if code == 1:
        print("before it:\n" + "\n".join(run.lately))
        kept = os.path.join(tempfile.gettempdir(), f"endurance-{options.seed}.log")
        if os.path.exists(run.rig_log):
            shutil.move(run.rig_log, kept)
            print(f"the simulated rig's log: {kept}")
        log = os.path.join(folder, "log")
        if os.path.exists(log):
            with open(log, encoding="utf-8", errors="replace") as file:
                print("the end of the log:\n  " + "  ".join(file.readlines()[-12:]), end="")
    shutil.rmtree(folder, ignore_errors=True)
    return code


if __name__ == "__main__":
    sys.exit(main())

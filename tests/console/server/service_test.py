# SPDX-License-Identifier: Apache-2.0
"""The daemon as a service: its reports to the service manager, and what is installed."""
import glob
import os
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest

from daemon_process import TIMEOUT_S, VERGENCED, DaemonTest


SERVICE = os.path.join(os.path.dirname(VERGENCED), "vergenced.service")


def analyze():
    """Path of systemd-analyze; a test that requires it fails without it."""
    found = shutil.which("systemd-analyze")
    assert found, "systemd-analyze is missing: tools/install_packages test"
    return found


def settings_of(path):
    """The settings of a unit, each with its values in order."""
    settings = {}
    with open(path, encoding="utf-8") as file:
        for line in file:
            if "=" in line and line[0] != "#":
                key, value = line.rstrip().split("=", 1)
                settings.setdefault(key, []).append(value)
    return settings


def expanded(names):
    """The system calls of these names and sets; a set may include others."""
    calls = set()
    for name in names:
        if not name.startswith("@"):
            calls.add(name)
            continue
        output_text = subprocess.run([analyze(), "syscall-filter", name], check=True, text=True,
                              capture_output=True, timeout=TIMEOUT_S).stdout.splitlines()
        calls |= expanded(line.strip() for line in output_text[1:] if line.strip()[:1] not in ("", "#"))
    return calls


class Manager(DaemonTest):
    """A daemon that reports to a service manager."""

    @classmethod
    def setUpClass(cls):
        cls.manager_folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.manager_folder)
        cls.manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        cls.addClassCleanup(cls.manager.close)
        cls.manager.settimeout(TIMEOUT_S)
        path = os.path.join(cls.manager_folder, "notify")
        cls.manager.bind(path)
        os.environ["NOTIFY_SOCKET"] = path
        try:
            super().setUpClass()
        finally:
            del os.environ["NOTIFY_SOCKET"]


class Notify(Manager):
    def test_ready_alive_stopping(self):
        output_text = [self.manager.recv(100).decode()]
        begin = time.monotonic()
        for _ in range(3):
            output_text.append(self.manager.recv(100).decode())
        self.assertEqual(output_text, ["READY=1"] + 3 * ["WATCHDOG=1"])
        self.assertLess(time.monotonic() - begin, 20)
        # Also while a long command runs.
        client = self.client()
        client.send("wait 100000\n")
        for _ in range(3):
            self.assertEqual(self.manager.recv(100).decode(), "WATCHDOG=1")
        self.end(self.daemon)
        while output_text[-1] == "WATCHDOG=1":
            output_text.append(self.manager.recv(100).decode())
        self.assertEqual(output_text[-1], "STOPPING=1")
        # The running command was cancelled and its client answered.
        self.assertEqual(client.answer(), ["ERR CANCELLED cancelled"])
        self.start()


class Hasty(Manager):
    """A manager that requires more frequent heartbeats than the default."""
    period_us = 500000

    @classmethod
    def setUpClass(cls):
        cls.environment = {"WATCHDOG_USEC": str(cls.period_us)}
        super().setUpClass()

    def test_it_is_fed_twice_a_period(self):
        self.assertEqual(self.manager.recv(100).decode(), "READY=1")
        self.assertEqual(self.manager.recv(100).decode(), "WATCHDOG=1")
        begin = time.monotonic()
        feeds = 10
        for _ in range(feeds):
            self.assertEqual(self.manager.recv(100).decode(), "WATCHDOG=1")
        # As fast as a busy machine allows; at the default of a second it takes ten.
        self.assertLess(time.monotonic() - begin, 2 * feeds * self.period_us / 2 / 1e6)

    def test_the_watchdog_of_another_process_is_not_fed(self):
        for pid, fast in (("1", False), (None, True)):
            with self.subTest(pid=pid):
                self.end(self.daemon)
                cls = type(self)
                cls.environment = {"WATCHDOG_USEC": str(self.period_us)}
                cls.environment |= {"WATCHDOG_PID": pid} if pid else {}
                os.environ["NOTIFY_SOCKET"] = os.path.join(self.manager_folder, "notify")
                try:
                    self.start()
                finally:
                    del os.environ["NOTIFY_SOCKET"]
                while self.manager.recv(100).decode() != "READY=1":
                    pass
                self.manager.recv(100)
                begin = time.monotonic()
                for _ in range(3):
                    self.manager.recv(100)
                self.assertEqual(time.monotonic() - begin < 2, fast)


class Filtered(Manager):
    """Under the unit's restrictions; any other call is death by SIGSYS."""

    @classmethod
    def setUpClass(cls):
        cls.filter = os.environ.get("VERGENCE_SERVICE_FILTER")
        assert cls.filter, "libseccomp-dev is missing: tools/install_packages test"
        unit = settings_of(SERVICE)
        # Entries of an allow list, whose first entry has no "~"; a service always has the set
        # @default.
        names = " ".join(unit["SystemCallFilter"]).split()
        cls.calls = expanded(["@default", *names])
        families = [str(int(getattr(socket, name)))
                    for name in unit["RestrictAddressFamilies"][0].split()]
        assert unit["MemoryDenyWriteExecute"] == ["yes"] and names[0][0] != "~"
        cls.rules = ["no-write-execute"] + [f"family {number}" for number in families]
        with tempfile.NamedTemporaryFile("w", encoding="ascii", delete=False) as file:
            cls.addClassCleanup(os.unlink, file.name)
        cls.write(file.name, cls.calls)
        cls.launcher = (cls.filter, file.name)
        super().setUpClass()

    @classmethod
    def write(cls, path, calls):
        with open(path, "w", encoding="ascii") as file:
            file.write("\n".join([*cls.rules, *sorted(calls)]))

    def test_it_confines_itself_and_works(self):
        self.assertEqual(self.manager.recv(100).decode(), "READY=1")
        client = self.client()
        for command in ("version", "record start s", "bringup", "status", "selftest", "capture",
                        "record stop", "files", "health", "log"):
            self.assertEqual(client.ask(command)[-1], "OK", command)
        self.assertEqual(client.ask("calibration")[-1][:11], "ERR MISSING")
        with open(f"/proc/{self.daemon.pid}/status", encoding="ascii") as file:
            status = {words[0]: words[-1] for words in (line.split() for line in file)}
        # The service manager has three filters here; the daemon adds one.
        self.assertEqual((status["Seccomp:"], status["Seccomp_filters:"],
                          status["NoNewPrivs:"]), ("2", "4", "1"))
        client.send("quit\n")
        self.daemon.send_signal(signal.SIGHUP)  # it reopens its log
        self.assertEqual(self.client().ask("version")[-1], "OK")
        self.end(self.daemon)
        self.assertEqual(self.daemon.returncode, 0)
        self.start()

    def test_a_missing_call_in_a_filter_is_noticed(self):
        narrow = os.path.join(self.folder, "narrow")
        self.write(narrow, self.calls - {"seccomp"})
        done = subprocess.run(
            [self.filter, narrow, VERGENCED, "store=none", "files=none",
             f"socket={self.folder}/narrow.sock"], stdin=subprocess.DEVNULL, capture_output=True,
            timeout=TIMEOUT_S, check=False)
        self.assertEqual(done.returncode, -signal.SIGSYS, done.stderr)


class Names(unittest.TestCase):
    """One architecture's separate calls are part of a more general call on another: this one never
    makes the calls that 32-bit ARM needs."""

    def test_every_call_of_sockets_is_allowed_by_its_own_name(self):
        daemon = os.path.join(os.environ["VERGENCE_SOURCE"], "daemon")
        with open(os.path.join(daemon, "server", "confine.c"), encoding="utf-8") as file:
            table = re.search(r"char allowed\[\] =(.*?);\n\n", file.read(), re.S)[1]
        allowed = {name for line in re.findall(r'"(.*)"', table) for name in line.split()}
        made = set()
        for folder in ("server", "backends/sim"):
            for path in sorted(glob.glob(os.path.join(daemon, folder, "*.c"))):
                with open(path, encoding="utf-8") as file:
                    made |= set(re.findall(r"\b(send|sendto|recv|recvfrom|accept4|connect|shutdown)\(",
                                           file.read()))
        self.assertLessEqual({"send", "recv", "accept4"}, made)
        self.assertEqual(made - allowed, set())


class Installed(unittest.TestCase):
    def test_the_installed_service_is_complete(self):
        build = os.path.dirname(os.path.dirname(VERGENCED))
        with tempfile.TemporaryDirectory() as root:
            subprocess.run(["cmake", "--install", build, "--component", "daemon"], check=True,
                           capture_output=True, env={**os.environ, "DESTDIR": root})
            found = [os.path.join(folder, name) for folder, _, names in os.walk(root)
                     for name in names]
            by_name = {os.path.basename(path): path for path in found}
            unit = {key: values[-1] for key, values in
                    settings_of(by_name["vergenced.service"]).items()}
            words = unit["ExecStart"].split()
            # Everything that the unit names exists.
            self.assertIn(root + words[0], found)
            self.assertIn(root + words[2], found)
            done = subprocess.run([root + words[0], "--check", root + words[2]],
                                  capture_output=True, text=True, timeout=TIMEOUT_S)
            self.assertEqual(done.returncode, 0, done.stderr)
            # So do the profiles next to the settings that may name one.
            with open(root + words[2], encoding="utf-8") as file:
                text = file.read()
            for name in ("rig", "two-cameras", "two-cameras-lens"):
                with open(root + words[2], "w", encoding="utf-8") as file:
                    file.write(text.replace("profile = rig", f"profile = profiles/{name}.profile"))
                done = subprocess.run([root + words[0], "--check", root + words[2]],
                                      capture_output=True, text=True, timeout=TIMEOUT_S)
                self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((unit["Type"], unit["User"]), ("notify", "vergence"))
            # A forbidden call is a reported error, not an unexplained kill.
            self.assertEqual(unit["SystemCallErrorNumber"], "EPERM")
            # Free memory is only visible in /proc/meminfo.
            self.assertEqual(unit.get("ProcSubset", "all"), "all")
            with open(by_name["70-vergence.rules"], encoding="utf-8") as file:
                self.assertIn(f'GROUP="{unit["Group"]}"', file.read())
            copy = os.path.join(root, "check.service")
            with open(by_name["vergenced.service"], encoding="utf-8") as file:
                text = file.read().replace(words[0], root + words[0], 1)
            with open(copy, "w", encoding="utf-8") as file:
                file.write(text)
            done = subprocess.run([analyze(), "verify", "--man=no", copy], capture_output=True,
                                  text=True, timeout=TIMEOUT_S)
            complaints = [line for line in done.stderr.splitlines() if "check.service" in line]
            self.assertEqual(complaints, [])


if __name__ == "__main__":
    unittest.main()

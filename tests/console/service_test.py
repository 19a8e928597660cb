# SPDX-License-Identifier: Apache-2.0
"""The daemon as a service: what the service manager is told, and what is installed."""
import os
import shutil
import socket
import subprocess
import tempfile
import time
import unittest

from daemon_process import PATIENCE_S, VERGENCED, DaemonTest


class Notify(DaemonTest):
    @classmethod
    def setUpClass(cls):
        cls.manager_folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.manager_folder)
        cls.manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        cls.addClassCleanup(cls.manager.close)
        cls.manager.settimeout(PATIENCE_S)
        path = os.path.join(cls.manager_folder, "notify")
        cls.manager.bind(path)
        os.environ["NOTIFY_SOCKET"] = path
        try:
            super().setUpClass()
        finally:
            del os.environ["NOTIFY_SOCKET"]

    def test_ready_alive_stopping(self):
        said = [self.manager.recv(100).decode()]
        begin = time.monotonic()
        for _ in range(3):
            said.append(self.manager.recv(100).decode())
        self.assertEqual(said, ["READY=1"] + 3 * ["WATCHDOG=1"])
        self.assertLess(time.monotonic() - begin, 20)
        # Also while a long command runs.
        client = self.client()
        client.send("wait 100000\n")
        for _ in range(3):
            self.assertEqual(self.manager.recv(100).decode(), "WATCHDOG=1")
        self.end(self.daemon)
        while said[-1] == "WATCHDOG=1":
            said.append(self.manager.recv(100).decode())
        self.assertEqual(said[-1], "STOPPING=1")
        # The command that ran was told to end, and its client was answered.
        self.assertEqual(client.answer(), ["ERR CANCELLED cancelled"])
        self.start()


class Installed(unittest.TestCase):
    def test_the_installed_service_is_whole(self):
        build = os.path.dirname(os.path.dirname(VERGENCED))
        with tempfile.TemporaryDirectory() as root:
            subprocess.run(["cmake", "--install", build, "--component", "daemon"], check=True,
                           capture_output=True, env={**os.environ, "DESTDIR": root})
            found = [os.path.join(folder, name) for folder, _, names in os.walk(root)
                     for name in names]
            by_name = {os.path.basename(path): path for path in found}
            with open(by_name["vergenced.service"], encoding="utf-8") as file:
                unit = dict(line.rstrip().split("=", 1) for line in file
                            if "=" in line and line[0] != "#")
            words = unit["ExecStart"].split()
            # Everything that the unit names is there.
            self.assertIn(root + words[0], found)
            self.assertIn(root + words[2], found)
            done = subprocess.run([root + words[0], "--check", root + words[2]],
                                  capture_output=True, text=True, timeout=PATIENCE_S)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((unit["Type"], unit["User"]), ("notify", "vergence"))
            # What is free is seen in /proc/meminfo alone.
            self.assertEqual(unit.get("ProcSubset", "all"), "all")
            with open(by_name["70-vergence.rules"], encoding="utf-8") as file:
                self.assertIn(f'GROUP="{unit["Group"]}"', file.read())
            verify = shutil.which("systemd-analyze")
            if verify:
                copy = os.path.join(root, "check.service")
                with open(by_name["vergenced.service"], encoding="utf-8") as file:
                    text = file.read().replace(words[0], root + words[0], 1)
                with open(copy, "w", encoding="utf-8") as file:
                    file.write(text)
                done = subprocess.run([verify, "verify", "--man=no", copy], capture_output=True,
                                      text=True, timeout=PATIENCE_S)
                complaints = [line for line in done.stderr.splitlines() if "check.service" in line]
                self.assertEqual(complaints, [])


if __name__ == "__main__":
    unittest.main()

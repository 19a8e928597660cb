# SPDX-License-Identifier: Apache-2.0
"""Start and end of the daemon: settings of a file and the command line, logs, nothing to listen
on."""
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import unittest

from daemon_process import TIMEOUT_S, VERGENCED, DaemonTest, small_stack


class FullDisk(DaemonTest):
    settings = ("log=/dev/full",)

    def test_a_log_that_cannot_be_written_does_not_stop_the_daemon(self):
        client = self.client()
        self.assertEqual(client.ask("wait 0.1"), ["OK"])
        self.assertTrue(any("serving" in line for line in client.ask("log")))


class Unconfined(DaemonTest):
    """In the sanitizers' build this finds leaks, at the end."""
    settings = ("confine=no",)

    def test_it_works_and_ends_orderly(self):
        with self.client() as client:
            for command in ("bringup", "health", "pan 1", "log", "help", "version", "config",
                            "bugreport", "files", "record start r", "bringup", "record stop",
                            "window 64 64", "capture", "watch 0.1 version count=2", "safe", "fly"):
                client.ask(command)
            client.begin("wait 100000")
        self.end(self.daemon)
        self.assertNotIn("ERROR", self.output_text())
        self.start()


class SmallStack(DaemonTest):
    """The program's own stack may not grow as it does by default."""
    launcher = small_stack(192)

    def test_everything_has_room(self):
        client = self.client()
        for command in ("bringup", "window 64 48", "capture p", "bugreport", "record start r",
                        "bringup", "record stop", "replay r", "selftest"):
            self.assertEqual(client.ask(command)[-1], "OK", command)


class ClosedStreams(DaemonTest):
    """Started without standard streams."""
    launcher = ("sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh")

    def test_no_line_of_the_log_goes_into_a_device(self):
        client = self.client()
        self.assertEqual(client.ask("bringup")[-1], "OK")
        self.assertTrue(client.ask("fly")[-1].startswith("ERR ARGUMENT"))
        for number in range(3):
            self.assertEqual(os.readlink(f"/proc/{self.daemon.pid}/fd/{number}"), "/dev/null")


class RepeatedLines(DaemonTest):
    def test_they_are_counted(self):
        client = self.client()
        shutil.rmtree(self.files)
        self.addCleanup(os.mkdir, self.files)
        for _ in range(4):
            self.assertRegex(client.ask("fetch x")[-1], "^ERR DEVICE .*was removed")
        lines = client.ask("log 3")[1:-1]
        self.assertIn("was removed", lines[-2])
        self.assertIn("error: last message repeated 3 times", lines[-1])


class LogFile(DaemonTest):
    @classmethod
    def arguments(cls):
        cls.file = os.path.join(cls.folder, "log")
        return [*super().arguments(), f"log={cls.file}", "console=none", "tcp_port=off"]

    def test_it_is_reopened_and_the_end_is_logged(self):
        client = self.client()
        client.ask("version")
        os.rename(self.file, self.file + ".1")
        self.daemon.send_signal(signal.SIGHUP)
        self.wait_for(self.file)
        with open(self.file + ".1", encoding="utf-8") as file:
            self.assertIn("serving", file.read())
        self.end(self.daemon)
        with open(self.file, encoding="utf-8") as file:
            self.assertIn("signal 15: ending", file.read())
        self.assertFalse(os.path.exists(self.path))
        self.start()


class SettingsFile(DaemonTest):
    """A command line over a file changes only what it names."""

    @classmethod
    def arguments(cls):
        path = os.path.join(cls.folder, "w.conf")
        with open(path, "w", encoding="ascii") as file:
            file.write("profile = two-cameras\nrig.width = 640 px\nrig.height = 400 px\n"
                       "queue = 3\n")
        return ["--config", path, *super().arguments(), "profile=rig", "rig.height=480px"]

    def test_what_is_served(self):
        settings = self.client().ask("config")
        for setting in ("profile: rig", "rig.width: 640 px", "rig.height: 480 px", "queue: 3"):
            self.assertTrue(any(setting in line for line in settings), (setting, settings))


class OldSettingsFile(DaemonTest):
    """A file in the notation of an older version is served, with one warning."""

    @classmethod
    def arguments(cls):
        path = os.path.join(cls.folder, "old.conf")
        with open(path, "w", encoding="ascii") as file:
            file.write("rig.width_px = 640\nrig.height_px = 480\nreader_timeout = 20\n")
        return ["--config", path, *super().arguments()]

    def test_what_is_served(self):
        client = self.client()
        settings = client.ask("config")
        for setting in ("rig.width: 640 px", "rig.height: 480 px", "reader_timeout: 20 s"):
            self.assertIn(setting, settings)
        warnings = [line for line in client.ask("log") if "old notation" in line]
        self.assertEqual(len(warnings), 1, warnings)
        self.assertIn("warning", warnings[0])
        self.assertIn("--check", warnings[0])


class NoSocket(unittest.TestCase):
    """A daemon that cannot be reached does not start."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="console")
        self.addCleanup(shutil.rmtree, self.folder)

    def refused(self, *settings, launcher=(), directories=("store=none", "files=none")):
        done = subprocess.run(
            [*launcher, VERGENCED, "profile=two-cameras", "backend=linux", "left_camera=/dev/none",
             "right_camera=/dev/none2", "log_level=error", *directories, *settings],
            capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        return done.stderr

    def test_an_existing_file_that_is_not_a_socket(self):
        for name in ("regular", "s.new"):
            path = os.path.join(self.folder, name)
            with open(path, "w", encoding="ascii") as file:
                file.write("x")
            where = path.removesuffix(".new")
            self.assertRegex(self.refused(f"socket={where}"),
                             f"^vergenced: socket = {path}: .*not a socket.*\n$")
            with open(path, encoding="ascii") as file:
                self.assertEqual(file.read(), "x")

    def test_no_descriptors(self):
        few = ("sh", "-c", 'ulimit -n 4; exec "$@"', "sh")
        self.assertEqual(self.refused("tcp_port=1", launcher=few),
                         "vergenced: cannot wait for signals: Too many open files\n")

    def test_one_directory_for_both(self):
        # "send" could replace the store's records, and a save could replace sent files.
        path = os.path.join(self.folder, "both")
        link = os.path.join(self.folder, "link")
        os.symlink(self.folder, link)
        for store in (f"{path}/../both/", f"{link}/both", f"{link}/both/store"):
            output_text = self.refused(directories=(f"files={path}", f"store={store}"))
            self.assertIn(f"store = {store} is inside files = {path}", output_text)
            self.assertFalse(os.path.exists(path))

    def test_a_console_that_is_not_a_terminal(self):
        for path, why in (("/no/such", "No such file or directory"),
                          ("/dev/null", "not a serial line")):
            self.assertEqual(self.refused("socket=none", f"console={path}"),
                             f"vergenced: console = {path}: {why}\n")

    def test_a_port_that_is_taken(self):
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            port = other.getsockname()[1]
            self.assertEqual(self.refused("socket=none", f"tcp_port={port}"),
                             f"vergenced: tcp_port = {port}: Address already in use\n")


class NoRig(unittest.TestCase):
    def test_a_missing_rig_is_one_line(self):
        done = subprocess.run(
            [VERGENCED, "backend=sim unix:/no/such.sock", "socket=none", "console=stdio",
             "store=none", "files=none"], stdin=subprocess.DEVNULL, capture_output=True,
            text=True, timeout=TIMEOUT_S)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        self.assertIn("backend = sim unix:/no/such.sock", done.stderr)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""The system's watchdog, used by the daemon on a fake kernel: fed while the instrument's thread
makes progress, left to expire if that hangs or the daemon is killed, disarmed at an orderly end."""
import os
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from daemon_process import TIMEOUT_S, VERGENCED, DaemonTest, Terminal, replaced
from waiting import wait_until

STUCK_S = 2
WIDTH, HEIGHT = 32, 24


class Watchdog(DaemonTest):
    settings = ("profile=two-cameras", "backend=linux", "left_camera=/dev/video0",
                "right_camera=/dev/video2", f"rig.width={WIDTH}px", f"rig.height={HEIGHT}px",
                "store=none", "watchdog=/dev/watchdog",
                "watchdog_period=15s", f"stuck_after={STUCK_S}s")

    @classmethod
    def setUpClass(cls):
        pass

    def setUp(self):
        self.start_with("")

    @classmethod
    def arguments(cls):
        return replaced([f"socket={cls.path}", f"files={cls.files}"], *cls.settings)

    def start_with(self, more):
        """A separate daemon for each test, with an additional line in the fake kernel's script."""
        cls = type(self)
        cls.folder = tempfile.mkdtemp(prefix="console")
        self.addCleanup(shutil.rmtree, cls.folder)
        cls.path = os.path.join(cls.folder, "v.sock")
        cls.files = os.path.join(cls.folder, "files")
        self.record = os.path.join(cls.folder, "record")
        picture = os.path.join(cls.folder, "picture")
        with open(picture, "wb") as file:
            file.write(b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + bytes(WIDTH * HEIGHT))
        script = os.path.join(cls.folder, "script")
        with open(script, "w", encoding="ascii") as file:
            file.write(f"video /dev/video0 GREY {picture} 10000\n"
                       f"video /dev/video2 GREY {picture} 10000\n"
                       f"watchdog /dev/watchdog\nrecord {self.record}\n{more}\n")
        sanitizer = "detect_leaks=0:verify_asan_link_order=0"
        cls.environment = {"LD_PRELOAD": os.environ["VERGENCE_FAKE_KERNEL_LIBRARY"],
                           "VERGENCE_FAKE_KERNEL": script, "ASAN_OPTIONS": sanitizer}
        self.start()

    def lines(self):
        with open(self.record, encoding="ascii") as file:
            return [line for line in file.read().splitlines() if line.startswith("watchdog ")]

    def feeds(self):
        return self.lines().count("watchdog ioctl KEEPALIVE")

    def wait_until(self, condition):
        wait_until(condition, self.lines)

    def tearDown(self):
        if self.daemon.poll() is None:
            self.daemon.kill()
            self.daemon.wait(TIMEOUT_S)
        self.daemon.returncode = 0

    def test_fed_and_disarmed(self):
        self.wait_until(lambda: self.feeds() >= 3)
        self.assertEqual(self.lines()[:3], ["watchdog open wronly noctty cloexec",
                                            "watchdog ioctl GETSUPPORT",
                                            "watchdog ioctl SETTIMEOUT 15"])
        # Also while a long command runs.
        client = self.client()
        client.send("wait 100000\n")
        before = self.feeds()
        self.wait_until(lambda: self.feeds() >= before + STUCK_S + 2)
        self.end(self.daemon)
        self.assertEqual(self.lines()[-2:], ["watchdog write 1", "watchdog close"])
        self.assertEqual(self.lines()[-3], "watchdog ioctl KEEPALIVE")

    def test_a_thread_that_hangs(self):
        self.tearDown()
        self.start_with("hang 1 video0 ioctl STREAMON")
        self.wait_until(lambda: self.feeds() >= 1)
        self.client().send("bringup\n")
        self.wait_until(lambda: "stuck" in self.output_text())
        at_end = self.feeds()
        time.sleep(2.5)
        self.assertEqual(self.feeds(), at_end)
        # Requests for the log are still answered, but no orderly end is possible.
        self.assertIn("has been stuck", "\n".join(self.client().ask("log")))
        self.daemon.send_signal(signal.SIGTERM)
        with self.assertRaises(subprocess.TimeoutExpired):
            self.daemon.wait(1.5)
        self.assertLessEqual(self.feeds(), at_end + 1)
        self.assertNotIn("watchdog write 1", self.lines())

    def test_a_watchdog_that_cannot_be_fed(self):
        self.tearDown()
        type(self).settings += ("faults=watchdog.feed@2+=io",)
        self.addCleanup(setattr, type(self), "settings", self.settings[:-1])
        self.start_with("")
        self.wait_until(lambda: "the watchdog cannot be fed: " in self.output_text())
        self.assertEqual(self.client().ask("version")[-1], "OK")
        self.assertEqual(self.feeds(), 1)
        # It is reported once, however long it lasts.
        self.end(self.daemon)
        self.assertEqual(self.output_text().count("cannot be fed"), 1)

    def test_a_slow_disk(self):
        """What was recorded meanwhile replays. That the rig is served is in disk_writer_test."""
        self.tearDown()
        folder, slow_ms = tempfile.mkdtemp(prefix="console"), 1200
        self.addCleanup(shutil.rmtree, folder)
        type(self).settings += (f"files={folder}",)
        self.addCleanup(setattr, type(self), "settings", self.settings[:-1])
        self.start_with(f"watch {folder}\nslow {slow_ms} session.index fsync")
        client = self.client()
        client.send("record start slow\nbringup\ncapture\nrecord stop\n")
        for command in ("record", "bringup", "capture", "record stop"):
            self.assertEqual(client.answer()[-1], "OK", command)
        played = subprocess.run([os.environ["VERGENCE"], "replay", os.path.join(folder, "slow")],
                                capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        self.assertEqual((played.returncode, played.stderr), (0, ""))

    def test_a_daemon_that_is_killed(self):
        self.wait_until(lambda: self.feeds() >= 1)
        self.daemon.kill()
        self.daemon.wait(TIMEOUT_S)
        self.assertNotIn("watchdog write 1", self.lines())

    def refused(self, *settings):
        done = subprocess.run([VERGENCED, *replaced(self.arguments(), *settings)],
                              capture_output=True, text=True, timeout=TIMEOUT_S, check=False,
                              env={**os.environ, **self.environment})
        self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
        return done.stderr

    def test_what_is_refused(self):
        self.tearDown()
        os.unlink(self.record)
        self.assertIn("/dev/none", self.refused("watchdog=/dev/none"))
        self.assertIn("watchdog_period", self.refused("watchdog_period=1s"))
        # A start that fails later leaves no armed watchdog behind.
        self.assertIn("/no/such", self.refused("socket=/no/such/place.sock"))
        self.assertEqual(self.lines()[-2:], ["watchdog write 1", "watchdog close"])
        # A period too short to make the instrument safe, whatever was requested.
        script = self.environment["VERGENCE_FAKE_KERNEL"]
        with open(script, encoding="ascii") as file:
            lines = file.read()
        with open(script, "w", encoding="ascii") as file:
            file.write(lines.replace("watchdog /dev/watchdog\n", "watchdog /dev/watchdog 3\n"))
        self.assertRegex(self.refused(), "^vergenced: watchdog = /dev/watchdog: .* 3 s.* 4 s ")
        self.assertEqual(self.lines()[-2:], ["watchdog write 1", "watchdog close"])

    def test_other_files_are_rejected_unchanged(self):
        self.tearDown()
        file, pipe = (os.path.join(self.folder, name) for name in ("file", "pipe"))
        with open(file, "w", encoding="ascii") as stream:
            stream.write("abcdefgh\nline\n")
        os.mkfifo(pipe)
        terminal = Terminal()
        self.addCleanup(terminal.close)
        for path in (file, pipe, self.folder):
            self.assertEqual(self.refused(f"watchdog={path}"),
                             f"vergenced: watchdog {path}: not a character device\n")
        for path in ("/dev/null", "/dev/zero", terminal.name):
            self.assertIn(f"vergenced: watchdog {path}: not a watchdog: ",
                          self.refused(f"watchdog={path}"))
        self.assertEqual(terminal.read(0), "")
        with open(file, encoding="ascii") as stream:
            self.assertEqual(stream.read(), "abcdefgh\nline\n")


if __name__ == "__main__":
    unittest.main()

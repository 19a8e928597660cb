# SPDX-License-Identifier: Apache-2.0
"""The image on the emulated board: boots over TFTP to the instrument's prompt, measures what the PC
measures to the byte, and comes back when the daemon is killed or stuck."""
import contextlib
import datetime
import re
import subprocess
import sys
import time
import unittest
import zlib

from board_process import (BOOT_LIMIT_S, COMMAND_LIMIT_S, KILL, ROOT, STOP, STOP_ALL, VERGENCE,
                           BoardTest, child_of, processor_s)

sys.path.insert(0, str(ROOT / "tools/board.d"))
import rig_client  # noqa: E402

# Both cameras look at the cylinder; a small window, as the board renders nothing but computes slowly.
AIM = ("bringup", "pan 3.57 right=-3.272", "window 320 200", "iris 800", "exposure 9000")
DEPTH = ("near=1600", "far=2300")
SURFACE = ("mesh.ply", "points.pcd", "disparity.pfm")
# The board's programs and the PC's may be of different commits while one works on them.
BUILD_ID = re.compile(rb"^(comment|#) vergence [^\n]*\n", re.M)
# A store that is soon full.
SMALL_STORE = "mtdparts=0.flash:64m(boot),256k(environment),4m(image),4m(image2),2m(store)"
STORE = "/var/lib/vergence/store"
FILL_LIMIT_S = 60
# The bridge's own watchdog, with which the servos rest, has a second.
SERVO_WATCHDOG_US = 1_100_000


class Instrument(BoardTest):
    """One board for all of these."""

    @classmethod
    def setUpClass(cls):
        cls.begin("--scene", "cylinder", "--seed", "3", "--args", SMALL_STORE)
        cls.addClassCleanup(cls.board.close)
        # Processor time, as the machine does much else: of U-Boot with TFTP, and from there to the prompt.
        cls.board.wait("Starting kernel", BOOT_LIMIT_S)
        qemu = child_of(cls.board.process, "qemu-system-arm")
        cls.u_boot_s = processor_s(qemu)
        cls.board.wait_prompt()
        cls.linux_s = processor_s(qemu) - cls.u_boot_s

    def vergence(self, *words):
        """The PC's client, over TCP."""
        address = re.search(r"--connect (\S+) --token (\S+)", self.board.report())
        done = subprocess.run([VERGENCE, "--connect", address[1], "--token", address[2], *words],
                              cwd=self.board.folder, capture_output=True, text=True,
                              timeout=COMMAND_LIMIT_S, check=False)
        self.assertEqual(done.returncode, 0, f"{words}: {done.stdout}{done.stderr}")
        return done.stdout

    def on_host(self, *words):
        done = subprocess.run([str(word) for word in words], cwd=self.board.folder, text=True,
                              capture_output=True, timeout=COMMAND_LIMIT_S, check=False)
        self.assertEqual(done.returncode, 0, f"{words}: {done.stdout}{done.stderr}")
        return done.stdout

    def test_full_files_are_refused_before_the_work(self):
        board = self.board
        for line in AIM:
            self.assertRegex(board.type(line), r"OK$", line)
        board.shell("cat /dev/zero >/var/lib/vergence/files/fill")
        answer = board.type("capture full")
        self.assertRegex(answer, r"^ERR [A-Z_]+ .+$")
        self.assertEqual(board.shell("cd /var/lib/vergence/files && ls"), "fill")
        board.shell("rm /var/lib/vergence/files/fill")
        self.assertRegex(board.type("capture full"), r"OK$")

    def test_the_clock_is_the_pc_s(self):
        now = int(self.board.shell("date +%s"))
        self.assertLess(abs(now - time.time()), 5)

    def send_calibration(self):
        """The simulated rig knows its own."""
        self.board.type("token")
        for line in (*AIM, "capture first"):
            self.assertRegex(self.board.type(line), r"OK$", line)
        self.on_host(ROOT / "tools/simrig/control", f"unix:{self.board.folder}/rig.sock",
                     "truth left left", "truth right right")
        (self.board.folder / "rig.calibration").unlink(missing_ok=True)  # of an earlier test
        self.on_host(VERGENCE, "info", ".", "--convert", "rig.calibration")
        self.vergence("send", "rig.calibration")

    def test_a_full_store_keeps_what_it_has(self):
        board = self.board
        self.send_calibration()
        for line in ("settings save", "calibration set rig.calibration", "exposure 5000"):
            self.assertRegex(board.type(line), r"OK$", line)
        kept = f"ls -A {STORE} | grep -v fill; cat {STORE}/calibration {STORE}/settings"
        before = board.shell(kept)
        self.assertEqual(before.count("vergence record"), 2, before)
        full = board.shell(f"dd if=/dev/urandom of={STORE}/fill bs=65536", FILL_LIMIT_S)
        self.assertIn("No space left", full)
        for line in ("settings save", "calibration set rig.calibration"):
            self.assertRegex(board.type(line), r"^ERR FULL [^\n]*no space left[^\n]*$", line)
        self.assertEqual(board.shell(kept), before)
        # The board starts with it.
        with contextlib.suppress(TimeoutError):
            board.shell("reboot -f", limit_s=2)
        board.wait("Starting kernel", BOOT_LIMIT_S)
        board.wait_prompt()
        self.assertEqual(board.shell(kept), before)
        self.assertRegex(board.type("bringup"), r"OK$")
        self.assertRegex(board.type("settings save"), r"^ERR FULL [^\n]*$")
        board.shell(f"rm {STORE}/fill")
        for line in ("settings save", "settings forget", "calibration forget"):
            self.assertRegex(board.type(line), r"OK$", line)

    def test_the_surface_is_the_pc_s_to_the_byte(self):
        board, folder = self.board, self.board.folder
        self.send_calibration()
        board.type("calibration set rig.calibration")
        self.assertRegex(board.type("capture scene"), r"OK$")
        self.assertRegex(board.type(" ".join(("reconstruct", "scene", *DEPTH))), r"OK$")
        self.vergence("fetch", "scene")
        self.vergence("fetch", "surface-scene-1")
        near, far = (word.split("=")[1] for word in DEPTH)
        self.on_host(VERGENCE, "reconstruct", "scene", "--near", near, "--far", far, "--out", "surface")
        for name in SURFACE:
            on_board, on_host = (BUILD_ID.sub(b"", (folder / where / name).read_bytes())
                                 for where in ("surface-scene-1", "surface"))
            self.assertEqual(zlib.crc32(on_board), zlib.crc32(on_host), name)
        self.assertGreater((folder / "surface" / "mesh.ply").stat().st_size, 100_000)
        # Files carry the day, which the board has from its battery-backed clock.
        day = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")
        self.assertIn(day, board.shell("date -u -r /var/lib/vergence/files/scene/session.index +%F"))

    def test_figures_of_the_boot(self):
        """Those that firmware/image/README.md publishes. No other test has used this daemon."""
        system = self.figures("/proc/meminfo")
        daemon = self.figures("/proc/$(pidof vergenced)/status")
        available, resident = (int(text.split()[0]) / 1024 for text in
                               (system["MemAvailable"], daemon["VmRSS"]))
        print(f"processor: U-Boot {self.u_boot_s:.2f} s, kernel to prompt {self.linux_s:.2f} s; "
              f"memory: {available:.1f} MiB available, daemon {resident:.1f} MiB")
        self.assertLess(self.u_boot_s, 2)
        self.assertLess(self.linux_s, 3)
        self.assertGreater(available, 44)
        self.assertLess(resident, 5)
        self.assertEqual(daemon["Seccomp"].strip(), "2")
        self.assertNotIn("0", daemon["Uid"].split())

    def figures(self, path):
        return dict(line.split(":", 1) for line in self.board.shell(f"cat {path}").splitlines())

    def assert_safe_after(self, command):
        """The servos rest. The rig's time, which only its board lets pass, has to go on without it."""
        for line in AIM[:2]:
            self.assertRegex(self.board.type(line), r"OK$", line)
        rig = self.board.folder / "rig.sock"
        self.assertEqual(self.servos_are_driven(rig), [True, True])
        begin_s = time.monotonic()
        self.board.shell(command)
        control = rig_client.Rig(f"unix:{rig}", rig_client.CONTROL)
        control.advance(control.now_us + SERVO_WATCHDOG_US)
        control.socket.close()
        self.assertEqual(self.servos_are_driven(rig), [False, False])
        return rig, begin_s

    def test_a_killed_daemon_is_back_at_once(self):
        rig, begin_s = self.assert_safe_after(KILL)
        self.assert_answers_again(begin_s)
        self.assertEqual(self.servos_are_driven(rig), [False, False])

    def test_a_stuck_daemon_is_started_again(self):
        """What has been measured is kept, as only the daemon starts again."""
        self.board.shell("echo result >/var/lib/vergence/files/kept")
        rig, begin_s = self.assert_safe_after(STOP)
        self.assert_answers_again(begin_s)
        self.assertEqual(self.servos_are_driven(rig), [False, False])
        self.assertEqual(self.board.shell("cd /var/lib/vergence/files && cat kept && rm kept"), "result")
        self.assertIn("supervise: the daemon is stuck", self.board.shell("dmesg"))

    def test_a_daemon_that_works_or_waits_is_not_taken_for_stuck(self):
        before = self.board.shell("cat /run/vergence.pid")
        self.board.type("bringup")
        self.board.type("window 640 480")
        self.board.type("selftest")
        self.assertEqual(self.board.shell("sleep 5; cat /run/vergence.pid"), before)

    def test_a_stuck_system_starts_again(self):
        """Where nothing is left that would start the daemon again, the watchdog resets the board."""
        self.assert_safe_after(STOP_ALL)
        self.assert_board_starts_again()


if __name__ == "__main__":
    unittest.main()

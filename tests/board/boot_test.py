# SPDX-License-Identifier: Apache-2.0
"""The image on the emulated board: boots over TFTP to the instrument's prompt, measures what the PC
measures to the byte, and comes back when the daemon is killed or stuck."""
import datetime
import re
import sys
import time
import unittest

from board_process import (AIM, BOOT_LIMIT_S, ROOT, SCENE, STOP, VERGENCE, SurfaceTest, child_of,
                           processor_s)

sys.path.insert(0, str(ROOT / "tools/system"))
import rig_client  # noqa: E402

# A store that is soon full.
SMALL_STORE = "mtdparts=0.flash:64m(boot),256k(environment),4m(image),4m(image2),2m(store)"
STORE = "/var/lib/vergence/store"
FILL_LIMIT_S = 60
# The bridge's own watchdog, with which the servos rest, has a second.
SERVO_WATCHDOG_US = 1_100_000


class Instrument(SurfaceTest):
    """One board for all of these."""

    @classmethod
    def setUpClass(cls):
        cls.begin(*SCENE, "--args", SMALL_STORE)
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
        return self.on_host(VERGENCE, "--connect", address[1], "--token", address[2], *words)

    def test_full_files_are_refused_before_the_work(self):
        board = self.board
        for line in (*AIM, "window 320 200"):
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

    def test_a_full_store_keeps_what_it_has(self):
        board = self.board
        board.type("token")
        self.take_pair("first", "320 200")
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
        board.restart()
        board.wait("Starting kernel", BOOT_LIMIT_S)
        board.wait_prompt()
        self.assertEqual(board.shell(kept), before)
        self.assertRegex(board.type("bringup"), r"OK$")
        self.assertRegex(board.type("settings save"), r"^ERR FULL [^\n]*$")
        board.shell(f"rm {STORE}/fill")
        for line in ("settings save", "settings forget", "calibration forget"):
            self.assertRegex(board.type(line), r"OK$", line)

    def test_the_surface_is_the_pc_s_to_the_byte(self):
        self.board.type("token")
        self.assert_surface_is_the_pc_s("320 200")
        # Files carry the day, which the board has from its battery-backed clock.
        day = datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d")
        self.assertIn(day, self.board.shell("date -u -r /var/lib/vergence/files/scene/session.index +%F"))

    def test_figures_of_the_boot(self):
        """Those that firmware/system/README.md publishes. No other test has used this daemon."""
        system = self.figures("/proc/meminfo")
        daemon = self.figures("/proc/$(pidof vergenced)/status")
        available, resident = (int(text.split()[0]) / 1024 for text in
                               (system["MemAvailable"], daemon["VmRSS"]))
        print(f"processor: U-Boot {self.u_boot_s:.2f} s, kernel to prompt {self.linux_s:.2f} s; "
              f"memory: {available:.1f} MiB available, daemon {resident:.1f} MiB")
        self.assertGreater(available, 44)
        self.assertLess(resident, 5)
        self.assertEqual(daemon["Seccomp"].strip(), "2")
        self.assertNotIn("0", daemon["Uid"].split())

    def figures(self, path):
        return dict(line.split(":", 1) for line in self.board.shell(f"cat {path}").splitlines())

    def test_a_stuck_daemon_is_started_again(self):
        """What has been measured is kept, as only the daemon starts again. The servos rest: the rig's time,
        which only its board lets pass, has to go on without it."""
        self.board.shell("echo result >/var/lib/vergence/files/kept")
        for line in AIM[:2]:
            self.assertRegex(self.board.type(line), r"OK$", line)
        rig = self.board.folder / "rig.sock"
        self.assertEqual(self.servos_are_driven(rig), [True, True])
        begin_s = time.monotonic()
        self.board.shell(STOP)
        control = rig_client.Rig(f"unix:{rig}", rig_client.CONTROL)
        control.advance(control.now_us + SERVO_WATCHDOG_US)
        control.socket.close()
        self.assertEqual(self.servos_are_driven(rig), [False, False])
        self.assert_answers_again(begin_s)
        self.assertEqual(self.servos_are_driven(rig), [False, False])
        self.assertEqual(self.board.shell("cd /var/lib/vergence/files && cat kept && rm kept"), "result")
        self.assertIn("supervise: the daemon is stuck", self.board.shell("dmesg"))

    def test_the_daemon_has_its_devices_and_no_others(self):
        shell = self.board.shell
        self.assertRegex(shell("ps"), r"(?m)^ *\d+ vergence .* /bin/vergenced ")
        self.assertIn(": serving", shell("dmesg"))
        self.assertEqual(shell("cat /proc/sys/vm/overcommit_memory"), "2")
        self.assertRegex(shell("df"), r"(?m)^files +24576 .* /var/lib/vergence/files$")
        listed = [line.split() for line in shell("ls -l /dev").splitlines()]
        owned = {words[-1] for words in listed if "vergence" in words}
        self.assertLessEqual({"ttyAMA0", "watchdog", "kmsg", "mtd2", "mtd3"}, owned)
        self.assertEqual({"ttyS0", "mem", "console", "null", "mtd0", "mtd1"} & owned, set())
        report = shell("vergenced --config /etc/vergence/vergenced.conf --check-board")
        rows = [line.split() for line in report.splitlines()]
        kernel = [row[0] for row in rows if row[1:2] == ["kernel"]]
        self.assertGreater(len(kernel), 10)
        self.assertEqual(set(kernel), {"there"}, report)

    def test_a_daemon_that_works_or_waits_is_not_taken_for_stuck(self):
        before = self.board.shell("cat /run/vergence.pid")
        self.board.type("bringup")
        self.board.type("window 640 480")
        self.board.type("selftest")
        self.assertEqual(self.board.shell("sleep 5; cat /run/vergence.pid"), before)


if __name__ == "__main__":
    unittest.main()

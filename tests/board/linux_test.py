# SPDX-License-Identifier: Apache-2.0
"""The daemon on Linux's own interfaces: i2c-dev, GPIO, a 16550, V4L2 and the watchdog of the image's kernel
in QEMU, all of one simulated rig. The same commands through `backend=sim`, here at another rig of the
same seed, must give the same: this rig is one without noise, so every pixel of a pair at rest."""
import contextlib
import json
import os
import signal
import subprocess
import time
import unittest

from board_process import (BOOT_LIMIT_S, COMMAND_LIMIT_S, KILL, STOP, STOP_ALL,
                           VERGENCE, BoardTest, child_of)
from waiting import wait_until

SIMRIG, VERGENCED = os.environ["SIMRIG"], os.environ["VERGENCED"]
RIG = ("--scene", "plane", "--rig", "perfect", "--seed", "11")
SAFE_LIMIT_S = 3
FULL_PAIR_LIMIT_MB = 16
PARTS = {"FPGA bridge", "left sensor", "right sensor", "left camera", "right camera", "left servo",
         "right servo", "left lens", "right lens", "bridge's reset line", "bridge's interrupt line"}


class LinuxTest(BoardTest):
    @classmethod
    def setUpClass(cls):
        # Where it is allowed, this comes before all else: the board's deadlines are in real time, but
        # for the rig's.
        with contextlib.suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, 0, -15)
        cls.place = cls.new_folder()
        for name in ("board", "host"):
            cls.launch(SIMRIG, *RIG, "--listen", f"unix:{cls.place}/{name}.sock")
        cls.files = cls.place / "files"
        cls.launch(VERGENCED, "profile=rig", "store=none", f"backend=sim unix:{cls.place}/host.sock",
                   f"socket={cls.place}/vergence.sock", f"files={cls.files}", f"log={cls.place}/log")
        wait_until((cls.place / "vergence.sock").exists, "the daemon's socket does not come")
        cls.begin("--linux", "--rig", f"unix:{cls.place}/board.sock")
        cls.addClassCleanup(cls.board.close)
        cls.board.wait_prompt()

    @classmethod
    def launch(cls, *words):
        child = subprocess.Popen(words, stdout=subprocess.PIPE)
        cls.addClassCleanup(child.stdout.close)
        cls.addClassCleanup(child.wait)
        cls.addClassCleanup(child.kill)
        if words[0] == SIMRIG:
            assert child.stdout.readline().startswith(b"listening")

    def result(self, text, command):
        answer = json.loads(text.splitlines()[-1])
        self.assertTrue(answer["ok"], f"{command}: {answer}")
        return answer["result"]

    def on_board(self, command):
        return self.result(self.board.shell(
            f"vergence --connect unix:/run/vergence/vergenced.sock --json {command}"), command)

    def on_host(self, command):
        done = subprocess.run([VERGENCE, "--connect", f"unix:{self.place}/vergence.sock", "--json",
                               *command.split()], capture_output=True, text=True,
                              timeout=COMMAND_LIMIT_S)
        return self.result(done.stdout, command)

    def both(self, command):
        """The result, which must be the same on both."""
        board, host = self.on_board(command), self.on_host(command)
        self.assertEqual(board, host, command)
        return board


def pairs(index):
    """The pairs of a session: the CRC of each frame, how it was taken, and where the axes were."""
    keys = [f"{side}_{key}" for side in ("left", "right")
            for key in ("frame", "size", "layout", "exposure_us", "gain_q3", "window", "after")]
    found = [dict(word.split("=", 1) for word in line.split()[1:-1])
             for line in index.splitlines() if line.startswith("pair ")]
    return [{key: pair[key] for key in keys} for pair in found]


class Linux(LinuxTest):
    def setUp(self):
        self.board.shell("dmesg -c >/dev/null")

    def edit_settings(self, sed_script):
        """Edits the daemon's settings and starts it again."""
        self.board.shell(f"sed -i '{sed_script}' /etc/vergence/vergenced.conf; kill $(pidof vergenced)")
        self.board.wait_prompt()

    def complaints(self):
        """What the daemon has logged since the test began."""
        return self.board.shell("dmesg | grep -E ' (warning|error): ' || true")

    def test_the_same_commands_give_the_same_pairs(self):
        parts = self.both("bringup")["parts"]
        self.assertEqual({part["part"]: part["state"] for part in parts},
                         dict.fromkeys(PARTS, "works"))
        self.both("record start r1")
        for command in ("bringup", "window 96 64", "exposure 6000", "gain 2 side=right",
                        "pan 3 right=-3", "zoom 320", "focus 540", "registers bridge id",
                        "registers right 0"):
            self.both(command)
        for run in (self.on_board, self.on_host):
            run("capture static=yes")
            run("pan 0")
            run("capture")
        self.both("record stop")
        board = pairs(self.board.shell("cat /var/lib/vergence/files/r1/session.index"))
        self.assertEqual(len(board), 2)
        self.assertEqual(board, pairs((self.files / "r1/session.index").read_text()))
        self.assertEqual(self.on_board("selftest")["picture"], "arrives bit for bit")
        self.assertEqual({part["state"] for part in self.on_board("health")["parts"]}, {"works"})
        self.assertEqual(self.complaints(), "")

    def test_a_full_size_pair_while_the_guests_time_stops(self):
        self.on_board("bringup")
        self.on_board("window 2048 1536")
        times = []
        for _ in range(2):
            times.append((float(self.board.shell("cat /proc/uptime").split()[0]), time.monotonic()))
            if len(times) == 1:
                pair = self.on_board("capture")
        self.assertEqual((pair["left"]["width"], pair["right"]["height"]), (2048, 1536))
        # The pair stays in the driver's two buffers.
        memory = self.on_board("system")["memory"]
        print(f"daemon {memory['daemon']} MiB")
        self.assertLess(memory["daemon"], FULL_PAIR_LIMIT_MB * 1e6 / 2 ** 20, memory)
        (guest_s, host_s), (guest_end_s, host_end_s) = times
        self.assertLess(guest_end_s - guest_s, (host_end_s - host_s) / 2)
        self.assertEqual(self.complaints(), "")

    def assert_safe_after(self, command):
        """The servos rest within the period of the bridge's own watchdog, whatever becomes of the
        daemon. Returns the time of the command."""
        rig = self.place / "board.sock"
        self.on_board("bringup")
        self.on_board("pan 3 right=-3")
        self.assertEqual(self.servos_are_driven(rig), [True, True])
        begin_s = time.monotonic()
        self.board.shell(command)
        while any(self.servos_are_driven(rig)):
            self.assertLess(time.monotonic() - begin_s, SAFE_LIMIT_S, "the servos still get pulses")
            time.sleep(0.05)
        print(f"{self.id()}: the servos rest after {time.monotonic() - begin_s:.1f} s")
        return begin_s

    def assert_servos_rest(self):
        self.assertEqual(self.servos_are_driven(self.place / "board.sock"), [False, False])

    def test_the_servos_are_safe_when_the_daemon_is_killed(self):
        self.assert_answers_again(self.assert_safe_after(KILL))
        self.assert_servos_rest()

    def test_the_servos_are_safe_while_the_daemon_is_stuck(self):
        self.assert_answers_again(self.assert_safe_after(STOP))
        self.assert_servos_rest()
        self.on_board("bringup")

    def test_the_servos_are_safe_while_all_is_stuck(self):
        self.assert_safe_after(STOP_ALL)
        self.assert_board_starts_again()
        self.assert_servos_rest()
        self.on_board("bringup")

    def test_a_board_that_is_reset_in_the_middle_of_a_frame(self):
        self.on_board("bringup")
        self.on_board("window 1024 768")
        self.board.send("capture\r")
        self.board.restart()
        self.board.wait("Starting kernel", BOOT_LIMIT_S)
        self.board.wait_prompt()
        self.on_board("bringup")
        self.on_board("window 96 64")
        self.assertEqual(self.on_board("capture")["left"]["width"], 96)

    def test_autofocus_finds_the_same_focus(self):
        for run in (self.on_board, self.on_host):
            run("bringup")
            run("window 96 64")
            run("exposure 6000")
            run("focus 560")
        board, host = (run("autofocus side=left")["left"] for run in (self.on_board, self.on_host))
        self.assertEqual((board["verdict"], host["verdict"]), ("focused", "focused"))
        self.assertAlmostEqual(board["position"], host["position"], delta=3)

    def test_the_longest_transfer_fits_into_the_bus(self):
        """Linux's driver would send only as many messages as its queue holds. QEMU's device asks for 4, but
        a queue of virtio-mmio is larger: 42 fit, all that Linux takes. The daemon's have at most 8."""
        reads = 21
        self.on_board("bringup")
        self.assertEqual(self.board.shell("i2ctransfer -y 0" + " w1@0x2c 0 r2@0x2c" * reads).split(),
                         ["0x5b", "0x1d"] * reads)

    def test_a_missing_device_is_reported_as_missing(self):
        self.assertIn("0x5b 0x1d", self.board.shell("i2ctransfer -y 0 w1@0x2c 0 r2"))
        # No device answers at the left sensor's address.
        self.addCleanup(self.edit_settings, "/sensor_address_left/d")
        self.edit_settings("$a rig.sensor_address_left = 0x50")
        answer = json.loads(self.board.shell("vergence --connect unix:/run/vergence/vergenced.sock "
                                             "--json bringup").splitlines()[-1])
        self.assertFalse(answer["ok"])
        self.assertRegex(answer["message"], "left sensor.*(answer|acknowledge)")


class Bench(BoardTest):
    def test_its_end_in_the_middle_of_a_transfer_ends_the_board(self):
        """The driver waits for ever, and so does the daemon."""
        board = self.start("--linux")
        board.wait_prompt()
        bench = child_of(board.process, "rig_bench.py")
        os.kill(bench, signal.SIGSTOP)
        board.send("bringup\r")
        board.wait("bringup", COMMAND_LIMIT_S)
        time.sleep(1)
        self.assertIsNone(board.process.poll())
        os.kill(bench, signal.SIGKILL)
        self.assertEqual(board.wait_end(), 1)
        self.assertEqual(board.report().splitlines()[-1],
                         "tools/board: the bench between board and rig ended: killed by signal 9")


if __name__ == "__main__":
    unittest.main()

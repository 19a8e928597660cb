# SPDX-License-Identifier: Apache-2.0
"""The whole instrument through Linux's interfaces: the shipped, confined daemon on /dev/i2c-1,
/dev/video0, /dev/ttyS1 and /dev/gpiochip0 of a fake kernel, backed by a simulated rig. Time
advances only while a thread waits, so every recorded hardware call can be repeated at another rig
of the same seed by the daemon's own client of such rigs, and must give the same result. Only times
are rounded, and what depends on fractions of a microsecond (the lamps' flicker, the servos' pulses)
changes a few pixels by one step."""
import os
import re
import subprocess
import unittest

import cv2
import numpy

from daemon_process import TIMEOUT_S, SIMRIG, VERGENCE
from fake_devices import DeviceTest

ASK_AGAIN = os.environ.get("VERGENCE_ASK_AGAIN", "")
# Offset of the fake kernel's clock (tests/fake_kernel/fake_rig.h).
BEGIN_US = 10 ** 15
ROUNDED_US = 2
RESET_LINE, IRQ_LINE = 3, 5
FRAME = re.compile(r"camera0 take _ = 0 frame-([0-9a-f]{8})")
# A camera's registers in the bridge. All but SHORT_LINES, SHORT_FRAMES and FLAGS count the frames
# that passed: a driver takes all frames, the client of simulated rigs only requested ones.
COUNTS = re.compile(r"(2c w (?:30|38) 2c r 18 = 0 21) \w{20}(\w{12})\w{4}$")

# Start of the last frames, requested or not, and the bridge's own time.
TIMES = re.compile(r"(2c w (?:44|4a) 2c r \d+ = 0 \d+) \w+$")


def parts_of(call):
    """Splits a call into parts that must be equal, and its times, which may differ by rounding."""
    call = COUNTS.sub(r"\1 \2", call)
    call = TIMES.sub(r"\1", call)
    # Without unrequested frames and empty polls.
    call = re.sub(r"^(camera0 counts = \d+ \d+) \d+ \d+", r"\1", call)
    # Without the frame's not-before time and number.
    call = re.sub(r"^(camera0 take) \d+ (\d+)", r"\1 \2", call)
    call = re.sub(r"^(camera0 take .* = 0 \w+ \S+ \d+ \d+) \d+", r"\1", call)
    call = re.sub(r"^(camera0 take .* = 0) (\w+)", r"\1 frame-\2", call)
    times = []
    if call.startswith(("clock", "camera0 take", "i2c", "uart")):
        call = re.sub(r"(?<= )\d{3,15}(?= |$)", lambda m: times.append(int(m[0])) or "_", call,
                      count=3 if call.startswith("camera0") else 1)
    return call, times


class Board(DeviceTest):
    def setUp(self):
        if not SIMRIG:
            self.skipTest("the simulated rig needs -DVERGENCE_FPGA=ON")
        super().setUp()

    def simulate(self, name):
        """Starts a simulated rig; returns its address."""
        path = self.place(name)
        rig = subprocess.Popen([SIMRIG, "--scene", "plane", "--seed", "11", "--listen",
                                f"unix:{path}"], stdout=subprocess.DEVNULL)
        self.addCleanup(self.end, rig)
        self.wait_for(path)
        return f"unix:{path}"

    def serve_board(self, *lines):
        """Starts the daemon on the devices of a board that drives a simulated rig. Frames are
        small, as each sensor row takes time to simulate."""
        os.environ["VERGENCE_MEMINFO"] = self.place("meminfo")
        self.addCleanup(os.environ.pop, "VERGENCE_MEMINFO")
        self.state(1 << 40)
        script = [f"rig {self.simulate('board.sock')}", "rig i2c /dev/i2c-1",
                  "rig video /dev/video0", "rig serial /dev/ttyS1",
                  f"rig gpio /dev/gpiochip0 {RESET_LINE} {IRQ_LINE}", *lines]
        self.serve("\n".join(script) + "\n", "profile=rig", "rig.width=160px",
                   "rig.height=120px", f"reset_line={RESET_LINE}", f"irq_line={IRQ_LINE}")

    def state(self, free_bytes):
        """States the memory that is free."""
        with open(self.place("meminfo"), "w", encoding="ascii") as file:
            file.write(f"MemAvailable: {free_bytes // 1024} kB\n")

    def calls(self, name):
        """The recorded calls, with the rig's own times."""
        with open(os.path.join(self.files, name, "calls.log"), encoding="ascii") as file:
            lines = file.read().splitlines()
        self.assertTrue(lines[1].startswith("ports i2c=1 lines=0 gpio=1 uart=1 cameras=1 "))
        # Without the time at which a call returned.
        return [re.sub(r"\b10{6}\d{9}\b", lambda m: str(int(m[0]) - BEGIN_US),
                       line.split(" ", 1)[1]) for line in lines[2:] if line[0].isdigit()]

    def ask_again(self, calls, name):
        """Repeats the calls at another rig."""
        subprocess.run([ASK_AGAIN, self.simulate("other.sock"), os.path.join(self.files, name)],
                       input="\n".join(calls) + "\n", text=True, check=True, timeout=TIMEOUT_S)
        return self.calls(name)


class Everything(Board):
    def test_all_that_comes_is_what_the_rig_gave(self):
        self.plug("plug")
        self.serve_board(f"plug /dev/gpiochip0 {self.place('plug')}")
        # Unplugged and plugged in while unused: one bring-up must suffice.
        self.plug("plug", False)
        self.plug("plug")
        self.asked("record start r1")
        parts = self.asked("bringup")["parts"]
        self.assertEqual({part["state"] for part in parts}, {"works"})
        self.assertIn("bridge's interrupt line", [part["part"] for part in parts])
        self.use()
        self.assertEqual(self.asked("record stop")["pairs"], 2)
        self.assertNotRegex(self.output_text(), "warning|error")
        done = subprocess.run([VERGENCE, "replay", os.path.join(self.files, "r1")],
                              capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertIn("r1: identical: ", done.stdout + done.stderr)
        calls = self.calls("r1")
        again = self.ask_again(calls, "again")
        slack_us = ROUNDED_US
        for call, other in zip(calls, again):
            # Each transfer ends at a whole microsecond here, so the two rigs drift apart until both
            # wait for the same time.
            slack_us += call.startswith("i2c transfer")
            slack_us = ROUNDED_US if call.startswith("clock wait") else slack_us
            self.compare(call, other, slack_us)
        self.assertEqual(len(calls), len(again))
        kinds = [" ".join(call.split()[:2]) for call in calls]
        for kind, minimum in (("i2c transfer", 300), ("uart read", 20), ("camera0 take", 9),
                            ("gpio set", 1), ("gpio get", 2)):
            self.assertGreaterEqual(kinds.count(kind), minimum, kind)

    def compare(self, call, other, slack_us):
        (reported, times), (expected, expected_times) = parts_of(call), parts_of(other)
        taken = [FRAME.match(part) for part in (reported, expected)]
        if all(taken) and taken[0][1] != taken[1][1]:
            pixels, expected_pixels = (
                cv2.imread(os.path.join(self.files, name, f"frame-{take[1]}.pnm"),
                           cv2.IMREAD_UNCHANGED).astype(int)
                for name, take in zip(("r1", "again"), taken))
            self.assertLessEqual(numpy.abs(pixels - expected_pixels).max(), 1)
            self.assertLess((pixels != expected_pixels).mean(), 0.01)
            reported = expected = FRAME.sub("", reported)
        self.assertEqual(reported, expected, f"{call} / {other}")
        if taken[0]:
            _, _, not_before_us, *_, begin_us, _ = call.split()
            self.assertGreaterEqual(int(begin_us), int(not_before_us))
        for time_us, expected_us in zip(times, expected_times):
            self.assertLessEqual(abs(time_us - expected_us), slack_us, f"{call} / {other}")

    def use(self):
        """The main use of the instrument."""
        for axis, position in (("zoom", 320), ("focus", 540), ("iris", 800)):
            for side in self.asked(f"{axis} {position}").values():
                self.assertAlmostEqual(side["position"], position, delta=6)
        self.assertAlmostEqual(self.asked("exposure 6000")["left"], 6000, delta=60)
        self.assertEqual(self.asked("gain 2 side=right"), {"right": 2})
        self.assertEqual(self.asked("window 96 64")["width"], 96)
        pair = self.asked("capture static=yes")
        self.assertEqual((pair["left"]["width"], pair["right"]["gain"]), (96, 2))
        self.asked("wait 0.1")  # all registers were read: see the drift above
        self.assertEqual(self.asked("registers bridge id"), {"id": "0x5B1D"})
        self.assertEqual(self.asked("registers right 0"), {"chip_version": "0x1621"})
        health = self.asked("health")
        self.assertEqual({part["state"] for part in health["parts"]}, {"works"})
        self.assertEqual(self.asked("selftest")["picture"], "arrives bit for bit")
        self.assertAlmostEqual(self.asked("pan 3 right=-3")["left"], 3, delta=0.01)
        self.asked("capture")
        self.assertEqual(self.asked("safe")["state"], "safe")


class Memory(Board):
    def test_pairs_in_the_drivers_buffers_need_no_other_memory(self):
        self.serve_board()
        self.asked("bringup")
        self.assertEqual(self.asked("system")["memory"]["driver_buffers"], 4)
        self.state((1 << 20) + 50_000)  # the reserve, and one frame, which the fake kernel makes
        for line in ("capture", "capture", "capture static=yes"):
            self.asked(line)
        self.assertNotRegex(self.output_text(), "warning|error")


if __name__ == "__main__":
    unittest.main()

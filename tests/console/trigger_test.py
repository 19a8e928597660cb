# SPDX-License-Identifier: Apache-2.0
"""Two cameras with an external trigger, through the confined daemon on a fake kernel: one GPIO line
exposes both at once."""
import os
import time
import unittest

from fake_devices import DeviceTest

LINE = 4
SETTINGS = ("profile=two-cameras", "rig.trigger=yes", f"trigger_line={LINE}")
NO_FRAME = ("ERR TIMEOUT {} camera: no frame after the trigger pulse (set it to external "
            "trigger; check its wire and trigger_line)")


class Trigger(DeviceTest):
    def triggered(self, *more, wires=(LINE, LINE)):
        """The devices: cameras with trigger inputs on these lines of the chip (None: not
        connected)."""
        lines = [f"trigger /dev/video{side} {'' if wire is None else wire}"
                 for side, wire in enumerate(wires)]
        return "\n".join([self.cameras() + "gpio /dev/gpiochip0", *lines, *more,
                          f"record {self.place('calls')}", ""])

    def calls(self, text):
        with open(self.place("calls"), encoding="ascii") as file:
            return [line.strip() for line in file if text in line]

    def levels(self):
        return [call.rsplit(" ", 1)[1] for call in self.calls("SET_VALUES")]

    def parts(self):
        return {part["part"]: part["state"] for part in self.asked("health")["parts"]}

    def test_one_pulse_a_pair_and_no_time_between(self):
        # The drivers stamp the last pixel, and the readout is shorter than the reported frame
        # interval.
        self.serve(self.triggered("set /dev/video0 readout_us 30000",
                                  "set /dev/video1 readout_us 30000"), *SETTINGS)
        self.assertEqual(self.asked("bringup")["state"], "ready")
        for _ in range(3):
            before = len(self.levels())
            skew_ms = self.asked("capture")["skew"] / 1000
            self.assertLess(abs(skew_ms), 3)
            self.assertEqual(self.levels()[before:], ["1", "0"])
        self.assertEqual(self.parts(), dict.fromkeys(("left camera", "right camera",
                                                      "trigger line"), "works"))
        self.asked("selftest")
        # The left one again, to check that the scene does not move.
        self.assertEqual(self.asked("capture static=yes")["change"], 0)
        # A view compares nothing, and pulses for each camera.
        before = len(self.levels())
        self.asked("view")
        self.assertEqual(self.levels()[before:], ["1", "0", "1", "0"])

    def test_a_long_pause_is_not_a_broken_stream(self):
        self.serve(self.triggered(), *SETTINGS)
        self.asked("bringup")
        self.asked("capture")
        self.asked("wait 2.5")
        self.asked("capture")
        self.assertEqual([self.asked("health")[side]["restarts"] for side in ("left", "right")],
                         [0, 0])

    def test_without_the_pulse_nothing_comes(self):
        self.serve(self.triggered(wires=(LINE, None)), *SETTINGS)
        began = time.monotonic()
        self.refused("bringup", NO_FRAME.format("right"))
        self.assertLess(time.monotonic() - began, 4)
        self.assertEqual(self.asked("status")["state"], "safe")
        self.assertEqual(self.levels()[-1], "0")

    def test_a_chip_that_is_not_there(self):
        self.serve(self.cameras(), *SETTINGS)
        self.assertIn("trigger line: gpio_chip = /dev/gpiochip0: line 4 of /dev/gpiochip0 for the "
                      "cameras' trigger: No such file", self.first.ask("bringup")[-1])

    def test_what_was_recorded_plays_again(self):
        self.serve(self.triggered(), *SETTINGS)
        self.asked("record start r1")
        for command in ("bringup", "capture", "capture static=yes"):
            self.asked(command)
        self.assertEqual(self.asked("record stop")["pairs"], 2)
        with open(os.path.join(self.files, "r1", "calls.log"), "rb") as file:
            self.assertIn(b"gpio set 3 1", file.read())
        self.assertEqual(self.asked("replay r1")["same"], "yes")


if __name__ == "__main__":
    unittest.main()

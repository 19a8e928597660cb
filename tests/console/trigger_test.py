# SPDX-License-Identifier: Apache-2.0
"""Two cameras with an external trigger, through the confined daemon on a fake kernel: one GPIO line
exposes both at once."""
import os
import time
import unittest

from fake_devices import DeviceTest
from waiting import wait_until

LINE = 4
SETTINGS = ("profile=two-cameras", "rig.trigger=yes", f"trigger_line={LINE}")
NO_FRAME = ("ERR TIMEOUT {} camera: no frame after the trigger pulse (set it to external "
            "trigger; check its wire and trigger_line)")
NOT_DRIVEN = ("ERR {} trigger line: it cannot be driven (check the chip's name and its "
              "permissions)")


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

    def test_a_wire_that_comes_off(self):
        # The settings name another line than the cameras'.
        self.serve(self.triggered(), *SETTINGS[:-1], f"trigger_line={LINE + 1}")
        self.refused("bringup", NO_FRAME.format("left"))

    def test_a_free_running_camera_is_reported(self):
        self.serve(self.triggered().replace(f"trigger /dev/video1 {LINE}\n", ""), *SETTINGS)
        self.refused("bringup", "ERR VERIFY right camera: it sends frames without a trigger "
                     "pulse (set it to external trigger, or rig.trigger = no)")

    def test_lost_and_damaged_frames_are_taken_again(self):
        self.serve(self.triggered("set /dev/video0 damage_every 4", "set /dev/video1 lose_every 5"),
                   *SETTINGS)
        self.asked("bringup")
        for _ in range(5):
            self.assertLess(abs(self.asked("capture")["skew"]), 3000)
        health = self.asked("health")
        self.assertGreater(health["left"]["faulty"], 0)
        self.assertGreater(health["right"]["gaps"], 0)

    def test_frames_that_begin_apart_are_refused(self):
        self.serve(self.triggered("set /dev/video0 readout_us 20000"), *SETTINGS)
        self.asked("bringup")
        self.assertRegex(self.first.ask("capture")[-1], "^ERR MOVED right camera: its frame began "
                         r"(7|8)\d ms from the left one.* 50 ms")
        self.assertEqual(self.asked("status")["state"], "ready")

    def test_a_line_that_cannot_be_driven_once(self):
        self.serve(self.triggered(), *SETTINGS, "faults=gpio.set@1=io")
        self.refused("bringup", NOT_DRIVEN.format("IO"))
        self.assertEqual(self.asked("status")["state"], "safe")
        self.asked("bringup")
        self.asked("capture")

    def test_a_line_that_cannot_be_driven_any_more(self):
        self.serve(self.triggered(), *SETTINGS, "faults=gpio.set@4+=device")
        self.asked("bringup")
        self.refused("capture", NOT_DRIVEN.format("DEVICE"))
        self.assertEqual(self.asked("status")["state"], "safe")

    def test_a_chip_that_is_not_there(self):
        self.serve(self.cameras(), *SETTINGS)
        self.assertIn("trigger line: gpio_chip = /dev/gpiochip0: line 4 of /dev/gpiochip0 for the "
                      "cameras' trigger: No such file", self.first.ask("bringup")[-1])

    def test_cancelled_and_ended_it_is_at_rest(self):
        self.serve(self.triggered(), *SETTINGS, "rig.trigger_pulse=1s")
        self.first.send("bringup\n")
        wait_until(lambda: self.levels()[-1:] == ["1"])
        self.first.send("\x03")
        self.assertEqual(self.first.answer()[-1][:13], "ERR CANCELLED")
        self.assertEqual(self.levels()[-1], "0")

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

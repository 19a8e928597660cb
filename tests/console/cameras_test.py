# SPDX-License-Identifier: Apache-2.0
"""Two webcams, with and without a lens, through the confined daemon on a fake kernel."""
import glob
import json
import os
import shutil
import subprocess
import time
import unittest

import cv2

from daemon_process import TIMEOUT_S, VERGENCED
from fake_devices import FRAME_US, DeviceTest, LensController, show, texture

NOT_THERE = "No such file or directory; check that it is connected and its driver is loaded"
WORKS = [{"part": "left camera", "state": "works"}, {"part": "right camera", "state": "works"}]


class TwoCameras(DeviceTest):
    profile = "profile=two-cameras"

    def frames_of(self, session):
        """The files of a session's frames, whose names are the CRC of what is in them."""
        pattern = os.path.join(self.files, session, "frame-*")
        return sorted(os.path.basename(path) for path in glob.glob(pattern))

    def play(self, session, script, *settings):
        done = subprocess.run(
            [VERGENCED, f"backend=replay {os.path.join(self.files, session)}", self.profile,
             "socket=none", f"files={self.files}", "store=none", "console=stdio", "confine=no",
             *settings], input=script, text=True, capture_output=True, timeout=TIMEOUT_S)
        self.assertEqual(done.stdout.count("OK\n"), script.count("\n"), done.stdout + done.stderr)

    def test_from_the_bring_up_to_a_pair(self):
        self.serve(self.cameras(), self.profile)
        self.assertNotIn("confine", self.output_text())
        self.assertEqual(self.asked("bringup"), {"state": "ready", "parts": WORKS})
        for side in ("left", "right"):
            for control in ("exposure", "focus", "white balance"):
                self.assert_logged(f"{side} camera: its automatic {control} is now off")
        status = self.asked("status")
        self.assertEqual((status["window"], status["pairs"]), ({"width": 640, "height": 480}, 0))
        self.assertNotIn("exposure", status["left"])
        self.assertEqual(self.asked("exposure"), {"left": "not set", "right": "not set"})
        self.assertEqual(self.first.ask("gain"), ["left: not set", "right: not set", "OK"])
        # Units of 100 us, from 1 to 5000 of them.
        self.assertEqual(self.asked("exposure 5040"), {"left": 5000, "right": 5000})
        # 256 steps from 1 to 128, rounded to the nearest.
        self.assertEqual(self.asked("gain 1.3 side=left"), {"left": 1.5})
        self.assertEqual(self.asked("gain 2 side=left"), {"left": 2})
        self.assertEqual(self.asked("gain side=right"), {"right": "not set"})
        # Controls of 50 steps; autofocus left them at the tenth.
        self.assertEqual(self.asked("focus")["right"], {"position": 10, "min": 0, "max": 50})
        self.assertEqual(self.asked("focus 37 side=left")["left"]["position"], 37)
        self.assertEqual(self.asked("focus infinity side=left")["left"]["position"], 0)
        self.refused("focus 51", "ERR RANGE focus: POSITION 51", "left camera", "0 to 50 steps")
        self.refused("focus 2000 mm", "ERR MISSING focus: POSITION 2000", "use steps")
        # Pictures that do not change with the focus, which returns to where it was.
        self.asked("focus 20")
        self.assertIn(self.first.ask_json("autofocus side=left")["result"]["left"]["verdict"],
                      ("sharp everywhere", "no contrast"))
        self.assertEqual(self.asked("focus")["left"]["position"], 20)
        self.refused("exposure 600000", "ERR RANGE left camera: ", "600000 us", "500000 us")
        self.assertEqual(self.asked("status")["right"], {"exposure": 5000})
        pair = self.captured("capture one static=yes")
        self.assertLess(abs(pair["skew"]), FRAME_US / 2)
        self.assertEqual((pair["change"], pair["left"]["gain"]), (0, 2))
        self.assertEqual(len(self.frames_of("one")), 2)
        health = self.asked("health")
        self.assertEqual([part["state"] for part in health["parts"]], ["works", "works"])
        self.assertGreater(health["left"]["frames"], 3)
        self.assertEqual(health["right"]["restarts"], 0)
        self.asked("selftest")
        report = self.asked("bugreport")
        with open(os.path.join(self.files, report["file"]), encoding="utf-8") as file:
            text = file.read()
        for part in ("driver: fake", "card: Fake camera", "width: 640 px", "height: 480 px"):
            self.assertEqual(text.count(" " + part), 2 + (part in ("width: 640 px", "height: 480 px")),
                             part)
        self.assertRegex(text, "format: [A-Z]+")

    def test_features_webcams_do_not_have_are_rejected(self):
        self.serve(self.cameras(), self.profile)
        self.asked("bringup")
        for command, line in (
                ("pan 1", "servo"), ("zoom 400", "lens on the left"), ("registers left", "bridge")):
            self.assertRegex(self.first.ask(command)[-1], f"^ERR NOT_CONNECTED .*{line}")
        answer = self.first.ask("window 320 240")
        self.assertEqual(len(answer), 1)
        self.assertRegex(answer[0], "^ERR UNSUPPORTED left camera: left_camera = /dev/video0: .*"
                         "320 x 240.* nearest .*640 x 480")
        self.assertRegex(self.first.ask("window 640 480 skip=2")[-1],
                         "^ERR UNSUPPORTED window: .*without a bridge.* skip")
        # A rejected request is not an error of a part.
        health = self.asked("health")
        self.assertNotIn("error", health)
        self.assertEqual([part["failures"] for part in health["parts"]], [0, 0])
        self.captured()

    def test_what_was_recorded_plays_again(self):
        self.serve(self.cameras(), self.profile)
        self.asked("record start r1")
        for command in ("bringup", "exposure 8000", "capture"):
            self.asked(command)
        for side, picture in enumerate(self.pictures):
            show(picture, texture(7 + side))
        # The new image may arrive between the two looks of one capture.
        self.captured("capture static=yes")
        self.assertEqual(self.asked("record stop")["pairs"], 2)
        self.assertEqual(self.asked("replay r1")["same"], "yes")
        self.captured("capture alone")
        script = "\n".join(["bringup", "exposure 8000", "capture p1"]) + "\n"
        self.play("r1", script)
        self.play("alone", "bringup\ncapture p2\n")
        self.assertEqual(self.frames_of("p2"), self.frames_of("alone"))
        played = self.frames_of("p1")
        self.assertEqual(len(played), 2)
        self.assertTrue(set(played) <= set(self.frames_of("r1")))
        self.assertFalse(set(played) & set(self.frames_of("alone")))

    def test_a_camera_is_pulled_out_and_put_back(self):
        self.plug("plug")
        self.serve(self.cameras() + f"plug /dev/video1 {self.place('plug')}\n", self.profile)
        self.asked("bringup")
        self.captured()
        self.plug("plug", False)
        gone = "ERR DEVICE right camera: it is gone (check its plug, then run bringup)"
        self.refused("capture", gone)
        self.assertEqual(self.asked("status")["state"], "safe")
        self.assertEqual(self.first.ask("health")[-1], gone)
        self.refused("bringup", f"ERR DEVICE right camera: right_camera = /dev/video1: {NOT_THERE}")
        self.plug("plug")
        self.assertEqual(self.asked("bringup")["parts"], WORKS)
        self.captured()
        # Unplugged and plugged in while unused.
        self.plug("plug", False)
        self.plug("plug")
        self.assertEqual(self.asked("bringup")["parts"], WORKS)
        self.captured()

    def test_a_camera_that_goes_while_a_surface_is_computed(self):
        self.plug("plug")
        self.serve(self.cameras() + f"plug /dev/video1 {self.place('plug')}\n", self.profile)
        self.asked("bringup")
        shutil.copytree(os.path.join(os.environ["VERGENCE_SESSIONS"], "cylinder_1x"),
                        os.path.join(self.files, "cylinder"))
        other = self.client()
        other.send("@json,progress reconstruct cylinder pair=1\n")
        event = json.loads(other.line())
        self.assertEqual(event["event"], "progress")
        self.plug("plug", False)
        self.refused("capture", "ERR DEVICE right camera: ", "plug", "bringup")
        self.assertEqual(self.asked("status")["state"], "safe")
        while "event" in event:
            event = json.loads(other.line())
        self.assertTrue(event["ok"], event)

    def test_damaged_and_lost_frames_are_not_used(self):
        self.serve(self.cameras() + "set /dev/video0 damage_every 3\n"
                   "set /dev/video1 lose_every 3\n", self.profile)
        self.asked("bringup")
        for _ in range(3):
            self.assertLess(abs(self.captured()["skew"]), 50000)
        health = self.asked("health")
        self.assertGreater(health["left"]["faulty"], 0)
        self.assertGreater(health["right"]["gaps"], 0)

    def test_a_stream_that_breaks_goes_on(self):
        self.serve(self.cameras() + "fail 30 1 EIO video0 ioctl DQBUF\n", self.profile)
        self.asked("bringup")
        for _ in range(30):  # each frame needs at least one call
            self.captured()
            if self.asked("health")["left"]["restarts"] > 0:
                break
        self.captured()
        self.assertEqual(self.asked("health")["left"]["restarts"], 1)
        self.assert_logged("camera /dev/video0: DQBUF: Input/output error; restarting the stream")

    def test_slow_to_start_and_jpeg(self):
        for side, picture in enumerate(self.pictures):
            good, data = cv2.imencode(".jpg", texture(side))
            self.assertTrue(good)
            with open(picture, "wb") as file:
                file.write(data.tobytes())
        self.serve("".join(f"video /dev/video{side} MJPEG {picture} {FRAME_US} 640x480\n"
                           f"set /dev/video{side} first_us 1300000\n"
                           for side, picture in enumerate(self.pictures)), self.profile)
        self.asked("bringup")
        self.assertEqual(self.captured("capture one")["left"]["width"], 640)
        with open(os.path.join(self.files, "one", self.frames_of("one")[0]), "rb") as file:
            self.assertEqual(file.read(2), b"P6")

    def test_a_camera_in_use_by_another_program(self):
        self.serve(self.cameras() + "fail 1 3 EBUSY video1 ioctl S_FMT\n", self.profile)
        for _ in range(3):
            self.assertRegex(self.first.ask("bringup")[-1], "^ERR IO right camera: "
                             "right_camera = /dev/video1: in use by another program")
        self.assertEqual(self.asked("bringup")["parts"], WORKS)

    def test_frames_that_are_far_apart_are_refused(self):
        # Whatever the phase, frames every 300 ms that begin together are 150 ms apart here.
        self.serve(self.cameras(300000) + "set /dev/video0 phase_us 0\n"
                   "set /dev/video1 phase_us 150000\n", self.profile)
        self.asked("bringup")
        answer = self.first.ask("capture")[-1]
        self.assertRegex(answer, r"^ERR MOVED right camera: .* 1[45]\d ms .*50 ms.*skew_limit")


class TwoCamerasInLight(DeviceTest):
    """Pictures as bright as their files at an exposure of so many 100 us and the least gain."""
    settings_before = ("exposure 1000", "gain 2")

    def serve_in_light(self, *bright_at):
        lights = "".join(f"set /dev/video{side} bright_at {value}\n"
                         for side, value in enumerate(bright_at))
        self.serve(self.cameras() + lights, "profile=two-cameras")
        for command in ("bringup", *self.settings_before):
            self.asked(command)

    def test_exposure_and_gain_are_found(self):
        # The right camera has half the light.
        self.serve_in_light(200, 400)
        found = self.asked("autoexpose")
        for side in ("left", "right"):
            self.assertAlmostEqual(found[side]["mean"], 50, delta=2.5)
            self.assertLessEqual(found[side]["steps"], 8)
            self.assertEqual(found[side]["limit"], "target")
        self.assertLess(abs(found["difference"]), 2)
        light = [found[side]["exposure"] * found[side]["gain"] for side in ("left", "right")]
        self.assertGreater(light[1], 1.3 * light[0])
        self.assertEqual(self.asked("exposure"),
                         {side: found[side]["exposure"] for side in ("left", "right")})
        gains = self.asked("gain")
        self.assertEqual(gains, {side: found[side]["gain"] for side in ("left", "right")})
        # In a part of the picture of one camera; the other one stays.
        after = self.asked("autoexpose side=left target=30 region=64,64,64,64")
        self.assertAlmostEqual(after["left"]["mean"], 30, delta=2)
        self.assertEqual(self.asked("gain")["right"], gains["right"])
        self.captured()

    def assert_refused(self, *words):
        before = self.asked("exposure"), self.asked("gain")
        self.refused("autoexpose", "ERR RANGE left camera: ", *words)
        self.assertEqual((self.asked("exposure"), self.asked("gain")), before)
        self.assertEqual(self.asked("status")["state"], "ready")
        self.captured()


class TwoCamerasAndLenses(DeviceTest):
    def setUp(self):
        super().setUp()
        self.lens_path = self.place("tty")
        self.lens = LensController(self.lens_path)
        self.addCleanup(lambda: self.lens.pull_out())

    def test_a_lens_is_moved_pulled_out_and_put_back(self):
        self.serve(self.cameras(), "profile=two-cameras-lens", f"lens_uart={self.lens_path}")
        self.assertEqual(self.asked("bringup")["state"], "ready")
        self.assertAlmostEqual(self.asked("zoom 400")["right"]["position"], 400, delta=4)
        self.assertEqual(self.lens.positions[1][0], 400)
        self.captured()
        self.lens.pull_out()
        self.assertEqual(self.first.ask("focus 450")[-1][:14], "ERR DEVICE lef")
        self.refused("bringup", f"ERR DEVICE left lens: lens_uart = {self.lens_path}: {NOT_THERE}")
        self.lens = LensController(self.lens_path)
        self.assertEqual(self.asked("bringup")["state"], "ready")
        self.assertAlmostEqual(self.asked("focus 450 side=left")["left"]["position"], 450, delta=4)


class OneLens(DeviceTest):
    def test_a_v1lc_that_takes_its_seven_seconds(self):
        lens = LensController(self.place("tty"), counts_per_s=20)
        self.addCleanup(lens.pull_out)
        self.serve(self.cameras(), "profile=two-cameras-lens", "rig.lenses=v1lc",
                   f"lens_uart={lens.path}")
        self.assertEqual(self.asked("bringup")["state"], "ready")
        began = time.monotonic()
        self.assertAlmostEqual(self.asked("zoom 178 side=left")["left"]["position"], 178, delta=2)
        self.assertGreater(time.monotonic() - began, (178 - 50) / 20 - 0.5)
        self.assertRegex(self.first.ask("zoom 200 side=left")[-1],
                         "^ERR RANGE zoom: POSITION 200 .*left lens.*44 to 180 counts")
        self.assertRegex(self.first.ask("zoom 100 side=right")[-1],
                         "^ERR NOT_CONNECTED .*lens on the right")
        self.captured()


class FullRig(DeviceTest):
    def test_all_that_is_missing_is_listed(self):
        lens = self.place("none")
        self.serve("", "profile=rig", "reset_line=3", f"lens_uart={lens}")
        answer = self.first.ask_json("bringup")
        whys = {part["part"]: part["why"] for part in answer["result"]["parts"]}
        self.assertEqual(whys.pop("bridge's reset line")[:46],
                         "gpio_chip = /dev/gpiochip0: line 3 of /dev/gpi")
        missing = {"FPGA bridge": f"i2c = /dev/i2c-1: {NOT_THERE}",
                   "left camera": f"left_camera = /dev/video0: {NOT_THERE}",
                   "left lens": f"lens_uart = {lens}: {NOT_THERE}",
                   "right lens": f"lens_uart = {lens}: {NOT_THERE}"}
        self.assertEqual(whys, missing)
        self.assert_logged(f"left camera: left_camera = /dev/video0: {NOT_THERE}\n")
        bridge = [line for line in self.first.ask("bringup") if "- part FPGA bridge" in line]
        self.assertEqual(len(bridge), 1)
        self.assertIn(f"why i2c = /dev/i2c-1: {NOT_THERE}", bridge[0])

    def test_what_is_missing_has_its_setting(self):
        self.serve("i2c /dev/i2c-1 0x10\n" + self.cameras(), "profile=rig", "i2c=/dev/i2c-7",
                   "reset_line=3", f"lens_uart={self.place('none')}")
        self.assert_logged(f"i2c = /dev/i2c-7: {NOT_THERE}\n")
        self.assert_logged("gpio_chip = /dev/gpiochip0: line 3 of /dev/gpiochip0 for the bridge's reset: "
                         "No such file or directory; no such GPIO chip")
        answer = self.first.ask_json("bringup")
        self.assertIn("bridge's reset line: gpio_chip = /dev/gpiochip0: line 3", answer["message"])
        self.assertEqual(answer["result"]["state"], "safe")
        self.assert_logged(f"left lens: lens_uart = {self.place('none')}: {NOT_THERE}")

    def test_something_else_in_the_place_of_the_bridge(self):
        self.plug("plug")
        self.serve("i2c /dev/i2c-1 0x2C\n" + self.cameras() +
                   f"plug /dev/i2c-1 {self.place('plug')}\n", "profile=rig",
                   f"lens_uart={self.place('none')}")
        self.refused("bringup", "ERR DEVICE FPGA bridge: missing, or another device responds at "
                     "its address (check what is connected)")
        self.plug("plug", False)
        self.refused("bringup", f"ERR DEVICE FPGA bridge: i2c = /dev/i2c-1: {NOT_THERE}")
        self.plug("plug")
        self.refused("bringup", "ERR DEVICE FPGA bridge: missing, or another device responds at "
                     "its address (check what is connected)")


if __name__ == "__main__":
    unittest.main()

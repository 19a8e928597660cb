# SPDX-License-Identifier: Apache-2.0
"""Pairs merged from several exposures: what they report and record, what refuses them, and that the
exposure is afterwards what it was before."""
import json
import os
import re
import subprocess
import unittest

from daemon_process import TIMEOUT_S, VERGENCED, DaemonTest

CONTROL = os.path.join(os.environ["VERGENCE_SOURCE"], "tools/simrig/control")
LEAD = ("bringup", "window 64 48", "exposure 10000")


class Merge(DaemonTest):
    def setUp(self):
        self.first = self.client()
        self.addCleanup(self.first.ask, "record stop")
        self.addCleanup(self.control, "light 1")
        for command in LEAD:
            self.asked(command)
        self.exposures = self.asked("exposure")

    def asked(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], (command, answer))
        return answer["result"]

    def control(self, command):
        return subprocess.run([CONTROL, f"unix:{self.rig_path}", command], check=True, text=True,
                              timeout=TIMEOUT_S, stdout=subprocess.PIPE).stdout

    def assert_as_before(self):
        self.assertEqual(self.asked("exposure"), self.exposures)
        self.assertEqual(self.asked("capture")["left"]["exposure"], self.exposures["left"])

    def index(self, name):
        with open(os.path.join(self.files, name, "session.index"), encoding="utf-8") as file:
            return file.read()

    def reported(self, name):
        """What `vergence info` prints of a session."""
        done = subprocess.run([os.environ["VERGENCE"], "info", os.path.join(self.files, name), "--json"],
                              capture_output=True, text=True, timeout=TIMEOUT_S, check=True)
        return json.loads(done.stdout)

    def test_an_average_is_recorded_with_what_it_is_made_of(self):
        pair = self.asked("capture avg average=4 readings=16")
        exposure = self.exposures["left"]
        for side in ("left", "right"):
            self.assertEqual(pair[side]["merged"],
                             [{"frames": 4, "exposure": exposure, "gain": 1.0}])
            self.assertEqual(pair[side]["exposure"], exposure)
        self.assertLess(pair["change"], 0.3)
        line = next(line for line in self.index("avg").splitlines() if line.startswith("pair "))
        self.assertIn(f" left_merged={exposure}:8:4 ", line)
        self.assertIn(f" right_merged={exposure}:8:4 ", line)
        self.assertIn(" left_bits=16 left_layout=grbg ", line)
        self.assertIn("command text=capture%20average=4%20readings=16", self.index("avg"))
        left = self.reported("avg")[0]["pairs"][0]["left"]
        self.assertEqual(left["merged"], [{"exposure_us": exposure, "gain": 1, "frames": 4}])
        self.assert_as_before()

    def test_a_bracket_goes_from_bright_to_dark_parts_and_back(self):
        pair = self.asked("capture br bracket=3")
        for side in ("left", "right"):
            parts = pair[side]["merged"]
            exposures = [part["exposure"] for part in parts]
            self.assertEqual([part["frames"] for part in parts], [1, 1, 1])
            self.assertEqual(exposures, sorted(set(exposures)))
            self.assertGreaterEqual(exposures[2], 3.9 * exposures[0])
            self.assertLess(pair[side]["saturated"], 0.2)
        self.assert_as_before()

    def test_a_cancelled_bracket_leaves_the_exposure_as_it_was(self):
        self.control("light 0.05")  # half a minute of the rig's time
        self.asked("exposure 200000")
        self.exposures = self.asked("exposure")
        self.first.send("@progress capture bracket=6\n")
        line = ""
        while not re.match(r"\.\.\. frames [1-9]", line):
            line = self.first.line()
            self.assertTrue(line is not None and line.startswith("... "), line)
        self.first.send("\x03")
        self.assertRegex(self.first.begun_answer()[-1], "^ERR CANCELLED ")
        self.assert_as_before()

    def time_s(self):
        return float(re.search(r"[0-9.]+", self.control("status")).group())

    def test_a_scene_that_changes_meanwhile_is_refused(self):
        for command in ("capture average=64", "capture bracket=6"):
            begin_s = self.time_s()
            self.asked(command)
            duration_s = self.time_s() - begin_s
            # Positions are read before the frames and after them, which takes half a second each.
            self.assertGreater(duration_s, 2)
            for part in (0.4, 0.65):
                self.control(f"at {self.time_s() + part * duration_s} light 0.7")
                self.assertRegex(self.first.ask(command)[-1],
                                 "^ERR MOVED .* camera: [0-9]+ of 1000 parts of its picture")
                self.control("light 1")
                self.assert_as_before()

    def test_what_cannot_be_merged(self):
        for command, words in (
                ("capture average=2 bracket=2", "ERR ARGUMENT capture: average and bracket"),
                ("capture average=1", "ERR RANGE capture: average.*2 to 64"),
                ("capture bracket=7", "ERR RANGE capture: bracket.*2 to 6")):
            self.assertRegex(self.first.ask(command)[-1], f"^{words}")
        self.control("light 0.0001")
        self.asked("exposure 1000000")
        self.assertRegex(self.first.ask("capture bracket=6")[-1],
                         "^ERR RANGE .*exposure [0-9]+ us is not supported .*open the iris")
        self.control("light 1")
        self.assertAlmostEqual(self.asked("exposure")["left"], 1000000, delta=100)
        self.assertEqual(self.asked("status")["state"], "ready")

    def test_a_recording_of_them_replays_bit_by_bit(self):
        for command in ("record start merged", *LEAD, "capture average=3", "capture bracket=2",
                        "record stop"):
            self.asked(command)
        played = self.asked("replay merged")
        self.assertEqual(played["pairs"], 2)

    def test_a_session_of_one_is_shown_again_by_two_cameras(self):
        self.asked("capture once average=2")
        script = "\n".join(["bringup", "window 64 48", "capture again", ""])
        done = subprocess.run(
            [VERGENCED, f"backend=replay {os.path.join(self.files, 'once')}", "socket=none",
             f"files={self.files}", "store=none", "console=stdio", "confine=no",
             "profile=two-cameras", "rig.width=64 px", "rig.height=48 px"],
            input=script, text=True, capture_output=True, timeout=TIMEOUT_S, check=False)
        self.assertEqual(done.stdout.count("OK\n"), 3, done.stdout + done.stderr)
        frames = [{name for name in os.listdir(os.path.join(self.files, folder))
                   if name.startswith("frame-")} for folder in ("once", "again")]
        self.assertEqual(frames[0], frames[1])


if __name__ == "__main__":
    unittest.main()

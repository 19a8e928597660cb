# SPDX-License-Identifier: Apache-2.0
"""Focus and exposure searched where they cannot be found: one line that says what is wrong, and
window, exposure, gain and lens are as if nothing had been asked."""
import os
import re
import subprocess
import unittest

import cv2
import numpy

from daemon_process import TIMEOUT_S, DaemonTest

CONTROL = os.path.join(os.environ["VERGENCE_SOURCE"], "tools/simrig/control")
SCENE = """\
room: {origin_mm: [0, 0, 0], tilt_deg: 0}
lights: []
ambient: [60, 60, 60]
floor_ambient: [60, 60, 60]
bounce_lux: 0
materials:
  - print: {kind: painted, contrast: 0, colours: [[0.4, 0.4, 0.4]], image: noise.png,
            image_size_mm: [300, 300]}
  - wall: {kind: paper, contrast: 0, colours: [[0.4, 0.4, 0.4]]}
  - sun: {kind: paper, contrast: 0, colours: [[1, 1, 1]], brightness: 100000}
objects:
  - sheet: {name: print, material: print, size_mm: [6000, 6000], position_mm: [0, 0, 1800]}
  - sheet: {name: wall, material: wall, size_mm: [900, 900], position_mm: [5000, 0, 1500]}
  - sheet: {name: sun, material: sun, size_mm: [90, 90], position_mm: [5000, 0, 1700]}
  - sheet: {name: near, material: print, size_mm: [300, 300], position_mm: [5000, 0, 1500]}
"""
# Small regions: what a search does with them does not depend on their size.
REGION = "region=1000,740,48,48"


class BadInputTest(DaemonTest):
    """A print before both cameras, a wall and a sun aside, and what must be after an error."""

    @classmethod
    def begin_rig(cls):
        cls.scene = os.path.join(cls.folder, "scene.yaml")
        with open(cls.scene, "w", encoding="utf-8") as file:
            file.write(SCENE)
        grey = numpy.random.default_rng(5).integers(60, 220, (512, 512, 1), dtype=numpy.uint8)
        cv2.imwrite(os.path.join(cls.folder, "noise.png"), numpy.repeat(grey, 3, axis=2))
        super().begin_rig()

    def setUp(self):
        # All faults of these tests: one that fails must not fail those after it.
        self.addCleanup(self.control, "cap left off", "fault lens left focus free",
                        "fault serial ok", "fault camera left ok", "move sun 5000 0 1700",
                        "move wall 5000 0 1500", "light 1")
        self.user = self.client()
        for command in ("bringup", "pan 0", "zoom 600", "iris 850", "exposure 5000", "gain 1",
                        "window 320 240"):
            answer = self.user.ask(command)
            self.assertEqual(answer[-1], "OK", (command, answer))
        self.state = self.settings_now()

    def control(self, *commands):
        return subprocess.run([CONTROL, f"unix:{self.rig_path}", *commands], check=True,
                              timeout=TIMEOUT_S, capture_output=True, text=True).stdout

    def rig_time_s(self):
        return float(re.match(r"time_s: (\S+)", self.control("status"))[1])

    def later(self, seconds, command):
        self.control(f"at {self.rig_time_s() + seconds:.6f} {command}")

    def settings_now(self):
        """Of window, exposure and gain."""
        replies = [self.user.ask_json(command) for command in ("window", "exposure", "gain")]
        return [reply.get("result") for reply in replies]

    def refused(self, command, code, *words):
        """One line that begins with the code; nothing is left half done."""
        answer = self.user.ask(command)
        self.assertTrue(answer[-1].startswith(f"ERR {code} "), answer)
        for word in words:
            self.assertIn(word, answer[-1])
        self.assert_untouched()
        return answer[-1]

    def assert_untouched(self):
        self.assertEqual(self.settings_now(), self.state)
        self.assert_rest()

    def assert_rest(self):
        self.assertNotIn("lens_moves: true", self.control("status"))


class FocusBadInput(BadInputTest):

    def test_lens_cap(self):
        self.control("cap left on")
        self.refused(f"autofocus side=left {REGION}", "NO_FOCUS", "left camera", "no contrast")

    def test_sun_in_the_window(self):
        self.control("move sun 0 0 1700")
        self.refused(f"autofocus side=left {REGION}", "NO_FOCUS", "left camera")

    def test_someone_walks_through(self):
        # A wall before the print, in the middle of the search.
        begin = self.rig_time_s() + 2.5
        steps = [f"at {begin + 0.05 * i:.3f} move wall {-600 + 60 * i} 0 1500" for i in range(21)]
        self.control(*steps, f"at {begin + 1.2:.3f} move wall 5000 0 1500")
        answer = self.user.ask(f"autofocus side=left {REGION}")
        if answer[-1] == "OK":
            self.assert_rest()
            found = re.search(r"median: .*blur_px: (\S+)}",
                              self.control("sharp left 1000 740 48 48"))
            self.assertLess(float(found[1]), 4, answer)
        else:
            self.assertRegex(answer[-1], "^ERR (MOVED|NO_FOCUS) .*left camera")
            self.assert_untouched()

    def test_region_outside_the_sensor(self):
        before = self.control("status").split("\n", 1)[1]
        for region in ("2000,740,100,100", "0,1500,100,100", "3000,3000,40,40", "10,10,0,0",
                       "10,10,2,2", "10,10,31,100", "10,10,100,31", "10,10,100,5000"):
            self.refused(f"autofocus side=left region={region}", "RANGE", "region")
        self.assertEqual(self.control("status").split("\n", 1)[1], before, "nothing moved")


if __name__ == "__main__":
    unittest.main()

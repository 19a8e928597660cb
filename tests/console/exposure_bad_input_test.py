# SPDX-License-Identifier: Apache-2.0
"""Exposure searched where there is none: one line that says what is wrong, and exposure, gain, window
and iris are as before."""
import unittest

from focus_bad_input_test import BadInputTest

REGION = "region=1000,740,48,48"
SEARCH = f"autoexpose side=left {REGION}"


class ExposureBadInput(BadInputTest):
    def iris(self):
        """Where the ring is."""
        return float(self.control("status").split("left: ")[1].split("iris: ")[1].split(",")[0])

    def refused_as_before(self, *words):
        before = self.iris()
        message = self.refused(SEARCH, "RANGE", *words)
        # It has moved, and came back from the same side.
        self.assertAlmostEqual(self.iris(), before, delta=6, msg=message)

    def assert_exposes(self):
        answer = self.user.ask_json(SEARCH)
        self.assertTrue(answer["ok"], answer)

    def test_lens_cap(self):
        self.control("cap left on")
        self.refused_as_before("dark")
        self.control("cap left off")
        self.assert_exposes()

    def test_sun_in_the_window_with_the_iris_at_its_end(self):
        self.control("light 10000", "move sun 0 0 1700")
        self.refused_as_before("bright")
        self.control("light 1", "move sun 5000 0 1700")
        self.assert_exposes()

    def test_an_iris_that_is_kept_is_opened_by_hand_unless_it_is_open(self):
        self.control("light 0.00001")
        for position, advice in ((300, "open the iris"), (850, "and open iris")):
            self.assertTrue(self.user.ask_json(f"iris {position} side=left")["ok"])
            self.refused(f"{SEARCH} iris=no", "RANGE", "dark", advice)

    def test_cameras_that_see_different_light(self):
        for side, position in (("left", 600), ("right", 850)):
            self.assertTrue(self.user.ask_json(f"iris {position} side={side}")["ok"])
        answer = self.user.ask_json(f"autoexpose {REGION} iris=no")
        self.assertRegex(answer["result"]["note"], r"the right camera sees [2-9.]+ times as much")

    def test_region_outside_the_sensor(self):
        before = self.iris()
        for region in ("2040,740,100,100", "3000,3000,40,40", "10,10,0,0", "10,10,15,100"):
            self.refused(f"autoexpose side=left region={region}", "RANGE", "region")
        self.assertEqual(self.iris(), before)

    def test_camera_unplugged_while_it_searches(self):
        self.control("light 0.0001")  # a long search
        self.later(0.3, "fault camera left unplug")
        answer = self.user.ask(SEARCH)
        self.assertRegex(answer[-1], "^ERR [A-Z_]+ .*left")
        self.control("fault camera left ok", "light 1")
        self.setUp()
        self.assert_exposes()


if __name__ == "__main__":
    unittest.main()

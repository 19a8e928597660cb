# SPDX-License-Identifier: Apache-2.0
"""focus-curve: its drawing and table, recorded and replayed, cancelled; and the choices of
autofocus: measures, near or far."""
import csv
import os
import re
import unittest
import xml.etree.ElementTree

from focus_bad_input_test import REGION, BadInputTest

SHOWN = f"side=left {REGION}"


class FocusCurve(BadInputTest):
    def curve_files(self):
        return sorted(name for name in os.listdir(self.files) if name.startswith("focus-curve"))

    def best(self):
        """The ring's position that is sharp in the region, as the rig knows it."""
        found = self.control("sharp left 1000 740 48 48")
        return float(re.search(r"median: {depth_mm: \S+, focus: (\S+), ", found)[1])

    def focused(self, options):
        answer = self.user.ask_json(f"autofocus {SHOWN} {options}")
        self.assertTrue(answer["ok"], answer)
        return answer["result"]["left"]

    def asked(self, command):
        answer = self.user.ask_json(command)
        self.assertTrue(answer["ok"], (command, answer))
        return answer["result"]

    def rows(self, name):
        with open(os.path.join(self.files, name), encoding="ascii", newline="") as file:
            return list(csv.DictReader(file))

    def assert_curve(self, answer):
        """The table's greatest sharpness is at the best focus, and the drawing shows the lens."""
        rows = self.rows(answer["table"])
        self.assertEqual({row["lens"] for row in rows}, {"left"})
        sweep = [row for row in rows if row["leg"] == "sweep"]
        positions = [float(row["position_counts"]) for row in sweep]
        self.assertLess(min(positions), 320)
        self.assertGreater(max(positions), 830)
        top = max(sweep, key=lambda row: float(row["sharpness"]))
        self.assertLess(abs(float(top["position_counts"]) - self.best()), 15)
        drawing = xml.etree.ElementTree.parse(os.path.join(self.files, answer["file"]))
        self.assertTrue(drawing.getroot().tag.endswith("svg"))
        self.assertIn("left", "".join(drawing.getroot().itertext()))

    def test_a_drawing_and_a_table(self):
        self.asked("focus 700 side=left")
        answer = self.asked(f"focus-curve {SHOWN}")
        self.assert_curve(answer)
        position = self.asked("focus side=left")["left"]["position"]
        self.assertLess(abs(position - 700), 6, "the ring is back")
        self.assert_untouched()
        # The same again, without moving.
        time_s = self.rig_time_s()
        self.assert_curve(self.asked("focus-curve side=left last=yes"))
        self.assertEqual(self.rig_time_s(), time_s)
        self.refused("focus-curve side=right last=yes", "MISSING", "no curve")
        self.refused("focus-curve region=2000,0,100,100", "RANGE", "region")
        self.refused("focus-curve region=1,2,3", "SYNTAX", "region")

    def test_cancelled(self):
        before = self.curve_files()
        self.asked("focus 700 side=left")
        self.user.send(f"@progress focus-curve {SHOWN}\n")
        line = ""
        while not re.match(r"\.\.\. .* [1-9]\d*/\d", line):
            line = self.user.line()
            self.assertTrue(line is not None and line.startswith("... "), line)
        self.user.send("\x03")
        self.assertRegex(self.user.begun_answer()[-1], "^ERR CANCELLED ")
        self.assert_untouched()
        self.assertEqual(self.curve_files(), before)

    def test_recorded_and_replayed(self):
        self.asked("record start curve")
        for command in ("bringup", f"focus-curve {SHOWN}", f"autofocus {SHOWN}"):
            self.asked(command)
        self.asked("record stop")
        answer = self.user.ask_json("replay curve")
        self.assertTrue(answer["ok"], answer)
        # What other tests have learned about the lens is recorded first.
        self.assertGreaterEqual(answer["result"]["commands"], 3)
        self.assertEqual(answer["result"]["same"], "yes")

    def test_measures_find_the_same_focus(self):
        for options in ("measure=variance", "measure=tenengrad"):
            found = self.focused(options)
            self.assertLess(abs(found["position"] - self.best()), 4, (options, found))
            self.assertGreater(found["distance"], found["sharp_near"], options)
            self.assertLess(found["distance"], found["sharp_far"], options)

    def test_the_iris_of_the_advice_is_twice_as_deep(self):
        found = self.focused("")
        iris, reach_mm = re.match(r"iris (\d+): \+-([\d.]+) mm", found["advice"]).groups()
        before_mm = found["sharp_far"] - found["sharp_near"]
        self.asked(f"iris {iris} side=left")
        after = self.asked("lens status")["left"]
        self.assertAlmostEqual((after["sharp_far"] - after["sharp_near"]) / before_mm, 2, delta=0.15)
        self.assertAlmostEqual(float(reach_mm), before_mm, delta=0.1 * before_mm)

    def depth_mm(self, x_mm):
        """Of what the region shows when the second print is there."""
        self.control(f"move near {x_mm} 0 1500")
        seen = self.control("sharp left 1000 740 48 48")
        near_mm, far_mm = (float(re.search(rf"{which}: {{depth_mm: ([\d.]+)", seen)[1])
                           for which in ("nearest", "farthest"))
        return far_mm - near_mm

    def test_near_or_far_of_two_distances(self):
        # A second print covers about half of the region.
        self.addCleanup(self.control, "move near 5000 0 1500")
        places = [x_mm for x_mm in range(130, 171, 2) if self.depth_mm(x_mm) > 200]
        self.assertGreater(len(places), 1)
        self.depth_mm(places[len(places) // 2])
        found = {prefer: self.focused(f"prefer={prefer} whole=yes") for prefer in ("near", "far")}
        for answer in found.values():
            self.assertEqual(answer["verdict"], "two peaks")
            self.assertIn("prefer=near or prefer=far", answer["advice"])
        # They are 49 counts apart; the other peak is that of the sweep, which a moving ring passes with its play.
        self.assertGreater(found["near"]["position"], found["far"]["position"] + 30)
        self.assertLess(abs(found["near"]["other_peak"] - found["far"]["peak"]), 10)


if __name__ == "__main__":
    unittest.main()

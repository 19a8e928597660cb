# SPDX-License-Identifier: Apache-2.0
"""What lens positions mean, through the console: magnifications, distances and f-numbers of the
data sheet against what the simulated lenses really do, and the iris for a depth of field."""
import os
import re
import subprocess

from daemon_process import TIMEOUT_S, DaemonTest

CONTROL = os.path.join(os.environ["VERGENCE_SOURCE"], "tools/simrig/control")


class Lens(DaemonTest):
    @classmethod
    def begin_rig(cls, *words):
        cls.truths = os.path.join(cls.folder, "truths")
        os.mkdir(cls.truths)
        super().begin_rig("--files", cls.truths, *words)

    def setUp(self):
        self.first = self.client()
        self.asked("bringup")
        self.asked("window 128 96")
        self.asked("lens forget")

    def asked(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]

    def refused(self, command, words):
        self.assertRegex(self.first.ask(command)[-1], f"^ERR {words}")

    def truth(self, side):
        """Focal length, focus distance and f-number of the simulated lens at a frame from now."""
        self.asked("capture")
        subprocess.run([CONTROL, f"unix:{self.rig_path}", f"truth {side} {side}"], check=True,
                       timeout=TIMEOUT_S, stdout=subprocess.DEVNULL)
        with open(os.path.join(self.truths, f"{side}.yaml"), encoding="utf-8") as file:
            text = file.read()
        return [float(re.search(rf"^{key}: *(\S+)", text, re.M).group(1))
                for key in ("focal_length_mm", "focus_distance_mm", "f_number")]

    def test_units(self):
        zoomed = self.asked("zoom 5x")
        for side in ("left", "right"):
            self.assertAlmostEqual(zoomed[side]["magnification"], 5, delta=0.1)
            self.assertAlmostEqual(zoomed[side]["focal_length"], 42.5, delta=0.8)
            # The simulated lenses differ from their data sheet by a bow of half a millimetre.
            self.assertAlmostEqual(self.truth(side)[0], 42.5, delta=1.2)
        self.assertEqual(round(self.asked("zoom 40 mm")["left"]["focal_length"]), 40)
        self.assertEqual(round(self.asked("zoom 40mm side=right")["right"]["focal_length"]), 40)
        focused = self.asked("focus 1800 mm")
        for side in ("left", "right"):
            self.assertAlmostEqual(focused[side]["distance"], 1800, delta=40)
            self.assertAlmostEqual(self.truth(side)[1], 1800, delta=40)
        self.assertAlmostEqual(self.asked("iris f/8")["right"]["f_number"], 8, delta=0.3)
        self.assertEqual(self.asked("zoom 540 counts side=left").keys(), {"left"})
        apart = self.asked("focus infinity right=2 m")
        self.assertAlmostEqual(apart["left"]["position"], 300, delta=6)
        self.assertAlmostEqual(apart["right"]["distance"], 2000, delta=60)
        # As the reply prints it.
        for axis in ("focus", "iris", "zoom"):
            shown = self.first.ask(axis)
            for line in shown[1:len(shown) // 2]:
                key, value = line.strip().split(": ")
                if key not in ("min", "max", "note", "play"):
                    self.assertEqual(self.first.ask(f"{axis} {value} side=left")[-1], "OK", line)
        self.assertEqual(self.asked("focus 1.8 m")["left"]["max"], 850)
        for command, words in (
                ("zoom 12x", r'RANGE zoom: POSITION 12x .*left lens: 1 to 10x\)'),
                ("zoom 5 mm", r'RANGE zoom: POSITION 5 .*8.5 to 85 mm\)'),
                ("focus 700mm", r'RANGE focus: POSITION 700mm .*at least 800 mm\)'),
                ("iris f/22", r'RANGE iris: POSITION f/22 .*f/1.6 to f/16\)'),
                ("zoom 2x right=12x", r'RANGE zoom: right=12x .*right lens: 1 to 10x\)'),
                ("zoom right=2x", "ARGUMENT right= requires POSITION"),
                ("iris 480 right=480 side=left", "ARGUMENT right= requires .*no side"),
                ("iris learn right=480", "ARGUMENT iris: right="),
                ("zoom 0x", 'RANGE zoom: POSITION "0x" is too small'),
                ("zoom -1 mm", 'RANGE zoom: POSITION "-1" is too small'),
                ("zoom 5y", 'SYNTAX zoom: POSITION "5y" has an unknown unit .* or N x, or N mm'),
                ("focus 5x", 'SYNTAX focus: POSITION "5x" has an unknown unit .*infinity'),
                ("zoom 1.5", 'RANGE zoom: POSITION 1.5 .*left lens: 300 to 850 counts')):
            self.refused(command, words)

    def test_iris_for_a_depth_of_field(self):
        self.asked("zoom 10x")
        self.asked("focus 1800 mm")
        self.asked("iris 850")
        self.asked("exposure 2000")
        closed = self.asked("iris sharp=1790:1810 side=left")["left"]
        # As far as needed: the ends are blurred by 1 px, or as much as by diffraction.
        self.assertLess(closed["blur"], 3.2)
        before, after = 1.6, closed["f_number"]
        self.assertAlmostEqual(closed["exposure"] / 2000, (after / before) ** 2, delta=0.4)
        self.assertEqual(self.asked("exposure")["right"], self.asked("exposure 2000")["right"])
        self.assertAlmostEqual(closed["best_focus"], 1800, delta=1)
        status = self.asked("lens status")["left"]
        self.assertEqual(status["zoom"]["known"], "data sheet")
        self.assertAlmostEqual(status["iris"]["f_number"], after, delta=0.2)
        focused = status["focus"]["distance"]
        self.assertAlmostEqual(focused, 1800, delta=40)
        self.assertLess(status["sharp_near"], focused)
        self.assertGreater(status["sharp_far"], focused)
        self.assertGreater(status["blur_per_count"], 0.5)
        far = self.asked("iris sharp=1700:inf side=left")["left"]
        self.assertIn("closes no further", far["result"])
        self.assertAlmostEqual(far["position"], 300, delta=6)
        self.assertGreater(far["best_focus"], 3000)
        self.asked("zoom 1x")
        self.assertIn("open", self.asked("iris sharp=1750:1850 side=left")["left"]["result"])
        self.refused("iris sharp=1850:1750", "RANGE iris: sharp=1850:1750 .*NEAR:FAR")
        self.refused("iris 480 sharp=1750:1850", "ARGUMENT iris: either")
        self.refused("iris sharp=1750", "SYNTAX iris: sharp")

    def control(self, *commands):
        subprocess.run([CONTROL, f"unix:{self.rig_path}", *commands], check=True,
                       timeout=TIMEOUT_S, stdout=subprocess.DEVNULL)

    def test_iris_learn(self):
        self.asked("iris 700")
        before = self.asked("exposure 3000")
        learned = self.asked("iris learn side=left")["left"]
        self.assertEqual(learned["points"], 12)
        self.assertAlmostEqual(learned["position"], 700, delta=6)
        self.assertEqual(self.asked("exposure"), before)
        self.assertEqual(self.asked("status")["window"]["width"], 128)
        # f-numbers relative to open, against the simulated lens.
        self.asked("iris 850")
        ratio = self.truth("left")[2] / self.asked("iris")["left"]["f_number"]
        for position in (330, 420, 560, 640, 780):
            shown = self.asked(f"iris {position} side=left")["left"]["f_number"]
            self.assertAlmostEqual(shown * ratio / self.truth("left")[2], 1, delta=0.05,
                                   msg=position)
        table = self.asked("lens learned side=left")["left"]["iris"]
        self.control("cap left on")
        self.addCleanup(self.control, "cap left off")
        self.refused("iris learn side=left", "RANGE left sensor: too dark .*add light")
        self.assertEqual(self.asked("lens learned side=left")["left"]["iris"], table)

    def test_a_recording_replays(self):
        """Also with what was learned before it began."""
        table = "300:8.5:0.5:3,850:-7.25:0.6875:12"
        self.asked(f"lens learned focus={table} object=544.5:0.625")
        self.asked("record start lens")
        self.refused("lens status", "NOT_READY lens status")
        self.assertEqual(self.asked("lens learned")["right"]["focus"], table)
        for command in ("bringup", "window 128 96", "exposure 2000", "zoom 10x", "focus 1800 mm",
                        "iris sharp=1780:1820 side=left", "iris learn side=left", "iris f/5.6",
                        "lens status", "lens forget side=right", "focus 1500 mm"):
            self.asked(command)
        self.asked("record stop")
        self.assertEqual(self.first.ask("replay lens")[-1], "OK")

    def test_what_was_learned(self):
        table = "300:1.5:0.5:3,850:-0.25:0.6875:12"
        shown = self.asked(f"lens learned side=left focus={table} object=544.5:0.625")
        self.assertEqual(shown["left"], {"focus": table, "iris": "none"})
        self.assertEqual(shown["object"], "544.5:0.625")
        self.asked("zoom 850")
        status = self.asked("lens status")
        self.assertEqual(status["left"]["focus"]["known"], "learned")
        self.assertEqual(status["left"]["prediction"]["position"], 544)
        self.assertLess(status["left"]["prediction"]["half_range"],
                        status["right"]["prediction"]["half_range"])
        self.asked("lens learned side=left iris=300:8:0.01:1,850:1:0.01:1")
        self.assertAlmostEqual(self.asked("iris 850")["left"]["f_number"], 1.6, delta=0.05)
        self.refused("iris f/16 side=left", "RANGE iris: POSITION f/16 .*f/1.6 to f/12.8")
        self.refused("lens learned focus=850:1:1:1,300:1:1:1", "SYNTAX lens: invalid focus= .*ascending")
        self.refused("lens learned object=x", "SYNTAX lens: invalid object=")
        self.assertEqual(self.asked("lens forget")["left"], {"focus": "none", "iris": "none"})


if __name__ == "__main__":
    import unittest
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""The instrument through its console: brought up, aimed, looked at, on the simulated rig."""
import os
import time
import unittest

from daemon_process import DaemonTest


class Rig(DaemonTest):
    def setUp(self):
        self.first = self.client()
        answer = self.first.ask_json("bringup")
        self.assertTrue(answer["ok"], answer)
        self.assertEqual({part["state"] for part in answer["result"]["parts"]}, {"works"})

    def asked(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]

    def test_pan(self):
        angles = self.asked("pan both 3.97 -3.97")
        self.assertAlmostEqual(angles["left"], 3.97, delta=0.01)
        self.assertAlmostEqual(angles["right"], -3.97, delta=0.01)
        self.assertEqual(self.asked("pan left 1").keys(), {"left"})
        status = self.first.ask_json("status")
        self.assertAlmostEqual(status["result"]["left"]["pan"], 1, delta=0.01)
        self.assertEqual(status["units"]["left.pan"], "deg")
        angles = self.asked("pan 0")
        self.assertEqual((angles["left"], angles["right"]), (0, 0))
        self.assertEqual(self.first.ask("pan 45"), [
            "ERR RANGE pan: ANGLE 45: this instrument turns from -30 to 30 deg"])
        self.assertEqual(self.first.ask("pan left 1 2"), [
            'ERR ARGUMENT pan: a second angle is for "both" alone'])

    def test_lenses(self):
        for axis in ("zoom", "focus", "iris"):
            result = self.asked(f"{axis} 450")
            for side in ("left", "right"):
                self.assertAlmostEqual(result[side]["position"], 450, delta=6, msg=axis)
        self.assertEqual(self.first.ask("zoom left 900"), [
            "ERR RANGE zoom: POSITION 900: the left lens goes from 300 to 850 counts"])

    def test_cameras(self):
        self.assertAlmostEqual(self.asked("exposure 5000")["left"], 5000, delta=60)
        self.assertEqual(self.asked("gain right 2.5"), {"right": 2.5})
        self.assertEqual(self.asked("window 640 480"), {"width": 640, "height": 480})
        self.assertEqual(self.first.ask("window 640"), ["ERR MISSING window: HEIGHT is missing"])

    def test_looks(self):
        self.assertEqual(self.asked("selftest")["picture"], "arrives bit for bit")
        self.assertEqual(self.asked("registers bridge id"), {"id": "0x5B1D"})
        self.assertEqual(self.asked("registers left 0"), {"chip_version": "0x1621"})
        self.assertGreater(len(self.asked("registers bridge")), 60)
        self.assertIn('did you mean "wdg_ms"?', self.first.ask("registers bridge wdg_mss")[0])
        health = self.asked("health")
        self.assertTrue(all(part["state"] == "works" for part in health["parts"]))
        report = self.asked("bugreport")
        with open(os.path.join(self.files, report["file"]), encoding="utf-8") as file:
            text = file.read()
        self.assertEqual(len(text), report["size"])
        for part in ("== version", "== config", "backend: sim", "== health", "== registers right",
                     "chip_version: 0x1621", "serving"):
            self.assertIn(part, text)

    def test_a_cancelled_move_leaves_the_rig_safe_or_ready(self):
        self.first.send("zoom both 800\n")
        time.sleep(0.3)
        self.first.send("\x03")
        self.assertEqual(self.first.answer()[-1][:13], "ERR CANCELLED")
        self.assertIn(self.asked("status")["state"], ("safe", "ready"))
        self.assertTrue(self.first.ask_json("bringup")["ok"])
        self.assertAlmostEqual(self.asked("zoom left 400")["left"]["position"], 400, delta=6)

    def test_safe(self):
        self.assertIn("state", self.asked("safe"))
        if self.asked("status")["state"] == "safe":
            self.assertEqual(self.first.ask("pan 1")[0][:13], "ERR NOT_READY")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""A lens controller on I2C, chosen by a profile and simulated by choice of a rig file: moves,
limits, cancellation and faults through the daemon."""
import os
import re
import subprocess
import unittest

from daemon_process import TIMEOUT_S, DaemonTest

ROOT = os.environ["VERGENCE_SOURCE"]
CONTROL = os.path.join(ROOT, "tools/simrig/control")


class Arducam(DaemonTest):
    overrides = ()

    @classmethod
    def begin_rig(cls):
        with open(os.path.join(ROOT, "tools/simrig/rigs/perfect.yaml"), encoding="utf-8") as file:
            text = file.read()
        rig_file = os.path.join(cls.folder, "arducam.yaml")
        with open(rig_file, "w", encoding="utf-8") as file:
            file.write(text.replace("lens_controller: {", "lens_controller: {model: arducam, "))
        profile = os.path.join(cls.folder, "arducam.profile")
        with open(profile, "w", encoding="utf-8") as file:
            file.write("like = rig\nname = arducam\nlenses = arducam\n"
                       "width = 128 px\nheight = 96 px\n")
        cls.settings = (f"profile={profile}", *cls.overrides)
        super().begin_rig("--rig", rig_file)

    def setUp(self):
        self.first = self.client()
        self.asked("bringup")

    def asked(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]

    def control(self, command):
        return subprocess.run([CONTROL, f"unix:{self.rig_path}", command], check=True, text=True,
                              timeout=TIMEOUT_S, capture_output=True).stdout

    def rings(self):
        """Positions of the left lens's rings, in counts of the simulated motors."""
        left = re.search(r"left: .*zoom: ([\d.]+), focus: ([\d.]+)", self.control("status"))
        return float(left[1]), float(left[2])

    def test_moves(self):
        self.assertEqual(self.asked("zoom 12000"),
                         {"left": {"position": 12000, "min": 3000, "max": 20000}})
        self.assertEqual(self.asked("focus 5000 side=left")["left"]["position"], 5000)
        zoom, focus = self.rings()
        self.assertAlmostEqual(zoom, 300 + 550 * 9 / 17, delta=0.1)
        self.assertAlmostEqual(focus, 300 + 550 / 4, delta=0.1)
        status = self.asked("status")
        self.assertEqual((status["left"]["zoom"], status["left"]["focus"]), (12000, 5000))
        self.assertNotIn("iris", status["left"])
        self.assertNotIn("zoom", status["right"])
        # The frames show the new focal length, and are taken at rest.
        self.asked("capture static=yes")
        for command, words in (("zoom 2999", "ERR RANGE .*3000 to 20000 counts"),
                               ("focus 20001", "ERR RANGE .*0 to 20000 counts"),
                               ("iris 5000", "ERR NOT_CONNECTED left lens: .*axis"),
                               ("zoom 5000 side=right", "ERR NOT_CONNECTED .*right")):
            self.assertRegex(self.first.ask(command)[-1], words)


class AnotherAddress(Arducam):
    overrides = ("rig.lens_address=0x0d",)

    def setUp(self):
        self.first = self.client()

    test_moves = None

    def test_a_controller_that_is_missing(self):
        self.assertRegex(self.first.ask("bringup")[-1], "^ERR I2C_NACK left lens: .*I2C cable")


if __name__ == "__main__":
    unittest.main()

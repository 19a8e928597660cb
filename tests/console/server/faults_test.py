# SPDX-License-Identifier: Apache-2.0
"""The setting "faults": each part fails when its rule says so, and the answer names it."""
import glob
import os
import shutil
import unittest

from daemon_process import DaemonTest

SESSIONS = os.environ["VERGENCE_SESSIONS"]


class FaultsTest(DaemonTest):
    def works(self, command):
        answer = self.client().ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]


class Store(FaultsTest):
    settings = ("faults=store.save@2=full, store.load@5=io, store.remove@1=device",)

    def refused(self, command, error, *words):
        """The answer is this error of the calibration, with these words."""
        answer = self.client().ask(command)
        self.assertEqual(len(answer), 1, answer)
        self.assertTrue(answer[0].startswith(f"ERR {error} calibration: "), answer)
        for word in words:
            self.assertIn(word, answer[0])

    def test_a_calibration_that_cannot_be_kept_leaves_the_one_before(self):
        paths = sorted(glob.glob(os.path.join(SESSIONS, "*", "calibration-*.txt")))
        for name, path in (("old.txt", paths[0]), ("new.txt", paths[-1])):
            shutil.copyfile(path, os.path.join(self.files, name))
        old = self.works("calibration set old.txt")
        store = os.path.join(self.folder, "store")
        self.refused("calibration set new.txt", "FULL", "save", store, "free space")
        self.assertEqual(self.works("calibration show"), old)
        self.assertEqual(self.works("calibration"), old)
        self.refused("calibration show", "IO", "read", store, "disk has failed")
        self.refused("calibration forget", "DEVICE", "remove", store)
        self.assertNotEqual(self.works("calibration set new.txt"), old)
        self.assertEqual(self.client().ask("calibration forget"), ["OK"])


class Bus(FaultsTest):
    settings = ("faults=i2c.transfer@1+=i2c_nack",)

    def test_a_bridge_that_does_not_answer_is_named(self):
        self.assertRegex(self.client().ask("bringup")[-1], "^ERR I2C_NACK FPGA bridge: .*I2C")


class Camera(FaultsTest):
    settings = ("faults=left.take@1=device",)

    def test_a_camera_that_has_gone_is_named_and_found_again(self):
        self.assertRegex(self.client().ask("bringup")[-1], "^ERR DEVICE left camera: ")
        self.works("bringup")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Settings of the instrument outlive the daemon: saved, restored, forgotten; damaged, of another
instrument, and with a store that fails."""
import os
import re
import shutil
import subprocess
import unittest
import zlib

from daemon_process import TIMEOUT_S, SIMRIG, VERGENCED, DaemonTest, replaced
from fake_devices import DeviceTest, LensController
from played_pairs import lines_of


class Kept(unittest.TestCase):
    """Common to both instruments."""

    def ok(self, client, *commands):
        for command in commands:
            answer = client.ask_json(command)
            self.assertTrue(answer["ok"], (command, answer))
        return answer["result"]

    def refused(self, client, command, error):
        answer = client.ask_json(command)
        self.assertEqual(answer["error"], error, answer)
        self.assertNotIn("\n", answer["message"])
        return answer["message"]

    @classmethod
    def again(cls, *settings):
        """Starts another daemon with these settings changed."""
        cls.end(cls.daemon)
        cls.settings = tuple(replaced(cls.settings, *settings))
        cls.start()


@unittest.skipUnless(SIMRIG, "the simulated rig needs -DVERGENCE_FPGA=ON")
class Rig(Kept, DaemonTest):
    """The whole rig: cameras, servos and lenses."""

    @classmethod
    def arguments(cls):
        cls.store = os.path.join(cls.folder, "store")
        return replaced(super().arguments(), f"store={cls.store}")

    def status(self, client):
        """The status without measured values and the number of pairs."""
        status = self.ok(client, "status")
        for side in ("left", "right"):
            for axis in ("zoom", "focus", "iris"):
                del status[side][axis], status[side][f"{axis}_sigma"]
            for derived in ("focal_length", "magnification", "distance", "f_number"):
                status[side].pop(derived, None)
        del status["pairs"]
        return status

    def test_saved_and_restored(self):
        first = self.client()
        self.assertIn('"settings save"', self.refused(first, "settings", "MISSING"))
        self.assertIn("bringup", self.refused(first, "settings save", "NOT_READY"))
        default_value = self.ok(first, "bringup", "status")
        kept = self.ok(first, "window 640 480 skip=2", "exposure 7000 side=left", "exposure 9000 side=right",
                       "gain 2.5 side=left", "gain 4 side=right", "pan 3.97 right=-3.5", "zoom 420",
                       "focus 500 side=left", "focus 505 side=right", "settings save")
        self.assertEqual(kept["profile"], "rig")
        self.assertEqual(kept["window"], {"width": 640, "height": 480, "skip": 2})
        self.assertEqual((kept["left"]["zoom"], kept["right"]["focus"]), (420, 505))
        self.assertNotIn("iris", kept["left"])  # it was not moved
        before = self.status(first)
        self.again()
        client = self.client()
        self.assertEqual(self.ok(client, "settings"), kept)
        self.refused(client, "settings restore", "NOT_READY")
        self.ok(client, "bringup")
        self.assertNotEqual(self.status(client), before)
        self.assertEqual(self.ok(client, "status")["window"], default_value["window"])
        self.assertEqual(self.ok(client, "settings restore"), kept)
        self.assertEqual(self.status(client), before)
        lenses = self.ok(client, "zoom"), self.ok(client, "focus")
        for lens, side, target in ((lenses[0], "left", 420), (lenses[0], "right", 420),
                                   (lenses[1], "left", 500), (lenses[1], "right", 505)):
            self.assertAlmostEqual(lens[side]["position"], target, delta=5)
        # The restored settings are the saved ones, to the last digit.
        self.assertEqual(self.ok(client, "settings save"), kept)

        # A recording contains the commands and needs no store.
        self.ok(client, "record start restored", "bringup", "settings restore", "settings",
                "settings save", "capture", "record stop")
        commands = [line[len("command text="):].replace("%20", " ")
                    for line in lines_of(os.path.join(self.files, "restored"))
                    if line.startswith("command ")]
        self.assertEqual(commands, [
            "bringup", "window 640 480 skip=2", commands[2], commands[3], "gain 2.500 side=left",
            "gain 4.000 side=right", commands[6], "zoom 420", "focus 500 side=left", "focus 505 side=right",
            "capture"])
        self.assertEqual([commands[i].split()[::2] for i in (2, 3)],
                         [["exposure", "side=left"], ["exposure", "side=right"]])
        self.assertRegex(commands[6], r"^pan 3\.9\d{5} right=-3\.[45]\d{5}$")
        self.ok(client, "settings forget", "replay restored")
        self.assertIn("none saved", self.refused(client, "settings forget", "MISSING"))

        # Out of range, and of another profile: none of it is set.
        self.ok(client, "pan 29", "settings save")
        self.again("rig.pan_max=17.188734deg")
        client = self.client()
        self.ok(client, "bringup", "exposure 5000")
        before = self.status(client)
        self.assertRegex(self.refused(client, "settings restore", "RANGE"), r"left pan (29|28\.\d+) deg")
        self.assertEqual(self.status(client), before)
        # At a limit without a finite decimal value in degrees.
        self.ok(client, "pan 17.188734", "settings save", "pan 0", "settings restore")
        self.assertAlmostEqual(self.ok(client, "pan")["left"], 17.189, delta=0.01)
        self.again("rig.pan_max=30deg", "rig.name=other")
        client = self.client()
        self.ok(client, "bringup")
        self.assertIn("profile rig", self.refused(client, "settings restore", "ARGUMENT"))


class CameraTest(Kept, DeviceTest):
    """Two webcams on a fake kernel."""
    profile = "two-cameras"

    def begin(self, *settings):
        """A daemon with the same store as the one before."""
        if self.daemon is not None:
            self.end(self.daemon)
        type(self).store = self.place("store")
        self.serve(self.cameras(),
                   *replaced([f"profile={self.profile}", f"store={self.store}"], *settings))
        return self.first

    @classmethod
    def arguments(cls):
        return replaced(super().arguments(), *cls.settings)

    def record(self):
        return self.place("store/settings")

    def text(self):
        with open(self.record(), encoding="ascii") as file:
            return file.read()

    def commands_of(self, session):
        return [line[len("command text="):].replace("%20", " ")
                for line in lines_of(os.path.join(self.files, session))
                if line.startswith("command ")]



class Cameras(CameraTest):
    """They have no axes."""

    def test_what_a_record_is(self):
        client = self.begin()
        kept = self.ok(client, "bringup", "exposure 7000 side=left", "gain 1.5 side=left", "settings save")
        self.assertEqual(kept, {"profile": "two-cameras",
                                "window": {"width": 640, "height": 480, "skip": 1},
                                "left": {"exposure": 7000, "gain": 1.5}, "right": {}})
        self.assertEqual(self.text().split("\n", 1)[1],
                         "version = 4\nprofile = two-cameras\nwindow = 640 480 1\n"
                         "[left]\nexposure = 7000 us\ngain = 1.5 x\n[right]\n")
        self.assertEqual(client.ask("settings"), [
            "profile: two-cameras", "window:", "  width: 640 px", "  height: 480 px", "  skip: 1",
            "left:", "  exposure: 7000 us", "  gain: 1.500", "right:", "OK"])
        self.assertEqual(client.ask_json('complete "settings "')["result"]["words"],
                         "show save restore forget")
        self.refused(client, "settings keep", "ARGUMENT")

    def test_restored_by_bringup(self):
        client = self.begin("restore=yes")
        self.assertEqual(self.ok(client, "bringup")["settings"], "none saved")
        self.ok(client, "exposure 7000 side=left", "exposure 8000 side=right", "gain 2 side=right",
                "settings save", "exposure 3000")
        client = self.begin()
        self.assertNotIn("settings", self.ok(client, "bringup"))
        self.assertEqual(self.ok(client, "status")["left"], {})
        client = self.begin("restore=yes")
        self.assertEqual(self.ok(client, "bringup")["settings"], "restored")
        status = self.ok(client, "status")
        self.assertEqual((status["left"], status["right"]),
                         ({"exposure": 7000}, {"exposure": 8000, "gain": 2}))
        # Restored settings are recorded as separate commands, and replay without the store.
        self.ok(client, "record start brought", "bringup", "capture", "record stop")
        commands = ["bringup", "exposure 7000 side=left", "exposure 8000 side=right", "gain 2.000 side=right",
                    "capture"]
        self.assertEqual(self.commands_of("brought"), commands)
        self.ok(client, "replay brought")
        # A daemon that replays it restores nothing.
        done = subprocess.run(
            [VERGENCED, f"backend=replay {os.path.join(self.files, 'brought')}", "socket=none",
             "console=stdio", "restore=yes", f"files={self.place('more')}",
             f"store={self.place('other')}"], text=True, capture_output=True,
            input="\n".join(commands) + "\n", timeout=TIMEOUT_S)
        self.assertEqual([line for line in done.stdout.splitlines() if line[:3] in ("OK", "ERR")],
                         5 * ["OK"], done.stdout + done.stderr)
        # A damaged record is reported, and is not a failure of the instrument.
        with open(self.record(), "r+b") as file:
            file.seek(-2, os.SEEK_END)
            file.write(b"9")
        answer = self.ok(client, "bringup")
        self.assertEqual(answer["state"], "ready")
        self.assertIn("damaged", answer["settings"])
        self.assertEqual(self.ok(client, "status")["left"], {})
        self.assertTrue(any("warning: settings: " in line and "damaged" in line
                            for line in client.ask("log")))

    def test_a_camera_that_fails_while_it_is_set(self):
        client = self.begin()
        self.ok(client, "bringup", "exposure 7000", "settings save")
        self.end(self.daemon)
        self.serve(self.cameras() + "fail 1 0 ENODEV video1 ioctl S_CTRL\n",
                   f"profile={self.profile}", f"store={self.store}", "restore=yes")
        message = self.refused(self.first, "bringup", "DEVICE")
        self.assertIn('settings: "exposure 7000 side=right" failed: right camera', message)
        self.assertEqual(self.ok(self.first, "status")["state"], "safe")

    def test_damaged(self):
        client = self.begin()
        self.ok(client, "bringup", "exposure 7000", "settings save", "exposure 3000")
        with open(self.record(), "rb") as file:
            good = file.read()
        for bad in (good[:-1], good + b"x", good.replace(b"7000", b"7001"), b"", b"\0" * 5000,
                    b"x" * 60000):
            with open(self.record(), "wb") as file:
                file.write(bad)
            for command in ("settings", "settings restore"):
                output_text = self.refused(client, command, "CRC")
                for word in (self.store, "damaged", "checksum", '"settings forget"',
                             '"settings save"'):
                    self.assertIn(word, output_text)
            self.assertEqual(self.ok(client, "status")["left"], {"exposure": 3000})
        self.ok(client, "settings save", "settings", "settings forget")
        self.refused(client, "settings", "MISSING")

    def failed(self, client, command, error, action, reason):
        """The command fails; the message names the action, the store and the reason."""
        self.assertRegex(self.refused(client, command, error),
                         f"^settings: .*{action}.* {re.escape(self.store)}: .*{reason}")

    def test_a_store_that_fails(self):
        for error, name, reason in (("full", "FULL", "no space left"),
                                    ("io", "IO", "disk has failed"),
                                    ("refused", "REFUSED", "permission denied")):
            client = self.begin(
                f"faults=store.save@2={error},store.load@3={error},store.remove@1={error}")
            kept = self.ok(client, "bringup", "exposure 7000", "settings save")
            old = self.text()
            self.ok(client, "exposure 4000")
            self.failed(client, "settings save", name, "save", reason)
            self.assertEqual(self.text(), old)
            self.assertEqual(self.ok(client, "settings"), kept)
            self.ok(client, "settings restore")
            self.failed(client, "settings restore", name, "read", reason)
            self.failed(client, "settings forget", name, "remove", reason)
            self.assertEqual(self.text(), old)
            self.assertEqual(self.ok(client, "status")["left"], {"exposure": 7000})

    def test_a_store_that_was_taken_away(self):
        client = self.begin()
        self.ok(client, "bringup", "exposure 7000")
        shutil.rmtree(self.store)
        self.failed(client, "settings save", "IO", "save", "directory was removed")
        self.begin()

    def test_another_profile(self):
        client = self.begin()
        self.ok(client, "bringup", "exposure 7000", "settings save")
        client = self.begin("rig.name=other", "restore=yes")
        self.assertIn("profile two-cameras", self.ok(client, "bringup")["settings"])
        self.assertIn("profile two-cameras", self.refused(client, "settings restore", "ARGUMENT"))
        self.assertEqual(self.ok(client, "status")["left"], {})

    def test_without_a_store(self):
        client = self.begin("store=none")
        self.assertNotIn("settings", self.ok(client, "bringup"))
        for command in ("settings", "settings save", "settings restore", "settings forget"):
            self.assertIn('"store" is not set', self.refused(client, command, "UNSUPPORTED"))


class OneLens(CameraTest):
    """The same with one motorized lens, which takes its time."""
    profile = "two-cameras-lens"

    def setUp(self):
        super().setUp()
        self.lens = LensController(self.place("tty"), counts_per_s=20)
        self.addCleanup(self.lens.pull_out)

    def begin(self, *settings):
        return super().begin("rig.lenses=v1lc", f"lens_uart={self.lens.path}", *settings)

    def test_axes_move_again_and_can_be_broken_off(self):
        client = self.begin()
        kept = self.ok(client, "bringup", "focus 100 side=left", "zoom 80 side=left", "settings save")
        self.assertEqual((kept["left"], kept["right"]), ({"zoom": 80, "focus": 100}, {}))
        self.ok(client, "focus 60 side=left", "zoom 50 side=left")
        client = self.begin("restore=yes")
        self.assertEqual(self.ok(client, "bringup")["settings"], "restored")
        self.assertAlmostEqual(self.ok(client, "zoom")["left"]["position"], 50, delta=2)  # unchanged
        client.send("@progress settings restore\n")
        seen = client.line()
        while not seen.startswith("... zoom"):
            self.assertEqual(seen[:4], "... ")
            seen = client.line()
        client.send("\x03")
        while seen[:4] == "... ":
            seen = client.line()
        self.assertEqual(seen[:13], "ERR CANCELLED")
        self.assertEqual(self.ok(client, "status")["state"], "ready")
        self.ok(client, "settings restore")
        self.assertAlmostEqual(self.ok(client, "zoom")["left"]["position"], 80, delta=2)
        self.assertAlmostEqual(self.ok(client, "focus")["left"]["position"], 100, delta=2)
        # A position outside this lens's range, in a valid record.
        text = self.text().split("\n", 1)[1].replace("zoom = 80", "zoom = 300")
        self.write(text)
        self.assertIn("left zoom 300", self.refused(client, "settings restore", "RANGE"))
        self.write(text.replace("zoom = 300", "zoom = 80") + "iris = 90 counts\n")
        self.assertIn("right iris", self.refused(client, "settings restore", "NOT_CONNECTED"))
        self.write(text.replace("zoom = 300", "zoom = x"))
        self.assertIn("damaged", self.refused(client, "settings restore", "SYNTAX"))
        self.write(text.replace("version = 4", "version = 5"))
        self.assertIn("version 5", self.refused(client, "settings restore", "VERSION"))
        # A record of the first version, which had no units.
        self.write("vergence settings 1\nprofile two-cameras-lens\nwindow 640 480 1\n"
                   "left_exposure_us 7000\nleft_gain_q3 12\nleft_zoom 60\n")
        self.assertEqual(self.ok(client, "settings")["left"],
                         {"exposure": 7000, "gain": 1.5, "zoom": 60})
        self.assertAlmostEqual(self.ok(client, "zoom")["left"]["position"], 80, delta=2)

    def write(self, text):
        """A valid record, as the store writes it."""
        data = text.encode()
        crc = zlib.crc32(b"settings\0" + data)
        with open(self.record(), "wb") as file:
            file.write(b"vergence record 1: %9d bytes follow, crc32 %08x\n" % (len(data), crc) + data)


if __name__ == "__main__":
    unittest.main()

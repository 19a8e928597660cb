# SPDX-License-Identifier: Apache-2.0
"""The instrument through its console: bring-up, aiming and looking, on the simulated rig."""
import glob
import os
import subprocess
import unittest

from daemon_process import TIMEOUT_S, VERGENCED, DaemonTest


CONTROL = os.path.join(os.environ["VERGENCE_SOURCE"], "tools/simrig/control")


class RigTest(DaemonTest):
    def setUp(self):
        self.first = self.client()
        answer = self.first.ask_json("bringup")
        self.assertTrue(answer["ok"], answer)
        self.assertEqual({part["state"] for part in answer["result"]["parts"]}, {"works"})

    def asked(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]

    def fault(self, what):
        subprocess.run([CONTROL, f"unix:{self.rig_path}", f"fault {what}"], check=True,
                       timeout=TIMEOUT_S, stdout=subprocess.DEVNULL)

    def logged(self):
        """The lines of the log, without their times."""
        return [line.lstrip(" -").split(" ", 2)[2] for line in self.first.ask("log 256")[1:-1]]


class Rig(RigTest):
    def test_pan(self):
        angles = self.asked("pan 3.97 right=-3.97")
        self.assertAlmostEqual(angles["left"], 3.97, delta=0.01)
        self.assertAlmostEqual(angles["right"], -3.97, delta=0.01)
        self.assertEqual(self.asked("pan 1 side=left").keys(), {"left"})
        status = self.first.ask_json("status")
        self.assertAlmostEqual(status["result"]["left"]["pan"], 1, delta=0.01)
        self.assertEqual(status["units"]["left.pan"], "deg")
        units = self.first.ask_json("health")["units"]
        self.assertEqual(units, {"parts[].last": "s ago", "watchdog.period": "ms",
                                 "watchdog.longest_gap": "ms"})
        angles = self.asked("pan 0")
        self.assertEqual((angles["left"], angles["right"]), (0, 0))
        for angle in (45, -91):
            self.assertRegex(self.first.ask(f"pan {angle}")[-1],
                             f"^ERR RANGE pan: ANGLE {angle} .*-30 to 30 deg")
        self.assertIn("rig.pan_max", self.asked("help pan")["ANGLE"]["meaning"])
        for line, words in (("pan 1 side=left right=2", "right requires ANGLE"),
                            ("pan right=2", "right requires ANGLE"),
                            ("pan left 1", "unexpected \"left\" .write side=left")):
            self.assertRegex(self.first.ask(line)[-1], f"^ERR ARGUMENT pan: {words}")

    def test_lenses(self):
        for axis in ("zoom", "focus", "iris"):
            result = self.asked(f"{axis} 450")
            for side in ("left", "right"):
                self.assertAlmostEqual(result[side]["position"], 450, delta=6, msg=axis)
                self.assertNotIn("note", result[side], axis)
        # At the upper end there is no space to approach from above, as elsewhere.
        near = self.asked("zoom 850")
        self.assertIn("from above", near["left"]["note"])
        self.assertGreater(near["right"]["play"], 0)
        self.assertAlmostEqual(self.asked("status")["left"]["zoom"], near["left"]["position"],
                               delta=3)
        self.assertNotIn("note", self.asked("zoom")["left"], "nothing was moved")
        self.assertRegex(self.first.ask("zoom 900 side=left")[-1],
                         "^ERR RANGE zoom: POSITION 900 .*left lens.*300 to 850 counts")

    def test_cameras(self):
        self.assertAlmostEqual(self.asked("exposure 5000")["left"], 5000, delta=60)
        self.assertEqual(self.asked("gain 2.5 side=right"), {"right": 2.5})
        centred = {"column": 704, "row": 528}
        self.assertEqual(self.asked("window 640 480"),
                         {"width": 640, "height": 480, "left": centred, "right": centred})
        corner = {"column": 1408, "row": 0}
        self.assertEqual(self.asked("window 640 480 column=1408 row=0 side=left"),
                         {"width": 640, "height": 480, "left": corner, "right": centred})
        self.assertRegex(self.first.ask("window 640")[-1], "^ERR MISSING window: HEIGHT")
        self.assertRegex(self.first.ask("window row=8")[-1], "^ERR MISSING window: WIDTH")
        self.assertRegex(self.first.ask("exposure 10000001")[-1],
                         '^ERR RANGE exposure: TIME "10000001" .*from 1 to 10000000 us')
        self.assertEqual(self.asked("help exposure")["TIME"]["expected"],
                         "an integer from 1 to 10000000 us")
        for window, words in (
                ("5000 5000", "WIDTH 5000 .*skip=1: 16 to 2048 px in steps of 2"),
                ("640 1538", "HEIGHT 1538 .*skip=1: 16 to 1536 px in steps of 2"),
                ("17 33 skip=3", "WIDTH 17 .*skip=3: 18 to 2046 px in steps of 6"),
                ("2046 1530 skip=4", "WIDTH 2046 .*skip=4: 16 to 2048 px in steps of 8"),
                ("640 480 column=1410", "column=1410 .*0 to 1408 px in steps of 2"),
                ("640 480 row=3", "row=3 .*0 to 1056 px in steps of 2"),
                ("320 480 side=right", "the other side has 640 480 skip=1")):
            self.assertRegex(self.first.ask(f"window {window}")[-1], f"^ERR RANGE window: {words}")
        small = self.asked("window 18 36 skip=3")
        self.assertEqual((small["width"], small["height"]), (6, 12))
        self.assertNotIn("error", self.asked("health"))
        self.asked("safe")
        self.assertRegex(self.first.ask("health")[-1], "^ERR NOT_READY health: .*bringup")

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
        for part in ("== version", "== system", "date: 20", f"kernel: {os.uname().release}",
                     "memory_free: ", "disk_free: ", "== config", "backend: sim", "== health", "== registers right",
                     "chip_version: 0x1621", "serving"):
            self.assertIn(part, text)
        self.assertNotIn(os.uname().nodename, text.split("== config")[0])
        self.assertLess(self.asked("system")["up"], 3600)

    def test_a_cancelled_move_leaves_the_rig_safe_or_ready(self):
        self.first.send("@progress zoom 800\n")
        self.assertTrue(self.first.line().startswith("... "))  # it moves
        self.first.send("\x03")
        self.assertEqual(self.first.answer()[-1][:13], "ERR CANCELLED")
        self.assertIn(self.asked("status")["state"], ("safe", "ready"))
        self.assertTrue(self.first.ask_json("bringup")["ok"])
        self.assertAlmostEqual(self.asked("zoom 400 side=left")["left"]["position"], 400, delta=6)

    def frames_of(self, session):
        """The files of a session's frames, whose names are the CRC of their contents."""
        pattern = os.path.join(self.files, session, "frame-*")
        return sorted(os.path.basename(path) for path in glob.glob(pattern))

    def test_a_bus_that_sticks_and_comes_back(self):
        """During a move, with frames of another size than at the bring-up."""
        self.asked("window 128 96")
        self.fault("bus scl")
        answer = self.first.ask_json("focus 429")
        self.assertEqual(answer["error"], "I2C_STUCK", answer)
        self.assertEqual(self.asked("status")["state"], "safe")
        self.fault("bus ok")
        self.asked("bringup")

    def test_a_recorded_session_replays_identically(self):
        self.asked("record start r1")
        self.assertEqual(self.first.ask("record start r2")[0][:8], "ERR BUSY")
        commands = ["bringup", "window 320 240", "exposure 8000", "pan 3 right=-3", "capture",
                    "capture static=yes"]
        answers = [self.asked(command) for command in commands]
        self.assertLess(answers[5]["change"], 1)
        self.assertNotEqual(answers[4]["skew"], 0)
        self.assertEqual(self.asked("record stop"), {"session": "r1", "pairs": 2})
        self.assertEqual(self.asked("record"), {"recording": "nothing"})
        self.assertEqual(len(self.frames_of("r1")) >= 4, True)
        lines = self.logged()
        begun = lines.index("notice: the recording r1 begins")
        self.assertLess(begun, lines.index("notice: the recording r1 has ended"))
        played = self.asked("replay r1")
        self.assertEqual((played["same"], played["commands"], played["pairs"]),
                         ("yes", len(commands), 2))
        # The same commands to a daemon that has only the recording.
        script = "".join(f"{command}\n" for command in commands).replace(
            "capture\n", "capture p1\n").replace("capture static=yes", "capture p2 static=yes")
        done = subprocess.run(
            [VERGENCED, f"backend=replay {os.path.join(self.files, 'r1')}", "socket=none",
             f"files={self.files}", "store=none", "console=stdio", "confine=no"],
            input=script, text=True, capture_output=True, timeout=TIMEOUT_S)
        self.assertEqual(done.stdout.count("OK\n"), len(commands), done.stdout)
        played = self.frames_of("p1") + self.frames_of("p2")
        self.assertEqual(len(played), 4)
        self.assertTrue(set(played) <= set(self.frames_of("r1")))

    def test_capture(self):
        self.asked("window 320 240")
        answer = self.asked("capture one static=yes")
        self.assertEqual((answer["session"], answer["left"]["width"]), ("one", 320))
        with open(os.path.join(self.files, "one", "session.index"), encoding="ascii") as file:
            kept = dict(word.split("=") for word in file.read().split() if "_picture=" in word)
        names = ("brightness", "saturated", "black", "sharpness")
        for side in ("left", "right"):
            figures = [answer[side][name] for name in names]
            self.assertEqual(",".join(f"{10 * figure:.0f}" for figure in figures),
                             kept[f"{side}_picture"])
            self.assertGreater(figures[0], 1)
            self.assertGreater(figures[3], 10)
        self.assertEqual(len(self.frames_of("one")), 2)
        self.assertEqual(self.first.ask("capture one")[0][:12], "ERR ARGUMENT")
        self.assertEqual(self.first.ask("capture ../x")[0][:12], "ERR ARGUMENT")
        before = self.asked("status")["pairs"]
        for name in ("one", "../x", ".hid", "q\"x", "\"a b\"", "a\\b", "caf\u00e9", "'", "a;b"):
            for command in ("capture", "record start"):
                rejection, = self.first.ask(f"{command} {name}")
                self.assertEqual(rejection[:12], "ERR ARGUMENT", name)
        self.assertIn("A-Z a-z 0-9", self.first.ask("capture q\"x")[0])
        self.assertEqual(self.asked("status")["pairs"], before, "refused before any frame")
        self.assertEqual(self.first.ask("record"), ["recording: nothing", "OK"])
        other = self.asked("capture static=yes")
        self.assertNotIn("session", other, "only in memory")
        self.assertEqual(answer["pair"], 1, "of its session")
        self.asked("capture last")
        with open(os.path.join(self.files, "last", "session.index"), encoding="ascii") as file:
            self.assertEqual(file.read().count("_window=864,648,1"), 2)
        # The last one captured here, whatever other sessions exist.
        os.utime(os.path.join(self.files, "one", "session.index"), (4e9, 4e9))
        rejection, = self.first.ask("reconstruct")
        self.assertTrue(rejection.startswith("ERR MISSING last: no calibration in the session"), rejection)
        names = os.listdir(self.files)
        self.asked("capture")
        self.assertRegex(self.first.ask("reconstruct")[0], r"^ERR MISSING capture-[\d-]+: no calibration")
        self.assertEqual(os.listdir(self.files), names)


class Errors(RigTest):
    settings = ("rig.skew_limit=1ms", "rig.width=128px", "rig.height=96px")

    def test_a_past_fault_does_not_cause_a_safe_state(self):
        rejection = self.first.ask("capture")[-1]
        self.assertEqual(rejection[:9], "ERR MOVED")
        for command in ("status", "health"):
            reported = self.asked(command)
            self.assertEqual((reported["state"], reported["last_error"]), ("ready", rejection[10:]))
            self.assertNotIn("error", reported)
        self.asked("safe")
        self.assertRegex(self.first.ask("pan 1")[-1], "^ERR NOT_READY pan: .*safe state.*bringup")
        reported = self.asked("status")
        self.assertEqual([key for key in reported if "error" in key], [])

    def test_a_lasting_fault_is_reported_as_the_reason(self):
        self.fault("camera left unplug")
        self.addCleanup(self.fault, "camera left ok")
        rejection = self.first.ask("capture")[-1]
        self.assertEqual(self.asked("status")["error"], rejection.split(" ", 2)[2])
        self.asked("safe")
        self.assertIn(rejection.split(" ", 2)[2], self.first.ask("pan 1")[-1])


class RigsThatGo(DaemonTest):
    """The simulated rig ends, and returns or not."""
    settings = ("rig.width=128px", "rig.height=96px")

    def test_it_is_named_and_looked_for_again(self):
        first = self.client()
        self.assertEqual(first.ask("bringup")[-1], "OK")
        self.assertEqual(first.ask("wait 3")[-1], "OK")
        self.end(self.rig)
        for command in ("pan 5", "capture", "bringup"):
            answer = first.ask(command)[-1]
            self.assertRegex(answer, "^ERR (DEVICE|NOT_READY) .*simulated rig", command)
        self.assertRegex(answer, "no simulated rig at unix:.*is simrig running")
        type(self).begin_rig()
        self.assertEqual(first.ask("bringup")[-1], "OK")
        self.assertEqual(first.ask("pan 5")[-1], "OK")
        self.assertEqual(first.ask("capture again")[-1], "OK")
        self.assertNotIn("error", first.ask_json("status")["result"])


class RigsThatCome(DaemonTest):
    """The daemon is started before its rig."""
    settings = ("rig.width=128px", "rig.height=96px")

    @classmethod
    def begin_rig(cls, *words):
        pass

    def test_bringup_waits_for_it(self):
        first = self.client()
        self.assertIn(f"waiting for the rig at unix:{self.rig_path}", "\n".join(first.ask("log")))
        self.assertRegex(first.ask("pan 5")[-1], "^ERR NOT_READY .*bringup")
        self.assertRegex(first.begin("bringup"), r"^\.\.\. waiting for the simulated rig \d+/\d+$")
        first.send("\x03")
        self.assertRegex(first.begun_answer()[-1], "^ERR CANCELLED")
        first.begin("bringup")
        super().begin_rig()
        self.assertEqual(first.begun_answer()[-1], "OK")
        self.assertEqual(first.ask("pan 5")[-1], "OK")


class Log(RigTest):
    def test_the_log_reports_faults(self):
        """Each once: the answer, and the resulting state."""
        for fault, repair, command, name in (
                ("lens left zoom jam", "lens left zoom free", "zoom 700 side=left", "JAMMED"),
                ("camera left unplug", "camera left ok", "capture", "TIMEOUT"),
                ("bus scl", "bus ok", "pan 2 side=left", "I2C_STUCK"),
                ("serial silent", "serial ok", "zoom 400 side=left", "TIMEOUT")):
            self.asked("window 128 96")
            before = len(self.logged())
            self.fault(fault)
            self.addCleanup(self.fault, repair)
            answer = self.first.ask_json(command)
            self.assertEqual(answer["error"], name, answer)
            lines = self.logged()[before:]
            reported = [line for line in lines if answer["message"] in line]
            self.assertEqual(len(reported), 1, (fault, lines))
            self.assertIn(f"{command}: ERR {name} ", reported[0])
            self.assertTrue(reported[0].startswith("error: "), reported)
            state = self.first.ask_json("status")["result"]["state"]
            self.assertEqual("the instrument is in its safe state: " in reported[0], state == "safe")
            self.fault(repair)
            self.first.ask("safe")
            self.asked("bringup")
            self.assertIn("notice: the instrument is ready: bringup", self.logged()[-1])
            self.assertIn("safe state: ", "".join(self.logged()[before:]))
        # A wrong command is not logged as a fault.
        before = self.logged()
        for command in ("zoom 9000", "pan 400", "fly", "capture ../x", "fetch nothing"):
            self.assertEqual(self.first.ask(command)[-1][:4], "ERR ")
        self.assertEqual(self.logged(), before)


if __name__ == "__main__":
    unittest.main()

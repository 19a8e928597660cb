# SPDX-License-Identifier: Apache-2.0
"""A calibration of all zooms on the daemon: each pair gets the calibration of its own axes, in memory
and in its session; `aim` turns the cameras by it; axes outside its ranges are named."""
import glob
import math
import os
import re
import subprocess
import unittest
import zlib

from daemon_process import DaemonTest

TEXT = subprocess.run([os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True, check=True).stdout


def framed(text):
    """The text with the checksum that it needs."""
    body = text[:text.rindex(b"crc32 ")]
    return body + b"crc32 %08x\n" % zlib.crc32(body)


def lines_of(folder):
    with open(os.path.join(folder, "session.index"), encoding="ascii") as file:
        return [line.rsplit(" ", 1)[0] for line in file.read().splitlines()]


class ZoomCalibration(DaemonTest):
    def asking(self):
        """A client, and functions that give it a command: which works, or is refused."""
        client = self.client()

        def works(command):
            answer = client.ask_json(command)
            self.assertTrue(answer["ok"], (command, answer))
            return answer["result"]

        def refused(command, error, *words):
            answer = client.ask_json(command)
            self.assertEqual(answer["error"], error, (command, answer))
            for word in words:
                self.assertIn(word, answer["message"])

        return client, works, refused

    def test_pairs_and_aim(self):
        client, works, refused = self.asking()

        def calibrations(session):
            texts = {}
            for path in glob.glob(os.path.join(self.files, session, "calibration-*.txt")):
                with open(path, encoding="ascii") as file:
                    texts[os.path.basename(path)[12:20]] = file.read()
            lines = lines_of(os.path.join(self.files, session))
            return [texts[re.search(r"file=(\w+)", line).group(1)] for line in lines
                    if line.startswith("calibration ")]

        def value(text, field):
            return float(re.search(rf"^{field} (\S+)", text, re.M).group(1))

        with open(os.path.join(self.files, "instrument.zoom"), "wb") as file:
            file.write(TEXT)
        with open(os.path.join(self.files, "other.zoom"), "wb") as file:
            file.write(framed(TEXT.replace(b"instrument rig\n", b"instrument other\n")))
        with open(os.path.join(self.files, "edited.zoom"), "wb") as file:
            file.write(TEXT.replace(b"instrument rig\n", b"instrument other\n"))
        refused("calibration set edited.zoom", "CRC", "edited.zoom")
        works("bringup")
        refused("calibration set other.zoom", "MISMATCH", "other", "rig")
        refused("aim distance=1800", "MISSING", "calibration set")
        # What was accepted once stays usable, and each command says what does not fit.
        works("calibration set other.zoom accept-mismatch=yes")
        for command in ("zoom fit=300 distance=1800 plan=yes", "measure cup fit=300 near=1700 far=1900 plan=yes"):
            self.assertRegex(works(command)["accepted_mismatch"], '"rig".* made with "other"')
        refused("capture cup", "MISMATCH", "left pan", "unknown")
        refused("calibration set other.zoom", "MISMATCH", "other", "rig")
        shown = works("calibration set instrument.zoom")
        self.assertEqual((shown["id"], shown["left"]["zoom_max"]), ("default-rig", 850))
        self.assertEqual(works("calibration")["id"], "default-rig")
        health = client.ask_json("status")["result"]["health"]
        self.assertEqual((health["says"], health["moves"]), ("not known", 0))
        self.assertLess(health["hours"], 0.2)
        works("window 128 96")
        works("exposure 2000")
        refused("capture early", "MISMATCH", "left pan", "unknown")
        refused("aim", "MISSING", "distance")
        aimed = works("aim distance=1800")
        self.assertAlmostEqual(aimed["left"], 3.97, delta=0.3)
        turned = works("pan")
        self.assertAlmostEqual(turned["right"], aimed["right"], delta=0.01)
        # Rings that were never driven here.
        self.assertIn("left zoom was not driven since the bring-up", works("capture undriven")["note"])
        works("zoom 422")
        works("focus 500")
        status = works("status")
        self.assertEqual(status["calibration"], {"id": "default-rig", "match": "yes"})
        self.assertEqual(status["health"]["moves"], 3)  # aim, zoom, focus
        self.assertNotIn("note", works("capture one"))
        text, = calibrations("one")
        self.assertIn("vergence-calibration 3\nid default-rig\n", text)
        self.assertIn("axes_in_sigma yes\n", text)
        self.assertAlmostEqual(value(text, "left_zoom_counts"), 422, delta=3)
        self.assertAlmostEqual(value(text, "left_pan_deg"), aimed["left"], delta=0.05)
        zoom, = glob.glob(os.path.join(self.files, "one", "zoom-*.txt"))
        with open(zoom, "rb") as file:
            self.assertEqual(file.read(), TEXT)
        wide_px = value(text, "left_focal_px")
        # A recording: each pair has its own, and the right one while it is reconstructed.
        works("record start r1")
        works("bringup")
        works("window 128 96")
        works("exposure 2000")
        works("aim distance=1800 right=100")
        works("zoom 422")
        works("focus 500")
        works("capture")
        works("zoom 600")
        works("capture")
        works("record stop")
        first, second = calibrations("r1")
        self.assertAlmostEqual(value(first, "left_focal_px"), wide_px, delta=0.02 * wide_px)
        self.assertGreater(value(second, "left_focal_px"), 1.9 * wide_px)
        self.assertGreater(value(first, "left_pan_deg"), aimed["left"] + 2)
        info = subprocess.run([os.environ["VERGENCE"], "info", os.path.join(self.files, "r1")],
                              capture_output=True, text=True, timeout=120)
        self.assertEqual(info.returncode, 0, info.stderr)
        self.assertIn("matches", info.stdout)
        # The same from the file, on a PC, by the pair's name.
        export = os.path.join(self.folder, "second.txt")
        info = subprocess.run([os.environ["VERGENCE"], "info",
                               os.path.join(self.files, "instrument.zoom"), "--at",
                               os.path.join(self.files, "r1:2"), "--convert", export],
                              capture_output=True, text=True, timeout=120)
        self.assertEqual(info.returncode, 0, info.stderr)
        with open(export, encoding="ascii") as file:
            exported = file.read()
        for field in ("left_focal_px", "right_k1", "translation_right_left_mm", "yaw_sigma_rad"):
            self.assertEqual(value(exported, field), value(second, field))
        # A pair that the calibration does not reach.
        works("pan 24 side=left")
        self.assertRegex(works("status")["calibration"]["mismatch"], "left pan.*outside")
        refused("capture away", "MISMATCH", "left pan", "24.0", "20.000")
        self.assertFalse(os.path.exists(os.path.join(self.files, "away")))
        self.assertIn("left pan", works("capture anyway accept-mismatch=yes")["accepted_mismatch"])
        self.assertEqual(calibrations("anyway"), [])
        works("calibration set other.zoom accept-mismatch=yes")
        refused("capture away", "MISMATCH", "left pan", "24.0", "20.000")
        self.assertIn("other", works("aim distance=1800")["accepted_mismatch"])
        self.assertIn("other", works("capture accepted")["accepted_mismatch"])
        refused("reconstruct accepted", "MISMATCH", "other")
        works("calibration set instrument.zoom")
        self.assertNotIn("accepted_mismatch", works("aim distance=1800"))
        works("pan 24 side=left")
        refused("aim distance=200", "RANGE", "left", "20.000")
        refused("reconstruct anyway", "MISMATCH", "left pan", "outside")
        # A damaged record does not keep a calibration from being made.
        store = os.path.join(self.folder, "store")
        record, = (os.path.join(store, name) for name in os.listdir(store) if "calibration" in name)
        with open(record, "r+b") as file:
            file.seek(1000)
            file.write(b"?")
        refused("capture damaged", "CRC", "saved calibration", "cannot be read")
        self.assertIn("cannot be read",
                      works("capture damaged accept-mismatch=yes")["accepted_mismatch"])
        self.assertEqual(calibrations("damaged"), [])
        works("calibration forget")
        refused("reconstruct anyway", "MISSING", "calibration")
        with open(os.path.join(self.files, "cut.zoom"), "wb") as file:
            file.write(TEXT[:5000])
        refused("calibration set cut.zoom", "SYNTAX", "cut.zoom")

    def test_zoom_by_density_and_width(self):
        client, works, refused = self.asking()

        with open(os.path.join(self.files, "instrument.zoom"), "wb") as file:
            file.write(TEXT)
        works("bringup")
        refused("zoom density=10 distance=1800", "MISSING", "calibration set")
        works("calibration set instrument.zoom")
        works("window 640 480")
        refused("zoom density=10", "MISSING", "distance=MM", "autofocus")
        refused("zoom density=10 fit=300 distance=1800", "ARGUMENT", "not both")
        refused("zoom 5x density=10 distance=1800", "ARGUMENT", "POSITION")
        refused("zoom fit=300 distance=1800 sharp=1900:1700", "ARGUMENT", "nearer")
        # Cameras that look straight ahead see a thing in the middle in no small window.
        refused("zoom density=10 distance=1800", "RANGE", "aim distance=1800")
        works("aim distance=1800")
        before = works("zoom")["left"]["position"]
        planned = works("zoom density=10 distance=1800 sharp=1700:1900 plan=yes")
        self.assertAlmostEqual(works("zoom")["left"]["position"], before, delta=2)  # it moved nothing
        self.assertGreaterEqual(planned["density"], 10)
        self.assertLess(planned["density"], 10.2)
        self.assertIn("sharp", planned["iris"])
        # What is reached follows from the readings, which are a count or so off.
        reached = works("zoom density=10 distance=1800")
        self.assertAlmostEqual(reached["density"], 10, delta=0.4)
        for side in ("left", "right"):
            shown = works("zoom")[side]["position"]
            self.assertAlmostEqual(reached[side]["zoom"], shown, delta=2)
            self.assertAlmostEqual(reached[side]["zoom"], planned[side]["zoom"], delta=3)
            self.assertAlmostEqual(reached[side]["focus"], planned[side]["focus"], delta=3)
        self.assertLess(reached["sharp_near"], 1800)
        self.assertGreater(reached["sharp_far"], 1800)
        common = reached["common_error"]
        self.assertLess(common["pair"], common["unadjusted"])
        self.assertLess(common["other_zoom"], common["pair"])
        self.assertLess(common["board"], 0.5 * common["pair"])
        self.assertLess(reached["point_error"], common["board"])
        # The square of the width that a density leaves is what the window's pixels make of it.
        self.assertAlmostEqual(reached["width"] * math.sqrt(reached["density"]), 640, delta=30)
        fitted = works("zoom fit=120 distance=1800")
        self.assertAlmostEqual(fitted["width"], 120, delta=3)
        self.assertAlmostEqual(works("zoom distance=1800")["factor"], fitted["factor"], delta=0.05)
        refused("zoom density=5000 distance=1800", "RANGE", "5000 px/mm^2", "1800 mm", "2.", "to 2")
        refused("zoom fit=5000 distance=1800", "RANGE", "5000 mm", "to 4")
        works("aim distance=700")
        refused("zoom density=50 distance=700", "RANGE", "do not focus at 700 mm")
        # A recording has the rig's own commands, and replays without a calibration.
        works("aim distance=1800")
        works("record start wished")
        works("bringup")
        works("window 640 480")
        works("aim distance=1800")
        works("zoom density=20 distance=1800")
        works("zoom 5x")
        works("record stop")
        lines = [line for line in lines_of(os.path.join(self.files, "wished"))
                 if line.startswith("command ")]
        self.assertFalse([line for line in lines if "density" in line])
        self.assertTrue([line for line in lines if "zoom%205x" in line])
        self.assertEqual(works("replay wished")["same"], "yes")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""`info` on recorded sessions, against their index and their frames."""
import json
import os
import pathlib
import shutil
import unittest

import numpy

from pairs import Fixture, run
from recorded import Session

RECORDED = pathlib.Path(os.environ["VERGENCE_SESSIONS"])


class Info(Fixture):
    def output_text(self, *operands):
        done = run("info", *operands)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout

    def reported(self, session):
        return json.loads(self.output_text(session, "--json"))[0]

    def refused(self, words, session):
        done = run("info", session)
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (3, "", 1),
                         done.stderr)
        self.assertIn(words, done.stderr)

    def copy(self, name="cylinder_1x"):
        copied = self.directory / "copy"
        shutil.copytree(RECORDED / name, copied)
        return copied

    def test_a_pair_of_the_rig(self):
        session = RECORDED / "mug_3x"
        line = next(line for line in (session / "session.index").read_text().splitlines()
                    if line.startswith("pair "))
        index = dict(word.split("=") for word in line.split()[1:-1])
        reported = self.reported(session)
        self.assertEqual((reported["kind"], reported["profile"], reported["cut_off"], reported["pair_count"]),
                         ("session", "rig", False, 1))
        pair = reported["pairs"][0]
        self.assertEqual((pair["pair"], pair["skew_us"]), (1, int(index["skew_us"])))
        for side in ("left", "right"):
            shown = pair[side]
            pan_q4, *lens = index[f"{side}_before"].split(",")
            lens = [int(mean.split(":")[0]) / 16 for mean in lens]
            # An HS-322HD: 1500 us is the middle, 10.3 us per degree.
            self.assertAlmostEqual(shown["pan_deg"], (int(pan_q4) / 16 - 1500) / 10.3, delta=0.01)
            self.assertEqual([shown[axis][0] for axis in ("zoom", "focus", "iris")], lens)
            self.assertEqual(shown["exposure_us"], int(index[f"{side}_exposure_us"]))
            self.assertEqual("x".join(map(str, shown["size_px"])), index[f"{side}_size"])
            self.assertEqual(",".join(map(str, shown["window"].values())), index[f"{side}_window"])
            with open(session / f"frame-{index[f'{side}_frame']}.pnm", "rb") as file:
                data = file.read()
            values = numpy.frombuffer(data, ">u2", offset=len(data) - 2 * 672 * 440)
            self.assertAlmostEqual(shown["brightness_percent"], values.mean() / 1023 * 100,
                                   delta=0.06)
        # An old text without axis positions.
        self.assertIsNone(pair["calibration"]["matches"])
        text = self.output_text(session)
        for words in ("mug_3x: session\n", "pan 3.57 deg, ", f"zoom {pair['left']['zoom'][0]:g}", "closed in order",
                      "exposure 159994 us, gain 1", f"brightness {pair['left']['brightness_percent']:.1f} %", "unknown whether it matches"):
            self.assertIn(words, text)

    def test_pairs_of_two_cameras(self):
        """Without axis positions; the last one has another calibration."""
        session = Session(self.directory / "views")
        images = [numpy.full((48, 64), value, numpy.uint8) for value in (0, 51, 255)]
        session.pair(images[0], images[1])
        session.calibration(next((RECORDED / "mug_3x").glob("calibration-*")).read_bytes())
        session.pair(images[1], images[2])
        reported = self.reported(session.path)
        self.assertTrue(reported["cut_off"])
        first, second = reported["pairs"]
        self.assertIsNone(first["calibration"])
        self.assertFalse(second["calibration"]["matches"])
        self.assertIn("672 x 440", second["calibration"]["mismatch"])
        self.assertEqual([pair[side]["brightness_percent"] for pair in (first, second)
                          for side in ("left", "right")], [0, 20, 20, 100])
        self.assertEqual((first["left"]["black_percent"], second["right"]["saturated_percent"],
                          second["left"]["black_percent"]), (100, 100, 0))
        text = self.output_text(session.path)
        self.assertEqual(text.count("pair "), 2)
        for words in ("truncated", "none in the session", "does not match", "exposure not set"):
            self.assertIn(words, text)

    def test_a_session_without_a_pair(self):
        session = Session(self.directory / "none")
        self.assertEqual(self.reported(session.path)["pairs"], [])

    def test_among_other_files(self):
        reported = json.loads(self.output_text(RECORDED / "mug_3x", next((RECORDED / "mug_3x").glob("calib*")),
                                    RECORDED / "cylinder_1x", "--json"))
        self.assertEqual([page["kind"].split()[0] for page in reported],
                         ["session", "calibration", "session"])

    def test_damaged_ones_are_refused(self):
        for name, corrupt in (("session.index", lambda data: data.replace(b"skew", b"slew")),
                            ("calibration-", lambda data: data + b" "),
                            ("frame-", lambda data: data[:-1])):
            session = self.copy()
            for path in session.glob(name + "*"):
                path.write_bytes(corrupt(path.read_bytes()))
            self.refused(f"{session}/{name}", session)
            shutil.rmtree(session)
        done = run("info", RECORDED / "mug_3x", "--convert", self.directory / "new")
        self.assertEqual((done.returncode, (self.directory / "new").exists()), (3, False))


if __name__ == "__main__":
    unittest.main()

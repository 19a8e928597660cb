# SPDX-License-Identifier: Apache-2.0
"""Recorded sessions in place of pictures: `calibrate` uses all their pairs, `reconstruct` one."""
import json
import os
import pathlib
import shutil
import unittest

import cv2
import numpy

import boards
from calibrate_fixture import Fixture as Calibrating
from pairs import Fixture as Reconstructing
from pairs import run
from recorded import Session, add_notes

RECORDED = pathlib.Path(os.environ["VERGENCE_SESSIONS"])


class Calibrate(Calibrating):
    def captured(self):
        """One session per pair but the last two, which share one; in colour."""
        names = []
        for number, pair in enumerate(self.made):
            if number < len(self.made) - 1:
                session = Session(self.folder / f"board-{number + 1}")
                names.append(session.path)
            session.pair(*[cv2.cvtColor(image, cv2.COLOR_GRAY2RGB) for image in pair])
        return names

    def test_sessions_give_what_pictures_give(self):
        self.good()
        self.assert_good(self.run_on())
        pictures = (self.out / "rig.calibration").read_text()
        names = self.captured()
        self.assert_good(self.run_on(*names))
        output_text = ("id ", "crc", "instrument ", "left_pan", "right_pan", "left_zoom", "right_zoom",
                "left_focus", "right_focus", "left_iris", "right_iris")
        numbers = [line for line in pictures.splitlines() if not line.startswith(output_text)]
        self.assertIn("\ninstrument unknown\n", pictures)
        self.assertIn("\nleft_pan_deg unknown\n", pictures)
        for operands in (names, [self.folder / "board-*"]):
            self.assert_good(self.run_on(*operands))
            sessions = (self.out / "rig.calibration").read_text()
            self.assertEqual(numbers, [line for line in sessions.splitlines()
                                       if not line.startswith(output_text)])
            # Two cameras without motors.
            self.assertIn("\ninstrument two-cameras\n", sessions)
            self.assertIn("\nleft_pan_deg none\n", sessions)
            self.assertIn("\nright_zoom_counts none\n", sessions)

    def test_raw_frames_are_developed(self):
        for layout in ("grbg", "grey"):
            session = Session(self.folder / layout)
            for pair in self.made:
                raw = [image.copy() for image in pair]
                for image in raw:  # red and blue pixels see little light
                    image[::2, 1::2] //= 8
                    image[1::2, ::2] //= 8
                session.pair(*raw, layout=layout)
        self.assert_good(self.run_on(self.folder / "grbg"))
        developed_px = self.figures()["fit"]["rms_px"]
        self.assertLess(developed_px, 0.05)
        # The same pixels as grey show the board worse, through the pattern of the colours.
        if self.run_on(self.folder / "grey").returncode in (0, 5):
            self.assertGreater(self.figures()["fit"]["rms_px"], 2 * developed_px)

    def test_bad_sessions_are_refused_in_one_line(self):
        names = self.captured()
        index = names[3] / "session.index"
        good = index.read_bytes()
        frame = next(names[4].glob("frame-*"))
        for corrupt, words in (
                (lambda: index.write_bytes(good.replace(b"number=1", b"number=2")
                                           + b"end 00000000\n"),
                 f"{names[3]}/session.index: line 2"),
                (lambda: index.write_bytes(good.split(b"\n")[0] + b"\n"),
                 f"{names[3]}: "),
                (lambda: index.write_bytes(b"nonsense"), f"{names[3]}"),
                (lambda: (index.write_bytes(good), frame.write_bytes(frame.read_bytes()[:-1])),
                 f"{names[4]}/{frame.name}"),
                (frame.unlink, f"{names[4]}/{frame.name}: ")):
            corrupt()
            done = self.run_on(*names)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
            self.assertIn("vergence calibrate: " + words, done.stderr)
            self.assertFalse((self.out / "rig.calibration").exists())


class Reconstruct(Reconstructing):
    def measured(self, *operands):
        out = self.directory / "result"
        done = run("reconstruct", *operands, "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        return cv2.imread(str(out / "disparity.pfm"), cv2.IMREAD_UNCHANGED)

    def refused(self, words, *operands, code=3):
        done = run("reconstruct", *operands, "--out", self.directory / "none")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (code, 1), done.stderr)
        self.assertTrue(done.stderr.startswith("vergence reconstruct: "), done.stderr)
        for word in [words] if isinstance(words, str) else words:
            self.assertIn(word, done.stderr)
        self.assertFalse((self.directory / "none").exists())

    def test_a_recorded_session_with_its_own_calibration(self):
        session = RECORDED / "cylinder_1x"
        frames = sorted(session.glob("frame-*"))
        words = (session / "session.index").read_text().split()
        left, right = (next(word[-8:] for word in words if word.startswith(f"{side}_frame="))
                       for side in ("left", "right"))
        self.assertGreaterEqual(len(frames), 2)
        alone = self.measured(session)
        files = self.measured(session / f"frame-{left}.pnm", session / f"frame-{right}.pnm",
                              "--bayer", "grbg", "--calibration",
                              next(session.glob("calibration-*")))
        self.assertTrue(numpy.array_equal(alone, files, equal_nan=True))

    def test_every_result_reports_the_capture(self):
        """The skew between the frames, in every kind of output that has metadata."""
        strange = self.directory / "two\nlines"
        shutil.copytree(RECORDED / "cylinder_1x", strange)
        skew = next(word[8:] for word in (strange / "session.index").read_text().split()
                    if word.startswith("skew_us="))
        out = self.directory / "result"
        done = run("reconstruct", f"{strange}/", "--scale", "0.5", "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        reported = f"two?lines pair 1: skew {skew} us"
        self.assertIn(f"capture     {reported}\n", done.stdout)
        for name, words in (("report.html", reported), ("mesh.ply", f"comment capture {reported}\n"),
                            ("points.pcd", f"# capture {reported}\n"),
                            ("mesh.glb", f'"skew_us":{skew}'),
                            ("result.json", f'"skew_us": {skew}')):
            self.assertIn(words.encode(), (out / name).read_bytes(), name)
        self.assertIn(f" pair 1, skew {skew} us\n", run("info", out).stdout)
        # Pictures without a session have no capture data.
        self.measured(self.left_path, self.right_path, "--rectified", "--disparity", "0:48")
        self.assertIn(b'"capture": null', (out / "result.json").read_bytes())
        self.assertNotIn(b"comment capture", (out / "mesh.ply").read_bytes()[:2000])

    def test_which_pair(self):
        session = Session(self.directory / "session")
        images = [cv2.imread(str(path)) for path in (self.left_path, self.right_path)]
        rgb = [cv2.cvtColor(image, cv2.COLOR_BGR2RGB) for image in images]
        search = ["--rectified", "--disparity", "0:48"]
        self.refused((f"{session.path}: ", "no pair"), session.path, *search)
        session.pair(*rgb)
        first = self.measured(session.path, *search)
        self.assertTrue(numpy.array_equal(
            first, self.measured(self.left_path, self.right_path, *search), equal_nan=True))
        self.refused((f"{session.path}: ", "pair 2"), session.path, "--pair", 2, *search)
        session.pair(rgb[0][::-1].copy(), rgb[1][::-1].copy())
        self.assertTrue(numpy.array_equal(
            first, self.measured(session.path, "--pair", 1, *search), equal_nan=True))
        last = self.measured(session.path, *search)
        self.assertFalse(numpy.array_equal(first, last, equal_nan=True))
        self.assertTrue(numpy.array_equal(
            last, self.measured(session.path, "--pair", 2, *search), equal_nan=True))

    def test_only_the_pair_that_is_wanted_is_read(self):
        session = Session(self.directory / "session")
        images = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
                  for path in (self.left_path, self.right_path)]
        session.pair(*images)
        wanted = set(session.path.glob("frame-*"))
        session.pair(*[image[::-1].copy() for image in images])
        for frame in set(session.path.glob("frame-*")) - wanted:
            frame.write_bytes(b"damaged")
        search = ["--rectified", "--disparity", "0:48"]
        self.measured(session.path, "--pair", 1, *search)
        self.refused(f"{session.path}/frame-", session.path, *search)

    def test_measure_makes_the_surface_that_the_instrument_made(self):
        session = self.directory / "cylinder"
        shutil.copytree(RECORDED / "cylinder_1x", session)
        files = ["--files", "points.pcd,report.html"]

        def measure(*options, code=0, words=()):
            done = run("measure", session, *options, cwd=self.directory)
            self.assertEqual(done.returncode, code, done.stderr)
            if code != 0:
                self.assertEqual(done.stderr.count("\n"), 1)
                self.assertTrue(done.stderr.startswith(f"vergence measure: {session}: "), done.stderr)
            for word in words:
                self.assertIn(word, done.stderr)

        measure(code=3, words=["was not taken by measure", "vergence reconstruct"])
        add_notes(session, "# measure fit=900", "# measure step aim: it is <left> & far")
        measure(code=3, words=["ended before its surface"])
        add_notes(session, "# measure surface pair=1 near=1500.000 far=2100.000 scale=0.5 fill=yes")
        done = run("reconstruct", session, "--near", 1500, "--far", 2100, "--scale", 0.5, "--fill", *files,
                   "--out", self.directory / "plain")
        self.assertEqual(done.returncode, 0, done.stderr)
        measure(*files)
        made = self.directory / "cylinder-surface"
        points = (made / "points.pcd").read_bytes()
        self.assertEqual(points, (self.directory / "plain/points.pcd").read_bytes())
        report = (made / "report.html").read_text(encoding="utf-8")
        self.assertIn("Decisions", report)
        self.assertIn("it is &lt;left&gt; &amp; far", report)
        # Options replace the instrument's.
        measure("--scale=0.25", *files, "--out", self.directory / "coarse")
        self.assertLess(len((self.directory / "coarse/points.pcd").read_bytes()), len(points) / 2)
        os.symlink(session, self.directory / "-c")
        done = run("measure", "--scale=0.25", *files, "--", "-c", cwd=self.directory)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.directory / "-c-surface/points.pcd").exists())
        about, = json.loads(run("info", session, "--json").stdout)
        self.assertEqual(about["measured"]["request"], "fit=900")
        self.assertIn("pair=1", about["measured"]["surface"])
        about, = json.loads(run("info", RECORDED / "cylinder_1x", "--json").stdout)
        self.assertIsNone(about["measured"])
        # A later measurement in the same recording counts; what no instrument writes is not obeyed.
        for words in ("pair=1 out=elsewhere", "pair=1 debug=elsewhere", "depth=3", "pair=one", "pair=0",
                      "near=2000 far=1000", "scale=nan", "pair", "fill=maybe"):
            add_notes(session, "# measure fit=1", f"# measure surface {words}")
            measure(code=3, words=["another version", words])
            self.assertFalse((self.directory / "elsewhere").exists())
        # Nothing is written into a session.
        add_notes(session, "# measure fit=1", "# measure surface pair=1")
        before = sorted(os.listdir(session))
        for command in ("measure", "reconstruct", "export"):
            done = run(command, session, "--out", session, cwd=self.directory)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
            self.assertIn("is a session", done.stderr)
        self.assertEqual(sorted(os.listdir(session)), before)

    def test_a_session_that_was_cut_off_reports_so(self):
        session = Session(self.directory / "session")
        session.pair(*[cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
                       for path in (self.left_path, self.right_path)])
        search = ["--rectified", "--disparity", "0:48", "--out", self.directory / "result"]
        note = f"note: {session.path} "
        self.assertIn(note, run("reconstruct", session.path, *search).stderr)
        session.end()
        self.assertNotIn(note, run("reconstruct", session.path, *search).stderr)

    def test_what_is_wrong_is_reported_in_one_line(self):
        session = Session(self.directory / "session")
        session.pair(*boards.pairs(poses=boards.POSES[:1])[0])
        self.refused((f"{session.path}: ", "--calibration"), session.path)
        self.refused((f"{self.directory}: ", "session.index"), self.directory)
        nowhere = self.directory / "scnee"
        self.refused(f"{nowhere}: No such file or directory", nowhere)
        for words in (["info"], ["replay"], ["evaluate", "--ground-truth", "truth.pfm"],
                      ["calibrate", "--board", "9x6", "--square", "25", "--out", nowhere]):
            done = run(*words, nowhere)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
            self.assertIn(str(nowhere), done.stderr)
            self.assertIn("No such file or directory", done.stderr)
        self.refused("RIGHT", self.left_path, code=2)
        self.refused("--pair", self.left_path, self.right_path, "--pair",
                     1, "--rectified", code=2)
        for option in (["--bits", 10], ["--bayer", "grbg"], ["--raw", "20x30"]):
            self.refused("--bits, --bayer and --raw", session.path, "--rectified", *option, code=2)
        # A frame may claim any size: no memory is allocated for it before its file was checked.
        claimed = Session(self.directory / "claimed")
        claimed.pair(*boards.pairs(poses=boards.POSES[:1])[0], size="65535x65535")
        self.refused(f"{claimed.path}/frame-", claimed.path, "--rectified")
        self.refused(f"{claimed.path}/frame-", claimed.path, "--rectified", "--pair", 1)
        next(session.path.glob("frame-*")).write_bytes(b"P5\n1 1\n255\n0")
        self.refused(str(session.path) + "/frame-", session.path, "--rectified")


if __name__ == "__main__":
    unittest.main()

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
from pairs import VERGENCE, run
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
        # Options replace the instrument's, and near alone both depths.
        measure("--scale=0.25", "--near", 2150, *files, "--out", self.directory / "coarse")
        self.assertLess(len((self.directory / "coarse/points.pcd").read_bytes()), len(points) / 2)
        os.symlink(session, self.directory / "-c")
        done = run("measure", "--scale=0.25", *files, "--", "-c", cwd=self.directory)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue((self.directory / "-c-surface/points.pcd").exists())
        self.assertEqual(run("measure", session, "--all", cwd=self.directory).returncode, 2)
        add_notes(session, "# measure fit=2", "# measure step zoom out")  # cancelled: it does not hide the other
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


class All(Reconstructing):
    """`--all`: a session of three pairs, and a directory of sessions."""

    SEARCH = ("--rectified", "--disparity", "0:48", "--files", "disparity.pfm,result.json")

    def setUp(self):
        super().setUp()
        self.rgb = [cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
                    for path in (self.left_path, self.right_path)]
        self.sessions = self.directory / "sessions"
        self.sessions.mkdir()
        self.session = self.recorded("first", 3)
        self.results = self.directory / "results"

    def recorded(self, name, pairs):
        session = Session(self.sessions / name)
        for number in range(pairs):
            session.pair(*[numpy.roll(image, number, axis=0) for image in self.rgb])
        session.end()
        return session.path

    def all(self, *operands, code=0):
        done = run("reconstruct", *operands, "--all", *self.SEARCH, "--out", self.results)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def rows(self):
        return json.loads((self.results / "pairs.json").read_text())["pairs"]

    def stamps(self):
        return {path: path.stat().st_mtime_ns for path in sorted(self.results.rglob("disparity.pfm"))}

    def test_each_pair_is_measured_as_alone_and_once(self):
        lines = self.all(self.session).stdout.splitlines()
        self.assertEqual([line.split()[0] for line in lines], ["pair", "0001", "0002", "0003", "3"])
        self.assertIn("3 measured", lines[-1])
        for number in (1, 2, 3):
            run("reconstruct", self.session, "--pair", number, *self.SEARCH, "--out", self.out)
            self.assertEqual((self.out / "disparity.pfm").read_bytes(),
                             (self.results / f"000{number}/disparity.pfm").read_bytes())
            points = json.loads((self.out / "result.json").read_text())["counts"]["vertices"]
            self.assertEqual(self.rows()[number - 1]["points"], points)
        before = self.stamps()
        self.assertIn("0 measured", self.all(self.session).stdout)
        self.assertEqual(self.stamps(), before)
        printed = run("reconstruct", self.session, "--all", *self.SEARCH, "--out", self.results, "--json").stdout
        self.assertEqual(json.loads(printed)["pairs"], self.rows())

    def test_only_what_would_differ_is_made_again(self):
        self.all(self.session)
        before = self.stamps()
        for path in (self.results / "0002").iterdir():
            path.unlink()
        self.assertIn("1 measured", self.all(self.session).stdout)
        after = self.stamps()
        self.assertEqual([path.parent.name for path in after if after[path] != before[path]], ["0002"])
        done = run("reconstruct", self.session, "--all", *self.SEARCH, "--speckle", 20, "--out", self.results)
        self.assertIn("3 measured", done.stdout)
        (self.results / "pairs.json").write_text("[")
        self.assertIn("3 measured", self.all(self.session).stdout)

    def test_a_bad_pair_and_a_bad_session_stop_nothing(self):
        second = self.recorded("second", 1)
        self.recorded("third", 1)
        newer = Session(self.sessions / "fourth")
        newer.index = b""
        newer.line("begin version=99 build=test profile=two-cameras date=2026-11-22T00:00:00Z")
        frames = [word[-8:] for word in (self.session / "session.index").read_text().split()
                  if word.startswith("left_frame=")]
        frame = self.session / f"frame-{frames[1]}.pnm"
        content = frame.read_bytes()
        frame.write_bytes(content[:-1])
        index = (second / "session.index").read_bytes()
        (second / "session.index").write_bytes(b"nonsense")
        done = self.all(self.sessions, code=3)
        self.assertEqual(done.stderr.count("\n"), 3, done.stderr)
        self.assertIn("fourth: a session of version 99 (this program reads up to 6", done.stderr)
        self.assertIn("vergence reconstruct: first/0002: ", done.stderr)
        self.assertIn("vergence reconstruct: second: ", done.stderr)
        self.assertIn("3 measured", done.stdout)
        self.assertIn("3 failed", done.stdout)
        self.assertEqual([row["result"] for row in self.rows()],
                         ["first/0001", None, "first/0003", None, None, "third/0001"])
        frame.write_bytes(content)
        (second / "session.index").write_bytes(index)
        shutil.rmtree(newer.path)
        self.assertIn("2 measured", self.all(self.sessions).stdout)

    def test_a_kill_keeps_what_is_finished(self):
        """Killed where the second pair's results would appear."""
        trace = ["strace", "-f", "-o", "/dev/null", "-e", "trace=rename",
                 "-e", "inject=rename:signal=KILL:when=2"]
        done = run(*trace[1:], VERGENCE, "reconstruct", self.session, "--all", *self.SEARCH, "--out",
                   self.results, program=trace[0])
        self.assertNotEqual(done.returncode, 0)
        kept = len(self.stamps())
        self.assertLess(kept, 3)
        self.all(self.session)
        self.assertEqual([row["result"] for row in self.rows()], ["0001", "0002", "0003"])

    def test_a_full_disk_and_a_key_end_it_in_one_line(self):
        for inject, code, words in (("rename:error=ENOSPC:when=2+", 1, "no space; the same command continues"),
                                    ("rename:signal=INT:when=1", 130, "interrupted; the same command continues")):
            # The search for leaks does not work where strace looks on.
            done = run("-f", "-o", "/dev/null", "-E", "ASAN_OPTIONS=detect_leaks=0",
                       "-e", "trace=rename,renameat", "-e", f"inject={inject}", VERGENCE,
                       "reconstruct", self.session, "--all", *self.SEARCH, "--out", self.results,
                       program="strace")
            with self.subTest(inject):
                self.assertEqual(done.returncode, code, done.stderr)
                self.assertIn(words, done.stderr)
                shutil.rmtree(self.results)

    def test_what_cannot_be_combined(self):
        for operands, words, code in (
                ((self.left_path, self.right_path), "requires a recorded session", 2),
                ((self.session, "--pair", 2), "cannot be combined", 2),
                ((self.directory,), "neither a session nor a directory of sessions", 3)):
            done = run("reconstruct", *operands, "--all", *self.SEARCH, "--out", self.results)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (code, 1), done.stderr)
            self.assertIn(words, done.stderr)
            self.assertFalse(self.results.exists())
        done = run("reconstruct", self.session, "--all", *self.SEARCH, "--out", self.session)
        self.assertEqual(done.returncode, 1)
        self.results.mkdir()
        (self.results / "pairs.json").write_text("mine")
        done = run("reconstruct", self.session, "--all", *self.SEARCH, "--out", self.results)
        self.assertEqual(done.returncode, 1)
        self.assertIn("was not written by vergence", done.stderr)
        self.assertEqual((self.results / "pairs.json").read_text(), "mine")


if __name__ == "__main__":
    unittest.main()

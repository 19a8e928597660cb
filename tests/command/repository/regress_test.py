# SPDX-License-Identifier: Apache-2.0
"""tools/regress: the recorded sessions match their references; every change is detected, reported
and limited by a tolerance."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time
import unittest
import zlib

import cv2
import numpy

import pairs
from pairs import VERGENCE
from regress_fixture import SOURCE, Recorded, regress
from waiting import wait_until

import files
import reference
from result import NONE
from session import Unusable

RECORDED = pathlib.Path(os.environ["VERGENCE_SESSIONS"])
SESSIONS = sorted(path.parent for path in RECORDED.glob("*/session.index"))
MAX_BYTES = 2_000_000


class Regress(Recorded):
    def change_reference(self, change):
        """Alters the stored result, and makes the files consistent again."""
        (result,), reported = reference.load(self.folder)
        change(result)
        accepted = reported["accepted"][0]
        reference.save(self.folder, ["pair"], [result], accepted["reason"], accepted["build"],
                       accepted["date"])

    def test_nothing_changed(self):
        self.accept("because it is the first")
        done = self.compare(0)
        self.assertIn("because it is the first", done.stdout)
        self.assertNotIn("BAD", done.stdout)
        picture = cv2.imread(str(self.pictures / "recorded-pair.png"))
        self.assertGreater(picture.shape[1], 3 * 240)

    def test_one_pixel_is_seen_and_a_tolerance_respected(self):
        self.accept()

        def change(result):
            rows, columns = numpy.nonzero(result.steps != NONE)
            result.steps[rows[5000], columns[5000]] += 1
        self.change_reference(change)
        done = self.compare(1)
        self.assertRegex(done.stdout, r"BAD  disparity_off_percent")
        self.assertEqual(done.stdout.count("BAD"), 1)
        picture = cv2.imread(str(self.pictures / "recorded-pair.png"))
        self.assertGreater((picture == (0, 160, 255)).all(-1).sum(), 0, "a rim around the pixel")
        self.options(arguments=["--disparity", "0:48"], tolerance={"disparity_off_percent": 1})
        self.compare(0)
        self.options(arguments=["--disparity", "0:48"], tolerance={"disparity_px": 0.01})
        self.compare(0)
        self.options(arguments=["--disparity", "0:48"], tolerance={"disparity_px": 0.003})
        self.compare(1)

    def test_each_kind_of_change_is_reported_by_its_name(self):
        self.accept()

        def reason(result):
            result.reasons[3, 4] ^= 1

        def point(result):
            place = tuple(numpy.argwhere(numpy.isfinite(result.points[..., 0]))[0])
            result.points[place] += 0.5

        def figure(result):
            result.figures["vertices"] += 1
        for change, word in ((reason, "reasons_changed"), (point, "points_off"),
                             (figure, "vertices")):
            kept = {p.name: p.read_bytes() for p in (self.folder / "regress").iterdir()}
            self.change_reference(change)
            done = self.compare(1, "--json")
            (report,) = json.loads(done.stdout)
            bad = [row[0] for row in report["pairs"][0]["rows"] if row[1] > row[2]]
            self.assertEqual(len(bad), 1, bad)
            self.assertIn(word, bad[0])
            shutil.rmtree(self.folder / "regress")
            (self.folder / "regress").mkdir()
            for name, data in kept.items():
                (self.folder / "regress" / name).write_bytes(data)

    def test_accept_keeps_all_reasons(self):
        self.accept("first")
        self.options(arguments=["--disparity", "0:20"])
        self.compare(1)
        self.accept("fewer disparities are searched")
        self.compare(0)
        reported = json.loads((self.folder / "regress" / "reference.json").read_text())
        self.assertEqual([a["reason"] for a in reported["accepted"]],
                         ["first", "fewer disparities are searched"])
        for accepted in reported["accepted"]:
            self.assertRegex(accepted["date"], r"^\d{4}-\d\d-\d\d$")
            self.assertTrue(accepted["build"])
        self.assertEqual(len(list((self.folder / "regress").glob("*.npz"))), 1)

    def test_what_is_no_directory_is_refused(self):
        for path, word in ((self.directory / "nosuch", "no such"),
                           (self.folder / "calibration.txt", "not a directory")):
            for options in ((), ("--accept", "first"), ("--json",), ("--json", "--accept", "x")):
                done = regress(*options, path)
                self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1))
                self.assertRegex(done.stderr, f"^tools/regress: {re.escape(str(path))}: .*{word}")
                why = done.stderr.removeprefix("tools/regress: ").strip()
                reported = [{"directory": str(path), "error": why}]
                self.assertEqual(json.loads(done.stdout or "[]"), reported * ("--json" in options))

    def test_what_is_no_file_is_not_waited_for(self):
        self.accept()
        session = self.directory / "session"
        shutil.copytree(SESSIONS[0], session)
        both = ["regress/options.json", "regress/reference.json", "regress/pair-*.npz"]
        for folder, names in ((self.folder, ["left.png", "calibration.txt", *both]),
                              (session, ["session.index", "calibration-*", *both])):
            for name in names:
                aside = (path := next(folder.glob(name))).rename(folder / "aside")
                os.mkfifo(path)
                done = regress("--out", self.pictures, folder, timeout=60)
                self.assertEqual((done.returncode, done.stdout), (3, ""))
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn(f"{path}: not a regular file", done.stderr)
                aside.replace(path)

    def test_damage_is_refused(self):
        self.refused("no reference", "--accept")
        self.accept()
        path = self.folder / "regress" / "reference.json"
        good = path.read_text()
        path.write_text(good.replace("first", "worst"))
        self.refused("reference.json", "damaged")
        path.write_text(good[:-20])
        self.refused("reference.json", "JSON")
        path.write_text(good)
        (packed,) = (self.folder / "regress").glob("*.npz")
        data = bytearray(packed.read_bytes())
        data[len(data) // 2] ^= 1
        packed.write_bytes(data)
        self.refused(packed.name, "damaged")
        packed.unlink()
        self.refused(packed.name)

    def test_accept_replaces_a_damaged_reference_and_nothing_else(self):
        self.accept("first")
        where = self.folder / "regress"
        path = where / "reference.json"
        (result,), good = reference.load(self.folder)
        first = good["accepted"][0]
        others = [self.folder / "victim", where / "notes.txt", where / "pair-12.npz"]
        names = ["../victim", "notes.txt", "pair-12.npz", str(others[0]), ".", "", "options.json"]
        for file in others:
            file.write_text("kept")
        for text, kept in (
                (json.dumps({"pairs": [{"file": name} for name in names]}), 0),
                (json.dumps({**good, "pairs": [{"file": "../victim"}]}), 1),
                (json.dumps({**good, "accepted": [first, 3, {**first, "date": 3}]}), 1),
                ('{"accepted":3}', 0), ('{"pairs":[{}]}', 0), ('{"pairs":[3]}', 0),
                ('{"pairs":{"file":3}}', 0), ("[]", 0), ("no JSON", 0), ("", 0), ("\udcff", 0),
                ("[" * 100_000, 0), (path.read_text()[:-20], 0)):
            path.write_text(text, errors="surrogateescape")
            with self.subTest(text=text[:80]):
                note = reference.save(self.folder, ["pair"], [result], "again", "b", "2026-01-01")
                self.assertNotIn("\n", note)
                self.assertIn(f"{path}: ", note)
                self.assertIn(f"acceptances kept: {kept}", note)
                reported = reference.load(self.folder)[1]
                self.assertEqual(reported["accepted"][:-1], [first] * kept)
                self.assertEqual(reported["accepted"][-1]["reason"], "again")
                self.assertEqual([file.read_text() for file in others], ["kept"] * 3)
                self.assertEqual({file.name for file in where.iterdir()},
                                 {"notes.txt", "pair-12.npz", "options.json", "reference.json",
                                  reported["pairs"][0]["file"]})
        path.write_text("no JSON")
        self.assertRegex(self.accept("text").stderr, "^tools/regress: .*not JSON.*kept: [0-9]+\n$")
        self.assertEqual(self.accept("whole").stderr, "")

    def test_accept_writes_through_no_link(self):
        self.accept()
        where, victim = self.folder / "regress", self.folder / "victim"
        victim.write_text("kept")
        (packed,) = where.glob("*.npz")
        packed.unlink()
        for name in (packed.name, packed.name + ".part", "reference.json.part",
                     "pair-00000000.npz"):
            (where / name).symlink_to(victim)
        self.accept()
        self.assertEqual(victim.read_text(), "kept")
        self.assertEqual({file.name for file in where.iterdir()},
                         {packed.name, "options.json", "reference.json"})
        self.assertFalse(packed.is_symlink())

    def test_a_reference_of_another_form_is_refused(self):
        self.accept()
        path = self.folder / "regress" / "reference.json"
        good = json.loads(path.read_text())
        (pair,) = good["pairs"]
        for change in ({"accepted": 3}, {"accepted": []}, {"accepted": [{}]}, {"pairs": 3},
                       {"pairs": [{}]}, {"pairs": [{**pair, "file": "../regress/" + pair["file"]}]},
                       {"pairs": [{**pair, "figures": {"vertices": "3"}}]}):
            reported = {**good, **change}
            reported["crc32"] = reference.own_crc(reported)
            path.write_text(json.dumps(reported))
            with self.subTest(change=change):
                with self.assertRaisesRegex(Unusable, "reference.json: .*--accept"):
                    reference.load(self.folder)
        self.refused("reference.json", "--accept")

    def test_directories_of_one_name_have_pictures_of_their_own(self):
        self.accept()
        folders = [self.directory / name for name in ("p/S", "q/S", "S-2", "r/S")]
        for folder in folders:
            shutil.copytree(self.folder, folder)
        done = regress("--out", self.pictures, "--json", *folders)
        self.assertEqual(done.returncode, 0, done.stderr)
        pictures = [report["pairs"][0]["picture"] for report in json.loads(done.stdout)]
        self.assertEqual([pathlib.Path(picture).name for picture in pictures],
                         ["S-pair.png", "S-2-pair.png", "S-2-2-pair.png", "S-3-pair.png"])
        self.assertEqual({str(path) for path in self.pictures.iterdir()}, set(pictures))

    @staticmethod
    def crafted(index, kind, word, by):
        """The session's index with a word of its events of this kind replaced, and CRCs that fit."""
        crc, lines = 0, []
        for line in index.splitlines():
            body = line[:-9]
            if body.startswith(kind + b" "):
                body = re.sub(rb" %s=\S+" % word, by, body)
            lines.append(body + b" %08x\n" % zlib.crc32(body, crc))
            crc = zlib.crc32(lines[-1], crc)
        return b"".join(lines)

    def test_a_damaged_session_is_refused(self):
        session = self.directory / "session"
        shutil.copytree(SESSIONS[0], session)
        index = session / "session.index"
        good = index.read_bytes()
        lines = good.splitlines(keepends=True)
        index.write_bytes(b"".join([lines[0].replace(b"rig", b"rug"), *lines[1:]]))
        self.assertIn("line 1 ", regress(session).stderr)
        # What a kill cut off counts as never written.
        index.write_bytes(good[:-5])
        self.assertEqual(regress("--out", self.pictures, session).returncode, 0)
        index.write_bytes(lines[0])
        self.assertIn("no pair", regress(session).stderr)
        for kind, word, by, why in (
                # Files of the reference are named after it.
                (b"pair", b"number", b" number=../1", "pair ../1: "),
                (b"pair", b"number", b"", "no number"),
                (b"pair", b"left_frame", b" left_frame=../../1", "left_frame is ../../1 "),
                (b"pair", b"left_layout", b"", "no left_layout"),
                (b"begin", b"version", b" version", "KEY=VALUE: version"),
                (b"begin", b"build", b" build=\xe9", "line 1 "),
                (b"calibration", b"file", b"", "no file")):
            index.write_bytes(self.crafted(good, kind, word, by))
            done = regress(session)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
            self.assertIn(why, done.stderr)
        index.write_bytes(good)
        for frame in session.glob("frame-*"):
            frame.write_bytes(frame.read_bytes()[:-1] + b"\0")
        done = regress(session)
        self.assertEqual(done.returncode, 3)
        self.assertIn("CRC-32", done.stderr)


class Ends(Recorded):
    """Failures outside the measurement: outputs, programs and signals."""

    def setUp(self):
        super().setUp()
        self.work = self.directory / "temporary"
        self.work.mkdir()
        self.environment = {**os.environ, "TMPDIR": str(self.work)}

    def start(self, program, *arguments, **streams):
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
        return subprocess.Popen([SOURCE / "tools" / "regress", "--vergence", program,
                                 *map(str, arguments)], text=True, env=self.environment, **streams)

    def ended(self, code, process):
        """Its message: at most one line, and no temporary files are left."""
        output, complaint = process.communicate(timeout=60)
        self.assertEqual(process.returncode, code, complaint)
        self.assertLessEqual(complaint.count("\n"), 1, complaint)
        self.assertNotIn("Errno", complaint)
        self.assertNotIn(str(self.work), complaint)
        self.assertEqual(list(self.work.iterdir()), [])
        return output, complaint

    def program(self, text):
        path = self.directory / "program"
        path.write_text("#!/bin/sh\n" + text)
        path.chmod(0o755)
        return path

    def test_an_output_that_fails_is_no_difference(self):
        for arguments in (["--accept", "first", self.folder], ["--json", self.folder], ["--help"]):
            with open("/dev/full", "w") as full:
                process = self.start(VERGENCE, "--out", self.out, *arguments, stdout=full)
            self.assertEqual(self.ended(3, process)[1], "tools/regress: standard output: No space "
                             "left on device\n")
        closed = self.start(VERGENCE, "--accept", "closed", self.folder, stdout=None,
                            preexec_fn=lambda: os.close(1))
        self.assertRegex(self.ended(3, closed)[1], "^tools/regress: standard output .*closed\n$")
        with open("/dev/full", "w") as full:
            process = self.start(VERGENCE, "--nonsense", stderr=full)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 2)

    def test_a_pipe_that_closes_ends_quietly(self):
        for arguments in (["--accept", "first", self.folder], ["--json", self.folder], ["--help"]):
            read_end, write_end = os.pipe()
            os.close(read_end)
            process = self.start(VERGENCE, "--out", self.out, *arguments, stdout=write_end)
            os.close(write_end)
            self.assertEqual(self.ended(141, process)[1], "")

    def test_signals_end_it_with_one_line_and_leave_nothing(self):
        began = self.directory / "began"
        slow = self.program('mkdir -p "$6"; : >"$6/.part"; : >"' + str(began) + '"; exec sleep 60')
        for number, code in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)):
            process = self.start(slow, "--accept", "first", self.folder)
            wait_until(lambda: began.exists() or process.poll() is not None)
            self.assertEqual(len(list(self.work.iterdir())), 1)
            process.send_signal(number)
            self.assertEqual(self.ended(code, process), ("", "tools/regress: interrupted\n"))
            self.assertEqual([file.name for file in (self.folder / "regress").iterdir()],
                             ["options.json"])
            began.unlink()

    @staticmethod
    def catches(process, number):
        """Whether the process has a handler of this signal."""
        for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines():
            if line.startswith("SigCgt:"):
                return bool(int(line.split()[1], 16) >> (number - 1) & 1)
        return False

    def test_an_early_signal_is_reported_as_well(self):
        random = numpy.random.default_rng(pairs.SEED)
        for delay in random.uniform(0, 1.0, 4):
            process = self.start(VERGENCE, "--accept", "first", self.folder)
            # Until then Python starts up and has its own reaction.
            wait_until(lambda: self.catches(process, signal.SIGHUP) or process.poll() is not None,
                       interval_s=0.001)
            self.assertIsNone(process.poll(), "it never took over")
            time.sleep(delay)
            process.send_signal(signal.SIGINT)
            output, complaint = process.communicate(timeout=60)
            self.assertIn((process.returncode, complaint),
                          [(0, ""), (130, "tools/regress: interrupted\n")], delay)
            self.assertEqual(list(self.work.iterdir()), [])
            self.assertEqual(list((self.folder / "regress").glob("*.part")), [])

    def test_a_program_without_a_result_is_named(self):
        there = 'mkdir "$6"; '
        for text, words in (("", "result.json"), (there + ': >"$6/result.json"', "result.json"),
                            (there + 'echo "{}" >"$6/result.json"', "build_id"),
                            (there + """echo '{"build_id":"b"}' >"$6/result.json\"""", "disparity"),
                            ("exit 7", "7"), ("echo one >&2; printf 'two\\377\\n' >&2; exit 1",
                                              "two"), ("kill -9 $$", "9")):
            program = self.program(text)
            with self.subTest(text=text):
                complaint = self.ended(3, self.start(program, "--accept", "x", self.folder))[1]
                self.assertIn(str(program), complaint)
                self.assertIn(words, complaint)

    def test_the_system_s_rejections_name_the_file(self):
        accepted = self.start(VERGENCE, "--accept", "first", self.folder)
        self.ended(0, accepted)
        file = self.folder / "calibration.txt"
        self.assertEqual(self.ended(3, self.start(VERGENCE, "--out", file / "x", self.folder))[1],
                         f"tools/regress: {file / 'x'}: Not a directory\n")
        self.assertEqual(self.ended(3, self.start(VERGENCE, "--out", file, self.folder))[1],
                         f"tools/regress: {file}: Not a directory\n")
        (self.directory / "taken" / "recorded-pair.png").mkdir(parents=True)
        taken = self.directory / "taken"
        self.assertEqual(self.ended(3, self.start(VERGENCE, "--out", taken, self.folder))[1],
                         f"tools/regress: {taken / 'recorded-pair.png'}: Is a directory\n")
        self.assertEqual(list(taken.glob("*.part")), [])
        self.assertEqual(files.output_text(PermissionError(13, "Permission denied", "/x")),
                         "/x: Permission denied")

    @unittest.skipIf(os.geteuid() == 0, "the superuser may do everything")
    def test_what_may_not_be_read_or_written_is_reported(self):
        locked = self.directory / "locked"
        locked.mkdir(mode=0o500)
        self.addCleanup(locked.chmod, 0o700)
        self.ended(0, self.start(VERGENCE, "--accept", "first", self.folder))
        self.assertRegex(self.ended(3, self.start(VERGENCE, "--out", locked, self.folder))[1],
                         f"^tools/regress: {locked}/.*: Permission denied\n$")
        locked.chmod(0)
        for folder in (locked, locked / "below"):
            self.assertRegex(self.ended(3, self.start(VERGENCE, folder))[1],
                             f"^tools/regress: {locked}.*: Permission denied\n$")


class Sessions(unittest.TestCase):
    def test_there_are_some_and_they_are_small(self):
        self.assertGreaterEqual(len(SESSIONS), 3)
        for session in SESSIONS:
            size = sum(path.stat().st_size for path in session.rglob("*") if path.is_file())
            self.assertLessEqual(size, MAX_BYTES, session)

    def test_they_are_as_accepted(self):
        done = regress("--out", os.environ.get("TMPDIR", "/tmp") + "/vergence-regress-test",
                       *SESSIONS)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(done.stdout.count(": as accepted on"), len(SESSIONS))


if __name__ == "__main__":
    unittest.main()

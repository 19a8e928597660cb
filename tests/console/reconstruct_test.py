# SPDX-License-Identifier: Apache-2.0
"""Surfaces from recorded pairs at the console of a confined daemon: the same bytes as from the
command line, cancelled and rejected without leftovers, with the right calibration for the
window."""
import glob
import json
import math
import os
import re
import resource
import shutil
import subprocess
import tempfile
import time
import unittest
import urllib.parse
import zlib

import numpy

from daemon_process import TIMEOUT_S, VERGENCE, DaemonTest, small_stack
from fake_devices import preloaded
from results import result_names

SESSION = os.path.join(os.environ["VERGENCE_SESSIONS"], "cylinder_1x")
SAME = {"mesh.ply", "points.pcd", "disparity.pfm", "reasons.pgm"}  # of the same pair
FILES = SAME | {"surface.compact", "result.json"}                 # which state times
SENSOR = (2048, 1536)
WINDOW = (672, 400)


STAMP = re.compile(rb"^(comment|#) (capture \S+ pair \d+: |left: |right: )[^\n]+\n", re.MULTILINE)


def framed_index(lines):
    """Writes an index of these events, each line with its CRC."""
    text = b""
    for line in lines:
        text += line.encode()
        text += b" %08x\n" % zlib.crc32(text)
    return text


def lines_of(folder):
    with open(os.path.join(folder, "session.index"), encoding="ascii") as file:
        return [line.rsplit(" ", 1)[0] for line in file.read().splitlines()]


def calibration_of(folder):
    path, = glob.glob(os.path.join(folder, "calibration-*.txt"))
    with open(path, encoding="ascii") as file:
        return file.read()


def resized(text, size, shift, sides=("left", "right")):
    """A calibration for frames of another size and offset."""
    text = re.sub(r"(\w+_size_px) .*", rf"\1 {size[0]} {size[1]}", text)
    for side in sides:
        x, y = map(float, re.search(rf"{side}_centre_px (\S+) (\S+)", text).groups())
        text = re.sub(rf"{side}_centre_px .*",
                      f"{side}_centre_px {x + shift[0]:.9f} {y + shift[1]:.9f}", text)
    body = text[:text.index("crc32 ")]
    return f"{body}crc32 {zlib.crc32(body.encode()):08x}\n"


class Surfaces(DaemonTest):
    settings = ("profile=rig",)

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="console")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.path = os.path.join(cls.folder, "v.sock")
        cls.files = os.path.join(cls.folder, "files")
        cls.start()

    @classmethod
    def arguments(cls):
        return [f"backend=replay {SESSION}", f"socket={cls.path}", f"files={cls.files}",
                f"store={os.path.join(cls.folder, 'store')}", *cls.settings]

    def setUp(self):
        self.first = self.client()
        self.first.ask("calibration forget")
        for name in os.listdir(self.files):
            path = os.path.join(self.files, name)
            shutil.rmtree(path) if os.path.isdir(path) else os.unlink(path)

    def session(self, name, calibration=True, window=None):
        """Copies the recorded session without its calibration, with another recorded window."""
        folder = os.path.join(self.files, name)
        shutil.copytree(SESSION, folder, ignore=shutil.ignore_patterns("regress", "calls.log"))
        lines = [line for line in lines_of(folder)
                 if calibration or not line.startswith("calibration")]
        lines = [re.sub(r" (left|right)_window=\S+", "", line) for line in lines]
        if window:
            lines = [re.sub(r"((left|right)_after=\S+)", rf"\1 \2_window={window}", line)
                     for line in lines]
        with open(os.path.join(folder, "session.index"), "wb") as file:
            file.write(framed_index(lines))
        return folder

    def keep(self, text):
        with open(os.path.join(self.files, "kept.txt"), "w", encoding="ascii") as file:
            file.write(text)
        self.assertTrue(self.first.ask_json("calibration set kept.txt")["ok"])

    def asked(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]

    def refused(self, command):
        answer = self.first.ask_json(command)
        self.assertFalse(answer["ok"], answer)
        self.assertNotIn("\n", answer["message"])
        self.nothing_is_left()
        return answer["error"], answer["message"]

    def nothing_is_left(self):
        self.assertEqual([name for name in os.listdir(self.files)
                          if name.startswith((".", "surface-"))], [])

    def bytes_of(self, name, folder=None):
        with open(os.path.join(folder or self.files, name), "rb") as file:
            return file.read()


class InMemory(Surfaces):
    def test_a_pair_in_memory_gives_the_same_bytes(self):
        """The recorded commands once more, on the replayed instrument, without a session."""
        self.keep(calibration_of(SESSION))
        answer = None
        for line in lines_of(SESSION):
            if line.startswith("command "):
                answer = self.asked(urllib.parse.unquote(line.split("text=")[1]))
        self.assertNotIn("session", answer)
        self.assertEqual(os.listdir(self.files), ["kept.txt"])
        figures = self.asked("reconstruct near=1600 far=2300 files=all")
        self.assertEqual(figures["result"], f"surface-{figures['session']}-{figures['pair']}")
        self.assertEqual(os.listdir(os.path.join(self.files)).count(figures["session"]), 0)
        self.session("c")
        self.asked("reconstruct c near=1600 far=2300 files=all")
        for name in SAME:
            self.assertEqual(STAMP.sub(b"", self.bytes_of(f"{figures['result']}/{name}")),
                             STAMP.sub(b"", self.bytes_of(f"surface-c-1/{name}")), name)
        # Another calibration since then is not that of the pair.
        self.first.ask("calibration forget")
        self.assertEqual(self.asked("reconstruct scale=0.5 near=1600 far=2300")["calibration_from"], "session")


class Reconstruct(Surfaces):
    def test_the_same_bytes_as_the_command_line(self):
        folder = self.session("c")
        figures = self.asked("reconstruct c pair=1 near=1600 far=2300 files=all")
        self.assertEqual((figures["session"], figures["pair"], figures["result"]),
                         ("c", 1, "surface-c-1"))
        self.assertGreater(figures["density"], 30)
        self.assertLess(figures["rows_apart"], 0.2)
        self.assertTrue(1600 < figures["depth_near"] < figures["depth_median"] <
                        figures["depth_far"] < 2400, figures)
        self.assertEqual(set(result_names(os.path.join(self.files, "surface-c-1"))), FILES)
        pair = next(line for line in lines_of(folder) if line.startswith("pair "))
        frames = [os.path.join(folder, f"frame-{crc}.pnm")
                  for crc in re.findall(r"_frame=(\w+)", pair)]
        calibration, = glob.glob(os.path.join(folder, "calibration-*.txt"))
        out = os.path.join(self.folder, "line")
        done = subprocess.run(
            [VERGENCE, "reconstruct", *frames, "--calibration", calibration, "--bayer", "grbg",
             "--bits", "10", "--near", "1600", "--far", "2300", "--out", out, "--json"],
            capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        for name in SAME:
            # Except how the pair was captured, which images do not record.
            console = STAMP.sub(b"", self.bytes_of(f"surface-c-1/{name}"))
            self.assertEqual(console, self.bytes_of(name, out), name)
        # The host's program keeps the surface that the board makes again for each file.
        host = os.path.join(self.folder, "host")
        subprocess.run(
            [os.environ["VERGENCE"], "reconstruct", *frames, "--calibration", calibration,
             "--bayer", "grbg", "--bits", "10", "--near", "1600", "--far", "2300", "--out", host,
             "--files", "mesh.ply,points.pcd,disparity.pfm", "--quiet"], timeout=TIMEOUT_S, check=True)
        for name in result_names(host):
            self.assertEqual(self.bytes_of(name, host), self.bytes_of(name, out), name)
        reported = json.loads(done.stdout)
        self.assertEqual(figures["points"], reported["counts"]["vertices"])
        self.assertAlmostEqual(figures["depth_median"], reported["depth_mm"]["median"], places=2)
        # Again over existing files; and its files can be fetched.
        self.asked("reconstruct c pair=1 near=1600 far=2300 files=all")
        done = self.vergence("fetch", "surface-c-1/mesh.ply", os.path.join(self.folder, "mesh"))
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_pc_makes_all_files_of_the_compact_surface(self):
        """As the board would have written them, and what only a PC writes."""
        self.session("c")
        place = os.path.join(self.folder, "pc")
        os.mkdir(place)
        words = ("reconstruct", "c", "near=1600", "far=2300")
        program = os.environ["VERGENCE"]
        done = self.vergence(*words, program=program, cwd=place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"(?s)result: surface-c-1\n.*written: surface-c-1.compact, .*\nresults +surface-c-1\nOK\n$")
        self.assertEqual(os.listdir(place), ["surface-c-1"])
        made = os.path.join(place, "surface-c-1")
        self.assertLess({"report.html", "mesh.glb", "depth.png"}, set(result_names(made)))
        self.nothing_is_left()
        # Again, elsewhere, for a program; and not at all where it says what it wants.
        done = self.vergence("--json", *words, "--out", "other", program=program, cwd=place)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(json.loads(done.stdout.splitlines()[-1])["result"]["fetched"], "surface-c-1.compact")
        done = self.vergence(*words, "files=all", program=program, cwd=place)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sorted(os.listdir(place)), ["other", "surface-c-1"])
        for name in SAME - {"reasons.pgm"}:
            self.assertEqual(self.bytes_of(f"surface-c-1/{name}"), self.bytes_of(name, made), name)
        # What cannot be written here stays fetched.
        os.mkdir(os.path.join(place, "mine"))
        with open(os.path.join(place, "mine", "mesh.ply"), "wb") as file:
            file.write(b"mine")
        done = self.vergence(*words, "--out", "mine", program=program, cwd=place)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("mine/mesh.ply", done.stderr)
        self.assertTrue(os.path.exists(os.path.join(place, "surface-c-1.compact")))

    def test_every_result_describes_the_capture(self):
        """Skew, settings and positions of the pair, as the session's index has them."""
        events = lines_of(self.session("c"))
        pair, instrument = (dict(word.split("=", 1) for line in events if line.startswith(kind)
                                 for word in line.split()[1:]) for kind in ("pair ", "instrument "))
        figures = self.asked("reconstruct c pair=1 scale=0.5 near=1600 far=2300 files=all")
        self.assertEqual(figures["skew"], int(pair["skew_us"]))
        reported = json.loads(self.bytes_of("surface-c-1/result.json"))["capture"]
        self.assertEqual((reported["session"], reported["pair"], reported["skew_us"]),
                         ("c", 1, int(pair["skew_us"])))
        self.assertEqual((reported["static_checked"], reported["changed_percent"]), (False, None))
        lines = [f"capture c pair 1: skew {pair['skew_us']} us"]
        for side in ("left", "right"):
            at = reported[side]
            before, after = ([int(number.split(":")[0]) for number in pair[f"{side}_{when}"].split(",")]
                             for when in ("before", "after"))
            self.assertEqual((at["sequence"], at["begin_us"], at["end_us"], at["exposure_us"],
                              at["gain"] * 8),
                             tuple(int(pair[f"{side}_{key}"]) for key in
                                   ("sequence", "begin_us", "end_us", "exposure_us", "gain_q3")))
            for i, values_q4 in enumerate((before, after)):
                self.assertEqual([at[name][i] * 16 for name in ("pan_us", "zoom", "focus", "iris")],
                                 values_q4)
            centre_q4, q4_per_rad = map(int, instrument[f"{side}_servo"].split(","))
            pan_deg = math.degrees((before[0] - centre_q4) / q4_per_rad)
            lines.append(f"{side}: sequence {at['sequence']}, exposure {at['exposure_us']} us, gain "
                         f"{at['gain']:.3f}, pan {pan_deg:.3f} deg, zoom {before[1] / 16:.2f}, "
                         f"focus {before[2] / 16:.2f}, iris {before[3] / 16:.2f}")
        for name, mark in (("mesh.ply", "comment"), ("points.pcd", "#")):
            head = self.bytes_of(f"surface-c-1/{name}")[:2000]
            for line in lines:
                self.assertIn(f"\n{mark} {line}\n".encode(), head)

    def test_the_files_wanted_and_the_preset(self):
        self.session("w")
        self.asked("reconstruct w pair=1 near=1600 far=2300 files=all")
        whole = self.bytes_of("surface-w-1/reasons.pgm")
        self.asked("reconstruct w pair=1 near=1600 far=2300 files=reasons.pgm,disparity.pfm")
        self.assertEqual(set(result_names(os.path.join(self.files, "surface-w-1"))),
                         {"reasons.pgm", "disparity.pfm"})
        self.assertEqual(self.bytes_of("surface-w-1/reasons.pgm"), whole)
        self.asked("reconstruct w pair=1 near=1600 far=2300 files=reasons.pgm preset=board")
        self.assertNotEqual(self.bytes_of("surface-w-1/reasons.pgm"), whole)
        shutil.rmtree(os.path.join(self.files, "surface-w-1"))
        error, text = self.refused("reconstruct w pair=1 files=mesh.glb")
        self.assertEqual(error, "ARGUMENT")
        self.assertIn('unknown file "mesh.glb" (expected disparity.pfm, ', text)

    def test_which_session_and_pair(self):
        self.assertEqual(self.refused("reconstruct")[0], "MISSING")
        self.session("old")
        os.utime(os.path.join(self.files, "old", "session.index"), (1, 1))
        self.session("new")
        # A killed capture left no pair and is not selected.
        killed = os.path.join(self.files, "killed")
        os.mkdir(killed)
        with open(os.path.join(killed, "session.index"), "wb") as file:
            file.write(framed_index(lines_of(SESSION)[:1]))
        self.assertEqual(self.asked("reconstruct scale=0.5")["session"], "new")
        self.assertIn("no pair", self.first.ask("reconstruct killed")[-1])
        shutil.rmtree(killed)
        self.assertEqual(self.asked("reconstruct old")["session"], "old")
        shutil.rmtree(os.path.join(self.files, "surface-new-1"))
        shutil.rmtree(os.path.join(self.files, "surface-old-1"))
        self.assertEqual(self.refused("reconstruct new pair=2"), ("MISSING", "new: no pair 2 (the session has 1)"))
        self.assertEqual(self.refused("reconstruct none")[0], "MISSING")
        self.assertEqual(self.refused("reconstruct ../files/new")[0], "ARGUMENT")
        self.assertEqual(self.refused("reconstruct new pair=1 near=2000 far=1000")[0], "RANGE")
        self.assertEqual(self.refused("reconstruct new far=2000")[0], "RANGE")
        error, text = self.refused("reconstruct new pair=1 near=0.3 far=3")
        self.assertEqual(error, "RANGE")
        self.assertIn("possibly in metres", text)
        os.symlink(self.files, os.path.join(self.files, "link"))
        self.assertEqual(self.refused("reconstruct link")[0], "MISSING")
        os.unlink(os.path.join(self.files, "link"))
        # Output does not follow a link either.
        outside = os.path.join(self.folder, "outside")
        os.mkdir(outside)
        os.symlink(outside, os.path.join(self.files, "surface-new-1"))
        self.assertEqual(self.first.ask_json("reconstruct new pair=1 scale=0.5")["error"], "ARGUMENT")
        self.assertEqual(os.listdir(outside), [])
        os.unlink(os.path.join(self.files, "surface-new-1"))
        error, text = self.refused("reconstruct new pair=1 near=300 far=310")
        self.assertNotIn("--", text)
        self.assertIn(error, ("DISPARITY_RANGE", "NO_SURFACE", "OVERLAP"))

    def test_which_calibration(self):
        whole = calibration_of(SESSION)
        corner = [(SENSOR[i] - WINDOW[i]) // 2 for i in range(2)]
        self.session("own")
        own = self.asked("reconstruct own pair=1 near=1600 far=2300")
        shutil.rmtree(os.path.join(self.files, "surface-own-1"))
        self.assertEqual((own["calibration_from"], own["calibration_cut"]), ("session", "no"))
        self.session("none", calibration=False, window=f"{corner[0]},{corner[1]},1")
        error, text = self.refused("reconstruct none")
        self.assertEqual(error, "MISSING")
        self.assertIn("calibration set", text)
        # A calibration of the same size is used, and that is reported.
        self.keep(whole)
        kept = self.asked("reconstruct none pair=1 near=1600 far=2300")
        shutil.rmtree(os.path.join(self.files, "surface-none-1"))
        self.assertEqual((kept["calibration_from"], kept["calibration_cut"]), ("kept", "no"))
        self.assertTrue(any("same part of the sensor" in note for note in kept["notes"]))
        # If there is no surface, the report is part of the error.
        self.keep(resized(whole, WINDOW, (0, 60), sides=["right"]))
        error, text = self.refused("reconstruct none pair=1 near=1600 far=2300")
        self.assertEqual(error, "NO_SURFACE")
        self.assertIn("same part of the sensor", text)
        # A calibration of the whole sensor is cut.
        self.keep(resized(whole, SENSOR, corner))
        cut = self.asked("reconstruct none pair=1 near=1600 far=2300 files=all")
        self.assert_the_same_with_the_calibration_given("none")
        shutil.rmtree(os.path.join(self.files, "surface-none-1"))
        self.assertEqual((cut["calibration_from"], cut["calibration_cut"]), ("kept", "yes"))
        for key in ("points", "depth_median", "depth_near", "depth_far", "rows_apart"):
            self.assertAlmostEqual(cut[key], own[key], delta=1e-4 * own["points"]
                                   if key == "points" else 0.01, msg=key)
        # If the part of the sensor is unknown it is rejected, and so is any other size.
        self.session("unknown", calibration=False)
        self.assertEqual(self.refused("reconstruct unknown")[0], "SIZE_MISMATCH")
        self.keep(resized(whole, (1024, 768), (0, 0)))
        error, text = self.refused("reconstruct none")
        self.assertEqual(error, "SIZE_MISMATCH")
        self.assertIn("672x400", text)

    def assert_the_same_with_the_calibration_given(self, session):
        """On the command line it is cut to the window as any other."""
        out = os.path.join(self.folder, "given")
        done = subprocess.run(
            [VERGENCE, "reconstruct", os.path.join(self.files, session), "--calibration",
             os.path.join(self.files, "kept.txt"), "--near", "1600", "--far", "2300", "--out", out],
            capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        name = "disparity.pfm"
        self.assertEqual(self.bytes_of(name, out), self.bytes_of(f"surface-{session}-1/{name}"))

    def test_cancelled(self):
        self.session("c")
        self.first.send("@json,progress reconstruct c pair=1 scale=3\n")
        event = json.loads(self.first.line())
        self.assertEqual(event["event"], "progress")
        # Commands for the instrument do not wait meanwhile.
        begin = time.monotonic()
        self.assertTrue(self.client().ask_json("status")["ok"])
        asked_s = time.monotonic() - begin
        self.first.send("\x03")
        begin = time.monotonic()
        answer = event
        while "event" in answer:
            answer = json.loads(self.first.line())
        self.assertEqual(answer["error"], "CANCELLED", answer)
        self.assertLess(time.monotonic() - begin, 10)
        self.assertLess(asked_s, 5)
        self.nothing_is_left()

    def test_depths_are_what_help_reports(self):
        """One in a hundred points is nearer than depth_near, and one farther than depth_far."""
        output_text = self.first.ask_json("help reconstruct")["result"]["more"]
        self.assertRegex(output_text, "1 % .*depth_near.*1 % .*depth_far")
        self.session("d")
        figures = self.asked("reconstruct d pair=1 scale=0.5 near=1600 far=2300 files=points.pcd")
        with open(os.path.join(self.files, "surface-d-1", "points.pcd"), "rb") as file:
            data = file.read().split(b"DATA binary\n", 1)[1]
        points = numpy.frombuffer(data, numpy.float32).reshape(figures["points"], 5)
        expected = numpy.percentile(points[:, 2], (1, 50, 99))
        for name, depth_mm in zip(("near", "median", "far"), expected):
            self.assertAlmostEqual(figures[f"depth_{name}"], depth_mm, delta=0.5)

    def limited(self, what, limit, command):
        """A command that fails by a limit of the system; without the limit it works."""
        before = resource.prlimit(self.daemon.pid, what)
        resource.prlimit(self.daemon.pid, what, (limit, before[1]))
        try:
            return self.refused(command)
        finally:
            resource.prlimit(self.daemon.pid, what, before)

    def test_a_full_disk(self):
        self.session("f")
        error, text = self.limited(resource.RLIMIT_FSIZE, 100_000, "reconstruct f pair=1 scale=0.5")
        self.assertEqual(error, "FULL", text)
        self.assertRegex(text, "^writing .*/surface-f-1/.* failed: File too large; ")
        self.asked("reconstruct f pair=1 scale=0.5")


class Streamed(Surfaces):
    """A program that asks with @binary gets surface.compact as it is written, and no file is."""
    ask = "@json,progress,binary reconstruct c pair=1 near=1600 far=2300\n"
    times = re.compile(rb"^(\w+_(us|bytes)|threads) [^\n]+\n", re.MULTILINE)

    def setUp(self):
        super().setUp()
        self.session("c")

    @staticmethod
    def rest(client):
        """The bytes up to the answer, and that."""
        data, answer = b"", json.loads(client.line())
        while "event" in answer:
            data += client.take(answer["bytes"]) if answer["event"] == "bytes" else b""
            answer = json.loads(client.line())
        return data, answer

    def begun(self):
        """A client that has got the first bytes."""
        client = self.client()
        client.send(self.ask)
        event = {"event": ""}
        while event["event"] != "bytes":
            event = json.loads(client.line())
        return client, client.take(event["bytes"])

    def held(self, client):
        """Waits until the reconstruction waits for the reader: others wait for it, and see that."""
        self.assertEqual(client.begin("files"), "... waiting for another client's reconstruct 0/1")

    def test_the_bytes_are_those_of_the_file_and_none_is_written(self):
        before = resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, (0, before[1]))
        try:
            self.first.send(self.ask)
            data, answer = self.rest(self.first)
        finally:
            resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, before)
        self.assertTrue(answer["ok"], answer)
        self.assertEqual(answer["result"]["result"], "surface-c-1")
        self.nothing_is_left()
        self.asked("reconstruct c pair=1 near=1600 far=2300")
        file = self.bytes_of("surface-c-1/surface.compact")
        # All but the times of the head, and the CRC over them.
        self.assertEqual(self.times.sub(b"", data)[:-4], self.times.sub(b"", file)[:-4])

    def test_who_says_which_files_gets_files(self):
        for words, prefix in (("files=surface.compact", "json,binary"), ("", "json")):
            self.assertTrue(self.first.ask_json(f"reconstruct c pair=1 scale=0.5 {words}", prefix)["ok"])
            self.assertIn("surface.compact", os.listdir(os.path.join(self.files, "surface-c-1")))
            shutil.rmtree(os.path.join(self.files, "surface-c-1"))

    def test_a_slow_reader_holds_the_reconstruction_up_and_gets_all(self):
        slow, data = self.begun()
        self.held(self.first)
        more, answer = self.rest(slow)
        self.assertTrue(answer["ok"], answer)
        self.first.begun_answer()
        path = os.path.join(self.folder, "slow.compact")
        with open(path, "wb") as file:
            file.write(data + more)
        done = subprocess.run(
            [os.environ["VERGENCE"], "reconstruct", path, "--files", "result.json", "--out",
             os.path.join(self.folder, "slow")], capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_reader_that_goes_or_cancels_ends_it(self):
        gone, _ = self.begun()
        self.held(self.first)
        gone.socket.close()
        self.assertEqual(self.first.begun_answer()[-1], "OK")
        self.nothing_is_left()
        stops, _ = self.begun()
        self.held(self.first)
        stops.send("\x03")
        self.assertEqual(self.rest(stops)[1]["error"], "CANCELLED")
        self.assertEqual(self.first.begun_answer()[-1], "OK")
        self.nothing_is_left()

    def test_a_pc_with_a_full_disk_ends_it_and_keeps_nothing(self):
        place = os.path.join(self.folder, "full")
        os.mkdir(place)
        done = subprocess.run(
            ["sh", "-c", 'ulimit -f 100; exec "$@"', "sh", os.environ["VERGENCE"], "--connect",
             f"unix:{self.path}", "reconstruct", "c", "near=1600", "far=2300"],
            cwd=place, capture_output=True, text=True, timeout=TIMEOUT_S)
        self.assertEqual((done.returncode, os.listdir(place)), (1, []), done.stderr)
        self.assertRegex(done.stderr, "^vergence: [^\n]*surface.compact: File too large\n$")
        self.asked("files")


class SmallStack(Surfaces):
    """The program's own stack may not grow as it does by default."""
    launcher = small_stack(128)

    def test_the_work_has_room(self):
        self.session("s")
        self.assertGreater(self.asked("reconstruct s pair=1 scale=0.5")["points"], 0)


class BrokenStore(Surfaces):
    """A reconstruction uses only the store of the hardware's interfaces, for the saved calibration;
    here a fake kernel's disk fails to deliver it."""
    failures = ("", "fail 1 1 EIO calibration open", "fail 1 0 EIO calibration read")

    @classmethod
    def start(cls):
        script = os.path.join(cls.folder, "script")
        with open(script, "w", encoding="ascii") as file:
            file.write(f"watch {cls.folder}/store\n{cls.failures[0]}\n")
        cls.environment = preloaded(script)
        super().start()

    def test_each_failure_is_reported(self):
        self.keep(calibration_of(SESSION))
        self.session("none", calibration=False, window="688,568,1")
        self.session("own")
        self.assertTrue(self.first.ask_json("reconstruct none pair=1 scale=0.5 near=1600 far=2300")["ok"])
        for failure in self.failures[1:]:
            self.end(self.daemon)
            type(self).failures = (failure, *self.failures[1:])
            self.start()
            self.first = self.client()
            shutil.rmtree(os.path.join(self.files, "surface-none-1"), ignore_errors=True)
            self.assertEqual(self.refused("reconstruct none pair=1 scale=0.5 near=1600 far=2300"), (
                "IO", "none: no calibration in the session, and the saved one cannot be read: "
                "system error"))
            self.assertEqual("1 0" in failure,
                             not self.first.ask_json("reconstruct none pair=1 scale=0.5 near=1600 far=2300")["ok"])
        # A session with its own calibration needs no other.
        self.assertTrue(self.first.ask_json("reconstruct own pair=1 scale=0.5 near=1600 far=2300")["ok"])


if __name__ == "__main__":
    unittest.main()

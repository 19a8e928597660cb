# SPDX-License-Identifier: Apache-2.0
"""Memory and room for files are checked before a command needs them; the answer says what would fit,
and that does. The memory is stated by a file in place of /proc/meminfo."""
import os
import re
import shutil
import tempfile
import unittest
import urllib.parse

from daemon_process import VERGENCED, DaemonTest
from reconstruct_test import FILES, SESSION, Surfaces, calibration_of, lines_of
from results import result_names

RESERVE = 1 << 20  # what the daemon leaves to everything else
PLENTY = 1 << 40


def sanitized():
    """Whether the daemon has a sanitizer, which keeps what was freed."""
    with open(VERGENCED, "rb") as program:
        return b"__asan_init" in program.read()


class Stated:
    """For tests with a daemon whose memory is what a file states."""

    @classmethod
    def state(cls, free_bytes):
        with open(cls.environment["VERGENCE_MEMINFO"], "w", encoding="ascii") as file:
            file.write(f"MemAvailable: {(RESERVE + free_bytes) // 1024} kB\n")

    @classmethod
    def setUpClass(cls):
        place = tempfile.mkdtemp(prefix="meminfo")
        cls.addClassCleanup(shutil.rmtree, place)
        cls.environment = {"VERGENCE_MEMINFO": os.path.join(place, "meminfo")}
        cls.state(PLENTY)
        super().setUpClass()

    def with_memory(self, free_bytes):
        self.addCleanup(self.state, PLENTY)
        self.state(free_bytes)

    def ok(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]

    def rejected(self, command, error):
        answer = self.first.ask_json(command)
        self.assertFalse(answer["ok"], answer)
        self.assertEqual(answer["error"], error, answer)
        self.assertTrue(answer["message"].startswith(command.split()[0]), answer)
        return answer["message"]


class Memory(Stated, DaemonTest):
    def setUp(self):
        self.first = self.client()
        self.state(PLENTY)
        self.ok("bringup")
        self.ok("window 640 480")

    def test_a_pair_that_does_not_fit(self):
        self.with_memory(900_000)
        text = self.rejected("capture", "MEMORY")
        self.assertRegex(text, r"1\.2 MB are required, 0\.9 MB are free")
        window = re.search(r'"(window \d+ \d+)" fits', text)[1]
        self.ok(window)
        self.assertGreaterEqual(self.ok("window")["width"], 496)
        self.ok("capture")

    def test_merged_and_compared_pairs_need_more(self):
        self.with_memory(1_500_000)
        self.ok("capture")
        self.rejected("capture static=yes", "MEMORY")
        self.rejected("capture average=2", "MEMORY")

    def test_the_last_pair_makes_room(self):
        self.ok("capture")
        self.with_memory(0)
        self.assertIn("out of memory", self.rejected("capture", "MEMORY"))
        self.assertRegex(self.first.ask("reconstruct")[-1], "no pair|out of memory")

    def test_a_view_that_does_not_fit(self):
        self.with_memory(4_000_000)
        self.assertRegex(self.rejected("view full=yes", "MEMORY"), r'"window \d+ \d+" fits')
        self.ok("view")
        self.state(1_000_000)
        self.rejected("view", "MEMORY")

    def test_a_recording_that_does_not_fit(self):
        self.with_memory(10_000)
        self.rejected("record start r", "MEMORY")
        self.assertFalse(os.path.exists(os.path.join(self.files, "r")))

    def test_a_recording_that_runs_out_of_memory(self):
        for line in ("record start cut", "bringup", "window 640 480"):
            self.ok(line)
        self.with_memory(100_000)
        self.rejected("capture", "MEMORY")
        self.state(PLENTY)
        self.ok("capture")
        self.ok("record stop")


class FilesInMemory(Stated, DaemonTest):
    """Files there need memory as well."""

    @classmethod
    def setUpClass(cls):
        if not os.access("/dev/shm", os.W_OK):
            raise unittest.SkipTest("/dev/shm is missing")
        cls.shared = tempfile.mkdtemp(prefix="vergence", dir="/dev/shm")
        cls.addClassCleanup(shutil.rmtree, cls.shared)
        cls.settings = (f"files={cls.shared}",)
        super().setUpClass()

    @classmethod
    def arguments(cls):
        return [word for word in super().arguments() if not word.startswith("files=")
                or word.endswith(cls.shared)]

    def test_they_count(self):
        self.first = self.client()
        self.ok("bringup")
        self.ok("window 640 480")
        self.with_memory(1_500_000)
        self.ok("capture")
        self.assertIn("with the files", self.rejected("capture there", "MEMORY"))
        self.assertEqual(os.listdir(self.shared), [])
        self.rejected("send big 2000000 00000000", "MEMORY")
        self.ok("send small 1000000 00000000")
        self.state(1000)
        self.rejected("bugreport", "MEMORY")


class Limited(Stated, DaemonTest):
    settings = ("files_limit=2 MB",)

    def test_the_limit_holds(self):
        self.first = self.client()
        self.ok("bringup")
        self.ok("window 640 480")
        self.ok("capture one")
        text = self.rejected("capture two", "FULL")
        self.assertRegex(text, r"1\.3 MB of files are required, 0\.8 MB are free of files_limit")
        self.ok(re.search(r'"(window \d+ \d+)" fits', text)[1])
        self.ok("capture two")
        self.rejected("send x 1000000 00000000", "FULL")
        self.rejected("view full=yes", "FULL")
        self.rejected("record start r", "FULL")
        self.assertEqual({name for name in os.listdir(self.files) if name[0] != "."}, {"one", "two"})
        # What is removed makes room.
        self.ok("remove one")
        self.ok("record start r")
        self.assertIn("record stop", self.first.ask("remove r")[-1])
        self.ok("bringup")
        self.ok("window 640 480")
        self.rejected("capture", "FULL")
        self.first.ask("view full=yes")
        self.ok("record stop")
        self.ok("remove r")
        self.ok("remove two")
        for name in ("none", "../files", ".", "a/b"):
            self.assertTrue(self.first.ask(f"remove {name}")[-1].startswith("ERR "), name)

    def test_links_are_removed_not_followed(self):
        self.first = self.client()
        outside = os.path.join(self.folder, "outside")
        os.mkdir(outside)
        with open(os.path.join(outside, "mine"), "w", encoding="ascii"):
            pass
        os.symlink(outside, os.path.join(self.files, "link"))
        self.ok("remove link")
        self.assertEqual(os.listdir(outside), ["mine"])
        self.assertFalse(os.path.lexists(os.path.join(self.files, "link")))


class Foreign(Stated, DaemonTest):
    """What others put into the directory of files."""

    def put(self, *names):
        for name in names:
            path = os.path.join(self.files, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "w", encoding="ascii") as file:
                file.write("mine")

    def test_a_folder_with_other_things_becomes_no_session(self):
        self.first = self.client()
        self.put("mine/letter.txt")
        self.ok("bringup")
        self.ok("window 64 64")
        for command in ("capture mine", "record start mine"):
            self.assertIn("mine: exists and contains other things (give another name)",
                          self.first.ask(command)[-1])
        self.assertIn("no session and no surface", self.first.ask("remove mine")[-1])
        self.assertEqual(os.listdir(os.path.join(self.files, "mine")), ["letter.txt"])
        os.mkdir(os.path.join(self.files, "empty"))
        self.ok("capture empty")
        self.ok("remove empty")
        self.assertFalse(os.path.exists(os.path.join(self.files, "empty")))

    def test_what_others_put_into_a_session_stays_and_is_reported(self):
        self.first = self.client()
        outside = os.path.join(self.folder, "elsewhere")
        os.mkdir(outside)
        self.ok("bringup")
        self.ok("window 64 64")
        self.ok("capture one")
        # A frame that no line of the index names is ours by its contents; another one is not.
        with open(os.path.join(self.files, "one", "frame-3610a686.pnm"), "w", encoding="ascii") as file:
            file.write("hello")
        self.put("one/letter.txt", "one/frame-00000000.pnm", "one/below/letter.txt")
        os.symlink(outside, os.path.join(self.files, "one", "calibration-00000000.txt"))
        answer = self.first.ask_json("remove one")
        self.assertTrue(answer["ok"], answer)
        self.assertEqual(answer["result"]["left"], 4)
        self.assertEqual(answer["result"]["not_written_by_vergence"], "one/below and others")
        self.assertEqual(sorted(os.listdir(os.path.join(self.files, "one"))),
                         ["below", "calibration-00000000.txt", "frame-00000000.pnm", "letter.txt"])
        self.assertTrue(os.path.isdir(outside))
        self.assertIn("no session and no surface", self.first.ask("remove one")[-1])


class Added(Stated, DaemonTest):
    """A second pair in the session of the first."""

    def pairs(self, name):
        with open(os.path.join(self.files, name, "session.index"), encoding="ascii") as file:
            kinds = [line.split()[0] for line in file]
        self.assertEqual(kinds[-1], "end")
        return kinds.count("pair")

    def test_pairs_are_added_to_a_session(self):
        self.first = self.client()
        self.ok("bringup")
        self.ok("window 64 64")
        for number in (1, 2, 3):
            answer = self.first.ask_json("capture scene add=yes")
            self.assertEqual((answer["ok"], answer["result"].get("pair")), (True, number), answer)
            self.assertEqual(self.pairs("scene"), number)
        self.assertIn("already contains a session", self.first.ask("capture scene")[-1])
        self.assertIn("needs the session's NAME", self.first.ask("capture add=yes")[-1])
        # Nothing is lost by one that fails: the index is as before, and the session is whole.
        with open(os.path.join(self.files, "scene", "session.index"), "rb") as file:
            before = file.read()
        self.with_memory(1 << 10)
        self.assertTrue(self.first.ask("capture scene add=yes")[-1].startswith("ERR "))
        self.with_memory(PLENTY)
        with open(os.path.join(self.files, "scene", "session.index"), "rb") as file:
            self.assertEqual(file.read(), before)
        # A recording is played back, and so does not grow.
        self.ok("record start r")
        self.ok("record stop")
        self.ok("bringup")
        self.assertIn("r: is a recording", self.first.ask("capture r add=yes")[-1])


class Shown(DaemonTest):
    def test_system_shows_it(self):
        first = self.client()
        for command in ("bringup", "window 640 480", "capture kept"):
            self.assertEqual(first.ask(command)[-1], "OK", command)
        def shown():
            return first.ask_json("system")["result"]["memory"]

        memory = shown()
        self.assertTrue(0 < memory["daemon"] <= memory["daemon_peak"] < 500, memory)
        self.assertAlmostEqual(memory["last_pair"], 2 * 2 * 640 * 480 / 2 ** 20, delta=0.1)
        self.assertAlmostEqual(memory["files"], 2 * 2 * 640 * 480 / 2 ** 20, delta=0.1)
        # Memory of frames goes back to the system when they are gone.
        for command in ("window 1024 768", "capture", "capture", "window 64 48", "capture"):
            self.assertEqual(first.ask(command)[-1], "OK", command)
        self.assertTrue(sanitized() or shown()["daemon"] < memory["daemon"], shown())


class Rounds(DaemonTest):
    """Captures and reconstructions in a row: after the first ones the daemon takes no more memory and
    no more descriptors. VERGENCE_ROUNDS sets their number."""
    scene = "cylinder"
    rounds = int(os.environ.get("VERGENCE_ROUNDS", "2"))

    def figures(self):
        memory = self.first.ask_json("system")["result"]["memory"]
        return memory["daemon"], len(os.listdir(f"/proc/{self.daemon.pid}/fd"))

    def round(self):
        answers = [self.first.ask_json(line) for line in (
            "capture accept-mismatch=yes",
            "reconstruct accept-mismatch=yes near=1600 far=2300 scale=0.5")]
        self.assertTrue(all(answer["ok"] for answer in answers), answers)
        self.assertTrue(self.first.ask_json(f"remove {answers[1]['result']['result']}")["ok"])
        return answers[1]["result"]["points"]

    def test_nothing_grows(self):
        self.first = self.client()
        for line in lines_of(SESSION):
            if line.startswith("command ") and "capture" not in line:
                self.first.ask(urllib.parse.unquote(line.split("text=")[1]))
        with open(os.path.join(self.files, "kept.txt"), "w", encoding="ascii") as file:
            file.write(calibration_of(SESSION))
        self.assertTrue(self.first.ask_json("calibration set kept.txt")["ok"])
        for _ in range(2):
            self.assertGreater(self.round(), 1000)
        before, descriptors = self.figures()
        for _ in range(self.rounds):
            self.round()
        after, descriptors_after = self.figures()
        self.assertEqual(descriptors_after, descriptors)
        self.assertEqual(os.listdir(self.files), ["kept.txt"])
        self.assertTrue(sanitized() or after < before + 1, f"{before} MiB became {after} MiB")


class SurfaceRoom(Stated, Surfaces):
    settings = ("profile=rig", "files_limit=30 MB")

    def test_a_surface_that_does_not_fit(self):
        self.session("m")
        self.with_memory(3_000_000)
        error, text = self.refused("reconstruct m pair=1 near=1600 far=2300")
        self.assertEqual(error, "MEMORY", text)
        self.assertIn("3.0 MB are free", text)
        for word in re.search(r"(scale=\S+) or (region=\S+) would fit", text).groups():
            self.asked(f"reconstruct m pair=1 near=1600 far=2300 {word}")
            memory = self.asked("system")["memory"]
            self.assertTrue(0 < memory["match"] < 3, memory)
            shutil.rmtree(os.path.join(self.files, "surface-m-1"))

    def test_results_that_do_not_fit(self):
        self.session("f")
        with open(os.path.join(self.files, "fill"), "wb") as file:
            file.write(bytes(10_000_000))
        error, text = self.refused("reconstruct f pair=1 near=1600 far=2300 files=all")
        self.assertEqual(error, "FULL", text)
        self.assertIn("of files_limit", text)
        word = re.search(r"(scale=\S+) or region=\S+ or all files but mesh.ply would fit", text)[1]
        self.asked(f"reconstruct f pair=1 near=1600 far=2300 files=all {word}")
        self.assertEqual(set(result_names(os.path.join(self.files, "surface-f-1"))), FILES)


if __name__ == "__main__":
    unittest.main()

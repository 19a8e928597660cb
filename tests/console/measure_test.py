# SPDX-License-Identifier: Apache-2.0
"""`measure` on the simulated rig, from cold to a surface; and what it is refused for, or ends by."""
import base64
import glob
import json
import math
import os
import re
import signal
import subprocess
import unittest
import zlib

from daemon_process import SIMRIG, Client, DaemonTest

TEXT = subprocess.run([os.environ["VERGENCE_ZOOM_RIG"]], capture_output=True, check=True).stdout
WIDTH_PX = 256


def of_another_rig():
    text = TEXT.replace(b"instrument rig\n", b"instrument other\n")
    body = text[:text.rindex(b"crc32 ")]
    return body + b"crc32 %08x\n" % zlib.crc32(body)


class Measure(DaemonTest):
    scene = "cylinder"
    settings = ("files_limit=40 MB",)

    def ask(self, command):
        with Client(self.path) as client:
            return client.ask_json(command)

    def works(self, command):
        answer = self.ask(command)
        self.assertTrue(answer["ok"], (command, answer))
        return answer["result"]

    def refused(self, command, error, *words):
        answer = self.ask(command)
        self.assertEqual(answer["error"], error, (command, answer))
        for word in words:
            self.assertIn(word, answer["message"])
        return answer["result"]

    def calibrate(self, text=TEXT, accept=""):
        with open(os.path.join(self.files, "instrument.zoom"), "wb") as file:
            file.write(text)
        self.works(f"calibration set instrument.zoom {accept}")

    def ready(self):
        self.calibrate()
        self.works("bringup")
        self.works(f"window 2048 1536 skip={2048 // WIDTH_PX}")

    def names(self, pattern="*"):
        return sorted(map(os.path.basename, glob.glob(os.path.join(self.files, pattern))))

    def progress_until(self, client, text):
        """Reads reports until one begins with the text."""
        while True:
            line = client.line()
            self.assertTrue(line and line.startswith("... "), line)
            if line.startswith("... " + text):
                return

    def test_a_quick_one(self):
        self.ready()
        found = self.works("measure quick fit=500 quick=yes")
        self.assertEqual((found["name"], found["session"], found["wish"]), ("quick", "quick", "fit=500 quick=yes"))
        texts = [step["step"] for step in found["steps"]]
        phases = [text.split(":")[0] for text in texts]
        order = ("look ahead", "zoom out", "wide pair", "coarse surface", "zoom", "iris", "light", "pair", "surface")
        self.assertEqual([phase for phase in phases if phase in order], list(order), texts)
        self.assertEqual(found["captures"], 2)
        self.assertAlmostEqual(found["width_mm"], 500, delta=15)
        # A density is what the picture's pixels make of its width.
        self.assertAlmostEqual(found["width_mm"] * math.sqrt(found["density_px_per_mm2"]), WIDTH_PX,
                               delta=0.05 * WIDTH_PX)
        # The servos rest 0.3 degrees off, rms: 100 mm each, which such small frames do not correct.
        self.assertAlmostEqual(found["distance_mm"], 1800, delta=400)
        self.assertGreater(found["points"], 2000)
        self.assertEqual(found["reasons"]["valid"], found["points"])
        self.assertLess(found["seconds"], 40)
        # Three digits of what the answer rounds to three decimals: 8.565 as 8.56 or 8.57.
        stated, = re.findall(r"points good to ([\d.]+) mm", found["sentence"])
        self.assertAlmostEqual(float(stated) / found["sigma_point_mm"], 1, delta=0.0055)
        self.assertTrue(os.path.exists(os.path.join(self.files, found["result"], "surface.compact")))
        with open(os.path.join(self.files, "quick", "session.index"), encoding="ascii") as file:
            index = file.read()
        self.assertIn("#%20measure%20fit=500%20quick=yes", index)
        self.assertIn(f"#%20measure%20surface%20pair={found['pair']}", index)
        self.refused("measure quick fit=500", "ARGUMENT", "quick")
        self.place(found)
        pan = self.works("pan")
        planned = self.works("measure planned fit=300 plan=yes near=1700 far=1900")
        self.assertGreater(len(planned["steps"]), 10)
        self.assertAlmostEqual(planned["width_mm"], 300, delta=10)
        self.assertEqual((self.works("pan"), self.names("planned")), (pan, []))  # nothing was done

    def place(self, found):
        """A place is a pixel of the last view, which nothing may have moved since."""
        self.refused("measure placed fit=500 at=10,10", "MISSING", "view", "none was taken")
        view = self.works("view")
        width, height = view["width"] // 2, view["height"]
        self.refused(f"measure placed fit=500 at={2 * width},0", "RANGE", f"{2 * width} x {height} px")
        # Right of the middle of both halves: half of the way to the edge of a view 500 mm wide.
        self.calibrate(of_another_rig(), "accept-mismatch=yes")
        placed = self.works(f"measure placed fit=250 quick=yes at={width + 3 * width // 4},{height // 2}")
        self.assertIn("at=", placed["wish"])
        self.assertIn('made with "other"', placed["accepted_mismatch"])
        with open(os.path.join(self.files, placed["result"], "result.json"), encoding="utf-8") as file:
            self.assertIn('made with \\"other\\"', file.read())
        with open(os.path.join(self.files, "placed", "session.index"), encoding="ascii") as file:
            self.assertRegex(file.read(), "#%20measure%20surface%20.*%20accept-mismatch=yes")
        aims = [step["step"] for step in placed["steps"] if step["step"].startswith("aim")]
        self.assertEqual(len(aims), 1, placed["steps"])
        right_mm = float(re.search(r"(-?[\d.]+) mm to the right", aims[0]).group(1))
        self.assertAlmostEqual(right_mm, found["width_mm"] / 4, delta=70)
        self.refused("measure again fit=500 at=10,10", "MISSING", "moved since")

    def test_what_it_is_refused_for(self):
        before = self.names()
        self.ask("calibration forget")
        self.refused("measure m", "MISSING", "no calibration is saved")
        self.refused("measure m fit=300 zoom=2", "ARGUMENT", "give one")
        for far in (1800, 2000):
            self.refused(f"measure m near=2000 far={far}", "ARGUMENT", "near and far need each other")
        self.refused("measure -m", "ARGUMENT", "plain name")
        self.refused("measure ../m", "ARGUMENT")
        self.ask("safe")
        self.calibrate(of_another_rig())
        self.refused("measure m fit=300", "MISMATCH", "other")
        self.ask("safe")
        self.calibrate()
        for plan in ("", "plan=yes"):
            self.refused(f"measure m near=100 far=200 {plan}", "OVERLAP", "100 to 200 mm", "near and far")
        self.refused("measure m fit=300", "FULL", "measure", "MB")  # four whole pairs
        self.assertEqual([name for name in self.names() if name not in before],
                         [name for name in ["instrument.zoom"] if name not in before])

    def test_a_cancelled_or_killed_one_leaves_what_it_took(self):
        self.ready()
        client = self.client()
        client.send("@progress measure stopped fit=500\n")
        self.progress_until(client, "zoom:")
        self.wait_running("measure")
        client.send("\x03")
        answer = client.begun_answer()[-1]
        self.assertTrue(answer.startswith("ERR CANCELLED measure: "), answer)
        self.assertIn('stopped has 1 pair ("reconstruct stopped")', answer)
        self.assertEqual(self.works("status")["state"], "ready")
        self.assertEqual(self.names("surface-stopped*"), [])
        self.assertGreater(self.works("reconstruct stopped near=1500 far=2500")["points"], 1000)
        # Stopped when all pairs are there, it leaves what a PC needs.
        client.send("@progress measure late fit=500 quick=yes\n")
        self.progress_until(client, "surface:")
        client.send("\x03")
        answer = client.begun_answer()[-1]
        self.assertTrue(answer.startswith("ERR CANCELLED measure: surface: "), answer)
        self.assertIn('on a PC "vergence measure late"', answer)
        with open(os.path.join(self.files, "late", "session.index"), encoding="ascii") as file:
            self.assertIn("#%20measure%20surface%20pair=2", file.read())
        self.ask("remove late")
        # A disk that is full before the surface leaves all that a PC needs to make it.
        client.send("@progress measure full fit=500 quick=yes\n")
        self.progress_until(client, "light:")
        big = os.path.join(self.files, "big")
        used = sum(os.path.getsize(path) for path in glob.glob(os.path.join(self.files, "**"), recursive=True))
        with open(big, "wb") as file:
            file.truncate(40_000_000 - used - 350_000)
        answer = client.begun_answer()[-1]
        self.assertTrue(answer.startswith("ERR FULL measure: surface: no room"), answer)
        self.assertIn('full has 2 pairs ("reconstruct full", or on a PC "vergence measure full")', answer)
        self.assertEqual(self.names("surface-full*"), [])
        with open(os.path.join(self.files, "full", "session.index"), encoding="ascii") as file:
            self.assertIn("#%20measure%20surface%20pair=2%20with-pair=1", file.read())
        os.unlink(big)
        # A daemon that is killed in the middle leaves nothing half.
        before = self.names()
        client.send("@progress measure killed fit=500\n")
        self.progress_until(client, "zoom out:")
        self.daemon.send_signal(signal.SIGKILL)
        self.daemon.wait()
        self.daemon.returncode = 0  # as expected
        os.unlink(self.path)
        self.start()
        self.assertEqual(self.names(), before)


class Board(DaemonTest):
    """An instrument without a disk: of a rig of the same seed its commands find what the daemon's find, word for word
    and digit for digit."""
    scene = "cylinder"
    commands = ("calibration set instrument.zoom", "bringup", "window 1920 1440 skip=6", "measure cup fit=360")
    own = ("session", "computing_seconds")  # of an instrument with a disk; of a processor
    block_bytes = 300

    def begin_board(self, *options):
        path = os.path.join(self.folder, "board.sock")
        rig = subprocess.Popen([SIMRIG, "--scene", self.scene, *options, "--listen", f"unix:{path}"],
                               stdout=subprocess.PIPE)
        self.addCleanup(rig.stdout.close)
        self.addCleanup(self.end, rig)
        self.assertIn(b"listening on", rig.stdout.readline())
        board = subprocess.Popen([os.environ["VERGENCE_MEMORY_CONSOLE"], f"unix:{path}"], stdin=subprocess.PIPE,
                                 stdout=subprocess.PIPE, text=True)
        self.addCleanup(board.stdout.close)
        self.addCleanup(board.wait)
        self.addCleanup(board.stdin.close)
        return board

    @staticmethod
    def ask(board, command, stop_at=None):
        """Presses Ctrl-C when progress begins with the text."""
        board.stdin.write(f"@json {command}\n")
        board.stdin.flush()
        while (line := board.stdout.readline()).startswith("... "):
            if stop_at and line.startswith("... " + stop_at):
                board.send_signal(signal.SIGINT)
        return json.loads(line)

    def refused(self, board, command, error, *words, **stop):
        answer = self.ask(board, command, **stop)
        self.assertEqual(answer["error"], error, (command, answer))
        for word in words:
            self.assertIn(word, answer["message"])

    def send(self, board, name, data):
        head = f"send {name} {len(data)} {zlib.crc32(data):08X}"
        self.assertTrue(self.ask(board, head)["ok"])
        for at in range(0, len(data), self.block_bytes):
            block = data[at:at + self.block_bytes]
            answer = self.ask(board, f"{head} offset={at} block-crc={zlib.crc32(block):08X} "
                                     f"data={base64.b64encode(block).decode()}")
            self.assertTrue(answer["ok"], answer)

    def test_the_board_finds_what_the_daemon_finds(self):
        with open(os.path.join(self.files, "instrument.zoom"), "wb") as file:
            file.write(TEXT)
        board, client = self.begin_board(), self.client()
        self.assertIn("no calibration is set", self.ask(board, "measure cup")["message"])
        self.send(board, "instrument.zoom", TEXT)
        for command in self.commands:
            theirs, ours = client.ask_json(command), self.ask(board, command)
            self.assertTrue(theirs["ok"] and ours["ok"], (theirs, ours))
        for key in self.own:
            theirs["result"].pop(key)
            ours["result"].pop(key, None)
        self.assertEqual(ours["result"], theirs["result"])
        self.assertEqual(ours["result"]["captures"], 3)
        answer = self.ask(board, f"files {ours['result']['result']}")
        self.assertEqual([file["file"] for file in answer["result"]["files"]], ["surface.compact"])
        self.assertIn("view", self.ask(board, "measure cup fit=300 at=1,2")["message"])

    def test_a_surface_of_the_whole_sensor_is_read_in_any_order(self):
        """Its file would not fit into the board's memory."""
        board = self.begin_board("--rig", "perfect")
        with open(os.path.join(os.environ["VERGENCE_SOURCE"], "tests/bf537/perfect.zoom"), "rb") as file:
            self.send(board, "instrument.zoom", file.read())
        for command in self.commands[:2] + ("pan 3.97 right=-3.97", "window 2048 1536", "exposure 6500", "capture"):
            self.assertTrue(self.ask(board, command)["ok"], command)
        found = self.ask(board, "reconstruct near=1500 far=2500")["result"]
        self.assertGreater(found["points"], 1000000)
        name = f"{found['result']}/surface.compact"
        whole = self.ask(board, f"fetch {name}")["result"]

        def block(at):
            return base64.b64decode(self.ask(board, f"fetch {name} offset={at}")["result"]["data"])

        first = block(0)
        places = range(0, whole["size"], len(first))
        blocks = [first] + [block(at) for at in places[1:]]
        self.assertEqual(f"{zlib.crc32(b''.join(blocks)):08X}", whole["crc"])
        for i in (len(places) - 1, 1, len(places) // 2, 0):
            self.assertEqual(block(places[i]), blocks[i])

    def test_what_is_refused_or_stopped_leaves_the_rest(self):
        board = self.begin_board()
        self.send(board, "instrument.zoom", TEXT)
        for command in self.commands[:2] + ("window 2048 1536 skip=8",):
            self.assertTrue(self.ask(board, command)["ok"])
        for name in ("../cup", ".cup", "-cup", "a/b"):
            self.refused(board, f"measure {name} quick=yes", "ARGUMENT", "plain name")
        self.refused(board, 'measure "a cup" quick=yes', "ARGUMENT", "invalid character")
        self.refused(board, "measure cup fit=500 quick=yes", "CANCELLED", "cancelled", stop_at="zoom:")
        self.assertEqual(self.ask(board, "status")["result"]["state"], "ready")
        found = self.ask(board, "reconstruct near=1500 far=2500")["result"]
        self.assertGreater(found["points"], 1000)
        again = self.ask(board, "reconstruct near=1500 far=2500")["result"]
        self.assertEqual(again["memory"], found["memory"])
        self.send(board, "half.zoom", TEXT[:len(TEXT) // 2])
        self.refused(board, "calibration set half.zoom", "SYNTAX", "half.zoom")
        self.assertTrue(self.ask(board, f"files {found['result']}")["ok"])
        self.assertTrue(self.ask(board, "calibration forget")["ok"])
        for command in ("measure cup", "reconstruct"):
            self.refused(board, command, "MISSING", "no calibration is set")


if __name__ == "__main__":
    unittest.main()

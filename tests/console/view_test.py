# SPDX-License-Identifier: Apache-2.0
"""The current view of both cameras, with marks to aim by: one image among the instrument's files,
which the client fetches."""
import glob
import json
import os
import re
import resource
import subprocess
import time
import unittest

import cv2
import numpy

from daemon_process import TIMEOUT_S, VERGENCE, DaemonTest
from played_pairs import SESSION, PlayedPairs


def shrunk(image, factor):
    """Means over square blocks."""
    height, width = (side // factor for side in image.shape[:2])
    parts = image[:height * factor, :width * factor].reshape(height, factor, width, factor, -1)
    return parts.mean(axis=(1, 3)).squeeze()


def developed(folder, side):
    """A session's raw frame as grey, by OpenCV: approximately the instrument's conversion."""
    with open(os.path.join(folder, "session.index"), encoding="ascii") as file:
        crc = re.search(rf"{side}_frame=(\w+)", file.read())[1]
    raw = cv2.imread(os.path.join(folder, f"frame-{crc}.pnm"), cv2.IMREAD_UNCHANGED)
    colour = cv2.cvtColor(raw.astype(numpy.uint16), cv2.COLOR_BayerGB2RGB).astype(float) / 1023
    return 255 * numpy.sqrt(colour @ (77 / 256, 150 / 256, 29 / 256))


CONTROL = os.path.join(os.environ["VERGENCE_SOURCE"], "tools/simrig/control")
GREEN, RED, BLUE = (0, 255, 0), (0, 0, 255), (255, 70, 40)  # as OpenCV orders colours


def marked(image, colour):
    return (image == colour).all(axis=2)


class Looking:
    """For tests with a daemon."""

    def asked(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]

    def shown(self, name, folder=None):
        image = cv2.imread(os.path.join(folder or self.files, name), cv2.IMREAD_UNCHANGED)
        self.assertIsNotNone(image, name)
        return image

    def assert_shows(self, image, session, factor):
        """Compares the grey pixels with both sides of a session's pair, up to noise and colour
        conversion."""
        middle = image.shape[1] // 2
        for side, half in (("left", image[:, :middle]), ("right", image[:, middle:])):
            expected = shrunk(developed(session, side), factor)
            self.assertEqual(half.shape[:2], expected.shape)
            grey = (half.max(axis=2) == half.min(axis=2))
            self.assertGreater(grey.mean(), 0.5, side)
            apart = numpy.abs(half[:, :, 0] - expected)[grey]
            self.assertLess(numpy.median(apart), 2, side)
            self.assertLess(numpy.percentile(apart, 99), 15, side)


class OnTheRig(Looking, DaemonTest):
    scene = "cylinder"

    def setUp(self):
        self.first = self.client()
        self.asked("bringup")
        # Frames out of focus at 10x take long to render.
        self.asked("zoom 300")
        self.asked("focus 400")

    def settings_now(self):
        status = self.asked("status")
        return status["window"], *((status[side]["exposure"], status[side]["gain"])
                                   for side in ("left", "right"))

    def fault(self, what):
        subprocess.run([CONTROL, f"unix:{self.rig_path}", f"fault {what}"], check=True,
                       timeout=TIMEOUT_S, stdout=subprocess.DEVNULL)

    def test_in_focus_or_not(self):
        """Of the whole field, thinned: what is in focus is marked, and settings stay."""
        for command in ("pan 3.570 right=-3.272", "zoom 850", "exposure 20000", "iris 800",
                        "focus 546"):
            self.asked(command)
        before = self.settings_now()
        sharp = self.asked("view")
        self.assertEqual((sharp["width"], sharp["height"]), (1024, 384))
        self.assertEqual(self.settings_now(), before)
        self.asked("focus 500")
        blurred = self.asked("view")
        for side, image in (("left", slice(0, 512)), ("right", slice(512, 1024))):
            self.assertGreater(sharp[side]["edges_in_focus"], 30, side)
            self.assertLess(blurred[side]["edges_in_focus"], sharp[side]["edges_in_focus"] / 20, side)
            green = marked(self.shown(sharp["file"]), GREEN)[:, image].sum()
            self.assertGreater(green, 2 * sharp[side]["edges_in_focus"])
            self.assertAlmostEqual(sharp[side]["exposure"], 20000, delta=100)

    def test_too_bright_and_too_dark(self):
        self.asked("iris 800")
        self.asked("exposure 60000 side=left")
        self.asked("exposure 60 side=right")
        answer = self.asked("view")
        left, right = answer["left"], answer["right"]
        self.assertGreater(left["saturated"], 50)
        self.assertEqual((left["dark"], right["saturated"]), (0, 0))
        self.assertGreater(right["dark"], 50)
        image = self.shown(answer["file"])
        self.assertGreater(marked(image, RED)[:, :512].mean(), 0.2)
        self.assertGreater(marked(image, BLUE)[:, 512:].mean(), 0.4)

    def test_in_recordings(self):
        self.asked("record start looked-at")
        commands = ("bringup", "window 320 240", "view", "capture", "window 1344 800", "view",
                    "window 320 240", "view full=yes", "pan 2 side=left", "capture")
        for command in (*commands, "record stop"):
            self.asked(command)
        played = self.asked("replay looked-at")
        self.assertEqual((played["same"], played["pairs"], played["commands"]),
                         ("yes", 2, len(commands)))

    def test_cancelled_or_failed(self):
        """The window is as before, and a pair can be taken."""
        self.asked("window 640 480")
        self.asked("exposure 8000000")
        self.assertEqual(self.first.begin("view"), "... frames 0/2")
        self.first.send("\x03")
        self.assertEqual(self.first.begun_answer(), ["ERR CANCELLED cancelled"])
        self.asked("exposure 5000")
        self.assertEqual(self.asked("capture")["left"]["width"], 640)
        self.addCleanup(self.fault, "camera right ok")
        self.fault("camera right unplug")
        self.assertRegex(self.first.ask("view")[-1], "^ERR .*right (camera|sensor)")
        self.fault("camera right ok")
        self.asked("bringup")
        self.asked("view")


class View(Looking, PlayedPairs):
    def setUp(self):
        super().setUp()
        self.asked("bringup")

    def test_both_sides_are_shown(self):
        answer = self.asked("view")
        self.assertRegex(answer["file"], r"^view-\d{8}-\d{6}(-\d+)?\.png$")
        image = self.shown(answer["file"])
        self.assertEqual(image.shape, (200, 2 * 336, 3))
        self.assertEqual((answer["height"], answer["width"]), image.shape[:2])
        self.assertEqual(answer["size"], os.path.getsize(os.path.join(self.files, answer["file"])))
        self.assert_shows(image, SESSION, 2)

    def test_full_size_is_as_export_makes_it(self):
        """In colour, pixel by pixel."""
        image = self.shown(self.asked("view full=yes")["file"])
        out = os.path.join(self.folder, "exported")
        subprocess.run([VERGENCE, "export", SESSION, "--out", out, "--quiet"], check=True,
                       timeout=TIMEOUT_S)
        sides = [self.shown(f"cylinder_1x-pair1-{side}.png", out) for side in ("left", "right")]
        self.assertEqual(image.shape, (400, 2 * 672, 3))
        self.assertTrue(numpy.array_equal(image, numpy.hstack(sides)))

    def test_none_is_written_over(self):
        before = set(glob.glob(os.path.join(self.files, "view-*")))
        names = {self.asked("view")["file"] for _ in range(4)}
        after = set(glob.glob(os.path.join(self.files, "view-*")))
        self.assertEqual(len(names), 4)
        self.assertEqual({os.path.basename(path) for path in after - before}, names)

    def test_it_is_for_an_instrument_that_is_up(self):
        self.asked("safe")
        self.assertRegex(self.first.ask("view")[-1], "^ERR NOT_READY")
        self.assertRegex(self.first.ask("view half")[-1], "^ERR ARGUMENT .*full")

    def test_one_that_the_disk_has_no_room_for_leaves_nothing(self):
        before = os.listdir(self.files)
        unlimited = resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, (20000, unlimited[1]))
        try:
            self.assertRegex(self.first.ask("view full=yes")[-1], "^ERR FULL view-")
        finally:
            resource.prlimit(self.daemon.pid, resource.RLIMIT_FSIZE, unlimited)
        self.assertEqual(os.listdir(self.files), before)
        self.asked("view full=yes")


class Fetched(Looking, PlayedPairs):
    def setUp(self):
        super().setUp()
        self.asked("bringup")
        self.here = os.path.join(self.folder, self.id())
        os.mkdir(self.here)

    def fetched(self, *words, **options):
        done = self.vergence(*words, cwd=self.here, **options)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout

    def object_of(self, *words):
        """The only answer object, besides progress objects."""
        reported = [json.loads(line) for line in self.fetched("--json", *words).splitlines()]
        answers = [answer for answer in reported if "event" not in answer]
        self.assertEqual(len(answers), 1, reported)
        return answers[0]

    def assert_same(self, name, local=None):
        with open(os.path.join(self.files, name), "rb") as there:
            with open(os.path.join(self.here, local or name), "rb") as here:
                self.assertEqual(there.read(), here.read())

    def test_the_picture_comes_along(self):
        lines = self.fetched("view").splitlines()
        name = re.search(r"^written: (\S+\.png), \d+ bytes$", "\n".join(lines), re.M)[1]
        self.assertEqual(lines.count("OK"), 1)
        self.assertEqual(lines[-1], "OK")
        self.assert_same(name)
        self.assertEqual(self.shown(name, self.here).shape, (200, 2 * 336, 3))
        self.assertEqual(os.listdir(self.here), [name])

    def test_json_is_one_object(self):
        answer = self.object_of("view", "full=yes")
        self.assertTrue(answer["ok"])
        self.assertEqual(os.listdir(self.here), [answer["result"]["file"]])
        self.assertEqual(answer["result"]["size"],
                         os.path.getsize(os.path.join(self.here, answer["result"]["file"])))
        self.assert_same(answer["result"]["file"])

    def test_nothing_here_is_written_over(self):
        """An instrument with a wrong clock gives the same names again."""
        now = int(time.time())
        taken = [time.strftime(f"view-%Y%m%d-%H%M%S{more}.png", time.gmtime(now + second))
                 for second in range(120) for more in ("", "-2", "-3", "-4", "-5", "-6", "-7")]
        for name in taken:
            os.symlink("nowhere", os.path.join(self.here, name))
        name = self.object_of("view")["result"]["file"]
        self.assertNotIn(name, taken)
        self.assertEqual(sorted(os.listdir(self.here)), sorted([*taken, name]))
        self.assertEqual(self.shown(name, self.here).shape, (200, 2 * 336, 3))


if __name__ == "__main__":
    unittest.main()

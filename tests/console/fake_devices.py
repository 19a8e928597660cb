# SPDX-License-Identifier: Apache-2.0
"""A daemon on the devices of a fake kernel (tests/fake_kernel): cameras that show images, and a
lens controller at a pseudo terminal."""
import os
import pty
import re
import select
import shutil
import tempfile
import threading
import time
import tty

import numpy

from daemon_process import DaemonTest
from waiting import wait_until

LIBRARY = os.environ["VERGENCE_FAKE_KERNEL_LIBRARY"]
WIDTH, HEIGHT = 640, 480
# Slow enough that a busy machine, or a sanitizer build, loses no frames.
FRAME_US = 100000


def preloaded(script):
    """The environment of a program that has the fake kernel."""
    # A sanitizer's run-time library need not come first: it finds the functions after it.
    sanitizer = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0:detect_leaks=0"
    return {**os.environ, "LD_PRELOAD": LIBRARY, "VERGENCE_FAKE_KERNEL": script,
            "ASAN_OPTIONS": sanitizer}


def show(path, *images):
    """Replaces the picture that a camera shows, whole, as a PGM or PPM; colours are RGB. Several are shown in turn,
    another in each frame."""
    with open(path + ".new", "wb") as file:
        for image in images:
            kind = b"P6" if image.ndim == 3 else b"P5"
            file.write(kind + b" %d %d 255\n" % (image.shape[1], image.shape[0]) + image.tobytes())
    os.rename(path + ".new", path)


def texture(seed, width=WIDTH, height=HEIGHT):
    """A colour texture."""
    random = numpy.random.default_rng(seed)
    coarse = random.integers(40, 200, (height // 8, width // 8, 3), dtype=numpy.uint8)
    return numpy.kron(coarse, numpy.ones((8, 8, 1), numpy.uint8))


class LensController:
    """A V3LC at a pseudo terminal, whose motors arrive at once; `path` is its serial device.
    `counts_per_s`: a V1LC, with one lens, positions from 44 to 180, and motors so fast."""

    def __init__(self, path, counts_per_s=None):
        self.counts_per_s = counts_per_s
        self.positions = [[500, 500, 500], [500, 500, 500]]
        self.way = None  # of a V1LC's zoom: from where, to where, since when
        if counts_per_s is not None:
            self.positions = [[50, 50, 0]]
        self.master, slave = pty.openpty()
        tty.setraw(slave)
        os.symlink(os.ttyname(slave), path + ".new")
        os.rename(path + ".new", path)
        os.close(slave)
        self.path, self.ends = path, threading.Event()
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def pull_out(self):
        """Removes the device; harmless if it is gone."""
        if not self.ends.is_set():
            self.ends.set()
            self.thread.join()
            os.unlink(self.path)
            os.close(self.master)

    def serve(self):
        text = ""
        while not self.ends.is_set():
            if select.select([self.master], [], [], 0.05)[0]:
                try:
                    text += os.read(self.master, 4096).decode(errors="replace")
                except OSError:  # the other end is not open
                    self.ends.wait(0.02)
            *lines, text = text.split("\n")
            for line in lines:
                self.obey(line.strip())

    def obey(self, line):
        asked = re.fullmatch(r"([12]?)\?", line)
        moved = re.fullmatch(r"([12]?)([ZFI])(\d+)", line)
        if asked:
            lens = int(asked[1] or 1)
            self.turn()
            zoom, focus, iris = self.positions[lens - 1]
            answer = f"V{1 if self.counts_per_s else 3}LC {lens}\rZoom:{zoom:04d}\rFocus:{focus:04d}\rIris:{iris:04d}\r\n"
            os.write(self.master, answer.encode())
        elif moved and self.counts_per_s and moved[2] == "Z":
            self.turn()
            self.way = self.positions[0][0], int(moved[3]), time.monotonic()
        elif moved:
            self.positions[int(moved[1] or 1) - 1]["ZFI".index(moved[2])] = int(moved[3])


    def turn(self):
        """Current position of the slow motor."""
        if self.way is not None:
            begin, end, since = self.way
            counts = min(abs(end - begin), int((time.monotonic() - since) * self.counts_per_s))
            self.positions[0][0] = begin + (counts if end > begin else -counts)


class DeviceTest(DaemonTest):
    """A daemon for each test, once its script is written."""

    @classmethod
    def setUpClass(cls):
        cls.daemon = None

    def setUp(self):
        cls = type(self)
        cls.folder = tempfile.mkdtemp(prefix="devices")
        self.addCleanup(shutil.rmtree, cls.folder)
        cls.path, cls.files = self.place("v.sock"), self.place("files")
        self.pictures = [self.place("left.ppm"), self.place("right.ppm")]
        for seed, picture in enumerate(self.pictures):
            show(picture, texture(seed))

    @classmethod
    def place(cls, name):
        return os.path.join(cls.folder, name)

    def plug(self, name, there=True):
        """The file for the script's "plug"."""
        if there:
            with open(self.place(name), "w", encoding="ascii"):
                pass
        else:
            os.unlink(self.place(name))

    def cameras(self, frame_us=FRAME_US):
        return "".join(f"video /dev/video{side} YUYV {picture} {frame_us}\n"
                       for side, picture in enumerate(self.pictures))

    def serve(self, script, *settings):
        """Starts the daemon on the devices of a script, for `first` to ask."""
        with open(self.place("script"), "w", encoding="ascii") as file:
            file.write(script)
        self.serve_on(preloaded(self.place("script")), "backend=linux", *settings)

    def serve_on(self, environment, *settings):
        """Starts the daemon in this environment."""
        cls = type(self)
        cls.settings, cls.environment = settings, environment
        if os.path.exists(cls.path):
            os.unlink(cls.path)
        cls.start()
        self.addCleanup(self.end, cls.daemon)
        self.first = self.client()

    @classmethod
    def arguments(cls):
        return [f"socket={cls.path}", f"files={cls.files}", "store=none", *cls.settings]

    def asked(self, command):
        answer = self.first.ask_json(command)
        self.assertTrue(answer["ok"], answer)
        return answer["result"]

    def assert_logged(self, text):
        """Waits until the log contains this."""
        wait_until(lambda: text in self.output_text(), lambda: f"{text!r}\n{self.output_text()}")

    def captured(self, command="capture"):
        """The figures of a pair. A busy machine may lose frames of one camera, which is reported as
        such: then another pair is taken."""
        for _ in range(10):
            answer = self.first.ask_json(command)
            if answer["ok"]:
                return answer["result"]
            self.assertIn(answer["error"], ("MOVED", "FRAME"), answer)
        return self.fail(answer)

    def refused(self, command, begin, *words):
        """Checks that the answer begins like this, and contains these words."""
        answer = self.first.ask(command)[-1]
        self.assertEqual(answer[:len(begin)], begin, answer)
        for word in words:
            self.assertIn(word, answer)

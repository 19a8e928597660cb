# SPDX-License-Identifier: Apache-2.0
"""The fake kernel in an unmodified program: cameras that show recorded images."""
import os
import resource
import signal
import subprocess
import tempfile
import unittest

import numpy as np

PROBE = os.environ["VERGENCE_CAMERA_PROBE"]
LIBRARY = os.environ["VERGENCE_FAKE_KERNEL_LIBRARY"]
WIDTH, HEIGHT = 32, 24


def without_core():
    """Disables core dumps of programs that are meant to end abnormally."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


class Preload(unittest.TestCase):
    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.addCleanup(self.scratch.cleanup)
        self.folder = self.scratch.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def show(self, name, pixels):
        """Replaces an image atomically, as seen by a running camera."""
        maximum = 255 if pixels.dtype == np.uint8 else 65535
        kind = b"P6" if pixels.ndim == 3 else b"P5"
        data = pixels if maximum == 255 else pixels.astype(">u2")
        with open(self.path(name + ".new"), "wb") as file:
            file.write(kind + b" %d %d %d\n" % (WIDTH, HEIGHT, maximum) + data.tobytes())
        os.rename(self.path(name + ".new"), self.path(name))

    def start(self, script, device="/dev/video0", frames=2):
        with open(self.path("script"), "w", encoding="ascii") as file:
            file.write(script)
        # A sanitizer's run-time library need not come first: it finds the functions after it.
        sanitizer = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
        environment = dict(os.environ, LD_PRELOAD=LIBRARY, ASAN_OPTIONS=sanitizer,
                           VERGENCE_FAKE_KERNEL=self.path("script"))
        return subprocess.Popen([PROBE, device, str(WIDTH), str(HEIGHT), str(frames)],
                                env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                text=True, preexec_fn=without_core)

    def probe(self, script, **more):
        process = self.start(script, **more)
        out, err = process.communicate(timeout=60)
        return process.returncode, out.splitlines(), err

    def test_every_format_shows_its_picture(self):
        grey = np.full((HEIGHT, WIDTH), 77, np.uint8)
        deep = np.full((HEIGHT, WIDTH), 777, np.uint16)
        colour = np.full((HEIGHT, WIDTH, 3), (200, 100, 50), np.uint8)
        for name, pixels in (("grey", grey), ("deep", deep), ("colour", colour)):
            self.show(name, pixels)
        script = (f"# three cameras\nvideo /dev/video0 GREY {self.path('grey')} 10000\n"
                  f"video /dev/video2 SGRBG10 {self.path('deep')} 10000\n"
                  f"video /dev/video4 YUYV {self.path('colour')} 10000\n")
        self.assertEqual(self.probe(script), (0, ["8 bits: 77 faults 0"] * 2, ""))
        self.assertEqual(self.probe(script, device="/dev/video2")[1], ["10 bits: 777 faults 0"] * 2)
        code, lines, _ = self.probe(script, device="/dev/video4")
        self.assertEqual(code, 0)
        rgb = [int(word) for word in lines[0].split()[2:5]]
        self.assertLess(np.abs(np.subtract(rgb, (200, 100, 50))).max(), 4)
        code, lines, _ = self.probe(script, device="/dev/video6")
        self.assertEqual(code, 1)
        self.assertIn("/dev/video6: No such file or directory", lines[0])

    def test_the_scene_changes_while_the_camera_runs(self):
        self.show("scene", np.full((HEIGHT, WIDTH), 10, np.uint8))
        process = self.start(f"video /dev/video0 GREY {self.path('scene')} 5000\n", frames=200)
        seen = [process.stdout.readline().split()[2]]
        self.show("scene", np.full((HEIGHT, WIDTH), 20, np.uint8))
        rest = process.communicate(timeout=60)[0].splitlines()
        seen += [line.split()[2] for line in rest]
        self.assertEqual(seen[0], "10")
        self.assertEqual(seen[-1], "20")
        self.assertEqual(sorted(set(seen)), ["10", "20"])
        self.assertEqual(process.returncode, 0)

    def test_failures_and_the_record(self):
        self.show("scene", np.full((HEIGHT, WIDTH), 10, np.uint8))
        camera = f"video /dev/video0 GREY {self.path('scene')} 5000\n"
        record = f"record {self.path('record')}\n"
        code, lines, err = self.probe(camera + "fail 50 0 ENODEV DQBUF\n", frames=200)
        self.assertEqual(code, 1)
        self.assertEqual(set(lines[:-1]), {"8 bits: 10 faults 0"})
        self.assertIn("take: ", lines[-1])
        self.assertEqual(err, "<3>camera /dev/video0: DQBUF: No such device\n")
        process = self.start(camera + record + "kill 1 STREAMON\n")
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, -signal.SIGKILL)
        with open(self.path("record"), encoding="ascii") as file:
            lines = file.read().splitlines()
        self.assertEqual(lines[0], "video0 open rdwr noctty nonblock cloexec")
        self.assertEqual(lines[-1], "video0 ioctl STREAMON")

    def test_an_invalid_line_ends_the_program(self):
        for line in ("nonsense", "video /dev/video0", "fail 1 1 ENOTHING x", "i2c /dev/i2c-1 0x99"):
            code, _, err = self.probe(line + "\n")
            self.assertEqual(code, -signal.SIGABRT, line)
            self.assertIn("this line is wrong: " + line, err)


if __name__ == "__main__":
    unittest.main()

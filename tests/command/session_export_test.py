# SPDX-License-Identifier: Apache-2.0
"""Recorded pairs as pictures: their contents and names, and which files are not touched."""
import os
import pathlib
import pty
import shutil
import subprocess
import unittest

import cv2
import numpy

from pairs import BOARD, VERGENCE, Fixture, make_pair, run
from recorded import Session
from results import result_names

RECORDED = pathlib.Path(os.environ["VERGENCE_SESSIONS"])
SIDES = ("left", "right")


def names(session, *pairs):
    return [f"{session}-pair{pair}-{side}.png" for pair in pairs for side in SIDES]


def untouched(path):
    """What a write would change of a file; its time of access may change by a look at it."""
    status = os.lstat(path)
    return status.st_ino, status.st_mode, status.st_size, status.st_mtime_ns, status.st_ctime_ns


class Export(Fixture):
    def setUp(self):
        super().setUp()
        self.out = self.directory / "out"

    def exported(self, *operands, program=VERGENCE):
        done = run("export", *operands, "--out", self.out, program=program)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout

    def refused(self, words, *operands, code=3):
        done = run("export", *operands, "--out", self.out)
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (code, "", 1),
                         done.stderr)
        self.assertIn("vergence export: ", done.stderr)
        self.assertIn(words, done.stderr)

    def shown(self, name):
        image = cv2.imread(str(self.out / name), cv2.IMREAD_UNCHANGED)
        self.assertIsNotNone(image, name)
        return image

    def make_session(self, pairs=3, name="views"):
        """Two pairs of grey and one of colour, each different."""
        session, made = Session(self.directory / name), []
        for number in range(pairs):
            left, right, _ = make_pair(seed=number)
            images = [left, right] if number == 1 else [image[:, :, 0].copy()
                                                        for image in (left, right)]
            # Files store red first.
            session.pair(*[image[:, :, ::-1] if image.ndim == 3 else image for image in images])
            made.append(images)
        return session, made

    def test_every_pixel_of_every_pair(self):
        session, made = self.make_session()
        session.end()
        reported = self.exported(session.path, "--png")
        self.assertEqual(reported, "".join(f"written: {self.out}/{name}\n"
                                       for name in names("views", 1, 2, 3)))
        self.assertEqual(result_names(self.out), sorted(names("views", 1, 2, 3)))
        for number, images in enumerate(made):
            for name, image in zip(names("views", number + 1), images):
                self.assertTrue(numpy.array_equal(self.shown(name), image), name)

    def test_a_mosaic_is_developed(self):
        """Like OpenCV, except for the interpolation of colours."""
        self.exported(RECORDED / "cylinder_1x")
        words = (RECORDED / "cylinder_1x" / "session.index").read_text().split()
        for side, name in zip(SIDES, names("cylinder_1x", 1)):
            crc = next(word[-8:] for word in words if word.startswith(f"{side}_frame="))
            raw = cv2.imread(str(RECORDED / "cylinder_1x" / f"frame-{crc}.pnm"),
                             cv2.IMREAD_UNCHANGED).astype(numpy.uint16)
            light = cv2.cvtColor(raw, cv2.COLOR_BayerGB2BGR).astype(float)
            image = self.shown(name)
            self.assertEqual((image.dtype, image.shape), (numpy.uint8, light.shape))
            # Squares are light times a factor of the channel, which makes white white.
            for channel in range(3):
                shown = (image[..., channel] / 255.0) ** 2
                dark = (image[..., channel] > 20) & (image[..., channel] < 250)
                factors = shown[dark] / light[..., channel][dark]
                spread = numpy.percentile(factors, [10, 50, 90])
                self.assertLess((spread[2] - spread[0]) / spread[1], 0.15, (name, channel))
            whites = image.reshape(-1, 3).mean(axis=0)
            self.assertLess(whites.max() / whites.min(), 1.3)

    def test_one_pair(self):
        session, made = self.make_session()
        self.exported(session.path, "--pair", 2)  # the index has no end
        self.assertEqual(result_names(self.out), names("views", 2))
        self.assertTrue(numpy.array_equal(self.shown(names("views", 2)[1]), made[1][1]))
        self.refused("pair 4", session.path, "--pair", 4)

    def test_the_board_s_client_writes_the_same(self):
        self.exported(RECORDED / "mug_3x")
        files = {name: (self.out / name).read_bytes() for name in names("mug_3x", 1)}
        shutil.rmtree(self.out)
        self.exported(RECORDED / "mug_3x", program=BOARD)
        self.assertEqual(files, {name: (self.out / name).read_bytes()
                                 for name in result_names(self.out)})
        self.assertIn(b"tEXtComment\0mug_3x pair 1: skew ", files["mug_3x-pair1-left.png"])
        self.assertIn(b"right: sequence ", files["mug_3x-pair1-right.png"])

    def test_named_by_the_session_wherever_it_is_named_from(self):
        strange = self.directory / "two\nwo\x80rds"
        shutil.copytree(RECORDED / "mug_3x", strange)
        done = run("export", ".", "--out", self.out, "--quiet", cwd=strange)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.assertEqual(sorted(os.fsencode(name) for name in result_names(self.out)),
                         [b"two?wo\xc2\x80rds-pair1-%s.png" % side for side in (b"left", b"right")])
        here = run("export", strange, cwd=self.directory)
        self.assertEqual(here.returncode, 0, here.stderr)
        self.assertTrue(here.stdout.startswith("written: two?wo"))

    def test_our_pictures_are_replaced_and_no_others(self):
        session, made = self.make_session()
        session.end()
        self.exported(session.path)
        (self.out / "beside.txt").write_text("kept")
        self.exported(session.path)
        self.assertTrue(numpy.array_equal(self.shown(names("views", 1)[0]), made[0][0]))
        self.assertEqual((self.out / "beside.txt").read_text(), "kept")
        foreign = self.out / names("views", 3)[0]
        cv2.imwrite(str(foreign), made[0][0])
        first = self.out / names("views", 1)[0]
        first.unlink()
        for corrupt in (lambda: None, lambda: foreign.write_bytes(b""),
                      lambda: (foreign.unlink(), foreign.symlink_to(self.out / "beside.txt")),
                      lambda: (foreign.unlink(), os.mkfifo(foreign)),
                      lambda: (foreign.unlink(), foreign.mkdir())):
            corrupt()
            before = untouched(foreign)
            self.refused(f"{foreign} exists", session.path)
            self.assertEqual(untouched(foreign), before)
            self.assertFalse(first.exists())  # nothing was written
        self.assertEqual((self.out / "beside.txt").read_text(), "kept")

    def test_what_cannot_be_exported_leaves_nothing(self):
        session, _ = self.make_session()
        session.end()
        frame = max(session.path.glob("frame-*"), key=os.path.getmtime)
        frame.write_bytes(frame.read_bytes()[:-1])
        self.refused(str(frame), session.path)
        self.assertFalse(self.out.exists())
        self.refused("/nowhere", self.directory / "nowhere")
        self.refused(f"{RECORDED}: ", RECORDED)
        file = self.directory / "file"
        file.write_text("")
        done = run("export", RECORDED / "mug_3x", "--out", file)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))
        for operands in ((), ("a", "b"), (RECORDED / "mug_3x", "--pair", 0)):
            self.refused("", *operands, code=2)

    def test_a_full_disk_leaves_nothing(self):
        done = subprocess.run(
            ["bash", "-c", 'ulimit -f 100; exec "$@"', "bash", VERGENCE, "export", RECORDED / "mug_3x",
             "--out", self.out], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
        self.assertIn(str(self.out), done.stderr)
        self.assertFalse(self.out.exists())

    def test_a_session_that_was_cut_off_is_noted(self):
        session, _ = self.make_session(pairs=1)
        done = run("export", session.path, "--out", self.out)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (0, 1))
        self.assertIn("cut off", done.stderr)

    def test_a_bar_on_a_terminal(self):
        master, slave = pty.openpty()
        done = subprocess.run([VERGENCE, "export", RECORDED / "mug_3x", "--out", self.out],
                              stdout=subprocess.DEVNULL, stderr=slave, timeout=60, check=False)
        os.close(slave)
        shown = os.read(master, 65536).decode()
        os.close(master)
        self.assertEqual(done.returncode, 0)
        self.assertIn("exporting", shown)


if __name__ == "__main__":
    unittest.main()

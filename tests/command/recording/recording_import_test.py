# SPDX-License-Identifier: Apache-2.0
"""MCAP files and bags of independent writers as sessions."""
import os
import re
import shutil
import subprocess
import sys
import unittest

import cv2
import numpy

from pairs import grey, make_pair, run
from recordings import DATE_NS, SECOND_NS, Recordings


def colour_pairs(count):
    return [make_pair(seed=number)[:2] for number in range(count)]


def grey_pairs(count):
    return [[grey(image) for image in pair] for pair in colour_pairs(count)]


class Import(Recordings):
    def check(self, path, images, error=0):
        """All pairs, with their times and calibration."""
        taken = self.take(path)
        self.assertEqual(len(taken), len(images))
        for pair, wanted in zip(taken, images):
            for image, expected in zip(pair, wanted):
                self.assertEqual((image.shape, image.dtype), (expected.shape, expected.dtype))
                self.assertLessEqual(abs(image.astype(int) - expected).max(), error)
        index = (self.out / "session.index").read_text()
        self.assertIn("skew_us=2000 ", index)
        self.assertIn("date=2026-11-22T00:00:00Z", index)
        self.assertIn("calibration", index)
        shutil.rmtree(self.out)

    def test_packed_and_plain(self):
        images, Compression = colour_pairs(3), self.mcap.writer.CompressionType
        for ros in (1, 2):
            for compression in (Compression.NONE, Compression.ZSTD, Compression.LZ4):
                with self.subTest(ros=ros, compression=compression):
                    self.write_mcap(images, ros, compression, right_shift_ns=2000000)
                    self.check(self.file, images)
        for compression in (None, "bz2", "lz4"):
            with self.subTest(bag=compression):
                self.write_bag(images, compression, right_shift_ns=2000000)
                self.check(self.bag, images)

    def test_encodings(self):
        colour, plain = colour_pairs(2), grey_pairs(2)
        wide = [[image.astype(numpy.uint16) * 257 for image in pair] for pair in plain]
        lossy = [[cv2.imdecode(cv2.imencode(".jpeg", image)[1], cv2.IMREAD_COLOR) for image in pair]
                 for pair in colour]
        for encoding, images, wanted, error in (
                ("mono8", plain, plain, 0), ("bgr8", colour, colour, 0), ("rgb8", colour, colour, 0),
                ("bayer_grbg8", plain, plain, 0), ("mono16", wide, wide, 0),
                ("png", colour, colour, 0), ("jpeg", colour, lossy, 2)):
            for write, path in ((self.write_mcap, self.file), (self.write_bag, self.bag)):
                with self.subTest(encoding, path=path.name):
                    write(images, encoding=encoding, right_shift_ns=2000000)
                    self.check(path, wanted, error)

    def test_options(self):
        images = colour_pairs(4)
        for write, path in ((self.write_mcap, self.file), (self.write_bag, self.bag)):
            write(images, topics=("/a/image", "/b/image"))
            taken = self.take(path, "--topics", "/a/image,/b/image", "--every", 2)
            self.assertEqual(len(taken), 2)
            self.assertTrue(numpy.array_equal(taken[1][0], images[2][0]))
            shutil.rmtree(self.out)

    def test_a_split_recording(self):
        images, folder = grey_pairs(3), self.directory / "drive"
        folder.mkdir()
        for pair, number in zip(images, (1, 2, 10)):
            self.write_bag([pair], path=folder / f"drive_{number}.bag",
                           begin_ns=DATE_NS + number * SECOND_NS)
        taken = self.take(folder)
        self.assertEqual([numpy.array_equal(pair[0], wanted[0])
                          for pair, wanted in zip(taken, images, strict=True)], [True] * 3)

    def test_what_is_wrong_with_a_recording(self):
        images = grey_pairs(2)
        self.refused(["/nowhere"], self.directory / "nowhere")
        empty = self.directory / "empty"
        empty.mkdir()
        self.refused(["not a recording"], empty)
        for write, path in ((self.write_mcap, self.file), (self.write_bag, self.bag)):
            write(images)
            self.refused(["no images of the topic \"/x\"", "/left/image_raw"], path, "--topics",
                         "/x,/y")
            self.refused(["the calibration is for 100x80"], path, "--calibration",
                         self.calibration_text(100, 80))
            path.write_bytes(b"x" + path.read_bytes())
            self.refused(["neither an MCAP file nor a ROS bag"], path)
            write(images, topics=("/left/image_raw", "/depth/image_raw"))
            self.refused(["no pair of image topics", "--topics", "/depth/image_raw"], path)
            write(images, right_shift_ns=20000000)
            self.refused(["no pair of images"], path)
            write(images, info=False)
            self.refused(["no calibration", "/left/camera_info", "--calibration"], path)
            self.assertEqual(len(self.take(path, "--calibration", "none")), 2)
            shutil.rmtree(self.out)
            write([images[0], (images[1][0], images[1][1][:-2])], info=False)
            self.refused(["different sizes", "240x158"], path, "--calibration", "none")
            write(images, encoding="bayer_rggb8")
            self.refused(["bayer_rggb8", "not supported"], path)

    def test_truncated_files(self):
        for write, path, kept in ((self.write_mcap, self.file, (40, 8)),
                                  (self.write_bag, self.bag, (4200, 40, 13))):
            write(grey_pairs(2))
            whole = path.read_bytes()
            for bytes_left in (len(whole) - 1, len(whole) // 2, *kept):
                path.write_bytes(whole[:bytes_left])
                self.refused(["truncated"], path)

    def test_damaged_chunks(self):
        images = grey_pairs(2)
        self.write_mcap(images)
        whole = self.file.read_bytes()
        at = whole.index(images[0][0].tobytes()[:64]) + 9
        self.file.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1:])
        self.refused(["damaged", "checksum"], self.file)
        self.write_mcap(images, compression=self.mcap.writer.CompressionType.ZSTD)
        self.file.write_bytes(self.file.read_bytes().replace(b"zstd", b"lzma"))
        self.refused(["packed with lzma"], self.file)
        for compression, magic in (("bz2", b"BZh9"), ("lz4", b"\x04\x22\x4d\x18")):
            self.write_bag(images, compression)
            self.bag.write_bytes(self.bag.read_bytes().replace(magic, b"\0\0\0\0"))
            self.refused(["damaged", "cannot be unpacked"], self.bag)
        self.write_bag(images)
        self.bag.write_bytes(self.bag.read_bytes().replace(b"conn=", b"cone="))
        self.refused(["damaged", "a record without conn"], self.bag)

    def test_a_bag_that_was_not_closed(self):
        """What the recorder leaves: no index, and behind its last chunk's head, which does not yet
        state a size, its packed records so far."""
        images = colour_pairs(4)
        for compression in (None, "bz2", "lz4"):
            self.write_bag(images, compression)
            whole = self.bag.read_bytes()
            at = whole.index(b"index_pos=") + len(b"index_pos=")
            end = int.from_bytes(whole[at:at + 8], "little")
            open_bag = whole[:at] + bytes(8) + whole[at + 8:end]
            size_at = whole.rindex(b"size=", 0, end) + len(b"size=")
            written = open_bag[:size_at] + bytes(8) + open_bag[size_at + 8:-9000]
            active = self.directory / "drive.bag.active"
            for data, pairs in ((open_bag, 4), (open_bag[:-9000], 3), (written, 3)):
                active.write_bytes(data)
                taken = self.take(active)
                self.assertEqual(len(taken), pairs)
                self.assertTrue(numpy.array_equal(taken[-1][1], images[pairs - 1][1]))
                shutil.rmtree(self.out)

    def test_sqlite_is_refused_with_what_converts_it(self):
        images, drive = grey_pairs(2), self.directory / "drive"
        self.write_sqlite(images, drive)
        self.refused(["SQLite"], drive / "drive.db3")
        done = run("import", drive, "--out", self.out)
        self.assert_refused(done, 3, "SQLite")
        words = re.search(r"rosbags-convert (.*)\)", done.stderr).group(1)
        new = self.directory / "new"
        words = words.replace("DIR", str(drive)).replace("NEW", str(new)).split()
        converted = subprocess.run([sys.executable, "-m", "rosbags.convert", *words],
                                   env={**os.environ, "PYTHONPATH": ":".join(sys.path)},
                                   capture_output=True, text=True)
        self.assertEqual(converted.returncode, 0, converted.stderr)
        self.assertTrue(numpy.array_equal(self.take(new)[1][0], images[1][0]))

    def test_random_damage_ends_in_one_line(self):
        seed = int(os.environ.get("VERGENCE_SEED", "20261129"))
        print("seed", seed)
        random = numpy.random.default_rng(seed)
        images, encoding = [[image[:8, :12] for image in grey_pairs(1)[0]]], "png" if seed % 2 else None
        # Without checksums, so that damaged messages are parsed, too.
        self.write_mcap(images, crcs=False, encoding=encoding)
        self.write_bag(images, encoding=encoding)
        for path in (self.file, self.bag):
            whole = path.read_bytes()
            # The bag's padding says nothing.
            places = [at for at in range(8, len(whole)) if whole[at:at + 1] != b" "]
            for _ in range(60):
                data = bytearray(whole)
                for at in random.choice(places, 4):
                    data[at] = random.integers(0, 256)
                path.write_bytes(data)
                done = run("import", path, "--out", self.out)
                self.assertIn(done.returncode, (0, 1, 3), done.stderr)
                if done.returncode == 0:
                    shutil.rmtree(self.out)
                else:
                    self.assert_refused(done, done.returncode)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Invalid input is rejected with one clear line and an exit code, and leaves nothing behind."""
import os
import resource
import shutil
import subprocess
import unittest
import zlib

import numpy
from PIL import Image

import pairs
from pairs import BOARD, RECTIFIED, VERGENCE

OTHER_USER = 65534


class UnprivilegedFixture(pairs.Fixture):
    def as_other_user(self):
        """Options of pairs.run that drop root's rights, since root ignores permissions."""
        if os.geteuid() != 0:
            return {}
        # The build may be in a folder that only root can read.
        program = shutil.copy(VERGENCE, self.directory / "vergence")
        self.directory.chmod(0o777)
        return {"user": OTHER_USER, "group": OTHER_USER, "extra_groups": [], "program": program}


class Arguments(pairs.Fixture):
    def test_usage(self):
        cases = [
            ([], "command"), (["banana"], "banana"), (["recontruct"], "reconstruct"),
            (["reconstruct"], "missing"), (["reconstruct", VERGENCE], "missing"),
            (["reconstruct", "a", "b"], "--out"),
            (["reconstruct", "a", "b", "c"], "unexpected argument"),
            (["reconstruct", "a", "b", "--out", "o"], "--calibration"),
            (["reconstruct", "a", "b", "--out"], "--out"),
            (["reconstruct", "a", "b", "--neer", "1"], '(did you mean "--near"?)'),
            (["reconstruct", "a", "b", "--threads", "0"], "--threads"),
            (["reconstruct", "a", "b", "--scale", "nan"], "--scale"),
            (["reconstruct", "a", "b", "--bits", "17"], "16"),
            (["reconstruct", "a", "b", "--calibration", "c", "--near", "0.3", "--far", "3", "--out", "o"],
             "possibly in metres"),
            (["reconstruct", "a", "b", "--calibration", "c", "--near", "9.9", "--far", "inf", "--unit", "m",
              "--out", "o"], "possibly in metres"),
            (["reconstruct", "a", "b", "--rectified", "--focal", "500", "--baseline", "0.06",
              "--out", "o"], "possibly in metres"),
            (["reconstruct", "a", "b", "--rectified", "--unit", "m", "--out", "o"], "--unit"),
        ]
        for arguments, word in cases:
            with self.subTest(arguments):
                self.assert_refused(pairs.run(*arguments), 2, word)

    def test_examples_can_be_copied_from_any_help(self):
        for command in ("reconstruct", "calibrate", "board", "evaluate", "info"):
            page = pairs.run("help", command).stdout
            examples = page.split("\nExamples\n")[1]
            for line in examples.splitlines():
                self.assertRegex(line, f"^    vergence {command} [^ ]")
            self.assertFalse(page.endswith("\n\n"))

    def test_help_and_version_need_nothing_else(self):
        for arguments in (["--help"], ["help"], ["--version"], ["reconstruct", "--help"],
                          ["help", "reconstruct"], ["help", "info"], ["help", "evaluate"],
                          ["reconstruct", "--nonsense", "--help"]):
            done = pairs.run(*arguments)
            self.assertEqual((done.returncode, done.stderr), (0, ""), arguments)
            self.assertGreater(len(done.stdout), 20)
            self.assertLessEqual(max(map(len, done.stdout.splitlines())), 100)

    def test_a_standard_output_that_fails_is_an_error(self):
        with open("/dev/full", "w") as full:
            done = subprocess.run([VERGENCE, "--help"], stdout=full, stderr=subprocess.PIPE,
                                  text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("standard output", done.stderr)
        closed = subprocess.run(f'"{VERGENCE}" --help >&-', shell=True, stderr=subprocess.PIPE,
                                text=True)
        self.assertEqual(closed.returncode, 1)
        self.assertIn("standard output", closed.stderr)

    def test_a_pipe_that_closes_ends_quietly(self):
        read_end, write_end = os.pipe()
        os.close(read_end)
        done = subprocess.run([VERGENCE, "help", "reconstruct"], stdout=write_end,
                              stderr=subprocess.PIPE, text=True)
        os.close(write_end)
        self.assertEqual((done.returncode, done.stderr), (141, ""))

    def test_results_do_not_land_in_a_closed_stream(self):
        command = " ".join(map(str, [VERGENCE, "reconstruct", self.left_path, self.right_path,
                                     *RECTIFIED, "--out", self.out]))
        done = subprocess.run(command + " >&-", shell=True, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assert_near_truth()


class Images(UnprivilegedFixture):
    def refuse(self, left, right, code, *words, arguments=RECTIFIED, program=VERGENCE):
        done = pairs.run("reconstruct", left, right, *arguments, "--out", self.out, program=program)
        self.assert_refused(done, code, *words)

    def write(self, name, content):
        path = self.directory / name
        path.write_bytes(content)
        return path

    def test_files_that_are_no_images(self):
        self.refuse(self.directory / "nowhere.png", self.right_path, 3, "nowhere.png", "No such")
        self.refuse(self.left_path, self.directory, 3, "directory")
        self.refuse(self.write("empty.png", b""), self.right_path, 3, "empty.png", "empty")
        self.refuse(self.write("text.png", b"hello, world"), self.right_path, 3, "text.png", "PNG")
        self.refuse("/dev/zero", self.right_path, 3, "/dev/zero")
        fifo = self.directory / "fifo.png"
        os.mkfifo(fifo)
        self.refuse(fifo, self.right_path, 3, "pipe")
        self.refuse(self.write("odd\nname.png", b"x"), self.right_path, 3, "odd?name.png")

    def test_unreadable_files(self):
        secret = self.save("secret.png", self.left)
        secret.chmod(0)
        done = pairs.run("reconstruct", secret, self.right_path, *RECTIFIED, "--out", self.out,
                         **self.as_other_user())
        self.assert_refused(done, 3, "secret.png", "Permission denied")

    def test_a_directory_without_permission(self):
        locked = self.directory / "locked"
        locked.mkdir(mode=0)
        who = self.as_other_user()
        for words in (("info", locked), ("view", locked, "--no-browser"),
                      ("reconstruct", locked, "--all", "--out", self.out)):
            with self.subTest(words[0]):
                self.assert_refused(pairs.run(*words, **who), 3, "locked", "Permission denied")

    def test_truncated_and_damaged_files(self):
        self.save("a.jpg", self.left)
        self.save("a.tif", self.left)
        self.save("a.ppm", self.left)
        for name in ("left.png", "a.jpg", "a.tif", "a.ppm"):
            whole = (self.directory / name).read_bytes()
            for length in (9, 30, len(whole) // 2, len(whole) - 20):
                with self.subTest(name=name, length=length):
                    self.refuse(self.write("cut" + name, whole[:length]), self.right_path, 3,
                                "cut" + name)
        png = bytearray(self.left_path.read_bytes())
        png[len(png) // 2] ^= 0x10
        self.refuse(self.write("bent.png", bytes(png)), self.right_path, 3, "bent.png")
        jpeg = bytearray((self.directory / "a.jpg").read_bytes())
        middle = len(jpeg) // 2
        jpeg[middle:middle + 2000] = b"\xff\xd9" + bytes(1998)
        self.refuse(self.write("bent.jpg", bytes(jpeg)), self.right_path, 3, "bent.jpg")

    def test_headers_that_promise_too_much(self):
        def chunk(kind, data):
            return len(data).to_bytes(4, "big") + kind + data + \
                zlib.crc32(kind + data).to_bytes(4, "big")
        for side in (30000, 2 ** 31 - 1):
            header = side.to_bytes(4, "big") * 2 + b"\x10\x06\0\0\0"
            bomb = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b"") + \
                chunk(b"IEND", b"")
            self.refuse(self.write("bomb.png", bomb), self.right_path, 3, "bomb.png")
            pgm = f"P6 {side} {side} 65535\n".encode() + b"x" * 100
            self.refuse(self.write("bomb.ppm", pgm), self.right_path, 3, "bomb.ppm")
            self.refuse(self.write("bomb.ppm", pgm), self.right_path, 3, "bomb.ppm", program=BOARD)

    def test_sizes(self):
        small = self.save("small.png", self.left[:, :200])
        self.refuse(small, self.right_path, 3, "200x160", "240x160")
        one = self.save("one.png", self.left[:1, :1])
        self.refuse(one, one, 3, "1x1", "16x8")
        wide = self.save("wide.png", numpy.zeros((8, 4097), numpy.uint8))
        self.refuse(wide, wide, 3, "4096", "--scale")

    def test_kinds_that_are_not_supported(self):
        cmyk = self.directory / "cmyk.jpg"
        Image.fromarray(self.left).convert("CMYK").save(cmyk)
        self.refuse(cmyk, self.right_path, 3, "CMYK")
        floats = self.save("float.tif", self.left.astype(numpy.float32))
        self.refuse(floats, self.right_path, 3, "float.tif", "unsigned")
        raw = self.write("l.raw", bytes(1000))
        self.refuse(raw, raw, 3, "--raw")
        self.refuse(raw, raw, 3, "1000 bytes", arguments=[*RECTIFIED, "--raw", "30x20"])
        self.refuse(self.left_path, self.right_path, 3, "--bayer",
                    arguments=[*RECTIFIED, "--bayer", "grbg"])
        self.refuse(self.left_path, self.right_path, 3, "PGM/PPM", program=BOARD)

    def test_no_surface(self):
        flat = self.save("flat.png", numpy.full((160, 240), 128, numpy.uint8))
        self.refuse(flat, flat, 4, "no surface", "no texture")


class Calibrations(pairs.Fixture):
    def refuse(self, text, *words, arguments=(), program=VERGENCE):
        path = self.directory / "bad.txt"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        left, right = (self.save(n, pairs.grey(i)) for n, i in
                       (("l.pgm", self.left), ("r.pgm", self.right)))
        done = pairs.run("reconstruct", left, right, "--calibration", path, "--out", self.out,
                         *arguments, program=program)
        self.assert_refused(done, 3, *words)

    def edited(self, field, values, fix_crc=True):
        """Our own text with one field changed."""
        lines = self.calibration_text().read_text().splitlines()
        self.assertTrue(any(line.startswith(field + " ") for line in lines), field)
        body = "".join((f"{field} {values}" if line.startswith(field + " ") else line) + "\n"
                       for line in lines[:-1])
        crc = zlib.crc32(body.encode()) if fix_crc else 0x12345678
        return f"{body}crc32 {crc:08x}\n"

    def test_degenerate_values(self):
        for program in (VERGENCE, BOARD):
            for field, values, word in (
                    ("translation_right_left_mm", "0.000000000 0.000000000 0.000000000", "bad.txt"),
                    ("rotation_right_left_rad", "nan nan nan", "rotation"),
                    ("rotation_right_left_rad", "4.000000000000 3.900000000000 0.000000000000",
                     "rotation"),
                    ("left_focal_px", "0.000000000 0.000000000", "left_focal_px"),
                    ("left_size_px", "0 0", "left_size_px"),
                    ("depth_range_mm", "900.000 400.000", "depth")):
                with self.subTest(field=field, values=values, program=program):
                    self.refuse(self.edited(field, values), "bad.txt", word, program=program)

    def test_damaged_texts(self):
        self.refuse("", "empty", program=BOARD)
        self.refuse(b"\0" * 300, "bad.txt")
        self.refuse("vergence-calibration 9\n", "bad.txt", "version", program=BOARD)
        whole = self.calibration_text().read_text()
        self.refuse(whole[:200], "bad.txt")
        self.refuse(whole * 40, "bad.txt")
        self.refuse(self.edited("rectified", "yes", fix_crc=False), "bad.txt", "checksum")
        done = pairs.run("reconstruct", self.left_path, self.right_path, "--calibration",
                         self.directory / "none.txt", "--out", self.out)
        self.assert_refused(done, 3, "none.txt")

    def test_things_that_are_no_files(self):
        fifo = self.directory / "fifo.txt"
        os.mkfifo(fifo)
        left = self.save("l.pgm", pairs.grey(self.left))
        for program in (VERGENCE, BOARD):
            for path in (fifo, self.directory):
                done = pairs.run("reconstruct", left, left, "--calibration", path, "--out",
                                 self.out, program=program)
                self.assert_refused(done, 3, str(path))

    def test_pipes_and_devices_do_not_block(self):
        self.reconstruct()
        names = ["calib.txt", "intrinsics.yml", "extrinsics.yml", "truth.pfm"]
        for name in names:
            os.mkfifo(self.directory / name)
        calib, intrinsics, extrinsics, truth = (self.directory / name for name in names)
        for arguments in (["info", calib], ["info", truth], ["info", "/dev/zero"],
                          ["info", f"{intrinsics},{extrinsics}"],
                          ["evaluate", self.out, "--ground-truth", truth],
                          ["evaluate", self.out, "--ground-truth", "/dev/zero"],
                          ["reconstruct", self.left_path, self.right_path, "--out",
                           self.directory / "o", "--calibration", f"{intrinsics},{extrinsics}"]):
            with self.subTest(arguments):
                done = pairs.run(*arguments)
                self.assertEqual(done.returncode, 3, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn("device or pipe", done.stderr)

    def test_ground_truth_is_missed_before_the_work(self):
        for option in ("--ground-truth", "--mask"):
            arguments = ["--ground-truth", self.left_path] if option == "--mask" else []
            done = pairs.run("reconstruct", self.left_path, self.right_path, *RECTIFIED, "--out",
                             self.out, *arguments, option, self.directory / "none.pfm")
            self.assert_refused(done, 3, "none.pfm", "No such file")

    def test_ground_truth_that_is_none_is_refused(self):
        text = self.directory / "text.pfm"
        text.write_text("hello, world")
        colour = self.save("colour.png", self.left)
        truth = self.save("truth.pfm", self.truth)
        for arguments, word in ((["--ground-truth", text], "text.pfm"),
                                (["--ground-truth", colour], "colour.png"),
                                (["--ground-truth", truth, "--mask", text], "text.pfm")):
            with self.subTest(word=word):
                done = pairs.run("reconstruct", self.left_path, self.right_path, *RECTIFIED,
                                 "--out", self.out, *arguments)
                self.assert_refused(done, 3, word)

    def test_ground_truth_of_another_size_is_reported(self):
        truth = self.save("truth.pfm", self.truth)
        for arguments, word in ((["--scale", "0.5"], "--scale"),
                                (["--region", "10,10,80,60"], "--region")):
            with self.subTest(word=word):
                done = self.reconstruct(*RECTIFIED, "--ground-truth", truth, *arguments)
                self.assertIn("240x160", done.stderr)
                self.assertIn(word, done.stderr)
                page = (self.out / "report.html").read_text()
                self.assertIn(f"(by {word}: compare without it)", page)
                self.assertNotIn("Ground truth not used", page, "said twice")
        left, right = (self.save(n, pairs.grey(i)) for n, i in
                       (("l.pgm", self.left), ("r.pgm", self.right)))
        done = self.reconstruct(*RECTIFIED, "--ground-truth", truth, program=BOARD, left=left,
                                right=right)
        self.assertIn("--ground-truth is ignored", done.stderr)

    def test_metres_are_suspected(self):
        text = self.edited("translation_right_left_mm", "-0.100000000 0.000000000 0.000000000")
        for program in (VERGENCE, BOARD):
            self.refuse(text, "baseline of 0.1 mm", "--unit mm", program=program)
        path = self.directory / "bad.txt"
        done = pairs.run("info", path)
        self.assertEqual((done.returncode, done.stdout), (3, ""))
        self.assertIn("possibly in metres", done.stderr)
        self.assertEqual(pairs.run("info", path, "--unit", "m").returncode, 3)  # it says mm itself
        self.assertEqual(pairs.run("info", path, "--unit", "mm").returncode, 0)
        micro = self.edited("translation_right_left_mm", "-5.000000000 0.000000000 0.000000000")
        path.write_text(micro)
        self.assertEqual(pairs.run("info", path).returncode, 0)
        taken = pairs.run("reconstruct", "no.pgm", "no.pgm", "--calibration", path, "--near",
                          "6", "--far", "50", "--unit", "mm", "--out", self.out)
        self.assertNotIn("possibly in metres", taken.stderr)

    def test_another_size(self):
        self.refuse(self.calibration_text(320, 200).read_text(), "240x160", "320x200")

    def test_searches_that_find_nothing(self):
        text = self.calibration_text().read_text()
        self.refuse(text, "depth", arguments=["--near", "10", "--far", "10.1"])
        self.refuse(text, "--region", arguments=["--region", "200,100,100,100"])
        self.refuse(text, "small", arguments=["--region", "0,0,8,4"])
        self.refuse(text, "small", arguments=["--scale", "0.01"])
        self.refuse(text, "-60 to -1 px", "beyond infinity", arguments=["--disparity", "-60:60"])
        self.refuse(text, "-1024", "1024", "--disparity", arguments=["--disparity", "1020:20"])


class Output(UnprivilegedFixture):
    def attempt(self, out, **options):
        return pairs.run("reconstruct", self.left_path, self.right_path, *RECTIFIED, "--out", out,
                         **options)

    def test_places_that_cannot_be_written(self):
        file = self.directory / "file"
        file.write_text("x")
        for out, word in ((file, "not a directory"), (file / "below", "Not a directory"),
                          ("/proc/none/out", "/proc/none/out"), ("", "out")):
            with self.subTest(out):
                done = self.attempt(out)
                self.assertIn(done.returncode, (1, 2))
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn(word, done.stderr)
        self.assertEqual(file.read_text(), "x")

    def test_every_command_makes_the_directories_that_are_missing(self):
        rig = self.calibration_text()
        both = self.save("both.png", numpy.hstack([self.left, self.right]))
        session = self.directory / "a/b/session"
        for words, out in ((("reconstruct", self.left_path, self.right_path, *RECTIFIED), self.directory / "c/d/out"),
                           (("info", rig, "--export", "opencv"), self.directory / "e/f/out"),
                           (("import", both, "--side-by-side", "--calibration", rig), session),
                           (("export", session), self.directory / "g/h/out"),
                           (("reconstruct", session, "--all"), self.directory / "i/j/out")):
            with self.subTest(words[0]):
                done = pairs.run(*words, "--out", out)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertTrue(any(out.iterdir()))

    def test_a_view_that_could_keep_nothing_does_not_start(self):
        locked = self.directory / "locked"
        locked.mkdir(mode=0o500)
        options = self.as_other_user()
        locked.chmod(0o500)
        for out, word in ((locked, "cannot be written"), (locked / "new", "cannot be created"),
                          (self.left_path, "not a directory")):
            done = pairs.run("view", self.directory / "none", "--no-browser", "--out", out, **options)
            if "no web server" in done.stderr:
                self.skipTest("built without libcivetweb")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), done.stderr)
            self.assertIn(f"vergence view: {out}: ", done.stderr)
            self.assertIn(word, done.stderr)

    def test_names_that_no_directory_can_have(self):
        """Rejected before the work: the images need not be valid."""
        nowhere, loop = self.directory / "nowhere", self.directory / "loop"
        nowhere.symlink_to(self.directory / "missing")
        loop.symlink_to(loop)
        for out, word in ((nowhere, "symbolic link"), (loop, "Too many levels"),
                          (self.directory / ("x" * 300), "too long")):
            with self.subTest(word):
                done = pairs.run("reconstruct", self.left_path, self.right_path, *RECTIFIED, "--out",
                                 out)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertIn(word, done.stderr)

    def test_inputs_are_never_replaced(self):
        """An earlier result's rectified pair is a valid input, but not into the same directory."""
        self.reconstruct()
        left, right = self.out / "left_rectified.png", self.out / "right_rectified.png"
        linked = self.directory / "linked.png"
        linked.symlink_to(left)
        truth = ["--ground-truth", self.out / "disparity.pfm"]
        before = {p.name: p.read_bytes() for p in self.out.iterdir()}
        for first, second, more in ((left, right, []), (linked, self.right_path, []),
                                    (self.left_path, self.right_path, truth)):
            done = pairs.run("reconstruct", first, second, *RECTIFIED, *more, "--out", self.out)
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn("would be replaced", done.stderr)
            self.assertEqual({p.name: p.read_bytes() for p in self.out.iterdir()}, before)

    def test_a_directory_without_permission(self):
        for path in (self.directory, self.left_path, self.right_path):
            path.chmod(0o755)
        locked = self.directory / "locked"
        locked.mkdir(mode=0o555)
        who = self.as_other_user()
        for out in (locked, locked / "new", locked / "a" / "b"):
            done = self.attempt(out, **who)
            self.assertEqual(done.returncode, 1)
            self.assertIn("Permission denied", done.stderr)
        self.assertEqual(list(locked.iterdir()), [])

    @staticmethod
    def limited(megabytes):
        """A write beyond this file size fails, as on a full disk, with another errno."""
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (int(megabytes * 2 ** 20),) * 2)
        return limit

    def test_a_write_that_fails_leaves_nothing(self):
        before = self.names()
        for megabytes in (0.0001, 0.05, 0.2, 0.7):
            done = self.attempt(self.out, preexec_fn=self.limited(megabytes))
            self.assert_refused(done, 1, f"writing {self.out}/", "File too large")
            self.assertEqual(self.names(), before)

    def test_a_write_that_fails_keeps_the_earlier_result(self):
        self.reconstruct()
        before = {n: (self.directory / n).read_bytes() for n in self.names()
                  if (self.directory / n).is_file()}
        done = self.attempt(self.out, preexec_fn=self.limited(0.2))
        self.assertEqual(done.returncode, 1)
        after = {n: (self.directory / n).read_bytes() for n in self.names()
                 if (self.directory / n).is_file()}
        self.assertEqual(before, after)


class FullDisk(pairs.Fixture):
    """ENOSPC, injected into every kind of call by strace, since a test may not mount a disk."""

    def attempt(self, call, when):
        trace = ["strace", "-f", "-qq", "-o", "/dev/null", "-e", f"trace={call}", "-e",
                 f"inject={call}:error=ENOSPC:when={when}"]
        return subprocess.run([*trace, VERGENCE, "reconstruct", str(self.left_path),
                               str(self.right_path), *map(str, RECTIFIED), "--out", str(self.out)],
                              capture_output=True, text=True, timeout=120,
                              # Not under the sanitizers: their leak check is a tracer itself.
                              env={**os.environ, "ASAN_OPTIONS":
                                   os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0"})

    def test_every_call_may_find_the_disk_full(self):
        # Single calls: the line on standard error is also a write.
        for call, when in (*(("write", n) for n in (1, 2, 3, 8, 20, 50, 100)), ("fsync", 1),
                           ("fsync", 5), ("fsync", 12), ("mkdir", 1), ("rename", 1)):
            with self.subTest(call=call, when=when):
                done = self.attempt(call, when)
                self.assert_refused(done, 1, "No space left")


if __name__ == "__main__":
    print(f"seed {pairs.SEED}")
    unittest.main()

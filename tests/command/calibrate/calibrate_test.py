# SPDX-License-Identifier: Apache-2.0
"""`vergence calibrate`: results from good pictures, and messages about bad ones."""
import json
import os
import resource
import shutil
import subprocess
import unittest

import cv2
import numpy
from PIL import Image

import boards
from calibrate_fixture import Fixture
from pairs import VERGENCE
from results import result_names

SAMPLES = os.environ.get("VERGENCE_OPENCV_SAMPLES", "")
RESULTS = {"rig.calibration", "corners.vnl", "calibration.html", "calibration.json"}


class Names(Fixture):
    """The same pairs are found under any naming scheme, and give the same rig."""

    def test_folders_patterns_and_lists(self):
        self.good()
        self.assert_good(self.run_on())
        reference = (self.out / "rig.calibration").read_bytes()
        self.assertEqual(set(result_names(self.out)), RESULTS)
        sides = self.folder / "sides"
        boards.write(sides, self.made, "left/{}.png", "right/{}.png")
        cameras = self.folder / "cameras"
        boards.write(cameras, self.made, "a/shot-{}.png", "b/shot-{}.png")
        letters = self.folder / "letters"
        boards.write(letters, self.made, "shot{}_L.png", "shot{}_R.png")
        numbers = range(1, 11)
        two = self.folder / "two.txt"
        two.write_text("# left, right\n" + "".join(
            f"pictures/left{n:02d}.png pictures/right{n:02d}.png\n" for n in numbers))
        xml = self.folder / "list.xml"
        xml.write_text('<?xml version="1.0"?>\n<opencv_storage>\n<imagelist>\n' + "".join(
            f'"pictures/left{n:02d}.png"\n"pictures/right{n:02d}.png"\n' for n in numbers) +
            "</imagelist>\n</opencv_storage>\n")
        yaml = self.folder / "list.yaml"
        yaml.write_text("%YAML:1.0\n---\nimages:\n" + "".join(
            f"  - pictures/left{n:02d}.png\n  - pictures/right{n:02d}.png\n" for n in numbers))
        ways = [[f"{self.pictures}/right*.png", f"{self.pictures}/left*.png"],
                sorted(self.pictures.glob("*.png"), reverse=True), [sides],
                [sides / "left", sides / "right"], [cameras / "a", cameras / "b"], [letters], [two],
                [xml], [yaml]]
        for way in ways:
            with self.subTest(way=str(way)[:80]):
                self.assert_good(self.run_on(*way))
                self.assertEqual((self.out / "rig.calibration").read_bytes(), reference)

    def test_names_that_report_nothing(self):
        boards.write(self.pictures, self.made[:2], "x{}.png", "y{}.png")
        self.assert_refused(self.run_on(), 3, "x1.png", "camera")
        self.assert_refused(self.run_on(self.pictures / "none*.png"), 3, "none*.png")
        self.assert_refused(self.run_on(self.pictures / "none.png"), 3, "No such file")

    def test_sides_that_have_nothing_in_common(self):
        boards.write(self.pictures, self.made[:2], "left-a{}.png", "right-b1{}.png")
        self.assert_refused(self.run_on(), 3, "partner")

    def test_one_side_only(self):
        boards.write(self.pictures, [(a, None) for a, _ in self.made])
        self.assert_refused(self.run_on(), 3, "right", "--single")
        done = self.run_on(self.pictures, "--single")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(set(result_names(self.out)), RESULTS - {"rig.calibration"})
        camera = self.figures()["camera"]
        self.assertLess(abs(camera["focal_px"][0] - boards.FOCAL_PX),
                        5 * camera["focal_sigma_px"] + 0.3)

    def test_an_empty_folder(self):
        self.assert_refused(self.run_on(), 3, "pictures", "no pictures")


class Output(Fixture):
    def test_same_bytes_on_any_number_of_threads(self):
        self.good()
        other = self.folder / "other"
        self.assert_good(self.run_on("--threads", 1, self.pictures))
        self.assertEqual(self.run_on("--threads", 3, self.pictures, out=other).returncode, 0)
        for name in RESULTS:
            self.assertEqual((self.out / name).read_bytes(), (other / name).read_bytes(), name)

    def test_corners_are_read_back(self):
        self.good()
        self.assert_good(self.run_on())
        first = self.figures()
        corners = self.folder / "corners.vnl"
        shutil.move(self.out / "corners.vnl", corners)
        # The pictures now show no board, so every corner comes from the file.
        for seed, path in enumerate(sorted(self.pictures.iterdir())):
            random = numpy.random.default_rng(seed)
            cv2.imwrite(str(path), random.integers(0, 255, (480, 640)).astype(numpy.uint8))
        figures = self.assert_good(self.run_on(self.pictures, "--corners", corners))
        self.assertAlmostEqual(figures["rig"]["baseline_mm"], first["rig"]["baseline_mm"], places=3)

    def test_names_dates_and_notes(self):
        self.good()
        done = self.run_on(self.pictures, "--id", "bench-7", "--date", "2026-01-31", "--note",
                           "focus at 0.5 m", "--quiet")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        text = (self.out / "rig.calibration").read_text()
        for line in ("id bench-7", "date 2026-01-31", "note focus at 0.5 m"):
            self.assertIn(line + "\n", text)
        printed = self.run_on(self.pictures, "--json")
        self.assertEqual(json.loads(printed.stdout), self.figures())

    def test_the_unit_of_a_square_is_the_one_given(self):
        self.good()
        self.assert_good(self.run_on(board=["--board", "9x6", "--square", "0.025", "--unit", "m"]))
        reported = (self.out / "rig.calibration").read_bytes()
        self.assert_good(self.run_on())
        self.assertEqual((self.out / "rig.calibration").read_bytes(), reported)
        # A board of 0.25 mm is accepted with --unit.
        done = self.run_on(board=["--board", "9x6", "--square", "0.025", "--unit", "mm"])
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertAlmostEqual(self.figures()["rig"]["baseline_mm"], boards.BASELINE_MM / 1000, 3)

    def test_the_model_is_the_one_asked_for(self):
        self.good()
        names = {"none": "no distortion", "k1-k2-p1-p2": "k1 k2 p1 p2"}
        for asked, name in names.items():
            done = self.run_on(self.pictures, "--model", asked)
            self.assertIn(done.returncode, (0, 5), done.stderr)
            self.assertRegex(done.stdout, rf"lens model  {name}(,|\n)")
            self.assertEqual(self.figures()["model"]["lens"].split(",")[0], name)
        chosen = self.assert_good(self.run_on(self.pictures, "--model", "auto"))
        self.assertLess(len(chosen["model"]["lens"]), len("k1 k2 p1 p2 k3"))
        shutil.rmtree(self.out)
        self.assert_refused(self.run_on(self.pictures, "--model", "k9"), 2, "--model", "k1-k2")

    def test_reconstruct_takes_the_folder(self):
        self.good()
        self.assert_good(self.run_on())
        result = self.folder / "result"
        done = subprocess.run(
            [VERGENCE, "reconstruct", self.pictures / "left01.png", self.pictures / "right01.png",
             "--calibration", self.out, "--near", "350", "--far", "800", "--out", result],
            capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        depth = cv2.imread(str(result / "depth.png"), cv2.IMREAD_UNCHANGED)
        self.assertAlmostEqual(numpy.median(depth[220:260, 300:340]), boards.ROOM_MM, delta=15)

    def test_usage(self):
        for arguments, word in (([], "--board"), (["--board", "9x6"], "--square"),
                                (["--board", "9", "--square", "3"], "COLUMNSxROWS"),
                                (["--board", "9x6", "--square", "0"], "--square"),
                                (["--board", "9x6", "--square", "0.025"], "--unit"),
                                (["--board", "9x6", "--square", "1.99"], "--unit"),
                                (["--board", "9x6", "--square", "1000", "--unit", "m"], "1000000 mm"),
                                (boards.OPTIONS + ["--marker", "3"], "--charuco"),
                                (boards.OPTIONS + ["--charuco", "9x9"], "5x5_50"),
                                (boards.OPTIONS + ["--charuco", "5x5_50"], "--marker"),
                                (boards.OPTIONS + ["--charuco", "5x5_50", "--marker", 30], "smaller"),
                                (boards.OPTIONS + ["--date", "today"], "YYYY"),
                                (boards.OPTIONS + ["--id", "a b"], "--id")):
            self.assert_refused(self.run_on(self.pictures, board=arguments), 2, word)

    def test_a_write_that_fails_leaves_nothing(self):
        self.good()

        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
        self.assert_refused(self.run_on(preexec_fn=limit), 1, "File too large", f"{self.out}/")
        self.assert_refused(self.run_on(out=self.pictures / "left01.png" / "x"), 1, "directory")

    def test_a_full_disk_leaves_nothing(self):
        self.good()
        calls = [("write", 2), ("fsync", 2), ("rename", 1), ("mkdir", 1)]
        with open(VERGENCE, "rb") as program:
            if b"__asan_init" in program.read():
                # A sanitizer finds out which memory is mapped by writing to it, and ends if it
                # cannot.
                del calls[0]
        # Its leak check is a tracer itself.
        environment = {**os.environ, "ASAN_OPTIONS":
                       os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0"}
        for call, when in calls:
            with self.subTest(call=call):
                trace = ["strace", "-f", "-qq", "-o", "/dev/null", "-e", f"trace={call}", "-e",
                         f"inject={call}:error=ENOSPC:when={when}"]
                done = subprocess.run(
                    [*trace, VERGENCE, "calibrate", str(self.pictures), *map(str, boards.OPTIONS),
                     "--out", str(self.out)], capture_output=True, text=True, timeout=300,
                    env=environment)
                self.assert_refused(done, 1, "No space left")


class BadInput(Fixture):
    """One clear line each; the rest is used."""

    def corrupt(self, name, image):
        self.assertTrue(cv2.imwrite(str(self.pictures / name), image))

    def test_a_missing_partner(self):
        self.good()
        (self.pictures / "right03.png").unlink()
        done = self.run_on()
        self.assert_good(done, 9)
        self.assertIn("no right partner", self.note(done, "left03"))

    def test_the_wrong_board(self):
        self.good()
        done = self.run_on(board=["--board", "8x6", "--square", 25])
        self.assert_refused(done, 3, "found 9 x 6 corners, not 8 x 6", "--board")
        self.assertEqual(done.stderr.count("\n"), 1)

    def test_a_board_that_one_camera_sees(self):
        grey = numpy.full((boards.HEIGHT, boards.WIDTH), 90, numpy.uint8)
        boards.write(self.pictures, [(a, grey) for a, _ in self.made])
        self.assert_refused(self.run_on(), 3, "both cameras")

    def test_the_same_picture_twice(self):
        self.good()
        self.corrupt("left05.png", self.made[3][0])
        self.corrupt("right05.png", self.made[3][1])
        done = self.run_on()
        self.assert_good(done, 9)
        self.assertIn("same picture as", self.note(done, "left05.png"))
        self.assertIn("left04.png", self.note(done, "left05.png"))

    def test_left_and_right_of_different_moments(self):
        self.good()
        self.corrupt("right05.png", self.made[6][1])
        (self.pictures / "right07.png").unlink()
        done = self.run_on()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("same moment", self.note(done, "right05.png"))

    def test_mixed_resolutions(self):
        self.good()
        self.corrupt("right02.png", cv2.resize(self.made[1][1], (320, 240)))
        done = self.run_on()
        self.assert_good(done, 9)
        self.assertIn("320x240 pixels", self.note(done, "right02.png"))

    def test_three_pictures_in_all(self):
        boards.write(self.pictures, [self.made[0], (self.made[1][0], None)])
        self.assert_refused(self.run_on(), 3, "fifteen positions")

    def test_three_pairs(self):
        boards.write(self.pictures, self.made[:3])
        self.assert_not_good(self.run_on(), "only 3 boards")

    def test_parallel_boards(self):
        poses = [(0, 0, turn, x, y, z) for turn, x, y, z in
                 ((0, 0, 0, 0), (5, 50, 20, 0), (-5, -40, 30, 0), (10, 20, -40, 0), (0, -50, -30, 0),
                  (3, 60, -20, 0), (8, 0, 40, 0))]
        boards.write(self.pictures, boards.pairs(poses=poses))
        self.assert_not_good(self.run_on(), "parallel", "tilt")

    def test_blurred_and_overexposed_boards(self):
        self.good()
        self.corrupt("left02.png", cv2.GaussianBlur(self.made[1][0], (0, 0), 14))
        self.corrupt("right06.png", numpy.clip(self.made[5][1] * 9.0, 0, 255).astype(numpy.uint8))
        done = self.run_on()
        self.assert_good(done, 8)
        self.assertIn("blurred", self.note(done, "left02.png"))
        self.assertIn("overexposed", self.note(done, "right06.png"))

    def test_a_board_whose_white_is_overexposed(self):
        """It can be used, but its corners may be off: the user must be warned, also with a cache.
        """
        self.good()
        self.corrupt("right06.png", numpy.clip(self.made[5][1] * 1.6, 0, 255).astype(numpy.uint8))
        done = self.run_on()
        self.assert_good(done, 10)
        self.assertIn("expose less", self.note(done, "right06.png"))
        self.assertIn("expose less", "".join(self.figures()["notes"]))
        again = self.run_on(self.pictures, "--corners", self.out / "corners.vnl",
                            out=self.folder / "again")
        self.assertIn("expose less", self.note(again, "right06.png"))

    def test_files_that_cannot_be_read(self):
        self.good()
        whole = (self.pictures / "left02.png").read_bytes()
        (self.pictures / "left02.png").write_bytes(whole[:len(whole) // 2])
        (self.pictures / "right04.png").write_bytes(b"hello, world")
        (self.pictures / "right08.png").write_bytes(b"")
        done = self.run_on()
        self.assert_good(done, 7)
        self.note(done, "left02.png")
        self.assertIn("unknown image format", self.note(done, "right04.png"))
        self.assertIn("empty", self.note(done, "right08.png"))

    def test_photographs_that_exif_turns(self):
        """The sensor is mounted on its side: its rows are the displayed picture's columns."""
        texture = boards.board_texture()
        exif = Image.Exif()
        exif[0x0112] = 6  # rotate clockwise to display
        for number, where in enumerate(boards.POSES[:6], 1):
            for right, name in enumerate(("left", "right")):
                image = boards.picture(texture, boards.pose(*where), bool(right), scale=2,
                                       seed=2 * number + right)
                lying = numpy.rot90(image)  # as on the sensor
                Image.fromarray(lying).save(self.pictures / f"{name}{number}.jpg", quality=92,
                                            exif=exif)
        done = self.run_on()
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        figures = self.figures()
        self.assertEqual(figures["left"]["size_px"], [1280, 960])
        self.assertAlmostEqual(figures["rig"]["baseline_mm"], boards.BASELINE_MM, delta=0.2)
        # A picture with another orientation is from another camera.
        picture = Image.open(self.pictures / "left2.jpg")
        exif[0x0112] = 8
        picture.save(self.pictures / "left2.jpg", quality=92, exif=exif)
        self.assertIn("orientation", self.note(self.run_on(), "left2.jpg"))


class Recorded(Fixture):
    """opencv-doc's pairs against the published figures of their author."""

    @unittest.skipUnless(os.path.exists(os.path.join(SAMPLES, "stereo_calib.xml")), "no opencv-doc")
    def test_thirteen_pairs(self):
        done = self.run_on(os.path.join(SAMPLES, "stereo_calib.xml"),
                           board=["--board", "9x6", "--square", 30])
        self.assertEqual(done.returncode, 0, done.stderr)
        figures = self.figures()
        self.assertEqual(figures["fit"]["pairs_used"], 13)
        self.assertLessEqual(figures["fit"]["rms_px"], 0.210)
        self.assertAlmostEqual(figures["rig"]["baseline_mm"], 99.80, delta=0.10)
        self.assertLessEqual(figures["rig"]["rows_rms_px"], 0.15)
        for got, published, wide in zip(figures["rig"]["rotation_right_left_rad"],
                                        (0.00669, 0.00452, -0.00350), (0.0027, 0.0031, 0.0003)):
            self.assertAlmostEqual(got, published, delta=wide)


if __name__ == "__main__":
    unittest.main()

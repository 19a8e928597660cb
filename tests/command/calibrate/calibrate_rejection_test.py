# SPDX-License-Identifier: Apache-2.0
"""`vergence calibrate`: the error line is right, even for unusual mistakes."""
import json
import os
import shutil
import signal
import subprocess
import time
import unittest

import cv2
import numpy

import boards
import seen_corners
from calibrate_fixture import Fixture
from pairs import VERGENCE, run


def processor_s():
    """Processor time of the programs that were run and have ended, s."""
    times = os.times()
    return times.children_user + times.children_system


class Seen(Fixture):
    """Corners from a cache: the solution and its messages."""

    def run_seen(self, made, *arguments, board=None, sigma_px=seen_corners.NOISE_PX, **options):
        cache = seen_corners.write(self.pictures, made, sigma_px)
        return self.run_on(f"{self.pictures}/*.png", "--corners", cache, *arguments, board=board,
                           **options)

    def test_a_right_camera_on_its_head(self):
        turn = numpy.diag([-1.0, -1, 1])
        done = self.run_seen(seen_corners.pairs(R=turn, t_mm=turn @ [-boards.BASELINE_MM, 0, 0]))
        self.assertNotIn("swapped", done.stderr)
        self.assert_good(done)

    def test_left_and_right_exchanged(self):
        self.assert_not_good(self.run_seen([pair[::-1] for pair in seen_corners.pairs()]),
                             "swapped")

    def test_numbers_that_the_text_cannot_hold(self):
        """Baseline and focal length: rejected by name, and nothing is left behind."""
        # 100 m per square turns the baseline of 90 mm into 360 km.
        done = self.run_seen(seen_corners.pairs(), board=["--board", "9x6", "--square", 1e5])
        self.assert_refused(done, 3, "the calibration found cannot be used",
                            "translation_right_left_mm")

    def mirrored(self, count):
        made = seen_corners.pairs(count)
        for pair in made:
            pair[1][:, 0] = boards.WIDTH - 1 - pair[1][:, 0]
            # Numbered as the detector would: clockwise again.
            pair[1] = pair[1].reshape(boards.ROWS, boards.COLUMNS, 2)[::-1].reshape(-1, 2)
        return made

    def test_many_pairs_of_one_mirrored_camera(self):
        before_s = processor_s()
        done = self.run_seen(self.mirrored(60))
        mirrored_s = processor_s() - before_s
        self.assertIn(done.returncode, (3, 5))
        self.assertIn("mirrored", done.stderr.splitlines()[-1])
        # Correct pairs are solved to the end.
        shutil.rmtree(self.out, ignore_errors=True)
        before_s = processor_s()
        self.assert_good(self.run_seen(seen_corners.pairs(60)), 60)
        self.assertLess(mirrored_s, processor_s() - before_s + 2)

    def test_boards_that_move_between_left_and_right(self):
        """Free-running webcams: each camera fits, and no mirror explains the pairs."""
        for moved in ((10, 2), (80, 10)):
            for seed in (1, 2):
                shutil.rmtree(self.out, ignore_errors=True)
                done = self.run_seen(seen_corners.pairs(15, moved=moved, seed=seed))
                self.assertIn(done.returncode, (3, 5), (moved, seed))
                self.assertIn("do not show the board at the same place",
                              done.stderr.splitlines()[-1], (moved, seed))
                self.assertNotIn("mirror", done.stderr, (moved, seed))

    def test_a_lens_that_the_model_does_not_fit_moves_no_board(self):
        def fisheye(points_mm):
            radius_mm = numpy.hypot(points_mm[:, 0], points_mm[:, 1])
            angle = numpy.arctan2(radius_mm, points_mm[:, 2])
            return points_mm[:, :2] * (260 * angle / radius_mm)[:, None] + (
                numpy.array([boards.WIDTH, boards.HEIGHT]) - 1) / 2
        random = numpy.random.default_rng(4)
        made = []
        for turn, _ in seen_corners.poses(400):
            depth_mm = random.uniform(150, 350)
            middle = numpy.array([random.uniform(-1.2, 1.2), random.uniform(-0.8, 0.8), 1])
            points_mm = seen_corners.board_mm() @ turn.T + middle * depth_mm
            pair = [fisheye(points_mm), fisheye(points_mm - [60, 0, 0])]
            inside = all((view > 0).all() and (view < [boards.WIDTH, boards.HEIGHT]).all()
                         for view in pair)
            if inside and len(made) < 20:
                made.append([view + random.normal(0, 0.05, view.shape) for view in pair])
        for model in ("none", "k1"):
            shutil.rmtree(self.out, ignore_errors=True)
            done = self.run_seen(made, "--model", model)
            self.assertEqual(done.returncode, 5, done.stderr)
            self.assertNotIn("at the same place", done.stderr)

    def test_few_pairs_of_one_mirrored_camera(self):
        for count in (8, 15):
            done = self.run_seen(self.mirrored(count))
            self.assertIn(done.returncode, (3, 5), count)
            self.assertIn("one camera only are mirrored", done.stderr.splitlines()[-1], count)
            shutil.rmtree(self.out, ignore_errors=True)

    def test_ctrl_c_while_mirrored_pairs_are_looked_at(self):
        cache = seen_corners.write(self.pictures, self.mirrored(15))
        command = [VERGENCE, "calibrate", f"{self.pictures}/*.png", "--corners", cache,
                   *map(str, boards.OPTIONS), "--out", str(self.out)]
        begin = time.monotonic()
        subprocess.run(command, capture_output=True)
        whole = time.monotonic() - begin
        shutil.rmtree(self.out, ignore_errors=True)
        stopped = 0
        for part in (0.3, 0.5, 0.6, 0.7, 0.8, 0.9):
            begin = time.monotonic()
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            time.sleep(part * whole)
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
            if process.returncode in (3, 5):
                # It finished before: other programs slowed the first run.
                whole = min(whole, time.monotonic() - begin)
            else:
                stopped += 1
                self.assertEqual(process.returncode, 130, part)
                self.assertEqual([p.name for p in self.folder.iterdir()], ["pictures"])
            shutil.rmtree(self.out, ignore_errors=True)
        self.assertGreater(stopped, 2)

    def test_a_board_behind_the_left_camera(self):
        """The right camera looks to the left from the far side, and only there saw one board."""
        def turned(degrees):
            return cv2.Rodrigues(numpy.array([0, numpy.radians(degrees), 0]))[0]
        R = turned(100)
        t_mm = -R @ [600.0, 0, 600]
        made = seen_corners.pairs(12, R, t_mm, facing=turned(-50))
        self.assertTrue(all((view > 0).all() and (view < boards.WIDTH).all()
                            for pair in made for view in pair))
        in_right = numpy.array([-450.0, 0, 1500])
        board_mm = (seen_corners.board_mm() + in_right - t_mm) @ R
        self.assertLess(board_mm[:, 2].max(), 0)
        alone = seen_corners.pixels(board_mm, R, t_mm)
        done = self.run_seen([*made, [None, alone]])
        self.assertIn("in front of the camera", self.note(done, "right13.png: "))
        named = [view["name"] for view in self.figures()["rejected"]["views"]]
        self.assertIn("right13.png", named)

    def test_a_cache_that_claims_too_much(self):
        for sigma_px in (1e-300, 1e-7, 1e4):
            shutil.rmtree(self.pictures)
            done = self.run_seen(seen_corners.pairs(4), sigma_px=sigma_px)
            self.assert_refused(done, 3, "seen.vnl: line 1", "standard deviation")
            self.assertEqual(done.stderr.count("\n"), 1)


class Advice(Fixture):
    """The advice matches the error."""

    def test_a_smaller_board_than_the_pictures_show(self):
        """Two views are cut so that they show as many corners as requested."""
        self.good()
        for name, view in (("left03.png", self.made[2][0]), ("right07.png", self.made[6][1])):
            texture = boards.board_texture(8, 6)
            where = boards.pose(*boards.POSES[int(name[-5]) - 1])
            cv2.imwrite(str(self.pictures / name), boards.picture(texture, where,
                                                                  name.startswith("right")))
        done = self.run_on(board=["--board", "8x6", "--square", 25])
        self.assert_refused(done, 3, "found 9 x 6 corners, not 8 x 6 (18 of 20 pictures)",
                            "--board")
        self.assertIn("only a part of the board of 9 x 6 corners", self.note(done, "left03.png"))

    def test_files_that_are_missing(self):
        names = self.folder / "pictures" / "names.txt"
        names.write_text("left1.png right1.png\n")
        done = self.run_on(names)
        self.assert_refused(done, 3, "No such file or directory (2 of 2 pictures)")
        self.assertNotIn("--board", done.stderr)

    def test_left_and_right_are_the_same(self):
        boards.write(self.pictures, [(a, a) for a, _ in self.made])
        done = self.run_on()
        self.assert_refused(done, 3, "left and right are the same picture (10 of 20 pictures)",
                            "--single")
        self.assertNotIn("whole board", done.stderr)

    def coded(self):
        aruco = getattr(cv2, "aruco", None)
        if aruco is None or not hasattr(aruco, "CharucoBoard_create"):
            self.skipTest("no cv2.aruco")
        dictionary = aruco.getPredefinedDictionary(aruco.DICT_5X5_50)
        board = aruco.CharucoBoard_create(10, 7, 25, 18, dictionary)
        side = 25 * boards.TEXELS_A_MM
        texture = numpy.pad(board.draw((10 * side, 7 * side)), 60, constant_values=230)
        return boards.pairs(texture, boards.POSES[:4])

    def test_coded_boards(self):
        made = self.coded()
        options = ["--board", "9x6", "--square", 25, "--charuco", "5x5_50", "--marker"]
        boards.write(self.pictures, made)
        done = self.run_on(board=[*options, 9])
        self.assert_refused(done, 3, "--marker")
        boards.write(self.pictures, [(a[:, ::-1], b[:, ::-1]) for a, b in made])
        done = self.run_on(board=[*options, 18])
        self.assert_refused(done, 3, "read backwards", "mirroring")
        self.assertNotIn("--board", done.stderr)
        boards.write(self.pictures, [(a, b[:, ::-1]) for a, b in made])
        done = self.run_on(board=[*options, 18])
        self.assert_refused(done, 3, "read backwards", "mirroring")
        self.assertNotIn("whole board", done.stderr)

    def old_layout(self, columns, rows):
        """Squares as OpenCV before 4.6 drew them: an even number of rows began with white."""
        if not hasattr(getattr(cv2, "aruco", None), "drawMarker"):
            self.skipTest("no cv2.aruco")
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
        side, marker = 25 * boards.TEXELS_A_MM, 18 * boards.TEXELS_A_MM
        edge = (side - marker) // 2
        texture = numpy.zeros((rows * side, columns * side), numpy.uint8)
        white = [(y, x) for y in range(rows) for x in range(columns) if (x + y) % 2 == 0]
        for number, (y, x) in enumerate(white):
            square = texture[y * side:(y + 1) * side, x * side:(x + 1) * side]
            square[:] = 230
            square[edge:edge + marker, edge:edge + marker] = numpy.minimum(
                cv2.aruco.drawMarker(dictionary, number, marker), 230)
        return texture

    def run_coded(self, texture, columns, rows):
        texture = numpy.pad(texture, 60, constant_values=230)
        boards.write(self.pictures, boards.pairs(texture, boards.POSES))
        done = self.run_on(board=["--board", f"{columns - 1}x{rows - 1}", "--square", 25,
                                  "--charuco", "5x5_50", "--marker", 18])
        self.assert_good(done)
        return done.stderr

    def test_the_layout_of_a_coded_board_is_named(self):
        self.assertIn("layout of OpenCV before 4.6",
                      self.run_coded(self.old_layout(10, 6), 10, 6))

    def test_the_layout_of_a_coded_board_with_an_odd_number_of_squares_in_a_row(self):
        texture = self.old_layout(9, 6)
        said = self.run_coded(texture, 9, 6)
        self.assertIn("its top left square is white (20 pictures)", said)
        corners = (self.out / "corners.vnl").read_text().splitlines()
        self.assertNotIn("left01.png - - -", corners)
        # Where the squares at both ends are covered, nothing decides.
        shutil.rmtree(self.out)
        covered = 13 * texture.shape[1] // 90
        texture[:, :covered] = texture[:, -covered:] = 128
        said = self.run_coded(texture, 9, 6)
        self.assertIn("no picture shows whether the coded board has the layout", said)
        self.assertNotIn("top left", said)

    def test_formats_that_are_not_read(self):
        boards.write(self.pictures, [(a, None) for a, _ in self.made[:2]], left="left{:02d}.bmp")
        self.assert_refused(self.run_on(), 3, "no pictures", "left01.bmp and 1 more are left out")
        self.good()
        boards.write(self.pictures, [(a, None) for a, _ in self.made[:1]], left="left99.webp")
        (self.pictures / "left02.png").unlink()
        done = self.run_on()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("PNG, JPEG, PGM, TIFF", self.note(done, "left01.bmp and 2 more are left out"))

    def test_days_that_no_calendar_has(self):
        self.good()
        for day in ("2026-99-99", "2026-02-29", "2026-01-00", "20260131", "2026-01-311"):
            done = self.run_on(self.pictures, "--date", day)
            self.assert_refused(done, 2, "--date", "YYYY-MM-DD")
        self.assert_good(self.run_on(self.pictures, "--date", "2024-02-29"))


class Figures(Fixture):
    """`vergence info` on the output of calibrate."""

    def test_one_camera(self):
        boards.write(self.pictures, [(a, None) for a, _ in self.made])
        self.assertEqual(self.run_on(self.pictures, "--single").returncode, 0)
        done = run("info", self.out / "calibration.json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("calibration.json: figures of one camera's calibration", done.stdout)
        self.assertIn("Good: ", done.stdout)
        self.assertNotIn("reconstruction", done.stdout)
        for arguments in ([], ["--export", "ros", "--out", self.folder / "ros"]):
            done = run("info", self.out, *arguments)
            self.assertEqual((done.returncode, done.stdout), (3, ""))
            self.assertIn("one camera alone", done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)

    def test_a_pair(self):
        self.good()
        self.assert_good(self.run_on())
        done = run("info", self.out / "calibration.json")
        self.assertIn("figures of a calibration", done.stdout)
        self.assertIn("baseline", done.stdout)
        reported = json.loads(run("info", self.out / "calibration.json", "--json").stdout)
        self.assertEqual(reported[0]["result"], self.figures())


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""vergence reconstruct on pairs with a known surface."""
import json
import os
import pathlib
import re
import unittest

import cv2
import numpy

import pairs
from pairs import BOARD, BASELINE_MM, FAR_PX, FOCAL_PX, NEAR_PX, RECTIFIED
from results import result_names

HOST_FILES = ["depth.png", "disparity.pfm", "disparity.png", "left_rectified.png", "mesh.glb",
              "mesh.ply", "points.pcd", "reasons.png", "report.html", "result.json",
              "right_rectified.png", "surface.compact"]
BOARD_FILES = ["disparity.pfm", "mesh.ply", "points.pcd", "reasons.pgm", "result.json",
               "surface.compact"]


class Reconstruct(pairs.Fixture):
    def test_writes_all_files_and_finds_the_surface(self):
        done = self.reconstruct()
        self.assertEqual(result_names(self.out), HOST_FILES)
        self.assertIn("surface", done.stdout)
        self.assertIn(str(self.out), done.stdout)
        self.assert_near_truth()

    def test_the_board_gives_the_same_surface(self):
        rig = self.calibration_text()
        grey_left = self.save("left.pgm", pairs.grey(self.left))
        grey_right = self.save("right.pgm", pairs.grey(self.right))
        arguments = ["--calibration", rig]
        self.reconstruct(*arguments, program=BOARD, left=grey_left, right=grey_right)
        self.assertEqual(result_names(self.out), BOARD_FILES)
        board = {name: (self.out / name).read_bytes() for name in BOARD_FILES[:3]}
        reasons = cv2.imread(str(self.out / "reasons.pgm"), cv2.IMREAD_UNCHANGED)
        self.reconstruct(*arguments, left=grey_left, right=grey_right)
        for name, content in board.items():
            self.assertEqual(content, (self.out / name).read_bytes(), name)
        self.assertEqual((reasons == 0).sum(), numpy.isfinite(self.disparity()).sum())

    def test_the_page_on_results_is_right(self):
        page = pathlib.Path(os.environ["VERGENCE_SOURCE"], "daemon", "surface.md").read_text()
        rows = [[cell.strip() for cell in line.strip("|").split("|")]
                for line in page.splitlines() if line.startswith("|")]
        named = {name for row in rows for name in re.findall(r"`(\w+\.\w+)`", row[0])}
        self.assertEqual(named, set(HOST_FILES) | set(BOARD_FILES))
        board = {row[0] for row in rows if len(row) == 3 and row[2] == "yes"}
        self.assertEqual({n for n in named if any(f"`{n}`" in cell for cell in board)},
                         set(BOARD_FILES) | {"reasons.png"})
        grey = [self.save(n, pairs.grey(i)) for n, i in (("l.pgm", self.left),
                                                         ("r.pgm", self.right))]
        self.reconstruct("--calibration", self.calibration_text(), program=BOARD, left=grey[0],
                         right=grey[1])
        written = re.findall(rb"^# (\d+) (.*)$", (self.out / "reasons.pgm").read_bytes()[:1000],
                             re.MULTILINE)
        stated = [(row[0].encode(), row[1].encode()) for row in rows if row[0].isdigit()]
        self.assertEqual(stated, written)

    def test_threads_do_not_change_the_result(self):
        kept = None
        for threads in (1, 2, 5):
            self.reconstruct(*RECTIFIED, "--threads", threads)
            files = {n: (self.out / n).read_bytes() for n in HOST_FILES
                     if n not in ("result.json", "report.html", "surface.compact")}
            self.assertEqual(json.loads((self.out / "result.json").read_text())
                             ["options"]["threads"], threads)
            kept = kept or files
            for name, content in files.items():
                self.assertEqual(content, kept[name], f"{name} with {threads} threads")

    def test_depth_is_metric(self):
        self.reconstruct()
        depth = cv2.imread(str(self.out / "depth.png"), cv2.IMREAD_UNCHANGED)
        found = self.disparity()
        box = numpy.zeros(depth.shape, bool)
        box[70:100, 110:150] = True
        for region, disparity in ((box, NEAR_PX), (numpy.arange(240)[None] > 190, FAR_PX)):
            inside = numpy.broadcast_to(region, depth.shape) & (depth > 0)
            self.assertGreater(inside.sum(), 500)
            expected = FOCAL_PX * BASELINE_MM / disparity
            self.assertAlmostEqual(numpy.median(depth[inside]), expected, delta=0.01 * expected)
        valid = depth > 0
        self.assertTrue(numpy.array_equal(valid, numpy.isfinite(found)))
        self.assertLess(abs(depth[valid] - FOCAL_PX * BASELINE_MM / found[valid]).max(), 1.0)

    def test_result_json_reports_the_truth(self):
        done = self.reconstruct(*RECTIFIED, "--json")
        result = json.loads(done.stdout)
        self.assertEqual(result, json.loads((self.out / "result.json").read_text()))
        self.assertEqual(sum(result["reasons"].values()), result["counts"]["pixels"])
        valid = int(numpy.isfinite(self.disparity()).sum())
        self.assertEqual(result["reasons"]["valid"], valid)
        self.assertEqual(result["counts"]["vertices"], valid)
        self.assertAlmostEqual(result["density_percent"], 100 * valid / (240 * 160), places=3)
        self.assertEqual(result["plan"]["disparity_count"], 48)
        self.assertAlmostEqual(result["plan"]["f_px"], FOCAL_PX)
        self.assertTrue(result["metric"])
        self.assertGreater(result["memory_bytes"]["matching_state"], 0)
        self.assertLessEqual(result["memory_bytes"]["arena_peak"], result["memory_bytes"]["arena"])
        self.assertGreater(result["memory_bytes"]["process_peak"], 0)
        stages = [v for k, v in result["time_ms"].items() if k not in ("read", "total")]
        self.assertEqual(len(stages), 7)
        self.assertLessEqual(sum(stages), result["time_ms"]["total"])
        self.assertNotEqual(result["build_id"], "")

    def test_disparities_of_0_and_less_are_kept_without_a_depth(self):
        """The right image moved by 20 px: the wall is at -8 px, the box at 10."""
        moved = numpy.zeros_like(self.right)
        moved[:, 20:] = self.right[:, :-20]
        right = self.save("moved.png", moved)
        self.truth -= 20
        done = self.reconstruct("--rectified", "--disparity", "-32:64", right=right)
        self.assertIn("beyond infinity", done.stderr)
        self.assert_near_truth(density=0.5)
        found = self.disparity()
        self.assertGreater((found < -7).mean(), 0.4)
        pages = json.loads(pairs.run("info", self.out / "points.pcd", "--json").stdout)
        self.assertEqual(pages[0]["points"], (numpy.isfinite(found) & (found > 0)).sum())
        # All of it behind infinity: no surface, but maps.
        self.reconstruct("--rectified", "--disparity", "-32:28", right=right)
        self.assertEqual(sorted(set(HOST_FILES) - set(os.listdir(self.out))),
                         ["depth.png", "mesh.glb", "mesh.ply", "points.pcd"])
        self.assertGreater((self.disparity() < 0).mean(), 0.4)
        # A calibration knows where infinity is.
        done = pairs.run("reconstruct", self.left_path, right, "--calibration",
                         self.calibration_text(), "--rectified", "--disparity", "-32:28", "--out",
                         self.out)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("beyond infinity", done.stderr)

    def test_an_assumed_geometry_is_reported(self):
        done = self.reconstruct("--rectified", "--disparity", "0:48")
        self.assertIn("assumed", done.stderr)
        self.assertNotIn("depth.png", os.listdir(self.out))
        result = json.loads((self.out / "result.json").read_text())
        self.assertFalse(result["metric"])
        self.assertTrue(any("assumed" in w for w in result["warnings"]))
        self.assertIn(b"assumed", (self.out / "mesh.ply").read_bytes()[:600])
        self.assert_near_truth()

    def test_a_calibration_that_does_not_fit_is_suspected(self):
        shifted = numpy.roll(self.right, 3, axis=0)
        done = pairs.run("reconstruct", self.left_path, self.save("shifted.png", shifted),
                         *RECTIFIED, "--out", self.out)
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertIn("that the calibration belongs to them", done.stderr)
        shifted[:25] = self.right[:25]  # some rows fit
        done = pairs.run("reconstruct", self.left_path, self.save("partly.png", shifted),
                         *RECTIFIED, "--speckle", "0", "--out", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("calibration belongs to these images", done.stderr)

    def test_images_much_higher_than_wide_are_measured_or_refused_by_name(self):
        high = [self.save(f"{name}_high.png", numpy.vstack(8 * [image[:, 100:120]]))
                for name, image in (("left", self.left), ("right", self.right))]
        assert cv2.imread(str(high[0])).shape[0] > 16 * 20
        done = pairs.run("reconstruct", *high, "--rectified", "--disparity", "0:16", "--keep-all",
                         "--out", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = pairs.run("reconstruct", *high, "--rectified", "--disparity", "0:16", "--focal", 20,
                         "--out", self.out)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("focal length of 20 px", done.stderr)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1)

    def test_rows_that_spread_are_named(self):
        middle = (pairs.HEIGHT - 1) / 2
        grow = 1 + 1.2 / pairs.HEIGHT
        matrix = numpy.float64([[1, 0, 0], [0, grow, middle * (1 - grow)]])
        moved = cv2.warpAffine(self.right, matrix, (pairs.WIDTH, pairs.HEIGHT),
                               flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
        right = self.save("spread.png", moved)
        done = pairs.run("reconstruct", self.left_path, right, *RECTIFIED, "--out", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = json.loads((self.out / "result.json").read_text())["vertical_disparity"]
        self.assertLess(rows["median_px"], 0.5)
        self.assertIn("focal length", done.stderr)

    def test_rows_apart_count_in_pixels_that_were_taken(self):
        # A third of a pixel is acceptable, regardless of the image size.
        matrix = numpy.float64([[1, 0, 0], [0, 1, 0.34]])
        moved = cv2.warpAffine(self.right, matrix, (pairs.WIDTH, pairs.HEIGHT),
                               flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
        right = self.save("moved.png", moved)
        for scale, shift in ((1, 0.34), (2.5, 0.85)):
            done = pairs.run("reconstruct", self.left_path, right, "--rectified", "--focal",
                             pairs.FOCAL_PX, "--baseline", pairs.BASELINE_MM, "--disparity",
                             f"0:{round(48 * scale)}", "--scale", scale, "--out", self.out)
            self.assertEqual(done.returncode, 0, done.stderr)
            result = json.loads((self.out / "result.json").read_text())
            self.assertAlmostEqual(result["vertical_disparity"]["median_px"], shift, delta=0.1)
            self.assertNotIn("apart", done.stderr)

    def test_every_preset_finds_the_surface(self):
        for preset in ("fast", "standard", "best", "board", "paper"):
            with self.subTest(preset):
                self.reconstruct(*RECTIFIED, "--preset", preset)
                result = json.loads((self.out / "result.json").read_text())
                self.assertEqual(result["options"]["preset"], preset)
                self.assert_near_truth()

    def test_an_earlier_result_is_replaced_as_a_whole(self):
        self.reconstruct()
        (self.out / "mine.txt").write_text("keep me")
        self.reconstruct("--rectified", "--disparity", "0:48")
        expected = sorted(HOST_FILES + ["mine.txt"])
        expected.remove("depth.png")  # of the earlier run; this one has no millimetres
        self.assertEqual(result_names(self.out), expected)

    def test_region_cuts_a_window(self):
        self.reconstruct(*RECTIFIED, "--region", "80,40,100,90")
        found = self.disparity()
        self.assertEqual(found.shape, (90, 100))
        plan = json.loads((self.out / "result.json").read_text())["plan"]
        # The window of the right image may be at another place: only the total disparity counts.
        shift = plan["cx_left_px"] - plan["cx_right_px"]
        truth = self.truth[40:130, 80:180] + shift
        valid = numpy.isfinite(found)
        self.assertGreater(valid.mean(), 0.5)
        self.assertGreater((abs(found - truth)[valid] < 0.5).mean(), 0.97)

    def test_scale_halves_the_result(self):
        self.reconstruct(*RECTIFIED, "--scale", "0.5")
        found = self.disparity()
        self.assertEqual(found.shape, (80, 120))
        valid = numpy.isfinite(found)
        self.assertAlmostEqual(numpy.median(found[valid]), FAR_PX / 2, delta=0.1)

    def test_keep_all_rejects_nothing_but_borders(self):
        self.reconstruct(*RECTIFIED, "--keep-all", "--no-refine")
        reasons = json.loads((self.out / "result.json").read_text())["reasons"]
        for name in ("occluded", "no_texture", "ambiguous", "speckle"):
            self.assertEqual(reasons[name], 0, reasons)

    def test_quiet_is_quiet(self):
        done = self.reconstruct(*RECTIFIED, "--quiet")
        self.assertEqual(done.stdout + done.stderr, "")

    def test_no_progress_bar_without_a_terminal(self):
        self.assertNotIn("\r", self.reconstruct().stderr)

    def test_larger_than_the_maximum_is_shrunk_by_scale(self):
        big_left = self.save("bl.png", cv2.resize(self.left, (4800, 320),
                                                  interpolation=cv2.INTER_NEAREST))
        big_right = self.save("br.png", cv2.resize(self.right, (4800, 320),
                                                   interpolation=cv2.INTER_NEAREST))
        arguments = ["--rectified", "--focal", "1000", "--baseline", "10", "--disparity", "0:640"]
        refused = pairs.run("reconstruct", big_left, big_right, *arguments, "--out", self.out)
        self.assert_refused(refused, 3, "4096", "--scale 0.5")
        self.reconstruct(*arguments, "--scale", "0.5", left=big_left, right=big_right)
        result = json.loads((self.out / "result.json").read_text())
        self.assertEqual((result["plan"]["width_px"], result["plan"]["height_px"]), (2400, 160))
        self.assertAlmostEqual(result["plan"]["f_px"], 500)
        self.assertEqual(result["input"]["shrunk_by"], 2)
        self.assertAlmostEqual(result["plan"]["cx_left_px"], 1199.5)

    def test_a_large_pair_with_a_calibration_of_its_own_size(self):
        factor, width, height = 5, 1000, 600
        left, right, truth = pairs.make_pair(width=width, height=height)
        big = [self.save(name, cv2.resize(image, None, fx=factor, fy=factor,
                                          interpolation=cv2.INTER_CUBIC))
               for name, image in (("bl.png", pairs.grey(left)), ("br.png", pairs.grey(right)))]
        big_width, big_height, focal_px = factor * width, factor * height, factor * FOCAL_PX
        rig = self.calibration_text(big_width, big_height, focal_px)
        self.assertIn(f"left_size_px {big_width} {big_height}\n", rig.read_text())
        arguments = ["--calibration", rig, "--disparity", "0:96"]
        refused = pairs.run("reconstruct", *big, *arguments, "--out", self.out)
        self.assert_refused(refused, 3, "4096", "--scale 0.5")
        # The reader halves the images, rectification does the rest of the scale.
        scale = 0.4
        done = self.reconstruct(*arguments, "--scale", scale, left=big[0], right=big[1])
        self.assertIn("shrunk by 2", done.stderr)
        result = json.loads((self.out / "result.json").read_text())
        plan = result["plan"]
        self.assertEqual(result["input"]["shrunk_by"], 2)
        self.assertEqual((plan["width_px"], plan["height_px"]),
                         (big_width * scale, big_height * scale))
        self.assertAlmostEqual(plan["f_px"], focal_px * scale)
        self.assertAlmostEqual(plan["cx_left_px"], (big_width * scale - 1) / 2)
        found = self.disparity()
        truth = factor * scale * cv2.resize(truth, found.shape[::-1],
                                            interpolation=cv2.INTER_NEAREST)
        valid = numpy.isfinite(found)
        self.assertGreater(valid.mean(), 0.5)
        self.assertGreater((abs(found - truth)[valid] < 1).mean(), 0.95)


if __name__ == "__main__":
    print(f"seed {pairs.SEED}")
    unittest.main()

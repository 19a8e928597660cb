# SPDX-License-Identifier: Apache-2.0
"""vergence reconstruct --debug: the pictures exist, are right, and change no result."""
import json
import os
import re
import shutil
import struct
import subprocess
import unittest

import cv2
import numpy

import pairs
from pairs import BOARD, HEIGHT, RECTIFIED, VERGENCE, WIDTH
from results import result_names

COMMON = {"01_left.png", "02_right.png", "17_margin.png", "19_reasons.png", "20_disparity.png",
          "debug.html"}
SLICES = {"07_row_cost.png", "08_row_cost_along.png", "09_row_cost_around.png",
          "10_row_from_above.png", "11_row_from_left.png", "12_row_from_right.png",
          "13_row_total.png"}
INNER = SLICES | {"03_census.png", "04_gradient.png", "14_winner.png", "15_consistent.png",
                  "16_cost.png", "18_reasons_first.png"}
WINDOWS = {"06_window_low.png", "06_window_count.png"}
NOTHING, MARK = 255, 254
DISPARITIES = 48
SEARCHED = 96  # with what lies beyond the nearest of these


def read_indices(path):
    """The palette indices of a PNG, by finding each colour in its palette; of equal colours the
    last one. Shape (height, width)."""
    data = path.read_bytes()
    at = data.index(b"PLTE")
    size = struct.unpack(">I", data[at - 4:at])[0]
    palette = numpy.frombuffer(data[at + 4:at + 4 + size], numpy.uint8).reshape(-1, 3)
    image = cv2.imread(str(path), cv2.IMREAD_COLOR).astype(numpy.uint32)
    codes = image[..., 2] << 16 | image[..., 1] << 8 | image[..., 0]
    table = {int(r) << 16 | int(g) << 8 | int(b): i for i, (r, g, b) in enumerate(palette)}
    indices = numpy.array([table[int(code)] for code in codes.ravel()])
    return indices.reshape(codes.shape), palette


class Debug(pairs.Fixture):
    def setUp(self):
        super().setUp()
        self.pictures = self.directory / "pictures"

    def run_both(self, *arguments):
        """Results without --debug and with it; all files without times must be equal."""
        self.reconstruct(*arguments)
        without = {n: (self.out / n).read_bytes() for n in result_names(self.out)}
        self.reconstruct(*arguments, "--debug", self.pictures)
        self.assertEqual(set(without), set(result_names(self.out)))
        for name, content in without.items():
            if name not in ("result.json", "report.html", "surface.compact"):
                self.assertEqual(content, (self.out / name).read_bytes(), name)
        results = [json.loads(content) for content in
                   (without["result.json"], (self.out / "result.json").read_bytes())]
        for result in results:
            del result["time_ms"], result["memory_bytes"]["process_peak"]
        self.assertEqual(*results)

    def colours(self, name):
        image = cv2.imread(str(self.pictures / name), cv2.IMREAD_COLOR)
        self.assertIsNotNone(image, name)
        return image

    def check_result_pictures(self):
        """The pictures of the result against its files."""
        for side in ("left", "right"):
            ours = self.colours(f"0{1 if side == 'left' else 2}_{side}.png")[..., 0].astype(int)
            theirs = pairs.grey(cv2.imread(str(self.out / f"{side}_rectified.png"))).astype(int)
            self.assertEqual(ours.shape, theirs.shape)
            self.assertGreater((abs(ours - theirs) < 12).mean(), 0.9)  # another mix of the colours
        shown = self.colours("19_reasons.png")
        self.assertTrue((shown == cv2.imread(str(self.out / "reasons.png"))).all())
        indices, palette = read_indices(self.pictures / "20_disparity.png")
        found = self.disparity()
        self.assertEqual(indices.shape, found.shape)
        valid = numpy.isfinite(found)
        expected = numpy.full(found.shape, NOTHING)
        expected[valid] = numpy.floor(254 * numpy.clip(found[valid] / (DISPARITIES - 1), 0, 1) + 0.5)
        # Neighbours on the scale may have the same colour.
        self.assertTrue((palette[indices] == palette[expected]).all())

    def check_inner_pictures(self, row, level_height):
        """The winners against the totals of the row, and the sizes."""
        for name in INNER - SLICES:
            self.assertEqual(self.colours(name).shape, (level_height, WIDTH, 3), name)
        height = self.colours("13_row_total.png").shape[0]
        self.assertEqual(height % SEARCHED, 0)
        times = height // SEARCHED
        for name in SLICES:
            self.assertEqual(self.colours(name).shape, (height, WIDTH, 3), name)
        total, palette = read_indices(self.pictures / "13_row_total.png")
        total = total[::-times]  # disparity 0 first
        won = total == MARK
        self.assertLessEqual(won.sum(axis=0).max(), 1)
        at = won.argmax(axis=0)
        winner, scale = read_indices(self.pictures / "14_winner.png")
        winner = winner[row * level_height // HEIGHT]
        has = won.any(axis=0)
        self.assertTrue((has == (winner != NOTHING)).all())
        expected = numpy.floor(254 * at / (SEARCHED - 1) + 0.5).astype(int)
        self.assertTrue((scale[winner[has]] == scale[expected[has]]).all())
        # Nothing else that was searched is cheaper than a winner, except at the left end, where
        # some searched disparities cannot win.
        inside = has.copy()
        inside[:DISPARITIES] = False
        others = numpy.where((total == MARK) | (total == NOTHING), NOTHING, total)
        beside = numpy.minimum(others[numpy.clip(at - 1, 0, SEARCHED - 1), range(WIDTH)],
                               others[numpy.clip(at + 1, 0, SEARCHED - 1), range(WIDTH)])
        lowest = others.min(axis=0)
        self.assertGreater((beside == lowest)[inside].mean(), 0.9)
        first, _ = read_indices(self.pictures / "18_reasons_first.png")
        self.assertTrue(((first == 1) == (read_indices(self.pictures / "15_consistent.png")[0]
                                          == NOTHING)).all())

    def check_page(self, names):
        page = (self.pictures / "debug.html").read_text()
        self.assertEqual(set(re.findall(r'src="([^"]+)"', page)), names - {"debug.html"})
        self.assertEqual(page.count("<figcaption>"), len(names) - 1)
        self.assertEqual(page.count("Look for: "), len(names) - 1)
        self.assertNotRegex(page, "https?:")

    def check(self, preset, inner, level_height=HEIGHT, *arguments):
        self.run_both(*(arguments or RECTIFIED), "--preset", preset)
        names = set(result_names(self.pictures))
        surfaces = {n for n in names if "surface" in n}
        self.assertEqual(names - surfaces, COMMON | inner)
        self.assertEqual(bool(surfaces), WINDOWS <= inner)
        self.check_result_pictures()
        if inner:
            self.check_inner_pictures(HEIGHT // 2, level_height)
        for name in surfaces:
            height, width = self.colours(name).shape[:2]
            self.assertIn(WIDTH // width, (2, 4, 8, 16))
            self.assertLessEqual(height, HEIGHT // 2)
        self.check_page(names)

    def test_standard_searches_near_a_surface(self):
        self.check("standard", INNER | WINDOWS)
        count, _ = read_indices(self.pictures / "06_window_count.png")
        self.assertGreater(len(numpy.unique(count)), 1)
        surface, _ = read_indices(self.pictures / "05_surface_1.png")
        truth = self.truth[1::2, 2::4]
        shown = (surface % 127) * (DISPARITIES - 1) / 126
        sure = surface < 127
        self.assertGreater(sure.mean(), 0.5)
        self.assertGreater((abs(shown - truth) < 4)[sure].mean(), 0.9)

    def test_paper_has_neither_costs_nor_messages(self):
        self.check("paper", set())

    def test_with_a_calibration(self):
        rig = self.calibration_text()
        for preset in ("standard", "best"):
            self.check(preset, INNER | WINDOWS, HEIGHT, "--calibration", rig, "--disparity", "0:48")

    def test_another_row(self):
        pages = []
        for row in (0, 100, HEIGHT - 1):
            self.reconstruct(*RECTIFIED, "--debug", self.pictures, "--debug-row", row)
            self.check_inner_pictures(row, HEIGHT)
            self.assertIn(f"row {row},", (self.pictures / "debug.html").read_text())
            pages.append(self.colours("07_row_cost.png"))
        self.assertTrue((pages[0] != pages[1]).any())
        done = pairs.run("reconstruct", self.left_path, self.right_path, *RECTIFIED, "--out",
                         self.directory / "other", "--debug", self.directory / "none",
                         "--debug-row", HEIGHT)
        self.assertEqual(done.returncode, 3)
        self.assertEqual(done.stderr.count("\n"), 1)
        self.assertIn(f"0 to {HEIGHT - 1}", done.stderr)
        self.assertFalse((self.directory / "none").exists())

    def test_into_the_directory_of_results(self):
        for _ in range(2):
            self.reconstruct(*RECTIFIED, "--debug", self.out)
            self.assertLess(COMMON | INNER | {"result.json"}, set(result_names(self.out)))
        # Pictures of an earlier run that this one does not draw are removed.
        self.reconstruct(*RECTIFIED, "--debug", self.out, "--preset", "paper")
        self.assertFalse((INNER | WINDOWS) & set(result_names(self.out)))
        self.reconstruct(*RECTIFIED, "--debug", self.out / "below")
        self.assertIn("debug.html", os.listdir(self.out / "below"))

    def test_without_a_surface_the_pictures_are_there(self):
        other, _, _ = pairs.make_pair(seed=pairs.SEED + 1)
        done = pairs.run("reconstruct", self.left_path, self.save("other.png", other), *RECTIFIED,
                         "--out", self.out, "--debug", self.pictures)
        self.assertEqual(done.returncode, 4, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1)
        self.assertFalse(self.out.exists())
        self.assertLess(COMMON | INNER, set(result_names(self.pictures)))


class Refused(pairs.Fixture):
    def attempt(self, *arguments, **options):
        return pairs.run("reconstruct", self.left_path, self.right_path, *RECTIFIED, "--out",
                         self.out, *arguments, **options)

    def test_wrong_usage(self):
        self.assert_refused(self.attempt("--debug-row", 3), 2, "--debug")
        self.assert_refused(self.attempt("--debug", self.directory / "p", "--debug-row", -1), 2,
                            "--debug-row")
        self.assert_refused(self.attempt("--debug", self.directory / "p", program=BOARD), 2,
                            "--debug")

    def test_an_input_is_not_replaced(self):
        inputs = self.directory / "inputs"
        inputs.mkdir()
        left = inputs / "01_left.png"
        left.write_bytes(self.left_path.read_bytes())
        before = left.read_bytes()
        done = pairs.run("reconstruct", left, self.right_path, *RECTIFIED, "--out", self.out,
                         "--debug", inputs)
        self.assert_refused(done, 3, "01_left.png", "--debug")
        self.assertEqual(left.read_bytes(), before)

    def traced(self, log, *injected):
        """The run under strace, which may make a call find the disk full."""
        trace = ["strace", "-f", "-qq", "-y", "-o", log, "-e", "trace=write,rename,fsync"]
        for call, when in injected:
            trace += ["-e", f"inject={call}:error=ENOSPC:when={when}"]
        return subprocess.run([*map(str, trace), VERGENCE, "reconstruct", self.left_path,
                               self.right_path, *map(str, RECTIFIED), "--out", self.out, "--debug",
                               self.directory / "pictures"],
                              capture_output=True, text=True, timeout=120,
                              # Not under the sanitizers: their leak check is a tracer itself.
                              env={**os.environ, "ASAN_OPTIONS":
                                   os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0"})

    def test_a_full_disk_leaves_neither_results_nor_pictures(self):
        log = self.directory / "log"
        self.assertEqual(self.traced(log).returncode, 0)
        calls = [line.split(" ", 1)[1].strip() for line in log.read_text().splitlines()]
        writes = [c for c in calls if c.startswith("write(")]
        attempts = [("fsync", 1), ("fsync", 10), ("rename", 1)]
        for name in ("01_left.png", "13_row_total.png", "debug.html"):
            attempts.append(("write", 1 + next(i for i, c in enumerate(writes) if name in c)))
        for path in (self.out, self.directory / "pictures"):
            shutil.rmtree(path)
        for attempt in attempts:
            with self.subTest(attempt=attempt):
                done = self.traced("/dev/null", attempt)
                self.assert_refused(done, 1, "writing", "No space left",
                                    str(self.directory / "pictures"))
                self.assertFalse((self.directory / "pictures").exists())


if __name__ == "__main__":
    print(f"seed {pairs.SEED}")
    unittest.main()

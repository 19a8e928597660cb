# SPDX-License-Identifier: Apache-2.0
"""`vergence evaluate` against a second implementation of the same rules in numpy."""
import json
import os
import subprocess
import tempfile
import unittest

import cv2
import numpy as np

from pairs import SEED

VERGENCE = os.environ["VERGENCE"]


def write_pfm(path, values):
    with open(path, "wb") as file:
        file.write(b"Pf\n%d %d\n-1.0\n" % (values.shape[1], values.shape[0]))
        file.write(values[::-1].astype("<f4").tobytes())


def filled(disparity):
    """The filling rule by two running copies of each row: from the left and from the right."""
    result = disparity.copy()
    for row in result:
        from_left, from_right = row.copy(), row.copy()
        for x in range(1, len(row)):
            if not np.isfinite(from_left[x]):
                from_left[x] = from_left[x - 1]
        for x in range(len(row) - 2, -1, -1):
            if not np.isfinite(from_right[x]):
                from_right[x] = from_right[x + 1]
        smaller = np.minimum(from_left, from_right)  # inf if one side has no value: the other wins
        row[:] = np.where(np.isfinite(smaller), smaller, 0)
    return result


def scores(disparity, truth, pixels):
    error = np.abs(disparity[pixels].astype(float) - truth[pixels].astype(float))
    return {"pixels": int(pixels.sum()), "bad_0_5_percent": 100 * (error > 0.5).mean(),
            "bad_1_percent": 100 * (error > 1).mean(), "bad_2_percent": 100 * (error > 2).mean(),
            "bad_4_percent": 100 * (error > 4).mean(), "average_px": error.mean(),
            "rms_px": np.sqrt((error ** 2).mean())}


class Evaluate(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="vergence-evaluate-")
        self.addCleanup(self.folder.cleanup)
        random = np.random.default_rng(SEED)
        self.truth = random.uniform(1, 60, (40, 70)).astype(np.float32)
        self.disparity = (self.truth + random.normal(0, 1.5, self.truth.shape)).astype(np.float32)
        self.disparity[random.random(self.truth.shape) < 0.3] = np.inf
        self.disparity[7] = np.inf
        self.truth[random.random(self.truth.shape) < 0.2] = np.inf
        self.mask = random.choice(np.array([0, 128, 255], np.uint8), self.truth.shape, p=[.1, .3, .6])
        write_pfm(self.path("disparity.pfm"), self.disparity)
        write_pfm(self.path("truth.pfm"), self.truth)
        cv2.imwrite(self.path("mask.png"), self.mask)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run_evaluate(self, *arguments):
        return subprocess.run([VERGENCE, "evaluate", *arguments], capture_output=True, text=True,
                              timeout=60)

    def evaluate(self, *arguments):
        run = self.run_evaluate(self.folder.name, "--json", *arguments)
        self.assertEqual((run.returncode, run.stderr), (0, ""))
        return json.loads(run.stdout)

    def assert_scores(self, found, wanted):
        for name, value in wanted.items():
            self.assertAlmostEqual(found[name], value, delta=2e-5 * max(1, abs(value)), msg=name)

    def test_all_figures(self):
        print(f"seed {SEED}")
        result = self.evaluate("--ground-truth", self.path("truth.pfm"), "--mask",
                               self.path("mask.png"))
        known = np.isfinite(self.truth) & (self.mask != 0)
        visible, kept = known & (self.mask == 255), np.isfinite(self.disparity)
        full = filled(self.disparity)
        self.assert_scores(result["filled_all"], scores(full, self.truth, known))
        self.assert_scores(result["filled_visible"], scores(full, self.truth, visible))
        self.assert_scores(result["measured_all"], scores(full, self.truth, known & kept))
        self.assert_scores(result["measured_visible"], scores(full, self.truth, visible & kept))
        self.assertAlmostEqual(result["measured_all"]["density_percent"],
                               100 * (known & kept).sum() / known.sum(), places=3)

    def test_rounded(self):
        result = self.evaluate("--ground-truth", self.path("truth.pfm"), "--round")
        rounded = np.floor(filled(self.disparity) + np.float32(0.5))
        self.assert_scores(result["filled_all"],
                           scores(rounded, self.truth, np.isfinite(self.truth)))
        self.assertNotIn("filled_visible", result)

    def test_png_truths(self):
        known = np.isfinite(self.truth)
        kitti = np.where(known, np.round(self.truth * 256), 0).astype(np.uint16)
        cv2.imwrite(self.path("kitti.png"), kitti)
        result = self.evaluate("--ground-truth", self.path("kitti.png"))
        self.assert_scores(result["filled_all"],
                           scores(filled(self.disparity), kitti / 256.0, known))
        scaled = np.where(known, np.round(self.truth * 4), 0).astype(np.uint8)
        cv2.imwrite(self.path("scaled.png"), scaled)
        result = self.evaluate("--ground-truth", self.path("scaled.png"), "--ground-truth-scale",
                               "4")
        self.assert_scores(result["filled_all"], scores(filled(self.disparity), scaled / 4.0, known))

    def test_table(self):
        run = self.run_evaluate(self.path("disparity.pfm"), "--ground-truth",
                                self.path("truth.pfm"), "--mask", self.path("mask.png"))
        self.assertEqual(run.returncode, 0)
        for word in ("bad-0.5", "bad-4", "density", "filled, not occluded"):
            self.assertIn(word, run.stdout)
        self.assertTrue(all(len(line) <= 120 for line in run.stdout.splitlines()))

    def test_bad_input(self):
        cv2.imwrite(self.path("grey8.png"), np.full(self.truth.shape, 9, np.uint8))
        cv2.imwrite(self.path("colour.png"), np.full((*self.truth.shape, 3), 9, np.uint8))
        cv2.imwrite(self.path("small.png"), np.full((3, 3), 9, np.uint16))
        cv2.imwrite(self.path("nothing.png"), np.zeros(self.truth.shape, np.uint16))
        with open(self.path("text.pfm"), "w", encoding="ascii") as file:
            file.write("no float map\n")
        truth = ("--ground-truth", self.path("truth.pfm"))
        table = [
            ((self.folder.name,), 2, "--ground-truth"),
            ((self.folder.name, "--ground-truth", self.path("absent.pfm")), 3, "absent.pfm"),
            ((self.folder.name, "--ground-truth", self.path("text.pfm")), 3, "Pf"),
            ((self.folder.name, "--ground-truth", self.path("grey8.png")), 3, "ground-truth-scale"),
            ((self.folder.name, "--ground-truth", self.path("colour.png")), 3, "colour"),
            ((self.folder.name, "--ground-truth", self.path("small.png")), 3, "3x3"),
            ((self.folder.name, "--ground-truth", self.path("nothing.png")), 3, "known"),
            ((self.path("nowhere"), *truth), 3, "nowhere"),
            ((self.folder.name, *truth, "--mask", self.path("small.png")), 3, "mask"),
            ((self.folder.name, *truth, "--mask", self.path("grey8.png")), 3, "255"),
        ]
        for arguments, code, word in table:
            with self.subTest(arguments=arguments):
                run = self.run_evaluate(*arguments)
                self.assertEqual(run.returncode, code, run.stderr)
                self.assertEqual(run.stdout, "")
                self.assertEqual(run.stderr.count("\n"), 1, run.stderr)
                self.assertIn(word, run.stderr)


if __name__ == "__main__":
    unittest.main()

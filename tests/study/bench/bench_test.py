# SPDX-License-Identifier: Apache-2.0
"""Each benchmark once on small inputs: a plane of random dots, and opencv-doc's chessboards."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import cv2
import numpy

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
SAMPLES = os.environ["VERGENCE_OPENCV_SAMPLES"]
WIDTH, HEIGHT, DISPARITY = 96, 64, 7


class Bench(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = pathlib.Path(holder.name)
        pair = self.folder / "pair"
        pair.mkdir()
        wide = numpy.random.default_rng(5).integers(0, 256, (HEIGHT, WIDTH + DISPARITY), "uint8")
        cv2.imwrite(str(pair / "left.png"), wide[:, :WIDTH])
        cv2.imwrite(str(pair / "right.png"), wide[:, DISPARITY:])
        (pair / "meta.json").write_text('{"disparity_search": [0, 16]}')
        truth = numpy.full((HEIGHT, WIDTH), DISPARITY, "<f4").tobytes()
        (pair / "disparity.pfm").write_bytes(f"Pf\n{WIDTH} {HEIGHT}\n-1\n".encode() + truth)
        self.pair = str(pair)

    def output_of(self, *words):
        done = subprocess.run(words, capture_output=True, text=True, timeout=900)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_stereo(self):
        text = self.output_of(os.environ["STEREO_BENCH"], "--quick", self.pair)
        rows = {line[:32].strip(): line[32:].split() for line in
                text.split("mean of 1 pairs")[1].split("bad-t:")[0].splitlines()[2:]}
        for method in ("fast", "standard", "best", "board", "paper", "SGBM HH4", "SGBM"):
            self.assertLess(float(rows[method][0]), 5, method)

    def test_rendered_scene(self):
        scenes, sheet = self.folder / "scenes", self.folder / "sheet.jpg"
        maps = self.folder / "maps"
        prepare = (sys.executable, "-B", ROOT / "tools/bench.d/prepare_scenes.py", scenes, "--part",
                   "check", "--only", "cylinder_10x", "--skip", "8", "--render",
                   os.environ["SIMRIG_RENDER"], "--vergence", os.environ["VERGENCE"])
        self.output_of(*prepare)
        written = scenes / "check/cylinder_10x/left.png"
        before = written.stat().st_mtime_ns
        self.output_of(*prepare)  # nothing is rendered again
        self.assertEqual(written.stat().st_mtime_ns, before)
        text = self.output_of(os.environ["STEREO_BENCH"], "--errors-only", "--only", "best,HH4",
                              "--sheet", sheet, "--maps", maps, self.pair, scenes / "check")
        self.assertIn("check/cylinder_10x", text)
        table = text.split("mean of 1 rendered view")[1].split("\n  cylinder ")[1].splitlines()
        right = {line[:32].strip(): float(line[32:].split()[0].rstrip("%")) for line in table[1:5]}
        self.assertGreater(right["best"], 50)
        self.assertGreater(right["SGBM HH4"], 50)
        self.assertIn("noise", text)
        figures = {line[:56].strip(): line[56:].split() for line in
                   text.split("\nfigures ")[1].splitlines()}
        self.assertGreater(float(figures["z, smallest of a view"][1]), 0.3)
        self.assertIn(figures["views with less right than HH4"][0], "01")
        self.assertGreater(float(figures["density, percent"][2]), 95)
        left, *_ = cv2.imread(str(sheet)).shape
        self.assertGreater(left, 100)
        array = {path.stem: numpy.load(path) for path in (maps / "check/cylinder_10x").iterdir()}
        grey = cv2.cvtColor(cv2.imread(str(written)), cv2.COLOR_BGR2GRAY)
        self.assertTrue((array["left"] == grey).all())
        kept = array["best+refine.reason"] == 0
        self.assertTrue((kept == numpy.isfinite(array["best+refine"])).all())
        self.assertTrue((kept == (array["best+refine.sigma"] > 0)).all())
        for name in ("truth", "mask", "region", "best.guess", "best.confidence", "SGBM_HH4"):
            self.assertEqual(array[name].shape, kept.shape, name)

    def test_disturbance(self):
        text = self.output_of(os.environ["DISTURBANCE_BENCH"], "--quick", "--only", "standard",
                              self.pair)
        for wanted in ("growth", "right image exposed 0.6 times as long", "unrelated"):
            self.assertIn(wanted, text)

    def test_scaling_and_its_plot(self):
        result, plot = self.folder / "scaling.json", self.folder / "scaling.svg"
        result.write_text(self.output_of(os.environ["SCALING_BENCH"], "--quick", self.pair))
        table = self.output_of(sys.executable, "-B", ROOT / "tools/bench.d/plot_scaling.py", result,
                               plot)
        self.assertIn("pair along width (px): 48 to 96", table)
        self.assertIn("<svg", plot.read_text())

    def test_focus(self):
        text = self.output_of(os.environ["SHARPNESS_BENCH"])  # compares with OpenCV's energies
        self.assertRegex(text, r"Tenengrad +0\.\d+ ")

    def test_calibration(self):
        result = json.loads(self.output_of(
            sys.executable, "-B", ROOT / "tests/study/bench/calibration_bench.py", SAMPLES, "--board",
            "9x6", "--square", "30", "--vergence", os.environ["VERGENCE"], "--samples", SAMPLES,
            "--cache", self.folder / "cache", "--quick", "--json", "--only", "window 5"))
        for line in result["methods"].values():
            self.assertLess(abs(line["baseline_mm"] - 99.8), 2)

    def test_wrong_usage(self):
        for words in ((), ("nonsense",), ("--nonsense",), ("stereo", "--rounds")):
            done = subprocess.run([ROOT / "tools/bench", *words], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1))


if __name__ == "__main__":
    unittest.main()

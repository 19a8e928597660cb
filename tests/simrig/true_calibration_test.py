# SPDX-License-Identifier: Apache-2.0
"""The rig's true cameras as a calibration: the same pixels as the rig's own equations, and the same
world for both cameras; and the figures of tools/simrig/compare for right and wrong results."""
import importlib.machinery
import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import zlib

import cv2
import numpy

VERGENCE = os.environ["VERGENCE"]
SOURCE = pathlib.Path(os.environ["VERGENCE_SOURCE"])
RENDER = pathlib.Path(os.environ["SIMRIG"]).parent / "simrig-render"
SIMRIG = SOURCE / "tools" / "simrig"
SEED = int(os.environ.get("VERGENCE_SEED", "20261122"))
TIMEOUT_S = 300

sys.dont_write_bytecode = True
_loader = importlib.machinery.SourceFileLoader("compare", str(SIMRIG / "compare"))
compare = importlib.util.module_from_spec(importlib.util.spec_from_loader("compare", _loader))
_loader.exec_module(compare)


def render(folder, scene="cylinder", *options):
    for side in ("left", "right"):
        subprocess.run([RENDER, SIMRIG / "scenes" / f"{scene}.yaml", SIMRIG / "rigs/default.yaml",
                        "--out", folder / side, "--camera", side, "--exposure", "9000",
                        *map(str, options)], check=True, timeout=TIMEOUT_S)


def run(*words):
    return subprocess.run([*map(str, words)], capture_output=True, text=True, timeout=TIMEOUT_S)


def canonical(text):
    """Our own text as matrices of OpenCV."""
    words = {line.split(" ", 1)[0]: line.split(" ")[1:] for line in text.splitlines()}

    def numbers(key):
        return [float(word) for word in words[key]]
    cameras = {}
    for side in ("left", "right"):
        (fx, fy), (cx, cy) = numbers(f"{side}_focal_px"), numbers(f"{side}_centre_px")
        matrix = numpy.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        distortion = numpy.array([*numbers(f"{side}_k1"), *numbers(f"{side}_k2"),
                                  *numbers(f"{side}_tangential"), *numbers(f"{side}_k3")])
        cameras[side] = matrix, distortion
    return (cameras, numpy.array(numbers("rotation_right_left_rad")),
            numpy.array(numbers("translation_right_left_mm")))


class TrueCalibration(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-truth-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def convert(self, *options):
        target = self.folder / "true.calibration"
        done = run(VERGENCE, "info", self.folder, "--convert", target, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return canonical(target.read_text())

    def test_pixels_are_those_of_the_rigs_own_equations(self):
        """At each zoom, window and pan, over the whole frame: OpenCV's projection by our text."""
        random = numpy.random.default_rng(SEED)
        print("seed", SEED)
        worst = 0
        for zoom, window, skip in ((300, "0,0,2048,1536", 16), (422, "400,300,640,480", 8),
                                   (850, "0,0,2048,1536", 16), (611, "1984,1488,64,48", 1)):
            render(self.folder, "plane", "--zoom", zoom, "--window", window, "--skip", skip)
            cameras, rotation, translation_mm = self.convert()
            left, right = (compare.Camera(self.folder, side) for side in ("left", "right"))
            height, width = left.depth_mm.shape
            # Points in front of the left camera that it sees, near and far.
            depth_mm = random.uniform(900, 4000, 4000)
            inside = random.uniform(-0.5, [width - 0.5, height - 0.5], (4000, 2))
            matrix, distortion = cameras["left"]
            slopes = cv2.undistortPointsIter(
                inside[:, None], matrix, distortion, None, None,
                (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-13))[:, 0]
            points_mm = numpy.column_stack([slopes, numpy.ones(4000)]) * depth_mm[:, None]
            for side, camera in (("left", left), ("right", right)):
                pose = (numpy.zeros(3), numpy.zeros(3)) if side == "left" else (rotation,
                                                                                translation_mm)
                ours = cv2.projectPoints(points_mm, *pose, *cameras[side])[0][:, 0]
                own = points_mm if side == "left" else camera.from_world(left.to_world(points_mm))
                # Beyond the other camera's view the polynomial is meaningless.
                theirs = camera.pixels(own)
                seen = ((theirs > -200) & (theirs < [width + 200, height + 200])).all(-1)
                off = numpy.abs(ours - theirs)[seen]
                self.assertGreater(seen.sum(), 100)
                worst = max(worst, off.max())
        print(f"at most {worst:.2e} px apart")
        self.assertLess(worst, 1e-4)

    def test_both_cameras_see_one_world(self):
        """What the left camera's truth puts into the right image, the right one's truth has too."""
        render(self.folder, "cylinder", "--zoom", 350, "--window", "840,600,400,400")
        cameras, rotation, translation_mm = self.convert()
        left, right = (compare.Camera(self.folder, side) for side in ("left", "right"))
        rows, columns = (v.ravel() for v in numpy.mgrid[0:400:4, 0:400:4])
        z = left.depth_mm[rows, columns].astype(float)
        matrix, distortion = cameras["left"]
        slopes = cv2.undistortPointsIter(
            numpy.column_stack([columns, rows]).astype(float)[:, None], matrix, distortion, None,
            None, (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-13))[:, 0]
        points_mm = numpy.column_stack([slopes, numpy.ones(len(z))]) * z[:, None]
        in_right_mm = points_mm @ cv2.Rodrigues(rotation)[0].T + translation_mm
        pixels = cv2.projectPoints(points_mm, rotation, translation_mm, *cameras["right"])[0][:, 0]
        inverse, minimum, greatest = right.inverse_depths(pixels)
        smooth = numpy.isfinite(inverse) & ((greatest - minimum) * z * z < 1)
        off_mm = numpy.abs(1 / inverse[smooth] - in_right_mm[smooth, 2])
        # What is hidden from the right camera differs; all else to float's precision.
        self.assertGreater(smooth.sum(), 3000)
        self.assertGreater((off_mm < 0.01).mean(), 0.8)

    def test_what_is_refused(self):
        render(self.folder, "plane", "--window", "0,0,64,48")
        good = (self.folder / "left.yaml").read_text()
        for change, word in ((("mirrored: [0, 0]", "mirrored: [1, 0]"), "mirrored"),
                             (("radial", "radiul"), "radial is missing"),
                             (("size_px: [64", "size_px: [64.5"), "size_px"),
                             (("pupil_mm: [", "pupil_mm: [x"), "pupil_mm"),
                             (("rotation_world_camera: [0", "rotation_world_camera: [7"),
                              "not a rotation")):
            text = good.replace(*change)
            self.assertNotEqual(text, good, change)
            (self.folder / "left.yaml").write_text(text)
            done = run(VERGENCE, "info", self.folder)
            self.assertEqual((done.returncode, done.stdout), (3, ""))
            self.assertEqual(done.stderr.count("\n"), 1)
            self.assertIn(word, done.stderr)
        (self.folder / "left.yaml").write_text(good)
        (self.folder / "right.yaml").unlink()
        done = run(VERGENCE, "info", self.folder / "left.yaml")
        self.assertIn("one camera of a pair", done.stderr)


class Compare(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="vergence-compare-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        render(cls.folder, "cylinder", "--window", "640,500,800,500")
        cls.result = cls.folder / "out"
        done = run(VERGENCE, "reconstruct", cls.folder / "left.pgm", cls.folder / "right.pgm",
                   "--bayer", "grbg", "--calibration", cls.folder, "--near", "1600", "--far", "2400", "--out",
                   cls.result, "--quiet")
        assert done.returncode == 0, done.stderr

    def reported(self, *options):
        done = run(SIMRIG / "compare", self.result, self.folder, "--json", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_a_measured_surface(self):
        whole = self.reported("--object", "cylinder")
        reported, visible = whole["textured"], whole["visible"]
        print(whole)
        self.assertAlmostEqual(visible["measured_percent"] + sum(whole["holes"].values()), 100, delta=1e-6)
        self.assertLess(visible["pixels"], whole["seen"]["pixels"])
        self.assertLess(visible["fit"]["wrong_3px_percent"], 1)
        self.assertAlmostEqual(whole["similarity"]["scale"], 1, delta=0.003)
        self.assertLess(abs(whole["sigma"]["ratio_rms"] - 1.5), 1)
        self.assertEqual(self.reported("--object", "cylinder", "--sharp", "100:200")["visible"]["pixels"], 0)
        self.assertGreater(reported["pixels"], 20000)
        self.assertGreater(reported["measured_percent"], 90)
        self.assertLess(reported["median_error_px"], 0.25)
        self.assertLess(reported["wrong_percent"], 3)

    def test_the_truth_itself_and_known_errors(self):
        before = (self.result / "disparity.pfm").read_bytes()
        self.addCleanup((self.result / "disparity.pfm").write_bytes, before)
        self.reported("--out", self.folder / "truth")
        truth = cv2.imread(str(self.folder / "truth/truth.pfm"), cv2.IMREAD_UNCHANGED)
        for shift, wrong in ((0, 0), (0.3, 0), (-1.5, 100)):
            cv2.imwrite(str(self.result / "disparity.pfm"), truth + numpy.float32(shift))
            seen = self.reported()["seen"]
            self.assertEqual(seen["measured_percent"], 100)
            self.assertAlmostEqual(seen["median_error_px"], abs(shift), delta=1e-3)
            self.assertAlmostEqual(seen["bias_px"], shift, delta=1e-3)
            self.assertEqual(seen["wrong_percent"], wrong)
            self.assertAlmostEqual(seen["bias_mm"], -shift * seen["mm_per_px"], delta=0.1 * abs(shift) + 1e-2)
            self.assertLess(seen["fit"]["median_error_px"], 0.3 * abs(shift) + 1e-3)
        holes = truth.copy()
        holes[:, ::2] = numpy.inf
        cv2.imwrite(str(self.result / "disparity.pfm"), holes)
        self.assertAlmostEqual(self.reported()["seen"]["measured_percent"], 50, delta=2)

    def test_a_baseline_that_is_off_shows_in_the_depth(self):
        wrong = self.folder / "wrong.calibration"
        run(VERGENCE, "info", self.folder, "--convert", wrong)
        body = wrong.read_text().split("crc32")[0]
        key = "translation_right_left_mm "
        values = body.split(key)[1].splitlines()[0].split()
        body = body.replace(key + " ".join(values), key + " ".join(
            f"{1.02 * float(value):.9f}" for value in values))
        wrong.write_text(f"{body}crc32 {zlib.crc32(body.encode()):08x}\n")
        out = self.folder / "longer"
        done = run(VERGENCE, "reconstruct", self.folder / "left.pgm", self.folder / "right.pgm",
                   "--bayer", "grbg", "--calibration", wrong, "--near", "1600", "--far", "2400",
                   "--out", out, "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run(SIMRIG / "compare", out, self.folder, "--json", "--object", "cylinder")
        whole = json.loads(done.stdout)
        reported = whole["textured"]
        print(whole)
        # A similarity takes it away, and reports it.
        self.assertAlmostEqual(whole["similarity"]["scale"], 1 / 1.02, delta=0.003)
        self.assertLess(reported["fit"]["median_error_px"], 0.25)
        self.assertGreater(reported["median_error_mm"], 0.015 * 1800)
        self.assertLess(reported["median_error_mm"], 0.025 * 1800)

    def test_what_is_refused(self):
        for words, code, word in ((["x"], 2, "--help"), ([self.folder, self.folder], 3, "result"),
                                  ([self.result, self.result], 3, "left.yaml"),
                                  ([self.result, self.folder, "--object", "cat"], 3, "cylinder"),
                                  ([self.result, self.folder, "--sharp", "2:1"], 2, "NEAR:FAR"),
                                  ([self.result, self.folder, "--sharp", "x"], 2, "NEAR:FAR")):
            done = run(SIMRIG / "compare", *words)
            self.assertEqual((done.returncode, done.stdout), (code, ""), words)
            self.assertIn(word, done.stderr)


if __name__ == "__main__":
    unittest.main()

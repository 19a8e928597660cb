# SPDX-License-Identifier: Apache-2.0
"""The Python package: the same bytes as the command line, arrays in and out, exceptions, and the tour of
library/README.md."""
import json
import os
import re
import signal
import subprocess
import sys
import threading
import unittest

import cv2
import numpy

import package
from pairs import BASELINE_MM, FOCAL_PX, Fixture, RECTIFIED, grey
from pairs import run as run_vergence

v = package.load()
ARRAYS = {"rectified": True, "focal_px": FOCAL_PX, "baseline_mm": BASELINE_MM, "disparity": (0, 48)}


class Bytes(Fixture):
    def commanded(self, *words):
        out = self.directory / "commanded"
        done = run_vergence("reconstruct", *words, "--out", out, "--quiet")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return out

    def check_same(self, out, names):
        for name in names:
            self.assertEqual((out / name).read_bytes(), (self.directory / "commanded" / name).read_bytes(), name)

    def test_arrays_give_the_files_of_the_command(self):
        self.commanded(self.left_path, self.right_path, *RECTIFIED)
        v.reconstruct(self.left, self.right, order="bgr", **ARRAYS).write(self.out)
        self.check_same(self.out, ("disparity.pfm", "mesh.ply", "points.pcd", "depth.png", "mesh.glb"))

    def test_files_and_a_calibration_too(self):
        rig = self.calibration_text()
        self.commanded(self.left_path, self.right_path, "--calibration", rig, "--triangles", 2000)
        names = ("disparity.pfm", "mesh.ply")
        for number, calibration in enumerate((rig, v.load_calibration(rig))):
            out = self.directory / str(number)
            v.reconstruct(self.left_path, self.right_path, calibration).write(out, files=names, triangles=2000)
            self.check_same(out, names)

    def test_deep_grey_and_turned_arrays(self):
        deep = [grey(image).astype(numpy.uint16) << 4 for image in (self.left, self.right)]
        for name, image in zip(("left.png", "right.png"), deep):
            self.save(name, image)
        self.commanded(self.left_path, self.right_path, *RECTIFIED, "--bits", 12)
        # Neither a step nor a direction of the memory matters, and a read-only array may be read.
        wide = numpy.zeros((*deep[0].shape, 2), numpy.uint16)
        wide[:, :, 1] = deep[0]
        upside = deep[1][::-1].copy()[::-1]
        upside.flags.writeable = False
        s = v.reconstruct(wide[:, :, 1], upside, bits=12, **ARRAYS)
        s.write(self.out)
        self.check_same(self.out, ("disparity.pfm", "mesh.ply"))
        self.assertEqual(s.left.shape, (*s.shape, 3))


class Arrays(Fixture):
    def setUp(self):
        super().setUp()
        self.s = v.reconstruct(self.left, self.right, order="bgr", **ARRAYS)

    def test_maps_are_those_of_the_files_and_cannot_be_written(self):
        self.s.write(self.out)
        read = cv2.imread(str(self.out / "disparity.pfm"), cv2.IMREAD_UNCHANGED)
        read[~numpy.isfinite(read)] = numpy.nan
        numpy.testing.assert_array_equal(self.s.disparity, read)
        depth = cv2.imread(str(self.out / "depth.png"), cv2.IMREAD_UNCHANGED)
        numpy.testing.assert_array_equal(numpy.nan_to_num(numpy.floor(self.s.depth_mm + 0.5)), depth)
        reasons = cv2.imread(str(self.out / "reasons.png"), cv2.IMREAD_UNCHANGED)
        self.assertEqual(reasons.shape[:2], self.s.shape)
        numpy.testing.assert_array_equal(self.s.reason == 0, numpy.isfinite(self.s.disparity))
        for name in ("disparity", "depth_mm", "sigma_mm", "reason", "points_mm", "colours"):
            with self.subTest(name), self.assertRaises(ValueError):
                getattr(self.s, name)[0] = 0

    def test_points_are_those_of_the_maps(self):
        s = self.s
        self.assertEqual(len(s.points_mm), numpy.isfinite(s.depth_mm).sum())
        numpy.testing.assert_array_equal(s.points_mm[:, 2], s.depth_mm.ravel()[s.pixels])
        numpy.testing.assert_array_equal(s.colours, s.left.reshape(-1, 3)[s.pixels])
        mesh = s.mesh()
        self.assertLess(mesh.triangles.max(), len(mesh.vertices_mm))
        points = s.points_mm
        del s, self.s, mesh
        self.assertTrue(numpy.isfinite(points).all())  # the array keeps the result

    def test_lengths_have_their_deviation(self):
        wall_mm, box_mm = FOCAL_PX * BASELINE_MM / 12, FOCAL_PX * BASELINE_MM / 30
        for place, expected_mm in (((30, 20), wall_mm), ((130, 85), box_mm)):
            depth = self.s.depth_at(*place)
            self.assertLess(abs(depth.value - expected_mm), 5 * depth.sigma)
            self.assertIsNone(depth.sigma_common)
        across = self.s.distance((110, 60), (150, 60))
        self.assertAlmostEqual(float(across), 40 * box_mm / FOCAL_PX, delta=5)
        mask = numpy.zeros(self.s.shape, bool)
        mask[60:110, 100:160] = True
        for region in (mask, (100, 60, 60, 50)):
            plane = self.s.fit_plane(region)
            self.assertAlmostEqual(plane.distance_mm.value, box_mm, delta=5)
            self.assertLess(plane.normal[2], -0.99)
        with self.assertRaises(v.Error):
            self.s.fit_cylinder(mask)

    def test_info_says_the_same_of_the_files(self):
        self.s.write(self.out, mesh_unit="cm", files=["points.pcd", "result.json"])
        done = run_vergence("info", self.out, "--depth", "30,20", "--distance", "110,60,150,60",
                            "--plane", "100,60,60,50", "--json")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        known = json.loads(done.stdout)[0]
        plane = self.s.fit_plane((100, 60, 60, 50))
        for found, other in ((self.s.depth_at(30, 20), known["depth_mm"]),
                             (self.s.distance((110, 60), (150, 60)), known["distance_mm"]),
                             (plane.distance_mm, known["plane"]["distance_mm"]),
                             (plane.tilt_deg, known["plane"]["tilt_deg"])):
            numpy.testing.assert_allclose(found[:2], (other["value"], other["sigma"]), rtol=1e-3, atol=1e-3)
        self.assertEqual(known["plane"]["points"], plane.points)
        words = ("--depth", "30,20", "--distance", "110,60,150,60", "--plane", "100,60,60,50")
        printed = run_vergence("info", self.out, *words).stdout
        shown = re.findall(r"[-\d.]+ \+- [\d.]+", printed)
        self.assertEqual(shown, [str(self.s.depth_at(30, 20)), str(self.s.distance((110, 60), (150, 60))),
                                 str(plane.distance_mm), str(plane.tilt_deg)])
        self.assertIn("extent", run_vergence("info", self.out / "result.json").stdout)
        for words, text in ((("--depth", "0,0"), "not measured here"), (("--depth", "900,0"), "outside"),
                            (("--plane", "0,0,2,2"), "too few measured points"),
                            (("--plane", "200,100,100,50"), "not within the maps"),
                            (("--plane", "9,9,0,0"), "empty"),
                            (("--depth", "3,3", "--at", "3,3"), "no --at")):
            done = run_vergence("info", self.out, *words)
            self.assertEqual(done.returncode, 3)
            self.assertIn(text, done.stderr)
        for place, text in ((self.directory / "nowhere", "No such file"), (self.directory, "result.json")):
            done = run_vergence("info", place, "--depth", "30,20")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1))
            self.assertIn(text, done.stderr)

    def test_no_digit_is_printed_that_the_deviation_does_not_support(self):
        for value, sigma, text in ((1792.3456, 1.234, "1792.3 +- 1.2"), (1792.3456, 0.0996, "1792.35 +- 0.10"),
                                   (1792.3456, 123.4, "1790 +- 120"), (1, 0.996, "1.0 +- 1.0"),
                                   (-0.04, 12, "0 +- 12"), (5.25, 0.0, "5.25 +- 0")):
            self.assertEqual(str(v.Measured(value, sigma, None)), text)

    def test_open3d_takes_the_mesh(self):
        try:
            import open3d  # noqa: F401
        except ImportError:
            self.skipTest("requires open3d (pip install open3d)")
        mesh = self.s.to_open3d()
        numpy.testing.assert_allclose(numpy.asarray(mesh.vertices), self.s.points_mm)
        self.assertEqual(len(mesh.triangles), len(self.s.mesh().triangles))
        numpy.testing.assert_allclose(numpy.asarray(mesh.vertex_colors) * 255, self.s.colours, atol=1e-6)

    def test_truth(self):
        cv2.imwrite(str(self.directory / "truth.pfm"), self.truth)
        for truth in (self.truth, self.directory / "truth.pfm"):
            found = v.evaluate(self.s, truth)
            self.assertLess(found["measured_all"]["bad_1_percent"], 2)
            self.assertEqual(found["filled_all"]["pixels"], self.truth.size)
        self.assertEqual(v.evaluate(self.s, self.s)["measured_all"]["rms_px"], 0)
        for options, text in (({"mask": numpy.ones(self.truth.shape, bool)}, "bool"), ({"scale": -1}, "scale"),
                              ({"mask": numpy.full(self.truth.shape, numpy.nan)}, "float64")):
            with self.assertRaisesRegex(v.ArgumentError, text):
                v.evaluate(self.s, self.truth, **options)

    def test_in_place_of_a_matcher_of_opencv(self):
        found = v.StereoMatcher(0, 48).compute(self.left, self.right)
        self.assertEqual((found.dtype, found.shape), (numpy.int16, self.truth.shape))
        valid = found >= 0
        self.assertEqual(set(found[~valid]), {-16})
        self.assertLess((abs(found[valid] / 16 - self.truth[valid]) > 1).mean(), 0.02)
        numpy.testing.assert_array_equal(v.StereoMatcher.create(numDisparities=48).compute(self.left, self.right),
                                         found)


class Refused(Fixture):
    def refused(self, kind, text, *words, **options):
        with self.assertRaises(kind) as caught:
            v.reconstruct(*words, **options)
        self.assertIn(text, str(caught.exception))

    def test_numbers_of_numpy_are_numbers(self):
        class Number(float):  # numpy 2 prints its own as np.float64(500.0)
            def __repr__(self):
                return f"np.float64({float(self)})"

            def tolist(self):
                return float(self)

        options = {**ARRAYS, "keep_all": numpy.True_, "fill": numpy.False_, "baseline_mm": Number(BASELINE_MM),
                   "disparity": numpy.array([0, 48])}
        wanted = v.reconstruct(self.left, self.right, keep_all=True, **ARRAYS)
        found = v.reconstruct(self.left, self.right, **options)
        numpy.testing.assert_array_equal(found.disparity, wanted.disparity)

    def test_arrays_that_cannot_be_matched(self):
        left, right = self.left, self.right
        for bad, text in ((left.astype(float), "NaN cannot be matched"), (left.astype(numpy.int32), "int32"),
                          (left[0, 0], "shape"), (left[:, :, :2], "shape"), (left[:0], "shape"),
                          (left.tolist(), "int64"), (left[:, :, 0] > 9, "bool")):
            with self.subTest(text):
                self.refused(v.ArgumentError, text, bad, right, **ARRAYS)
        self.refused(v.ArgumentError, "same type", left, grey(right), **ARRAYS)
        self.refused(v.Error, "differ in size", left, right[:-1], **ARRAYS)
        self.refused(ValueError, "two arrays or two names", left, "right.png", **ARRAYS)
        self.refused(v.Error, "the same", left, left, **ARRAYS)
        deep = left.astype(numpy.uint16) << 8
        self.refused(ValueError, "too large for 10 bits", deep, deep[::-1], bits=10, **ARRAYS)

    def test_words_are_those_of_the_command(self):
        for options, words in (({}, []), ({"rectified": True, "near_mm": 5}, ["--rectified", "--near", 5]),
                               ({"rectified": True, "disparity": (5, 0)}, ["--rectified", "--disparity", "5:0"]),
                               ({"rectified": True, "disparity": (0, 0)}, ["--rectified", "--disparity", "0:0"]),
                               ({"calibration": self.left_path}, ["--calibration", self.left_path])):
            done = run_vergence("reconstruct", self.left_path, self.right_path, "--out", self.out, *words)
            reason = done.stderr.split(": ", 1)[1].split("; see")[0].strip()
            with self.subTest(options):
                self.refused(v.Error, reason, self.left_path, self.right_path, **options)
        self.refused(v.Error, "No such file", "nowhere.png", "nowhere.png", **ARRAYS)

    def test_a_blank_pair_has_no_surface(self):
        blank = numpy.full((120, 160), 99, numpy.uint8)
        other = blank.copy()
        other[0, 0] = 98
        self.refused(v.NoSurfaceError, "", blank, other, **ARRAYS)

    def test_places_and_masks(self):
        s = v.reconstruct(self.left, self.right, rectified=True, disparity=(0, 48))
        with self.assertRaisesRegex(v.Error, "lengths mean nothing"):
            s.depth_at(30, 20)
        s = v.reconstruct(self.left, self.right, **ARRAYS)
        for call, text in ((lambda: s.depth_at(-3, 0), "outside"), (lambda: s.depth_at(float("nan"), 0), "outside"),
                           (lambda: s.depth_at(0, 0), "not measured"),
                           (lambda: s.fit_plane(numpy.ones((3, 3))), "shape"),
                           (lambda: s.fit_plane((0, 0, 0, 5)), "outside"),
                           (lambda: s.write(self.left_path), ""), (lambda: s.write(self.out, files="x"), "x"),
                           (lambda: v.evaluate(s, self.truth[1:]), "sizes must be equal")):
            with self.assertRaises(v.Error) as caught:
                call()
            self.assertIn(text, str(caught.exception))
        self.assertFalse(self.out.exists())

    def test_opencv_arrays(self):
        rig = v.load_calibration(self.calibration_text())
        arrays = rig.to_opencv()
        names = ("M1", "D1", "M2", "D2", "R", "T", "image_size")
        again = v.from_opencv(*(arrays[name] for name in names)).to_opencv()
        for name in ("M1", "D1", "R", "T", "P1", "Q"):
            numpy.testing.assert_allclose(again[name], arrays[name], atol=1e-5)
        self.assertEqual(v.Calibration.parse(rig.text).text, rig.text)
        for name, value in (("M1", numpy.eye(4)), ("T", [1, 2]), ("D1", [numpy.nan] * 5)):
            with self.assertRaisesRegex(v.ArgumentError, name):
                v.from_opencv(*({**arrays, name: value}[one] for one in names))


class Calls(Fixture):
    def big(self):
        random = numpy.random.default_rng(1)
        return [random.integers(0, 256, (900, 1200), numpy.uint8) for _ in range(2)]

    def test_progress_rises_and_its_exception_comes_back(self):
        seen = []
        v.reconstruct(self.left, self.right, progress=lambda *words: seen.append(words), **ARRAYS)
        self.assertEqual([share for _, share in seen], sorted(share for _, share in seen))
        self.assertIn("match", {stage for stage, _ in seen})

        def fail(_stage, _share):
            raise KeyError("mine")
        with self.assertRaises(KeyError):
            v.reconstruct(self.left, self.right, progress=fail, **ARRAYS)

    def test_control_c_ends_a_call(self):
        left, right = self.big()

        def interrupt(stage, _share):
            if stage == "match":
                os.kill(os.getpid(), signal.SIGINT)
        with self.assertRaises(KeyboardInterrupt):
            v.reconstruct(left, right, rectified=True, disparity=(0, 256), preset="best", progress=interrupt)

    def test_other_threads_run_meanwhile(self):
        left, right = self.big()
        begun, ran = threading.Event(), threading.Event()

        def other():
            begun.wait()
            ran.set()

        def show(_stage, share):
            begun.set()
            if share > 0.3:
                ran.wait()  # for ever, if the other thread could not run
        thread = threading.Thread(target=other)
        thread.start()
        self.addCleanup(thread.join)
        v.reconstruct(left, right, rectified=True, disparity=(0, 64), keep_all=True, progress=show)

    def test_two_calls_at_once_give_the_same(self):
        found = [None, None]

        def measure(number):
            found[number] = v.reconstruct(self.left, self.right, **ARRAYS).disparity
        threads = [threading.Thread(target=measure, args=(number,)) for number in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        numpy.testing.assert_array_equal(*found)


class Tour(Fixture):
    maxDiff = None

    def test_the_readme(self):
        self.calibration_text().rename(self.directory / "rig.calibration")
        cv2.imwrite(str(self.directory / "truth.pfm"), self.truth)
        pictures = self.directory / "pictures"
        pictures.mkdir()
        samples = os.environ["VERGENCE_OPENCV_SAMPLES"]
        for number in (1, 2, 3, 4, 5, 6, 7, 8, 9):
            for side in ("left", "right"):
                name = f"{side}{number:02}.jpg"
                os.symlink(os.path.join(samples, name), pictures / name)
        text = "".join((package.SOURCE / name).read_text() for name in ("README.md", "library/README.md"))
        blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
        self.assertGreater(len(blocks), 7)
        program = self.directory / "tour.py"
        program.write_text("\n".join(blocks))
        done = subprocess.run([sys.executable, "-B", program], cwd=self.directory, capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": str(package.BUILD / "package")})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("Surface 240 x 160 px", done.stdout)
        self.assertIn("Good: ", done.stdout)
        for name in ("out/report.html", "web/mesh.glb", "board.calibration"):
            self.assertTrue((self.directory / name).is_file(), name)


if __name__ == "__main__":
    unittest.main()

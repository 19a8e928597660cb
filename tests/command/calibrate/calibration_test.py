# SPDX-License-Identifier: Apache-2.0
"""Calibrations on the command line: import, conversion, manual edits, and rejection of invalid
ones."""
import json
import os
import pathlib
import re
import shutil
import stat
import subprocess
import tempfile
import unittest

import cv2
import numpy

VERGENCE = os.environ["VERGENCE"]
SOURCE = pathlib.Path(os.environ["VERGENCE_SOURCE"])

MIDDLEBURY = """cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]
cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]
doffs=31.086
baseline=193.001
width=741
height=497
ndisp=70
"""


class Calibration(unittest.TestCase):
    def setUp(self):
        self.here = pathlib.Path(tempfile.mkdtemp(prefix="vergence-calibration-"))
        self.addCleanup(shutil.rmtree, self.here)

    def write(self, name, content):
        path = self.here / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def info(self, *arguments, **options):
        return subprocess.run([VERGENCE, "info", *map(str, arguments)], capture_output=True,
                              text=True, timeout=60, **options)

    def explain(self, *arguments):
        done = self.info(*arguments, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)[0]

    def assert_refused(self, done, *words, code=3):
        """One line, no traceback, the words in it, nothing on standard output."""
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertEqual(done.stdout, "")
        for word in words:
            self.assertIn(str(word), done.stderr)

    def write_opencv(self, unit=1.0, rotation=None, shift=None):
        """The files of OpenCV's stereo_calib, written by OpenCV."""
        camera = numpy.array([[533.5, 0, 341.5], [0, 534.25, 234.5], [0, 0, 1]])
        distortion = numpy.array([[-0.28, 0.09, 0.001, -0.0002, 0]])
        if rotation is None:
            rotation, _ = cv2.Rodrigues(numpy.array([0.006, 0.0047, -0.0036]))
            shift = numpy.array([[-99.5], [1.25], [0.0625]]) * unit
        for name, values in (("intrinsics", {"M1": camera, "D1": distortion, "M2": camera,
                                             "D2": distortion}),
                             ("extrinsics", {"R": rotation, "T": shift})):
            storage = cv2.FileStorage(str(self.here / f"{name}.yml"), cv2.FileStorage_WRITE)
            for key, value in values.items():
                storage.write(key, value)
            storage.release()
        return self.here / "intrinsics.yml"

    def test_opencv_pair_converts_and_converts_no_further(self):
        files = self.write_opencv()
        self.assert_refused(self.info(files), files, "--size")
        rig = self.here / "rig.txt"
        page = self.explain(files, "--size", "640x480", "--convert", rig)
        self.assertEqual(page["format"], "OpenCV")
        self.assertEqual(page["left"]["focal_px"], [533.5, 534.25])
        self.assertAlmostEqual(page["baseline_mm"], numpy.linalg.norm([99.5, 1.25, 0.0625]), 8)
        self.assertTrue(any("mm" in line for line in page["assumed"]), page["assumed"])
        again = self.here / "again.txt"
        own = self.explain(rig, "--convert", again)
        self.assertEqual(own["format"], "vergence")
        self.assertEqual(own["crc32"], page["crc32"])
        self.assertEqual(rig.read_bytes(), again.read_bytes())
        self.assertTrue(rig.read_text().endswith(f"crc32 {page['crc32']}\n"))
        self.assertEqual(stat.S_IMODE(rig.stat().st_mode) & 0o600, 0o600)

    def test_lengths_in_metres_need_their_unit(self):
        files = self.write_opencv(unit=1e-3)
        self.assert_refused(self.info(files, "--size", "640x480"), "possibly in metres", "--unit")
        page = self.explain(files, "--size", "640x480", "--unit", "m")
        self.assertAlmostEqual(page["translation_right_left_mm"][0], -99.5, 8)

    def write_ros(self, left, right, shift=-60):
        """Two camera_info files under these names."""
        identity = "data: [1, 0, 0, 0, 1, 0, 0, 0, 1]"
        paths = []
        for name, product in ((left, 0), (right, shift)):
            paths.append(self.write(name, f"""image_width: 640
image_height: 480
camera_matrix: {{data: [530, 0, 320, 0, 531, 240, 0, 0, 1]}}
distortion_model: plumb_bob
distortion_coefficients: {{data: [-0.28, 0.08, 0.001, -0.0002, 0]}}
rectification_matrix: {{{identity}}}
projection_matrix: {{data: [500, 0, 325, {product}, 0, 500, 244, 0, 0, 0, 1, 0]}}
"""))
        return paths

    def test_two_files_of_one_calibration_are_one(self):
        pair = self.write_ros("left.yaml", "right.yaml")
        for files in (pair, pair[::-1], self.write_ros("a.yaml", "b.yaml")):
            done = self.info(*files, "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            pages = json.loads(done.stdout)
            self.assertEqual([page["baseline_mm"] for page in pages], [120])
        rig = self.here / "rig.txt"
        self.explain(*pair, "--convert", rig)
        done = self.info(*pair, rig, "--json")
        self.assertEqual([page["format"] for page in json.loads(done.stdout)],
                         ["ROS camera_info", "vergence"])
        self.assert_refused(self.info(*self.write_ros("left.yaml", "right.yaml", -60000)),
                            "120000 mm", "above", "--unit mm")
        page = self.explain(*pair, "--unit", "mm")
        self.assertEqual(page["baseline_mm"], 120)
        done = self.info(rig, rig, "--json")
        self.assertEqual(len(json.loads(done.stdout)), 2, "the same file twice")

    def test_the_assumed_search_can_be_pasted(self):
        done = self.info(*self.write_ros("left.yaml", "right.yaml"))
        advice = re.search(r"assumed; reconstruct takes (--near [\d.]+)\)", done.stdout)
        self.assertTrue(advice, done.stdout)
        done = subprocess.run([VERGENCE, "reconstruct", "no.png", "no.png", "--calibration", "no",
                               "--out", self.here / "out", *advice[1].split()],
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 3, done.stderr)  # no.png is missing, not an option

    def test_a_camera_behind_the_other_is_named(self):
        """Verged by 10 degrees; the right camera 300 mm in front of and behind the left one."""
        turned, _ = cv2.Rodrigues(numpy.array([0, numpy.radians(10), 0]))
        for ahead_mm, words in ((-300, "behind"), (300, "in front of")):
            files = self.write_opencv(rotation=turned,
                                      shift=-turned @ numpy.array([[60.0], [0], [ahead_mm]]))
            done = self.info(files, "--size", "640x480")
            self.assertIn(f"mm {words} the left one and only", done.stdout)

    def test_derived_figures(self):
        page = self.explain(self.write("calib.txt", MIDDLEBURY))
        self.assertTrue(page["rectified"])
        self.assertIsNone(page["vergence_depth_mm"])
        across = 2 * numpy.degrees(numpy.arctan(741 / 2 / 994.978))
        self.assertAlmostEqual(page["left"]["field_of_view_deg"][0], across, delta=1)
        for step in page["depth_per_pixel"]:
            expected = step["depth_mm"] ** 2 / (994.978 * 193.001)
            self.assertAlmostEqual(step["mm_per_px"], expected, places=6)
        plan = page["rectified_pair"]
        self.assertEqual(plan["size_px"], [741, 497])
        self.assertTrue(plan["identity"])
        self.assertLessEqual(plan["disparity_min_px"], 0)
        self.assertGreaterEqual(plan["disparity_max_px"], 69)

    def test_an_edited_file_is_refused_until_the_edit_is_accepted(self):
        rig = self.here / "rig.txt"
        self.explain(self.write("calib.txt", MIDDLEBURY), "--convert", rig)
        edited = self.write("edited.txt", rig.read_text().replace("-193.001", "-200.001"))
        self.assert_refused(self.info(edited), edited, "line 24", "crc32", "--accept-edits")
        mended = self.here / "mended.txt"
        page = self.explain(edited, "--accept-edits", "--convert", mended)
        self.assertEqual(page["translation_right_left_mm"][0], -200.001)
        self.assertEqual(self.explain(mended)["translation_right_left_mm"][0], -200.001)
        wrong = self.write("wrong.txt", rig.read_text().replace("-193.001", "193.001"))
        self.assert_refused(self.info(wrong, "--accept-edits"), "rectified")

    def test_bad_files_are_refused_in_one_line(self):
        rig = self.here / "rig.txt"
        self.explain(self.write("calib.txt", MIDDLEBURY), "--convert", rig)
        good = rig.read_text()
        focal = "left_focal_px 994.978000000"
        bad = {
            "nan.txt": (good.replace(focal, "left_focal_px nan"), "line 7", "left_focal_px"),
            "crlf.txt": (good.replace("\n", "\r\n"), "line 1", "CR LF"),
            "cut.txt": (good[:300], "line"),
            "zero.txt": (good.replace("-193.001000000", "0.000000000"), "line 24", "crc32"),
            "version.txt": (good.replace("calibration 1", "calibration 9"), "line 1", "version"),
            "empty.txt": ("", "empty"),
            "image.png": (b"\x89PNG\r\n\x1a\n" + bytes(20), "image.png"),
            "words.txt": ("some words\n", "not a calibration"),
        }
        for name, (content, *words) in bad.items():
            with self.subTest(name):
                path = self.write(name, content)
                self.assert_refused(self.info(path), path, *words)
        self.assert_refused(self.info(self.here / "none.txt"), "none.txt")
        self.assert_refused(self.info("/"), "/")

    def test_nothing_is_written_where_nothing_can_be(self):
        source = self.write("calib.txt", MIDDLEBURY)
        before = sorted(os.listdir(self.here))
        for target in (self.here, self.here / "no" / "rig.txt", "/dev/full/rig.txt"):
            done = self.info(source, "--convert", target)
            self.assert_refused(done, target)
        self.assertEqual(sorted(os.listdir(self.here)), before)

    def test_the_documented_example_and_the_grammar_agree(self):
        done = self.info("--grammar")
        self.assertEqual(done.returncode, 0, done.stderr)
        document = (SOURCE / "firmware/stereo/geometry/calibration.md").read_text()
        example = document.split("```\n")[1]
        names = [line.split("`")[1] for line in done.stdout.splitlines() if line.startswith("| `")]
        written = [line.split()[0] for line in example.splitlines()[1:-1]]
        self.assertEqual(written, names[:len(written)])
        self.assertEqual(self.explain(self.write("example.txt", example))["format"], "vergence")


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""`vergence info --export`: other programs see a thousand points where we see them.

OpenCV and mrcal project with their own code. ROS and Kalibr are not in Debian: their documented
conventions (CameraInfo.msg; Kalibr's wiki) are implemented below in a few lines of Python.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import cv2
import mrcal
import numpy as np
import yaml
from results import result_names

VERGENCE = os.environ["VERGENCE"]
SEED = int(os.environ.get("VERGENCE_SEED", "20261"))
POINTS = 1000
AGREE_PX = 1e-6


def brown(points, camera):
    """Pixels of points in the camera's frame: our lens.h, written from the equations."""
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    k1, k2, p1, p2, k3 = camera["D"]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.column_stack((camera["f"][0] * xd + camera["c"][0],
                            camera["f"][1] * yd + camera["c"][1]))


class Export(unittest.TestCase):
    def setUp(self):
        self.here = pathlib.Path(tempfile.mkdtemp(prefix="vergence-export-"))
        self.addCleanup(shutil.rmtree, self.here)
        self.random = np.random.default_rng(SEED)

    def info(self, *arguments):
        return subprocess.run([VERGENCE, "info", *map(str, arguments)], capture_output=True,
                              text=True, timeout=120)

    def make_rig(self, k3, verged_rad):
        """Our calibration of a random rig, and its values from `info --json`."""
        u = self.random.uniform
        source = self.here / "source"
        source.mkdir()
        turn = np.array([u(-.01, .01), verged_rad, u(-.02, .02)])
        matrix = [np.array([[u(900, 950), 0, u(620, 660)], [0, u(900, 950), u(460, 500)],
                            [0, 0, 1.]]) for _ in range(2)]
        D = [np.array([[u(-.3, -.2), u(.05, .1), u(-1e-3, 1e-3), u(-1e-3, 1e-3),
                        u(.01, .02) if k3 else 0]]) for _ in range(2)]
        file = cv2.FileStorage(str(source / "stereo.yml"), cv2.FILE_STORAGE_WRITE)
        for name, value in (("image_width", 1280), ("image_height", 960), ("M1", matrix[0]),
                            ("D1", D[0]), ("M2", matrix[1]), ("D2", D[1]),
                            ("R", cv2.Rodrigues(turn)[0]),
                            ("T", np.array([[-u(90, 130)], [u(-2, 2)], [u(-9, 9)]]))):
            file.write(name, value)
        file.release()
        rig = self.here / "rig.calibration"
        done = self.info(source / "stereo.yml", "--unit", "mm", "--convert", rig)
        self.assertEqual(done.returncode, 0, done.stderr)
        reported = json.loads(self.info(rig, "--json").stdout)[0]
        cameras = [{"f": reported[side]["focal_px"], "c": reported[side]["centre_px"],
                    "D": reported[side]["distortion_k1_k2_p1_p2_k3"]} for side in ("left", "right")]
        R = cv2.Rodrigues(np.array(reported["rotation_right_left_rad"]))[0]
        return rig, cameras, R, np.array(reported["translation_right_left_mm"])

    def points_mm(self):
        """In the left frame, within a view of some 70 degrees."""
        z = self.random.uniform(400, 6000, POINTS)
        slopes = self.random.uniform((-.6, -.45), (.6, .45), (POINTS, 2))
        return np.column_stack((slopes[:, 0] * z, slopes[:, 1] * z, z))

    def export(self, rig, name):
        out = self.here / name
        done = self.info(rig, "--export", name, "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(str(out), done.stdout)
        return out

    def rigs(self):
        for k3 in (False, True):
            for verged_rad in (0.002, 0.15):
                print(f"k3 {k3}, verged by {verged_rad} rad, VERGENCE_SEED={SEED}")
                yield k3, self.make_rig(k3, verged_rad)
                shutil.rmtree(self.here)
                self.here.mkdir()

    def assert_agree(self, theirs, ours):
        self.assertEqual(len(theirs), POINTS)
        self.assertLess(np.abs(theirs - ours).max(), AGREE_PX)

    def test_opencv(self):
        for _, (rig, cameras, R, t) in self.rigs():
            out = self.export(rig, "opencv")
            read = {}
            for name, fields in (("intrinsics.yml", "M1 D1 M2 D2"),
                                 ("extrinsics.yml", "R T R1 R2 P1 P2 Q")):
                file = cv2.FileStorage(str(out / name), cv2.FILE_STORAGE_READ)
                read.update({field: file.getNode(field).mat() for field in fields.split()})
            points = self.points_mm()
            right = points @ R.T + t
            seen = [brown(points, cameras[0]), brown(right, cameras[1])]
            zero = np.zeros(3)
            left_px, _ = cv2.projectPoints(points, zero, zero, read["M1"], read["D1"])
            right_px, _ = cv2.projectPoints(points, cv2.Rodrigues(read["R"])[0], read["T"],
                                            read["M2"], read["D2"])
            self.assert_agree(left_px[:, 0], seen[0])
            self.assert_agree(right_px[:, 0], seen[1])
            # Rectified: OpenCV undistorts our projections; rows agree, and Q gives the points back.
            still = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-16)
            flat = [cv2.undistortPointsIter(seen[i], read[f"M{i + 1}"], read[f"D{i + 1}"],
                                            read[f"R{i + 1}"], read[f"P{i + 1}"], still)[:, 0]
                    for i in range(2)]
            for i, P in enumerate((read["P1"], read["P2"])):
                rect = np.column_stack((points @ read["R1"].T, np.ones(POINTS))) @ P.T
                self.assert_agree(flat[i], rect[:, :2] / rect[:, 2:])
            self.assertLess(np.abs(flat[0][:, 1] - flat[1][:, 1]).max(), AGREE_PX)
            disparity = flat[0][:, 0] - flat[1][:, 0]
            back = np.column_stack((flat[0], disparity, np.ones(POINTS))) @ read["Q"].T
            self.assertLess(np.abs(back[:, :3] / back[:, 3:] @ read["R1"] - points).max(), 1e-3)
            # The same baseline as from OpenCV's own rectification.
            own = cv2.stereoRectify(read["M1"], read["D1"], read["M2"], read["D2"], (1280, 960),
                                    read["R"], read["T"])
            self.assertAlmostEqual(read["P2"][0, 3] / read["P2"][0, 0],
                                   own[3][0, 3] / own[3][0, 0], places=9)

    def test_mrcal(self):
        for k3, (rig, cameras, R, t) in self.rigs():
            out = self.export(rig, "mrcal")
            left = mrcal.cameramodel(str(out / "left.cameramodel"))
            right = mrcal.cameramodel(str(out / "right.cameramodel"))
            self.assertEqual(left.intrinsics()[0], f"LENSMODEL_OPENCV{5 if k3 else 4}")
            self.assertEqual(list(left.imagersize()), [1280, 960])
            points = self.points_mm()
            in_right = mrcal.transform_point_rt(
                mrcal.compose_rt(right.extrinsics_rt_fromref(), left.extrinsics_rt_toref()),
                points / 1000)
            self.assert_agree(mrcal.project(points / 1000, *left.intrinsics()),
                              brown(points, cameras[0]))
            self.assert_agree(mrcal.project(in_right, *right.intrinsics()),
                              brown(points @ R.T + t, cameras[1]))

    def read_yaml(self, path):
        return yaml.safe_load(path.read_text())

    def test_ros(self):
        for _, (rig, cameras, R, t) in self.rigs():
            out = self.export(rig, "ros")
            left, right = (self.read_yaml(out / f"{name}.yaml") for name in ("left", "right"))
            points = self.points_mm()
            R_rect_left = np.reshape(left["rectification_matrix"]["data"], (3, 3))
            rect_m = np.column_stack((points @ R_rect_left.T / 1000, np.ones(POINTS)))
            both = zip((left, right), cameras, (points, points @ R.T + t))
            rows = []
            for info, camera, in_camera in both:
                self.assertEqual(info["distortion_model"], "plumb_bob")
                self.assertEqual((info["image_width"], info["image_height"]), (1280, 960))
                K = np.reshape(info["camera_matrix"]["data"], (3, 3))
                P = np.reshape(info["projection_matrix"]["data"], (3, 4))
                D = info["distortion_coefficients"]["data"]
                theirs = brown(in_camera, {"f": (K[0, 0], K[1, 1]), "c": (K[0, 2], K[1, 2]),
                                           "D": D})
                self.assert_agree(theirs, brown(in_camera, camera))
                # "[u v w]' = P * [X Y Z 1]'" in the left rectified frame; and the same by turning
                # this camera's own points with its R.
                seen = rect_m @ P.T
                seen = seen[:, :2] / seen[:, 2:]
                turned = in_camera @ np.reshape(info["rectification_matrix"]["data"], (3, 3)).T
                own = turned @ P[:, :3].T
                self.assert_agree(seen, own[:, :2] / own[:, 2:])
                rows.append(seen[:, 1])
            self.assertLess(np.abs(rows[0] - rows[1]).max(), AGREE_PX)
            self.assertAlmostEqual(P[0, 3], -P[0, 0] * np.linalg.norm(t) / 1000, places=8)

    def test_kalibr(self):
        for k3, (rig, cameras, R, t) in self.rigs():
            out = self.export(rig, "kalibr")
            chain = self.read_yaml(out / "camchain.yaml")
            lost_px = (0, 0)
            if k3:
                text = (out / "camchain.yaml").read_text()
                loss = json.loads(self.info(rig, "--export", "kalibr", "--out", out,
                                            "--json").stdout)[0]["loss"]
                self.assertEqual([f"# {line}" for line in re.split("; (?=cam1)", loss)],
                                 text.splitlines()[:2])
                lost_px = [float(maximum) for maximum in re.findall(r"at most ([0-9.e-]+) px", loss)]
                self.assertEqual(len(lost_px), 2)
                self.assertLess(max(lost_px), 8)  # k3 moves a corner by up to 40 px
            points = self.points_mm()
            T = np.array(chain["cam1"]["T_cn_cnm1"])
            self.assertEqual(T[3].tolist(), [0, 0, 0, 1])
            in_right = (np.column_stack((points / 1000, np.ones(POINTS))) @ T.T)[:, :3]
            for name, camera, max_px, theirs, ours in (
                    ("cam0", cameras[0], lost_px[0], points / 1000, points),
                    ("cam1", cameras[1], lost_px[1], in_right, points @ R.T + t)):
                one = chain[name]
                self.assertEqual((one["camera_model"], one["distortion_model"]),
                                 ("pinhole", "radtan"))
                self.assertEqual(one["resolution"], [1280, 960])
                fu, fv, pu, pv = one["intrinsics"]
                radtan = {"f": (fu, fv), "c": (pu, pv), "D": one["distortion_coeffs"] + [0]}
                exact = brown(ours, camera)
                inside = ((exact > 0) & (exact < (1279, 959))).all(axis=1)
                self.assertGreater(inside.sum(), POINTS / 4)
                off_px = np.abs(brown(theirs, radtan) - exact)[inside].max()
                self.assertLess(off_px, max_px + AGREE_PX)

    def numbers(self, path):
        """The cameras in our own text, without names and remarks."""
        return [line for line in path.read_text().splitlines()
                if line.startswith(("left_", "right_", "rotation_", "translation_"))]

    def test_what_was_exported_is_read_back(self):
        for k3, (rig, *_) in self.rigs():
            for name in ("opencv", "ros", "kalibr", "mrcal"):
                if k3 and name == "kalibr":
                    continue
                again = self.here / f"{name}.calibration"
                done = self.info(self.export(rig, name), "--unit", "mm", "--convert", again)
                self.assertEqual(done.returncode, 0, done.stderr)
                for ours, theirs in zip(self.numbers(rig), self.numbers(again), strict=True):
                    self.assertEqual(ours.split()[0], theirs.split()[0])
                    np.testing.assert_allclose([float(word) for word in theirs.split()[1:]],
                                               [float(word) for word in ours.split()[1:]],
                                               rtol=0, atol=2e-9)

    def test_what_mrcal_writes_is_read(self):
        """Its own writer rounds to ten digits; its reference frame need not be the left camera's.
        """
        for _, (rig, cameras, R, t) in self.rigs():
            out = self.export(rig, "mrcal")
            moved = np.array([.1, -.2, .05, 1, -2, .5])
            for number, name in enumerate(("left", "right")):
                model = mrcal.cameramodel(str(out / f"{name}.cameramodel"))
                model.extrinsics_rt_fromref(mrcal.compose_rt(model.extrinsics_rt_fromref(), moved))
                model.write(str(self.here / f"camera-{number}.cameramodel"))
            again = self.here / "again.calibration"
            done = self.info(f"{self.here}/camera-0.cameramodel,{self.here}/camera-1.cameramodel",
                             "--convert", again)
            self.assertEqual(done.returncode, 0, done.stderr)
            reported = json.loads(self.info(again, "--json").stdout)[0]
            np.testing.assert_allclose(reported["translation_right_left_mm"], t, atol=1e-5)
            np.testing.assert_allclose(cv2.Rodrigues(np.array(reported["rotation_right_left_rad"]))[0],
                                       R, atol=1e-8)
            np.testing.assert_allclose(reported["right"]["distortion_k1_k2_p1_p2_k3"],
                                       cameras[1]["D"], rtol=1e-8)

    def test_an_earlier_export_is_replaced_and_mistakes_are_reported(self):
        rig = self.make_rig(False, 0.01)[0]
        out = self.export(rig, "ros")
        first = (out / "left.yaml").read_bytes()
        self.export(rig, "ros")
        self.assertEqual((out / "left.yaml").read_bytes(), first)
        self.assertEqual(result_names(out), ["left.yaml", "right.yaml"])
        for arguments in (["--export", "ros"], ["--out", "x"], ["--export", "matlab", "--out", "x"],
                          [rig, "--export", "ros", "--out", "x"]):
            done = self.info(rig, *arguments)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        done = self.info(rig, "--export", "ros", "--out", rig)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn(rig.name, done.stderr)


if __name__ == "__main__":
    unittest.main()

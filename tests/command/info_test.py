# SPDX-License-Identifier: Apache-2.0
"""vergence info on results: its output must match what third-party readers find in the same files.
"""
import json
import pathlib
import struct
import unittest

import cv2
import numpy

import pairs
from pairs import RECTIFIED


class Info(pairs.Fixture):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.kept = None

    def result(self):
        """One result directory for all tests of this class."""
        if Info.kept is None:
            self.reconstruct(*RECTIFIED)
            Info.kept = {p.name: p.read_bytes() for p in self.out.iterdir()}
        folder = pathlib.Path(self.out)
        folder.mkdir(exist_ok=True)
        for name, content in Info.kept.items():
            (folder / name).write_bytes(content)
        return folder

    def pages(self, *arguments):
        done = pairs.run("info", *arguments, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "")
        return {pathlib.Path(p["path"]).name: p for p in json.loads(done.stdout)}

    def test_a_result_directory(self):
        folder = self.result()
        pages = self.pages(folder)
        written = {"result.json", "disparity.pfm", "disparity.png", "depth.png", "reasons.png",
                   "mesh.ply", "mesh.glb", "points.pcd"}
        self.assertEqual(set(pages), written)
        result = json.loads((folder / "result.json").read_text())
        self.assertEqual(pages["result.json"]["result"], result)
        vertices = result["counts"]["vertices"]
        self.assertEqual(pages["mesh.ply"]["vertex"], vertices)
        self.assertEqual(pages["mesh.ply"]["face"], result["counts"]["triangles"])
        self.assertEqual(pages["points.pcd"]["points"], vertices)
        self.assertEqual(pages["mesh.glb"]["vertices"], result["mesh"]["vertices"])
        self.assertEqual(pages["mesh.glb"]["triangles"], result["mesh"]["triangles"])
        low, high = pages["mesh.glb"]["bounds_x"]
        self.assertAlmostEqual(low, result["bounds_mm"]["min"][0] / 1000, delta=2e-3)
        self.assertAlmostEqual(high, result["bounds_mm"]["max"][0] / 1000, delta=2e-3)
        for axis, letter in enumerate("xyz"):
            for name in ("mesh.ply", "points.pcd"):
                low, high = pages[name][f"bounds_{letter}"]
                self.assertAlmostEqual(low, result["bounds_mm"]["min"][axis], 2)
                self.assertAlmostEqual(high, result["bounds_mm"]["max"][axis], 2)

    def test_maps_agree_with_opencv(self):
        folder = self.result()
        pages = self.pages(folder)
        disparity = cv2.imread(str(folder / "disparity.pfm"), cv2.IMREAD_UNCHANGED)
        known = disparity[numpy.isfinite(disparity)]
        page = pages["disparity.pfm"]
        self.assertEqual(page["size_px"], [disparity.shape[1], disparity.shape[0]])
        self.assertEqual(page["known"], known.size)
        self.assertAlmostEqual(page["mean"], float(known.mean(dtype=float)), 4)
        self.assertEqual(page["range"], [float(known.min()), float(known.max())])
        depth = cv2.imread(str(folder / "depth.png"), cv2.IMREAD_UNCHANGED)
        self.assertEqual(pages["depth.png"]["known"], int((depth > 0).sum()))
        self.assertEqual(pages["depth.png"]["range"][1], int(depth.max()))
        scaled = cv2.imread(str(folder / "disparity.png"), cv2.IMREAD_UNCHANGED)
        self.assertEqual(pages["disparity.png"]["range"][1], int(scaled.max()) / 256)
        counts = {name: count for name, count in
                  json.loads((folder / "result.json").read_text())["reasons"].items() if count}
        output_text = pages["reasons.png"]["reasons"]
        self.assertEqual(pages["reasons.png"]["kind"], "reason map")
        self.assertEqual(list(output_text.values()), list(counts.values()))
        left = self.pages(folder / "left_rectified.png")["left_rectified.png"]
        self.assertEqual(left["size_px"], [disparity.shape[1], disparity.shape[0]])

    def bent_pair(self):
        """The pair as two cameras with distorted lenses see it, and the text of their calibration."""
        matrix = numpy.array([[pairs.FOCAL_PX, 0, (pairs.WIDTH - 1) / 2],
                              [0, pairs.FOCAL_PX, (pairs.HEIGHT - 1) / 2], [0, 0, 1]])
        bends = numpy.array([-.25, .05, 1e-3, -1e-3, 0]), numpy.array([-.2, .02, -1e-3, 1e-3, 0])
        raw = numpy.indices((pairs.HEIGHT, pairs.WIDTH))[::-1].reshape(2, 1, -1).T.astype(float)
        paths = []
        for name, image, bend in zip(("bent0.png", "bent1.png"), (self.left, self.right), bends):
            ideal = cv2.undistortPoints(raw, matrix, bend, P=matrix).astype(numpy.float32)
            ideal = ideal.reshape(pairs.HEIGHT, pairs.WIDTH, 2)
            paths.append(self.save(name, cv2.remap(image, ideal, None, cv2.INTER_CUBIC)))
        rig = self.directory / "stereo.yml"
        file = cv2.FileStorage(str(rig), cv2.FILE_STORAGE_WRITE)
        for name, value in (("image_width", pairs.WIDTH), ("image_height", pairs.HEIGHT),
                            ("M1", matrix), ("D1", bends[0]), ("M2", matrix), ("D2", bends[1]),
                            ("R", numpy.eye(3)), ("T", numpy.array([[-pairs.BASELINE_MM], [0], [0]]))):
            file.write(name, value)
        file.release()
        return paths, rig, matrix, bends

    def test_a_pixel_of_a_result_is_found_in_both_images(self):
        paths, rig, matrix, bends = self.bent_pair()
        self.reconstruct("--calibration", rig, "--unit", "mm", "--disparity", "0:48", left=paths[0],
                         right=paths[1])
        found, bent = self.disparity(), 0
        for x, y in ((130, 85), (40, 30), (200, 120), (60, 140)):
            page = self.pages(self.out, "--at", f"{x},{y}")["result.json"]
            self.assertAlmostEqual(page["disparity_px"], float(found[y, x]), 4)
            # The plain cameras of the original pair see the same point on one row.
            plain = [cv2.undistortPoints(numpy.array([[page[side + "_px"]]]), matrix, bend,
                                         P=matrix)[0, 0]
                     for side, bend in zip(("left", "right"), bends)]
            bent = max(bent, numpy.linalg.norm(plain[0] - page["left_px"]))
            self.assertAlmostEqual(plain[0][1], plain[1][1], delta=1e-2)
            column, row = numpy.rint(plain[0]).astype(int)
            self.assertAlmostEqual(plain[0][0] - plain[1][0], self.truth[row, column], delta=0.5)
        self.assertGreater(bent, 0.5)
        text = pairs.run("info", self.out, "--at", f"{x},{y}").stdout
        mark = ",".join(f"{v:.2f}" for v in (*page["left_px"], *page["right_px"]))
        self.assertIn(mark, text)
        text = pairs.run("info", self.out, "--at", "0,0").stdout
        self.assertFalse(numpy.isfinite(found[0, 0]))
        self.assertIn("not measured", text)
        for operand, at, word in ((self.out, f"{found.shape[1]},0", "outside"),
                                  (self.out, "-1,nan", "outside"), (self.out, "zoom=4", "X,Y"),
                                  (self.out / "mesh.ply", "1,1", "result")):
            done = pairs.run("info", operand, "--at", at)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (3, 1), done.stderr)
            self.assertIn(word, done.stderr)

    def test_text_names_what_matters(self):
        done = pairs.run("info", self.result())
        self.assertEqual(done.returncode, 0, done.stderr)
        for word in ("calibration", "surface", "points", "triangles", "baseline", "extent",
                     "disparity map", "depth map", "mesh (PLY)", "point cloud (PCD)"):
            self.assertIn(word, done.stdout)

    def test_damaged_results_are_refused_in_one_line(self):
        folder = self.result()
        cut = {"mesh.ply": 0.5, "points.pcd": 0.5, "mesh.glb": 0.9, "disparity.pfm": 0.5,
               "depth.png": 0.5, "result.json": 0.7}
        for name, part in cut.items():
            with self.subTest(name):
                whole = (folder / name).read_bytes()
                (folder / name).write_bytes(whole[:int(len(whole) * part)])
                done = pairs.run("info", folder / name)
                self.assertEqual(done.returncode, 3, done.stdout)
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
                self.assertIn(name, done.stderr)
                self.assertEqual(done.stdout, "")

    def test_hostile_headers_are_refused(self):
        hostile = {
            "huge.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 4294967295\n"
                        b"property float x\nproperty float y\nproperty float z\nend_header\n",
            "list.ply": b"ply\nformat binary_little_endian 1.0\nelement face 9999999999\n"
                        b"property list uchar int a\nend_header\n\x03",
            "no_end.ply": b"ply\n" + b"comment x\n" * 10,
            "type.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 1\n"
                        b"property real x\nend_header\n",
            "huge.pcd": b"# .PCD\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 9999999999\n"
                        b"DATA binary\n",
            "size.pcd": b"# .PCD\nFIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 1\nDATA binary\n",
            "length.glb": b"glTF" + struct.pack("<IIII", 2, 24, 1000, 0x4E4F534A) + b"{}  ",
            "json.glb": b"glTF" + struct.pack("<IIII", 2, 24, 4, 0x4E4F534A) + b"{}  ",
            "result.json": b'{\n  "program": "vergence",\n',
            "deep.json": b'{\n  "program": "vergence",\n  "a": ' + b"[" * 10 ** 6 +
                         b"]" * 10 ** 6 + b"}\n",
        }
        for name, content in hostile.items():
            with self.subTest(name):
                path = pathlib.Path(self.out).parent / name
                path.write_bytes(content)
                done = pairs.run("info", path)
                self.assertEqual(done.returncode, 3, done.stdout)
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
                self.assertIn(name, done.stderr)

    def test_usage_mistakes(self):
        for arguments in ([], ["--size", "12"], ["--nope"], ["a", "b", "--convert", "c"]):
            done = pairs.run("info", *arguments)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        done = pairs.run("info", "--help")
        self.assertEqual(done.returncode, 0)
        self.assertIn("--accept-edits", done.stdout)


if __name__ == "__main__":
    unittest.main()

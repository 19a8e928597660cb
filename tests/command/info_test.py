# SPDX-License-Identifier: Apache-2.0
"""vergence info on results: its output must match what third-party readers find in the same files.
"""
import json
import pathlib
import re
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

    def test_calibrations_that_numpy_saved(self):
        """Names and shapes as in tutorials, stored and deflated, beside other arrays."""
        M1 = numpy.array([[530, 0, 320], [0, 531, 240], [0, 0, 1.0]])
        M2, D = M1 + [[0, 0, 5], [0] * 3, [0] * 3], numpy.array([[-.28, .08, .001, -.0002, 0]])
        R, T = cv2.Rodrigues(numpy.array([.01, -.02, .005]))[0], numpy.array([[-60.0], [.5], [1]])
        path = self.directory / "pair.npz"
        for save, arrays in (
                (numpy.savez, {"mtxL": M1, "distL": D, "mtxR": M2, "distR": D / 2, "R": R, "T": T,
                               "imageSize": (640, 480), "objpoints": numpy.array([{}])}),
                (numpy.savez_compressed, {
                    "K0": M1, "D0": D[0], "K1": M2, "D1": D[0] / 2, "R": numpy.asfortranarray(R),
                    "T": T[:, 0].astype(">f4"), "size": numpy.array([640, 480], "i4"),
                    "rms": 0.25, "big": numpy.zeros((300, 300)), "name": numpy.array("a rig")})):
            save(path, **arrays)
            page = self.pages(path)["pair.npz"]
            self.assertEqual(page["left"]["size_px"], [640, 480])
            self.assertEqual(page["right"]["focal_px"], [530, 531])
            self.assertEqual(page["right"]["centre_px"], [325, 240])
            self.assertEqual(page["right"]["distortion_k1_k2_p1_p2_k3"], list(D[0] / 2))
            self.assertEqual(page["translation_right_left_mm"], [-60, .5, 1])
            numpy.testing.assert_allclose(page["rotation_right_left_rad"], [.01, -.02, .005],
                                          atol=1e-9)
        whole = path.read_bytes()
        numpy.savez(path, K1=M1, D1=D, K2=M2, D2=D, R=R, T=-T, imageSize=(640, 480))
        self.assertIn("left camera is on the right", str(self.pages(path)["pair.npz"]["assumed"]))
        numpy.save(self.directory / "M1.npy", M1)
        numpy.savez(path, **{f"array{number}": M1 for number in range(257)})
        many = path.read_bytes()
        numpy.savez(path, array7=M1)
        few = path.read_bytes()
        at = few.find(M1.tobytes()) + 5
        # Each list holds the one before it many times.
        lists = "\n".join(f"{name}: &{name} [{', '.join(['*' + inner] * 300)}]"
                          for inner, name in ("ab", "bc", "cd"))
        pair = {"K1": M1, "D1": D, "K2": M2, "D2": D, "R": R, "T": T, "imageSize": (640, 480)}
        unread = {}
        for key, value, word in (("T", T.astype(object), "T: has numpy's type '|O' and shape (3, 1)"),
                                 ("R", numpy.array([R, R]), "R: has numpy's type '<f8' and shape (2, 3, 3)"),
                                 ("K2", M2.astype("f2"), "K2: has numpy's type '<f2'"),
                                 ("D1", D.astype(complex), "D1: has numpy's type '<c16'"),
                                 ("R", R.astype([("a", "f8")]), "R: has numpy's type 'a")):
            numpy.savez(path, **{**pair, key: value})
            unread[word] = path.read_bytes()
        for name, content, word in (*((f"unread{i}.npz", content, word)
                                      for i, (word, content) in enumerate(unread.items())),
                                    ("cut.npz", whole[:len(whole) // 2], "not a complete zip"),
                                    ("holes.npz", whole[:60] + bytes(200) + whole[260:], "damaged"),
                                    ("one.npy", (self.directory / "M1.npy").read_bytes(), "numpy.savez"),
                                    ("many.npz", many, "more files than a calibration has"),
                                    ("flipped.npz", few[:at] + bytes([few[at] ^ 1]) + few[at + 1:], "damaged"),
                                    ("control.npz", few.replace(b"array7.", b"a\x1b[2J\n."), "name of an array"),
                                    ("deep.json", b'{"M1": {"type_id": "opencv-matrix"}, "D": ' + b"[" * 200000,
                                     "nested too deeply"),
                                    ("deep.glb", b"glTF" + struct.pack("<IIII", 2, 200032, 200012, 0x4e4f534a)
                                     + b'{"asset":' + b"[" * 200003, "nested too deeply"),
                                    ("lists.yml", f"M1: !!opencv-matrix\n  rows: 3\na: &a [1]\n{lists}\n".encode(),
                                     "too many"),
                                    ("no.npz", b"PK\3\4" + b"PK\5\6" + bytes(18), "without arrays")):
            (self.directory / name).write_bytes(content)
            done = pairs.run("info", self.directory / name)
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(word, done.stderr)

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

    def raw_of_page(self, side, x, y):
        """Where report.html finds a place of the rectified images in those as they were taken."""
        text = (self.out / "report.html").read_text(encoding="utf-8")
        raw = json.loads(re.search(r'id="page-data">(.*?)</script>', text, re.S)[1])["raw"]
        nodes = numpy.array(raw[side], float).reshape(raw["rows"], raw["columns"], 2)
        column, row = x / raw["step"], y / raw["step"]
        i, j = min(int(column), raw["columns"] - 2), min(int(row), raw["rows"] - 2)
        u, v = column - i, row - j
        return ((1 - v) * ((1 - u) * nodes[j, i] + u * nodes[j, i + 1]) +
                v * ((1 - u) * nodes[j + 1, i] + u * nodes[j + 1, i + 1]))

    def test_a_pixel_of_a_result_is_found_in_both_images(self):
        paths, rig, matrix, bends = self.bent_pair()
        self.reconstruct("--calibration", rig, "--unit", "mm", "--disparity", "0:48", left=paths[0],
                         right=paths[1])
        found, bent = self.disparity(), 0
        for x, y in ((130, 85), (40, 30), (200, 120), (60, 140)):
            page = self.pages(self.out, "--at", f"{x},{y}")["result.json"]
            self.assertAlmostEqual(page["disparity_px"], float(found[y, x]), 4)
            # The report's page says the same, from a coarse grid.
            for side, place in (("left", x), ("right", x - page["disparity_px"])):
                self.assertLess(numpy.abs(self.raw_of_page(side, place, y) - page[side + "_px"]).max(),
                                0.1)
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
                                  (self.out / "mesh.ply", "1,1", "result"),
                                  (self.out / "none", "1,1", "No such file")):
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

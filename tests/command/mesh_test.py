# SPDX-License-Identifier: Apache-2.0
"""Simplified and compressed meshes, their units, which files are written, and the compact surface, of
which they are made again."""
import json
import os
import shutil
import struct
import unittest
import zlib

import cv2
import numpy

import foreign_readers
import pairs
from pairs import BOARD, FOCAL_PX, RECTIFIED, VERGENCE
from results import result_names

KINDS = {5120: "i1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


class Mesh(pairs.Fixture):
    def ply(self):
        plyfile, _ = foreign_readers.python_readers()
        ply = plyfile.PlyData.read(str(self.out / "mesh.ply"))
        vertex = ply["vertex"]
        points = numpy.stack([vertex["x"], vertex["y"], vertex["z"]], 1).astype(float)
        return points, numpy.stack(ply["face"]["vertex_indices"])

    def glb(self):
        """Points in mm in the left camera's frame, pixels and triangles."""
        document, parts = foreign_readers.glb(self.out / "mesh.glb")
        accessors = document["accessors"]
        primitive = document["meshes"][0]["primitives"][0]

        def values(number, columns):
            kind = numpy.dtype(KINDS[accessors[number]["componentType"]])
            count = accessors[number]["count"]
            rows = numpy.frombuffer(parts[number], kind).reshape(count, -1)
            return rows[:, :columns].astype(float)
        node = document["nodes"][0]
        points = values(primitive["attributes"]["POSITION"], 3)
        points = points * node.get("scale", 1) + node.get("translation", 0)
        places = values(primitive["attributes"]["TEXCOORD_0"], 2)
        if not accessors[primitive["attributes"]["TEXCOORD_0"]].get("normalized"):
            pixels = places
        else:
            pixels = places / 65535 * [pairs.WIDTH, pairs.HEIGHT] - 0.5
        triangles = values(primitive["indices"], 1).astype(int).reshape(-1, 3)
        return points * [1000, -1000, -1000], numpy.rint(pixels).astype(int), triangles

    def result(self):
        return json.loads((self.out / "result.json").read_text())

    def covered(self, pixels, triangles):
        mask = numpy.zeros((pairs.HEIGHT, pairs.WIDTH), numpy.uint8)
        for corners in pixels[triangles]:
            cv2.fillConvexPoly(mask, corners.astype(numpy.int32), 1)
        return mask

    def full(self):
        """Points and pixels of every measured point, and the coverage of their triangles."""
        self.reconstruct()
        points, triangles = self.ply()
        rows, columns = numpy.nonzero(numpy.isfinite(self.disparity()))
        pixels = numpy.stack([columns, rows], 1)
        return points, pixels, triangles, self.covered(pixels, triangles)

    def worst_mm(self, full, mesh):
        """The 99 % quantile of the points' distances from the plane of their triangle."""
        points, pixels = full[0], full[1]
        number = {tuple(pixel): i for i, pixel in enumerate(pixels)}
        corner_points, corner_pixels, triangles = mesh
        best = numpy.full(len(points), numpy.inf)
        for triangle in triangles:
            a, b, c = corner_points[triangle]
            normal = numpy.cross(b - a, c - a)
            normal /= numpy.linalg.norm(normal) or 1
            low = corner_pixels[triangle].min(axis=0)
            mask = numpy.zeros(numpy.ptp(corner_pixels[triangle], axis=0)[::-1] + 1, numpy.uint8)
            cv2.fillConvexPoly(mask, (corner_pixels[triangle] - low).astype(numpy.int32), 1)
            for y, x in zip(*numpy.nonzero(mask)):
                i = number.get((x + low[0], y + low[1]))
                if i is not None:
                    best[i] = min(best[i], abs(normal @ (points[i] - a)))
        return numpy.quantile(best[numpy.isfinite(best)], 0.99)

    def check(self, full, mesh):
        """Every vertex is a measured point, and no hole is closed or opened."""
        where = {tuple(pixel): i for i, pixel in enumerate(full[1])}
        numbers = [where[tuple(pixel)] for pixel in mesh[1]]
        pitch_mm = full[0][numbers][:, 2] / FOCAL_PX
        self.assertLess((abs(full[0][numbers] - mesh[0]).max(axis=1) / pitch_mm).max(), 0.25)
        # OpenCV draws the edges of long triangles to the nearest pixel.
        self.assertLess((self.covered(mesh[1], mesh[2]) != full[3]).sum(), 0.003 * full[3].sum())
        self.assertEqual(self.result()["mesh"]["uncovered"], 0)

    def test_the_default_follows_what_was_measured(self):
        full, mesh = self.full(), self.glb()
        reported = self.result()["mesh"]
        self.assertLess(len(mesh[2]), 0.6 * len(full[2]))
        self.assertEqual((len(mesh[0]), len(mesh[2])), (reported["vertices"], reported["triangles"]))
        self.check(full, mesh)
        worst = self.worst_mm(full, mesh)
        self.assertAlmostEqual(worst, reported["distance_mm"]["p99"], delta=0.2 * worst + 0.01)
        self.assertLess(worst, 2 * self.result()["sigma_mm"]["median"])

    def test_a_number_of_triangles(self):
        full = self.full()
        for count in (10 ** 9, 2000, 1000):
            self.reconstruct(*RECTIFIED, "--triangles", count)
            reported = self.result()["mesh"]
            triangles = self.ply()[1]
            self.assertEqual(len(triangles), reported["triangles"])
            self.assertEqual(len(self.glb()[2]), reported["triangles"])
            self.assertLessEqual(reported["triangles"], count)
            self.assertGreater(reported["triangles"], min(len(full[2]) - 1, 0.9 * count))
            self.assertLess(reported["uncovered"], 0.02 * len(full[0]))
        done = self.reconstruct(*RECTIFIED, "--triangles", 1)
        self.assertIn("triangles are left", done.stderr)

    def test_an_error_in_mm(self):
        full = self.full()
        counts = []
        for error_mm in (2, 20):
            self.reconstruct(*RECTIFIED, "--error", error_mm)
            mesh = self.glb()
            self.check(full, mesh)
            self.assertLessEqual(self.worst_mm(full, mesh), error_mm)
            self.assertEqual(self.result()["counts"]["triangles"], len(full[2]))
            counts.append(len(mesh[2]))
        self.assertLess(counts[1], counts[0])

    def test_compressed_is_the_same_mesh(self):
        full, plain = self.full(), self.glb()
        plain_bytes = os.path.getsize(self.out / "mesh.glb")
        self.reconstruct(*RECTIFIED, "--compress")
        report = foreign_readers.validate_gltf(self.out / "mesh.glb")
        self.assertEqual((report["issues"]["numErrors"], report["issues"]["numWarnings"]), (0, 0),
                         report["issues"])
        packed = self.glb()
        self.assertLess(os.path.getsize(self.out / "mesh.glb"), 0.6 * plain_bytes)
        self.check(full, packed)
        self.assertTrue(numpy.array_equal(packed[1], plain[1]))

        def turned(triangles):  # to begin with the smallest number
            return sorted(tuple(numpy.roll(t, -int(t.argmin()))) for t in triangles)
        self.assertEqual(turned(packed[2]), turned(plain[2]))

    def test_units(self):
        self.reconstruct()
        _, pypcd4 = foreign_readers.python_readers()
        points = self.ply()[0]
        glb = (self.out / "mesh.glb").read_bytes()
        for unit, name, mm in (("m", b"metres", 1000), ("cm", b"centimetres", 10)):
            self.reconstruct(*RECTIFIED, "--mesh-unit", unit)
            self.assertLess(abs(self.ply()[0] * mm / points - 1)[points != 0].max(), 1e-6)
            cloud = pypcd4.PointCloud.from_path(self.out / "points.pcd").numpy(("x", "y", "z"))
            self.assertLess(abs(cloud * mm - points).max(), 0.01)
            for file in ("mesh.ply", "points.pcd"):
                self.assertIn(b" " + name, (self.out / file).read_bytes()[:1000])
            self.assertEqual((self.out / "mesh.glb").read_bytes(), glb)

    def test_only_the_files_that_are_asked_for(self):
        self.reconstruct()
        self.reconstruct(*RECTIFIED, "--files", "mesh.glb,report.html")
        self.assertEqual(result_names(self.out), ["mesh.glb", "report.html"])
        self.reconstruct(*RECTIFIED, "--files=result.json,mesh.ply")
        self.assertEqual(result_names(self.out), ["mesh.ply", "result.json"])
        self.assertIsNone(self.result()["mesh"])

    def test_mistakes(self):
        for arguments, word in ((["--files", "mesh.stl"], "mesh.stl"),
                                (["--files", "mesh.glb,"], "mesh.glb"),
                                (["--triangles", "9", "--error", "1"], "--error")):
            done = pairs.run("reconstruct", self.left_path, self.right_path, *RECTIFIED,
                             *arguments, "--out", self.out)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn(word, done.stderr)
            self.assertFalse(self.out.exists())
        left = self.save("left.pgm", pairs.grey(self.left))
        right = self.save("right.pgm", pairs.grey(self.right))
        for option in (["--triangles", "9"], ["--error", "1"], ["--compress"],
                       ["--files", "mesh.glb"]):
            done = pairs.run("reconstruct", left, right, *RECTIFIED, *option, "--out", self.out,
                             program=BOARD)
            self.assertEqual(done.returncode, 2, done.stderr)


class Compact(pairs.Fixture):
    """surface.compact gives the files that were made with it again, and nothing if it is damaged."""
    NOT_IN_IT = {"right_rectified.png", "report.html"}

    def make_again(self, *options, program=VERGENCE):
        again = self.directory / "again"
        shutil.rmtree(again, ignore_errors=True)
        done = pairs.run("reconstruct", self.out / "surface.compact", "--out", again, *options,
                         program=program)
        self.assertEqual(done.returncode, 0, done.stderr)
        return again

    def check_same(self, *options):
        again = self.make_again(*options)
        names = set(result_names(self.out)) - self.NOT_IN_IT
        self.assertEqual(names, set(result_names(again)) - {"report.html"})
        self.assertIn("mesh.ply", names)
        for name in sorted(names):
            self.assertEqual((self.out / name).read_bytes(), (again / name).read_bytes(), name)

    def test_the_same_files(self):
        half = ["--region", f"{pairs.WIDTH // 4},20,{pairs.WIDTH // 2},101"]
        for options in ([], ["--fill"], ["--keep-all", "--no-refine"], half, ["--scale", "0.7"]):
            with self.subTest(options=options):
                self.reconstruct(*RECTIFIED, *options)
                self.check_same()
        with self.subTest("no lengths"):
            self.reconstruct("--rectified", "--disparity", "0:48")
            self.check_same()
        self.left_path = self.save("left.png", pairs.grey(self.left))
        self.right_path = self.save("right.png", pairs.grey(self.right))
        with self.subTest("grey, with options of the files"):
            options = ["--triangles", "20", "--mesh-unit", "m", "--compress"]
            self.reconstruct("--calibration", self.calibration_text(), "--near", "1500", *options)
            self.assertIn("triangles are left", (self.out / "result.json").read_text())
            self.check_same(*options)

    def test_the_report_says_what_is_missing(self):
        self.reconstruct()
        report = (self.make_again() / "report.html").read_text()
        self.assertIn("has neither the right image", report)
        self.assertNotIn("has neither the right image", (self.out / "report.html").read_text())
        self.assertNotIn("Right image, rectified", report)

    def test_the_programs_of_board_and_pc(self):
        self.reconstruct(program=BOARD, left=self.save("l.ppm", self.left),
                         right=self.save("r.ppm", self.right))
        again = self.make_again()
        for name in ("mesh.ply", "points.pcd", "disparity.pfm", "surface.compact"):
            self.assertEqual((self.out / name).read_bytes(), (again / name).read_bytes(), name)
        self.assertTrue((again / "mesh.glb").exists())
        board = self.make_again(program=BOARD)
        for name in result_names(self.out):
            self.assertEqual((self.out / name).read_bytes(), (board / name).read_bytes(), name)

    def test_a_surface_is_replaced_by_itself_only(self):
        self.reconstruct()
        compact = self.out / "surface.compact"
        before = compact.read_bytes()
        done = pairs.run("reconstruct", compact, "--out", self.out, "--files", "mesh.ply")
        self.assertEqual(done.returncode, 3)
        self.assertIn("would be replaced", done.stderr)
        done = pairs.run("reconstruct", compact, "--out", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(compact.read_bytes(), before)

    def test_info_names_what_makes_a_result(self):
        self.reconstruct()
        for option in ([], ["--depth", "10,10"]):
            done = pairs.run("info", self.out / "surface.compact", *option)
            self.assertEqual(done.returncode, 3)
            self.assertIn('a compact surface ("vergence reconstruct', done.stderr)

    def test_options_of_measuring_are_refused(self):
        self.reconstruct()
        compact = self.out / "surface.compact"
        for option in (["--near", "500"], ["--fill"], ["--region", "0,0,50,50"], ["--all"]):
            done = pairs.run("reconstruct", compact, "--out", self.directory / "no", *option)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(option[0], done.stderr)

    def refused(self, data, *words):
        path = self.directory / "bad.compact"
        path.write_bytes(data)
        done = pairs.run("reconstruct", path, "--out", self.directory / "no")
        self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (3, "", 1),
                         done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)
        self.assertFalse((self.directory / "no").exists())

    @staticmethod
    def chunk_offsets(data):
        at = data.index(b"\nrows\n") + 6
        while at < len(data) - 4:
            yield at
            at += 4 + int.from_bytes(data[at:at + 4], "little")

    def test_damage(self):
        self.reconstruct(*RECTIFIED, "--scale", "0.25")
        data = (self.out / "surface.compact").read_bytes()
        borders = list(self.chunk_offsets(data))
        self.assertEqual(len(borders) % 10, 0, "a chunk for each byte of a pixel")
        for at in [30, 400, *borders[:10], len(data) - 4, len(data) - 1]:
            self.refused(data[:at], "truncated or damaged")
            self.refused(data[:at] + bytes([data[at] ^ 1]) + data[at + 1:], "truncated or damaged")
        self.refused(data + b"\0", "truncated or damaged")
        self.refused(data.replace(b"surface 1\n", b"surface 2\n", 1), "version 2", "newer")

    def test_what_no_program_writes(self):
        """With the right CRC, so that the contents are what is checked."""
        self.reconstruct(*RECTIFIED, "--scale", "0.25")
        data = (self.out / "surface.compact").read_bytes()[:-4]
        random = numpy.random.default_rng(pairs.SEED)
        head = data.index(b"\nrows\n")
        for round_ in range(60):
            bad = bytearray(data)
            for _ in range(random.integers(1, 4)):
                at = random.integers(26, head) if round_ % 2 else random.integers(head, len(data))
                bad[at] = random.integers(32, 127) if round_ % 2 else random.integers(0, 256)
            path = self.directory / "bad.compact"
            path.write_bytes(bytes(bad) + struct.pack("<I", zlib.crc32(bad)))
            done = pairs.run("reconstruct", path, "--out", self.directory / "no", "--files",
                             "mesh.ply,result.json", "--quiet")
            self.assertIn(done.returncode, (0, 3), f"seed {pairs.SEED} round {round_}: {done}")


if __name__ == "__main__":
    print(f"seed {pairs.SEED}")
    unittest.main()

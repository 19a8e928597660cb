# SPDX-License-Identifier: Apache-2.0
"""Every image format gives the same surface; every result file is read by a third-party reader."""
import json
import struct
import unittest
import zlib

import cv2
import numpy
from PIL import Image

import foreign_readers
import pairs
from pairs import BASELINE_MM, FOCAL_PX, RECTIFIED


def write_pnm(path, image, plain=False, maxval=255):
    """PGM or PPM, exactly as in the manual page, with a comment."""
    colour = image.ndim == 3
    values = image[:, :, ::-1] if colour else image
    kind = {(False, False): 5, (True, False): 6, (False, True): 2, (True, True): 3}[colour, plain]
    with open(path, "wb") as file:
        file.write(f"P{kind}\n# made by a test\n{image.shape[1]} {image.shape[0]}\n{maxval}\n"
                   .encode())
        if plain:
            file.write("\n".join(" ".join(map(str, row)) for row in
                                 values.reshape(image.shape[0], -1)).encode())
        else:
            file.write(values.astype(">u2" if maxval > 255 else "u1").tobytes())
    return path


def mosaic(image, bits):
    """A GRBG mosaic of an image (BGR, 8 bit), as from the sensor."""
    raw = image[:, :, 1].copy()
    raw[0::2, 1::2] = image[0::2, 1::2, 2]
    raw[1::2, 0::2] = image[1::2, 0::2, 0]
    return raw.astype(numpy.uint16) << (bits - 8)


class Images(pairs.Fixture):
    def check(self, left, right, *arguments):
        self.reconstruct(*RECTIFIED, *arguments, left=left, right=right)
        self.assert_near_truth()
        return self.disparity()

    def check_same(self, reference, left, right, *arguments):
        """The same disparities as `reference`: no part of the image was lost or moved."""
        found = self.check(left, right, *arguments)
        self.assertTrue(numpy.array_equal(found, reference))

    def grey_reference(self):
        self.grey_left, self.grey_right = pairs.grey(self.left), pairs.grey(self.right)
        return self.check(self.save("gl.png", self.grey_left), self.save("gr.png", self.grey_right))

    def test_grey_formats_agree(self):
        reference = self.grey_reference()
        for name, plain in (("l.pgm", False), ("lp.pgm", True)):
            left = write_pnm(self.directory / name, self.grey_left, plain)
            right = write_pnm(self.directory / ("r" + name), self.grey_right, plain)
            self.check_same(reference, left, right)
        for options in ({}, {"compression": "tiff_lzw"}, {"compression": "tiff_adobe_deflate"},
                        {"tile": (64, 32)}):
            paths = []
            for side, image in (("l", self.grey_left), ("r", self.grey_right)):
                paths.append(self.directory / f"{side}.tif")
                if "tile" in options:
                    self.write_tiled_tiff(paths[-1], image, *options["tile"])
                else:
                    Image.fromarray(image).save(paths[-1], **options)
            self.check_same(reference, *paths)

    @staticmethod
    def write_tiled_tiff(path, image, tile_width, tile_height):
        """A tiled TIFF exactly as in TIFF 6.0, section 15; no available writer makes one."""
        height, width = image.shape[:2]
        samples = 1 if image.ndim == 2 else 3
        padded = numpy.zeros((-(-height // tile_height) * tile_height,
                              -(-width // tile_width) * tile_width, samples), image.dtype)
        padded[:height, :width] = image.reshape(height, width, samples)[:, :, ::-1]
        tiles = [padded[y:y + tile_height, x:x + tile_width].tobytes()
                 for y in range(0, padded.shape[0], tile_height)
                 for x in range(0, padded.shape[1], tile_width)]
        tags = [(256, 4, [width]), (257, 4, [height]), (258, 3, [8 * image.itemsize] * samples),
                (259, 3, [1]), (262, 3, [1 if samples == 1 else 2]), (277, 3, [samples]),
                (322, 4, [tile_width]), (323, 4, [tile_height]), (324, 4, None),
                (325, 4, [len(t) for t in tiles])]
        directory, extra = b"", b""
        data_at = 8 + 2 + 12 * len(tags) + 4
        extra_bytes = sum(len(t) for t in tiles)
        offsets = [data_at + sum(len(t) for t in tiles[:i]) for i in range(len(tiles))]
        for tag, kind, values in tags:
            values = offsets if values is None else values
            packed = numpy.array(values, "<u2" if kind == 3 else "<u4").tobytes()
            if len(packed) > 4:
                field = numpy.uint32(data_at + extra_bytes + len(extra)).tobytes()
                extra += packed + b"\0" * (len(packed) % 2)
            else:
                field = packed.ljust(4, b"\0")
            directory += numpy.array([tag, kind], "<u2").tobytes() + \
                numpy.uint32(len(values)).tobytes() + field
        path.write_bytes(b"II*\0\x08\0\0\0" + numpy.uint16(len(tags)).tobytes() + directory +
                         b"\0\0\0\0" + b"".join(tiles) + extra)
        assert cv2.imread(str(path), cv2.IMREAD_UNCHANGED).shape[:2] == image.shape[:2]

    def test_colour_formats_agree(self):
        reference = self.check(self.left_path, self.right_path)
        for name, plain in (("l.ppm", False), ("lp.ppm", True)):
            left = write_pnm(self.directory / name, self.left, plain)
            right = write_pnm(self.directory / ("r" + name), self.right, plain)
            self.check_same(reference, left, right)
        variants = {}
        for side, image in (("l", self.left), ("r", self.right)):
            rgb = Image.fromarray(image[:, :, ::-1])
            alpha = rgb.copy()
            alpha.putalpha(128)
            for name, picture in (("alpha.png", alpha), ("rgb.tif", rgb), ("alpha.tif", alpha)):
                picture.save(self.directory / (side + name))
                variants.setdefault(name, []).append(self.directory / (side + name))
            tiled = self.directory / (side + "tiled.tif")
            self.write_tiled_tiff(tiled, image, 32, 48)
            variants.setdefault("tiled.tif", []).append(tiled)
        for name, paths in variants.items():
            with self.subTest(name):
                self.check_same(reference, *paths)

    def test_images_are_turned_as_opencv_turns_them(self):
        for extension, orientation in (("jpg", 1), ("jpg", 6), ("png", 3), ("tif", 6)):
            with self.subTest(extension=extension, orientation=orientation):
                turned, upright = [], []
                for side, image in (("l", self.left), ("r", self.right)):
                    turned.append(self.save_turned(f"{side}-turned.{extension}", image,
                                                   orientation))
                    upright.append(self.save(f"{side}-upright.png", cv2.imread(str(turned[-1]))))
                reference = self.check(*upright)
                done = self.reconstruct(*RECTIFIED, left=turned[0], right=turned[1])
                self.assertTrue(numpy.array_equal(self.disparity(), reference))
                self.assertEqual(done.stderr.count(f"orientation ({orientation})"),
                                 2 if orientation > 1 else 0, done.stderr)

    def save_turned(self, name, image, orientation):
        """The image (BGR) in a file with rotated pixels and the orientation tag that restores it.
        """
        away = {1: lambda a: a, 3: lambda a: numpy.rot90(a, 2), 6: lambda a: numpy.rot90(a, 1)}
        picture = Image.fromarray(numpy.ascontiguousarray(away[orientation](image)[:, :, ::-1]))
        path = self.directory / name
        if name.endswith("tif"):
            picture.save(path, tiffinfo={274: orientation})
        else:
            exif = Image.Exif()
            exif[274] = orientation
            picture.save(path, exif=exif, quality=95)
        return path

    def test_interlaced_png_is_the_same_image(self):
        reference = self.check(self.left_path, self.right_path)
        paths = []
        for path in (self.left_path, self.right_path):
            paths.append(self.directory / f"interlaced-{path.name}")
            self.assertTrue(self.interlace(path, paths[-1]), "OpenCV reads another image")
        self.check_same(reference, *paths)

    @staticmethod
    def interlace(source, target):
        """Adam7 exactly as in the PNG specification, section 8: neither OpenCV nor Pillow writes
        it. Returns whether OpenCV reads the same image."""
        image = cv2.imread(str(source), cv2.IMREAD_UNCHANGED)[:, :, ::-1]
        scanlines = b""
        for x0, y0, dx, dy in ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4),
                               (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)):
            for row in image[y0::dy, x0::dx]:
                scanlines += b"\0" + row.tobytes()

        def chunk(kind, data):
            return struct.pack(">I", len(data)) + kind + data + \
                struct.pack(">I", zlib.crc32(kind + data))
        height, width = image.shape[:2]
        target.write_bytes(b"\x89PNG\r\n\x1a\n" +
                           chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 1)) +
                           chunk(b"IDAT", zlib.compress(scanlines)) + chunk(b"IEND", b""))
        return numpy.array_equal(cv2.imread(str(target), cv2.IMREAD_UNCHANGED)[:, :, ::-1], image)

    def test_palette_and_few_bits(self):
        for bits in (1, 8):
            paths = []
            for side, image in (("l", self.left), ("r", self.right)):
                reduced = Image.fromarray(pairs.grey(image)).quantize(2 ** bits, dither=0)
                paths.append(self.directory / f"{side}{bits}.png")
                reduced.save(paths[-1], bits=bits)
            found = self.check(*paths)
            self.assertEqual(found.shape, self.truth.shape)

    def test_transparent_colours_are_colours(self):
        for name, prepare in (("palette", lambda rgb: rgb.quantize(200, dither=0)),
                              ("colour", lambda rgb: rgb),
                              ("grey", lambda rgb: rgb.convert("L"))):
            opaque, transparent = [], []
            for side, image in (("l", self.left), ("r", self.right)):
                picture = prepare(Image.fromarray(image[:, :, ::-1]))
                paths = [self.directory / f"{side}-{name}-{what}.png" for what in ("o", "t")]
                picture.save(paths[0])
                picture.save(paths[1], transparency=(30, 60, 90) if name == "colour" else 7)
                opaque.append(paths[0])
                transparent.append(paths[1])
            with self.subTest(name):
                self.check_same(self.check(*opaque), *transparent)

    def test_sixteen_bits(self):
        reference = self.grey_reference()
        for name in ("png", "tif"):
            left = self.save("l16." + name, self.grey_left.astype(numpy.uint16) * 257)
            right = self.save("r16." + name, self.grey_right.astype(numpy.uint16) * 257)
            self.check_same(reference, left, right)
        left = write_pnm(self.directory / "l16.pgm", self.grey_left.astype(int) * 257, maxval=65535)
        right = write_pnm(self.directory / "r16.pgm", self.grey_right.astype(int) * 257,
                          maxval=65535)
        self.check_same(reference, left, right)

    def test_twelve_bits_in_sixteen(self):
        self.grey_reference()
        left = self.save("l12.png", self.grey_left.astype(numpy.uint16) << 4)
        right = self.save("r12.png", self.grey_right.astype(numpy.uint16) << 4)
        done = self.reconstruct(*RECTIFIED, left=left, right=right)
        self.assertIn("--bits", done.stderr)
        self.check(left, right, "--bits", "12")
        refused = pairs.run("reconstruct", left, right, *RECTIFIED, "--bits", "10", "--out",
                            self.directory / "o")
        self.assertEqual(refused.returncode, 3)

    def test_jpeg(self):
        for name, options in (("a", {"quality": 95}), ("b", {"quality": 90, "progressive": True})):
            paths = []
            for side, image in (("l", self.left), ("r", self.right)):
                paths.append(self.directory / f"{side}{name}.jpg")
                Image.fromarray(image[:, :, ::-1]).save(paths[-1], **options)
            self.check(*paths)

    def test_raw_and_mosaic(self):
        left, right = mosaic(self.left, 10), mosaic(self.right, 10)
        left_raw, right_raw = self.directory / "l.raw", self.directory / "r.raw"
        left_raw.write_bytes(left.astype("<u2").tobytes())
        right_raw.write_bytes(right.astype("<u2").tobytes())
        reference = self.check(left_raw, right_raw, "--raw", f"{pairs.WIDTH}x{pairs.HEIGHT}")
        result = json.loads((self.out / "result.json").read_text())
        self.assertEqual((result["input"]["layout"], result["input"]["bits"]), ("bayer_grbg", 10))
        self.check_same(reference, write_pnm(self.directory / "l.pgm", left, maxval=1023),
                        write_pnm(self.directory / "r.pgm", right, maxval=1023), "--bayer", "grbg")


class Results(pairs.Fixture):
    def setUp(self):
        super().setUp()
        self.reconstruct()
        self.result = json.loads((self.out / "result.json").read_text())
        found = self.disparity()
        self.rows, self.columns = numpy.nonzero(numpy.isfinite(found))
        self.z_mm = FOCAL_PX * BASELINE_MM / found[self.rows, self.columns].astype(float)

    def check_points(self, x, y, z):
        """The points are the disparities, seen through the pinhole of the plan."""
        self.assertEqual(len(z), len(self.z_mm))
        self.assertLess((abs(z - self.z_mm) / self.z_mm).max(), 2e-5)
        plan = self.result["plan"]
        self.assertLess(abs(x - (self.columns - plan["cx_left_px"]) * z / FOCAL_PX).max(), 0.05)
        self.assertLess(abs(y - (self.rows - plan["cy_px"]) * z / FOCAL_PX).max(), 0.2)

    def test_ply_in_a_foreign_reader(self):
        plyfile, _ = foreign_readers.python_readers()
        ply = plyfile.PlyData.read(str(self.out / "mesh.ply"))
        self.assertEqual(ply.byte_order, "<")
        vertex = ply["vertex"]
        self.check_points(vertex["x"], vertex["y"], vertex["z"])
        normals = numpy.stack([vertex["nx"], vertex["ny"], vertex["nz"]], 1)
        self.assertLess(abs(numpy.linalg.norm(normals, axis=1) - 1).max(), 1e-3)
        self.assertLess(numpy.median(normals[:, 2]), -0.7, "normals look at the camera")
        left = cv2.imread(str(self.out / "left_rectified.png"))
        colours = numpy.stack([vertex["blue"], vertex["green"], vertex["red"]], 1)
        self.assertTrue(numpy.array_equal(colours, left[self.rows, self.columns]))
        self.assertGreater(vertex["sigma"].min(), 0)
        self.assertGreaterEqual(vertex["miss"].min(), 0)
        faces = numpy.stack(ply["face"]["vertex_indices"])
        self.assertEqual(faces.shape, (self.result["counts"]["triangles"], 3))
        self.assertTrue(0 <= faces.min() and faces.max() < len(vertex.data))
        points = numpy.stack([vertex["x"], vertex["y"], vertex["z"]], 1).astype(float)
        a, b, c = (points[faces[:, i]] for i in range(3))
        # Counter-clockwise as seen from the camera: the normal points towards it.
        facing = numpy.einsum("ij,ij->i", numpy.cross(b - a, c - a), a)
        self.assertLess(facing.max(), 0)
        depth_step = abs(points[faces][:, :, 2].max(1) - points[faces][:, :, 2].min(1))
        self.assertLess(depth_step.max(), 500, "the gap between box and wall is 2500 mm")

    def test_pcd_in_a_foreign_reader(self):
        _, pypcd4 = foreign_readers.python_readers()
        cloud = pypcd4.PointCloud.from_path(self.out / "points.pcd")
        self.assertEqual(tuple(cloud.fields), ("x", "y", "z", "rgb", "sigma"))
        values = cloud.numpy(("x", "y", "z", "sigma"))
        self.check_points(values[:, 0], values[:, 1], values[:, 2])
        self.assertGreater(values[:, 3].min(), 0)
        left = cv2.imread(str(self.out / "left_rectified.png"))[:, :, ::-1]
        colours = pypcd4.PointCloud.decode_rgb(cloud.pc_data["rgb"])
        self.assertTrue(numpy.array_equal(colours, left[self.rows, self.columns]))

    def test_glb_passes_the_khronos_validator(self):
        report = foreign_readers.validate_gltf(self.out / "mesh.glb")
        self.assertEqual(report["issues"]["numErrors"], 0, report["issues"])
        self.assertEqual(report["issues"]["numWarnings"], 0, report["issues"])
        self.assertEqual(report["info"]["totalVertexCount"], self.result["mesh"]["vertices"])
        self.assertEqual(report["info"]["totalTriangleCount"], self.result["mesh"]["triangles"])
        self.assertTrue(report["info"]["hasTextures"])

    def test_glb_stands_upright_in_metres(self):
        document, _ = foreign_readers.glb(self.out / "mesh.glb")
        node, accessor = document["nodes"][0], document["accessors"][0]
        self.assertNotIn("rotation", node)
        bounds = self.result["bounds_mm"]
        # x is unchanged, y and z are negated.
        expected_max = [bounds["max"][0], -bounds["min"][1], -bounds["min"][2]]
        for axis, millimetres in enumerate(expected_max):
            found = accessor["max"][axis] * node["scale"][axis] + node["translation"][axis]
            # Points without a triangle are omitted.
            self.assertAlmostEqual(found, millimetres / 1000, delta=2e-3)

    def test_maps_in_opencv_and_pillow(self):
        found = self.disparity()
        valid = numpy.isfinite(found)
        self.assertTrue(numpy.isposinf(found[~valid]).all())
        kitti = cv2.imread(str(self.out / "disparity.png"), cv2.IMREAD_UNCHANGED)
        self.assertEqual(kitti.dtype, numpy.uint16)
        self.assertTrue(numpy.array_equal(kitti > 0, valid))
        self.assertTrue(numpy.array_equal(kitti[valid] / 256.0, found[valid]))
        reasons = numpy.array(Image.open(self.out / "reasons.png"))
        self.assertTrue(numpy.array_equal(reasons == 0, valid))
        counted = [int((reasons == code).sum()) for code in range(9)]
        self.assertEqual(counted, list(self.result["reasons"].values()))
        for name, image in (("left", self.left), ("right", self.right)):
            rectified = cv2.imread(str(self.out / f"{name}_rectified.png"))
            self.assertTrue(numpy.array_equal(rectified, image))


if __name__ == "__main__":
    print(f"seed {pairs.SEED}")
    unittest.main()

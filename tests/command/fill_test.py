# SPDX-License-Identifier: Apache-2.0
"""vergence reconstruct --fill: what it adds to a result, where that is marked, and what stays as measured."""
import json
import unittest

import cv2
import numpy

import foreign_readers
import pairs
from pairs import BOARD, FOCAL_PX, RECTIFIED

MEASURED_FILES = ("disparity.pfm", "disparity.png", "depth.png", "points.pcd")


class Fill(pairs.Fixture):
    def run_both(self, *options):
        """Results and files without and with --fill."""
        kept = []
        for extra in ((), ("--fill",)):
            done = self.reconstruct(*RECTIFIED, *options, *extra)
            kept.append((json.loads((self.out / "result.json").read_text()), done.stdout,
                         {path.name: path.read_bytes() for path in self.out.iterdir()}))
        return kept

    def filled_pixels(self, files):
        colours = cv2.imdecode(numpy.frombuffer(files["reasons.png"], numpy.uint8), cv2.IMREAD_COLOR)
        return (colours == (0x73, 0x9e, 0x00)).all(2)  # of "filled", in BGR

    def test_filled_points_are_marked_and_not_measured(self):
        (before, _, plain), (after, summary, files) = self.run_both()
        for name in MEASURED_FILES:
            self.assertEqual(plain[name], files[name], name)
        count = after["counts"]["filled"]
        self.assertEqual(before["counts"]["filled"], 0)
        self.assertGreater(count, 100)
        self.assertEqual(after["reasons"]["filled"], count)
        self.assertEqual(after["counts"]["vertices"], before["counts"]["vertices"] + count)
        self.assertGreater(after["counts"]["triangles"], before["counts"]["triangles"])
        for key in ("density_percent", "bounds_mm", "depth_mm", "sigma_mm"):
            self.assertEqual(before[key], after[key], key)
        self.assertEqual(before["reasons"]["valid"], after["reasons"]["valid"])
        self.assertEqual(before["reasons"]["border"], after["reasons"]["border"])
        self.assertIn(f"filled      {count} more points, not measured", summary)
        self.assertIn(b"Filled", files["report.html"])
        self.assertEqual(int(self.filled_pixels(files).sum()), count)

    def test_ply_and_glb_say_which(self):
        (_, _, plain), (result, _, files) = self.run_both()
        plyfile, _ = foreign_readers.python_readers()
        vertex = plyfile.PlyData.read(str(self.out / "mesh.ply"))["vertex"]
        self.assertNotIn(b"property uchar filled", plain["mesh.ply"][:2000])
        self.assertEqual(int(vertex["filled"].sum()), result["counts"]["filled"])
        # Beside the box, the wall continues.
        columns = vertex["x"] / vertex["z"] * FOCAL_PX + result["plan"]["cx_left_px"]
        left_of_box = (vertex["filled"] == 1) & (columns < 88)
        wall_mm = numpy.median(vertex["z"][(vertex["filled"] == 0) & (columns > 190)])
        self.assertGreater(left_of_box.sum(), 100)
        self.assertLess(numpy.median(abs(vertex["z"][left_of_box] - wall_mm)), 0.05 * wall_mm)

        document, parts = foreign_readers.glb(self.out / "mesh.glb")
        self.assertEqual(document["asset"]["extras"]["filled_pixels"], result["counts"]["filled"])
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        marks = parts[attributes["_FILLED"]][::4]
        self.assertEqual(len(marks), result["mesh"]["vertices"])
        self.assertGreater(sum(marks), 50)
        self.assertLess(sum(marks), 0.6 * len(marks))
        report = foreign_readers.validate_gltf(self.out / "mesh.glb")
        self.assertEqual(report["issues"]["numErrors"], 0, report["issues"])

    def test_the_board_and_any_number_of_threads_give_the_same(self):
        grey = [self.save(name, pairs.grey(image))
                for name, image in (("l.pgm", self.left), ("r.pgm", self.right))]
        kept = []
        for program, threads in ((BOARD, 1), (BOARD, 3), (pairs.VERGENCE, 2)):
            self.reconstruct("--calibration", self.calibration_text(), "--fill", "--threads",
                             threads, program=program, left=grey[0], right=grey[1])
            kept.append([(self.out / name).read_bytes()
                         for name in ("mesh.ply", "points.pcd", "disparity.pfm")])
        self.assertEqual(kept[0], kept[1])
        self.assertEqual(kept[0], kept[2])


if __name__ == "__main__":
    unittest.main()

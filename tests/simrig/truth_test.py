# SPDX-License-Identifier: Apache-2.0
"""Truth over the socket against rays that are cut with the scene's shapes here, in closed form."""
import re
import struct
import unittest

import numpy

from simrig_client import DEPTH, LEFT, NORMAL, OBJECT, OK, SCENE, TRUTH, TRUTH_ROWS, Bench

BALL_MM, BALL_RADIUS_MM = numpy.array([-80.0, -10.0, 1650.0]), 45.0
SIZES = {DEPTH: (1, "<f4"), NORMAL: (3, "<f4"), OBJECT: (1, "u1")}
# Where bring_up() puts the window on the lit array.
COLUMN, ROW = 900, 700


def scene_with_a_ball():
    ball = ("  - solid: {name: ball, material: clay, position_mm: [-205, -10, -150], parts: "
            f"[{{ball: {{centre_mm: [0, 0, 0], radius_mm: {BALL_RADIUS_MM}}}}}]}}\n")
    board = SCENE.replace("[1200, 900]", "[3000, 2400]")  # fills the picture
    return board.replace("objects:", "  - clay: {kind: clay, colours: [[0.5, 0.4, 0.3]]}\n"
                         "objects:") + ball


def brute_force(camera, columns, rows):
    """Depth, normal and object of each pixel of the lit array, for a pinhole without lens errors."""
    def numbers(key):
        return numpy.array([float(n) for n in re.search(
            rf"^{key}: \[?([^\]\n]*)", camera, re.M)[1].split(",")])
    focal_px, centre = numbers("focal_length_px")[0], numbers("centre_px")
    turn, pupil_mm = numbers("rotation_world_camera").reshape(3, 3), numbers("pupil_mm")
    x, y = numpy.meshgrid(columns, rows)
    slopes = numpy.dstack([(x - centre[0]) / focal_px, (y - centre[1]) / focal_px,
                           numpy.ones(x.shape)])
    rays = slopes @ turn.T
    # The board: the plane z = 1800. The ball, where it is met, lies before it.
    depth = (1800 - pupil_mm[2]) / rays[..., 2]
    normal = numpy.broadcast_to(numpy.array([0.0, 0.0, -1.0]), rays.shape).copy()
    to_ball = pupil_mm - BALL_MM
    a, b = (rays ** 2).sum(-1), rays @ to_ball
    under_root = b ** 2 - a * (to_ball @ to_ball - BALL_RADIUS_MM ** 2)
    hit = under_root > 0
    near = (-b - numpy.sqrt(numpy.maximum(under_root, 0))) / a
    depth[hit] = near[hit]
    normal[hit] = ((pupil_mm + near[..., None] * rays - BALL_MM) / BALL_RADIUS_MM)[hit]
    # Scratched outlines are not compared.
    surely = numpy.abs(under_root) > 1e-3 * a * BALL_RADIUS_MM ** 2
    return depth, normal @ turn, numpy.where(hit, 2, 1), surely


class Truth(Bench):
    def setUp(self):
        super().setUp()
        self.scene.write_text(scene_with_a_ball())
        self.running = self.start("--files", self.folder, rig="perfect")
        self.board = self.running.client()
        self.board.bring_up()

    def take(self, columns=64, rows=48):
        self.board.arm(columns, rows)
        frame = self.board.frame()
        self.assertEqual(frame[5], 0)
        return frame

    def layers(self, which, first_row=0, rows=48):
        answer = self.board.ask(TRUTH_ROWS, struct.pack("<BBHH", 0, which, first_row, rows))
        columns, got_rows = struct.unpack_from("<HH", answer)
        self.assertEqual(got_rows, rows)
        at, found = 4, []
        for bit, (channels, kind) in SIZES.items():
            if which & bit:
                values = numpy.frombuffer(answer, kind, columns * rows * channels, at)
                at += values.nbytes
                found.append(values.reshape((rows, columns, channels)).squeeze(-1)
                             if channels == 1 else values.reshape((rows, columns, channels)))
        self.assertEqual(at, len(answer))
        return found

    def camera(self):
        answer = self.board.ask(TRUTH, b"\0")
        columns, rows, length = struct.unpack_from("<HHI", answer)
        depth = numpy.frombuffer(answer[8 + length:], "<f4").reshape(rows, columns)
        return answer[8:8 + length].decode(), depth

    def compare(self, found, wanted):
        depth, normal, objects, surely = wanted
        self.assertGreater(surely.mean(), 0.9)
        self.assertEqual(set(numpy.unique(objects)), {1, 2}, "both are to be seen")
        self.assertLess(numpy.abs(found[0] - depth)[surely].max(), 0.01)
        self.assertLess(numpy.abs(found[1] - normal)[surely].max(), 1e-4)
        self.assertTrue(numpy.array_equal(found[2][surely], objects[surely]))

    def test_layers_against_brute_force(self):
        self.take()
        camera, depth = self.camera()
        self.assertIn('objects: ["board", "ball"]', camera)
        found = self.layers(DEPTH | NORMAL | OBJECT)
        self.assertTrue(numpy.array_equal(found[0], depth))
        self.compare(found, brute_force(camera, COLUMN + numpy.arange(64), ROW + numpy.arange(48)))

    def test_an_earlier_frame_keeps_its_truth(self):
        begin_us = self.take()[0]
        (first,) = self.layers(DEPTH)
        self.board.control("move ball -205 -10 100")
        self.board.control("ring left zoom 500")
        self.take()
        (last,) = self.layers(DEPTH)
        self.assertFalse(numpy.array_equal(first, last))
        self.board.control(f"truth left before {begin_us + 100}")
        self.board.control("truth left now 1e12")
        before, now = ((self.folder / f"{name}.yaml").read_text() for name in ("before", "now"))
        self.assertNotEqual(before, now)
        self.board.control(f"truth left before {begin_us}")
        numpy.testing.assert_array_equal(self.layers(DEPTH)[0], first)
        self.take()
        numpy.testing.assert_array_equal(self.layers(DEPTH)[0], last)

    def test_a_mirrored_frame_has_mirrored_truth(self):
        self.take()
        plain = self.layers(DEPTH | NORMAL | OBJECT)
        # Read mode 2: rows and columns from the far end of the same window.
        self.assertEqual(self.board.write(LEFT, 0x20, 0xC000), OK)
        self.board.advance(100000)
        self.take()
        for before, now in zip(plain, self.layers(DEPTH | NORMAL | OBJECT)):
            numpy.testing.assert_allclose(before[::-1, ::-1], now, 3e-7, 1e-6)
        (part,) = self.layers(DEPTH, 3, 4)
        numpy.testing.assert_allclose(part, plain[0][::-1, ::-1][3:7], 3e-7)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Light, lens caps, lamps and printed pictures of the real process, and where a part of the picture is
sharp."""
import re
import unittest

import cv2
import numpy

from simrig_client import BRIDGE, FAILED, LEFT, OK, RIGHT, SCENE, Bench

BLACK_DN = 42
FLAT = SCENE.replace("kind: board", "kind: paper, contrast: 0").replace(
    "board: {columns: 9, rows: 7, square_mm: 40}", "gloss: 0")


class Light(Bench):
    def bring_up(self, scene, *arguments, rig="perfect"):
        self.scene.write_text(scene)
        self.running = self.start(*arguments, rig=rig)
        self.board = self.running.client()
        self.board.bring_up()

    def level(self, side=0):
        """Mean above black of the next frame of one camera."""
        self.board.write(BRIDGE, 0x20, side)
        self.board.advance(20000)
        self.board.arm(64, 48)
        return numpy.frombuffer(self.board.frame()[6], "<u2").mean() - BLACK_DN

    def test_light_changes_by_its_share_at_once_or_over_time(self):
        self.bring_up(FLAT)
        full = self.level()
        self.assertGreater(full, 40)
        self.board.control("light 0.25")
        self.assertAlmostEqual(self.level(), full / 4, delta=0.02 * full)
        now_s = self.board.time_us() * 1e-6
        self.board.control(f"at {now_s + 0.1} light 1 1")
        self.board.advance(600000)
        self.assertAlmostEqual(self.level(), full * (0.25 + 0.75 * 0.52), delta=0.05 * full)
        self.board.advance(600000)
        self.assertAlmostEqual(self.level(), full, delta=0.02 * full)
        self.assertIn("share", self.assert_rejection(FAILED, self.board.control, "light -1"))

    def test_a_cap_darkens_its_side_only(self):
        self.bring_up(FLAT)
        sides = [self.level(side) for side in (0, 1)]
        self.board.control("cap right on")
        self.assertAlmostEqual(self.level(0), sides[0], delta=0.02 * sides[0])
        self.assertAlmostEqual(self.level(1), 0, delta=0.5)
        self.board.control("cap right off")
        self.assertAlmostEqual(self.level(1), sides[1], delta=0.02 * sides[1])

    def test_a_lamp_saturates(self):
        lamp = FLAT.replace("objects:", "  - lamp: {kind: paper, contrast: 0, brightness: 5000, "
                            "colours: [[1, 1, 1]]}\nobjects:")
        lamp += ("  - sheet: {name: lamp, material: lamp, position_mm: [3000, 0, -20], "
                 "size_mm: [400, 400]}\n")
        self.bring_up(lamp)
        self.board.write(BRIDGE, 0x20, 0)
        self.assertLess(self.level(), 900)
        self.board.control("move lamp -125 0 -20")
        self.assertGreater(self.level(), 950)
        # Only what is called paper may shine.
        self.scene.write_text(SCENE.replace("kind: board,", "kind: board, brightness: 9,"))
        self.assert_refused(self.run_simrig("--scene", self.scene, "--view", self.folder), 3,
                            "only paper")

    def printed(self):
        random = numpy.random.default_rng(1)
        picture = numpy.repeat(random.integers(60, 200, (256, 256, 1), dtype=numpy.uint8), 3, 2)
        cv2.imwrite(str(self.folder / "noise.png"), picture)
        return FLAT.replace("kind: paper", "kind: painted, image: noise.png, "
                            "image_size_mm: [330, 330]")

    def contrast(self):
        self.board.advance(20000)
        self.board.arm(64, 48)
        green = numpy.frombuffer(self.board.frame()[6], "<u2").reshape(48, 64)[::2, ::2]
        return green.std()

    def test_a_print_is_sharpest_where_the_rig_says(self):
        self.bring_up(self.printed())
        for side in (LEFT, RIGHT):
            self.assertEqual(self.board.write(side, 9, 400), OK)
        self.board.control("ring left zoom 600")
        self.board.control("ring left focus 300")
        text = self.board.control("sharp left 932 700 64 48")
        best = float(re.search(r"median: {depth_mm: \S+, focus: ([\d.]+)", text)[1])
        self.assertAlmostEqual(best, 544, delta=8)
        self.assertGreater(float(re.search(r"blur_px: ([\d.]+)}", text)[1]), 20)
        found = {}
        for focus in (best - 60, best - 6, best, best + 6, best + 60):
            self.board.control(f"ring left focus {focus:.2f}")
            found[focus] = self.contrast()
        text = self.board.control("sharp left 932 700 64 48")
        order = sorted(found, key=found.get)
        self.assertEqual(order[-1], best, found)
        self.assertLess(found[best - 60], 0.5 * found[best])
        self.assertLess(found[best + 60], 0.5 * found[best])


if __name__ == "__main__":
    unittest.main()

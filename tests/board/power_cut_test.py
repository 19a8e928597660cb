# SPDX-License-Identifier: Apache-2.0
"""Power cuts (QEMU is killed) while the board writes flash: after `update` an image boots, after
`settings save` the settings are the old or the new ones, whole. VERGENCE_CUTS: how many of each, at
moments by VERGENCE_SEED; tools/campaign board makes many."""
import os
import random
import time
import unittest

from board_process import BOOT_LIMIT_S
from flash_test import SLOTS, FlashTest

CUTS = int(os.environ.get("VERGENCE_CUTS", "1"))
SEED = int(os.environ.get("VERGENCE_SEED", "1"))
# Longer than both take from their first write on.
UPDATE_S, SAVE_S = 3, 0.5
EXPOSURES_US = (9000, 5000)


class PowerCuts(FlashTest):
    def setUp(self):
        super().setUp()
        self.moments = random.Random(SEED)

    def cut_within(self, seconds):
        time.sleep(self.moments.uniform(0, seconds))
        self.cut()

    def test_an_image_is_always_whole(self):
        self.boot()
        self.assertIn("OK", self.board.type(f"update {self.newer(1)}"))
        for i in range(CUTS):
            self.board.send(f"update {self.newer(2 + i)}\r")
            self.board.wait("bytes (erased|written)", BOOT_LIMIT_S)
            self.cut_within(UPDATE_S)
            with self.subTest(cut=i, seed=SEED):
                self.assertIn(self.boot(), SLOTS.values())
                self.assertTrue(self.whole())

    def expose(self, exposure_us):
        for line in ("bringup", f"exposure {exposure_us}"):
            self.assertTrue(self.board.type(line).endswith("OK"))

    def test_settings_are_always_whole(self):
        self.boot()
        saved = []
        for exposure_us in EXPOSURES_US:
            self.expose(exposure_us)
            self.assertEqual(self.board.type("settings save")[-2:], "OK")
            saved.append(self.board.type("settings"))
        self.assertNotEqual(*saved)
        for i in range(CUTS):
            self.expose(EXPOSURES_US[i % 2])
            self.board.send("settings save\r")
            self.cut_within(SAVE_S)
            with self.subTest(cut=i, seed=SEED):
                self.boot()
                self.assertIn(self.board.type("settings"), saved)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Power cuts while the board writes flash: after one in `update` an image is whole, after one in
`settings save` the settings are the old or the new ones, whole. VERGENCE_CUTS: how many of each, at
moments by VERGENCE_SEED; tools/campaign board makes many.

In each round the last cut kills QEMU; the board then boots from what is left. For the others QEMU is
stopped and its flash file copied, which has the same bytes as after a kill at that moment. Copies of
the images are checked here by their sums, those of the store are mounted in the next boot, each as a
partition of its own."""
import hashlib
import os
import pathlib
import random
import re
import signal
import subprocess
import time
import unittest

from board_process import BOOT_LIMIT_S, COMMAND_LIMIT_S, PROMPT, child_of
from flash_test import SLOTS, FlashTest
from waiting import wait_until

CUTS = int(os.environ.get("VERGENCE_CUTS", "20"))
SEED = int(os.environ.get("VERGENCE_SEED", "1"))
ROUND = 10  # cuts of each kind before the board boots again
STORE_MB, SLOT_BYTES = 2, 4 << 20
# Where in the file, and of how many bytes.
IMAGES = 0x40000, 2 * SLOT_BYTES
STORE = sum(IMAGES), STORE_MB << 20
PARTS = 2  # of an image: kernel and root file system
WORDS = ("--args", "mtdparts=0.flash:64m(boot),256k(environment),4m(image),4m(image2),"
         f"{STORE_MB}m(store)" + "".join(f",{STORE_MB}m(s{i})" for i in range(ROUND)))
EXPOSURES_US = (9000, 5000)
KEEP_GOING = 1.1  # cuts are within so many times of what an undisturbed run took
SAVED = "/var/lib/vergence/store"


class PowerCuts(FlashTest):
    def setUp(self):
        super().setUp()
        print(f"VERGENCE_SEED={SEED} VERGENCE_CUTS={CUTS}")
        self.random = random.Random(SEED)
        self.flash = self.folder / "flash.img"
        self.start_up()
        self.images_made = 1
        self.update_s = self.timed_update()
        self.records = []
        for which in range(2):
            self.expose(which)
            begin = self.begin_save()
            self.wait_ok()
            self.save_s = time.monotonic() - begin
            self.records.append(self.record())
        self.assertNotEqual(*self.records)

    def start_up(self):
        """Where U-Boot has the image from."""
        at = self.boot(*WORDS)
        self.assertEqual(self.board.type("bringup")[-2:], "OK")
        return at

    # ---- cuts

    def wait_ok(self):
        self.board.wait(rf"[\r\n]OK[\r\n]+{PROMPT}$", COMMAND_LIMIT_S)

    def copy(self, at, size):
        """What a power cut now would leave of a part of the flash."""
        number = child_of(self.board.process, "qemu-system-arm")
        os.kill(number, signal.SIGSTOP)
        try:
            # The signal takes effect later, thread by thread.
            wait_until(lambda: all(" T " in stat.read_text(encoding="utf-8", errors="replace")
                                   for stat in pathlib.Path(f"/proc/{number}/task").glob("*/stat")),
                       timeout_s=COMMAND_LIMIT_S)
            return self.part(at, size)
        finally:
            os.kill(number, signal.SIGCONT)

    def part(self, at, size):
        with open(self.flash, "rb") as file:
            file.seek(at)
            return file.read(size)

    # ---- images

    def begin_update(self):
        self.images_made += 1
        self.board.send(f"update {self.newer(self.images_made)}\r")
        self.board.wait("bytes (erased|written)", BOOT_LIMIT_S)

    def timed_update(self):
        self.begin_update()
        begin = time.monotonic()
        self.wait_ok()
        return time.monotonic() - begin

    def cut_updates(self, count, kill):
        """Makes cuts in one update, and checks the images after each of them."""
        before = self.whole_images(self.part(*IMAGES))
        moments = sorted(self.random.uniform(0, self.update_s * KEEP_GOING) for _ in range(count))
        self.begin_update()
        begin, copies = time.monotonic(), []
        for i, moment in enumerate(moments):
            time.sleep(max(0, begin + moment - time.monotonic()))
            if kill and i + 1 == count:
                self.cut()
                copies.append(self.part(*IMAGES))
            else:
                paused = time.monotonic()
                copies.append(self.copy(*IMAGES))
                begin += time.monotonic() - paused
        if not kill:
            self.wait_ok()
        newest = max(before, key=before.get)
        after = {"torn": 0, "old": 0, "new": 0}
        for i, data in enumerate(copies):
            whole = self.whole_images(data)
            with self.subTest(update=self.images_made, cut=i, moment_s=moments[i], seed=SEED):
                self.assertEqual(whole.get(newest), before[newest])
                others = {slot: made for slot, made in whole.items() if slot != newest}
                self.assertLessEqual(set(others.values()),
                                     {self.made + self.images_made, *before.values()})
                after["torn" if not others else
                      "new" if max(others.values()) > before[newest] else "old"] += 1
        print(f"update of {self.update_s:.2f} s, {count} cuts: the other slot is", after)

    def whole_images(self, data):
        """Of the slots that U-Boot finds whole, by the sums: when the image was made."""
        found = {}
        for i, slot in enumerate(SLOTS):
            image = self.folder / "slot"
            image.write_bytes(data[i * SLOT_BYTES:(i + 1) * SLOT_BYTES])
            if all(self.sums_are_right(image, part) for part in range(PARTS)):
                found[slot] = int(subprocess.run(["fdtget", image, "/", "timestamp"],
                                                 capture_output=True, check=True).stdout)
        return found

    def sums_are_right(self, image, part):
        data = self.folder / "part"
        shown = subprocess.run(["dumpimage", "-T", "flat_dt", "-p", str(part), "-o", data, image],
                               capture_output=True, text=True, check=False)
        value = re.search("Hash value: *([0-9a-f]{64})", shown.stdout)
        return shown.returncode == 0 and value is not None and \
            value[1] == hashlib.sha256(data.read_bytes()).hexdigest()

    # ---- settings

    def expose(self, which):
        self.assertEqual(self.board.type(f"exposure {EXPOSURES_US[which]}")[-2:], "OK")

    def record(self, folder=SAVED):
        return self.board.shell(f"cat {folder}/settings")

    def begin_save(self):
        """Returns when the first byte of flash has changed, and the time."""
        before = self.part(*STORE)
        self.board.send("settings save\r")
        wait_until(lambda: self.part(*STORE) != before, timeout_s=COMMAND_LIMIT_S, interval_s=0)
        return time.monotonic()

    def cut_saves(self, count, kill):
        """Makes cuts, each in a save of its own; returns the stores after each but a killed one."""
        copies = []
        for i in range(count):
            self.expose(i % 2)
            self.begin_save()
            time.sleep(self.save_s * self.random.random() ** 2)  # most is written early
            if kill and i + 1 == count:
                self.cut()
                break
            copies.append(self.copy(*STORE))
            self.wait_ok()
        return copies

    def lay_out(self, copies):
        with open(self.flash, "r+b") as file:
            for i, data in enumerate(copies):
                file.seek(STORE[0] + (1 + i) * STORE[1])
                file.write(data)

    def check_stores(self, copies):
        self.assertIn(self.record(), self.records)
        self.board.shell("mkdir -p /mnt")
        after = {"old": 0, "new": 0, "temporary file left": 0}
        for i in range(copies):
            with self.subTest(save=i, seed=SEED):
                self.board.shell(f"mount -t jffs2 mtd:s{i} /mnt")
                record, names = self.record("/mnt"), self.board.shell("ls -A /mnt; umount /mnt")
                self.assertIn(record, self.records)
                after["new" if record == self.records[i % 2] else "old"] += 1
                after["temporary file left"] += ".new-" in names
        print(f"settings save of {self.save_s:.3f} s, {copies} cuts: the settings are", after)

    def test_images_and_settings_are_always_whole(self):
        for first in range(0, CUTS, ROUND):
            count, kill_save = min(ROUND, CUTS - first), first // ROUND % 2 == 1
            if kill_save:
                self.cut_updates(count, kill=False)
                copies = self.cut_saves(count, kill=True)
            else:
                copies = self.cut_saves(count, kill=False)
                self.cut_updates(count, kill=True)
            self.lay_out(copies)
            images = self.whole_images(self.part(*IMAGES))
            self.assertEqual(self.start_up(), SLOTS[max(images, key=images.get)])
            self.assertEqual(self.whole(), set(images))
            self.check_stores(len(copies))


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""The board's flash: `update` over TFTP writes the slots in turn, U-Boot boots the newest whole image,
then the other, then over TFTP; images that are wrong are refused."""
import os
import shutil
import signal
import subprocess
import unittest

from board_process import BOOT_LIMIT_S, IMAGE, PROMPT, ROOT, Board, BoardTest, child_of

# Where U-Boot reads the slots, and where they are in the flash bank's file.
SLOTS = {"image": 0x4040000, "image2": 0x4440000}
BANK, RAM = 0x4000000, 0x40400000
ONE_SLOT = "mtdparts=0.flash:64m(boot),256k(environment),4m(image),-(store)"
SERVER = "tftp:192.0.2.1"


class FlashTest(BoardTest):
    @classmethod
    def setUpClass(cls):
        cls.images = cls.new_folder()
        folder = IMAGE or subprocess.run([ROOT / "tools/image"], stdout=subprocess.PIPE, text=True,
                                         check=True).stdout.splitlines()[-1]
        for name in ("vergence.fit", "boot.scr"):
            shutil.copy(os.path.join(folder, name), cls.images)
        fit = (cls.images / "vergence.fit").read_bytes()
        cls.made = int(subprocess.run(["fdtget", cls.images / "vergence.fit", "/", "timestamp"],
                                      capture_output=True, check=True).stdout)
        damaged = bytearray(fit)
        damaged[len(fit) // 2] ^= 4
        (cls.images / "damaged.fit").write_bytes(damaged)
        (cls.images / "other.fit").write_bytes(fit.replace(b"vergence-virt", b"vergence-xirt"))

    def setUp(self):
        self.folder = self.new_folder()

    def newer(self, seconds):
        """Makes an image so much newer; the sums do not cover the time. Its address."""
        path = self.images / f"plus{seconds}.fit"
        shutil.copy(self.images / "vergence.fit", path)
        subprocess.run(["fdtput", "-t", "u", path, "/", "timestamp", str(self.made + seconds)],
                       check=True)
        return f"{SERVER}/{path.name}"

    def boot(self, *words):
        """Where U-Boot has the image from, once the prompt is there."""
        self.board = Board(self.folder, *words, image_folder=self.images)
        self.addCleanup(self.board.close)
        text = self.board.wait(r"Loading kernel from FIT Image at [0-9a-f]+(?= )", BOOT_LIMIT_S)
        self.board.wait(rf"{PROMPT}$", BOOT_LIMIT_S)
        return int(text.rsplit(" ", 1)[1], 16)

    def cut(self):
        """Ends the board as a power cut does."""
        os.kill(child_of(self.board.process, "qemu-system-arm"), signal.SIGKILL)
        self.board.wait_end()

    def whole(self):
        """The slots with a whole image, as the daemon sees them."""
        answer = self.board.type("update")
        return {slot for slot in SLOTS if f"slot {slot}, image vergence-virt" in answer}

    def damage(self, slot):
        with open(self.folder / "flash.img", "r+b") as file:
            file.seek(SLOTS[slot] - BANK + 1_000_000)
            file.write(bytes(100))


class Slots(FlashTest):
    def test_the_newest_whole_image_boots(self):
        self.assertEqual(self.boot(), RAM)
        self.assertEqual(self.whole(), set())
        for name, error in (("damaged", "ERR CRC"), ("other", "ERR REFUSED"), ("none", "ERR MISSING")):
            self.assertIn(error, self.board.type(f"update {SERVER}/{name}.fit"))
        self.assertEqual(self.whole(), set())
        self.assertIn("written: image\n", self.board.type(f"update {self.newer(1)}"))
        self.assertIn("written: image2\n", self.board.type(f"update {self.newer(2)}"))
        self.cut()
        self.assertEqual(self.boot(), SLOTS["image2"])
        self.assertIn("written: image\n", self.board.type(f"update {self.newer(3)}"))
        self.cut()
        self.assertEqual(self.boot(), SLOTS["image"])
        self.cut()
        self.damage("image")
        self.assertEqual(self.boot(), SLOTS["image2"])
        self.assertEqual(self.whole(), {"image2"})
        self.cut()
        self.damage("image2")
        self.assertEqual(self.boot(), RAM)

    def test_one_slot_and_tftp(self):
        self.assertEqual(self.boot("--args", ONE_SLOT), RAM)
        self.assertIn("written: image\n", self.board.type(f"update {self.newer(1)}"))
        self.cut()
        self.assertEqual(self.boot("--args", ONE_SLOT), SLOTS["image"])
        self.board.send(f"update {self.newer(2)}\r")
        self.board.wait("bytes (erased|written)", BOOT_LIMIT_S)
        self.cut()
        self.assertIn(self.boot("--args", ONE_SLOT), (RAM, SLOTS["image"]))
        self.assertIn("written: image\n", self.board.type(f"update {self.newer(2)}"))


if __name__ == "__main__":
    unittest.main()

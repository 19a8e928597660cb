# SPDX-License-Identifier: Apache-2.0
"""The command update on flash of a fake kernel: images of mkimage, checked before anything is
written; a wrong one changes nothing; and a kill at every call leaves a whole image in another
slot."""
import os
import re
import subprocess
import unittest

from daemon_process import Client
from fake_devices import DeviceTest
from tftp_server import TftpServer
from waiting import wait_until

BLOCK = 16384
SLOT = 8 * BLOCK
ITS = """/dts-v1/;
/ {{
    description = "test";
    #address-cells = <1>;
    {root}
    images {{
        kernel {{
            description = "kernel"; type = "kernel"; arch = "arm"; os = "linux";
            compression = "none"; load = <0x41000000>; entry = <0x41000000>;
            data = /incbin/("kernel"); {hash}
        }};
        ramdisk {{
            description = "files"; type = "ramdisk"; arch = "arm"; os = "linux";
            compression = "none";
            data = /incbin/("ramdisk"); hash-1 {{ algo = "sha256"; }};
        }};
    }};
    configurations {{
        default = "conf-1";
        conf-1 {{ kernel = "kernel"; ramdisk = "ramdisk"; }};
    }};
}};
"""
SHA256 = 'hash-1 { algo = "sha256"; };'


class Flash(DeviceTest):
    def setUp(self):
        super().setUp()
        os.makedirs(self.files)
        for name in ("one", "two"):
            self.write(name, b"\xff" * SLOT)

    def write(self, name, data):
        with open(self.place(name), "wb") as file:
            file.write(data)

    def read(self, name):
        with open(self.place(name), "rb") as file:
            return file.read()

    def image(self, made=1000, root='board = "tester";', sums=SHA256, size=3 * BLOCK):
        """An image of mkimage, made at this time."""
        self.write("kernel", os.urandom(size))
        self.write("ramdisk", os.urandom(BLOCK + 1))
        with open(self.place("its"), "w", encoding="ascii") as file:
            file.write(ITS.format(root=root, hash=sums))
        subprocess.run(["mkimage", "-f", self.place("its"), self.place("fit")], check=True,
                       capture_output=True, env={**os.environ, "SOURCE_DATE_EPOCH": str(made)})
        return self.read("fit")

    def tearDown(self):
        """Its end is part of many tests; how it ended is checked where that is."""

    def begin(self, slots=2, kind="", extra="", settings=("board=tester",)):
        """The daemon, with the script of its kernel."""
        script = "".join(f"mtd {name} {self.place(name)} {BLOCK} {kind}\n"
                         for name in ("one", "two"))
        self.serve(script + extra, "image_slot=one", *(["image_slot_2=two"] if slots == 2 else []),
                   "profile=two-cameras", *settings)

    def update(self, data, *words):
        """Writes this image from a file."""
        with open(os.path.join(self.files, "fit"), "wb") as file:
            file.write(data)
        return self.first.ask(" ".join(("update", "fit", *words)))

    def slots(self):
        return {slot["slot"]: slot for slot in self.asked("update")["slots"]}


class Update(Flash):
    def test_the_older_slot_is_written(self):
        self.begin()
        self.assertIn("not an image", self.slots()["one"]["reason"])
        images = {made: self.image(made) for made in (1000, 2000, 3000, 3001)}
        # Into an empty one, then into the other, then into the older one.
        for made, slot in ((2000, "one"), (3000, "two"), (3001, "one")):
            answer = self.update(images[made])
            self.assertEqual((answer[-1], answer[0]), ("OK", f"written: {slot}"))
            self.assertIn("verified: yes", answer)
            self.assertIn("device: /dev/mtd" + str(["one", "two"].index(slot)), answer)
            self.assertEqual(self.read(slot)[:len(images[made])], images[made])
        self.assertEqual(self.slots()["one"]["made"], "1970-01-01 00:50:01 UTC")
        self.assertEqual(self.slots()["two"]["size"], len(images[3000]))
        # One that would not boot, as the other slot has a newer one.
        before = self.read("one"), self.read("two")
        answer = self.update(images[1000])
        self.assertTrue(answer[0].startswith("ERR REFUSED fit: made 1970-01-01 00:16:40 UTC"))
        self.assertIn("older=yes", answer[0])
        self.assertEqual((self.read("one"), self.read("two")), before)
        self.assertEqual(self.update(images[1000], "older=yes")[-1], "OK")
        self.assertEqual(self.slots()["two"]["image"], "tester")
        self.assertEqual(self.slots()["one"]["image"], "none")

    def test_a_damaged_slot_is_written_first(self):
        image = self.image(5000)
        self.begin()
        self.update(image)
        self.update(image)
        for slot in ("two", "one"):
            for at in (1, 2 * BLOCK, 4 * BLOCK, image.rindex(b"timestamp")):
                damaged = bytearray(self.read(slot))
                damaged[at] ^= 0x40
                self.end(self.daemon)
                self.write(slot, damaged)
                self.begin()
                self.assertEqual(self.slots()[slot]["image"], "none")
                self.assertEqual(self.update(image)[0], f"written: {slot}")

    def test_over_tftp(self):
        self.begin()
        image = self.image()
        with TftpServer({"board.fit": image}, lose=0.02) as server:
            self.assertEqual(self.first.ask(f"update {server.address}/board.fit")[-1], "OK")
            self.assertEqual(self.read("one")[:len(image)], image)
            answer = self.first.ask(f"update {server.address}/none")
            self.assertIn("ERR MISSING", answer[-1])
        before = self.read("one"), self.read("two")
        with TftpServer({"board.fit": image}, dies_after=20) as server:
            answer = self.first.ask(f"update {server.address}/board.fit")
            self.assertIn("ERR TIMEOUT", answer[-1])
        for options in (True, False):
            with TftpServer({"large": bytes(SLOT + 1)}, options=options) as server:
                answer = self.first.ask(f"update {server.address}/large")
                self.assertIn(f"ERR TOO_LARGE {server.address}/large: larger than {SLOT}",
                              answer[-1])
                if options:
                    wait_until(lambda server=server: server.errors, "the server goes on")
        self.assertEqual((self.read("one"), self.read("two")), before)

    def test_wrong_images_change_nothing(self):
        self.begin()
        good = self.image()
        self.update(good)
        before = self.read("one"), self.read("two")
        damaged = bytearray(good)
        damaged[good.index(self.read("ramdisk")[:64]) + 77] ^= 1
        for data, parts in (
                (b"", ("ERR SYNTAX fit: not an image",)),
                (b"x" * 1000, ("ERR SYNTAX fit: not an image",)),
                (good[:-1], ("ERR SYNTAX fit: incomplete",)),
                (bytes(damaged), ("ERR CRC fit: damaged: the sha256 sum of ramdisk",)),
                (self.image(root='board = "other";'),
                 ('ERR REFUSED fit: made for the board "other", but this is "tester"',)),
                (self.image(root=""), ("ERR MISSING fit: ", '"board"')),
                (self.image(sums=""), ("ERR MISSING fit: kernel: no sha256 sum",)),
                (self.image(sums='hash-1 { algo = "crc32"; };'), ("kernel: no sha256 sum",)),
                (self.image(size=SLOT), ("ERR TOO_LARGE fit: larger than the slot",))):
            answer = self.update(data)
            self.assertEqual(len(answer), 1)
            for part in parts:
                self.assertIn(part, answer[0])
            self.assertEqual((self.read("one"), self.read("two")), before)
        self.assertIn("ERR MISSING", self.first.ask("update none")[0])

    def test_memory_is_checked_first(self):
        self.write("meminfo", b"MemAvailable: 1000 kB\n")
        os.environ["VERGENCE_MEMINFO"] = self.place("meminfo")
        self.addCleanup(os.environ.pop, "VERGENCE_MEMINFO")
        self.begin()
        self.assertIn("ERR MEMORY", self.update(self.image())[0])
        self.assertEqual(self.read("one"), b"\xff" * SLOT)

    def test_settings(self):
        for settings, part in ((("board=none",), 'update is disabled: "board" is not set'),
                               (("board=tester", "image_slot=none", "image_slot_2=none"),
                                'update is disabled: "image_slot" is not set')):
            self.begin(1, settings=[word for word in settings if not word.startswith("image_")])
            if len(settings) > 1:
                self.end(self.daemon)
                self.serve("", "profile=two-cameras", *settings)
            self.assertIn(part, self.first.ask("update")[0])
            self.end(self.daemon)
        self.serve(f"mtd other {self.place('one')} {BLOCK}\n", "profile=two-cameras",
                   "board=tester", "image_slot=one")
        self.assertIn('ERR MISSING no flash partition "one" in /proc/mtd (there are: other)',
                      self.first.ask("update")[0])

    def test_worn_flash_is_noticed(self):
        for slots in (2, 1):
            image = self.image()
            while image[BLOCK + 5] % 2 == 1:
                image = self.image()
            self.begin(slots, "worn")
            answer = self.update(image)
            self.assertIn("ERR VERIFY one (/dev/mtd0): differs at 0x4005", answer[0])
            self.assertIn("boot by TFTP", answer[0])
            self.end(self.daemon)

    def test_errors_of_the_flash(self):
        image = self.image()
        self.begin()
        self.update(image)
        self.end(self.daemon)
        for call, word in (("MEMERASE", "erase"), ("pwrite", "write"), ("MEMGETINFO", "not flash")):
            self.begin(extra=f"fail 1 0 EIO {call}\n")
            answer = self.update(self.image(2000))
            self.assertTrue(answer[0].startswith("ERR "), answer)
            self.assertIn(word, answer[0])
            self.assertIn("Input/output error", answer[0])
            self.assertEqual(self.read("one")[:len(image)], image)
            self.end(self.daemon)


class Readme(Flash):
    """The commands of the manual for boards."""

    def test_they_run(self):
        self.begin()
        folder = os.path.join(self.files, "surface-scene-1")
        os.mkdir(folder)
        with open(os.path.join(folder, "surface.compact"), "wb") as file:
            file.write(b"surface")
        readme = os.path.join(os.environ["VERGENCE_SOURCE"], "daemon", "manual.md")
        with open(readme, encoding="utf-8") as file:
            blocks = re.findall(r"^```sh board\n(.*?)^```", file.read(), re.S | re.M)
        lines = [line.replace("vergence --connect unix:v.sock ", "")
                 for block in blocks for line in block.splitlines()]
        self.assertEqual(len(lines), 4)
        with TftpServer({"vergence.fit": self.image()}, folders=("surface-scene-1",)) as server:
            for line in lines:
                done = self.vergence(*line.replace("tftp:192.0.2.1", server.address).split())
                self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(server.files["scene.compact"], b"surface")
            self.assertEqual(server.files["surface-scene-1/surface.compact"], b"surface")
        self.assertIn("slot one, image tester, ", done.stdout)


class PowerCut(Flash):
    """The daemon is killed at each erasing and writing: the other slot stays whole, and the slot
    itself is the old image, the new one, or recognized as neither."""

    def test_a_kill_at_every_call(self):
        old, new = self.image(1000), self.image(2000)
        kill = 0
        for what in ("MEMERASE", "pwrite"):
            for kill in range(1, 100):
                self.write("one", old.ljust(SLOT, b"\xff"))
                self.write("two", self.image(1500).ljust(SLOT, b"\xff"))
                two = self.read("two")
                # A confined process may not kill, not even itself.
                self.begin(extra=f"kill {kill} {what}\n",
                           settings=("board=tester", "confine=no"))
                with open(os.path.join(self.files, "fit"), "wb") as file:
                    file.write(new)
                with Client(self.path) as client:
                    client.send("update fit\n")
                    try:
                        killed = client.line() is None
                    except ConnectionError:
                        killed = True
                if not killed:
                    self.end(self.daemon)
                    break
                wait_until(lambda: self.daemon.poll() is not None, "not killed")
                self.daemon.returncode = 0  # as expected
                self.assertEqual(self.read("two"), two)
                self.begin()
                one = self.slots()["one"]
                if kill == 1 and what == "MEMERASE":
                    self.assertEqual(one["made"], "1970-01-01 00:16:40 UTC")
                else:
                    self.assertIn("not an image", one["reason"])
                # The next one repairs it.
                self.assertEqual(self.update(new)[0], "written: one")
                self.assertEqual(self.read("one")[:len(new)], new)
                self.end(self.daemon)
            self.assertGreater(kill, 4)


if __name__ == "__main__":
    unittest.main()

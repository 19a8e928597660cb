# SPDX-License-Identifier: Apache-2.0
"""What the daemon has told to be there is there after a power loss: names are synced with their
directories, in the order of the calls that a fake kernel notes."""
import os
import unittest

from fake_devices import HEIGHT, WIDTH, DeviceTest


class Durable(DeviceTest):
    def setUp(self):
        super().setUp()
        self.record, self.read = self.place("record"), 0
        self.serve(f"{self.cameras()}watch {self.files}\nrecord {self.record}\n",
                   "profile=two-cameras", f"rig.width_px={WIDTH}", f"rig.height_px={HEIGHT}")

    def calls(self):
        """Those since the last asking, without what cameras do."""
        with open(self.record, encoding="ascii") as file:
            lines = [line for line in file.read().splitlines() if not line.startswith("video")]
        new, self.read = lines[self.read:], len(lines)
        return new

    def in_order(self, *wanted):
        """The calls have these among them, one after the other."""
        calls = self.calls()
        at = 0
        for line in wanted:
            self.assertIn(line, calls[at:], calls)
            at = calls.index(line, at) + 1

    def test_names_are_synced_before_they_are_told(self):
        self.in_order("files mkdir", ".. fsync")
        path = os.path.join(self.files, self.asked("bugreport")["file"])
        name = os.path.basename(path)
        self.assertTrue(os.path.exists(path))
        self.in_order(f".{name}.part fsync", f"files rename .{name}.part {name}", ". fsync")
        self.asked("record start r")
        self.in_order("session.index fsync", "r fsync", ".. fsync",
                      "calls.log open wronly create excl cloexec", "r fsync")

    def test_what_cannot_be_synced_is_told(self):
        self.end(self.daemon)
        # That of the directory above, at the start, is the first of these.
        self.serve(f"{self.cameras()}watch {self.files}\nfail 2 2 EIO . fsync\n",
                   "profile=two-cameras", f"rig.width_px={WIDTH}", f"rig.height_px={HEIGHT}")
        self.assertRegex(self.first.ask("bugreport")[-1],
                         r"^ERR IO bugreport-[-0-9a-zA-Z.]*: Input/output error$")
        self.refused("record start r",
                     "ERR IO r/session.index: cannot be written: Input/output error")
        self.asked("record start r")
        self.asked("bugreport")


if __name__ == "__main__":
    unittest.main()

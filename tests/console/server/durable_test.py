# SPDX-License-Identifier: Apache-2.0
"""What the daemon or its client has reported as stored survives a power loss: names are synced with
their directories, in the order of the calls that a fake kernel records."""
import os
import unittest

from fake_devices import HEIGHT, WIDTH, DeviceTest, preloaded


class Calls(DeviceTest):
    """The record of one program's fake kernel."""

    def setUp(self):
        super().setUp()
        self.record, self.read = self.place("record"), 0

    def calls(self):
        """Calls since the last read, without those of cameras."""
        with open(self.record, encoding="ascii") as file:
            lines = [line for line in file.read().splitlines() if not line.startswith("video")]
        new, self.read = lines[self.read:], len(lines)
        return new

    def in_order(self, *wanted):
        """The calls contain these, in this order."""
        calls = self.calls()
        at = 0
        for line in wanted:
            self.assertIn(line, calls[at:], calls)
            at = calls.index(line, at) + 1


class Durable(Calls):
    def setUp(self):
        super().setUp()
        self.serve(f"{self.cameras()}watch {self.files}\nrecord {self.record}\n",
                   "profile=two-cameras", f"rig.width={WIDTH}px", f"rig.height={HEIGHT}px")

    def test_names_are_synced_before_they_are_reported(self):
        self.in_order("files mkdir", ".. fsync")
        path = os.path.join(self.files, self.asked("bugreport")["file"])
        name = os.path.basename(path)
        self.assertTrue(os.path.exists(path))
        temporary = f".vergence-{self.daemon.pid}-0"
        self.in_order(f"{temporary} fsync", f"files rename {temporary} {name}", ". fsync")
        self.asked("record start r")
        self.in_order("session.index fsync", "r fsync", ".. fsync",
                      "calls.log open wronly create excl cloexec", "r fsync")

    def test_a_failed_sync_is_reported(self):
        self.end(self.daemon)
        # The first is the sync of the parent directory at the start.
        self.serve(f"{self.cameras()}watch {self.files}\nfail 2 2 EIO . fsync\n",
                   "profile=two-cameras", f"rig.width={WIDTH}px", f"rig.height={HEIGHT}px")
        self.assertRegex(self.first.ask("bugreport")[-1],
                         r"^ERR IO bugreport-[-0-9a-zA-Z.]*: Input/output error$")
        self.refused("record start r",
                     "ERR IO r/session.index: cannot be written: Input/output error")
        self.asked("record start r")
        self.asked("bugreport")


class Fetched(Calls):
    """The client's files."""

    def setUp(self):
        super().setUp()
        self.here = self.place("here")
        os.mkdir(self.here)
        self.serve(self.cameras(), "profile=two-cameras", f"rig.width={WIDTH}px",
                   f"rig.height={HEIGHT}px")
        os.mkdir(os.path.join(self.files, "s"))
        for name in ("one", "s/two"):
            with open(os.path.join(self.files, name), "wb") as file:
                file.write(bytes(100000))

    def fetch(self, *words, more=""):
        """Fetches with the fake kernel under the client."""
        with open(self.place("client"), "w", encoding="ascii") as file:
            file.write(f"watch {self.here}\nrecord {self.record}\n{more}")
        return self.vergence("fetch", *words, cwd=self.here, env=preloaded(self.place("client")))

    def test_a_fetched_file_is_synced_before_it_has_its_name(self):
        done = self.fetch("one", f"{self.here}/one")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.in_order("one.part write 49152", "one.part fsync", "one.part rename one", ". fsync")
        # A relative path has a directory, too; the fake kernel handles only absolute paths.
        done = self.fetch("one", "again")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        done = self.fetch("s", f"{self.here}/s")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.in_order("s mkdir", ".. fsync", "two.part fsync", "two.part rename two", ". fsync")

    def test_a_failed_sync_is_reported_and_the_file_kept(self):
        for call, left in (("one.part fsync", "one.part"), (". fsync", "one")):
            done = self.fetch("one", f"{self.here}/one", more=f"fail 1 1 EIO {call}\n")
            self.assertEqual((done.returncode, done.stdout, done.stderr),
                             (1, "", f"vergence: {self.here}/one: Input/output error\n"))
            self.assertEqual(os.listdir(self.here), [left])
        done = self.fetch("s", f"{self.here}/s", more="fail 1 1 EIO .. fsync\n")
        self.assertEqual((done.returncode, done.stdout, done.stderr),
                         (1, "", f"vergence: {self.here}/s: Input/output error\n"))


if __name__ == "__main__":
    unittest.main()

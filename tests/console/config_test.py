# SPDX-License-Identifier: Apache-2.0
"""Settings: what is wrong in a file is said with its line; the example in the tree has all keys."""
import os
import subprocess
import tempfile
import unittest

VERGENCED = os.environ["VERGENCED"]
EXAMPLE = os.path.join(os.environ["VERGENCE_SOURCE"], "daemon", "vergenced.conf")


def run(*words):
    return subprocess.run([VERGENCED, *words], capture_output=True, text=True, timeout=60)


class Config(unittest.TestCase):
    def check(self, text):
        with tempfile.NamedTemporaryFile("w", suffix=".conf") as file:
            file.write(text)
            file.flush()
            done = run("--check", file.name)
            return done.returncode, (done.stdout + done.stderr).replace(file.name, "FILE")

    def refused(self, text, sentence):
        code, said = self.check(text)
        self.assertEqual((code, said), (3, f"vergenced: {sentence}\n"))

    def test_the_example_is_what_the_program_prints_and_is_good(self):
        with open(EXAMPLE, encoding="utf-8") as file:
            self.assertEqual(file.read(), run("--help-config").stdout,
                             "make it anew: vergenced --help-config > daemon/vergenced.conf")
        done = run("--check", EXAMPLE)
        self.assertEqual((done.returncode, done.stdout), (0, f"{EXAMPLE}: good\n"), done.stderr)

    def test_what_is_wrong_is_said_with_its_line(self):
        self.refused("\n# x\nprofil = rig\n",
                     'FILE:3: there is no key "profil"; did you mean "profile"?')
        self.refused("profile = dome\n", 'FILE:1: profile "dome": expected is one of: rig '
                     "two-cameras two-cameras-lens")
        self.refused("socket\n", 'FILE:1: "socket": expected is key = value')
        self.refused("socket =   # none\n", "FILE:1: socket: the value is missing")
        self.refused("clients = 0\n", "FILE:1: clients 0 is out of range: from 1 to 32")
        self.refused("clients = many\n",
                     'FILE:1: clients "many" is no whole number: expected is 1 to 32')
        self.refused("rig.width_px = 99999", "FILE:1: rig.width_px 99999 is out of range: from 16 "
                     "to 16384 px")
        self.refused("queue = 3\nqueue = 4\n", "FILE:2: queue was set in line 1 already")
        self.refused("confine = maybe\n", 'FILE:1: confine "maybe": expected is one of: no yes')
        self.refused("backend = simulator\n",
                     'FILE:1: backend "simulator": expected is linux, sim unix:PATH, sim '
                     "tcp:HOST:PORT or replay DIRECTORY")
        self.refused("rig.pan_least_urad = 10\nrig.pan_most_urad = 5\n",
                     "FILE:1: rig.pan_least_urad does not go with the rest of the profile: a value "
                     "is outside its legal range")
        self.refused("rig.frame_us = 5000\nprofile = rig\n",
                     "FILE:2: profile must stand above rig.frame_us (line 1), which it would undo")
        self.refused("rig.lens_backlash_counts = 5\nrig.lenses = v1lc\n",
                     "FILE:2: rig.lenses must stand above rig.lens_backlash_counts (line 1), which "
                     "it would undo")
        self.refused("i2c = none\n", "FILE:1: i2c is none, but the profile rig needs it with "
                     "backend = linux")
        self.refused("files = " + 300 * "x", "FILE:1: files is too long: at most 255 characters")
        # What the system's sockets can have, less the four letters that it has until it listens.
        self.refused("socket = /" + 103 * "x", "FILE:1: socket is too long: at most 103 characters")
        self.refused(600 * "x", "FILE:1: the line is too long, or this is no text file")

    def test_what_is_right(self):
        for text in ("", "# nothing\n\n", "  clients=2 # two\r\ntcp_port = off\n",
                     "profile = two-cameras\nrig.width_px = 1280\nrig.height_px = 720\n",
                     "backend = sim unix:/run/x.sock\nsocket = none\nlog_level = debug",
                     "reset_line = 0x11\ngpio_chip = /dev/gpiochip1\n"):
            self.assertEqual(self.check(text), (0, "FILE: good\n"), text)

    def test_no_file(self):
        done = run("--check", "no/such.conf")
        self.assertEqual((done.returncode, done.stderr),
                         (3, "vergenced: no/such.conf: No such file or directory\n"))
        done = run("--config", "no/such.conf")
        self.assertEqual(done.returncode, 3)

    def test_the_command_line_changes_a_setting(self):
        done = run("clients=99")
        self.assertEqual((done.returncode, done.stderr),
                         (3, "vergenced: clients 99 is out of range: from 1 to 32\n"))
        done = run("clients")
        self.assertEqual((done.returncode, done.stderr),
                         (3, 'vergenced: "clients": expected is KEY=VALUE\n'))


if __name__ == "__main__":
    unittest.main()

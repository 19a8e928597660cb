# SPDX-License-Identifier: Apache-2.0
"""Profile files: the shipped ones equal the built-in ones; errors are reported with their line;
recordings of a custom instrument replay without its file."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest

from daemon_process import PATIENCE_S, VERGENCE, VERGENCED
from played_pairs import PlayedPairs, lines_of, write_index

SHIPPED = os.path.join(os.environ["VERGENCE_SOURCE"], "daemon", "install", "profiles")
NAMES = ("rig", "two-cameras", "two-cameras-lens")


def run(*words, cwd=None):
    done = subprocess.run([VERGENCED, *words], capture_output=True, text=True, timeout=60, cwd=cwd)
    return done.returncode, done.stdout + done.stderr


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="profile")
        self.addCleanup(shutil.rmtree, self.folder)
        self.profile = self.put("own.profile", "like = rig\n")
        self.config = self.put("v.conf", "profile = own.profile\n")

    def put(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as file:
            file.write(text.encode() if isinstance(text, str) else text)
        return path

    def check(self, path, *words, **options):
        code, said = run("--check", path, *words, **options)
        return code, said.replace(self.folder + "/", "").strip()

    def refused(self, profile, sentence):
        """Checks the settings that name it, and the profile alone."""
        self.put("own.profile", profile)
        self.assertEqual(self.check(self.config), (3, f"vergenced: v.conf:1: {sentence}"))
        self.assertEqual(self.check(self.profile), (3, f"vergenced: {sentence}"))

    def test_the_shipped_ones_are_those_that_are_built_in(self):
        self.assertEqual(sorted(os.listdir(SHIPPED)), sorted(f"{name}.profile" for name in NAMES))
        for name in NAMES:
            path = os.path.join(SHIPPED, f"{name}.profile")
            with open(path, encoding="utf-8") as file:
                self.assertEqual(file.read(), run("--help-profile", name)[1],
                                 f"make it anew: vergenced --help-profile {name} > {path}")
            self.assertEqual(run("--check", path), (0, f"{path}: good\n"))
        self.assertEqual(run("--help-profile", "dome"), (
            3, 'vergenced: --help-profile "dome": expected is one of: rig two-cameras '
            "two-cameras-lens\n"))

    def test_errors_are_reported_with_their_line(self):
        for text, sentence in (
                ("like = rig\nwidth_px = 99999\n",
                 "own.profile:2: width_px 99999 is out of range: from 16 to 16384 px"),
                ("# x\nlike = rig\nwidht_px = 640\n",
                 'own.profile:3: there is no key "widht_px"; did you mean "width_px"?'),
                ("lik = rig\n", 'own.profile:1: there is no key "lik"; did you mean "like"?'),
                ("like = rig\nrig.width_px = 640\n",
                 'own.profile:2: there is no key "rig.width_px"; see vergenced --help-profile rig'),
                ("like = rig\nsocket = none\n",
                 'own.profile:2: there is no key "socket"; see vergenced --help-profile rig'),
                ("like = rig\nprofile = rig\n",
                 'own.profile:2: there is no key "profile"; see vergenced --help-profile rig'),
                ("like = dome\n", 'own.profile:1: like "dome": expected is one of: rig two-cameras '
                 "two-cameras-lens"),
                ("like = own.profile\n", 'own.profile:1: like "own.profile": expected is one of: '
                 "rig two-cameras two-cameras-lens"),
                ("", "own.profile: like is missing; its first line is: like = rig, two-cameras or "
                 "two-cameras-lens, which it begins with"),
                ("width_px = 640\n", "own.profile: like is missing; its first line is: like = rig, "
                 "two-cameras or two-cameras-lens, which it begins with"),
                ("width_px = 640\nlike = rig\n",
                 "own.profile:2: like must stand above width_px (line 1), which it would undo"),
                ("like = rig\nlens_backlash_counts = 5\nlenses = v1lc\n",
                 "own.profile:3: lenses must stand above lens_backlash_counts (line 2), which it "
                 "would undo"),
                ("like = rig\nlike = rig\n", "own.profile:2: like was set in line 1 already"),
                ("like = rig\nservos\n", 'own.profile:2: "servos": expected is key = value'),
                ("like = rig\nservos = perhaps\n",
                 'own.profile:2: servos "perhaps": expected is one of: no yes'),
                ("like = rig\nwidth_px = 4000\n",
                 "own.profile:2: width_px 4000 does not go with bridge yes: it must be an even "
                 "number from 16 to 2048 px"),
                ("like = rig\nname = two-cameras\n",
                 "own.profile:2: name two-cameras: that is another profile, and this one is like "
                 "rig: give it a name of its own"),
                ("like = rig\nname = " + 32 * "x", f'own.profile:2: name "{32 * "x"}": expected '
                 "are 1 to 31 letters, digits, - _ and ., a letter or a digit first"),
                ("like = rig\nname = a/b", 'own.profile:2: name "a/b": expected are 1 to 31 '
                 "letters, digits, - _ and ., a letter or a digit first"),
                ("like = rig\nname = .b", 'own.profile:2: name ".b": expected are 1 to 31 letters, '
                 "digits, - _ and ., a letter or a digit first"),
                ("like = rig\nname = \u00e4", 'own.profile:2: name "\u00e4": expected are 1 to 31 '
                 "letters, digits, - _ and ., a letter or a digit first"),
                ("like = rig\n" + 600 * "#",
                 "own.profile:2: the line is too long, or this is no text file"),
                ("like = rig\nname = a\0b\n",
                 "own.profile:2: the line is too long, or this is no text file"),
                (b"\x7fELF\x02\x01\x01\0\0\0",
                 "own.profile:1: the line is too long, or this is no text file"),
                (1000000 * "#\n", "own.profile: is no file of settings: longer than 65536")):
            with self.subTest(text[:60]):
                self.refused(text, sentence)

    def test_a_path_that_is_not_a_file(self):
        os.unlink(self.profile)
        none = "own.profile: No such file or directory"
        self.assertEqual(self.check(self.config), (3, f"vergenced: v.conf:1: {none}"))
        self.assertEqual(self.check(self.profile), (3, f"vergenced: {none}"))
        os.mkdir(self.profile)
        directory = "own.profile: not a regular file (directory)"
        self.assertEqual(self.check(self.config), (3, f"vergenced: v.conf:1: {directory}"))
        os.rmdir(self.profile)
        os.mkfifo(self.profile)
        pipe = "own.profile: not a regular file (device or pipe)"
        self.assertEqual(self.check(self.config), (3, f"vergenced: v.conf:1: {pipe}"))
        self.assertEqual(run(f"profile={self.folder}/{250 * 'x'}.profile", "socket=none")[0], 3)

    def test_valid_profiles(self):
        for text in ("like = rig",
                     "\ufeff# one\r\n like=two-cameras-lens # begins\r\nname = bench-2.b\r\n",
                     "like = two-cameras\nname = wide\nwidth_px = 4000\nheight_px = 3000\n",
                     "like = two-cameras\nlenses = v1lc\nlens_backlash_counts = 5\n",
                     "like = rig\nname = rig\nservos = no\n"):
            self.put("own.profile", text)
            self.assertEqual(self.check(self.config), (0, "v.conf: good"))
            self.assertEqual(self.check(self.profile), (0, "own.profile: good"))

    def test_a_profile_stands_beside_its_settings(self):
        for value in ("own.profile", "./own.profile", self.profile):
            self.put("v.conf", f"profile = {value}\n")
            for cwd in (self.folder, "/"):
                self.assertEqual(self.check(self.config, cwd=cwd), (0, "v.conf: good"))
        # On the command line it is relative to the current directory.
        self.assertEqual(run("--check", "/dev/null", "profile=own.profile", cwd=self.folder),
                         (0, "/dev/null: good\n"))
        self.assertEqual(run("--check", "/dev/null", "profile=own.profile", cwd="/"),
                         (3, "vergenced: own.profile: No such file or directory\n"))
        # Any name is accepted if it contains a /.
        os.rename(self.profile, os.path.join(self.folder, "own"))
        self.put("v.conf", "profile = ./own\n")
        self.assertEqual(self.check(self.config), (0, "v.conf: good"))

    def test_settings_change_it(self):
        self.put("own.profile", "like = two-cameras\nwidth_px = 4000\n")
        self.put("v.conf", "profile = own.profile\nrig.bridge = yes\n")
        self.assertEqual(self.check(self.config), (
            3, "vergenced: v.conf:2: rig.bridge yes does not go with rig.width_px 4000, which must "
            "be an even number from 16 to 2048 px"))
        self.put("v.conf", "rig.width_px = 640\nprofile = own.profile\n")
        self.assertEqual(self.check(self.config), (
            3, "vergenced: v.conf:2: profile must stand above rig.width_px (line 1), which it "
            "would undo"))
        self.put("v.conf", "profile = own.profile\nrig.width_px = 8000\nrig.name = wide\n")
        self.assertEqual(self.check(self.config), (0, "v.conf: good"))
        # An argument replaces the line, so the file that the line names is not read.
        self.assertEqual(self.check(self.config, "profile=rig", "rig.width_px=640"),
                         (0, "v.conf: good"))


class OwnInstrument(PlayedPairs):
    """Two cameras with a profile file that is deleted once the daemon runs."""

    @classmethod
    def arguments(cls):
        cls.profile = os.path.join(cls.folder, "own.profile")
        with open(cls.profile, "w", encoding="ascii") as file:
            file.write("like = two-cameras\nname = bench-2\nwidth_px = 672\nheight_px = 400\n")
        cls.settings = (f"profile={cls.profile}", "rig.skew_limit_us=5000000")
        return super().arguments()

    @classmethod
    def start(cls):
        super().start()
        os.unlink(cls.profile)

    def test_its_name_and_what_it_is(self):
        self.assertEqual(self.first.ask("status")[1], "profile: bench-2")
        shown = self.first.ask("config")
        for line in (f"profile: {self.profile}", "rig.name: bench-2", "rig.width_px: 672",
                     "rig.skew_limit_us: 5000000"):
            self.assertIn(line, shown)

    def test_what_it_records_plays_without_its_file(self):
        commands = ["bringup", "window 672 400", "exposure 7000", "capture"]
        self.record("own", commands)
        folder = os.path.join(self.files, "own")
        lines = lines_of(folder)
        self.assertIn("profile=bench-2", lines[0].split())
        self.assertEqual([line[len("setting text="):].replace("%20", " ") for line in lines
                          if line.startswith("setting ")],
                         ["profile = two-cameras", "rig.name = bench-2", "rig.width_px = 672",
                          "rig.height_px = 400", "rig.skew_limit_us = 5000000"])
        answer = self.first.ask_json("replay own")
        self.assertTrue(answer["ok"], answer)
        self.assertEqual((answer["result"]["commands"], answer["result"]["pairs"]), (4, 1))
        done = subprocess.run([VERGENCE, "replay", folder, "--json"], capture_output=True,
                              text=True, timeout=PATIENCE_S)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertTrue(json.loads(done.stdout)["same"])
        # A daemon that replays it is that instrument, whatever its settings say.
        for words in ((), ("profile=rig",), ("profile=two-cameras", "rig.width_px=64")):
            done = subprocess.run(
                [VERGENCED, f"backend=replay {folder}", "socket=none", "console=stdio",
                 f"files={self.files}", "store=none", *words],
                input="status\nbringup\nwindow 672 400\nexposure 7000\ncapture again\n", text=True,
                capture_output=True, timeout=PATIENCE_S)
            self.assertIn("profile: bench-2", done.stdout, done.stderr)
            ends = [line for line in done.stdout.splitlines() if line[:3] in ("OK", "ERR")]
            self.assertEqual(ends, 5 * ["OK"], done.stdout + done.stderr)
            shutil.rmtree(os.path.join(self.files, "again"))

    def test_a_recording_opens_no_file(self):
        """Replaying another user's session opens no file that it names."""
        self.record("spoiled", ["bringup"])
        folder = os.path.join(self.files, "spoiled")
        lines = lines_of(folder)
        secret = os.path.join(self.folder, "secret.profile")
        with open(secret, "w", encoding="ascii") as file:
            file.write("like = two-cameras\nname = bench-2\n")
        for text, said in (
                (f"profile%20=%20{secret}", "expected is one of: rig two-cameras"),
                (f"files%20=%20{secret}", '"files" is not an instrument setting'),
                ("profile%20=%20rig", "an I2C bus, which was not recorded")):
            write_index(folder, [line.replace("profile%20=%20two-cameras", text) for line in lines])
            answer = self.first.ask_json("replay spoiled")
            self.assertFalse(answer["ok"])
            self.assertIn(said, answer["message"])
        write_index(folder, [line for line in lines if not line.startswith("setting ")])
        self.assertIn("profile bench-2",
                      self.first.ask_json("replay spoiled")["message"])


if __name__ == "__main__":
    unittest.main()

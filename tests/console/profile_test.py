# SPDX-License-Identifier: Apache-2.0
"""Profiles as files: the shipped ones equal the built-in ones; errors name their line; a recording of
an instrument with its own profile plays without the file."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest

from daemon_process import TIMEOUT_S, VERGENCE, VERGENCED
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
        code, output_text = run("--check", path, *words, **options)
        return code, output_text.replace(self.folder + "/", "").strip()

    def refused(self, profile, begin, *parts):
        """Checks the settings that name it, and the profile alone."""
        self.put("own.profile", profile)
        for path, prefix in ((self.config, "vergenced: v.conf:1: "), (self.profile, "vergenced: ")):
            code, output_text = self.check(path)
            output_text = output_text.splitlines()[-1]
            self.assertEqual((code, output_text[:len(prefix + begin)]), (3, prefix + begin))
            for part in parts:
                self.assertIn(part, output_text)

    def test_the_shipped_ones_are_those_that_are_built_in(self):
        self.assertEqual(sorted(os.listdir(SHIPPED)), sorted(f"{name}.profile" for name in NAMES))
        for name in NAMES:
            path = os.path.join(SHIPPED, f"{name}.profile")
            with open(path, encoding="utf-8") as file:
                self.assertEqual(file.read(), run("--help-profile", name)[1],
                                 f"regenerate it: vergenced --help-profile {name} > {path}")
            self.assertEqual(run("--check", path), (0, f"{path}: good\n"))
        code, output_text = run("--help-profile", "dome")
        self.assertEqual((code, output_text.count("\n")), (3, 1))
        self.assertIn('"dome" (expected one of: rig two-cameras two-cameras-lens)', output_text)

    def test_errors_name_their_line(self):
        bad_name = "1 to 31 letters, digits, - _ and ."
        for text, *parts in (
                ("like = rig\nwidth = 99999 px\n", "own.profile:2: width = 99999 px",
                 "16 to 16384 px"),
                ("like = rig\nwidth = 640\n", "own.profile:2: width = 640: unit missing", "px"),
                ("# x\nlike = rig\nwidht = 640 px\n", 'own.profile:3: unknown key "widht"', '"width"'),
                ("lik = rig\n", 'own.profile:1: unknown key "lik"', '"like"'),
                ("like = rig\nsocket = none\n", 'own.profile:2: unknown key "socket"',
                 "--help-profile rig"),
                ("like = rig\nprofile = rig\n", 'own.profile:2: unknown key "profile"',
                 "--help-profile rig"),
                ("like = dome\n", "own.profile:1: ", 'like "dome"', "two-cameras-lens)"),
                ("like = own.profile\n", "own.profile:1: ", 'like "own.profile"',
                 "two-cameras-lens)"),
                ("", "own.profile: like missing", "two-cameras-lens"),
                ("width = 640 px\n", "own.profile: like missing", "two-cameras-lens"),
                ("like = rig\nlens_zoom_max = 1000 counts\n", "own.profile:2: ", "lens_zoom_max = 1000 counts",
                 "301 to 999 counts"),
                ("like = rig\nlenses = v2lc\n", "own.profile:2: ", '"v2lc"', "fixed v3lc v1lc"),
                ("like = rig\nlike = rig\n", "own.profile:2: duplicate key like", "line 1"),
                ("like = rig\nservos\n", "own.profile:2: ", "key = value"),
                ("like = rig\nservos = perhaps\n", "own.profile:2: ", 'servos "perhaps"', "no yes"),
                ("like = rig\nwidth = 4000 px\n", "own.profile:2: rig.width = 4000 px ", "bridge = yes",
                 "an even number, 16 to 2048 px"),
                ("like = rig\nname = two-cameras\n", "own.profile:2: rig.name = two-cameras", "based on rig"),
                ("like = rig\nname = " + 32 * "x", "own.profile:2: ", 32 * "x", bad_name),
                ("like = rig\nname = a/b", "own.profile:2: ", '"a/b"', bad_name),
                ("like = rig\nname = .b", "own.profile:2: ", '".b"', bad_name),
                ("like = rig\nname = \u00e4", "own.profile:2: ", '"\u00e4"', bad_name),
                ("like = rig\n" + 600 * "x", "own.profile:2: line too long"),
                ("like = rig\nname = a\0b\n", "own.profile:2: ", "not a text file"),
                (b"\x7fELF\x02\x01\x01\0\0\0", "own.profile:1: ", "not a text file"),
                (1000000 * "#\n", "own.profile: too large", "65535")):
            with self.subTest(text[:60]):
                self.refused(text, *parts)

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
                     "like = two-cameras\nname = wide\nwidth = 4000 px\nheight = 3000px\n",
                     "like = two-cameras\nlenses = v1lc\nlens_backlash = 5 counts\n",
                     "like = rig\nlens_focus_tolerance = 2 counts\nlens_tolerance = 5 counts\n"
                     "lens_baud = 19200\nlens_zoom_min = 250 counts\nlens_iris_approach = above\n",
                     "width = 640 px\n[rig]\nheight = 480 px\n[]\nlike = two-cameras\nrig.name = a\n",
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
        self.put("own.profile", "like = two-cameras\nwidth = 4000 px\n")
        self.put("v.conf", "profile = own.profile\nrig.bridge = yes\n")
        code, output_text = self.check(self.config)
        self.assertEqual(code, 3)
        self.assertRegex(output_text, "v.conf:2: rig.width = 4000 px .*rig.bridge = yes .*even number, 16 to "
                         "2048 px")
        self.put("v.conf", "rig.width = 640 px\nprofile = own.profile\n")
        self.assertEqual(self.check(self.config), (0, "v.conf: good"))
        self.put("v.conf", "profile = own.profile\nrig.width = 8000 px\nrig.name = wide\n")
        self.assertEqual(self.check(self.config), (0, "v.conf: good"))
        # An argument replaces the line; the file that the line names is not used.
        self.assertEqual(self.check(self.config, "profile=rig", "rig.width=640px"),
                         (0, "v.conf: good"))

    def test_profiles_of_older_versions_are_read(self):
        self.put("own.profile", "like = rig\nname = old\nwidth_px = 0x280\n")
        for path, last in ((self.profile, "own.profile: good"), (self.config, "v.conf: good")):
            code, output_text = self.check(path)
            self.assertEqual((code, output_text.count("\n")), (0, 1), output_text)
            self.assertRegex(output_text, "own.profile:3: .*: write width = 640 px")
            self.assertIn(last, output_text)
        # An old name and the current one are one key.
        self.refused("like = rig\nwidth_px = 640\nwidth = 640 px\n", "own.profile:3: ", "width",
                     "line 2")


class OwnInstrument(PlayedPairs):
    """Two cameras with a profile file that is deleted once the daemon runs."""

    @classmethod
    def arguments(cls):
        cls.profile = os.path.join(cls.folder, "own.profile")
        with open(cls.profile, "w", encoding="ascii") as file:
            file.write("like = two-cameras\nname = bench-2\nwidth = 672 px\nheight = 400 px\n")
        cls.settings = (f"profile={cls.profile}", "rig.skew_limit=5s")
        return super().arguments()

    @classmethod
    def start(cls):
        super().start()
        os.unlink(cls.profile)

    def test_its_name_and_what_it_is(self):
        self.assertEqual(self.first.ask("status")[1], "profile: bench-2")
        shown = self.first.ask("config")
        for line in (f"profile: {self.profile}", "rig.name: bench-2", "rig.width: 672 px",
                     "rig.skew_limit: 5000 ms"):
            self.assertIn(line, shown)

    def test_what_it_records_plays_without_its_file(self):
        commands = ["bringup", "window 672 400", "exposure 7000", "capture"]
        self.record("own", commands)
        folder = os.path.join(self.files, "own")
        lines = lines_of(folder)
        self.assertIn("profile=bench-2", lines[0].split())
        self.assertEqual([line[len("setting text="):].replace("%20", " ") for line in lines
                          if line.startswith("setting ")],
                         ["profile = two-cameras", "rig.name = bench-2", "rig.width = 672 px",
                          "rig.height = 400 px", "rig.skew_limit = 5000 ms"])
        answer = self.first.ask_json("replay own")
        self.assertTrue(answer["ok"], answer)
        self.assertEqual((answer["result"]["commands"], answer["result"]["pairs"]), (4, 1))
        done = subprocess.run([VERGENCE, "replay", folder, "--json"], capture_output=True,
                              text=True, timeout=TIMEOUT_S)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertTrue(json.loads(done.stdout)["same"])
        # A daemon that plays it is that instrument, whatever its settings say.
        for words in ((), ("profile=rig",), ("profile=two-cameras", "rig.width=64px")):
            done = subprocess.run(
                [VERGENCED, f"backend=replay {folder}", "socket=none", "console=stdio",
                 f"files={self.files}", "store=none", *words],
                input="status\nbringup\nwindow 672 400\nexposure 7000\ncapture again\n", text=True,
                capture_output=True, timeout=TIMEOUT_S)
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
        for text, output_text in (
                (f"profile%20=%20{secret}", "expected one of: rig two-cameras"),
                (f"files%20=%20{secret}", 'unknown profile "bench-2"'),
                ("profile%20=%20rig", "an I2C bus, which was not recorded")):
            write_index(folder, [line.replace("profile%20=%20two-cameras", text) for line in lines])
            answer = self.first.ask_json("replay spoiled")
            self.assertFalse(answer["ok"])
            self.assertIn(output_text, answer["message"])
        write_index(folder, [line for line in lines if not line.startswith("setting ")])
        self.assertIn('profile "bench-2"',
                      self.first.ask_json("replay spoiled")["message"])


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Arguments of the command line and of a session's options.json that tools/regress rejects."""
import re
import unittest

import pairs
from regress_fixture import Recorded, regress

import reference
from session import Unusable

# The other options of vergence reconstruct: input, output and messages.
NO_MEASURES = {"--calibration", "--pair", "--out", "--threads", "--ground-truth", "--mask",
               "--ground-truth-scale", "--debug", "--debug-row", "--json", "--quiet", "--help",
               "--accept-mismatch", "--compress", "--error", "--files", "--mesh-unit",
               "--triangles"}


class Words(Recorded):
    def test_wrong_options_are_refused(self):
        self.accept()
        for keys, word in (({"tolerance": {"disparity": 1}}, "disparity_px"),
                           ({"tolerance": {"disparity_px": -1}}, "disparity_px"),
                           ({"tolerance": {"disparity_px": "1"}}, "disparity_px"),
                           ({"arguments": "--scale 2"}, "arguments"), ({"more": 1}, "more"),
                           ({"arguments": ["--scale", "1\n"]}, "arguments"),
                           ({"arguments": ["--scale", "1\0"]}, "arguments"),
                           ({"arguments": ["--scale", "\ud800"]}, "arguments"),
                           ({"arguments": ["--nonsense"]}, "--nonsense")):
            self.options(**keys)
            self.refused("options.json", word)
        for arguments, word in ((["--scale", "7"], "--scale"), (["more"], "more")):
            self.options(arguments=arguments)
            self.refused("left.png", word)

    def test_a_session_cannot_report_what_is_written(self):
        """Sessions come from others and must not choose where to write."""
        self.accept()
        victim = self.directory / "victim"
        path = self.folder / "regress" / "options.json"
        kept = {p: p.read_bytes() for p in path.parent.iterdir() if p != path}
        for arguments, word in (([f"--out={victim}"], "--out"), (["--debug", "x"], "--debug"),
                                (["--help"], "--help"), (["--depth", "-h"], "-h"),
                                (["--depth", "--help"], "--help"), (["--", "x"], "--"),
                                (["--preset=fast", "--json"], "--json"), (["-out"], "-out"),
                                (["--out", str(victim)], "--out")):
            self.options(arguments=["--disparity", "0:48", *arguments])
            with self.assertRaisesRegex(Unusable, f"options.json: .*{word} "):
                reference.read_options(self.folder)
        for options in ([], ["--accept", "again"]):
            done = regress("--out", self.pictures, *options, self.folder)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (3, "", 1))
            self.assertRegex(done.stderr, f"^tools/regress: {re.escape(str(path))}: .*--out ")
            self.assertFalse(victim.exists())
        self.assertEqual({p: p.read_bytes() for p in kept}, kept)

    def test_what_reports_how_to_measure_is_taken(self):
        known = set(re.findall("^    (--[a-z-]+)", pairs.run("reconstruct", "--help").stdout, re.M))
        # A new option of vergence reconstruct belongs to one of both.
        self.assertEqual(known - NO_MEASURES, set(reference.MEASURES))
        output_text = regress("--help").stdout.split()
        for name in reference.MEASURES:
            self.assertIn(name, output_text)
            for words in ([name, "-12:60"], [f"{name}=1"]):
                self.options(arguments=words)
                self.assertEqual(reference.read_options(self.folder)[0], words)
        self.accept()
        self.options(arguments=["--disparity", "-2:50", "--preset=board", "--no-refine"])
        self.compare(1)

    def test_bad_directories_and_words(self):
        for arguments, code, word in (([], 2, "DIR"), (["--accept"], 2, "--accept"),
                                      (["--accept", " ", "x"], 2, "--accept"),
                                      (["--nonsense", "x"], 2, "--nonsense")):
            done = regress(*arguments)
            self.assertEqual((done.returncode, done.stdout), (code, ""), arguments)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn(word, done.stderr)
        for reason in ("a\nb", "a\r", "\x1b[2Ja", "a\tb", "a\x7f", "a\x85b", "a\u2028b"):
            done = regress("--accept", reason, self.folder)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1),
                             ascii(reason))
            self.assertRegex(done.stderr, "^tools/regress: --accept .*control characters")
        self.assertIn("disparity_off_percent", regress("--help").stdout)
        reason = "0,5\u00a0px: \u201egut\u201c"
        self.assertIn(reason, self.accept(reason).stdout)
        (self.folder / "calibration.txt").unlink()
        self.refused("no calibration")
        (self.folder / "left.png").unlink()
        self.refused("left image")

    def test_an_option_is_no_value_of_another(self):
        self.accept()
        kept = (self.folder / "regress" / "reference.json").read_bytes()
        for option, value in (("--accept", "--json"), ("--accept", "--nonsense"), ("--out", "--"),
                              ("--vergence", "--json")):
            done = regress(option, value, self.folder)
            self.assertEqual((done.returncode, done.stdout), (2, ""), (option, value))
            self.assertRegex(done.stderr, f"^tools/regress: {option} .*{value};.*--help\n$")
        self.assertEqual((self.folder / "regress" / "reference.json").read_bytes(), kept)


if __name__ == "__main__":
    unittest.main()

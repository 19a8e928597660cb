# SPDX-License-Identifier: Apache-2.0
"""tools/lint finds what it is for: each figure has a sample that is bad and one that is good."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
sys.path.insert(0, str(ROOT / "tools" / "lint.d"))

import figures  # noqa: E402
import phrases  # noqa: E402

BAD = (
    "the user is told", "the word tells it", "void told_twice(void);", "opened anew", "Whoever reads it",
    "whatever it is", "nobody reads it", "somebody reads it", "struct trouble t;", "last_trouble",
    "there is no memory", "expected is left or right", "it is no whole number", "the queue is hungry",
    "a deaf client", "every line is welcome", "what they lack", "one flaw", "flaw_of(x)", "vet(image)",
    "the usual value", "a modest heap", "it goes on.", "then it goes on with the next",
    "kept as it is.", "he reads his mail", "it stands in the file", "closed for good",
    "the sum comes to 3", "all the same", "it starts by itself", "on its own account",
    "Who waits for whom", "knock twice", "farewell", "bytes owed", "struct surroundings", "rig_crew",
    "the scribe", "an errand", "a sealed line", "SEAL_SIZE", 'the setting "files" is none',
    "3 pairs are none",
)
GOOD = (
    "x is None", "if there is no file", "there is no such directory", "is no longer used", "by default",
    "it stands for millimetres", "vetoed", "none of these is set", "Slack", "velvet", "black",
    "retelling of seals_are_not_here".replace("seals_are_not_here", "sea levels"), "she", "history",
    "this", "the next line", "goes one step", "fortold", "tellurium", "nobody:nogroup", "white, a flow",
    "is no more than 3", "the same", "sealant",
)


class Phrases(unittest.TestCase):
    def test_bad_samples_are_found(self):
        self.assertEqual([text for text in BAD if not phrases.found_in(text)], [])

    def test_each_rule_has_a_bad_sample(self):
        unused = [rule.pattern for rule, _ in phrases.RULES
                  if not any(rule.search(text) for text in BAD)]
        self.assertEqual(unused, [])

    def test_good_samples_are_not(self):
        self.assertEqual([(text, phrases.found_in(text)) for text in GOOD
                          if phrases.found_in(text)], [])

    def test_lines_are_counted(self):
        self.assertEqual([number for number, *_ in phrases.found_in("a\ntold\n\nanew, told\n")],
                         [2, 4, 4])

    def test_subjects_of_commits(self):
        for subject in ("daemon: keep a client's seat", "tests: feed the watchdog", "a/b: process it",
                        "calibration: focus both lenses", "tools: add --all"):
            self.assertEqual(phrases.fault_of_subject(subject), "", subject)
        for subject, word in (("daemon keeps a seat", "area"), ("daemon: keeps a seat", "imperative"),
                              ("daemon: kept: " + 60 * "x", "characters"),
                              ("daemon: added a seat", "imperative"),
                              ("daemon: adding a seat", "imperative")):
            self.assertIn(word, phrases.fault_of_subject(subject), subject)


class Trees(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)

    def tree(self, **files):
        for name, text in files.items():
            path = self.root / name.replace("__", "/").replace("_dot_", ".")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        return figures.Tree(str(self.root))

    def test_phrases_have_their_place(self):
        tree = self.tree(daemon__a_dot_c="// one\n// is told\n", tests__fuzz__corpus__x__a_dot_txt="told")
        count, places = figures.forbidden_phrases(tree)
        self.assertEqual((count, places[0].split(" ")[0]), (1, "daemon/a.c:2:"))

    def test_files_of_the_largest_folder(self):
        tree = self.tree(**{f"daemon__f{i}_dot_c": "" for i in range(31)}, calib__a_dot_cpp="",
                         **{f"tests__fuzz__corpus__f{i}_dot_c": "" for i in range(40)})
        self.assertEqual(figures.flat_files(tree), (31, ["daemon/: 31 files"]))

    def test_circles(self):
        tree = self.tree(firmware__rig__a_dot_h='#include "rig/b.h"\n',
                         firmware__rig__b_dot_h='\n#include "rig/c.h"\n',
                         firmware__rig__c_dot_h='#include "a.h"\n',
                         firmware__rig__d_dot_h='#include "rig/a.h"\n')
        count, places = figures.include_circles(tree)
        self.assertEqual((count, len(places)), (1, 3))
        self.assertIn("firmware/rig/b.h:2: includes firmware/rig/c.h in a circle", places)

    def test_circles_of_modules(self):
        tree = self.tree(daemon__a_dot_h="", daemon__a_dot_c='#include "daemon/a.h"\n#include "b.h"\n',
                         daemon__b_dot_h='#include "a.h"\n')
        self.assertEqual(figures.include_circles(tree)[0], 0)
        self.assertEqual(figures.module_circles(tree)[0], 1)

    def test_readmes(self):
        tree = self.tree(firmware__README_dot_md="", calib__a_dot_cpp="")
        self.assertEqual(figures.folders_without_readme(tree)[0], 5)

    @unittest.skipUnless(shutil.which("pmccabe"), "package to install: pmccabe")
    def test_branches(self):
        branches = "".join(f"if (x == {i}) {{ return {i}; }}\n" for i in range(13))
        text = f"int many(int x) {{\n{branches}return 0; }}\nint few(int x) {{ return x ? 1 : 2; }}\n"
        tree = self.tree(daemon__a_dot_c="\n" + text, firmware__core__match_a_dot_c=text)
        self.assertEqual(figures.complex_functions(tree), (1, ["daemon/a.c:2: many has 14 branches"]))

    def test_recorded_sessions(self):
        tree = self.tree(tests__sessions__one__calls_dot_log="12345", tests__sessions__make="1")
        self.assertEqual(figures.bytes_of_sessions(tree)[0], 5)

    def test_the_program(self):
        self.tree(**{f"daemon__f{i}_dot_c": "" for i in range(400)})
        done = subprocess.run([ROOT / "tools" / "lint", self.root], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("daemon/: 400 files\n", done.stdout)
        listed = subprocess.run([ROOT / "tools" / "lint", "--list", "readmes", self.root],
                                capture_output=True, text=True)
        self.assertEqual((listed.returncode, listed.stdout.count("\n")), (0, 6))
        wrong = subprocess.run([ROOT / "tools" / "lint", "--list", "nothing"], capture_output=True,
                               text=True)
        self.assertEqual((wrong.returncode, wrong.stdout), (2, ""))


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Rules for the whole tree: licence lines, layout, sizes, and no content that is
valid only on one machine."""
import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
sys.path.insert(0, os.path.join(ROOT, "tools", "lint.d"))
from figures import Tree  # noqa: E402

TREE = Tree(ROOT)

COMMENTED = (".c", ".h", ".cpp", ".hpp", ".py", ".sh", ".cmake", ".js", ".css", ".html")
# A module of the Linux kernel, which has the kernel's licence and headers.
KERNEL_MODULE = "firmware/system/driver/"
SIMULATOR = "tools/bfin_devices/"
# Compiled into what has these licences.
OTHER_LICENCES = {KERNEL_MODULE: "GPL-2.0-only", SIMULATOR: "GPL-3.0-or-later"}
C_FAMILY = (".c", ".h", ".cpp", ".hpp")
# A checkout must work, and be readable, elsewhere. (Written so that the rules do not match here.)
FOREIGN = {
    "a directory of one machine": re.compile(
        r"(?<![\w.}$~/])/(work/|root/|home/\w|Users/\w|opt/\w|mnt/\w|tmp/b-|tmp/fresh)"),
    "the host of a package registry": re.compile(
        r"py" r"pi\.org|python" r"hosted\.org|npm" r"js\.(org|com)|crates" r"\.io|deb" r"ian\.org|"
        r"github" r"usercontent|proxy\.golang\.org|\bregistry" r"\.[a-z]|index-" r"url", re.I),
    "an address without a name": re.compile(r"\b(10\.\d{1,3}|192\.168|172\.16)(\.\d{1,3}){2}\b"),
}


# Files of Linux and of a lens controller's vendor, and one that a reader writes.
FILES_OF_OTHERS = {"mt9t031.c", "v1lc.py", "arch/blackfin/mach-bf537/include/mach/portmux.h", "hello.py"}


def text_of(path):
    return TREE.text(path)


def is_code(path):
    name = os.path.basename(path)
    if name == "CMakeLists.txt" or path.endswith(COMMENTED):
        return True
    return text_of(path).startswith("#!")


class RepoLint(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.files = TREE.files
        assert len(cls.files) > 20, "no files found"

    def test_every_file_names_its_licence(self):
        code = [p for p in self.files if "/corpus/" not in p and is_code(p)]
        missing = [p for p in code if "SPDX-License-Identifier: " +
                   (next((licence for folder, licence in OTHER_LICENCES.items() if p.startswith(folder)),
                         "Apache-2.0"))
                   not in text_of(p)[:400]]
        self.assertEqual(missing, [])

    def test_contracts_of_the_matcher_fit_its_sources(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, "-B", os.path.join(ROOT, "tests/proof/prove.py"), "--weave",
                            os.path.join(folder, "match")], check=True)

    def test_core_includes_no_system_beyond_the_freestanding(self):
        allowed = {"stdarg.h", "stdbool.h", "stddef.h", "stdint.h", "string.h", "math.h", "immintrin.h",
                   "limits.h", "float.h", "arm_neon.h", "smmintrin.h", "stdatomic.h"}
        wrong = []
        for path in self.files:
            if path.startswith("firmware/") and not path.startswith(KERNEL_MODULE):
                found = set(re.findall(r"#include <([^>]+)>", text_of(path)))
                wrong += [f"{path}: {name}" for name in found - allowed]
        self.assertEqual(wrong, [])

    def test_no_left_over_marks(self):
        marks = re.compile(r"\b(TO" r"DO|FIX" r"ME|XX" r"X|HA" r"CK)\b")
        wrong = [p for p in self.files if "/corpus/" not in p and is_code(p)
                 and marks.search(text_of(p))]
        self.assertEqual(wrong, [])

    def test_nothing_of_one_machine(self):
        home = os.path.expanduser("~") + "/"
        here = ROOT.rstrip("/") + "/"
        wrong = []
        for path in self.files:
            text = text_of(path)
            wrong += [f"{path}: {what}: {found[0]}" for what, rule in FOREIGN.items()
                      for found in [rule.search(text)] if found]
            wrong += [f"{path}: {mine}" for mine in (home, here) if mine.count("/") > 2 and mine in text]
        self.assertEqual(wrong, [])

    def test_what_the_demo_leaves_is_none_of_the_tree(self):
        """tools/demo and then tools/test, as the README has it: results name this machine."""
        folder = re.search(r"^out=(\S+)$", text_of("tools/demo"), re.MULTILINE)[1]
        self.assertIn(f"/{folder}/", text_of(".gitignore").splitlines())

    def test_the_rules_about_machines_can_fail(self):
        for text in ("cd /" "work/main", '"/' 'home/jane/x"', "https://py" "pi.org/simple",
                     "https://registry" ".npm" "js.org", "/" "root/.cache", "at 192.168" ".1.20"):
            self.assertTrue(any(rule.search(text) for rule in FOREIGN.values()), text)
        for text in ("~/" "work/x", "$root/tools", "tests/" "work/", "version 10.4.1", "0.22.0"):
            self.assertFalse(any(rule.search(text) for rule in FOREIGN.values()), text)

    def test_c_and_cpp_have_the_tree_s_layout(self):
        self.assertIsNotNone(shutil.which("clang-format"), "package to install: clang-format")
        sources = [os.path.join(ROOT, p) for p in self.files if p.endswith(C_FAMILY)]
        done = subprocess.run(["clang-format", "--dry-run", "-Werror", *sources],
                              capture_output=True, text=True)
        wrong = sorted({line.split(":")[0] for line in done.stderr.splitlines()
                        if "[-Wclang-format-violations]" in line})
        self.assertEqual((wrong, done.returncode), ([], 0), "clang-format -i mends it")

    def test_documents_name_files_and_functions_that_exist(self):
        wrong = []
        for page in (p for p in self.files if p.endswith(".md")):
            text = re.sub(r"^```.*?^```", "", text_of(page), flags=re.S | re.M)
            for name in re.findall(r"`([\w./-]+\.(?:c|h|cpp|hpp|py|v|md|cmake|js|rdl))`", text):
                if not re.search(r"[A-Z]{4}", name.rpartition("/")[2].partition(".")[0]) and \
                        name not in FILES_OF_OTHERS and not self.is_named(page, name):
                    wrong.append((page, name))
            for name, functions in re.findall(r"\| `([\w./]+\.[cv])` \| (`\w+`(?:, `\w+`)*) \|$", text, re.M):
                inside = "".join(text_of(p) for p in self.files if ("/" + p).endswith("/" + name))
                wrong += [(page, name, one) for one in re.findall(r"\w+", functions)
                          if not re.search(rf"\b{one}\b", inside)]
        self.assertEqual(wrong, [])

    def is_named(self, page, name):
        """A file of the tree, by its path from the page's folder, or by the end of its path."""
        path = os.path.normpath(os.path.join(os.path.dirname(page), name))
        return any(file == path or ("/" + file).endswith("/" + name) for file in self.files)

    def test_programs_can_be_run(self):
        wrong = [p for p in self.files if text_of(p).startswith("#!") and "/corpus/" not in p
                 and not os.stat(os.path.join(ROOT, p)).st_mode & stat.S_IXUSR]
        self.assertEqual(wrong, [])

    def test_shell_stops_at_errors(self):
        wrong = [p for p in self.files if re.match(r"#!\S*(/| )(ba)?sh\b", text_of(p))
                 and not re.search(r"^set -eu", text_of(p), re.M)]
        self.assertEqual(wrong, [])

    def test_invariants_are_asserted(self):
        for name, folders, wanted in (("core", ("firmware/core/", "firmware/stereo/"), 0.03),
                                      ("calib", ("calib/",), 0.02)):
            code = [line for path in self.files
                    if path.startswith(folders) and path.endswith((".c", ".cpp"))
                    for line in text_of(path).splitlines()
                    if line.strip() and not line.strip().startswith(("//", "#", "}"))]
            share = sum(line.count("INVARIANT(") for line in code) / len(code)
            print(f"{name}: {100 * share:.1f} % of {len(code)} lines are invariants")
            self.assertGreaterEqual(share, wanted, name)


if __name__ == "__main__":
    unittest.main()

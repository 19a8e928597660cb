# SPDX-License-Identifier: Apache-2.0
"""The arrows of tools/arrows.txt: every #include follows one, every arrow is used, there is no circle,
and the include path that the build gives a folder leads to the allowed folders alone."""
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
sys.path.insert(0, str(ROOT / "tools/lint.d"))
from figures import CODE, Tree  # noqa: E402

TREE = Tree(str(ROOT))
BUILD = pathlib.Path(os.environ["VERGENCE"]).parents[1]


def allowed_arrows():
    """tools/arrows.txt: folder -> folders that it may include."""
    lines = [line.split(":") for line in TREE.text("tools/arrows.txt").splitlines()
             if line and not line.startswith("#")]
    return {folder: allowed.split() for folder, allowed in lines}


def folder_of_include(name):
    """The folder, from the root, that holds what an #include names; "": made by the build."""
    for root in ("firmware/", "", "fpga/generated/", "fpga/sim/"):
        if os.path.isfile(os.path.join(ROOT, root + name)):
            return os.path.dirname(root + name)
    return ""


def reachable(folder, known):
    """All folders below one: their headers may be needed by headers that it includes."""
    found = {folder}
    for lower in known.get(folder, ()):
        found |= reachable(lower, known)
    return found


def header_of(folder):
    """The name by which a header of a folder is included; None: the folder has none."""
    names = sorted(path.name for path in (ROOT / folder).glob("*.h*") if "gpiod_shim" not in path.name
                   and "vector" not in path.name and "phase" not in path.name)
    return f"{folder.removeprefix('firmware/')}/{names[0]}" if names else None


def include_flags():
    """Folder -> include options of its first source."""
    flags = {}
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        source = pathlib.Path(entry["file"])
        folder = os.path.relpath(source.parent, BUILD / "source")
        words = shlex.split(entry["command"])
        flags.setdefault(folder, [word for at, word in enumerate(words) if word.startswith("-I") or
                                  word == "-isystem" or words[at - 1] == "-isystem"])
    return flags


def seen(flags, headers):
    """Which of these headers a source with these flags can include."""
    text = "".join(f'#if __has_include("{name}")\n"{name}"\n#endif\n' for name in headers)
    done = subprocess.run(["g++", "-E", "-P", "-x", "c++", *flags, "-"], input=text, text=True, cwd="/",
                          capture_output=True, check=True)
    return set(done.stdout.replace('"', "").split())


class Arrows(unittest.TestCase):
    def test_includes_follow_the_allowed_arrows(self):
        arrows = allowed_arrows()
        wrong, seen = [], set()
        for path in TREE.files:
            folder = os.path.dirname(path)
            if not path.endswith(CODE) or folder not in arrows:
                continue
            for name in re.findall(r'^#include "([^"]*)"', TREE.text(path), re.M):
                target = folder_of_include(name)
                seen.add((folder, target))
                if target not in (folder, "", *arrows[folder]):
                    wrong.append(f"{path} -> {name}")
        self.assertEqual(wrong, [])
        unused = [f"{folder} -> {target}" for folder in arrows for target in arrows[folder]
                  if (folder, target) not in seen]
        self.assertEqual(unused, [])

    def test_every_source_folder_has_its_arrows(self):
        arrows = allowed_arrows()
        folders = {os.path.dirname(p) for p in TREE.files if p.endswith(CODE)
                   and p.startswith(("firmware/", "daemon/", "calib/", "tools/", "library/"))}
        # Here are the mains; a generator that nothing includes; and a module of the kernel.
        self.assertEqual(folders - set(arrows),
                         {"daemon", "tools", "tools/simrig", "tools/bench.d",
                          "calib/base/marker_tables", "firmware/system/driver", "library/python",
                          "tools/bfin_devices"})
        self.assertEqual(set(arrows) - folders, set())

    def test_the_arrows_have_no_circle(self):
        arrows = allowed_arrows()
        while arrows:
            lowest = {f for f in arrows if not set(arrows[f]) & set(arrows)}
            self.assertTrue(lowest, f"circle among {sorted(arrows)}")
            arrows = {f: arrows[f] for f in arrows if f not in lowest}

    def test_only_allowed_folders_are_seen(self):
        known, flags = allowed_arrows(), include_flags()
        headers = {folder: header_of(folder) for folder in known if header_of(folder)}
        self.assertGreater(len(set(known) & set(flags)), 30)
        for folder in sorted(set(known) & set(flags)):
            # A folder inside another one is seen through the link to that one.
            below = reachable(folder, known)
            allowed = {header for other, header in headers.items()
                       if any(other == one or other.startswith(one + "/") for one in below)}
            with self.subTest(folder):
                self.assertEqual(seen(flags[folder], headers.values()), allowed)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""What tools/arrows.txt allows compiles, and what it does not allow does not: each folder's sources are
compiled with the flags of the build, which find the headers of the allowed folders alone."""
import json
import os
import pathlib
import shlex
import subprocess
import unittest

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
BUILD = pathlib.Path(os.environ["VERGENCE"]).parents[1]


def arrows():
    lines = [line.split(":") for line in (ROOT / "tools/arrows.txt").read_text().splitlines()
             if line and not line.startswith("#")]
    return {folder: allowed.split() for folder, allowed in lines}


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
    def test_only_allowed_folders_are_seen(self):
        known, flags = arrows(), include_flags()
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

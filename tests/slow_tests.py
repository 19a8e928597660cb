#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: tests/slow_tests.py --exclude | --changed [BASE]

The tests that `tools/test` leaves to `tools/test --all`, because they are slow and rarely break, and
the folders and files that each of them guards.

  --exclude         prints the regular expression for ctest -E that leaves them out
  --changed [BASE]  prints the tests that guard what differs from the commit BASE, with the working
                    tree (default: where the branch left main; on main the last commit,
                    or the one before if all is committed)
  --help            this text
"""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]

# Name, as a regular expression of ctest -R: what it guards; whole folders, or files.
GUARDS = {
    "board/power_cut_test": ("daemon/backends/store", "daemon/system", "firmware/system",
                             "tests/board/power_cut_test.py"),
    "command/core_symbols_test": ("firmware",),
    "command/demo_test": ("tools/demo", "tools/demo.d", "tools/simrig", "tests/command/repository/demo_test.py"),
    "command/install_test": ("daemon/install", "tools/install", "CMakeLists.txt",
                             "daemon/CMakeLists.txt", "tools/CMakeLists.txt"),
    "command/package_test": ("tools/package", "tools/package.d", "daemon/install", "library/CMakeLists.txt",
                             "CMakeLists.txt", "daemon/CMakeLists.txt", "tools/CMakeLists.txt"),
    "command/portable_test": ("firmware", "tests/portable"),
    "command/signals_test": ("tools/host", "tools/main_vergence.cpp"),
    "command/wheel_test": ("library", "pyproject.toml", "CMakeLists.txt", "tools/CMakeLists.txt"),
    "console/capture_whole_test": ("calib/detect", "tests/console/capture_test.py", "tools/host/capture"),
    "console/help_examples_test": ("daemon", "tools"),
    "console/noise_whole_test": ("daemon",),
    "hdl/symbols_test_[1-9]": ("fpga/rtl", "tests/hdl"),
    "hdl/synthesis_test": ("fpga/rtl", "fpga/generated", "fpga/boards", "fpga/tools"),
    "rig/search_fault_test": ("firmware/console", "firmware/rig"),
    "simrig/true_calibration_test": ("calib", "tools/simrig"),
    "simrig/world_(blur|files)_test": ("tools/simrig",),
    "study/bench": ("calib", "tests/study/bench", "tools/bench", "tools/bench.d"),
    "study/focus": ("firmware/device", "firmware/focus", "firmware/rig", "tests/study/focus",
                    "tools/simrig/devices"),
    "study/zoom": ("calib/zoom", "tests/study/zoom"),
}


def exclude():
    return "^(" + "|".join(sorted(GUARDS)) + ")$"


def guards_of(paths):
    """The names of the tests that guard one of these files."""
    return sorted(name for name, guarded in GUARDS.items()
                  if any(path == one or path.startswith(one + "/")
                         for path in paths for one in guarded))


def git(root, *words):
    done = subprocess.run(["git", "-c", "safe.directory=*", "-C", str(root), *words],
                          capture_output=True, text=True)
    return done.stdout.splitlines() if done.returncode == 0 else []


def base_of(root):
    """Where this branch left the main one; on the main one itself the last commit if something is not
    committed, else the one before."""
    head = git(root, "rev-parse", "HEAD")
    for main in ("origin/HEAD", "origin/main", "main"):
        base = git(root, "merge-base", "HEAD", main)
        if base and base != head:
            return base[0]
    return "HEAD" if git(root, "status", "--porcelain") else "HEAD~1"


def changed(root, base):
    """The files that differ from a commit, and those that git does not know yet."""
    return git(root, "diff", "--name-only", "--no-renames", base) + \
        git(root, "ls-files", "--others", "--exclude-standard")


def advice(root, base=None):
    """A line for the user, or nothing."""
    names = guards_of(changed(root, base or base_of(root)))
    if not names:
        return ""
    return ("slow tests that guard what changed: " + " ".join(names) + ": run tools/test --all, or "
            f"ctest -R '^({'|'.join(names)})$'\n")


def main(words):
    if words == ["--exclude"]:
        print(exclude())
    elif words[:1] == ["--changed"] and len(words) <= 2:
        sys.stdout.write(advice(ROOT, *words[1:]))
    else:
        print(__doc__, end="")
        return 0 if words == ["--help"] else 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

# SPDX-License-Identifier: Apache-2.0
"""Nothing is removed or replaced that this product did not make: in the daemon and the programs of the PC
one function removes (daemon/files/own_remove.h), and every other place that removes or renames is listed
here with what makes it safe. A new one belongs into that function; if it cannot, it belongs into the list."""
import os
import re
import sys
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
sys.path.insert(0, os.path.join(ROOT, "tools", "lint.d"))
from figures import Tree  # noqa: E402

C_CALLS = re.compile(
    r"(?<![\w.>:])(?:unlink|unlinkat|rmdir|rename|renameat|renameat2|remove)\s*\(|"
    r"\b(?:std::remove\(\w+\.c_str|std::rename|(?:filesystem|fs)::(?:remove|remove_all|rename))\b")
PYTHON_CALLS = re.compile(
    r"\b(?:shutil\.(?:rmtree|move)|os\.(?:unlink|remove|removedirs|rmdir|rename|renames|replace))\b|"
    r"\.(?:unlink|rmdir|rename)\(|\.replace\([^,()]*\)")
SHELL_CALLS = re.compile(r"(?:^|[;&|{(']|\bthen|\bdo|\belse)\s*(?:rm|mv|rmdir|unlink)\s", re.M)

CACHE = "in its own folder of the user's cache"
TEMPORARY = "in the temporary folder that it has made"
OUTPUT = "a file under a name of its own in its own folder"
# File: number of calls, and why each is safe.
ALLOWED = {
    "daemon/files/own_remove.c": (3, "the function, after the proof"),
    "daemon/files/atomic_file.c": (2, "a name that the caller was asked to write, by its user or by its format"),
    "daemon/files/atomic_dir.c": (2, "a new directory; files whose predecessors own_listing.h names"),
    "daemon/client/remote_measure.c": (1, "the file that it has fetched, which the new directory contains"),
    "daemon/server/listener.c": (1, "its socket, after is_no_socket and is_served"),
    "firmware/system/root/etc/vergence/serve": (1, "the board's own system, in memory"),
    "firmware/system/driver/bench_camera.c": (1, "not a file: a driver's function"),
    "tools/simrig/main_simrig.cpp": (1, "the socket that it has bound"),
    "tools/simrig/server/listener.cpp": (4, "sockets: is_socket, or bound a moment before"),
    "tools/bench.d/prepare_pairs.py": (1, "a new folder; rename fails if one is there"),
    "tools/bench.d/prepare_scenes.py": (3, "a scene with its own meta.json; " + TEMPORARY),
    "tools/bench.d/tuning.py": (1, "a program that it has compiled, in the build folder"),
    "tools/board": (1, "the socket in the folder of its board"),
    "tools/system/machine.py": (1, "the socket in the folder of its board"),
    "tools/system/rig_bench.py": (1, "sockets"),
    "tools/system/terminal.py": (3, "the token in the folder of its board; its links to pseudo terminals"),
    "tools/campaign": (7, OUTPUT),
    "tools/cross": (2, OUTPUT),
    "tools/cross.d/build_fdpic": (2, CACHE),
    "tools/cross.d/build_kernel_nommu": (2, CACHE),
    "tools/bfin-toolchain": (6, CACHE),
    "tools/cross.d/build_libraries": (3, CACHE),
    "tools/cross.d/fetch_sources": (1, "sources that it has unpacked"),
    "tools/cross.d/unpack_libraries": (3, CACHE),
    "tools/demo": (1, TEMPORARY),
    "tools/demo.d/rig.py": (1, TEMPORARY),
    "tools/figures.d/board_shots.py": (3, "from a temporary folder that it has made; " + OUTPUT),
    "tools/figures.d/figure.py": (1, OUTPUT),
    "tools/figures.d/measured.py": (1, "in the folder of its figure"),
    "tools/fpga_python": (1, CACHE),
    "tools/host/view/view_webcams.cpp": (2, TEMPORARY),
    "tools/image": (2, TEMPORARY + "; the image's files to where the user asks"),
    "tools/system/build_busybox": (4, CACHE),
    "tools/system/build_kernel": (1, CACHE),
    "tools/opencv_samples": (3, CACHE),
    "tools/package": (3, "its work folder, and moves packages and wheels out of it"),
    "tools/regress": (1, CACHE),
}


def calls_of(path, text):
    """Lines that remove or rename."""
    if path.endswith((".c", ".h", ".cpp", ".hpp")):
        text = re.sub(r"//[^\n]*|\"(?:\\.|[^\"\n\\])*\"", "", text)
        return [line for line in text.splitlines() if C_CALLS.search(line)]
    if path.endswith(".py") or re.match(r"#!.*python", text):
        return [line for line in text.splitlines() if PYTHON_CALLS.search(line)]
    if path.endswith(".sh") or re.match(r"#!.*sh\b", text):
        return SHELL_CALLS.findall(text)
    return []


class Removal(unittest.TestCase):
    maxDiff = None

    def test_every_caller_is_listed(self):
        tree, found = Tree(ROOT), {}
        for path in tree.files:
            if path.startswith(("daemon/", "tools/", "calib/", "firmware/")):
                calls = calls_of(path, tree.text(path))
                if calls:
                    found[path] = len(calls)
                    if ALLOWED.get(path, (0, ""))[0] != len(calls):
                        print(f"{path}:", *calls, sep="\n    ")
        self.assertEqual(found, {path: count for path, (count, _) in ALLOWED.items()})

    def test_a_new_caller_is_found(self):
        for path, text in (("a.c", "    if (unlink(path) != 0) {"), ("a.c", "    rename (a, b);"),
                           ("a.c", "x = unlinkat(fd, name, 0);"), ("a.c", "remove(path);"),
                           ("a.cpp", "std::filesystem::remove_all(path);"),
                           ("a.cpp", "fs::rename(a, b);"), ("a.cpp", "std::remove(path.c_str());"),
                           ("a.py", "shutil.rmtree(out, ignore_errors=True)"),
                           ("a.py", "os.replace(a, b)"), ("a.py", "path.unlink()"),
                           ("a.py", "(here / name).rename(there)"), ("a.py", "one.replace(other)"),
                           ("a.sh", "set -eu\nrm -rf \"$x\"\n"), ("a.sh", "test x && mv a b\n"),
                           ("a.sh", "trap 'rm -rf \"$work\"' EXIT")):
            self.assertEqual(len(calls_of(path, text)), 1, text)
        for path, text in (("a.c", "store->operations->remove(self, name);"), ("a.c", "// unlink(path)"),
                           ("a.c", "own_remove(fd, name, &proof);"), ("a.c", 'puts("rename (a)");'),
                           ("a.cpp", "v.erase(std::remove(v.begin(), v.end(), 0), v.end());"),
                           ("a.py", "text.replace('a', 'b')"), ("a.sh", "# rm it\nform x\n")):
            self.assertEqual(calls_of(path, text), [], text)


if __name__ == "__main__":
    unittest.main()

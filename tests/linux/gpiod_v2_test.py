# SPDX-License-Identifier: Apache-2.0
"""The GPIO lines with libgpiod 2, which Debian 12 does not have: its sources are in the Python
package gpiod, and gpiod_lines_test.cpp is built against them."""
import fcntl
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
FAKE_KERNEL = os.environ["VERGENCE_FAKE_KERNEL_LIBRARY"]
CACHE = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "vergence")
PACKAGE, LIBRARY_VERSION = "gpiod==2.3.0", "2.2.1"
CACHED = ["ccache"] if shutil.which("ccache") else []
WARNINGS = ["-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Werror"]
OWN = ["-D_GNU_SOURCE", "-I", ROOT, "-I", os.path.join(ROOT, "firmware")]


def sources():
    """Directory of the package's sources; downloaded once."""
    place = os.path.join(CACHE, "gpiod-2")
    os.makedirs(CACHE, exist_ok=True)
    with open(place + ".lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not os.path.isdir(place):
            with tempfile.TemporaryDirectory(dir=CACHE) as scratch:
                subprocess.run([os.path.join(ROOT, "tools", "retry"), sys.executable, "-m", "pip",
                                "download", "--quiet", "--no-deps", "--disable-pip-version-check",
                                "--no-binary", ":all:", "--dest", scratch, PACKAGE], check=True)
                [archive] = [n for n in os.listdir(scratch) if n.endswith(".tar.gz")]
                with tarfile.open(os.path.join(scratch, archive)) as tar:
                    tar.extractall(scratch)
                os.rename(os.path.join(scratch, archive[:-len(".tar.gz")]), place)
    return place


class Build:
    """Builds objects and programs in a separate directory."""

    def __init__(self, folder):
        self.folder = folder

    def compile(self, source, *flags):
        output = os.path.join(self.folder, source.replace("/", "_") + ".o")
        compiler = ["g++", "-std=c++17"] if source.endswith(".cpp") else ["gcc", "-std=gnu11"]
        subprocess.run([*CACHED, *compiler, "-O1", "-g", *flags, "-c", os.path.join(ROOT, source),
                        "-o", output], check=True)
        return output

    def link(self, name, *inputs):
        program = os.path.join(self.folder, name)
        subprocess.run(["g++", "-o", program, *inputs], check=True)
        return program


def own_objects(build, shim, *flags):
    parts = ["daemon/backends/linux/gpiod_lines.c", f"daemon/backends/linux/gpiod_shim_{shim}.c",
             "daemon/backends/linux/device_file.c", "daemon/backends/linux/monotonic_clock.c", "daemon/base/message.c",
             "firmware/core/error.c", "firmware/core/invariant.c", "firmware/core/utf8.c"]
    return [build.compile(part, *WARNINGS, *OWN, *flags) for part in parts]


class GpiodV2(unittest.TestCase):
    def test_the_shim_of_version_2_passes_the_tests_of_version_1(self):
        package = sources()
        include = os.path.join(package, "include")
        with tempfile.TemporaryDirectory() as folder:
            build = Build(folder)
            library = [build.compile(os.path.join(package, "lib", name), "-D_GNU_SOURCE",
                                     f'-DGPIOD_VERSION_STR="{LIBRARY_VERSION}"', "-I", include)
                       for name in sorted(os.listdir(os.path.join(package, "lib")))
                       if name.endswith(".c")]
            tests = [build.compile(name, *OWN, "-I", os.path.join(ROOT, "tests"), "-I",
                                   os.path.join(ROOT, "tests", "fake_kernel"))
                     for name in ("tests/linux/gpiod_lines_test.cpp", "tests/doctest_main.cpp")]
            program = build.link("gpiod_v2", *tests, *own_objects(build, "v2", "-isystem", include),
                                 *library, FAKE_KERNEL,
                                 f"-Wl,-rpath,{os.path.dirname(FAKE_KERNEL)}")
            done = subprocess.run([program], capture_output=True, text=True, timeout=100)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("built with libgpiod 2", done.stdout)
        self.assertIn("| 0 failed |", done.stdout)


if __name__ == "__main__":
    unittest.main()

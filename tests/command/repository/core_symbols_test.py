# SPDX-License-Identifier: Apache-2.0
"""The firmware depends on nothing but itself: no allocation, no input or output, no libm except sqrt.

Every source of the firmware's libraries is compiled separately and its undefined symbols are checked, for the native
processor, 32-bit ARM and 64-bit RISC-V (the compiler's own helpers differ).
"""
import concurrent.futures
import glob
import os
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
# firmware/system holds no library: it is what the board's system is built of.
CORE = "core", "stereo"
FOLDERS = *CORE, "device", "focus", "measure", "rig", "console", "surface"
FLAGS = ["-std=c11", "-O2", "-ffp-contract=off", "-fno-pic", "-I", os.path.join(ROOT, "firmware"),
         "-I", os.path.join(ROOT, "fpga", "generated"), "-c"]
# The objects are the same each time, so unchanged sources need not be recompiled.
CACHED = ["ccache"] if shutil.which("ccache") else []
EXPORTED = "TDBRVWC"
ALLOWED = {
    "sqrt",  # correctly rounded everywhere, so it gives the same bytes
    "memcpy", "memset", "memmove", "memcmp", "memchr",
    "strlen", "strcmp", "strncmp", "strchr", "strrchr", "strspn", "strcspn", "strstr", "strcpy",
}
# Symbols that a compiler adds: position-independent code, its library of 64-bit division, bit
# counts and floating point, processor detection.
COMPILER = re.compile(r"^(_GLOBAL_OFFSET_TABLE_|__aeabi_\w+|__(u|)(div|mod)\w*|__c[lt]z\w+|"
                      r"__(u|)float\w+|__fix\w+|__cpu_model|__cpu_indicator_init|__popcount\w+)$")


def sources(folders=FOLDERS):
    return sorted(path for folder in folders for path in
                  glob.glob(os.path.join(ROOT, "firmware", folder, "**", "*.c"), recursive=True))


def extra_flags(compiler, source):
    levels = {"kernels_sse41.c": ["-msse4.1"], "kernels_avx2.c": ["-mavx2"]}
    return levels.get(os.path.basename(source), []) if compiler == "gcc" else []


class Listing:
    """Output of nm for every object, by compiler: compiled once for all tests."""
    known = {}

    @classmethod
    def of(cls, compiler):
        if compiler not in cls.known:
            cls.known[compiler] = cls.compile(compiler)
        return cls.known[compiler]

    @staticmethod
    def compile(compiler):
        """Source's name -> list of (kind, symbol)."""
        with tempfile.TemporaryDirectory() as folder, \
                concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            return dict(pool.map(lambda source: Listing.compile_one(compiler, source, folder),
                                 sources()))

    @staticmethod
    def compile_one(compiler, source, folder):
        name = os.path.basename(source)
        target = os.path.join(folder, name + ".o")
        flags = extra_flags(compiler, source) if os.uname().machine == "x86_64" else []
        subprocess.run([*CACHED, compiler, *FLAGS, *flags, source, "-o", target], check=True)
        text = subprocess.run(["nm", target], check=True, capture_output=True, text=True).stdout
        return name, [tuple(line.split()[-2:]) for line in text.splitlines()]


class CoreSymbols(unittest.TestCase):
    def check(self, compiler):
        self.assertIsNotNone(shutil.which(compiler), f"to install: {compiler}")
        needed, defined = {}, set()
        for source, listing in Listing.of(compiler).items():
            for kind, name in listing:
                if kind == "U":
                    needed.setdefault(name, []).append(source)
                elif kind in EXPORTED:
                    defined.add(name)
        self.assertIn("rectify_row_strip", defined)
        strangers = {name: files for name, files in needed.items()
                     if name not in defined | ALLOWED and not COMPILER.match(name)}
        self.assertEqual(strangers, {}, "symbols from outside the firmware, and who needs them")

    def test_this_processor(self):
        self.check("gcc")

    def test_arm(self):
        self.check("arm-linux-gnueabihf-gcc")

    def test_risc_v(self):
        self.check("riscv64-linux-gnu-gcc")

    def test_the_check_can_fail(self):
        with tempfile.TemporaryDirectory() as folder:
            source, target = os.path.join(folder, "bad.c"), os.path.join(folder, "bad.o")
            with open(source, "w", encoding="ascii") as file:
                file.write("#include <math.h>\n#include <stdlib.h>\n"
                           "void *f(double x) { return malloc((unsigned)sin(x)); }\n")
            subprocess.run(["gcc", "-c", source, "-o", target], check=True)
            listing = subprocess.run(["nm", "-u", target], check=True, capture_output=True,
                                     text=True).stdout
        for name in ("sin", "malloc"):
            self.assertIn(name, listing)
            self.assertNotIn(name, ALLOWED)
            self.assertIsNone(COMPILER.match(name))

    def test_exports_carry_their_file_name(self):
        """foo.c exports only foo_*, so that a name identifies its file; or the name of its folder."""
        folders = {os.path.basename(path): os.path.basename(os.path.dirname(path))
                   for path in sources(CORE)}
        for source, folder in folders.items():
            # A module of several files shares its first word.
            stems = source.removesuffix(".c").split("_")[0] + "_", folder + "_"
            with self.subTest(source):
                self.assertEqual([name for kind, name in Listing.of("gcc")[source]
                                  if kind in EXPORTED and not name.startswith(stems)], [])

    def test_no_mutable_statics(self):
        """The firmware has no data or bss: it runs on any thread, from read-only memory."""
        for source, listing in Listing.of("gcc").items():
            with self.subTest(source):
                self.assertEqual([name for kind, name in listing if kind in "bBdDcC"], [])


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""The core computes the same bytes on every processor, with every compiler and optimisation.

tests/portable/core_digest.c prints one line of checksums. It is built for x86-64, 32-bit and 64-bit
ARM, with NEON and without, and 64-bit RISC-V (run by qemu's user-mode emulation), at -O0 and -O2
and more, and every line must be equal to the first.
"""
import concurrent.futures
import glob
import os
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
FOLDERS = [os.path.join(ROOT, *folder.split("/")) for folder in
           ("firmware/core", "firmware/focus", "firmware/measure", "firmware/stereo", "tests/portable")]
FLAGS = ["-std=c11", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-I",
         os.path.join(ROOT, "firmware")]
# The objects are the same each time, so unchanged sources need not be recompiled.
CACHED = ["ccache"] if shutil.which("ccache") else []
# As in tools/build: the cache also finds equal sources of another checkout.
os.environ.update(CCACHE_BASEDIR=os.path.dirname(ROOT), CCACHE_NOHASHDIR="1", CCACHE_DEPEND="1")
# The levels of the matcher that need a processor's extensions; empty files elsewhere.
LEVEL_FLAGS = {"sse41.c": ["-msse4.1"], "avx2.c": ["-mavx2"]}

ARM, ARM64, RISCV = "arm-linux-gnueabihf-gcc", "aarch64-linux-gnu-gcc", "riscv64-linux-gnu-gcc"
# Name -> compiler, flags, how to run the program, the matcher's level that it must choose (none:
# depends on the native processor).
TARGETS = {
    "x86-64 gcc -O2": ("gcc", ["-O2"], [], []),
    "x86-64 gcc -O0": ("gcc", ["-O0"], [], []),
    "x86-64 gcc -O3 -mavx2 -mfma": ("gcc", ["-O3", "-mavx2", "-mfma"], [], []),
    "x86-64 clang -O2": ("clang", ["-O2"], [], []),
    "arm gcc -O2": (ARM, ["-O2", "-static"], ["qemu-arm"], ["plain"]),
    "arm gcc -O0": (ARM, ["-O0", "-static"], ["qemu-arm"], ["plain"]),
    "arm gcc -O2 -mfpu=neon": (ARM, ["-O2", "-static", "-mfpu=neon"], ["qemu-arm"], ["neon"]),
    "aarch64 gcc -O2": (ARM64, ["-O2", "-static"], ["qemu-aarch64"], ["neon"]),
    "riscv64 gcc -O2": (RISCV, ["-O2", "-static"], ["qemu-riscv64"], ["plain"]),
    "riscv64 gcc -O0": (RISCV, ["-O0", "-static"], ["qemu-riscv64"], ["plain"]),
}
PACKAGES = {
    "gcc": "gcc", "clang": "clang",
    "qemu-arm": "qemu-user", "qemu-aarch64": "qemu-user", "qemu-riscv64": "qemu-user",
    ARM: "gcc-arm-linux-gnueabihf",
    ARM64: "gcc-aarch64-linux-gnu",
    RISCV: "gcc-riscv64-linux-gnu",
}


def sources():
    return [name for folder in FOLDERS
            for name in sorted(glob.glob(os.path.join(folder, "**", "*.c"), recursive=True))]


def level_flags(target, source):
    level = os.path.basename(source).split("_")[-1]
    return LEVEL_FLAGS.get(level, []) if target.startswith("x86-64") else []


def processor_allows(flags):
    """False for instructions that this machine does not have."""
    if "-mfma" not in flags:
        return True
    with open("/proc/cpuinfo", encoding="ascii", errors="replace") as info:
        return {"avx2", "fma"} <= set(info.read().split())


def digest(target, folder):
    compiler, flags, runner, level = TARGETS[target]
    program = os.path.join(folder, target.replace(" ", "_"))
    objects = []
    for source in sources():
        objects.append(f"{program}_{os.path.basename(source)}.o")
        subprocess.run([*CACHED, compiler, *FLAGS, *flags, *level_flags(target, source), "-c",
                        source, "-o", objects[-1]], check=True)
    subprocess.run([compiler, *flags, *objects, "-lm", "-o", program], check=True)
    done = subprocess.run([*runner, program, *level], check=True, stdout=subprocess.PIPE, text=True)
    return done.stdout.strip()


class Portable(unittest.TestCase):
    def test_all_targets_print_the_same_line(self):
        missing = sorted({PACKAGES[p] for c, _, r, _ in TARGETS.values() for p in [c, *r]
                          if shutil.which(p) is None})
        self.assertEqual(missing, [], "packages to install: " + " ".join(missing))
        targets = [t for t in TARGETS if processor_allows(TARGETS[t][1])]
        for absent in set(TARGETS) - set(targets):
            print(f"not run (missing instructions on this processor): {absent}")
        with tempfile.TemporaryDirectory() as folder, \
                concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            lines = list(pool.map(lambda t: digest(t, folder), targets))
        for target, line in zip(targets, lines):
            print(f"{target:30} {line}")
            with self.subTest(target):
                self.assertRegex(lines[0], r"^math [0-9a-f]{8}  ")
                self.assertEqual(line, lines[0])


if __name__ == "__main__":
    unittest.main()

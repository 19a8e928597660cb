# SPDX-License-Identifier: Apache-2.0
"""The core computes the same bytes on every processor, with every compiler and optimisation.

tests/portable/core_digest.c prints one line of checksums. It is built for x86-64, 32-bit ARM and
64-bit RISC-V (run by qemu's user-mode emulation), at -O0 and -O2 and more, and every line must be
equal to the first.
"""
import concurrent.futures
import glob
import os
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.environ["VERGENCE_SOURCE"]
DIGEST = os.path.join(ROOT, "tests", "portable", "core_digest.c")
FLAGS = ["-std=c11", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-I",
         os.path.join(ROOT, "firmware")]
# The objects are the same each time: no need to compile unchanged sources again.
CACHED = ["ccache"] if shutil.which("ccache") else []
# The levels of the matcher that need a processor's extensions; empty files elsewhere.
LEVEL_FLAGS = {"match_sse41.c": ["-msse4.1"], "match_avx2.c": ["-mavx2"]}

# Name -> compiler, flags, what runs the program.
TARGETS = {
    "x86-64 gcc -O2": ("gcc", ["-O2"], []),
    "x86-64 gcc -O0": ("gcc", ["-O0"], []),
    "x86-64 gcc -O3 -mavx2 -mfma": ("gcc", ["-O3", "-mavx2", "-mfma"], []),
    "x86-64 clang -O2": ("clang", ["-O2"], []),
    "arm gcc -O2": ("arm-linux-gnueabihf-gcc", ["-O2", "-static"], ["qemu-arm"]),
    "arm gcc -O0": ("arm-linux-gnueabihf-gcc", ["-O0", "-static"], ["qemu-arm"]),
    "riscv64 gcc -O2": ("riscv64-linux-gnu-gcc", ["-O2", "-static"], ["qemu-riscv64"]),
    "riscv64 gcc -O0": ("riscv64-linux-gnu-gcc", ["-O0", "-static"], ["qemu-riscv64"]),
}
PACKAGES = {
    "gcc": "gcc", "clang": "clang", "qemu-arm": "qemu-user", "qemu-riscv64": "qemu-user",
    "arm-linux-gnueabihf-gcc": "gcc-arm-linux-gnueabihf",
    "riscv64-linux-gnu-gcc": "gcc-riscv64-linux-gnu",
}


def sources():
    names = sorted(glob.glob(os.path.join(ROOT, "firmware", "core", "*.c")))
    return names + [DIGEST]


def level_flags(target, source):
    return LEVEL_FLAGS.get(os.path.basename(source), []) if target.startswith("x86-64") else []


def processor_allows(flags):
    """False for instructions that the machine at hand does not have."""
    if "-mfma" not in flags:
        return True
    with open("/proc/cpuinfo", encoding="ascii", errors="replace") as info:
        return {"avx2", "fma"} <= set(info.read().split())


def digest(target, folder):
    compiler, flags, runner = TARGETS[target]
    program = os.path.join(folder, target.replace(" ", "_"))
    objects = []
    for source in sources():
        objects.append(f"{program}_{os.path.basename(source)}.o")
        subprocess.run([*CACHED, compiler, *FLAGS, *flags, *level_flags(target, source), "-c",
                        source, "-o", objects[-1]], check=True)
    subprocess.run([compiler, *flags, *objects, "-lm", "-o", program], check=True)
    done = subprocess.run([*runner, program], check=True, stdout=subprocess.PIPE, text=True)
    return done.stdout.strip()


class Portable(unittest.TestCase):
    def test_all_targets_print_the_same_line(self):
        missing = sorted({PACKAGES[p] for c, _, r in TARGETS.values() for p in [c, *r]
                          if shutil.which(p) is None})
        self.assertEqual(missing, [], "packages to install: " + " ".join(missing))
        targets = [t for t in TARGETS if processor_allows(TARGETS[t][1])]
        for absent in set(TARGETS) - set(targets):
            print(f"not run, this processor lacks its instructions: {absent}")
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

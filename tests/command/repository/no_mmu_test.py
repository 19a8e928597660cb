# SPDX-License-Identifier: Apache-2.0
"""What a system without a memory management unit asks: no program starts another process, which it
cannot copy, and threads need little memory, which it gives them at once."""
import os
import subprocess
import tempfile
import unittest

from pairs import VERGENCE

BUILD = os.path.dirname(os.path.dirname(VERGENCE))
FORBIDDEN = {"fork", "vfork", "_Fork", "clone", "system", "popen", "daemon", "forkpty", "wordexp",
             "posix_spawn", "posix_spawnp"}


def needed_by(program):
    """The functions of shared libraries that a program calls."""
    text = subprocess.run(["nm", "-D", "-u", program], check=True, capture_output=True,
                          text=True).stdout
    return {line.split()[-1].split("@")[0] for line in text.splitlines()}


def thread_local_bytes(program):
    """Bytes of the variables that each thread has a copy of, at the top of its stack."""
    text = subprocess.run(["readelf", "-lW", program], check=True, capture_output=True,
                          text=True).stdout
    sizes = [line.split()[5] for line in text.splitlines() if line.split()[:1] == ["TLS"]]
    return sum(int(size, 16) for size in sizes)


def static_bytes(program):
    """Bytes of the program's variables, which take one block."""
    line = subprocess.run(["size", program], check=True, capture_output=True,
                          text=True).stdout.splitlines()[1]
    return sum(map(int, line.split()[1:3]))


class NoMmu(unittest.TestCase):
    def test_no_program_starts_another(self):
        # That of a PC starts the browser, a daemon for two webcams, and ffmpeg.
        for name in ("daemon/vergenced", "daemon/vergence-board"):
            needed = needed_by(os.path.join(BUILD, name))
            with self.subTest(name):
                self.assertIn("read", needed)
                self.assertEqual(needed & FORBIDDEN, set())

    def test_threads_have_few_variables_of_their_own(self):
        for name in ("daemon/vergenced", "daemon/vergence-board"):
            self.assertLess(thread_local_bytes(os.path.join(BUILD, name)), 1024, name)

    def test_variables_fit_a_block(self):
        for name in ("daemon/vergenced", "daemon/vergence-board"):
            self.assertLess(static_bytes(os.path.join(BUILD, name)), 1 << 20, name)

    def test_the_checks_can_fail(self):
        with tempfile.TemporaryDirectory() as folder:
            source, program = os.path.join(folder, "bad.c"), os.path.join(folder, "bad")
            with open(source, "w", encoding="ascii") as file:
                file.write("#include <stdlib.h>\n_Thread_local char buffer[2000];\n"
                           "int main(void) { return system(buffer); }\n")
            subprocess.run(["gcc", source, "-o", program], check=True)
            self.assertIn("system", needed_by(program) & FORBIDDEN)
            self.assertGreater(thread_local_bytes(program), 1024)


if __name__ == "__main__":
    unittest.main()

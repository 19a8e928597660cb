# SPDX-License-Identifier: Apache-2.0
"""No program starts another process: a system without a memory management unit cannot copy one, and
a confined daemon may not."""
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


class ProcessSymbols(unittest.TestCase):
    def test_no_program_starts_another(self):
        for name in ("daemon/vergenced", "daemon/vergence-board", "tools/vergence"):
            needed = needed_by(os.path.join(BUILD, name))
            with self.subTest(name):
                self.assertIn("read", needed)
                self.assertEqual(needed & FORBIDDEN, set())

    def test_the_check_can_fail(self):
        with tempfile.TemporaryDirectory() as folder:
            source, program = os.path.join(folder, "bad.c"), os.path.join(folder, "bad")
            with open(source, "w", encoding="ascii") as file:
                file.write("#include <stdlib.h>\nint main(void) { return system(\"true\"); }\n")
            subprocess.run(["gcc", source, "-o", program], check=True)
            self.assertIn("system", needed_by(program) & FORBIDDEN)


if __name__ == "__main__":
    unittest.main()

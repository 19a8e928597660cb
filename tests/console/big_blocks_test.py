# SPDX-License-Identifier: Apache-2.0
"""Of the daemon's memory only frames, and what is made of whole ones, take more than 1 MiB in one piece:
on a small system, or one without a memory management unit, there are few such pieces. The arena of a
surface, whose size is checked before, comes from mmap and is not counted."""
import bisect
import os
import subprocess
import unittest

from daemon_process import VERGENCED, DaemonTest
from reconstruct_test import Surfaces

# Who may ask for more.
FRAMES = {"raw_memory_allocate",  # frames
          "new_piece",            # a frame on its way into a recording
          "make_file",            # the picture of a pair
          "append",               # and its file
          "picture_develop"}


class BigBlocks:
    environment = {}

    @classmethod
    def start(cls):
        cls.report = os.path.join(cls.folder, "blocks")
        cls.environment = {"LD_PRELOAD": os.environ["VERGENCE_BIG_BLOCKS"],
                           "BIG_BLOCKS": cls.report}
        super().start()

    def callers(self):
        """The functions that asked for more than 1 MiB, with the most bytes."""
        symbols = []
        for line in subprocess.run(["nm", VERGENCED], check=True, capture_output=True,
                                   text=True).stdout.splitlines():
            words = line.split()
            if len(words) == 3 and words[1] in "tT":
                # A part that the compiler moved has the name of the whole.
                symbols.append((int(words[0], 16), words[2].split(".")[0]))
        symbols.sort()
        found = {}
        if os.path.exists(self.report):
            with open(self.report, encoding="ascii") as file:
                for line in file:
                    size, place = line.split()
                    at = bisect.bisect(symbols, (int(place, 16), "")) - 1
                    name = symbols[at][1]
                    found[name] = max(found.get(name, 0), int(size))
        return found


class LargePairs(BigBlocks, DaemonTest):
    def test_the_rig_s_commands(self):
        client = self.client()
        # A picture of a byte a pixel is more than 1 MiB, and a quarter of the sensor is enough.
        window = "window 1408 1024"
        for command in ("bringup", window, "record start r", "bringup", window, "capture", "record stop", "replay r",
                        "capture p", "view", "files", "settings save", "bugreport"):
            self.assertEqual(client.ask(command)[-1], "OK", command)
        found = self.callers()
        self.assertIn("raw_memory_allocate", found)
        self.assertEqual({name: size for name, size in found.items() if name not in FRAMES}, {})


class Reconstruction(BigBlocks, Surfaces):
    def test_a_surface(self):
        self.session("c")
        self.asked("reconstruct c near=1600 far=2300")
        self.assertEqual(self.callers(), {})


if __name__ == "__main__":
    unittest.main()

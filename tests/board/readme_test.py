# SPDX-License-Identifier: Apache-2.0
"""The way from nothing to a surface of firmware/system/README.md, as written: at the board's terminal and
in a shell on the PC."""
import os
import re
import shlex
import socket
import subprocess
import unittest

from board_process import COMMAND_LIMIT_S, ROOT, VERGENCE, Board, BoardTest

PAGE = ROOT / "firmware/system/README.md"
PORT = "7878"


def blocks():
    """Kind and lines of the blocks, in their order."""
    found = re.findall(r"^```(sh board|instrument|sh pc)\n(.*?)^```", PAGE.read_text(encoding="utf-8"),
                       re.M | re.S)
    return [(kind, text.splitlines()) for kind, text in found]


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return str(taken.getsockname()[1])


class FromNothingToASurface(BoardTest):
    def test_every_line(self):
        folder, port = self.new_folder(), free_port()
        (folder / "tools").symlink_to(ROOT / "tools")
        environment = {**os.environ, "PATH": os.pathsep.join((os.path.dirname(VERGENCE),
                                                              os.environ["PATH"]))}
        (first, (start,)), *rest = blocks()
        self.assertEqual(first, "sh board")
        tool, *words = shlex.split(start.replace(PORT, port))
        self.assertEqual(tool, "tools/board")
        words.remove("--dir")
        words.remove("bench")
        (folder / "bench").mkdir()
        self.board = Board(folder / "bench", *words)
        self.addCleanup(self.board.close)
        self.board.wait_prompt()
        for kind, lines in rest:
            for line in lines:
                if kind == "instrument":
                    self.assertRegex(self.board.type(line), r"OK$", line)
                    continue
                done = subprocess.run(["bash", "-c", line.replace(PORT, port)], cwd=folder, text=True,
                                      capture_output=True, timeout=COMMAND_LIMIT_S, env=environment,
                                      check=False)
                self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")
        self.assertGreater((folder / "surface/mesh.ply").stat().st_size, 100_000)
        self.assertGreater((folder / "whole/mesh.ply").stat().st_size, 10_000_000)
        self.assertTrue((folder / "whole/report.html").exists())


if __name__ == "__main__":
    unittest.main()

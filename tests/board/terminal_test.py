# SPDX-License-Identifier: Apache-2.0
"""The serial line as a person, a script and the PC's client use it: tools/board with the image."""
import re
import subprocess
import unittest

from board_process import (BOOT_LIMIT_S, COMMAND_LIMIT_S, SCENE, VERGENCE, Board, BoardTest, SurfaceTest,
                           board_command)
from waiting import wait_until


class Terminal(BoardTest):
    def test_what_a_newcomer_types(self):
        board = self.start("--scene", "mug", "--zoom", "3x")
        board.wait(r"vergence> bringup\r\n.*?^OK\r\n", BOOT_LIMIT_S)
        board.wait(r"vergence> pan 3.57 right=-3.27\r\n.*?^OK\r\n", COMMAND_LIMIT_S)
        board.wait(r"vergence> zoom 3x\r\n.*?^OK\r\n", COMMAND_LIMIT_S)
        board.wait_prompt(COMMAND_LIMIT_S)
        # Near enough for the gears' play.
        for factor in re.findall(r"magnification: (\S+) x", board.type("lens status")):
            self.assertAlmostEqual(float(factor), 3, delta=0.05)
        board.send("\x1d")
        self.assertEqual(board.wait_end(), 0)
        self.assertIn("board is off", board.report())

    def test_a_script_at_the_standard_input(self):
        lines = "status\npan 3\n"  # the second one fails
        done = subprocess.run(board_command("--network", "user"), input=lines, text=True,
                              capture_output=True, timeout=BOOT_LIMIT_S, check=False)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn("\nvergence> status\n", done.stdout)
        self.assertEqual(done.stdout.count("vergence> "), lines.count("\n"), done.stdout)
        self.assertNotIn("\r", done.stdout)

    def test_rescue_is_a_shell(self):
        board = self.start("--rescue")
        board.wait(r"\(ash\)\s+# $", BOOT_LIMIT_S)
        board.send("ps | grep -c '[v]ergenced'; echo ready''now\r")
        self.assertRegex(board.wait(r"^readynow", COMMAND_LIMIT_S), r"\n0\r?\n")
        board.send("poweroff -f\r")
        self.assertEqual(board.wait_end(), 0)


class SerialLine(SurfaceTest):
    def vergence(self, *words):
        """The PC's client at the serial line."""
        return self.on_host(VERGENCE, "--connect", f"serial:{self.board.folder}/line", *words)

    def test_the_pc_s_client_at_the_serial_line(self):
        folder = self.new_folder()
        board = self.board = Board(folder, *SCENE, "--serial", str(folder / "line"))
        self.addCleanup(board.close)
        wait_until((folder / "line").is_symlink, "no serial line", BOOT_LIMIT_S, 0.1)
        sent = bytes(range(256)) * 64
        (folder / "sent").write_bytes(sent)
        for words in (("status",), ("send", "sent"), ("fetch", "sent", "fetched"), ("bugreport",)):
            self.vergence(*words)
        self.assertEqual((folder / "fetched").read_bytes(), sent)
        self.assert_surface_is_the_pc_s("96 72")


if __name__ == "__main__":
    unittest.main()

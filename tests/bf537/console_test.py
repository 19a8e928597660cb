# SPDX-License-Identifier: Apache-2.0
"""The instrument on its own processor: the firmware at its console, in front of the simulated rig."""
import json
import os
import pathlib
import re
import tempfile
import unittest

from bf537_board import Board, require_tool_chain


def setUpModule():
    require_tool_chain()


class Console(unittest.TestCase):
    def board(self, *rig):
        board = Board(rig or None)
        self.addCleanup(board.close)
        board.wait_prompt()
        return board

    def test_a_person_brings_the_instrument_up_and_moves_it(self):
        board = self.board("--scene", "cylinder")
        self.assertRegex(board.type("bringup"), r"(?s)state: ready.*interrupt line, state works\nOK")
        self.assertRegex(board.type("pan 3"), r"left: (2\.99|3\.00)\d deg\nright: (2\.99|3\.00)\d deg\nOK")
        self.assertRegex(board.type("zoom 3x"), r"(?s)magnification: (2\.9|3\.0)\d x.*\nOK")
        self.assertRegex(board.type("pan 300"), r"ERR RANGE pan: ANGLE \"300\" is too large")
        self.assertRegex(board.type("statsu"), r"ERR ARGUMENT unknown command .*did you mean \"status\"")
        self.assertRegex(board.type("help pan"), r"(?s)usage: pan .*\nOK")
        self.assertRegex(board.type("board"), r"(?s)started: power on or reset\n.*stack_used: [1-9]\d* bytes.*\nOK")

    def test_what_is_missing_is_named(self):
        board = self.board()
        self.assertRegex(board.type("bringup"), r"ERR \w+ .*FPGA bridge")

    def test_the_client_of_the_daemon_talks_to_the_firmware(self):
        board = self.board("--scene", "plane")
        done = board.client("--json", "status")
        self.assertEqual(json.loads(done.stdout)["result"]["state"], "down", done.stderr)
        done = board.client("--json", "pan", "3")
        self.assertEqual((json.loads(done.stdout)["error"], done.returncode), ("NOT_READY", 1), done.stderr)

    def test_files_come_from_the_client_and_go_back(self):
        board = self.board()
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for size in (0, 5000):
                sent, back = folder / f"sent{size}", folder / f"back{size}"
                sent.write_bytes(os.urandom(size))
                done = board.client("send", sent)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertRegex(board.client("files").stdout, f"file sent{size}, size {size} bytes")
                done = board.client("fetch", sent.name, back)
                self.assertEqual((done.returncode, back.read_bytes()), (0, sent.read_bytes()), done.stderr)
            large = folder / "large"
            large.write_bytes(bytes(400000))
            for words, error in (("send", large), "FULL"), (("fetch", "none"), "MISSING"), (("files", "none"), "MISSING"):
                done = board.client(*words, cwd=name)
                self.assertEqual((done.returncode, error in done.stderr), (1, True), done.stderr)
        self.assertRegex(board.type("capture"), "ERR NOT_READY")

    def test_damaged_and_endless_lines_are_refused(self):
        board = self.board()
        os.write(board.far, b"@json,crc=00000000 status\r")
        self.assertIn('"error": "CRC"', board.read_until(lambda text: re.search(r"\}\n|fault: ", text)))
        board.type("@program")
        self.assertIn("ERR SYNTAX", board.ask("x" * 5000))
        self.assertIn("ERR SYNTAX", board.ask("\x01\x7f"))
        self.assertIn("no valid CRC", board.ask("@crc=00000000 status"))
        self.assertTrue(json.loads(board.ask("@json status"))["ok"])


if __name__ == "__main__":
    unittest.main()

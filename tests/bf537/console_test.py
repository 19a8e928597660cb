# SPDX-License-Identifier: Apache-2.0
"""The instrument on its own processor: the firmware in the Blackfin simulator, whose bus, pixels and pins are
those of the simulated rig, at its console."""
import json
import os
import pathlib
import pty
import re
import select
import subprocess
import tempfile
import tty
import unittest

from waiting import TIMEOUT_S, wait_until

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
PROMPT = "vergence> "


def output_of(*words, folder=None):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True,
                          cwd=folder).stdout.strip()


def setUpModule():
    tool = ROOT / "tools/bfin-toolchain"
    if subprocess.run([tool, "--where"], capture_output=True, check=False).returncode != 0:
        raise unittest.SkipTest("requires the tool chain of the Blackfin: run tools/bfin-toolchain once")
    Board.simulator = output_of(tool, "--simulator")
    Board.image = pathlib.Path(output_of(ROOT / "tools/cross", "bfin")) / "firmware/vergence-bf537.elf"


class Board:
    """The simulated processor, with a rig or with nothing connected."""

    def __init__(self, rig=None, image=None):
        self.rig = None
        self.folder = tempfile.TemporaryDirectory()
        environment = {**os.environ}
        if rig is not None:
            address = pathlib.Path(self.folder.name, "rig.sock")
            self.address = f"unix:{address}"
            self.rig = subprocess.Popen([os.environ["SIMRIG"], *rig, "--listen", self.address],
                                        stdout=subprocess.DEVNULL)
            wait_until(address.exists, "the simulated rig listens")
            environment["VERGENCE_SIMRIG"] = self.address
        self.line, far = pty.openpty()
        tty.setraw(far)
        self.far, self.name, self.text = far, os.ttyname(far), ""
        self.process = subprocess.Popen([self.simulator, "--environment", "operating", "--model", "bf537",
                                         image or self.image], stdin=self.line, stdout=self.line, env=environment)

    def close(self):
        for process in (self.process, self.rig):
            if process is not None:
                process.kill()
                process.wait()
        os.close(self.line)
        os.close(self.far)
        self.folder.cleanup()

    def read_until(self, ends):
        """What comes up to a text that `ends` accepts."""
        def complete():
            if not ends(self.text) and select.select([self.far], [], [], 0.1)[0]:
                # A line's end may come in two parts.
                self.text = (self.text + os.read(self.far, 4096).decode()).replace("\r\n", "\n")
            return ends(self.text)
        wait_until(complete, lambda: f"the console does not answer: {self.text!r}")
        found, self.text = self.text, ""
        return found

    def write(self, data):
        os.write(self.far, data)

    def wait_prompt(self):
        return self.read_until(lambda text: text.endswith(PROMPT))

    def type(self, line):
        """A command's answer, up to OK or ERR; the editor draws its line, and bars, over what was there."""
        os.write(self.far, line.encode() + b"\r")
        text = self.read_until(lambda text: re.search(r"\n(.*\r)?(OK|ERR .*)\n", text))
        return re.sub(r"(?m)^.*\r", "", text)

    def ask(self, line):
        """A program's line, and the answer of one line."""
        os.write(self.far, line.encode() + b"\n")
        return self.read_until(lambda text: text.endswith("\n"))


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
        asked = (os.environ["VERGENCE"], "--connect", f"serial:{board.name}", "--json")
        done = subprocess.run([*asked, "status"], capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        self.assertEqual(json.loads(done.stdout)["result"]["state"], "down", done.stderr)
        done = subprocess.run([*asked, "pan", "3"], capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        self.assertEqual((json.loads(done.stdout)["error"], done.returncode), ("NOT_READY", 1), done.stderr)

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

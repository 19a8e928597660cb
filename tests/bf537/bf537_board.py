# SPDX-License-Identifier: Apache-2.0
"""The firmware in the Blackfin simulator, whose bus, pixels and pins are those of the simulated rig."""
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


def require_tool_chain():
    tool = ROOT / "tools/bfin-toolchain"
    if subprocess.run([tool, "--where"], capture_output=True, check=False).returncode != 0:
        raise unittest.SkipTest("requires the tool chain of the Blackfin: run tools/bfin-toolchain once")
    Board.simulator = output_of(tool, "--simulator")
    Board.image = pathlib.Path(output_of(ROOT / "tools/cross", "bfin")) / "firmware/vergence-bf537.elf"


class Board:
    """The simulated processor, with a rig or with nothing connected."""
    silence_s = 10 * TIMEOUT_S

    def __init__(self, rig=None, image=None, flash=None, cut=None):
        """`flash`: the file that keeps it; `cut`: the number of the programming in which its power fails."""
        self.rig = None
        self.folder = tempfile.TemporaryDirectory()
        environment = {**os.environ, **({"VERGENCE_FLASH": str(flash)} if flash else {}),
                       **({"VERGENCE_FLASH_CUT": str(cut)} if cut else {})}
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
        """What comes up to a text that `ends` accepts; only a silence is an error."""
        while not ends(self.text):
            wait_until(lambda: select.select([self.far], [], [], 0.1)[0],
                       lambda: f"the console does not answer: {self.text!r}", self.silence_s)
            # A line's end may come in two parts.
            self.text = (self.text + os.read(self.far, 4096).decode()).replace("\r\n", "\n")
        found, self.text = self.text, ""
        return found

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

    def write(self, data):
        os.write(self.far, data)

    def client(self, *words, **options):
        """The daemon's client at the console's line."""
        return subprocess.run([os.environ["VERGENCE"], "--connect", f"serial:{self.name}", *words],
                              capture_output=True, text=True, timeout=10 * TIMEOUT_S, check=False, **options)

# SPDX-License-Identifier: Apache-2.0
"""Every command of the daemon's README and manual runs, in their order, on the simulated rig. The
example of TCP is run by access_test."""
import glob
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from access_test import free_port
from bad_line import BadLine
from daemon_process import TIMEOUT_S, SIMRIG, VERGENCE, VERGENCED, DaemonTest, Terminal

ROOT = pathlib.Path(os.environ["VERGENCE_SOURCE"])
TEXT = "".join((ROOT / "daemon" / page).read_text(encoding="utf-8")
               for page in ("README.md", "manual.md"))
SESSION = pathlib.Path(os.environ["VERGENCE_SESSIONS"]) / "cylinder_1x"


def commands():
    """The lines of the shell blocks, without their comments."""
    blocks = re.findall(r"^```sh(?: serial)?\n(.*?)^```", TEXT, re.S | re.M)
    return [line.split("  #")[0].rstrip() for block in blocks for line in block.splitlines()]


@unittest.skipUnless(SIMRIG, "the simulated rig needs -DVERGENCE_FPGA=ON")
class Commands(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="readme"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.console = Terminal()
        self.addCleanup(self.console.close)
        self.line = BadLine(self.console, 1, 0, 0)  # it loses nothing
        self.addCleanup(self.line.close)
        programs = {os.path.dirname(program)
                    for program in (VERGENCED, os.environ["VERGENCE"], VERGENCE)}
        self.environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0",
                            "PATH": os.pathsep.join([*programs, os.environ["PATH"]])}

    def run_line(self, line):
        done = subprocess.run(["bash", "-c", line], cwd=self.folder, env=self.environment,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=4 * TIMEOUT_S, check=False)
        self.assertEqual(done.returncode, 0, f"{line}\n{done.stdout}{done.stderr}")

    def begin(self, line):
        """A program in the background; as when pasted, the next line does not wait for it."""
        process = subprocess.Popen(["bash", "-c", "exec " + line.removesuffix(" &")],
                                   cwd=self.folder, env=self.environment,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        self.addCleanup(DaemonTest.end, process)

    def test_every_command_runs(self):
        lines, port = commands(), free_port()
        self.assertGreaterEqual(len(lines), 18)
        calibration, = SESSION.glob("calibration-*.txt")
        shutil.copy(calibration, self.folder / "rig.txt")
        for line in lines:
            line = line.replace("/dev/ttyUSB0", self.line.name)
            line = line.replace("192.0.2.2:7878", f"127.0.0.1:{port}")
            if line.startswith("vergence simulate"):
                self.begin(line)
            elif line.endswith(" &"):
                self.begin(f"{line.removesuffix(' &')} console={self.console.name} tcp_port={port} "
                           "tcp_network=192.0.2.0/24 tcp_token=board.token")
            elif " fetch bugreport-" in line:
                made, = glob.glob("bugreport-*.txt", root_dir=self.folder / "files")
                self.run_line(re.sub(r"bugreport-\S+", made, line))
                self.assertTrue((self.folder / made).exists())
            else:
                self.run_line(line)
        for pattern in ("images/scene-pair1-*.png", "view-*.png"):
            self.assertEqual(len(list(self.folder.glob(pattern))), 2, pattern)


if __name__ == "__main__":
    unittest.main()

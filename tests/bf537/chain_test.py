# SPDX-License-Identifier: Apache-2.0
"""The whole chain on the instrument's own processor: the README's commands from bring-up to a surface by the
calibration of all zooms, then zoom by what is wanted, and focus. Pair and surface are the bytes that vergenced gets
from the same rig by the same commands. The rig has no noise: that of a frame depends on when it is taken."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from bf537_board import Board, require_tool_chain
from waiting import TIMEOUT_S, wait_until

setUpModule = require_tool_chain
RIG = ("--scene", "cylinder", "--rig", "perfect")
DISTANCE_MM = 1800
README = (pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "firmware/bf537/README.md").read_text(encoding="utf-8")
START = re.search(r"(?ms)^export PATH=.*?(?=^vergence --connect)", README).group()
COMMANDS = [line.split() for line in re.findall(r"(?m)^vergence --connect serial:dsp (.*)$", README)]


def run_daemon(lines, folder):
    """What vergenced answers to these lines, in front of a new rig; its files are in folder/files."""
    socket = folder / "pc.sock"
    with subprocess.Popen([os.environ["SIMRIG"], *RIG, "--listen", f"unix:{socket}"],
                          stdout=subprocess.DEVNULL) as rig:
        try:
            wait_until(socket.exists, "the simulated rig listens")
            return subprocess.run([os.environ["VERGENCED"], f"backend=sim unix:{socket}", "console=stdio",
                                   "socket=none", f"files={folder}/files", f"store={folder}/store"], check=False,
                                  input="".join(f"{line}\n" for line in lines), text=True, timeout=TIMEOUT_S,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT).stdout
        finally:
            rig.kill()


class Chain(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_rig_and_board_start_as_a_reader_pastes_it(self):
        (self.folder / "tools").symlink_to(pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tools")
        start = START.replace("$(tools/build --where demo)/tools", str(pathlib.Path(os.environ["VERGENCE"]).parent))
        done = subprocess.run(["bash", "-euc", f"trap 'kill $(jobs -p)' EXIT\n{start}"], cwd=self.folder, timeout=TIMEOUT_S, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("started: power on", done.stdout)

    def assert_distance(self, mm):
        self.assertAlmostEqual(mm, DISTANCE_MM, delta=0.02 * DISTANCE_MM)

    def check_measure(self, board):
        """Refusals and the plan: a whole one takes minutes of the simulator."""
        self.assertRegex(board.type("measure cup fit=300"), "ERR MISSING measure: no calibration is set")
        self.assertEqual(board.client("send", "tests/bf537/perfect.zoom", cwd=self.folder).returncode, 0)
        self.assertRegex(board.type("calibration set perfect.zoom"), r"\nOK\n")
        self.assertRegex(board.type("measure cup fit=300 at=1,2"), "ERR UNSUPPORTED measure: at .*view")
        done = board.client("measure", "cup", "--fit", "80", "--plan", cwd=self.folder)
        self.assertEqual(done.returncode, 0, (done.stdout, done.stderr))
        for words in ("wide pair: distance", "zoom: both see 8", "merged pair: ", "surface: from "):
            self.assertIn(words, done.stdout)

    def test_pair_and_surface_are_those_of_the_daemon(self):
        board = Board(RIG)
        self.addCleanup(board.close)
        board.wait_prompt()
        self.assertRegex(board.type("reconstruct"), "ERR MISSING reconstruct: no pair")
        (self.folder / "tests").symlink_to(pathlib.Path(os.environ["VERGENCE_SOURCE"]) / "tests")
        for words in COMMANDS:
            if words[0] == "send":
                self.assertRegex(board.type("zoom fit=100 distance=1800"), "ERR MISSING zoom: .* calibration")
                self.check_measure(board)
            done = board.client(*words, cwd=self.folder)
            self.assertEqual(done.returncode, 0, (words, done.stdout, done.stderr))
        result = json.loads((self.folder / "surface/result.json").read_text())
        self.assertGreater(result["counts"]["vertices"], 4000, result["counts"])
        self.assert_distance(result["depth_mm"]["median"])
        self.assertEqual(board.client("fetch", "pair-1", cwd=self.folder).returncode, 0)
        # Vergenced would correct the calibration of all zooms by the pair.
        files = self.folder / "files"
        files.mkdir()
        (files / "state.txt").write_text(result["calibration"]["text"])
        rig_lines = [" ".join(words) for words in COMMANDS if words[0] in ("bringup", "window", "pan", "autoexpose")]
        search = [option for option in COMMANDS[-1][1:] if "=" in option]
        answers = run_daemon([*rig_lines, "calibration set state.txt", "capture session",
                              " ".join(["reconstruct", "preset=board", *search])], self.folder)
        self.assertEqual(answers.count("OK\n"), len(rig_lines) + 3, answers)
        frames = {path.read_bytes() for path in (files / "session").glob("frame-*")}
        self.assertEqual({(self.folder / "pair-1" / name).read_bytes() for name in ("left.pgm", "right.pgm")}, frames)
        compact, = files.glob("surface-session*/surface.compact")
        subprocess.run([os.environ["VERGENCE"], "reconstruct", compact, "--out", self.folder / "pc"], check=True,
                       stdout=subprocess.DEVNULL)
        for name in ("disparity.pfm", "reasons.png", "depth.png"):
            dsp, pc = ((self.folder / made / name).read_bytes() for made in ("surface", "pc"))
            self.assertEqual(dsp, pc, name)
        # A frame of it takes longer than the rig waits at a time.
        for line in ("window 1600 1200", "capture"):
            self.assertRegex(board.type(line), r"\nOK\n", line)
        for line in ("window 96 96", "zoom density=3 distance=1800"):
            self.assertRegex(board.type(line), r"\nOK\n", line)
        found = re.findall(r"verdict: focused\n(?:.*\n){3}  distance: ([\d.]+) mm\n", board.type("autofocus"))
        self.assertEqual(len(found), 2)
        for mm in found:
            self.assert_distance(float(mm))


if __name__ == "__main__":
    unittest.main()

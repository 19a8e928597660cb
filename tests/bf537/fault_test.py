# SPDX-License-Identifier: Apache-2.0
"""What ends the firmware is reported with its reason, registers and calls, which name where it was."""
import pathlib
import re
import tempfile
import unittest
import zlib

import bf537_board
from bf537_board import Board, output_of
from waiting import TIMEOUT_S, wait_until

setUpModule = bf537_board.require_tool_chain
# By the key that tests/bf537/faults.c takes: reason, and the function that was running.
FAULTS = {
    b"u": ("undefined instruction at", "provoke_undefined_instruction"),
    b"p": ("undefined instruction at", "parallel_call"),
    b"l": ("undefined instruction at", "provoke_in_l1"),
    b"m": ("misaligned access to data at", "provoke_misaligned_access"),
    b"i": (r"internal error at faults\.c:\d+: value == 0", None),
    b"s": ("the stack ran over its end", None),
    b"c": ("the data cache is on .*dcache off", None),
}


class Fault(unittest.TestCase):
    def report(self, key):
        program = Board.image.with_name("bf537-faults.elf")
        board = Board(image=program)
        self.addCleanup(board.close)
        board.read_until(lambda text: text.endswith("started: power on or reset\n"))
        board.write(key)
        report = board.read_until(lambda text: "then shows this reason\n" in text)
        tools = pathlib.Path(output_of(bf537_board.ROOT / "tools/bfin-toolchain", "--where"), "bin")
        places = re.findall(r"retx=(0x\w+)", report) + re.findall(r"=(0x\w+)", report.partition("calls:")[2])
        named = output_of(tools / "bfin-elf-addr2line", "-f", "-e", program, *places) if places else ""
        return report, named

    def test_each_is_reported_with_its_place(self):
        for key, (reason, function) in FAULTS.items():
            with self.subTest(reason):
                report, named = self.report(key)
                self.assertRegex(report, rf"\nfault: {reason}")
                if function is not None:
                    self.assertRegex(report, r"(?s)r0=0x\w{8}.* seqstat=0x\w{8}")
                    self.assertIn(function, named)
                    # What called it.
                    self.assertIn("bf537_main", named)


class Flash(unittest.TestCase):
    """The calibration survives a restart, and a power failure while it is replaced leaves the old or the new."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        text = (bf537_board.ROOT / "tests/bf537/perfect.zoom").read_bytes().rpartition(b"crc32 ")[0]
        for name in "abc":
            named = text.replace(b"id perfect", b"id " + name.encode(), 1)
            (self.folder / f"{name}.zoom").write_bytes(named + b"crc32 %08x\n" % zlib.crc32(named))

    def board(self, cut=None):
        board = Board(flash=self.folder / "flash", cut=cut)
        self.addCleanup(board.process.kill)
        board.wait_prompt()
        return board

    def kept(self):
        board = self.board()
        found = re.search(r"\nid: (\w)\n|ERR MISSING", board.type("calibration"))
        board.process.kill()
        return found[1]

    def send(self, name, cut=None):
        """Sets a calibration; with `cut` the power fails before the end."""
        board = self.board(cut)
        self.assertEqual(board.client("send", self.folder / f"{name}.zoom").returncode, 0)
        if cut is None:
            self.assertIn("\nOK\n", board.type(f"calibration set {name}.zoom"))
            board.process.kill()
        else:
            board.write(f"calibration set {name}.zoom\r".encode())
            board.process.wait(TIMEOUT_S)

    def test_the_calibration_survives_restarts_and_power_failures(self):
        self.assertIsNone(self.kept())
        self.send("a")
        self.assertEqual(self.kept(), "a")
        # In the erasure, in the text, and in the head, which is of 30 words and comes last.
        words = 1 + ((self.folder / "b.zoom").stat().st_size + 1) // 2
        for cut in (1, 2, words // 2, words + 1, words + 20):
            self.send("b", cut)
            self.assertEqual(self.kept(), "a", cut)
        self.send("b")
        self.assertEqual(self.kept(), "b")
        self.send("c", 2)
        self.assertEqual(self.kept(), "b")
        board = self.board()
        self.assertIn("\nOK\n", board.type("calibration forget"))
        board.process.kill()
        self.assertIsNone(self.kept())


class Rig(unittest.TestCase):
    FAULTS = (("camera left silent", "camera left ok", "autoexpose", "ERR TIMEOUT left camera: no pixel clock"),
              ("serial silent", "serial ok", "bringup", "ERR TIMEOUT left lens: its controller does not answer"),
              ("bus sda", "bus ok", "pan 5", "ERR I2C_ARBITRATION left servo"))

    def control(self, command):
        return output_of(bf537_board.ROOT / "tools/simrig/control", self.board.address, command)

    def time_s(self):
        return float(re.search(r"time_s: ([\d.]+)", self.control("status"))[1])

    def test_a_part_that_fails_leaves_servos_safe_and_a_console_that_answers(self):
        self.board = Board(("--scene", "plane"))
        self.addCleanup(self.board.close)
        self.board.wait_prompt()
        for fault, end, command, reason in self.FAULTS:
            with self.subTest(fault):
                self.assertIn("OK", self.board.type("bringup"))
                self.assertIn("OK", self.board.type("pan 3"))
                self.assertIn("pan_driven: true", self.control("status"))
                self.control(f"fault {fault}")
                self.assertIn(reason, self.board.type(command))
                failed_s = self.time_s()
                self.assertIn("state: safe", self.board.type("status"))
                self.assertLess(self.time_s() - failed_s, 2)
                # Without pulses on the bridge's pins for a moment a servo lets go.
                wait_until(lambda: "pan_driven: true" not in self.control("status"), "the servos are let go")
                self.control(f"fault {end}")

    def test_a_surface_that_does_not_fit_is_refused_before_it_is_computed(self):
        board = Board(("--scene", "cylinder", "--rig", "perfect"))
        self.addCleanup(board.close)
        board.wait_prompt()
        for line in ("bringup", "window 640 480", "pan 3.97 right=-3.97", "capture"):
            self.assertIn("\nOK\n", board.type(line))
        self.assertEqual(board.client("send", "tests/bf537/perfect.zoom", cwd=bf537_board.ROOT).returncode, 0)
        self.assertIn("\nOK\n", board.type("calibration set perfect.zoom"))
        refused = re.search(r"ERR MEMORY reconstruct: ([\d.]+) MB are required, ([\d.]+) MB are there "
                            r"\(scale=([\d.]+) fits\)", board.type("reconstruct scale=4 disparity=0:64"))
        self.assertTrue(refused)
        required, there, scale = map(float, refused.groups())
        self.assertGreater(required, there)
        # Memory grows with the number of pixels.
        self.assertAlmostEqual(scale, 4 * (there / required) ** 0.5, delta=0.11)


if __name__ == "__main__":
    unittest.main()

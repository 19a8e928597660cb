# SPDX-License-Identifier: Apache-2.0
"""The images that U-Boot loads: they are for this processor and address, and what is unpacked from them runs."""
import pathlib
import re
import tempfile
import unittest

import bf537_board
from bf537_board import Board, output_of

setUpModule = bf537_board.require_tool_chain
TYPES = {"uimage": "standalone", "fit": "flat_dt"}


class Image(unittest.TestCase):
    def test_the_loops_over_pixels_are_in_the_memory_within_the_processor(self):
        # A function that is renamed leaves it without an error of the linker.
        tools = pathlib.Path(output_of(bf537_board.ROOT / "tools/bfin-toolchain", "--where"), "bin")
        names = set(re.findall(r"\.text\.([a-z_]+)",
                               (bf537_board.ROOT / "firmware/bf537/link/l1_code.ld").read_text(encoding="utf-8")))
        symbols = output_of(tools / "bfin-elf-nm", Board.image)
        there = set(re.findall(r"(?m)^ffa0\w{4} t _([a-z_]+)", symbols, re.IGNORECASE))
        self.assertEqual(names - there, set())

    def unpack(self, kind, folder):
        """The bytes of an image's program, with the load address and entry that it states."""
        image = Board.image.with_suffix(f".{kind}")
        described = output_of("dumpimage", "-l", image)
        self.assertIn("Blackfin", described)
        addresses = [re.search(rf"{name}: +(?:0x)?([0-9a-f]+)", described)[1] for name in
                     ("Load Address", "Entry Point")]
        output_of("dumpimage", "-T", TYPES[kind], "-p", "0", "-o", folder / "program", image)
        return (folder / "program").read_bytes(), *(int(address, 16) for address in addresses)

    def test_what_is_unpacked_is_the_program_and_runs(self):
        tools = pathlib.Path(output_of(bf537_board.ROOT / "tools/bfin-toolchain", "--where"), "bin")
        header = output_of(tools / "bfin-elf-readelf", "-hl", Board.image)
        entry = int(re.search(r"Entry point address: +0x([0-9a-f]+)", header)[1], 16)
        load = int(re.search(r"LOAD +0x[0-9a-f]+ 0x([0-9a-f]+)", header)[1], 16)
        for kind in TYPES:
            with self.subTest(kind), tempfile.TemporaryDirectory() as work:
                folder = pathlib.Path(work)
                program, at, begins = self.unpack(kind, folder)
                self.assertEqual((at, begins), (load, entry))
                # The simulator takes an ELF file: one around the bytes that U-Boot would have copied there.
                output_of(tools / "bfin-elf-objcopy", "-I", "binary", "-O", "elf32-bfin", "-B", "bfin",
                          "--rename-section", ".data=.text,alloc,load,code,contents", "program", "object.o",
                          folder=folder)
                output_of(tools / "bfin-elf-ld", f"-Ttext={at:#x}", f"--entry={begins:#x}", "-o", "program.elf",
                          "object.o", folder=folder)
                board = Board(image=folder / "program.elf")
                self.addCleanup(board.close)
                board.wait_prompt()
                self.assertIn("OK", board.type("board"))


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""Generates the files in fpga/generated from the register map fpga/registers.rdl.

  bridge_registers.vh    constants for Verilog
  register_file.v        the registers themselves
  register_file_instance.vh  their connection in bridge_core
  register_file_properties.vh  their properties for the proof
  bridge_registers.h     indices, fields and a table for C
  bridge_register_names.h  their names
  registers.md           table for the documentation
  bridge_registers.json  test vectors

Needs systemrdl-compiler (fpga/tools/requirements.txt). Exit code: 0 if all is written or, with
--check, up to date; 1 if a file is stale; 2 if the map is wrong.
"""

import argparse
import sys
from pathlib import Path

import register_properties
import register_text
import register_verilog
from register_model import MapError, read_map

FPGA = Path(__file__).resolve().parent.parent

MAKERS = {
    "bridge_registers.vh": register_verilog.constants,
    "register_file.v": register_verilog.register_file,
    "register_file_instance.vh": register_verilog.instance,
    "bridge_registers.h": register_text.c_header,
    "bridge_register_names.h": register_text.c_names,
    "register_file_properties.vh": register_properties.properties,
    "registers.md": register_text.documentation,
    "bridge_registers.json": register_text.vectors,
}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only report stale files")
    parser.add_argument("--map", type=Path, default=FPGA / "registers.rdl", help="the map")
    parser.add_argument("--into", type=Path, default=FPGA / "generated", help="folder of the files")
    arguments = parser.parse_args()
    try:
        registers = read_map(arguments.map)
    except MapError as error:
        print(f"registers.py: {error}", file=sys.stderr)
        return 2
    stale = []
    for name, maker in MAKERS.items():
        path = arguments.into / name
        text = maker(registers)
        if path.exists() and path.read_text(encoding="utf-8") == text:
            continue
        stale.append(name)
        if not arguments.check:
            path.write_text(text, encoding="utf-8")
    if arguments.check and stale:
        names = ", ".join(stale)
        print(f"registers.py: stale: {names}; run fpga/tools/registers.py", file=sys.stderr)
        return 1
    print(f"registers.py: {len(registers)} registers, {len(stale)} files written")
    return 0


if __name__ == "__main__":
    sys.exit(main())

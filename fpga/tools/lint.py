# SPDX-License-Identifier: Apache-2.0
"""Lint of the bridge's Verilog: verilator -Wall, iverilog -Wall, yosys check, no latches, layout.

Each module is checked as a top module, so that constant ports hide nothing. There is no list of
waivers: a necessary warning is disabled in the source, for one line, with a reason.
"""
import argparse
import concurrent.futures
import glob
import os
import re
import subprocess
import sys
import time

from places import FPGA



def run(words):
    done = subprocess.run(words, cwd=FPGA, capture_output=True, text=True)
    return done.returncode, (done.stdout + done.stderr).strip()


def directories():
    return [name for name in ("rtl", "generated") if os.path.isdir(os.path.join(FPGA, name))]


def sources():
    """Files with synthesisable modules, relative to fpga/."""
    return sorted(os.path.relpath(path, FPGA) for name in directories()
                  for path in glob.glob(os.path.join(FPGA, name, "*.v")))


def module_of(source):
    return os.path.splitext(os.path.basename(source))[0]


def layout(source):
    """Checks the layout rules of the files; returns a list of messages."""
    with open(os.path.join(FPGA, source), encoding="utf-8") as file:
        text = file.read()
    lines = text.splitlines()
    code = re.sub(r"//.*|/\*.*?\*/", "", text)
    wrong = []
    if "SPDX-License-Identifier: Apache-2.0" not in lines[0]:
        wrong.append("no licence in the first line")
    if "`default_nettype none" not in text:
        wrong.append("no `default_nettype none")
    if lines[-1].strip() != "`default_nettype wire":
        wrong.append("does not end with `default_nettype wire")
    modules = re.findall(r"^\s*module\s+(\w+)", code, re.MULTILINE)
    if modules != [module_of(source)]:
        wrong.append(f"holds modules {modules}")
    if re.search(r"\binout\b|\binitial\b", code.split("`ifdef FORMAL")[0]):
        wrong.append("inout or initial outside boards/")
    if len(lines) > 500 and not source.startswith("generated"):
        wrong.append(f"{len(lines)} lines")
    for number, line in enumerate(lines, 1):
        if len(line) > 100 or "\t" in line or line != line.rstrip():
            wrong.append(f"line {number}: longer than 100, tab or blanks at its end")
    return wrong


def verilator(source, macros=()):
    code, log = run(["verilator", "--lint-only", "-Wall", "--language", "1364-2005",
                     *(f"-D{macro}" for macro in macros),
                     *(f"-I{name}" for name in directories()),
                     *(word for name in directories() for word in ("-y", name)),
                     "--top-module", module_of(source), source])
    return [log] if code or log else []


def icarus(source):
    code, log = run(["iverilog", "-g2005", "-Wall", "-t", "null", *(f"-I{name}" for name in
                                                                    directories()),
                     *(word for name in directories() for word in ("-y", name)),
                     "-s", module_of(source), source])
    # Sources have no time scale, as they have no delays.
    log = "\n".join(line for line in log.splitlines() if "timescale" not in line)
    return [log] if code or log else []


def yosys(source):
    everything = " ".join(sources())
    include = " ".join(f"-I{name}" for name in directories())
    code, log = run(["yosys", "-q", "-p",
                     f"read_verilog {include} {everything}; hierarchy -check -top {module_of(source)}; "
                     "proc; flatten; opt_clean; check -assert; "
                     "select -assert-none t:$dlatch t:$adlatch t:$dlatchsr t:$sr"])
    return [log] if code or log else []


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--module", action="append")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    started = time.monotonic()
    chosen = [source for source in sources()
              if not options.module or module_of(source) in options.module]
    if not chosen:
        print("lint.py: no sources", file=sys.stderr)
        return 2
    checks = {"layout": layout, "verilator": verilator,
              "verilator SIM_RANDOM_DELAY": lambda source: verilator(source, ["SIM_RANDOM_DELAY"]),
              "iverilog": icarus, "yosys": yosys}
    wrong = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        asked = [(source, name, pool.submit(check, source))
                 for source in chosen for name, check in checks.items()]
        for source, name, future in asked:
            for sentence in future.result():
                wrong += 1
                print(f"{source}: {name}: {sentence}")
    print(f"{len(chosen)} modules, {len(checks)} checks each, {wrong} findings, "
          f"{time.monotonic() - started:.1f} s")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Formats the results of synth.py: tables, the published record, and the README that shows it."""
import json
import os
import re

from places import FPGA

RECORD = os.path.join(FPGA, "synthesis.json")
README = os.path.join(FPGA, "README.md")
BEGIN = "<!-- synthesis: made by fpga/tools/synth.py --publish; do not edit -->\n"
END = "<!-- synthesis: end -->\n"
DEVICES = {"xc3s": "Spartan-3 XC3S1000", "hx8k": "iCE40 HX8K", "up5k": "iCE40 UP5K, one camera",
           "ecp5": "ECP5 25F"}


def last_error(log):
    """The lines of a tool's log that explain a failure, or its end."""
    lines = [line for line in log.splitlines() if re.match(r"ERROR|.*\berror\b", line)]
    return " ".join(lines[-3:]) or log.strip()[-200:]


def resources(targets, goals):
    lines = ["| device | LUT4 | route-through | carry | FF | BRAM | MULT | of the device |",
             "|---|---|---|---|---|---|---|---|"]
    for target, result in targets.items():
        words = []
        for name in ("LUT4", "through", "carry", "FF", "BRAM", "MULT"):
            goal = goals[target].get(name)
            beside = f" (goal {goal})" if goal is not None else ""
            words.append(f"{result.get(name, '')}{beside}")
        lines.append(f"| {DEVICES[target]} | {' | '.join(words)} | {result['share']:.1%} |")
    return lines


def timings(targets, goals):
    lines = ["| device | control clock, MHz | slowest pixel clock, MHz | pixel to PPI, ns | "
             "control clock with each seed | file |", "|---|---|---|---|---|---|"]
    for target, result in targets.items():
        file = f"{result['file']}, {result['bytes']} bytes"
        if "control" not in result:
            lines.append(f"| {DEVICES[target]} | no open timing model | | | | {file} |")
            continue
        words = []
        for name in ("control", "pixel", "HOP"):
            goal = goals[target].get(name)
            beside = f" (goal {goal:.3g})" if goal is not None else ""
            words.append(f"{result[name]:.1f}{beside}")
        seeds = ", ".join(f"{control:.1f}" for control, _ in result["seeds"].values())
        lines.append(f"| {DEVICES[target]} | {' | '.join(words)} | {seeds} | {file} |")
    return lines


def paths(targets):
    """Not for the ECP5, whose netlist names cells after unrelated nets."""
    return [f"- {DEVICES[target]}, {kind}: `{result[f'{kind}_path']}`"
            for target, result in targets.items() for kind in ("control", "pixel")
            if target != "ecp5" and result.get(f"{kind}_path")]


def tables(record, goals):
    """All tables as Markdown."""
    targets = record["targets"]
    tools = ", ".join(f"{name} {version}" for name, version in record["tools"].items())
    lines = [*resources(targets, goals), "", *timings(targets, goals), "",
             "Ends of the slowest paths:", "", *paths(targets), "",
             f"Verilog {record['stamp']}; {tools}."]
    return "\n".join(lines) + "\n"


def parts(readme):
    """The README before, between and after the markers."""
    before, rest = readme.split(BEGIN)
    between, after = rest.split(END)
    return before, between, after


def publish(record, goals):
    """Writes the record and its tables in the README."""
    with open(README, encoding="utf-8") as file:
        before, _, after = parts(file.read())
    with open(README, "w", encoding="utf-8") as file:
        file.write(before + BEGIN + tables(record, goals) + END + after)
    with open(RECORD, "w", encoding="utf-8") as file:
        json.dump(record, file, indent=1)
        file.write("\n")


def stale(stamp, goals):
    """A message about what is not up to date; empty if everything is."""
    with open(RECORD, encoding="utf-8") as file:
        record = json.load(file)
    if record["stamp"] != stamp:
        return "fpga/synthesis.json is stale (run fpga/tools/synth.py --publish)"
    with open(README, encoding="utf-8") as file:
        if parts(file.read())[1] != tables(record, goals):
            return "the tables in fpga/README.md are not those of fpga/synthesis.json"
    return ""

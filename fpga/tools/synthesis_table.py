# SPDX-License-Identifier: Apache-2.0
"""Formats the results of synth.py, and writes the tables into fpga/RESULTS.md."""
import os
import re

from places import FPGA

RESULTS = os.path.join(FPGA, "RESULTS.md")
HEADING = "## Size and timing\n"
DEVICES = {"xc3s": "Spartan-3 XC3S1000", "hx8k": "iCE40 HX8K", "up5k": "iCE40 UP5K, one camera",
           "ecp5": "ECP5 25F"}


def last_error(log):
    """The lines of a tool's log that explain a failure, or its end."""
    lines = [line for line in log.splitlines() if re.match(r"ERROR|.*\berror\b", line)]
    return " ".join(lines[-3:]) or log.strip()[-200:]


def resources(results):
    lines = ["| device | LUT4 | other LUTs | carry | FF | BRAM | MULT | of the LUTs | of the FFs | "
             "of the cells |", "|---|---|---|---|---|---|---|---|---|---|"]
    for target, result in results.items():
        words = [str(result.get(name, "")) for name in ("LUT4", "other", "carry", "FF", "BRAM", "MULT")]
        words += [f"{share:.1%}" for share in result["shares"]]
        words.append(f"{result['cells']:.1%}" if "cells" in result else "")
        lines.append(f"| {DEVICES[target]} | {' | '.join(words)} |")
    return lines


def timings(results, needs):
    lines = ["| device | control clock, MHz | slowest pixel clock, MHz | pixel to PPI, ns | "
             "control clock with each seed | file |", "|---|---|---|---|---|---|"]
    for target, result in results.items():
        file = f"{result['file']}, {result['bytes']} bytes"
        if "control" not in result:
            lines.append(f"| {DEVICES[target]} | no open timing model | | | | {file} |")
            continue
        words = [f"{result[name]:.1f} (needed {needs[target][name]})"
                 for name in ("control", "pixel")] + [
                     f"{result['hop']:.1f} (worst {result['worst_hop']:.1f})"]
        seeds = ", ".join(f"{control:.1f}" for control, _ in result["seeds"].values())
        lines.append(f"| {DEVICES[target]} | {' | '.join(words)} | {seeds} | {file} |")
    return lines


def paths(results):
    """Not for the ECP5, whose netlist names cells after unrelated nets."""
    return [f"- {DEVICES[target]}, {kind}: `{result[f'{kind}_path']}`"
            for target, result in results.items() for kind in ("control", "pixel")
            if target != "ecp5" and result.get(f"{kind}_path")]


def tables(results, versions, needs):
    """All tables as Markdown."""
    tools = ", ".join(f"{name} {version}" for name, version in versions.items())
    lines = [*resources(results), "", *timings(results, needs), "", "Ends of the slowest paths:", "",
             *paths(results), "", f"{tools}."]
    return "\n".join(lines) + "\n"


def published():
    """The tables in RESULTS.md with their heading; empty if there are none."""
    with open(RESULTS, encoding="utf-8") as file:
        _, heading, text = file.read().partition(HEADING)
    return heading + text


def publish(text):
    """Writes the tables into RESULTS.md, as its last part."""
    with open(RESULTS, encoding="utf-8") as file:
        before = file.read().partition(HEADING)[0]
    with open(RESULTS, "w", encoding="utf-8") as file:
        file.write(f"{before.rstrip()}\n\n{HEADING}\nMade by `python3 fpga/tools/synth.py --publish`;"
                   " [README.md](README.md#size-and-timing) explains\nthe columns.\n\n" + text)

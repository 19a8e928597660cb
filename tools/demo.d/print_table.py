#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the main figures of the demo's results and the paths of their reports.

usage: print_table.py DIR RESULT...
"""
import json
import os
import sys


def load(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def depth_text(bounds):
    return f"{bounds['min'][2] / 1000:.2f} to {bounds['max'][2] / 1000:.2f} m"


def accuracy_text(folder):
    """Against the ground truth, or against the board's known squares."""
    truth, board, rig = (os.path.join(folder, name)
                         for name in ("evaluation.json", "board.json", "measured.json"))
    if os.path.exists(truth):
        score = load(truth)
        return (f"off by more than 2 px: {score['measured_all']['bad_2_percent']:.1f} % of the "
                f"measured pixels; mean {score['measured_all']['average_px']:.2f} px")
    if os.path.exists(board):
        found = load(board)
        return (f"squares {found['square_mm']:.2f} mm (true: {found['true_square_mm']:.0f} mm), flat "
                f"to {found['plane_rms_mm']:.2f} mm; {found['off_plane']} of {found['corners']} "
                "corners wrong")
    if os.path.exists(rig):
        found, common = load(rig), load(rig)["common"] or {}
        texture, fit = found["visible_textured"], found["visible_textured"].get("fit") or {}
        return (f"{texture['measured_percent']:.1f} % of its texture; shape off by "
                f"{fit.get('median_error_px', 0):.2f} px (median), {fit.get('wrong_3px_percent', 0):.2f} % by 3; "
                f"all depths {common.get('error_mm', 0):+.1f} mm, +- "
                f"{common.get('sigma_mm', 0):.1f} predicted")
    return ""


def main():
    if len(sys.argv) < 3:
        sys.exit("usage: print_table.py DIR RESULT...")
    out, names = sys.argv[1], sys.argv[2:]
    print()
    print(f"{'':15} {'points':>9} {'measured':>9}  {'depth':17} {'rows off by':>11} {'time':>7} "
          f"{'memory':>8}")
    for name in names:
        result = load(os.path.join(out, name, "result.json"))
        rows = result["vertical_disparity"]
        print(f"{name:15} {result['counts']['vertices']:9,} {result['density_percent']:7.1f} %  "
              f"{depth_text(result['bounds_mm']):17} "
              f"{(format(rows['median_px'], '8.2f') + ' px') if rows else 'unknown':>11} "
              f"{result['time_ms']['total']:4.0f} ms "
              f"{result['memory_bytes']['arena_peak'] / 1e6:5.0f} MB")
    print()
    for name in names:
        print(f"{name:15} {accuracy_text(os.path.join(out, name))}")
    print("\nReports (open in a browser):")
    for name in names:
        print(f"  {os.path.join(out, name, 'report.html')}")


main()

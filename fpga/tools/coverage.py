# SPDX-License-Identifier: Apache-2.0
"""Lines and toggles of the bridge's Verilog that tests/hdl reaches, measured by Verilator.

Builds the model with counters, runs the test programs, adds up their counts and prints a table of
the bridge's own files. A point that was never reached must be listed in coverage_waivers.json:
  {"file", "kind": "line"|"toggle", "of": pattern, "bits": "0-3,7", "reason"}
where `of` is a pattern (as in fnmatch) of the signal's name for a toggle, without bit number
unless the pattern has one, and of the line's text for a line; bits (may be left out) are the
signal's. An unused waiver is a finding too: it would hide a later point.
"""
import argparse
import collections
import concurrent.futures
import fnmatch
import glob
import json
import os
import re
import subprocess
import sys
import time

from places import FPGA, ROOT, own_cache

CACHE = own_cache("fpga-coverage")
WAIVERS = os.path.join(FPGA, "tools", "coverage_waivers.json")
# Reduced rounds where the default would take long with counters; others keep their default.
ROUNDS = {"hdl_symbols_test": "100000", "hdl_switch_test": "150", "hdl_servo_test": "30",
          "hdl_spikes_test": "400"}
# The slowest tests, which reach no point that the others do not; --all runs them too.
SLOW = ("hdl_abort_test", "hdl_driver_fault_test", "hdl_driver_reboot_test",
        "hdl_driver_recovery_test", "hdl_driver_storm_test")
POINT = re.compile(r"\x01(\w+)\x02([^\x01]*)")
Point = collections.namedtuple("Point", "file line kind what")


def build(jobs, everything):
    """Builds the test programs with counters; returns their paths."""
    folder = os.path.join(CACHE, "build")
    os.makedirs(folder, exist_ok=True)
    names = sorted("hdl_" + os.path.splitext(os.path.basename(path))[0]
                   for path in glob.glob(os.path.join(ROOT, "tests", "hdl", "*_test.cpp")))
    names = [name for name in names if everything or name not in SLOW]
    log_path = os.path.join(CACHE, "build.log")
    with open(log_path, "w", encoding="utf-8") as log:
        for words in (["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", "-DVERGENCE_FPGA=ON",
                       "-DVERGENCE_FPGA_COVERAGE=ON"],
                      ["ninja", "-C", folder, "-j", str(jobs), *names]):
            if subprocess.run(words, stdout=log, stderr=subprocess.STDOUT).returncode != 0:
                sys.exit(f"coverage.py: the build failed, see {log_path}")
    return [os.path.join(folder, "tests", "hdl", name) for name in names]


def run(program, rounds):
    """Runs one program; returns its name, whether it passed, its file of counts."""
    name = os.path.basename(program)
    counts = os.path.join(CACHE, name + ".dat")
    if os.path.exists(counts):
        os.remove(counts)
    environment = {**os.environ, "VERGENCE_COVERAGE": counts}
    if rounds or name in ROUNDS:
        environment["VERGENCE_DRAWS"] = str(rounds or ROUNDS[name])
    with open(os.path.join(CACHE, name + ".log"), "w", encoding="utf-8") as log:
        code = subprocess.run([program], stdout=log, stderr=subprocess.STDOUT,
                              env=environment).returncode
    return name, code == 0, counts


def read(path, total):
    """Adds a file of counts: only points of the bridge's own files."""
    with open(path, encoding="latin-1") as file:
        for line in file:
            if not line.startswith("C "):
                continue
            keys, _, count = line[2:].rpartition(" ")
            fields = dict(POINT.findall(keys.strip("'")))
            source = os.path.realpath(fields.get("f", ""))
            folder = os.path.basename(os.path.dirname(source))
            if folder not in ("rtl", "generated"):
                continue
            kind = "toggle" if fields.get("page", "").startswith("v_toggle") else "line"
            name = os.path.join(folder, os.path.basename(source))
            total[Point(name, int(fields["l"]), kind, fields.get("o", ""))] += int(count)


def line_text(point, texts):
    """The text that the waivers' patterns are matched with."""
    if point.kind == "toggle":
        return point.what
    if point.file not in texts:
        with open(os.path.join(FPGA, point.file), encoding="utf-8") as file:
            texts[point.file] = file.read().splitlines()
    return texts[point.file][point.line - 1].strip()


def fits(waiver, point, text):
    if waiver["file"] != point.file or waiver["kind"] != point.kind:
        return False
    pattern = waiver["of"].replace("[", "[[]")
    bit = re.search(r"\[(\d+)\]$", text) if point.kind == "toggle" else None
    if "bits" not in waiver:
        return (fnmatch.fnmatchcase(text, pattern)
                or bool(bit) and fnmatch.fnmatchcase(text[:bit.start()], pattern))
    ranges = (part.partition("-") for part in waiver["bits"].split(","))
    return (bool(bit) and fnmatch.fnmatchcase(text[:bit.start()], pattern)
            and any(int(low) <= int(bit[1]) <= int(high or low) for low, _, high in ranges))


def judge(total, waivers):
    """Table of the files, unreached points without a waiver, unused waivers."""
    table = collections.defaultdict(lambda: [0] * 6)
    texts, used, open_points = {}, set(), []
    for point, count in sorted(total.items()):
        row, at = table[point.file], 0 if point.kind == "line" else 3
        row[at] += 1
        row[at + 1] += count > 0
        if count:
            continue
        text = line_text(point, texts)
        fitting = [i for i, waiver in enumerate(waivers) if fits(waiver, point, text)]
        used.update(fitting)
        row[at + 2] += bool(fitting)
        if not fitting:
            open_points.append((point, text))
    return table, open_points, [waiver for i, waiver in enumerate(waivers) if i not in used]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--rounds", type=int, help="of every random test")
    parser.add_argument("--only", default=".", help="programs whose name matches")
    parser.add_argument("--all", action="store_true", help="the slow programs, too")
    parser.add_argument("--counts", nargs="+", help="use existing files of counts, run nothing")
    options = parser.parse_args()
    started = time.monotonic()
    files, failed = options.counts or [], []
    if not options.counts:
        os.makedirs(CACHE, exist_ok=True)
        programs = [path for path in build(options.jobs, options.all)
                    if re.search(options.only, path)]
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for name, passed, counts in pool.map(lambda path: run(path, options.rounds), programs):
                files.append(counts)
                if not passed:
                    failed.append(name)
    total = collections.Counter()
    for path in files:
        if os.path.exists(path):
            read(path, total)
    with open(WAIVERS, encoding="utf-8") as file:
        waivers = json.load(file)
    table, open_points, unused = judge(total, waivers)
    print("| file | lines reached | waived | toggles reached | waived |\n|---|---|---|---|---|")
    for name, row in sorted(table.items()):
        print(f"| {name} | {row[1]} of {row[0]} | {row[2]} | {row[4]} of {row[3]} | {row[5]} |")
    for point, text in open_points:
        print(f"{point.file}:{point.line}: {point.kind} never reached: {text}")
    for waiver in unused:
        print(f"unused waiver: {waiver['file']} {waiver['kind']} {waiver['of']}")
    for name in failed:
        print(f"{name} failed, see {os.path.join(CACHE, name + '.log')}")
    sums = [sum(row[i] for row in table.values()) for i in range(6)]
    print(f"lines {sums[1]} of {sums[0]}, {sums[2]} waived; toggles {sums[4]} of {sums[3]}, "
          f"{sums[5]} waived; {len(open_points)} open, {len(unused)} unused waivers, "
          f"{time.monotonic() - started:.0f} s")
    return 1 if open_points or unused or failed or not total else 0


if __name__ == "__main__":
    sys.exit(main())

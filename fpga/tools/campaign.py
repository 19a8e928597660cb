# SPDX-License-Identifier: Apache-2.0
"""The long searches on the FPGA bridge, run by tools/campaign fpga.

The last result of each completed step is kept, so that --write can combine several runs; it names
the commit of each.
"""
import argparse
import concurrent.futures
import json
import os
import re
import subprocess
import sys
import time

import synthesis_table
from places import CACHE, FPGA, ROOT, own_cache

FOLDER = os.path.join(CACHE, "fpga-campaign")
SHARDS = 10  # of a search, each with its own seed
# Name: test program, its case, total rounds, shards.
SEARCHES = {
    "symbols": ("hdl_symbols_test", "random bus symbols at 1*", 100_000_000, SHARDS),
    "lines": ("hdl_symbols_test", "random moves*", 10_000_000, SHARDS),
    "spikes": ("hdl_spikes_test", "isolated*", 100_000, SHARDS),
    "routing": ("hdl_routing_test", "random transfers*", 120_000, SHARDS),
    "switches": ("hdl_switch_test", "random switches*", 10_000, SHARDS),
    "aborts": ("hdl_abort_test", "broken off*", 1, 1)}
# Name: a script with its arguments, and those of a short trial (None: the same).
TOOLS = {
    "lint": (["lint.py"], None),
    "crossings": (["cdc.py"], None),
    "proofs": (["prove.py", "--no-cache"], ["prove.py", "--module", "watchdog"]),
    "seeded_fault": (["seeded_fault.py"], ["seeded_fault.py", "--only", "^torn frame"]),
    "coverage": (["coverage.py"], ["coverage.py", "--only", "delay"]),
    "mutation": (["mutate.py", "--simulate"], ["mutate.py", "--module", "watchdog"]),
    "netlists": (["conformance.py", "--every", "20", "rtl", "xc3s", "ice40"],
                 ["conformance.py", "--every", "100", "rtl"]),
    "synthesis": (["synth.py"], None)}


def build(jobs):
    """Builds the test programs; returns their folder."""
    folder = os.path.join(own_cache("fpga-campaign"), "build")
    os.makedirs(folder, exist_ok=True)
    programs = sorted({program for program, _, _, _ in SEARCHES.values()})
    with open(os.path.join(FOLDER, "build.log"), "w", encoding="utf-8") as log:
        for words in (["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", "-DVERGENCE_FPGA=ON"],
                      ["ninja", "-C", folder, "-j", str(jobs), *programs]):
            if subprocess.run(words, stdout=log, stderr=subprocess.STDOUT).returncode != 0:
                sys.exit(f"campaign.py: the build failed, see {log.name}")
    return os.path.join(folder, "tests", "hdl")


def run(words, log, **variables):
    """Runs a program with its output in a file. Returns passed, output, seconds."""
    started = time.monotonic()
    with open(log, "w", encoding="utf-8") as file:
        code = subprocess.run(words, stdout=file, stderr=subprocess.STDOUT,
                              env={**os.environ, **variables}).returncode
    with open(log, encoding="utf-8") as file:
        return code == 0, file.read(), time.monotonic() - started


def search(name, programs, seed, share, pool):
    """Runs all shards of a search. Returns passed, rounds, output, processor seconds."""
    program, case, rounds, shards = SEARCHES[name]
    # A smaller share would not reach both cameras, every kind of transfer and so on.
    each = max(min(100, rounds // shards), round(rounds * share / shards))
    asked = [pool.submit(run, [os.path.join(programs, program), f"--test-case={case}"],
                         os.path.join(FOLDER, f"{name}{shard}.log"),
                         VERGENCE_SEED=str(seed + 1000 * shard),
                         VERGENCE_DRAWS=str(each)) for shard in range(shards)]
    answers = [future.result() for future in asked]
    output_text = [re.findall(r"MESSAGE: (.*)", answer[1]) for answer in answers]
    return (all(answer[0] for answer in answers), each * shards,
            "; ".join(add_up(sentences) for sentences in zip(*output_text)),
            sum(answer[2] for answer in answers))


def add_up(sentences):
    """Merges lines that differ only in their numbers: sums; for rates and times the maximum."""
    parts = [re.split(r"(\d+)", sentence) for sentence in sentences]
    if len({len(part) for part in parts}) != 1:
        return sentences[-1]
    joined = list(parts[0])
    for i in range(1, len(joined), 2):
        numbers = [int(part[i]) for part in parts]
        unit = joined[i + 1]
        same = re.match(r"\s*(us|ms|ns|kHz|symbols/s)\b", unit)
        joined[i] = str(max(numbers) if same else sum(numbers))
    return "".join(joined)


def tool(name, share):
    """Runs one of our tools. Returns passed, its last line, seconds."""
    full, trial = TOOLS[name]
    script, *words = trial if trial and share < 1 else full
    script = os.path.join(FPGA, "tools", script)
    passed, output, seconds = run([sys.executable, "-B", script, *words],
                                  os.path.join(FOLDER, f"{name}.log"))
    return passed, (output.strip().splitlines() or [""])[-1], seconds


def commit():
    """Short name of the commit, with a + if files differ from it."""
    words = ["git", "-C", ROOT, "describe", "--always", "--dirty=+", "--exclude=*"]
    done = subprocess.run(words, capture_output=True, text=True)
    return done.stdout.strip() or "unknown"


def table(results, seed):
    """The text of all results, in the order of the steps, including those never run."""
    lines = [
        "<!-- SPDX-License-Identifier: Apache-2.0 -->",
        "# Results of the long searches on the bridge", "",
        f"Made by `tools/campaign fpga`, seed {seed}, {os.cpu_count()} processors. Seconds are",
        "processor time for searches and wall time for the others. *at* is the commit tested.", "",
        "| step | rounds | seconds | result | at | output |", "|---|---|---|---|---|---|"]
    for name in [*SEARCHES, *TOOLS]:
        lines.append(row(name, results[name]) if name in results else
                     f"| {name} | | | not run | | |")
    return "\n".join(lines) + "\n"


def row(name, result):
    return (f"| {name} | {result['rounds']} | {result['seconds']:.0f} | "
            f"{'passed' if result['passed'] else 'FAILED'} | {result['at']} | {result['said']} |")


def kept():
    """The results of earlier completed steps."""
    path = os.path.join(FOLDER, "results.json")
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def wrong(text):
    """Exits with an error of tools/campaign, which passed the arguments."""
    print(f"tools/campaign: {text}; see tools/campaign --help", file=sys.stderr)
    sys.exit(2)


def choose(only):
    """The steps whose name matches; at least one."""
    try:
        chosen = [name for name in [*SEARCHES, *TOOLS] if re.search(only, name)]
    except re.error:
        wrong(f"--only {only} is not a regular expression")
    return chosen or wrong(f"no step matches {only}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default=".")
    parser.add_argument("--seed", type=int, default=20090915)
    parser.add_argument("--share", type=float, default=1.0,
                        help="share of the rounds; below 1 the tools check only one module, and "
                        "no result is saved")
    parser.add_argument("--write", help="write the table of the last results to this file "
                        "(fpga/RESULTS.md)")
    parser.add_argument("--list", action="store_true", help="only print the steps' names")
    options = parser.parse_args()
    chosen = choose(options.only)
    if options.list:
        print("\n".join(chosen))
        return 0
    os.makedirs(FOLDER, exist_ok=True)
    programs = build(options.jobs) if set(chosen) & set(SEARCHES) else None
    wrong = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for name in chosen:
            at, rounds = commit(), ""
            if name in SEARCHES:
                passed, rounds, output_text, seconds = search(name, programs, options.seed, options.share,
                                                       pool)
            else:
                passed, output_text, seconds = tool(name, options.share)
            wrong += not passed
            result = {"passed": passed, "rounds": rounds, "said": output_text, "seconds": seconds,
                      "at": at}
            print(row(name, result), flush=True)
            if options.share == 1:
                results = kept() | {name: result}
                with open(os.path.join(FOLDER, "results.json"), "w", encoding="utf-8") as file:
                    json.dump(results, file, indent=1)
    if options.write:
        text = table(kept(), options.seed) + "\n" + synthesis_table.published()
        with open(options.write, "w", encoding="utf-8") as file:
            file.write(text.rstrip() + "\n")
    print(f"{len(chosen)} steps, {wrong} failed; logs and results.json in {FOLDER}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""The long searches on the FPGA bridge, as tools/campaign fpga runs them; writes a table of results."""
import argparse
import concurrent.futures
import os
import re
import subprocess
import sys
import time

FPGA = os.path.realpath(os.path.join(os.path.dirname(__file__), ".."))
ROOT = os.path.dirname(FPGA)
CACHE = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "vergence",
                     "fpga-campaign")
SHARDS = 10  # of a search, each with a seed of its own
# Name: test program, its case, rounds altogether, shards.
SEARCHES = {
    "symbols": ("hdl_symbols_test", "random bus symbols at 1*", 100_000_000, SHARDS),
    "lines": ("hdl_symbols_test", "random moves*", 10_000_000, SHARDS),
    "spikes": ("hdl_spikes_test", "isolated*", 100_000, SHARDS),
    "routing": ("hdl_routing_test", "random transfers*", 120_000, SHARDS),
    "switches": ("hdl_switch_test", "random switches*", 10_000, SHARDS),
    "aborts": ("hdl_abort_test", "broken off*", 1, 1)}
TOOLS = {
    "proofs": ["prove.py", "--no-cache"],
    "netlists": ["conformance.py", "--every", "5", "rtl", "xc3s", "ice40"],
    "mutation": ["mutate.py"],
    "synthesis": ["synth.py"]}


def build(jobs):
    """Builds the test programs; returns their folder."""
    folder = os.path.join(CACHE, "build")
    os.makedirs(folder, exist_ok=True)
    programs = sorted({program for program, _, _, _ in SEARCHES.values()})
    with open(os.path.join(CACHE, "build.log"), "w", encoding="utf-8") as log:
        for words in (["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja"],
                      ["ninja", "-C", folder, "-j", str(jobs), *programs]):
            if subprocess.run(words, stdout=log, stderr=subprocess.STDOUT).returncode != 0:
                sys.exit(f"campaign.py: the build failed, see {log.name}")
    return os.path.join(folder, "tests", "hdl")


def run(words, log, **variables):
    """One program with its output in a file. Returns passed, output, seconds."""
    started = time.monotonic()
    with open(log, "w", encoding="utf-8") as file:
        code = subprocess.run(words, stdout=file, stderr=subprocess.STDOUT,
                              env={**os.environ, **variables}).returncode
    with open(log, encoding="utf-8") as file:
        return code == 0, file.read(), time.monotonic() - started


def search(name, programs, seed, pool):
    """All shards of a search. Returns passed, rounds, what they said, processor seconds."""
    program, case, rounds, shards = SEARCHES[name]
    asked = [pool.submit(run, [os.path.join(programs, program), f"--test-case={case}"],
                         os.path.join(CACHE, f"{name}{shard}.log"),
                         VERGENCE_SEED=str(seed + 1000 * shard),
                         VERGENCE_DRAWS=str(max(1, rounds // shards))) for shard in range(shards)]
    answers = [future.result() for future in asked]
    said = re.findall(r"MESSAGE: (.*)", answers[0][1])
    return (all(answer[0] for answer in answers), said[-1] if said else "",
            sum(answer[2] for answer in answers))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default=".")
    parser.add_argument("--seed", type=int, default=20090915)
    options = parser.parse_args()
    chosen = [name for name in [*SEARCHES, *TOOLS] if re.search(options.only, name)]
    if not chosen:
        parser.error(f"no step matches {options.only}")
    os.makedirs(CACHE, exist_ok=True)
    programs = build(options.jobs) if set(chosen) & set(SEARCHES) else None
    lines, wrong = ["| step | rounds | seconds | result | one shard's words |",
                    "|---|---|---|---|---|"], 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for name in chosen:
            if name in SEARCHES:
                passed, said, seconds = search(name, programs, options.seed, pool)
                rounds = SEARCHES[name][2]
            else:
                script, *words = TOOLS[name]
                passed, output, seconds = run(
                    [sys.executable, "-B", os.path.join(FPGA, "tools", script), *words],
                    os.path.join(CACHE, f"{name}.log"))
                said, rounds = (output.strip().splitlines() or [""])[-1], ""
            wrong += not passed
            lines.append(f"| {name} | {rounds} | {seconds:.0f} | "
                         f"{'passed' if passed else 'FAILED'} | {said} |")
            print(lines[-1], flush=True)
    with open(os.path.join(CACHE, "results.md"), "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
    print(f"{len(chosen)} steps, {wrong} failed; {os.path.join(CACHE, 'results.md')} and logs beside it")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

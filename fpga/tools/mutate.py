# SPDX-License-Identifier: Apache-2.0
"""Measures how complete the properties are: yosys mutates the RTL, the proofs must fail.

Each proof of fpga/formal/ gets so many mutants, chosen by yosys' `mutate` over the module's cells (not
the property module's). A mutant is killed when an assertion fails from reset or the induction fails.
Survivors are listed with the place in the source that they change; fpga/formal/survivors.txt names
those that change nothing that can be seen, each with its reason: "proof: mutation text # reason".
"""
import argparse
import concurrent.futures
import glob
import os
import re
import subprocess
import sys
import tempfile
import time

import prove

SURVIVORS = os.path.join(prove.FPGA, "formal", "survivors.txt")


def known_survivors():
    """Text of each excused mutation to its reason."""
    known = {}
    if os.path.exists(SURVIVORS):
        with open(SURVIVORS, encoding="utf-8") as file:
            for line in file:
                if line.strip() and not line.startswith("//"):
                    text, _, reason = line.partition(" # ")
                    known[text.strip()] = reason.strip()
    return known


def prepared(proof, runner, folder):
    """The proof's design after prep, saved for all its mutants."""
    runner.model(proof, proof.texts, folder)
    macros = " ".join("-D" + macro for macro in ("FORMAL", "SYNTHESIS",
                                                 *proof.data.get("defines", [])))
    parameters = " ".join(f"-chparam {name} {value}" for name, value in
                          proof.data.get("parameters", {}).items())
    script = (f"read_verilog -formal {macros} -Irtl -Igenerated -Iformal "
              f"{' '.join(proof.data['sources'])}; hierarchy -top {proof.top} {parameters}; "
              f"rename -top {proof.top}; prep -top {proof.top}; write_rtlil design.il")
    subprocess.run(["yosys", "-q", "-p", script], cwd=folder, env=runner.env, check=True,
                   capture_output=True)


def mutations(proof, runner, folder, count, seed):
    """Commands of `mutate`, one a mutant, none inside the property module."""
    subprocess.run(["yosys", "-q", "-p", "read_rtlil design.il; select */* w:*_properties* %d; "
                    f"mutate -list {2 * count} -seed {seed} -o list.txt -s src.txt -none"],
                   cwd=folder, env=runner.env, check=True, capture_output=True)
    with open(os.path.join(folder, "list.txt"), encoding="utf-8") as file:
        lines = [line.strip() for line in file]
    inner = [line for line in lines if "-mode none" not in line and "properties" not in line
             and "formal/" not in line]
    return inner[:count]


def survives(proof, runner, folder, number, command):
    """Whether no assertion notices."""
    tail = ("flatten; clk2fflogic; opt_clean" if proof.data.get("multiclock")
            else "async2sync; dffunmap")
    with tempfile.TemporaryDirectory(prefix="mutate-") as work:
        subprocess.run(["yosys", "-q", "-p", f"read_rtlil {folder}/design.il; {command}; {tail}; "
                        "write_smt2 -wires model.smt2"], cwd=work, env=runner.env, check=True,
                       capture_output=True)
        depth = max(proof.data.get("base_depth", proof.depth), proof.depth) + 1
        return (runner.check(work, "-t", str(depth))["passed"]
                and runner.check(work, "-i", "-t", str(proof.depth))["passed"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--module", action="append")
    parser.add_argument("--count", type=int, default=40, help="mutants a proof")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    started = time.monotonic()
    runner = prove.Runner("yices", False)
    known = known_survivors()
    made, killed, excused = 0, 0, 0
    for path in sorted(glob.glob(os.path.join(prove.FPGA, "formal", "*.json"))):
        proof = prove.Proof(path)
        if options.module and proof.name not in options.module:
            continue
        with tempfile.TemporaryDirectory(prefix="mutate-") as folder:
            prepared(proof, runner, folder)
            commands = mutations(proof, runner, folder, options.count, options.seed)
            with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
                alive = list(pool.map(lambda item: survives(proof, runner, folder, *item),
                                      enumerate(commands)))
        made += len(commands)
        killed += alive.count(False)
        for command, lives in zip(commands, alive):
            if not lives:
                continue
            name = f"{proof.name}: {re.sub(r' -src .*', '', command)}"
            if name in known:
                excused += 1
                continue
            places = " ".join(re.findall(r"-src (\S+)", command))
            print(f"survives: {name}  at {places}", flush=True)
        print(f"{proof.name}: {alive.count(False)} of {len(commands)} killed", flush=True)
    share = killed / max(1, made - excused)
    print(f"{made} mutants, {killed} killed, {excused} excused: {100 * share:.1f} % of the others, "
          f"{time.monotonic() - started:.0f} s")
    return 0 if share >= 0.9 else 1


if __name__ == "__main__":
    sys.exit(main())

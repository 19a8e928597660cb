# SPDX-License-Identifier: Apache-2.0
"""Measures how complete the properties and tests are: yosys mutates the RTL, and something must fail.

Every module of fpga/formal/ gets mutants in proportion to its cells, chosen by yosys' `mutate` with a
seed; submodules without a proof of their own are mutated with the module that holds them. A mutant is
  proof       killed by the proof: an assertion fails from reset, or the induction does
  equivalent  no change: yosys' equiv_simple finds each register and output the same function
  simulation  killed by a test program of tests/hdl (only with --simulate)
  survivor    none of these. survivors.json may name those that differ in nothing that can be seen:
              {"proof", "mutant", "reason"}; they count as equivalent.
The share of killed ones among those that are not equivalent must be 90 % or more.
"""
import argparse
import collections
import concurrent.futures
import glob
import json
import os
import queue
import re
import subprocess
import sys
import tempfile
import time

import prove
import sabotage

SURVIVORS = os.path.join(prove.FPGA, "formal", "survivors.json")
GOAL = 0.9
CELLS_A_MUTANT, FEWEST, MOST = 8, 10, 60
# The tests that judge what the proofs let live: program, its case, rounds.
JUDGES = (("hdl_registers_test", None, None), ("hdl_symbols_test", "*at 1 MHz*", 20000),
          ("hdl_routing_test", None, 200), ("hdl_switch_test", None, 100), ("hdl_idle_test", None, None))


def yosys(runner, folder, script):
    done = subprocess.run(["yosys", "-p", script], cwd=folder, env=runner.env, capture_output=True,
                          text=True)
    return done.returncode, done.stdout + done.stderr


def demand(runner, folder, script):
    code, log = yosys(runner, folder, script)
    if code != 0:
        raise prove.Failed(f"yosys: {log.strip()[-800:]}")
    return log


class Subject:
    """A proof's design, saved for all its mutants."""

    def __init__(self, proof, runner, proved, folder):
        self.proof, self.runner, self.folder = proof, runner, folder
        runner.model(proof, proof.texts, folder)
        demand(runner, folder, "; ".join([
            *runner.read(proof, (), None), f"prep -top {proof.top}", "write_rtlil design.il",
            "write_json design.json"]))
        with open(os.path.join(folder, "design.json"), encoding="utf-8") as file:
            modules = json.load(file)["modules"]
        self.modules = []
        for name, module in modules.items():
            source = module["attributes"].get("src", "")
            plain = os.path.splitext(os.path.basename(source.split(":")[0]))[0]
            if source.startswith(("rtl/", "generated/")) and not plain.endswith("_properties") and \
                    (plain == proof.top or plain not in proved):
                self.modules.append((name, sum(not cell["type"].startswith(("$assert", "$scopeinfo"))
                                               for cell in module["cells"].values())))

    def mutants(self, share, seed):
        """Commands of `mutate`, the mutants of all modules of the subject."""
        commands = []
        for name, cells in self.modules:
            wanted = max(1, round(share * min(MOST, max(FEWEST, cells // CELLS_A_MUTANT))))
            demand(self.runner, self.folder,
                   f"read_rtlil design.il; mutate -list {2 * wanted + 10} -seed {seed} -o list.txt "
                   f"{name}")
            with open(os.path.join(self.folder, "list.txt"), encoding="utf-8") as file:
                lines = [line.strip() for line in file if "-mode none" not in line
                         and "-cell properties " not in line]
            # Spread over the list, which is in the order of the cells.
            step = max(1.0, len(lines) / wanted)
            commands += [lines[int(i * step)] for i in range(min(wanted, len(lines)))]
        return commands

    def proof_fails(self, command):
        tail = ("flatten; clk2fflogic; opt_clean" if self.proof.data.get("multiclock")
                else "async2sync; dffunmap")
        proof = self.proof
        with tempfile.TemporaryDirectory(prefix="mutate-") as work:
            demand(self.runner, work, f"read_rtlil {self.folder}/design.il; {command}; {tail}; "
                   "write_smt2 -wires model.smt2")
            depth = max(proof.data.get("base_depth", proof.depth), proof.depth) + 1
            # The induction first: where it fails it does so at once.
            return not (self.runner.check(work, "-i", "-t", str(proof.depth))["passed"]
                        and self.runner.check(work, "-t", str(depth))["passed"])

    def equivalent(self, command):
        """Whether every register and output is the same function of registers and inputs."""
        load = (f"read_rtlil {self.folder}/design.il; %s delete t:*_properties*; "
                f"hierarchy -top {self.proof.top}; flatten; async2sync; opt_clean; rename -top %s; "
                "design -stash %s; ")
        with tempfile.TemporaryDirectory(prefix="mutate-") as work:
            code, _ = yosys(self.runner, work, load % ("", "gold", "gold")
                            + load % (command + ";", "gate", "gate")
                            + "design -copy-from gold -as gold gold; "
                            "design -copy-from gate -as gate gate; equiv_make gold gate both; "
                            "hierarchy -top both; opt_clean; equiv_simple; equiv_status -assert")
        return code == 0

    def verilog(self, command):
        """Files to change, with their new text; None when the module has parameters."""
        module = re.search(r"-module (\S+)", command).group(1).lstrip("\\")
        path = next((source for source in self.proof.texts
                     if os.path.basename(source) == module + ".v"), None)
        if path is None:
            return None
        # Properties are told apart by macros alone, so without them the text is the plain module.
        with tempfile.TemporaryDirectory(prefix="mutate-") as work:
            demand(self.runner, work,
                   f"read_rtlil {self.folder}/design.il; {command}; delete t:*_properties*; "
                   f"select {module}; write_verilog -noattr -selected mutant.v")
            with open(os.path.join(work, "mutant.v"), encoding="utf-8") as file:
                return path, file.read()


def simulation_fails(bench, change):
    """Whether a test of tests/hdl notices the changed file."""
    bench.write(*change)
    try:
        for program, case, rounds in JUDGES:
            try:
                if bench.run(program, case, rounds)[0] != 0:
                    return program
            except subprocess.TimeoutExpired:
                return program
            except RuntimeError:
                return None
    finally:
        bench.restore()
    return None


def name_of(proof, command):
    return f"{proof.name}: {re.sub(r' -src .*', '', command)[len('mutate '):]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--module", action="append")
    parser.add_argument("--share", type=float, default=1.0, help="of the usual number of mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--simulate", action="store_true", help="let the tests judge, too")
    parser.add_argument("--json", help="write each mutant's fate here")
    options = parser.parse_args()
    started = time.monotonic()
    runner = prove.Runner("yices", False)
    excused = {}
    if os.path.exists(SURVIVORS):
        with open(SURVIVORS, encoding="utf-8") as file:
            excused = {f"{entry['proof']}: {entry['mutant']}": entry["reason"]
                       for entry in json.load(file)}
    proofs = [prove.Proof(path) for path in sorted(glob.glob(os.path.join(prove.FPGA, "formal",
                                                                          "*.json")))
              if path != SURVIVORS]
    proved = {proof.top for proof in proofs}
    benches = queue.Queue()
    if options.simulate:
        os.makedirs(sabotage.CACHE, exist_ok=True)
        for number in range(options.jobs):
            benches.put(sabotage.Bench(number))
    fates = []
    print("| proof | mutants | killed by proof | by simulation | equivalent | survive |\n"
          "|---|---|---|---|---|---|", flush=True)
    for proof in proofs:
        # Where parts are free, a mutant of a joint is for the tests of tests/hdl to see.
        if proof.data.get("free") or (options.module and proof.name not in options.module):
            continue
        with tempfile.TemporaryDirectory(prefix="mutate-") as folder, \
                concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            subject = Subject(proof, runner, proved, folder)

            def judge(command, subject=subject, proof=proof):
                if subject.proof_fails(command):
                    return "proof", ""
                if subject.equivalent(command) or name_of(proof, command) in excused:
                    return "equivalent", excused.get(name_of(proof, command), "same functions")
                change = subject.verilog(command) if options.simulate else None
                if change:
                    bench = benches.get()
                    try:
                        program = simulation_fails(bench, change)
                    finally:
                        benches.put(bench)
                    if program:
                        return "simulation", program
                return "survivor", " ".join(re.findall(r"-src (\S+)", command))

            commands = subject.mutants(options.share, options.seed)
            mine = [{"mutant": name_of(proof, command), "fate": fate, "why": why}
                    for command, (fate, why) in zip(commands, pool.map(judge, commands))]
        fates += mine
        count = collections.Counter(entry["fate"] for entry in mine)
        print(f"| {proof.name} | {len(mine)} | {count['proof']} | {count['simulation']} | "
              f"{count['equivalent']} | {count['survivor']} |", flush=True)
    for entry in fates:
        if entry["fate"] == "survivor":
            print(f"survives: {entry['mutant']}  at {entry['why']}")
    count = collections.Counter(entry["fate"] for entry in fates)
    killed = count["proof"] + count["simulation"]
    share = killed / max(1, killed + count["survivor"])
    if options.json:
        with open(options.json, "w", encoding="ascii") as file:
            json.dump(fates, file, indent=1)
    print(f"{len(fates)} mutants, {count['equivalent']} equivalent, {killed} killed "
          f"({count['simulation']} by simulation), {count['survivor']} survive: {100 * share:.1f} % of "
          f"those that are not equivalent, {time.monotonic() - started:.0f} s")
    return 0 if share >= GOAL else 1


if __name__ == "__main__":
    sys.exit(main())

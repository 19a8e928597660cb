# SPDX-License-Identifier: Apache-2.0
"""Measures how complete properties and tests are: yosys mutates the RTL, and a check must fail.

Every module of fpga/formal/ gets mutants in proportion to its cells, chosen by yosys' `mutate`
with a seed; submodules without a proof of their own are mutated with the module that holds them.
The modules that only connect others (JOINTS) have no proof: only tests check them. A mutant is
  proof       killed by the proof: an assertion fails from reset, or the induction does
  equivalent  no change: yosys proves each register and output equal, clocks included
  simulation  killed by a test program of tests/hdl (only with --simulate)
  survivor    none of these. mutation_survivors.json may list those without an observable
              difference: {"proof", "mutant", "reason"}; they count as equivalent.
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
import shutil
import subprocess
import sys
import tempfile
import time

import prove
import seeded_fault

SURVIVORS = os.path.join(prove.FPGA, "tools", "mutation_survivors.json")
GOAL = 0.9
CELLS_A_MUTANT, FEWEST, MAXIMUM = 6, 12, 60
TIMEOUT_S = 200  # of a test that may hang
NO_BUILD = "no build"
JOINTS = ("motion", "sensor_bus", "video_path", "bridge_core")
# The tests for mutants that survive the proofs: program, its cases, rounds; quick ones first, but
# before all of them those with a seeded fault of the same file.
JUDGES = (("hdl_symbols_test", "*at 1 MHz*", 20000), ("hdl_branch_test", None, None),
          ("hdl_routing_test", None, 200), ("hdl_switch_test", None, 100),
          ("hdl_picture_test", None, None), ("hdl_timer_test", None, None),
          ("hdl_servo_test", None, 20), ("hdl_camera_test", None, None),
          ("hdl_registers_test", None, None))

def yosys(runner, folder, script):
    done = subprocess.run(["yosys", "-p", script], cwd=folder, env=runner.env, capture_output=True,
                          text=True)
    return done.returncode, done.stdout + done.stderr


def wanted_mutants(cells, share):
    return max(1, round(share * min(MAXIMUM, max(FEWEST, cells // CELLS_A_MUTANT))))


def choose(runner, folder, name, wanted, seed):
    """Returns this many commands of `mutate` for the module, none of them in the properties."""
    demand(runner, folder, f"read_rtlil design.il; mutate -list {2 * wanted + 10} -seed {seed} "
           f"-o list.txt {name}")
    with open(os.path.join(folder, "list.txt"), encoding="utf-8") as file:
        lines = [line.strip() for line in file if "-mode none" not in line
                 and "-cell properties " not in line and "_properties" not in line]
    # Spread over the list, which is in the order of the cells.
    step = max(1.0, len(lines) / wanted)
    return [lines[int(i * step)] for i in range(min(wanted, len(lines)))]


INSTANCE = re.compile(r"^ +(\\\S+|\w+) +(\\\S+|\w+) +\(\n((?: +\.\w+\(.*\),?\n)+) +\);",
                      re.MULTILINE)


def module_text(runner, folder, command, ports):
    """The file of the mutated module, and its Verilog for the simulated bridge; None: not found.

    ports: those of each module without proofs. Its submodules are unchanged, with their
    parameters; what proofs add is removed.
    
    """
    name = re.search(r"-module (\S+)", command).group(1).lstrip("\\")
    path = next((f"{part}/{name}.v" for part in ("rtl", "generated")
                 if os.path.exists(os.path.join(prove.FPGA, part, name + ".v"))), None)
    if path is None:
        return None
    with open(os.path.join(prove.FPGA, path), encoding="utf-8") as file:
        source = file.read()
    with tempfile.TemporaryDirectory(prefix="mutate-") as work:
        demand(runner, work, f"read_rtlil {folder}/design.il; {command}; delete t:*_properties* "
               "t:$assert t:$assume t:$cover t:$anyconst t:$anyseq; "
               f"opt_clean {name}; select {name}; write_verilog -noattr -selected mutant.v")
        with open(os.path.join(work, "mutant.v"), encoding="utf-8") as file:
            text = file.read()

    def plain(found):
        kind = next((part for part in re.split(r"[\\$]", found.group(1)) if part in ports), None)
        if kind is None:  # time_step, a wire to all but the proofs
            level = dict(re.findall(r"\.(level_[io])\((.*)\)", found.group(3)))
            return f"  assign {level['level_o']} = {level['level_i']};"
        instance = found.group(2).lstrip("\\").split(".")[-1]
        given = re.search(rf"\b{kind}\s*(#\([^;]*?\))\s*{re.escape(instance)}\s*\(", source)
        pins = [pin.rstrip(",\n") for pin in found.group(3).splitlines()
                if re.match(r" +\.(\w+)", pin).group(1) in ports.get(kind, ())]
        return (f"  {kind} {given.group(1) if given else ''} {found.group(2)} (\n"
                + ",\n".join(pins) + "\n  );")

    text = INSTANCE.sub(plain, text)
    # Its own parameters are already applied, but its parents may name them, and so may its
    # instances.
    stubs = "".join(f"\n  {parameter};" for parameter in
                    re.findall(r"^\s*(parameter\b.*?),?$", source.split(");")[0], re.MULTILINE))
    return path, re.sub(rf"^(module {name}\(.*?\);)", lambda found: found.group(1) + stubs, text,
                        count=1, flags=re.MULTILINE | re.DOTALL)


def demand(runner, folder, script):
    code, log = yosys(runner, folder, script)
    if code != 0:
        raise prove.Failed(f"yosys: {log.strip()[-800:]}")
    return log


def bridge(runner, folder):
    """The whole bridge without proofs, as design.il in the folder. Returns its modules."""
    for part in ("rtl", "generated"):
        shutil.copytree(os.path.join(prove.FPGA, part), os.path.join(folder, part))
    demand(runner, folder, "read_verilog -DSYNTHESIS -Igenerated rtl/*.v generated/*.v; "
           "prep -top bridge_core; write_rtlil design.il; write_json design.json")
    with open(os.path.join(folder, "design.json"), encoding="utf-8") as file:
        return json.load(file)["modules"]


def plain_ports(runner):
    """Names of the ports of each module, by its name without parameters."""
    with tempfile.TemporaryDirectory(prefix="mutate-") as folder:
        modules = bridge(runner, folder)
    return {os.path.basename(module["attributes"]["src"]).split(".")[0]: set(module["ports"])
            for module in modules.values()}


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
                self.modules.append((name, sum(
                    not cell["type"].startswith(("$assert", "$scopeinfo"))
                    for cell in module["cells"].values())))

    def mutants(self, share, seed):
        """Commands of `mutate`: the mutants of all modules of the subject."""
        return [command for name, cells in self.modules for command in
                choose(self.runner, self.folder, name, wanted_mutants(cells, share), seed)]

    def proof_fails(self, command):
        tail = ("flatten; clk2fflogic; opt_clean" if self.proof.data.get("multiclock")
                else "async2sync; dffunmap")
        proof = self.proof
        with tempfile.TemporaryDirectory(prefix="mutate-") as work:
            demand(self.runner, work, f"read_rtlil {self.folder}/design.il; {command}; {tail}; "
                   "write_smt2 -wires model.smt2")
            depth = max(proof.data.get("base_depth", proof.depth), proof.depth) + 1
            # The induction first: if it fails, it does so at once.
            return not (self.runner.check(work, "-i", "-t", str(proof.depth))["passed"]
                        and self.runner.check(work, "-t", str(depth))["passed"])

    def equivalent(self, command):
        """Whether every register and output is the same function of registers and inputs."""
        load = (f"read_rtlil {self.folder}/design.il; %s delete t:*_properties*; "
                f"hierarchy -top {self.proof.top}; flatten; clk2fflogic; opt_clean; "
                "rename -top %s; design -stash %s; ")
        with tempfile.TemporaryDirectory(prefix="mutate-") as work:
            code, _ = yosys(self.runner, work, load % ("", "gold", "gold")
                            + load % (command + ";", "gate", "gate")
                            + "design -copy-from gold -as gold gold; "
                            "design -copy-from gate -as gate gate; equiv_make gold gate both; "
                            "hierarchy -top both; opt_clean; equiv_simple -seq 4; "
                            "equiv_induct -seq 6; equiv_status -assert")
        return code == 0


class Joint:
    """A module that only connects others: it has no proof, and only the tests check it."""

    def __init__(self, name, runner, folder):
        self.name, self.runner, self.folder = name, runner, folder
        modules = bridge(runner, folder)
        # Its size is that of its connections.
        self.size = sum(len(cell["connections"]) for cell in modules[name]["cells"].values())

    def mutants(self, share, seed):
        return choose(self.runner, self.folder, self.name, wanted_mutants(self.size, share), seed)

    def proof_fails(self, _):
        return False

    def equivalent(self, _):
        return False


class Simulation:
    """The test programs as checks of changed files."""

    def __init__(self, runner, jobs):
        self.runner, self.ports, self.unchanged = runner, plain_ports(runner), {}
        with open(seeded_fault.TABLE, encoding="utf-8") as file:
            self.likely = {(entry["file"], entry["test"]) for entry in json.load(file)}
        self.benches = queue.Queue()
        os.makedirs(seeded_fault.CACHE, exist_ok=True)
        for number in range(jobs):
            self.benches.put(seeded_fault.Bench(number))

    def killer(self, folder, command):
        """The program that detects the mutant; None: it is not detected, or cannot be simulated."""
        change = module_text(self.runner, folder, command, self.ports)
        if not change:
            return None
        path, text = change
        if path not in self.unchanged:
            # The applied parameters may differ from the bridge's: then its tests show nothing.
            none = re.sub(r"-mode \S+", "-mode none", re.match(r".*-module \S+", command).group(0))
            same = module_text(self.runner, folder, none, self.ports)[1]
            self.unchanged[path] = "\n  parameter" not in same or not self.fails(path, same)
        program = self.unchanged[path] and self.fails(path, text)
        return None if program == NO_BUILD else program

    def fails(self, path, text):
        """The program that fails with this text in the file."""
        bench = self.benches.get()
        bench.write(path, text)
        try:
            for program, case, rounds in sorted(
                    JUDGES, key=lambda judge: (path, judge[0]) not in self.likely):
                try:
                    if bench.run(program, case, rounds, TIMEOUT_S)[0] != 0:
                        return program
                except subprocess.TimeoutExpired:
                    return program
                except RuntimeError as failure:
                    print(f"mutate.py: {path} not simulated: {failure}", file=sys.stderr)
                    return NO_BUILD
        finally:
            bench.restore()
            self.benches.put(bench)
        return None


def name_of(name, command):
    return f"{name}: {re.sub(r' -src .*', '', command)[len('mutate '):]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--module", action="append")
    parser.add_argument("--share", type=float, default=1.0,
                        help="share of the default number of mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--simulate", action="store_true", help="also run the tests")
    parser.add_argument("--json", help="write each mutant's result to this file")
    options = parser.parse_args()
    started = time.monotonic()
    runner = prove.Runner("yices", False)
    excused = {}
    if os.path.exists(SURVIVORS):
        with open(SURVIVORS, encoding="utf-8") as file:
            excused = {f"{entry['proof']}: {entry['mutant']}": entry for entry in json.load(file)}
    # Where parts are free, mutants of a connection must be detected by the tests of tests/hdl.
    proofs = {proof.name: proof for proof in
              (prove.Proof(path)
               for path in sorted(glob.glob(os.path.join(prove.FPGA, "formal", "*.json"))))
              if not proof.data.get("free")}
    proved = {proof.top for proof in proofs.values()}
    simulation = Simulation(runner, options.jobs) if options.simulate else None
    fates = []
    print("| proof | mutants | killed by proof | by simulation | equivalent | survive |\n"
          "|---|---|---|---|---|---|", flush=True)
    joints = [name for name in JOINTS if options.simulate and name not in proofs]
    for name in [*proofs, *joints]:
        if options.module and name not in options.module:
            continue
        with tempfile.TemporaryDirectory(prefix="mutate-") as folder, \
                concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            subject = (Subject(proofs[name], runner, proved, folder) if name in proofs
                       else Joint(name, runner, folder))

            def judge(command, subject=subject, name=name, folder=folder):
                if subject.proof_fails(command):
                    return "proof", ""
                mutant = name_of(name, command)
                if mutant in excused:
                    known = excused[mutant]
                    return "survivor" if known.get("harmless") else "equivalent", known["reason"]
                if subject.equivalent(command):
                    return "equivalent", "same functions"
                program = simulation and simulation.killer(folder, command)
                if program:
                    return "simulation", program
                return "survivor", "at " + " ".join(re.findall(r"-src (\S+)", command))

            commands = subject.mutants(options.share, options.seed)
            mine = [{"mutant": name_of(name, command), "fate": fate, "why": why}
                    for command, (fate, why) in zip(commands, pool.map(judge, commands))]
        fates += mine
        if options.json:
            with open(options.json, "w", encoding="ascii") as file:
                json.dump(fates, file, indent=1)
        count = collections.Counter(entry["fate"] for entry in mine)
        print(f"| {name} | {len(mine)} | {count['proof']} | {count['simulation']} | "
              f"{count['equivalent']} | {count['survivor']} |", flush=True)
    for entry in fates:
        if entry["fate"] == "survivor":
            print(f"survives: {entry['mutant']}: {entry['why']}")
    count = collections.Counter(entry["fate"] for entry in fates)
    killed = count["proof"] + count["simulation"]
    share = killed / max(1, killed + count["survivor"])
    print(f"{len(fates)} mutants, {count['equivalent']} equivalent, {killed} killed "
          f"({count['simulation']} by simulation), {count['survivor']} survive: "
          f"{100 * share:.1f} % of those that are not equivalent, "
          f"{time.monotonic() - started:.0f} s")
    return 0 if share >= GOAL else 1


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Runs the proof programs: yosys makes a model, yosys-smtbmc proves it, abc finds counterexamples.

Each program is used for what it does best. yosys-smtbmc (with an SMT solver) does the base case
and the induction of the proof. To find a counterexample from reset, or a trace to a cover
statement, abc's bmc3 checks one statement with the gates that drive it: hundreds of steps per
second, while yosys-smtbmc takes minutes for twelve.
"""
import os
import re
import shutil
import subprocess

from places import FPGA

TIMEOUT_S = 600
CONFLICTS = 5000  # of a search at one step, after which it ends; unlike a time-out, deterministic


class Failed(Exception):
    """A proof that could not be run: wrong description, or Verilog that does not compile."""


def environment():
    """PATH with the Python environment's solver first."""
    found = subprocess.run([os.path.join(FPGA, "..", "tools", "fpga_python")], capture_output=True,
                           text=True)
    path = os.environ["PATH"]
    if found.returncode == 0:
        path = found.stdout.strip() + os.pathsep + path
    return {**os.environ, "PATH": path}


def versions(env, solver):
    """The text that identifies the tools in the checksums."""
    words = {"yices": ["yices-smt2", "--version"], "z3": ["z3", "--version"]}[solver]
    return "".join(subprocess.run(command, capture_output=True, text=True, env=env,
                                  check=True).stdout for command in (["yosys", "-V"], words))


def label(name):
    """The last part of a name that flattening made long."""
    return name.rsplit(".", 1)[-1]


def named(name, tail=""):
    """yosys' patterns for the statements with a label, in the top and below."""
    quoted = re.sub(r"[\[\]]", "?", name) + tail
    return f"*/{quoted} */*.{quoted}"


class Checker:
    """The programs with their environment."""

    def __init__(self, solver):
        self.solver = solver
        self.env = environment()
        for program in ("yosys", "yosys-abc", {"yices": "yices-smt2", "z3": "z3"}[solver]):
            if not shutil.which(program, path=self.env["PATH"]):
                raise Failed(f"no {program} here; see tools/install_packages fpga")
        self.versions = versions(self.env, solver)

    def yosys(self, proof, texts, folder, script):
        """Writes the sources into the folder and runs yosys there."""
        for name, text in texts.items():
            path = os.path.join(folder, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        done = subprocess.run(["yosys", "-q", "-p", "; ".join(script)], cwd=folder, env=self.env,
                              capture_output=True, text=True)
        if done.returncode != 0:
            raise Failed(f"{proof.name}: yosys: {done.stderr.strip() or done.stdout.strip()}")

    @staticmethod
    def read(proof, defines, parameters):
        """Commands that read the sources and select the top."""
        macros = ["FORMAL", "SYNTHESIS", *proof.data.get("defines", []), *defines]
        parameters = {**proof.data.get("parameters", {}), **(parameters or {})}
        settings = "".join(f" -chparam {name} {value}" for name, value in parameters.items())
        free = [f"cutpoint {name} $paramod*{name}*" for name in proof.data.get("free", [])]
        free = ["proc", *free] if free else []
        return [f"read_verilog -formal {' '.join('-D' + macro for macro in macros)} -Irtl "
                f"-Igenerated -Iformal {' '.join(proof.data['sources'])}",
                f"hierarchy -top {proof.top}{settings}", "rename -top " + proof.top, *free]

    def model(self, proof, texts, folder, defines=(), parameters=None, only=None):
        """Writes model.smt2 into the folder. Returns labels of asserts and covers.

        only: only this assertion stays one; the others become assumptions about earlier steps.
        
        """
        script = self.read(proof, defines, parameters)
        if proof.data.get("multiclock"):
            # One step is a step of time: clocks are inputs.
            script += [f"prep -flatten -top {proof.top}", "clk2fflogic", "opt_clean"]
        else:
            script += [f"prep -top {proof.top}", "async2sync", "dffunmap"]
        if only:
            script += [f"select -set kept {named(only)}", "select -set others t:$assert @kept %d"]
            # At the last step the others may fail: they are delayed by one step.
            script += ["chformal -assert -delay 1 @others", "chformal -assert2assume @others"]
        self.yosys(proof, texts, folder, script + ["write_smt2 -wires model.smt2"])
        with open(os.path.join(folder, "model.smt2"), encoding="utf-8") as file:
            text = file.read()
        return {kind: re.findall(rf"^; yosys-smt2-{kind} \d+ (\S+)", text, re.MULTILINE)
                for kind in ("assert", "cover", "assume")}

    def check(self, folder, *arguments):
        """Runs yosys-smtbmc once; returns passed, and the labels of what failed."""
        command = ["yosys-smtbmc", "-s", self.solver, "--noprogress", *arguments, "model.smt2"]
        try:
            done = subprocess.run(command, cwd=folder, env=self.env, capture_output=True, text=True,
                                  timeout=TIMEOUT_S)
        except subprocess.TimeoutExpired:
            return {"passed": False, "failed": [], "timeout": True, "log": "time-out"}
        log = done.stdout + done.stderr
        if "Status: PASSED" not in log and "Status: FAILED" not in log:
            raise Failed(f"yosys-smtbmc: {log.strip()[-500:]}")
        return {"passed": done.returncode == 0 and "Status: PASSED" in log, "timeout": False,
                "failed": sorted({label(name) for name in
                                  re.findall(r"Assert failed in \S+: (\S+)", log)}),
                "log": "\n".join(log.splitlines()[-12:])}

    def search(self, proof, texts, folder, names, depth, settings=None):
        """Searches traces from reset to failing assertions, or to covers, by label.

        depth: steps from reset; settings: {"defines", "parameters"} to be added to the proof's,
        and {"conflicts"}: the effort limit. A pattern such as a_* selects several. Returns {label:
        step in which it fails or is reached} for those with a trace.
        
        """
        settings = settings or {}
        script = self.read(proof, settings.get("defines", []), settings.get("parameters"))
        # A cover is reached where the assertion of its opposite fails.
        script += ["proc", "flatten", "techmap -map formal/cover_search.v t:$cover",
                   "opt_expr", "select -set kept t:$assume " + " ".join(
                       f"{named(name)} {named(name, '.search')}" for name in names),
                   "delete t:$assert @kept %d", "delete -port o:*", "opt_clean", "memory_collect"]
        # Values that are not set yet are free.
        script += ["clk2fflogic" if proof.data.get("multiclock") else "async2sync",
                   "memory_map -formal", "setundef -undriven -anyseq", "dffunmap", "techmap",
                   "dffunmap", "setundef -zero", "aigmap", "opt_clean", "design -save all"]
        for n, name in enumerate(names):
            script += [f"select -set kept t:$assume {named(name)} {named(name, '.search')}",
                       "delete t:$assert @kept %d", "opt_clean",
                       f"write_aiger -I -B -zinit {n}.aig", "design -load all"]
        self.yosys(proof, texts, folder, script)
        found = {}
        for n, name in enumerate(names):
            step = self.counterexample(proof, folder, f"{n}.aig", depth,
                                       settings.get("conflicts", CONFLICTS))
            if step is not None:
                found[name] = step
        return found

    def counterexample(self, proof, folder, aig, depth, conflicts):
        """The step in which the bad state of a file of gates is reached; None: not found."""
        start = f"read_aiger {aig}; fold; strash; orpos; scorr; "
        log = ""
        # If scorr removes all registers, or there are no registers, one step is sufficient.
        for command in (start + f"bmc3 -g -C {conflicts} -F {depth}", start + "sat",
                        f"read_aiger {aig}; strash; sat"):
            try:
                done = subprocess.run(["yosys-abc", "-q", command], cwd=folder, env=self.env,
                                      capture_output=True, text=True, timeout=TIMEOUT_S)
            except subprocess.TimeoutExpired:
                return None
            step = re.search(r"was asserted in frame +(\d+)|\bSATISFIABLE", done.stdout)
            if step:
                return int(step.group(1) or 0)
            if "No output" in done.stdout or "UNSATISFIABLE" in done.stdout:
                return None
            log += done.stdout + done.stderr
        raise Failed(f"{proof.name}: abc: {log.strip()[-500:]}")

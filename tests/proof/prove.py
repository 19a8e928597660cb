# SPDX-License-Identifier: Apache-2.0
"""Proves the plain row kernels of the matcher free of run-time errors (see README.md)."""
import argparse
import concurrent.futures
import glob
import itertools
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

import claims

HERE = os.path.dirname(os.path.abspath(__file__))
FIRMWARE = os.path.join(HERE, "..", "..", "firmware")
MATCHER = os.path.join(FIRMWARE, "stereo", "match")
PACKAGES = {"frama-c": "frama-c-base", "why3": "why3", "z3": "z3"}
TIMEOUT_S = 60
MUTANT_TIMEOUT_S = 5  # an existing proof is found in less
# Lemmas that mislead the prover. Omitting them is always sound.
DRIVER = """import "{data}/drivers/z3_471.drv"
theory int.Abs
  remove prop Abs_le
end
theory frama_c_wp.cbits.Cbits
  remove prop lsl_add
end
theory frama_c_wp.memory.Memory
  remove prop separated_1
  remove prop valid_string
end
"""
# Without model-based instantiation a goal without a proof ends at once, and most others sooner.
COMMAND = "{z3} -smt2 {limit} smt.auto_config=false smt.mbqi=false smt.random_seed=42 -st %f"
PROVER = """
[prover]
alternative = "quick"
command = "{command}"
command_steps = "{steps}"
driver = "{driver}"
editor = ""
in_place = false
interactive = false
name = "Z3"
shortcut = "z3-quick"
version = "{version}"
"""


def run(words, **options):
    return subprocess.run(words, check=True, capture_output=True, text=True, **options).stdout


def facts():
    """Name, variables with their bounds (None: any), condition, relation of each fact."""
    with open(os.path.join(HERE, "bit_facts.txt"), encoding="ascii") as file:
        for line in file:
            if not line.startswith("#"):
                name, variables, condition, relation = (word.strip() for word in line.split(";"))
                bounds = {}
                for word in variables.split(","):
                    variable, bound = word.split()
                    bounds[variable] = None if bound == "any" else int(bound)
                yield name, bounds, condition, relation


def python(text):
    """The same as an expression of Python, with unbounded integers; / of positive numbers only."""
    return text.replace("(unsigned short)", "short").replace("/", "//")


def check_facts():
    """Tries every fact with all values. Returns the number of trials."""
    trials = 0
    for name, bounds, condition, relation in facts():
        if None in bounds.values():
            continue
        holds = eval(f"lambda {', '.join(bounds)}: {python(relation)}",
                     {"short": lambda value: value & 0xffff})
        applies = eval(f"lambda {', '.join(bounds)}: {python(condition) or True}")
        for values in itertools.product(*map(range, bounds.values())):
            trials += 1
            if applies(*values) and not holds(*values):
                sys.exit(f"prove.py: {name} is not a fact: {dict(zip(bounds, values))}")
    return trials


def write_facts(path):
    lines = ["/*@ axiomatic bit_facts {"]
    for name, bounds, condition, relation in facts():
        ranges = [f"0 <= {variable}" + (f" < {bound}" if bound else "")
                  for variable, bound in bounds.items()]
        premises = " ==> ".join(ranges + [condition] * bool(condition))
        lines.append(f"    axiom {name}: \\forall integer {', '.join(bounds)};"
                     f" {premises} ==> {relation};")
    with open(path, "w", encoding="ascii") as file:
        file.write("\n".join(lines + ["} */", ""]))


def write_prover(folder):
    """A configuration of why3 with one prover. Returns its path."""
    z3 = shutil.which("z3")
    config, driver = (os.path.join(folder, name) for name in ("why3.conf", "z3.drv"))
    run(["why3", "config", "detect", "-C", config])
    with open(driver, "w", encoding="ascii") as file:
        file.write(DRIVER.format(data=run(["why3", "--print-datadir"]).strip()))
    with open(config, "a", encoding="ascii") as file:
        file.write(PROVER.format(
            command=COMMAND.format(z3=z3, limit="-T:%t"),
            steps=COMMAND.format(z3=z3, limit="rlimit=%S"), driver=driver,
            version=re.search(r"version ([0-9.]+)", run([z3, "-version"])).group(1)))
    return config


def frama_c(folder, firmware, words):
    """Output of Frama-C for match_proof.c with these sources."""
    flags = f"-I{firmware} -I{folder}"
    return subprocess.run(
        ["frama-c", "-c11", f"-cpp-extra-args={flags}", os.path.join(HERE, "match_proof.c"),
         "-instantiate", *words],
        capture_output=True, text=True, check=False,
        env={**os.environ, "WHY3CONFIG": os.path.join(folder, "why3.conf")}).stdout


def contracts():
    """What contracts.acsl puts where: (function, line of it or None, lines of annotation)."""
    found, function, before = [], None, None
    with open(os.path.join(HERE, "contracts.acsl"), encoding="ascii") as file:
        for line in file:
            words = line.split()
            if not words or line.startswith("//"):
                continue
            if not line.startswith("    "):
                before = line.strip()[len("before "):] if words[0] == "before" else None
                function = function if before else words[-1]
                found.append((function, before, []))
            else:
                found[-1][2].append(line.rstrip())
    return found


def annotation(lines):
    """The lines as comments that Frama-C reads: each assertion is one of its own."""
    comments = [[]]
    for line in lines:
        if re.match(r"    (assert|admit) ", line) and comments[-1]:
            comments.append([])
        comments[-1].append(line)
    return "".join("/*@\n" + "\n".join(lines) + "\n*/\n" for lines in comments)


BLACKFIN = re.compile(r"^#if defined\((?:VECTOR_HAS_CELLS|__bfin__)\)\n(?:(?!#)[^\n]*\n)*#else\n", re.MULTILINE)


def weave(match):
    """Puts the contracts into the sources of a folder; each must find its place."""
    paths = [path for path in sorted(glob.glob(os.path.join(match, "*.h")))
             if not re.search("avx2|sse41|neon", path)]
    texts = {}
    for path in paths:
        with open(path, encoding="utf-8") as file:
            # What is proved is what other processors than the Blackfin run.
            texts[path] = BLACKFIN.sub("#if 1\n", file.read())
    at = {}  # by function: path, where its text ends before the next annotation
    for function, before, lines in contracts():
        if not before:
            start = re.compile(rf"^[a-zA-Z][^\n;={{]*\b{function}\([^;{{]*{{", re.MULTILINE)
            places = [(path, start.search(text)) for path, text in texts.items()]
            places = [(path, place.start()) for path, place in places if place]
            if len(places) != 1:
                sys.exit(f"prove.py: contracts.acsl: {len(places)} definitions of {function}")
            path, place = places[0]
        else:
            path, place = at[function]
            line = re.compile(rf"^ *{re.escape(before)}$", re.MULTILINE)
            found = line.search(texts[path], place)
            if not found or "\n}\n" in texts[path][place:found.start()]:
                sys.exit(f"prove.py: contracts.acsl: {function} has no line {before}")
            place = found.start()
        text = annotation(lines)
        texts[path] = texts[path][:place] + text + texts[path][place:]
        # The next line with the same text is another one.
        at[function] = path, texts[path].index("\n", place + len(text))
    for path, text in texts.items():
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)


def prove(folder, firmware, claim, functions, jobs, timeout_s=TIMEOUT_S):
    """Proved goals, all goals, and the output of Frama-C."""
    selection = ["-wp-rte", "-wp-fct", ",".join(functions)] if functions else ["-wp-prop=@lemma"]
    text = frama_c(folder, firmware, [
        *claim.checks, "-wp", *selection, "-wp-prover", "z3-quick", "-wp-par", str(jobs),
        "-wp-timeout", str(timeout_s)])
    count = re.search(r"Proved goals: +(\d+) / (\d+)", text)
    return (*map(int, count.groups()), text) if count else (0, 0, text)


def complaints(text):
    """Goals not proved by Frama-C, and its warnings."""
    return [line for line in text.splitlines()
            if re.search(r"Goal typed_|Smoke-test|Error|annot-error|aborted", line)
            and not re.search(r": Valid|\[Passed\]", line)]


def check_trusted():
    """The contracts may only use the trusted statements listed in claims.py."""
    found = [word for _, _, lines in contracts()
             for word in re.findall(r"\b(?:admit|axiom) \w+", " ".join(lines))]
    if sorted(found) != sorted(claims.TRUSTED):
        sys.exit(f"prove.py: trusted without proof: {found}, expected {claims.TRUSTED}")


def check_mutant(folder, mutant):
    """Whether the proof of a function fails if its source has a mistake."""
    name, old, new, function = mutant
    firmware = tempfile.mkdtemp(dir=folder)
    shutil.copytree(os.path.join(folder, "firmware"), firmware, dirs_exist_ok=True)
    path = os.path.join(firmware, "stereo", "match", name)
    with open(path, encoding="utf-8") as file:
        text = file.read()
    if text.count(old) != 1:
        return f"not one {old} in {name}"
    with open(path, "w", encoding="utf-8") as file:
        file.write(text.replace(old, new))
    claim = next(claim for claim in claims.CLAIMS if function in claim.functions)
    proved, goals, _ = prove(folder, firmware, claim, [function], 1, MUTANT_TIMEOUT_S)
    return "" if 0 < proved < goals else f"proved {proved} of {goals} goals"


def check_claims(folder, jobs, only):
    """Proves all claims, prints a table. Returns the count of failures."""
    firmware = os.path.join(folder, "firmware")
    failures = total_goals = total_proved = 0
    print(f"{'claim':22} {'functions':>9} {'goals':>6} {'proved':>6} {'seconds':>7}  result")
    for claim in claims.CLAIMS:
        functions = [name for name in claim.functions if re.search(only, name)]
        if claim.functions and not functions:
            continue
        started = time.monotonic()
        proved, goals, text = prove(folder, firmware, claim, functions, jobs)
        if proved < goals:
            # A prover may give up on a busy machine.
            proved, goals, text = prove(folder, firmware, claim, functions, 1)
        whole = functions == claim.functions
        missing = [name for name in functions if f"annotating function {name}\n" not in text]
        good = 0 < proved == goals and not missing and (not whole or goals >= claim.min_goals)
        failures += not good
        total_goals += goals
        total_proved += proved
        print(f"{claim.name:22} {len(functions):9} {goals:6} {proved:6}"
              f" {time.monotonic() - started:7.0f}  {'proved' if good else 'FAILED'}", flush=True)
        if not good:
            print("\n".join(complaints(text)), file=sys.stderr)
            print(f"at least {claim.min_goals} goals expected; not found: {missing}",
                  file=sys.stderr)
    print(f"proved {total_proved} of {total_goals} goals", flush=True)
    return failures


def check_mutants(folder, jobs, only):
    """The proof must fail for each mistake. Returns the count of failures."""
    mutants = [mutant for mutant in claims.MUTANTS if re.search(only, mutant[3])]
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        results = list(pool.map(lambda mutant: check_mutant(folder, mutant), mutants))
    for (name, old, new, function), result in zip(mutants, results):
        print(f"mistake in {function}: {old.strip()} -> {new.strip()}:"
              f" {'MISSED, ' + result if result else 'found'}")
    return sum(map(bool, results))


def wrong(text):
    """Exits with an error of tools/campaign, which passed the arguments."""
    print(f"tools/campaign: {text}; see tools/campaign --help", file=sys.stderr)
    sys.exit(2)


def choose(only):
    """The functions whose name matches; at least one."""
    try:
        chosen = [name for claim in claims.CLAIMS for name in claim.functions
                  if re.search(only, name)]
    except re.error:
        wrong(f"--only {only} is not a regular expression")
    return chosen or wrong(f"no function matches {only}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="provers in parallel")
    parser.add_argument("--only", default=".", help="only the functions whose name matches")
    parser.add_argument("--read", action="store_true", help="only check the contracts")
    parser.add_argument("--weave", metavar="DIR", help="only write the sources with contracts there")
    parser.add_argument("--list", action="store_true", help="only print the functions' names")
    arguments = parser.parse_args()
    chosen = choose(arguments.only)
    if arguments.list:
        print("\n".join(chosen))
        return 0
    if arguments.weave:
        shutil.copytree(MATCHER, arguments.weave)
        weave(arguments.weave)
        return 0
    missing = [package for command, package in PACKAGES.items() if not shutil.which(command)]
    if missing:
        sys.exit(f"prove.py: to install: {' '.join(missing)}")
    check_trusted()
    print(f"{check_facts()} trials of {len(list(facts()))} facts about bits: none fails", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(FIRMWARE, os.path.join(folder, "firmware"))
        weave(os.path.join(folder, "firmware", "stereo", "match"))
        write_facts(os.path.join(folder, "bit_facts.h"))
        write_prover(folder)
        if arguments.read:
            print(frama_c(folder, os.path.join(folder, "firmware"), []))
            return 0
        failures = check_claims(folder, arguments.jobs, arguments.only)
        failures += check_mutants(folder, arguments.jobs, arguments.only)
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())

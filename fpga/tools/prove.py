# SPDX-License-Identifier: Apache-2.0
"""Proves the properties of the bridge's modules and shows that no property is vacuous.

Every file fpga/formal/NAME.json describes one proof:
  module      the top of the proof
  sources     Verilog files, relative to fpga/; the property module is one of them
  depth       k of the induction; also the depth of the base case unless base_depth is there
  multiclock  true: several clocks; the step of the proof is then finer than each of them
  free        modules whose outputs may do anything, in the proof of the module that connects them
  defines     further macros (FORMAL and SYNTHESIS are always defined)
  parameters  of the top; left out: those of the source, that is full size
  cover       {"depth", "parameters", "defines"}: how the cover statements are reached; false: none
  kill        {"depth", "parameters", "defines"}: how mutants are searched from reset (40 steps);
              if sizes differ from those of the proof, the proof is also run with them
  mutants     [{"name", "file", "replace", "with", "kills": [labels], "depth"}]: a mistake in the
              RTL and the assertions that must fail with it; depth 0: induction only
  steps       {pattern of labels: reason}: assertions for which no mutant has a counterexample from
              reset; each pattern must match one

A proof is a base case (no assertion fails within `depth` steps of a reset) and an induction, so it
holds for all time. A mutant is killed by an assertion when a counterexample from reset violates it
(how: base) or when its induction fails (how: step). The second is weaker: the state from which it
fails may be unreachable. So every assertion killed only in this way is listed in "steps" with a
reason, such as the 500000 clocks of a servo frame between reset and the mistake. Every assertion
needs a label a_*, every cover one c_*, and every assertion must be in the "kills" of some mutant.
model_checker.py runs the programs.

Results are cached under a checksum of everything they depend on.
"""
import argparse
import concurrent.futures
import fnmatch
import glob
import hashlib
import json
import os
import re
import resource
import sys
import tempfile
import threading
import time

from model_checker import FPGA, Checker, Failed, label
from places import CACHE

RECIPE = 6  # increment if the same sources may give another result
GATES_DEPTH = 12  # steps in which the search must find nothing in the unchanged RTL
KILL_DEPTH = 40  # steps from reset in which a mutant's failure is searched
KNOWN = {"module", "sources", "mode", "depth", "base_depth", "multiclock", "defines", "parameters",
         "cover", "kill", "free", "mutants", "steps", "comment"}
NOT_OF_THE_PROOF = ("kill", "mutants", "steps", "comment")
KNOWN_MUTANT = {"name", "file", "replace", "with", "kills", "depth", "comment"}


class Proof:
    """One description, read and checked."""

    def __init__(self, path):
        self.name = os.path.splitext(os.path.basename(path))[0]
        with open(path, encoding="ascii") as file:
            self.data = json.load(file)
        unknown = set(self.data) - KNOWN
        if unknown:
            raise Failed(f"{self.name}: unknown keys {sorted(unknown)}")
        for mutant in self.data.get("mutants", []):
            if set(mutant) - KNOWN_MUTANT or not mutant.get("kills"):
                raise Failed(f"{self.name}: mutant {mutant.get('name')}: unknown keys or no kills")
        self.top = self.data["module"]
        self.depth = self.data["depth"]
        self.texts = {}
        for source in self.data["sources"]:
            with open(os.path.join(FPGA, source), encoding="utf-8") as file:
                self.texts[source] = file.read()
        for path in [os.path.join(FPGA, "formal", "cover_search.v"),
                     *sorted(glob.glob(os.path.join(FPGA, "*", "*.vh")))]:
            if not path.endswith(".vh") or self.includes(os.path.basename(path)):
                with open(path, encoding="utf-8") as file:
                    self.texts[os.path.relpath(path, FPGA)] = file.read()

    def includes(self, name):
        """Whether a source includes a file."""
        return any(f'`include "{name}"' in text for text in self.texts.values())

    def mutated(self, mutant):
        """The sources with the mutant's mistake."""
        texts = dict(self.texts)
        text = texts.get(mutant["file"])
        if text is None or text.count(mutant["replace"]) != 1:
            times = 0 if text is None else text.count(mutant["replace"])
            raise Failed(f"{self.name}: mutant {mutant['name']}: its text occurs {times} times "
                         f"in {mutant['file']}")
        texts[mutant["file"]] = text.replace(mutant["replace"], mutant["with"])
        return texts

    def cover(self):
        """Settings of the cover run."""
        given = self.data.get("cover", {})
        return None if given is False else {"depth": 40, **given}


def without_comments(part):
    """A part of a question; of sources (name to text) the texts without comments and blank lines."""
    if not isinstance(part, dict) or not all(isinstance(text, str) for text in part.values()):
        return part
    code = {name: re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S) for name, text in part.items()}
    return {name: re.sub(r"[ \t]*\n\s*", "\n", text) for name, text in code.items()}


class Runner(Checker):
    """Runs the tools for proofs and caches results."""

    def __init__(self, solver, use_cache):
        super().__init__(solver)
        self.folder = os.path.join(CACHE, "fpga-proofs") if use_cache else None
        self.kept = 0
        self.lock = threading.Lock()

    def cached(self, question, compute):
        """Returns compute(), or its cached result. Comments of the sources do not matter."""
        question = [without_comments(part) for part in question]
        key = hashlib.sha256(json.dumps([RECIPE, self.solver, self.versions, question],
                                        sort_keys=True).encode()).hexdigest()
        path = self.folder and os.path.join(self.folder, key + ".json")
        if path and os.path.exists(path):
            with open(path, encoding="ascii") as file:
                answer = json.load(file)
            with self.lock:
                self.kept += 1
            return answer
        started = time.monotonic()
        answer = compute()
        answer["seconds"] = round(time.monotonic() - started, 2)
        if path:
            os.makedirs(self.folder, exist_ok=True)
            with tempfile.NamedTemporaryFile("w", dir=self.folder, delete=False,
                                             encoding="ascii") as file:
                json.dump(answer, file)
            os.replace(file.name, path)
        return answer


def gates_fail(runner, proof, settings):
    """Whether the search finds a failure in unchanged RTL: then it would blame mutants."""
    with tempfile.TemporaryDirectory(prefix="prove-") as folder:
        return bool(runner.search(proof, proof.texts, folder, ["a_*"], GATES_DEPTH, settings))


def prove_one(runner, proof):
    """Base case, induction and covers of the unchanged RTL."""
    def compute():
        answer = {}
        with tempfile.TemporaryDirectory(prefix="prove-") as folder:
            found = runner.model(proof, proof.texts, folder)
            answer["asserts"] = [label(name) for name in found["assert"]]
            covers = [label(name) for name in found["cover"]]
            unnamed = [name for name in found["assert"] + found["cover"] if "$" in name]
            if unnamed:
                raise Failed(f"{proof.name}: without a label: {', '.join(unnamed)}")
            # At depth k the base case must cover the k steps that the induction assumes.
            base_depth = max(proof.data.get("base_depth", proof.depth), proof.depth)
            answer["base"] = runner.check(folder, "-t", str(base_depth + 1))
            answer["induction"] = runner.check(folder, "-i", "-t", str(proof.depth))
        answer["gates"] = gates_fail(runner, proof, {})
        cover = proof.cover()
        answer["covers"] = covers if cover else []
        answer["reached"] = {}
        if cover and covers:
            with tempfile.TemporaryDirectory(prefix="prove-") as folder:
                answer["reached"] = runner.search(proof, proof.texts, folder, covers,
                                                  cover["depth"], cover)
        return answer
    return runner.cached(["proof", proof.texts, {key: value for key, value in proof.data.items()
                                                 if key not in NOT_OF_THE_PROOF}], compute)


def kill_one(runner, proof, mutant):
    """Which assertions fail with the mutant, and how."""
    texts, wanted, kill = proof.mutated(mutant), mutant["kills"], proof.data.get("kill", {})
    depth = mutant.get("depth", kill.get("depth", KILL_DEPTH))

    def by_induction(killed):
        for name in wanted:
            if name not in killed:
                with tempfile.TemporaryDirectory(prefix="prove-") as folder:
                    runner.model(proof, texts, folder, only=name)
                    if name in runner.check(folder, "-i", "-t", str(proof.depth))["failed"]:
                        killed[name] = "step"

    def compute():
        found = {}
        if depth:
            with tempfile.TemporaryDirectory(prefix="prove-") as folder:
                found = runner.search(proof, texts, folder, wanted, depth, kill)
        killed = {name: "base" for name in found}
        by_induction(killed)
        return {"killed": killed, "at": found}
    return runner.cached(["mutant", texts, wanted, depth, kill,
                          {key: value for key, value in proof.data.items()
                           if key not in (*NOT_OF_THE_PROOF, "cover")}], compute)


def prove_small(runner, proof):
    """Base case and induction with the settings for mutants: without a mutant none may fail."""
    kill = proof.data["kill"]

    def compute():
        with tempfile.TemporaryDirectory(prefix="prove-") as folder:
            runner.model(proof, proof.texts, folder, kill.get("defines", []),
                         kill.get("parameters"))
            base_depth = max(proof.data.get("base_depth", proof.depth), proof.depth)
            return {"base": runner.check(folder, "-t", str(base_depth + 1)),
                    "induction": runner.check(folder, "-i", "-t", str(proof.depth)),
                    "gates": gates_fail(runner, proof, kill)}
    return runner.cached(["small", proof.texts, {**proof.data, "mutants": [], "steps": {},
                                                 "cover": {}, "comment": ""}], compute)


def hows(mutants):
    """Maps each killed assertion to the stronger way in which it was killed."""
    best = {}
    for _, answer in mutants:
        for name, how in answer["killed"].items():
            best[name] = "base" if "base" in (how, best.get(name)) else how
    return best


def judge(proof, result, mutants, want_mutants):
    """Messages about the problems of one proof."""
    wrong = []
    for part in ("base", "induction"):
        if not result[part]["passed"]:
            which = ", ".join(result[part]["failed"]) or result[part]["log"].strip()
            wrong.append(f"{part} fails: {which}")
    if result["gates"] or (result["small"] or {}).get("gates"):
        wrong.append("the search finds a failure in the unchanged RTL")
    if result["small"]:
        for part in ("base", "induction"):
            if not result["small"][part]["passed"]:
                which = ", ".join(result["small"][part]["failed"])
                wrong.append(f"{part} fails with the settings of kill: {which}")
    unreached = sorted(set(result["covers"]) - set(result["reached"]))
    if unreached:
        wrong.append(f"not reached: {', '.join(unreached)}")
    if not result["asserts"]:
        wrong.append("no assertion")
    for mutant, answer in mutants:
        missed = sorted(set(mutant["kills"]) - set(answer["killed"]))
        if missed:
            wrong.append(f"mutant {mutant['name']} survives {', '.join(missed)}")
    if not want_mutants:
        return wrong
    best, excused = hows(mutants), proof.data.get("steps", {})
    never = [name for name in result["asserts"] if name not in best]
    weak = [name for name in result["asserts"] if best.get(name) == "step"]
    if never:
        wrong.append(f"no mutant makes it fail: {', '.join(sorted(never))}")
    bare = [name for name in weak
            if not any(fnmatch.fnmatchcase(name, pattern) for pattern in excused)]
    if bare:
        wrong.append("killed only by a failing induction, without a reason: "
                     + ", ".join(sorted(bare)))
    for pattern in excused:
        if not fnmatch.filter(weak, pattern):
            wrong.append(f"steps: {pattern} matches nothing that only the induction kills")
    return wrong


def run_all(runner, proofs, jobs, want_mutants):
    """Yields name, result, mutants with answers, and messages, in order of the names."""
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        asked = []
        for proof in proofs:
            mutants = proof.data.get("mutants", []) if want_mutants else []
            small = proof.data.get("kill", {}).keys() & {"defines", "parameters"} and mutants
            asked.append((proof, pool.submit(prove_one, runner, proof),
                          pool.submit(prove_small, runner, proof) if small else None,
                          [(mutant, pool.submit(kill_one, runner, proof, mutant))
                           for mutant in mutants]))
        for proof, result, small, mutants in asked:
            try:
                answer = {**result.result(), "small": small.result() if small else None}
                killed = [(mutant, future.result()) for mutant, future in mutants]
                yield proof.name, answer, killed, judge(proof, answer, killed, want_mutants)
            except Failed as failure:
                yield proof.name, None, [], [str(failure)]


def processor_s():
    """Processor time of all programs."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--module", action="append", help="only this proof (may be repeated)")
    parser.add_argument("--no-mutants", action="store_true")
    parser.add_argument("--no-cache", action="store_true", help="ignore cached results")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--solver", choices=("yices", "z3"), default="yices")
    parser.add_argument("--json", help="write the results here")
    options = parser.parse_args()
    started = time.monotonic()
    try:
        proofs = [Proof(path) for path in sorted(glob.glob(os.path.join(FPGA, "formal", "*.json")))]
        proofs = [proof for proof in proofs if not options.module or proof.name in options.module
                  or proof.top in options.module]
        if not proofs:
            raise Failed("no such proof")
        runner = Runner(options.solver, not options.no_cache)
    except (Failed, OSError, KeyError, ValueError) as failure:
        print(f"prove.py: {failure}", file=sys.stderr)
        return 2
    print(f"{'proof':24} {'asserts':>7} {'covers':>6} {'k':>3} {'base':>5} {'ind.':>5} "
          f"{'mutants':>8} {'from reset':>10} {'seconds':>8}")
    report, sentences = [], []
    for name, result, mutants, wrong in run_all(runner, proofs, options.jobs,
                                                not options.no_mutants):
        sentences += [f"{name}: {sentence}" for sentence in wrong]
        report.append({"proof": name, "result": result, "wrong": wrong,
                       "mutants": [{"name": mutant["name"], **answer}
                                   for mutant, answer in mutants]})
        if result is None:
            print(f"{name:24} FAILED", flush=True)
            continue
        dead = sum(set(mutant["kills"]) <= set(answer["killed"]) for mutant, answer in mutants)
        answers = [result, result["small"], *(answer for _, answer in mutants)]
        seconds = sum(answer["seconds"] for answer in answers if answer)
        depth = next(proof.depth for proof in proofs if proof.name == name)
        print(f"{name:24} {len(result['asserts']):7} "
              f"{len(result['reached']):3}/{len(result['covers']):<2} {depth:3} "
              f"{'ok' if result['base']['passed'] else 'FAIL':>5} "
              f"{'ok' if result['induction']['passed'] else 'FAIL':>5} "
              f"{dead:4}/{len(mutants):<3} "
              f"{list(hows(mutants).values()).count('base'):4}/{len(result['asserts']):<5} "
              f"{seconds:8.1f}", flush=True)
    total = [entry["result"] for entry in report if entry["result"]]
    print(f"{len(total)} proofs, {sum(len(result['asserts']) for result in total)} assertions, "
          f"{sum(len(result['reached']) for result in total)} covers, "
          f"{sum(len(entry['mutants']) for entry in report)} mutants: "
          f"{time.monotonic() - started:.1f} s ({processor_s():.1f} s of processors, "
          f"{runner.kept} answers cached)")
    for sentence in sentences:
        print(f"prove.py: {sentence}", file=sys.stderr)
    if options.json:
        with open(options.json, "w", encoding="ascii") as file:
            json.dump(report, file, indent=1)
    return 1 if sentences else 0


if __name__ == "__main__":
    sys.exit(main())

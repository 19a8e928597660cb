# SPDX-License-Identifier: Apache-2.0
"""Shows that the tests of tests/hdl detect mistakes: a mutation of the Verilog makes its test fail.

seeded_faults.json lists them: {"name", "file", "replace", "with", "test", "case", "rounds"}; test is a
program of tests/hdl, case and rounds (both optional) select its cases and rounds. Every program
must have at least one, and must pass without any.
"""
import argparse
import concurrent.futures
import glob
import json
import os
import queue
import re
import subprocess
import sys
import time

from places import FPGA, ROOT, own_cache

CACHE = own_cache("fpga-seeded_fault")
TABLE = os.path.join(FPGA, "tools", "seeded_faults.json")
TIMEOUT_S = 600  # a hanging test has detected something, but is not a verdict


class Bench:
    """A separate build whose Verilog may be changed."""

    def __init__(self, number):
        self.folder = os.path.join(CACHE, f"bench{number}")
        self.verilog = os.path.join(self.folder, "verilog")
        self.build = os.path.join(self.folder, "build")
        self.log = os.path.join(self.folder, "log")
        os.makedirs(self.verilog, exist_ok=True)
        self.restore()
        self.tool("cmake", "-S", ROOT, "-B", self.build, "-G", "Ninja", "-DVERGENCE_FPGA=ON",
                  "-DVERGENCE_FPGA_VERILOG=" + self.verilog,
                  # Yosys has written the Verilog of mutants, with its own names.
                  "-DVERGENCE_FPGA_EVERY_CLOCK=ON")

    def tool(self, *words):
        with open(self.log, "w", encoding="utf-8") as log:
            if subprocess.run(words, stdout=log, stderr=subprocess.STDOUT).returncode != 0:
                raise RuntimeError(f"{words[0]} failed, see {self.log}")

    def restore(self):
        """The Verilog of the tree; unchanged files keep their time."""
        for name in ("rtl", "generated"):
            os.makedirs(os.path.join(self.verilog, name), exist_ok=True)
            for path in glob.glob(os.path.join(FPGA, name, "*.v*")):
                self.write(os.path.join(name, os.path.basename(path)), read(path))

    def write(self, name, text):
        path = os.path.join(self.verilog, name)
        if not os.path.exists(path) or read(path) != text:
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)

    def run(self, program, case, rounds, timeout_s=TIMEOUT_S):
        """Builds and runs a program; returns its exit code and output."""
        self.tool("ninja", "-C", self.build, "-j", "1", program)
        words = [os.path.join(self.build, "tests", "hdl", program)]
        if case:
            words.append("--test-case=" + case)
        environment = {**os.environ, **({"VERGENCE_DRAWS": str(rounds)} if rounds else {})}
        done = subprocess.run(words, capture_output=True, text=True, env=environment,
                              timeout=timeout_s)
        return done.returncode, done.stdout + done.stderr


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def first_error(output):
    """The first failure that a test reported."""
    found = re.search(r"ERROR: (.*)", output)
    values = re.search(r"values: (.*)", output)
    return (found.group(1).strip() + (f" ({values.group(1).strip()})" if values else "")
            if found else output.strip().splitlines()[-1] if output.strip() else "no output")


def seeded_fault(bench, entry):
    """Whether the test failed, as it should; and its output."""
    text = read(os.path.join(FPGA, entry["file"]))
    if text.count(entry["replace"]) != 1:
        return False, f"its text occurs {text.count(entry['replace'])} times in {entry['file']}"
    bench.write(entry["file"], text.replace(entry["replace"], entry["with"]))
    try:
        code, output = bench.run(entry["test"], entry.get("case"), entry.get("rounds"))
    except subprocess.TimeoutExpired:
        return False, "the test hangs"
    except RuntimeError as failure:
        return False, str(failure)
    finally:
        bench.restore()
    return code != 0, first_error(output)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default=".", help="names of mutations (regular expression)")
    options = parser.parse_args()
    started = time.monotonic()
    with open(TABLE, encoding="utf-8") as file:
        entries = json.load(file)
    programs = {"hdl_" + os.path.splitext(os.path.basename(path))[0]
                for path in glob.glob(os.path.join(ROOT, "tests", "hdl", "*_test.cpp"))}
    chosen = [entry for entry in entries if re.search(options.only, entry["name"])]
    wrong = [f"no mutation for {name}" for name in
             sorted(programs - {entry["test"] for entry in entries})]
    benches = queue.Queue()
    os.makedirs(CACHE, exist_ok=True)
    for number in range(options.jobs):
        benches.put(Bench(number))

    def with_bench(work, *arguments):
        bench = benches.get()
        try:
            return work(bench, *arguments)
        finally:
            benches.put(bench)

    def clean(bench, key):
        program, case, rounds = key
        return bench.run(program, case, rounds)[0] == 0

    keys = sorted({(entry["test"], entry.get("case"), entry.get("rounds")) for entry in chosen},
                  key=str)
    print("| mutation | test | detected | output |\n|---|---|---|---|", flush=True)
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        fresh = [pool.submit(with_bench, clean, key) for key in keys]
        asked = [pool.submit(with_bench, seeded_fault, entry) for entry in chosen]
        for key, future in zip(keys, fresh):
            if not future.result():
                wrong.append(f"{key[0]} fails without a mutation")
        for entry, future in zip(chosen, asked):
            noticed, output_text = future.result()
            print(f"| {entry['name']} | {entry['test']} | {'yes' if noticed else 'NO'} | "
                  f"`{output_text[:90].replace('|', '/')}` |", flush=True)
            if not noticed:
                wrong.append(f"{entry['name']} is not detected: {output_text}")
    for sentence in wrong:
        print(f"seeded_fault.py: {sentence}")
    print(f"{len(chosen)} mutations, {len(wrong)} findings, {time.monotonic() - started:.0f} s")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Runs fpga/cocotb/test_conformance.py under icarus on the RTL or on a netlist after synthesis.

Needs the Python environment of tools/fpga_python, and re-runs itself in it.
"""
import argparse
import concurrent.futures
import os
import re
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

import synth
from places import FPGA

TIMEOUT_S = 7200
SHARE = "/usr/share/yosys"
SYNTHESIS = {  # as synth.py does it, but without pads and clock buffers
    "xc3s": lambda folder: synth.spartan3_commands(folder, "bridge_core", "-noiopad -noclkbuf"),
    "ice40": lambda folder: "synth_ice40 -device hx -top bridge_core"}
CELLS = {"xc3s": f"{SHARE}/xilinx/cells_sim.v", "ice40": f"{SHARE}/ice40/cells_sim.v"}


def netlist(target, folder):
    """The sources of a netlist: itself and the vendor's cells as yosys models them."""
    path = os.path.join(folder, f"{target}.v")
    files = " ".join(synth.portable())
    synth.run(["yosys", "-p", f"read_verilog -I{FPGA}/generated {files}; "
               f"{SYNTHESIS[target](folder)}; write_verilog -noattr {path}"], folder, "yosys.log")
    return [path, CELLS[target]]


def compile_bench(design, folder):
    sources = synth.portable() if design == "rtl" else netlist(design, folder)
    image = os.path.join(folder, "bench.vvp")
    subprocess.run(["iverilog", "-g2005", "-DNO_ICE40_DEFAULT_ASSIGNMENTS", f"-I{FPGA}/generated",
                    "-s", "conformance_bench", "-o", image,
                    os.path.join(FPGA, "cocotb", "conformance_bench.v"), *sources],
                   check=True, capture_output=True)
    return image


def cocotb_environment():
    """Cocotb's library for vvp, and the environment that it needs."""
    config = [sys.executable, "-m", "cocotb_tools.config"]
    libraries, python, entry = (
        subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()
        for words in ([*config, "--lib-dir"], [*config, "--libpython"],
                      [sys.executable, "-c", "import cocotb_tools.config as c; "
                       "print(c.pygpi_entry_point())"]))
    return os.path.join(libraries, "libcocotbvpi_icarus.so"), {
        **os.environ, "PYTHONPATH": os.path.join(FPGA, "cocotb"), "GPI_USERS": f"{python};{entry}",
        "PYGPI_PYTHON_BIN": sys.executable, "COCOTB_TEST_MODULES": "test_conformance",
        "TOPLEVEL": "conformance_bench", "COCOTB_TOPLEVEL": "conformance_bench",
        "TOPLEVEL_LANG": "verilog", "PYTHONDONTWRITEBYTECODE": "1", "COCOTB_RANDOM_SEED": "1",
        "REGISTER_MAP": os.path.join(FPGA, "generated", "bridge_registers.json")}


def run_shard(image, every, shard, shards):
    """Runs one simulation with its share of the vectors. Returns names of tests run and failed."""
    folder = f"{image}.{shard}"
    os.mkdir(folder)
    library, environment = cocotb_environment()
    results = os.path.join(folder, "results.xml")
    environment.update({"COCOTB_RESULTS_FILE": results, "EVERY": str(every),
                        "SHARD": f"{shard}/{shards}"})
    done = subprocess.run(["vvp", "-m", library, image], cwd=folder, capture_output=True, text=True,
                          timeout=TIMEOUT_S, env=environment)
    if not os.path.exists(results):
        sys.exit(f"conformance.py: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    cases = list(xml.etree.ElementTree.parse(results).iter("testcase"))
    failed = [case.get("name") for case in cases if case.find("failure") is not None
              or case.find("error") is not None]
    if failed:
        print("\n".join(re.findall(r".*(?:Error|assert|FAIL).*", done.stdout)[:20]))
    return [case.get("name") for case in cases], failed


def run(design, folder, every, shards):
    """Compiles and runs. Returns names of tests that passed or failed, and of those that failed."""
    image = compile_bench(design, folder)
    with concurrent.futures.ThreadPoolExecutor(shards) as pool:
        outcomes = list(pool.map(lambda shard: run_shard(image, every, shard, shards),
                                 range(shards)))
    if not all(tests for tests, _ in outcomes):
        sys.exit(f"conformance.py: {design}: a simulation ran no test")
    return tuple(sorted({name for outcome in outcomes for name in outcome[i]}) for i in range(2))


def main():
    found = subprocess.run([os.path.join(FPGA, "..", "tools", "fpga_python")], check=True,
                           capture_output=True, text=True).stdout.strip()
    own = os.path.join(found, "python3")
    if os.path.realpath(sys.prefix) != os.path.realpath(os.path.join(found, "..")):
        os.execv(own, [own, "-B", *sys.argv])
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("designs", nargs="*", default=["rtl"], metavar="DESIGN",
                        help="rtl (default), xc3s, ice40")
    parser.add_argument("--every", type=int, default=1, help="every N-th vector only")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="simulations at once")
    options = parser.parse_args()
    wrong = 0
    for design in options.designs:
        if design != "rtl" and design not in SYNTHESIS:
            parser.error(f"unknown design {design}")
        started = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="conformance-") as folder:
            tests, failed = run(design, folder, options.every, options.jobs)
        wrong += len(failed) + (not tests)
        print(f"{design}: {len(tests)} tests, failed: {', '.join(failed) or 'none'} "
              f"({time.monotonic() - started:.1f} s)", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Lists every place where a signal passes from one clock to another, and judges each.

The netlist comes from yosys: flat, with flip-flops of clock, data and asynchronous reset only. The
clock of an input is what the settings' "ports" say ("async": any time; "static": never while it
matters). Kinds:
  synchroniser   one foreign flip-flop or input, no logic, into a flip-flop that feeds one other of
                 the same clock and nothing else: right as it is
  logic          a foreign signal that reaches the flip-flop any other way
  bits           synchronisers side by side for bits of one foreign register: may arrive torn
  reset          an asynchronous set or reset that does not come from its own clock's flip-flop
  clock          a clock that comes out of logic
All but the first are findings, unless the settings' "waivers" name them with a reason:
  {"kind", "from", "to", "reason"}; from and to are patterns of names without bit numbers, as in
  fnmatch. A waiver that fits nothing is a finding, too.
"""
import argparse
import collections
import fnmatch
import glob
import json
import os
import re
import subprocess
import sys
import tempfile

from places import FPGA

SETTINGS = os.path.join(FPGA, "tools", "cdc_settings.json")
Finding = collections.namedtuple("Finding", "kind source target from_clock to_clock")


def netlist(sources, top, include):
    """The module of yosys' JSON."""
    with tempfile.TemporaryDirectory(prefix="cdc-") as folder:
        path = os.path.join(folder, "flat.json")
        script = (f"read_verilog {' '.join('-I' + name for name in include)} {' '.join(sources)}; "
                  f"hierarchy -check -top {top}; proc; flatten; opt; memory; dffunmap; simplemap; "
                  f"opt -keepdc; clean; write_json {path}")
        done = subprocess.run(["yosys", "-q", "-p", script], cwd=FPGA, capture_output=True,
                              text=True)
        if done.returncode != 0:
            sys.exit(f"cdc.py: yosys: {done.stderr.strip()}")
        with open(path, encoding="utf-8") as file:
            return json.load(file)["modules"][top]


def without_bit(name):
    return re.sub(r"\[\d+\]$", "", name)


class Design:
    """A flat netlist as a graph from bits back to what drives them."""

    def __init__(self, module, ports):
        self.ports = ports
        self.names = self.name_bits(module)
        self.flops, self.gates, self.users = {}, {}, collections.defaultdict(list)
        self.inputs = {bit: (name, i) for name, port in module["ports"].items()
                       if port["direction"] == "input" for i, bit in enumerate(port["bits"])}
        for name, cell in module["cells"].items():
            pins = {pin: bits for pin, bits in cell["connections"].items()}
            if cell["type"].startswith(("$_DFF", "$_ALDFF", "$_DFFSR", "$_SDFF")):
                self.add_flop(name, pins)
                continue
            if cell["type"].startswith(("$_DLATCH", "$_SR")):
                sys.exit(f"cdc.py: latch {name}")
            outputs = [pin for pin in pins if cell["port_directions"][pin] == "output"]
            for pin in outputs:
                inputs = [bit for other in pins if other not in outputs for bit in pins[other]]
                for bit in pins[pin]:
                    self.gates[bit] = inputs
            for other in pins:
                if other not in outputs:
                    for bit in pins[other]:
                        self.users[bit].append((name, other))
        self.clocks = {flop["clock"] for flop in self.flops.values()}
        for name, port in module["ports"].items():
            if port["direction"] == "output":
                for bit in port["bits"]:
                    self.users[bit].append((name, "port"))

    @staticmethod
    def name_bits(module):
        """Bit to the name that people gave it where it is made: the deepest in the hierarchy."""
        names = {}
        outputs = {name for name, port in module["ports"].items() if port["direction"] == "output"}
        inputs = {name for name, port in module["ports"].items() if port["direction"] == "input"}
        for name, net in module["netnames"].items():
            for i, bit in enumerate(net["bits"]):
                title = f"{name}[{i}]" if len(net["bits"]) > 1 else name
                rank = (name not in inputs, net["hide_name"], name in outputs, name.endswith("_i"),
                        -name.count("."), len(name), title)
                if bit not in names or rank < names[bit]:
                    names[bit] = rank
        return {bit: rank[-1] for bit, rank in names.items()}

    def add_flop(self, name, pins):
        resets = [bit for pin in ("R", "S", "L") for bit in pins.get(pin, [])]
        self.flops[pins["Q"][0]] = {"name": name, "clock": pins["C"][0], "data": pins["D"][0],
                                    "resets": resets}
        for pin, bits in pins.items():
            if pin != "Q":
                for bit in bits:
                    self.users[bit].append((name, pin))

    def name(self, bit):
        return self.names.get(bit, str(bit))

    def clock_name(self, bit):
        """Two edges of one clock are one clock: an inverter is looked through."""
        while bit in self.gates and len(self.gates[bit]) == 1:
            bit = self.gates[bit][0]
        return self.name(bit)

    def origins(self, bit):
        """Flip-flops' outputs and inputs that a bit depends on; and whether logic is between."""
        found, seen, logic = set(), set(), False
        todo = [bit]
        while todo:
            at = todo.pop()
            if at in seen or isinstance(at, str):
                continue
            seen.add(at)
            if at in self.flops or at in self.inputs:
                found.add(at)
            else:
                logic = True
                todo += self.gates.get(at, [])
        return found, logic

    def clock_of(self, origin):
        """The clock of a flip-flop's output or of an input."""
        if origin in self.flops:
            return self.clock_name(self.flops[origin]["clock"])
        if origin in self.clocks:
            return self.name(origin)
        name, index = self.inputs[origin]
        for key in (f"{name}[{index}]", name):
            if key in self.ports:
                return self.ports[key]
        return f"undeclared input {name}"


def is_synchroniser(design, output):
    """Whether this flip-flop is a first stage: its output goes to one flip-flop's data alone."""
    users = design.users[output]
    if len(users) != 1 or users[0][1] != "D":
        return False
    second = next((flop for flop in design.flops.values() if flop["name"] == users[0][0]), None)
    return (second is not None and design.clock_name(second["clock"]) ==
            design.clock_name(design.flops[output]["clock"]))


def examine(design):
    """All crossings of a design."""
    found = set()
    clean = collections.defaultdict(set)
    for output, flop in design.flops.items():
        own, target = design.clock_name(flop["clock"]), design.name(output)
        origins, logic = design.origins(flop["data"])
        foreign = {origin for origin in origins if design.clock_of(origin) not in (own, "static")}
        for origin in foreign:
            source, clock = design.name(origin), design.clock_of(origin)
            if not logic and len(origins) == 1 and is_synchroniser(design, output):
                found.add(Finding("synchroniser", source, target, clock, own))
                clean[without_bit(source), clock, own].add((source, target))
            else:
                found.add(Finding("logic", without_bit(source), without_bit(target), clock, own))
        for reset in flop["resets"]:
            for origin in design.origins(reset)[0]:
                clock = design.clock_of(origin)
                if clock not in (own, "static"):
                    found.add(Finding("reset", without_bit(design.name(origin)), without_bit(target),
                                      clock, own))
        if flop["clock"] in design.gates and len(design.gates[flop["clock"]]) > 1:
            found.add(Finding("clock", own, own, own, own))
    for (source, clock, own), pairs in clean.items():
        if len({bit for bit, _ in pairs}) > 1 and clock not in ("async",):
            targets = sorted({without_bit(target) for _, target in pairs})
            found.add(Finding("bits", source, targets[0], clock, own))
    return sorted(found)


def judge(found, waivers):
    """Findings with the reason that waives them (None: none), and waivers that fit nothing."""
    used, judged = set(), []
    for finding in found:
        reason = "two stages" if finding.kind == "synchroniser" else None
        for i, waiver in enumerate(waivers):
            if (waiver["kind"] == finding.kind and fnmatch.fnmatchcase(finding.source, waiver["from"])
                    and fnmatch.fnmatchcase(finding.target, waiver["to"])):
                used.add(i)
                reason = waiver["reason"]
        judged.append((finding, reason))
    return judged, [waiver for i, waiver in enumerate(waivers) if i not in used]


def table(judged):
    """The list as Markdown; one line a register, not a bit."""
    lines = ["| from | to | clocks | kind | why it is right |", "|---|---|---|---|---|"]
    for finding, reason in judged:
        line = (f"| `{without_bit(finding.source)}` | `{without_bit(finding.target)}` | "
                f"{finding.from_clock} -> {finding.to_clock} | {finding.kind} | {reason or 'FINDING'} |")
        if line not in lines:
            lines.append(line)
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--settings", default=SETTINGS)
    parser.add_argument("--markdown", help="write the list of crossings here")
    options = parser.parse_args()
    with open(options.settings, encoding="utf-8") as file:
        settings = json.load(file)
    sources = [path for pattern in settings["sources"]
               for path in sorted(glob.glob(os.path.join(FPGA, pattern)))]
    design = Design(netlist(sources, settings["top"], settings.get("include", [])),
                    settings["ports"])
    judged, unused = judge(examine(design), settings["waivers"])
    open_findings = [finding for finding, reason in judged if reason is None]
    for finding in open_findings:
        print(f"{finding.kind}: {finding.source} ({finding.from_clock}) -> "
              f"{finding.target} ({finding.to_clock})")
    for waiver in unused:
        print(f"waiver fits nothing: {waiver['kind']} {waiver['from']} -> {waiver['to']}")
    kinds = collections.Counter(finding.kind for finding, _ in judged)
    print(f"{len(design.flops)} flip-flops, crossings: " +
          (", ".join(f"{number} {kind}" for kind, number in sorted(kinds.items())) or "none") +
          f"; {len(open_findings)} findings, {len(unused)} waivers without use")
    if options.markdown:
        with open(options.markdown, "w", encoding="utf-8") as file:
            file.write(table(judged))
    return 1 if open_findings or unused else 0


if __name__ == "__main__":
    sys.exit(main())

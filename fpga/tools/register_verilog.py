# SPDX-License-Identifier: Apache-2.0
"""Generates Verilog-2005 from the register map: the constants and the register file."""

from verilog_text import (at_least, pair_name, piece_text, repeat, slice_of, two_for_each_bit,
                          vector, wrapped)

HEADER = """\
// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
"""

REGISTER_FILE_TEXT = """\
//
// Registers of the bridge between the I2C target and the hardware.
//
//                    ___     ___     ___     ___     ___     ___
// clk_i            _|   |___|   |___|   |___|   |___|   |___|   |__
// index_i          =X== index, held ================================
// write_data_i     =X== word, held =================================
// write_allowed_o  _________|^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
// write_strobe_i   _________________|^^^^^^^|_______________________
// <name>_o         =========================X= new value ===========
// read_strobe_i    _________|^^^^^^^|_______________________________
// read_data_o      =========================X= word, held ==========
//
// write_allowed_o and index_known_o follow their inputs by one clock; write_strobe_i may come only
// while write_allowed_o is high. Rejected are: a number outside its limits, a code without a name,
// what needs the unlocked map while it is locked, and registers that are only read.
// Ports: <register>[_<field>] with _o for what software sets (for one clock only, where 1 starts
// something), _i for inputs from hardware and _clear_o for pulses of one clock that clear it.
// <block>_hold_o: the hardware keeps the values of the block. Latency: 2 clocks.
// FILL_FROM: 0; in proofs, where the filling of the memory begins.
"""


def constants(registers):
    """The text of bridge_registers.vh."""
    lines = [HEADER, "`ifndef BRIDGE_REGISTERS_VH", "`define BRIDGE_REGISTERS_VH", ""]
    for register in registers:
        name = f"BRIDGE_{register.name.upper()}"
        lines.append(f"`define {name}_INDEX 8'h{register.index:02X}")
        lines.append(f"`define {name}_RESET 16'h{register.reset:04X}")
        for field in register.fields:
            if field.whole:
                continue
            part = f"{name}_{field.name.upper()}"
            lines.append(f"`define {part}_LOW {field.low}")
            lines.append(f"`define {part}_BITS {field.width}")
        for field in register.fields:
            for code, value, _ in field.codes:
                part = name if field.whole else f"{name}_{field.name.upper()}"
                lines.append(f"`define {part}_IS_{code.upper()} {field.width}'d{value}")
    lines += ["", "`endif", ""]
    return "\n".join(lines)


class RegisterFile:
    """Collects the parts of register_file.v for all registers."""

    def __init__(self, registers):
        self.registers = registers
        self.ports = []
        self.declarations = []
        self.resets = []
        self.stores = []
        self.wires = []
        self.memory = [r for r in registers if r.place is not None]
        self.counters = [r for r in registers if r.counter is not None]
        # What each bit of a register reads: index -> bit -> expression.
        self.bits = {r.index: {} for r in registers if r.place is None and r.counter is None}

    def text(self):
        for register in self.registers:
            if register.index in self.bits:
                self.add_register(register)
        parts = [
            HEADER.rstrip("\n"), REGISTER_FILE_TEXT, "`default_nettype none", "",
            "module register_file #(", "  parameter [4:0] FILL_FROM = 5'd0", ") (",
            self.port_list(), ");", "",
            self.limits(), self.write_path(), self.memory_path(), self.counter_path(), self.hold(),
            self.read_path(), self.formal(),
            "endmodule", "", "`default_nettype wire", "",
        ]
        return "\n".join(parts)

    # Ports and storage, register by register.

    def add_register(self, register):
        bits = self.bits[register.index]
        if register.pair_high:
            self.ports.append(f"input  wire [31:0] {register.pair}_i")
            bits.update({bit: f"{register.pair}_i[{bit + 16}]" for bit in range(16)})
        elif register.pair_low:
            bits.update({bit: f"low_word[{bit}]" for bit in range(16)})
        elif register.vector:
            self.add_vector(register)
        else:
            for field in register.fields:
                self.add_field(register, field)

    def add_vector(self, register):
        bits = len(register.fields)
        width = vector(bits)
        self.ports.append(f"input  wire {width}{register.name}_i")
        self.ports.append(f"output wire {width}{register.name}_clear_o")
        self.wires.append(
            f"assign {register.name}_clear_o = {{{bits}{{{self.written(register)}}}}}"
            f" & write_data_i[{bits - 1}:0];")
        self.reads(register, 0, bits, f"{register.name}_i")

    def add_field(self, register, field):
        """Declares ports and storage of a field."""
        name = register.port(field)
        if field.kind == "constant":
            ones = [bit for bit in range(field.width) if field.reset >> bit & 1]
            self.bits[register.index].update({field.low + bit: "1'b1" for bit in ones})
            return
        if field.kind == "stored":
            self.add_stored(register, field, name)
            return
        bits = slice_of("write_data_i", field)
        if field.kind == "pulse":
            self.ports.append(f"output wire {vector(field.width)}{name}_o")
            self.wires.append(
                f"assign {name}_o = {repeat(self.written(register), field.width)} & {bits};")
            return
        self.ports.append(f"input  wire {vector(field.width)}{name}_i")
        if field.kind in ("w1c", "clear"):
            condition = self.written(register)
            if field.kind == "w1c":
                condition += f" && {bits}"
            self.ports.append(f"output wire {name}_clear_o")
            self.wires.append(f"assign {name}_clear_o = {condition};")
        self.reads(register, field.low, field.width, f"{name}_i")

    def add_stored(self, register, field, name):
        bits, zeros = field.bits, field.zero_low_bits
        stored = f"{name}_o"
        if zeros:
            stored = name
            self.ports.append(f"output wire {vector(bits)}{name}_o")
            self.declarations.append(f"reg {vector(bits - zeros)}{name};")
            self.wires.append(f"assign {name}_o = {{{name}, {zeros}'d0}};")
        else:
            self.ports.append(f"output reg  {vector(bits)}{name}_o")
        self.resets.append(f"{stored} <= {bits - zeros}'d{field.reset >> zeros};")
        condition = self.written(register)
        top, bottom = field.low + bits - 1, field.low + zeros
        source = f"write_data_i[{top}:{bottom}]" if top > bottom else f"write_data_i[{top}]"
        if field.key is not None:
            source = f"write_data_i == 16'h{field.key:04X}"
        self.stores.append(f"if ({condition}) {stored} <= {source};")
        self.reads(register, field.low, bits, f"{name}_o", zeros)

    def reads(self, register, low, width, port, zeros=0):
        """Records that `width` bits of a register from bit `low` on read a port."""
        for bit in range(zeros, width):
            source = f"{port}[{bit}]" if width > 1 else port
            self.bits[register.index][low + bit] = source

    def written(self, register):
        return f"write_strobe_i && index_i == 8'h{register.index:02X}"

    # Parts of the text.

    def port_list(self):
        bus = [
            "input  wire clk_i",
            "input  wire rst_i",
            "input  wire [7:0] index_i",
            "output reg  index_known_o",
            "input  wire reading_i",
            "input  wire read_strobe_i",
            "output reg  [15:0] read_data_o",
            "output reg  write_allowed_o",
            "input  wire write_strobe_i",
            "input  wire [15:0] write_data_i",
        ]
        bus += [
            "output wire filling_o",
            "output wire [3:0] fill_o",
            "input  wire [3:0] memory_place_i",
            "output wire memory_busy_o",
            "output wire [15:0] memory_word_o",
            "input  wire memory_store_i",
            "input  wire [15:0] memory_data_i",
            "output wire memory_stored_o",
        ]
        bus += [
            "output wire [3:0] counter_place_o",
            "output wire counter_clear_o",
            "input  wire [7:0] counter_i",
        ]
        bus += [f"output reg  {r.block}_hold_o" for r in self.registers if r.holds_block]
        return ",\n".join("  " + port for port in bus + self.ports)

    def limits(self):
        lines = ["  // Numbers are compared with constants bit by bit."]
        for constant in sorted(self.constants("minimum") | self.constants("minimum_unlocked")):
            lines.append(wrapped(f"wire at_least_{constant} = {at_least(constant)};"))
        for constant in sorted(self.constants("maximum")):
            lines.append(wrapped(f"wire at_most_{constant} = !({at_least(constant + 1)});"))
        lines += [
            "", "  // What may be written to the register at the index.", "  reg allowed;",
            "  always @* case (index_i)"]
        groups = {}
        for register in self.registers:
            if register.writable:
                condition = " && ".join(self.conditions(register)) or "1'b1"
                groups.setdefault(condition, []).append(f"8'h{register.index:02X}")
        for condition, indices in groups.items():
            lines.append(wrapped(f"{', '.join(indices)}: allowed = {condition};", 4))
        lines += [
            "    default: allowed = 1'b0;", "  endcase", "",
            "  always @(posedge clk_i or posedge rst_i) begin",
            "    if (rst_i) write_allowed_o <= 1'b0;",
            "    else write_allowed_o <= allowed;",
            "  end", ""]
        return "\n".join(lines)

    def constants(self, limit):
        """All constant limits of one kind that need a comparison."""
        numbers = [r.fields[0] for r in self.registers if r.fields[0].is_number]
        return {getattr(f, limit) for f in numbers} - {None, 0, 0xFFFF}

    @staticmethod
    def conditions(register):
        """What must be true for a write."""
        terms = ["unlock_o"] if register.unlock_only else []
        for field in register.fields:
            if field.has_gaps:
                terms.append(f"{slice_of('write_data_i', field)} <= {field.width}'d{field.maximum}")
        field = register.fields[0]
        if field.is_number:
            if field.minimum_unlocked == 0:
                terms.append(f"(unlock_o || at_least_{field.minimum})")
            elif field.minimum:
                terms.append(f"at_least_{field.minimum}")
            if field.maximum < 0xFFFF:
                terms.append(f"at_most_{field.maximum}")
        return terms

    def write_path(self):
        lines = ["  " + line for line in self.declarations] + [
            "  always @(posedge clk_i or posedge rst_i) begin", "    if (rst_i) begin"]
        lines += ["      " + line for line in self.resets]
        lines.append("    end else begin")
        lines += ["      " + line for line in self.stores] + ["    end", "  end", ""]
        lines += ["  " + line for line in self.wires]
        return "\n".join(lines + [""])

    def memory_path(self):
        """The registers in memory."""
        stored = [r for r in self.memory if r.fields[0].kind == "stored"]
        lines = [
            "  // Some registers are in a memory of 16 words, of which the hardware has one while",
            "  // memory_busy_o is low: after reset the memory is filled, and the bus comes first.",
            "  reg [15:0] memory [0:15];", "  reg [4:0] fill;", "  reg fetch;",
            "  always @(posedge clk_i or posedge rst_i) begin", "    if (rst_i) fill <= FILL_FROM;",
            "    else if (!fill[4]) fill <= fill + 5'd1;", "  end", "  assign filling_o = !fill[4];",
            "  assign fill_o = fill[3:0] ^ 4'd1;",
            "",
            "  // Place 1 comes first and is not written, and the word has no 1 there: so the word can",
            "  // are in the register that chooses between the sources. Both halves are filled alike.",
            wrapped(f"wire [15:0] fill_word = {self.fill_word(stored)};"),
            "  wire filled_here = fill[2:0] != 3'd0;"]
        lines.append(wrapped(f"wire in_memory = {self.index_in(self.memory)};"))
        lines += [
            "",
            "  // A place is chosen in one clock and used in the next; without reset, so that block",
            "  // memories can hold it.",
            "  wire bus = write_strobe_i || read_strobe_i;",
            "  assign memory_busy_o = filling_o || bus;",
            "  assign memory_stored_o = memory_store_i && !memory_busy_o;",
            "  reg [3:0] place;", "  reg store;", "  reg filled;", "  reg [15:0] choice;",
            "  always @(posedge clk_i or posedge rst_i) begin", "    if (rst_i) begin",
            "      store <= 1'b0;", "      filled <= 1'b0;", "      choice <= 16'd0;",
            "    end else begin",
            "      store <= filling_o ? filled_here : bus ? write_strobe_i && in_memory",
            "        : memory_store_i;",
            "      filled <= filling_o;", "      choice <= fill_word | {16{!memory_busy_o}};",
            "    end", "  end",
            "  wire [15:0] stored_word = filled ? choice",
            "    : (memory_data_i & choice) | (write_data_i & ~choice);",
            "  always @(posedge clk_i) begin",
            "    place <= filling_o ? fill_o : !bus ? memory_place_i",
            f"      : {self.place_of_index()};",
            "    if (store) memory[place] <= stored_word;", "  end",
            "  assign memory_word_o = memory[place];", ""]
        return "\n".join(lines + [""])

    @staticmethod
    def fill_word(stored):
        """What the memory is filled with while `fill` counts: place is fill ^ 1, without bit 3."""
        words = {}
        for register in stored:
            words.setdefault((register.place ^ 1) & 7, set()).add(register.reset)
        if 0 in words or any(len(word) > 1 for word in words.values()):
            raise ValueError("the memory's halves are not filled alike")
        resets = {}
        for at, (reset,) in words.items():
            if reset:
                resets.setdefault(reset, []).append(f"fill[2:0] == 3'd{at}")
        return " : ".join(f"{' || '.join(at)} ? 16'd{reset}"
                          for reset, at in resets.items()) + " : 16'd0"

    def counter_path(self):
        """The registers that are counters."""
        lines = ["  // The counters stand outside; any write clears those that may be written."]
        lines.append(wrapped(f"wire counted = {self.index_in(self.counters)};"))
        twists = {}
        for register in self.counters:
            twists.setdefault((register.index ^ register.counter) & 0xF, []).append(register)
        terms = [f"({self.index_in(which)} ? 4'd{twist} : 4'd0)"
                 for twist, which in twists.items() if twist]
        lines.append(wrapped("assign counter_place_o = index_i[3:0]"
                             + "".join(f" ^ {term}" for term in terms) + ";"))
        cleared = [r for r in self.counters if r.fields[0].kind == "clear"]
        lines.append(wrapped("assign counter_clear_o = write_strobe_i"
                             f" && ({self.index_in(cleared)});"))
        return "\n".join(lines + ["", ""])

    @staticmethod
    def index_in(registers):
        return " || ".join(f"index_i == 8'h{r.index:02X}" for r in registers)

    def place_of_index(self):
        """The place in memory of the register at the index."""
        plain = [r for r in self.memory if r.place == r.index & 0xF]
        moved = [r for r in self.memory if r.place != r.index & 0xF]
        for guard in range(8):
            if all(r.index >> guard & 1 for r in plain) and not any(r.index >> guard & 1
                                                                    for r in moved):
                break
        else:
            raise ValueError("no bit of the index determines how a place in memory is formed")
        bits = []
        for bit in reversed(range(4)):
            wanted = [r.place >> bit & 1 for r in moved]
            choices = {"1'b0": [0] * len(moved), "1'b1": [1] * len(moved)}
            choices.update({f"index_i[{at}]": [r.index >> at & 1 for r in moved]
                            for at in range(8)})
            bits.append(next(text for text, values in choices.items() if values == wanted))
        return f"index_i[{guard}] ? index_i[3:0] : {{{', '.join(bits)}}}"

    def hold(self):
        lines = ["  // A snapshot lasts from a block's first word until the transfer leaves it."]
        for register in self.registers:
            if not register.holds_block:
                continue
            last = max(r.index for r in self.registers if r.block == register.block)
            inside = f"index_i[7:3] == 5'h{register.index >> 3:02X}"
            assert last >> 3 == register.index >> 3 and register.index % 8 == 0
            lines += [
                "  always @(posedge clk_i or posedge rst_i) begin",
                f"    if (rst_i) {register.block}_hold_o <= 1'b0;",
                f"    else if (!reading_i) {register.block}_hold_o <= 1'b0;",
                f"    else if (read_strobe_i) {register.block}_hold_o <=",
                f"      index_i == 8'h{register.index:02X}"
                f" || ({register.block}_hold_o && {inside});",
                "  end"]
        return "\n".join(lines + [""])

    def read_path(self):
        lines = [
            "  // The low half of the 32-bit value whose high half was read last.",
            "  reg [15:0] low_word;",
            "  always @(posedge clk_i or posedge rst_i) begin",
            "    if (rst_i) low_word <= 16'd0;", "    else if (fetch) case (index_i)"]
        for register in self.registers:
            if register.pair_high:
                lines.append(
                    f"      8'h{register.index:02X}: low_word <= {register.pair}_i[15:0];")
        lines += ["      default: ;", "    endcase", "  end", ""]
        lines += self.read_words()
        lines += [
            "  always @(posedge clk_i or posedge rst_i) begin", "    if (rst_i) begin",
            "      fetch <= 1'b0;", "      read_data_o <= 16'd0;", "      index_known_o <= 1'b0;",
            "    end else begin", "      fetch <= read_strobe_i;",
            "      if (fetch) read_data_o <= word;", "      index_known_o <= known;",
            "    end", "  end", ""]
        return "\n".join(lines)

    def read_words(self):
        """The selection of a word, as words that a carry chain for each bit joins."""
        pairs = self.pair_up()
        lines = ["  // Registers are in pairs whose indices differ in one bit: one look-up table for",
                 "  // each bit chooses between the two, or takes two bits that stand alone."]
        terms = [(set(range(16)), "{16{in_memory}} & memory_word_o"),
                 (set(range(8)), "{16{counted}} & {8'd0, counter_i}")]
        alone = []
        for first, second, differs in pairs:
            common = self.bits[first].keys() & self.bits.get(second, {}).keys()
            if common:
                terms.append((common, f"{{16{{{pair_name(first, second)}}}}} & (index_i[{differs}]"
                              f" ? {self.word(second, common)} : {self.word(first, common)})"))
            alone += [(index, self.bits[index].keys() - common)
                      for index in (first, second) if index is not None]
        for shared in two_for_each_bit([item for item in alone if item[1]]):
            terms.append((set().union(*(bits for _, bits in shared)), " | ".join(
                f"{{16{{at_{index:02x}}}}} & {self.word(index, bits)}" for index, bits in shared)))
        needed = {index for index, bits in alone if bits}
        for first, second, bit in pairs:
            near = f"(index_i & 8'h{0xFF ^ 1 << bit:02X})" if second is not None else "index_i"
            lines.append(f"  wire {pair_name(first, second)} = {near} == 8'h{first:02X};")
            for index in sorted(needed & {first, second}) if second is not None else ():
                sign = "" if index >> bit & 1 else "!"
                lines.append(f"  wire at_{index:02x} = {pair_name(first, second)}"
                             f" & {sign}index_i[{bit}];")
        lines += [wrapped(f"wire [15:0] term_{n} = {text};") for n, (_, text) in enumerate(terms)]
        return lines + self.join([bits for bits, _ in terms]) + self.known(pairs)

    @staticmethod
    def join(terms):
        """The word from its terms, of which each has some bits only."""
        lines = ["  wire [15:0] word;", "`ifdef SYNTHESIS"]
        for bit in range(16):
            inputs = [f"term_{n}[{bit}]" for n, bits in enumerate(terms) if bit in bits]
            lines.append(wrapped(f"carry_or #(.WIDTH({len(inputs)})) word_{bit} (.any_o(word[{bit}]),"
                                 f" .bits_i({{{', '.join(inputs)}}}));"))
        return lines + ["`else  // the same at once, for simulators",
                        wrapped("assign word = "
                                + " | ".join(f"term_{n}" for n in range(len(terms))) + ";"),
                        "`endif"]

    def word(self, index, bits):
        """A register's word with some of its bits, others 0."""
        pieces = []  # [name or constant, highest bit, lowest bit]
        for bit in range(15, -1, -1):
            source = self.bits[index].get(bit, "0") if bit in bits else "0"
            name, _, place = source.removesuffix("]").partition("[")
            name = "0" if name == "0" else "1" if name == "1'b1" else name
            at = int(place) if place else None
            constant = name in ("0", "1")
            if pieces and pieces[-1][0] == name and (constant or pieces[-1][2] == (at or 0) + 1):
                pieces[-1][2] = at
                pieces[-1][3] += 1
            else:
                pieces.append([name, at, at, 1])
        return "{" + ", ".join(piece_text(*piece) for piece in pieces) + "}"

    def pair_up(self):
        """Pairs of indices that differ in one bit, those with most bits in common first.

        Returns (first, second, bit that differs); second is None for those left alone.
        """
        candidates = []
        for first in self.bits:
            for bit in range(8):
                second = first ^ 1 << bit
                if first < second and second in self.bits:
                    common = len(self.bits[first].keys() & self.bits[second].keys())
                    candidates.append((-common, bit, first, second))
        pairs, used = [], set()
        for _, bit, first, second in sorted(candidates):
            if not used & {first, second}:
                used |= {first, second}
                pairs.append((first, second, bit))
        return sorted(pairs + [(index, None, 0) for index in self.bits if index not in used])

    @staticmethod
    def known(pairs):
        names = ["in_memory", "counted"] + [pair_name(first, second) for first, second, _ in pairs]
        return ["", wrapped("wire known = " + " | ".join(names) + ";"), ""]

    @staticmethod
    def formal():
        return "`ifdef FORMAL\n`include \"register_file_properties.vh\"\n`endif\n"


def register_file(registers):
    """The text of register_file.v."""
    return RegisterFile(registers).text()

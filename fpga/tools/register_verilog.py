# SPDX-License-Identifier: Apache-2.0
"""Verilog-2005 from the register map: the constants and the register file."""

HEADER = """\
// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
"""

REGISTER_FILE_TEXT = """\
//
// Registers of the bridge between the I2C target and the hardware.
//
//            ___     ___     ___     ___     ___     ___     ___
// clk_i    _|   |___|   |___|   |___|   |___|   |___|   |___|   |__
// index_i  =X== index, held for at least two clocks ==============
//                  _______
// write_strobe_i _|       |_______________________________________
// committed_o    _________|^^^^^^^|_______________________________
// a port _o      =================X= new value ===================
//                  _______
// read_strobe_i  _|       |_______________________________________
// read_data_o    =================X= word, held ==================
//
// A write is compared with its limits in the first clock and stored in the second. A number outside
// its limits is moved to the nearer one; a code without a name is not stored; what is only for the
// unlocked map is not stored while it is locked.
// Ports: <register>[_<field>] with _o for what software sets, _i for what hardware tells,
// _clear_o and _set_o for pulses of one clock. Latency: 2 clocks for reads and writes.
"""


def vector(bits):
    return f"[{bits - 1}:0] " if bits > 1 else ""


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
    """Collects the parts of register_file.v while it goes through the registers."""

    def __init__(self, registers):
        self.registers = registers
        self.ports = []
        self.declarations = []
        self.resets = []
        self.stores = []
        self.wires = []
        self.words = []  # (register, expression of its 16 bits)

    def text(self):
        for register in self.registers:
            self.add_register(register)
        parts = [
            HEADER.rstrip("\n"), REGISTER_FILE_TEXT, "`default_nettype none", "",
            "module register_file (", self.port_list(), ");", "",
            self.limits(), self.write_path(), self.hold(), self.read_path(), self.formal(),
            "endmodule", "", "`default_nettype wire", "",
        ]
        return "\n".join(parts)

    # Ports and storage, register by register.

    def add_register(self, register):
        if register.pair_high or register.pair_low:
            self.add_pair(register)
        elif register.vector:
            self.add_vector(register)
        else:
            word = {}
            for field in register.fields:
                word[field.low] = self.add_field(register, field)
            self.words.append((register, self.join(register, word)))

    def add_pair(self, register):
        name = register.pair
        settable = register.fields[0].kind == "set"
        if register.pair_high:
            self.ports.append(f"input  wire [31:0] {name}_i")
            if settable:
                self.ports.append(f"output wire        {name}_set_o")
                self.ports.append(f"output wire [31:0] {name}_value_o")
            self.words.append((register, f"{name}_i[31:16]"))
            return
        owner = self.owner(register, "read")
        self.words.append((register, f"pair_owner == {owner} ? pair_word : {name}_i[15:0]"))
        if settable:
            high = f"pair_owner == {self.owner(register, 'write')} ? pair_word : {name}_i[31:16]"
            self.wires.append(f"assign {name}_set_o = {self.written(register)};")
            self.wires.append(f"assign {name}_value_o = {{{high}, value}};")

    def add_vector(self, register):
        bits = len(register.fields)
        width = vector(bits)
        self.ports.append(f"input  wire {width}{register.name}_i")
        self.ports.append(f"output wire {width}{register.name}_clear_o")
        self.wires.append(
            f"assign {register.name}_clear_o = {{{bits}{{{self.written(register)}}}}}"
            f" & value[{bits - 1}:0];")
        self.words.append((register, f"{{{16 - bits}'d0, {register.name}_i}}"))

    def add_field(self, register, field):
        """Declares ports and storage of a field; returns its value and width for reading."""
        name = register.port(field)
        if field.kind == "constant":
            return f"{field.width}'h{field.reset:X}", field.width
        if field.kind == "stored":
            return self.add_stored(register, field, name)
        bits = slice_of("value", field)
        if field.kind == "pulse":
            self.ports.append(f"output wire {vector(field.width)}{name}_o")
            self.wires.append(
                f"assign {name}_o = {repeat(self.written(register), field.width)} & {bits};")
            return None
        self.ports.append(f"input  wire {vector(field.width)}{name}_i")
        if field.kind in ("w1c", "clear"):
            condition = self.written(register)
            if field.kind == "w1c":
                condition += f" & {bits}"
            self.ports.append(f"output wire {name}_clear_o")
            self.wires.append(f"assign {name}_clear_o = {condition};")
        return f"{name}_i", field.width

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
        source = f"value[{top}:{bottom}]" if top > bottom else f"value[{top}]"
        if field.key is not None:
            source = f"value == 16'h{field.key:04X}"
        elif field.refuses:
            condition += f" && {source} <= {bits}'d{field.maximum}"
        self.stores.append(f"if ({condition}) {stored} <= {source};")
        return f"{name}_o", bits

    def join(self, register, word):
        """Concatenation of the fields of a register, gaps filled with zeros."""
        pieces, at = [], 0
        for low in sorted(word):
            if word[low] is None:
                continue
            expression, width = word[low]
            if low > at:
                pieces.append(f"{low - at}'d0")
            pieces.append(expression)
            at = low + width
        if at == 0:
            return "16'd0"
        if at < 16:
            pieces.append(f"{16 - at}'d0")
        return pieces[0] if len(pieces) == 1 else "{" + ", ".join(reversed(pieces)) + "}"

    def written(self, register):
        return f"(committed && index_i == 8'h{register.index:02X})"

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
            "input  wire write_strobe_i",
            "input  wire [15:0] write_data_i",
            "output wire committed_o",
        ]
        bus += [f"output reg  {r.block}_hold_o" for r in self.registers if r.holds_block]
        return ",\n".join("  " + port for port in bus + self.ports)

    def limits(self):
        lines = ["  // Limits of the register at the index.",
                 "  reg [15:0] lowest;", "  reg [15:0] highest;", "  reg unlock_only;",
                 "  always @* begin", "    lowest = 16'd0;", "    highest = 16'hFFFF;",
                 "    unlock_only = 1'b0;", "    case (index_i)"]
        for register in self.registers:
            field = register.fields[0]
            body = []
            if field.clamps:
                body = self.limit_lines(field)
            if register.unlock_only:
                body.append("unlock_only = 1'b1;")
            if body:
                lines.append(f"      8'h{register.index:02X}: begin  // {register.name}")
                lines += ["        " + line for line in body]
                lines.append("      end")
        return "\n".join(lines + ["      default: ;", "    endcase", "  end", ""])

    @staticmethod
    def limit_lines(field):
        lines = []
        if field.minimum_register:
            lines.append(f"lowest = {field.minimum_register}_o;")
        elif field.minimum_unlocked is not None:
            lines.append(
                f"lowest = unlock_o ? 16'd{field.minimum_unlocked} : 16'd{field.minimum};")
        elif field.minimum:
            lines.append(f"lowest = 16'd{field.minimum};")
        if field.maximum_register:
            lines.append(f"highest = {field.maximum_register}_o;")
        elif field.maximum < 0xFFFF:
            lines.append(f"highest = 16'd{field.maximum};")
        return lines

    def write_path(self):
        lines = [
            "  // First clock: compare. Second clock: store what the limits allow.",
            "  reg below;", "  reg above;", "  reg committed;",
            "  always @(posedge clk_i or posedge rst_i) begin",
            "    if (rst_i) begin", "      below <= 1'b0;", "      above <= 1'b0;",
            "      committed <= 1'b0;", "    end else begin",
            "      below <= write_data_i < lowest;", "      above <= write_data_i > highest;",
            "      committed <= write_strobe_i && index_known_o && (unlock_o || !unlock_only);",
            "    end", "  end",
            "  wire [15:0] value = below ? lowest : above ? highest : write_data_i;",
            "  assign committed_o = committed;", ""]
        lines += ["  " + line for line in self.declarations] + [
            "  always @(posedge clk_i or posedge rst_i) begin", "    if (rst_i) begin"]
        lines += ["      " + line for line in self.resets]
        lines.append("    end else begin")
        lines += ["      " + line for line in self.stores] + ["    end", "  end", ""]
        lines += ["  " + line for line in self.wires]
        return "\n".join(lines + [""])

    def owner(self, register, access):
        """Number that says for what the kept half of a 32-bit value is meant; 0 is nobody."""
        owners = []
        for other in self.registers:
            if other.pair_high:
                owners.append((other.pair, "read"))
                if other.writable:
                    owners.append((other.pair, "write"))
        return f"2'd{owners.index((register.pair, access)) + 1}"

    def hold(self):
        lines = ["  // A snapshot lasts from the first word of a block until the transfer leaves it."]
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

    def pair_lines(self):
        reads, writes = [], []
        for register in self.registers:
            if register.pair_high:
                reads.append(
                    f"        8'h{register.index:02X}: begin pair_word <= {register.pair}_i[15:0];"
                    f" pair_owner <= {self.owner(register, 'read')}; end")
                if register.writable:
                    writes.append(
                        f"      if {self.written(register)} begin pair_word <= value;"
                        f" pair_owner <= {self.owner(register, 'write')}; end")
            if register.pair_low:
                reads.append(
                    f"        8'h{register.index:02X}: pair_owner <= 2'd0;")
                if register.writable:
                    writes.append(f"      if {self.written(register)} pair_owner <= 2'd0;")
        return reads, writes

    def read_path(self):
        reads, writes = self.pair_lines()
        lines = [
            "  // Half of a 32-bit value, and whose half it is.",
            "  reg [15:0] pair_word;", "  reg [1:0] pair_owner;", "  reg fetch;",
            "  always @(posedge clk_i or posedge rst_i) begin", "    if (rst_i) begin",
            "      pair_word <= 16'd0;", "      pair_owner <= 2'd0;", "    end else begin",
            "      if (fetch) case (index_i)", *reads, "        default: ;", "      endcase",
            *writes, "    end", "  end", "",
            "  reg [15:0] word;", "  reg known;", "  always @* begin",
            "    known = 1'b1;", "    case (index_i)"]
        for register, expression in self.words:
            lines.append(f"      8'h{register.index:02X}: word = {expression};  // {register.name}")
        lines += [
            "      default: begin", "        word = 16'd0;", "        known = 1'b0;", "      end",
            "    endcase", "  end", "",
            "  always @(posedge clk_i or posedge rst_i) begin", "    if (rst_i) begin",
            "      fetch <= 1'b0;", "      read_data_o <= 16'd0;", "      index_known_o <= 1'b0;",
            "    end else begin", "      fetch <= read_strobe_i;",
            "      if (fetch) read_data_o <= word;", "      index_known_o <= known;",
            "    end", "  end", ""]
        return "\n".join(lines)

    @staticmethod
    def formal():
        return "`ifdef FORMAL\n`include \"register_file_properties.vh\"\n`endif\n"


def slice_of(name, field):
    if field.width == 1:
        return f"{name}[{field.low}]"
    return f"{name}[{field.low + field.width - 1}:{field.low}]"


def repeat(expression, width):
    return expression if width == 1 else f"{{{width}{{{expression}}}}}"


def register_file(registers):
    """The text of register_file.v."""
    return RegisterFile(registers).text()

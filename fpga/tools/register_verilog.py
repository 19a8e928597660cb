# SPDX-License-Identifier: Apache-2.0
"""Generates Verilog-2005 from the register map: the constants, the register file and its instance."""

import textwrap

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
"""

BUS = (("input  wire", 1, "clk_i"), ("input  wire", 1, "rst_i"), ("input  wire", 8, "index_i"),
       ("output reg ", 1, "index_known_o"), ("input  wire", 1, "reading_i"),
       ("input  wire", 1, "read_strobe_i"), ("output reg ", 16, "read_data_o"),
       ("output reg ", 1, "write_allowed_o"), ("input  wire", 1, "write_strobe_i"),
       ("input  wire", 16, "write_data_i"))

LIMITS = """\
  // Comparisons with constants: bit by bit they take fewer cells than a carry chain.
  function at_least(input [15:0] word, input [15:0] limit);
    integer n;
    begin
      at_least = 1'b1;
      for (n = 0; n < 16; n = n + 1)
        at_least = limit[n] ? at_least && word[n] : at_least || word[n];
    end
  endfunction
"""

READ_END = """\
  always @(posedge clk_i or posedge rst_i) begin
    if (rst_i) begin
      write_allowed_o <= 1'b0;
      index_known_o <= 1'b0;
      fetch <= 1'b0;
      read_data_o <= 16'd0;
    end else begin
      write_allowed_o <= allowed;
      index_known_o <= known;
      fetch <= read_strobe_i;
      if (fetch) read_data_o <= word;
    end
  end

`ifdef FORMAL
`include "register_file_properties.vh"
`endif

endmodule

`default_nettype wire
"""


def vector(bits):
    return f"[{bits - 1}:0] " if bits > 1 else ""


def wrapped(statement, indent=2):
    return "\n".join(textwrap.wrap(statement, 100, initial_indent=" " * indent,
                                   subsequent_indent=" " * (indent + 2)))


def slice_of(name, field, low=None, bits=None):
    """The bits of a word that belong to a field."""
    low = field.low if low is None else low
    high = low + (field.width if bits is None else bits) - 1
    return f"{name}[{high}:{low}]" if high > low else f"{name}[{low}]"


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


def fields_of(register):
    """The fields as ports: those of a vector are one."""
    if not register.vector:
        return register.fields
    first = register.fields[0]
    return [type(first)(**{**vars(first), "name": "value", "width": len(register.fields)})]


def ports(registers):
    """(direction, bits, name) of each register's ports."""
    found = [("output reg ", 1, f"{r.block}_hold_o") for r in registers if r.holds_block]
    for register in registers:
        if register.pair_high:
            found.append(("input  wire", 32, f"{register.pair}_i"))
        if register.pair_high or register.pair_low:
            continue
        for field in fields_of(register):
            name = register.port(field)
            if field.kind == "stored":
                found.append(("output reg ", field.bits, f"{name}_o"))
            elif field.kind == "pulse":
                found.append(("output wire", field.width, f"{name}_o"))
            elif field.kind != "constant":
                found.append(("input  wire", field.width, f"{name}_i"))
            if field.kind in ("w1c", "clear"):
                bits = field.width if field.kind == "w1c" else 1
                found.append(("output wire", bits, f"{name}_clear_o"))
    return found


def conditions(register):
    """What must be true for a write."""
    terms = ["unlock_o"] if register.unlock_only else []
    for field in register.fields:
        if field.has_gaps:
            terms.append(f"{slice_of('write_data_i', field)} <= {field.width}'d{field.maximum}")
    field = register.fields[0]
    if field.is_number:
        if field.minimum:
            at_least = f"at_least(write_data_i, 16'd{field.minimum})"
            terms.append(f"(unlock_o || {at_least})" if field.minimum_unlocked == 0 else at_least)
        if field.maximum < 0xFFFF:
            terms.append(f"!at_least(write_data_i, 16'd{field.maximum + 1})")
    return " && ".join(terms) or "1'b1"


def stores(register):
    """The assignments of a write, and those of a reset."""
    written, reset = [], []
    for field in register.fields:
        if field.kind != "stored":
            continue
        name = f"{register.port(field)}_o"
        low = field.zero_low_bits
        source = slice_of("write_data_i", field, field.low + low, field.bits - low)
        if low:
            source = f"{{{source}, {low}'d0}}"
        if field.key is not None:
            source = f"write_data_i == 16'h{field.key:04X}"
        written.append(f"{name} <= {source};")
        reset.append(f"{name} <= {field.bits}'d{field.reset};")
    return written, reset


def actions(register):
    """The pulses that a write makes."""
    lines, at = [], f"write_strobe_i && index_i == 8'h{register.index:02X}"
    for field in fields_of(register):
        name = register.port(field)
        if field.kind == "clear":
            lines.append(f"assign {name}_clear_o = {at};")
        elif field.kind in ("pulse", "w1c"):
            suffix = "_o" if field.kind == "pulse" else "_clear_o"
            lines.append(f"assign {name}{suffix} = {slice_of('write_data_i', field)}"
                         f" & {{{field.width}{{{at}}}}};")
    return lines


def word(register):
    """What a register reads."""
    if register.pair_high:
        return f"{register.pair}_i[31:16]"
    if register.pair_low:
        return "low_word"
    pieces, at = [], 0
    for field in sorted(fields_of(register), key=lambda f: f.low):
        if field.kind == "pulse":
            continue
        bits = field.bits if field.kind == "stored" else field.width
        if field.low > at:
            pieces.append(f"{field.low - at}'d0")
        suffix = "_o" if field.kind == "stored" else "_i"
        pieces.append(f"{bits}'d{field.reset}" if field.kind == "constant"
                      else register.port(field) + suffix)
        at = field.low + bits
    if at < 16:
        pieces.append(f"{16 - at}'d0")
    return "{" + ", ".join(reversed(pieces)) + "}" if len(pieces) > 1 else pieces[0]


def hold(register, registers):
    """The snapshot of a block: from its first word until the transfer leaves it."""
    last = max(r.index for r in registers if r.block == register.block)
    assert last >> 3 == register.index >> 3 and register.index % 8 == 0
    return [
        "  always @(posedge clk_i or posedge rst_i) begin",
        f"    if (rst_i) {register.block}_hold_o <= 1'b0;",
        f"    else if (!reading_i) {register.block}_hold_o <= 1'b0;",
        f"    else if (read_strobe_i) {register.block}_hold_o <= index_i == 8'h{register.index:02X}"
        f" ||\n      ({register.block}_hold_o && index_i[7:3] == 5'h{register.index >> 3:02X});",
        "  end"]


def register_file(registers):
    """The text of register_file.v."""
    port_list = ",\n".join(f"  {direction} {vector(bits)}{name}"
                           for direction, bits, name in [*BUS, *ports(registers)])
    lines = [HEADER.rstrip("\n"), REGISTER_FILE_TEXT, "`default_nettype none", "",
             "module register_file (", port_list, ");", "", LIMITS,
             "  // What may be written to the register at the index.", "  reg allowed;",
             "  always @* case (index_i)"]
    lines += [wrapped(f"8'h{r.index:02X}: allowed = {conditions(r)};", 4)
              for r in registers if r.writable]
    lines += ["    default: allowed = 1'b0;", "  endcase", "",
              "  always @(posedge clk_i or posedge rst_i) begin", "    if (rst_i) begin"]
    lines += [f"      {line}" for r in registers for line in stores(r)[1]]
    lines += ["    end else if (write_strobe_i) case (index_i)"]
    for register in registers:
        written = stores(register)[0]
        if len(written) == 1:
            lines.append(f"      8'h{register.index:02X}: {written[0]}")
        elif written:
            lines += [f"      8'h{register.index:02X}: begin",
                      *(f"        {line}" for line in written), "      end"]
    lines += ["      default: ;", "    endcase", "  end", ""]
    lines += [wrapped(line) for r in registers for line in actions(r)]
    lines += ["", "  // A snapshot lasts from a block's first word until the transfer leaves it."]
    for register in registers:
        lines += hold(register, registers) if register.holds_block else []
    lines += ["", "  // The low half of the 32-bit value whose high half was read last.",
              "  reg fetch;", "  reg [15:0] low_word;",
              "  always @(posedge clk_i or posedge rst_i) begin",
              "    if (rst_i) low_word <= 16'd0;", "    else if (fetch) case (index_i)"]
    lines += [f"      8'h{r.index:02X}: low_word <= {r.pair}_i[15:0];"
              for r in registers if r.pair_high]
    lines += ["      default: ;", "    endcase", "  end", "", "  reg known;", "  reg [15:0] word;",
              "  always @* begin", "    known = 1'b1;", "    case (index_i)"]
    lines += [wrapped(f"8'h{r.index:02X}: word = {word(r)};", 6) for r in registers]
    lines += ["      default: begin", "        known = 1'b0;", "        word = 16'd0;", "      end",
              "    endcase", "  end", "", READ_END]
    return "\n".join(lines)


def instance(registers):
    """The text of register_file_instance.vh: a wire for each port of a register, and the instance."""
    lines = [HEADER.rstrip("\n"),
             "// The register file in bridge_core, and a wire for each port of a register, named as the",
             "// port without _i or _o."]
    own = ports(registers)
    lines += [f"  wire {vector(bits)}{name[:-2]};" for _, bits, name in own]
    lines += ["  register_file registers ("]
    lines += [f"    .{name}({'soft_rst' if name == 'rst_i' else name if name == 'clk_i' else name[:-2]}),"
              for _, _, name in [*BUS, *own]]
    lines[-1] = lines[-1].rstrip(",")
    return "\n".join([*lines, "  );", ""])

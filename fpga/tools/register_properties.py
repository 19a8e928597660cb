# SPDX-License-Identifier: Apache-2.0
"""Generates properties of the register file from the register map.

They are written differently from the register file: plain choices and comparisons, for one
register at an index `f_any` chosen by the solver.
"""

from register_text import kind_mask, stored_mask
from register_verilog import HEADER

PROPERTIES = """\
// What the register file promises; included in it for the proof.

  // One register for all: the solver chooses its index.
  (* anyconst *) wire [7:0] f_any;

  reg f_begun = 1'b0;
  reg f_running;             // no reset now and none at the edge before
  reg f_allowed, f_unlocked, f_reading, f_fetch;
  reg [2:0] f_writes;        // write strobes at the last edges
  reg [2:0] f_reads;
  reg [1:0] f_steady;        // edges that index and data have not changed for
  reg [15:0] f_data;
  reg [15:0] f_word_before, f_reference_before, f_read_before, f_low_before;
  reg [31:0] f_pair_before;
  reg [{blocks}:0] f_hold_before;
  wire [{blocks}:0] f_hold = {{{holds}}};

  // What i2c_target promises and is proved there.
  always @(posedge clk_i) begin
    if (!f_begun) assume (rst_i);
    if (write_strobe_i) begin
      assume (f_allowed && f_steady == 2'd2 && index_i == f_index && write_data_i == f_data);
    end
    if (write_strobe_i || read_strobe_i) begin
      assume (!(write_strobe_i && read_strobe_i));
      assume (f_writes[1:0] == 2'd0 && f_reads[1:0] == 2'd0);
    end
    if (read_strobe_i) assume (reading_i);
    if (f_writes[1:0] != 2'd0 || f_reads[1:0] != 2'd0) assume (index_i == f_index);
    if (f_writes[1:0] != 2'd0) assume (write_data_i == f_data);
    f_begun <= 1'b1;
    f_running <= !rst_i;
    f_allowed <= write_allowed_o;
    f_unlocked <= unlock_o;
    f_reading <= reading_i;
    f_fetch <= fetch && !rst_i;
    f_writes <= rst_i ? 3'd0 : {{f_writes[1:0], write_strobe_i}};
    f_reads <= rst_i ? 3'd0 : {{f_reads[1:0], read_strobe_i}};
    f_steady <= rst_i || index_i != f_index || write_data_i != f_data ? 2'd0
      : f_steady == 2'd2 ? 2'd2 : f_steady + 2'd1;
    f_index <= index_i;
    f_data <= write_data_i;
    f_word_before <= f_word;
    f_reference_before <= f_reference;
    f_read_before <= read_data_o;
    f_low_before <= low_word;
    f_pair_before <= f_pair;
    f_hold_before <= f_hold;
    f_allowed_due <= f_allow;
    f_known_due <= f_known;
  end

  // It was written at the last edge.
  wire f_hit = f_writes[0] && f_index == f_any;
  always @(posedge clk_i) if (f_begun && f_running && !rst_i) begin
    // What is stored.
    a_written: assert (!f_hit || f_word == (f_data & f_stored));
    a_kept: assert (f_hit || f_word == f_word_before);
    a_locked: assert (!f_needs_unlock || f_unlocked || f_word == f_word_before);
    a_unlock: assert (unlock_o
      == (f_writes[0] && f_index == 8'h{unlock:02X} ? f_data == 16'h{key:04X} : f_unlocked));
    a_range: assert (f_word >= f_lowest && f_word <= f_highest);
    a_codes: assert (f_codes_named);

    // What a write does at once.
    a_pulses: assert (f_pulses
      == (write_strobe_i && index_i == f_any ? write_data_i & f_pulse_mask : 16'd0));
    a_clears: assert (f_clear == (write_strobe_i && index_i == f_any && f_clearable));
    a_read_only_refused: assert (!write_allowed_o || f_index != f_any || f_writable);
    a_allowed: assert (write_allowed_o == f_allowed_due);
    a_known: assert (index_known_o == f_known_due);

    // What is read, and that a moment later it is still the same.
    a_read: assert (!(f_fetch && f_index == f_any) || read_data_o == f_reference_before);
    a_read_stays: assert (f_fetch || read_data_o == f_read_before);
    a_fetch: assert (fetch == f_reads[0]);
    a_pair_of_one_moment: assert (!(f_fetch && f_index == f_any && f_is_high)
      || {{read_data_o, low_word}} == f_pair_before);
    a_low_word_stays: assert ((f_fetch && ({highs})) || low_word == f_low_before);

    // Snapshots.
    a_hold_begins: assert (!f_reads[0] || !f_reading || (f_hold & f_first) == f_first);
    a_hold_ends: assert (f_reading || f_hold == {blocks_}'d0);
    a_hold_leaves: assert (!f_reads[0] || (f_hold & ~f_inside) == {blocks_}'d0);
    a_hold_stays: assert (!f_reads[0] || !f_reading
      || (f_hold_before & f_inside & ~f_hold) == {blocks_}'d0);
    a_hold_lasts: assert (!f_reading || f_reads[0] || f_hold == f_hold_before);
    a_hold_from_the_first:
      assert ((f_hold & ~f_hold_before) == {blocks_}'d0
        || (f_reads[0] && (f_hold & ~f_hold_before & ~f_first) == {blocks_}'d0));
    c_written: cover (f_hit && f_writable);
    c_read_pair: cover (f_fetch && f_is_high);
    c_hold: cover (f_hold != {blocks_}'d0);
  end
  always @(posedge clk_i) if (f_begun && rst_i) begin
    a_reset: assert (f_word == f_reset && !unlock_o && f_hold == {blocks_}'d0);
  end
"""


def concatenation(register, kinds, suffix):
    """The word whose fields of some kinds read their ports, others 0."""
    pieces, at = [], 0
    for field in sorted(register.fields, key=lambda f: f.low):
        if field.kind not in kinds:
            continue
        if field.low > at:
            pieces.append(f"{field.low - at}'d0")
        port = register.port(field) + suffix
        width = field.bits
        if register.vector:
            port = f"{register.name}{suffix}[{field.low}]"
        if field.kind == "constant":
            port = f"{width}'d{field.reset}"
        pieces.append(port)
        at = field.low + width
    if not pieces:
        return "16'd0"
    if at < 16:
        pieces.append(f"{16 - at}'d0")
    return "{" + ", ".join(reversed(pieces)) + "}"


def reference(register):
    """What a register reads."""
    if register.pair_high:
        return f"{register.pair}_i[31:16]"
    if register.pair_low:
        return "low_word"
    parts = []
    for kinds, suffix in (
            ({"stored"}, "_o"), ({"input", "w1c", "clear"}, "_i"), ({"constant"}, "")):
        if any(f.kind in kinds for f in register.fields):
            parts.append(concatenation(register, kinds, suffix))
    return " | ".join(parts) or "16'd0"


def choice(name, bits, selector, entries, default):
    """A wire selected by an index; not a case, which could become a memory with free contents."""
    size = f"[{bits - 1}:0] " if bits > 1 else ""
    terms = [f"{selector} == 8'h{index:02X} ? {value}"
             for index, value in entries if value != default]
    return [f"  wire {size}{name} =", *(f"    {term} :" for term in terms), f"    {default};"]


def is_key(register):
    return register.fields[0].key is not None


def allowed(register):
    """The plain condition for a write to be accepted."""
    terms = ["unlock_o"] if register.unlock_only else []
    field = register.fields[0]
    if field.is_number:
        terms += ["write_data_i >= f_floor", "write_data_i <= f_ceiling"]
    for part in register.fields:
        if part.has_gaps:
            top = part.low + part.width - 1
            terms.append(f"write_data_i[{top}:{part.low}] <= {part.maximum}")
    return " && ".join(terms) or "1'b1"


# Contents of the tables: functions of a register.

def number(register):
    return register.fields[0].is_number


def floor(register):
    field = register.fields[0]
    if field.minimum_unlocked is None:
        return f"16'd{field.minimum}"
    return f"(unlock_o ? 16'd{field.minimum_unlocked} : 16'd{field.minimum})"


def lowest(register):
    field = register.fields[0]
    return f"16'd{field.minimum if field.minimum_unlocked is None else field.minimum_unlocked}"


def codes(register):
    terms = [f"{register.port(f)}_o <= {f.maximum}" for f in register.fields if f.has_gaps]
    return " && ".join(terms) or "1'b1"


def highest(register):
    return f"16'd{register.fields[0].maximum}"


def pulse_mask(register):
    return f"16'h{kind_mask(register, 'pulse') | kind_mask(register, 'w1c'):04X}"


def pulses(register):
    both = [(kinds, suffix) for kinds, suffix in (({"pulse"}, "_o"), ({"w1c"}, "_clear_o"))
            if any(f.kind in kinds for f in register.fields)]
    return " | ".join(concatenation(register, k, s) for k, s in both) or "16'd0"


def clear(register):
    return f"{register.port(register.fields[0])}_clear_o"


def is_clear(register):
    return register.fields[0].kind == "clear"


def pair(register):
    return f"{register.pair}_i"


def is_high(register):
    return register.pair_high


def yes(_):
    return "1'b1"


def stores(register):
    return stored_mask(register) != 0


def stored(register):
    return concatenation(register, {"stored"}, "_o")


def mask(register):
    return f"16'h{stored_mask(register):04X}"


def reset(register):
    return f"16'h{register.reset & stored_mask(register):04X}"


def choices(registers):
    """All tables over the index."""
    def table(make, wanted=lambda r: True):
        return [(r.index, make(r)) for r in registers if wanted(r)]

    return (
        choice("f_word", 16, "f_any", table(stored, stores), "16'd0")
        + choice("f_stored", 16, "f_any", table(mask, stores), "16'd0")
        + choice("f_reset", 16, "f_any", table(reset, stores), "16'd0")
        + choice("f_lowest", 16, "f_any", table(lowest, number), "16'd0")
        + choice("f_highest", 16, "f_any", table(highest, number), "16'hFFFF")
        + choice("f_codes_named", 1, "f_any", table(codes), "1'b1")
        + choice("f_needs_unlock", 1, "f_any", table(yes, lambda r: r.unlock_only), "1'b0")
        + choice("f_writable", 1, "f_any", table(yes, lambda r: r.writable), "1'b0")
        + choice("f_pulses", 16, "f_any", table(pulses), "16'd0")
        + choice("f_pulse_mask", 16, "f_any", table(pulse_mask), "16'h0000")
        + choice("f_clear", 1, "f_any", table(clear, is_clear), "1'b0")
        + choice("f_clearable", 1, "f_any", table(yes, is_clear), "1'b0")
        + choice("f_reference", 16, "f_any", table(reference), "16'd0")
        + choice("f_pair", 32, "f_any", table(pair, is_high), "32'd0")
        + choice("f_is_high", 1, "f_any", table(yes, is_high), "1'b0")
        + choice("f_floor", 16, "index_i", table(floor, number), "16'd0")
        + choice("f_ceiling", 16, "index_i", table(highest, number), "16'hFFFF")
        + choice("f_allow", 1, "index_i", table(allowed, lambda r: r.writable), "1'b0")
        + choice("f_known", 1, "index_i", table(yes), "1'b0")
        + ["  reg f_allowed_due, f_known_due;"])


def block_choices(registers):
    """The snapshot that the last index begins, and the one it is inside: one bit per block."""
    firsts = [r for r in registers if r.holds_block]
    inside = [(other.index, n) for n, r in enumerate(firsts)
              for other in registers if other.block == r.block]
    lines = []
    for name, table in (("f_first", [(r.index, n) for n, r in enumerate(firsts)]),
                        ("f_inside", sorted(inside))):
        entries = [(index, f"{len(firsts)}'d{1 << n}") for index, n in table]
        lines += choice(name, len(firsts), "f_index", entries, f"{len(firsts)}'d0")
    return lines


def properties(registers):
    """The text of register_file_properties.vh."""
    firsts = [r for r in registers if r.holds_block]
    key = next(r for r in registers if is_key(r))
    highs = [f"f_index == 8'h{r.index:02X}" for r in registers if r.pair_high]
    text = PROPERTIES.format(
        blocks=len(firsts) - 1, blocks_=len(firsts), unlock=key.index, key=key.fields[0].key,
        holds=", ".join(f"{r.block}_hold_o" for r in reversed(firsts)), highs=" || ".join(highs))
    head, tail = text.split("  reg f_begun", 1)
    return "\n".join([HEADER.rstrip("\n"), head.rstrip("\n"), "  reg [7:0] f_index;",
                      *choices(registers), *block_choices(registers), "  reg f_begun" + tail])

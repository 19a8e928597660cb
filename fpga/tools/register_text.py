# SPDX-License-Identifier: Apache-2.0
"""Generates C header, documentation table and test vectors from the register map."""

import json
import textwrap

C_HEADER = """\
// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
/// Registers of the FPGA bridge: 16-bit words behind an 8-bit index on I2C.
#ifndef VERGENCE_BRIDGE_REGISTERS_H
#define VERGENCE_BRIDGE_REGISTERS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// 7-bit address of the bridge.
enum { BRIDGE_I2C_ADDRESS = 0x2C };

/// What a register can do; the flags of `struct bridge_register`.
enum {
    BRIDGE_READ = 1 << 0,         ///< may read another value than 0
    BRIDGE_WRITE = 1 << 1,        ///< a write may be acknowledged
    BRIDGE_UNLOCK_ONLY = 1 << 2,  ///< writes are refused while the map is locked
    BRIDGE_VOLATILE = 1 << 3,     ///< hardware changes it
    BRIDGE_SIGNED = 1 << 4,       ///< two's complement
    BRIDGE_PAIR_HIGH = 1 << 5,    ///< reading it latches the low word
    BRIDGE_PAIR_LOW = 1 << 6,     ///< reads the latched word
    BRIDGE_HOLDS_BLOCK = 1 << 7   ///< reading on from here latches the block
};

/// One register. A write outside `min`..`max`, or with an undefined code, is not acknowledged
/// and changes nothing.
struct bridge_register {
    uint8_t index;
    uint8_t flags;
    uint16_t reset;
    uint16_t reset_mask;   ///< bits whose value after reset does not depend on the hardware
    uint16_t stored_mask;  ///< bits that read back what was written
    uint16_t clear_mask;   ///< bits that writing 1 clears
    uint16_t pulse_mask;   ///< bits that start an action when written as 1 and read 0
    uint16_t min;
    uint16_t max;
};
"""

C_FOOTER = """
#ifdef __cplusplus
}
#endif

#endif
"""


def stored_mask(register):
    """Bits that read back what was written."""
    mask = 0
    for field in register.fields:
        if field.kind == "stored" and field.key is None:
            ones = (1 << field.bits) - 1 >> field.zero_low_bits << field.zero_low_bits
            mask |= ones << field.low
    return mask


def kind_mask(register, kind):
    return sum(f.mask for f in register.fields if f.kind == kind)


def limits(register):
    """Lowest and highest word that is ever accepted, apart from codes."""
    field = register.fields[0]
    if not field.is_number:
        return 0, 0xFFFF
    lowest = field.minimum if field.minimum_unlocked is None else field.minimum_unlocked
    return lowest, field.maximum


def flags(register):
    kinds = {f.kind for f in register.fields}
    named = {
        "READ": register.readable,
        "WRITE": register.writable,
        "UNLOCK_ONLY": register.unlock_only,
        "VOLATILE": bool(kinds & {"input", "w1c", "clear"}),
        "SIGNED": any(f.signed for f in register.fields),
        "PAIR_HIGH": register.pair_high,
        "PAIR_LOW": register.pair_low,
        "HOLDS_BLOCK": register.holds_block,
    }
    return [name for name, present in named.items() if present]


def c_fields(register):
    """Enumerators for masks, shifts and codes of a register."""
    lines = []
    for field in register.fields:
        name = f"BRIDGE_{register.port(field).upper()}"
        if not field.whole:
            lines.append(f"    {name}_MASK = 0x{field.mask:04X},")
            lines.append(f"    {name}_SHIFT = {field.low},")
        if field.key is not None:
            lines.append(f"    {name}_KEY = 0x{field.key:04X},")
        lines += [f"    {name}_IS_{code.upper()} = {value}," for code, value, _ in field.codes]
    return lines


def c_header(registers):
    """The text of bridge_registers.h."""
    lines = [C_HEADER, "/// Indices.", "enum {"]
    lines += [f"    BRIDGE_{r.name.upper()} = 0x{r.index:02X}," for r in registers]
    lines[-1] = lines[-1].rstrip(",")
    lines += ["};", "", "/// Fields of registers that have several, and codes.", "enum {"]
    for register in registers:
        lines += c_fields(register)
    lines[-1] = lines[-1].rstrip(",")
    lines += ["};", "", f"enum {{ BRIDGE_REGISTER_COUNT = {len(registers)} }};", "",
              "/// All registers in order of their index.",
              "static const struct bridge_register bridge_registers[BRIDGE_REGISTER_COUNT] = {"]
    for register in registers:
        lowest, highest = limits(register)
        masks = [
            register.reset, register.known_at_reset, stored_mask(register),
            kind_mask(register, "w1c"), kind_mask(register, "pulse")]
        members = [f"0x{register.index:02X}",
                   " | ".join(f"BRIDGE_{name}" for name in flags(register)),
                   *(f"0x{mask:04X}" for mask in masks), str(lowest), str(highest)]
        lines += [f"    // {register.name}", initializer(members)]
    lines[-1] = lines[-1].rstrip(",") + "};"
    return "\n".join(lines) + C_FOOTER


NAMES_HEADER = """\
// SPDX-License-Identifier: Apache-2.0
// Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit.
/// Names of the bridge's registers, for people.
#ifndef VERGENCE_BRIDGE_REGISTER_NAMES_H
#define VERGENCE_BRIDGE_REGISTER_NAMES_H

#include "bridge_registers.h"

"""


def c_names(registers):
    """The text of bridge_register_names.h."""
    rows = [f'    X({r.name.upper()}, "{r.name}")' for r in registers]
    head = "// X(index without BRIDGE_, name)\n#define BRIDGE_REGISTER_NAMES(X)"
    lines = [head.split("\n")[1], *rows]
    column = max(map(len, lines)) + 1
    body = "\n".join(f"{line:<{column}}\\" for line in lines[:-1]) + "\n" + lines[-1]
    return NAMES_HEADER + head.split("\n")[0] + "\n" + body + "\n\n#endif\n"


def initializer(members):
    """One row of the table, broken where clang-format breaks it."""
    glued = [member.replace(" ", "\0") for member in members]
    text = "{" + ", ".join(glued) + "},"
    lines = textwrap.wrap(text, 100, initial_indent=" " * 4, subsequent_indent=" " * 5,
                          break_long_words=False)
    return "\n".join(lines).replace("\0", " ")


ACCESS = {
    "constant": "r", "input": "r", "stored": "rw", "pulse": "w, 1 starts", "w1c": "r, 1 clears",
    "clear": "r, any write clears",
}


def range_text(field):
    """Range and unit of a field, as text."""
    if field.codes:
        return "; ".join(f"{value} = {name}" + (f" ({text})" if text else "")
                         for name, value, text in field.codes)
    parts = []
    if field.is_number:
        lowest = str(field.minimum)
        if field.minimum_unlocked is not None:
            lowest = f"{field.minimum} ({field.minimum_unlocked} while unlocked)"
        parts.append(f"{lowest}..{field.maximum}")
    if field.key is not None:
        parts.append(f"key 0x{field.key:04X}")
    if field.unit:
        parts.append(field.unit)
    return " ".join(parts)


def documentation(registers):
    """The text of registers.md."""
    lines = [
        "<!-- SPDX-License-Identifier: Apache-2.0 -->",
        "<!-- Made by fpga/tools/registers.py from fpga/registers.rdl; do not edit. -->",
        "# Registers of the FPGA bridge", "",
        "16-bit big-endian words behind an 8-bit index at I2C address 0x2C. The index increases by",
        "one with each word and survives STOP. A word is stored with its second byte; a word that",
        "a register does not accept (outside its range, undefined code, locked, read only)",
        "is not acknowledged and changes nothing. Bits that are not listed read 0.", "",
        "| index | register | bits | access | reset | range, unit | meaning |",
        "|---|---|---|---|---|---|---|"]
    for register in registers:
        for number, field in enumerate(register.fields):
            high = field.low + field.width - 1
            bits = f"{high}:{field.low}" if field.width > 1 else str(field.low)
            name = f"**{register.name.upper()}**" if number == 0 else ""
            if not field.whole:
                name = f"{name} {field.name}".strip()
            access = ACCESS[field.kind] + (", unlocked" if register.unlock_only else "")
            reset = f"0x{field.reset:X}" if field.width > 3 else str(field.reset)
            reset = "" if field.kind == "pulse" else reset
            texts = [register.title, field.text] if number == 0 else [field.text]
            text = ". ".join(text for text in texts if text)
            lines.append(
                f"| {f'{register.index:02X}' if number == 0 else ''} | {name} | {bits} | {access}"
                f" | {reset} | {range_text(field)} | {text} |")
    return "\n".join(lines) + "\n"


def accepts(register, value, unlocked):
    """Whether `value` is stored."""
    if not register.writable or (register.unlock_only and not unlocked):
        return False
    field = register.fields[0]
    if field.is_number:
        lowest = field.minimum
        if unlocked and field.minimum_unlocked is not None:
            lowest = field.minimum_unlocked
        if not lowest <= value <= field.maximum:
            return False
    return all(
        (value >> f.low & (1 << f.width) - 1) <= f.maximum for f in register.fields if f.has_gaps)


def values_to_write(register):
    """Words to test: patterns, both sides of each limit, each code."""
    values = {0x0000, 0xFFFF, 0x5555, 0xAAAA, register.reset}
    field = register.fields[0]
    edges = set()
    if field.is_number:
        edges |= {field.minimum, field.maximum}
        step = 1 << field.zero_low_bits
        values |= {edge + offset for edge in edges for offset in (-step, -1, 0, 1, step)}
    if field.key is not None:
        values |= {field.key, field.key ^ 1, field.key ^ 0x8000}
    for other in register.fields:
        for code in range(1 << other.width) if other.codes else ():
            values.add(register.reset & ~other.mask | code << other.low)
    # No vector starts an action: a reset or a trigger has no fixed result.
    pulses = kind_mask(register, "pulse") if stored_mask(register) else 0
    return sorted({value & ~pulses for value in values if 0 <= value <= 0xFFFF})


def write_vectors(register):
    vectors = []
    mask = register.known_at_reset
    for unlocked in (False, True):
        if register.name == "unlock" and unlocked:
            continue
        for value in values_to_write(register):
            accepted = accepts(register, value, unlocked)
            reads = register.reset & mask
            if accepted:
                reads = value & stored_mask(register)
                if register.fields[0].key is not None:
                    reads = int(value == register.fields[0].key)
            vectors.append(
                {"unlocked": unlocked, "value": value, "accepted": accepted, "reads": reads})
    return vectors


def vectors(registers):
    """The text of bridge_registers.json.

    For each register: reset value, and what it reads (in the bits of `mask`) after each of some
    words is written to a bridge that was just reset; `accepted` says whether the second byte is
    acknowledged.
    """
    entries = []
    for register in registers:
        lowest, highest = limits(register)
        entries.append({
            "index": register.index,
            "name": register.name,
            "flags": flags(register),
            "reset": register.reset,
            "mask": register.known_at_reset,
            "min": lowest,
            "max": highest,
            "stored_mask": stored_mask(register),
            "clear_mask": kind_mask(register, "w1c"),
            "pulse_mask": kind_mask(register, "pulse"),
            "fields": [
                {"name": f.name, "low": f.low, "width": f.width, "kind": f.kind, "unit": f.unit}
                for f in register.fields],
            "writes": write_vectors(register),
        })
    known = {r.index for r in registers}
    lines = [json.dumps(entry) for entry in entries]
    unknown = json.dumps([index for index in range(256) if index not in known])
    return ('{"address": 44, "unknown": ' + unknown + ',\n "registers": [\n'
            + ",\n".join(lines) + "\n]}\n")

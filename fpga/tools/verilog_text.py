# SPDX-License-Identifier: Apache-2.0
"""Pieces of Verilog text: vectors, slices, comparisons with constants, wrapped statements."""

import textwrap


def vector(bits):
    return f"[{bits - 1}:0] " if bits > 1 else ""


def piece_text(name, high, low, bits):
    """A part of a concatenation: a run of constant bits, a signal, or a slice of it."""
    if name in ("0", "1"):
        value = 0 if name == "0" else (1 << bits) - 1
        return f"{bits}'d{value}"
    if high is None:
        return name
    return f"{name}[{high}]" if high == low else f"{name}[{high}:{low}]"


def two_for_each_bit(items):
    """Groups of (index, bits) in which no bit occurs more than twice."""
    groups = []
    for item in sorted(items, key=lambda item: -len(item[1])):
        best = None
        for group in groups:
            counts = {bit: sum(bit in bits for _, bits in group) for bit in item[1]}
            if max(counts.values()) < 2:
                gain = sum(count == 1 for count in counts.values())
                if best is None or gain > best[0]:
                    best = (gain, group)
        if best:
            best[1].append(item)
        else:
            groups.append([item])
    return groups


def at_least(constant):
    """Expression for write_data_i >= constant, of its bits, run by run from the lowest 1 on."""
    low = (constant & -constant).bit_length() - 1
    if constant == 1 << low:
        return f"|write_data_i[15:{low}]"
    expression = ""
    while low < 16:
        one = constant >> low & 1
        high = low
        while high < 15 and (constant >> (high + 1) & 1) == one:
            high += 1
        sign = "&" if one else "|"
        run = f"{sign}write_data_i[{high}:{low}]" if high > low else f"write_data_i[{low}]"
        inner = expression if expression.count("write") == 1 else f"({expression})"
        expression = f"{run} {sign} {inner}" if expression else run
        low = high + 1
    return expression


def wrapped(statement, indent=2):
    return "\n".join(textwrap.wrap(statement, 100, initial_indent=" " * indent,
                                   subsequent_indent=" " * (indent + 2)))


def pair_name(first, second):
    return f"at_{first:02x}" if second is None else f"at_{first:02x}_{second:02x}"


def slice_of(name, field):
    if field.width == 1:
        return f"{name}[{field.low}]"
    return f"{name}[{field.low + field.width - 1}:{field.low}]"


def repeat(expression, width):
    return f"({expression})" if width == 1 else f"{{{width}{{{expression}}}}}"

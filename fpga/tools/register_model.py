# SPDX-License-Identifier: Apache-2.0
"""Reads the register map from SystemRDL into plain objects and checks this project's rules."""

from dataclasses import dataclass, field as dataclass_field

from systemrdl import RDLCompileError, RDLCompiler
from systemrdl.node import FieldNode, RegNode
from systemrdl.rdltypes import OnWriteType

WORD_MASK = 0xFFFF


@dataclass
class Field:
    """A run of bits of a register. `kind` says what it is:

    constant  read only, fixed            stored  a register of its own
    input     read only, from hardware    pulse   one clock high for each written 1, reads 0
    w1c       input, cleared by ones      clear   input, cleared by any write
    """

    name: str
    low: int
    width: int
    kind: str
    reset: int
    text: str
    unit: str
    minimum: int
    maximum: int
    minimum_unlocked: int | None
    zero_low_bits: int
    key: int | None
    signed: bool
    codes: list  # (name, value, text) of each named value

    @property
    def mask(self):
        return ((1 << self.width) - 1) << self.low

    @property
    def bits(self):
        """Number of bits of the field's port: as many as its largest value needs."""
        if self.kind == "stored" and not self.codes:
            return max(1, self.maximum.bit_length())
        return self.width

    @property
    def whole(self):
        """Whether it is the only field, a number that is clamped and not a set of flags."""
        return self.name == "value"

    @property
    def is_number(self):
        """Whether it is a number whose whole word is compared with its limits."""
        limited = self.minimum > 0 or self.maximum < WORD_MASK
        return self.kind == "stored" and self.whole and self.width == 16 and limited

    @property
    def has_gaps(self):
        """Whether there are codes without a name."""
        narrow = self.maximum < (1 << self.width) - 1
        return self.kind == "stored" and bool(self.codes) and narrow


@dataclass
class Register:
    """One 16-bit word. `block` is the path of its register file, or empty."""

    name: str
    index: int
    title: str
    block: str
    fields: list = dataclass_field(default_factory=list)
    unlock_only: bool = False
    holds_block: bool = False
    vector: bool = False
    pair_high: bool = False
    pair_low: bool = False

    @property
    def readable(self):
        return any(f.kind != "pulse" for f in self.fields)

    @property
    def writable(self):
        return any(f.kind not in ("constant", "input") for f in self.fields)

    @property
    def reset(self):
        return sum(f.reset << f.low for f in self.fields if f.kind != "pulse")

    @property
    def known_at_reset(self):
        """Bits whose value after reset does not depend on external hardware."""
        return sum(f.mask for f in self.fields if f.kind in ("constant", "stored"))

    @property
    def pair(self):
        """Name of the 32-bit value of which this word is half."""
        return self.name.removesuffix("_high").removesuffix("_low") + "_us"

    def port(self, field):
        """Name of a field's port without its suffix."""
        return self.name if field.whole else f"{self.name}_{field.name}"


class MapError(Exception):
    """The map violates one of its own rules."""


def field_kind(node):
    """The kind of Field of a SystemRDL field."""
    hardware_writes = node.is_hw_writable
    if not node.is_sw_readable:
        return "pulse"
    if not node.is_sw_writable:
        return "input" if hardware_writes else "constant"
    if hardware_writes:
        kinds = {OnWriteType.woclr: "w1c", OnWriteType.wclr: "clear"}
        return kinds[node.get_property("onwrite")]
    return "stored"


def read_field(node):
    width = node.width
    encode = node.get_property("encode")
    codes = []
    if encode is not None:
        codes = [(m.name, m.value, m.rdl_desc or "") for m in encode]
    maximum = node.get_property("max")
    text = " ".join((node.get_property("desc") or "").split())
    return Field(
        name=node.inst_name,
        low=node.low,
        width=width,
        kind=field_kind(node),
        reset=node.get_property("reset") or 0,
        text=text,
        unit=node.get_property("unit") or "",
        minimum=node.get_property("min") or 0,
        maximum=(1 << width) - 1 if maximum is None else maximum,
        minimum_unlocked=node.get_property("min_unlocked"),
        zero_low_bits=node.get_property("zero_low_bits") or 0,
        key=node.get_property("key"),
        signed=bool(node.get_property("two_complement")),
        codes=codes,
    )


def read_register(node, root):
    path = node.get_rel_path(root)
    block = path.rpartition(".")[0]
    pair_high = bool(node.get_property("pair_high"))
    pair_low = bool(node.get_property("pair_low"))
    register = Register(
        name=path.replace(".", "_"),
        index=node.absolute_address // 2,
        title=node.get_property("name"),
        block=block,
        unlock_only=bool(node.get_property("unlock_only")),
        holds_block=bool(node.get_property("holds_block")),
        vector=bool(node.get_property("vector")),
        pair_high=pair_high,
        pair_low=pair_low,
    )
    for child in node.children():
        if isinstance(child, FieldNode):
            register.fields.append(read_field(child))
    return register


def check(registers):
    """Checks rules that SystemRDL does not know."""
    for register in registers:
        where = f"{register.name} at {register.index:02X}"
        if register.index > 0xFF:
            raise MapError(f"{where}: the index has 8 bits")
        for field in register.fields:
            what = f"{where}, field {field.name}"
            if field.whole and (field.low != 0 or len(register.fields) != 1):
                raise MapError(f"{what}: 'value' must be the only field, at bit 0")
            if field.codes and [c[1] for c in field.codes] != list(range(field.maximum + 1)):
                raise MapError(f"{what}: codes must run from 0 to max")
            bounds = field.minimum <= field.reset <= field.maximum
            if field.kind == "stored" and not bounds:
                raise MapError(f"{what}: reset value outside min..max")
            if field.zero_low_bits and field.minimum % (1 << field.zero_low_bits):
                raise MapError(f"{what}: min has low bits that are not stored")
            if field.zero_low_bits and field.reset % (1 << field.zero_low_bits):
                raise MapError(f"{what}: reset value has low bits that are not stored")
            narrow = field.maximum < (1 << field.width) - 1
            if field.kind == "stored" and narrow and not (field.is_number or field.has_gaps):
                raise MapError(f"{what}: only codes and whole words can have limits")
    for high, low in zip(registers, registers[1:]):
        if high.pair_high and not (low.pair_low and low.index == high.index + 1):
            raise MapError(f"{high.name}: the low word must follow")


def read_map(path):
    """All registers of the map at `path`, in order of their index."""
    compiler = RDLCompiler()
    try:
        compiler.compile_file(str(path))
        root = compiler.elaborate().top
    except RDLCompileError as error:
        raise MapError(f"{path} is not valid SystemRDL") from error
    registers = [read_register(node, root) for node in root.descendants()
                 if isinstance(node, RegNode)]
    registers.sort(key=lambda r: r.index)
    check(registers)
    return registers

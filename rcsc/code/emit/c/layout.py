"""How the state of a program lies in memory, and the digest that tells it from another's.

In: a program and its names. Out: the members of the C struct, its size for each way in which targets align them, and `Digest`:
what `init` stores in a state and `check` compares, in C and in Python alike, so that a state that another table made, or
another version of this one, is refused and not misread.

The alignment of a scalar is its size, or less where the target caps it: at 8 bytes on Arm, RISC-V and x86-64, 4 on i386, 2 on
MSP430 and m68k, 1 on AVR. So the same members have at most four layouts, and the size of each is known here.
"""

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate

from rcsc.code.emit.c.ctext import c_type
from rcsc.code.emit.identifiers import DIGEST, TRACE, Names, failed_type
from rcsc.lang.digest import Digests
from rcsc.lang.meaning import checked
from rcsc.lang.model import Array, Program, Record, Type, pending

CAPS = (8, 4, 2, 1)
"""The alignment, in bytes, that no type exceeds: one a family of targets."""


@dataclass(frozen=True, slots=True)
class Digest:
    """The digest that tells a program's states from those of other tables.

    Attributes:
        meaning: 16 hexadecimal digits of the tables' meaning (`Digests.whole`).
        layout: 16 of the members of the state, by name and C type.
    """

    meaning: str
    layout: str

    @property
    def state(self) -> int:
        """Both as one number of 32 bits, which each state bears."""
        return int(hashlib.sha256(f"{self.meaning} {self.layout}".encode()).hexdigest()[:8], 16)


def digest(program: Program, names: Names) -> Digest:
    """Digest a program's meaning, and the layout of its state."""
    scalars = (each for name, kind in members(program, names) for each in _flat(names, name, kind))
    layout = hashlib.sha256("\n".join(map(" ".join, scalars)).encode()).hexdigest()
    return Digest(Digests(program).whole()[:16], layout[:16])


def sizes(program: Program, names: Names) -> tuple[int, ...]:
    """Return the size of the state in bytes, under each alignment in `CAPS`."""
    return tuple(_end([_shape(kind, cap) for _, kind in members(program, names)], cap)[0] for cap in CAPS)


def record_size(record: Record) -> int:
    """Return the size of a record in bytes, where every scalar is aligned to its size."""
    return _shape(record, CAPS[0])[0]


def members(program: Program, names: Names) -> Iterator[tuple[str, Type | str]]:
    """Yield the members of the state in order: each name with its type, or its C type where no table declares it."""
    variables = {v.name: v.type for v in program.variables}
    yield DIGEST, "uint32_t"
    for variable in program.declared:
        yield names.roots[variable.name], variable.type
        later = pending(variable.name)
        if later in variables:
            yield "".join(names.paths[later]), variables[later]
    yield from ((word, "int32_t") for word in TRACE)
    yield from ((word, failed_type(len(checked(program)))) for word in names.failed)


def _flat(names: Names, path: str, kind: Type | str) -> Iterator[tuple[str, str]]:
    """Yield each scalar of a member: its path and its C type."""
    match kind:
        case str():
            yield path, kind
        case Record(name=record, fields=fields):
            for part in fields:
                yield from _flat(names, f"{path}.{names.members[record][part.name]}", part.type)
        case Array(length=length, element=element):
            yield from _flat(names, f"{path}[{length}]", element)
        case _:
            yield path, c_type(kind)


def _shape(kind: Type | str, cap: int) -> tuple[int, int]:
    """Return size and alignment of a type, in bytes."""
    match kind:
        case Record(fields=fields):
            return _end([_shape(part.type, cap) for part in fields], cap)
        case Array(length=length, element=element):
            size, alignment = _shape(element, cap)
            return length * size, alignment
        case str():
            size = scalar_size(kind)
        case _:
            size = scalar_size(c_type(kind))
    return size, min(size, cap)


def _end(shapes: list[tuple[int, int]], cap: int) -> tuple[int, int]:
    """Return size and alignment of a struct whose members have these shapes."""
    alignment = max((alignment for _, alignment in shapes), default=1)
    ends = accumulate(shapes, lambda at, shape: _aligned(at, shape[1]) + shape[0], initial=0)
    *_, end = ends
    return _aligned(end, min(alignment, cap)), alignment


def _aligned(at: int, alignment: int) -> int:
    return -(-at // alignment) * alignment


def scalar_size(name: str) -> int:
    """Return the bytes of a scalar C type that rcsc emits."""
    width = re.search(r"\d+", name)
    return int(width[0]) // 8 if width else {"bool": 1, "float": 4, "double": 8}[name]

"""Stand-ins for extern procedures, the same in C and in Python, so that admission of their results is tested.

In: a program. Out: C definitions, and Python modules that are in place while a context lasts. A stand-in
gives edges of what it writes, some outside the declared range, chosen by a hash of what it was given.
"""

import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

from rcsc.model import Procedure, Program, Real, Scalar, Value, Variable, value_of_key
from rcsc.testing.edges import leaf_edges, outside
from rcsc.testing.reference import constant
from rcsc.testing.symbols import Symbols

SEED, FACTOR, MASK = 2166136261, 16777619, 0xFFFF_FFFF
"""Source: FNV-1a, 32 bits, by words instead of bytes."""

MOST_RESULTS = 24


def externs(program: Program) -> tuple[Procedure, ...]:
    """The program's extern procedures."""
    return tuple(procedure for procedure in program.procedures if procedure.extern is not None)


def results(program: Program, variable: Variable) -> tuple[Value, ...]:
    """What a stand-in may give for a leaf: edges, and for every fourth choice a reading outside the range."""
    inside = [value_of_key(variable.type, key) for key in leaf_edges(program)[variable.name]][:MOST_RESULTS]
    strange = outside(variable.type)[: max(1, len(inside) // 4)]
    return (*inside, *strange)


def word(kind: Scalar, value: Value) -> int:
    """What is hashed of a value: 32 bits."""
    if isinstance(kind, Real):
        bits: int = struct.unpack("<Q", struct.pack("<d", float(value)))[0]
        return (bits ^ bits >> 32) & MASK
    return int(value) & MASK


def chosen(words: list[int], salt: int, count: int) -> int:
    """Which result is given."""
    state = SEED ^ salt
    for one in words:
        state = ((state ^ one) * FACTOR) & MASK
    return (state >> 8) % count


def given_kinds(program: Program, procedure: Procedure) -> list[Scalar]:
    """Types of what an extern is called with: what it reads, then its parameters."""
    return [program.variable(name).type for name in procedure.reads] + [p.type for p in procedure.params]


def python_function(program: Program, procedure: Procedure) -> object:
    """The stand-in in Python."""
    kinds = given_kinds(program, procedure)
    choices = [results(program, program.variable(name)) for name in procedure.writes]

    def stand_in(*args: Value) -> tuple[Value, ...]:
        words = [word(kind, arg) for kind, arg in zip(kinds, args, strict=True)]
        return tuple(values[chosen(words, salt, len(values))] for salt, values in enumerate(choices))

    return stand_in


@contextmanager
def python_stand_ins(program: Program) -> Iterator[None]:
    """Puts the stand-ins where the program's Python functions are looked for, and takes them away again."""
    before = dict(sys.modules)
    for procedure in externs(program):
        module_name, _, function = (
            procedure.extern.python.partition(":") if procedure.extern else ("", "", "")
        )
        parts = module_name.split(".")
        for at in range(1, len(parts) + 1):
            name = ".".join(parts[:at])
            if not getattr(sys.modules.get(name), "rcsc_stand_in", False):
                sys.modules[name] = ModuleType(name)
                sys.modules[name].rcsc_stand_in = True  # type: ignore[attr-defined]  # a mark of ours
                if at > 1:
                    setattr(sys.modules[".".join(parts[: at - 1])], parts[at - 1], sys.modules[name])
        setattr(sys.modules[module_name], function, python_function(program, procedure))
    try:
        yield
    finally:
        for name in [name for name, module in sys.modules.items() if getattr(module, "rcsc_stand_in", False)]:
            if name in before:
                sys.modules[name] = before[name]
            else:
                del sys.modules[name]


def c_stand_ins(program: Program, symbols: Symbols) -> str:
    """The stand-ins in C; empty where there are none."""
    lines = ["#include <string.h>", f'#include "{symbols.header}"']
    lines += ["static uint32_t word_of_double(double x) { uint64_t w; memcpy(&w, &x, sizeof w);"]
    lines += ["return (uint32_t)(w ^ (w >> 32)); }"]
    for procedure in externs(program):
        lines += _c_function(program, symbols, procedure)
    return "\n".join(lines) + "\n" if externs(program) else ""


def _c_function(program: Program, symbols: Symbols, procedure: Procedure) -> Iterator[str]:
    kinds = given_kinds(program, procedure)
    types = [symbols.c_type(name) for name in procedure.reads]
    types += [symbols.value_type(p.type) for p in procedure.params]
    given = [f"{c_type} a{at}" for at, c_type in enumerate(types)]
    taken = [f"{symbols.c_type(name)} *r{at}" for at, name in enumerate(procedure.writes)]
    function = procedure.extern.c if procedure.extern else ""
    yield f"void {function}({', '.join([*given, *taken]) or 'void'}) {{"
    for salt, name in enumerate(procedure.writes):
        variable = program.variable(name)
        yield f"uint32_t h{salt} = {SEED ^ salt}u;"
        for at, kind in enumerate(kinds):
            text = f"word_of_double(a{at})" if isinstance(kind, Real) else f"(uint32_t)a{at}"
            yield f"h{salt} = (h{salt} ^ {text}) * {FACTOR}u;"
        values = results(program, variable)
        texts = ", ".join(_c_value(variable.type, value) for value in values)
        yield f"static const {symbols.c_type(name)} v{salt}[] = {{{texts}}};"
        yield f"*r{salt} = v{salt}[(h{salt} >> 8) % {len(values)}u];"
    yield "}"


def _c_value(kind: Scalar, value: Value) -> str:
    if isinstance(kind, Real):
        return {"nan": "(0.0 / 0.0)", "inf": "(1.0 / 0.0)", "-inf": "(-1.0 / 0.0)"}.get(
            str(float(value)), constant(kind, value)
        )
    return constant(kind, value).replace("(ref_wide)", "")

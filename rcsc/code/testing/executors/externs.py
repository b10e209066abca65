"""Stand-ins for extern procedures, the same in C and in Python: nothing of the user's is imported, linked or called.

In: a program and its emitted files. Out: the program, the C and the Python modules in which every extern is a
stand-in. A stand-in gives edges of what it writes, some outside the declared range (the executors must
refuse them), chosen by a hash of what it was given and of the script, a number that each session has.
"""

import builtins
import re
import struct
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from types import ModuleType
from zlib import crc32

from rcsc.code.testing.executors.edges import leaf_edges, outside
from rcsc.code.testing.executors.reference import constant
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.model import Extern, Procedure, Program, Real, Scalar, Snapshot, Value, Variable, value_of_key

SEED, FACTOR, MASK = 2166136261, 16777619, 0xFFFF_FFFF
"""Source: FNV-1a, 32 bits, by words instead of bytes."""

MOST_RESULTS = 24
SCRIPTS = 64
STAND_INS = "rcsc_stand_ins.c"


@dataclass(slots=True)
class Script:
    """Which answers the Python stand-ins give; those in C have `rcsc_script`."""

    number: int = 0


SCRIPT = Script()


def begin(program: Program, start: Snapshot) -> int:
    """Sets the script of the session that begins in `start`; its number, which the C is to be given."""
    SCRIPT.number = crc32(repr(sorted(start.items())).encode()) % SCRIPTS if externs(program) else 0
    return SCRIPT.number


def externs(program: Program) -> tuple[Procedure, ...]:
    """The program's extern procedures."""
    return tuple(procedure for procedure in program.procedures if procedure.extern is not None)


def stand_in_head(symbols: Symbols, procedure: Procedure) -> tuple[str, list[str]]:
    """Return the head of a C function in place of an extern: `void f(uint8_t a0, bool *r0)`; and the types of what it is given."""
    given = [symbols.c_type(name) for name in procedure.reads]
    given += [symbols.value_type(p.type) for p in procedure.params]
    params = [f"{c_type} a{at}" for at, c_type in enumerate(given)]
    params += [f"{symbols.c_type(name)} *r{at}" for at, name in enumerate(procedure.writes)]
    function = procedure.extern.c if procedure.extern else ""
    return f"void {function}({', '.join(params) or 'void'})", given


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
    for word in (SCRIPT.number, *words):
        state = ((state ^ word) * FACTOR) & MASK
    return (state >> 8) % count


def given_kinds(program: Program, procedure: Procedure) -> list[Scalar]:
    """Types of what an extern is called with: what it reads, then its parameters."""
    return [program.variable(name).type for name in procedure.reads] + [p.type for p in procedure.params]


def python_function(program: Program, procedure: Procedure) -> object:
    """The stand-in in Python."""
    kinds = given_kinds(program, procedure)
    choices = [results(program, program.variable(name)) for name in procedure.writes]

    def stand_in(*args: Value) -> Value | tuple[Value, ...]:
        words = [word(kind, arg) for kind, arg in zip(kinds, args, strict=True)]
        given = tuple(values[chosen(words, salt, len(values))] for salt, values in enumerate(choices))
        return given[0] if len(given) == 1 else given

    return stand_in


@dataclass(frozen=True, slots=True)
class PythonStandIns:
    """The stand-ins in Python.

    Attributes:
        program: The program, its externs being the stand-ins; what is to be given to the interpreter and to
            what writes the reference C.
        modules: What the emitted Python finds where it imports the user's modules, by dotted name.
    """

    program: Program
    modules: Mapping[str, ModuleType] = field(hash=False)

    def load(self, text: str, name: str) -> ModuleType:
        """The emitted Python as a module of its own that sees stand-ins where it imports the user's modules."""
        return loaded(
            text, name, lambda wanted: wanted in self.modules and self.modules[wanted.partition(".")[0]]
        )


def loaded(text: str, name: str, stand_in: Callable[[str], object]) -> ModuleType:
    """Return the emitted Python as a module of its own.

    Args:
        text: Of the module; it is run.
        name: Of the module.
        stand_in: Gives what the text finds where it imports a module of the user's, or nothing: then that module.
    """
    module = ModuleType(name)

    def imported(wanted: str, *args: object) -> object:
        plain = len(args) < 3 or not args[2]  # `from x import y` is the executor's own
        return (plain and stand_in(wanted)) or builtins.__import__(wanted, *args)  # type: ignore[arg-type]  # handed on as it came

    module.__dict__["__builtins__"] = {**vars(builtins), "__import__": imported}
    exec(compile(text, name, "exec"), module.__dict__)  # noqa: S102  # it is what is tested
    return module


class _Anything:
    """What a module of the user's may be: it has any name."""

    def __getattr__(self, _: str) -> "_Anything":
        return self


def not_importable(text: str, name: str) -> str:
    """Return why the emitted Python cannot be imported, whatever the modules of the user's are; "" if it can."""
    try:
        loaded(text, name, lambda _: _Anything())
    except Exception as error:  # noqa: BLE001  # whatever it is, the text is wrong
        return f"{type(error).__name__}: {error}"
    return ""


NUMBER = count()


@contextmanager
def python_stand_ins(program: Program) -> Iterator[PythonStandIns]:
    """Stand-ins for the program's externs, for the interpreter while the context lasts.

    They are found under a module name that no user has; the user's own modules stay what they are, and stay
    unimported.
    """
    place = f"<rcsc stand-ins {next(NUMBER)}>"
    own = ModuleType(place)
    modules: dict[str, ModuleType] = {}
    changed = []
    stand_in_c = {p.extern.c: f"rcsc_stand_in_{at}" for at, p in enumerate(externs(program)) if p.extern}
    for number, procedure in enumerate(program.procedures):
        if procedure.extern is not None:
            function = python_function(program, procedure)
            setattr(own, f"f{number}", function)
            _put(modules, procedure.extern.python, function)
            changed.append(
                replace(procedure, extern=Extern(f"{place}:f{number}", stand_in_c[procedure.extern.c]))
            )
        else:
            changed.append(procedure)
    sys.modules[place] = own
    try:
        yield PythonStandIns(replace(program, procedures=tuple(changed)), modules)
    finally:
        del sys.modules[place]


def _put(modules: dict[str, ModuleType], where: str, function: object) -> None:
    """Puts a function where `package.module:function` says, among modules that are ours."""
    name, _, attribute = where.partition(":")
    parts = name.split(".")
    for at in range(1, len(parts) + 1):
        dotted = ".".join(parts[:at])
        modules.setdefault(dotted, ModuleType(dotted))
        if at > 1:
            setattr(modules[".".join(parts[: at - 1])], parts[at - 1], modules[dotted])
    setattr(modules[name], attribute, function)


def with_c_stand_ins(
    before: Program, after: Program, symbols: Symbols, files: Mapping[str, str]
) -> dict[str, str]:
    """The emitted files with the externs' C: one file more, and calls of it where the user's was called.

    Only calls and declarations are renamed, so that even a function called `exit` is a stand-in.

    Args:
        before: The program as it is.
        after: The program of `python_stand_ins`.
        symbols: Names in the emitted C.
        files: The emitted files, text by path.
    """
    names = {
        mine.extern.c: other.extern.c
        for mine, other in zip(before.procedures, after.procedures, strict=True)
        if mine.extern and other.extern
    }
    if not names:
        return dict(files)
    calls = re.compile(rf"(?<![\w.>])({'|'.join(names)})(?=\()")
    emitted = (symbols.header, symbols.source)
    changed = {
        path: calls.sub(lambda call: names[call[1]], text)
        for path, text in files.items()
        if Path(path).name in emitted
    }
    return {**files, **changed, STAND_INS: c_stand_ins(after, symbols)}


def c_stand_ins(program: Program, symbols: Symbols) -> str:
    """The stand-ins in C; empty where there are none."""
    lines = ["#include <stdint.h>", "#include <string.h>", f'#include "{symbols.header}"']
    lines += ["static uint32_t word_of_double(double x) { uint64_t w; memcpy(&w, &x, sizeof w);"]
    lines += ["return (uint32_t)(w ^ (w >> 32)); }"]
    lines += ["uint32_t rcsc_script;"]
    for procedure in externs(program):
        lines += _c_function(program, symbols, procedure)
    return "\n".join(lines) + "\n" if externs(program) else ""


def _c_function(program: Program, symbols: Symbols, procedure: Procedure) -> Iterator[str]:
    kinds = given_kinds(program, procedure)
    yield f"{stand_in_head(symbols, procedure)[0]} {{"
    for salt, name in enumerate(procedure.writes):
        variable = program.variable(name)
        yield f"uint32_t h{salt} = ({SEED ^ salt}u ^ rcsc_script) * {FACTOR}u;"
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

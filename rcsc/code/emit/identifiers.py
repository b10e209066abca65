"""Every spelling in the generated files, in C and in Python; words that are reserved, and collisions.

In: a program. Out: `Names`. A name of a table can never become code: names are ASCII words, all generated ones carry the program's
name in front, and texts that go into comments are cleaned here.

Each namespace is a `NameScope`: it begins with what is reserved in it (`rcsc.lang.reserved`) and takes every name given in it, whatever it
names. A name that is free stays as it was written; the others get what makes them different. A table, level or procedure has one
*stem* in both languages: it is chosen so that all names made of it are free in both. In C two names differ within 31 characters.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from types import MappingProxyType
from typing import TypeAlias

from rcsc.code.emit.plan import Plan
from rcsc.code.emit.scope import NameScope, abbreviated, c_scope, short
from rcsc.lang import reserved
from rcsc.lang.interpret import Fault
from rcsc.lang.meaning import checked
from rcsc.lang.model import Array, Enum, Program, Record, Type, pending

DIGEST = "digest"
"""The member of the state that tells which tables it is of."""
TRACE = ("line", "fault", "fault_at")
"""Members of the state that tell about the last cycle; the words of failed assumptions come after them."""
C_WORDS = reserved.C_KEYWORDS | reserved.C_MACROS | reserved.C_COMPOSED | frozenset(TRACE)
PYTHON_WORDS = reserved.PYTHON_KEYWORDS | reserved.PYTHON_BUILTINS
_FILES = (
    reserved.C_HEADERS
    | reserved.C_LIBRARIES
    | reserved.CMAKE_TARGETS
    | reserved.PYTHON_MODULES
    | reserved.PYTHON_KEYWORDS
)
_MODULE = frozenset(
    """IntEnum State _Refused _bisect _reduce _product _and _div _mod _min _max _refused _line_of _one_of _joined _lines_of
    _nan _whole _real _single _float32 _Struct _inf _copysign _odd _exactly _admit _settle _safe _begin check
    DIGEST FOREIGN""".split()
)
"""What the Python module calls its own."""
OWN = ("t", "init", "check", "begin", "admit", "settle", "safe")
"""Ends of the C names that every program may have."""
FAULTS = ("none", *(fault.name.lower() for fault in Fault if fault is not Fault.OK))
"""How C calls each fault, in order."""
MOST_SAID = 400
FAILED_BITS = 64
FEW_FAILED_BITS = 32
"""Assumptions up to which C keeps those that failed in a smaller word."""


def c_word(name: str) -> str:
    """Return `name`, cut if long, with `_` after it where C, C++ or a library uses it; a word in capitals may be a macro."""
    name = short(name)
    capitals = len(name) > 1 and name.isupper()
    return f"{name}_" if capitals or name in C_WORDS or name.startswith("_") else name


def parameter_word(name: str) -> str:
    """Return a leaf's or a parameter's name as the parameter of a C prototype."""
    return c_word(re.sub(r"\W+", "_", name).strip("_") or "p")


def python_word(name: str) -> str:
    """Return `name`, changed where Python reserves it."""
    if name.startswith("_"):
        name = f"x{name}"
    return f"{name}_" if name in PYTHON_WORDS else name


def comment(text: str) -> str:
    """Clean a text so that it can stand in a comment of either language and end neither; a very long one is cut.

    Nothing in it means anything to a compiler, a build tool or an analyser: no end or begin of a comment, no continued line, no
    trigraph (ISO C99, 5.2.1.1), no declared encoding (PEP 263), no expansion, no suppression.
    """
    text = text if len(text) <= MOST_SAID else f"{text[:MOST_SAID]}..."
    clean = "".join(c if c.isprintable() and c.isascii() else "?" for c in text)
    clean = re.sub(r"[?\\]*[\\][?\\]*|\?{2,}", "?", clean)
    for mark in ("*/", "/*", "//", "${", "-suppress", "coding:", "coding=", "NOLINT"):
        clean = clean.replace(mark, f"{mark[:-1]} {mark[-1]}")
    return clean.replace('"', "'")


Words: TypeAlias = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Names:
    """The names of one program's executors.

    Attributes:
        file: Stem of the symbol file: the program's name as it is.
        program: Prefix of all C names, and stem of the other files.
        attributes: Python attribute of each leaf.
        paths: Path of each leaf in the C struct, member by member and index by index.
        roots: Member of the C struct for each declared variable.
        members: For each record, the name of each field in its struct.
        tables, levels, procedures: The stem of each.
        holding: The C function of each assumption that is checked.
        units: Prefix of the types of each file that declares some: programs that use the file share them.
        types: C type of each record and enumeration.
        constants: For each enumeration, the C constant of each member.
        classes: Python class of each enumeration.
        class_members: For each enumeration, the name of each member in its Python class.
        failed: Words of the trace for the monitored assumptions that failed.
        lines: For each table, the C constant of each line; `assumptions`, `faults`, `leaves` and `invariants` likewise.
        places: The C constant of each table that others follow in a cycle.
        checks: The C constants that `check` returns for a state to go on from, and for one that other tables made.
        digest: The C macro of the number that tells which tables a state is of.
        layout: The C type that is there where the state is laid out as was meant.
        c: All names at file scope in C; `module`, those of the Python module.
    """

    file: str
    program: str
    attributes: dict[str, str]
    paths: dict[str, tuple[str, ...]]
    roots: dict[str, str]
    members: dict[str, dict[str, str]]
    tables: dict[str, str]
    levels: dict[str, str]
    procedures: dict[str, str]
    units: dict[str, str]
    types: dict[str, str]
    constants: dict[str, tuple[str, ...]]
    classes: dict[str, str]
    class_members: dict[str, tuple[str, ...]]
    failed: tuple[str, ...]
    lines: dict[str, tuple[str, ...]]
    assumptions: tuple[str, ...]
    holding: tuple[str, ...]
    faults: tuple[str, ...]
    leaves: dict[str, str]
    invariants: tuple[str, ...]
    places: dict[str, str]
    checks: tuple[str, str]
    digest: str
    layout: str
    c: NameScope
    module: NameScope


def failed_type(monitored: int) -> str:
    """Return the type of those members: one machine word of a small processor where that is enough."""
    return "uint32_t" if monitored <= FEW_FAILED_BITS else "uint64_t"


def failed_words(monitored: int) -> tuple[str, ...]:
    """Return the members of the trace with one bit for each monitored assumption, 64 in each; there is at least one."""
    more = range(2, (monitored + FAILED_BITS - 1) // FAILED_BITS + 1)
    return ("assumptions_failed", *(f"assumptions_failed_{number}" for number in more))


def names_of(program: Program, places: Mapping[str, str] = MappingProxyType({}), prefix: str = "") -> Names:
    """Make all names unique, in declared order.

    Those of types come first: they depend only on the file that declares them, and not on the program that uses it.

    Args:
        program: The program.
        places: `Plan.places`; a file that is not there is called by its own name.
        prefix: `Plan.prefix`.
    """
    file = plain_word(program.name)
    p = file_word(file, prefix)
    failed = failed_words(len(checked(program)))
    c, module = _file_scope(program, p), NameScope(set(_MODULE))
    units = _units(program, p, places, prefix)
    types = _types(program, units, c)
    constants = _constants(program, units, c)
    stems = _Stems(p, c, module)
    members = {r.name: c_scope().all((f.name, c_word(f.name)) for f in r.fields) for r in program.records}
    roots, paths = _paths(program, members, failed)
    tables = stems.of(
        (t.name for t in program.tables), ("{p}_{x}_line", "{p}_{x}_lines", "{p}_{x}_step", "{p}_run_{x}", "{p}_match_{x}"),
        ("{x}_line", "{x}_lines", "{x}_step", "_run_{x}"),
    )  # fmt: skip
    levels = stems.of((level.name for level in program.levels), ("{p}_{x}_cycle",), ("{x}_cycle",))
    procedures = stems.of((procedure.name for procedure in program.procedures), ("{p}_do_{x}",), ("_do_{x}",))
    classes = module.all((enum.name, python_word(enum.name)) for enum in program.enums)
    return Names(
        file, p, _attributes(program, failed), paths, roots, members, tables, levels, procedures, units, types,
        constants, classes, _class_members(program), failed, *_positions(program, p, c), *_state(p, c), c, module,
    )  # fmt: skip


def names_in(plan: Plan) -> Names:
    """Return all names used in the code of a plan."""
    return names_of(plan.program, plan.places, plan.prefix)


def plain_word(name: str) -> str:
    """Turn the name of a file or of a system into a word, cut if long."""
    word = re.sub(r"\W", "_", name, flags=re.ASCII) or "program"
    return short(word if word[0].isalpha() else f"p{word}")


LONGEST_PREFIX = 18
"""Characters of a program's word, or a file's, up to which it stands before other names as it is."""


def file_word(word: str, prefix: str) -> str:
    """Return a word for C names and files: one that no library or tool reserves."""
    word = prefix + abbreviated(word, LONGEST_PREFIX - len(prefix))
    kept = word.lower() in _FILES | C_WORDS
    composed = any(f"{word}_{end}" in reserved.C_COMPOSED for end in OWN)
    return f"{word}_" if kept or composed else word


def types_header(unit: str) -> str:
    """Return the name of the header that declares the types of a file."""
    return f"{unit}_types.h"


def _units(program: Program, p: str, places: Mapping[str, str], prefix: str) -> dict[str, str]:
    """Return the word of each file that declares a type: the program's for its own, else one made from the file's place.

    Files whose types need each other have one word, that of the first: one header declares them.
    """
    declared = {kind.name: kind.file for kind in program.types}
    needs = {file: {file} for file in sorted(set(declared.values()))}
    for record in program.records:
        needs[record.file] |= {declared[part.name] for part in parts_of(record)}
    for middle, beyond in needs.items():
        for others in needs.values():
            if middle in others:
                others |= beyond  # noqa: PLW2901  # in place
    words: dict[str, str] = {}
    for file, others in needs.items():
        first = next(other for other in needs if other in others and file in needs[other])
        words[file] = words.get(first) or _unit(program, (p, prefix), file, places)
    return words


def _unit(program: Program, own: tuple[str, str], file: str, places: Mapping[str, str]) -> str:
    """Return the word of one file: `emove/common` is `emove_common`, `gripper/gripper` is `gripper`; `own` is program word and prefix."""
    p, prefix = own
    if file in {"", program.file}:
        return p
    parts = places.get(file, file.rpartition("/")[2].removesuffix(".rcs")).split("/")
    word = file_word(plain_word("_".join(part for part, _ in groupby(parts))), prefix)
    return f"{word}_" if types_header(word) == f"{p}.h" else word


def parts_of(record: Record) -> Iterator[Enum | Record]:
    """Yield the declared types of a record's own fields."""
    for part in record.fields:
        kind = part.type
        while isinstance(kind, Array):
            kind = kind.element
        if isinstance(kind, Enum | Record):
            yield kind


def _types(program: Program, units: Mapping[str, str], scope: NameScope) -> dict[str, str]:
    """Name each type `UNIT_NAME_t`."""
    wanted = [f"{units[kind.file]}_{_stem(kind.name)}_t" for kind in program.types]
    return dict(zip((kind.name for kind in program.types), scope.distinct(wanted), strict=True))


def capitals(p: str) -> str:
    """Return a program's word in capitals; unchanged where it has some, as only they may tell it from another's."""
    return p.upper() if p.islower() else p


def guard(p: str) -> str:
    """Return the include guard of a program's header."""
    return f"{capitals(p)}_H"


def types_guard(unit: str) -> str:
    """Return the include guard of a header of types."""
    return f"{capitals(unit)}_TYPES_H"


def _file_scope(program: Program, p: str) -> NameScope:
    externs = {procedure.extern.c for procedure in program.procedures if procedure.extern is not None}
    own = {f"{p}_{end}" for end in (*OWN, "exact", "bit32", "bit64")} | {guard(p)}
    return c_scope(set(reserved.C_COMPOSED | C_WORDS) | externs | own)


@dataclass(frozen=True, slots=True)
class _Stems:
    """Stems of one program: each makes names in both languages."""

    program: str
    c: NameScope
    module: NameScope

    def of(self, names: Iterable[str], in_c: tuple[str, ...], in_python: tuple[str, ...]) -> dict[str, str]:
        """Return a stem for each name.

        Args:
            names: Of one kind, in declared order.
            in_c: Forms of the C names that a stem `x` of program `p` makes.
            in_python: Forms of the Python names.
        """

        def claims(stem: str) -> Iterator[tuple[NameScope, str]]:
            for scope, forms in ((self.c, in_c), (self.module, in_python)):
                yield from ((scope, form.format(p=self.program, x=stem)) for form in forms)

        return NameScope().all(((str(name), _stem(name)) for name in names), claims)


def _stem(name: str) -> str:
    """Return a name as a stem, which stands between other words: only names that no word may have are changed."""
    name = short(name)
    return f"{name}_" if name in reserved.C_KEYWORDS or name.startswith("_") else name


def _attributes(program: Program, failed: tuple[str, ...]) -> dict[str, str]:
    taken = NameScope({DIGEST, *TRACE, *failed, "copy_in", "copy_out"})
    flat = ((str(v.name), _flat(str(v.name))) for v in program.variables)
    return taken.all((name, _unlike(python_word(word), taken)) for name, word in flat)


def _unlike(word: str, scope: NameScope) -> str:
    """Return the word, with `_` after it where the scope reserves it."""
    return f"{word}_" if word in scope.names else word


def _flat(name: str) -> str:
    return re.sub(r"[.\[]", "_", name.replace("]", ""))


def constant_word(p: str, *parts: str) -> str:
    """Return `PROGRAM_ENUM_MEMBER`, with `_` after it where macros of a library begin like that."""
    tail = "_" if p.upper().split("_")[0] in reserved.C_FAMILIES else ""
    return f"{capitals(p)}_{'_'.join(map(short, parts)).upper()}{tail}"


def _constants(program: Program, units: Mapping[str, str], scope: NameScope) -> dict[str, tuple[str, ...]]:
    return {
        enum.name: scope.distinct(
            [constant_word(units[enum.file], enum.name, member) for member in enum.members]
        )
        for enum in program.enums
    }


def _positions(
    program: Program, p: str, scope: NameScope
) -> tuple[dict[str, Words], Words, Words, Words, dict[str, str], Words, dict[str, str]]:
    """Name the constants of positions in the trace.

    Lines of each table, assumptions that are checked, faults, variables, invariants, tables that others follow.
    """
    lines = {
        str(table.name): scope.distinct(
            [constant_word(p, "line", table.name, line.name) for line in table.every_line]
        )
        for table in program.tables
    }
    named = [program.assumptions[at].name for at in checked(program)]
    holding = scope.distinct([f"{p}_holds_{_stem(str(name))}" for name in named])

    def constants(kind: str, names: Iterable[str]) -> tuple[str, ...]:
        return scope.distinct([constant_word(p, kind, name) for name in names])

    assumptions = constants("assumption", named)
    faults = constants("fault", FAULTS)
    variables = [str(v.name) for v in program.variables]
    leaves = dict(zip(variables, constants("leaf", map(_flat, variables)), strict=True))
    invariants = constants("invariant", (invariant.name for invariant in program.invariants))
    staged = [str(table) for table in program.line_leaves]
    places = dict(zip(staged, constants("table", staged), strict=True))
    return lines, assumptions, holding, faults, leaves, invariants, places


def _state(p: str, scope: NameScope) -> tuple[tuple[str, str], str, str]:
    """Name the results of `check` besides positions, and the constants that tell one program's state from another's."""
    checks = (scope.fresh(constant_word(p, "check", word)) for word in ("ok", "foreign"))
    return (
        (next(checks), next(checks)),
        scope.fresh(constant_word(p, DIGEST)),
        scope.fresh(f"{p}_layout_holds"),
    )


def _class_members(program: Program) -> dict[str, tuple[str, ...]]:
    members = {}
    for enum in program.enums:
        words = ((m, _unlike(python_word(m), NameScope(set(reserved.PYTHON_MEMBERS)))) for m in enum.members)
        members[enum.name] = tuple(NameScope(set(reserved.PYTHON_MEMBERS)).all(words).values())
    return members


def _paths(
    program: Program, members: dict[str, dict[str, str]], failed: tuple[str, ...]
) -> tuple[dict[str, str], dict[str, tuple[str, ...]]]:
    """Return the struct member of each declared variable, and the path of each leaf; the pending leaf of `x` is `x_next`."""
    taken = c_scope({DIGEST, *TRACE, *failed})
    roots = taken.all((d.name, _unlike(c_word(d.name), taken)) for d in program.declared)
    variables = {str(v.name) for v in program.variables}
    paths: dict[str, tuple[str, ...]] = {}
    for declared in program.declared:
        places = _places((roots[declared.name],), declared.type, members)
        paths.update(zip(map(str, declared.leaves), places, strict=True))
        for leaf in declared.leaves:
            if pending(leaf) in variables:
                paths[pending(leaf)] = (taken.fresh(f"{''.join(paths[leaf])}_next"),)
    return roots, {str(v.name): paths[v.name] for v in program.variables}


def _places(
    path: tuple[str, ...], kind: Type, members: dict[str, dict[str, str]]
) -> Iterator[tuple[str, ...]]:
    match kind:
        case Array(length, element):
            for at in range(length):
                yield from _places((*path, f"[{at}]"), element, members)
        case Record(name=record, fields=fields):
            for part in fields:
                yield from _places((*path, f".{members[record][part.name]}"), part.type, members)
        case _:
            yield path

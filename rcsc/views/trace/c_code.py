"""Emitted C back to the tables: which lines of a file come from which line of a table.

In: a plan, for its names, and the text of a file. Out: pieces, which cover all that can be traced. Functions, constants, members
and cases are known by their names; what has the name of nothing in the tables is infrastructure, with its reason.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rcsc.code.emit.identifiers import Names, names_in
from rcsc.code.emit.plan import Plan
from rcsc.views.trace.chunks import Chunk, chunks
from rcsc.views.trace.origin import Origin, Piece, Sort, infrastructure

_DIRECTIVES = (
    ("#include", "declares what the file uses"),
    ("#pragma", "has reals rounded one operation at a time, as they were proved"),
    ("#", "chooses by the compiler, or guards against including twice"),
)
_LINKAGE = "lets C++ call it"
_FAULTS = "says why a cycle ended early"
_TRACE = "tells what a cycle did"
_SAID = "says what the file is"
_CONSTANT = re.compile(r"^\s*([A-Za-z_]\w*)\s*(?:=|,|$)")
_MEMBER = re.compile(r"(\w+)(?:\[[^\]]*\])*\s*;\s*$")
_CASE = re.compile(r"^\s*case \(?(\w+)\)?:")


@dataclass(frozen=True, slots=True)
class CNames:
    """Origins by the names that C gives.

    Attributes:
        prefix: Of the program's own names.
        functions: Of functions; `constants` of enumerators, `types` of types, `members` of the state.
        stems: Tables by the beginning of other names that their matching uses; the longest first.
    """

    prefix: str
    functions: Mapping[str, Origin]
    constants: Mapping[str, Origin]
    types: Mapping[str, Origin]
    members: Mapping[str, Origin]
    stems: Mapping[str, Origin]


def c_names(plan: Plan) -> CNames:
    """Collect the names of a plan in C, with what they stand for."""
    names, program = names_in(plan), plan.program
    whole = Origin(Sort.PROGRAM, program.name)
    externs = {
        one.extern.c: Origin(Sort.PROCEDURE, one.name) for one in program.procedures if one.extern is not None
    }
    members = {root: Origin(Sort.VARIABLE, name) for name, root in names.roots.items()}
    members |= {
        paths[0]: Origin(Sort.VARIABLE, name.removesuffix(".next"))
        for name, paths in names.paths.items()
        if name.endswith(".next")
    }
    stems = {f"{names.program}_{stem}": Origin(Sort.TABLE, name) for name, stem in names.tables.items()}
    return CNames(
        names.program,
        {f"{names.program}_{end}": whole for end in ("init", "check", "admit", "settle", "safe", "begin")}
        | externs
        | dict(_functions(plan, names)),
        dict(_constants(plan, names)),
        {name: Origin(Sort.TYPE, kind) for kind, name in names.types.items()} | {f"{names.program}_t": whole},
        members,
        dict(sorted(stems.items(), key=lambda item: -len(item[0]))),
    )


def _functions(plan: Plan, names: Names) -> Iterator[tuple[str, Origin]]:
    p = names.program
    for name, stem in names.procedures.items():
        yield f"{p}_do_{stem}", Origin(Sort.PROCEDURE, name)
    for name, stem in names.tables.items():
        for form in ("{p}_{x}_line", "{p}_{x}_lines", "{p}_{x}_step", "{p}_run_{x}", "{p}_match_{x}"):
            yield form.format(p=p, x=stem), Origin(Sort.TABLE, name)
    for name, stem in names.levels.items():
        yield f"{p}_{stem}_cycle", Origin(Sort.LEVEL, name)
    for place, at in enumerate(plan.monitored):
        yield names.holding[place], Origin(Sort.ASSUMPTION, str(plan.program.assumptions[at].name))


def _constants(plan: Plan, names: Names) -> Iterator[tuple[str, Origin]]:
    for table in plan.tables:
        words = zip(names.lines[table.table.name], table.lines, strict=True)
        yield from ((word, Origin(Sort.LINE, table.table.name, line.name)) for word, line in words)
    for place, at in enumerate(plan.monitored):
        yield names.assumptions[place], Origin(Sort.ASSUMPTION, str(plan.program.assumptions[at].name))
    yield from ((word, infrastructure(_FAULTS)) for word in names.faults)
    yield from ((word, Origin(Sort.VARIABLE, _root(plan, leaf))) for leaf, word in names.leaves.items())
    for invariant, word in zip(plan.program.invariants, names.invariants, strict=True):
        yield word, Origin(Sort.INVARIANT, invariant.name)
    yield from ((word, Origin(Sort.TABLE, table)) for table, word in names.places.items())
    for kind, members in names.constants.items():
        yield from ((word, Origin(Sort.TYPE, kind)) for word in members)


def _root(plan: Plan, leaf: str) -> str:
    """The declared variable that a leaf is of."""
    name = leaf.removesuffix(".next")
    return next((one.name for one in plan.program.declared if name in one.leaves), name)


def c_pieces(names: CNames, file: str, text: str) -> Iterator[Piece]:
    """Give the pieces of one file; lines that are in none are traced to nothing."""
    said = ""
    for chunk in chunks(text):
        if chunk.text.startswith(("#if", "#endif")):
            said = chunk.comment  # of all that stands in both branches
        yield from _of_chunk(names, file, chunk, said)


def system_pieces(name: str, file: str, text: str) -> Iterator[Piece]:
    """Give the pieces of a file of a whole system: what is not for the preprocessor comes from the system's description."""
    for chunk in chunks(text):
        plain = _plain(file, chunk)
        yield plain or Piece(
            file, chunk.first, chunk.last, chunk.function or chunk.declared, Origin(Sort.SYSTEM, name)
        )


def _plain(file: str, chunk: Chunk) -> Piece | None:
    """A comment, a directive or a frame for C++, with its reason; None for all else."""
    if not chunk.text:
        reason = _SAID
    elif chunk.is_directive:
        reason = next(reason for begin, reason in _DIRECTIVES if chunk.text.startswith(begin))
    elif chunk.text in {'extern "C" {', "}"}:
        reason = _LINKAGE
    else:
        return None
    return Piece(file, chunk.first, chunk.last, "", infrastructure(reason))


def _of_chunk(names: CNames, file: str, chunk: Chunk, said: str) -> Iterator[Piece]:
    if (plain := _plain(file, chunk)) is not None:
        yield plain
    elif chunk.text.startswith(("enum", "typedef struct", "typedef enum")):
        yield from _members(names, file, chunk)
    elif (origin := _named(names, chunk, chunk.comment or said)) is not None:
        name = chunk.function or chunk.declared
        yield Piece(file, chunk.first, chunk.last, name, origin)
        yield from _cases(names, file, chunk) if origin.sort is Sort.TABLE else ()


def _named(names: CNames, chunk: Chunk, said: str) -> Origin | None:
    """What a function, a type or a constant at file scope comes from; None where nobody knows.

    A private function with no name of the tables serves others: its reason is what its comment says.
    """
    if chunk.function in names.functions:
        return names.functions[chunk.function]
    if chunk.declared in names.types:
        return names.types[chunk.declared]
    if chunk.declared in names.constants:
        return names.constants[chunk.declared]
    name = chunk.function or chunk.declared
    stem = next((stem for stem in names.stems if name.lower().startswith(f"{stem}_".lower())), "")
    if stem:
        return names.stems[stem]
    private = chunk.text.startswith(("static", "typedef"))
    return infrastructure(said) if _own(names, name) and said and private else None


def _own(names: CNames, name: str) -> bool:
    """Whether a name begins as the program's own do."""
    return name.lower().startswith(f"{names.prefix}_".lower())


def _members(names: CNames, file: str, chunk: Chunk) -> Iterator[Piece]:
    """Enumerators or members, each with its origin, and the frame around them with that of most."""
    record = chunk.text.startswith("typedef struct")
    known = names.members if record else names.constants
    own = names.types.get(chunk.declared)
    found: list[Piece] = []
    first = chunk.begin + 1
    for at, code in enumerate(chunk.code[1:-1], chunk.begin + 1):
        match = (_MEMBER if record else _CONSTANT).search(code)
        if match is None:
            continue  # the comment of the member below
        origin = own if own is not None and own.sort is Sort.TYPE else known.get(match[1])
        if origin is None and record:
            origin = infrastructure(_TRACE)
        elif origin is None and chunk.comment and _own(names, match[1]):
            origin = infrastructure(chunk.comment)
        if origin is not None:
            found.append(Piece(file, first, at, match[1], origin))
        first = at + 1
    frame = own or _common([piece.origin for piece in found])
    if frame is not None:
        yield Piece(file, chunk.first, chunk.begin, chunk.declared, frame)
        yield Piece(file, first, chunk.last, chunk.declared, frame)
    yield from found


def _common(origins: list[Origin]) -> Origin | None:
    """What all have in common: a table, or at least the sort of infrastructure that tells a cycle's end."""
    if not origins:
        return None
    if len({(origin.sort, origin.name) for origin in origins}) == 1:
        first = origins[0]
        return Origin(Sort.TABLE, first.name) if first.sort is Sort.LINE else first
    return infrastructure("numbers what a cycle tells by its position")


def _cases(names: CNames, file: str, chunk: Chunk) -> Iterator[Piece]:
    """What runs for one line each: from its label, with the comment above, to its `break`."""
    waiting: list[tuple[str, int]] = []
    above = chunk.begin
    for at, code in enumerate(chunk.code, chunk.begin):
        label = _CASE.match(code)
        if label is not None and label[1] in names.constants:
            waiting.append((label[1], above))
        if code.strip() == "break;":
            yield from (
                Piece(file, first, at, f"case {name}", names.constants[name])
                for name, first in waiting
                if names.constants[name].sort is Sort.LINE
            )
            waiting = []
        if code.strip():
            above = at + 1

"""What others see of a program's C: types, constants, the state, and the functions that the user writes."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.code.emit.c.cprogram import CProgram
from rcsc.code.emit.c.ctext import c_type, declared, wide_type
from rcsc.code.emit.c.layout import record_size, sizes
from rcsc.code.emit.identifiers import DIGEST, comment, parameter_word, parts_of, types_guard, types_header
from rcsc.code.emit.plan import Origin, Sort, infrastructure, table_position
from rcsc.code.emit.rendering import Rendered, render
from rcsc.code.emit.scope import c_scope
from rcsc.lang import model
from rcsc.lang.model import Enum, Int, Procedure, Real, pending, spell, unit_text

TRACED = "tells what a cycle did"
NUMBERED = "numbers what a cycle tells by its position"


@dataclass(frozen=True, slots=True)
class Member:
    """A member of a struct, or a constant of an enumeration."""

    declaration: str
    doc: str
    name: str
    origin: Origin


Fields: TypeAlias = tuple[Member, ...]
FAULT_DOCS = (
    "",
    "an input was refused: `fault_at` is its position",
    "no line matched, which was proved impossible",
    "several lines matched, which was proved impossible",
    "a result of a function of yours was refused: `fault_at` is the position of its variable",
    "an assumption failed that the table's safety rests on: `fault_at` is its position",
    "of `rcsc compile --defensive`: the state was refused; `fault_at` is what `check` says of it",
    "this machine, or its compiler, computes reals otherwise",
)


def type_headers(c: CProgram) -> dict[str, Rendered]:
    """A header for each file that declares types: all programs that use it share them."""
    headers = {}
    for unit in dict.fromkeys(c.names.units.values()):
        files = [file for file, word in c.names.units.items() if word == unit]
        enums = [enum for enum in c.program.enums if enum.file in files]
        records = [record for record in c.program.records if record.file in files]
        needed = {c.names.units[part.file] for record in records for part in parts_of(record)}
        view = {
            "source": comment(_source(c, files[0])),
            "mark": c.plan.mark,
            "guard": types_guard(unit),
            "includes": sorted(types_header(other) for other in needed - {unit}),
            "enums": [_enum(c, enum) for enum in enums],
            "structs": [_record(c, record) for record in records],
        }
        file = f"c/{types_header(unit)}"
        headers[file] = render("types.h.jinja", view, file)
    return headers


def _source(c: CProgram, file: str) -> str:
    """Return the name of a file that declares types, as the first line of its header shows it."""
    own = file in {"", c.program.file}
    return c.plan.source if own else f"{c.plan.places.get(file, file)}.rcs"


def shared(c: CProgram) -> dict[str, list[str]]:
    """Return the names that the header of each unit declares."""
    names = {unit: [types_header(unit), types_guard(unit)] for unit in c.names.units.values()}
    for kind in c.program.types:
        names[c.names.units[kind.file]].append(c.names.types[kind.name])
    for enum in c.program.enums:
        names[c.names.units[enum.file]] += c.names.constants[enum.name]
    return names


def _enum(c: CProgram, enum: Enum) -> tuple[str, str, str, Fields, Origin]:
    origin = Origin(Sort.TYPE, enum.name)
    names = c.names.constants[enum.name]
    members = _numbered(names, enum.members, [origin] * len(names))
    return c.names.types[enum.name], c_type(enum), comment(enum.name), members, origin


def _numbered(names: Iterable[str], docs: Iterable[str], origins: Iterable[Origin]) -> Fields:
    """Constants from 0 on."""
    rows = enumerate(zip(names, docs, origins, strict=True))
    return tuple(Member(f"{name} = {at}", comment(doc), name, origin) for at, (name, doc, origin) in rows)


def _record(c: CProgram, record: model.Record) -> tuple[str, str, Fields, Origin]:
    origin = Origin(Sort.TYPE, record.name)
    names = c.names.members[record.name]
    docs = ("; ".join(word for word in (range_text(f.type), comment(f.doc)) if word) for f in record.fields)
    fields = tuple(
        Member(
            declared(c.names, names[f.name], f.type, defensive=c.plan.defensive), doc, names[f.name], origin
        )
        for f, doc in zip(record.fields, docs, strict=True)
    )
    size = record_size(record)
    return (
        c.names.types[record.name],
        f"record {comment(record.name)}, {size} byte{'s' if size > 1 else ''}",
        fields,
        origin,
    )


def positions(c: CProgram) -> Iterator[tuple[str, Fields, Origin]]:
    """Constants for what the trace tells by its position, each kind with what is said of it, and where it comes from."""
    for doc, members in _positions(c):
        kinds = {(member.origin.sort, member.origin.name) for member in members}
        sort, name = kinds.pop() if len(kinds) == 1 else (Sort.INFRASTRUCTURE, NUMBERED)
        yield doc, members, Origin(Sort.TABLE if sort is Sort.LINE else sort, name)


def _positions(c: CProgram) -> Iterator[tuple[str, Fields]]:
    for table in c.plan.tables:
        names = c.names.lines[table.table.name]
        docs = (  # where the constant does not say it
            "" if name.endswith(f"_{line.name.upper()}") else line.name
            for name, line in zip(names, table.lines, strict=True)
        )
        doc = f"`line`, where table {table.table.name} ran; -1 for none"
        origins = [Origin(Sort.LINE, table.table.name, line.name) for line in table.lines]
        yield comment(doc), _numbered(names, docs, origins)
    if c.names.assumptions:
        doc = "Bits of `assumptions_failed`, from the lowest, and `fault_at` where an assumption failed"
        named = (c.program.assumptions[at].name for at in c.plan.monitored)
        origins = [Origin(Sort.ASSUMPTION, name) for name in named]
        yield doc, _numbered(c.names.assumptions, c.plan.checked, origins)
    origins = [Origin(Sort.VARIABLE, _declared_name(c, leaf)) for leaf in c.names.leaves]
    origins += [Origin(Sort.INVARIANT, invariant.name) for invariant in c.program.invariants]
    doc = "`fault_at` where an input or a result was refused, and what `check` gives: variables, then invariants"
    yield doc, _numbered((*c.names.leaves.values(), *c.names.invariants), [""] * len(origins), origins)
    ok, foreign = c.names.checks
    doc = "What else `check` gives"
    older = f"its `{DIGEST}` is not {c.names.digest}: other tables made it, or an older version of these"
    origin = infrastructure(f"{doc}.")
    yield (
        doc,
        (
            Member(f"{ok} = -1", "the state may be gone on from", ok, origin),
            Member(f"{foreign} = {c.foreign}", older, foreign, origin),
        ),
    )
    if c.names.places:
        doc = "`fault_at` where a table that others follow in a cycle has no line, or several"
        numbered = ((table, name, table_position(c.program, table)) for table, name in c.names.places.items())
        yield (
            doc,
            tuple(
                Member(f"{name} = {number}", "", name, Origin(Sort.TABLE, table))
                for table, name, number in numbered
            ),
        )
    origins = [infrastructure("says why a cycle ended early")] * len(FAULT_DOCS)
    yield "`fault`, and what a cycle returns", _numbered(c.names.faults, FAULT_DOCS, origins)


def _declared_name(c: CProgram, leaf: str) -> str:
    """The declared variable that a leaf is of."""
    name = leaf.removesuffix(".next")
    return next((one.name for one in c.program.declared if name in one.leaves), name)


def fields(c: CProgram) -> Iterator[Member]:
    """Give the members of the state."""
    variables = {v.name: v for v in c.program.variables}
    position = {v.name: at for at, v in enumerate(c.program.variables)}
    for variable in c.program.declared:
        root, leaf = c.names.roots[variable.name], variables[variable.leaves[0]]
        first, last = position[variable.leaves[0]], position[variable.leaves[-1]]
        where = f"{first}" if first == last else f"{first} to {last}"
        words = [
            f"{where}: {variable.kind.value}",
            range_text(variable.type),
            "" if leaf.safe is None else f"safe {spell(leaf.type, leaf.safe)}",
            comment(variable.doc),
        ]
        origin = Origin(Sort.VARIABLE, variable.name)
        yield Member(
            declared(c.names, root, variable.type, defensive=c.plan.defensive),
            "; ".join(word for word in words if word),
            root,
            origin,
        )
        later = pending(variable.name)
        if later in variables:
            doc = f"{position[later]}: state; the deferred next value of {root}"
            name, kind = "".join(c.names.paths[later]), variables[later].type
            yield Member(declared(c.names, name, kind, defensive=c.plan.defensive), doc, name, origin)


def size_text(c: CProgram) -> str:
    """Spell the size of the state in bytes, on each kind of target."""
    most, *others = dict.fromkeys(sizes(c.program, c.names))
    return f"{most} bytes" + (
        f", or {', '.join(map(str, others))} where members are aligned to less than their size"
        if others
        else ""
    )


def layout_condition(c: CProgram) -> str:
    """Spell the C condition that the state has one of the expected sizes."""
    held = dict.fromkeys(sizes(c.program, c.names))
    tests = [f"(sizeof({c.p}_t) == {size}u)" for size in held]
    return " || ".join(tests)


def user_functions(c: CProgram) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each user function with the types of its parameters; a pointer's ends in a star."""
    for procedure in c.program.procedures:
        if procedure.extern is not None:
            yield (procedure.extern.c, tuple(kind.replace(" ", "") for kind, _ in _parameters(c, procedure)))


def externs(c: CProgram) -> Iterator[Member]:
    """Declare each user function once; it is of the last procedure that calls it."""
    last = {p.extern.c: p for p in c.program.procedures if p.extern is not None}
    for name, procedure in last.items():
        params = ", ".join(map("".join, _parameters(c, procedure))) or "void"
        yield Member(f"extern void {name}({params});", "", name, Origin(Sort.PROCEDURE, procedure.name))


def _parameters(c: CProgram, extern: Procedure) -> Iterator[tuple[str, str]]:
    """Yield the parameters of a prototype: each type, up to the name, and the name."""
    kinds = {v.name: v.type for v in c.program.variables}
    word = c_scope().fresh
    yield from ((f"{c_type(kinds[name])} ", word(parameter_word(name))) for name in extern.reads)
    yield from ((f"{wide_type(param.type)} ", word(parameter_word(param.name))) for param in extern.params)
    yield from ((f"{c_type(kinds[name])} *", word(f"{parameter_word(name)}_out")) for name in extern.writes)


def range_text(kind: model.Type) -> str:
    """Spell the range of a number, with its unit; "" for a type without one."""
    match kind:
        case Int(low, high, unit) | Real(low, high, unit):
            units = unit_text(unit)
            return f"{spell(kind, low)} .. {spell(kind, high)}" + (f" {units}" if units else "")
        case model.Array(element=element):
            return range_text(element)
        case _:
            return ""

"""What is known of a name, in Markdown: what it is, its type, unit and range, who writes it, and what was proved of it.

In: an occurrence, the program, and the standing of tables. Out: a text.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from rcsc.base.diagnostics.source import Source
from rcsc.desk.editor.grid import type_text
from rcsc.desk.editor.names.find import Names, Party
from rcsc.desk.editor.names.index import Occurrence, Space
from rcsc.desk.editor.values import Grid, Standing
from rcsc.lang.leaves import Uses, read_by, spoken_of
from rcsc.lang.model import (
    BEFORE,
    Array,
    Call,
    Declared,
    Enum,
    Int,
    Program,
    Real,
    Record,
    Type,
    key_bounds,
    spell,
    unit_text,
    value_of_key,
)
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr, spell_field, spell_type

MOST = 6
"""Members, writers and the like that are named; then how many more."""


def about(names: Names, name: Occurrence, grids: Mapping[str, Grid]) -> str:
    """Describe a name; return an empty text if nothing is known of it.

    Args:
        names: The files that it stands in.
        name: The occurrence.
        grids: The tables of the file that is open, by name.
    """
    found = names.declarations(name)
    known = (
        _across(names, name)
        if names.party(name) != Party() or name.party
        else _known(names.program, name, grids)
    )
    lines = [*_declared(names, name, found), *known]
    return "\n\n".join(lines)


def _declared(names: Names, name: Occurrence, found: tuple[Occurrence, ...]) -> Iterator[str]:
    """Yield its declaration, with its doc lines."""
    for each in found[:MOST]:
        source = names.sources.get(each.span.file)
        if source is not None:
            yield f"```rcs\n{_head(each, source)}\n```"
        doc = getattr(each.node, "doc", ())
        if doc and each.space is not Space.MEMBER:
            yield " ".join(doc)
    if len(found) > 1:
        yield f"declared in {len(found)} places"
    if not found and name.space is Space.FILE:
        yield f"`{names.file_used(name) or 'no such file'}`"


def _head(name: Occurrence, source: Source) -> str:
    """Return the first line of a declaration, or the description of a member or a field."""
    match name.node:
        case tree.EnumDecl(declared, members) if name.space is Space.MEMBER:
            at = [member.text for member in members].index(name.text)
            return f"{name.text}   # {at + 1} of {len(members)} of enum {declared.text}"
        case tree.Row():
            return f"line {name.text} of table {name.owner}"
        case tree.FieldDecl():
            return spell_field(name.node)
        case tree.Parameter(declared, kind) | tree.Local(declared, kind):
            return f"{declared.text} : {spell_type(kind)}"
        case tree.ConstDecl(declared, value):
            return f"const {declared.text} = {spell_expr(value)}"
        case _:
            line = source.line(source.position(name.span.start).line).strip()
            return line.removesuffix("{").strip()


def _across(names: Names, name: Occurrence) -> Iterator[str]:
    """Yield what is known of a party, or of its variable, in requirements across levels."""
    level = names.party(name).program
    if not name.party:
        yield f"level `{name.text}` of the system"
        return
    yield f"of level `{name.party}`" if level is not None else f"of `{name.party}`, outside the levels"
    if level is not None:
        yield from _known(level, replace(name, party=""), {})
        return
    record = next(
        (each.type for each in (names.program.declared if names.program else ()) if each.name == name.party),
        None,
    )
    for part in record.fields if isinstance(record, Record) else ():
        if part.name == name.text:
            yield _range(part.type)


def _known(program: Program | None, name: Occurrence, grids: Mapping[str, Grid]) -> Iterator[str]:
    if program is None:
        yield "_the program is not in order: types and proofs are not known_"
        return
    if name.space in {Space.VALUE, Space.MEMBER}:
        declared = next((each for each in program.declared if each.name == name.text), None)
        if declared is not None:
            yield from _variable(program, declared)
    elif name.space is Space.TABLE and name.text in grids:
        yield _table(grids[name.text])
    elif name.space is Space.LINE and name.owner in grids:
        yield from _line(grids[name.owner], name.text)
    elif name.space is Space.CALL:
        yield from _procedure(program, name.text)
    elif name.space is Space.CLAIM:
        yield from _claim(program, name.text)
    elif name.space is Space.TYPE:
        kind = next((each for each in program.types if each.name == name.text), None)
        if kind is not None:
            yield _range(kind)


def _variable(program: Program, declared: Declared) -> Iterator[str]:
    yield f"{declared.kind.value}, {_range(declared.type)}"
    leaves = set(map(str, declared.leaves))
    writers = list(_writers(program, leaves))
    if declared.kind.value == "input":
        yield "written by the neighbour or the plant; a value outside its range is not let in"
    elif writers:
        yield f"written by {_listed(writers)}"
    else:
        yield "nobody writes it"
    claims = [
        f"`{each.name}` (invariant)"
        for each in program.invariants
        if leaves & set(map(str, read_by(each.condition)))
    ]
    claims += [
        f"`{each.name}` ({each.standing.value})"
        for each in program.assumptions
        if leaves & set(map(str, read_by(each.condition)))
    ]
    claims += [
        f"`{each.name}` (assumed over time)"
        for each in program.environment
        if leaves & {leaf.removeprefix(BEFORE) for leaf in spoken_of(each)}
    ]
    if claims:
        yield f"what is said of it: {_listed(claims)}"


def _writers(program: Program, leaves: set[str]) -> Iterator[str]:
    """Yield procedures that write a leaf themselves, and tables with the lines that do."""
    users: dict[str, list[str]] = {}
    for leaf, by in Uses(program).written.items():
        for name, lines in by.items() if leaf in leaves else ():
            users[name] = list(dict.fromkeys((*users.get(name, ()), *lines)))
    for name, lines in users.items():
        sort, _, own = name.partition(" ")
        place = f" in {_listed([f'`{line}`' for line in lines])}" if lines else ""
        yield f"{'' if sort == 'procedure' else f'{sort} '}`{own}`{place}"


def _range(kind: Type) -> str:
    """Return the type, with its range or its members."""
    match kind:
        case Enum(name, members):
            return f"`{name}`, one of {_listed([f'`{member}`' for member in members])}"
        case Int() | Real():
            low, high = (spell(kind, value_of_key(kind, key)) for key in key_bounds(kind))
            unit = unit_text(kind.unit)
            return f"`{type_text(kind).partition(' ')[0]}` from {low} to {high}{f' {unit}' if unit else ', no unit'}"
        case Record(name, fields):
            parts = [f"`{each.name} : {type_text(each.type)}`" for each in fields]
            return f"record `{name}` of {_listed(parts)}"
        case Array(length, element):
            return f"{length} of {_range(element)}"
        case _:
            return f"`{type_text(kind)}`"


def _table(grid: Grid) -> str:
    return f"{len(grid.rows)} lines, {said(grid.standing)}"


def _line(grid: Grid, name: str) -> Iterator[str]:
    row = next((each for each in grid.rows if each.name == name), None)
    if row is not None and row.share is not None:
        yield f"matches {share_text(*row.share)} of the inputs"
    yield f"table `{grid.name}` {said(grid.standing)}"


def said(standing: Standing) -> str:
    """Return a standing as a sentence."""
    return f"**{standing.state.value}**: {standing.why}"


def share_text(count: int, whole: int) -> str:
    """Return a share of the inputs in percent, three digits; never 0 % for what is possible, nor 100 % for less than all.

    >>> share_text(1, 4), share_text(0, 4), share_text(1, 10**9), share_text(10**9 - 1, 10**9)
    ('25 %', '0 %', '< 0.001 %', '> 99.9 %')
    """
    percent = 100 * count / whole
    if 0 < percent < 0.001:
        return "< 0.001 %"
    if count < whole and percent >= 99.95:
        return "> 99.9 %"
    return f"{percent:.3g} %"


def _procedure(program: Program, name: str) -> Iterator[str]:
    procedure = next((each for each in program.procedures if each.name == name), None)
    if procedure is None:
        return
    for word, leaves in (("reads", procedure.reads), ("writes", procedure.writes)):
        if leaves:
            yield f"{word} {_listed([f'`{leaf}`' for leaf in leaves])}"
    run = [f"table `{table.name}`" for table in program.tables if _runs(table.every_line, name)]
    if run:
        yield f"run by {_listed(run)}"


def _runs(lines: object, name: str) -> bool:
    assert isinstance(lines, tuple)
    return any(
        isinstance(action.statement, Call) and action.statement.procedure == name
        for line in lines
        for action in line.actions
    )


def _claim(program: Program, name: str) -> Iterator[str]:
    for assumption in program.assumptions:
        if assumption.name == name:
            users = [f"`{table.name}`" for table in program.tables if assumption.name in table.assumptions]
            yield f"assumption, {assumption.standing.value}" + (
                f"; tables that rest on it: {_listed(users)}" if users else ""
            )
    for each in program.environment:
        if each.name == name:
            watched = ", and watched by every run" if each.monitored else ""
            yield f"assumption over time, of what comes from outside: trusted by `rcsc prove`{watched}"
    if any(invariant.name == name for invariant in program.invariants):
        yield "invariant: true at first and kept by every cycle; proved with the tables, which may rest on it"
    for each in program.properties:
        if each.name == name:
            yield f"{each.word}: proved of the levels together, by `rcsc prove`"


def _listed(words: list[str]) -> str:
    more = f" and {len(words) - MOST} more" if len(words) > MOST else ""
    return ", ".join(words[:MOST]) + more

"""A proved program to a `Plan`: classes, masks and their grouping."""

import os
from dataclasses import replace

from rcsc.code.emit.plan import (
    WORD,
    Coded,
    Cuts,
    Direct,
    Index,
    Matcher,
    Plan,
    PlanLine,
    PlanTable,
    Probe,
    Truth,
    grouped,
)
from rcsc.lang.interval_sets import holds
from rcsc.lang.meaning import checked
from rcsc.lang.model import (
    Bool,
    Box,
    Column,
    Enum,
    Line,
    Program,
    ProvedProgram,
    Real,
    Table,
    Test,
    Variable,
    key_bounds,
    value_of_key,
)

MOST_DIRECT = 256
"""Keys of a leaf up to which each has a mask of its own."""
MOST_CODED = 4096
"""Keys of a leaf up to which its class is looked up; past them it is searched for."""
FEW_CUTS = 2
"""Cuts up to which comparing is cheaper than looking up."""
MOST_GROUPED = 512
"""Combinations of classes up to which leaves share a table of masks of several words."""
FEW_GROUPED = 24
"""The same where a mask is one word: as many rows as a person reads, and no more bytes than one table for each leaf."""


def lower(proved: ProvedProgram, root: str = "", *, defensive: bool = False, prefix: str = "") -> Plan:
    """Make the plan of a proved program; only such a plan is emitted without a mark.

    Args:
        proved: The program that was proved.
        root: The project's folder: files are named as seen from there, so that the same project gives the
            same bytes wherever it stands and from wherever it is compiled; "" leaves their names alone.
        defensive: Whether the executors check their state at the beginning of every cycle.
        prefix: The prefix of file names and C names.
    """
    return replace(_plan(proved.program, root, proved=True), defensive=defensive, prefix=prefix)


def lower_by_force(program: Program, root: str = "") -> Plan:
    """Make the plan of a program that is not proved, to run a finding: its code is marked, and no cell runs it."""
    return _plan(program, root, proved=False)


def _plan(program: Program, root: str, *, proved: bool) -> Plan:
    monitored = checked(program)
    tables = tuple(_table(program, table, monitored, _seen(table.file, root)) for table in program.tables)
    types = dict.fromkeys(one.file for one in program.types)
    places = {file: _place(file, root) for file in types if file}
    declared = dict.fromkeys(
        [p.span.file for p in program.procedures] + [a.span.file for a in program.assumptions]
    )
    files = {file: _seen(file, root) for file in declared if file}
    source = _seen(program.file, root)
    if program.instance is not None:
        source = f"{source} ({program.name})"
    return Plan(program, source, tables, monitored, proved, places=places, files=files)


def _seen(file: str, root: str) -> str:
    """Return the file's name as seen from the folder `root`, with `/`."""
    return (os.path.relpath(file, root) if root else file).replace("\\", "/")


def _place(file: str, root: str) -> str:
    """Return a file's place in the project, without its ending; its name alone where it stands elsewhere."""
    seen = _seen(file, root).removesuffix(".rcs")
    return seen if root and not seen.startswith(("../", "/")) else seen.rpartition("/")[2]


def _table(program: Program, table: Table, monitored: tuple[int, ...], file: str) -> PlanTable:
    alone = sum(other.file == table.file for other in program.tables) == 1
    of, source = ("", file) if alone else (f" of {table.name}", f"{file} table {table.name}")
    lines = [
        PlanLine(
            line.name,
            line.actions,
            f"{file} line {line.name}{of}",
            _conditions(table, line),
            line.requirements,
        )
        for line in table.lines
    ]
    if table.default is not None:
        name, last = table.default.name, table.default
        when = ("no other line matches",)
        lines.append(PlanLine(name, last.actions, f"{file} line {name}{of}", when, last.requirements))
    named = [(place, program.assumptions[at]) for place, at in enumerate(monitored)]
    stops = tuple(place for place, assumption in named if assumption.name in table.stops)
    relied = tuple(
        place
        for place, assumption in named
        if place in stops or (assumption.standing.checked and assumption.name in table.assumptions)
    )
    return PlanTable(table, source, _matcher(program, table), tuple(lines), relied, stops)


def _conditions(table: Table, line: Line) -> tuple[str, ...]:
    """Spell the conditions of a line, heading by heading; a condition under `when` alone."""
    stated = zip(table.columns, line.tests, strict=True)
    conditions = tuple(
        _stated(column, test) for column, test in stated if test is not None and column.written
    )
    others = (("no line above it", line.below), ("the same as", line.same))
    return (*conditions, *(f"{words}: {', '.join(names)}" for words, names in others if names))


def _stated(column: Column, test: Test) -> str:
    """Spell a condition: the heading and the cell; the cell alone under `when`."""
    return test.text if column.subject is None else f"{column.heading} {test.text}"


def _matcher(program: Program, table: Table) -> Matcher:
    variables: dict[str, Variable] = {v.name: v for v in program.variables}
    by_leaf: dict[str, list[tuple[int, Box]]] = {}
    relational: dict[int, tuple[Truth, list[int]]] = {}
    for at, line in enumerate(table.lines):
        for column, test in zip(table.columns, line.tests, strict=True):
            if test is None:
                continue
            if test.box is None:
                truth = Truth(test.condition, _stated(column, test))
                relational.setdefault(id(test), (truth, []))[1].append(at)
            else:
                by_leaf.setdefault(test.variables[0], []).append((at, test.box))
    everyone = (1 << len(table.lines)) - 1
    probes = [
        _leaf_probe(variables[name], by_leaf[name], everyone) for name in table.variables if name in by_leaf
    ]
    for truth, lines in relational.values():  # where it fails, only lines that do not state it are left
        probes.append(Probe(truth, (everyone & ~sum(1 << at for at in set(lines)), everyone)))
    one_word = len(table.lines) <= WORD
    groups = grouped(probes, FEW_GROUPED if one_word else MOST_GROUPED, shifted=one_word)
    return Matcher(len(table.lines), table.default is not None, groups)


def _leaf_probe(variable: Variable, stated: list[tuple[int, Box]], everyone: int) -> Probe:
    """Return the masks of one leaf: for each class the lines whose boxes contain it."""
    low, high = key_bounds(variable.type)
    index: Index
    if not isinstance(variable.type, Real) and (
        isinstance(variable.type, Bool | Enum) or (high - low < MOST_DIRECT and everyone.bit_length() <= WORD)
    ):
        starts = list(range(low, high + 1))
        index = Direct(variable.name, variable.type, low, len(starts))
    else:
        edges = {edge for _, box in stated for first, last in box for edge in (first, last + 1)}
        cuts = sorted(edge for edge in edges if low < edge <= high)
        starts = [low, *cuts]
        if len(cuts) > FEW_CUTS and high - low < MOST_CODED and not isinstance(variable.type, Real):
            ends = [*cuts, high + 1]
            classes = [
                at
                for at, (start, end) in enumerate(zip(starts, ends, strict=True))
                for _ in range(start, end)
            ]
            index = Coded(variable.name, variable.type, low, tuple(classes))
        else:
            index = Cuts(
                variable.name, variable.type, tuple(value_of_key(variable.type, cut) for cut in cuts)
            )
    excluded = [0] * len(starts)
    for at, box in stated:
        bit = 1 << at
        for place, start in enumerate(starts):
            if not holds(box, start):
                excluded[place] |= bit
    return Probe(index, tuple(everyone & ~mask for mask in excluded))

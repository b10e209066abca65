"""Certificates: why a verdict holds, as plain data that `rcsc.proof.certify` re-checks.

In: the tree of a search, or a box table found right by counting. Out: a mapping for JSON, with the
same bytes for the same proof. What procedures, conditions and invariants owe is not in it: the checker derives
that from the program, whose digest is. Nodes stand in preorder:
`["s", form, cut]` a split (first `form <= cut`, then the rest), `["e", [[form, multiplier], ...]]` no
point, `["a", k]` assumption k is false, `["l", i]` line i alone (-1: DEFAULT with at most one line),
`["b", count, parts]` disjoint boxes that fill it, `["z"]` asked of a solver.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import prod
from typing import Any, TypeAlias

from rcsc.lang.interval_sets import boxes_of
from rcsc.lang.leaves import read_by
from rcsc.lang.meaning import digest
from rcsc.lang.model import AssumptionName, Box, Program, Snapshot, Table, TableName, Test, key_bounds
from rcsc.proof.procedures.invariants import assumed_of
from rcsc.proof.table.regions.atoms import Universe
from rcsc.proof.table.regions.partition import MANY, parting
from rcsc.proof.table.regions.region import Counted, Empty, Node, Only, Open, OutsideAssumption, Rests, Split

VERSION = 3
Certificate: TypeAlias = Mapping[str, object]
Shown: TypeAlias = list[Any]
"""A node."""


def box_certificate(program: Program, table: Table) -> Certificate:
    """Make the certificate of a table without relational conditions, proved without assumptions."""
    names = [str(name) for name in table.variables]
    types = program.kinds
    extents = {name: key_bounds(types[name]) for name in names}
    tested = {str(test.variables[0]) for test in _tests(table, extents)}
    count = prod(high - low + 1 for name, (low, high) in extents.items() if name in tested)
    parts = parting(_box_lines(table, extents, names)) if len(table.lines) <= MANY else None
    leaf = ["b", count if must_cover(table) else None, None if parts is None else list(parts)]
    return _certificate(table, names, [[[i, 1]] for i in range(len(names))], [leaf], ())


def tree_certificate(
    table: Table,
    universe: Universe,
    nodes: Sequence[Node],
    assumptions: Sequence[AssumptionName],
) -> Certificate:
    """Make the certificate of a table proved by a tree of regions under `assumptions`."""
    names = [column.name for column in universe.columns]
    forms = [[list(term) for term in form] for form in universe.forms]
    return _certificate(table, names, forms, [_shown(node) for node in nodes], assumptions)


def with_witness(certificate: Certificate, program: Program, table: Table, witness: Snapshot) -> Certificate:
    """Add values to a certificate at which all of the table's assumptions and all invariants hold."""
    read = sorted(
        {name for assumption in assumed_of(program, table) for name in read_by(assumption.condition)}
    )
    return {**certificate, "witness": {name: witness[name] for name in read}}


def program_certificate(program: Program, tables: Iterable[Certificate]) -> Certificate:
    """Join the certificates of a program's tables into one document.

    Args:
        program: The program proved, with the assumptions that stop its tables.
        tables: One certificate a table.
    """
    stops = {table.name: list(table.stops) for table in program.tables}
    return {
        "format": "rcsc-certificate",
        "version": VERSION,
        "program": program.name,
        "meaning": digest(program),
        "tables": [
            {**certificate, "stops": stops[TableName(str(certificate["table"]))]} for certificate in tables
        ],
    }


def must_cover(table: Table) -> bool:
    """Return whether some line must match every input: there is no DEFAULT, or it is declared unreachable."""
    return table.default is None or table.default.unreachable


def _certificate(
    table: Table,
    columns: Sequence[str],
    forms: Sequence[Sequence[Sequence[int]]],
    tree: Sequence[Shown],
    assumptions: Sequence[AssumptionName],
) -> Certificate:
    used = sorted(_used(tree))
    needed = sorted({column for form in used for column, _ in forms[form]})
    number = {form: at for at, form in enumerate(used)}
    place = {column: at for at, column in enumerate(needed)}
    return {
        "table": table.name,
        "assumptions": list(assumptions),
        "columns": [columns[column] for column in needed],
        "forms": [sorted([place[column], k] for column, k in forms[form]) for form in used],
        "tree": [_renumbered(node, number) for node in tree],
    }


def _used(tree: Sequence[Shown]) -> set[int]:
    """Return the forms that nodes name; a certificate has no other."""
    used: set[int] = set()
    for kind, *rest in tree:
        used |= {rest[0]} if kind == "s" else {at for at, _ in rest[0]} if kind == "e" else set()
        used |= set(rest[1] or ()) if kind == "b" else set()
    return used


def _renumbered(node: Shown, number: Mapping[int, int]) -> Shown:
    match node:
        case ["s", form, cut]:
            return ["s", number[form], cut]
        case ["e", multipliers]:
            return ["e", sorted([number[form], k] for form, k in multipliers)]
        case ["b", count, parts]:
            return ["b", count, None if parts is None else [number[form] for form in parts]]
    return node


def _tests(table: Table, extents: Mapping[str, tuple[int, int]]) -> Iterator[Test]:
    """Yield every distinct condition that excludes some values."""
    return (test for test in table.distinct_tests if test.box != (extents[test.variables[0]],))


def _box_lines(
    table: Table, extents: Mapping[str, tuple[int, int]], names: Sequence[str]
) -> list[dict[int, Box]]:
    """Return the lines that can match, as boxes by column."""
    telling = {id(test) for test in _tests(table, extents)}
    lines = []
    for line in table.lines:
        told = boxes_of(test for test in line.tests if id(test) in telling)
        boxes = {names.index(name): box for name, box in told.items()}
        if all(boxes.values()):
            lines.append(boxes)
    return lines


def _shown(node: Node) -> Shown:
    match node:
        case Split(form, cut):
            return ["s", form, cut]
        case Empty(multipliers):
            return ["e", [list(pair) for pair in multipliers]]
        case OutsideAssumption(assumption):
            return ["a", assumption]
        case Only(line):
            return ["l", line]
        case Counted(count, parts):
            return ["b", count, None if parts is None else list(parts)]
        case Rests():
            return ["z"]
        case Open():
            raise ValueError("only a proof has a certificate")

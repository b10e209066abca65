"""Names for terms, what tables may rely on, and a digest of all that a proof depends on.

In: the model. Out: text. Shared by the prover, its certificates and the checker, so that all three
speak of the same thing; no proof rests on it.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from rcsc.lang.leaves import read_by
from rcsc.lang.model import (
    Among,
    Apply,
    Assumption,
    AssumptionName,
    Expr,
    Literal,
    Program,
    Read,
    ReadLocal,
    Select,
    Standing,
    Table,
)

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def spelled(term: Expr) -> str:
    """Return a name for `term` that describes it completely: two terms with one name are one term."""
    match term:
        case Literal(value=value, type=kind):
            return f"{type(kind).__name__.lower()}:{value!r}"
        case Read(name=name):
            return name
        case Apply(op=op, args=args):
            return f"({op.value} {' '.join(map(spelled, args))})"
        case Among(subject=subject, values=values):
            return f"(in {spelled(subject)} {' '.join(map(repr, values))})"
        case ReadLocal() | Select():
            return f"({type(term).__name__} {term!r})"


def relying(program: Program) -> Program:
    """Return the program with its invariants as assumptions of the tables that read any of their leaves."""
    if not program.invariants:
        return program
    assumptions = [
        Assumption(
            AssumptionName(invariant.name),
            Standing.PROVED,
            invariant.condition,
            invariant.doc,
            invariant.span,
        )
        for invariant in program.invariants
    ]
    reads = {assumption.name: set(read_by(assumption.condition)) for assumption in assumptions}

    def of(table: Table) -> Table:
        names = tuple(
            assumption.name
            for assumption in assumptions
            if not reads[assumption.name].isdisjoint(table.variables)
        )
        return replace(table, assumptions=(*table.assumptions, *names)) if names else table

    tables = tuple(of(table) for table in program.tables)
    return replace(program, assumptions=(*program.assumptions, *assumptions), tables=tables)


def with_stops(program: Program, stops: Mapping[str, tuple[AssumptionName, ...]]) -> Program:
    """Return the program, each table with its stopping assumptions (`Table.stops`); a table that is not named gets none."""
    tables = tuple(replace(table, stops=stops.get(table.name, ())) for table in program.tables)
    return replace(program, tables=tables)


def checked(program: Program) -> tuple[int, ...]:
    """Return the positions of the assumptions that the executors check: monitored ones, and those that stop some table."""
    stopping = {name for table in program.tables for name in table.stops}
    return tuple(
        at
        for at, assumption in enumerate(program.assumptions)
        if assumption.standing.checked or assumption.name in stopping
    )


def digest(*meant: object) -> str:
    """Return the SHA-256 (hex) of values of the model: every field that equality looks at, so spans are left out.

    Fields are found by walking the classes, so that one that is added cannot be forgotten.

    Raises:
        TypeError: A part is no value of the model.
    """
    return _Digest().of(meant)


class _Digest:
    """Digests parts first, each object once: tests and lists of leaves are shared by many lines."""

    def __init__(self) -> None:
        self._known: dict[int, str] = {}
        self._kept: list[object] = []  # so that the identity of none is used again
        self._compared: dict[type, tuple[str, ...]] = {}

    def of(self, value: object) -> str:
        known = self._known.get(id(value))
        if known is None:
            known = self._known[id(value)] = hashlib.sha256(self._text(value).encode()).hexdigest()
            self._kept.append(value)
        return known

    def _text(self, value: object) -> str:
        kind = type(value).__name__
        if value is None or isinstance(value, bool | int | float | str):
            return f"{kind} {value.value if isinstance(value, StrEnum) else value!r}"
        if isinstance(value, tuple):
            known = self._known.get
            return f"{kind} {' '.join([known(id(part)) or self.of(part) for part in value])}"
        if is_dataclass(value) and not isinstance(value, type):
            parts = (f"{name} {self.of(getattr(value, name))}" for name in self._fields(type(value)))
            return f"{kind} {' '.join(parts)}"
        raise TypeError(f"{kind} is no value of the model")

    def _fields(self, kind: "type[DataclassInstance]") -> tuple[str, ...]:
        """Return the names of the fields that equality looks at."""
        if kind not in self._compared:
            self._compared[kind] = tuple(attribute.name for attribute in fields(kind) if attribute.compare)
        return self._compared[kind]

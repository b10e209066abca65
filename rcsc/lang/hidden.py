"""Hidden states of two programs, matched by what feeds them: their names follow from the order in which a text asks for them.

In: two programs. Out: the same two, in which a state that the compiler adds (`was_x`, `held_x`) has one name where both feed it with the
same, and two names where they do not. So whoever compares two programs by the names of their leaves compares what these mean.
"""

import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

from rcsc.lang.leaves import free_name
from rcsc.lang.meaning import spelled
from rcsc.lang.model import Declared, Int, Procedure, Program, Scalar, Test, Variable, VariableName

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_Feed: TypeAlias = tuple[str, str]


def fed_with(variable: Variable) -> _Feed | None:
    """Return a complete description of what a hidden state holds; None for any other variable."""
    if variable.previous_of is not None:
        return "was", str(variable.previous_of)
    return None if variable.counts is None else ("for", spelled(variable.counts))


def hidden(program: Program) -> frozenset[str]:
    """Return the states that the compiler adds: values of the cycle before, counters of conditions, and the lines that ran."""
    return frozenset(
        str(variable.name)
        for variable in program.variables
        if fed_with(variable) is not None or variable.line_of is not None
    )


def keeps(program: Program) -> Callable[[str], bool]:
    """Return a test, by name, for the procedure that ends a cycle: it writes hidden states, and no other may."""
    own = hidden(program)
    known = {str(p.name) for p in program.procedures if _keeps(p, own)}
    return known.__contains__


def _keeps(procedure: Procedure, own: frozenset[str]) -> bool:
    return bool(procedure.writes) and own.issuperset(procedure.writes)


def matched(first: Program, second: Program) -> tuple[Program, Program]:
    """Return both programs with hidden states named alike where they are fed alike, by the second's names where it has them."""
    feeds = _fed(first), _fed(second)
    if not feeds[0] and not feeds[1]:
        return first, second
    taken = {str(v.name) for program in (first, second) for v in program.variables if fed_with(v) is None}
    renames: tuple[dict[str, str], dict[str, str]] = ({}, {})
    for feed in dict.fromkeys((*feeds[1], *feeds[0])):
        name = free_name(str(feeds[1].get(feed, feeds[0].get(feed))), taken)
        taken.add(name)
        for own, to in zip(feeds, renames, strict=True):
            if feed in own:
                to[own[feed]] = name
    limits = _limits(first, second)
    one, other = (
        _Named({old: new for old, new in to.items() if old != new}, limits).program(program)
        for program, to in zip((first, second), renames, strict=True)
    )
    return one, other


def _fed(program: Program) -> dict[_Feed, str]:
    return {feed: str(v.name) for v in program.variables if (feed := fed_with(v)) is not None}


def _limits(*programs: Program) -> dict[_Feed, Scalar]:
    """Return the greater limit of each counter in the two programs: below it, both count alike."""
    limits: dict[_Feed, Scalar] = {}
    for program in programs:
        for variable in program.variables:
            feed = fed_with(variable)
            if feed is None or variable.counts is None:
                continue
            assert isinstance(variable.type, Int)
            known = limits.get(feed, variable.type)
            assert isinstance(known, Int)
            limits[feed] = Int(0, max(known.high, variable.type.high))
    return limits


class _Named:
    """One program with other names of leaves; tests that lines share stay shared."""

    def __init__(self, names: Mapping[str, str], limits: Mapping[_Feed, Scalar]) -> None:
        self.names = names
        self.limits = limits
        self.tests: dict[int, Test] = {}
        self.fields: dict[type, tuple[tuple[str, bool], ...]] = {}

    def program(self, program: Program) -> Program:
        variables = tuple(self._variable(variable) for variable in program.variables)
        if not self.names:
            return program if variables == program.variables else replace(program, variables=variables)
        parts = {
            name: self._any(getattr(program, name), leaf=leaf)
            for name, leaf in _leaf_fields(Program)
            if name not in {"variables", "declared"}
        }
        declared = tuple(map(self._declared, program.declared))
        return replace(program, variables=tuple(map(self._any, variables)), declared=declared, **parts)

    def _declared(self, declared: Declared) -> Declared:
        first = str(declared.leaves[0]) if declared.leaves else ""
        if first not in self.names:
            return declared
        leaves = tuple(VariableName(self.names.get(str(leaf), str(leaf))) for leaf in declared.leaves)
        return replace(declared, name=self.names[first].partition("[")[0], leaves=leaves)

    def _variable(self, variable: Variable) -> Variable:
        feed = fed_with(variable)
        return (
            variable if feed is None or feed not in self.limits else replace(variable, type=self.limits[feed])
        )

    def _any(self, value: Any, *, leaf: bool = False) -> Any:
        """Rename leaves in any part of the model; with `leaf`, its strings are names of leaves."""
        if isinstance(value, str):
            return self.names.get(value, value) if leaf else value
        if isinstance(value, tuple):
            return tuple(self._any(part, leaf=leaf) for part in value)
        if not is_dataclass(value) or isinstance(value, type):
            return value
        if not isinstance(value, Test):
            return self._changed(value)
        if id(value) not in self.tests:
            self.tests[id(value)] = self._changed(value)
        return self.tests[id(value)]

    def _changed(self, value: Any) -> Any:
        kind = type(value)
        if kind not in self.fields:
            self.fields[kind] = _leaf_fields(kind)
        parts = {name: self._any(getattr(value, name), leaf=leaf) for name, leaf in self.fields[kind]}
        return replace(value, **parts)


def _leaf_fields(kind: "type[DataclassInstance]") -> tuple[tuple[str, bool], ...]:
    """Return the fields of a class of the model, and whether each is declared to hold names of leaves."""
    hints = typing.get_type_hints(kind)
    return tuple(
        (field.name, VariableName in _within(hints[field.name])) for field in fields(kind) if field.init
    )


def _within(hint: Any) -> Iterator[Any]:
    waiting: list[Any] = [hint]
    while waiting:
        part = waiting.pop()
        yield part
        waiting += typing.get_args(part)

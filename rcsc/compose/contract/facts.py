"""Declared assumptions about what other levels of the system write: owed by these, never trusted.

In: the links of all levels, their programs. Out: the links with what each level is given and what it owes; and which assumptions that are
declared *assumed* are about what stands outside the levels, and are trusted.

A reader may see a buffer late, twice or never, but always as it was published, or as it was before the first time. So an assumption about
one buffer alone holds of all that is read if it holds of all that is published, and of the values with which both ends begin: its writer
owes it (`Sort.OWED`). Two buffers hold values of different times, and what the reader keeps is of an earlier one: no writer could keep an
assumption that relates them. It is the reader's to prove, as one about state alone is.

An assumption that also speaks of what stands outside is trusted where that alone can keep it: where some values from outside make it
true, whatever the levels do. Example: `new_command implies not there` says something of `there`.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from itertools import product
from math import prod

from rcsc.compose.contract.environment import Given, Links, Owed
from rcsc.lang.leaves import is_part, parts, read_by, renamed
from rcsc.lang.model import (
    Assumption,
    Bool,
    Enum,
    Expr,
    Kind,
    Level,
    Literal,
    Program,
    Scalar,
    Value,
    VariableName,
    key_bounds,
    key_of,
    value_of_key,
)

MOST_TRIED = 64
"""Values from outside that are tried for an assumption."""


def believed(program: Program, level: Level) -> list[Assumption]:
    """List the assumptions that are declared as assumed, of tables that the level runs."""
    used = {name for table in program.tables if table.name in level.table_names for name in table.assumptions}
    return [one for one in program.assumptions if one.standing.believed and one.name in used]


def with_facts(every: Mapping[str, Links], programs: Mapping[str, Program]) -> dict[str, Links]:
    """Return the links of all levels with the facts that each is given and owes."""
    given = {
        name: tuple(_given(links, programs[name], level))
        for name, links in every.items()
        for level in programs[name].levels
        if level.name == name
    }
    return {
        name: replace(links, given=given.get(name, ()), owes=tuple(_owed(name, every, given)))
        for name, links in every.items()
    }


def _given(links: Links, program: Program, level: Level) -> Iterator[Given]:
    """Yield the level's assumptions about just one buffer, which another level writes."""
    kinds = {str(variable.name): variable.kind for variable in program.variables}
    for assumption in believed(program, level):
        read = [str(name) for name in read_by(assumption.condition)]
        ends = {links.written_as(leaf) if kinds[leaf] is Kind.INPUT else None for leaf in read}
        if len(ends) == 1 and (end := ends.pop()) is not None:
            yield Given(str(assumption.name), end[0], end[1], assumption.condition)


def _owed(writer: str, every: Mapping[str, Links], given: Mapping[str, tuple[Given, ...]]) -> Iterator[Owed]:
    """Yield the assumptions of other levels about this one's outputs, over its own leaves."""
    for reader, facts in given.items():
        for fact in facts:
            end = every[reader].written_as(fact.record)
            if end is not None and end[1] == writer:
                yield Owed(f"{reader}.{fact.name}", at_the_writer(fact.condition, end[0], end[2]))


def at_the_writer(condition: Expr, record: str, output: str) -> Expr:
    """Return a condition on an input as one on the output that a buffer fills it with."""

    def other(name: VariableName) -> VariableName:
        return VariableName(output + name.removeprefix(record)) if is_part(name, record) else name

    return renamed(condition, other)


# --- what stands outside ------------------------------------------------------------------------


def outside_values(condition: Expr, kinds: Mapping[str, Scalar]) -> Iterator[dict[str, Value]]:
    """Yield values of these leaves that may make the condition true; none where they are too many to try."""
    told = {part.value for part in parts(condition) if isinstance(part, Literal)}
    choices = {name: values_near(kind, told) for name, kind in kinds.items()}
    if prod(map(len, choices.values())) <= MOST_TRIED:
        for chosen in product(*choices.values()):
            yield dict(zip(choices, chosen, strict=True))


def values_near(kind: Scalar, told: Collection[Value]) -> list[Value]:
    """List all values of a type, or its ends and those by the constants of a condition."""
    low, high = key_bounds(kind)
    if isinstance(kind, Bool | Enum):
        return [value_of_key(kind, key) for key in range(low, high + 1)]
    near = {low, high}
    for value in told:
        if not isinstance(value, bool) and low <= (key := key_of(kind, value)) <= high:
            near |= {key - 1, key, key + 1}
    return [value_of_key(kind, key) for key in sorted(near) if low <= key <= high]

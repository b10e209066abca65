"""A level while it keeps a command: the cycles of one table, in as few variables as there are.

In: a transition system, what was confirmed of it, one of its tables. Out: a `Confirmation` about the cycles that take the same order as
the cycle before and run this table, and such cycles in a row. Nothing is left out: under the same number the fields that the superior
numbers are the same by the contract, so that one variable stands for them before a cycle and in it; and if one command alone selects the
table, it is a constant. So other tables vanish from the terms, and a question is as large as its own table.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from rcsc.compose.contract.transition import Cycle, Leaves, TransitionSystem
from rcsc.compose.invariant.confirm import Confirmation
from rcsc.lang.model import OneTable, Read
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import Keyed
from rcsc.proof.symbolic.values import Node


def while_it_stays(ts: TransitionSystem, asked: Confirmation, table: str) -> Confirmation:
    """Return the same questions about the cycles that keep the command and run the table."""
    before = ts.havoc() | _selecting(ts, table)
    cycle = ts.cycle(before, taken=_taken(ts, before, {}, " taken"))
    return replace(asked, cycle=cycle, cases=cycle.cases, keyed=Keyed())


def in_a_row(
    ts: TransitionSystem, first: Cycle, phase: Sequence[str], still: Mapping[str, Node]
) -> list[Cycle]:
    """Return three cycles in a row, from one that keeps the command, in which these leaves keep their values.

    Args:
        ts: The level.
        first: The first of the three.
        phase: Leaves that each cycle is asked to leave unchanged; the next one begins with their first values.
        still: The inputs that are the same in all three, as the first takes them.
    """
    row = [first]
    for suffix in (" second", " third"):
        before = row[-1].after | {leaf: first.before[leaf] for leaf in phase}
        row.append(ts.cycle(before, suffix, taken=_taken(ts, before, still, suffix)))
    return row


def _taken(ts: TransitionSystem, before: Leaves, still: Mapping[str, Node], suffix: str) -> Leaves:
    """Return the inputs of a cycle that keeps the command: numbered fields of the order are unchanged, all others are free."""
    above = ts.links.above
    assert above is not None
    same = {leaf: before[leaf] for leaf in (above.number, *above.numbered)}
    free = {leaf: values.variable(f"{leaf}{suffix}", ts.kinds[leaf]) for leaf in ts.inputs}
    return free | dict(still) | same


def _selecting(ts: TransitionSystem, table: str) -> Leaves:
    """Return the command that selects the table, if it is the only one; nothing if several do, or something else does."""
    above, chosen = ts.links.above, ts.level.tables
    assert above is not None
    if isinstance(chosen, OneTable) or not isinstance(chosen.selector, Read):
        return {}
    leaf, members = str(chosen.selector.name), [value for value, name in chosen.tables if name == table]
    if leaf not in above.numbered or len(members) != 1:
        return {}
    return {leaf: values.constant(ts.kinds[leaf], members[0])}

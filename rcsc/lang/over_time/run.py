"""A monitor over a run, a cycle at a time.

In: a monitor, its states, and the leaves before and after a cycle. Out: its states after it, and whether the cycle keeps the requirement.
A property has no monitor: each cycle keeps it or not, whatever came before.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rcsc.lang.interpret import UNDEFINED, evaluate, holds
from rcsc.lang.model import Assign, Expr, If, Monitor, Property, Snapshot, Statement, ToLeaf, Value, earlier


def begun(monitor: Monitor) -> dict[str, Value]:
    """Return the states of a monitor before the first cycle, and where the level begins anew."""
    return {str(state.name): state.initial for state in monitor.states}


def stepped(
    monitor: Monitor, kept: Expr, state: Mapping[str, Value], before: Snapshot, after: Snapshot
) -> tuple[dict[str, Value], bool]:
    """Return the states after a cycle, and whether it keeps the requirement; it does not where a condition is not defined.

    Args:
        monitor: The monitor.
        kept: The condition that a cycle keeps the requirement.
        state: The monitor's states before the cycle.
        before: The leaves after the cycle before; only those are needed at which the requirement looks back.
        after: The leaves after the cycle, inputs as it took them.
    """
    now: dict[str, Value] = {**after, **state}
    now |= {str(earlier(name)): value for name, value in {**before, **state}.items()}
    now[str(monitor.defined)] = True
    for name, truth in monitor.truths:
        try:
            now[str(name)] = holds(truth, now)
        except UNDEFINED:
            now[str(name)] = now[str(monitor.defined)] = False
    _run(monitor.statements, now)
    return {name: now[name] for name in state}, holds(kept, now)


def _run(statements: Iterable[Statement], now: dict[str, Value]) -> None:
    """Run the statements of a monitor, which are assignments of states and choices."""
    for statement in statements:
        if isinstance(statement, If):
            _run(statement.then if holds(statement.condition, now) else statement.orelse, now)
        else:
            assert isinstance(statement, Assign)
            assert isinstance(statement.place, ToLeaf)
            now[str(statement.place.name)] = evaluate(statement.value, now)


@dataclass(slots=True)
class Watch:
    """A requirement, or a property, that is watched as a run goes on.

    Attributes:
        state: The states of its monitor.
    """

    stated: Property
    state: dict[str, Value] = field(init=False)

    def __post_init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Begin anew, before a first cycle."""
        self.state = {} if self.stated.monitor is None else begun(self.stated.monitor)

    def keeps(self, before: Snapshot, after: Snapshot) -> bool:
        """Take a cycle, of which these are the leaves before and after; return whether it keeps the requirement."""
        if self.stated.monitor is None:
            return _holds(self.stated.condition, before, after)
        self.state, kept = stepped(self.stated.monitor, self.stated.condition, self.state, before, after)
        return kept


def _holds(condition: Expr, before: Snapshot, after: Snapshot) -> bool:
    """Return whether a condition on a cycle and the one before it is defined and true."""
    try:
        return holds(condition, {**after, **{str(earlier(name)): value for name, value in before.items()}})
    except UNDEFINED:
        return False

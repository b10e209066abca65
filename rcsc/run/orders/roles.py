"""Which buffers carry numbered orders and the reports on them, and which of their fields say what.

In: a description and the signatures of its levels. Out: a `Served` for each level that somebody orders. A program
that declares whom it serves says which records these are, and which members mean rest, done and failed. Of any other the
names say it (Haynes et al. 1984, section 9): an order has `inc_command` and `input_command`, a report `inc_command_echo`,
`ref_command_echo` and `status_report`; the first command rests. Scripts know them only here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.lang.restart import COMMAND, ECHO, ECHOED, NUMBER, STATUS
from rcsc.run.description import Description
from rcsc.run.signature import Leaf, Serves, Signature, Value

DONE, FAILED = "done", "failed"
"""What members of the status mean, by name."""


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A level, or something outside the system, with which orders and reports are exchanged.

    Attributes:
        name: Its name.
        order: The record of this level that carries orders; `report`, the one that carries reports on them.
        outside: Whether it stands outside the levels.
        done, failed: The statuses that answer a command.
    """

    name: str
    order: str
    report: str
    outside: bool
    done: str = field(default=DONE, kw_only=True)
    failed: str = field(default=FAILED, kw_only=True)

    @property
    def number(self) -> str:
        """The leaf with the number of the order."""
        return f"{self.order}.{NUMBER}"

    @property
    def command(self) -> str:
        """The leaf with the command that is ordered."""
        return f"{self.order}.{COMMAND}"

    @property
    def echo(self) -> str:
        """The leaf with the number that is reported about."""
        return f"{self.report}.{ECHO}"

    @property
    def echoed(self) -> str:
        """The leaf with the command that is reported about."""
        return f"{self.report}.{ECHOED}"

    @property
    def status(self) -> str:
        """The leaf with the reported status."""
        return f"{self.report}.{STATUS}"


@dataclass(frozen=True, slots=True)
class Served:
    """A level that takes numbered orders.

    Attributes:
        level: Its name.
        party: Who orders it: another level, or somebody outside.
        order: The buffer of orders; `report` that of reports.
        order_leaves: The fields of an order, in the buffer's order; `report_leaves` those of a report.
        number: Where an order has its number; `command` its command.
        echo: Where a report repeats the number; `status` what has become of the order.
        rest: The command that rests.
        done, failed: The statuses that answer an order.
    """

    level: str
    party: str
    order: str
    report: str
    order_leaves: tuple[Leaf, ...]
    report_leaves: tuple[Leaf, ...]
    number: int
    command: int
    echo: int
    status: int
    rest: Value = 0
    done: str = DONE
    failed: str = FAILED

    @property
    def fields(self) -> dict[str, Leaf]:
        """The fields of an order but its number, by name, in the buffer's order."""
        return {field_of(leaf): leaf for place, leaf in enumerate(self.order_leaves) if place != self.number}

    def order_with(self, given: Mapping[str, Value]) -> tuple[Value, ...]:
        """Return the fields of an order but its number; a field that is not given has its variable's initial value."""
        return tuple(given.get(name, leaf.initial) for name, leaf in self.fields.items())


def served(system: Description, signs: Mapping[str, Signature]) -> tuple[Served, ...]:
    """Find the levels that a party outside orders by number and to which they report, from the top down."""
    return tuple(level for level in ordered(system, signs) if level.party not in signs)


def ordered(system: Description, signs: Mapping[str, Signature]) -> tuple[Served, ...]:
    """Find the levels that take numbered orders, from a level above or from outside, from the top down."""
    wires = [(wire.source, wire.target) for wire in system.wires]
    levels = []
    for source, target in wires:
        party, (level, _, variable) = _owner(source), target.partition(".")
        if level not in signs:
            continue
        role, order = signs[level].serves, _leaves(signs[level], variable)
        if not _has(order, NUMBER, COMMAND) or (role is not None and variable != role.order):
            continue
        for back, to in wires:
            report = _leaves(signs[level], back.partition(".")[2]) if _owner(back) == level else ()
            if _owner(to) == party and _has(report, ECHO, STATUS):
                places = (
                    _place(order, NUMBER),
                    _place(order, COMMAND),
                    _place(report, ECHO),
                    _place(report, STATUS),
                )
                levels.append(
                    Served(level, party, source, back, order, report, *places, *_words(role, order))
                )
                break
    names = list(signs)
    return tuple(sorted(levels, key=lambda served_level: names.index(served_level.level)))


def _words(role: Serves | None, order: Sequence[Leaf]) -> tuple[Value, str, str]:
    """Return the command that rests, and the statuses that mean done and failed."""
    if role is None:
        return 0, DONE, FAILED
    return order[_place(order, COMMAND)].members.index(role.rest), role.done, role.failed


def field_of(leaf: Leaf) -> str:
    """Return the name of a leaf in its record: `command.target_mm` is `target_mm`. A variable of its own keeps its whole name."""
    return leaf.name.partition(".")[2] or leaf.name


def _leaves(sign: Signature, variable: str) -> tuple[Leaf, ...]:
    try:
        return sign.leaves_of(variable)
    except KeyError:
        return ()


def _has(leaves: Sequence[Leaf], *fields: str) -> bool:
    names = {field_of(leaf) for leaf in leaves}
    return all(field in names for field in fields)


def _place(leaves: Sequence[Leaf], field: str) -> int:
    return next(at for at, leaf in enumerate(leaves) if field_of(leaf) == field)


def _owner(end: str) -> str:
    return end.partition(".")[0]

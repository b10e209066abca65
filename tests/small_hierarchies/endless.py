"""Runs of a level in which a command goes on for ever: looked for among every state that it can reach.

In: a role, its states. Out: why a table's command need not end, or nothing. Written anew, to hold `rcsc.compose.proof.termination`
against it. A command goes on for ever where states can be gone round under one number, with another status than *done* or *failed*
reported on the way (of PAUSE another than *done*), and either an order is given on the way, so that there is always another one to be
answered, or every cycle is quiet: all orders are answered, and none is given. Cycles that end early come finitely often.
"""

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

from rcsc.compose.contract.environment import Below
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Enum, Value
from tests.small_hierarchies.explored import successors
from tests.small_hierarchies.level import Ran, Role, State
from tests.small_hierarchies.world import canonical

Place = TypeVar("Place", bound=Hashable)
ECHOED = ("inc_command", "inc_command_echo", "ref_command_echo", "status_report")


@dataclass(frozen=True, slots=True)
class Edge:
    """A cycle in which the command is the same.

    Attributes:
        unanswered: It reports neither *done* nor *failed*, or of PAUSE anything but *done*.
        orders: It gives an order; `quiet`, all are answered and none is given.
        values: What it read, echoes and statuses apart.
    """

    start: State
    end: State
    table: str
    orders: bool
    quiet: bool
    values: tuple[tuple[str, Value], ...]
    unanswered: bool = True


def edges(role: Role, seen: set[State]) -> list[Edge]:
    """Every cycle from these states in which the command is the same; whoever reports to nobody has none."""
    above = role.links.above
    if above is None:
        return []
    found = []
    statuses = {f"{below.report}.status_report" for below in role.links.below}
    varied = statuses | {leaf for leaf in role.inputs if leaf.partition(".")[2] not in ECHOED}
    for state in seen:
        before = dict(zip(role.start, state, strict=True))
        for taken, ran in successors(role, before, also=frozenset(varied)):
            same = taken[f"{above.order}.inc_command"] == before[f"{above.order}.inc_command"]
            if ran.fault is Fault.OK and same:
                found.append(_edge(role, state, before, taken, ran))
    return found


def _edge(role: Role, state: State, before: dict[str, Value], taken: dict[str, Value], ran: Ran) -> Edge:
    sent = [f"{below.order}.inc_command" for below in role.links.below]
    orders = any(ran.after[leaf] != before[leaf] for leaf in sent)
    answered = all(_answered(role, below, before, taken) for below in role.links.below)
    read = tuple((leaf, taken[leaf]) for leaf in role.inputs if leaf.partition(".")[2] not in ECHOED)
    end = tuple(canonical(role, ran.after).values())
    return Edge(state, end, ran.table, orders, answered and not orders, read, _unanswered(role, taken, ran))


def _unanswered(role: Role, taken: Mapping[str, Value], ran: Ran) -> bool:
    above = role.links.above
    assert above is not None
    pause = taken[f"{above.order}.input_command"] == 0
    return not _ended(role, ran.after, f"{above.report}.status_report", pause=pause)


def _answered(role: Role, below: Below, before: Mapping[str, Value], taken: Mapping[str, Value]) -> bool:
    """The last order is echoed, and ended: PAUSE by *done* alone."""
    said = f"{below.report}.status_report"
    if taken[f"{below.report}.inc_command_echo"] != before[f"{below.order}.inc_command"]:
        return False
    return _ended(role, taken, said, pause=before[f"{below.order}.input_command"] == 0)


def _ended(role: Role, now: Mapping[str, Value], leaf: str, *, pause: bool) -> bool:
    return _says(role, now, leaf, "done") or (not pause and _says(role, now, leaf, "failed"))


def _says(role: Role, now: Mapping[str, Value], leaf: str, member: str) -> bool:
    kind = role.program.variable(leaf).type
    assert isinstance(kind, Enum)
    return now[leaf] == kind.members.index(member)


def endless(every: list[Edge], table: str, still: tuple[str, ...]) -> str:
    """How a command that runs the table may go on for ever while these inputs keep their values; blank where it may not.

    The table may take turns with others.
    """
    for some in _apart(every, still):
        quiet, round_ = _round([edge for edge in some if edge.quiet]), _round(some)
        if any(edge.table == table and edge.unanswered for edge, _ in quiet):
            return "round in quiet cycles"
        ordering = {part for edge, part in round_ if edge.orders}
        if any(edge.table == table and edge.unanswered and part in ordering for edge, part in round_):
            return "order after order"
    return ""


def _apart(every: list[Edge], still: tuple[str, ...]) -> Iterator[list[Edge]]:
    """The edges by what the inputs are that keep their values."""
    groups: dict[tuple[tuple[str, Value], ...], list[Edge]] = {}
    for edge in every:
        kept = tuple((leaf, value) for leaf, value in edge.values if leaf.partition(".")[0] in still)
        groups.setdefault(kept, []).append(edge)
    yield from groups.values()


def _round(some: list[Edge]) -> list[tuple[Edge, int]]:
    """The edges that lead round, each with a number for the states that lead to one another."""
    part = parts((edge.start, edge.end) for edge in some)
    return [(edge, part[edge.start]) for edge in some if part[edge.start] == part[edge.end]]


def parts(pairs: Iterable[tuple[Place, Place]]) -> dict[Place, int]:
    """A number for each place from or to which a step leads; the same where two lead to one another (Kosaraju)."""
    onward: dict[Place, list[Place]] = {}
    back: dict[Place, list[Place]] = {}
    for start, end in pairs:
        onward.setdefault(start, []).append(end)
        back.setdefault(end, []).append(start)
    part: dict[Place, int] = {}
    for place in reversed(_left(onward)):
        waiting = [] if place in part else [place]
        number = len(part)
        while waiting:
            here = waiting.pop()
            if here not in part:
                part[here] = number
                waiting += back.get(here, [])
    return part


def _left(onward: Mapping[Place, list[Place]]) -> list[Place]:
    """Every place, in the order in which a search that goes deep first leaves them."""
    seen: set[Place] = set()
    order: list[Place] = []
    for start in onward:
        waiting = [(start, False)]
        while waiting:
            place, done = waiting.pop()
            if done:
                order.append(place)
            elif place not in seen:
                seen.add(place)
                waiting.append((place, True))
                waiting += [(one, False) for one in onward.get(place, ()) if one not in seen]
    return order

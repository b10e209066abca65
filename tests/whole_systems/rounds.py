"""Commands of a whole system that go on for ever: rounds through states in which every level runs, and everything is seen.

In: a system, some of its states. Out: whether a command that a table runs need not end.
"""

from collections.abc import Iterator

from tests.small_hierarchies.endless import parts
from tests.whole_systems.part import Event
from tests.whole_systems.whole import Now, Searched, Step, Whole, steps

ROUNDS, ROUND = 4, 160
"""From so many states it is looked for what may go on for ever, each time among so many."""


def goes_on(
    whole: Whole, found: Searched, level: int, table: str, still: frozenset[str], rank: int, again: int
) -> bool:
    """Whether a command that runs the table may go on for ever: round through states in which every level runs and everything is seen.

    The order of the level is the same all the while, nobody begins anew, and what stands still does. States
    are reached by events of a rank of at most `rank`, and gone round by those of at most `again`.
    """
    begun = [
        step.end
        for step in found.steps
        if step.level == level
        and step.move is not None
        and step.move.table == table
        and step.move.unanswered
        and found.ranks[step.end] <= rank
    ]
    for at in range(0, len(begun), max(1, len(begun) // ROUNDS)):
        within = _quiet(whole, found.states[begun[at]], level, again)
        for mine, others in _apart(within.steps, level, still):
            if any(_fair(whole, within, some, level, table) for some in _rounds([*others, *mine])):
                return True
    return False


def _quiet(whole: Whole, start: Now, level: int, rank: int) -> Searched:
    """What follows a state while nobody begins anew, and orders from outside, and that of the level, are the same."""
    found, number = Searched(), dict[tuple[object, ...], int]()

    def state(now: Now) -> int:
        named = whole.named(now)
        at = number.setdefault(named.key, len(found.states))
        if at == len(found.states):
            found.states.append(named)
        return at

    state(start)
    here = 0
    while here < len(found.states) and here < ROUND:
        for event, one, wire, move, after in steps(whole, found.states[here]):
            if event is Event.ANEW or event.rank > rank or after is None:
                continue
            kept = one == level or bool(one >= 0 and whole.parts[one].ordered_from_outside)
            if move is None or move.same or not kept:
                found.steps.append(Step(here, state(after), one, wire, move))
        here += 1
    return found


def _apart(every: list[Step], level: int, still: frozenset[str]) -> Iterator[tuple[list[Step], list[Step]]]:
    """The steps of a level, by what the inputs are that keep their values, each time with all others' steps."""
    groups: dict[object, list[Step]] = {}
    others: list[Step] = []
    for step in every:
        if step.move is None or step.level != level:
            others.append(step)
            continue
        kept = tuple((leaf, value) for leaf, value in step.move.outside if leaf.partition(".")[0] in still)
        groups.setdefault(kept, []).append(step)
    yield from ((mine, others) for mine in groups.values())


def _fair(whole: Whole, found: Searched, some: list[Step], level: int, table: str) -> bool:
    if not any(
        step.level == level and step.move is not None and step.move.table == table and step.move.unanswered
        for step in some
    ):
        return False
    ran = {step.level for step in some}
    if not ran >= set(range(len(whole.parts))):
        return False
    delivered = {step.wire for step in some if step.wire >= 0}
    states = {step.start for step in some}
    return all(
        wire.at_once
        or at in delivered
        or any(found.states[s].stands[at] in {None, found.states[s].seen[at]} for s in states)
        for at, wire in enumerate(whole.wires)
    )


def _rounds(every: list[Step]) -> Iterator[list[Step]]:
    """The steps within each set of states that lead to one another."""
    part = parts((step.start, step.end) for step in every)
    within: dict[int, list[Step]] = {}
    for step in every:
        if part[step.start] == part[step.end]:
            within.setdefault(part[step.start], []).append(step)
    yield from within.values()

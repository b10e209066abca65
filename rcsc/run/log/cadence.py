"""Whether the records of a log are those of a run: of each level all cycles that its period has, and no others.

In: the ticks of each level's records, and of its restarts. Out: nothing, or why they are none that rcsc recorded. The chain tells damage;
this tells what a chain that was made anew does not: rows that are missing.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence


def check_named(described: Sequence[str], recorded: Collection[str]) -> None:
    """See that the levels that are described are those that are recorded, each once.

    Raises:
        ValueError: They are not.
    """
    if sorted(described) != sorted(recorded):
        raise ValueError("the levels that it describes are not those that it records")


def check_cycles(cycles: Mapping[str, tuple[Sequence[int], int]], tick_ms: int, *, whole: bool) -> None:
    """See that each level has its cycles.

    Args:
        cycles: For each level the ticks of its records, the first that of the state it started from, and its period in ms.
        tick_ms: Length of a tick.
        whole: Whether the log has its end; else each may end anywhere.

    Raises:
        ValueError: One begins with another tick than the others, lacks a cycle, or has one that its period has not.
    """
    check_begun(ticks for ticks, _ in cycles.values())
    last = max(ticks[-1] for ticks, _ in cycles.values())
    for name, (ticks, period_ms) in cycles.items():
        if period_ms % tick_ms:
            raise ValueError(f"level `{name}` has a period of {period_ms} ms, in ticks of {tick_ms} ms")
        step, begun = period_ms // tick_ms, ticks[0]
        due = range(begun + 1 + -begun % step, (last if whole else ticks[-1]) + 1, step)
        if len(due) != len(ticks) - 1 or any(map(int.__ne__, due, ticks[1:])):
            had = set(ticks[1:])
            at = next((tick for tick in due if tick not in had), None)
            wrong = (
                f"has no cycle in tick {at}" if at is not None else "has a cycle between those of its period"
            )
            raise ValueError(f"level `{name}` {wrong}")


def check_begun(all_ticks: Iterable[Sequence[int]]) -> None:
    """See that the recording of all levels began in one tick.

    Raises:
        ValueError: It did not.
    """
    if len({ticks[0] for ticks in all_ticks}) > 1:
        raise ValueError("its levels do not begin in one tick")


def check_restarts(name: str, restarts: Sequence[int], ticks: range) -> None:
    """See that restarts of a level lie in the run, in order.

    Raises:
        ValueError: They do not.
    """
    if any(tick not in ticks for tick in restarts) or list(restarts) != sorted(restarts):
        raise ValueError(f"level `{name}` was started again in other ticks than those of the run")

"""Questions to the running system: `task.cur_state = state_3 and primitive.travelled_mm > 40` (`rcsc.run.log.queries`).

In: a text, and the levels as they are. Out: a `StateQuery` that can be asked after every cycle. Names are known without their level, and
whatever their case.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.typed_names import one_leaf, shown, split
from rcsc.run.levels import RunningLevel
from rcsc.run.log.queries import BadCondition, Column, Predicate, condition, named_columns


@dataclass(frozen=True, slots=True)
class StateQuery:
    """A condition on the levels.

    Attributes:
        leaves: What it reads: a level's name and a position each.
        chosen: The level of names that are written without one.
    """

    text: str
    chosen: str
    holds: Predicate
    leaves: tuple[tuple[str, int], ...]

    def now(self, running: Mapping[str, RunningLevel]) -> str:
        """Return what it reads, as it is now."""
        return ", ".join(shown(running[level], at) for level, at in dict.fromkeys(self.leaves))


def question(text: str, levels: Sequence[RunningLevel], chosen: RunningLevel) -> StateQuery:
    """Return the query that the text asks.

    Raises:
        Refused: It is no question, or names what is not there.
    """
    known = named_columns(levels)
    leaves: list[tuple[str, int]] = []

    def column(name: str) -> Column | None:
        try:
            level, at = one_leaf(name, levels, chosen)
        except Refused:
            level, word = split(name, levels, chosen)
            return known.get(f"{level.name}.{word}")
        leaves.append((level.name, at))
        return known[f"{level.name}.{level.sign.leaves[at].name}"]

    def unknown(name: str) -> Exception:
        try:
            one_leaf(name, levels, chosen)
        except Refused as error:
            return error
        return BadCondition(f"`{name}` is no variable")

    try:
        holds = condition(text, column, unknown)
    except BadCondition as bad:
        raise Refused(Code.SHELL_VALUE if bad.value else Code.SHELL_COMMAND, str(bad), *bad.helps) from bad
    return StateQuery(text.strip(), chosen.name, holds, tuple(leaves))


def asked(query: StateQuery, levels: Sequence[RunningLevel]) -> bool:
    """Return whether it holds now."""
    return query.holds({level.name: level.values for level in levels})

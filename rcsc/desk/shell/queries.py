"""Questions to the running system: `task.cur_state = state_3 and primitive.travelled_mm > 40` (`rcsc.run.orders.conditions`).

In: a text, and the levels as they are. Out: a `StateQuery` that can be asked after every cycle. A level's `table` and `line` are what it
runs; names are known without their level, and whatever their case.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.reload.refusal import Refused
from rcsc.desk.shell.typed_names import by_name, known_name, one_leaf, shown, split
from rcsc.run.levels import RunningLevel
from rcsc.run.orders.conditions import BadCondition, Operand, condition

Running = Mapping[str, RunningLevel]


@dataclass(frozen=True, slots=True)
class StateQuery:
    """A condition on the levels.

    Attributes:
        leaves: What it reads: a level's name and a position each.
        chosen: The level of names that are written without one.
    """

    text: str
    chosen: str
    holds: Callable[[Running], bool]
    leaves: tuple[tuple[str, int], ...]

    def now(self, running: Running) -> str:
        """Return what it reads, as it is now."""
        return ", ".join(shown(running[level], at) for level, at in dict.fromkeys(self.leaves))


def question(text: str, levels: Sequence[RunningLevel], chosen: RunningLevel) -> StateQuery:
    """What the text asks.

    Raises:
        Refused: It is no question, or names what is not there.
    """
    names = _Names(levels, chosen)
    try:
        holds = condition(text, names)
    except BadCondition as bad:
        raise Refused(Code.SHELL_VALUE if bad.value else Code.SHELL_COMMAND, str(bad), *bad.helps) from bad
    return StateQuery(text.strip(), chosen.name, holds, tuple(names.leaves))


@dataclass(slots=True)
class _Names:
    """The leaves of the levels, and what each runs."""

    levels: Sequence[RunningLevel]
    chosen: RunningLevel
    leaves: list[tuple[str, int]] = field(default_factory=list)

    def operand(self, name: str) -> Operand[Running] | None:
        """A leaf, or the table or line that a level runs."""
        try:
            level, at = one_leaf(name, self.levels, self.chosen)
        except Refused:
            return self._runs(name)
        of, leaf = level.name, level.sign.leaves[at]
        self.leaves.append((of, at))
        if leaf.members:
            return Operand(name, "member", lambda now: leaf.shown(now[of].values[at]), leaf.members)
        kind = "bool" if leaf.c_type == "bool" else "number"
        return Operand(name, kind, lambda now: now[of].values[at])

    def _runs(self, name: str) -> Operand[Running] | None:
        level, rest = split(name, self.levels, self.chosen)
        of = level.name
        if rest == "table":
            return Operand(name, "member", lambda now: now[of].table, tuple(level.sign.tables))
        if rest == "line":
            lines = dict.fromkeys(line for table in level.sign.tables.values() for line in table)
            return Operand(name, "member", lambda now: now[of].line, tuple(lines))
        return None

    def member(self, word: str, members: tuple[str, ...]) -> str | None:
        """The member, whatever its case and hyphens."""
        return known_name(word, members)

    def unknown(self, name: str) -> Exception:
        """As an unknown variable is refused."""
        try:
            one_leaf(name, self.levels, self.chosen)
        except Refused as error:
            return error
        return BadCondition(f"`{name}` is no variable")


def asked(query: StateQuery, levels: Sequence[RunningLevel]) -> bool:
    """Whether it holds now."""
    return query.holds(by_name(levels))

"""What a condition may name of a log: every column of its levels (`rcsc.run.orders.conditions`)."""

import difflib
from collections.abc import Callable, Mapping

from rcsc.run.log.read import Log
from rcsc.run.log.states import LogColumn, columns
from rcsc.run.orders.conditions import BadCondition, Operand, condition
from rcsc.run.signature import Values

Moment = Mapping[str, Values]
"""The values of each level at a tick."""
Predicate = Callable[[Moment], bool]


def predicate(text: str, log: Log) -> Predicate:
    """Return what the text asks.

    Raises:
        BadCondition: It is no condition, or names what the log does not have.
    """
    return condition(text, _Names(named_columns(log)))


def named_columns(log: Log) -> dict[str, tuple[str, LogColumn]]:
    """Every column of a log by `level.name`, with its level."""
    return {
        f"{level.name}.{column.name}": (level.name, column)
        for level in log.levels
        for column in columns(level.sign, level.level)
    }


def nearest(name: str, known: Mapping[str, object]) -> str:
    """`there is no ...`, with the names that are like it."""
    near = difflib.get_close_matches(name, known, 3)
    return f"there is no `{name}` in this log" + (f"; near it: {', '.join(near)}" if near else "")


class _Names:
    """The columns of a log."""

    def __init__(self, known: Mapping[str, tuple[str, LogColumn]]) -> None:
        self._known = known

    def operand(self, name: str) -> Operand[Moment] | None:
        """The column of that name."""
        if name not in self._known:
            return None
        level, column = self._known[name]
        kind = "bool" if column.c_type == "bool" else "number" if column.c_type else "member"
        return Operand(name, kind, lambda moment: column.read(moment[level]), column.members)

    def member(self, word: str, members: tuple[str, ...]) -> str | None:
        """The member, as it is written."""
        return word if word in members else None

    def unknown(self, name: str) -> Exception:
        """There is none in this log."""
        return BadCondition(
            nearest(name, self._known) if "." in name else f"`{name}` is no leaf: write `level.leaf`"
        )

"""Names as people type them: `REMOVE-FROM-BUFFER-DB` is `remove_from_buffer_db`; suggestions for an unknown one.

In: words, levels. Out: levels, leaves, lines and values, or a refusal.
"""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.reload.refusal import Refused
from rcsc.run.levels import RunningLevel
from rcsc.run.log.queries import known_name, normal
from rcsc.run.signature import Leaf, Signature, Value, number_word


@dataclass(frozen=True, slots=True)
class NamedLine:
    """A line of a table of a level."""

    level: str
    table: str
    line: str

    def matched(self, level: RunningLevel) -> bool:
        """Return whether the level's last cycle ran it."""
        return (self.table, self.line) in level.lines

    def __str__(self) -> str:
        return f"{self.level}.{self.table}.{self.line}"


def near(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """`near it: ...`; nothing where nothing is near."""
    every = {normal(word): word for word in known}
    like = [every[match] for match in difflib.get_close_matches(normal(name), every, 3)]
    return (f"near it: {', '.join(like)}",) if like else ()


def unknown(name: str, what: str, known: Iterable[str]) -> Refused:
    """The refusal of a name."""
    return Refused(Code.SHELL_NAME, f"there is no {what} `{name}`", *near(name, known))


def level_of(name: str, levels: Sequence[RunningLevel]) -> RunningLevel:
    """The level of that name.

    Raises:
        Refused: There is none.
    """
    meant = known_name(name, [level.name for level in levels])
    if meant is None:
        raise unknown(name, "level", [level.name for level in levels])
    return next(level for level in levels if level.name == meant)


def split(name: str, levels: Sequence[RunningLevel], chosen: RunningLevel) -> tuple[RunningLevel, str]:
    """The level that a name speaks of, and the rest of it: `task.cur_state`, or `cur_state` of the level chosen."""
    head, point, rest = name.partition(".")
    meant = known_name(head, [level.name for level in levels]) if point else None
    if meant is None:
        return chosen, name
    level = next(level for level in levels if level.name == meant)
    # A buffer may be called like the level at its other end: in TASK `emove.failure` is EMOVE's own variable, and
    # `emove.inc_command_echo`, which EMOVE has not, the buffer's.
    return (
        (chosen, name) if not positions(level.sign, rest) and positions(chosen.sign, name) else (level, rest)
    )


def positions(sign: Signature, name: str) -> tuple[int, ...]:
    """The leaves of a variable: one, or all of a record's or an array's; none where there is no such variable."""
    wanted = normal(name)
    return tuple(
        at
        for at, leaf in enumerate(sign.leaves)
        if normal(leaf.name) == wanted or normal(leaf.name).startswith((f"{wanted}.", f"{wanted}["))
    )


def variable(
    name: str, levels: Sequence[RunningLevel], chosen: RunningLevel
) -> tuple[RunningLevel, tuple[int, ...]]:
    """A variable and its leaves.

    Raises:
        Refused: There is none of that name.
    """
    level, rest = split(name, levels, chosen)
    places = positions(level.sign, rest)
    if not places:
        own = [leaf.name for leaf in level.sign.leaves]
        every = [f"{level.name}.{leaf.name}" for level in levels for leaf in level.sign.leaves]
        raise unknown(name, "variable", own if level is chosen and rest == name else every)
    return level, places


def one_leaf(name: str, levels: Sequence[RunningLevel], chosen: RunningLevel) -> tuple[RunningLevel, int]:
    """A variable that is one leaf.

    Raises:
        Refused: There is none of that name, or it is a record or an array.
    """
    level, places = variable(name, levels, chosen)
    wanted = normal(split(name, levels, chosen)[1])
    exact = [at for at in places if normal(level.sign.leaves[at].name) == wanted]
    if not exact:
        parts = ", ".join(level.sign.leaves[at].name for at in places)
        raise Refused(Code.SHELL_NAME, f"`{name}` is not one value but has parts", f"its parts: {parts}")
    return level, exact[0]


def line_of(text: str, levels: Sequence[RunningLevel], chosen: RunningLevel) -> NamedLine | None:
    """The line that `level.table.line`, or `table.line` of the level chosen, names; None where it names none."""
    level, rest = split(text, levels, chosen)
    table, _, line = rest.partition(".")
    known = known_name(table, level.level.every_table)
    if known is None:
        return None
    named = known_name(line, level.sign.tables[known])
    return None if named is None else NamedLine(level.name, known, named)


def value_of(leaf: Leaf, text: str) -> Value:
    """The value that a text means for a leaf.

    Raises:
        Refused: It is none of that leaf's.
    """
    try:
        return leaf.read((known_name(text, leaf.members) or text) if leaf.members else text)
    except (ValueError, OverflowError) as error:
        helps = near(text, leaf.members)
        raise Refused(
            Code.SHELL_VALUE, f"`{text}` is no value of `{leaf.name}`: it is {kind_of(leaf)}", *helps
        ) from error


MOST_MEMBERS = 40
"""Of an enumeration that a message names."""


def kind_of(leaf: Leaf) -> str:
    """Return the values that a leaf may have, in words."""
    if leaf.members:
        more = len(leaf.members) - MOST_MEMBERS
        others = f" and {more} more" if more > 0 else ""
        return f"one of {', '.join(leaf.members[:MOST_MEMBERS])}{others}"
    if leaf.c_type == "bool":
        return "false or true"
    unit = f" [{leaf.unit}]" if leaf.unit else ""
    return f"{number_word(leaf)} {leaf.low} .. {leaf.high}{unit}"


def shown(level: RunningLevel, at: int) -> str:
    """`task.cur_state = state_2`, with its unit."""
    leaf = level.sign.leaves[at]
    unit = f" [{leaf.unit}]" if leaf.unit else ""
    return f"{level.name}.{leaf.name} = {leaf.shown(level.values[at])}{unit}"


def by_name(levels: Sequence[RunningLevel]) -> Mapping[str, RunningLevel]:
    """The levels by their names."""
    return {level.name: level for level in levels}

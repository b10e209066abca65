"""Names as people type them: `REMOVE-FROM-BUFFER-DB` is `remove_from_buffer_db`, what one stands at first; suggestions for an unknown one.

In: words, levels. Out: levels, leaves, lines and values, or a refusal.
"""

import difflib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.run.levels import RunningLevel
from rcsc.run.log.queries import known_name, normal
from rcsc.run.signature import Leaf, Signature, Value, number_word

LEVEL = "_level"
"""After a level's name: that level, and nothing that is called like it (`TASK-LEVEL`)."""


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
    """The level of a variable, and its name there: `task.cur_state`, or `cur_state` of the level chosen.

    A buffer may be called like the level at its other end, and what one stands at comes first: at GRIPPER `primitive.speed_mm_s` is of
    its own orders, and `primitive-level.speed_mm_s`, which means the level wherever one stands, is PRIMITIVE's.
    """
    own = positions(chosen.sign, name)
    return (not own and addressed(name, levels)) or (chosen, name)


def addressed(name: str, levels: Sequence[RunningLevel]) -> tuple[RunningLevel, str] | None:
    """The level that a name begins with, as `task.` or `task-level.`, and the rest; None where it begins with none."""
    head, point, rest = name.partition(".")
    every = {level.name: level for level in levels}
    word = known_name(head, every) or known_name(normal(head).removesuffix(LEVEL), every)
    return (every[word], rest) if point and word is not None else None


def positions(sign: Signature, name: str) -> tuple[int, ...]:
    """The leaves of a variable: one, or all of a record's or an array's; none where there is no such variable.

    Names that differ in case or hyphens alone are told apart where one is spelled as it is.
    """
    exact = _under(sign, name, str)
    return exact or _under(sign, normal(name), normal)


def _under(sign: Signature, name: str, spelled: Callable[[str], str]) -> tuple[int, ...]:
    return tuple(
        at
        for at, leaf in enumerate(sign.leaves)
        if spelled(leaf.name) == name or spelled(leaf.name).startswith((f"{name}.", f"{name}["))
    )


def variable(
    name: str, levels: Sequence[RunningLevel], chosen: RunningLevel
) -> tuple[RunningLevel, tuple[int, ...]]:
    """A variable and its leaves.

    Raises:
        Refused: There is none of that name, or there are several.
    """
    level, rest = split(name, levels, chosen)
    places = positions(level.sign, rest)
    if not places:
        raise _no_variable(name, rest, level, levels)
    meant = tuple(dict.fromkeys(level.sign.leaves[at].name[: len(rest)] for at in places))
    if len(meant) > 1:
        raise ambiguous(name, [f"{level.name}-level.{one}" for one in meant])
    return level, places


def ambiguous(name: str, spellings: Sequence[str]) -> Refused:
    """The refusal of a name that means several things, with what to write for each."""
    return Refused(
        Code.SHELL_NAME, f"`{name}` may be {' or '.join(f'`{one}`' for one in spellings)}", "write which"
    )


def _no_variable(name: str, rest: str, level: RunningLevel, levels: Sequence[RunningLevel]) -> Refused:
    if rest != name:
        return unknown(
            name, "variable", [f"{one.name}.{leaf.name}" for one in levels for leaf in one.sign.leaves]
        )
    fields = [
        f"`{leaf.name}`" for leaf in level.sign.leaves if normal(leaf.name).endswith(f".{normal(name)}")
    ]
    if fields:
        message = f"level `{level.name}` has no variable `{name}`"
        return Refused(Code.SHELL_NAME, message, f"fields of that name: {', '.join(fields[:MOST_MEMBERS])}")
    others = [f"`{one.name}.{name}`" for one in levels if positions(one.sign, name)]
    if others:
        message = f"level `{level.name}` has no variable `{name}`"
        return Refused(Code.SHELL_NAME, message, f"of other levels: {', '.join(others)}")
    return unknown(name, "variable", [leaf.name for leaf in level.sign.leaves])


def one_leaf(name: str, levels: Sequence[RunningLevel], chosen: RunningLevel) -> tuple[RunningLevel, int]:
    """A variable that is one leaf.

    Raises:
        Refused: There is none of that name, or several, or it is a record or an array.
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
    for level, rest in ((chosen, text), addressed(text, levels) or (chosen, "")):
        table, _, line = rest.partition(".")
        known = known_name(table, level.level.every_table)
        named = None if known is None else known_name(line, level.sign.tables[known])
        if known is not None and named is not None:
            return NamedLine(level.name, known, named)
    return None


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

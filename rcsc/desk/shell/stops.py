"""What `run` stops at: conditions, as `task.cur_state = state_3 and primitive.travelled_mm > 40` (`rcsc.run.log.queries`), and lines.

In: a text, and the levels as they are. Out: a `StateQuery` that can be asked after every cycle, and breakpoints. Names are known without
their level, and whatever their case.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.typed_names import NamedLine, level_of, line_of, one_leaf, shown, split, unknown
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


Levels = Sequence[RunningLevel]
Standing = Callable[[StateQuery | NamedLine], bool]
"""Whether something to stop at is there now."""


@dataclass(slots=True)
class Stop:
    """A breakpoint.

    Attributes:
        stood: Whether it held already before the cycle: it stops where it comes to hold.
    """

    number: int
    what: StateQuery | NamedLine
    stood: bool = False

    @property
    def text(self) -> str:
        """As it was given."""
        return self.what.text if isinstance(self.what, StateQuery) else str(self.what)


def stands(what: StateQuery | NamedLine, levels: Levels) -> bool:
    """Return whether the condition holds, or the line was the level's last."""
    return asked(what, levels) if isinstance(what, StateQuery) else what.matched(level_of(what.level, levels))


def reached(what: StateQuery | NamedLine) -> str:
    """Return the reason of the stop, in words."""
    return f"`{what.text}` holds" if isinstance(what, StateQuery) else f"line {what}"


@dataclass(slots=True)
class Stops:
    """The breakpoints of a session, in the order in which they were set."""

    every: list[Stop] = field(default_factory=list)
    _numbered: int = 0

    def add(self, what: StateQuery | NamedLine) -> Stop:
        """Add a breakpoint."""
        self._numbered += 1
        self.every.append(Stop(self._numbered, what))
        return self.every[-1]

    def look(self, standing: Standing) -> None:
        """Notes what holds already."""
        for stop in self.every:
            stop.stood = standing(stop.what)

    def met(self, standing: Standing) -> Stop | None:
        """Return the first that has come to hold since `look`."""
        before = [stop.stood for stop in self.every]
        self.look(standing)
        return next(
            (stop for stop, stood in zip(self.every, before, strict=True) if stop.stood and not stood), None
        )

    def ask_again(self, levels: Levels) -> list[str]:
        """Read every breakpoint against other levels; drop those that do not fit, and name them."""
        kept, dropped = [], []
        for stop in self.every:
            try:
                _again(stop, levels)
                kept.append(stop)
            except Refused as refused:
                dropped.append(f"breakpoint {stop.number}, `{stop.text}`, is gone: {refused}")
        self.every = kept
        return dropped


def _again(stop: Stop, levels: Levels) -> None:
    if isinstance(stop.what, StateQuery):
        stop.what = question(stop.what.text, levels, level_of(stop.what.chosen, levels))
    elif line_of(str(stop.what), levels, levels[0]) is None:
        raise unknown(str(stop.what), "line", ())

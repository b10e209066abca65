"""What is required and assumed over time, watched in a run: of a log, cycle by cycle, and of what else gives values before and after one.

In: a log, or values; resolved programs. Out: the cycles that break it, with the values that they left. It is the monitor that
`rcsc prove` proves: executors have no part in it. What is required across levels is watched tick by tick (`across`).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Self

from rcsc.base.diagnostics.codes import Code
from rcsc.lang.leaves import spoken_of
from rcsc.lang.model import BEFORE, Program, Property, Value
from rcsc.lang.over_time import Watch
from rcsc.lang.resolve import resolve
from rcsc.run.description import BadDescription, Description, LevelSpec, places
from rcsc.run.log.across import AcrossTrack, stated_across
from rcsc.run.log.states import LogColumn
from rcsc.run.signature import Signature, Values

if TYPE_CHECKING:  # reading a log needs its extra; watching values does not
    from rcsc.run.log.queries import Column
    from rcsc.run.log.read import Log, LoggedLevel

ACROSS = ""
"""As the name of a level, which none has: of all levels together."""


def program_of(path: Path, system: Description, spec: LevelSpec) -> Program:
    """Return the program of a level, from its source. Raises BadDescription: that is not there, or not in order."""
    loaded, name = system.load(path, spec), spec.program
    if loaded is None:
        shown = " nor ".join(f"`{place}`" for place in places(path, spec.source))
        raise BadDescription(f"the source of program `{name}` is neither {shown}")
    program = resolve(loaded.roots[0], loaded) if loaded.roots else ()
    if isinstance(program, Program):
        return program
    wrong = [found for found in (*loaded.diagnostics, *program) if found.code is not Code.PROPERTY_ELSEWHERE]
    raise BadDescription(f"program `{name}`: {wrong[0].message if wrong else 'its source cannot be read'}")


@dataclass(slots=True)
class LevelWatch:
    """A requirement that is watched on the values of its level.

    Attributes:
        reads: Where what it reads stands among them.
    """

    watch: Watch
    sign: Signature
    reads: Mapping[str, int]

    @property
    def stated(self) -> Property:
        """The requirement."""
        return self.watch.stated

    def broken(self, before: Values, after: Values) -> str:
        """Take a cycle; return the values that it left, in words, if it breaks the requirement; else ""."""
        if self.watch.keeps(self._of(before), self._of(after)):
            return ""
        leaves = self.sign.leaves
        return (
            ", ".join(f"`{name}` = {leaves[at].shown(after[at])}" for name, at in self.reads.items())
            or "at any values"
        )

    def _of(self, values: Values) -> dict[str, Value]:
        return {name: values[at] for name, at in self.reads.items()}


def watch_of(stated: Property, sign: Signature) -> LevelWatch:
    """Return how a requirement is watched on values of a level; raises KeyError where these lack what it reads."""
    names = dict.fromkeys(name.removeprefix(BEFORE) for name in spoken_of(stated))
    return LevelWatch(Watch(stated), sign, {name: sign.index[name] for name in names})


@dataclass(frozen=True, slots=True)
class BrokenRequirement:
    """A cycle of a level, or a tick of all (`ACROSS`), that breaks a requirement, or an assumption; `shown`, the values that it left."""

    level: str
    name: str
    tick: int
    text: str
    shown: str
    assumed: bool = False

    @property
    def word(self) -> str:
        """What its declaration calls it."""
        return "assumption" if self.assumed else "requirement"

    @property
    def asked(self) -> str:
        """Its name, as a condition on a run calls it."""
        return f"{self.level}.{self.name}" if self.level else self.name


def requirements(system: Path, described: Description, *, monitored: bool) -> dict[str, tuple[Property, ...]]:
    """Return the requirements and assumptions over time of each level that has some, all or those that every run watches.

    Those across levels are under `ACROSS`; with all of these, properties, too.

    Raises:
        BadDescription: A program is not there, or not in order.
    """
    known: dict[str, tuple[Property, ...]] = {}
    programs = {spec.name: program_of(system, described, spec) for spec in described.levels}
    for name, program in programs.items():
        known[name] = tuple(one for one in program.over_time if one.monitored or not monitored)
    across = stated_across(described, programs)
    stated = () if across is None else across[0].stated
    known[ACROSS] = tuple(one for one in stated if one.monitored or not monitored)
    return {level: stated for level, stated in known.items() if stated}


def broken_in(log: "Log", wanted: Mapping[str, tuple[Property, ...]]) -> Iterator[BrokenRequirement]:
    """Yield each cycle of a log that breaks one of the requirements, level by level, then those across levels.

    One that reads what the log lacks is left out.
    """
    for level in log.levels:
        yield from WatchedTrack.of(level.sign, wanted.get(level.name, ())).further(level)
    yield from broken_across(AcrossTrack.of(log, wanted.get(ACROSS, ())), log)


def broken_across(track: AcrossTrack, log: "Log") -> Iterator[BrokenRequirement]:
    """Yield each tick that breaks a requirement across levels, of those that were not looked at yet."""
    for tick, stated, shown in track.further(log):
        yield BrokenRequirement(ACROSS, stated.name, tick, stated.text, shown, stated.assumed)


def _is_read(stated: Property, sign: Signature) -> bool:
    return all(name.removeprefix(BEFORE) in sign.index for name in spoken_of(stated))


@dataclass(slots=True)
class WatchedTrack:
    """The cycles of a level, watched as they come.

    Attributes:
        looked_at: How many of its records were.
    """

    watches: Sequence[LevelWatch]
    looked_at: int = 0
    _before: Values = ()

    @classmethod
    def of(cls, sign: Signature, wanted: Iterable[Property]) -> Self:
        """Watch requirements on a level of this signature, but those that read what it lacks."""
        return cls([watch_of(stated, sign) for stated in wanted if _is_read(stated, sign)])

    def further(self, level: "LoggedLevel") -> Iterator[BrokenRequirement]:
        """Yield each cycle that breaks a requirement, of those that were not looked at yet."""
        track = level.track
        for at in range(self.looked_at, len(track.ticks)) if self.watches else ():
            self.looked_at = at + 1
            values = track.layout.unpack(track.packed[at])
            restart = level.restarted(at) if at else None
            if restart is not None:
                self._before = restart.values
            for watch in self.watches if at else ():
                if not level.follows(at) or (restart is not None and not restart.by_hand):
                    watch.watch.begin()  # begun anew, or nobody knows what was in between
                if shown := watch.broken(self._before, values):
                    stated = watch.stated
                    tick = track.ticks[at]
                    yield BrokenRequirement(level.name, stated.name, tick, stated.text, shown, stated.assumed)
            self._before = values


def kept_columns(
    log: "Log", wanted: Mapping[str, tuple[Property, ...]]
) -> tuple[dict[str, "Column"], Callable[[int], Mapping[str, Values]]]:
    """Return a column for each requirement, false in the cycles that break it, and what gives their values in a tick."""
    broken = {(one.level, one.name, one.tick) for one in broken_in(log, wanted)}
    every = [(level, stated.name) for level, each in wanted.items() for stated in each]

    def column(at: int, name: str) -> LogColumn:
        return LogColumn(name, (), "bool", "", lambda values: values[at])

    names = (f"{level}.{name}" if level else name for level, name in every)
    columns = {whole: (_KEPT, column(at, whole)) for at, whole in enumerate(names)}
    return columns, lambda tick: {_KEPT: tuple((*one, tick) not in broken for one in every)}


_KEPT = "requirements that are kept"
"""As the name of a level that none has, of their values in a tick."""

"""What is not proved, looked at: the shortest run that shows it, run by the executors before it is shown, and what would mend it.

In: steppers and the proof of their levels. Out: `Told`, one for each thing that is not proved; of lines that both match, one for
each pair.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from rcsc.compose.contract.obligations import Goal, Key, Sort, pairs
from rcsc.compose.contract.transition import Stepper
from rcsc.compose.counterexample.finding import Finding, of_trace
from rcsc.compose.counterexample.lasso import Lap, goal_of, laps
from rcsc.compose.counterexample.pair import broken_together
from rcsc.compose.counterexample.repair import helps
from rcsc.compose.counterexample.replay import ExecutorsDifferError, make, only_in_python, record
from rcsc.compose.counterexample.trace import Found, NotReproducedError, Search, traces
from rcsc.compose.proof.level import LevelProof, essential
from rcsc.compose.proof.system import SystemProof
from rcsc.host.children import scratch
from rcsc.run.description import Description

SEARCHES = (Search(legal=True), Search(), Search(legal=True, restarted=True))
"""In the order in which they are made: what a neighbour can do that began with the level is shown first."""


@dataclass(frozen=True, slots=True)
class Told:
    """One thing that is not proved.

    Attributes:
        level: Whose goal it is.
        goal: Which.
        finding: The run that shows it; None where none was found.
        beside: Where the run does not reproduce: what each did, a line each.
        guessed: Whether that is no bug, as arithmetic was left open (`keyed`).
        helps: What would mend the table.
        log: Where the run is kept.
        others: Pairs of lines of the same table that no run shows.
        in_c: Whether the C executor ran it, too; it cannot where an extern procedure has to give what no C function can.
    """

    level: str
    goal: Goal
    finding: Finding | None = None
    beside: tuple[str, ...] = ()
    guessed: bool = False
    helps: tuple[str, ...] = ()
    log: Path | None = None
    others: tuple[str, ...] = field(default=())
    in_c: bool = True

    @property
    def warns(self) -> bool:
        """Whether it is no error: a command that is not shown to end may wait for what is right to wait for."""
        return self.goal.sort is Sort.ENDS

    @property
    def bug(self) -> bool:
        """Whether it shows a fault of rcsc's own."""
        return bool(self.beside) and not self.guessed


@dataclass(frozen=True, slots=True)
class Looking:
    """How to look.

    Attributes:
        system: The system's description.
        most: Cycles of a run.
        altered: Whether the programs are looked at under another rule than the language's.
        log: The folder in which runs are kept; None for none.
    """

    system: Description
    most: int
    altered: bool = False
    log: Path | None = None


def look(made: Mapping[str, Stepper], proof: SystemProof, looking: Looking) -> Iterator[Told]:
    """Everything essential that is not proved, level by level.

    Raises:
        NotBuilt: The C executors could not be built.
        OSError: A log cannot be written.
    """
    with scratch("findings") as kept:
        rerun = _Rerun(made, looking, looking.log or kept)
        for one in proof.levels:
            for told in _level(made, one.level, essential(one), looking):
                yield rerun.run(told)
            for told in _together(made, one.level, essential(one), looking):
                yield rerun.run(told)
            for told in _endless(made[one.level], one, looking):
                yield rerun.run(told)


def _level(
    made: Mapping[str, Stepper], level: str, wanted: tuple[Goal, ...], looking: Looking
) -> Iterator[Told]:
    if not looking.most:
        yield from (Told(level, goal) for goal in wanted)
        return
    stepper = made[level]
    every = pairs(stepper.cycle(stepper.anywhere()))
    parted = {
        goal.key: [one for one in every if one.table == goal.table]
        for goal in wanted
        if goal.sort is Sort.ONE_LINE
    }
    asked = [one for goal in wanted for one in parted.get(goal.key) or [goal]]
    found = _found(stepper, asked, looking)
    for goal in wanted:
        if goal.key in parted:
            yield from _pairs(stepper, goal, parted[goal.key], found)
        else:
            yield _told(stepper, goal, found.get(goal.key))


def _found(stepper: Stepper, asked: list[Goal], looking: Looking) -> dict[Key, Found]:
    """What the searches find, one after the other, for what is still open."""
    found: dict[Key, Found] = {}
    for search in SEARCHES:
        left = [goal for goal in asked if goal.key not in found]
        if left:
            found |= traces(stepper, left, replace(search, most=looking.most))
    return found


def _pairs(stepper: Stepper, goal: Goal, parted: list[Goal], found: Mapping[Key, Found]) -> Iterator[Told]:
    """The pairs of lines that both match in some run; the table as a whole where there is none."""
    shown = [one for one in parted if one.key in found]
    others = tuple(one.name for one in parted if one.key not in found)
    if not shown:
        yield Told(stepper.level.name, goal, others=others)
    for at, one in enumerate(shown):
        yield replace(_told(stepper, one, found[one.key]), others=others if at == len(shown) - 1 else ())


def _told(stepper: Stepper, goal: Goal, found: Found | None) -> Told:
    level = stepper.level.name
    match found:
        case None:
            return Told(level, goal)
        case NotReproducedError():
            return Told(level, goal, beside=found.beside or (str(found),), guessed=found.guessed)
        case _:
            return Told(level, goal, of_trace(stepper, goal, found))


def _together(
    made: Mapping[str, Stepper], level: str, wanted: tuple[Goal, ...], looking: Looking
) -> Iterator[Told]:
    """What becomes of orders that are not numbered as they should be, or not answered, with both levels as they are."""
    links = made[level].links
    records = {
        goal.name.partition(".")[0] for goal in wanted if goal.sort in {Sort.NUMBERED, Sort.NEXT_NUMBER}
    }
    ends = [(level, one.name) for one in links.below if one.order in records]
    if links.above is not None and any(goal.sort is Sort.ECHOES for goal in wanted):
        ends.append((links.above.name, level))
    for upper, lower in ends if looking.most else []:
        if upper in made and lower in made:
            below = next(one for one in made[upper].links.below if one.name == lower)
            search = Search(looking.most)
            found = broken_together(made[upper], made[lower], below, search)
            if isinstance(found, Finding):
                yield Told(found.level, found.goal, found)
            elif found is not None:
                yield Told(lower, wanted[0], beside=(str(found),), guessed=found.guessed)


def _endless(stepper: Stepper, proof: LevelProof, looking: Looking) -> Iterator[Told]:
    """Commands that are not shown to end, each with a run after which it may go on for ever."""
    tables = [ending.table for ending in proof.endings if not ending.proved]
    found: dict[str, Lap | NotReproducedError] = {}
    for search in SEARCHES if looking.most else ():
        found |= laps(
            stepper, [one for one in tables if one not in found], replace(search, most=looking.most)
        )
    for table in tables:
        goal = goal_of(table)
        match found.get(table):
            case Lap() as lap:
                yield Told(proof.level, goal, replace(of_trace(stepper, goal, lap.trace), lap=lap.first))
            case other:
                yield _told(stepper, goal, other)


@dataclass(slots=True)
class _Rerun:
    """Runs findings on executors, which are made once a level."""

    made: Mapping[str, Stepper]
    looking: Looking
    folder: Path
    _ready: set[str] = field(default_factory=set)
    _names: set[str] = field(default_factory=set)

    def run(self, told: Told) -> Told:
        """With the log of its run, and what would mend the table."""
        finding = told.finding
        if finding is None or told.goal.sort is Sort.SAFE:  # what is not safe no executor is to run
            return told
        system = replace(self.looking.system, generated=self.folder / "generated")
        programs = {name: self.made[name].program for name in finding.levels if name not in self._ready}
        make(programs.values(), system.generated, altered=self.looking.altered)
        self._ready |= programs.keys()
        path = self.folder / f"{self._named(finding)}.mcap"
        try:
            record(finding, self.made, system, path, altered=self.looking.altered)
        except ExecutorsDifferError as error:
            return replace(told, beside=error.beside)
        kept = path if self.looking.log is not None else None
        in_c = not only_in_python(finding, self.made)
        return replace(told, helps=helps(self.made[told.level], finding), log=kept, in_c=in_c)

    def _named(self, finding: Finding) -> str:
        name = file_name(finding)
        numbered = name
        for number in range(2, len(self._names) + 3):
            if numbered not in self._names:
                break
            numbered = f"{name}_{number}"
        self._names.add(numbered)
        return numbered


def file_name(finding: Finding) -> str:
    """What its log and its case are called, without the end."""
    goal = finding.goal
    parts = (finding.level, goal.table, goal.sort.name.lower(), goal.name if goal.name != goal.table else "")
    text = "_".join(part for part in parts if part)
    return "".join(letter if letter.isalnum() or letter == "_" else "_" for letter in text)

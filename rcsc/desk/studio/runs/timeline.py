"""The time line of a run, live or of a log: which line each level ran, any moment of it, and why a line did not match.

In: questions of kind `time.*`. Out: what was at a tick. Which run it is about is the same for every page: the live one, or a log that a
page opened. Why a line did not match is found by the reference interpreter, which plays the cycle again up to the table that is asked for,
so that a cell is judged on the values that the table saw.
"""

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from operator import attrgetter
from typing import Any

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.reload.gate import tables_tried
from rcsc.desk.studio.hub import PROVER, Ask, Concern, Json
from rcsc.desk.studio.runs.history import History
from rcsc.desk.studio.runs.live import LANE, Live, Mark, level_shown, range_of
from rcsc.desk.studio.runs.logs import KeptFinding
from rcsc.desk.studio.runs.shown import Lines, Shown
from rcsc.desk.studio.runs.watching import Watched
from rcsc.lang.interpret import (
    UNDEFINED,
    ExternError,
    answering,
    failed_assumptions,
    holds,
)
from rcsc.lang.leaves import conjuncts, read_by
from rcsc.lang.model import Expr, Line, Procedure, Program, Property, Table, Test, Value, spell
from rcsc.run.description import BadDescription, description
from rcsc.run.levels import RunningLevel
from rcsc.run.log.queries import BadCondition, Predicate, predicate
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.log.required import ACROSS, BrokenRequirement, kept_columns, requirements
from rcsc.run.signature import Signature, Values, number_word

MOST_MARKED = 1000
LONGEST = 4000
_BREATH = 2000
"""Ticks between two looks at whether a search is still wanted."""


@dataclass(frozen=True, slots=True)
class Source:
    """A run that pages look at.

    Attributes:
        name: How it is called; empty for the live one.
        history: Its ticks.
        log: Where it is a file's.
        finding: What it is kept for.
    """

    name: str
    history: History
    log: Log | None = None
    finding: KeptFinding | None = None


class TimeLine(Concern):
    """Answers about the ticks of the run that everybody looks at; in the lane of the run."""

    name, lane = "time", LANE

    def __init__(self, live: Live, tell: Callable[[str, Json], None]) -> None:
        """Args: live: The running system; tell: As `Hub.tell`."""
        self.live, self._tell = live, tell
        self._log: Source | None = None
        self._lines, self._shown = Lines(), Shown()
        self._watched: tuple[History, Watched] | None = None

    def greeting(self) -> Json:
        """Return the run that everybody looks at."""
        return self.state()

    def close(self) -> None:
        """Close the log."""
        self._log = None

    @property
    def source(self) -> Source:
        """The run that everybody looks at."""
        return self._log or Source("", self.live.history)

    def state(self) -> Json:
        """Return the run that everybody looks at, with the range of ticks for a log."""
        if self._log is None:
            return {"source": "live"}
        log = self._log.log
        assert log is not None
        finding = self._log.finding
        return {
            "source": "log",
            "name": self._log.name,
            "first": log.first,
            "last": log.last,
            "tick_ms": log.tick_ms,
            "levels": [level_shown(level) for level in log.levels],
            "text": log.checked.text,
            "other": self._other(log),
            "finding": None if finding is None else finding.shown(),
        }

    def _other(self, log: Log) -> str:
        """Return the name of a log's system; empty where it is the studio's, or the studio's name is not known."""
        with contextlib.suppress(BadDescription, OSError):
            name = log.facts["name"]
            return "" if name == description(self.live.opening.path).name else name
        return ""

    def show(self, name: str, log: Log, finding: KeptFinding | None = None) -> None:
        """Show everybody a log, and its finding."""
        self._log = Source(name, History([log]), log, finding)
        self._tell("time.state", self.state())

    def _on_live(self, _: Ask) -> Json:
        self._log = None
        self._tell("time.state", self.state())
        return self.state()

    # --- ticks ---

    def history(self) -> History:
        """The ticks of the run that everybody looks at.

        Raises:
            Refused: There is none.
        """
        history = self.source.history
        if not history.logs:
            raise Refused(Code.STUDIO, f"no run is there: {self.live.why}")
        return history

    def _tick(self, ask: Ask) -> int:
        history = self.history()
        return ask.body.whole("tick", history.first, history.last)

    def _level(self, ask: Ask, tick: int) -> LoggedLevel:
        name = ask.body.text("level")
        try:
            return self.history().ran_at(tick).level(name)
        except KeyError as error:
            raise Refused(Code.STUDIO, f"the run has no level `{name}`") from error

    def _on_moment(self, ask: Ask) -> Json:
        return self._shown.moment(self.history(), self._tick(ask))

    def _on_tracks(self, ask: Ask) -> Json:
        """Every change of a level's line after a tick; `era` says whether what the page has is still so."""
        history = self.history()
        since = ask.body.whole("since", -1, 2**53)
        known = since if ask.body.whole("era", -1, 2**53) == history.era and history.first <= since else -1
        levels, to = self._lines.changes(history, known)
        return {
            "era": history.era,
            "from": known,
            "to": to,
            "first": history.first,
            "last": history.last,
            "levels": levels,
            "marks": [asdict(mark) for mark in sorted(self._marks(), key=attrgetter("tick"))][-MOST_MARKED:],
        }

    def _marks(self) -> Iterator[Mark]:
        for broken in self._broken():
            text = f"{broken.word} `{broken.asked}` is broken: {broken.shown}"
            yield Mark(broken.tick, "finding", text)
        if self._log is None:
            yield from self.live.marks
        elif self._log.finding is not None:
            yield Mark(self._log.finding.tick, "finding", self._log.finding.text)

    def _broken(self) -> Sequence[BrokenRequirement]:
        """Return the cycles known that break a requirement over time which every run watches."""
        history = self.source.history
        if not history.logs:
            return ()
        if self._watched is None or self._watched[0] is not history:
            self._watched = history, Watched()
        self._watched[1].look(history, partial(self._required, monitored=True))
        return self._watched[1].broken

    def _required(self, log: Log, *, monitored: bool = False) -> dict[str, tuple[Property, ...]]:
        """Return what is required and assumed over time of levels, from their sources; nothing of one that ran other tables than now.

        Across levels, where all of them run here with the tables of now.

        Nothing is proved or compiled for it: the run goes on meanwhile.
        """
        path = self.live.opening.path
        try:
            every = requirements(path, description(path), monitored=monitored)
            here = {level.name for level in log.levels if self._running(level) is not None}
        except (BadDescription, Refused):
            return {}
        whole = here == {level.name for level in log.levels}
        return {name: stated for name, stated in every.items() if name in here or (name == ACROSS and whole)}

    # --- values ---

    def _on_values(self, ask: Ask) -> Json:
        """Return every variable of a level as a tick left it, and whether the tick changed it."""
        tick = self._tick(ask)
        history = self.history()
        logged = self._level(ask, tick)
        try:
            now, before = (
                history.values(logged.name, tick),
                history.values(logged.name, max(history.first, tick - 1)),
            )
        except KeyError as error:
            raise Refused(Code.STUDIO, f"the run has no level `{logged.name}`") from error
        sign = history.stood_at(tick).level(logged.name).sign
        alike = len(now) == len(before)
        return [
            {**_leaf(sign, at), "text": leaf.shown(now[at]), "changed": alike and now[at] != before[at]}
            for at, leaf in enumerate(sign.leaves)
        ]

    # --- questions about a cycle ---

    def _on_why(self, ask: Ask) -> Json:
        """Return each table that a level's cycle tried, and for each of its lines the conditions that did not hold."""
        tick = self._tick(ask)
        logged = self._level(ask, tick)
        at = logged.track.place(tick)
        if at < 1:
            raise Refused(Code.STUDIO, f"level `{logged.name}` had no cycle up to tick {tick}")
        with PROVER:
            program = self._program(logged)
            after = logged.track.layout.unpack(logged.track.packed[at])
            restart = logged.restarted(at)
            before = (
                logged.track.layout.unpack(logged.track.packed[at - 1]) if restart is None else restart.values
            )
            began = {
                leaf.name: (after if leaf.kind == "input" else before)[place]
                for place, leaf in enumerate(logged.sign.leaves)
            }
            tables = why(program, logged.name, began)
        return {"tick": logged.track.ticks[at], "tables": [asdict(table) for table in tables]}

    def _program(self, logged: LoggedLevel) -> Program:
        """Return the program of a level, if it has the tables that the run had.

        Raises:
            Refused: The levels that run here have others.
        """
        level = self._running(logged)
        if level is None:
            raise Refused(Code.STUDIO, f"level `{logged.name}` ran other tables then than it runs now")
        return self.live.session().program(level)

    def _running(self, logged: LoggedLevel) -> RunningLevel | None:
        """Return the level that runs, if it has the tables that the run had.

        Raises:
            Refused: Nothing runs.
        """
        session = self.live.session()
        level = next((one for one in session.levels if one.name == logged.name), None)
        if level is None:
            return None
        if self._log is None:
            return level if level.sign is logged.sign else None
        assert self._log.log is not None
        same = self._log.log.programs.get(logged.sign.program) == session.digest(level)
        return level if same else None

    def _on_find(self, ask: Ask) -> Json:
        """Find the next tick, or the one before, in which a condition holds; null where there is none."""
        text = ask.body.text("text")
        if len(text) > LONGEST:
            raise Refused(Code.STUDIO, f"a condition of more than {LONGEST} characters")
        tick, back = self._tick(ask), ask.body.flag("back")
        history = self.history()
        ticks = range(tick - 1, history.first, -1) if back else range(tick + 1, history.last + 1)
        asked: dict[int, tuple[Predicate, Callable[[int], Mapping[str, Values]]]] = {}
        for count, at in enumerate(ticks):
            log = history.ran_at(at)
            if id(log) not in asked:
                asked[id(log)] = self._predicate(text, log)
            if count % _BREATH == 0:
                ask.progress("searching", count, len(ticks))
            held = {one.name: values for one in log.levels if (values := one.track.latest(at)) is not None}
            holds_here, kept = asked[id(log)]
            if holds_here({**held, **kept(at)}):
                return {"tick": at}
        return {"tick": None}

    def _predicate(self, text: str, log: Log) -> tuple[Predicate, Callable[[int], Mapping[str, Values]]]:
        """Return what a text asks of a log, and what it needs of a tick beside the levels: requirements, for one that names them.

        Raises:
            Refused: It is no condition, or names what is not there.
        """
        try:
            return predicate(text, log.levels), lambda _: {}
        except BadCondition:
            columns, kept = kept_columns(log, self._required(log))
        try:
            return predicate(text, log.levels, columns), kept
        except BadCondition as error:
            raise Refused(Code.STUDIO, str(error), *error.helps) from error


def _leaf(sign: Signature, at: int) -> dict[str, Any]:
    leaf = sign.leaves[at]
    kind = "choice" if leaf.members else "bool" if leaf.c_type == "bool" else number_word(leaf)
    return {
        "name": leaf.name, "kind": leaf.kind, "type": kind, "members": list(leaf.members), "unit": leaf.unit,
        "range": range_of(leaf), "doc": leaf.doc,
    }  # fmt: skip


# --- why a line matched, or did not ---

Snapshot = Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Judged:
    """A line, judged on the values of a cycle.

    Attributes:
        matches: Whether every cell of it holds.
        column: The place of the first cell that does not, from 0; -1 where all do.
        heading: Of that cell's column.
        cell: The cell, in the table's words.
        values: The variables that it reads, as they were: (name, value).
        failing: How many of its cells do not hold.
    """

    line: str
    matches: bool
    column: int = -1
    heading: str = ""
    cell: str = ""
    values: tuple[tuple[str, str], ...] = ()
    failing: int = 0


@dataclass(frozen=True, slots=True)
class TableJudged:
    """A table, judged in a cycle.

    Attributes:
        failed: Assumptions of it that did not hold.
        default: The line that runs where none matches; empty for none.
    """

    table: str
    lines: tuple[Judged, ...]
    failed: tuple[str, ...]
    default: str


def why(program: Program, level: str, began: Snapshot) -> tuple[TableJudged, ...]:
    """Return every table that the cycle tried, in order, with each of its lines.

    Args:
        program: The level's.
        level: Its name.
        began: All leaves: states and outputs as the cycle before left them, inputs as this one took them.

    Raises:
        Refused: The cycle ended before a table was tried, or cannot be played again.
    """
    try:
        with answering(_not_again):
            return tuple(_judged(program, table, now) for table, now in tables_tried(program, level, began))
    except (*UNDEFINED, ExternError, KeyError) as error:
        raise Refused(Code.STUDIO, f"the cycle cannot be played again: {error}") from error


def _judged(program: Program, table: Table, now: Snapshot) -> TableJudged:
    lines = tuple(_line(program, table, line, now) for line in table.lines)
    default = "" if table.default is None else str(table.default.name)
    return TableJudged(table.name, lines, failed_assumptions(program, table, now), default)


def _line(program: Program, table: Table, line: Line, now: Snapshot) -> Judged:
    failing = [
        (at, test)
        for at, test in enumerate(line.tests)
        if test is not None and not _part_holds(test.condition, now)
    ]
    if not failing:
        return Judged(str(line.name), matches=True)
    at, test = failing[0]
    column = table.columns[at]
    heading = column.heading if column.written else "above"
    return Judged(str(line.name), False, at, heading, test.text, _read(program, test, now), len(failing))


def _read(program: Program, test: Test, now: Snapshot) -> tuple[tuple[str, str], ...]:
    """Return the variables of the first part of a cell that does not hold."""
    false = next((part for part in conjuncts(test.condition) if not _part_holds(part, now)), test.condition)
    names = dict.fromkeys(read_by(false))
    return tuple((str(name), spell(program.variable(name).type, now[name])) for name in names)


def _part_holds(part: Expr, now: Snapshot) -> bool:
    try:
        return holds(part, now)
    except UNDEFINED:
        return False


def _not_again(procedure: Procedure, _: list[Value]) -> tuple[Value, ...]:
    """Refuse the call: an extern procedure is a user's own program, and is not run again to look at a cycle."""
    raise ExternError(f"`{procedure.name}` is an extern procedure, and is not called again")

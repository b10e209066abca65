"""A system under the hands of the pages: run, paused, stepped, changed, as `rcsc shell` does it.

In: questions of kind `run.*`. Out: answers, and `run.state` to every page whenever something changed. The system runs in slices, so
that a pause is heard between two of them; nothing here waits for a page, and a page that goes leaves the levels as they are.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, cast

from rcsc.base.diagnostics.coded import CodedError, Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.commands import Commands, Output, RunOrder, said
from rcsc.desk.shell.opening import Opening, opened
from rcsc.desk.shell.session import Session
from rcsc.desk.studio.hub import LATER, PROVER, Ask, Concern, Json
from rcsc.desk.studio.runs.history import History
from rcsc.lang.project import project_root
from rcsc.run.faults import faults_of
from rcsc.run.levels import RunningLevel
from rcsc.run.log.read import LoggedLevel
from rcsc.run.orders.operator import WATCHED_RATE, Operator
from rcsc.run.orders.roles import Served, field_of, served
from rcsc.run.orders.together import Together
from rcsc.run.signature import Leaf
from rcsc.run.system import System

LANE = "run"
SLICE_S = 0.02
"""A running system is paused within so long, and one cycle."""
PAUSE_S = 0.002
"""Between two slices, for what else the lane has to do."""
TOLD_S = 0.08
"""Pages are told so often, at most, how far a running system is."""
LONGEST_LINE = 4000
"""Characters of a command."""
FASTEST = 1000.0
MOST_MARKS = 2000
_LOOKING = ("?", "help", "show", "lines", "levels", "buffers", "breaks", "faults", "diff", "expect")
"""Commands that change nothing, and leave no mark on the time line."""


@dataclass(frozen=True, slots=True)
class Pace:
    """How a system runs at first.

    Attributes:
        rate: How many times as fast as the clock; None for as fast as it goes.
        runs: Whether it runs once it was opened for the first time, without being told to.
    """

    rate: float | None = WATCHED_RATE
    runs: bool = False


WATCHED = Pace()


@dataclass(slots=True)
class Going:
    """A run under way.

    Attributes:
        order: How far it is to go.
        cycles: Each says after a cycle why the run ends there; nothing where it goes on.
        done: Takes what the shell would show, or raise, at the end.
        left: Cycles that it may still do.
        begun_s: By the clock, where it is to keep pace; `done_ticks` since then.
    """

    order: RunOrder
    cycles: Iterator[str]
    done: Callable[[Callable[[], Json]], None]
    left: int
    begun_s: float = field(default_factory=time.monotonic)
    done_ticks: int = 0


@dataclass(frozen=True, slots=True)
class Mark:
    """Something that was done by hand, or that ended a run.

    Attributes:
        tick: After which it was.
        kind: `hand`, `stop`, or, of a log, `finding`.
        changes: The session's then; where `undo` has gone back behind it, it is no more.
    """

    tick: int
    kind: str
    text: str
    changes: int = 0


class Live(Concern):
    """The running system of a studio; all but `__init__` is called in the lane `run`.

    Attributes:
        commands: What the shell would do; None while nothing is open.
        history: What the run did.
        why: Why nothing is open; empty where something is.
        opened: Called with each system that was opened, before its first cycle.
        cycle: Which cycle is under way; 0 for none.
        prove_first: Has the levels proved together beside them, and then something done in this lane.
    """

    name, lane = "run", LANE

    def __init__(
        self,
        opening: Opening,
        tell: Callable[[str, Json], None],
        later: Callable[[Callable[[], None], float], None],
        pace: Pace = WATCHED,
    ) -> None:
        """Prepare; open nothing yet.

        Args:
            opening: What `open` opens.
            tell: As `Hub.tell`.
            later: Has something done in this lane after so many seconds.
            pace: How it runs at first.
        """
        self.opening, self._tell, self._later = opening, tell, later
        self.commands: Commands | None = None
        self.history = History()
        self.why = "its tables are being proved and compiled"
        self.opened: list[Callable[[Session], None]] = []
        self.prove_first: Callable[[Ask, Callable[[], Json]], Json] = lambda _, then: then()
        self.marks: list[Mark] = []
        self.cycle = 0
        self._going: Going | None = None
        self._ended = ""
        self._rate, self._runs = pace.rate, pace.runs
        self._told_s = 0.0
        self._rows: object = None

    def greeting(self) -> Json:
        """Return the state, and tell the page the script's rows and the orders."""
        self._rows = None
        self._later(self._tell_rows, 0.0)
        if self.commands is not None:
            self._tell("run.orders", self._orders())
        return self.state()

    def close(self) -> None:
        """Stop running, end the log that is being written, and let a system go on that runs elsewhere."""
        self._going = None
        self._end_log()
        if self.commands is not None:
            self.commands.session.leave()

    def open(self) -> None:
        """Open the system anew; the run before is gone."""
        self._drop("the system is opened anew")
        self.commands, self.history, self.marks = None, History(), []
        try:
            with PROVER:
                commands = opened(self.opening)
        except CodedError as error:
            self.close_because(error.shown, *error.helps)
            return
        except BaseException as error:
            self.close_because(f"a bug in rcsc: {type(error).__name__}")
            raise
        commands.folder = Path(project_root(str(self.opening.path)))
        system = commands.session.system
        self.history.begin(system)
        system.watch.append(self.history.add)
        self.commands, self.why = commands, ""
        for told in self.opened:
            told(commands.session)
        self._tell("run.orders", self._orders())
        self.changed()
        if self._runs:
            self._runs = False
            self._begin(RunOrder(-1), lambda _: None)

    def close_because(self, *why: str) -> None:
        """Close the system, and give the reason."""
        self._drop("the system is closed")
        self.commands, self.why = None, "; ".join(filter(None, why))
        self.changed()

    def _drop(self, why: str) -> None:
        """End a run whose system goes away, with its log, and report that to whoever asked for it."""
        self._end_log()
        if self.commands is not None:
            self.commands.session.leave()
        going, self._going, self._ended = self._going, None, ""
        if going is not None:
            going.done(lambda: _shown([], Refused(Code.STUDIO, why)))

    def _end_log(self) -> None:
        if self.commands is not None:
            with suppress(Refused):  # its cycles are there; of a log without an end readers say so
                self.commands.session.end_log()

    def held(self, seconds: float) -> None:
        """Tell every page how long one thing takes; 0 once it is over. Not called in the lane, which is held."""
        what = (
            f"cycle {self.cycle} does not come to its end"
            if self.cycle
            else "what was asked is not answered yet"
        )
        helps = "what stands outside the levels, or an extern procedure, holds it; Ctrl-C where `rcsc studio` runs ends it"
        text = f"{what}, for {seconds:.0f} s" if seconds else ""
        self._tell("run.held", {"text": text, "help": helps if self.cycle and seconds else ""})

    # --- what pages see ---

    def state(self) -> Json:
        """Return the state of the run."""
        title = self.opening.script or self.opening.path.resolve().parent.name
        if self.commands is None:
            return {"title": title, "open": False, "why": self.why, "text": f"no system runs: {self.why}"}
        session = self.commands.session
        system = session.system
        return {
            "title": title,
            "open": True,
            "going": self._going is not None,
            "text": self._said(system),
            "ended": self._ended,
            "rate": self._rate,
            "tick": system.tick,
            "first": self.history.first,
            "last": self.history.last,
            "era": self.history.era,
            "tick_ms": system.description.tick_ms,
            "levels": [_level(level) for level in session.levels],
            "chosen": session.chosen,
            "breaks": [{"number": stop.number, "text": stop.text} for stop in session.stops.every],
            "faults": [{"name": name, "on": name in session.faults} for name in faults_of(session.plants)],
            "buffers": [
                {"name": source, "to": ", ".join(targets), "frozen": source in session.memory.frozen}
                for source, targets in system.description.readers().items()
            ],
            "undo": session.kept,
        }

    def _said(self, system: System) -> str:
        tick_ms = system.description.tick_ms
        digits = 3 if tick_ms % 10 else 2  # two ticks are told apart
        return f"{'runs' if self._going else 'paused'} at cycle {system.tick}, {system.tick * tick_ms / 1000:.{digits}f} s"

    def changed(self) -> None:
        """Tell every page the state of the run."""
        self._told_s = time.monotonic()
        self._tell("run.state", self.state())
        self._tell_rows()

    def _tell_rows(self) -> None:
        """Tell the results of the script's rows, if they have changed."""
        operator = None if self.commands is None else operator_of(self.commands.session.system)
        key = (
            None
            if operator is None
            else (id(self.commands), operator.at, len(operator.results), operator.over)
        )
        if key != self._rows:
            self._rows = key
            self._tell("run.rows", None if operator is None else _rows(operator))

    def _orders(self) -> Json:
        """Return every level that is ordered from outside, with the fields of an order."""
        session = self.session()
        levels = served(session.system.description, {level.name: level.sign for level in session.levels})
        return [
            {
                "level": to.level,
                "fields": [_field(to, at) for at in range(len(to.order_leaves)) if at != to.number],
            }
            for to in levels
        ]

    def session(self) -> Session:
        """Return the session.

        Raises:
            Refused: Nothing is open.
        """
        return self._open_commands().session

    def _open_commands(self) -> Commands:
        if self.commands is None:
            raise Refused(Code.STUDIO, f"no system runs: {self.why}")
        return self.commands

    # --- what pages do ---

    def _on_type(self, ask: Ask) -> Json:
        """Run a line as the shell does; one that runs cycles is answered when they are done."""
        line = ask.body.text("line")
        if len(line) > LONGEST_LINE:
            raise Refused(Code.STUDIO, f"a command of more than {LONGEST_LINE} characters")
        commands = self._open_commands()
        order = commands.run_order(line)
        if order is not None:
            return self._begin(order, ask.done)
        if said(line) in {"quit", "clear"}:
            raise Refused(
                Code.STUDIO,
                "the page has no such command: it is one of the shell in a terminal",
                "close the page, or press Ctrl-C where `rcsc studio` runs",
            )
        if commands.proves_together(line):
            return self.prove_first(ask, lambda: self._do(ask, line))
        return self._do(ask, line)

    def _do(self, ask: Ask, line: str) -> Json:
        commands = self._open_commands()
        tick = commands.session.system.tick
        try:
            with ask.proving("proving") if commands.proves(line) else nullcontext():
                shown = commands.do(line)
        except Refused:
            ask.check()  # what was given up is no reason
            raise
        finally:
            self.history.settle(commands.session.system)
            self.marks[:] = [mark for mark in self.marks if mark.changes <= commands.session.changes]
            self.changed()
        if (
            line.split()[:1]
            and not line.strip().endswith("?")
            and line.split(maxsplit=1)[0].casefold() not in (*_LOOKING, "undo")
        ):
            self._mark(tick, "hand", line.strip())
        return {"shown": shown}

    def _on_go(self, ask: Ask) -> Json:
        """Run until a breakpoint, a pause or the end of the script; answer at once."""
        self._open_commands()
        ask.check()
        return self._begin(RunOrder(-1), lambda _: None) and self.state()

    def _begin(self, order: RunOrder, done: Callable[[Callable[[], Json]], None]) -> Json:
        if self._going is not None:
            raise Refused(Code.STUDIO, "it runs already", "pause it first")
        session = self.session()
        if order.steps and order.most == 0:
            return {"shown": self._open_commands().stepped(order.alone)}
        if order.most == 0 or (order.until is not None and session.holds(order.until)):
            return {"shown": [session.run(order.most, order.until)]}
        self._ended = ""
        alone = session.system.level(order.alone) if order.alone else None
        cycles = session.cycles(order.until) if alone is None else session.cycles_alone(alone)
        self._going = Going(order, cycles, done, order.most)
        self._slice(self._going)
        return LATER

    def _on_pause(self, _: Ask) -> Json:
        if self._going is not None:
            self._end(f"cycle {self.session().system.tick}: paused")
        return self.state()

    def _on_rate(self, ask: Ask) -> Json:
        """Set the rate: times as fast as the clock; `null` as fast as it goes."""
        rate = ask.body.number("rate", None)
        if rate is not None and not 0.01 <= rate <= FASTEST:
            raise Refused(Code.STUDIO, f"a rate is 0.01 to {FASTEST:g} times that of the clock")
        self._rate = None if rate is None else float(rate)
        if self._going is not None:
            self._going.begun_s, self._going.done_ticks = time.monotonic(), 0
        self.changed()
        return self.state()

    def _on_words(self, ask: Ask) -> Json:
        """Return the possible words that contain a given part."""
        part = ask.body.text("part").casefold()
        with PROVER:
            every = dict.fromkeys(self._open_commands().completions())
        return list(islice((word for word in every if part in word.casefold()), 100))

    # --- cycles ---

    def _slice(self, going: Going) -> None:
        """Run cycles for a slice, then leave the lane to others."""
        if going is not self._going or self.commands is None:
            return
        system, until_s = self.commands.session.system, time.monotonic() + SLICE_S
        while going is self._going and time.monotonic() < until_s and not self._early(system, going):
            self._cycle(system, going)
        if going is not self._going:
            return
        if time.monotonic() - self._told_s >= TOLD_S:
            self.changed()
        self._later(lambda: self._slice(going), PAUSE_S)

    def _early(self, system: System, going: Going) -> bool:
        """Tell whether the run is ahead of the clock."""
        if self._rate is None:
            return False
        due_s = going.done_ticks * system.description.tick_ms / 1000 / self._rate
        late_s = time.monotonic() - going.begun_s - due_s
        if late_s > 1.0:  # it cannot keep pace, or was held up: what is lost is lost
            going.begun_s += late_s
        return late_s < 0

    def _cycle(self, system: System, going: Going) -> None:
        assert self.commands is not None
        self.cycle = system.tick + 1
        try:
            why = next(going.cycles)
            going.left, going.done_ticks = going.left - 1, going.done_ticks + 1
            if why and not going.order.steps:
                self._end(why)
            elif going.left == 0:
                session, order = self.commands.session, going.order
                shown = (
                    self.commands.stepped(order.alone)
                    if order.steps
                    else [session.not_met(order.most, order.until)]
                )
                self._end(shown[0], hand=True)
            elif (over := ended(system)) and going.order.most < 0:
                self._end(f"cycle {system.tick}: {over}")
        except Refused as refused:
            self._end(str(refused), refused=refused)
        except BaseException as error:
            why = f"cycle {system.tick}: a bug in rcsc: {type(error).__name__}"
            self._end(why, refused=Refused(Code.INTERNAL, why))
            raise
        finally:
            self.cycle = 0

    def _end(self, why: str, *, hand: bool = False, refused: Refused | None = None) -> None:
        """End the run under way, and give the reason."""
        going, self._going, self._ended = self._going, None, why
        assert going is not None
        system = self.session().system
        self.history.settle(system)
        if not hand:
            self._mark(system.tick, "stop", why)
        going.done(lambda: _shown([why], refused))
        self.changed()

    # --- marks ---

    def _mark(self, tick: int, kind: str, text: str) -> None:
        self.marks.append(Mark(tick, kind, text, self.session().changes))
        del self.marks[:-MOST_MARKS]
        self.changed()


def _shown(lines: Output, refused: Refused | None) -> Json:
    if refused is not None:
        raise refused
    return {"shown": lines}


def level_shown(level: RunningLevel | LoggedLevel) -> dict[str, Any]:
    """What a page is told of a level, whatever it runs."""
    tables = {table: list(level.sign.tables.get(table, ())) for table in level.level.every_table}
    return {
        "name": level.name,
        "period_ms": level.level.period_ms,
        "tables": tables,
        "program": level.sign.program,
    }


def _level(level: RunningLevel) -> dict[str, Any]:
    fault = level.sign.fault_text(level.values) if level.fault else ""
    return {**level_shown(level), "now": [list(line) for line in level.lines], "fault": fault}


def _field(to: Served, at: int) -> dict[str, Any]:
    leaf = to.order_leaves[at]
    members = ["false", "true"] if leaf.c_type == "bool" else list(leaf.members)
    return {
        "name": field_of(leaf), "command": at == to.command, "members": members, "text": leaf.shown(leaf.initial), "unit": leaf.unit,
        "range": range_of(leaf),
    }  # fmt: skip


def range_of(leaf: Leaf) -> str:
    """Return the declared range in words, for a number of JavaScript cannot hold every bound; empty where there is none to show."""
    told = leaf.low is not None and not leaf.members and leaf.c_type != "bool"
    return f"{leaf.low} .. {leaf.high}" if told else ""


def operator_of(system: System) -> Operator | None:
    """Return the operator that gives the orders of a script; `undo` puts another in its place."""
    for part in system.outside:
        if isinstance(part, Together):
            return part.operator
        if hasattr(part, "rows") and hasattr(part, "results"):
            return cast(Operator, part)
    return None


def _rows(operator: Operator) -> Json:
    results = {result.row.number: result for result in operator.results}
    rows = []
    for at, row in enumerate(operator.rows):
        result = results.get(row.number)
        state = result.state if result else "under way" if at == operator.at and not operator.over else ""
        reason, ticks = (result.reason, result.ticks) if result else ("", None)
        rows.append(
            {"number": row.number, "text": row.text, "state": state, "reason": reason, "ticks": ticks}
        )
    return {"at": operator.at, "over": operator.over, "rows": rows}


def ended(system: System) -> str:
    """Return the reason why the run has ended outside the levels; empty where it has not."""
    operator = operator_of(system)
    if operator is not None and operator.over and operator.at_rest:
        stopped = operator.stopped
        return (
            "the script is at its end" if stopped is None else f"row {stopped.row.number}: {stopped.reason}"
        )
    others = (part for part in system.outside if part is not operator)
    return "the plant has ended" if any(getattr(part, "over", False) for part in others) else ""

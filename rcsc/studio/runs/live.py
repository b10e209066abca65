"""A system under the hands of the pages: run, paused, stepped, changed, as `rcsc shell` does it.

In: questions of kind `run.*`. Out: answers, and `run.state` to every page whenever something changed. The system runs in slices, so
that a pause is heard between two of them; nothing here waits for a page.
"""

import time
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from rcsc.diagnostics.codes import Code
from rcsc.run.levels import RunningLevel
from rcsc.run.system import System
from rcsc.shell.commands import Commands
from rcsc.shell.opening import Opening, opened
from rcsc.shell.reload.refusal import Refused
from rcsc.studio.hub import Ask, Handler, Json
from rcsc.studio.runs.history import History
from rcsc.studio.runs.shown import moment

LANE = "run"
SLICE_S = 0.02
"""A running system is paused within so long, and one cycle."""
PAUSE_S = 0.002
"""Between two slices, for what else the lane has to do."""
LONGEST_LINE = 4000
"""Characters of a command."""
Keeper: TypeAlias = Callable[[System], Any]


class Live:
    """The running system of a studio; all but `__init__` is called in the lane `run`.

    Attributes:
        commands: What the shell would do; None while nothing is open.
        history: What the run did.
        why: Why nothing is open; empty where something is.
    """

    name, lane = "run", LANE

    def __init__(
        self,
        opening: Opening,
        tell: Callable[[str, Json], None],
        later: Callable[[Callable[[], None], float], None],
    ) -> None:
        """Args: opening: What `open` opens; tell: As `Hub.tell`; later: Has something done in this lane after so many seconds."""
        self.opening, self._tell, self._later = opening, tell, later
        self.commands: Commands | None = None
        self.history = History()
        self.why = "not opened yet"
        self._going = False
        self._shown: list[str] = []

    @property
    def handlers(self) -> Mapping[str, Handler]:
        """By kind."""
        return {
            "run.open": self._open, "run.type": self._type, "run.go": self._go, "run.pause": self._pause, "run.moment": self._moment,
        }  # fmt: skip

    def greeting(self) -> Json:
        """The state, and whose it is."""
        return {**self.state(), "title": self.opening.script or self.opening.path.resolve().parent.name}

    def close(self) -> None:
        """Stop running."""
        self._going = False

    def state(self) -> Json:
        """Where the run is."""
        if self.commands is None:
            return {"open": False, "why": self.why, "text": f"no system runs: {self.why}"}
        system = self.commands.session.system
        return {
            "open": True,
            "going": self._going,
            "text": f"{'runs' if self._going else 'paused'} at cycle {system.tick}",
            "tick": system.tick,
            "first": self.history.first,
            "last": self.history.last,
            "era": self.history.era,
            "tick_ms": system.description.tick_ms,
            "levels": [level.name for level in system.levels],
        }

    # --- questions ---

    def _open(self, ask: Ask) -> Json:
        ask.check()
        self._going, self.commands = False, None
        self.history = History()
        commands = opened(self.opening)
        self.commands = commands
        system = commands.session.system
        self.history.begin(system)
        system.watch.append(self.history.add)
        self._changed()
        return self.state()

    def _session(self) -> Commands:
        if self.commands is None:
            raise Refused(Code.STUDIO, f"no system runs: {self.why}")
        return self.commands

    def _type(self, ask: Ask) -> Json:
        """Do a line as the shell does it."""
        line = ask.body.text("line")
        if len(line) > LONGEST_LINE:
            raise Refused(Code.STUDIO, f"a command of more than {LONGEST_LINE} characters")
        commands = self._session()
        try:
            return {"shown": commands.do(line)}
        finally:
            self.history.settle(commands.session.system)
            self._changed()

    def _moment(self, ask: Ask) -> Json:
        self._session()
        return moment(self.history, ask.body.whole("tick", self.history.first, self.history.last))

    def _go(self, _: Ask) -> Json:
        self._session()
        self._going = True
        self._slice()
        return self.state()

    def _pause(self, _: Ask) -> Json:
        self._going = False
        self._changed()
        return self.state()

    def _slice(self) -> None:
        """Run cycles for a slice, then leave the lane to others."""
        if not self._going or self.commands is None:
            return
        session, until = self.commands.session, time.monotonic() + SLICE_S
        try:
            while time.monotonic() < until:
                session.cycle()
        except Refused as refused:
            self._going = False
            self._shown = [str(refused)]
        self._changed()
        if self._going:
            self._later(self._slice, PAUSE_S)

    def _changed(self) -> None:
        self._tell("run.state", self.state())


def lines_of(levels: tuple[RunningLevel, ...]) -> list[str]:
    """Name the line that each level ran."""
    return [f"{level.name}.{level.table}.{level.line}" for level in levels]

"""Random walks of a level on the reference interpreter, its environment keeping to the contract.

In: a program, its level, its links, a seed. Out: states that can be reached, so that the search for invariants begins near its end; each
state comes from the meaning of the language itself, not from its translation. A walk proves nothing, and no proof rests on one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from random import Random

from rcsc.compose.contract.environment import COMMAND, ECHO, ECHOED, NUMBER, STATUS, Links
from rcsc.compose.contract.given import at_random
from rcsc.compose.contract.transition import EARLY, GHOST, NUMBERS
from rcsc.lang.interpret import UNDEFINED, Fault, cycle, evaluate, initial
from rcsc.lang.model import Enum, Level, OneTable, Program, Scalar, Value, key_bounds, value_of_key


@dataclass(slots=True)
class Walk:
    """One walk.

    Attributes:
        now: Every leaf.
        ghosts: What was asked of the database, as `transition` keeps it.
        ran: The tables and lines that ran.
    """

    program: Program
    level: Level
    links: Links
    random: Random
    now: dict[str, Value] = field(init=False)
    ghosts: dict[str, Value] = field(init=False)
    ran: set[tuple[str, str]] = field(default_factory=set)
    _kinds: dict[str, Scalar] = field(init=False)

    def __post_init__(self) -> None:
        self.now = dict(initial(self.program))
        self._kinds = {str(v.name): v.type for v in self.program.variables}
        self.ghosts = {}
        for asked in self.links.asked:
            self.ghosts[f"{GHOST}{asked.into}"] = False
            for key in asked.keys:
                self.ghosts[f"{GHOST}{asked.into} {key}"] = value_of_key(self._kinds[key], 0)

    def begin_at(self, state: Mapping[str, Value]) -> None:
        """Goes on from a state that a walk has come to."""
        self.now = {leaf: state[leaf] for leaf in self.now}
        self.ghosts = {leaf: state[leaf] for leaf in self.ghosts}

    def states(self, cycles: int) -> Iterator[dict[str, Value]]:
        """The state after each cycle; ends early where a cycle meets a fault, which is for the proof to find."""
        for _ in range(cycles):
            self._take()
            try:
                with at_random(self.program, self.random):
                    outcome = cycle(self.program, self.level, self.now)
            except UNDEFINED:
                return
            if outcome.fault not in {Fault.OK, *EARLY}:
                return
            self.now = outcome.snapshot
            if outcome.line is not None:
                self.ran.add((self._table(), str(outcome.line)))
            yield {**self.now, **self.ghosts}

    def _table(self) -> str:
        """The table that ran, by what the cycle left (`TransitionSystem.table_of`)."""
        if isinstance(self.level.tables, OneTable):
            return str(self.level.tables.table)
        return str(dict(self.level.tables.tables)[evaluate(self.level.tables.selector, self.now)])

    def _any(self, leaf: str) -> Value:
        """A value; of numbers, few different ones where there are many, so that some are equal."""
        kind = self._kinds[leaf]
        low, high = key_bounds(kind)
        if isinstance(kind, Enum) or high - low < 64:
            return value_of_key(kind, self.random.randint(low, high))
        middle = 0 if low <= 0 <= high else low
        return value_of_key(
            kind, min(high, max(low, self.random.choice((low, middle, middle + 1, middle + 2, high))))
        )

    def _take(self) -> None:
        for leaf in self.links.free:
            self.now[leaf] = self._any(leaf)
        if self.links.above is not None:
            self._order()
        for below in self.links.below:
            self._report(below.order, below.report)
        for asked in self.links.asked:
            keys = {f"{GHOST}{asked.into} {key}": self.now[key] for key in asked.keys}
            said = self.ghosts[f"{GHOST}{asked.into}"]
            if not said or any(self.ghosts[name] != value for name, value in keys.items()):
                for leaf in asked.leaves:
                    self.now[leaf] = self._any(leaf)
            self.ghosts |= keys
            self.ghosts[f"{GHOST}{asked.into}"] = True

    def _order(self) -> None:
        """Now and then another order: number and all."""
        above = self.links.above
        assert above is not None
        if self.random.random() < 0.08:
            number = f"{above.order}.{NUMBER}"
            self.now[number] = (int(self.now[number]) + self.random.choice((1, 1, 1, 2))) % NUMBERS
            for leaf in above.numbered:
                if self.random.random() < 0.7:
                    self.now[leaf] = self._any(leaf)

    def _report(self, order: str, report: str) -> None:
        """The last order echoed, or still an older one, with any status."""
        sent, last = self.now[f"{order}.{NUMBER}"], self.now[f"{report}.{ECHO}"]
        for leaf in self.now:
            if leaf.startswith(f"{report}."):
                self.now[leaf] = self._any(leaf)
        echo = self.now[f"{report}.{ECHO}"]
        if last == sent or self.random.random() < 0.5 or echo == (int(sent) + 1) % NUMBERS:
            echo = self.now[f"{report}.{ECHO}"] = sent
            if self.random.random() < 0.5:
                self.now |= {
                    leaf: 0 for leaf in (f"{report}.{STATUS}",) if isinstance(self._kinds.get(leaf), Enum)
                }
        if echo == sent:
            self.now[f"{report}.{ECHOED}"] = self.now[f"{order}.{COMMAND}"]

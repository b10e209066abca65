"""Random walks of a level on the reference interpreter, in an environment that keeps to the contract.

In: a transition system, a seed. Out: reachable states, which give the search for invariants a head start. Each state comes from the
reference meaning of the language, not from its translation. A walk proves nothing, and no proof rests on one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from random import Random

from rcsc.compose.contract.environment import Below
from rcsc.compose.contract.given import at_random
from rcsc.compose.contract.transition import EARLY, GHOST, TransitionSystem
from rcsc.compose.contract.watched import begin, step
from rcsc.lang.interpret import UNDEFINED, Fault, cycle, initial
from rcsc.lang.model import Enum, Value, key_bounds, value_of_key
from rcsc.lang.restart import NUMBERS


@dataclass(slots=True)
class Walk:
    """One random walk on the interpreter.

    Attributes:
        now: The value of every leaf.
        ghosts: The last questions to the database, as in `transition`; `watched`, the states of monitors.
        ran: The tables and lines that ran.
    """

    ts: TransitionSystem
    random: Random
    now: dict[str, Value] = field(init=False)
    ghosts: dict[str, Value] = field(init=False)
    watched: dict[str, Value] = field(init=False)
    ran: set[tuple[str, str]] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.now = dict(initial(self.ts.program))
        kinds = self.ts.kinds
        self.ghosts = {name: value_of_key(kinds[name], 0) for name in kinds if name.startswith(GHOST)}
        self.watched = begin(self.ts.program)

    def begin_at(self, state: Mapping[str, Value]) -> None:
        """Continue from a state that a walk has reached."""
        self.now = {leaf: state[leaf] for leaf in self.now}
        self.ghosts = {leaf: state[leaf] for leaf in self.ghosts}
        self.watched = {leaf: state[leaf] for leaf in self.watched}

    def states(self, cycles: int) -> Iterator[dict[str, Value]]:
        """Yield the state after each cycle; stop at a fault, which the proof has to find."""
        for _ in range(cycles):
            before = dict(self.now)
            self._take()
            try:
                with at_random(self.ts.program, self.random):
                    outcome = cycle(self.ts.program, self.ts.level, self.now)
            except UNDEFINED:
                return
            if outcome.fault not in {Fault.OK, *EARLY}:
                return
            self.now = outcome.snapshot
            self.watched = step(self.ts.program, self.watched, before, self.now)
            self.ran.update(self.ts.lines_before(self.now))
            if outcome.line is not None:
                self.ran.add((self.ts.table_of(self.now), str(outcome.line)))
            yield {**self.now, **self.ghosts, **self.watched}

    def _any(self, leaf: str) -> Value:
        """Draw a value; from a wide range one of a few, so that equal values are common."""
        kind = self.ts.kinds[leaf]
        low, high = key_bounds(kind)
        if isinstance(kind, Enum) or high - low < 64:
            return value_of_key(kind, self.random.randint(low, high))
        middle = 0 if low <= 0 <= high else low
        return value_of_key(
            kind, min(high, max(low, self.random.choice((low, middle, middle + 1, middle + 2, high))))
        )

    def _take(self) -> None:
        links = self.ts.links
        for leaf in links.free:
            self.now[leaf] = self._any(leaf)
        if links.above is not None:
            self._order()
        for below in links.below:
            self._report(below)
        for asked in links.asked:
            keys = {f"{GHOST}{asked.into} {key}": self.now[key] for key in asked.keys}
            was_asked = self.ghosts[f"{GHOST}{asked.into}"]
            if not was_asked or any(self.ghosts[name] != value for name, value in keys.items()):
                for leaf in asked.leaves:
                    self.now[leaf] = self._any(leaf)
            self.ghosts |= keys
            self.ghosts[f"{GHOST}{asked.into}"] = True

    def _order(self) -> None:
        """Change the order now and then, number and all."""
        above = self.ts.links.above
        assert above is not None
        if self.random.random() < 0.08:
            self.now[above.number] = (
                int(self.now[above.number]) + self.random.choice((1, 1, 1, 2))
            ) % NUMBERS
            for leaf in above.numbered:
                if self.random.random() < 0.7:
                    self.now[leaf] = self._any(leaf)

    def _report(self, below: Below) -> None:
        """Report on the last order or an older one, with any status."""
        now, sent, last = self.now, self.now[below.number], self.now[below.echo]
        for leaf in now:
            if leaf.startswith(f"{below.report}."):
                now[leaf] = self._any(leaf)
        if last == sent or self.random.random() < 0.5 or now[below.echo] == (int(sent) + 1) % NUMBERS:
            now[below.echo] = sent
            if self.random.random() < 0.5 and isinstance(self.ts.kinds.get(below.status), Enum):
                now[below.status] = 0
        if now[below.echo] == sent:
            now[below.echoed] = now[below.command]

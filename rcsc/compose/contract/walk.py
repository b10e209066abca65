"""Random walks of a level on the reference interpreter, in an environment that keeps to the contract.

In: a transition system, a seed. Out: reachable states, which give the search for invariants a head start, and lines that run. Each state
comes from the reference meaning of the language, not from its translation. A walk proves nothing, and no proof rests on one.
"""

from collections import deque
from collections.abc import Collection, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from random import Random

from rcsc.compose.contract.environment import Below
from rcsc.compose.contract.given import at_random
from rcsc.compose.contract.transition import EARLY, GHOST, TransitionSystem
from rcsc.compose.contract.watched import as_assumed, begin, step, told_of
from rcsc.lang.interpret import UNDEFINED, Fault, Outcome, cycle, holds, initial
from rcsc.lang.model import Enum, Program, Standing, Value, key_bounds, value_of_key
from rcsc.lang.restart import NUMBERS

TRIES = 8
"""How often inputs are drawn for one cycle, until what is taken for granted of them is so."""
NAMED = 0.5
"""How often a value is drawn of those that assumptions over time name: else few cycles keep one that asks for one of many."""
DEEPER = 100_000
"""Leaves times cycles of walks to lines that random ones do not reach: thousands of cycles of a small level, hundreds of a large one."""
HELD, DRAWN = 5_000, 12
"""From a state that a new line left: the most cycles of a walk that holds its inputs, and how often two cycles are drawn instead."""


@dataclass(slots=True)
class Walk:
    """One random walk on the interpreter.

    Attributes:
        now: The value of every leaf.
        ghosts: The last questions to the database, as in `transition`; `watched`, the states of monitors.
        ran: The tables and lines that ran; `latest`, in the last cycle.
        holds: Whether the environment holds its inputs: it gives again what it gave, as while a time passes.
    """

    ts: TransitionSystem
    random: Random
    now: dict[str, Value] = field(init=False)
    ghosts: dict[str, Value] = field(init=False)
    watched: dict[str, Value] = field(init=False)
    ran: set[tuple[str, str]] = field(default_factory=set)
    latest: set[tuple[str, str]] = field(default_factory=set)
    holds: bool = False
    _program: Program = field(init=False, repr=False)
    _told: Mapping[str, list[Value]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._program = _watching(self.ts)
        self._told = told_of(self.ts.program)
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
        """Yield the state after each cycle; stop at a fault, which the proof has to find, or where no granted inputs are found."""
        for _ in range(cycles):
            outcome = self._cycle()
            if outcome is None or outcome.fault not in {Fault.OK, *EARLY}:
                return
            self.now = outcome.snapshot
            self.latest = set(self.ts.lines_before(self.now))
            if outcome.line is not None:
                self.latest.add((self.ts.table_of(self.now), str(outcome.line)))
            self.ran |= self.latest
            yield {**self.now, **self.ghosts, **self.watched}

    def held(self, known: AbstractSet[tuple[str, str]], drawn: int, most: int) -> Iterator[dict[str, Value]]:
        """Yield the states of a walk whose inputs are drawn for some cycles, then held, until nothing changes or other known lines run."""
        yield from self.states(min(drawn, most))
        self.holds = True
        last: Mapping[str, Value] = {}
        lines = self.latest
        for now in self.states(most - drawn):
            if now == last or (lines and self.latest != lines and self.latest <= known):
                return
            last, lines = now, self.latest
            yield now

    def _cycle(self) -> Outcome | None:
        """Run a cycle whose inputs are as is taken for granted; None if that is not found, or where an operation is not defined."""
        now, ghosts, watched = self.now, self.ghosts, self.watched
        program = self.ts.program
        trusts = bool(self.ts.trusted or self.ts.links.given or program.environment)
        for _ in range(TRIES if trusts and not self.holds else 1):
            self.now, self.ghosts = dict(now), dict(ghosts)
            self._take()
            try:
                with at_random(self.ts.program, self.random):
                    outcome = cycle(self._program, self.ts.level, self.now)
                left = step(program, watched, now, outcome.snapshot)
                if not trusts or (self._as_granted(outcome) and as_assumed(program, watched, left)):
                    self.watched = left
                    return outcome
            except UNDEFINED:
                return None
        return None

    def _as_granted(self, outcome: Outcome) -> bool:
        """Return whether a cycle was as its tables declare of inputs, and as other levels owe them."""
        return self.ts.trusted.isdisjoint(map(str, outcome.failed_assumptions)) and all(
            holds(fact.condition, self.now) for fact in self.ts.links.given
        )

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
        if not self.holds:
            for leaf in links.free:
                told = self._told.get(leaf)
                self.now[leaf] = (
                    self.random.choice(told) if told and self.random.random() < NAMED else self._any(leaf)
                )
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


def _watching(ts: TransitionSystem) -> Program:
    """Return the program with what is trusted of inputs watched: a cycle then tells where it fails, and does nothing else otherwise."""
    return replace(
        ts.program,
        assumptions=tuple(
            replace(one, standing=Standing.WATCHED) if one.name in ts.trusted else one
            for one in ts.program.assumptions
        ),
    )


def reached_further(
    ts: TransitionSystem,
    wanted: Collection[tuple[str, str]],
    ran: Mapping[tuple[str, str], Mapping[str, Value]],
) -> set[tuple[str, str]]:
    """Return those of these lines that run, as far as walks find it that hold their inputs: then times pass, and counters come to an end.

    They begin in the states that known lines left, `ran`, with those of the wanted tables first. From each, inputs are held as long as the
    same lines run; then drawn once, and held; then drawn for two cycles, some times. Where a new line ran it goes on, and from just before.
    """
    tables = {table for table, _ in wanted}
    left = DEEPER // max(1, len(ts.kinds))
    known = set(ran)
    new = deque(ran[at] for at in sorted(ran, key=lambda at: (at[0] not in tables, at)))
    turn = 0
    while left > 0 and new and not known.issuperset(wanted):
        state = new.popleft()
        for drawn, cycles in ((0, HELD), (1, HELD), *[(2, 2)] * DRAWN):
            turn += 1
            walk = Walk(ts, Random(turn))  # noqa: S311  # repeatable on purpose
            walk.begin_at(state)
            before = state
            for now in walk.held(known, drawn, min(cycles, left)):
                left -= 1
                if walk.ran - known:
                    known |= walk.ran
                    new.extendleft((before, now))
                before = now
        new.append(state)
    return known & set(wanted)

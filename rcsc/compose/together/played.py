"""A run of all levels, as the interpreter does it: the circuit says what comes from outside, and nothing else of it is believed.

In: levels together, a run of their circuit. Out: for each tick the cycles of the levels that ran in it, and whether the last breaks the
requirement, by its monitor stepped along the run. `rerun` repeats the same on the Python and the C executors.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import lcm

from rcsc.compose.contract.given import refused
from rcsc.compose.contract.obligations import obligations
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.counterexample.cycle_run import CycleRun, one_cycle
from rcsc.compose.exact.bounded import Looked, looked_without
from rcsc.compose.exact.circuit import Circuit, circuit
from rcsc.compose.exact.eventual import Lasso
from rcsc.compose.exact.explicit import Run
from rcsc.compose.together.product import EVERY, NOW, Surroundings, Tick, Together
from rcsc.lang.interpret import Fault, holds, initial
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Expr, Property, Value, VariableName, earlier, value_of_key
from rcsc.lang.over_time.past import negation
from rcsc.lang.over_time.run import Watch
from rcsc.lang.restart import NUMBERS, After, Fixed, SameAs, Stands
from rcsc.proof.symbolic.values import Node

CONFLICTS = 500
"""Conflicts of the search for short runs that break a requirement, in all surroundings together."""
State = dict[str, Value]
Ticks = tuple[Mapping[str, CycleRun], ...]


@dataclass(frozen=True, slots=True)
class PlayedRun:
    """A run of levels; none where it has no ticks.

    Attributes:
        ticks: The cycle of each level that ran, tick by tick.
        late: For each tick the readers' ends of buffers that are seen late, with by how many ticks: no more than shows them the same.
    """

    ticks: Ticks = ()
    late: tuple[Mapping[str, int], ...] = ()


@dataclass(slots=True)
class Playing:
    """Levels that run tick by tick on the interpreter.

    Attributes:
        now: The leaves of each level; its inputs as it last took them, admitted or not.
        found: The states of the monitors of its own requirements; None where they begin.
        admitted: The inputs of each as it last took them: what is refused is not taken.
        given: What stands in the buffers of the parties outside.
        left: What the levels left after each tick, and `told`, what the parties outside gave in each.
        stood: The inputs of each level as they stood in the tick in which it begins anew, where it does.
    """

    ts: Together
    now: dict[str, State] = field(init=False)
    found: dict[str, Mapping[str, Value] | None] = field(init=False)
    admitted: dict[str, State] = field(init=False)
    given: State = field(init=False)
    left: list[Mapping[str, State]] = field(default_factory=list)
    told: list[State] = field(default_factory=list)
    stood: dict[str, State] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.now = {name: dict(initial(member.program)) for name, member in self.ts.members.items()}
        self.found = dict.fromkeys(self.now)
        self.admitted = {
            name: {leaf: self.now[name][leaf] for leaf in member.inputs}
            for name, member in self.ts.members.items()
        }
        first = {str(v.name): v.initial for v in self.ts.program.variables}
        self.given = {name: first[name] for name in self.ts.given}

    @property
    def state(self) -> State:
        """What requirements read: the leaves of all levels, and of what stands outside."""
        state = {
            f"{name}.{leaf}": value
            for name, now in self.now.items()
            for leaf, value in {**now, **self.admitted[name]}.items()
        }
        return state | self.given | {mine: state[same] for mine, same in self.ts.shown.items()}

    def tick(
        self, asked: Mapping[str, "Asked"], given: State, late: Mapping[str, int]
    ) -> dict[str, CycleRun]:
        """Run a tick: each level takes what the tick before left, or what stood in its buffers some ticks before.

        Args:
            asked: What befalls each level.
            given: What parties outside give, of what they change.
            late: By how many ticks each reader's end of a buffer is seen late.
        """
        self.given = self.given | given
        self.told.append(self.given)
        buffers = {own: self._buffer(own, late) for own in {*self.ts.wired, *self.ts.held}}
        steps = {
            name: step
            for name in self.ts.members
            if (step := self._level(name, asked[name], buffers)) is not None
        }
        self.left.append({name: dict(now) for name, now in self.now.items()})
        return steps

    def _buffer(self, own: str, late: Mapping[str, int]) -> Value:
        """Return what an input finds in its buffer in the tick that runs."""
        end = self.ts.sources[own].end
        return self._content(own, self.newest(end, len(self.left)) - late.get(end, 0))

    def _content(self, own: str, at: int) -> Value:
        """Return what the buffer of an input held after a tick, counted from 0; where nothing had arrived, what the input begins with."""
        (reader, _, leaf), source = own.partition("."), self.ts.sources[own]
        if at < 0:
            return initial(self.ts.members[reader].program)[leaf]
        return (
            self.left[at][source.party][source.leaf] if own in self.ts.wired else self.told[at][source.name]
        )

    def newest(self, end: str, now: int) -> int:
        """Return the tick whose content a reader finds in tick `now` where it is not late: of a party outside, that tick."""
        return now - any(self.ts.sources[own].end == end for own in self.ts.wired)

    def contents(self, end: str, at: int) -> tuple[Value, ...]:
        """Return all that a buffer that may be late held after a tick, for one of its readers."""
        return tuple(self._content(own, at) for own, source in self.ts.held.items() if source.end == end)

    def _level(self, name: str, asked: "Asked", buffers: State) -> CycleRun | None:
        member, before = self.ts.members[name], dict(self.now[name])
        taken = {leaf: self.admitted[name][leaf] for leaf in member.inputs} | dict(asked.taken)
        taken |= {leaf: buffers[own] for leaf in member.inputs if (own := f"{name}.{leaf}") in buffers}
        here = {leaf: taken[leaf] for leaf in self.ts.kept.get(name, ())}
        found = here if asked.stops or asked.first else self.stood.get(name, here)
        self.stood[name] = here if asked.due or asked.was_due else found
        if not asked.due:
            return None
        if asked.anew:
            found = taken | found
            before, self.found[name] = begun_anew(self.ts, name, before, found, first=asked.first), None
        if asked.refused:
            leaf = _refused(member)
            taken[leaf] = refused(member.program.variable(leaf))
        step = one_cycle(member, before, taken, (), self.found[name])
        self.now[name], self.found[name] = dict(step.after), step.left
        if step.fault is not Fault.ADMIT:
            self.admitted[name] = {leaf: step.after[leaf] for leaf in member.inputs}
        return replace(step, anew=asked.anew)


@dataclass(frozen=True, slots=True)
class Asked:
    """What befalls a level in a tick; `taken`, those inputs that are told; `was_due`, whether it ran in the tick before."""

    due: bool
    was_due: bool
    anew: bool
    stops: bool
    refused: bool
    taken: Mapping[str, Value]
    first: bool


def _refused(member: TransitionSystem) -> str:
    """Return the input that is refused in runs: none that selects a table, where there is another."""
    selects = {str(name) for selector in member.level.selectors for name in read_by(selector)}
    return min(member.refusable, key=lambda leaf: leaf in selects)


def begun_anew(ts: Together, name: str, stood: State, taken: State, *, first: bool) -> State:
    """Return the state in which a level begins anew, as `run.adopt.restart` makes it; at first its buffers are empty."""
    program = ts.members[name].program
    start = {**initial(program), **taken}
    for leaf, adopted in program.adopted.items():
        match adopted:
            case Fixed(value):
                start[leaf] = value
            case SameAs(other):
                start[leaf] = start[other]
            case Stands():
                start[leaf] = stood[leaf]
            case After(echo):
                start[leaf] = (int(start[echo] if first else stood[leaf]) + 1) % NUMBERS
    return start


def played(ts: Together, made: Circuit, run: Run, stated: Property) -> PlayedRun | None:
    """Run a run of the circuit; None where the interpreter does not break the requirement in its last tick, and in no tick before.

    Args:
        ts: The levels.
        made: Their circuit.
        run: Of it.
        stated: The requirement that it breaks.
    """
    playing, watch = Playing(ts), Watch(stated)
    environment = [Watch(one) for one in ts.program.environment]
    ticks, ages, kept = list[Mapping[str, CycleRun]](), list[Mapping[str, int]](), True
    for number, given in enumerate(run.given):
        if not kept:
            return None
        tick = made.step.cycle if number else made.firsts[run.begins].cycle
        assert isinstance(tick, Tick)
        before = playing.state
        late = {end: int(ticks) for end, ticks in _told(tick.late, given).items()}
        if not _never_back(ts, late, ages[-1] if ages else {}):
            return None
        ticks.append(_ticked(playing, tick, given, number, late))
        ages.append(late)
        after = playing.state
        if any(step.ends_the_run for step in ticks[-1].values()):
            return None
        if not all(one.keeps(before, after) for one in environment):
            return None
        kept = watch.keeps(before, after)
    return None if kept else PlayedRun(tuple(ticks), _least_late(playing, ticks, ages))


def _ticked(
    playing: Playing, tick: Tick, given: Mapping[str, int], number: int, late: Mapping[str, int]
) -> dict[str, CycleRun]:
    """Run a tick as the circuit says, with buffers that are so late."""
    asked = {name: _asked(playing.ts, tick, name, given, number) for name in playing.ts.members}
    outside = _told({leaf: tick.after[leaf] for leaf in playing.ts.given}, given)
    return playing.tick(asked, outside, late)


def played_lasso(
    ts: Together, made: Circuit, lasso: Lasso, stated: Property, fair: Sequence[Expr]
) -> PlayedRun | None:
    """Run a lasso of the circuit, and its loop once more; None where the interpreter does not come round, or a tick of it does not wait.

    Args:
        ts: The levels, as they are scheduled.
        made: Their circuit.
        lasso: Of it.
        stated: The requirement that waits; no tick of the run breaks it.
        fair: Conditions each of which has to hold in some tick of the loop.
    """
    assert stated.monitor is not None
    playing, watch = Playing(ts), Watch(stated)
    waits = Watch(replace(stated, condition=negation(stated.monitor.waits)))
    environment = [Watch(one) for one in ts.program.environment]
    ticks, begins, owed = list[Mapping[str, CycleRun]](), lasso.first - 1, list(fair)
    again = [*lasso.run.given, *lasso.run.given[begins:]]
    stood = list[State]()
    for number, given in enumerate(again):
        at = number if number < len(lasso.run.given) else number - len(lasso.run.given) + begins
        tick = made.step.cycle if at else made.firsts[lasso.run.begins].cycle
        assert isinstance(tick, Tick)
        before = playing.state
        stood += [_compared(playing, made, waits)] if at == begins else []
        ran = _ticked(playing, tick, given, number, {})
        after = playing.state
        calm = all(one.fault is not Fault.ADMIT and not one.anew for one in ran.values())
        kept = [watch.keeps(before, after), not any(one.ends_the_run for one in ran.values())]
        kept += [one.keeps(before, after) for one in environment]
        still = not waits.keeps(before, after) and calm
        if not all(kept) or (number >= begins and not still):
            return None
        looked = {**after, **{str(earlier(VariableName(leaf))): value for leaf, value in before.items()}}
        owed = [one for one in owed if number < begins or not holds(one, looked)]
        if number < len(lasso.run.given):
            ticks.append(ran)
    comes_round = stood[0] == stood[1] == _compared(playing, made, waits)
    return PlayedRun(tuple(ticks)) if comes_round and not owed else None


def _compared(playing: Playing, made: Circuit, waits: Watch) -> State:
    """Return what the requirement depends on, as the interpreter has it: leaves, states of its monitor, and the place in the schedule."""
    state = {**playing.state, **waits.state}
    now = len(playing.left) % lcm(*(playing.ts.periods[name] for name in playing.ts.members))
    return {leaf: state[leaf] for leaf in made.leaves if leaf in state} | {NOW: now}


def _never_back(ts: Together, late: Mapping[str, int], before: Mapping[str, int]) -> bool:
    """Return whether no buffer is seen later than it may be, nor older than in the tick before."""
    return all(0 <= ticks <= min(ts.most_late, before.get(end, 0) + 1) for end, ticks in late.items())


def plainest(ts: Together, made: Circuit, run: Run, stated: Property) -> PlayedRun | None:
    """Run a run of the circuit as `played` does, without those restarts and late buffers that it breaks the requirement without.

    Where parties outside keep to a contract, all are kept that change what a level gives, or that are of what those parties give: they
    might not do the same of a run that is another. Where the database is asked, all are.
    """
    found = played(ts, made, run, stated)
    links = [member.links for member in ts.members.values()]
    outside = {
        party.name for one in links for party in (*one.below, *((one.above,) if one.above else ()))
    } - {*ts.members}
    bound = bool(outside)
    if any(one.asked for one in links):
        return found
    parties = {source.end: source.party for source in ts.sources.values()}
    for at in range(len(run.given) if found is not None else 0):
        tick = made.step.cycle if at else made.firsts[run.begins].cycle
        assert isinstance(tick, Tick)
        late = [node for end, node in tick.late.items() if parties[end] not in outside]
        for node in (*late, *(() if bound else tick.restarts.values())):
            if not node.known and run.given[at].get(node.name):
                without = ({**one, node.name: 0} if at == of else one for of, one in enumerate(run.given))
                other = replace(run, given=tuple(without))
                plainer = played(ts, made, other, stated)
                if plainer is not None and (not bound or _gives_the_same(ts, found, plainer)):
                    run, found = other, plainer
    return found


@dataclass(frozen=True, slots=True)
class ShortRuns:
    """The shortest runs of levels that break requirements: of all of them, and in all surroundings, in one search.

    Attributes:
        ts: The levels, in the hardest surroundings.
        made: Their circuit.
        found: What the search found in each surroundings.
    """

    ts: Together
    made: Circuit
    found: Mapping[Surroundings, Looked]

    @classmethod
    def of(cls, ts: Together, most: int) -> "ShortRuns":
        """Look for runs of at most so many ticks."""
        step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
        made = circuit(ts, firsts, step, obligations(ts, step))
        never = [tuple(_never(around, (*firsts, step))) for around in EVERY]
        return cls(ts, made, dict(zip(EVERY, looked_without(made, most, never, CONFLICTS), strict=True)))

    def breaking(self, stated: Property, around: Surroundings) -> tuple[PlayedRun, int]:
        """Return the shortest run that breaks one, as the interpreter does it, and how long no run is that does."""
        found = self.found[around]
        for key, run in found.runs.items():
            if key[-1] == stated.name:
                return plainest(self.ts, self.made, run, stated) or PlayedRun(), len(run.given) - 1
        cycles = next((until for key, until in found.until.items() if key[-1] == stated.name), found.cycles)
        return PlayedRun(), cycles


def _never(around: Surroundings, ticks: Sequence[Cycle]) -> Iterator[str]:
    """Yield the names of what does not befall levels there."""
    for tick in ticks:
        assert isinstance(tick, Tick)
        for happens, of in ((around.restarts, tick.restarts), (around.refuses, tick.refuses)):
            yield from (node.name for node in of.values() if not happens and not node.known)


def _gives_the_same(ts: Together, one: PlayedRun | None, other: PlayedRun) -> bool:
    """Return whether the levels of two runs leave the same, but for what they take."""
    left = (
        [
            {leaf: value for leaf, value in step.after.items() if leaf not in ts.members[name].inputs}
            for tick in run.ticks
            for name, step in tick.items()
        ]
        for run in (one or PlayedRun(), other)
    )
    return next(left) == next(left)


def _least_late(
    playing: Playing, ticks: Sequence[Mapping[str, CycleRun]], ages: Sequence[Mapping[str, int]]
) -> tuple[dict[str, int], ...]:
    """Return for each tick how late buffers were seen, as little as that shows their readers the same."""
    shown: list[dict[str, int]] = [{} for _ in ticks]
    for end in dict.fromkeys(source.end for source in playing.ts.held.values()):
        reader, last = end.partition(".")[0], len(ticks)
        for at in range(len(ticks) - 1, -1, -1):
            by = ages[at].get(end, 0)
            last = min(last, playing.newest(end, at))
            if reader not in ticks[at]:
                continue  # nobody looks
            seen = playing.contents(end, playing.newest(end, at) - by)
            while playing.contents(end, last) != seen:
                last -= 1
            if late := playing.newest(end, at) - last:
                shown[at][end] = late
    return tuple(shown)


def _asked(ts: Together, tick: Tick, name: str, given: Mapping[str, int], number: int) -> Asked:
    """Read what befalls a level in a tick; what the run does not tell stays as it is, and does not happen."""
    taken = _told(tick.takes[name], given)
    anew, is_refused = (_happens(of[name], given) for of in (tick.restarts, tick.refuses))
    stops = name in tick.stops and _happens(tick.stops[name], given)
    period = ts.periods[name]
    due, was_due = number % period == 0, (number - 1) % period == 0
    return Asked(due, was_due, anew, stops, is_refused, taken, first=number == 0)


def _told(leaves: Mapping[str, Node], given: Mapping[str, int]) -> State:
    """Return the values of these variables, of those that a run tells."""
    return {
        leaf: value_of_key(node.kind, given[node.name]) for leaf, node in leaves.items() if node.name in given
    }


def _happens(node: Node, given: Mapping[str, int]) -> bool:
    return bool(node.low) if node.known else bool(given.get(node.name, 0))

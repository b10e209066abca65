"""Every run of a small level, by functions made of its program and its monitors: what is true of it.

In: a transition system. Out: a `Truth`, of the runs in which nothing is refused, or of all. The functions share with rcsc the meaning of
single operators alone (`small_hierarchies.compiled`); some cycles of each level are run by the interpreter as well.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, TypeAlias

from rcsc.compose.contract.transition import TransitionSystem
from rcsc.lang.interpret import Fault, cycle, initial
from rcsc.lang.model import (
    Admit,
    Assign,
    Expr,
    If,
    Int,
    Kind,
    Monitor,
    Property,
    Statement,
    ToLeaf,
    Value,
    Variable,
    key_bounds,
    value_of_key,
)
from rcsc.lang.over_time.past import FALSE
from rcsc.lang.over_time.run import begun, stepped
from rcsc.lang.protocol.environment import unadmitted
from rcsc.lang.restart import Fixed, SameAs, Stands
from tests.small_hierarchies.compiled import Writer, executed

State: TypeAlias = dict[str, Any]
"""The value of each leaf, and of each state of a monitor."""
Watched: TypeAlias = tuple[bool, bool, bool]
"""Whether a cycle keeps what is said, waits, and asks."""
Taken: TypeAlias = tuple[State, State | None]
"""The inputs as they come, and as a cycle takes them; None where it takes none."""
_READ: set[str] = set()
"""Of what a cycle reads, which nobody asks here."""
COMPARED = 10
"""Cycles of each level that the interpreter runs, too."""
MOST_STATES = 250


class TooManyError(Exception):
    """A level has more states than are looked at."""


class DiffersError(Exception):
    """The interpreter does something else than the functions here."""


@dataclass
class Truth:
    """What is true of a level.

    Attributes:
        least: The cycles of the shortest run that breaks each claim, by name, from the initial values; `restarted`, those that only runs
            from a restart break, likewise.
        asks: The requirements of which some cycle asks for the response.
        most: For how many cycles in a row a requirement waits at most; None for one that waits for ever.
        ends: Whether some run comes to where no inputs keep what is assumed over time.
        states: How many states there are.
    """

    least: dict[str, int] = field(default_factory=dict)
    restarted: dict[str, int] = field(default_factory=dict)
    asks: set[str] = field(default_factory=set)
    most: dict[str, int | None] = field(default_factory=dict)
    ends: bool = False
    states: int = 0

    @property
    def broken(self) -> set[str]:
        """The claims that some run breaks, or waits for, for ever."""
        return {*self.least, *self.restarted, *(name for name, most in self.most.items() if most is None)}


@dataclass
class Runs:
    """A level as functions.

    Attributes:
        run: A cycle, which changes the state in place; `in_range`, whether each value is.
        stated: What is stated of it, by name; `watch`, of each a function that steps its monitor in the state after a cycle, which is given
            with the one before it.
        safe: What outputs show where a cycle is refused.
    """

    ts: TransitionSystem
    run: Callable[..., Any]
    in_range: Callable[[State], bool]
    stated: dict[str, Property]
    watch: dict[str, Callable[[State, State], Watched]]
    safe: State

    @classmethod
    def of(cls, ts: TransitionSystem) -> "Runs":
        """Make them."""
        program = ts.program
        writer = Writer(program, ts.level, ())
        lines = list(writer.written())
        writer.states = True
        stated = {str(one.name): one for one in (*program.environment, *program.properties)}
        for at, one in enumerate(stated.values()):
            lines += [f"def watch_{at}(s, b):", *_watching(writer, one.monitor, one.condition)]
        space = executed(program, lines)
        watch = {name: space[f"watch_{at}"] for at, name in enumerate(stated)}
        safe: State = {str(v.name): v.safe for v in program.variables if v.safe is not None}
        return cls(ts, space["run"], space["in_range"], stated, watch, safe)

    def begun(self) -> State:
        """Return the state before the first cycle."""
        state: State = dict(initial(self.ts.program))
        for one in self.stated.values():
            if one.monitor is not None:
                state |= begun(one.monitor)
        return state

    def restarts(self, inputs: Sequence[State]) -> Iterator[State]:
        """Yield the states before the first cycle after a restart, for any of these inputs in the buffers."""
        program = self.ts.program
        for taken in inputs:
            state = {**self.begun(), **taken}
            free = []
            for leaf, adopted in program.adopted.items():
                match adopted:
                    case Fixed(value):
                        state[leaf] = value
                    case SameAs(other):
                        state[leaf] = state[other]
                    case Stands():
                        free.append(leaf)
                    case _:
                        raise AssertionError(adopted)
            for stood in product(*(values_of(self.ts, leaf) for leaf in free)):
                yield {**state, **dict(zip(free, stood, strict=True))}

    def taken(self, *, outside: bool) -> list[Taken]:
        """List what the environment may give in a cycle, with numbers just outside their range or without."""
        variables = [v for v in self.ts.program.variables if v.kind is Kind.INPUT]
        every = product(
            *(values_of(self.ts, str(v.name), outside=outside and unadmitted(v)) for v in variables)
        )
        return [self._admitted(variables, chosen) for chosen in every]

    def _admitted(self, variables: Sequence[Variable], chosen: Sequence[Value]) -> Taken:
        came = dict(zip(self.ts.inputs, chosen, strict=True))
        took = {}
        for variable, value in zip(variables, chosen, strict=True):
            low, high = key_bounds(variable.type)
            if not low <= value <= high and variable.admit is not Admit.CLAMP:
                return came, None
            took[str(variable.name)] = value if low <= value <= high else min(max(value, low), high)
        return came, took

    def step(self, before: State, taken: Taken) -> tuple[State, list[Watched]]:
        """Run a cycle, and the monitors after it, in the order of `watch`."""
        came, took = taken
        after = {**before, **(came if took is None else took)}
        if took is None:
            after.update(self.safe)
        else:
            fault = self.run(after, _READ, None)[2]
            assert fault is Fault.OK, fault
        return after, [watch(after, before) for watch in self.watch.values()]

    def compare(self, before: State, taken: Taken) -> None:
        """Run the same cycle by the interpreter. Raises DiffersError: it does something else."""
        after, every = self.step(before, taken)
        watched = dict(zip(self.watch, every, strict=True))
        leaves = {str(v.name): before[str(v.name)] for v in self.ts.program.variables}
        outcome = cycle(self.ts.program, self.ts.level, {**leaves, **taken[0]})
        for name, one in self.stated.items():
            if one.monitor is None:
                continue
            own = {str(state.name): before[str(state.name)] for state in one.monitor.states}
            left, kept = stepped(one.monitor, one.condition, own, before, outcome.snapshot)
            if kept != watched[name][0] or any(after[state] != value for state, value in left.items()):
                raise DiffersError(f"monitor of {name}")
        if any(after[leaf] != value for leaf, value in outcome.snapshot.items()):
            raise DiffersError("a cycle")


def values_of(ts: TransitionSystem, leaf: str, *, outside: bool = False) -> list[Value]:
    """List the values of a leaf; of a number also those just `outside` its range."""
    kind = ts.kinds[leaf]
    low, high = key_bounds(kind)
    more = int(outside and isinstance(kind, Int))
    return [value_of_key(kind, key) for key in range(low - more, high + 1 + more)]


# --- functions as text ------------------------------------------------------------------------


def _watching(writer: Writer, monitor: Monitor | None, condition: Expr) -> Iterator[str]:
    """Write the body of a function that steps a monitor in `s`, `b` being the state before; of no monitor, what a cycle keeps."""
    if monitor is None:
        yield f"  return bool({writer.of(condition)}), False, True"
        return
    yield "  defined = True"
    for name, truth in monitor.truths:
        yield f"  try: s[{str(name)!r}] = bool({writer.of(truth)})"
        yield f"  except (ArithmeticError, IndexError, ValueError): s[{str(name)!r}] = defined = False"
    yield f"  s[{str(monitor.defined)!r}] = defined"
    for statement in monitor.statements:
        yield from _statement(writer, statement, "  ")
    waits = "False" if monitor.waits == FALSE else f"bool({writer.of(monitor.waits)})"
    yield f"  return bool({writer.of(condition)}), {waits}, bool({writer.of(monitor.asks)})"


def _statement(writer: Writer, statement: Statement, indent: str) -> Iterator[str]:
    if isinstance(statement, If):
        yield f"{indent}if {writer.of(statement.condition)}:"
        yield f"{indent}  pass"
        for inner in statement.then:
            yield from _statement(writer, inner, f"{indent}  ")
        yield f"{indent}else:"
        yield f"{indent}  pass"
        for inner in statement.orelse:
            yield from _statement(writer, inner, f"{indent}  ")
        return
    assert isinstance(statement, Assign)
    assert isinstance(statement.place, ToLeaf)
    yield f"{indent}s[{str(statement.place.name)!r}] = {writer.of(statement.value)}"


# --- all runs ---------------------------------------------------------------------------------


def truth(runs: Runs, *, refused: bool = False) -> Truth:
    """Run every input in every state that is reached; inputs may be `refused`, and stand outside their ranges at a restart.

    Raises:
        TooManyError: The states are too many.
        DiffersError: The interpreter does something else.
    """
    found, taken = Truth(), runs.taken(outside=refused)
    names, compared = list(runs.watch), 0
    assumed = [at for at, one in enumerate(runs.stated.values()) if one.assumed]
    waits: list[list[tuple[int, int]]] = [[] for _ in names]
    places: dict[tuple[Value, ...], int] = {}
    starts = [came for came, _ in taken]
    for least, begins in ((found.least, [runs.begun()]), (found.restarted, list(runs.restarts(starts)))):
        wave, depth = [], 0
        for state in begins:
            wave += (
                [state] if places.setdefault(tuple(state.values()), len(places)) == len(places) - 1 else []
            )
        while wave:
            depth += 1
            following = []
            for before in wave:
                source, ends = places[tuple(before.values())], True
                for given in taken:
                    if compared < COMPARED:
                        runs.compare(before, given)
                        compared += 1
                    after, watched = runs.step(before, given)
                    if not all(watched[at][0] for at in assumed):
                        continue
                    ends = False
                    key = tuple(after.values())
                    target = places.get(key)
                    if target is None:
                        assert runs.in_range(after) or refused, (
                            "the level is drawn wrongly: a value is out of range"
                        )
                        target = places[key] = len(places)
                        following.append(after)
                    for at, (kept, waiting, asks) in enumerate(watched):
                        if waiting:
                            waits[at].append((source, target))
                        if not kept and names[at] not in found.least:
                            least.setdefault(names[at], depth)
                        if asks:
                            found.asks.add(names[at])
                found.ends = found.ends or ends
            if len(places) > MOST_STATES:
                raise TooManyError
            wave = following
    found.most = {name: _longest(edges) for name, edges in zip(names, waits, strict=True) if edges}
    found.states = len(places)
    return found


def _longest(edges: Sequence[tuple[int, int]]) -> int | None:
    """Return the most edges that follow one another; None where they go round."""
    onward: dict[int, set[int]] = {}
    back: dict[int, set[int]] = {}
    for source, target in edges:
        onward.setdefault(source, set()).add(target)
        back.setdefault(target, set()).add(source)
    left = {source: len(targets) for source, targets in onward.items()}
    most = dict.fromkeys({*onward, *back}, 0)
    ends = [at for at in most if at not in left]
    while ends:
        target = ends.pop()
        for source in back.get(target, ()):
            most[source] = max(most[source], 1 + most[target])
            left[source] -= 1
            if not left[source]:
                ends.append(source)
    return None if any(left.values()) else max(most.values())

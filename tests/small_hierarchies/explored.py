"""Every state that a level can reach in its environment, and the least number of cycles in which each obligation breaks.

In: a role. Out: `Explored`. States are the same under other names for their numbers (`hierarchies_world`). What a cycle did not read, it
would have done with any other value (`Reading`), and an input that the contract does not speak of is not remembered. Cycles run
compiled (`hierarchies_compiled`); each that leads to a new state, or is the first to break something, and some of the others are run
once more by the interpreter's own `cycle`, and some of these by its parts.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from operator import itemgetter

from rcsc.lang.interpret import Fault, evaluate
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Enum, Int, Kind, Program, Value, Variable
from rcsc.lang.restart import Part, Stands, by_names
from rcsc.run.adopt import adopt
from rcsc.run.signature import Leaf, Signature
from tests.small_hierarchies.level import EARLY, UNDEFINED, Key, Ran, Role, State, number_type
from tests.small_hierarchies.world import broken, canonical, offers

MOST_RUN = 8_000
"""Cycles that are worth running."""
SOME = 16
"""One cycle of so many is run once more by the interpreter's `cycle`, whatever it does."""


class TooManyError(Exception):
    """More states, or cycles, than are worth listing."""


def restarts(role: Role) -> Iterator[dict[str, Value]]:
    """The states with which a level begins anew, whatever stands in its buffers that its neighbours may write there."""
    remembered = [leaf for leaf in role.inputs if leaf in role.remembered]
    standing = [str(leaf) for leaf, how in role.program.adopted.items() if how == Stands()]
    for values in product(*(_few(role, leaf) for leaf in (*remembered, *standing))):
        now = role.start | dict(zip(remembered, values, strict=False))
        if _owed(role, now):
            yield adopted(role, now, dict(zip(standing, values[len(remembered) :], strict=True)))


def _few(role: Role, leaf: str) -> tuple[Value, ...]:
    """Values of a leaf; two of a number."""
    return (0, 1) if role.program.variable(leaf).type == number_type(role) else role.domain(leaf)


def _owed(role: Role, now: dict[str, Value]) -> bool:
    """Whether what stands in the buffers is as the neighbours owe it, for some values of what is not remembered."""
    facts = [fact.condition for fact in role.links.given]
    read = {str(leaf) for fact in facts for leaf in read_by(fact)}
    free = sorted(read - role.remembered)
    return any(
        all(evaluate(fact, {**now, **dict(zip(free, values, strict=True))}) is True for fact in facts)
        for values in product(*(_few(role, leaf) for leaf in free))
    )


def adopted(
    role: Role, now: Mapping[str, Value], stands: Mapping[str, Value] | None = None
) -> dict[str, Value]:
    """A state as the system makes it when a level is started again; what its own buffers hold `stands`."""
    sign = _signed(role)
    still = {sign.index[leaf]: value for leaf, value in (stands or {}).items()}
    return dict(zip(role.leaves, adopt(sign, tuple(now[leaf] for leaf in role.leaves), still), strict=True))


def _signed(role: Role) -> Signature:
    """What `adopt` is told of a level, made once."""
    if role.signature is None:
        object.__setattr__(role, "signature", _signature(role.program))
    assert role.signature is not None
    return role.signature


def _signature(program: Program) -> Signature:
    """What `adopt` is told of a program: names, kinds, members, and what it adopts, as its declarations or its names say it."""
    leaves = tuple(
        Leaf(
            str(v.name), v.kind.value, "", "", "", v.type.members if isinstance(v.type, Enum) else (), None, None, "", v.initial, "",
        )
        for v in program.variables
    )  # fmt: skip
    index = {leaf.name: at for at, leaf in enumerate(leaves)}
    said = by_names({str(v.name): _part(v) for v in program.variables})
    declared = said if program.restart is None else {str(leaf): how for leaf, how in program.restart}
    restart = {index[leaf]: how for leaf, how in declared.items()}
    return Signature(str(program.name), "", "", leaves, {}, (), (), index, restart=restart)


def _part(variable: Variable) -> Part:
    """What the name of a leaf may mean."""
    kind = variable.type
    members = kind.members if isinstance(kind, Enum) else ()
    whole = (kind.low, kind.high) if isinstance(kind, Int) else None
    return Part(variable.kind is Kind.OUTPUT, members, whole)


@dataclass
class Explored:
    """What is true of a level.

    Attributes:
        least: Obligations that break in a run from the first cycle, with the least number of cycles.
        restarted: Obligations that break in a run from a restart only.
        states: How many there are, up to the names of numbers; `cycles`, how many were run.
        lines: That ran, each with its table.
        undefined: Whether some cycle computes what is not defined, or a value outside its range.
    """

    least: dict[Key, int] = field(default_factory=dict)
    restarted: set[Key] = field(default_factory=set)
    states: int = 0
    cycles: int = 0
    lines: set[tuple[str, str]] = field(default_factory=set)
    undefined: bool = False

    def breaks(self, key: Key) -> bool:
        """Whether an obligation breaks in any run."""
        return key in self.least or key in self.restarted


def explored(role: Role, most: int = 4000, seen: set[State] | None = None) -> Explored:
    """Every state that a level can reach, breadth first.

    Args:
        role: The level.
        most: States after which it is given up.
        seen: Takes the states, as `canonical` gives them.

    Raises:
        TooManyError: There are more than `most`, or more than `MOST_RUN` cycles.
    """
    found, seen = Explored(), set() if seen is None else seen

    def first(key: Key, depth: int) -> None:
        found.least.setdefault(key, depth)

    def later(key: Key, _depth: int) -> None:
        if key not in found.least:
            found.restarted.add(key)

    _search(role, [role.start], seen, found, first, most, anew=False)
    _search(role, restarts(role), seen, found, later, most, anew=True)
    found.states = len(seen)
    return found


def _search(
    role: Role,
    starts: Iterable[dict[str, Value]],
    seen: set[State],
    found: Explored,
    say: Callable[[Key, int], None],
    most: int,
    *,
    anew: bool,
) -> None:
    depth, wave = 1, [canonical(role, start) for start in starts]
    while wave:
        following = []
        for before in wave:
            for taken, ran in successors(role, before):
                found.cycles += 1
                if found.cycles > MOST_RUN:
                    raise TooManyError
                if ran.fault is UNDEFINED:
                    found.undefined = True
                    continue
                if ran.line:
                    found.lines.add((ran.table, ran.line))
                keys = list(broken(role, before, taken, ran, anew=anew and depth == 1))
                fresh = any(not found.breaks(key) for key in keys)
                for key in keys:
                    say(key, depth)
                new = _new(role, ran, seen)
                if fresh or new is not None or found.cycles % SOME == 0:
                    role.confirmed({**before, **taken}, ran)
                if new is not None:
                    following.append(new)
        if len(seen) > most:
            raise TooManyError
        depth, wave = depth + 1, following


def _new(role: Role, ran: Ran, seen: set[State]) -> dict[str, Value] | None:
    """The state that a cycle left, where it was not seen before; a fault ends a run."""
    if ran.fault not in {Fault.OK, *EARLY}:
        return None
    state = canonical(role, ran.after)
    key = tuple(state.values())
    if key in seen:
        return None
    seen.add(key)
    return state


def successors(
    role: Role, before: Mapping[str, Value], also: frozenset[str] = frozenset()
) -> Iterator[tuple[dict[str, Value], Ran]]:
    """Each different thing that the next cycle can do: inputs that it does not read are not varied (`offers`), but for those in `also`.

    Where what the tables are declared to rely on is not so, there is no such cycle.
    """
    left = offers(role, before)
    while left:
        taken = dict(zip(role.inputs, left[0], strict=True))
        read: set[str] = set()
        for ran in role.ways({**before, **taken}, read):
            if not ran.failed & role.trusted:
                yield taken, ran
        used = read | role.watched | also
        places = [at for at, leaf in enumerate(role.inputs) if leaf in used]
        if not places:
            return
        look = itemgetter(*places)
        same = look(left[0])
        left = [one for one in left if look(one) != same]

"""The small instance: which few values each name may have, and what stands for what.

In: groups of names. Out: a `Domain` for each name. The abstractions, all of them reductions, so that what is found is to be believed only
as far as a run shows it, and what is not found is no proof:

- *Numbers* that are only counted round and compared for equality go round after few (`Breadth.numbers`).
- *Counters* that are only counted and compared with constants have the gaps between these closed (`Breadth.gap`).
- *Data* from outside takes one value for each class that conditions tell apart, at least `Breadth.values` (two where a property compares
  it with other data), at most `Breadth.most`; so do enumerations, but those of the protocol (commands, statuses), which take every value.
- *Reals* are those few values, and what is computed of them is any of them (`cycle.statements`).
"""

from bisect import bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from rcsc.compose.promela.cycle.flows import Group
from rcsc.lang.model import Bool, Enum, Int, Real, Scalar, Value

NARROW = 16
"""Counters of so many values are left as they are."""


@dataclass(frozen=True, slots=True)
class Breadth:
    """How much of the system the instance has.

    Attributes:
        numbers: Command numbers before they go round; at least 3.
        values: Values of data that comes from outside, at least.
        most: At most, where conditions tell more apart.
        gap: Steps of a counter between two constants that it is compared with.
        split: A level reads what the others say some time before it acts, not in the same moment.
    """

    numbers: int = 3
    values: int = 1
    most: int = 2
    gap: int = 1
    split: bool = False


@dataclass(frozen=True, slots=True)
class Domain:
    """What a name may be, as integers of the model.

    Attributes:
        low: Least value that it can have; `high`, the greatest.
        drawn: What it is when it is any.
        codes: Which integer stands for a constant; empty where each stands for itself.
        size: How many numbers there are, where it is one that goes round; else 0.
        words: The reduction, for the header; empty where there is none.
    """

    kind: Scalar
    low: int
    high: int
    drawn: tuple[int, ...]
    codes: Mapping[Value, int] = field(default_factory=dict)
    size: int = 0
    words: str = ""

    def encoded(self, value: Value) -> int:
        """The integer that stands for a constant."""
        if self.size and value not in self.codes:  # the greatest numbers stay those before 0
            many = max(self.codes, default=0)
            return int(value - many if 2 * value > many else value) % self.size
        return self.codes.get(value, int(value))

    def decoded(self, code: int) -> Value:
        """A constant that the integer stands for."""
        for value, one in self.codes.items():
            if one == code:
                return value
        return bool(code) if isinstance(self.kind, Bool) else code


@dataclass(frozen=True, slots=True)
class Smaller:
    """Makes the domains.

    Attributes:
        starts: Values before the first cycle.
        full: Names that take every value of their type.
        numbers: Command numbers, by the contract.
        lazy: Names that are drawn.
    """

    breadth: Breadth
    kinds: Mapping[str, Scalar]
    starts: Mapping[str, Value]
    full: frozenset[str]
    numbers: frozenset[str]
    lazy: frozenset[str]

    def domains(self, groups: Mapping[str, Group]) -> dict[str, Domain]:
        """Of every name."""
        made: dict[int, dict[str, Domain]] = {}
        found = {}
        for name, kind in self.kinds.items():
            if isinstance(kind, Bool):
                found[name] = Domain(kind, 0, 1, (0, 1))
                continue
            group = groups[name]
            if id(group) not in made:
                made[id(group)] = self._group(group)
            found[name] = made[id(group)][name]
        return found

    def _group(self, group: Group) -> dict[str, Domain]:
        kinds = [self.kinds[name] for name in group.names]
        if any(isinstance(kind, Real) for kind in kinds):
            return self._reals(group)
        if all(isinstance(kind, Int) for kind in kinds):
            if group.goes_round(self.numbers):
                return self._numbers(group)
            wide = any(isinstance(kind, Int) and kind.high - kind.low >= NARROW for kind in kinds)
            if wide and group.counted and not group.computed and not group.paired:
                return self._counter(group)
        return {name: self._plain(name, group) for name in group.names}

    def _numbers(self, group: Group) -> dict[str, Domain]:
        many = self.breadth.numbers if group.round else 2
        size = max(many, 1 + max((int(v) for v in group.told if int(v) < 16), default=0))
        bounds = [_bounds(self.kinds[name])[1] + 1 for name in group.names]
        codes: dict[Value, int] = dict.fromkeys(group.round or {max(bounds)}, size)
        words = f"numbers go round after {size}"
        drawn = tuple(range(size))
        return {
            name: Domain(self.kinds[name], 0, size - 1, drawn, codes, size, words) for name in group.names
        }

    def _counter(self, group: Group) -> dict[str, Domain]:
        """Order-preserving; constants that conditions name stay apart."""
        bounds = {bound for name in group.names for bound in _bounds(self.kinds[name])}
        anchors = sorted({int(v) for v in group.told} | bounds)
        codes: dict[Value, int] = {anchors[0]: anchors[0]}
        for before, at in pairwise(anchors):
            codes[at] = codes[before] + min(at - before, self.breadth.gap)
        for value in sorted({int(v) for v in group.given} | {int(self.starts[name]) for name in group.names}):
            if value not in codes:
                below = anchors[bisect_right(anchors, value) - 1]
                above = anchors[bisect_right(anchors, value)]
                codes[value] = min(codes[below] + value - below, codes[above])
        found = {}
        for name in group.names:
            low, high = _bounds(self.kinds[name])
            words = f"{low} .. {high} stands for itself with the gaps closed: {codes[low]} .. {codes[high]}"
            drawn = tuple(range(codes[low], codes[high] + 1))
            found[name] = Domain(self.kinds[name], codes[low], codes[high], drawn, dict(codes), 0, words)
        return found

    def _plain(self, name: str, group: Group) -> Domain:
        kind = self.kinds[name]
        low, high = _bounds(kind)
        if name in self.full or high - low + 1 <= max(2, self.breadth.values):
            return Domain(kind, low, high, tuple(range(low, high + 1)))
        chosen = self._chosen(low, high, int(self.starts[name]), group)
        words = (
            f"from outside only {', '.join(_word(kind, value) for value in chosen)}"
            if name in self.lazy
            else ""
        )
        return Domain(kind, low, high, tuple(chosen), {}, 0, words)

    def _chosen(self, low: int, high: int, start: int, group: Group) -> list[int]:
        """One of each class, that of the initial value first; then more, up to `values`."""
        told = [int(v) for v in group.told]
        near = [start, *told, *(v + 1 for v in told), *(v - 1 for v in told), low]
        chosen = group.told_apart(v for v in near if low <= v <= high)[: self.breadth.most]
        fill = (v for v in (*sorted(int(g) for g in group.given), *range(low, high + 1)) if low <= v <= high)
        least = max(self.breadth.values, 2 if group.paired or group.apart else 1)
        return sorted(int(v) for v in _filled(chosen, fill, least))

    def _reals(self, group: Group) -> dict[str, Domain]:
        """A few numbers, each by its rank."""
        told = sorted(float(v) for v in group.told)
        given = {float(v) for v in group.given} | {
            float(self.starts[name]) for name in group.names if name not in self.lazy
        }
        drawn = {name: self._few(name, told, sorted(given), group) for name in group.names}
        points = sorted({*told, *given, *(value for values in drawn.values() for value in values)})
        codes: dict[Value, int] = {value: at for at, value in enumerate(points)}
        found = {}
        for name, values in drawn.items():
            few = tuple(codes[value] for value in values)
            words = f"from outside only {', '.join(map(repr, values))}" if name in self.lazy else ""
            found[name] = Domain(self.kinds[name], 0, max(1, len(points) - 1), few, codes, 0, words)
        return found

    def _few(self, name: str, told: list[float], given: Iterable[float], group: Group) -> list[float]:
        kind = self.kinds[name]
        assert isinstance(kind, Real)
        edges = [kind.low, *(v for v in told if kind.low < v < kind.high), kind.high]
        middles = [(a + b) / 2 for a, b in pairwise(edges)]
        near = [v for v in (*told, *middles) if kind.low <= v <= kind.high]
        chosen = group.told_apart(near)[: self.breadth.most] if told else []
        fill = (v for v in (*given, 0.0, 1.0, *middles, kind.low, kind.high) if kind.low <= v <= kind.high)
        least = max(self.breadth.values, 2 if group.paired or group.apart else 1)
        return sorted(float(v) for v in _filled(chosen, fill, least))


def _filled(chosen: Iterable[Value], fill: Iterable[Value], least: int) -> list[Value]:
    """The values, and more where there are fewer than `least`."""
    found = list(dict.fromkeys(chosen))
    for value in fill:
        if len(found) >= least:
            break
        if value not in found:
            found.append(value)
    return found


def _bounds(kind: Scalar) -> tuple[int, int]:
    match kind:
        case Bool():
            return 0, 1
        case Enum(members=members):
            return 0, len(members) - 1
        case Int(low=low, high=high):
            return low, high
        case Real():
            raise TypeError("reals have no integer bounds")


def _word(kind: Scalar, value: int) -> str:
    return kind.members[value] if isinstance(kind, Enum) else str(value)

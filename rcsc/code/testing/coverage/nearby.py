"""Looks beside the cases that meet a place for one that notices what could stand there.

In: places with something that no case notices, and cases that meet them. Out: cases, each another one with some of its values changed:
a variable that the place has to do with at an edge, two of them, or both sides of the key at which a comparison of reals turns.
Whatever is found is confirmed by the interpreter; what is not found may be there.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice, pairwise, zip_longest
from random import Random

from rcsc.code.testing.coverage.case import Case, expected, refused_at
from rcsc.code.testing.coverage.choose import Choice
from rcsc.code.testing.coverage.matters import Matters, Spot
from rcsc.code.testing.executors.edges import leaf_edges
from rcsc.lang.model import Real, Snapshot, Value, Variable, key_bounds, value_of_key

MOST_CHANGES = 100
"""Of the cases that meet a place, in all."""
MOST_BASES = 4
EVERY = 1 << 30
"""Tries: of a case that is kept, all that it may notice is looked at."""
MOST_APART = 2
"""Changes of all variables at once that may be taken for the one at a place."""
MOST_PAIRS = 12
"""Changes of several variables at once, of one case."""
MOST_EDGES = 6


@dataclass(frozen=True, slots=True)
class Nearby:
    """Looks for cases of one program."""

    choice: Choice
    matters: Matters
    edges: Mapping[str, tuple[int, ...]]
    variables: Mapping[str, Variable]
    random: Random

    def all(self) -> None:
        """Look for everything that is open."""
        for number, spot in enumerate(self.matters.spots):
            if self.matters.open.get(number):
                self._of(number, spot)

    def _of(self, number: int, spot: Spot) -> None:
        bases = self.matters.bases.get(number, [])[:MOST_BASES]
        changes = [
            *(self._turns(spot, base) for base in bases),
            *(self._changes(number, spot, base) for base in bases),
        ]
        in_turn = (pair for pairs in zip_longest(*changes) for pair in pairs if pair is not None)
        for case in islice(in_turn, MOST_CHANGES):
            if not self.matters.open[number]:
                return
            self._try(number, case)

    def _try(self, number: int, case: Case) -> None:
        """Offer a case where it notices something that is open at a place."""
        program = self.matters.program
        if refused_at(program, case.before) >= 0:
            return
        right = expected(program, case)
        if right is None or number not in self.matters.met(case):
            return
        for way in list(self.matters.open[number]):
            if self.matters.notices(case, right, number, way):
                spot = self.matters.spots[number]
                origin = f"{spot.where}: {spot.text}, and not {spot.ways[way]}"
                self.choice.offer(replace(case, origin=origin), right, EVERY)
                return

    def _values(self, name: str) -> list[Value]:
        """Some edges of a variable."""
        keys = self.edges[name]
        if len(keys) > MOST_EDGES:
            keys = (keys[0], keys[-1], *self.random.sample(keys, MOST_EDGES - 2))
        return [value_of_key(self.variables[name].type, key) for key in keys]

    def _any(self, name: str) -> Value:
        """A value of a variable."""
        kind = self.variables[name].type
        return value_of_key(kind, self.random.randint(*key_bounds(kind)))

    def _changes(self, number: int, spot: Spot, base: Case) -> Iterator[Case]:
        """Changes of one variable, then of several."""
        ways = (spot.ways[way] for way in self.matters.open[number])
        names = list(dict.fromkeys(name for name in (*ways, *spot.near) if name in self.variables))
        others = [name for name in names if name not in spot.near]
        for _ in range(MOST_APART if others else 0):
            yield changed(base, {name: self._any(name) for name in others})
        for name in names:
            yield from (
                changed(base, {name: value}) for value in self._values(name) if value != base.before[name]
            )
        for _ in range(MOST_PAIRS if names else 0):
            some = self.random.sample(names, min(len(names), self.random.randint(1, 4)))
            some += self.random.sample(list(self.variables), self.random.randint(0, 2))
            yield changed(base, {name: self.random.choice(self._values(name)) for name in some})

    # --- comparisons of reals ---

    def _turns(self, spot: Spot, base: Case) -> Iterator[Case]:
        """Both sides of each key at which a comparison of reals turns, with the other reals as they are and as large as they may be."""
        reals = [n for n in spot.near if n in self.variables and isinstance(self.variables[n].type, Real)]
        for at, other in enumerate(self.matters.spots if reals else ()):
            if other.real and other.where == spot.where and set(other.near) & set(reals):
                for name in reals:
                    rest = [(n, self.variables[n].type, self.edges[n][-1]) for n in reals if n != name]
                    most = {n: value_of_key(kind, key) for n, kind, key in rest}
                    yield from self._turn(at, name, changed(base, most))
                    yield from self._turn(at, name, base)

    def _turn(self, at: int, name: str, base: Case) -> Iterator[Case]:
        """The two neighbouring values of a variable between which a comparison turns."""
        kind = self.variables[name].type

        def with_key(key: int) -> Case:
            return changed(base, {name: value_of_key(kind, key)})

        def outcome(key: int) -> Value | None:
            return self.matters.met(with_key(key)).get(at)

        seen = [(key, outcome(key)) for key in self.edges[name]]
        for (start, first), (end, last) in pairwise(seen):
            if first is None or last is None or first == last:
                continue
            low, high = start, end
            while high - low > 1:
                middle = (low + high) // 2
                low, high = (middle, high) if outcome(middle) == first else (low, middle)
            yield from map(with_key, (low, high))


def changed(base: Case, values: Snapshot) -> Case:
    """A case with some values changed."""
    return replace(base, before={**base.before, **values}, shows=())


def nearby(choice: Choice) -> Nearby:
    """What looks beside the cases of a choice."""
    program = choice.matters.program
    variables = {str(v.name): v for v in program.variables}
    random = Random(program.name)  # noqa: S311  # repeatable
    return Nearby(choice, choice.matters, leaf_edges(program), variables, random)

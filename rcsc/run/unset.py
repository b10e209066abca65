"""Which numbers nobody has set since a run began: what a picture leaves out, and an export leaves empty.

A number without an initial value of its own starts at 0, because it has to start with something: a pose starts in the middle of the
plate, where no robot ever was. It is *unset* until

- its value is another than at first;
- a line ran that may write it, or a procedure that its level runs in each cycle may;
- for an input: its buffer was published by who stands outside, or by a level that had set it; or the database answered.

So a number is called unset only where nobody can have written it, and not because it is 0: a line that
writes just that sets it, too. What is written in the tables' own words has a meaning from the start, and is never unset: members of
enumerations, bools, and what has an initial value. A run that goes on from a state of another, and a log from before symbol
files said what may set a number, have nothing that is unset.

>>> from rcsc.run.unset import Unsets
>>> Unsets((), {}).now
{}

In: the description, each level's signature, and after each tick what ran. Out: by level the places of leaves that are unset.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

from rcsc.run.description import LevelSpec, Wire
from rcsc.run.signature import LevelSign, Signature, Values

Published = Callable[[str], bool]
"""Whether a buffer from outside has been published."""
_OUTSIDE, _NOBODY = -1, -2
"""In place of a level's leaf: what stands outside the levels, or nobody, fills an input."""


@dataclass(frozen=True, slots=True)
class LevelSeen:
    """A level after one of its cycles."""

    name: str
    sign: Signature
    level: LevelSign
    values: Values


@dataclass(slots=True)
class Unsets:
    """What is unset, from the beginning of a run on.

    Attributes:
        wires, feeds: Of the description; what fills inputs.
        now: By level the places of the leaves that are unset.
    """

    wires: Sequence[Wire]
    feeds: Mapping[str, LevelSpec]
    now: dict[str, frozenset[int]] = field(default_factory=dict)
    _signs: dict[str, Signature] = field(default_factory=dict)
    _sources: dict[str, dict[int, tuple[str, int]]] = field(default_factory=dict)
    _given: dict[str, frozenset[int]] = field(default_factory=dict)
    _outside: frozenset[str] = frozenset()

    def begin(self, levels: Iterable[LevelSeen], published: Published) -> None:
        """Take the state from which the run begins: nobody has set anything in it."""
        seen = tuple(levels)
        self._signs = {level.name: level.sign for level in seen}
        for level in seen:
            self._sources[level.name] = self._inputs(level)
            self.now[level.name] = self._as_at_first(level, _all_unset(level.sign))
        self._look_outside(published)

    def adopt(self, levels: Iterable[LevelSeen]) -> None:
        """Go on with levels that run other tables: what nobody had set is unset still, and so is what was not there."""
        seen = tuple(levels)
        before, self._signs = self._signs, {level.name: level.sign for level in seen}
        for level in seen if self.now else ():
            held, given = self.now.get(level.name, frozenset()), self._given.get(level.name)
            old = before[level.name]
            self._sources[level.name] = self._inputs(level)
            self.now[level.name] = self._as_at_first(level, _carried(held, old, level.sign))
            if given is not None:
                self._given[level.name] = _carried(given, old, level.sign)

    def copy(self) -> "Unsets":
        """What is unset now, to be kept while this goes on."""
        return replace(self, now=dict(self.now), _sources=dict(self._sources), _given=dict(self._given))

    def tick(self, ran: Iterable[LevelSeen], published: Published) -> None:
        """Take what a tick did.

        Args:
            ran: The levels that had a cycle, after it.
            published: As of after the tick: what levels take in the next.
        """
        seen = [level for level in ran if level.name in self.now]
        for level in seen:
            left = self.now[level.name] | self._again(level)
            if left:
                self.now[level.name] = self._as_at_first(level, left - self._set_by(level, left))
        self._given |= {level.name: self.now[level.name] for level in seen}
        self._look_outside(published)

    def restarted(self, level: LevelSeen) -> None:
        """Take a level that began anew: what it has as at first is unset again, but for what it adopted."""
        adopted = frozenset(level.sign.restart)
        self.now[level.name] = self._as_at_first(level, _all_unset(level.sign) - adopted)

    def _look_outside(self, published: Published) -> None:
        if any(self.now.values()):
            outside = {
                source for sources in self._sources.values() for source, at in sources.values() if at < 0
            }
            self._outside |= {name for name in outside - self._outside if published(name)}

    def _as_at_first(self, level: LevelSeen, places: frozenset[int]) -> frozenset[int]:
        return frozenset(at for at in places if level.values[at] == level.sign.leaves[at].initial)

    def _set_by(self, level: LevelSeen, left: frozenset[int]) -> set[int]:
        """Return which of those that are left the cycle may have set."""
        begun, ran = (
            level.sign.begun(level.values),
            dict.fromkeys(level.sign.lines_of(level.level, level.values)),
        )
        written = {
            level.sign.index[name]
            for group in level.sign.unset
            if begun
            and (
                level.name in group.levels or any(line in group.tables.get(table, ()) for table, line in ran)
            )
            for name in group.leaves
        }
        return written | {at for at in left if self._taken(*self._sources[level.name].get(at, ("", _NOBODY)))}

    def _again(self, level: LevelSeen) -> frozenset[int]:
        """Return the inputs that a level fills that began anew, and has not set since."""
        if not any(self._given.values()):
            return frozenset()
        sources = self._sources[level.name].items()
        places = {at for at, (source, other) in sources if other in self._given.get(source, ())}
        return _all_unset(level.sign) & places

    def _taken(self, source: str, at: int) -> bool:
        """Return whether what fills an input has said something: somebody outside, the database, or a level that had set it."""
        if at == _NOBODY:
            return False
        if at == _OUTSIDE:
            return not source or source in self._outside
        return source in self._given and at not in self._given[source]

    def _inputs(self, level: LevelSeen) -> dict[int, tuple[str, int]]:
        """Return what fills each input: a level and its leaf, or a buffer from outside; neither for the database."""
        sources: dict[int, tuple[str, int]] = {}
        for wire in self.wires:
            owner, _, variable = wire.target.partition(".")
            if owner == level.name:
                sources |= self._wired(level.sign.record(variable), wire.source)
        spec = self.feeds.get(level.name)
        filled = (level.sign.record(feed.into) for feed in spec.feeds) if spec is not None else ()
        return sources | dict.fromkeys(chain.from_iterable(filled), ("", _OUTSIDE))

    def _wired(self, places: range, source: str) -> dict[int, tuple[str, int]]:
        owner, _, variable = source.partition(".")
        if owner not in self._signs:
            return dict.fromkeys(places, (source, _OUTSIDE))
        return {
            at: (owner, other) for at, other in zip(places, self._signs[owner].record(variable), strict=False)
        }


def _carried(places: frozenset[int], before: Signature, sign: Signature) -> frozenset[int]:
    """Return what of other tables is unset where that was of the tables before."""
    names = {sign.leaves[at].name: at for at in _all_unset(sign)}
    return frozenset(at for name, at in names.items() if before.index.get(name) in {None, *places})


def _all_unset(sign: Signature) -> frozenset[int]:
    return frozenset(sign.index[name] for group in sign.unset for name in group.leaves)

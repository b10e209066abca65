"""Shrinking: the smallest episode nearby that still shows the same, found by deterministic delta debugging.

In: an episode and what it means to fail. Out: an episode that fails, from which nothing that was tried can be left out. Lists lose
elements, larger runs of them first; then numbers move toward what is usual: a field's default, a window of one tick.

It stands beside Hypothesis, which shrinks what it drew and not an episode, and so none that came by a seed or from a file: of the docking
robot whose drive forgets that it began anew, an episode of eight orders and faults becomes one of two in 23 runs here. An episode that
Hypothesis drew choice by choice, another one, came to five in 65 by its own shrinking.

Source: Zeller and Hildebrandt, Simplifying and Isolating Failure-Inducing Input (2002), for removing by halves.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass, replace
from typing import Any, Generic

from rcsc.run.campaign.rig import E

MOST_TRIES = 400
_HALVINGS = 12
_ENDS = {"first_tick": "last_tick", "last_tick": "first_tick"}


class _Spent(Exception):  # noqa: N818  # how a search ends
    """No try is left."""


class _Search(Generic[E]):
    """The best episode so far, and what was tried."""

    def __init__(self, episode: E, fails: Callable[[E], bool], tries: int) -> None:
        self.best = episode
        self._fails, self._left = fails, tries
        self._seen = {episode}

    def try_(self, simpler: Callable[[], E]) -> bool:
        """Return whether the simpler candidate is an episode and fails, too, and keep it if so."""
        try:
            candidate = simpler()
        except ValueError:
            return False
        if candidate in self._seen:
            return False
        if self._left == 0:
            raise _Spent
        self._seen.add(candidate)
        self._left -= 1
        if not self._fails(candidate):
            return False
        self.best = candidate
        return True


def shrink(episode: E, fails: Callable[[E], bool], tries: int = MOST_TRIES) -> E:
    """Return the simplest episode nearby that still fails.

    Args:
        episode: It fails.
        fails: Asked of each candidate; a function of the candidate alone.
        tries: How often at most.
    """
    search = _Search(episode, fails, tries)
    try:
        while True:
            before = search.best
            _round(search)
            if search.best == before:
                return before
    except _Spent:
        return search.best


def _round(search: _Search[E]) -> None:
    """Try everything once; lists first, for an episode without its last orders ends sooner, and makes every later try cheaper."""
    lists = search.best.LISTS
    for name in lists:
        _remove(search, name)
    for name in search.best.PLAINER:
        _plainer(search, name)
    for name in lists:
        for at in range(len(getattr(search.best, name))):
            _simplify(search, name, at)
    _numbers(search, search.best, lambda candidate: candidate)


def _remove(search: _Search[E], name: str) -> None:
    """Leave out runs of elements: all of them, halves, quarters, down to single ones."""
    size = len(getattr(search.best, name))
    while size:
        at = 0
        while at < len(held := getattr(search.best, name)):
            if not _put(search, name, (*held[:at], *held[at + size :])):
                at += size
        size //= 2


def _put(search: _Search[E], name: str, value: Sequence[Any]) -> bool:
    changed: dict[str, Any] = {name: tuple(value)}
    return search.try_(lambda: replace(search.best, **changed))


def _plainer(search: _Search[E], name: str) -> None:
    """Try a field's default: of the paper's cell kinematics, which is easier to follow and costs a tenth."""
    [field] = (field for field in fields(search.best) if field.name == name)
    if getattr(search.best, name) != field.default:
        changed: dict[str, Any] = {name: field.default}
        search.try_(lambda: replace(search.best, **changed))


def _simplify(search: _Search[E], name: str, at: int) -> None:
    """Move the numbers of one element."""
    held = getattr(search.best, name)
    if is_dataclass(held[at]):
        _numbers(search, held[at], lambda element: _placed(search.best, name, at, element))


def _placed(episode: E, name: str, at: int, element: Any) -> E:
    held = getattr(episode, name)
    changed: dict[str, Any] = {name: (*held[:at], element, *held[at + 1 :])}
    return replace(episode, **changed)


def _numbers(search: _Search[E], value: Any, placed: Callable[[Any], E]) -> Any:
    """Move each number of a value toward the usual one: at once, to a round number, or by halves; return what it came to."""
    lists = search.best.LISTS
    for field in fields(value):
        for _ in range(_HALVINGS):
            nearer = next(
                (
                    {field.name: candidate}
                    for candidate in _nearer(value, field, lists)
                    if search.try_(lambda: placed(replace(value, **{field.name: candidate})))  # noqa: B023  # called here
                ),
                None,
            )
            if nearer is None:
                break
            value = replace(value, **nearer)
        if field.name not in lists and isinstance(getattr(value, field.name), tuple):
            value = _inner(search, value, field.name, placed)
    return value


def _inner(search: _Search[E], value: Any, name: str, placed: Callable[[Any], E]) -> Any:
    """Leave out what a tuple within an element can do without, and move the numbers of the rest."""

    def with_held(*held: Any) -> Any:
        return replace(value, **{name: held})

    for at in reversed(range(len(getattr(value, name)))):
        held = getattr(value, name)
        before, item, after = held[:at], held[at], held[at + 1 :]
        if search.try_(lambda: placed(with_held(*before, *after))):  # noqa: B023  # called here
            value = with_held(*before, *after)
        elif is_dataclass(item):
            item = _numbers(search, item, lambda new: placed(with_held(*before, new, *after)))  # noqa: B023
            value = with_held(*before, item, *after)
    return value


def _nearer(value: Any, field: Field[Any], lists: Sequence[str]) -> Iterator[Any]:
    """Yield what a field might hold that is nearer to the usual; the nearest first."""
    now, usual = getattr(value, field.name), _usual(value, field)
    if now == usual:
        return
    if isinstance(now, tuple) and isinstance(usual, tuple) and field.name not in lists:
        yield usual
    numbers = all(isinstance(number, int | float) for number in (now, usual))
    if numbers and not isinstance(now, bool):
        yield usual
        yield from _between(now, usual)


def _between(now: float, usual: float) -> Iterator[float]:
    """Yield numbers nearer to the usual one: a half, a quarter, an eighth of the way; of a float, round ones first."""
    if isinstance(now, int):
        yield from (now + step for part in (2, 4, 8) if (step := int((usual - now) / part)))
        return
    for number in (float(round(now)), round(now, 1), (now + usual) / 2):
        if abs(number - usual) < abs(now - usual):
            yield number


def _usual(value: Any, field: Field[Any]) -> Any:
    """Return a field's default; for the end of a window its other end, so that it narrows."""
    if field.name in _ENDS:
        return getattr(value, _ENDS[field.name])
    return 0 if field.default is MISSING else field.default

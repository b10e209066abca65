"""Shrinking: the smallest episode nearby that still shows the same, found by deterministic delta debugging.

In: an episode and what it means to fail. Out: an episode that fails, from which nothing that was tried can be left out. Lists lose
elements, larger runs of them first; then numbers move toward what is usual: a field's default, a window of one tick.

Source: Zeller and Hildebrandt, Simplifying and Isolating Failure-Inducing Input (2002), for removing by halves.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass, replace
from typing import Any, TypeAlias

from rcsc_cell.episodes.episode import LISTS, Episode

Fails: TypeAlias = Callable[[Episode], bool]

MOST_TRIES = 400
_HALVINGS = 12
_ENDS = {"first_tick": "last_tick", "last_tick": "first_tick"}


class _Spent(Exception):  # noqa: N818  # how a search ends
    """No try is left."""


class _Search:
    """The best episode so far, and what was tried."""

    def __init__(self, episode: Episode, fails: Fails, tries: int) -> None:
        self.best = episode
        self._fails, self._left = fails, tries
        self._seen = {episode}

    def try_(self, candidate: Episode) -> bool:
        """Return whether the simpler candidate fails, too, and keep it if so."""
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


def shrink(episode: Episode, fails: Fails, tries: int = MOST_TRIES) -> Episode:
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
            for name in (
                LISTS
            ):  # rows early: a script without its last rows ends sooner, and makes every later try cheaper
                _remove(search, name)
            _backend(search)
            for name in LISTS:
                for at in range(len(getattr(search.best, name))):
                    _simplify(search, name, at)
            _numbers(search, search.best, lambda candidate: candidate)
            if search.best == before:
                return before
    except _Spent:
        return search.best


def _remove(search: _Search, name: str) -> None:
    """Leaves out runs of elements: all of them, halves, quarters, down to single ones."""
    size = len(getattr(search.best, name))
    while size:
        at = 0
        while at < len(held := getattr(search.best, name)):
            if not _put(search, name, (*held[:at], *held[at + size :])):
                at += size
        size //= 2


def _put(search: _Search, name: str, value: Sequence[Any]) -> bool:
    changed: dict[str, Any] = {name: tuple(value)}
    return search.try_(replace(search.best, **changed))


def _backend(search: _Search) -> None:
    """Try kinematics, which is easier to follow and costs a tenth."""
    if search.best.backend != "kinematic":
        search.try_(replace(search.best, backend="kinematic"))


def _simplify(search: _Search, name: str, at: int) -> None:
    """Moves the numbers of one element."""
    held = getattr(search.best, name)
    if is_dataclass(held[at]):
        _numbers(search, held[at], lambda element: _placed(search.best, name, at, element))


def _placed(episode: Episode, name: str, at: int, element: Any) -> Episode:
    held = getattr(episode, name)
    changed: dict[str, Any] = {name: (*held[:at], element, *held[at + 1 :])}
    return replace(episode, **changed)


def _numbers(search: _Search, value: Any, placed: Callable[[Any], Episode]) -> None:
    """Move each number of a value toward the usual one: at once, to a round number, or by halves."""
    for field in fields(value):
        for _ in range(_HALVINGS):
            nearer = next(
                (candidate for candidate in _nearer(value, field) if search.try_(placed(candidate))), None
            )
            if nearer is None:
                break
            value = nearer


def _nearer(value: Any, field: Field[Any]) -> Iterator[Any]:
    """Yield the value with one field nearer to the usual; the nearest first."""
    now, usual = getattr(value, field.name), _usual(value, field)
    if now == usual:
        return
    if isinstance(now, tuple) and isinstance(usual, tuple) and field.name not in LISTS:
        yield replace(value, **{field.name: usual})
    if isinstance(now, bool | str | tuple):
        return
    yield replace(value, **{field.name: usual})
    for number in _between(now, usual):
        yield replace(value, **{field.name: number})


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

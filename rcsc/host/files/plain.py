"""Values kept as plain ones, which JSON keeps exactly, and read back by their declared types.

In: dataclasses whose fields are plain values, words of a `StrEnum`, literals, tuples, lists, dictionaries by text, and dataclasses of
these. Out: the same after `plain` and `read`; what no such value was written as is refused. `Kept` has `state` and `restore` of
`rcsc_cell.workstation.stopped.Restorable`.
"""

import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import StrEnum
from functools import cache
from math import isfinite
from typing import Any, ClassVar, Literal, Union, cast, get_args, get_origin, get_type_hints

from rcsc.host.files.names import shown

PLAIN = (bool, int, float, str, type(None))
MOST_WHOLE, MOST_REAL = 2**128, 1e12
"""What a number that is read back may be at most; a generator of noise has whole numbers of 128 bits."""


class Kept:
    """A dataclass that can be put back.

    Attributes:
        transient: Fields that are no state: what it was made with, and faults.
    """

    __slots__ = ()
    transient: ClassVar[frozenset[str]] = frozenset()

    def state(self) -> dict[str, Any]:
        """Its state in plain values."""
        return {name: plain(getattr(self, name)) for name in _names(self)}

    def restore(self, said: Mapping[str, Any]) -> None:
        """Takes a state.

        Raises:
            ValueError: It is none of this class.
        """
        hints = get_type_hints(type(self))
        if set(said) != set(_names(self)):
            raise ValueError(f"not the state of a {type(self).__name__}")
        for name, value in said.items():
            now = getattr(self, name)
            if isinstance(now, Kept):  # in place: what is transient stays
                now.restore(value)
            else:
                setattr(self, name, read(hints[name], value))


def _names(kept: Any) -> list[str]:
    """The fields of a dataclass, or of one of its objects, that are state."""
    left: frozenset[str] = getattr(kept, "transient", frozenset())
    return [one.name for one in fields(kept) if one.name not in left]


def plain(value: Any) -> Any:
    """The value as JSON has it.

    Raises:
        TypeError: It is none that could be read again.
    """
    if isinstance(value, PLAIN):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return {name: plain(getattr(value, name)) for name in _names(value)}
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            raise TypeError("a dictionary is kept by text")
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    raise TypeError(f"a {type(value).__name__} cannot be kept")


def read(kind: Any, said: Any) -> Any:
    """The value of a declared type that `plain` made this of.

    Raises:
        ValueError: It made it of no such value.
    """
    origin, args = get_origin(kind), get_args(kind)
    if origin in (types.UnionType, Union):
        return _any(args, said)
    if kind is Any:
        return said
    if origin is Literal:
        return _one_of(args, said)
    if is_dataclass(kind):
        return _made(cast(type, kind), said)
    if origin is list:
        return [read(args[0], one) for one in _items(said)]
    if origin is tuple:
        items = _items(said)
        each = [args[0]] * len(items) if args[1:] == (...,) else list(args)
        if len(each) != len(items):
            raise ValueError(f"{len(items)} values for {len(each)}")
        return tuple(read(one, item) for one, item in zip(each, items, strict=True))
    if origin is not None and isinstance(said, dict) and issubclass(origin, Mapping):
        return {key: read(args[1], one) for key, one in said.items()}
    if isinstance(kind, type) and issubclass(kind, StrEnum):
        return kind(_text(said))
    if type(said) is kind or (kind is float and type(said) is int):
        return _bounded(said)
    raise ValueError(f"{_shown(said)} is no {getattr(kind, '__name__', kind)}")


def _bounded(said: Any) -> Any:
    """The value, unless it is a number that nothing is as large as; NaN is a reading that could not be taken."""
    large = (isinstance(said, int) and abs(said) > MOST_WHOLE) or (
        isinstance(said, float) and abs(said) > MOST_REAL
    )
    if large:
        raise ValueError(f"{_shown(said)} is too large")
    return said


def _one_of(allowed: Sequence[Any], said: Any) -> Any:
    if not any(type(said) is type(one) and said == one for one in allowed):
        raise ValueError(f"{_shown(said)} is none of {', '.join(map(str, allowed))}")
    return said


def _shown(said: Any) -> str:
    return shown(said if isinstance(said, str) else repr(said)[:80])


def alike(now: Any, then: Any) -> bool:
    """Whether two values have the same shape: tuples as long, and their values of one type; what is declared need not say it."""
    if isinstance(now, tuple):
        return isinstance(then, tuple) and len(now) == len(then) and all(map(alike, now, then))
    if is_dataclass(now):
        return type(now) is type(then) and all(
            alike(getattr(now, name), getattr(then, name)) for name in _names(now)
        )
    return type(now) is type(then) or None in (now, then) or {type(now), type(then)} == {int, float}


def finite(value: Any) -> bool:
    """Whether every number in a plain value is one."""
    if isinstance(value, Mapping):
        return all(map(finite, value.values()))
    if isinstance(value, (list, tuple)):
        return all(map(finite, value))
    return not isinstance(value, float) or isfinite(value)


def _items(said: Any) -> Sequence[Any]:
    if not isinstance(said, list):
        raise ValueError(f"{_shown(said)} is no list")  # noqa: TRY004  # what was read, not what was called
    return said


def _any(kinds: Sequence[Any], said: Any) -> Any:
    """The first of several types that reads it."""
    for kind in kinds:
        try:
            return None if kind is type(None) and said is None else read(kind, said)
        except ValueError:
            continue
    raise ValueError(f"{_shown(said)} is none of its types")


def _text(said: Any) -> str:
    if not isinstance(said, str):
        raise ValueError(f"{_shown(said)} is no text")  # noqa: TRY004  # what was read, not what was called
    return said


_hints = cache(get_type_hints)


def _made(kind: type, said: Any) -> Any:
    hints = _hints(kind)
    if not isinstance(said, dict) or set(said) != set(_names(kind)):
        raise ValueError(f"not the values of a {kind.__name__}")
    given = {name: read(hints[name], one) for name, one in said.items()}
    asked = {one.name for one in fields(kind) if one.init}
    made = kind(**{name: value for name, value in given.items() if name in asked})
    for name in given.keys() - asked:
        object.__setattr__(made, name, given[name])
    return made

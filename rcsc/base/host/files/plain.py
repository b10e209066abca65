"""Values kept as plain ones, which JSON keeps exactly, and read back by their declared types.

In: dataclasses whose fields are plain values, words of a `StrEnum`, numbers of an `IntEnum`, literals, tuples, lists, dictionaries by
text, and dataclasses of these. Out: the same after `plain` and `read`; what no such value was written as is refused.
"""

import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import IntEnum, StrEnum
from functools import cache
from math import isfinite
from typing import Any, Literal, Union, cast, get_args, get_origin, get_type_hints

from rcsc.base.host.files.names import shown

PLAIN = (bool, int, float, str, type(None))
MOST_WHOLE, MOST_REAL = 2**128, 1e12
"""What a number that is read back may be at most; a generator of noise has whole numbers of 128 bits."""


def _names(kept: Any) -> list[str]:
    """Return the fields of a dataclass, or of one of its objects."""
    return [field.name for field in fields(kept)]


def plain(value: Any) -> Any:
    """Return the value in plain form, as JSON has it.

    Raises:
        TypeError: It could not be read back.
    """
    if isinstance(value, PLAIN):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return {name: plain(getattr(value, name)) for name in _names(value)}
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            raise TypeError("a dictionary is kept by text")
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    raise TypeError(f"a {type(value).__name__} cannot be kept")


def read(kind: Any, value: Any) -> Any:
    """Return the value of a declared type that `plain` turned into this.

    Raises:
        ValueError: It is the plain form of no such value.
    """
    origin, args = get_origin(kind), get_args(kind)
    if origin in (types.UnionType, Union):
        return _any(args, value)
    if kind is Any:
        return value
    if origin is Literal:
        return _one_of(args, value)
    if is_dataclass(kind):
        return _object(cast(type, kind), value)
    if origin is list:
        return [read(args[0], item) for item in _items(value)]
    if origin is tuple:
        items = _items(value)
        each = [args[0]] * len(items) if args[1:] == (...,) else list(args)
        if len(each) != len(items):
            raise ValueError(f"{len(items)} values for {len(each)}")
        return tuple(read(of, item) for of, item in zip(each, items, strict=True))
    if origin is not None and isinstance(value, dict) and issubclass(origin, Mapping):
        return {key: read(args[1], item) for key, item in value.items()}
    if isinstance(kind, type) and issubclass(kind, StrEnum):
        return kind(_text(value))
    if isinstance(kind, type) and issubclass(kind, IntEnum):
        return kind(_bounded(value))
    if type(value) is kind or (kind is float and type(value) is int):
        return _bounded(value)
    raise ValueError(f"{_shown(value)} is no {getattr(kind, '__name__', kind)}")


def _bounded(value: Any) -> Any:
    """Return the value, unless it is a number out of bounds; NaN is a reading that could not be taken."""
    large = (isinstance(value, int) and abs(value) > MOST_WHOLE) or (
        isinstance(value, float) and abs(value) > MOST_REAL
    )
    if large:
        raise ValueError(f"{_shown(value)} is too large")
    return value


def _one_of(allowed: Sequence[Any], value: Any) -> Any:
    if not any(type(value) is type(option) and value == option for option in allowed):
        raise ValueError(f"{_shown(value)} is none of {', '.join(map(str, allowed))}")
    return value


def _shown(value: Any) -> str:
    return shown(value if isinstance(value, str) else repr(value)[:80])


def alike(now: Any, then: Any) -> bool:
    """Return whether two values have the same shape: tuples of one length, values of one type, declared or not."""
    if isinstance(now, tuple):
        return isinstance(then, tuple) and len(now) == len(then) and all(map(alike, now, then))
    if is_dataclass(now):
        return type(now) is type(then) and all(
            alike(getattr(now, name), getattr(then, name)) for name in _names(now)
        )
    return type(now) is type(then) or None in (now, then) or {type(now), type(then)} == {int, float}


def finite(value: Any) -> bool:
    """Return whether every number in a plain value is finite."""
    if isinstance(value, Mapping):
        return all(map(finite, value.values()))
    if isinstance(value, (list, tuple)):
        return all(map(finite, value))
    return not isinstance(value, float) or isfinite(value)


def _items(value: Any) -> Sequence[Any]:
    if not isinstance(value, list):
        raise ValueError(f"{_shown(value)} is no list")  # noqa: TRY004  # what was read, not what was called
    return value


def _any(kinds: Sequence[Any], value: Any) -> Any:
    """Return the value as the first of several types that reads it."""
    for kind in kinds:
        try:
            return None if kind is type(None) and value is None else read(kind, value)
        except ValueError:
            continue
    raise ValueError(f"{_shown(value)} is none of its types")


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{_shown(value)} is no text")  # noqa: TRY004  # what was read, not what was called
    return value


_hints = cache(get_type_hints)


def _object(kind: type, value: Any) -> Any:
    hints = _hints(kind)
    if not isinstance(value, dict) or set(value) != set(_names(kind)):
        raise ValueError(f"not the values of a {kind.__name__}")
    given = {name: read(hints[name], item) for name, item in value.items()}
    asked = {field.name for field in fields(kind) if field.init}
    result = kind(**{name: item for name, item in given.items() if name in asked})
    for name in given.keys() - asked:
        object.__setattr__(result, name, given[name])
    return result

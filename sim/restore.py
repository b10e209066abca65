"""Things outside that can be put back: their state as plain values, which JSON keeps exactly.

In: a dataclass whose fields are plain values, tuples, lists, dictionaries by text, and dataclasses of these. Out: `state` and `restore` of
`rcsc.workstation.stopped.Restorable`. Each field is written by its declared type and read by it; what cannot be is refused.
"""

import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, ClassVar, Union, cast, get_args, get_origin, get_type_hints

PLAIN = (bool, int, float, str, type(None))


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
    if type(said) is kind or (kind is float and type(said) is int):
        return said
    raise ValueError(f"{said!r} is no {kind}")


def _items(said: Any) -> Sequence[Any]:
    if not isinstance(said, list):
        raise ValueError(f"{said!r} is no list")  # noqa: TRY004  # what was read, not what was called
    return said


def _any(kinds: Sequence[Any], said: Any) -> Any:
    """The first of several types that reads it."""
    for kind in kinds:
        try:
            return None if kind is type(None) and said is None else read(kind, said)
        except ValueError:
            continue
    raise ValueError(f"{said!r} is none of its types")


def _made(kind: type, said: Any) -> Any:
    hints = get_type_hints(kind)
    if not isinstance(said, dict) or set(said) != set(_names(kind)):
        raise ValueError(f"not the state of a {kind.__name__}")
    given = {name: read(hints[name], one) for name, one in said.items()}
    asked = {one.name for one in fields(kind) if one.init}
    made = kind(**{name: value for name, value in given.items() if name in asked})
    for name in given.keys() - asked:
        object.__setattr__(made, name, given[name])
    return made

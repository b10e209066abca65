"""Dataclasses that are cheap to declare: a method is compiled when it is first called, not when the module is imported.

`dataclasses.dataclass` compiles six methods for each class, which takes a third of a millisecond. A check of one small file declares
270 classes, makes objects of a hundred and compares those of a few. Here `dataclasses` still finds the fields and makes the slots, so that
`fields`, `replace`, `match` and type checkers see what they would see. For each method there is a stand-in, which compiles it at the
first call and puts it in its own place.

>>> @dataclass(frozen=True, slots=True)
... class Width:
...     mm: int
...     unit: str = "mm"
>>> Width(30), Width(30) == Width(30, "mm"), Width(30) == Width(31)
(Width(mm=30, unit='mm'), True, False)

Classes with slots are meant, frozen or not. Whatever else is asked for, as an order or identity, is left to `dataclasses`. A class and
those derived from it come from one of the two.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, fields
from functools import partial
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass  # noqa: PLC0414  # handed on
else:

    def dataclass(
        *, slots: bool, frozen: bool = False, kw_only: bool = False, **others: bool
    ) -> Callable[[type], type]:
        """As `dataclasses.dataclass`; methods are compiled when they are first called."""
        if others:
            return dataclasses.dataclass(slots=slots, frozen=frozen, kw_only=kw_only, **others)
        with_fields = dataclasses.dataclass(slots=slots, kw_only=kw_only, init=False, repr=False, eq=False)
        return lambda declared: _with_methods(declared, with_fields(declared), frozen)


def _with_methods(declared: type, made: Any, frozen: bool) -> type:
    """The class with a stand-in for each method that was not declared."""
    for name, text in _METHODS.items():
        if name not in declared.__dict__:
            setattr(made, name, _stand_in(made, name, partial(text, made, frozen)))
    if frozen:
        made.__setattr__, made.__delattr__ = _refuse_setting, _refuse_deleting
        made.__getstate__, made.__setstate__ = _state, _restore  # objects are still copied and pickled
    else:
        made.__hash__ = None  # as `dataclasses` has it
    return cast(type, made)


def _stand_in(made: Any, name: str, text: Callable[[], str]) -> Callable[..., Any]:
    """A function that compiles the method, puts it in its place and calls it."""

    def first(self: Any, *args: Any, **kwargs: Any) -> Any:
        by_name = {field.name: field for field in fields(made)}
        known: dict[str, Any] = {"_set_": object.__setattr__, "_absent_": MISSING, "_fields_": by_name}
        exec(text(), known)  # noqa: S102  # made of names of fields
        method = recursive_repr()(known[name]) if name == "__repr__" else known[name]
        method.__qualname__ = f"{made.__qualname__}.{name}"
        setattr(made, name, method)
        return method(self, *args, **kwargs)

    return first


# --- texts of methods ---


def _init(made: Any, frozen: bool) -> str:
    """Each field is set from its argument, its default, or what its factory makes anew for each object."""
    ordered = sorted((field for field in fields(made) if field.init), key=lambda field: bool(field.kw_only))
    arguments = [field.name + _default(field) for field in ordered]
    if any(field.kw_only for field in ordered):
        arguments.insert(sum(not field.kw_only for field in ordered), "*")
    body = [_setting(field.name, value, frozen) for field in fields(made) if (value := _value(field))]
    body += ["self.__post_init__()"] if hasattr(made, "__post_init__") else []
    return "\n ".join([f"def __init__({', '.join(['self', *arguments])}):", *body, "pass"])


def _default(field: Field[Any]) -> str:
    if field.default_factory is not MISSING:
        return "=_absent_"
    return "" if field.default is MISSING else f"=_fields_[{field.name!r}].default"


def _value(field: Field[Any]) -> str:
    """The value of a field in `__init__`; empty where it gets none."""
    if field.default_factory is not MISSING:
        made = f"_fields_[{field.name!r}].default_factory()"
        return f"{made} if {field.name} is _absent_ else {field.name}" if field.init else made
    if field.init:
        return field.name
    return "" if field.default is MISSING else f"_fields_[{field.name!r}].default"


def _setting(name: str, value: str, frozen: bool) -> str:
    return f"_set_(self, {name!r}, {value})" if frozen else f"self.{name} = {value}"


def _repr(made: Any, _frozen: bool) -> str:
    shown = ", ".join(f"{field.name}={{self.{field.name}!r}}" for field in fields(made) if field.repr)
    return f'def __repr__(self):\n return f"{{self.__class__.__qualname__}}({shown})"'


def _eq(made: Any, _frozen: bool) -> str:
    names = [field.name for field in fields(made) if field.compare]
    return (
        "def __eq__(self, other):\n if other.__class__ is not self.__class__:\n  return NotImplemented\n"
        f" return {_tuple('self', names)} == {_tuple('other', names)}"
    )


def _hash(made: Any, _frozen: bool) -> str:
    hashed = (field for field in fields(made) if (field.compare if field.hash is None else field.hash))
    return f"def __hash__(self):\n return hash({_tuple('self', [field.name for field in hashed])})"


def _tuple(of: str, names: list[str]) -> str:
    return f"({''.join(f'{of}.{name}, ' for name in names)})"


_METHODS = {"__init__": _init, "__repr__": _repr, "__eq__": _eq, "__hash__": _hash}


# --- frozen classes ---


def _refuse_setting(_self: object, name: str, _value: object) -> None:
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_deleting(_self: object, name: str) -> None:
    raise FrozenInstanceError(f"cannot delete field {name!r}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, field.name) for field in fields(self)]


def _restore(self: Any, state: list[Any]) -> None:
    for field, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, field.name, value)

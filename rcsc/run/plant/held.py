"""A user's plant in plain values, for a file from which another process goes on.

In: an object. Out: what it holds, as JSON has it exactly; and back into another object of its class. A class that holds
more than numbers, bools, text, enumerations, lists, dictionaries by text and objects of these says itself what it holds:
`state(self)` gives it, and `restore(self, state)` takes it.
"""

import copyreg
import enum
from collections.abc import Collection, Mapping
from typing import Any

from rcsc.base.host.files.names import shown
from rcsc.base.host.files.plain import PLAIN, finite
from rcsc.run.orders.stopped import NotKept

_NEW: Any = vars(copyreg)["__newobj__"]
"""Makes an object whose attributes are all that it holds (PEP 307)."""


def held_of(plant: Any, leave: Collection[str] = ()) -> dict[str, Any]:
    """Return the state of a plant in plain form.

    Args:
        plant: The user's object.
        leave: Attributes that are no state of it: its faults.

    Raises:
        NotKept: It has a value that no file holds; names the attribute.
    """
    if _says_itself(plant):
        state = plant.state()
        if not isinstance(state, dict):
            raise NotKept(f"`{type(plant).__name__}.state()` gave no dictionary")
        return {str(name): _plain(value, f"state()[{name!r}]") for name, value in state.items()}
    return {
        name: _plain(value, f"{type(plant).__name__}.{name}")
        for name, value in _attributes(plant, type(plant).__name__).items()
        if name not in leave
    }


def put_back(plant: Any, state: Any, leave: Collection[str] = ()) -> None:
    """Put back the state of a plant.

    Raises:
        ValueError: It is no state of such a plant.
    """
    if not isinstance(state, dict):
        raise ValueError("not the state of a plant")  # noqa: TRY004  # what was read, not what was called
    if _says_itself(plant):
        plant.restore(state)
        return
    known = {name for name in _attributes(plant, "") if name not in leave}
    if not known <= set(state):
        raise ValueError(f"a {type(plant).__name__} has {shown(min(known - set(state)))}, too")
    values = {name: _restored(getattr(plant, name, None), value) for name, value in state.items()}
    for name, value in values.items():
        setattr(plant, name, value)


def _says_itself(plant: Any) -> bool:
    return callable(getattr(plant, "state", None)) and callable(getattr(plant, "restore", None))


def _plain(value: Any, where: str) -> Any:
    """Return the value in plain form."""
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, PLAIN):
        if not finite(value):
            raise NotKept(f"`{where}` is {value}")
        return value
    if isinstance(value, list | tuple):
        return [_plain(item, f"{where}[{at}]") for at, item in enumerate(value)]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(item, f"{where}[{key!r}]") for key, item in value.items()}
    return {name: _plain(item, f"{where}.{name}") for name, item in _attributes(value, where).items()}


def _attributes(value: Any, where: str) -> dict[str, Any]:
    """Return the attributes of an object that holds nothing else.

    Raises:
        NotKept: It holds more, as a generator of random numbers does, or has no attributes.
    """
    try:
        made = value.__reduce_ex__(2)  # what `copy` and `pickle` take an object to hold
    except Exception:  # noqa: BLE001  # of the user's classes
        made = ()
    if tuple(made[:2]) != (_NEW, (type(value),)) or any(part is not None for part in made[3:]):
        helps = "give the class `state(self)` and `restore(self, state)`"
        raise NotKept(f"`{where}` is of type `{type(value).__name__}`: {helps}")
    held = made[2] if isinstance(made[2], tuple) else (made[2],)  # attributes, and those in slots
    return {name: item for part in held if part for name, item in part.items()}


def _restored(now: Any, then: Any) -> Any:
    """Return a kept value in the form of the present one. Raises ValueError: it has another form."""
    if isinstance(now, enum.Enum):
        return _member(type(now), then)
    if isinstance(now, tuple) and isinstance(then, list):
        items = _items(now, then)
        return type(now)(*items) if hasattr(now, "_fields") else tuple(items)
    if isinstance(now, list) and isinstance(then, list):
        return _items(now, then)
    if isinstance(now, dict) and isinstance(then, dict):
        return {key: _restored(now.get(key), value) for key, value in then.items()}
    if isinstance(then, dict) and now is not None and not isinstance(now, PLAIN):
        put_back(now, then)
        return now
    if now is None or then is None or type(now) is type(then) or {type(now), type(then)} == {int, float}:
        return then
    raise ValueError(f"{shown(repr(then)[:40])} stands for a {type(now).__name__}")


def _member(kind: type[enum.Enum], name: Any) -> enum.Enum:
    if name not in kind.__members__:
        raise ValueError(f"{kind.__name__} has no member {shown(repr(name)[:40])}")
    return kind[name]


def _items(now: Any, then: list[Any]) -> list[Any]:
    """Restore each item in the form of the one in its place; those past the end in the form of the last."""
    forms = [*now[: len(then)], *([now[-1] if len(now) else None] * (len(then) - len(now)))]
    return [_restored(form, item) for form, item in zip(forms, then, strict=True)]

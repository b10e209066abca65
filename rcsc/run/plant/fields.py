"""The fields of a plant, as its class declares them: names, types, ranges, units, members.

In: a class with annotated attributes. Out: a `FieldType` for each. `bool`, `int`, `float`, `str`, `Literal` and `Enum`
for scalars, a class with annotated attributes for a record, `list` and `tuple` for an array.
"""

import dataclasses
import enum
import math
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeAlias


@dataclass(frozen=True, slots=True)
class Range:
    """The range of a plant's number: `Annotated[float, Range(0, 20, "m")]`.

    Attributes:
        low: The least value; `high` the greatest; both included.
        unit: Of the field, as a table writes it; empty for that of the variable. Another unit is converted.
    """

    low: float = -math.inf
    high: float = math.inf
    unit: str = ""


@dataclass(frozen=True, slots=True)
class FaultSwitch:
    """Marks a field that makes the plant misbehave while it is true; whoever tests the system switches it."""


Fault: TypeAlias = Annotated[bool, FaultSwitch()]
"""The type of such a field: `wheel_slips: Fault = False`."""


@dataclass(frozen=True, slots=True)
class PropertyMark:
    """Marks the result of a method that tells whether a property holds; whoever tests the system asks it after each tick."""


Property: TypeAlias = Annotated[bool, PropertyMark()]
"""The result of such a method: `def upright(self) -> Property: ...`."""


@dataclass(frozen=True, slots=True)
class Number:
    """A whole number, or a float."""

    whole: bool
    range: Range | None


@dataclass(frozen=True, slots=True)
class Flag:
    """True or false."""


@dataclass(frozen=True, slots=True)
class Members:
    """One of several names: of an `Enum`, of a `Literal`; any name where `names` is None."""

    names: tuple[str, ...] | None
    of: type[enum.Enum] | None = None


@dataclass(frozen=True, slots=True)
class Record:
    """An object with fields of its own, whose annotations are read when they are asked for."""

    make: type
    hints: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Elements:
    """A list or a tuple; `count` is None where its length is not declared."""

    of: "FieldType"
    make: type
    count: int | None


FieldType: TypeAlias = Number | Flag | Members | Record | Elements


class NoField(Exception):  # noqa: N818  # what happened, not an error of ours
    """An annotation whose values no buffer could hold; names it."""


def annotations(of: type) -> dict[str, Any]:
    """Return the annotated attributes of a class, inherited ones too.

    Raises:
        NoField: An annotation names what is not defined.
    """
    try:
        return typing.get_type_hints(of, include_extras=True)
    except (NameError, TypeError, AttributeError) as error:
        raise NoField(f"an annotation of class `{of.__name__}` cannot be read: {error}") from error


def faults(of: type) -> tuple[str, ...]:
    """Return the names of a plant's switches: fields of type `Fault`.

    Raises:
        NoField: As `annotations`.
    """
    return tuple(name for name, hint in annotations(of).items() if FaultSwitch() in _notes(hint))


def properties(of: type) -> tuple[str, ...]:
    """Return the names of a plant's properties: methods whose result is declared as `Property`, in order of definition."""
    methods = {name: method for base in reversed(of.__mro__) for name, method in vars(base).items()}
    return tuple(name for name, method in methods.items() if PropertyMark() in _notes(_result(method)))


def _result(method: object) -> Any:
    """Return the declared type of a method's result; None where it cannot be read."""
    try:
        return typing.get_type_hints(method, include_extras=True).get("return")
    except (NameError, TypeError, AttributeError):
        return None


def shown(field: FieldType) -> str:
    """Return the type as its author wrote it, for messages."""
    match field:
        case Number(whole, _):
            return "int" if whole else "float"
        case Flag():
            return "bool"
        case Members(None, _):
            return "str"
        case Members(names, None):
            return f"Literal[{', '.join(names or ())}]"
        case Members(_, of):
            return of.__name__ if of is not None else "str"
        case Record(make, _):
            return make.__name__
        case Elements(of, make, _):
            return f"{make.__name__}[{shown(of)}, ...]"


def field_type(hint: Any) -> FieldType:
    """Read an annotation as the type of a field.

    Raises:
        NoField: No buffer could hold its values.
    """
    notes = _notes(hint)
    bare = typing.get_args(hint)[0] if typing.get_origin(hint) is Annotated else hint
    limits = next((note for note in notes if isinstance(note, Range)), None)
    if bare in (int, float):
        return Number(bare is int, limits)
    if limits is not None:
        raise NoField(f"`{_spelled(bare)}` has no range")
    if bare is bool:
        return Flag()
    if bare is str:
        return Members(None)
    origin = typing.get_origin(bare)
    if origin is Literal:
        return _literal(bare)
    if origin in (list, tuple):
        return _elements(origin, typing.get_args(bare))
    if isinstance(bare, type) and issubclass(bare, enum.Enum):
        return Members(tuple(bare.__members__), bare)
    if isinstance(bare, type) and annotations(bare):
        return Record(bare, annotations(bare))
    raise NoField(f"`{_spelled(bare)}` is no type of a field")


def _literal(hint: Any) -> Members:
    names = typing.get_args(hint)
    if not all(isinstance(name, str) for name in names):
        raise NoField(f"`{_spelled(hint)}` has values that are no names")
    return Members(names)


def _elements(make: type, of: tuple[Any, ...]) -> Elements:
    inner = [hint for hint in of if hint is not Ellipsis]
    if not inner or any(hint != inner[0] for hint in inner):
        raise NoField(
            f"`{make.__name__}` needs elements of one type: `{make.__name__}[float{', ...' if make is tuple else ''}]`"
        )
    count = len(inner) if make is tuple and Ellipsis not in of else None
    return Elements(field_type(inner[0]), make, count)


def _notes(hint: Any) -> tuple[Any, ...]:
    return tuple(typing.get_args(hint)[1:]) if typing.get_origin(hint) is Annotated else ()


def _spelled(hint: Any) -> str:
    return hint.__name__ if isinstance(hint, type) and not typing.get_args(hint) else str(hint)


def made_of(record: Record, values: Mapping[str, object]) -> object:
    """Make an object of the record's class with these fields; others keep their defaults."""
    if dataclasses.is_dataclass(record.make) or issubclass(record.make, tuple):
        return record.make(**values)
    instance = record.make()
    for name, value in values.items():
        setattr(instance, name, value)
    return instance

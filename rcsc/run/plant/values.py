"""Values between a plant's field and the leaves of a buffer: checked once by type, then converted in every tick.

In: the leaves of a variable, and the type of the field at the other end. Out: a `Link`, which turns values of the leaves
into the field's value (`taken`) and back (`given`), or all that does not fit.

A number is converted from unit to unit, exactly but for angles. A float that goes to a whole number is rounded to the
nearest, as a sensor would; what is clamped in the tables is clamped here, for a C type may hold less than a reading.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import islice
from typing import Any, Protocol

from rcsc.base.host.described import nearest
from rcsc.run.plant import fields
from rcsc.run.plant.units import Factor, factor
from rcsc.run.signature import REALS, Leaf, Value, c_range, number_word


class BadValue(ValueError):  # noqa: N818  # what happened, not an error of ours
    """A field has a value that its buffer cannot hold; its arguments are where in the field, and what is wrong."""


@dataclass(frozen=True, slots=True)
class Misfit:
    """A misfit between field and variable: the place in the field, the reason, and helps."""

    place: str
    message: str
    helps: tuple[str, ...] = ()


class Link(Protocol):
    """A connection between a field and leaves that lie next to each other."""

    def taken(self, values: Iterator[Value]) -> object:
        """Return the field's value, of the next values of the leaves."""
        ...

    def given(self, value: Any) -> Iterator[Value]:
        """Yield the values of the leaves.

        Raises:
            BadValue: The field has no such value.
        """
        ...


# --- what the leaves look like ---


@dataclass(slots=True)
class Shape:
    """The leaves of a variable as a tree: a leaf, or parts by name or by number, in order."""

    leaf: Leaf | None = None
    parts: "dict[str | int, Shape]" = field(default_factory=dict)


def shape(leaves: Sequence[Leaf], variable: str) -> Shape:
    """Build the shape of the variable that has these leaves."""
    root = Shape()
    for leaf in leaves:
        node = root
        for name, at in re.findall(r"\.(\w+)|\[(\d+)\]", leaf.name.removeprefix(variable)):
            node = node.parts.setdefault(name or int(at), Shape())
        node.leaf = leaf
    return root


# --- links ---


@dataclass(frozen=True, slots=True)
class FlagLink:
    """A bool."""

    def taken(self, values: Iterator[Value]) -> bool:
        """Return the next value as it is."""
        return bool(next(values))

    def given(self, value: Any) -> Iterator[Value]:
        """Yield the bool as it is; numpy's bools are bools, too."""
        if type(value).__name__ not in {"bool", "bool_"}:
            raise BadValue("", f"is {_shown(value)}, which is no bool")
        yield bool(value)


@dataclass(frozen=True, slots=True)
class MemberLink:
    """A member of an enumeration."""

    leaf: Leaf
    of: fields.Members

    def taken(self, values: Iterator[Value]) -> object:
        """Return the member's name, or the `Enum`'s member of that name."""
        name = self.leaf.members[int(next(values))]
        return name if self.of.of is None else self.of.of[name]

    def given(self, value: Any) -> Iterator[Value]:
        """Yield the member's number."""
        name = getattr(value, "name", value)
        if name not in self.leaf.members:
            near = "".join(f"; {suggestion}" for suggestion in nearest(str(name), self.leaf.members))
            raise BadValue("", f"is {_shown(value)}, which is no member of `{self.leaf.name}`{near}")
        yield self.leaf.members.index(name)


@dataclass(frozen=True, slots=True)
class NumberLink:
    """A number.

    Attributes:
        factor: From the field's unit to the variable's.
    """

    leaf: Leaf
    whole: bool
    factor: Factor

    def taken(self, values: Iterator[Value]) -> Value:
        """Return the number in the field's unit; a whole field has the variable's."""
        value = next(values)
        if self.whole:
            return int(value)
        return float(value if self.factor.is_one else _times(self.factor.inverse, value))

    def given(self, value: Any) -> Iterator[Value]:
        """Yield the number in the variable's unit, rounded for a whole variable and clamped where it is declared so."""
        try:
            number = value if isinstance(value, int) and not isinstance(value, bool) else float(value)
        except (TypeError, ValueError, OverflowError):
            raise BadValue("", f"is {_shown(value)}, which is no number") from None
        real = self.leaf.c_type in REALS
        if isinstance(number, float) and not math.isfinite(number):
            if real:
                yield number
                return
            raise BadValue("", f"is {number}, and `{self.leaf.name}` is a whole number")
        try:
            exact = number if self.factor.is_one else _times(self.factor, number)
            yield self.leaf.held(float(exact)) if real else self._held(round(exact))
        except OverflowError:
            raise BadValue("", f"is {_shown(value)}, which no float holds") from None

    def _held(self, number: int) -> int:
        """Clamp a whole number where the variable is declared so; else check that its C type holds it."""
        low, high = c_range(self.leaf.c_type)
        if self.leaf.clamp and self.leaf.low is not None and self.leaf.high is not None:
            return int(min(max(number, self.leaf.low), self.leaf.high))
        if not low <= number <= high:
            raise BadValue(
                "", f"is {number}{_unit(self.leaf)}, and `{self.leaf.name}` holds {_range(self.leaf)}"
            )
        return number


@dataclass(frozen=True, slots=True)
class RecordLink:
    """An object with fields."""

    record: fields.Record
    parts: Mapping[str, Link]

    def taken(self, values: Iterator[Value]) -> object:
        """Make a new object of the class."""
        return fields.made_of(self.record, {name: part.taken(values) for name, part in self.parts.items()})

    def given(self, value: Any) -> Iterator[Value]:
        """Yield the values of its fields in the variable's order."""
        for name, part in self.parts.items():
            if not hasattr(value, name):
                raise BadValue("", f"is {_shown(value)}, which has no `{name}`")
            yield from _at(f".{name}", part, getattr(value, name))


@dataclass(frozen=True, slots=True)
class ElementsLink:
    """A list or a tuple."""

    make: type
    parts: tuple[Link, ...]

    def taken(self, values: Iterator[Value]) -> object:
        """Make a new list or tuple."""
        return self.make([part.taken(values) for part in self.parts])

    def given(self, value: Any) -> Iterator[Value]:
        """Yield the values of the elements."""
        try:
            elements = list(islice(value, len(self.parts) + 1))  # there may be no end of them
        except TypeError:
            raise BadValue("", f"is {_shown(value)}, which has no elements") from None
        if len(elements) != len(self.parts):
            many = "more" if len(elements) > len(self.parts) and not hasattr(value, "__len__") else len(value)
            raise BadValue("", f"has {many} elements, and its buffer {len(self.parts)}")
        for at, (part, element) in enumerate(zip(self.parts, elements, strict=True)):
            yield from _at(f"[{at}]", part, element)


def _at(place: str, part: Link, value: Any) -> Iterator[Value]:
    try:
        yield from part.given(value)
    except BadValue as error:
        text = str(error)
        raise BadValue("", f"{place}{text}" if text[:1] in ".[" else f"{place} {text}") from None


# --- checked once ---


def link(
    parts: Shape, of: fields.FieldType, misfits: list[Misfit], *, gives: bool, place: str = ""
) -> Link | None:
    """Link a variable and a field; return None where they do not fit, and note the misfits.

    Args:
        parts: The variable.
        of: The field's type.
        misfits: Gets all that does not fit.
        gives: Whether the field goes to the variable; else the variable goes to the field.
        place: Of the field in the one that was asked for.
    """
    if parts.leaf is not None:
        wrong = _misfit(parts.leaf, of, gives=gives)
        if wrong is None:
            return _scalar(parts.leaf, of)
        misfits.append(Misfit(place, *wrong))
        return None
    if all(isinstance(name, int) for name in parts.parts):
        return _elements(parts, of, misfits, gives=gives, place=place)
    return _record(parts, of, misfits, gives=gives, place=place)


def _elements(
    parts: Shape, of: fields.FieldType, misfits: list[Misfit], *, gives: bool, place: str
) -> Link | None:
    count = len(parts.parts)
    if not isinstance(of, fields.Elements):
        misfits.append(
            Misfit(
                place,
                f"is `{fields.shown(of)}`, and the variable has {count} elements",
                ("write `list[...]`",),
            )
        )
        return None
    if of.count not in (None, count):
        misfits.append(Misfit(place, f"has {of.count} elements, and the variable {count}"))
        return None
    links = [
        link(part, of.of, misfits, gives=gives, place=f"{place}[{at}]") for at, part in parts.parts.items()
    ]
    whole = tuple(element for element in links if element is not None)
    return ElementsLink(of.make, whole) if len(whole) == count else None


def _record(
    parts: Shape, of: fields.FieldType, misfits: list[Misfit], *, gives: bool, place: str
) -> Link | None:
    names = [str(name) for name in parts.parts]
    if not isinstance(of, fields.Record):
        message = f"is `{fields.shown(of)}`, and the variable has the fields {', '.join(names)}"
        misfits.append(Misfit(place, message, ("make it a class with these fields, annotated",)))
        return None
    links: dict[str, Link] = {}
    for name, part in parts.parts.items():
        inner = f"{place}.{name}"
        if name not in of.hints:
            helps = nearest(str(name), list(of.hints)) or (f"add `{name}` to class `{of.make.__name__}`",)
            misfits.append(Misfit(inner, f"is missing in class `{of.make.__name__}`", helps))
            continue
        try:
            part_link = link(part, fields.field_type(of.hints[str(name)]), misfits, gives=gives, place=inner)
        except fields.NoField as error:
            misfits.append(Misfit(inner, str(error)))
            continue
        if part_link is not None:
            links[str(name)] = part_link
    return RecordLink(of, links) if len(links) == len(names) else None


def _scalar(leaf: Leaf, of: fields.FieldType) -> Link:
    if isinstance(of, fields.Number):
        unit = of.range.unit if of.range is not None and of.range.unit else leaf.unit
        return NumberLink(leaf, of.whole, factor(unit, leaf.unit) or Factor(Fraction(1)))
    return MemberLink(leaf, of) if isinstance(of, fields.Members) else FlagLink()


def _misfit(leaf: Leaf, of: fields.FieldType, *, gives: bool) -> tuple[str, tuple[str, ...]] | None:
    """Return the misfit of a scalar, and its helps; None where it fits."""
    wanted = "bool" if leaf.c_type == "bool" else "float" if leaf.c_type in REALS else "int"
    if leaf.members:
        return _members_misfit(leaf, of, gives=gives)
    if isinstance(of, fields.Flag) != (wanted == "bool") or not isinstance(of, fields.Flag | fields.Number):
        return f"is `{fields.shown(of)}`, and the variable is `{_type(leaf)}`", (f"declare it `{wanted}`",)
    if not isinstance(of, fields.Number):
        return None
    if of.whole and wanted == "float" and not gives:
        return f"is `int`, and the variable is `{_type(leaf)}`", ("declare it `float`",)
    return _range_misfit(leaf, of, gives=gives)


def _members_misfit(leaf: Leaf, of: fields.FieldType, *, gives: bool) -> tuple[str, tuple[str, ...]] | None:
    annotation = f"Literal[{', '.join(repr(member) for member in leaf.members)}]"
    if not isinstance(of, fields.Members):
        return f"is `{fields.shown(of)}`, and the variable is one of {', '.join(leaf.members)}", (
            f"declare it `{annotation}`",
        )
    if of.names is None:
        return None
    ours, theirs = (of.names, leaf.members) if gives else (leaf.members, of.names)
    missing = [name for name in ours if name not in theirs]
    if not missing:
        return None
    names = ", ".join(f"`{name}`" for name in missing)
    what = (
        f"may be {names}, which the variable has not"
        if gives
        else f"has no {names}, which the variable may be"
    )
    return what, nearest(missing[0], theirs) or (f"the members are {', '.join(theirs)}",)


def _range_misfit(leaf: Leaf, of: fields.Number, *, gives: bool) -> tuple[str, tuple[str, ...]] | None:
    limits = of.range
    if limits is None:
        return None
    try:
        into = factor(limits.unit or leaf.unit, leaf.unit)
    except ValueError as error:
        return str(error), ()
    if into is None:
        variable = f"is in `{leaf.unit}`" if leaf.unit else "has no unit"
        return f"is in `{limits.unit}`, and the variable {variable}: one is not the other", ()
    if of.whole and not into.is_one:
        return f"is a whole number in `{limits.unit}`, and the variable is in `{leaf.unit}`", (
            "declare it `float`",
        )
    if leaf.low is None or leaf.high is None:
        return None
    low, high = _times(into, limits.low), _times(into, limits.high)
    ranges = f"{limits.low:g} to {limits.high:g}{f' {limits.unit}' if limits.unit else ''}, and the variable holds {_range(leaf)}"
    if gives and not leaf.clamp and (-math.inf < low < leaf.low or leaf.high < high < math.inf):
        return f"goes from {ranges}", ("widen the variable's range, or declare it `clamp`",)
    if not gives and (leaf.low < low or high < leaf.high):
        return f"takes {ranges}", ("widen the field's range, or narrow the variable's",)
    return None


def _times(by: Factor, number: float) -> Fraction | float:
    return by.times(number) if math.isfinite(number) else number


def _shown(value: object) -> str:
    try:
        text = repr(value)
    except Exception as error:  # noqa: BLE001  # of the user's classes
        text = f"{type(value).__name__}, raising {type(error).__name__}"
    return f"`{text[:40]}{'...' if len(text) > 40 else ''}`"


def _type(leaf: Leaf) -> str:
    return "bool" if leaf.c_type == "bool" else f"{number_word(leaf)} {_range(leaf)}"


def _range(leaf: Leaf) -> str:
    if leaf.low is None or leaf.high is None:
        return "any number"
    return (
        f"{leaf.low:g} .. {leaf.high:g}{_unit(leaf)}"
        if leaf.c_type in REALS
        else f"{int(leaf.low)} .. {int(leaf.high)}{_unit(leaf)}"
    )


def _unit(leaf: Leaf) -> str:
    return f" [{leaf.unit}]" if leaf.unit else ""

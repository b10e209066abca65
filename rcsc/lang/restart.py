"""What a level adopts that starts anew: its command counts as seen and has failed, and each level below gets its command to rest.

In: the parts of a program, as leaves or as a symbol file has them. Out: for each leaf that starts other than initially, from what. The
proof and the running level read the same list.

A program that declares whom it serves and commands says itself what it adopts, and so does a variable with `restart`. For the
rest of a program that writes the protocol by hand it goes by the names that the protocol's variables usually have: the input
`command` with `inc_command`, the state `inc_command_seen`, orders `to_NAME`, and the input `NAME` that echoes them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

Value: TypeAlias = bool | int | float

NUMBERS = 65536
NUMBERED = (0, NUMBERS - 1)
"""The range in which numbers are counted on: they go round in it, and leave any other."""


@dataclass(frozen=True, slots=True)
class Fixed:
    """A constant."""

    value: Value


@dataclass(frozen=True, slots=True)
class SameAs:
    """The value of an input."""

    leaf: str


@dataclass(frozen=True, slots=True)
class After:
    """The number after the one that stands in the buffer; where none stands, after the one that the input echoes."""

    leaf: str


@dataclass(frozen=True, slots=True)
class Stands:
    """The leaf's own value in the level's buffer; where nothing stands there, its initial value."""


Adopted: TypeAlias = Fixed | SameAs | After | Stands


@dataclass(frozen=True, slots=True)
class Part:
    """A leaf, as far as its name may mean something.

    Attributes:
        members: Of an enumeration; empty for others.
        whole: Least and greatest value of a whole number; None for others.
    """

    output: bool
    members: tuple[str, ...]
    whole: tuple[int, int] | None


NUMBER, COMMAND = "inc_command", "input_command"
"""The fields of an order that the protocol makes (Haynes et al. 1984, section 9)."""
ECHO, ECHOED, STATUS = "inc_command_echo", "ref_command_echo", "status_report"
"""Those of a report: the number and the command that it answers, and what has become of them."""
PROTOCOL = (NUMBER, COMMAND, ECHO, ECHOED, STATUS)
"""Fields that the protocol fills; all others of an order and a report are the user's."""
SEEN = "inc_command_seen"
"""State of a level: the number of the order that it took last."""
_ORDER = "to_"
_NUMBERS = {NUMBER: ECHO, "number": "number"}
"""How an order is numbered, and where the level below repeats the number; the camera's pictures are numbered, too."""
ECHOES = (ECHO, ECHOED)
"""Fields of a report with the order that it answers: they never go back, not even if the first cycle takes nothing."""
_FAILED = {
    STATUS: "failed",
    "failure": "restart",
    "cur_state": "f_state",
    "cur_state.next": "f_state",
}
"""A member, by its name, for a state; the failure stands until the next command."""
_REPORTED = (STATUS, "failure")
"""Likewise of a report, which is published even if the first cycle takes nothing."""


def by_names(parts: Mapping[str, Part]) -> dict[str, Adopted]:
    """Return what a program without declarations adopts; leaves that are missing or have another type are left out."""
    return dict((*_failed(parts), *_seen(parts), *_reports(parts), *_orders(parts)))


def _failed(parts: Mapping[str, Part]) -> Iterator[tuple[str, Adopted]]:
    for name, member in _FAILED.items():
        if name in parts and member in parts[name].members:
            yield name, Fixed(parts[name].members.index(member))


def _seen(parts: Mapping[str, Part]) -> Iterator[tuple[str, Adopted]]:
    seen, taken = parts.get(SEEN), parts.get(f"command.{NUMBER}")
    if seen is not None and taken is not None and seen.whole == taken.whole == NUMBERED:
        # no other number stands there, not even a refused one
        yield SEEN, SameAs(f"command.{NUMBER}")


def _reports(parts: Mapping[str, Part]) -> Iterator[tuple[str, Adopted]]:
    for name, part in parts.items():
        record, _, field = name.rpartition(".")
        if part.output and field in ECHOES:
            yield name, Stands()
        elif (
            part.output
            and field in _REPORTED
            and f"{record}.{ECHO}" in parts
            and _FAILED[field] in part.members
        ):
            yield name, Fixed(part.members.index(_FAILED[field]))


def _orders(parts: Mapping[str, Part]) -> Iterator[tuple[str, Adopted]]:
    for name, part in parts.items():
        if not (part.output and name.startswith(_ORDER)):
            continue
        record, _, field = name.partition(".")
        if field == COMMAND:
            if part.members:
                yield name, Fixed(0)
            continue
        echo = f"{record.removeprefix(_ORDER)}.{_NUMBERS.get(field, '')}"
        if part.whole == NUMBERED and echo in parts and parts[echo].whole == NUMBERED:
            yield name, After(echo)

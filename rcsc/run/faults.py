"""Faults of plants: switches that make what stands outside misbehave, for those who test a system.

In: what stands outside, and a name, of some faults with how strong: `late_ticks=120`. Out: the plant that has the fault, with it on or off.
"""

from collections.abc import Collection, Iterable, Mapping
from typing import Protocol, runtime_checkable

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.described import nearest


@runtime_checkable
class Switched(Protocol):
    """A plant that misbehaves where somebody switches a fault on."""

    @property
    def faults(self) -> Collection[str]:
        """The names of its faults."""
        ...

    def switch(self, fault: str, *, on: bool) -> None:
        """Switch a fault on or off."""
        ...


@runtime_checkable
class Graded(Switched, Protocol):
    """A plant some of whose faults are of different strengths."""

    @property
    def grades(self) -> Mapping[str, tuple[float, float]]:
        """The lowest and the highest strength of each of these faults."""
        ...

    def grade(self, fault: str, strength: float) -> None:
        """Switch a fault on, with a strength."""
        ...


class BadStrength(CodedError):  # noqa: N818  # what happened, not an error of ours
    """A strength that a fault does not have."""

    code = Code.BAD_PLANT


class UnknownFault(CodedError):  # noqa: N818  # what happened, not an error of ours
    """A fault that no plant has; lists those that there are."""

    code = Code.BAD_PLANT

    def __init__(self, fault: str, known: Iterable[str]) -> None:
        names = tuple(known)
        super().__init__(f"no plant has a fault `{fault}`")
        self.helps = nearest(fault, names) or (
            f"the faults are {', '.join(names)}"
            if names
            else "a plant declares faults: a field of type `Fault`, or `[plant.NAME.faults]`",
        )


def faults_of(outside: Iterable[object]) -> tuple[str, ...]:
    """Return the names of all faults of the parts outside."""
    return tuple(
        dict.fromkeys(name for part in outside if isinstance(part, Switched) for name in part.faults)
    )


def grades_of(outside: Iterable[object]) -> dict[str, tuple[float, float]]:
    """Return the lowest and the highest strength of each fault of the parts outside that has strengths."""
    return {name: ends for part in outside if isinstance(part, Graded) for name, ends in part.grades.items()}


def switch(outside: Iterable[object], fault: str, *, on: bool) -> None:
    """Switch a fault on or off, in every plant that has it.

    Args:
        outside: What stands outside the levels.
        fault: Its name; `NAME=STRENGTH` where it has strengths, to switch it on with that and not the usual one.
        on: Whether it is to be on.

    Raises:
        UnknownFault: No plant has it.
        BadStrength: It is of no such strength.
    """
    parts = tuple(outside)
    name, graded, text = fault.partition("=")
    having = [part for part in parts if isinstance(part, Switched) and name in part.faults]
    if not having:
        raise UnknownFault(name, faults_of(parts))
    for part in having:
        if graded and on:
            _grade(part, name, text)
        else:
            part.switch(name, on=on)


def _grade(part: Switched, name: str, text: str) -> None:
    if not isinstance(part, Graded) or name not in part.grades:
        raise BadStrength(f"fault `{name}` is on or off, and has no strength `{text}`")
    lowest, highest = part.grades[name]
    try:
        strength = float(text)
    except ValueError:
        strength = lowest - 1
    if not lowest <= strength <= highest:
        raise BadStrength(f"`{text}` is no strength of fault `{name}`: it has {lowest:g} .. {highest:g}")
    part.grade(name, strength)

"""Faults of plants: switches that make what stands outside misbehave, for those who test a system.

In: what stands outside, and a name. Out: the plant that has the fault, with it on or off.
"""

from collections.abc import Iterable
from typing import Protocol, runtime_checkable

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.described import nearest


@runtime_checkable
class Switched(Protocol):
    """A plant that misbehaves where somebody switches a fault on."""

    @property
    def faults(self) -> tuple[str, ...]:
        """The names of its faults."""
        ...

    def switch(self, fault: str, *, on: bool) -> None:
        """Switch a fault on or off."""
        ...


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


def switch(outside: Iterable[object], fault: str, *, on: bool) -> None:
    """Switch a fault on or off, in every plant that has it.

    Raises:
        UnknownFault: No plant has it.
    """
    parts = tuple(outside)
    having = [part for part in parts if isinstance(part, Switched) and fault in part.faults]
    if not having:
        raise UnknownFault(fault, faults_of(parts))
    for part in having:
        part.switch(fault, on=on)

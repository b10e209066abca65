"""Runs a trial in a process of its own: code that somebody edited may end its process, or never end.

In: a function and what it is given. Out: what it returned, or how it ended, in words.
"""

import signal
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from rcsc.base.host import children

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

T = TypeVar("T")

SILENT_S = 300.0
"""Seconds without a word of progress, after which a trial is ended: by the clock, and far more than any part of one takes."""


@dataclass(frozen=True, slots=True)
class Ended:
    """A trial that gave no answer: what it was doing last, and how it ended."""

    why: str


def apart(
    trial: Callable[..., T], *given: Any, progress: Callable[[str], None], silent_s: float = SILENT_S
) -> T | Ended:
    """Call `trial(*given, progress)` in a process of its own; return what it returns.

    Args:
        trial: A function of a module; what it is given and what it returns can be pickled.
        given: What it is given.
        progress: Told what the trial is doing.
        silent_s: Seconds for which the trial may say nothing once it has begun.
    """
    ours, theirs = children.pipe()
    process = children.process("trial", _tried, theirs, trial, given)
    children.start(process)
    theirs.close()
    doing = ""
    try:
        while ours.poll(silent_s if doing else SILENT_S):
            kind, told = ours.recv()
            if kind == "returned":
                answer: T = told
                return answer
            if kind == "raised":
                return Ended(f"{told}, while {doing or 'beginning'}")
            doing = told or doing
            progress(told)
        return Ended(f"no end in {silent_s:.0f} s of {doing or 'beginning'}")
    except EOFError:
        process.join()
        return Ended(f"the process ended by {_how(process.exitcode)}, while {doing or 'beginning'}")
    finally:
        process.kill()
        process.join()
        ours.close()


def _tried(to: "Connection", trial: Callable[..., Any], given: tuple[Any, ...]) -> None:
    try:
        told = ("returned", trial(*given, lambda doing: to.send(("doing", doing))))
    except Exception as error:  # noqa: BLE001  # whatever the code raises is a finding
        told = ("raised", f"{type(error).__name__}: {error}")
    to.send(told)


def _how(status: int | None) -> str:
    """Return the name of a signal, or the exit status."""
    if status is None or status >= 0:
        return f"exit status {status}"
    return signal.Signals(-status).name

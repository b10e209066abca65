"""Steps of a piece of work, counted: lines of Python that it runs, the same on every machine."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any


class TooManyStepsError(AssertionError):
    """It has taken more steps than it may; raised where it was at."""


@dataclass(slots=True)
class Steps:
    """How many were taken so far."""

    taken: int = 0


@contextmanager
def counted(most: int) -> Iterator[Steps]:
    """Count the lines of Python that are run meanwhile, loops inside of expressions too.

    Args:
        most: How many may be run.

    Raises:
        TooManyStepsError: It would be more.
    """
    steps, before = Steps(), sys.gettrace()

    def seen(_frame: FrameType, event: str, _given: Any) -> Any:
        steps.taken += event == "line"
        if steps.taken > most:
            raise TooManyStepsError(f"more than {most:,} steps")
        return seen

    sys.settrace(seen)
    try:
        yield steps
    finally:
        sys.settrace(before)

"""Garbage collection, suspended where much is made and nothing of it is in a circle."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """Suspend the search for circles of garbage: trees, programs and proofs have none, and the search takes up to half of the time."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def settled() -> None:
    """Have the search for circles pass over all that there is now: for who works again and again on what stays, when nobody waits.

    A search that meets all of a language server's programs takes longer than to answer a key.
    """
    gc.collect()
    gc.freeze()


@contextmanager
def last_work() -> Iterator[None]:
    """Do as `uncollected`, for the last work of a process: objects that are left at its end are not looked at, either."""
    with uncollected():
        yield
        gc.freeze()

"""What is drawn only to be copied once is drawn where the copy is read.

In: steps, the names that are drawn. Out: the steps, and what was replaced. `status_in := report.status_report`, where nothing else reads
the report's status, leaves `status_in` without a value until a condition asks for it; likewise a truth value that is computed of nothing
but names that are drawn for it alone. That is the same set of runs, put together later: fewer states differ.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rcsc.compose.promela.cycle.statements import Block, Flat, Forget, Fork, Put
from rcsc.compose.promela.liveness import mentioned
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Bool, Expr, Read


@dataclass(frozen=True, slots=True)
class LazyCopy:
    """`name` was computed so of what was drawn for it."""

    name: str
    value: Expr


def lazy_copies(
    steps: Sequence[Block], drawn: frozenset[str], between: frozenset[str]
) -> tuple[tuple[Block, ...], tuple[LazyCopy, ...]]:
    """The steps with such copies forgotten, and the copies.

    Args:
        steps: Of all machines.
        drawn: Names that are drawn.
        between: Names needed between steps; what is drawn and kept is no copy.
    """
    used = Counter(name for step in steps for name in _read(step))
    written = frozenset(name for step in steps for name in _written(step))
    once = frozenset(name for name in drawn - between - written if used[name] == 1)
    found: list[LazyCopy] = []
    return tuple(tuple(_block(step, once, found)) for step in steps), tuple(found)


def _block(block: Block, once: frozenset[str], found: list[LazyCopy]) -> Iterable[Flat]:
    for one in block:
        match one:
            case Put(name=name, value=value) if _only(value, once):
                found.append(LazyCopy(name, value))
                yield Forget((name,))
            case Fork(arms=arms, otherwise=otherwise):
                ways = tuple((when, tuple(_block(body, once, found))) for when, body in arms)
                yield Fork(ways, tuple(_block(otherwise, once, found)))
            case _:
                yield one


def _only(value: Expr, once: frozenset[str]) -> bool:
    names = set(map(str, read_by(value)))
    return bool(names) and names <= once and (isinstance(value, Read) or isinstance(value.type, Bool))


def _written(block: Block) -> Iterable[str]:
    for one in block:
        match one:
            case Put(name=name):
                yield name
            case Fork(arms=arms, otherwise=otherwise):
                for _, body in arms:
                    yield from _written(body)
                yield from _written(otherwise)
            case _:
                pass


def _read(block: Block) -> Iterable[str]:
    """Names that statements read, once for each statement."""
    for one in block:
        match one:
            case Put(value=value):
                yield from set(map(str, read_by(value)))
            case Fork(arms=arms, otherwise=otherwise):
                for when, body in arms:
                    yield from set(map(str, read_by(when)))
                    yield from _read(body)
                yield from _read(otherwise)
            case Forget():
                pass
            case _:
                yield from mentioned((one,))

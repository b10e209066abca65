"""Answers of Z3 to questions that were asked before in the same process, for who asks after each key.

In: the nodes of a question. Out: its answer, from memory where a question of the same nodes had one. A question is known by all that
it is made of, and by nothing else: no name of a line, no place in a text, no digest. An answer is kept only where nothing was left
open on the way: then a larger budget changes nothing in it. Who opens no memory asks everything anew.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TypeVar, cast

from rcsc.proof.solvers import smt
from rcsc.proof.symbolic.values import Node, parts_first

T = TypeVar("T")
Key = tuple[object, ...]

MOST_NODES = 300_000
"""Nodes of all questions that are kept: some tens of MiB."""


@dataclass(slots=True)
class Answers:
    """What was answered, the last asked last.

    Attributes:
        made: How many questions were asked because no answer was known.
    """

    made: int = 0
    _answers: OrderedDict[Key, tuple[object, int]] = field(default_factory=OrderedDict)
    _nodes: int = 0

    def get(self, key: Key, nodes: int, make: Callable[[], T]) -> T:
        """Return the answer to a question, else a new one.

        Args:
            key: All that the question is made of.
            nodes: How many nodes that are.
            make: Ask it.
        """
        known = self._answers.get(key)
        if known is not None:
            self._answers.move_to_end(key)
            return cast("T", known[0])
        before = smt.unanswered()
        answer = make()
        self.made += 1
        if smt.unanswered() == before and nodes <= MOST_NODES:
            self._answers[key] = answer, nodes
            self._nodes += nodes
            while self._nodes > MOST_NODES:
                self._nodes -= self._answers.popitem(last=False)[1][1]
        return answer


class _Thread(threading.local):
    """The memory that a thread has open."""

    def __init__(self) -> None:
        self.answers: Answers | None = None


_own = _Thread()


@contextmanager
def remembering(answers: Answers) -> Iterator[None]:
    """Inside, questions of this thread are looked up in these answers first."""
    before, _own.answers = _own.answers, answers
    try:
        yield
    finally:
        _own.answers = before


def answered(what: Key, nodes: Sequence[Node], make: Callable[[], T]) -> T:
    """Return the answer to a question about some nodes.

    Args:
        what: Which question it is, and all that it depends on beside the nodes; no budget.
        nodes: In the order in which they are asked about.
        make: Ask it; the answer is shared, and never changed.
    """
    if _own.answers is None:
        return make()
    order = list(parts_first(*nodes))
    return _own.answers.get((*what, *_spelled(order, nodes)), len(order), make)


def _spelled(order: Sequence[Node], asked: Sequence[Node]) -> Key:
    """Return the nodes with all their parts, parts first, and which of them are asked about."""
    at = {node: place for place, node in enumerate(order)}
    parts = tuple(
        (
            node.op,
            node.kind,
            node.name,
            _exactly(node.low),
            _exactly(node.high),
            *(at[part] for part in node.args),
        )
        for node in order
    )
    return parts, tuple(at[node] for node in asked)


def _exactly(bound: int | float) -> int | str:
    """Return a bound; a double with the sign of its zero, which equality does not see."""
    return bound.hex() if isinstance(bound, float) else bound

"""What hypotheses say of the spans of terms.

In: hypotheses, and the obligations already shown. Out: spans. A fact is a span that a term has wherever the hypotheses hold; it
is met with what the term's parts say.
"""

import math
from collections.abc import Collection, Iterable

from rcsc.proof.certify.values import BOOL, FREE, INT, TRUTHS, Number, Span, Term, parts_first, spanned

Facts = dict[Term, tuple[Number, Number]]

ROUNDS = 2
"""How often the hypotheses are read: what one says may sharpen another."""


class KnownSpans:
    """Spans under some hypotheses.

    Attributes:
        shown: Numbers of obligations that hold under these hypotheses.
        impossible: Whether the hypotheses contradict each other.
        work: Spans computed so far.
    """

    def __init__(self, hypotheses: Collection[Term], shown: Collection[int]) -> None:
        self.shown, self.impossible, self.work = shown, False, 0
        self._facts: Facts = {}
        self._spans: dict[Term, Span] = {}
        for _ in range(ROUNDS):
            self._spans.clear()
            for term in hypotheses:
                self._learn(term)
        self._spans.clear()

    def span(self, term: Term) -> Span:
        """Return the span of the term."""
        for part in parts_first(term, but=self._spans):
            self._spans[part] = self._span_of(part)
            self.work += 1
        return self._spans[term]

    def _span_of(self, term: Term) -> Span:
        if term.op == "kept":
            span = self._spans[term.args[0]]
            if term.debt in self.shown:
                span = _meet(span, (term.low, term.high))
        else:
            span = spanned(term, [self._spans[part] for part in term.args])
        return _meet(span, self._facts[term]) if term in self._facts else span

    def _learn(self, term: Term) -> None:
        told = self._told(term, True)
        if told is None:
            self.impossible = True
            return
        for part, span in told.items():
            met = _meet(self._facts.get(part, FREE), span)
            self._facts[part] = met
            self.impossible = self.impossible or met[0] > met[1]

    def _told(self, term: Term, yes: bool) -> Facts | None:
        """Return the spans that follow where the term is true (or false); None where that is impossible."""
        if term.op == "not":
            return self._told(term.args[0], not yes)
        span = self.span(term) or TRUTHS
        if not span[0] <= int(yes) <= span[1]:
            return None
        if term.op in ("and", "or"):
            return self._all(term.args, yes) if (term.op == "and") == yes else self._any(term.args, yes)
        told: Facts = {term: (int(yes), int(yes))}
        if term.op in ("=", "<", "<="):
            for part, bounds in self._compared(term, yes):
                told[part] = _meet(told.get(part, FREE), bounds)
                if told[part][0] > told[part][1]:
                    return None
        return told

    def _all(self, parts: Iterable[Term], yes: bool) -> Facts | None:
        told: Facts = {}
        for part in parts:
            more = self._told(part, yes)
            if more is None:
                return None
            for term, span in more.items():
                told[term] = _meet(told.get(term, FREE), span)
        return told

    def _any(self, parts: Iterable[Term], yes: bool) -> Facts | None:
        """Return the spans that follow where at least one part holds; None where none can."""
        several = [told for part in parts if (told := self._told(part, yes)) is not None]
        if not several:
            return None
        first, *others = several
        return {
            term: (min([span[0], *(other[term][0] for other in others)]), max([span[1], *(other[term][1] for other in others)]))
            for term, span in first.items()
            if all(term in other for other in others)
        }  # fmt: skip

    def _compared(self, term: Term, yes: bool) -> Iterable[tuple[Term, tuple[Number, Number]]]:
        left, right = term.args
        a, b = self.span(left), self.span(right)
        if not yes and (a is None or b is None):
            return  # a comparison with a NaN is false, and says nothing
        (a, b) = a or FREE, b or FREE
        if term.op == "=":
            yield from ((left, b), (right, a)) if yes else (*_apart(left, a, b), *_apart(right, b, a))
            return
        op = term.op
        if not yes:
            op, left, right, a, b = ("<=" if op == "<" else "<"), right, left, b, a
        by = int(op == "<" and left.sort == INT)
        yield left, (-math.inf, b[1] - by)
        yield right, (a[0] + by, math.inf)


def _apart(
    term: Term, span: tuple[Number, Number], other: tuple[Number, Number]
) -> Iterable[tuple[Term, tuple[Number, Number]]]:
    """Yield the span of a whole number or a truth without the other's only value, where that is at an end."""
    if other[0] == other[1] and term.sort in (INT, BOOL):
        yield term, (span[0] + (span[0] == other[0]), span[1] - (span[1] == other[0]))


def _meet(span: Span, other: tuple[Number, Number]) -> tuple[Number, Number]:
    """Return the intersection; a span with an end holds no NaN."""
    return other if span is None else (max(span[0], other[0]), min(span[1], other[1]))

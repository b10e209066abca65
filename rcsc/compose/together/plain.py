"""What a level keeps of its plain outputs, found, so that who reads them may take it for granted under any timing.

In: the levels, their proofs alone. Out: levels that owe and are given more facts, proved again. A *plain* output is one that no protocol
speaks of. Of a buffer with such outputs, however late it is seen, a reader takes a value that was published as a whole, or what it begins
with: so what holds of each value that the writer gives, and of those with which both begin, holds of what is taken (`contract.facts`, where
tables declare such facts themselves). Values that no walk of the writer shows are candidates: all together of truth values and members of
one buffer, and the ends of a number. The writer owes each; what is proved of it (`Sort.OWED`), restarts and refused inputs included, is
given to the reader.

Nothing here is trusted. A fact that is found is a claim as one that is declared is: proved of the writer by its own means, given in the
proof of the reader, which rests on it. Both may rest on each other in a circle, by induction over cycles (`compose.__doc__`). Of two
buffers nothing is said: their values may be of different cycles, and what goes together is known as scheduled alone (`left_open`). Nor is
anything said of the order in which values follow one another.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, product
from math import prod
from random import Random

from rcsc.base.host.cache import Cache
from rcsc.code.testing.inputs.condition_text import words
from rcsc.compose.contract.claims import ACCEPTED, closed
from rcsc.compose.contract.environment import Given, Owed, leaves_under
from rcsc.compose.contract.facts import at_the_writer
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.walk import Walk
from rcsc.compose.exact.said import between, of_formula, of_states
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.assume_guarantee import agreements, claims
from rcsc.compose.proof.level import LevelProof
from rcsc.compose.proof.system import SystemProof, prove_transition_systems
from rcsc.lang.interpret import initial
from rcsc.lang.model import Bool, Enum, Expr, Int, Scalar, key_bounds, key_of
from rcsc.lang.over_time.past import negation

MOST_TOGETHER = 64
"""Values of truth values and members of a buffer that are looked at together."""
WALKS, WALK = 6, 60
"""Walks of a writer, and their cycles."""


def with_what_is_kept(
    systems: Mapping[str, TransitionSystem], whole: SystemProof, effort: Effort, cache: Cache | None = None
) -> tuple[dict[str, TransitionSystem], SystemProof]:
    """Return the levels with facts that are found of what open ones read, and their proof with these; as they were where none helps."""
    known = dict(systems)
    for name in systems:
        if (open_ := _open(whole, name)) and set(known) == {proof.level for proof in whole.levels}:
            more = _with_facts(known, name, effort)
            changed = tuple(level for level in known if more[level] is not known[level])
            if not changed:
                continue
            proofs = {proof.level: proof for proof in whole.levels}
            again = prove_transition_systems(more, effort, 1, changed, None, cache)
            proofs |= {proof.level: proof for proof in again.levels}
            new = _whole(more, proofs, whole.seconds + again.seconds)
            others = all(_open(new, level) <= _open(whole, level) for level in known)
            if others and _open(new, name) < open_:
                known, whole = more, new
    return known, whole


def _open(whole: SystemProof, level: str) -> frozenset[tuple[str, str, str]]:
    return frozenset(one.key for proof in whole.levels if proof.level == level for one in proof.open)


def _whole(
    systems: Mapping[str, TransitionSystem], proofs: Mapping[str, LevelProof], seconds: float
) -> SystemProof:
    """Put the proofs of all levels together."""
    every = tuple(proofs[name] for name in systems)
    return SystemProof(every, tuple(agreements(systems, proofs)), seconds, closed(claims(systems, proofs)))


def _with_facts(
    systems: Mapping[str, TransitionSystem], reader: str, effort: Effort
) -> dict[str, TransitionSystem]:
    """Return the levels with what is proved of the plain outputs that a level reads: it is given that, and their writers owe it."""
    more = dict(systems)
    for buffer in _plain(systems, reader):
        kept = _kept(more[buffer.writer], buffer, effort)
        there = {fact.condition for fact in more[reader].links.given}
        for condition in (one for one in kept if one not in there):
            fact = Given(words(condition), buffer.record, buffer.writer, condition)
            links = more[reader].links
            more[reader] = replace(more[reader], links=replace(links, given=(*links.given, fact)))
            owed = Owed(f"{reader}.{fact.name}", buffer.at_the_writer(condition))
            links = more[buffer.writer].links
            more[buffer.writer] = replace(more[buffer.writer], links=replace(links, owes=(*links.owes, owed)))
    return more


@dataclass(frozen=True, slots=True)
class _Buffer:
    """A buffer between two levels.

    Attributes:
        record: The reader's input; `output`, the writer's; `leaves`, those of the input with their types.
        begins: What the reader begins with, by key.
    """

    reader: str
    writer: str
    record: str
    output: str
    leaves: tuple[tuple[str, Scalar], ...]
    begins: Mapping[str, int]

    def at_the_writer(self, condition: Expr) -> Expr:
        """Return a condition on the reader's input as one on the writer's output."""
        return at_the_writer(condition, self.record, self.output)

    def written(self, leaf: str) -> str:
        """Return a leaf of the input as the writer has it."""
        return self.output + leaf.removeprefix(self.record)


def _plain(systems: Mapping[str, TransitionSystem], reader: str) -> Iterator[_Buffer]:
    """Yield the buffers of other levels that a level reads, and of which no protocol speaks."""
    ts = systems[reader]
    first = initial(ts.program)
    for record, writer, output in ts.links.written:
        leaves = leaves_under(ts.program, record)
        if writer in systems and leaves and set(leaves) <= set(ts.links.free):
            kinds = tuple((leaf, ts.kinds[leaf]) for leaf in leaves)
            begins = {leaf: key_of(kind, first[leaf]) for leaf, kind in kinds}
            yield _Buffer(reader, writer, record, output, kinds, begins)


def _kept(ts: TransitionSystem, buffer: _Buffer, effort: Effort) -> list[Expr]:
    """Return what is proved of all values that a level gives in a buffer: of the reader's leaves."""
    states = [buffer.begins, *_given(ts, buffer)]
    listed = [(leaf, kind) for leaf, kind in buffer.leaves if isinstance(kind, Bool | Enum)]
    rows = {tuple(state[leaf] for leaf, _ in listed) for state in states}
    tried: dict[Expr, tuple[int, ...]] = {}
    if listed and prod(_many(kind) for _, kind in listed) <= MOST_TOGETHER:
        every = product(*(range(key_bounds(kind)[0], key_bounds(kind)[1] + 1) for _, kind in listed))
        tried = {negation(_one_of([row], listed)): row for row in every if row not in rows}
    ends = [end for leaf, kind in buffer.leaves if isinstance(kind, Int) for end in _ends(leaf, kind, states)]
    proved = _proved(ts, buffer, [*tried, *ends], effort)
    never = {row for condition, row in tried.items() if condition in proved}
    found = [end for end in ends if end in proved]
    if never:
        every = product(*(range(key_bounds(kind)[0], key_bounds(kind)[1] + 1) for _, kind in listed))
        found.append(_one_of([row for row in every if row not in never], listed))
    return found


def _many(kind: Scalar) -> int:
    low, high = key_bounds(kind)
    return high - low + 1


def _one_of(rows: Sequence[tuple[int, ...]], leaves: Sequence[tuple[str, Scalar]]) -> Expr:
    return of_formula(of_states(rows, [kind for _, kind in leaves]), leaves)


def _ends(leaf: str, kind: Int, states: Sequence[Mapping[str, int]]) -> Iterator[Expr]:
    """Yield that a number is no less, and no more, than it was seen, where its type allows that."""
    low, high = key_bounds(kind)
    least, most = (end(state[leaf] for state in states) for end in (min, max))
    if least > low:
        yield between((leaf, kind), least, high)
    if most < high:
        yield between((leaf, kind), low, most)


def _given(ts: TransitionSystem, buffer: _Buffer) -> Iterator[dict[str, int]]:
    """Yield what a level begins with in a buffer, and what it gives on walks."""
    walks = (Walk(ts, Random(seed)).states(WALK) for seed in range(WALKS))  # noqa: S311  # the same each time
    for state in (initial(ts.program), *chain.from_iterable(walks)):
        yield {leaf: key_of(kind, state[buffer.written(leaf)]) for leaf, kind in buffer.leaves}


def _proved(ts: TransitionSystem, buffer: _Buffer, conditions: Sequence[Expr], effort: Effort) -> set[Expr]:
    """Return which of these conditions the writer is proved to keep."""
    if not conditions:
        return set()
    names = {f"{at}": condition for at, condition in enumerate(conditions)}
    owes = tuple(Owed(name, buffer.at_the_writer(condition)) for name, condition in names.items())
    owing = replace(ts, links=replace(ts.links, owes=owes))
    [proof] = prove_transition_systems(
        {ts.level.name: owing}, replace(effort, looks=False), 1, (ts.level.name,)
    ).levels
    return {
        names[owed.name]
        for owed, verdict in proof.verdicts
        if owed.sort is Sort.OWED and verdict in ACCEPTED and not proof.needs_admission(owed.key)
    }

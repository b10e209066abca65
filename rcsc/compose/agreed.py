"""What the levels of a system assume of each other, matched with what was proved of them.

In: steppers of all levels. Out: `Promise`s, each with the goals of the neighbour that keep it, and, for proofs, whether they do.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.compose.contract import COMMAND, ECHO, ECHOED, NUMBER
from rcsc.compose.goals import Key, Sort
from rcsc.compose.level import LevelProof, Verdict
from rcsc.compose.transition import NUMBERS, Stepper

Need: TypeAlias = tuple[str, Key]
"""A level, and which of its goals."""


@dataclass(frozen=True, slots=True)
class Promise:
    """One thing that a level assumes of a neighbour.

    Attributes:
        level: Who assumes it.
        assumed: In words.
        reason: Whose guarantee it is, in words.
        needs: What must be proved of the neighbour.
        begins: Whether both begin in agreement.
        outside: Whether the neighbour stands outside the levels: then it is its own to keep.
    """

    level: str
    assumed: str
    reason: str
    needs: tuple[Need, ...] = ()
    begins: bool = True
    outside: bool = False


@dataclass(frozen=True, slots=True)
class Agreement:
    """One thing that a level assumes of a neighbour, and why it may.

    Attributes:
        level: Who assumes it.
        assumed: In words.
        reason: Whose guarantee it is, in words.
        holds: Whether it is proved; where the neighbour stands outside the levels it is the neighbour's to keep.
    """

    level: str
    assumed: str
    reason: str
    holds: bool
    outside: bool = False


def agreements(made: Mapping[str, Stepper], proofs: Mapping[str, LevelProof]) -> list[Agreement]:
    """What each level assumes of each neighbour, matched with what was proved there."""
    proved = {
        (name, goal.key)
        for name, proof in proofs.items()
        for goal, verdict in proof.found
        if verdict is Verdict.PROVED
    }
    return [
        Agreement(one.level, one.assumed, one.reason, _kept(one, proved), one.outside)
        for one in promises(made)
    ]


def _kept(promise: Promise, proved: Collection[Need]) -> bool:
    return promise.begins and all(need in proved for need in promise.needs)


def promises(made: Mapping[str, Stepper]) -> Iterator[Promise]:
    """What each level assumes of each neighbour."""
    for name, stepper in made.items():
        yield from _of_above(name, stepper, made)
        yield from _of_below(name, stepper, made)


def _of_below(name: str, stepper: Stepper, made: Mapping[str, Stepper]) -> Iterator[Promise]:
    for below in stepper.links.below:
        words = f"what `{below.name}` reports under the number of the last order is about that order"
        if below.outside:
            yield Promise(name, words, f"`{below.name}` stands outside the levels", outside=True)
            continue
        lower = made[below.name].links.above
        if lower is None:
            yield Promise(name, words, f"`{below.name}` takes no numbered orders", begins=False)
            continue
        yield Promise(
            name,
            words,
            f"proved of `{below.name}`: {Sort.ECHOES.value}; both begin with the same order",
            ((below.name, (Sort.ECHOES, "", lower.report)),),
            _begin(stepper, below.order, made[below.name], lower.order),
        )


def _of_above(name: str, stepper: Stepper, made: Mapping[str, Stepper]) -> Iterator[Promise]:
    above = stepper.links.above
    if above is None:
        return
    fields = ", ".join(f"`{leaf}`" for leaf in above.numbered)
    words = (
        f"while the number of `{above.order}` stays, so do {fields}"
        if fields
        else f"the numbers of `{above.order}` come one after the other"
    )
    if above.outside:
        yield Promise(name, words, f"`{above.name}` stands outside the levels", outside=True)
        return
    upper = next(one for one in made[above.name].links.below if one.name == name)
    keys: list[Key] = [
        (Sort.NUMBERED, "", other_end(leaf, above.order, upper.order)) for leaf in above.numbered
    ]
    keys.append((Sort.NEXT_NUMBER, "", upper.order))
    needs = tuple((above.name, key) for key in keys)
    yield Promise(name, words, f"proved of `{above.name}`: {Sort.NUMBERED.value}", needs)


def other_end(leaf: str, record: str, other: str) -> str:
    """The same field at the other end of the buffer."""
    return other + leaf.removeprefix(record)


def _begin(upper: Stepper, order: str, lower: Stepper, record: str) -> bool:
    """Before the first cycle the lower level's order is the upper's, and the upper sees it echoed, or none that is still to come."""
    first = {str(v.name): v.initial for v in upper.program.variables}
    other = {str(v.name): v.initial for v in lower.program.variables}
    above = lower.links.above
    numbered = () if above is None else above.numbered
    ends = {leaf: other_end(leaf, record, order) for leaf in (f"{record}.{COMMAND}", *numbered)}
    ends[f"{record}.{NUMBER}"] = number = f"{order}.{NUMBER}"
    report = next(one.report for one in upper.links.below if one.order == order)
    if not first.keys() >= {*ends.values(), f"{report}.{ECHOED}"} or not other.keys() >= ends.keys():
        return False  # a field is missing, or named otherwise
    sent, echo = int(first[number]), int(first[f"{report}.{ECHO}"])
    echoed = (sent - echo) % NUMBERS < NUMBERS // 2
    if echo == sent:
        echoed = first[f"{report}.{ECHOED}"] == first[f"{order}.{COMMAND}"]
    return echoed and all(other[leaf] == first[end] for leaf, end in ends.items())

"""What is claimed of levels, what each claim rests on, and what is proved of them over the whole chain.

In: `Claim`s, each with what was found of it *given* what it rests on. Out: `Closed`, one for each: a claim is proved only where it, and
all that it rests on, directly or not, is found so or stated as assumed. What is missing is *not looked at*, and never proved.

Claims may rest on each other in a circle: an invariant on the safety of the procedures that keep it, which is shown under the invariant;
a guarantee of a level on one of its neighbour, and back. Each such step goes back by a cycle (`compose.__doc__`): what holds in a cycle is
shown from what held in the cycles before. So a circle of claims, each found so, stands; as soon as one of them is not, none does.

Example: `p` rests on `safe`, `safe` on invariant `i`, and `i` on `safe`. If `i` is found, all three are proved. If a restart breaks `i`,
none is, and `p` lacks `i`.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

Key: TypeAlias = tuple[str, str, str]
"""What tells the claims about a level apart: sort, table and name."""
Need: TypeAlias = tuple[str, Key]
"""A level, and which claim."""

RUNS: Key = ("the level runs as its tables say", "", "")
"""What every other claim of a level rests on."""
SAFE: Key = ("every operation is defined and in range", "", "")
ENDING: Key = ("every command ends", "", "")
"""What the endings of the level above rest on."""
CONTRACT, UNREACHED, AGAIN = "the contract", "never reached", "does nothing when it matches again"
"""Sorts of claims that are no obligations of one cycle."""


class Verdict(StrEnum):
    """What was found of a claim, given what it rests on."""

    PROVED = "proved"
    NOT_PROVED = (
        "not proved"  # some state that the invariant allows breaks it: perhaps one that is never reached
    )
    UNDECIDED = "undecided"  # the solver gave up
    TRUSTED = "assumed"  # the tables say so, of what comes from outside
    UNLOOKED = "not looked at"


FOUND = frozenset({Verdict.PROVED, Verdict.TRUSTED})


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement about a level, with what was found of it.

    Attributes:
        verdict: What was found of it, given what it rests on.
        rests_on: Other claims.
        trusts: What it takes for granted that no level is responsible for, in words.
    """

    verdict: Verdict
    rests_on: tuple[Need, ...] = ()
    trusts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Promise:
    """One thing that a level assumes of a neighbour.

    Attributes:
        level: Who assumes it.
        record: In which the level takes what it is about.
        assumed: In words; `reason`, whose guarantee it is.
        needs: What must be proved of the neighbour.
        own: What the level has to keep itself: reports are about its orders only as far as it numbers them.
        begins: Whether both begin in agreement.
        outside: Whether the neighbour stands outside the levels: then it is its own to keep.
        holds: Whether it is found so of the neighbour, given what that rests on; known where proofs are.
    """

    level: str
    record: str
    assumed: str
    reason: str
    needs: tuple[Need, ...] = ()
    own: tuple[Need, ...] = ()
    begins: bool = True
    outside: bool = False
    holds: bool = False

    @property
    def claim(self) -> tuple[Need, Claim]:
        """The claim that what the level takes in the record is as it assumes."""
        trusts = self.reason.replace("stands outside the levels", "keeps to the protocol")
        verdict = Verdict.PROVED if self.begins else Verdict.NOT_PROVED
        claim = Claim(verdict, (*self.needs, *self.own), (trusts,) if self.outside else ())
        return (self.level, (CONTRACT, "", self.record)), claim


@dataclass(frozen=True, slots=True)
class Closed:
    """A claim together with everything that it rests on, directly or not.

    Attributes:
        verdict: What was found of it, given that.
        lacks: Claims in what it rests on that are not found so: itself apart.
        trusts: All that is taken for granted.
    """

    verdict: Verdict
    lacks: tuple[Need, ...] = ()
    trusts: tuple[str, ...] = ()

    @property
    def found(self) -> bool:
        """Whether it is found so, given what it rests on."""
        return self.verdict in FOUND

    @property
    def proved(self) -> bool:
        """Whether it holds, given only what is taken for granted."""
        return self.found and not self.lacks


UNKNOWN = Closed(Verdict.UNLOOKED)


def closed(claims: Mapping[Need, Claim]) -> dict[Need, Closed]:
    """Close claims under what they rest on: the least sets of what each lacks and trusts."""
    lacks: dict[Need, frozenset[Need]] = dict.fromkeys(claims, frozenset())
    trusts = {need: frozenset(claim.trusts) for need, claim in claims.items()}
    grows = True
    while grows:
        grows = False
        for need, claim in claims.items():
            more = frozenset().union(
                *(_missing(one, claims) | lacks.get(one, frozenset()) for one in claim.rests_on)
            )
            trusted = trusts[need].union(*(trusts.get(one, frozenset()) for one in claim.rests_on))
            if not more <= lacks[need] or trusted != trusts[need]:
                lacks[need], trusts[need], grows = lacks[need] | more, trusted, True
    return {
        need: Closed(claim.verdict, tuple(sorted(lacks[need] - {need})), tuple(sorted(trusts[need])))
        for need, claim in claims.items()
    }


def _missing(need: Need, claims: Mapping[Need, Claim]) -> frozenset[Need]:
    found = claims.get(need)
    return frozenset() if found is not None and found.verdict in FOUND else frozenset({need})


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the verdict of a conjunction of claims."""
    order = (Verdict.NOT_PROVED, Verdict.UNDECIDED, Verdict.UNLOOKED, Verdict.TRUSTED)
    every = set(verdicts)
    return next((verdict for verdict in order if verdict in every), Verdict.PROVED)


DECLARED = ", as it is declared"
"""How what is trusted ends of which a table says that it is assumed."""


def declared(trusts: Iterable[str]) -> tuple[str, ...]:
    """Select the assumptions of tables from what is trusted, in order."""
    return tuple(sorted(trust.removesuffix(DECLARED) for trust in set(trusts) if trust.endswith(DECLARED)))


def spelled(need: Need, level: str, claims: Collection[Need] | None = None) -> str:
    """Spell a claim in words, with the level's name where it is another than `level`."""
    owner, (sort, table, name) = need
    said = {
        RUNS: "the level was not looked at",
        SAFE: f"{sort} within a cycle",
        ENDING: "that its commands end was not looked at",
    }
    words = said.get(need[1], " ".join(part for part in (sort, f"`{name}`" if name else "") if part))
    if sort == CONTRACT:
        words = f"what it takes in `{name}` is as it assumes"
    where = [f"level `{owner}`" if owner != level else "", f"table `{table}`" if table else ""]
    gone = ", not looked at" if claims is not None and need not in claims and need[1] not in said else ""
    return ": ".join([part for part in where if part] + [words]) + gone

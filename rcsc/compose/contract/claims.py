"""Claims about levels, what each rests on, and which of them are proved with all that they rest on.

In: `Claim`s, each with its verdict *given* what it rests on. Out: a `Closed` for each. A claim is *accepted* if its verdict is proved or
assumed; it is proved only if it and all that it rests on, directly or not, are accepted. A missing claim is *not looked at*, never proved.

Claims may rest on each other in a circle: an invariant on the safety of the procedures that keep it, and their safety on the invariant;
a guarantee of a level on one of its neighbour, and back. Each such step goes back by a cycle (`compose.__doc__`): what holds in a cycle is
shown from what held in the cycles before. So a circle of accepted claims stands; once one of them is not accepted, none does.

Example: `p` rests on `safe`, `safe` on invariant `i`, and `i` on `safe`. If all three are accepted, all are proved. If a restart breaks
`i`, none is, and `p` lacks `i`.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum
from typing import TypeAlias

Key: TypeAlias = tuple[str, str, str]
"""Identifies a claim about a level: sort, table and name."""
Need: TypeAlias = tuple[str, Key]
"""A level, and the key of a claim about it."""

RUNS: Key = ("the level runs as its tables say", "", "")
"""What every other claim of a level rests on."""
SAFE: Key = ("every operation is defined and in range", "", "")
ENDING: Key = ("every command ends", "", "")
"""What termination of the level above rests on."""
RESTING: Key = ("the command that rests ends", "", "")
"""What it rests on where the level above fails orders that are not answered in time."""
CONTRACT, UNREACHED, AGAIN = "the contract", "never reached", "does nothing when it matches again"
GIVEN = "what another level writes is as it assumes"
KEPT = "can always be kept"
STANDS: Key = ("its report stands once it has answered", "", "")
"""What termination of a level above may rest on, where that reads more of it than echo and status."""
"""Sorts of claims that are no obligations of one cycle."""


class Verdict(StrEnum):
    """The verdict on a claim, given the claims it rests on."""

    PROVED = "proved"
    NOT_PROVED = "not proved"  # a state within the invariant breaks it, perhaps one that is never reached
    UNDECIDED = "undecided"  # the solver gave up
    TRUSTED = "assumed"  # the tables declare it, of what comes from outside
    UNLOOKED = "not looked at"


ACCEPTED = frozenset({Verdict.PROVED, Verdict.TRUSTED})


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement about a level, with its verdict.

    Attributes:
        verdict: Whether it holds, given what it rests on.
        rests_on: Other claims.
        trusts: Assumptions for which no level is responsible, in words.
    """

    verdict: Verdict
    rests_on: tuple[Need, ...] = ()
    trusts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Promise:
    """An assumption of a level about a neighbour.

    Attributes:
        level: The level that assumes it.
        record: The input that it is about.
        assumed: The assumption in words; `reason`, who guarantees it.
        needs: Claims that must be proved of the neighbour.
        own: Claims that the level itself must keep: reports are about its orders only if it numbers them.
        begins: Whether both sides agree initially.
        outside: Whether the neighbour stands outside the levels, and must keep it by its own means.
        holds: Whether the neighbour's claims are accepted, given what they rest on; set once there are proofs.
        fact: The name of the declared assumption; empty for one of the protocol.
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
    fact: str = ""

    @property
    def claim(self) -> tuple[Need, Claim]:
        """The claim that the record's values are as the level assumes."""
        trusts = self.reason.replace("stands outside the levels", "keeps to the protocol")
        verdict = Verdict.PROVED if self.begins else Verdict.NOT_PROVED
        claim = Claim(verdict, (*self.needs, *self.own), (trusts,) if self.outside else ())
        key = (GIVEN, "", self.fact) if self.fact else (CONTRACT, "", self.record)
        return (self.level, key), claim


@dataclass(frozen=True, slots=True)
class Closed:
    """A claim together with everything that it rests on, directly or not.

    Attributes:
        verdict: Whether it holds, given that.
        lacks: The claims that it rests on, itself apart, that are not accepted.
        trusts: All assumptions for which no level is responsible.
    """

    verdict: Verdict
    lacks: tuple[Need, ...] = ()
    trusts: tuple[str, ...] = ()

    @property
    def accepted(self) -> bool:
        """Whether it is proved or assumed, given what it rests on."""
        return self.verdict in ACCEPTED

    @property
    def proved(self) -> bool:
        """Whether it holds under `trusts` alone."""
        return self.accepted and not self.lacks


UNKNOWN = Closed(Verdict.UNLOOKED)


def closed(claims: Mapping[Need, Claim]) -> dict[Need, Closed]:
    """Compute, for each claim, the least sets of claims that it lacks and of assumptions that it trusts, directly or not."""
    lacks: dict[Need, frozenset[Need]] = dict.fromkeys(claims, frozenset())
    trusts = {need: frozenset(claim.trusts) for need, claim in claims.items()}
    grows = True
    while grows:
        grows = False
        for need, claim in claims.items():
            more = frozenset().union(
                *(_missing(other, claims) | lacks.get(other, frozenset()) for other in claim.rests_on)
            )
            trusted = trusts[need].union(*(trusts.get(other, frozenset()) for other in claim.rests_on))
            if not more <= lacks[need] or trusted != trusts[need]:
                lacks[need], trusts[need], grows = lacks[need] | more, trusted, True
    return {
        need: Closed(claim.verdict, tuple(sorted(lacks[need] - {need})), tuple(sorted(trusts[need])))
        for need, claim in claims.items()
    }


def _missing(need: Need, claims: Mapping[Need, Claim]) -> frozenset[Need]:
    claim = claims.get(need)
    return frozenset() if claim is not None and claim.verdict in ACCEPTED else frozenset({need})


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the verdict of a conjunction of claims."""
    order = (Verdict.NOT_PROVED, Verdict.UNDECIDED, Verdict.UNLOOKED, Verdict.TRUSTED)
    every = set(verdicts)
    return next((verdict for verdict in order if verdict in every), Verdict.PROVED)


DECLARED = ", as it is declared"
"""The suffix of a trusted assumption that a table declares."""


NEVER_REFUSED, NOT_FOR_EVER, IN_RANGE = (
    "never refused",
    "not refused for ever",
    "in range where it begins anew",
)
"""How what is trusted of refusals, and of what would be clamped, ends: a claim about each cycle needs the first and the last, one that
something ends the second."""


def declared(trusts: Iterable[str]) -> tuple[str, ...]:
    """Select from what is trusted, in order, the assumptions of tables, and those about refusals and timing."""
    named = (t for t in set(trusts) if t.endswith(DECLARED) or of_refusals(t) or of_timing(t))
    return tuple(sorted(trust.removesuffix(DECLARED) for trust in named))


def of_refusals(trust: str) -> bool:
    """Return whether the assumption is that something is not refused, at all or for ever."""
    return trust.endswith((NEVER_REFUSED, NOT_FOR_EVER, IN_RANGE))


def of_timing(trust: str) -> bool:
    """Return whether the assumption is that a level takes what others give as they are scheduled, or not much later."""
    return trust_of(trust)[0] in {Trust.SCHEDULED.name, Trust.LATE.name}


def spelled(need: Need, level: str, claims: Collection[Need] | None = None) -> str:
    """Spell a claim in words, with its level's name unless that is `level`."""
    owner, (sort, table, name) = need
    phrases = {
        RUNS: "the level was not looked at",
        SAFE: f"{sort} within a cycle",
        ENDING: "that its commands end was not looked at",
        RESTING: "that it comes to rest was not looked at",
        STANDS: "that its report stands once it has answered was not shown",
    }
    words = phrases.get(need[1], " ".join(part for part in (sort, f"`{name}`" if name else "") if part))
    if sort == CONTRACT:
        words = f"what it takes in `{name}` is as it assumes"
    elif sort == KEPT:
        words = f"that assumption `{name}` {KEPT}"
    where = [f"level `{owner}`" if owner != level else "", f"table `{table}`" if table else ""]
    gone = ", not looked at" if claims is not None and need not in claims and need[1] not in phrases else ""
    return ": ".join([part for part in where if part] + [words]) + gone


# --- trusts ----------------------------------------------------------------------------------


class Trust(Enum):
    """A kind of trust, with the sentence that `rcsc prove` prints of it; LEVEL, NAME, INPUTS and ARE stand for whom and what it is about.

    No level is responsible for what claims trust. One table, so that what watches a claim can tell when its trust is broken.
    """

    DECLARED = "assumption `NAME` of level `LEVEL`, as it is declared"
    STATES = "level `LEVEL` can be as its tables declare in every state that it comes to"
    DATABASE = "the same question has the same answer in `NAME` of level `LEVEL`"
    PROTOCOL = "`LEVEL` keeps to the protocol"
    REFUSED = "INPUTS of level `LEVEL` ARE never refused"
    CLAMPED = "INPUTS of level `LEVEL` ARE in range where it begins anew"
    NOT_FOR_EVER = "INPUTS of level `LEVEL` ARE not refused for ever"
    RESTS = "`LEVEL` comes to rest some time where it is told to, and stays so"
    ANSWERS = "`LEVEL` answers every order that is not replaced, and stays so"
    STILL = "the values in `NAME` of level `LEVEL` stand still meanwhile"
    SCHEDULED = "level `LEVEL` takes what others give as scheduled"
    LATE = "level `LEVEL` takes what others give at most `NAME` ticks late"
    EXTERNS_FINITE = "extern procedures of level `LEVEL` are not refused for ever"


_PLACES = {
    "LEVEL": "(?P<level>[^`]+)",
    "NAME": "(?P<name>[^`]+)",
    "INPUTS": "`[^`]+`(?:, `[^`]+`)*",
    "ARE": "(?:is|are)",
}
_PATTERNS = {
    trust: re.compile(re.sub("|".join(_PLACES), lambda found: _PLACES[found[0]], re.escape(trust.value)))
    for trust in Trust
}


def trust_of(words: str) -> tuple[str, str, str]:
    """Return a trust's kind, its level or neighbour, and its name; empty where it has none, all empty for a sentence of no kind."""
    for trust, pattern in _PATTERNS.items():
        if (found := pattern.fullmatch(words)) is not None:
            parts = found.groupdict()
            return trust.name, parts.get("level") or "", parts.get("name") or ""
    return "", "", ""

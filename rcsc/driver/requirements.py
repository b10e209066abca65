"""How the requirements of a system stand, as far as earlier proofs say: those of its levels, and those across them.

In: a system's description and the cache. Out: a `KnownRequirement` for each, without a solver, a search or a cycle. What nobody asked since
its tables changed is unknown. And the lines that have a part in one across levels.
"""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from rcsc.base.diagnostics import report
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.cache import Cache
from rcsc.compose.contract.claims import UNKNOWN, Closed, Key, declared
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.proof.standing import KnownSystem, KnownVerdict, standing
from rcsc.compose.proof.system import loaded_program, transition_systems_of
from rcsc.compose.together.kept import recalled
from rcsc.compose.together.proof import Across, Question
from rcsc.compose.together.said import said, state, trusts_of
from rcsc.compose.together.words import stated_across
from rcsc.driver.outline import outline
from rcsc.lang.model import Program, Property
from rcsc.lang.project import Loaded
from rcsc.run.description import Description, description

NOBODY_ASKED = "not asked since its tables changed: `rcsc prove` answers it"
"""What is said of a requirement of which no verdict is kept."""
_STATES = {
    KnownVerdict.PROVED: "proved",
    KnownVerdict.TRUSTED: "proved",
    KnownVerdict.PARTLY: "proved",
    KnownVerdict.CONDITIONAL: "conditional",
    KnownVerdict.REFUTED: "refuted",
    KnownVerdict.NOT_PROVED: "open",
    KnownVerdict.UNKNOWN: "unknown",
}


@dataclass(frozen=True, slots=True)
class KnownRequirement:
    """A property, a requirement or an assumption over time, with its standing.

    Attributes:
        level: Whose it is; empty across levels.
        place: File and line.
        state: `proved`, `conditional` (rests on what is not proved), `refuted`, `open`, `unknown`, or `assumed`.
        words: The verdict in words.
        timing: `any`, `late` or `scheduled`; empty for one of a level, which is proved under any, and where nothing is proved.
        levels: Those that the proof is about, or that its run is of.
        trusts: What the verdict trusts.
        tick: In which a run breaks it; 0 where none is known.
    """

    level: str
    stated: Property
    place: str
    state: str
    words: str
    timing: str = ""
    levels: tuple[str, ...] = ()
    trusts: tuple[str, ...] = ()
    tick: int = 0


@dataclass(frozen=True, slots=True)
class Read:
    """A system, read.

    Attributes:
        programs: By level.
        systems: Each with its environment.
        across: What is stated across levels, if anything is.
        known: What is known of its levels.
    """

    described: Description
    programs: Mapping[str, tuple[Program, Loaded]]
    systems: Mapping[str, TransitionSystem]
    across: tuple[Program, Loaded] | None
    known: KnownSystem | None


def read(system: Path, cache: Cache | None) -> Read:
    """Read a system, and what is kept of its proof.

    Raises:
        BadDescription, NoProgramError: It is not in order.
    """
    described = description(system)
    loaded = {spec.name: loaded_program(system, described, spec) for spec in described.levels}
    programs = {name: program for name, (program, _) in loaded.items()}
    systems = transition_systems_of(described, programs)
    known = None if cache is None else standing(cache, outline(systems))
    return Read(described, loaded, systems, stated_across(described, programs), known)


def known_requirements(its: Read, cache: Cache | None) -> Iterator[KnownRequirement]:
    """Yield what is stated across levels, then what each level states, with its standing."""
    if its.across is not None:
        program, loaded = its.across
        for stated in program.stated:
            yield _across(its, stated, place(loaded, stated.span), cache)
    for level, (program, loaded) in its.programs.items():
        for stated in program.stated:
            if not stated.standard:
                yield _of_level(its, level, stated, place(loaded, stated.span))


def place(loaded: Loaded, span: Span) -> str:
    """Return file and line of a span."""
    source = loaded.sources.get(span.file)
    file = os.path.relpath(span.file)
    return file if source is None else f"{file}:{source.position(span.start).line}"


def _across(its: Read, stated: Property, where: str, cache: Cache | None) -> KnownRequirement:
    if stated.assumed:
        return KnownRequirement("", stated, where, "assumed", "assumed of what stands outside")
    assert its.across is not None
    found = None
    if cache is not None:
        found = recalled(Question(its.systems, its.described, its.across[0], stated), cache)
    if found is None:
        return KnownRequirement("", stated, where, "unknown", NOBODY_ASKED)
    return of_answer(found, its.systems, {} if its.known is None else its.known.closed, where)


def of_answer(
    found: Across,
    systems: Mapping[str, TransitionSystem],
    claims: Mapping[tuple[str, Key], Closed],
    where: str,
) -> KnownRequirement:
    """Return the standing of a requirement across levels that was answered."""
    closed = found.closed(systems, claims)
    return KnownRequirement(
        "",
        found.stated,
        where,
        state(found, closed),
        said(found, closed, claims),
        found.timing.value if found.proved else "",
        found.levels,
        tuple(trusts_of(found, closed)),
        0 if found.proved else len(found.run),
    )


def _of_level(its: Read, level: str, stated: Property, where: str) -> KnownRequirement:
    if stated.assumed:
        return KnownRequirement(level, stated, where, "assumed", "assumed of what comes from outside")
    key = stated.word, "", stated.name
    verdict = KnownVerdict.UNKNOWN if its.known is None else its.known.of_obligation(level, key)
    if its.known is None or verdict is KnownVerdict.UNKNOWN:
        return KnownRequirement(level, stated, where, "unknown", NOBODY_ASKED)
    closed = its.known.closed.get((level, key), UNKNOWN)
    state = _STATES[verdict]
    trusts = declared(closed.trusts)
    words = {
        "proved": f"proved under any timing{report.trusting(trusts)}",
        "conditional": f"rests on {report.named(its.known.lacking(level, key))}",
        "refuted": "a run of the level breaks it: `rcsc prove` shows the shortest",
        "open": "neither proved nor refuted: `rcsc prove` says which runs were looked at",
    }[state]
    proved = state == "proved"
    return KnownRequirement(
        level,
        stated,
        where,
        state,
        words,
        "any" if proved else "",
        (level,),
        trusts if proved else (),
    )

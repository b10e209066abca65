"""`check`, `compile` and `prove` as functions.

In: paths. Out: a `Report` of tables, or a `Proof` of levels together.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from rcsc.base.diagnostics.report import Report
from rcsc.base.host.cache import Cache, open_cache
from rcsc.code.emit import TARGETS
from rcsc.compose.contract.beginning import starts
from rcsc.compose.contract.claims import spelled
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.counterexample.consequence import spelled_leaves, told
from rcsc.compose.counterexample.explain import Explanation, TraceSettings, explain
from rcsc.compose.counterexample.finding import TimeLineRow, beginnings, rows
from rcsc.compose.counterexample.trace import usual_length
from rcsc.compose.proof.system import SystemProof, prove_transition_systems, transition_systems
from rcsc.compose.together.left_open import whole_proof
from rcsc.compose.together.repeated import answers
from rcsc.compose.together.said import said, state
from rcsc.driver import check as checking
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.proof.solvers.options import Options
from rcsc.run.description import description

if TYPE_CHECKING:
    from rcsc.compose.contract.transition import TransitionSystem

PathLike: TypeAlias = str | os.PathLike[str]


def check(*paths: PathLike, cache: bool = True) -> Report:
    """Prove that exactly one line of each table matches, for every input, as `rcsc check` does.

    Args:
        paths: Files, or folders with all `*.rcs` below them; without any, the present folder.
        cache: Whether earlier proofs are believed, and new ones kept.

    Returns:
        Diagnostics with spans and witnesses, sorted by place, and each table with its verdict; `failed` where something is wrong.

    Raises:
        FileNotFoundError: A path is not there.
    """
    return checking.check(_settings(paths, cache=cache))


def compile(  # noqa: A001  # as the command is called
    *paths: PathLike,
    out: PathLike | None = None,
    targets: Sequence[str] = tuple(TARGETS),
    write: bool = True,
    defensive: bool = False,
) -> Report:
    """Prove tables, then write their executors, as `rcsc compile` does; nothing is written unless everything is proved.

    Args:
        paths: Files, or folders with all `*.rcs` below them; without any, the present folder. Of a system, given by its `system.toml`
            or by the folder that holds it, the C of the whole is made, too.
        out: The folder for the executors, `python` and `c` in it; else the one that the system's description names, else `generated`.
        targets: Which to write, of `python` and `c`.
        write: False to find only whether the files are fresh.
        defensive: Whether the executors check their whole state in every cycle.

    Raises:
        FileNotFoundError: A path is not there.
        ValueError: There is no such target.
    """
    if unknown := sorted(set(targets) - TARGETS.keys()):
        raise ValueError(f"there is no target `{unknown[0]}`; there are {', '.join(TARGETS)}")
    settings = _settings(paths, cache=False)
    return compile_(
        settings, None if out is None else Path(out), targets, only_check=not write, defensive=defensive
    ).report


def _settings(paths: Sequence[PathLike], *, cache: bool) -> Settings:
    named = tuple(os.fspath(path) for path in paths) or (".",)
    for path in named:
        if not os.path.exists(path):
            raise FileNotFoundError(f"there is no file or folder `{path}`")
    return Settings(named, Options(), use_cache=cache)


# --- levels together ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim about a level in its system, and its verdict.

    Attributes:
        what: The kind of claim, in words: `assumption`, `some line matches`, `property` and so on.
        table: Of which it is claimed; empty for the whole level.
        name: Of the assumption, the property or the buffer; empty where the kind says it all.
        verdict: `proved`, `assumed`, or why not.
        proved: Whether it holds, and all that it rests on.
        rests_on: Claims that it rests on and that are not proved, in words.
        trusts: What it takes for granted of what no level is responsible for, in words: that an input is never refused, say.
    """

    level: str
    what: str
    table: str
    name: str
    verdict: str
    proved: bool
    rests_on: tuple[str, ...] = ()
    trusts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Unproved:
    """A finding of a proof, with the shortest run that breaks the claim.

    Attributes:
        what: What is not proved, in words.
        warning: Whether it is none of the errors: a command that is not shown to end.
        run: The run, a row a cycle and level, as the interpreter and the executors did it; empty where none was found.
        cycle: The cycle, from 1, that breaks it; 0 without a run.
        restarted: Whether the run begins where a restart does; then its first row, of tick 0, says where.
        helps: What would mend the tables, each with whether it is proved of the text that it makes.
        together: What the first helps of all findings of its table do together, at the last of them.
        follows: What comes of it, each with its run.
    """

    level: str
    table: str
    name: str
    what: str
    warning: bool
    run: tuple[TimeLineRow, ...] = ()
    cycle: int = 0
    restarted: bool = False
    helps: tuple[str, ...] = ()
    follows: tuple["Consequence", ...] = ()
    together: str = ""


@dataclass(frozen=True, slots=True)
class Consequence:
    """A continuation of a run that breaks a claim, up to what the superior takes from it.

    Attributes:
        how: `answered`, `changed` (an answer), `stops` (the system, as no line or several match) or `repeats` (unanswered).
        what: The same in a sentence.
        takes: What the superior takes of the report at the end, by leaf: the status first.
        run: The whole run, a row a cycle.
    """

    how: str
    what: str
    takes: Mapping[str, str]
    run: tuple[TimeLineRow, ...]


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement across levels, and its verdict.

    Attributes:
        says: The requirement, as it is written.
        verdict: `proved`, `conditional` (it rests on what is not proved), `refuted` or `open`.
        words: The same in words: of which levels, as they are scheduled or under any timing, what it rests on and trusts.
        proved: Whether it holds, and all that it rests on; `vacuous`, whether nothing ever asks for it.
        kinder: Whether it is proved only where less befalls levels and buffers than may.
        run: The shortest run that breaks it, a row a tick and level, as interpreter and executors did it; empty where none was found.
    """

    name: str
    says: str
    verdict: str
    words: str
    proved: bool
    vacuous: bool = False
    kinder: bool = False
    run: tuple[TimeLineRow, ...] = ()


@dataclass(frozen=True, slots=True)
class Proof:
    """The proof of a system's levels together.

    Attributes:
        proved: Whether nothing is found wrong.
        whole: Whether, besides, everything was looked at and nothing rests on what is not proved.
        not_looked_at: What could not be stated, in words.
        does_not_apply: What there is nothing to state of, in words.
        requirements: Those across levels, where all levels are proved.
    """

    proved: bool
    whole: bool
    claims: tuple[Claim, ...]
    unproved: tuple[Unproved, ...]
    not_looked_at: tuple[str, ...]
    does_not_apply: tuple[str, ...] = ()
    requirements: tuple[Requirement, ...] = ()


def prove(
    system: PathLike,
    *,
    levels: Sequence[str] = (),
    cycles: int | None = None,
    follow: int = 4,
    where: str = "",
    cache: bool = True,
    jobs: int = 1,
) -> Proof:
    """Prove the levels of a system together, for any delay, as `rcsc prove` does.

    Args:
        system: The description, `system.toml`.
        levels: Only these; all without any.
        cycles: Longest run that is looked for where something is not proved; 0 looks for none, and by default it is 8, or some more
            than a time takes that a table asks for. Runs need a C compiler.
        follow: Most cycles that such a run is followed on; 0 follows none.
        where: Initial values that runs are searched from, `leaf = value, level.leaf = value`; no verdict depends on them.
        cache: Whether earlier proofs are believed, and new ones kept.
        jobs: How many levels are proved at once.

    Raises:
        CodedError: The description, the tables of a level, the requirements across them, or `where` are not in order.
        KeyError: The system has no such level.
    """
    path = Path(system)
    systems = transition_systems(path)
    if unknown := [name for name in levels if name not in systems]:
        raise KeyError(unknown[0])
    begins = starts(systems, where)
    kept = open_cache(path.parent) if cache else None
    if levels:
        proof = prove_transition_systems(systems, None, jobs, tuple(levels), cache=kept)
    else:
        whole = whole_proof(systems, description(path), jobs=jobs, cache=kept)
        systems, proof = whole.systems, whole.proof
    most = usual_length(systems.values()) if cycles is None else cycles
    settings = TraceSettings(description(path), most, further=follow, starts=begins)
    runs = explain(systems, proof, settings)
    across = tuple(_requirements(systems, proof, settings, kept)) if not levels else ()
    left = [(level.level, unstated) for level in proof.levels for unstated in level.unstated]
    return Proof(
        proof.proved and all(one.verdict in {"proved", "conditional"} for one in across),
        proof.whole and all(one.proved and not one.vacuous and not one.kinder for one in across),
        tuple(_claims(proof)),
        tuple(_unproved(systems, explanation) for explanation in runs),
        tuple(f"{name}: {unstated.shown}" for name, unstated in left if unstated.applies),
        tuple(f"{name}: {unstated.shown}" for name, unstated in left if not unstated.applies),
        across,
    )


def _requirements(
    systems: "Mapping[str, TransitionSystem]",
    proof: SystemProof,
    settings: TraceSettings,
    cache: Cache | None,
) -> Iterator[Requirement]:
    given = answers(systems, proof, settings, cache)
    for found, explanation in () if given is None else given.every:
        closed = found.closed(systems, proof.closed)
        finding = None if explanation is None or explanation.beside else explanation.finding
        yield Requirement(
            found.stated.name,
            found.stated.text,
            state(found, closed),
            said(found, closed, proof.closed),
            found.proved and closed.proved,
            found.vacuous,
            found.kinder,
            () if finding is None else tuple(rows(systems, finding)),
        )


def _claims(proof: SystemProof) -> Iterator[Claim]:
    for level in proof.levels:
        for obligation, _ in level.verdicts:
            closed = proof.of(level.level, obligation.key)
            rests = tuple(spelled(need, level.level, proof.closed) for need in closed.lacks)
            yield Claim(
                level.level,
                obligation.sort.value,
                obligation.table,
                obligation.name,
                closed.verdict.value
                if closed.proved or not closed.accepted
                else "rests on what is not proved",
                closed.proved,
                rests,
                tuple(closed.trusts),
            )


def _unproved(systems: "Mapping[str, TransitionSystem]", explanation: Explanation) -> Unproved:
    obligation, finding = explanation.obligation, explanation.finding
    shown = obligation.shown if obligation.sort is not Sort.ENDS else f"`{obligation.table}` ends"
    if finding is None or explanation.beside:
        return Unproved(
            explanation.level, obligation.table, obligation.name, shown, explanation.warns,
            helps=explanation.helps,
        )  # fmt: skip
    return Unproved(
        explanation.level,
        obligation.table,
        obligation.name,
        shown,
        explanation.warns,
        (*beginnings(systems, finding), *rows(systems, finding)),
        finding.broken_at,
        finding.restarted,
        explanation.helps,
        tuple(_consequences(systems, explanation)),
        explanation.together,
    )


def _consequences(
    systems: "Mapping[str, TransitionSystem]", explanation: Explanation
) -> Iterator[Consequence]:
    for then in explanation.follows or ():
        ts = systems[then.level]
        run = (*beginnings(systems, then.run), *rows(systems, then.run))
        yield Consequence(then.how.value, told(ts, then), dict(spelled_leaves(ts, then.report)), run)

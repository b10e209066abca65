"""The whole system proved, level by level, as far as the cache has no proof of a level.

In: a system's description. Out: `SystemProof`. The argument in `compose.__doc__` puts the proofs of the levels together.
It needs two checks, made here: what a level assumes of a neighbour was proved of that neighbour, and both agree initially.
"""

import hashlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.host import children
from rcsc.base.host.cache import Cache
from rcsc.compose.contract.claims import UNKNOWN, Closed, Key, Need, Promise, closed, of_refusals
from rcsc.compose.contract.environment import Links, check_ends, links
from rcsc.compose.contract.facts import with_facts
from rcsc.compose.contract.obligations import Obligation, Unstated, obligations
from rcsc.compose.contract.predicates import CLOSELY, compared
from rcsc.compose.contract.properties import every_predicate
from rcsc.compose.contract.transition import Safety, TransitionSystem
from rcsc.compose.exact.said import Found, predicate
from rcsc.compose.invariant.pdr import Clause
from rcsc.compose.invariant.search import Effort, read
from rcsc.compose.proof.assume_guarantee import agreements, claims, of_level, other_end
from rcsc.compose.proof.candidates import content
from rcsc.compose.proof.context import Context
from rcsc.compose.proof.eventually import Try, bounded_by, waiting
from rcsc.compose.proof.level import (
    Bound,
    LevelProof,
    Verdict,
    bounded_proof,
    joined,
    prove_level,
    without_nodes,
)
from rcsc.compose.proof.standing import Verdicts, keep_verdicts
from rcsc.compose.proof.termination import Ending
from rcsc.lang.leaves import spoken_of
from rcsc.lang.meaning import with_stops
from rcsc.lang.model import BEFORE, AssumptionName, Kind, Program
from rcsc.lang.project import Loaded
from rcsc.run.description import BadDescription, Description, LevelSpec, description
from rcsc.run.links import check_links

SHOWN_HERE = frozenset({Code.ASSUMPTION_NOT_PROVED, Code.INVARIANT_BROKEN, Code.TWO_WRITERS})
"""Codes that are proved of the levels instead, or are no fault of a running cycle."""


class NoProgramError(CodedError):
    """A level's tables cannot be read, or are not in order; says which."""


class NotOfOutsideError(NoProgramError):
    """An assumption over time is about what does not come from outside."""

    code = Code.NOT_OF_OUTSIDE


@dataclass(frozen=True, slots=True)
class SystemProof:
    """The proof of a whole system.

    Attributes:
        closed: Each claim with all that it rests on; none about levels that were not proved.
    """

    levels: tuple[LevelProof, ...]
    agreements: tuple[Promise, ...]
    seconds: float = field(compare=False)
    closed: Mapping[Need, Closed] = field(default_factory=dict)

    @property
    def proved(self) -> bool:
        """Whether every obligation, and every agreement between levels, is accepted."""
        return all(not proof.open for proof in self.levels) and all(
            agreement.holds for agreement in self.agreements
        )

    @property
    def whole(self) -> bool:
        """Whether it is proved, nothing is unstated, and nothing rests on what is not proved."""
        return (
            self.proved
            and not any(missing.applies for proof in self.levels for missing in proof.unstated)
            and all(claim.proved for claim in self.closed.values())
        )

    @property
    def admitting(self) -> tuple[str, ...]:
        """The trusted assumptions, of all claims, that something is not refused, at all or for ever."""
        return tuple(
            sorted({trust for claim in self.closed.values() for trust in claim.trusts if of_refusals(trust)})
        )

    def of(self, level: str, key: Key) -> Closed:
        """Return a claim with all that it rests on."""
        return self.closed.get((level, key), UNKNOWN)


def transition_systems(path: Path) -> dict[str, TransitionSystem]:
    """Make a transition system for each level that the file describes, from the top down.

    A subordinate assumes that a field stays while the number does only if its superior compares that field with
    the last order. That the superior keeps it so is proved of the superior.

    Raises:
        BadDescription: The description says something that cannot be.
        NoProgramError: The tables of a level cannot be read.
    """
    return read_systems(path)[0]


def read_systems(path: Path) -> tuple[dict[str, TransitionSystem], dict[str, Loaded]]:
    """Make the transition systems of `transition_systems`; with the files that each program was read from, by its name.

    Raises:
        BadDescription: The description says something that cannot be.
        NoProgramError: The tables of a level cannot be read.
    """
    system = description(path)
    found = {spec.name: checked(path, system, spec) for spec in system.levels}
    systems = transition_systems_of(system, {name: program for name, (program, _, _) in found.items()})
    loaded = {spec.program: found[spec.name][2] for spec in system.levels}
    return {name: replace(ts, safety=found[name][1]) for name, ts in systems.items()}, loaded


def transition_systems_of(
    system: Description, programs: Mapping[str, Program]
) -> dict[str, TransitionSystem]:
    """Make the transition systems of programs that were read, one for each level.

    Raises:
        BadDescription: The description says something that cannot be.
        NoProgramError: A program has no such level.
    """
    check_links(system, programs)
    check_ends(system, programs)
    every = {name: links(system, name, program) for name, program in programs.items()}
    _check_ranks(every)
    for name, program in programs.items():
        _check_environment(program, every[name])
    every = with_facts(every, programs)
    systems = {}
    for name, program in programs.items():
        level = next((level for level in program.levels if level.name == name), None)
        if level is None:
            raise NoProgramError(f"program `{program.name}` has no level `{name}`")
        systems[name] = TransitionSystem(program, level, _narrowed(every[name], every, programs))
    return systems


def _check_environment(program: Program, links: Links) -> None:
    """Check that assumptions over time read no input that follows the protocol, or that a level or the database writes.

    Raises:
        NotOfOutsideError: One does.
    """
    inputs = {str(v.name) for v in program.variables if v.kind is Kind.INPUT}
    for stated in program.environment:
        for leaf in sorted({str(name).removeprefix(BEFORE) for name in spoken_of(stated)} & inputs):
            written = links.written_as(leaf)
            if written is None and leaf in links.free and not any(leaf in one.keys for one in links.asked):
                continue
            who = (
                "an order, a report, or an answer of the database"
                if written is None
                else f"what level `{written[1]}` writes"
            )
            raise NotOfOutsideError(
                f"assumption `{stated.name}` of level `{links.level}` is about `{leaf}`, which is {who}: it takes no assumption over time"
            )


def _check_ranks(every: Mapping[str, Links]) -> None:
    """Check that no level is its own superior at any distance: each would end its commands only if the other does.

    Raises:
        BadDescription: One is.
    """
    for name in every:
        way = [name]
        while (above := every[way[-1]].above) is not None and above.name in every and above.name not in way:
            way.append(above.name)
        if above is not None and above.name == name:
            chain = ", ".join(
                f"`{lower}` takes orders of `{upper}`" for lower, upper in pairwise((*way, name))
            )
            raise BadDescription(f"there is no highest level: {chain}")


def _narrowed(mine: Links, every: Mapping[str, Links], programs: Mapping[str, Program]) -> Links:
    """Narrow a level's numbered fields to those that its superior compares."""
    above = mine.above
    if above is None or above.outside:
        return mine
    upper = next((below for below in every[above.name].below if below.name == mine.level), None)
    if upper is None:
        raise BadDescription(
            f"`{mine.level}.{above.order}` is an order of `{above.name}`, which takes no report of it"
        )
    pairs = {leaf for pair in compared(programs[above.name]) for leaf in pair}
    kept = tuple(leaf for leaf in above.numbered if other_end(leaf, above.order, upper.order) in pairs)
    return replace(mine, above=replace(above, numbered=kept))


def checked(path: Path, system: Description, spec: LevelSpec) -> tuple[Program, Safety, Loaded]:
    """Return the program of a level, the reason why its cycles as nodes agree with its executors, and the files that it was read from.

    The two are the same only if every value stays in its range and every operation is defined. That is shown of the program alone,
    if need be under its invariants, which are obligations here. An assumption needed for it stops the cycle in which it fails.

    Raises:
        NoProgramError: The program is missing, does not resolve, or may leave a range or do an undefined operation.
    """
    from rcsc.proof.procedures.obligations import Obligations
    from rcsc.proof.solvers.options import Options

    program, loaded = loaded_program(path, system, spec)
    owed = Obligations(program, Options())
    diagnostics = owed.prove(program.tables)
    for diagnostic in diagnostics:
        if diagnostic.code not in SHOWN_HERE:
            raise NoProgramError(
                f"{diagnostic.message}: see `{_see(path, spec, diagnostic.primary.span.file)}`"
            )
    return with_stops(program, owed.stops), _safety(program, owed.stops, diagnostics), loaded


def _safety(
    program: Program, stops: Mapping[str, tuple[AssumptionName, ...]], diagnostics: Sequence[Diagnostic]
) -> Safety:
    """Decide whether safety needs the invariants: not if it is shown without them, and under no other stopping assumptions."""
    from rcsc.proof.procedures.obligations import Obligations
    from rcsc.proof.solvers.options import Options

    if not program.invariants:
        return Safety()
    without = Obligations(replace(program, invariants=()), Options())
    wrong = any(diagnostic.code not in SHOWN_HERE for diagnostic in without.prove(program.tables))
    if not wrong and all(set(names) <= set(stops.get(table, ())) for table, names in without.stops.items()):
        return Safety()
    broken = any(diagnostic.code is Code.INVARIANT_BROKEN for diagnostic in diagnostics)
    return Safety(tuple(invariant.name for invariant in program.invariants), broken)


def _see(path: Path, spec: LevelSpec, file: str) -> str:
    """Return the command that shows what is wrong with a level's program: of an instance the file may be in order."""
    return f"rcsc compile {path}" if spec.tables else f"rcsc check {file}"


def loaded_program(path: Path, system: Description, spec: LevelSpec) -> tuple[Program, Loaded]:
    """Return the program of a level, and the files that it was read from.

    Raises:
        NoProgramError: The program is missing, or does not resolve.
        BadDescription: It is an instance with parameters that do not fit it.
    """
    from rcsc.lang.resolve import resolve

    loaded = system.load(path, spec)
    if loaded is None:
        raise NoProgramError(f"there is no program `{spec.source}` beside {path}")
    program = resolve(loaded.roots[0], loaded)
    if isinstance(program, Program) and not loaded.diagnostics:
        return program, loaded
    if not isinstance(program, Program) and any(found.primary.span.file == str(path) for found in program):
        raise BadDescription("", program, loaded.sources)
    file = loaded.file_of(loaded.roots[0])
    raise NoProgramError(f"`{file}` is not in order: see `rcsc check {file}`")


def prove_transition_systems(
    systems: Mapping[str, TransitionSystem],
    effort: Effort | None,
    jobs: int,
    only: tuple[str, ...],
    done: Callable[[LevelProof], None] | None = None,
    cache: Cache | None = None,
) -> SystemProof:
    """Prove these levels, except those in the cache; call `done` with each.

    Agreements are checked only if all levels are proved.
    """
    begun = time.perf_counter()
    proofs: dict[str, LevelProof] = {}
    for name, proof in _each_unless_kept(systems, effort or Effort(), jobs, only, cache):
        proofs[name] = proof
        if done is not None:
            done(proof)
    agreed = tuple(agreements(systems, proofs)) if set(proofs) == set(systems) else ()
    follows = closed(claims(systems, proofs))
    return SystemProof(tuple(proofs.values()), agreed, time.perf_counter() - begun, follows)


def _each_unless_kept(
    systems: Mapping[str, TransitionSystem],
    effort: Effort,
    jobs: int,
    only: tuple[str, ...],
    cache: Cache | None,
) -> Iterator[tuple[str, LevelProof]]:
    """Yield each level's proof, in order."""
    known = {name: recall(cache, systems[name], effort) for name in only} if cache is not None else {}
    new = _each(systems, effort, jobs, tuple(name for name in only if known.get(name) is None), cache)
    for name in only:
        kept = known.get(name)
        yield next(new) if kept is None else (name, kept)


def _each(
    systems: Mapping[str, TransitionSystem],
    effort: Effort,
    jobs: int,
    only: tuple[str, ...],
    cache: Cache | None,
) -> Iterator[tuple[str, LevelProof]]:
    """Yield each level's proof; several jobs prove in processes of their own, the largest levels first."""
    if jobs == 1 or len(only) <= 1:
        for name in only:
            yield name, _proved(systems[name], effort, cache)
        return
    with children.pool(min(jobs, len(only))) as pool:
        largest = sorted(only, key=lambda name: -lines_in(systems[name]))
        waiting = {name: pool.submit(_without_nodes, systems[name], effort, cache) for name in largest}
        for name in only:
            proof = children.answer(waiting[name])
            yield name, replace(proof, verdicts=_again(systems[name], proof))


def lines_in(ts: TransitionSystem) -> int:
    """Count the lines of the level's tables."""
    return sum(len(table.lines) for table in ts.program.tables)


def _proved(ts: TransitionSystem, effort: Effort, cache: Cache | None) -> LevelProof:
    """Prove a level, and keep the proof at once: another level may take long."""
    proof = prove_level(ts, effort, cache)
    if cache is not None:
        keep(cache, ts, effort, proof)
    return proof


def _without_nodes(ts: TransitionSystem, effort: Effort, cache: Cache | None) -> LevelProof:
    """Prove a level in a process of its own; return obligations without their many nodes, which are made anew."""
    proof = _proved(ts, effort, cache)
    return without_nodes(proof)


def _again(ts: TransitionSystem, proof: LevelProof) -> tuple[tuple[Obligation, Verdict], ...]:
    wanted = obligations(ts, ts.cycle(ts.havoc()))
    return tuple(
        (obligation, verdict) for obligation, (_, verdict) in zip(wanted, proof.verdicts, strict=True)
    )


# --- proofs that an earlier run made ---------------------------------------------------------
# The key is all that a proof depends on: the program as resolved, the level, its links, the effort; and rcsc itself with its solvers
# (`base.host.cache`). A proof with anything undecided is not kept: another run may decide it. The verdicts are kept once more, without
# effort and invariant (`standing`).


@dataclass(frozen=True, slots=True)
class _Kept:
    """A proof as it is kept: obligations by key, predicates by name; the transition system gives both anew."""

    verdicts: tuple[tuple[Key, Verdict], ...]
    predicates: tuple[str, ...]
    clauses: tuple[Clause, ...]
    walked: int
    learnt: int
    seconds: float
    context: Context | None
    endings: tuple[Ending, ...]
    unstated: tuple[Unstated, ...]
    stands: bool
    parts: "tuple[_Kept, ...]" = ()
    by: tuple[tuple[Key, str], ...] = ()
    conditions: tuple[Found, ...] = ()
    exact: bool = False
    bounds: "tuple[_KeptBound, ...]" = ()


@dataclass(frozen=True, slots=True)
class _KeptBound:
    """A bound as it is kept."""

    name: str
    within: Try
    admitting: bool
    proof: _Kept


def recall(cache: Cache, ts: TransitionSystem, effort: Effort) -> LevelProof | None:
    """Return the proof of the level, if it is kept."""
    kept = cache.load(_Kept, *_key(ts, effort))
    proof = None if kept is None else _whole(ts, kept)
    if proof is not None:
        keep_verdicts(cache, content(ts), _shortened(ts, proof))  # they may have been pruned
    return proof


def _whole(ts: TransitionSystem, kept: _Kept) -> LevelProof | None:
    """Return the proof with its parts: with refusals, where there are any, and without; and with its bounds."""
    if kept.parts:
        with_refusals, without = (
            _recalled(each, part) for each, part in zip((ts.refusing(), ts), kept.parts, strict=True)
        )
        proof = None if with_refusals is None or without is None else joined(with_refusals, without)
    else:
        proof = _recalled(ts.refusing(), kept)
    if proof is None:
        return None
    bounds = [bound for one in kept.bounds if (bound := _recalled_bound(ts, one)) is not None]
    return bounded_proof(ts, proof, tuple(bounds)) if len(bounds) == len(kept.bounds) else None


def _recalled_bound(ts: TransitionSystem, kept: _KeptBound) -> Bound | None:
    """Return a bound, if it is of the level as it is."""
    stated = waiting(ts).get(kept.name)
    if stated is None:
        return None
    bounded = bounded_by(ts if kept.admitting else ts.refusing(), stated, kept.within)
    proof = _recalled(bounded, kept.proof)
    return None if proof is None else Bound(kept.name, kept.within, kept.admitting, without_nodes(proof))


def _recalled(ts: TransitionSystem, kept: _Kept) -> LevelProof | None:
    """Return the proof of one environment, if it is of the level as it is."""
    cycle = ts.cycle(ts.havoc())
    wanted = obligations(ts, cycle)
    if [obligation.key for obligation in wanted] != [key for key, _ in kept.verdicts]:
        return None
    every = (every_predicate(ts, cycle, read(cycle, wanted), closely) for closely in range(CLOSELY + 1))
    said = tuple(predicate(found, ts.kinds) for found in kept.conditions)
    for begun in ((), *every):
        chosen = (*begun, *said)
        if tuple(predicate.name for predicate in chosen) == kept.predicates:
            verdicts = tuple(
                (goal, verdict) for goal, (_, verdict) in zip(wanted, kept.verdicts, strict=True)
            )
            return LevelProof(
                ts.level.name, verdicts, chosen, kept.clauses, kept.walked, kept.learnt, kept.seconds, cached=True,
                context=kept.context, endings=kept.endings, unstated=kept.unstated, stands=kept.stands,
                by=kept.by, conditions=kept.conditions, exact=kept.exact,
            )  # fmt: skip
    return None


def keep(cache: Cache, ts: TransitionSystem, effort: Effort, proof: LevelProof) -> None:
    """Keep the proof, unless something was left undecided."""
    if any(verdict is Verdict.UNDECIDED for part in (proof, *proof.parts) for _, verdict in part.verdicts):
        return
    cache.store(_kept(proof), *_key(ts, effort))
    keep_verdicts(cache, content(ts), _shortened(ts, proof))


def _kept(proof: LevelProof) -> _Kept:
    return _Kept(
        tuple((obligation.key, verdict) for obligation, verdict in proof.verdicts),
        tuple(predicate.name for predicate in proof.predicates), proof.clauses, proof.walked, proof.learnt, proof.seconds,
        proof.context, proof.endings, proof.unstated, proof.stands, tuple(map(_kept, proof.parts)),
        proof.by, proof.conditions, proof.exact,
        tuple(_KeptBound(bound.name, bound.within, bound.admitting, _kept(bound.proof)) for bound in proof.bounds),
    )  # fmt: skip


def _shortened(ts: TransitionSystem, proof: LevelProof) -> Verdicts:
    """Shorten the proof to its verdicts, without the invariant."""
    claims = dict(of_level(ts, proof))
    return Verdicts(
        claims,
        tuple(f"table `{owed.table}`: {owed.shown}" if owed.table else owed.shown for owed in proof.open),
        tuple(unstated.shown for unstated in proof.unstated if unstated.applies),
    )


def _key(ts: TransitionSystem, effort: Effort) -> tuple[str, ...]:
    return content(ts), hashlib.sha256(repr(effort).encode()).hexdigest()

"""One level proved in its environment.

In: a transition system (program, level, links). Out: a `LevelProof`: for each obligation whether it holds in every reachable cycle, and
the invariant that shows it. Reachable states are never listed: the invariant holds before the first cycle, every cycle keeps it whatever
the environment does within its contract, and every cycle that begins in it fulfils the obligations.
"""

import time
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from rcsc.base.host.cache import Cache
from rcsc.compose.contract.claims import ACCEPTED, Key
from rcsc.compose.contract.claims import Verdict as Verdict  # noqa: PLC0414  # it is the verdict of an obligation, too
from rcsc.compose.contract.obligations import (
    Obligation,
    Sort,
    Unstated,
    obligations,
    of_requirement,
    unstated,
)
from rcsc.compose.contract.predicates import CLOSELY, Predicate
from rcsc.compose.contract.properties import every_predicate
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.contract.watched import can_be_kept
from rcsc.compose.exact.portfolio import helped
from rcsc.compose.exact.said import Found
from rcsc.compose.invariant.confirm import Confirmation, answer
from rcsc.compose.invariant.pdr import Clause
from rcsc.compose.invariant.search import (
    LIMITS,
    Effort,
    FoundInvariant,
    begin,
    read,
    search,
    strengthened,
)
from rcsc.compose.proof.candidates import Candidates, candidates, content, keep_candidates
from rcsc.compose.proof.context import Context, context, never_asked, never_run
from rcsc.compose.proof.eventually import Try, bounded_by, may_be_listed, tries, waiting
from rcsc.compose.proof.termination import Ending, Flow, no_answers
from rcsc.lang.model import Property
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Limits
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import ExactIntegers, Keyed
from rcsc.proof.symbolic.values import TRUE

TOGETHER = 50
"""All questions about a level together may take the steps of so many; later ones are not decided."""
BOUND_WALKS = 4
"""Walks for one obligation alone."""
TRIES = (64, 64, 16, 16, 4, 1)
"""What part of its steps a question of the confirmation gets, try after try: what one search gives up another often refutes at once."""


class NotConfirmedError(Exception):
    """Z3 did not confirm the result of the search: nothing may rest on it."""


@dataclass(frozen=True, slots=True)
class LevelProof:
    """The proof of one level.

    Attributes:
        verdicts: Each obligation with its verdict.
        predicates: The predicates in the clauses.
        clauses: The invariant: cubes that never hold; empty if none was found.
        walked: States seen on walks; `learnt`, those that the solver added.
        seconds: Wall time of the search, for the report.
        cached: Whether an earlier run made it.
        context: Its lines in context; None if something is not proved.
        endings: Whether its commands end, table by table.
        unstated: Obligations that could not be stated, because part of the level was not recognised.
        stands: Whether its report stands once it has answered.
        parts: Where some claims need that no input is refused, the proofs with refusals and without; else none.
        by: How obligations were proved that the search over predicates leaves open, in words.
        conditions: Those that exact engines found, of which the last predicates are made.
        exact: Whether it is confirmed only of terms in which all arithmetic of integers is exact (`keyed.ExactIntegers`).
        bounds: For how long each requirement that may wait for ever does so at most, of those proved.
        together: What is proved of it together with other levels alone (`compose.together.left_open`): no certificate is of that.
    """

    level: str
    verdicts: tuple[tuple[Obligation, Verdict], ...]
    predicates: tuple[Predicate, ...]
    clauses: tuple[Clause, ...]
    walked: int
    learnt: int
    seconds: float = field(compare=False)
    cached: bool = field(default=False, compare=False)
    context: Context | None = None
    endings: tuple[Ending, ...] = ()
    unstated: tuple[Unstated, ...] = ()
    stands: bool = False
    parts: "tuple[LevelProof, ...]" = ()
    by: tuple[tuple[Key, str], ...] = ()
    conditions: tuple[Found, ...] = ()
    exact: bool = False
    bounds: "tuple[Bound, ...]" = ()
    together: "tuple[ProvedTogether, ...]" = ()

    def bound(self, key: Key) -> "Bound | None":
        """Return the bound by which a requirement that may wait for ever is proved; None for any other obligation."""
        return next((bound for bound in self.bounds if bound.key == key), None)

    def needs_admission(self, key: Key) -> bool:
        """Return whether an obligation is proved only if no input is refused."""
        if (bound := self.bound(key)) is not None and bound.admitting:
            return True
        here, refusing = (
            [verdict for owed, verdict in one.verdicts if owed.key == key]
            for one in (self, *(self.parts[:1] or (self,)))
        )
        return here != refusing and here[0] in ACCEPTED

    @property
    def stands_admitting(self) -> bool:
        """Whether the report stands only if no input is refused."""
        return bool(self.parts) and not self.parts[0].stands

    @property
    def looked_admitting(self) -> bool:
        """Whether lines in context were looked at only as if no input were refused."""
        return bool(self.parts) and self.parts[0].context is None

    def ends_admitting(self, ending: Ending) -> bool:
        """Return whether an ending is found only if no input is refused."""
        return bool(self.parts) and ending not in self.parts[0].endings

    def verdict(self, sort: Sort, table: str = "", name: str = "") -> Verdict:
        """Return the verdict of an obligation.

        Raises:
            KeyError: It is unknown.
        """
        for obligation, verdict in self.verdicts:
            if (obligation.sort, obligation.table, obligation.name) == (sort, table, name):
                return verdict
        raise KeyError(name)

    @property
    def open(self) -> tuple[Obligation, ...]:
        """The obligations that are not proved."""
        return tuple(obligation for obligation, verdict in self.verdicts if verdict not in ACCEPTED)


@dataclass(frozen=True, slots=True)
class ProvedTogether:
    """An obligation of a level that is proved of several together.

    Attributes:
        key: Its key.
        levels: Those that the proof is about.
        trusts: What it trusts, in words: when levels take what others give, that inputs are not refused.
    """

    key: Key
    levels: tuple[str, ...]
    trusts: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Bound:
    """A requirement that waits for no more than so many rounds in a row, proved.

    Attributes:
        name: The requirement's.
        within: The bound.
        admitting: Whether it is proved only if no input is refused.
        proof: The proof of that one obligation (`eventually.bounded_by`).
    """

    name: str
    within: Try
    admitting: bool
    proof: LevelProof

    @property
    def key(self) -> Key:
        """The key of the requirement."""
        return of_requirement(self.name)

    def level(self, ts: TransitionSystem) -> TransitionSystem:
        """Return the level that owes the requirement within the bound, and nothing else; inputs refused where it is proved so."""
        where = ts if self.admitting else ts.refusing()
        return bounded_by(where, waiting(ts)[self.name], self.within)

    @property
    def how(self) -> str:
        """How it was proved, in words."""
        return ", ".join((self.within.shown, *(by for _, by in self.proof.by)))


def prove_level(ts: TransitionSystem, effort: Effort | None = None, cache: Cache | None = None) -> LevelProof:
    """Prove a level whose inputs may be refused; prove the open obligations once more as if none were.

    A requirement that may wait for ever is proved only if it is proved besides that it does not.
    """
    effort = effort or Effort()
    proof = _in_each_cycle(ts, effort, cache)
    begun = time.perf_counter()
    wanted = (
        stated for name, stated in waiting(ts).items() if proof.verdict(*of_requirement(name)) in ACCEPTED
    )
    tried = {stated.name: _bound(ts, proof, stated, effort) for stated in wanted}
    bounds = tuple(bound for bound in tried.values() if isinstance(bound, Bound))
    undecided = frozenset(name for name, bound in tried.items() if bound is Verdict.UNDECIDED)
    proof = bounded_proof(ts, proof, bounds, undecided)
    return replace(proof, seconds=proof.seconds + time.perf_counter() - begun)


def bounded_proof(
    ts: TransitionSystem,
    proof: LevelProof,
    bounds: tuple[Bound, ...],
    undecided: Container[str] = (),
) -> LevelProof:
    """Return the proof with these bounds: requirements that may wait for ever, and have none, are not proved, or undecided."""
    names = {bound.name for bound in bounds}
    unbounded: dict[Key, Verdict] = {
        of_requirement(name): Verdict.UNDECIDED if name in undecided else Verdict.NOT_PROVED
        for name in waiting(ts)
        if name not in names
    }
    verdicts = tuple(
        (owed, unbounded.get(owed.key, verdict) if verdict in ACCEPTED else verdict)
        for owed, verdict in proof.verdicts
    )
    how = {bound.key: bound.how for bound in bounds}
    return replace(proof, verdicts=verdicts, bounds=bounds, by=tuple({**dict(proof.by), **how}.items()))


def _bound(ts: TransitionSystem, proof: LevelProof, stated: Property, effort: Effort) -> Bound | Verdict:
    """Prove a bound for a requirement: with refusals, if it is proved with these in each cycle; else without. Return why there is none."""
    wanted, refusing, why = list(tries(ts, stated)), ts.refusing(), Verdict.NOT_PROVED
    every = [(ts, within) for within in wanted]
    if refusing.refuses and wanted and not proof.needs_admission(of_requirement(stated.name)):
        # what a refused cycle asks for may take longer
        longer = replace(wanted[-1], most=2 * wanted[-1].most + 1, exact=False)
        every = [*((refusing, within) for within in (*wanted, longer)), *every]
    for where, within in every:
        shown = proved_bound(where, stated, within, effort)
        if not shown.open:
            admitting = refusing.refuses and not where.refuses
            return Bound(stated.name, within, admitting, without_nodes(shown))
        if any(verdict is Verdict.UNDECIDED for _, verdict in shown.verdicts):
            why = Verdict.UNDECIDED
    return why


def proved_bound(ts: TransitionSystem, stated: Property, within: Try, effort: Effort) -> LevelProof:
    """Prove that a requirement is kept within a bound: of listed states at once, else with a search for an invariant."""
    bounded = bounded_by(ts, stated, within)
    effort = replace(effort, walks=min(effort.walks, BOUND_WALKS), looks=False)
    if within.exact and may_be_listed(bounded):
        listed = _proved(bounded, effort, None, FoundInvariant(), Candidates(), searches=False)
        if not listed.open:
            return listed
    return _proved(bounded, effort, None, begin(bounded, (), effort), Candidates())


def _in_each_cycle(ts: TransitionSystem, effort: Effort, cache: Cache | None) -> LevelProof:
    """Prove what a cycle can break.

    An invariant with refusals is one without: the second search begins with the first one's.
    """
    refusing = ts.refusing()
    if not refusing.refuses:
        return _proved_of(ts, effort, cache, begin(ts, (), effort))
    walked = begin(ts, (), effort)  # of cycles that take their inputs: the same in both
    first = _proved_of(refusing, effort, cache, walked)
    looked = first.context is not None and all(ending.proved for ending in first.endings)
    stands = first.stands or ts.links.above is None
    if not first.open and ((looked and stands) or not effort.looks):
        return first
    begun = FoundInvariant(first.predicates, first.clauses).named
    without = replace(effort, looks=effort.looks and not looked)
    known = Candidates(begun, content(ts))
    return joined(
        first, _proved(ts, without, None, walked, known, _Refusing(first, stands=stands or not effort.looks))
    )


def prove_again(ts: TransitionSystem, known: LevelProof, effort: Effort) -> LevelProof:
    """Prove a level in its one environment, of which another version is proved: its clauses are the first that the search tries.

    Args:
        ts: The level, refusing inputs or not as that version does.
        known: The proof of that version.
        effort: For the search.
    """
    begun = Candidates(FoundInvariant(known.predicates, known.clauses).named, content(ts))
    return _proved(ts, effort, None, begin(ts, (), effort), begun)


@dataclass(frozen=True, slots=True)
class _Refusing:
    """The proof of a level whose inputs may be refused: what it has shown need not be shown again where none is.

    Every cycle without refusals is one with them, and so is every beginning; so what is an invariant there, confirmed, is one here.

    Attributes:
        stands: Whether nothing is left to be shown of its report.
    """

    proof: LevelProof
    stands: bool

    @property
    def proved(self) -> Mapping[Key, Verdict]:
        """The verdicts that stay."""
        return {owed.key: verdict for owed, verdict in self.proof.verdicts if verdict in ACCEPTED}


def joined(refusing: LevelProof, admitting: LevelProof) -> LevelProof:
    """Return the proof of a level of which some claims need that no input is refused (`LevelProof.parts`)."""
    proved = {obligation.key: verdict for obligation, verdict in refusing.verdicts if verdict in ACCEPTED}
    verdicts = tuple((owed, proved.get(owed.key, verdict)) for owed, verdict in admitting.verdicts)
    others = {ending.table: ending for ending in admitting.endings}
    endings = tuple(e if e.proved else others.get(e.table, e) for e in refusing.endings) or admitting.endings
    return replace(
        admitting,
        verdicts=verdicts,
        seconds=refusing.seconds + admitting.seconds,
        context=refusing.context or admitting.context,
        endings=endings,
        stands=refusing.stands or admitting.stands,
        parts=(without_nodes(refusing), without_nodes(admitting)),
        by=tuple({**dict(admitting.by), **dict(refusing.by)}.items()),
    )


def without_nodes(proof: LevelProof) -> LevelProof:
    """Return the proof with obligations whose many nodes are left out."""
    verdicts = tuple((replace(obligation, holds=TRUE), verdict) for obligation, verdict in proof.verdicts)
    return replace(proof, verdicts=verdicts)


def _proved_of(
    ts: TransitionSystem, effort: Effort, cache: Cache | None, walked: FoundInvariant
) -> LevelProof:
    """Prove a level in one environment: find an invariant, confirm it, decide each obligation, analyse the lines in context.

    The search begins with the clauses that the last one left in the cache. Lines and endings may depend on which invariant it finds: where
    more is missing of them than in the version of the level that the clauses were found of, all is proved once more without those.
    """
    this, begun = content(ts), candidates(cache, ts)
    proof = _proved(ts, effort, cache, walked, begun)
    if begun.found_of != this and not set(_lacking(proof)) <= set(begun.lacking):
        proof = _proved(ts, effort, cache, walked, Candidates(found_of=this))
    found = FoundInvariant(proof.predicates, proof.clauses)
    keep_candidates(cache, ts, found, Candidates(found_of=this, lacking=_lacking(proof)))
    return proof


def _lacking(proof: LevelProof) -> tuple[str, ...]:
    """Name the lines and endings that are not shown, and the obligations that are undecided."""
    seen = proof.context
    return (
        *(f"undecided {owed.key}" for owed, verdict in proof.verdicts if verdict is Verdict.UNDECIDED),
        *(f"ending {ending.table}" for ending in proof.endings if not ending.proved),
        *(
            f"again {line.table} {line.line} {leaf}"
            for line in (seen.repeated if seen else ())
            for leaf in line.leaves
        ),
        *(("restless",) if seen is not None and seen.restless else ()),
    )


def _proved(
    ts: TransitionSystem,
    effort: Effort,
    cache: Cache | None,
    walked: FoundInvariant,
    known: Candidates,
    refusing: _Refusing | None = None,
    *,
    searches: bool = True,
) -> LevelProof:
    """Prove a level in one environment; without a search over predicates exact engines do what they can."""
    begun, cut_before = time.perf_counter(), smt.cut_short()
    cycle, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
    wanted = obligations(ts, cycle)
    with smt.together(TOGETHER * effort.limits.steps):
        try:
            before = None if refusing is None else _begun(ts, cycle, wanted, refusing)
            from_here = before or FoundInvariant(open=frozenset(range(len(wanted))))
            from_here = replace(from_here, states=walked.states, ran=walked.ran, columns=walked.columns)
            found = (
                search(ts, firsts, cycle, wanted, effort, known.clauses, from_here) if searches else from_here
            )
            keep_candidates(cache, ts, found, known)
            posed = _Posed(
                ts, firsts, cycle, wanted, effort, refusing, () if before is None else before.clauses
            )
            concluded = _concluded(posed, found)
            _uncut(cut_before)
        except (GaveUpError, NotConfirmedError):
            undecided = tuple((obligation, Verdict.UNDECIDED) for obligation in wanted)
            concluded = _Concluded(FoundInvariant(), undecided)
    keep_candidates(cache, ts, concluded.invariant, known)
    return LevelProof(
        ts.level.name,
        concluded.verdicts,
        concluded.invariant.predicates,
        concluded.invariant.clauses,
        concluded.invariant.walked,
        concluded.invariant.learnt,
        time.perf_counter() - begun,
        context=concluded.seen,
        endings=concluded.endings,
        unstated=(
            *unstated(ts),
            *(Unstated(Sort.ENDS, "", why) for why in no_answers(ts)),
        ),
        stands=concluded.stands,
        by=concluded.by,
        conditions=concluded.conditions,
        exact=concluded.exact,
    )


@dataclass(frozen=True, slots=True)
class _Concluded:
    """What follows from an invariant that is confirmed; the parts are those of `LevelProof`."""

    invariant: FoundInvariant
    verdicts: tuple[tuple[Obligation, Verdict], ...]
    seen: Context | None = None
    endings: tuple[Ending, ...] = ()
    stands: bool = False
    by: tuple[tuple[Key, str], ...] = ()
    conditions: tuple[Found, ...] = ()
    exact: bool = False


@dataclass(frozen=True, slots=True)
class _Posed:
    """What is to be shown of a level, in one environment.

    Attributes:
        refusing: What was shown where inputs may be refused, if that is the other environment.
        known: The clauses that are an invariant, confirmed, by that.
    """

    ts: TransitionSystem
    firsts: tuple[Cycle, ...]
    cycle: Cycle
    wanted: tuple[Obligation, ...]
    effort: Effort
    refusing: _Refusing | None = None
    known: tuple[Clause, ...] = ()


def _begun(
    ts: TransitionSystem, cycle: Cycle, wanted: tuple[Obligation, ...], refusing: _Refusing
) -> FoundInvariant | None:
    """Return the invariant that was confirmed of the other environment, with what it leaves open.

    None if it speaks of other leaves, or of what exact engines found: then all is searched for once more, which the clauses shorten.
    """
    proof = refusing.proof
    names = [predicate.name for predicate in proof.predicates]
    reads = read(cycle, wanted)
    chosen = (every_predicate(ts, cycle, reads, closely) for closely in range(CLOSELY + 1))
    if not any([predicate.name for predicate in every] == names for every in chosen):
        return None
    left = frozenset(at for at, owed in enumerate(wanted) if owed.key not in refusing.proved)
    return FoundInvariant(proof.predicates, proof.clauses, left, proof.walked, proof.learnt)


def _concluded(posed: _Posed, found: FoundInvariant) -> _Concluded:
    """Conclude from the invariant that the exact engines make stronger; from what was found before, where that is not confirmed.

    Raises:
        GaveUpError: The solver did.
        NotConfirmedError: Nothing is confirmed.
    """
    more = helped(posed.ts, posed.firsts, posed.cycle, posed.wanted, found)
    for exact in (False, True) if more.by else ():
        try:
            concluded = _confirmed_of(posed, more.invariant, exact=exact)
        except NotConfirmedError:
            continue
        if all(verdict in ACCEPTED for owed, verdict in concluded.verdicts if owed.key in more.by):
            return replace(concluded, by=tuple(more.by.items()), conditions=tuple(more.conditions))
    return _confirmed_of(posed, found)


def _confirmed_of(posed: _Posed, invariant: FoundInvariant, *, exact: bool = False) -> _Concluded:
    """Have an invariant confirmed, decide each obligation, and analyse the lines in context.

    Raises:
        GaveUpError: The solver did.
        NotConfirmedError: It is no invariant.
    """
    ts, wanted, refusing = posed.ts, posed.wanted, posed.refusing
    asked = _asked_anew(invariant.predicates, posed.firsts, posed.cycle, posed.effort.limits, exact=exact)
    # no line in context and no ending goes by these
    aside = {Sort.NUMBERED, Sort.DONE_STAYS, Sort.FAILED_STAYS, Sort.PROPERTY, Sort.REQUIREMENT}
    may_look = not any(wanted[at].sort not in aside for at in invariant.open)
    looks, stands = posed.effort.looks and may_look, refusing is not None and not refusing.stands and may_look
    flow = Flow(ts, asked, invariant.clauses)
    others = flow.wanted_to_stand() if looks or stands else []
    if looks:
        lines = never_run(asked, invariant.clauses, invariant.ran)
        idle = never_asked(ts, asked, invariant.clauses, invariant.states)
        others = [*flow.no_loop_steps(), *others, *lines, *idle]
    if others:
        found = invariant.clauses
        invariant = strengthened(ts, posed.firsts, posed.cycle, invariant, others)
        if invariant.clauses != found:
            flow = Flow(ts, asked, invariant.clauses, flow)
    _confirm(asked, invariant.clauses, frozenset(posed.known))
    verdicts = tuple(_verdicts(ts, asked, invariant, wanted, {} if refusing is None else refusing.proved))
    if not looks:
        return _Concluded(invariant, verdicts, stands=stands and flow.report_stands(), exact=exact)
    seen, endings = context(ts, asked, invariant.clauses, invariant.ran), tuple(flow.endings())
    return _Concluded(invariant, verdicts, seen, endings, flow.report_stands(), exact=exact)


def _uncut(before: int) -> None:
    """Reject a result that processor time cut short: another machine might find something else.

    Raises:
        GaveUpError: Processor time cut a question short.
    """
    if smt.cut_short() > before:
        raise GaveUpError


def _asked_anew(
    predicates: tuple[Predicate, ...],
    firsts: tuple[Cycle, ...],
    cycle: Cycle,
    limits: Limits,
    *,
    exact: bool = False,
) -> Confirmation:
    return Confirmation(predicates, firsts, cycle, cycle.cases, ExactIntegers() if exact else Keyed(), limits)


def _confirm(asked: Confirmation, clauses: Sequence[Clause], known: Container[Clause] = ()) -> None:
    """Ask another solver whether the clauses are an invariant, given that the `known` ones are: the search is not trusted.

    Raises:
        NotConfirmedError: They are not, or the solver gave up.
    """
    fresh = [clause for clause in clauses if clause not in known]
    if not fresh and clauses:
        return
    left = [
        *(partial(asked.first_question, fresh, first) for first in asked.firsts),
        *(partial(asked.step_question, clauses, case, fresh) for case in asked.cases),
    ]
    for seed, part in enumerate(TRIES):
        left = [make for make in left if not _confirmed(make(), asked.limits.steps // part, seed)]
    if left:
        raise NotConfirmedError


def confirm_owed(
    found: FoundInvariant,
    firsts: tuple[Cycle, ...],
    cycle: Cycle,
    owed: Sequence[Sequence[Obligation]],
    limits: Limits,
    *,
    known: Container[Clause] = (),
    exact: bool = False,
) -> None:
    """Have an invariant confirmed, and that no cycle breaks an obligation: of the first cycles each, then of a later one.

    The `known` clauses are an invariant already.

    Raises:
        NotConfirmedError: It is no invariant, some cycle breaks one, or the solver gave up.
    """
    asked = _asked_anew(found.predicates, firsts, cycle, limits, exact=exact)
    _confirm(asked, found.clauses, known)
    solvers = [*(asked.beginning(first) for first in firsts), asked.known(found.clauses)]
    for solver, every in zip(solvers, owed, strict=True):
        broken = smt.any_of([asked.keyed.term(values.negation(one.holds)) for one in every])
        solver.add(*asked.keyed.ranges)
        if answer(solver, broken) is not Answer.UNSATISFIABLE:
            raise NotConfirmedError


def _confirmed(question: Solver, steps: int, seed: int) -> bool:
    """Return whether Z3 refutes a question, in one search; false where it gives up.

    Raises:
        NotConfirmedError: It answers it.
    """
    question.begins_anew(steps, seed)
    answer = question.check()
    if answer is Answer.SATISFIABLE:
        raise NotConfirmedError
    return answer is Answer.UNSATISFIABLE


def _verdicts(
    ts: TransitionSystem,
    inference: Confirmation,
    invariant: FoundInvariant,
    wanted: tuple[Obligation, ...],
    shown: Mapping[Key, Verdict],
) -> Iterable[tuple[Obligation, Verdict]]:
    """Decide each obligation that is not shown already: can a first cycle, or a cycle from the invariant, break it?"""
    keyed = inference.keyed
    every = [wanted, *(obligations(ts, first) for first in inference.firsts)]
    asked = [
        [keyed.term(values.negation(owed.holds if owed.key not in shown else TRUE)) for owed in each]
        for each in every
    ]
    solvers = [
        inference.known(invariant.clauses),
        *(inference.beginning(first) for first in inference.firsts),
    ]
    believed = _believed(ts, inference, invariant.clauses, solvers)
    kept_at_first = _kept_at_first(ts, inference)
    for at, obligation in enumerate(wanted):
        if obligation.key in shown:
            yield obligation, shown[obligation.key]
            continue
        if at in invariant.open:
            yield obligation, Verdict.NOT_PROVED
            continue
        answers = {answer(solver, terms[at]) for solver, terms in zip(solvers, asked, strict=True)}
        if obligation.sort is Sort.KEPT:
            answers |= {each.check() for each in kept_at_first.values()}
        if answers == {Answer.UNSATISFIABLE}:
            trusted = obligation.sort is Sort.ASSUMPTION and obligation.name in ts.trusted
            yield obligation, believed[obligation.table] if trusted else Verdict.PROVED
        else:
            yield obligation, Verdict.NOT_PROVED if Answer.SATISFIABLE in answers else Verdict.UNDECIDED


def _kept_at_first(ts: TransitionSystem, inference: Confirmation) -> dict[str, Solver]:
    """Ask whether a level can begin where nothing keeps what is assumed over time: no cycle would follow, and all be proved of none."""
    questions = {}
    for at, first in enumerate(inference.firsts if ts.program.environment else ()):
        broken = [
            inference.keyed.term(values.negation(can)) for _, can in can_be_kept(ts.program, first.before)
        ]
        solver = Solver(inference.limits)
        solver.add(*inference.keyed.ranges, smt.any_of(broken))
        questions[f"kept at {'restart' if at else 'first'}"] = solver
    return questions


def _believed(
    ts: TransitionSystem, inference: Confirmation, clauses: Sequence[Clause], solvers: Sequence[Solver]
) -> dict[str, Verdict]:
    """Return the verdict on each table's declared assumptions: nothing may rest on ones that no cycle can fulfil.

    They fail if no later cycle, no first one, or none after a restart can fulfil them, or none of these can be followed by a cycle
    that does; for one table, if no cycle that runs it can, although one would run it without them.
    """
    names = [str(at.table.name) for at in inference.cycle.every]
    if not ts.trusted:
        return dict.fromkeys(names, Verdict.TRUSTED)
    cycles = inference.cycle, *inference.firsts
    taken = [inference.keyed.term(values.negation(each.untaken)) for each in cycles]
    answers = {answer(solver, term) for solver, term in zip(solvers, taken, strict=True)}
    answers |= {_followed(ts, inference, clauses, each) for each in cycles}
    whole = _of_possible(answers)
    if whole is not Verdict.TRUSTED:
        return dict.fromkeys(names, whole)
    return {name: _can_run(inference, clauses, solvers, at) for at, name in enumerate(names)}


def _followed(
    ts: TransitionSystem, inference: Confirmation, clauses: Sequence[Clause], cycle: Cycle
) -> Answer:
    """Ask whether another cycle can follow this one; both take their inputs."""
    then = ts.cycle(cycle.after, " then")
    refused = values.either(cycle.untaken, then.untaken)
    both = inference.keyed.term(values.both(then.contract, values.negation(refused)))
    later = cycle is inference.cycle
    return answer(inference.known(clauses) if later else inference.beginning(cycle), both)


def _of_possible(answers: set[Answer]) -> Verdict:
    """Turn answers on whether all cycles are possible into a verdict on declared assumptions."""
    if Answer.UNSATISFIABLE in answers:
        return Verdict.NOT_PROVED
    return Verdict.UNDECIDED if Answer.UNKNOWN in answers else Verdict.TRUSTED


def _can_run(
    inference: Confirmation, clauses: Sequence[Clause], solvers: Sequence[Solver], at: int
) -> Verdict:
    """Decide whether a table can run under its declared assumptions, if it can without them."""
    chosen = [inference.keyed.term(each.every[at].chosen) for each in (inference.cycle, *inference.firsts)]
    answers = {answer(solver, term) for solver, term in zip(solvers, chosen, strict=True)}
    if Answer.SATISFIABLE in answers:
        return Verdict.TRUSTED
    if Answer.UNKNOWN in answers:
        return Verdict.UNDECIDED
    cycle, *firsts = (
        replace(each, contract=each.undeclared) for each in (inference.cycle, *inference.firsts)
    )
    free = replace(inference, cycle=cycle)
    others = [free.known(clauses), *(free.beginning(first) for first in firsts)]
    without = {answer(solver, term) for solver, term in zip(others, chosen, strict=True)}
    if Answer.SATISFIABLE in without:
        return Verdict.NOT_PROVED
    return _of_possible(without - {Answer.UNSATISFIABLE})


def certificate(ts: TransitionSystem, proof: LevelProof, limits: Limits = LIMITS) -> dict[str, str]:
    """Write questions in SMT-LIB, each to be answered `unsat`, that together show what was proved.

    `first` and `restart`: such a cycle leads into the invariant; `step TABLE`: a later cycle in which this table runs keeps
    it; `goals first`, `goals restart`: such cycles fulfil the obligations that are proved; `goals SORT`: every cycle from the
    invariant fulfils those of one sort; `lines N`: the lines in their context; `ends TABLE N`: no step is taken that was not
    found, counters rise, and there is no other loop; `stands N`: the report stands once it has answered. What needs that no
    input is refused has questions of its own, `nothing refused ...`; so has for how long a requirement waits, `requirement NAME ...`.
    If lines or endings, asked again, differ from the proof, one question has a model.
    """
    if proof.parts:
        refusing, admitting = proof.parts
        aside = {obligation.key for obligation, verdict in refusing.verdicts if verdict in ACCEPTED}
        left = tuple((owed, verdict) for owed, verdict in admitting.verdicts if owed.key not in aside)
        scripts = _certificate(ts.refusing(), refusing, limits)
        others = _certificate(ts, replace(admitting, verdicts=left), limits)
        scripts |= {f"nothing refused {name}": text for name, text in others.items()}
    else:
        scripts = _certificate(ts.refusing(), proof, limits)
    for bound in proof.bounds:
        others = _certificate(bound.level(ts), bound.proof, limits)
        scripts |= {f"requirement {bound.name} {name}": text for name, text in others.items()}
    return scripts


def _certificate(ts: TransitionSystem, proof: LevelProof, limits: Limits) -> dict[str, str]:
    """Write the questions of one environment."""
    cycle, firsts = ts.cycle(ts.havoc()), ts.firsts()
    asked = _asked_anew(proof.predicates, tuple(firsts.values()), cycle, limits, exact=proof.exact)
    clauses = proof.clauses
    scripts = {name: asked.first_question(clauses, first).script() for name, first in firsts.items()}
    names = [*(f"step {at.table.name}" for at in cycle.tables), "step of no table"]
    for name, case in zip(names, cycle.cases, strict=False):
        scripts[name] = asked.step_question(clauses, case).script()
    proved = {obligation.key for obligation, verdict in proof.verdicts if verdict in ACCEPTED}
    for name, first in firsts.items():
        wanted = [obligation for obligation in obligations(ts, first) if obligation.key in proved]
        scripts[f"goals {name}"] = _none_broken(asked, asked.beginning(first), wanted)
    if any(sort is Sort.KEPT for sort, _, _ in proved):
        scripts |= {name: each.script() for name, each in _kept_at_first(ts, asked).items()}
    every = [obligation for obligation in obligations(ts, cycle) if obligation.key in proved]
    for sort in dict.fromkeys(obligation.sort for obligation in every):
        wanted = [obligation for obligation in every if obligation.sort is sort]
        scripts[f"goals {sort.name.lower()}"] = _none_broken(asked, asked.known(clauses), wanted)
    if proof.context is not None:
        scripts |= _looked_again(ts, proof, asked)
    elif proof.stands:
        scripts |= _stands_again(Flow(ts, asked, proof.clauses), asked, stands=True)
    return scripts


def _looked_again(ts: TransitionSystem, proof: LevelProof, asked: Confirmation) -> dict[str, str]:
    """Write the questions that `context` and `Flow.endings` rest on."""
    assert proof.context is not None
    seen = replace(context(ts, asked, proof.clauses), unsure=proof.context.unsure)
    scripts = {f"lines {number}": text for number, text in enumerate(_refuted(asked), 1)}
    ends, flow = [], Flow(ts, asked, proof.clauses)
    for ending in flow.endings():
        ends.append(ending)
        scripts |= {f"ends {ending.table} {number}": text for number, text in enumerate(_refuted(asked), 1)}
    scripts |= _stands_again(flow, asked, stands=proof.stands)
    if (seen, tuple(ends)) != (proof.context, proof.endings):
        scripts[_AS_BEFORE] = _HAS_A_MODEL
    return scripts


_AS_BEFORE, _HAS_A_MODEL = "lines and endings as before", "(set-logic ALL)\n(check-sat)\n"


def _stands_again(flow: Flow, asked: Confirmation, *, stands: bool) -> dict[str, str]:
    """Write the questions that `Flow.report_stands` rests on."""
    again = flow.report_stands()
    scripts = {f"stands {number}": text for number, text in enumerate(_refuted(asked), 1)}
    return scripts if again == stands else {**scripts, _AS_BEFORE: _HAS_A_MODEL}


def _refuted(asked: Confirmation) -> list[str]:
    """Take the scripts of the refutations since the last call, one for each solver."""
    scripts = [solver.refutations() for solver in asked.rested_on if solver.refuted]
    asked.rested_on.clear()
    return scripts


def _none_broken(asked: Confirmation, solver: Solver, wanted: Sequence[Obligation]) -> str:
    bad = smt.any_of([asked.keyed.term(values.negation(obligation.holds)) for obligation in wanted])
    solver.add(*asked.keyed.ranges, bad)
    return solver.script()

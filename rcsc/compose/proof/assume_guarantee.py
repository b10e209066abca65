"""What the levels of a system assume of each other, matched with what was proved of them.

In: transition systems of all levels. Out: `Promise`s, each with the obligations of the neighbour that keep it, and, for proofs, whether
they do. Source: Misra and Chandy, "Proofs of networks of processes", 1981; the induction over cycles is in `compose.__doc__`.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from rcsc.compose.contract.claims import (
    ACCEPTED,
    AGAIN,
    CONTRACT,
    DECLARED,
    ENDING,
    GIVEN,
    IN_RANGE,
    NEVER_REFUSED,
    NOT_FOR_EVER,
    RESTING,
    RUNS,
    SAFE,
    STANDS,
    UNREACHED,
    Claim,
    Key,
    Need,
    Promise,
    Verdict,
    worst,
)
from rcsc.compose.contract.obligations import Obligation, Sort, asks, resting_table
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.proof.level import Bound, LevelProof
from rcsc.compose.proof.termination import Ending
from rcsc.lang.leaves import root_of
from rcsc.lang.restart import COMMAND, ECHO, ECHOED, NUMBER, NUMBERS
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.execution import Run


def agreements(systems: Mapping[str, TransitionSystem], proofs: Mapping[str, LevelProof]) -> list[Promise]:
    """Match each level's assumptions about each neighbour with the claims proved there (`Promise.holds`)."""
    proved = {
        (name, obligation.key)
        for name, proof in proofs.items()
        for obligation, verdict in proof.verdicts
        if verdict in ACCEPTED
    }
    return [
        replace(promise, holds=promise.begins and proved.issuperset(promise.needs))
        for promise in promises(systems)
    ]


# --- claims --------------------------------------------------------------------------------


def claims(systems: Mapping[str, TransitionSystem], proofs: Mapping[str, LevelProof]) -> dict[Need, Claim]:
    """Return all claims about these levels, with what each rests on."""
    claimed = dict(promise.claim for promise in promises(systems))
    for name, proof in proofs.items():
        claimed |= {(name, key): claim for key, claim in of_level(systems[name], proof)}
    return claimed


def of_level(ts: TransitionSystem, proof: LevelProof) -> Iterator[tuple[Key, Claim]]:
    """List the claims about one level, apart from the contract."""
    name = proof.level
    runs = ((name, RUNS),)
    yield from _of_runs(ts, proof)
    together = {one.key: one for one in proof.together}
    for obligation, verdict in proof.verdicts:
        if (shown := together.get(obligation.key)) is not None:
            yield (
                obligation.key,
                Claim(verdict, tuple((level, RUNS) for level in shown.levels), shown.trusts),
            )
        elif (bound := proof.bound(obligation.key)) is not None:
            yield obligation.key, _of_bound(ts, proof, bound)
        elif obligation.key != SAFE:
            yield obligation.key, Claim(verdict, runs, _trusted(ts, proof, obligation))
    if proof.context is not None:
        trusts = admitted(ts) if proof.looked_admitting else ()
        for line in proof.context.unreached:
            yield (UNREACHED, *line), Claim(Verdict.PROVED, runs, trusts)
        if not proof.context.repeated and not proof.context.restless:
            yield (AGAIN, "", ""), Claim(Verdict.PROVED, runs, trusts)
    for ending in proof.endings:
        yield (Sort.ENDS, ending.table, ""), _of_ending(ts, ending, admitting=proof.ends_admitting(ending))
    if proof.stands and ts.links.above is not None:
        trusts = admitted(ts) if proof.stands_admitting else ()
        yield STANDS, Claim(Verdict.PROVED, (*runs, (name, (Sort.ECHOES, "", ts.links.above.report))), trusts)
    if proof.endings:
        every = tuple((name, (Sort.ENDS, ending.table, "")) for ending in proof.endings)
        yield ENDING, Claim(Verdict.PROVED, every)
        yield RESTING, Claim(Verdict.PROVED, ((name, (Sort.ENDS, resting_table(ts), "")),))


def _trusted(ts: TransitionSystem, proof: LevelProof, obligation: Obligation) -> tuple[str, ...]:
    """Return the trusted assumptions of an obligation for which no level is responsible."""
    return admitted(ts) if proof.needs_admission(obligation.key) else ()


def admitted(ts: TransitionSystem) -> tuple[str, ...]:
    """Return the assumptions about admission that a claim needs: some inputs are never refused, or never outside their ranges."""
    said = (_said(ts, ts.refusable, NEVER_REFUSED), _said(ts, ts.clamped, IN_RANGE))
    return tuple(trust for trust in said if trust)


def not_for_ever(ts: TransitionSystem) -> str:
    """Return the assumption that no input is refused for ever: cycles without inputs only put off such a claim."""
    return _said(ts, ts.refusable, NOT_FOR_EVER)


def _said(ts: TransitionSystem, inputs: Iterable[str], ends: str) -> str:
    """Spell an assumption about inputs; a record or an array with several of them is named once. Return "" for none."""
    parts: dict[str, list[str]] = {}
    for leaf in inputs:
        parts.setdefault(root_of(leaf), []).append(leaf)
    names = [f"`{leaves[0] if len(leaves) == 1 else whole}`" for whole, leaves in parts.items()]
    verb = "is" if len(names) == 1 else "are"
    return f"{', '.join(names)} of level `{ts.level.name}` {verb} {ends}" if names else ""


def _of_runs(ts: TransitionSystem, proof: LevelProof) -> Iterator[tuple[Key, Claim]]:
    """Claim that the level runs as its tables say in an environment that keeps to the contract, and that its operations are safe."""
    name, links = proof.level, ts.links
    ends = [*([] if links.above is None else [links.above.order]), *(below.report for below in links.below)]
    needs: list[Key] = [SAFE, *((CONTRACT, "", record) for record in ends)]
    needs += [(GIVEN, "", fact.name) for fact in links.given]
    needs += [
        obligation.key
        for obligation, _ in proof.verdicts
        if obligation.sort in {Sort.SOME_LINE, Sort.ONE_LINE}
    ]
    needs += [
        obligation.key
        for obligation, _ in proof.verdicts
        if obligation.sort is Sort.ASSUMPTION and obligation.name in ts.trusted
    ]
    needs += [obligation.key for obligation, _ in proof.verdicts if obligation.sort is Sort.KEPT]
    declared = sorted({*ts.trusted, *(stated.name for stated in ts.program.environment)})
    trusts = [f"assumption `{assumption}` of level `{name}`{DECLARED}" for assumption in declared]
    if ts.trusted:
        trusts.append(f"level `{name}` can be as its tables declare in every state that it comes to")
    trusts += [
        f"the same question has the same answer in `{asked.into}` of level `{name}`" for asked in links.asked
    ]
    yield RUNS, Claim(Verdict.PROVED, tuple((name, key) for key in needs), tuple(trusts))
    within = [verdict for obligation, verdict in proof.verdicts if obligation.key == SAFE]
    invariants = tuple((name, (Sort.INVARIANT, "", invariant)) for invariant in ts.safety.invariants)
    rests = ((name, RUNS), *invariants) if within else invariants
    yield SAFE, Claim(worst(within), rests, admitted(ts) if proof.needs_admission(SAFE) else ())


def _of_ending(ts: TransitionSystem, ending: Ending, *, admitting: bool) -> Claim:
    """Claim that a command ends, assuming that subordinates answer theirs and that some inputs stand still."""
    verdict = Verdict.PROVED if ending.proved else Verdict.NOT_PROVED
    name, below = ts.level.name, ts.links.below
    trusts = [
        f"`{other.name}` comes to rest some time where it is told to, and stays so"
        if other.answers_in_time
        else _ANSWERS.format(other.name)
        for other in below
        if other.outside
    ]
    trusts += [f"the values in `{record}` of level `{name}` stand still meanwhile" for record in ending.still]
    trusts += _goes_on(ts, admitting=admitting)
    needs = tuple(
        (other.name, RESTING if other.answers_in_time else ENDING) for other in below if not other.outside
    )
    stand = tuple((other.name, STANDS) for other in below if other.report in ending.settled)
    return Claim(verdict, ((name, RUNS), *needs, *stand), tuple(trusts))


_ANSWERS = "`{}` answers every order that is not replaced, and stays so"


def _goes_on(ts: TransitionSystem, *, admitting: bool) -> Iterator[str]:
    """Yield the assumptions about refusals of a claim that something comes: none is for ever, or none is at all."""
    if asks(ts.program):
        yield f"extern procedures of level `{ts.level.name}` are {NOT_FOR_EVER}"
    if admitting:
        yield from admitted(ts)
    elif ts.refusable:
        yield not_for_ever(ts)


def _of_bound(ts: TransitionSystem, proof: LevelProof, bound: Bound) -> Claim:
    """Claim that a requirement never waits for ever: where a round is one of orders and answers, assuming that these come."""
    name, below = ts.level.name, ts.links.below if bound.within.fair else ()
    asked = [other for other in below if not other.answers_in_time]
    trusts = [_ANSWERS.format(other.name) for other in asked if other.outside]
    needs = ((other.name, ENDING) for other in asked if not other.outside)
    admitting = bound.admitting or proof.needs_admission(bound.key)
    return Claim(Verdict.PROVED, ((name, RUNS), *needs), (*trusts, *_goes_on(ts, admitting=admitting)))


# --- what levels assume of each other ------------------------------------------------------


def promises(systems: Mapping[str, TransitionSystem]) -> Iterator[Promise]:
    """Yield each level's assumptions about each neighbour."""
    for name, ts in systems.items():
        yield from _of_above(name, ts, systems)
        yield from _of_below(name, ts, systems)
        yield from _of_facts(name, ts)


def _of_below(name: str, ts: TransitionSystem, systems: Mapping[str, TransitionSystem]) -> Iterator[Promise]:
    for below in ts.links.below:
        words = f"what `{below.name}` reports under the number of the last order is about that order"
        keys: tuple[Key, ...] = (
            (Sort.NUMBERED, "", below.command),
            (Sort.NEXT_NUMBER, "", below.order),
        )
        own = tuple((name, key) for key in keys)
        if below.outside:
            reason = f"`{below.name}` stands outside the levels"
            yield Promise(name, below.report, words, reason, own=own, outside=True)
            continue
        lower = systems[below.name].links.above
        if lower is None:
            yield Promise(name, below.report, words, f"`{below.name}` takes no numbered orders", begins=False)
            continue
        yield Promise(
            name,
            below.report,
            words,
            f"proved of `{below.name}`: {Sort.ECHOES.value}; both begin with the same order",
            ((below.name, (Sort.ECHOES, "", lower.report)),),
            own,
            _begin(ts, below.order, systems[below.name], lower.order),
        )


def _of_above(name: str, ts: TransitionSystem, systems: Mapping[str, TransitionSystem]) -> Iterator[Promise]:
    above = ts.links.above
    if above is None:
        return
    fields = ", ".join(f"`{leaf}`" for leaf in above.numbered)
    words = (
        f"while the number of `{above.order}` stays, so do {fields}"
        if fields
        else f"the numbers of `{above.order}` come one after the other"
    )
    if above.outside:
        yield Promise(name, above.order, words, f"`{above.name}` stands outside the levels", outside=True)
        return
    upper = next(below for below in systems[above.name].links.below if below.name == name)
    keys: list[Key] = [
        (Sort.NUMBERED, "", other_end(leaf, above.order, upper.order)) for leaf in above.numbered
    ]
    keys.append((Sort.NEXT_NUMBER, "", upper.order))
    needs = tuple((above.name, key) for key in keys)
    yield Promise(name, above.order, words, f"proved of `{above.name}`: {Sort.NUMBERED.value}", needs)


def _of_facts(name: str, ts: TransitionSystem) -> Iterator[Promise]:
    """Yield the facts that a level declares about others' outputs: its buffers begin so, and who writes them owes it."""
    first = {str(v.name): values.constant(v.type, v.initial) for v in ts.program.variables}
    for fact in ts.links.given:
        yield Promise(
            name,
            fact.record,
            f"what `{fact.writer}` writes is as `{fact.name}` says",
            f"proved of `{fact.writer}`: {Sort.OWED.value}",
            ((fact.writer, (Sort.OWED, "", f"{name}.{fact.name}")),),
            begins=bool(Run({}, {}, first).evaluate(fact.condition).low),
            fact=fact.name,
        )


def other_end(leaf: str, record: str, other: str) -> str:
    """Return the name of a field at the other end of the buffer."""
    return other + leaf.removeprefix(record)


def _begin(upper: TransitionSystem, order: str, lower: TransitionSystem, record: str) -> bool:
    """Return whether both levels begin with the same order, and with an echo of it or of an older one."""
    first = {str(v.name): v.initial for v in upper.program.variables}
    other = {str(v.name): v.initial for v in lower.program.variables}
    above = lower.links.above
    numbered = () if above is None else above.numbered
    ends = {leaf: other_end(leaf, record, order) for leaf in (f"{record}.{COMMAND}", *numbered)}
    ends[f"{record}.{NUMBER}"] = number = f"{order}.{NUMBER}"
    report = next(below.report for below in upper.links.below if below.order == order)
    if not first.keys() >= {*ends.values(), f"{report}.{ECHOED}"} or not other.keys() >= ends.keys():
        return False  # a field is missing, or named otherwise
    sent, echo = int(first[number]), int(first[f"{report}.{ECHO}"])
    echoed = (sent - echo) % NUMBERS < NUMBERS // 2
    if echo == sent:
        echoed = first[f"{report}.{ECHOED}"] == first[f"{order}.{COMMAND}"]
    return echoed and all(other[leaf] == first[end] for leaf, end in ends.items())

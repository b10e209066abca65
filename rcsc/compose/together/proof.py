"""Requirements across levels proved, or refuted by a run of the whole system.

In: the levels of a system, each proved alone or not, and the program of a file of requirements. Out: for each an `Across`.

A requirement is tried first under *any* timing, of the levels that it names. Then under the *late* one, where the system says how late its
buffers may be, and then under the *scheduled* one: of these levels, then with the levels that write to them, and so on: what is left out
may do all that its contract allows, so that a proof of few levels is one of all, and costs what they cost. A run is looked for of all
levels together, and shown only if the interpreter does it.

Where a requirement reads no real, all that follows is tried first with reals left open (`Together.opens`), which takes a tenth of the
clauses of a level that moves something; the invariant is confirmed with the reals as they are, and the interpreter does each run.

1. short runs, by bounded search: of all requirements of the same levels, and in all surroundings, in one;
2. invariants over predicates of all levels, confirmed by Z3: first of the kindest surroundings, which costs least, then with its clauses of
   harder ones; what these leave open goes to the exact engines (`exact.portfolio`);
3. longer runs.

What a level is proved to do alone is taken for granted of every cycle: that it goes on, and that what is read of others is as their
contract has it. So each verdict rests on that (`claims.RUNS`), and trusts what that trusts.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

from rcsc.compose.contract.claims import DECLARED, RUNS, UNKNOWN, Closed, Need, Verdict
from rcsc.compose.contract.obligations import Obligation, Sort, obligations
from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.contract.transition import Cycle, Leaves, TransitionSystem
from rcsc.compose.contract.watched import can_be_kept
from rcsc.compose.exact.circuit import circuit
from rcsc.compose.exact.eventual import Waits
from rcsc.compose.exact.portfolio import helped
from rcsc.compose.invariant.cubes import Reached
from rcsc.compose.invariant.pdr import PDR, Clause, Posed
from rcsc.compose.invariant.search import LIMITS, FoundInvariant, NamedClause, placed
from rcsc.compose.proof.assume_guarantee import admitted
from rcsc.compose.proof.level import LevelProof, NotConfirmedError, confirm_owed
from rcsc.compose.proof.system import SystemProof
from rcsc.compose.together.eventually import (
    COMES_TO_AN_END,
    ROUNDS,
    bounds,
    fairness,
    may_wait,
    never_waits,
    waits_for,
    waits_of,
    within,
)
from rcsc.compose.together.features import features, of_member, unlike
from rcsc.compose.together.played import PlayedRun, ShortRuns, Ticks, played_lasso
from rcsc.compose.together.product import (
    EVERY,
    Surroundings,
    Timing,
    Together,
    read_by_all,
    together,
    writers,
)
from rcsc.lang.model import Program, Property, Real
from rcsc.lang.over_time.past import FALSE, TRUE, negation
from rcsc.proof.solvers.sat import QUESTIONS, GaveUpError
from rcsc.run.description import Description

SHORT, LONG = 8, 60
"""Ticks of the runs that are looked for before a proof is tried, and after it."""
MOST_STEPS = 10_000_000
"""What Spacer gets for a requirement, in steps: less than 10 s."""
FEWEST, HARDER = 300, 1
"""How often the SAT solver is asked of harder surroundings, at least, and how many times as often as of the kindest."""
AT_FIRST = 4_000
"""How often it is asked at most where reals are left open."""
NO_RESTART = "no level begins anew while the system runs"
"""What is trusted where levels do not begin anew."""
NEVER_LATE = "no buffer is seen late"
"""What is trusted where the system says that buffers may be, and a requirement is proved only of such as are not."""


@dataclass(frozen=True, slots=True)
class Across:
    """A requirement across levels, with its verdict.

    Attributes:
        timing: Under which it is proved; of a refuted or open one, the scheduled one.
        levels: Those that its proof is about, or that run.
        by: How it was proved, in words.
        around: What may befall the levels there.
        late: How many ticks late the system says that buffers may be.
        run: A run that breaks it, tick by tick, in the surroundings `broken_in`; `run_late`, for each tick how late buffers are seen in it.
        looked: No run of so many ticks breaks it, where none is shown.
        vacuous: Whether it is proved, too, that nothing ever asks for its response.
        assumed: The assumptions across levels that it may rest on.
        lasso: The tick of the run, from 1, from which on it waits as at its end, again and again; 0 where the last one breaks it.
        fair: What is trusted to come at some time, where something is proved to.
        stuck: Whether it is open because what is assumed across levels was not shown to be kept for ever.
    """

    stated: Property
    proved: bool = False
    timing: Timing = Timing.SCHEDULED
    levels: tuple[str, ...] = ()
    by: str = ""
    around: Surroundings = EVERY[0]
    late: int = 0
    run: Ticks = field(default=(), repr=False)
    run_late: tuple[Mapping[str, int], ...] = ()
    broken_in: Surroundings | None = None
    looked: int = 0
    vacuous: bool = False
    assumed: tuple[str, ...] = ()
    lasso: int = 0
    fair: tuple[str, ...] = ()
    stuck: bool = False

    @property
    def refuted(self) -> bool:
        """Whether a run of the system breaks it, in the surroundings in which it is not proved."""
        return bool(self.run) and not self.proved

    def trusts(self, systems: Mapping[str, TransitionSystem]) -> tuple[str, ...]:
        """Return what is trusted of the surroundings of its levels, besides what these rest on."""
        refused = (
            () if self.around.refuses else (said for name in self.levels for said in admitted(systems[name]))
        )
        assumed = (f"assumption `{name}` across levels{DECLARED}" for name in self.assumed)
        return (
            *assumed,
            *refused,
            *(() if self.around.restarts else (NO_RESTART,)),
            *((NEVER_LATE,) if self.kinder_timing else ()),
            *self.fair,
        )

    @property
    def kinder_timing(self) -> bool:
        """Whether it is proved only of buffers that are never late, where the system says that they may be."""
        return self.late > 0 and self.timing is Timing.SCHEDULED

    @property
    def kinder(self) -> bool:
        """Whether it is proved only where less befalls the levels, or their buffers, than may."""
        return self.proved and (self.around != Surroundings() or self.kinder_timing)

    def closed(self, systems: Mapping[str, TransitionSystem], claims: Mapping[Need, Closed]) -> Closed:
        """Return its verdict with all that it rests on, as claims about levels have it."""
        rests = {(name, RUNS): claims.get((name, RUNS), UNKNOWN) for name in self.levels}
        lacks = {need for need, each in rests.items() if not each.accepted}
        lacks |= {other for each in rests.values() for other in each.lacks}
        trusts = {trust for each in rests.values() for trust in each.trusts} | set(self.trusts(systems))
        verdict = Verdict.PROVED if self.proved else Verdict.NOT_PROVED
        return Closed(verdict, tuple(sorted(lacks)), tuple(sorted(trusts)))


@dataclass(frozen=True, slots=True)
class Earlier:
    """What was found for requirements of a system, and may help others.

    Attributes:
        runs: The short runs that were looked for.
        clauses: Those of the invariants that show some, under a timing and in surroundings: worth a try.
    """

    runs: dict[tuple[object, ...], ShortRuns] = field(default_factory=dict)
    clauses: dict[tuple[Timing, Surroundings], dict[NamedClause, None]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Question:
    """One requirement of a system.

    Attributes:
        systems: All levels, with their environments.
        system: The description.
        program: The requirements.
        stated: The one that is asked about.
        proofs: Of levels alone, those that there are: their invariants hold of the levels together, too.
        opens: Whether reals are left open.
        shares: Whether other requirements of the program are asked about, too: then their short runs are looked for in one search.
        earlier: What was found so.
    """

    systems: Mapping[str, TransitionSystem]
    system: Description
    program: Program
    stated: Property
    proofs: Mapping[str, LevelProof] = field(default_factory=dict)
    opens: bool = False
    shares: bool = False
    earlier: Earlier = field(default_factory=Earlier, repr=False, compare=False)

    @property
    def every(self) -> tuple[str, ...]:
        """The levels that it names, and all that write to these, directly or not."""
        return tuple(self._reached_from(self._named(), len(self.systems)))

    def answer(self) -> Across:
        """Prove it or refute it; where it is proved, tell whether anything ever asks for its response."""
        found = self.verdict()
        monitor = self.stated.monitor
        if not found.proved or monitor is None or monitor.asks == TRUE:
            return found
        return replace(found, vacuous=self._never_asked.soon_proved(found))

    def asks(self) -> Across:
        """Answer whether nothing ever asks for its response; what refutes that is a run that does."""
        found = self._never_asked.verdict()
        return replace(found, stated=replace(found.stated, name=self.stated.name))

    @property
    def _never_asked(self) -> "Question":
        return replace(self, stated=never_asked(self.stated))

    def soon_proved(self, like: Across) -> bool:
        """Return whether it is proved as another requirement is, or of all levels as they are scheduled, by no more than a short search."""
        if not self.opens and self._ways()[0].opens:
            return self._ways()[0].soon_proved(like)
        if self._run(EVERY[0], SHORT, Timing.SCHEDULED)[0].ticks:
            return False
        parts = dict.fromkeys(((like.timing, like.levels), (Timing.SCHEDULED, self.every)))
        little = Shown(FoundInvariant())
        return any(self._proved(part, like.around, begun=little) is not None for part in parts)

    def verdict(self, *, soon: bool = False) -> Across:
        """Prove it or refute it; if soon, leave open what takes more than short runs and invariants over predicates."""
        found = self._begun()
        if may_wait(self.stated):
            return self._eventually(found)
        left: tuple[tuple[Surroundings, Timing], ...] = ()
        for one in self._ways():
            found, left = one.looked_for(found, soon=soon)
            if found.proved or soon or not left:
                return found
        return self._with_effort(found, left)

    def _ways(self) -> tuple["Question", ...]:
        """List the ways to ask: with reals left open, where it reads none and some level has any, which costs least; then as they are."""
        read = read_by_all(self.stated)
        reals = {
            f"{name}.{leaf}"
            for name, ts in self.systems.items()
            for leaf, kind in ts.kinds.items()
            if isinstance(kind, Real)
        }
        reals |= {str(v.name) for v in self.program.variables if isinstance(v.type, Real)}
        return (replace(self, opens=True), self) if reals and not read & reals else (self,)

    def _begun(self) -> Across:
        """Return it as open, and tell whether what is assumed can always be kept."""
        found = Across(self.stated, levels=self.every, late=self.system.late_ticks)
        if not self.program.environment:
            return found
        ts = self.together(self.every, Timing.SCHEDULED, EVERY[0])
        assumed = tuple(one.name for one in ts.program.environment)
        stuck = bool(assumed) and not goes_on(ts, tuple(ts.firsts().values()), ts.cycle(ts.havoc()))
        return replace(found, assumed=assumed, stuck=stuck)

    def looked_for(
        self, found: Across, *, soon: bool
    ) -> tuple[Across, tuple[tuple[Surroundings, Timing], ...]]:
        """Look for short runs and for invariants over predicates; return what is worth more effort, too."""
        left = list[tuple[Surroundings, Timing]]()
        in_kindest = dict[_Part, Shown | None]()
        little = Shown(FoundInvariant()) if soon else None
        for around in self._surroundings():
            found, broken = self._with_short_runs(found, around)
            left += [(around, timing) for timing in self._timings if timing not in broken]
            for part in self._parts():
                if part[0] not in broken and self._proved_at_last(in_kindest, part, around, little):
                    return self._as_proved(found, *part, around, ""), ()
        return found, tuple(dict.fromkeys((*left[: len(self._timings)], *left[-1:])))

    def _eventually(self, found: Across) -> Across:
        """Prove within which bound it comes, or refute it: by a run that a tick breaks, or one on which it waits for ever."""
        run, known = self._run(EVERY[0], SHORT, Timing.SCHEDULED)
        if run.ticks:
            return replace(found, run=run.ticks, broken_in=EVERY[0])
        found, waits = self._with_lasso(replace(found, looked=known))
        if found.run:
            return found
        rounds = ROUNDS if any(fairness({name: self.systems[name] for name in self.every})) else ()
        for most, fair in (*((most, False) for most in bounds(waits)), *((most, True) for most in rounds)):
            for timing, names in self._parts():
                parties = tuple(fairness({name: self.systems[name] for name in names if fair}))
                one = self._asking(within(self.stated, most, tuple(condition for _, condition in parties)))
                if timing is Timing.SCHEDULED and one.proves(names):
                    told = self._as_proved(
                        found, timing, names, EVERY[0], waits_for(most, fair=bool(parties))
                    )
                    return replace(
                        told, fair=(COMES_TO_AN_END, *dict.fromkeys(trust for trust, _ in parties))
                    )
        run, known = self._run(EVERY[0], LONG, Timing.SCHEDULED)
        if not run.ticks:
            return replace(found, looked=known)
        found = replace(found, run=run.ticks, broken_in=EVERY[0], looked=known)
        return self._kindest(found, Timing.SCHEDULED)

    def _with_lasso(self, found: Across) -> tuple[Across, Waits]:
        """Look for a run on which it waits for ever; return for how long it waits."""
        ts = self._asking(never_waits(self.stated)).together(self.every, Timing.SCHEDULED, EVERY[0])
        step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
        made = circuit(ts, firsts, step, obligations(ts, step))
        waits = waits_of(made)
        if waits.lasso is not None:
            fair = [condition for _, condition in fairness(ts.members)]
            run = played_lasso(ts, made, waits.lasso, self.stated, fair)
            if run is not None:
                found = replace(found, run=run.ticks, broken_in=EVERY[0], lasso=waits.lasso.first)
        return found, waits

    def _asking(self, stated: Property) -> "Question":
        """Return the same question about another property."""
        return replace(self, program=replace(self.program, properties=(stated,)), stated=stated)

    def proves(self, names: Sequence[str]) -> bool:
        """Return whether it is proved of these levels as they are scheduled, whatever befalls them."""
        every = (False, True) if tuple(names) == self.every else (False,)
        return any(
            self._proved((Timing.SCHEDULED, tuple(names)), EVERY[0], exact=exact) is not None
            for exact in every
        )

    def _with_short_runs(self, found: Across, around: Surroundings) -> tuple[Across, frozenset[Timing]]:
        """Look for short runs that break it; return the timings under which some run does.

        Of runs that are as short the one is kept that has the kindest surroundings, and no late buffers.
        """
        broken, known = set[Timing](), SHORT
        for timing in reversed(self._timings):
            run, looked_at = self._run(around, SHORT, timing)
            known = min(known, looked_at)
            if not run.ticks:
                continue
            broken |= {timing, self._timings[0], Timing.ANY}
            first, kinder = not found.run, around != found.broken_in
            if first or len(run.ticks) < len(found.run) or (len(run.ticks) == len(found.run) and kinder):
                found = replace(found, run=run.ticks, run_late=run.late, broken_in=around)
        if around == EVERY[0]:
            found = replace(found, looked=max(found.looked, known))
        return found, frozenset(broken)

    def _kindest(self, found: Across, timing: Timing) -> Across:
        """Return it with a run as long as its own in the kindest surroundings that has one: nothing befalls a level that need not."""
        for around in reversed(tuple(self._surroundings())):
            if around == found.broken_in:
                break
            run, _ = self._run(around, len(found.run), timing)
            if run.ticks:
                return replace(found, run=run.ticks, run_late=run.late, broken_in=around)
        return found

    def _with_effort(self, found: Across, left: Iterable[tuple[Surroundings, Timing]]) -> Across:
        """Prove it by exact engines, or look for longer runs: each may take long."""
        for around, timing in left:
            shown = self._proved((timing, self._named()), around, exact=True)
            if shown is not None:
                return self._as_proved(found, timing, self._named(), around, shown.by)
            if not found.run:
                run, known = self._run(around, LONG, timing)
                if run.ticks:
                    found = replace(found, run=run.ticks, run_late=run.late, broken_in=around)
                    found = self._kindest(found, timing)
                if (around, timing) == (EVERY[0], self._timings[0]):
                    found = replace(found, looked=max(found.looked, known))
        return found

    @property
    def _timings(self) -> tuple[Timing, ...]:
        """The timings under which runs of all levels are told, the harder first."""
        return (Timing.LATE, Timing.SCHEDULED) if self.system.late_ticks else (Timing.SCHEDULED,)

    def _surroundings(self) -> Iterator[Surroundings]:
        """Yield what may befall the levels, the hardest first."""
        refuse = any(self.systems[name].refusing().refuses for name in self.every)
        yield from (around for around in EVERY if refuse or around.refuses)

    def _as_proved(
        self, found: Across, timing: Timing, names: tuple[str, ...], around: Surroundings, by: str
    ) -> Across:
        found = self._kindest(found, self._timings[0]) if any(found.run_late) else found
        return replace(found, proved=True, stuck=False, timing=timing, levels=names, around=around, by=by)

    # --- proofs ---

    def _proved_at_last(
        self,
        in_kindest: dict["_Part", "Shown | None"],
        part: "_Part",
        around: Surroundings,
        begun: "Shown | None",
    ) -> bool:
        """Return whether it is proved in these surroundings.

        Nothing harder is tried of what is not proved in the kindest ones, which costs least, nor of more levels than suffice there.
        """
        kindest = tuple(self._surroundings())[-1]
        if any(shown is not None for (timing, _), shown in in_kindest.items() if timing is part[0]):
            begun = in_kindest.get(part)
        else:
            begun = None if part in in_kindest else self._proved(part, kindest, begun=begun)
            in_kindest[part] = begun
        if begun is None:
            return False
        return around == kindest or self._proved(part, around, begun=begun) is not None

    def _proved(
        self,
        part: "_Part",
        around: Surroundings,
        *,
        exact: bool = False,
        begun: "Shown | None" = None,
    ) -> "Shown | None":
        timing, names = part
        lemmas = tuple(self._lemmas(names, around))
        known = self.earlier.clauses.setdefault((timing, around), {})
        ts = self.together(names, timing, around)
        shown = proved(ts, lemmas, exact=exact, begun=begun, candidates=tuple(known))
        if shown is not None and self.shares:
            known.update(dict.fromkeys(shown.own))
        return shown

    def _lemmas(self, names: Iterable[str], around: Surroundings) -> Iterator["Lemma"]:
        """Yield the invariants of these levels, each proved of the level alone, in surroundings that are as hard."""
        for name in names:
            if (known := self.proof_of(name, around)) is not None:
                yield Lemma(name, known.predicates, known.clauses)

    def proof_of(self, name: str, around: Surroundings) -> LevelProof | None:
        """Return the proof of a level alone, in surroundings that are as hard."""
        proof = self.proofs.get(name)
        return proof.parts[0] if proof is not None and proof.parts and around.refuses else proof

    def _parts(self) -> Iterator["_Part"]:
        named = self._named()
        yield Timing.ANY, named
        for timing in self._timings:
            known: tuple[str, ...] = ()
            for steps in range(len(self.systems) + 1):
                names = tuple(self._reached_from(named, steps))
                if names != known:
                    yield timing, names
                known = names

    def _named(self) -> tuple[str, ...]:
        """List the levels whose variables it reads, also those of a party outside, by who is at the other end."""
        found = set()
        for name in read_by_all(self.stated):
            party = name.partition(".")[0]
            found |= {party} if party in self.systems else set(self._at_other_ends(name))
        return tuple(name for name in self.systems if name in found)

    def _at_other_ends(self, name: str) -> Iterator[str]:
        """Yield who reads or writes the buffer of which this is an end, or a leaf of what it holds."""
        for wire in self.system.wires:
            for end, other in ((wire.source, wire.target), (wire.target, wire.source)):
                if name == end or name.startswith(f"{end}."):
                    yield other.partition(".")[0]

    def _reached_from(self, names: Iterable[str], steps: int) -> Iterator[str]:
        """Yield these levels and those that write to them, directly or by so many others."""
        here = set(names)
        for _ in range(steps):
            here |= writers(self.system, self.systems, here)
        yield from (name for name in self.systems if name in here)

    def invariant(self, found: Across) -> "tuple[Together, Shown] | None":
        """Return the levels of a proof, and an invariant that shows the requirement of them once more."""
        if not found.proved:
            return None
        lemmas = tuple(self._lemmas(found.levels, found.around))
        for one in self._ways():
            ts = one.together(found.levels, found.timing, found.around)
            again = proved(ts, lemmas, exact=bool(found.by) and not ts.opens)
            if again is not None:
                return replace(ts, opens=False), again
        return None

    def together(
        self, names: Sequence[str], timing: Timing, around: Surroundings, *asked: Property
    ) -> Together:
        """Return these levels as one transition system, about these requirements, or the one that is asked about."""
        asked = asked or (self.stated,)
        systems = {
            name: ts.refusing() if around.refuses else ts.admitting() for name, ts in self.systems.items()
        }
        program = replace(self.program, properties=asked)
        ts = together(systems, names, self.system, program, timing, *(one.name for one in asked))
        return replace(ts, restarting=around.restarts, opens=self.opens)

    # --- runs ---

    def _run(self, around: Surroundings, most: int, timing: Timing) -> tuple[PlayedRun, int]:
        """Look for the shortest run of all levels that breaks it, of so many ticks; return it, and how long no run is that does."""
        alike = tuple(self._alike()) if self.shares and most == SHORT else ()
        asked = alike if self.stated in alike else (self.stated,)
        key = self.opens, self.every, timing, most, asked
        if key not in self.earlier.runs:
            self.earlier.runs[key] = ShortRuns.of(self.together(self.every, timing, EVERY[0], *asked), most)
        return self.earlier.runs[key].breaking(self.stated, around)

    def _alike(self) -> Iterator[Property]:
        """Yield the requirements that are about the same levels, and that they are never asked: their short runs are looked for in one."""
        for one in self.program.properties:
            if not may_wait(one) and replace(self, stated=one).every == self.every:
                yield one
                if one.monitor is not None and one.monitor.asks != TRUE:
                    yield never_asked(one)


def questions(
    systems: Mapping[str, TransitionSystem], system: Description, program: Program, whole: SystemProof
) -> Iterator[Question]:
    """Yield a question for each requirement of a system; what is found for one serves those after it."""
    proofs, earlier = {proof.level: proof for proof in whole.levels}, Earlier()
    for one in program.properties:
        yield Question(systems, system, program, one, proofs, shares=True, earlier=earlier)


def never_asked(stated: Property) -> Property:
    """Return the requirement that nothing ever asks for the response of this one."""
    assert stated.monitor is not None
    monitor = replace(stated.monitor, waits=FALSE)
    name = f"{stated.name} is asked"
    return replace(stated, name=name, condition=negation(monitor.asks), monitor=monitor)


@dataclass(frozen=True, slots=True)
class Lemma:
    """The invariant of one level: clauses over predicates, confirmed of it alone."""

    level: str
    predicates: tuple[Predicate, ...]
    clauses: tuple[Clause, ...]


@dataclass(frozen=True, slots=True)
class Shown:
    """An invariant that shows a requirement of levels together, as Z3 confirmed it.

    Attributes:
        by: How it was found, in words; empty for the search over predicates.
        exact: Whether it is confirmed only of terms in which all arithmetic of integers is exact.
        known: Those of its clauses that are of a level, which a level's own proof shows: of which level, and where they stand there.
        asked: How often the SAT solver was asked about a later tick.
    """

    invariant: FoundInvariant
    by: str = ""
    exact: bool = False
    known: Mapping[Clause, tuple[str, int]] = field(default_factory=dict)
    asked: int = 0

    @property
    def own(self) -> Iterator[NamedClause]:
        """Yield its clauses that are of no level, with the names of their predicates."""
        for clause, named in zip(self.invariant.clauses, self.invariant.named, strict=True):
            if clause not in self.known:
                yield named


_Part = tuple[Timing, tuple[str, ...]]
"""A timing, and the levels that are looked at."""


def proved(
    ts: Together,
    lemmas: Sequence[Lemma] = (),
    *,
    exact: bool = False,
    begun: Shown | None = None,
    candidates: Sequence[NamedClause] = (),
) -> Shown | None:
    """Prove the requirement of levels together; return how, or None.

    Args:
        ts: The levels; where they leave reals open, that is for the search alone.
        lemmas: What is known of them.
        exact: Whether exact engines try what no invariant over predicates shows.
        begun: How it was proved in kinder surroundings: its clauses are tried first, and the search is given up where it takes far more.
        candidates: Clauses that are tried, too.
    """
    step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
    wanted = obligations(ts, step)
    assert len(wanted) == 1, "nothing would be proved of nothing"
    if not goes_on(ts, firsts, step):
        return None
    owed = [*(obligations(ts, first) for first in firsts), wanted]
    known = tuple(of_member(one, lemma.level) for lemma in lemmas for one in lemma.predicates)
    chosen = unlike((*known, *features(ts, step, [one.holds for one in wanted])))
    of_levels = dict(_clauses(ts, chosen, lemmas))
    held = tuple(of_levels)
    most = AT_FIRST if ts.opens else QUESTIONS
    found, asked = searched((*firsts, step), owed, chosen, held, begun, most, candidates)
    by = ""
    if exact:
        more = helped(ts, firsts, step, wanted, found, MOST_STEPS)
        found, by = more.invariant, next(iter(more.by.values()), "")
    if found.open:
        return None
    if ts.opens:
        ts = replace(ts, opens=False)
        step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
        owed = [obligations(ts, cycle) for cycle in (*firsts, step)]
    for integers in (False, True) if by else (False,):
        with suppress(NotConfirmedError, GaveUpError):
            confirm_owed(found, firsts, step, owed, LIMITS, known=held, exact=integers)
            return Shown(found, by, integers, of_levels, asked)
    return None


def goes_on(ts: Together, firsts: Sequence[Cycle], step: Cycle) -> bool:
    """Return whether what is assumed across levels can always be kept: of an environment that cannot go on all would be proved."""
    if not ts.program.environment:
        return True
    owed = [
        tuple(Obligation(Sort.KEPT, "", name, holds) for name, holds in can_be_kept(ts.program, cycle.after))
        for cycle in (*firsts, step)
    ]
    at_first = [holds for first in firsts for _, holds in can_be_kept(ts.program, first.before)]
    if not all(holds.known and holds.low for holds in at_first):
        return False
    chosen = unlike(features(ts, step, [one.holds for one in owed[-1]]))
    found, _ = searched((*firsts, step), owed, chosen, ())
    if found.open:
        return False
    with suppress(NotConfirmedError, GaveUpError):
        confirm_owed(found, tuple(firsts), step, owed, LIMITS)
        return True
    return False


def _clauses(
    ts: Together, chosen: Sequence[Predicate], lemmas: Iterable[Lemma]
) -> Iterator[tuple[Clause, tuple[str, int]]]:
    """Yield the clauses of lemmas over these predicates, which hold in every state in which a later tick begins, and where each stands.

    They hold after each cycle of their level. Where it need not run in the first tick, only those are yielded that hold before its first
    cycle, too.
    """
    places, start = {one.name: at for at, one in enumerate(chosen)}, ts.initial()
    for lemma in lemmas:
        own = [places[of_member(one, lemma.level).name] for one in lemma.predicates]
        for place, clause in enumerate(lemma.clauses):
            placed = tuple(sorted((own[at], value) for at, value in clause))
            if ts.timing is not Timing.ANY or _holds(chosen, placed, start):
                yield placed, (lemma.level, place)


def _holds(chosen: Sequence[Predicate], clause: Clause, state: Leaves) -> bool:
    """Return whether a state of constants is outside the cube."""
    for at, value in clause:
        node = chosen[at].node(state)
        if node.known and (node.low == value if value >= 0 else node.low != ~value):
            continue
        return node.known
    return False


def searched(
    cycles: Sequence[Cycle],
    owed: Sequence[Sequence[Obligation]],
    chosen: tuple[Predicate, ...],
    held: tuple[Clause, ...],
    begun: Shown | None = None,
    most: int = QUESTIONS,
    candidates: Sequence[NamedClause] = (),
) -> tuple[FoundInvariant, int]:
    """Search an invariant over predicates: of first cycles and a later one, with what each owes, and clauses that are known to hold.

    Return it, and how often the solver was asked about a later tick.
    """
    every = range(len(owed[-1]))
    named = dict.fromkeys((*(() if begun is None else begun.invariant.named), *candidates))
    tried = placed(named, chosen)
    most = most if begun is None else max(FEWEST, HARDER * begun.asked)
    posed = [
        Posed(chosen, cycle, {at: each[at].holds for at in every}, most)
        for cycle, each in zip(cycles, owed, strict=True)
    ]
    weights = [2 if one.parts else int(one.size > 2) for one in chosen]
    try:
        clauses, left = PDR(posed[:-1], posed[-1], Reached.of(()), weights, held, tried).search(every)
    except GaveUpError:
        return FoundInvariant(chosen, held, frozenset(every)), posed[-1].sat.queries
    finally:
        for cycle in posed:
            cycle.sat.close()
    return FoundInvariant(chosen, tuple(clauses), frozenset(left)), posed[-1].sat.queries

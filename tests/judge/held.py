"""What is proved, found and shown of a drawn level, against all of its runs.

In: a seed. Out: `Judged`: what was compared, by kind, and each difference. That a claim holds and is not proved is counted as open, and is
no difference.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from rcsc.compose.contract.environment import Links
from rcsc.compose.contract.obligations import Obligation, Sort, obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.lasso import Lasso, waiting_lasso
from rcsc.compose.counterexample.trace import NotReproducedError, Trace, TraceSearch, traces
from rcsc.compose.exact import explicit
from rcsc.compose.exact.bounded import looked
from rcsc.compose.exact.circuit import circuit
from rcsc.compose.exact.eventual import of_all_states
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.eventually import circuit_of, waiting
from rcsc.compose.proof.level import LevelProof, Verdict, prove_level
from rcsc.lang.model import Kind, Program
from rcsc.lang.resolve import compile_text
from tests.judge.drawn import made
from tests.judge.truth import DiffersError, Runs, TooManyError, Truth, truth

EFFORT = Effort(walks=1, cycles=12, looks=False)
LOOKS = 6
"""Of so many levels one has its lines and requirements looked at in context, too; and shortest runs searched by clauses."""
SHORT = 4
"""Cycles of runs that are searched by clauses."""
STATED = frozenset({Sort.REQUIREMENT, Sort.PROPERTY})


@dataclass(frozen=True, slots=True)
class Judged:
    """What was found of one level.

    Attributes:
        counts: What was compared, by kind.
        differences: In words.
        open: The names of claims that hold and are not proved.
    """

    seed: int
    counts: Counter[str] = field(default_factory=Counter)
    differences: tuple[str, ...] = ()
    open: tuple[str, ...] = ()


def judged(seed: int, text: str = "", *, proofs: int = 1) -> Judged:
    """Draw a level, or take this one, and compare; prove one of so many, and of the others compare engines alone."""
    drawn, parts = made(seed)
    program = compile_text(text or drawn, "drawn.rcs")
    if not isinstance(program, Program):
        return Judged(seed, Counter({"no program": 1}))
    ts = _alone(program)
    counts = Counter({"levels": 1, **{f"with {part}": 1 for part in parts}})
    try:
        runs = Runs.of(ts)
        true = truth(runs)
        refused = truth(runs, refused=True) if ts.refusing().refuses else true
    except TooManyError:
        return Judged(seed, Counter({"levels with too many states": 1}))
    except DiffersError as differs:
        return Judged(seed, counts, (f"the interpreter differs: {differs}",))
    counts["states"] = true.states
    return _compared(_Held(seed, ts, true, refused, counts), proves=seed % proofs == 0)


def _alone(program: Program) -> TransitionSystem:
    [level] = program.levels
    free = tuple(str(v.name) for v in program.variables if v.kind is Kind.INPUT)
    return TransitionSystem(program, level, Links(level.name, None, (), (), free))


@dataclass(slots=True)
class _Held:
    """A level that is being compared; `refused`, what is true where inputs may be refused."""

    seed: int
    ts: TransitionSystem
    true: Truth
    refused: Truth
    counts: Counter[str]
    open: list[str] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """The requirements and properties."""
        return [one.name for one in self.ts.program.properties]


def _compared(held: _Held, *, proves: bool) -> Judged:
    looks = held.seed // 10 % LOOKS == 0
    differences = [*_states_searched(held), *_waits_searched(held)]
    if not proves:
        return Judged(held.seed, held.counts, tuple(differences))
    held.counts["levels proved"] = 1
    proof = prove_level(held.ts, Effort(EFFORT.walks, EFFORT.cycles, looks=looks))
    differences += _verdicts(held, proof)
    if looks:
        differences += [*_shown(held), *_vacuous(held, proof)]
    return Judged(held.seed, held.counts, tuple(differences), tuple(held.open))


def _stated(ts: TransitionSystem) -> list[Obligation]:
    return [one for one in obligations(ts, ts.cycle(ts.havoc())) if one.sort in STATED]


def _states_searched(held: _Held) -> Iterator[str]:
    """Hold the search of all states against the truth: what is broken, and by runs of how many cycles."""
    ts, true = held.ts, held.true
    firsts, step = tuple(ts.firsts().values()), ts.cycle(ts.havoc())
    made_of = circuit(ts, firsts, step, _stated(ts))
    if not explicit.applies(made_of):
        return
    found = explicit.explored(made_of)
    held.counts["searches of all states"] += 1
    least = {**true.restarted, **true.least}
    every = {key[2]: len(run.given) for key, run in found.runs.items()}
    if made_of.opened:
        if any(every.get(name, cycles + 1) > cycles for name, cycles in true.least.items()):
            yield f"search of all states, some left open: {every} for {true.least}"
    elif every != least:
        yield f"search of all states: {every} for {least}"
    if held.seed // 10 % LOOKS == 0 and not made_of.opened:
        short = {key[2]: len(run.given) for key, run in looked(made_of, SHORT).runs.items()}
        held.counts["searches of short runs"] += 1
        wrong = {name for name, cycles in short.items() if name not in least or cycles > least[name]}
        missed = {name for name, cycles in true.least.items() if cycles <= SHORT} - set(short)
        if wrong or missed:
            yield f"search of short runs: {short} for {least}"


def _waits_searched(held: _Held) -> Iterator[str]:
    """Hold for how long each requirement waits against the truth, where all states are searched."""
    for name, stated in waiting(held.ts).items():
        made_of = circuit_of(held.ts, stated)
        found = None if made_of is None or made_of.opened else of_all_states(made_of)
        if found is None:
            continue
        held.counts["waits searched"] += 1
        most = held.true.most.get(name, 0)
        if (found.lasso is None) != (most is not None) or (most is not None and found.most != most):
            yield f"{name} waits for {found.most} cycles, or ever: {found.lasso is not None}; for {most}"


def _verdicts(held: _Held, proof: LevelProof) -> Iterator[str]:
    """Hold each verdict against the truth."""
    broken, where = held.true.broken, held.refused.broken
    assumed = {one.name for one in held.ts.program.environment}
    kept = {
        owed.name for owed, verdict in proof.verdicts if owed.sort is Sort.KEPT and verdict is Verdict.PROVED
    }
    # Of what stands outside its range a comparison is read, for an assumption, whichever way keeps it: such runs do not end.
    if assumed and assumed <= kept and held.true.ends:
        yield "what is assumed cannot always be kept"
    held.counts["assumptions kept" if assumed <= kept else "assumptions not shown to be kept"] += bool(
        assumed
    )
    for owed, verdict in proof.verdicts:
        if owed.sort not in STATED:
            if verdict is not Verdict.PROVED and owed.sort is not Sort.KEPT:
                held.open.append(f"{owed.sort} {owed.name}")
            continue
        sort = "requirements" if owed.sort is Sort.REQUIREMENT else "properties"
        proved, needs = verdict is Verdict.PROVED, proof.needs_admission(owed.key)
        if proved and owed.name in (broken if needs else where):
            yield f"{owed.name} is proved{' of admitted inputs' if needs else ''}, and a run breaks it"
        elif proved:
            held.counts[f"{sort} proved{' if nothing is refused' if needs else ''}"] += 1
        elif owed.name in broken:
            held.counts[f"{sort} refuted{'' if owed.name not in held.true.most else ' that wait'}"] += 1
        else:
            held.counts[f"{sort} open"] += 1
            held.open.append(owed.name)
    for bound in proof.bounds:
        most = held.true.most.get(bound.name, 0)
        if most is None:
            yield f"{bound.name} has a bound, and waits for ever"
        elif bound.within.exact and not bound.within.rank and bound.within.most < most:
            yield f"{bound.name} waits for {bound.within.most} at most, and did for {most}"


def _shown(held: _Held) -> Iterator[str]:
    """Hold runs that are shown against the shortest there are."""
    wanted = _stated(held.ts)
    found = traces(held.ts, wanted, TraceSearch(SHORT))
    lengths = {key[2]: len(trace.steps) for key, trace in found.items() if isinstance(trace, Trace)}
    held.counts["runs shown"] += len(lengths)
    least = {name: cycles for name, cycles in held.true.least.items() if cycles <= SHORT}
    guessed = {
        key[2] for key, trace in found.items() if isinstance(trace, NotReproducedError) and trace.guessed
    }
    held.open += [f"run of {name}" for name in sorted(guessed)]  # the arithmetic of singles is left open
    if any(least.get(name) != cycles for name, cycles in lengths.items()) or set(least) - guessed - set(
        lengths
    ):
        yield f"runs shown: {lengths} for {least}"
    for name in waiting(held.ts):
        lasso = waiting_lasso(held.ts, name, (TraceSearch(6), TraceSearch(6, restarted=True)))
        held.counts["laps shown"] += isinstance(lasso, Lasso)
        for_ever = held.true.most.get(name, 0) is None
        if isinstance(lasso, Lasso) and not for_ever:
            yield f"{name} is shown to wait for ever, and does not"
        elif for_ever and not isinstance(lasso, Lasso):
            held.open.append(f"lap of {name}")


def _vacuous(held: _Held, proof: LevelProof) -> Iterator[str]:
    """Hold what is said never to ask against what asks."""
    if proof.context is None:
        return
    vacuous = set(proof.context.vacuous)
    held.counts["requirements vacuous"] += len(vacuous)
    if vacuous & held.true.asks:
        yield f"{vacuous & held.true.asks} ask"
    every = {one.name for one in held.ts.program.properties if one.monitor is not None}
    missed = every - held.refused.asks - held.true.asks - vacuous
    held.counts["requirements that never ask, and are not told"] += len(missed)

"""Explains what is not proved: by the shortest run that breaks it, checked on the executors, and by repairs.

In: transition systems and the proof of their levels. Out: an `Explanation` for each obligation that is not proved; if lines both match,
one for each pair.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.children import scratch
from rcsc.compose.contract.beginning import Starts
from rcsc.compose.contract.obligations import Obligation, ObligationKey, Sort, counts_on, obligations, pairs
from rcsc.compose.contract.properties import invariant_kept
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.watched import can_be_kept
from rcsc.compose.counterexample.applied import Texts
from rcsc.compose.counterexample.consequence import Consequence, consequences
from rcsc.compose.counterexample.finding import Finding, of_trace, supposed
from rcsc.compose.counterexample.lasso import Lasso, lassos, obligation_of, waiting_lasso
from rcsc.compose.counterexample.pair import followed_together
from rcsc.compose.counterexample.repair import TRIED_CYCLES, helps, repairs
from rcsc.compose.counterexample.rerun import ExecutorsDifferError, make, only_in_python, record
from rcsc.compose.counterexample.trace import (
    USUAL,
    NotReproducedError,
    Trace,
    TraceResult,
    TraceSearch,
    stopping,
    trace_of,
    traces,
)
from rcsc.compose.exact.played import every_run, further_runs
from rcsc.compose.proof.eventually import waiting
from rcsc.compose.proof.level import LevelProof, Verdict
from rcsc.compose.proof.system import SystemProof
from rcsc.lang.model import Property
from rcsc.lang.over_time.past import negation
from rcsc.proof.procedures.invariants import at_first
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.run.description import Description

FURTHER = 40
"""Cycles of longer runs that are looked for where nothing else is asked for."""
LONGEST_LAP = 5
"""Cycles of a lasso that is looked for where a command is not shown to end, from any state that is not excluded."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """An obligation that is not proved, and a run that breaks it.

    Attributes:
        level: The level that owes it.
        obligation: The obligation.
        finding: The run that breaks it; None if none was found.
        beside: If the run is not reproduced, where the two differ, a line each.
        guessed: Whether that is no bug, because arithmetic was left open (`keyed`).
        helps: Suggested repairs of the table, each with whether it is proved of the text that it makes.
        log: Where the run is kept.
        others: Where a run shows a pair of lines, the other pairs of the same table, which none shows.
        in_c: Whether the C executor ran it, too; it cannot if an extern procedure has to give a result that no C function can.
        supposed: A cycle that would break it, from a state that the proof does not exclude and nobody has seen reached; None where
            there is a finding, or none was looked for.
        together: The effect of the first repairs of all findings of its table together, at the last of them.
        follows: Its consequences, each with a run that the executors repeated, too; None if they were not looked for.
        supposes: Of a run of one level alone: for each other level, the inputs for which it gives values that are supposed of it.
        notes: Facts known of it without a run: lines that may go on for ever, or values after a restart that break it.
        undefined: Whether the run that was found meets an operation that is not defined.
        gave_up: Whether the solver gave up on a search for a run, so that there may be one among those that were looked at.
    """

    level: str
    obligation: Obligation
    finding: Finding | None = None
    beside: tuple[str, ...] = ()
    guessed: bool = False
    helps: tuple[str, ...] = ()
    log: Path | None = None
    others: tuple[str, ...] = field(default=())
    in_c: bool = True
    follows: tuple[Consequence, ...] | None = None
    together: str = ""
    supposed: Finding | None = None
    supposes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    undefined: bool = False
    gave_up: bool = False

    @property
    def warns(self) -> bool:
        """Whether it is only a warning: a command that is not shown to end may rightly wait."""
        return self.obligation.sort is Sort.ENDS

    @property
    def refutes(self) -> bool:
        """Whether a run is shown that breaks it, as all that ran it say."""
        return self.finding is not None and not self.beside and not self.warns

    @property
    def bug(self) -> bool:
        """Whether it shows a fault of rcsc's own."""
        return bool(self.beside) and not self.guessed


@dataclass(frozen=True, slots=True)
class TraceSettings:
    """Settings of the search for runs.

    Attributes:
        system: The system's description.
        most: Cycles of a run.
        altered: Whether the programs are variants under another rule than the language's.
        log: The folder in which runs are kept; None for none.
        further: Cycles that a finding is followed on; 0 for none.
        starts: For each level the leaves that runs begin with other values than the initial ones; then none begins with a restart.
    """

    system: Description
    most: int
    altered: bool = False
    log: Path | None = None
    further: int = 4
    starts: Starts = field(default_factory=dict)

    def searches(self, level: str) -> tuple[TraceSearch, ...]:
        """Return the searches for runs of a level, in order: runs with neighbours that began with it are shown first."""
        begun = self.starts.get(level, {})
        every = (TraceSearch(legal=True), TraceSearch(), TraceSearch(legal=True, restarted=True))
        return tuple(
            replace(search, most=self.most, start=begun)
            for search in every
            if not (search.restarted and any(self.starts.values()))
        )


def explain(
    systems: Mapping[str, TransitionSystem], proof: SystemProof, settings: TraceSettings
) -> Iterator[Explanation]:
    """Explain every obligation that is not proved, level by level.

    Raises:
        NotBuilt: The C executors could not be built.
        OSError: A log cannot be written.
    """
    with scratch("findings") as kept:
        texts = Texts()
        rerun = _Rerun(systems, settings, settings.log or kept, texts)
        for level in proof.levels:
            for explanation in (
                *_level(systems, level, settings, texts),
                *_together(systems, level.level, level.open, settings),
                *_endless(systems[level.level], level, settings),
            ):
                finding = explanation.finding
                given = {} if finding is None else supposed(settings.system, systems, finding)
                yield rerun.run(replace(explanation, supposes=given))


def _level(
    systems: Mapping[str, TransitionSystem], proof: LevelProof, settings: TraceSettings, texts: Texts
) -> Iterator[Explanation]:
    wanted = proof.open
    if not settings.most:
        yield from (Explanation(proof.level, obligation) for obligation in wanted)
        return
    ts = systems[proof.level]
    every = pairs(ts.cycle(ts.havoc()))
    parted = {
        obligation.key: [part for part in every if part.table == obligation.table]
        for obligation in wanted
        if obligation.sort is Sort.ONE_LINE
    }
    asked = [part for obligation in wanted for part in parted.get(obligation.key) or [obligation]]
    gave_up = set[ObligationKey]()
    results = _searched(ts, asked, settings, gave_up)
    for obligation in wanted:
        if obligation.key in parted:
            every_pair = [
                replace(each, gave_up=any(part.key in gave_up for part in parted[obligation.key]))
                for each in _pairs(ts, obligation, parted[obligation.key], results, proof)
            ]
            yield from _with_repairs(ts, every_pair, proof, settings, texts)
        else:
            result = results.get(obligation.key) or _waits_for_ever(ts, obligation, settings, gave_up)
            explanation = _explanation(ts, obligation, result)
            notes = tuple(_as_it_begins(ts, obligation))
            explanation = replace(explanation, notes=notes, gave_up=obligation.key in gave_up)
            yield (
                replace(explanation, supposed=_supposed(ts, obligation, proof))
                if result is None
                else explanation
            )


def _waits_for_ever(
    ts: TransitionSystem, obligation: Obligation, settings: TraceSettings, gave_up: set[ObligationKey]
) -> Lasso | NotReproducedError | None:
    """Find a run on which a requirement waits for ever that no cycle breaks."""
    if obligation.sort is not Sort.REQUIREMENT or obligation.name not in waiting(ts):
        return None
    try:
        return waiting_lasso(ts, obligation.name, settings.searches(str(ts.level.name)))
    except GaveUpError:
        gave_up.add(obligation.key)
        return None


def _as_it_begins(ts: TransitionSystem, obligation: Obligation) -> Iterator[str]:
    """Yield notes where what it begins with breaks an invariant, gives an order an old number, or leaves nothing to keep an assumption."""
    for below in ts.links.below:
        if (obligation.sort, obligation.name) == (Sort.NEXT_NUMBER, below.order) and not counts_on(ts, below):
            yield f"after a restart `{below.number}` may be the number of an earlier order: it does not count on from that"
    if obligation.sort is Sort.KEPT:
        begins = {"in the first cycle": ts.initial(), "in the first cycle after a restart": ts.restarted()}
        for where, leaves in begins.items():
            can = dict(can_be_kept(ts.program, leaves))[obligation.name]
            if can.known and not can.low:
                yield f"nothing keeps it {where}, and no other follows"
    for finding in at_first(ts.program) if obligation.sort is Sort.INVARIANT else ():
        if finding.message.endswith(f"`{obligation.name}`") and finding.code is Code.INVARIANT_INITIAL:
            yield " ".join((finding.message, *(f"({note})" for note in finding.notes)))


def _supposed(ts: TransitionSystem, obligation: Obligation, proof: LevelProof) -> Finding | None:
    """Find a cycle that breaks an obligation of which no run is known, from a state that the invariant leaves open."""
    if proof.verdict(*obligation.key) is not Verdict.NOT_PROVED:
        return None
    trace = stopping(ts, obligation, proof.predicates, proof.clauses)
    return None if trace is None else of_trace(ts, obligation, trace)


def _searched(
    ts: TransitionSystem, asked: list[Obligation], settings: TraceSettings, gave_up: set[ObligationKey]
) -> dict[ObligationKey, TraceResult]:
    """Run the searches one after the other, each for the obligations still open; where all states can be searched, only as far as runs go.

    Then a run may be as long as it has to be, however many cycles are asked for. Elsewhere longer runs are looked for with little effort.
    """
    begun = settings.starts.get(str(ts.level.name), {})
    every = None if begun else every_run(ts, tuple(ts.firsts().values()), asked)
    results: dict[ObligationKey, TraceResult] = {}
    if every is not None:
        shown = {owed.key: owed for owed in asked if owed.key in every.runs}
        long = {key for key in shown if len(every.runs[key].taken) > min(settings.most, USUAL)}
        results = {key: trace_of(ts, shown[key], every.runs[key]) for key in long}
        asked = [owed for owed in asked if owed.key in shown or every.states is None]
    for search in settings.searches(str(ts.level.name)):
        left = [obligation for obligation in asked if obligation.key not in results]
        if left:
            results |= traces(ts, left, search, gave_up)
    left = [owed for owed in asked if owed.key not in results]
    if every is None and left and not begun and settings.most >= USUAL:
        return results | _further(ts, left, gave_up)
    for owed in left:  # beyond what these searches allow a neighbour
        if every is not None and owed.key in every.runs:
            results[owed.key] = trace_of(ts, owed, every.runs[owed.key])
    return results


def _further(
    ts: TransitionSystem, left: list[Obligation], gave_up: set[ObligationKey]
) -> dict[ObligationKey, TraceResult]:
    """Look for longer runs by the circuit, as far as that goes with little effort; show the simplest run of each length found."""
    results: dict[ObligationKey, TraceResult] = {}
    runs = further_runs(ts, tuple(ts.firsts().values()), left, FURTHER)
    for owed in left:
        if (run := runs.get(owed.key)) is not None:
            search = TraceSearch(len(run.taken), restarted=run.restarted)
            results |= traces(ts, [owed], search, gave_up)
            results.setdefault(owed.key, trace_of(ts, owed, run))
    return results


def exercising(ts: TransitionSystem, stated: Property, settings: TraceSettings) -> Finding | None:
    """Find the shortest run that asks for the response of a requirement over time, in the last cycle; None where none is found.

    It is a run that breaks the property that nothing asks.
    """
    assert stated.monitor is not None
    silent = Property(f"{stated.name} asks", negation(stated.monitor.asks), "")
    asked = ts.of(replace(ts.program, properties=(*ts.program.properties, silent)))
    [owed] = [each for each in obligations(asked, asked.cycle(asked.havoc())) if each.name == silent.name]
    result = _searched(asked, [owed], settings, set()).get(owed.key)
    return of_trace(asked, owed, result) if isinstance(result, Trace) else None


def _pairs(
    ts: TransitionSystem,
    obligation: Obligation,
    parted: list[Obligation],
    results: Mapping[ObligationKey, TraceResult],
    proof: LevelProof,
) -> Iterator[Explanation]:
    """Explain each pair of lines that both match in some run; the table as a whole if no pair does."""
    shown = [pair for pair in parted if pair.key in results]
    others = tuple(pair.name for pair in parted if pair.key not in results)
    if not shown:
        yield Explanation(ts.level.name, obligation, supposed=_supposed(ts, obligation, proof))
    for at, pair in enumerate(shown):
        yield replace(
            _explanation(ts, pair, results[pair.key]), others=others if at == len(shown) - 1 else ()
        )


def _with_repairs(
    ts: TransitionSystem,
    every: list[Explanation],
    proof: LevelProof,
    settings: TraceSettings,
    texts: Texts,
) -> Iterator[Explanation]:
    """Add repairs that part the lines, each tried; the last explanation tells the effect of all of them together."""
    findings = [explanation.finding for explanation in every if explanation.finding is not None]
    if not findings or settings.altered:  # cells of a variant are not what is written
        yield from every
        return
    kept = [obligation for obligation, verdict in proof.verdicts if verdict is Verdict.PROVED]
    tries = repairs(ts, findings, kept, min(settings.most, TRIED_CYCLES), texts)
    left = iter(tries.helps)
    for at, explanation in enumerate(every):
        shown = next(left) if explanation.finding is not None else ()
        together = tries.together if at == len(every) - 1 else ""
        yield replace(explanation, helps=shown, together=together)


def _explanation(
    ts: TransitionSystem, obligation: Obligation, result: TraceResult | Lasso | None
) -> Explanation:
    level = ts.level.name
    match result:
        case None:
            return Explanation(level, obligation)
        case NotReproducedError():
            return Explanation(
                level,
                obligation,
                beside=result.beside or (str(result),),
                guessed=result.guessed,
                undefined=result.undefined,
            )
        case Lasso():
            return Explanation(
                level, obligation, replace(of_trace(ts, obligation, result.trace), lasso=result.first)
            )
        case _:
            return Explanation(level, obligation, of_trace(ts, obligation, result))


def _together(
    systems: Mapping[str, TransitionSystem],
    level: str,
    wanted: tuple[Obligation, ...],
    settings: TraceSettings,
) -> Iterator[Explanation]:
    """Explain orders that are not numbered or not answered by runs of both levels."""
    links = systems[level].links
    records = {
        obligation.name.partition(".")[0]
        for obligation in wanted
        if obligation.sort in {Sort.NUMBERED, Sort.NEXT_NUMBER}
    }
    ends = [(level, neighbour.name) for neighbour in links.below if neighbour.order in records]
    if links.above is not None and any(obligation.sort is Sort.ECHOES for obligation in wanted):
        ends.append((links.above.name, level))
    for upper, lower in ends if settings.most else []:
        if upper in systems and lower in systems:
            below = next(neighbour for neighbour in systems[upper].links.below if neighbour.name == lower)
            result, follows = followed_together(
                systems[upper],
                systems[lower],
                below,
                TraceSearch(settings.most),
                settings.starts,
                settings.further,
            )
            if isinstance(result, Finding):
                yield Explanation(result.level, result.obligation, result, follows=follows or None)
            elif result is not None:
                yield Explanation(lower, wanted[0], beside=(str(result),), guessed=result.guessed)


def _endless(ts: TransitionSystem, proof: LevelProof, settings: TraceSettings) -> Iterator[Explanation]:
    """Explain each command that is not shown to end by a run after which it may go on for ever."""
    open_endings = {ending.table: ending for ending in proof.endings if not ending.proved}
    tables = list(open_endings)
    results: dict[str, Lasso | NotReproducedError] = {}
    for search in settings.searches(proof.level) if settings.most else ():
        results |= lassos(ts, [table for table in tables if table not in results], search)
    for table in tables:
        obligation = obligation_of(table)
        match results.get(table):
            case Lasso() as lasso:
                yield _explanation(ts, obligation, lasso)
            case other:
                found = _explanation(ts, obligation, other)
                supposed_lap = _supposed_lap(ts, table, proof) if other is None and settings.most else None
                yield replace(found, notes=open_endings[table].rounds, supposed=supposed_lap)


def _supposed_lap(ts: TransitionSystem, table: str, proof: LevelProof) -> Finding | None:
    """Find a lasso of the table's command from a state that the invariant leaves open; none longer than a few cycles is looked for."""
    search = TraceSearch(LONGEST_LAP, invariant=(proof.predicates, proof.clauses))
    lasso = lassos(ts, [table], search).get(table)
    obligation = obligation_of(table)
    if not isinstance(lasso, Lasso):
        return None
    return replace(of_trace(ts, obligation, lasso.trace), lasso=lasso.first)


@dataclass(slots=True)
class _Rerun:
    """Runs findings on executors, which are built once a level."""

    systems: Mapping[str, TransitionSystem]
    settings: TraceSettings
    folder: Path
    texts: Texts
    _ready: set[str] = field(default_factory=set)
    _names: set[str] = field(default_factory=set)

    def run(self, explanation: Explanation) -> Explanation:
        """Run a finding; return it with its log and suggested repairs."""
        finding = explanation.finding
        if finding is None:
            return explanation
        if not runs_on_executors(self.systems, finding):
            return explanation
        system = replace(self.settings.system, generated=self.folder / "generated")
        programs = {name: self.systems[name].program for name in finding.levels if name not in self._ready}
        make(programs.values(), system.generated, altered=self.settings.altered)
        self._ready |= programs.keys()
        name = self._named(finding)
        path = None if self.settings.log is None else self.folder / f"{name}.mcap"
        follows = explanation.follows or self._follows(finding)
        try:
            record(finding, self.systems, system, path, altered=self.settings.altered)
            for number, then in enumerate(follows or (), 1):
                kept = None if path is None else self.folder / f"{name}_then_{number}.mcap"
                record(then.run, self.systems, system, kept, altered=self.settings.altered)
        except ExecutorsDifferError as error:
            return replace(explanation, beside=error.beside)
        in_c = not only_in_python(finding, self.systems)
        suggested = explanation.helps or helps(self.systems[explanation.level], finding, self.texts)
        return replace(explanation, helps=suggested, log=path, in_c=in_c, follows=follows)

    def _follows(self, finding: Finding) -> tuple[Consequence, ...] | None:
        """Find the consequences of a finding of one level that has a superior."""
        ts = self.systems[finding.level]
        if not self.settings.further or ts.links.above is None or len(finding.levels) > 1:
            return None
        if finding.lasso and finding.obligation.sort is not Sort.ENDS:
            return None  # the superior takes nothing of it but what the run shows
        start = self.settings.starts.get(finding.level, {})
        search = TraceSearch(restarted=finding.restarted, legal=finding.legal, start=start)
        return consequences(ts, finding, search, self.settings.further)

    def _named(self, finding: Finding) -> str:
        name = file_name(finding)
        numbered = name
        for number in range(2, len(self._names) + 3):
            if numbered not in self._names:
                break
            numbered = f"{name}_{number}"
        self._names.add(numbered)
        return numbered


def runs_on_executors(systems: Mapping[str, TransitionSystem], finding: Finding) -> bool:
    """Return whether executors may run it: not where an invariant is broken on which the safety of an operation rests."""
    return finding.obligation.sort is not Sort.SAFE and all(
        invariant_kept(systems[name], invariant, step.before, step.before)
        for tick in finding.ticks
        for name, step in tick.items()
        for invariant in systems[name].safety.invariants
    )


def file_name(finding: Finding) -> str:
    """Return the name of a finding's log and case, without suffix."""
    obligation = finding.obligation
    parts = (
        finding.level,
        obligation.table,
        obligation.sort.name.lower(),
        obligation.name if obligation.name != obligation.table else "",
    )
    text = "_".join(part for part in parts if part)
    return "".join(letter if letter.isalnum() or letter == "_" else "_" for letter in text)

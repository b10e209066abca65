"""Slips that survive: an assignment, or all that a line does, is left out, and whatever was proved of the level still holds.

In: the proofs of a level. Out: a verdict on each `Slip`, and by which claims it is noticed. Cheapest first: what the slip leaves of the
invariant may still show everything; a run may break something; at last an invariant is searched, `MOST_SEARCHED` times at most. What is
neither shown nor broken is *open*, never a survivor.

Left out is one assignment of a procedure in all of its uses, one cell of a line, or all cells of a line. A slip that leaves every reachable
cycle as it is *changes nothing*: no requirement can notice it. Whether commands end is not asked again.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from rcsc.compose.contract.claims import ACCEPTED, Key
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.coverage.again import shown_again
from rcsc.compose.coverage.parts import How, Part, Use, of_program
from rcsc.compose.coverage.questions import Member, Questions, with_program
from rcsc.compose.coverage.tried import short_runs, tried
from rcsc.compose.proof.level import LevelProof
from rcsc.proof.solvers import smt

SHORT, LONGER = 4, 6
"""Cycles of the runs that are looked for, at first and of what is then left."""
TOGETHER = 200_000_000
"""Steps of Z3 for all slips of a level together, some minutes; later ones are open."""
MOST_SEARCHED = 4
"""Slips for which an invariant is searched: each may take as long as the proof of the level."""


class Fate(StrEnum):
    """What becomes of a slip."""

    SURVIVES = "survives"
    CHANGES_NOTHING = "changes nothing"
    NOTICED = "noticed"
    OPEN = "open"


@dataclass(frozen=True, slots=True)
class Slip:
    """What is left out.

    Attributes:
        uses: All of it.
        whole_line: Whether it is all that a line does.
    """

    uses: tuple[Use, ...]
    whole_line: bool


@dataclass(frozen=True, slots=True)
class Judged:
    """A slip with its verdict; `by`, the claims that were seen to notice it."""

    slip: Slip
    fate: Fate
    by: tuple[Key, ...] = ()


@dataclass(frozen=True, slots=True)
class Environment:
    """A level in one environment, with what is proved of it there and in none that allows more.

    Attributes:
        ts: The level, refusing inputs or not.
        proof: Its proof.
        keys: The claims.
    """

    ts: TransitionSystem
    proof: LevelProof
    keys: tuple[Key, ...]


def environments(ts: TransitionSystem, proof: LevelProof) -> tuple[Environment, ...]:
    """Return the environments in which claims about a level are proved: with refused inputs, where that suffices.

    What has to come eventually is proved of the level within its bound, which owes nothing else: such come last.
    """
    bounds = tuple(Environment(bound.level(ts), bound.proof, (bound.key,)) for bound in proof.bounds)
    apart = {bound.key for bound in proof.bounds}
    refusing, admitting = proof.parts or (proof, proof)
    first = _proved(refusing, apart)
    rest = _proved(admitting, {*first, *apart})
    both = (Environment(ts.refusing(), refusing, first), Environment(ts, admitting, rest))
    return tuple(one for one in (*both, *bounds) if one.keys)


def _proved(proof: LevelProof, apart: Collection[Key]) -> tuple[Key, ...]:
    return tuple(
        owed.key for owed, verdict in proof.verdicts if verdict in ACCEPTED and owed.key not in apart
    )


def slips_of(uses: Sequence[Use]) -> Iterator[Slip]:
    """Yield each slip: what every line does, then each assignment, in the order of the program."""
    by_line, by_part = dict[tuple[str, str], list[Use]](), dict[Part, list[Use]]()
    for use in uses:
        if use.part.stays:
            continue
        by_part.setdefault(use.part, []).append(use)
        if use.table:
            by_line.setdefault((use.table, use.line), []).append(use)
    yield from (Slip(tuple(every), whole_line=True) for every in by_line.values() if len(every) > 1)
    yield from (Slip(tuple(every), whole_line=False) for every in by_part.values())


def judged(places: Sequence[Environment]) -> list[Judged]:
    """Judge every slip of a level whose claims are proved in these environments.

    Assignments of procedures come first, then lines, then their cells, but for those of lines that may do nothing at all: they are told
    with them.
    """
    every = [_Asked(one, Questions(one.ts, one.proof, How.LEFT_OUT)) for one in places]
    slips = list(slips_of(list(every[0].asked.made.switches)))
    told = _Judge(every)
    with smt.together(TOGETHER):
        inside = told.of([one for one in slips if not one.whole_line and one.uses[0].part.procedure])
        lines = told.of([one for one in slips if one.whole_line])
        silent = {use for one in lines if one.fate is Fate.SURVIVES for use in one.slip.uses}
        cells = [one for one in slips if not one.whole_line and not one.uses[0].part.procedure]
        return [*inside, *lines, *told.of([one for one in cells if not silent.issuperset(one.uses)])]


@dataclass(frozen=True, slots=True)
class _Asked:
    """An environment with its questions."""

    place: Environment
    asked: Questions

    def on(self, slip: Slip) -> frozenset[Member]:
        """Return what is on."""
        return frozenset(self.asked.members).difference(slip.uses)


@dataclass(slots=True)
class _Judge:
    """Judges slips.

    Attributes:
        searched: For how many an invariant was searched.
    """

    every: Sequence[_Asked]
    searched: int = 0

    def of(self, slips: Sequence[Slip]) -> list[Judged]:
        """Judge slips, in order."""
        broken = self._short_runs(slips, SHORT)
        verdicts = {at: Judged(slips[at], Fate.NOTICED, (key,)) for at, key in broken.items()}
        for at, slip in enumerate(slips):
            if at not in verdicts and all(_kept(one, slip, one.place.keys) is not None for one in self.every):
                verdicts[at] = Judged(slip, self._survives(slip))
        left = [at for at in range(len(slips)) if at not in verdicts]
        longer = self._short_runs([slips[at] for at in left], LONGER)
        verdicts |= {left[at]: Judged(slips[left[at]], Fate.NOTICED, (key,)) for at, key in longer.items()}
        for at in left:
            if at not in verdicts:
                verdicts[at] = self._at_last(slips[at])
        return [verdicts[at] for at in range(len(slips))]

    def _short_runs(self, slips: Sequence[Slip], cycles: int) -> Mapping[int, Key]:
        """Find runs in which no input is refused: they are runs of every environment."""
        asked = self.every[0].asked
        ts = with_program(asked.ts, asked.made.program, asked.ts).admitting()
        keys = {key for one in self.every for key in one.place.keys}
        ts.refusable, ts.clamped, ts.trusted = asked.ts.refusable, asked.ts.clamped, asked.ts.trusted
        return short_runs(ts, asked.made, [slip.uses for slip in slips], keys, cycles) if slips else {}

    def _survives(self, slip: Slip) -> Fate:
        same = all(one.asked.changes_nothing(one.on(slip)) for one in self.every)
        return Fate.CHANGES_NOTHING if same else Fate.SURVIVES

    def _at_last(self, slip: Slip) -> Judged:
        """Look at all runs, where that is possible; search another invariant, as long as there are not too many to search."""
        runs = [tried(slipped(one.place, slip), one.place.keys, cycles=0) for one in self.every]
        if by := tuple(sorted({key for run in runs for key in run.broken})):
            return Judged(slip, Fate.NOTICED, by)
        if self.searched >= MOST_SEARCHED:
            return Judged(slip, Fate.OPEN)
        self.searched += 1
        shown = all(
            shown_again(
                slipped(one.place, slip),
                one.place.proof,
                one.asked.kept(one.on(slip), one.asked.clauses) or (),
                one.place.keys,
            )
            for one in self.every
        )
        return Judged(slip, self._survives(slip) if shown else Fate.OPEN)


def _kept(one: _Asked, slip: Slip, keys: Sequence[Key]) -> tuple[int, ...] | None:
    """Return the clauses that are left of the invariant, if they show these claims."""
    clauses = one.asked.kept(one.on(slip), one.asked.clauses)
    shows = clauses is not None and one.asked.follow(keys, one.on(slip), clauses)
    return clauses if shows else None


def slipped(place: Environment, slip: Slip) -> TransitionSystem:
    """Return the level with the slip."""
    program = of_program(place.ts.program, place.ts.level, How.LEFT_OUT, slip.uses)
    return with_program(place.ts, program, place.ts)

"""What is said of requirements across the levels of a drawn system, against all of its runs.

In: a seed. Out: the verdicts, counted, or an `AssertionError` that tells a difference. That a requirement holds and is not proved is
counted as open, and is no difference; nor is a system with more runs than are looked at.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.proof.system import prove_transition_systems, read_systems
from rcsc.compose.together.eventually import may_wait, waits_for
from rcsc.compose.together.product import Surroundings, Timing
from rcsc.compose.together.proof import SHORT, Across, Question
from rcsc.compose.together.words import stated_across
from rcsc.lang.model import Program
from rcsc.run.description import Description, description
from tests.across.judge.drawn import drawn, written
from tests.across.judge.truth import (
    MOST_TICKS,
    AnyTime,
    Befalls,
    Cycles,
    Runs,
    TooManyError,
    Truth,
    followed,
    truth,
)

KINDEST = Befalls(refuses=False, restarts=False)


@dataclass(slots=True)
class System:
    """A system that was read, with the cycles of its levels that were run."""

    systems: Mapping[str, TransitionSystem]
    description: Description
    program: Program
    cycles: Cycles = field(default_factory=dict)

    @classmethod
    def of(cls, path: Path) -> "System":
        """Read it."""
        systems, _ = read_systems(path)
        described = description(path)
        stated = stated_across(described, {name: ts.program for name, ts in systems.items()})
        assert stated is not None
        return cls(systems, described, stated[0])


def judged(seed: int, folder: Path, *, proofs: int = 1) -> list[str]:
    """Judge a drawn system; of one seed of so many its levels are proved alone, too, and what is known so is used.

    Raises:
        AssertionError: A verdict differs from what its runs do.
    """
    made = drawn(seed)
    it = System.of(written(made, folder))
    known = {}
    if seed % proofs == 0:
        whole = prove_transition_systems(dict(it.systems), None, 1, tuple(it.systems))
        known = {proof.level: proof for proof in whole.levels}
    verdicts = [f"with {part}" for part in made.parts] + [f"levels proved: {bool(known)}"]
    for stated in it.program.properties:
        found = Question(it.systems, it.description, it.program, stated, known).answer()
        try:
            verdicts += Held(it, found).verdicts()
        except AssertionError as error:
            message = f"{stated.text}: {error}"
            raise AssertionError(message) from error
        except TooManyError:
            verdicts.append("too many runs")
    return verdicts


@dataclass(slots=True)
class Held:
    """An answer that is held against all runs, if they take no more than so many ticks."""

    it: System
    found: Across
    most: int = MOST_TICKS
    known: dict[Befalls, Truth] = field(default_factory=dict)

    def truth(self, befalls: Befalls) -> Truth:
        """Return what is true where this may befall the levels."""
        if befalls not in self.known:
            self.known[befalls] = truth(self.runs(befalls), self.most)
        return self.known[befalls]

    def runs(self, befalls: Befalls, made: Callable[..., Runs] = Runs, names: tuple[str, ...] = ()) -> Runs:
        """Return the runs of the levels on which it depends, or of these."""
        it = self.it
        return made(it.systems, it.description, it.program, self.found.stated, befalls, it.cycles, names)

    @property
    def hardest(self) -> Befalls:
        """All that may befall the levels; of what comes at no time that is said, as they are scheduled."""
        return Befalls(late=0 if may_wait(self.found.stated) else self.it.description.late_ticks)

    def verdicts(self) -> list[str]:
        """Return its verdicts in words. Raises AssertionError: Something differs. TooManyError: There are too many runs."""
        found, true = self.found, self.truth(self.hardest)
        told = [f"proved {found.timing.value}"] if found.proved else []
        if found.proved:
            self._proved()
        if found.run:
            self._shown()
        if found.lasso:
            assert true.waits is None or true.least > SHORT, f"waits for ever: {true}"
            told.append("waits for ever")
        elif found.run:
            self._shortest(len(found.run), true)
            told.append("refuted" if found.refuted else "refuted in harder surroundings")
        else:
            assert not 0 < true.least <= max(found.looked, SHORT), f"a run of {true.least} ticks is not found"
        if not told:
            told.append("open" if true.waits is not None and not true.least else "open, and a run breaks it")
        if found.vacuous:
            assert not self.truth(KINDEST).asks, "something asks for it"
            told.append("vacuous")
        return told

    def _shown(self) -> None:
        """Hold the run that is shown against those that there are: each tick may leave what it leaves."""
        found = self.found
        assert found.broken_in is not None
        runs = self.runs(of(found.broken_in, self.hardest.late if any(found.run_late) else 0))
        assert found.proved or list(found.levels) == runs.names, f"a run of {found.levels}, not {runs.names}"
        here = followed(runs, ({name: step.after for name, step in tick.items()} for tick in found.run))
        assert here, "the run that is shown is none"
        assert found.lasso or any(here.values()), "the run that is shown breaks nothing"

    def _shortest(self, ticks: int, true: Truth) -> None:
        broken_in = self.found.broken_in
        assert broken_in is not None
        assert true.least == ticks, f"broken in tick {ticks}: {true}"
        least = self.truth(of(broken_in, self.hardest.late)).least
        assert least == ticks, f"broken in tick {ticks} in {broken_in}: {least}"
        if any(self.found.run_late) and broken_in.restarts:
            calmer = self.truth(of(replace(broken_in, restarts=False), self.hardest.late)).least
            assert calmer != ticks, f"a run as long needs no restart, as {broken_in} has"

    def _proved(self) -> None:
        found = self.found
        late = 0 if found.timing is Timing.SCHEDULED else self.hardest.late
        true = self.truth(of(found.around, late))
        assert not true.least, f"proved {found.timing.value} in {found.around}: {true}"
        assert true.waits is not None, f"proved, {found.by}: {true}"
        if "calm" in found.by:
            bounds = [most for most in range(true.waits) if found.by == waits_for(most, fair=False)]
            assert not bounds, f"{found.by}: {true.waits}"
        links = [self.it.systems[name].links for name in found.levels]
        if found.timing is Timing.ANY and not any(one.above or one.below for one in links):
            least = truth(self.runs(of(found.around, 0), AnyTime, found.levels), self.most).least
            assert not least, f"proved under any timing in {found.around}: {least}"


def of(around: Surroundings, late: int) -> Befalls:
    """Return what may befall levels in these surroundings."""
    return Befalls(around.refuses, around.restarts, late)

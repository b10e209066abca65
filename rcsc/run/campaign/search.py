"""Episodes by Hypothesis: a strategy, and a search for one in which a property is false or the executors differ.

In: a system and its kind of episodes. Out: the first such episode, or how much was tried. Hypothesis draws each order, fault, tick, part
and place. Needs the package `hypothesis`; the same examples every time.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic

from rcsc.run.campaign.choose import kind_of, plant_name, plant_of
from rcsc.run.campaign.rig import E, Rig
from rcsc.run.campaign.shrink import shrink
from rcsc.run.campaign.work import attempt
from rcsc.run.description import description
from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

REPEATS = "the plant does the same again"
REPEATED = 5
"""Of so many episodes one is run twice."""
SEEDS = 1 << 16


def episodes(system: str | Path, plant: str | None = None) -> "SearchStrategy[Any]":
    """Return episodes of a system, for tests of one's own: `@given(episodes("system.toml"))`.

    Args:
        system: The description, compiled.
        plant: What stands outside, as `--plant` names it; None for the one that `rcsc campaign` takes.
    """
    described = description(Path(system))
    spec = plant_of(described, plant)
    return strategy(Rig(kind_of(described, spec), Path(system), plant_name(spec)))


def strategy(rig: Rig[E]) -> "SearchStrategy[E]":
    """Return the episodes of a rig, drawn choice by choice, so that what fails shrinks to what a person reads."""
    from hypothesis import strategies as st

    @st.composite
    def drawn(draw: st.DrawFn) -> E:
        random = draw(st.randoms(use_true_random=False))
        return rig.drawn(random, random.randrange(SEEDS))

    return drawn()


def _silent(_: int) -> None:
    """Tell nobody."""


@dataclass(slots=True)
class Searched(Generic[E]):
    """What was tried.

    Attributes:
        excused: Episodes in which a fault explains what did not hold.
        falsified: The episode in which a property is false, and which.
    """

    episodes: int = 0
    cycles: int = 0
    excused: int = 0
    lines: set[tuple[str, str, str]] = field(default_factory=set)
    falsified: tuple[E, EpisodeFinding] | None = None


class _FalsifiedError(Exception):
    """Ends Hypothesis's search."""


def search(rig: Rig[E], examples: int, doing: Callable[[int], None] = _silent) -> Searched[E]:
    """Run drawn episodes until a property is false; what an episode raises is false, too.

    Args:
        rig: On what; with the executor `both` the C and the Python must do the same.
        examples: How many at most.
        doing: Told the number of each before it runs.

    Raises:
        ModuleNotFoundError: Hypothesis is not installed.
        CodedError: The system or its plant is not in order.
    """
    from hypothesis import HealthCheck, Phase, given, settings

    searched = Searched[E]()

    @settings(
        max_examples=examples, derandomize=True, deadline=None, database=None, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck), report_multiple_bugs=False,
    )  # fmt: skip
    @given(strategy(rig))
    def holds(episode: E) -> None:
        if searched.falsified is not None:
            raise _FalsifiedError  # Hypothesis asks again what failed
        searched.episodes += 1
        doing(searched.episodes)
        outcome = attempt(rig, episode)
        searched.cycles += outcome.ticks
        searched.excused += bool(outcome.excused)
        searched.lines |= outcome.lines
        finding = next(iter(outcome.findings), None)
        if finding is None and searched.episodes % REPEATED == 1:
            finding = _repeats(rig, episode, outcome)
        if finding is not None:
            searched.falsified = episode, finding
            raise _FalsifiedError

    with contextlib.suppress(_FalsifiedError):
        holds()
    return searched


def _repeats(rig: Rig[E], episode: E, outcome: EpisodeOutcome) -> EpisodeFinding | None:
    """Return where an episode does otherwise the second time."""
    return None if rig.run(episode, None).digest == outcome.digest else otherwise(rig, episode)


def otherwise(rig: Rig[E], episode: E) -> EpisodeFinding | None:
    """Return the first value that differs between two runs of an episode."""
    one, two = rig.loop(episode), rig.loop(episode)
    while not (one.over or two.over):
        one.step()
        two.step()
        for was, now in zip(one.system.levels, two.system.levels, strict=True):
            names = (*(leaf.name for leaf in was.sign.leaves), *was.sign.trace)
            for leaf, a, b in zip(names, was.values, now.values, strict=True):
                if repr(a) != repr(b):
                    text = f"`{was.name}.{leaf}` is {a!r}, and {b!r} in the same episode again"
                    return EpisodeFinding(REPEATS, one.system.tick, text)
    return None


def smallest(
    rig: Rig[E], episode: E, finding: EpisodeFinding, doing: Callable[[int], None] = _silent
) -> tuple[E, EpisodeFinding]:
    """Return the smallest episode nearby that breaks the same property, and how it does.

    Args:
        rig: On what.
        episode: It breaks the property.
        finding: How.
        doing: Told the number of each try.
    """
    found, tries = {episode: finding}, 0

    def fails(simpler: E) -> bool:
        nonlocal tries
        tries += 1
        doing(tries)
        again = found_again(rig, simpler, finding.property)
        if again is not None:
            found[simpler] = again
        return again is not None

    least = shrink(episode, fails)
    return least, found[least]


def found_again(rig: Rig[E], episode: E, name: str) -> EpisodeFinding | None:
    """Return the finding of a property in an episode; None for nothing, and of an episode that is none of the system's."""
    if name == REPEATS:
        with contextlib.suppress(ValueError):
            return otherwise(rig, episode)
        return None
    return next((finding for finding in attempt(rig, episode).findings if finding.property == name), None)

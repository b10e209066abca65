"""Episodes by Hypothesis: a strategy, and a search for one in which a property is false or the executors differ.

In: a system. Out: the first such episode, or how much was tried. Needs the package `hypothesis`; the same examples every time.
"""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.run.episodes.episode import Episode
from rcsc.run.episodes.loop import Loop
from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome
from rcsc.run.episodes.sampling import draw_on
from rcsc.run.episodes.stand import Stand, stand
from rcsc.run.system import Kind

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

AGREE = "C and Python do the same"
REPEATS = "the plant does the same again"
KINDS: tuple[Kind, ...] = ("c", "python")


def episodes(system: str | Path, plant: str = "") -> "SearchStrategy[Episode]":
    """Return episodes of a system, for tests of one's own: `@given(episodes("system.toml"))`.

    Args:
        system: The description, compiled.
        plant: What stands outside, as `--plant` names it; empty for the description's first.
    """
    return _strategy(stand(Path(system)), plant)


def _strategy(its: Stand, plant: str) -> "SearchStrategy[Episode]":
    """Return episodes by their seeds; what fails is shrunk by its orders and faults (`rcsc.run.campaign.shrink`), not by its seed."""
    from hypothesis import strategies as st

    return st.integers(0, 2**63 - 1).map(lambda seed: draw_on(its, seed, plant))


@dataclass(slots=True)
class Searched:
    """What was tried.

    Attributes:
        excused: Episodes in which a fault explains what did not hold.
        falsified: The episode in which a property is false, and which.
    """

    episodes: int = 0
    cycles: int = 0
    excused: int = 0
    lines: set[tuple[str, str, str]] = field(default_factory=set)
    falsified: tuple[Episode, EpisodeFinding] | None = None


class _FalsifiedError(Exception):
    """Ends Hypothesis's search."""


def search(its: Stand, examples: int, plant: str = "", kinds: Sequence[Kind] = KINDS) -> Searched:
    """Run drawn episodes until a property is false.

    Args:
        its: The system.
        examples: How many at most.
        plant: What stands outside.
        kinds: Executors; of several all must do the same.

    Raises:
        ModuleNotFoundError: Hypothesis is not installed.
        CodedError: The system or its plant is not in order.
    """
    from hypothesis import HealthCheck, Phase, given, settings

    searched = Searched()

    @settings(
        max_examples=examples, derandomize=True, deadline=None, database=None, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck), report_multiple_bugs=False,
    )  # fmt: skip
    @given(_strategy(its, plant))
    def holds(episode: Episode) -> None:
        outcome = Loop(replace(episode, executor=kinds[0]), its).finish()
        searched.episodes, searched.cycles = searched.episodes + 1, searched.cycles + outcome.ticks
        searched.excused += bool(outcome.excused)
        searched.lines |= outcome.lines
        finding = next(iter(outcome.findings), None) or _differs(episode, its, kinds, outcome)
        if finding is not None:
            searched.falsified = replace(episode, executor=kinds[0]), finding
            raise _FalsifiedError

    with contextlib.suppress(_FalsifiedError):
        holds()
    return searched


def _differs(
    episode: Episode, its: Stand, kinds: Sequence[Kind], outcome: EpisodeOutcome
) -> EpisodeFinding | None:
    """Where another executor does otherwise, or the same one the second time."""
    for kind in kinds[1:]:
        other = Loop(replace(episode, executor=kind), its).finish()
        if other.digest != outcome.digest:
            return disagreement(episode, its, kinds[0], kind)
    return None


def disagreement(episode: Episode, its: Stand, first: Kind, second: Kind) -> EpisodeFinding | None:
    """Return the first value that differs between two kinds of executors; if one kind alone does not repeat itself, that of the plant."""
    for other, name in ((first, REPEATS), (second, AGREE)):
        one, two = (Loop(replace(episode, executor=kind), its) for kind in (first, other))
        while not (one.over or two.over):
            one.step()
            two.step()
            for was, now in zip(one.system.levels, two.system.levels, strict=True):
                names = (*(leaf.name for leaf in was.sign.leaves), *was.sign.trace)
                for leaf, a, b in zip(names, was.values, now.values, strict=True):
                    if repr(a) != repr(b):
                        text = f"`{was.name}.{leaf}` is {a!r} with {first} and {b!r} with {other}"
                        return EpisodeFinding(name, one.system.tick, text)
    return None


def found_again(
    episode: Episode, its: Stand, name: str, kinds: Sequence[Kind] = KINDS
) -> EpisodeFinding | None:
    """Return the finding of a property in an episode; None for nothing, and of an episode that is none of the system's."""
    with contextlib.suppress(ValueError):
        if name in (AGREE, REPEATS):
            found = disagreement(episode, its, kinds[0], kinds[-1])
            return found if found is not None and found.property == name else None
        outcome = Loop(episode, its).finish()
        return next((finding for finding in outcome.findings if finding.property == name), None)
    return None

"""Slips in drawn systems, each alone: whether a requirement that was proved tells them.

In: a seed. Out: what became of each mutant: *told*, a requirement that was proved of the system is refuted of the mutant by a run;
*equivalent*, each that was proved holds of the mutant in the same surroundings, as all of its runs show; *missed*, a run breaks one, and
none is found; *too many runs* to say. Only of requirements is asked whose system itself has few enough.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations
from pathlib import Path

from rcsc.compose.proof.system import NoProgramError
from rcsc.compose.together.product import Timing
from rcsc.compose.together.proof import Across, Question
from rcsc.run.description import BadDescription
from tests.across.judge.drawn import Drawn, drawn, written
from tests.across.judge.held import Held, System, of
from tests.across.judge.truth import TooManyError

MOST = 200_000
"""Ticks that are looked at of a mutant."""
TOLD, EQUIVALENT, MISSED, TOO_MANY = "told", "equivalent", "missed", "too many runs"


def slips(made: Drawn) -> Iterator[tuple[str, Drawn]]:
    """Yield the mutants of a system, each with what was done to it."""
    wires = [(source, end) for source, readers in made.wires.items() for end in readers]
    between = [wire for wire in wires if wire[0].partition(".")[0] in made.levels]
    for wire in between:
        yield "wire cut", _with(made, [one for one in wires if one != wire])
        yield (
            "output to nobody",
            _with(
                made, [(f"plant.{one[1].replace('.', '_')}", one[1]) if one == wire else one for one in wires]
            ),
        )
    for one, two in combinations(wires, 2):
        if one[0] != two[0]:
            swapped = {one: (one[0], two[1]), two: (two[0], one[1])}
            yield "two wires swapped", _with(made, [swapped.get(wire, wire) for wire in wires])
    for first, second in combinations(made.levels, 2):
        programs = {**made.levels, first: made.levels[second], second: made.levels[first]}
        if programs != made.levels:
            other = {first: second, second: first}
            yield (
                "two levels swapped",
                _with(made, [(_renamed(a, other), _renamed(b, other)) for a, b in wires]),
            )
    for name in {*made.levels.values()}:
        text = made.texts[f"{name}.rcs"]
        period = int(text.partition("{ period ")[2].partition(" ")[0])
        slow = text.replace(f"{{ period {period} ", f"{{ period {2 * period} ")
        yield "period doubled", replace(made, texts={**made.texts, f"{name}.rcs": slow})
    lines = made.texts["requirements.rcs"].splitlines()
    for at, line in enumerate(lines):
        for first, second in combinations(made.levels, 2):
            if f"{first}." in line and not line.startswith("assume"):
                changed = (
                    line.replace(f"{first}.", "OTHER.")
                    .replace(f"{second}.", f"{first}.")
                    .replace("OTHER.", f"{second}.")
                )
                texts = {
                    **made.texts,
                    "requirements.rcs": "\n".join([*lines[:at], changed, *lines[at + 1 :], ""]),
                }
                yield "a requirement's levels exchanged", replace(made, texts=texts)


def _with(made: Drawn, wires: list[tuple[str, str]]) -> Drawn:
    every: dict[str, list[str]] = {}
    for source, end in wires:
        every.setdefault(source, []).append(end)
    return replace(made, wires=every)


def _renamed(end: str, other: Mapping[str, str]) -> str:
    party, _, variable = end.partition(".")
    return f"{other.get(party, party)}.{variable}"


def judged(seed: int, folder: Path) -> list[str]:
    """Judge the mutants of a drawn system; return what became of each.

    Raises:
        AssertionError: A verdict on a mutant differs from what its runs do.
    """
    made, told = drawn(seed), list[str]()
    (folder / "made").mkdir()
    it, answers = _answers(made, folder / "made")
    proved = {name: found for name, found in answers.items() if found.proved and _known(Held(it, found))}
    for number, (what, mutant) in enumerate(slips(made) if proved else ()):
        (folder / str(number)).mkdir()
        try:
            it, found = _answers(mutant, folder / str(number))
        except (BadDescription, NoProgramError):
            continue  # types tell it
        became = {
            _became(before, Held(it, found[name], MOST)) for name, before in proved.items() if name in found
        }
        told.append(f"{what}: {next(one for one in (MISSED, TOLD, TOO_MANY, EQUIVALENT) if one in became)}")
    return told


def _answers(made: Drawn, folder: Path) -> tuple[System, dict[str, Across]]:
    it = System.of(written(made, folder))
    asked = {one.name: Question(it.systems, it.description, it.program, one) for one in it.program.properties}
    return it, {name: question.answer() for name, question in asked.items()}


def _known(held: Held) -> bool:
    """Return whether all runs of the system itself are looked at: of one that has too many nothing is asked of its mutants."""
    try:
        held.verdicts()
    except TooManyError:
        return False
    return True


def _became(before: Across, held: Held) -> str:
    """Return what became of a requirement that was proved."""
    late = 0 if before.timing is Timing.SCHEDULED else held.hardest.late
    found = held.found
    try:
        held.verdicts()
        true = held.truth(of(before.around, late))
    except TooManyError:
        return TOLD if found.refuted else TOO_MANY
    if not true.least and true.waits is not None:
        return EQUIVALENT
    return TOLD if found.run else MISSED

"""What `rcsc prove` says of lines in their context, of how commands end, and of the system as a whole."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rcsc.compose.ends import Ending
    from rcsc.compose.level import LevelProof
    from rcsc.compose.rounds import Counted
    from rcsc.compose.system import SystemProof
    from rcsc.compose.transition import Stepper


def in_context(proof: "LevelProof") -> Iterator[str]:
    """Of one level, line by line; nothing where something is not proved."""
    seen = proof.context
    if seen is None:
        return
    lines = ", ".join(f"{table} {line}" for table, line in seen.unreached)
    yield f"lines never reached here: {lines or 'none'}"
    again = "; ".join(f"{one.table} {one.line}: {', '.join(one.leaves)}" for one in seen.repeated)
    yield f"what a line does when it matches again before its order is echoed: {again or 'nothing'}"
    if seen.restless:
        yield "order after order may be given on inputs that stay the same"
    if proof.endings:
        yield "given that every order that is not replaced is answered some time, and stays so,"
        yield from (f"  {one.table} {_ends(one)}" for one in proof.endings)


def _ends(one: "Ending") -> str:
    if one.changes is None:
        return "is not shown to end: its states may go round"
    changes = "one change" if one.changes == 1 else f"{one.changes} changes"
    said = f"ends after at most {changes} of state"
    if one.endless:
        lines = ", ".join(f"`{line}`" for line in one.endless)
        return f"is not shown to end: {'line' if len(one.endless) == 1 else 'lines'} {lines} may run for ever"
    if one.counted:
        said += "; meanwhile " + ", ".join(map(_counted, one.counted))
    if one.still:
        said += "; if the values in {} stand still".format(", ".join(f"`{name}`" for name in one.still))
    return said


def _counted(one: "Counted") -> str:
    by = "" if one.least is None else f" by at least {one.least:.2g}"
    return f"line `{one.line}` runs as long as `{one.counter}` rises{by}"


def assumptions(proof: "SystemProof") -> str:
    """How many there are, and how they stand."""
    from rcsc.compose.goals import Sort
    from rcsc.compose.level import Verdict

    verdicts = [
        verdict for one in proof.levels for goal, verdict in one.found if goal.sort is Sort.ASSUMPTION
    ]
    good = sum(verdict is Verdict.PROVED for verdict in verdicts)
    if not verdicts:
        return "the tables assume nothing"
    rest = len(verdicts) - good
    return f"assumptions of tables: {good} proved" + (f", {rest} not proved" if rest else ", none left")


def reaction(made: "Mapping[str, Stepper]", proof: "SystemProof") -> Iterator[str]:
    """The way of a PAUSE from the top down, as far as it is proved that it is passed on at once."""
    from rcsc.compose.goals import Sort
    from rcsc.compose.level import Verdict

    passes = {
        (one.level, goal.name): verdict
        for one in proof.levels
        for goal, verdict in one.found
        if goal.sort is Sort.PAUSES
    }
    tops = [
        name
        for name, one in made.items()
        if one.links.above is not None and one.links.above.outside and one.links.below
    ]
    for top in tops if {one.level for one in proof.levels} == set(made) else ():
        reached: dict[str, int] = {top: 1}
        for name in made:
            for below in made[name].links.below if name in reached else ():
                if passes.get((name, below.order)) is Verdict.PROVED:
                    reached[below.name] = reached[name] + 1
        lowest = {name: cycles - 1 for name, cycles in reached.items() if name != top}
        if lowest:
            said = ", ".join(f"of `{name}` in {cycles}" for name, cycles in lowest.items())
            yield f"a PAUSE of `{top}` is ordered {said} cycles of levels, besides what buffers take"


def confirmed(stepper: "Stepper", proof: "LevelProof") -> "dict[str, bool]":
    """Each question of the certificate, and whether cvc5 refutes it within two minutes."""
    from rcsc.compose.level import certificate
    from rcsc.smtlib import CVC5_STEPS, cvc5_refutes

    return {
        name: cvc5_refutes(text, steps=6 * CVC5_STEPS) for name, text in certificate(stepper, proof).items()
    }


def as_json(proof: "LevelProof") -> dict[str, Any]:
    """Context and endings of one level."""
    from dataclasses import asdict

    return {
        "context": None if proof.context is None else asdict(proof.context),
        "endings": [{**asdict(one), "proved": one.proved} for one in proof.endings],
    }

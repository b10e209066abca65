"""What `rcsc prove` says of lines in their context, of how commands end, and of the system as a whole."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from operator import attrgetter
from typing import Any

import click

from rcsc.base.diagnostics import report
from rcsc.code.testing.figures import counted
from rcsc.compose.contract.claims import (
    AGAIN,
    DECLARED,
    ENDING,
    IN_RANGE,
    RUNS,
    UNREACHED,
    Closed,
    Key,
    Need,
    Trust,
    declared,
    of_refusals,
    spelled,
    trust_of,
)
from rcsc.compose.contract.obligations import Sort, pause_of
from rcsc.compose.contract.transition import Leaves, TransitionSystem
from rcsc.compose.proof.assume_guarantee import not_for_ever
from rcsc.compose.proof.context import Context
from rcsc.compose.proof.level import LevelProof, certificate
from rcsc.compose.proof.notices import condition_of
from rcsc.compose.proof.ranking import RisingLine
from rcsc.compose.proof.system import SystemProof
from rcsc.compose.proof.termination import Ending
from rcsc.lang.model import WATCHED
from rcsc.proof.solvers.smtlib import CVC5_STEPS, cvc5_refutes


def standing(whole: SystemProof, level: str, key: Key) -> str:
    """Return the verdict of a claim in words: `proved`, the unproved claims that it rests on, or its own verdict."""
    closed = whole.of(level, key)
    if closed.proved:
        if closed.verdict.value != "proved":
            return f"{closed.verdict.value}, as the tables declare it"
        return f"proved{trusting(whole, level, [key])}"
    return closed.verdict.value if not closed.accepted else f"rests on {named(whole, level, closed.lacks)}"


def trusting(whole: SystemProof, level: str, keys: Sequence[Key]) -> str:
    """Return the assumptions that these verdicts trust, as the tables declare them; empty for none."""
    return report.trusting(declared(trust for key in keys for trust in whole.of(level, key).trusts))


def named(whole: SystemProof, level: str, needs: Sequence[Need]) -> str:
    """Return claims in words; for a level that was not looked at, only the level."""
    looked_at = {proof.level for proof in whole.levels}
    others = dict.fromkeys(owner for owner, _ in needs if owner not in looked_at)
    claims = [spelled(need, level, whole.closed) for need in needs if need[0] in looked_at]
    return report.named([*(f"level `{other}`, which was not looked at" for other in others), *claims])


def not_looked_at(proof: LevelProof) -> Iterator[str]:
    """Yield obligations that could not be stated, and those that do not apply."""
    for unstated in proof.unstated:
        yield f"{'not looked at' if unstated.applies else 'does not apply'}: {unstated.shown}"


def in_context(ts: TransitionSystem, whole: SystemProof, proof: LevelProof) -> Iterator[str]:
    """Describe a level in its context, line by line."""
    seen = proof.context
    if seen is None:
        yield "not looked at, as something is not proved: lines never reached, what lines do when they match again, whether commands end"
        return
    never = [(" ".join(at), standing(whole, proof.level, (UNREACHED, *at))) for at in seen.unreached]
    good = ", ".join(name for name, verdict in never if verdict == "proved")
    yield f"lines never reached here: {good or ('none' if not never else '')}".rstrip()
    yield from (f"  {name}: {verdict}" for name, verdict in never if verdict != "proved")
    if seen.unsure:
        yield f"not shown whether reached: {', '.join(' '.join(at) for at in seen.unsure)}"
    yield from (
        f"stays for ever once it is so: {condition_of(trap)}"
        + (f", as `{trap.stated}` says" if trap.stated else "")
        for trap in seen.traps
    )
    if seen.orders:
        yield from _again(whole, proof.level, seen)
    if proof.endings:
        in_time = [below.name for below in ts.links.below if below.answers_in_time]
        late = (
            f" (of `{'`, `'.join(in_time)}`, which fails if it is late: every order to rest)"
            if in_time
            else ""
        )
        still = f" and that {not_for_ever(ts)}," if ts.refusable else ""
        yield f"given that every order that is not replaced is answered some time{late}, and stays so,{still}"
        for ending in proof.endings:
            closed = whole.of(proof.level, (Sort.ENDS, ending.table, ""))
            only = (
                f"; rests on {named(whole, proof.level, closed.lacks)}"
                if ending.proved and closed.lacks
                else ""
            )
            trusts = report.trusting(_over_time(whole, closed)) if ending.proved and not only else ""
            yield f"  {ending.table} {_ends(ending)}{only}{trusts}"


def _over_time(whole: SystemProof, closed: Closed) -> list[str]:
    """List the assumptions over time that a claim trusts."""
    said = [(trust, *trust_of(trust)) for trust in closed.trusts]
    return [
        trust.removesuffix(DECLARED)
        for trust, kind, level, name in said
        if kind == Trust.DECLARED.name and (level, (Sort.KEPT, "", name)) in whole.closed
    ]


def _again(whole: SystemProof, level: str, seen: Context) -> Iterator[str]:
    """Yield the effects of lines that match again; nothing for a level that gives no orders."""
    again = "; ".join(
        f"{repeated_line.table} {repeated_line.line}: {', '.join(repeated_line.leaves)}"
        for repeated_line in seen.repeated
    )
    rests = "" if seen.repeated or seen.restless else standing(whole, level, (AGAIN, "", ""))
    only = f" ({rests})" if rests not in {"", "proved"} else ""
    yield f"effects of lines that match again before their order is echoed: {again or 'none'}{only}"
    if seen.restless:
        yield "order after order may be given on inputs that stay the same"


def trusted(whole: SystemProof) -> Iterator[str]:
    """Yield the assumptions for which no level is responsible."""
    every = sorted({trust for closed in whole.closed.values() for trust in closed.trusts})
    if every:
        yield "taken for granted"
        yield from (f"  {trust}" for trust in every)


@dataclass(frozen=True, slots=True)
class Summary:
    """The result of a system's proof in one line.

    Attributes:
        claims: How many there are, agreements between levels counted; `proved`, how many of them are, and `open`, how many are not.
        trusting: How many of those proved trust that inputs are not refused, and the same in words.
        lacks: What else is not shown, kind by kind. This, and what trusts, ends with status 1 under `--strict` alone.
        across: How many requirements across levels there are; `across_open`, how many of them are not proved.
    """

    claims: int
    proved: int
    open: int
    trusting: int
    trusted: str
    lacks: tuple[str, ...]
    across: int = 0
    across_open: int = 0

    def status(self, *, strict: bool) -> int:
        """Return the exit status."""
        return 1 if self.open or self.across_open or (strict and (self.lacks or self.trusting)) else 0

    def line(self, *, strict: bool) -> str:
        """Return the verdict, with its colour."""
        many = counted(self.proved, "claim")
        if self.across:
            many = f"{counted(self.across, 'requirement')} across levels, {many}"
        if self.trusting:
            many += f", {self.trusting} of them trusting that {self.trusted}"
        rest = ", ".join(self.lacks)
        if self.open or self.across_open:
            across = f"{self.across_open} of {counted(self.across, 'requirement')} across levels"
            claims = f"{self.open} of {counted(self.claims, 'claim')}"
            text = f"not proved: {', '.join([across] * bool(self.across_open) + [claims] * bool(self.open))}"
            return click.style(text, fg="red", bold=True) + (f"; also {rest}" if rest else "")
        status = f": status {'1' if strict else '0, and 1 with --strict'}" if rest or self.trusting else ""
        if not rest:
            return click.style(f"proved: {many}", fg="green", bold=True) + status
        return click.style(f"proved in part: {many}", fg="yellow", bold=True) + f"; but {rest}{status}"


def _trusted(whole: SystemProof) -> str:
    """Return in short what claims trust of inputs."""
    clamped = [trust.endswith(IN_RANGE) for trust in whole.admitting]
    if all(clamped):
        return "inputs are in range at a restart"
    return f"inputs are not refused{' or out of range' if any(clamped) else ''}"


def summary(whole: SystemProof, across: tuple[int, int, tuple[str, ...]] = (0, 0, ())) -> Summary:
    """Count the proved and the unproved claims of a system.

    Args:
        whole: Its proof.
        across: How many requirements across levels there are, how many of them are not proved, and what else is not shown of them.
    """
    claims = [(level.level, obligation.key) for level in whole.levels for obligation, _ in level.verdicts]
    still_open = sum(len(level.open) for level in whole.levels)
    not_agreed = sum(not agreement.holds for agreement in whole.agreements)
    proved = sum(whole.of(*need).proved for need in claims) + len(whole.agreements) - not_agreed
    trusting_ = sum(
        closed.proved and any(map(of_refusals, closed.trusts))
        for need, closed in whole.closed.items()
        if need in claims
    )
    return Summary(
        len(claims) + len(whole.agreements),
        proved,
        still_open + not_agreed,
        trusting_,
        _trusted(whole),
        (*across[2], *_lacking(whole)),
        *across[:2],
    )


def _lacking(whole: SystemProof) -> Iterator[str]:
    contexts = [level.context for level in whole.levels if level.context is not None]
    counts = {
        "not looked at": sum(missing.applies for level in whole.levels for missing in level.unstated),
        "trusting a schedule": sum(len(level.together) for level in whole.levels),
        "resting on unproved ones": sum(map(len, _resting(whole).values())),
        "not shown to end": sum(not ending.proved for level in whole.levels for ending in level.endings),
        "never reached": sum(len(seen.unreached) for seen in contexts),
        "never left": sum(not trap.stated for seen in contexts for trap in seen.traps),
        "that never asks": sum(len(seen.vacuous) for seen in contexts),
    }
    nouns = {
        "not shown to end": "command",
        "never reached": "line",
        "never left": "state",
        "that never asks": "requirement",
    }
    return (f"{counted(many, nouns.get(what, 'claim'))} {what}" for what, many in counts.items() if many)


def left_out(whole: SystemProof) -> Iterator[str]:
    """Yield the claims that rest on unproved ones, with those."""
    resting = _resting(whole) if whole.proved else {}
    if resting:
        yield "resting on unproved ones"
    for lacks, claims in resting.items():
        yield f"  {report.named(claims)}: {'rests' if len(claims) == 1 else 'rest'} on {lacks}"


def _resting(whole: SystemProof) -> dict[str, list[str]]:
    """Group claims by the unproved ones that they rest on; those of a whole level say no more than each of its own."""
    looked_at = {proof.level for proof in whole.levels}
    resting: dict[str, list[str]] = {}
    for (level, key), closed in whole.closed.items():
        if level in looked_at and key not in {ENDING, RUNS} and closed.accepted and not closed.proved:
            resting.setdefault(named(whole, "", closed.lacks), []).append(spelled((level, key), ""))
    return resting


def _ends(ending: Ending) -> str:
    if ending.changes is None:
        return f"is not shown to end: {'; '.join(ending.rounds)}"
    changes = "one change" if ending.changes == 1 else f"{ending.changes} changes"
    text = f"ends, once taken, after at most {changes} of state"
    if ending.endless:
        return f"is not shown to end: {'; '.join(ending.rounds)}"
    if ending.counted:
        by_line = groupby(ending.counted, key=attrgetter("line"))
        text += "; meanwhile " + ", ".join(_counted(line, tuple(counters)) for line, counters in by_line)
    if ending.still:
        text += "; if the values in {} stand still".format(", ".join(f"`{name}`" for name in ending.still))
    return text


def _counted(line: str, counters: Sequence[RisingLine]) -> str:
    """Describe the counter of a line: the first counter moves, or it stays and the next one does."""
    return f"line `{line}` runs as long as {', or stays and '.join(map(_moves, counters))}"


def _moves(rising: RisingLine) -> str:
    by = "" if rising.least is None else f" by at least {rising.least:.2g}"
    counter = f"`{rising.counter}`"
    if rising.counter.startswith(WATCHED):
        counter = f"the time of assumption `{rising.counter.split()[1]}`"
    return f"{counter} {'falls' if rising.falls else 'rises'}{by}"


def assumptions(proof: SystemProof) -> str:
    """Return the number of assumptions, by their verdicts."""
    claims = [
        proof.of(level.level, obligation.key)
        for level in proof.levels
        for obligation, _ in level.verdicts
        if obligation.sort is Sort.ASSUMPTION
    ]
    over_time = [
        proof.of(level.level, obligation.key)
        for level in proof.levels
        for obligation, _ in level.verdicts
        if obligation.sort is Sort.KEPT
    ]
    if over_time:
        kept = sum(closed.proved for closed in over_time)
        claims_ = _of_tables(claims) if claims else "the tables assume nothing"
        return f"{claims_}; assumptions over time: {len(over_time)}, {kept} of them can always be kept"
    return _of_tables(claims) if claims else "the tables assume nothing"


def _of_tables(claims: Sequence[Closed]) -> str:
    """Return the number of assumptions of tables, by their verdicts."""
    believed = sum(closed.proved and closed.verdict.value != "proved" for closed in claims)
    good = sum(closed.proved for closed in claims) - believed
    rest = len(claims) - good - believed
    trusts = f", {believed} taken for granted" if believed else ""
    return f"assumptions of tables: {good} proved{trusts}" + (
        f", {rest} not proved" if rest else ", none left"
    )


def reaction(systems: Mapping[str, TransitionSystem], proof: SystemProof) -> Iterator[str]:
    """Yield the way of a PAUSE from the top down, as far as levels are proved to pass it on at once."""
    passes = {
        (level.level, obligation.name)
        for level in proof.levels
        for obligation, _ in level.verdicts
        if obligation.sort is Sort.PAUSES and proof.of(level.level, obligation.key).proved
    }
    tops = [
        name
        for name, ts in systems.items()
        if ts.links.above is not None and ts.links.above.outside and ts.links.below
    ]
    for top in tops if {level.level for level in proof.levels} == set(systems) else ():
        reached: dict[str, int] = {top: 1}
        for name in systems:
            for below in systems[name].links.below if name in reached else ():
                if (name, below.order) in passes:
                    reached[below.name] = reached[name] + 1
        lowest = {name: cycles - 1 for name, cycles in reached.items() if name != top}
        if lowest:
            orders = ", ".join(f"of `{name}` in {cycles}" for name, cycles in lowest.items())
            refused = (
                " and cycles of which an input is refused"
                if any(systems[name].refusable for name in reached)
                else ""
            )
            yield f"a PAUSE of `{top}` is ordered {orders} cycles of levels, besides what buffers take{refused}"


def pauses(systems: Mapping[str, TransitionSystem]) -> Iterator[str]:
    """Yield the command that pauses each level which takes orders, whatever its name."""
    first = {name: pause_of(ts) for name, ts in systems.items()}
    if any(first.values()):
        paused = ", ".join(f"`{member}` of `{name}`" for name, member in first.items() if member)
        again = _unless("a restart orders it", systems, TransitionSystem.restarted)
        empty = _unless("an empty buffer holds it", systems, TransitionSystem.initial)
        yield f"PAUSE is the first command: {paused}; {again}, and {empty}"


def _unless(
    said: str, systems: Mapping[str, TransitionSystem], begins: Callable[[TransitionSystem], Leaves]
) -> str:
    """Return the statement about the orders with which levels begin, with the exceptions."""
    others = []
    for name, ts in systems.items():
        begun = begins(ts)
        orders = ((below.order, begun[below.command]) for below in ts.links.below)
        others += [f"`{order}` of `{name}`" for order, node in orders if not (node.known and node.low == 0)]
    return f"{said} but for {', '.join(others)}" if others else said


def confirmed(ts: TransitionSystem, proof: LevelProof) -> dict[str, bool]:
    """Return each question of the certificate, and whether cvc5 refutes it within two minutes."""
    return {name: cvc5_refutes(text, steps=6 * CVC5_STEPS) for name, text in certificate(ts, proof).items()}


def claim(whole: SystemProof, level: str, key: Key) -> dict[str, Any]:
    """Return a verdict, the unproved claims that it rests on, and its trusted assumptions."""
    closed = whole.of(level, key)
    return {
        "verdict": closed.verdict.value
        if closed.proved or not closed.accepted
        else "rests on what is not proved",
        "rests_on": [
            {"level": owner, "what": sort, "table": table, "name": name}
            for owner, (sort, table, name) in closed.lacks
        ],
        "trusts": list(closed.trusts),
    }


def as_json(whole: SystemProof, proof: LevelProof) -> dict[str, Any]:
    """Return context and endings of one level."""
    again = (
        {} if proof.context is None else asdict(proof.context) | claim(whole, proof.level, (AGAIN, "", ""))
    )
    return {
        "runs": claim(whole, proof.level, RUNS),
        "context": again or None,
        "endings": [
            {
                **asdict(ending),
                "proved": ending.proved,
                **claim(whole, proof.level, (Sort.ENDS, ending.table, "")),
            }
            for ending in proof.endings
        ],
    }

"""Warnings about a level in its system, each at its place: lines never reached, states that nothing leaves, requirements that never ask.

In: transition systems, and the proof of their levels. Out: `Diagnostic`s. They repeat what `context` found, and trust what that trusts.
"""

from collections.abc import Iterator, Mapping, Sequence

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.base.diagnostics.report import named, trusting
from rcsc.compose.contract.claims import UNREACHED, declared, spelled
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.proof.context import Context
from rcsc.compose.proof.stuck import LineName, NeverReached, Trap
from rcsc.compose.proof.system import SystemProof
from rcsc.lang.model import Default, Line


def notices(systems: Mapping[str, TransitionSystem], whole: SystemProof) -> Iterator[Diagnostic]:
    """Yield the warnings about each level that was looked at, in order."""
    for proof in whole.levels:
        if proof.context is not None:
            ts = systems[proof.level]
            yield from _idle_tables(ts, proof.context)
            for never in proof.context.never:
                if not never.idle:
                    yield _never_reached(ts, whole, never)
            for trap in proof.context.traps:
                if not trap.stated:
                    yield _never_left(ts, trap)
            yield from _vacuous(ts, proof.context)


def condition_of(trap: Trap) -> str:
    """Spell that the state has one of the values, as a condition of the language."""
    members = ", ".join(trap.members)
    return f"{trap.leaf} = {members}" if len(trap.members) == 1 else f"{trap.leaf} in {{{members}}}"


def _idle_tables(ts: TransitionSystem, seen: Context) -> Iterator[Diagnostic]:
    """Yield a warning for each table of which no line runs."""
    for name in dict.fromkeys(never.table for never in seen.never if never.idle):
        yield Diagnostic(
            Code.LINE_NEVER_REACHED,
            f"table `{name}` of level `{ts.level.name}` never runs",
            Label(ts.table(name).span),
            notes=("no reachable cycle selects it: none of its lines is reached",),
            help=("have something select it, or leave it out",),
            severity=Severity.WARNING,
        )


def _never_reached(ts: TransitionSystem, whole: SystemProof, never: NeverReached) -> Diagnostic:
    line = _line(ts, (never.table, never.line))
    said = f"`{never.line}` of table `{never.table}` is never reached"
    closed = whole.of(ts.level.name, (UNREACHED, never.table, never.line))
    notes = list(_why(ts, never, line))
    if closed.lacks:
        lacking = named([spelled(need, ts.level.name, whole.closed) for need in closed.lacks])
        notes.append(f"found so, given {lacking}")
    elif trusts := trusting(declared(closed.trusts)):
        notes.append(f"shown of the level in its system{trusts}")
    return Diagnostic(
        Code.LINE_NEVER_REACHED,
        f"line {said}" if isinstance(line, Line) else f"the DEFAULT line {said}",
        _name(line),
        related=tuple(_cells(line, never)) if isinstance(line, Line) else (),
        notes=tuple(notes),
        help=("have a line lead there, or leave it out; one that is there in case of a fault may stay",),
        severity=Severity.WARNING,
    )


def _cells(line: Line, never: NeverReached) -> Iterator[Label]:
    """Yield a label for each cell that never holds, or never with the others."""
    for column in never.columns:
        alone = "never so where the table runs" if len(never.columns) == 1 else ""
        span = line.cell_span(column)
        if span != line.span:
            yield Label(span, alone)


def _why(ts: TransitionSystem, never: NeverReached, line: Line | Default) -> Iterator[str]:
    """Yield the reason in words."""
    if isinstance(line, Default):
        yield "every input that comes matches another line"
        return
    table = ts.table(never.table)
    told = [
        f"`{table.columns[column].heading}`: `{test.text}`"
        for column in never.columns
        if (test := line.tests[column]) is not None
    ]
    if len(told) > 1:
        yield f"these never hold together where the table runs: {', '.join(told)}"
    elif told and line.cell_span(never.columns[0]) == line.span:  # what `above` adds stands in no cell
        yield f"this never holds where the table runs: {told[0]}"
    if never.leaf and never.sets:
        many = len(never.sets) > 1
        yield f"only {_lines(never.sets, never.table)} would make it so, and {'are' if many else 'is'} never reached with that"
    elif never.leaf:
        yield f"no line makes it so: none writes such a value to `{never.leaf}`"


def _never_left(ts: TransitionSystem, trap: Trap) -> Diagnostic:
    said = " or ".join(f"`{member}`" for member in trap.members)
    first, *others = trap.enters
    notes = [
        f"{_lines(trap.leaves, '')} would lead out of it, and {'are' if len(trap.leaves) > 1 else 'is'} never reached there"
        if trap.leaves
        else f"no line that matches there writes another value to `{trap.leaf}`"
    ]
    if not trap.seen:
        notes.append("whether it is ever entered is not shown: no walk ran such a line")
    state = condition_of(trap)
    name = f"{trap.leaf.replace('.', '_').replace('[', '_').replace(']', '')}_stays"
    return Diagnostic(
        Code.NEVER_LEFT,
        f"once `{trap.leaf}` is {said}, nothing in level `{ts.level.name}` leaves that, but a restart",
        _name(_line(ts, first), "leads there"),
        related=tuple(_name(_line(ts, other), "leads there") for other in others),
        notes=tuple(notes),
        help=(
            "have a line lead out of it, on a reset or a new command",
            f"where it is to be so, say so: `property {name} : {state} then {state}`",
        ),
        severity=Severity.WARNING,
    )


def _vacuous(ts: TransitionSystem, seen: Context) -> Iterator[Diagnostic]:
    """Yield a warning for each requirement that never asks."""
    for stated in ts.program.properties:
        if stated.name in seen.vacuous:
            yield Diagnostic(
                Code.VACUOUS,
                f"requirement `{stated.name}` of level `{ts.level.name}` is vacuous: no cycle asks for its response",
                Label(stated.span),
                notes=(
                    "it is kept by whatever the level does: its condition never comes, or its scope never begins",
                ),
                help=(
                    "look whether its condition says what is meant; if it is never to come, say so: `never ...`",
                ),
                severity=Severity.WARNING,
            )


def _name(line: Line | Default, said: str = "") -> Label:
    """Return a label at the name of a line."""
    return Label(line.cell_span(-1) if isinstance(line, Line) else line.span, said)


def _line(ts: TransitionSystem, at: LineName) -> Line | Default:
    return next(line for line in ts.table(at[0]).every_line if line.name == at[1])


def _lines(lines: Sequence[LineName], table: str) -> str:
    """Name lines, with their tables where these are others than `table`."""
    names = [f"`{name}`" if where == table else f"`{name}` of table `{where}`" for where, name in lines]
    return f"{'lines' if len(names) > 1 else 'line'} {named(names)}"

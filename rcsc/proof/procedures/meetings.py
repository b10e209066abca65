"""Lines that are said to match together: that those said to do the same do, and that what is said is said of some input.

In: a program, whose tables may rely on its invariants, and one of its tables. Out: what is wrong, and whether the proof rests on
the table's assumptions. The effects of two lines are compared as values (`relation.alike`), wherever both come through; where they
differ such an input is shown, the least that a few steps find, with what each line leaves there.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Effects, Label, MatchedLine, Severity, WitnessColumn
from rcsc.lang.model import AssumptionName, Line, Meeting, Program, Table, Value, spell
from rcsc.proof.relation.alike import Disagreement, alike, disagreement, meeting
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer


@dataclass(frozen=True, slots=True)
class Met:
    """The outcome for the pairs of lines of a table that are declared to match together.

    Attributes:
        relied: The invariants and assumptions needed to show that they do the same.
        open: Pairs of which it stayed open whether they ever match together.
    """

    findings: tuple[Diagnostic, ...]
    relied: frozenset[AssumptionName] = frozenset()
    open: frozenset[tuple[str, str]] = frozenset()

    @property
    def wrong(self) -> bool:
        """Whether some pair is not shown to do the same."""
        return any(finding.severity is Severity.ERROR for finding in self.findings)


def met(program: Program, table: Table, options: Options) -> Met:
    """Prove a table's declarations about pairs of its lines; invariants are among the program's assumptions (`meaning.relying`)."""
    invariants = tuple(AssumptionName(invariant.name) for invariant in program.invariants)
    every = tuple(dict.fromkeys((*invariants, *table.assumptions)))
    grounds = [replace(table, assumptions=names) for names in dict.fromkeys(((), invariants, every))]
    anywhere = replace(table, assumptions=invariants)
    findings: list[Diagnostic] = []
    relied: set[AssumptionName] = set()
    open_: set[tuple[str, str]] = set()
    for pair_said in table.meetings:
        there = meeting(program, grounds[-1], pair_said.where, options)
        if there is Answer.UNKNOWN:
            open_.add((str(pair_said.first), str(pair_said.second)))
        if there is Answer.UNSATISFIABLE:
            beyond = (
                bool(table.assumptions) and meeting(program, anywhere, pair_said.where, options) is not there
            )
            findings.append(_never(table, pair_said, beyond=beyond))
        elif pair_said.same:
            pair = _pair(table, pair_said)
            near = None if isinstance(there, Answer) else there
            for ground in grounds:
                effects = alike(program, ground, pair, options, pair_said.where, near)
                if effects.same:
                    relied |= {*ground.assumptions}
                    break
            else:
                findings.append(_apart(program, grounds[-1], pair_said, effects, options, near))
    return Met(tuple(findings), frozenset(relied), frozenset(open_))


def _pair(table: Table, meeting: Meeting) -> tuple[int, int]:
    places = {line.name: at for at, line in enumerate(table.lines)}
    return places[meeting.first], places[meeting.second]


def _never(table: Table, meeting: Meeting, *, beyond: bool) -> Diagnostic:
    """Warn that a `same` or `above` declaration never applies, or only where an assumption fails (`beyond`), as far as is known."""
    said = "are said to do the same" if meeting.same else "are ordered"
    when = "match together only where an assumption fails" if beyond else "never match together"
    message = f"lines `{meeting.first}` and `{meeting.second}` of table `{table.name}` {said}, and {when}"
    word = "same" if meeting.same else "above"
    return Diagnostic(
        Code.NEVER_MEET,
        message,
        Label(meeting.span),
        notes=(f"under {', '.join(f'`{name}`' for name in table.assumptions)}",) if beyond else (),
        help=() if beyond else (f"leave `{word}` out, or correct the conditions",),
        severity=Severity.WARNING,
    )


def _apart(
    program: Program,
    table: Table,
    meeting: Meeting,
    effects: Effects,
    options: Options,
    near: Mapping[str, Value] | None,
) -> Diagnostic:
    """Report that two lines do not do the same, with an input, or that this could not be decided.

    Without an input `near` at which both match they may never do so, and what they leave different is none.
    """
    names = f"lines `{meeting.first}` and `{meeting.second}` of table `{table.name}`"
    pair = _pair(table, meeting)
    decided = effects.same is not None
    shown = (
        disagreement(program, table, pair, options, meeting.where, near or {})
        if decided and not options.bare
        else None
    )
    if not decided or (near is None and shown is None):
        helps = ("give each query more steps with `--steps`, or simplify the lines",)
        message = f"whether {names} do the same could not be decided"
        return Diagnostic(Code.UNDECIDED, message, Label(meeting.span), help=helps)
    first, second = (table.lines[at] for at in pair)
    return Diagnostic(
        Code.NOT_THE_SAME,
        f"{names} are said to do the same, and do not",
        Label(meeting.span),
        related=tuple(Label(line.cell_span(-1), "this line") for line in (first, second)),
        notes=(*(_results(program, meeting, shown) if shown is not None else ()), str(effects)),
        witnesses=()
        if shown is None
        else (witness_column(program, table, shown.witness, (first, second), added=False),),
        effects=effects,
    )


def _results(program: Program, meeting: Meeting, shown: Disagreement) -> Iterator[str]:
    """Yield each variable's two values after the lines, where they differ, at the input shown."""
    for name, one, other in shown.results:
        kind = program.variable(name).type
        yield f"`{name}` is then {spell(kind, one)} by `{meeting.first}`, {spell(kind, other)} by `{meeting.second}`"


def witness_column(
    program: Program, table: Table, witness: Mapping[str, Value], lines: Iterable[Line], *, added: bool
) -> WitnessColumn:
    """Return an input as a column of the table, with each line's cell under a variable; `added`: with those that `above` and `same` add."""
    kinds = program.kinds
    names = tuple(name for name in kinds if name in witness)
    matched = tuple(
        MatchedLine(str(line.name), tuple(_cells(table, line, name, added) for name in names), line.span)
        for line in lines
    )
    return WitnessColumn(
        str(table.name), names, tuple(spell(kinds[name], witness[name]) for name in names), matched
    )


def _cells(table: Table, line: Line, name: str, added: bool) -> str:
    """Return the cell of a line under a variable, as it is written; a test of several variables stands with the first."""
    return "; ".join(
        test.text if column.variable == name or column.subject is None else f"{column.heading} {test.text}"
        for test, column in zip(line.tests, table.columns, strict=True)
        if test is not None and (column.written or added) and test.variables[:1] == (name,)
    )

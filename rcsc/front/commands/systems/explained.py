"""What is not proved, as text and as JSON: the claim, its run as a time line, what follows it, and what would help."""

import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import click
from rich import box
from rich.console import Console
from rich.table import Table

from rcsc.base.diagnostics.alike import Alike, folded
from rcsc.base.diagnostics.codes import Code
from rcsc.code.testing.figures import counted
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.watched import kept_with
from rcsc.compose.counterexample.consequence import MOST, Consequence, How, spelled_leaves, told
from rcsc.compose.counterexample.explain import Explanation, TraceSettings, runs_on_executors
from rcsc.compose.counterexample.finding import (
    Finding,
    TimeLineRow,
    beginnings,
    by_tick,
    lap_of,
    round_of,
    rows,
    state_of,
)
from rcsc.compose.counterexample.trace import USUAL
from rcsc.compose.proof.eventually import waiting
from rcsc.front.commands.shared.stopped import attach, say_error
from rcsc.lang.model import Int, Kind, Property

ALIKE = 2
"""Consequences of one kind that are shown with their runs; others differ in a reason only, and are told in a line."""
MOST_OF_A_LAP = 6
"""Cycles of a loop that are told in words."""
MOST_CYCLES = 1000
"""The longest run that `--trace` looks for."""
_WIDTH = 118
"""Columns of a time line."""
_LONG = 33
"""Characters of an assignment that a column has room for, whatever the others hold."""
_HARD = "\ue000"
"""A space at which a time line does not break, while it is laid out; of private use, since every other one may."""


def say_explanation(
    systems: Mapping[str, TransitionSystem], explanation: Explanation, settings: TraceSettings
) -> None:
    """Print an unproved claim, as runs were searched for it."""
    cycles, further = settings.most, settings.further
    where = f"level `{explanation.level}`" + (
        f", table `{explanation.obligation.table}`" if explanation.obligation.table else ""
    )
    if explanation.bug:
        say_error(
            Code.NOT_REPRODUCED, f"{where}: the trace found does not run: {explanation.obligation.shown}"
        )
    elif explanation.warns:
        say_error(Code.ENDLESS, f"{where}: not shown: {explanation.obligation.shown}", "warning")
    else:
        code = Code.CANNOT_BE_KEPT if explanation.obligation.sort is Sort.KEPT else Code.NOT_COMPOSED
        word = "refuted" if explanation.refutes else "not proved"
        say_error(code, f"{where}: {word}: {explanation.obligation.shown}")
    if stated := _stated(systems, explanation):
        attach("note", f"it says: {stated}")
    for other in _of_the_same_inputs(systems, explanation):
        attach("note", f"and `{other.name}`, which is about the same inputs: {other.text}")
    for line in explanation.beside if not explanation.undefined else ():
        attach("note", line)
    if explanation.finding is not None and not explanation.beside:
        _say_finding(systems, explanation)
        _say_consequences(systems, explanation, further)
    elif explanation.undefined:
        attach("note", "the run that shows it meets an operation that is not defined")
    elif explanation.guessed:
        attach("note", "a trace that was found does not run: arithmetic was left open")
    elif (
        explanation.obligation.sort.value == "assumption"
        and explanation.obligation.name in systems[explanation.level].trusted
    ):
        attach(
            "note",
            "no first cycle can be as the tables declare, or no later one, or none that runs this table: "
            "what rests on it says nothing",
        )
    elif cycles and not explanation.beside and not _never_begins(explanation):
        attach("note", _no_run(systems[explanation.level], explanation, settings))
        _say_supposed(systems, explanation)
    _say_notes(explanation)
    steps = next_steps(systems[explanation.level], explanation, settings)
    for line in (*explanation.helps, *_restricts_less(explanation), *steps):
        attach("help", line)
    if explanation.together:
        attach("note", explanation.together)
    if explanation.others:
        attach("note", f"of {counted(len(explanation.others), 'other pair')} of lines no such run was found")
    _say_logs(explanation)


def _restricts_less(explanation: Explanation) -> tuple[str, ...]:
    """Return the help for an assumption over time that cannot always be kept; none for any other claim."""
    if explanation.obligation.sort is not Sort.KEPT:
        return ()
    return ("have it restrict less: whatever the level does must leave inputs that keep it",)


def _never_begins(explanation: Explanation) -> bool:
    """Return whether no run breaks the claim because none begins: already the first cycle keeps no assumption."""
    return explanation.obligation.sort is Sort.KEPT and bool(explanation.notes)


def _no_run(ts: TransitionSystem, explanation: Explanation, settings: TraceSettings) -> str:
    """Report what was looked at without finding a run."""
    cycles = counted(settings.most, "cycle")
    where = "from the values of --where" if any(settings.starts.values()) else "from the first values"
    if where.endswith("first values"):
        linked = ts.links.above is not None or ts.links.below
        where += ", and after a restart" + (" beside neighbours that are in step" if linked else "")
    among = " in which no input is refused" if ts.refusable else ""
    if explanation.gave_up:
        return f"no run of {cycles} or fewer was found; the solver gave up on some of those"
    what = "is one that comes round" if explanation.warns else "breaks it"
    if explanation.obligation.sort is Sort.REQUIREMENT and explanation.obligation.name in waiting(ts):
        what += ", or comes round while it waits"
    return f"no run of {cycles} or fewer {what}: all of them{among} were looked at, {where}; longer ones were not"


def next_steps(ts: TransitionSystem, explanation: Explanation, settings: TraceSettings) -> list[str]:
    """List what to do about a claim that is neither proved nor broken by a run, with names and values to type."""
    if (
        explanation.finding is not None
        or explanation.beside
        or not settings.most
        or _never_begins(explanation)
    ):
        return []
    state = {} if explanation.supposed is None else state_of(ts, explanation.supposed)
    steps = []
    if settings.most < MOST_CYCLES:
        steps.append(f"look at longer runs: `--trace {_longer(ts, state, settings.most)}`")
    if state:
        values = ", ".join(f"{explanation.level}.{name} = {value}" for name, value in state.items())
        steps.append(
            f'if that state is reached, have the table do otherwise there; to play on from it: `--where "{values}"`'
        )
    nameable = {
        str(leaf)
        for declared in ts.program.declared
        if declared.kind is not Kind.INPUT
        for leaf in declared.leaves
    }
    own = " and ".join(f"{name} = {value}" for name, value in state.items() if name in nameable)
    if own:
        steps.append(
            f"if it is not, say so, or why: `invariant not_there : not ({own})` is proved, and used here, "
            "or told with the run that comes to it"
        )
    return steps


def _longer(ts: TransitionSystem, state: Mapping[str, str], cycles: int) -> int:
    """Return how many cycles to look at next.

    As many as all times of the level take one after the other, or as the greatest number counts of the state at which the proof stops;
    where that was looked at, some times more.
    """
    times = (v.type for v in ts.program.variables if v.counts is not None)
    counts = (int(said) for name, said in state.items() if isinstance(ts.kinds[name], Int))
    wanted = (sum(kind.high for kind in times if isinstance(kind, Int)), max(counts, default=0))
    longer = max(wanted) + USUAL
    return min(MOST_CYCLES, longer if longer > cycles else 4 * cycles)


def _say_logs(explanation: Explanation) -> None:
    """Print where the runs are kept, if they are."""
    log = explanation.log
    if log is None:
        return
    executor = "" if explanation.in_c else " --executor python"
    attach("log", f"rcsc replay {log} --generated {log.parent / 'generated'}{executor}")
    attach("picture", f"rcsc log {log} --report {log.with_suffix('.html')}")
    if explanation.follows:
        then = log.with_name(f"{log.stem}_then_N{log.suffix}")
        attach("note", f"the runs of what follows, N from 1 to {len(explanation.follows)}: {then}")


def say_run(systems: Mapping[str, TransitionSystem], explanation: Explanation) -> None:
    """Print the run of an explanation, and where it is kept."""
    if explanation.beside:
        say_error(Code.NOT_REPRODUCED, f"the trace found does not run: {explanation.obligation.shown}")
        for line in explanation.beside:
            attach("note", line)
    else:
        _say_finding(systems, explanation)
    _say_logs(explanation)


def _stated(systems: Mapping[str, TransitionSystem], explanation: Explanation) -> str:
    """Return the source text of a property, requirement or assumption over time, or "" where it is none."""
    if explanation.obligation.sort not in {Sort.PROPERTY, Sort.REQUIREMENT, Sort.KEPT}:
        return ""
    return next(
        stated.text
        for stated in systems[explanation.level].program.stated
        if stated.name == explanation.obligation.name
    )


def _of_the_same_inputs(
    systems: Mapping[str, TransitionSystem], explanation: Explanation
) -> Sequence[Property]:
    """List the assumptions over time with which one has to be kept; none for any other claim."""
    if explanation.obligation.sort is not Sort.KEPT:
        return ()
    return kept_with(systems[explanation.level].program, explanation.obligation.name)


def _say_notes(explanation: Explanation) -> None:
    """Print what is known without a run."""
    for note in explanation.notes:
        attach("note", note)
    if explanation.notes and explanation.warns:
        attach("help", "let the lines count: a number that only falls, or only rises, while they run")


def _say_finding(systems: Mapping[str, TransitionSystem], explanation: Explanation) -> None:
    """Print the finding's time line."""
    finding, in_c = explanation.finding, explanation.in_c
    assert finding is not None
    begins = ", after a restart" if finding.restarted else ""
    legal = "" if finding.legal else "; numbers have gone round, or a neighbour was restarted"
    run_by = "as the interpreter, the Python and the C executors run it"
    if not runs_on_executors(systems, finding):
        run_by = "as the interpreter runs it; executors are to run nothing that is not safe"
    elif not in_c:
        run_by = "as the interpreter and the Python executor run it (no C function can give what is refused)"
    what = f"broken in cycle {finding.broken_at}"
    if finding.lasso and explanation.warns:
        what = f"goes round from cycle {finding.lasso} to the end of cycle {finding.broken_at}"
    elif finding.lasso:
        what = f"waits for ever, {round_of(finding)}"
    alone = f" of level `{finding.level}` alone" if explanation.supposes else ""
    alone = f",{alone}" if finding.lasso and not explanation.warns and alone else alone
    attach("note", f"{what}{alone}{begins}, {run_by}{legal}")
    if explanation.supposes:
        gives = "; ".join(
            f"`{owner}` gives such {', '.join(f'`{name}`' for name in names)}"
            for owner, names in explanation.supposes.items()
        )
        attach("note", f"supposed, and not shown of the system: {gives}")
    if finding.lasso:
        attach("note", f"the loop: {_lap(systems, finding)}")
    _say_time_line(_run(systems, finding))


def _say_supposed(systems: Mapping[str, TransitionSystem], explanation: Explanation) -> None:
    """Print the cycle at which the proof stops."""
    finding = explanation.supposed
    if finding is None:
        return
    state = ", ".join(
        f"`{name}` = {value}" for name, value in state_of(systems[finding.level], finding).items()
    )
    lap = f", from where it would go round: {_lap(systems, finding)}" if finding.lasso else ""
    attach(
        "note",
        f"the proof stops here, at a state that it does not exclude{lap}; whether that is ever reached is not known: "
        f"{state or 'all is as at first'}",
    )
    _say_time_line(_run(systems, finding))


def _lap(systems: Mapping[str, TransitionSystem], finding: Finding) -> str:
    """Spell the loop of a lasso; of a long one the first cycles."""
    laps = lap_of(systems[finding.level], finding)
    more = f", and {len(laps) - MOST_OF_A_LAP} more" if len(laps) > MOST_OF_A_LAP else ""
    return "; then ".join(laps[:MOST_OF_A_LAP]) + more


def _say_consequences(
    systems: Mapping[str, TransitionSystem], explanation: Explanation, further: int
) -> None:
    """Print the consequences, each with its run: only what comes after the finding's own where it begins as that does."""
    ts = systems[explanation.level]
    alike: Counter[tuple[object, ...]] = Counter()
    for number, then in enumerate(explanation.follows or (), 1):
        kind = (
            then.how,
            then.level,
            then.report[:1],
            then.before[:1],
        )  # the status; a reason beside it may be any
        alike[kind] += 1
        shown = alike[kind] <= ALIKE or then.how is How.STOPS
        run = "" if then.shared or not shown else "; its run"
        attach(f"then {number}", f"{told(systems[then.level], then)}{run}")
        if shown:
            _say_time_line(_further_rows(systems, then))
    if explanation.follows is not None and len(explanation.follows) == MOST:
        attach("note", f"no more than {MOST} such runs are looked for")
    if explanation.follows == () and ts.links.above is not None:
        attach("then", f"nothing that `{ts.links.above.name}` takes tells of it in {further} cycles more")


def _further_rows(systems: Mapping[str, TransitionSystem], then: Consequence) -> tuple[TimeLineRow, ...]:
    """Return the rows of a run that the finding's own does not have."""
    every = _run(systems, then.run)
    return tuple(row for row in every if row.tick > then.run.broken_at) if then.shared else every


def _run(systems: Mapping[str, TransitionSystem], finding: Finding | None) -> tuple[TimeLineRow, ...]:
    """Return every row of a run, from where it begins; none where there is no run."""
    return () if finding is None else (*beginnings(systems, finding), *rows(systems, finding))


def _say_time_line(shown: Sequence[TimeLineRow], *, err: bool = True) -> None:
    if not shown:
        return
    with io.StringIO() as text:
        Console(file=text, width=_WIDTH, no_color=True, highlight=False).print(_time_line(shown))
        click.echo(
            "\n".join(f"  {line.rstrip()}" for line in text.getvalue().replace(_HARD, " ").splitlines()),
            err=err,
        )


def _time_line(shown: Sequence[TimeLineRow]) -> Table:
    """Return a table with a row a cycle: the line that matched, the inputs and other values that changed, and what went wrong.

    Cycles that are alike take one row.
    """
    several = len({row.level for row in shown}) > 1
    table = Table(box=box.ASCII2, show_lines=True, pad_edge=False)
    for heading in ("cycle", *(("level",) if several else ()), "table: line", "takes", "leaves"):
        table.add_column(heading, overflow="fold")
    for tick in folded(by_tick(shown)):
        if isinstance(tick, Alike):
            moved = ", ".join(_unbroken(f"{name} = {value}") for name, value in tick.moved.items())
            span = f"{tick.first.number} .. {tick.last.number}"
            table.add_row(span, *(("",) if several else ()), tick.said, "", moved)
            continue
        for row in tick.rows:
            takes, leaves = (
                ", ".join(_unbroken(f"{name} = {value}") for name, value in changed.items())
                for changed in (row.takes, row.leaves)
            )
            ran = "\n".join(row.ran) if row.tick else row.line
            ran += f"\n! {row.wrong}" if row.wrong else ""
            table.add_row(str(row.tick or ""), *((row.level,) if several else ()), ran, takes, leaves)
    return table


def _unbroken(text: str) -> str:
    """Keep a text on one line, unless it is too long for a column: then it may break at its spaces, and not in a name."""
    return text.replace(" ", _HARD) if len(text) <= _LONG else text


def say_exercise(systems: Mapping[str, TransitionSystem], finding: Finding, whose: str) -> None:
    """Print a run that asks for the response of a requirement, and in which cycle it does."""
    *before, last = _run(systems, finding)
    begins = ", after a restart" if finding.restarted else ""
    click.echo(f"requirement {whose} asks in cycle {finding.broken_at}{begins}")
    _say_time_line((*before, replace(last, wrong="it asks")), err=False)


def explanation_as_json(
    systems: Mapping[str, TransitionSystem], explanation: Explanation, settings: TraceSettings
) -> dict[str, Any]:
    """Return an unproved claim, its run and its consequences, as JSON."""
    finding = explanation.finding
    return {
        "level": explanation.level,
        "severity": "warning" if explanation.warns else "error",
        "what": explanation.obligation.sort.value,
        "table": explanation.obligation.table,
        "name": explanation.obligation.name,
        "says": _stated(systems, explanation),
        "lines": list(explanation.obligation.lines),
        "reproduces": finding is not None and not explanation.beside,
        "beside": list(explanation.beside),
        "restarted": finding is not None and finding.restarted,
        "supposes": {owner: list(names) for owner, names in explanation.supposes.items()},
        "notes": list(explanation.notes),
        "lap": 0 if finding is None else finding.lasso,
        "time_line": [asdict(row) for row in _run(systems, finding)],
        "supposed": [asdict(row) for row in _run(systems, explanation.supposed)],
        "next": next_steps(systems[explanation.level], explanation, settings),
        "follows": [
            {
                "how": then.how.value,
                "what": told(systems[then.level], then),
                "cycle": then.cycle,
                "takes": dict(spelled_leaves(systems[then.level], then.report)),
                "time_line": [asdict(row) for row in _run(systems, then.run)],
            }
            for then in explanation.follows or ()
        ],
        "helps": list(explanation.helps),
        "helps_together": explanation.together,
        "others": list(explanation.others),
        "log": "" if explanation.log is None else str(explanation.log),
    }

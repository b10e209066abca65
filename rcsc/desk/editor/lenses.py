"""What an editor's actions do: prove a table anew, draw its graph, run its witness, make all proved repairs of a file.

In: a file as it is read, and a table's name. Out: texts for people, or the text of the file. Proving anew asks no memory.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.desk.editor.places import Lines
from rcsc.desk.editor.values import standing
from rcsc.desk.editor.workspace import Checked, Reading, Workspace
from rcsc.driver.proofs import table_report
from rcsc.lang.interpret import (
    UNDEFINED,
    ExternError,
    answering,
    evaluate,
    execute,
    holds,
    initial,
    matching_lines,
)
from rcsc.lang.model import Line, LineName, Procedure, Program, Scalar, Table, Value, spell, unspelled
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from rcsc.views.graph.derive import derive
from rcsc.views.graph.drawing import svg
from rcsc.views.graph.formats.choice import FORMS
from rcsc.views.graph.layout import NoLayoutError

MOST = 40
"""Repairs made at once."""


@dataclass(frozen=True, slots=True)
class Shown:
    """The result of a lens.

    Attributes:
        form: `text`, `mermaid` or `svg`.
    """

    title: str
    form: str
    text: str


def table_of(reading: Reading, name: str) -> tuple[Program, Table] | str:
    """Find the program and the table of a name; else return the reason why there is none."""
    if reading.program is None:
        return (
            f"the program is not in order: {reading.wrong[0].message}"
            if reading.wrong
            else "there is no program"
        )
    table = next((each for each in reading.program.tables if each.name == name), None)
    return (reading.program, table) if table is not None else f"there is no table `{name}`"


def proved_anew(reading: Reading, name: str, options: Options) -> Shown:
    """Prove a table with nothing remembered, and show the verdict with what supports it."""
    found = table_of(reading, name)
    if isinstance(found, str):
        return Shown(f"table {name}", "text", found)
    program, table = found
    verdict = prove_program(program, options, only=[table.name])
    own = next(each for each in verdict.tables if each.table.name == table.name)
    report = table_report(own, program)
    errors = [each.message for each in verdict.findings if each.severity == "error"]
    told = standing(report, errors)
    rests = [f"rests on `{assumption}` ({was})" for assumption, was in report.assumptions]
    lines = [
        f"table `{name}`: {told}",
        f"{report.lines} lines, {report.backed}",
        *rests,
        *(f"the executors end the cycle where `{stop}` fails" for stop in report.stops),
        *(each.message for each in verdict.findings if each.severity != "error"),
    ]
    return Shown(f"table {name}", "text", "\n".join(lines))


def drawn(reading: Reading, name: str, options: Options, form: str = "") -> Shown:
    """Draw the state graph of a table; write it as Mermaid where no layout can be made."""
    found = table_of(reading, name)
    if isinstance(found, str):
        return Shown(f"graph of {name}", "text", found)
    program, table = found
    derived = derive(program, table, reading.loaded.files[table.file], options)
    if isinstance(derived, Diagnostic):
        return Shown(f"graph of {name}", "text", "\n".join((derived.message, *derived.help)))
    if form != "mermaid":
        try:
            return Shown(f"graph of {name}", "svg", svg(derived.graph, derived.everywhere))
        except NoLayoutError:
            pass
    return Shown(f"graph of {name}", "mermaid", FORMS["mermaid"].write(derived.graph))


def witness_run(checked: Checked, name: str, which: int = 0) -> Shown:
    """Run a witness of a table's findings in the interpreter: show which lines match, what each would do, and why no other matches."""
    title = f"witness of {name}"
    found = table_of(checked.reading, name)
    if isinstance(found, str):
        return Shown(title, "text", found)
    columns = [each for told in checked.diagnostics for each in told.witnesses if each.table == name]
    if not columns:
        return Shown(title, "text", f"no finding of table `{name}` has a witness")
    program, table = found
    column = columns[which % len(columns)]
    values = tuple(zip(column.variables, column.values, strict=True))
    return Shown(title, "text", "\n".join(run_at(program, table, values)))


def run_at(program: Program, table: Table, values: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Yield what the interpreter says of one cycle of a table: its outcome, and that of each line.

    Args:
        program: The table's.
        table: In which nothing need be proved.
        values: Name and text of the variables that are known; the others are as a program begins with them.
    """
    kinds = {str(each.name): each.type for each in program.variables}
    now = initial(program) | {name: unspelled(kinds[name], text) for name, text in values}
    yield "input: " + ", ".join(f"{name} = {text}" for name, text in values)
    try:
        matching = matching_lines(table, now)
    except UNDEFINED as error:
        yield f"the table ends the cycle here: {error}"
        return
    yield f"{len(matching)} of {len(table.lines)} lines match: {_comes_of(table, matching)}"
    for line in table.lines:
        if line.name in matching:
            yield f"line `{line.name}` matches, and would set: {_does(program, line, now, kinds)}"
        else:
            yield f"line `{line.name}` does not: {_first_that_fails(table, line, now)}"


def _comes_of(table: Table, matching: Sequence[LineName]) -> str:
    if len(matching) == 1:
        return f"line `{matching[0]}` runs"
    if not matching and table.default is not None:
        return f"DEFAULT `{table.default.name}` runs"
    return "a STATE-TABLE error, and no line runs"


def _does(program: Program, line: Line, now: Mapping[str, Value], kinds: Mapping[str, Scalar]) -> str:
    after = dict(now)
    try:
        with answering(_not_called):
            execute(program, [action.statement for action in line.actions], after, {})
    except (*UNDEFINED, ExternError) as error:
        return f"nothing that can be told here: {error}"
    changed = [
        f"{name} := {spell(kinds[name], value)}"
        for name, value in after.items()
        if name in kinds and value != now[name]
    ]
    return ", ".join(changed) or "nothing that it does not have already"


def _not_called(procedure: Procedure, _: list[Value]) -> tuple[Value, ...]:
    """Refuse the call: a user's own program is not run to look at a table."""
    raise ExternError(f"`{procedure.name}` is an extern procedure, and is not called")


def _first_that_fails(table: Table, line: Line, now: Mapping[str, Value]) -> str:
    for test, column in zip(line.tests, table.columns, strict=True):
        if test is not None and not holds(test, now):
            if column.subject is None:
                return f"`{test.text}` does not hold"
            value = spell(column.subject.type, evaluate(column.subject, now))
            return f"under `{column.heading}` stands `{test.text}`, and it is {value}"
    return "nothing fails"


def mended(workspace: Workspace, file: str) -> tuple[str, int]:
    """Make proved repairs of errors until none is left; return the text and the number of repairs.

    Args:
        workspace: What is open; it stays as it is.
        file: Absolute and normal.
    """
    trial = workspace.trial({})
    count = 0
    while count < MOST:
        text = trial.text(file)
        found = (
            repair
            for finding in trial.check(file).findings
            if finding.severity == "error" and not finding.meanwhile
            for repair in trial.repairs(finding)
            if repair.certain and all(edit.area.file == file for edit in repair.edits)
        )
        repair = next(found, None)
        if repair is None:
            return text, count
        trial.open(file, Lines(text).applied(repair.edits))
        count += 1
    return trial.text(file), count

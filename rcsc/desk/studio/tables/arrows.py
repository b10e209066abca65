"""An arrow that is drawn between two states, as a line of the table.

In: a text, its program and graph, two states. Out: the text with one line more, which matches in the first state and goes to the second, in
the words in which the table's other lines go somewhere; what else it asks and does is left to whoever drew it.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.editor.workspace import Workspace
from rcsc.desk.studio.tables import cells
from rcsc.lang.model import Program, Table, Value, spell
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.lang.written.tables import table_of
from rcsc.proof.relation.steps import Steps
from rcsc.proof.solvers.smt import UndecidedError
from rcsc.views.graph.formats.state_graph import StateGraph


@dataclass(frozen=True, slots=True)
class Drawn:
    """A text with a new line.

    Attributes:
        line: Its name.
        at: Its position in the table.
    """

    text: str
    line: str
    at: int


def arrow_drawn(
    file: str,
    text: str,
    workspace: Workspace,
    program: Program,
    table: Table,
    graph: StateGraph,
    ends: tuple[str, str],
) -> Drawn:
    """Return the text with a line from one state to another.

    Args:
        file: The path.
        text: As it is.
        workspace: Has the texts of other files.
        program: What the text resolves to.
        table: The one that gets a line.
        graph: Of the table.
        ends: The two states.

    Raises:
        Refused: It cannot be said in this table.
    """
    steps = _steps(program, table, graph.state, workspace)
    values = {spell(steps.state.type, value): value for value in steps.states()}
    source, target = ends
    for heading, action in _ways(table, steps, graph, values, target):
        made = _with_line(text, str(table.name), graph.state, source, (heading, action))
        overlay = {**workspace.overlay, file: made.text}
        after = resolve(file, load([file], overlay=overlay))
        if isinstance(after, Program) and _leads(
            after, str(table.name), made.line, graph.state, workspace, values[target]
        ):
            return made
    raise Refused(
        Code.STUDIO,
        f"no line of table `{table.name}` shows how it goes to a state: `{target}` cannot be written",
        "insert a line, and write it",
    )


def _steps(program: Program, table: Table, state: str, workspace: Workspace) -> Steps:
    variable = next(each for each in program.variables if each.name == state)
    return Steps(program, table, variable, workspace.options)


def _ways(
    table: Table, steps: Steps, graph: StateGraph, values: dict[str, Value], target: str
) -> Iterator[tuple[str, str]]:
    """Yield heading and text of actions that may go to a state: as another line does, with the state's name, or as the language does."""
    like = list[tuple[str, str]]()
    for line in table.every_line:
        for action in line.actions:
            goal = steps.sets(action)
            if goal is None:
                continue
            if goal == values[target]:
                yield action.heading, action.text
                return
            name = spell(steps.state.type, goal)
            like.append((action.heading, re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", target, action.text)))
    yield from dict.fromkeys(like)
    yield "procedures", f"{'next ' if graph.deferred else ''}{graph.state} := {target}"
    yield graph.state, target


def _with_line(text: str, name: str, state: str, source: str, way: tuple[str, str]) -> Drawn:
    """Return the text with a line after the last, before DEFAULT; missing columns are added."""
    heading, action = way
    text = _with_column(text, name, state, action=False)
    text = _with_column(text, name, heading, action=True)
    table = table_of(text, name)
    assert table is not None
    sheet = cells.sheet_of(table)
    row = [""] * len(sheet.headings)
    row[sheet.headings[: sheet.conditions].index(state)] = source
    row[sheet.headings.index(heading, sheet.conditions)] = action
    many = len(sheet.stubs)
    at = many - 1 if sheet.cells and sheet.cells[-1][0].startswith("DEFAULT") else many
    line = cells.fresh(sheet, at)
    return Drawn(cells.with_line(text, name, at, row, line), line, at)


def _with_column(text: str, name: str, heading: str, *, action: bool) -> str:
    table = table_of(text, name)
    if table is None:
        raise Refused(Code.STUDIO, f"the text has no table `{name}`")
    sheet = cells.sheet_of(table)
    own = sheet.headings[sheet.conditions :] if action else sheet.headings[: sheet.conditions]
    if heading in own:
        return text
    return cells.with_column(text, name, sheet.conditions, heading, action=action)


def _leads(program: Program, name: str, line: str, state: str, workspace: Workspace, goal: Value) -> bool:
    """Tell whether the new line goes to the state."""
    table = next(each for each in program.tables if each.name == name)
    new = next((each for each in table.lines if each.name == line), None)
    try:
        steps = _steps(program, table, state, workspace)
        return new is not None and [steps.sets(action) for action in new.actions] == [goal]
    except UndecidedError:
        return False

"""What pages ask the prover: the concern `proof`, and that of graphs.

In: questions of kind `proof.*` and `graph.*` about a version of a text. Out: repairs that were checked, lines that can match, graphs.
All of it in the lane `proof`, which also looks at texts.
"""

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.desk.editor.lenses import run_at
from rcsc.desk.editor.values import Repair
from rcsc.desk.editor.workspace import Workspace
from rcsc.desk.studio.hub import PROVER, Ask, Concern, Json
from rcsc.desk.studio.tables import cells, shown
from rcsc.desk.studio.tables.desk import PROOF, Desk, seen
from rcsc.desk.studio.tables.document import Document
from rcsc.lang.model import Expr, Program, Table, Value, spell
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.lang.syntax import tree
from rcsc.lang.written.tables import table_of
from rcsc.proof.relation.steps import Steps
from rcsc.proof.relation.under import lines_under
from rcsc.proof.solvers.smt import UndecidedError
from rcsc.views.graph.chart import sheet
from rcsc.views.graph.composites import Chart, collapsed, folded
from rcsc.views.graph.derive import Derived, derive
from rcsc.views.graph.formats.state_graph import StateGraph
from rcsc.views.graph.labels import WordsError, terms_of
from rcsc.views.graph.layout import NoLayoutError

LONGEST_CONDITION = 4_000
MOST_SHUT = 200
_FILTER = "lines_under_a_condition"
MOST_GRAPHS = 16
"""Graphs that are kept as they were derived."""


class Proof(Concern):
    """Repairs, and lines under a condition."""

    name, lane = "proof", PROOF

    def __init__(self, desk: Desk) -> None:
        """Args: desk: The open files."""
        self._desk = desk

    def _offered(self, ask: Ask) -> tuple[str, int, tuple[Repair, ...]]:
        name, version = seen(ask)
        return name, version, self._desk.repairs(name, version, ask.body.whole("finding", 0, 1_000_000))

    def _on_repairs(self, ask: Ask) -> Json:
        return [shown.repair(at, each) for at, each in enumerate(self._offered(ask)[2])]

    def _on_repair(self, ask: Ask) -> Json:
        """Make an offered repair, if the texts are as they were when it was checked."""
        name, version, offered = self._offered(ask)
        at = ask.body.whole("repair", 0, 1_000_000)
        if at >= len(offered):
            raise Refused(Code.STUDIO, "there is no such repair any more")
        chosen = offered[at]
        files = {self._desk.named(each.area.file) for each in chosen.edits}
        if len(files) != 1:
            raise Refused(Code.STUDIO, "a repair of several files is made in an editor")
        [file] = files

        def make(found: Document) -> object:
            self._desk.still_known(name, version)
            return found.replace(found.edited(chosen.edits), chosen.title)

        return self._desk.change(file, make)

    def _on_run(self, ask: Ask) -> Json:
        """Run one cycle of a table in the interpreter, for an input that shows a finding: nothing need be proved or compiled for it."""
        name, version = seen(ask)
        number, at = ask.body.whole("finding", 0, 1_000_000), ask.body.whole("input", 0, 1_000_000)
        findings = self._desk.known(name, version).answer.findings
        if number >= len(findings) or at >= len(findings[number].witnesses):
            raise Refused(Code.STUDIO, "there is no such input any more")
        witness = findings[number].witnesses[at]
        program, table = _table_of(self._desk.checked(name, version).reading.program, witness.table, ask)
        _, comes, *lines = run_at(program, table, witness.values)
        return {"comes": comes, "lines": lines}

    def _on_filter(self, ask: Ask) -> Json:
        """Report the lines of a table that can match where a condition holds."""
        name, version = seen(ask)
        condition = " ".join(ask.body.text("condition").split())
        if not condition or len(condition) > LONGEST_CONDITION:
            raise Refused(
                Code.STUDIO,
                "a condition is an expression of the language",
                "cur_state = state_2 and not new_command",
            )
        checked = self._desk.checked(name, version)
        program, table = _table_of(checked.reading.program, ask.body.text("table"), ask)
        found = self._desk.opened(name)
        with PROVER:
            meant = self._meant(found, condition)
            ask.check()
            under = lines_under(program, table, meant, self._desk.workspace.options)
        return {"can": under.can, "unknown": under.unknown, "every": under.every}

    def _meant(self, found: Document, condition: str) -> Expr:
        """Return the condition as the program has it.

        Raises:
            Refused: The text is no condition, or has an unknown name.
        """
        try:
            terms_of(condition)
        except WordsError as error:
            raise Refused(Code.STUDIO, f"`{condition}` is no condition: {error.what}") from error
        text = f"{found.text}\nassume {_FILTER} : {condition}\n"
        loaded = load([found.file], overlay={**self._desk.workspace.overlay, found.file: text})
        program = resolve(found.file, loaded)
        if isinstance(program, Program):
            return next(each.condition for each in program.assumptions if each.name == _FILTER)
        wrong = [each for each in program if each.primary.span.start > len(found.text)] or list(program)
        raise Refused(Code.STUDIO, f"`{condition}`: {wrong[0].message}", *wrong[0].help)


class Graphs(Concern):
    """Graphs of tables, and arrows that are drawn in them."""

    name, lane = "graph", PROOF

    def __init__(self, desk: Desk) -> None:
        """Args: desk: The open files."""
        self._desk = desk
        self._kept: dict[tuple[str, int, str, str], tuple[Program, Derived, Chart]] = {}

    def _on_show(self, ask: Ask) -> Json:
        """Lay out the graph of a table, some of its composite states shut."""
        name, version = seen(ask)
        derived, chart = self._derived(ask, name, version, ask.body.text("table"))
        names = [each.name for each in chart.composites]
        shut = [each.text("name") for each in ask.body.each("shut", MOST_SHUT, ())]
        hidden = [each for each in names if each in shut]
        try:
            placed = sheet(collapsed(chart, hidden), hidden)
        except NoLayoutError as error:
            raise Refused(
                Code.EXTRA_MISSING, str(error) or "the layout program failed", "pip install 'rcsc[graph]'"
            ) from error
        return {
            "version": version,
            "table": ask.body.text("table"),
            "state": derived.graph.state,
            "states": derived.graph.states,
            "everywhere": derived.everywhere,
            "composites": names,
            "notes": [
                f"line {edge.line} is DEFAULT, never reached"
                for edge in derived.graph.edges
                if edge.default.endswith("unreachable")
            ],
            **shown.sheet(placed),
        }

    def _derived(self, ask: Ask, name: str, version: int, table_name: str) -> tuple[Derived, Chart]:
        state = ask.body.text("state", "")
        key = (name, version, table_name, state)
        checked = self._desk.checked(name, version)
        program, table = _table_of(checked.reading.program, table_name, ask)
        if key not in self._kept or self._kept[key][0] is not program:  # files that it uses may have changed
            file = _file_of(checked.reading.loaded.files, table)
            with PROVER:
                derived = derive(program, table, file, self._desk.workspace.options, state)
            if isinstance(derived, Diagnostic):
                raise Refused(derived.code, derived.message, *derived.help)
            self._kept[key] = program, derived, folded(derived.graph)
            for old in list(self._kept)[:-MOST_GRAPHS]:
                del self._kept[old]
        return self._kept[key][1:]

    def _on_draw(self, ask: Ask) -> Json:
        """Add a line that leads from a state to another; return its name and its place."""
        name, version = seen(ask)
        table_name = ask.body.text("table")
        derived, _ = self._derived(ask, name, version, table_name)
        source, target = ask.body.text("source"), ask.body.text("target")
        for state in (source, target):
            if state not in derived.graph.states:
                raise Refused(Code.STUDIO, f"`{state}` is no state of table `{table_name}`")
        checked = self._desk.checked(name, version)
        program, table = _table_of(checked.reading.program, table_name, ask)
        found = self._desk.opened(name)
        with PROVER:
            drawn = arrow_drawn(
                found.file, found.text, self._desk.workspace, program, table, derived.graph, (source, target)
            )

        def make(document: Document) -> object:
            self._desk.at(name, version)
            return document.replace(drawn.text, f"draw an arrow from {source} to {target}")

        return self._desk.change(name, make) | {"line": drawn.line, "at": drawn.at}


def _table_of(program: Program | None, name: str, ask: Ask) -> tuple[Program, Table]:
    """Return a table of a program that is in order.

    Raises:
        Refused: The program is not in order, or has no such table.
        CancelledError: Nobody waits.
    """
    ask.check()
    if program is None:
        raise Refused(Code.STUDIO, "the text has errors: mend them first")
    table = next((each for each in program.tables if each.name == name), None)
    if table is None:
        raise Refused(Code.STUDIO, f"the text has no table `{name}`")
    return program, table


def _file_of(files: Mapping[str, tree.File], table: Table) -> tree.File:
    """Return the file that declares a table."""
    return next(
        file for path, file in files.items() if os.path.realpath(path) == os.path.realpath(table.file)
    )


# --- an arrow, as a line of the table ---


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
    """Return the text with a line from one state to another, in the words in which the table's other lines go somewhere.

    What else the line asks and does is left to whoever drew the arrow.

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

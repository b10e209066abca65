"""What pages ask the prover: the concern `proof`, and that of graphs.

In: questions of kind `proof.*` and `graph.*` about a version of a text. Out: repairs that were checked, lines that can match, graphs.
All of it in the lane `proof`, which also looks at texts.
"""

import os
from collections.abc import Mapping

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.desk.editor.lenses import run_at
from rcsc.desk.editor.values import Repair
from rcsc.desk.studio.hub import PROVER, Ask, Concern, Handler, Json
from rcsc.desk.studio.tables import shown
from rcsc.desk.studio.tables.arrows import arrow_drawn
from rcsc.desk.studio.tables.desk import PROOF, Desk
from rcsc.desk.studio.tables.document import Document
from rcsc.lang.model import Expr, Program, Table
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.lang.syntax import tree
from rcsc.proof.relation.under import lines_under
from rcsc.views.graph.chart import sheet
from rcsc.views.graph.composites import Chart, collapsed, folded
from rcsc.views.graph.derive import Derived, derive
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

    @property
    def handlers(self) -> Mapping[str, Handler]:
        """The handlers by kind."""
        return {
            "proof.repairs": self._repairs,
            "proof.repair": self._repair,
            "proof.run": self._run,
            "proof.filter": self._filter,
        }

    def _offered(self, ask: Ask) -> tuple[str, int, tuple[Repair, ...]]:
        name, version = ask.body.text("file"), ask.body.whole("version", 1, 2**53)
        return name, version, self._desk.repairs(name, version, ask.body.whole("finding", 0, 1_000_000))

    def _repairs(self, ask: Ask) -> Json:
        return [shown.repair(at, each) for at, each in enumerate(self._offered(ask)[2])]

    def _repair(self, ask: Ask) -> Json:
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

    def _run(self, ask: Ask) -> Json:
        """Run one cycle of a table in the interpreter, for an input that shows a finding: nothing need be proved or compiled for it."""
        name, version = ask.body.text("file"), ask.body.whole("version", 1, 2**53)
        number, at = ask.body.whole("finding", 0, 1_000_000), ask.body.whole("input", 0, 1_000_000)
        findings = self._desk.known(name, version).answer.findings
        if number >= len(findings) or at >= len(findings[number].witnesses):
            raise Refused(Code.STUDIO, "there is no such input any more")
        witness = findings[number].witnesses[at]
        program, table = _table_of(self._desk.checked(name, version).reading.program, witness.table, ask)
        _, comes, *lines = run_at(program, table, witness.values)
        return {"comes": comes, "lines": lines}

    def _filter(self, ask: Ask) -> Json:
        """Report the lines of a table that can match where a condition holds."""
        name, version = ask.body.text("file"), ask.body.whole("version", 1, 2**53)
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

    @property
    def handlers(self) -> Mapping[str, Handler]:
        """The handlers by kind."""
        return {"graph.show": self._show, "graph.draw": self._draw}

    def _show(self, ask: Ask) -> Json:
        """Lay out the graph of a table, some of its composite states shut."""
        name, version = ask.body.text("file"), ask.body.whole("version", 1, 2**53)
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

    def _draw(self, ask: Ask) -> Json:
        """Add a line that leads from a state to another; return its name and its place."""
        name, version = ask.body.text("file"), ask.body.whole("version", 1, 2**53)
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

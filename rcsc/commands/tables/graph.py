"""`rcsc graph`: the state graph of a table."""

from pathlib import Path

import click

from rcsc.commands.shared.graphs import ENDINGS, OUT, STEPS, WrongError, found_tables, written
from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label
from rcsc.graph.derive import Derived, derive
from rcsc.graph.drawing import svg
from rcsc.graph.find import FoundTable
from rcsc.graph.formats.choice import FORMS
from rcsc.graph.formats.state_graph import LINES
from rcsc.graph.layout import PACKAGE, NoLayoutError
from rcsc.graph.lines import derive_lines
from rcsc.graph.round_trip import against
from rcsc.graph.to_table import tabled
from rcsc.solvers.options import Options


@click.command(
    "graph",
    epilog="""\b
Examples:
  rcsc graph acquire -o acquire.svg                     a drawing (needs the extra `graph`, or Graphviz)
  rcsc graph acquire --form mermaid                     for a page that draws it
  rcsc graph tables/task/move.rcs --form dot -o m.dot   and `rcsc table m.dot` makes the table of it
  rcsc graph acquire --lines -o lines.svg               which line can match after which
  rcsc graph tables -o drawings                         every table of a folder, into a folder""",
)
@click.argument("named", metavar="TABLE")
@click.option("--form", type=click.Choice(list(ENDINGS)), default=None,
              help="svg, dot, mermaid (stateDiagram-v2) or scxml; else by the ending of FILE, else svg.")  # fmt: skip
@click.option("--lines", is_flag=True, help="The graph of lines: which can match in the cycle after which.")
@click.option("--state", default="", metavar="NAME",
              help="The variable whose values are the states; else cur_state, else the only one that fits.")  # fmt: skip
@OUT
@STEPS
def command(named: str, form: str | None, lines: bool, state: str, out: Path | None, steps: int) -> int:
    """Draw the state graph of TABLE: a name, FILE.rcs, FILE.rcs:NAME, or a folder for all of its tables.

    An arrow is a line of the table, from each state in which it can match (Z3, under the table's assumptions) to the state that its
    procedures lead to, with what must hold beside the state. A graph in DOT, Mermaid or SCXML is read back, and the table that it says is
    proved to do the same; what it does not hold is said on standard error.
    """
    try:
        found = found_tables(named, running=lines)
        if len(found) > 1 and out is None:
            raise click.UsageError(f"{named} has {len(found)} tables: name one, or a folder with -o")
        _draw_all(found, form or _form_of(out), lines, state, out, Options(steps=steps))
    except WrongError as error:
        return error.shown("graph")
    return 0


def _draw_all(
    found: list[FoundTable], form: str, lines: bool, state: str, out: Path | None, options: Options
) -> None:
    """Draws every table; of several, those without a state are left out, and what is wrong is told at the end."""
    wrong: list[Diagnostic] = []
    for found_table in found:
        name = (
            f"{found_table.program.name}_{found_table.table.name}{'_lines' if lines else ''}{ENDINGS[form]}"
        )
        into = out is not None and (len(found) > 1 or out.is_dir())
        try:
            _draw(
                found_table,
                form,
                _derived(found_table, lines, state, options),
                out / name if into and out else out,
                options,
            )
        except WrongError as error:
            if len(found) == 1:
                raise
            for left in error.found:
                if left.code is Code.GRAPH_NO_STATE:
                    click.echo(f"note[{left.code.value}]: {left.message}: not drawn", err=True)
                else:
                    wrong.append(left)
    if wrong:
        texts = {file: text for found_table in found for file, text in found_table.loaded.sources.items()}
        raise WrongError(tuple(wrong), texts)


def _form_of(out: Path | None) -> str:
    ending = "" if out is None else out.suffix.lower()
    others = {".gv": "dot", ".mermaid": "mermaid", ".xml": "scxml"}
    return next((form for form, one in ENDINGS.items() if one == ending), others.get(ending, "svg"))


def _derived(one: FoundTable, lines: bool, state: str, options: Options) -> Derived:

    file = one.loaded.files[one.table.file]
    found = (
        derive_lines(one.program, one.table, file, options)
        if lines
        else derive(one.program, one.table, file, options, state)
    )
    if isinstance(found, Diagnostic):
        raise WrongError((found,), one.loaded.sources)
    return found


def _draw(one: FoundTable, form: str, made: Derived, out: Path | None, options: Options) -> None:
    """Writes one graph; what its form does not hold is said beside it."""
    if form == "svg":
        written(_drawing(one, made), out)
        return
    text = FORMS[form].write(made.graph)
    written(text, out)
    if made.graph.state == LINES:
        return
    name = one.table.name
    for lost in made.lost:
        click.echo(f"note[{Code.GRAPH_LOSES.value}]: {name}: not in the graph: {lost}", err=True)
    questions = _read_back(one, form, text, options)
    click.echo(
        f"{name}: the table read back from the graph does the same: proved, {questions} questions", err=True
    )


def _drawing(one: FoundTable, made: Derived) -> str:

    try:
        return svg(made.graph, made.everywhere)
    except NoLayoutError as error:
        helps = ("pip install 'rcsc[graph]'", "or draw the form dot with a program of your own")
        found = Diagnostic(
            Code.EXTRA_MISSING, str(error) or f"`{PACKAGE}` failed", Label(one.table.span), help=helps
        )
        raise WrongError((found,), one.loaded.sources) from error


def _read_back(one: FoundTable, form: str, text: str, options: Options) -> int:
    """How many questions prove that the written graph says the table."""
    made = tabled(FORMS[form].read(text))
    verdict = against(one.loaded, one.root, one.program, one.table, made, options)
    if verdict.diagnostics:
        raise WrongError(verdict.diagnostics, {**one.loaded.sources, **(verdict.sources or {})})
    return verdict.questions

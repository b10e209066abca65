"""`rcsc graph`: the state graph of a table."""

from pathlib import Path

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.front.commands.shared.graphs import ENDINGS, OUT, STEPS, WrongError, found_tables, written
from rcsc.proof.solvers.options import Options
from rcsc.views.graph.derive import Derived, derive, derive_lines
from rcsc.views.graph.drawing import svg
from rcsc.views.graph.find import FoundTable
from rcsc.views.graph.formats.choice import FORMS
from rcsc.views.graph.formats.state_graph import LINES
from rcsc.views.graph.layout import PACKAGE, NoLayoutError
from rcsc.views.graph.round_trip import Against, against
from rcsc.views.graph.to_table import tabled


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
        entries = found_tables(named, running=lines)
        if len(entries) > 1 and out is None:
            raise click.UsageError(f"{named} has {len(entries)} tables: name one, or a folder with -o")
        _draw_all(entries, form or _form_of(out), lines, state, out, Options(steps=steps))
    except WrongError as error:
        return error.shown("graph")
    return 0


def _draw_all(
    entries: list[FoundTable], form: str, lines: bool, state: str, out: Path | None, options: Options
) -> None:
    """Draw every table; among several, leave out those without a state, and raise the errors at the end."""
    wrong: list[Diagnostic] = []
    for entry in entries:
        name = f"{entry.program.name}_{entry.table.name}{'_lines' if lines else ''}{ENDINGS[form]}"
        into = out is not None and (len(entries) > 1 or out.is_dir())
        try:
            _draw(
                entry,
                form,
                _derived(entry, lines, state, options),
                out / name if into and out else out,
                options,
            )
        except WrongError as error:
            if len(entries) == 1:
                raise
            for left in error.diagnostics:
                if left.code is Code.GRAPH_NO_STATE:
                    click.echo(f"note[{left.code.value}]: {left.message}: not drawn", err=True)
                else:
                    wrong.append(left)
    if wrong:
        texts = {file: text for entry in entries for file, text in entry.loaded.sources.items()}
        raise WrongError(tuple(wrong), texts)


def _form_of(out: Path | None) -> str:
    ending = "" if out is None else out.suffix.lower()
    others = {".gv": "dot", ".mermaid": "mermaid", ".xml": "scxml"}
    return next((form for form, own in ENDINGS.items() if own == ending), others.get(ending, "svg"))


def _derived(entry: FoundTable, lines: bool, state: str, options: Options) -> Derived:
    file = entry.loaded.files[entry.table.file]
    derived = (
        derive_lines(entry.program, entry.table, file, options)
        if lines
        else derive(entry.program, entry.table, file, options, state)
    )
    if isinstance(derived, Diagnostic):
        raise WrongError((derived,), entry.loaded.sources)
    return derived


def _draw(entry: FoundTable, form: str, derived: Derived, out: Path | None, options: Options) -> None:
    """Write one graph; report on standard error what its form cannot hold."""
    if form == "svg":
        written(_drawing(entry, derived), out)
        return
    text = FORMS[form].write(derived.graph)
    written(text, out)
    if derived.graph.state == LINES:
        return
    name = entry.table.name
    for lost in derived.lost:
        click.echo(f"note[{Code.GRAPH_LOSES.value}]: {name}: not in the graph: {lost}", err=True)
    if not derived.graph.edges:
        click.echo(
            f"{name}: no line matches any input, and no table is read back from an empty graph", err=True
        )
        return
    verdict = _read_back(entry, form, text, options)
    click.echo(f"{name}: the table read back from the graph does the same{verdict}", err=True)


def _drawing(entry: FoundTable, derived: Derived) -> str:
    try:
        return svg(derived.graph, derived.everywhere)
    except NoLayoutError as error:
        helps = ("pip install 'rcsc[graph]'", "or draw the form dot with a program of your own")
        diagnostic = Diagnostic(
            Code.EXTRA_MISSING, str(error) or f"`{PACKAGE}` failed", Label(entry.table.span), help=helps
        )
        raise WrongError((diagnostic,), entry.loaded.sources) from error


def _read_back(entry: FoundTable, form: str, text: str, options: Options) -> Against:
    """Prove that the written graph says the table."""
    read_table = tabled(FORMS[form].read(text))
    verdict = against(entry.loaded, entry.root, entry.program, entry.table, read_table, options)
    if verdict.diagnostics:
        raise WrongError(verdict.diagnostics, {**entry.loaded.sources, **(verdict.sources or {})})
    return verdict

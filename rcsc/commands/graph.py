"""`rcsc graph` and `rcsc table`: state graphs, both ways."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rcsc.commands.shared.options import steps_option
from rcsc.commands.shared.show import Output, UnwritableError, show
from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label, sort_key
from rcsc.diagnostics.report import Report
from rcsc.diagnostics.source import Source, Span

if TYPE_CHECKING:
    from rcsc.graph.derive import Derived
    from rcsc.graph.find import Found
    from rcsc.graph.to_table import Tabled
    from rcsc.solvers.options import Options

_ENDINGS = {"svg": ".svg", "dot": ".dot", "mermaid": ".mmd", "scxml": ".scxml"}
_STEPS = steps_option(20)
_OUT = click.option("-o", "--output", "out", type=click.Path(path_type=Path), default=None, metavar="FILE",
                    help="Write to FILE instead of standard output.")  # fmt: skip


class _WrongError(Exception):
    """What is wrong, to be shown; the texts that it points into."""

    def __init__(self, found: tuple[Diagnostic, ...], sources: Mapping[str, Source] | None = None) -> None:
        super().__init__(found)
        self.found, self.sources = found, sources or {}

    def shown(self, command: str) -> int:
        """Shows it; the exit status."""
        show(
            Report(tuple(sorted(set(self.found), key=sort_key)), sources=self.sources),
            command,
            Output(quiet=True),
        )
        return 1


@click.command(
    short_help="Draw a table's state graph.",
    epilog="""\b
Examples:
  rcsc graph acquire -o acquire.svg                     a drawing (needs the extra `graph`, or Graphviz)
  rcsc graph acquire --form mermaid                     for a page that draws it
  rcsc graph tables/task/move.rcs --form dot -o m.dot   and `rcsc table m.dot` makes the table of it
  rcsc graph acquire --lines -o lines.svg               which line can match after which
  rcsc graph tables -o drawings                         every table of a folder, into a folder""",
)
@click.argument("named", metavar="TABLE")
@click.option("--form", type=click.Choice(list(_ENDINGS)), default=None,
              help="svg, dot, mermaid (stateDiagram-v2) or scxml; else by the ending of FILE, else svg.")  # fmt: skip
@click.option("--lines", is_flag=True, help="The graph of lines: which can match in the cycle after which.")
@click.option("--state", default="", metavar="NAME",
              help="The variable whose values are the states; else cur_state, else the only one that fits.")  # fmt: skip
@_OUT
@_STEPS
def graph(named: str, form: str | None, lines: bool, state: str, out: Path | None, steps: int) -> int:
    """Draw the state graph of TABLE: a name, FILE.rcs, FILE.rcs:NAME, or a folder for all of its tables.

    An arrow is a line of the table, from each state in which it can match (Z3, under the table's assumptions) to the state that its
    procedures lead to, with what must hold beside the state. A graph in DOT, Mermaid or SCXML is read back, and the table that it says is
    proved to do the same; what it does not hold is said on standard error.
    """
    try:
        found = _found(named, running=lines)
        if len(found) > 1 and out is None:
            raise click.UsageError(f"{named} has {len(found)} tables: name one, or a folder with -o")
        _draw_all(found, form or _form_of(out), lines, state, out, _options(steps))
    except _WrongError as error:
        return error.shown("graph")
    return 0


def _found(named: str, *, running: bool = False) -> list["Found"]:
    from rcsc.graph.find import NotFound, tables

    found = tables(named, running=running)
    if isinstance(found, NotFound):
        raise _WrongError(found.found, found.sources)
    return found


def _draw_all(
    found: list["Found"], form: str, lines: bool, state: str, out: Path | None, options: "Options"
) -> None:
    """Draws every table; of several, those without a state are left out, and what is wrong is told at the end."""
    wrong: list[Diagnostic] = []
    for one in found:
        name = f"{one.program.name}_{one.table.name}{'_lines' if lines else ''}{_ENDINGS[form]}"
        into = out is not None and (len(found) > 1 or out.is_dir())
        try:
            _draw(
                one, form, _derived(one, lines, state, options), out / name if into and out else out, options
            )
        except _WrongError as error:
            if len(found) == 1:
                raise
            for left in error.found:
                if left.code is Code.GRAPH_NO_STATE:
                    click.echo(f"note[{left.code.value}]: {left.message}: not drawn", err=True)
                else:
                    wrong.append(left)
    if wrong:
        texts = {file: text for one in found for file, text in one.loaded.sources.items()}
        raise _WrongError(tuple(wrong), texts)


def _options(steps: int) -> "Options":
    from rcsc.solvers.options import Options

    return Options(steps=steps)


def _form_of(out: Path | None) -> str:
    ending = "" if out is None else out.suffix.lower()
    others = {".gv": "dot", ".mermaid": "mermaid", ".xml": "scxml"}
    return next((form for form, one in _ENDINGS.items() if one == ending), others.get(ending, "svg"))


def _derived(one: "Found", lines: bool, state: str, options: "Options") -> "Derived":
    from rcsc.graph.derive import derive
    from rcsc.graph.lines import derive_lines

    file = one.loaded.files[one.table.file]
    found = (
        derive_lines(one.program, one.table, file, options)
        if lines
        else derive(one.program, one.table, file, options, state)
    )
    if isinstance(found, Diagnostic):
        raise _WrongError((found,), one.loaded.sources)
    return found


def _draw(one: "Found", form: str, made: "Derived", out: Path | None, options: "Options") -> None:
    """Writes one graph; what its form does not hold is said beside it."""
    from rcsc.graph.formats.choice import FORMS
    from rcsc.graph.formats.state_graph import LINES

    if form == "svg":
        _write(_drawing(one, made), out)
        return
    text = FORMS[form].write(made.graph)
    _write(text, out)
    if made.graph.state == LINES:
        return
    name = one.table.name
    for lost in made.lost:
        click.echo(f"note[{Code.GRAPH_LOSES.value}]: {name}: not in the graph: {lost}", err=True)
    questions = _read_back(one, form, text, options)
    click.echo(
        f"{name}: the table read back from the graph does the same: proved, {questions} questions", err=True
    )


def _drawing(one: "Found", made: "Derived") -> str:
    from rcsc.graph.drawing import svg
    from rcsc.graph.layout import PACKAGE, NoLayoutError

    try:
        return svg(made.graph, made.everywhere)
    except NoLayoutError as error:
        helps = ("pip install 'rcsc[graph]'", "or draw the form dot with a program of your own")
        found = Diagnostic(
            Code.EXTRA_MISSING, str(error) or f"`{PACKAGE}` failed", Label(one.table.span), help=helps
        )
        raise _WrongError((found,), one.loaded.sources) from error


def _read_back(one: "Found", form: str, text: str, options: "Options") -> int:
    """How many questions prove that the written graph says the table."""
    from rcsc.graph.formats.choice import FORMS
    from rcsc.graph.round_trip import against
    from rcsc.graph.to_table import tabled

    made = tabled(FORMS[form].read(text))
    verdict = against(one.loaded, one.root, one.program, one.table, made, options)
    if verdict.found:
        raise _WrongError(verdict.found, {**one.loaded.sources, **(verdict.sources or {})})
    return verdict.questions


# --- the other way -----------------------------------------------------------------------


@click.command(
    short_help="Make a table of a state graph.",
    epilog="""\b
Examples:
  rcsc table acquire.dot                                    the table, with what it uses
  rcsc table acquire.mmd --against tables/task/acquire.rcs  and prove that it does the same as that one
  rcsc table m.scxml --in tables/task/move.rcs -o new.rcs   the file, with this table in place of its own""",
)
@click.argument("drawn", metavar="GRAPH", type=click.Path(exists=True, dir_okay=False, allow_dash=True))
@click.option("--form", type=click.Choice([one for one in _ENDINGS if one != "svg"]), default=None,
              help="dot, mermaid or scxml; else by how the text begins.")  # fmt: skip
@click.option("--against", "other", default=None, metavar="TABLE",
              help="Prove that the graph does what this table does (a name, FILE or FILE:NAME); else 1, and an input.")  # fmt: skip
@click.option("--in", "place", type=click.Path(exists=True, dir_okay=False), default=None, metavar="FILE",
              help="Write all of FILE.rcs, with the table in place of the one of its name.")  # fmt: skip
@_OUT
@_STEPS
def table(
    drawn: str, form: str | None, other: str | None, place: str | None, out: Path | None, steps: int
) -> int:
    """Make the table that GRAPH says, in DOT, Mermaid or SCXML as `rcsc graph` writes them, or `-`.

    Arrows of one name, guard and effect are one line. A graph drawn by hand needs the table's name, and on each arrow what it takes; lines
    without a name get one. The table is not proved by this: run `rcsc check` on it.
    """
    try:
        made = _tabled(drawn, form)
        if other is not None:
            _prove(made, other, _options(steps))
        _write(made.text() if place is None else _placed(made, place), out)
    except _WrongError as error:
        return error.shown("table")
    for note in made.notes:
        click.echo(f"note[{Code.GRAPH_LOSES.value}]: {note}", err=True)
    return 0


def _tabled(drawn: str, form: str | None) -> "Tabled":
    from rcsc.graph.formats.choice import FORMS, form_of
    from rcsc.graph.formats.reading import MOST_BYTES, UnreadableError, diagnosed
    from rcsc.graph.to_table import tabled
    from rcsc.host.files.read import Malformed, content, decoded, piped, plain

    try:
        raw = piped(sys.stdin.buffer, MOST_BYTES) if drawn == "-" else content(Path(drawn), MOST_BYTES)
        source = Source(drawn, plain(decoded(raw)))
    except (OSError, Malformed) as error:
        place = Label(Span(drawn, 0, 0))
        why = f"it {error}" if isinstance(error, Malformed) else error.strerror
        raise _WrongError(
            (Diagnostic(Code.GRAPH_UNREADABLE, f"the graph cannot be read: {why}", place),)
        ) from error
    try:
        return tabled(FORMS[form or form_of(source.text)].read(source.text))
    except UnreadableError as error:
        raise _WrongError((diagnosed(error, source),), {drawn: source}) from error


def _prove(made: "Tabled", named: str, options: "Options") -> None:
    from rcsc.graph.round_trip import against

    name = made.table.name.text
    found = _found(f"{named}:{name}" if named.endswith(".rcs") else named)
    one = next((one for one in found if one.table.name == name), found[0])
    verdict = against(one.loaded, one.root, one.program, one.table, made, options)
    if verdict.found:
        raise _WrongError(verdict.found, {**one.loaded.sources, **(verdict.sources or {})})
    where = f"{one.table.file}:{one.table.name}"
    click.echo(f"{name}: does the same as {where}: proved, {verdict.questions} questions", err=True)


def _placed(made: "Tabled", file: str) -> str:
    from rcsc.graph.round_trip import in_place
    from rcsc.lang.project import load

    loaded = load([file])
    if loaded.found:
        raise _WrongError(loaded.found, loaded.sources)
    return in_place(loaded.files[loaded.roots[0]], made.table)


def _write(text: str, out: Path | None) -> None:
    """To a file, whole or not at all, or to standard output."""
    from rcsc.host.files import write_atomically

    if out is None:
        click.echo(text, nl=False)
        return
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(out, text.encode())
    except OSError as error:
        raise UnwritableError(str(out), error.strerror or "no reason given") from error

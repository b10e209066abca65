"""`rcsc table`: the table of a state graph."""

from pathlib import Path

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.files.read import Malformed, content, decoded, piped, plain, standard_input
from rcsc.front.commands.shared.graphs import ENDINGS, OUT, STEPS, WrongError, found_tables, written
from rcsc.front.commands.shared.paths import There
from rcsc.lang.project import load
from rcsc.proof.solvers.options import Options
from rcsc.views.graph.formats.choice import FORMS, form_of
from rcsc.views.graph.formats.reading import MOST_BYTES, UnreadableError, diagnosed
from rcsc.views.graph.round_trip import against, in_place
from rcsc.views.graph.to_table import Tabled, tabled


@click.command(
    "table",
    epilog="""\b
Examples:
  rcsc table acquire.dot                                    the table, with what it uses
  rcsc table acquire.mmd --against tables/task/acquire.rcs  and prove that it does the same as that one
  rcsc table m.scxml --in tables/task/move.rcs -o new.rcs   the file, with this table in place of its own""",
)
@click.argument("drawn", metavar="GRAPH", type=There(dir_okay=False, allow_dash=True))
@click.option("--form", type=click.Choice([ending for ending in ENDINGS if ending != "svg"]), default=None,
              help="dot, mermaid or scxml; else by how the text begins.")  # fmt: skip
@click.option("--against", "other", default=None, metavar="TABLE",
              help="Prove that the graph does what this table does (a name, FILE or FILE:NAME); else 1, and an input.")  # fmt: skip
@click.option("--in", "place", type=There(dir_okay=False), default=None, metavar="FILE",
              help="Write all of FILE.rcs, with the table in place of the one of its name.")  # fmt: skip
@OUT
@STEPS
def command(
    drawn: str, form: str | None, other: str | None, place: str | None, out: Path | None, steps: int
) -> int:
    """Make the table that GRAPH says, in DOT, Mermaid or SCXML as `rcsc graph` writes them, or `-`.

    Arrows of one name, guard and effect are one line. A graph drawn by hand needs the table's name, and on each arrow what it takes; lines
    without a name get one. The table is not proved by this: run `rcsc check` on it.
    """
    try:
        read_table = _tabled(drawn, form)
        if other is not None:
            _prove(read_table, other, Options(steps=steps))
        written(read_table.text() if place is None else _placed(read_table, place), out)
    except WrongError as error:
        return error.shown("table")
    for note in read_table.notes:
        click.echo(f"note[{Code.GRAPH_LOSES.value}]: {note}", err=True)
    return 0


def _tabled(drawn: str, form: str | None) -> Tabled:
    try:
        raw = piped(standard_input(), MOST_BYTES) if drawn == "-" else content(Path(drawn), MOST_BYTES)
        source = Source(drawn, plain(decoded(raw)))
    except (OSError, Malformed) as error:
        place = Label(Span(drawn, 0, 0))
        why = f"it {error}" if isinstance(error, Malformed) else error.strerror
        raise WrongError(
            (Diagnostic(Code.GRAPH_UNREADABLE, f"the graph cannot be read: {why}", place),)
        ) from error
    try:
        return tabled(FORMS[form or form_of(source.text)].read(source.text))
    except UnreadableError as error:
        raise WrongError((diagnosed(error, source),), {drawn: source}) from error


def _prove(read_table: Tabled, named: str, options: Options) -> None:
    name = read_table.table.name.text
    entries = found_tables(f"{named}:{name}" if named.endswith(".rcs") else named)
    entry = next((candidate for candidate in entries if candidate.table.name == name), entries[0])
    verdict = against(entry.loaded, entry.root, entry.program, entry.table, read_table, options)
    if verdict.diagnostics:
        raise WrongError(verdict.diagnostics, {**entry.loaded.sources, **(verdict.sources or {})})
    where = f"{entry.table.file}:{entry.table.name}"
    click.echo(f"{name}: does the same as {where}{verdict}", err=True)


def _placed(read_table: Tabled, file: str) -> str:
    loaded = load([file])
    if loaded.diagnostics:
        raise WrongError(loaded.diagnostics, loaded.sources)
    return in_place(loaded.files[loaded.roots[0]], read_table.table)

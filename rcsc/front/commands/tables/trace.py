"""`rcsc trace`: requirements, lines of tables, generated code, tests and proofs, in both directions."""

from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

import click

from rcsc.base.diagnostics.diagnostic import sort_key
from rcsc.base.host.files.read import Malformed
from rcsc.code.emit.generated import written
from rcsc.driver.settings import CodeWanted
from rcsc.front.commands.shared.options import PATHS, looking, proving, settings_of, showing
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import Output, finish, put
from rcsc.proof.solvers.options import Options
from rcsc.views.trace.answer import answer, suggestions
from rcsc.views.trace.collect import Traced, Wanted, trace

_FILE = There(dir_okay=False, path_type=Path)


@click.command(
    "trace",
    epilog="""\b
Examples:
  rcsc trace tables/task                                  the matrix of every table, in trace/
  rcsc trace robot/system.toml --requirements names.txt   each name must have a place, each line a name
  rcsc trace tables/task --find task.c:640                where does this line of C come from?
  rcsc trace tables/task --find SR-12                     what is this requirement answered by?
  rcsc trace tables/task --against trace/trace.json       is the kept matrix of this version?

\b
Exit status: 0 all is traced, 1 findings, 2 usage.""",
)
@PATHS
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=Path("trace"), metavar="FOLDER", show_default=True,
              help="Where the files go: trace.html with texts.html, trace.json, lines.csv, code.csv, requirements.csv.")  # fmt: skip
@click.option("--find", "asked", multiple=True, metavar="WHAT",
              help="Answer on the terminal, and write nothing: a place (FILE:LINE) of generated code or of a table, a name in C, "
              "`TABLE LINE`, a procedure, a requirement. May be given several times.")  # fmt: skip
@click.option("--requirements", type=_FILE, default=None, metavar="FILE",
              help="Names of all requirements, one in each line: each must have a place, and tables name no other.")  # fmt: skip
@click.option("--against", type=_FILE, default=None, metavar="FILE",
              help="A kept trace.json, which must be the matrix of this version in all that it says; nothing is written.")  # fmt: skip
@click.option("--vectors/--no-vectors", default=True, show_default=True,
              help="Make the test vectors, and say which are for which line.")  # fmt: skip
@looking
@proving
@showing
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    paths: tuple[str, ...], out: Path, asked: tuple[str, ...], requirements: Path | None, against: Path | None,
    vectors: bool, code: CodeWanted, options: Options, use_cache: bool, output: Output,
) -> int:  # fmt: skip
    """Trace lines of tables to requirements, code, tests and proofs, and code back to lines.

    The tables are proved and compiled anew. For each line: what it is for, the lines of C and of Python that match it, run for it
    and are called by it, the vectors that are made for it and those that take it, what is proved of its table, and the properties that
    speak of what it changes. For each piece of generated code: the line, procedure or declaration that it comes from; a line of code
    that comes from nothing is a finding, and so is a requirement whose property is refuted, and a generated file that lies there and is
    not what the tables give. With --requirements, so are a requirement without a place and a name that is not in the list; lines that
    name none, and parts of the code that carry none, are told.
    """
    settings = settings_of(options, use_cache, output, paths)
    wanted = Wanted(vectors, requirements, against, code)
    try:
        traced = trace(settings, wanted)
    except (OSError, Malformed) as error:
        raise click.UsageError(f"{requirements or against}: {error}") from error
    if asked and traced.matrices:
        put(_answered(traced, asked), output.file)
        return 0
    report = traced.conclusion.report
    if not traced.matrices or against is not None:
        return finish(report, "trace", output, traced.conclusion.closing)
    files = traced.files()
    refused = tuple(written(files, out))
    report = replace(report, diagnostics=tuple(sorted((*report.diagnostics, *refused), key=sort_key)))
    closing = f"{traced.conclusion.closing}\nthe matrix is in {out / 'trace.html'}"
    return finish(report, "trace", output, closing)


def _answered(traced: Traced, asked: tuple[str, ...]) -> str:
    """Return the answers, one after the other.

    Raises:
        click.UsageError: Nobody knows what is asked for.
    """
    lines: list[str] = []
    for what in asked:
        told = list(answer(traced.matrices, what))
        if not told:
            near = get_close_matches(what, list(dict.fromkeys(suggestions(traced.matrices))), 1, 0.5)
            meant = f"; did you mean `{near[0]}`?" if near else ""
            raise click.UsageError(f"nothing here is called `{what}`{meant}")
        lines += told
    return "\n".join(lines) + "\n"

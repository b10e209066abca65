"""What `rcsc graph` and `rcsc table` share: a table by its name, what was wrong, and where the text goes."""

from collections.abc import Mapping
from pathlib import Path

import click

from rcsc.base.diagnostics.diagnostic import Diagnostic, sort_key
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.described import near_path
from rcsc.base.host.files import write_atomically
from rcsc.driver.compile import tables_in
from rcsc.front.commands.shared.options import steps_option
from rcsc.front.commands.shared.show import Output, show, writing
from rcsc.front.commands.shared.systems import NoSystem, system_path
from rcsc.run.description import BadDescription
from rcsc.views.graph.find import FoundTable, NotFound, tables

ENDINGS = {"svg": ".svg", "dot": ".dot", "mermaid": ".mmd", "scxml": ".scxml"}
STEPS = steps_option(1.5)
OUT = click.option("-o", "--output", "out", type=click.Path(path_type=Path), default=None, metavar="FILE",
                    help="Write to FILE instead of standard output.")  # fmt: skip


class WrongError(Exception):
    """Diagnostics to be shown, with the texts that they point into."""

    def __init__(
        self, diagnostics: tuple[Diagnostic, ...], sources: Mapping[str, Source] | None = None
    ) -> None:
        super().__init__(diagnostics)
        self.diagnostics, self.sources = diagnostics, sources or {}

    def shown(self, command: str) -> int:
        """Show the diagnostics; return the exit status."""
        show(
            Report(tuple(sorted(set(self.diagnostics), key=sort_key)), sources=self.sources),
            command,
            Output(quiet=True),
        )
        return 1


def found_tables(named: str, *, running: bool = False) -> list[FoundTable]:
    """Find the tables of a name; where several have it, report on standard error which is taken.

    Raises:
        UsageError: A file is named that is not there.
        WrongError: There are no such tables, or their files are not in order.
    """
    file = named if named.endswith(".rcs") else named.rpartition(":")[0]
    if file.endswith(".rcs") and not Path(file).exists():
        raise click.UsageError("; ".join((f"path `{file}` does not exist", *near_path(Path(file)))))
    answer = tables(named, running=running, preferred=() if file else _of_system())
    if isinstance(answer, NotFound):
        raise WrongError(answer.diagnostics, answer.sources)
    for entry in answer:
        if entry.others:
            also = ", ".join(f"`{place}`" for place in entry.others)
            click.echo(f"note: `{named}` is `{entry.place}`; of that name there is also {also}", err=True)
    return answer


def _of_system() -> tuple[str, ...]:
    """Return the root files of the levels of the system here; none where there is no system, or its description is invalid."""
    try:
        return tables_in((), (system_path(None),))
    except (NoSystem, BadDescription):
        return ()


def written(text: str, out: Path | None) -> None:
    """Write to a file, whole or not at all, or to standard output."""
    if out is None:
        click.echo(text, nl=False)
        return
    with writing(out):
        out.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(out, text.encode())

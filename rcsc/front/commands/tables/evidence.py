"""`rcsc evidence`: what a safety case asks of the generated C."""

from pathlib import Path

import click

from rcsc.front.commands.shared.options import PATHS, proving, settings_of, showing
from rcsc.front.commands.shared.show import Output, finish
from rcsc.proof.solvers.options import Options
from rcsc.views.evidence.collect import collect
from rcsc.views.evidence.kinds import KINDS

_KINDS = "\n".join(f"  {name:<12} {kind.summary}" for name, kind in KINDS.items())


@click.command(
    "evidence",
    epilog=f"""\b
Kinds:
{_KINDS}

\b
Examples:
  rcsc evidence tables/task                       every kind, in evidence/
  rcsc evidence robot/system.toml --out dossier   of every level of a system, and of the C that links them""",
)
@PATHS
@click.option(
    "--only", default=",".join(KINDS), metavar="LIST", help="Which kinds, by commas; else every kind."
)
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=Path("evidence"), metavar="FOLDER",
              show_default=True, help="Where the files go: FOLDER/PROGRAM/KIND, with an index.")  # fmt: skip
@proving
@showing
def command(
    paths: tuple[str, ...], only: str, out: Path, options: Options, use_cache: bool, output: Output
) -> int:  # fmt: skip
    """Make the evidence that a safety case asks of the generated C, and keep it as files.

    The tables are proved and the C is made anew, so that the evidence is of what the tables say now. What a kind
    cannot show is a finding, with its place and its reason, and so is a tool that is not installed.
    """
    kinds = tuple(name.strip() for name in only.split(",") if name.strip())
    if not kinds or not set(kinds) <= KINDS.keys():
        raise click.BadParameter(f"choose from {', '.join(KINDS)}", param_hint="--only")
    conclusion = collect(settings_of(options, use_cache, output, paths), kinds, out)
    return finish(conclusion.report, "evidence", output, conclusion.closing)

"""`rcsc evidence`: what a safety case asks of the generated C."""

from pathlib import Path

import click

from rcsc.base.host.files.read import Malformed, plain
from rcsc.driver.settings import CodeWanted
from rcsc.front.commands.shared.options import PATHS, looking, proving, settings_of, showing
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import Output, finish
from rcsc.proof.solvers.options import Options
from rcsc.views.evidence.collect import KINDS, collect
from rcsc.views.evidence.dossier import EPOCH, RECORD, held, today, user

_KINDS = "\n".join(f"  {name:<12} {kind.summary}" for name, kind in KINDS.items())


@click.command(
    "evidence",
    epilog=f"""\b
Kinds:
{_KINDS}

\b
Examples:
  rcsc evidence tables/task                       every kind, in evidence/
  rcsc evidence robot/system.toml --out dossier   of every level of a system, and of the C that links them
  rcsc evidence --check dossier                   are all its files as they were, and those that it is of?""",
)
@PATHS
@click.option(
    "--only", default=",".join(KINDS), metavar="LIST", help="Which kinds, by commas; else every kind."
)
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=Path("evidence"), metavar="FOLDER",
              show_default=True, help="Where the files go: FOLDER/PROGRAM/KIND, with an index.")  # fmt: skip
@click.option("--by", default=user, show_default="the user's name", envvar="RCSC_BY", metavar="NAME",
              help="Who makes the evidence, for its index; else as RCSC_BY says.")  # fmt: skip
@click.option("--check", "checked", type=There(file_okay=False, path_type=Path), default=None, metavar="FOLDER",
              help="Make nothing: hold a dossier against this checkout; run it where the dossier was made.")  # fmt: skip
@looking
@proving
@showing
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    paths: tuple[str, ...], only: str, out: Path, by: str, checked: Path | None, code: CodeWanted, options: Options,
    use_cache: bool, output: Output,
) -> int:  # fmt: skip
    """Make the evidence that a safety case asks of the generated C, and keep it as files.

    The tables are proved. The C that is looked at is that which lies in the generated folder: with --generated in the one that it
    names, else in the one where `rcsc compile` put it, if it is there; else, and with --anew, what the tables give now. A file that
    differs from what the tables give, or is missing, is a finding. What a kind cannot show is a finding, with its place and its
    reason, and so is a tool that is not installed.

    index.html, for an assessor, says when, by whom and with which tools it was made, what it shows and lacks, and what is accepted with
    its reason; its places lead to texts.html. Files that an earlier dossier in the folder had, and this one has not, are removed.
    index.json has the SHA-256 of every table, C file, header, vector and report, which --check compares. The date is that of
    SOURCE_DATE_EPOCH, where it is set.
    """
    if checked is not None:
        if paths:
            raise click.UsageError("--check takes no other path: the dossier names its files")
        try:
            conclusion = held(checked)
        except (OSError, Malformed) as error:
            raise click.BadParameter(f"{checked / RECORD}: {error}", param_hint="--check") from error
        return finish(conclusion.report, "evidence", output, conclusion.closing)
    kinds = tuple(name.strip() for name in only.split(",") if name.strip())
    if not kinds or not set(kinds) <= KINDS.keys():
        raise click.BadParameter(f"choose from {', '.join(KINDS)}", param_hint="--only")
    try:
        date, name = today(), plain(by)
    except Malformed as error:
        raise click.BadParameter(f"it {error}", param_hint="--by") from error
    except (ValueError, OverflowError, OSError) as error:
        raise click.UsageError(f"{EPOCH} is no number of seconds") from error
    conclusion = collect(settings_of(options, use_cache, output, paths), kinds, out, code, name, date)
    return finish(conclusion.report, "evidence", output, conclusion.closing)

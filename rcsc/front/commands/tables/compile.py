"""`rcsc compile`: the executors of proved tables."""

from pathlib import Path

import click

from rcsc.code.emit import TARGETS
from rcsc.driver.compile import compile_
from rcsc.front.commands.shared.options import PATHS, proving, settings_of, showing
from rcsc.front.commands.shared.show import Output, finish
from rcsc.proof.solvers.options import Options


@click.command(
    "compile",
    epilog="""\b
Examples:
  rcsc compile tables                  write generated/python and generated/c
  rcsc compile tables --check          write nothing; 1 if generated/ is not fresh
  rcsc compile grip.rcs --target c     C alone
  rcsc compile grip.rcs --out build    to another folder
  rcsc compile robot/system.toml       the levels of a system, and one C of them all""",
)
@PATHS
@click.option("--out", type=click.Path(path_type=Path), default=None, metavar="FOLDER",
              help="Where the executors go, in FOLDER/python and FOLDER/c; else where the system says, else generated.")  # fmt: skip
@click.option("--target", default=",".join(TARGETS), show_default=True, metavar="LIST",
              help=f"What to write, by commas: {', '.join(TARGETS)}.")  # fmt: skip
@click.option("--check", "only_check", is_flag=True, help="Write nothing; say whether the files are fresh.")
@click.option("--defensive", is_flag=True,
              help="Executors that check their whole state, ranges and invariants, in every cycle.")  # fmt: skip
@proving
@showing
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    paths: tuple[str, ...], out: Path | None, target: str, only_check: bool, defensive: bool,
    options: Options, use_cache: bool, output: Output,
) -> int:  # fmt: skip
    """Prove the tables, then write their Python and C executors.

    Of a system, given by its system.toml or by the folder that holds it, also the C of the whole: one struct, and a
    function that runs all levels that are due and carries the buffers between them.

    Nothing is written unless everything is proved, and what was made can be used: the Python is imported, the C compiled where there
    is a compiler. Files are replaced whole: a kill leaves the old ones. The same tables give the same bytes on every machine, so the
    files belong in version control.
    """
    targets = tuple(name.strip() for name in target.split(",") if name.strip())
    if not targets or not set(targets) <= TARGETS.keys():
        raise click.BadParameter(f"choose from {' and '.join(TARGETS)}", param_hint="--target")
    conclusion = compile_(
        settings_of(options, use_cache, output, paths),
        out,
        targets,
        only_check=only_check,
        defensive=defensive,
    )
    return finish(conclusion.report, "compile", output, conclusion.closing)

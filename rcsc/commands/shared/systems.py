"""What the commands about a system share: which one is meant, and its executors made."""

from pathlib import Path

import click

from rcsc.commands.shared.show import Output, show
from rcsc.diagnostics.coded import CodedError
from rcsc.driver.compile import compile_system

SYSTEM = click.option(
    "--system", "system", type=click.Path(exists=True, dir_okay=False, path_type=Path), default=None, metavar="FILE",
    help="The system's description; else system.toml here or in tables/.",
)  # fmt: skip
EXECUTOR = click.option(
    "--executor", type=click.Choice(["c", "python"]), default="c", show_default=True,
    help="Which of the generated executors run; both do the same.",
)  # fmt: skip
DATABASE = click.option(
    "--database", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
    help="A database made by `rcsc db build`, used as it is; else it is made of the data when that changes.",
)  # fmt: skip


class NoSystem(CodedError):  # noqa: N818  # what happened, not an error of ours
    """Nobody says which system is meant, and there is none where one is looked for."""

    helps = ("say which with --system",)


def system_path(given: Path | None) -> Path:
    """The description that is meant.

    Raises:
        NoSystem: There is none.
    """
    for path in [given] if given else [Path("system.toml"), Path("tables/system.toml")]:
        if path.is_file():
            return path
    raise NoSystem("there is no system.toml here nor in tables/")


def compiled(path: Path, quiet: bool) -> bool:
    """Prove and compile what changed, and show findings; return whether it was in order."""
    conclusion = compile_system(path)
    if conclusion.report.failed:
        show(conclusion.report, "compile", Output())
    elif not quiet:
        click.echo(f"{len(conclusion.report.tables)} tables proved and compiled")
    return not conclusion.report.failed

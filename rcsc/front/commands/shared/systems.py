"""What the commands about a system share: which one is meant, and its executors made."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import click

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.host.described import near_path, nearest
from rcsc.base.host.files.read import MOST_TOML_BYTES, Malformed, text, toml_of
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import Output, show
from rcsc.lang.project import SYSTEM_FILE
from rcsc.run.description import description

PLACES = ("system.toml", "tables/system.toml")
"""Where a folder has its description."""
SYSTEM = click.option(
    "--system", "system", type=There(path_type=Path), default=None, metavar="SYSTEM",
    help="The system's description, or a folder that has one; else system.toml here or in tables/.",
)  # fmt: skip
PLANT = click.option(
    "--plant", "plant", default=None, metavar="PLANT",
    help="What stands outside: a file FILE.py or FILE.py:CLASS, or a plant's name in the description; else its first.",
)  # fmt: skip
ATTACH = click.option(
    "--attach", "attached", is_flag=False, flag_value="", default=None, metavar="[NAME]",
    help="Attach to what `rcsc run --processes` runs on this machine: by its system's name, where several run.",
)  # fmt: skip
EXECUTOR = click.option(
    "--executor", type=click.Choice(["c", "python"]), default="c", show_default=True,
    help="Which of the generated executors run; both do the same.",
)  # fmt: skip
DATABASE = click.option(
    "--database", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
    help="A database made by `rcsc db build`, used as it is; else it is made of the data when that changes.",
)  # fmt: skip

COMPILES = click.option(
    "--compile/--no-compile", "compiles", default=True, show_default=True,
    help="Prove and compile what changed before anything moves; else the executors run as they lie there.",
)  # fmt: skip


class NoSystem(CodedError):  # noqa: N818  # what happened, not an error of ours
    """No system is named, and none found."""

    helps = ("say which with --system",)


def system_path(given: Path | None) -> Path:
    """Find the description of a system.

    Raises:
        NoSystem: There is no description.
    """
    if given is not None and not given.is_dir():
        return given
    folder = given or Path()
    for name in PLACES:
        if (folder / name).is_file():
            return folder / name
    raise NoSystem(
        f"there is no system.toml {f'in `{given}`' if given else 'here'} nor in {folder / 'tables'}/"
    )


def meant(target: str | None, system: Path | None, script: str | None) -> tuple[Path, str]:
    """Find the description and the script that an argument and two options name; the script may be empty.

    Args:
        target: A folder or a file of a system, a script, or a script's name; None for the system that is here.
        system: What `--system` says.
        script: What `--script` says.

    Raises:
        NoSystem: There is no description.
        click.UsageError: There is no such file or folder, or script or system are named twice.
    """
    if target is not None and _is_system(Path(target), folder=target.endswith("/")):
        if system is not None:
            raise click.UsageError(f"`{target}` is a system, and `--system` names another")
        return _with_script(system_path(Path(target)), script or "")
    if target is not None and script is not None:
        raise click.UsageError(f"`{target}` is a script, and `--script` names another")
    if target is not None and system is None and not any(Path(name).is_file() for name in PLACES):
        raise click.UsageError(
            f"there is no system `{target}`, and no system.toml here of which it could be a script"
        )
    return _with_script(system_path(system), target or script or "")


def tables_meant(target: str | None, logs: Sequence[Path] = ()) -> Path | None:
    """Return the path that the description of these tables or logs would have; None where a system is named, or nothing that exists.

    Args:
        target: A file of tables, or a folder of them that has no description; None for this folder, where tables stand in it.
        logs: That are to be looked at, whatever is here.
    """
    from rcsc.lang.project import listed, systems_above

    path = Path(target or ".")
    if path.suffix == ".rcs" and path.is_file():
        real = path.resolve()
        running = (each for each in systems_above(str(path)) if real in _files_of(each))
        return next(running, path.parent / SYSTEM_FILE)
    if not path.is_dir() or _described(path):
        return None
    # nobody named this folder: what is below it may be anybody's
    here = any(path.glob("*.rcs")) or bool(logs) if target is None else bool(listed([target]))
    return path / SYSTEM_FILE if here else None


def _files_of(system: Path) -> set[Path]:
    """Return every file of the programs that a system runs; none where its description is invalid."""
    from rcsc.driver.compile import tables_in
    from rcsc.lang.project import load
    from rcsc.run.description import BadDescription

    try:
        roots = tables_in((), (system,))
    except BadDescription:
        return set()
    return {Path(file).resolve() for file in load(list(roots)).files} if roots else set()


def _described(folder: Path) -> bool:
    return any((folder / name).is_file() for name in PLACES)


def _is_system(path: Path, *, folder: bool) -> bool:
    """Tell whether a path is a system's; a script may have the name of a folder that is none.

    Raises:
        click.UsageError: The path must be a system, and does not exist.
    """
    if path.is_dir():
        described = _described(path)
        if not described and (folder or path.parent != Path()):
            raise click.UsageError(f"the folder `{path}` has no system.toml")
        return described
    if path.suffix != ".toml" or _is_script(path):
        return False
    if not path.exists():
        raise click.UsageError("; ".join((f"there is no file `{path}`", *near_path(path))))
    return True


def _with_script(path: Path, name: str) -> tuple[Path, str]:
    """Return a description and a script of it, which must exist.

    Raises:
        click.UsageError: There is no such script.
    """
    from rcsc.run.orders.script import script_path  # most commands read no script

    if not name or script_path(name, path.parent).is_file():
        return path, name
    files = (file for folder in (path.parent / "scripts", path.parent) for file in sorted(folder.glob("*")))
    known = [
        file.stem for file in files if file.suffix == ".csv" or (file.suffix == ".toml" and _is_script(file))
    ]
    if Path(name).is_dir():
        raise click.UsageError(f"the folder `{name}` has no system.toml")
    helps = nearest(name.removesuffix(".csv"), known) or (
        (f"those of `{path}` are {', '.join(known)}",) if known else ()
    )
    raise click.UsageError("; ".join((f"there is no script `{name}`", *helps)))


def _is_script(path: Path) -> bool:
    """Tell whether a TOML file has rows; one that cannot be read is reported where it is read."""
    try:
        return "row" in toml_of(text(path, MOST_TOML_BYTES))
    except (OSError, Malformed):
        return False


def made(
    path: Path, *, compiles: bool, quiet: bool, doing: AbstractContextManager[None] | None = None
) -> bool:
    """Update a system's executors from its tables, or report that nobody looked; return whether they may run.

    Args:
        path: Of the description.
        compiles: Whether what changed is proved and compiled, and findings are shown.
        quiet: Whether it is not told how many tables that were.
        doing: Tells that it is being done; nobody is told without.
    """
    from rcsc.driver.compile import compile_system  # only here: what is known already is printed without

    if not compiles:
        as_they_lie(description(path).generated)
        return True
    with doing or nullcontext():
        conclusion = compile_system(path)
    if conclusion.report.failed:
        show(conclusion.report, "compile", Output())
    elif not quiet:
        click.echo(f"{len(conclusion.report.tables)} tables proved and compiled")
    return not conclusion.report.failed


def fresh(path: Path) -> bool:
    """Compare a system's executors with its tables, and show the differences; return whether there are none."""
    from rcsc.driver.compile import compile_system  # only here: what is known already is printed without

    report = compile_system(path, only_check=True).report
    if report.failed:
        show(report, "compile", Output(quiet=True))
    return not report.failed


def as_they_lie(generated: Path) -> None:
    """Report that executors are not compared with any tables."""
    click.echo(
        f"note: the executors in `{generated}` run as they lie there, held against no tables", err=True
    )

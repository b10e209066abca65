"""`rcsc new`: a project that checks, proves, compiles and passes its tests as it stands.

A template is a folder of files in `templates`: `dot_NAME` becomes `.NAME`, and `ROBOT_NAME` in a text the project's name.
"""

import os
import re
import shlex
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files import write_atomically
from rcsc.front.commands.shared.options import showing
from rcsc.front.commands.shared.show import Output, finish

NAME = "ROBOT_NAME"
NEXT = {
    "level": "rcsc check",
    "system": "rcsc check && rcsc prove system.toml && rcsc run system.toml",
    "mujoco": "rcsc check && rcsc prove system.toml && rcsc run system.toml",
    "nbs": "rcsc run make_boxt --report boxt.html",
}
"""Each template, and what to type first."""
CACHES = {".rcsc-cache", "__pycache__"}
BEGUN = re.compile(r"\..+|(README|LICEN[CS]E|COPYING)(\..+)?", re.IGNORECASE)
"""What a repository may have before there is a project in it; what a template has, too, stays as it is."""
GUIDE = ".md"
"""The guides beside the paper's tables speak of the repository."""
GALLERY = "gallery/"
"""Other people's tables, which are no part of the paper's system."""


@click.command(
    "new",
    epilog="""\b
Examples:
  rcsc new gripper && cd gripper && rcsc check    one level: a table of seven lines
  rcsc new . --template system                    two levels, plant, script, tests, hooks, CI; here
  rcsc new robot --template mujoco                a robot that docks by contact, in MuJoCo
  rcsc new nbs --example nbs                      the paper's system, with its cell""",
)
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option("--template", type=click.Choice([one for one in NEXT if one != "nbs"]), default=None,
              help="level (the default), system or mujoco.")  # fmt: skip
@click.option("--example", type=click.Choice(["nbs"]), default=None,
              help="A whole system to read and run, in place of a template: nbs, the paper's.")  # fmt: skip
@showing
def command(folder: Path, template: str | None, example: str | None, output: Output) -> int:
    """Make a project in DIR that checks, proves, compiles and passes its tests.

    DIR is new or empty, or a fresh repository: its README, licence and hidden files stay as they are.
    """
    if template is not None and example is not None:
        raise click.UsageError("--template and --example do not go together")
    kind = example or template or "level"
    scaffold = _scaffold(folder, kind)
    if not isinstance(scaffold, tuple):
        return finish(Report((scaffold,)), "new", output)
    made, kept = scaffold
    place = shlex.quote(f"./{folder}" if str(folder).startswith("-") else str(folder))
    there = "" if folder.resolve() == Path.cwd() else f"cd {place} && "
    stays = f", and kept {', '.join(kept)}" if kept else ""
    closing = f"made {len(made)} files in {folder}{stays}; now: {there}{NEXT[kind]}"
    return finish(Report(()), "new", output, closing)


def _scaffold(folder: Path, kind: str) -> tuple[list[str], list[str]] | Diagnostic:
    """Make the project in `folder`; return the files written and those that were there, or the reason why there are none."""
    name = re.sub(r"\W", "_", folder.resolve().name, flags=re.ASCII) or "robot"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        others = sorted(entry.name for entry in folder.iterdir() if not BEGUN.fullmatch(entry.name))
        if others:
            return _refused(folder, f"the folder is not empty, it has `{others[0]}`")
        written: list[str] = []
        kept: list[str] = []
        for file, content in _files(kind):
            path = folder / file
            if os.path.lexists(path):
                kept.append(file)
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, content.replace(NAME.encode(), name.encode()))
            written.append(file)
    except OSError as error:
        return _refused(folder, error.strerror or type(error).__name__)
    return written, kept


def _files(kind: str) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a template by their paths in the project, in order; of the paper's system its tables, too."""
    package = files("rcsc")
    yield from _below(package / "front" / "commands" / "templates" / kind)
    if kind == "nbs":
        packaged = package / "_data" / "tables"
        beside: Traversable = Path(__file__).parents[3] / "tables"
        for file, content in _below(packaged if packaged.is_dir() else beside):
            if not file.endswith(GUIDE) and not file.startswith(GALLERY):
                yield f"tables/{file}", content


def _below(folder: Traversable) -> Iterator[tuple[str, bytes]]:
    for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
        name = re.sub("^dot_", ".", entry.name)
        if entry.name in CACHES:
            continue
        if entry.is_dir():
            yield from ((f"{name}/{inner}", content) for inner, content in _below(entry))
        else:
            yield name, entry.read_bytes()


def _refused(folder: Path, why: str) -> Diagnostic:
    message = f"cannot make a project in `{folder}`: {why}"
    return Diagnostic(Code.NOT_WRITTEN, message, Label(Span(str(folder), 0, 0)))

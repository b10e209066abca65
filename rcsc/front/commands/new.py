"""`rcsc new`: a project that checks, proves, compiles and passes its tests as it stands, or somebody's published tables to look at."""

import shlex
from pathlib import Path

import click

from rcsc.base.diagnostics.report import Report
from rcsc.front.commands.shared.options import showing
from rcsc.front.commands.shared.scaffold import NBS, TEMPLATES, gallery, make
from rcsc.front.commands.shared.show import Output, finish

NEXT = {
    "level": "rcsc check",
    "system": "rcsc check && rcsc prove system.toml && rcsc run system.toml",
    "mujoco": "rcsc check && rcsc prove system.toml && rcsc run system.toml",
    "nbs": "rcsc run make_boxt --report boxt.html",
}
"""What to type first; `rcsc check` of published tables."""


@click.command(
    "new",
    epilog="""\b
Examples:
  rcsc new gripper && cd gripper && rcsc check    one level: a table of seven lines
  rcsc new . --template system                    two levels, plant, script, tests, hooks, CI; here
  rcsc new robot --template mujoco                a robot that docks by contact, in MuJoCo
  rcsc new nbs --example nbs                      the paper's system, with its cell
  rcsc new tcp --example rfc9293                  a published table, with what is found in it""",
)
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option("--template", type=click.Choice([one for one in TEMPLATES if one != NBS]), default=None,
              help="level (the default), system or mujoco.")  # fmt: skip
@click.option("--example", type=click.Choice([NBS, *gallery()]), metavar="NAME", default=None,
              help="In place of a template: nbs, the paper's whole system; or an entry of the gallery of published tables.")  # fmt: skip
@showing
def command(folder: Path, template: str | None, example: str | None, output: Output) -> int:
    """Make a project in DIR that checks, proves, compiles and passes its tests.

    DIR is new or empty, or a fresh repository: its README, licence and hidden files stay as they are.
    """
    if template is not None and example is not None:
        raise click.UsageError("--template and --example do not go together")
    kind = example or template or "level"
    scaffold = make(folder, kind)
    if not isinstance(scaffold, tuple):
        return finish(Report((scaffold,)), "new", output)
    made, kept = scaffold
    place = shlex.quote(f"./{folder}" if str(folder).startswith("-") else str(folder))
    there = "" if folder.resolve() == Path.cwd() else f"cd {place} && "
    stays = f", and kept {', '.join(kept)}" if kept else ""
    closing = f"made {len(made)} files in {folder}{stays}; now: {there}{NEXT.get(kind, 'rcsc check')}"
    return finish(Report(()), "new", output, closing)

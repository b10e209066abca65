"""`rcsc shell`: a system under somebody's hands."""

import importlib.util
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import click

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.host.files.read import Malformed, lines_of, standard_input, text, typed
from rcsc.desk.shell.opening import Opening, opened
from rcsc.desk.shell.terminal import converse, follow, listen
from rcsc.front.commands.shared.systems import COMPILES, EXECUTOR, PLANT, made, system_path
from rcsc.run.orders.script import BadScript


@click.command(
    "shell",
    epilog="""\b
Examples:
  rcsc shell my_robot                 the system in a folder, with its plant
  rcsc shell                          tables/system.toml, with stand-ins for robot, hand and camera
  rcsc shell --script morning.txt     commands from a file; 1 at the first that fails
  echo 'step 5' | rcsc shell --alone  nothing outside the levels, and a database that knows nothing

\b
In the shell:
  TASK-LEVEL                          one cycle of level task
  cur_state ?                         show a variable
  command.input_command = acquire     set it
  run until task.cur_state = state_3
  help""",
)
@click.option("--script", type=click.Path(exists=True, dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Do the commands of FILE, one a line; else they are read from standard input.")  # fmt: skip
@EXECUTOR
@PLANT
@COMPILES
@click.option("--alone", is_flag=True,
              help="Nothing outside the levels, and no database: what comes in is set by hand.")  # fmt: skip
@click.argument("system", required=False, type=click.Path(exists=True, path_type=Path), metavar="[SYSTEM]")
def command(
    script: Path | None, executor: str, plant: str | None, compiles: bool, alone: bool, system: Path | None
) -> int:
    """Run any module, procedure, owner, table or level of SYSTEM by name; look at and set any variable; step, run, undo.

    SYSTEM is a system's description or a folder that has one; without it, system.toml here or in tables/. What changed is proved
    and compiled, then the generated executors run with the plant that the description declares.
    """
    kind: Literal["c", "python"] = "c" if executor == "c" else "python"
    written = None if script is None else _text(script)
    path = system_path(system)
    if not made(path, compiles=compiles, quiet=True):
        return 1
    commands = opened(Opening(path, kind, plant or "", alone=alone))

    asks = written is None and typed()
    try:
        if asks and _has_prompt():
            return converse(commands, click.echo, _complain)
        if asks:
            listen(commands, click.echo, _complain)
        return follow(
            commands, _lines(written), "-" if script is None else str(script), click.echo, _complain
        )
    finally:
        commands.session.end_log()


def _has_prompt() -> bool:
    return importlib.util.find_spec("prompt_toolkit") is not None


def _text(script: Path) -> str:
    """Return the text of a script.

    Raises:
        BadScript: It cannot be read.
    """
    try:
        return text(script)
    except OSError as error:
        raise BadScript(f"`{script}` cannot be read: {error.strerror}") from error
    except Malformed as error:
        raise BadScript(f"`{script}` {error}") from error


def _lines(written: str | None) -> Iterator[str]:
    """Yield the lines of a script, or those of standard input as they come.

    Raises:
        BadScript: A line cannot be read.
    """
    try:
        yield from lines_of(standard_input() if written is None else io.BytesIO(written.encode()))
    except Malformed as error:
        raise BadScript(f"what is typed {error}" if written is None else f"the script {error}") from error


def _complain(where: str, refused: Refused) -> None:
    """Print a refusal in the form of all errors."""
    first, *rest = str(refused).splitlines() or [""]
    click.echo(f"{where}error[{refused.code.value}]: {first}", err=True)
    for line in rest:
        click.echo(f"  {line}", err=True)
    for words in refused.helps:
        click.echo(f"  = help: {words}", err=True)

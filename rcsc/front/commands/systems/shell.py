"""`rcsc shell`: a system under somebody's hands, by lines that are typed or stand in a file.

The only importer of prompt_toolkit, which is asked only where there is a terminal. There, what is typed while cycles run is done between
two of them.
"""

import importlib.util
import io
import os
import select
import signal
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Literal

import click

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files.read import Malformed, lines_of, standard_input, text, typed
from rcsc.base.host.trust import state_folder
from rcsc.desk.shell.commands import Commands, said
from rcsc.desk.shell.opening import Opening, opened
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.stopped import attach
from rcsc.front.commands.shared.systems import ATTACH, COMPILES, EXECUTOR, PLANT, made, system_path
from rcsc.run.orders.script import BadScript
from rcsc.run.processes.attach import find

if TYPE_CHECKING:
    from prompt_toolkit import PromptSession
    from prompt_toolkit.history import History

MOST_TYPED = 4096
"""Bytes that a terminal gives at once: one line."""
_NOT_MEANWHILE = ("run", "step", "undo", "reload")


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
@click.option("--script", type=There(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Do the commands of FILE, one a line; else they are read from standard input.")  # fmt: skip
@EXECUTOR
@PLANT
@COMPILES
@ATTACH
@click.option("--alone", is_flag=True,
              help="Nothing outside the levels, and no database: what comes in is set by hand.")  # fmt: skip
@click.argument("system", required=False, type=There(path_type=Path), metavar="[SYSTEM]")
def command(
    script: Path | None, executor: str, plant: str | None, compiles: bool, attached: str | None, alone: bool, system: Path | None
) -> int:  # fmt: skip
    """Run any module, procedure, owner, table or level of SYSTEM by name; look at and set any variable; step, run, undo.

    SYSTEM is a system's description or a folder that has one; without it, system.toml here or in tables/. What changed is proved
    and compiled, then the generated executors run with the plant that the description declares.
    """
    kind: Literal["c", "python"] = "c" if executor == "c" else "python"
    written = None if script is None else _text(script)
    if attached is not None:
        if system or plant or alone:
            raise click.UsageError("--attach names what runs: leave system and plant out")
        found = find(attached)
        opening = Opening(found.system, kind, attached=found)
    else:
        path = system_path(system)
        if not made(path, compiles=compiles, quiet=True):
            return 1
        opening = Opening(path, kind, plant or "", alone=alone)
    commands = opened(opening)

    asks = written is None and typed()
    try:
        if asks and importlib.util.find_spec("prompt_toolkit") is not None:
            return _converse(commands)
        if asks:
            _listen(commands)
        return _follow(commands, _lines(written), "-" if script is None else str(script))
    finally:
        commands.session.leave()
        commands.session.end_log()


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
    """Print a refusal in the form of all errors; `where` it arose is `script:3: `, or nothing."""
    first, *rest = str(refused).splitlines() or [""]
    click.echo(f"{where}error[{refused.code.value}]: {first}", err=True)
    for line in rest:
        click.echo(f"  {line}", err=True)
    for words in refused.helps:
        attach("help", words)


def _follow(commands: Commands, lines: Iterable[str], name: str) -> int:
    """Run the lines in order, up to the first that fails: later ones would meet another state."""
    for number, line in enumerate(lines, 1):
        try:
            with _interruptible(commands):
                output = commands.do(line)
                if commands.session.interrupted:
                    raise KeyboardInterrupt
        except Refused as refused:
            _complain(f"{name}:{number}: ", refused)
            return 1
        for shown in output:
            click.echo(shown)
        if commands.over:
            break
    return 0


def _converse(commands: Commands) -> int:
    """Run lines as they are typed until `quit` or the end of the input; show a refusal and go on."""
    from prompt_toolkit.shortcuts import clear

    prompt, commands.clear = _prompt(commands), clear
    _listen(commands)
    while not commands.over:
        try:
            line = prompt.prompt(f"{commands.session.chosen}> ")
        except KeyboardInterrupt:
            continue
        except EOFError:
            break
        try:
            with _interruptible(commands):
                output = commands.do(line)
        except Refused as refused:
            _complain("", refused)
            continue
        for shown in output:
            click.echo(shown)
    return 0


def _listen(commands: Commands) -> None:
    """Have what is typed while cycles run done between two of them: a terminal gives whole lines. After a refusal the cycles go on."""

    def between() -> None:
        if not select.select([0], [], [], 0)[0]:
            return
        heard = os.read(0, MOST_TYPED).decode(errors="replace")
        commands.over |= not heard  # nobody is there any more
        for line in heard.splitlines():
            try:
                for shown in _meanwhile(commands, line):
                    click.echo(shown)
            except Refused as refused:
                _complain("", refused)
        commands.session.interrupted |= commands.over

    commands.heard, commands.session.between = True, between


def _meanwhile(commands: Commands, line: str) -> list[str]:
    """Do a line between two cycles.

    Raises:
        Refused: It was not done; cycles cannot be run, taken back or changed while they run.
    """
    word = said(line).partition(" ")[0].casefold()
    if word in _NOT_MEANWHILE:
        raise Refused(Code.SHELL_COMMAND, f"`{word}` has to wait: cycles run", "Ctrl-C ends them")
    return commands.do(line)


@contextmanager
def _interruptible(commands: Commands) -> Iterator[None]:
    """Ctrl-C ends `run` after a whole cycle, and asks again; a second one is Python's own."""
    before = signal.getsignal(signal.SIGINT)
    commands.session.interrupted = False

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        commands.session.interrupted = True
        signal.signal(signal.SIGINT, before)

    try:
        signal.signal(signal.SIGINT, interrupt)
    except ValueError:  # not in the main thread, as in a test: nobody presses keys there
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _prompt(commands: Commands) -> "PromptSession[str]":
    from prompt_toolkit import PromptSession
    from prompt_toolkit.completion import WordCompleter

    words = WordCompleter(lambda: sorted(set(commands.completions())), ignore_case=True, WORD=True)
    return PromptSession(history=_history(), completer=words, complete_while_typing=False)


def _history() -> "History":
    from prompt_toolkit.history import FileHistory, InMemoryHistory

    path = state_folder() / "shell-history"  # from one session to the next
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("ab"):  # where it cannot be kept the session goes on without
            return FileHistory(str(path))
    except OSError:
        return InMemoryHistory()

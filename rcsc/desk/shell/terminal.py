"""A session's commands from a person or from a file.

In: commands, lines, functions that show. Out: 0, or 1 where a command failed. The only importer of prompt_toolkit, which is
asked only where there is a terminal. There, what is typed while cycles run is done between two of them.
"""

import os
import select
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.trust import state_folder
from rcsc.desk.shell.commands import Commands

if TYPE_CHECKING:
    from prompt_toolkit import PromptSession
    from prompt_toolkit.history import History

Show = Callable[[str], None]
MOST_TYPED = 4096
"""Bytes that a terminal gives at once: one line."""
_NOT_MEANWHILE = ("run", "step", "undo", "reload")
Complain = Callable[[str, Refused], None]
"""Shows a refusal; the text says where it arose, `script:3: `, or nothing."""


def follow(commands: Commands, lines: Iterable[str], name: str, show: Show, complain: Complain) -> int:
    """Run the lines in order, up to the first that fails: later ones would meet another state."""
    for number, line in enumerate(lines, 1):
        try:
            with _interruptible(commands):
                output = commands.do(line)
                if commands.session.interrupted:
                    raise KeyboardInterrupt
        except Refused as refused:
            complain(f"{name}:{number}: ", refused)
            return 1
        for text in output:
            show(text)
        if commands.over:
            break
    return 0


def converse(commands: Commands, show: Show, complain: Complain) -> int:
    """Run lines as they are typed until `quit` or the end of the input; show a refusal and go on."""
    from prompt_toolkit.shortcuts import clear

    prompt, commands.clear = _prompt(commands), clear
    listen(commands, show, complain)
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
            complain("", refused)
            continue
        for text in output:
            show(text)
    return 0


def listen(commands: Commands, show: Show, complain: Complain, terminal: int = 0) -> None:
    """Have what is typed while cycles run done between two of them.

    Args:
        commands: What does it.
        show: Shows what is said.
        complain: Shows a refusal; the cycles go on.
        terminal: Where it is typed: a terminal that gives whole lines.
    """

    def between() -> None:
        if not select.select([terminal], [], [], 0)[0]:
            return
        typed = os.read(terminal, MOST_TYPED).decode(errors="replace")
        commands.over |= not typed  # nobody is there any more
        for line in typed.splitlines():
            try:
                for text in _meanwhile(commands, line):
                    show(text)
            except Refused as refused:
                complain("", refused)
        commands.session.interrupted |= commands.over

    commands.heard, commands.session.between = True, between


def _meanwhile(commands: Commands, line: str) -> list[str]:
    """Do a line between two cycles.

    Raises:
        Refused: It was not done; cycles cannot be run, taken back or changed while they run.
    """
    word = line.partition("#")[0].strip().partition(" ")[0].casefold()
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

    path = history_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("ab"):  # where it cannot be kept the session goes on without
            return FileHistory(str(path))
    except OSError:
        return InMemoryHistory()


def history_path() -> Path:
    """Return where lines are kept from one session to the next."""
    return state_folder() / "shell-history"

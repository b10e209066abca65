"""A session's commands from a person or from a file.

In: commands, lines, functions that show. Out: 0, or 1 where a command failed. The only importer of prompt_toolkit, which is
asked only where there is a terminal.
"""

import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from rcsc.base.host.trust import state_folder
from rcsc.desk.shell.commands import Commands
from rcsc.desk.shell.reload.refusal import Refused

if TYPE_CHECKING:
    from prompt_toolkit import PromptSession
    from prompt_toolkit.history import History

Show = Callable[[str], None]
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

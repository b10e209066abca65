"""How a command ends that cannot go on: the code, what is wrong, what helps, and exit status 1; or 130, where it was interrupted."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import TYPE_CHECKING, ParamSpec

import click

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.render import WIDEST_LINE, full, plain
from rcsc.front.commands.shared.show import say, terminal_columns

if TYPE_CHECKING:
    from rcsc.base.host.described import BadFile

_P = ParamSpec("_P")


def say_error(code: Code, text: str, severity: str = "error") -> None:
    """Print a finding of one line on standard error."""
    say(f"{severity}[{code.value}]: {text}", err=True)


def attach(word: str, text: object) -> None:
    """Print a line that belongs to the finding above: a `note`, a `help`, a `log`."""
    say(f"  = {word}: {text}", err=True)


class Stopped(click.ClickException):  # what happened
    """A coded error of a run; exit status 1."""

    status = 1

    def __init__(self, code: Code, message: str, *helps: str) -> None:
        super().__init__(message)
        self.code, self.helps = code, helps

    def show(self, file: object = None) -> None:  # noqa: ARG002  # click's signature
        """Print the error in the form of all others."""
        for line in self.message.splitlines():
            say_error(self.code, line)
        for text in self.helps:
            attach("help", text)


class StoppedByFile(Stopped):
    """The faults of a description or a data file, each with its place."""

    def __init__(self, error: "BadFile") -> None:
        super().__init__(error.code, str(error))
        self.diagnostics, self.sources = error.diagnostics, error.sources

    def show(self, file: object = None) -> None:  # noqa: ARG002  # click's signature
        """Print each error, with its line in the file."""
        columns = terminal_columns(2)
        for diagnostic in self.diagnostics:
            rows = full(diagnostic, self.sources, columns or WIDEST_LINE, broken=columns is not None)
            click.echo(plain(rows), err=True)


class Interrupted(Stopped):
    """The user ended what was under way, or the system did; exit status 130."""

    status = 130


class Ending:
    """SIGINT and SIGTERM interrupt what runs inside, the user's code included; a second one ends the process, where that code holds on.

    Code may catch what interrupts it, and a library need not come back to Python.
    """

    def __init__(self) -> None:
        self._held = self._wanted = False

    @contextlib.contextmanager
    def inside(self) -> Iterator[None]:
        """Handle the signals inside; nowhere but in the main thread.

        Raises:
            KeyboardInterrupt: A signal came.
        """
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = [(number, signal.signal(number, self._end)) for number in (signal.SIGINT, signal.SIGTERM)]
        try:
            yield
        finally:
            for number, handler in before:
                signal.signal(number, handler)

    def whole(self, work: Callable[_P, object]) -> Callable[_P, None]:
        """Return the same work, which is interrupted once it is done."""

        def done(*args: _P.args, **kwargs: _P.kwargs) -> None:
            self._held = True
            try:
                work(*args, **kwargs)
            finally:
                self._held = False
            if self._wanted:
                raise KeyboardInterrupt

        return done

    def _end(self, _number: int, _frame: FrameType | None) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        self._wanted = True
        if not self._held:
            raise KeyboardInterrupt


def stopped(error: CodedError) -> Stopped:
    """Return the end of a command that met the error."""
    from rcsc.base.host.described import BadFile  # keep lazy: most commands end well

    if isinstance(error, BadFile) and error.diagnostics:
        return StoppedByFile(error)
    return Stopped(error.code, error.shown, *error.helps)

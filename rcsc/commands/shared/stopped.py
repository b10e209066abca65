"""How a command ends that cannot go on: the code, what is wrong, what helps, and exit status 1."""

from typing import TYPE_CHECKING

import click

from rcsc.diagnostics.coded import CodedError
from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.render import full, plain

if TYPE_CHECKING:
    from rcsc.host.described import BadFile


class Stopped(click.ClickException):  # what happened
    """A coded error of a run; exit status 1."""

    status = 1

    def __init__(self, code: Code, message: str, *helps: str) -> None:
        super().__init__(message)
        self.code, self.helps = code, helps

    def show(self, file: object = None) -> None:  # noqa: ARG002  # click's signature
        """The error, as every other is shown."""
        for line in self.message.splitlines():
            click.echo(f"error[{self.code.value}]: {line}", err=True)
        for text in self.helps:
            click.echo(f"  = help: {text}", err=True)


class StoppedByFile(Stopped):
    """The faults of a description or a data file, each with its place."""

    def __init__(self, error: "BadFile") -> None:
        super().__init__(error.code, str(error))
        self.diagnostics, self.sources = error.diagnostics, error.sources

    def show(self, file: object = None) -> None:  # noqa: ARG002  # click's signature
        """Each fault, with the line it stands in."""
        for diagnostic in self.diagnostics:
            click.echo(plain(full(diagnostic, self.sources)), err=True)


def stopped(error: CodedError) -> Stopped:
    """The end of a command that met the error."""
    from rcsc.host.described import BadFile  # keep lazy: most commands end well

    if isinstance(error, BadFile) and error.diagnostics:
        return StoppedByFile(error)
    return Stopped(error.code, error.shown, *error.helps)

"""What `rcsc log` and `rcsc replay` share: the file, and what can be wrong with it."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Span
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import Output, show
from rcsc.run.description import BadDescription
from rcsc.run.executors import NotBuilt
from rcsc.run.levels import BadState
from rcsc.run.log.queries import BadCondition
from rcsc.run.log.read import UnreadableLog

FILE = click.argument("file", type=There(dir_okay=False, path_type=Path), metavar="FILE")
SHOWN = 12
"""Differences, and restarts, that are shown of one level."""


def told(command: Callable[..., int]) -> Callable[..., int]:
    """Turn the errors of a log into coded findings about FILE."""

    @wraps(command)
    def wrapped(file: Path, **kwargs: Any) -> int:
        try:
            return command(file=file, **kwargs)
        except UnreadableLog as error:
            return refuse(file, Code.LOG_UNREADABLE, str(error))
        except (BadDescription, NotBuilt, BadState) as error:
            return refuse(file, Code.NOT_REPLAYED, f"the log cannot be replayed: {error}")
        except BadCondition as error:
            raise click.UsageError("; ".join((str(error), *error.helps))) from error

    return wrapped


def refuse(file: Path, code: Code, message: str, *, notes: tuple[str, ...] = (), help_: str = "") -> int:
    """Show an error of a log; return the exit status."""
    place = Label(Span(str(file), 0, 0))
    diagnostic = Diagnostic(code, message, place, notes=notes, help=(help_,) if help_ else ())
    show(Report((diagnostic,)), "log", Output(quiet=True))
    return 1

"""The command line: arguments in, text and an exit status out.

Exit statuses: 0 proved, 1 findings, 2 usage, 3 a bug in rcsc, 130 interrupted. Only here does anything print or end
the process. A command's module is imported when the command line has named it, and not before, so that `rcsc --help`
is quick; a package of an extra that is missing is one coded error (`shared/extras`).

>>> from rcsc.front.commands import run
>>> run(["explain", "RCS9"])  # a usage error, told on standard error
2

A command is one module: its options, one call that gives a report, and how the report is shown where the common forms
do not do. To add one, write the module, enter it in `group` with a summary, and add a row to `rcsc/README.md`; a test
compares the two. User errors are diagnostics in a report, or know their code (`rcsc.base.diagnostics.coded`) and end the
command; a full disk is RCS502, a worker that died RCS904, and everything else that is raised is a bug, RCS902.

Trusted: that the status is that of the report. What it costs: a process and the imports of one command.

Modules, in the order the data flows: `group` names every command and imports it; `tables` has those about files of
tables, `systems` those about systems of levels; `explain`, `new` and `completion` are about neither; `shared` is what
commands have in common.
"""

import contextlib
import errno
import os
import sys
import traceback
from collections.abc import Sequence

import click

from rcsc import __version__
from rcsc.base.diagnostics.printable import escape
from rcsc.front.commands.group import commands
from rcsc.front.commands.shared.show import UnwritableError

PROVED, FINDINGS, USAGE, BUG, INTERRUPTED = 0, 1, 2, 3, 130


def main() -> None:
    """Run `rcsc` with the process's arguments and end the process."""
    status = run(sys.argv[1:])
    try:
        if sys.stdout is not None:  # None where the process began without
            sys.stdout.flush()
    except OSError as error:
        status = status or _unwritable("standard output", error.strerror)
        _forget_stdout()
    if status == INTERRUPTED:
        from rcsc.base.host.children import leave  # keep lazy: most commands begin no process

        leave(status)
    sys.exit(status)


def run(args: Sequence[str]) -> int:
    """Run `rcsc` with `args`; return the exit status."""
    try:
        status = commands.main(list(args), prog_name="rcsc", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        return int(getattr(error, "status", USAGE))
    except (click.Abort, KeyboardInterrupt):
        click.echo("rcsc: interrupted; nothing was half written", err=True)
        return INTERRUPTED
    except UnwritableError as error:
        return _unwritable(*error.args)
    except BrokenPipeError:
        _forget_stdout()
        return FINDINGS
    except OSError as error:
        if error.errno not in _FULL:
            return _bug(error)
        return _unwritable(f"`{error.filename}`" if error.filename else "a file", error.strerror)
    except Exception as error:  # noqa: BLE001  # whatever it is, it is a bug in rcsc and is reported as one
        return _bug(error)
    return status if isinstance(status, int) else PROVED


_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)


def _unwritable(place: str, why: str | None) -> int:
    """Report a full disk, or one that is read only."""
    with contextlib.suppress(OSError):  # it may be the disk that this goes to
        click.echo(
            f"error[RCS502]: {place} cannot be written: {why or 'no reason given'}\n"
            "  = note: a file that was there is as it was before, whole; a log is kept as far as it goes",
            err=True,
        )
    return FINDINGS


def _forget_stdout() -> None:
    """Let the interpreter's last flush go nowhere: whoever read the output has gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _bug(error: Exception) -> int:
    from rcsc.base.host.children import WorkerEndedError

    if isinstance(error, WorkerEndedError):
        click.echo(
            f"error[RCS904]: {error}\n"
            "  = note: the question that it worked on is undecided\n"
            "  = help: if memory was short, `--jobs 1` takes less of it",
            err=True,
        )
        return BUG
    frames = traceback.extract_tb(error.__traceback__)
    place = f"{os.path.basename(frames[-1].filename)}:{frames[-1].lineno}" if frames else "?"
    what = escape(f"{type(error).__name__}: {error}")[:300]
    click.echo(
        f"error[RCS902]: a bug in rcsc {__version__}: {what} ({place})\n"
        "  = note: nothing was proved, and nothing was written\n"
        "  = help: please report it with the tables, if you can, and what RCSC_DEBUG=1 prints",
        err=True,
    )
    if os.environ.get("RCSC_DEBUG") == "1":
        traceback.print_exception(error)
    return BUG

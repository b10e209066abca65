"""Shells for tests: over levels with nothing outside, what they say, and what they refuse."""

from pathlib import Path

import pytest

from rcsc.base.diagnostics.coded import Refused
from rcsc.desk.shell.commands import Commands
from rcsc.desk.shell.reload.reload import Origin
from rcsc.desk.shell.session import Session, silent_queries
from rcsc.run.description import description
from rcsc.run.system import Kind, assemble, signatures
from tests.support.cells import SYSTEM


def alone(path: Path = SYSTEM, kind: Kind = "c") -> Commands:
    """Return a shell over levels with nothing outside and a database that knows nothing."""
    said = description(path)
    queries = silent_queries(said, signatures(said))
    return Commands(Session(assemble(said, kind, queries), Origin(path, said, kind, queries)))


def do(commands: Commands, *lines: str) -> list[str]:
    """Do the lines; return what the last one said."""
    return [commands.do(line) for line in lines][-1]


def refused(commands: Commands, line: str) -> Refused:
    """Return why the shell refuses a line."""
    with pytest.raises(Refused) as caught:
        commands.do(line)
    return caught.value


def state(commands: Commands) -> list[object]:
    """Return the cycle, the buffers and the variables of each level, to be compared."""
    session = commands.session
    return [session.system.tick, dict(session.memory.held), *[level.values for level in session.levels]]

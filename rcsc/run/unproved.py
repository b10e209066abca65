"""Executors that were made by force, of tables that do not prove: the cell does not run them.

In: a description. Out: the generated files that bear the mark (`host.files.write.UNPROVED`).
"""

from pathlib import Path

from rcsc.diagnostics.codes import Code
from rcsc.host.files.read import content
from rcsc.host.files.write import UNPROVED
from rcsc.run.description import BadDescription, Description
from rcsc.run.signature import generated_files


class UnprovedExecutors(BadDescription):
    """A generated file bears the mark; says which."""

    code = Code.EXECUTORS_NOT_PROVED
    helps = ("mend the tables, then `rcsc compile`",)


def marked(system: Description) -> tuple[Path, ...]:
    """The generated files of the system's programs that bear the mark, wherever in their text."""
    mark = UNPROVED.encode()
    programs = dict.fromkeys(spec.program for spec in system.levels)
    files = (path for name in programs for path in generated_files(system.generated, name))
    return tuple(path for path in files if path.is_file() and mark in content(path))


def refuse_unproved(system: Description) -> None:
    """Stops before anything moves.

    Raises:
        UnprovedExecutors: A generated file bears the mark.
    """
    if found := marked(system):
        raise UnprovedExecutors(f"`{found[0]}` is made of tables that are not proved, to run a finding")

"""A list of requirements held against those that the tables name: which have no place, which line has none.

In: matrices, and perhaps a file with one name in each line. Out: places by requirement, and findings.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files.read import text
from rcsc.views.trace.matrix import Matrix


def listed(path: Path) -> tuple[str, ...]:
    """Read the names of requirements: one in each line, blank lines and those that begin with `#` left out.

    Raises:
        OSError: The file cannot be read.
        Malformed: It is no text, or too large.
    """
    lines = (line.strip() for line in text(path).splitlines())
    return tuple(dict.fromkeys(line for line in lines if line and not line.startswith("#")))


def places(matrices: Iterable[Matrix]) -> dict[str, list[str]]:
    """Give the places that name each requirement, in the order in which they are met.

    A table and a procedure of a file that several programs use stand there once.
    """
    found: dict[str, dict[str, None]] = {}
    for matrix in matrices:
        for name, place in _named(matrix):
            found.setdefault(name, {})[place] = None
    return {name: list(where) for name, where in sorted(found.items())}


def _named(matrix: Matrix) -> Iterator[tuple[str, str]]:
    for table, names in matrix.requirements.items():
        yield from ((name, f"table {table}") for name in names)
    for line in matrix.lines:
        yield from ((name, f"{line.table} line {line.name}") for name in line.requirements)
    for one in matrix.declared:
        yield from ((name, f"{one.sort} {one.name}") for name in one.requirements)


def findings(matrices: Sequence[Matrix], wanted: Sequence[str], file: Path) -> Iterator[Diagnostic]:
    """Report each listed requirement that nothing names, each named one that is not listed, and lines that name none."""
    known = places(matrices)
    at = Label(Span(str(file), 0, 0))
    for name in wanted:
        if name not in known:
            near = get_close_matches(name, known, 1)
            yield Diagnostic(
                Code.REQUIREMENT_OPEN, f"nothing in the tables is for requirement `{name}`", at,
                help=(f"did you mean `{near[0]}`, which the tables name?",) if near else (),
            )  # fmt: skip
    for name, where in known.items():
        if name not in wanted:
            near = get_close_matches(name, wanted, 1)
            yield Diagnostic(
                Code.REQUIREMENT_OPEN, f"requirement `{name}` is not in the list", at,
                notes=tuple(f"named by {place}" for place in where),
                help=(f"did you mean `{near[0]}`?",) if near else (),
            )  # fmt: skip
    yield from _without(matrices)


def _without(matrices: Iterable[Matrix]) -> Iterator[Diagnostic]:
    for matrix in matrices:
        lines = [line for line in matrix.lines if not line.answers]
        if lines:
            message = (
                f"{len(lines)} of {len(matrix.lines)} lines of program `{matrix.program}` name no requirement"
            )
            yield Diagnostic(
                Code.REQUIREMENT_OPEN, message, Label(Span(matrix.source, 0, 0)), severity=Severity.WARNING,
                notes=tuple(f"{line.place}: {line.table} line {line.name}" for line in lines),
            )  # fmt: skip


def covered(known: Mapping[str, Sequence[str]], wanted: Sequence[str]) -> str:
    """Say how many of the listed requirements have a place."""
    return f"{sum(name in known for name in wanted)} of {len(wanted)} requirements have a place"

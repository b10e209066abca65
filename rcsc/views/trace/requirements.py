"""A list of requirements held against those that the tables name: which have no place, which line has none.

In: matrices, and perhaps a file with one name in each line. Out: places and standing by requirement, and findings.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files.read import text
from rcsc.run.description import description
from rcsc.run.orders.script import BadScript, tested_by
from rcsc.views.trace.matrix import Declared, Matrix, Tests, TracedLine


def listed(path: Path) -> tuple[str, ...]:
    """Read the names of requirements: one in each line, blank lines and those that begin with `#` left out.

    Raises:
        OSError: The file cannot be read.
        Malformed: It is no text, or too large.
    """
    lines = (line.strip() for line in text(path).splitlines())
    return tuple(dict.fromkeys(line for line in lines if line and not line.startswith("#")))


SCRIPT = "row of script"
"""The sort of what tests a requirement by orders and their end."""
MOST_PARTS = 6
"""Parts of a file that carry no requirement, named in a note."""


@dataclass(frozen=True, slots=True)
class Standing:
    """The standing of a requirement at one place that names it.

    Attributes:
        verdict: What is proved there.
        tests: How many vectors take a line of it: made of the tables, and not of what the requirement says.
        coverage: How many conditions of its lines a pair of vectors shows to decide them.
    """

    place: str
    verdict: str
    tests: str
    coverage: str

    @property
    def refuted(self) -> bool:
        """Whether it was found not to hold."""
        return self.verdict.startswith("refuted")

    @property
    def open(self) -> bool:
        """Whether it was asked, and is neither proved nor refuted."""
        return self.verdict.startswith("open")


def standings(matrices: Iterable[Matrix]) -> dict[str, list[Standing]]:
    """Give the places that name each requirement, in the order in which they are met, with its standing there.

    A table and a procedure of a file that several programs use stand there once; what is refuted of one counts.
    """
    found: dict[str, dict[str, Standing]] = {}
    for matrix in matrices:
        for name, here in _named(matrix):
            known = found.setdefault(name, {})
            if here.place not in known or here.refuted or (here.open and not known[here.place].refuted):
                known[here.place] = here
    return {name: list(where.values()) for name, where in sorted(found.items())}


def places(matrices: Iterable[Matrix]) -> dict[str, list[str]]:
    """Give the places that name each requirement."""
    return {name: [one.place for one in where] for name, where in standings(matrices).items()}


def _named(matrix: Matrix) -> Iterator[tuple[str, Standing]]:
    verdicts = {name: f"{proof.verdict}: {proof.method}" for name, proof in matrix.tables.items()}
    for table, names in matrix.requirements.items():
        lines = [line for line in matrix.lines if line.table == table]
        here = _standing(f"table {table}", verdicts.get(table, ""), lines)
        yield from ((name, here) for name in names)
    for line in matrix.lines:
        here = _standing(f"{line.table} line {line.name}", verdicts.get(line.table, ""), [line])
        yield from ((name, here) for name in line.requirements)
    for one in matrix.declared:
        here = _standing(f"{one.sort} {one.name}", one.proof, [*_lines_of(matrix, one)])
        if one.sort == SCRIPT:  # made of what the requirement says, and not of the tables
            here = replace(here, tests=f"`{one.states}`, made by `rcsc run`")
        yield from ((name, here) for name in one.requirements or _own(one))


def _own(one: Declared) -> tuple[str, ...]:
    """Return the name of a requirement that is declared, and is for none that has a name elsewhere."""
    return (one.name,) if one.sort == "requirement" and not one.requirements else ()


def stated(matrices: Iterable[Matrix]) -> frozenset[str]:
    """Return the names of the requirements that are declared, and for none that a list would have."""
    return frozenset(name for matrix in matrices for one in matrix.declared for name in _own(one))


def of_scripts(system: Path) -> Iterator[Declared]:
    """Yield the rows of a system's script, and of those in the folder `scripts` beside it, that name requirements.

    Raises:
        BadDescription: The system is not in order.
        BadScript: Its script cannot be read.
    """
    named = description(system).script
    others = sorted(path for end in ("csv", "toml") for path in (system.parent / "scripts").glob(f"*.{end}"))
    for path in dict.fromkeys(path.resolve() for path in (*((named,) if named else ()), *others)):
        here = system.parent / os.path.relpath(path, system.parent.resolve())
        try:
            rows = list(tested_by(path))
        except BadScript:
            if named is not None and path == named.resolve():
                raise
            continue  # it is something else
        for number, shown, names in rows:
            line = f":{number + 1}" if path.suffix == ".csv" else ""
            yield Declared(SCRIPT, f"{path.name} {number}", f"{here}{line}", names, shown)


def _lines_of(matrix: Matrix, one: Declared) -> Iterator[TracedLine]:
    """Yield the lines that run a procedure, speak of a property, or are of a table that relies on an assumption."""
    for line in matrix.lines:
        runs = one.sort == "procedure" and one.name in line.procedures
        speaks = one.sort in {"property", "requirement"} and one.name in dict(line.properties)
        if runs or speaks or f"table {line.table}" in one.used:
            yield line


def _standing(place: str, verdict: str, lines: Sequence[TracedLine]) -> Standing:
    looked = [line.tests for line in lines if line.tests != Tests()]
    if not looked:
        return Standing(place, verdict, "", "")
    vectors = {number for tests in looked for number in tests.taken}
    shown, every = sum(tests.shown for tests in looked), sum(tests.conditions for tests in looked)
    return Standing(
        place,
        verdict,
        f"{len(vectors)} {'vector' if len(vectors) == 1 else 'vectors'} of the tables",
        f"{shown} of {every} conditions",
    )


def refuted(matrices: Sequence[Matrix]) -> Iterator[Diagnostic]:
    """Report each requirement that is refuted, or was left open, at a place that names it."""
    sources = {f"{one.sort} {one.name}": one.place for matrix in matrices for one in matrix.declared}
    for name, where in standings(matrices).items():
        for one in where:
            if one.refuted or one.open:
                file = sources.get(one.place, "").rpartition(":")[0]
                yield Diagnostic(
                    Code.REQUIREMENT_OPEN, f"requirement `{name}` is {'refuted' if one.refuted else 'open'}: {one.place} is {one.verdict}",
                    Label(Span(file, 0, 0)),
                )  # fmt: skip


def findings(matrices: Sequence[Matrix], wanted: Sequence[str], file: Path) -> Iterator[Diagnostic]:
    """Report each listed requirement that nothing names, each named one that is not listed, and lines that name none."""
    known, own = places(matrices), stated(matrices)
    at = Label(Span(str(file), 0, 0))
    for name in wanted:
        if name not in known:
            near = get_close_matches(name, known, 1)
            yield Diagnostic(
                Code.REQUIREMENT_OPEN, f"nothing in the tables is for requirement `{name}`", at,
                help=(f"did you mean `{near[0]}`, which the tables name?",) if near else (),
            )  # fmt: skip
    for name, where in known.items():
        if name not in wanted and name not in own:
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
        yield from _parts(matrix)


def _parts(matrix: Matrix) -> Iterator[Diagnostic]:
    """Tell the parts of the code that carry no requirement, file by file; `code.csv` has every one."""
    parts: dict[str, dict[str, None]] = {}
    for piece in matrix.pieces:
        if not matrix.answers(piece.origin):
            parts.setdefault(piece.file, {})[piece.origin.words] = None
    if parts:
        count = sum(map(len, parts.values()))
        message = f"{count} parts of the code of `{matrix.program}` carry no requirement"
        yield Diagnostic(
            Code.REQUIREMENT_OPEN, message, Label(Span(matrix.source, 0, 0)), severity=Severity.WARNING,
            notes=tuple(f"{file}: {_some([*words])}" for file, words in parts.items()),
        )  # fmt: skip


def _some(words: Sequence[str]) -> str:
    more = f", and {len(words) - MOST_PARTS} more" if len(words) > MOST_PARTS else ""
    return f"{', '.join(words[:MOST_PARTS])}{more}"


def covered(known: Mapping[str, Sequence[Standing]], wanted: Sequence[str]) -> str:
    """Say how many of the listed requirements have a place, and how they stand."""
    placed = [known[name] for name in wanted if name in known]
    false = sum(any(one.refuted for one in where) for where in placed)
    proved = sum(all(one.verdict.startswith("proved") for one in where) for where in placed)
    rest = len(placed) - proved - false
    words = f"{proved} proved, {false} refuted, {rest} assumed, open or not proved here"
    return f"{len(placed)} of {len(wanted)} requirements have a place: {words}"

"""Two versions of programs compared: everything that changed, or the proof that nothing did.

In: resolved programs. Out: a `ProgramDifference`. What a solver gives up on is named, and then nothing is called proved.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from rcsc.lang.model import Program
from rcsc.proof.procedures.obligations import Obligations
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.views.diff.changes import parts
from rcsc.views.diff.changes.align import aligned
from rcsc.views.diff.changes.cycles import follows, traces
from rcsc.views.diff.changes.difference import ComparedPart, Difference, ProgramDifference, Traces
from rcsc.views.diff.changes.tables import table_part
from rcsc.views.diff.changes.versions import Versions
from rcsc.views.diff.revision import NotComparedError
from rcsc.views.diff.sides import Side, pairs


def compare(
    name: str, before: Program, after: Program, options: Options, *, follow: bool = False
) -> ProgramDifference:
    """Return the changes between two versions of a program; with `follow`, also which lines can follow which."""
    alignment = aligned(before, after)
    versions = Versions(alignment, options)
    given_up: tuple[type[BaseException], ...] = (TooLongError, RecursionError, *smt.troubles())
    undecided: list[str] = []
    compared: list[ComparedPart] = []
    for what, steps in _steps(versions):
        try:
            # a table, all procedures or all levels take no more than a question may
            with smt.together(options.steps):
                compared += steps()
        except given_up:
            undecided.append(what)
    reported = [
        *(change.what for change in alignment.changes),
        *(f"{part.what} `{part.name}`" for part in compared if part.changed),
    ]
    try:
        compared = _with_stops(versions, compared, everywhere=bool(alignment.changes or undecided))
    except given_up:
        undecided.append("which assumptions stop")
    compared += parts.unreported(versions, reported)
    seen: tuple[Traces, ...] = ()
    if not undecided:
        try:
            seen = tuple(level for level in traces(versions) if level.new or level.gone)
        except given_up:
            undecided.append("the state graphs of levels")
    pairs = (
        tuple(level for level in follows(versions) if level.new or level.gone or not level.decided)
        if follow
        else ()
    )
    return ProgramDifference(
        name,
        alignment.changes,
        tuple(compared),
        seen,
        tuple(undecided),
        pairs,
        dict(versions.kinds),
        tuple(_required(before, after)),
    )


def _steps(versions: Versions) -> Iterator[tuple[str, Callable[[], Iterable[ComparedPart]]]]:
    """Yield the comparisons, one after the other, each with a name for one that cannot be decided."""
    old = {str(table.name): table for table in versions.before.tables}
    new = {str(table.name): table for table in versions.after.tables}
    for name in dict.fromkeys((*old, *new)):
        if name in old and name in new:
            yield f"table `{name}`", lambda n=name: [table_part(versions, old[n], new[n])]  # type: ignore[misc]  # bound early
        else:
            notes = ("gone",) if name in old else ("new",)
            yield "", lambda n=name, s=notes: [ComparedPart("table", n, s)]  # type: ignore[misc]  # bound early
    yield "procedures", lambda: list(parts.procedures(versions))
    yield "levels", lambda: list(parts.levels(versions))
    yield "assumptions, invariants and properties", lambda: list(parts.conditions(versions))


_APART = frozenset({"table", "level", "property", "requirement", "preprocess", "postprocess"})
"""Parts on which the stopping assumptions of another table do not rest."""


def _with_stops(
    versions: Versions, compared: Sequence[ComparedPart], *, everywhere: bool
) -> list[ComparedPart]:
    """Return the parts, with a note where assumptions of a table newly stop the cycle, or no longer do.

    Args:
        versions: The two programs.
        compared: All parts.
        everywhere: Whether more changed than these.
    """
    everywhere = everywhere or any(part.changed and part.what not in _APART for part in compared)
    wanted = {
        part.name for part in compared if part.what == "table" and (part.changed or part.moved or everywhere)
    }
    before, after = (
        {str(table.name): table for table in program.tables if table.name in wanted and table.assumptions}
        for program in (versions.before, versions.after)
    )
    stops = [
        Obligations(program, versions.options).stopping(tables.values())
        for program, tables in ((versions.before, before), (versions.after, after))
        if before.keys() | after.keys()
    ]
    alone = {part.name for part in compared if part.notes in (("gone",), ("new",))}
    return [
        replace(part, notes=(*part.notes, *_stops(stops, part.name)))
        if part.what == "table" and stops and part.name not in alone
        else part
        for part in compared
    ]


def _stops(stops: Sequence[Mapping[str, Sequence[str]]], table: str) -> Iterator[str]:
    before, after = (stop.get(table, ()) for stop in stops)
    yield from (f"`{name}` no longer stops the cycle where it fails" for name in before if name not in after)
    yield from (f"`{name}` newly stops the cycle where it fails" for name in after if name not in before)


def _required(before: Program, after: Program) -> Iterator[str]:
    """Say of each place that names other requirements than before which are new and which are gone; no meaning changes with that.

    A line that was renamed is another place.
    """
    old, new = dict(_places(before)), dict(_places(after))
    for place in dict.fromkeys((*old, *new)):
        gone = [name for name in old.get(place, ()) if name not in new.get(place, ())]
        more = [name for name in new.get(place, ()) if name not in old.get(place, ())]
        told = [f"{word} {', '.join(names)}" for word, names in (("new", more), ("gone", gone)) if names]
        if told:
            yield f"{place}: {'; '.join(told)}"


def _places(program: Program) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Give each place of a program that can name requirements, in words, and those that it names."""
    for table in program.tables:
        yield f"table `{table.name}`", table.requirements
        for line in table.every_line:
            yield f"table `{table.name}`, line {line.name}", line.requirements
    yield from ((f"procedure `{one.name}`", one.requirements) for one in program.procedures)
    yield from ((f"assumption `{one.name}`", one.requirements) for one in program.assumptions)
    yield from ((f"invariant `{one.name}`", one.requirements) for one in program.invariants)
    yield from ((f"{one.word} `{one.name}`", one.requirements) for one in program.stated)


def difference(
    before: Side, after: Side, options: Options, progress: Callable[[str], None], *, follow: bool = False
) -> Difference:
    """Return the changes between two sides, program by program; with `follow`, also which lines can follow which.

    Raises:
        NotComparedError: Neither side has a program.
    """
    if not before.programs and not after.programs:
        raise NotComparedError(
            "neither side has a table to compare", "give a file, or a folder with `*.rcs` files"
        )
    programs, notes = [], []
    for name, old, new in pairs(before, after):
        if old is None or new is None:
            notes.append(f"program `{name}` is {'new' if old is None else 'gone'}")
        else:
            progress(f"comparing {name}")
            programs.append(compare(name, old, new, options, follow=follow))
    return Difference(before.name, after.name, tuple(programs), tuple(notes))

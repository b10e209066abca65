"""Test vectors by MC/DC: every condition of every line shown to decide the line on its own.

In: a program and one of its tables. Out: pairs of snapshots that differ in the truth of one condition and
in whether the line matches, with the line that each one takes; and the conditions for which there is no
pair, with the reason.

Source: unique-cause MC/DC, and masking MC/DC where coupled conditions leave no unique cause
(CAST-6, "Rationale for accepting masking MC/DC", 2001).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from rcsc.code.testing.inputs.condition_text import words
from rcsc.code.testing.inputs.snapshot import InputSearch, Missing, Wanted, conjunction, expr_of
from rcsc.lang.interpret import holds, matching_lines
from rcsc.lang.model import Apply, Expr, Line, Program, Snapshot, Table, Test, pending
from rcsc.lang.operator_table import Op, is_logic

MOST_ATOMS = 8  # of one `when` cell; its truth table is enumerated


@dataclass(frozen=True, slots=True)
class Vector:
    """A snapshot with the line it takes.

    Attributes:
        line: The line whose condition this vector is for.
        column: The heading that the condition stands under; empty for `reach`.
        condition: The condition in the table's words; empty for `reach`.
        purpose: `reach`, or `true` / `false`, the truth of the condition here.
        expected: Name of the line that matches; empty where none does.
        snapshot: A value for every leaf.
    """

    line: str
    column: str
    condition: str
    purpose: str
    expected: str
    snapshot: Snapshot


@dataclass(frozen=True, slots=True)
class Unshown:
    """A condition (or, where `condition` is empty, a whole line) that has no vector.

    Attributes:
        reason: `ranges` or `assumptions` (shown impossible within them), or `not found`.
    """

    line: str
    column: str
    condition: str
    reason: str


@dataclass(frozen=True, slots=True)
class Vectors:
    """All vectors of one table."""

    table: str
    conditions: int
    shown: int
    vectors: tuple[Vector, ...]
    unshown: tuple[Unshown, ...]


def atoms(test: Test) -> tuple[Test | Expr, ...]:
    """The conditions of one cell: a cell on one leaf is one; others are parted at and, or, not, implies."""
    if test.box is not None:
        return (test,)
    conditions: dict[Expr, None] = {}

    def part(expr: Expr) -> None:
        if isinstance(expr, Apply) and (is_logic(expr.op) or expr.op is Op.NOT):
            for arg in expr.args:
                part(arg)
        else:
            conditions.setdefault(expr)

    part(test.condition)
    return tuple(conditions) if len(conditions) <= MOST_ATOMS else (test,)


def _truth(expr: Expr, known: Mapping[Expr, bool]) -> bool:
    """The truth of a formula from that of its atoms."""
    if expr in known or not isinstance(expr, Apply):
        return known[expr]
    args = [_truth(arg, known) for arg in expr.args]
    return bool(expr.op.meaning(*args))


@dataclass(frozen=True, slots=True)
class _Pair:
    """Truths of one cell's atoms: the cell holds in `on`, fails in `off`, by the one atom's change."""

    on: tuple[Wanted, ...]
    off: tuple[Wanted, ...]
    atom: Test | Expr
    truth_on: bool


def _assignments(test: Test, parts: Sequence[Test | Expr]) -> list[tuple[bool, ...]]:
    """The truths of the atoms under which the cell holds."""
    exprs = [expr_of(part) for part in parts]
    truths = product((True, False), repeat=len(parts))
    return [t for t in truths if _truth(test.condition, dict(zip(exprs, t, strict=True)))]


def _pairs(test: Test, atom: int, parts: Sequence[Test | Expr]) -> Iterator[_Pair]:
    """Unique-cause pairs first, then masking ones."""
    holding = _assignments(test, parts)
    good = set(holding)

    def flipped(truths: tuple[bool, ...]) -> tuple[bool, ...]:
        return (*truths[:atom], not truths[atom], *truths[atom + 1 :])

    deciding = [t for t in holding if flipped(t) not in good]

    def pair(on: tuple[bool, ...], off: tuple[bool, ...]) -> _Pair:
        wanted = tuple(zip(parts, on, strict=True)), tuple(zip(parts, off, strict=True))
        return _Pair(*wanted, parts[atom], on[atom])

    yield from (pair(on, flipped(on)) for on in deciding)
    for on, other in product(deciding, deciding):
        off = flipped(other)
        if on != other and off[atom] != on[atom]:
            yield pair(on, off)


def _spelled(condition: Test | Expr) -> str:
    return condition.text if isinstance(condition, Test) else words(condition)


@dataclass(slots=True)
class Finder:
    """Makes the vectors of one table."""

    search: InputSearch
    table: Table
    given: tuple[Wanted, ...]

    def find(self, wanted: Sequence[Wanted], prefer: Snapshot | None = None) -> Snapshot | Missing:
        """As `Search.find`; deferred values are settled where possible, so that a step takes the line."""
        snapshot = self.search.find(wanted, prefer)
        if isinstance(snapshot, Missing):
            return snapshot
        deferred = [v.name for v in self.search.program.variables if v.deferred_until is not None]
        steady = {**snapshot, **{str(pending(name)): snapshot[name] for name in deferred}}
        return steady if all(holds(expr_of(c), steady) is truth for c, truth in wanted) else snapshot

    def name_at(self, snapshot: Snapshot) -> str:
        """The line that the reference takes; empty where none or several match."""
        names = matching_lines(self.table, snapshot)
        if not names and self.table.default is not None:
            return str(self.table.default.name)
        return str(names[0]) if len(names) == 1 else ""

    def reach(self, line: Line) -> Snapshot | Missing:
        """A snapshot that takes the line."""
        return self.find((*self.given, *((t, True) for t in line.tests if t is not None)))

    def default(self) -> Snapshot | Missing:
        """A snapshot that no line matches."""
        tests = ([(test, True) for test in line.tests if test is not None] for line in self.table.lines)
        return self.find((*self.given, *((conjunction(line), False) for line in tests)))

    def pair(self, line: Line, test: Test, atom: int) -> tuple[Snapshot, Snapshot, _Pair] | str:
        """The two snapshots of one condition, or the reason why there are none."""
        others: tuple[Wanted, ...] = tuple((t, True) for t in line.tests if t is not None and t is not test)
        unknown = False
        for pair in _pairs(test, atom, atoms(test)):
            on = self.find((*self.given, *others, *pair.on))
            off = on if isinstance(on, Missing) else self.find((*self.given, *others, *pair.off), prefer=on)
            if not isinstance(on, Missing) and not isinstance(off, Missing):
                return on, off, pair
            unknown = unknown or Missing.UNKNOWN in (on, off)
        return "not found" if unknown else self._reason(test, atom, others)

    def _reason(self, test: Test, atom: int, others: tuple[Wanted, ...]) -> str:
        for pair in _pairs(test, atom, atoms(test)) if self.given else ():
            if all(
                not isinstance(self.search.find((*others, *side)), Missing) for side in (pair.on, pair.off)
            ):
                return "assumptions"
        return "ranges"


def given_in(program: Program, table: Table) -> tuple[Wanted, ...]:
    """What every vector must satisfy: the table's assumptions and the program's invariants."""
    used = [a.condition for a in program.assumptions if a.name in table.assumptions]
    return tuple((expr, True) for expr in (*used, *(i.condition for i in program.invariants)))


def vectors_of(search: InputSearch, table: Table, lines: Sequence[Line] | None = None) -> Vectors:
    """Vectors for the table's lines (or for those given).

    Args:
        search: A search over the table's program.
        table: A table of that program.
        lines: Lines to make vectors for; all of them if None.
    """
    finder = Finder(search, table, given_in(search.program, table))
    vectors: list[Vector] = []
    unshown: list[Unshown] = []
    conditions = shown = 0
    for line in table.lines if lines is None else lines:
        _reached(finder, str(line.name), finder.reach(line), vectors, unshown)
        for column, test in _stated(table, line):
            for number, atom in enumerate(atoms(test)):
                conditions += 1
                text = _spelled(atom)
                answer = finder.pair(line, test, number)
                if isinstance(answer, str):
                    unshown.append(Unshown(line.name, column, text, answer))
                    continue
                shown += 1
                on, off, pair = answer
                for snapshot, truth in ((on, pair.truth_on), (off, not pair.truth_on)):
                    named = finder.name_at(snapshot)
                    purpose = str(truth).lower()
                    vectors.append(Vector(line.name, column, text, purpose, named, snapshot))
    if table.default is not None and lines is None:
        _reached(finder, str(table.default.name), finder.default(), vectors, unshown)
    return Vectors(table.name, conditions, shown, tuple(vectors), tuple(unshown))


def _stated(table: Table, line: Line) -> Iterator[tuple[str, Test]]:
    """Each cell of a line that says something, with its heading."""
    for column, test in zip(table.columns, line.tests, strict=True):
        if test is not None:
            yield column.heading, test


def _reached(
    finder: Finder, name: str, found: Snapshot | Missing, vectors: list[Vector], unshown: list[Unshown]
) -> None:
    """Add the vector that takes a line, or why there is none."""
    if isinstance(found, Missing):
        reason = "not found" if found is Missing.UNKNOWN else "ranges"
        unshown.append(Unshown(name, "", "", reason))
    else:
        vectors.append(Vector(name, "", "", "reach", finder.name_at(found), found))

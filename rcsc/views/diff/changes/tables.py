"""Two versions of one table: where another line, another effect, or none or several lines.

In: two tables over shared leaves. Out: a `ComparedPart`. Inputs at which the versions differ are found one pair of lines after the
other; when the solver finds no more, that is the proof that nothing else changed.
"""

from collections.abc import Iterator, Mapping, Sequence

from rcsc.lang.interpret import matching_lines
from rcsc.lang.leaves import everything, written_by
from rcsc.lang.model import Action, Bool, Call, Program, Statement, Table
from rcsc.proof.relation.effect import Meaning
from rcsc.proof.relation.same import NO_LINE, SEVERAL_LINES, UNDEFINED, Outcome, outcomes
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node
from rcsc.views.diff.changes.contrast import Contrast, changes, contrast
from rcsc.views.diff.changes.difference import Basis, Change, ComparedPart, PartSort
from rcsc.views.diff.changes.versions import Doing, Versions, is_hard, runner


def table_part(versions: Versions, before: Table, after: Table) -> ComparedPart:
    """Return the changes between two versions of a table.

    Raises:
        UndecidedError: The solver gave up.
        TooLongError, RecursionError: A procedure has more steps than are followed.
    """
    name = str(after.name)
    if versions.digests[0].table(before) == versions.digests[1].table(after):
        return ComparedPart("table", name, basis=Basis.DIGEST)
    apart = sorted(versions.aligned.apart & (_touched(versions, 0, before) | _touched(versions, 1, after)))
    if apart:
        notes = (f"cannot be compared: {', '.join(f'`{leaf}`' for leaf in apart)} changed its kind",)
        return ComparedPart("table", name, (*notes, *_claims(before, after)))
    return _Comparison(versions, before, after).part()


def _claims(before: Table, after: Table) -> Iterator[str]:
    """Return the changes of a table that no region shows: the assumptions that it may rely on, and its DEFAULT."""
    gone = [name for name in before.assumptions if name not in after.assumptions]
    new = [name for name in after.assumptions if name not in before.assumptions]
    yield from (f"no longer assumes `{name}`" for name in gone)
    yield from (f"assumes `{name}`, too" for name in new)
    orders = [
        [name for name in names if name not in (*gone, *new)]
        for names in (before.assumptions, after.assumptions)
    ]
    if orders[0] != orders[1]:
        yield "its assumptions stand in another order"
    first, second = (_default(table) for table in (before, after))
    if first != second:
        yield f"its DEFAULT line: {first}, now {second}"


def _default(table: Table) -> str:
    if table.default is None:
        return "none"
    return "unreachable" if table.default.unreachable else "reachable"


def _touched(versions: Versions, side: int, table: Table) -> set[str]:
    body = [action.statement for line in table.every_line for action in line.actions]
    return versions.digests[side].touched(body, [test.condition for test in table.distinct_tests])


class _Comparison:
    """One table being compared.

    Attributes:
        outcomes: Of each version, by key, in order of the table.
        relied: Where the assumptions of one version at least hold.
    """

    def __init__(self, versions: Versions, before: Table, after: Table) -> None:
        self.versions, self.tables = versions, (before, after)
        self.meanings = versions.meanings()
        self.outcomes = tuple(map(_outcomes, self.tables, self.meanings))
        self.relied = versions.shared.canonical(values.any_of(map(assumed, self.tables, versions.meanings())))

    def part(self) -> ComparedPart:
        """Return the table as a part: everything that changed."""
        versions, before = self.versions, self.versions.tally.queries
        changed: list[Change] = []
        moved: list[Change] = []
        first, second = (list(outs.values()) for outs in self.outcomes)
        kept = [
            (out, self.outcomes[1][key]) for key, out in self.outcomes[0].items() if key in self.outcomes[1]
        ]
        pairs = [*(pair for pair in kept if self._bodies_differ(*pair)), *self._pairs(kept)]
        for pair in sorted(pairs, key=lambda pair: (first.index(pair[0]), second.index(pair[1]))):
            for change in self._compared(*pair):
                (moved if change.sort is PartSort.LINE else changed).append(change)
        space = versions.space(*(out.when for outs in self.outcomes for out in outs.values()))
        return ComparedPart(
            "table", str(self.tables[1].name), tuple(_claims(*self.tables)), tuple(changed), tuple(moved), Basis.SOLVER,
            versions.tally.queries - before, space.volume(space.nodes),
        )  # fmt: skip

    def _bodies_differ(self, before: Outcome, after: Outcome) -> bool:
        """Return whether a line's actions, and all that they call, are not word for word the same."""
        if before.actions is None or after.actions is None:
            return False
        bodies = [_body(out.actions) for out in (before, after)]
        first, second = (
            digests.body(body) for digests, body in zip(self.versions.digests, bodies, strict=True)
        )
        return first != second

    def _pairs(self, kept: list[tuple[Outcome, Outcome]]) -> list[tuple[Outcome, Outcome]]:
        """Return every pair of outcomes with different names that some input has."""
        versions = self.versions
        space = versions.space(*(out.when for outs in self.outcomes for out in outs.values()))
        solver = space.solver(
            values.negation(values.any_of(values.both(before.when, after.when) for before, after in kept))
        )
        pairs = []
        while space.answered(solver):
            before, after = (
                next(out for out in outs.values() if solver.value(values.term_of(out.when), Bool()))
                for outs in self.outcomes
            )
            pairs.append((before, after))
            solver.add(values.term_of(values.negation(values.both(before.when, after.when))))
        return pairs

    def _compared(self, before: Outcome, after: Outcome) -> list[Change]:
        """Return the changes where one version has the first outcome and the other the second."""
        versions = self.versions
        both = versions.shared.canonical(values.both(before.when, after.when))
        if both not in versions.stated:
            versions.stated[both] = versions.shared.canonical(values.both(before.holds, after.holds))
        labels = _label(self.tables[0], before), _label(self.tables[1], after)
        if before.actions is None or after.actions is None:
            return self._confirmed(
                changes(versions, PartSort.FAULT, labels, both, self.relied), before, after
            )
        doing = [
            Doing(meaning.effect(_body(out.actions), (before.holds, after.holds)), runner(_body(out.actions)),
                  _headings(meaning.program, out.actions))
            for out, meaning in zip((before, after), self.meanings, strict=True)
        ]  # fmt: skip
        contrasted = contrast(versions, both, (doing[0], doing[1]))
        changed = (
            changes(versions, PartSort.EFFECT, labels, both, self.relied, contrasted)
            if contrasted.differ
            else []
        )
        if (before.actions is None, before.name) != (after.actions is None, after.name):
            changed += self._moved(labels, both, contrasted)
        return self._confirmed(changed, before, after)

    def _moved(self, labels: tuple[str, str], both: Node, contrasted: Contrast) -> list[Change]:
        """Return where another line has the same effect; not looked for where doubles are computed with."""
        versions = self.versions
        if not contrasted.differ:
            return changes(versions, PartSort.LINE, labels, both)
        alike = versions.shared.canonical(values.both(both, values.negation(contrasted.node)))
        if is_hard(alike) or not versions.possible(alike):
            return []
        return changes(versions, PartSort.LINE, labels, alike)

    def _confirmed(self, changed: list[Change], before: Outcome, after: Outcome) -> list[Change]:
        """Confirm each witness by the reference meaning: it must match as is said.

        Raises:
            RuntimeError: It does not, which is a bug in rcsc.
        """
        for change in changed:
            for program, table, out in zip(
                (self.versions.before, self.versions.after), self.tables, (before, after), strict=True
            ):
                if out.name != UNDEFINED or out.actions is not None:
                    self._match(program, table, out, change)
        return changed

    def _match(self, program: Program, table: Table, out: Outcome, change: Change) -> None:
        now = self.versions.snapshot(program, dict(change.point))
        seen = matching_lines(table, now)
        default = table.default
        if len(seen) > 1:
            name = SEVERAL_LINES
        elif seen:
            name = str(seen[0])
        else:
            name = NO_LINE if default is None else str(default.name)
        if name != out.name:
            raise RuntimeError(f"table {table.name}: {change.witness} meets {name}, not {out.name}")


def assumed(table: Table, meaning: Meaning) -> Node:
    """Return the condition that the table's assumptions and the program's invariants hold."""
    invariants = (meaning.condition(invariant.condition) for invariant in meaning.program.invariants)
    return values.all_of([*meaning.assumed(table), *invariants])


def _outcomes(table: Table, meaning: Meaning) -> dict[tuple[bool, str], Outcome]:
    """Return the possible outcomes of an input, in order of the table; equal outcomes of two versions have equal keys."""

    def joined(parts: Sequence[Node]) -> Node:
        return meaning.shared.canonical(values.all_of(reversed(parts)))

    return {(out.actions is None, out.name): out for out in outcomes(meaning, table, joined)}


def _label(table: Table, out: Outcome) -> str:
    """Return the outcome in words: `line 3`, or the fault."""
    if out.actions is None:
        return "a condition that is undefined" if out.name == UNDEFINED else out.name
    default = table.default is not None and table.default.name == out.name
    return f"{'DEFAULT' if default else 'line'} `{out.name}`"


def _body(actions: tuple[Action, ...] | None) -> list[Statement]:
    return [action.statement for action in actions or ()]


def _headings(program: Program, actions: tuple[Action, ...] | None) -> Mapping[str, tuple[str, ...]]:
    """For each leaf the headings of the actions that may write it."""
    writes = {str(procedure.name): procedure.writes for procedure in program.procedures}
    headings: dict[str, dict[str, None]] = {}
    for action in actions or ():
        for statement in everything([action.statement]):
            named = writes[str(statement.procedure)] if isinstance(statement, Call) else written_by(statement)
            for leaf in named:
                headings.setdefault(str(leaf), {})[action.heading] = None
    return {leaf: tuple(names) for leaf, names in headings.items()}

"""Two versions of one program under one solver's eyes: shared leaves, regions in words, and what is left otherwise.

In: an `Aligned`. Out: answers that tables, procedures, levels and conditions are compared with.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from rcsc.lang.digest import Digests
from rcsc.lang.interpret import execute, initial
from rcsc.lang.model import (
    COMPARISONS,
    Bool,
    Enum,
    Int,
    Level,
    Op,
    Program,
    Real,
    Statement,
    Table,
    earlier,
    key_bounds,
    value_of_key,
)
from rcsc.lang.model import Value as Scalars
from rcsc.lang.operator_table import ROUNDED
from rcsc.proof.procedures.discharge import Tally
from rcsc.proof.relation.effect import Effect, Meaning, Shared
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.symbolic import trial, values
from rcsc.proof.symbolic.values import CONSTANT, Node
from rcsc.proof.table.cells import region
from rcsc.proof.table.cover import Cover, Space
from rcsc.proof.table.verdict import Region
from rcsc.views.diff.changes.align import Aligned
from rcsc.views.diff.changes.difference import Where
from rcsc.views.diff.changes.value_text import in_words, number

MOST_BOXES = 16
"""Boxes of one region; past them it is said what holds in it besides."""
MOST_BOXES_ACROSS = 4
"""The same where values of two variables are compared: such a region is seldom made of boxes."""
COVER_STEPS = 1_000_000
"""Steps of Z3 for the boxes of all regions together; past them a region is told by one box of it, and by what holds in it."""

Runner = Callable[[Program, dict[str, Scalars]], None]
"""Runs a version's part on a snapshot, in place."""


def runner(body: Sequence[Statement]) -> Runner:
    """Return what runs statements."""
    return lambda program, now: execute(program, body, now, {})


@dataclass(frozen=True, slots=True)
class Hit:
    """An input, by variable, and whether it is the least."""

    point: Mapping[str, Scalars]
    least: bool


@dataclass(frozen=True, slots=True)
class Doing:
    """What one version does in a region.

    Attributes:
        run: The same by the reference meaning.
        headings: For each leaf that it may write, of the actions that do.
    """

    effect: Effect
    run: Runner
    headings: Mapping[str, tuple[str, ...]]


class Versions:
    """Two versions of one program.

    Attributes:
        before, after: Aligned.
        leaves: Those that are compared: both have them.
        stated: For a region that two lines have in common, the conditions of the two: what it is where boxes do not end.
        tally: Counts how often a solver is asked.
        spare: What is left for the boxes of regions.
    """

    def __init__(self, aligned: Aligned, options: Options) -> None:
        self.aligned, self.options = aligned, options
        self.before, self.after = aligned.before, aligned.after
        self.leaves = tuple(aligned.leaves)
        self.digests = Digests(aligned.before), Digests(aligned.after)
        self.types = {str(v.name): v.type for v in (*aligned.after.variables, *aligned.before.variables)}
        self.kinds = {**self.types, **aligned.leaves}
        befores = {
            str(earlier(name)): kind for name, kind in self.kinds.items()
        }  # what a property calls them
        self.shared = Shared({**self.kinds, **befores}, aligned.before, aligned.after)
        self.order = {name: at for at, name in enumerate(self.kinds)}
        self.tally = Tally()
        self.spare = smt.Budget(COVER_STEPS)
        self.stated: dict[Node, Node] = {}
        self.seen: dict[str, Node] = {}
        self._hits: dict[Node, Hit | None] = {}
        self._points: list[dict[str, Scalars]] = []

    def meanings(self) -> tuple[Meaning, Meaning]:
        """Return the meanings of conditions and actions of either version."""
        return Meaning(self.before, self.shared), Meaning(self.after, self.shared)

    def space(self, *nodes: Node) -> Space:
        """Return all inputs that the nodes speak of."""
        inputs = values.variables(nodes)
        self.seen.update(inputs)
        variables = sorted(
            inputs.values(), key=lambda node: (self.order.get(node.name, len(self.order)), node.name)
        )
        return Space(variables, self.options, self.tally)

    def possible(self, *nodes: Node) -> bool:
        """Return whether the conditions can hold together.

        Raises:
            UndecidedError: The solver gave up.
        """
        whole = self.shared.canonical(values.all_of(nodes))
        if whole.known:
            return bool(whole.low)
        return self.space(whole).possible(whole)

    # --- regions ---

    def meet(self, easy: Node, hard: Node) -> bool:
        """Return whether both can hold together.

        Args:
            easy: Made of comparisons.
            hard: May compute with doubles: inputs are tried first, since a solver finds these hard.

        Raises:
            UndecidedError: The solver gave up.
        """
        whole = self.shared.canonical(values.both(easy, hard))
        return self._hit(easy, whole) is not None if is_hard(whole) else self.possible(whole)

    def hit(self, easy: Node, hard: Node) -> Hit | None:
        """Return an input at which both hold, the least where doubles are not computed with; None where there is none.

        Raises:
            UndecidedError: The solver gave up.
        """
        whole = self.shared.canonical(values.both(easy, hard))
        if is_hard(whole):
            return self._hit(easy, whole)
        return Hit(self.witness(whole), least=True) if self.possible(whole) else None

    def _hit(self, easy: Node, whole: Node) -> Hit | None:
        """Return an input: one known already, one found by trial, or the solver's."""
        if whole not in self._hits:
            known = next((point for point in self._points if self._holds(whole, point)), None)
            if known is None and self.possible(easy):
                known = self._tried(easy, whole) or self._solved(whole)
                self._points += [] if known is None else [known]
            self._hits[whole] = None if known is None else Hit(known, least=False)
        return self._hits[whole]

    def _holds(self, whole: Node, point: dict[str, Scalars]) -> bool:
        """Return whether the condition holds at an input; it is completed by the least values of other variables."""
        for name, node in values.variables([whole]).items():
            self.seen[name] = node
            if name not in point:
                point[name] = value_of_key(node.kind, key_bounds(node.kind)[0])
        return trial.holds_at(whole, point)

    def _solved(self, whole: Node) -> dict[str, Scalars] | None:
        space = self.space(whole)
        solver = space.solver(whole)
        if not space.answered(solver):
            return None
        return values.model(solver, space.nodes.values())

    def _tried(self, easy: Node, whole: Node) -> dict[str, Scalars] | None:
        """Return an input found by trial: the least one of what is easy, and values of the other variables."""
        fixed = self.witness(easy)
        named = values.variables([whole])
        self.seen.update(named)
        variables = [
            values.variable(name, Int(int(fixed[name]), int(fixed[name])))
            if name in fixed and not isinstance(node.kind, Real)
            else node
            for name, node in sorted(named.items(), key=lambda item: self.order.get(item[0], len(self.order)))
        ]
        point = trial.witness([whole], variables)
        if point is None:
            return None
        return {name: bool(at) if isinstance(named[name].kind, Bool) else at for name, at in point.items()}

    def where(self, wanted: Node, allowed: Node, most: int = MOST_BOXES) -> Where:
        """Return the region in words: boxes that hold all of `wanted`, as far as `most` do, and lie within `allowed`.

        Raises:
            UndecidedError: The solver gave up.
        """
        stated = self.stated.get(allowed)
        around = None if stated is None else self.space(stated).around(stated)
        across = around is not None and bool(around[1])
        cover, total = self._cover(wanted, allowed, MOST_BOXES_ACROSS if across else most)
        if not cover.exact and stated is not None and around is not None and across:
            also = [in_words(part) for part in around[1]]
            if all(also) and not self.possible(stated, values.negation(allowed)):
                whole = Cover((around[0],), exact=True, inputs=None)
                words = " and ".join(text for text in also if text)
                return Where(whole.boxes, self._words(whole), exact=True, also=words, inputs=None)
        counted = None if cover.inputs is None or total is None or not cover.exact else (cover.inputs, total)
        return Where(cover.boxes, self._words(cover), cover.exact, "", counted)

    def _cover(self, wanted: Node, allowed: Node, most: int) -> tuple[Cover, int | None]:
        space = self.space(wanted, allowed)
        return space.cover(wanted, allowed, most, self.spare), space.volume(space.nodes)

    def _words(self, cover: Cover) -> tuple[tuple[str, ...], ...]:
        return tuple(region({name: self.seen[name].kind for name in box}, box) for box in cover.boxes)

    def inside(self, boxes: Iterable[Region]) -> Node:
        """Return the condition that an input lies in one of the boxes."""
        return values.any_of(
            values.all_of(self._in_part(name, part) for name, part in box.items()) for box in boxes
        )

    def _in_part(self, name: str, part: Sequence[tuple[int, int]]) -> Node:
        node = self.seen[name]
        ends = [(value_of_key(node.kind, low), value_of_key(node.kind, high)) for low, high in part]
        return values.any_of(values.inside(node, low, high) for low, high in ends)

    def witness(self, wanted: Node) -> dict[str, Scalars]:
        """Return the least input in a region that has one.

        Raises:
            UndecidedError: The solver gave up.
        """
        return self.space(wanted).witness(wanted)

    def spelled(self, witness: Mapping[str, Scalars]) -> tuple[tuple[str, str], ...]:
        """Spell an input in words."""
        return tuple((name, number(self.seen[name].kind, value)) for name, value in witness.items())

    def snapshot(self, program: Program, witness: Mapping[str, Scalars]) -> dict[str, Scalars]:
        """Return the witness, and the initial value of every leaf that it leaves open."""
        given = {name: value for name, value in witness.items() if name in self.kinds}
        return {**initial(program), **given}


_HARD = ROUNDED | {Op.TO_REAL, Op.TO_SINGLE}


def is_hard(condition: Node) -> bool:
    """Return whether the condition computes with doubles."""
    return any(
        (node.op in _HARD and isinstance(node.kind, Real)) or node.op == Op.TO_INT
        for node in values.parts_first(condition)
    )


def is_across(condition: Node) -> bool:
    """Return whether the condition compares two variables of more than a few values each."""
    for node in values.parts_first(condition):
        if node.op in COMPARISONS:
            left, right = node.args
            wide = all(not isinstance(side.kind, Bool | Enum) for side in (left, right))
            if wide and not (values.root(left).op == CONSTANT or values.root(right).op == CONSTANT):
                return True
    return False


def run_by(program: Program, level: Level) -> dict[str, Table]:
    """Return the tables that a level runs, by name."""
    named = {table.name: table for table in program.tables}
    return {str(name): named[name] for name in level.table_names}

"""A property that would notice a slip: offered only if the level is proved to have it, and a run breaks it once the slip is made.

In: a slip that survives, and where its level is written. Out: a line of text for the program.

Forms that are tried, for an assignment `x := v` of a line, or of a procedure that every cycle runs:

- *condition implies x = v*: the condition of the line and its table, in the values that the cycle leaves, or `was` those of the one before;
- *@T(y = w) implies x = v*: where the same line sets y to w, the two being deferred alike, so that both are taken in one cycle.
"""

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace

from rcsc.code.testing.inputs.condition_text import words
from rcsc.compose.contract.claims import ACCEPTED
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.coverage.again import shown_again
from rcsc.compose.coverage.parts import How, Use, of_program, switched
from rcsc.compose.coverage.questions import with_program
from rcsc.compose.coverage.slips import Environment, Slip
from rcsc.compose.coverage.tried import tried
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import prove_again
from rcsc.lang.leaves import conjuncts, free_name, may_write, read_by, renamed
from rcsc.lang.model import (
    Apply,
    Bool,
    Expr,
    Kind,
    Line,
    Literal,
    OneTable,
    Op,
    Procedure,
    Program,
    Property,
    Read,
    Variable,
    VariableName,
    earlier,
    pending,
)
from rcsc.lang.project import Loaded, again
from rcsc.lang.resolve import resolve

MOST_LINES = 3
"""Lines of which one assignment is looked at."""
_NEXT = pending("")
_LOOSE = frozenset({Op.OR, Op.XOR, Op.IMPLIES})
"""Operators that bind less than `and`."""


def offer(places: Sequence[Environment], slip: Slip, loaded: Loaded) -> str | None:
    """Return a property that is proved of the level and that the slip breaks; None where no form gives one."""
    place = places[0]
    for use in slip.uses[:MOST_LINES]:
        for name, condition, response in forms(place.ts, use):
            text = f"property {name} : {condition} implies {response}"
            stated = resolved(text, loaded, name)
            if stated is not None and notices(places, slip, stated):
                return text
    return None


def sayable(place: Environment, slip: Slip) -> bool:
    """Return whether some form fits."""
    return any(True for use in slip.uses[:MOST_LINES] for _ in forms(place.ts, use))


def resolved(text: str, loaded: Loaded, name: str) -> Property | None:
    """Return a property as the program's own text would have it; None where it is none."""
    root = loaded.roots[0]
    file = loaded.file_of(root)
    added = f"{loaded.sources[file].text.rstrip()}\n\n{text}\n"
    more = again(file, loaded.instances.get(root), {os.path.realpath(file): added})
    program = None if more.diagnostics else resolve(more.roots[0], more)
    if not isinstance(program, Program):
        return None
    return next((one for one in program.properties if one.name == name), None)


def notices(places: Sequence[Environment], slip: Slip, stated: Property) -> bool:
    """Return whether a property is proved of a level, and broken once the slip is made."""
    place = places[-1]  # where no input is refused, if that makes a difference: a run there is one anywhere
    alone = replace(place.ts.program, properties=(stated,))
    key = (stated.word, "", stated.name)
    wrong = of_program(alone, place.ts.level, How.LEFT_OUT, slip.uses)
    slipped = with_program(place.ts, wrong, place.ts)
    if not tried(slipped, [key]).broken:
        return False
    ts = with_program(place.ts, alone, place.ts)
    if shown_again(ts, place.proof, range(len(place.proof.clauses)), [key]):
        return True
    if not slip.uses[0].part.procedure or slip.whole_line:
        return False  # exact engines may take long: for assignments of procedures alone
    proof = prove_again(ts, place.proof, Effort(walks=4, looks=False))
    return any(owed.key == key and verdict in ACCEPTED for owed, verdict in proof.verdicts)


# --- forms -----------------------------------------------------------------------------------


def forms(ts: TransitionSystem, use: Use) -> Iterator[tuple[str, str, str]]:
    """Yield name, condition and response of what a property may say of an assignment."""
    made = switched(ts.program, ts.level, How.LEFT_OUT)
    around = _Around(ts, use)
    stands = use.part.procedure or f"{use.table}_{use.line}"
    names = {one.name for one in ts.program.properties}
    for leaf, value in made.written.get(use, {}).items():
        base = leaf.removesuffix(_NEXT)
        name = free_name("".join(c if c.isalnum() else "_" for c in f"{stands}_sets_{base}"), names)
        if leaf == base and (said := around.said(value)) is not None:
            response = _equal(ts, leaf, said)
            every = around.conditions(made.under[use])
            if every:
                yield name, _joined(every), response
        if leaf != base and isinstance(value, Literal):
            for other, set_ in _siblings(ts, made.written, use, base):
                yield name, f"@T({words(_is(other, set_))})", _equal(ts, base, value)


def _siblings(
    ts: TransitionSystem, written: dict[Use, dict[str, Expr]], use: Use, base: str
) -> Iterator[tuple[Variable, Literal]]:
    """Yield what else the same line sets, deferred until the same: variables with their values."""
    until = ts.program.variable(base).deferred_until
    for other, leaves in written.items():
        for leaf, value in leaves.items():
            name = leaf.removesuffix(_NEXT)
            if (other.table, other.line) != (use.table, use.line) or name in (base, leaf):
                continue
            variable = ts.program.variable(name)
            if variable.deferred_until == until and isinstance(value, Literal):
                yield variable, value


def _is(variable: Variable, value: Literal) -> Expr:
    return Apply(Op.EQ, (Read(variable.name, variable.type), replace(value, type=variable.type)), Bool())


def _equal(ts: TransitionSystem, leaf: str, value: Expr) -> str:
    kind = ts.kinds[leaf]
    if isinstance(value, Literal):
        value = replace(value, type=kind)
    return words(Apply(Op.EQ, (Read(VariableName(leaf), kind), value), Bool()))


def _plain(condition: Expr) -> Expr:
    """Return a condition without a comparison with a truth value."""
    match condition:
        case Apply(op=Op.EQ, args=(one, Literal(value=bool(value), type=Bool()))):
            return one if value else Apply(Op.NOT, (one,), Bool())
    return condition


def _joined(conditions: Sequence[Expr]) -> str:
    return " and ".join(
        f"({words(one)})" if isinstance(one, Apply) and one.op in _LOOSE else words(one) for one in conditions
    )


class _Around:
    """What a cycle does before and after an assignment, so that the values it finds can be said once the cycle is over."""

    def __init__(self, ts: TransitionSystem, use: Use) -> None:
        self.ts, self.use = ts, use
        program, level = ts.program, ts.level
        procedures = {str(one.name): one for one in program.procedures}
        steps: list[tuple[bool, frozenset[str]]] = [(False, frozenset(self._settled()))]
        steps += [self._module(name, procedures[name]) for name in level.preprocess]
        for choice in level.choices:
            here = use.table in choice.names
            lines = [
                line
                for name in choice.names
                for line in program.table(name).every_line
                if not here or (name, line.name) == (use.table, use.line)
            ]
            body = [action.statement for line in lines for action in line.actions]
            steps.append((here, frozenset(map(str, may_write(body, procedures)))))
        steps += [self._module(name, procedures[name]) for name in level.postprocess]
        at = next((at for at, (here, _) in enumerate(steps) if here), 0)
        self.before = frozenset(leaf for _, writes in steps[:at] for leaf in writes)
        self.after = frozenset(leaf for _, writes in steps[at:] for leaf in writes)
        self.inputs = {str(v.name) for v in program.variables if v.kind is Kind.INPUT}

    def _module(self, name: str, procedure: Procedure) -> tuple[bool, frozenset[str]]:
        return not self.use.table and self.use.line == name, frozenset(map(str, procedure.writes))

    def _settled(self) -> Iterator[str]:
        for variable in self.ts.program.variables:
            if variable.deferred_until is not None:
                yield str(variable.name)
                yield str(pending(variable.name))

    def said(self, expr: Expr) -> Expr | None:
        """Return an expression on the values that the assignment finds, as one on those that the cycle found, or leaves."""
        names = set(map(str, read_by(expr)))
        if any(leaf in self.before and (leaf in self.after or leaf.endswith(_NEXT)) for leaf in names):
            return None

        def seen(name: VariableName) -> VariableName:
            return name if str(name) in self.inputs or str(name) in self.before else earlier(name)

        return renamed(expr, seen)

    def conditions(self, under: Sequence[Expr]) -> list[Expr]:
        """Return the conditions under which the assignment runs, as far as they can be said."""
        every = list(under)
        if self.use.table:
            line = next(
                line for line in self.ts.table(self.use.table).every_line if line.name == self.use.line
            )
            every = [*self._selected(), *(line.conditions if isinstance(line, Line) else ()), *under]
        parts = [part for condition in every for part in conjuncts(condition)]
        return [_plain(said) for part in parts if (said := self.said(part)) is not None]

    def _selected(self) -> Iterator[Expr]:
        for choice in self.ts.level.choices:
            if isinstance(choice, OneTable) or self.use.table not in choice.names:
                continue
            members = [value for value, name in choice.tables if name == self.use.table]
            if len(members) == 1:
                kind = choice.selector.type
                yield Apply(Op.EQ, (choice.selector, Literal(members[0], kind)), Bool())

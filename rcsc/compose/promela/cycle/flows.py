"""Which names hold the same data, and what that is compared with.

In: flat statements. Out: `Group`s: names between which values are copied or that are compared with one another, with the constants that
they meet. The small instance is made of this (`instance`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rcsc.compose.promela.cycle.statements import Check, Flat, Forget, Fork, Match, Put, Tell
from rcsc.lang.model import (
    BEFORE,
    COMPARISONS,
    Among,
    Apply,
    Bool,
    Expr,
    Int,
    Literal,
    Op,
    Read,
    Scalar,
    Value,
)

EQUALITIES = frozenset({Op.EQ, Op.NE})
MIRRORED = {Op.LT: Op.GT, Op.LE: Op.GE, Op.GT: Op.LT, Op.GE: Op.LE}


@dataclass(slots=True)
class Group:
    """Names that hold the same data.

    Attributes:
        tests: Comparisons with constants: the operator as seen from the name, and the constant.
        given: Constants that are assigned.
        paired: It is asked which of two is the greater.
        apart: A property compares two of it.
        counted: By how much a name is counted up or down.
        round: What it is counted round by (`mod`), if it is.
        computed: It takes part in other arithmetic.
    """

    names: list[str]
    tests: set[tuple[Op, Value]] = field(default_factory=set)
    given: set[Value] = field(default_factory=set)
    paired: bool = False
    apart: bool = False
    counted: set[int] = field(default_factory=set)
    round: set[int] = field(default_factory=set)
    computed: bool = False

    @property
    def told(self) -> tuple[Value, ...]:
        """The constants that it is compared with."""
        return tuple(sorted({value for _, value in self.tests}))

    def goes_round(self, numbers: frozenset[str]) -> bool:
        """Whether it is only counted round, or command numbers (of which `numbers` are), and compared."""
        return not self.computed and bool(self.round or numbers.intersection(self.names))

    def told_apart(self, values: Iterable[Value]) -> list[Value]:
        """The first of each class of values that no test tells apart, in their order."""
        classes: dict[tuple[bool, ...], Value] = {}
        tests = sorted(self.tests)
        for value in values:
            classes.setdefault(tuple(bool(op.meaning(value, at)) for op, at in tests), value)
        return list(classes.values())


@dataclass(slots=True)
class Flows:
    """Finds the groups."""

    kinds: Mapping[str, Scalar]
    _parent: dict[str, str] = field(default_factory=dict)
    _facts: list[tuple[str, str | Op, Value]] = field(default_factory=list)
    _apart: bool = False

    def groups(self, statements: Iterable[Flat]) -> dict[str, Group]:
        """Each name's group; those that hold truth values have none."""
        self._block(statements)
        found: dict[str, Group] = {}
        for name, kind in self.kinds.items():
            if not isinstance(kind, Bool):
                found.setdefault(self._root(name), Group([])).names.append(name)
        for name, fact, value in self._facts:
            group = found[self._root(name)]
            match fact:
                case Op():
                    group.tests.add((fact, value))
                case "given":
                    group.given.add(value)
                case "counted" | "round":
                    getattr(group, fact).add(int(value))
                case _:
                    setattr(group, fact, True)
        return {
            name: found[self._root(name)] for name, kind in self.kinds.items() if not isinstance(kind, Bool)
        }

    def _root(self, name: str) -> str:
        above = self._parent.get(name, name)
        if above == name:
            return name
        self._parent[name] = found = self._root(above)
        return found

    def _join(self, one: str, other: str) -> None:
        first, second = self._root(one), self._root(other)
        if first != second:
            self._parent[second] = first

    def _say(self, name: str, fact: str | Op, value: Value = 0) -> None:
        if not isinstance(self.kinds[name], Bool):
            self._facts.append((name, fact, value))

    # --- statements ---

    def _block(self, statements: Iterable[Flat]) -> None:
        for one in statements:
            match one:
                case Put(name=name, value=value):
                    self._put(name, value)
                case Fork(arms=arms, otherwise=otherwise):
                    for when, body in arms:
                        self._condition(when)
                        self._block(body)
                    self._block(otherwise)
                case Check(holds=holds, apart=apart):
                    self._apart = apart
                    self._condition(holds)
                    self._apart = False
                case Match(conditions=conditions):
                    for when in conditions:
                        self._condition(when)
                case Forget() | Tell():
                    pass

    def _put(self, name: str, value: Expr) -> None:
        if isinstance(self.kinds[name], Bool):
            self._condition(value)
            return
        match value:
            case Literal(value=constant):
                self._say(name, "given", constant)
            case Read(name=other):
                self._join(name, other)
            case Apply(
                op=Op.MOD, args=(Apply(op=Op.ADD, args=(Read(name=other), Literal())), Literal(value=many))
            ):
                self._join(name, other)
                self._say(name, "round", many)
            case Apply(op=Op.ADD | Op.SUB, args=(Read(name=other), Literal(value=step))) if other == name:
                self._say(name, "counted", step)
            case _:
                self._say(name, "computed")
                self._arithmetic(value)

    def _condition(self, expr: Expr) -> None:
        match expr:
            case Among(subject=Read(name=name), values=values):
                for value in values:
                    self._say(name, Op.EQ, value)
            case Apply(op=op, args=(one, other)) if op in COMPARISONS:
                self._compare(op, one, other)
            case Apply(args=args):
                for arg in args:
                    self._condition(arg)
            case Among(subject=subject):
                self._arithmetic(subject)
            case _:
                pass

    def _compare(self, op: Op, one: Expr, other: Expr) -> None:
        match one, other:
            case Read(name=name), Literal(value=value):
                self._say(name, op, value)
            case Literal(value=value), Read(name=name):
                self._say(name, MIRRORED.get(op, op), value)
            case Read(name=name), Read(name=second):
                self._join(str(name), str(second))
                if self._apart:
                    self._say(name, "apart")
                if op not in EQUALITIES and not _of_one_leaf(name, second):
                    self._say(name, "paired")
            case Read(name=name), Apply(
                op=Op.MOD, args=(Apply(op=Op.ADD, args=(Read(name=second), Literal())), Literal(value=many))
            ):
                self._join(str(name), str(second))
                self._say(name, "round", many)
            case _:
                for side in (one, other):
                    self._condition(side) if isinstance(side.type, Bool) else self._arithmetic(side)

    def _arithmetic(self, expr: Expr) -> None:
        match expr:
            case Read(name=name, type=kind):
                if isinstance(kind, Int):
                    self._say(name, "computed")
            case Apply(args=args):
                for arg in args:
                    self._arithmetic(arg)
            case _:
                pass


def _of_one_leaf(one: str, other: str) -> bool:
    """Whether one is what the other was a cycle before: closing the gaps of a counter keeps their order."""
    first, second = (name.partition(":") for name in (one, other))
    return first[0] == second[0] and first[2].removeprefix(BEFORE) == second[2].removeprefix(BEFORE)

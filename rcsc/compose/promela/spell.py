"""Flat statements as Promela.

In: statements, the names' domains. Out: lines of text. What is deterministic is put into `d_step`; a name that gets any value gets it
where it is first read, so that states part only where they differ. Source of what Promela means: its manual pages (`atomic`,
`d_step`, `if`); an `if` whose guards may hold together is nested, for outside `d_step` it would choose.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from rcsc.compose.promela.cycle.statements import Block, Check, Flat, Forget, Fork, Match, Put, Tell
from rcsc.compose.promela.instance import Domain
from rcsc.lang.leaves import read_by
from rcsc.lang.model import COMPARISONS, Among, Apply, Bool, Expr, Literal, Op, Read

RESERVED = frozenset(
    """active assert atomic bit bool break byte chan d_step do else empty enabled eval false fi full goto hidden if init int len
    local mtype nempty never nfull notrace np od of pc_value pid printf priority proctype provided run short show skip
    timeout trace true typedef unless unsigned xr xs ltl inline select for in""".split()
)
SYMBOLS: Mapping[Op, str] = {
    Op.AND: "&&", Op.OR: "||", Op.EQ: "==", Op.NE: "!=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=",
    Op.ADD: "+", Op.SUB: "-", Op.MUL: "*", Op.DIV: "/", Op.MOD: "%",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Choice:
    """One of several guarded sequences; `pure` where at most one guard holds and nothing is drawn."""

    ways: "tuple[tuple[str, tuple[Node, ...]], ...]"
    pure: bool


Node: TypeAlias = str | Choice
Nodes: TypeAlias = tuple[Node, ...]


def identifiers(names: Iterable[str]) -> dict[str, str]:
    """A name of Promela's for each name, each different."""
    found: dict[str, str] = {}
    used = set(RESERVED)
    for name in names:
        base = re.sub(r"_+", "_", re.sub(r"[^A-Za-z0-9]", "_", name)).strip("_") or "x"
        base = base if base[0].isalpha() else f"x{base}"
        spelled, count = base, 1
        while spelled in used:
            count += 1
            spelled = f"{base}_{count}"
        used.add(spelled)
        found[name] = spelled
    return found


def drawn_flag(identifier: str) -> str:
    """The flag that a name has its value."""
    return f"has_{identifier}"


@dataclass(slots=True)
class Speller:
    """Spells one step.

    Attributes:
        lazy: Names that are drawn when read.
        alarm: What is to be done where a check fails, by its number.
        tell: What prints the end of a cycle.
        known: Names of `lazy` that have their value here for certain.
        deepest: How many scratch variables are used.
    """

    names: Mapping[str, str]
    domains: Mapping[str, Domain]
    lazy: frozenset[str]
    alarm: Callable[[int], Iterable[str]]
    tell: str = "skip"
    known: set[str] = field(default_factory=set)
    deepest: int = 0
    _depth: int = 0

    def block(self, block: Block) -> Nodes:
        """Statements in order."""
        return tuple(node for one in block for node in self._one(one))

    def _one(self, one: Flat) -> Iterator[Node]:
        match one:
            case Put(name=name, value=value):
                yield from self._put(name, value)
            case Forget(names=names):
                for name in names:
                    yield from (f"{self.names[name]} = 0", f"{drawn_flag(self.names[name])} = 0")
                self.known.difference_update(names)
            case Check(obligation=obligation, holds=holds):
                before, text = self._condition(holds)
                yield from before
                yield Choice(((text, ()), ("else", tuple(self.alarm(obligation)))), pure=True)
                self._release(before)
            case Tell():
                yield self.tell
            case Match():
                yield from self._match(one)
            case Fork():
                yield from self._fork(one)

    def _put(self, name: str, value: Expr) -> Iterator[Node]:
        target = self.names[name]
        if isinstance(value.type, Bool) and not self._pure(value):
            before, text = self._condition(value)
            yield from before
            yield f"{target} = {text}"
            self._release(before)
        else:
            yield from self._drawn(value)
            yield f"{target} = {self.text(value, self.domains[name])}"
        if name in self.lazy:
            yield f"{drawn_flag(target)} = 1"
            self.known.add(name)

    def _match(self, one: Match) -> Iterator[Node]:
        """Names are drawn first, each where a line asks for it that nothing drawn so far rules out; then lines are counted."""
        line, many = self.names[one.line], self.names[one.many]
        lines = [tuple(_conjuncts(when)) for when in one.conditions]
        start = set(self.known)
        for name in dict.fromkeys(name for tests in lines for test in tests for name in self._undrawn(test)):
            asking = [tests for tests in lines if any(name == one for test in tests for one in read_by(test))]
            open_ = {self._all(test for test in tests if not self._undrawn(test)) for tests in asking}
            yield self._draw(
                name, "true" if "true" in open_ else " || ".join(f"({one})" for one in sorted(open_))
            )
            self.known.add(name)  # a line that it is not drawn for is ruled out already
        yield f"{line} = 0"
        yield f"{many} = 0"
        for number, tests in enumerate(lines, 1):
            counted = (f"{many} = {many} + 1", f"{line} = ({line} == 0 -> {number} : {line})")
            yield Choice(((self._all(tests), counted), ("else", ())), pure=True)
        self.known = start

    def _all(self, tests: Iterable[Expr]) -> str:
        return " && ".join(self.text(test) for test in tests) or "true"

    def _undrawn(self, expr: Expr) -> list[str]:
        return [str(name) for name in read_by(expr) if name in self.lazy and name not in self.known]

    def _fork(self, fork: Fork) -> Iterator[Node]:
        """Nested, unless the arms ask for different values of one name."""
        if len(fork.arms) > 1 and _exclusive(fork):
            for when, _ in fork.arms:
                yield from self._drawn(when)
            yield self._ways([(self.text(when), body) for when, body in fork.arms], fork.otherwise)
            return
        (when, body), *rest = fork.arms
        otherwise = (Fork(tuple(rest), fork.otherwise),) if rest else fork.otherwise
        before, text = self._condition(when)
        yield from before
        yield self._ways([(text, body)], otherwise)
        self._release(before)

    def _ways(self, arms: list[tuple[str, Block]], otherwise: Block) -> Choice:
        start = set(self.known)
        ends: list[set[str]] = []
        ways: list[tuple[str, Nodes]] = []
        for text, body in (*arms, ("else", otherwise)):
            self.known = set(start)
            ways.append((text, self.block(body)))
            ends.append(self.known)
        self.known = set.intersection(*ends)
        return Choice(tuple(ways), pure=all(pure(nodes) for _, nodes in ways))

    # --- names that are drawn ---

    def _pure(self, expr: Expr) -> bool:
        return not self._undrawn(expr)

    def _drawn(self, expr: Expr) -> Iterator[Node]:
        """Every name that the expression reads gets its value, if it has none yet."""
        for name in dict.fromkeys(self._undrawn(expr)):
            yield self._draw(name)
            self.known.add(name)

    def _draw(self, name: str, where: str = "true") -> Node:
        """It gets any value of its domain if it has none, and the condition holds."""
        target = self.names[name]
        any_ = tuple((f"{target} = {value}", ()) for value in self.domains[name].drawn)
        draw: Nodes = (Choice(any_, pure=False), f"{drawn_flag(target)} = 1")
        guard = f"!{drawn_flag(target)}" + ("" if where == "true" else f" && ({where})")
        return Choice(((guard, draw), ("else", ())), pure=False)

    def _condition(self, expr: Expr) -> tuple[Nodes, str]:
        """What is to run before it, and the condition; where that draws, its value stands in a scratch variable."""
        if self._pure(expr):
            return (), self.text(expr)
        scratch = f"scratch_{self._depth}"
        self._depth += 1
        self.deepest = max(self.deepest, self._depth)
        return tuple(self._evaluated(scratch, expr)), scratch

    def _release(self, before: Nodes) -> None:
        self._depth -= 1 if before else 0

    def _evaluated(self, scratch: str, expr: Expr) -> Iterator[Node]:
        """As far as the left operand does not decide, so that nothing is drawn in vain."""
        match expr:
            case Apply(op=Op.AND | Op.OR | Op.IMPLIES as op, args=(one, other)) if not self._pure(expr):
                yield from self._evaluated(scratch, one)
                if op is Op.IMPLIES:
                    yield f"{scratch} = !{scratch}"
                start = set(self.known)
                rest = tuple(self._evaluated(scratch, other))
                self.known = start
                goes_on = scratch if op is Op.AND else f"!{scratch}"
                yield Choice(((goes_on, rest), ("else", ())), pure=pure(rest))
            case Apply(op=Op.NOT, args=(one,)) if not self._pure(expr):
                yield from self._evaluated(scratch, one)
                yield f"{scratch} = !{scratch}"
            case _:
                yield from self._drawn(expr)
                yield f"{scratch} = {self.text(expr)}"

    # --- expressions ---

    def text(self, expr: Expr, near: Domain | None = None) -> str:
        """An expression; constants are spelled as in the domain that they stand with."""
        match expr:
            case Literal(value=value):
                return str(near.encoded(value) if near is not None else int(value))
            case Read(name=name):
                return self.names[name]
            case Among(subject=subject, values=values):
                inside = self._near(subject)
                one = self.text(subject)
                codes = sorted({inside.encoded(v) if inside is not None else int(v) for v in values})
                return f"({' || '.join(f'{one} == {code}' for code in codes)})" if codes else "false"
            case Apply():
                return self._applied(expr)
            case _:
                raise TypeError(f"{type(expr).__name__} is not flat")

    def _applied(self, expr: Apply) -> str:
        op, args = expr.op, expr.args
        if op is Op.MOD and isinstance(args[0], Apply):
            inside = self._near(args[0].args[0])
            if inside is not None and inside.size:
                step = self.text(args[0].args[1], inside)
                return f"(({self.text(args[0].args[0])} + {step}) % {inside.size})"
        if op in COMPARISONS:
            inside = self._near(args[0]) or self._near(args[1])
            return f"({self.text(args[0], inside)} {SYMBOLS[op]} {self.text(args[1], inside)})"
        texts = [self.text(arg) for arg in args]
        match op:
            case Op.NOT:
                return f"!{texts[0]}" if isinstance(args[0], Read) else f"!({texts[0]})"
            case Op.NEG:
                return f"(-{texts[0]})"
            case Op.IMPLIES:
                return f"(!({texts[0]}) || {texts[1]})"
            case Op.ABS:
                return f"({texts[0]} < 0 -> -({texts[0]}) : {texts[0]})"
            case Op.MIN | Op.MAX:
                sign = "<" if op is Op.MIN else ">"
                return f"({texts[0]} {sign} {texts[1]} -> {texts[0]} : {texts[1]})"
            case _:
                return f"({texts[0]} {SYMBOLS[op]} {texts[1]})"

    def _near(self, expr: Expr) -> Domain | None:
        """The domain whose constants an operand is compared with; none for what is computed."""
        match expr:
            case Read(name=name):
                return self.domains[name]
            case Apply(op=Op.MOD, args=(Apply(args=(Read(name=name), _)), _)):
                return self.domains[name] if self.domains[name].size else None
            case _:
                return None


def _conjuncts(expr: Expr) -> Iterator[Expr]:
    match expr:
        case Apply(op=Op.AND, args=(one, other)):
            yield from _conjuncts(one)
            yield from _conjuncts(other)
        case _:
            yield expr


def _exclusive(fork: Fork) -> bool:
    """Whether every arm asks whether one name is one constant, or one of some that no other arm names."""
    seen: set[tuple[str, object]] = set()
    subjects = set()
    for when, _ in fork.arms:
        match when:
            case Apply(op=Op.EQ, args=(Read(name=name), Literal(value=value))):
                values: tuple[object, ...] = (value,)
            case Among(subject=Read(name=name), values=values):
                pass
            case _:
                return False
        subjects.add(name)
        if len(subjects) > 1 or any((name, value) in seen for value in values):
            return False
        seen |= {(name, value) for value in values}
    return True


def pure(nodes: Iterable[Node]) -> bool:
    """Whether nothing in them is drawn."""
    return all(isinstance(node, str) or node.pure for node in nodes)


def rendered(nodes: Nodes, indent: str, *, inside: bool = False) -> Iterator[str]:
    """Lines of text; runs of what is deterministic in `d_step`, unless they are inside one."""
    run: list[Node] = []
    for node in nodes:
        if not inside and (isinstance(node, str) or node.pure):
            run.append(node)
            continue
        yield from _deterministic(run, indent)
        run = []
        yield from _node(node, indent, inside=inside)
    yield from _deterministic(run, indent)


def _deterministic(run: list[Node], indent: str) -> Iterator[str]:
    if len(run) == 1 and isinstance(run[0], str):
        yield f"{indent}{run[0]};"
    elif run:
        yield f"{indent}d_step {{"
        yield from rendered(tuple(run), f"{indent}  ", inside=True)
        yield f"{indent}}};"


def _node(node: Node, indent: str, *, inside: bool) -> Iterator[str]:
    if isinstance(node, str):
        yield f"{indent}{node};"
        return
    yield f"{indent}if"
    for guard, body in node.ways:
        if not body:
            yield f"{indent}:: {guard}{' -> skip' if guard == 'else' else ''}"
            continue
        yield f"{indent}:: {guard} ->"
        yield from rendered(body, f"{indent}   ", inside=inside or node.pure)
    yield f"{indent}fi;"

"""Statements: places found, values and arguments checked, locals renamed apart."""

from dataclasses import dataclass, field, replace
from typing import assert_never

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.operators import Typed, common_unit, conversion, kind_word, same_kind, side
from rcsc.lang.expressions.scope import Body, Scope, spell_number
from rcsc.lang.expressions.typed import Path, boolean, path_of, typed
from rcsc.lang.expressions.types import constant, scalar_of
from rcsc.lang.leaves import is_part, read_by, root_of
from rcsc.lang.model import (
    Arm,
    Assign,
    Bool,
    Call,
    Case,
    Enum,
    For,
    If,
    Int,
    Kind,
    Literal,
    Local,
    Parameter,
    ProcedureName,
    Read,
    Real,
    Scalar,
    Select,
    Statement,
    ToElement,
    ToLeaf,
    ToLocal,
    Value,
    VariableName,
    pending,
)
from rcsc.lang.resolve.declarations import fits, scalars
from rcsc.lang.restart import COMMAND, NUMBER
from rcsc.lang.syntax import tree

MOST_ROUNDS = 4096
MOST_STATEMENTS = 1_000_000


@dataclass(slots=True)
class Statements:
    """Resolves the statements of one procedure, or of one action cell.

    Attributes:
        is_protocol: Whether they are the protocol's own.
    """

    scope: Scope
    body: Body = field(default_factory=Body)
    loops: set[str] = field(default_factory=set)
    is_protocol: bool = False

    def block(self, written: tuple[tree.Statement, ...]) -> tuple[Statement, ...]:
        """Resolve the statements; locals declared inside are forgotten after it."""
        before = dict(self.body.visible)
        resolved = tuple(statement for part in written for statement in self._statement(part))
        self.body.visible = before
        return resolved

    def _statement(self, written: tree.Statement) -> tuple[Statement, ...]:
        match written:
            case tree.Assign():
                return self.assign(written.place, written.value, written.deferred, written.span)
            case tree.Local():
                return self._local(written)
            case tree.If(condition, then, orelse, span=span):
                test = boolean(self.scope, self.body, condition)
                first, second = self.block(then), self.block(orelse)
                return () if test is None else (If(test, first, second, span),)
            case tree.Case():
                return self._case(written)
            case tree.For():
                return self._for(written)
            case tree.Call():
                return self._call(written)

    # --- assignment ---

    def assign(self, place: tree.Expr, value: tree.Expr, deferred: bool, span: Span) -> tuple[Statement, ...]:
        """Resolve an assignment, to one statement for each leaf."""
        if isinstance(place, tree.Reference) and place.name.text in self.body.visible:
            return self._assign_local(place, value, deferred, span)
        if isinstance(place, tree.Reference) and place.name.text in self.scope.orders and not deferred:
            return self.order(place.name.text, value, span)
        target = self.place(place, deferred)
        return () if target is None else self.store(target, value, deferred, span)

    def order(self, subordinate: str, value: tree.Expr, span: Span) -> tuple[Statement, ...]:
        """Resolve an order to a subordinate: the command, then each field that is named; the others are kept."""
        told, once_more = self.scope.orders[subordinate]
        if not isinstance(value, tree.Order):
            return self.assign(_part(told, tree.Name(COMMAND, value.span)), value, False, span)
        command = _part(told, tree.Name(COMMAND, value.command.span))
        statements = [*self.assign(command, tree.Reference(value.command, value.command.span), False, span)]
        named: set[str] = set()
        for part in value.fields:
            if part.name.text in {NUMBER, COMMAND}:
                helps = "the command stands before the parentheses; `again` gives the same order a new number"
                self.scope.report(
                    Code.NOT_WRITABLE, f"the protocol writes `{part.name.text}`", part.name.span, helps
                )
            elif part.name.text in named:
                self.scope.report(Code.DUPLICATE_NAME, f"`{part.name.text}` is given twice", part.name.span)
            else:
                statements += self.assign(_part(told, part.name), part.value, False, span)
            named.add(part.name.text)
        if value.again:
            flag = tree.Reference(tree.Name(once_more, value.span), value.span)
            statements += self.assign(flag, tree.BoolLiteral(True, value.span), False, span)
        return tuple(statements)

    def place(self, place: tree.Expr, deferred: bool) -> Path | None:
        """Resolve the target of an assignment outside the locals; None after an error."""
        constants = self.scope.constants
        name = place.name.text if isinstance(place, tree.Reference) else ""
        if name not in self.scope.declared and (name in constants or name in self.scope.members):
            self.scope.report(Code.NOT_WRITABLE, f"`{name}` is a constant", place.span)
            return None
        target = path_of(self.scope, self.body, place)
        return target if target is not None and self._writable(target, deferred, place.span) else None

    def store(self, target: Path, value: tree.Expr, deferred: bool, span: Span) -> tuple[Statement, ...]:
        """Return one assignment for each leaf of the place."""
        if not isinstance(target.type, Bool | Enum | Int | Real):
            return self._copy(target, value, span)
        assigned = typed(self.scope, self.body, value, target.type)
        if assigned is None or not self._assignable(target.type, assigned, value.span, target.names[0]):
            return ()
        names = tuple(pending(name) if deferred else VariableName(name) for name in target.names)
        if target.index is None:
            return (Assign(ToLeaf(names[0], target.type), assigned.expr, span),)
        return (Assign(ToElement(names, target.index, target.type), assigned.expr, span),)

    def _assign_local(
        self, place: tree.Reference, value: tree.Expr, deferred: bool, span: Span
    ) -> tuple[Statement, ...]:
        local = self.body.visible[place.name.text]
        if deferred:
            self.scope.report(
                Code.NOT_DEFERRED, f"`{place.name.text}` is a local, not a deferred variable", place.span
            )
            return ()
        if isinstance(local, Parameter):
            message = f"`{place.name.text}` is a parameter and is not assigned"
            self.scope.report(
                Code.NOT_WRITABLE, message, place.span, "keep its value in a local, and assign that"
            )
            return ()
        if local.name in self.loops:
            self.scope.report(
                Code.NOT_WRITABLE, f"`{place.name.text}` counts a loop and is not assigned", place.span
            )
            return ()
        assigned = typed(self.scope, self.body, value, local.type)
        if assigned is None or not self._assignable(local.type, assigned, value.span, place.name.text):
            return ()
        return (Assign(ToLocal(local.name, local.type), assigned.expr, span),)

    def _writable(self, target: Path, deferred: bool, span: Span) -> bool:
        root = root_of(target.names[0])
        declared = self.scope.declared[root]
        if target.names[0] in self.scope.numbers and not self.is_protocol:
            root = root_of(target.names[0])
            helps = (
                f"`{root} := COMMAND` orders; what `{root}` said is read"
                if root in self.scope.orders
                else "it follows from the commands that are ordered; `COMMAND(again)` numbers the same order anew"
            )
            self.scope.report(Code.NOT_WRITABLE, f"the protocol writes `{target.names[0]}`", span, helps)
            return False
        if declared.kind is Kind.INPUT:
            self.scope.report(Code.NOT_WRITABLE, f"`{root}` is an input; only the world writes it", span)
            return False
        if deferred and target.names[0] not in self.scope.deferred:
            self.scope.report(
                Code.NOT_DEFERRED,
                f"`{target.names[0]}` has no deferred next value",
                span,
                "declare it `deferred until ...`, or assign it without `next`",
            )
            return False
        return True

    def _assignable(self, kind: Scalar, value: Typed, span: Span, name: str = "") -> bool:
        """Return whether a value may be assigned to this type; report it where not, with the variable's name if there is one."""
        if not same_kind(kind, value.expr.type):
            wanted = f"`{name}` is {kind_word(kind)}" if name else f"expected {kind_word(kind)}"
            helps = conversion(kind, value.expr.type)
            self.scope.report(Code.KIND, f"{wanted}, this is {side(value)}", span, *helps)
            return False
        if isinstance(value.expr, Literal):
            return fits(self.scope, kind, value, span)
        if isinstance(kind, Int | Real):
            least = Literal(kind.low, kind)
            return common_unit(self.scope, (Typed(least), value), span) is not None
        return True

    def _copy(self, target: Path, value: tree.Expr, span: Span) -> tuple[Statement, ...]:
        """Copy a whole record or array, leaf by leaf."""
        origin = path_of(self.scope, self.body, value)
        if origin is None:
            return ()
        if origin.type != target.type:
            self.scope.report(Code.KIND, "a record or array is assigned from one of the same type", span)
            return ()
        suffixes = [(suffix, kind) for suffix, kind, *_ in scalars("", target.type)]
        if self._refused(target, origin, len(suffixes), span):
            return ()
        copies: list[Statement] = []
        for suffix, kind in suffixes:
            to, came = self._leaf(target, suffix), self._leaf(origin, suffix)
            read = (
                Read(came[0], kind, value.span)
                if origin.index is None
                else Select(came, origin.index, kind, value.span)
            )
            place = ToLeaf(to[0], kind) if target.index is None else ToElement(to, target.index, kind)
            copies.append(Assign(place, read, span))
        return tuple(copies)

    def _refused(self, target: Path, origin: Path, count: int, span: Span) -> bool:
        """Return whether a copy is too large, or would change an index that its later parts use; report it."""
        self.scope.copied += count * len(target.names) * len(origin.names)
        if self.scope.copied > MOST_STATEMENTS:
            message = f"copies of records and arrays come to more than {MOST_STATEMENTS} statements"
            self.scope.report(Code.LOOP_TOO_LONG, message, span)
            return True
        used = {name for path in (target, origin) if path.index for name in read_by(path.index)}
        own = [name for name in used if any(is_part(name, written) for written in target.names)]
        if own:
            message = f"the index reads `{min(own)}`, which this assignment changes"
            self.scope.report(Code.KIND, message, span, "keep the index in a local first")
        return bool(own)

    @staticmethod
    def _leaf(path: Path, suffix: str) -> tuple[VariableName, ...]:
        return tuple(VariableName(name + suffix) for name in path.names)

    # --- other statements ---

    def _local(self, written: tree.Local) -> tuple[Statement, ...]:
        kind = scalar_of(self.scope, written.type, self.body)
        value = None
        if written.value is not None:
            initial = typed(self.scope, self.body, written.value, kind)
            if initial is not None and self._assignable(kind, initial, written.value.span):
                value = initial.expr
        if written.name.text in self.body.visible:
            self.scope.report(
                Code.DUPLICATE_NAME, f"`{written.name.text}` is declared twice", written.name.span
            )
        local = Local(self.body.fresh(written.name.text), kind, value, written.span)
        self.body.visible[written.name.text] = local
        return (local,)

    def _case(self, written: tree.Case) -> tuple[Statement, ...]:
        subject = typed(self.scope, self.body, written.subject)
        seen: dict[Value, Span] = {}
        arms = tuple(self._arm(arm, subject, seen) for arm in written.arms)
        orelse = self.block(written.orelse or ())
        return () if subject is None else (Case(subject.expr, arms, orelse, written.span),)

    def _arm(self, written: tree.Arm, subject: Typed | None, seen: dict[Value, Span]) -> Arm:
        values = []
        for label in written.values if subject is not None else ():
            assert subject is not None
            value = constant(self.scope, label, subject.expr.type, self.body)
            if value is None or not self._arm_fits(subject, value, label.span):
                continue
            literal = value.literal().value
            if literal in seen:
                self.scope.report(Code.DUPLICATE_ARM, "an arm above already takes this value", label.span)
            seen.setdefault(literal, label.span)
            values.append(literal)
        return Arm(tuple(values), self.block(written.body), written.span)

    def _arm_fits(self, subject: Typed, value: Typed, span: Span) -> bool:
        if not same_kind(subject.expr.type, value.expr.type):
            words = kind_word(subject.expr.type), kind_word(value.expr.type)
            self.scope.report(Code.KIND, f"expected {words[0]}, this is {words[1]}", span)
            return False
        kind, literal = subject.expr.type, value.literal().value
        if isinstance(kind, Int | Real) and not kind.low <= literal <= kind.high:
            low, high = spell_number(kind.low), spell_number(kind.high)
            message = f"{spell_number(literal)} is never taken: the subject lies in {low} .. {high}"
            self.scope.report(Code.OUT_OF_RANGE_CONSTANT, message, span)
            return False
        return common_unit(self.scope, (subject, value), span) is not None

    def _for(self, written: tree.For) -> tuple[Statement, ...]:
        low, high = (constant(self.scope, end, body=self.body) for end in (written.low, written.high))
        if low is None or high is None:
            return ()
        ends = low.literal().value, high.literal().value
        if not (isinstance(low.expr.type, Int) and isinstance(high.expr.type, Int)):
            self.scope.report(Code.KIND, "a loop counts whole numbers", written.span)
            return ()
        if common_unit(self.scope, (low, high), written.span) is None:
            return ()
        first, last = int(ends[0]), int(ends[1])
        if last - first >= MOST_ROUNDS:
            self.scope.report(Code.LOOP_TOO_LONG, f"a loop has at most {MOST_ROUNDS} rounds", written.span)
            return ()
        name = self.body.fresh(written.name.text)
        before = dict(self.body.visible)
        self.body.visible[written.name.text] = Local(
            name, Int(first, max(first, last)), None, written.name.span
        )
        self.loops.add(name)
        body = self.block(written.body)
        self.body.visible = before
        return (For(name, first, last, body, written.span),)

    def _call(self, written: tree.Call) -> tuple[Statement, ...]:
        procedure = self.scope.procedures.get(written.name.text)
        if procedure is None:
            self.scope.unknown("procedure", written.name, list(self.scope.procedures))
            return ()
        if len(procedure.params) != len(written.args):
            want, got = len(procedure.params), len(written.args)
            self.scope.report(
                Code.WRONG_ARGUMENTS,
                f"`{written.name.text}` takes {want} argument{'s' * (want != 1)}, not {got}",
                written.span,
            )
            return ()
        args = []
        for kind, arg in zip(self.scope.signatures[written.name.text], written.args, strict=True):
            argument = typed(self.scope, self.body, arg, kind)
            if argument is None or not self._assignable(kind, argument, arg.span):
                return ()
            args.append(argument.expr)
        return (Call(ProcedureName(written.name.text), tuple(args), written.span),)


def _part(record: str, name: tree.Name) -> tree.Expr:
    """Return a field of a variable, at the place of its name."""
    return tree.FieldOf(tree.Reference(replace(name, text=record), name.span), name, name.span)


def cost(body: tuple[Statement, ...], known: dict[str, int]) -> int:
    """Return the greatest number of statements that one run executes, calls included."""
    total = 0
    for statement in body:
        total += 1
        match statement:
            case If(then=then, orelse=orelse):
                total += max(cost(then, known), cost(orelse, known))
            case Case(arms=arms, orelse=orelse):
                total += max([cost(arm.body, known) for arm in arms] + [cost(orelse, known)])
            case For(low=low, high=high, body=inner):
                total += max(0, high - low + 1) * cost(inner, known)
            case Call(procedure=name):
                total += known.get(name, 0)
            case Assign() | Local():
                pass
            case _:
                assert_never(statement)
    return total

"""Everything that has a name before procedures and tables: units, enumerations, constants, types, variables; flattened into leaves.

Constants and types may be declared in any order: one that is asked for before its turn is resolved then.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.operators import Typed, common_unit, kind_word, same_kind
from rcsc.lang.expressions.scope import MOST_LEAVES, Body, Constant, Scope, SetMember
from rcsc.lang.expressions.typed import boolean, members_of
from rcsc.lang.expressions.types import constant, point, size, type_of
from rcsc.lang.interpret import fold
from rcsc.lang.model import (
    Admit,
    Array,
    Bool,
    Declared,
    Enum,
    Int,
    Kind,
    Literal,
    Real,
    Record,
    RecordField,
    Scalar,
    Type,
    Value,
    Variable,
    VariableName,
    key_bounds,
    pending,
    spell,
    start,
    value_of_key,
)
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.screen import MOST_NAME

MOST_LINKS = 100
MOST_REQUIREMENT = 80
"""Characters of the name of a requirement."""
_NOT_IN_REQUIREMENT = frozenset("|#\\")


def requirements(scope: Scope, written: Iterable[tree.Name]) -> tuple[str, ...]:
    """Return the names of requirements, each once; report an invalid name."""
    known: dict[str, tree.Name] = {}
    for name in written:
        wrong = _wrong(name.text)
        if wrong:
            scope.report(Code.REQUIREMENT_NAME, f"the name of a requirement {wrong}", name.span)
        elif name.text in known:
            message = f"requirement `{name.text}` is named twice"
            first = Label(known[name.text].span, "the first")
            scope.report(Code.REQUIREMENT_NAME, message, name.span, related=(first,))
        known.setdefault(name.text, name)
    return tuple(known)


def _wrong(name: str) -> str:
    """Return what is wrong with the name of a requirement; "" for nothing."""
    if not name or name != name.strip() or "  " in name:
        return "is empty, or has blanks around it or two together"
    if len(name) > MOST_REQUIREMENT:
        return f"has {len(name)} characters, more than {MOST_REQUIREMENT}"
    if not name.isprintable() or _NOT_IN_REQUIREMENT & set(name):
        return "has a character that does not print, or one of `|`, `#` and `\\`"
    return ""


class Names:
    """The declarations of one program that others refer to.

    Attributes:
        waiting: Constants and types not yet resolved, by `SPACE NAME`.
        path: Those being resolved now, each asked for by the one before.
    """

    def __init__(self, scope: Scope, all_: list[tree.Declaration]) -> None:
        self.scope = scope
        self.all = all_
        self.waiting: dict[str, tree.ConstDecl | tree.SetDecl | tree.TypeDecl | tree.RecordDecl] = {}
        self.path: list[str] = []

    def declare(self) -> tuple[Enum, ...]:
        """Declare everything, and return the enumerations in text order."""
        scope = self.scope
        for unit in (d for d in self.all if isinstance(d, tree.UnitDecl)):
            if scope.claim(unit.name, "unit"):
                scope.units.add(unit.name.text)
        enums = tuple(_declare_enum(scope, d) for d in self.all if isinstance(d, tree.EnumDecl))
        for const in self.all:
            match const:
                case tree.ConstDecl(name=name) if scope.claim(name, "value"):
                    self.waiting[f"value {name.text}"] = const
                case tree.SetDecl(name=name) if scope.claim(name, "value"):
                    scope.set_names.add(name.text)
                    self.waiting[f"value {name.text}"] = const
                case tree.TypeDecl(name=name) | tree.RecordDecl(name=name) if scope.claim(name, "type"):
                    self.waiting[f"type {name.text}"] = const
                case _:
                    pass
        declared = [d for d in self.all if isinstance(d, tree.VariableDecl)]
        mine = [variable for variable in declared if scope.claim(variable.name, "value")]
        scope.variables.update(variable.name.text for variable in mine)
        scope.demand = self._demand
        for key in list(self.waiting):
            if key in self.waiting:
                self._resolve(key)
        for variable in mine:
            _declare_variable(scope, variable)
        for variable in mine:
            _settle_deferred(scope, variable)
        return enums

    def _demand(self, space: str, name: tree.Name) -> bool:
        """Resolve a name that is asked for before its turn; return False (reported) where it depends on itself."""
        key = f"{space} {name.text}"
        if key in self.path:
            names = [link.partition(" ")[2] for link in (*self.path[self.path.index(key) :], key)]
            message = f"`{name.text}` is declared by means of itself: {' -> '.join(names)}"
            code = Code.KIND if space == "type" else Code.NOT_CONSTANT
            self.scope.report(code, message, name.span)
            return False
        if key in self.waiting:
            if len(self.path) == MOST_LINKS:
                message = f"declarations refer to each other more than {MOST_LINKS} deep"
                self.scope.report(Code.TOO_DEEP, message, name.span, "declare what is used before its use")
                return False
            self._resolve(key)
        return True

    def _resolve(self, key: str) -> None:
        scope, declaration = self.scope, self.waiting.pop(key)
        self.path.append(key)
        depth, scope.depth = scope.depth, 0
        match declaration:
            case tree.ConstDecl():
                _declare_constant(scope, declaration)
            case tree.SetDecl():
                _declare_set(scope, declaration)
            case tree.TypeDecl():
                scope.types[declaration.name.text] = type_of(scope, declaration.type)
            case tree.RecordDecl():
                _declare_record(scope, declaration)
        scope.depth = depth
        self.path.pop()


def _declare_enum(scope: Scope, written: tree.EnumDecl) -> Enum:
    """Add an enumeration and its members."""
    first: dict[str, tree.Name] = {}
    for member in written.members:
        if member.text in first:
            scope.report(Code.DUPLICATE_NAME, f"`{member.text}` is a member twice", member.span)
        first.setdefault(member.text, member)
    enum = Enum(written.name.text, tuple(first), written.name.span.file)
    if scope.claim(written.name, "type"):
        scope.types[enum.name] = enum
        for member_name in first:
            scope.members.setdefault(member_name, []).append(enum)
    return enum


def _declare_record(scope: Scope, written: tree.RecordDecl) -> None:
    parts: dict[str, RecordField] = {}
    for part in written.fields:
        kind = type_of(scope, part.type)
        first = value_given(scope, part.initial, element(kind), "initial")
        safe = value_given(scope, part.safe, kind, "safe")
        if part.name.text in parts:
            scope.report(Code.DUPLICATE_NAME, f"`{part.name.text}` is a field twice", part.name.span)
        parts.setdefault(part.name.text, RecordField(part.name.text, kind, " ".join(part.doc), first, safe))
    record = Record(written.name.text, tuple(parts.values()), written.name.span.file)
    if size(record) > MOST_LEAVES:
        message = f"a type has at most {MOST_LEAVES} scalar parts"
        scope.report(Code.TOO_MANY_LEAVES, message, written.name.span)
        scope.types[written.name.text] = Bool()
        return
    scope.types[record.name] = record
    scope.records.append(record)


def _declare_constant(scope: Scope, written: tree.ConstDecl) -> None:
    value = constant(scope, written.value)
    if value is not None:
        scope.constants[written.name.text] = Constant(value.literal(), value.bare)


def _declare_set(scope: Scope, written: tree.SetDecl) -> None:
    """Add a set of values of a scalar type."""
    kind = type_of(scope, written.type)
    if isinstance(kind, Array | Record):
        message = f"a set has values of a scalar type, `{written.name.text}` none"
        scope.report(Code.KIND, message, written.name.span)
        return
    members = members_of(scope, written, kind)
    if members is None:
        return
    resolved: list[SetMember] = []
    for member in members:
        if isinstance(member, tree.Mask):
            resolved.append(member)
            continue
        ends = member if isinstance(member, tuple) else (member,)
        known = [value for end in ends if (value := _of_set(scope, kind, end)) is not None]
        if len(known) < len(ends):
            return
        resolved.append((known[0], known[1]) if len(known) > 1 else known[0])
    scope.sets[written.name.text] = tuple(resolved)


def _of_set(scope: Scope, kind: Scalar, member: Typed) -> Constant | None:
    """Return a member or an end of a range as a value of the set's type, with its unit; None after an error."""
    value, span = fold(member.expr), member.expr.span
    if value is None:
        scope.report(Code.NOT_CONSTANT, "the members of a set are constants", span)
        return None
    literal = Literal(value, point(member.expr.type, value), span)
    if not fits(scope, kind, Typed(literal, member.bare), span):
        return None
    own = literal.type
    if isinstance(kind, Int | Real) and isinstance(own, Int | Real) and kind.unit:
        return Constant(replace(literal, type=replace(own, unit=kind.unit)), False)
    return Constant(literal, member.bare)


def _declare_variable(scope: Scope, written: tree.VariableDecl) -> None:
    """Add a variable and its leaves; the pending leaf of a deferred one directly after it."""
    kind = type_of(scope, written.type)
    if size(kind) + len(scope.leaves) > MOST_LEAVES:
        scope.report(
            Code.TOO_MANY_LEAVES, f"a program has at most {MOST_LEAVES} scalar variables", written.name.span
        )
        return
    flat = list(scalars(written.name.text, kind))
    if max((len(name) for name, *_ in flat), default=0) > MOST_NAME:
        message = f"a part of `{written.name.text}`, written out, has more than {MOST_NAME} characters"
        scope.report(Code.LONG_NAME, message, written.name.span)
        return
    initial = value_given(scope, written.initial, element(kind), "initial")
    safe = _safe(scope, written, kind)
    restart = _restart(scope, written, kind)
    deferred = written.deferred_until is not None and _may_be_deferred(scope, written, kind)
    for name, leaf, first, of_field in flat:
        shown = None if written.kind != "output" else of_field if safe is None else safe
        own = first if initial is None else initial
        meant = own if own is not None or scope.least_first else shown
        begins = value_of_key(leaf, key_bounds(leaf)[0]) if scope.least_first else start(leaf)
        variable = Variable(
            VariableName(name),
            Kind(written.kind),
            leaf,
            begins if meant is None else meant,
            _admit(scope, written, leaf),
            None,
            " ".join(written.doc),
            written.name.span,
            shown,
            restart,
            given=meant is not None,
        )
        scope.leaves[name] = variable
        if deferred:
            scope.deferred.add(name)
            scope.leaves[pending(name)] = replace(variable, name=pending(name), kind=Kind.STATE)
    scope.declared[written.name.text] = Declared(
        written.name.text,
        Kind(written.kind),
        kind,
        tuple(VariableName(name) for name, *_ in flat),
        " ".join(written.doc),
        written.name.span,
    )


def _settle_deferred(scope: Scope, written: tree.VariableDecl) -> None:
    """Resolve `until`, once every variable is known."""
    name = written.name.text
    if written.deferred_until is None or name not in scope.deferred:
        return
    until = boolean(scope, Body(), written.deferred_until)
    if until is not None:
        scope.leaves[name] = replace(scope.leaves[name], deferred_until=until)


def scalars(
    name: str, kind: Type, first: Value | None = None, safe: Value | None = None
) -> Iterator[tuple[str, Scalar, Value | None, Value | None]]:
    """Yield the scalar parts, each with the initial and the safe value from its record."""
    match kind:
        case Array(length, inner):
            for at in range(length):
                yield from scalars(f"{name}[{at}]", inner, first, safe)
        case Record(fields=fields):
            for part in fields:
                yield from scalars(f"{name}.{part.name}", part.type, part.initial, part.safe)
        case _:
            yield name, kind, first, safe


def element(kind: Type) -> Type:
    """Return the type of the elements of an array, or of arrays of arrays; the type itself where it is no array."""
    while isinstance(kind, Array):
        kind = kind.element
    return kind


def value_given(scope: Scope, written: tree.Expr | None, kind: Type, what: str) -> Value | None:
    """Return the initial, safe or restart value; None where none is written, or no valid one.

    The initial value of an array is that of each element.
    """
    if written is None:
        return None
    if not isinstance(kind, Bool | Enum | Int | Real):
        scope.report(
            Code.KIND,
            f"a record{'' if what == 'initial' else ' or array'} has no {what} value of its own",
            written.span,
        )
        return None
    value = constant(scope, written, kind)
    if value is None or not fits(scope, kind, value, written.span):
        return None
    literal = value.literal().value
    return float(literal) + 0.0 if isinstance(kind, Real) else literal


def _safe(scope: Scope, written: tree.VariableDecl, kind: Type) -> Value | None:
    if written.safe is not None and written.kind != "output":
        message = f"only an output has a safe value, `{written.name.text}` is not one"
        scope.report(Code.KIND, message, written.name.span)
        return None
    return value_given(scope, written.safe, kind, "safe")


def _restart(scope: Scope, written: tree.VariableDecl, kind: Type) -> Value | None:
    if written.restart is not None and written.kind == "input":
        message = f"a state or an output has a value after a restart, `{written.name.text}` is an input"
        scope.report(Code.KIND, message, written.name.span)
        return None
    return value_given(scope, written.restart, kind, "restart")


def fits(scope: Scope, kind: Scalar, value: Typed, span: Span) -> bool:
    """Return whether a constant may be a value of the type; report it where not."""
    if not same_kind(kind, value.expr.type):
        scope.report(Code.KIND, f"expected {kind_word(kind)}, this is {kind_word(value.expr.type)}", span)
        return False
    if isinstance(kind, Int | Real):
        target = Typed(Literal(kind.low, kind), False)
        if common_unit(scope, (target, value), span) is None:
            return False
        literal = value.literal().value
        if not kind.low <= literal <= kind.high:
            scope.report(
                Code.OUT_OF_RANGE_CONSTANT,
                f"{spell(kind, literal)} is not in {spell(kind, kind.low)} .. {spell(kind, kind.high)}",
                span,
            )
            return False
    return True


def _admit(scope: Scope, written: tree.VariableDecl, leaf: Scalar) -> Admit:
    if not written.admit:
        return Admit.REJECT
    if written.kind != "input":
        scope.report(
            Code.KIND, f"only an input is admitted, `{written.name.text}` is not one", written.name.span
        )
        return Admit.REJECT
    if written.admit == "clamp" and not isinstance(leaf, Int | Real):
        scope.report(Code.KIND, "only a number can be clamped", written.name.span, "leave `clamp` out")
        return Admit.REJECT
    return Admit(written.admit)


def _may_be_deferred(scope: Scope, written: tree.VariableDecl, kind: Type) -> bool:
    if written.kind != "state" or not isinstance(kind, Bool | Enum | Int | Real):
        scope.report(
            Code.NOT_DEFERRED,
            "only a state variable that is a single value can be deferred",
            written.name.span,
        )
        return False
    return True

"""What tables, assumptions and procedures look back at: hidden states that hold the values after the cycle before.

In: a resolved expression of the present. Out: the same of the cycle before; and the procedure that keeps, as the last thing of a cycle,
each leaf that something looks back at. So every stage sees a state as any other: free where one table is proved, exact where levels
are, and in no program that does not ask for it.
"""

from dataclasses import replace

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.source import Span
from rcsc.lang.expressions.scope import MOST_LEAVES, Scope
from rcsc.lang.leaves import one_earlier, read_by, renamed
from rcsc.lang.model import (
    Action,
    Admit,
    Assign,
    Call,
    Declared,
    Expr,
    Kind,
    Level,
    Procedure,
    ProcedureName,
    Read,
    Record,
    Table,
    ToLeaf,
    Type,
    Variable,
    VariableName,
)
from rcsc.lang.restart import Adopted, After, SameAs

KEEP = "keep_previous"
"""The procedure that ends a cycle; a digit is added where the program has one of that name."""


def before(scope: Scope, now: Expr, span: Span) -> Expr | None:
    """The expression of the values after the cycle before; None after an error."""
    if scope.in_property:
        return one_earlier(now)
    if next(read_by(now), None) is None:
        message = "`was` is about a variable; a constant, a local or a parameter has no cycle before"
        scope.report(Code.NO_CYCLE_BEFORE, message, span)
        return None
    past = renamed(now, lambda name: _hidden(scope, name))
    if len(scope.leaves) > MOST_LEAVES:
        message = f"with those that are looked back at there are more than {MOST_LEAVES} scalar variables"
        scope.report(Code.TOO_MANY_LEAVES, message, span)
        return None
    return past


def _hidden(scope: Scope, name: VariableName) -> VariableName:
    """The state that holds a leaf's value of the cycle before, made when it is first asked for; of an array all elements are."""
    if name not in scope.previous:
        base, bracket, _ = name.partition("[")
        leaves = [leaf for leaf in scope.leaves if leaf.startswith(f"{base}[")] if bracket else [name]
        own = fresh(scope, f"was_{base.replace('.', '_')}")
        doc = f"{base} after the cycle before"
        first = scope.leaves[name]
        for leaf in map(VariableName, leaves):
            hidden = VariableName(f"{own}{leaf.removeprefix(base)}")
            scope.leaves[hidden] = _keeper(scope.leaves[leaf], hidden, doc)
            scope.previous[leaf] = hidden
        kind = _type_at(scope, base) if bracket else first.type
        names = tuple(scope.previous[VariableName(leaf)] for leaf in leaves)
        scope.kept.append(Declared(own, Kind.STATE, kind, names, doc, first.span))
    return scope.previous[name]


def _keeper(leaf: Variable, name: VariableName, doc: str) -> Variable:
    """The state that keeps a leaf's value; it begins, and begins anew, as the leaf does."""
    return replace(
        leaf,
        name=name,
        kind=Kind.STATE,
        admit=Admit.REJECT,
        deferred_until=None,
        doc=doc,
        safe=None,
        previous_of=leaf.name,
    )


def _type_at(scope: Scope, path: str) -> Type:
    """The type of a variable, or of a field of it."""
    root, *fields = path.split(".")
    kind = scope.declared[root].type
    for field in fields:
        assert isinstance(kind, Record)
        kind = next(part.type for part in kind.fields if part.name == field)
    return kind


def fresh(scope: Scope, name: str) -> str:
    """The name, or the first of `NAME_2`, `NAME_3` that nothing else has."""
    taken = {*scope.leaves, *(kept.name for kept in scope.kept), *scope.declared, *scope.variables}
    taken |= {*scope.constants, *scope.members, *scope.types}
    number, unique = 2, name
    while unique in taken:
        unique, number = f"{name}_{number}", number + 1
    return unique


def keeping(scope: Scope, names: set[str], span: Span) -> Procedure | None:
    """The procedure that keeps all that is looked back at; None where nothing is.

    Args:
        scope: All that is resolved.
        names: Names that the program gives to procedures and owners.
        span: Where a message about it points.
    """
    if not scope.previous:
        return None
    number, own = 2, KEEP
    while own in names:
        own, number = f"{KEEP}_{number}", number + 1
    body = tuple(
        Assign(ToLeaf(hidden, scope.leaves[name].type), Read(name, scope.leaves[name].type, span), span)
        for name, hidden in scope.previous.items()
    )
    return Procedure(
        ProcedureName(own),
        (),
        body,
        tuple(sorted(scope.previous, key=scope.order)),
        tuple(sorted(scope.previous.values(), key=scope.order)),
        None,
        "Keeps what the next cycle looks back at.",
        span,
    )


def with_keeping(
    keep: Procedure, levels: tuple[Level, ...], tables: tuple[Table, ...]
) -> tuple[tuple[Level, ...], tuple[Table, ...]]:
    """Levels that keep as the last part of their postprocess, and tables outside any level that do as their last action."""
    run = {name for level in levels for name in level.table_names}
    return (
        tuple(replace(level, postprocess=(*level.postprocess, keep.name)) for level in levels),
        tuple(table if table.name in run else _alone(keep, table) for table in tables),
    )


def _alone(keep: Procedure, table: Table) -> Table:
    def last(span: Span) -> Action:
        return Action("procedures", keep.name, Call(keep.name, (), span))

    default = table.default
    return replace(
        table,
        lines=tuple(replace(line, actions=(*line.actions, last(line.span))) for line in table.lines),
        default=None if default is None else replace(default, actions=(*default.actions, last(default.span))),
    )


def adopted_before(scope: Scope, adopted: dict[str, Adopted]) -> dict[str, Adopted]:
    """What hidden states adopt: what their leaves do, of which they come after; others begin as initially."""
    return {
        hidden: SameAs(name) if isinstance(adopted[name], After) else adopted[name]
        for name, hidden in scope.previous.items()
        if name in adopted
    }

"""What tables, assumptions and procedures look back at: hidden states that hold the values after the cycle before, or count cycles.

In: a resolved expression of the present. Out: the same of the cycle before, or that it has held for a time; and the procedure that
keeps, as the last thing of a cycle, each leaf that something looks back at, and counts on. So every stage sees a state as any other:
free where one table is proved, exact where levels are, and in no program that does not ask for it.

`c for T` is that c holds, and held after each of the last T / period cycles. The counter goes up with each cycle after which c holds,
as far as any `for` of this condition needs, and back to 0 with each other one.
"""

from dataclasses import replace
from fractions import Fraction

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.placing import placed
from rcsc.lang.expressions.scope import MOST_LEAVES, Held, Scope
from rcsc.lang.leaves import free_name, one_earlier, parts, read_by, renamed
from rcsc.lang.meaning import spelled
from rcsc.lang.model import (
    Action,
    Admit,
    Apply,
    Assign,
    Bool,
    Call,
    Declared,
    Expr,
    If,
    Int,
    Kind,
    Level,
    Literal,
    Op,
    Procedure,
    ProcedureName,
    Read,
    ReadLocal,
    Record,
    Statement,
    Table,
    ToLeaf,
    Type,
    Unit,
    Value,
    Variable,
    VariableName,
)
from rcsc.lang.restart import Adopted, After, SameAs, Stands
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr

KEEP = "keep_previous"
"""The procedure that ends a cycle; a digit is added where the program has one of that name."""


def before(scope: Scope, now: Expr, span: Span) -> Expr | None:
    """Return the expression over the values after the cycle before; None after an error."""
    if scope.past is not None and scope.past.is_of_before(read_by(now)):
        if isinstance(now.type, Bool):
            return scope.past.before(now)
        scope.report(
            Code.NO_CYCLE_BEFORE,
            "`was` goes back one cycle, not two",
            span,
            "a condition may: `was (x > was y)`",
            *(
                ("an assumption reads what the level writes as the cycle before left it",)
                if scope.past.found
                else ()
            ),
        )
        return None
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


AT_ONCE = "what has to hold for a time is a condition of one cycle, without `was`, events and another `for`"
OF_TWO_CYCLES = "an event is of two cycles, and cannot be part of `was` or of another event"
OF_A_VARIABLE = "give the heading's value to a variable, in a table before, and say it of that"
MOST_CYCLES = 2**32 - 1
_MS = {(("ms", 1),): 1, (("s", 1),): 1000}
"""Milliseconds of each unit of time."""


def cycles_of(scope: Scope, written: tree.Time, time: Value, unit: Unit, helps: str = "") -> int | None:
    """Return the number of cycles in a time whose value is known, at least 1; None (reported) where it is no whole number of them."""
    span = written.span
    if not _counts(scope, span):
        return None
    if written.cycles:
        if not unit and isinstance(time, int) and not isinstance(time, bool) and 1 <= time <= MOST_CYCLES:
            return time
        message = f"`{spell_expr(written.value)} cycles` is no number of cycles from 1 to {MOST_CYCLES}"
        scope.report(Code.NO_CYCLES, message, span, helps)
        return None
    period = _period(scope, span)
    if period is None:
        return None
    if unit not in _MS or isinstance(time, bool):
        scope.report(Code.UNIT, "what has to hold does so for a time in `ms` or `s`", span, "`for 2 [s]`")
        return None
    exact = Fraction(repr(time)) * _MS[unit] / period
    cycles = round(exact)
    if exact != cycles or not 1 <= cycles <= MOST_CYCLES:
        below = min(max(exact.numerator // exact.denominator, 1), MOST_CYCLES - 1)
        near = " or ".join(f"`{_in_ms(number * period)}`" for number in (below, below + 1))
        whole = f"no whole number of cycles of {period} ms, 1 or more"
        wrong = whole if cycles <= MOST_CYCLES else f"more than {MOST_CYCLES} cycles of {period} ms"
        message = f"`{time} [{unit[0][0]}]` is {wrong}"
        scope.report(Code.NO_CYCLES, message, span, f"write {near}")
        return None
    return cycles


def _in_ms(number: int) -> str:
    return f"{number // 1000} [s]" if number % 1000 == 0 else f"{number} [ms]"


def _counts(scope: Scope, span: Span) -> bool:
    """Return whether cycles are counted where `for` stands; report it where they are not."""
    nowhere = "`for` stands in tables, assumptions, procedures and properties"
    message = nowhere if scope.periods is None else scope.untimed
    if message:
        scope.report(Code.NO_CYCLES, message, span)
    return not message


def _period(scope: Scope, span: Span) -> int | None:
    """Return the period of the program's levels in ms; None (reported) where they have several, or none."""
    assert scope.periods is not None
    if len(scope.periods) > 1:
        every = " and ".join(f"{period} ms" for period in scope.periods)
        message = f"how many cycles a time is depends on the level: they have periods of {every}"
    elif not scope.periods:
        message = "no level says how long a cycle is, so that a time is no number of cycles"
    else:
        return scope.periods[0]
    scope.report(Code.NO_CYCLES, message, span)
    return None


def looks_back(scope: Scope, expr: Expr) -> bool:
    """Return whether an expression is of the cycle before already, or of several."""
    kept = {*scope.previous.values(), *(held.counter for held in scope.held.values())}
    return not kept.isdisjoint(read_by(expr))


def lasting(scope: Scope, condition: Expr, text: str, cycles: int, span: Span) -> Expr | None:
    """Return the condition that `condition` (spelled `text`) holds and held after each of the last `cycles` cycles; None after an error."""
    if next(read_by(condition), None) is None:
        message = "`for` is about a variable; a constant, a local or a parameter has not held for a time"
        scope.report(Code.NO_CYCLE_BEFORE, message, span)
        return None
    if scope.past is not None:
        return scope.past.lasting(condition, cycles)
    local = next((part for part in parts(condition) if isinstance(part, ReadLocal)), None)
    if local is not None:
        message = f"`{local.name}` is known in its procedure alone: what has to hold for a time is counted where each cycle ends"
        helps = "say it of variables and constants: of a state, if need be, that keeps the value"
        scope.report(Code.NO_CYCLE_BEFORE, message, local.span, helps)
        return None
    if looks_back(scope, condition):  # by the heading, where the cell has none of them
        scope.report(Code.NO_CYCLE_BEFORE, AT_ONCE, span, OF_A_VARIABLE)
        return None
    key = spelled(_plain(condition))
    known = scope.held.get(key)
    if scope.in_property and (known is None or known.limit < cycles):
        message = "a property generates nothing, and no table counts so far how long this has held"
        scope.report(Code.NO_CYCLE_BEFORE, message, span, "say it of a state that a table sets")
        return None
    scope.limits[key] = max(scope.limits.get(key, 0), cycles)
    if known is None:
        known = scope.held[key] = _counted(scope, condition, text, scope.limits[key], span)
    counter: Expr = Read(known.counter, Int(0, known.limit), span)
    counter = one_earlier(counter) if scope.in_property else counter
    reached = Apply(Op.GE, (counter, _number(cycles, span)), Bool(), span)
    return Apply(Op.AND, (condition, reached), Bool(), span)


def _plain(condition: Expr) -> Expr:
    """Return the same condition without comparisons to truth values: `x = true` is `x`."""
    match condition:
        case Apply(op=Op.EQ | Op.NE as op, args=(inner, Literal(value=value, type=Bool()))):
            holds = bool(value) is (op is Op.EQ)
            return _plain(inner) if holds else _plain(Apply(Op.NOT, (inner,), Bool()))
        case Apply(op=Op.NOT, args=(Apply(op=Op.NOT, args=(inner,)),)):
            return _plain(inner)
        case Apply(op=Op.NOT, args=(inner,)):
            plain = _plain(inner)
            return (
                Apply(Op.NOT, (plain,), Bool()) if plain == inner else _plain(Apply(Op.NOT, (plain,), Bool()))
            )
        case _:
            return condition


def _counted(scope: Scope, condition: Expr, text: str, limit: int, span: Span) -> Held:
    """Make the counter of a condition, when it is first asked for."""
    of = str(next(read_by(condition))).translate(str.maketrans(".[", "__", "]"))
    name = VariableName(fresh(scope, f"held_{of}"))
    doc = f"cycles for which {text} has held, up to {limit}"
    kind = Int(0, limit)
    plain = _plain(condition)
    scope.leaves[name] = Variable(name, Kind.STATE, kind, 0, doc=doc, span=scope.at(span), counts=plain)
    scope.kept.append(Declared(str(name), Kind.STATE, kind, (name,), doc, scope.at(span)))
    return Held(condition if scope.cell is None else placed(condition, scope.cell), name, limit)


def _number(value: int, span: Span) -> Expr:
    return Literal(value, Int(value, value), span)


def _count(held: Held) -> Statement:
    """Count a cycle at whose end the condition holds; after any other, return to 0."""
    kind, span = Int(0, held.limit), held.condition.span
    counter, place = Read(held.counter, kind, span), ToLeaf(held.counter, kind)
    more = Apply(Op.ADD, (counter, _number(1, span)), Int(1, held.limit + 1), span)
    room = Apply(Op.LT, (counter, _number(held.limit, span)), Bool(), span)
    goes_on = If(room, (Assign(place, more, span),), (), span)
    return If(held.condition, (goes_on,), (Assign(place, _number(0, span), span),), span)


def _hidden(scope: Scope, name: VariableName) -> VariableName:
    """Return the state that holds a leaf's value of the cycle before; make it at first use, for an array with all its elements."""
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
    """Return the state that keeps a leaf's value; its initial value and its value after a restart are the leaf's."""
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
    root, *fields = path.split(".")
    kind = scope.declared[root].type
    for field in fields:
        assert isinstance(kind, Record)
        kind = next(part.type for part in kind.fields if part.name == field)
    return kind


def fresh(scope: Scope, name: str) -> str:
    """Return the name, or the first numbered one that nothing else has."""
    taken = {*scope.leaves, *(kept.name for kept in scope.kept), *scope.declared, *scope.variables}
    return free_name(name, taken | {*scope.constants, *scope.members, *scope.types})


def keeping(scope: Scope, names: set[str], span: Span) -> Procedure | None:
    """Return the procedure that keeps all values that are looked back at; None where there are none.

    Args:
        scope: All that is resolved.
        names: Names that the program gives to procedures and owners.
        span: Where a message about it points.
    """
    if not scope.previous and not scope.held:
        return None
    own = free_name(KEEP, names)
    body = (
        *(_count(held) for held in scope.held.values()),
        *(
            Assign(ToLeaf(hidden, scope.leaves[name].type), Read(name, scope.leaves[name].type, span), span)
            for name, hidden in scope.previous.items()
        ),
    )
    counters = {held.counter for held in scope.held.values()}
    read = {leaf for held in scope.held.values() for leaf in read_by(held.condition)}
    return Procedure(
        ProcedureName(own),
        (),
        body,
        tuple(sorted({*scope.previous, *read, *counters}, key=scope.order)),
        tuple(sorted({*scope.previous.values(), *counters}, key=scope.order)),
        None,
        "Keeps what the next cycle looks back at.",
        span,
    )


def with_keeping(
    keep: Procedure, levels: tuple[Level, ...], tables: tuple[Table, ...]
) -> tuple[tuple[Level, ...], tuple[Table, ...]]:
    """Add the procedure to the end of each level's postprocess, and as the last action to tables outside any level."""
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
    """Return what hidden states adopt at a restart: as their leaves do, or the leaf's new value where that is known only then."""
    return {
        hidden: SameAs(name) if isinstance(adopted[name], After | Stands) else adopted[name]
        for name, hidden in scope.previous.items()
        if name in adopted
    }

"""What was written: the syntax tree, unresolved, with spans.

Equality means "says the same": spans and layout do not count, comments do.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TypeAlias

from rcsc.base.diagnostics.source import Span
from rcsc.lang.syntax.rows import Cell

NOWHERE = Span("", 0, 0)


def at() -> Span:
    """Return a field for the place where the node was written, which is no part of what it says."""
    return field(default=NOWHERE, compare=False, repr=False)


# --- names, units, expressions -------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Commented:
    """A node with comments above it, or after it on its line."""

    span: Span = at()
    comments: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Documented(Commented):
    """A declaration, with the doc lines above it."""

    doc: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Name:
    """An identifier as written, or the name of a requirement, without its quotes."""

    text: str
    span: Span = at()


@dataclass(frozen=True, slots=True, kw_only=True)
class Required(Documented):
    """A declaration that may name the requirements it answers: `req "SR-12", "SR-13"`."""

    requirements: tuple["Name", ...] = ()


@dataclass(frozen=True, slots=True)
class UnitFactor:
    """One factor of a unit: `mm`, or `s` with power -1 in `[mm/s]`."""

    name: Name
    power: int = 1


@dataclass(frozen=True, slots=True)
class Unit:
    """`[mm/s]`; `[1/s]` has only factors with negative power."""

    factors: tuple[UnitFactor, ...]
    span: Span = at()


@dataclass(frozen=True, slots=True)
class BoolLiteral:
    """`true` or `false`."""

    value: bool
    span: Span = at()


@dataclass(frozen=True, slots=True)
class IntLiteral:
    """`40`, `0x28`, `0b101000`, `1_000`, each with an optional unit. `text` is as written."""

    text: str
    unit: Unit | None = None
    span: Span = at()


@dataclass(frozen=True, slots=True)
class RealLiteral:
    """`1.5`, `2e-3`, each with an optional unit. `text` is as written."""

    text: str
    unit: Unit | None = None
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Reference:
    """A name in an expression: variable, constant, enum member, local."""

    name: Name
    span: Span = at()


@dataclass(frozen=True, slots=True)
class FieldOf:
    """`base.field`: a field of a record, or `enum_name.member`."""

    base: "Expr"
    name: Name
    span: Span = at()


@dataclass(frozen=True, slots=True)
class IndexOf:
    """`base[index]`."""

    base: "Expr"
    index: "Expr"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class BitsOf:
    """`word[high..low]`: a field of a word."""

    base: "Expr"
    high: "Expr"
    low: "Expr"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Mask:
    """`0bx0xx_1010`, in a cell `x0xx 1010`: bits, `x` for any; `text` is in groups, `x0xx_1010`."""

    text: str
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Unary:
    """`not a` or `-a`; `op` is `not` or `-`."""

    op: str
    operand: "Expr"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Was:
    """`was a`: the value after the cycle before."""

    operand: "Expr"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Event:
    """`@T(a) when b`, `@F(a)`, `@C(a)`: `a` became true, became false or changed with this cycle, and `b` held before it.

    Attributes:
        word: `@T`, `@F` or `@C`; others are reported when names are resolved.
    """

    word: Name
    operand: "Expr"
    guard: "Expr | None" = None
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Time:
    """`200 [ms]`, or `3 cycles`."""

    value: "Expr"
    cycles: bool
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Lasts:
    """`a for 2 [s]`: a holds, and has held for that time or longer."""

    condition: "Expr"
    time: Time
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Once:
    """`once a`: a holds, or has held in a cycle before."""

    operand: "Expr"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Since:
    """`a since b`: b holds, or has held, and a holds in each cycle after that."""

    left: "Expr"
    right: "Expr"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Binary:
    """`op` is the word of an operator of two operands (`operator_table`)."""

    op: str
    left: "Expr"
    right: "Expr"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Range:
    """`low .. high` among the members of a set, both ends included."""

    low: "Expr"
    high: "Expr"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class NamedSet:
    """The name of a set, outside braces: `in ended`."""

    name: Name
    span: Span = at()


@dataclass(frozen=True, slots=True)
class InSet:
    """`subject in {a, b}`, `subject not in ended`; a `NamedSet` stands alone."""

    subject: "Expr"
    members: "tuple[Member, ...]"
    span: Span = at()
    negated: bool = False


@dataclass(frozen=True, slots=True)
class InRange:
    """`subject in low .. high`, both ends included; `subject not in low .. high`."""

    subject: "Expr"
    low: "Expr"
    high: "Expr"
    span: Span = at()
    negated: bool = False


@dataclass(frozen=True, slots=True)
class Apply:
    """`abs(x)`, `min(a, b)`, `max(a, b)`, `int(x)`, `real(x)`, `count(a, b, c)`."""

    function: Name
    args: "tuple[Expr, ...]"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class OrderField:
    """`name := value` in an order."""

    name: Name
    value: "Expr"


@dataclass(frozen=True, slots=True)
class Order:
    """`command(field := value, again)`: a command with fields of its order; `again` gives the same order a new number."""

    command: Name
    fields: "tuple[OrderField, ...]"
    again: bool = False
    span: Span = at()


Expr: TypeAlias = (
    BoolLiteral
    | IntLiteral
    | RealLiteral
    | Reference
    | FieldOf
    | IndexOf
    | BitsOf
    | Mask
    | Unary
    | Was
    | Event
    | Lasts
    | Once
    | Since
    | Binary
    | InSet
    | InRange
    | Apply
    | Order
)


Member: TypeAlias = Expr | Range | NamedSet


# --- types ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BoolType:
    """`bool`."""

    span: Span = at()


@dataclass(frozen=True, slots=True)
class NamedType:
    """An enum, record or type name."""

    name: Name
    span: Span = at()


@dataclass(frozen=True, slots=True)
class IntType:
    """`int LOW .. HIGH [unit]`; bounds are constant expressions."""

    low: Expr
    high: Expr
    unit: Unit | None = None
    span: Span = at()


@dataclass(frozen=True, slots=True)
class RealType:
    """`real LOW .. HIGH [unit]`: an IEEE double in a finite range."""

    low: Expr
    high: Expr
    unit: Unit | None = None
    span: Span = at()


@dataclass(frozen=True, slots=True)
class SingleType:
    """`single LOW .. HIGH [unit]`: an IEEE single in a finite range."""

    low: Expr
    high: Expr
    unit: Unit | None = None
    span: Span = at()


@dataclass(frozen=True, slots=True)
class ArrayType:
    """`array[LENGTH] of ELEMENT`."""

    length: Expr
    element: "TypeExpr"
    span: Span = at()


TypeExpr: TypeAlias = BoolType | NamedType | IntType | RealType | SingleType | ArrayType


# --- statements ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Assign(Commented):
    """`place := value`, or `next place := value` for a deferred variable."""

    place: Expr  # Reference, FieldOf or IndexOf
    value: Expr
    deferred: bool = False


@dataclass(frozen=True, slots=True)
class Local(Commented):
    """`local name : type` or `local name : type := value`."""

    name: Name
    type: TypeExpr
    value: Expr | None = None


@dataclass(frozen=True, slots=True)
class If(Commented):
    """`if c { ... } else if d { ... } else { ... }`; `else if` nests in `orelse`."""

    condition: Expr
    then: "tuple[Statement, ...]"
    orelse: "tuple[Statement, ...]" = ()


@dataclass(frozen=True, slots=True)
class Arm(Commented):
    """`a, b { ... }` in a case."""

    values: tuple[Expr, ...]
    body: "tuple[Statement, ...]"


@dataclass(frozen=True, slots=True)
class Case(Commented):
    """`case subject { a, b { ... } else { ... } }`."""

    subject: Expr
    arms: tuple[Arm, ...]
    orelse: "tuple[Statement, ...] | None" = None


@dataclass(frozen=True, slots=True)
class For(Commented):
    """`for i in LOW .. HIGH { ... }`; the bounds are constants."""

    name: Name
    low: Expr
    high: Expr
    body: "tuple[Statement, ...]"


@dataclass(frozen=True, slots=True)
class Call(Commented):
    """`name` or `name(a, b)` as a statement or in an action cell."""

    name: Name
    args: tuple[Expr, ...] = ()


Statement: TypeAlias = Assign | Local | If | Case | For | Call


# --- table rows ----------------------------------------------------------------------
# Rows are split into cells by `|`; each distinct cell text is parsed once, so nodes inside
# a cell carry spans relative to the start of the cell, with file "". `absolute` mends that.


@dataclass(frozen=True, slots=True)
class Comparison:
    """A condition cell `op expr`; a bare `expr` is `= expr`.

    Attributes:
        places: Where in the cell each of the conditions stands that `and` joins, if each was parsed by itself: its spans count
            from there.
    """

    op: str  # = /= < <= > >=
    value: Expr
    span: Span = at()
    places: tuple[tuple[int, int], ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class OneOf:
    """A condition cell `in {a, b}`, which may be written `a, b`; `not in ended`."""

    members: tuple[Member, ...]
    span: Span = at()
    negated: bool = False


@dataclass(frozen=True, slots=True)
class Between:
    """A condition cell `low .. high`, both ends included; `not in low .. high`."""

    low: Expr
    high: Expr
    span: Span = at()
    negated: bool = False


@dataclass(frozen=True, slots=True)
class Lasting:
    """A condition cell `> 3 for 2 [s]`: one that has held for that time or longer."""

    condition: Comparison | OneOf | Between
    time: Time
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Happens:
    """A condition cell `@T(> 3)`, `@F when b` or `not @C`: the heading came to be so, ceased to be, or changed.

    Attributes:
        word: As of an `Event`.
        operand: What the heading came to be; None where the word stands alone: a heading that is true or false.
        guard: What held before it.
    """

    word: Name
    operand: Comparison | OneOf | Between | None = None
    guard: Expr | None = None
    span: Span = at()
    negated: bool = False


Condition: TypeAlias = Comparison | OneOf | Between | Lasting | Happens


def marked(name: str, above: Sequence[Name], same: Sequence[Name]) -> str:
    """Return a name and the marks `above` and `same`."""
    marks = (("above", above), ("same", same))
    said = (f"{word} {', '.join(other.text for other in names)}" for word, names in marks if names)
    return " ".join((name, *said))


@dataclass(frozen=True, slots=True)
class Row:
    """A line of a table.

    Attributes:
        name: The line's name, the first cell.
        conditions: One entry a condition column; None is a blank cell. Under the heading
            `when` the cell is a `Comparison` with op `=` whose value is the whole expression.
        actions: One entry an action column: its statements (`Call`, `Assign`), in order;
            under the heading of a variable, one `Comparison` with op `=` (the value) or
            nothing.
        cells: Where each cell stands: name, conditions, actions.
        default: Whether this is the DEFAULT line; then all conditions are None.
        unreachable: `DEFAULT unreachable`.
        above: The lines before which it goes where both match; `all` is every other.
        same: Those that do the same where both match.
        requirements: The names under the heading `req`; `cells` leaves them out.
    """

    name: str
    conditions: tuple[Condition | None, ...]
    actions: tuple[tuple[Statement, ...] | Comparison, ...]
    default: bool = False
    unreachable: bool = False
    span: Span = at()
    cells: Sequence[Cell] = field(default=(), compare=False, repr=False)
    comments: tuple[str, ...] = ()
    above: tuple[Name, ...] = ()
    same: tuple[Name, ...] = ()
    requirements: tuple[Name, ...] = ()

    @property
    def stub(self) -> str:
        """The first cell: the name, and the marks `above` and `same`."""
        return marked(self.name, self.above, self.same)


@dataclass(frozen=True, slots=True)
class Heading:
    """A column's heading: `when`, an expression over variables, or an action heading.

    For conditions `subject` is None exactly for `when`. For actions `subject` is None for
    `procedures`, `command_out`, `status_out` (then `word` says which), else the place
    assigned.
    """

    subject: Expr | None
    word: str = ""
    cell: Cell = field(default=Cell("", "", 0), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Across:
    """A column of a turned table: a line that lies on its side.

    Attributes:
        name: The name given to it, or made of its heading.
        given: Whether it is given.
        said: A condition of what the columns are by, or the action that is its result.
        whole: Whether `said` is a condition by itself, after `when`.
        cell: Where `said` stands; `place` is the whole heading.
        above, same: As of a `Row`; they name columns.
    """

    name: str
    said: Condition | tuple[Statement, ...]
    given: bool = False
    whole: bool = False
    above: tuple[Name, ...] = ()
    same: tuple[Name, ...] = ()
    cell: Cell = field(default=Cell("", "", 0), compare=False, repr=False)
    place: Cell = field(default=Cell("", "", 0), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Turned:
    """A table as it is printed the other way round: `table name [by subject] giving place`.

    Attributes:
        by: What the columns' conditions are of; the cells are actions. None where the columns are results, and the cells conditions.
        giving: The heading of the results.
        named: Whether the first column is `line`; else names are made of the conditions.
        conditions: The headings before `||`.
        across: The columns after it, without `req`.
        rows: Its rows. Their `actions` are their cells, those of DEFAULT the one action that it has.
    """

    by: Heading | None
    giving: Heading
    named: bool
    conditions: tuple[Heading, ...]
    across: tuple[Across, ...]
    rows: tuple[Row, ...]


# --- declarations --------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Use(Commented):
    """`use types` or `use task/vars`: makes the names of that file visible."""

    path: str


@dataclass(frozen=True, slots=True)
class UnitDecl(Documented):
    """`unit lb`."""

    name: Name


@dataclass(frozen=True, slots=True)
class ConstDecl(Documented):
    """`const max_width = 110 [mm]`."""

    name: Name
    value: Expr


@dataclass(frozen=True, slots=True)
class SetDecl(Documented):
    """`set ended : status = {done, failed}`."""

    name: Name
    type: "TypeExpr"
    members: "tuple[Member, ...]"


@dataclass(frozen=True, slots=True)
class EnumDecl(Documented):
    """`enum status { executing, done, failed }`."""

    name: Name
    members: tuple[Name, ...]


@dataclass(frozen=True, slots=True)
class TypeDecl(Documented):
    """`type width = int 0 .. 110 [mm]`."""

    name: Name
    type: TypeExpr


@dataclass(frozen=True, slots=True)
class FieldDecl(Documented):
    """`name : type [= initial] [safe value]` in a record."""

    name: Name
    type: TypeExpr
    initial: Expr | None = None
    safe: Expr | None = None


@dataclass(frozen=True, slots=True)
class RecordDecl(Documented):
    """`record emove_status { echo : number ... }`."""

    name: Name
    fields: tuple[FieldDecl, ...]


@dataclass(frozen=True, slots=True)
class VariableDecl(Documented):
    """`input|state|output name : type = initial [safe value] [restart value] [clamp|reject] [deferred [until expr]]`.

    `deferred` says that it stands without `until`: then it waits for the echoes of all the last orders. `admit` is "", "clamp" or
    "reject" and only for inputs, `safe` only for outputs. A missing initial value means the safe value, else 0 of a number, the first
    member, or false.
    """

    kind: str  # input, state, output
    name: Name
    type: TypeExpr
    initial: Expr | None = None
    admit: str = ""
    deferred_until: Expr | None = None
    safe: Expr | None = None
    deferred: bool = False
    restart: Expr | None = None


@dataclass(frozen=True, slots=True)
class AssumeDecl(Required):
    """`assume name [assumed|monitored|assumed monitored|proved] [req ..] : expr`; "" is `assumed`."""

    name: Name
    condition: Expr
    state: str = ""


@dataclass(frozen=True, slots=True)
class InvariantDecl(Required):
    """`invariant name [req ..] : expr`."""

    name: Name
    condition: Expr


@dataclass(frozen=True, slots=True)
class PropertyDecl(Required):
    """`property name [req ..] : expr [then|until|upon expr]`.

    `word` is "" or the word between the two; `other` stands after it.
    """

    name: Name
    condition: Expr
    word: str = ""
    other: Expr | None = None


@dataclass(frozen=True, slots=True)
class RequirementDecl(Required):
    """`requirement name [monitored] [req ..] : [while c,] [when c,] within time, expr`: scope, trigger, timing and response.

    So does `assume name [assumed [monitored]] [req ..] : ...` of what comes from outside.

    Attributes:
        standing: The word of an assumption, "" for none; None of a requirement.
        scope: The words of the scope; "" for none. `mode` is its condition, and `end` that of its end, where it has one.
        trigger: "", "when" or "whenever"; `condition` stands after it.
        timing: The words of the timing, "at most" and "at least" without those after the time, "on" and "off"; `time`, `stop` or `times`
            stand after them where they need one.
        response: What has to hold.
    """

    name: Name
    scope: str
    mode: Expr | None
    trigger: str
    condition: Expr | None
    timing: str
    response: Expr
    time: Time | None = None
    stop: Expr | None = None
    end: Expr | None = None
    times: Expr | None = None
    monitored: bool = False
    standing: str | None = None


@dataclass(frozen=True, slots=True)
class Parameter:
    """`name : type` of a procedure."""

    name: Name
    type: TypeExpr
    span: Span = at()


@dataclass(frozen=True, slots=True)
class ProcedureDecl(Required):
    """`procedure name(params) [req ..] { ... }`, or `module name reads a writes b [req ..] { ... }`.

    A module declares what it reads and writes, and the declaration is checked. An
    `extern procedure` has no body but names its Python (`"pkg.module:function"`) and C
    (`"function"`) implementations.
    """

    kind: str  # procedure, module, extern
    name: Name
    params: tuple[Parameter, ...] = ()
    reads: tuple[Expr, ...] = ()
    writes: tuple[Expr, ...] = ()
    python: str = ""
    c: str = ""
    body: tuple[Statement, ...] = ()


@dataclass(frozen=True, slots=True)
class OwnerDecl(Documented):
    """`owner name { module_a, module_b, other_owner }`: run in the order listed."""

    name: Name
    members: tuple[Name, ...]


@dataclass(frozen=True, slots=True)
class TableDecl(Required):
    """`table name assuming a, b [req ..] { rows }`.

    Attributes:
        traced: Whether it has a column `req`.
        turned: How it is printed, where that is the other way round; all else is of the lines that this comes to.
    """

    name: Name
    assuming: tuple[Name, ...]
    conditions: tuple[Heading, ...]
    actions: tuple[Heading, ...]
    rows: tuple[Row, ...]
    traced: bool = False
    turned: Turned | None = None


@dataclass(frozen=True, slots=True)
class LinkField(FieldDecl):
    """`[stream|reason] name : type [= initial] [safe value] [restart value]` in a link's order or report.

    A `stream` changes without a new number, and is looked at as it comes; the `reason` says why a command failed.
    """

    word: str = ""
    restart: Expr | None = None


@dataclass(frozen=True, slots=True)
class LinkDecl(Documented):
    """`link name { command : type rest member status : type done .. failed .. executing .. order { } report { } }`.

    What a superior and a subordinate say to each other; numbers and echoes are not declared.
    """

    name: Name
    command: Name
    rest: Name
    status: Name
    done: Name
    failed: Name
    executing: Name
    order: tuple[LinkField, ...] = ()
    report: tuple[LinkField, ...] = ()


@dataclass(frozen=True, slots=True)
class ServesDecl(Documented):
    """`serves peer : link [without a, b]`: who gives this level its orders, and which standard properties are not asked of it."""

    peer: Name
    link: Name
    without: tuple[Name, ...] = ()


@dataclass(frozen=True, slots=True)
class CommandsDecl(Documented):
    """`commands peer : link [within expr cycles [else reason]] [answered within ..]`: to whom this level gives orders.

    An order that is not echoed after so many cycles counts as failed, with the reason; so does one that is not answered.

    Attributes:
        late: The reason of an order that is not echoed in time; `unanswered`, of one that is not answered.
    """

    peer: Name
    link: Name
    within: Expr | None = None
    late: Name | None = None
    answered: Expr | None = None
    unanswered: Name | None = None


@dataclass(frozen=True, slots=True)
class AdoptDecl(Documented):
    """`adopt place := expr` or `adopt place after place`: the value that a scalar takes when the level starts anew.

    `after` counts on from a number: the one that stands in the scalar's own buffer, else the other place's.
    """

    place: Expr
    value: Expr
    after: bool = False


@dataclass(frozen=True, slots=True)
class Dispatch:
    """`member : table` in a level's `table by variable { ... }`."""

    value: Expr
    table: Name
    span: Span = at()


@dataclass(frozen=True, slots=True)
class TableClause(Commented):
    """`table t`, or with one table a command: `table by input_command { acquire : acquire_table ... }`."""

    table: Name | None
    selector: Expr | None
    dispatch: tuple[Dispatch, ...]


@dataclass(frozen=True, slots=True)
class LevelDecl(Documented):
    """A control level: preprocess, state tables, postprocess; one cycle a period.

    `level name { period 40 [ms] preprocess a, b table t postprocess c }`; of several tables the order is free.
    """

    name: Name
    period: Expr | None
    preprocess: tuple[Name, ...]
    tables: tuple[TableClause, ...]
    postprocess: tuple[Name, ...]


Declaration: TypeAlias = (
    Use
    | UnitDecl
    | ConstDecl
    | SetDecl
    | EnumDecl
    | TypeDecl
    | RecordDecl
    | VariableDecl
    | AssumeDecl
    | InvariantDecl
    | PropertyDecl
    | RequirementDecl
    | ProcedureDecl
    | OwnerDecl
    | TableDecl
    | LinkDecl
    | ServesDecl
    | CommandsDecl
    | AdoptDecl
    | LevelDecl
)


def statements(declaration: Declaration) -> Iterator[Statement]:
    """Yield every statement of a procedure, or of the action cells of a table; those inside others, too."""
    if isinstance(declaration, ProcedureDecl):
        yield from inside(declaration.body)
    elif isinstance(declaration, TableDecl):
        for row in declaration.rows:
            yield from inside(chain.from_iterable(cell for cell in row.actions if isinstance(cell, tuple)))


def inside(body: Iterable[Statement]) -> Iterator[Statement]:
    """Yield statements, each before those inside it."""
    for statement in body:
        yield statement
        match statement:
            case If(_, then, orelse):
                yield from inside((*then, *orelse))
            case Case(_, arms, orelse):
                yield from inside(chain.from_iterable(arm.body for arm in arms))
                yield from inside(orelse or ())
            case For(body=inner):
                yield from inside(inner)


@dataclass(frozen=True, slots=True)
class File:
    """One source file: its declarations in order."""

    declarations: tuple[Declaration, ...]
    trailing: tuple[str, ...] = ()  # comments after the last declaration
    name: str = field(default="", compare=False)


def absolute(relative: Span, cell: Cell) -> Span:
    """Return the span in the file of a node inside a table cell."""
    return cell.at(relative.start, relative.end)


def term(heading: Heading, cell: Condition) -> Expr:
    """Return the meaning of a condition cell, as an expression."""
    if heading.subject is None:
        assert isinstance(cell, Comparison)
        return cell.value
    match cell:
        case Comparison(op, value):
            return Binary(op, heading.subject, value)
        case Lasting(condition, time):
            return Lasts(term(heading, condition), time)
        case Happens(word, operand, guard, span):
            of = heading.subject if operand is None else term(heading, operand)
            happens = Event(word, of, guard, span)
            return Unary("not", happens, span) if cell.negated else happens
        case OneOf(members):
            return InSet(heading.subject, members, negated=cell.negated)
        case Between(low, high):
            return InRange(heading.subject, low, high, negated=cell.negated)

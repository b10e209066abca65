"""A small tree of code: expressions and statements that C and Python share, and how each language spells them.

`ctext`, `c99`, `pytext` and `python` build it; what is asked of code (names that are read, helpers that are called, reals, what may be
cast) is asked of the tree. What only one language has stands in a `Frame`, whose words are text and whose code is a tree,
or in a `Line`. A template prints blocks by the filters `c` and
`python`.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, TypeAlias, assert_never

from rcsc.code.emit.plan import Origin
from rcsc.lang.model import I64_MAX, I64_MIN, Value
from rcsc.lang.operator_table import spell_single

# --- expressions ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Name:
    """A variable of the code, or a word that stands for a value."""

    text: str
    type: str = ""


@dataclass(frozen=True, slots=True)
class Constant:
    """A number or a truth; `type` says how C spells it: `bool`, `double`, `float`, or an integer type."""

    value: Value
    type: str = "int32_t"


@dataclass(frozen=True, slots=True)
class MemberPath:
    """A member of the state, step by step: a piece of its path as it is spelled, or a computed index."""

    steps: tuple["str | Code", ...]
    type: str = ""


@dataclass(frozen=True, slots=True)
class Prefix:
    """An operator before its operand."""

    op: str
    operand: "Code"


@dataclass(frozen=True, slots=True)
class Infix:
    """An operator between its operands, of which there is at least one."""

    op: str
    operands: tuple["Code", ...]


@dataclass(frozen=True, slots=True)
class Invoke:
    """A call of a function.

    Attributes:
        type: The C type of its result, where that is needed.
        helper: The name of a helper function, if it is one: the file then defines it.
    """

    function: str
    args: tuple["Code", ...] = ()
    type: str = ""
    helper: str = ""


@dataclass(frozen=True, slots=True)
class Cast:
    """A value as one of another type."""

    type: str
    operand: "Code"


@dataclass(frozen=True, slots=True)
class Choice:
    """One of two values."""

    condition: "Code"
    yes: "Code"
    no: "Code"


@dataclass(frozen=True, slots=True)
class Element:
    """An element."""

    of: "Code"
    at: "Code"


@dataclass(frozen=True, slots=True)
class Items:
    """Values together: a tuple in Python, an initialiser in C."""

    items: tuple["Code", ...]


@dataclass(frozen=True, slots=True)
class Round:
    """Code in parentheses, needed or not; needed ones are written without this, too."""

    inner: "Code"


Code: TypeAlias = (
    Name | Constant | MemberPath | Prefix | Infix | Invoke | Cast | Choice | Element | Items | Round
)

# --- statements ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Set:
    """An assignment."""

    place: Code
    value: Code


@dataclass(frozen=True, slots=True)
class Let:
    """A variable of the function: its type in C, its name, its value."""

    type: str
    name: str
    value: Code | None = None


@dataclass(frozen=True, slots=True)
class Do:
    """A call for its effect."""

    call: Code


@dataclass(frozen=True, slots=True)
class Leave:
    """`return`, or another word that ends the function with a value."""

    value: Code
    word: str = "return"


@dataclass(frozen=True, slots=True)
class Branch:
    """The first arm whose condition holds, else `orelse`, where there is one."""

    arms: tuple[tuple[Code, "Body"], ...]
    orelse: "Body | None" = None


@dataclass(frozen=True, slots=True)
class Loop:
    """`name` from `low` to `high`, both included, while `guard` holds (in C; Python leaves by an exception).

    Attributes:
        type: Of the variable, in C.
    """

    name: str
    low: int
    high: int
    body: "Body"
    guard: tuple[Code, ...] = ()
    type: str = ""


@dataclass(frozen=True, slots=True)
class Frame:
    """Code that only one of the languages has: a line of its words and of code, perhaps a block inside and a line after it."""

    head: tuple["str | Code", ...]
    body: "Body" = ()
    tail: str = ""


@dataclass(frozen=True, slots=True)
class Line:
    """A line as it stands: a comment, a row of data."""

    text: str


Stmt: TypeAlias = Set | Let | Do | Leave | Branch | Loop | Frame | Line
Body: TypeAlias = tuple[Stmt, ...]


@dataclass(frozen=True, slots=True)
class Function:
    """A function: its comment, its head, its body.

    Attributes:
        inline: Whether C puts it where it is called: for one that a step calls at one place, its call costs more than it.
        origin: Where it comes from; None for one that serves others, which is told by what is said of it.
    """

    doc: str
    head: str
    body: Body
    inline: bool = False
    origin: Origin | None = None

    @property
    def name(self) -> str:
        """What it is called."""
        return self.head.partition("(")[0].rpartition(" ")[2]


def infix(op: str, *operands: Code) -> Code:
    """Return an operation on these operands; a single operand is returned as it is."""
    return Infix(op, operands) if len(operands) > 1 else operands[0]


def type_bounds(name: str) -> tuple[int, int]:
    """Return the least and the greatest value of an integer type of C, or of `bool`."""
    if name == "bool":
        return 0, 1
    bits = int(name.strip("uint_"))
    return (0, 2**bits - 1) if name.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def times(count: int) -> str:
    """Spell how often: "once", "3 times"."""
    return "once" if count == 1 else f"{count} times"


def repeated(begin: Set, goes: Code, step: Set, *body: Stmt, bound: str, declared: str = "") -> Frame:
    """Return a C `for` with a comment that bounds its runs; it declares its variable, where a type is given."""
    first, then = (infix("=", assignment.place, assignment.value) for assignment in (begin, step))
    return Frame((f"for ({declared}", first, "; ", goes, "; ", then, f") {{ /* {bound} */"), body, "}")


def when(condition: Code, *body: Stmt) -> Branch:
    """Return statements that run only where the condition holds."""
    return Branch(((condition, body),))


def read(node: object) -> Iterator[Code]:
    """Yield every expression in a tree, but for variables that are only set."""
    waiting = [node]
    while waiting:
        node = waiting.pop()
        if isinstance(node, tuple):
            waiting += reversed(node)
        elif isinstance(node, Set) and isinstance(node.place, Name):
            waiting.append(node.value)
        elif isinstance(node, Code | Stmt | Function):
            if isinstance(node, Code):
                yield node
            if isinstance(node, Loop):
                yield Name(node.name)
            waiting += (getattr(node, part) for part in reversed(node.__slots__))


# --- spelling ------------------------------------------------------------------------

TIGHTEST = 9
"""A level above that of every operator."""


class Language(ABC):
    """Spells code.

    Attributes:
        state: The prefix of a member of the state.
        levels: How closely an operator binds, a prefix under its text and `x`; 0 for those not named.
        chained: Operators whose first operand needs no parentheses where it binds as closely.
        end: The end of a plain statement.
        heads: The lines of `if`, of `else if`, of `else`, and the line that closes them all.
    """

    state: str
    levels: ClassVar[Mapping[str, int]]
    chained = ""
    end = ""
    heads: tuple[str, str, str, str]

    def code(self, code: Code) -> str:
        """Spell an expression."""
        match code:
            case Name(text=text):
                return text
            case Constant():
                return self.constant(code)
            case MemberPath(steps=steps):
                return self.state + "".join(s if isinstance(s, str) else f"[{self.code(s)}]" for s in steps)
            case Prefix(op=op, operand=operand):
                return op + self.operand(operand, self.levels.get(f"{op}x", 0))
            case Infix(op=op, operands=operands):
                level, chained = self.levels.get(op, 0), op in self.chained
                parts = (self.operand(x, level - (chained and not at)) for at, x in enumerate(operands))
                return f" {op} ".join(parts)
            case Invoke(function=function, args=args):
                return f"{function}({', '.join(map(self.code, args))})"
            case Cast() | Choice() | Items():
                return self.own(code)
            case Element(of=of, at=at):
                return f"{self.operand(of, TIGHTEST)}[{self.code(at)}]"
            case Round(inner=inner):
                return f"({self.code(inner)})"
            case _:
                assert_never(code)

    def operand(self, code: Code, level: int) -> str:
        """Spell an operand of an operator of this level, in parentheses unless it binds closer."""
        match code:
            case Infix(op=op):
                loose = self.levels.get(op, 0) <= level
            case Prefix(op=op):
                loose = self.levels.get(f"{op}x", 0) <= level
            case _:
                loose = isinstance(code, Choice)
        return f"({self.code(code)})" if loose else self.code(code)

    def lines(self, body: Body, indent: int = 1) -> Iterator[str]:
        """Spell statements, a line each."""
        pad = "    " * indent
        for stmt in body:
            match stmt:
                case Set(place=place, value=value):
                    yield f"{pad}{self.code(place)} = {self.code(value)}{self.end}"
                case Do(call=call):
                    yield f"{pad}{self.code(call)}{self.end}"
                case Leave(value=value, word=word):
                    yield f"{pad}{word} {self.code(value)}{self.end}"
                case Branch(arms=arms, orelse=orelse):
                    for at, (condition, inner) in enumerate(arms):
                        yield pad + self.heads[at > 0].format(self.code(condition))
                        yield from self.lines(inner, indent + 1)
                    if orelse is not None:
                        yield pad + self.heads[2]
                        yield from self.lines(orelse, indent + 1)
                    yield from (pad + close for close in self.heads[3:] if close)
                case Frame(head=head, body=inner, tail=tail):
                    yield pad + "".join(part if isinstance(part, str) else self.code(part) for part in head)
                    yield from self.lines(inner, indent + 1) if inner else ()
                    yield from (pad + text for text in (tail,) if text)
                case Line(text=text):
                    yield pad + text
                case Let() | Loop():
                    yield from self.lines(self.framed(stmt), indent)
                case _:
                    assert_never(stmt)

    @abstractmethod
    def constant(self, constant: Constant) -> str:
        """Spell a number or a truth."""

    @abstractmethod
    def own(self, code: Cast | Choice | Items) -> str:
        """Spell an expression for which each language has its own form."""

    @abstractmethod
    def framed(self, stmt: Let | Loop) -> Body:
        """Return a statement for which each language has its own form, made of simpler ones."""


class C(Language):
    """C99: every operation inside another is in parentheses (MISRA C 12.1)."""

    state, end = "s->", ";"
    levels = MappingProxyType({"=": -1})
    heads = ("if ({}) {{", "}} else if ({}) {{", "} else {", "}")

    def constant(self, constant: Constant) -> str:
        """Spell a constant by its type; the least `int64_t` has no literal of its own."""
        value = constant.value
        match constant.type:
            case "bool":
                return "true" if value else "false"
            case "double" | "float":
                magnitude, single = abs(float(value)), constant.type == "float"
                text = f"{spell_single(magnitude)}f" if single else repr(magnitude)
                return f"(-{text})" if value < 0 else text
            case "int64_t" | "uint64_t":
                if value == I64_MIN:
                    return f"(-INT64_C({I64_MAX}) - INT64_C(1))"
                word = "UINT64_C" if value > I64_MAX or constant.type == "uint64_t" else "INT64_C"
                return f"{word}({value:d})" if value >= 0 else f"(-{word}({-value:d}))"
            case "int32_t" if value == -(2**31):
                return "(-INT32_C(2147483647) - 1)"
            case _:
                return f"{value:d}{'u' if constant.type.startswith('u') else ''}"

    def own(self, code: Cast | Choice | Items) -> str:
        """Spell the expression as in ISO C99, 6.5.4, 6.5.15 and 6.7.8."""
        match code:
            case Cast(type=name, operand=operand):
                return f"({name}){self.operand(operand, -1 if isinstance(operand, Prefix) else 1)}"
            case Choice(condition=condition, yes=yes, no=no):
                return f"{self.operand(condition, 1)} ? {self.operand(yes, 1)} : {self.operand(no, 1)}"
            case Items(items=items):
                return f"{{ {', '.join(map(self.code, items))} }}"

    def framed(self, stmt: Let | Loop) -> Body:
        """Return declarations and loops as C has them; a loop to the last value of its type ends without counting past it."""
        match stmt:
            case Let(type=kind, name=name, value=value):
                return (Line(f"{kind} {name}{'' if value is None else f' = {self.code(value)}'};"),)
            case Loop(name=name, guard=guard, type=kind):
                count, high = Name(name), Constant(stmt.high, kind)
                begin = Set(count, Constant(stmt.low, kind))
                step = Set(count, infix("+", count, Constant(1, kind)))
        bound = f"at most {times(stmt.high - stmt.low + 1)}" if guard else times(stmt.high - stmt.low + 1)
        if stmt.high < type_bounds(kind)[1]:
            goes = infix("&&", infix("<=", count, high), *guard)
            return (repeated(begin, goes, step, *stmt.body, bound=bound, declared=f"{kind} "),)
        more = Name(f"more_{name.removeprefix('v_')}")
        inner = (*stmt.body, Set(more, infix("<", count, high)), when(more, step))
        again = Frame(("while (", infix("&&", more, *guard), f") {{ /* {bound} */"), inner, "}")
        first = Let(kind, name, begin.value)
        return (Frame(("{",), (Let("bool", more.text, Constant(1, "bool")), first, again), "}"),)


class Python(Language):
    """Python 3: parentheses only where they are needed."""

    state = "s."
    levels = MappingProxyType({
        "or": 1, "and": 2, "not x": 3, "in": 4, "==": 4, "!=": 4, "<": 4, "<=": 4, ">": 4, ">=": 4,
        "&": 5, "+": 6, "-": 6, "*": 7, "/": 7, "-x": 8,
    })  # fmt: skip
    chained = "+-"
    heads = ("if {}:", "elif {}:", "else:", "")

    def constant(self, constant: Constant) -> str:
        """Spell a constant; its C type is ignored but for its kind."""
        kind = {"bool": bool, "double": float, "float": float}.get(constant.type, int)
        return repr(kind(constant.value))

    def own(self, code: Cast | Choice | Items) -> str:
        """Spell a conversion, a conditional expression or a tuple."""
        match code:
            case Cast(type=name, operand=operand):
                return f"{name}({self.code(operand)})"
            case Choice(condition=condition, yes=yes, no=no):
                return f"{self.operand(yes, 0)} if {self.operand(condition, 0)} else {self.operand(no, 0)}"
            case Items(items=items):
                return f"({', '.join(map(self.code, items))},)"

    def lines(self, body: Body, indent: int = 1) -> Iterator[str]:
        """Spell statements, a line each; `pass` for an empty body."""
        yield from list(super().lines(body, indent)) or ["    " * indent + "pass"]

    def framed(self, stmt: Let | Loop) -> Body:
        """Return assignments and loops as Python has them; nothing is declared."""
        match stmt:
            case Let(name=name, value=value):
                return (Set(Name(name), value),) if value is not None else ()
            case Loop(name=name, low=low, high=high, body=body):
                within = Invoke("range", (Constant(low), Constant(high + 1)))
                return (Frame(("for ", Name(name), " in ", within, ":"), body or (Line("pass"),)),)


IN_C, IN_PYTHON = C(), Python()

"""What the C of one program is made with: its plan, its names, its expressions; and the pieces that several modules build."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.code.emit.c.ctext import CText
from rcsc.code.emit.c.layout import Digest
from rcsc.code.emit.code_tree import (
    Body,
    Branch,
    Cast,
    Code,
    Constant,
    Do,
    Frame,
    Function,
    Invoke,
    Line,
    MemberPath,
    Name,
    Set,
    Stmt,
    infix,
    read,
    repeated,
    when,
)
from rcsc.code.emit.identifiers import Names
from rcsc.code.emit.plan import Origin, Plan, Sort
from rcsc.code.emit.ranges import Ranges
from rcsc.code.emit.translate import STATE
from rcsc.lang import model
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Program, Variable

MOST_CHAINED = 60
"""Tests in a chain of `else if`."""
NONE = Constant(-1)
"""The position of no line, variable or assumption."""
AT = Name("at")
ONE = Constant(1, "uint64_t")


@dataclass(frozen=True, slots=True)
class CProgram:
    """The C of one program, while it is made.

    Attributes:
        plan: The plan to lay out.
        names: All names.
        text: Expressions and statements.
        digest: The digest that tells its states from those of other tables.
        stated: By procedure, the ranges stated by the lines that run it.
        classifiers: Functions that find the class of a value, as matching asks for them.
    """

    plan: Plan
    names: Names
    text: CText
    digest: Digest
    stated: Mapping[str, Ranges]
    classifiers: list[Function] = field(default_factory=list)

    @property
    def program(self) -> Program:
        """The program."""
        return self.plan.program

    @property
    def origin(self) -> Origin:
        """Where code of all variables of the program comes from."""
        return Origin(Sort.PROGRAM, self.program.name)

    @property
    def p(self) -> str:
        """The prefix of its C names."""
        return self.names.program

    @property
    def foreign(self) -> int:
        """The result of `check` for a state that other tables made: the position after the last invariant's."""
        return len(self.program.variables) + len(self.program.invariants)


def on_state(
    c: CProgram, doc: str, name: str, *body: Stmt, gives: str = "void", origin: Origin | None = None
) -> Function:
    """A function of the state; of all of the program where no other origin is given."""
    return Function(doc, f"{gives} {c.p}_{name}({c.p}_t *s)", body, origin=origin or c.origin)


def run_on_state(c: CProgram, name: str) -> Do:
    """Call a function of the state."""
    return Do(Invoke(f"{c.p}_{name}", (STATE,)))


def fault_name(c: CProgram, fault: Fault) -> Name:
    """Name the constant of a fault."""
    return Name(c.names.faults[fault])


def assigned(c: CProgram, variable: Variable, value: model.Value) -> Set:
    """Return the assignment of a constant to a variable."""
    return Set(c.text.place(variable.name), c.text.constant(variable.type, value))


def discarded(name: Name) -> Do:
    """Return a statement that marks a name as not read."""
    return Do(Cast("void", name))


def touches_state(body: Body) -> bool:
    """Return whether the code reads or writes the state."""
    return any(isinstance(code, MemberPath) or code == STATE for code in read(body))


def first_of(asked: Sequence[tuple[Code, Code]]) -> Iterator[Stmt]:
    """Yield code that sets `at` to the position of the first test that holds; a chain of `else if` is no longer than compilers nest."""
    for begin in range(0, len(asked), MOST_CHAINED):
        arms = tuple((test, (Set(AT, leaf),)) for leaf, test in asked[begin : begin + MOST_CHAINED])
        chain = Branch(arms, (Line("/* none of these */"),))
        yield when(infix("<", AT, Constant(0)), chain) if begin else chain


def counted_loop(count: Name, end: Code, *body: Stmt, bound: str) -> Frame:
    """Return a loop from 0 up to the end, exclusive, with a comment that bounds its runs."""
    zero, one = Constant(0, "uint32_t"), Constant(1, "uint32_t")
    step = Set(count, infix("+", count, one))
    return repeated(Set(count, zero), infix("<", count, end), step, *body, bound=bound)

"""Code that finds the class of a leaf, and the place of several classes together in a table."""

from collections.abc import Iterable, Iterator
from typing import assert_never

from rcsc.code.emit.c.cprogram import AT, CProgram
from rcsc.code.emit.c.ctext import c_type, word_type
from rcsc.code.emit.code_tree import (
    IN_C,
    Body,
    Cast,
    Choice,
    Code,
    Constant,
    Element,
    Frame,
    Function,
    Infix,
    Invoke,
    Leave,
    Let,
    Line,
    MemberPath,
    Name,
    Round,
    Set,
    Stmt,
    infix,
)
from rcsc.code.emit.plan import Coded, Cuts, Direct, Group, Index, Truth
from rcsc.lang import model
from rcsc.lang.model import I64_MIN, Bool, key_bounds


def index_of(c: CProgram, group: Group, name: str) -> Code:
    """Return the joint index of the classes, in mixed radix, the last one fastest."""
    index: Code | None = None
    for number, probe in enumerate(group):
        leaf_class = _class(c, probe.index, f"{name}_{number}")
        moved = index and infix("*", index, Constant(probe.index.count, "uint32_t"))
        index = infix("+", moved, leaf_class) if moved else leaf_class
    assert index is not None
    return index


def _class(c: CProgram, index: Index, name: str) -> Code:
    match index:
        case Direct(leaf=leaf, type=Bool()):
            return bit_of(c.text.place(leaf))
        case Direct(leaf=leaf, low=0):
            return c.text.place(leaf)
        case Direct(leaf=leaf, type=kind, low=low):
            return _above(c, kind, c.text.place(leaf), low)
        case Truth(condition=condition):
            return bit_of(c.text.expr(condition))
        case Coded(leaf=leaf, type=kind, low=low):
            above = _above(c, kind, c.text.place(leaf), low)
            return _classify(c, name, "The class of the value.", above, "uint32_t", _codes(index))
        case Cuts(leaf=leaf, type=kind, cuts=cuts):
            held, place = c_type(kind), c.text.place(leaf)
            if not cuts:
                return Constant(0, "uint32_t")
            if len(cuts) <= 6:
                tests = (bit_of(infix(">=", place, c.text.constant(kind, cut))) for cut in cuts)
                return Infix("+", tuple(tests))
            return _classify(
                c, name, "How many cuts are at most the value.", place, held, tuple(_search(index, held))
            )
        case _:
            assert_never(index)


def _above(c: CProgram, kind: model.Scalar, place: MemberPath, low: int) -> Code:
    """Return code for the distance of a value from the least that has a class."""
    if low == 0:
        return place
    word, sign = word_type(*key_bounds(kind)), "+" if I64_MIN < low < 0 else "-"
    by = Constant(
        abs(low) if low > I64_MIN else low, word
    )  # the opposite of the least has no type with a sign
    return c.text.converted(Round(infix(sign, Cast(word, place), by)), word, "uint32_t")


def _classify(c: CProgram, name: str, doc: str, value: Code, kind: str, body: Body) -> Code:
    """Make a function that finds the class of a value; return its call."""
    function = c.names.c.fresh(f"{c.p}_class_{name}")
    c.classifiers.append(Function(doc, f"uint32_t {function}({kind} value)", body))
    return Invoke(function, (value.inner if isinstance(value, Round) else value,))


def _codes(index: Coded) -> Body:
    """Return code that looks up the class of `value`."""
    head = f"RCSC_CONST_SECTION static const uint{8 if index.count <= 256 else 16}_t classes[{len(index.classes)}] = {{"
    rows = tuple(wrapped(Constant(number, "uint32_t") for number in index.classes))
    return Frame((head,), rows, "};"), Leave(Element(Name("classes"), Name("value")))


def _search(index: Cuts, wide: str) -> Iterator[Stmt]:
    """Yield code that counts the cuts that are at most `value`; its number of steps depends on nothing."""
    count, cuts = Constant(len(index.cuts), "uint32_t"), Name("cuts")
    rows = tuple(wrapped(Constant(cut, wide) for cut in index.cuts))
    yield Frame((f"RCSC_CONST_SECTION static const {wide} cuts[{len(index.cuts)}] = {{",), rows, "};")
    yield Let("uint32_t", "at", Constant(0, "uint32_t"))
    step = 1 << len(index.cuts).bit_length() - 1
    while step:
        ahead, last = (infix("+", AT, Constant(by, "uint32_t")) for by in (step, step - 1))
        reached = infix(">=", Name("value"), Element(cuts, infix("%", last, count)))
        fits = infix("<=", ahead, count)  # of the first step that is always so
        taken = reached if 2 * step > len(index.cuts) else infix("&&", fits, reached)
        yield Set(AT, infix("+", AT, Choice(taken, Constant(step, "uint32_t"), Constant(0, "uint32_t"))))
        step >>= 1
    yield Leave(AT)


def bit_of(condition: Code) -> Code:
    """Return code that is 1 where the condition holds, else 0."""
    return Choice(condition, Constant(1, "uint32_t"), Constant(0, "uint32_t"))


def wrapped(values: Iterable[Code], width: int = 88) -> Iterator[Line]:
    """Yield values of an initialiser, as many in a line as fit."""
    text = ""
    for word in map(IN_C.code, values):
        if text and len(text) + len(word) > width:
            yield Line(text.rstrip())
            text = ""
        text += f"{word}, "
    yield Line(text.removesuffix(", "))

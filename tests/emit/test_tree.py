"""Spelling of trees of code: what is read back from the text is the tree that was spelled."""

import operator
from collections.abc import Callable, Iterator
from typing import Any

from rcsc.code.emit.code_tree import (
    IN_C,
    IN_PYTHON,
    Choice,
    Code,
    Constant,
    Element,
    Infix,
    Items,
    Name,
    Prefix,
    Round,
    Set,
    read,
)

MEANING: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "&": operator.and_, "<": operator.lt, "==": operator.eq,
    "and": lambda a, b: a and b, "or": lambda a, b: a or b,
}  # fmt: skip
IN_THE_OTHER = {"and": "&&", "or": "||", "not ": "!"}
BOUND = {"x": 3, "y": -2, "z": 5}


def larger(parts: list[Code]) -> Iterator[Code]:
    """Every operation on these, beside a name that is no part of them."""
    other = Name("z")
    for tree in parts:
        for op in MEANING:
            yield from (Infix(op, (tree, other)), Infix(op, (other, tree)))
        yield from (Prefix("not ", tree), Prefix("-", tree), Round(tree))
        yield from (Choice(tree, other, other), Choice(other, tree, other), Choice(other, other, tree))
        yield Element(Items((tree, other)), Constant(0))


SMALL = list(larger([Name("x"), Name("y")]))
TREES = list(larger(SMALL))


def value(tree: Code) -> Any:
    """What the tree stands for."""
    match tree:
        case Name(text=text):
            return BOUND[text]
        case Infix(op=op, operands=(left, right)):
            return MEANING[op](value(left), value(right))
        case Prefix(op=op, operand=operand):
            return not value(operand) if op == "not " else -value(operand)
        case Choice(condition=condition, yes=yes, no=no):
            return value(yes) if value(condition) else value(no)
        case Element(of=Items(items=items), at=Constant(value=at)):
            return value(items[int(at)])
        case Round(inner=inner):
            return value(inner)
        case Constant(value=number):
            return number
        case _:
            raise AssertionError(tree)


def in_other_words(tree: Code) -> Code:
    """The same in the operators of C."""
    match tree:
        case Infix(op=op, operands=operands):
            return Infix(IN_THE_OTHER.get(op, op), tuple(map(in_other_words, operands)))
        case Prefix(op=op, operand=operand):
            return Prefix(IN_THE_OTHER.get(op, op), in_other_words(operand))
        case Round(inner=inner):
            return Round(in_other_words(inner))
        case _:
            return tree


def test_python_is_read_as_it_was_meant() -> None:
    for tree in TREES:
        assert eval(IN_PYTHON.code(tree), dict(BOUND)) == value(tree), tree  # noqa: S307 - our own text


def test_c_needs_no_knowledge_of_precedence() -> None:
    for tree in TREES:
        if not any(isinstance(part, Choice | Element) for part in read(tree)):
            text = IN_C.code(in_other_words(tree)).replace("!", " not ")
            text = text.replace("&&", " and ").replace("||", " or ")
            assert eval(text.strip(), dict(BOUND)) == value(tree), tree  # noqa: S307 - our own text


def test_what_is_only_set_is_not_read() -> None:
    names = [Name("a"), Name("b"), Name("i")]
    assert list(read((Set(names[0], names[1]), Set(Element(names[0], names[2]), Constant(1))))) == [
        names[1], Element(names[0], names[2]), names[0], names[2], Constant(1),
    ]  # fmt: skip

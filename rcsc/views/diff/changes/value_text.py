"""Values of a symbolic run in the language's words.

In: nodes. Out: text, or None where it would be too long to help.
"""

from rcsc.lang.model import Bool, Enum, Op, Scalar, Value, spell
from rcsc.proof.symbolic.values import CHOICE, CONSTANT, NARROWED, VARIABLE, Node

MOST_CHARACTERS = 100


class _TooLongError(Exception):
    """The text would be too long."""


def in_words(node: Node, kind: Scalar | None = None) -> str | None:
    """Return the value in words; `kind` is the type that it is kept as, where that has more names than the node's."""
    try:
        text = _worded(node, kind or node.kind, 0)
    except _TooLongError:
        return None
    bare = text[1:-1] if text.startswith("(") and _closes_at_the_end(text) else text
    return bare if len(bare) <= MOST_CHARACTERS else None


def _closes_at_the_end(text: str) -> bool:
    depth = 0
    for at, char in enumerate(text):
        depth += (char == "(") - (char == ")")
        if depth == 0:
            return at == len(text) - 1
    return False


def _worded(node: Node, kind: Scalar, depth: int) -> str:
    if depth > 12:
        raise _TooLongError
    if node.op == CONSTANT:
        return number(kind, node.low)
    if node.op == VARIABLE:
        return node.name
    if node.op == NARROWED:
        return _worded(node.args[0], kind, depth)
    if node.op == CHOICE:
        test, then, orelse = node.args
        text = f"(if {_worded(test, Bool(), depth + 1)} then {_worded(then, kind, depth + 1)} else {_worded(orelse, kind, depth + 1)})"
    else:
        text = _operation(node, depth)
    if len(text) > 2 * MOST_CHARACTERS:
        raise _TooLongError
    return text


def _operation(node: Node, depth: int) -> str:
    if node.op == Op.NOT:
        return _negated(node.args[0], depth)
    kinds = [arg.kind for arg in node.args]
    inner = _fuller(kinds)
    parts = [_worded(arg, inner, depth + 1) for arg in node.args]
    if Op(node.op).infix:
        return f"({parts[0]} {node.op} {parts[1]})"
    return f"-{parts[0]}" if node.op == Op.NEG else f"{node.op}({', '.join(parts)})"


def _negated(node: Node, depth: int) -> str:
    """Spell a negation, moved inward, since `or` and `/=` are kept as negations."""
    turned = {Op.EQ: Op.NE, Op.LT: Op.GE, Op.LE: Op.GT}
    if node.op == Op.AND:
        sides = [
            _worded(part.args[0], Bool(), depth + 1) if part.op == Op.NOT else _negated(part, depth + 1)
            for part in node.args
        ]
        return f"({sides[0]} or {sides[1]})"
    certain = node.op == Op.EQ or all(arg.ordered for arg in node.args)  # of a NaN both are false
    if node.op in turned and certain:
        inner = _fuller([arg.kind for arg in node.args])
        left, right = (_worded(arg, inner, depth + 1) for arg in node.args)
        return f"({left} {turned[Op(node.op)]} {right})"
    return f"not {_worded(node, Bool(), depth + 1)}"


def _fuller(kinds: list[Scalar]) -> Scalar:
    """Return the enumeration with the most members: one side may know those in common only."""
    enums = [kind for kind in kinds if isinstance(kind, Enum)]
    return max(enums, key=lambda enum: len(enum.members)) if enums else kinds[0]


def number(kind: Scalar, value: Value) -> str:
    """Return a value of the kind; a number where the kind has no such value."""
    if isinstance(kind, Enum) and not 0 <= int(value) < len(kind.members):
        return str(int(value))
    return spell(kind, value)

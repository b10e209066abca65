"""Expressions in the words of the source, for vectors and findings.

In: an expression. Out: text, with parentheses around every operand that is not simple.
"""

from rcsc.lang.model import Among, Apply, Expr, Literal, Op, Read, ReadLocal, Select, spell
from rcsc.lang.operator_table import POSTFIX


def words(expr: Expr) -> str:
    """`expr` in the words of the source."""
    match expr:
        case Literal(value=value, type=kind):
            return spell(kind, value)
        case Read(name=name):
            return str(name)
        case ReadLocal(name=name):
            return name
        case Select(leaves=leaves, index=index):
            return f"{leaves[0].rsplit('[', 1)[0]}[{words(index)}]"
        case Among(subject=subject, values=values):
            return f"{_inner(subject)} in {{{', '.join(spell(subject.type, value) for value in values)}}}"
        case Apply(op=op, args=args) if op.strength == POSTFIX:
            return f"{op.value}({', '.join(words(arg) for arg in args)})"
        case Apply(op=op, args=(operand,)):
            return f"{'-' if op is Op.NEG else 'not '}{_inner(operand)}"
        case Apply(op=op, args=args):
            return f" {op.value} ".join(_inner(arg) for arg in args)


def _inner(expr: Expr) -> str:
    text = words(expr)
    return f"({text})" if isinstance(expr, Apply | Among) and " " in text else text

"""Functions of one operator or conversion, which expressions call."""

from rcsc.emit.c.ctext import (
    FLOATS,
    SHORT,
)
from rcsc.emit.code_tree import (
    Cast,
    Choice,
    Constant,
    Function,
    Leave,
    Let,
    Name,
    Prefix,
    infix,
)


def helper(program: str, name: str) -> Function:
    """A function of one operator or conversion, by its name in `Invoke.helper`; what it means is `interpret.OPERATORS`'s."""
    a, b = Name("a"), Name("b")
    if "_of_" in name:
        target, source = (SHORT[short] for short in name.split("_of_"))
        head = f"{target} {program}_{name}({source} a)"
        return Function("A value that was proved to fit.", head, (Leave(Cast(target, a)),))
    op, short = name.split("_")
    kind = SHORT[short]
    if op == "number":
        zero, positive = Constant(0, kind), Name("positive")
        body = (
            Let("const bool", positive.text, infix(">", a, zero)),
            Leave(infix("||", positive, infix("<=", a, zero))),
        )
        doc = "Whether it is a number: what is none satisfies no comparison."
        return Function(doc, f"bool {program}_{name}({kind} a)", body)
    if op == "abs":
        zero, absolute = Constant(0, kind), None
        if kind in FLOATS:
            absolute = Choice(infix("<=", a, zero), infix("-", zero, a), a)  # of -0.0 too
        elif not kind.startswith("u"):
            absolute = Choice(infix("<", a, zero), Prefix("-", a), a)
        return Function("The absolute value.", f"{kind} {program}_{name}({kind} a)", (Leave(absolute or a),))
    sign, word = ("<", "lesser") if op == "min" else (">", "greater")
    return Function(
        f"The {word} of two; the first where it is no number.",
        f"{kind} {program}_{name}({kind} a, {kind} b)",
        (Leave(Choice(infix(sign, b, a), b, a)),),
    )

"""Functions of one operator or conversion, which expressions call."""

from collections.abc import Mapping

from rcsc.code.emit.c.ctext import FLOATS, SHORT
from rcsc.code.emit.code_tree import Cast, Choice, Constant, Function, Leave, Let, Name, Prefix, infix

HELD: Mapping[str, str] = {
    "atleast": "A value that was proved to be no less than this: it is as it was.",
    "atmost": "A value that was proved to be no more than this: it is as it was.",
    "within": "A value that was proved to lie between these two: it is as it was.",
    "quotient": "The quotient by a number that was proved not to be 0.",
    "remainder": "The remainder of a division by a number that was proved not to be 0.",
}
"""What is said of functions without which an analyser of ranges could not follow a proof; they change no value that was proved."""


def _held(program: str, op: str, short: str) -> Function:
    """Return the function that keeps a number where it was proved to lie; the outcome that would change it is never taken."""
    kind = SHORT[short]
    a, b, least, most = map(Name, ("a", "b", "least", "most"))
    positive, negative = (infix(sign, b, Constant(0, kind)) for sign in (">", "<"))
    below = Choice(negative, b, Constant(-1, kind))
    from_below, from_above = (infix(sign, a, end) for sign, end in ((">=", least), ("<=", most)))
    values = {
        "atleast": ((least,), Choice(from_below, a, least)),
        "atmost": ((most,), Choice(from_above, a, most)),
        "within": ((least, most), Choice(from_below, Choice(from_above, a, most), least)),
        "quotient": ((b,), Choice(positive, infix("/", a, b), infix("/", a, below))),
        "remainder": ((b,), Choice(positive, infix("%", a, b), infix("%", a, below))),
    }
    ends, value = values[op]
    params = ", ".join(f"{kind} {name.text}" for name in (a, *ends))
    return Function(HELD[op], f"{kind} {program}_{op}_{short}({params})", (Leave(value),))


def helper(program: str, name: str) -> Function:
    """Return the function of one operator or conversion, by its name in `Invoke.helper`; `lang/operator_table.py` defines its meaning."""
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
    if op in HELD:
        return _held(program, op, short)
    sign, word = {"min": ("<", "lesser"), "max": (">", "greater")}[op]
    return Function(
        f"The {word} of two; the first where it is no number.",
        f"{kind} {program}_{name}({kind} a, {kind} b)",
        (Leave(Choice(infix(sign, b, a), b, a)),),
    )

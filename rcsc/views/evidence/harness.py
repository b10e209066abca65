"""C that calls every function of an emitted header, for tools that run the C or analyse it.

In: a program and the names in its C. Out: text: functions of the user's that give anything of their type, and a call of
each function, with what it asks of its caller: a state that `check` accepts, and of a matcher admitted inputs.
"""

from collections.abc import Callable, Iterator

from rcsc.code.emit.code_tree import type_bounds
from rcsc.code.testing.executors.externs import externs, stand_in_head
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.model import Bool, Program, Real, Scalar, key_bounds

Value = Callable[[str, Scalar, bool], str]
"""An expression of a value of a C type and a kind: any within the kind's range, or any of the C type where asked."""


def calls(symbols: Symbols, *, defensive: bool) -> Iterator[str]:
    """Yield a call of every function; `any` makes a state, `admitted` one with inputs within their ranges."""
    check = f"{symbols.program}_check(&s)"
    yield f"any(); {symbols.init}(&s);"
    yield f"any(); (void){check};"
    for function in (*symbols.steps.values(), *symbols.cycles.values()):
        call = f"(void){function}(&s);"
        yield f"any(); {call}" if defensive else f"any(); if ({check} < 0) {{ {call} }}"
    for name, function in symbols.lines.items():
        many = f"int32_t at[1]; {symbols.batches[name]}(&s, at, 1u);"
        yield f"admitted(); if ({check} < 0) {{ (void){function}(&s); {many} }}"


def stand_ins(program: Program, symbols: Symbols, value: Value) -> Iterator[str]:
    """Yield C functions in place of the user's, which give any value of their types."""
    for procedure in externs(program):
        head, given = stand_in_head(symbols, procedure)
        unread = " ".join(f"(void)a{at};" for at, _ in enumerate(given))
        written = " ".join(
            f"*r{at} = {value(symbols.c_type(name), program.variable(name).type, True)};"
            for at, name in enumerate(procedure.writes)
        )
        yield f"{head} {{ {unread} {written} }}"


def bounds(c_type: str, kind: Scalar, *, whole: bool) -> tuple[int, int]:
    """Return the bounds of a kind that is no real, or of its C type."""
    if isinstance(kind, Bool):
        return 0, 1
    if not whole and not isinstance(kind, Real):
        return key_bounds(kind)
    return type_bounds(c_type)

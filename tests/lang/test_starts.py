"""With what a variable starts: what is written, its safe value, 0, or what is nearest to 0, which is told."""

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Severity
from rcsc.lang.interpret import initial
from rcsc.lang.model import Program
from rcsc.lang.resolve import compile_text
from tests.support.programs.stages import reported

TEXT = """
enum light { red, green }
type offset = real -2.0 .. 5.0
record pair { a : int -9 .. 9  b : int 3 .. 9 = 4  c : array[2] of int -9 .. 9 = -1  d : offset }
input seen : int -5 .. 5
input of_pair : pair
output speed : int -400 .. 400 safe 7
output own : int -400 .. 400 = 2 safe 7
output shown : light safe green
output lamp : bool safe true
state n : int -9 .. 9 restart 3
state x : offset
state s : single -2.5 .. 1.5
state cells : array[2] of int 2 .. 9 = 5
state pairs : array[1] of pair
state later : int -9 .. 9 deferred until true
property moves : n >= was n
"""
STARTS = {
    "seen": 0,
    "of_pair.a": 0,
    "of_pair.b": 4,
    "of_pair.c[0]": -1,
    "of_pair.c[1]": -1,
    "of_pair.d": 0.0,
    "speed": 7,
    "own": 2,
    "shown": 1,
    "lamp": True,
    "n": 0,
    "x": 0.0,
    "s": 0.0,
    "cells[0]": 5,
    "cells[1]": 5,
    "pairs[0].a": 0,
    "pairs[0].b": 4,
    "pairs[0].c[0]": -1,
    "pairs[0].c[1]": -1,
    "pairs[0].d": 0.0,
    "later": 0,
    "later.next": 0,
}


def test_what_starts_with_what() -> None:
    program = compile_text(TEXT)
    assert isinstance(program, Program), program
    assert {str(name): value for name, value in initial(program).items()} == STARTS
    unset = {str(v.name).partition(".")[0].partition("[")[0] for v in program.variables if not v.given}
    assert unset == {"seen", "of_pair", "n", "x", "s", "pairs", "later"}
    meant = {str(v.name) for v in program.variables if v.given}
    assert "pairs[0].b" in meant
    assert "of_pair.b" in meant


@pytest.mark.parametrize(
    ("text", "message", "help_"),
    [
        (
            "state n : int 1 .. 9",
            "`n` starts: 0 is not in 1 .. 9, so that it is 1",
            "its type, such as `= 1`",
        ),
        ("input n : int -9 .. -2 [mm] clamp", "0 is not in -9 .. -2, so that it is -2", "such as `= -2`"),
        ("output x : single 0.5 .. 1.5", "0 is not in 0.5 .. 1.5, so that it is 0.5", "such as `= 0.5`"),
        ("state a : array[300] of int 1 .. 2", "`a[0]` starts: 0 is not in 1 .. 2", "after its type, such"),
        (
            "record r { f : array[2] of real -2.0 .. -1.0 } state a : array[2] of r",
            "`a[0].f[0]` starts: 0 is not in -2.0 .. -1.0",
            "after the type of field `f`, such as `= -1.0`",
        ),
    ],
)
def test_where_nothing_says_it_a_warning_does(text: str, message: str, help_: str) -> None:
    found = [each for each in reported(text) if each.code is Code.NO_START]
    assert [each.severity for each in found] == [Severity.WARNING]
    assert message in found[0].message
    assert help_ in found[0].help[0]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("record r { f : int 1 .. 3 = 4 }", Code.OUT_OF_RANGE_CONSTANT),
        ("record r { f : int 1 .. 3 = true }", Code.KIND),
        ("record q { f : bool } record r { f : q = true }", Code.KIND),
        ("record q { f : bool } state r : q = true", Code.KIND),
        ("state n : int 0 .. 9 record r { f : int 1 .. 3 = n }", Code.NOT_CONSTANT),
    ],
)
def test_a_start_is_a_value_of_the_type(text: str, code: Code) -> None:
    found = compile_text(text)
    assert isinstance(found, tuple)
    assert [each.code for each in found] == [code]

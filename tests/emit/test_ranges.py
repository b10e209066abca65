"""What ranges show: never less than the values that there are, and of lines only what holds when a procedure begins."""

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.code.emit.ranges import Ranges, at_procedures
from rcsc.lang.interpret import evaluate
from rcsc.lang.model import Assign, If, Local
from tests.support.programs.stages import drawn_program, emitted, program_of
from tests.support.strategies import conditions

GRID = range(-3, 5)
DECLARED = "state a : int -3 .. 4\nstate b : int -3 .. 4\nstate n : int -100 .. 100\n"
GUARDS = conditions(
    ("a", "b", "(a - b)"), st.sampled_from(("a", "b", "0", "2", "-3", "4", "(a * b)")), sets=False
)
NUMBERS = st.sampled_from(("a", "b", "a - b", "a * b", "abs(a) + b", "a mod 3", "min(a, b)"))


@given(GUARDS, NUMBERS)
def test_no_value_is_outside(guard: str, number: str) -> None:
    program = drawn_program(f"{DECLARED}procedure p {{ if {guard} {{ n := {number} }} else {{ n := b }} }}")
    for statement in program.procedures[0].body:
        assert isinstance(statement, If)
        [assigned] = statement.then
        assert isinstance(assigned, Assign)
        for a, b in product(GRID, GRID):
            holds = bool(evaluate(statement.condition, {"a": a, "b": b}))
            ranges = Ranges().where(statement.condition, holds=holds)
            low, high = ranges.of(assigned.value)
            assert low <= evaluate(assigned.value, {"a": a, "b": b}) <= high
            least, most = ranges.after(assigned).known["n"]
            assert (low, high) == (least, most)


@pytest.mark.parametrize(
    ("guard", "seen"),
    [
        ("a > 0", (1, 4)),
        ("0 < a", (1, 4)),
        ("not (a <= 0 or b = 2)", (1, 4)),
        ("a /= -3 and a < b", (-2, 3)),
        ("a = b and b >= 2", (-3, 4)),
        ("b >= 2 and a = b", (2, 4)),
        ("a > 4", (-3, 4)),  # never: what is known of it is left alone
    ],
)
def test_a_guard_tells_what_an_analyser_of_ranges_learns(guard: str, seen: tuple[int, int]) -> None:
    [statement] = program_of(f"{DECLARED}procedure p {{ if {guard} {{ n := a }} }}").procedures[0].body
    assert isinstance(statement, If)
    [assigned] = statement.then
    assert isinstance(assigned, Assign)
    assert Ranges().where(statement.condition).of(assigned.value) == seen


LINES = """
input a : int 0 .. 9
input b : int 0 .. 9
state n : int 0 .. 9
state m : int 0 .. 9
procedure reads { n := a }
procedure sets { n := 1 }
procedure late { m := n }
procedure counts { m := m - 1 }
procedure outer { inner }
procedure inner { n := b }
procedure before { n := b }
table t {
  | line | a      | b   | n   | m   || procedures                       |
  | 1    | 2 .. 3 | > 5 | > 4 | > 2 || counts; reads; sets; late; outer |
  | 2    | 6 .. 7 |     | > 4 |     || sets; reads; inner               |
  | 3    | DEFAULT |    |     |     ||                                  |
}
level l {
  period 10 [ms]
  preprocess before
  table t
}
"""


def test_lines_tell_what_holds_when_a_procedure_begins() -> None:
    found = at_procedures(program_of(LINES))
    assert found["counts"].known == {"a": (2, 3), "b": (6, 9), "n": (5, 9), "m": (3, 9)}
    assert found["reads"].known == found["sets"].known == {"a": (2, 7)}
    assert (
        found["late"].known == found["outer"].known == {"a": (2, 3), "b": (6, 9)}
    )  # others have written before
    assert found["inner"].known == {}  # one that others call
    assert found["before"].known == {}


def test_what_is_written_is_forgotten() -> None:
    text = "local here : int -3 .. 4 := a\n  for k in 0 .. 3 { here := 0\n b := 1 }\n  sets"
    program = program_of(f"{DECLARED}procedure sets {{ n := 1 }}\nprocedure p {{ {text} }}")
    first, loop, call = program.procedures[1].body
    known = Ranges({"a": (0, 1), "b": (0, 1), "n": (0, 1), "local here": (0, 1)})
    assert isinstance(first, Local)
    assert known.after(first).known == {"a": (0, 1), "b": (0, 1), "n": (0, 1), "local here": (0, 1)}
    assert known.after(loop).known == {"a": (0, 1), "n": (0, 1)}
    assert known.after(call).known == {"local here": (0, 1)}
    assert known.joined(Ranges({"a": (-1, 0)})).known == {"a": (-1, 1)}
    assert known.met(Ranges({"a": (1, 3), "c": (2, 2)})).known["a"] == (1, 1)


HELD, FREE = "share := 1.0 / ratio", "ratio := y - 0.75"


@pytest.mark.parametrize(
    ("body", "held"),
    [
        (HELD, True),
        (f"if y > 2.0 {{ {FREE} }} else {{ {HELD} }}", True),
        (f"case n {{ 0 {{ {FREE} }} else {{ {HELD} }} }}", True),
        (f"for k in 0 .. 1 {{ {HELD} }}\n {FREE}", True),
        (f"{FREE}\n {HELD}", False),
        (f"if y > 2.0 {{ {FREE} }}\n {HELD}", False),
        (f"case n {{ 0 {{ {FREE} }} else {{ n := 1 }} }}\n {HELD}", False),
        (f"for k in 0 .. 1 {{ {HELD}\n {FREE} }}", False),
        (f"free\n {HELD}", False),
    ],
)
def test_the_c_says_what_a_line_states_until_it_is_written(body: str, held: bool) -> None:
    text = f"""
input y : real 0.0 .. 10.0
state n : int 0 .. 9
state ratio : real 0.0 .. 20.0
state share : real 0.0 .. 20.0
procedure free {{ {FREE} }}
procedure p {{ {body} }}
table t {{
  | line | y     | ratio || procedures |
  | 1    | > 1.0 | > 0.5 || p          |
  | 2    | DEFAULT |     ||            |
}}
"""
    assert ("_atleast_f64(s->ratio, 0.5)" in "".join(emitted(program_of(text)).values())) is held

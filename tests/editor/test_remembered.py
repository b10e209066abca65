"""What was answered of a question is the answer to the same question alone, wherever and in whatever text it is asked again."""

from pathlib import Path

import pytest

from rcsc.desk.editor import Workspace
from rcsc.lang.model import Bool, Int, Op, Real
from rcsc.proof.solvers import smt
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.remembered import Answers, answered, remembering
from rcsc.proof.symbolic.values import Node

REPO = Path(__file__).parents[2]
FAILS = """input {first} : int 0 .. 9
input {second} : int 0 .. 9
output sum : int 0 .. {most}
table t {{
  | line | a     || sum   |
  |------|-------||-------|
  | low  | <= 4  || {low} |
  | high | >= 5  || a + b |
}}
"""


def written(first: str = "a", second: str = "b", most: int = 12, low: str = "a + b") -> str:
    return FAILS.format(first=first, second=second, most=most, low=low)


@pytest.mark.parametrize(
    "name", ["gallery/linuxcnc_estop/code.rcs", "examples/approach.rcs", "emove/locate.rcs"]
)
def test_a_changed_line_has_only_its_own_questions_asked(name: str) -> None:
    file = str(REPO / "tables" / name)
    text = Path(file).read_text()
    workspace = Workspace()
    workspace.open(file, text)
    workspace.check(file)
    first = workspace.memo.answers.made
    assert first
    workspace.open(file, text.replace("\ntable ", "\n# above\ntable ", 1))
    workspace.check(file)
    assert workspace.memo.answers.made == first
    workspace.open(file, text.replace("\ninput ", "\ninput nobody_reads : bool\ninput ", 1))
    workspace.check(file)
    assert (
        workspace.memo.answers.made == first
    )  # the rest of the program is another, and the verdicts are made anew


def test_what_is_left_open_is_asked_again() -> None:
    asked: list[int] = []

    def ask() -> int:
        asked.append(len(asked))
        if len(asked) == 1:
            smt.leave_open("the first time")
        return len(asked)

    with remembering(Answers()):
        assert [answered(("x",), [values.TRUE], ask) for _ in range(4)] == [1, 2, 2, 2]
    assert answered(("x",), [values.TRUE], ask) == 3  # nothing is remembered where nobody remembers


def _sum(*terms: Node) -> Node:
    return Node(Op.ADD, terms, Int(0, 9), 0, 9)


def _pairs() -> dict[str, tuple[list[Node], list[Node]]]:
    """Questions that differ in one thing."""
    a, b = (values.variable(name, Int(0, 9)) for name in "ab")
    wide, yes = values.variable("a", Int(0, 10)), values.variable("a", Bool())
    real = Real(-1.0, 1.0)
    return {
        "the sign of a zero": ([values.constant(real, 0.0)], [values.constant(real, -0.0)]),
        "a type": ([values.variable("a", Int(0, 1))], [yes]),
        "a range": ([a], [wide]),
        "what is known of a value": ([a], [values.narrowed(a, 0, 5)]),
        "a name": ([a], [b]),
        "an order": ([a, b], [b, a]),
        "the parts": ([_sum(a, b)], [_sum(a, a)]),
        "how many": ([a], [a, a]),
    }


@pytest.mark.parametrize("what", _pairs())
def test_questions_that_differ_are_told_apart(what: str) -> None:
    one, other = _pairs()[what]
    with remembering(Answers()):
        for nodes, wanted in ((one, "one"), (other, "other"), (one, "one"), (other, "other")):
            assert answered(("x",), nodes, lambda wanted=wanted: wanted) == wanted  # type: ignore[misc]  # bound early
        assert answered(("y",), one, lambda: "another question") == "another question"


def test_a_workspace_that_remembers_says_what_a_fresh_one_says() -> None:
    """The least input depends on the order of the inputs; that a line fails is told of each line, with its own place."""
    texts = [
        written(),
        written("b", "a"),
        written(),
        written(low="1"),
        written(low="a + b"),
        written(low="b + a"),
        written(most=18),
        written(most=13),
        "# above\n" + written(),
    ]
    workspace = Workspace()
    for text in texts:
        for each in (workspace, fresh := Workspace()):
            each.open("/nowhere/sum.rcs", text)
        assert workspace.check("/nowhere/sum.rcs") == fresh.check("/nowhere/sum.rcs"), text
    assert [each.code for each in fresh.check("/nowhere/sum.rcs").findings] == ["RCS413", "RCS413"]

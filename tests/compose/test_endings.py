"""That commands end: what is shown to stop does, what may go on for ever is named, and by which numbers a line stops."""

import re
import shutil
from dataclasses import replace
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest

from rcsc.compose.contract.obligations import command_stays
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.counterexample.lasso import Lasso, lassos
from rcsc.compose.counterexample.trace import NotReproducedError, TraceSearch
from rcsc.compose.proof import ranking
from rcsc.compose.proof.context import gives_an_order
from rcsc.compose.proof.level import certificate, prove_level
from rcsc.compose.proof.ranking import RisingLine, fewest, inputs, least_power, parts
from rcsc.compose.proof.system import transition_systems
from rcsc.compose.proof.termination import Ending, longest
from rcsc.front.commands import run
from rcsc.lang.model import Bool, Int, Op, Real
from rcsc.lang.operator_table import Arithmetic
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.solvers.smtlib import cvc5_refutes
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.measured import Measured
from rcsc.proof.symbolic.values import Node
from tests.small_hierarchies.endless import Edge, edges, endless
from tests.small_hierarchies.explored import explored
from tests.small_hierarchies.level import Role, State
from tests.support.programs.systems import (
    LITTLE,
    ORDER_AFTER_ORDER,
    SYSTEM,
    TICK,
    TURNS,
    WAY,
    counting,
    going,
    lower_level,
    proved_level,
    small_level,
    small_system,
    small_text,
)
from tests.support.programs.texts import edit_file, edited

PROTOCOL = Path(__file__).parents[1] / "data" / "protocol"


def ending(folder: Path, lower: str) -> Ending:
    """Prove this lower level; return how commands under `go` end."""
    _, proof = proved_level(folder, "lower", lower=lower)
    assert proof.open == ()
    return next(ending for ending in proof.endings if ending.table == "go")


def test_lines_that_take_turns_for_ever_are_named(tmp_path: Path) -> None:
    """Neither runs twice in a row."""
    assert ending(tmp_path, lower_level(*TURNS, **TICK)).endless == ("2", "3")


def test_a_counter_that_another_line_sets_back_is_none(tmp_path: Path) -> None:
    lower = lower_level(
        going("2", on="true", does="work"),
        going("3", on="false", does="begin"),
        declared="state tick : bool\nstate c : int 0 .. 9",
        seen=TICK["seen"],
        begin="c := 0",
        work="c := min(c + 1, 9)",
    )
    found = ending(tmp_path, lower)
    assert (found.endless, found.proved) == (("2", "3"), False)


def test_a_line_that_counts_is_shown_to_stop(tmp_path: Path) -> None:
    found = ending(tmp_path, counting(9))
    assert (found.proved, found.counted, found.still) == (True, (RisingLine("2", "c"),), ())


def test_a_counter_that_rises_only_now_and_then_is_none(tmp_path: Path) -> None:
    now_and_then = edited(counting(9), ("  c := min(c + 1, 9)", "  if there { c := min(c + 1, 9) }"))
    assert ending(tmp_path, now_and_then).endless == ("2",)


@pytest.mark.parametrize(
    ("work", "counters"),
    [
        ("c := max(c - 1, 0)", {("c", True)}),
        ("if c > 4 { c := c - 3 } else { c := 0 }", {("c", True)}),
        ("if d > 0 { d := d - 1 } else { c := max(c - 1, 0); d := 3 }", {("c", True), ("d", True)}),
        ("if there { d := max(d - 1, 0); c := max(c - 1, 0) } else { d := min(d + 1, 99); c := max(c - 2, 0) }", {("c", True)}),
        ("if there and c >= 2 { d := min(d + 1, 99); c := c - 2 } else { if d >= 2 and c < 99 { d := d - 2; c := c + 1 } else { c := 0 } }",
         {("c + d", True)}),
    ],
    ids=["by one", "in steps", "either of two", "one of two", "a sum"],
)  # fmt: skip
def test_what_falls_ends(work: str, counters: set[tuple[str, bool]], tmp_path: Path) -> None:
    """A counter that goes down, one that does while another stays, and a sum of which each part goes both ways."""
    found = ending(tmp_path, falling(work))
    assert found.proved
    assert {(one.counter, one.falls) for one in found.counted if one.line == "2"} == counters


def test_what_a_line_that_stops_sets_back_stops_other_lines(tmp_path: Path) -> None:
    """Line 2 sets `d` back, and runs as often as `c` can fall: only without it does `d` fall for good."""
    lower = lower_level(
        going("2", on="true", does="work"),
        going("3", on="false", does="sink"),
        declared="state c : int 0 .. 9\nstate d : int 0 .. 9",
        seen="on := d = 0",
        begin="c := 9; d := 9",
        work="if c > 0 { c := c - 1; d := 9 } else { cur_state := d_state }",
        parts="procedure sink { d := max(d - 1, 0) }",
    )
    found = ending(tmp_path, lower)
    assert (found.endless, found.proved) == ((), True)
    assert found.counted == (RisingLine("2", "c", falls=True), RisingLine("3", "d", falls=True))


def falling(work: str) -> str:
    """Return a lower level that works until `c` is 0."""
    declared = "state c : int 0 .. 99\nstate d : int 0 .. 99"
    return lower_level(*WAY, declared=declared, seen="on := c = 0", begin="c := 9; d := 9", work=work)


@pytest.mark.parametrize(
    "work",
    [
        "if there { c := max(c - 1, 0) } else { c := min(c + 1, 99) }",
        "if there { c := max(c - 1, 0) }",
        "if d > 0 { d := d - 1 } else { if there { c := max(c - 1, 0) } d := 3 }",
        "if there and c >= 2 and d < 9 { d := d + 1; c := c - 1 } else { if d >= 1 and c < 99 { d := d - 1; c := c + 1 } else { c := 0 } }",
    ],
    ids=["both ways", "now and then", "the outer one now and then", "sum that stays"],
)
def test_what_need_not_fall_is_not_shown_to_end(work: str, tmp_path: Path) -> None:
    assert ending(tmp_path, falling(work)).endless == ("2",)


def test_a_way_that_is_halved_ends(tmp_path: Path) -> None:
    """By a share of what is left, down to more than 0; down to 0 it is not shown."""
    halved = lower_level(
        *WAY,
        declared="state x : real 0.0 .. 100.0",
        seen="on := x <= 0.1",
        begin="x := 90.0",
        work="x := x * 0.5",
    )
    found = ending(tmp_path / "end", halved)
    assert (found.proved, [(one.counter, one.falls) for one in found.counted]) == (True, [("x", True)])
    assert ending(tmp_path / "none", edited(halved, ("x <= 0.1", "x <= 0.0"))).endless == ("2",)


def test_default_may_go_on_for_ever_like_any_line(tmp_path: Path) -> None:
    ends = going("3", there="true", does="state(d_state)", status="done")
    assert ending(tmp_path, lower_level(ends, "5 | DEFAULT | | | || | executing")).endless == ("5",)


def way(
    work: str,
    seen: str = "on := x >= 100.0",
    inputs: str = "",
    within: tuple[str, str] = ("0.0", "100.0"),
) -> str:
    """Return a lower level that goes a way `x` from its least value, until it is seen to be long enough."""
    declared = f"{inputs}state x : real {' .. '.join(within)}"
    return lower_level(*WAY, declared=declared, seen=seen, begin=f"x := {within[0]}", work=work)


@pytest.mark.parametrize("seen", ["on := x >= 100.0", "on := 100.0 - x <= 0.0", "on := x * 0.1 >= 9.99"])
def test_a_way_that_grows_shorter_ends(seen: str, tmp_path: Path) -> None:
    found = ending(tmp_path, way("x := min(100.0, x + 0.3)", seen))
    assert (found.proved, [one.counter for one in found.counted]) == (True, ["x"])
    least = found.counted[0].least
    assert least is not None
    assert 0.15 <= least <= 0.3  # the greatest power of two of the range


def test_a_way_in_a_range_wider_than_any_double_ends(tmp_path: Path) -> None:
    """`1e308 - -1e308` is infinity: of that `rcsc prove` took a part, and ended with a bug."""
    wide = way("x := min(1e308, x + 1e305)", "on := x >= 1e308", within=("-1e308", "1e308"))
    found = ending(tmp_path, wide)
    assert found.proved
    least = found.counted[0].least
    assert least is not None
    assert 0.5e305 <= least <= 1e305


def test_a_way_on_which_a_step_may_be_lost_is_not_shown_to_end(tmp_path: Path) -> None:
    """Rounded, 1 and 1e-20 are 1; and with no speed there is no step."""
    for at, work in enumerate(("x := min(100.0, x + 0.00000000000000000001)", "x := min(100.0, x + 0.0)")):
        assert ending(tmp_path / str(at), way(work)).endless == ("2",)
    speed = "input speed : real 0.0 .. 9.0\n"
    assert ending(tmp_path / "speed", way("x := min(100.0, x + speed)", inputs=speed)).endless == ("2",)
    faster = "x := min(100.0, x + max(0.5, speed) * 0.04)"
    assert ending(tmp_path / "faster", way(faster, inputs=speed)).proved


def ordering_again(more: str = "") -> str:
    """Return an upper level that gives its order again whenever an input changes, as often as that may be; it declares more, too."""
    return small_text(
        "upper",
        ("state new_command", f"input which : bool\n{more}state old_which : bool\nstate new_command"),
        ("module send reads to_lower, old_command writes to_lower, old_command {",
         "module send reads to_lower, old_command, which, old_which, new_command, begun writes to_lower, old_command, old_which {"),
        ("if to_lower.input_command /= old_command {",
         "if to_lower.input_command /= old_command or which /= old_which {"),
        ("  old_command := to_lower", "  old_which := which\n  old_command := to_lower"),
    )  # fmt: skip


def work_of(folder: Path, upper: str) -> Ending:
    """Prove this upper level; return how commands under `work` end."""
    _, found = proved_level(folder, "upper", upper=upper)
    assert found.open == ()
    return next(end for end in found.endings if end.table == "work")


def test_what_has_to_stand_still_is_said(tmp_path: Path) -> None:
    work = work_of(tmp_path, ordering_again())
    assert (work.proved, work.still) == (True, ("which",))


def test_nothing_that_a_level_writes_is_taken_to_stand_still(tmp_path: Path) -> None:
    """The lower level turns `which` in every cycle: the upper one orders for ever."""
    turning = (
        ("output report", "output which : bool\noutput report"),
        (
            "module answer reads command,",
            "module turn reads which writes which { which := not which }\nmodule answer reads command,",
        ),
    )
    lower = small_text("lower", *turning, ("postprocess answer", "postprocess answer, turn"))
    path = small_system(tmp_path, upper=ordering_again(), lower=lower)
    path.write_text(f'{path.read_text(encoding="utf-8")}"lower.which" = "upper.which"\n', encoding="utf-8")
    found = prove_level(transition_systems(path)["upper"], LITTLE)
    work = next(end for end in found.endings if end.table == "work")
    assert found.open == ()
    assert not work.proved
    assert (work.still, work.settled) == ((), ())


@pytest.mark.parametrize(
    ("was", "now", "stands"),
    [
        ("use words", "use words", True),
        ("||                     | 0     | done", "|| blocked             | 0     | done", False),
        ("stage(idle)         | 0     | done       |", "stage(moving)       | 0     | done       |", False),
    ],
)  # fmt: skip
def test_a_report_stands_once_it_has_answered_or_is_not_said_to(
    was: str, now: str, stands: bool, tmp_path: Path
) -> None:
    shutil.copytree(PROTOCOL, tmp_path, dirs_exist_ok=True)
    edit_file(tmp_path / "drive.rcs", (was, now))
    assert prove_level(transition_systems(tmp_path / "system.toml")["drive"], LITTLE).stands is stands


def test_as_few_inputs_stand_still_as_will_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some are tried without, knowing what a look at all of them left; what nobody reads again is not tried."""
    ts = small_level(tmp_path, "lower")
    asked = SimpleNamespace(rested_on=[])
    looked: list[SimpleNamespace] = []

    def look(
        program: object, of: object, clauses: object, still: tuple[str, ...], weaker: object = None
    ) -> object:
        assert (program, of, clauses) == (ts.program, asked, ())
        assert weaker is (looked[0] if looked else None)
        looked.append(SimpleNamespace(still=still, endless={"there"} - set(still), counted=[], solver=still))
        return looked[-1]

    outside = {"command", "there"}
    monkeypatch.setattr(ranking, "_Ranking", look)
    monkeypatch.setattr(ranking, "_read_again", lambda *_: {"command", "there", "gone"})
    found = ranking.lines_that_stop(ts.program, asked, (), lambda still, _: still, outside, set())  # type: ignore[arg-type,return-value]  # what stands for them
    assert inputs(ts.program) == ("command", "there")
    assert [one.still for one in looked] == [(), ("command", "there"), ("there",)]
    assert (found.still, found.endless) == (("there",), ())
    assert asked.rested_on == [(), ("there",)]


def test_reports_have_to_stand_of_those_that_answer_and_get_no_orders_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Asked once inputs that stand still are not enough; then as few of these are looked for, with the reports."""
    ts = small_level(tmp_path, "lower")
    asked = SimpleNamespace(rested_on=[])
    looked: list[tuple[tuple[str, ...], tuple[str, ...]]] = []
    ordered = dict.fromkeys(("waits", "orders", "unread", "silent"))

    def look(*_: object) -> object:
        still, settled = looked[-1]
        return SimpleNamespace(
            solver=looked[-1],
            counted=[],
            endless=set() if settled and "there" in still else {0},
            turn=SimpleNamespace(ordered=ordered),
            orders_for_ever=lambda report: report == "orders",
        )

    def turns(still: tuple[str, ...], settled: tuple[str, ...]) -> object:
        looked.append((still, settled))
        return None

    monkeypatch.setattr(ranking, "_Ranking", look)
    monkeypatch.setattr(ranking, "_read_again", lambda *_: {"command", "there", "waits", "orders", "silent"})
    outside, answering = {"command", "there"}, {"waits", "orders", "unread"}
    found = ranking.lines_that_stop(ts.program, asked, (), turns, outside, answering)  # type: ignore[arg-type]  # what stands for them
    assert (found.still, found.settled, found.endless) == (("there",), ("waits",), ())
    both, alone = ("command", "there"), ("there",)
    assert looked == [((), ()), (both, ()), (both, ("waits",)), (alone, ("waits",))]
    assert asked.rested_on == [looked[0], looked[1], looked[3]]


@pytest.mark.parametrize("seed", range(100))
def test_fewest_leaves_out_what_one_by_one_does_and_asks_less(seed: int) -> None:
    """Some groups of names are enough, and whatever contains one; with few needed names, it asks as often as their logarithm has it."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    names = tuple("abcdefghijklmnop"[: random.randint(1, 16)])
    groups = [set(random.sample(names, random.randint(1, min(3, len(names))))) for _ in range(3)]
    asked: list[tuple[str, ...]] = []

    def enough(some: tuple[str, ...]) -> bool:
        asked.append(some)
        return any(group <= set(some) for group in groups)

    one_by_one = names
    for name in names:
        fewer = tuple(other for other in one_by_one if other != name)
        one_by_one = fewer if any(group <= set(fewer) for group in groups) else one_by_one
    assert fewest(names, enough) == one_by_one
    assert all(some for some in asked)
    assert len(asked) <= 5 * len(one_by_one)
    passed = [some for some in asked if any(group <= set(some) for group in groups)]
    assert (passed or [names])[-1] == one_by_one


def test_what_no_question_reads_is_not_asked_to_stand_still(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A level takes eight other things that it does not look at: no more is tried for them."""
    tried, made = [0], ranking._Ranking.__init__

    def counting_them(*of: Any) -> None:
        tried[0] += 1
        made(*of)

    monkeypatch.setattr(ranking._Ranking, "__init__", counting_them)
    counts = []
    for at, more in enumerate(("", "".join(f"input other_{number} : bool\n" for number in range(8)))):
        tried[0] = 0
        counts.append((work_of(tmp_path / str(at), ordering_again(more)).still, tried[0]))
    assert counts[0] == counts[1]
    assert counts[0][0] == ("which",)


def test_the_steps_of_a_table_are_read_line_by_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a model says of each line before and after, not of each pair of lines."""
    counts = {"read": 0, "allowed": 0}
    value, steps = Solver.value, ranking._Ranking._steps

    def reads(solver: Solver, *of: object) -> object:
        counts["read"] += 1
        return value(solver, *of)  # type: ignore[arg-type]  # handed on as it comes

    def looked(of: Any, *of_what: Any) -> set[tuple[int, int]]:
        read, asked = counts["read"], of.solver.queries
        found = steps(of, *of_what)
        counts["allowed"] += 2 * len(of.now) * (of.solver.queries - asked)
        assert counts["read"] - read <= 2 * len(of.now) * (of.solver.queries - asked)
        return found

    monkeypatch.setattr(Solver, "value", reads)
    monkeypatch.setattr(ranking._Ranking, "_steps", looked)
    _, proof = proved_level(tmp_path, "lower", lower=lower_level(*TURNS, **TICK))
    assert proof.open == ()
    assert counts["allowed"] > 0


def moved(made: ranking._Ranking, *steps: tuple[int, int]) -> smt.Term:
    """That a cycle moves the two numbers by one of these."""
    return smt.any_of(
        [
            smt.all_of(
                [
                    smt.equal(
                        each.after,
                        smt.integer_operation("+", each.before, smt.literal(each.kind, by)),
                        each.kind,
                    )
                    for each, by in zip(made.numbers, step, strict=True)
                ]
            )
            for step in steps
        ]
    )


@pytest.fixture
def lines_of_two_numbers() -> ranking._Ranking:
    """One line that follows itself, in a cycle that moves `a` and `b` by 1 and -2, or by -2 and 1: only their sum goes one way."""
    made, kind = ranking._Ranking.__new__(ranking._Ranking), Int(-99, 99)
    made.solver = Solver()
    terms = {name: smt.variable(name, kind) for name in ("a", "b", "a'", "b'")}
    made.numbers = [ranking.KeptNumber(name, kind, terms[name], terms[f"{name}'"]) for name in ("a", "b")]
    made.solver.add(moved(made, (1, -2), (-2, 1)))
    made.moves, made.counted = [], []
    made.last = made.now = made.next = [smt.variable("runs", Bool())]
    made.always = {(0, 0)}
    made.turn = SimpleNamespace(at=SimpleNamespace(lines=[(SimpleNamespace(name="l"), None)]))  # type: ignore[assignment]
    return made


def test_a_sum_of_two_numbers_that_falls_stops_a_line(lines_of_two_numbers: ranking._Ranking) -> None:
    found = lines_of_two_numbers._sum(0, [], [])
    assert found is not None
    assert found[0] == RisingLine("l", "a + b", falls=True)


def test_a_sum_of_two_numbers_need_not_fall_in_cycles_that_are_not_looked_at(
    lines_of_two_numbers: ranking._Ranking,
) -> None:
    made = lines_of_two_numbers
    made.solver = Solver()
    steps = (1, -2), (-2, 1)
    made.solver.add(moved(made, *steps, (2, 2), (-3, -3)))
    assert made._sum(0, [moved(made, *steps)], []) is None
    found = made._sum(0, [moved(made, *steps)], [moved(made, *steps)])
    assert found is not None
    assert found[0] == RisingLine("l", "a + b", falls=True)


@pytest.mark.parametrize("falls", [True, False])
def test_a_way_is_as_long_as_its_steps_are_at_least(
    falls: bool, lines_of_two_numbers: ranking._Ranking
) -> None:
    """In parts of its whole width: half of it, half of that and so on, until each step is as long; here steps are of 1 or more."""
    made = lines_of_two_numbers
    low, high = (smt.as_number(smt.variable(name, Int(0, 100))) for name in ("low", "high"))
    number = ranking.KeptNumber("x", Real(0.0, 100.0), *((high, low) if falls else (low, high)))
    made.solver = Solver()
    made.solver.add(smt.below(low, high, Int(0, 100)))
    assert made._least_move([], number, falls=falls) == 100 / 2**7
    assert made._least_move([], number, falls=not falls) is None


@pytest.mark.parametrize("orders", [False, True])
def test_a_line_without_a_counter_that_orders_may_order_for_ever(
    orders: bool, lines_of_two_numbers: ranking._Ranking
) -> None:
    lines_of_two_numbers.numbers = []
    lines_of_two_numbers.ordered = {"report": smt.truth(orders)}
    assert lines_of_two_numbers.orders_for_ever("report") is orders


# --- another solver -----------------------------------------------------------------------------


@pytest.mark.parametrize("lower", [way("x := min(100.0, x + 0.3)"), counting(9)])
def test_another_solver_says_that_it_ends(lower: str, tmp_path: Path) -> None:
    ts, proof = proved_level(tmp_path, "lower", lower=lower)
    questions = certificate(ts, proof)
    assert {"lines 1", "ends pause 1", "ends go 1", "ends go 2"} <= questions.keys()
    assert [name for name, text in questions.items() if not cvc5_refutes(text)] == []
    # what is claimed beyond what is found again is not confirmed
    false = replace(proof, endings=tuple(replace(end, counted=()) for end in proof.endings))
    claimed = certificate(ts, false)
    assert [name for name, text in claimed.items() if not cvc5_refutes(text)] == [
        "lines and endings as before"
    ]


def test_a_refutation_that_is_wrong_is_not_confirmed() -> None:
    """What was asserted for good, and one of what was refuted besides: a script with a model if any of them was wrong."""
    kind = Int(0, 9)
    x = smt.variable("x", kind)
    solver = Solver(remembers=True)
    solver.add(smt.at_most(x, smt.literal(kind, 5), kind))
    for at in (7, 8):
        solver.push()
        solver.add(smt.equal(x, smt.literal(kind, at), kind))
        assert solver.check() is Answer.UNSATISFIABLE
        solver.pop()
    assert len(solver.refuted) == 2
    assert cvc5_refutes(solver.refutations())
    solver.refuted.append(smt.equal(x, smt.literal(kind, 5), kind))
    assert not cvc5_refutes(solver.refutations())


# --- runs that go round --------------------------------------------------------------------------


def lasso(ts: TransitionSystem, table: str) -> Lasso | NotReproducedError | None:
    """Find the shortest run of at most eight cycles in which a command of the table comes round."""
    return lassos(ts, (table,), TraceSearch(8, legal=True)).get(table)


def test_a_line_that_waits_goes_round(tmp_path: Path) -> None:
    """For what nobody brings: the shortest run is to take the command, and to wait; it is new no more, and to wait again."""
    waits = lower_level(going("2", there="false"), going("3", there="true"))
    found = lasso(small_level(tmp_path, "lower", lower=waits), "go")
    assert isinstance(found, Lasso)
    assert ([step.line for step in found.trace.steps], found.first) == (["1", "2", "2"], 3)


def test_lines_that_take_turns_go_round_together(tmp_path: Path) -> None:
    found = lasso(small_level(tmp_path, "lower", lower=lower_level(*TURNS, **TICK)), "go")
    assert isinstance(found, Lasso)
    lines_run = [step.line for step in found.trace.steps]
    assert (len(lines_run), found.first, set(lines_run[2:])) == (4, 3, {"2", "3"})


def test_what_ends_goes_nowhere_round(tmp_path: Path) -> None:
    assert lasso(small_level(tmp_path / "counts", "lower", lower=counting(3)), "go") is None
    # a real's way is open to the solver; the interpreter does not come round
    far = small_level(tmp_path / "real", "lower", lower=way("x := min(100.0, x + 30.0)"))
    real = lasso(far, "go")
    assert isinstance(real, NotReproducedError)
    assert real.guessed


def test_each_cycle_is_put_in_a_lap_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many laps end with it: each length looked at adds the conditions of one cycle, not of all before."""
    made = list[Cycle]()

    def stays(ts: TransitionSystem, cycle: Cycle) -> Node:
        made.append(cycle)
        return command_stays(ts, cycle)

    monkeypatch.setattr("rcsc.compose.counterexample.lasso.command_stays", stays)
    assert lasso(small_level(tmp_path, "lower", lower=counting(3)), "go") is None
    assert len(made) == 8


def test_order_after_order_goes_round(tmp_path: Path) -> None:
    """Its numbers go on, and everything else is as before."""
    found = lasso(small_level(tmp_path, "upper", upper=small_text("upper", *ORDER_AFTER_ORDER)), "work")
    assert isinstance(found, Lasso)
    steps = found.trace.steps[found.first - 1 :]
    numbers = [step.after["to_lower.inc_command"] for step in steps]
    assert len(set(numbers)) == 2
    assert {step.line for step in steps} == {"2", "3"}


def test_it_is_shown_drawn_and_frozen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By the command: a warning with a time line, a log, and a case that fails until the table is mended."""
    path = small_system(tmp_path / "round", upper=small_text("upper", *ORDER_AFTER_ORDER))
    (path.parent / "rcsc.toml").write_text('name = "round"\n', encoding="utf-8")
    found, cases = tmp_path / "found", path.parent / "cases"
    assert run(["prove", str(path), "--log", str(found), "--freeze", str(cases), "--no-cache"]) == 0
    said = capsys.readouterr().err
    assert "warning[RCS756]: level `upper`, table `work`: not shown: the command ends" in said
    assert "goes round from cycle" in said
    assert "so it may go on" in said
    page, log = tmp_path / "page.html", found / "upper_work_ends.mcap"
    assert run(["log", str(log), "--report", str(page)]) == 0
    assert "so it may go on for ever" in page.read_text(encoding="utf-8")
    (case,) = (file for file in cases.iterdir() if "upper_work_ends" in file.name)
    assert run(["prove", "--case", str(case)]) == 1
    assert "RCS753" in capsys.readouterr().err
    edit_file(path.with_name("upper.rcs"), *((new, old) for old, new in ORDER_AFTER_ORDER))
    assert run(["prove", "--case", str(case)]) == 0


# --- the parts ----------------------------------------------------------------------------------


def test_parts_are_lines_that_lead_to_each_other() -> None:
    assert parts({(0, 1), (1, 0), (1, 2), (3, 3), (4, 5)}) == [frozenset({0, 1}), frozenset({3})]
    assert parts(set()) == []


@pytest.mark.parametrize("least", [0, 1, 7, 24])
def test_the_least_power_is_found(least: int) -> None:
    assert least_power(lambda power: power >= least) == least


def test_no_power_is_none() -> None:
    assert least_power(lambda _: False) is None


def refuted(node: Node) -> bool:
    keyed, solver = Measured(), Solver()
    term = keyed.term(node)
    solver.add(*keyed.ranges, term)
    return solver.check() is Answer.UNSATISFIABLE


REAL = Real(-1e6, 1e6)


def arithmetic(op: Arithmetic, *args: Node) -> Node:
    return values.arithmetic(op, args, REAL)


def number(value: float) -> Node:
    return values.constant(REAL, value)


def test_sums_are_followed_as_far_as_they_are_rounded() -> None:
    x = values.variable("x", Real(0.0, 100.0))
    more = arithmetic(Op.ADD, x, number(0.5))
    assert refuted(values.compare(Op.LT, more, arithmetic(Op.ADD, x, number(0.25))))
    assert refuted(values.compare(Op.LE, more, x))
    tiny = arithmetic(Op.ADD, x, number(1e-20))
    assert not refuted(values.compare(Op.LE, tiny, x))  # it may be lost
    assert refuted(values.compare(Op.LT, arithmetic(Op.SUB, x, x), number(0.0)))  # the sign is not


def test_a_whole_number_made_a_real_is_as_large() -> None:
    n = values.variable("n", Int(0, 9))
    x = values.arithmetic(Op.TO_REAL, (n,), REAL)
    large = values.compare(Op.LE, values.constant(Int(0, 9), 3), n)
    assert refuted(values.both(large, values.compare(Op.LT, x, number(2.5))))
    assert not refuted(values.both(large, values.compare(Op.LT, x, number(3.5))))


def test_a_rounded_tenth_is_not_taken_for_a_tenth() -> None:
    """In doubles 0.1 + 0.2 is more than 0.3: what is true of fractions alone must not be shown."""
    x = values.variable("x", Real(0.0, 1.0))
    third = arithmetic(Op.ADD, arithmetic(Op.ADD, x, number(0.1)), number(0.2))
    assert not refuted(values.compare(Op.LT, arithmetic(Op.ADD, x, number(0.3)), third))


def test_what_is_not_reached_forbids_nothing() -> None:
    """Where `x` is known to be large the sum is; elsewhere it is not read, and `x` may be small."""
    x = values.variable("x", Real(0.0, 100.0))
    inside = arithmetic(Op.ADD, values.narrowed(x, 50.0, 100.0), number(1.0))
    far = values.compare(Op.LE, number(50.0), x)
    taken = values.choice(far, inside, number(0.0))
    assert not refuted(values.both(values.compare(Op.LT, x, number(1.0)), values.compare(Op.LE, taken, x)))


FLAGS = """table go {
  | line | new_command | first | second | third || procedures                     | status_out |
  | 1    | true        |       |        |       || clear                          | executing  |
  | 2    | false       | false |        |       || first := true                  | executing  |
  | 3    | false       | true  | false  |       || second := true                 | executing  |
  | 4    | false       | true  | true   | false || first := not there; third := true | executing  |
  | 5    | false       | true  | true   | true  ||                                | done       |
}

table pause {
  | line | first || procedures                               | status_out |
  | 1    | false || first := true; second := true; third := true | executing  |
  | 2    | true  ||                                          | done       |
}

level lower"""


def flagged(text: str) -> str:
    """The lower level with flags that its lines set, one after the other, and a first command that sets all in its first cycle."""
    before, _, after = text.partition("table go {")
    flags = "".join(f"state {name} : bool\n" for name in ("first", "second", "third"))
    before = before.replace("state cur_state", f"{flags}state cur_state")
    clear = "procedure clear {\n  first := false\n  second := false\n  third := false\n}\n\n"
    return f"{before}{clear}{FLAGS}{after.partition('level lower')[2]}"


def test_changes_of_state_are_counted_after_the_cycle_that_takes_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As often as an enumeration of all runs finds: but not in the cycle that takes it, as the first of a run does."""
    path = small_system(tmp_path, lower=flagged(small_text("lower")))
    ts = transition_systems(path)["lower"]
    role, seen = Role(ts.program, ts.level, ts.links), set[State]()
    explored(role, seen=seen)
    names = list(role.start)
    places = [names.index(name) for name in ("new_command", "first", "second", "third")]
    every = edges(role, seen)  # from behind some cycle on
    found = {end.table: end.changes for end in prove_level(ts, LITTLE).endings}
    for table in ("go", "pause"):
        steps = {
            (tuple(int(edge.start[at]) for at in places), tuple(int(edge.end[at]) for at in places))
            for edge in every
            if edge.table == table
        }
        assert found[table] == longest({(here, there) for here, there in steps if here != there})
    said = ["prove", str(path), "--level", "lower", "--no-cache", "--trace", "0"]
    assert run(said) == 1  # a restart lowers the flags, and it executes what has failed
    assert f"go ends, once taken, after at most {found['go']} changes of state" in capsys.readouterr().out


# --- the enumeration that holds it ----------------------------------------------------------------


def of_lower(folder: Path, lower: str) -> list[Edge]:
    """Enumerate the edges between all states of this lower level."""
    ts = small_level(folder, "lower", lower=lower)
    role, seen = Role(ts.program, ts.level, ts.links), set[State]()
    explored(role, seen=seen)
    return edges(role, seen)


def test_the_enumeration_sees_rounds_and_their_end(tmp_path: Path) -> None:
    turns = of_lower(tmp_path / "turns", lower_level(*TURNS, **TICK))
    assert endless(turns, "go", ()) == "round in quiet cycles"
    assert endless(of_lower(tmp_path / "counts", counting(4)), "go", ()) == ""


def test_the_enumeration_sees_order_after_order_and_what_stands_still() -> None:
    ts = transition_systems(SYSTEM)["upper"]
    assert "to_lower.inc_command" in ts.kinds
    assert gives_an_order(ts, ts.cycle(ts.havoc())).op != "constant"
    states: list[State] = [(0,), (1,)]
    there, back = ("in", True), ("in", False)
    round_ = [
        Edge(states[0], states[1], "work", True, False, (there,)),
        Edge(states[1], states[0], "work", False, False, (back,)),
    ]
    assert endless(round_, "work", ()) == "order after order"
    assert endless(round_, "work", ("in",)) == ""
    assert endless(round_, "rest", ()) == ""


def test_a_system_that_is_not_wholly_proved_says_what_rests_on_what(
    repo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(
        repo / "tests/data/composed", tmp_path / "s", ignore=shutil.ignore_patterns(".rcsc-cache")
    )
    assert run(["prove", str(tmp_path / "s"), "--level", "upper", "--no-cache"]) == 0
    verdict, _, rest = capsys.readouterr().out.partition("\n")
    assert verdict.startswith("proved in part: ")
    assert verdict.endswith("status 0, and 1 with --strict")
    many = re.search(r"(\d+) claims resting on unproved ones", verdict)
    assert many is not None
    assert int(many[1]) > 3
    assert "rest on level `lower`, which was not looked at" in rest
    assert "not looked at;" not in rest, "a level that was not looked at is told once, not claim by claim"

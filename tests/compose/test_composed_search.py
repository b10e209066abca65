"""The search under the composed proof: nodes as bits, frames, and what is asked in the context of an invariant."""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from functools import partial
from itertools import islice, product
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest
import z3
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.host import children
from rcsc.base.host.cache import Cache
from rcsc.compose.contract.environment import leaves_under
from rcsc.compose.contract.obligations import Obligation, obligations
from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.contract.transition import Cycle, Safety, TransitionSystem
from rcsc.compose.invariant.cubes import Masks, Pair, Reached, Valuation, Way, Ways, shown
from rcsc.compose.invariant.search import Effort, FoundInvariant, search
from rcsc.compose.proof import context as context_
from rcsc.compose.proof import level as level_proof
from rcsc.compose.proof import system
from rcsc.compose.proof.candidates import Candidates, candidates, keep_candidates
from rcsc.compose.proof.context import RepeatedLine
from rcsc.compose.proof.level import LevelProof, Verdict, prove_level
from rcsc.compose.proof.ranking import parts
from rcsc.compose.proof.system import (
    NoProgramError,
    _without_nodes,
    keep,
    prove_transition_systems,
    recall,
    transition_systems,
)
from rcsc.compose.proof.termination import Phase, longest
from rcsc.front.commands import run
from rcsc.lang.model import AssumptionName, Bool, Enum, Int, Op, Real, Scalar, real_key
from rcsc.lang.operator_table import Arithmetic, divide
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Limits
from rcsc.proof.solvers.sat import Sat
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.bits import Bits, few, key_of_bits
from rcsc.proof.symbolic.encode import at_most_key
from rcsc.proof.symbolic.keyed import Keyed
from rcsc.proof.symbolic.trial import holds_at
from rcsc.proof.symbolic.values import Node
from tests.support.programs.stages import program_of
from tests.support.programs.systems import (
    LITTLE,
    ORDER_AFTER_ORDER,
    SYSTEM,
    alone,
    counting,
    proved_level,
    small_level,
    small_proof,
    small_system,
    small_text,
)
from tests.support.programs.texts import edited

INT = Int(-9, 9)
NAMES: dict[str, Scalar] = {"i": INT, "j": INT, "b": Bool(), "c": Bool()}


def numbers(deep: int) -> st.SearchStrategy[Node]:
    leaf = st.one_of(
        st.sampled_from(["i", "j"]).map(lambda name: values.variable(name, INT)),
        st.sampled_from([-9, -1, 0, 1, 8, 9]).map(lambda value: values.constant(INT, value)),
    )
    if not deep:
        return leaf
    below = numbers(deep - 1)
    two = st.sampled_from([Op.ADD, Op.SUB, Op.MIN, Op.MAX])
    return st.one_of(
        leaf,
        st.builds(lambda op, a, b: values.arithmetic(op, (a, b), Int(-999, 999)), two, below, below),
        st.builds(
            lambda a, k: values.arithmetic(Op.MUL, (a, values.constant(INT, k)), Int(-9999, 9999)),
            below, st.integers(-9, 9),
        ),
        st.builds(lambda op, a: values.arithmetic(op, (a,), Int(-999, 999)), st.sampled_from([Op.NEG, Op.ABS]), below),
        st.builds(values.choice, truths(deep - 1), below, below),
    )  # fmt: skip


def truths(deep: int) -> st.SearchStrategy[Node]:
    leaf = st.sampled_from(["b", "c"]).map(lambda name: values.variable(name, Bool()))
    if not deep:
        return leaf
    below, compared = truths(deep - 1), numbers(deep - 1)
    return st.one_of(
        leaf,
        st.builds(values.both, below, below),
        st.builds(values.negation, below),
        st.builds(values.choice, below, below, below),
        st.builds(values.compare, st.sampled_from([Op.EQ, Op.NE, Op.LT, Op.LE]), compared, compared),
        st.builds(values.compare, st.sampled_from([Op.EQ, Op.LT, Op.LE]), below, below),
    )


MEANING: dict[str, Callable[..., int]] = {
    Op.ADD: lambda a, b: a + b, Op.SUB: lambda a, b: a - b, Op.MUL: lambda a, b: a * b, Op.MIN: min, Op.MAX: max,
    Op.NEG: lambda a: -a, Op.ABS: abs, Op.NOT: lambda a: 1 - a, Op.AND: lambda a, b: a & b,
    Op.EQ: lambda a, b: int(a == b), Op.LT: lambda a, b: int(a < b), Op.LE: lambda a, b: int(a <= b),
    Op.MOD: lambda a, b: a - b * divide(a, b),
    "choice": lambda when, a, b: a if when else b, "narrowed": lambda a: a,
}  # fmt: skip


def meant(node: Node, state: dict[str, int]) -> int:
    if node.op == "variable":
        return state[node.name]
    if node.op == "constant":
        return int(node.low)
    return MEANING[node.op](*(meant(arg, state) for arg in node.args))


STATES = st.fixed_dictionaries({
    "i": st.integers(-9, 9), "j": st.integers(-9, 9), "b": st.integers(0, 1), "c": st.integers(0, 1),
})  # fmt: skip


@given(numbers(3), truths(3), STATES)
def test_bits_say_what_the_nodes_mean(number: Node, truth: Node, state: dict[str, int]) -> None:
    bits = Bits()  # nothing is only compared: the numbers themselves are read from a model
    word, literal = bits.word(number), bits.literal(truth)
    given_ = [
        bits.equals(bits.word(values.variable(name, kind)), kind, state[name]) for name, kind in NAMES.items()
    ]
    sat = Sat(bits.clauses)
    assert sat.holds(given_)
    assert key_of_bits([sat.value(bit) for bit in word]) == meant(number, state)
    assert sat.value(literal) == meant(truth, state)
    wrong = -literal if meant(truth, state) else literal
    assert not sat.holds([*given_, wrong])
    sat.close()


@given(numbers(3), truths(3))
def test_what_each_node_reads_is_found_in_one_pass(number: Node, truth: Node) -> None:
    both = values.both(truth, values.equal(number, number))
    found = values.each_reads([number, truth, both])
    assert found == [values.variables([node]).keys() for node in (number, truth, both)]


@given(truths(3))
def test_what_is_only_compared_holds_for_the_same_questions(truth: Node) -> None:
    """With as few bits as `few` gives, a truth value can be had exactly if some state has it."""
    bits = Bits.of((truth,))
    sat = Sat([*bits.clauses, [bits.literal(truth)], *bits.clauses])
    reads = values.variables([truth])
    domains = [range(2) if isinstance(reads[name].kind, Bool) else range(-9, 10) for name in reads]
    possible = any(meant(truth, dict(zip(reads, one, strict=True))) for one in product(*domains))
    assert sat.holds([]) or not possible  # ranges are forgotten: more may be possible, never less
    sat.close()


@pytest.mark.parametrize(("high", "left"), [(1, False), (2, False), (3, True), (9, True), (4095, True)])
def test_a_number_all_of_whose_values_are_named_has_no_other(high: int, left: bool) -> None:
    kind = Int(0, high)
    x, copy = values.variable("x", kind), values.variable("copy", Int(0, 9))
    truth = values.all_of(
        values.negation(values.equal(x, values.constant(kind, at))) for at in range(min(high, 2) + 1)
    )
    for asked in (truth, values.both(truth, values.equal(x, copy))):
        bits = Bits.of((asked,))
        sat = Sat([*bits.clauses, [bits.literal(asked)], *bits.clauses])
        assert sat.holds([]) is left
        sat.close()


VALUES = """input happens : int 0 .. 3
state x : bool
assume only_then assumed : happens = 1 implies x
table t assuming only_then {{
| line | happens | x || x |
{}
}}
level m {{ period 1 [s] table t }}
"""


@pytest.mark.parametrize(
    "rows",
    [
        "| none | 0 | || |\n| ends | 1 | true || false |\n| more | 2 | || true |\n| last | 3 | || true |",
        "| none | 0, 2 | || |\n| ends | 1 | true || false |\n| more | 3 | || true |",
        "| none | not in {1, 2} | || |\n| more | 1, 2 | || true |",
    ],
)
def test_cells_that_name_each_value_of_an_input_are_proved(rows: str) -> None:
    proof = prove_level(alone(VALUES.format(rows)), LITTLE)
    open_ = [one.name for one, verdict in proof.verdicts if verdict is not Verdict.PROVED]
    assert open_ == ["only_then"]  # as the text has it


def test_numbers_that_are_only_compared_get_few_bits() -> None:
    kind = Real(-1e6, 1e6)
    a, b, c = (values.variable(name, kind) for name in "abc")
    same = values.all_of(
        (values.equal(a, b), values.equal(b, c), values.equal(c, values.constant(kind, 5.0)))
    )
    assert {one.width for one in few((same,)).values()} == {2}
    assert few((values.both(same, values.compare(Op.LT, a, c)),)) == {}
    wanted = values.equal(a, c)
    bits = Bits.of((same, wanted))
    literals = bits.literal(same), bits.literal(wanted)
    sat = Sat(bits.clauses)
    assert sat.holds(literals)
    assert not sat.holds([literals[0], -literals[1]])
    assert sat.holds([-literals[0], -literals[1]])
    sat.close()


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_reals_compare_as_their_keys_do(one: float, two: float) -> None:
    kind = Real(-1e9, 1e9)
    a, b = values.variable("a", kind), values.variable("b", kind)
    below, same = values.compare(Op.LT, a, b), values.equal(a, b)
    bits = Bits.of((below, same))
    fixed = [bits.equals(bits.word(node), kind, real_key(value)) for node, value in ((a, one), (b, two))]
    less, equal = bits.literal(below), bits.literal(same)
    sat = Sat(bits.clauses)
    assert sat.holds([*fixed, less if one < two else -less])
    assert not sat.holds([*fixed, -less if one < two else less])
    assert not sat.holds([*fixed, -equal if one == two else equal])
    sat.close()


@pytest.mark.parametrize("op", [Op.ADD, Op.MUL, Op.DIV])
def test_an_open_operation_gives_the_same_for_the_same_operands(op: Arithmetic) -> None:
    """In another cycle, too, whose nodes are others."""
    kind = Real(1.0, 9.0)

    def made(name: str) -> Node:
        return values.arithmetic(
            op, (values.variable("a", kind), values.variable(name, kind)), Real(-1e3, 1e3)
        )

    for other, answer in (("b", Answer.UNSATISFIABLE), ("c", Answer.SATISFIABLE)):
        keyed, solver = Keyed(), Solver()
        differ = keyed.term(values.negation(values.equal(made("b"), made(other))))
        solver.add(*keyed.ranges, differ)
        assert solver.check() is answer


def test_a_real_stands_by_the_rank_of_its_double() -> None:
    """By its whole part, nothing would lie between a half and 0.9."""
    r = values.variable("r", Real(0.0, 0.9))
    keyed, solver = Keyed(), Solver()
    more = keyed.term(values.compare(Op.LT, values.constant(r.kind, 0.5), r))
    solver.add(*keyed.ranges, more)
    assert solver.check() is Answer.SATISFIABLE


@pytest.mark.parametrize("value", [-3.25, 0.0, 5e-324, 0.1, 7.0])
def test_the_value_of_a_double_is_the_double(value: float) -> None:
    kind = Real(-10.0, 10.0)
    x, solver = smt.variable("x", kind), Solver()
    solver.add(smt.equal(x, smt.literal(kind, value), kind))
    assert solver.check() is Answer.SATISFIABLE
    assert solver.value(x, kind) == value


@pytest.mark.parametrize("key", [0, 1])
def test_keys_of_truths_are_bounded(key: int) -> None:
    truth, solver = smt.variable("b", Bool()), Solver()
    solver.add(at_most_key(truth, Bool(), key), truth)
    assert solver.check() is (Answer.SATISFIABLE if key else Answer.UNSATISFIABLE)


def test_a_condition_holds_at_the_points_at_which_it_does() -> None:
    i, j = (values.variable(name, INT) for name in "ij")
    less = values.compare(Op.LT, i, j)
    assert [holds_at(less, {"i": at, "j": 1}) for at in (0, 1, 2)] == [True, False, False]


def test_ctrl_c_that_z3_took_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise z3.Z3Exception("interrupted from keyboard")

    solver = Solver()
    monkeypatch.setattr(solver, "_answer", interrupted)
    with pytest.raises(KeyboardInterrupt):
        solver.check()


def test_what_is_known_where_a_branch_is_taken_is_not_carried_elsewhere() -> None:
    """Within `if r > 6` a square is at least 36; the same square elsewhere need not be."""
    r = values.variable("r", Real(0.0, 10.0))
    inside = values.narrowed(r, 6.0, 10.0)
    large, any_ = (values.arithmetic(Op.MUL, (node, node), Real(0.0, 100.0)) for node in (inside, r))
    keyed, solver = Keyed(), Solver()
    terms = [
        keyed.term(values.compare(Op.LT, node, values.constant(node.kind, 50.0))) for node in (large, any_)
    ]
    less = values.compare(Op.LT, any_, values.constant(any_.kind, 25.0))
    terms.append(keyed.term(less))
    solver.add(*keyed.ranges, *terms)
    assert solver.check() is Answer.SATISFIABLE


def test_a_variable_that_no_clause_speaks_of_has_a_value() -> None:
    """As a random hierarchy had one: a predicate of the first cycle that nothing there depends on."""
    sat = Sat([[1], [-2]])
    assert sat.holds([])
    assert [literal for literal in (1, -1, 2, -2, 7, -7) if sat.value(literal)] == [1, -2, -7]
    sat.close()


def test_the_solver_is_given_each_assumption_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some solvers write beyond their memory, and end the process, where more are given than they have variables."""
    sat, given_to_solver = Sat([[1, 2], [-1, 3]]), list[int]()
    solve = sat._solver.solve_limited

    def recorded(*, assumptions: list[int]) -> bool:
        given_to_solver.extend(assumptions)
        return bool(solve(assumptions=assumptions))

    monkeypatch.setattr(sat._solver, "solve_limited", recorded)
    assert not sat.holds([1, 2, 1, -3, *[2] * 40])
    assert given_to_solver == [1, 2, -3]
    assert {1, -3} >= sat.core() > frozenset()


def test_known_states_answer_for_cubes() -> None:
    reached = Reached.of([(0, 1, 2), (1, 1, 0)])
    assert reached.shows(((0, 0), (2, 2)))
    assert not reached.shows(((0, 0), (2, 0)))
    assert reached.values(((1, 1),), 2) == {0, 2}
    assert not reached.shows(((1, ~1),))
    reached.add((0, 5, 0))
    assert reached.shows(((0, 0), (2, 0)))
    assert reached.shows(((1, ~1), (2, 0)))
    assert not reached.shows(((1, ~1), (2, ~0)))
    assert reached.many == 3


SIZES = (2, 3, 70)
PAIRS = st.one_of(*(st.tuples(st.just(at), st.integers(-size, size - 1)) for at, size in enumerate(SIZES)))
POINTS = st.tuples(*(st.sampled_from(sorted({0, 1, size - 1})) for size in SIZES))


@given(st.lists(POINTS, max_size=6), st.lists(POINTS, max_size=2), st.sets(PAIRS, max_size=3))
def test_known_states_lie_in_a_cube_if_one_of_them_does(
    first: list[tuple[int, int, int]], later: list[tuple[int, int, int]], pairs: set[Pair]
) -> None:
    reached = Reached.of(first)
    for state in later:
        reached.add(state)
    inside = [
        state
        for state in (*first, *later)
        if all(state[at] == value if value >= 0 else state[at] != ~value for at, value in pairs)
    ]
    cube = tuple(sorted(pairs))
    assert reached.shows(cube) is bool(inside)
    assert [reached.values(cube, at) for at in range(3)] == [{one[at] for one in inside} for at in range(3)]


@given(st.sets(PAIRS, max_size=5), st.sets(PAIRS, max_size=5))
def test_a_cube_implies_what_is_implied_of_it(one: set[Pair], two: set[Pair]) -> None:
    """As far as single pairs do; nothing else, however many values a predicate has."""
    masks, first, second = Masks.of(SIZES), tuple(sorted(one)), tuple(sorted(two))
    follows = all(
        pair in one or any(at == pair[0] and 0 <= value != ~pair[1] and pair[1] < 0 for at, value in one)
        for pair in two
    )
    wanted = masks.of_cube(second)
    assert (masks.implied(first) & wanted == wanted) is follows


def test_a_clause_is_written_in_the_words_of_the_tables() -> None:
    chosen = (Predicate("state", Enum("stage", ("a", "b", "c", "d"))), Predicate("new", Bool()))
    assert shown(chosen, ((0, 2), (1, 0))) == "state = c and new = false"
    assert shown(chosen, ((0, ~1), (1, 1))) == "state /= b and new = true"
    assert shown(chosen, ((0, ~3), (0, ~0))) == "state is none of a, d"


# --- ways through phases -------------------------------------------------------------------


@given(st.sets(st.tuples(st.integers(0, 4), st.integers(0, 4)), max_size=9))
def test_the_longest_way_and_ways_round(pairs: set[tuple[int, int]]) -> None:
    steps: set[tuple[Phase, Phase]] = {((a,), (b,)) for a, b in pairs}
    ways = [list(way) for way in pairs]
    reach = 1 if pairs else 0
    for _ in range(6):  # longer than any way that does not go round
        longer = [[*way, b] for way in ways for a, b in pairs if way[-1] == a]
        if not longer:
            break
        ways, reach = longer, len(longer[0]) - 1
    goes_round = reach > 5
    assert longest(steps) == (None if goes_round else reach)
    assert bool(parts(pairs)) is goes_round


# --- in the context of a small level -------------------------------------------------------


def test_lines_of_the_small_levels_are_all_reached_and_say_the_same_again() -> None:
    endings = {}
    for level in ("upper", "lower"):
        _, found = small_proof(level)
        assert found.context is not None
        assert (found.context.unreached, found.context.repeated, found.context.restless) == ((), (), False)
        endings[level] = {ending.table: (ending.changes, ending.endless) for ending in found.endings}
    # `go` of the lower level waits for its input: nothing there makes that come
    assert endings["lower"] == {"pause": (1, ()), "go": (1, ("2",))}
    changes = {table: many for table, (many, _) in endings["upper"].items()}
    assert changes["rest"] in {2, 3}
    assert changes["work"] in {3, 4}  # they are bounds: how close depends on which invariant was found


def test_a_line_that_is_dead_in_its_context_is_named(tmp_path: Path) -> None:
    """It is alive in its table: nothing there says that PAUSE is never reported while going."""
    line = "  | 6    | false               |       |                | executing | going     ||"
    more = "  | 6a   | false               |       | pause          | failed    | going     || go | | |\n"
    _, found = proved_level(tmp_path, "upper", upper=small_text("upper", (line, f"{more}{line}")))
    assert found.open == ()
    assert found.context is not None
    assert found.context.unreached == (("work", "6a"),)


COUNTER = "state idle : bool = true"


@pytest.mark.parametrize("before", [False, True])
def test_a_line_that_counts_when_it_matches_again_is_named(tmp_path: Path, before: bool) -> None:
    """Whether or not the preprocess writes the counter, too."""
    upper = small_text(
        "upper",
        (COUNTER, f"{COUNTER}\nstate tries : int 0 .. 9"),
        ("procedure begin {", "procedure again {\n  tries := min(tries + 1, 9)\n}\n\nprocedure begin {"),
        ("|| begin; nextstate(going) | go ", "|| begin; again; nextstate(going) | go "),
    )
    if before:
        upper = edited(
            upper,
            ("status_in, idle {", "status_in, idle, tries {"),
            ("    new_command := true\n", "    new_command := true\n    tries := 0\n"),
        )
    _, found = proved_level(tmp_path, "upper", upper=upper)
    assert found.open == ()
    assert found.context is not None
    assert found.context.repeated == (RepeatedLine("work", "1", ("tries",)),)


def test_what_a_line_changes_when_it_matches_again_is_told_in_declared_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In whichever order models name it: another one, asked again, and the certificate would not be confirmed."""
    upper = small_text(
        "upper",
        (COUNTER, f"{COUNTER}\nstate tries : int 0 .. 9\nstate more : int 0 .. 9\nstate most : int 0 .. 9"),
        (
            "procedure begin {",
            "procedure again { most := min(most + 1, 9) tries := min(tries + 1, 9) more := min(more + 1, 9) }\n\nprocedure begin {",
        ),
        ("|| begin; nextstate(going) | go ", "|| begin; again; nextstate(going) | go "),
    )
    shown = context_._shown
    named = []
    for turn in (1, -1):
        monkeypatch.setattr(context_, "_shown", lambda *asked, turn=turn: list(shown(*asked))[::turn])
        _, proof = proved_level(tmp_path, "upper", upper=upper)
        assert proof.context is not None
        named.append(proof.context.repeated)
    assert named == [(RepeatedLine("work", "1", ("tries", "more", "most")),)] * 2


@pytest.mark.parametrize(
    ("many", "told"), [(0, {Verdict.UNDECIDED}), (1, {Verdict.PROVED, Verdict.UNDECIDED})]
)
def test_all_questions_about_a_level_have_a_budget_together(
    monkeypatch: pytest.MonkeyPatch, many: int, told: set[Verdict]
) -> None:
    """It is proved with more; whichever question meets the end of the budget, nothing is said that is not so."""
    monkeypatch.setattr(level_proof, "TOGETHER", many)
    upper = transition_systems(SYSTEM)["upper"]
    found = prove_level(upper, replace(LITTLE, limits=Limits.of(1_000_000)))
    assert {verdict for _, verdict in found.verdicts} <= told
    assert found.context is None or not found.context.unreached


def test_a_command_that_need_not_end_is_named(tmp_path: Path) -> None:
    """After a failure it goes on, and gives the order again for ever."""
    begins_again = (
        "| f_state   ||                         | pause       | fail       |",
        "| f_state   || nextstate(d_state)      | pause       | executing  |",
    )
    _, found = proved_level(tmp_path, "upper", upper=small_text("upper", begins_again))
    ends = {ending.table: ending for ending in found.endings}
    assert ends["work"].proved  # from a failure to done: one state more, and it ends
    assert ends["work"].changes == 4  # new, going; failed, which is to be done, and is; new no more
    _, round_ = proved_level(tmp_path / "round", "upper", upper=small_text("upper", *ORDER_AFTER_ORDER))
    assert [ending.table for ending in round_.endings if ending.changes is None] == ["work"]


DONE = "go             | done      | going     || nextstate(d_state)      | pause       | done       |"


def test_a_level_that_waits_for_what_nobody_says_is_named(tmp_path: Path) -> None:
    waits = "go             | done      | going     ||                         |             | executing  |"
    _, found = proved_level(tmp_path, "upper", upper=small_text("upper", (DONE, waits)))
    ends = {ending.table: ending for ending in found.endings}
    assert (ends["work"].endless, ends["work"].proved) == (("2",), False)


# --- the cache -----------------------------------------------------------------------------


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    return Cache(tmp_path / "cache", b"0" * 32, "tool")


def test_a_proof_is_recalled_as_it_was_and_only_for_the_same_level(cache: Cache, tmp_path: Path) -> None:
    upper, proof = small_proof("upper")
    assert recall(cache, upper, LITTLE) is None
    keep(cache, upper, LITTLE, proof)
    kept = recall(cache, upper, LITTLE)
    assert kept is not None
    assert kept.cached
    assert (kept.clauses, kept.context, kept.endings) == (proof.clauses, proof.context, proof.endings)
    assert [(obligation.key, verdict) for obligation, verdict in kept.verdicts] == [
        (obligation.key, verdict) for obligation, verdict in proof.verdicts
    ]
    assert [predicate.name for predicate in kept.predicates] == [
        predicate.name for predicate in proof.predicates
    ]
    other = small_text("upper", (DONE, DONE.replace("d_state", "f_state")))
    assert recall(cache, small_level(tmp_path / "other", "upper", upper=other), LITTLE) is None
    assert recall(cache, upper, replace(LITTLE, walks=LITTLE.walks + 1)) is None


def test_what_is_undecided_is_not_kept(cache: Cache) -> None:
    upper, proof = small_proof("upper")
    given_up = LevelProof(
        proof.level,
        tuple((obligation, Verdict.UNDECIDED) for obligation, _ in proof.verdicts),
        (),
        (),
        0,
        0,
        0.0,
    )
    keep(cache, upper, LITTLE, given_up)
    assert recall(cache, upper, LITTLE) is None


def test_a_system_is_not_proved_twice(cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    made = transition_systems(SYSTEM)
    first = prove_transition_systems(made, LITTLE, 1, tuple(made), None, cache)

    def never(*_: object) -> LevelProof:
        raise AssertionError

    monkeypatch.setattr("rcsc.compose.proof.system.prove_level", never)
    again = prove_transition_systems(made, LITTLE, 1, tuple(made), None, cache)
    assert [level.clauses for level in again.levels] == [level.clauses for level in first.levels]
    assert again.agreements == first.agreements
    assert again.proved
    assert all(level.cached for level in again.levels)
    with pytest.raises(AssertionError):
        prove_transition_systems(made, LITTLE, 1, tuple(made), None, None)


class Here:
    """A pool whose work is done where it is given."""

    def submit(self, done: Callable[..., LevelProof], *args: object) -> Future[LevelProof]:
        """Do it at once."""
        found: Future[LevelProof] = Future()
        found.set_result(done(*args))
        return found


def test_levels_that_are_proved_in_processes_come_back_with_what_they_owe(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = transition_systems(SYSTEM)
    owed = {name: obligations(ts, ts.cycle(ts.havoc())) for name, ts in made.items()}

    def proof(ts: TransitionSystem, effort: Effort, _: Cache | None) -> LevelProof:
        assert (ts, effort) == (made[ts.level.name], LITTLE)
        told = (Verdict.UNDECIDED, *[Verdict.PROVED] * len(owed[ts.level.name]))
        found = tuple(zip(owed[ts.level.name], told, strict=False))
        return LevelProof(ts.level.name, found, (), (), 0, 0, 0.0)

    monkeypatch.setattr("rcsc.compose.proof.system.prove_level", proof)
    monkeypatch.setattr(children, "pool", lambda _: nullcontext(Here()))
    proofs = prove_transition_systems(made, LITTLE, 2, tuple(made)).levels
    assert [one.level for one in proofs] == list(made)
    for one in proofs:
        assert [obligation.key for obligation, _ in one.verdicts] == [owing.key for owing in owed[one.level]]
        assert [verdict for _, verdict in one.verdicts].index(Verdict.UNDECIDED) == 0
        assert any(obligation.holds is not values.TRUE for obligation, _ in one.verdicts)
        sent = _without_nodes(made[one.level], LITTLE, None)
        assert {obligation.holds for obligation, _ in sent.verdicts} == {values.TRUE}


def test_levels_are_said_as_they_are_done_where_it_is_asked_for(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each before the next one is begun, and nothing of it among what was found."""
    said: list[str] = []

    def proving(ts: TransitionSystem, *_: object) -> LevelProof:
        said.append(capsys.readouterr().err)
        return LevelProof(ts.level.name, (), (), (), 0, 0, 0.0)

    monkeypatch.setattr("rcsc.compose.proof.system.prove_level", proving)
    asked = ["prove", str(SYSTEM), "--no-cache", "--jobs", "1", "--trace", "0", "--json"]
    run([*asked, "--progress"])
    assert said == ["", "level upper: 0 of 0 found proved, 0.0 s\n"]
    json.loads(capsys.readouterr().out)
    said.clear()
    run(asked)
    assert said == ["", ""]


@pytest.mark.parametrize("lies", [[2], [~0], [2, ~2]])
def test_what_z3_does_not_confirm_is_not_proved(monkeypatch: pytest.MonkeyPatch, lies: list[int]) -> None:
    """The search lies: the level is never under way, is always done, or is in no state at all, which only the first cycle breaks."""

    def lying(
        ts: TransitionSystem,
        firsts: Sequence[Cycle],
        cycle: Cycle,
        wanted: Sequence[Obligation],
        effort: Effort,
        *_: object,
    ) -> FoundInvariant:
        found = search(ts, firsts, cycle, wanted, effort)
        names = [predicate.name for predicate in found.predicates]
        at = names.index("cur_state")
        return replace(found, clauses=(*found.clauses, *(((at, lie),) for lie in lies)))

    monkeypatch.setattr("rcsc.compose.proof.level.search", lying)
    proof = prove_level(transition_systems(SYSTEM)["upper"], LITTLE)
    assert {verdict for _, verdict in proof.verdicts} == {Verdict.UNDECIDED}


# --- after an earlier proof ---------------------------------------------------------------------

CELL = re.compile(r"(?<=\|) *[a-z_]+ *(?=\|)")
EDITS = 2
"""Drawn versions of a level; some are broken, and some are not."""


def concluded(proof: LevelProof) -> tuple[object, ...]:
    """Return all that is concluded of a level, without how."""
    verdicts = {obligation.key: verdict for obligation, verdict in proof.verdicts}
    seen = proof.context
    lines = None if seen is None else (seen.unreached, seen.repeated, seen.restless)
    return verdicts, lines, [(ending.table, ending.proved, ending.still) for ending in proof.endings]


def with_another_cell(random: Random, folder: Path) -> Iterator[TransitionSystem]:
    """Yield the upper level with the content of one cell of its tables in place of another's, where that is a level."""
    text = small_text("upper")
    cells = [cell for cell in CELL.finditer(text, text.index("table work")) if cell.group().strip() != "line"]
    for at in range(100):
        old, new = random.sample(cells, 2)
        other = f"{text[: old.start()]} {new.group().strip()} {text[old.end() :]}"
        if other == text or new.group().strip() == old.group().strip():
            continue
        with suppress(NoProgramError):
            yield small_level(folder / str(at), "upper", upper=other)


def test_after_one_cell_has_changed_the_same_is_concluded_as_from_nothing(
    tmp_path: Path, cache: Cache
) -> None:
    _, before = small_proof("upper")
    broken = 0
    for ts in islice(with_another_cell(Random(2), tmp_path), 1, 1 + EDITS):  # noqa: S311  # repeatable on purpose
        keep_candidates(cache, ts, FoundInvariant(before.predicates, before.clauses), Candidates())
        assert len(candidates(cache, ts).clauses) == len(before.clauses) > 0
        proof = prove_level(ts, LITTLE, cache)
        assert concluded(proof) == concluded(prove_level(ts, LITTLE))
        broken += bool(proof.open)
    assert 0 < broken < EDITS


ATOMS = (
    "new_command", "not new_command", "begun", "not begun", "idle", "cur_state = going", "cur_state /= d_state", "status_in = done",
    "status_report = executing", "to_lower.input_command = go", "to_lower.input_command = pause", "report.status_report /= failed",
)  # fmt: skip


def with_more(old: str, new: str, random: Random, folder: Path) -> Iterator[TransitionSystem]:
    """Yield the upper level with a text that says two drawn conditions instead of another."""
    for at in range(100):
        first, second = random.sample(ATOMS, 2)
        with suppress(NoProgramError):
            drawn = old, new.format(first, second)
            yield small_level(folder / str(at), "upper", upper=small_text("upper", drawn))


def with_another_buffer(random: Random, folder: Path) -> Iterator[TransitionSystem]:
    """Yield the upper level where less is known of what it takes: its orders are not numbered, or reports are not linked to orders."""
    del random, folder
    ts = transition_systems(SYSTEM)["upper"]
    above = ts.links.above
    assert above is not None
    other = (
        replace(ts.links, above=replace(above, numbered=())),
        replace(ts.links, below=(), free=(*ts.links.free, *leaves_under(ts.program, "lower"))),
    )
    for links in other:
        yield TransitionSystem(ts.program, ts.level, links, ts.safety)


@pytest.mark.parametrize(
    "edits",
    [
        pytest.param(
            partial(with_more, "assume in_step", "invariant drawn : {} implies {}\n\nassume in_step"),
            id="with_another_invariant",
        ),
        pytest.param(
            partial(with_more, "monitored : not new_command implies", "monitored : {} implies {} or"),
            id="with_another_assumption",
        ),
        with_another_buffer,
    ],
)
def test_after_something_else_has_changed_the_same_is_concluded_as_from_nothing(
    edits: Callable[[Random, Path], Iterator[TransitionSystem]], tmp_path: Path, cache: Cache
) -> None:
    """An invariant, an assumption or a buffer, in levels of which some are proved and some are not, or none is."""
    _, before = small_proof("upper")
    broken = 0
    for ts in islice(edits(Random(3), tmp_path), EDITS):  # noqa: S311  # repeatable on purpose
        keep_candidates(cache, ts, FoundInvariant(before.predicates, before.clauses), Candidates())
        proof = prove_level(ts, LITTLE, cache)
        assert concluded(proof) == concluded(prove_level(ts, LITTLE))
        broken += bool(proof.open)
    assert broken > 0


def test_a_proof_goes_on_where_another_was_ended(monkeypatch: pytest.MonkeyPatch, cache: Cache) -> None:
    """When its search was done; the next one is asked for each clause that was found whether it still holds, and for little else."""
    ts = transition_systems(SYSTEM)["upper"]

    def ended(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(level_proof, "_confirm", ended)
        with counted() as first, pytest.raises(KeyboardInterrupt):
            prove_level(ts, LITTLE, cache)
    known = candidates(cache, ts.refusing()).clauses
    with counted() as again, monkeypatch.context() as patched:
        patched.setattr(level_proof, "_confirm", ended)
        with pytest.raises(KeyboardInterrupt):
            prove_level(ts, LITTLE, cache)
    assert again["search"] < 4 * len(known) < 0.7 * first["search"]
    assert prove_level(ts, LITTLE, cache).open == ()


@contextmanager
def counted() -> Iterator[dict[str, int]]:
    """Count the questions to the SAT solver meanwhile."""
    many, holds = {"search": 0}, Sat.holds

    def counting(sat: Sat, assuming: Iterable[int]) -> bool:
        many["search"] += 1
        return holds(sat, assuming)

    with patch.object(Sat, "holds", counting):
        yield many


@pytest.mark.parametrize("value", [0, ~0])
def test_nothing_is_believed_of_candidates(value: int, cache: Cache) -> None:
    """Each forbids a value of one predicate; with all of them no state would be left. Some are about predicates that there are not."""
    ts, proof = small_proof("upper")
    wrong = tuple(((at, value),) for at in range(len(proof.predicates)))
    more = (*proof.predicates, Predicate("gone", Bool()))
    keep_candidates(
        cache, ts, FoundInvariant(more, (*wrong, ((len(more) - 1, value),), ((0, 99),), ())), Candidates()
    )
    again = prove_level(ts, LITTLE, cache)
    assert concluded(again) == concluded(proof)
    assert len(set(again.clauses) & set(wrong)) < len(wrong) / 2


@pytest.mark.parametrize(
    ("since", "missed", "proofs"), [(True, False, 2), (True, True, 1), (False, False, 1)]
)
def test_what_is_missing_of_another_version_as_well_is_not_looked_for_twice(
    since: bool, missed: bool, proofs: int, cache: Cache, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`go` of the lower level waits for its input; its clauses are of another version `since`, which `missed` the same."""
    ts = transition_systems(SYSTEM)["lower"]
    first, done = prove_level(ts, LITTLE, cache), list[Candidates]()
    found = candidates(cache, ts)
    assert found.lacking == ("ending go",)
    begun = replace(
        found, found_of="other" if since else found.found_of, lacking=found.lacking if missed else ()
    )
    keep_candidates(cache, ts, FoundInvariant(first.predicates, first.clauses), begun)
    proved = level_proof._proved

    def counting_proofs(*given: Any) -> LevelProof:
        done.append(given[-1])
        return proved(*given)

    monkeypatch.setattr(level_proof, "_proved", counting_proofs)
    assert concluded(prove_level(ts, LITTLE, cache)) == concluded(first)
    assert [each.clauses for each in done] == [found.clauses, ()][:proofs]


def test_what_is_known_is_said_again_while_nothing_changes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No proof is looked for. Every file of the system counts, and every option that says what is proved or printed."""
    path = small_system(tmp_path, lower=counting(3))
    asked = ["prove", str(path), "--trace", "0"]
    assert run(asked) == 0
    first = re.sub(r"[\d.]+ s\b", "", capsys.readouterr().out)
    monkeypatch.setattr("rcsc.front.commands.systems.proving.proved", lambda *_: 7)
    assert run(asked) == 0
    again = re.sub(r"[\d.]+ s\b", "", capsys.readouterr().out)
    assert again.replace(", by an earlier run", "") == first
    for more in (
        ["--level", "upper"],
        ["--strict"],
        ["--steps", "3"],
        ["--json"],
        ["--no-cache"],
        ["--first-match"],
    ):
        assert run([*asked, *more]) == 7
    for file in (path, *path.parent.glob("*.rcs")):
        text = file.read_text(encoding="utf-8")
        file.write_text(f"{text}\n", encoding="utf-8")
        assert run(asked) == 7
        file.write_text(text, encoding="utf-8")
        assert run(asked) == 0
    for entry in (tmp_path / ".rcsc-cache").glob("??/*.json"):
        entry.write_bytes(entry.read_bytes().replace(b"proved", b"Proved"))
    assert run(asked) == 7


def test_a_level_is_kept_before_the_next_one_is_begun(cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    made = transition_systems(SYSTEM)
    first, second = made

    def ended(ts: TransitionSystem, *more: Any) -> LevelProof:
        if ts.level.name == second:
            raise KeyboardInterrupt
        return prove_level(ts, *more)

    monkeypatch.setattr("rcsc.compose.proof.system.prove_level", ended)
    with pytest.raises(KeyboardInterrupt):
        prove_transition_systems(made, LITTLE, 1, (first, second), None, cache)
    assert recall(cache, made[first], LITTLE) is not None
    assert recall(cache, made[second], LITTLE) is None


# --- what the search need not ask ---------------------------------------------------------------


@pytest.mark.parametrize("seed", range(50))
def test_a_cycle_that_is_known_leads_where_it_did_from_frames_that_have_its_beginning(seed: int) -> None:
    """Drawn cycles and clauses: one is named if, and only if, one begins in the frame outside the cube and ends in the cube."""
    random, sizes = Random(seed), (2, 2, 3, 4)  # noqa: S311  # repeatable on purpose
    masks, ways = Masks.of(sizes), Ways()

    def cube() -> tuple[Pair, ...]:
        places = sorted(random.sample(range(4), random.randint(1, 2)))
        return tuple((at, _value(random, sizes[at])) for at in places)

    def point() -> Valuation:
        return tuple(random.randrange(size) for size in sizes)

    def lies(state: Valuation, inside: tuple[Pair, ...]) -> bool:
        return all(state[at] == value if value >= 0 else state[at] != ~value for at, value in inside)

    known: list[tuple[Valuation, Valuation]] = []
    clauses: list[tuple[tuple[Pair, ...], int]] = []
    for _ in range(30):
        if random.random() < 0.5:
            start, end = point(), point()
            starts, ends = (masks.implied(tuple(enumerate(state))) for state in (start, end))
            outside = max((frame for clause, frame in clauses if lies(start, clause)), default=0)
            ways.add(Way(start, end, starts, ends), outside)
            known.append((start, end))
        elif random.random() < 0.3:
            clauses.append((cube(), random.randint(1, 3)))
            ways.exclude(masks.of_cube(clauses[-1][0]), clauses[-1][1])
        asked, frame = cube(), random.randint(1, 3)
        allowed = [
            (start, end)
            for start, end in known
            if lies(end, asked) and not lies(start, asked)
            if not any(lies(start, clause) and at >= frame for clause, at in clauses)
        ]
        found = ways.into(masks.of_cube(asked), frame)
        assert (found is None) == (not allowed)
        assert found is None or (found.start, found.end) in allowed


def _value(random: Random, size: int) -> int:
    value = random.randrange(size)
    return ~value if random.random() < 0.5 else value


@pytest.mark.parametrize("seed", range(100))
def test_simpler_clauses_say_the_same_of_what_is_read(seed: int) -> None:
    """Drawn clauses of 12 variables, four of them read: the same answers to all that can be assumed of those, and values that may be."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    variables = range(1, 13)
    clauses = [
        [random.choice((1, -1)) * at for at in random.sample(variables, random.randint(1, 3))]
        for _ in range(random.randint(0, 34))
    ]
    read = random.sample(variables, 4)
    whole, simpler = Sat(clauses), Sat(clauses, read)
    for signs in product((-1, 0, 1), repeat=4):
        assuming = [sign * at for sign, at in zip(signs, read, strict=True) if sign]
        holds = simpler.holds(assuming)
        assert holds == whole.holds(assuming)
        if holds:
            assert whole.holds([at if simpler.value(at) else -at for at in read])
        else:
            assert not whole.holds(simpler.core())
    for sat in (whole, simpler):
        sat.close()


@pytest.mark.parametrize(("before", "times"), [(("ending t",), 1), ((), 2)])
def test_where_more_is_missing_than_before_all_is_proved_once_more_without_old_clauses(
    before: tuple[str, ...], times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = Candidates((((("p", True),),),), "another version", before)  # type: ignore[arg-type]
    asked: list[Candidates] = []

    def proved(
        _ts: object, _effort: object, _cache: object, _walked: object, known: Candidates
    ) -> LevelProof:
        asked.append(known)
        return LevelProof("l", (), (), (), 0, 0, float(len(asked)))

    monkeypatch.setattr(level_proof, "content", lambda _: "this version")
    monkeypatch.setattr(level_proof, "candidates", lambda *_: begun)
    monkeypatch.setattr(level_proof, "keep_candidates", lambda *_: None)
    monkeypatch.setattr(level_proof, "_lacking", lambda _: ("ending t",))
    monkeypatch.setattr(level_proof, "_proved", proved)
    nothing: Any = None
    assert level_proof._proved_of(nothing, Effort(), None, FoundInvariant()).seconds == times
    assert asked == [begun, Candidates(found_of="this version")][:times]


@pytest.mark.parametrize("gone", [0, 1])
def test_a_kept_proof_of_which_a_part_is_of_another_version_is_none(
    gone: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts_ = [LevelProof("l", (), (), (), 0, 0, 0.0) if at != gone else None for at in range(2)]
    left = iter(parts_)
    monkeypatch.setattr(system, "_recalled", lambda *_: next(left))
    ts: Any = SimpleNamespace(refusing=lambda: None)
    kept: Any = SimpleNamespace(parts=(None, None))
    assert system._whole(ts, kept) is None


def test_the_questions_of_a_proof_in_two_parts_are_those_of_both_within_the_same_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []

    def questions(_: object, proof: LevelProof, limits: Limits) -> dict[str, str]:
        asked.append((proof.seconds, limits))
        return {"first": f"of part {proof.seconds}"}

    monkeypatch.setattr(level_proof, "_certificate", questions)
    parts_ = tuple(LevelProof("l", (), (), (), 0, 0, float(at)) for at in (1, 2))
    ts: Any = SimpleNamespace(refusing=lambda: None)
    found = level_proof.certificate(ts, replace(parts_[1], parts=parts_), Limits(steps=5))
    assert found == {"first": "of part 1.0", "nothing refused first": "of part 2.0"}
    assert asked == [(1.0, Limits(steps=5)), (2.0, Limits(steps=5))]


def test_whether_a_cycle_can_follow_is_asked_of_where_the_one_before_begins(tmp_path: Path) -> None:
    """A later one begins in the invariant, which here holds nowhere; a first one does not."""
    ts = small_level(tmp_path, "lower")
    cycle, never = ts.cycle(ts.havoc()), Solver()
    never.add(smt.truth(False))
    inference: Any = SimpleNamespace(
        cycle=cycle, keyed=Keyed(), known=lambda _: never, beginning=lambda _: Solver()
    )
    assert level_proof._followed(ts, inference, (), cycle) is Answer.UNSATISFIABLE
    assert level_proof._followed(ts, inference, (), ts.cycle(ts.havoc(), " first")) is Answer.SATISFIABLE


def test_what_a_line_changes_when_it_matches_again_is_found_without_a_proof(tmp_path: Path) -> None:
    upper = small_text(
        "upper",
        (COUNTER, f"{COUNTER}\nstate tries : int 0 .. 9"),
        ("procedure begin {", "procedure again { tries := min(tries + 1, 9) }\n\nprocedure begin {"),
        ("|| begin; nextstate(going) | go ", "|| begin; again; nextstate(going) | go "),
    )
    ts = small_level(tmp_path, "upper", upper=upper)
    asked = level_proof._asked_anew((), tuple(ts.firsts().values()), ts.cycle(ts.havoc()), Limits())
    [later, *_] = context_._starts(ts, asked, ())
    assert "tries" in dict(context_._repeated(ts, asked, later))["work", "1"]


def test_safety_needs_no_invariant_where_it_rests_on_the_same_assumption_with_and_without() -> None:
    program = program_of(
        "input a : int 0 .. 9\nstate n : int 0 .. 9\nstate m : int 0 .. 9\ninvariant low : m <= 9\nassume small assumed : a < 9\n"
        "table t assuming small {\n| line | a || n |\n| l | 0 .. 9 || a + 1 |\n}\n"
    )
    assert system._safety(program, {"t": (AssumptionName("small"),)}, ()) == Safety()
    assert system._safety(program, {}, ()) == Safety(("low",))

"""Each engine against every state of drawn levels; what is trusted broken once, and noticed; the cases that asked for the engines."""

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from random import Random
from typing import Any
from unittest.mock import patch

import pytest
import z3

from rcsc.compose.contract import properties
from rcsc.compose.contract.claims import SAFE
from rcsc.compose.contract.obligations import ObligationKey, Sort, obligations
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.counterexample.trace import Trace, trace_of
from rcsc.compose.exact import circuit as circuits
from rcsc.compose.exact import explicit, played
from rcsc.compose.exact.bounded import Looked, looked
from rcsc.compose.exact.circuit import Circuit, Frame, Gates, circuit
from rcsc.compose.exact.explicit import Explored
from rcsc.compose.exact.export import aiger, btor2
from rcsc.compose.exact.said import boxes, of_formula, of_states, predicate
from rcsc.compose.exact.spacer import Lemmas, related
from rcsc.compose.invariant.search import search
from rcsc.compose.proof.level import Verdict, certificate, prove_level
from rcsc.compose.proof.system import transition_systems
from rcsc.front.commands import run
from rcsc.lang.interpret import holds
from rcsc.lang.model import Bool, Enum, Int, Scalar, key_bounds, value_of_key
from rcsc.lang.operator_table import Arithmetic, Op, divide
from rcsc.proof.solvers.horn import AtMost, Formula, Joined, Within
from rcsc.proof.solvers.smt import Answer
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.bits import TRUE
from tests.compose.test_hierarchies import roles
from tests.exact.judged import Truth, drawn, truth
from tests.small_hierarchies.explored import explored
from tests.small_hierarchies.more import furnished
from tests.support.programs.systems import LITTLE, alone, solo_system

SEEDS = (1, 3, 6, 7, 8, 12, 15, 16, 18)
DEEP = 6
HIERARCHIES = (20_000, 20_044, 20_302)


@cache
def judged(seed: int, linear: bool = False) -> tuple[TransitionSystem, Truth]:
    ts = alone(drawn(seed, linear=linear))
    return ts, truth(ts)


def made(ts: TransitionSystem) -> Circuit:
    step = ts.cycle(ts.havoc())
    stated = [owed for owed in obligations(ts, step) if owed.sort is Sort.PROPERTY]
    return circuit(ts, tuple(ts.firsts().values()), step, stated)


def lengths(found: Explored | Looked, begins: int) -> dict[ObligationKey, int]:
    return {key: len(one.given) for key, one in found.runs.items() if one.begins == begins}


# --- engines against the judge --------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_the_search_of_states_finds_just_what_is_true(seed: int) -> None:
    ts, true = judged(seed)
    one = made(ts)
    assert one.opened == ()
    found = explicit.explored(one)
    assert (lengths(found, 0), lengths(found, 1)) == (true.least, true.restarted)
    if len(found.runs) < len(one.wanted):  # else it may end before it has seen all
        assert found.complete
        leaves = list(ts.program.variables)
        places = [next(at for at, v in enumerate(leaves) if v.name == name) for name in one.leaves]
        every = {tuple(int(state[at]) for at in places) for state in true.states}
        assert set(explicit.keys_of(one, found.states)) == every


@pytest.mark.parametrize("seed", SEEDS)
def test_bounded_search_finds_just_the_runs_that_there_are(seed: int) -> None:
    ts, true = judged(seed)
    found = looked(made(ts), DEEP)
    first = {key: cycles for key, cycles in true.least.items() if cycles <= DEEP}
    assert lengths(found, 0).items() <= true.least.items()
    assert {key for key in first if key in lengths(found, 0) or lengths(found, 1)[key] < first[key]} == set(
        first
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_every_run_is_one_by_the_interpreter_and_none_is_shorter(seed: int) -> None:
    ts, true = judged(seed)
    step = ts.cycle(ts.havoc())
    stated = {owed.key: owed for owed in obligations(ts, step) if owed.sort is Sort.PROPERTY}
    every = played.every_run(ts, tuple(ts.firsts().values()), list(stated.values()))
    assert every is not None
    assert set(every.runs) == {*true.least, *true.restarted}
    for key, shown in every.runs.items():
        trace = trace_of(ts, stated[key], shown)
        assert isinstance(trace, Trace)
        assert len(trace.steps) == true.least.get(key, true.restarted.get(key))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_level_is_proved_just_where_no_run_breaks_it(seed: int) -> None:
    ts, true = judged(seed, linear=True)
    proof = prove_level(ts, LITTLE)
    verdicts = {owed.key: verdict for owed, verdict in proof.verdicts if owed.sort is Sort.PROPERTY}
    wrong = {*true.least, *true.restarted}
    assert {key for key, verdict in verdicts.items() if verdict is Verdict.PROVED} == set(verdicts) - wrong


@pytest.mark.parametrize("seed", SEEDS)
def test_spacer_says_what_is_true_and_what_it_finds_is_an_invariant(seed: int) -> None:
    ts, true = judged(seed, linear=True)
    step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
    for owed in obligations(ts, step):
        if owed.sort is not Sort.PROPERTY:
            continue
        answer, conditions = related(ts, firsts, step, owed, Lemmas(), 4_000_000)
        breaks = owed.key in true.least or owed.key in true.restarted
        assert answer in {Answer.UNKNOWN, Answer.SATISFIABLE if breaks else Answer.UNSATISFIABLE}
        said = [predicate(one, ts.kinds).condition for one in conditions]
        names = [str(v.name) for v in ts.program.variables]
        for state in sorted(true.states) if answer is Answer.UNSATISFIABLE else ():
            assert all(one is not None and holds(one, dict(zip(names, state, strict=True))) for one in said)


@pytest.mark.parametrize("seed", HIERARCHIES)
def test_bounded_search_agrees_on_levels_with_neighbours(seed: int, tmp_path: Path) -> None:
    """Numbers of 16 bits, reports that are late, assumptions that stop: what runs break, and in how many cycles."""
    for role in roles(furnished(seed), tmp_path).values():
        ts = TransitionSystem(role.program, role.level, role.links)
        true = explored(role)
        step = ts.cycle(ts.havoc())
        wanted = [owed for owed in obligations(ts, step) if owed.key != SAFE]
        one = circuit(ts, tuple(ts.firsts().values()), step, wanted)
        assert one.opened == ()
        found = looked(one, 4)
        short = {key: cycles for key, cycles in true.least.items() if cycles <= 4}
        begun = lengths(found, 0)
        assert begun.items() <= short.items()
        assert all(key in begun or lengths(found, 1)[key] <= cycles for key, cycles in short.items())
        assert set(lengths(found, 1)) <= {*true.least, *true.restarted}


def test_the_drawn_levels_are_worth_the_search() -> None:
    every = [judged(seed)[1] for seed in SEEDS]
    assert sum(bool(one.least) for one in every) > len(every) // 3
    assert any(len(one.least) < 2 for one in every)
    assert max(max(one.least.values(), default=0) for one in every) > 3
    assert max(len(one.states) for one in every) > 50


# --- what is trusted, broken once -----------------------------------------------------------


def disagrees() -> bool:
    """Whether the judge notices anything of the search of states."""
    for seed in SEEDS:
        ts, true = judged(seed)
        found = explicit.explored(made(ts))
        if (lengths(found, 0), lengths(found, 1)) != (true.least, true.restarted):
            return True
    return False


def swapped(self: Gates, when: int, then: int, orelse: int) -> int:
    return _MUX(self, when, orelse, then)


_MUX, _SAME, _TIMES, _DIVIDED = Gates._mux, Gates._same, Gates._times, Gates._divided


ARITHMETIC: dict[Arithmetic, Callable[[int, int], int]] = {
    Op.MUL: lambda a, b: a * b,
    Op.DIV: divide,
    Op.MOD: lambda a, b: a - b * divide(a, b),
}


def arithmetic_is_right(most: int = 9) -> bool:
    """Whether products, quotients and remainders of two variables are right for every pair of values but a zero divisor."""
    kind = Int(-most, most)
    for op, meaning in ARITHMETIC.items():
        gates = Gates()
        node = values.arithmetic(op, tuple(values.variable(name, kind) for name in "ij"), Int(-99, 99))
        result, words = gates.word(node), [gates.named[name] for name in "ij"]
        for pair in product(range(-most, most + 1), repeat=2):
            if op is not Op.MUL and not pair[1]:
                continue
            bits = {
                abs(bit): (key >> at & 1 == 1) == (bit > 0)
                for word, key in zip(words, pair, strict=True)
                for at, bit in enumerate(word)
                if abs(bit) != TRUE
            }
            bits[TRUE] = True
            for gate, (a, b) in gates.ands.items():
                bits[gate] = bits[abs(a)] == (a > 0) and bits[abs(b)] == (b > 0)
            if circuits.key_of_word(kind, result, bits) != meaning(*pair):
                return False
    return True


def test_arithmetic_of_integers_is_exact() -> None:
    assert arithmetic_is_right()


def test_arithmetic_of_small_integers_is_exact() -> None:
    assert arithmetic_is_right(4)


@pytest.mark.parametrize(
    ("name", "broken"),
    [
        ("_times", lambda self, a, b: _TIMES(self, a, (*b[:-1], -1))),
        ("_divided", lambda self, a, b: _DIVIDED(self, a, b)[::-1]),
        ("_mux", swapped),
    ],
)
def test_arithmetic_that_is_wrong_is_noticed(name: str, broken: Callable[..., object]) -> None:
    with patch.object(Gates, name, broken):
        assert not arithmetic_is_right()


@pytest.mark.parametrize(
    ("name", "broken"), [("_mux", swapped), ("_same", lambda self, a, b: _SAME(self, a, -b))]
)
def test_a_gate_that_is_wrong_is_noticed(name: str, broken: Callable[..., object]) -> None:
    with patch.object(Gates, name, broken):
        assert disagrees()


def test_a_frame_that_begins_otherwise_is_noticed() -> None:
    real = circuits._frame

    def later(gates: Gates, cycle: Cycle, *more: Any) -> Frame:
        frame = real(gates, cycle, *more)
        return replace(frame, after=tuple(-bit for bit in frame.after)) if cycle.before["n"].known else frame

    with patch.object(circuits, "_frame", later):
        assert disagrees()


WIRED = """\
input a : int 0 .. 3
input fine : bool
state n : int 0 .. 3
assume small assumed : a <= 2
module take reads a, n writes n { n := a }
table t assuming small {
| line | fine || n |
|---|---||---|
| one | true || |
| other | false || 0 |
}
property kept : n <= 2
level solo { period 10 [ms] preprocess take table t }
"""


def test_a_contract_that_is_dropped_is_noticed() -> None:
    ts = alone(WIRED)
    one = made(ts)
    assert explicit.explored(one).runs == {}
    dropped = replace(
        one,
        firsts=tuple(replace(frame, valid=TRUE) for frame in one.firsts),
        step=replace(one.step, valid=TRUE),
    )
    assert [key[2] for key in explicit.explored(dropped).runs] == ["kept"]


# --- what it says ---------------------------------------------------------------------------


def test_states_are_said_as_few_boxes() -> None:
    assert boxes([(0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (1, 3), (4, 4)]) == [
        ((0, 1), (1, 3)),
        ((4, 4), (4, 4)),
    ]
    assert boxes([]) == []


COLOUR, SIZE, LENGTH = Enum("colour", ("red", "green", "blue")), Enum("size", ("s", "l")), Int(-2, 3)


@pytest.mark.parametrize("equal", [False, True])
@pytest.mark.parametrize("factors", list(product((-2, 1), (-1, 0, 2), (0, 1))))
def test_a_sum_of_keys_is_said_as_it_is(factors: tuple[int, ...], equal: bool) -> None:
    """Members of enumerations are not added in the language: they are said one by one."""
    leaves: tuple[tuple[str, Scalar], ...] = (("c", COLOUR), ("n", LENGTH), ("s", SIZE))
    told = tuple((at, factor) for at, factor in enumerate(factors) if factor)
    keys = [range(low, high + 1) for low, high in (key_bounds(kind) for _, kind in leaves)]
    for most in (-3, 0, 2):
        said = of_formula(AtMost(told, most, equal), leaves)
        for state in product(*keys):
            total = sum(state[at] * factor for at, factor in told)
            now = {name: value_of_key(kind, key) for (name, kind), key in zip(leaves, state, strict=True)}
            assert holds(said, now) == (total == most if equal else total <= most), (most, state)


SLOW = """\
input asked : bool
input much : int 0 .. 1000000
input less : int 0 .. 1000000
state busy : bool
state age : int 0 .. 600
module grow reads busy, age writes age { if busy { age := min(age + 1, 600) } else { age := 0 } }
table t {
| line | busy | age | asked and much + 1 < less || busy |
|---|---|---|---||---|
| rests | false | | false || |
| begins | false | | true || true |
| goes_on | true | < 500 | || |
| ends | true | >= 500 | || false |
}
requirement answered : while busy, within 500 cycles, not busy
level solo { period 40 [ms] preprocess grow table t }
"""
"""Its inputs cannot be listed, and its counters go up side by side: no constant tells why the bound is kept."""


@pytest.mark.parametrize("ahead", [-1, 2])
def test_a_bound_is_proved_by_counters_that_go_up_side_by_side(ahead: int) -> None:
    ts = alone(SLOW)
    step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
    wanted = obligations(ts, step)
    with patch.object(properties, "MOST_AHEAD", ahead):
        found = search(ts, firsts, step, wanted, LITTLE)
    left = {wanted[at].name for at in found.open}
    assert left == ({"answered"} if ahead < 0 else set())


LIGHT = """\
enum light { red, green }
input go : bool
state now : light
state wait : int 0 .. 1000
module count reads now, wait writes wait { if now = red { wait := min(wait + 1, 1000) } else { wait := 0 } }
table t {
| line | now | wait | go || now |
|---|---|---|---||---|
| stays | red | < 30 | || |
| goes | red | >= 30 | true || green |
| holds | red | >= 30 | false || |
| back | green | | || red |
}
property soon : now = green implies wait {least}
level solo { period 40 [ms] preprocess count table t }
"""


ROUND = """\
enum phase { one, two, three }
state now : phase
state since : int 0 .. 1000
module count reads now, since writes since { if now = one { since := 0 } else { since := min(since + 1, 1000) } }
table t {
| line | now || now |
|---|---||---|
| to_two | one || two |
| to_three | two || three |
| to_one | three || one |
}
property soon : since <= 2
level solo { period 40 [ms] preprocess count table t }
"""
"""No predicate tells `since = 0` from `since = 1`, so the search over predicates leaves it open."""


def test_a_bound_is_proved_by_all_states_and_its_certificate_holds() -> None:
    ts = alone(ROUND)
    proof = prove_level(ts, LITTLE)
    [(key, how)] = proof.by
    assert (key[2], how) == ("soon", "by search of all 3 states")
    assert proof.verdict(Sort.PROPERTY, name="soon") is Verdict.PROVED
    scripts = certificate(ts, proof)
    assert {"first", "restart", "step t", "goals property"} <= set(scripts)
    assert all(refuted(text) for text in scripts.values())


def test_a_bound_that_is_too_low_is_broken_by_a_run_that_waits() -> None:
    ts = alone(LIGHT.replace("{least}", "< 30"))
    proof = prove_level(ts, LITTLE)
    [broken] = proof.open
    every = played.every_run(ts, tuple(ts.firsts().values()), [broken])
    assert every is not None
    shown = every.runs[broken.key]
    assert isinstance(trace_of(ts, broken, shown), Trace)
    assert len(shown.taken) == 30


WIDE = """\
input a : int 0 .. 65535
input b : int 0 .. 65535
state n : int 0 .. 20
state far : bool
module count reads a, b, n writes n { if a + b = 70000 { n := min(n + 1, 20) } else { n := 0 } }
table t {
| line | n || far |
|---|---||---|
| near | < 5 || false |
| far | >= 5 || true |
}
property few : n < 12
level solo { period 40 [ms] preprocess count table t }
"""
"""Its inputs cannot be listed; a run that breaks it is longer than those that are usually looked for."""


def test_a_longer_run_is_found_where_inputs_cannot_be_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["prove", str(solo_system(tmp_path, WIDE)), "--no-cache"]) == 1
    assert (
        "broken in cycle 12, as the interpreter, the Python and the C executors run it"
        in capsys.readouterr().err
    )


def test_what_the_engines_say_falsely_is_not_believed() -> None:
    """An engine that leaves out a state says conditions that are no invariant: Z3 does not confirm them, and nothing else is lost."""
    ts = alone(ROUND)
    with patch.object(explicit, "keys_of", lambda _, states: [(0, 1)] * len(states)):
        proof = prove_level(ts, LITTLE)
    verdicts = {owed.sort: verdict for owed, verdict in proof.verdicts}
    assert verdicts[Sort.PROPERTY] is Verdict.NOT_PROVED
    assert verdicts[Sort.ONE_LINE] is Verdict.PROVED


def refuted(script: str) -> bool:
    solver = z3.Solver()
    solver.from_string(script)
    return bool(solver.check() == z3.unsat)


# --- for other model checkers ---------------------------------------------------------------


@pytest.mark.needs("berkeley-abc")
@pytest.mark.parametrize("seed", SEEDS)
def test_another_model_checker_says_the_same_of_drawn_levels(seed: int, tmp_path: Path) -> None:
    ts, true = judged(seed)
    one = made(ts)
    for at, key in enumerate(one.wanted):
        holds = key not in true.least and key not in true.restarted
        assert abc(aiger(one, [at]), tmp_path) == ("proved" if holds else "broken")


@pytest.mark.needs("berkeley-abc")
def test_another_model_checker_says_the_same_of_a_level_that_is_broken_and_of_one_that_is_not(
    tmp_path: Path,
) -> None:
    assert abc(aiger(made(alone(ROUND)), together=True), tmp_path) == "proved"
    assert abc(aiger(made(alone(LIGHT.replace("{least}", "< 30"))), together=True), tmp_path) == "broken"


@pytest.mark.needs("berkeley-abc")
@pytest.mark.parametrize("level", ["gripper", "vision"])
def test_another_model_checker_proves_all_that_a_shipped_level_owes(level: str, tmp_path: Path) -> None:
    assert abc(owed_by(level), tmp_path) == "proved"


@pytest.mark.thorough
@pytest.mark.needs("berkeley-abc")
@pytest.mark.parametrize(
    ("level", "answers"),
    [("task", {"proved"}), ("emove", {"proved", "open"}), ("primitive", {"proved", "open"})],
)
def test_another_model_checker_says_nothing_else_of_a_large_level(
    level: str, answers: set[str], tmp_path: Path
) -> None:
    """All that they owe is proved here; what it does not decide of the largest in its time says nothing."""
    assert abc(owed_by(level), tmp_path, 300 if answers == {"proved"} else 60) in answers


def owed_by(level: str) -> bytes:
    ts = transition_systems(Path(__file__).parents[2] / "tables" / "system.toml")[level]
    step = ts.cycle(ts.havoc())
    return aiger(circuit(ts, tuple(ts.firsts().values()), step, obligations(ts, step)), together=True)


def abc(question: bytes, folder: Path, seconds: int = 0) -> str:
    """Return the answer of ABC's PDR; 0 seconds are as many as it takes."""
    file = folder / "question.aig"
    file.write_bytes(question)
    tool = shutil.which("berkeley-abc")
    assert tool is not None
    asked = f"read_aiger {file}; pdr -T {seconds}"
    said = subprocess.run([tool, "-c", asked], capture_output=True, text=True, check=True).stdout
    for word, answer in (
        ("Property proved", "proved"),
        ("was asserted in frame", "broken"),
        ("Reached timeout", "open"),
    ):
        if word in said:
            return answer
    return said


def test_a_run_breaks_what_is_written_as_btor2_in_its_last_cycle_and_not_before() -> None:
    """A reader of the few forms that are written: it plays the run that the search of states has found."""
    ts = alone(LIGHT.replace("{least}", "< 30"))
    one = made(ts)
    [found] = explicit.explored(one).runs.values()
    lines = [line.split() for line in btor2(one).decode().splitlines()]
    state: dict[int, int] = {}
    for number, given in enumerate(found.given, 1):
        bad, state = played_as_btor2(lines, state, {**given, "restarts": found.begins})
        assert bad == (number == len(found.given))


def played_as_btor2(
    lines: list[list[str]], state: dict[int, int], given: dict[str, int]
) -> tuple[bool, dict[int, int]]:
    named = {"_".join(name.split()): key for name, key in given.items()}
    width: dict[int, int] = {}
    sort: dict[int, int] = {}
    value: dict[int, int] = {}
    after: dict[int, int] = {}
    bad = False

    def read(text: str) -> int:
        return value[int(text)] if int(text) > 0 else 1 - value[-int(text)]

    for first, kind, *rest in lines:
        number = int(first)
        if kind == "sort":
            width[number] = int(rest[1])
        elif kind in {"zero", "one"}:
            value[number] = int(kind == "one")
        elif kind == "state":
            value[number], sort[number] = state.get(number, 0), width[int(rest[0])]
        elif kind == "input":
            value[number] = named.get(rest[1], 0) & (1 << width[int(rest[0])]) - 1
        elif kind == "slice":
            value[number] = value[int(rest[1])] >> int(rest[2]) & 1
        elif kind == "and":
            value[number] = read(rest[1]) & read(rest[2])
        elif kind == "concat":
            size = width[int(rest[0])] - 1
            value[number] = read(rest[1]) << size | read(rest[2])
        elif kind == "next":
            after[int(rest[1])] = read(rest[2])
        elif kind == "bad":
            bad = bad or bool(read(rest[0]))
    return bad, after


def said_of(formula: Formula, state: tuple[int, ...]) -> bool:
    """Whether a formula holds of the keys of leaves."""
    match formula:
        case Joined(every, parts):
            return (all if every else any)(said_of(part, state) for part in parts)
        case Within(at, low, high):
            return low <= state[at] <= high
        case AtMost(factors, most, equal=True):
            return sum(state[at] * factor for at, factor in factors) == most
        case _:
            raise AssertionError(formula)


@pytest.mark.parametrize("seed", range(12))
def test_numbers_that_go_together_are_said_as_rows(seed: int) -> None:
    """Drawn rows of states: what is said of them holds of these, and of no other."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    kinds = (Int(-2, 6), Bool(), Int(0, 7), Int(-8, 1))
    every = list(product(range(-2, 7), (0, 1), range(8), range(-8, 2)))
    states = set[tuple[int, ...]]()
    for _ in range(4):
        begun, steps = random.choice(every), [random.choice((-1, 0, 1)) for _ in range(4)]
        way = (tuple(key + step * at for key, step in zip(begun, steps, strict=True)) for at in range(8))
        states |= {state for state in way if state in set(every)}
    said = of_states(sorted(states), kinds)
    assert {state for state in every if said_of(said, state)} == states


def test_a_long_row_is_said_in_one_condition() -> None:
    said = of_states([(at, at + 3) for at in range(100)], (Int(0, 200), Int(0, 200)))
    assert said == Joined(
        False, (Joined(True, (Within(0, 0, 99), Within(1, 3, 102), AtMost(((0, 1), (1, -1)), -3, True))),)
    )

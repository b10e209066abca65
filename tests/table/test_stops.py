"""Assumptions on which safety rests end the cycle; the others only tell. By brute force, and in every executor."""

import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import combinations, product
from math import inf, nan
from pathlib import Path
from random import Random

import pytest

from rcsc.base.diagnostics.jsonform import table_to_json
from rcsc.base.diagnostics.report import TableReport
from rcsc.base.host.files.plain import plain, read
from rcsc.code.emit import TARGETS, emitted
from rcsc.code.emit.generated import write
from rcsc.code.emit.lower import lower
from rcsc.code.testing.executors.sessions import same_value
from rcsc.compose.contract.environment import Links
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.front.commands.shared.show import backing
from rcsc.lang.interpret import Fault, cycle, evaluate, initial, run_table, unfit
from rcsc.lang.meaning import with_stops
from rcsc.lang.model import Bool, Int, Kind, Program, Snapshot, Value
from rcsc.proof.solvers.options import Options
from rcsc.proof.symbolic.values import TRUE, constant
from rcsc.proof.table.program import prove_program
from rcsc.run.adopt import restart
from rcsc.run.buffers import CommonMemory
from rcsc.run.executors import CExecutor, PythonExecutor, build
from rcsc.run.levels import BadState, RunningLevel
from rcsc.run.signature import signature
from tests.support.programs.examples import STOPS
from tests.support.programs.stages import BOXES, codes, program_of, proved_of, verdict_of

SAFETY = {"RCS410", "RCS411", "RCS412", "RCS413", "RCS414", "RCS415", "RCS417"}
UNDEFINED = (ArithmeticError, IndexError, KeyError)


def stops_of(text: str) -> tuple[str, ...]:
    """Those of the text's first table."""
    verdict = verdict_of(text)
    assert not [finding for finding in verdict.findings if finding.code.value in SAFETY]
    return verdict.program.tables[0].stops


DECLARED = """
input a : int 0 .. 9
input b : int -9 .. 9
state n : int 0 .. 9
state xs : array[4] of int 0 .. 9
output o : int 0 .. 9
assume some monitored : b /= 0
assume few assumed : a < 4
assume fewer monitored : a < 3
assume odd monitored : a mod 2 = 1
"""
BODIES = {
    "mark": "xs[a] := 9",
    "safe_mark": "if a < 4 { xs[a] := 9 }",
    "clear": "n := 1",
    "quotient": "n := 9 / max(b, -b)",
    "left": "n := 9 - 2 * a",
    "take": "n := a",
}


def declared(*called: str) -> str:
    """The declarations, and these procedures: what nothing calls is proved for every input."""
    return DECLARED + "\n".join(f"procedure {name} {{ {BODIES[name]} }}" for name in dict.fromkeys(called))


CASES = {
    "an index": ("", "mark", "clear", ("few",)),
    "a guard makes it safe": ("", "safe_mark", "clear", ()),
    "a line's own condition makes it safe": ("a < 4", "mark", "clear", ()),
    "a division in one line, an index in the other": ("", "quotient", "mark", ("some", "few")),
    "a range": ("", "left", "clear", ("few",)),
    "nothing": ("", "take", "clear", ()),
}


@pytest.mark.parametrize("case", CASES)
def test_the_fewest_assumptions_that_safety_needs_stop(case: str) -> None:
    guard, one, two, expected = CASES[case]
    otherwise = f"| 3 | >= 5 | not ({guard}) || |" if guard else ""
    text = f"""{declared(one, two)}
table t assuming some, few, fewer, odd {{
  | line | n    | when    || procedures |
  | 1    | < 5  |         || {two} |
  | 2    | >= 5 | {guard} || {one} |
  {otherwise}
}}
"""
    assert stops_of(text) == expected


@pytest.mark.parametrize(
    ("named", "declared_too", "heading", "rows", "expected"),
    [
        ("some, few", "", "9 / b || o", ("<= 2 || 1", "> 2 || 2"), ("some",)),
        ("few", "", "a || o", ("< 2 || 1", "2 .. 3 || 2"), ()),
        ("few", "invariant small : n <= 3", "a || procedures", ("|| take",), ("few",)),
    ],
    ids=["a condition that one defines", "exactly one line alone", "an invariant that only one keeps"],
)
def test_of_a_table_only_what_safety_needs_stops(
    named: str, declared_too: str, heading: str, rows: Sequence[str], expected: tuple[str, ...]
) -> None:
    lines = "".join(f"| l{at} | {row} |\n" for at, row in enumerate(rows))
    table = f"table t assuming {named} {{\n| line | {heading} |\n{lines}}}\n"
    assert stops_of(f"{declared('take')}\n{declared_too}\n{table}") == expected


def test_an_assumption_must_be_defined_by_itself() -> None:
    text = f"""{declared()}
assume third monitored : 9 / b > 2
table t assuming some, third {{
  | line | a || o |
  | all  |   || 1 |
}}
"""
    assert codes(verdict_of(text).findings) == ["RCS411"]


# --- by brute force ------------------------------------------------------------------

SEEDS = 50

SMALL = """
input a : int 0 .. 5
input b : int -2 .. 3
state n : int 0 .. 5
state k : int 0 .. 3
state xs : array[4] of int 0 .. 9
output o : int 0 .. 9
output p : int 0 .. 9
"""
ASSUMED = ("a /= 0", "b /= 0", "a < 4", "b >= 0", "a + b <= 5", "n <= a", "a < 2 or b > 0", "k < 3", "b > 0")
INVARIANTS = ("", "", "invariant kept : n <= k + 2", "invariant kept : k /= 3")
ACTIONS = {
    "n": ("a", "min(n + 1, 5)", "max(a - b, 0)"),
    "k": ("3 - b", "a", "0"),
    "o": ("9 / a", "a + n", "xs[a]", "1"),
    "p": ("9 mod b", "max(a + b, 0)", "xs[k]"),
}
CELLS = ("", "", "9 / b > 1", "xs[a] = k", "9 mod a < 3")


def drawn(seed: int) -> str:
    """A table of two lines (and with a cell about several leaves four) whose actions may go wrong."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    assumed = random.sample(ASSUMED, random.randint(2, 4))
    standings = [random.choice(("monitored", "assumed")) for _ in assumed]
    facts = "\n".join(
        f"assume f{at} {standing} : {fact}"
        for at, (fact, standing) in enumerate(zip(assumed, standings, strict=True))
    )
    cell = random.choice(CELLS)
    rows = [(half, when) for half in ("< 3", ">= 3") for when in ([cell, f"not ({cell})"] if cell else [""])]
    lines, bodies = [], []
    for at, (half, when) in enumerate(rows):
        targets = random.sample(list(ACTIONS), random.randint(1, 3))
        bodies += [
            f"procedure {target}_{at} {{ {target} := {random.choice(ACTIONS[target])} }}"
            for target in targets
        ]
        lines.append(f"  | l{at} | {half} | {when} || {'; '.join(f'{target}_{at}' for target in targets)} |")
    names = ", ".join(f"f{at}" for at in range(len(assumed)))
    head = f"table t assuming {names} {{\n  | line | n | when || procedures |"
    return "\n".join([SMALL, facts, *bodies, random.choice(INVARIANTS), head, *lines, "}"])


def in_range(program: Program, snapshot: Snapshot) -> bool:
    """Whether every leaf, all integers, lies in its declared range."""
    kinds = {str(v.name): v.type for v in program.variables}
    return all(
        kind.low <= snapshot[name] <= kind.high for name, kind in kinds.items() if isinstance(kind, Int)
    )


def goes_wrong(program: Program, state: Snapshot) -> bool:
    """Whether a step from the state does what is undefined, or leaves what the next one rests on."""
    try:
        outcome = run_table(program, program.tables[0], state)
        kept = all(evaluate(invariant.condition, outcome.snapshot) for invariant in program.invariants)
    except UNDEFINED:
        return True
    return not kept or not in_range(program, outcome.snapshot)


def states(program: Program) -> list[dict[str, Value]]:
    """Every state in range that satisfies the invariants; arrays as they begin."""
    varied = [v for v in program.variables if v.name in ("a", "b", "n", "k")]
    ranges = [range(v.type.low, v.type.high + 1) for v in varied if isinstance(v.type, Int)]
    found = []
    for point in product(*ranges):
        state = initial(program) | dict(zip((str(v.name) for v in varied), point, strict=True))
        if all(evaluate(invariant.condition, state) for invariant in program.invariants):
            found.append(state)
    return found


def safe(program: Program, stops: tuple[str, ...], every: list[dict[str, Value]]) -> bool:
    made = with_stops(program, {"t": stops})  # type: ignore[dict-item]  # names of assumptions
    return not any(goes_wrong(made, state) for state in every)


def test_no_input_goes_wrong_and_no_fewer_assumptions_would_do() -> None:
    stopping, refused = 0, 0
    for seed in range(SEEDS):
        program = program_of(drawn(seed))
        every, names = states(program), program.tables[0].assumptions
        verdict = prove_program(program, BOXES)
        owed = [finding for finding in verdict.findings if finding.code.value in SAFETY]
        if owed:
            refused += 1
            assert not safe(program, names, every), (seed, owed)
            continue
        stops = verdict.program.tables[0].stops
        stopping += bool(stops)
        fits = [
            chosen
            for count in range(len(stops) + 1)
            for chosen in combinations(names, count)
            if safe(program, chosen, every)
        ]
        assert fits[:1] == [stops], seed
    assert stopping > 3
    assert refused > 5


# --- in the proof of levels ----------------------------------------------------------


def test_a_cycle_of_the_proof_ends_where_the_interpreters_does() -> None:
    program = proved_of(STOPS)
    level = program.levels[0]
    free = tuple(str(v.name) for v in program.variables if v.kind is Kind.INPUT)
    ts = TransitionSystem(program, level, Links(level.name, None, (), (), free))
    start = initial(program) | {"n": 3}
    met: Counter[Fault] = Counter()
    for a, b, which in product((0, 7, 8, 9), (-9, 0, 2, 3), (0, 1)):
        taken = {"a": a, "b": b, "x": 0.0, "which": which}
        outcome = cycle(program, level, {**start, **taken})
        before = {str(v.name): constant(v.type, start[v.name]) for v in program.variables}
        given = {name: constant(program.variable(name).type, value) for name, value in taken.items()}
        one = ts.cycle(before, taken=given)
        met[outcome.fault] += 1
        assert bool(one.refused.low) == (outcome.fault is Fault.ASSUMPTION)
        assert one.goes_on is TRUE
        assert {name: node.low for name, node in one.after.items()} == outcome.snapshot
    assert min(met[Fault.OK], met[Fault.ASSUMPTION]) > 5


def test_reports_and_generated_files_say_which_stop_and_which_only_tell(tmp_path: Path) -> None:
    source = tmp_path / "said.rcs"
    source.write_text(STOPS)
    made = compile_(Settings((str(source),), Options(), use_cache=False), tmp_path, TARGETS, only_check=False)
    said = {table.table: (table.stops, table.tells) for table in made.report.tables}
    assert said == {
        "sees": (("place", "some"), ("calm", "low")),
        "keeps": (("some", "low"), ("calm",)),
    }
    for given in made.report.tables:
        form = table_to_json(given)
        assert (form["stops"], form["tells"]) == (list(given.stops), list(given.tells))
        assert read(TableReport, json.loads(json.dumps(plain(given)))) == given
    text = backing(made.report.tables[0])
    assert "stops where `place` or `some` fails, only tells where `calm` or `low` fails" in text
    for file in ("c/said.h", "python/said.py"):
        written = (tmp_path / file).read_text()
        assert "calm: only told in sees, keeps" in written
        assert "low: ends the cycle in keeps; only told in sees" in written
        assert "that matches admitted inputs where place and some hold:" in written


def test_safe_is_a_name_wherever_no_value_follows_it_on_its_line() -> None:
    text = """
record place { up : int 0 .. 3
  safe : int 0 .. 3 }
enum e { a, safe }
output spot : place
output m : e safe safe
output k : int 0 .. 3 = 1 safe 2
output r : real -1.0 .. 1.0 safe -(0.5)
state safe : bool
procedure q { spot.safe := 1
  safe := true
  if safe { k := 1 }
  local z : bool
  safe := false }
"""
    program = verdict_of(text).program
    shown = {str(variable.name): variable.safe for variable in program.variables if variable.safe is not None}
    assert shown == {"m": 1, "k": 2, "r": -0.5}


def test_safe_values_keep_the_invariants() -> None:
    text = "output a : bool safe true\noutput b : bool{}\ninvariant one : not a or not b\n"
    assert codes(verdict_of(text.format("")).findings) == ["RCS417"]
    assert verdict_of(text.format(" safe false")).findings == ()


# --- states from outside -------------------------------------------------------------

CHECKED = """
enum mode { off, slow, fast }
record pair { one : bool
  two : real -1.0 .. 2.5 }
input a : int 0 .. 9
input go : bool
state n : int -3 .. 200
state big : int 0 .. 18446744073709551615
state small : int -9223372036854775808 .. 9
state kept : array[3] of int 0 .. 7
state pairs : array[2] of pair
state phase : mode deferred until go
output shown : mode safe slow
output hold : bool = true safe true
invariant below : n <= 100 or hold
invariant never_both : not (pairs[0].one and pairs[1].one)
procedure mark { kept[0] := 1; hold := false; if a > 5 { next phase := fast } }
procedure count { n := min(n + 1, 100) }
table t {
  | line | a    || procedures  | shown |
  | lo   | < 5  || count       | off   |
  | hi   | >= 5 || count; mark | fast  |
}
level top { period 10 [ms] table t }
"""
STRANGE: dict[str, tuple[Value, ...]] = {
    "n": (-4, 201, -128, 101), "kept[2]": (8, 255), "pairs[1].two": (nan, inf, -inf, -1.25, 2.5000001),
    "phase": (3, 255), "phase.next": (3,), "shown": (3,), "small": (10, 2**62), "big": (2**64 - 1,),
    "pairs[0].one": (True,), "pairs[1].one": (True,), "hold": (False,),
}  # fmt: skip


def made(tmp_path: Path, *, defensive: bool) -> list[PythonExecutor | CExecutor]:
    """Both executors of `CHECKED`."""
    verdict = verdict_of(CHECKED)
    assert verdict.proved is not None, verdict.findings
    plan = lower(verdict.proved, defensive=defensive)
    write(emitted(plan), str(tmp_path))
    sign = signature(next((tmp_path / "c").glob("*.json")))
    library = build(tmp_path, [sign])
    return [PythonExecutor(tmp_path, sign, sign.levels[0]), CExecutor(library, sign, sign.levels[0])]


def drawn_states(program: Program, many: int) -> Iterator[dict[str, Value]]:
    random = Random(3)  # noqa: S311  # repeatable on purpose
    for _ in range(many):
        state = initial(program) | {"n": random.choice((0, 100, 101)), "hold": random.random() < 0.7}
        for name in random.sample(list(STRANGE), random.choice((0, 1, 1, 2))):
            state[name] = random.choice(STRANGE[name])
        yield state


def test_a_state_is_checked_alike_everywhere(tmp_path: Path) -> None:
    program = verdict_of(CHECKED).program
    names = [str(v.name) for v in program.variables]
    said: Counter[str] = Counter()
    for executor in made(tmp_path, defensive=False):
        for state in drawn_states(program, 300):
            executor.put(0, [state[name] for name in names])
            at = executor.check()
            positions = [*names, *(invariant.name for invariant in program.invariants)]
            assert (positions[at] if at >= 0 else "") == unfit(program, state), state
            said[unfit(program, state)] += 1
    assert set(said) == {"", "below", "never_both", *STRANGE} - {
        "big",
        "hold",
        "pairs[0].one",
        "pairs[1].one",
    }


def test_a_bool_that_is_neither_is_refused_in_c(tmp_path: Path) -> None:
    program = verdict_of(CHECKED).program
    executor = made(tmp_path, defensive=False)[1]
    assert isinstance(executor, CExecutor)
    for at, variable in enumerate(program.variables):
        if isinstance(variable.type, Bool):
            executor._memory[executor._places[at]] = b"\x02"  # no other way puts it there
            assert executor.check() == at
            executor._memory[executor._places[at]] = b"\x00"
    executor.put(0, [v.initial for v in program.variables])
    assert executor.check() == -1


def test_a_bool_that_is_neither_is_a_byte_that_a_defensive_cycle_refuses(tmp_path: Path) -> None:
    program = verdict_of(CHECKED).program
    executor = made(tmp_path, defensive=True)[1]
    assert isinstance(executor, CExecutor)
    assert " bool " not in (tmp_path / "c/case_.h").read_text("utf-8")
    at_fault = len(program.variables) + 2
    for at, variable in enumerate(program.variables):
        if isinstance(variable.type, Bool):
            for byte in (b"\x02", b"\xff"):
                executor.put(0, [v.initial for v in program.variables])
                executor._memory[executor._places[at]] = (
                    byte  # any byte is a value here, and none is undefined
                )
                refused = Fault.ADMIT if variable.kind is Kind.INPUT else Fault.STATE
                assert (executor.cycle(), executor.values()[at_fault]) == (refused, at)


def test_defensive_executors_refuse_a_state_in_every_cycle(tmp_path: Path) -> None:
    program = verdict_of(CHECKED).program
    names, shown = [str(v.name) for v in program.variables], {"shown": 1, "hold": True}
    for executor in made(tmp_path, defensive=True):
        met: Counter[int] = Counter()
        for state in drawn_states(program, 200):
            executor.put(0, [state[name] for name in names])
            fault, wrong = executor.cycle(), unfit(program, state)
            met[fault] += 1
            left = executor.values()
            if wrong:
                expected, position = (
                    state | shown,
                    [*names, *(invariant.name for invariant in program.invariants)],
                )
                assert (fault, position[int(left[len(names) + 2])]) == (Fault.STATE, wrong)
            else:
                outcome = cycle(program, program.levels[0], state)
                assert fault == outcome.fault
                expected = outcome.snapshot
            assert all(map(same_value, left, (expected[name] for name in names))), state
        assert min(met[Fault.OK], met[Fault.STATE]) > 20


def test_a_level_keeps_its_state_where_one_from_outside_is_refused(tmp_path: Path) -> None:
    program = verdict_of(CHECKED).program
    names = [str(v.name) for v in program.variables]
    sign = signature(next((made(tmp_path, defensive=False), tmp_path)[1].glob("c/*.json")))
    for executor in made(tmp_path, defensive=False):
        level = RunningLevel("top", sign, sign.levels[0], executor, (), (), ())
        level.run()
        kept = level.values
        for change, said in (
            ({"n": 150, "hold": False}, "invariant `below` does not hold"),
            ({"n": -4}, "`n` = -4"),
            ({"pairs[1].two": nan}, "`pairs[1].two` = nan"),
            ({"kept[1]": 9}, "`kept[1]` = 9"),
        ):
            state = initial(program) | change
            bad = (*(state[name] for name in names), *kept[len(names) :])
            with pytest.raises(BadState, match=re.escape(said)):
                level.restore(bad)
            with pytest.raises(BadState, match=re.escape(said)):
                restart(level, CommonMemory(), bad)
            assert executor.values() == level.values == kept
        level.restore(kept)
        assert executor.values()[: len(names)] == kept[: len(names)]

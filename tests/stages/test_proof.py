"""The proof of several tables in a cycle, against enumeration: what is called proved holds in every state that cycles reach."""

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.obligations import Sort, unstated
from rcsc.compose.contract.properties import property_kept
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.proof.level import Verdict, prove_level
from rcsc.lang.interpret import Fault, cycle, initial
from rcsc.lang.model import Kind, Scalar, Value, key_bounds, value_of_key
from tests.support.programs.systems import (
    LITTLE,
    TICK,
    TURNS,
    WAY,
    alone,
    lower_level,
    proved_level,
    small_level,
)
from tests.support.programs.texts import edited
from tests.support.proved import obligation_of, shortest

KINDS = {
    "i": ("false", "true"),
    "j": ("false", "true"),
    "a": ("low", "mid", "top"),
    "b": ("low", "mid", "top"),
    "c": ("false", "true"),
}
INPUTS, STATES = "ij", "abc"


def drawn(random: Random) -> str:
    """A program of three tables, each of one state; now and then with a gap or an overlap."""
    order = random.sample(STATES, 3)
    tables = [_table(random, leaf, order[:at], order[at + 1 :]) for at, leaf in enumerate(order)]
    random.shuffle(tables)
    clauses = random.sample([f"table t_{leaf}" for leaf in STATES], 3)
    properties = [
        f"property p{at} : {_claim(random)} implies {_claim(random)} or {_claim(random)}\n" for at in range(4)
    ]
    head = "enum rank { low, mid, top }\ninput i : bool\ninput j : bool\nstate a : rank\nstate b : rank\nstate c : bool\n"
    return f"{head}{''.join(tables)}level l {{ {' '.join(clauses)} }}\n{''.join(properties)}"


def _table(random: Random, leaf: str, before: list[str], after: list[str]) -> str:
    """A table that reads inputs, its own leaf, what tables before it write, and what those after it wrote in the cycle before."""
    names = [*INPUTS, leaf, *before, *(f"was {other}" for other in after)]
    read = random.sample(names, random.choice((1, 2, 2)))
    rows = [
        f"| r{at} | {' | '.join(cells)} || {random.choice(KINDS[leaf])} |\n"
        for at, cells in enumerate(product(*(KINDS[name[-1]] for name in read)))
    ]
    if random.random() < 0.15:
        del rows[random.randrange(len(rows))]
    if random.random() < 0.1:
        rows.append(f"| again |{rows[0].split('|', 2)[2]}")
    return f"table t_{leaf} {{\n| line | {' | '.join(read)} || {leaf} |\n{''.join(rows)}}}\n"


def _claim(random: Random) -> str:
    leaf = random.choice([*STATES, *(f"was {name}" for name in STATES)])
    value = random.choice(KINDS[leaf[-1]])
    return f"{leaf} {random.choice(('=', '/='))} {value}"


def reached(ts: TransitionSystem) -> tuple[set[str], set[tuple[Fault, str]]]:
    """The properties that some cycle from a reachable state breaks, and the faults that end one, with the table's name."""
    program = ts.program
    inputs = [v for v in program.variables if v.kind is Kind.INPUT]
    names = [str(v.name) for v in program.variables if v.kind is not Kind.INPUT]
    waiting: list[dict[str, Value]] = [initial(program)]
    seen, broken, faults = set[tuple[Value, ...]](), set[str](), set[tuple[Fault, str]]()
    while waiting:
        before = waiting.pop()
        for given in product(*(range(*_ends(v.type)) for v in inputs)):
            taken = {str(v.name): value_of_key(v.type, key) for v, key in zip(inputs, given, strict=True)}
            outcome = cycle(program, ts.level, {**before, **taken})
            if outcome.fault is not Fault.OK:
                faults.add((outcome.fault, outcome.fault_at or str(ts.level.tables.names[0])))
                continue
            after = outcome.snapshot
            broken |= {
                each.name for each in program.properties if not property_kept(ts, each.name, before, after)
            }
            key = tuple(after[name] for name in names)
            if key not in seen:
                seen.add(key)
                waiting.append(after)
    return broken, faults


def _ends(kind: Scalar) -> tuple[int, int]:
    low, high = key_bounds(kind)
    return low, high + 1


def owed(ts: TransitionSystem) -> Iterator[tuple[Sort, str, str, bool]]:
    """What a level owes of its tables and properties, and whether enumeration breaks it."""
    broken, faults = reached(ts)
    for name in ts.level.table_names:
        yield Sort.SOME_LINE, str(name), "", (Fault.NO_LINE, name) in faults
        yield Sort.ONE_LINE, str(name), "", (Fault.SEVERAL_LINES, name) in faults
    for stated in ts.program.properties:
        yield Sort.PROPERTY, "", stated.name, stated.name in broken


@pytest.mark.parametrize("seed", range(24))
def test_what_is_proved_holds_in_all_that_cycles_reach_and_what_is_not_has_its_run(seed: int) -> None:
    """Where a cycle can end in a fault the proof goes on with states after it, and may show less."""
    ts = alone(drawn(Random(seed)))  # noqa: S311  # by seed
    proof = prove_level(ts, LITTLE)
    every = list(owed(ts))
    faulted = any(breaks for sort, _, _, breaks in every if sort is not Sort.PROPERTY)
    for sort, table, name, breaks in every:
        verdict = proof.verdict(sort, table, name)
        assert breaks <= (verdict is not Verdict.PROVED), (sort, table, name, verdict)
        assert faulted or breaks == (verdict is not Verdict.PROVED), (sort, table, name, verdict)
        if breaks:
            assert shortest(ts, obligation_of(ts, sort, table, name)) is not None
        elif verdict is Verdict.NOT_PROVED:
            assert shortest(ts, obligation_of(ts, sort, table, name)) is None


OWN = """input water : int 0 .. 9
input asked : bool
state level : int 0 .. 9
state full : bool
output lamp : bool
assume low assumed : level <= {bound}
assume calm assumed : abs(water - was water) <= 2
table take assuming calm {
  | line | water || level  |
  | rest | < 7   || water  |
  | much | >= 7  || 7      |
}
table tell assuming low {
  | line | level || full  |
  | yes  | 7     || true  |
  | no   | < 7   || false |
}
table show {
  | line | full  | asked || lamp  |
  | on   | true  | true  || true  |
  | off1 | false |       || false |
  | off2 | true  | false || false |
}
level l { table show table tell table take }
"""


@pytest.mark.parametrize(("bound", "verdict"), [(7, Verdict.PROVED), (6, Verdict.NOT_PROVED)])
def test_an_assumption_about_what_another_table_wrote_is_proved_at_its_place_and_never_trusted(
    bound: int, verdict: Verdict
) -> None:
    ts = alone(OWN.replace("{bound}", str(bound)))
    proof = prove_level(ts, LITTLE)
    assert proof.verdict(Sort.ASSUMPTION, "tell", "low") is verdict
    assert proof.verdict(Sort.ASSUMPTION, "take", "calm") is Verdict.TRUSTED
    trace = shortest(ts, obligation_of(ts, Sort.ASSUMPTION, "tell", "low"))
    if verdict is Verdict.PROVED:
        assert trace is None
        return
    assert trace is not None
    step = trace.steps[-1]
    assert [(stage.table, stage.line, stage.failed) for stage in step.stages] == [
        ("take", "much", ()),
        ("tell", "yes", ("low",)),
    ]
    assert (step.table, step.failed) == ("show", ())


LAMP = """output lamp : bool
table shine {{
  | line | {0}    || lamp  |
  | lit  | true  || true  |
  | dark | false || false |
}}
level lower {{"""
SEES = """table sees {
  | line | tick  || on    |
  | yes  | true  || true  |
  | no   | false || false |
}
level lower {"""
TICKING = {
    "ends": lower_level(*WAY, **TICK),
    "turns": lower_level(*TURNS, **TICK),
    "waits": lower_level(WAY[0], **TICK),
}


def with_table(text: str, table: str, name: str) -> str:
    return edited(
        text, ("level lower {", table), ("  table by command", f"  table {name}\n  table by command")
    )


def verdicts(folder: Path, text: str) -> tuple[object, ...]:
    """All that is shown of a level that takes orders, but for its further table and where the same is computed."""
    ts, proof = proved_level(folder, "lower", lower=text)
    owed = {
        obligation.key: verdict
        for obligation, verdict in proof.verdicts
        if obligation.table not in {"sees", "shine"}
    }
    ends = [(ending.table, ending.proved) for ending in proof.endings]
    return owed, ends, unstated(ts), proof.context is None


@pytest.mark.parametrize("kind", TICKING)
def test_a_table_before_those_of_the_commands_is_to_the_protocol_as_a_preprocess(
    kind: str, tmp_path: Path
) -> None:
    text = TICKING[kind]
    staged = with_table(edited(text, ("\n  on := tick", "")), SEES, "sees")
    assert verdicts(tmp_path, staged) == verdicts(tmp_path, text)
    assert verdicts(tmp_path, with_table(text, LAMP.format("on"), "shine")) == verdicts(tmp_path, text)


def test_a_level_whose_last_table_is_not_of_its_commands_is_not_called_whole(tmp_path: Path) -> None:
    """Which of several tables answers a command is not known: nothing is claimed of it."""
    text = with_table(lower_level(*WAY), LAMP.format("new_command"), "shine")
    late = edited(text, ("| new_command    ||", "| status_report = done ||"))
    ts = small_level(tmp_path, "lower", lower=late)
    assert ts.level.staged == ("pause", "go")
    [missing] = [each for each in unstated(ts) if each.sort is Sort.PROTOCOL]
    assert missing.applies
    assert "`shine`" in missing.missing

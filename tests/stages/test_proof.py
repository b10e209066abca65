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
from tests.support.programs.systems import LITTLE, WAY, alone, lower_level, small_level
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
table shine {
  | line | on    || lamp  |
  | lit  | true  || true  |
  | dark | false || false |
}
level lower {"""


def test_a_level_that_takes_orders_is_not_called_whole(tmp_path: Path) -> None:
    """Which of several tables answers a command is not known: nothing is claimed of it."""
    text = lower_level(*WAY)
    assert not any(
        each.sort is Sort.PROTOCOL for each in unstated(small_level(tmp_path, "lower", lower=text))
    )
    several = edited(
        text, ("level lower {", LAMP), ("  table by command", "  table shine\n  table by command")
    )
    every = [each for each in unstated(small_level(tmp_path, "lower", lower=several)) if each.applies]
    [missing] = [each for each in every if each.sort is Sort.PROTOCOL]
    assert "`shine`" in missing.missing

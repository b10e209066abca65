"""What can happen to a level is stated once, and each room that has an idea of it has that one."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from rcsc.compose.contract.environment import Links
from rcsc.compose.contract.properties import properties
from rcsc.compose.contract.transition import REFUSED, Cycle, TransitionSystem
from rcsc.lang.interpret import Fault, answering, cycle, initial
from rcsc.lang.model import Kind, Value, key_bounds
from rcsc.lang.protocol.environment import EARLY, ENVIRONMENT, Event, Kept, refusable, unadmitted
from rcsc.lang.restart import NUMBERED, After, Fixed, SameAs
from rcsc.proof.symbolic import values
from rcsc.run.episodes.episode import FAULTS
from rcsc.run.signature import FAULTS as FAULT_NAMES
from tests.support.programs.stages import program_of

MANUAL = Path(__file__).parents[2] / "grammar" / "manual.md"
OF_THE_PROOF = {Fault.NO_LINE, Fault.SEVERAL_LINES}
"""Faults that proofs exclude."""
OF_AN_EXECUTOR = {Fault.STATE, Fault.ARITHMETIC}
"""Faults of a state that no cycle left, and of another machine: nothing that happens to a level."""

TEXT = """record hand { turns : bool safe true  at : int 0 .. 9 }
input guard : bool
input x : int 0 .. 9
input wide : int 0 .. 90 clamp
output shown : int 0 .. 9 safe 7
output bare : int 0 .. 9
output hand : hand
state kept : int 0 .. 9
state late : int 0 .. 9 deferred until x > 3
output got : int 0 .. 9
extern procedure ask writes got python "outside:ask" c "ask"
procedure begin { kept := 1; bare := 2; next late := 5 }
table t {
  | line | when || procedures  | shown | bare | hand.turns |
  |------|------||-------------|-------|------|------------|
  | all  | true || ask         | 3     | 4    | false      |
}
level solo { period 40 [ms] preprocess begin table t }
"""


def test_every_fault_is_an_event_or_is_excluded_by_a_proof_or_by_an_executor() -> None:
    assert set(ENVIRONMENT) == set(Event)
    assert EARLY | OF_THE_PROOF | OF_AN_EXECUTOR | {Fault.OK} == set(Fault)
    assert not EARLY & (OF_THE_PROOF | OF_AN_EXECUTOR)
    assert len(FAULT_NAMES) == len(Fault)


def test_the_manual_has_the_same_table() -> None:
    text = MANUAL.read_text(encoding="utf-8")
    shown = text[text.index("## What can happen to a level") :].split("\n\n")[1].splitlines()
    rows = [
        f"{event} | {left.inputs} | {left.state} | {left.pending} | {left.outputs} | {left.echo}"
        for event, left in ENVIRONMENT.items()
    ]
    assert shown[2:] == [f"| {row} |" for row in rows]


def test_episodes_make_what_they_are_said_to_make() -> None:
    """What the tables' own procedures and assumptions do comes by itself; a process alone goes on from a checkpoint."""
    made = {"refused": Event.INPUT_REFUSED, "restarted": Event.BEGUN_ANEW}
    assert set(made) <= set(FAULTS)
    by_itself = {Event.RUNS, Event.EXTERN_REFUSED, Event.ASSUMPTION_FAILS, Event.RESUMED}
    assert set(Event) - set(made.values()) == by_itself


OUTSIDE = {Event.RUNS: (5, 6), Event.INPUT_REFUSED: (10, 6), Event.EXTERN_REFUSED: (5, 10)}
"""For each event the input `x`, and what the extern procedure gives."""


def left_by(
    event: Event,
) -> tuple[TransitionSystem, dict[str, Value], Mapping[str, Value], Mapping[str, Value]]:
    """Return a level, a state, what came, and what the interpreter leaves."""
    program = program_of(TEXT)
    [level] = program.levels
    inputs = tuple(str(v.name) for v in program.variables if v.kind is Kind.INPUT)
    ts = TransitionSystem(program, level, Links(level.name, None, (), (), inputs))
    x, answer = OUTSIDE[event]
    before: dict[str, Value] = {
        **initial(program),
        "late.next": 8,
        "shown": 2,
        "bare": 1,
        "got": 2,
        "hand.turns": False,
    }
    came: dict[str, Value] = {"guard": True, "x": x, "wide": 99}
    with answering(lambda *_: (answer,)):
        outcome = cycle(program, level, {**before, **came})
    assert outcome.fault is ENVIRONMENT[event].fault
    return ts, before, came, outcome.snapshot


@pytest.mark.parametrize("event", OUTSIDE)
def test_the_interpreter_leaves_what_is_said(event: Event) -> None:
    _, before, came, after = left_by(event)
    wrote = {"kept": 1, "late": 8, "late.next": 5, "shown": 3, "bare": 4, "got": 6, "hand.turns": False}
    so_far = {"kept": 1, "late": 8, "late.next": 5, "bare": 2, "got": 2, "hand.turns": False}
    safe = {"shown": 7, "hand.turns": True}
    was = {name: before[name] for name in wrote}
    meant = {
        Kept.TAKEN: {**came, "wide": 90},
        Kept.AS_THEY_CAME: came,
        Kept.AS_BEFORE: was,
        Kept.WRITTEN: wrote,
        Kept.SO_FAR: so_far,
        Kept.SAFE: so_far | safe,
        Kept.SAFE_OR_BEFORE: was | safe,
    }
    left = ENVIRONMENT[event]
    parts = {
        left.inputs: ("guard", "x", "wide"),
        left.state: ("kept", "late"),
        left.pending: ("late.next",),
        left.outputs: ("shown", "bare", "got", "hand.turns"),
    }
    assert {name: after[name] for names in parts.values() for name in names} == {
        name: meant[how][name] for how, names in parts.items() for name in names
    }


FREE_OF_RESULTS = {"kept", "late", "late.next"}
"""What does not depend on the extern procedure, whose result and refusal are free in a proof."""


@pytest.mark.parametrize("event", OUTSIDE)
def test_a_cycle_of_the_proof_leaves_what_the_interpreter_does(event: Event) -> None:
    """But for the inputs: before the next cycle they are as last taken, which is what the contract speaks of."""
    ts, before, came, after = left_by(event)
    start = {name: values.constant(kind, before.get(name, 0)) for name, kind in ts.kinds.items()}
    admitted = {**came, "wide": 90, "x": min(int(came["x"]), 9)}
    taken = {name: values.constant(ts.kinds[name], value) for name, value in admitted.items()}
    made: Cycle = ts.cycle(start, taken=taken)
    if event is Event.INPUT_REFUSED:
        made = ts._or_refused(made, values.TRUE)  # as its free variable would choose
        assert made.refused is values.TRUE
        assert made.cases[-1] is values.TRUE
    for name in ts.kinds:
        node = made.after[name]
        if ts.program.variable(name).kind is Kind.INPUT:
            assert node is (start if event is Event.INPUT_REFUSED else taken)[name]
        elif event is Event.INPUT_REFUSED or name in FREE_OF_RESULTS:
            assert (node.known, node.low) == (True, after[name]), name


def test_what_can_be_refused_is_what_a_buffer_can_hold_beside_the_range() -> None:
    whole = """input b : bool
input full : int 0 .. 255
input signed : int -128 .. 127
input half : int 0 .. 127
input low : int 0 .. 9 clamp
input r : real 0.0 .. 1.0 clamp
input wide : int -9223372036854775808 .. 9223372036854775807
enum e { one, two }
input c : e
output b2 : int 0 .. 1
table t {
  | line | b     || b2 |
  |------|-------||----|
  | a    | true  || 1  |
  | n    | false || 0  |
}
"""
    assert [str(v.name) for v in program_of(whole).variables if v.kind is Kind.INPUT and refusable(v)] == [
        "half",
        "r",
        "c",
    ]


LOOKS_BACK = """input x : int 0 .. 9
input y : int 0 .. 9
output o : int 0 .. 9
property ranged : x <= 9
property back : was x <= 9
property same : o = 3
table t {
  | line | when || o |
  |------|------||---|
  | all  | true || 3 |
}
level solo { period 40 [ms] table t }
"""


def test_a_refused_input_stands_outside_its_range_for_what_looks_at_it() -> None:
    """In its cycle, and one later for what looks back; so neither is true for being so of the range."""
    program = program_of(LOOKS_BACK)
    [level] = program.levels
    ts = TransitionSystem(program, level, Links(level.name, None, (), (), ("x", "y")))
    assert REFUSED in ts.kinds
    made = ts.refusing().cycle(ts.havoc())
    holds = {stated.name: node for stated, node in properties(program, made)}
    assert holds["ranged"] is not values.TRUE
    assert holds["back"] is not values.TRUE
    plain = {stated.name: node for stated, node in properties(program, ts.cycle(ts.havoc()))}
    assert plain["ranged"] is values.TRUE
    assert plain["back"] is values.TRUE


BY_HAND = """input command : order
input arm : report
output to_arm : order
state inc_command_seen : {0} = 2
record order {{ inc_command : {0} = 2  input_command : {0} = 2 }}
record report {{ inc_command_echo : {0} = 2 }}
"""


@pytest.mark.parametrize(
    "kind", ["int 0 .. 65535", "int 0 .. 9", "int 2 .. 90000", "int -5 .. 5", "int 0 .. 90000"]
)
def test_a_level_begins_anew_in_its_ranges_whatever_its_numbers_are(kind: str) -> None:
    """Numbers that are counted on go round in one range; what stands in an input may be refused, and is taken over where it cannot be."""
    program = program_of(BY_HAND.format(kind))
    kinds = {str(variable.name): variable for variable in program.variables}
    bounds = {name: key_bounds(variable.type) for name, variable in kinds.items()}
    for leaf, adopted in program.adopted.items():
        low, high = bounds[leaf]
        match adopted:
            case Fixed(value):
                assert low <= value <= high, leaf
            case After(echo):
                assert {bounds[leaf], bounds[echo]} == {NUMBERED}
            case SameAs(other):
                assert not unadmitted(kinds[other]), leaf
                assert bounds[other] == bounds[leaf]
    counted = {leaf for leaf, adopted in program.adopted.items() if isinstance(adopted, After | SameAs)}
    assert counted == ({"to_arm.inc_command", "inc_command_seen"} if kind == "int 0 .. 65535" else set())

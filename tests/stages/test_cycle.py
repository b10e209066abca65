"""Several tables in a level's cycle: their order, what each sees, which line each ran, and what ends a cycle between them."""

from collections.abc import Callable
from dataclasses import replace
from itertools import permutations, product
from random import Random

import pytest

from rcsc.base.host.tools import c_compiler
from rcsc.code.testing.agree import AgreementCount, run_session
from rcsc.code.testing.executors.sessions import Stimuli
from rcsc.lang.interpret import Fault, call, chosen_table, cycle, initial, run_stage, run_table, settle
from rcsc.lang.model import Enum, Kind, Program, Value
from tests.emit.test_agreement import executors_of, found_of
from tests.stages.test_proof import drawn
from tests.support.programs.stages import errors, program_of, proved_of, refused, verdict_of
from tests.support.programs.texts import edited

CLAUSES = ("  table inject\n", "  table press\n", "  table override\n")
REACTOR = """enum pressure_state { too_low, normal, high }
input water : int 0 .. 20
input reset : bool
input block : bool
state pressure : pressure_state
state overridden : bool
output injection : bool

table inject {
  | line | pressure   | overridden || injection |
  | over | too_low    | true       || false     |
  | on   | too_low    | false      || true      |
  | off  | /= too_low |            || false     |
}
table override {
  | line  | @T(pressure = high) | pressure | reset | block || overridden |
  | clear | true                |          |       |       || false      |
  | again | false               | too_low  | true  |       || false      |
  | block | false               | too_low  | false | true  || true       |
  | stays | DEFAULT             |          |       |       || overridden |
}
table press {
  | line  | pressure | water  || pressure |
  | up    | too_low  | >= 9   || normal   |
  | top   | normal   | >= 10  || high     |
  | down  | normal   | < 9    || too_low  |
  | under | high     | < 10   || normal   |
  | stays | DEFAULT  |        || pressure |
}
level reactor {
  table inject
  table press
  table override
}
"""


def by_hand(water: int, reset: bool, block: bool, pressure: int, overridden: bool) -> dict[str, Value | str]:
    """The reactor's cycle, written without a table: pressure, then the override, then the injection."""
    steps = {
        (0, water >= 9): (1, "up"),
        (1, water >= 10): (2, "top"),
        (1, water < 9): (0, "down"),
        (2, water < 10): (1, "under"),
    }
    new, press = steps.get((pressure, True), (pressure, "stays"))
    if new == 2 and pressure != 2:
        over, override = False, "clear"
    elif new == 0 and reset:
        over, override = False, "again"
    elif new == 0 and block:
        over, override = True, "block"
    else:
        over, override = overridden, "stays"
    inject = "off" if new else "over" if over else "on"
    lines = {"press": press, "override": override, "inject": inject}
    return {"pressure": new, "overridden": over, "injection": inject == "on", **lines}


def lines_of(program: Program, left: dict[str, Value]) -> dict[str, str]:
    """The line of each table that ran before the last, by table; what did not run is left out."""
    told = {}
    for table, leaf in program.line_leaves.items():
        kind = program.variable(leaf).type
        assert isinstance(kind, Enum)
        told[str(table)] = kind.members[int(left[leaf])]
    return {table: line for table, line in told.items() if line != "none"}


def test_each_table_sees_what_those_before_it_left() -> None:
    program = proved_of(REACTOR)
    assert program.levels[0].table_names == ("press", "override", "inject")
    flags, lows = (False, True), (0, 8, 9, 10, 20)
    for water, pressure, reset, block, overridden in product(lows, range(3), flags, flags, flags):
        now = initial(program) | {"water": water, "reset": reset, "block": block}
        now |= {"pressure": pressure, "overridden": overridden, "was_pressure": pressure}
        outcome = cycle(program, program.levels[0], now)
        seen: dict[str, Value | str] = {
            name: outcome.snapshot[name] for name in ("pressure", "overridden", "injection")
        }
        lines = {**lines_of(program, outcome.snapshot), "inject": str(outcome.line)}
        assert {**seen, **lines} == by_hand(water, bool(reset), bool(block), pressure, bool(overridden))


@pytest.mark.parametrize("order", list(permutations(CLAUSES)))
def test_the_order_of_the_clauses_means_nothing(order: tuple[str, ...]) -> None:
    assert program_of(edited(REACTOR, ("".join(CLAUSES), "".join(order)))) == program_of(REACTOR)


def test_tables_that_do_not_touch_each_other_run_as_they_are_declared() -> None:
    rows = "  | line | go    || {0}    |\n  | on   | true  || true  |\n  | off  | false || false |\n"
    text = "".join(f"output {name} : bool\ntable {name}_table {{\n{rows.format(name)}}}\n" for name in "bac")
    level = "level l {\n  table c_table\n  table b_table\n  table a_table\n}\n"
    program = program_of(f"input go : bool\n{text}{level}")
    assert program.levels[0].table_names == ("b_table", "a_table", "c_table")


THREE = """input pulse : bool
state a : int 0 .. 9
state b : int 0 .. 9
state c : int 0 .. 9
procedure more { a := c }
assume small : b < 5
table first {
  | line | pulse || procedures |
  | on   | true  || more       |
  | off  | false ||            |
}
table second {
  | line | a    || b |
  | one  | 0    || 1 |
  | two  | /= 0 || 2 |
}
table third assuming small {
  | line | pulse || c |
  | on   | true  || 1 |
  | off  | false || 2 |
}
level l { table first table second table third }
"""


def test_a_circle_is_told_with_its_tables_and_variables() -> None:
    [message] = [finding.message for finding in refused(THREE)]
    assert "`first` reads `c`, which `third` writes" in message  # in a procedure
    assert "`third` reads `b`, which `second` writes" in message  # in an assumption
    assert "`second` reads `a`, which `first` writes" in message
    mended = program_of(edited(THREE, ("a := c }", "a := was c }")))
    assert mended.levels[0].table_names == ("first", "second", "third")


def test_a_circle_beside_others_is_told_alone() -> None:
    more = "output d : bool\ntable last {\n  | line | b    || d |\n  | one  | 0    || true |\n  | two  | /= 0 || false |\n}\n"
    text = edited(THREE, ("level l {", f"{more}level l {{ table last"))
    [message] = [finding.message for finding in refused(text)]
    assert "`first`" in message
    assert "`last`" not in message


CHOICE = """enum mode { manual, automatic }
input hand : int 0 .. 9
input asked : mode
input quiet : bool
state now : mode
state speed : int 0 .. 9
output lamp : bool
output horn : bool safe true
assume slow monitored : hand /= 7
assume heard : speed /= 4 or now = manual
extern procedure measured reads hand writes speed python "tests.support:nothing" c "measured"

table take {
  | line | asked     || now       |
  | man  | manual    || manual    |
  | auto | automatic || automatic |
}
table by_hand assuming slow {
  | line | hand            || speed |
  | low  | < 5             || hand  |
  | high | in {5, 6, 8, 9} || 5     |
}
table by_itself {
  | line | hand || procedures |
  | all  | >= 0 || measured   |
}
table light {
  | line | speed || lamp  |
  | on   | > 3   || true  |
  | off  | <= 3  || false |
}
table sound assuming heard {
  | line | speed | now       | quiet || horn  |
  | no   |       | manual    |       || false |
  | yes  | > 4   | automatic | false || true  |
  | shh  | > 4   | automatic | true  || false |
  | low  | < 4   | automatic |       || false |
}
level l {
  table sound
  table light
  table by now { manual : by_hand automatic : by_itself }
  table take
}
"""


def test_a_choice_by_a_value_of_the_same_cycle_runs_before_those_that_read_what_it_writes() -> None:
    verdict = verdict_of(CHOICE)
    assert not errors(verdict.findings)
    program = proved_of(CHOICE)
    assert program.levels[0].table_names == ("take", "by_hand", "by_itself", "light", "sound")
    now = initial(program) | {"asked": 0, "hand": 3}
    outcome = cycle(program, program.levels[0], now)
    assert lines_of(program, outcome.snapshot) == {"take": "man", "by_hand": "low", "light": "off"}
    assert outcome.line == "no"


def test_a_table_without_its_line_ends_the_cycle_by_its_name() -> None:
    """An assumption that fails leaves a table without a line: those before it have run, those after it have not."""
    program = proved_of(CHOICE)
    outcome = cycle(program, program.levels[0], initial(program) | {"asked": 0, "hand": 7, "speed": 2})
    assert (outcome.fault, outcome.fault_at, outcome.line) == (Fault.NO_LINE, "by_hand", None)
    assert outcome.failed_assumptions == ("slow",)
    assert lines_of(program, outcome.snapshot) == {"take": "man"}
    assert outcome.snapshot["horn"] is True  # its safe value


def test_no_line_is_kept_from_the_cycle_before() -> None:
    program = proved_of(CHOICE)
    first = cycle(program, program.levels[0], initial(program) | {"hand": 3})
    later = cycle(program, program.levels[0], first.snapshot | {"hand": 7})
    assert lines_of(program, later.snapshot) == {"take": "man"}
    alone = run_table(program, program.tables[0], first.snapshot | {"asked": 1})
    assert lines_of(program, alone.snapshot) == {"take": "auto"}


def several(program: Program) -> Program:
    """The program with a line of its override that matches as another does."""
    table = next(table for table in program.tables if table.name == "override")
    doubled = replace(table, lines=(*table.lines, table.lines[0]))
    return replace(program, tables=tuple(doubled if each is table else each for each in program.tables))


def test_two_lines_of_one_before_the_last_end_the_cycle_by_its_name() -> None:
    program = several(proved_of(REACTOR))
    now = initial(program) | {"pressure": 1, "water": 20, "was_pressure": 1}
    outcome = cycle(program, program.levels[0], now)
    assert (outcome.fault, outcome.fault_at) == (Fault.SEVERAL_LINES, "override")


STOPPED = """input d : int -2 .. 2
input more : bool
state share : int -9 .. 9
output many : bool safe false
assume nonzero monitored : d /= 0
table split assuming nonzero {
  | line | more  || share |
  | nine | true  || 9 / d |
  | four | false || 4 / d |
}
table tell {
  | line | share || many  |
  | yes  | > 3   || true  |
  | no   | <= 3  || false |
}
level l { table tell table split }
"""


def test_an_assumption_on_which_a_table_before_the_last_rests_ends_the_cycle_there() -> None:
    program = proved_of(STOPPED)
    assert program.tables[0].stops == ("nonzero",)
    outcome = cycle(program, program.levels[0], initial(program) | {"d": 0, "share": 9, "many": True})
    assert (outcome.fault, outcome.fault_at, outcome.line) == (Fault.ASSUMPTION, "nonzero", None)
    assert lines_of(program, outcome.snapshot) == {}
    assert (outcome.snapshot["share"], outcome.snapshot["many"]) == (9, False)


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
@pytest.mark.parametrize("seed", range(4))
def test_the_executors_agree_where_tables_have_gaps_and_overlaps(seed: int) -> None:
    program = program_of(drawn(Random(seed)))  # noqa: S311  # by seed
    compared = AgreementCount()
    with executors_of(program) as executors:
        assert list(found_of(executors, compared, 30, "cycle")) == []
    assert compared.cycles > 30


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
@pytest.mark.parametrize("text", [REACTOR, CHOICE, STOPPED], ids=["reactor", "choice", "stopped"])
def test_the_executors_run_the_tables_in_the_same_order(text: str) -> None:
    compared = AgreementCount()
    with executors_of(proved_of(text)) as executors:
        assert list(found_of(executors, compared, 60)) == []
    assert compared.cycles > 60


def swapped(c: str) -> str:
    """The C with two tables of a cycle in the wrong order."""
    head, mark, cycle_ = c.rpartition("reactor_cycle(")
    other = cycle_.replace("run_press(", "run_?(").replace("run_override(", "run_press(")
    return f"{head}{mark}{other.replace('run_?(', 'run_override(')}"


def unkept(c: str) -> str:
    """The C that keeps the line of the cycle before where a table did not run."""
    return c.replace("s->line_of_by_hand = CASE__LINE_OF_BY_HAND_NONE;", "", 1)


def unnamed(c: str) -> str:
    """The C that names another table in its fault."""
    return edited(c, ("s->fault_at = CASE__TABLE_BY_HAND;", "s->fault_at = 0;"))


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
def test_python_and_c_name_the_table_that_has_no_line() -> None:
    program = proved_of(CHOICE)
    start = initial(program)
    readings = tuple({**inputs_of(program), "hand": hand} for hand in (3, 7, 3))
    compared = AgreementCount()
    with executors_of(program) as executors:
        target = next(target for target in executors.targets if target.kind == "cycle")
        assert run_session(executors, target, Stimuli(start, readings), compared) is None
    assert compared.faults == {Fault.OK: 2, Fault.NO_LINE: 1}
    with executors_of(program, c=unnamed) as executors:
        wrong = run_session(executors, target, Stimuli(start, readings), AgreementCount())
    assert wrong is not None
    assert wrong.cycle == 2
    assert wrong.words == ("fault at 'take' where 'by_hand' is right",)


def inputs_of(program: Program) -> dict[str, Value]:
    return {str(v.name): v.initial for v in program.variables if v.kind is Kind.INPUT}


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
@pytest.mark.parametrize(("text", "planted"), [(REACTOR, swapped), (CHOICE, unkept)], ids=["order", "kept"])
def test_a_planted_fault_in_the_cycle_is_found(text: str, planted: Callable[[str], str]) -> None:
    with executors_of(proved_of(text), c=planted) as executors:
        assert list(found_of(executors, AgreementCount(), 60, "cycle"))


def test_lines_that_are_called_by_numbers_have_members_that_can_be_written() -> None:
    """`1 = 1` cannot be loaded as Python, nor be told from a number in a property."""
    text = (
        "input x : bool\nstate m : bool\noutput y : bool\nproperty p : line_of_first = line_1_2 implies m\n"
        "table first {\n| line | x || m |\n| 1 | true || true |\n| line_1 | false || false |\n}\n"
        "table second {\n| line | m || y |\n| 1 | true || true |\n| 2 | false || false |\n}\n"
        "level a { period 40 [ms] table first table second }\n"
    )
    program = proved_of(text)
    kind = program.variable("line_of_first").type
    assert isinstance(kind, Enum)
    assert kind.members == ("none", "line_1_2", "line_1")
    with executors_of(program) as executors:
        assert list(found_of(executors, AgreementCount(), 20)) == []


@pytest.mark.parametrize(
    ("water", "pressure", "overridden"), list(product((5, 9, 15), range(3), (False, True)))
)
def test_one_table_after_the_other_leaves_what_the_cycle_does(
    water: int, pressure: int, overridden: bool
) -> None:
    program = program_of(REACTOR)
    [level] = program.levels
    start = {
        **initial(program),
        "water": water,
        "pressure": pressure,
        "overridden": overridden,
        "reset": True,
    }
    now = dict(start)
    settle(program, now)
    for name in level.preprocess:
        call(program, name, [], now)
    for choice in level.choices:
        assert run_stage(program, chosen_table(program, choice, now), now) is Fault.OK
    for name in level.postprocess:
        call(program, name, [], now)
    assert now == cycle(program, level, start).snapshot

"""Faults of state machines that people reported, each as a requirement of one line: the mended table keeps it, the reported one does not.

The oracle is the report, and how many cycles its run has, counted by hand. Only facts are taken from it.
"""

from dataclasses import dataclass

import pytest

from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.counterexample.trace import Trace, TraceSearch, trace_of, traces
from rcsc.compose.exact.played import every_run
from rcsc.compose.proof.level import Verdict, prove_level
from tests.support.programs.systems import LITTLE, alone
from tests.support.programs.texts import edited


@dataclass(frozen=True)
class Report:
    """A report.

    Attributes:
        source: Where it stands.
        text: The mended level.
        fault: What was there instead.
        cycles: Of the shortest run that breaks the requirement.
    """

    source: str
    text: str
    fault: tuple[str, str]
    cycles: int


LEVEL = "level l { period 100 [ms] table t }\n"
REPORTS = {
    "wheels turn as the e-stop is let go": Report(
        "UbiquityRobotics/ubiquity_motor, issue 42",
        """\
input estop : bool
input fresh : bool
input wanted_mm_s : int 0 .. 400 [mm/s] clamp
state kept_mm_s : int 0 .. 400 [mm/s]
output speed_mm_s : int 0 .. 400 [mm/s]
requirement still : from estop until fresh and not estop, always speed_mm_s = 0
table t {
  | line    | estop | fresh || kept_mm_s   | speed_mm_s  |
  |---------|-------|-------||-------------|-------------|
  | stopped | true  |       || 0           | 0           |
  | told    | false | true  || wanted_mm_s | wanted_mm_s |
  | goes_on | false | false ||             | kept_mm_s   |
}
""",
        ("| stopped | true  |       || 0  ", "| stopped | true  |       ||    "),
        3,
    ),
    "cruise control goes on after the reset": Report(
        "farm-ng/tractor, issue 82",
        """\
input estop : bool
input reset : bool
input engage : bool
state latched : bool
state cruises : bool
output drives : bool
requirement asked_anew : from estop until engage and not latched, never drives
table t {
  | line    | estop | latched | reset | engage | cruises || latched | cruises | drives |
  |---------|-------|---------|-------|--------|---------||---------|---------|--------|
  | stop    | true  |         |       |        |         || true    | false   | false  |
  | held    | false | true    | false |        |         ||         |         | false  |
  | reset   | false | true    | true  |        |         || false   |         | false  |
  | engage  | false | false   |       | true   |         ||         | true    | true   |
  | cruises | false | false   |       | false  | true    ||         |         | true   |
  | rests   | false | false   |       | false  | false   ||         |         | false  |
}
""",
        ("|         || true    | false   | false  |", "|         || true    |         | false  |"),
        4,
    ),
    "a timer outlives the state that set it": Report(
        "StoneCypher/jssm, issue 723",
        """\
enum place { a, b }
input go : bool
input back : bool
state now : place
state left : int 0 .. 10
requirement stays : when now = b, for 9 cycles, now = b or back or was now = a
procedure count {
  left := max(left - 1, 0)
}
table t {
  | line  | now | go    | back  | left || procedures | now | left |
  |-------|-----|-------|-------|------||------------|-----|------|
  | rests | a   | false |       |      || count      |     |      |
  | begin | a   | true  |       |      ||            | b   | 10   |
  | waits | b   |       | false | > 1  || count      |     |      |
  | back  | b   |       | true  |      || count      | a   |      |
  | fires | b   |       | false | <= 1 || count      | a   |      |
}
""",
        (
            "| begin | a   | true  |       |      ||            | b   | 10   |",
            ("| begin | a   | true  |       | 0    ||            | b   | 10   |\n"
             "  | again | a   | true  |       | > 0  || count      | b   |      |"),
        ),
        11,
    ),
    "a timed state that runs again ends at once": Report(
        "robotpy/robotpy-wpilib-utilities, pull request 89",
        """\
enum place { idle, timed }
input run : bool
state now : place
state age : int 0 .. 20
requirement lasts : when now = timed, for 19 cycles, now = timed
procedure older {
  age := min(age + 1, 20)
}
table t {
  | line   | now   | run   | age  || procedures | now   | age |
  |--------|-------|-------|------||------------|-------|-----|
  | rests  | idle  | false |      ||            |       |     |
  | begins | idle  | true  |      ||            | timed | 0   |
  | lasts  | timed |       | < 19 || older      |       |     |
  | ends   | timed |       | 19.. 20 ||         | idle  |     |
}
""",
        ("|            | timed | 0   |", "|            | timed |     |"),
        23,
    ),
    "a light is red for a second": Report(
        "LennartHennigs/SimpleFSM, issues 25 and 30",
        """\
enum light { red, green }
input button : bool
state now : light
state age : int 0 .. 60
requirement long_red : when now = red, for 59 cycles, now = red
procedure older {
  age := min(age + 1, 60)
}
table t {
  | line    | now   | age  | button || procedures | now   | age |
  |---------|-------|------|--------||------------|-------|-----|
  | stops   | red   | < 60 |        || older      |       |     |
  | starts  | red   | 60   |        ||            | green | 0   |
  | pressed | green | < 40 | true   ||            | red   | 0   |
  | goes    | green | < 40 | false  || older      |       |     |
  | ends    | green | >= 40 |       ||            | red   | 0   |
}
""",
        (
            "| pressed | green | < 40 | true   ||            | red   | 0   |",
            "| pressed | green | < 40 | true   || older      | red   |     |",
        ),
        122,
    ),
    "a warning makes it hold": Report(
        "PX4/PX4-Autopilot, issue 27554",
        """\
enum action { none, hold, home }
enum mode { as_asked, holds, returns }
input low : bool
input wanted : action
state delay : int 0 .. 50
output mode : mode
requirement warns_only : while wanted = none, never mode = holds
procedure wait {
  delay := max(delay - 1, 0)
}
table t {
  | line   | low   | wanted | delay || procedures | mode     | delay |
  |--------|-------|--------|-------||------------|----------|-------|
  | fine   | false |        |       ||            | as_asked | 50    |
  | warns  | true  | none   |       ||            | as_asked | 50    |
  | delays | true  | /= none | > 0  || wait       | holds    |       |
  | holds  | true  | hold   | 0     ||            | holds    |       |
  | home   | true  | home   | 0     ||            | returns  |       |
}
""",
        (
            "| warns  | true  | none   |       ||            | as_asked | 50    |\n  | delays | true  | /= none | > 0  ||",
            "| warns  | true  | none   | 0     ||            | as_asked |       |\n  | delays | true  |         | > 0  ||",
        ),
        2,
    ),
    "a new path moves the arm before it is enabled": Report(
        "aliasrobotics/RVD, issue 643",
        """\
input estop : bool
input enable : bool
input path : bool
state enabled : bool
output moves : bool
requirement enabled_first : from estop until enable and not estop, never moves
table t {
  | line    | estop | enable | enabled | path  || enabled | moves |
  |---------|-------|--------|---------|-------||---------|-------|
  | stops   | true  |        |         |       || false   | false |
  | enables | false | true   |         |       || true    | false |
  | barred  | false | false  | false   |       ||         | false |
  | moves   | false | false  | true    | true  ||         | true  |
  | rests   | false | false  | true    | false ||         | false |
}
""",
        (
            "| barred  | false | false  | false   |       ||         | false |",
            ("| turns_on | false | false | false   | true  || true    | true  |\n"
             "  | barred  | false | false  | false   | false ||         | false |"),
        ),
        2,
    ),
    "a boost is left on as the failsafe takes over": Report(
        "iNavFlight/inav, issue 4327",
        """\
input failsafe : bool
input holds_place : bool
input fast : bool
output boost : bool
requirement no_boost : while failsafe, never boost
table t {
  | line   | failsafe | holds_place | fast  || boost |
  |--------|----------|-------------|-------||-------|
  | safe   | true     |             |       || false |
  | brakes | false    | true        | true  || true  |
  | slow   | false    | true        | false || false |
  | other  | false    | false       |       || false |
}
""",
        ("| safe   | true     |             |       || false |", "| safe   | true     |             |       ||       |"),
        2,
    ),
    "a flip passes over the lost radio": Report(
        "ArduPilot/ardupilot, issue 110",
        """\
enum mode { flies, flips, lands }
input lost : bool
input flip : bool
input done : bool
state mode : mode
requirement lands : whenever lost, within 10 cycles, mode = lands or not lost
table t {
  | line   | mode  | lost  | flip  | done  || mode  |
  |--------|-------|-------|-------|-------||-------|
  | lost   | flies | true  |       |       || lands |
  | flips  | flies | false | true  |       || flips |
  | flies  | flies | false | false |       ||       |
  | rolls  | flips | false |       | false ||       |
  | gives_up | flips | true |      | false || lands |
  | level  | flips |       |       | true  || flies |
  | lands  | lands | true  |       |       ||       |
  | again  | lands | false |       |       || flies |
}
""",
        (
            "| rolls  | flips | false |       | false ||       |\n  | gives_up | flips | true |      | false || lands |\n",
            "| rolls  | flips |       |       | false ||       |\n",
        ),
        12,
    ),
    "a short boost goes on in a failsafe": Report(
        "d-ronin/dRonin, issue 724",
        """\
input lost : bool
input low : bool
state left : int 0 .. 20
output hangs : bool
requirement short : whenever hangs, within 2 [s], not hangs
procedure count {
  left := max(left - 1, 0)
}
table t {
  | line   | low   | lost  | left || procedures | left | hangs |
  |--------|-------|-------|------||------------|------|-------|
  | high   | false |       |      ||            | 20   | false |
  | hangs  | true  |       | > 0  || count      |      | true  |
  | ends   | true  |       | 0    ||            |      | false |
}
""",
        (
            "| hangs  | true  |       | > 0  || count      |      | true  |",
            ("| hangs  | true  | false | > 0  || count      |      | true  |\n"
             "  | lost   | true  | true  | > 0  ||            |      | true  |"),
        ),
        22,
    ),
    "a timed call goes on after its state": Report(
        "jonblack/arduino-fsm, issue 22",
        """\
enum place { waits, failed }
input timeout : bool
state now : place
state age : int 0 .. 30
output calls : bool
requirement silent : while now = failed, never calls
procedure older {
  age := min(age + 1, 30)
}
table t {
  | line   | now    | timeout | age  || procedures | now    | age | calls |
  |--------|--------|---------|------||------------|--------|-----|-------|
  | waits  | waits  | false   | < 30 || older      |        |     | false |
  | calls  | waits  | false   | 30   ||            |        | 0   | true  |
  | fails  | waits  | true    |      ||            | failed | 0   | false |
  | silent | failed |         |      ||            |        |     | false |
}
""",
        (
            "| silent | failed |         |      ||            |        |     | false |",
            ("| silent | failed |         | < 30 || older      |        |     | false |\n"
             "  | calls_on | failed |       | 30   ||            |        | 0   | true  |"),
        ),
        32,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REPORTS)
def test_a_reported_fault_breaks_its_requirement_and_the_mended_table_keeps_it(name: str) -> None:
    report = REPORTS[name]
    proof = prove_level(alone(report.text + LEVEL), LITTLE)
    assert {verdict for owed, verdict in proof.verdicts if owed.sort is Sort.REQUIREMENT} == {Verdict.PROVED}
    ts = alone(edited(report.text, report.fault) + LEVEL)
    [wanted] = [owed for owed in obligations(ts, ts.cycle(ts.havoc())) if owed.sort is Sort.REQUIREMENT]
    every = every_run(ts, tuple(ts.firsts().values()), [wanted])
    found = (
        trace_of(ts, wanted, every.runs[wanted.key])
        if every
        else traces(ts, [wanted], TraceSearch(12)).get(wanted.key)
    )
    assert isinstance(found, Trace)
    assert len(found.steps) == report.cycles

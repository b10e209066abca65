"""Requirements over time as a text says them, and of a level: proved where no run breaks them, else with the shortest run that does."""

from collections import deque
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path

import pytest

from rcsc.base.diagnostics.source import Source
from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.contract.transition import REFUSED, TransitionSystem
from rcsc.compose.contract.watched import begin, is_ghost, step
from rcsc.compose.counterexample.trace import Trace, TraceSearch, traces
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import Verdict, prove_level
from rcsc.front.commands import run
from rcsc.lang.interpret import Fault, cycle, initial
from rcsc.lang.model import WATCHED, Property, Value
from rcsc.lang.over_time import Watch
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.proof.symbolic import values
from tests.support.programs.stages import program_of, refused
from tests.support.programs.systems import alone, solo_system

LITTLE = Effort(walks=6, cycles=40)

# --- as text ---------------------------------------------------------------------------------

WORDS = """\
input before : bool
input always : bool

state within : bool
state never : bool

## Doc.
requirement last req "R1" : at once before
requirement cycles monitored : while before or always, when within, within 3 cycles, never
# why
requirement at : before always, before within, (never)
requirement once : before always, (never)
requirement when : before always, (never = always and within)
requirement next : only after always, whenever within and never, exactly after 200 [ms], not before
requirement most : between not always and never, always within
requirement from : from always or never until never, always within implies before
requirement until : unless always, until never, within
requirement for : after never, for 2 + 1 cycles, always
requirement once_ : at once once once always and not once (before or always)
requirement since : always before since once not always and ((before since never) since within)
requirement a : after within, at most 2 times in 10 [s], always
requirement b : between before and within, at least 2 + 1 cycles apart, always
requirement c : on for at least 20 [ms], always
requirement d : off for at least 20 [ms], always
requirement e : only after always, (never = within)
requirement f : only after always, only after never, (within)
requirement g : only while always, only after never, (within)
"""


def test_requirements_are_laid_out_and_their_words_are_still_names() -> None:
    laid_out = WORDS.replace("\n# why", "\n\n# why")
    ragged = WORDS.replace(" : ", "   :  ").replace(", ", " ,\n  ")
    for text in (WORDS, ragged):
        parsed = parse(Source("case.rcs", text))
        assert isinstance(parsed, tree.File)
        assert format_file(parsed) == laid_out


LEVEL = """\
input asked : bool
output given : bool
{}
table t {{
  | line | asked || given |
  |------|-------||-------|
  | yes  | true  || true  |
  | no   | false || false |
}}
level l {{ period 10 [ms] table t }}
"""


@pytest.mark.parametrize(
    ("says", "code", "message"),
    [
        (
            "when asked, at last given",
            "RCS323",
            "`at last` without a scope asks for nothing: its interval goes on to the end of the run, and a run need not end",
        ),
        (
            "only before asked, at last given",
            "RCS323",
            "`at last` in `only before` asks for nothing: its interval goes on to the end of the run, and a run need not end",
        ),
        ("within 0 cycles, given", "RCS317", "`0 cycles` is no number of cycles from 1 to 4294967295"),
        (
            "within 3 [ms] cycles, given",
            "RCS317",
            "`3 [ms] cycles` is no number of cycles from 1 to 4294967295",
        ),
        ("within 15 [ms], given", "RCS317", "`15 [ms]` is no whole number of cycles of 10 ms, 1 or more"),
        (
            "only while asked, whenever given, exactly after 65 cycles, given",
            "RCS317",
            "`exactly after` under `only while` and `whenever` takes at most 64 cycles",
        ),
        ("always true", "RCS316", "this is about no variable: it is always so, or never"),
        ("while gone, always given", "RCS201", "no variable, constant or member is called `gone`"),
        ("given since asked, given", "RCS101", None),
        ("given", "RCS101", None),
        ("when asked, given", "RCS101", None),
        ("when asked, while given, always given", "RCS101", None),
    ],
)
def test_what_is_no_requirement_is_told(says: str, code: str, message: str | None) -> None:
    [found] = refused(LEVEL.format(f"requirement wanted : {says}"))
    assert found.code == code
    assert message in {None, found.message}


def test_a_time_is_a_number_of_the_levels_cycles() -> None:
    program = program_of(
        LEVEL.format(
            "requirement a : when asked, within 40 [ms], given\n"
            "requirement b : when asked, within 4 cycles, given"
        )
    )
    first, second = program.properties
    assert first.monitor is not None
    assert [state.type for state in first.monitor.states] == [
        state.type for state in (second.monitor or first.monitor).states
    ]


# --- of a level ------------------------------------------------------------------------------

DOOR = """\
input asked : bool
input near : bool
output given : bool
state waited : int 0 .. 3
state busy : bool
{}
table t {{
  | line | asked | near  | waited || given | waited     | busy  |
  |------|-------|-------|--------||-------|------------|-------|
  | wait | true  |       | < 2    || false | waited + 1 | true  |
  | give | true  |       | >= 2   || true  | 0          | true  |
  | warm | false | true  |        || false | 0          | true  |
  | idle | false | false |        || false | 0          | false |
}}
level l {{ period 10 [ms] table t }}
"""
SAID = (
    "at once not given",
    "when given, next not given",
    "when given, for 1 cycles, given",
    "whenever given, at once busy",
    "whenever asked, at once busy",
    "while asked, within 2 cycles, given",
    "while asked, within 1 cycles, given",
    "while asked, for 1 cycles, not given",
    "while asked, for 2 cycles, not given",
    "while asked, exactly after 2 cycles, given",
    "while asked, exactly after 1 cycles, given",
    "while asked, always busy",
    "unless asked, never given",
    "unless asked, always busy",
    "before asked, never given",
    "before near, never busy",
    "after asked, never busy",
    "after asked, before asked, busy",
    "only while asked, eventually given",
    "only while asked, eventually busy",
    "only before asked, at once near",
    "only after asked, within 2 cycles, busy",
    "only while near, whenever asked, exactly after 2 cycles, given",
    "only while near, when asked, exactly after 3 cycles, given",
    "when asked, until not asked, busy",
    "when asked, until given, not given",
    "when asked, before given, near",
    "when asked, before not busy, asked",
    "between asked and given, never given",
    "between asked and given, within 1 cycles, near",
    "from asked until given, always busy",
    "from given until not asked, always busy",
    "whenever was given, at once not given or near",
    "whenever waited = 2 and asked, at once given",
    "when waited > was waited, within 2 cycles, waited = 0",
    "always given implies asked for 20 [ms]",
    "always given implies asked for 30 [ms]",
    "whenever given, at once asked since not given",
    "always busy or not once near",
    "whenever not busy, at once not (near or was (near and not asked))",
    "at most 1 times in 3 cycles, given",
    "at most 1 times in 4 cycles, given",
    "at most 2 times in 6 cycles, given",
    "at least 2 cycles apart, busy",
    "on for at least 1 cycles, given",
    "on for at least 2 cycles, given",
    "off for at least 2 cycles, given",
    "off for at least 3 cycles, given",
    "only after asked, given",
    "only after near, given",
)


PARTS = 4
"""The requirements are proved in so many parts, each of one level."""


def door(part: int) -> TransitionSystem:
    said = list(enumerate(SAID))[part::PARTS]
    return alone(DOOR.format("\n".join(f"requirement r{at} : {says}" for at, says in said)))


def every_input(ts: TransitionSystem) -> Iterator[dict[str, Value]]:
    for given in product((False, True), repeat=len(ts.inputs)):
        yield dict(zip(ts.inputs, given, strict=True))


def least_broken(ts: TransitionSystem, stated: Property, *, restarts: bool) -> int:
    """Return the number of cycles of the shortest run that breaks a requirement; 0 for none.

    Every state of the level and of the monitor is tried, from the initial values and, where it `restarts`, also from any inputs: no state
    of this level survives a restart.
    """
    watch = Watch(stated)
    begins = [
        dict(initial(ts.program)),
        *({**initial(ts.program), **given} for given in every_input(ts) if restarts),
    ]
    seen, waiting = set[tuple[object, ...]](), deque((begin, dict(watch.state), 0) for begin in begins)
    while waiting:
        before, state, cycles = waiting.popleft()
        for given in every_input(ts):
            outcome = cycle(ts.program, ts.level, {**before, **given})
            assert outcome.fault is Fault.OK
            watch.state = dict(state)
            if not watch.keeps(before, outcome.snapshot):
                return cycles + 1
            key = (*outcome.snapshot.values(), *watch.state.values())
            if key not in seen:
                seen.add(key)
                waiting.append((outcome.snapshot, dict(watch.state), cycles + 1))
    return 0


@pytest.mark.parametrize("part", range(PARTS))
def test_proved_is_what_no_run_breaks_and_what_one_breaks_is_shown_by_the_shortest(part: int) -> None:
    ts = door(part)
    proof = prove_level(ts, LITTLE)
    verdicts = {owed.name: verdict for owed, verdict in proof.verdicts if owed.sort is Sort.REQUIREMENT}
    proved = {name for name, verdict in verdicts.items() if verdict is Verdict.PROVED}
    assert proved == {one.name for one in ts.program.properties if not least_broken(ts, one, restarts=True)}
    wanted = [owed for owed in obligations(ts, ts.cycle(ts.havoc())) if owed.sort is Sort.REQUIREMENT]
    found = traces(ts, wanted, TraceSearch(6))
    lengths = {
        owed.name: len(trace.steps) for owed in wanted if isinstance(trace := found.get(owed.key), Trace)
    }
    least = {one.name: least_broken(ts, one, restarts=False) for one in ts.program.properties}
    assert lengths == {name: cycles for name, cycles in least.items() if cycles}
    assert len(set(least.values())) > 2
    assert 0 < len(proved) < len(least)


def test_monitors_are_stepped_as_nodes_as_they_are_on_a_run() -> None:
    """From every state of a few, for every input: the cycle as nodes leaves the ghosts that the run leaves."""
    ts = door(1)
    now: Mapping[str, Value] = initial(ts.program)
    ghosts = begin(ts.program)
    for at in range(24):
        given = {"asked": bool(at & 5), "near": bool(at & 2)}
        outcome = cycle(ts.program, ts.level, {**now, **given})
        after = step(ts.program, ghosts, now, outcome.snapshot)
        before = {name: _constant(ts, name, {**now, **ghosts}) for name in ts.kinds}
        made = ts.cycle(before, taken={name: _constant(ts, name, given) for name in ts.inputs})
        for name, value in after.items():
            assert is_ghost(name)
            assert (made.after[name].known, int(made.after[name].low)) == (True, int(value)), (at, name)
        now, ghosts = outcome.snapshot, after


def _constant(ts: TransitionSystem, name: str, state: Mapping[str, Value]) -> values.Node:
    return values.constant(ts.kinds[name], state.get(name, 0))


def test_a_requirement_that_never_asks_is_told_at_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = LEVEL.format(
        "requirement idle : when asked and not given, at once asked\nrequirement acts : when asked, at once given"
    )
    path = solo_system(tmp_path, text.replace("level l", "level solo"))
    assert run(["prove", str(path)]) == 0
    said = capsys.readouterr().out
    assert "but 1 requirement that never asks: status 0, and 1 with --strict" in said.splitlines()[0]
    assert "warning[RCS760]: requirement `idle` of level `solo` is vacuous" in said
    assert "solo.rcs:3:13" in said
    assert "`acts` of level" not in said
    assert run(["prove", str(path), "--strict"]) == 1


def test_a_run_shows_how_a_requirement_asks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """30 ms are three cycles after the one in which it begins; of what never asks there is none."""
    said = "requirement late : when asked for 30 [ms], at once given\nrequirement idle : when asked and not given, at once asked"
    path = solo_system(tmp_path, LEVEL.format(said).replace("level l", "level solo"))
    assert run(["prove", str(path), "--show", "solo.late"]) == 0
    shown = capsys.readouterr().out
    assert "requirement `late` of level `solo` asks in cycle 4" in shown
    assert "! it asks" in shown
    assert run(["prove", str(path), "--show", "late", "--show", "idle"]) == 1
    assert "requirement `idle` of level `solo`: no run was found" in capsys.readouterr().out
    assert run(["prove", str(path), "--show", "gone"]) == 2


# --- where inputs are refused ----------------------------------------------------------------

GAUGE = """\
input level_mm : int 0 .. 100
output drains : bool
requirement keeps : while level_mm > 50, always drains
requirement stays : when drains, before not drains, level_mm <= 50 or drains
requirement never_both : never drains and not drains
table t {
  | line | level_mm || drains |
  |------|----------||--------|
  | high | > 50     || true   |
  | low  | <= 50    || false  |
}
level l { period 10 [ms] table t }
"""


def test_a_refused_cycle_is_a_cycle_of_the_run() -> None:
    """What a refused reading shows may be anything, and the level does not act on it."""
    ts = alone(GAUGE)
    proof = prove_level(ts, LITTLE)
    assert {owed.name for owed, verdict in proof.verdicts if owed.sort is Sort.REQUIREMENT and verdict is Verdict.PROVED} == {
        "keeps", "stays", "never_both",
    }  # fmt: skip
    assert proof.needs_admission((Sort.REQUIREMENT, "", "keeps"))
    assert not proof.needs_admission((Sort.REQUIREMENT, "", "never_both"))


def test_what_a_monitor_sees_of_a_refused_reading_is_true_or_false_and_another_truth_in_each_cycle() -> None:
    ts = alone(GAUGE).refusing()
    first = ts.cycle(ts.havoc(), " 1")
    second = ts.cycle(first.after, " 2")
    mode = f"{WATCHED}keeps mode"
    for made, other, suffix in ((first, second, " 1"), (second, first, " 2")):
        unknown = f"{REFUSED}{suffix}: (> level_mm int:50)"
        assert unknown in values.variables([made.after[mode]])
        assert unknown not in values.variables([other.after[mode]])


def test_a_property_is_watched_cycle_by_cycle() -> None:
    """It may look back at the cycle before; what is not defined is not kept."""
    program = program_of(
        "input n : int 0 .. 9\ninput m : int 0 .. 9\noutput o : bool\nproperty up : n mod m >= was n\n"
        "table t {\n| line | n || o |\n| any | || true |\n}\nlevel solo { period 40 [ms] table t }\n"
    )
    watch = Watch(program.properties[0])
    for before, n, m in product(range(3), range(3), range(3)):
        kept = m > 0 and n % m >= before
        assert watch.keeps({"n": before, "m": 0}, {"n": n, "m": m}) is kept

"""Requirements across levels: what their names mean, how they are answered, and how `rcsc check` and `rcsc prove` tell of them."""

import json
from collections.abc import Callable, Mapping
from math import isnan
from pathlib import Path

import pytest

from rcsc.compose.counterexample.explain import TraceSettings
from rcsc.compose.counterexample.rerun import make
from rcsc.compose.proof.system import prove_transition_systems, read_systems
from rcsc.compose.together.product import Surroundings, Timing
from rcsc.compose.together.proof import NEVER_LATE, NO_RESTART, SHORT, Across, Question
from rcsc.compose.together.repeated import repeated
from rcsc.compose.together.words import stated_across
from rcsc.front.commands import run
from rcsc.lang.interpret import Fault
from rcsc.run.description import Description, description
from rcsc.run.episodes.episode import BufferFault
from rcsc.run.episodes.harm import HarmedMemory
from rcsc.run.levels import running_level
from rcsc.run.system import System, executors, signatures

Ran = tuple[int, str, str]
Rcsc = Callable[..., Ran]


@pytest.fixture
def rcsc(capfd: pytest.CaptureFixture[str]) -> Rcsc:
    def run_it(*args: object) -> Ran:
        capfd.readouterr()
        status = run(list(map(str, args)))
        shown = capfd.readouterr()
        return status, shown.out, shown.err

    return run_it


_BOSS = """\
enum side { nobody, l, r }
input wish : side
input left_runs : bool
input right_runs : bool
output go_left : bool safe false
output go_right : bool safe false
table choose {
  | line  | wish   | left_runs | right_runs || go_left | go_right |
  |-------|--------|-----------|------------||---------|----------|
  | none  | nobody |           |            || false   | false    |
  | l     | l      |           | false      || true    | false    |
  | not_l | l      |           | true       || false   | false    |
  | r     | r      | false     |            || false   | true     |
  | not_r | r      | true      |            || false   | false    |
}
level boss { period 10 [ms] table choose }
"""
_HAND = """\
input go : bool
output runs : bool safe false
table move_NAME {{
  | line | go    || runs  |
  |------|-------||-------|
  | on   | true  || true  |
  | off  | false || false |
}}
level NAME {{ period PERIOD [ms] table move_NAME }}
""".replace("{{", "{").replace("}}", "}")
_SYSTEM = """\
name = "two"
generated = "generated"
tick_ms = 10
requirements = "all.rcs"
[[level]]
name = "boss"
[[level]]
name = "left"
[[level]]
name = "right"
[buffers]
"boss.go_left" = "LEFT.go"
"boss.go_right" = "RIGHT.go"
"left.runs" = "boss.left_runs"
"right.runs" = "boss.right_runs"
"panel.wish" = "boss.wish"
"""


def _written(
    folder: Path, requirements: str, *, crossed: bool = False, period: int = 10, files: Mapping[str, str] = {}
) -> Path:
    left, right = ("right", "left") if crossed else ("left", "right")
    texts = {
        "rcsc.toml": 'name = "two"\n',
        "system.toml": _SYSTEM.replace("LEFT", left).replace("RIGHT", right),
        "all.rcs": requirements,
        "boss.rcs": _BOSS,
        **{f"{name}.rcs": _HAND.replace("NAME", name).replace("PERIOD", str(period)) for name in ("left", "right")},
        **files,
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text)
    return folder / "system.toml"


def _answers(path: Path) -> dict[str, Across]:
    systems, _ = read_systems(path)
    whole = prove_transition_systems(systems, None, 1, tuple(systems))
    proofs = {proof.level: proof for proof in whole.levels}
    system = description(path)
    stated = stated_across(system, {name: ts.program for name, ts in systems.items()})
    assert stated is not None
    return {
        one.name: Question(systems, system, stated[0], one, proofs).answer() for one in stated[0].properties
    }


_BOTH = "requirement never_both : always not (left.runs and right.runs)\n"
_SOON = "requirement soon : when boss.wish = l and not right.runs, within 2 cycles, left.runs\n"


def test_what_no_level_keeps_alone_is_proved_of_all_as_they_are_scheduled(tmp_path: Path) -> None:
    found = _answers(_written(tmp_path, _BOTH))["never_both"]
    assert (found.proved, found.timing, found.levels) == (
        True,
        Timing.SCHEDULED,
        ("boss", "left", "right"),
    )
    assert found.around.refuses
    assert found.around.restarts


def test_what_one_level_keeps_holds_under_any_timing(tmp_path: Path) -> None:
    found = _answers(_written(tmp_path, "property one : not (boss.go_left and boss.go_right)\n"))["one"]
    assert (found.proved, found.timing, found.levels) == (True, Timing.ANY, ("boss",))


def test_what_a_run_breaks_is_shown_by_the_shortest_one_and_the_executors_repeat_it(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    path = _written(tmp_path, _SOON)
    found = _answers(path)["soon"]
    assert (found.refuted, len(found.run), found.levels) == (True, 5, ("boss", "left", "right"))
    systems, _ = read_systems(path)
    shown = repeated(found, systems, TraceSettings(description(path), 8, log=tmp_path / "logs"))
    assert not shown.beside
    assert shown.in_c
    assert shown.log is not None
    for executor in ("c", "python"):
        made = tmp_path / "logs" / "generated"
        status, out, _ = rcsc(
            "replay", shown.log, "--system", path, "--generated", made, "--executor", executor
        )
        assert status == 0, out


_COUNTING = """\
input go : bool
input heat : int 0 .. 99
output runs : bool safe false
state ran : int 0 .. 12
table move_left {
  | line | go    | ran  || runs  | ran     |
  |------|-------|------||-------|---------|
  | on   | true  | < 12 || true  | ran + 1 |
  | last | true  | 12   || true  |         |
  | hot  | false |      || false | 0       |
}
level left { period 10 [ms] table move_left }
"""


def test_a_long_run_has_no_restart_and_no_refusal_that_it_breaks_without(
    tmp_path: Path,
) -> None:
    path = _written(tmp_path, "requirement short : always left.ran < 10\n", files={"left.rcs": _COUNTING})
    path.write_text(path.read_text() + '"panel.heat" = "left.heat"\n')
    found = _answers(path)["short"]
    steps = [step for tick in found.run for step in tick.values()]
    assert len(found.run) > SHORT
    assert not any(step.anew or step.fault is Fault.ADMIT for step in steps)


def test_a_wire_that_is_crossed_is_found(tmp_path: Path) -> None:
    answered = "requirement obeys : when boss.go_left, within 1 cycles, left.runs or not boss.go_left\n"
    assert _answers(_written(tmp_path, answered))["obeys"].proved
    assert _answers(_written(tmp_path, answered, crossed=True))["obeys"].refuted


_OBEYS = "requirement obeys : when boss.go_left, within 1 cycles, left.runs or not boss.go_left\n"


@pytest.mark.parametrize(
    ("slip", "told"),
    [
        (('"boss.go_left" = "left.go"\n', ""), ["never_both", "obeys"]),
        (('"left.runs" = "boss.left_runs"\n', ""), []),
        (('"left.runs" = "boss.left_runs"', '"left.runs" = "panel.runs"\n"panel.left" = "boss.left_runs"'), []),
        (("boss.left_runs", "boss.other"), []),
        (("left.go", "other.go"), ["obeys"]),
    ],
    ids=["a wire is cut", "an echo is dropped", "an echo goes elsewhere", "echoes are swapped", "orders are swapped"],
)  # fmt: skip
def test_a_slip_in_the_wires_is_refuted_or_shown_to_do_nothing(
    tmp_path: Path, slip: tuple[str, str], told: list[str]
) -> None:
    path = _written(tmp_path, _BOTH + _OBEYS)
    text = path.read_text()
    if "other" in slip[1]:  # two ends change places
        first, second = slip[0], slip[0].replace("left", "right")
        text = text.replace(first, "OTHER").replace(second, first).replace("OTHER", second)
    path.write_text(text.replace(*slip) if "other" not in slip[1] else text)
    found = _answers(path)
    assert [name for name, one in found.items() if one.refuted] == told
    assert all(
        one.proved for name, one in found.items() if name not in told
    )  # as scheduled, no echo is needed


def test_a_level_of_a_longer_period_reacts_later(tmp_path: Path) -> None:
    late = "requirement obeys : when boss.go_left, within 1 cycles, left.runs or not boss.go_left\n"
    later = late.replace("within 1", "within 2")
    every = _answers(_written(tmp_path, late + later.replace("obeys", "obeys_later"), period=20))
    assert every["obeys"].refuted
    assert every["obeys_later"].proved


_COUNTS = """\
input go : bool
output runs : bool safe false
state n : int 0 .. 3
table move_left {
  | line | go    | n   || n     | runs  |
  |------|-------|-----||-------|-------|
  | on   | true  | < 3 || n + 1 | true  |
  | most | true  | 3   || 3     | true  |
  | off  | false |     || n     | false |
}
level left { period 10 [ms] table move_left }
"""


def test_what_only_a_restart_breaks_is_proved_trusting_that_none_comes(tmp_path: Path) -> None:
    counted = "property never_back : left.n >= was left.n\n"
    found = _answers(_written(tmp_path, counted, files={"left.rcs": _COUNTS}))["never_back"]
    assert found.proved
    assert not found.around.restarts
    assert found.run
    assert any(step.anew for tick in found.run for step in tick.values())
    assert found.around.refuses
    assert found.trusts({}) == (NO_RESTART,)


_ORDERS = "record order {\n  inc_command : int 0 .. 65535\n}\n"
_GIVES = """\
use orders
input go : bool
output to_hand : order
table give {
  | line | go    || to_hand.inc_command                 |
  |------|-------||-------------------------------------|
  | more | true  || (to_hand.inc_command + 1) mod 65536 |
  | same | false || to_hand.inc_command                 |
}
level boss { period 10 [ms] table give }
"""
_TAKES = """\
use orders
input command : order
state inc_command_seen : int 0 .. 65535
state fresh : bool restart true
output both : bool safe false
table take {
  | line | command.inc_command = inc_command_seen | fresh || both  | fresh | inc_command_seen    |
  |------|----------------------------------------|-------||-------|-------|---------------------|
  | new  | false                                  | true  || true  | false | command.inc_command |
  | take | false                                  | false || false | false | command.inc_command |
  | same | true                                   |       || false | false | inc_command_seen    |
}
level hand { period PERIOD [ms] table take }
"""
_ORDERED = """\
name = "ordered"
generated = "generated"
tick_ms = 10
requirements = "all.rcs"
[[level]]
name = "boss"
[[level]]
name = "hand"
[buffers]
"boss.to_hand" = "hand.command"
"panel.go" = "boss.go"
"""


@pytest.mark.parametrize("period", [10, 20, 30])
def test_a_level_may_begin_anew_in_a_tick_in_which_it_does_not_run(tmp_path: Path, period: int) -> None:
    """What it found in its buffers then is what counts as seen, and an order that came before its next cycle is new."""
    for name, text in {
        "orders.rcs": _ORDERS,
        "boss.rcs": _GIVES,
        "hand.rcs": _TAKES.replace("PERIOD", str(period)),
        "all.rcs": "requirement seen : never hand.both\n",
        "system.toml": _ORDERED,
        "rcsc.toml": 'name = "ordered"\n',
    }.items():
        (tmp_path / name).write_text(text)
    path = tmp_path / "system.toml"
    systems, _ = read_systems(path)
    stated = stated_across(description(path), {name: ts.program for name, ts in systems.items()})
    assert stated is not None
    found = Question(systems, description(path), stated[0], stated[0].properties[0]).answer()
    assert found.proved
    assert found.around.restarts is (period == 10)
    assert len(found.run) == {10: 0, 20: 3, 30: 4}[period]
    if found.run:
        assert found.run[-1]["hand"].anew
        assert not repeated(found, systems, TraceSettings(description(path), 8, log=tmp_path / "logs")).beside


_DOUBTS = """\
input go : bool
input load : int 0 .. 10
output runs : bool safe false
table move_left {
  | line | go    | load || runs  |
  |------|-------|------||-------|
  | on   | true  | < 8  || true  |
  | too  | true  | >= 8 || false |
  | off  | false |      || false |
}
level left { period 10 [ms] table move_left }
"""


def test_what_only_a_refusal_breaks_is_proved_trusting_that_none_comes(tmp_path: Path) -> None:
    obeys = "requirement obeys : whenever boss.go_left, next left.runs or left.load >= 8\n"
    found = _answers(_written(tmp_path, obeys, files={"left.rcs": _DOUBTS}))["obeys"]
    assert found.proved
    assert not found.around.refuses
    assert any(step.fault.name == "ADMIT" for tick in found.run for step in tick.values())


def test_a_run_with_a_refused_real_is_repeated_though_no_number_is_as_it_was(tmp_path: Path) -> None:
    """A real is refused as NaN, which is equal to nothing, and stands in interpreter and executors alike."""
    doubts = (
        _DOUBTS.replace("int 0 .. 10", "real 0.0 .. 10.0").replace("< 8 ", "< 8.0").replace(">= 8", ">= 8.0")
    )
    files = {"left.rcs": doubts.replace("8.0 || false", "8.0 || true")}
    path = _written(tmp_path, "requirement obeys : whenever boss.go_left, next left.runs\n", files=files)
    found = _answers(path)["obeys"]
    assert found.proved
    assert any(
        isnan(step.taken["load"]) for tick in found.run for name, step in tick.items() if name == "left"
    )
    systems, _ = read_systems(path)
    assert not repeated(found, systems, TraceSettings(description(path), 8, log=tmp_path / "logs")).beside


def test_what_is_assumed_of_a_party_over_time_is_kept_by_every_run(tmp_path: Path) -> None:
    calm = "assume calm assumed : never panel.wish = r\n"
    never = "requirement never_right : never right.runs\n"
    found = _answers(_written(tmp_path, calm + never))["never_right"]
    assert found.proved
    assert found.trusts({}) == ("assumption `calm` across levels, as it is declared",)
    assert _answers(_written(tmp_path, never))["never_right"].refuted


@pytest.mark.thorough
def test_an_open_one_says_how_long_no_run_is_that_breaks_it(tmp_path: Path, rcsc: Rcsc) -> None:
    counter = (
        _COUNTS.replace("0 .. 3", "0 .. 1000000")
        .replace("< 3", "< 1000000")
        .replace("| 3 ", "| 1000000 ")
        .replace("|| 3 ", "|| 1000000 ")
    )
    path = _written(tmp_path, "property never : left.n < 900000\n", files={"left.rcs": counter})
    status, out, err = rcsc("prove", path, "--no-cache")
    assert status == 1
    (line,) = [line for line in out.splitlines() if line.startswith("  never")]
    looked = int(line.partition("no run of ")[2].split()[0])
    assert 8 <= looked <= 60
    assert f"no run of {looked} ticks breaks it" in err
    assert "it speaks of `left` alone: stated in the tables of `left`," in err


def test_what_nothing_ever_asks_for_is_told(tmp_path: Path, rcsc: Rcsc) -> None:
    never = "requirement idle : when boss.go_left and boss.go_right, within 1 cycles, left.runs\n"
    path = _written(tmp_path, never)
    assert _answers(path)["idle"].vacuous
    status, out, err = rcsc("prove", path, "--no-cache")
    assert (status, rcsc("prove", path, "--no-cache", "--strict")[0]) == (0, 1)
    assert "vacuous, proved" in out
    assert "RCS760" in err


def test_the_examples_of_the_manual_are_as_it_says(tmp_path: Path) -> None:
    manual = (Path(__file__).parents[2] / "grammar" / "requirements.md").read_text()
    text = manual.partition("```across\n")[2].partition("```")[0]
    said = {line.split()[1]: line.partition("#")[2].strip() for line in text.splitlines()}
    found = _answers(_written(tmp_path, text))
    assert {name: _said(one) for name, one in found.items()} == said


def _said(found: Across) -> str:
    if found.vacuous:
        return "vacuous"
    if found.proved:
        return "proved under any timing" if found.timing is Timing.ANY else "proved as scheduled"
    if found.lasso:
        return f"waits for ever, ticks {found.lasso} to {len(found.run)}"
    return f"refuted in tick {len(found.run)}"


def test_nothing_is_proved_of_an_environment_that_cannot_go_on(tmp_path: Path) -> None:
    never = "".join(
        f"assume no_{side} assumed : never panel.wish = {side}\n" for side in ("nobody", "l", "r")
    )
    found = _answers(_written(tmp_path, never + "requirement any : never right.runs\n"))["any"]
    assert not found.proved
    assert found.stuck


def test_an_assumption_that_is_kept_for_a_while_only_proves_nothing(tmp_path: Path) -> None:
    stays = "assume stays assumed : after panel.wish = l, never panel.wish = r\n"
    moves = "assume moves assumed : when panel.wish = l, exactly after 3 cycles, panel.wish = r\n"
    found = _answers(_written(tmp_path, stays + moves + "requirement any : never right.runs\n"))["any"]
    assert not found.proved


# --- late buffers ------------------------------------------------------------------------------

_HEEDS = "requirement heeds : when boss.go_left for 3 cycles, at once left.runs\n"


def _late(folder: Path, requirements: str, ticks: int) -> Path:
    path = _written(folder, requirements)
    path.write_text(path.read_text().replace("tick_ms = 10\n", f"tick_ms = 10\nlate_ticks = {ticks}\n"))
    return path


def test_what_holds_as_scheduled_and_not_of_a_buffer_that_is_a_tick_late_is_told_with_a_run(
    tmp_path: Path,
) -> None:
    found = _answers(_late(tmp_path, _BOTH, 1))["never_both"]
    assert (found.proved, found.timing, found.kinder_timing) == (True, Timing.SCHEDULED, True)
    assert NEVER_LATE in found.trusts({})
    assert len(found.run) == 3
    assert [sorted(late) for late in found.run_late] == [[], [], ["right.go"]]
    assert found.broken_in == Surroundings(refuses=False, restarts=False)


@pytest.mark.parametrize(("ticks", "holds"), [(2, True), (3, False)])
def test_a_requirement_is_proved_of_buffers_as_late_as_the_system_says(
    tmp_path: Path, ticks: int, holds: bool
) -> None:
    found = _answers(_late(tmp_path, _HEEDS, ticks))["heeds"]
    assert found.proved
    assert (found.timing, bool(found.run)) == (Timing.LATE if holds else Timing.SCHEDULED, not holds)


def test_what_holds_under_any_timing_is_not_asked_of_late_buffers(tmp_path: Path) -> None:
    found = _answers(_late(tmp_path, "property one : not (boss.go_left and boss.go_right)\n", 2))["one"]
    assert (found.proved, found.timing, found.kinder_timing) == (True, Timing.ANY, False)


def test_a_run_with_late_buffers_is_one_of_episodes_with_such_faults(tmp_path: Path) -> None:
    path = _late(tmp_path, _HEEDS, 3)
    found = _answers(path)["heeds"]
    assert any(found.run_late)
    assert not any(step.anew for tick in found.run for step in tick.values())
    systems, _ = read_systems(path)
    system = description(path)
    make((ts.program for ts in systems.values()), system.generated, altered=False)
    signs = signatures(system)
    by_level = executors(system, signs, "c")
    levels = tuple(
        running_level(spec, system, signs[spec.name], by_level[spec.name], {}) for spec in system.levels
    )
    memory = HarmedMemory(_faults(found, system), (), {})
    running = System(system, levels, (), memory)
    for tick, ran in enumerate(found.run):
        memory.begin(tick)
        memory.publish("panel.wish", (ran["boss"].taken["wish"],))
        running.step()
        for level in levels:
            assert (
                level.value("go_left" if level.name == "boss" else "runs")
                == ran[level.name].after["go_left" if level.name == "boss" else "runs"]
            )


def _faults(found: Across, system: Description) -> list[BufferFault]:
    """Return faults after which each value comes when a reader of the run first sees it, or a later one."""
    faults = []
    for wire in system.wires:
        if wire.source == "panel.wish":
            continue  # published here as the run takes it
        seen = [tick - 1 - late.get(wire.target, 0) for tick, late in enumerate(found.run_late)]
        for tick in range(len(seen)):
            comes = next((at for at, newest in enumerate(seen) if newest >= tick), len(seen) + 1)
            if comes > tick + 1:
                faults.append(BufferFault(wire.source, "late", tick, tick, ticks=comes - tick - 1))
    return faults


def test_where_nothing_has_arrived_a_reader_has_what_it_begins_with(tmp_path: Path) -> None:
    left = _HAND.replace("NAME", "left").replace("PERIOD", "10").replace("safe false", "safe true")
    files = {"left.rcs": left.replace("|| false |", "|| true  |")}
    (tmp_path / "new").mkdir()
    requirement = "requirement arrives : whenever left.runs for 1 cycles, at once boss.left_runs\n"
    assert _answers(_written(tmp_path, requirement, files=files))["arrives"].proved
    _late(tmp_path / "new", requirement, 1)
    (tmp_path / "new" / "left.rcs").write_text(files["left.rcs"])
    found = _answers(tmp_path / "new" / "system.toml")["arrives"]
    assert (found.timing, len(found.run), found.run_late[1]) == (Timing.SCHEDULED, 2, {"boss.left_runs": 1})


def test_prove_says_how_late_buffers_are_and_strict_counts_what_needs_that_none_is(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    path = _late(tmp_path, _BOTH + _HEEDS, 1)
    status, out, err = rcsc("prove", path, "--no-cache")
    assert "proved as scheduled, of `boss`, `left`, `right`, trusting no buffer is seen late" in out
    assert "proved with buffers at most 1 tick late, of `boss`, `left`" in out
    assert "tick 3: `right.go` is seen 1 tick late" in err
    assert status == 0
    assert rcsc("prove", path, "--no-cache", "--strict")[0] == 1
    _, out, _ = rcsc("prove", path, "--no-cache", "--json")
    every = {one["name"]: one for one in json.loads(out)["requirements"]}
    assert every["never_both"]["seen_late"][2] == {"right.go": 1}
    assert every["heeds"]["timing"] == "late"


def test_a_proof_of_buffers_that_are_later_is_asked_anew(tmp_path: Path, rcsc: Rcsc) -> None:
    for ticks, said in ((2, "at most 2 ticks late"), (3, "proved as scheduled")):
        _, out, _ = rcsc("prove", _late(tmp_path, _HEEDS, ticks))
        assert said in out.splitlines()[1]


@pytest.mark.parametrize("ticks", ["0", "21", "1.5", '"3"'])
def test_a_number_of_ticks_that_is_none_is_told(tmp_path: Path, rcsc: Rcsc, ticks: str) -> None:
    path = _written(tmp_path, _BOTH)
    path.write_text(path.read_text().replace("tick_ms = 10\n", f"tick_ms = 10\nlate_ticks = {ticks}\n"))
    status, _, err = rcsc("prove", path, "--no-cache")
    assert status == 1
    assert "late_ticks" in err


# --- words -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        (
            "state x : bool\nrequirement p : always left.runs\n",
            "RCS325",
            "states requirements and properties",
        ),
        ("requirement p : always lft.runs\n", "RCS201", "did you mean `left`?"),
        ("requirement p : always left.run\n", "RCS201", "did you mean `runs`?"),
        ("requirement p : always boss.wish = 3\n", "RCS301", "which is `side`"),
        ("requirement p : always panel.wisch = l\n", "RCS201", "did you mean `wish`?"),
        ("requirement p : when left.runs, within 15 [ms], right.runs\n", "RCS317", "10 ms"),
    ],
)
def test_what_is_wrong_in_the_file_is_told_in_it(
    tmp_path: Path, rcsc: Rcsc, text: str, code: str, said: str
) -> None:
    _written(tmp_path, text)
    status, out, _ = rcsc("check", tmp_path / "all.rcs", "--no-cache")
    assert status == 1
    assert code in out
    assert said in out


def test_a_folder_with_such_a_file_is_in_order(tmp_path: Path, rcsc: Rcsc) -> None:
    _written(tmp_path, _BOTH + _SOON)
    status, out, _ = rcsc("check", tmp_path, "--no-cache")
    assert status == 0, out


def test_constants_of_a_used_file_and_names_of_a_party_outside_can_be_read(tmp_path: Path) -> None:
    words = "const most = 2\nconst unused = 3\n"
    text = "use words\nproperty p : panel.wish = nobody or most = 2\n"
    assert _answers(_written(tmp_path, text, files={"words.rcs": words}))["p"].proved


# --- `rcsc prove` ------------------------------------------------------------------------------


def test_prove_tells_requirements_first_with_timing_levels_and_runs(tmp_path: Path, rcsc: Rcsc) -> None:
    path = _written(tmp_path, _BOTH + _SOON)
    status, out, err = rcsc("prove", path, "--no-cache")
    assert status == 1
    first = out.splitlines()
    assert first[0] == "requirements across levels, all.rcs"
    assert "proved as scheduled, of `boss`, `left`, `right`" in first[1]
    assert "refuted in tick 5" in first[2]
    assert "requirement `soon` is broken" in err
    _, out, _ = rcsc("prove", path, "--no-cache", "--json")
    every = {one["name"]: one for one in json.loads(out)["requirements"]}
    assert (every["never_both"]["verdict"], every["soon"]["verdict"]) == ("proved", "refuted")
    assert len({row["tick"] for row in every["soon"]["time_line"]}) == 5


def test_one_requirement_alone_is_answered_and_counted(tmp_path: Path, rcsc: Rcsc) -> None:
    wrong = "requirement soon : when boss.go_left, within 1 cycles, right.runs\n"
    path = _written(tmp_path, _BOTH + wrong)
    status, out, err = rcsc("prove", path, "--requirement", "never_both")
    assert (status, err) == (0, "")
    assert out.splitlines()[1].split()[:2] == ["never_both", "proved"]
    assert "1 requirement across levels" in out
    assert "soon" not in out
    assert rcsc("prove", path)[0] == 1
    assert rcsc("prove", path, "--requirement", "soon")[0] == 1
    status, _, err = rcsc("prove", path, "--requirement", "son")
    assert status == 2
    assert "there is no requirement across levels `son`; there are never_both, soon" in err
    assert rcsc("prove", path, "--requirement", "soon", "--level", "boss")[0] == 2
    (tmp_path / "all.rcs").write_text("")
    assert "the system states none" in rcsc("prove", path, "--requirement", "soon")[2]


def test_show_prints_a_run_of_all_levels_that_asks(tmp_path: Path, rcsc: Rcsc) -> None:
    asks = "requirement obeys : when boss.go_left, within 1 cycles, left.runs or not boss.go_left\n"
    never = "requirement idle : when boss.go_left and boss.go_right, within 1 cycles, left.runs\n"
    path = _written(tmp_path, asks + never)
    status, out, _ = rcsc("prove", path, "--show", "obeys")
    assert status == 0
    assert out.startswith("requirement `obeys` across levels asks in cycle 1\n")
    assert "! it asks" in out
    assert rcsc("prove", path, "--show", "idle")[0] == 1
    assert rcsc("prove", path, "--show", "other")[0] == 2


def test_a_proof_is_kept_and_a_changed_requirement_is_asked_anew(tmp_path: Path, rcsc: Rcsc) -> None:
    path = _written(tmp_path, _BOTH)
    for _ in range(2):
        status, out, _ = rcsc("prove", path)
        assert status == 0
        assert "never_both" in out
    (tmp_path / "all.rcs").write_text(_BOTH.replace("always not", "always"))
    status, out, err = rcsc("prove", path)
    assert status == 1
    assert "refuted in tick 1" in out
    assert rcsc("prove", path)[2] == err


def test_a_run_that_breaks_what_is_proved_of_kinder_surroundings_is_shown_again(
    tmp_path: Path, rcsc: Rcsc
) -> None:
    soon = "requirement soon : whenever boss.go_left for 3 cycles, at once left.runs\n"
    path = _written(tmp_path, soon)
    _late(tmp_path, soon, 3)
    first = rcsc("prove", path)
    assert "is proved of kinder surroundings only: this run breaks it" in first[2]
    assert rcsc("prove", path)[2] == first[2]


def test_what_rests_on_a_level_that_is_not_proved_says_so(tmp_path: Path, rcsc: Rcsc) -> None:
    gap = _HAND.replace("NAME", "left").replace("PERIOD", "10").replace("  | off  | false || false |\n", "")
    other = "requirement other : always left.runs or not (boss.go_left and boss.go_right)\n"
    path = _written(tmp_path, other, files={"left.rcs": gap})
    status, out, _ = rcsc("prove", path, "--no-cache")
    assert status == 1
    assert "rests on" in out.splitlines()[1]


@pytest.mark.thorough
@pytest.mark.parametrize("template", ["system", "mujoco"])
def test_what_the_templates_require_is_proved(
    tmp_path: Path, rcsc: Rcsc, monkeypatch: pytest.MonkeyPatch, template: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert rcsc("new", "robot", "--template", template)[0] == 0
    status, out, _ = rcsc("prove", "robot/system.toml", "--no-cache")
    assert status == 0
    assert [line.split()[1:3] for line in out.splitlines()[1:4]] == [["proved", "as"]] * 3

"""The cell in the loop under Hypothesis: whatever is commanded and whatever goes wrong, the properties hold, and C and Python do the same.

`rcsc test tables/system.toml --plant mujoco --examples 500` looks for longer, and keeps what does not hold. Such an episode goes to
`tests/regress`, and is run for ever. `python -m tests.episodes.broken` breaks the executors on purpose.
"""

import os
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import find, given, settings
from hypothesis import strategies as st

from rcsc.run.adopt import Begun
from rcsc.run.campaign.rig import Rig
from rcsc.run.campaign.search import episodes, search, smallest
from rcsc.run.description import description
from rcsc.run.episodes.episode import BufferFault, Harm, Restart
from rcsc.run.episodes.harm import HarmedMemory
from rcsc.run.episodes.properties import AGREE
from rcsc.run.log.read import read
from rcsc.run.log.replay import Replay
from rcsc.run.system import Kind, signatures
from rcsc_cell.database.build import BadData
from rcsc_cell.episodes.episode import (
    FAULTS,
    SYSTEM,
    Episode,
    Interruption,
    PartSpec,
    Push,
    SwitchTo,
    script,
)
from rcsc_cell.episodes.kind import CELL, fault_classes
from rcsc_cell.episodes.loop import Loop, run
from rcsc_cell.episodes.sampling import draw
from tests.episodes.broken import BROKEN, MOST, broken_rig
from tests.support.loops import ACQUIRE

HERE = Path(__file__).parents[1]
CASES = sorted((HERE / "regress").glob("*.json"))

# --- the properties hold ---


@pytest.mark.parametrize(("plant", "examples"), [("kinematic", 12), ("mujoco", 3)])
def test_whatever_goes_wrong_the_properties_hold_in_c_and_in_python(plant: str, examples: int) -> None:
    searched = search(Rig(CELL, SYSTEM, plant, "both"), examples)
    assert searched.falsified is None, f"{searched.falsified[1]}\n{searched.falsified[0].to_json()}"
    assert searched.episodes == examples


@pytest.mark.parametrize("where", ["c", "python"])
@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_executor_is_found_with_physics(name: str, where: Kind, tmp_path: Path) -> None:
    searched = search(broken_rig(name, {where}, "mujoco", tmp_path), MOST)
    assert searched.falsified is not None
    assert searched.falsified[1].property == AGREE
    assert BROKEN[name].level in searched.falsified[1].message


def test_what_finds_a_broken_executor_shrinks_to_what_a_person_reads(tmp_path: Path) -> None:
    """A force of 2 N: one part, and the rows that take it; nothing goes wrong in it."""
    rig = broken_rig("a force of 2 N", {"c"}, "kinematic", tmp_path)
    searched = search(rig, MOST)
    assert searched.falsified is not None
    least, finding = smallest(rig, *searched.falsified)
    assert finding.message.endswith(" in Python")
    assert "`to_hand.force_n` is 2.0 in C and " in finding.message
    assert not fault_classes(replace(least, parts=searched.falsified[0].parts))
    assert (len(least.rows), least.parts, least.seed) == (1, (), 0)
    assert least.told() == (
        "the cell moves by kinematics alone; seed 0",
        f"row 1: `{' '.join(least.rows[0].split(',')).strip()}`",
    )
    assert rig.kind.read(least.to_json()) == least


@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
def test_what_once_did_not_hold_does(path: Path) -> None:
    outcome = run(Episode.from_json(path.read_text(encoding="utf-8")))
    assert outcome.findings == ()


# --- the same again ---


ODD = replace(
    ACQUIRE,
    faults=(SwitchTo("noisy", 80, 200),),
    transport=(BufferFault("primitive.to_emove", "late", 20, 60),),
    restarts=(Restart(40, "vision"),),
    interruptions=(Interruption(30, "MOVE,,,FIX-SAFE,"), Interruption(80, "ACQUIRE,BOXT (2),BUFFER,,")),
)
"""Something of everything, and a picture in it."""


@pytest.mark.parametrize("backend", ["kinematic", "mujoco"])
def test_both_executors_give_the_same_log(backend: str, tmp_path: Path) -> None:
    episode = replace(ODD, backend=backend, step_s=0.004)  # type: ignore[arg-type]  # one of both
    outcomes = {}
    for executor in ("c", "python"):
        log = tmp_path / executor
        outcomes[executor] = run(replace(episode, executor=executor), log=log)
    assert outcomes["c"] == outcomes["python"]
    assert (tmp_path / "c").read_bytes() == (tmp_path / "python").read_bytes()


def test_the_digest_is_the_same_in_another_process_and_another_for_another_seed() -> None:
    code = (
        "import sys; from rcsc_cell.episodes.episode import Episode; from rcsc_cell.episodes.loop import run; "
        "print(run(Episode.from_json(sys.stdin.read())).digest)"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code],
        input=ODD.to_json(),
        env={**os.environ, "PYTHONHASHSEED": "1"},
        cwd=HERE.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    here = run(ODD).digest
    assert ran.stdout.strip() == here
    assert run(replace(ODD, seed=7)).digest != here


RESTARTS = {
    "one": (Restart(40, "vision"),),
    "before the first cycle": (Restart(0, "task"),),
    "two in succession": (Restart(40, "emove"), Restart(41, "emove")),
    "two before one cycle": (Restart(40, "emove"), Restart(40, "emove")),
    "two levels at once": (Restart(40, "task"), Restart(40, "primitive")),
    "every level, the last again": tuple(
        Restart(at, level) for at in (60, 61) for level in signatures(description(SYSTEM))
    ),
}


@pytest.mark.parametrize("restarts", RESTARTS.values(), ids=RESTARTS)
def test_the_log_of_an_episode_replays_exactly_whatever_is_restarted(
    restarts: tuple[Restart, ...], tmp_path: Path
) -> None:
    outcome = run(replace(ODD, restarts=restarts), log=tmp_path / "log.mcap")
    log = read(tmp_path / "log.mcap")
    replay = Replay(log, SYSTEM.parents[1] / "generated")
    moments = list(replay.moments())
    assert [moment.tick for moment in moments if moment.differs] == []
    assert len(moments) == outcome.ticks
    began = [
        (moment.tick, cycle.level, cycle.restarted)
        for moment in moments
        for cycle in moment.cycles
        if cycle.restarted is not None
    ]
    assert began == [(one.tick + 1, one.level, Begun.ANEW) for one in dict.fromkeys(restarts)]
    for level in log.levels:
        assert len(level.restarts) == sum(restart.level == level.name for restart in restarts)


# --- episodes as values ---


@settings(max_examples=50)
@given(episodes(SYSTEM, "mujoco"))
def test_an_episode_travels_as_json_and_is_told(episode: Episode) -> None:
    assert Episode.from_json(episode.to_json()) == episode
    assert episode.backend == "mujoco"
    assert len(episode.told()) == 1 + sum(len(getattr(episode, name)) for name in episode.LISTS)


def test_hypothesis_shrinks_what_it_draws_to_what_is_nominal_but_for_one_thing() -> None:
    least = find(episodes(SYSTEM, "mujoco"), lambda one: any(fault.fault == "slips" for fault in one.faults))
    [fault] = least.faults
    assert len(least.rows) == 1
    assert replace(least, rows=()) == Episode("mujoco", parts=(PartSpec("tbox"),), faults=(fault,))


def test_an_episode_is_told_with_all_that_is_odd_about_it() -> None:
    part = PartSpec("tbox", "buffer", 20.0, -30.5, 10.0, (80.0, 60.0, 41.0), friction=0.9)
    episode = replace(
        ODD,
        parts=(part,),
        faults=(SwitchTo("slips", 7, 7), SwitchTo("shifted_mm", 8, 9, -5.0)),
        pushes=(Push(3, 0, 5.0, 0.0),),
    )
    assert episode.told() == (
        "the cell moves by kinematics alone; seed 0",
        "part 0: `tbox` lies on `buffer` at x = 20 mm, y = -30.5 mm, turned by 10 degrees, 80 x 60 x 41 mm large, with friction 0.9",
        "row 1: `ACQUIRE BOXT (2) BUFFER`",
        "ticks 20 .. 60: buffer `primitive.to_emove` is late",
        "before tick 40: level `vision` starts anew",
        "tick 7: the cell's fault `slips`",
        "ticks 8 .. 9: the cell's fault `shifted_mm` = -5",
        "tick 30: `task` is ordered `MOVE FIX-SAFE`, whatever is under way",
        "tick 80: `task` is ordered `ACQUIRE BOXT (2) BUFFER`, whatever is under way",
        "before tick 3: part 0 is pushed by x = 5 mm, y = 0 mm",
    )


@pytest.mark.parametrize(
    "said",
    [
        "[]",
        "nothing",
        '{"backend": "paper"}',
        '{"faults": [{"fault": "sunspots", "first_tick": 0, "last_tick": 1}]}',
        '{"parts": [{"weight": 3}]}',
        '{"transport": [{"buffer": "a", "kind": "eaten", "first_tick": 0, "last_tick": 1}]}',
        '{"backend": "mujoco", "pushes": [{"tick": 0, "part": 0, "x_mm": 1, "y_mm": 1}]}',
    ],
)
def test_what_is_no_episode_is_refused(said: str) -> None:
    with pytest.raises(ValueError, match=r".+"):
        Episode.from_json(said)


def test_a_seed_draws_the_same_episode_and_all_of_them_draw_every_fault() -> None:
    drawn = [draw(seed) for seed in range(1500)]
    assert drawn == [draw(seed) for seed in range(1500)]
    seen = Counter(name for episode in drawn for name in fault_classes(episode))
    assert set(seen) == set(FAULTS)
    share = sum(not fault_classes(episode) for episode in drawn) / len(drawn)
    assert 0.1 < share < 0.4
    assert any(len(fault_classes(episode)) > 2 for episode in drawn)


@pytest.mark.parametrize(
    ("rows", "end"),
    [
        (("DANCE,,,,",), "refused"),
        (("MOVE,,,MOON,",), "refused"),
        (("RELEASE,,,,",), "refused"),
        (("TRANSFER,,,STATION(0),",), "refused"),
        (("MOVE,,,,",), "failed:cmd"),
        (("ACQUIRE,BOXT (2),MOON,,",), "refused"),
        ((), "done"),
    ],
)
def test_scripts_that_are_not_legal_end_so(rows: tuple[str, ...], end: str) -> None:
    outcome = run(Episode(rows=rows))
    assert (outcome.end, outcome.findings) == (end, ())


def test_a_part_that_nobody_knows_is_bad_data() -> None:
    with pytest.raises(BadData, match="no part is called `cube`"):
        run(Episode(parts=(PartSpec("cube"),)))


def test_an_interruption_that_says_nothing_is_refused() -> None:
    for row in ("ENGRAVE PART,,,,", "MOVE,,,MOON,", "DANCE,,,,"):
        assert run(Episode(interruptions=(Interruption(3, row),))).end == "refused"


def test_a_changed_command_is_left_and_the_script_goes_on() -> None:
    rows = ("MOVE,,,BUFFER-SAFE,", "MOVE,,,FIX-SAFE,")
    outcome = run(Episode(rows=rows, interruptions=(Interruption(20, "MOVE,,,V-BLK2,"),)))
    assert [(row.text, row.state) for row in outcome.rows] == [
        ("MOVE BUFFER-SAFE", "changed"),
        ("MOVE V-BLK2", "done"),
        ("MOVE FIX-SAFE", "done"),
    ]


def test_a_script_is_what_rcsc_run_reads() -> None:
    assert script(("MOVE,,,WS-SAFE,",)) == "command,part,source,dest,end_at\nMOVE,,,WS-SAFE,\n"


# --- buffers that fail ---


FIRST, LONGER, TICKS = st.integers(0, 30), st.sampled_from((0, 1, 3, 10, 40)), st.integers(1, 8)
BUFFERS, KINDS = st.sampled_from(("task.to_workstation", "task.to_emove")), st.sampled_from(get_args(Harm))
HARMS = st.builds(
    lambda buffer, kind, first, longer, ticks: BufferFault(buffer, kind, first, first + longer, ticks),
    BUFFERS,
    KINDS,
    FIRST,
    LONGER,
    TICKS,
)


@settings(max_examples=100)
@given(st.lists(HARMS, max_size=6), st.integers(1, 60))
def test_a_reader_sees_an_older_value_after_a_newer_one_of_a_stale_buffer_alone(
    harmed: list[BufferFault], count: int
) -> None:
    stale = {harm.buffer for harm in harmed if harm.kind == "stale"}
    names = sorted({harm.buffer for harm in harmed} | {"task.to_workstation"})
    buffers = HarmedMemory(harmed, (), {})
    seen: dict[str, tuple[float, ...]] = {}
    for tick in range(count):
        buffers.begin(tick)
        for name in names:
            latest = buffers.latest(name)
            assert latest is None or seen.get(name, ()) <= latest or name in stale
            seen[name] = latest or ()
            buffers.publish(name, (tick,))


@pytest.mark.parametrize(
    ("kind", "read"),
    [
        ("lost", [None, 0, 1, 1, 1, 1, 5, 6]),
        ("stale", [None, 0, 1, 0, 1, 2, 5, 6]),
        ("doubled", [None, 0, 1, 1, 3, 3, 5, 6]),
        ("late", [None, 0, 1, 1, 1, 2, 5, 6]),
    ],
)
def test_what_each_harm_does(kind: Harm, read: list[int | None]) -> None:
    """In ticks 2 to 4; a value is read in the tick after the one in which it is published."""
    buffers, seen = HarmedMemory([BufferFault("b", kind, 2, 4, 2)], (), {}), []
    for tick in range(8):
        buffers.begin(tick)
        latest = buffers.latest("b")
        seen.append(None if latest is None else latest[0])
        buffers.publish("b", (tick,))
    assert seen == read


def test_a_value_that_was_held_up_arrives_though_nothing_follows() -> None:
    buffers = HarmedMemory([BufferFault("c", "late", 0, 2, 4)], (), {})
    buffers.begin(0)
    buffers.publish("c", (1,))
    for tick in range(1, 4):
        buffers.begin(tick)
    assert buffers.latest("c") is None
    for tick in range(4, 7):
        buffers.begin(tick)
    assert buffers.latest("c") == (1,)


def test_a_switch_has_the_value_of_its_window() -> None:
    windows = (SwitchTo("shifted_mm", 2, 3, 5.0), SwitchTo("shifted_mm", 4, 4, 30.0))
    loop, seen = Loop(Episode(faults=windows), SYSTEM), []
    for _ in range(6):
        loop.step()
        seen.append(loop.plant.faults.shifted_mm)
    assert seen == [0.0, 0.0, 5.0, 5.0, 30.0, 0.0]


def test_parts_lie_where_they_are_said_to() -> None:
    spec = PartSpec("flag", "pallet", 10.0, 0.0, 0.0, (50.0, 30.0, 25.0))
    loop = Loop(Episode(parts=(spec,), pushes=(Push(0, 0, 3.0, 4.0),)), SYSTEM)
    [before] = loop.plant.mechanism.parts()
    station = loop.database.stations["pallet"]
    assert station.frame.inside(before.at_mm) == pytest.approx((10.0, 0.0, 12.5))
    loop.step()
    [after] = loop.plant.mechanism.parts()
    assert tuple(b - a for a, b in zip(before.at_mm, after.at_mm, strict=True)) == pytest.approx(
        (3.0, 4.0, 0.0)
    )

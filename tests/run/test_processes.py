"""Levels as processes: reads are whole, and a level that is killed loses no command and runs none twice."""

import contextlib
import multiprocessing
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.run.adopt import adopt
from rcsc.run.buffers import Buffers, CommonMemory
from rcsc.run.description import BadDescription, Description, LevelSpec, Wire, description
from rcsc.run.processes import serve, supervisor
from rcsc.run.processes.block import FOLDER, PREFIX, Block
from rcsc.run.processes.clocks import LONGEST_NAP_S, MOST_WAIT_S, Clocks, Turn
from rcsc.run.processes.memory import TRIES, Layout, NotShared, SharedMemoryBuffers, layout
from rcsc.run.processes.serve import Factory, begin, cycle
from rcsc.run.processes.supervisor import Supervisor, run_processes
from rcsc.run.signature import Leaf, Signature, Value, Values, signature
from rcsc.run.system import Outside, StateTableError, assemble, executors
from rcsc_cell.workstation.orders import DONE, EXECUTING
from tests.support.processes_outside import (
    ACQUIRE,
    HERE,
    NUMBERS,
    PAUSE,
    QUERIES,
    ROUND,
    STORE,
    TBOX,
    Below,
    Sender,
    alone,
    hammer,
    outside,
    pattern,
    queries,
    wide,
)

LEVELS = ("task", "emove", "primitive", "vision", "gripper")
TRACE = (0, 0, 0, 0)
FIRST = 65531
PATIENCE_S = 900.0


@pytest.fixture(autouse=True)
def importable(repo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes find the tests as this one did."""
    monkeypatch.syspath_prepend(str(repo))


@pytest.fixture
def buffers() -> Iterator[SharedMemoryBuffers]:
    with created(wide()) as made:
        yield made


@contextlib.contextmanager
def created(laid: Layout) -> Iterator[SharedMemoryBuffers]:
    made = SharedMemoryBuffers.create(laid)
    try:
        yield made
    finally:
        made.block.unlink()
        made.close()


def again(buffers: SharedMemoryBuffers) -> SharedMemoryBuffers:
    """As a process sees it that has just started."""
    return SharedMemoryBuffers(buffers.block, buffers.layout)


def complete(number: int) -> Values:
    return (*pattern(number), *pattern(number + 1), *TRACE)


def seeded(seed: int) -> random.Random:
    return random.Random(seed)  # noqa: S311  # chance of a test


def until(holds: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end, what
        time.sleep(0.002)


# --- buffers ---


def test_a_value_is_there_after_it_is_published(buffers: SharedMemoryBuffers) -> None:
    other: Buffers = again(buffers)
    assert other.latest("far.out") is None
    buffers.publish("far.out", pattern(7))
    assert other.latest("far.out") == pattern(7)
    assert other.latest("far.out") is other.latest("far.out")
    buffers.publish("wide.out", pattern(8))
    assert other.latest("wide.out") == pattern(8)


def test_a_commit_gives_checkpoint_and_outputs_together(buffers: SharedMemoryBuffers) -> None:
    assert again(buffers).checkpoint("wide") is NotShared.BLANK
    buffers.commit("wide", complete(3))
    assert again(buffers).checkpoint("wide") == complete(3)
    assert again(buffers).latest("wide.out") == pattern(3)


def test_an_output_without_a_cycle_is_no_checkpoint(buffers: SharedMemoryBuffers) -> None:
    buffers.commit("wide", complete(3))
    buffers.publish("wide.out", pattern(9))
    assert again(buffers).latest("wide.out") == pattern(9)
    assert again(buffers).checkpoint("wide") is NotShared.LOST


def test_another_layout_is_not_believed(buffers: SharedMemoryBuffers) -> None:
    buffers.commit("wide", complete(3))
    laid = replace(buffers.layout, seed=buffers.layout.seed + 1)
    other = SharedMemoryBuffers(buffers.block, laid)
    assert other.latest("wide.out") is None
    assert other.checkpoint("wide") is NotShared.LOST


def test_a_buffer_that_does_not_fit_is_refused(repo: Path) -> None:
    good = description(repo / "tables/system.toml")
    signs = {name: sign_of(repo, name) for name in LEVELS}
    layout(good, signs)
    for wire in (
        Wire("task.to_workstation", "emove.task"),
        Wire("camera.picture", "robot.order"),
        Wire("task.nothing", "emove.task"),
    ):
        bad = Description(good.name, good.generated, good.database, 40, good.levels, (wire,))
        with pytest.raises(BadDescription):
            layout(bad, signs)


def test_a_stranger_that_ends_takes_nothing_with_it(buffers: SharedMemoryBuffers) -> None:
    """A process with a resource tracker of its own, which would remove the block and complain."""
    look = f"from rcsc.run.processes.block import Block; Block.attach({buffers.block.name!r}).close()"
    ran = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (0, "")
    Block.attach(buffers.block.name).close()


class Dying(Block):
    """A block whose writer is killed after some stores, and in the middle of a longer one."""

    __slots__ = ("left",)
    left: int

    def set_word(self, at: int, value: int) -> None:
        self._count()
        super().set_word(at, value)

    def write(self, at: int, image: bytes) -> None:
        with contextlib.suppress(KeyboardInterrupt):
            self._count()
            super().write(at, image[: len(image) // 2])
        self._count()
        super().write(at, image)

    def _count(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt


def test_a_writer_killed_at_any_store_leaves_old_or_new(buffers: SharedMemoryBuffers) -> None:
    dying = Dying(buffers.block.name, Block.attach(buffers.block.name)._memory)
    seen = []
    for stores in range(7):
        buffers.commit("wide", complete(1))
        dying.left = stores
        writer = SharedMemoryBuffers(dying, buffers.layout)
        with contextlib.suppress(KeyboardInterrupt):
            writer.commit("wide", complete(2))
        found = again(buffers).checkpoint("wide")
        assert found in {complete(1), complete(2)}
        assert again(buffers).latest("wide.out") == found[: len(pattern(1))]
        seen.append(found == complete(2))
        again(buffers).commit("wide", complete(5))
        assert buffers.latest("wide.out") == pattern(5)
    assert seen == sorted(seen)
    assert seen[0] is False
    assert seen[-1] is True
    dying.close()


@given(st.data())
@settings(max_examples=200)
def test_garbage_is_never_believed(data: st.DataObject) -> None:
    with created(wide()) as buffers:
        buffers.commit("wide", complete(1))
        buffers.publish("far.out", pattern(1))
        for _ in range(data.draw(st.integers(1, 5))):
            at = data.draw(st.integers(0, buffers.layout.size - 1))
            put = data.draw(st.binary(min_size=1, max_size=400))[: buffers.layout.size - at]
            buffers.block.write(at, put)
        assert again(buffers).checkpoint("wide") in {complete(1), NotShared.LOST}
        assert again(buffers).latest("wide.out") in {pattern(1), None}
        assert again(buffers).latest("far.out") in {pattern(1), None}
        assert buffers.latest("wide.out") in {pattern(1), None}
        again(buffers).commit("wide", complete(2))
        assert buffers.latest("wide.out") == pattern(2)


def test_a_damaged_word_does_not_bring_back_what_was_before(buffers: SharedMemoryBuffers) -> None:
    """Every byte of the word, changed to everything."""
    buffers.commit("wide", complete(1))
    at = buffers.layout.regions["wide"].at
    word = buffers.block.read(at, 8)
    for byte in range(8):
        for value in range(256):
            buffers.block.write(at, word[:byte] + bytes([value]) + word[byte + 1 :])
            assert again(buffers).checkpoint("wide") in {complete(1), NotShared.LOST}


def test_a_block_of_noise_holds_nothing(buffers: SharedMemoryBuffers) -> None:
    for seed in range(200):
        buffers.block.write(0, seeded(seed).randbytes(buffers.layout.size))
        assert again(buffers).checkpoint("wide") is NotShared.LOST
        assert again(buffers).latest("far.out") is None


def test_a_reader_never_sees_half_a_value(buffers: SharedMemoryBuffers, tmp_path: Path) -> None:
    """The writer is killed now and then; numbers only go up, and every value is whole."""
    last, seen = {"wide.out": 0, "far.out": 0}, 0
    for turn in range(3):
        ready = tmp_path / str(turn)
        writer = multiprocessing.get_context("spawn").Process(
            target=hammer, args=(buffers.block.name, str(ready))
        )
        writer.start()
        until(ready.exists, "the writer does not write")
        start, end = seen, time.monotonic() + 0.8
        while time.monotonic() < end or seen < start + 100:
            for name, before in last.items():
                values = buffers.latest(name)
                if values is not None and values[0] != before:
                    assert values == pattern(int(values[0]))
                    assert values[0] > before
                    last[name] = int(values[0])
                    seen += 1
        writer.kill()
        writer.join()
        writer.close()
        fresh = again(buffers)
        found = fresh.latest("wide.out")
        assert found is not None
        assert found == pattern(int(found[0]))
        assert fresh.checkpoint("wide") == complete(int(found[0]))


def test_a_reader_gives_up_on_a_writer_that_never_rests(buffers: SharedMemoryBuffers) -> None:
    """It keeps the value that it has."""
    buffers.publish("far.out", pattern(1))
    region = buffers.layout.regions["far.out"]
    busy = Busy(buffers.block.name, Block.attach(buffers.block.name)._memory)
    busy.at, busy.count = region.at, 0
    reader = SharedMemoryBuffers(busy, buffers.layout)
    assert reader.latest("far.out") is None
    assert busy.count > TRIES
    busy.close()


class Busy(Block):
    """A block whose words never stay the same."""

    __slots__ = ("at", "count")
    at: int
    count: int

    def word(self, at: int) -> int:
        self.count += 1
        return self.count if at == self.at else super().word(at)


# --- levels ---


def sign_of(repo: Path, program: str) -> Signature:
    return signature(repo / f"generated/c/{program}.json")


def started(repo: Path, first: int) -> Values:
    """TASK's initial state, but that its numbers begin elsewhere."""
    sign = sign_of(repo, "task")
    values = list(executors(alone(repo), {"task": sign}, "python")["task"].values())
    for name in ("to_emove.inc_command", "from_emove.inc_command_echo"):
        values[sign.index[name]] = first
    return tuple(values)


def reference(repo: Path, folder: Path, rounds: int, first: int, below: int) -> Values:
    """The same commands in one process; the state at the end."""
    folder.mkdir()
    sent = Sender(str(folder / "sent"), rounds, first)
    stand_in = Below(str(folder / "below"), 2, below)
    system = assemble(alone(repo), "python", queries(), (sent, stand_in))
    system.level("task").restore(started(repo, below))
    while not sent.over:
        system.step()
    return system.level("task").values


def lines(path: Path) -> list[tuple[int, ...]]:
    return [tuple(map(int, line.split())) for line in path.read_text().splitlines()]


def same_orders(folder: Path) -> None:
    """As without a kill; whether the PAUSE at the end was still seen depends on who ended first."""
    found, expected = lines(folder / "below"), lines(folder / "reference/below")
    most = max(found, expected, key=len)
    assert len(most) - 1 <= len(found)
    assert found[: len(expected)] == expected[: len(found)]


def answered_once(path: Path, count: int, first: int) -> None:
    """Every number is answered, in order; no number is at work again after its answer."""
    said = lines(path)
    while said[0][0] != first:  # what TASK says before the first
        said.pop(0)
    answers = [(number, status) for number, status, _ in said if status != EXECUTING]
    numbers = [(first + at) % NUMBERS for at in range(count)]
    assert answers == [(number, DONE) for number in numbers]
    begun = [number for number, *_ in said]
    assert [number for at, number in enumerate(begun) if at == 0 or begun[at - 1] != number] == numbers


COMPILER = {
    "rcsc.lang.model", "rcsc.code.emit.plan", "rcsc.proof.solvers", "rcsc.proof.symbolic", "rcsc.proof.table",
    "rcsc.lang.resolve", "rcsc.lang.syntax.tree",
}  # fmt: skip


@pytest.mark.parametrize(
    ("loads", "never"),
    [
        ("rcsc.run.processes.serve, rcsc.run.plant.staging", COMPILER | {"numpy", "mujoco"}),  # a level
        ("rcsc_cell.episodes.stage", COMPILER | {"numpy", "mujoco"}),  # what answers its feeds in the cell
        ("rcsc.run.campaign.work, rcsc_cell.episodes.kind", COMPILER | {"mujoco"}),  # episodes by kinematics
    ],
)
def test_a_process_loads_only_what_it_needs(loads: str, never: set[str]) -> None:
    """A level begins again in the middle of a run: what it loads is how long the others wait."""
    told = f"import {loads}, sys; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    assert set(loads.split(", ")) <= set(ran.stdout.split())
    assert set(ran.stdout.split()) & never == set()


def test_kill_minus_nine_loses_no_command_and_runs_none_twice(repo: Path, tmp_path: Path) -> None:
    """Killed at random instants; numbers of both levels wrap on the way; orders are those of a run without a kill."""
    rounds, below, most = 8, 65516, 24
    expected = reference(repo, tmp_path / "reference", rounds, FIRST, below)
    chance, kills, orders = seeded(1), 0, tmp_path / "below"
    orders.touch()
    system = Supervisor(
        alone(repo), "python", outside(tmp_path, rounds, FIRST, below), queries=QUERIES, rate=8.0
    )
    system.buffers.commit("task", started(repo, below))
    with system:
        while not system.over:
            system.check()
            goal = len(lines(orders)) + chance.randint(0, 2)
            until(lambda: system.over or len(lines(orders)) >= goal, "TASK gives no orders")  # noqa: B023  # called here
            time.sleep(chance.uniform(0, 0.03))
            if kills < most:
                system.stop("task", signal.SIGKILL)
                assert system.code("task") == -signal.SIGKILL
                system.start("task")
                kills += 1
        found = system.buffers.checkpoint("task")
    assert kills >= 10
    same_orders(tmp_path)
    answered_once(tmp_path / "sent", rounds * len(ROUND), FIRST)
    stock = sign_of(repo, "task").index["tbuffer_boxt"]
    assert isinstance(found, tuple)
    assert found[stock] == expected[stock] == 10 - rounds


@pytest.mark.parametrize("busy", [1, 3])
def test_a_level_killed_at_any_step_goes_on(repo: Path, tmp_path: Path, busy: int) -> None:
    """In one process, so that every kill is where it is wanted: before a cycle, before its commit, after it."""
    rounds, first, below = 3, FIRST, 65530
    expected = reference(repo, tmp_path / "reference", rounds, first, below)
    system, sign = alone(repo), sign_of(repo, "task")
    chance = seeded(busy)
    sent, stand_in = (
        Sender(str(tmp_path / "sent"), rounds, first),
        Below(str(tmp_path / "below"), busy, below),
    )
    with created(layout(system, {"task": sign})) as buffers:
        buffers.commit("task", started(repo, below))
        level = None
        for tick in range(5000):
            if level is None:
                level = assemble(system, "python", queries()).level("task")
                begin(level, again(buffers))
            which = chance.random()
            if which < 0.2:
                level.take(buffers)
                level.run()
                level = None  # before it could commit
            elif which < 0.9:
                cycle(level, buffers)
                level = level if which < 0.8 else None
            both: list[Outside] = [sent, stand_in]
            for other in chance.sample(both, chance.randint(0, 2)):
                for name, values in other.step(tick, again(buffers).latest).items():
                    buffers.publish(name, values)
            if sent.over:
                break
        assert sent.over
        found = buffers.checkpoint("task")
    same_orders(tmp_path)
    answered_once(tmp_path / "sent", rounds * len(ROUND), first)
    assert isinstance(found, tuple)
    assert found[sign.index["tbuffer_boxt"]] == expected[sign.index["tbuffer_boxt"]]


def test_a_level_with_a_lost_state_starts_safely(repo: Path, tmp_path: Path) -> None:
    """The order in its buffer is not run again; PAUSE goes down with a new number; the next command is run."""
    sign = sign_of(repo, "task")
    system = Supervisor(
        alone(repo),
        "c",
        {"below": Factory(f"{HERE}:below", (str(tmp_path / "below"), 2, 0))},
        queries=QUERIES,
        rate=0,
    )
    region = system.buffers.layout.regions["task"]

    def report() -> Values:
        return system.buffers.latest("task.to_workstation") or (0,) * 6

    with system:
        system.buffers.publish("workstation.order", (41, *ROUND[0]))
        until(lambda: report()[:3] == (41, ACQUIRE, DONE), "ACQUIRE is not done")
        until(lambda: lines(tmp_path / "below")[-1][1] == PAUSE, "no PAUSE after ACQUIRE")
        before = lines(tmp_path / "below")
        system.stop("task", signal.SIGKILL)
        system.buffers.block.write(region.at, seeded(3).randbytes(2 * region.slot))
        system.start("task")
        until(lambda: report()[2] != DONE, "nothing is said of the restart")
        restart = sign.leaves[sign.index["to_workstation.failure"]].members.index("restart")
        assert report() == (41, ACQUIRE, 2, 0, restart, 0)
        until(lambda: len(lines(tmp_path / "below")) > len(before), "no PAUSE goes down")
        assert lines(tmp_path / "below") == [*before, ((before[-1][0] + 1) % NUMBERS, PAUSE)]
        system.buffers.publish("workstation.order", (42, *ROUND[0]))
        until(lambda: report()[:3] == (42, ACQUIRE, DONE), "the next command is not done")
        with pytest.raises(ValueError, match="runs"):
            system.start("task")
    assert system.buffers.block.name not in {path.name for path in FOLDER.glob("*")}


def test_a_run_of_all_processes_ends_and_leaves_nothing(repo: Path, tmp_path: Path) -> None:
    """From outside: nothing on the standard error stream, no block left, nothing lost by processes that somebody killed."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(repo=str(repo), folder=str(tmp_path)))
    ran = subprocess.Popen(
        [sys.executable, str(script)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    said = ran.communicate()
    assert (ran.returncode, *said) == (0, "over\n", "")
    answered_once(tmp_path / "sent", len(ROUND), 1)
    assert blocks_of(ran) == []


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_run_that_is_ended_leaves_nothing(repo: Path, tmp_path: Path, how: signal.Signals) -> None:
    """After SIGKILL, too: the processes miss who started them."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(repo=str(repo), folder=str(tmp_path)).replace(", 1, 1)", ", 100000, 1)"))
    ran = subprocess.Popen(
        [sys.executable, str(script)], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    until((tmp_path / "below").exists, "it does not run")
    assert blocks_of(ran)
    ran.send_signal(how)
    said = ran.communicate()[1]
    assert how is signal.SIGKILL or said.rstrip().endswith("KeyboardInterrupt")
    assert said.count("Traceback") == (how is not signal.SIGKILL)
    assert "resource_tracker" not in said
    until(lambda: not blocks_of(ran), "a block is left")


def blocks_of(made_by: subprocess.Popen[str]) -> list[Path]:
    """Blocks of this process alone: others may run."""
    return list(FOLDER.glob(f"{PREFIX}{made_by.pid}-*"))


SCRIPT = """
import sys
from pathlib import Path

sys.path.insert(0, {repo!r})
from rcsc.run.processes.supervisor import run_processes
from tests.support.processes_outside import QUERIES, alone, outside

if __name__ == "__main__":
    run_processes(alone(Path({repo!r})), "python", outside(Path({folder!r}), 1, 1), queries=QUERIES, rate=0)
    print("over")
"""


def test_an_exception_outside_is_reported(repo: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ChildProcessError, match="process `bad` ended with code 1"):
        run_processes(alone(repo), "python", {"bad": Factory("no_such_module:f")}, queries=QUERIES, rate=0)
    assert "no_such_module" in capfd.readouterr().err


def test_a_state_that_no_cycle_may_begin_with_is_refused_by_name(
    repo: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    values, sign = list(started(repo, 0)), sign_of(repo, "task")
    values[sign.index["tbuffer_boxt"]] = 255
    system = Supervisor(alone(repo), "python", outside(tmp_path, 1, 1), queries=QUERIES, rate=0)
    system.buffers.commit("task", tuple(values))
    with system:
        until(lambda: system.code("task") is not None, "TASK goes on")
        with pytest.raises(
            StateTableError, match=r"level `task` cannot go on from this state: `tbuffer_boxt` = 255"
        ):
            system.check()
    assert "Traceback" not in capfd.readouterr().err


def test_what_no_buffer_can_hold_is_refused_by_name(repo: Path) -> None:
    with pytest.raises(StateTableError, match=r"buffer `emove\.to_task` cannot hold what was published"):
        run_processes(alone(repo), "python", {"wrong": Factory(f"{HERE}:wrong")}, queries=QUERIES, rate=0)


# --- adopt ---


def value(leaf: Leaf) -> st.SearchStrategy[Value]:
    if leaf.c_type == "bool":
        return st.booleans()
    if leaf.members:
        return st.integers(0, len(leaf.members) - 1)
    assert leaf.low is not None
    assert leaf.high is not None
    if leaf.c_type == "double":
        return st.floats(leaf.low, leaf.high)
    low, high = int(leaf.low), int(leaf.high)
    return st.sampled_from([low, high]) | st.integers(low, high)


@pytest.mark.parametrize("name", LEVELS)
@given(data=st.data())
@settings(max_examples=60)
def test_whatever_is_in_the_buffers_an_adopted_level_rests(
    repo: Path, name: str, data: st.DataObject
) -> None:
    """Three cycles after it: the command has failed, the levels below have PAUSE with a number that they have not echoed."""
    sign = sign_of(repo, name)
    system = Description(name, repo / "generated", repo, 40, (LevelSpec(name, name, ()),), ())
    executor = executors(system, {name: sign}, "python")[name]
    above = sign.leaves[0].name.partition(".")[0]
    assert f"to_{above}.inc_command_echo" in sign.index
    inputs = [at for at, leaf in enumerate(sign.leaves) if leaf.kind == "input"]
    for at in inputs:
        executor.put(at, (data.draw(value(sign.leaves[at])),))
    values = adopt(sign, executor.values())
    assert [values[at] for at in inputs] == [executor.values()[at] for at in inputs]
    executor.put(0, values[: len(sign.leaves)])
    for _ in range(3):
        assert executor.cycle() == 0
    now = dict(zip((leaf.name for leaf in sign.leaves), executor.values(), strict=False))
    assert now[f"to_{above}.inc_command_echo"] == now[f"{above}.inc_command"]
    if now[f"{above}.input_command"] != PAUSE:
        assert shown(sign, now, f"to_{above}.status_report") == "failed"
        assert shown(sign, now, f"to_{above}.failure") == "restart"
    for leaf in sign.leaves:
        record, _, part = leaf.name.partition(".")
        if record.startswith("to_") and part == "inc_command":
            assert now[leaf.name] == (now[f"from_{record[3:]}.inc_command_echo"] + 1) % NUMBERS
            assert now[f"{record}.input_command"] == PAUSE


def shown(sign: Signature, now: dict[str, Value], name: str) -> str:
    return sign.leaves[sign.index[name]].shown(now[name])


def test_adopting_wraps_and_changes_nothing_else(repo: Path) -> None:
    sign = sign_of(repo, "task")
    values = list(started(repo, 65535))
    values[sign.index["workstation.inc_command"]] = 9
    values[sign.index["workstation.obj"]] = TBOX
    values[sign.index["workstation.source_locpt"]] = STORE
    adopted = adopt(sign, tuple(values))
    changed = {
        sign.leaves[at].name: adopted[at] for at in range(len(sign.leaves)) if adopted[at] != values[at]
    }
    assert changed == {
        "inc_command_seen": 9,
        "cur_state": 1,
        "cur_state.next": 1,
        "to_workstation.status_report": 2,
        "to_workstation.failure": sign.leaves[sign.index["to_workstation.failure"]].members.index("restart"),
        "to_emove.inc_command": 0,
    }
    assert adopt(sign, adopted) == adopted


def test_a_program_without_the_convention_is_left_as_it_is() -> None:
    leaf = Leaf("cur_state", "state", "", "", "uint8_t", ("a", "b"), None, None, "", 0, "")
    sign = Signature("p", "", "", (leaf,), {}, (), (), {"cur_state": 0})
    assert adopt(sign, (1, *TRACE)) == (1, *TRACE)


def test_common_memory_and_shared_memory_are_used_alike(buffers: SharedMemoryBuffers) -> None:
    for transport in (CommonMemory(), buffers):
        transport.publish("far.out", pattern(1))
        transport.publish("far.out", pattern(2))
        assert transport.latest("far.out") == pattern(2)


# --- who waits for whom ---


class Scene:
    """Three clocks, `a` of 40 ms, `b` of 40 ms and `c` of 80 ms, and a time of its own: what happens while somebody sleeps."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, block: Block) -> None:
        self.clocks = Clocks(block, 0, {"a": 40, "b": 40, "c": 80})
        self.turn = Turn(self.clocks, "a")
        self.now_s, self.meanwhile = 0.0, list[Callable[[], None]]()
        stub = SimpleNamespace(monotonic=lambda: self.now_s, sleep=self.sleep)
        monkeypatch.setattr("rcsc.run.processes.clocks.time", stub)

    def sleep(self, seconds: float) -> None:
        assert seconds <= LONGEST_NAP_S
        self.now_s += seconds
        if self.meanwhile:
            self.meanwhile.pop(0)()

    def all_at(self, now_ms: int) -> None:
        for name in self.clocks.periods_ms:
            self.clocks.set(name, now_ms)

    def waited(self) -> bool:
        """Whether `a` had to wait, and until everything had happened."""
        before = self.now_s
        self.turn.wait()
        assert not self.meanwhile, "it did not wait to the end"
        return self.now_s > before


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Iterator[Scene]:
    block = Block.create(Clocks.size(3))
    try:
        yield Scene(monkeypatch, block)
    finally:
        block.unlink()
        block.close()


@pytest.mark.parametrize(
    ("own_ms", "b_ms", "c_ms", "waits"),
    [
        (0, 0, 0, False),
        (40, 0, 0, False),
        (80, 40, 0, False),
        (80, 0, 80, True),  # more than a period of 40 ms behind
        (120, 80, 40, False),
        (160, 120, 40, True),  # more than a period of 80 ms
        (0, 4000, 4000, False),  # who is furthest behind never waits
    ],
)
def test_nobody_begins_a_cycle_while_another_is_more_than_its_period_behind(
    scene: Scene, own_ms: int, b_ms: int, c_ms: int, waits: bool
) -> None:
    for name, now_ms in {"a": own_ms, "b": b_ms, "c": c_ms}.items():
        scene.clocks.set(name, now_ms)
    if waits:
        scene.meanwhile = [lambda: None, lambda: scene.all_at(own_ms)]
    assert scene.waited() is waits


def test_who_never_began_is_not_waited_for_and_who_begins_again_is(scene: Scene) -> None:
    scene.clocks.set("a", 4000)
    assert not scene.waited()
    scene.clocks.set("b", 80)
    scene.clocks.start("b")
    assert scene.clocks.now_ms("b") == 80
    scene.meanwhile = [lambda: scene.clocks.set("b", 4000)]
    assert scene.waited()


def test_who_does_not_move_is_waited_for_once(scene: Scene) -> None:
    """Then the others go on without it; when it moves it is where they are, waited for again, and has to make up for nothing."""
    for name, now_ms in {"a": 400, "b": 40, "c": 400}.items():
        scene.clocks.set(name, now_ms)
    assert scene.waited()
    assert MOST_WAIT_S < scene.now_s < MOST_WAIT_S + 1
    for _ in range(5):
        scene.turn.done()
        scene.clocks.set("c", scene.turn.now_ms)
        assert not scene.waited()
    assert scene.clocks.left("b")
    assert scene.clocks.common_end_ms() == scene.turn.now_ms + 1 == 601
    Turn(scene.clocks, "b").done()
    assert scene.clocks.now_ms("b") == 560
    assert not scene.clocks.left("b")
    scene.clocks.set("a", 640)
    scene.meanwhile = [lambda: None, lambda: scene.clocks.set("b", 600)]
    assert scene.waited()


def test_in_step_all_run_a_cycle_before_one_begins_the_next(scene: Scene) -> None:
    """And wait for one that does not move for as long as it takes."""
    in_step = Clocks(scene.clocks.block, 0, scene.clocks.periods_ms, in_step=True)
    scene.turn = Turn(in_step, "a")
    scene.all_at(80)
    assert not scene.waited()
    scene.turn.done()
    nothing: list[Callable[[], None]] = [lambda: None] * int(2 * MOST_WAIT_S / LONGEST_NAP_S)
    scene.meanwhile = [*nothing, lambda: scene.all_at(120)]
    assert scene.waited()
    assert in_step.common_end_ms() == 121
    in_step.set("a", 160)
    assert in_step.common_end_ms() == 121, "`a` cannot have begun what the others are not at"


def test_a_wait_ends_when_it_is_told(scene: Scene) -> None:
    told: list[int] = []
    scene.clocks.set("a", 400)
    scene.clocks.set("b", 0)
    scene.meanwhile = [lambda: None, lambda: told.append(signal.SIGTERM)]
    beats = scene.clocks.beats("a")
    scene.turn.wait(told)
    assert scene.now_s < 1
    assert scene.clocks.beats("a") == beats + 3, "who waits shows that it is alive"


def test_no_process_runs_ahead_of_one_that_gets_no_processor(repo: Path, tmp_path: Path) -> None:
    """What stands outside is stopped for a while, again and again, as by a busy machine: nothing happens that it does not see."""
    stops = list[int]()

    def watch(system: Supervisor) -> None:
        now_ms = system._clocks.now_ms("below") or 0
        if now_ms < 400 * (len(stops) + 1) or len(stops) == 3:
            return
        pid = system._running["below"].pid or 0
        os.kill(pid, signal.SIGSTOP)
        time.sleep(0.15)
        stopped_ms = system._clocks.now_ms("below") or 0
        stops.append(max(system._clocks.now_ms(name) or 0 for name in ("task", "sender")) - stopped_ms)
        os.kill(pid, signal.SIGCONT)

    run_processes(
        alone(repo), "python", outside(tmp_path, 10, 1), queries=QUERIES, rate=20.0, watch=watch
    )  # fmt: skip
    assert len(stops) == 3
    assert max(stops) <= 80, "a period that it may be ahead, and the one that it has just run"
    answered_once(tmp_path / "sent", 10 * len(ROUND), 1)


# --- what stands still ---


def stopped_at(
    holds: Callable[[], bool], name: str, then: Callable[[], None] | None = None
) -> Callable[[Supervisor], None]:
    """Stops a process as SIGSTOP does, once, as soon as that holds."""
    done: list[int] = []

    def watch(system: Supervisor) -> None:
        if not done and holds() and system.runs(name):
            pid = system._running[name].pid
            assert pid is not None
            os.kill(pid, signal.SIGSTOP)
            done.append(pid)
            if then is not None:
                then()

    return watch


def test_a_level_that_is_stopped_is_noticed_and_goes_on(repo: Path, tmp_path: Path) -> None:
    """Nothing is lost and nothing is done twice; what happened is told by the level's name."""
    told: list[str] = []
    run_processes(
        alone(repo), "python", outside(tmp_path, 2, 1), queries=QUERIES, rate=8.0,
        watch=stopped_at((tmp_path / "below").exists, "task"), told=told.append,
    )  # fmt: skip
    assert told == ["level `task` stood still (stopped by a signal); it is started again"]
    answered_once(tmp_path / "sent", 2 * len(ROUND), 1)


def test_what_stands_still_outside_ends_the_run_by_its_name(repo: Path, tmp_path: Path) -> None:
    with pytest.raises(ChildProcessError, match="process `below` stands still: stopped by a signal"):
        run_processes(
            alone(repo), "python", outside(tmp_path, 100000, 1), queries=QUERIES, rate=8.0,
            watch=stopped_at((tmp_path / "below").exists, "below"),
        )  # fmt: skip
    assert not list(FOLDER.glob(f"{PREFIX}{os.getpid()}-*"))


def test_what_is_killed_outside_ends_the_run_by_its_name(repo: Path, tmp_path: Path) -> None:
    def watch(system: Supervisor) -> None:
        if (tmp_path / "below").exists() and system.runs("sender"):
            system.stop("sender", signal.SIGKILL)

    with pytest.raises(ChildProcessError, match="process `sender` was killed"):
        run_processes(
            alone(repo), "python", outside(tmp_path, 100000, 1), queries=QUERIES, rate=8.0, watch=watch
        )


SEEN = [
    # of a level: its commits since it was started, of which the second is new; its state;
    # seconds by the clock and of the processor since it was last looked at; what is said
    (2, "T", 100.0, 0.0, ""),
    (1, "T", 0.1, 0.0, ""),
    (1, "T", 1.1, 0.0, "stopped by a signal"),
    (1, "t", 1.1, 0.0, "stopped by a signal"),
    (1, "R", 1000.0, 0.1, ""),  # it gets no processor
    (1, "S", 9.0, 0.1, ""),
    (1, "S", 11.0, 0.1, "waiting for something that does not come"),
    (1, "D", 11.0, 0.1, "waiting for something that does not come"),
    (1, "R", 6.0, 5.1, "5 s of computing without an end of its cycle"),
    (2, "R", 6.0, 5.1, ""),
    (0, "S", 1000.0, 0.1, ""),  # it waits for the compiler of its executor
    (0, "R", 1000.0, 100.0, ""),
    (0, "T", 1.1, 0.0, "stopped by a signal"),
]


@pytest.mark.parametrize(("commits", "state", "clock_s", "cpu_s", "said"), SEEN)
def test_still_is_told_from_late(
    repo: Path,
    monkeypatch: pytest.MonkeyPatch,
    commits: int,
    state: str,
    clock_s: float,
    cpu_s: float,
    said: str,
) -> None:
    """A level whose period is 40 ms, by a clock and a process table of the test's own."""
    now = [0.0, 0.0]
    monkeypatch.setattr("rcsc.run.processes.supervisor.time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr("rcsc.run.processes.supervisor._state", lambda _: (state if now[0] else "R", now[1]))
    system = Supervisor(alone(repo), "python", {}, queries=QUERIES)
    try:
        system.buffers.commit("task", started(repo, 1))
        system._running["task"] = cast(Any, SimpleNamespace(pid=1, is_alive=lambda: True))
        assert system.still() == {}
        if commits:
            system.buffers.commit("task", started(repo, 2))
            assert system.still() == {}
        if commits > 1:
            system.buffers.commit("task", started(repo, 3))
        now[:] = clock_s, cpu_s
        assert system.still() == ({"task": said} if said else {})
    finally:
        system._running.clear()
        system.close()


def test_a_signal_is_heeded_in_a_long_period(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[int] = []
    slept: list[float] = []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        told.append(signal.SIGTERM)

    monkeypatch.setattr(time, "sleep", sleep)
    serve.Paced(3600.0).wait(told)
    serve.Paced(3600.0).wait(told)
    assert slept == [serve.HEED_S]


def test_processes_that_do_not_end_share_one_grace(repo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]

    class Deaf:
        """Ends of nothing but SIGKILL."""

        pid, killed = None, False

        def join(self, timeout: float | None = None) -> None:
            clock[0] += timeout or 0.0

        def is_alive(self) -> bool:
            return not self.killed

        def kill(self) -> None:
            self.killed = True

        def terminate(self) -> None: ...

        def close(self) -> None: ...

    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    system = Supervisor(alone(repo), "python", {})
    deaf = [Deaf() for _ in range(5)]
    system._running = dict(enumerate(deaf))  # type: ignore[arg-type]
    system.close()
    assert all(one.killed for one in deaf)
    assert clock[0] == supervisor.GRACE_S

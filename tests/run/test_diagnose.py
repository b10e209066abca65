"""A system in processes, looked at: every cycle is in its log, and what is not there is said; who attaches steps, sets and leaves it."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.host.files.read import CheckedFields
from rcsc.desk.shell.opening import Opening, opened
from rcsc.desk.studio.hub import Ask
from rcsc.desk.studio.runs.live import Live, Pace
from rcsc.front.commands import run
from rcsc.run.adopt import Begun
from rcsc.run.description import description
from rcsc.run.faults import BadStrength, switch
from rcsc.run.log.read import Log, read
from rcsc.run.log.replay import Replay
from rcsc.run.log.schema import Gap, LoggedEvent, event_of
from rcsc.run.plant.staging import StageOrder
from rcsc.run.processes import serve
from rcsc.run.processes.attach import NotAttached, RunningSystem, attach, find, running
from rcsc.run.processes.block import Block
from rcsc.run.processes.clocks import Clocks, Turn
from rcsc.run.processes.diagnose import Watch
from rcsc.run.processes.memory import SharedMemoryBuffers, layout
from rcsc.run.processes.serve import Factory, Setting, begin, cycle
from rcsc.run.processes.supervisor import Course, Supervisor, run_processes
from rcsc.run.processes.switches import Heeded, Switches
from rcsc.run.system import assemble, signatures
from tests.support.processes_outside import ACQUIRE, QUERIES, ROUND, alone, outside, queries

PATIENCE_S = 600.0
PERIODS = {"task": 40, "below": 40}
RECORDED = (
    "the diagnostic process records nothing more (it was ended by SIGKILL); the system goes on without it"
)


class Common:
    """TASK and what stands below it, by turns in one process; what they write and what the diagnostic process reads are apart."""

    def __init__(self, repo: Path, path: Path) -> None:
        self.system, self.repo, self.path = alone(repo), repo, path
        self.signs = signatures(self.system)
        laid = layout(self.system, self.signs)
        self.task = SharedMemoryBuffers.create(laid, Clocks.size(len(PERIODS)))
        block = self.task.block
        self.below, reads = SharedMemoryBuffers(block, laid), SharedMemoryBuffers(block, laid)
        self.clocks = Clocks(block, laid.size, PERIODS)
        self.watch = Watch(self.system, self.signs, reads, self.clocks, path)
        self.clocks.record(on=True)
        for name in PERIODS:
            self.clocks.start(name)
        self.start()

    def start(self) -> None:
        """As a process that begins, or begins again."""
        self.level = assemble(self.system, "python", queries()).level("task")
        self.task.now_ms = self.clocks.now_ms("task") or 0
        begin(self.level, self.task)

    def run(self, *names: str) -> None:
        """A cycle of each, in this order; before `task` and `below` they have waited for their turn."""
        for name in names:
            turn = Turn(self.clocks, name)
            turn.wait(told=[signal.SIGTERM] if not turn._halted() else [])
            assert not turn._halted()
            now_ms = turn.now_ms
            if name == "task":
                self.task.now_ms = now_ms
                cycle(self.level, self.task)
            else:
                self.below.now_ms = now_ms
                self.below.publish("emove.to_task", (0, 0, now_ms % 2, 0))
                self.below.publish("workstation.order", (1, *ROUND[0]))
            turn.done()

    def log(self) -> Log:
        """The log, once all have ended."""
        self.watch.look(self.clocks.common_end_ms())
        self.watch.close()
        log = read(self.path)
        assert log.complete
        assert Replay(log, self.repo / "generated", "python").first_difference() is None
        return log


@pytest.fixture
def common(repo: Path, tmp_path: Path) -> Iterator[Common]:
    made = Common(repo, tmp_path / "run.mcap")
    try:
        yield made
    finally:
        made.task.block.unlink()
        made.task.close()


def test_a_cycle_waits_until_the_last_but_one_is_read(common: Common) -> None:
    common.run("task", "below", "task", "below")
    third = Turn(common.clocks, "task")
    assert third.now_ms == 80
    assert third._halted()
    common.watch.look()
    assert not third._halted()
    common.run("task", "below")
    level = common.log().level("task")
    assert (level.track.ticks, level.taken, level.gaps) == ([0, 1, 2, 3], None, {})
    common.clocks.set("task", 4000)
    assert third._halted()
    common.clocks.record(on=False)
    assert not third._halted(), "nobody waits for who has ended"


def test_the_log_says_of_which_cycles_the_buffers_were_that_a_level_took(common: Common) -> None:
    """In one process TASK takes in cycle 2 what was given in cycle 1; here what is given in cycle 2, then the same again."""
    common.run("task", "below", "below", "task")
    common.watch.look()
    common.run("task", "below")
    level = common.log().level("task")
    assert level.taken is not None
    assert dict(level.taken) == {2: (2, 2)}


def test_cycles_that_a_level_did_not_have_are_said(common: Common) -> None:
    common.run("task", "below", "below")
    common.watch.look()
    common.clocks.set("task", 80)  # as one that the others have left
    common.watch.look()
    common.run("task", "below")
    level = common.log().level("task")
    assert level.track.ticks == [0, 1, 3]
    assert level.gaps == {2: Gap.NOT_RUN}


def test_what_somebody_has_written_over_is_said_and_not_replayed(common: Common) -> None:
    common.run("task", "below", "task", "below")
    region = common.task.layout.regions["task"]
    common.task.block.write(region.place(common.task.block.word(region.at)) + 40, b"garbage")
    common.watch.look()
    common.run("task", "below")
    log = common.log()
    level = log.level("task")
    assert level.track.ticks == [0, 1, 3]
    assert level.gaps == {2: Gap.UNSEEN}
    replayed = [len(moment.cycles) for moment in Replay(log, common.repo / "generated", "python").moments()]
    assert replayed == [1, 0, 0]


def test_a_level_that_begins_again_is_in_the_log_with_why(common: Common) -> None:
    common.run("task", "below", "task", "below")
    common.watch.look()
    common.watch.note("task", "ended by SIGKILL", 80)
    common.start()
    common.run("task", "below")
    common.watch.look()
    region = common.task.layout.regions["task"]
    common.task.block.write(region.at + 64, bytes(2 * region.slot))
    common.start()
    common.run("task", "below")
    log = common.log()
    assert log.events == (LoggedEvent(3, "task", "ended by SIGKILL"),)
    restarts = [(restart.tick, restart.begun) for restart in log.level("task").restarts]
    assert restarts == [(3, Begun.CHECKPOINT), (4, Begun.ANEW)]


def test_a_level_killed_after_its_commit_does_not_run_that_cycle_again(
    common: Common, monkeypatch: pytest.MonkeyPatch
) -> None:
    common.task.now_ms = 0
    cycle(common.level, common.task)  # and nothing of its clock
    setting = Setting(common.system, QUERIES, 0.0, "python", common.task.block.name, os.getppid(), PERIODS)
    monkeypatch.setattr(serve, "_rounds", lambda *_: ())
    serve.serve_level(setting, "task", cast(Any, SimpleNamespace()))
    assert common.clocks.now_ms("task") == 40
    common.start()
    common.run("below", "task", "below")
    log = common.log()
    assert log.level("task").track.ticks == [0, 1, 2]
    assert {(restart.tick, restart.begun) for restart in log.level("task").restarts} == {
        (2, Begun.CHECKPOINT)
    }


def test_an_event_is_read_as_it_was_written() -> None:
    event = LoggedEvent(7, "task", "stood still: stopped by a signal")
    assert event_of(7, event.content) == event
    for wrong in (event.content + b"x", event.content[:-1], LoggedEvent(7, "task", "\x1b[2J").content, b""):
        with pytest.raises(ValueError, match=r"no event|utf-8"):
            event_of(7, wrong)


# --- in processes of their own ---


@pytest.fixture
def importable(repo: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes find the tests as this one did."""
    monkeypatch.syspath_prepend(str(repo))


@pytest.mark.usefixtures("importable")
def test_a_killed_level_is_in_the_log_of_the_run_which_replays(repo: Path, tmp_path: Path) -> None:
    killed, path = list[int](), tmp_path / "run.mcap"

    def watch(system: Supervisor) -> None:
        if not killed and (tmp_path / "below").exists() and system.runs("task"):
            killed.append(system._clocks.now_ms("task") or 0)
            system.stop("task", signal.SIGKILL)

    run_processes(
        alone(repo), "python", outside(tmp_path, 1, 1), queries=QUERIES, rate=0, course=Course(log=path),
        watch=watch,
    )  # fmt: skip
    log = read(path)
    assert log.complete
    level = log.level("task")
    assert [(event.process, event.what) for event in log.events] == [("task", "ended by SIGKILL")]
    assert [restart.begun for restart in level.restarts] == [Begun.CHECKPOINT]
    assert killed[0] // 40 <= level.restarts[0].tick <= killed[0] // 40 + 3
    assert level.gaps == {}
    assert Replay(log, repo / "generated", "python").first_difference() is None
    orders = {values[level.sign.index["workstation.input_command"]] for _, values in level.track}
    assert ACQUIRE in orders


@pytest.mark.usefixtures("importable")
def test_the_system_goes_on_without_its_diagnostic_process(repo: Path, tmp_path: Path) -> None:
    """The run is longer than the time from one look of the supervisor to the next."""
    told, path = list[str](), tmp_path / "run.mcap"

    def watch(system: Supervisor) -> None:
        if system._recorder is not None and path.exists() and (tmp_path / "below").exists():
            os.kill(system._recorder.process.pid or 0, signal.SIGKILL)

    run_processes(
        alone(repo), "python", outside(tmp_path, 100, 1), queries=QUERIES, rate=0, course=Course(log=path),
        watch=watch, told=told.append,
    )  # fmt: skip
    assert told == [RECORDED]
    assert not read(path).complete


# --- attached ---


@pytest.fixture
def system(dock: Path, tmp_path: Path) -> Iterator[Supervisor]:
    """The docking robot in processes, of which nobody orders anything; its log is `run.mcap`."""
    (dock / "long.csv").write_text("command,cycles\n,90000\n", encoding="utf-8")
    path = dock / "system.toml"
    outside = Factory(
        "rcsc.run.plant.staging:outside", (StageOrder(str(path), script="long"), str(tmp_path / "rows"))
    )
    course = Course(log=tmp_path / "run.mcap", system=path, faults={"wheel_slips": None})
    with Supervisor(description(path), "python", {"outside": outside}, rate=4.0, course=course) as made:
        until(lambda: (made._clocks.now_ms("drive") or 0) > 80, "it does not run")
        yield made


def until(holds: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end, what
        time.sleep(0.002)


def goes_on(system: Supervisor) -> None:
    """All processes run cycles."""
    for name in system._clocks.periods_ms:
        before = system._clocks.now_ms(name) or 0
        until(lambda: (system._clocks.now_ms(name) or 0) > before + 80, f"{name} stands")  # noqa: B023  # called here


def test_a_running_system_is_stepped_set_held_and_let_go(
    system: Supervisor, dock: Path, tmp_path: Path
) -> None:
    found = find(system.buffers.block.name)
    assert (found.name, found.system, found in running()) == ("dock", (dock / "system.toml").resolve(), True)
    commands = opened(Opening(found.system, attached=found))
    session, here = commands.session, commands.session.attached
    assert here is not None
    with pytest.raises(NotAttached, match="somebody else is attached"):
        attach(found, "python", {})
    first = here.tick
    commands.do("step 3")
    assert here.tick == first + 3
    assert set(map(system._clocks.now_ms, system._clocks.periods_ms)) == {40 * here.tick}, "all stand"
    # what is set is what the level goes on from, and nobody else is told
    commands.do("drive.waited = 7")
    set_at = here.tick + 1
    commands.do("step")
    # one level held, the rest goes on
    commands.do("hold drive")
    before = session.system.level("drive").values
    commands.do("step 2")
    assert session.system.level("drive").values == before
    skipped = {here.tick, here.tick - 1}
    commands.do("step drive")
    ran_at = here.tick
    assert "goes on" in commands.do("release drive")[0]
    for refused in ("undo", "restart drive", "freeze drive.report", "reload drive", "step drive"):
        with pytest.raises(Refused):
            commands.do(refused)
    commands.do("step")
    session.leave()
    goes_on(system)
    system.close()
    log = read(tmp_path / "run.mcap")
    drive = log.level("drive")
    assert log.complete
    assert {tick: gap for tick, gap in drive.gaps.items() if tick <= ran_at} == dict.fromkeys(
        skipped, Gap.NOT_RUN
    )
    assert ran_at in drive.track.ticks
    assert [(one.tick, one.begun) for one in drive.restarts] == [(set_at, Begun.HAND)]
    assert drive.set_by_hand(drive.restarts[0]) == {"waited": "7"}
    assert [event.what for event in log.events] == []
    assert Replay(log, dock / "generated", "python").first_difference() is None


def test_a_fault_of_the_plant_is_switched_by_who_is_attached_and_stays_on(
    system: Supervisor, tmp_path: Path
) -> None:
    found = find(system.buffers.block.name)
    commands = opened(Opening(found.system, attached=found))
    session = commands.session

    def rolls() -> bool:
        """After the ticks in which the plant heeds a switch and the level sees the plant."""
        commands.do("step 3")
        before = session.system.level("drive").value("travelled_mm")
        commands.do("step 3")
        return session.system.level("drive").value("travelled_mm") != before

    assert commands.do("faults") == ["wheel_slips"]
    commands.do("order dock")
    commands.do("run until drive.speed_mm_s > 0")
    assert rolls()
    assert commands.do("fault wheel_slips") == ["wheel_slips is on"]
    assert not rolls()
    for wrong, why in (("fault wheel_slip", "no plant has a fault"), ("fault wheel_slips=3", "is on or off")):
        with pytest.raises(Refused, match=why):
            commands.do(wrong)
    session.leave()
    goes_on(system)
    system.let_go()
    commands = opened(Opening(found.system, attached=found))
    session = commands.session
    assert commands.do("faults") == ["wheel_slips is on"]
    assert not rolls()
    commands.do("fault wheel_slips off")
    assert rolls()
    session.leave()
    system.let_go()
    system.close()
    log = read(tmp_path / "run.mcap")
    switched = [event.what for event in log.events if event.what.startswith("fault")]
    assert switched == ["fault wheel_slips is on", "fault wheel_slips is off"]
    assert Replay(log, found.system.parent / "generated", "python").first_difference() is None


def test_a_switch_thrown_twice_is_heeded_once_a_look_with_its_strength() -> None:
    block = Block.create(Switches.size(2))
    try:
        thrown, seen = (Switches(block, 0, {"late": (0.0, 1e3), "dark": None}) for _ in range(2))
        switch((thrown,), "dark", on=True)
        heeded = Heeded(seen)
        assert list(heeded.thrown()) == []
        switch((thrown,), "late=0.1", on=True)
        switch((thrown,), "dark", on=False)
        switch((thrown,), "dark", on=True)
        assert list(heeded.thrown()) == [("late=0.10000000000000001", True), ("dark", True)]
        assert list(heeded.thrown()) == []
        assert seen.on == {"late", "dark"}
        switch((thrown,), "late", on=True)
        assert list(heeded.thrown()) == [("late", True)]
        for wrong in ("late=1001", "late=x", "dark=1"):
            with pytest.raises(BadStrength):
                switch((thrown,), wrong, on=True)
        assert list(heeded.thrown()) == []
    finally:
        block.unlink()
        block.close()


def test_the_studio_lets_it_run_pauses_it_and_lets_it_go(system: Supervisor) -> None:
    work: list[Callable[[], None]] = []
    opening = Opening(find(system.buffers.block.name).system, attached=find(system.buffers.block.name))
    live = Live(opening, lambda *_: None, lambda do, _: work.append(do), Pace(None, runs=True))
    live.open()
    assert live.state()["going"]
    assert live.state()["faults"] == [{"name": "wheel_slips", "on": False}]
    first = live.state()["tick"]
    while live.state()["tick"] < first + 5:
        work.pop(0)()
    assert live.history.last == live.state()["tick"]
    live._on_pause(Ask(CheckedFields({}), lambda _: None, lambda _: None))
    stands = {name: system._clocks.now_ms(name) for name in system._clocks.periods_ms}
    assert set(stands.values()) == {40 * live.state()["tick"]}
    live.close()
    goes_on(system)


def test_who_dies_attached_leaves_the_system_running(system: Supervisor, tmp_path: Path) -> None:
    here = attach(find(system.buffers.block.name), "python", {})
    here.hold("drive", on=True)
    stands = {name: system._clocks.now_ms(name) for name in system._clocks.periods_ms}
    system.let_go()
    assert stands == {name: system._clocks.now_ms(name) for name in stands}, "it lives"
    os.close(here.link.lock)  # as the kernel does
    here.link.memory.close()
    system.let_go()
    assert not system._clocks.held("drive")
    goes_on(system)
    system.close()
    events = [event.what for event in read(tmp_path / "run.mcap").events]
    assert events == ["somebody is attached", "nobody is attached any more"]


def test_a_system_that_has_ended_says_so(system: Supervisor) -> None:
    here = attach(find(system.buffers.block.name), "python", {})
    system.close()
    try:
        here.step()  # the last cycle, which all end with
        with pytest.raises(NotAttached, match="`dock` has ended"):
            here.step()
    finally:
        here.leave()


def test_what_does_not_run_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("rcsc.run.processes.attach.FOLDER", tmp_path)
    (tmp_path / "rcsc-1-x").write_bytes(b"\0" * 9000)
    assert run(["shell", "--attach"]) == 1
    assert "error[RCS728]: no system runs in processes here" in capsys.readouterr().err
    for block in ("rcsc-1-a", "rcsc-1-b"):
        note = RunningSystem("", "dock", tmp_path, ("outside",), {}, 1.0, in_step=False)
        (tmp_path / block).write_bytes(b"\0" * 64 + note.text())
    assert [each.block for each in running()] == ["rcsc-1-a", "rcsc-1-b"]
    assert run(["shell", "--attach", "dock"]) == 1
    assert "2 such systems run: `rcsc-1-a` (dock), `rcsc-1-b` (dock)" in capsys.readouterr().err
    assert run(["studio", "--attach", "dick"]) == 1
    assert "no system `dick` runs" in capsys.readouterr().err
    assert run(["studio", "--attach", "dock", "--alone"]) == 2

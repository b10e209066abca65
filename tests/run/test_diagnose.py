"""The diagnostic process: every cycle of every level is in its log, whatever became of levels, and what is not there is said."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from rcsc.run.adopt import Begun
from rcsc.run.log.read import Log, read
from rcsc.run.log.replay import Replay
from rcsc.run.log.schema import Gap, LoggedEvent, event_of
from rcsc.run.processes import serve
from rcsc.run.processes.clocks import Clocks, Turn
from rcsc.run.processes.diagnose import Watch
from rcsc.run.processes.memory import SharedMemoryBuffers, layout
from rcsc.run.processes.serve import Setting, begin, cycle
from rcsc.run.processes.supervisor import Course, Supervisor, run_processes
from rcsc.run.system import assemble, signatures
from tests.support.processes_outside import ACQUIRE, QUERIES, ROUND, alone, outside, queries

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
    told, path = list[str](), tmp_path / "run.mcap"

    def watch(system: Supervisor) -> None:
        if system._recorder is not None and path.exists() and (tmp_path / "below").exists():
            os.kill(system._recorder.process.pid or 0, signal.SIGKILL)

    run_processes(
        alone(repo), "python", outside(tmp_path, 2, 1), queries=QUERIES, rate=0, course=Course(log=path),
        watch=watch, told=told.append,
    )  # fmt: skip
    assert told == [RECORDED]
    assert not read(path).complete

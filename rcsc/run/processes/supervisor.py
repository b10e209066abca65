"""The whole system as processes: one a level, and one for each thing that stands outside, over shared memory.

In: a description, and factories by name for what a process makes for itself. Out: a `Supervisor`, with which processes are
stopped and started again while the others run; `run_processes`, which runs them all.

Each keeps its own pace, and waits for another that is more than a period behind (`clocks`). A level takes what the
buffers hold, runs a cycle, and commits its state and its outputs in one step. What it sees is at times a cycle older or newer than
in one process; tables that keep the protocol of numbers and echoes do not mind.
"""

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Self

from rcsc.base.host import children
from rcsc.run.description import Description
from rcsc.run.executors import refuse_unproved
from rcsc.run.faults import switch
from rcsc.run.log.schema import fingerprints
from rcsc.run.processes.attach import RunningSystem, is_held
from rcsc.run.processes.clocks import Clocks
from rcsc.run.processes.memory import NotShared, SharedMemoryBuffers, layout
from rcsc.run.processes.serve import FAULTY, MOST_TOLD, REFUSED, Factory, Setting, serve_level, serve_outside
from rcsc.run.processes.switches import Heeded, Strengths, Switches
from rcsc.run.system import Kind, StateTableError, signatures

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess

PATIENCE_S, GRACE_S, LOG_S = 5.0, 0.5, 60.0
"""Seconds until who is told to end is killed: one process, all together, and the one that has a log to close."""
MOST_RESTARTS = 20
STILL_PERIODS, STILL_S = 25, 0.2
"""Periods, and seconds, without a commit after which a process is looked at."""
LOOP_CPU_S, WAIT_S = 5.0, 10.0
"""Seconds without a commit: of computing for a process that loops, of waiting for one that hangs."""


@dataclass(frozen=True, slots=True)
class Course:
    """What is wanted of a run of processes.

    Attributes:
        in_step: Whether each takes what the cycle before left, as in one process.
        log: Where a diagnostic process records every cycle; None for no such process.
        most: Ticks after which all stand; None for no such number.
        system: Path of the description, by which others attach; None where nobody is to.
        faults: Of the plants, that who attaches may switch.
        on: Those of them that are on from the first tick, as `rcsc.run.faults.switch` takes them.
    """

    in_step: bool = False
    log: Path | None = None
    most: int | None = None
    system: Path | None = None
    faults: Strengths = field(default_factory=dict)
    on: tuple[str, ...] = ()


COURSE = Course()


@dataclass(slots=True)
class _Pulse:
    """The time and the signs of a process's last activity.

    Attributes:
        stamp: Of its last commit, 0 for what has no region of its own; and how often it has looked whether its turn has come.
        since_s: By the clock.
        cpu_s: Of the processor, that it had used by then.
        begun: Whether it has been seen to commit since it was started.
    """

    stamp: tuple[int, int]
    since_s: float
    cpu_s: float
    begun: bool


class Supervisor:
    """The processes of one system. As a context: all run inside it, and none is left after it.

    Attributes:
        buffers: The shared memory, to look at and to prepare.
    """

    def __init__(
        self,
        description: Description,
        kind: Kind,
        outside: Mapping[str, Factory],
        *,
        queries: Factory | None = None,
        rate: float = 1.0,
        course: Course = COURSE,
    ) -> None:
        """Lay out the memory; nothing is begun yet.

        Args:
            description: Levels and wires.
            kind: Of the executors.
            outside: Factories of `Sequence[Outside]` by the name of their process.
            queries: Makes the database's questions by name, in each level's process.
            rate: Seconds of the system in one of the clock; 0 is as fast as possible.
            course: What else is wanted of the run.
        """
        self._signs = signatures(description)
        laid = layout(description, self._signs)
        self._outside = outside
        self._running: dict[str, SpawnProcess] = {}
        self._told: dict[str, Connection] = {}
        self._pulses: dict[str, _Pulse] = {}
        self._recorder: _Recording | None = None
        self._read_s = time.monotonic()
        periods_ms = dict.fromkeys(outside, description.tick_ms) | {
            name: sign.level_of(name).period_ms for name, sign in self._signs.items()
        }
        self._still_s = {
            name: max(STILL_S, STILL_PERIODS * period_ms / 1000 / (rate or 1.0))
            for name, period_ms in periods_ms.items()
        }
        self._attached, self._closed = 0, False
        note = _note(description, tuple(outside), rate, course)
        behind = Clocks.size(len(periods_ms)) + Switches.size(len(course.faults))
        self.buffers = SharedMemoryBuffers.create(laid, behind + len(note))
        self.buffers.block.write(laid.size + behind, note)
        self._setting = Setting(
            description, queries, rate, kind, self.buffers.block.name, os.getpid(), periods_ms, course.in_step,
            course.faults,
        )  # fmt: skip
        switches = self._setting.switches(self.buffers)
        for fault in course.on:
            switch((switches,), fault, on=True)
        self._heeded = Heeded(switches)
        self._clocks, self._log = self._setting.clocks(self.buffers), course.log
        if course.most is not None:
            self._clocks.stop_at(course.most * description.tick_ms)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the processes: the levels from the top down, then the parts outside."""
        return *self._signs, *self._outside

    def __enter__(self) -> Self:
        try:
            if self._log is not None:
                self._recorder = _recording(self._setting, self._log)
                self._clocks.record(on=True)
            for name in self.names:
                self.start(name)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self, name: str) -> None:
        """Start a process; again, if it has ended. Others wait for it, until `clocks.MOST_WAIT_S` are over.

        Raises:
            ValueError: The process runs already.
        """
        if self.runs(name):
            raise ValueError(f"`{name}` runs")
        told, tells = children.pipe()
        work: tuple[Callable[..., None], tuple[Any, ...]] = (
            (serve_level, (self._setting, name, tells))
            if name in self._signs
            else (serve_outside, (self._setting, name, self._outside[name], tells))
        )
        self._clocks.start(name)
        process = children.process(name, work[0], *work[1])
        children.start(process)
        tells.close()
        self._running[name] = process
        if name in self._told:
            self._told[name].close()
        self._told[name] = told
        self._pulses.pop(name, None)

    def stop(self, name: str, how: signal.Signals = signal.SIGTERM) -> None:
        """End a process: with SIGTERM after its cycle, with SIGKILL at once."""
        process = self._running[name]
        if process.pid is not None and process.is_alive():
            os.kill(process.pid, how)
        _ended(process, time.monotonic() + PATIENCE_S)

    def runs(self, name: str) -> bool:
        """Tell whether a process has been started and has not ended."""
        return name in self._running and self._running[name].is_alive()

    def code(self, name: str) -> int | None:
        """Return the exit code of a process: 0 well, a negative number by that signal; None while it runs."""
        return self._running[name].exitcode

    @property
    def over(self) -> bool:
        """True once a process outside the levels has ended well, or all have run as many ticks as they are to."""
        return any(self.code(name) == 0 for name in self._outside) or self._at_end

    def let_go(self) -> None:
        """Let all go on where who was attached has died; have the log say who comes and goes, and which faults are switched."""
        name, now = self.buffers.block.name, self._clocks.attached
        if now and not is_held(name):
            self._clocks.let_go()
            now = 0
        if now != self._attached:
            self.note("", "somebody is attached" if now else "nobody is attached any more")
            self._attached = now
        for fault, on in self._heeded.thrown():
            self.note("", f"fault {fault} is {'on' if on else 'off'}")

    @property
    def _at_end(self) -> bool:
        """Whether no process has a cycle left."""
        limit_ms = self._clocks.limit_ms
        return limit_ms is not None and self._clocks.all_at(limit_ms)

    def note(self, name: str, what: str) -> None:
        """Have the log say what became of a process, or "" of the system."""
        now_ms = [self._clocks.now_ms(each) or 0 for each in ((name,) if name else self._clocks.periods_ms)]
        if self._recorder is not None:
            with contextlib.suppress(OSError):  # it has ended, and `unrecorded` says so
                self._recorder.tells.send((name, what, max(now_ms)))

    def unrecorded(self) -> str:
        """Return the reason why nothing is recorded any more, once: nobody waits for the diagnostic process from then on."""
        held, now_s = self._recorder, time.monotonic()
        if held is None:
            return ""
        code, state = held.process.exitcode, _state(held.process.pid or 0)[0]
        if state not in STOPPED | WAITING or not any(map(self._waits_for_log, self._clocks.periods_ms)):
            self._read_s = now_s
        if code is None and now_s - self._read_s < WAIT_S:
            return ""
        self._clocks.record(on=False)
        self._recorder = None
        why = "it ended" if code is not None else f"the others have waited {WAIT_S:g} s for it"
        if code is not None and code < 0:
            why = f"it was ended by {signal.Signals(-code).name}"
        elif code == REFUSED and held.told.poll():
            why = held.told.recv_bytes(MOST_TOLD).decode(errors="replace")
        held.end(0.0)
        return f"the diagnostic process records nothing more ({why}); the system goes on without it"

    def _waits_for_log(self, name: str) -> bool:
        """Whether a process waits for the diagnostic process, which has begun to read it."""
        now_ms = self._clocks.now_ms(name)
        return now_ms is not None and self._clocks.read_ms(name) > 0 and self._clocks.unread(name, now_ms)

    def check(self) -> None:
        """Check for processes that ended by themselves.

        Raises:
            StateTableError: A level met a fault, or was refused a state or values.
            ChildProcessError: A process ended by an exception; what it was stands on the standard error stream.
        """
        for name in self._running:
            code = self.code(name)
            if code == REFUSED and self._told[name].poll():
                raise StateTableError(self._told[name].recv_bytes(MOST_TOLD).decode(errors="replace"))
            if code == FAULTY and name in self._signs:
                raise StateTableError(self._message(name))
            if code is not None and code > 0:
                raise ChildProcessError(f"process `{name}` ended with code {code}")

    def killed(self) -> tuple[str, ...]:
        """Return the processes that a signal ended."""
        return tuple(name for name in self._running if (self.code(name) or 0) < 0)

    def still(self) -> dict[str, str]:
        """Return the running processes that stand still, and why: each was stopped, loops, or waits."""
        reasons = {name: self._why_still(name) for name in self._running if self.runs(name)}
        return {name: why for name, why in reasons.items() if why}

    def _why_still(self, name: str) -> str:
        region = self.buffers.layout.regions.get(name)
        commit = 0 if region is None else self.buffers.block.word(region.at)
        stamp = commit, self._clocks.beats(name)
        state, cpu_s = _state(self._running[name].pid or 0)
        now_s, pulse = time.monotonic(), self._pulses.get(name)
        idle = region is None and state not in STOPPED  # nothing is known of what it does
        if pulse is None or pulse.stamp != stamp or idle:
            self._pulses[name] = _Pulse(stamp, now_s, cpu_s, begun=pulse is not None and not idle)
            return ""
        if now_s - pulse.since_s < self._still_s[name]:
            return ""
        if state in STOPPED:
            return "stopped by a signal"
        if not pulse.begun:  # it loads, or waits for its executor's compiler, however slow that is
            return ""
        if cpu_s - pulse.cpu_s > LOOP_CPU_S:
            return f"{LOOP_CPU_S:g} s of computing without an end of its cycle"
        waits = state in WAITING and now_s - pulse.since_s > max(WAIT_S, self._still_s[name])
        return "waiting for something that does not come" if waits else ""

    def close(self) -> None:
        """End all processes, after the same cycle where a diagnostic process records them, and remove the shared memory."""
        with children.interrupts_held():
            if self._closed:
                return
            self._closed = True
            self._clocks.let_go()
            if self._recorder is not None:
                self._end_together()
            for process in self._running.values():
                process.terminate()
            until_s = time.monotonic() + GRACE_S
            for process in self._running.values():
                _ended(process, until_s)
                process.close()
            self._running.clear()
            for told in self._told.values():
                told.close()
            if self._recorder is not None:
                with contextlib.suppress(OSError):
                    self._recorder.tells.send(self._clocks.limit_ms)
                self._recorder.end(LOG_S)
            self.buffers.block.unlink()
            self.buffers.close()

    def _end_together(self) -> None:
        """Let every process run the cycles that another has begun, so that the log ends with a whole one."""
        end_ms = self._clocks.common_end_ms()
        if (limit_ms := self._clocks.limit_ms) is None or end_ms < limit_ms:
            self._clocks.stop_at(end_ms)
        seen, since_s, used_s = dict[str, tuple[int | None, int]](), time.monotonic(), dict[str, float]()
        while not self._at_end and not self.unrecorded():
            for name in self._clocks.periods_ms:
                if not self.runs(name) or self._clocks.left(name):
                    self._clocks.leave(name)
            states = {name: _state(self._running[name].pid or 0) for name in self._running if self.runs(name)}
            now = {name: (self._clocks.now_ms(name), self._clocks.beats(name)) for name in states}
            if now != seen:
                seen, since_s = now, time.monotonic()
                used_s = {name: cpu_s for name, (_, cpu_s) in states.items()}
            patient = time.monotonic() - since_s < PATIENCE_S
            if not patient and all(
                state in STOPPED | WAITING or cpu_s - used_s[name] > LOOP_CPU_S
                for name, (state, cpu_s) in states.items()
            ):
                return
            time.sleep(0.001)

    def _message(self, name: str) -> str:
        values = self.buffers.checkpoint(name)
        if isinstance(values, NotShared):
            return f"level `{name}`: a fault"
        sign = self._signs[name]
        level = sign.level_of(name)
        table = f", table `{sign.table_of(level, values)}`" if level.stages else ""
        return f"level `{name}`{table}: {sign.fault_seen(level, values)}"


def _note(description: Description, outside: tuple[str, ...], rate: float, course: Course) -> bytes:
    """Return the end of the block, by which others attach; empty where nobody is to."""
    if course.system is None:
        return b""
    path = course.system.resolve()
    found = RunningSystem(
        "", description.name, path, outside, fingerprints(description), rate, course.in_step, course.faults
    )
    return found.text()


@dataclass(frozen=True, slots=True)
class _Recording:
    """The diagnostic process.

    Attributes:
        told: What it says.
        tells: What is said to it.
    """

    process: "SpawnProcess"
    told: "Connection"
    tells: "Connection"

    def end(self, seconds: float) -> None:
        """Wait for its end, then kill it."""
        _ended(self.process, time.monotonic() + seconds)
        self.process.close()
        self.told.close()
        self.tells.close()


def _recording(setting: Setting, log: Path) -> _Recording:
    """Begin the diagnostic process."""
    (told, theirs), (heard, tells) = children.pipe(), children.pipe()
    process = children.process("diagnostics", _serve_diagnostics, setting, str(log), theirs, heard)
    children.start(process)
    theirs.close()
    heard.close()
    return _Recording(process, told, tells)


def _serve_diagnostics(setting: Setting, path: str, told: "Connection", heard: "Connection") -> None:
    from rcsc.run.processes.diagnose import serve_diagnostics  # needs an extra

    serve_diagnostics(setting, path, told, heard)


def run_processes(  # noqa: PLR0913  # as many as there are things to choose
    description: Description,
    kind: Kind,
    outside: Mapping[str, Factory],
    *,
    queries: Factory | None = None,
    rate: float = 1.0,
    course: Course = COURSE,
    watch: Callable[[Supervisor], None] | None = None,
    told: Callable[[str], None] | None = None,
) -> None:
    """Run the system until a part outside is over, or Ctrl-C or SIGTERM ends all; restart a level that was killed or stands still.

    Args:
        description: Levels and wires.
        kind: Of the executors.
        outside: Factories of `Sequence[Outside]` by the name of their process.
        queries: Makes the database's questions by name, in each level's process.
        rate: Seconds of the system in one of the clock; 0 is as fast as possible.
        course: What else is wanted of the run.
        watch: Called some fifty times a second.
        told: Called with what happened to a level that stood still, or to the log; else it goes to the standard error stream.

    Raises:
        UnprovedExecutors: Executors are made of tables that are not proved.
        StateTableError: A level met a fault.
        ChildProcessError: A process ended by an exception, was killed too often, or stands still outside the levels.
        KeyboardInterrupt: Ctrl-C, or SIGTERM.
    """
    refuse_unproved(description)
    restarts = 0
    say = told or _say
    supervisor = Supervisor(description, kind, outside, queries=queries, rate=rate, course=course)
    with _terminable(), supervisor as system:
        while not system.over:
            system.check()
            if why := system.unrecorded():
                say(why)
            system.let_go()
            for name, why in system.still().items():
                if name in outside:
                    raise ChildProcessError(f"process `{name}` stands still: {why}")
                say(f"level `{name}` stood still ({why}); it is started again")
                system.note(name, f"stood still: {why}")
                system.stop(name, signal.SIGKILL)
            for name in system.killed():
                if name in outside:
                    raise ChildProcessError(
                        f"process `{name}` was killed; what it did cannot be taken up again"
                    )
                restarts += 1
                system.note(name, f"ended by {signal.Signals(-(system.code(name) or 0)).name}")
                if restarts > MOST_RESTARTS:
                    raise ChildProcessError(f"process `{name}` was killed; there were {restarts} of them")
                system.start(name)
            if watch is not None:
                watch(system)
            time.sleep(0.02)


STOPPED, WAITING = frozenset("Tt"), frozenset("SD")


def _state(pid: int) -> tuple[str, float]:
    """Return a process's state and the seconds of processor time it has used. Source: proc(5), /proc/PID/stat."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return "", 0.0
    fields = text.rpartition(")")[2].split()
    return fields[0], (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _ended(process: "SpawnProcess", until_s: float) -> None:
    """Wait for the end of a process that was told to end, then kill it; at once where it stands still."""
    if process.pid is not None and _state(process.pid)[0] in STOPPED:
        process.kill()
    process.join(max(0.0, until_s - time.monotonic()))
    if process.is_alive():
        process.kill()
        process.join()


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")


@contextlib.contextmanager
def _terminable() -> Iterator[None]:
    """Let SIGTERM end the run as Ctrl-C does, with everything cleaned up."""

    def end(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)

"""The whole system as processes: one a level, and one for each thing that stands outside, over shared memory.

In: a description, and factories by name for what a process makes for itself. Out: a `Supervisor`, with which processes are
stopped and started again while the others run; `run_processes`, which runs them all.

Nobody waits for anybody: a level takes what the buffers hold, runs a cycle, and commits its state and its outputs in one step.
What it sees is at times older or newer than in one process; tables that keep the protocol of numbers and echoes do not mind.
"""

import contextlib
import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from types import FrameType
from typing import TYPE_CHECKING, Any, Self

from rcsc import children
from rcsc.system.cell import Kind, StateTableError, signatures
from rcsc.system.description import Description
from rcsc.system.serve import FAULTY, Factory, Setting, serve_level, serve_outside
from rcsc.system.shared import Absent, SharedMemoryBuffers, layout
from rcsc.system.unproved import refuse_unproved

if TYPE_CHECKING:
    from multiprocessing.context import SpawnProcess

PATIENCE_S = 5.0
MOST_RESTARTS = 20


class Supervisor:
    """Processes of one system; a context: all run inside it, and nothing of them is left after it.

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
    ) -> None:
        self._signs = signatures(description)
        laid = layout(description, self._signs)
        self._outside = outside
        self._running: dict[str, SpawnProcess] = {}
        self.buffers = SharedMemoryBuffers.create(laid)
        self._setting = Setting(description, queries, rate, kind, self.buffers.block.name, os.getpid())

    @property
    def names(self) -> tuple[str, ...]:
        """The processes: the levels from the top down, then what stands outside."""
        return *self._signs, *self._outside

    def __enter__(self) -> Self:
        try:
            for name in self.names:
                self.start(name)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self, name: str) -> None:
        """Starts a process; again, if it has ended.

        Raises:
            ValueError: It runs.
        """
        if self.runs(name):
            raise ValueError(f"`{name}` runs")
        work: tuple[Callable[..., None], tuple[Any, ...]] = (
            (serve_level, (self._setting, name))
            if name in self._signs
            else (serve_outside, (self._setting, self._outside[name]))
        )
        made = children.process(name, work[0], *work[1])
        with children.interrupts_held():
            made.start()
        self._running[name] = made

    def stop(self, name: str, how: signal.Signals = signal.SIGTERM) -> None:
        """Ends a process: SIGTERM after its cycle, SIGKILL at once."""
        process = self._running[name]
        if process.pid is not None and process.is_alive():
            os.kill(process.pid, how)
        process.join(PATIENCE_S)
        if process.is_alive():
            process.kill()
            process.join()

    def runs(self, name: str) -> bool:
        """Whether it has been started and has not ended."""
        return name in self._running and self._running[name].is_alive()

    def code(self, name: str) -> int | None:
        """How it ended: 0 well, a negative number by that signal; None while it runs."""
        return self._running[name].exitcode

    @property
    def over(self) -> bool:
        """Whether something outside has come to its end."""
        return any(self.code(name) == 0 for name in self._outside)

    def check(self) -> None:
        """Looks for processes that ended by themselves.

        Raises:
            StateTableError: A level met a fault.
            ChildProcessError: A process ended by an exception; what it was stands on the standard error stream.
        """
        for name in self._running:
            code = self.code(name)
            if code == FAULTY and name in self._signs:
                raise StateTableError(self._said(name))
            if code is not None and code > 0:
                raise ChildProcessError(f"process `{name}` ended with code {code}")

    def killed(self) -> tuple[str, ...]:
        """Processes that a signal ended."""
        return tuple(name for name in self._running if (self.code(name) or 0) < 0)

    def close(self) -> None:
        """Ends all, and removes the shared memory."""
        with children.interrupts_held():
            for process in self._running.values():
                process.terminate()
            for name in self._running:
                self.stop(name)
                self._running[name].close()
            self._running.clear()
            self.buffers.block.unlink()
            self.buffers.close()

    def _said(self, name: str) -> str:
        values = self.buffers.checkpoint(name)
        if isinstance(values, Absent):
            return f"level `{name}`: a fault"
        return f"level `{name}`: {self._signs[name].fault_said(values)}"


def run_processes(
    description: Description,
    kind: Kind,
    outside: Mapping[str, Factory],
    *,
    queries: Factory | None = None,
    rate: float = 1.0,
    watch: Callable[[Supervisor], None] | None = None,
) -> None:
    """Runs the system until something outside is over, or Ctrl-C or SIGTERM ends all; a killed level is started again.

    Args:
        description: Levels and wires.
        kind: Of the executors.
        outside: Factories of `Sequence[Outside]` by the name of their process.
        queries: Makes the database's questions by name, in each level's process.
        rate: Seconds of the system in one of the clock; 0 is as fast as possible.
        watch: Called some fifty times a second.

    Raises:
        UnprovedExecutors: Executors are made of tables that are not proved.
        StateTableError: A level met a fault.
        ChildProcessError: A process ended by an exception, or was killed too often.
        KeyboardInterrupt: Ctrl-C, or SIGTERM.
    """
    refuse_unproved(description)
    restarts = 0
    with _terminable(), Supervisor(description, kind, outside, queries=queries, rate=rate) as system:
        while not system.over:
            system.check()
            for name in system.killed():
                restarts += 1
                if restarts > MOST_RESTARTS:
                    raise ChildProcessError(f"process `{name}` was killed; there were {restarts} of them")
                system.start(name)
            if watch is not None:
                watch(system)
            time.sleep(0.02)


@contextlib.contextmanager
def _terminable() -> Iterator[None]:
    """SIGTERM ends as Ctrl-C does, with everything cleaned up."""

    def end(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)

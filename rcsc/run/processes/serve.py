"""What runs in a process of its own: a level, or what stands outside the levels.

In: a `Setting`, which travels to the process, and names. Out: cycles, each committed in one step, until the process is told to
end, meets a fault, or is left alone.
"""

import contextlib
import importlib
import os
import signal
import struct
import time
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, Sized
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from rcsc.run.adopt import Begun, restart
from rcsc.run.description import Description
from rcsc.run.faults import faults_of, switch
from rcsc.run.levels import BadState, RunningLevel, StateTableError, running_level
from rcsc.run.processes.clocks import Clocks, Turn
from rcsc.run.processes.memory import NotShared, SharedMemoryBuffers, layout, mail
from rcsc.run.processes.switches import Heeded, Strengths, Switches
from rcsc.run.signature import Signature, Value, Values
from rcsc.run.system import Kind, Outside, executors, signatures

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

FAULTY = 3  # a level's exit code after a fault; which one stands in its checkpoint
REFUSED = 4  # of a process that was refused a state or values; it has told why
MOST_TOLD = 4096
NAP_S = 20e-6
HEED_S = 0.1
"""A signal does not end a sleep; a period may be long where the system runs slower than the clock."""


@dataclass(frozen=True, slots=True)
class Factory:
    """A function that makes an object in the process that needs it.

    Attributes:
        name: `module:function`.
        arguments: Of the function; they travel to the process.
    """

    name: str
    arguments: tuple[Any, ...] = ()

    def make(self) -> Any:
        """Call the function and return its result."""
        module, _, function = self.name.partition(":")
        return getattr(importlib.import_module(module), function)(*self.arguments)


@dataclass(frozen=True, slots=True)
class Setting:
    """The settings that all processes of a system share.

    Attributes:
        queries: Makes the database's questions by name.
        rate: Seconds of the system in one of the clock; 0 is as fast as possible.
        in_step: Whether each takes what the cycle before left, as in one process.
        kind: Of the executors; each level's process builds its own.
        block: Name of the shared memory.
        periods_ms: Of each process, by its name.
        faults: Of the plants, that somebody may switch from elsewhere.
    """

    description: Description
    queries: Factory | None
    rate: float
    kind: Kind
    block: str
    parent: int
    periods_ms: Mapping[str, int]
    in_step: bool = False
    faults: Strengths = field(default_factory=dict)

    def clocks(self, buffers: SharedMemoryBuffers) -> Clocks:
        """Return the clocks of all processes, behind the buffers."""
        return Clocks(buffers.block, buffers.layout.size, self.periods_ms, self.in_step)

    def switches(self, buffers: SharedMemoryBuffers) -> Switches:
        """Return the switches of the plants' faults, behind the clocks."""
        return Switches.behind(buffers, len(self.periods_ms), self.faults)


AT_FIRST, REFUSES = 0, 4
BEGINNINGS = {1: Begun.CHECKPOINT, 2: Begun.ANEW, 3: Begun.HAND}
"""How a level says that it goes on: with its initial state, or otherwise; or that it refuses what was set by hand."""


@dataclass(slots=True)
class Paced:
    """Waits between cycles; a cycle that is late is not made up for.

    Attributes:
        period_s: By the clock; 0 is as fast as possible.
    """

    period_s: float
    _due: float = field(default_factory=time.monotonic)

    def wait(self, told: Sized = ()) -> None:
        """Wait until the next cycle is due, or not much longer than until something is `told`."""
        if self.period_s == 0:
            time.sleep(NAP_S)  # lets others run: there may be more processes than processors
            return
        now = time.monotonic()
        self._due = max(self._due + self.period_s, now)
        while now < self._due and not told:
            time.sleep(min(self._due - now, HEED_S))
            now = time.monotonic()


def begin(level: RunningLevel, transport: SharedMemoryBuffers) -> None:
    """Continue from the last committed cycle; where that is lost, or ended in a fault, start safely. Say from what."""
    held, how = transport.checkpoint(level.name), AT_FIRST
    if held is not NotShared.BLANK:
        good = None if isinstance(held, NotShared) or level.sign.fault(held) else held
        begun = restart(level, transport, good).begun
        how = next(number for number, each in BEGINNINGS.items() if each is begun)
    transport.begin(level.name, how, level.values)


@dataclass(slots=True)
class Mail:
    """What somebody sets of a level by hand, taken between two cycles.

    Attributes:
        inputs: Values of inputs, by their places; they hold for the next cycle, whatever the buffers say.
    """

    level: RunningLevel
    memory: SharedMemoryBuffers
    inputs: dict[int, Value] = field(default_factory=dict)
    _stamp: int = field(init=False)

    def __post_init__(self) -> None:
        """Leave what was meant for a level that has ended since."""
        self._stamp = self.memory.stamp(mail(self.level.name))

    def take(self) -> None:
        """Go on from what was set since, and say so; refuse a state that no cycle may begin with."""
        images = [
            image for image in self.memory.since(mail(self.level.name), self._stamp) if image is not None
        ]
        if not images:
            return
        self._stamp = images[-1].stamp
        name, sign = self.level.name, self.level.sign
        places = {at: value for image in images for at, value in self.memory.sent(name, image).items()}
        values = tuple(places.get(at, value) for at, value in enumerate(self.level.values))
        try:
            self.level.restore(values)
        except BadState:
            self.memory.begin(name, REFUSES, self.level.values)
            return
        self.inputs |= {at: value for at, value in places.items() if sign.leaves[at].kind == "input"}
        self.memory.begin(
            name, next(how for how, begun in BEGINNINGS.items() if begun is Begun.HAND), self.level.values
        )

    def put(self) -> None:
        """Put the inputs that were set over those that were taken."""
        for at, value in self.inputs.items():
            self.level.executor.put(at, (value,))
        self.inputs.clear()


def cycle(level: RunningLevel, transport: SharedMemoryBuffers, held: Mail | None = None) -> int:
    """Run one cycle of a level; return the fault, 0 for none."""
    level.take(transport)
    if held is not None:
        held.put()
    fault = level.run()
    transport.commit(level.name, level.values)
    return fault


def serve_level(setting: Setting, name: str, told: "Connection") -> None:
    """Run a level's process, from its start to SIGTERM or a fault; send the reason of a refusal."""
    with telling(told), attached(setting) as (signs, transport):
        level = _level(setting, name, signs[name])
        turn = Turn(setting.clocks(transport), name)
        if (
            transport.checkpoint_ms(name) >= turn.now_ms
        ):  # it was killed between its commit and the end of its cycle
            turn.done()
        transport.now_ms = turn.now_ms
        begin(level, transport)
        held = Mail(level, transport)
        for _ in _rounds(setting, turn, transport, held.take):
            if cycle(level, transport, held):
                raise SystemExit(FAULTY)


def serve_outside(setting: Setting, name: str, factory: Factory, told: "Connection") -> None:
    """Run a process for the parts outside the levels, until one of them says `over`."""
    with telling(told), attached(setting) as (_, transport):
        parts: tuple[Outside, ...] = tuple(factory.make())
        heeded, own = Heeded(setting.switches(transport)), frozenset(faults_of(parts))

        def heed() -> None:
            for fault, on in heeded.thrown():
                if fault.partition("=")[0] in own:
                    switch(parts, fault, on=on)

        for tick in _rounds(setting, Turn(setting.clocks(transport), name), transport, heed):
            given = [part.step(tick, transport.latest) for part in parts]
            for buffer, values in ChainMap(*map(dict, reversed(given))).items():  # each once in a cycle
                _publish(transport, buffer, values)
            if any(getattr(part, "over", False) for part in parts):
                return


def _publish(transport: SharedMemoryBuffers, name: str, values: Values) -> None:
    try:
        transport.publish(name, values)
    except struct.error as error:
        raise StateTableError(f"buffer `{name}` cannot hold what was published: {error}") from error


@contextlib.contextmanager
def telling(told: "Connection") -> Iterator[None]:
    """Send the reason why a level was refused a state or values, or a log cannot be written; end the process with `REFUSED`."""
    try:
        yield
    except (StateTableError, OSError) as error:
        told.send_bytes(str(error).encode()[:MOST_TOLD])
        raise SystemExit(REFUSED) from None


@contextlib.contextmanager
def attached(setting: Setting) -> Iterator[tuple[dict[str, Signature], SharedMemoryBuffers]]:
    """Return the signatures of the levels, and the common memory."""
    signs = signatures(setting.description)
    buffers = SharedMemoryBuffers.attach(setting.block, layout(setting.description, signs))
    buffers.in_step = setting.in_step
    try:
        yield signs, buffers
    finally:
        if os.getppid() != setting.parent:  # its maker was killed and cannot
            buffers.block.unlink()
        buffers.close()


def _rounds(
    setting: Setting, turn: Turn, buffers: SharedMemoryBuffers, before: Callable[[], None] | None = None
) -> Iterator[int]:
    """Yield a process's ticks, each when it is due and its turn has come, until SIGTERM or the end of its parent.

    Args:
        setting: Of all.
        turn: Of this process.
        buffers: Are told the time.
        before: Done before each, also before one that the process skips as it is held.
    """
    told: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: told.append(number))
    period_s = setting.periods_ms[turn.name] / 1000
    pace, tick = Paced(period_s / setting.rate if setting.rate else 0.0), 0
    while not told and os.getppid() == setting.parent:
        turn.wait(told)
        if told:
            return
        buffers.now_ms = turn.now_ms
        if before is not None:
            before()
        if not turn.clocks.skips(turn.name):
            yield tick
            tick += 1
        turn.done()
        pace.wait(told)


def _level(setting: Setting, name: str, sign: Signature) -> RunningLevel:
    system = setting.description
    spec = next(spec for spec in system.levels if spec.name == name)
    executor = executors(system, {name: sign}, setting.kind)[name]
    queries = setting.queries.make() if setting.queries else {}
    return running_level(spec, system, sign, executor, queries)

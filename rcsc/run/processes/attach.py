"""Attach to a system that runs in processes, also to one that somebody else started: look at it, step it, set what its levels hold.

In: a block whose end says what runs in it. Out: an `AttachedSystem`, which is stepped as any other `System`: whoever has hands on one
(`rcsc.desk`) has them on this. Its levels hold what those that run left.

    system = attach(find("dock"), "python", {})
    system.step()                           # one tick of all processes
    system.hold("drive", on=True)           # it skips its cycles, and the rest goes on
    system.switches.switch("wheel_slips", on=True)   # a fault of its plant, from the next tick on
    system.leave()                          # all go on as before

What is set is sent to the level, which takes it between two cycles, and so it is in the log; nobody writes in what is a level's own. One is
attached at a time, and holds a lock on the block for as long as it lives: the supervisor lets all go when it dies.
"""

import fcntl
import json
import os
import struct
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.described import nearest
from rcsc.base.host.files.read import CheckedFields, Malformed, json_of
from rcsc.run.description import Description, description
from rcsc.run.levels import Query, RunningLevel
from rcsc.run.log.schema import fingerprints
from rcsc.run.processes.block import FOLDER, PREFIX, Block
from rcsc.run.processes.clocks import LONGEST_NAP_S, SHORTEST_NAP_S, Clocks
from rcsc.run.processes.memory import NotShared, SharedMemoryBuffers, layout
from rcsc.run.processes.switches import Strengths, Switches
from rcsc.run.signature import Values
from rcsc.run.system import Kind, System, assemble, signatures

NOTE = 8192
"""Bytes at the end of a block that say what runs in it."""
GONE_S = 0.2
"""How often it is looked whether the system is still there."""


class NotAttached(Refused):
    """There is no such system that runs, it has ended, or somebody else is attached to it."""

    def __init__(self, message: str, *helps: str) -> None:
        super().__init__(Code.PROCESS_LOST, message, *helps)


@dataclass(frozen=True, slots=True)
class RunningSystem:
    """A system that runs in processes.

    Attributes:
        block: Name of its memory.
        name: As its description has it.
        system: Path of the description.
        outside: Names of the processes outside the levels.
        programs: Digests of what was generated for its programs.
        faults: Of its plants.
    """

    block: str
    name: str
    system: Path
    outside: tuple[str, ...]
    programs: Mapping[str, str]
    rate: float
    in_step: bool
    faults: Strengths = field(default_factory=dict)

    def text(self) -> bytes:
        """Return it as the end of a block.

        Raises:
            ValueError: It is too long: nobody can attach.
        """
        fields = {
            "name": self.name, "system": str(self.system), "outside": list(self.outside),
            "programs": dict(self.programs), "rate": self.rate, "in_step": self.in_step,
            "faults": dict(self.faults),
        }  # fmt: skip
        written = json.dumps(fields).encode()
        if len(written) > NOTE:
            raise ValueError(f"{len(written)} bytes")
        return written.ljust(NOTE, b"\0")

    def clocks(self, buffers: SharedMemoryBuffers, periods_ms: Mapping[str, int]) -> Clocks:
        """Return the clocks of its processes."""
        outside = dict.fromkeys(self.outside, description(self.system).tick_ms)
        return Clocks(buffers.block, buffers.layout.size, outside | dict(periods_ms), self.in_step)

    def switches(self, buffers: SharedMemoryBuffers, levels: int) -> Switches:
        """Return the switches of its plants' faults."""
        return Switches.behind(buffers, len(self.outside) + levels, self.faults)


def running() -> list[RunningSystem]:
    """Return what this user runs in processes on this machine, the oldest first."""
    found = []
    for path in FOLDER.glob(f"{PREFIX}*"):
        try:
            about = path.lstat()
            if path.is_file() and not path.is_symlink() and about.st_uid == os.getuid():
                found.append((about.st_ctime, _read(path)))
        except (OSError, KeyError, TypeError, ValueError, Malformed):
            continue  # a block of another kind, or one that goes away
    return [each for _, each in sorted(found, key=lambda one: one[0])]


def _read(path: Path) -> RunningSystem:
    with path.open("rb") as file:
        file.seek(-NOTE, os.SEEK_END)
        fields = json_of(file.read().rstrip(b"\0").decode())
    checked = CheckedFields(fields)
    return RunningSystem(
        path.name, checked.text("name"), Path(checked.text("system")), tuple(map(str, fields["outside"])),
        {str(name): str(digest) for name, digest in fields["programs"].items()}, float(fields["rate"]),
        bool(fields["in_step"]),
        {str(name): ends and (float(ends[0]), float(ends[1])) for name, ends in fields["faults"].items()},
    )  # fmt: skip


def find(name: str = "") -> RunningSystem:
    """Return the system that runs under a name, or in a block; the only one where no name is given.

    Raises:
        NotAttached: There is none, or there are several.
    """
    every = running()
    found = [each for each in every if name in {"", each.name, each.block}]
    if len(found) == 1:
        return found[0]
    if not every:
        raise NotAttached("no system runs in processes here", "`rcsc run SYSTEM --processes` starts one")
    if not found:
        raise NotAttached(
            f"no system `{name}` runs in processes here", *nearest(name, [each.name for each in every])
        )
    blocks = ", ".join(f"`{each.block}` ({each.name})" for each in found)
    raise NotAttached(f"{len(found)} such systems run: {blocks}", "name one by its block")


def is_held(block: str) -> bool:
    """Tell whether somebody who lives is attached to a block."""
    opened = os.open(FOLDER / block, os.O_RDWR)
    try:
        return not _lock(opened)
    finally:
        os.close(opened)


def _lock(opened: int) -> bool:
    """Take the lock of who is attached, for as long as the file is open: the kernel lets it go with the process."""
    wanted = struct.pack("hhqqi0q", fcntl.F_WRLCK, os.SEEK_SET, 0, 1, 0)  # Source: fcntl(2), struct flock
    try:
        fcntl.fcntl(opened, fcntl.F_OFD_SETLK, wanted)
    except OSError:
        return False
    return True


@dataclass(slots=True)
class Link:
    """The memory of a system that runs elsewhere, held by who is attached."""

    running: RunningSystem
    memory: SharedMemoryBuffers
    clocks: Clocks
    lock: int

    def let_until(self, now_ms: int) -> None:
        """Let all run their cycles before a time; return when they have.

        Raises:
            NotAttached: The system has ended.
        """
        self.clocks.let_until(now_ms)
        nap_s, looked_s = SHORTEST_NAP_S, time.monotonic()
        while not self.clocks.all_at(now_ms):
            time.sleep(nap_s)
            nap_s = min(2 * nap_s, LONGEST_NAP_S)
            if time.monotonic() - looked_s > GONE_S:
                looked_s = time.monotonic()
                self.check()

    def check(self) -> None:
        """Check that the system still runs.

        Raises:
            NotAttached: It has ended.
        """
        ends_ms = self.clocks.limit_ms
        if not (FOLDER / self.running.block).exists() or (
            ends_ms is not None and self.clocks.all_at(ends_ms)
        ):
            raise NotAttached(f"`{self.running.name}` has ended")

    def close(self) -> None:
        """Let all go."""
        if self.lock >= 0:
            self.clocks.let_go()
            self.memory.close()
            os.close(self.lock)
            self.lock = -1


@dataclass(slots=True)
class AttachedSystem(System):
    """A system that runs in other processes, as one that is stepped here.

    Attributes:
        switches: Of its plants' faults; what is thrown stays so when who is attached goes.
    """

    link: Link = field(kw_only=True)
    switches: Switches = field(kw_only=True)
    _known: dict[str, Values] = field(default_factory=dict)
    _sent: dict[str, dict[int, object]] = field(default_factory=dict)

    def begin(self) -> None:
        """Have all stand after the same tick, and read what they hold."""
        tick_ms, clocks = self.description.tick_ms, self.link.clocks
        end_ms = clocks.common_end_ms()
        while (
            end_ms > self.tick * tick_ms or not self.tick
        ):  # one may begin a cycle just before it is told to stand
            self.tick = max(1, -(-end_ms // tick_ms))
            self.link.let_until(self.tick * tick_ms)
            end_ms = clocks.latest_ms("") + 1
        for level in self.levels:
            self._read(level)
        self._take_buffers()

    def step(self) -> None:
        """Let all run one tick, and read what they left.

        Raises:
            NotAttached: The system has ended.
        """
        before = {name: self.link.memory.checkpoint_ms(name) for name in self._known}
        self._send()
        now_ms = self.tick * self.description.tick_ms
        self.link.let_until(now_ms + self.description.tick_ms)
        ran = tuple(
            level for level in self.levels
            if self.link.memory.checkpoint_ms(level.name) > before[level.name]
        )  # fmt: skip
        for level in ran:
            self._read(level)
        self._take_buffers()
        self.tick += 1
        for watch in self.watch:
            watch(self, ran)
        self.restarts.clear()

    def hold(self, name: str, *, on: bool) -> None:
        """Have a level skip its cycles while the rest goes on, or no more."""
        self.link.clocks.hold(name, on=on)

    def held(self, name: str) -> bool:
        """Tell whether a level skips its cycles."""
        return self.link.clocks.held(name)

    def allow(self, name: str, cycles: int = 1) -> None:
        """Let a level that is held run some cycles of those that come."""
        self.link.clocks.allow(name, cycles)

    def leave(self) -> None:
        """Let all go on; what was set and not taken is sent."""
        if self.link.lock >= 0:
            self._send()
            self.link.close()

    def _send(self) -> None:
        """Send to each level what was set here since its last cycle."""
        self.link.memory.now_ms = self.tick * self.description.tick_ms
        for level in self.levels:
            known, values = self._known[level.name], level.values
            changed: dict[int, object] = {
                at: values[at] for at in range(len(level.sign.leaves)) if values[at] != known[at]
            }
            if changed and changed != self._sent.get(level.name):
                self.link.memory.send(level.name, values, changed)
                self._sent[level.name] = changed

    def _read(self, level: RunningLevel) -> None:
        """Take over what a level's last cycle left; what it holds at first where it had none."""
        values = self.link.memory.checkpoint(level.name)
        if not isinstance(values, NotShared):
            level.put_back(values)
            level.values = values  # the trace, too
        self._known[level.name] = level.values
        self._sent.pop(level.name, None)

    def _take_buffers(self) -> None:
        for name in self.description.readers():
            latest = self.link.memory.latest(name)
            if latest is not None:
                self.buffers.publish(name, latest)


def attach(found: RunningSystem, kind: Kind, queries: Mapping[str, Query]) -> AttachedSystem:
    """Attach to a running system; all stand after the same tick.

    Args:
        found: Of `find`.
        kind: Of the executors with which what is set is checked here.
        queries: Answers to the queries of feeds; none of them is asked.

    Raises:
        CodedError: It has ended, somebody else is attached, or what is generated here is not what runs.
    """
    here = description(found.system)
    if fingerprints(here) != dict(found.programs):
        raise NotAttached(
            f"`{found.name}` runs other tables than those that are compiled in `{here.generated}`"
        )
    local = assemble(here, kind, queries)
    signs = signatures(here)
    try:
        lock = os.open(FOLDER / found.block, os.O_RDWR)
    except FileNotFoundError:
        raise NotAttached(f"`{found.name}` has ended") from None
    if not _lock(lock):
        os.close(lock)
        raise NotAttached(f"somebody else is attached to `{found.name}`")
    memory = SharedMemoryBuffers(Block.attach(found.block), layout(here, signs))
    clocks = found.clocks(memory, periods(here, local))
    clocks.attach(os.getpid())
    thrown = found.switches(memory, len(signs))
    system = AttachedSystem(here, local.levels, (), link=Link(found, memory, clocks, lock), switches=thrown)
    try:
        system.begin()
    except BaseException:
        system.link.close()
        raise
    return system


def periods(system: Description, local: System) -> dict[str, int]:
    """Return the period of each level, in the order of the description."""
    return {spec.name: local.level(spec.name).level.period_ms for spec in system.levels}

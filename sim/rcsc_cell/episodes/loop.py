"""The cell in the loop: levels on generated executors over a plant, with what goes wrong, watched by properties, cycle by cycle.

In: an episode, or one that grows while it runs. Out: an `EpisodeOutcome`. Everything that is random comes from the episode's seed.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path

from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome
from rcsc.run.levels import RunningLevel, running_level
from rcsc.run.log.recorder import Recorder
from rcsc.run.orders.script import BadScript
from rcsc.run.signature import Values
from rcsc.run.system import StateTableError, System, several_executors
from rcsc_cell.cell.faults import Faults
from rcsc_cell.cell.kinematic import Kinematic
from rcsc_cell.cell.mujoco_model import Make
from rcsc_cell.cell.ready import plant
from rcsc_cell.episodes.episode import (
    SYSTEM,
    Episode,
    FaultSpec,
    Interruption,
    Push,
    Restart,
    TransportSpec,
)
from rcsc_cell.episodes.setting import commands, operator_of, ready
from rcsc_cell.episodes.setting import lying as lying_at
from rcsc_cell.episodes.transport import Harmed
from rcsc_cell.properties import PROPERTIES
from rcsc_cell.properties.cycle import Command, CycleState, PropertyClass

MOST_TICKS_A_ROW = 2500
"""A run is given up after so many ticks for each row."""
COOL_TICKS = 30
"""Watched after the end: nothing moves then."""
USUAL: Mapping[str, float] = {switch.name: getattr(Faults(), switch.name) for switch in fields(Faults)}
"""How each switch stands when nothing is wrong: bools, integers and floats."""


class Loop:
    """A running episode.

    Args:
        episode: What to run; `inject`, `harm`, `restart`, `change` and `push` add to it.
        system: The description of the system.
        log: Where to keep every cycle.
        properties: What watches.

    Attributes:
        findings: The first of each property.
        properties: What watches.
        cycle: What the properties saw last.
        refused: Why the script cannot be run; empty where it can.

    Raises:
        BadDescription, BadData, NotBuilt: The system is not in order.
        OSError: The log cannot be written.
    """

    def __init__(
        self,
        episode: Episode,
        system: Path,
        log: Path | None = None,
        properties: Sequence[PropertyClass] = PROPERTIES,
    ) -> None:
        self.episode = episode
        self.refused = ""
        self.findings: list[EpisodeFinding] = []
        self.lines: set[tuple[str, str, str]] = set()
        self._seen: set[tuple[str, int, int]] = set()
        self._digest, self._end, self._cool = hashlib.blake2b(digest_size=16), "", COOL_TICKS
        described, signs, self.database = ready(system)
        lying = [lying_at(self.database, part) for part in episode.parts]
        self.plant = plant(self.database, episode.backend, lying, episode.seed, Make(episode.step_s))
        self._signs = signs
        try:
            self.operator = operator_of(episode, self.database, signs["task"])
        except (BadScript, ValueError) as error:
            self._end = "refused"
            self.refused = str(error)
            self.operator = operator_of(
                replace(episode, rows=(), interruptions=()), self.database, signs["task"]
            )
        self.buffers = Harmed(episode.transport)
        made = several_executors(described, signs, episode.executor)
        by_level = made()
        levels = tuple(
            running_level(spec, described, signs[spec.name], by_level[spec.name], self.database.queries)
            for spec in described.levels
        )
        self.system = System(described, levels, (self.operator, self.plant), self.buffers)
        self._packed = {level.name: level.sign.packed for level in levels}
        self._by = {level.name: level.sign.index.get(level.level.by, -1) for level in levels}
        self._recorder = None if log is None else Recorder(self.system, log)
        if self._recorder is not None:
            self.system.watch.append(self._recorder)
        self.system.watch.append(self._after)
        self.cycle = CycleState(
            self.database,
            self.plant,
            {level.name: level for level in levels},
            made(),
            tuple(part.body for part in lying),
        )
        self.cycle.look()
        self.properties = [make(self.cycle) for make in properties]
        self._changes, self._active = self._fault_changes(), frozenset[str]()
        self._told = self._given = 0
        self._answered = self._taken = True

    # --- the run ---

    @property
    def over(self) -> bool:
        """Return whether everything was sent and answered, and has cooled down."""
        return bool(self._end) or (self.operator.over and self._cool <= 0)

    def finish(self) -> EpisodeOutcome:
        """Runs to the end.

        Raises:
            OSError: The log cannot be written.
        """
        rows = len(self.episode.rows) + len(self.episode.interruptions)
        latest = max((interruption.tick for interruption in self.episode.interruptions), default=0)
        most = latest + MOST_TICKS_A_ROW * (rows + 1)
        while not self.over:
            if self.system.tick >= most:
                self._end = "hang"
                break
            self.step()
        return self.outcome()

    def step(self) -> None:
        """One tick."""
        tick = self.system.tick
        if tick in self._changes:
            self._switch(tick)
        self.buffers.begin(tick)
        self.cycle.restarted = tuple(
            restart.level for restart in self.episode.restarts if restart.tick == tick
        )
        for name in self.cycle.restarted:
            self.system.restart(name)
        for push in self.episode.pushes:
            if push.tick == tick:
                self._push(push)
        self._note(tick)
        self.cycle.before = {level.name: level.values for level in self.system.levels}
        if self.operator.over:
            self._cool -= 1
        else:
            self._cool = COOL_TICKS
        try:
            self.system.step()
        except StateTableError as error:
            self._end = "state-table error"
            self._find("no state-table error", str(error))

    def outcome(self) -> EpisodeOutcome:
        """Return what has become of it so far, and close the log."""
        if self._recorder is not None:
            self._recorder.close()
        for name, table, line in self._seen:
            sign = self._signs[name]
            level = next(level for level in sign.levels if level.name == name)
            called = level.table or level.tables.get(table, "?")
            self.lines.add((name, called, sign.tables[called][line] if called in sign.tables else ""))
        return EpisodeOutcome(
            tuple(self.operator.ends),
            tuple(self.findings),
            self._end or self._ended(),
            self.system.tick,
            frozenset(self.lines),
            self._digest.hexdigest(),
        )

    def _ended(self) -> str:
        last = next((end for end in reversed(self.operator.ends) if end.state != "changed"), None)
        if last is None or last.state == "done":
            return "done" if self.operator.over else "running"
        if last.state == "refused":
            return "refused"
        command = last.text.partition(" ")[0].partition("-")[0].lower()
        word = last.reason.partition(":")[0]
        return f"failed:{word if ' ' not in word else command}"

    # --- what goes wrong ---

    def inject(self, fault: FaultSpec) -> None:
        """A fault from now on or later."""
        self.episode = replace(self.episode, faults=(*self.episode.faults, fault))
        self._changes = self._fault_changes()

    def harm(self, harm: TransportSpec) -> None:
        """Something happens to a buffer, from now on or later."""
        self.episode = replace(self.episode, transport=(*self.episode.transport, harm))
        self.buffers.harms.append(harm)

    def restart(self, level: str) -> None:
        """A level loses its state before the next cycle."""
        restart = Restart(self.system.tick, level)
        self.episode = replace(self.episode, restarts=(*self.episode.restarts, restart))

    def change(self, row: str) -> None:
        """TASK gets another command in the next cycle.

        Raises:
            BadScript: The row says nothing.
            ValueError: It is none of TASK's.
        """
        interruption = Interruption(self.system.tick, row)
        self.operator.changes += commands((interruption,), self.operator)
        self.episode = replace(self.episode, interruptions=(*self.episode.interruptions, interruption))

    def push(self, part: int, x_mm: float, y_mm: float) -> None:
        """Somebody pushes a part before the next cycle."""
        push = Push(self.system.tick, part, x_mm, y_mm)
        self.episode = replace(self.episode, pushes=(*self.episode.pushes, push))

    def _push(self, push: Push) -> None:
        mechanism = self.plant.mechanism
        if isinstance(mechanism, Kinematic) and push.part < len(self.cycle.bodies):
            mechanism.push(push.part, push.x_mm, push.y_mm)

    def _fault_changes(self) -> frozenset[int]:
        faults = self.episode.faults
        return frozenset(tick for fault in faults for tick in (fault.first_tick, fault.last_tick + 1))

    def _switch(self, tick: int) -> None:
        wanted = {
            fault.name: fault.value
            for fault in self.episode.faults
            if fault.first_tick <= tick <= fault.last_tick
        }
        for name, usual in USUAL.items():
            setattr(self.plant.faults, name, type(usual)(wanted.get(name, usual)))
        self._active = frozenset(wanted)

    def _note(self, tick: int) -> None:
        """Which fault classes are at work in this tick."""
        cycle, harms = self.cycle, self.buffers.harms
        now = (
            [harm for harm in harms if harm.first_tick <= tick <= harm.last_tick + harm.ticks]
            if harms
            else []
        )
        cycle.harmed = frozenset(spec.buffer for spec in now)
        cycle.active = self._active.union(spec.kind for spec in now)
        if cycle.restarted:
            cycle.active |= {"restarted"}
        if any(push.tick == tick for push in self.episode.pushes):
            cycle.active |= {"pushed"}
        for name in cycle.active:
            cycle.last[name] = tick

    # --- what is seen ---

    def _after(self, system: System, ran: tuple[RunningLevel, ...]) -> None:
        cycle = self.cycle
        for level in ran:
            values = level.values
            self._digest.update(self._packed[level.name].pack(*values))
            by = self._by[level.name]
            self._seen.add(
                (level.name, -1 if by < 0 else int(values[by]), int(values[len(level.sign.leaves)]))
            )
        cycle.tick, cycle.ran = system.tick, ran
        cycle.look()
        self._command()
        ends = self.operator.ends
        cycle.row = ends[-1] if len(ends) > self._told else None
        self._told = len(ends)
        for watcher in self.properties:
            violation = watcher.watch(cycle)
            if violation is not None:
                self._find(watcher.name, violation)

    def _command(self) -> None:
        """The command under way, and whether it has ended."""
        cycle = self.cycle
        cycle.ended = ""
        if self.operator.given != self._given:
            self._given, self._answered, self._taken = self.operator.given, False, False
            cycle.command = self._ordered(self.operator.sent)
        if cycle.command is not None and not self._taken:
            self._take(cycle.command)
        if not self._answered and cycle.number_answered:
            status = cycle.shown("task", "to_workstation.status_report")
            if status != "executing":
                self._answered, cycle.ended = True, status

    def _take(self, command: Command) -> None:
        """What TASK believed when it saw the command."""
        task, before = self.system.level("task"), self.cycle.before["task"]
        if task.value("inc_command_seen") != command.number:
            return
        index, leaves = task.sign.index, task.sign.leaves
        holds, here = index["obj_now_in_gripper"], index["current_loc"]
        self._taken = True
        self.cycle.command = replace(command, held=leaves[holds].shown(before[holds]), here=int(before[here]))

    def _ordered(self, sent: Values) -> Command:
        cycle = self.cycle
        leaves = {
            leaf.name.rpartition(".")[2]: (leaf, value)
            for leaf, value in zip(self.operator.station.order, sent, strict=True)
        }

        def number(name: str) -> int:
            return int(leaves[name][1])

        def word(name: str) -> str:
            leaf, value = leaves[name]
            return leaf.shown(value)

        return Command(
            number("inc_command"),
            word("input_command"),
            word("obj"),
            number("grasp"),
            number("source_locpt"),
            number("dest_locpt"),
            number("end_at_locpt"),
            number("sector"),
            cycle.tick,
            cycle.shown("task", "obj_now_in_gripper"),
            int(cycle.value("task", "current_loc")),
        )

    def _find(self, name: str, message: str) -> None:
        if all(finding.property != name for finding in self.findings):
            self.findings.append(EpisodeFinding(name, self.system.tick, message))


def run(episode: Episode, system: Path = SYSTEM, log: Path | None = None) -> EpisodeOutcome:
    """Runs it to its end, with every property watching.

    Args:
        episode: What to run.
        system: The description of the system; its generated executors are used as they are.
        log: Where to keep every cycle (MCAP); none by default.

    Raises:
        BadDescription, BadData, NotBuilt: The system is not in order.
        OSError: The log cannot be written.
    """
    return Loop(episode, system, log).finish()

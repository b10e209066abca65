"""The cell in the loop: an episode of any system around a plant of parts and a script of rows, watched by the cell's properties.

In: an episode. Out: an `EpisodeOutcome`. Everything that is random comes from the episode's seed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from rcsc.base.host.files.read import Malformed
from rcsc.run.episodes import loop
from rcsc.run.episodes.cycle import Broken, Cycle
from rcsc.run.episodes.episode import OrderSpec
from rcsc.run.episodes.operator import CHANGED, Given, OrderLine
from rcsc.run.episodes.outcome import EpisodeOutcome
from rcsc.run.episodes.proved.claims import NOTHING, Claims
from rcsc.run.episodes.stand import Stand, stand
from rcsc.run.orders.roles import field_of
from rcsc.run.orders.script import BadScript
from rcsc.run.plant.staged import Staged
from rcsc.run.signature import Signature, Values
from rcsc_cell.cell.kinematic import Kinematic
from rcsc_cell.cell.mujoco_model import Body
from rcsc_cell.cell.ready import Lying, plant
from rcsc_cell.database.ask import Database
from rcsc_cell.database.build import BadData
from rcsc_cell.database.pose import about_z
from rcsc_cell.episodes.episode import SYSTEM, Episode, PartSpec, Push, script
from rcsc_cell.episodes.operator import Operator, commanded
from rcsc_cell.properties import PROPERTIES
from rcsc_cell.properties.cycle import Command, CycleState, PropertyClass
from rcsc_cell.workstation.prepared import database_of, needs_cell
from rcsc_cell.workstation.script import ScriptRow, script_rows
from rcsc_cell.workstation.station import workstation

NUMBERS = ("inc_command", "grasp", "source_locpt", "dest_locpt", "end_at_locpt", "sector")
"""Fields of TASK's orders that are no words."""
WITHIN_TICKS = 1500
"""Within which a command ends, whatever goes wrong with the cell: what a table waits for has a limit there. Twice the longest seen."""


class Loop(loop.Loop):
    """A running episode of the cell.

    Args:
        episode: What to run.
        system: The system, or its description.
        properties: What watches, beside what watches any system.
        claims: What was proved of the system, which is watched, too.

    Attributes:
        state: What the cell's properties saw last.
        properties: Those of the cell.

    Raises:
        BadDescription, BadData, NotBuilt: The system is not in order.
        ValueError: The episode names a buffer or a level that is not there.
    """

    def __init__(
        self,
        episode: Episode,
        system: Path | Stand = SYSTEM,
        properties: Sequence[PropertyClass] = PROPERTIES,
        claims: Claims = NOTHING,
    ) -> None:
        its, self.database = _ready(system)
        its = replace(its, system=replace(its.system, within=WITHIN_TICKS))
        refused = ""
        try:
            self.orders = _operator(episode, self.database, its.signs["task"])
        except (BadScript, ValueError):
            refused, episode = "refused", replace(episode, rows=(), interruptions=())
            self.orders = _operator(episode, self.database, its.signs["task"])
        self.in_cell = episode
        lying = [_lying(self.database, part) for part in episode.parts]
        self.plant = plant(self.database, episode.backend, lying, episode.seed, episode.step_s)
        around = Staged((self.plant,), self.database.queries), self.orders
        super().__init__(episode.in_any_system(), its, claims, around)
        self._end = refused
        seen = self.cycle
        self.cycle = self.state = CycleState(
            seen.levels,
            seen.plants,
            seen.operator,
            seen.said,
            seen.before,
            seen.left,
            database=self.database,
            plant=self.plant,
            bodies=tuple(part.body for part in lying),
        )
        self.state.look()
        self.properties = [make(self.state) for make in properties]
        self.watching.append(self)
        task = next(served for served in its.served if served.level == "task")
        self._line = OrderLine(task, (), self.orders.station.task)
        self.orders.lines = (self._line,)
        self._set: dict[str, float] = {}
        self._sent: Values = ()
        self._taken = True

    def step(self) -> None:
        """Run one tick."""
        for push in self.in_cell.pushes:
            if push.tick == self.system.tick:
                self._push(push)
        super().step()

    def _ended(self) -> str:
        last = next((end for end in reversed(self.operator.ends) if end.state != CHANGED), None)
        if last is None or last.state == "done":
            return "done" if self.operator.over else "running"
        if last.state == "refused":
            return "refused"
        command = last.text.partition(" ")[0].partition("-")[0].lower()
        word = last.reason.partition(":")[0]
        return f"failed:{word if ' ' not in word else command}"

    # --- what goes wrong ---

    def _push(self, push: Push) -> None:
        mechanism = self.plant.mechanism
        if isinstance(mechanism, Kinematic) and push.part < len(self.state.bodies):
            mechanism.push(push.part, push.x_mm, push.y_mm)

    def _switch(self, tick: int) -> None:
        """Have on, of the plant's faults, those of this tick, each with its value; a command has to end in time all the same."""
        wanted = {
            fault.fault: fault.value
            for fault in self.in_cell.faults
            if fault.first_tick <= tick <= fault.last_tick
        }
        if wanted != self._set:
            for name in self.plant.faults:
                self.plant.faults.set(name, wanted.get(name, 0.0))
        self._set = wanted

    def _note(self, tick: int) -> None:
        """Which fault classes are at work in this tick."""
        state, episode = self.state, self.in_cell
        now = [harm for harm in episode.transport if harm.first_tick <= tick <= harm.last_tick + harm.ticks]
        state.harmed = frozenset(harm.buffer for harm in now)
        state.active = frozenset((*self._set, *(harm.kind for harm in now)))
        if state.restarted:
            state.active |= {"restarted"}
        if any(push.tick == tick for push in episode.pushes):
            state.active |= {"pushed"}
        for name in state.active:
            state.last[name] = tick

    # --- what is seen ---

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield the violations of the cell's properties."""
        state = self.state
        self._note(cycle.tick - 1)
        state.look()
        self._command()
        for watcher in self.properties:
            violation = watcher.watch(state)
            if violation is not None:
                yield Broken(watcher.name, violation)

    def _command(self) -> None:
        """The command under way, and whether it has ended."""
        state, line = self.state, self._line
        state.ended = ""
        sent = self.orders.station.task.sent
        if sent != self._sent:
            self._sent, self._taken = sent, False
            state.command = command = self._ordered(sent)
            spec = OrderSpec("task", command.name)
            line.given, line.ended = Given(command.number, spec, state.tick, command.name == "pause"), None
        if state.command is not None and not self._taken:
            self._take(state.command)
        echo = state.value("task", "to_workstation.inc_command_echo")
        if line.given is not None and line.ended is None and line.given.number == echo:
            status = state.shown("task", "to_workstation.status_report")
            if status != "executing":
                line.ended, state.ended = state.tick, status

    def _take(self, command: Command) -> None:
        """What TASK believed when it saw the command."""
        task, before = self.system.level("task"), self.state.left["task"]
        if task.value("inc_command_seen") != command.number:
            return
        index, leaves = task.sign.index, task.sign.leaves
        holds, here = index["obj_now_in_gripper"], index["current_loc"]
        self._taken = True
        self.state.command = replace(command, held=leaves[holds].shown(before[holds]), here=int(before[here]))

    def _ordered(self, sent: Values) -> Command:
        state = self.state
        given = zip(self.orders.station.order, sent, strict=True)
        words = {field_of(leaf): (value, leaf.shown(value)) for leaf, value in given}
        number, grasp, source, dest, end_at, sector = (int(words[name][0]) for name in NUMBERS)
        return Command(
            number,
            words["input_command"][1],
            words["obj"][1],
            grasp,
            source,
            dest,
            end_at,
            sector,
            state.tick,
            state.shown("task", "obj_now_in_gripper"),
            int(state.value("task", "current_loc")),
        )


def run(
    episode: Episode, system: Path = SYSTEM, log: Path | None = None, claims: Claims = NOTHING
) -> EpisodeOutcome:
    """Run an episode to its end, with every property watching.

    Args:
        episode: What to run.
        system: The description of the system; its generated executors are used as they are.
        log: Where to keep every cycle (MCAP); none by default.
        claims: What was proved of the system, which is watched, too.

    Raises:
        BadDescription, BadData, NotBuilt: The system is not in order.
        ValueError: The episode names a buffer or a level that is not there.
        OSError: The log cannot be written.
    """
    return Loop(episode, system, claims=claims).finish(log)


# --- what a loop is made of ---


_DATABASES: dict[tuple[tuple[tuple[str, int], ...], int], Database] = {}
"""By the files of a stand, and the time of the data."""


def _ready(system: Path | Stand) -> tuple[Stand, Database]:
    """Return the system with its database, read once while their files do not change."""
    its = system if isinstance(system, Stand) else stand(system)
    data = its.system.database
    key = its.files, data.stat().st_mtime_ns if data.is_file() else 0
    if key not in _DATABASES:
        needs_cell(its.system, its.signs)
        _DATABASES[key] = database_of(its.system, its.signs)
    return its, _DATABASES[key]


@lru_cache(maxsize=1024)
def _rows(rows: tuple[str, ...]) -> tuple[ScriptRow, ...]:
    """Return rows of a script; raises BadScript where one says nothing that a workstation can do."""
    try:
        return script_rows(script(rows), "the episode")
    except Malformed as error:
        raise BadScript(f"the episode: {error}") from error


def _operator(episode: Episode, database: Database, task: Signature) -> Operator:
    """Return the workstation with the episode's script, and whoever interrupts it.

    Raises:
        BadScript: A row says nothing, or names something unknown.
        ValueError: An interruption is none of TASK's commands, or several.
    """
    changes = sorted(episode.interruptions, key=lambda change: change.tick)
    rows = workstation(
        [row for change in changes for row in _rows((change.row,))], database.locations, task
    ).rows
    station = workstation(_rows(episode.rows), database.locations, task)
    for row in rows:
        commanded(station, row)
    return Operator(
        station=station, changes=[(change.tick, row) for change, row in zip(changes, rows, strict=True)]
    )


def _lying(database: Database, part: PartSpec) -> Lying:
    """Return a part where the episode has it. Raises BadData: no part or no station is called so."""
    if part.object not in database.objects or part.station not in database.stations:
        raise BadData((f"no part is called `{part.object}`, or no station `{part.station}`",))
    number = database.objects[part.object]
    length, width, height = part.size_mm or database.sizes[number]
    station = database.stations[part.station]
    at_mm = station.frame.point((part.x_mm, part.y_mm, height / 2))
    turn = about_z(station.yaw_deg + part.yaw_deg)
    return Lying(number, Body((length, width, height), at_mm, turn, part.density_kg_m3, part.friction))

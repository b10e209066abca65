"""Properties that compare what TASK reports with the cell as it is: DONE is true, and so are the counts of the buffer."""

from math import dist
from typing import ClassVar

from rcsc_cell.cell.arm import plate
from rcsc_cell.database.ask import Database, Station
from rcsc_cell.properties.cycle import COUNTED, LETS_GO, TAKES, Command, CycleState
from rcsc_cell.workstation.interlocks import PUTS

PLATE_MM = 3.0
"""The plate is this near to the point of a location: the robot's own tolerance of 1 mm, and what a clamped part pushes it aside."""
FALLS_MM = 20.0
"""A part that is let go of higher than this above where it ends has fallen, and may have rolled."""
CLOSING_TICKS = 40
"""Fingers that were closing when TASK lost its state have closed by then."""
PLACED_MM = 15.0
"""A part that was put down lies this near, aside, to where the fingers were to let go of it: 1 mm of vision, the slack between part
and jaws, and in the V-block half of what a part slides until it lies on both walls."""
ON_TABLE_MM = 6.0
"""A part whose lowest point is no higher above a table lies on it."""
"""`LETS_GO` is excused: E-MOVE looks at the hand at the end of a way, and at RELEASE, so that a part which a fault takes out of the
fingers in the cycles after that is missed when it is not where it should be."""
CHANGED_PICKUP = True
"""PICKUP is booked when it is ordered: TASK then counts one less (Fig. 9). Another command while the fingers close leaves that so,
whatever they hold by then. Counts are not looked at in the command that came between."""
CHANGED_RELEASE = True
"""A part is counted when RELEASE is done. Another command while the fingers open may leave it on the buffer, uncounted: TASK takes it to
be held until the next command finds that it is not."""
PUSHED = frozenset({"pushed"})
"""Somebody pushed a part after it was put down, or from the table."""
ASIDE = frozenset({"pushed", "shifted_mm", "noisy"})
"""A part that does not lie where it was seen is taken aside of its middle, and put down as far aside."""
SLIDES_TICKS = 25
"""How much later a part that slips is out of the fingers."""
REST_RAD = 0.002


class DoneTrue:
    """DONE is true: the robot is where it was to end; the right part is in the hand, as wide as the database says, or was put down there.

    A MOVE or an ACQUIRE that used vision holds a part of the kind that was asked for; where the source is known without vision, only the
    width is looked at, by the tables and here: they cannot know more (section 3, `loc-of-obj`).
    """

    name: ClassVar[str] = "DONE is true"
    place: ClassVar[str] = "sections 3.1 to 3.5 and 6.5"
    lets_go: ClassVar[frozenset[str]] = LETS_GO

    def __init__(self, cycle: CycleState) -> None:
        self._in_hand: int | None = None
        self._taken = 0  # when the command was given that took it
        self._let_go = (0.0, 0.0, 0.0)
        self._excused = False
        self._begun: Command | None = None
        self._objects = cycle.objects()
        self._before = cycle.joints
        self._forgot: int | None = None  # when TASK lost its state, until the hand is empty

    def watch(self, cycle: CycleState) -> str | None:
        """Return what is false of a DONE."""
        self._follow(cycle)
        before, self._before = self._before, cycle.joints
        if cycle.command is None or cycle.ended != "done":
            return None
        if cycle.command.name == "pause":
            return _at_rest(cycle, before)
        return (
            self._robot(cycle, cycle.command)
            or self._hand(cycle, cycle.command)
            or self._put(cycle, cycle.command)
        )

    def _follow(self, cycle: CycleState) -> None:
        """Which part was in the fingers last, and whether a fault took it out of them."""
        believed = cycle.shown("task", "obj_now_in_gripper") != "null_obj"
        if "task" in cycle.restarted:
            self._forgot = cycle.tick
        elif self._forgot is not None and not cycle.held and cycle.tick - self._forgot > CLOSING_TICKS:
            self._forgot = None
        if cycle.held:
            self._in_hand = cycle.held[0]
            if cycle.command is not None and cycle.shown("task", "to_emove.input_command") == "pickup":
                self._taken = cycle.command.tick
            self._excused = self._excused and cycle.shown("task", "to_emove.input_command") != "pickup"
            self._let_go = cycle.parts[cycle.held[0]].at_mm
        elif believed and cycle.was_active(self.lets_go, cycle.tick - SLIDES_TICKS):
            self._excused = True
        if cycle.command is not self._begun:
            if not believed and not cycle.held:
                self._excused, self._in_hand = False, None
            self._begun = cycle.command

    def _robot(self, cycle: CycleState, command: Command) -> str | None:
        """Whether the plate is at the location where the command ends."""
        location = _ends_at(cycle, command)
        if not location or command.name == "acquire":
            return None
        there = cycle.database.plate(location, command.sector if location == command.dest else 0)
        if there is None:
            return None
        (x, y, z), at = there.at_mm, plate(cycle.joints).at_mm
        off_mm = min(dist((x, y, z + up), at) for up in self._lifts(cycle))
        return f"the plate is {off_mm:.1f} mm off" if off_mm > PLATE_MM else None

    def _lifts(self, cycle: CycleState) -> tuple[float, ...]:
        """Return how much higher than the location the pads may be, in mm: by the part that is in the hand, or was."""
        if self._in_hand is None:
            return (0.0,)
        kind = self._objects[self._in_hand]
        return (0.0, float(cycle.database.part(cycle.database.objects[kind])[3]))

    def _hand(self, cycle: CycleState, command: Command) -> str | None:
        """Whether what TASK believes to hold is in the fingers."""
        believed = cycle.shown("task", "obj_now_in_gripper")
        if self._excused or believed == "unknown_object":
            return None  # of that nothing is known; jammed fingers may have nothing between them
        if believed == "null_obj":
            unknown = cycle.held and self._forgot is None
            return f"the hand holds part {cycle.held[0]}, and TASK knows of none" if unknown else None
        if not cycle.held:
            return f"TASK holds `{believed}`, and nothing is between the pads"
        known, _, _, grip_mm, tolerance_mm, *_ = cycle.database.fingers(
            cycle.database.objects[believed], int(cycle.value("task", "grasp_now"))
        )
        if known and abs(cycle.opening_mm - grip_mm) > tolerance_mm:
            return f"the fingers are {cycle.opening_mm:.1f} mm apart, not {grip_mm:.1f}"
        kind = self._objects[cycle.held[0]]
        source = command.source or (command.here if command.name == "acquire" else 0)
        seen = bool(cycle.database.place(source)[1]) and command.name in TAKES
        return f"the hand holds a `{kind}`, not a `{believed}`" if seen and kind != believed else None

    def _put(self, cycle: CycleState, command: Command) -> str | None:
        """Whether what was put down lies where it was to be."""
        if command.name not in PUTS or self._excused or self._in_hand is None:
            return None
        if cycle.was_active(PUSHED, command.tick) or cycle.was_active(ASIDE, self._taken):
            return None
        there = cycle.database.pads(command.dest, command.sector) if command.dest else None
        target = there or self._let_go  # RELEASE lets go where the hand is
        at = cycle.parts[self._in_hand].at_mm
        if there is None and self._let_go[2] - at[2] > FALLS_MM:
            return None  # it was let go of in the air: where it comes to rest nobody has said
        off_mm = dist(target[:2], at[:2])
        return f"part {self._in_hand} lies {off_mm:.1f} mm aside" if off_mm > PLACED_MM else None


class CountsTrue:
    """What TASK counts on the buffer changes with a command as what lies there does."""

    name: ClassVar[str] = "buffer counts"
    place: ClassVar[str] = "section 8.1, item 5: REMOVE-FROM-BUFFER-DB"
    lets_go: ClassVar[frozenset[str]] = LETS_GO
    changed_pickup: ClassVar[bool] = CHANGED_PICKUP
    changed_release: ClassVar[bool] = CHANGED_RELEASE

    def __init__(self, cycle: CycleState) -> None:
        self._tables = _buffers(cycle.database)
        self._objects = cycle.objects()
        self._begun: Command | None = None
        self._was = self._difference(cycle)
        self._excused = False
        self._forgot = -CLOSING_TICKS

    def watch(self, cycle: CycleState) -> str | None:
        """Return the count that is wrong."""
        if "task" in cycle.restarted:
            self._excused, self._forgot = True, cycle.tick  # it has forgotten what it counted
        if cycle.command is not self._begun:
            same = (
                self._begun is not None
                and cycle.command is not None
                and self._begun.number == cycle.command.number
            )
            closing = cycle.tick - self._forgot < CLOSING_TICKS  # fingers may still take a part
            # a part that a changed PICKUP has counted
            believed = cycle.shown("task", "obj_now_in_gripper") != "null_obj"
            still = same or closing or believed or bool(cycle.held)
            picking = self.changed_pickup and _under_way(cycle, "pickup")
            letting_go = self.changed_release and _under_way(cycle, "release")
            self._excused = (self._excused and still) or picking or letting_go
            self._begun, self._was = cycle.command, self._difference(cycle)
        if cycle.command is None or cycle.ended != "done" or self._excused:
            return None
        if cycle.was_active(self.lets_go | PUSHED, cycle.command.tick):
            return None  # a part that is dropped on the buffer is not counted
        if cycle.command.name == "release" and not cycle.database.place(cycle.command.here)[2]:
            return None  # nor is one that is let go of in the air above it: TASK counts by the name of the location
        now = self._difference(cycle)
        wrong = [name for name in COUNTED if now[name] != self._was[name]]
        return f"`{wrong[0]}`: TASK counts {now[wrong[0]] - self._was[wrong[0]]:+} more" if wrong else None

    def _difference(self, cycle: CycleState) -> dict[str, int]:
        """Return by how many TASK counts more than lie there."""
        return {
            name: count
            - sum(
                kind == name and at not in cycle.held and _lies_on(cycle, at, self._tables)
                for at, kind in enumerate(self._objects)
            )
            for name, count in cycle.counts.items()
        }


def _at_rest(cycle: CycleState, before: tuple[float, ...]) -> str | None:
    """PAUSE is done: robot and hand are told to rest, and the robot does."""
    if cycle.shown("primitive", "to_robot.input_command") != "hold":
        return "the robot is not told to hold"
    moved_rad = max(abs(a - b) for a, b in zip(before, cycle.joints, strict=True))
    return f"a joint moved by {moved_rad:.4f} rad" if moved_rad > REST_RAD else None


def _under_way(cycle: CycleState, command: str) -> bool:
    """Whether this command of E-MOVE is under way."""
    executing = cycle.shown("task", "to_workstation.status_report") == "executing"
    return executing and cycle.shown("task", "to_emove.input_command") == command


def _ends_at(cycle: CycleState, command: Command) -> int:
    """Return the location at which the robot ends; 0 where the command leaves it where it is."""
    match command.name:
        case "acquire":
            return command.source or command.here
        case "move":
            return command.dest
        case "release" | "transfer" | "clear":
            put = command.dest or command.here
            return command.end_at or int(cycle.database.place(put)[4])
        case _:
            return 0


def _buffers(database: Database) -> tuple[Station, ...]:
    """Return the tables under locations whose parts TASK counts."""
    buffers = []
    for location in database.locations.values():
        at = database.pads(location, 0) if database.place(location)[2] else None
        if at is not None:
            buffers += [station for station in database.stations.values() if station.below(at)]
    return tuple(buffers)


def _lies_on(cycle: CycleState, part: int, tables: tuple[Station, ...]) -> bool:
    pose = cycle.parts[part]
    low = cycle.bodies[part].lowest_mm(pose)
    return any(table.below(pose.at_mm) and low - table.frame.at_mm[2] < ON_TABLE_MM for table in tables)

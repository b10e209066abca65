"""The cell as far as a log says it: the arm where the wrist plate's nine numbers are, and every place and part that a buffer names.

In: a log, a description of the same system, and the cell's database. Out: a picture and its caption for each tick. What names something
is told by the description: it is what the database is asked for. A log holds numbers and names; where they are, the database says.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from rcsc.lang.restart import STATUS
from rcsc.run.description import Description
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.signature import Values
from rcsc_cell.cell.arm import Joints, solve
from rcsc_cell.cell.mujoco_model import OPEN_MM
from rcsc_cell.cell.reach import home
from rcsc_cell.cell.ready import lying
from rcsc_cell.database.ask import Database
from rcsc_cell.database.build import BadData
from rcsc_cell.database.pose import Pose, Vector, pose_of
from rcsc_cell.pictures.room import ALONE, PICTURES, Mark, block, outline
from rcsc_cell.pictures.stick import Scene, pads, stick

PLATE, OPENING = ".plate", ".opening_mm"
"""How the names end of nine numbers of the wrist plate, and of how far the fingers are apart."""


@dataclass(frozen=True, slots=True)
class DrawnScene:
    """The cell in a tick: an SVG document, and notes on it, a sentence each."""

    svg: str
    caption: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Key:
    """Leaves that the database is asked for."""

    query: str
    leaves: tuple[str, ...]


@dataclass(slots=True)
class _Named:
    """Something of the cell that is named.

    Attributes:
        by: The leaves that name it, with their levels.
        at_mm: Where; more places than one where it is not said which; none where the data does not know it.
    """

    name: str
    by: list[str] = field(default_factory=list)
    at_mm: tuple[Vector, ...] = ()
    part: int | None = None


@dataclass(frozen=True, slots=True)
class _Plate:
    """Nine numbers of the wrist plate, and the leaves that they are of."""

    name: str
    numbers: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class DrawnCell:
    """A cell to be drawn.

    Attributes:
        data: What the file is called that says where things are.
        rest: The joints at rest.
    """

    log: Log
    system: Description
    database: Database
    data: str
    rest: Joints

    def drawn(self, tick: int, *, projected: bool = False) -> DrawnScene:
        """The cell as of a tick: in perspective alone, or in three projections with it."""
        held = {level.name: level.track.latest(tick) for level in self.log.levels}
        states = {name: values for name, values in held.items() if values is not None}
        named = self._named(states)
        plates = list(self._plates(states))
        plate, joints, note = self._arm(plates)
        others = tuple(self._others(plates, plate))
        marks = (
            *(
                Mark("" if at else thing.name, place)
                for thing in named
                for at, place in enumerate(thing.at_mm)
            ),
            *others,
        )  # a pallet that is named whole has a ring at each place, and its name once
        parts = {thing.part for thing in named}
        names = {number: name for name, number in self.database.objects.items()}
        blocks = tuple(
            block(
                names[part.object],
                Pose(part.body.turn, part.body.at_mm),
                part.body.size_mm,
                named=part.object in parts,
            )
            for part in lying(self.database)
        )
        outlines = tuple(map(outline, self.database.stations.values()))
        scene = Scene(outlines, (), self.database.hand.tool_mm, blocks, marks)
        return DrawnScene(
            stick(plate, self._opening_mm(states), joints, scene, PICTURES if projected else ALONE),
            (note, *self._told(named), *(f"`{other.name}` is marked." for other in others)),
        )

    # --- the arm ---

    def _arm(self, plates: list[_Plate]) -> tuple[tuple[float, ...], Joints | None, str]:
        """Return the plate to draw, its joints, and a note on which it is; at rest where none is a pose."""
        for plate in plates:
            pose = pose_of(plate.numbers)
            if pose is not None:
                joints = solve(pose, self.rest)
                cannot = "" if joints is not None else "; the arm cannot be there"
                return plate.numbers, joints, f"The hand is where `{plate.name}` says{cannot}."
        at_rest = tuple(float(value) for value in self.database.home)
        if plates:
            none = " and ".join(f"`{plate.name}`" for plate in plates)
            return at_rest, self.rest, f"No pose is in {none}; the arm is drawn at rest."
        return at_rest, self.rest, "The log holds no pose; the arm is drawn at rest."

    def _plates(self, states: Mapping[str, Values]) -> Iterator[_Plate]:
        """Yield plates that are ordered, then reported ones, then all others."""
        plates = []
        for level, values in self._levels(states):
            for at, leaf in enumerate(level.sign.leaves):
                name, _, index = leaf.name.partition("[")
                if index == "0]" and name.endswith(PLATE) and len(level.sign.record(name)) == 9:
                    record = name.removesuffix(PLATE)
                    reported = f"{record}.{STATUS}" in level.sign.index
                    rank = 0 if leaf.kind == "output" else 1 if reported else 2
                    numbers = tuple(float(value) for value in values[at : at + 9])
                    plates.append((rank, _Plate(f"{level.name}.{name}", numbers)))
        yield from (plate for _, plate in sorted(plates, key=lambda ranked: ranked[0]))

    def _others(self, plates: list[_Plate], drawn: tuple[float, ...]) -> Iterator[Mark]:
        """Yield where the pads are by the plates that are not drawn."""
        for plate in plates:
            pose = pose_of(plate.numbers)
            if pose is not None and plate.numbers != drawn:
                yield Mark(plate.name, pads(pose, self.database.hand.tool_mm))

    def _opening_mm(self, states: Mapping[str, Values]) -> float:
        """What is reported of the fingers; open where nothing is."""
        for level, values in self._levels(states):
            for at, leaf in enumerate(level.sign.leaves):
                reported = f"{leaf.name.removesuffix(OPENING)}.{STATUS}" in level.sign.index
                if leaf.kind == "input" and leaf.name.endswith(OPENING) and reported:
                    return float(values[at])
        return OPEN_MM

    # --- what is named ---

    def _named(self, states: Mapping[str, Values]) -> list[_Named]:
        """Return everything that is named, once each."""
        things: dict[str, _Named] = {}
        for level, values in self._levels(states):
            for key in self._keys(level):
                if (thing := self._thing(level, key, values)) is not None:
                    held = things.setdefault(thing.name, thing)
                    held.by += [by for by in thing.by if by not in held.by]
        return list(things.values())

    def _thing(self, level: LoggedLevel, key: _Key, values: Values) -> _Named | None:
        """What these leaves name; None where they name nothing."""
        first = level.sign.leaves[level.sign.index[key.leaves[0]]]
        asked = [int(values[level.sign.index[leaf]]) for leaf in key.leaves]
        if asked[0] == 0:
            return None
        by = [f"{level.name}.{first.name}"]
        if key.query in _OF_PARTS:
            name = first.shown(asked[0])
            return _Named(name, by, (), self.database.objects.get(name, -1))
        if key.query == "point":
            pose = pose_of([float(value) for value in self.database.point(asked[0])[1:10]])
            at_mm = () if pose is None else (pose.point((0.0, 0.0, self.database.hand.tool_mm)),)
            return _Named(f"point {asked[0]}", by, at_mm)
        names = {number: name for name, number in self.database.locations.items()}
        name, sectors = names.get(asked[0], f"location {asked[0]}"), self._sectors(asked[0])
        shown_sectors = asked[1:] if len(sectors) > 1 else []
        shown = f"{name}({shown_sectors[0]})" if shown_sectors else name
        return _Named(shown, by, self._places(asked[0], asked[1:] or sectors))

    def _sectors(self, location: int) -> list[int]:
        """Return the sectors: several of a pallet, else one."""
        return [number for place, number, _ in self.database.routes() if place == location]

    def _places(self, location: int, sectors: list[int]) -> tuple[Vector, ...]:
        every = (self.database.pads(location, number) for number in sectors)
        return tuple(place for place in every if place is not None)

    def _keys(self, level: LoggedLevel) -> Iterator[_Key]:
        """What the database is asked for, and whatever else in the level's buffers is a part by the same words."""
        known = [
            key
            for key in self._asked(level)
            if key.query in _ASKED and all(leaf in level.sign.index for leaf in key.leaves)
        ]
        yield from known
        words = {
            level.sign.leaves[level.sign.index[key.leaves[0]]].members
            for key in known
            if key.query in _OF_PARTS
        }
        for leaf in level.sign.leaves:
            if leaf.members and leaf.members in words and leaf.kind != "state":
                yield _Key("part", (leaf.name,))

    def _asked(self, level: LoggedLevel) -> Iterator[_Key]:
        """What the database is asked for of a level: its own leaves, and those that a buffer carries to another level's."""
        for spec in self.system.levels:
            for feed in spec.feeds:
                if spec.name == level.name:
                    yield _Key(feed.query, feed.keys[:2])  # of a path, where it begins
                for wire in self.system.wires:
                    giver, _, source = wire.source.partition(".")
                    taker, _, target = wire.target.partition(".")
                    inside = all(key.startswith(f"{target}.") for key in feed.keys)
                    if giver == level.name and taker == spec.name and inside:
                        leaves = (source + key.removeprefix(target) for key in feed.keys)
                        yield _Key(feed.query, tuple(leaves))

    def _told(self, named: list[_Named]) -> Iterator[str]:
        lying_here = {part.object for part in self.database.parts}
        for thing in named:
            by = ", ".join(f"`{leaf}`" for leaf in thing.by)
            if thing.part is not None:
                if thing.part < 0:
                    yield f"{thing.name} ({by}): no part of `{self.data}`."
                elif thing.part in lying_here:
                    yield f"{thing.name} ({by}) is marked where `{self.data}` has it."
                else:
                    yield f"{thing.name} ({by}): `{self.data}` has none lying about."
            elif thing.at_mm:
                yield f"{thing.name} ({by}) is marked."
            else:
                yield f"{thing.name} ({by}): `{self.data}` does not say where."

    def _levels(self, states: Mapping[str, Values]) -> Iterator[tuple[LoggedLevel, Values]]:
        return ((level, states[level.name]) for level in self.log.levels if level.name in states)


_OF_PARTS = frozenset({"part", "fingers"})
_ASKED = _OF_PARTS | {"place", "target", "path", "point"}
"""Questions whose answers stand somewhere in the cell."""


def cell(log: Log, system: Description, database: Database) -> DrawnCell:
    """The cell of a log.

    Raises:
        BadData: The robot cannot be at its home.
    """
    rest = home(database)
    if rest is None:
        raise BadData(("the robot cannot be at its home",))
    return DrawnCell(log, system, database, system.database.name, rest)

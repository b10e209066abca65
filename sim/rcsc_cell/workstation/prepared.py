"""What a system must have to fit the cell, and its database, made of the data where that has changed.

In: a description and the signatures of its levels. Out: a `Database`, or what does not fit.
"""

from collections.abc import Mapping
from pathlib import Path

from rcsc.base.host.described import Document
from rcsc.run.description import BadDescription, Description, needs_data
from rcsc.run.signature import Leaf, Signature
from rcsc_cell.database.ask import Database, fresh, open_database
from rcsc_cell.database.build import Limit, build, digest
from rcsc_cell.workstation.script import ROBOT


def parts_of(signs: Mapping[str, Signature]) -> tuple[str, ...]:
    """Return the names of parts in the tables.

    Raises:
        BadDescription: No level has a part.
    """
    leaves = signs["task"].leaves if "task" in signs else ()
    parts = next((leaf.members for leaf in leaves if leaf.name == "workstation.obj"), ())
    if not parts:
        raise BadDescription(
            "the data names parts, and no level `task` has an enumeration `workstation.obj` of them"
        )
    return parts


def limits_of(system: Description, signs: Mapping[str, Signature]) -> dict[str, list[list[Limit | None]]]:
    """Return the limits of the levels for each answer of the database, by query."""
    limits: dict[str, list[list[Limit | None]]] = {}
    for spec in system.levels:
        for feed in spec.feeds:
            leaves = signs[spec.name].leaves_of(feed.into)
            limits.setdefault(feed.query, []).append([_limit(spec.name, leaf) for leaf in leaves])
    return limits


def _limit(level: str, leaf: Leaf) -> Limit | None:
    if leaf.low is None or leaf.high is None:
        return None
    return Limit(f"{level}.{leaf.name}", leaf.low, leaf.high)


def database_path(system: Description) -> Path:
    """Return the default path of the system's database."""
    return system.database.parent / ".rcsc-cache" / f"{system.name}.sqlite"


def needs_cell(system: Description, signs: Mapping[str, Signature]) -> None:
    """Refuse a system that does not fit the workstation, robot, hand and camera of the cell.

    Raises:
        BadDescription: A buffer or a word that they need is not there; every one is told.
    """
    needs_data(system)
    page = system.review()
    targets = system.readers()
    for source, (level, record, fields) in BUFFERS.items():
        inner = f"{level}.{record}"
        if level not in signs:
            page.wrong(("level",), f"the cell needs a level `{level}`, for buffer `{source}`")
        elif source not in targets or inner not in (source, *targets[source]):
            page.wrong(("buffers",), f"the cell needs buffer `{source}`, with `{inner}` at the level's end")
        else:
            sign = signs[level]
            leaves = sign.leaves_of(record)
            if [leaf.name.removeprefix(f"{record}.") for leaf in leaves] != list(fields):
                page.wrong(("buffers", source), f"the cell needs in `{inner}`: {', '.join(fields)}")
    if not page.faults:
        _need_words(page, signs)
    if page.faults:
        raise page.bad(BadDescription)


def _need_words(page: Document, signs: Mapping[str, Signature]) -> None:
    for (level, variable), words in WORDS.items():
        sign = signs[level]
        missing = [word for word in words if word not in sign.leaves[sign.index[variable]].members]
        if missing:
            page.wrong(("level",), f"the cell needs in `{level}.{variable}` the words {', '.join(missing)}")


_PLATE = tuple(f"plate[{at}]" for at in range(9))
BUFFERS: Mapping[str, tuple[str, str, tuple[str, ...]]] = {
    "workstation.order": ("task", "workstation", (
        "inc_command", "input_command", "obj", "grasp", "source_locpt", "dest_locpt", "end_at_locpt", "sector",
    )),
    "task.to_workstation": ("task", "to_workstation", (
        "inc_command_echo", "ref_command_echo", "status_report", "status_parameter", "failure", "cause",
    )),
    "primitive.to_robot": ("primitive", "to_robot", ("inc_command", "input_command", *_PLATE)),
    "robot.report": ("primitive", "from_robot", (
        "inc_command_echo", "ref_command_echo", "status_report", "failure", *_PLATE,
    )),
    "gripper.to_hand": ("gripper", "to_hand", ("drive", "opening_mm", "force_n", "speed_mm_s")),
    "hand.report": ("gripper", "hand", ("opening_mm", "force_n")),
    "vision.to_camera": ("vision", "to_camera", ("number", "fire", "obj_ptr")),
    "camera.picture": ("vision", "camera", (
        "number", "matched", "x_mm", "y_mm", "c", "s", "range_mm", "normal.x", "normal.y",
        "normal.z",
    )),
}  # fmt: skip
"""What workstation, robot, hand and camera write and read: of each buffer the level, its variable, and the fields in order."""
WORDS: Mapping[tuple[str, str], tuple[str, ...]] = {
    ("task", "workstation.input_command"): ROBOT,
    ("task", "workstation.obj"): ("null_obj",),
    ("task", "to_workstation.status_report"): ("done", "executing", "failed"),
}


def database_of(system: Description, signs: Mapping[str, Signature], path: Path | None = None) -> Database:
    """Open the database, built anew where the data has changed; open `path` as it is where it is given.

    Raises:
        BadData: The data or the file is not in order.
        BadDescription: The description names no data.
    """
    if path is not None:
        return open_database(path)
    needs_data(system)
    kept, parts, limits = database_path(system), parts_of(signs), limits_of(system, signs)
    if not system.database.is_file() or not fresh(kept, digest(system.database, parts, limits)):
        build(system.database, kept, parts, limits)
    return open_database(kept)


def safe_places(database: Database) -> dict[str, str]:
    """Return the safe location of each location that has one, by name."""
    names = {number: name for name, number in database.locations.items()}
    safe = {name: int(database.place(number)[4]) for name, number in database.locations.items()}
    return {name: names[number] for name, number in safe.items() if number}

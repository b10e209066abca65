"""The plants that a description declares: `[plant]` and `[plant.NAME]`.

In: a document. Out: a `PlantSpec` for each, in order; the first is the one that runs when nobody says which. What a plant
is, `rcsc.run.plant` says; whether it fits the levels is seen when it is loaded.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rcsc.base.host.described import (
    Anything,
    Document,
    Entries,
    Flag,
    KeyPath,
    Kind,
    Listing,
    Number,
    Record,
    Text,
    Word,
    nearest,
)
from rcsc.base.host.files.names import BadName, is_identifier, is_member, within
from rcsc.lang.project import project_root

PYTHON: Mapping[str, Kind] = {
    "python": Text(),
    "parties": Listing(Word()),
    "by_hand": Flag(),
    "campaign": Text(),
}
SENSOR = Record(
    {},
    {
        "sensor": Text(),
        "element": Number(0, 1000, whole=True),
        "unit": Text(),
        "scale": Number(),
        "over": Number(),
        "under": Number(),
        "values": Entries(Number()),
        "value": Anything(),
    },
)
ACTUATOR = Record(
    {}, {"actuator": Text(), "unit": Text(), "scale": Number(), "values": Entries(Number()), "ignore": Flag()}
)
FAULT = Record({}, {"actuator": Text(), "control": Number(), "field": Text(), "value": Anything()})
MODEL: Mapping[str, Kind] = {
    "model": Text(),
    "parties": Listing(Word()),
    "by_hand": Flag(),
    "keyframe": Text(),
    "sensors": Entries(SENSOR),
    "actuators": Entries(ACTUATOR),
    "faults": Entries(FAULT),
}


@dataclass(frozen=True, slots=True)
class PlantSpec:
    """A plant of a description.

    Attributes:
        name: As `--plant` calls it; empty for `[plant]` itself.
        python: `FILE.py:CLASS`, seen from the description, or `MODULE:NAME`; empty for a model.
        folder: Where the description stands.
        parties: Whom it stands for; None for all that are outside and order no level.
        model: The file of a MuJoCo model; None where there is none.
        keyframe: From which the model starts; empty for its first state.
        sensors: What fills a buffer's field, by the far end; `actuators` what a field drives.
        faults: By name, what a model does wrong while somebody switches it on.
        by_hand: Whether `rcsc shell` and `rcsc campaign` take it when nobody says which.
        campaign: `MODULE:NAME` of the kind of its episodes, where they are not those of any system.
        path: Where it stands in the document.
    """

    name: str
    python: str = ""
    folder: Path = field(default_factory=Path)
    parties: tuple[str, ...] | None = None
    model: Path | None = None
    keyframe: str = ""
    sensors: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    actuators: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    faults: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    by_hand: bool = False
    campaign: str = ""
    path: KeyPath = ("plant",)


def plants(path: Path, document: Document) -> tuple[PlantSpec, ...]:
    """Read the plants of a description; note their errors in the document."""
    table = document.value.get("plant", {})
    if not isinstance(table, dict):
        return ()  # which its kind says
    own = {key: value for key, value in table.items() if not isinstance(value, dict)}
    named = {key: value for key, value in table.items() if isinstance(value, dict)}
    specs = []
    if "model" in own:
        document.wrong(
            ("plant", "model"),
            "`[plant]` itself is in Python",
            "write `[plant.mujoco]` above `model`, or any other name",
        )
    elif own:
        document.check_part(Record({"python": PYTHON["python"]}, PYTHON), own, ("plant",))
        specs.append(_spec(path, document, "", own, ("plant",)))
    for name, value in named.items():
        place = ("plant", name)
        if not is_identifier(name):
            document.wrong(place, f"`{name}` is no name of a plant")
        if "model" in value:
            document.check_part(Record({"model": Text()}, MODEL), value, place)
            _check_ends(document, value, place)
        elif name in MODEL and own:
            document.wrong(
                place,
                f"`plant.{name}` is of a model, and `[plant]` is none",
                f"write `[plant.mujoco.{name}]`",
            )
        else:
            document.check_part(Record({"python": Text()}, PYTHON), value, place)
        specs.append(_spec(path, document, name, value, place))
    return () if document.faults else tuple(specs)


def _check_ends(document: Document, table: Mapping[str, Any], place: KeyPath) -> None:
    """Check that sensors and actuators are bound to ends that a buffer could have."""
    buffers = document.value.get("buffers")
    for key, side in (("sensors", 0), ("actuators", 1)):
        rows = buffers.items() if isinstance(buffers, dict) else ()
        pairs = [
            (source, target)
            for source, said in rows
            for target in (said if isinstance(said, list) else (said,))
        ]
        ends = [pair[side] for pair in pairs]
        bound = table.get(key, {})
        for end in bound if isinstance(bound, dict) else ():
            if not is_member(end) or not any(
                end == buffer_end or end.startswith((f"{buffer_end}.", f"{buffer_end}["))
                for buffer_end in ends
            ):
                what = "a buffer that comes from outside" if side == 0 else "a buffer that goes outside"
                document.wrong(
                    (*place, key, end),
                    f"`{end}` is no end of {what}",
                    *nearest(end, [str(buffer_end) for buffer_end in ends]),
                )


def _spec(path: Path, document: Document, name: str, table: Mapping[str, Any], place: KeyPath) -> PlantSpec:
    parties = table.get("parties")
    model = table.get("model")
    model_path = None
    if isinstance(model, str):
        try:
            model_path = within(
                Path(project_root(str(path))), path.parent, model, f"path `{place[-1]}.model`"
            )
        except BadName as error:
            document.wrong((*place, "model"), str(error))
    return PlantSpec(
        name,
        str(table.get("python", "")),
        path.parent,
        tuple(parties) if isinstance(parties, list) else None,
        model_path,
        str(table.get("keyframe", "")),
        _entries(table, "sensors"),
        _entries(table, "actuators"),
        _entries(table, "faults"),
        table.get("by_hand") is True,
        str(table.get("campaign", "")),
        place,
    )


def _entries(table: Mapping[str, Any], key: str) -> Mapping[str, Mapping[str, Any]]:
    entries = table.get(key, {})
    return dict(entries) if isinstance(entries, dict) else {}

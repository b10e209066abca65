"""The cell's episodes as campaigns take them: what `[plant.mujoco]` and `[plant.kinematic]` of `tables/system.toml` name.

In: what `rcsc.run.campaign` asks of a kind of episodes. Out: `CELL`. The plant's name is the episode's backend.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, get_args

from rcsc.base.host.files.names import shown
from rcsc.base.host.files.read import rows_of
from rcsc.run.campaign.rig import EpisodeKind, NamedFile, Rig, programs, run_sources, sources
from rcsc.run.description import BadDescription, description
from rcsc.run.executors import NotBuilt
from rcsc_cell.cell.ready import Backend
from rcsc_cell.database.build import BadData
from rcsc_cell.episodes.episode import FAULTS, Episode, PartSpec, script
from rcsc_cell.episodes.sampling import drawn
from rcsc_cell.workstation.script import COLUMNS, PARTS

if TYPE_CHECKING:
    from rcsc_cell.episodes.loop import Loop

_CHUNKS = {"kinematic": 10, "mujoco": 4}


def _drawn(random: Random, rig: Rig[Episode]) -> Episode:
    """Return an episode of what `random` says.

    Raises:
        BadDescription: The plant is not called as one of the cell's.
    """
    for backend in get_args(Backend):
        if rig.plant == backend:
            return drawn(random, backend, rig.stand().system)
    raise BadDescription(
        f"episodes of the cell are of plants {' and '.join(get_args(Backend))}, not {shown(rig.plant)}"
    )


def _begun(episode: Episode, rig: Rig[Episode]) -> "Loop":
    """Begin an episode."""
    from rcsc_cell.episodes.loop import (
        Loop,  # of an extra, which is asked for by its name before anything is run
    )

    return Loop(episode, rig.stand(), claims=rig.claims)


def _admit(episode: Episode, system: Path, plant: str) -> Episode:  # noqa: ARG001  # it runs on its own
    """Refuse what the system has not. Raises ValueError: a level, or a buffer."""
    from rcsc.run.episodes.loop import check_names  # these load the language, as a run does
    from rcsc.run.episodes.stand import stand

    check_names(episode.in_any_system(), stand(system))
    return episode


def fault_classes(episode: Episode, system: Path | None = None) -> tuple[str, ...]:  # noqa: ARG001  # an episode of the cell says all
    """Return which of `FAULTS` an episode has, in their order; empty where it is nominal.

    Only parts that the script asks for count.
    """
    has = {
        *(fault.fault for fault in episode.faults),
        *(harm.kind for harm in episode.transport),
        *(("restarted",) if episode.restarts else ()),
        *(("changed command",) if episode.interruptions else ()),
        *(("pushed",) if episode.pushes else ()),
        *_part_faults(episode),
    }
    return tuple(name for name in FAULTS if name in has)


def _part_faults(episode: Episode) -> Iterator[str]:
    """`missing part`, `wrong part` and `two parts` of those that are asked for at the buffer; `odd size`, `odd weight` of any."""
    here = [part.object for part in episode.parts if part.station == "buffer"]
    for wanted in _asked((*episode.rows, *(interruption.row for interruption in episode.interruptions))):
        if wanted not in here:
            yield "wrong part" if here else "missing part"
        elif sum(_top(part) == _top(wanted) for part in here) > 1:
            yield "two parts"  # vision takes the nearer one, and the lines may tell that it is the other
    usual = PartSpec("")
    for part in episode.parts:
        if part.size_mm:
            yield "odd size"
        if (part.density_kg_m3, part.friction) != (usual.density_kg_m3, usual.friction):
            yield "odd weight"


def _top(part: str) -> str:
    """Parts with the same top: a box top and a box bottom differ in thickness alone (section 5.2)."""
    return "box" if part in {"tbox", "bbox"} else part


def _asked(rows: Sequence[str]) -> Iterator[str]:
    """Yield objects that rows take from the buffer."""
    for row in rows_of(script(rows), COLUMNS):
        name = PARTS.get(row["part"].partition(" ")[0])
        if name and row["source"] == "BUFFER":
            yield name


def _faults(system: Path, plant: str) -> tuple[str, ...]:  # noqa: ARG001  # both plants have all
    return tuple(FAULTS)


def _files(system: Path, plant: str, script: str) -> list[NamedFile]:  # noqa: ARG001  # both plants are of the same
    """Return the data, the scripts, the tables that say what is to hold, and the programs around the executors."""
    described = description(system)
    tables = [(f"{path.parent.name}/{path.name}", path) for path in programs(described, system)]
    scripts = [(f"scripts/{path.name}", path) for path in sorted(system.parent.glob("scripts/*.csv"))]
    cell = sources(Path(__file__).parents[1], "pictures")
    return [("data", described.database), *scripts, *tables, *run_sources(), *cell]


def _chunk(system: Path, plant: str) -> int:  # noqa: ARG001  # a matter of physics alone
    return _CHUNKS[plant]


CELL = EpisodeKind(
    _drawn, _begun, Episode.from_json, _admit, fault_classes, _faults, _files,
    not_in_order=(BadDescription, BadData, NotBuilt), chunk=_chunk, extra="cell", takes_script=False, told=Episode.told,
)  # fmt: skip

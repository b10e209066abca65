"""What is odd about an episode's parts, for summaries by fault.

In: an episode. Out: names of `rcsc_cell.episodes.episode.FAULTS` that are about parts.
"""

from collections.abc import Iterator, Sequence

from rcsc.base.host.files.read import rows_of
from rcsc_cell.episodes.episode import COLUMNS, FAULTS, Episode, PartSpec
from rcsc_cell.workstation.script import PARTS

USUAL = PartSpec("")


def part_faults(episode: Episode) -> Iterator[str]:
    """`missing part`, `wrong part` and `two parts` of those that are asked for at the buffer; `odd size`, `odd weight` of any."""
    here = [part.object for part in episode.parts if part.station == "buffer"]
    for wanted in _asked((*episode.rows, *(interruption.row for interruption in episode.interruptions))):
        if wanted not in here:
            yield "wrong part" if here else "missing part"
        elif sum(_top(part) == _top(wanted) for part in here) > 1:
            yield "two parts"  # vision takes the nearer one, and the lines may tell that it is the other
    for part in episode.parts:
        if part.size_mm:
            yield "odd size"
        if (part.density_kg_m3, part.friction) != (USUAL.density_kg_m3, USUAL.friction):
            yield "odd weight"


def _top(part: str) -> str:
    """Parts with the same top: a box top and a box bottom differ in thickness alone (section 5.2)."""
    return "box" if part in {"tbox", "bbox"} else part


def _asked(rows: Sequence[str]) -> Iterator[str]:
    """Yield objects that rows take from the buffer."""
    for row in rows_of("\n".join((COLUMNS, *rows)), COLUMNS.split(",")):
        name = PARTS.get(row["part"].partition(" ")[0])
        if name and row["source"] == "BUFFER":
            yield name


def fault_classes(episode: Episode) -> tuple[str, ...]:
    """Return which of `FAULTS` an episode has, in their order; empty where it is nominal.

    Only parts that the script asks for count.
    """
    has = {
        *(fault.fault for fault in episode.faults),
        *(harm.kind for harm in episode.transport),
        *(("restarted",) if episode.restarts else ()),
        *(("changed command",) if episode.interruptions else ()),
        *(("pushed",) if episode.pushes else ()),
        *part_faults(episode),
    }
    return tuple(name for name in FAULTS if name in has)

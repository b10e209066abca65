"""Episodes of the cell that are drawn, leaning on edges: parts and where they lie, rows of a script, and what goes wrong.

In: a `Random`, of a seed or Hypothesis's own, whose simplest answers make the simplest episode. Out: an `Episode`. One in five is nominal;
the others have one fault, or several; one in six has a script that is not legal. With physics only scripts that keep a held part clear of
the furniture: choosing the way is up to the workstation.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from random import Random

from rcsc.run.description import Description, description
from rcsc.run.episodes.episode import BufferFault, Harm, Restart, by_seed, happens
from rcsc_cell.cell.faults import Faults
from rcsc_cell.cell.ready import Backend
from rcsc_cell.episodes.episode import SYSTEM, Episode, Interruption, PartSpec, Push, SwitchTo

HARMS: tuple[Harm, ...] = ("lost", "doubled", "stale", "late")
VALUES: Mapping[str, tuple[float, ...]] = {
    "joint_stuck": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
    "late_ticks": (1.0, 20.0, 95.0, 120.0),
    "shifted_mm": (-30.0, -5.0, 2.0, 5.0, 30.0),
}
"""What switches that are no yes or no are set to; late pictures on both sides of the four seconds that are waited for."""
SWITCHES = tuple(switch.name for switch in fields(Faults))
KINDS = {"tbox": "BOXT", "bbox": "BOXB", "flag": "FLAG", "hous": "HOUS"}
SIZES: Mapping[str, tuple[float, float, float]] = {
    "tbox": (80.0, 60.0, 40.0),
    "bbox": (80.0, 60.0, 30.0),
    "flag": (60.0, 40.0, 20.0),
    "hous": (70.0, 50.0, 50.0),
}
MAKE_BOXT = (
    '"VISE-OPEN RIGHT, CLOSE LEFT",,,,',
    "MOVE,BOXT (2),BUFFER,FIX-MAC1,",
    "VISE-CLOSE RIGHT,,,,",
    "RELEASE,,,,FIX-MAC2",
    '"MOVE",CLOSE-GRIP,,FIX-MAC3,',
    "VISE-OPEN RIGHT,,,,",
    "MOVE,,,FIX-MAC4,",
    "VISE-CLOSE RIGHT,,,,",
    "MOVE,,,FIX-SAFE,",
    "ENGRAVE PART,,,,",
    "ACQUIRE,BOXT (2),FIX-MAC5,,",
    '"VISE-OPEN RIGHT, OPEN LEFT",,,,',
    "TRANSFER,BOXT (2),,V-BLK1,V-BLK2",
    "TRANSFER,BOXT (3),V-BLK3,V-BLK4,V-BLK2",
)
"""The first rows of Fig. 7, as corrected."""
EMPTY_HAND = ("MOVE,,,WS-SAFE,", "MOVE,,,FIX-SAFE,", "MOVE,,,BUFFER-SAFE,", "MOVE,,,V-BLK2,", "PAUSE,,,,")
FOLLOWING: Mapping[str, tuple[tuple[str, str], ...]] = {
    "lies": (
        ("TRANSFER,{part},BUFFER,STATION({sector}),WS-SAFE", "put"),
        ("ACQUIRE,{part},BUFFER,,", "held"),
        ("TRANSFER,{part},BUFFER,STATION({sector}),", "put"),
        ("MOVE,{part},BUFFER,STATION({sector}),", "over"),
        *((row, "lies") for row in EMPTY_HAND),
    ),
    "held": (("MOVE,,,WS-SAFE,", "carried"), ("RELEASE,,,,BUFFER-SAFE", "lies")),
    "carried": (("CLEAR,,,STATION({sector}),", "put"), ("PAUSE,,,,", "carried")),
    "over": (("RELEASE,,,,WS-SAFE", "put"), ("RELEASE,,,,", "put")),
    "put": tuple((row, "put") for row in EMPTY_HAND),
}
"""What may be ordered when the part lies on the buffer, is held over it or at the safe place, is over a sector of the pallet, or was put
there; each with what becomes of it."""
MOST_ROWS = 5
NOT_LEGAL = (
    "RELEASE,,,,",
    "CLEAR,,,STATION(1),",
    "MOVE,BOXT (2),BUFFER,,",
    "ACQUIRE,BOXT (2),,,",
    "TRANSFER,,,STATION(0),",
    "TRANSFER,BOXT (2),BUFFER,,WS-SAFE",
    "MOVE,,,,",
)
"""Nothing held, no destination: TASK has to refuse them (section 8.1, lines 2 and 3). ACQUIRE takes what is where the robot is, which
is mostly nothing."""
ONLY_WITHOUT_PHYSICS = (
    "MOVE,,,FIX-MAC1,",
    "MOVE,BOXT (2),BUFFER,V-BLK3,",
    "ACQUIRE,BOXT (2),STATION(2),,",
    "MOVE,CLOSE-GRIP,,V-BLK2,",
)


def draw(seed: int, backend: Backend = "kinematic", system: Path = SYSTEM) -> Episode:
    """Return the episode of a seed.

    Raises:
        BadDescription: The system is not in order.
    """
    described = _described(system, system.stat().st_mtime_ns if system.is_file() else 0)
    return replace(drawn(by_seed(seed), backend, described), seed=seed)


def drawn(random: Random, backend: Backend, described: Description) -> Episode:
    """Return an episode of what `random` says."""
    kind = random.choice(tuple(KINDS))
    episode = Episode(backend, parts=(place(random, kind),), rows=_script(random, kind, backend))
    if not happens(random, 0.8):
        return episode
    for _ in range(random.randint(2, 4) if happens(random, 0.4) else 1):
        episode = random.choice(INJECTIONS)(random, described, episode)
    return episode


@lru_cache(maxsize=8)
def _described(system: Path, _time_ns: int) -> Description:
    return description(system)


# --- parts and scripts ---


def place(random: Random, kind: str) -> PartSpec:
    """Return a part somewhere on the buffer, where the camera sees it from its first pose."""
    edge = happens(random, 0.2)
    x_mm = random.choice((-80.0, 60.0)) if edge else random.randint(-700, 500) / 10
    y_mm = random.choice((-80.0, 80.0)) if edge else random.randint(-700, 700) / 10
    return PartSpec(kind, "buffer", x_mm, y_mm, random.randint(-850, 850) / 10)


def _script(random: Random, kind: str, backend: Backend) -> tuple[str, ...]:
    if kind == "tbox" and happens(random, 0.3):
        rows = MAKE_BOXT[: random.randint(1, len(MAKE_BOXT))]
    else:
        rows = tuple(_rows(random, f"{KINDS[kind]} (2)"))
    if happens(random, 1 / 6):
        bad = NOT_LEGAL if backend == "mujoco" else NOT_LEGAL + ONLY_WITHOUT_PHYSICS
        at = random.randint(0, len(rows))
        rows = (*rows[:at], random.choice(bad), *rows[at:])
    return rows


def _rows(random: Random, part: str) -> Iterator[str]:
    """Yield rows of which each can follow those before it."""
    now = "lies"
    for _ in range(random.randint(1, MOST_ROWS)):
        row, now = random.choice(FOLLOWING[now])
        yield row.format(part=part, sector=random.randint(0, 3)) if "{" in row else row


# --- what goes wrong ---


def when(random: Random, rows: Sequence[str]) -> int:
    """Return a tick at which something may be under way; the first ones more often than others."""
    return random.choice((0, 1, 2)) if happens(random, 0.1) else random.randint(3, 250 + 40 * len(rows))


def lasting(random: Random) -> int:
    """For how many ticks."""
    return random.choice((1, 2, 5, 20, 60, 200, 100_000))


def _switch(random: Random, _: Description, episode: Episode) -> Episode:
    name, first = random.choice(SWITCHES), when(random, episode.rows)
    value = random.choice(VALUES.get(name, (1.0,)))
    return replace(
        episode, faults=(*episode.faults, SwitchTo(name, first, first + lasting(random) - 1, value))
    )


def _harm(random: Random, its: Description, episode: Episode) -> Episode:
    first = when(random, episode.rows)
    last = first + random.choice((0, 1, 3, 10, 40, 100))
    kind = random.choice(HARMS)
    ticks = random.choice((1, 3, 8)) if kind == "late" else 3
    wire = random.choice(its.wires)
    spec = BufferFault(wire.source, kind, first, last, ticks)
    return replace(episode, transport=(*episode.transport, spec))


def _restart(random: Random, its: Description, episode: Episode) -> Episode:
    restart = Restart(when(random, episode.rows), random.choice(its.levels).name)
    return replace(episode, restarts=(*episode.restarts, restart))


def _interruption(random: Random, _: Description, episode: Episode) -> Episode:
    rows = (*EMPTY_HAND, "PAUSE,,,,", *NOT_LEGAL[:2])
    interruption = Interruption(when(random, episode.rows), random.choice(rows))
    return replace(episode, interruptions=(*episode.interruptions, interruption))


def _push(random: Random, its: Description, episode: Episode) -> Episode:
    if episode.backend != "kinematic" or not episode.parts:
        return _switch(random, its, episode)
    x_mm, y_mm = (random.choice((-40.0, -5.0, 0.0, 5.0, 40.0)) for _ in range(2))
    push = Push(when(random, episode.rows), random.randrange(len(episode.parts)), x_mm, y_mm)
    return replace(episode, pushes=(*episode.pushes, push))


def _other_parts(random: Random, _: Description, episode: Episode) -> Episode:
    first = episode.parts[0] if episode.parts else place(random, "tbox")
    return replace(episode, parts=random.choice((_none, _another, _two, _sized, _weighing))(random, first))


def _none(_: Random, __: PartSpec) -> tuple[PartSpec, ...]:
    return ()


def _another(random: Random, part: PartSpec) -> tuple[PartSpec, ...]:
    others = [kind for kind in KINDS if kind != part.object]
    return (replace(part, object=random.choice(others), size_mm=()),)


def _two(random: Random, part: PartSpec) -> tuple[PartSpec, ...]:
    """Draw parts side by side, or so close that they are nearly one patch."""
    gap_mm = random.choice((105.0, 130.0, 150.0))
    y_mm = part.y_mm - gap_mm if part.y_mm > 0 else part.y_mm + gap_mm
    return (part, replace(part, object=random.choice((part.object, *KINDS)), y_mm=round(y_mm, 1), size_mm=()))


def _sized(random: Random, part: PartSpec) -> tuple[PartSpec, ...]:
    """Draw an offset: within the tolerance, just beyond it, or far beyond."""
    more_mm = [random.choice((0.0, 1.0, -1.0, 2.5, -2.5, 10.0, -10.0)) for _ in range(3)]
    size = tuple(a + b for a, b in zip(SIZES[part.object], more_mm, strict=True))
    return (replace(part, size_mm=size),)


def _weighing(random: Random, part: PartSpec) -> tuple[PartSpec, ...]:
    density, friction = random.choice((600.0, 2700.0, 7800.0)), random.choice((0.15, 0.4, 0.9))
    return (replace(part, density_kg_m3=density, friction=friction),)


INJECTIONS: tuple[Callable[[Random, Description, Episode], Episode], ...] = (
    _switch,
    _switch,
    _switch,
    _harm,
    _harm,
    _restart,
    _interruption,
    _push,
    _other_parts,
    _other_parts,
)
"""As often as each is drawn."""

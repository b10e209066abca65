"""Hypothesis strategies for episodes: parts, scripts, and what goes wrong in them.

Small values come first, so that what fails shrinks to a nominal episode with the one thing in it that matters.
"""

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from rcsc.run.description import description
from rcsc.run.episodes.episode import BufferFault, Restart
from rcsc_cell.cell.ready import Backend
from rcsc_cell.episodes.episode import SYSTEM, Episode, Interruption, PartSpec, Push, SwitchTo
from rcsc_cell.episodes.sampling import (
    EMPTY_HAND,
    HARMS,
    KINDS,
    MAKE_BOXT,
    NOT_LEGAL,
    SIZES,
    SWITCHES,
    VALUES,
)

LEVELS = tuple(level.name for level in description(SYSTEM).levels)
BUFFERS = tuple(wire.source for wire in description(SYSTEM).wires)
TICKS = st.integers(0, 600)
LASTING = st.sampled_from((1, 2, 5, 20, 60, 200, 100_000))


@st.composite
def parts(draw: st.DrawFn, kind: str | None = None) -> PartSpec:
    """A part on the buffer, where the camera sees it; of the database's size but for some tenths of the cases."""
    name = draw(st.sampled_from(tuple(KINDS))) if kind is None else kind
    odd = draw(st.integers(0, 9)) == 9
    more = (
        draw(st.tuples(*[st.sampled_from((0.0, 1.0, -1.0, 2.5, -2.5, 10.0))] * 3)) if odd else (0.0, 0.0, 0.0)
    )
    return PartSpec(
        name,
        "buffer",
        float(draw(st.integers(-80, 60))),
        float(draw(st.integers(-80, 80))),
        float(draw(st.integers(-85, 85))),
        tuple(a + b for a, b in zip(SIZES[name], more, strict=True)) if odd else (),
        draw(st.sampled_from((2700.0, 600.0, 7800.0))),
        draw(st.sampled_from((0.4, 0.15, 0.9))),
    )


def legal(kind: str) -> SearchStrategy[tuple[str, ...]]:
    """Scripts that a cell with a part of the kind can do."""
    part = f"{KINDS[kind]} (2)"
    scripts = [
        (f"ACQUIRE,{part},BUFFER,,", "RELEASE,,,,BUFFER-SAFE"),
        (f"TRANSFER,{part},BUFFER,STATION(1),WS-SAFE",),
        (f"ACQUIRE,{part},BUFFER,,", "MOVE,,,WS-SAFE,", "CLEAR,,,STATION(3),"),
        (f"MOVE,{part},BUFFER,STATION(2),", "RELEASE,,,,"),
    ]
    if kind == "tbox":
        scripts += [MAKE_BOXT[:count] for count in (2, 4, 7, 11, len(MAKE_BOXT))]
    return st.sampled_from(scripts)


def rows() -> SearchStrategy[str]:
    """A row for TASK: of any kind, legal or not."""
    taking = tuple(f"ACQUIRE,{part} (2),BUFFER,," for part in KINDS.values())
    moving = (
        "MOVE,BOXT (2),BUFFER,FIX-MAC1,",
        "TRANSFER,BOXT (2),BUFFER,STATION(0),WS-SAFE",
        "CLEAR,,,STATION(3),",
    )
    return st.sampled_from((*EMPTY_HAND, *taking, *moving, *NOT_LEGAL))


@st.composite
def faults(draw: st.DrawFn, ticks: SearchStrategy[int] = TICKS) -> SwitchTo:
    """A switch, from a tick on for some time."""
    name, first = draw(st.sampled_from(SWITCHES)), draw(ticks)
    value = draw(st.sampled_from(VALUES.get(name, (1.0,))))
    return SwitchTo(name, first, first + draw(LASTING) - 1, value)


@st.composite
def harms(draw: st.DrawFn, ticks: SearchStrategy[int] = TICKS) -> BufferFault:
    """Something that happens to a buffer."""
    first = draw(ticks)
    last = first + draw(st.sampled_from((0, 1, 3, 10, 40)))
    return BufferFault(
        draw(st.sampled_from(BUFFERS)), draw(st.sampled_from(HARMS)), first, last, draw(st.integers(1, 8))
    )


def restarts() -> SearchStrategy[Restart]:
    """A level that loses its state."""
    return st.builds(Restart, TICKS, st.sampled_from(LEVELS))


def interruptions() -> SearchStrategy[Interruption]:
    """Another command in mid-motion."""
    return st.builds(Interruption, TICKS, rows())


def pushes() -> SearchStrategy[Push]:
    """Somebody pushes the first part."""
    far = st.sampled_from((0.0, 5.0, -5.0, 40.0, -40.0))
    return st.builds(Push, TICKS, st.just(0), far, far)


@st.composite
def episodes(draw: st.DrawFn, backend: Backend = "kinematic") -> Episode:
    """A legal script, what it needs, and up to six things that go wrong."""
    kind = draw(st.sampled_from(tuple(KINDS)))
    here = draw(st.one_of(st.tuples(parts(kind)), st.tuples(parts()), st.just(())))
    odd = draw(st.lists(st.one_of(faults(), harms(), restarts(), interruptions(), pushes()), max_size=6))
    if backend == "mujoco":
        odd = [trouble for trouble in odd if not isinstance(trouble, Push)]

    def some(what: type) -> tuple[object, ...]:
        return tuple(trouble for trouble in odd if isinstance(trouble, what))

    return Episode(
        backend,
        "c",
        draw(st.integers(0, 99)),
        here,
        draw(legal(kind)),
        some(SwitchTo),  # type: ignore[arg-type]  # each is of the type that was asked for
        some(BufferFault),  # type: ignore[arg-type]
        some(Restart),  # type: ignore[arg-type]
        some(Interruption),  # type: ignore[arg-type]
        pushes=some(Push),  # type: ignore[arg-type]
    )

"""What stands outside as it looks in space: shapes on bodies, and where the bodies are.

In: what stands outside a system. Out: the `Space` of the first that has one. A plant offers it by a method `space`; a model for MuJoCo
has it without anybody's doing. Lengths are metres, turns are quaternions (w, x, y, z), both in the frame of the room.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

ShapeKind = Literal["plane", "ball", "capsule", "ellipsoid", "cylinder", "box", "mesh"]
FIXED = -1
"""The body of what never moves."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles.

    Attributes:
        corners_m: Three numbers a corner.
        faces: Three corners a triangle, by their places.
    """

    corners_m: tuple[float, ...]
    faces: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Shape:
    """A visible rigid part.

    Attributes:
        name: As its maker calls it; may be empty.
        size_m: Half lengths of a box, of a plane (0: without end) and of an ellipsoid; radius and half length of a cylinder and a
            capsule, along z; the radius of a ball.
        colour: Red, green, blue and opacity, from 0 to 1.
        body: The place of its body among the bodies; `FIXED` for none.
        at_m: Its middle in the frame of its body; in that of the room where it is fixed.
        turn: Its axes, likewise.
    """

    name: str
    kind: ShapeKind
    size_m: tuple[float, float, float]
    colour: tuple[float, float, float, float]
    body: int
    at_m: tuple[float, float, float]
    turn: tuple[float, float, float, float]
    mesh: Mesh | None = None


class Space(Protocol):
    """Shapes, and bodies that carry them."""

    @property
    def bodies(self) -> Sequence[str]:
        """The names of the moving bodies."""
        ...

    @property
    def shapes(self) -> Sequence[Shape]:
        """All visible shapes; the same for as long as the plant lives."""
        ...

    def poses(self) -> Sequence[float]:
        """Return the poses of the bodies now, seven numbers each: x, y, z in metres, then the turn."""
        ...


def space_of(outside: Iterable[object]) -> Space | None:
    """Return the first space that a part outside offers; None where none does."""
    for part in outside:
        offered = getattr(part, "space", None)
        space: Space | None = offered() if callable(offered) else None
        if space is not None:
            return space
    return None

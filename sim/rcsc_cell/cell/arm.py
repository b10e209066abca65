"""The arm: a PUMA 560, six turning joints, its last three axes through one point. Closed form both ways.

The paper does not name its robot; this one is of its time, and its numbers are known. Link lengths: Corke and
Armstrong-Helouvry, "A search for consensus among model parameters reported for the PUMA 560 robot", ICRA 1994.
Joint limits: the maker's. The base axis is the base's z; angles are radians, lengths millimetres.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import acos, asin, atan2, cos, hypot, pi, radians, sin, sqrt

from rcsc_cell.database.pose import Pose, Rotation, Vector, apply, product

SHOULDER_MM = 671.83
UPPER_MM = 431.8
OFFSET_MM = 150.05
ELBOW_MM = 20.3
FOREARM_MM = 431.8
FLANGE_MM = 56.25
LIMITS_DEG = (
    (-160.0, 160.0),
    (-45.0, 225.0),
    (-225.0, 45.0),
    (-110.0, 170.0),
    (-100.0, 100.0),
    (-266.0, 266.0),
)
LIMITS = tuple((radians(low), radians(high)) for low, high in LIMITS_DEG)
STRAIGHT = 1e-9
"""Sine of the fifth joint below which the fourth and sixth turn about one line."""

TURN = 2 * pi
NEAR = 3.1
"""Less than half a turn: so far from where it is a joint goes as it is told, and that is nearly always."""

Joints = tuple[float, ...]
_LINKS = (
    (SHOULDER_MM, 0.0, 1.0),
    (0.0, UPPER_MM, 0.0),
    (OFFSET_MM, ELBOW_MM, -1.0),
    (FOREARM_MM, 0.0, 1.0),
    (0.0, 0.0, -1.0),
    (FLANGE_MM, 0.0, 0.0),
)
"""Along z, along x, and the sine of the twist of each link (Denavit and Hartenberg); a twist is a right angle or none."""


def plate(joints: Sequence[float]) -> Pose:
    """Return the pose of the wrist plate."""
    return _plate(tuple(joints))


@lru_cache(maxsize=16)  # a cycle asks several times, and a robot that rests asks the same again
def _plate(joints: Joints) -> Pose:
    return _frames(joints)[-1]


def skeleton(joints: Sequence[float]) -> tuple[Vector, ...]:
    """Return the stick figure: base, shoulder, shoulder's side, elbow, wrist's side, wrist, wrist plate; mm."""
    shoulder, elbow, _, wrist, _, flange = _frames(joints)
    side = shoulder.point((0.0, 0.0, OFFSET_MM))
    return (
        (0.0, 0.0, 0.0),
        shoulder.at_mm,
        side,
        elbow.point((0.0, 0.0, OFFSET_MM)),
        wrist.at_mm,
        flange.at_mm,
    )


def _frames(joints: Sequence[float]) -> list[Pose]:
    frames = []
    turned: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    x = y = z = 0.0
    for angle, (along_z, along_x, twist) in zip(joints, _LINKS, strict=True):
        c, s, ct = cos(angle), sin(angle), 0.0 if twist else 1.0
        dx, dy, dz = apply(turned, (along_x * c, along_x * s, along_z))
        x, y, z = x + dx, y + dy, z + dz
        turned = product(turned, ((c, -s * ct, s * twist), (s, c * ct, -c * twist), (0.0, twist, ct)))
        frames.append(Pose(turned, (x, y, z)))
    return frames


def _arms(wanted: Pose) -> list[tuple[float, float, float]]:
    """Return the first three joints of every way to bring the plate to a pose."""
    x, y, z = wanted.point((0.0, 0.0, -FLANGE_MM))
    z -= SHOULDER_MM
    far = hypot(x, y)
    if far <= OFFSET_MM:
        return []
    reach = sqrt(far * far - OFFSET_MM * OFFSET_MM)
    around, lean = atan2(y, x), asin(OFFSET_MM / far)
    return [
        (first, *others)
        for out, first in ((reach, around + lean), (-reach, around + pi - lean))
        for others in _elbow(out, z)
    ]


def _elbow(out_mm: float, up_mm: float) -> list[tuple[float, float]]:
    """Return the second and third joint for a wrist so far out and up from the shoulder: elbow up, elbow down."""
    forearm, bend = hypot(ELBOW_MM, FOREARM_MM), atan2(FOREARM_MM, ELBOW_MM)
    cosine = (out_mm**2 + up_mm**2 - UPPER_MM**2 - forearm**2) / (2 * UPPER_MM * forearm)
    if not -1.0 <= cosine <= 1.0:
        return []
    return [
        (
            atan2(up_mm, out_mm) - atan2(forearm * sin(between), UPPER_MM + forearm * cos(between)),
            between - bend,
        )
        for between in (acos(cosine), -acos(cosine))
    ]


def _wrist(turn: Rotation, first: float, second: float, third: float) -> list[Joints]:
    """Return all joints for each setting of the last three: the turn as the forearm sees it, read as a rotation about z, y and z."""
    c1, s1 = cos(first), sin(first)
    c23, s23 = cos(second + third), sin(second + third)
    forearm: Rotation = ((c1 * c23, s1 * c23, s23), (-s1, c1, 0.0), (-c1 * s23, -s1 * s23, c23))
    m = product(forearm, turn)
    sine = hypot(m[0][2], m[1][2])
    if sine < STRAIGHT:
        return [(first, second, third, 0.0, atan2(0.0, m[2][2]), atan2(m[1][0], m[0][0]))]
    return [
        (
            first,
            second,
            third,
            atan2(-m[1][2] * flip, -m[0][2] * flip),
            atan2(flip * sine, m[2][2]),
            atan2(-m[2][1] * flip, m[2][0] * flip),
        )
        for flip in (1.0, -1.0)
    ]


def solve(wanted: Pose, near: Sequence[float]) -> Joints | None:
    """Return the solution that turns the joints least; None where none is within the limits.

    Args:
        wanted: The plate's pose.
        near: The joints as they are.
    """
    best, least = None, float("inf")
    for arm in _arms(wanted):
        if _unwound(arm, near, least) is None:
            continue
        for solution in _wrist(wanted.turn, *arm):
            joints = _unwound(solution, near, least)
            if joints is not None:
                best, least = joints, max(abs(a - b) for a, b in zip(joints, near, strict=True))
    return best


def _unwound(joints: Joints, near: Sequence[float], least: float) -> Joints | None:
    """Return the joints by their nearest turns within the limits; None where one turns as far as `least`."""
    unwound = []
    for angle, before, (low, high) in zip(joints, near, LIMITS, strict=False):
        far = angle - before
        turned = angle if -NEAR < far < NEAR else angle - TURN * round(far / TURN)
        turned += TURN * ((turned < low) - (turned > high))
        if not low <= turned <= high or abs(turned - before) >= least:
            return None
        unwound.append(turned)
    return tuple(unwound)


def margins_deg(joints: Sequence[float]) -> tuple[float, ...]:
    """Return the distance of each joint from its nearer limit, in degrees."""
    return tuple(
        min(angle - low, high - angle) * 180.0 / pi for angle, (low, high) in zip(joints, LIMITS, strict=True)
    )

"""Units of measure, and the exact factor from one to another.

In: units as a table writes them, `mm/s`, or with negative powers, `mm*s^-1`. Out: what one of the first is in the second:
a fraction, and a power of pi (a degree is pi / 180 radians). The language multiplies and divides units and never
converts; here, where readings come in, they are converted.

Source: BIPM, *The International System of Units* (9th edition, 2019); the pound is 0.45359237 kg (1959 agreement).
"""

import math
import re
from collections import Counter
from dataclasses import dataclass
from fractions import Fraction

_FACTOR = re.compile(r"([*/]?)\s*([A-Za-z_][A-Za-z0-9_]*|1)\s*(?:\^\s*(-?[0-9]{1,2}))?\s*")


@dataclass(frozen=True, slots=True)
class Factor:
    """`fraction` times pi to the power `pi`."""

    fraction: Fraction
    pi: int = 0

    def times(self, number: float) -> Fraction | float:
        """Multiply a finite number by the factor: exactly where there is no pi in it."""
        if self.pi == 0:
            return Fraction(number) * self.fraction
        return number * float(self.fraction) * math.pi**self.pi

    @property
    def inverse(self) -> "Factor":
        """The factor of the opposite conversion."""
        return Factor(1 / self.fraction, -self.pi)

    @property
    def is_one(self) -> bool:
        """True if both units are the same."""
        return self.fraction == 1 and self.pi == 0


_KNOWN: dict[str, tuple[Factor, dict[str, int]]] = {
    "m": (Factor(Fraction(1)), {"m": 1}),
    "mm": (Factor(Fraction(1, 1000)), {"m": 1}),
    "s": (Factor(Fraction(1)), {"s": 1}),
    "ms": (Factor(Fraction(1, 1000)), {"s": 1}),
    "Hz": (Factor(Fraction(1)), {"s": -1}),
    "kg": (Factor(Fraction(1)), {"kg": 1}),
    "lb": (Factor(Fraction(45_359_237, 100_000_000)), {"kg": 1}),
    "N": (Factor(Fraction(1)), {"kg": 1, "m": 1, "s": -2}),
    "rad": (Factor(Fraction(1)), {"rad": 1}),
    "deg": (Factor(Fraction(1, 180), 1), {"rad": 1}),
    "A": (Factor(Fraction(1)), {"A": 1}),
    "V": (Factor(Fraction(1)), {"kg": 1, "m": 2, "s": -3, "A": -1}),
    "1": (Factor(Fraction(1)), {}),
}
"""The units of the language in base units; the radian is one of its own, so that an angle is no bare number."""


def factor(unit: str, into: str) -> Factor | None:
    """Return the size of one `unit` in `into`; None where they measure different things.

    A unit that only the user's tables know equals itself.

    Raises:
        ValueError: One of them is no unit.
    """
    ours, theirs = _parsed(unit), _parsed(into)
    if ours[1] != theirs[1]:
        return None
    return Factor(ours[0].fraction / theirs[0].fraction, ours[0].pi - theirs[0].pi)


def _parsed(unit: str) -> tuple[Factor, dict[str, int]]:
    """Return the size of a unit in base units, and their powers. Raises ValueError: the text is no unit."""
    fraction, pi, powers = Fraction(1), 0, Counter[str]()
    at, text = 0, unit.strip()
    while at < len(text):
        read = _FACTOR.match(text, at)
        if read is None or (at == 0) != (not read[1]):
            raise ValueError(f"`{unit}` is no unit: write it as a table does, `mm/s^2`")
        power = int(read[3] or 1) * (-1 if read[1] == "/" else 1)
        size, base = _KNOWN.get(read[2], (Factor(Fraction(1)), {read[2]: 1}))
        fraction, pi = fraction * size.fraction**power, pi + size.pi * power
        for name, times in base.items():
            powers[name] += times * power
        at = read.end()
    return Factor(fraction, pi), {name: times for name, times in powers.items() if times}

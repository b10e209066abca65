"""What a unit comes to in another: for messages alone, as nothing is ever converted.

>>> written_in("cm", {"mm", "m", "s"}, 50), written_in("km", {"mm", "m"}), written_in("furlong", {"m"})
('write it in `mm`: `50 [cm]` is `500 [mm]`', 'write it in `m`: 1 km is 1000 m', '')
>>> apart((("m", 1), ("s", -1)), (("mm", 1), ("s", -1))), apart((("mm", 1),), (("s", 1),))
('units are never converted: write one side in the other, 1 m/s is 1000 mm/s', '')
"""

from collections.abc import Collection
from fractions import Fraction

from rcsc.lang.model import Unit, unit_text

_MILLI, _KILO = Fraction(1, 1000), Fraction(1000)
_COMES_TO = {
    "m": ("m", Fraction(1)), "mm": ("m", _MILLI), "cm": ("m", Fraction(1, 100)), "dm": ("m", Fraction(1, 10)), "km": ("m", _KILO),
    "s": ("s", Fraction(1)), "ms": ("s", _MILLI), "min": ("s", Fraction(60)), "h": ("s", Fraction(3600)),
    "sec": ("s", Fraction(1)), "msec": ("s", _MILLI),
    "N": ("N", Fraction(1)), "kN": ("N", _KILO), "kg": ("kg", Fraction(1)), "t": ("kg", _KILO),
    "Hz": ("Hz", Fraction(1)), "kHz": ("Hz", _KILO), "MHz": ("Hz", _KILO**2),
    "A": ("A", Fraction(1)), "V": ("V", Fraction(1)), "kV": ("V", _KILO),
}  # fmt: skip
"""Units by name, each with what it is a multiple of, and the multiple; the language knows a part of them."""


def written_in(name: str, known: Collection[str], number: int | None = None) -> str:
    """Return how to write a unit that is not known in one that is; "" where none of these is a whole part of it."""
    base, of = _COMES_TO.get(name, ("", Fraction(0)))
    wholes = {
        each: of / _COMES_TO[each][1] for each in known if each in _COMES_TO and _COMES_TO[each][0] == base
    }
    near = min(((ratio, each) for each, ratio in wholes.items() if ratio.denominator == 1), default=None)
    if near is None:
        return ""
    ratio, unit = near
    said = (
        f"1 {name} is {ratio} {unit}"
        if number is None
        else f"`{number} [{name}]` is `{number * ratio} [{unit}]`"
    )
    return f"write it in `{unit}`: {said}"


def apart(one: Unit, two: Unit) -> str:
    """Return help where two units of one quantity meet: how many of one the other is; "" for units of two quantities."""
    (first, much), (second, more) = _scale(one), _scale(two)
    if first != second or not first or much == more:
        return ""
    (large, small), ratio = ((one, two), much / more) if much > more else ((two, one), more / much)
    if ratio.denominator != 1:
        return ""
    return f"units are never converted: write one side in the other, 1 {unit_text(large)} is {ratio} {unit_text(small)}"


def _scale(unit: Unit) -> tuple[tuple[tuple[str, int], ...], Fraction]:
    """Return the quantity of a unit, as powers, and what it comes to in the units of these."""
    powers, much = dict[str, int](), Fraction(1)
    for name, power in unit:
        base, of = _COMES_TO.get(name, (name, Fraction(1)))
        powers[base] = powers.get(base, 0) + power
        much *= of**power
    return tuple(sorted((name, power) for name, power in powers.items() if power)), much

"""Plants: what stands outside the levels and moves.

A *plant* is a class of the user's. Its annotated attributes are matched by name to the far ends of `[buffers]` in
`system.toml`; in each tick rcsc sets those that levels give, calls `step`, and takes those that levels read:

    [buffers]
    "base.travelled" = "drive.travelled_mm"     # drive.rcs: input travelled_mm : int 0 .. 20000 [mm] clamp
    "drive.speed_mm_s" = "base.speed"

>>> from typing import Annotated
>>> class Base:
...     speed: int = 0
...     travelled: Annotated[float, Range(0, 20, "m")] = 0.0
...     wheel_slips: Fault = False
...
...     def step(self, seconds: float) -> None:
...         if not self.wheel_slips:
...             self.travelled += self.speed / 1000 * seconds
>>> from rcsc.run.plant.fields import annotations, faults, field_type, shown
>>> shown(field_type(annotations(Base)["travelled"])), faults(Base)
('float', ('wheel_slips',))

Before anything moves, types, ranges, units and members are held against the variables, and every field that does not fit
is told at its buffer's line (RCS729). Metres become millimetres exactly, a float is rounded to a whole number, a
record is a class with annotated attributes, an array a `list` or `tuple`, an enumeration a `Literal`, an `Enum` or a `str`.
A method that is named as what a feed asks answers it. An attribute `over` that is true ends the run. A constructor that
takes `seed` gets it. What `picture` gives, an SVG document, is shown by page and report; what `space` gives
(`space`), by the studio. A field of type `Fault` makes the
plant misbehave, and a method whose result is a `Property` says whether all is as it must be: whoever tests the system
switches the one and asks the other.

Trusted: the file of a plant that a description names, which is imported and run; nothing of it is trusted for a proof.

Modules, in the order the data flows: `fields` (what a class declares), `units`, `values` (a field against leaves), `held` (what
a plant holds, for a run that goes on in another process), `bind`
(a class against the buffers), `space` (how it looks, for who watches),
`staged` (what stands outside, made), `load` (a plant by its name), `staging` (with its script); `models` (a model for MuJoCo, bound by
data).
"""

from typing import Protocol

from rcsc.run.plant.fields import Fault, Property, Range

__all__ = ["Fault", "Plant", "Property", "Range"]


class Plant(Protocol):
    """The interface of every plant; no plant needs to name it."""

    def step(self, seconds: float) -> None:
        """Run one tick: read the attributes that levels give, and set those that levels read.

        Args:
            seconds: Of a tick: `tick_ms` of the description.
        """
        ...

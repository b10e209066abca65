"""Everything outside the levels as one: who gives orders, what moves, and what a script sets for a while.

In: an operator, plants, the buffers of a system. Out: one thing outside. What its parts say to each other in buffers that
no level has stays between them. A row's values stand in their buffers for as long as the row is under way, in place of
what a plant says; where no plant fills the buffer they stay.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rcsc.base.host.files.names import shown
from rcsc.base.host.files.plain import read
from rcsc.run.faults import faults_of, grades_of, switch
from rcsc.run.orders.numbered import Latest
from rcsc.run.orders.operator import Operator, ScriptOperator
from rcsc.run.orders.stopped import Restorable
from rcsc.run.signature import Value, Values
from rcsc.run.system import Outside


@dataclass(frozen=True, slots=True)
class _State:
    between: Mapping[str, list[bool | int | float]]
    set: Mapping[str, list[bool | int | float]]
    plants: list[Mapping[str, Any]]


@dataclass(slots=True)
class RowFaults:
    """What switches on the plants' faults of the row under way, and off those of the row before; it steps after the operator."""

    operator: Operator
    plants: tuple[Outside, ...]
    _on: frozenset[str] = frozenset()

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:  # noqa: ARG002  # as all outside
        """Publish nothing."""
        wanted = self.operator.faults
        for fault in sorted(self._on ^ wanted):
            switch(self.plants, fault, on=fault in wanted)
        self._on = wanted
        return {}


@dataclass(slots=True)
class Together:
    """Operator and plants.

    Attributes:
        operator: None where nobody gives orders.
        others: In the order in which they step.
        first: The buffers from outside that a script may set, and what they hold at first.
        shared: Buffers that levels have, too.
        results: Where what became of each row is written, a line a row; None for nowhere.
    """

    operator: Operator | None
    others: tuple[Outside, ...]
    first: Mapping[str, Values]
    shared: frozenset[str]
    results: Path | None = None
    _between: dict[str, Values] = field(default_factory=dict)
    _set: dict[str, Values] = field(default_factory=dict)
    _written: int = 0

    @property
    def over(self) -> bool:
        """True once the script has ended and its level rests, or a plant says that the run is over."""
        ended = self.operator is not None and self.operator.over and self.operator.at_rest
        return ended or any(getattr(plant, "over", False) for plant in self.others)

    def space(self) -> Any:
        """Return the first space of a plant (`rcsc.run.plant.space`); None where no plant has one."""
        offered = (getattr(plant, "space", None) for plant in self.others)
        return next((space for ask in offered if ask is not None and (space := ask()) is not None), None)

    @property
    def pictures(self) -> Mapping[str, Callable[[], str]]:
        """The functions that draw the plants, by kind of picture."""
        return {kind: draw for plant in self.others for kind, draw in getattr(plant, "pictures", {}).items()}

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """Run one tick of all parts: each sees the buffers as the tick before left them."""

        def seen(name: str) -> Values | None:
            return latest(name) if name in self.shared else self._between.get(name)

        published = {} if self.operator is None else dict(self.operator.step(tick, seen))
        published |= {name: values for part in self.others for name, values in part.step(tick, seen).items()}
        self._between |= {name: values for name, values in published.items() if name not in self.shared}
        self._write()
        shared = {name: values for name, values in published.items() if name in self.shared}
        return self._with_row(shared)

    def state(self) -> dict[str, Any]:
        """Return the state outside but for the operator's, in plain values.

        Raises:
            NotKept: A plant has a value that no file holds.
        """
        return {
            "between": {name: list(values) for name, values in self._between.items()},
            "set": {name: list(values) for name, values in self._set.items()},
            "plants": [plant.state() for plant in self._plants()],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state.

        Raises:
            ValueError: The state is none of these plants.
        """
        held: _State = read(_State, state)
        plants = self._plants()
        if len(held.plants) != len(plants):
            raise ValueError(f"{len(held.plants)} plants were stopped, and {len(plants)} are here")
        for name, values in held.set.items():
            if len(values) != len(self.first.get(name, ())):
                raise ValueError(f"no script sets {shown(name)} so")
        for plant, its in zip(plants, held.plants, strict=True):
            plant.restore(its)
        self._between = {name: tuple(values) for name, values in held.between.items()}
        self._set = {name: tuple(values) for name, values in held.set.items()}

    def _plants(self) -> list[Restorable]:
        return [plant for plant in self.others if isinstance(plant, Restorable)]

    def _with_row(self, published: dict[str, Values]) -> dict[str, Values]:
        """Return the published values, with those that the row under way sets."""
        held = self.operator.held if isinstance(self.operator, ScriptOperator) else {}
        for name, values in held.items():
            base = published.get(name, self._set.get(name, self.first[name]))
            self._set[name] = _placed(base, values)
        still = {name: values for name, values in self._set.items() if name in held or name not in published}
        return published | still

    @property
    def faults(self) -> tuple[str, ...]:
        """The names of all faults of the plants."""
        return faults_of(self.others)

    def switch(self, fault: str, *, on: bool) -> None:
        """Switch a fault on or off."""
        switch(self.others, fault, on=on)

    @property
    def grades(self) -> Mapping[str, tuple[float, float]]:
        """The strengths of the plants' faults."""
        return grades_of(self.others)

    def grade(self, fault: str, strength: float) -> None:
        """Switch a fault on, with a strength."""
        switch(self.others, f"{fault}={strength}", on=True)

    def _write(self) -> None:
        if self.operator is None or self.results is None:
            return
        for result in self.operator.results[self._written :]:
            row = [result.row.number, result.row.text, result.state, result.reason, result.ticks]
            with self.results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            self._written += 1


def _placed(base: Values, values: Mapping[int, Value]) -> Values:
    return tuple(values.get(place, value) for place, value in enumerate(base))

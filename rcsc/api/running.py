"""`load_system` as a function: a system that is stepped, ordered and looked at from Python.

In: a description, and perhaps a plant. Out: a `LoadedSystem`. Orders go as those of a script do: each with the next number.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

from rcsc.api.proofs import PathLike
from rcsc.diagnostics.coded import CodedError
from rcsc.driver.compile import compile_system
from rcsc.run.description import description
from rcsc.run.orders.roles import COMMAND, Served, field_of, served
from rcsc.run.plant.load import Staged, load
from rcsc.run.signature import Leaf, Signature, Value, Values
from rcsc.run.system import System, assemble, signatures

Shown: TypeAlias = bool | int | float | str
"""A value of a variable: a member of an enumeration by its name."""


class NotProvedError(CodedError):
    """Tables of a system are not proved, so that there is nothing to run; says the first finding."""


@dataclass(slots=True)
class _Orders:
    """Whoever gives the orders: something outside, as any other.

    Attributes:
        standing: What stands in each buffer of orders, by its name.
    """

    standing: dict[str, Values] = field(default_factory=dict)

    def step(self, _tick: int, _latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """One tick: what stands is published."""
        return dict(self.standing)


@dataclass(slots=True)
class LoadedSystem:
    """A system, proved, compiled and ready for its first tick.

    Attributes:
        path: Of the description.
        system: The levels, the buffers and what stands outside, as `rcsc.run` has them.
        signatures: What each level's program looks like from outside, by the level's name.
    """

    path: Path
    system: System
    signatures: Mapping[str, Signature]
    _staged: Staged = field(default_factory=Staged)
    _served: tuple[Served, ...] = ()
    _orders: _Orders = field(default_factory=_Orders)

    @property
    def tick(self) -> int:
        """Ticks done so far."""
        return self.system.tick

    @property
    def seconds(self) -> float:
        """The control time that they took."""
        return self.system.tick * self.system.description.tick_ms / 1000

    @property
    def over(self) -> bool:
        """Whether the plant says that the run is at its end."""
        return self._staged.over

    @property
    def plant(self) -> Any:
        """The object of the plant's own class; None where there is none, or several."""
        plants = self._staged.plants
        return plants[0].plant if len(plants) == 1 else None

    @property
    def levels(self) -> tuple[str, ...]:
        """The levels' names, from the top down."""
        return tuple(level.name for level in self.system.levels)

    @property
    def lines(self) -> dict[str, str]:
        """The line that each level ran last, as `TABLE.LINE`; empty before its first cycle."""
        return {
            level.name: f"{level.table}.{level.line}" if level.line else "" for level in self.system.levels
        }

    def step(self, ticks: int = 1) -> None:
        """Run so many ticks.

        Raises:
            CodedError: A level met a fault that the proofs exclude, or was given what its buffers cannot hold.
        """
        for _ in range(ticks):
            self.system.step()

    def value(self, variable: str) -> Shown:
        """The value of `LEVEL.VARIABLE` as the last tick left it.

        Raises:
            KeyError: There is no such level, or no such single value in it.
        """
        level, _, name = variable.partition(".")
        running = self.system.level(level)
        leaf = running.sign.leaves[running.sign.index[name]]
        return _shown(leaf, running.value(name))

    def order(self, command: str, *, level: str | None = None, **fields: Shown) -> None:
        """Order a level from outside, with the next number: published in the next tick, as all from outside, seen in the one after.

        Args:
            command: A member of its commands.
            level: Which; the first that is ordered from outside without.
            fields: The other fields of the order; what is not given is as at first.

        Raises:
            KeyError: No such level is ordered from outside, or the order has no such field.
            ValueError: A value is none of the field's.
        """
        to = self._ordered(level)
        given = {COMMAND: command, **fields}
        names = [field_of(leaf) for leaf in to.order_leaves]
        if unknown := [name for name in given if name not in names]:
            raise KeyError(unknown[0])
        standing = self._orders.standing.get(to.order)
        number = 0 if standing is None else int(standing[to.number])
        numbers = int(to.order_leaves[to.number].high or 0) + 1
        values: list[Value] = [
            leaf.read(_text(given[name])) if name in given else leaf.initial
            for name, leaf in zip(names, to.order_leaves, strict=True)
        ]
        values[to.number] = (number + 1) % numbers
        self._orders.standing[to.order] = tuple(values)

    def report(self, level: str | None = None) -> dict[str, Shown] | None:
        """What a level reports of its last order from outside, by field; None while it has not echoed it.

        Raises:
            KeyError: No such level is ordered from outside.
        """
        of = self._ordered(level)
        order, report = self._orders.standing.get(of.order), self.system.buffers.latest(of.report)
        if order is None or report is None or report[of.echo] != order[of.number]:
            return None
        pairs = zip(of.report_leaves, report, strict=True)
        return {field_of(leaf): _shown(leaf, value) for leaf, value in pairs}

    def _ordered(self, level: str | None) -> Served:
        found = next((one for one in self._served if level in {None, one.level}), None)
        if found is None:
            raise KeyError(level or "no level is ordered from outside")
        return found


def load_system(
    path: PathLike,
    *,
    plant: str | None = None,
    executor: Literal["c", "python"] = "c",
    seed: int = 0,
    prove: bool = True,
) -> LoadedSystem:
    """A system ready to run: what changed is proved and compiled, and its plant stands beside it.

    Args:
        path: The description, `system.toml`.
        plant: `FILE.py`, `FILE.py:CLASS`, or a plant's name in the description; its first without, if it has one.
        executor: Which of the generated executors run; both do the same. `c` needs a C compiler.
        seed: For a plant whose constructor takes one.
        prove: False to run executors as they are.

    Raises:
        CodedError: The description, a table or the plant is not in order; its code and text say what, `helps` what helps.
    """
    described = description(Path(path))
    if prove:
        report = compile_system(Path(path)).report
        if report.failed:
            first = next((found.message for found in report.diagnostics), "not everything is proved")
            raise NotProvedError(f"{path} is not proved: {first}")
    signs = signatures(described)
    staged = load(described, signs, plant, seed=seed)
    orders = _Orders()
    system = assemble(described, executor, staged.queries, (orders, *staged.outside))
    return LoadedSystem(Path(path), system, signs, staged, served(described, signs), orders)


def _shown(leaf: Leaf, value: Value) -> Shown:
    return leaf.shown(value) if leaf.members else value


def _text(value: Shown) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)

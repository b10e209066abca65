"""`load_system` and `run` as functions: a system that is stepped, ordered and looked at from Python, or run by a script.

In: a description, and perhaps a plant and a script. Out: a `LoadedSystem`, or a `Run`. Orders go as those of a script do: each
with the next number.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

from rcsc.base.diagnostics.coded import CodedError
from rcsc.driver.compile import compile_system
from rcsc.front.api.proofs import PathLike
from rcsc.lang.restart import COMMAND
from rcsc.run.description import Description, description
from rcsc.run.faults import faults_of, switch
from rcsc.run.orders.numbered import Orders
from rcsc.run.orders.operator import MOST_TICKS, UNORDERED_TICKS, ScriptedRun, line_to
from rcsc.run.orders.roles import Served, field_of, served
from rcsc.run.plant.staged import Staged
from rcsc.run.plant.staging import StageOrder, staged, standing
from rcsc.run.signature import Leaf, Signature, Value, Values
from rcsc.run.system import System, assemble, signatures

Shown: TypeAlias = bool | int | float | str
"""A value of a variable: a member of an enumeration by its name."""


class NotProvedError(CodedError):
    """Tables of a system are not proved, so that there is nothing to run; says the first finding."""


@dataclass(slots=True)
class _Orders:
    """The giver of orders: a part outside, as any other.

    Attributes:
        lines: The orders to each level that was ordered, by its name.
    """

    lines: dict[str, Orders] = field(default_factory=dict)

    def step(self, _tick: int, _latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """Run one tick: publish the present orders."""
        return {line.order: line.sent for line in self.lines.values()}


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
        """The control time of the ticks done so far."""
        return self.system.tick * self.system.description.tick_ms / 1000

    @property
    def over(self) -> bool:
        """True once the plant reports the end of the run."""
        return self._staged.over

    @property
    def plant(self) -> Any:
        """The object of the plant's own class; None where there is none, or several."""
        plants = self._staged.plants
        return plants[0].plant if len(plants) == 1 else None

    @property
    def faults(self) -> tuple[str, ...]:
        """The names of the plant's faults."""
        return faults_of(self._staged.outside)

    def switch(self, fault: str, *, on: bool = True) -> None:
        """Switch a fault of the plant on or off.

        Raises:
            UnknownFault: It has none of this name.
        """
        switch(self._staged.outside, fault, on=on)

    @property
    def levels(self) -> tuple[str, ...]:
        """The levels' names, from the top down."""
        return tuple(level.name for level in self.system.levels)

    @property
    def lines(self) -> dict[str, str]:
        """The line that each level ran last, as `TABLE.LINE`, of several tables in one cycle each; empty before its first cycle."""
        return {
            level.name: " ".join(f"{table}.{line}" for table, line in level.lines if line)
            for level in self.system.levels
        }

    def step(self, ticks: int = 1) -> None:
        """Run so many ticks.

        Raises:
            CodedError: A level met a fault that the proofs exclude, or was given what its buffers cannot hold.
        """
        for _ in range(ticks):
            self.system.step()

    def value(self, variable: str) -> Shown:
        """Return the value of `LEVEL.VARIABLE` as the last tick left it.

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
        values = {name: leaf.read(_text(given[name])) for name, leaf in to.fields.items() if name in given}
        self._orders.lines.setdefault(to.level, line_to(to)).send(to.order_with(values))

    def report(self, level: str | None = None) -> dict[str, Shown] | None:
        """Return the report of a level on its last order from outside, by field; None while it has not echoed it.

        Raises:
            KeyError: No such level is ordered from outside.
        """
        of = self._ordered(level)
        line = self._orders.lines.get(of.level)
        report = None if line is None else line.answer(self.system.buffers.latest)
        if report is None:
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
    """Load a system, ready to run: prove and compile what changed, and place its plant beside it.

    Args:
        path: The description, `system.toml`.
        plant: `FILE.py`, `FILE.py:CLASS`, or a plant's name in the description; its first without, if it has one.
        executor: Which of the generated executors run; both do the same. `c` needs a C compiler.
        seed: For a plant whose constructor takes one.
        prove: False to run executors as they are.

    Raises:
        CodedError: The description, a table or the plant is not in order; its code and text say what, `helps` what helps.
    """
    described, signs, stage = _staged(Path(path), plant, "", seed, prove=prove)
    orders = _Orders()
    system = assemble(described, executor, stage.queries, (orders, *standing(stage, described, signs)))
    return LoadedSystem(Path(path), system, signs, stage, served(described, signs), orders)


@dataclass(frozen=True, slots=True)
class RowOutcome:
    """The result of a row of a script.

    Attributes:
        number: As the file counts, from 1.
        text: As it is shown.
        state: `done`, or what became of it else: `failed`, for one.
        reason: Why it was not done; empty where it was.
        ticks: How many it took.
    """

    number: int
    text: str
    state: str
    reason: str
    ticks: int


@dataclass(frozen=True, slots=True)
class Run:
    """A run that is over.

    Attributes:
        rows: Those of the script that were begun and ended, in order.
        done: Whether every row of the script was done; True without a script.
        ticks: All that were run; `seconds`, the control time that they took.
        assumptions_failed: Levels whose last cycle saw an assumption fail.
    """

    rows: tuple[RowOutcome, ...]
    done: bool
    ticks: int
    seconds: float
    assumptions_failed: tuple[str, ...]


def run(  # noqa: PLR0913  # as many as there are options
    path: PathLike,
    *,
    script: PathLike | None = None,
    plant: str | None = None,
    executor: Literal["c", "python"] = "c",
    seed: int = 0,
    cycles: int | None = None,
    log: PathLike | None = None,
    prove: bool = True,
) -> Run:
    """Run a system with its plant by a script of orders, as fast as it goes, as `rcsc run` does.

    Args:
        path: The description, `system.toml`.
        script: The orders, a CSV or TOML file; that of the description without, if it has one.
        plant: `FILE.py`, `FILE.py:CLASS`, or a plant's name in the description; its first without, if it has one.
        executor: Which of the generated executors run; both do the same. `c` needs a C compiler.
        seed: For a plant whose constructor takes one.
        cycles: Ticks at most; without a script 1000, if nobody says.
        log: Where the complete state of every cycle is kept (MCAP; the extra `log`); nowhere without.
        prove: False to run executors as they are.

    Raises:
        CodedError: Something is not in order, and nothing has moved; or a level met a fault that the proofs exclude.
    """
    name = None if script is None else os.fspath(script)
    system, signs, stage = _staged(Path(path), plant, name, seed, prove=prove)
    running = assemble(system, executor, stage.queries, standing(stage, system, signs))
    scripted = ScriptedRun(running, stage.operator)
    most = cycles or (UNORDERED_TICKS if stage.operator is None else MOST_TICKS)
    with _recorded(running, log):
        results = list(scripted.steps(most))
    rows = tuple(
        RowOutcome(result.row.number, result.row.text, result.state, result.reason, result.ticks)
        for result in results
    )
    operator = stage.operator
    done = operator is None or (operator.over and operator.stopped is None)
    failed = tuple(level.name for level in running.levels if level.values[-1])
    return Run(rows, done, running.tick, running.tick * system.tick_ms / 1000, failed)


def _staged(
    path: Path, plant: str | None, script: str | None, seed: int, *, prove: bool
) -> tuple[Description, Mapping[str, Signature], Staged]:
    """Prove and compile the system, and stage the parts outside; a script of None is the description's, an empty one none."""
    system = description(path)
    if prove:
        report = compile_system(path).report
        if report.failed:
            first = next((found.message for found in report.diagnostics), "not everything is proved")
            raise NotProvedError(f"{path} is not proved: {first}")
    named = script if script is not None else str(system.script or "")
    signs = signatures(system)
    return system, signs, staged(StageOrder(str(path), plant or "", named, seed=seed), system, signs)


@contextmanager
def _recorded(running: System, log: PathLike | None) -> Iterator[None]:
    """Record every cycle, where a log is asked for."""
    if log is None:
        yield
        return
    from rcsc.run.log.recorder import Recorder  # of an extra

    with Recorder(running, Path(log)) as recorder:
        running.watch.append(recorder)
        yield


def _shown(leaf: Leaf, value: Value) -> Shown:
    return leaf.shown(value) if leaf.members else value


def _text(value: Shown) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)

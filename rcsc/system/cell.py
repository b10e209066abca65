"""The whole system in one process: all levels and what stands outside them, one control tick at a time.

In each tick every level that is due takes the buffers as the tick before left them, all run, and all give: what a
level sees does not hang on the order of the levels, and is the same with every executor.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

from rcsc.system.adopt import Restarted, restart
from rcsc.system.buffers import Buffers, CommonMemory
from rcsc.system.description import BadDescription, Description
from rcsc.system.executors import CExecutor, Executor, PythonExecutor, build
from rcsc.system.levels import Query, RunningLevel, running_level
from rcsc.system.signature import Signature, Values, signature
from rcsc.system.unproved import refuse_unproved

Kind = Literal["c", "python"]


class Outside(Protocol):
    """What stands outside the levels: a robot, a hand, a camera, a workstation."""

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """Look at the buffers as the tick before left them; what it publishes."""
        ...


class StateTableError(Exception):
    """A level met a fault that the proofs exclude, or was refused an input; says which, where and when."""


@dataclass(slots=True)
class System:
    """Levels from the top down, what stands outside, and the buffers between.

    Attributes:
        tick: Ticks done so far.
        watch: Called after each tick.
        restarts: Levels that were started again before the present tick, in order; who watches the tick sees them.
    """

    description: Description
    levels: tuple[RunningLevel, ...]
    outside: tuple[Outside, ...]
    buffers: Buffers = field(default_factory=CommonMemory)
    tick: int = 0
    watch: list[Callable[["System", tuple[RunningLevel, ...]], None]] = field(default_factory=list)
    restarts: list[Restarted] = field(default_factory=list)

    def step(self) -> None:
        """One control tick.

        Raises:
            StateTableError: A level was refused an input, or no line or several matched.
        """
        due = tuple(
            one for one in self.levels if self.tick * self.description.tick_ms % one.level.period_ms == 0
        )
        for level in due:
            level.take(self.buffers)
        given = [one.step(self.tick, self.buffers.latest) for one in self.outside]
        faulty = [level for level in due if level.run()]
        for level in due:
            level.give(self.buffers)
        for published in given:
            for name, values in published.items():
                self.buffers.publish(name, values)
        self.tick += 1
        for watch in self.watch:
            watch(self, due)
        self.restarts.clear()
        for level in faulty:
            raise StateTableError(_said(level, self.tick))

    def restart(self, name: str, checkpoint: Values | None = None) -> None:
        """Has a level lose what it was doing, as one whose process is killed and started again, before the next tick.

        Args:
            name: The level's.
            checkpoint: What it goes on from: all leaves and the trace; None where that is lost, too.

        Raises:
            KeyError: There is none of that name.
        """
        self.restarts.append(restart(self.level(name), self.buffers, checkpoint))

    def level(self, name: str) -> RunningLevel:
        """A level by its name.

        Raises:
            KeyError: There is none.
        """
        return next((one for one in self.levels if one.name == name), None) or _missing(name)


def _missing(name: str) -> RunningLevel:
    raise KeyError(name)


def _said(level: RunningLevel, tick: int) -> str:
    return f"level `{level.name}`, table `{level.table}`, cycle {tick}: {level.sign.fault_said(level.values)}"


def signatures(system: Description) -> dict[str, Signature]:
    """The signature of each level's program, by the level's name.

    Raises:
        BadDescription: A program is not there.
    """
    found = {}
    for spec in system.levels:
        path = system.generated / "c" / f"{spec.program}.json"
        try:
            found[spec.name] = signature(path)
        except OSError as error:
            raise BadDescription(f"`{path}` cannot be read: run `rcsc compile`") from error
        except ValueError as error:
            raise BadDescription(str(error)) from error
    return found


def executors(system: Description, signs: Mapping[str, Signature], kind: Kind) -> dict[str, Executor]:
    """An executor for each level.

    Raises:
        NotBuilt: The C could not be built.
    """
    levels = {name: next(one for one in sign.levels if one.name == name) for name, sign in signs.items()}
    if kind == "python":
        return {name: PythonExecutor(system.generated, sign, levels[name]) for name, sign in signs.items()}
    library = build(system.generated, list({sign.program: sign for sign in signs.values()}.values()))
    return {name: CExecutor(library, sign, levels[name]) for name, sign in signs.items()}


def assemble(
    system: Description, kind: Kind, queries: Mapping[str, Query], outside: Iterable[Outside] = ()
) -> System:
    """The system, ready for its first tick.

    Raises:
        BadDescription: It does not fit together, or its executors are made of tables that are not proved.
        NotBuilt: The C could not be built.
    """
    refuse_unproved(system)
    signs = signatures(system)
    for name, sign in signs.items():
        if not any(one.name == name for one in sign.levels):
            raise BadDescription(f"program `{sign.program}` has no level `{name}`")
    made = executors(system, signs, kind)
    levels: Sequence[RunningLevel] = [
        running_level(spec, system, signs[spec.name], made[spec.name], queries) for spec in system.levels
    ]
    return System(system, tuple(levels), tuple(outside))

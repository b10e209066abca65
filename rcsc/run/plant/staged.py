"""What a plant is made for, and what stands outside a system once it is made."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from rcsc.run.declared_plant import PlantSpec
from rcsc.run.description import Description
from rcsc.run.levels import Query
from rcsc.run.orders.operator import Operator, ScriptedRun
from rcsc.run.orders.stopped import StoppedRuns
from rcsc.run.plant.bind import BoundPlant
from rcsc.run.signature import Signature
from rcsc.run.system import Outside


@dataclass(frozen=True, slots=True)
class Setup:
    """The values that a plant is made from.

    Attributes:
        system: The description; `signs` the signatures of its levels, by name.
        spec: The plant, as it is declared.
        seed: Of what is random in it.
        script: What is to be ordered, as the user calls it; empty where nothing is.
        database: A database to be used as it is; None for the system's own.
        answers_only: Whether only the answers to feeds are wanted: a level's process needs no plant.
    """

    system: Description
    signs: Mapping[str, Signature]
    spec: PlantSpec
    seed: int = 0
    script: str = ""
    database: Path | None = None
    answers_only: bool = False


@dataclass(frozen=True, slots=True)
class Staged:
    """The parts outside a system, ready for their first tick.

    Attributes:
        outside: In the order in which they step.
        queries: The answers to what feeds ask.
        operator: Who gives the orders of the script, where the plant reads scripts of its own.
        pictures: How it looks now: an SVG document by the kind of picture, each drawn when it is called.
        witness: Makes what watches a run in the plant's own way (`rcsc.views.pages.witness`).
        resume: Keeps a stopped run; None where the plant cannot be put back.
    """

    outside: tuple[Outside, ...] = ()
    queries: Mapping[str, Query] = field(default_factory=dict)
    operator: Operator | None = None
    pictures: Mapping[str, Callable[[], str]] = field(default_factory=dict)
    witness: Callable[[ScriptedRun], Any] | None = None
    resume: StoppedRuns | None = None

    @property
    def over(self) -> bool:
        """True once a part outside reports the end of the run."""
        return any(getattr(part, "over", False) for part in self.outside)

    @property
    def plants(self) -> tuple[BoundPlant, ...]:
        """The plants among the parts whose fields are bound."""
        return tuple(part for part in self.outside if isinstance(part, BoundPlant))


StageFunction: TypeAlias = Callable[[Setup], Staged]
"""A plant that does more than fields can say is a function."""

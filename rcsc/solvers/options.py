"""How a proof is to be made."""

from dataclasses import dataclass
from typing import Literal

from rcsc.solvers.smt import STEPS, TOGETHER, Limits


@dataclass(frozen=True, slots=True)
class Options:
    """Limits and the part that Z3 plays in deciding tables.

    Attributes:
        steps: Budget of each solver query, and, `TOGETHER` times, of all queries about a table or a procedure; past it the verdict
            is *undecided*, never *proved*.
        memory_mb: For the solver.
        solver: `auto` lets Z3 confirm every table that should cost it little, `both` every
            table, `boxes` none (procedures are still Z3's).
        jobs: Processes that prove tables.
    """

    steps: int = STEPS
    memory_mb: int = 4_096
    solver: Literal["auto", "both", "boxes"] = "auto"
    jobs: int = 1

    @property
    def limits(self) -> Limits:
        """What one question to the solver may cost."""
        return Limits.of(self.steps, self.memory_mb)

    @property
    def together(self) -> int:
        """What all questions about one table, or one procedure, may cost."""
        return TOGETHER * self.steps

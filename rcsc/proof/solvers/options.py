"""How a proof is to be made."""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

SolverChoice: TypeAlias = Literal["auto", "both", "boxes", "z3"]
"""The part that Z3 plays in deciding tables."""
STEPS = 20_000_000
"""Steps of Z3 (its `rlimit`) a question: some seconds, and the same verdict on every machine."""
TOGETHER = 20
"""All questions about a table, or about a procedure, take at most as many steps as so many of them may."""
DRAWN = 3
"""All questions about one graph take at most as many steps as so many of them may; the largest shipped one takes 16,000,000."""

WRONG_STEPS = 200_000
"""Steps of Z3 for what is said of a table beside that something is wrong with it, each kind of it for all findings together: the least
inputs and what else is wrong, whether lines do the same, whether Z3 agrees, what repairs do. Some tenths of a second of doubles."""


@dataclass(frozen=True, slots=True)
class Limits:
    """The most that one question may cost.

    Attributes:
        steps: Z3's own count of its work (`rlimit`): the budget, which does not depend on the machine.
        memory_mb: For all questions of the process.
        cpu_s: Seconds of processor time, a backstop against work that Z3 does not count; `smt.cut_short` tells of it.
    """

    steps: int = STEPS
    memory_mb: int = 4_096
    cpu_s: float = 60.0

    @classmethod
    def of(cls, steps: int, memory_mb: int = 4_096, cpu_s: float = 0.0) -> "Limits":
        """Return limits; the backstop, where none is given, leaves the steps several times what they take."""
        return cls(steps, memory_mb, cpu_s or max(60.0, 3e-6 * steps))


@dataclass(frozen=True, slots=True)
class Options:
    """Limits and the part that Z3 plays in deciding tables.

    Attributes:
        steps: Budget of each solver query, and, `TOGETHER` times, of all queries about a table or a procedure; past it the verdict
            is *undecided*, never *proved*.
        memory_mb: For the solver.
        solver: `auto` lets Z3 confirm every table within a budget, and `both` every table, or it is undecided; of `boxes` none
            (procedures are still Z3's). With `z3` nothing else decides a table.
        jobs: Processes that prove tables.
        cpu_s: The backstop of a question, in seconds; 0 for one that the steps do not need.
        brief: Whether repairs of findings, and whether overlapping lines do the same, are left for later.
        bare: Whether any witness is enough: the least input, the region around it, and further ones are not looked for, and none
            for which lines do not do the same.
    """

    steps: int = STEPS
    memory_mb: int = 4_096
    solver: SolverChoice = "auto"
    jobs: int = 1
    cpu_s: float = 0.0
    brief: bool = False
    bare: bool = False

    @property
    def limits(self) -> Limits:
        """The limits of one question to the solver."""
        return Limits.of(self.steps, self.memory_mb, self.cpu_s)

    @property
    def together(self) -> int:
        """The steps that all questions about one table, or one procedure, may take."""
        return TOGETHER * self.steps

    @property
    def drawn(self) -> int:
        """The steps that all questions about one graph may take."""
        return DRAWN * self.steps

    @property
    def few(self) -> "Options":
        """The options for questions beside a known error: one question may take as much as all of them together (`WRONG_STEPS`)."""
        return replace(self, steps=min(self.steps, WRONG_STEPS))

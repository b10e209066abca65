"""How a proof is to be made."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Options:
    """Limits and the part that Z3 plays in deciding tables.

    Attributes:
        timeout_ms: For each solver query; past it the verdict is *undecided*, never *proved*.
        memory_mb: For the solver.
        solver: `auto` lets Z3 confirm every table that should cost it less than `confirm_ms`, `both` every
            table, `boxes` none (procedures are still Z3's).
        confirm_ms: See `solver`.
        jobs: Processes that prove tables.
    """

    timeout_ms: int = 5_000
    memory_mb: int = 4_096
    solver: Literal["auto", "both", "boxes"] = "auto"
    confirm_ms: int = 1_000
    jobs: int = 1

"""What is checked, by name: the obligations of `compose.contract.obligations`, and the contract where both sides are in one model."""

from dataclasses import dataclass, field

from rcsc.compose.contract.obligations import Sort
from rcsc.compose.promela.cycle.statements import YES, Check
from rcsc.lang.model import Expr

CONTRACT_ABOVE = Sort.SAME_ORDER.value
CONTRACT_BELOW = Sort.OF_ITS_ORDER.value
CONTRACT = frozenset({CONTRACT_ABOVE, CONTRACT_BELOW})


@dataclass(frozen=True, slots=True)
class Aim:
    """One check.

    Attributes:
        what: The words of `obligations.Sort`, or one of the above.
        table: Whose it is; empty where it is the level's.
        name: Of the assumption, the buffer or the leaf.
    """

    level: str
    what: str
    table: str = ""
    name: str = ""

    @property
    def shown(self) -> str:
        """In one line."""
        where = f", table `{self.table}`" if self.table else ""
        return f"level `{self.level}`{where}: {self.what}" + (f": `{self.name}`" if self.name else "")


@dataclass(slots=True)
class Aims:
    """Every check of a model, numbered in the order in which they are met.

    Attributes:
        skipped: Those that are left out, so that what else is wrong is found.
    """

    skipped: frozenset[Aim] = frozenset()
    met: list[Aim] = field(default_factory=list)

    def check(self, aim: Aim, holds: Expr, *, apart: bool = False) -> Check:
        """The statement that checks it; `apart` as there."""
        if aim not in self.met:
            self.met.append(aim)
        return Check(self.met.index(aim), YES if aim in self.skipped else holds, apart)

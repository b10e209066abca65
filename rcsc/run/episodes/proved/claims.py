"""What was proved of a system, as values that travel to who plays episodes: claims, what each trusts, and who orders whom.

In: what `rcsc.driver.watched` makes of a proof. Out: `Claims`, with a digest. Nothing here knows how something is proved.
"""

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from rcsc.run.orders.roles import Neighbour

if TYPE_CHECKING:
    from rcsc.lang.model import Expr  # who plays other episodes knows no language

RESTARTS, ASSUMED = "RESTARTS", "ASSUMED"
"""Kinds of what a requirement across levels may trust besides what its levels do: that none begins anew; an assumption across levels."""


@dataclass(frozen=True, slots=True)
class Trusted:
    """Something that a claim takes for granted, for which no level is responsible.

    Attributes:
        kind: Which kind of trust, by its name in `rcsc.compose.contract.claims`; empty for one that is not known there.
        level: The level that it is about, or the neighbour.
        name: The assumption or the record that it is about.
        words: As `rcsc prove` prints it.
    """

    kind: str
    level: str
    name: str
    words: str


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim that `rcsc prove` calls proved.

    Attributes:
        kind: Its sort, by the sort's name: `ECHOES`, `PROPERTY`, `UNREACHED`.
        table, name: As the claim's key has them.
        words: In words, without the level.
        about: Leaves or inputs that it is about besides: those that no line changes again, or inputs that stand still.
        stands: Records of levels that stand once these have answered, of a command that ends.
        stated: What another level assumes of its outputs, in its own leaves; None of all other kinds.
    """

    level: str
    kind: str
    table: str
    name: str
    words: str
    trusts: tuple[Trusted, ...] = ()
    about: tuple[str, ...] = ()
    stands: tuple[str, ...] = ()
    stated: "Expr | None" = None


@dataclass(frozen=True, slots=True)
class WatchedNeighbour(Neighbour):
    """Somebody with whom a level exchanges orders and reports, as episodes watch it.

    Attributes:
        numbered: Leaves of an order that stay while its number does.
        late: The flag that an answer is late; empty where it is waited for without end.
        in_time: Whether a late answer counts as one.
    """

    numbered: tuple[str, ...] = ()
    late: str = ""
    in_time: bool = False


@dataclass(frozen=True, slots=True)
class ProvedLevel:
    """A level with all that was proved of it.

    Attributes:
        proof: Digest of what the proof is about: the program, the level, its links.
        filled: Inputs that other levels write.
    """

    name: str
    proof: str
    above: WatchedNeighbour | None
    below: tuple[WatchedNeighbour, ...]
    claims: tuple[Claim, ...]
    filled: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class AcrossClaim:
    """What is stated across levels and `rcsc prove` calls proved.

    Attributes:
        scheduled: Whether it is proved only of a system whose buffers come in time, or so many ticks late; else under any timing.
        words: The verdict in words.
    """

    name: str
    scheduled: bool
    words: str
    trusts: tuple[Trusted, ...] = ()


@dataclass(frozen=True, slots=True)
class Claims:
    """All that was proved of a system.

    Attributes:
        why: Why there are none, in words; empty where there are.
        across: What was proved across levels.
    """

    levels: tuple[ProvedLevel, ...] = ()
    why: str = ""
    across: tuple[AcrossClaim, ...] = ()

    @property
    def every(self) -> tuple[Claim, ...]:
        """The claims about all levels."""
        return tuple(claim for level in self.levels for claim in level.claims)

    @property
    def digest(self) -> str:
        """The same for the same claims, wherever they were proved."""
        return hashlib.sha256(repr((self.levels, self.across)).encode()).hexdigest()


Unwatched: TypeAlias = tuple[Claim, str]
"""A claim that no episode can look at, and why."""
NOTHING = Claims(why="nothing was proved")

"""The coverage of one level by its requirements: what their proofs need, and which slips nothing notices.

In: a level with its proof, and the files that it was read from. Out: a `Coverage`.

*Requirements* are what people state to be so: properties, and requirements over time. Invariants are helpers: people state them to help a
proof, or to make operations safe, and a line that only an invariant speaks of is one that no requirement speaks of. What every level owes
(one line matches, the protocol, the properties that come with it) says nothing of what this one is for, and is none either. All of these
are claims that may notice a slip: whoever makes it is told.

Only what is proved is looked at. What is listed as needed by no requirement has a proof without it for each of them, whatever it writes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rcsc.compose.contract.claims import ACCEPTED, Key
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.coverage.cores import Core, core, joined
from rcsc.compose.coverage.offers import offer, sayable
from rcsc.compose.coverage.parts import How, Use, uses_of
from rcsc.compose.coverage.questions import Questions
from rcsc.compose.coverage.slips import Environment, Fate, Judged, environments, judged
from rcsc.compose.proof.level import LevelProof
from rcsc.lang.project import Loaded

MOST_OFFERS = 6
"""Slips for which a property is sought: each takes a proof, or several."""


@dataclass(frozen=True, slots=True)
class Offered:
    """A property for a slip, by its position among the judged ones."""

    slip: int
    text: str


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the requirements of a level speak of.

    Attributes:
        requirements: How many there are; `unproved`, those of them that are not proved, and `again`, those of which Z3 does not show once
            more within its steps what was proved. Of both nothing is known.
        cores: What each of the others needs.
        unneeded: Uses that none of these needs; `assumptions`, those that are trusted, or other levels owe, and none needs.
        slips: All slips with their verdicts; none where nothing is stated.
        offers: Properties that would notice some that survive.
        across: What each requirement across levels needs of this one, by name, or None; None of all where nobody looked.
    """

    level: str
    requirements: int
    unproved: tuple[Key, ...] = ()
    again: tuple[Key, ...] = ()
    cores: tuple[Core, ...] = ()
    unneeded: tuple[Use, ...] = ()
    assumptions: tuple[str, ...] = ()
    slips: tuple[Judged, ...] = ()
    offers: tuple[Offered, ...] = ()
    across: tuple[tuple[str, tuple[Use, ...] | None], ...] | None = None

    @property
    def silent(self) -> tuple[Use, ...]:
        """The uses that no requirement speaks of, neither of the level nor, as far as that is known, across levels."""
        needed = {use for _, uses in self.across or () for use in uses or ()}
        return tuple(use for use in self.unneeded if use not in needed)

    @property
    def complete(self) -> bool:
        """Whether of each requirement it is known what it needs."""
        every = all(uses is not None for _, uses in self.across or ())
        return len(self.cores) == self.requirements and self.across is not None and every

    @property
    def surviving(self) -> tuple[Judged, ...]:
        """The slips that nothing notices."""
        return tuple(one for one in self.slips if one.fate is Fate.SURVIVES)


def stated(ts: TransitionSystem, proof: LevelProof) -> tuple[Key, ...]:
    """List the requirements of a level: what people state of it, but for invariants."""
    standard = {one.name for one in ts.program.properties if one.standard}
    return tuple(
        owed.key
        for owed, _ in proof.verdicts
        if owed.sort in {Sort.PROPERTY, Sort.REQUIREMENT} and owed.name not in standard
    )


def covered(ts: TransitionSystem, proof: LevelProof, loaded: Loaded | None = None) -> Coverage:
    """Look at what the requirements of a level speak of; without its files nothing is offered."""
    wanted = stated(ts, proof)
    if not wanted:
        return Coverage(ts.level.name, 0, unneeded=uses_of(ts.program, ts.level))
    proved = {owed.key for owed, verdict in proof.verdicts if verdict in ACCEPTED}
    unproved = tuple(key for key in wanted if key not in proved)
    places = environments(ts, proof)
    cores, again, names = list[Core](), list[Key](), dict[str, None]()
    lasts = list[Core]()
    for place in places:
        asked = Questions(place.ts, place.proof, How.FREE)
        if not place.ts.only:
            lasts += [found for key in place.keys if key[0] is Sort.KEPT and (found := core(asked, key))]
        names |= {one: None for one in asked.members if isinstance(one, str)}
        for key in (key for key in wanted if key in place.keys):
            found = core(asked, key)
            if found is None:
                again.append(key)
            else:
                cores.append(joined(found, lasts) if place.ts.only else found)
    needed = {use for one in cores for use in one.uses}
    trusted = {name for one in cores for name in one.assumptions}
    slips = tuple(judged(places)) if places else ()
    return Coverage(
        ts.level.name,
        len(wanted),
        unproved,
        tuple(again),
        tuple(cores),
        tuple(use for use in uses_of(ts.program, ts.level) if use not in needed),
        tuple(name for name in names if name not in trusted),
        slips,
        () if loaded is None else tuple(_offers([one for one in places if not one.ts.only], slips, loaded)),
    )


def _offers(places: Sequence[Environment], slips: Sequence[Judged], loaded: Loaded) -> Iterator[Offered]:
    """Yield a property for some of the slips that survive: assignments of procedures first, whole lines last."""
    surviving = [
        at for at, one in enumerate(slips) if one.fate is Fate.SURVIVES and sayable(places[0], one.slip)
    ]
    surviving.sort(key=lambda at: (slips[at].slip.whole_line, not slips[at].slip.uses[0].part.procedure))
    for at in surviving[:MOST_OFFERS]:
        found = offer(places, slips[at].slip, loaded)
        if found is not None:
            yield Offered(at, found)

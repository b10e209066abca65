"""What a campaign plays on: episodes of which kind, of which system; the lines of its tables; a digest of all that outcomes depend on.

In: a description's path, and a kind of episodes. Out: a `Rig`, from which every worker draws the same episodes.
"""

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, TypeAlias, TypeVar

from rcsc.base.host.files.read import MOST_OF_OURS, content
from rcsc.lang.project import load
from rcsc.run.description import BadDescription, Description, description, places
from rcsc.run.episodes.episode import by_seed
from rcsc.run.episodes.outcome import EpisodeOutcome
from rcsc.run.episodes.proved.claims import NOTHING, Claims
from rcsc.run.executors import NotBuilt
from rcsc.run.log.schema import fingerprints
from rcsc.run.system import Kind, signatures

if TYPE_CHECKING:
    from rcsc.run.episodes.loop import Loop
    from rcsc.run.episodes.stand import Stand

LineName: TypeAlias = tuple[str, str, str]
"""Level, table, line."""
NamedFile: TypeAlias = tuple[str, Path]
"""A file, and a name for it that is the same in every checkout."""
_ROOMS = ("run", "lang", "code/testing/executors")
"""What runs episodes, draws them and watches them: properties are evaluated by the interpreter, edges taken from tests of the tables."""


class EpisodeValue(Protocol):
    """An episode of any kind: a frozen dataclass of plain values and tuples, with fields `executor` and `seed`.

    Attributes:
        LISTS: Fields that hold any number of things, those first that a smaller episode can best do without.
        PLAINER: Fields of words of which the default is the simplest.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]
    LISTS: ClassVar[tuple[str, ...]]
    PLAINER: ClassVar[tuple[str, ...]]

    def to_json(self) -> str:
        """Return text of which the kind's `read` makes the same episode."""
        ...

    def script(self) -> str:
        """Return its orders as `rcsc run` reads them."""
        ...


E = TypeVar("E", bound=EpisodeValue)


def usual_chunk(system: Path, plant: str) -> int:  # noqa: ARG001  # a kind may look at both
    """Return how many episodes a worker is given at once."""
    return 10


def _untold(episode: EpisodeValue) -> tuple[str, ...]:  # noqa: ARG001  # of a kind without words
    return ()


@dataclass(frozen=True, slots=True)
class EpisodeKind(Generic[E]):
    """Episodes of one kind. It travels to workers, so its functions stand in modules; a system is the path of its description.

    Attributes:
        draw: Makes an episode of what `Random` says, for a rig. The simplest answers (the first choice, the lowest number, no chance
            taken) make the simplest episode: Hypothesis draws, too.
        loop: Begins an episode on a rig, with what was proved watched.
        read: Makes an episode of its text; raises ValueError in words where it is none.
        admit: Gives a saved episode, which may come from anybody, as it is to run on a system and a plant; raises ValueError where it
            names what they have not.
        fault_classes: Which fault classes an episode of a system has; empty where it is nominal.
        faults: Every fault class of a system and plant, in the order in which they are shown.
        files: What outcomes depend on beside the description and the executors.
        not_in_order: What `draw` and `loop` raise when the system is not in order, which is no episode's doing.
        chunk: Episodes a task at most, for a system and plant: about a second of work, which handing over does not slow, and
            which is all that a kill loses.
        extra: The extra of the package that it needs.
        takes_script: Whether `draw` takes a script.
        told: What happens in an episode, in words, a line each.
    """

    draw: Callable[[Random, "Rig[E]"], E]
    loop: Callable[[E, "Rig[E]"], "Loop"]
    read: Callable[[str], E]
    admit: Callable[[E, Path, str], E]
    fault_classes: Callable[[E, Path], tuple[str, ...]]
    faults: Callable[[Path, str], tuple[str, ...]]
    files: Callable[[Path, str, str], Iterable[NamedFile]]
    not_in_order: tuple[type[Exception], ...] = (BadDescription, NotBuilt)
    chunk: Callable[[Path, str], int] = usual_chunk
    extra: str = "log"
    takes_script: bool = True
    told: Callable[[E], tuple[str, ...]] = _untold


@dataclass(frozen=True, slots=True)
class Rig(Generic[E]):
    """What episodes are played on; it travels to workers.

    Attributes:
        system: The description; workers elsewhere have it at the same place.
        plant: As `--plant` names it; empty for the description's first.
        script: What is ordered; empty where nobody says.
        limit_s: Seconds of the clock after which an episode hangs; generous, so that a busy machine changes nothing.
        claims: What was proved of the system, to be watched.
        generated: Where its executors are; None for where it says itself.
    """

    kind: EpisodeKind[E]
    system: Path
    plant: str = ""
    executor: Kind = "c"
    script: str = ""
    limit_s: float = 120.0
    claims: Claims = NOTHING
    generated: Path | None = None

    def stand(self) -> "Stand":
        """Return the system with all that its declarations say."""
        from rcsc.run.episodes.stand import stand  # loads the language, as a run does

        return stand(self.system, self.generated)

    def loop(self, episode: E) -> "Loop":
        """Begin an episode, with what was proved watched."""
        return self.kind.loop(episode, self)

    def run(self, episode: E, log: Path | None) -> EpisodeOutcome:
        """Run an episode to its end."""
        return self.loop(episode).finish(log)

    def drawn(self, random: Random, seed: int) -> E:
        """Return an episode of what `random` says; whatever else is random in it hangs on the seed."""
        return replace(self.kind.draw(random, self), executor=self.executor, seed=seed)

    def episode(self, seed: int, index: int) -> E:
        """Return episode `index` of the campaign of `seed`."""
        number = episode_seed(seed, index)
        return self.drawn(by_seed(number), number)


def episode_seed(seed: int, index: int) -> int:
    """Return the seed of an episode, of 63 bits: campaigns of neighbouring seeds have no episodes in common."""
    return int.from_bytes(hashlib.sha256(f"{seed} {index}".encode()).digest()[:8]) >> 1


@cache
def known_lines(system: Path) -> tuple[LineName, ...]:
    """Return every line of every table that a level of the system may run, in the tables' order.

    Raises:
        BadDescription: The system is not in order.
    """
    described = description(system)
    lines = []
    for name, sign in signatures(described).items():
        level = next(level for level in sign.levels if level.name == name)
        lines += [(name, table, line) for table in level.every_table for line in sign.tables.get(table, ())]
    return tuple(lines)


@cache
def _places(system: Path) -> dict[LineName, int]:
    return {name: at for at, name in enumerate(known_lines(system))}


def mask(lines: Iterable[LineName], system: Path) -> int:
    """Return lines as bits, the first of `known_lines` the lowest; a cycle that ran no line, being refused, has no bit."""
    places = _places(system)
    return sum({1 << places[line] for line in lines if line in places})


@cache
def digest(rig: Rig[Any]) -> str:
    """Return the digest of the description, its executors, and the kind's files: equal digests, equal outcomes.

    By content, so that it is the same in every checkout; taken once a process.

    Raises:
        BadDescription: The system is not in order.
    """
    hashed = hashlib.sha256()
    for name, fingerprint in fingerprints(description(rig.system)).items():
        hashed.update(f"{name} {fingerprint}\n".encode())
    hashed.update(f"claims {rig.claims.digest if rig.claims.levels else ''}\n".encode())
    for name, path in (("system", rig.system), *rig.kind.files(rig.system, rig.plant, rig.script)):
        held = content(path, MOST_OF_OURS) if path.is_file() else b""
        hashed.update(f"{name} {len(held)}\n".encode() + held)
    return hashed.hexdigest()


def programs(described: Description, system: Path) -> list[Path]:
    """Return the sources of the levels, with all that they use: properties are told by them, and leave no trace in executors.

    And the file of what is required across levels.
    """
    roots = [place for level in described.levels for place in places(system, level.source) if place.is_file()]
    roots += [described.requirements] if described.requirements is not None else []
    return sorted(map(Path, load([str(root) for root in roots]).files))


def run_sources() -> list[NamedFile]:
    """Return every module that has a part in an episode of any system, in its run and in what watches it."""
    package = Path(__file__).parents[2]
    return [module for room in _ROOMS for module in sources(package / room, "log", "link", "campaign")]


def sources(folder: Path, *lookers: str) -> list[NamedFile]:
    """Return every module below a folder, but for those of rooms that only look on and change no outcome."""
    return [
        (path.relative_to(folder.parent).as_posix(), path)
        for path in sorted(folder.rglob("*.py"))
        if not any(path.is_relative_to(folder / room) for room in lookers)
    ]

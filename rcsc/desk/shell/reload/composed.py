"""Tell what is proved of a level's new tables together with its neighbours, before they are taken.

In: where the system comes from, and a level. Out: a line to show, or a refusal where they were found not to be proved. Files
are what is proved: nothing is claimed while a level runs other tables than its file holds. No search begins unasked.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.report import named
from rcsc.base.host.cache import Cache, open_cache
from rcsc.compose.proof.standing import KnownSystem, KnownVerdict
from rcsc.desk.shell.reload.reload import KeptSources, Origin, kept, source_of
from rcsc.driver.outline import known
from rcsc.run.description import BadDescription, LevelSpec


def held_by(plant: Origin, spec: LevelSpec) -> KeptSources | None:
    """What a level's file, and those that it uses, hold now; None where it is not there."""
    try:
        return kept(source_of(plant, spec))
    except Refused:
        return None


def together(
    plant: Origin,
    level: str,
    runs: Mapping[str, KeptSources | None],
    compiled: Callable[[str], bool],
    *,
    prove: bool,
) -> str:
    """What is known of the level with the tables that its file holds.

    Args:
        plant: Where the system comes from.
        level: Its name.
        runs: What each level runs, this one if it takes the new tables.
        compiled: Whether a level's executors were compiled from what it runs; its neighbours' must be, too.
        prove: Whether the levels are proved first where nothing is kept, and refused unless that succeeds.

    Raises:
        Refused: It is not proved together with its neighbours; with `prove`, also where that is not known then.
    """
    edited = [spec.name for spec in plant.system.levels if runs[spec.name] != held_by(plant, spec)]
    cache = open_cache(plant.path.parent)
    if prove and not edited and cache is not None:
        prove_levels(plant.path, cache)
    known_system = None if cache is None or edited else known(plant.path, cache)
    verdict = KnownVerdict.UNKNOWN if known_system is None else known_system.of_level(level)
    if known_system is not None and verdict is KnownVerdict.NOT_PROVED:
        raise _refused(
            plant,
            level,
            "".join(f"\nnot proved: {obligation}" for obligation in known_system.known[level].open),
        )
    if verdict is KnownVerdict.PROVED:
        others = (spec.name for spec in plant.system.levels if spec.name != level)
        edited = [name for name in others if not compiled(name)]
    if verdict is KnownVerdict.PROVED and not edited:
        return f"level `{level}` is proved together with its neighbours, as the files of {plant.path} stand"
    why = _unknown(plant, level, known_system, edited)
    if prove:
        raise _refused(plant, level, f": {why}")
    return f"level `{level}` is not known to be proved together with its neighbours: {why}"


def prove_levels(path: Path, cache: Cache) -> None:
    """Prove of a system's levels together what no earlier run did, and cache it.

    Raises:
        Refused: The description is not in order.
    """
    from rcsc.compose.proof.system import NoProgramError, prove_transition_systems, transition_systems

    try:
        systems = transition_systems(path)
    except (BadDescription, NoProgramError) as error:
        raise Refused(Code.BAD_SYSTEM, str(error)) from error
    prove_transition_systems(systems, None, 1, tuple(systems), None, cache)


def _unknown(plant: Origin, level: str, known_system: KnownSystem | None, edited: Sequence[str]) -> str:
    if edited:
        return f"level `{edited[0]}` runs other tables than its file holds"
    if known_system is not None and known_system.broken:
        assumption = known_system.broken[0]
        return f"level `{assumption.level}` assumes that {assumption.assumed}, which its neighbour is not proved to keep"
    if known_system is not None and known_system.of_level(level) is not KnownVerdict.UNKNOWN:
        return named(known_system.missing(level))
    return f"`rcsc prove {plant.path}` decides it"


def _refused(plant: Origin, level: str, why: str) -> Refused:
    return Refused(
        Code.SHELL_NOT_COMPOSED,
        f"level `{level}` keeps its tables: the new ones are not proved together with its neighbours{why}",
        f"`rcsc prove {plant.path} --level {level}` looks for the shortest run that shows it",
    )

"""What is known of a level's new tables together with its neighbours, before they are taken.

In: where the system comes from, and a level. Out: a line to show, or a refusal where they were found not to be proved. It is the files
that were proved, so that nothing is claimed while a level runs other tables than its file holds. No search is begun unless it is asked for.
"""

from collections.abc import Callable, Mapping, Sequence

from rcsc.compose.proof.standing import Known, KnownSystem
from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.report import named
from rcsc.driver.outline import known
from rcsc.host.cache import Cache, open_cache
from rcsc.run.description import BadDescription, LevelSpec
from rcsc.shell.reload.refusal import Refused
from rcsc.shell.reload.reload import Origin, source_of
from rcsc.shell.reload.sources import KeptSources, kept


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
        compiled: Whether a level's executors were made of that; asked of its neighbours before anything is called proved.
        prove: Whether the levels are proved first where nothing is kept, and refused unless that succeeds.

    Raises:
        Refused: It is not proved together with its neighbours; with `prove`, also where that is not known then.
    """
    edited = [spec.name for spec in plant.system.levels if runs[spec.name] != held_by(plant, spec)]
    cache = open_cache(plant.path.parent)
    if prove and not edited and cache is not None:
        _prove(plant, cache)
    made = None if cache is None or edited else known(plant.path, cache)
    found = Known.UNKNOWN if made is None else made.of_level(level)
    if made is not None and found is Known.NOT_PROVED:
        raise _refused(plant, level, "".join(f"\nnot proved: {one}" for one in made.known[level].open))
    if found is Known.PROVED:
        others = (spec.name for spec in plant.system.levels if spec.name != level)
        edited = [name for name in others if not compiled(name)]
    if found is Known.PROVED and not edited:
        return f"level `{level}` is proved together with its neighbours, as the files of {plant.path} stand"
    why = _unknown(plant, level, made, edited)
    if prove:
        raise _refused(plant, level, f": {why}")
    return f"level `{level}` is not known to be proved together with its neighbours: {why}"


def _prove(plant: Origin, cache: Cache) -> None:
    """Proves what no earlier run did, and keeps it."""
    from rcsc.compose.proof.system import NoProgramError, prove_transition_systems, transition_systems

    try:
        made = transition_systems(plant.path)
    except (BadDescription, NoProgramError) as error:
        raise Refused(Code.BAD_SYSTEM, str(error)) from error
    prove_transition_systems(made, None, 1, tuple(made), None, cache)


def _unknown(plant: Origin, level: str, made: KnownSystem | None, edited: Sequence[str]) -> str:
    if edited:
        return f"level `{edited[0]}` runs other tables than its file holds"
    if made is not None and made.broken:
        one = made.broken[0]
        return f"level `{one.level}` assumes that {one.assumed}, which its neighbour is not proved to keep"
    if made is not None and made.of_level(level) is not Known.UNKNOWN:
        return named(made.missing(level))
    return f"`rcsc prove {plant.path}` decides it"


def _refused(plant: Origin, level: str, why: str) -> Refused:
    return Refused(
        Code.SHELL_NOT_COMPOSED,
        f"level `{level}` keeps its tables: the new ones are not proved together with its neighbours{why}",
        f"`rcsc prove {plant.path} --level {level}` looks for the shortest run that shows it",
    )

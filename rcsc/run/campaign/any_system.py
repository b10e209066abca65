"""Episodes of any system as campaigns take them: drawn from what its description and its programs declare.

In: what `rcsc.run.campaign` asks of a kind of episodes. Out: `ANY`.
"""

import contextlib
import importlib.util
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from rcsc.base.host.files.names import shown
from rcsc.run.campaign.rig import EpisodeKind, NamedFile, programs, run_sources, usual_chunk
from rcsc.run.declared_plant import PlantSpec
from rcsc.run.description import BadDescription, description
from rcsc.run.episodes.episode import Episode
from rcsc.run.episodes.loop import check, run
from rcsc.run.episodes.sampling import draw, fault_classes, fault_names
from rcsc.run.executors import NotBuilt
from rcsc.run.orders.script import BadScript, script_path
from rcsc.run.plant.bind import BadPlant
from rcsc.run.plant.load import chosen

_MODEL_FILES = frozenset(
    {".xml", ".mjcf", ".urdf", ".stl", ".obj", ".msh", ".dae", ".skn", ".png", ".hf", ".bin"}
)
"""What a model may be made of, beside its own file and below it."""
_PHYSICS_CHUNK = 4


def _files(system: Path, plant: str, script: str) -> list[NamedFile]:
    """Sources, data, scripts, the plant, and the programs that run them.

    Raises:
        BadDescription, BadPlant: The system is not in order, or has no such plant.
    """
    described = description(system)
    scripts = [script_path(script, system.parent)] if script else []
    scripts += [described.script] if described.script else []
    spec = chosen(described, plant or None)
    own = [
        *programs(described, system),
        described.database,
        *scripts,
        *([] if spec is None else _plant(spec)),
    ]
    seen = dict.fromkeys(file.resolve() for file in own)
    named = [(Path(os.path.relpath(file, system.parent.resolve())).as_posix(), file) for file in seen]
    installed = [] if spec is None else _module(spec)
    return [*named, *installed, *run_sources()]


def _plant(spec: PlantSpec) -> Iterator[Path]:
    """Yield the files of the user's that a plant is made of: with a file in Python those beside it, which it may import."""
    file = spec.python.partition(":")[0]
    if spec.model is not None:
        yield spec.model
        yield from (path for path in _below(spec.model.parent) if path.suffix.lower() in _MODEL_FILES)
    elif file.endswith(".py"):
        yield from sorted((spec.folder / file).parent.glob("*.py"))


def _module(spec: PlantSpec) -> Iterator[NamedFile]:
    """Yield the installed module that a plant is, wherever it is installed."""
    name = spec.python.partition(":")[0]
    with contextlib.suppress(ModuleNotFoundError, ValueError):  # which is told when the plant is loaded
        found = None if not name or name.endswith(".py") else importlib.util.find_spec(name)
        if found is not None and found.origin is not None:
            yield name, Path(found.origin)


def _below(folder: Path) -> Iterator[Path]:
    """Yield every file below a folder, but for hidden ones."""
    for name, folders, files in os.walk(folder):
        folders[:] = sorted(below for below in folders if not below.startswith("."))
        yield from (Path(name, file) for file in sorted(files) if not file.startswith("."))


def _admit(episode: Episode, system: Path, plant: str) -> Episode:
    """Return a saved episode as it is to run here: a file's name in it is no leave to import that file.

    Raises:
        ValueError: It names what the system has not.
    """
    names = [spec.name for spec in description(system).plants]
    if episode.plant and episode.plant not in names:
        if not plant or plant in names:
            raise ValueError(f"the description has no plant {shown(episode.plant)}; `--plant` names one")
        episode = replace(episode, plant=plant)
    check(episode, system)
    return episode


def _chunk(system: Path, plant: str) -> int:
    spec = chosen(description(system), plant or None)
    return _PHYSICS_CHUNK if spec is not None and spec.model is not None else usual_chunk(system, plant)


ANY = EpisodeKind(
    draw, run, Episode.from_json, _admit, fault_classes, fault_names, _files,
    not_in_order=(BadDescription, BadPlant, BadScript, NotBuilt, ModuleNotFoundError), chunk=_chunk, told=Episode.told,
)  # fmt: skip

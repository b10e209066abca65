"""Kinds of episodes: those of any system, drawn from what its description and its programs declare; or a plant's own.

In: a description, and a plant as `--plant` names it. Out: the plant's name and its kind of episodes, by default `ANY`.
"""

import contextlib
import importlib.util
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

from rcsc.base.host.files.names import shown
from rcsc.run.campaign.rig import EpisodeKind, NamedFile, Rig, programs, run_sources, usual_chunk
from rcsc.run.declared_plant import PlantSpec
from rcsc.run.description import BadDescription, Description, description
from rcsc.run.episodes.episode import Episode
from rcsc.run.episodes.loop import Loop, check
from rcsc.run.episodes.sampling import drawn, fault_classes, fault_names
from rcsc.run.executors import NotBuilt
from rcsc.run.orders.script import BadScript, script_path
from rcsc.run.plant.bind import BadPlant, plant_page
from rcsc.run.plant.load import by_hand, chosen, named

_MODEL_FILES = frozenset(
    {".xml", ".mjcf", ".urdf", ".stl", ".obj", ".msh", ".dae", ".skn", ".png", ".hf", ".bin"}
)
"""What a model may be made of, beside its own file and below it."""
_PHYSICS_CHUNK = 4


def _drawn(random: Random, rig: Rig[Episode]) -> Episode:
    """Return an episode of what `random` says."""
    return drawn(random, rig.stand(), rig.plant, rig.script)


def _begun(episode: Episode, rig: Rig[Episode]) -> Loop:
    """Begin an episode."""
    return Loop(episode, rig.stand(), rig.claims)


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
    _drawn, _begun, Episode.from_json, _admit, fault_classes, fault_names, _files,
    not_in_order=(BadDescription, BadPlant, BadScript, NotBuilt, ModuleNotFoundError), chunk=_chunk, told=Episode.told,
)  # fmt: skip


def plant_of(system: Description, wanted: str | None) -> PlantSpec | None:
    """Return the plant to play with: by its name or file, else the one that is taken by hand, else the first; None without any.

    Raises:
        BadPlant: The description has none of that name.
    """
    return chosen(system, wanted if wanted is not None else by_hand(system))


def plant_name(spec: PlantSpec | None) -> str:
    """Return a plant as a worker in any folder finds it; empty where there is none, or for `[plant]` itself."""
    if spec is None or spec.path:
        return "" if spec is None else spec.name
    file, colon, of = spec.python.partition(":")
    return f"{Path(file).resolve()}{colon}{of}"


def kind_of(system: Description, spec: PlantSpec | None) -> EpisodeKind[Any]:
    """Return the kind of its episodes.

    Raises:
        BadPlant: What the description names is none.
        ModuleNotFoundError: It needs an extra that is not installed.
    """
    if spec is None or not spec.campaign:
        return ANY
    kind = named(system, spec, spec.campaign, "campaign")
    if isinstance(kind, EpisodeKind):
        return kind
    page = plant_page(system)
    page.wrong((*spec.path, "campaign"), f"`{spec.campaign}` is no `rcsc.run.campaign.rig.EpisodeKind`")
    raise page.bad(BadPlant)

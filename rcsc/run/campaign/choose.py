"""Which kind of episodes a system's plant has: its own, where its description names one, else that of any system.

In: a description, and a plant as `--plant` names it. Out: the plant's name and its kind of episodes.
"""

from pathlib import Path
from typing import Any

from rcsc.run.campaign.any_system import ANY
from rcsc.run.campaign.rig import EpisodeKind
from rcsc.run.declared_plant import PlantSpec
from rcsc.run.description import Description
from rcsc.run.plant.bind import BadPlant, plant_page
from rcsc.run.plant.load import by_hand, chosen, named


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

"""A plant by its name: the file that is imported, the class in it, and all that stands outside with it.

In: a description, signatures, and which plant is meant. Out: a `Staged`: what stands outside the levels and the answers to
what feeds ask. A file that a description names is run as the user's own program; nothing else of a description is.
"""

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

from rcsc.base.host.described import BadFile, Document, KeyPath, nearest
from rcsc.base.host.files.names import BadName, within
from rcsc.lang.project import project_root
from rcsc.run.declared_plant import PlantSpec
from rcsc.run.description import Description
from rcsc.run.levels import Query
from rcsc.run.plant.bind import BadPlant, BoundPlant, bind, plant_page, raised, told
from rcsc.run.plant.staged import Setup, Staged, StageFunction
from rcsc.run.signature import Signature, Value, Values


def by_hand(system: Description) -> str | None:
    """Return the name of the plant to operate by hand when nobody names one; None where the description has none."""
    return next((spec.name for spec in system.plants if spec.by_hand), None)


def chosen(system: Description, wanted: str | None) -> PlantSpec | None:
    """Find the plant: a file, a name of the description's, or its first; None where there is none.

    Raises:
        BadPlant: The description has none of that name.
    """
    if wanted is None:
        return system.plants[0] if system.plants else None
    file, _, _ = wanted.partition(":")
    if file.endswith(".py"):
        beside = Path(system.document.name).parent if system.document is not None else Path()
        here = Path(file).is_file() or not (beside / file).is_file()
        return PlantSpec("", wanted if here else f"{beside / wanted}", Path(), path=())
    names = [spec.name for spec in system.plants]
    if wanted in names:
        return system.plants[names.index(wanted)]
    page = plant_page(system)
    known = [name for name in names if name]
    helps = nearest(wanted, known) or (
        f"its plants are {', '.join(known)}" if known else "`--plant FILE.py` takes a class in a file",
    )
    page.wrong(("plant",), f"the description has no plant `{wanted}`", *helps)
    raise page.bad(BadPlant)


def load(
    system: Description,
    signs: Mapping[str, Signature],
    wanted: str | None = None,
    *,
    seed: int = 0,
    script: str = "",
    database: Path | None = None,
    answers_only: bool = False,
) -> Staged:
    """Load the parts outside a system.

    Args:
        system: The description.
        signs: The signatures of its levels, by name.
        wanted: `FILE.py`, `FILE.py:CLASS`, or a plant's name in the description; None for its first, if it has one.
        seed: For a plant whose constructor takes one.
        script: For a plant that reads scripts of its own; empty for none.
        database: For a plant that has one.
        answers_only: Whether nothing but the answers to feeds is wanted.

    Raises:
        BadPlant: There is no such plant, it cannot be imported, or it does not fit.
        CodedError: What else a plant that is a function finds wrong.
    """
    spec = chosen(system, wanted)
    if spec is None:
        return Staged()
    given = spec not in system.plants
    factory = _factory(system, spec, given=given) if spec.model is None else _of_a_model()
    if not inspect.isclass(factory):
        stage: StageFunction = factory
        return stage(Setup(system, signs, spec, seed, script, database, answers_only))
    bound = bind(system, signs, spec, factory, seed)
    return Staged((bound,), _queries(system, bound), pictures=bound.pictures)


def _of_a_model() -> StageFunction:
    """Return the function that makes a plant of a MuJoCo model; the core needs no simulator."""
    from rcsc.run.plant.models.model_plant import staged  # keep lazy: of an extra

    return staged


def _queries(system: Description, bound: BoundPlant) -> dict[str, Query]:
    """Return the plant's methods that answer the queries of feeds; a query without one is reported when a level needs it."""
    asked = {feed.query for spec in system.levels for feed in spec.feeds}
    return {name: _query(bound.plant, name) for name in asked if callable(getattr(bound.plant, name, None))}


def _query(plant: Any, name: str) -> Query:
    """Return a query that calls a plant's method; a bad answer is reported as the plant's failure."""

    def query(*keys: Value) -> Values:
        with told(f"the plant failed, asked for `{name}`"):
            answer = getattr(plant, name)(*keys)
            return tuple(answer) if isinstance(answer, Iterable) and not isinstance(answer, str) else answer

    return query


def _factory(system: Description, spec: PlantSpec, *, given: bool) -> Any:
    """Find the class, or the staging function, that a plant names.

    Args:
        system: The description.
        spec: The plant.
        given: Whether the user names the file, from where one stands.

    Raises:
        BadPlant: There is no such class or function.
    """
    file, _, name = spec.python.partition(":")
    if not file.endswith(".py"):
        return named(system, spec, spec.python)
    page, place = plant_page(system), (*spec.path, "python")
    path = Path(file)
    if not given:
        try:
            path = within(Path(project_root(str(spec.folder / "x"))), spec.folder, file, "path `python`")
        except BadName as error:
            page.wrong(place, str(error))
            raise page.bad(BadPlant) from error
    module = _imported(system, path, place)
    if name:
        of = getattr(module, name, None)
        if of is None:
            page.wrong(place, f"`{file}` has no class `{name}`", *nearest(name, _classes(module)))
            raise page.bad(BadPlant)
        return of
    classes = [name for name in _classes(module) if callable(getattr(getattr(module, name), "step", None))]
    if len(classes) != 1:
        what = (
            f"has several classes with `step`: {', '.join(classes)}"
            if classes
            else "has no class with `step(self, seconds)`"
        )
        page.wrong(place, f"`{file}` {what}", *([f"name one: `{file}:{classes[0]}`"] if classes else []))
        raise page.bad(BadPlant)
    return getattr(module, classes[0])


def _classes(module: ModuleType) -> list[str]:
    """Return the classes that a module itself defines."""
    return [
        name for name, of in inspect.getmembers(module, inspect.isclass) if of.__module__ == module.__name__
    ]


def _imported(system: Description, path: Path, place: KeyPath) -> ModuleType:
    """Import the module of a file, which can import modules beside it.

    Raises:
        BadPlant: The file cannot be imported.
    """
    page = plant_page(system)
    place_of_file = sha256(str(path.resolve()).encode()).hexdigest()[:16]
    name = f"rcsc_plant_{path.stem}_{place_of_file}"  # two systems may call their plants alike
    spec = importlib.util.spec_from_file_location(name, path)
    if not path.is_file() or spec is None or spec.loader is None:
        page.wrong(place, f"there is no file `{path}`")
        raise page.bad(BadPlant)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    folder = str(path.resolve().parent)
    if folder not in sys.path:
        sys.path.append(folder)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        page.wrong(place, f"`{path.name}` cannot be imported: {raised(error)}")
        raise page.bad(BadPlant) from error
    return module


def named(system: Description, spec: PlantSpec, name: str, key: str = "python") -> Any:
    """Find the object that `MODULE:NAME` names, of an installed package.

    Raises:
        BadPlant: There is no such object.
    """
    place, helps = (*spec.path, key), "write `FILE.py:CLASS`, or `MODULE:NAME`"
    return installed(plant_page(system), place, name, helps, BadPlant)


def installed(page: Document, place: KeyPath, name: str, helps: str, bad: type[BadFile]) -> Any:
    """Find the object that `MODULE:NAME` names, of an installed package.

    Raises:
        BadFile: There is no such object: `bad`, at this place of the page.
    """
    module, _, attribute = name.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except ModuleNotFoundError as error:
        if error.name is not None and not module.startswith(error.name):
            raise  # a package of an extra, which says so itself
        wrong: Exception = error
    except (AttributeError, ValueError, TypeError) as error:
        wrong = error
    page.wrong(place, f"`{name}` cannot be imported: {wrong}", helps)
    raise page.bad(bad) from wrong

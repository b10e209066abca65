"""Every room teaches: its `__init__` names its modules, and the example in it does what it shows."""

import doctest
import importlib
import re
from collections import Counter
from pathlib import Path

import pytest

from rcsc.front.commands.group import COMMANDS

REPO = Path(__file__).parents[2]
MOST_MODULES = 12
"""Of a room, beside its `__init__`."""
ROOMS = sorted(
    str(path.parent.relative_to(base)).replace("/", ".")
    for base, package in ((REPO, "rcsc"), (REPO / "sim", "rcsc_cell"))
    for path in (base / package).rglob("__init__.py")
)
TAUGHT = [*ROOMS, "tests.support.programs"]


@pytest.mark.parametrize("room", TAUGHT)
def test_a_room_teaches_what_is_in_it(room: str) -> None:
    module = importlib.import_module(room)
    assert module.__doc__ is not None
    assert module.__file__ is not None
    files = {path.stem for path in Path(module.__file__).parent.glob("*.py")} - {"__init__"}
    named = set(re.findall(r"`(?:\w+/)?(\w+)(?:\.py)?`", module.__doc__))
    named |= {
        name.rpartition(".")[2] for name in COMMANDS if room.startswith("rcsc.front.commands")
    }  # `group` tells of each
    assert not files - named, "modules that the room does not name"
    lines = len(module.__doc__.splitlines())
    assert (4 if ".compose" in room else 14) <= lines <= 62, lines
    found = doctest.testmod(module, optionflags=doctest.ELLIPSIS)
    assert found.failed == 0


def test_a_room_has_at_most_twelve_modules() -> None:
    """What one person holds in the mind; a room that grows past it becomes two, or gives up what another does."""
    modules = [path for top in ("rcsc", "sim", "tests") for path in (REPO / top).rglob("*.py")]
    many = Counter(
        path.parent for path in modules if path.name != "__init__.py" and "generated" not in path.parts
    )
    assert len(many) > 50
    assert not {str(room): count for room, count in many.items() if count > MOST_MODULES}


def test_most_rooms_show_an_example() -> None:
    shown = [room for room in ROOMS if ">>>" in (importlib.import_module(room).__doc__ or "")]
    assert len(shown) >= 20


def test_nothing_in_rcsc_names_the_cell_not_even_in_a_string() -> None:
    """The import contracts do not see `MODULE:NAME`; the map alone says that there is another package."""
    named = [
        str(path.relative_to(REPO))
        for path in (REPO / "rcsc").rglob("*")
        if path.is_file() and path.suffix != ".pyc" and b"rcsc_cell" in path.read_bytes()
    ]
    assert named == ["rcsc/README.md"]

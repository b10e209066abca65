"""Which tests are quick: `python -m tests.quick JUNIT` chooses them anew, from what a run of all took (`pytest --junitxml=JUNIT`).

`pytest -m quick` runs them: some of every room, in less than a minute of two idle cores. They are whole files, the least costly first; of
a room that has no such file, the least costly tests of one: to read a file costs as much as a hundred such tests. The list is `quick.txt`;
`conftest.py` gives each test on it its mark, and reads no other file where they alone are asked for.
"""

import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET

LIST = Path(__file__).with_name("quick.txt")
MOST_S = 16.0
"""Processor time that all may take, but for what it takes to find them."""
MOST_OF_A_ROOM_S = 0.8
"""Of tests of a room none of whose files is on the list."""


def quick(name: str, chosen: Iterable[str]) -> bool:
    """Whether a test, by its path below `tests` and its function, is on the list."""
    return not {name, name.partition("::")[0]}.isdisjoint(chosen)


@cache
def chosen() -> frozenset[str]:
    """Return the list; read once, as every file is held against it."""
    return frozenset(LIST.read_text(encoding="utf-8").split())


def choose(took_s: Mapping[str, float]) -> list[str]:
    """Choose files, and of each room without one the functions of the file that has most such.

    Args:
        took_s: What each function took, all its cases together, by `ROOM/FILE.py::FUNCTION`.
    """
    files: dict[str, float] = defaultdict(float)
    for name, each_s in took_s.items():
        files[name.partition("::")[0]] += each_s
    found, sum_s = [], 0.0
    for name, each_s in sorted(files.items(), key=lambda one: (one[1], one[0])):
        sum_s += each_s
        if sum_s > MOST_S:
            break
        found.append(name)
    rooms = {name.split("/")[0] for name in found}
    of_room: dict[str, list[str]] = defaultdict(list)
    for file in files:
        cheap = _cheap({name: each_s for name, each_s in took_s.items() if name.startswith(f"{file}::")})
        of_room[file.split("/")[0]] = max(of_room[file.split("/")[0]], cheap, key=len)
    found += [name for room, cheap in of_room.items() if room not in rooms for name in cheap]
    return sorted(found)


def _cheap(took_s: Mapping[str, float]) -> list[str]:
    """The least costly functions of a file."""
    found, left_s = [], MOST_OF_A_ROOM_S
    for name, each_s in sorted(took_s.items(), key=lambda one: (one[1], one[0])):
        left_s -= each_s
        if left_s >= 0:
            found.append(name)
    return found


def measured(junit: Path) -> dict[str, float]:
    """What each function took, of a run's record."""
    took_s: dict[str, float] = defaultdict(float)
    for case in ET.parse(junit).getroot().iter("testcase"):  # noqa: S314 - of our own run
        parts = str(case.get("classname")).split(".")
        at = next(place for place, part in enumerate(parts) if part.startswith("test_"))
        function = str(case.get("name")).partition("[")[0]
        name = "::".join(["/".join(parts[1 : at + 1]) + ".py", *parts[at + 1 :], function])
        took_s[name] += float(case.get("time", 0))
    return took_s


if __name__ == "__main__":
    LIST.write_text("".join(f"{name}\n" for name in choose(measured(Path(sys.argv[1])))), encoding="utf-8")

"""Which tests are quick: `python -m tests.quick JUNIT` chooses them anew, from what a run of all took (`pytest --junitxml=JUNIT`).

`pytest -m quick` runs them: some of every room, in less than a minute of two idle cores. They are whole files, the least costly first; of
a room that has no such file, its least costly tests. The list is `quick.txt`; `conftest.py` gives each test on it its mark.
"""

import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

LIST = Path(__file__).with_name("quick.txt")
MOST_S = 38.0
"""Processor time that all may take, but for what it takes to find them."""
MOST_OF_A_ROOM_S = 2.0
"""Of tests of a room none of whose files is on the list."""


def quick(name: str, chosen: Iterable[str]) -> bool:
    """Whether a test, by its path below `tests` and its function, is on the list."""
    return not {name, name.partition("::")[0]}.isdisjoint(chosen)


def chosen() -> frozenset[str]:
    """Return the list."""
    return frozenset(LIST.read_text(encoding="utf-8").split())


def choose(took_s: Mapping[str, float]) -> list[str]:
    """Choose files, and functions of rooms without one.

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
    left_s: dict[str, float] = defaultdict(lambda: MOST_OF_A_ROOM_S)
    for name, each_s in sorted(took_s.items(), key=lambda one: (one[1], one[0])):
        room = name.split("/")[0]
        if room not in rooms and left_s[room] >= each_s:
            left_s[room] -= each_s
            found.append(name)
    return sorted(found)


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

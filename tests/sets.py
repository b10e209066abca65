"""Which tests are quick, and which thorough: `python -m tests.sets JUNIT` chooses both anew, from what a run of all took.

`pytest -m quick` runs some of every room, in less than a minute of two idle cores. They are whole files, the least costly first; of a room
that has no such file, the least costly tests of one: to read a file costs as much as a hundred such tests. `pytest -m thorough` runs what
takes long. Of every file the ordinary run, `pytest` alone, has the least costly cases, up to `MOST_OF_A_FILE_S`, and what is `KEPT`. The
rest is thorough, and runs where its folder, file or name is asked for. `pytest -m "thorough or not thorough" --junitxml=JUNIT` runs all; of
the record of an ordinary run what is thorough stays so, and more may become it.

The lists are `quick.txt` and `thorough.txt`; `conftest.py` gives each test on them its mark, and reads no other file where quick tests
alone are asked for.
"""

import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

QUICK, THOROUGH = (Path(__file__).with_name(f"{name}.txt") for name in ("quick", "thorough"))
MOST_S = 16.0
"""Processor time that all may take, but for what it takes to find them."""
MOST_OF_A_ROOM_S = 0.8
"""Of tests of a room none of whose files is on the list."""
MOST_OF_A_FILE_S = 3.0
"""Time that the cases of a file may take in the ordinary run."""
KEPT = frozenset(
    {
        "across/test_across.py::test_prove_tells_requirements_first_with_timing_levels_and_runs",
        "across/test_eventually.py::test_prove_names_what_it_trusts_and_tells_the_loop",
        "across/test_examples.py::test_a_cut_wire_of_the_emergency_stop_is_shown",
        "across/test_needed.py::test_the_command_tells_it_of_each_level",
        "commands/test_readme.py::test_the_commands_of_a_guide_end_as_it_says[README.md]",
        "commands/test_tutorial.py::test_whoever_follows_a_page_sees_what_it_shows[firmware]",
        "commands/test_tutorial.py::test_whoever_follows_a_page_sees_what_it_shows[ros2]",
        "commands/test_tutorial.py::test_whoever_follows_a_page_sees_what_it_shows[safety]",
        "commands/test_tutorial.py::test_whoever_follows_a_page_sees_what_it_shows[tutorial]",
        "compose/test_composed_search.py::test_a_line_that_counts_when_it_matches_again_is_named[False]",
        "compose/test_endings.py::test_what_falls_ends[a sum]",
        "compose/test_hierarchies.py::test_the_proof_and_the_enumeration_agree_of_random_hierarchies",
        "compose/test_protocol.py::test_every_obligation_of_a_docking_robot_is_stated_and_proved",
        "editor/test_across.py::test_renaming_goes_from_a_level_to_the_requirements_and_back",
        "exact/test_eventual.py::test_what_eventually_comes_is_proved_and_what_never_does_is_shown",
        "over_time/test_assumed.py::test_nothing_false_is_proved_where_inputs_are_refused",
        "over_time/test_manual.py::test_each_example_is_proved_refuted_or_vacuous_as_it_says[requirements]",
        "table/test_obligations.py::test_processes_give_the_same_verdicts",
    }
)
"""What every run has, whatever it takes: what a user does first, the judges of the proofs, the manual of requirements, a robot's proof as a
whole, and what alone notices a fault in some part of the prover (`prover_mutants`)."""


def quick(name: str, chosen: Iterable[str]) -> bool:
    """Whether a test, by its path below `tests` and its function, is on the list."""
    return not {name, name.partition("::")[0]}.isdisjoint(chosen)


@cache
def chosen(of: Path = QUICK) -> frozenset[str]:
    """Return a list; read once, as every test is held against it."""
    return frozenset(of.read_text(encoding="utf-8").splitlines())


def whole(config: pytest.Config) -> bool:
    """Whether nothing is asked for by its folder, name, mark or a word of it: then what is thorough is not meant."""
    asked = [Path(config.invocation_params.dir, one).resolve() for one in config.args]
    return asked == [QUICK.parent] and not config.getoption("markexpr") and not config.getoption("keyword")


def choose_thorough(took_s: Mapping[str, float]) -> list[str]:
    """Choose cases: of each file all but the least costly.

    Args:
        took_s: What each case took, by `ROOM/FILE.py::FUNCTION[CASE]`.
    """
    found: list[str] = []
    left_s: dict[str, float] = defaultdict(lambda: MOST_OF_A_FILE_S)
    for name, each_s in sorted(took_s.items(), key=lambda one: (one[1], one[0])):
        file = name.partition("::")[0]
        left_s[file] -= each_s
        if left_s[file] < 0 and name not in KEPT:
            found.append(name)
    return sorted(found)


def choose(took_s: Mapping[str, float]) -> list[str]:
    """Choose quick files, and of each room without one the functions of the file that has most such.

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
    """What each case took, of a run's record: by `ROOM/FILE.py::FUNCTION[CASE]`."""
    took_s: dict[str, float] = defaultdict(float)
    for case in ET.parse(junit).getroot().iter("testcase"):  # noqa: S314 - of our own run
        parts = str(case.get("classname")).split(".")
        at = next(place for place, part in enumerate(parts) if part.startswith("test_"))
        name = "::".join(["/".join(parts[1 : at + 1]) + ".py", *parts[at + 1 :], str(case.get("name"))])
        took_s[name] += float(case.get("time", 0))
    return took_s


def by_function(took_s: Mapping[str, float]) -> dict[str, float]:
    """What each function took, all its cases together."""
    found: dict[str, float] = defaultdict(float)
    for name, each_s in took_s.items():
        found[name.partition("[")[0]] += each_s
    return found


def main(junit: Path) -> None:
    of_cases = measured(junit)
    left_out = {name for name in chosen(THOROUGH) if name not in of_cases}
    lists = {THOROUGH: sorted({*choose_thorough(of_cases), *left_out})}
    if not left_out:
        lists[QUICK] = choose(by_function(of_cases))
    for path, names in lists.items():
        path.write_text("".join(f"{name}\n" for name in names), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

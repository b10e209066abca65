"""The C of a system does what the Python system does: every leaf of every level, every buffer, in every tick."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.driver.compile import compile_system
from rcsc.run.description import description
from rcsc.run.levels import RunningLevel
from rcsc.run.link.drawn_script import Tick, drawing, script
from rcsc.run.log.schema import outside_wires
from rcsc.run.system import System, signatures
from rcsc_cell.cell.ready import plant
from tests.link.drawn_systems import drawn_system
from tests.link.played import CSystem, Seen, by_python, first_difference, seen_of
from tests.support.cells import SYSTEM, database, prepare


@pytest.mark.parametrize("data", ["dock", "protocol"])
def test_docking_robots(data: str, repo: Path, tmp_path: Path) -> None:
    """One with the protocol written by hand, one that declares whom it serves and commands."""
    shutil.copytree(repo / "tests/data" / data, tmp_path / data, ignore=shutil.ignore_patterns("generated"))
    path = tmp_path / data / "system.toml"
    assert not compile_system(path).report.failed
    system = description(path)
    signs = signatures(system)
    ticks = script(system, signs, drawing(1), 600)
    expected, made = by_python(system, ticks), CSystem(system, signs, tmp_path).play(ticks)
    assert first_difference(expected, made) == ""
    assert {faulty for faulty, *_ in expected} == {"", "supervisor"}  # the drive's readings are clamped


def test_the_shipped_system(tmp_path: Path) -> None:
    system, data = description(SYSTEM), database()
    signs = signatures(system)
    built = CSystem(system, signs, tmp_path, data.queries)
    ticks = script(system, signs, drawing(2), 150)
    expected, made = by_python(system, ticks, data.queries), built.play(ticks)
    assert first_difference(expected, made) == ""


@pytest.mark.parametrize("seed", range(5))
def test_drawn_systems(seed: int, tmp_path: Path) -> None:
    random = drawing(seed)
    path = drawn_system(tmp_path, random)
    conclusion = compile_system(path)
    assert not conclusion.report.failed, conclusion.report.diagnostics
    system = description(path)
    signs = signatures(system)
    ticks = script(system, signs, random, 200)
    expected, made = by_python(system, ticks), CSystem(system, signs, tmp_path).play(ticks)
    assert first_difference(expected, made) == ""


KEPT = re.compile(r"number = \(uint64_t\)now|return|break|const|u?int\w* |\w+_t \w+( =|;)")
SWAPS = (
    ("== UINT64_C(0)", "!= UINT64_C(0)"), ("!= UINT64_C(0)", "== UINT64_C(0)"), ("UINT64_C(1)", "UINT64_C(2)"),
    ("(at < 0)", "(at < 1)"), ("% UINT64_C(2)", "% UINT64_C(3)"), ("% UINT64_C(3)", "% UINT64_C(2)"),
    ("% UINT64_C(4)", "% UINT64_C(2)"), ("== DRAWN_LEVEL_NONE", "!= DRAWN_LEVEL_NONE"),
    ("65536", "65535"), ("_echo;", "_echo + 1u;"),
)  # fmt: skip


def mutants(text: str) -> Iterator[tuple[str, str]]:
    """What is changed, and the text: each statement left out, each comparison and constant another one."""
    lines = text.splitlines(keepends=True)
    for at, line in enumerate(lines):
        before, after, word = "".join(lines[:at]), "".join(lines[at + 1 :]), line.strip()
        if line.startswith("    ") and word.endswith(";") and not KEPT.match(word):
            yield f"{at + 1}: without {word}", before + after
        for old, new in SWAPS:
            if old in line:
                yield f"{at + 1}: {word} with {new}", before + line.replace(old, new) + after


SAME = r"without now\.to_low\.input_command = \w+;?"  # it is 0 in the initial state
UNTRIED = {
    9: rf"{SAME}|without at = 0;|without at = \w+_check|at < 1",  # a start anew counts no such number on
    65535: rf"{SAME}|without at = \w+_check|at < 1",
}
"""By the greatest number of an order: what changes nothing, or nothing that this system can show."""


@pytest.mark.parametrize("most", [9, 65535])
def test_mutants_are_caught(most: int, tmp_path: Path) -> None:
    random = drawing(1)
    path = drawn_system(tmp_path, random, most=most)
    assert not compile_system(path).report.failed
    system = description(path)
    signs = signatures(system)
    ticks = script(system, signs, random, 600, wild=0.3)
    expected, built = by_python(system, ticks), CSystem(system, signs, tmp_path)
    assert built.play(ticks) == expected
    chosen = re.compile(r"^(?!.*(middle|_low_|low_|s->low))" if most == 9 else "number")
    every = [(what, mutant) for what, mutant in mutants(built.text) if chosen.search(what)]
    assert len(every) > (50 if most == 9 else 10)
    played = built.play_mutants(ticks, [mutant for _, mutant in every], expected)
    survivors = [what for (what, _), seen in zip(every, played, strict=True) if seen == expected]
    assert [what for what in survivors if not re.search(UNTRIED[most], what)] == []


def test_make_boxt(tmp_path: Path) -> None:
    """The whole script of the paper's cell: the C is given what stood outside the levels gave, and does what they did."""
    run = prepare(SYSTEM, "make_boxt", "c", lambda data: (plant(data, "kinematic"),))
    ticks: list[Tick] = []
    expected: list[Seen] = []

    def watch(system: System, _: tuple[RunningLevel, ...]) -> None:
        outside = {
            wire.source: system.buffers.latest(wire.source) for wire in outside_wires(system.description)
        }
        ticks.append(Tick((), {name: values for name, values in outside.items() if values is not None}))
        expected.append(seen_of(system, "", ()))

    run.system.watch.append(watch)
    assert {result.state for result in run.steps()} == {"done"}
    system = run.system.description
    made = CSystem(system, signatures(system), tmp_path, run.database.queries).play(ticks)
    assert len(ticks) > 2000
    assert first_difference(expected, made[1:]) == ""

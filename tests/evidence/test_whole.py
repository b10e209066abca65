"""The C that links a system: what is made evidence of, what is planted in it, and what is not looked at and says so."""

import csv
import io
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import rcsc.front.commands.tables.evidence  # noqa: F401  # it reads the kinds there are, before a test has others
from rcsc.driver.compile import Generated, tables_in
from rcsc.driver.pipeline import proved
from rcsc.driver.settings import Settings
from rcsc.front.commands import run
from rcsc.proof.solvers.options import Options
from rcsc.views.evidence import analysers, runtime
from rcsc.views.evidence import collect as collecting
from rcsc.views.evidence import whole as kinds
from rcsc.views.evidence.kind import Evidence, Kind
from rcsc.views.evidence.whole import Whole
from rcsc.views.pages.frame import quoted

REPO = Path(__file__).parents[2]
DOCK, PAPER = REPO / "tests/data/dock/system.toml", REPO / "tables/system.toml"


@cache
def whole_of(path: Path) -> Whole:
    project = proved(Settings(tables_in((), (path,)), Options()))
    generated = Generated(("c",), defensive=False)
    for root, program in project.executable:
        generated.add_program(root, program)
    generated.add_system(path)
    return Whole(generated.systems[path], generated.files)


def edited(path: Path, written: str, planted: str) -> Whole:
    """A system whose own C has a fault."""
    whole = whole_of(path)
    name = f"c/{whole.source}"
    assert written in whole.files[name]
    return replace(whole, files={**whole.files, name: whole.files[name].replace(written, planted, 1)})


@pytest.mark.needs("clang-19", "llvm-cov-19")
@pytest.mark.parametrize("path", [DOCK, PAPER])
def test_drawn_sessions_reach_all_of_a_system_but_what_is_explained(path: Path) -> None:
    evidence = kinds.collect(whole_of(path), "coverage")
    assert evidence.shortfalls == ()
    missed = list(csv.DictReader(io.StringIO(evidence.files["missed.csv"])))
    assert missed
    assert {row["what"] for row in missed} == {"`at < 0` false"}
    assert all("_restart_" in row["function"] and row["reason"] for row in missed)


@pytest.mark.needs("clang-19", "llvm-cov-19", "clang-tidy-19")
@pytest.mark.parametrize(
    ("kind", "planted", "told"),
    [
        ("coverage", "if (s->tick > UINT64_C(99999999)) { s->tick = UINT64_C(0); }", ["not covered: `s->tick > "]),
        ("coverage", "if (s->tick == UINT64_C(9)) { *(volatile int *)s->tick = 0; }", ["ended with status -11"]),
        (
            "analysers",
            "static float few[4]; few[s->tick % 5u] = 1.0f; if (few[0] < 0.5) { s->tick = 0; }",
            ["sanitizers of gcc: index 4 out of bounds", "-Wdouble-promotion"],
        ),
        ("misra", "again: if (s->tick == UINT64_C(7)) { goto again; }", ["violates 15.2"]),
    ],
)  # fmt: skip
def test_what_is_planted_in_the_c_of_a_system_is_told_and_nothing_else(
    kind: str, planted: str, told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(analysers, "CALLS", 4000)
    line = "    s->tick = s->tick + UINT64_C(1);"
    whole = edited(DOCK, line, f"    {planted}\n{line}")
    found = kinds.collect(whole, kind).shortfalls
    assert all(any(word in short.what for short in found) for word in told)
    place = f"dock.c:{whole.files['c/dock.c'].splitlines().index(f'    {planted}') + 1}"
    ends = ("stopped: ", "ended with status")  # of a run, at no place
    assert all(short.where == place or any(end in short.what for end in ends) for short in found)


def test_what_is_not_looked_at_is_named_in_the_index(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    runtime.version.cache_clear()
    run(["evidence", "--only", "runtime", "--out", str(tmp_path / "out"), str(DOCK)])
    runtime.version.cache_clear()
    capsys.readouterr()
    index = (tmp_path / "out" / "index.html").read_text("utf-8")
    assert '<h2 id="dock">dock</h2>' in index
    told = f"dock.c is not looked at: {kinds.PASSES['runtime']}"
    assert f"<li>{quoted(told)}</li>" in index


def test_of_programs_of_one_name_none_is_lost_in_silence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [tmp_path / folder / "door.rcs" for folder in ("first", "second", "third")]
    for file in files:
        file.parent.mkdir()
        file.write_text(
            "input a : bool\ntable t {\n  | line | a ||\n  |------|---||\n  | 1    |   ||\n}\n", "utf-8"
        )
    monkeypatch.setattr(collecting, "KINDS", {"misra": Kind("", lambda _: Evidence(("looked at",)))})
    assert run(["evidence", "--only", "misra", "--out", str(tmp_path / "out"), *map(str, files)]) == 1
    said = capsys.readouterr()
    assert said.out.count("looked at") == 1
    for file in files[1:]:
        assert f"no evidence of `{file}`" in " ".join((said.out + said.err).split())

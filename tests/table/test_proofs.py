"""What the cache keeps of proofs: never more than was proved, and as much as is the same."""

from pathlib import Path

import pytest

from rcsc.base.host.cache import Cache
from rcsc.driver.proofs import prove
from rcsc.driver.settings import Proof
from rcsc.lang.model import Program
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.proof.solvers.options import Options
from rcsc.proof.table import program as proving
from tests.support.programs.stages import codes, errors, verdict_of
from tests.support.programs.texts import edited, table

HEAD = """\
input n : int 0 .. 9
state s : int 0 .. 9
output go : bool
procedure bump { s := s + 1 }
procedure rest { s := 0 }
"""
TABLES = """\
table one {
  | line | n       | s   || procedures | go    |
  | a    | < 5     | < 9 || bump       | true  |
  | rest | DEFAULT |     ||            | false |
}
table two {
  | line | n    || procedures | go    |
  | low  | < 5  || rest       | true  |
  | high | >= 5 ||            | false |
}
"""


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    return Cache(tmp_path / "cache", b"secret", "tool")


@pytest.fixture
def proved(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the tables that the prover is asked about, in order."""
    asked: list[str] = []
    real = proving.prove_table  # type: ignore[attr-defined]  # watched where it is used

    def watched(program: Program, table: object, options: Options) -> object:
        asked.append(table.name)  # type: ignore[attr-defined]
        return real(program, table, options)  # type: ignore[arg-type]

    monkeypatch.setattr(proving, "prove_table", watched)
    return asked


def run(text: str, cache: Cache | None) -> Proof:
    loaded = load(["-"], stdin=text, stdin_name="case.rcs")
    program = resolve(loaded.roots[0], loaded)
    assert isinstance(program, Program), program
    return prove("case.rcs", program, loaded, Options(), cache)


def seen(proof: Proof) -> list[tuple[object, ...]]:
    tables = [(table.table, table.verdict, table.method, table.assumptions) for table in proof.tables]
    return [*tables, *((finding,) for finding in proof.diagnostics)]


def test_only_the_table_that_changed_is_proved_again(cache: Cache, proved: list[str]) -> None:
    run(HEAD + TABLES, cache)
    assert proved == ["one", "two"]
    run(HEAD + TABLES, cache)
    assert proved == ["one", "two"]
    run(HEAD + edited(TABLES, ("< 5  ||", "< 6  ||"), (">= 5", ">= 6")), cache)
    assert proved == ["one", "two", "two"]


@pytest.mark.parametrize(
    "change", [("s + 1", "s + 1 + 0"), ("0 .. 9\nstate", "0 .. 8\nstate"), ("{ s := 0 }", "{ s := 1 }")]
)
def test_what_all_tables_share_is_part_of_each(
    cache: Cache, proved: list[str], change: tuple[str, str]
) -> None:
    run(HEAD + TABLES, cache)
    run(edited(HEAD + TABLES, change), cache)
    assert proved == ["one", "two", "one", "two"]


def test_notes_move_with_their_table(cache: Cache, proved: list[str]) -> None:
    run(HEAD + TABLES, cache)
    moved = "# a comment more\n\n" + HEAD + "\n\n" + TABLES
    again = run(moved, cache)
    assert proved == ["one", "two"]
    fresh = run(moved, None)
    assert seen(again) == seen(fresh)
    assert any(finding.code.value == "RCS407" for finding in again.diagnostics)


def test_nothing_is_kept_of_a_program_with_errors(cache: Cache, proved: list[str]) -> None:
    broken = HEAD + edited(TABLES, ("| >= 5 ||", "| >= 6 ||"))
    first = run(broken, cache)
    assert set(codes(first.diagnostics)) == {"RCS401", "RCS407"}
    assert seen(run(broken, cache)) == seen(first)
    assert proved == ["one", "two", "two"] * 2  # the last is the trial of what would mend `two`


def test_a_procedure_that_lines_guard_is_proved_by_itself_once_no_line_calls_it(cache: Cache) -> None:
    calling, silent = HEAD + TABLES, HEAD + edited(TABLES, ("|| bump       |", "||            |"))
    assert run(calling, cache).proved is None
    assert errors(run(calling, cache).diagnostics) == []
    assert errors(run(silent, cache).diagnostics) == ["RCS413"]


def test_a_procedure_run_by_a_level_is_not_excused_by_the_lines_that_guard_it() -> None:
    text = HEAD + TABLES + "level l { period 40 [ms] preprocess bump table one }\n"
    found = verdict_of(text, Options()).findings
    assert errors(found) == ["RCS413"]


def guarded(name: str, procedure: str) -> str:
    """A table that calls the procedure only where `s` can still grow."""
    return table(name, "line | s || procedures", f"a | < 9 || {procedure}", "b | >= 9 || ")


def test_tables_kept_from_different_versions_do_not_excuse_a_procedure_together(cache: Cache) -> None:
    for first, second in (("bump", "rest"), ("rest", "bump")):
        assert errors(run(HEAD + guarded("one", first) + guarded("two", second), cache).diagnostics) == []
    nobody = HEAD + guarded("one", "rest") + guarded("two", "rest")
    assert errors(run(nobody, cache).diagnostics) == ["RCS413"]


def test_a_constant_that_an_action_uses_is_part_of_its_table(cache: Cache) -> None:
    text = "const step = 1\n" + HEAD + edited(TABLES, ("|| bump       |", "|| s := s + step |"))
    assert errors(run(edited(text, ("procedure bump { s := s + 1 }", "")), cache).diagnostics) == []
    wider = edited(text, ("procedure bump { s := s + 1 }", ""), ("step = 1", "step = 5"))
    assert errors(run(wider, cache).diagnostics) == ["RCS413"]

"""A cell that reads what an earlier cell of its line wrote is told, with two spellings that mean what they say."""

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.lang.interpret import initial, run_table
from tests.support.programs.stages import program_of, refused

HEAD = """
enum order { rest, reach }
enum status { done, executing, failed }
link below {
  command : order rest rest
  status : status done done failed failed executing executing
  order { far : int 0 .. 9 }
}
commands arm : below
record pair { a : int 0 .. 9  b : int 0 .. 9 }
input i : int 0 .. 2
state n : int 0 .. 9
state m : int 0 .. 9
state p : pair
state q : pair
state xs : array[3] of int 0 .. 9
state x : int 0 .. 9 deferred until true
output o : int 0 .. 9
procedure put(v : int 0 .. 9) { m := v }
procedure bump { n := min(n + 1, 9) }
procedure deeper { bump }
procedure copy { m := n }
"""


def table(headings: str, cells: str) -> str:
    """A program with one line."""
    dashes = "|".join("-" for _ in headings.split("|"))
    return (
        f"{HEAD}table t {{\n| line | when || {headings} |\n|-|-||{dashes}|\n| only | true || {cells} |\n}}\n"
    )


TOLD = {
    "a value": ("n | m", "i | n", "n"),
    "part of a value": ("n | m", "i | max(n, 3)", "n"),
    "an argument": ("n | procedures", "i | put(n)", "n"),
    "an assignment": ("n | procedures", "i | m := n", "n"),
    "what a call wrote": ("procedures | m", "bump | n", "n"),
    "what a call of a call wrote": ("procedures | m", "deeper | n", "n"),
    "an index": ("n | m", "i | xs[n mod 3]", "n"),
    "the place": ("n | procedures", "i | xs[n mod 3] := 1", "n"),
    "an element": ("procedures | m", "xs[i] := 1 | xs[2]", "xs[2]"),
    "some element": ("procedures | m", "xs[1] := 1 | xs[i]", "xs[1]"),
    "a member": ("p.a | m", "i | p.a", "p.a"),
    "a record": ("p.b | q", "i | p", "p.b"),
    "an output": ("o | m", "i | o", "o"),
    "an order": ("n | arm", "i | reach(far := n)", "n"),
    "over a cell between": ("n | o | m", "i | 3 | n", "n"),
    "status": ("status_out | command_out", "n := i | put(n)", "n"),
}


@pytest.mark.parametrize("case", TOLD)
def test_a_cell_that_reads_what_an_earlier_one_wrote_is_told(case: str) -> None:
    headings, cells, name = TOLD[case]
    text = table(headings, cells)
    found = refused(text)
    assert [each.code for each in found] == [Code.READ_AFTER_WRITE], found
    assert f"reads `{name}`" in found[0].message
    where = found[0].primary.span
    assert text[where.start : where.end].strip() in cells
    assert found[0].related[0].span.start < where.start


FINE = {
    "before it is written": ("m | n", "n | i"),
    "in one cell": ("procedures", "n := i; m := n"),
    "by a procedure": ("n | procedures", "i | copy"),
    "another element": ("procedures | m", "xs[1] := 1 | xs[2]"),
    "another member": ("p.a | m", "i | p.b"),
    "its own": ("n", "min(n + 1, 9)"),
    "what is next": ("procedures | m", "next x := i | x"),
    "as it is": ("n | m", "n | n"),
    "written anew in the cell": ("n | procedures", "i | n := 1; m := n"),
}


@pytest.mark.parametrize("case", FINE)
def test_what_says_its_order_is_fine(case: str) -> None:
    program_of(table(*FINE[case]))


def after(headings: str, cells: str) -> tuple[int, int]:
    """What `n` and `m` are after the line, `n` was 5."""
    program = program_of(table(headings, cells))
    then = run_table(program, program.tables[0], {**initial(program), "n": 5}).snapshot
    return int(then["n"]), int(then["m"])


def test_both_spellings_of_the_help_mean_what_they_say() -> None:
    old, new = refused(table("n | m", "2 | n"))[0].help
    assert old == "to mean the value before the line, let column `m` stand left of column `n`"
    assert new == "to mean the new value, write both in one cell under `procedures`: `n := 2; m := n`"
    assert after("m | n", "n | 2") == (2, 5)
    assert after("procedures", "n := 2; m := n") == (2, 2)


def test_what_is_exchanged_needs_a_local() -> None:
    assert "keeps one of them in a local" in refused(table("n | m", "m | n"))[0].help[0]
    assert "a procedure that does both" in refused(table("n | arm", "2 | reach(far := n)"))[0].help[1]

"""How runs and open claims are told: waits folded, and what is known of a claim that is neither proved nor broken."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

from rcsc.base.diagnostics.alike import Alike, folded
from rcsc.front.commands import run
from tests.support.programs.systems import small_system, solo_system
from tests.support.programs.texts import level, table

WAITS = (
    "enum m { idle, wait, over }\ninput go : bool\nstate now : m\nstate t : int 0 .. 40\noutput lamp : bool\n"
)
ROWS = (
    "rests | idle | false | || | 0 | false",
    "begins | idle | true | || wait | 0 | false",
    "waits | wait | | < 30 || | t + 1 | false",
    "ends | wait | | >= 30 || over | | true",
    "over | over | | || idle | 0 | false",
)
WAIT = f"{WAITS}{table('a', 'line | now | go | t || now | t | lamp', *ROWS)}{level('solo', 'a')}"


# --- folding ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cycle:
    """A cycle by hand."""

    ran: str | None
    moved: Mapping[str, str]


def shapes(*cycles: tuple[str | None, Mapping[str, str]]) -> list[object]:
    """Fold cycles; tell those that stand by what they moved, and of the others how many and between which values."""
    every = [Cycle(*one) for one in cycles]
    return [(one.many, one.moved) if isinstance(one, Alike) else one.moved for one in folded(every)]


def counting(
    *values: int | float | str, line: str | None = "a"
) -> list[tuple[str | None, Mapping[str, str]]]:
    return [(line, {"n": str(value)}) for value in values]


def test_a_wait_takes_a_line() -> None:
    [*wait] = counting(*range(3, 603))
    assert shapes(*wait) == [{"n": "3"}, (598, {"n": "4 .. 601"}), {"n": "602"}]
    still: list[tuple[str | None, Mapping[str, str]]] = [("a", {})] * 7
    assert shapes(*still) == [{}, (5, {}), {}]


@pytest.mark.parametrize(
    "cycles",
    [
        counting(1, 2, 3, 4, 5),  # too few to be worth it
        counting(1, 2, 4, 7, 11, 16, 22),  # by another step each time
        counting("x", "y", "x", "y", "x", "y", "x"),  # no numbers
        counting(1, 2, 3, 4, 5, 6, 7, line=None),  # each is to be shown
        [(line, {"n": str(n)}) for n, line in enumerate("abababab")],  # other lines
        [("a", {"n" if n % 2 else "k": str(n)}) for n in range(8)],  # other values
    ],
)
def test_what_is_not_alike_is_shown(cycles: list[tuple[str | None, Mapping[str, str]]]) -> None:
    assert shapes(*cycles) == [moved for _, moved in cycles]


def test_a_wait_within_a_run_is_folded_and_the_log_keeps_every_cycle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the time line and on the page of the finding; replay goes through all of it."""
    path = solo_system(tmp_path, f"{WAIT}property never : not lamp\n")
    found = tmp_path / "found"
    assert run(["prove", str(path), "--no-cache", "--trace", "40", "--log", str(found)]) == 1
    said = capsys.readouterr().err
    rows = [line.split("|")[1:-1] for line in said.splitlines() if line.startswith("  |")]
    cells = [tuple(cell.strip() for cell in row) for row in rows]
    assert ("3 .. 30", "... 28 cycles alike", "", "t = 2 .. 29") in cells
    assert [number for number, *_ in cells if number] == ["cycle", "1", "2", "3 .. 30", "31", "32"]
    log, page = found / "solo_property_never.mcap", tmp_path / "page.html"
    assert run(["log", str(log), "--report", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert "... 28 cycles alike" in text
    assert text.count("<figure") == 5
    assert run(["replay", str(log), "--generated", str(found / "generated"), "--executor", "python"]) == 0
    assert "32" in capsys.readouterr().out


# --- open claims -----------------------------------------------------------------------------

TEN = table(
    "ten", "line | now | ticks || procedures | now",
    *(f"l{at} | {at} | || tick | {(at + 1) % 10}" for at in range(10)), "late | | > 30 || tick |",
).replace("table ten {", "table ten assuming calm {")  # fmt: skip
COUNTS = (
    "state now : int 0 .. 9\nstate ticks : int 0 .. 60\nassume calm monitored : ticks < 20\n"
    f"procedure tick {{ ticks := min(ticks + 1, 60) }}\n{TEN}{level('solo', 'ten')}"
)


def test_an_open_claim_says_what_was_looked_at_where_it_stops_and_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The state by name, and the length of run to ask for, with which the run is found; none of the pairs of ten lines is listed.

    Without `--where` all states are searched, and the run is found at once.
    """
    path = solo_system(tmp_path, COUNTS)
    assert run(["prove", str(path), "--no-cache"]) == 1
    assert "broken in cycle 21" in capsys.readouterr().err
    begins = ("--where", "solo.now = 0")
    assert run(["prove", str(path), "--no-cache", *begins]) == 1
    said = capsys.readouterr().err
    [_, calm, one_line] = said.split("error[RCS751]: ")
    assert calm.startswith("level `solo`, table `ten`: not proved: assumption `calm`\n")
    assert (
        "no run of 8 cycles or fewer breaks it: all of them were looked at, from the values of --where"
        in calm
    )
    assert "whether that is ever reached is not known: `now` = 0, `ticks` = 19" in calm
    assert "`--trace 27`" in calm
    assert '`--where "solo.now = 0, solo.ticks = 19"`' in calm
    assert "`invariant not_there : not (now = 0 and ticks = 19)`" in calm
    assert one_line.startswith("level `solo`, table `ten`: not proved: no two lines match\n")
    assert one_line.count(" and late") == 1, (
        "the state at which it stops shows one pair, and no other is listed"
    )
    assert run(["prove", str(path), "--no-cache", *begins, "--trace", "27"]) == 1
    assert "broken in cycle 21" in capsys.readouterr().err


def test_a_loop_is_told_by_its_lines_and_states(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where a run comes to it, and where no run is long enough, from a state that is not excluded."""
    asked = ["prove", str(small_system(tmp_path)), "--no-cache", "--level", "lower"]
    assert run(asked) == 0
    said = capsys.readouterr().err
    assert "goes round from cycle 3 to the end of cycle 3" in said
    assert "the loop: line `2` at `new_command` = false, `cur_state` = going" in said
    assert run([*asked, "--trace", "2"]) == 0
    said = capsys.readouterr().err
    assert "no run of 2 cycles or fewer is one that comes round" in said
    assert (
        "the proof stops here, at a state that it does not exclude, from where it would go round: line `2` at"
        in said
    )

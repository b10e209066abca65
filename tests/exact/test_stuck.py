"""Lines that are never reached, and states that nothing leaves: why, and where; against every state that a level can reach."""

import json
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.walk import reached_further
from rcsc.compose.proof.context import Context
from rcsc.compose.proof.level import prove_level
from rcsc.compose.proof.stuck import NeverReached, Trap
from rcsc.compose.proof.system import transition_systems
from rcsc.front.commands import run
from rcsc.lang.interpret import cycle, initial
from tests.support.programs.systems import LITTLE, alone, small_system, solo_system
from tests.support.programs.texts import level, table

HEAD = """\
enum mode { idle, busy, over, lost }
input go : bool
input stop : bool
state now : mode = idle
state ticks : int 0 .. 60
output lamp : bool
"""
LINES = "line | now | go | stop | ticks || now | ticks | lamp"


def machine(*rows: str, head: str = HEAD, more: str = "") -> str:
    """Return a level of one table with these lines."""
    return f"{head}{table('t', LINES, *rows)}{more}{level('solo', 't')}"


def seen(text: str) -> Context:
    """Prove the level of a text; return its lines in their context."""
    found = prove_level(alone(text), LITTLE).context
    assert found is not None
    return found


BUSY = ("goes | busy | | false | || | | true", "ends | busy | | true | || idle | | false")
IDLE = ("rests | idle | false | | || | | false", "begins | idle | true | | || busy | | true")
OVER = "waits | over | | | || | | false"
LOST = "lost | lost | | | || idle | | false"


# --- lines -----------------------------------------------------------------------------------


def test_a_cell_that_never_holds_is_named_with_what_would_make_it_so() -> None:
    """Nothing enters `lost`; only a line that is never reached enters `over`."""
    back = "back | lost | | | || over | | false"
    found = seen(machine(*IDLE, *BUSY, OVER, back))
    assert set(found.never) == {
        NeverReached("t", "back", columns=(0,), leaf="now"),
        NeverReached("t", "waits", columns=(0,), leaf="now", sets=(("t", "back"),)),
    }
    assert (found.unreached, found.traps, found.unsure) == ((("t", "waits"), ("t", "back")), (), ())


def test_of_cells_that_never_hold_together_the_fewest_are_named() -> None:
    """Each cell of `late` holds at some time; `busy` and a counter that only runs while idle never do."""
    found = seen(
        machine(
            "rests | idle | false | | < 3 || | ticks + 1 | false",
            "stays | idle | false | | >= 3 || | 3 | false",
            "begins | idle | true | | || busy | 0 | true",
            "goes | busy | | false | 0 || | | true",
            "late | busy | false | false | > 0 || idle | | false",
            "later | busy | true | false | > 0 || idle | | false",
            "ends | busy | | true | || idle | 0 | false",
            OVER,
            LOST,
        )
    )
    never = {one.line: one for one in found.never}
    assert never["late"].columns == (0, 3)
    assert not never["late"].leaf


def test_a_table_that_never_runs_and_a_default_that_is_never_reached() -> None:
    unused = table("u", "line | go || lamp", "on | true || true", "off | false || false")
    head = f"{HEAD}enum which {{ first, second }}\nstate kind : which = first\n"
    text = machine(*IDLE, *BUSY, "rest | DEFAULT | | | || idle | | false", head=head, more=unused)
    found = seen(text.replace("] table t }", "] table by kind { first : t second : u } }"))
    assert set(found.never) == {
        NeverReached("u", "on", idle=True),
        NeverReached("u", "off", idle=True),
        NeverReached("t", "rest"),
    }


def test_trusted_assumptions_leave_no_line_in_doubt() -> None:
    """Walks keep to what is assumed: only lines that it excludes are not reached."""
    text = machine(
        *IDLE,
        "goes | busy | | false | || | | true",
        "ends | busy | false | true | || idle | | false",
        "both | busy | true | true | || over | | false",
        OVER,
        LOST,
        head=f"{HEAD}assume one assumed : not (go and stop)\n",
    ).replace("table t {", "table t assuming one {")
    found = seen(text)
    assert found.unsure == ()
    assert {line for _, line in found.unreached} == {"both", "waits", "lost"}


def test_lines_behind_a_time_are_found_by_inputs_that_are_held() -> None:
    """Sixty cycles without `go` or `stop` are no accident."""
    text = machine(
        "rests | idle | false | false | < 60 || | ticks + 1 | false",
        "stirs | idle | true | | < 60 || | 0 | false",
        "stops | idle | false | true | < 60 || | 0 | false",
        "late | idle | | | 60 || busy | | true",
        "goes | busy | | | || | | true",
        OVER,
        LOST,
    )
    found = seen(text)
    assert found.unsure == ()
    assert {line for _, line in found.unreached} == {"waits", "lost"}
    ts = alone(text)
    assert reached_further(ts, [("t", "late")], {("t", "rests"): initial(ts.program)}) == {("t", "late")}


# --- states ----------------------------------------------------------------------------------


def test_a_state_that_nothing_leaves_is_told_with_the_lines_that_enter_it() -> None:
    found = seen(machine(*IDLE, BUSY[0], "breaks | busy | | true | || over | | false", OVER, LOST))
    assert found.traps == (Trap("now", ("over",), (("t", "breaks"),), seen=True),)


def test_a_line_that_would_leave_it_and_is_never_reached_there_is_named() -> None:
    """It is left once `ticks` has risen, which it does nowhere."""
    found = seen(
        machine(
            *IDLE, BUSY[0], "breaks | busy | | true | || over | | false",
            "waits | over | | | 0 || | | false", "leaves | over | | | > 0 || idle | | false", LOST,
        )
    )  # fmt: skip
    assert found.traps == (Trap("now", ("over",), (("t", "breaks"),), seen=True, leaves=(("t", "leaves"),)),)


def test_states_that_only_lead_to_each_other_are_one_trap() -> None:
    found = seen(
        machine(
            *IDLE, BUSY[0], "breaks | busy | | true | || over | | false",
            "falls | over | | | || lost | | false", "rises | lost | | | || over | | false",
        )
    )  # fmt: skip
    assert found.traps == (Trap("now", ("over", "lost"), (("t", "breaks"),), seen=True),)


@pytest.mark.parametrize(
    ("says", "stated"),
    [
        ("now = over then now = over", "stays"),
        ("now in {over, lost} then now in {over, lost}", ""),
        ("now = over then now /= idle", ""),
    ],
)
def test_a_property_says_that_a_state_is_final(says: str, stated: str) -> None:
    """One that says as much by itself: that `over` leads to `over` or `lost` does not, though it is true."""
    text = machine(
        *IDLE, BUSY[0], "breaks | busy | | true | || over | | false", OVER, LOST,
        more=f"property stays : {says}\n",
    )  # fmt: skip
    assert [trap.stated for trap in seen(text).traps] == [stated]


def test_a_state_that_waits_for_an_order_is_no_trap(tmp_path: Path) -> None:
    """Both levels rest when they are done, and are left by a new command alone."""
    for ts in transition_systems(small_system(tmp_path)).values():
        found = prove_level(ts, LITTLE).context
        assert found is not None
        assert found.traps == ()


def drawn(seed: int) -> str:
    """Draw a machine: of each of five states and each value of an input the next one."""
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    rows = [
        f"{at}{value} | {at} | {value} || {random.choice('abcde' + at * 3)}"
        for at in "abcde"
        for value in ("true", "false")
    ]
    head = "enum m { a, b, c, d, e }\ninput x : bool\nstate s : m = a\n"
    return f"{head}{table('t', 'line | s | x || s', *rows)}{level('solo', 't')}"


def reachable(text: str) -> Iterator[tuple[str, str, str]]:
    """Yield every step that a drawn machine can take from its first state, by the interpreter: from, line, to."""
    program = alone(text).program
    waiting, done = [dict(initial(program))], set()
    while waiting:
        now = waiting.pop()
        if now["s"] in done:
            continue
        done.add(now["s"])
        for x in (False, True):
            outcome = cycle(program, program.levels[0], {**now, "x": x})
            yield "abcde"[int(now["s"])], str(outcome.line), "abcde"[int(outcome.snapshot["s"])]
            waiting.append(outcome.snapshot)


@pytest.mark.parametrize("seed", range(12))
def test_drawn_machines_are_stuck_where_every_reachable_state_says_so(seed: int) -> None:
    text = drawn(seed)
    found, steps = seen(text), list(reachable(text))
    states = sorted({state for one, _, other in steps for state in (one, other)})
    goes = {(a, b) for a, _, b in steps} | {(a, a) for a in states}
    for middle, one, other in product(states, repeat=3):
        if {(one, middle), (middle, other)} <= goes:
            goes.add((one, other))
    closed = {tuple(b for b in states if (a, b) in goes) for a in states}
    wanted = {
        part for part in closed if "a" not in part and all(((a, b) in goes) for a in part for b in part)
    }
    assert {trap.members for trap in found.traps} == wanted
    for trap in found.traps:
        enters = {line for a, line, b in steps if a not in trap.members and b in trap.members}
        assert {line for _, line in trap.enters} == enters
    lines = {f"{at}{value}" for at in "abcde" for value in ("true", "false")}
    assert {line for _, line in found.unreached} == lines - {line for _, line, _ in steps}


# --- by the command --------------------------------------------------------------------------


def test_both_are_told_at_their_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each line says where, why and what to do; they are counted in the verdict, and stand in the JSON, too; a second run repeats them."""
    text = machine(*IDLE, BUSY[0], "breaks | busy | | true | || over | | false", OVER, LOST)
    path = solo_system(tmp_path, text)
    number = 1 + next(at for at, line in enumerate(text.splitlines()) if "| lost" in line)
    for _ in range(2):
        assert run(["prove", str(path)]) == 0
        said = capsys.readouterr().out
        assert (
            "but 1 line never reached, 1 state never left: status 0, and 1 with --strict"
            in said.splitlines()[0]
        )
        assert "warning[RCS758]: line `lost` of table `t` is never reached" in said
        assert f"solo.rcs:{number}:" in said
        assert "never so where the table runs" in said
        assert "no line makes it so: none writes such a value to `now`" in said
        assert (
            "warning[RCS759]: once `now` is `over`, nothing in level `solo` leaves that, but a restart"
            in said
        )
        assert "`property now_stays : now = over then now = over`" in said
    assert run(["prove", str(path), "--strict"]) == 1
    capsys.readouterr()
    assert run(["prove", str(path), "--json"]) == 0
    notices = json.loads(capsys.readouterr().out)["notices"]
    assert [(notice["code"], notice["severity"]) for notice in notices] == [
        ("RCS758", "warning"),
        ("RCS759", "warning"),
    ]
    solo_system(tmp_path, f"{text}property now_stays : now = over then now = over\n")
    assert run(["prove", str(path)]) == 0
    said = capsys.readouterr().out
    assert "stays for ever once it is so: now = over, as `now_stays` says" in said
    assert "RCS759" not in said

"""A system whose levels declare whom they serve and command: proved with no line of the protocol by hand, refuted where it is wrong."""

import json
import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from rcsc.code.emit import TARGETS
from rcsc.compose.contract.claims import Verdict
from rcsc.compose.contract.environment import Above, Below
from rcsc.compose.contract.obligations import Sort, obligations, unstated
from rcsc.compose.contract.transition import GHOST, TransitionSystem
from rcsc.compose.counterexample.trace import Trace, TraceSearch, stopping, traces
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import prove_level
from rcsc.compose.proof.system import SystemProof, prove_transition_systems, transition_systems
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.front.commands import run
from rcsc.lang.model import key_bounds, value_of_key
from rcsc.lang.protocol import Party, written
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.run.adopt import adopt
from rcsc.run.description import description
from rcsc.run.system import signatures
from tests.support.programs.texts import edit_file

DOCK = Path(__file__).parents[1] / "data" / "protocol"


LOOKING, LITTLE = Effort(walks=6, cycles=40), Effort(walks=6, cycles=40, looks=False)


@pytest.fixture
def dock(tmp_path: Path) -> Path:
    """The description of a docking robot, to be changed."""
    shutil.copytree(DOCK, tmp_path / "dock")
    return tmp_path / "dock" / "system.toml"


@pytest.fixture(scope="module")
def proved() -> tuple[dict[str, TransitionSystem], SystemProof]:
    """The docking robot as it is."""
    return proved_in(DOCK / "system.toml")


def proved_in(path: Path) -> tuple[dict[str, TransitionSystem], SystemProof]:
    systems = transition_systems(path)
    return systems, prove_transition_systems(systems, LOOKING, 1, tuple(systems))


def test_every_obligation_of_a_docking_robot_is_stated_and_proved(
    proved: tuple[dict[str, TransitionSystem], SystemProof],
) -> None:
    for ts, proof in zip(proved[0].values(), proved[1].levels, strict=True):
        name = proof.level
        assert not proof.open, name
        assert not [missing for missing in unstated(ts) if missing.applies], name
        sorts = {obligation.sort for obligation, _ in proof.verdicts}
        assert {Sort.ONCE, Sort.ANSWERED, Sort.ECHOES, Sort.PROPERTY} <= sorts
        assert (
            name != "supervisor"
            or {Sort.WAITS, Sort.PAUSES, Sort.NUMBERED, Sort.ASSUMPTION, Sort.DEFERRED} <= sorts
        )


@pytest.mark.parametrize(
    ("level", "was", "now", "sort", "name"),
    [
        ("drive", "| start | true        |        |", "| start | true        | bad    |", Sort.SOME_LINE, ""),
        ("drive", "| idle  | false       | idle", "| idle  |             | idle", Sort.ONE_LINE, ""),
        ("drive", "|| blocked; stage(bad)", "|| blocked            ", Sort.PROPERTY, "failed_stays"),
        ("drive", "stage(bad) | 0     | failed", "stage(idle)| 0     | done  ", Sort.PROPERTY, "done_without_reason"),
        ("supervisor", "seen := beacon\n  }", "}\n  seen := beacon", Sort.WAITS, "to_drive"),
        ("supervisor", "|| phase(rest) | stop  | executing", "|| phase(rest) |       | executing", Sort.PAUSES, "to_drive"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_table_is_found(
    dock: Path, level: str, was: str, now: str, sort: Sort, name: str
) -> None:
    edit_file(dock.parent / f"{level}.rcs", (was, now))
    proof = prove_level(transition_systems(dock)[level], LITTLE)
    broken = {(obligation.sort, obligation.name) for obligation in proof.open}
    assert (sort, name) in broken, broken


def test_every_field_of_an_order_is_numbered_but_a_declared_stream(tmp_path: Path, dock: Path) -> None:
    """A target that changes under its number lets *done* of the last target be taken for the next: campaigns break it, too."""
    by_hand = tmp_path / "by_hand"
    shutil.copytree(DOCK.parent / "dock", by_hand, ignore=shutil.ignore_patterns(".rcsc-cache"))
    edit_file(
        by_hand / "supervisor.rcs",
        (" or to_drive.target_mm /= old_order.target_mm", ""),
        ("| back(100)", "| goto(900)"),  # a command that is ordered with two targets
    )
    proof = prove_level(transition_systems(by_hand / "system.toml")["supervisor"], LITTLE)
    assert (Sort.NUMBERED, "to_drive.target_mm") in [(one.sort, one.name) for one in proof.open]
    numbered = (Sort.NUMBERED, "", "to_drive.target_mm")
    for owed in (True, False):
        ts = transition_systems(dock)["supervisor"]
        assert (numbered in {one.key for one in obligations(ts, ts.cycle(ts.havoc()))}) == owed
        if owed:
            edit_file(dock.parent / "words.rcs", ("    target_mm : ", "    stream target_mm : "))


def test_who_is_served_and_commanded_is_linked_word_for_word(dock: Path) -> None:
    """What is neither in an order nor in a report is free, and nothing else is."""
    edit_file(dock.parent / "words.rcs", ("    target_mm : ", "    stream target_mm : "))
    systems = transition_systems(dock)
    fleet = Above("fleet", "fleet", "to_fleet", True, ("fleet.input_command",), done="done", failed="failed")
    drive = Below(
        "drive", "to_drive", "from_drive", False, "drive.late", ("drive.command", "drive.status"), False,
        ("to_drive.target_mm",), done="done", failed="failed",
    )  # fmt: skip
    links = systems["supervisor"].links
    assert (links.above, links.below, links.free) == (fleet, (drive,), ("beacon",))
    supervisor = Above(
        "supervisor", "supervisor", "to_supervisor", False, ("supervisor.input_command",), done="done", failed="failed"
    )  # fmt: skip
    links = systems["drive"].links
    assert (links.above, links.below, links.free) == (supervisor, (), ("travelled_mm", "bumper"))


def test_what_no_superior_asks_for_is_no_goal_of_a_level_that_declares_whom_it_serves(dock: Path) -> None:
    ts = transition_systems(dock)["supervisor"]
    alone = unstated(replace(ts, links=replace(ts.links, above=None)))
    assert {one.sort: one.applies for one in alone} == dict.fromkeys(
        (Sort.WAITS, Sort.PAUSES, Sort.ENDS), False
    )


@pytest.mark.parametrize(("restart", "left"), [(" restart bad", []), ("", [Sort.FAILED_STAYS])])
def test_an_order_that_stands_at_a_restart_has_failed(restart: str, left: list[Sort], tmp_path: Path) -> None:
    """A level that writes the protocol by hand owes it, too: campaigns watch it as `failed stays failed`."""
    shutil.copytree(
        DOCK.parent / "dock", tmp_path, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".rcsc-cache")
    )
    if not restart:
        edit_file(tmp_path / "drive.rcs", ("stage restart bad", f"stage{restart}"))
    proof = prove_level(transition_systems(tmp_path / "system.toml")["drive"], LOOKING)
    assert [one.sort for one in proof.open] == left
    assert not proof.unstated


IDLE = "| idle  | false       | idle   |        |                      |        ||                  | 0          | done       |"
BAD = "| bad   | false       | bad    |        |                      |        ||                  | 0          | fail       |"


@pytest.mark.parametrize(
    ("line", "status", "left", "statuses"),
    [
        (BAD, ("fail", "done"), [Sort.FAILED_STAYS], [2, 0]),
        (BAD, ("fail", "executing"), [Sort.FAILED_STAYS], [2, 1]),
        (IDLE, ("done", "executing"), [Sort.DONE_STAYS], [0, 1]),
        (BAD, ("fail", ""), [], []),
    ],
)
def test_a_level_by_hand_takes_no_answer_back(
    line: str, status: tuple[str, str], left: list[Sort], statuses: list[int], tmp_path: Path
) -> None:
    """A run from the first cycle shows it, as campaigns find it; a line that leaves the status alone is proved."""
    shutil.copytree(
        DOCK.parent / "dock", tmp_path, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".rcsc-cache")
    )
    drive = tmp_path / "drive.rcs"
    text = drive.read_text(encoding="utf-8")
    assert text.index(line) > text.index("table goto")
    drive.write_text(text.replace(line, line.replace(*status), 1), encoding="utf-8")  # of its first table
    ts = transition_systems(tmp_path / "system.toml")["drive"]
    proof = prove_level(ts, LITTLE)
    assert [one.sort for one in proof.open] == left
    for key, trace in traces(ts, proof.open, TraceSearch(4)).items():
        assert isinstance(trace, Trace), key
        assert [step.after["report.status_report"] for step in trace.steps[-2:]] == statuses


FORGETS = """
table goto {
  | line  | now    | bumper | travelled_mm            || procedures          | speed | status_out |
  |-------|--------|--------|-------------------------||---------------------|-------|------------|
  | bump  | moving | true   |                         || blocked; stage(bad) | 0     | failed     |
  | there | moving | false  | >= supervisor.target_mm || stage(idle)         | 0     | done       |
  | go    | moving | false  | < supervisor.target_mm  ||                     | 400   | executing  |
  | idle  | idle   |        |                         ||                     | 0     | done       |
  | bad   | bad    |        |                         ||                     | 0     | failed     |
}
"""


def test_a_table_that_looks_at_what_it_keeps_has_to_look_for_a_new_command(dock: Path) -> None:
    """GOTO reports of a new command what it reported of the last one: nothing moves, and all is done."""
    drive = dock.parent / "drive.rcs"
    text = drive.read_text()
    begins = text.index("table goto"), text.index("table stop")
    drive.write_text(text[: begins[0]] + FORGETS + text[begins[1] :])
    proof = prove_level(transition_systems(dock)["drive"], LITTLE)
    assert (Sort.ANSWERED, "goto") in {(one.sort, one.table) for one in proof.open}


BOUNDED = "else drive_silent answered within 250 cycles else drive_fault"


FAULT = "| fault | false       |            |               |       | approaching | failed       ||"


def endings(whole: SystemProof) -> tuple[dict[str, bool], tuple[str, ...]]:
    """Whether each command of the supervisor ends, whatever it rests on below; and what that is, where it is not proved."""
    ends = {ending.table: ending.proved for ending in whole.levels[0].endings}
    context = whole.levels[0].context
    assert context is not None
    assert context.repeated == ()  # that a cycle passes is no effect of a line
    lacks = whole.of("supervisor", (Sort.ENDS, "dock", "")).lacks
    return ends, tuple(" ".join(part for part in (level, *key) if part) for level, key in lacks)


def test_commands_end_though_a_subordinate_that_is_to_answer_in_time_never_does(
    dock: Path, proved: tuple[dict[str, TransitionSystem], SystemProof]
) -> None:
    """GOTO of the drive may go on for ever, since nothing bounds the way."""
    edit_file(dock.parent / "supervisor.rcs", ("else drive_silent", BOUNDED))
    assert (endings(proved[1]), endings(proved_in(dock)[1])) == (
        (dict.fromkeys(("stop", "dock", "undock"), True), ("drive the command ends goto",)),
        (dict.fromkeys(("stop", "dock", "undock"), True), ()),
    )


def test_a_supervisor_that_does_not_look_for_a_failure_waits_for_ever(dock: Path) -> None:
    edit_file(
        dock.parent / "supervisor.rcs",
        ("else drive_silent", BOUNDED),
        (f"{FAULT} refuse(drive_fault)         | stop  | failed ", f"{FAULT} | | executing "),
    )
    found = prove_level(transition_systems(dock)["supervisor"], LOOKING)
    assert not next(ending for ending in found.endings if ending.table == "dock").proved


def test_what_is_late_is_no_answer(dock: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lines that see the failure give no order, or what is late would be replaced in the cycle that says so."""
    bad = "| bad   | false       |            |               |       | bad         |              ||                             |"
    edit_file(
        dock.parent / "supervisor.rcs",
        ("else drive_silent", BOUNDED),
        (f"{FAULT} refuse(drive_fault)         | stop ", f"{FAULT} refuse(drive_fault) | "),
        (f"{bad} stop ", f"{bad} "),
    )
    lates = (Sort.PROPERTY, "", "drive_late_stays")
    assert prove_level(transition_systems(dock)["supervisor"], LITTLE).verdict(*lates) is Verdict.PROVED
    too_late = written._answered_too_late  # the text that is to be wrong

    def forgets(party: Party, most: str) -> Iterator[str]:
        for line in too_late(party, most):
            yield line.replace(f"if not {party.name}.late or", "if true or", 1)

    monkeypatch.setattr(written, "_answered_too_late", forgets)
    proof = prove_level(transition_systems(dock)["supervisor"], LITTLE)
    assert lates in {obligation.key for obligation in proof.open}


def test_a_running_level_adopts_what_the_proof_says_after_a_restart(dock: Path) -> None:
    files = tuple(str(dock.parent / f"{name}.rcs") for name in ("supervisor", "drive"))
    generated = dock.parent / "generated"
    assert not compile_(Settings(files, Options()), generated, TARGETS, only_check=False).report.failed
    signs, random = signatures(description(dock)), Random(12)  # noqa: S311  # repeatable on purpose
    for name, ts in transition_systems(dock).items():
        sign = signs[name]
        for _ in range(50):
            now: dict[str, bool | int | float] = {leaf.name: leaf.initial for leaf in sign.leaves}
            for leaf in ts.inputs:
                low, high = key_bounds(ts.kinds[leaf])
                now[leaf] = value_of_key(
                    ts.kinds[leaf], random.choice([low, high, random.randint(low, high)])
                )
            adopted = dict(zip(now, adopt(sign, tuple(now[leaf.name] for leaf in sign.leaves)), strict=True))
            for leaf, node in ts.restarted().items():
                if node.known and not leaf.startswith(GHOST):  # those no level keeps
                    assert node.low == int(adopted[leaf]), leaf
            assert ts.links.above is not None
            assert adopted["inc_command_seen"] == now[ts.links.above.number]
            for below in ts.links.below:
                assert adopted[below.number] == (now[below.echo] + 1) % 65536


# --- where a proof stops, and no run shows it ---


def _counting(dock: Path, most: int) -> None:
    """The drive counts its cycles on the way, and says that there are no more than so many."""
    more = f"\nstate waited : int 0 .. 2500\nproperty soon : waited <= {most}\n"
    edit_file(
        dock.parent / "drive.rcs",
        (
            "supervisor.target_mm  ||                     | 400",
            "supervisor.target_mm  || tick                | 400",
        ),
        (
            "procedure blocked {",
            f"{more}procedure tick {{\n  waited := min(waited + 1, 2500)\n}}\n\nprocedure blocked {{",
        ),
    )


def test_where_no_run_is_found_the_cycle_is_shown_at_which_the_proof_stops(
    dock: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _counting(dock, 40)
    asked = ["prove", str(dock), "--level", "drive", "--no-cache"]
    assert run([*asked, "--json", "--trace", "8"]) == 1
    findings = json.loads(capsys.readouterr().out)["findings"]
    [missing] = [finding for finding in findings if finding["severity"] == "error"]
    assert (missing["name"], missing["reproduces"], missing["time_line"]) == ("soon", False, [])
    begins, kept, last = missing["supposed"]
    assert (begins["leaves"]["waited"], last["leaves"]["waited"]) == ("40", "41")
    assert kept["wrong"] == ""
    assert (last["table"], last["line"]) == ("goto", "go")
    assert last["wrong"] == "property `soon` is broken"
    assert run(asked) == 1
    said = capsys.readouterr().err
    assert "no run of 8 cycles or fewer breaks it: all of them were looked at, from the first values" in said
    assert "whether that is ever reached is not known: " in said
    assert "`waited` = 40" in said
    assert "the solver gave up" not in said
    assert run([*asked, "--trace", "0", "--level", "drive"]) == 1
    assert "proof stops" not in capsys.readouterr().err, "nothing was looked for"


def test_a_run_on_which_the_solver_gave_up_is_not_said_not_to_be(
    dock: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _counting(dock, 40)

    def gives_up(*_: object) -> bool:
        raise GaveUpError

    monkeypatch.setattr("rcsc.compose.counterexample.trace.Unrolled.reaches", gives_up)
    assert run(["prove", str(dock), "--level", "drive", "--no-cache", "--certificate", "/dev/null/x"]) == 1
    assert "error[RCS502]: /dev/null/x cannot be written" in capsys.readouterr().err
    assert run(["prove", str(dock), "--level", "drive", "--no-cache"]) == 1
    said = capsys.readouterr().err
    assert "no run of 8 cycles or fewer was found; the solver gave up on some" in said


def test_where_a_run_is_found_nothing_is_supposed(dock: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _counting(dock, 4)
    assert run(["prove", str(dock), "--level", "drive", "--no-cache", "--json"]) == 1
    findings = json.loads(capsys.readouterr().out)["findings"]
    [missing] = [finding for finding in findings if finding["severity"] == "error"]
    assert missing["reproduces"]
    assert missing["supposed"] == []


@pytest.mark.parametrize("level", [0, 1])
def test_a_proof_stops_only_within_the_invariant(
    level: int, proved: tuple[dict[str, TransitionSystem], SystemProof]
) -> None:
    """Of what is proved nothing stops it; without the invariant something does."""
    proof = proved[1].levels[level]
    ts = proved[0][proof.level]
    every = obligations(ts, ts.cycle(ts.havoc()))
    assert not [each for each in every if stopping(ts, each, proof.predicates, proof.clauses)]
    assert any(stopping(ts, each, proof.predicates, ()) for each in every)


def test_check_repeats_no_property_that_nobody_wrote_until_one_is_not_proved(
    dock: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`failed_stays` is broken: a drive that ran into something says so, and goes on."""
    drive = dock.parent / "drive.rcs"
    (dock.parent / "rcsc.toml").write_text("", encoding="utf-8")
    edit_file(drive, ("table goto", "property slow : speed <= 400\ntable goto"))
    assert run(["check", str(drive)]) == 0
    said = capsys.readouterr().out
    assert "property `slow` is not proved here" in said
    assert "failed_stays" not in said
    edit_file(drive, ("|| blocked; stage(bad)", "|| blocked            "))
    assert run(["prove", str(dock), "--trace", "0", "--level", "drive"]) == 1
    capsys.readouterr()
    run(["check", str(drive)])
    assert "not proved: property `failed_stays`" in capsys.readouterr().out


# --- two subordinates ---


@pytest.mark.parametrize("keeps", [True, False])
def test_a_level_of_two_subordinates_keeps_its_decision_until_both_have_echoed(
    keeps: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The manual's example; without its column `answered` a decision may turn where a report is refused, and one echo is late alone."""
    manual = (Path(__file__).parents[2] / "grammar" / "protocol.md").read_text(encoding="utf-8")
    [text] = [
        case
        for case in re.findall(r"^```rcs\n(.*?)^```$", manual, re.MULTILINE | re.DOTALL)
        if "commands b : feeding" in case
    ]
    if not keeps:
        text = re.sub(r"^  \| wait .*\n", "", text, flags=re.MULTILINE)
        before, _, rest = text.partition("table sort {\n")
        rows, _, after = rest.partition("\n}\n")
        kept = ("|".join(cells[:3] + cells[4:]) for row in rows.splitlines() for cells in [row.split("|")])
        text = before + "table sort {\n" + "\n".join(kept) + "\n}\n" + after
    (tmp_path / "cell.rcs").write_text(text, encoding="utf-8")
    (tmp_path / "system.toml").write_text(TWO, encoding="utf-8")
    assert run(["prove", str(tmp_path), "--no-cache"]) == 0
    [told] = [line for line in capsys.readouterr().out.splitlines() if "no other command replaces" in line]
    assert "2 of 2 proved" in told
    assert ("`from_a`, `from_b` of level `cell` are never refused" in told) is not keeps


TWO = """name = "two"
generated = "generated"
tick_ms = 40
[[level]]
name = "cell"
[buffers]
"operator.order" = "cell.operator"
"cell.to_operator" = "operator.report"
"cell.to_a" = "a.order"
"a.report" = "cell.from_a"
"cell.to_b" = "b.order"
"b.report" = "cell.from_b"
"""

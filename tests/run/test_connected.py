"""Buffers that nobody writes: they follow from whom each level serves and commands."""

import shutil
from pathlib import Path

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.compose.proof.system import transition_systems
from rcsc.run.description import BadDescription, description
from tests.support.programs.texts import edit_file

PROTOCOL = Path(__file__).parents[1] / "data" / "protocol"
DECLARED = [
    ("fleet.order", "supervisor.fleet"),
    ("supervisor.to_fleet", "fleet.report"),
    ("supervisor.to_drive", "drive.supervisor"),
    ("drive.to_supervisor", "supervisor.from_drive"),
]
OWN = [
    ("base.travelled", "drive.travelled_mm"),
    ("base.bumper", "drive.bumper"),
    ("base.beacon", "supervisor.beacon"),
    ("drive.speed", "base.speed"),
]


@pytest.fixture
def dock(tmp_path: Path) -> Path:
    """A docking robot without a row for its protocol, to be changed."""
    shutil.copytree(PROTOCOL, tmp_path / "dock", ignore=shutil.ignore_patterns(".rcsc-cache"))
    return tmp_path / "dock" / "system.toml"


def rows(path: Path) -> list[tuple[str, str]]:
    return [(wire.source, wire.target) for wire in description(path).wires]


def write(path: Path, *more: tuple[str, str]) -> None:
    """Write these rows, before the others."""
    edit_file(path, ("[buffers]\n", "[buffers]\n" + "".join(f'"{a}" = "{b}"\n' for a, b in more)))


def faults(path: Path) -> list[str]:
    """What is wrong with a description, with the help."""
    with pytest.raises(BadDescription) as raised:
        description(path)
    assert {one.code for one in raised.value.diagnostics} == {Code.BAD_SYSTEM}
    return [" ".join([one.message, *one.help]) for one in raised.value.diagnostics]


def test_what_levels_declare_of_each_other_and_of_who_stands_outside_needs_no_row(dock: Path) -> None:
    assert rows(dock) == [*DECLARED, *OWN]


def test_a_system_may_have_no_buffers_but_those(dock: Path) -> None:
    text = dock.read_text()
    dock.write_text(text[: text.index("[buffers]")])
    assert rows(dock) == DECLARED


def test_rows_that_are_written_stand_where_they_are(dock: Path) -> None:
    write(dock, DECLARED[2], ("station.wish", "supervisor.fleet"))
    stand = [DECLARED[2], ("station.wish", "supervisor.fleet")]
    assert rows(dock) == [DECLARED[1], DECLARED[3], *stand, *OWN]


def test_two_levels_may_speak_by_way_of_a_third_party(dock: Path) -> None:
    write(dock, ("supervisor.to_drive", "radio.up"), ("radio.down", "drive.supervisor"))
    assert DECLARED[2] not in rows(dock)
    assert DECLARED[3] in rows(dock)


def test_declarations_are_looked_for_in_the_files_that_a_program_uses_and_not_in_comments(
    dock: Path,
) -> None:
    folder = dock.parent
    (folder / "rcsc.toml").write_text('name = "dock"\n')
    (folder / "drive").mkdir()
    (folder / "drive.rcs").rename(folder / "drive" / "drive.rcs")
    (folder / "roles.rcs").write_text(
        "# serves nobody : drive\nserves\n  supervisor : drive # of words.rcs\n"
    )
    edit_file(
        folder / "drive" / "drive.rcs",
        ("use words", "use words use roles"),
        ("serves supervisor : drive", ""),
    )
    assert rows(dock) == [*DECLARED, *OWN]


def test_a_level_whose_program_has_another_name_is_connected_by_its_own(dock: Path) -> None:
    (dock.parent / "drive.rcs").rename(dock.parent / "wheels.rcs")
    edit_file(dock, ('name = "drive"', 'name = "drive"\nprogram = "wheels"'))
    assert rows(dock) == [*DECLARED, *OWN]


def test_without_tables_nothing_follows(dock: Path) -> None:
    (dock.parent / "supervisor.rcs").unlink()
    (dock.parent / "drive.rcs").unlink()
    assert rows(dock) == OWN


@pytest.mark.parametrize(
    ("file", "was", "now", "message"),
    [
        ("system.toml", "[buffers]", '[buffers]\n"radio.up" = "drive.supervisor"',
         "`radio.up` = `drive.supervisor` contradicts what the levels declare: `supervisor.to_drive` goes to `drive.supervisor`"),
        ("system.toml", "[buffers]", '[buffers]\n"supervisor.to_drive" = "log.orders"',
         "`supervisor.to_drive` = `log.orders` contradicts"),
        ("supervisor.rcs", "commands drive :", "commands drvie :",
         "`drive` serves `supervisor`, and `supervisor` commands `drvie` write `commands drive : LINK` in the tables of `supervisor`"),
        ("drive.rcs", "serves supervisor : drive", "serves boss : drive",
         "`supervisor` commands `drive`, and `drive` serves `boss` write `serves supervisor : LINK` in the tables of `drive`"),
        ("drive.rcs", "serves supervisor : drive", "", "and `drive` serves nobody"),
        ("drive.rcs", "serves supervisor : drive", "serves supervisor : fleet",
         "`supervisor` commands `drive` over link `drive`, and `drive` serves it over link `fleet`"),
        ("system.toml", "tick_ms = 40", 'tick_ms = 40\noutside = ["base", "fleets"]',
         "`fleet`, with whom `supervisor` exchanges orders and reports, is neither a level nor in `outside` did you mean `fleets`?"),
        ("drive.rcs", "input bumper", "commands fleet : fleet\ninput bumper",
         "`fleet.report` would be an end of two buffers, one of them with `drive.from_fleet`"),
    ],
)  # fmt: skip
def test_what_contradicts_the_declarations_is_said_with_what_to_write(
    dock: Path, file: str, was: str, now: str, message: str
) -> None:
    edit_file(dock.parent / file, (was, now))
    assert any(message in fault for fault in faults(dock)), faults(dock)


# --- the same link, declared twice ----------------------------------------------------------------

ALIKE = (
    ("type distance = int 0 .. 20000 [mm]", "type reach = int 0 .. 10000 + 10000 [mm]"),
    (
        "target_mm : distance",
        "target_mm : reach",
    ),
)
OTHERWISE = [
    (("done done failed failed executing executing\n  order", "done done failed executing executing failed\n  order"),
     "failed: `executing` against `failed`"),
    (("goto, align", "align, goto"), "the commands: `{stop, align, goto}` against `{stop, goto, align}`"),
    (("done, executing, failed", "done, failed, executing"), "the statuses: `{done, failed, executing}` against"),
    (("0 .. 20000", "0 .. 19999"), "`target_mm` of the order: `int 0 .. 19999 [mm]` against `int 0 .. 20000 [mm]`"),
    (("int 0 .. 20000 [mm]", "real 0.0 .. 20000.0 [mm]"), "`target_mm` of the order: `real 0.0 .. 20000.0 [mm]` against"),
    (("    target_mm", "    stream target_mm"), "`target_mm` of the order: `stream int 0 .. 20000 [mm]` against"),
    (("    target_mm", "    more : bool\n    target_mm"), "the fields of the order: `more, target_mm` against `target_mm`"),
    (("report {\n    reason", "report {\n    seen : bool\n    reason"), "the fields of the report: `seen, why` against `why`"),
    (("no_beacon, blocked", "blocked, no_beacon"), "`why` of the report: `reason {none, blocked, no_beacon,"),
    ((WHY := "reason why : why restart restarted\n  }\n}\n", WHY.replace("restarted", "blocked")), "restart blocked` against"),
]  # fmt: skip


def apart(path: Path, *edits: tuple[str, str]) -> Path:
    """Let the drive declare the link in a file of its own."""
    words = (path.parent / "words.rcs").read_text(encoding="utf-8")
    for old, new in edits:
        assert old in words
        at = words.rindex(old)
        words = words[:at] + new + words[at + len(old) :]
    (path.parent / "own.rcs").write_text(words, encoding="utf-8")
    real = "real" in words
    kind = [("int 0 .. 20000 [mm] clamp", "real 0.0 .. 20000.0 [mm] clamp")] if real else []
    edit_file(path.parent / "drive.rcs", ("use words", "use own"), *kind)
    return path


@pytest.mark.parametrize(("edit", "said"), OTHERWISE)
def test_two_declarations_of_one_link_are_held_against_each_other(
    edit: tuple[str, str], said: str, dock: Path
) -> None:
    with pytest.raises(BadDescription) as raised:
        transition_systems(apart(dock, edit))
    [found] = raised.value.diagnostics
    assert found.code is Code.LINKS_DIFFER
    assert said in found.message
    places = [found.primary, *found.related]
    assert [Path(label.span.file).name for label in places] == ["own.rcs", "words.rcs"]
    assert all(label.span.file in raised.value.sources for label in places)


@pytest.mark.parametrize("edits", [(), ALIKE])
def test_two_declarations_that_say_the_same_are_one_link(
    edits: tuple[tuple[str, str], ...], dock: Path
) -> None:
    assert transition_systems(apart(dock, *edits))

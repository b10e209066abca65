"""The database, the scripts, the interlocks, and the commands that use them: what is wrong is said before anything moves."""

import csv
import json
import re
import shutil
import sqlite3
from pathlib import Path

import pytest

from rcsc.desk.shell.opening import Opening, opened
from rcsc.front.commands import run
from rcsc.run.orders.script import BadScript
from rcsc.run.system import System
from rcsc_cell.cell import reach
from rcsc_cell.cell.mujoco_model import Body
from rcsc_cell.cell.plant import Plant
from rcsc_cell.cell.ready import Lying, lying, plant
from rcsc_cell.database.ask import Database, open_database, tables_of
from rcsc_cell.database.build import BadData, build
from rcsc_cell.database.readable import NUMBERED
from rcsc_cell.episodes.witness import placements
from rcsc_cell.workstation.interlocks import CellState, after, refusal
from rcsc_cell.workstation.script import ScriptRow, read_script
from rcsc_cell.workstation.station import Workstation
from tests.support.cells import REPO, SYSTEM, prepare
from tests.support.programs.texts import one_row_a_line
from tests.support.shells import do

PARTS = ("null_obj", "tbox", "bbox", "flag", "hous", "close_grip", "unknown_object", "open_grip")
DATA = (SYSTEM.parent / "cell.toml").read_text(encoding="utf-8")
HEAD = "command,part,source,dest,end_at\n"


def kinematic(database: Database) -> list[Plant]:
    """What stands outside, without physics."""
    return [plant(database, "kinematic")]


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of tables and generated files."""
    shutil.copytree(REPO / "tables", tmp_path / "tables", ignore=shutil.ignore_patterns(".rcsc-cache"))
    shutil.copytree(REPO / "generated", tmp_path / "generated")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database of the shipped data; only to be read, or copied."""
    path = tmp_path_factory.mktemp("built") / "cell.sqlite"
    build(SYSTEM.parent / "cell.toml", path, PARTS)
    return path


# --- data ---

WRONG_DATA = {
    "a location that is not there": (
        'safe = "FIX-SAFE"',
        'safe = "NOWHERE"',
        "no location is called `NOWHERE`",
    ),
    "a part that the tables do not know": ("[object.hous", "[object.horse", "no part is called `horse`"),
    "out of reach": ("x = 198.4, y = 545.0", "x = 198.4, y = 1545.0", "mm from the base, out of reach"),
    "too high": ("y = 545.0, z = 350.0", "y = 545.0, z = 1350.0", "mm high, out of reach"),
    "a gripper that does not open": ("departure_mm = 90.0", "departure_mm = 20.0", "do not open wider"),
    "too many in stock": ("stock = 10", "stock = 200", "from 0 to 99, not `200`"),
    "vision without a view": ('vupos = "BUFFER-VUPOS"\n', "", "`vupos`"),
    "a missing value": ("breakpoint_mm = 30.0\n", "", "breakpoint_mm"),
    "a normal that is no direction": (
        "[object.tbox]\n",
        "[object.tbox]\nnormal = [0.0, 1.0, 1.0]\n",
        "object `tbox`, normal: is 1.4142 long, not 1",
    ),
    "a path to nowhere": ('to = "STATION"', 'to = "STATON"', "no location is called `STATON`"),
    "a path that says nothing": (
        'to = "STATION"\napproach = [200.0]\n',
        'to = "STATION"\n',
        "path 1, from `V-BLK2` to `STATION`: says neither",
    ),
    "a path twice": (
        "[[path]]",
        '[[path]]\nfrom = "V-BLK2"\nto = "STATION"\napproach = []\n[[path]]',
        "path 2, .* such a path with a `approach` already",
    ),
    "a path out of reach": ("approach = [200.0]\n\n# What", "approach = [2000.0]\n\n# What", "out of reach"),
    "no TOML": ("[robot]", "[robot", "not TOML"),
}


@pytest.mark.parametrize("name", list(WRONG_DATA))
def test_data_that_is_not_in_order_makes_no_database(name: str, tmp_path: Path) -> None:
    old, new, said = WRONG_DATA[name]
    assert old in DATA
    (tmp_path / "cell.toml").write_text(DATA.replace(old, new), encoding="utf-8")
    with pytest.raises(BadData, match=said):
        build(tmp_path / "cell.toml", tmp_path / "cell.sqlite", PARTS)
    assert not (tmp_path / "cell.sqlite").exists()


def test_a_missing_or_broken_database_is_a_coded_error(
    project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (project / "broken").write_bytes(b"no database" * 100)
    for file in ("missing", "broken"):
        assert run(["run", "make_boxt", "--no-compile", "--database", file]) == 1
        said = capfd.readouterr()
        assert "error[RCS722]" in said.err
        assert said.out == ""


FOREIGN = {
    "a view in place of a table": "drop table parts; create view parts as with recursive n(x) as (select 1 union all select x + 1 from n) "
    "select 1, 1.0, 1.0, 1.0, 1.0 from n",
    "a column that is computed": "drop table meta; "
    "create table meta (x, digest text as (hex(zeroblob(400000000)))); insert into meta (x) values (1)",
    "a table beside its own": "create table more (x)",
    "a trigger": "create trigger t after insert on meta begin delete from parts; end",
    "a column less": "alter table robot drop column pad_mm",
    "a text for a number": "update points set x0 = 'far'",
    "bytes for a text": "update locations set name = x'ff' where number = 1",
    "a number for no number": "update grasps set force_n = 9e999",
    "a number that nothing is as long as": "update objects set length_mm = 1e300",
    "a length below 0": "update stations set length_mm = -5",
    "text that a terminal obeys": "update locations set name = 'a' || char(27) || '[2J' where number = 1",
    "text that turns about": "update objects set name = char(8238) || name where number = 1",
    "text that is not UTF-8": "update trajectories set name = cast(x'ff' as text) where name = 'fast'",
    "a part that is not described": "update parts set object = 99",
    "a way without its points": "update places set approach_count = 1000000",
    "a path without its points": "update approaches set count = 1000000",
    "a path without an end": "update approaches set count = 0",
    "no robot": "delete from robot",
    "a fixture without its numbers": "update stations set vise = '{}' where name = 'fixture'",
    "a fixture that is nested deep": "update stations set vise = replace(hex(zeroblob(5000)), '0', '[')",
}


@pytest.mark.parametrize("what", list(FOREIGN))
def test_a_database_of_somebody_else_is_read_as_what_it_must_be(
    what: str, built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(built, "a?b%.sqlite")
    held = sqlite3.connect(tmp_path / "a?b%.sqlite")
    assert run(["db", "show", "stations", "--system", str(SYSTEM), "--database", "a?b%.sqlite"]) == 0
    held.executescript(FOREIGN[what])
    held.close()
    at = ["--system", str(SYSTEM)]
    for command in (["db", "show", "locations", *at], ["run", "make_boxt", *QUICK, *at]):
        capfd.readouterr()
        assert run([*command, "--database", "a?b%.sqlite"]) == 1
        said = capfd.readouterr()
        *_, error = said.err.splitlines()  # a run that compiles nothing says so before
        assert error.startswith("error[RCS722]: `a?b%.sqlite` is no database of a cell: ")
        assert (error.isprintable(), said.out) == (True, "")


def test_a_long_text_is_shown_short(built: Path, project: Path, capfd: pytest.CaptureFixture[str]) -> None:
    shutil.copy(built, project / "my.sqlite")
    held = sqlite3.connect(project / "my.sqlite")
    held.executescript(
        "update objects set name = replace(hex(zeroblob(5000)), '0', 'long' || char(9)) where number = 1"
    )
    held.close()
    assert run(["db", "show", "objects", "--database", "my.sqlite"]) == 0
    shown = capfd.readouterr().out.splitlines()
    assert max(map(len, shown)) < 400
    assert not any("\t" in line for line in shown)
    assert "long    long" in shown[1]


def test_a_table_is_shown_with_names_and_units_and_no_digits_that_say_nothing(
    built: Path, project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(built, project / "my.sqlite")
    held = tables_of(project / "my.sqlite")
    assert run(["db", "show", "--database", "my.sqlite"]) == 0
    assert {line.split()[0] for line in capfd.readouterr().out.splitlines()} == set(held)
    for table, listed in held.items():
        assert run(["db", "show", table, "--database", "my.sqlite"]) == 0
        head, *rows = capfd.readouterr().out.splitlines()
        assert len(rows) == len(listed.rows)
        assert "_" not in head
        for column, at in ((name, listed.columns.index(name)) for name in listed.columns):
            if column in NUMBERED:
                names = {row[0]: row[1] for row in held[NUMBERED[column]].rows}
                for text, row in zip(rows, listed.rows, strict=True):
                    assert ("-" if row[at] is None else names[row[at]]) in text.split()
            if column.endswith(("_mm", "_mm_s", "_mm_s2", "_deg", "_n")):
                place = head.index("(", head.index(column.split("_")[0]))
                assert head[place:].startswith(
                    ("(mm)", "(mm/s)", "(mm/s\N{SUPERSCRIPT TWO})", "(N)", "(\N{DEGREE SIGN})")
                )
        assert not re.search(r"\.\d{5}|\d{2,}\.\d{3}|-0 |None|[{}]", "\n".join(rows))


def test_a_pallet_has_a_place_for_each_sector_and_others_ignore_it(built: Path) -> None:
    held = open_database(built)
    station, safe = held.locations["STATION"], held.locations["WS-SAFE"]
    grasps = {int(held.route(station, sector)[-1]) for sector in range(4)}
    assert len({held.point(point)[1:3] for point in grasps}) == 4
    assert held.route(station, 4)[0] is False
    assert held.route(safe, 3) == held.route(safe, 0)


def test_a_path_goes_by_both_its_ends(built: Path) -> None:
    """Section 4.3: by the pair if it has one, else the departure of the one and the approach of the other."""
    held = open_database(built)
    station, block, fixture = (held.locations[name] for name in ("STATION", "V-BLK2", "FIX-MAC5"))
    for sector in range(4):
        there = held.route(station, sector)
        assert held.path(fixture, 0, station, sector) == (True, *held.route(fixture, 0)[1:3], *there[3:5])
        _, leaves, many, first, count = held.path(block, 7, station, sector)
        assert (leaves, many, count) == (0, 0, int(there[4]) - 1)
        for at in (1, 2):  # the same points, without the one above the V-block
            assert (
                held.point(int(first) + int(count) - at)[1:]
                == held.point(int(there[3]) + int(there[4]) - at)[1:]
            )
    assert held.path(block, 0, station, 4)[0] is False
    assert held.path(0, 0, fixture, 0) == (True, 0, 0, *held.route(fixture, 0)[3:5])


def test_a_robot_that_is_there_goes_straight_to_it(built: Path) -> None:
    """But not where vision finds the part: there it may stand beside the location."""
    held = open_database(built)
    station, fixture, buffer = (held.locations[name] for name in ("STATION", "FIX-MAC5", "BUFFER"))
    _, leaves, many, first, count = held.path(fixture, 0, fixture, 3)
    assert (leaves, many, count) == (0, 0, 1)
    assert held.point(int(first))[1:10] == held.point(int(held.target(fixture, 0)[2]))[1:10]
    assert held.path(station, 2, station, 2)[2:] == (0, held.path(station, 2, station, 2)[3], 1)
    assert held.path(station, 1, station, 2)[2] == held.route(station, 1)[2]
    assert held.path(buffer, 0, buffer, 0) == held.route(buffer, 0)[:5]
    assert held.path(0, 0, 0, 0)[0] is False


QUICK = ("--no-compile", "--plant", "kinematic")


def test_db_commands(project: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["db", "check"]) == 0
    assert not (project / "tables/.rcsc-cache").exists(), "looking makes nothing"
    assert run(["db", "build", "-o", "my.sqlite"]) == 0
    assert run(["run", "make_boxt", *QUICK, "--database", "my.sqlite", "-q"]) == 0
    assert run(["db", "show", "places"]) == 0
    assert "\nlocation      sector  depart first" in capfd.readouterr().out
    assert run(["db", "show", "nothing"]) == 2
    (project / "tables/cell.toml").write_text(DATA.replace("z = 350.0", "z = 3000.0"), encoding="utf-8")
    assert run(["db", "check"]) == 1
    assert "error[RCS722]: location `FIX-SAFE`" in capfd.readouterr().err


@pytest.mark.parametrize("command", [["db", "check"], ["db", "build"], ["run", "make_boxt", *QUICK]])
def test_a_station_turned_so_that_the_arm_cannot_follow_is_named(
    command: list[str], project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Every point is as near and as high as before: only the joints tell."""
    turned = DATA.replace("y = -217.3, z = 350.0, yaw = -22.0", "y = -217.3, z = 350.0, yaw = 158.0")
    assert turned != DATA
    (project / "tables/cell.toml").write_text(turned, encoding="utf-8")
    build(project / "tables/cell.toml", project / "other.sqlite", PARTS)
    assert run(command) == 1
    said = capfd.readouterr()
    assert "error[RCS722]: " in said.err
    assert "location `V-BLK1`" in said.err
    assert "BUFFER`:" not in said.err
    assert said.out == ""
    if command[0] == "db":
        assert not (project / "tables/.rcsc-cache").exists(), "nothing is written"


@pytest.fixture
def looks(project: Path, monkeypatch: pytest.MonkeyPatch) -> list[Database]:
    """The databases that the arm has gone everywhere in; beside it a script of one short row."""
    seen: list[Database] = []
    unreachable = reach.unreachable

    def look(held: Database) -> tuple[str, ...]:
        seen.append(held)
        return unreachable(held)

    monkeypatch.setattr(reach, "unreachable", look)
    monkeypatch.delenv("RCSC_CACHE_DIR", raising=False)
    (project / "short.csv").write_text(HEAD + "MOVE,,,WS-SAFE,\n", encoding="utf-8")
    return seen


SHORT = ["run", "short.csv", *QUICK, "-q"]


def test_the_arm_goes_everywhere_once_in_each_database(looks: list[Database], project: Path) -> None:
    data = project / "tables/cell.toml"
    for text in (DATA, DATA.replace("stock = 10", "stock = 9"), DATA + "# other bytes, the same cell\n"):
        data.write_text(text, encoding="utf-8")
        assert [run(SHORT), run(SHORT)] == [0, 0]
    assert [9 in held.stock.values() for held in looks] == [False, True]


def test_a_cell_in_which_the_arm_cannot_go_everywhere_is_refused_every_time(
    looks: list[Database], project: Path
) -> None:
    """The first refusal leaves a database that is as new as the data: that is not what is asked."""
    turned = DATA.replace("y = -217.3, z = 350.0, yaw = -22.0", "y = -217.3, z = 350.0, yaw = 158.0")
    (project / "tables/cell.toml").write_text(turned, encoding="utf-8")
    assert [run(SHORT), run(SHORT)] == [1, 1]
    assert len(looks) == 2


def test_a_database_that_was_made_without_a_look_is_looked_at(
    looks: list[Database], project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(["db", "show"]) == 0
    assert not looks
    assert [run(SHORT), len(looks)] == [0, 1]
    # one that was brought along, and is none that anybody looked at
    (project / "tables/other.toml").write_text(DATA.replace("z = 350.0", "z = 355.0"), encoding="utf-8")
    build(project / "tables/other.toml", project / "other.sqlite", PARTS)
    assert [run([*SHORT, "--database", "other.sqlite"]), len(looks)] == [0, 2]
    assert [run([*SHORT, "--database", "other.sqlite"]), len(looks)] == [0, 2]
    monkeypatch.setattr(reach, "RULES", ("arm.py",))  # as if they had changed
    assert [run(SHORT), len(looks)] == [0, 3]


def test_what_db_build_made_need_not_be_looked_at_again(looks: list[Database]) -> None:
    assert [run(["db", "build"]), len(looks)] == [0, 1]
    assert [run(SHORT), len(looks)] == [0, 1]
    assert [run(["db", "check"]), len(looks)] == [0, 2]  # who asks for it gets it


def test_what_was_gripped_with_any_grasp_can_be_let_go_of(built: Path) -> None:
    """TASK remembers an unknown object by the number of the grasp that was tried."""
    held = open_database(built)
    unknown = held.objects["unknown_object"]
    tried = {grasp for part in held.objects.values() for grasp in range(10) if held.fingers(part, grasp)[0]}
    assert tried == {0, 2, 3}
    assert {grasp for grasp in tried if held.fingers(unknown, grasp)[0]} == tried


# --- scripts ---


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("DANCE,,,,", "is no command"),
        ("VISE-TURN LEFT,,,,", "nothing that a vise can do"),
        ("MOVE,BOX (2),BUFFER,FIX-MAC1,", "is no part"),
        ("MOVE,,,fix mac,", "is no location"),
    ],
)
def test_rows_that_say_nothing_are_named(row: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(f"{HEAD}MOVE,,,WS-SAFE,\n{row}\n", encoding="utf-8")
    with pytest.raises(BadScript, match=f"row 2: .*{said}"):
        read_script(tmp_path / "a.csv")


def test_scripts_that_cannot_be_run_are_coded_errors(
    project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (project / "place.csv").write_text(f"{HEAD}MOVE,,,MOON,\n", encoding="utf-8")
    (project / "columns.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    (project / "latin.csv").write_bytes(HEAD.encode() + b"MOVE,\xff,,,\n")
    for script in ("place.csv", "columns.csv", "latin.csv"):
        assert run(["run", script, *QUICK]) == 1
        assert "error[RCS723]" in capfd.readouterr().err, script
    assert run(["run", "make_box", *QUICK]) == 2
    assert "there is no script `make_box`; did you mean `make_boxt`?" in capfd.readouterr().err


def test_a_row_meets_the_faults_that_its_script_names(
    project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """They are on while it is under way: the first row, and the last, have none."""
    script = project / "mute.csv"
    rows = "VISE-OPEN RIGHT,,,,,\nVISE-CLOSE RIGHT,,,,,FAULT\n"
    for faults, ended, said in (
        ("", 0, "VISE-CLOSE RIGHT                           done"),
        ("vise_stuck blind", 1, "row 2, VISE-CLOSE RIGHT: failed"),
        ("vise_stick", 1, "row 2: no plant has a fault `vise_stick`; did you mean `vise_stuck`?"),
    ):
        script.write_text(HEAD.replace("\n", ",fault\n") + rows.replace("FAULT", faults), encoding="utf-8")
        assert run(["run", "mute.csv", *QUICK]) == ended, faults
        told = capfd.readouterr()
        assert said in told.out + told.err
        assert ("VISE-OPEN RIGHT                            done" in told.out) == (faults != "vise_stick")


def test_after_undo_a_row_still_meets_its_faults(project: Path) -> None:
    """What switches them is taken back together with whose row it is and whose faults they are."""
    rows = "VISE-OPEN RIGHT,,,,,\nVISE-CLOSE RIGHT,,,,,vise_stuck\n"
    script = project / "stuck.csv"
    script.write_text(HEAD.replace("\n", ",fault\n") + rows, encoding="utf-8")
    shell = opened(Opening(project / "tables/system.toml", script=str(script), plant="kinematic"))
    do(shell, "step 2", "undo 2", "run 400")
    [workstation] = [part for part in shell.session.system.outside if isinstance(part, Workstation)]
    assert [(result.row.number, result.state) for result in workstation.results] == [
        (1, "done"),
        (2, "failed"),
    ]


FIG_7 = """
VISE-OPEN RIGHT, CLOSE LEFT | | | |
MOVE | BOXT (2) | BUFFER | FIX-MAC1 |
VISE-CLOSE RIGHT | | | |
RELEASE | | | | FIX-MAC2
MOVE | | | FIX-MAC3 |
VISE-OPEN RIGHT | | | |
MOVE | | | FIX-MAC4 |
VISE-CLOSE RIGHT | | | |
MOVE | | | FIX-SAFE |
ENGRAVE PART | | | |
ACQUIRE | BOXT (2) | FIX-MAC5 | |
VISE-OPEN RIGHT, OPEN LEFT | | | |
TRANSFER | BOXT (2) | | V-BLK1 | V-BLK2
TRANSFER | BOXT (3) | V-BLK3 | V-BLK4 | V-BLK2
VISE-CLOSE LEFT | | | |
MOVE | BOXT (2) | V-BLK5 | FIX-MAC1 |
VISE-CLOSE RIGHT | | | |
RELEASE | | | | FIX-MAC2
MOVE | CLOSE-GRIP | | FIX-MAC3 |
VISE-OPEN RIGHT | | | |
MOVE | | | FIX-SAFE |
MACHINE DOVETAIL | | | |
ACQUIRE | BOXT (2) | FIX-MAC5 | |
VISE-OPEN RIGHT, OPEN LEFT | | | |
TRANSFER | BOXT (2) | | STATION(3) | WS-SAFE
"""
"""Commands as printed, but for STATION-x(y), which stands for a place on a pallet. Source: Haynes et al. (1984), Fig. 7."""


def test_a_script_names_commands_parts_and_places_as_fig_7_does() -> None:
    with (SYSTEM.parent / "scripts/make_boxt_printed.csv").open(encoding="utf-8", newline="") as file:
        shipped = [tuple(row) for row in csv.reader(file)]
    printed = [tuple(cell.strip() for cell in row.split("|")) for row in FIG_7.strip().splitlines()]
    assert shipped == [("command", "part", "source", "dest", "end_at"), *printed]


def test_the_scripts_are_fig_7() -> None:
    printed = read_script(SYSTEM.parent / "scripts/make_boxt_printed.csv")
    mended = read_script(SYSTEM.parent / "scripts/make_boxt.csv")
    assert len(printed) == 25
    assert [row.text for row in mended if row.text not in {one.text for one in printed}] == []
    assert len(mended) == 27


# --- interlocks ---

CLOSED = CellState(right_open=False, left_open=False, fixture="tbox", robot_at="FIX-SAFE")
REFUSED = {
    "no part": (
        CellState(right_open=False, left_open=False, robot_at="FIX-SAFE"),
        ScriptRow(1, "", machine="ENGRAVE PART"),
    ),
    "open vise": (CellState(fixture="tbox", robot_at="FIX-SAFE"), ScriptRow(1, "", machine="ENGRAVE PART")),
    "robot there": (
        CellState(right_open=False, left_open=False, fixture="tbox", robot_at="FIX-MAC4"),
        ScriptRow(1, "", machine="ENGRAVE PART"),
    ),
    "loose part": (CLOSED, ScriptRow(1, "", vise={"right": True})),
    "full fixture": (
        CellState(fixture="tbox", robot_at="WS-SAFE"),
        ScriptRow(1, "", "move", part="bbox", source="BUFFER", dest="FIX-MAC1"),
    ),
    "closed vise": (
        CellState(right_open=False),
        ScriptRow(1, "", "move", part="bbox", source="BUFFER", dest="FIX-MAC1"),
    ),
    "nothing held": (CellState(), ScriptRow(1, "", "release")),
    "nothing to take": (CellState(), ScriptRow(1, "", "acquire", part="tbox", source="FIX-MAC5")),
    "nobody knows where": (CellState(), ScriptRow(1, "", "acquire", part="tbox")),
    "nothing here": (CellState(robot_at="FIX-MAC5"), ScriptRow(1, "", "acquire", part="tbox")),
    "held here": (
        CellState(held="tbox", fixture="tbox", robot_at="FIX-MAC1"),
        ScriptRow(1, "", "acquire", part="tbox"),
    ),
    "held already": (CellState(held="tbox"), ScriptRow(1, "", "acquire", part="tbox", source="BUFFER")),
}


@pytest.mark.parametrize("name", list(REFUSED))
def test_interlocks_refuse(name: str) -> None:
    assert refusal(*REFUSED[name])


def test_interlocks_let_the_corrected_script_pass() -> None:
    cell = CellState()
    for row in read_script(SYSTEM.parent / "scripts/make_boxt.csv"):
        assert not refusal(cell, row), row
        cell = after(cell, row)
    assert (cell.held, cell.fixture, cell.robot_at) == ("", "", "STATION") or cell.robot_at == "WS-SAFE"


ACQUIRES_HERE = f"""{HEAD}"VISE-OPEN RIGHT, CLOSE LEFT",,,,
MOVE,BOXT (2),BUFFER,FIX-MAC1,
VISE-CLOSE RIGHT,,,,
RELEASE,,,,FIX-MAC2
MOVE,,,FIX-MAC5,
ACQUIRE,BOXT (2),,,
VISE-OPEN RIGHT,,,,
TRANSFER,,,STATION(3),WS-SAFE
"""


def test_a_part_is_acquired_where_the_robot_is(tmp_path: Path) -> None:
    """Section 3.1, by contact forces: the robot went to the part with an empty hand."""
    script = tmp_path / "here.csv"
    script.write_text(ACQUIRES_HERE, encoding="utf-8")
    made = prepare(SYSTEM, str(script), "c", lambda database: [plant(database, "mujoco")])
    results = list(made.steps())
    assert [result.state for result in results] == ["done"] * 8
    physical = made.system.outside[1]
    assert isinstance(physical, Plant)
    [placed] = placements(results, made.database, physical)
    assert (placed.part, placed.place) == ("tbox", "STATION(3)")
    assert placed.error_mm < 2.0
    assert (made.station.cell.fixture, made.station.cell.held) == ("", "")


def test_a_failed_row_stops_the_script_and_can_be_tried_again() -> None:
    made = prepare(SYSTEM, "make_boxt", "c", kinematic)
    outside = made.system.outside[1]
    assert isinstance(outside, Plant)
    outside.faults.blind = True
    *_, last = made.steps()
    assert (last.row.number, last.state, last.reason) == (2, "failed", "loc: no_match")
    for _ in range(40):
        made.system.step()
    assert made.system.level("primitive").shown("to_robot.input_command") == "hold"
    outside.faults.blind = False
    made.station.resume()
    assert [result.state for result in made.steps()] == ["done"] * 26


def test_a_part_of_the_wrong_size_is_let_go_of_and_the_next_is_acquired() -> None:
    def house_in_the_fixture(database: Database) -> list[Plant]:
        frame = database.stations["fixture"].frame
        house = Lying(4, Body((70.0, 50.0, 50.0), frame.point((0.0, 0.0, 45.0)), frame.turn))
        return [plant(database, "kinematic", [*lying(database), house])]

    rows = (
        ScriptRow(1, "", "acquire", part="tbox", grasp=3, source="FIX-MAC5"),
        ScriptRow(2, "", "release", end_at="FIX-SAFE"),
        ScriptRow(3, "", "acquire", part="tbox", grasp=2, source="BUFFER"),
    )
    made = prepare(SYSTEM, rows, "c", house_in_the_fixture)
    made.station.cell = CellState(fixture="tbox")  # as a script before this one left it
    [failed] = made.steps()
    assert (failed.state, failed.reason) == ("failed", "pic: wrong_size")
    assert made.station.cell.held == "unknown_object"
    made.station.resume()
    made.station.begin_at(1)
    assert [(step.state, step.reason) for step in made.steps()] == [("done", ""), ("done", "")]
    assert made.system.level("task").shown("obj_now_in_gripper") == "tbox"
    [*_, house] = made.system.outside[1].mechanism.parts()  # type: ignore[attr-defined]  # a plant
    assert house.at_mm[2] == pytest.approx(395.0, abs=1.0), "it lies where it lay"


def _shifted(world: Plant, by_mm: float) -> None:
    """Somebody moves the first part aside."""
    said = json.loads(json.dumps(world.state()))
    said["mechanism"]["poses"][0]["at_mm"][0] += by_mm
    world.restore(said)


def test_a_part_that_was_not_picked_up_is_counted_on_the_buffer_again() -> None:
    """Taken away as the hand comes down, which closes on nothing: the count falls by one, and rises again, once."""
    rows = tuple(ScriptRow(at, "", "acquire", part="tbox", grasp=2, source="BUFFER") for at in (1, 2))
    made = prepare(SYSTEM, rows, "c", kinematic)
    world = made.system.outside[1]
    assert isinstance(world, Plant)
    counts: list[int] = []

    def watch(system: System, _: object) -> None:
        count = int(system.level("task").value("tbuffer_boxt"))
        if counts[-1:] != [count]:
            counts.append(count)
            _shifted(world, {2: 300.0, 3: -300.0}.get(len(counts), 0.0))

    made.system.watch.append(watch)
    [failed] = made.steps()
    assert (failed.state, failed.reason) == ("failed", "pic: nothing_gripped")
    for _ in range(20):
        made.system.step()
    assert counts == [10, 9, 10]
    made.station.resume()
    assert [step.state for step in made.steps()] == ["done", "refused"]
    assert counts == [10, 9, 10, 9]


def test_a_level_whose_proof_fails_does_not_run(project: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = project / "tables/gripper/gripper.rcs"
    text = one_row_a_line(file)
    line = next(one for one in text.splitlines() if one.startswith("  | 6    | false       | d_state   |"))
    file.write_text(text.replace(line + "\n", "", 1), encoding="utf-8")
    assert run(["run", "make_boxt"]) == 1
    assert "error[RCS401]" in capfd.readouterr().out

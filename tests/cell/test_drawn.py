"""Findings as pages: what each level saw and said in each cycle, and the cell as far as the log says it."""

import contextlib
import io
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

import rcsc.views.pages.finding_page
from rcsc.base.host.files.names import BadName
from rcsc.compose.contract.obligations import ObligationKey, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.finding import Finding, of_trace
from rcsc.compose.counterexample.rerun import _begun, part_of, record
from rcsc.compose.counterexample.trace import Trace, TraceSearch, traces
from rcsc.compose.proof.system import transition_systems
from rcsc.front.commands import run
from rcsc.run.description import description
from rcsc.run.log.finding import LoggedCycle, LoggedFinding, finding_facts, finding_of
from rcsc.run.log.read import Log, read
from rcsc.run.log.recorder import Recorder
from rcsc.run.log.ticks import LoggedTick, frames
from rcsc.run.system import signatures
from rcsc.views.pages.frame import quoted
from rcsc_cell.cell.arm import skeleton, solve
from rcsc_cell.cell.reach import home
from rcsc_cell.database.ask import Database
from rcsc_cell.database.pose import nine, pose_of
from rcsc_cell.pictures.room import ALONE, NAMED, TOP, Block, Mark
from rcsc_cell.pictures.scene import DrawnCell, cell
from rcsc_cell.pictures.stick import Scene, pads, stick
from rcsc_cell.workstation.prepared import database_of
from tests.cell.test_pictures import lines
from tests.compose.test_findings import LAST_ECHO, PUBLISHED, REPO
from tests.support.browser import Browser
from tests.support.proved import obligation_of

SHIPPED = REPO / "tables" / "system.toml"
SVG = "{http://www.w3.org/2000/svg}"
PLATE = (560.0, 210.0, 725.0, 560.0, 210.0, 625.0, 460.0, 210.0, 725.0)
"""A hand that points down, beside where it rests."""
OVER = 7
"""A point of the database."""
FALSE = {
    "task": "to_emove.obj_ptr /= tbox or to_emove.locpt_ptr /= 1 or workstation.obj /= tbox",
    "primitive": " or ".join((
        "to_robot.input_command = hold",
        *(f"to_robot.plate[{at}] < {value}" for at, value in enumerate(PLATE)),
        f"emove.pose_ptr /= {OVER}",
    )),
}  # fmt: skip
"""Properties of the shipped levels that do not hold: the runs that show it are those that are drawn."""


@dataclass(frozen=True)
class Page:
    """A page, by its frames."""

    text: str

    @property
    def head(self) -> str:
        return self.text.partition('<div class="film">')[0]

    @property
    def frames(self) -> list[str]:
        return re.findall(r'<figure class="frame.*?</figure>', self.text, re.DOTALL)

    @property
    def broken(self) -> list[int]:
        return [at for at, one in enumerate(self.frames, 1) if one.startswith('<figure class="frame broken"')]

    def words(self, at: int) -> str:
        """What stands in a frame, without its markup."""
        plain = re.sub(r"<svg.*?</svg>", "", self.frames[at - 1], flags=re.DOTALL)
        return " ".join(re.sub(r"<[^>]*>", " ", plain).split())


def marked(svg: str) -> list[str]:
    """The names of the places that are marked."""
    texts = ET.fromstring(svg).iter(f"{SVG}text")  # noqa: S314  # likewise
    return [str(text.text) for text in texts if text.get("fill") == NAMED]


# --- as a user finds them ------------------------------------------------------------------


@pytest.fixture(scope="module")
def proved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of the logs, and what the command said of them."""
    folder, said = tmp_path_factory.mktemp("published"), io.StringIO()
    with contextlib.redirect_stderr(said):
        assert run(["prove", str(PUBLISHED), "--no-cache", "--log", str(folder)]) == 1
    return folder, said.getvalue()


@pytest.fixture(scope="module")
def published(proved: tuple[Path, str]) -> Path:
    return proved[0]


@pytest.fixture(scope="module")
def last_echo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("last_echo")
    assert run(["prove", str(LAST_ECHO), "--no-cache", "--log", str(folder)]) == 1
    return folder


def page_of(log: Path, *more: str) -> Page:
    out = log.with_suffix(".html")
    assert run(["log", str(log), "--report", str(out), *more]) == 0
    return Page(out.read_text(encoding="utf-8"))


def test_two_lines_that_match_are_named_in_the_cycle_in_which_they_do(
    published: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(REPO)
    page = page_of(published / "task_acquire_one_line_10_and_14.mcap")
    assert "lines <code>10</code> and <code>14</code> do not both match" in page.head
    assert (len(page.frames), page.broken) == (3, [3])
    assert "task acquire , line 4" in page.words(1)
    assert "lines 10 and 14 match" in page.words(3)
    assert "match" not in page.words(1) + page.words(2)
    # the order of the first cycle is not echoed in the second, in which the state waits for it; in the third it is
    assert "order no. 1 move_to locpt_ptr = station_vupos new" in page.words(1)
    assert "echo 0 pause done \N{BALLOT X} 0 is not 1" in page.words(2)
    assert "d_state in force, f_state pending" in page.words(2)
    assert "echo 1 move_to failed \N{CHECK MARK} echoes 1" in page.words(3)
    assert "d_state → f_state in force" in page.words(3)
    assert "pending" not in page.words(3)
    # it is another system's: nothing of this cell is drawn, and the page and the command say so
    assert "<svg" not in page.text
    said = "the log is of system `published`, and `tables/system.toml` of `nbs_robot`"
    assert f"No cell is drawn: {quoted(said)}" in page.head
    assert said in capsys.readouterr().out


def test_a_report_is_set_against_the_order_that_stood_before_the_cycle(published: Path) -> None:
    """A level that sees the echo of its order gives the next one in the same cycle: the echo is of the one before."""
    page = page_of(published / "task_acquire_one_line_12_and_14.mcap")
    for cycle in (1, 2, 3):
        seen, _, given = page.words(cycle).partition(f"\N{CHECK MARK} echoes {cycle - 1} ↓")
        assert f"↑ echo {cycle - 1} " in seen
        assert re.match(rf" order no. {cycle} \w+ .*new", given)


def test_the_command_that_draws_it_is_named_where_it_is_found(proved: tuple[Path, str]) -> None:
    folder, said = proved
    named = re.findall(r"= picture: rcsc (log \S+ --report (\S+))", said)
    logs = [
        path for path in folder.glob("*.mcap") if "_then_" not in path.name
    ]  # what follows has logs beside them
    assert len(named) == len(logs) > 7
    for command, page in named:
        assert run(command.split()) == 0
        text = Page(Path(page).read_text(encoding="utf-8"))
        assert len(text.broken) == 1


def test_what_comes_of_a_lost_command_stands_behind_it(published: Path) -> None:
    page = page_of(published / "task_acquire_answered_new_command.mcap")
    assert page.broken == [len(page.frames) - 1]
    assert f"cycle {len(page.frames)}: what comes of it" in page.words(len(page.frames))
    assert "the new command is passed over" in page.words(page.broken[0])


def test_two_levels_stand_one_above_the_other(last_echo: Path) -> None:
    """The upper one changes its order and not the number; the lower one takes it, and answers as if it were the first."""
    page = page_of(last_echo / "lower_same_order_command.mcap")
    assert [re.findall(r"<h3>(\w+)<span>", frame) for frame in page.frames] == [["upper", "lower"]] * 3
    above, _, below = page.words(2).partition("upper ↓")
    assert "order no. 1 drill changed, same number" in above
    assert "order no. 1 rest new" in below
    above, _, below = page.words(3).partition("upper ↓")
    assert "echo 1 rest done \N{BALLOT X} not drill" in above
    assert "order no. 1 drill changed, same number" in below
    assert "another order under the number that was taken last" in below


def test_a_log_of_a_finding_says_so(published: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["log", str(published / "task_acquire_one_line_14_and_15.mcap")]) == 0
    said = (
        "a finding, broken in cycle 2: level `task`, table `acquire`: lines `14` and `15` do not both match\n"
    )
    assert said in capsys.readouterr().out


# --- the shipped levels, and their cell ----------------------------------------------------


@dataclass(frozen=True)
class Found:
    """The runs that break `FALSE`, recorded."""

    made: dict[str, TransitionSystem]
    findings: dict[str, Finding]
    logs: dict[str, Path]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    folder = tmp_path_factory.mktemp("shipped")
    shutil.copytree(
        SHIPPED.parent, folder / "tables", ignore=shutil.ignore_patterns(".rcsc-cache", "examples")
    )
    for level, said in FALSE.items():
        path = folder / "tables" / level / f"{level}.rcs"
        text = path.read_text(encoding="utf-8")
        path.write_text(
            text.replace("\nlevel ", f"\n## Not so.\nproperty not_so : {said}\n\nlevel "), encoding="utf-8"
        )
    made = dict(transition_systems(folder / "tables" / "system.toml"))
    key: ObligationKey = (Sort.PROPERTY, "", "not_so")
    findings, logs = {}, {}
    for level in FALSE:
        obligation = obligation_of(made[level], *key)
        trace = traces(made[level], [obligation], TraceSearch(most=2, legal=True))[key]
        assert isinstance(trace, Trace)
        findings[level] = of_trace(made[level], obligation, trace)
        logs[level] = folder / f"{level}.mcap"
        record(findings[level], made, description(SHIPPED), logs[level])
    return Found(made, findings, logs)


@pytest.fixture(scope="module")
def database() -> Database:
    system = description(SHIPPED)
    return database_of(system, signatures(system))


def drawn_in(database: Database, log: Log) -> DrawnCell:
    return cell(log, description(SHIPPED), database)


def test_a_level_that_orders_no_pose_leaves_the_arm_at_rest(found: Found, database: Database) -> None:
    """What TASK names is marked: the place where the database has it, and the part where it lies."""
    page = page_of(found.logs["task"], "--system", str(SHIPPED))
    assert "The log holds no pose; the arm is drawn at rest." in page.words(1)
    svg = page.text[page.text.index("<svg") : page.text.index("</figure>")].partition("</div>")[0]
    rest = home(database)
    assert rest is not None
    [picture] = ALONE
    assert lines(svg, "arm") == [[pytest.approx(picture.flat(point), abs=0.06) for point in skeleton(rest)]]
    assert marked(svg) == ["BUFFER"]
    assert "BUFFER ( task.workstation.source_locpt , task.to_emove.locpt_ptr ) is marked." in page.words(1)
    assert (
        "tbox ( task.to_emove.obj_ptr , task.workstation.obj ) is marked where cell.toml has it."
        in page.words(1)
    )
    kinds = [part.object == database.objects["tbox"] for part in database.parts]
    assert (len(lines(svg, "part named")), len(lines(svg, "part"))) == (kinds.count(True), kinds.count(False))


def test_the_arm_is_where_primitive_orders_it(found: Found, database: Database) -> None:
    drawn = drawn_in(database, read(found.logs["primitive"])).drawn(1)
    pose, rest, point = pose_of(PLATE), home(database), pose_of(list(map(float, database.point(OVER)[1:10])))
    assert pose is not None
    assert rest is not None
    assert point is not None
    joints = solve(pose, rest)
    assert joints is not None
    assert joints != rest
    [picture] = ALONE
    assert lines(drawn.svg, "arm") == [[pytest.approx(picture.flat(at), abs=0.06) for at in skeleton(joints)]]
    assert drawn.caption[0] == "The hand is where `primitive.to_robot.plate` says."
    assert marked(drawn.svg) == [f"point {OVER}"]
    x, y = picture.flat(pads(point, database.hand.tool_mm))
    assert f'<circle class="mark" cx="{x:.1f}" cy="{y:.1f}"' in drawn.svg


def with_plates(log: Log, **plates: tuple[float, ...]) -> Log:
    """A log with other nine numbers in the last state of PRIMITIVE."""
    level = log.level("primitive")
    values = list(level.track.layout.unpack(level.track.packed[-1]))
    for record_, numbers in plates.items():
        run_ = level.sign.record(f"{record_}.plate")
        values[run_.start : run_.stop] = numbers
    track = replace(level.track, packed=[*level.track.packed[:-1], level.track.layout.pack(*values)])
    return replace(log, levels=(replace(level, track=track),))


def test_what_is_no_pose_is_not_drawn(found: Found, database: Database) -> None:
    """Ordered before reported; at rest where neither is a pose; and where the arm cannot be, it is not drawn."""
    log, none = read(found.logs["primitive"]), (0.0,) * 9
    reported = drawn_in(database, with_plates(log, to_robot=none)).drawn(1)
    assert reported.caption[0] == "The hand is where `primitive.from_robot.plate` says."
    at_rest = drawn_in(database, with_plates(log, to_robot=none, from_robot=none)).drawn(1)
    assert at_rest.caption[0].endswith("; the arm is drawn at rest.")
    assert "`primitive.to_robot.plate` and `primitive.from_robot.plate`" in at_rest.caption[0]
    assert lines(at_rest.svg, "arm") != lines(reported.svg, "arm") != []
    far = tuple(value + 3000.0 * (at % 3 == 0) for at, value in enumerate(PLATE))
    beyond = drawn_in(database, with_plates(log, to_robot=far)).drawn(1)
    assert "the arm cannot be there" in beyond.caption[0]
    assert not lines(beyond.svg, "arm")
    assert "primitive.from_robot.plate" in marked(beyond.svg)  # the other pose is told apart
    assert "`primitive.from_robot.plate` is marked." in beyond.caption


def test_what_the_data_does_not_know_is_said(found: Found, database: Database) -> None:
    """Nothing is put anywhere: a location and a part of no data, a part that lies nowhere, a pallet without its sector."""
    rings = []  # of each picture

    def named(at_first: int = 0, **values: int) -> tuple[list[str], tuple[str, ...]]:
        log = read(found.logs["task"])
        level = log.level("task")
        state = list(level.track.layout.unpack(level.track.packed[-1]))
        for name in ("workstation.source_locpt", "to_emove.locpt_ptr", "workstation.obj", "to_emove.obj_ptr"):
            state[level.sign.index[name]] = 0
        state[level.sign.index["workstation.source_locpt"]] = at_first
        for leaf, value in values.items():
            state[level.sign.index[f"to_emove.{leaf}"]] = value
        track = replace(level.track, packed=[*level.track.packed[:-1], level.track.layout.pack(*state)])
        drawn = drawn_in(database, replace(log, levels=(replace(level, track=track),))).drawn(1)
        rings.append(drawn.svg.count('<circle class="mark"'))
        return marked(drawn.svg), drawn.caption[1:]

    assert named() == ([], ())
    nowhere = "location 200 (`task.to_emove.locpt_ptr`): `cell.toml` does not say where."
    assert named(locpt_ptr=200) == ([], (nowhere,))
    flag = database.objects["flag"]
    assert named(obj_ptr=flag) == ([], ("flag (`task.to_emove.obj_ptr`): `cell.toml` has none lying about.",))
    pallet = database.locations["STATION"]
    assert named(locpt_ptr=pallet, sector=3)[0] == ["STATION(3)"]
    assert named(locpt_ptr=pallet)[0] == ["STATION(0)"]
    assert rings[-2:] == [1, 1]
    assert named(locpt_ptr=0, at_first=pallet)[0] == ["STATION"]  # the database is asked without a sector
    assert rings[-1] == 4, "a ring at each place, and the name once"
    assert named(locpt_ptr=pallet, sector=50)[0] == []
    renamed = {"another" if name == "tbox" else name: number for name, number in database.objects.items()}
    captions = drawn_in(replace(database, objects=renamed), read(found.logs["task"])).drawn(1).caption
    assert "tbox (`task.to_emove.obj_ptr`, `task.workstation.obj`): no part of `cell.toml`." in captions


def test_a_cell_is_drawn_of_its_own_system_only(
    found: Found, published: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    system = description(SHIPPED)
    ours = read(found.logs["task"])
    assert ours.is_of(system)
    assert not replace(ours, facts={**ours.facts, "name": "another"}).is_of(system)
    assert not ours.is_of(replace(system, levels=system.levels[1:]))
    log = published / "task_acquire_one_line_14_and_15.mcap"
    out = published / "no.html"
    assert run(["log", str(log), "--report", str(out), "--system", str(SHIPPED)]) == 1
    said = capsys.readouterr().err
    assert "error[RCS721]: the log is of system `published`" in said
    assert not out.exists()


# --- the log -------------------------------------------------------------------------------


def test_a_run_that_is_no_finding_is_refused(
    found: Found, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The log of a run in the cell, as `rcsc run` writes it: what draws it is named."""
    made = {"task": found.made["task"].program}
    running = _begun(found.findings["task"], part_of(description(SHIPPED), made), "python")
    log, out = tmp_path / "run.mcap", tmp_path / "page.html"
    with Recorder(running, log):
        pass
    assert read(log).finding is None
    assert run(["log", str(log), "--report", str(out)]) == 1
    said = capsys.readouterr().out
    assert "error[RCS706]" in said
    assert "rcsc run SCRIPT --report PAGE" in said
    assert not out.exists()
    assert run(["log", str(log), "--system", str(SHIPPED)]) == 2


WORDS = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), max_size=8)  # what prints
FINDINGS = st.builds(
    LoggedFinding,
    WORDS, WORDS, WORDS, st.integers(1, 40), st.booleans(), st.booleans(), st.booleans(),
    st.dictionaries(
        st.tuples(st.integers(1, 40), WORDS), st.builds(LoggedCycle, st.lists(WORDS).map(tuple), WORDS), max_size=4
    ),
)  # fmt: skip


@given(FINDINGS)
def test_what_a_log_says_of_a_finding_comes_back(finding: LoggedFinding) -> None:
    assert finding_of(finding_facts(finding)) == finding


def framed(log: Path) -> list[LoggedTick]:
    return list(frames(read(log)))


def test_every_cycle_of_a_log_is_framed(published: Path) -> None:
    """Against the state itself: what is pending is what stands in the leaf that waits, where it is another."""
    for path in sorted(published.glob("*.mcap")):
        log = read(path)
        assert log.finding is not None
        level = log.level("task")
        for frame, values in zip(framed(path), list(level.track)[1:], strict=True):
            [box] = frame.boxes
            known = {leaf.name: leaf.shown(values[1][at]) for at, leaf in enumerate(level.sign.leaves)}
            state = next(shown for shown in box.states if shown.name == "cur_state")
            waits = known["cur_state.next"]
            assert (state.now, state.pending) == (
                known["cur_state"], waits if waits != known["cur_state"] else ""
            )  # fmt: skip
            [(order, report)] = box.above
            assert order is not None
            assert report is not None
            assert (order.number, order.command) == (
                int(known["command.inc_command"]), known["command.input_command"]
            )  # fmt: skip
            assert report.matches is (known["report.inc_command_echo"] == known["command.inc_command"])
            assert box.lines == log.finding.cycles[frame.tick, "task"].matched


def test_a_level_that_does_not_run_says_nothing(last_echo: Path) -> None:
    log = read(last_echo / "lower_same_order_command.mcap")
    lower = log.level("lower")
    ticks = [tick for tick in lower.track.ticks if tick != 2]
    packed = [
        content for tick, content in zip(lower.track.ticks, lower.track.packed, strict=True) if tick != 2
    ]
    without = replace(
        log,
        levels=(log.level("upper"), replace(lower, track=replace(lower.track, ticks=ticks, packed=packed))),
    )
    second = list(frames(without))[1].boxes
    assert [(box.level, box.ran, bool(box.table)) for box in second] == [
        ("upper", True, True), ("lower", False, False)
    ]  # fmt: skip
    assert log.finding is not None
    assert "does not run in this cycle" in Page(
        rcsc.views.pages.finding_page.page(without, log.finding, None)
    ).words(2)


# --- the page ------------------------------------------------------------------------------


def test_the_page_is_the_same_again_and_escaped(published: Path) -> None:
    log = read(published / "task_acquire_one_line_10_and_14.mcap")
    assert log.finding is not None
    with pytest.raises(BadName):
        rcsc.views.pages.finding_page.page(
            replace(log, facts={**log.facts, "name": "<b>&"}), log.finding, None
        )
    text = rcsc.views.pages.finding_page.page(
        log, replace(log.finding, obligation="<i> `a<b`"), None, "for <u> reasons."
    )
    assert text == rcsc.views.pages.finding_page.page(
        log, replace(log.finding, obligation="<i> `a<b`"), None, "for <u> reasons."
    )
    for said in ("&lt;i&gt; <code>a&lt;b</code>", "for &lt;u&gt; reasons."):
        assert said in text
    assert quoted("one ` alone <b>") == "one ` alone &lt;b&gt;"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"restarted": True}, "begins where a restart does"),
        ({"legal": False}, "Numbers have gone round"),
        ({"altered": True}, "under another rule than the language&#39;s"),
    ],
)
def test_what_holds_of_the_whole_run_is_said(published: Path, change: dict[str, Any], said: str) -> None:
    log = read(published / "task_acquire_one_line_10_and_14.mcap")
    assert log.finding is not None
    assert said not in rcsc.views.pages.finding_page.page(log, log.finding, None)
    assert said in rcsc.views.pages.finding_page.page(log, replace(log.finding, **change), None)


def test_parts_and_marks_are_where_they_are() -> None:
    top = ((400.0, 300.0, 390.0), (480.0, 300.0, 390.0), (480.0, 360.0, 390.0), (400.0, 360.0, 390.0))
    scene = Scene(
        parts=(Block("tbox", top, 40.0, named=True),), marks=(Mark("<here>", (100.0, 200.0, 300.0)),)
    )
    svg = stick(nine(pose_of(PLATE)), 80.0, None, scene)  # type: ignore[arg-type]  # it is a pose
    assert lines(svg, "part named")[0] == [pytest.approx(TOP.flat(corner), abs=0.06) for corner in top]
    assert lines(svg, "bottom")[2] != lines(svg, "part named")[2]  # from the front it has a height
    assert marked(svg) == ["<here>"] * 4
    x, y = TOP.flat((100.0, 200.0, 300.0))
    assert f'cx="{x:.1f}" cy="{y:.1f}"' in svg


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as running:
        yield running


@pytest.mark.needs("chromium")
def test_the_page_needs_nothing_else(browser: Browser, found: Found) -> None:
    for level in FALSE:
        page_of(found.logs[level], "--system", str(SHIPPED))
        browser.open(found.logs[level].with_suffix(".html").as_uri())
        asked = browser.value("performance.getEntriesByType('resource').map(one => one.name)")
        assert [name for name in asked if not name.startswith("data:")] == []
        assert browser.said == []
        assert browser.value("document.scripts.length") == 0
        assert browser.value("document.querySelector('.frame.broken .arm').getBBox().height") > 100
        inside_page = "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
        assert browser.value(inside_page)

"""A system under the hands of pages: what the shell does, the same for all of them, whatever a page does or leaves."""

import asyncio
import itertools
import json
import shutil
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.base.diagnostics.coded import Refused as Refusal
from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.commands import Commands
from rcsc.desk.shell.opening import Opening, opened
from rcsc.desk.studio.hub import PROVER
from rcsc.desk.studio.runs.history import History
from rcsc.desk.studio.runs.live import Live
from rcsc.desk.studio.runs.shown import moment
from rcsc.desk.studio.runs.timeline import why
from rcsc.front.commands import run as rcsc
from rcsc.lang.interpret import initial
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.run.log.read import read
from rcsc.run.log.replay import Replay
from rcsc.run.log.ticks import frames
from rcsc.run.system import System
from tests.studio import driven
from tests.studio.served import Page, Refused, page, serving, until
from tests.support.programs.examples import EXTERN
from tests.support.programs.stages import program_of
from tests.support.programs.texts import edited

REST = "|        |                      |        ||                  | 0          |"
ROW = (
    f"  | idle  | false       | idle   {REST} done       |\n  | bad   | false       | bad    {REST} fail       |\n}}\n\n## Creeps",
    f"  | bad   | false       | bad    {REST} fail       |\n}}\n\n## Creeps",
)
"""What takes a line out of a table."""
DOCK = Path(__file__).parents[1] / "data" / "dock"


@pytest.fixture(scope="module")
def dock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The robot that docks, compiled, where nobody else writes."""
    folder = tmp_path_factory.mktemp("studio") / "dock"
    shutil.copytree(DOCK, folder, ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    assert rcsc(["compile", str(folder)]) == 0
    return folder / "system.toml"


def studio(
    path: Path, work: Callable[[Page, Page], Awaitable[None]], script: str = "", logs: tuple[Path, ...] = ()
) -> None:
    """Two pages of a studio whose system is open."""

    async def inside() -> None:
        async with page(server) as one, page(server) as other:
            for each in (one, other):
                await each.heard("run.state", open=True)
            await work(one, other)

    with serving(Opening(path, script=script), logs=logs) as server:
        asyncio.run(inside())


async def shown(one: Page, line: str) -> list[str]:
    """What the studio answers to a line, or says of a refusal."""
    try:
        answer: list[str] = (await one.ask("run.type", line=line))["shown"]
    except Refused as refused:
        return [f"refused: {refused}", *refused.helps]
    return answer


def by_shell(commands: Commands, line: str) -> list[str]:
    try:
        return commands.do(line)
    except Refusal as refused:
        return [f"refused: {refused}", *refused.helps]


SESSION = """
levels
step
order supervisor dock
step 5
lines
break drive.speed_mm_s > 0
breaks
run 40
show
undo
lines
undo 3
drive
step drive 2
supervisor.preprocess
state_table
postprocess
level drive
speed_mm_s ?
stage ?
no_such ?
run
run until supervisor.command.inc_command = 1
run until supervisor.command.inc_command = 7
run to cycle 60
run to cycle 3
expect drive.bumper = true
drive.bumper = true
show
step
lines
faults
fault nothing
freeze base.travelled
buffers base.travelled
step 3
thaw base.travelled
freeze nowhere
restart drive
restart drive anew
restart drive later
restart nobody
step 2
undo 200
undo 2
delete 1
delete 9
diff
reload drive
rubbish
step 999999999999
# nothing
""".strip().splitlines()


def test_every_command_answers_as_the_shell_does(dock: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "rcsc.desk.shell.commands.MOST_CYCLES", 500
    )  # else one of them runs for an hour of control time
    commands = opened(Opening(dock))

    async def work(one: Page, other: Page) -> None:
        for at, line in enumerate(SESSION):
            said = await shown((one, other)[at % 2], line)  # it is one system, whichever page asks
            assert said == by_shell(commands, line), line
        session = commands.session
        for level in session.levels:
            values = await one.ask("time.values", level=level.name, tick=session.system.tick)
            assert {value["name"]: value["text"] for value in values} == {
                leaf.name: level.shown(leaf.name) for leaf in level.sign.leaves
            }

    studio(dock, work)


def test_both_pages_see_the_same_and_one_that_goes_stops_nothing(dock: Path) -> None:
    async def work(one: Page, other: Page) -> None:
        await one.ask("run.type", line="order supervisor dock")
        await one.ask("run.rate", rate=2.0)
        await one.ask("run.go")
        await other.heard("run.state", going=True, rate=2.0)
        with pytest.raises(Refused, match="already"):
            await other.ask("run.type", line="step 5")
        assert (await other.ask("run.type", line="break supervisor.contact = true"))[
            "shown"
        ]  # between two cycles
        await one.socket.close()
        begun = other.events["run.state"]["tick"]
        await until(lambda: other.events["run.state"]["tick"] > begun + 5)
        await other.ask("run.pause")
        state = await other.heard("run.state", going=False)
        assert state["ended"].endswith("paused")
        tick = state["tick"]
        await asyncio.sleep(0.2)
        assert other.events["run.state"]["tick"] == tick

    studio(dock, work)


def test_a_run_waits_for_the_answer_to_the_order_just_given(dock: Path) -> None:
    """The order before stands reported as done until the level has seen the next one."""
    commands, done = opened(Opening(dock)), "report.status_report = done"
    for number, order in ((1, "undock"), (2, "stop"), (3, "undock")):
        commands.do(f"order supervisor {order}")
        commands.do(f"expect {done} and report.inc_command_echo = {number - 1}")
        begun = commands.session.system.tick
        commands.do(f"run until {done}")
        commands.do(f"expect {done} and report.inc_command_echo = {number}")
        assert commands.session.system.tick > begun
    commands.do("order supervisor stop")
    assert commands.do("run until report.inc_command_echo = 3 and " + done)[0].endswith("holds")
    commands.do("expect report.inc_command_echo = 3")  # what looks at the number knows what it asks
    commands.do(f"break {done}")
    assert "breakpoint 1" in commands.do("run 100")[0]  # of the new order alone it comes to hold
    commands.do("expect report.inc_command_echo = 4")


def test_variables_are_read_and_set_while_it_runs_and_the_log_has_what_was_set(dock: Path) -> None:
    async def work(one: Page, other: Page) -> None:
        for outside in ("log ../run.mcap", f"log {dock.parent / 'run.mcap'}"):
            assert (await shown(one, outside))[0].startswith("refused: the path of a log")
        assert (await shown(one, "log kept/run.mcap"))[0].startswith("every cycle from 1 on is written to")
        await one.ask("run.rate", rate=2.0)
        await one.ask("run.go")
        await other.heard("run.state", going=True)
        await until(lambda: other.events["run.state"]["tick"] > 5)
        assert await shown(other, "drive.waited = 77") == ["drive.waited = 77"]
        begun = other.events["run.state"]["tick"]
        await until(lambda: other.events["run.state"]["tick"] > begun + 5)
        assert await shown(one, "drive.waited ?") == ["drive.waited = 77"]
        assert other.events["run.state"]["going"]
        await other.ask("run.pause")
        assert (await shown(one, "log off"))[0].startswith("the log ends with cycle ")

    studio(dock, work)
    log = read(dock.parent / "kept" / "run.mcap")
    (told,) = log.level("drive").restarts
    assert told.tick > 6
    assert log.level("drive").set_by_hand(told) == {"waited": "77"}
    again = Replay(log, dock.parent / "generated", "python")
    assert again.unchanged
    assert again.first_difference() is None


def test_a_run_is_answered_where_it_ends_and_a_page_may_look_on_meanwhile(dock: Path) -> None:
    async def work(one: Page, other: Page) -> None:
        await one.ask("run.rate", rate=5.0)
        number = await one.send("run.type", line="run 50")
        await other.heard("run.state", going=True)
        assert (await other.ask("time.moment", tick=0))["tick"] == 0
        assert (await one.answer(number)) == {"shown": ["cycle 50"]}
        assert (await other.heard("run.state", going=False))["tick"] == 50
        number = await one.send("run.type", line="run until supervisor.contact = true")
        await other.heard("run.state", going=True)
        await other.ask("run.pause")
        assert (await one.answer(number))["shown"][0].endswith("paused")

    studio(dock, work)


def test_a_run_whose_system_goes_away_is_answered(dock: Path) -> None:
    async def work(one: Page, other: Page) -> None:
        await one.ask("run.rate", rate=0.1)
        number = await one.send("run.type", line="step drive 5000")
        await other.heard("run.state", going=True)
        assert (await other.ask("build.open"))["ok"]
        with pytest.raises(Refused, match="opened anew"):
            await one.answer(number)
        assert (await other.heard("run.state", going=False, tick=0))["open"]

    studio(dock, work)


def test_a_run_that_a_bug_ends_is_answered_and_runs_no_more(
    dock: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the page says so, instead of that it runs."""
    count = History.add

    def fails(history: History, system: System, ran: Any) -> None:
        if system.tick == 7:
            raise ZeroDivisionError
        count(history, system, ran)

    monkeypatch.setattr(History, "add", fails)

    async def work(one: Page, other: Page) -> None:
        number = await one.send("run.type", line="step 20")
        with pytest.raises(Refused, match="a bug in rcsc: ZeroDivisionError"):
            await one.answer(number)
        state = await other.heard("run.state", going=False, tick=7)
        assert "ZeroDivisionError" in state["ended"]
        await one.ask("run.type", line="step 2")

    studio(dock, work)


@pytest.mark.parametrize("where", ["compile", "open"])
def test_a_system_that_a_bug_keeps_from_being_opened_says_so(
    where: str, dock: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Instead of that it is being proved, for ever."""

    def fails(*_: Any) -> Any:
        raise ZeroDivisionError

    monkeypatch.setattr(
        *(
            ("rcsc.desk.studio.build.executor", fails)
            if where == "compile"
            else ("rcsc.desk.studio.runs.live.opened", fails)
        )
    )

    async def inside() -> None:
        async with page(server) as one:
            assert "ZeroDivisionError" in (await one.heard("said", wrong=True))["text"]
            await until(lambda: "ZeroDivisionError" in one.events.get("run.state", {}).get("text", ""))

    with serving(Opening(dock)) as server:
        asyncio.run(inside())


def test_a_log_that_is_none_is_told_to_every_page(dock: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"no log")

    async def work(one: Page, other: Page) -> None:
        for each in (one, other):
            assert "holds no run" in (await each.heard("said", wrong=True))["text"]

    studio(dock, work, logs=(broken,))


def test_bounds_and_values_are_told_to_the_last_digit(dock: Path, tmp_path: Path) -> None:
    """A number of JavaScript tells no two apart beyond 2^53."""
    shutil.copytree(dock.parent, tmp_path / "dock")
    most = 2**62 - 1
    file = tmp_path / "dock" / "drive.rcs"
    huge = f"state huge : int {-most} .. {most} = {most}\n"
    file.write_text(
        edited(file.read_text(), ("state new_command : bool\n", f"state new_command : bool\n{huge}"))
    )

    async def work(one: Page, _: Page) -> None:
        values = await one.ask("time.values", level="drive", tick=0)
        huge = next(each for each in values if each["name"] == "huge")
        assert (huge["text"], huge["range"]) == (str(most), f"{-most} .. {most}")

    studio(tmp_path / "dock" / "system.toml", work)


def test_a_clock_is_kept(dock: Path) -> None:
    """At real time cycles come no faster than the clock; on any machine they may come more slowly."""

    async def work(one: Page, _: Page) -> None:
        await one.ask("run.rate", rate=1.0)
        begun = asyncio.get_running_loop().time()
        await one.ask("run.type", line="run 26")
        assert asyncio.get_running_loop().time() - begun >= 25 * 0.04 - 0.001
        for rate in (0, -1, 1e9, 0.001):
            with pytest.raises(Refused):
                await one.ask("run.rate", rate=rate)
        assert (await one.ask("run.rate", rate=None))["rate"] is None

    studio(dock, work)


REFUSED: tuple[tuple[str, dict[str, Any]], ...] = (
    ("run.type", {}),
    ("run.type", {"line": 3}),
    ("run.type", {"line": "x" * 5000}),
    ("run.type", {"line": "quit"}),
    ("run.type", {"line": "clear"}),
    ("run.type", {"line": "reload nobody proved"}),
    ("run.type", {"line": "reload nobody # proved"}),
    ("run.rate", {"rate": "fast"}),
    ("time.moment", {}),
    ("time.moment", {"tick": -1}),
    ("time.moment", {"tick": 10**9}),
    ("time.moment", {"tick": 0.5}),
    ("time.values", {"tick": 0, "level": "nobody"}),
    ("time.why", {"tick": 0, "level": "drive"}),
    ("time.why", {"tick": 1, "level": "nobody"}),
    ("time.find", {"tick": 0, "text": "drive.speed_mm_s >"}),
    ("time.find", {"tick": 0, "text": "().__class__"}),
    ("time.find", {"tick": 0, "text": "9" * 5000}),
    ("time.find", {"tick": 0, "text": "drive.nothing = 3"}),
    ("time.tracks", {"era": "x", "since": -1}),
    ("log.open", {"name": "/etc/passwd"}),
    ("log.open", {"name": "../../etc/passwd"}),
    ("log.open", {}),
    ("build.nothing", {}),
)


def test_what_cannot_be_answered_is_refused_with_a_reason(dock: Path) -> None:
    async def work(one: Page, other: Page) -> None:
        await one.ask("run.type", line="step 2")
        for kind, body in REFUSED:
            with pytest.raises(Refused, match=r"\w{3}") as refused:
                await one.ask(kind, **body)
            assert refused.value.code != Code.INTERNAL.value, (kind, body)
        assert (await other.ask("run.type", line="step"))["shown"]

    studio(dock, work)


# --- the time line ---


def recorded(commands: Commands, lines: list[str]) -> History:
    history, live = History(), Live(Opening(Path()), lambda *_: None, lambda *_: None)
    system = commands.session.system
    history.begin(system)
    system.watch.append(history.add)
    live.history, live.commands = history, commands
    for line in lines:
        by_shell(commands, line)
        history.settle(system)
    return history


LINES = st.sampled_from(
    """
    step
    step 3
    step 7
    undo
    undo 2
    undo 4
    order supervisor dock
    order supervisor undock
    drive.bumper = true
    drive.bumper = false
    drive
    supervisor.preprocess
    drive.state_table
    restart drive
    restart supervisor anew
    freeze base.travelled
    thaw base.travelled
    """.split("\n    ")[1:-1]
)


@given(st.lists(LINES, max_size=14))
@settings(max_examples=25, deadline=None)
def test_what_is_kept_is_what_was(dock: Path, lines: list[str]) -> None:
    """After any commands every tick that is kept has the values of a system to which only what was not undone happened."""
    commands = opened(Opening(dock))
    history = recorded(commands, lines)
    system = commands.session.system
    assert (history.first, history.last) == (0, system.tick)
    for level in system.levels:
        kept = history.values(level.name, system.tick)[: len(level.sign.leaves)]
        assert kept == level.values[: len(level.sign.leaves)]
    now = history.era, history.values("drive", system.tick)
    history.settle(system)
    assert (history.era, history.values("drive", system.tick)) == now
    for tick in range(system.tick, -1, -1):
        if commands.session.kept == 0:
            break
        for box in moment(history, tick)["levels"]:
            assert box["table"]


def test_moments_are_those_of_a_log(dock: Path, tmp_path: Path) -> None:
    """Every tick that pages see of a run is the one that `rcsc log` sees of its log."""
    log = tmp_path / "day.mcap"
    assert rcsc(["run", str(dock.parent), "--log", str(log), "-q"]) == 0
    kept = read(log)
    seen = {tick.tick: tick for tick in frames(kept)}
    history = History([kept])
    for tick in itertools.islice(seen, 0, None, 7):
        for box, level in zip(seen[tick].boxes, moment(history, tick)["levels"], strict=True):
            assert level["level"] == box.level
            assert level["ran"] == box.ran
            assert not box.ran or (level["table"], tuple(level["lines"])) == (box.table, box.lines)

    async def work(one: Page, other: Page) -> None:
        state = await other.heard("time.state", source="log")
        assert (state["first"], state["last"]) == (kept.first, kept.last)
        tracks = await one.ask("time.tracks", era=-1, since=-1)
        for tick in itertools.islice(seen, 0, None, 11):
            for box in seen[tick].boxes:
                if box.ran:
                    stands = [change for change in tracks["levels"][box.level] if change[0] <= tick][-1]
                    assert stands[1:3] == [box.table, box.lines[0]], (tick, box.level)
        found = await one.ask("time.find", text="drive.travelled_mm > 100", tick=kept.first, back=False)
        values = await one.ask("time.values", level="drive", tick=found["tick"])
        before = await one.ask("time.values", level="drive", tick=found["tick"] - 1)
        assert [
            int(next(value["text"] for value in several if value["name"] == "travelled_mm")) > 100
            for several in (values, before)
        ] == [True, False]
        assert (
            await one.ask("time.find", text="drive.travelled_mm > 100", tick=found["tick"], back=True)
        ) == {"tick": None}
        for box in seen[kept.last].boxes:
            if box.ran:
                told = await one.ask("time.why", tick=kept.last, level=box.level)
                assert [line["line"] for line in told["tables"][-1]["lines"] if line["matches"]] == [
                    *box.lines
                ]
        await other.ask("time.live")
        assert await one.heard("time.state", source="live")

    studio(dock, work, logs=(log,))


def test_tracks_are_told_once_and_anew_after_undo(dock: Path) -> None:
    async def work(one: Page, _: Page) -> None:
        held: dict[str, list[list[Any]]] = {}
        era = since = -1
        for line in ("step 5", "order supervisor dock", "step 20", "undo 8", "step 3", "step 40"):
            await one.ask("run.type", line=line)
            news = await one.ask("time.tracks", era=era, since=since)
            if news["from"] < 0:
                held = {}
            for level, changes in news["levels"].items():
                held[level] = [*held.get(level, []), *changes]
            era, since = news["era"], news["to"]
        whole = (await one.ask("time.tracks", era=-1, since=-1))["levels"]
        assert held == whole
        for changes in whole.values():
            assert all(one[0] < then[0] and one[1:] != then[1:] for one, then in itertools.pairwise(changes))
        assert [mark["text"] for mark in news["marks"]] == ["order supervisor dock"]
        for line, left in (
            ("drive.bumper = true", 2),
            ("step", 2),
            ("undo", 2),
            ("undo", 1),
            ("undo 200", 1),
            ("undo 57", 0),
        ):
            await shown(one, line)
            assert len((await one.ask("time.tracks", era=-1, since=-1))["marks"]) == left, line

    studio(dock, work)


def test_a_requirement_that_every_run_watches_is_a_mark_where_it_is_broken(tmp_path: Path) -> None:
    """Live, after ticks were taken back, and in a log; a cycle that breaks one that is not monitored is found, not marked."""
    path = driven.dock(
        tmp_path / "dock",
        (
            "level drive {",
            "requirement near monitored : never travelled_mm > 20 [mm]\nrequirement at_home : always travelled_mm < 10 [mm]\nlevel drive {",
        ),
    )
    assert rcsc(["compile", str(path.parent)]) == 0

    async def marks(one: Page) -> list[tuple[int, str]]:
        every = (await one.ask("time.tracks", era=-1, since=-1))["marks"]
        return [(each["tick"], each["text"]) for each in every if each["kind"] == "finding"]

    async def work(one: Page, _: Page) -> None:
        for line in ("step 2", "order supervisor dock", "step 3"):
            await shown(one, line)
        with PROVER:  # the page is told while something else is proved
            assert await marks(one) == []
        await shown(one, "step 40")
        far = (await marks(one))[0]
        assert far[1].startswith("requirement `drive.near` is broken: `travelled_mm` = ")
        assert (await one.ask("time.find", text="not drive.near", tick=0, back=False)) == {"tick": far[0]}
        home = (await one.ask("time.find", text="not drive.at_home", tick=0, back=False))["tick"]
        assert home < far[0]
        await shown(one, f"undo {2 + 3 + 40 - far[0] + 1}")
        assert await marks(one) == []
        for line in ("log run.mcap", "step 2", "log off"):
            await shown(one, line)
        assert (await marks(one))[0] == far
        [name] = [each["name"] for each in await one.ask("log.list") if each["name"].endswith("run.mcap")]
        await one.ask("log.open", name=name)
        assert far in await marks(one)

    studio(path, work)


def test_why_says_of_each_line_what_the_interpreter_says(dock: Path) -> None:
    """In every cycle of a run exactly the line that ran matches, and of every other line the cell that is named is false."""
    commands = opened(Opening(dock))
    session = commands.session
    by_shell(commands, "order supervisor dock")
    ran = 0
    for _ in range(120):
        before = {level.name: level.values for level in session.levels}
        commands.do("step")
        for level in session.levels:
            began = {
                leaf.name: (level.values if leaf.kind == "input" else before[level.name])[at]
                for at, leaf in enumerate(level.sign.leaves)
            }
            tables = why(session.program(level), level.name, began)
            assert [(table.table, [one.line for one in table.lines if one.matches]) for table in tables] == [
                (table, [line] if line != _default(session.program(level), table) else [])
                for table, line in level.lines
            ]
            for table in tables:
                for one in table.lines:
                    assert one.matches == (one.failing == 0)
                    assert one.matches or (one.cell and one.values)
                    ran += 1
    assert ran > 500


def _default(program: Any, table: str) -> str | None:
    default = next(one for one in program.tables if one.name == table).default
    return None if default is None else default.name


def test_an_extern_procedure_is_not_called_to_look_at_a_cycle() -> None:
    """Its module is not even imported: there is none."""
    program = program_of(EXTERN)
    with pytest.raises(Refusal, match="extern procedure"):
        why(program, "top", initial(program))


OTHERWISE = (
    "| < command.target_mm  | < 2500 || tick             | 400 ",
    "| < command.target_mm  | < 2500 || tick             | 300 ",
)

UNKEPT = (
    "report.ref_command_echo := command.input_command",
    "report.ref_command_echo := stop",
)
"""What the supervisor assumes of the drive's report is not so any more; each table is proved all the same."""


async def speed(one: Page, tick: int) -> str:
    values = await one.ask("time.values", level="drive", tick=tick)
    return str(next(value["text"] for value in values if value["name"] == "speed_mm_s"))


def test_reload_is_gated_by_the_proof(dock: Path) -> None:
    """Tables that do not prove are not taken, the reason says which line; those that do and do otherwise say what."""
    source = dock.parent / "drive.rcs"
    text = source.read_text(encoding="utf-8")

    async def work(one: Page, other: Page) -> None:
        await one.ask("run.type", line="step 3")
        source.write_text(edited(text, ROW), encoding="utf-8")
        with pytest.raises(Refused, match="not proved") as refused:
            await one.ask("run.type", line="reload drive")
        assert refused.value.code == "RCS733"
        assert (await other.ask("run.type", line="step"))["shown"][0].startswith("cycle 4")
        source.write_text(f"# Speeds are of the wheels.\n{text}", encoding="utf-8")
        answer = await one.ask("run.type", line="reload drive # not proved")
        assert "`drive` runs its new tables from cycle 5 on" in answer["shown"][-1]
        assert (await other.ask("run.type", line="step"))["shown"][0].startswith("cycle 5")
        assert [
            level["tick"] for level in [await one.ask("time.moment", tick=tick) for tick in range(6)]
        ] == list(range(6))

    try:
        studio(dock, work)
    finally:
        source.write_text(text, encoding="utf-8")


def test_reload_takes_no_file_of_which_a_page_shows_another_text(dock: Path) -> None:
    """What the page proves is not on disk: neither it nor the text before it is taken, and the reason says so."""
    source = dock.parent / "drive.rcs"
    text = source.read_text(encoding="utf-8")

    async def work(one: Page, other: Page) -> None:
        await one.ask("run.type", line="step 3")
        files = [each["file"] for each in (await one.ask("tables.list"))]
        own, above = (
            next(each for each in files if each.endswith(name)) for name in ("drive.rcs", "supervisor.rcs")
        )
        for name in (own, above):
            opened = await other.ask("tables.open", file=name)
            edit = {"start_line": 0, "start_column": 0, "end_line": 0, "end_column": 0, "text": "# mine\n"}
            await other.ask("tables.edit", file=name, version=opened["version"], edits=[edit])
        for line in ("reload drive", "diff drive", "reload drive anyway"):
            with pytest.raises(Refused, match=r"drive\.rcs is changed here and not written") as refused:
                await one.ask("run.type", line=line)
            assert "write the file first" in refused.value.helps[0]
        await other.ask("tables.save", file=own)
        answer = await one.ask("run.type", line="reload drive")
        assert "`drive` runs its new tables from cycle 4 on" in answer["shown"][-1]

    try:
        studio(dock, work)
    finally:
        source.write_text(text, encoding="utf-8")


@pytest.fixture
def edit(dock: Path) -> Iterator[Callable[[tuple[str, str]], None]]:
    """Edits the drive's tables as they were, which are put back."""
    source = dock.parent / "drive.rcs"
    text = source.read_text(encoding="utf-8")

    def write(edit: tuple[str, str]) -> None:
        source.write_text(edited(text, edit), encoding="utf-8")

    yield write
    source.write_text(text, encoding="utf-8")


async def told(one: Page, line: str) -> tuple[str, list[str]]:
    """The code and the lines of what a line is answered; no code where it is done."""
    try:
        return "", (await one.ask("run.type", line=line))["shown"]
    except Refused as refused:
        return refused.code, str(refused).splitlines()


def test_reload_proved_has_the_levels_proved_together_first(
    dock: Path, edit: Callable[[tuple[str, str]], None]
) -> None:
    """What is proved of the levels together is said; what is not stays out, whatever else was said."""
    kept = f"level `drive` is proved together with its neighbours, as the files of {dock} stand"

    async def work(one: Page, other: Page) -> None:
        await one.ask("run.type", line="run 2")  # the beacon is seen
        await one.ask("run.type", line="order supervisor dock")
        await one.ask("run.type", line="run 18")
        edit(OTHERWISE)
        proving = asyncio.create_task(told(one, "reload drive proved"))
        await until(lambda: one.progress)
        assert (await told(other, "step"))[1][0].startswith("cycle 21")
        assert not proving.done(), "the levels waited for the proof"
        code, said = await proving
        assert code == Code.SHELL_OTHERWISE.value
        assert kept in said
        code, said = await told(one, "reload drive anyway PROVED # now")
        assert kept in said
        assert "  speed_mm_s: 400 -> 300" in said
        assert "`drive` runs its new tables" in said[-1]
        edit(UNKEPT)
        code, said = await told(one, "reload drive anyway proved")
        assert code == Code.SHELL_NOT_COMPOSED.value
        assert said[1] == "not proved: the report echoes the command that it answers: `report`"
        assert (await told(one, "reload drive"))[0] == Code.SHELL_NOT_COMPOSED.value

    studio(dock, work)


@pytest.mark.parametrize("line", ["diff drive", "reload drive anyway", "reload drive anyway proved"])
def test_tables_are_not_taken_where_nobody_waits_for_it(
    dock: Path, edit: Callable[[tuple[str, str]], None], line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cancelled at any question of the proof, or left by its page: the level keeps its tables, and the next line is done."""
    asked = []

    def slow(solver: Solver, *assuming: Term) -> Answer:
        asked.append(time.monotonic())
        time.sleep(0.02)
        return check(solver, *assuming)

    check = Solver.check

    async def begun(page: Page, questions: int) -> int:
        """Ask, and wait until a proof is so far."""
        asked.clear()
        page.progress.clear()
        number = await page.send("run.type", line=line)
        beside = line.endswith("proved")  # it asks nothing in this process
        await until(lambda: page.progress if beside else len(asked) >= questions)
        return number

    async def work(one: Page, other: Page) -> None:
        await one.ask("run.type", line="run 2")  # the beacon is seen
        await one.ask("run.type", line="order supervisor dock")
        await one.ask("run.type", line="run 18")
        edit(OTHERWISE)
        monkeypatch.setattr(Solver, "check", slow)
        for questions in (1, 40, 100):
            number = await begun(one, questions)
            await one.socket.send_json({"id": number, "cancel": True})
            assert await one.answer(number) == {"id": number, "cancelled": True}
            assert len(asked) < questions + 20
            assert (await told(other, "undo 99"))[1] == ["only 20 cycles can be undone"]
        await begun(other, 1)
        await other.socket.close()
        assert (await told(one, "undo 99"))[1] == ["only 20 cycles can be undone"]
        assert len(asked) < 20
        monkeypatch.undo()
        assert (await told(one, "diff drive"))[1][-1].startswith("`reload drive anyway` takes it")

    studio(dock, work)


def test_tables_that_are_not_proved_open_no_run_and_say_why(dock: Path, tmp_path: Path) -> None:
    """The studio opens all the same, names the finding, and runs as soon as the tables are mended."""
    folder = tmp_path / "dock"
    shutil.copytree(dock.parent, folder, ignore=shutil.ignore_patterns(".rcsc-cache"))
    source = folder / "drive.rcs"
    text = source.read_text(encoding="utf-8")
    source.write_text(edited(text, ROW), encoding="utf-8")

    async def inside() -> None:
        async with page(server) as one:
            state = await one.heard("build.state", ok=False)
            assert any(found["code"] == "RCS401" for found in state["findings"])
            await one.heard("run.state", open=False)
            await until(lambda: "not proved" in one.events["run.state"]["why"])
            with pytest.raises(Refused, match="not proved"):
                await one.ask("run.type", line="step")
            source.write_text(text, encoding="utf-8")
            assert (await one.ask("build.open"))["ok"]
            await one.heard("run.state", open=True)
            assert (await one.ask("run.type", line="step"))["shown"]

    with serving(Opening(folder / "system.toml")) as server:
        asyncio.run(inside())


def test_a_proof_that_is_cancelled_ends(dock: Path) -> None:
    async def work(one: Page, other: Page) -> None:
        number = await one.send("build.prove")
        await until(lambda: one.progress)
        assert "proving the levels" in one.progress[0]["text"]
        await other.ask("run.type", line="step 2")  # meanwhile the levels run
        await one.socket.send_json({"id": number, "cancel": True})
        assert (await one.answer(number)).get("cancelled")
        await other.heard("build.state", doing="")

    studio(dock, work)


def test_what_a_campaign_found_opens_as_a_run_that_says_what_it_breaks(
    dock_compiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the tick in which it broke; whatever else lies beside a log is no finding, and hides no log."""
    folder = tmp_path / "dock"
    shutil.copytree(dock_compiled, folder)
    base = folder / "base.py"
    text = base.read_text(encoding="utf-8").replace("import Fault, Range", "import Fault, Property, Range")
    wall = "\n    def stays_in_the_hall(self) -> Property:\n        return self.travelled < 0.5\n"
    base.write_text(text + wall, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert rcsc(["campaign", "dock", "--no-compile", "--workers", "1", "--episodes", "8"]) == 1
    kept, spoilt, *_ = sorted((tmp_path / "campaign").iterdir())
    facts = json.loads((kept / "finding.json").read_text())

    async def work(one: Page, other: Page) -> None:
        async def told() -> dict[str, str]:
            return {each["name"]: each["finding"] for each in await one.ask("log.list")}

        name, beside = (f"campaign/{each.name}/log.mcap" for each in (kept, spoilt))
        assert facts["property"] in (await told())[name]
        assert facts["said"] in (await told())[name]
        await one.ask("log.open", name=name)
        finding = (await other.heard("time.state", source="log", name=name))["finding"]
        assert (finding["tick"], finding["text"]) == (facts["tick"], (await told())[name])
        [mark] = (await one.ask("time.tracks", era=-1, since=-1))["marks"]
        assert (mark["tick"], mark["kind"]) == (facts["tick"], "finding")
        for odd in (
            "", "[]", "{", "null", "[" * 100_000,
            json.dumps(facts | {"tick": "0"}), json.dumps(facts | {"tick": True}), json.dumps(facts | {"said": None}),
        ):  # fmt: skip
            (spoilt / "finding.json").write_text(odd)
            assert (await told())[beside] == ""
            await one.ask("log.open", name=beside)
            assert (await other.heard("time.state", source="log", name=beside))["finding"] is None
            await one.ask("time.live")
            await other.heard("time.state", source="live")
        (spoilt / "finding.json").write_text(json.dumps(facts | {"tick": 10**9}))
        await one.ask("log.open", name=beside)
        assert (await other.heard("time.state", source="log", name=beside))["finding"] is None
        (spoilt / "log.mcap").write_bytes(b"none")
        (spoilt / "finding.json").unlink()
        assert (await told())[beside] == ""

    studio(folder / "system.toml", work)

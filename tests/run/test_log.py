"""Logs: the same bytes from every executor, readable after a kill, replayed exactly, asked, exported and drawn."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from mcap.reader import make_reader
from mcap.writer import Writer

from rcsc.front.commands.group import commands
from rcsc.run.adopt import Begun
from rcsc.run.description import BadDescription, Description, LevelSpec, Wire, description
from rcsc.run.levels import Query
from rcsc.run.log.export import coverage, csv_text, json_text
from rcsc.run.log.queries import BadCondition, predicate
from rcsc.run.log.read import Log, UnreadableLog, read
from rcsc.run.log.recorder import CHUNK_MS, Recorder
from rcsc.run.log.records import CHAIN, SEAL
from rcsc.run.log.replay import Replay, find
from rcsc.run.log.states import words
from rcsc.run.signature import Values
from rcsc.run.system import Kind, StateTableError, System, assemble
from tests.support.programs.stages import emitted, program_of

REPO = Path(__file__).parents[2]
TICKS = 130


class Fake:
    """Hand-made buffers: orders that follow each other, and reports that echo what was ordered."""

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        order = tick // 25 + 1
        given: dict[str, Values] = {"workstation.order": (order, 1 + order % 5, 1, 1, 2, 3, 4, 0)}
        given["hand.report"] = (tick * 0.5, 0.0)
        ordered = latest("primitive.to_robot")
        if ordered is not None:
            given["robot.report"] = (
                *ordered[:2],
                int(tick % 5 != 0),
                0,
                *(tick * 0.1 + at for at in range(9)),
            )
        return given


def queries() -> dict[str, Query]:
    def place(location: int) -> Values:
        return (True, False, False, location % 7, location % 3)

    def path(*_: object) -> Values:
        return (True, 1, 2, 3, 2)

    def target(*_: object) -> Values:
        return (True, 5, 6, 7)

    def part(_: int) -> Values:
        return (True, 40.0, 30.0, 0.0, 0.0, 0.0, 1.0)

    def point(number: int) -> Values:
        return (True, *(float(number + at) for at in range(9)), 100.0, 1000.0, 1000.0, 5.0)

    def fingers(*_: object) -> Values:
        return (True, 60.0, 70.0, 30.0, 2.0, 10.0, 50.0)

    return {"place": place, "path": path, "target": target, "part": part, "point": point, "fingers": fingers}


def system(kind: Kind, generated: Path | None = None) -> System:
    said: Description = description(REPO / "tables" / "system.toml")
    return assemble(
        said if generated is None else replace(said, generated=generated), kind, queries(), (Fake(),)
    )


def record(path: Path, kind: Kind, ticks: int = TICKS) -> bytes:
    running = system(kind)
    with Recorder(running, path) as recorder:
        running.watch.append(recorder)
        for _ in range(ticks):
            running.step()
    return path.read_bytes()


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    record(path, "python")
    return path


@pytest.fixture(scope="module")
def log(logged: Path) -> Log:
    return read(logged)


@pytest.fixture
def edited(tmp_path: Path) -> Path:
    """The generated folder, with the executors of level `gripper` changed in one procedure."""
    folder = tmp_path / "generated"
    shutil.copytree(REPO / "generated", folder)
    module = folder / "python" / "gripper.py"
    text = module.read_text(encoding="utf-8")
    procedure = "    s.to_primitive_opening_mm = s.hand_opening_mm + 0.0\n"
    assert procedure in text
    changed = text.replace(procedure, "    s.to_primitive_opening_mm = min(s.hand_opening_mm, 20.0)\n")
    module.write_text(changed, encoding="utf-8")
    return folder


def run(*args: object) -> Result:
    return CliRunner().invoke(commands, [str(arg) for arg in args], standalone_mode=False)


def test_the_executors_write_the_same_bytes(tmp_path: Path, logged: Path) -> None:
    again = record(tmp_path / "again.mcap", "c")
    assert again == logged.read_bytes()
    said = tmp_path / "again.json"
    said.write_text(json_text(read(tmp_path / "again.mcap")), encoding="utf-8")
    for path in (REPO, tmp_path):
        assert str(path).encode() not in again
        assert str(path) not in said.read_text(encoding="utf-8")


def test_everything_is_in_it(log: Log) -> None:
    assert log.complete
    assert (log.first, log.last, list(log.ticks)[:2]) == (0, TICKS, [1, 2])
    assert [level.name for level in log.levels] == ["task", "emove", "vision", "primitive", "gripper"]
    running = system("python")
    watched: list[tuple[int, str, Values]] = []
    running.watch.append(lambda s, ran: watched.extend((s.tick, one.name, one.values) for one in ran))
    for _ in range(TICKS):
        running.step()
    for tick, name, values in watched:
        assert log.level(name).track.latest(tick) == values
    assert set(log.buffers) == {"workstation.order", "robot.report", "hand.report", "camera.picture"}
    assert log.buffers["workstation.order"].latest(30) == (2, 3, 1, 1, 2, 3, 4, 0)
    assert log.buffers["camera.picture"].ticks == []
    assert log.level("task").sign == running.level("task").sign


def test_other_tools_read_it(logged: Path, log: Log) -> None:
    with logged.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = list(reader.iter_messages(topics=["/levels/gripper"]))
        assert {metadata.name for metadata in reader.iter_metadata()} == {
            "rcsc.system",
            "rcsc.programs",
            "rcsc.chain",
            "rcsc.seal",
        }
    schema, channel, message = found[-1]
    assert schema is not None
    assert (schema.encoding, channel.message_encoding) == ("ros1msg", "ros1")
    assert message.log_time == TICKS * 40 * 1_000_000
    assert len(found) == TICKS + 1
    fields = [row for row in schema.data.decode().splitlines() if "=" not in row.split("#")[0]]
    sizes = {"bool": 1, "uint8": 1, "int8": 1, "uint16": 2, "int16": 2, "int32": 4, "uint64": 8, "float64": 8}
    assert sum(sizes[row.split()[0]] for row in fields) == len(message.data)
    assert [row.split()[1] for row in fields][:1] == [log.level("gripper").sign.leaves[0].attribute]


@pytest.mark.parametrize("kind", ["c", "python"])
def test_replay_is_exact(log: Log, kind: Kind) -> None:
    again = Replay(log, REPO / "generated", kind)
    assert again.unchanged
    assert again.first_difference() is None


def test_it_steps_forwards_and_backwards_and_goes_anywhere(log: Log) -> None:
    again = Replay(log, REPO / "generated", "python")
    assert again.go(1).tick == 1
    late = again.go(100)
    assert not late.differs
    assert [cycle.level for cycle in late.cycles] == ["task", "emove", "vision", "primitive", "gripper"]
    assert again.go(99).tick == 99
    assert again.go(100) == late
    with pytest.raises(IndexError):
        again.go(TICKS + 1)
    with pytest.raises(IndexError):
        again.go(0)


def test_a_planted_difference_is_named(logged: Path) -> None:
    forged = read(logged)
    level = forged.level("task")
    at = level.sign.index["to_workstation.status_report"]
    values = list(level.track.layout.unpack(level.track.packed[77]))
    then = values[at]
    values[at] = 2 if then != 2 else 1
    level.track.packed[77] = level.track.layout.pack(*values)
    moment = Replay(forged, REPO / "generated", "python").first_difference()
    assert moment is not None
    assert moment.tick == 77
    [cycle] = [replayed for replayed in moment.cycles if replayed.differences]
    [difference] = cycle.differences
    members = level.sign.leaves[at].members
    assert (cycle.level, difference.name) == ("task", "to_workstation.status_report")
    assert (difference.then, difference.now) == (members[int(values[at])], members[int(then)])


def test_a_cut_log_loses_at_most_a_chunk(tmp_path: Path, logged: Path, log: Log) -> None:
    whole = logged.read_bytes()
    with logged.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    ends = [
        metadata_index.offset + metadata_index.length
        for metadata_index in summary.metadata_indexes
        if metadata_index.name == CHAIN
    ]
    assert len(ends) == 1 + -(-TICKS * 40 // CHUNK_MS)
    cut = tmp_path / "cut.mcap"
    edges = {end + step for end in ends for step in (-1, 0, 1)}
    for size in sorted(edges | set(range(ends[0], len(whole), 4999)) | {len(whole) - 1}):
        cut.write_bytes(whole[:size])
        if size < ends[0]:
            continue
        found = read(cut)
        done = sum(end <= size for end in ends) - 1
        assert found.last == min(done * CHUNK_MS // 40, TICKS)
        assert found.level("task").track.packed == log.level("task").track.packed[: found.last + 1]
        assert not found.complete


def test_what_is_no_log_is_said_to_be_none(tmp_path: Path, logged: Path) -> None:
    whole = logged.read_bytes()
    path = tmp_path / "bad.mcap"
    for content in (b"", b"\x89MCAP0\r\n", b"tick,task\n", whole[:500], os.urandom(4000)):
        path.write_bytes(content)
        with pytest.raises(UnreadableLog):
            read(path)
    for at in range(40, len(whole), 4001):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x5A]) + whole[at + 1 :])
        try:
            read(path)
        except UnreadableLog:
            continue
    result = run("log", path.parent / "none.mcap")
    assert result.exit_code == 1  # click's own words, by `rcsc` itself with exit status 2
    path.write_bytes(b"no log")
    result = run("log", path)
    assert result.return_value == 1
    assert "RCS701" in result.output


ENDLESS = """
import importlib.util, sys, time
spec = importlib.util.spec_from_file_location("test_log", sys.argv[1])
module = importlib.util.module_from_spec(spec)
sys.modules["test_log"] = module
spec.loader.exec_module(module)
running = module.system("python")
running.watch.append(module.Recorder(running, module.Path(sys.argv[2])))
while True:
    running.step()
    print(running.tick, flush=True)
    time.sleep(0.0005)
"""


def ticks_printed(process: subprocess.Popen[str], count: int) -> Iterator[int]:
    assert process.stdout is not None
    for _, line in zip(range(count), process.stdout, strict=False):
        yield int(line)


@pytest.mark.parametrize("count", [3, 90])
def test_a_kill_loses_at_most_a_chunk(tmp_path: Path, log: Log, count: int) -> None:
    path = tmp_path / "killed.mcap"
    process = subprocess.Popen(
        [sys.executable, "-c", ENDLESS, __file__, str(path)], stdout=subprocess.PIPE, text=True, cwd=REPO
    )
    try:
        done = max(ticks_printed(process, count))
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert process.stdout is not None
        process.stdout.close()
    found = read(path)
    assert not found.complete
    assert found.last >= done - CHUNK_MS // 40
    kept = min(found.last, TICKS)
    assert found.level("task").track.packed[: kept + 1] == log.level("task").track.packed[: kept + 1]
    if found.ticks:
        assert Replay(found, REPO / "generated", "python").first_difference() is None


def test_what_other_tables_would_have_done(log: Log, edited: Path, logged: Path) -> None:
    again = Replay(log, edited, "python")
    assert not again.unchanged
    moment = again.first_difference()
    assert moment is not None
    before = [again.go(tick).differs for tick in range(1, moment.tick)]
    assert not any(before)
    [cycle] = [replayed for replayed in moment.cycles if replayed.differences]
    assert cycle.level == "gripper"
    assert moment.tick == 43  # published in tick 42 (the 41st from 0), taken in the next
    assert [(difference.name, difference.then, difference.now) for difference in cycle.differences] == [
        ("to_primitive.opening_mm", "20.5", "20.0")
    ]
    result = run("replay", logged, "--executor", "python", "--generated", edited)
    assert result.return_value == 1
    assert "RCS703" in result.output
    assert f"cycle {moment.tick}, level `gripper`" in result.output
    assert "line" in result.output


def test_tables_with_other_lines_and_leaves(log: Log, edited: Path) -> None:
    """A signature that is not the recorded one: compared by name, and another line that leaves the same is none."""
    symbols = edited / "c" / "gripper.json"
    said = json.loads(symbols.read_text(encoding="utf-8"))
    for table in said["tables"]:
        table["lines"] = [f"new_{line}" for line in table["lines"]]
    report = next(one for one in said["leaves"] if one["name"] == "to_primitive.ref_command_echo")
    report["members"] = ["rest", *report["members"][1:]]
    symbols.write_text(json.dumps(said), encoding="utf-8")
    again = Replay(log, edited, "python")
    moment = again.first_difference()
    assert moment is not None
    assert moment.tick == 1
    [cycle] = [replayed for replayed in moment.cycles if replayed.differences]
    assert (cycle.line_then, cycle.line_now) == ("pause_gripper line 1", "pause_gripper line new_1")
    assert {(difference.name, difference.then, difference.now) for difference in cycle.differences} == {
        ("line", "1", "new_1"),
        ("to_primitive.ref_command_echo", "pause", "rest"),
    }
    report["members"][0] = "pause"
    symbols.write_text(json.dumps(said), encoding="utf-8")
    moment = Replay(log, edited, "python").first_difference()
    assert moment is not None
    assert moment.tick == 43


def test_what_other_tables_lack_is_named_and_not_said_to_be_the_same(tmp_path: Path, logged: Path) -> None:
    folder = tmp_path / "generated"
    shutil.copytree(REPO / "generated", folder)
    symbols = folder / "c" / "gripper.json"
    said = json.loads(symbols.read_text(encoding="utf-8"))
    next(one for one in said["leaves"] if one["name"] == "to_primitive.opening_mm")["name"] = (
        "to_primitive.width_mm"
    )
    symbols.write_text(json.dumps(said), encoding="utf-8")
    result = run("replay", logged, "--executor", "python", "--generated", folder)
    assert "nothing differs" not in result.output
    assert "nothing that these tables have differs" in result.output
    assert "not in these tables, and so not compared: gripper.to_primitive.opening_mm" in result.output
    assert "not in the log, and so not compared: gripper.to_primitive.width_mm" in result.output
    assert "not compared" not in run("replay", logged, "--executor", "python").output


def with_level(log: Log, name: str, **changed: Any) -> Log:
    """The log, with something of one level changed."""
    levels = (replace(level, **changed) if level.name == name else level for level in log.levels)
    return replace(log, levels=tuple(levels))


def test_a_bit_of_no_assumption_differs(logged: Path) -> None:
    """It has no word in which it could be told; its bytes are others all the same."""
    log = read(logged)
    packed = log.level("task").track.packed
    packed[20] = packed[20][:-1] + b"\x80"
    moment = Replay(log, REPO / "generated", "python").first_difference()
    assert moment is not None
    assert moment.tick == 20
    (difference,) = next(cycle for cycle in moment.cycles if cycle.level == "task").differences
    assert difference.name.startswith("assumptions_failed")
    assert difference.then != difference.now


def test_what_a_log_says_of_a_level_is_what_its_tables_are(log: Log) -> None:
    sign = log.level("task").sign
    forged = with_level(
        log, "task", sign=replace(sign, leaves=(*sign.leaves[:-1], replace(sign.leaves[-1], unit="kg")))
    )
    with pytest.raises(BadDescription, match="bears their digest"):
        Replay(forged, REPO / "generated", "python")


def test_a_log_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").mkdir()
    with pytest.raises(OSError, match=r"run\.mcap"):
        Recorder(system("python"), tmp_path / "run.mcap")
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


# --- restarts ---


def slower(folder: Path) -> Path:
    """The generated folder, beside a log, of tables whose VISION runs in every third tick."""
    generated = folder / "generated"
    if not generated.exists():
        shutil.copytree(REPO / "generated", generated)
        symbols = generated / "c" / "vision.json"
        text = symbols.read_text(encoding="utf-8")
        assert text.count('"period_ms": 40') == 1
        symbols.write_text(text.replace('"period_ms": 40', '"period_ms": 120'), encoding="utf-8")
    return generated


def restarted(path: Path, kind: Kind) -> Path:
    """A run in which levels are started again, each before the cycle with the number after."""
    running = system(kind, slower(path.parent))
    levels = {level.name: level for level in running.levels}
    checkpoints: dict[int, Values] = {}
    with Recorder(running, path) as recorder:
        running.watch.append(recorder)
        for tick in range(60):
            checkpoints[tick] = levels["gripper"].values
            if tick in (0, 31, 32):
                running.restart("task")
            if tick == 32:
                running.restart("emove")
                running.restart("emove")
            if tick == 20:
                running.restart("gripper")
                running.restart("gripper", checkpoints[11])  # the last is what counts
            if tick in (34, 35):  # no cycle of VISION's between
                running.restart("vision")
            running.step()
    return path


@pytest.fixture(scope="module")
def again_and_again(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return restarted(tmp_path_factory.mktemp("restarts") / "run.mcap", "python")


STARTED = {
    ("task", 1): Begun.ANEW, ("task", 32): Begun.ANEW, ("task", 33): Begun.ANEW, ("emove", 33): Begun.ANEW,
    ("gripper", 21): Begun.CHECKPOINT, ("vision", 37): Begun.ANEW,
}  # fmt: skip


@pytest.mark.parametrize("kind", ["c", "python"])
def test_restarts_are_recorded_and_replayed_exactly(again_and_again: Path, kind: Kind) -> None:
    again = Replay(read(again_and_again), slower(again_and_again.parent), kind)
    moments = list(again.moments())
    assert [moment.tick for moment in moments if moment.differs] == []
    began = {
        (cycle.level, moment.tick): cycle.restarted
        for moment in moments
        for cycle in moment.cycles
        if cycle.restarted is not None
    }
    assert began == STARTED
    assert not again.go(33).differs
    assert again.go(again.tick - 1).cycles[0].restarted is Begun.ANEW


@pytest.mark.parametrize(
    ("name", "at", "leaf"), [("task", 33, "cur_state"), ("gripper", 21, "to_primitive.opening_mm")]
)
def test_a_restart_that_leaves_what_none_does_differs(
    again_and_again: Path, name: str, at: int, leaf: str
) -> None:
    """Anew, and from a checkpoint: even where the cycle after it leaves the same."""
    log = read(again_and_again)
    level = log.level(name)
    place = level.sign.index[leaf]
    forged = tuple(
        replace(
            restart, values=(*restart.values[:place], restart.values[place] + 1, *restart.values[place + 1 :])
        )
        if restart.tick == at
        else restart
        for restart in level.restarts
    )
    again = Replay(with_level(log, name, restarts=forged), slower(again_and_again.parent), "python")
    told = [one.name for cycle in again.go(at).cycles if cycle.level == name for one in cycle.differences]
    assert leaf in told
    assert not again.go(at - 1).differs


def test_the_executors_record_the_same_restarts(tmp_path: Path, again_and_again: Path) -> None:
    assert restarted(tmp_path / "c.mcap", "c").read_bytes() == again_and_again.read_bytes()


def test_every_restart_is_in_the_log_and_said(again_and_again: Path) -> None:
    log = read(again_and_again)
    assert [(restart.tick, restart.begun) for restart in log.level("emove").restarts] == [
        (33, Begun.ANEW)
    ] * 2
    anew, gripper = log.level("gripper").restarts
    assert (anew.begun, gripper.begun) == (Begun.ANEW, Begun.CHECKPOINT)
    assert anew.values != gripper.values
    before = log.level("gripper").track.latest(11)
    assert before is not None
    assert gripper.values == before[: len(gripper.values)]
    said = json.loads(json_text(log))["restarts"]
    assert {"level": "gripper", "tick": 21, "from": "checkpoint"} in said
    assert len(said) == 9
    shown = run("log", again_and_again).output
    assert "started again before cycle 21: from the state that its last cycle left" in shown
    assert shown.count("started again") == 9
    args = ["--generated", slower(again_and_again.parent), "--executor", "python", "--at", 33]
    assert run("replay", again_and_again, *args).output.count("started again, anew") == 2


def without_restarts(path: Path, out: Path) -> None:
    """The log as it was written before restarts were recorded."""
    old = Writer(str(out))
    old.start(profile="rcsc", library="rcsc")
    with path.open("rb") as file:
        reader = make_reader(file)
        for metadata in reader.iter_metadata():
            if metadata.name not in {CHAIN, SEAL}:
                old.add_metadata(metadata.name, metadata.metadata)
        channels: dict[str, int] = {}
        for schema, channel, message in reader.iter_messages():
            if schema is None or channel.topic.startswith("/restarts/"):
                continue
            if channel.topic not in channels:
                number = old.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = old.register_channel(
                    channel.topic, channel.message_encoding, number, dict(channel.metadata)
                )
            old.add_message(
                channels[channel.topic], message.log_time, message.data, message.log_time, message.sequence
            )
    old.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped


def test_an_older_log_is_read_and_its_restarts_are_differences(tmp_path: Path, again_and_again: Path) -> None:
    old = tmp_path / "old.mcap"
    without_restarts(again_and_again, old)
    log = read(old)
    assert log.last == read(again_and_again).last
    assert all(level.restarts == () for level in log.levels)
    differing = {
        moment.tick for moment in Replay(log, REPO / "generated", "python").moments() if moment.differs
    }
    assert differing
    assert differing <= {tick for _, tick in STARTED}
    assert run("log", old).return_value == 0


def test_a_log_without_a_restart_has_no_channel_for_one(logged: Path) -> None:
    with logged.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert not any(channel.topic.startswith("/restarts/") for channel in summary.channels.values())


def test_a_restart_before_the_recording_begins_is_the_state_that_it_starts_from(tmp_path: Path) -> None:
    running = system("python")
    for _ in range(30):
        running.step()
    running.restart("task")
    with Recorder(running, tmp_path / "late.mcap") as recorder:
        running.watch.append(recorder)
        running.step()
        running.step()
    again = Replay(read(tmp_path / "late.mcap"), REPO / "generated", "python")
    assert again.first_difference() is None
    assert again.log.ticks == range(31, 33)


# --- one level alone, and executors that are not proved ---

GAPS = """
record order { number : int 0 .. 65535  width : int 0 .. 100 }
input command : order
input reported : int 0 .. 9
input force : real -2.0 .. 2.0 clamp
state seen : int 0 .. 65535
output sent : int 0 .. 9
assume calm monitored : reported < 9
procedure take { seen := command.number }
table orders assuming calm {
  | line | command.width | reported || procedures | sent |
  | few  | < 50          | < 5      || take       | 1    |
  | some | in {7, 60}    |          ||            | 2    |
  | many | > 60          |          ||            | 3    |
}
level lone { period 40 [ms] table orders }
"""
STEPS = ((1, 3), 2), ((2, 3), 3)


@pytest.mark.parametrize(
    ("order", "report", "said"),
    [
        ((3, 55), 9, "table orders: no line matches"),
        ((3, 7), 2, "table orders: several lines match"),
        ((3, 101), 2, "table orders: input refused, `command.width`"),
    ],
)
def test_a_run_of_a_level_alone_that_ends_in_a_fault_replays(
    tmp_path: Path, order: Values, report: int, said: str
) -> None:
    """As a finding of the prover is: executors of a program that is not proved, inputs that are given."""
    for name, text in emitted(program_of(GAPS)).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    wires = (Wire("over.order", "lone.command"), Wire("under.report", "lone.reported"))
    about = Description("finding", tmp_path, tmp_path, 40, (LevelSpec("lone", "case", ()),), wires)
    logs = []
    log = tmp_path / "finding.mcap"
    for kind in ("c", "python"):
        running = assemble(about, "c" if kind == "c" else "python", {})
        with Recorder(running, log) as recorder:
            running.watch.append(recorder)
            for given, reported in (*STEPS, (order, report)):
                running.buffers.publish("over.order", given)
                running.buffers.publish("under.report", (reported,))
                running.levels[0].executor.put(3, (1.5,))  # no buffer carries it
                if given == order:
                    with pytest.raises(StateTableError):
                        running.step()
                else:
                    running.step()
        logs.append(log.read_bytes())
    assert logs[0] == logs[1]
    for args in (["--executor", "c"], ["--executor", "python"]):
        whole = run("replay", log, "--generated", tmp_path, *args)
        assert whole.stdout.startswith("3 ticks replayed: nothing differs; sealed: all ")
    last = run("replay", log, "--generated", tmp_path, "--at", 3, "--show", "lone").output
    assert f"  lone: {said}\n" in last
    assert f"the last: {said}" in run("log", log).output
    assert find(read(log), predicate("lone.fault != none", read(log).levels)) == 3


def test_the_first_cycle_where_something_holds(log: Log) -> None:
    asked = {
        "task.workstation.inc_command == 2": 27,
        "task.workstation.inc_command = 2": 27,
        "TASK.Workstation.inc-command = 2": 27,
        "task.workstation.inc_command=2 and task.workstation.input_command /= move": 27,
        "task.workstation.inc_command >= 2 and not task.workstation.inc_command > 2": 27,
        "1 < task.workstation.inc_command < 3": 27,
        "primitive.from_robot.plate[1] == 1.1 or task.workstation.inc_command == 9": 4,
        "task.workstation.input_command == move": 2,
        "task.workstation.input_command = 'release'": 27,
        "gripper.fault /= none": None,
        "primitive.from[0] < -1e9": None,
    }
    for text, tick in asked.items():
        found = find(log, predicate(text, log.levels))
        if text.startswith("primitive.from_robot"):
            assert found is not None
        else:
            assert found == tick, text
    new = find(log, predicate("task.new_command", log.levels), 10)
    assert new is not None
    assert new >= 10
    track = log.level("task").track.latest(new)
    assert track is not None
    assert track[log.level("task").sign.index["new_command"]]


@pytest.mark.parametrize(
    "text",
    [
        "", "1 +", "task.nothing == 1", "task.cur_state", "task.cur_state == wrong", "task.cur_state < d_state",
        "task.cur_state == 1", "d_state == d_state", "__import__('os').system('true')", "task.cur_state is d_state",
        "(lambda: 1)() == 1", "task.workstation.inc_command + 1 == 2", "task['x'] == 1", "x.y.z", "[1] == [1]",
        "(" * 500, "task.new_command = = true", "task.new_command := true", "= 1", "task.workstation.input_command = 'a=b'",
        "not " * 2_000 + "task.new_command",
    ],
)  # fmt: skip
def test_a_question_that_cannot_be_asked(log: Log, text: str) -> None:
    with pytest.raises(BadCondition):
        predicate(text, log.levels)


def test_the_exports_say_what_the_log_says(log: Log) -> None:
    table = list(csv.DictReader(csv_text(log).splitlines()))
    document = json.loads(json_text(log))
    assert len(table) == len(document["cycles"]) == TICKS
    for row, cycle in zip(table, document["cycles"], strict=True):
        assert int(row["tick"]) == cycle["tick"]
        for level in log.levels:
            values = level.track.latest(cycle["tick"])
            assert values is not None
            said = words(level.sign, level.level, values)
            shown = {name: row[f"{level.name}.{name}"] for name in said}
            set_ = {name for name, text in shown.items() if text or not said[name]}
            assert {name: shown[name] for name in set_} == {name: said[name] for name in set_}
            unset = said.keys() - set_  # `tests/shown` says which these are
            assert all(level.sign.leaves[level.sign.index[name]].c_type != "bool" for name in unset)
            assert cycle["levels"][level.name]["line"] == said["line"]
    assert document["cycles"][29]["buffers"]["workstation.order"] == [2, 3, 1, 1, 2, 3, 4, 0]


def test_lines_are_counted(log: Log) -> None:
    found = coverage(log)
    of_task = [one for one in found if one.level == "task"]
    assert sum(sum(one.lines.values()) for one in of_task) == TICKS
    acquire = next(one for one in of_task if one.table == "acquire")
    assert acquire.lines.keys() == set(log.level("task").sign.tables["acquire"])
    assert set(acquire.never) == {line for line, count in acquire.lines.items() if count == 0}


def test_the_command_that_shows_a_log(tmp_path: Path, logged: Path) -> None:
    shown = run("log", logged)
    assert shown.return_value == 0
    assert f"{TICKS} ticks of 40 ms" in shown.output
    assert "never" in shown.output
    outs = [tmp_path / f"run.{end}" for end in ("csv", "json")]
    assert run("log", logged, "--csv", outs[0], "--json", outs[1]).return_value == 0
    assert all(out.stat().st_size > 1000 for out in outs)
    plot = ["--plot", "task.cur_state"]
    for args in (plot, ["-o", "x.svg"], [*plot, "-o", tmp_path / "x.txt"]):
        assert run("log", logged, *args).exit_code != 0


def test_the_command_that_replays_a_log(tmp_path: Path, logged: Path) -> None:
    def replayed(*args: object) -> Result:
        return run("replay", logged, "--generated", REPO / "generated", "--executor", "python", *args)

    whole, sealed = replayed(), f"sealed: all {logged.stat().st_size} bytes are as they were recorded"
    assert (
        whole.stderr
        == f"note: the executors in `{REPO / 'generated'}` run as they lie there, held against no tables\n"
    )
    assert (whole.return_value, whole.stdout) == (
        0,
        f"{TICKS} ticks replayed: nothing differs; {sealed}\n",
    )
    moment = replayed("--at", 30, "--show", "gripper")
    assert moment.return_value == 0
    assert "gripper: " in moment.output
    assert "    primitive.opening_mm = " in moment.output
    assert replayed("--find", "task.workstation.inc_command == 2").stdout.startswith("cycle 27, ")
    assert replayed("--find", "task.fault == none and false").return_value == 1
    assert replayed("--find", "task.nothing").exit_code != 0
    assert replayed("--at", TICKS + 1).exit_code != 0
    missing = run("replay", logged, "--generated", tmp_path / "none")
    assert missing.return_value == 1
    assert "RCS704" in missing.output


def test_a_planted_difference_by_the_command(
    tmp_path: Path, logged: Path, edited: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same tables, an executor that does otherwise: that is a finding of its own."""
    monkeypatch.setattr("rcsc.run.log.replay.fingerprints", lambda _: dict(read(logged).programs))
    result = run("replay", logged, "--generated", edited, "--executor", "python")
    assert result.return_value == 1
    assert "RCS702" in result.output
    assert tmp_path.exists()


def test_pictures(tmp_path: Path, logged: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "run.svg"
    names = "task.cur_state,primitive.from_robot.plate[0],task.line,task.new_command"
    assert run("log", logged, "--plot", names, "-o", out).return_value == 0
    first = out.read_bytes()
    assert b"<svg" in first
    assert run("log", logged, "--plot", names, "-o", out).return_value == 0
    assert out.read_bytes() == first
    across = tmp_path / "xy.png"
    xy = [
        "--plot",
        "primitive.from_robot.plate[1]",
        "--against",
        "primitive.from_robot.plate[0]",
        "-o",
        across,
    ]
    assert run("log", logged, *xy).return_value == 0
    assert across.read_bytes()[1:4] == b"PNG"
    assert run("log", logged, "--plot", "task.nothing", "-o", out).exit_code != 0
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    missing = CliRunner().invoke(commands, ["log", str(logged), "--plot", names, "-o", str(out)])
    assert missing.exit_code == 1
    assert "RCS705" in missing.output
    assert "rcsc[plot]" in missing.output


def test_parquet(tmp_path: Path, logged: Path, log: Log) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "run.parquet"
    assert run("log", logged, "--parquet", out).return_value == 0
    table = parquet.read_table(out)
    assert table.num_rows == TICKS
    at = log.level("primitive").sign.index["from_robot.plate[0]"]
    track = log.level("primitive").track
    assert table["primitive.from_robot.plate[0]"].to_pylist() == [
        None if tick <= 2 else values[at] for tick, values in track if tick in log.ticks
    ]
    assert table["task.cur_state"].to_pylist()[-1] in {"d_state", "f_state"} | {
        f"state_{n}" for n in range(2, 9)
    }


def test_recording_takes_few_steps(tmp_path: Path) -> None:
    """Of a tick whose values stand still: a number of calls, which is the same on every machine."""
    running = system("python")
    calls = 0

    def count(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event in {"call", "c_call"}

    with Recorder(running, tmp_path / "run.mcap") as recorder:
        running.step()
        recorder(running, running.levels)
        before = sys.getprofile()
        sys.setprofile(count)
        for _ in range(20):
            recorder(running, running.levels)
        sys.setprofile(before)
    assert calls / 20 < 2_000

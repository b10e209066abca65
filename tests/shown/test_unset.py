"""A number that nobody has set is a gap: what is called so, against executors that keep account of what they write."""

import csv
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from rcsc.base.host.files.names import BadName
from rcsc.base.host.files.read import CheckedFields, Malformed, json_of
from rcsc.desk.studio.runs.history import Gaps
from rcsc.desk.studio.share.film import with_ticks
from rcsc.front.commands import run
from rcsc.run.adopt import Begun
from rcsc.run.description import Description, LevelSpec, Wire
from rcsc.run.executors import PythonExecutor
from rcsc.run.log.export import _series, csv_text, json_text, unset
from rcsc.run.log.read import Log, read
from rcsc.run.log.recorder import Recorder
from rcsc.run.log.schema import signature_from, signature_text
from rcsc.run.orders.operator import ScriptedRun
from rcsc.run.signature import Leaf, signature_of
from rcsc.run.system import System, assemble
from rcsc.views.pages.log_page import drawn_first
from rcsc.views.pages.report import page
from rcsc.views.pages.witness import RunWitness
from tests.run.test_log import REPO, restarted, system
from tests.support.films import film_of, unset_in
from tests.support.programs.stages import emitted, program_of

POSE = "primitive.from_robot.plate[0]"


@dataclass
class Account:
    """Which leaves each level's Python executor has written, of itself, and which inputs had a source that had."""

    running: System
    written: dict[str, set[str]] = field(default_factory=dict)
    given: dict[str, frozenset[str]] = field(default_factory=dict)
    published: set[str] = field(default_factory=set)
    begun: set[str] = field(default_factory=set)
    claimed: int = 0

    def __post_init__(self) -> None:
        for level in self.running.levels:
            assert isinstance(level.executor, PythonExecutor)
            names = self.written.setdefault(level.name, set())
            self._spy(level.executor, {leaf.attribute: leaf.name for leaf in level.sign.leaves}, names)

    def _spy(self, executor: PythonExecutor, names: Mapping[str, str], written: set[str]) -> None:
        state, cycle, on = executor._state, executor._cycle, [False]

        def note(held: object, attribute: str, value: object) -> None:
            if on[0] and attribute in names:
                written.add(names[attribute])
            object.__setattr__(held, attribute, value)

        def spied(held: object) -> int:
            on[0] = True
            try:
                fault: int = cycle(held)
                return fault
            finally:
                on[0] = False

        state.__class__ = type("Spied", (type(state),), {"__setattr__": note, "__slots__": ()})
        executor._cycle = spied

    def check(self, unset_now: Mapping[str, frozenset[int]], ran: tuple[str, ...]) -> None:
        """Hold what is called unset after a tick against the account."""
        self.begun |= set(ran)
        for level in self.running.levels:
            for at in unset_now[level.name]:
                leaf = level.sign.leaves[at]
                assert not leaf.members, leaf
                assert leaf.c_type != "bool"
                assert level.values[at] == leaf.initial
                assert not self._may_be_set(level.name, leaf), f"{level.name}.{leaf.name} was set"
                self.claimed += 1
        for level in self.running.levels:
            if level.name in ran:
                self.given[level.name] = frozenset(self.written[level.name])
        latest = self.running.buffers.latest
        self.published = {
            wire.source for wire in self.running.description.wires if latest(wire.source) is not None
        }

    def _may_be_set(self, level: str, leaf: Leaf) -> bool:
        if leaf.kind != "input":
            deferred = (
                f"{leaf.name}.next" in self.running.level(level).sign.index
            )  # it takes what was written there
            return (f"{leaf.name}.next" if deferred else leaf.name) in self.written[level]
        spec = next(spec for spec in self.running.description.levels if spec.name == level)
        if any(leaf.name.startswith((f"{feed.into}.", f"{feed.into}[")) for feed in spec.feeds):
            return level in self.begun
        for wire in self.running.description.wires:
            owner, _, variable = wire.target.partition(".")
            if owner == level and re.match(rf"{re.escape(variable)}(?![a-z0-9_])", leaf.name):
                source, _, other = wire.source.partition(".")
                if source not in self.written:
                    return wire.source in self.published
                return other + leaf.name.removeprefix(variable) in self.given.get(source, ())
        return False


class Watched:
    """What nobody has set in a system that runs."""

    def __init__(self, running: System) -> None:
        self.running, self.gaps = running, Gaps()
        self.gaps.begin(running)
        running.watch.append(self.gaps.add)

    @property
    def now(self) -> dict[str, frozenset[int]]:
        """The places by level."""
        names = self.gaps.names[-1]
        return {
            level.name: frozenset(map(level.sign.index.__getitem__, names[level.name]))
            for level in self.running.levels
            if level.name in names
        }


def followed(running: System, ticks: int, each: Callable[[Watched], None]) -> None:
    watched = Watched(running)
    for _ in range(ticks):
        running.step()
        each(watched)


def test_nothing_is_called_unset_that_was_written_and_what_was_not_is() -> None:
    running = system("python")
    account = Account(running)
    lasting: dict[str, int] = {}

    def each(watched: Watched) -> None:
        account.check(watched.now, tuple(level.name for level in running.levels))
        for level in running.levels:
            for leaf in (level.sign.leaves[at] for at in watched.now[level.name]):
                lasting[f"{level.name}.{leaf.name}"] = running.tick
        if running.tick == 1:
            primitive = running.level("primitive").sign.index
            surely = {
                primitive[name] for name in ("to_robot.plate[0]", "travelled_mm", "from_robot.plate[8]")
            }
            assert surely <= watched.now["primitive"], "no line can have written them"

    followed(running, 130, each)
    assert account.claimed > 1000
    assert lasting[POSE] > 1
    assert lasting["primitive.from_robot.plate[0]"] >= 1
    assert not any(name.startswith(("task.cur_state", "primitive.goal")) for name in lasting)


def test_the_log_says_the_same_as_who_watches(tmp_path: Path) -> None:
    for kind in ("python", "c"):
        running = system("c" if kind == "c" else "python")
        seen: list[dict[str, frozenset[int]]] = []
        with Recorder(running, tmp_path / "run.mcap") as recorder:
            running.watch.append(recorder)
            followed(running, 60, lambda watched, seen=seen: seen.append(watched.now))  # type: ignore[misc]  # bound at once
        assert [dict(now) for now in unset(read(tmp_path / "run.mcap"))] == seen
        assert any(seen[0].values())


def test_a_level_that_begins_anew_has_its_gaps_again_and_who_takes_from_it_too(tmp_path: Path) -> None:
    log = read(restarted(tmp_path / "run.mcap", "python"))
    anew = {
        (level.name, one.tick) for level in log.levels for one in level.restarts if one.begun is Begun.ANEW
    }
    assert anew
    account: dict[tuple[str, int], int] = {}
    for tick, now in zip(log.ticks, unset(log), strict=True):
        for level in log.levels:
            values = level.track.latest(tick)
            assert values is not None
            for at in now[level.name]:
                assert values[at] == level.sign.leaves[at].initial
                account[level.name, tick] = account.get((level.name, tick), 0) + 1
    assert account["task", 32] > account.get(("task", 31), 0)
    assert account["emove", 33] > account.get(("emove", 32), 0)
    by_tick = dict(zip(log.ticks, unset(log), strict=True))
    assert _again(log, by_tick) > 0
    for level in log.levels:
        adopted = {level.sign.leaves[at].name for at in level.sign.restart}
        for restart in (one for one in level.restarts if one.begun is Begun.ANEW):
            next_cycle = next(tick for tick in level.track.ticks if tick >= restart.tick and tick > log.first)
            assert not adopted & {level.sign.leaves[at].name for at in by_tick[next_cycle][level.name]}


def _again(log: Log, by_tick: Mapping[int, Mapping[str, frozenset[int]]]) -> int:
    """How often an input was unset again after it had been set, as what fills it began anew; each is unset as long as that is."""
    levels, had, again = {level.name: level for level in log.levels}, set[tuple[str, int]](), 0
    for wire in log.system().wires:
        (source, _, given), (target, _, taken) = wire.source.partition("."), wire.target.partition(".")
        if source not in levels or target not in levels:
            continue
        sign = levels[target].sign
        numbers = {sign.index[name] for group in sign.unset for name in group.leaves}
        for at, other in zip(sign.record(taken), levels[source].sign.record(given), strict=True):
            for tick in sorted(set(levels[target].track.ticks) & set(log.ticks)):
                before = [ran for ran in levels[source].track.ticks if log.first < ran < tick]
                values = levels[target].track.latest(tick)
                assert values is not None
                as_first = values[at] == sign.leaves[at].initial
                if at in numbers and before and as_first:
                    assert (at in by_tick[tick][target]) == (other in by_tick[before[-1]][source])
                if at not in by_tick[tick][target]:
                    had.add((target, at))
                again += at in by_tick[tick][target] and (target, at) in had
    return again


def test_exports_and_plots_have_gaps_where_nothing_was_set(tmp_path: Path) -> None:
    running = system("python")
    with Recorder(running, tmp_path / "run.mcap") as recorder:
        running.watch.append(recorder)
        for _ in range(40):
            running.step()
    log = read(tmp_path / "run.mcap")
    missing = list(unset(log))
    table = list(csv.DictReader(csv_text(log).splitlines()))
    document = json.loads(json_text(log))["cycles"]
    parquet = pytest.importorskip("pyarrow.parquet")
    assert run(["log", str(tmp_path / "run.mcap"), "--parquet", str(tmp_path / "run.parquet")]) == 0
    columns = parquet.read_table(tmp_path / "run.parquet")
    gaps = 0
    for level in log.levels:
        for at, leaf in enumerate(level.sign.leaves):
            name = f"{level.name}.{leaf.name}"
            wanted = [at in now[level.name] for now in missing]
            assert [row[name] == "" for row in table] == wanted
            assert [cycle["levels"][level.name][leaf.name] is None for cycle in document] == wanted
            assert [value is None for value in columns[name].to_pylist()] == wanted
            gaps += sum(wanted)
    assert gaps > 100
    [series] = _series(log, [POSE])
    at = log.level("primitive").sign.index["from_robot.plate[0]"]
    assert [math.isnan(value) for value in series.values] == [at in now["primitive"] for now in missing]
    assert not math.isnan(series.values[-1])
    assert min(value for value in series.values if not math.isnan(value)) > -4000


def test_the_report_has_a_gap_where_nobody_has_set_a_variable(tmp_path: Path) -> None:
    running = system("python")
    running.description = replace(running.description, displays={"pose": (POSE,)})
    watched, witness = Watched(running), RunWitness(ScriptedRun(running, None))
    level = running.level("primitive")
    at, missing = level.sign.index[POSE.partition(".")[2]], list[bool]()
    running.watch.append(lambda *_: missing.append(at in watched.now.get(level.name, ())))
    recorder = Recorder(running, tmp_path / "run.mcap")
    running.watch.append(recorder)
    for _ in range(60):
        running.step()
    recorder.close()
    log = read(tmp_path / "run.mcap")
    drawn = drawn_first(log, running.description.displays)
    film = film_of(page(with_ticks(witness.story("pose", 1.0), log, drawn)))
    assert film["shown"] == [POSE]
    unset = [unset_in(film, POSE, tick) for tick in range(61)]
    assert unset == [True, *missing]
    assert unset[:2] == [True, True]
    assert not unset[-1]


def test_a_log_that_begins_within_a_run_or_does_not_say_has_no_gaps(tmp_path: Path) -> None:
    running = system("python")
    running.step()
    with Recorder(running, tmp_path / "late.mcap") as recorder:
        running.watch.append(recorder)
        for _ in range(5):
            running.step()
    assert [dict(now) for now in unset(read(tmp_path / "late.mcap"))] == [{}] * 5
    assert Watched(running).now == {}
    running = system("python")
    for level in running.levels:
        level.sign = replace(level.sign, unset=())
    with Recorder(running, tmp_path / "old.mcap") as recorder:
        running.watch.append(recorder)
        for _ in range(5):
            running.step()
    assert '"unset"' not in signature_text(running.levels[0].sign)
    assert not any(any(now.values()) for now in unset(read(tmp_path / "old.mcap")))


KINDS = """\
enum walk { low, high }
input go : walk
input far : int -5 .. 5
input near : int -5 .. 5 = -5
state kept : int -5 .. 5
state meant : int -5 .. 5 = -5
state later : int -5 .. 5 deferred until near = 0
state many : array[3] of real -5.0 .. 5.0
state sometimes : real -5.0 .. 5.0
state always : int -5 .. 5
state never : int -5 .. 5
state word : walk
state flag : bool
output out : int -5 .. 5
procedure least {
  out := -5
}
procedure perhaps {
  if near > 3 { sometimes := -5.0 }
  for i in 0 .. 1 { many[i] := -5.0 }
}
procedure plan {
  perhaps
  next later := 2
}
procedure each {
  always := -5
  word := high
}
table t {
  | line | near   || procedures                        | kept |
  | a    | < 0    ||                                   |      |
  | b    | 0      || least                             | -5   |
  | c    | 1 .. 2 || plan                              |      |
  | d    | > 2    || perhaps                           | 4    |
}
level solo { period 40 [ms] preprocess each table t }
"""


def kinds(folder: Path) -> System:
    for name, text in emitted(program_of(KINDS)).items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    wires = (Wire("there.far", "solo.far"), Wire("there.near", "solo.near"))
    about = Description("kinds", folder, folder, 40, (LevelSpec("solo", "case", ()),), wires)
    return assemble(about, "python", {})


@pytest.fixture
def solo(tmp_path: Path) -> System:
    return kinds(tmp_path)


def gone(running: System, *nears: int) -> Iterator[set[str]]:
    """What is unset after each tick, in which `near` is this."""
    account, watched = Account(running), Watched(running)
    for near in nears:
        running.buffers.publish("there.near", (near,))
        running.step()
        account.check(watched.now, ("solo",))
        yield {running.levels[0].sign.leaves[at].name for at in watched.now["solo"]}


def test_each_kind_of_writer(solo: System) -> None:
    first = {"far", "kept", "later", "many[0]", "many[1]", "many[2]", "sometimes", "never", "out"}
    lines = list(gone(solo, -1, 0, 1, 0, 3))
    assert lines[0] == first, "what is declared, a word, a bool, and what each cycle writes is set"
    assert lines[1] == first - {"kept", "out"}, "by a line that writes just what it had"
    assert lines[2] == lines[1] - {"many[0]", "many[1]", "many[2]", "sometimes", "later"}, (
        "perhaps written is not surely unset"
    )
    assert lines[4] == {"far", "never"}


def test_an_input_is_set_in_the_cycle_after_it_was_published(solo: System) -> None:
    ticks = gone(solo, -1, -1, -1, -1)
    assert "far" in next(ticks)
    solo.buffers.publish("there.far", (0,))
    assert "far" in next(ticks), (
        "it was published before this cycle, but that was not told at the end of the last"
    )
    assert "far" not in next(ticks)


def test_a_value_that_is_put_by_hand_is_set(solo: System) -> None:
    ticks = gone(solo, -1, -1)
    assert "never" in next(ticks)
    level = solo.levels[0]
    level.executor.put(level.sign.index["never"], (3,))
    assert "never" not in next(ticks)


@pytest.mark.parametrize(
    "wrong",
    [
        {"leaves": ["kept", 3]}, {"leaves": "kept"}, {"tables": {}}, {"leaves": [], "tables": []},
        {"leaves": ["kept"], "tables": {"t": [1]}}, {"leaves": ["kept"], "tables": {"../t": ["a"]}}, {"leaves": ["kept"], "levels": [None]},
    ],
)  # fmt: skip
def test_a_file_of_somebody_else_is_read_as_what_it_must_be(solo: System, wrong: dict[str, Any]) -> None:
    said = json_of(signature_text(solo.levels[0].sign))
    assert signature_from(json.dumps(said)) == solo.levels[0].sign
    said["unset"] = [wrong]
    with pytest.raises((Malformed, BadName)):
        signature_of(CheckedFields(said))


def test_every_symbol_file_that_is_shipped_says_it() -> None:
    for path in sorted((REPO / "generated/c").glob("*.json")):
        leaves = json.loads(path.read_text(encoding="utf-8"))
        named = [name for group in leaves["unset"] for name in group["leaves"]]
        assert len(named) == len(set(named))
        assert set(named) <= {
            leaf["name"] for leaf in leaves["leaves"] if "members" not in leaf and leaf["c_type"] != "bool"
        }

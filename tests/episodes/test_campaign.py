"""Campaigns: the same outcomes with any worker pool, kills survived on both sides, journals, shrinking, counterexamples, the command."""

import copy
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.front import commands as cli
from rcsc.front.commands.group import commands
from rcsc.run.campaign import worker_pool as crew_module
from rcsc.run.campaign.counterexamples import (
    BadEpisode,
    Choice,
    again,
    choices,
    counterexamples,
    is_saved,
    save,
    saved_episode,
)
from rcsc.run.campaign.journal import BadJournal, EpisodeRecord, Journal, header, journal_path
from rcsc.run.campaign.rig import Rig, digest, episode_seed, known_lines, mask
from rcsc.run.campaign.runner import campaign
from rcsc.run.campaign.shrink import shrink
from rcsc.run.campaign.summary import as_json, as_text, summary
from rcsc.run.campaign.work import OtherTables, play
from rcsc.run.campaign.worker_pool import WorkerPool, WorkersGone, pool_of, processes
from rcsc.run.episodes.episode import BufferFault, Restart
from rcsc.run.episodes.outcome import EpisodeFinding
from rcsc_cell.episodes.episode import (
    FAULTS,
    SYSTEM,
    Episode,
    Interruption,
    PartSpec,
    Push,
    SwitchTo,
)
from rcsc_cell.episodes.kind import CELL
from rcsc_cell.workstation.script import read_script
from tests.support import played as fake

PLAIN = Rig(CELL, SYSTEM, "kinematic")


def playing(rig: Rig[Episode], **functions: Any) -> Rig[Episode]:
    """The rig with other functions of its kind."""
    return replace(rig, kind=replace(rig.kind, **functions))


CALM = playing(PLAIN, draw=fake.calm, loop=fake.Play)


@contextmanager
def threads(count: int) -> Iterator[WorkerPool]:
    with ThreadPoolExecutor(count) as pool:
        yield WorkerPool(pool, count)


def played(
    rig: Rig[Episode], count: int, pool: WorkerPool, path: Path, seed: int = 5
) -> dict[int, EpisodeRecord]:
    with Journal(path, header(rig, seed)) as journal:
        for _ in campaign(rig, seed, count, pool, journal):
            pass
        return dict(journal.records)


def alone(rig: Rig[Episode], count: int, seed: int = 5) -> dict[int, EpisodeRecord]:
    """The records without any worker pool."""
    return {record.index: record for record in play(rig, digest(rig), seed, range(count))}


# --- the same with any worker pool ---


@pytest.mark.parametrize("workers", [1, 3, 64])
def test_records_do_not_depend_on_the_crew(workers: int, tmp_path: Path) -> None:
    with threads(workers) as pool:
        assert played(CALM, 150, pool, tmp_path / "j") == alone(CALM, 150)


def test_a_cluster_plays_as_threads_do(tmp_path: Path) -> None:
    from distributed import Client, LocalCluster

    rig = replace(playing(CALM, draw=fake.endless), limit_s=0.2)
    with (
        LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        pool = pool_of(client)
        assert pool.workers == 2
        found = played(rig, 40, pool, tmp_path / "j")
    assert found == alone(rig, 40)  # in threads what hangs is stopped otherwise than in a main thread
    assert {record.end for record in found.values()} == {"done", "failed:part_lost", "hang"}


def test_episodes_of_neighbouring_seeds_have_nothing_in_common() -> None:
    seeds = [episode_seed(seed, index) for seed in range(-3, 30) for index in range(100)]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < 2**63 for seed in seeds)
    assert episode_seed(1, 11) != episode_seed(11, 1)


# --- workers that die, hang and raise ---


def test_a_worker_that_dies_costs_its_own_episode_and_no_other(tmp_path: Path) -> None:
    rig = playing(CALM, draw=fake.wild)
    kills = {at for at in range(40) if fake.KILLS in _faults(rig, at)}
    assert 1 < len(kills) < 9
    with processes(2) as pool:
        found = played(rig, 40, pool, tmp_path / "j")
    assert {at for at, record in found.items() if record.end == "crash"} == kills
    assert all(
        [finding.property for finding in found[at].findings] == ["the process survives"] for at in kills
    )
    expected = play(rig, digest(rig), 5, [at for at in range(40) if at not in kills])
    assert [found[at] for at in sorted(found) if at not in kills] == list(expected)
    raised = [record for record in found.values() if record.end == "error:ArithmeticError"]
    assert raised
    assert raised[0].findings == (EpisodeFinding("nothing is raised", 0, "ArithmeticError: seen nothing"),)


def _faults(rig: Rig[Episode], index: int, seed: int = 5) -> list[str]:
    return [fault.fault for fault in rig.episode(seed, index).faults]


def test_what_hangs_is_stopped_and_so_is_what_cannot_be_stopped(tmp_path: Path) -> None:
    """The second keeps the interpreter's lock: only its process's end stops it."""
    for draw in (fake.endless, fake.stuck):
        rig = replace(playing(CALM, draw=draw), limit_s=0.25)
        hang = {at for at in range(16) if {fake.HANGS, fake.STUCK} & set(_faults(rig, at))}
        assert hang
        with processes(1) as pool:
            found = played(rig, 16, pool, tmp_path / draw.__name__)
        assert {at for at, record in found.items() if record.end == "hang"} == hang
        assert all(
            found[at].findings == (EpisodeFinding("the run ends in time", 0, "no end within 0.25 s"),)
            for at in hang
        )


class Dying(Executor):
    """An executor that takes some tasks and then breaks."""

    def __init__(self, takes: int) -> None:
        self.takes = takes

    def submit(self, task: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        if self.takes == 0:
            raise BrokenExecutor
        self.takes -= 1
        future: Future[Any] = Future()
        try:
            future.set_result(task(*args, **kwargs))
        except Exception as error:  # noqa: BLE001  # as an executor does
            future.set_exception(error)
        return future


@pytest.mark.parametrize("takes", [0, 1, 2, 5])
def test_an_executor_that_breaks_for_good_ends_the_campaign_and_loses_nothing(
    takes: int, tmp_path: Path
) -> None:
    with pytest.raises(WorkersGone):
        played(CALM, 300, WorkerPool(Dying(takes)), tmp_path / "j")
    with threads(2) as pool:
        assert played(CALM, 300, pool, tmp_path / "j") == alone(CALM, 300)


def test_a_broken_executor_is_made_anew_when_it_takes_no_task(tmp_path: Path) -> None:
    made: list[Executor] = []

    def renew() -> Executor:
        made.append(Dying(3))
        return made[-1]

    assert played(CALM, 300, WorkerPool(Dying(2), renew=renew), tmp_path / "j") == alone(CALM, 300)
    assert len(made) == 10  # 30 chunks: 2, and 28 by threes


class Doomed(Dying):
    """An executor that breaks with three tasks under way."""

    def __init__(self) -> None:
        super().__init__(0)
        self.held: list[Future[Any]] = []

    def submit(self, task: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        del task, args, kwargs
        if len(self.held) == 3:
            raise BrokenExecutor
        self.held.append(Future())
        if len(self.held) == 3:
            for one in self.held:
                one.set_exception(BrokenExecutor())
        return self.held[-1]


def test_the_deaths_that_one_executor_reports_cost_no_other(tmp_path: Path) -> None:
    made: list[Executor] = []

    def renew() -> Executor:
        made.append(Dying(1000))
        return made[-1]

    assert played(CALM, 9, WorkerPool(Doomed(), 2, renew=renew), tmp_path / "j") == alone(CALM, 9)
    assert len(made) == 1


def test_what_was_under_way_beside_a_killer_is_not_blamed(tmp_path: Path) -> None:
    rig = playing(CALM, draw=fake.wild, loop=fake.Dawdle)
    killer = next(at for at in range(200) if fake.KILLS in _faults(rig, at))
    beside = [killer - 2, killer - 1, killer + 1, killer + 2]
    assert not any(fake.KILLS in _faults(rig, at) for at in beside)
    with processes(2) as pool, Journal(tmp_path / "j", header(rig, 5)) as journal:
        journal.add(_record(at) for at in range(killer - 2))
        for _ in campaign(rig, 5, killer + 3, pool, journal):
            pass
        assert [journal.records[at].end == "crash" for at in sorted([killer, *beside])] == [
            False,
            False,
            True,
            False,
            False,
        ]


def test_a_worker_of_another_checkout_is_refused() -> None:
    with pytest.raises(OtherTables):
        play(CALM, "0" * 64, 5, [0])


# --- the journal ---


def test_a_campaign_goes_on_and_plays_nothing_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, runs = tmp_path / "j", tmp_path / "runs"
    monkeypatch.setenv(fake.RUNS, str(runs))
    with threads(2) as pool:
        with Journal(path, header(CALM, 5)) as journal:
            for _ in zip(campaign(CALM, 5, 200, pool, journal), range(3), strict=False):
                pass
            some = len(journal.records)
        assert 0 < some < 200
        together = threading.Barrier(2)  # which both threads reach only after what was under way and is lost
        for one in [pool.executor.submit(together.wait) for _ in range(2)]:
            one.result()
        runs.unlink()
        found = played(CALM, 200, pool, path)
        assert len(runs.read_text().split()) == 200 - some
        played(CALM, 200, pool, path)
        assert len(runs.read_text().split()) == 200 - some
        assert len(played(CALM, 230, pool, path)) == 230
    monkeypatch.delenv(fake.RUNS)
    assert found == alone(CALM, 200)


def test_a_journal_cut_off_at_any_byte_keeps_its_whole_lines(tmp_path: Path) -> None:
    path, head = tmp_path / "j", header(CALM, 5)
    records = list(alone(CALM, 3).values())
    with Journal(path, head) as journal:
        journal.add(records)
    whole = path.read_bytes()
    for cut in range(len(whole) + 1):
        path.write_bytes(whole[:cut])
        left = max(0, whole[:cut].count(b"\n") - 1)
        Journal(path, head).close()
        assert path.read_bytes() == b"".join(whole.splitlines(keepends=True)[: left + 1])
        with Journal(path, head) as journal:
            assert list(journal.records.values()) == records[:left]
            journal.add(records[left:])
        assert path.read_bytes() == whole


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"seed": 6}, "is of another seed: 5, not 6"),
        ({"digest": "f"}, "is of other tables, data or programs"),
        ({"plant": "mujoco"}, "is of another plant: kinematic, not mujoco"),
        ({"executor": "python"}, "is of other executors"),
        ({"rcsc": "0"}, "was written by another version of rcsc"),
        ({"form": 99}, "is of another form"),
    ],
)
def test_another_campaigns_journal_is_refused(change: dict[str, Any], said: str, tmp_path: Path) -> None:
    path, head = tmp_path / "j", header(CALM, 5)
    Journal(path, head).close()
    before = path.read_bytes()
    with pytest.raises(BadJournal, match=said):
        Journal(path, head | change)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    "content", [b"# rcsc\n", b"mine", b"{}\n", b"[1]\n", b"\xff\n", b'{"form":1}\n', b"\n"]
)
def test_a_file_that_is_no_journal_is_left_alone(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "README.md"
    path.write_bytes(content)
    with pytest.raises(BadJournal, match="is no journal"):
        Journal(path, header(CALM, 5))
    assert path.read_bytes() == content


def test_damage_before_the_last_line_is_refused(tmp_path: Path) -> None:
    path, head = tmp_path / "j", header(CALM, 5)
    with Journal(path, head) as journal:
        journal.add(alone(CALM, 4).values())
    lines = path.read_bytes().splitlines(keepends=True)
    good = json.loads(lines[2])
    odd = [
        {"index": -1}, {"index": "1"}, {"ticks": 1.5}, {"ticks": -1}, {"faults": [1]}, {"end": None},
        {"lines": "zz"},
    ]  # fmt: skip
    odd += [
        {"lines": "f" * 200_000},
        {"findings": [["a", "b", "c"]]},
        {"findings": [["a", -1, "c"]]},
        {"more": 1},
        {"digest": True},
    ]
    changed = [json.dumps(good | one).encode() + b"\n" for one in odd]
    for bad in (b"{}\n", lines[2][:9] + b"\n", b'{"index":1,"faults":3}\n', b"null\n", *changed):
        path.write_bytes(b"".join([*lines[:2], bad, *lines[3:]]))
        with pytest.raises(BadJournal, match="line 3 is damaged"):
            Journal(path, head)


def test_a_pipe_is_no_journal(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "j")
    with pytest.raises(BadJournal, match="is no journal"):
        Journal(tmp_path / "j", header(CALM, 5))


def test_two_campaigns_do_not_write_one_journal(tmp_path: Path) -> None:
    path, head = tmp_path / "j", header(CALM, 5)
    with Journal(path, head), pytest.raises(BadJournal, match="is being written by another campaign"):
        Journal(path, head)
    Journal(path, head).close()


def test_a_killed_campaign_leaves_no_worker_and_goes_on(tmp_path: Path) -> None:
    path, runs = tmp_path / "j", tmp_path / "runs"
    program = f"""
from pathlib import Path
from tests.episodes.test_campaign import played, processes, slow
with processes(2) as crew:
    played(slow(), 2000, crew, Path({str(path)!r}))
"""
    environment = os.environ | {fake.RUNS: str(runs)}
    killed = subprocess.Popen([sys.executable, "-c", program], env=environment, cwd=SYSTEM.parents[1])
    try:
        _until(lambda: path.is_file() and path.read_bytes().count(b"\n") > 30)
    finally:
        killed.kill()
        killed.wait()
    workers = {int(word) for word in runs.read_text().split()}
    assert workers
    _until(lambda: not any(_runs(worker) for worker in workers))
    with Journal(path, header(slow(), 5)) as journal:
        kept = dict(journal.records)
    assert 30 <= len(kept) < 2000
    assert kept == {record.index: record for record in play(CALM, digest(PLAIN), 5, sorted(kept))}


def slow() -> Rig[Episode]:
    return playing(CALM, loop=fake.Dawdle)


def _until(holds: Any, most_s: float = 900) -> None:
    end = time.monotonic() + most_s
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


def _runs(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(") ")[2][0]
    except OSError:
        return False
    return state != "Z"


# --- the digest ---


def test_the_digest_changes_with_the_data_the_scripts_and_the_tables(tmp_path: Path) -> None:
    import shutil

    def copied(name: str) -> Path:
        place = tmp_path / name
        shutil.copytree(SYSTEM.parent, place / "tables", ignore=shutil.ignore_patterns(".rcsc-cache"))
        shutil.copytree(SYSTEM.parents[1] / "generated", place / "generated")
        return place / "tables" / "system.toml"

    same = copied("same")
    assert digest(replace(PLAIN, system=same)) == digest(PLAIN)
    seen = {digest(PLAIN)}
    for name in (
        "tables/cell.toml",
        "tables/scripts/make_boxt.csv",
        "generated/c/task.c",
        "generated/python/vision.py",
    ):
        system = copied(name.replace("/", "_"))
        (system.parents[1] / name).write_bytes((system.parents[1] / name).read_bytes() + b"\n")
        seen.add(digest(replace(PLAIN, system=system)))
    assert len(seen) == 5
    assert journal_path(replace(CALM, system=same), 1, tmp_path) == journal_path(CALM, 1, tmp_path)


def test_lines_are_bits_and_every_line_of_the_tables_is_known() -> None:
    lines = known_lines(SYSTEM)
    assert len(set(lines)) == len(lines) > 200
    assert {level for level, _, _ in lines} == {"task", "emove", "vision", "primitive", "gripper"}
    assert mask(lines, SYSTEM) == (1 << len(lines)) - 1
    assert mask({lines[0], lines[5], ("task", "acquire", "")}, SYSTEM) == 0b100001


# --- shrinking ---

EVERYTHING = Episode(
    parts=(PartSpec("tbox", size_mm=(1.0, 2.0, 3.0)),), rows=("MOVE,,,WS-SAFE,",), faults=(SwitchTo("slips", 3, 4),),
    transport=(BufferFault("task.to_workstation", "lost", 3, 4),), restarts=(Restart(3, "task"),),
    interruptions=(Interruption(3, "MOVE,,,WS-SAFE,"),), pushes=(Push(3, 0, 1.0, 1.0),),
)  # fmt: skip


@pytest.mark.parametrize(
    "name", [field.name for field in fields(Episode) if isinstance(field.default, tuple)]
)
def test_every_list_of_an_episode_loses_what_is_not_needed(name: str) -> None:
    lists = {
        field.name: getattr(EVERYTHING, field.name)
        for field in fields(Episode)
        if isinstance(field.default, tuple)
    }
    assert all(lists.values())
    least = shrink(
        Episode(**{what: held * 3 for what, held in lists.items()}), lambda one: bool(getattr(one, name))
    )
    assert {what: len(getattr(least, what)) for what in lists} == dict.fromkeys(lists, 0) | {name: 1}


def test_a_push_comes_to_what_is_usual() -> None:
    episode = Episode(pushes=(Push(900, 0, 60.3, 12.5), Push(70, 0, 1.0, 1.0)))
    assert shrink(episode, lambda one: any(push.x_mm >= 60 for push in one.pushes)).pushes == (
        Push(0, 0, 60.0, 0.0),
    )


PARTS = [PartSpec("tbox", x_mm=float(at)) for at in range(6)]
SWITCHES = [
    SwitchTo(name, at, at + 5)
    for at, name in enumerate(("drops", "dark", "blind", "noisy", "slips", "tilted"))
]
HARMED = [BufferFault("task.to_workstation", "lost", at, at) for at in range(5)]


def _some(of: Sequence[Any]) -> st.SearchStrategy[tuple[Any, ...]]:
    return st.lists(st.sampled_from(of), unique=True).map(tuple)


@given(_some(PARTS), _some(SWITCHES), _some(HARMED), st.data())
@settings(max_examples=60)
def test_what_is_needed_is_what_is_left(
    parts: tuple[PartSpec, ...],
    faults: tuple[SwitchTo, ...],
    harmed: tuple[BufferFault, ...],
    draw: st.DataObject,
) -> None:
    needed = [
        draw.draw(st.lists(st.sampled_from(held), unique=True) if held else st.just([]))
        for held in (parts, faults, harmed)
    ]

    def fails(episode: Episode) -> bool:
        held = (episode.parts, episode.faults, episode.transport)
        return all(set(want) <= set(has) for want, has in zip(needed, held, strict=True))

    least = shrink(Episode(parts=parts, faults=faults, transport=harmed, rows=fake.ROWS), fails, tries=10_000)
    assert fails(least)
    assert [set(least.parts), set(least.faults), set(least.transport)] == [set(one) for one in needed]
    assert least.rows == ()


@given(st.integers(0, 300), st.integers(0, 300), st.floats(0, 50))
@settings(max_examples=60)
def test_windows_narrow_and_numbers_come_to_what_is_usual(first: int, length: int, least_mm: float) -> None:
    tick = first + length // 2
    episode = Episode(
        seed=77,
        step_s=0.004,
        parts=(PartSpec("tbox", x_mm=60.3, yaw_deg=12.5, size_mm=(1.0, 2.0, 3.0), density_kg_m3=9000.0),),
        faults=(SwitchTo("drops", first, first + length, 4.0),),
        restarts=(Restart(900, "task"),),
    )

    def fails(episode: Episode) -> bool:
        window = any(fault.first_tick <= tick <= fault.last_tick for fault in episode.faults)
        return window and any(part.x_mm >= least_mm for part in episode.parts)

    least = shrink(episode, fails, tries=10_000)
    assert fails(least)
    [fault], [part] = least.faults, least.parts
    assert (least.seed, least.step_s, least.restarts) == (0, 0.002, ())
    assert fault.value == 1.0
    assert fault.last_tick - fault.first_tick <= max(1, length // 4)
    assert (part.yaw_deg, part.size_mm, part.density_kg_m3) == (0.0, (), 2700.0)
    assert part.x_mm == 0 if least_mm == 0 else least_mm <= part.x_mm <= max(2 * least_mm, least_mm + 0.1)


def test_physics_goes_where_the_kinematic_plant_shows_it_too() -> None:
    assert shrink(Episode(backend="mujoco"), lambda _: True).backend == "kinematic"
    assert shrink(Episode(backend="mujoco"), lambda one: one.backend == "mujoco").backend == "mujoco"


def test_shrinking_asks_no_episode_twice_and_no_more_than_it_may() -> None:
    episode = Episode(parts=tuple(PARTS), faults=tuple(SWITCHES), rows=fake.ROWS * 3, transport=tuple(HARMED))
    asked: list[Episode] = []

    def fails(episode: Episode) -> bool:
        asked.append(episode)
        return len(episode.parts) >= 3 and len(episode.rows) >= 2 and SWITCHES[2] in episode.faults

    full = shrink(episode, fails)
    assert (len(full.parts), len(full.rows), full.faults) == (3, 2, (SWITCHES[2],))
    assert len(asked) == len(set(asked))
    assert episode not in asked
    for tries in (0, 1, 7, 20):
        asked.clear()
        assert fails(some := shrink(episode, fails, tries))
        assert len(asked) <= tries + 1
        assert some == shrink(episode, fails, tries)


# --- counterexamples ---


def _record(
    index: int, *faults: str, found: Sequence[str] = (), end: str = "done", lines: int = 0
) -> EpisodeRecord:
    findings = tuple(EpisodeFinding(name, 3, f"said {index}") for name in found)
    return EpisodeRecord(index, faults, end, 10, findings, lines, "")


def test_one_counterexample_for_each_property_and_set_of_faults() -> None:
    records = [
        _record(9, "drops", found=["a"]),
        _record(2, "drops", "dark", found=["a", "b"]),
        _record(7, "drops", found=["a"]),
        _record(1, "dark", "blind", found=["a"]),
        _record(8, found=["b"]),
        _record(3, "dark"),
    ]
    assert [(choice.index, choice.property) for choice in choices(records)] == [
        (8, "b"),
        (7, "a"),
        (1, "a"),
        (2, "b"),
    ]
    assert choices(records) == choices(reversed(records))
    assert (
        Choice(3, (), "FAIL carries the right reason (4.6)").name(7)
        == "7-3-fail-carries-the-right-reason-4-6"
    )


def test_a_counterexample_of_the_cell_is_small_replays_and_fails_again(tmp_path: Path) -> None:
    rig = playing(PLAIN, loop=fake.Dislike)
    records = next(found for at in range(40) if (found := play(rig, digest(PLAIN), 2, [at]))[0].findings)
    with threads(1) as pool:
        [(choice, made)] = counterexamples(rig, 2, choices(records)[:1], pool)
    place = save(tmp_path, rig, 2, choice, made)
    assert sorted(path.name for path in place.iterdir()) == [
        "episode.json",
        "finding.json",
        "log.mcap",
        "script.csv",
    ]
    whole, least = rig.episode(2, choice.index), saved_episode(place, PLAIN)
    assert len(least.rows) == 1 <= len(whole.rows)
    assert [finding.property for finding in again(place, rig).findings] == ["no row fails"]
    assert again(place, rig, "python").digest == again(place, rig, "c").digest
    assert again(place / "episode.json", PLAIN).digest == again(place, rig).digest  # properties look on
    assert is_saved(tmp_path, rig, 2, choice)
    assert not is_saved(tmp_path, replace(rig, executor="python"), 2, choice)
    replayed = _rcsc("replay", str(place / "log.mcap"), "--generated", str(SYSTEM.parents[1] / "generated"))
    assert (replayed.exit_code, replayed.return_value) == (0, 0)
    assert "nothing differs" in replayed.output
    assert [row.text for row in read_script(place / "script.csv")] == [
        one.text for one in again(place, PLAIN).rows
    ]


def test_what_kills_its_process_is_shrunk_all_the_same() -> None:
    rig = playing(CALM, draw=fake.wild)
    fatal = [at for at in range(200) if len(_faults(rig, at)) == 2 and fake.KILLS in _faults(rig, at)]
    index = min(fatal, key=lambda at: len(rig.episode(5, at).to_json()))  # each try is a process
    with processes(1) as pool:
        [(_, made)] = counterexamples(rig, 5, [Choice(index, (), "the process survives")], pool)
    assert made.episode == Episode(faults=(replace(made.episode.faults[0]),))
    assert [(fault.fault, fault.first_tick == fault.last_tick) for fault in made.episode.faults] == [
        (fake.KILLS, True)
    ]
    assert (made.finding.property, made.log) == ("the process survives", b"begun")


def test_a_file_without_an_episode_is_refused(tmp_path: Path) -> None:
    for content in ("", "3", "{", '{"rows": 3}', '{"faults": [{"fault": "nobody"}]}', '{"backend": "paper"}'):
        (tmp_path / "episode.json").write_text(content)
        with pytest.raises(BadEpisode, match=r"episode\.json"):
            again(tmp_path, PLAIN)
    with pytest.raises(BadEpisode, match="cannot be read"):
        again(tmp_path / "none.json", PLAIN)


def _changed(value: Any) -> Iterator[Any]:
    """The value with one thing in it that cannot stand there, for each thing in it."""
    yield from (
        (3, None) if not isinstance(value, int | float) else ("x", None, True, 1e300, -(2**70), [value])
    )
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        for odd in _changed(value[key]):
            made = copy.copy(value)
            made[key] = odd
            yield made
    if isinstance(value, dict):
        yield value | {"more": 1}


def test_an_episode_is_read_by_what_its_fields_are(tmp_path: Path) -> None:
    assert Episode.from_json(EVERYTHING.to_json()) == EVERYTHING
    for changed in _changed(json.loads(EVERYTHING.to_json())):
        (tmp_path / "episode.json").write_text(json.dumps(changed))
        with pytest.raises(BadEpisode, match=r"episode\.json"):
            saved_episode(tmp_path, PLAIN)
    (tmp_path / "episode.json").write_text(replace(EVERYTHING, restarts=(Restart(3, "nobody"),)).to_json())
    with pytest.raises(BadEpisode, match="there is no level `nobody`"):
        again(tmp_path, PLAIN)


# --- the summary ---


def test_the_summary_counts_by_fault_and_does_not_know_the_order() -> None:
    lines = [("task", "a", "1"), ("task", "a", "2"), ("emove", "b", "1")]
    records = [
        _record(0, lines=0b1),
        _record(1, "drops", end="failed:part_lost", found=["p", "p"]),
        _record(2, "drops", "dark", end="failed:timeout", found=["p", "q"], lines=0b101),
        _record(3, "dark", end="crash", found=["r"]),
    ]
    found = summary(records, lines, ("dark", "drops"))
    assert found == summary(records[::-1], lines, ("dark", "drops"))
    assert list(found.by_fault.items()) == [
        ("nominal", {"done": 1}), ("dark", {"crash": 1, "failed": 1}), ("drops", {"failed": 2}),
    ]  # fmt: skip
    assert (found.episodes, found.cycles, found.with_findings) == (4, 40, 3)
    assert found.ends == {"crash": 1, "done": 1, "failed:part_lost": 1, "failed:timeout": 1}
    assert [(broken.property, broken.episodes, broken.first, broken.said) for broken in found.broken] == [
        ("p", 2, 1, "said 1"), ("q", 1, 2, "said 2"), ("r", 1, 3, "said 3"),
    ]  # fmt: skip
    assert [(reached.reached, reached.never) for reached in found.reached] == [(("1",), ("2",)), (("1",), ())]
    text = as_text(found)
    assert "\ndrops         -       2       -\n" in text
    assert "level task: 1 of 2 lines reached\n  a never: 2\nlevel emove: 1 of 1" in text
    assert json.loads(json.dumps(as_json(found)))["outcomes_by_fault"]["dark"] == {"crash": 1, "failed": 1}


# --- the command ---


def _rcsc(*args: str) -> Result:
    return CliRunner().invoke(commands, list(args), standalone_mode=False)


def _campaign(tmp_path: Path, *args: str) -> Result:
    given = ("--system", str(SYSTEM), "--no-compile", "--save", str(tmp_path / "c"), "--workers", "1", *args)
    return _rcsc("campaign", "--journal", str(tmp_path / "j"), *given)


def test_a_short_campaign_of_the_cell_has_no_findings_and_goes_on(tmp_path: Path) -> None:
    said = tmp_path / "s.json"
    first = _campaign(tmp_path, "--episodes", "8", "--json", str(said))
    assert first.return_value == 0, first.output
    assert " 8 played now" in first.output
    once = json.loads(said.read_text())
    assert (once["episodes"], once["findings"], once["played_now"]) == (8, [], 8)
    assert not (tmp_path / "c").exists()
    more = _campaign(tmp_path, "--episodes", "8", "--json", str(said))
    assert more.return_value == 0
    assert " 0 played now" in more.output
    twice = json.loads(said.read_text())
    assert {key: twice[key] for key in twice if "second" not in key and key != "played_now"} == {
        key: once[key] for key in once if "second" not in key and key != "played_now"
    }
    assert set(once["outcomes_by_fault"]) <= {"nominal", *FAULTS}


def test_again_says_what_became_of_a_saved_episode(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "calm.json"
    file.write_text(Episode(rows=("PAUSE,,,,",)).to_json())
    assert cli.run(["campaign", "--system", str(SYSTEM), "--no-compile", "--again", str(file)]) == 0
    shown = capsys.readouterr().out
    assert "  1  PAUSE" in shown
    assert "\ndone after " in shown
    file.write_text("{")
    assert cli.run(["campaign", "--system", str(SYSTEM), "--no-compile", "--again", str(file)]) == 1
    assert "error[RCS742]" in capsys.readouterr().err


def test_what_a_campaign_cannot_use_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    common = ["campaign", "--system", str(SYSTEM), "--no-compile", "--episodes", "1", "--journal"]
    Journal(tmp_path / "j", header(PLAIN, 5)).close()
    assert cli.run([*common, str(tmp_path / "j"), "--seed", "6"]) == 1
    assert "error[RCS741]" in capsys.readouterr().err
    monkeypatch.setattr(crew_module, "_CONNECT_S", 0.1)
    assert cli.run([*common, str(tmp_path / "k"), "--scheduler", "tcp://127.0.0.1:9"]) == 1
    assert "error[RCS744]: no scheduler answers at tcp://127.0.0.1:9" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert cli.run([*common, str(tmp_path / "l"), "--scheduler", "tcp://127.0.0.1:9"]) == 1
    assert "pip install 'rcsc[cluster]'" in capsys.readouterr().err
    for wrong in (
        ["--episodes", "0"],
        ["--workers", "2", "--scheduler", "x"],
        ["--again", "no"],
        ["--script", "make_boxt"],  # the cell's episodes draw their own
        ["--script", "nobody"],
        ["elsewhere"],
        [str(SYSTEM)],  # two systems
    ):
        assert cli.run([*common, str(tmp_path / "m"), *wrong]) == 2
    capsys.readouterr()
    assert cli.run([*common, str(tmp_path / "m"), "--backend", "paper"]) == 1
    assert "the description has no plant `paper`" in capsys.readouterr().err
    assert cli.run([*common, "/proc/none/j"]) == 1
    assert "error[RCS502]" in capsys.readouterr().err

"""Episodes of any system: what is drawn, what each fault does, what is found of seeded defects, and what a fault explains."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings

from rcsc.compose.contract.obligations import Sort
from rcsc.front.commands import run as rcsc
from rcsc.run.campaign.choose import ANY
from rcsc.run.campaign.rig import Rig
from rcsc.run.campaign.search import REPEATS, episodes, found_again, search, smallest
from rcsc.run.episodes.cycle import Broken
from rcsc.run.episodes.episode import (
    BufferFault,
    Episode,
    FieldValue,
    Harm,
    OrderSpec,
    Reading,
    Restart,
    Switch,
)
from rcsc.run.episodes.harm import Explanations, HarmedMemory, Held
from rcsc.run.episodes.loop import Loop, check, run
from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome
from rcsc.run.episodes.sampling import draw, fault_classes, fault_names
from rcsc.run.episodes.stand import stand
from rcsc.run.orders.script import BadScript
from rcsc.run.signature import Value
from tests.support.programs.texts import edit_file, edited

DOCK, UNDOCK = OrderSpec("supervisor", "dock"), OrderSpec("supervisor", "undock")


@pytest.fixture(scope="module")
def robot(dock_compiled: Path) -> Path:
    """The description of the docking robot; only to be read."""
    return dock_compiled / "system.toml"


def both(path: Path) -> Rig[Episode]:
    """The robot, with C and Python side by side."""
    return Rig(ANY, path, "", "both")


def names(outcome: EpisodeOutcome) -> set[str]:
    return {finding.property for finding in outcome.findings}


def changed(dock: Path, file: str, *edits: tuple[str, str]) -> Path:
    """The docking robot with a defect, compiled."""
    edit_file(dock / file, *edits)
    if file.endswith(".rcs"):
        assert rcsc(["compile", "-q", str(dock), "--out", str(dock / "generated")]) == 0
    return dock / "system.toml"


def watched(path: Path, episode: Episode) -> list[dict[str, dict[str, Value]]]:
    """What every level's leaves were after each cycle."""
    loop, seen = Loop(episode, stand(path)), []
    while not loop.over:
        loop.step()
        seen.append(
            {
                level.name: {leaf.name: level.value(leaf.name) for leaf in level.sign.leaves}
                for level in loop.system.levels
            }
        )
    return seen


def first_found(path: Path, most: int = 120) -> tuple[set[str], int]:
    """What the first episode breaks that breaks anything, and its seed."""
    for seed in range(most):
        outcome = run(draw(seed, path), path)
        if outcome.findings:
            return names(outcome), seed
    raise AssertionError(f"nothing in {most} episodes")


class TestAnEpisode:
    def test_comes_back_from_json(self, robot: Path) -> None:
        for seed in range(30):
            episode = draw(seed, robot)
            assert Episode.from_json(episode.to_json()) == episode

    def test_is_read_with_its_defaults(self) -> None:
        text = '{"orders": [{"level": "supervisor", "command": "dock"}], "harms": []}'
        assert Episode.from_json(text) == Episode(orders=(DOCK,))

    @pytest.mark.parametrize(
        ("text", "why"),
        [
            ("[]", "no table of names"),
            ("{", "not JSON"),
            ('{"order": []}', "has no `order`"),
            ('{"executor": "rust"}', "`rust` is none of"),
            ('{"harms": [{"buffer": "x", "kind": "gone", "first_tick": 0, "last_tick": 1, "ticks": 1}]}', "gone"),
            ('{"orders": [3]}', "not the values of a OrderSpec"),
            ('{"orders": 3}', "is no list"),
            ('{"orders": [{"level": "supervisor"}]}', "not the values of a OrderSpec"),
            ('{"ticks": -1}', "`ticks` is -1"),
            ('{"seed": -1}', "the seed"),
            ('{"readings": [{"field": "x", "value": 1, "first_tick": 9, "last_tick": 8}]}', "has no tick"),
            ('{"switches": [{"fault": "x", "first_tick": 9, "last_tick": 0}]}', "has no tick"),
        ],
    )  # fmt: skip
    def test_that_is_none_is_refused(self, text: str, why: str) -> None:
        with pytest.raises(ValueError, match=why):
            Episode.from_json(text)

    @pytest.mark.parametrize(
        ("episode", "why"),
        [
            (Episode(orders=(OrderSpec("boss", "dock"),)), "no level `boss` is ordered"),
            (Episode(orders=(OrderSpec("supervisor", "dance"),)), "`dance` is no value of"),
            (Episode(orders=(OrderSpec("supervisor", "dock", (FieldValue("at", 3),)),)), "no field `at`"),
            (Episode(orders=(OrderSpec("supervisor", "dock", (FieldValue("inc_command", 3),)),)), "no field"),
            (
                Episode(orders=(OrderSpec("supervisor", "dock", (FieldValue("input_command", 1),)),)),
                "no field",
            ),
            (Episode(harms=(BufferFault("x.y", "lost", 0, 1),)), "no buffer `x.y`"),
            (Episode(readings=(Reading("base.speed", 1, 0, 1),)), "`base.speed` is no field"),
            (Episode(readings=(Reading("base.bumper", 3, 0, 1),)), "`3` is no value"),
            (Episode(restarts=(Restart(0, "arm"),)), "no level `arm`"),
            (Episode(switches=(Switch("wheels_stuck", 0, 1),)), "no fault `wheels_stuck`"),
        ],
    )
    def test_of_another_system_is_refused(self, robot: Path, episode: Episode, why: str) -> None:
        with pytest.raises(ValueError, match=why):
            check(episode, robot)

    def test_runs_as_a_script_where_nothing_goes_wrong(self, robot: Path, tmp_path: Path) -> None:
        orders = (DOCK, replace(UNDOCK, wait=7), replace(DOCK, wait=12, interrupts=True))
        script = tmp_path / "orders.csv"
        script.write_text(Episode(orders=orders).script())
        assert script.read_text().splitlines() == ["command,cycles", "dock,", ",7", "undock,12", "dock,"]
        options = ["--no-compile", "--log", str(tmp_path / "log.mcap")]
        assert rcsc(["run", str(robot), "--script", str(script), *options]) == 0

    def test_is_the_same_for_the_same_seed(self, robot: Path) -> None:
        drawn = [draw(seed, robot) for seed in range(60)]
        assert drawn == [draw(seed, robot) for seed in range(60)]
        assert len(set(drawn)) == 60

    def test_has_the_orders_of_a_script(self, robot: Path) -> None:
        for seed in range(20):
            assert [order.command for order in draw(seed, robot, script="in").orders] == ["dock", "stop"]
        own = [[order.command for order in draw(seed, robot).orders] for seed in range(30)]
        assert own.count(["dock", "stop", "undock"]) > 3  # that of the description, now and then
        with pytest.raises(BadScript, match="cannot be read"):
            draw(0, robot, script="none")

    def test_has_every_class_of_faults_some_time(self, robot: Path) -> None:
        classes = {name for seed in range(150) for name in fault_classes(draw(seed, robot))}
        assert classes == set(fault_names(robot)) - {
            "refused"
        }  # no field of the robot's is refused: bools, and clamped
        nominal = sum(not fault_classes(draw(seed, robot)) for seed in range(150))
        assert 10 < nominal < 60


class TestTheDockingRobot:
    def test_keeps_everything_whatever_is_drawn(self, robot: Path) -> None:
        for seed in range(40):
            outcome = run(draw(seed, robot), robot)
            assert not outcome.findings, (seed, outcome.findings)

    def test_does_the_same_in_c_and_in_python(self, robot: Path) -> None:
        for seed in range(12):
            in_c, in_python = (
                run(replace(draw(seed, robot), executor=kind), robot) for kind in ("c", "python")
            )
            assert in_c == in_python

    def test_answers_each_order_in_time(self, robot: Path) -> None:
        outcome = run(Episode(orders=(DOCK, UNDOCK, DOCK)), robot)
        assert [row.state for row in outcome.rows] == ["done"] * 3
        assert outcome.end == "done"
        assert ("drive", "goto", "there") in outcome.lines

    def test_takes_an_order_before_the_end_of_the_one_before(self, robot: Path) -> None:
        outcome = run(Episode(orders=(DOCK, replace(UNDOCK, wait=5, interrupts=True))), robot)
        assert [row.state for row in outcome.rows] == ["changed", "done"]
        assert outcome.rows[0].ticks == 5


class TestEveryFault:
    """Each kind does what it says: an episode with it differs from the one without in what is named here."""

    @pytest.mark.parametrize(("kind", "later"), [("lost", 20), ("late", 8), ("doubled", 1), ("stale", 0)])
    def test_of_the_first_order(self, robot: Path, kind: Harm, later: int) -> None:
        plain = run(Episode(orders=(DOCK,)), robot)
        harm = BufferFault("fleet.order", kind, 0, 19, ticks=8)
        outcome = run(Episode(orders=(DOCK,), harms=(harm,)), robot)
        assert outcome.rows[0].ticks - plain.rows[0].ticks == later  # nothing is older than the first order

    def test_a_stale_report_repeats_an_older_one(self, robot: Path) -> None:
        stale = BufferFault("drive.report", "stale", 6, 9, ticks=6)
        seen = watched(robot, Episode(orders=(DOCK, UNDOCK), harms=(stale,)))
        echoes = [tick["supervisor"]["drive.inc_command_echo"] for tick in seen]
        assert echoes[2:12] == [0, 1, 1, 1, 1, 0, 0, 1, 1, 1]

    def test_a_reading_is_held_for_its_window_over_the_plant(self, robot: Path) -> None:
        held = Reading("base.travelled", 19_999, 5, 9)
        seen = watched(robot, Episode(orders=(DOCK,), readings=(held,)))
        read = [tick["drive"]["travelled_mm"] for tick in seen]
        assert [at for at, value in enumerate(read) if value == 19_999] == [5, 6, 7, 8, 9]
        assert 0 < int(read[10]) < 1000

    def test_a_reading_is_held_where_no_plant_says_anything(self, dock: Path) -> None:
        path = dock / "system.toml"
        path.write_text(path.read_text().partition("[plant]")[0])
        seen = watched(path, Episode(readings=(Reading("base.bumper", True, 3, 4),), ticks=9))
        assert [tick["drive"]["bumper"] for tick in seen[:7]] == [
            False,
            False,
            False,
            True,
            True,
            False,
            False,
        ]

    def test_a_restart_makes_an_order_fail(self, robot: Path) -> None:
        outcome = run(Episode(orders=(DOCK,), restarts=(Restart(30, "supervisor"),)), robot)
        assert outcome.rows[0].state == "failed"

    @pytest.mark.parametrize("kind", ["lost", "late"])
    @pytest.mark.parametrize("tick", [2, 3, 7])
    def test_a_restart_counts_on_from_an_order_that_nobody_has_seen_yet(
        self, robot: Path, kind: Harm, tick: int
    ) -> None:
        harm = BufferFault("supervisor.to_drive", kind, 0, 12, ticks=8)
        restarts = (Restart(tick, "supervisor"),)
        outcome = run(Episode(orders=(DOCK,), harms=(harm,), restarts=restarts), robot)
        assert (outcome.findings, outcome.excused) == ((), ())

    def test_a_switch_makes_the_plant_misbehave_for_its_window(self, robot: Path) -> None:
        plain = run(Episode(orders=(DOCK,)), robot)
        slips = run(Episode(orders=(DOCK,), switches=(Switch("wheel_slips", 10, 49),)), robot)
        assert slips.rows[0].ticks - plain.rows[0].ticks == 40

    def test_a_value_out_of_range_is_refused_and_changes_nothing(self, dock: Path) -> None:
        path = changed(
            dock,
            "drive.rcs",
            ("travelled_mm : int 0 .. 20000 [mm] clamp", "travelled_mm : int 0 .. 20000 [mm]"),
            ("level drive", "property before : was travelled_mm <= 20000\n\nlevel drive"),
        )
        beyond = Reading("base.travelled", 20_001, 10, 14, refused=True)
        plain = run(Episode(orders=(DOCK,)), path)
        outcome = run(Episode(orders=(DOCK,), readings=(beyond,)), path)
        assert not outcome.findings
        assert outcome.rows[0].state == "done"
        assert outcome.ticks == plain.ticks  # the wheels turned on: an output is as it was
        assert outcome.digest != plain.digest
        assert not run(Episode(orders=(DOCK,), readings=(beyond,)), path).findings
        with pytest.raises(ValueError, match="is none that can be read"):
            check(Episode(readings=(replace(beyond, refused=False),)), path)
        with pytest.raises(ValueError, match="is none that is refused"):
            check(Episode(readings=(replace(beyond, value=20_000),)), path)


class TestAScriptsFault:
    """A row's fault of the plant is on while the order of the row is under way, as `rcsc run` has it."""

    def test_it_is_drawn_with_its_order(self, robot: Path, tmp_path: Path) -> None:
        script = tmp_path / "slip.csv"
        script.write_text("command,fault,expect\ndock,wheel_slips,failed\nstop,,\n", encoding="utf-8")
        episode = draw(1, robot, script=str(script))
        assert [(order.command, order.faults) for order in episode.orders] == [
            ("dock", ("wheel_slips",)),
            ("stop", ()),
        ]
        assert "wheel_slips" in fault_classes(episode)
        assert episode == Episode.from_json(episode.to_json())
        assert episode.script().splitlines()[0].endswith(",fault")
        assert "with the plant's fault `wheel_slips`" in "".join(episode.told())

    def test_it_is_on_while_the_order_is_under_way(self, robot: Path) -> None:
        slips = replace(DOCK, faults=("wheel_slips",))
        assert run(Episode(orders=(DOCK,)), robot).end == "done"
        loop = Loop(Episode(orders=(slips, OrderSpec("supervisor", "stop"))), stand(robot))
        (base,) = loop.cycle.plants
        on = []
        while not loop.over:
            loop.step()
            on.append((loop.operator.ends == [], base.plant.wheel_slips))
        assert set(on) == {(True, True), (False, False)}
        assert loop.operator.ends[0].state == "failed"

    def test_one_that_the_plant_has_not_is_refused(self, robot: Path) -> None:
        with pytest.raises(ValueError, match="no fault `sulks`"):
            check(Episode(orders=(replace(DOCK, faults=("sulks",)),)), robot)


class TestWhatAFaultExplains:
    def test_an_older_order_again_is_no_finding_and_says_so(self, robot: Path) -> None:
        stale = BufferFault("supervisor.to_drive", "stale", 24, 30, ticks=8)
        episode = Episode(orders=(DOCK, replace(UNDOCK, wait=20, interrupts=True)))
        assert not run(episode, robot).excused
        outcome = run(replace(episode, harms=(stale,)), robot)
        assert not outcome.findings
        assert [(excused.property, excused.because) for excused in outcome.excused] == [
            ("drive: takes each order once", "buffer `supervisor.to_drive` is stale in ticks 24 .. 30")
        ]

    def test_a_late_order_explains_nothing(self, robot: Path) -> None:
        explained = Explanations(stand(robot))
        explained.note({})
        assert not explained.because(Broken("p", "", "drive"))
        explained.note({"drive.report": "it is stale"})
        assert explained.because(Broken("p", "", "supervisor")) == "it is stale"
        assert not explained.because(Broken("p", "", "drive"))
        explained.note({})
        assert (
            explained.because(Broken("p", "", "drive")) == "it is stale"
        )  # what it is told follows from that

    def test_a_reading_explains_an_assumption_about_it_and_no_other(self, robot: Path) -> None:
        explained = Explanations(stand(robot))
        explained.note({"base.travelled": "it is forged"})
        assert not explained.because(Broken("p", "", "drive"))
        assert not explained.because(Broken("a", "", "drive", ("bumper",)))
        assert explained.because(Broken("plant: p", "")) == "it is forged"
        assert explained.because(Broken("a", "", "drive", ("travelled_mm",))) == "it is forged"

    def test_a_reading_of_what_is_so_anyway_explains_nothing(self, dock: Path) -> None:
        method = "    def stays_near(self) -> Property:\n        return self.travelled < 0.5\n\n    def step("
        edits = ("    def step(", method), ("import Fault, Range", "import Fault, Property, Range")
        path = changed(dock, "base.py", *edits)
        for value, broken in ((0, {"plant: stays_near"}), (1, set[str]())):
            reading = Reading("base.travelled", value, 1, 1)
            outcome = run(Episode(orders=(DOCK,), readings=(reading,)), path)
            assert names(outcome) == broken
            assert bool(outcome.excused) is (not broken)

    def test_a_reading_forges_its_own_field_of_a_record_alone(self, robot: Path) -> None:
        held = (Held("base.seen", 0, 1, 0, 5), Held("base.seen", 1, 7, 0, 5))
        memory = HarmedMemory((), held, {"base.seen": (1, 2)})
        memory.begin(0)
        assert memory.changed == {"base.seen": {1}}
        explained = Explanations(stand(robot))
        explained.note({"base.travelled": "it is forged"}, {"base.travelled": {1}})
        assert explained.forged == {"drive": {}}


class TestSeededDefects:
    """What is wrong on purpose is found, and by which property."""

    def test_a_drive_that_forgets_what_it_did_when_it_starts_anew(self, dock: Path) -> None:
        path = changed(dock, "drive.rcs", (" restart bad", ""))
        outcome = run(Episode(orders=(DOCK,), restarts=(Restart(20, "drive"),)), path)
        [finding] = outcome.findings
        assert finding.message.startswith("order 1 of `supervisor.to_drive` was failed, and is done; ")
        assert finding.message.endswith("anew in cycle 21: `state NAME : TYPE restart VALUE` says with what")
        found, seed = first_found(path)
        assert found == {"drive: failed stays failed"}
        assert "restarted" in fault_classes(draw(seed, path))

    @pytest.mark.parametrize(
        ("line", "was", "now", "word"),
        [
            ("idle  | false       | idle ", "done", "executing", Sort.DONE_STAYS),
            ("bad   | false       | bad  ", "fail", "done", Sort.FAILED_STAYS),
        ],
    )
    def test_a_drive_that_takes_back_what_it_answered(
        self, line: str, was: str, now: str, word: Sort, dock: Path
    ) -> None:
        """Found by the word that `rcsc prove` has for it."""
        row = f"| {line}  |        |                      |        ||                  | 0          | {was} "
        text = (dock / "drive.rcs").read_text()
        goto = text[text.index("table goto") : text.index("table align")]
        path = changed(dock, "drive.rcs", (goto, edited(goto, (row, row.replace(f"| {was} ", f"| {now} ")))))
        readings = (Reading("base.bumper", True, 10, 10),)
        assert f"drive: {word}" in names(run(Episode(orders=(DOCK, DOCK), readings=readings), path))

    def test_a_level_that_does_not_number_a_new_order(self, dock: Path) -> None:
        path = changed(
            dock,
            "supervisor.rcs",
            (" or to_drive.target_mm /= old_order.target_mm", ""),
            ("| back(100)   |", "| goto(600)   |"),  # what differs from docking by its target alone
            ("now = backing and ref_in = back", "now = backing and ref_in = goto"),
            ("in {stop, back}", "in {stop, goto}"),
        )
        broken, seed = first_found(path)
        assert broken == {"supervisor: numbers each order"}
        assert "changed order" in fault_classes(draw(seed, path))
        assert not run(Episode(orders=(DOCK, UNDOCK, DOCK)), path).findings  # `stop` comes between

    def test_a_plant_whose_wheel_slips_for_good(self, dock: Path) -> None:
        path = changed(dock, "base.py", ("if not self.wheel_slips:", "if self.travelled < 0.3:"))
        edit_file(path, ("tick_ms = 40\n", "tick_ms = 40\ncampaign = { within = 400 }\n"))
        outcome = run(Episode(orders=(DOCK,)), path)
        assert names(outcome) == {"supervisor: every command ends"}
        assert outcome.end == "hang"
        assert outcome.ticks == 400
        within = run(Episode(orders=(DOCK,)), changed(dock, "system.toml", ("within = 400", "within = 4000")))
        assert (within.end, names(within)) == ("failed:reason drive_fault", set())

    def test_no_end_of_a_command_where_nothing_outside_moves(self, dock: Path) -> None:
        path = dock / "system.toml"
        path.write_text(
            path.read_text()
            .partition("[plant]")[0]
            .replace("tick_ms = 40\n", "tick_ms = 40\ncampaign = { within = 50 }\n")
        )
        away = Reading("base.travelled", 5000, 0, 60)  # at the start it would be out already
        outcome = run(Episode(orders=(UNDOCK, DOCK), readings=(away,)), path)
        assert (outcome.end, outcome.ticks, names(outcome)) == ("hang", 50, set())
        assert [row.state for row in outcome.rows] == ["waiting"]

    def test_no_time_that_a_fault_takes(self, dock: Path) -> None:
        path = dock / "system.toml"
        edit_file(path, ("tick_ms = 40\n", "tick_ms = 40\ncampaign = { within = 100 }\n"))
        outcome = run(Episode(orders=(DOCK,), switches=(Switch("wheel_slips", 10, 109),)), path)
        assert (outcome.end, names(outcome)) == ("done", set())
        assert outcome.rows[0].ticks > 100

    def test_a_property_that_is_false(self, dock: Path) -> None:
        said = "property slow : speed_mm_s <= 100\n\nlevel drive"
        path = changed(dock, "drive.rcs", ("level drive", said))
        outcome = run(Episode(orders=(DOCK,)), path)
        assert names(outcome) == {"drive: slow"}
        [finding] = outcome.findings
        assert finding.message == "`speed_mm_s <= 100` is false in line `start`: `speed_mm_s` = 400"

    def test_a_property_of_two_cycles_is_not_asked_across_a_restart(self, dock: Path) -> None:
        said = "property on : was speed_mm_s = 400 implies speed_mm_s /= 400\n\nlevel drive"
        path = changed(dock, "drive.rcs", ("level drive", said))
        outcome = run(Episode(orders=(DOCK,)), path)
        assert [(one.property, "`was speed_mm_s` = 400" in one.message) for one in outcome.findings] == [
            ("drive: on", True)
        ]
        restarts = tuple(Restart(tick, "drive") for tick in range(1, 60))
        assert not names(run(Episode(orders=(DOCK,), restarts=restarts), path))

    def test_a_property_of_the_plant_that_is_false(self, dock: Path) -> None:
        method = "    def stays_near(self) -> Property:\n        return self.travelled < 0.5\n\n    def step("
        path = changed(
            dock,
            "base.py",
            ("    def step(", method),
            ("import Fault, Range", "import Fault, Property, Range"),
        )
        outcome = run(Episode(orders=(DOCK,)), path)
        [finding] = outcome.findings
        assert finding.property == "plant: stays_near"
        assert "base.travelled = 0.512" in finding.message
        assert not names(run(Episode(orders=(UNDOCK,)), path))

    def test_a_plant_that_raises(self, dock: Path) -> None:
        path = changed(
            dock, "base.py", ("self.contact = ", "self.contact = 1 / (self.travelled < 0.5) > 0 and ")
        )
        outcome = run(Episode(orders=(DOCK,)), path)
        assert (names(outcome), outcome.end) == ({"the plant raises nothing"}, "plant failed")


class TestExecutorsThatAreSpoilt:
    """What tables that are proved cannot do; generated Python is edited, as nothing else does it."""

    def spoilt(self, dock: Path, level: str, *edits: tuple[str, str]) -> Path:
        edit_file(dock / "generated" / "python" / f"{level}.py", *edits)
        return dock / "system.toml"

    def test_a_line_that_is_missing(self, dock: Path) -> None:
        begun = '    """The line of table goto that matches admitted inputs: its position; -1 none, -2 several."""\n'
        path = self.spoilt(dock, "drive", (begun, f"{begun}    if s.waited == 9:\n        return -1\n"))
        outcome = run(Episode(executor="python", orders=(DOCK,)), path)
        [finding] = outcome.findings
        assert (finding.property, outcome.end) == ("no state-table error", "state-table error")
        assert finding.message == "level `drive`, table `goto`: no line matches"
        assert outcome.ticks == finding.tick == 13

    def refusing(self, dock: Path, change: str) -> EpisodeFinding:
        """What is found where the module that refuses a reading is spoilt, and one out of range comes."""
        taken = "travelled_mm : int 0 .. 20000 [mm]"
        changed(dock, "drive.rcs", (f"{taken} clamp", taken))
        path = self.spoilt(dock, "drive", ("    if not 0 <= i3 <= 20000:\n", change))
        beyond = Reading("base.travelled", 20_001, 10, 14, refused=True)
        [finding] = run(Episode(executor="python", orders=(DOCK,), readings=(beyond,)), path).findings
        return finding

    def test_a_value_out_of_range_that_is_taken(self, dock: Path) -> None:
        finding = self.refusing(dock, "    if not 0 <= i3 <= 20001:\n")
        assert finding.property == "refuses what lies out of range"
        assert finding.message == "level `drive` took `travelled_mm` = 20001"

    def test_a_refusal_that_leaves_something_behind(self, dock: Path) -> None:
        finding = self.refusing(dock, "    if not 0 <= i3 <= 20000:\n        s.waited = 77\n")
        assert finding.message == "level `drive` changed `waited` in that cycle"

    def test_an_answer_to_what_was_never_ordered(self, dock: Path) -> None:
        echo = "s.report_inc_command_echo = s.inc_command_seen"
        path = self.spoilt(dock, "drive", (echo, f"{echo} + (s.stage == 1)"))
        outcome = run(Episode(executor="python", orders=(DOCK,)), path)
        assert "drive: answers what was ordered" in names(outcome)


class TestTheSearch:
    def test_says_what_it_tried(self, robot: Path) -> None:
        searched = search(both(robot), 3)
        assert searched.falsified is None
        assert searched.episodes == 3
        assert searched == search(both(robot), 3)

    def test_finds_a_plant_that_does_not_repeat_itself(self, dock: Path) -> None:
        text = "import random\nfrom typing import Annotated"
        path = changed(
            dock,
            "base.py",
            ("from typing import Annotated", text),
            ("room = ", "room = random.random() * "),
        )
        searched = search(both(path), 20)
        assert searched.falsified is not None
        assert searched.falsified[1].property == REPEATS
        assert searched.falsified[1].message.endswith(" in the same episode again")

    def test_finds_executors_that_differ(self, dock: Path) -> None:
        python = dock / "generated/python/drive.py"
        python.write_text(python.read_text().replace("s.speed_mm_s = 400", "s.speed_mm_s = 401"))
        searched = search(both(dock / "system.toml"), 20)
        assert searched.falsified is not None
        episode, finding = searched.falsified
        assert finding.property == "C and Python do the same"
        assert (
            finding.message
            == "level `drive`, table `goto`, line `start`: `speed_mm_s` is 400 in C and 401 in Python"
        )
        assert run(episode, dock / "system.toml").end == "executors differ"
        assert not run(replace(episode, executor="c"), dock / "system.toml").findings

    def test_python_that_raises_or_gives_what_is_no_such_value_differs(self, dock: Path) -> None:
        python = dock / "generated/python/drive.py"
        text = python.read_text()
        for becomes, word in (
            ("s.speed_mm_s = 1 // 0", "the Python executor raises ZeroDivisionError"),
            ("s.speed_mm_s = 1 << 40", f"`speed_mm_s` is 400 in C and {1 << 40} in Python"),
        ):
            python.write_text(text.replace("s.speed_mm_s = 400", becomes))
            [finding] = run(Episode(executor="both", orders=(DOCK,)), dock / "system.toml").findings
            assert word in finding.message

    def test_is_a_strategy_for_tests_of_one_s_own(self, robot: Path) -> None:
        @settings(max_examples=5)
        @given(episodes(str(robot)))
        def holds(episode: Episode) -> None:
            assert not run(episode, str(robot)).findings

        holds()

    def test_leaves_of_what_is_found_one_order_and_one_restart(self, dock: Path) -> None:
        rig = Rig(ANY, changed(dock, "drive.rcs", (" restart bad", "")))
        searched = search(rig, 60)
        assert searched.falsified is not None
        assert searched.falsified[1].property == "drive: failed stays failed"
        least, finding = smallest(rig, *searched.falsified)
        assert (len(least.orders), len(least.restarts)) == (1, 1)
        assert (least.harms, least.readings, least.switches) == ((), (), ())
        assert least.told()[1] == f"before tick {least.restarts[0].tick}: level `drive` starts anew"
        assert found_again(rig, replace(least, restarts=()), finding.property) is None
        assert found_again(rig, replace(least, switches=(Switch("none", 0, 0),)), finding.property) is None

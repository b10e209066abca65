"""What was proved, watched: claims of right tables on executors of wrong ones, false claims, what they trust; and no plant."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rcsc.compose.contract.claims import trust_of
from rcsc.compose.contract.obligations import Sort
from rcsc.front.commands import run as rcsc
from rcsc.run.campaign.summary import watched, watched_text
from rcsc.run.episodes.episode import BufferFault, Episode, OrderSpec, Reading, Restart
from rcsc.run.episodes.loop import Loop
from rcsc.run.episodes.proved.checks import WATCHED
from rcsc.run.episodes.proved.claims import Claim, Claims, ProvedLevel, Trusted, WatchedNeighbour
from rcsc.run.episodes.proved.watch import PROVED
from rcsc.run.episodes.sampling import draw_on
from rcsc.run.episodes.stand import Stand, stand
from tests.claims import WITHIN, drawn_episode, played, proved_claims_of
from tests.small_hierarchies.made import Hierarchy, hierarchy
from tests.small_hierarchies.text import files
from tests.support.programs.texts import edited

RIGHT = hierarchy(22, frozenset(range(9)))
"""Three levels, as they have to be."""
WRONG = [
    ("l0", "echo", "", "ECHOES"),
    ("l0", "next", "SENT", "NUMBERED"),
    ("l0", "next", "SENT", "CONTRACT"),
    ("l0", "next", "(SENT + 2) mod 65536", "NEXT_NUMBER"),
    ("l0", "released", "begun", "WAITS"),
    ("l0", "deferred", "new_command", "UNREACHED"),
    ("l0", "deferred", "ECHO = SENT or status_in = done", "AGAIN"),
    ("l0", "numbered", "false", "FAILED_STAYS"),
    ("l1", "next", "SENT", "STANDS"),
    ("l1", "taken", "command.inc_command /= inc_command_seen or status_report = failed", "ONCE"),
]
"""A slip of the hand in a level, and a kind of claims that it makes false."""
SLIPS_OF_LINES = [
    ("| true || begin | order_pause | done |", "| true || begin | order_work | done |", {"PAUSES", "WAITS"}),
    ("begin; nextstate(s1) ", "begin; nextstate(s1); state(f_state) ", {"DEFERRED"}),
    ("|  ||  | order_pause | done |", "|  ||  | order_pause | failed |", {"DONE_STAYS", "STANDS"}),
]
"""The same in a line of the first level's tables; all kinds that it makes false."""
BLIND = (
    ("| 0 | true |  |", "| 0 | true | s1 |"),
    ("| 99 | DEFAULT |  |  |  ||  |", "| 99 | DEFAULT |  |  |  || begin |"),
)
"""DEFAULT takes a new command, which then is new no more."""

SAFE = {
    "lv.rcs": """
input x : int 0 .. 9
input y : real 0.0 .. 1.0
output o : int 0 .. 3 = 0 safe 3
property rises : o = 2 implies was o = 1
table t {
  | line | o | x   || o |
  |------|---|-----||---|
  | up   | 0 | 0   || 1 |
  | on   | 1 |     || 2 |
  | back | 2 |     || 0 |
  | safe | 3 |     || 0 |
  | stay | 0 | > 0 || 0 |
}
level lv { period 40 [ms] table t }
""",
    "system.toml": 'name = "sn"\ngenerated = "generated"\ntick_ms = 40\n[[level]]\nname = "lv"\n'
    '[buffers]\n"out.x" = "lv.x"\n"out.y" = "lv.y"\n' + WITHIN,
}

PAIR = {
    "w.rcs": """
input x : int 0 .. 9
output o : int 0 .. 9
table t {
  | line | x    || o     |
  |------|------||-------|
  | low  | < 5  || x     |
  | high | >= 5 || 9 - x |
}
level w { period 40 [ms] table t }
""",
    "r.rcs": """
input o : int 0 .. 9
state seen : int 0 .. 9
output z : bool
invariant little : seen <= 4
property shown : z implies o <= 3
requirement few : whenever z, at once o <= 3
assume small assumed monitored : o <= 4
table t assuming small {
  | line | o                   || seen | z     |
  |------|---------------------||------|-------|
  | few  | <= 3                || o    | true  |
  | most | 4                   || 4    | false |
  | rest | DEFAULT unreachable || 0    | true  |
}
level r { period 40 [ms] table t }
""",
    "system.toml": 'name = "sn"\ngenerated = "generated"\ntick_ms = 40\n[[level]]\nname = "w"\n[[level]]\nname = "r"\n'
    '[buffers]\n"out.x" = "w.x"\n"w.o" = "r.o"\n' + WITHIN,
}
"""One level reads what another writes, and rests on it."""
OF_THE_PAIR = {"OWED", "GIVEN", "ASSUMPTION", "NO_DEFAULT", "PROPERTY", "REQUIREMENT"}
"""Kinds of claims that a number too high by one makes false."""
SLIPS_OF_CODE = [
    ("w.py", "s.o = s.x", "s.o = s.x + 20", "SAFE"),
    ("r.py", "s.seen = s.o", "s.seen = s.o + 2", "INVARIANT"),
    ("w.py", "        return 0\n", "        return -1\n", "SOME_LINE"),
    ("w.py", "        return 0\n", "        return -2\n", "ONE_LINE"),
]
"""A slip in the Python of one of them, and the kind of claims that it makes false: no table that does so is compiled."""

TIMELY = {
    "lv.rcs": """
enum job { rest, sort }
enum feed { halt, feed }
enum status { done, executing, failed }
enum why { none, silent, begun_anew }
link jobs {
  command : job rest rest
  status : status done done failed failed executing executing
  report { reason why : why restart begun_anew }
}
link feeding {
  command : feed rest halt
  status : status done done failed failed executing executing
  report { reason why : why restart begun_anew }
}
serves user : jobs
commands a : feeding within 2 cycles else silent
table sort {
  | line | new_command | answered | a.status || a    | status_out |
  |------|-------------|----------|----------||------|------------|
  | go   | true        | false    |          || feed | executing  |
  | wait | true        | true     |          ||      |            |
  | lost | false       |          | failed   || halt | failed     |
  | on   | false       |          | /= failed||      | executing  |
}
table rest {
  | line | a.resting || a    | status_out |
  |------|-----------||------|------------|
  | soon | false     || halt | executing  |
  | now  | true      || halt | done       |
}
level lv { period 40 [ms] table by user.input_command { rest : rest  sort : sort } }
""",
    "system.toml": 'name = "sn"\ngenerated = "generated"\ntick_ms = 40\n[[level]]\nname = "lv"\n'
    '[buffers]\n"user.to_lv" = "lv.user"\n"lv.to_user" = "user.lv"\n"lv.to_a" = "a.lv"\n"a.to_lv" = "lv.from_a"\n'
    + WITHIN,
}


def written(folder: Path, texts: dict[str, str]) -> Path:
    """The description of a system, written and compiled."""
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    assert rcsc(["compile", "-q", str(folder)]) == 0
    return folder / "system.toml"


def of(made: Hierarchy) -> dict[str, str]:
    texts = files(made)
    return {**texts, "system.toml": texts["system.toml"] + WITHIN}


def slipped(level: str, name: str, text: str, made: Hierarchy = RIGHT) -> Hierarchy:
    """The hierarchy with this text in place of a module's part."""
    return replace(
        made,
        levels=tuple(
            replace(
                one,
                said=tuple(
                    (said, text if (one.name, said) == (level, name) else right) for said, right in one.said
                ),
            )
            for one in made.levels
        ),
    )


def broken(its: Stand, claims: Claims, episodes: Iterator[Episode]) -> set[str]:
    """Kinds of the claims that these episodes break."""
    kinds = {f"{claim.level}: {PROVED}: {claim.words}": claim.kind for claim in claims.every}
    found = set[str]()
    for episode in episodes:
        outcome = Loop(replace(episode, executor="python"), its, claims).finish()
        found |= {kinds[finding.property] for finding in outcome.findings if finding.property in kinds}
    return found


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> tuple[Stand, Claims]:
    """The right hierarchy, compiled, and what is proved of it."""
    path = written(tmp_path_factory.mktemp("right"), of(RIGHT))
    return stand(path), proved_claims_of(path)


@pytest.fixture
def safe(tmp_path: Path) -> Stand:
    """A level whose output shows a safe value after a refused input, in a system without a plant."""
    return stand(written(tmp_path, SAFE))


def only(claim: Claim) -> Claims:
    return Claims((ProvedLevel(claim.level, "0" * 64, None, (), (claim,)),))


class TestClaimsOfRightTables:
    """They hold on executors of those tables, and break on executors of others."""

    def test_hold(self, right: tuple[Stand, Claims]) -> None:
        its, claims = right
        assert broken(its, claims, (drawn_episode(its, 5, at) for at in range(6))) == set()

    @pytest.mark.parametrize(("level", "name", "text", "kind"), WRONG)
    def test_break(
        self, tmp_path: Path, right: tuple[Stand, Claims], level: str, name: str, text: str, kind: str
    ) -> None:
        its, claims = stand(written(tmp_path, of(slipped(level, name, text)))), right[1]
        assert kind in broken(
            its, claims, (drawn_episode(its, seed, at) for seed in (22, 2) for at in range(4))
        )

    @pytest.mark.parametrize(("line", "slip", "kinds"), SLIPS_OF_LINES)
    def test_break_by_lines(
        self, tmp_path: Path, right: tuple[Stand, Claims], line: str, slip: str, kinds: set[str]
    ) -> None:
        texts = of(RIGHT)
        assert line in texts["l0.rcs"]
        texts["l0.rcs"] = texts["l0.rcs"].replace(line, slip)
        its, claims = stand(written(tmp_path, texts)), right[1]
        assert kinds <= broken(its, claims, (drawn_episode(its, 22, at) for at in range(6)))

    def test_of_a_command_that_is_passed_over_break(
        self, tmp_path: Path, right: tuple[Stand, Claims]
    ) -> None:
        texts = of(RIGHT)
        its = stand(written(tmp_path, {**texts, "l0.rcs": edited(texts["l0.rcs"], *BLIND)}))
        assert "ANSWERED" in broken(its, right[1], (drawn_episode(its, 22, at) for at in range(4)))

    def test_of_what_another_level_writes_break(self, tmp_path: Path) -> None:
        claims = proved_claims_of(written(tmp_path / "right", PAIR))
        slip = PAIR["w.rcs"].replace("|| x     |", "|| x + 1 |")
        its = stand(written(tmp_path / "wrong", {**PAIR, "w.rcs": slip}))
        assert broken(its, claims, (drawn_episode(its, 1, at) for at in range(3))) == OF_THE_PAIR

    @pytest.mark.parametrize(("file", "right", "slip", "kind"), SLIPS_OF_CODE)
    def test_break_by_code(self, tmp_path: Path, file: str, right: str, slip: str, kind: str) -> None:
        path = written(tmp_path, PAIR)
        claims, code = proved_claims_of(path), tmp_path / "generated" / "python" / file
        code.write_text(edited(code.read_text(encoding="utf-8"), (right, slip)), encoding="utf-8")
        its = stand(path)
        assert kind in broken(its, claims, (drawn_episode(its, 1, at) for at in range(3)))

    def test_nothing_explains_it_but_older_values(self, right: tuple[Stand, Claims], tmp_path: Path) -> None:
        its = stand(written(tmp_path, of(slipped("l0", "echo", ""))))
        order = OrderSpec("l0", "work")
        first = Loop(Episode(executor="python", orders=(order,)), its, right[1]).finish()
        (name,) = (found.property for found in first.findings if "echoes the command" in found.property)
        stale = BufferFault("station.order", "stale", 0, 60)
        misled = Loop(
            Episode(executor="python", orders=(order, order), harms=(stale,)), its, right[1]
        ).finish()
        assert name in {found.property for found in misled.excused} | {
            found.property for found in misled.findings
        }

    def test_are_all_of_a_kind_that_is_watched(self, right: tuple[Stand, Claims]) -> None:
        its, claims = right
        assert {claim.kind for claim in claims.every} <= WATCHED
        assert not watched(claims, its).unwatched
        assert all(trust.kind for claim in claims.every for trust in claim.trusts)

    def test_are_counted_with_their_proof(self, right: tuple[Stand, Claims]) -> None:
        its, claims = right
        said = watched_text(watched(claims, its))
        assert (
            said[0]
            == f"{len(claims.every)} of {len(claims.every)} claims that `rcsc prove` calls proved are watched"
        )
        assert [line.split(":")[0] for line in said[1:]] == [
            f"  level {level.name}, proof {level.proof[:16]}" for level in claims.levels
        ]


class TestFalseClaims:
    """A claim that is false is found by what it leaves out."""

    REFUSED = Episode(readings=(Reading("out.x", 10, 3, 3, refused=True),), ticks=12)

    def test_of_a_property_after_a_refused_input(self, safe: Stand) -> None:
        claim = Claim("lv", "PROPERTY", "", "rises", "property `rises`")
        never = Claim("lv", "UNREACHED", "t", "safe", "line `safe` is never reached")
        assert broken(safe, only(claim), iter((self.REFUSED,))) == set()
        assert broken(safe, only(never), iter((self.REFUSED,))) == {"UNREACHED"}
        assert broken(safe, only(never), iter((replace(self.REFUSED, readings=()),))) == set()

    def test_of_what_was_before_a_refused_input_is_of_the_cycle_that_it_ended(self, tmp_path: Path) -> None:
        """The safe value stood there, whatever stood before it: so the property holds, and it is proved."""
        falls = "property falls : o = 0 implies was o /= 1\nproperty rises"
        path = written(tmp_path, {**SAFE, "lv.rcs": edited(SAFE["lv.rcs"], ("property rises", falls))})
        its, claims = stand(path), proved_claims_of(path)
        assert {"falls", "rises"} <= {claim.name for claim in claims.every if not claim.trusts}
        for tick in range(6):
            refused = Reading("out.x", 10, tick, tick, refused=True)
            assert (
                not Loop(Episode(executor="python", readings=(refused,), ticks=12), its, claims)
                .finish()
                .findings
            )

    def test_one_that_trusts_that_nothing_is_refused(self, safe: Stand) -> None:
        words = "`x`, `y` of level `lv` are never refused"
        trusted = Trusted(*trust_of(words), words)
        claim = Claim("lv", "UNREACHED", "t", "safe", "line `safe` is never reached", (trusted,))
        assert trusted.kind == "REFUSED"
        assert broken(safe, only(claim), iter((self.REFUSED,))) == set()

    @pytest.mark.parametrize(
        ("admit", "trust"),
        [
            (" clamp", "`x` of level `lv` is in range where it begins anew"),
            ("", "`x`, `y` of level `lv` are never refused"),
        ],
    )
    def test_one_that_trusts_what_stands_where_the_level_begins_anew(
        self, tmp_path: Path, admit: str, trust: str
    ) -> None:
        """No cycle has seen it: in the next one, a tick later, another value has come."""
        text = edited(
            SAFE["lv.rcs"],
            ("0 .. 9", f"0 .. 9{admit}"),
            ("period 40", "period 80"),
            ("o = 2 implies was o = 1", "was x <= 9"),
        )
        its = stand(written(tmp_path, {**SAFE, "lv.rcs": text}))
        stood = Reading("out.x", 255, 3, 3, refused=not admit)
        episode = Episode(readings=(stood,), restarts=(Restart(3, "lv"),), ticks=12)
        claim = Claim("lv", "PROPERTY", "", "rises", "property `rises`")
        assert broken(its, only(claim), iter((episode,))) == {"PROPERTY"}
        trusted = replace(claim, trusts=(Trusted(*trust_of(trust), trust),))
        assert broken(its, only(trusted), iter((episode,))) == set()

    def test_a_state_table_error_says_what_the_episode_broke_before(self, tmp_path: Path) -> None:
        text = edited(
            SAFE["lv.rcs"],
            ("table t {", "assume small : x <= 4\ntable t assuming small {"),
            ("| > 0 ||", "| 1 .. 4 ||"),
        )
        path = written(tmp_path, {**SAFE, "lv.rcs": text})
        its, claims = stand(path), proved_claims_of(path)
        episode = Episode(executor="python", readings=(Reading("out.x", 7, 0, 3),), ticks=12)
        said = "level `lv`, table `t`: no line matches"
        assert [one.message for one in Loop(episode, its).finish().findings] == [said]
        [finding] = Loop(episode, its, claims).finish().findings
        assert finding.message == (
            f"{said}; the episode has broken what its proof takes for granted: assumption `small` of level `lv`, "
            "as it is declared (level `lv`: `small` does not hold)"
        )

    def test_one_that_trusts_what_nobody_knows_is_told(self, safe: Stand) -> None:
        strange = Trusted(*trust_of("the moon is full"), "the moon is full")
        of_ = watched(only(Claim("lv", "SAFE", "", "", "values", (strange,))), safe)
        assert watched_text(of_)[-1] == "  not watched: level `lv`: values: it trusts that the moon is full"

    def test_no_number_is_refused(self, safe: Stand) -> None:
        never = Claim("lv", "UNREACHED", "t", "safe", "line `safe` is never reached")
        episode = Episode(readings=(Reading("out.y", "nan", 3, 3, refused=True),), ticks=12)
        assert Episode.from_json(episode.to_json()) == episode
        assert broken(safe, only(never), iter((episode,))) == {"UNREACHED"}

    def test_that_an_order_waits_for_its_echo_but_where_it_is_late(self, tmp_path: Path) -> None:
        """What is ordered instead is late no more where the cycle ends."""
        its = stand(written(tmp_path, TIMELY))
        above = WatchedNeighbour("user", "user", "to_user", True)
        below = WatchedNeighbour("a", "to_a", "from_a", True)
        claim = Claim("lv", "WAITS", "", "to_a", "no other command replaces its order")
        silent = Episode(
            orders=(OrderSpec("lv", "sort"),), harms=(BufferFault("a.to_lv", "lost", 0, 60),), ticks=60
        )

        def found(late: str) -> set[str]:
            level = ProvedLevel("lv", "0" * 64, above, (replace(below, late=late),), (claim,))
            return broken(its, Claims((level,)), iter((silent,)))

        assert found("a.late") == set()
        assert found("") == {"WAITS"}

    def test_that_a_command_ends(self, tmp_path: Path) -> None:
        """Without it the level takes every cycle's order as a new one, and begins again and again."""
        bottom = hierarchy(1, frozenset(range(9)))
        claims = proved_claims_of(written(tmp_path / "right", of(bottom)))
        its = stand(written(tmp_path / "wrong", of(slipped("l0", "seen", "", bottom))))
        assert "ENDS" in broken(its, claims, (drawn_episode(its, 1, at) for at in range(4)))


class TestNobodyOutside:
    """Without a plant, values from outside move in their ranges, and are refused now and then."""

    def test_values_move(self, safe: Stand) -> None:
        drawn = [draw_on(safe, seed) for seed in range(20)]
        readings = [reading for episode in drawn for reading in episode.readings]
        assert {reading.field for reading in readings} == {"out.x", "out.y"}
        assert {reading.value for reading in readings if reading.field == "out.x"} >= {0, 1, 9, 10}
        assert {reading.refused for reading in readings} == {True, False}
        assert any(reading.value == "nan" for reading in readings)

    def test_and_are_no_fault(self, safe: Stand) -> None:
        loop = Loop(replace(TestFalseClaims.REFUSED, executor="python"), safe)
        while not loop.over:
            loop.step()
            assert not loop.cycle.faulty
        assert not loop.outcome().findings

    def test_who_is_ordered_obeys(self, tmp_path: Path) -> None:
        outside = hierarchy(4, frozenset(range(9)))
        assert outside.outside
        its = stand(written(tmp_path, of(outside)))
        command = outside.levels[0].commands[-1]
        ends = set()
        for seed in range(12):
            orders = (OrderSpec("l0", command),) * 2
            outcome = Loop(Episode(executor="python", seed=seed, orders=orders), its).finish()
            ends |= {row.state for row in outcome.rows}
        assert {"done", "failed"} <= ends

    def test_levels_restart_while_an_input_is_refused(self, safe: Stand) -> None:
        together = 0
        for seed in range(200):
            episode = draw_on(safe, seed)
            windows = [one for one in episode.readings if one.refused]
            together += any(
                one.first_tick <= restart.tick <= one.last_tick
                for one in windows
                for restart in episode.restarts
            )
        assert together >= 10


def test_an_echo_that_goes_back_is_found_in_a_cycle_that_a_fault_ends(right: tuple[Stand, Claims]) -> None:
    """A level that starts anew while an input is refused publishes, too."""
    its, _ = right
    loop = Loop(
        Episode(executor="python", orders=(OrderSpec("l0", "pause"),) * 3, restarts=(Restart(9, "l2"),)), its
    )
    outcome = loop.finish()
    assert not outcome.findings


def test_every_kind_of_claim_is_seen_broken() -> None:
    """Those without a table of their own by tests above: a command that is passed over, one that goes on for ever."""
    kinds = {kind for *_, kind in WRONG} | {kind for *_, some in SLIPS_OF_LINES for kind in some}
    kinds |= {kind for *_, kind in SLIPS_OF_CODE} | OF_THE_PAIR
    kinds |= {"ANSWERED", "ENDS"}
    assert kinds == WATCHED


def test_every_sort_of_obligation_is_watched() -> None:
    """But those that are several others, that runs of two levels show, or that are about what could come and did not."""
    assert {sort.name for sort in Sort} - WATCHED <= {"PROTOCOL", "SAME_ORDER", "OF_ITS_ORDER", "KEPT"}


def test_a_report_with_which_a_level_begins_answers_nothing() -> None:
    """It begins with *done*, and says *executing* of what stands there from its first cycle on: its answers stand all the same."""
    one = played(5021, 2)
    assert one.kinds["STANDS"]
    assert not one.broken


def test_the_command_plays_drawn_systems() -> None:
    one = played(3, 2)
    assert not one.broken
    assert one.counts["systems"] == 1
    assert one.counts["episodes"] == 2
    assert one.counts["claims watched"] > 0

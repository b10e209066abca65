"""The composed proof against exhaustive enumeration: a short run, and that either side notices when the other is wrong."""

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.claims import CONTRACT, UNREACHED, Claim, Closed, Need, closed
from rcsc.compose.contract.obligations import Obligation, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.walk import Walk
from rcsc.compose.counterexample.trace import NotReproducedError, Trace
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.system import transition_systems
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.execution import Run
from tests import hierarchies
from tests.bench.growth import chain, costs
from tests.hierarchies import Judged, forget, judged
from tests.small_hierarchies import world
from tests.small_hierarchies.explored import TooManyError, adopted, explored
from tests.small_hierarchies.level import Role
from tests.small_hierarchies.made import ODD, RIGHT, WRONG, Hierarchy, hierarchy
from tests.small_hierarchies.more import EVERY, furnished
from tests.small_hierarchies.text import files, written
from tests.small_hierarchies.world import canonical, offers, wanted
from tests.support.proved import shortest
from tests.whole_systems import part, whole
from tests.whole_systems.held import everything
from tests.whole_systems.part import Event

LITTLE = 9
"""Lines of the tables of a hierarchy that is quickly judged."""
SMALL = (*(seed for seed in range(20_000, 20_030) if sum(hierarchy(seed).lines) < LITTLE), 20_044, 20_047)
FEW_WALKS = Effort(walks=2, cycles=40)
ANY = (*range(20_302, 20_305), 430_897, 9_001_694)
"""In the last but one a fact is declared of what the preprocess makes of state alone, in the last of what stands in a buffer."""


@pytest.fixture(autouse=True)
def _nothing_known() -> Iterator[None]:
    forget()
    yield
    forget()


def roles(made: Hierarchy, folder: Path) -> dict[str, Role]:
    known = transition_systems(written(made, folder))
    odd = {level.name: dict(level.said).get("next") in ODD for level in made.levels}
    return {name: Role(ts.program, ts.level, ts.links, odd[name]) for name, ts in known.items()}


def said(made: Hierarchy, level: int, **pieces: str) -> Hierarchy:
    """The hierarchy with other pieces in the modules of a level."""
    one = made.levels[level]
    assert set(pieces) <= set(dict(one.said))
    other = replace(one, said=tuple((name, pieces.get(name, text)) for name, text in one.said))
    return replace(made, levels=(*made.levels[:level], other, *made.levels[level + 1 :]))


def plain(*tables: int) -> Hierarchy:
    """Levels without any slip, with so many tables each; two with two if nobody says."""
    return chain(tables or (2, 2))


# --- they agree -----------------------------------------------------------------------------


def test_the_proof_and_the_enumeration_agree_of_random_hierarchies() -> None:
    found = [judged(furnished(seed), seed) for seed in (*SMALL, *ANY)]
    assert [(one.seed, one.disagreements) for one in found if one.disagreements] == []
    counts = sum((one.counts for one in found), start=Judged(0).counts)
    assert counts["hierarchies with a fault"] > len(found) // 3  # neither all right nor all wrong
    assert counts["not proved, breaks"] > 10
    assert counts["proved, holds"] > 10 * counts["not proved, holds"]
    assert counts["traces"] > 10
    assert counts["whole systems"] > 0


def test_the_command_taken_last_is_remembered_though_no_number_tells_it(tmp_path: Path) -> None:
    """Where the level above changes an order under its number, what was answered of the order before has to be known."""
    role = roles(said(plain(), 0, numbered="new_command"), tmp_path)["l1"]
    assert role.links.above is not None
    assert role.links.above.numbered == ()
    [taken] = {leaf for leaf in role.inputs if leaf.endswith(".input_command")}
    assert canonical(role, {**role.start, taken: 1})[taken] == 1


def test_a_hierarchy_is_the_same_each_time_and_others_are_others() -> None:
    assert files(hierarchy(7)) == files(hierarchy(7))
    assert len({files(hierarchy(seed))["l0.rcs"] for seed in range(40)}) > 30
    assert {len(hierarchy(seed).levels) for seed in range(60)} == {1, 2, 3}


# --- the enumeration is one -----------------------------------------------------------------


@pytest.mark.parametrize("seed", [10, 12, 20])
def test_every_state_of_a_random_walk_is_among_those_that_are_listed(seed: int, tmp_path: Path) -> None:
    """The walk's environment is another's, and its numbers are any."""
    for role in roles(hierarchy(seed), tmp_path).values():
        listed: set[tuple[bool | int | float, ...]] = set()
        explored(role, seen=listed)
        walked = set()
        for start in range(6):
            walk = Walk(TransitionSystem(role.program, role.level, role.links), Random(start))  # noqa: S311  # repeatable on purpose
            walked |= {tuple(canonical(role, _bare(role, state)).values()) for state in walk.states(60)}
        assert len(walked) > 2
        assert walked <= listed


def _bare(role: Role, state: dict[str, bool | int | float]) -> dict[str, bool | int | float]:
    return {leaf: state[leaf] for leaf in role.leaves}


@pytest.mark.parametrize("seed", [420_009, 420_015, 420_024])
def test_compiled_cycles_are_the_interpreters(seed: int, tmp_path: Path) -> None:
    """With what they read; extern procedures, deferred states, faults and assumptions that stop are among them."""
    for role in roles(furnished(seed), tmp_path).values():
        listed: set[tuple[bool | int | float, ...]] = set()
        with suppress(TooManyError):
            explored(role, seen=listed)
        assert listed
        for state in sorted(listed)[:40]:
            before = dict(zip(role.leaves, state, strict=True))
            for taken in offers(role, before)[:20]:
                read: set[str] = set()
                now = {**before, **dict(zip(role.inputs, taken, strict=True))}
                for ran in role.ways(now, read):
                    role.same(now, ran, read)


def test_a_level_without_slips_breaks_nothing(tmp_path: Path) -> None:
    for role in roles(plain(), tmp_path).values():
        found = explored(role)
        assert (found.least, found.restarted) == ({}, set())
        assert len(wanted(role)) > 5


@pytest.mark.parametrize(
    ("name", "text", "sort"),
    [
        ("numbered", WRONG["numbered"][0], Sort.NUMBERED),
        ("next", ODD[0], Sort.NEXT_NUMBER),
        ("taken", WRONG["taken"][0], Sort.ONCE),
        ("echoed", WRONG["echoed"][1], Sort.ECHOES),
        ("released", "begun", Sort.NO_DEFAULT),
        ("deferred", WRONG["deferred"][0], Sort.NO_DEFAULT),
    ],
)
def test_a_slip_breaks_what_it_is_to_break(name: str, text: str, sort: Sort, tmp_path: Path) -> None:
    role = roles(said(plain(2, 3), 0, **{name: text}), tmp_path)["l0"]
    assert sort in {key[0] for key in explored(role).least}


def test_what_breaks_only_after_a_restart_is_found_there(tmp_path: Path) -> None:
    """A level that begins anew is in `f_state`, where it does not come otherwise."""
    level = plain().levels[1]
    rest, table = level.tables
    lines = tuple(line for line in table.lines if line.cell("cur_state") != "f_state")
    made = Hierarchy((replace(level, tables=(rest, replace(table, lines=lines))),))
    found = explored(roles(made, tmp_path)["l1"])
    assert (found.least, found.restarted) == ({}, {(Sort.SOME_LINE, table.name, "")})
    assert words(made) == set()


def test_what_a_goal_looks_at_is_varied_though_the_level_does_not_read_it(tmp_path: Path) -> None:
    blind = said(plain(2, 3), 0, released="begun", sampled="SENT = SENT", deferred="begun")
    assert (Sort.WAITS, "", "to_l1") in explored(roles(blind, tmp_path)["l0"]).least


def test_too_many_states_are_said_to_be(tmp_path: Path) -> None:
    with pytest.raises(TooManyError):
        explored(roles(plain(), tmp_path)["l0"], most=5)


# --- who is wrong is found out --------------------------------------------------------------


def words(made: Hierarchy) -> set[str]:
    """What the two disagree about."""
    return {disagreement.what for disagreement in judged(made, traces=99).disagreements}


def test_a_prover_that_believes_in_a_better_world_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    slip = said(plain(), 0, released="begun")
    assert words(slip) == set()
    forget()
    monkeypatch.setattr(TransitionSystem, "_protocol", lambda *_: values.FALSE)
    assert words(slip) >= {"proved, but breaks", "no trace found"}


@pytest.mark.parametrize("clause", ["answered", "ordered"])
def test_a_contract_that_is_not_kept_is_found_out(clause: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is proved rests on every clause; without it the enumeration breaks some of it."""
    monkeypatch.setattr(world, clause, lambda *_: True)
    assert "proved, but breaks" in words(plain())


def test_a_trace_that_is_too_long_or_none_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    slip = said(plain(), 0, released="begun")

    def longer(ts: TransitionSystem, obligation: Obligation, most: int) -> Trace | None:
        trace = shortest(ts, obligation, most)
        return trace and replace(trace, steps=(trace.steps[0], *trace.steps))

    monkeypatch.setattr(hierarchies, "shortest", longer)
    assert "trace of another length" in words(slip)

    def none(*_: object) -> Trace | None:
        raise NotReproducedError("a goal")

    monkeypatch.setattr(hierarchies, "shortest", none)
    assert words(slip) == {"trace does not run"}


def saying(call: str, more: str, *states: str, asks: tuple[tuple[str, int], ...] = ()) -> Hierarchy:
    """The lowest level with one thing more, which each first line calls."""
    upper, lower = plain().levels
    tables = tuple(
        replace(
            table,
            lines=(
                replace(table.lines[0], calls=(*filter(None, [call]), *table.lines[0].calls)),
                *table.lines[1:],
            ),
        )
        for table in lower.tables
    )
    return Hierarchy((upper, replace(lower, more=(more,), states=states, asks=asks, tables=tables)))


def test_a_prover_that_believes_that_nothing_is_refused_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    asking = saying("", "heard", asks=(("ask", 1),))
    assert words(asking) == set()
    forget()
    monkeypatch.setattr(Run, "_refusal", lambda *_: values.FALSE)
    assert "proved, but breaks" in words(asking)


def test_a_verdict_that_does_not_name_what_it_rests_on_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """A restart breaks the invariant without which a counter leaves its range."""
    counting = saying("spread", "share", "invariant never_failed : cur_state /= f_state")
    assert words(counting) == set()

    def loose(made: Mapping[Need, Claim]) -> dict[Need, Closed]:
        return closed({need: Claim(one.verdict, (), one.trusts) for need, one in made.items()})

    monkeypatch.setattr(hierarchies, "closed", loose)
    assert "proved, but not defined" in words(counting)


def test_hierarchies_have_all_that_is_to_be_judged() -> None:
    levels = [level for seed in range(20_000, 20_200) for level in furnished(seed).levels]
    assert {one for level in levels for one in level.more} == EVERY.keys()
    assert {len(level.statuses) for level in levels} == {3, 4}
    assert {place for level in levels for place in level.asks} >= {
        ("ask", 0),
        ("ask", 1),
        ("tell", 0),
        ("tell", 1),
    }
    said = Counter(" ".join(state.split()[:3:2]) for level in levels for state in level.states)
    assert {one.split()[0] for one in said} == {"assume", "invariant", "property"}
    assert min(said["assume monitored"], said["assume assumed"]) > 10


# --- together -------------------------------------------------------------------------------


def broken_together(made: Hierarchy, folder: Path) -> set[tuple[int, str]]:
    """What breaks where its levels run with real buffers and begin anew: the level, and the sort of the claim."""
    found = everything(files(made), folder, most=1500)
    return {
        (level, key[0])
        for level, key, rank in found.broken
        if key[0] != UNREACHED and rank != Event.REFUSED.rank
    }


def test_two_levels_with_real_buffers_keep_what_they_keep_in_their_contracts(tmp_path: Path) -> None:
    assert broken_together(plain(), tmp_path) == set()


@pytest.mark.parametrize(
    ("level", "name", "text", "breaks"),
    [
        (0, "numbered", "new_command", (0, CONTRACT)),
        (0, "numbered", "COMMAND /= old_command and new_command", (1, CONTRACT)),
        (1, "echoed", "report.ref_command_echo := pause", (0, CONTRACT)),
        (0, "released", "begun", (0, Sort.NO_DEFAULT)),
    ],
)
def test_levels_that_do_not_keep_their_guarantees_break_something_together(
    level: int, name: str, text: str, breaks: tuple[int, str], tmp_path: Path
) -> None:
    assert breaks in broken_together(said(plain(), level, **{name: text}), tmp_path)


def test_two_levels_see_a_cycle_that_stops_behind_a_restart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That a report goes on echoing is needed: else the one that stood is followed by an older one."""
    upper, lower = saying("slow", "load", "assume loaded monitored : load /= 0").levels
    tables = tuple(replace(table, assuming=("loaded",)) for table in lower.tables)
    made = Hierarchy((upper, replace(lower, tables=tables)))
    monkeypatch.setattr(whole, "SHARE", (0.1, 0.3, 0.3, 1.0))  # most of all what ends early behind a restart
    assert (0, CONTRACT) not in broken_together(made, tmp_path)
    monkeypatch.setattr(part, "adopted", lambda role, start, *_: adopted(role, start))
    assert (0, CONTRACT) in broken_together(made, tmp_path)


# --- growth ---------------------------------------------------------------------------------


def test_the_questions_of_a_system_are_those_of_its_levels() -> None:
    """As many for a level above two as for one above one, and none for the whole: so that the cost adds up."""
    every = [costs(chain((2,) * many), FEW_WALKS) for many in (2, 3)]
    assert {cost.open for found in every for cost in found} == {0}
    two, three = ([cost.questions for cost in found] for found in every)
    assert (three[0], three[2]) == (two[0], two[1])
    assert (
        two[0] > three[1] > two[1] > 0
    )  # of the one between nothing comes from outside that could be refused


def test_enumerations_of_many_members_are_followed() -> None:
    """A level that orders one of 10 commands, and one that takes them; the first is asked no more than of a few."""
    few, many = costs(chain((3, 5)), FEW_WALKS), costs(chain((3, 10)), FEW_WALKS)
    assert [cost.open for cost in (*few, *many)] == [0] * 4
    assert many[0].questions < 1.3 * few[0].questions  # as a solver's models have it
    # 417, with refusals and without; a third more where clauses are pushed one by one, and models forgotten
    assert many[0].questions < 500
    assert many[1].questions < 1.1 * 10 / 5 * few[1].questions  # in proportion, about


def test_every_piece_of_a_module_has_slips() -> None:
    assert WRONG.keys() == RIGHT.keys()

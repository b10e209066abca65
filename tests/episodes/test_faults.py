"""Seeded faults: that they are faults, and that each of the three that are asked catches some which the others do not."""

from collections.abc import Iterator, Mapping
from itertools import chain, islice
from pathlib import Path

import pytest

from rcsc.lang.protocol import written
from rcsc.lang.protocol.roles import Parties
from tests.faults import (
    Answer,
    Judged,
    Kept,
    Standing,
    by_campaign,
    by_check,
    by_compose,
    matrix,
    resolves,
    shipped,
)
from tests.support.faults_made import KINDS, LEVELS, Fault, faults, sample, tables
from tests.support.programs.texts import one_row_a_line

TABLES = Path(__file__).parents[2] / "tables"


@pytest.fixture(scope="module")
def sound() -> Mapping[str, Standing]:
    return shipped(["gripper"])


def gripper(kind: str, old: str, new: str) -> Fault:
    """The one fault of the gripper controller of this kind that makes the one of the other."""
    return next(
        fault
        for fault in faults(TABLES, "gripper")[kind]
        if old in fault.old and (new in fault.new if new else not fault.new)
    )


def test_every_fault_is_one_change_in_one_line() -> None:
    for level in LEVELS:
        for kind, found in faults(TABLES, level).items():
            for fault in found[:20]:
                before = one_row_a_line(TABLES / fault.file).split("\n")
                after = fault.text.split("\n")
                assert before[fault.number - 1] == fault.old, kind
                assert before[: fault.number - 1] == after[: fault.number - 1]
                assert before[fault.number :] == after[fault.number - bool(not fault.new) :]
                assert fault.level == level
                assert fault.kind == kind


def test_every_kind_is_there_and_there_are_more_than_two_hundred_in_turns() -> None:
    every = {level: faults(TABLES, level) for level in LEVELS}
    assert {kind for found in every.values() for kind, ones in found.items() if ones} == set(KINDS)
    firsts = [list(islice(sample(TABLES, level, 1984), 50)) for level in LEVELS]
    assert sum(map(len, firsts)) == 250
    assert len({(fault.file, fault.text) for fault in chain.from_iterable(firsts)}) > 240
    for level, first in zip(LEVELS, firsts, strict=True):
        kinds = {kind for kind, ones in every[level].items() if ones}
        assert {fault.kind for fault in first[: len(kinds)]} == kinds


def test_a_sample_hangs_on_its_seed_alone() -> None:
    def shown(seed: int) -> list[str]:
        return [fault.shown for fault in islice(sample(TABLES, "task", seed), 40)]

    assert shown(1) == shown(1) != shown(2)


def test_a_table_is_read_with_its_head_and_its_lines() -> None:
    lines = one_row_a_line(TABLES / "gripper" / "gripper.rcs").split("\n")
    position, grasp, pause = tables(lines)
    assert [len(position), len(grasp), len(pause)] == [8, 7, 2]
    assert [name.strip() for name in grasp[0].actions] == ["procedures", "command_out", "status_out"]
    assert lines[grasp[3].at] == grasp[3].text()


def test_what_does_not_resolve_is_no_fault() -> None:
    old = "to_hand.opening_mm := primitive.opening_mm"
    assert not resolves(gripper("a field swapped", old, "primitive.input_command"))  # a command is no length
    assert not resolves(
        gripper("a status taken for another", "done done", "done failed")
    )  # a buffer at first says done
    assert resolves(gripper("a line dropped", "| 7    | false       | f_state", ""))


def test_a_missing_line_is_caught_by_the_table_s_proof() -> None:
    fault = gripper("a line dropped", "| 7    | false       | f_state", "")
    assert by_check(fault) == Answer(True, "RCS401")


def test_only_the_composed_proof_knows_that_a_command_is_taken_up_once(
    sound: Mapping[str, Standing], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The fault is in the text that the protocol makes of `serves`: a new number is compared wrongly."""
    made = written.taken

    def turned(parties: Parties) -> Iterator[str]:
        lines = list(made(parties))
        assert sum("/= inc_command_seen" in line for line in lines) == 1
        return (line.replace("/= inc_command_seen", "= inc_command_seen") for line in lines)

    monkeypatch.setattr(written, "taken", turned)
    path = TABLES / "gripper" / "gripper.rcs"
    fault = Fault(
        "gripper", "the protocol's own text", "gripper/gripper.rcs", 1, "", "", path.read_text("utf-8")
    )
    assert by_check(fault) == Answer(False)
    assert by_compose(fault, sound).how.startswith("gripper: a command number is taken up once")


def test_only_the_episodes_know_what_the_fingers_do(sound: Mapping[str, Standing]) -> None:
    """They are told to move, and not where to."""
    fault = gripper("an assignment dropped", "to_hand.opening_mm := primitive.opening_mm", "")
    assert by_check(fault) == Answer(False)
    assert by_compose(fault, sound) == Answer(False)
    assert by_campaign(fault).caught


def test_an_answer_is_asked_for_once_and_again_where_its_ground_is_another(tmp_path: Path) -> None:
    fault = gripper("a line dropped", "| 7 ", "")
    asked = []

    def ask() -> Answer:
        asked.append(1)
        return Answer(True, f"asked {len(asked)} times")

    kept = Kept(tmp_path)
    assert kept.answer("check", "here", fault, ask).how == "asked 1 times"
    assert kept.answer("check", "here", fault, ask).how == "asked 1 times"
    assert kept.answer("check", "there", fault, ask).how == "asked 2 times"
    assert kept.answer("compose", "here", fault, ask).how == "asked 3 times"


def test_the_matrix_counts_who_alone_caught_what() -> None:
    one, two = (
        gripper("a line dropped", "| 7 ", ""),
        gripper("a counter not incremented", "waited + 1", "waited + 0"),
    )
    yes, no = Answer(True), Answer(False)
    judged = [
        Judged(one, {"check": yes, "compose": yes}),
        Judged(one, {"check": no, "compose": yes}),
        Judged(two, {"check": no, "compose": no}),
    ]
    rows = {line[:32].strip(): line[32:].split() for line in matrix(judged, ("check", "compose"))}
    assert rows["a line dropped"] == ["2", "1", "0", "2", "1", "0"]
    assert rows["a counter not incremented"] == ["1", "0", "0", "0", "0", "1"]
    assert rows["all"] == ["3", "1", "0", "2", "1", "1"]

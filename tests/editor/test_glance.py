"""A glance says nothing that a check takes back, and what nobody waits for ends."""

import itertools
import re
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import pytest

from rcsc.desk.editor import Workspace
from rcsc.desk.editor.memo import Memo, OutdatedError
from rcsc.desk.editor.values import Answer, State
from rcsc.desk.editor.workspace import GLANCE_S, Reading
from rcsc.lang.model import Bool, Int
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Limits
from rcsc.proof.solvers.smt import Answer as Solved
from rcsc.proof.solvers.smt import Solver
from tests.bench.editor import keys

REPO = Path(__file__).parents[2]
HARD = """
input go : bool
input a : real 0.0 .. 100.0
input b : real 0.0 .. 100.0
input c : real 0.0 .. 100.0
output x : real 0.0 .. 100000.0
output y : real 0.0 .. 10000000.0
procedure one { x := a * b + c * b y := (a * b + c) * c }
procedure two { x := b * a + b * c y := (c + a * b) * c }
table t {
  | line | go    || procedures |
  | p    | true  || one        |
  | q    | false || two        |
}
"""
"""Both lines do the same, of which Z3 is not sure in any time: it multiplies doubles."""


def _one_less(questions: list[int]) -> bool:
    if questions:
        questions.pop()
        return True
    return False


def no_time(patch: pytest.MonkeyPatch) -> None:
    """Let a glance be over as it begins."""
    patch.setattr("rcsc.desk.editor.workspace.GLANCE_S", 0.0)
    patch.setattr("rcsc.desk.editor.workspace.LEAST_S", 0.0)


def said(answer: Answer) -> set[tuple[str, str]]:
    """What is found, without how many inputs it is about: a glance may leave them uncounted."""
    share = re.compile(
        r"some inputs|[\d,]+ of [\d,]+ \([^)]*\) of the inputs(?: that the assumptions allow)?"
    )
    return {(each.code, share.sub("inputs", each.message)) for each in answer.findings}


@pytest.mark.parametrize(
    "name", ["task/acquire.rcs", "gallery/tcas/published.rcs", "examples/grip.rcs", "emove/locate.rcs"]
)
def test_a_final_glance_is_the_answer(name: str) -> None:
    file = str(REPO / "tables" / name)
    glance = Workspace().glance(file)
    if glance.final:  # on a slow machine it may be none
        assert glance == Workspace().check(file)


def test_what_a_glance_leaves_open_is_neither_told_nor_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no question is answered, no table is called proved, none undecided; the check after it is whole."""
    file = str(REPO / "tables/emove/locate.rcs")
    workspace = Workspace()
    with monkeypatch.context() as patch:
        no_time(patch)
        glance = workspace.glance(file)
    assert not glance.final
    assert {table.standing.state for table in glance.tables} == {State.STALE}
    assert "RCS409" not in {each.code for each in glance.findings}
    answer = workspace.check(file)
    assert answer == Workspace().check(file)
    assert said(glance) <= said(answer)
    assert workspace.glance(file) is answer


@pytest.mark.parametrize("name", ["task/clear.rcs", "task/move.rcs"])
def test_a_glance_that_ends_anywhere_tells_what_it_has_found(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And nothing that the check takes back: overlaps before the regions around their inputs, which take longest."""
    file = str(REPO / "tables" / name)
    text = next(keys(Path(file).read_text()))
    fresh = Workspace()
    fresh.open(file, text)
    wanted = said(fresh.check(file))
    regions: list[bool] = []
    for most in range(1, 600, 67):
        left = list(range(most))
        monkeypatch.setattr(
            "rcsc.desk.editor.workspace._spent", lambda _, left=left: lambda: not _one_less(left)
        )
        workspace = Workspace()
        workspace.open(file, text)
        glance = workspace.glance(file)
        assert said(glance) <= wanted, most
        if not left:
            assert {table.standing.state for table in glance.tables} <= {
                State.STALE,
                State.REFUTED,
                State.ERRORS,
            }
            regions += [bool(each.witnesses[0].region) for each in glance.findings if each.code == "RCS402"]
    assert False in regions


@pytest.mark.parametrize(
    "name",
    ["emove/locate.rcs", "gallery/plcopen_safety/guard_code.rcs", "examples/approach.rcs", "task/move.rcs"],
)
def test_a_glance_whose_time_is_over_makes_no_question(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """To put one into Z3's words takes longer than to ask it."""
    made: list[Solver] = []
    make = Solver.__init__

    def counted(self: Solver, limits: Limits = Limits(), *, remembers: bool = False) -> None:
        made.append(self)
        make(self, limits, remembers=remembers)

    monkeypatch.setattr(Solver, "__init__", counted)
    workspace, file = Workspace(), str(REPO / "tables" / name)
    with monkeypatch.context() as patch:
        no_time(patch)
        assert not workspace.glance(file).final
    assert not made
    workspace.check(file)
    assert made


def test_what_it_takes_to_read_a_text_is_time_of_the_glance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a text that takes long to read the answer comes no later, and says no more than is known."""
    file = str(REPO / "tables/task/acquire.rcs")
    workspace = Workspace()
    read = workspace.reading

    def slowly(path: str) -> Reading:
        end_s = time.thread_time() + 1.5 * GLANCE_S
        while time.thread_time() < end_s:
            pass
        return read(path)

    with monkeypatch.context() as patch:
        patch.setattr(Workspace, "reading", lambda _, path: slowly(path))
        patch.setattr("rcsc.proof.table.program.prove_table", None)  # nor is a table begun
        glance = workspace.glance(file)
    assert not glance.final
    assert {table.standing.state for table in glance.tables} == {State.STALE}
    assert workspace.check(file) == Workspace().check(file)


def test_a_glance_that_other_work_holds_up_ends_by_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who has waited long is answered with what a moment's work has found; so much is done however long he has waited."""
    file = str(REPO / "tables/task/acquire.rcs")
    monkeypatch.setattr("rcsc.desk.editor.workspace.GLANCE_S", 1800.0)
    for waited_s, least_s, ends in ((3600.0, 0.0, True), (3600.0, 3600.0, False), (0.0, 0.0, False)):
        monkeypatch.setattr("rcsc.desk.editor.workspace.LEAST_S", least_s)
        glance = Workspace().glance(file, since_s=time.monotonic() - waited_s)
        assert glance.final is not ends, (waited_s, least_s)
        assert ({table.standing.state for table in glance.tables} == {State.STALE}) is ends


def test_a_question_under_way_is_broken_off_when_nobody_waits_for_it() -> None:
    """However long it may take; the next is answered, and only what watches its end breaks anything off."""
    over = threading.Event()
    solver = Solver(Limits(steps=2**32 - 1, cpu_s=86_400.0))
    kind = Int(0, 0)
    a, b, c = (smt.variable(name, kind) for name in "abc")
    cubes = [smt.integer_operation("*", each, smt.integer_operation("*", each, each)) for each in (a, b, c)]
    solver.add(
        smt.equal(smt.integer_operation("+", *cubes[:2]), cubes[2], kind)
    )  # Fermat has an answer, Z3 none
    for each in (a, b, c):
        solver.add(smt.at_most(smt.literal(kind, 1), each, kind))
    threading.Timer(0.5, over.set).start()
    with smt.until(over.is_set, breaks_off=True):
        assert solver.check() is Solved.UNKNOWN
        assert over.is_set()
    easy = Solver(Limits())
    easy.add(smt.equal(a, b, kind))
    assert easy.check() is Solved.SATISFIABLE
    with smt.until(lambda: False, breaks_off=True):
        assert easy.check() is Solved.SATISFIABLE


def test_what_is_broken_off_leaves_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever it comes, also just as a question ends: what is stated next is not lost, and the next answer is right."""
    monkeypatch.setattr(smt, "WATCH_S", 0.0003)
    kind = Int(0, 50)
    a, b = (smt.variable(name, kind) for name in "ab")
    answers: set[Solved] = set()
    for number in range(0, 300, 5):
        end_s = time.monotonic() + 0.00003 * number
        with smt.until(lambda end_s=end_s: time.monotonic() >= end_s, breaks_off=True):  # type: ignore[misc]  # bound early
            _no_two(a, b, kind)
        answers.add(_no_two(a, b, kind))
    assert answers == {Solved.UNSATISFIABLE}


def _no_two(a: smt.Term, b: smt.Term, kind: Int) -> Solved:
    """Whether two of some lines that say different things match together: none do."""
    solver = Solver(Limits())
    for each in (a, b):
        solver.add(
            smt.at_most(smt.literal(kind, 0), each, kind), smt.at_most(each, smt.literal(kind, 50), kind)
        )
    seen, twice = smt.truth(False), []
    for at in range(30):
        here, so_far = smt.variable(f"line{at}", Bool()), smt.variable(f"seen{at}", Bool())
        is_so = smt.all_of(
            [smt.equal(a, smt.literal(kind, at), kind), smt.at_most(smt.literal(kind, at % 3), b, kind)]
        )
        solver.add(smt.equal(here, is_so, Bool()), smt.equal(so_far, smt.any_of([seen, here]), Bool()))
        twice.append(smt.all_of([seen, here]))
        seen = so_far
    return solver.check(smt.any_of(twice))


def test_what_one_thread_gives_up_another_asks() -> None:
    """Nor is a question of this thread broken off by the end of another's."""
    given_up, left = threading.Event(), threading.Event()

    def gives_up() -> None:
        with smt.until(lambda: True, breaks_off=True):
            given_up.set()
            left.wait()

    other = threading.Thread(target=gives_up)
    other.start()
    given_up.wait()
    try:
        for _ in range(50):
            assert Solver(Limits()).check() is Solved.SATISFIABLE
    finally:
        left.set()
        other.join()


@pytest.mark.parametrize(
    "name", ["gallery/tcas/published.rcs", "examples/grip.rcs", "examples/acquire_published.rcs"]
)
def test_a_check_after_a_glance_has_what_the_glance_left_out(name: str) -> None:
    """Repairs, and whether lines do the same."""
    file = str(REPO / "tables" / name)
    workspace = Workspace()
    assert not any(each.told.proposals for each in workspace.glance(file).findings if each.code == "RCS402")
    answer = workspace.check(file)
    assert answer == Workspace().check(file)
    assert any(each.mendable for each in answer.findings)


@pytest.mark.parametrize(
    ("name", "each"), [("emove/locate.rcs", 7), ("gallery/tcas/published.rcs", 1), ("examples/grip.rcs", 1)]
)
def test_a_check_given_up_anywhere_leaves_nothing_wrong(name: str, each: int) -> None:
    """Nobody waits any more after so many questions; what came of those that were not asked is not kept."""
    file = str(REPO / "tables" / name)
    wanted = Workspace().check(file)
    workspace, given_up = Workspace(), 0
    for most in range(0, 40 * each, 4 * each):
        questions = list(range(most))
        try:
            workspace.check(file, partial(_one_less, questions))
        except OutdatedError:
            given_up += 1
        fresh = Workspace()
        fresh.memo = workspace.memo
        assert fresh.check(file) == wanted
        workspace.memo = Memo()
    assert given_up >= 2


def test_an_outdated_check_ends_and_leaves_nothing_wrong(tmp_path: Path) -> None:
    """After the question that is being asked."""
    workspace, file = Workspace(), str(tmp_path / "hard.rcs")
    Path(file).write_text(HARD)
    workspace.open(file, HARD.replace("| true  |", "|       |"))
    end_s = time.thread_time() + 0.03
    with pytest.raises(OutdatedError):
        workspace.check(file, lambda: time.thread_time() < end_s)
    workspace.open(file, HARD)
    after, fresh = (each.check(file).tables for each in (workspace, Workspace()))
    assert [each.standing for each in after] == [each.standing for each in fresh]


def test_nothing_is_asked_once_it_is_over() -> None:
    solver = smt.Solver()
    before = smt.unanswered()
    with smt.until(lambda: True):
        assert solver.check() is Solved.UNKNOWN
    assert smt.unanswered() == before + 1
    assert solver.check() is Solved.SATISFIABLE
    assert smt.unanswered() == before + 1


def test_a_question_that_ended_as_it_was_broken_off_leaves_the_solver_as_it_was(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Z3 hears of it a moment too late, again and again; who asks next is answered."""
    monkeypatch.setattr(smt, "WATCH_S", 0.0)
    turns, solver = itertools.count(1), Solver()
    for _ in range(200):
        broken, many = threading.Event(), smt.unanswered()

        def over(broken: threading.Event = broken) -> bool:
            if next(turns) % 7 == 0:
                broken.set()
            return broken.is_set()

        with smt.until(over, breaks_off=True):
            while smt.unanswered() == many:
                solver.check()
        solver.push()
        assert solver.check() is Solved.SATISFIABLE
        solver.pop()


THROWN_AWAY = """
import gc, sys, threading
from rcsc.desk.editor.workspace import Workspace
from rcsc.lang.model import Int
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Limits

Workspace()
gc.disable()
over = threading.Event()

def collect():
    while not over.wait(0.001):
        gc.collect()

collector = threading.Thread(target=collect)
collector.start()
kind = Int(0, 99)
names = [smt.variable(f"x{at}", kind) for at in range(12)]
answers = set()
for _ in range(60):
    solver = smt.Solver(Limits())
    for at in range(400):
        cycle = [smt.equal(names[at % 12], smt.literal(kind, at), kind)]
        cycle.append(cycle)  # nobody but the collector finds it
    for at in range(11):
        solver.add(smt.negation(smt.equal(names[at], names[at + 1], kind)))
    answers.add(solver.check().name)
    solver.add(smt.equal(names[0], names[1], kind))
    answers.add(solver.check().name)
over.set()
collector.join()
print(sorted(answers))
"""


def test_what_another_thread_throws_away_disturbs_no_question() -> None:
    """In a process of its own: it would end, or answer wrongly."""
    ran = subprocess.run([sys.executable, "-c", THROWN_AWAY], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "['SATISFIABLE', 'UNSATISFIABLE']\n", "")

"""One level proved in its environment.

In: a stepper (program, level, links). Out: a `LevelProof`: for each goal whether it holds in every reachable cycle, and the invariant that
shows it. Reachable states are never listed: the invariant holds before the first cycle, every cycle keeps it whatever the environment
does within its contract, and every cycle that begins in it fulfils the goals.
"""

import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from random import Random

from rcsc.compose.contract import COMMAND
from rcsc.compose.features import Feature, compared, features, point
from rcsc.compose.goals import Goal, Sort, goals
from rcsc.compose.keyed import Keyed
from rcsc.compose.projection import Clause, Inference, NotInferredError, Point
from rcsc.compose.transition import Cycle, Stepper
from rcsc.compose.walk import Walk
from rcsc.prove import smt, values
from rcsc.prove.smt import Answer, Solver, Term


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is spent.

    Attributes:
        walks: Random walks before the search, each of `cycles` cycles.
        timeout_ms: For each question; past it the answer is *undecided*, never *proved*.
    """

    walks: int = 120
    cycles: int = 150
    timeout_ms: int = 20_000


class Verdict(StrEnum):
    """What was found of a goal."""

    PROVED = "proved"
    NOT_PROVED = (
        "not proved"  # some state that the invariant allows breaks it: perhaps one that is never reached
    )
    UNDECIDED = "undecided"  # the solver gave up


@dataclass(frozen=True, slots=True)
class LevelProof:
    """What was found of a level.

    Attributes:
        found: Each goal with its verdict.
        features: What the clauses speak of.
        clauses: The invariant: combinations that never stand; empty where none was found.
        walked: States seen on walks; `learnt`, those that the solver added.
        seconds: Wall time, for the report.
    """

    level: str
    found: tuple[tuple[Goal, Verdict], ...]
    features: tuple[Feature, ...]
    clauses: tuple[Clause, ...]
    walked: int
    learnt: int
    seconds: float = field(compare=False)

    def verdict(self, sort: Sort, table: str = "", name: str = "") -> Verdict:
        """Of one goal.

        Raises:
            KeyError: There is none such.
        """
        for goal, verdict in self.found:
            if (goal.sort, goal.table, goal.name) == (sort, table, name):
                return verdict
        raise KeyError(name)

    @property
    def open(self) -> tuple[Goal, ...]:
        """The goals that are not proved."""
        return tuple(goal for goal, verdict in self.found if verdict is not Verdict.PROVED)


def prove_level(stepper: Stepper, effort: Effort | None = None) -> LevelProof:
    """Proves every goal of a level that can be proved with the invariants found."""
    effort = effort or Effort()
    begun = time.perf_counter()
    cycle = stepper.cycle(stepper.anywhere())
    wanted = goals(stepper, cycle)
    chosen = features(
        stepper, cycle, [*(goal.holds for goal in wanted if _matters(stepper, goal)), cycle.contract]
    )
    walked = dict.fromkeys(_states(stepper, chosen, effort))
    firsts = tuple(_firsts(stepper).values())
    cases = [at.chosen for at in cycle.tables]
    inference = Inference(chosen, firsts, cycle, cases, Keyed(), effort.timeout_ms)
    try:
        clauses = inference.invariant(walked)
        _confirm(inference, clauses)
    except NotInferredError:
        clauses = []
        verdicts = [(goal, Verdict.UNDECIDED) for goal in wanted]
    else:
        verdicts = list(_verdicts(stepper, inference, clauses, wanted))
    seconds = time.perf_counter() - begun
    return LevelProof(
        stepper.level.name, tuple(verdicts), chosen, tuple(clauses), len(walked), inference.found, seconds
    )


def _confirm(inference: Inference, clauses: list[Clause]) -> None:
    """Asks anew, in fresh solvers, whether the clauses are an invariant: the search is not to be trusted.

    Raises:
        NotInferredError: They are not, or a solver gave up.
    """
    questions = [inference.first_question(clauses, first) for first in inference.firsts]
    questions += [inference.step_question(clauses, case) for case in inference.cases]
    if any(question.check() is not Answer.UNSATISFIABLE for question in questions):
        raise NotInferredError


def _matters(stepper: Stepper, goal: Goal) -> bool:
    """Whether its cone is looked at for features: not that of fields which the level does not compare with the last ones."""
    if goal.sort is not Sort.NUMBERED:
        return True
    return goal.name.endswith(f".{COMMAND}") or any(goal.name in pair for pair in compared(stepper.program))


def _states(stepper: Stepper, chosen: tuple[Feature, ...], effort: Effort) -> Iterable[Point]:
    """The features of states that walks reach."""
    for seed in range(max(1, effort.walks)):
        walk = Walk(stepper.program, stepper.level, stepper.links, Random(seed))  # noqa: S311  # repeatable on purpose
        for state in walk.states(effort.cycles):
            yield point(stepper, chosen, state)


def _firsts(stepper: Stepper) -> dict[str, Cycle]:
    """The cycles with which a level can begin."""
    return {
        "first": stepper.cycle(stepper.first(), " at first"),
        "restart": stepper.cycle(stepper.restarted(), " at restart"),
    }


def _verdicts(
    stepper: Stepper, inference: Inference, clauses: list[Clause], wanted: tuple[Goal, ...]
) -> Iterable[tuple[Goal, Verdict]]:
    """Asks for each goal whether a first cycle, or a cycle from the invariant, can break it."""
    keyed = inference.keyed
    every = [wanted, *(goals(stepper, first) for first in inference.firsts)]
    asked = [[keyed.term(values.negation(goal.holds)) for goal in each] for each in every]
    solvers = [inference.known(clauses), *(inference.beginning(first) for first in inference.firsts)]
    for at, goal in enumerate(wanted):
        answers = {_asked(solver, terms[at]) for solver, terms in zip(solvers, asked, strict=True)}
        if answers == {Answer.UNSATISFIABLE}:
            yield goal, Verdict.PROVED
        else:
            yield goal, Verdict.NOT_PROVED if Answer.SATISFIABLE in answers else Verdict.UNDECIDED


def _asked(solver: Solver, term: Term) -> Answer:
    solver.push()
    solver.add(term)
    answer = solver.check()
    solver.pop()
    return answer


def certificate(stepper: Stepper, proof: LevelProof, timeout_ms: int = 20_000) -> dict[str, str]:
    """Questions in SMT-LIB, each to be answered `unsat` by any solver, that together show what was proved.

    `first` and `restart`: such a cycle leads into the invariant; `step TABLE`: a later cycle in which this table runs keeps
    it; `goals first`, `goals restart` and `goals`: such cycles, and every cycle from the invariant, fulfil the goals that are proved.
    """
    cycle, firsts = stepper.cycle(stepper.anywhere()), _firsts(stepper)
    cases = [at.chosen for at in cycle.tables]
    inference = Inference(proof.features, tuple(firsts.values()), cycle, cases, Keyed(), timeout_ms)
    clauses = list(proof.clauses)
    found = {name: inference.first_question(clauses, first).script() for name, first in firsts.items()}
    for at in cycle.tables:
        found[f"step {at.table.name}"] = inference.step_question(clauses, at.chosen).script()
    proved = {
        (goal.sort, goal.table, goal.name) for goal, verdict in proof.found if verdict is Verdict.PROVED
    }
    for name, one in (*firsts.items(), ("", cycle)):
        wanted = [goal for goal in goals(stepper, one) if (goal.sort, goal.table, goal.name) in proved]
        bad = smt.any_of([inference.keyed.term(values.negation(goal.holds)) for goal in wanted])
        solver = inference.known(clauses) if one is cycle else inference.beginning(one)
        solver.add(*inference.keyed.ranges, bad)
        found[f"goals {name}".strip()] = solver.script()
    return found


def shown(chosen: tuple[Feature, ...], clause: Clause) -> str:
    """A combination in the tables' words."""
    return " and ".join(f"{chosen[at].name} = {chosen[at].shown(value)}" for at, value in clause)

"""What vectors reach of the C, as the language knows it, and what is still open.

In: a marked program, the plan of its C, and cases. Out: for each case what it *hits*: how each decision went, which
line ran, which fault ended it, what was refused and on which side, which class of a leaf was looked up. Every branch of
the C belongs to one of these, so that a set that hits all of them covers the C; a compiler then measures it.
"""

import math
from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import reduce
from itertools import combinations
from operator import and_
from typing import TypeAlias

from rcsc.code.emit.c.ctext import c_type
from rcsc.code.emit.plan import Coded, Cuts, Direct, Index, Matcher, Plan, Truth
from rcsc.code.testing.coverage.case import Case, Expected, ends_of, outside_of, ran
from rcsc.code.testing.coverage.marks import Decision, Marked, Outcomes
from rcsc.lang.interpret import Fault, evaluate, holds
from rcsc.lang.model import (
    Admit,
    Bool,
    Int,
    Kind,
    Level,
    OneTable,
    Program,
    Real,
    Snapshot,
    Value,
    Variable,
    key_bounds,
    key_of,
)

Hit: TypeAlias = tuple[Hashable, ...]


@dataclass(slots=True)
class Reached:
    """What cases reach of one program.

    Attributes:
        ways: Of each decision, how it went, in all cases that were kept.
    """

    program: Program
    plan: Plan
    marked: Marked
    hits: set[Hit] = field(default_factory=set)
    ways: dict[int, dict[tuple[Outcomes, bool], None]] = field(default_factory=dict)

    def of(self, case: Case, right: Expected) -> set[Hit]:
        """What a case hits."""
        self.marked.forget()
        entry = case.entry
        hits: set[Hit] = {("entry", entry)}
        match entry.kind:
            case "check":
                hits.update(self._checked(case, right.result))
            case "line" | "lines":
                hits.update(self._matched(case, right))
            case "step" | "cycle":
                hits.update(self._run(case, right))
        for at, decision in enumerate(self.marked.decisions):
            hits |= {("decision", at, outcomes, truth) for outcomes, truth in decision.seen}
        for at, meets in enumerate(self.marked.meets):
            hits |= {("meets", at, apart) for apart in meets.seen}
        return hits

    def keep(self, hits: Iterable[Hit]) -> None:
        """Count what a case hits."""
        for hit in hits:
            self.hits.add(hit)
            match hit:
                case ("decision", int(at), outcomes, bool(truth)):
                    self.ways.setdefault(at, {})[(outcomes, truth)] = None  # type: ignore[index]  # as `of` makes it

    def _checked(self, case: Case, result: int) -> Iterator[Hit]:
        variables, before = self.program.variables, case.before
        if case.foreign:  # nothing else of it is looked at
            yield ("foreign",)
            return
        if 0 <= result < len(variables):
            variable = variables[result]
            yield ("unfit", variable.name, side(variable, before[variable.name]))
            yield from [("unfit together",)] if self._most_beyond(before, Kind.STATE, Kind.OUTPUT) else []
            return
        yield ("checked", result)
        yield from (("fits", *at) for at in self._at_ends(before))
        for at, invariant in enumerate(self.marked.program.invariants, len(variables)):
            if result in range(at):
                return
            holds(invariant.condition, before)

    def _most_beyond(self, before: Snapshot, *kinds: Kind) -> bool:
        """Whether all variables of these kinds are beyond their ranges that can be, and there are several."""
        own = [v for v in self.program.variables if v.kind in kinds and not isinstance(v.type, Bool)]
        can = [v for v in own if outside_of(v, c_type(v.type))]
        return len(can) > 1 and all(side(v, before[v.name]) for v in can)

    def _at_ends(self, before: Snapshot, *kinds: Kind) -> Iterator[tuple[Hashable, Hashable]]:
        """Which variables are at which end of their range."""
        for variable in self.program.variables:
            looked_at = not isinstance(variable.type, Bool) and (variable.kind in kinds or not kinds)
            if looked_at and before[variable.name] in ends_of(variable.type):
                yield variable.name, before[variable.name]

    def _matched(self, case: Case, right: Expected) -> Iterator[Hit]:
        table = self.marked.program.table(case.entry.name)
        if case.entry.kind == "lines":
            return
        yield ("matched", table.name, min(right.result, 0))
        yield from (("shows", table.name, at) for at in case.shows)
        for test in {id(t): t for line in table.lines for t in line.tests if t is not None}.values():
            if test.box is None:
                holds(test.condition, case.before)
        matcher = next(one.matcher for one in self.plan.tables if one.table.name == table.name)
        for probe in (probe for group in matcher.groups for probe in group):
            match probe.index:  # the class of each leaf that the C finds by comparing
                case Direct(leaf=leaf, type=Bool()) | Cuts(leaf=leaf):
                    yield ("class", table.name, leaf, class_of(probe.index, case.before))
        yield from (("bit", table.name, *bit) for bit in bits_of(matcher, case.before))

    def _run(self, case: Case, right: Expected) -> Iterator[Hit]:
        entry, after = case.entry, right.after
        assert after is not None
        if case.mode:
            yield ("mode", case.mode)
            return
        yield ("fault", entry, right.result, right.fault_at if right.result != Fault.ADMIT else "")
        if right.result == Fault.ADMIT:
            variable = self.program.variable(right.fault_at)
            yield ("refused", variable.name, *beyond(variable, case.before[variable.name]))
            yield from [("refused together",)] if self._most_beyond(case.before, Kind.INPUT) else []
            yield from self._changed(case, right, after)
            return
        yield from (("admitted", *at) for at in self._at_ends(case.before, Kind.INPUT))
        reals = (v.name for v in self.program.variables if isinstance(v.type, Real) and v.kind is Kind.INPUT)
        yield from (("signed", name) for name in reals if str(case.before[name]) == "-0.0")
        yield from self._changed(case, right, after)
        yield from self._answered(case, right)
        for variable in self.program.variables:
            if variable.kind is Kind.INPUT and variable.admit is Admit.CLAMP:
                yield ("clamped", variable.name, *beyond(variable, case.before[variable.name]))
        ran(self.marked.program, case)
        for decision in self.marked.decisions:
            if decision.place.kind == "test":  # the interpreter looks at fewer tests than the C
                decision.seen = {}
        yield from self._told(entry.name, right.failed) if entry.kind == "step" else ()
        if entry.kind == "step" and right.line >= 0:
            yield ("ran", entry.name, right.line)
        if entry.kind == "cycle":
            yield from self._chosen(next(x for x in self.program.levels if x.name == entry.name), after)

    def _changed(self, case: Case, right: Expected, after: Snapshot) -> Iterator[Hit]:
        """Which states and outputs have another value afterwards, and whether that is an end of their range.

        A statement that is lost shows where it would have changed something, and a sum that wraps shows at an end.
        """
        way = right.result or right.line
        for variable in self.program.variables:
            name = variable.name
            if variable.kind is not Kind.INPUT and after[name] != case.before[name]:
                low, high = ends_of(variable.type)
                end = {low: "least", high: "greatest"}.get(after[name], "")
                yield ("became", case.entry, bool(right.result), way, name, end)

    def _answered(self, case: Case, right: Expected) -> Iterator[Hit]:
        """What extern procedures gave: each leaf on each side of its range, and where a refusal ended the cycle."""
        procedures = {str(procedure.name): procedure for procedure in self.program.procedures}
        for number, answer in enumerate(case.answers, 1):
            for name, value in zip(procedures[answer.procedure].writes, answer.values, strict=True):
                variable = self.program.variable(name)
                beyond = side(variable, value)
                near = (*ends_of(variable.type), *outside_of(variable, "int64_t").values())
                yield ("given", answer.procedure, name, beyond, value in near and value)
                if right.result == Fault.EXTERN and number == len(case.answers):
                    yield ("ended by", case.entry, number, name, beyond)

    def _told(self, name: str, failed: tuple[str, ...]) -> Iterator[Hit]:
        """How each assumption that the table checks went, and whether one before it had ended the cycle."""
        table, ended = self.program.table(name), False
        for at in self.plan.monitored:
            assumption = self.program.assumptions[at].name
            if assumption in table.assumptions:
                fails = assumption in failed
                yield ("told", name, assumption, fails, fails and ended)
                ended = ended or (fails and assumption in table.stops)

    def _chosen(self, level: Level, after: Snapshot) -> Iterator[Hit]:
        """Which table of each choice ran, by what selects it."""
        for at, choice in enumerate(level.choices):
            if not isinstance(choice, OneTable):
                yield ("chosen", level.name, at, evaluate(choice.selector, after))

    # --- what is open ---

    def number_of(self, decision: Decision) -> int:
        """The position of a decision in the program."""
        return self.marked.decisions.index(decision)

    def open_goals(self) -> Iterator["Goal"]:
        """Conditions that no case kept so far shows to have both truths, or to decide on their own."""
        for at, decision in enumerate(self.marked.decisions):
            ways = self.ways.get(at, {})
            for number in sorted(set(range(len(decision.conditions))) - decision.constant):
                for truth in (True, False):
                    if not any(outcomes[number] is truth for outcomes, _ in ways):
                        yield Goal(decision, number, truth)
                if len(decision.conditions) > 1 and not decides(ways, number):
                    yield Goal(decision, number, None)


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """A condition to be shown.

    Attributes:
        number: Of the condition in its decision.
        truth: The truth that it is to have; None where it is to decide on its own.
    """

    decision: Decision
    number: int
    truth: bool | None

    @property
    def condition(self) -> str:
        """The condition in words."""
        return self.decision.conditions[self.number]

    @property
    def wanted(self) -> str:
        """What is to be shown, in words."""
        return "decides on its own" if self.truth is None else str(self.truth).lower()


def bits_of(matcher: Matcher, before: Snapshot) -> Iterator[tuple[int, tuple[int, ...], int]]:
    """Bits of masks that a line's place turns on here: group, classes, and line, where all other groups leave the line."""
    looked = [tuple(class_of(probe.index, before) for probe in group) for group in matcher.groups]
    every = (1 << matcher.lines) - 1
    masks = [
        reduce(and_, (probe.masks[at] for probe, at in zip(group, classes, strict=True)), every)
        for group, classes in zip(matcher.groups, looked, strict=True)
    ]
    for number, classes in enumerate(looked):
        left = reduce(and_, (mask for other, mask in enumerate(masks) if other != number), every)
        yield from ((number, classes, line) for line in range(matcher.lines) if left >> line & 1)


def class_of(index: Index, before: Snapshot) -> int:
    """The class of a value that the C looks up or finds by comparing."""
    match index:
        case Direct(leaf=leaf, type=kind, low=low):
            return key_of(kind, before[leaf]) - low
        case Coded(leaf=leaf, type=kind, low=low, classes=classes):
            return classes[key_of(kind, before[leaf]) - low]
        case Cuts(leaf=leaf, cuts=cuts):
            return sum(before[leaf] >= cut for cut in cuts)
        case Truth(condition=condition):
            return int(holds(condition, before))


def decides(ways: Mapping[tuple[Outcomes, bool], None], number: int) -> bool:
    """Whether two of these ways show that the condition decides: it and the truth differ, others only where one is not looked at.

    Source: unique-cause MC/DC with short-circuit operators, as `llvm-cov` counts it.
    """
    return any(pairs(one, other, number) for one, other in combinations(ways, 2))


def decides_masked(
    ways: Mapping[tuple[Outcomes, bool], None], every: Iterable[tuple[Outcomes, bool]], number: int
) -> bool:
    """Whether two of these ways show that the condition decides, others differing where they decide nothing.

    Args:
        ways: Ways that were seen.
        every: All ways in which the decision can go: what a condition decides in a way is seen beside another.
        number: Of the condition.

    Source: masking MC/DC (CAST-6, "Rationale for accepting masking MC/DC in certification projects", 2001).
    """
    every = tuple(every)
    deciding = {(way[0][number], way[1]) for way in ways if any(pairs(way, other, number) for other in every)}
    return any((not value, not truth) in deciding for value, truth in deciding)


def pairs(one: tuple[Outcomes, bool], other: tuple[Outcomes, bool], number: int) -> bool:
    """Whether two ways show together that a condition decides."""
    (first, truth), (second, other_truth) = one, other
    if (
        truth is other_truth
        or first[number] is None
        or second[number] is None
        or first[number] is second[number]
    ):
        return False
    return all(
        a is b or a is None or b is None
        for at, (a, b) in enumerate(zip(first, second, strict=True))
        if at != number
    )


def beyond(variable: Variable, value: Value) -> tuple[str, bool]:
    """The end of its range that a value is beyond, and whether it is the first one there: any other leaves the bound open."""
    end = side(variable, value)
    return end, outside_of(variable, "int64_t").get(end) == value


def side(variable: Variable, value: Value) -> str:
    """The end of its range that a value is beyond: `below`, `above`, or `nan`; empty where it lies inside."""
    kind = variable.type
    if isinstance(kind, Real) and math.isnan(value):
        return "nan"
    low, high = (kind.low, kind.high) if isinstance(kind, Int | Real) else key_bounds(kind)
    return "below" if value < low else "above" if value > high else ""

"""Why what was not measured cannot be: from a place in the C back to what was shown of the language.

In: what llvm-cov measured, and what the vectors' search showed out of reach. Out: for every branch, condition and
statement that is not covered a reason that rests on a proof, or none, which is a shortfall. A function of the C has
the conditions of its procedure in the same order; where their numbers differ, nothing is explained.
"""

import re
from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.code.emit.c.ctext import DIVIDED, SHORT, c_type
from rcsc.code.emit.c.helpers import HELD
from rcsc.code.emit.identifiers import Names
from rcsc.code.emit.plan import Cuts, Direct, Plan, Truth
from rcsc.code.testing.agree import NONE, SEVERAL
from rcsc.code.testing.coverage.case import outside_of
from rcsc.code.testing.coverage.directed import Unreached
from rcsc.code.testing.coverage.marks import Decision as Marked
from rcsc.code.testing.coverage.marks import Place
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Admit, Bool, Kind, Level, Real, Table
from rcsc.views.evidence.kind import Missed, Shortfall
from rcsc.views.evidence.llvm import Decision, Measured, Point, Region

LOOP = re.compile(r"v_\w+ <=? |more_\w+$|[ik] <=? ")
GUARD = re.compile(r"\(?s->fault [!=]= \w+\)?$")
NO_LINE = re.compile(r"\(?(m|seen) == 0|case \(-1\)")
SEVERAL_LINES = re.compile(r"several$|\(?several != 0|default$")
MACHINE = (
    "out of reach in this build, each way of rounding was played; it guards against a compiler that contracts or keeps more digits,"
    " as `clang -mfma -ffp-contract=fast` does"
)
ADMITTED = "no input of this program can be refused"
UNENDED = "no table before the last can be without its one line"
ENDS = {Fault.NO_LINE: NONE, Fault.SEVERAL_LINES: SEVERAL}
COMPLETE = "every value of the selector has a table, and no other is admitted"
FAULTLESS = (
    "no table of this cycle can leave a fault: that none of its lines matches, or several, is out of reach"
)
PROVED = "the value was proved to lie there, wherever the function is called"
NO_WAY = "no branch leads here: see those of this function"
OTHER_LINE = "the table has no other line, and no other outcome is within reach"


def uncovered(source: str, missed: Iterable[Missed]) -> list[Shortfall]:
    """Return a shortfall for each place of a C file that was not covered, and that no reason explains."""
    return [
        Shortfall(f"{source}:{each.line}", f"{each.function}: not covered: {each.what}")
        for each in missed
        if not each.reason
    ]


@dataclass(slots=True)
class Reasons:
    """Explains one program.

    Attributes:
        decisions: Of the language, in order.
        shown: Reasons by key (see `Unreached`), of what was shown to be out of reach.
        held: Functions that keep a number where it was proved to lie.
    """

    plan: Plan
    names: Names
    decisions: Sequence[Marked]
    unreached: Sequence[Unreached]
    shown: Mapping[Hashable, str] = field(init=False)
    places: Mapping[str, list[Place]] = field(init=False)
    held: Collection[str] = field(init=False)

    def __post_init__(self) -> None:
        self.shown = {each.key: each.reason for each in self.unreached if each.shown}
        self.places = dict(self._places())
        self.held = {f"{self.names.program}_{op}_{short}" for op in HELD for short in SHORT}

    def _places(self) -> Iterator[tuple[str, list[Place]]]:
        """Yield the places of the decisions of each function."""
        p, names, program = self.names.program, self.names, self.plan.program
        for procedure in program.procedures:
            yield f"{p}_do_{names.procedures[procedure.name]}", [Place("procedure", procedure.name)]
        for at, number in enumerate(self.plan.monitored):
            yield names.holding[at], [Place("assumption", program.assumptions[number].name)]
        deferred = [Place("deferred", v.name) for v in program.variables if v.deferred_until is not None]
        yield f"{p}_settle", deferred
        yield f"{p}_admit", deferred
        yield f"{p}_check", [Place("invariant", invariant.name) for invariant in program.invariants]
        for table in self.plan.tables:
            lines = [Place("line", table.table.name, line.name) for line in table.lines]
            yield f"{p}_run_{names.tables[table.table.name]}", lines
        for name, kind in SHORT.items():
            for op in ("abs", "min", "max"):
                yield f"{p}_{op}_{name}", [Place("operator", f"{op} of {kind}")]
            for division, called in DIVIDED.items():
                yield f"{p}_{called}_{name}", [Place("operator", f"{division.value} of {kind}")]

    # --- what was missed ---

    def missed(self, measured: Measured) -> Iterator[Missed]:
        """Yield everything that was not covered, each with its reason."""
        by_function: dict[str, list[Point]] = {}
        for point in measured.branches:
            by_function.setdefault(point.function, []).append(point)
        explained: dict[str, list[str]] = {}
        for function, points in by_function.items():
            for point, truth in _not_seen(points):
                reason = self.branch(point, truth, points)
                explained.setdefault(function, []).append(reason)
                yield Missed(function, point.line, f"`{point.text}` {str(truth).lower()}", reason)
        for decision in measured.decisions:
            inside = [other for other in measured.decisions if other.function == decision.function]
            for number, shown in enumerate(decision.shown):
                if not shown:
                    what = f"condition {number + 1} of {len(decision.shown)} decides on its own"
                    reason = self.condition(decision, number, inside)
                    yield Missed(decision.function, decision.line, what, reason)
        told = [reason for points in by_function.values() for reason in self._safe(points)]
        explained[f"{self.names.program}_safe"] = told
        for region in measured.regions:
            if region.count == 0:
                reasons = explained.get(region.function, [])
                reason = NO_WAY if reasons and all(reasons) else self._of_constant(region)
                yield Missed(region.function, region.line, "statement", reason)

    def _safe(self, points: Sequence[Point]) -> Iterator[str]:
        """Yield, for each place that would show safe values, the reason why it is not reached."""
        for point in points:
            if GUARD.match(point.text) and "!=" in point.text:
                yield "" if point.true else self.branch(point, True, points)

    def _of_constant(self, region: Region) -> str:
        """Return the reason why a choice by a constant, which counts as no branch, has no such value."""
        table = self._table(region.function)
        which = {"(-1)": NONE, "(-2)": SEVERAL}.get(region.text[:4])
        return "" if table is None else self.shown.get(("matched", table.name, which), "")

    def branch(self, point: Point, truth: bool, points: Sequence[Point]) -> str:
        """Return the reason why a condition cannot have this truth value; "" where none is known."""
        function = point.function
        if function == f"{self.names.program}_exact" or point.text.startswith(
            f"!{self.names.program}_exact()"
        ):
            return MACHINE
        if function in self.held:
            keys = self._keys(function)  # of a division: the sign of the divisor
            if keys and point.text == "b > 0":
                return self._reason(keys[0], truth)
            return "" if truth else PROVED
        table = self._table(function)
        if table is not None and (reason := self._of_table(table, point, truth)):
            return reason
        if (step := self._step(function)) is not None:
            return self._of_step(step, point, truth)
        if (level := self._level(function)) is not None:
            return self._of_level(level, point, truth, points)
        keys = self._line_keys(table) if table and self._matches(function, table) else self._keys(function)
        own = [other for other in points if not _generic(other.text)]
        place = own.index(point) - (len(own) - len(keys)) if point in own else -1
        if function.endswith(("_check", "_admit")) and 0 <= place < len(keys):
            return self._reason(keys[place], truth)
        return self._reason(keys[place], truth) if len(own) == len(keys) and place >= 0 else ""

    def _reason(self, key: Hashable, truth: bool) -> str:
        match key:
            case ("classes", name, leaf, false, true):
                classes = true if truth else false
                reasons = [self.shown.get(("class", name, leaf, at), "") for at in classes]  # type: ignore[attr-defined]
                return reasons[0] if reasons and all(reasons) else ""
            case (int(decision), int(number)):
                wanted = truth is not (number in self.decisions[decision].negated)
                return self.shown.get(("decision", decision, number, wanted), "")
        return ""

    def _keys(self, function: str) -> list[Hashable]:
        """Return decision and number of each condition of a function, in order."""
        places = self.places.get(function, [])
        inside = [(at, d) for place in places for at, d in enumerate(self.decisions) if d.place == place]
        return [
            (at, number)
            for at, decision in inside
            for number in range(len(decision.conditions))
            if number not in decision.constant
        ]

    def _line_keys(self, table: Table) -> list[Hashable]:
        """Return the key of each comparison of a matcher: classes of a leaf, or a condition of a test."""
        planned = next(each for each in self.plan.tables if each.table.name == table.name)
        keys: list[Hashable] = []
        for probe in (probe for group in planned.matcher.groups for probe in group):
            match probe.index:
                case Direct(leaf=leaf, type=Bool()):
                    keys.append(("classes", table.name, leaf, (0,), (1,)))
                case Cuts(leaf=leaf, cuts=cuts):
                    whole = range(len(cuts) + 1)
                    keys += [
                        ("classes", table.name, leaf, tuple(whole[: at + 1]), tuple(whole[at + 1 :]))
                        for at, _ in enumerate(cuts)
                    ]
                case Truth(condition=condition):
                    at = next(
                        at
                        for at, d in enumerate(self.decisions)
                        if d.form == condition and d.place.kind == "test" and d.place.name == table.name
                    )
                    numbers = range(len(self.decisions[at].conditions))
                    keys += [(at, n) for n in numbers if n not in self.decisions[at].constant]
        return keys

    def condition(self, decision: Decision, number: int, inside: Sequence[Decision]) -> str:
        """Return the reason why a condition cannot be shown to decide on its own; "" where none is known."""
        function, table = decision.function, self._table(decision.function)
        if function == f"{self.names.program}_exact":
            return MACHINE
        if (
            level := self._level(function)
        ) is not None:  # it decides by the two ends of a table before its last
            return (
                self._excluded(level, tuple(ENDS.values())[number])
                if len(decision.shown) == len(ENDS)
                else ""
            )
        keys = self._line_keys(table) if table and self._matches(function, table) else self._keys(function)
        joint: dict[int, list[int]] = {}
        for key in keys:
            match key:
                case (int(at), int(which)):
                    joint.setdefault(at, []).append(which)
        several = [(at, numbers) for at, numbers in joint.items() if len(numbers) > 1]
        skipped = len(inside) - len(several) if function.endswith(("_check", "_admit")) else 0
        place = inside.index(decision) - skipped
        if len(several) + skipped != len(inside) or not 0 <= place < len(several):
            return ""
        at, numbers = several[place]
        if len(numbers) != len(decision.shown):
            return ""
        keyed = (("decision", at, numbers[number], truth) for truth in (None, True, False))
        return next((self.shown[key] for key in keyed if key in self.shown), "")

    # --- tables and levels ---

    def _table(self, function: str) -> Table | None:
        p, names = self.names.program, self.names.tables
        for table in self.plan.program.tables:
            if self._matches(function, table) or function == f"{p}_run_{names[table.name]}":
                return table
        return None

    def _matches(self, function: str, table: Table) -> bool:
        """Return whether it is the function that finds the line of a table."""
        return function == f"{self.names.program}_match_{self.names.tables[table.name]}"

    def _of_table(self, table: Table, point: Point, truth: bool) -> str:
        """Return the reason why it is out of reach that no line matches, or several, or that a line runs."""
        if not truth:  # a switch on one line alone
            alone = len(table.lines) + (table.default is not None) == 1 and point.text.startswith("case ")
            return OTHER_LINE if alone and self._matched_once(table) else ""
        if NO_LINE.match(point.text):
            return self.shown.get(("matched", table.name, NONE), "")
        if SEVERAL_LINES.match(point.text):
            return self.shown.get(("matched", table.name, SEVERAL), "")
        if point.text.startswith("case "):
            constants = self.names.lines[table.name]
            at = next((at for at, name in enumerate(constants) if point.text == f"case {name}"), -1)
            return self.shown.get(("ran", table.name, at), "")
        return ""

    def _matched_once(self, table: Table, level: Level | None = None) -> bool:
        """Return whether both no line and several lines are out of reach: anywhere, or in the cycle of a level."""
        return self._never(table, NONE, level) and self._never(table, SEVERAL, level)

    def _never(self, table: Table, which: int, level: Level | None) -> bool:
        """Return whether it is out of reach that no line of a table matches, or several."""
        if which == NONE and table.default is not None:
            return True
        name = str(table.name)
        in_cycle = level is not None and ("ended", level.name, name, which) in self.shown
        return in_cycle or ("matched", name, which) in self.shown

    def _level(self, function: str) -> Level | None:
        p, names = self.names.program, self.names.levels
        levels = (level for level in self.plan.program.levels if function == f"{p}_{names[level.name]}_cycle")
        return next(levels, None)

    def _step(self, function: str) -> Table | None:
        p, names = self.names.program, self.names.tables
        tables = self.plan.program.tables
        return next((table for table in tables if function == f"{p}_{names[table.name]}_step"), None)

    def _of_step(self, table: Table, point: Point, truth: bool) -> str:
        """Return the reason why a step is not refused, or ends in no fault."""
        if not GUARD.match(point.text) or truth is not ("!=" in point.text) or self._refuses():
            return ""
        return ADMITTED if "==" in point.text else FAULTLESS if self._sound([table]) else ""

    def _of_level(self, level: Level, point: Point, truth: bool, points: Sequence[Point]) -> str:
        """Return the reason why a cycle is not refused, ends in no fault, or always has a table for its command."""
        tables = [table for table in self.plan.program.tables if table.name in level.table_names]
        guards = [other for other in points if GUARD.match(other.text)]
        if point in guards:
            for fault, which in ENDS.items():
                if point.text.strip("()").endswith(self.names.faults[fault]):
                    return self._excluded(level, which) if truth else ""
            if truth is not ("!=" in point.text) or ((point is guards[0] or truth) and self._refuses()):
                return ""
            return ADMITTED if point is guards[0] else FAULTLESS if self._sound(tables, level) else ""
        choices = [other for other in points if other.text.startswith("chosen")]
        last = point in choices and not truth
        if last and all(other.false for other in choices if other.line < point.line):
            return COMPLETE
        return ""

    def _excluded(self, level: Level, which: int) -> str:
        """Return the reason why every table of a cycle before its last has a line, or not several."""
        tables = [table for table in self.plan.program.tables if table.name in level.staged]
        return UNENDED if all(self._never(table, which, level) for table in tables) else ""

    def _sound(self, tables: Sequence[Table], level: Level | None = None) -> bool:
        """Return whether these tables leave no fault."""
        extern = any(procedure.extern for procedure in self.plan.program.procedures)
        return not extern and all(self._matched_once(table, level) and not table.stops for table in tables)

    def _refuses(self) -> bool:
        """Return whether some input, or the state, can be refused."""
        return self.plan.defensive or any(
            variable.kind is Kind.INPUT
            and not isinstance(variable.type, Bool)
            and (variable.admit is Admit.REJECT or isinstance(variable.type, Real))
            and bool(outside_of(variable, c_type(variable.type)))
            for variable in self.plan.program.variables
        )


def _generic(text: str) -> bool:
    """Return whether it is no expression of the language: a condition of a loop, a fault, a switch or a match."""
    patterns = (LOOP, GUARD, NO_LINE, SEVERAL_LINES)
    return any(pattern.match(text) for pattern in patterns) or text.startswith("case ") or "_holds_" in text


def _not_seen(points: Sequence[Point]) -> Iterator[tuple[Point, bool]]:
    for point in points:
        if not point.true:
            yield point, True
        if not point.false:
            yield point, False

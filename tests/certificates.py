"""Attacks the checker of certificates, and sees that it accepts what is right.

`python -m tests.certificates --count 10000 --seed 1` makes random small programs. Of each that the prover proves, the
certificate is put before the checker: none may be refused. Then certificates are damaged (values dropped, changed, cut short, put
elsewhere, taken from another program) and programs are edited under a certificate that is kept, both mostly signed anew; what is
still accepted must be true. What is true is told here by brute force: every value of every leaf, run by `rcsc.lang.interpret`'s operators.
"""

import argparse
import copy
import json
import random
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, product
from typing import Any

from rcsc.lang.interpret import initial
from rcsc.lang.meaning import digest
from rcsc.lang.model import (
    COMPARISONS,
    Among,
    Apply,
    Assign,
    AssumptionName,
    Call,
    Case,
    Default,
    Expr,
    For,
    If,
    Int,
    Kind,
    Line,
    Literal,
    Local,
    Op,
    Program,
    Read,
    ReadLocal,
    Scalar,
    Select,
    Standing,
    Statement,
    Table,
    TableByCommand,
    ToElement,
    ToLeaf,
    Value,
    key_bounds,
    pending,
    value_of_key,
)
from rcsc.lang.operator_table import divide
from rcsc.lang.resolve import compile_text
from rcsc.proof.certify import certify
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program

OPTIONS = Options(solver="boxes")
MOST_STATES = 1_000

# --- what is true ----------------------------------------------------------------------


class WrongError(Exception):
    """Something that the program owes does not hold."""


@dataclass(slots=True)
class _Choices:
    """Results of extern procedures, all of them one run after the other."""

    made: list[tuple[int, int]] = field(default_factory=list)
    at: int = 0

    def of(self, count: int) -> int:
        if self.at == len(self.made):
            self.made.append((0, count))
        self.at += 1
        return self.made[self.at - 1][0]

    def next(self) -> bool:
        while self.made and self.made[-1][0] + 1 == self.made[-1][1]:
            self.made.pop()
        if not self.made:
            return False
        self.made[-1] = self.made[-1][0] + 1, self.made[-1][1]
        self.at = 0
        return True


def values(kind: Scalar) -> list[Value]:
    low, high = key_bounds(kind)
    return [value_of_key(kind, key) for key in range(low, high + 1)]


def wrong_with(program: Program) -> str:
    """What the program, with the stopping assumptions of its tables, owes and does not keep; "" if nothing."""
    try:
        _Truth(program).all()
    except WrongError as error:
        return str(error)
    return ""


class _Truth:
    def __init__(self, program: Program) -> None:
        self.program = program
        self.procedures = {str(procedure.name): procedure for procedure in program.procedures}
        self.types = {str(variable.name): variable.type for variable in program.variables}
        self.outputs = {str(variable.name) for variable in program.variables if variable.kind is Kind.OUTPUT}
        self.uncalled = self.procedures.keys() - self.called()

    def all(self) -> None:
        first = initial(self.program)
        self.owe(
            all(key_bounds(k)[0] <= first[n] <= key_bounds(k)[1] for n, k in self.types.items()), "initial"
        )
        self.owe(self.kept(first), "an invariant at first")
        states = [dict(zip(self.types, at, strict=True)) for at in product(*map(values, self.types.values()))]
        for state in states:
            for invariant in self.program.invariants:
                self.value(invariant.condition, state, {})
            self.alone(state)
            if self.kept(state):
                self.cycle(state)
        for table in self.program.tables:
            assumed = [
                assumption.condition
                for assumption in self.program.assumptions
                if assumption.name in table.assumptions
            ]
            fine = (state for state in states if self.kept(state))
            self.owe(
                any(all(self.value(c, state, {}) for c in assumed) for state in fine),
                "assumptions contradict",
            )

    def owe(self, good: Any, what: str) -> None:
        if not good:
            raise WrongError(what)

    def kept(self, state: dict[str, Value]) -> bool:
        return all(self.value(invariant.condition, state, {}) for invariant in self.program.invariants)

    def cycle(self, state: dict[str, Value]) -> None:
        """Every step that a cycle may take here."""
        for leaf in self.program.variables:
            if leaf.deferred_until is not None:
                self.value(leaf.deferred_until, state, {})
        taken = dict(state)
        for leaf in self.program.variables:
            if leaf.deferred_until is not None and self.value(leaf.deferred_until, state, {}):
                taken[leaf.name] = state[pending(leaf.name)]
        self.owe(self.kept(taken), "an invariant where deferred values are taken")
        safe = {str(leaf.name): leaf.safe for leaf in self.program.variables if leaf.safe is not None}
        self.owe(self.kept(state | safe), "an invariant where safe values are shown")
        for level in self.program.levels:
            if isinstance(level.tables, TableByCommand):
                self.value(level.tables.selector, state, {})
            for names in (level.preprocess, level.postprocess):
                self.runs(state, [[Call(self.procedures[name].name) for name in names]])
        for assumption in self.program.assumptions:
            holds = self.value(assumption.condition, state, {})
            self.owe(
                holds or assumption.standing is not Standing.PROVED, f"{assumption.name} does not follow"
            )
        for table in self.program.tables:
            self.table(table, state)

    def table(self, table: Table, state: dict[str, Value]) -> None:
        conditions = {str(assumption.name): assumption.condition for assumption in self.program.assumptions}
        if not all(self.value(conditions[name], state, {}) for name in table.stops):
            return
        matching = [
            line
            for line in table.lines
            if min(
                [True, *(self.value(test.condition, state, {}) for test in line.tests if test is not None)]
            )
        ]
        running: Sequence[Line | Default | None] = matching or [table.default]
        for line in running:
            if line is not None:
                self.line(line, state)
        if all(self.value(conditions[name], state, {}) for name in table.assumptions):
            least = 0 if table.default is not None and not table.default.unreachable else 1
            self.owe(least <= len(matching) <= 1, f"{len(matching)} lines of {table.name}")

    def line(self, line: Line | Default, state: dict[str, Value]) -> None:
        self.runs(state, [[action.statement] for action in line.actions])

    def called(self) -> set[str]:
        """Procedures that some line or level runs, found in the program's text."""
        called = {
            str(name) for level in self.program.levels for name in (*level.preprocess, *level.postprocess)
        }
        text = repr([self.program.tables, [self.procedures[name] for name in called]])
        called |= set(re.findall(r"Call\(procedure='(\w+)'", text))
        while True:
            more = set(
                re.findall(r"Call\(procedure='(\w+)'", repr([self.procedures[name] for name in called]))
            )
            if more <= called:
                return called
            called |= more

    def alone(self, state: dict[str, Value]) -> None:
        """Procedures that nothing calls."""
        for name, procedure in self.procedures.items():
            if name in self.uncalled:
                for given in product(*(values(param.type) for param in procedure.params)):
                    args = tuple(Literal(v, p.type) for v, p in zip(given, procedure.params, strict=True))
                    self.runs(state, [[Call(procedure.name, args)]], keep=False)

    def runs(
        self, state: dict[str, Value], actions: Sequence[Sequence[Statement]], *, keep: bool = True
    ) -> None:
        choices = _Choices()
        while True:
            now, wrote = dict(state), dict[str, Value]()
            for action in actions:
                mine: set[str] = set()
                self.execute(action, now, {}, mine, choices, keep)
                for name in mine & self.outputs:
                    self.owe(wrote.setdefault(name, now[name]) == now[name], f"two writers of {name}")
                    wrote[name] = now[name]
            self.owe(not keep or self.kept(now), "an invariant")
            if not choices.next():
                return

    def execute(
        self, body: Sequence[Statement], now: dict[str, Value], local: dict[str, Value], wrote: set[str],
        choices: _Choices, keep: bool,
    ) -> None:  # fmt: skip
        for statement in body:
            match statement:
                case Assign(place=place, value=value):
                    given = self.stored(place.type, self.value(value, now, local))
                    if isinstance(place, ToLeaf):
                        now[place.name] = given
                        wrote.add(place.name)
                    elif isinstance(place, ToElement):
                        leaf = place.leaves[self.index(place.index, len(place.leaves), now, local)]
                        now[leaf] = given
                        wrote.add(leaf)
                    else:
                        local[place.name] = given
                case Local(name=name, type=kind, value=expr):
                    local.pop(name, None)
                    if expr is not None:
                        local[name] = self.stored(kind, self.value(expr, now, local))
                case If(condition=condition, then=then, orelse=orelse):
                    chosen = then if self.value(condition, now, local) else orelse
                    self.execute(chosen, now, local, wrote, choices, keep)
                case Case(subject=subject, arms=arms, orelse=orelse):
                    at = self.value(subject, now, local)
                    body_ = next((arm.body for arm in arms if at in arm.values), orelse)
                    self.execute(body_, now, local, wrote, choices, keep)
                case For(name=name, low=low, high=high, body=inner):
                    for count in range(low, high + 1):
                        local[name] = count
                        self.execute(inner, now, local, wrote, choices, keep)
                case Call(procedure=name, args=args):
                    procedure = self.procedures[name]
                    given_ = [self.value(arg, now, local) for arg in args]
                    inside = {
                        param.name: self.stored(param.type, arg)
                        for param, arg in zip(procedure.params, given_, strict=True)
                    }
                    self.execute(procedure.body, now, inside, wrote, choices, keep)
                    for leaf in procedure.writes if procedure.extern is not None else ():
                        self.owe(not keep or self.kept(now), f"an invariant where {name} fails")
                        options = values(self.types[leaf])
                        now[leaf] = options[choices.of(len(options))]
                        wrote.add(leaf)

    def stored(self, kind: Scalar, value: Value) -> Value:
        low, high = key_bounds(kind)
        self.owe(low <= value <= high, "a range")
        return value

    def index(self, expr: Expr, length: int, now: dict[str, Value], local: dict[str, Value]) -> int:
        at = int(self.value(expr, now, local))
        self.owe(0 <= at < length, "an index")
        return at

    def value(self, expr: Expr, now: dict[str, Value], local: dict[str, Value]) -> Value:
        match expr:
            case Literal(value=value):
                return value
            case Read(name=name):
                return now[name]
            case ReadLocal(name=name):
                self.owe(name in local, "a local")
                return local[name]
            case Select(leaves=leaves, index=index):
                return now[leaves[self.index(index, len(leaves), now, local)]]
            case Among(subject=subject, values=members):
                return self.value(subject, now, local) in members
            case Apply(op=op, args=args):
                return self.applied(expr, op, args, now, local)

    def applied(
        self, expr: Apply, op: Op, args: tuple[Expr, ...], now: dict[str, Value], local: dict[str, Value]
    ) -> Value:
        first = self.value(args[0], now, local)
        if op in (Op.AND, Op.OR, Op.IMPLIES):
            if bool(first) is (op is Op.OR):
                return op is not Op.AND
            return bool(self.value(args[1], now, local))
        given = [first, *(self.value(arg, now, local) for arg in args[1:])]
        kinds = [kind for kind in (*(arg.type for arg in args), expr.type) if isinstance(kind, Int)]
        if op in (Op.DIV, Op.MOD):
            self.owe(given[1] != 0, "a division")
        found = divide(int(given[0]), int(given[1])) if op is Op.DIV else op.meaning(*given)
        if kinds and isinstance(args[0].type, Int):
            low, high = (0, 2**64 - 1) if all(kind.low >= 0 for kind in kinds) else (-(2**63), 2**63 - 1)
            numbers = given if op in COMPARISONS else [*given, found]
            self.owe(all(low <= number <= high for number in numbers), "64 bits")
        result: Value = found
        return result


# --- random programs -------------------------------------------------------------------


@dataclass(slots=True)
class _Text:
    """Writes one program."""

    rng: random.Random
    ints: dict[str, tuple[int, int]] = field(default_factory=dict)
    kept: list[str] = field(default_factory=list)
    first: dict[str, int] = field(default_factory=dict)
    states: int = 12
    procedures: list[str] = field(default_factory=list)

    def program(self) -> str:
        rng = self.rng
        lines = ["enum word { red, green, blue }", "input far : bool", "input said : word"]
        for name in ("a", "b"):
            low = rng.choice((-1, 0, 0, 1))
            self.ints[name] = low, low + rng.randint(1, 3)
            self.states *= self.ints[name][1] - low + 1
            lines.append(f"input {name} : int {low} .. {self.ints[name][1]} {rng.choice(('', 'clamp'))}")
        for name in ("s", "t")[: rng.randint(1, 2)]:
            high = rng.randint(1, 4)
            self.ints[name] = 0, high
            self.kept.append(name)
            until = " deferred until far" if name == "t" and high < 3 and rng.random() < 0.3 else ""
            self.first[name] = rng.randint(0, high)
            self.states *= (high + 1) ** (2 if until else 1)
            lines.append(f"state {name} : int 0 .. {high} = {self.first[name]}{until}")
        safe = rng.choice(("", "", " safe false", " safe true"))
        lines.append(f"output o : bool{' = true' if safe else ''}{safe}")
        if rng.random() < 0.25 and self.states * 4 <= MOST_STATES:
            lines.append("state k : array[2] of int 0 .. 1")
            self.ints["k"] = 0, 1
        invariants = self.invariants()
        assumptions = self.assumptions()
        lines += [*invariants, *assumptions, *self.module()]
        lines += self.table([assumption.split()[1] for assumption in assumptions])
        if rng.random() < 0.4:
            free = [name for name in self.procedures if "(" not in name]
            picked = [
                f"  {word} {', '.join(rng.sample(free, 1))}" for word in ("preprocess", "postprocess") if free
            ]
            parts = [picked[0]] if picked and rng.random() < 0.6 else picked
            order = [part for part in parts if "pre" in part], [part for part in parts if "post" in part]
            lines += ["level top {", "  period 10 [ms]", *order[0], "  table work", *order[1], "}"]
        return "\n".join(lines) + "\n"

    def invariants(self) -> list[str]:
        rng, found = self.rng, []
        if rng.random() < 0.5:
            name = rng.choice(self.kept)
            found.append(f"invariant bound : {name} <= {rng.randint(self.first[name], self.ints[name][1])}")
        if rng.random() < 0.15:
            found.append(f"invariant lit : o or s <= {self.first['s']}")
        if len(self.kept) == 2 and rng.random() < 0.4:
            s, t = self.first["s"], self.first["t"]
            order = "s <= t" if s <= t else "t <= s"
            found.append(
                f"invariant pair : {rng.choice((order, f's + t <= {s + t + 1}', f's + t = {s + t}'))}"
            )
        return found

    def assumptions(self) -> list[str]:
        rng, found = self.rng, []
        for name in ("near", "sane")[: rng.choice((0, 1, 1, 2))]:
            one, two = rng.sample(sorted(self.ints.keys() - {"k"}), 2)
            condition = rng.choice((f"{one} <= {two}", f"{one} /= 0", f"{one} > 0", f"far implies {one} < 2"))
            standing = rng.choice(("monitored", "monitored", "assumed", "proved"))
            found.append(f"assume {name} {standing} : {condition}")
        return found

    def module(self) -> list[str]:
        found = []
        for name in ("first", "second", "third")[: self.rng.randint(1, 3)]:
            called = name
            if self.rng.random() < 0.1:
                found.append(
                    f'extern procedure {name} reads a writes {self.rng.choice(self.kept)} python "m:f" c "m_f"'
                )
            elif self.rng.random() < 0.2:
                body = "; ".join(self.statement(2) for _ in range(2))
                found.append(f"procedure {name}(by : int 0 .. 2) {{ {body}; {self.stored('by')} }}")
                called = f"{name}({self.rng.choice(('0', '2', 's', 'a', 'min(s, 2)'))})"
            else:
                found.append(
                    f"procedure {name} {{ {'; '.join(self.statement(2) for _ in range(self.rng.randint(1, 2)))} }}"
                )
            self.procedures.append(called)
        return found

    def stored(self, by: str) -> str:
        name = self.rng.choice(self.kept)
        return f"{name} := min({name} + {by}, {self.ints[name][1]})"

    def statement(self, depth: int) -> str:
        rng, name = self.rng, self.rng.choice(self.kept)
        low, high = self.ints[name]
        choices = [
            f"{name} := {rng.randint(low, high)}",
            f"if {name} < {high} {{ {name} := {name} + 1 }}",
            f"if {name} > 0 {{ {name} := {name} - 1 }} else {{ {name} := {rng.randint(low, high)} }}",
            f"{name} := min({name} + 1, {high})",
            f"{name} := max(a - b, 0) mod {high + 1}",
            f"{name} := abs(a) mod {high + 1}",
            f"if b /= 0 {{ {name} := min(abs(a / b), {high}) }}",
            f"for i in 0 .. 1 {{ if {name} < {high} {{ {name} := {name} + i }} }}",
            f"case said {{ red {{ {name} := {low} }} green, blue {{ {name} := {high} }} }}",
            "o := far",
        ]
        if rng.random() < 0.1:
            choices = [f"{name} := min(abs(a / b), {high})", f"{name} := {name} + 1", "o := a < b"]
        if "k" in self.ints and rng.random() < 0.3:
            choices += ["k[min(abs(a), 1)] := 1", "k[a] := 0", f"{name} := k[abs(b) mod 2]"]
        if depth and rng.random() < 0.3:
            guard = rng.choice(("far", f"{name} <= b", "said = red", "a < b", f"not far or {name} = {high}"))
            return f"if {guard} {{ {self.statement(depth - 1)} }} else {{ {self.statement(depth - 1)} }}"
        if self.procedures and rng.random() < 0.15:
            return rng.choice(self.procedures).replace("(a)", "(1)").replace("(s)", "(0)")
        return rng.choice(choices)

    def table(self, assumptions: list[str]) -> list[str]:
        """Lines that part the inputs, split after split; some of them wrong."""
        rng = self.rng
        cells: list[dict[str, str]] = [{}]
        columns = ["far", "said", "a", "b", *self.kept, "when", "over"]
        for _ in range(rng.randint(1, 5)):
            cell = cells.pop(rng.randrange(len(cells)))
            open_ = [column for column in columns if column not in cell]
            if not open_:
                cells.append(cell)
                continue
            column = rng.choice(open_)
            cells += [{**cell, column: half} for half in self.halves(column)]
        if rng.random() < 0.05 and len(cells) > 1:
            cells.pop()
        used = [column for column in columns if any(column in cell for cell in cells)]
        heads = ["a - s" if column == "over" else column for column in used] or ["when"]
        using = rng.sample(assumptions, rng.randint(0, len(assumptions)))
        found = [f"table work{' assuming ' + ', '.join(using) if using else ''} {{"]
        found.append(f"  | line | {' | '.join(heads)} || procedures | o |")
        for at, cell in enumerate(cells):
            tests = [cell.get(column, "") for column in used] or ["true"]
            found.append(f"  | l{at} | {' | '.join(tests)} || {self.actions()} |")
        if rng.random() < 0.3:
            blank = " | ".join(
                ["DEFAULT unreachable" if rng.random() < 0.5 else "DEFAULT", *([""] * (len(heads) - 1))]
            )
            found.append(f"  | rest | {blank} || {self.actions()} |")
        return [*found, "}"]

    def halves(self, column: str) -> Sequence[str]:
        rng = self.rng
        if column == "far":
            return "true", "false"
        if column == "said":
            return rng.choice((("red", "/= red"), ("in {red, blue}", "green"), ("red", "green", "blue")))
        if column == "when":
            one, two = rng.sample(sorted(self.ints.keys() - {"k"}), 2)
            pairs = [(f"{one} < {two}", f"{one} >= {two}"), (f"{one} + 1 = {two}", f"{one} + 1 /= {two}")]
            pairs += [
                (f"{one} * {two} > 1", f"{one} * {two} <= 1"),
                (f"2 * {one} <= 3 and far", f"{one} >= 2 or not far"),
            ]
            pairs += [(f"{one} mod 2 = 0", f"{one} mod 2 /= 0")]
            if rng.random() < 0.1:
                pairs = [(f"a / {one} > 0", f"a / {one} <= 0")]
            return rng.choice(pairs)
        low, high = (-3, 3) if column == "over" else self.ints[column]
        cut = rng.randint(low, high - 1)
        return f"<= {cut}", f"> {cut}"

    def actions(self) -> str:
        rng = self.rng
        called = rng.sample(self.procedures, rng.randint(0, min(2, len(self.procedures))))
        return f"{'; '.join(called)} | {rng.choice(('', 'true', 'far'))}"


def random_text(rng: random.Random) -> str:
    """A program of few values, often right."""
    while True:
        writing = _Text(rng)
        text = writing.program()
        if writing.states <= MOST_STATES:
            return text


def small(program: object) -> Program | None:
    """The program if it has few states."""
    if not isinstance(program, Program):
        return None
    states = 1
    for variable in program.variables:
        low, high = key_bounds(variable.type)
        states *= high - low + 1
    return program if states <= MOST_STATES else None


# --- damage ----------------------------------------------------------------------------

ODD: list[Any] = [0, 1, -1, 2, 10**30, None, True, False, "l", "a", "b", "e", "z", "s", "", [], [0], {}, 0.5, "near", "k"]  # fmt: skip


def places(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The place of every value, inner ones too."""
    if path:
        yield path
    inside = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in inside:
        yield from places(value, (*path, key))


def at(node: Any, path: Sequence[Any]) -> Any:
    for key in path:
        node = node[key]
    return node


def damage(rng: random.Random, certificate: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """The certificate with something changed."""
    made: dict[str, Any] = copy.deepcopy(certificate)
    for _ in range(rng.randint(1, 3)):
        found = list(places(made))
        if not found:
            break
        path = rng.choice(found)
        holder, key = at(made, path[:-1]), path[-1]
        match rng.randrange(6):
            case 0:
                holder[key] = copy.deepcopy(rng.choice(ODD))
            case 1:
                del holder[key]
            case 2:
                holder[key] = copy.deepcopy(at(made, rng.choice(found)))
            case 3 if type(holder[key]) is int:
                holder[key] += rng.choice((-1, 1))
            case 4 if isinstance(holder[key], list):
                holder[key] = holder[key][: rng.randrange(len(holder[key]) + 1)]
            case _:
                from_ = list(places(other))
                holder[key] = copy.deepcopy(at(other, rng.choice(from_)))
    return made


def stopping(program: Program, certificate: dict[str, Any]) -> Program:
    """The program whose tables stop where the certificate says, as far as it says so."""
    claimed: dict[str, tuple[AssumptionName, ...]] = {}
    entries = certificate.get("tables")
    for entry in entries if isinstance(entries, list) else ():
        if isinstance(entry, dict) and isinstance(entry.get("stops"), list):
            claimed[str(entry.get("table"))] = tuple(AssumptionName(str(name)) for name in entry["stops"])
    tables = (replace(table, stops=claimed.get(str(table.name), ())) for table in program.tables)
    return replace(program, tables=tuple(tables))


def signed(program: Program, certificate: dict[str, Any]) -> dict[str, Any]:
    """The certificate as if it were made of this program."""
    return {**certificate, "meaning": digest(stopping(program, certificate))}


SWAPS = (
    ("<", "<=", ">", ">=", "=", "/="), ("+", "-", "*"), ("and", "or", "implies"), ("min", "max"), ("true", "false"), (":=",),
    ("monitored", "assumed", "proved"), ("red", "green", "blue"), ("a", "b", "s", "t"), ("near", "sane"), ("first", "second", "third"),
    ("reject", "clamp"), ("preprocess", "postprocess"), ("input", "state", "output"),
)  # fmt: skip
TOKEN = re.compile(r"\w+|:=|/=|<=|>=|\.\.|\S")


def edit(rng: random.Random, text: str) -> str:
    """The text with a token exchanged, or a line or some tokens taken out, or two lines exchanged."""
    kind = rng.randrange(8)
    lines = text.splitlines()
    if kind == 0:
        lines.pop(rng.randrange(len(lines)))
        return "\n".join(lines) + "\n"
    if kind == 1:
        one, two = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[one], lines[two] = lines[two], lines[one]
        return "\n".join(lines) + "\n"
    tokens = list(TOKEN.finditer(text))
    if kind == 2:
        return re.sub(
            r" assuming [\w, ]+|, (near|sane)|(near|sane), | unreachable| deferred until far",
            "",
            text,
            count=1,
        )
    if kind == 3:
        start = rng.randrange(len(tokens))
        last = min(start + rng.randint(0, 3), len(tokens) - 1)
        return text[: tokens[start].start()] + text[tokens[last].end() :]
    changed = [token for token in tokens if _instead(rng, token[0]) is not None]
    token = rng.choice(changed)
    return text[: token.start()] + str(_instead(rng, token[0])) + text[token.end() :]


def _instead(rng: random.Random, token: str) -> str | None:
    if token.isdigit():
        return str(max(0, int(token) + rng.choice((-1, 1, 1, 2))))
    for group in SWAPS:
        if token in group and len(group) > 1:
            return rng.choice([one for one in group if one != token])
    return None


def altered(rng: random.Random, program: Program) -> Program:
    """The program with something else in it that types do not depend on: quicker than another text, and often right."""
    at = rng.randrange(len(program.tables))
    table = program.tables[at]
    lines = list(table.lines)
    one = rng.randrange(len(lines))
    match rng.randrange(9):
        case 0:
            rng.shuffle(lines)
        case 1:
            kept = tuple(action for action in lines[one].actions if rng.random() < 0.5)
            lines[one] = replace(lines[one], actions=kept)
        case 2:
            lines[one] = replace(lines[one], actions=rng.choice(lines).actions)
        case 3:
            column = rng.randrange(len(table.columns))
            tests = list(lines[one].tests)
            tests[column] = rng.choice([None, *(line.tests[column] for line in lines)])
            lines[one] = replace(lines[one], tests=tuple(tests))
        case 4:
            names = tuple(name for name in table.assumptions if rng.random() < 0.5)
            table = replace(table, assumptions=names)
        case 5:
            standings = list(Standing)
            some = tuple(replace(each, standing=rng.choice(standings)) for each in program.assumptions)
            return replace(program, assumptions=some)
        case 6:
            leaf = rng.randrange(len(program.variables))
            variables = list(program.variables)
            initial_ = rng.choice(values(variables[leaf].type))
            variables[leaf] = replace(variables[leaf], initial=initial_)
            return replace(program, variables=tuple(variables))
        case 7:
            return replace(
                program, invariants=program.invariants[: rng.randrange(len(program.invariants) + 1)]
            )
        case _:
            procedures = tuple(replace(each, body=_shorn(rng, each.body)) for each in program.procedures)
            return replace(program, procedures=procedures)
    tables = list(program.tables)
    tables[at] = replace(table, lines=tuple(lines))
    return replace(program, tables=tuple(tables))


def _shorn(rng: random.Random, body: tuple[Statement, ...]) -> tuple[Statement, ...]:
    """The statements, some of them, or some of their guards, taken out."""
    found: list[Statement] = []
    for statement in body:
        chance = rng.random()
        if isinstance(statement, If) and chance < 0.3:
            found += statement.then
        elif isinstance(statement, If) and chance < 0.4:
            found.append(replace(statement, then=statement.orelse, orelse=statement.then))
        elif chance < 0.9:
            found.append(statement)
    return tuple(found)


# --- runs ------------------------------------------------------------------------------


VARIANTS = 6
"""Programs tried of each text."""


@dataclass(frozen=True, slots=True)
class Proved:
    """A program that the prover proves, and its certificate.

    Attributes:
        text: Of the program that this one is, or is made of.
    """

    text: str
    program: Program
    certificate: dict[str, Any]


def all_proved(rng: random.Random) -> Iterator[Proved]:
    """Random programs that prove, without end."""
    while True:
        text = random_text(rng)
        program = small(compile_text(text))
        made = None if program is None else _proved(text, program)
        if made is None:
            continue
        yield made
        seen = {digest(made.program)}
        for _ in range(VARIANTS):
            other = altered(rng, made.program)
            if digest(other) not in seen and (found := _proved(text, other)) is not None:
                yield found
            seen.add(digest(other))


def _proved(text: str, program: Program) -> Proved | None:
    certificate = prove_program(program, OPTIONS).certificate
    return None if certificate is None else Proved(text, program, json.loads(json.dumps(certificate)))


@dataclass(slots=True)
class Attack:
    """What came of a run.

    Attributes:
        counts: How many true certificates, edits and damages there were, and how many were accepted.
        failures: What should not have happened, with the text and the certificate.
    """

    rng: random.Random
    counts: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    def run(self, count: int, tell: Callable[[str], None] = lambda _: None) -> None:
        """Checks `count` true certificates and `count` false or doubtful ones."""
        programs = all_proved(self.rng)
        before, told = next(programs), 0
        for number, proved in enumerate(islice(programs, count)):
            self.true(proved)
            (self.edited if number % 2 else self.damaged)(proved, before)
            before = proved
            for failure in self.failures[told:]:
                tell(failure)
            told = len(self.failures)
            if not number % 500:
                tell(f"{number}: {dict(self.counts)}, {len(self.failures)} failures")

    def true(self, proved: Proved) -> None:
        """Its certificate is accepted, and it is right."""
        self.counts["true"] += 1
        found = certify(proved.program, proved.certificate)
        if not found.whole:
            self.fail(
                f"a true certificate is refused: {found.problems} {found.unchecked}",
                proved.text,
                proved.certificate,
            )
        if self.counts["true"] % 10 == 1 and (
            why := wrong_with(stopping(proved.program, proved.certificate))
        ):
            self.fail(f"proved and certified, but: {why}", proved.text, proved.certificate)

    def another(self, proved: Proved) -> tuple[Program, str]:
        """An edited program that says something else."""
        while True:
            by_text = self.rng.random() < 0.3
            text = edit(self.rng, proved.text) if by_text else proved.text
            program = small(compile_text(text)) if by_text else altered(self.rng, proved.program)
            if program is not None and digest(program) != digest(proved.program):
                return program, text

    def edited(self, proved: Proved, other: Proved) -> None:
        """Another text under the certificate, or under another program's."""
        program, text = self.another(proved)
        kept = other.certificate if self.rng.random() < 0.1 else proved.certificate
        self.judge("edited", program, signed(program, kept) if self.rng.random() < 0.9 else kept, text)

    def damaged(self, proved: Proved, other: Proved) -> None:
        """The certificate with something changed, of its program or of an edited one."""
        program, text = self.another(proved) if self.rng.random() < 0.5 else (proved.program, proved.text)
        made = damage(self.rng, proved.certificate, other.certificate)
        self.judge("damaged", program, signed(program, made) if self.rng.random() < 0.9 else made, text)

    def judge(self, kind: str, program: Program, certificate: dict[str, Any], text: str) -> None:
        """What is accepted is true."""
        self.counts[kind] += 1
        found = certify(program, certificate)
        if not found.whole:
            return
        self.counts[f"{kind}, accepted"] += 1
        if why := wrong_with(stopping(program, certificate)):
            self.fail(f"accepted ({kind}), but: {why}", text, certificate)

    def fail(self, why: str, text: str, certificate: dict[str, Any]) -> None:
        self.failures.append(f"{why}\n{text}\n{json.dumps(certificate)}")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.certificates")
    parser.add_argument("--count", type=int, default=1_000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    attack = Attack(random.Random(given.seed))
    attack.run(given.count, lambda text: print(text, flush=True))
    print(f"{dict(attack.counts)}, {len(attack.failures)} failures")
    return 1 if attack.failures else 0


if __name__ == "__main__":
    raise SystemExit(main())

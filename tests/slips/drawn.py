"""The slips of a C file: what a hand that writes it may get wrong, one place at a time.

In: the C, and what is known of its leaves. Out: slips, each the text that stands in the place of another.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from random import Random

from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.model import Enum, Program, Scalar
from tests.slips.text import Expression, Function, Statement, functions

RELATIONS = {
    "<": ("<=", ">"),
    "<=": ("<", ">="),
    ">": (">=", "<"),
    ">=": (">", "<="),
    "==": ("!=", ">="),
    "!=": ("==",),
}
OTHERS = {"+": "-", "-": "+", "*": "/", "/": "*", "&&": "||", "||": "&&", "%": "/"}
NUMBER = re.compile(r"(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)$")
REAL = re.compile(r"(?:0[xX][0-9a-fA-F.]+[pP][+-]?\d+|\d[\d.]*(?:[eE][+-]?\d+)?)([fF]?)$")
RELATIVE = (1.0 - 1e-9, 1.0 + 1e-9, 0.999, 1.05, 0.5, 2.0)
"""What a real constant is multiplied by."""
FAR = 1e300
MEMBER_READ = re.compile(r"\bs->([\w.]+)(?![\w.]* =[^=])")
MEMBER_WRITTEN = re.compile(r"\bs->([\w.]+)(?:\[[^\]]*\])* =[^=]")
MEMBERS = re.compile(r"^enum \{(.*?)\}", re.DOTALL | re.MULTILINE)
MEMBER = re.compile(r"^\s*(\w+) =", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Slip:
    """A change of one place.

    Attributes:
        operator: What kind of slip it is.
        function: The function that it stands in.
        start, end: The place in the text.
        new: What stands there instead.
        whole: Where the full expression, or the statement, begins and ends that it is a part of.
        of_value: Whether that is an expression.
        lost: Where a second statement stands that goes with it, which is in `new` already.
    """

    operator: str
    function: str
    start: int
    end: int
    new: str
    whole: tuple[int, int]
    of_value: bool
    lost: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class Source:
    """What is known of a C file.

    Attributes:
        kinds: By the place of a leaf as the C writes it (`s->hand.force_n`), what it is interchanged with: leaves of one kind.
        members: By a constant of an enumeration, the others.
        greatest: The last constant of each.
        heads: By parameters of a function, its name's likes: functions that may be called instead.
        most: Slips that are drawn at one place, of those of which there are many.
    """

    text: str
    kinds: Mapping[str, str]
    members: Mapping[str, Sequence[str]]
    greatest: frozenset[str]
    heads: Mapping[str, Sequence[str]]
    functions: Sequence[Function]
    most: int

    def touched(self, text: str, seen: frozenset[str] = frozenset()) -> tuple[set[str], set[str]]:
        """Return the members of the state that a statement reads, or writes, by itself or through what it calls."""
        read, wrote = set(MEMBER_READ.findall(text)), set(MEMBER_WRITTEN.findall(text))
        for function in self.functions:
            if function.name not in seen and re.search(rf"\b{function.name}\(", text):
                body = self.text[function.body.start : function.body.end]
                inner = self.touched(body, seen | {function.name})
                read, wrote = read | inner[0], wrote | inner[1]
        return read, wrote


def source_of(program: Program, symbols: Symbols, files: Mapping[str, str], most: int) -> Source:
    """Read the C of a program."""
    text = next(text for path, text in files.items() if path.endswith(f"/{symbols.source}"))
    own = functions(text)
    heads: dict[str, list[str]] = {}
    for function in own:
        types = ", ".join(re.sub(r"\w+$", "", each.strip()) for each in function.parameters.split(","))
        if "_do_" in function.name:
            heads.setdefault(types, []).append(function.name)
    groups = [
        MEMBER.findall(group)
        for path, header in files.items()
        if path.endswith(".h")
        for group in MEMBERS.findall(header)
    ]
    members = {name: [x for x in group if x != name] for group in groups for name in group}
    kinds = {f"s->{symbols.path(v.name)}": _kind(v.type, symbols.c_type(v.name)) for v in program.variables}
    alike = {name: names for names in heads.values() for name in names}
    greatest = frozenset(group[-1] for group in groups if group)
    return Source(text, kinds, members, greatest, alike, own, most)


def _kind(kind: Scalar, c_type: str) -> str:
    return f"enum {kind.name}" if isinstance(kind, Enum) else c_type


def slips_of(source: Source, seed: int) -> Iterator[Slip]:
    """Yield every slip of a file, in the order of the text; of swapped variables and calls those that the seed draws."""
    random = Random(seed)
    for function in source.functions:
        yield from _Draws(source, function, random).all()


@dataclass(frozen=True, slots=True)
class _Draws:
    """The slips of one function."""

    source: Source
    function: Function
    random: Random

    def all(self) -> Iterator[Slip]:
        """Yield them."""
        for statement in self.function.body.walk():
            yield from self.of_statement(statement)
            for one, other in pairwise(statement.blocks if statement.kind == "block" else ()):
                if {one.kind, other.kind} <= {"assign", "call"} and self.meet(one, other):
                    yield self.slip("order", one, f"{self.text(other)} {self.text(one)}", other)

    def meet(self, one: Statement, other: Statement) -> bool:
        """Return whether one of two statements writes what the other has to do with: else their order is free."""
        first, second = self.source.touched(self.text(one)), self.source.touched(self.text(other))
        return bool(first[1] & (second[0] | second[1]) or second[1] & first[0])

    def text(self, part: Expression | Statement) -> str:
        """Return what stands there."""
        return self.source.text[part.start : part.end]

    def some(self, many: Sequence[str]) -> Sequence[str]:
        """Draw a few."""
        return self.random.sample(many, min(self.source.most, len(many)))

    def slip(self, operator: str, place: Statement, new: str, also: Statement | None = None) -> Slip:
        """A slip of a whole statement, or of two."""
        end, lost = (place.end, None) if also is None else (also.end, (also.start, also.end))
        whole = place.start, place.end
        return Slip(operator, self.function.name, place.start, end, new, whole, of_value=False, lost=lost)

    # --- statements ---

    def of_statement(self, statement: Statement) -> Iterator[Slip]:
        """Yield the slips of a statement, but for those of the statements that it holds."""
        match statement:
            case Statement("assign", exprs=(place, value)):
                yield self.slip("assignment lost", statement, ";")
                for other in self.some(self.alike(place)):
                    yield self.slip("another variable written", statement, f"{other} = {self.text(value)};")
                yield from self.of_value(value)
                yield from self.of_indices(place)
            case Statement("call", exprs=(call,)):
                yield self.slip("call lost", statement, ";")
                yield from self.of_call(statement, call)
            case Statement("if", exprs=(condition,), blocks=blocks):
                yield from self.of_condition(condition)
                if len(blocks) == 2 and blocks[1].kind == "block" and blocks[1].blocks:
                    yield self.slip("else lost", blocks[1], "{ }")
            case Statement("declare" | "return" | "switch", exprs=(value,)):
                yield from self.of_value(value)

    def of_call(self, statement: Statement, call: Expression) -> Iterator[Slip]:
        """Yield other functions, and other arguments."""
        inner = next(part for part in call.walk() if part.kind == "call")
        others = [name for name in self.source.heads.get(inner.word, ()) if name != inner.word]
        arguments = [self.text(part) for part in inner.parts]
        for other in self.some(others):
            yield self.slip("another call", statement, f"{other}({', '.join(arguments)});")
        for at in range(1, len(arguments) - 1):
            swapped = [*arguments[:at], arguments[at + 1], arguments[at], *arguments[at + 2 :]]
            if swapped != arguments:
                yield self.slip("arguments swapped", statement, f"{inner.word}({', '.join(swapped)});")
        for argument in inner.parts[1:]:
            yield from self.of_value(argument)

    # --- expressions ---

    def of_condition(self, condition: Expression) -> Iterator[Slip]:
        """Yield what is chosen by otherwise."""
        for operator, new in (
            ("condition negated", f"!({self.text(condition)})"),
            ("condition held true", "true"),
        ):
            yield self.change(operator, condition, new, condition)
        yield self.change("condition held false", condition, "false", condition)
        yield from self.of_value(condition)

    def of_indices(self, place: Expression) -> Iterator[Slip]:
        for part in place.walk():
            if part.kind == "index":
                yield from self.of_value(part.parts[1])

    def of_value(self, value: Expression) -> Iterator[Slip]:
        """Yield what an expression may be instead, in each of its parts."""
        for part in value.walk():
            new: Iterable[tuple[str, str]] = ()
            match part.kind:
                case "number":
                    new = self.of_number(part)
                case "member" | "name":
                    new = self.of_name(part)
                case "binary":
                    new = self.of_binary(part)
                case "choice":
                    new = [("one arm always", self.text(arm)) for arm in part.parts[1:]]
                case "unary" if part.word in ("!", "-"):
                    new = [("sign lost", self.text(part.parts[0]))]
                case "index":
                    new = self.of_entries(part)
            for operator, text in new:
                yield self.change(operator, part, text, value)

    def change(self, operator: str, part: Expression, new: str, whole: Expression) -> Slip:
        """A slip of an expression."""
        return Slip(
            operator,
            self.function.name,
            part.start,
            part.end,
            f"({new})",
            (whole.start, whole.end),
            of_value=True,
        )

    def of_number(self, part: Expression) -> Iterator[tuple[str, str]]:
        """Yield other constants."""
        if whole := NUMBER.match(part.word):
            value, suffix = int(whole[1], 0), whole[2]
            near = [value + 1, value + 2, 2 * value + 10, value - 1, 0]
            others = (other for other in dict.fromkeys(near) if other >= 0 and other != value)
            yield from (("a whole number", f"{other}{suffix}") for other in others)
        elif real := REAL.match(part.word):
            hexadecimal = part.word[:2].lower() == "0x"
            given = float.fromhex(part.word) if hexadecimal else float(part.word.rstrip("fF"))
            reals = [given * by for by in RELATIVE] if given else [1e-9, -1e-9, 1.0]
            yield from (("a real", f"{other!r}{real[1]}") for other in reals)

    def of_name(self, part: Expression) -> Iterator[tuple[str, str]]:
        """Yield other variables of its type, and other members of its enumeration."""
        yield from (("another variable", other) for other in self.some(self.alike(part)))
        yield from (("another member", other) for other in self.some(self.source.members.get(part.word, ())))
        if part.word in ("true", "false"):
            yield "another member", "false" if part.word == "true" else "true"

    def alike(self, part: Expression) -> list[str]:
        """Return the leaves that are of one type with this one."""
        kinds = self.source.kinds
        kind = kinds.get(part.word) if part.kind == "member" else None
        return (
            []
            if kind is None
            else [name for name, other in kinds.items() if other == kind and name != part.word]
        )

    def of_binary(self, part: Expression) -> Iterator[tuple[str, str]]:
        """Yield other operators, operands lost, and bounds far away."""
        left, right = map(self.text, part.parts)
        for other in RELATIONS.get(part.word, ()):
            yield "another comparison", f"{left} {other} {right}"
        if part.word in OTHERS:
            yield "another operator", f"({left}) {OTHERS[part.word]} ({right})"
        if part.word in ("&&", "||", "+", "-", "*"):
            yield "an operand lost", left
            if part.word != "-":
                yield "an operand lost", right
        if part.word in RELATIONS:
            bound = part.parts[1]
            if bound.kind == "number" and REAL.match(bound.word) and not NUMBER.match(bound.word):
                yield from (("a bound replaced", f"{left} {part.word} {far!r}") for far in (FAR, -FAR))
            elif bound.kind == "number" and part.word not in ("==", "!="):
                yield "a bound replaced", f"{left} {part.word} 0u"
                yield "a bound replaced", f"{left} {part.word} 65535u"
            if part.word in ("-", "<", "<=", ">", ">="):
                yield "operands swapped", f"({right}) {part.word} ({left})"

    def of_entries(self, part: Expression) -> Iterator[tuple[str, str]]:
        """Yield a table whose entry is the next one."""
        array, index = part.parts
        if not re.fullmatch(r"t\.t\d+", array.word):
            return
        entries = self.entries(array.word)
        differ = [at for at, (one, other) in enumerate(pairwise(entries)) if one != other]
        inside = self.text(index)
        for at in self.random.sample(differ, min(4 * self.source.most, len(differ))):
            yield "an entry of a mask", f"{array.word}[(({inside}) == {at}u) ? {at + 1}u : ({inside})]"
            yield "an entry of a mask", f"{array.word}[(({inside}) == {at + 1}u) ? {at}u : ({inside})]"

    def entries(self, array: str) -> list[int]:
        """Return the entries of a table of masks of this function."""
        body = self.source.text[self.function.body.start : self.function.body.end]
        initial = body.partition("} t = {")[2].partition("\n    };")[0]
        bare = re.sub(r"/\*.*?\*/", "", initial, flags=re.DOTALL)
        arrays = re.findall(r"\{([^{}]*)\}", bare)
        number = int(array.removeprefix("t.t"))
        return [
            int(each.rstrip("uUlL"), 0) for each in re.findall(r"[0-9][0-9a-fA-FxXuUlL]*", arrays[number])
        ]

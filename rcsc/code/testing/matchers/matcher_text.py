"""The parts of an emitted C matcher, read from its text: mask tables, index expressions, what follows them.

In: the emitted C and the name of a `line` function. Out: its parts, verbatim, for a self-test to compile. A
text that is not of the shape described here is refused: the per-variable check claims nothing about it.

The shape: tables `t.t0`, `t.t1`, ..; one look-up in each, `t.tK[INDEX]`; the look-ups joined with `&` (in words of
64 lines where there are more); then a tail that reads nothing but the joined mask. An INDEX is one component,
or several in mixed radix, `(A * nu) + B`. A component reads one leaf and compares it with constants only,
or is the truth of a condition; it stands in parentheses where C needs them.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

TABLES = re.compile(
    r"static const struct \{\n(?P<fields>(?: +uint\d+_t t\d+\[\d+\](?:\[\d+\])?;\n)+)    \} t = \{.*?\n    \};",
    re.DOTALL,
)
FIELD = re.compile(r"uint(\d+)_t t(\d+)\[(\d+)\](?:\[(\d+)\])?;")
CONSTANT = r"(?:\(-INT64_C\(\d+\)(?: - INT64_C\(1\))?\)|U?INT64_C\(\d+\)|\(?-?\d+(?:\.\d+)?(?:e[+-]?\d+)?[uf]?\)?|[A-Z]\w*)"
PLACE = r"s->(?P<path>[A-Za-z_]\w*(?:\.\w+|\[\d+\])*)"
AGAIN = r"s->[A-Za-z_]\w*(?:\.\w+|\[\d+\])*"
ABOVE = rf"\(u?int(?:32|64)_t\){PLACE} [-+] {CONSTANT}"
CONVERTED = r"(?:\(uint32_t\)|\w+_u32_of_[iu](?:32|64))"
EVERY_KEY = 4096
"""Keys of a leaf up to which `matcher` finds the class of each."""
UNARY = (
    re.compile(rf"^{PLACE}$"),
    re.compile(rf"^{PLACE} \? 1u : 0u$"),
    re.compile(rf"^{CONVERTED}?\({ABOVE}\)$"),
    re.compile(rf"^\({PLACE} >= {CONSTANT}\) \? 1u : 0u$"),
    re.compile(
        rf"^\(\({PLACE} >= {CONSTANT}\) \? 1u : 0u\)"
        rf"(?: \+ \(\({AGAIN} >= {CONSTANT}\) \? 1u : 0u\))+$"
    ),
    re.compile(
        rf"^(?P<search>[A-Za-z_]\w*_class_\w+)\((?:{CONVERTED}\()?(?:\(u?int(?:32|64)_t\))?{PLACE}(?: [-+] {CONSTANT})?\)?\)$"
    ),
)
TRUTH = re.compile(r"^(?P<condition>.*) \? 1u : 0u$", re.DOTALL)
RADIX = re.compile(r"(?P<rest>.*) \* (?P<count>\d+)u", re.DOTALL)
LOAD = re.compile(r"\bt\.t(\d+)\[")
WHOLE = re.compile(r"\b(0[xX][0-9a-fA-F]+|\d+)[uUlL]*\b")
NUMBER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?(?:e[+-]?\d+)?)[uf]?(?![\w.])(?! : 0u)(?<! : 0u)")


@dataclass(frozen=True, slots=True)
class Component:
    """One part of an index.

    Attributes:
        text: The C expression, verbatim.
        path: The leaf's place in the struct; empty for the truth of a condition.
        constants: Every number it compares the leaf with, without sign.
        count: How many classes; 0 for the first of several, whose count the table's length gives.
    """

    text: str
    path: str
    constants: tuple[str, ...]
    count: int


@dataclass(frozen=True, slots=True)
class Lookup:
    """One table with its index.

    Attributes:
        declaration: All tables, verbatim.
        entries: How many masks it has.
        words: Words a mask.
    """

    declaration: str
    index: str
    entries: int
    words: int
    components: tuple[Component, ...]


@dataclass(frozen=True, slots=True)
class MatcherText:
    """A matcher's parts.

    Attributes:
        word_bits: Bits of the type in which one-word masks are joined.
        tail: What follows the look-ups, verbatim.
    """

    lookups: tuple[Lookup, ...]
    word_bits: int
    tail: str


@dataclass(frozen=True, slots=True)
class Numbers:
    """Where the numbers of one table stand in the C file, in order.

    Attributes:
        lookup: Which mask table they are, or are the classes for.
        component: Of a class table, the component that looks up in it; -1 for the masks.
        offsets: Where each number begins.
    """

    lookup: int
    component: int
    offsets: tuple[int, ...]
    values: tuple[int, ...]


COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)


def without_comments(source: str) -> str:
    """The text with blanks for its comments: everything else stands where it stood."""
    return COMMENT.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), source)


class ShapeError(Exception):
    """The text is not of the shape that the check is about."""


def function_body(source: str, head: str) -> str:
    """The lines between the braces of the function with this head."""
    start = source.find(f"\n{head}\n{{\n")
    end = source.find("\n}\n", start)
    if start < 0 or end < 0:
        raise ShapeError(f"no function `{head}`")
    return source[start + len(head) + 4 : end + 1]


def closing(text: str, start: int, pair: str) -> int:
    """Position of the bracket that closes the one at `start`."""
    depth = 0
    for at in range(start, len(text)):
        depth += (text[at] == pair[0]) - (text[at] == pair[1])
        if depth == 0:
            return at
    raise ShapeError("brackets do not match")


def matching(source: str, function: str) -> str:
    """The function that a `line` function calls, and does nothing else: it finds the line."""
    called = re.search(rf"\nint32_t {function}\(const \w+ \*s\)\n{{\n +return (\w+)\(s\);\n}}", source)
    if called is None:
        raise ShapeError(f"`{function}` does not ask the function that finds the line")
    return called[1]


def parted(index: str) -> list[tuple[str, int]]:
    """The components of an index with their counts; 0 for the first."""
    index = bare(index)
    if index.startswith("("):
        end = closing(index, 0, "()")
        scaled = RADIX.fullmatch(index, 1, end)
        if scaled and index.startswith(") + ", end):
            return [*parted(scaled["rest"]), (bare(index[end + len(") + ") :]), int(scaled["count"]))]
    return [(index, 0)]


def bare(text: str) -> str:
    """An expression without parentheses around all of it."""
    around = text.startswith("(") and closing(text, 0, "()") == len(text) - 1
    return bare(text[1:-1]) if around else text


def component(source: str, text: str, count: int) -> Component:
    """A component with what it reads; a search function's constants are taken from its own text."""
    for shape in UNARY:
        match = shape.match(text)
        if match is None:
            continue
        path = match["path"]
        if any(place != path for place in re.findall(r"s->([\w.\[\]]+)", text)):
            break
        name = match.groupdict().get("search")
        constants = NUMBER.findall(_search_text(source, name) if name else text.replace(f"s->{path}", ""))
        return Component(text, path, tuple(dict.fromkeys(constants)), count)
    if text == "0u":
        return Component(text, "", (), 1)
    if TRUTH.match(text) is None:
        raise ShapeError(f"index `{text}`")
    return Component(text, "", (), 2)


def _search_text(source: str, name: str) -> str:
    """The constants of a search function, which must use its argument only against them.

    A function that looks the class up has none: it is made for leaves of few keys, and `matcher` tries each.
    """
    head = re.search(
        rf"static inline uint32_t {name}\((?:u?int(?:8|16|32|64)_t|double|float) value\)", source
    )
    if head is None:
        raise ShapeError(f"no function `{name}`")
    body = function_body(source, head[0])
    looked_up = re.search(r"classes\[(\d+)\] = ", body)
    if looked_up and int(looked_up[1]) <= EVERY_KEY and body.count("value") == 1:
        return ""
    if re.sub(r"\(value >= cuts\[[^\]]*\]\)", "", body).count("value"):
        raise ShapeError(f"`{name}` uses its argument in another way")
    return body.split("};")[0].split("{", 1)[1]


def matcher_text(source: str, function: str, struct: str) -> MatcherText:
    """The parts of the matcher called `function`.

    Args:
        source: The emitted C.
        function: Its name.
        struct: Name of the program's struct.

    Raises:
        ShapeError: The text has another shape.
    """
    source = without_comments(source)
    body = function_body(
        source, f"static RCSC_INLINE int32_t {matching(source, function)}(const {struct} *s)"
    )
    stated = TABLES.search(body)
    declaration = stated[0] if stated else ""
    tables = list(FIELD.finditer(stated["fields"])) if stated else []
    rest = body.replace(declaration, "", 1) if stated else body
    rest = re.sub(r"(?<=[&|?:+,<>=])\n +", " ", rest)  # a line that was broken
    joined = re.search(r"const uint(\d+)_t m = (?P<loads>.*?);\n", rest, re.DOTALL)
    if joined is None or [int(table[2]) for table in tables] != list(range(len(tables))):
        raise ShapeError("no joined mask")
    many = "const uint64_t * const r0" in rest
    loads = _loads(rest[: joined.start()] if many else joined["loads"])
    if [number for number, _ in loads] != list(range(len(tables))):
        raise ShapeError("not one look-up a table")
    shape = r"\(uint\d+_t\)t\.t\d+\[\](?: & \(uint\d+_t\)t\.t\d+\[\])*"
    if not many and tables and not re.fullmatch(shape, _without_indices(joined["loads"])):
        raise ShapeError("look-ups are not joined with &")
    rows = " & ".join(f"r{number}[w]" for number, _ in loads)
    if many and " ".join(joined["loads"].split()) != rows:
        raise ShapeError("rows are not joined with &")
    lookups = tuple(
        _lookup(source, declaration, table, index) for table, (_, index) in zip(tables, loads, strict=True)
    )
    begin = max((rest.rindex(f"const r{number} =") for number, _ in loads), default=0) if many else 0
    tail = rest[rest.index(";", begin) + 1 :] if many else rest[joined.end() :]
    if re.search(r"s->|\bt\.", tail):
        raise ShapeError("the tail reads more than the mask")
    return MatcherText(lookups, int(joined[1]), tail)


def _loads(text: str) -> list[tuple[int, str]]:
    """Each look-up's table number and index, in order."""
    loads, at = [], 0
    while (match := LOAD.search(text, at)) is not None:
        end = closing(text, match.end() - 1, "[]")
        loads.append((int(match[1]), text[match.end() : end]))
        at = end
    return loads


def _without_indices(text: str) -> str:
    """The joined look-ups with their indices left out."""
    for _, index in _loads(text):
        text = text.replace(f"[{index}]", "[]", 1)
    return " ".join(text.split())


def _lookup(source: str, declaration: str, table: re.Match[str], index: str) -> Lookup:
    pieces = parted(index)
    components = [component(source, text, count) for text, count in pieces]
    entries, words = int(table[3]), int(table[4] or 1)
    return Lookup(declaration, index, entries, words, tuple(components))


def numbers(source: str, function: str, parts: MatcherText) -> Iterator[Numbers]:
    """The masks and the class tables of a matcher, number by number.

    Args:
        source: The emitted C.
        function: Name of its `line` function.
        parts: What `matcher_text` made of it.
    """
    source = without_comments(source)
    for at, lookup in enumerate(parts.lookups):
        if at == 0:
            start = source.index(
                lookup.declaration, source.index(f"int32_t {matching(source, function)}(const ")
            )
            start = source.index("} t = {", start) + len("} t = {")
        start = source.index("{", start)
        end = closing(source, start, "{}")
        yield _numbers(source, start, end, at, -1)
        start = end
        for number, part in enumerate(lookup.components):
            called = UNARY[-1].match(part.text)
            head = None if called is None else source.find(f" {called['search']}(uint32_t value)\n{{")
            table = None if not head else re.compile(r"\w+ classes\[\d+\] = ").search(source, head)
            if table is not None and not part.constants:
                yield _numbers(source, table.end(), closing(source, table.end(), "{}"), at, number)


def _numbers(source: str, start: int, end: int, lookup: int, component: int) -> Numbers:
    matches = list(WHOLE.finditer(source, start, end))
    values = tuple(int(number[1], 0) for number in matches)
    return Numbers(lookup, component, tuple(number.start() for number in matches), values)

"""The emitted C as a tree: functions, statements, expressions, each with its place in the text.

In: a C file that rcsc emitted. Out: trees. It reads what rcsc emits and no more of C.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

TOKEN = re.compile(
    r"""(?P<skip>/\*.*?\*/|\s+|^\s*\#[^\n]*)
    |(?P<number>0[xX][0-9a-fA-F.]+(?:[pP][+-]?\d+)?[uUlLfF]*|\d[\d.]*(?:[eE][+-]?\d+)?[uUlLfF]*)
    |(?P<name>[A-Za-z_]\w*)
    |(?P<mark>->|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^<>!~=?:;,.(){}\[\]])""",
    re.VERBOSE | re.MULTILINE | re.DOTALL,
)
LEVELS = (
    ("||",),
    ("&&",),
    ("|",),
    ("^",),
    ("&",),
    ("==", "!="),
    ("<", "<=", ">", ">="),
    ("<<", ">>"),
    ("+", "-"),
    ("*", "/", "%"),
)
"""Binary operators, the weakest first."""
TYPE = re.compile(r"(?:bool|double|float|\w+_t|void)$")
QUALIFIERS = frozenset({"const", "static", "volatile", "RCSC_CONST_SECTION"})
ONE_COMPILER = re.compile(r"^#if defined\(__GNUC__\)\n(.*?)^#else\n(.*?)^#endif\n", re.MULTILINE | re.DOTALL)
FAST_MATH = re.compile(r"^#if defined\(__FAST_MATH__\)[^\n]*\n(.*?)^#else\n", re.MULTILINE | re.DOTALL)
HEAD = re.compile(r"^(?:static |RCSC_INLINE |inline )*(\w+) (\w+)\(([^;{}]*)\)\n\{", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Token:
    """A word of C."""

    kind: str
    text: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression.

    Attributes:
        kind: `number`, `name`, `member`, `index`, `call`, `unary`, `binary`, `choice`, `cast` or `paren`.
        word: Its operator, name, function or type.
    """

    kind: str
    word: str
    start: int
    end: int
    parts: tuple["Expression", ...] = ()

    def walk(self) -> Iterator["Expression"]:
        """Yield it and all that it is made of."""
        yield self
        for part in self.parts:
            yield from part.walk()


@dataclass(frozen=True, slots=True)
class Statement:
    """A statement.

    Attributes:
        kind: `assign`, `call`, `declare`, `if`, `switch`, `for`, `block`, `return`, or `other` for what stays as it is.
        exprs: Of an assignment the place and the value; of a choice its condition.
        blocks: What it holds: of an `if` what is done where it holds, and else.
    """

    kind: str
    start: int
    end: int
    exprs: tuple[Expression, ...] = ()
    blocks: tuple["Statement", ...] = ()

    def walk(self) -> Iterator["Statement"]:
        """Yield it and all that it holds."""
        yield self
        for block in self.blocks:
            yield from block.walk()


@dataclass(frozen=True, slots=True)
class Function:
    """A function, its parameters as the C has them."""

    name: str
    parameters: str
    body: Statement


def as_gcc_sees_it(text: str) -> str:
    """Return the C with blanks in the place of what only other compilers see; all stands where it stood."""

    def blanked(match: re.Match[str]) -> str:
        first, last = match.start(2) - match.start(), match.end(2) - match.start()
        return match[0][:first] + re.sub(r"[^\n]", " ", match[0][first:last]) + match[0][last:]

    without = FAST_MATH.sub(lambda match: match[0].replace(match[1], re.sub(r"[^\n]", " ", match[1])), text)
    return ONE_COMPILER.sub(blanked, without)


def functions(text: str) -> list[Function]:
    """Return every function of a C file."""
    text = as_gcc_sees_it(text)
    return [
        Function(head[2], head[3], Reader(_tokens(text, head.end() - 1)).block())
        for head in HEAD.finditer(text)
    ]


def _tokens(text: str, start: int) -> list[Token]:
    """Return the tokens of a body that begins with a brace, up to the one that closes it."""
    tokens: list[Token] = []
    depth = 0
    for match in TOKEN.finditer(text, start):
        if match.lastgroup != "skip":
            tokens.append(Token(str(match.lastgroup), match[0], match.start(), match.end()))
            depth += {"{": 1, "}": -1}.get(match[0], 0)
            if depth == 0:
                break
    return tokens


@dataclass(slots=True)
class Reader:
    """Reads the tokens of one function."""

    tokens: Sequence[Token]
    at: int = field(default=0)

    @property
    def now(self) -> str:
        """The text of the token that is next."""
        return self.tokens[self.at].text

    def take(self, wanted: str = "") -> Token:
        """Take the next token, which must be this one."""
        token = self.tokens[self.at]
        assert wanted in ("", token.text), f"{wanted} wanted, {token} found"
        self.at += 1
        return token

    # --- statements ---

    def block(self) -> Statement:
        """A block in braces."""
        start, inside = self.take("{").start, []
        while self.now != "}":
            inside.append(self.statement())
        return Statement("block", start, self.take("}").end, (), tuple(inside))

    def statement(self) -> Statement:
        """A statement."""
        start = self.tokens[self.at].start
        match self.now:
            case "{":
                return self.block()
            case "if":
                return self.choice()
            case "switch" | "for":
                return self.headed()
            case "return":
                self.take()
                value = self.expression()
                return Statement("return", start, self.take(";").end, (value,))
            case "case" | "default":
                while self.take().text != ":":
                    pass
                return Statement("other", start, start)
            case "break" | "static" | "RCSC_CONST_SECTION":
                return self.whole(start)
        return self.declaration(start) if self.declares() else self.simple(start)

    def whole(self, start: int) -> Statement:
        """A statement that stays as it is: a table, or `break`."""
        depth = 0
        while True:
            token = self.take()
            depth += {"{": 1, "}": -1}.get(token.text, 0)
            if token.text == ";" and depth == 0:
                return Statement("other", start, token.end)

    def choice(self) -> Statement:
        """An `if` with all that hangs on it."""
        start = self.take("if").start
        self.take("(")
        condition = self.expression()
        self.take(")")
        blocks = [self.block()]
        if self.now == "else":
            self.take()
            blocks.append(self.choice() if self.now == "if" else self.block())
        return Statement("if", start, blocks[-1].end, (condition,), tuple(blocks))

    def headed(self) -> Statement:
        """A `switch`, with what it chooses by; or a loop, whose head stays as it is."""
        token = self.take()
        self.take("(")
        exprs = (self.expression(),) if token.text == "switch" else ()
        depth = 1
        while depth:
            depth += {"(": 1, ")": -1}.get(self.take().text, 0)
        body = self.block()
        return Statement(token.text, token.start, body.end, exprs, (body,))

    def declares(self) -> bool:
        """Return whether a declaration begins here."""
        word = self.now
        follows = self.tokens[self.at + 1]
        return word in QUALIFIERS or (
            bool(TYPE.match(word)) and (follows.kind == "name" or follows.text == "*")
        )

    def declaration(self, start: int) -> Statement:
        """A declaration, with its value."""
        while self.tokens[self.at + 1].text not in ("=", ";"):
            self.take()
        self.take()
        if self.take().text == ";":
            return Statement("other", start, start)
        value = self.expression()
        return Statement("declare", start, self.take(";").end, (value,))

    def simple(self, start: int) -> Statement:
        """An assignment or a call."""
        first = self.expression()
        if self.now == "=":
            self.take()
            value = self.expression()
            return Statement("assign", start, self.take(";").end, (first, value))
        kind = "call" if any(part.kind == "call" for part in first.walk()) else "other"
        return Statement(kind, start, self.take(";").end, (first,))

    # --- expressions ---

    def expression(self) -> Expression:
        """An expression."""
        first = self.binary(0)
        if self.now != "?":
            return first
        self.take()
        one = self.expression()
        self.take(":")
        other = self.expression()
        return Expression("choice", "?", first.start, other.end, (first, one, other))

    def binary(self, level: int) -> Expression:
        """Operators of a level, and of all that bind more."""
        if level == len(LEVELS):
            return self.unary()
        left = self.binary(level + 1)
        while self.now in LEVELS[level]:
            word = self.take().text
            right = self.binary(level + 1)
            left = Expression("binary", word, left.start, right.end, (left, right))
        return left

    def unary(self) -> Expression:
        """A sign, a cast, or less."""
        token = self.tokens[self.at]
        if token.text in ("!", "~", "-", "*", "&", "+"):
            self.take()
            inner = self.unary()
            return Expression("unary", token.text, token.start, inner.end, (inner,))
        following = self.tokens[self.at + 1].text
        if token.text == "(" and (following in QUALIFIERS or TYPE.match(following)):
            self.take()
            words = []
            while self.now != ")":
                words.append(self.take().text)
            self.take(")")
            inner = self.unary()
            return Expression("cast", " ".join(words), token.start, inner.end, (inner,))
        return self.postfix()

    def postfix(self) -> Expression:
        """A name with members, indices and arguments; a number; or what stands in parentheses."""
        token = self.take()
        if token.text == "(":
            inner = self.expression()
            made = Expression("paren", "", token.start, self.take(")").end, (inner,))
        else:
            made = Expression(
                "number" if token.kind == "number" else "name", token.text, token.start, token.end
            )
        while self.now in (".", "->", "[", "("):
            mark = self.take().text
            if mark == "[":
                inner = self.expression()
                made = Expression("index", made.word, made.start, self.take("]").end, (made, inner))
            elif mark == "(":
                arguments = []
                while self.now != ")":
                    arguments.append(self.expression())
                    if self.now == ",":
                        self.take()
                made = Expression("call", made.word, made.start, self.take(")").end, tuple(arguments))
            else:
                name = self.take()
                word = f"{made.word}{mark}{name.text}"
                made = Expression(
                    "member", word, made.start, name.end, made.parts if made.kind == "index" else ()
                )
        return made

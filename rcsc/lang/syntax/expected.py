"""What the parser expected, in a person's words: never a list of forty terminals; and what was meant, where that is plain."""

from collections.abc import Iterable
from difflib import get_close_matches

from rcsc.lang.operator_table import LOGIC

_DECLARATION = frozenset(
    "USE UNIT CONST ENUM TYPE RECORD LINK SERVES COMMANDS ADOPT KIND ASSUME INVARIANT PROPERTY REQUIREMENT PROCEDURE MODULE _SET".split()
    + "EXTERN OWNER TABLE LEVEL".split()
)
_EXPRESSION = frozenset("TRUE FALSE REAL MASK LPAR FUNCTION NOT WAS ONCE EVENT".split())
_OPERATOR = frozenset("ADD_OP MUL_OP COMPARE EQUAL IN DOT LSQB HELD SINCE".split()) | {
    op.upper() for op in LOGIC
}
_STATEMENT = frozenset("IF CASE FOR LOCAL NEXT".split())

_WORDS = {
    "NAME": "a name",
    "INT": "a whole number",
    "REAL": "a number with a decimal point",
    "STRING": 'a string in `"`',
    "EVENT": "an event",
    "ROW": "a table row, which begins with `|`",
    "$END": "the end",
    "LBRACE": "`{`",
    "RBRACE": "`}`",
    "LPAR": "`(`",
    "RPAR": "`)`",
    "LSQB": "`[`",
    "RSQB": "`]`",
    "COLON": "`:`",
    "COMMA": "`,`",
    "SEMICOLON": "`;`",
    "SLASH": "`/`",
    "STAR": "`*`",
    "CIRCUMFLEX": "`^`",
    "DOT": "`.`",
    "EQUAL": "`=`",
    "MINUS": "`-`",
    "ADMIT": "`clamp` or `reject`",
    "SAFE": "`safe`",
    "STANDING": "`assumed`, `monitored`, `assumed monitored` or `proved`",
    "BOOL": "a type",
    "_DOTS": "`..`",
    "_BECOMES": "`:=`",
    "GROUPS": "bits",
    "HELD": "`for`",
    "AT_ONCE": "`once`",
    "WATCHED": "`monitored`",
    "_OVER_TIME": "`:`",
    "_CYCLES": "`cycles`",
    "MASK": "bits",
    "_INT": "`int`",
    "_REAL": "`real`",
    "_SINGLE": "`single`",
    "_SET": "`set`",
    "_REQ": "`req`",
}
_MOST = 6
_CLASSES = {
    "KIND": ("input", "state", "output"),
    "ADMIT": ("clamp", "reject"),
    "STANDING": ("assumed", "monitored", "proved"),
    "FUNCTION": ("abs", "min", "max", "count", "single"),
    "_INT": ("int",),
    "_REAL": ("real",),
    "_SINGLE": ("single",),
    "_SET": ("set",),
    "_CYCLES": ("cycles",),
}
"""The words of the terminals that are not called as their one word is."""
_SYMBOLS = frozenset(
    "NAME INT REAL MASK GROUPS STRING EVENT ROW COMPARE ADD_OP MUL_OP LBRACE RBRACE LPAR RPAR LSQB RSQB COLON COMMA SEMICOLON SLASH STAR"
    " CIRCUMFLEX DOT EQUAL MINUS _OVER_TIME".split()
)
"""Terminals that are no words, whatever they are called."""
_STATUS = "a link says what its statuses mean: `status : TYPE done MEMBER failed MEMBER executing MEMBER`"
ELSEWHERE = {
    "===": "=", "!==": "/=", "==": "=", "!=": "/=", "<>": "/=", "&&": "and", "||": "or", "=>": "implies", "->": "implies",
    "=<": "<=", "!": "not", "~": "not", "%": "mod",
}  # fmt: skip
"""Operators of other languages, and how this one writes them; the longest first where one begins another."""


def expected(terminals: Iterable[str]) -> str:
    """Return at most six things, joined with commas and `or`; symbols first, groups named."""
    names = set(terminals)
    parts: list[str] = []
    for group, word in (
        (_DECLARATION, "a declaration"),
        (_STATEMENT, "a statement"),
        (_EXPRESSION, "an expression"),
        (_OPERATOR, "an operator"),
    ):
        if len(names & group) >= 3:
            names -= group | ({"NAME", "INT", "MINUS", "_INT", "_REAL"} if word != "an operator" else set())
            parts.append(word)
    if {"BOOL", "ARRAY"} <= names:
        names -= {"INT", "REAL", "ARRAY", "NAME", "_INT", "_REAL", "_SINGLE"}
    single = sorted({_WORDS.get(name, f"`{name.lower()}`") for name in names})
    words = (parts + single)[:_MOST]
    return " or ".join(words) if len(words) < 3 else ", ".join(words[:-1]) + " or " + words[-1]


_HELPS = {
    "_CYCLES": "a time is a number of the level's own cycles: `within 25 cycles`",
    "REST": "a link says which command rests: `command : TYPE rest MEMBER`",
    "DONE": _STATUS,
    "FAILED": _STATUS,
    "EXECUTING": _STATUS,
    "ORDER": "a field of a link stands in `order { NAME : TYPE }` or in `report { NAME : TYPE }`",
}
"""Help where a word of the protocol is missing, by the terminal."""
ASSIGNS = "write `:=`: that assigns, `=` compares"
STATES = "write `=`: a declaration states its value, `:=` assigns in a procedure"
PARTS_CALLS = "write `;`: calls and assignments that follow each other are parted by it, as `first; second`"
_INSTEAD = {
    ("=", "_BECOMES"): ASSIGNS,
    (":=", "EQUAL"): STATES,
    (",", "SEMICOLON"): PARTS_CALLS,
}
"""Help where one sign was written for another, by what was found and what may stand there."""
_NOT_FOR = "parentheses say what has held: `not (c for 2 [s])`, or `(not c) for 2 [s]`"
_FOR_WITHIN = {
    ",": "each subordinate has a declaration of its own: `commands NAME : LINK`",
    "else": "the reason is that of a time: `within 25 cycles else REASON`",
}
"""Help after `commands NAME : LINK`, by the word found there."""


def missing_word(found: str, terminals: Iterable[str]) -> str:
    """Return help for a place where one of these words is missing and another is found; "" where none is known."""
    names = set(terminals)
    if found == "for":
        return _NOT_FOR
    if "WITHIN" in names and found in _FOR_WITHIN:
        return _FOR_WITHIN[found]
    instead = next((text for (sign, name), text in _INSTEAD.items() if found == sign and name in names), "")
    return instead or next((text for name, text in _HELPS.items() if name in names), "")


def operator_meant(text: str, at: int) -> tuple[int, str] | None:
    """Find the operator of another language that covers the character `at`: where it begins, and its spelling there."""
    for operator in ELSEWHERE:
        for begin in range(at, max(at - len(operator), -1), -1):
            if text.startswith(operator, begin):
                return begin, operator
    return None


def word_meant(word: str, terminals: Iterable[str]) -> str:
    """Return the word of the language that was probably meant, of those allowed here; "" where none is much like it."""
    words = (one for name in set(terminals) - _SYMBOLS for one in _CLASSES.get(name, (name.lower(),)))
    known = {one for one in words if one.isalpha()}
    if word in known:
        return ""
    near = [word.lower()] if word.lower() in known else get_close_matches(word.lower(), sorted(known), 1, 0.8)
    return near[0] if near and word.isidentifier() else ""

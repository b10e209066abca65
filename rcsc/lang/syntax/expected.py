"""What the parser expected, in a person's words: never a list of forty terminals."""

from collections.abc import Iterable

from rcsc.lang.operator_table import LOGIC

_DECLARATION = frozenset(
    "USE UNIT CONST ENUM TYPE RECORD KIND ASSUME INVARIANT PROPERTY PROCEDURE MODULE EXTERN OWNER TABLE LEVEL".split()
)
_EXPRESSION = frozenset("TRUE FALSE REAL LPAR FUNCTION NOT WAS".split())
_OPERATOR = frozenset("ADD_OP MUL_OP COMPARE EQUAL IN DOT LSQB".split()) | {op.upper() for op in LOGIC}
_STATEMENT = frozenset("IF CASE FOR LOCAL NEXT".split())

_WORDS = {
    "NAME": "a name",
    "INT": "a whole number",
    "REAL": "a number with a decimal point",
    "STRING": 'a string in `"`',
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
    "STANDING": "`assumed`, `monitored` or `proved`",
    "BOOL": "a type",
    "_DOTS": "`..`",
    "_BECOMES": "`:=`",
    "_INT": "`int`",
    "_REAL": "`real`",
}
_MOST = 6


def expected(terminals: Iterable[str]) -> str:
    """At most six things, joined with commas and `or`; symbols first, groups named."""
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
        names -= {"INT", "REAL", "ARRAY", "NAME", "_INT", "_REAL"}
    single = sorted(_WORDS.get(name, f"`{name.lower()}`") for name in names)
    words = (parts + single)[:_MOST]
    return " or ".join(words) if len(words) < 3 else ", ".join(words[:-1]) + " or " + words[-1]

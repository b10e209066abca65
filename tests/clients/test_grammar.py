"""The colours of the editors, held against the grammar: every word of the language is one, and no name is."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from lark import Lark, Token
from lark.exceptions import UnexpectedInput
from lark.lexer import PatternStr

REPO = Path(__file__).parents[2]
COLOURS = json.loads((REPO / "grammar/editors/vscode/rcs.tmLanguage.json").read_text(encoding="utf-8"))
LARK = Lark(
    (REPO / "grammar/rcs.lark").read_text(encoding="utf-8"), start="file", parser="lalr", keep_all_tokens=True
)
FILES = sorted(path for path in (REPO / "tables").rglob("*.rcs") if ".rcsc-cache" not in path.parts)
WORDS = ("keyword", "storage", "constant.language", "support")
"""How the scopes of words of the language begin."""


@dataclass(frozen=True)
class Piece:
    start: int
    end: int
    scope: str


def pieces(line: str, patterns: list[Any], at: int = 0, until: int | None = None) -> Iterator[Piece]:
    """The pieces of a line, as an editor's engine finds them: the first match, and of several at one place the first pattern's."""
    end = len(line) if until is None else until
    while at <= end:
        best: tuple[re.Match[str], Any] | None = None
        for pattern in flat(patterns):
            found = re.compile(pattern.get("match") or pattern["begin"]).search(line, at, end)
            if (
                found
                and (found.end() > found.start() or "begin" in pattern)
                and (best is None or found.start() < best[0].start())
            ):
                best = found, pattern
        if best is None:
            return
        found, pattern = best
        if "begin" in pattern:
            yield from pieces(line, pattern["patterns"], found.end(), end)
            return
        captures = pattern.get("captures")
        if captures:
            yield from (
                Piece(*found.span(int(number)), capture["name"])
                for number, capture in captures.items()
                if found.start(int(number)) >= 0
            )
        else:
            yield Piece(*found.span(), pattern["name"])
        at = found.end()


def flat(patterns: list[Any]) -> Iterator[Any]:
    for pattern in patterns:
        if "include" in pattern:
            inner = COLOURS["repository"][pattern["include"].removeprefix("#")]
            yield from flat(inner["patterns"]) if "patterns" in inner and "begin" not in inner else [inner]
        else:
            yield pattern


def scope_of(line: str, start: int, end: int) -> str:
    """The scope of a part of a line; empty for plain text."""
    return next(
        (
            piece.scope
            for piece in pieces(line, COLOURS["patterns"])
            if piece.start <= start and end <= piece.end
        ),
        "",
    )


def tokens(text: str) -> Iterator[Token]:
    """What the grammar reads, word by word, each as what it is where it stands."""
    parser = LARK.parse_interactive(text)
    yield from parser.iter_parse()


def words_of(token: Token) -> bool:
    """Whether a token is a word of the language and not one of the user's."""
    return (
        token.type not in {"NAME", "ROW", "STRING", "REAL", "INT", "MASK", "GROUPS"} and token[:1].isalpha()
    )


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(REPO / "tables")))
def test_words_are_coloured_as_words_and_names_are_not(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    seen = 0
    try:
        for token in tokens(text):
            if token.type == "ROW" or not token[:1].isalpha() or token.line is None or token.column is None:
                continue
            line, start = lines[token.line - 1], token.column - 1
            for word in re.finditer(r"\w+", token):
                scope = scope_of(line, start + word.start(), start + word.end())
                assert scope.startswith(WORDS) == words_of(token), (
                    f"{path.name}:{token.line}: `{word[0]}` in `{line}` is {scope or 'plain'}"
                )
                seen += 1
    except UnexpectedInput as error:
        pytest.fail(f"{path} does not parse here: {error}")
    assert seen


SAMPLES = """\
use a/b
unit mm
const a = 3
set low : int 0 .. 9 = { 1 }
enum e { a, b }
type t = single 0.0 .. 1.0
record r { a : array[3] of bool }
input a : int 0 .. 9 = 3 clamp
output b : real 0.0 .. 1.0 safe 0.0 restart 1.0 reject
state c : e deferred until a = 3
assume m assumed monitored req "A" : a mod 3 = 1 and not b or c xor d
invariant i : was a = 3 implies true
property p : @P(a) when b then c
property q : a until b
property s : a for 3 [s] upon d
property n : a not in low
assume k proved : false
requirement u : only while a, whenever b, exactly after 3 cycles, c
requirement w : only before a, eventually b
requirement x : only after a, at once b
requirement y : between a and b, at last c
requirement z : from a until b, next c
requirement aa : unless a, for 3 cycles, c
requirement ab : while a, always b
requirement ac : before a, never b
requirement ad : after a, when b, within 3 [s], c
requirement ae : until a, b since once c
requirement af : at most 2 times in 3 [s], b
requirement ag : at least 3 cycles apart, b
requirement ah : on for at least 3 cycles, b
requirement ai : off for at least 3 [s], b
requirement aj : always a for 3 cycles and b
procedure f(x : int 0 .. 3) { local y : bool := max(1, 2) = 2 if a { b := 1 }
else { for i in 0 .. 3 { next c := d } } case a { 1 { b := 2 } } }
module g reads a writes b { b := count(a) }
owner o { f, g }
extern procedure h reads a writes b python "m:f" c "f"
link l { command : e rest a status : w done d failed f executing x
order { stream v : e reason y : e }
report { } }
serves peer : l without a
commands low : l within 3 cycles else late answered within 9 cycles
adopt a after b
level v { period 40 [ms] preprocess f table by a.b { x : t } postprocess g }
table t assuming m { }
table t by a.b giving c { }
drive := goto(target := 3, again)
x := abs(min(1, single(2)))
"""


def test_every_word_of_the_grammar_is_coloured_somewhere() -> None:
    """A word that is new to the grammar has to come into the colours, and into the samples here."""
    listed = {
        terminal.pattern.value for terminal in LARK.terminals if isinstance(terminal.pattern, PatternStr)
    }
    for terminal in LARK.terminals:
        if not isinstance(terminal.pattern, PatternStr) and terminal.name not in {
            *"NAME REAL INT MASK GROUPS STRING COMMENT ROW".split()
        }:
            bare = re.sub(r"\(\?[=!].*", "", terminal.pattern.value)
            listed.update(re.findall(r"(?<![\\\[A-Za-z])[a-z]{2,}", bare))
    words = {word for word in listed if word.isalpha()}
    assert len(words) > 60
    coloured = {
        line[piece.start : piece.end].strip()
        for line in SAMPLES.splitlines()
        for piece in pieces(line, COLOURS["patterns"])
        if piece.scope.startswith(WORDS)
    }
    coloured |= {word for one in coloured for word in one.split()}
    assert words - coloured == set()
    marks = {mark for mark in listed if not mark.isalnum()} - {'"'}
    joined = {
        line[piece.start : piece.end]
        for line in (
            "a := b .. c /= d <= e >= f < g > h = i + j - k * l / m & n | o << p >> q",
            "{ } [ ] ( ) , ; : . ^",
        )
        for piece in pieces(line, COLOURS["patterns"])
        if "operator" in piece.scope or "punctuation" in piece.scope
    }
    assert marks - joined == set()


ROWS = {
    "  | 2 above all | true | 3 .. 4 || DEFAULT |": {
        "above": "keyword",
        "all": "keyword",
        "true": "constant.language",
        "DEFAULT": "keyword",
        "||": "keyword",
    },
    "  | 2 same 3 | not in low | 01 xx || f(x) |": {
        "same": "keyword",
        "not": "keyword",
        "in": "keyword",
        "01 xx": "constant.numeric",
        "f": "",
        "low": "",
    },
    "  |------|---||---|": {"|------|---||---|": "punctuation"},
    "| line | a.all || done |": {"line": "", "a": "", "all": "", "done": ""},
    "| 1 | a | # no comment | |": {"# no comment | |": "comment"},
    'x := "# no comment" # one': {"# one": "comment", '"# no comment"': "string"},
}


@pytest.mark.parametrize("line", list(ROWS))
def test_rows(line: str) -> None:
    for part, wanted in ROWS[line].items():
        start = line.index(part)
        scope = scope_of(line, start, start + len(part))
        assert scope.startswith(wanted) if wanted else not scope.startswith(WORDS), f"`{part}` is {scope}"


def test_what_the_extension_says_of_itself_is_there() -> None:
    folder = REPO / "grammar/editors/vscode"
    said = json.loads((folder / "package.json").read_text(encoding="utf-8"))
    for path in (
        said["main"],
        said["contributes"]["grammars"][0]["path"],
        said["contributes"]["languages"][0]["configuration"],
    ):
        assert (folder / path).is_file()
    lock = json.loads((folder / "package-lock.json").read_text(encoding="utf-8"))
    assert lock["packages"][""]["dependencies"] == said["dependencies"]
    assert "://" not in (folder / "package-lock.json").read_text(encoding="utf-8").replace(
        "https://github.com", ""
    ).replace("https://opencollective.com", ""), "no registry is named"
    assert all("integrity" in package for name, package in lock["packages"].items() if name)
    commands = {command["command"] for command in said["contributes"]["commands"]}
    assert {binding["command"] for binding in said["contributes"]["keybindings"]} <= commands
    assert {entry["command"] for entry in said["contributes"]["menus"]["commandPalette"]} <= commands
    client = (folder / "extension.js").read_text(encoding="utf-8")
    assert all(f'"{command}"' in client for command in commands)


LONG = (
    "|" + "-" * 900 + "x", "0 " * 450 + ".", "| " * 450, '"' * 900, "single " + " " * 900, "a.b" * 300,
    "| a " + "above " * 150,
)  # fmt: skip


@pytest.mark.parametrize("text", LONG, ids=lambda text: text[:8])
def test_a_long_line_is_coloured_to_its_end(text: str) -> None:
    """With a pattern that goes back and forth without end this would not come to one."""
    found = list(pieces(text, COLOURS["patterns"]))
    assert [piece.start for piece in found] == sorted(piece.start for piece in found)

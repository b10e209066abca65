"""Faults seeded into the shipped tables and procedures: what a slip of the hand makes of their text, every one by its kind.

In: the files of a level. Out: `Fault`s, each the text of one file with one change; the same for the same seed. A change that does not
resolve is none: the compiler refuses it before any proof (`faults.resolves`).
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path
from random import Random

from tests.support.programs.texts import one_row_a_line

LEVELS = ("vision", "gripper", "primitive", "emove", "task")


@dataclass(frozen=True, slots=True)
class Fault:
    """One change.

    Attributes:
        file: Under the folder of the tables; `number` is the line, from 1.
        old: What stood there; `new` what stands there now, empty where the line is gone.
        text: The whole file.
    """

    level: str
    kind: str
    file: str
    number: int
    old: str
    new: str
    text: str

    @property
    def shown(self) -> str:
        """In one line."""
        return f"{self.file}:{self.number}: {_tight(self.old)} => {_tight(self.new) or 'nothing'}"


def _tight(text: str) -> str:
    return re.sub(r"\s+", " ", text).strip()


Edit = Iterator[tuple[int, str]]
"""Lines by their places, and what may stand there instead; a line that goes is empty."""


# --- tables -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Row:
    """A line of a table as text: cells of conditions, and of actions."""

    at: int
    cells: tuple[str, ...]
    actions: tuple[str, ...]

    @property
    def default(self) -> bool:
        """Whether it is the line for what no other matches."""
        return any(cell.strip().startswith("DEFAULT") for cell in self.cells)

    def text(self, cells: Sequence[str] | None = None, actions: Sequence[str] | None = None) -> str:
        left, right = cells or self.cells, actions or self.actions
        return f"  |{'|'.join(left)}||{'|'.join(right)}|"


def tables(lines: Sequence[str]) -> Iterator[list[Row]]:
    """The rows of each table; the first is the head."""
    rows: list[Row] = []
    for at, line in enumerate(lines):
        text = line.strip()
        if text.startswith("|") and not text.startswith("|-"):
            left, _, right = text.partition("||")
            rows.append(Row(at, tuple(left.strip("|").split("|")), tuple(right.removesuffix("|").split("|"))))
        elif rows and not text.startswith("|"):
            yield rows
            rows = []
    if rows:
        yield rows


def _rows(lines: Sequence[str]) -> Iterator[tuple[list[Row], Row]]:
    for table in tables(lines):
        for row in table[1:]:
            yield table, row


def dropped_line(lines: Sequence[str]) -> Edit:
    for _, row in _rows(lines):
        if not row.default:
            yield row.at, ""


def widened_line(lines: Sequence[str]) -> Edit:
    for _, row in _rows(lines):
        if not row.default:
            for at in range(1, len(row.cells)):
                if row.cells[at].strip():
                    yield row.at, row.text(cells=[*row.cells[:at], " ", *row.cells[at + 1 :]])


def other_cell(lines: Sequence[str]) -> Edit:
    """What another line of the table has in this column."""
    for table, row in _rows(lines):
        if row.default:
            continue
        for at in range(1, len(row.cells)):
            others = dict.fromkeys(line.cells[at].strip() for line in table[1:] if not line.default)
            for cell in others:
                if cell and row.cells[at].strip() and cell != row.cells[at].strip():
                    yield row.at, row.text(cells=[*row.cells[:at], f" {cell} ", *row.cells[at + 1 :]])


NEXT = re.compile(r"\b(next)?state\((\w+)\)")


def wrong_next_state(lines: Sequence[str]) -> Edit:
    states = dict.fromkeys(found[2] for line in lines for found in NEXT.finditer(line))
    for _, row in _rows(lines):
        for found in NEXT.finditer(row.actions[0]):
            calls = row.actions[0]
            for state in states:
                if state != found[2]:
                    other = f"{calls[: found.start(2)]}{state}{calls[found.end(2) :]}"
                    yield row.at, row.text(actions=[other, *row.actions[1:]])


def _other_action(column: str) -> Callable[[Sequence[str]], Edit]:
    """Another entry of the column, or none."""

    def edits(lines: Sequence[str]) -> Edit:
        for table, row in _rows(lines):
            names = [name.strip() for name in table[0].actions]
            if column not in names:
                continue
            at = names.index(column)
            for entry in dict.fromkeys([*(line.actions[at].strip() for line in table[1:]), ""]):
                if entry != row.actions[at].strip():
                    yield row.at, row.text(actions=[*row.actions[:at], f" {entry} ", *row.actions[at + 1 :]])

    return edits


def forgotten_call(lines: Sequence[str]) -> Edit:
    for _, row in _rows(lines):
        calls = [call.strip() for call in row.actions[0].split(";")]
        for at in range(len(calls)):
            if calls[at]:
                left = "; ".join([*calls[:at], *calls[at + 1 :]])
                yield row.at, row.text(actions=[f" {left} ", *row.actions[1:]])


# --- procedures and modules -----------------------------------------------------------------------

ASSIGNMENT = re.compile(r"^\s+(next )?[\w.\[\]]+ := .+$")


def dropped_assignment(lines: Sequence[str]) -> Edit:
    for at, line in enumerate(lines):
        if ASSIGNMENT.match(line) and not line.lstrip().startswith("local"):
            yield at, ""


def _replaced(pattern: str, *news: str, only: str = "") -> Callable[[Sequence[str]], Edit]:
    """Each place where the pattern stands, in lines that have `only`, with each of these instead."""
    compiled = re.compile(pattern)

    def edits(lines: Sequence[str]) -> Edit:
        for at, line in enumerate(lines):
            if re.search(only, line) and not line.lstrip().startswith(("#", "|")):
                for found in compiled.finditer(line):
                    for new in news:
                        yield at, line[: found.start()] + found.expand(new) + line[found.end() :]

    return edits


def swapped_field(lines: Sequence[str]) -> Edit:
    """Another field of the same record, of those that the file names."""
    fields: dict[str, dict[str, None]] = {}
    for line in lines:
        for found in re.finditer(r"\b([a-z]\w*)\.(\w+)", line):
            fields.setdefault(found[1], {})[found[2]] = None
    for at, line in enumerate(lines):
        if ASSIGNMENT.match(line):
            for found in re.finditer(r"\b([a-z]\w*)\.(\w+)", line):
                for other in fields[found[1]]:
                    if other != found[2]:
                        yield at, line[: found.start(2)] + other + line[found.end(2) :]


# --- declarations ---------------------------------------------------------------------------------


PROMISES = ("done_stays", "failed_stays", "done_without_reason")


def other_promise(lines: Sequence[str]) -> Edit:
    """A property that comes with the protocol is switched off, or is not where it was."""
    for at, line in enumerate(lines):
        if line.startswith("serves "):
            head, _, names = line.partition(" without ")
            every = [name.strip() for name in names.split(",") if name.strip()]
            for name in PROMISES:
                left = [one for one in every if one != name] if name in every else [*every, name]
                yield at, f"{head} without {', '.join(left)}" if left else head


# --- links ----------------------------------------------------------------------------------------


def swapped_statuses(lines: Sequence[str]) -> Edit:
    """One status is taken for another."""
    for at, line in enumerate(lines):
        if found := re.match(r"(\s+status : \w+) done (\w+) failed (\w+) executing (\w+)$", line):
            _, done, failed, executing = found.group(1, 2, 3, 4)
            for one, two, three in (
                (failed, done, executing),
                (executing, failed, done),
                (done, executing, failed),
            ):
                yield at, f"{found[1]} done {one} failed {two} executing {three}"


def unnumbered_field(lines: Sequence[str]) -> Edit:
    """A field of an order that may change without a new number."""
    inside = False
    for at, line in enumerate(lines):
        inside = line.strip() == "order {" or (inside and line.strip() != "}")
        if inside and re.match(r"\s+(?!stream )\w+ : ", line):
            yield at, re.sub(r"\w", "stream \\g<0>", line, count=1)


KINDS: dict[str, Callable[[Sequence[str]], Edit]] = {
    "a line dropped": dropped_line,
    "a line widened": widened_line,
    "another line's cell": other_cell,
    "a wrong next state": wrong_next_state,
    "a wrong order": _other_action("command_out"),
    "a wrong status": _other_action("status_out"),
    "a call forgotten": forgotten_call,
    "an assignment dropped": dropped_assignment,
    "an echo not waited for": _replaced(r"\bechoed\b", "true", "not echoed", only=r"^\s+(if|\w+ :=) "),
    "a deferral forgotten": _replaced(r" deferred( until .+)?$", " deferred until true", only="^state "),
    "a restart forgotten": _replaced(r" restart \w+", "", only="^state "),
    "another promise": other_promise,
    "a status taken for another": swapped_statuses,
    "a field not numbered": unnumbered_field,
    "a counter not incremented": _replaced(r" \+ 1\b", " + 0", only=":="),
    "a field swapped": swapped_field,
    "a condition turned": _replaced(
        r" and | or | = | /= | < ", *(f" {word} " for word in ("and", "or", "=", "/=", "<=")), only=r"^\s+(\} else )?if "
    ),
}  # fmt: skip


# --- a sample -------------------------------------------------------------------------------------


def faults(tables_folder: Path, level: str) -> dict[str, list[Fault]]:
    """Every fault of a level by its kind."""
    found: dict[str, list[Fault]] = {kind: [] for kind in KINDS}
    for path in sorted((tables_folder / level).glob("*.rcs")):
        lines = one_row_a_line(path).split("\n")
        _add(found, level, f"{level}/{path.name}", lines, lines)
    lines = one_row_a_line(tables_folder / VOCABULARY).split("\n")
    _add(found, level, VOCABULARY, lines, _link_served(tables_folder, level, lines))
    return found


VOCABULARY = "vocabulary.rcs"


def _add(
    found: dict[str, list[Fault]], level: str, file: str, lines: list[str], looked_at: list[str]
) -> None:
    """The faults of a file of which some lines are looked at, and the others empty."""
    for kind, edits in KINDS.items():
        for at, new in dict.fromkeys(edits(looked_at)):
            text = "\n".join([*lines[:at], *([new] if new else []), *lines[at + 1 :]])
            if _tight(new) != _tight(lines[at]):
                found[kind].append(Fault(level, kind, file, at + 1, lines[at], new, text))


def _link_served(tables_folder: Path, level: str, lines: list[str]) -> list[str]:
    """Of the words that all share, the link by which the level is ordered; the other lines are empty."""
    texts = [path.read_text(encoding="utf-8") for path in (tables_folder / level).glob("*.rcs")]
    [link] = re.findall(r"^serves \w+ : (\w+)", "\n".join(texts), re.MULTILINE)
    first = lines.index(f"link {link} {{")
    last = lines.index("}", first)
    return [line if first <= at <= last else "" for at, line in enumerate(lines)]


def sample(tables_folder: Path, level: str, seed: int) -> Iterator[Fault]:
    """The faults of a level in a random order in which the kinds take turns."""
    random = Random(f"{seed} {level}")  # noqa: S311  # repeatable on purpose
    every = faults(tables_folder, level)
    turns = [random.sample(found, len(found)) for found in every.values()]
    return (one for one in chain.from_iterable(zip_longest(*turns)) if one is not None)

"""Wrong tables, drawn, through every command that looks at one: each ends within its bound, and none with a bug.

`python -m tests.wrong --count 10000 --seed 1` for a long run, in which a command has seconds of the processor; `--helps` writes each
proposal out and has the whole `rcsc check` look at it; `--tiny` draws small tables, and holds findings, regions, shares and proved
proposals against every input. `tests/table/test_wrong.py` makes short ones in the suite, with a bound in steps.

Each table has several mistakes: its cells are drawn about a few cuts a column, so that lines overlap, touch, leave gaps or never
match; over truth values, small and large enumerations, whole numbers of up to 64 bits, doubles and singles, words and their bits, sums,
elements of arrays, sets, assumptions, events, of a heading, too, `above` and `same`; now and then one is printed the other way round.
"""

import argparse
import contextlib
import io
import os
import random
import re
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from math import prod
from pathlib import Path
from types import FrameType

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Proposal, Severity, WitnessColumn
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Source
from rcsc.code.testing.inputs.sampling import declarations, snapshot
from rcsc.desk.editor.lenses import witness_run
from rcsc.desk.editor.workspace import Workspace
from rcsc.driver.check import check
from rcsc.driver.settings import Settings
from rcsc.front.commands import run
from rcsc.lang.interpret import UNDEFINED, fold, initial, matching_lines
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Program, Table, Value, key_bounds, key_of, unspelled, value_of_key
from rcsc.lang.resolve import compile_text
from rcsc.lang.written.changes import formatted, with_proposal
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.mending import names_of
from tests.support.programs import turned

MOST_CPU_S = 2.0
"""Of one command, on one table."""
MOST_OF_PROOFS_CPU_S = 15.0
"""Of what proves something of its own, whether a table is wrong or not: `diff`, and the graph of lines, which asks about each pair."""
LOOP_S = 0.13
"""Of the processor, what `_slowed` counts, where nothing else runs."""
HANGS_S = 40
"""Past so much it is broken off."""
MOST_LINES_OF_MASKS = 14
"""Lines of a table that looks at more than 16 bits of a word: thirty with two such masks each have 3,600 tests, and take some 2.2 s."""
NAMES = "abcdefgh"
Rng = random.Random


class HangsError(AssertionError):
    """A command did not come to an end."""


# --- drawing -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Heading:
    """A column: what is looked at, and cells that may stand there."""

    text: str
    cells: Callable[[Rng], str]


INTS = (
    (0, 9), (-5, 5), (0, 255), (0, 65535), (-(2**31), 2**31 - 1), (-(2**63), 2**63 - 1), (0, 2**64 - 1),
    (0, 2**63 - 1), (1, 60_000),
)  # fmt: skip
REALS = (
    ("0.0", "1.0"),
    ("-100.0", "100.0"),
    ("-1e308", "1e308"),
    ("0.0", "5e-324"),
    ("1.0", "1.0000000000000004"),
)
SINGLES = (("0.0", "1.0"), ("-100.0", "100.0"), ("-3e38", "3e38"), ("0.0", "1e-40"))


def numbers(points: Sequence[str], rng: Rng) -> str:
    """A cell that compares a number with one or two cuts."""
    one, two, three = (rng.choice(points) for _ in range(3))
    low, high = sorted((one, two), key=float)
    words = (
        f"<= {one}", f">= {one}", f"< {one}", f"> {one}", one, f"/= {one}", f"{low} .. {high}", f"{low} .. {high}",
        f"not in {low} .. {high}", f"in {{{one}, {three}}}", f"not in {{{one}, {two}}}", f"in {{{low} .. {high}, {three}}}",
    )  # fmt: skip
    return rng.choice(words)


def of_numbers(points: Sequence[str]) -> Callable[[Rng], str]:
    """Cells about these cuts."""
    return lambda rng: numbers(points, rng)


def of_members(members: Sequence[str]) -> Callable[[Rng], str]:
    """Cells about the members of an enumeration."""

    def cell(rng: Rng) -> str:
        few = rng.sample(members, min(len(members), rng.randint(1, 4)))
        return rng.choice(
            (few[0], f"/= {few[0]}", f"in {{{', '.join(few)}}}", f"not in {{{', '.join(few)}}}")
        )

    return cell


def of_bits(width: int, lead: str = "0b") -> Callable[[Rng], str]:
    """Masks of so many bits."""

    def cell(rng: Rng) -> str:
        digits = "".join(rng.choice("xxx01") for _ in range(width))
        return f"{lead}{digits}" if rng.randrange(4) else f"/= {lead}{digits}"

    return cell


def truths(rng: Rng) -> str:
    """A truth value."""
    return rng.choice(("true", "false"))


@dataclass(slots=True)
class Draw:
    """One text being drawn."""

    rng: Rng
    declared: list[str]
    headings: list[Heading]
    whole: list[str]
    real: list[str]
    conditions: list[str]
    masks: bool = False

    def variable(self, name: str) -> None:
        """Declare an input of some type, and a column about it."""
        rng = self.rng
        sort = rng.choice(("bool", "enum", "int", "int", "word", "real", "real", "single", "array", "set"))
        word = rng.choice(("input", "input", "state"))
        if sort == "bool":
            self.declared.append(f"{word} {name} : bool")
            self.headings.append(Heading(name, truths))
            self.conditions += [name, f"@T({name})", f"was {name}", f"{name} for 300 [ms]"]
        elif sort == "enum":
            members = [f"{name}_{at}" for at in range(rng.choice((2, 3, 6, 40, 300)))]
            self.declared += [f"enum e_{name} {{ {', '.join(members)} }}", f"{word} {name} : e_{name}"]
            self.headings.append(Heading(name, of_members(members)))
            self.conditions += [f"{name} = {members[0]}", f"@C({name})"]
        elif sort == "real":
            self._reals(name, word, rng.choice(REALS))
        elif sort == "single":
            self._singles(name, word, rng.choice(SINGLES))
        elif sort == "word":
            self._word(name, word)
        else:
            self._ints(name, word, sort)

    def _ints(self, name: str, word: str, sort: str) -> None:
        rng = self.rng
        low, high = rng.choice(INTS)
        cuts = {
            rng.choice((low, high, rng.randint(low, high), rng.randint(low, high)))
            for _ in range(rng.randint(2, 4))
        }
        points = [str(cut) for cut in cuts]
        if sort == "array":
            self.declared.append(f"{word} {name} : array[3] of int {low} .. {high}")
            self.headings.append(Heading(f"{name}[{rng.randrange(3)}]", of_numbers(points)))
            return
        self.declared.append(f"{word} {name} : int {low} .. {high}")
        self.headings.append(Heading(name, of_numbers(points)))
        if high - low < 2**40:
            self.whole.append(name)
            self.conditions += [f"{name} > {points[0]}", f"{name} mod 3 = 1"]
        if sort == "set":
            one, two = sorted(rng.choices(sorted(cuts), k=2))
            self.declared.append(f"set s_{name} : int {low} .. {high} = {{{one} .. {two}}}")
            self.headings.append(Heading(name, lambda rng: rng.choice((f"in s_{name}", f"not in s_{name}"))))

    def _word(self, name: str, word: str) -> None:
        rng = self.rng
        width = rng.choice((4, 8, 16, 32, 63, 64))
        self.masks |= width > 16
        # Not from `rng`: the other draws of a seed stay what they were.
        own = random.Random(f"{name} {width} {self.declared}")
        left_out = own.choice((0, 0, 0, 2 ** (width - 3), own.randrange(1, 2 ** (width - 1))))
        self.declared.append(f"{word} {name} : int 0 .. {2**width - 1 - left_out}")
        ways = [
            Heading(name, of_bits(width)),
            Heading(f"{name}[{width - 1}..0]", of_bits(width)),
            Heading(f"{name}[3..0]", of_numbers(["0", "3", "8", "15"])),
            Heading(f"{name}[3..0]", of_bits(4)),
            Heading(f"{name}[{width - 1}]", truths),
            Heading(name, of_numbers(["0", "1", str(2**width - 1 - left_out), str(2 ** (width - 1))])),
        ]
        self.headings += rng.sample(ways, rng.randint(1, 2))

    def _reals(self, name: str, word: str, ends: tuple[str, str]) -> None:
        low, high = map(float, ends)
        points = [
            repr(low + part * (high / 2 - low / 2)) for part in self.rng.sample((0.0, 0.5, 1.0, 1.5, 2.0), 3)
        ]
        self.declared.append(f"{word} {name} : real {ends[0]} .. {ends[1]}")
        self.headings.append(Heading(name, of_numbers(points)))
        self.real.append(name)
        self.conditions.append(f"{name} * 2.0 > {points[0]}")

    def _singles(self, name: str, word: str, ends: tuple[str, str]) -> None:
        points = self.rng.sample([*ends, *(("0.5", "0.25") if ends[0] == "0.0" else ("1.5", "-7.0"))], 3)
        points = [each for each in points if float(ends[0]) <= float(each) <= float(ends[1])]
        self.declared.append(f"{word} {name} : single {ends[0]} .. {ends[1]}")
        self.headings.append(Heading(name, of_numbers(points)))

    def across(self) -> None:
        """Perhaps a column about several variables, or none."""
        rng = self.rng
        if len(self.whole) > 1 and rng.randrange(2):
            one, two = rng.sample(self.whole, 2)
            points = [str(rng.randint(-9, 9)) for _ in range(3)]
            sums = (
                f"{one} - {two}",
                f"{one} + {two}",
                f"2 * {one} - {two}",
                f"min({one}, {two})",
                f"abs({one} - {two})",
            )
            self.headings.append(Heading(rng.choice(sums), of_numbers(points)))
            self.conditions += [f"{one} < {two}", f"{one} + {two} /= 3"]
        if len(self.real) > 1 and rng.randrange(2):
            one, two = rng.sample(self.real, 2)
            self.headings.append(
                Heading(
                    rng.choice((f"{one} - {two}", f"{one} + {two}", f"{one} * 1e308 - {two} * 1e308")),
                    of_numbers(["0.0", "0.5", "-1.0"]),
                )
            )
            self.conditions.append(f"{one} < {two}")
        if self.whole and not rng.randrange(6):
            one = rng.choice(self.whole)
            self.headings.append(
                Heading(f"single({one}) * 2e38 - single({one}) * 2e38", of_numbers(["0.0", "1.0"]))
            )
        if self.conditions and rng.randrange(2):
            given = list(self.conditions)

            def cell(rng: Rng) -> str:
                one, two = rng.choice(given), rng.choice(given)
                return rng.choice((one, f"not ({one})", f"{one} or {two}", f"{one} implies {two}"))

            self.headings.append(Heading("when", cell))


def drawn(rng: Rng, *, small: bool = False) -> str:
    """Draw a text with one table, or two of one level; nearly always one that is in order but for what is to be proved."""
    text = _drawn(rng, small)
    for _ in range(rng.choice((0, 20, 20, 20, 20, 20))):
        if isinstance(compile_text(text), Program):
            break
        text = _drawn(rng, small)
    return text


def _drawn(rng: Rng, small: bool) -> str:
    draw = Draw(rng, [], [], [], [], [])
    for name in NAMES[: rng.choice((1, 2) if small else (1, 1, 2, 2, 3, 4, 6))]:
        draw.variable(name)
    draw.across()
    assumed = [
        f"assume f_{at} : {rng.choice(draw.conditions)}"
        for at in range(rng.choice((0, 0, 0, 1, 2)))
        if draw.conditions
    ]
    named = [each.split()[1] for each in assumed if "for 300" not in each]
    lines = (2, 3, 4, 5) if small else (2, 2, 3, 3, 3, 4, 4, 5, 6, 8, 14, 30)
    most = MOST_LINES_OF_MASKS if draw.masks else max(lines)
    tables = [_table("t", draw, named, rng, min(most, rng.choice(lines)))]
    # Not from `rng`, as above.
    own = random.Random(f"{tables}")
    if not own.randrange(6):
        tables[0] = _turned(draw, named, own)
    elif own.randrange(2):
        greatest = own.choice((1, 2, 5, 40))
        draw.declared.append(f"state z : int 0 .. {greatest}")
        tables[0] = _with_state(tables[0], greatest, own)
    if not rng.randrange(8):
        tables.append(_table("u", draw, named, rng, min(most, rng.choice(lines))))
    shown = [
        f"level l {{ period 100 [ms] {' '.join(f'table {name}' for name in ('t', 'u')[: len(tables)])} }}"
    ]
    outputs = ["output o : int 0 .. 9", "state p : bool", "procedure q { p := not p }"]
    return "\n".join([*draw.declared, *outputs, *assumed, *tables, *shown, ""])


def _table(name: str, draw: Draw, assumed: Sequence[str], rng: Rng, many: int) -> str:
    heads = rng.sample(draw.headings, min(len(draw.headings), rng.randint(1, 6)))
    rows = [f"  | line | {' | '.join(each.text for each in heads)} || procedures | o |"]
    names = [f"n{at}" for at in range(many)]
    for at, each in enumerate(names):
        cells = [head.cells(rng) if rng.randrange(3) else "" for head in heads]
        # Not from `rng`, as above.
        own = random.Random(f"{heads[0].text} {cells}")
        if not own.randrange(6):
            cells = [_event(head, cell, draw, own) for head, cell in zip(heads, cells, strict=True)]
        order = _order(names[:at], names[at + 1 :], rng)
        rows.append(
            f"  | {each}{order} | {' | '.join(cells)} || {rng.choice(('', '', 'q'))} | {rng.randrange(3)} |"
        )
    if not rng.randrange(4):
        blank = "|".join(" " for _ in heads[1:])
        default = rng.choice(("DEFAULT", "DEFAULT", "DEFAULT unreachable"))
        rows.append(f"  | rest | {default} |{blank}{'|' if blank else ''}| | 1 |")
    rests = f" assuming {', '.join(assumed)}" if assumed and rng.randrange(3) else ""
    return "\n".join([f"table {name}{rests} {{", *rows, "}"])


def _event(head: Heading, cell: str, draw: Draw, rng: Rng) -> str:
    """A cell that says that its heading came to be what the cell says, or ceased to be, or changed; or the cell itself."""
    if head.text == "when" or "for 300" in cell or not rng.randrange(3):
        return cell
    word = rng.choice(("@T", "@F"))
    changed = word if head.cells is truths else "@C"
    event = rng.choice((f"{word}({cell})", changed)) if cell else changed
    guards = [
        each for each in draw.conditions if "@" not in each and "was " not in each and " for " not in each
    ]
    way = rng.randrange(4)
    if way == 0:
        return f"not {event}"
    return f"{event} when {rng.choice(guards)}" if way == 1 and guards else event


def _turned(draw: Draw, assumed: Sequence[str], rng: Rng) -> str:
    """A table that is printed the other way round: a matrix, or one with a column for each result."""
    columns = [(each.text, each.cells) for each in draw.headings]
    one = turned.drawn(columns, draw.conditions, "o", ("0", "1", "2", "o"), rng, named=True)
    rests = f" assuming {', '.join(assumed)}" if assumed and rng.randrange(2) else ""
    return "\n".join([f"table t {one.said}{rests} {{", *one.turned, "}"])


def _with_state(table: str, greatest: int, rng: Rng) -> str:
    """Give a table a state: a column of conditions, and one of actions."""
    cells = ("", "0", "1", "/= 1", "<= 1", str(greatest), "in {0, 1}", f"not in {{{greatest}}}")
    nexts = ("", "z", "0", "1", str(greatest), "1 - min(z, 1)", f"min(z + 1, {greatest})")
    head, heads, *rows, end = table.split("\n")
    before, after = heads.split("||")
    changed = [f"{before}| z ||{after} z |"]
    for row in rows:
        before, after = row.split("||")
        default = "DEFAULT" in row
        changed.append(f"{before}| {'' if default else rng.choice(cells)} ||{after} {rng.choice(nexts)} |")
    return "\n".join([head, *changed, end])


def _order(before: Sequence[str], after: Sequence[str], rng: Rng) -> str:
    """What a line stands above, and does the same as: no circle, as it is above later ones alone."""
    said = ""
    if after and not rng.randrange(5):
        said += f" above {', '.join(rng.sample(after, min(len(after), rng.randint(1, 3))))}"
    elif before and not rng.randrange(10):
        said += f" same {rng.choice(before)}"
    return said


def mutant(text: str, rng: Rng) -> str:
    """The text with one cell blank, or one line less."""
    rows = text.split("\n")
    places = [at for at, row in enumerate(rows) if row.startswith("  | n")]
    at = rng.choice(places)
    if rng.randrange(2) and len(places) > 2:
        return "\n".join([*rows[:at], *rows[at + 1 :]])
    left, bars, right = rows[at].partition("||")
    cells = left.split("|")
    cells[rng.randrange(2, max(3, len(cells) - 1))] = "  "
    rows[at] = "|".join(cells) + bars + right
    return "\n".join(rows)


# --- what is done with one ---------------------------------------------------------------


def commands(
    folder: Path, text: str, rng: Rng, *, every: bool = True
) -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield each command on a text, or `check` and a few others, by what it is called; a status of 3 is a bug in rcsc."""
    file, other = folder / "wrong.rcs", folder / "other.rcs"
    file.write_text(text, encoding="utf-8")
    other.write_text(mutant(text, rng), encoding="utf-8")

    def rcsc(*given: str) -> Callable[[], str]:
        return lambda: _run(given)

    form = rng.choice(("json", "sarif", "line", "github"))
    by_shell = {
        "check": ("check", "--no-cache", str(file)),
        f"check --format {form}": ("check", "--no-cache", "--format", form, str(file)),
        "fmt --expanded": ("fmt", "--expanded", str(file)),
        "graph": ("graph", str(file) + ":t", "--form", rng.choice(("mermaid", "dot", "scxml"))),
        "graph --lines": ("graph", str(file) + ":t", "--lines", "--form", "mermaid"),
        "diff": ("diff", str(file), str(other)),
    }
    names = list(by_shell) if every else ["check", rng.choice(list(by_shell)[1:])]
    for name in names:
        yield name, rcsc(*by_shell[name])
    if not every and rng.randrange(8):
        return
    workspace = Workspace()
    path = str(file)
    workspace.open(path, text)
    yield "glance", lambda: workspace.glance(path)
    yield "editor", lambda: workspace.check(path)
    answer = workspace.check(path)
    for finding in [each for each in answer.findings if each.mendable][:3]:
        yield "repairs", partial(workspace.repairs, finding)
    yield "witness", lambda: witness_run(workspace.checked(path), "t")


def _run(given: Sequence[str]) -> str:
    out, wrong = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(wrong):
        status = run(given)
    if "HangsError" in wrong.getvalue():
        raise HangsError(wrong.getvalue()[-300:])
    assert status in (0, 1, 2), f"status {status}: {wrong.getvalue()[-3000:]}"
    return out.getvalue() + wrong.getvalue()


@contextlib.contextmanager
def ending(most_s: float = HANGS_S) -> Iterator[None]:
    """Break off what takes more of the processor.

    Raises:
        HangsError: It does.
    """

    def late(_number: int, _frame: FrameType | None) -> None:
        raise HangsError(f"more than {most_s} s of the processor")

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, most_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


@dataclass(slots=True)
class Seen:
    """What a campaign came to.

    Attributes:
        slowest: By command, seconds of the processor on a wrong table, and its number.
        late: Tables that are wrong, with a command that took longer than it may.
        right: How often a command took so long on one that is not: that was a proof.
        failed: What ended otherwise.
        codes: How many tables have a finding of this code; `wrong`, how many have two and more.
    """

    slowest: dict[str, tuple[float, int]]
    late: dict[int, list[str]]
    right: int
    failed: dict[int, str]
    codes: Counter[str]


def campaign(count: int, seed: int, first: int = 0) -> Seen:
    """Draw tables and run every command on each."""
    seen = Seen({}, {}, 0, {}, Counter())
    for number in range(first, first + count):
        rng = random.Random(f"{seed} {number}")
        text = drawn(rng)
        with tempfile.TemporaryDirectory(prefix="rcsc-wrong-") as place:
            try:
                _one(Path(place), text, rng, number, seen)
            except HangsError as bug:
                if _wrong_soon(Path(place)):
                    seen.failed[number] = f"HangsError: {bug}"
                else:
                    seen.right += 1
            except Exception as bug:  # noqa: BLE001  # whatever it is, it is told with its number
                seen.failed[number] = f"{type(bug).__name__}: {str(bug)[-1500:]}"
        told = seen.late.get(number) or seen.failed.get(number)
        if told:
            print(f"table {number}: {told}", file=sys.stderr, flush=True)
    return seen


# --- what is called proved -----------------------------------------------------------------


def _report(file: Path) -> Report:
    return check(Settings((str(file),), Options(), use_cache=False))


UNREAD = {Code.UNREAD, Code.UNUSED_CONSTANT, Code.UNUSED_MEMBER}
"""A repair that changes or drops a test may be the last that read a name: nothing is said of that."""


def _wrong(report: Report) -> set[tuple[str, str]]:
    """What is wrong in a report, whatever is counted."""
    return {
        (each.code.value, re.sub(r"matches .*|, but .*", "", each.message))
        for each in report.diagnostics
        if each.severity is not Severity.NOTE and each.code not in UNREAD
    }


def _are_so(report: Report, text: str) -> None:
    """Raise where a witness of an overlap or a gap lies out of range, or is matched by other lines than is said."""
    program = compile_text(text)
    assert Code.SOLVERS_DISAGREE not in {each.code for each in report.diagnostics}, text
    if not isinstance(program, Program):
        return
    for finding in report.diagnostics:
        for witness in finding.witnesses if finding.code in (Code.OVERLAP, Code.GAP) else ():
            table = next(each for each in program.tables if each.name == witness.table)
            kinds = {str(each.name): each.type for each in program.variables}
            given = {
                name: unspelled(kinds[name], told)
                for name, told in zip(witness.variables, witness.values, strict=True)
            }
            for name, value in given.items():
                low, high = key_bounds(kinds[name])
                assert low <= key_of(kinds[name], value) <= high, (name, value, text)
            found = set(matching_lines(table, initial(program) | given))
            said = {line.name for line in witness.lines}
            assert said <= found if finding.code is Code.OVERLAP else not found, (witness, found, text)


def held(file: Path, text: str, rng: Rng) -> int:
    """Write out each proposal that is called proved, check the whole anew, and try inputs; how many there were.

    Raises:
        AssertionError: One does not do what is said of it, or something else is called proved.
    """
    file.write_text(text, encoding="utf-8")
    before = _report(file)
    _are_so(before, text)
    many = 0
    for finding in before.diagnostics:
        certain = [each for each in finding.proposals if each.certain]
        said = [
            each for each in (*finding.help, *finding.notes) if re.search(r"(?<!not )\bproved\b(?! or)", each)
        ]
        told = {each.said for each in certain}
        assert all(each in told or "that is then proved" in each for each in said), (said, told)
        for proposal in certain:
            new = with_proposal(before.sources[finding.primary.span.file], proposal)
            assert new is not None, proposal
            file.write_text(new, encoding="utf-8")
            _holds(finding, proposal, before, _report(file), rng)
            many += 1
    return many


def _holds(finding: Diagnostic, proposal: Proposal, before: Report, after: Report, rng: Rng) -> None:
    """Raise where a finding is still there, another has come, or some input is matched otherwise than is said."""
    source = after.sources[finding.primary.span.file]
    where = f"{proposal.title!r} written:\n{source.text}"
    wrong, now = _wrong(before), _wrong(after)
    capped = any(each.only_listed for each in before.diagnostics)
    assert capped or not now - wrong, (now - wrong, where)
    program = compile_text(source.text, source.name)
    assert isinstance(program, Program), where
    table = next(each for each in program.tables if each.name == proposal.table)
    pairs = [{line.name for line in each.lines} for each in finding.witnesses if len(each.lines) == 2]
    if finding.code is Code.OVERLAP and "overlaps together" in proposal.title:
        assert not any(code == Code.OVERLAP.value and f"`{table.name}`" in told for code, told in now), where
    elif finding.code is Code.OVERLAP:
        assert not any(each.message == finding.message for each in after.diagnostics), where
    elif finding.code is Code.GAP and proposal.whole:
        assert not any(
            each.code is Code.GAP and f"`{table.name}`" in each.message for each in after.diagnostics
        ), where
    known = declarations(program)
    for _ in range(60):
        try:
            matching = set(matching_lines(table, snapshot(known, table, rng)))
        except UNDEFINED:
            continue
        assert not any(pair <= matching for pair in pairs), (matching, where)


def helps_campaign(count: int, seed: int, first: int = 0) -> tuple[int, int, dict[int, str]]:
    """Draw tables until so many proposals were written out; how many these were, of how many tables, and what does not hold."""
    many, number, failed = 0, first, dict[int, str]()
    while many < count:
        rng = random.Random(f"{seed} {number}")
        with tempfile.TemporaryDirectory(prefix="rcsc-wrong-") as place:
            try:
                many += held(Path(place) / "wrong.rcs", drawn(rng), rng)
            except Exception as bug:  # noqa: BLE001  # whatever it is, it is told with its number
                failed[number] = f"{type(bug).__name__}: {str(bug)[-2500:]}"
                print(f"table {number}: {failed[number]}", file=sys.stderr, flush=True)
        number += 1
    return many, number - first, failed


# --- what is said of small tables, against every input --------------------------------------


def tiny(rng: Rng) -> str:
    """Draw a table over few values: sums, products, quotients, least and greatest; in lines, or printed the other way round."""
    unit = rng.choice(("", "", " [mm]"))
    ends = {name: rng.choice(((0, 6), (-3, 3), (0, 1), (1, 5), (-6, -1), (0, 12), (2, 2))) for name in "abc"}
    if rng.randrange(2):
        ends["c"] = (0, 0)
    declared = [f"input {name} : int {low} .. {high}{unit}" for name, (low, high) in ends.items()]
    declared += ["enum e_m { one, two, three }", "input m : e_m", "input d : bool", "state o : int 0 .. 9"]
    sums = ["a + b", "a - b", "2 * a - b", "a + b + c", "abs(a - b)", "min(a, b)", "max(a, b)", "a - 3 * c"]
    sums += [] if unit else ["a * b", "a * a - b", "a mod 3 + b"]
    sums += ["int(d) + int(m = one)"] if unit else ["a / 2 + b"]
    cuts = [f"{rng.randint(-7, 13)}{unit}" for _ in range(4)]
    compared = [f"{one} {op} {cut}" for one in sums[:-1] for op in ("<", ">=", "=") for cut in cuts[:2]]
    plain = rng.sample(compared, 4)
    small = ends["a"][1] - ends["a"][0] < 4 and ends["b"][1] - ends["b"][0] < 4
    events = (
        ["@T(a > b)", "@F(d)", "not @T(m = one)", "d and was d", "@T(inmode)", "not was inmode"]
        if small
        else ["d"]
    )
    conditions = [*plain, f"{plain[0]} or d", f"m = one and {plain[1]}", rng.choice(events)]
    heads = [
        Heading("m", of_members(("one", "two", "three"))), Heading("d", truths), Heading("a", partial(_tiny_cell, cuts)),
        *(Heading(each, partial(_tiny_cell, cuts)) for each in rng.sample(sums[:-1], 3)),
    ]  # fmt: skip
    assumed = rng.choice(("", "", "", rng.choice(plain), "a >= b", "m /= two"))
    declared += [f"assume f : {assumed}"] if assumed else []
    rests = " assuming f" if assumed and rng.randrange(4) else ""
    if not rng.randrange(3):
        columns = [(each.text, each.cells) for each in heads]
        one = turned.drawn(columns, conditions, "o", ("0", "1", "2", "o"), rng, named=rng.randrange(3) > 0)
        rows = [f"table t {one.said}{rests} {{", *one.turned, "}"]
    else:
        rows = [_tiny_table(rng, heads, conditions, rests)]
    return "\n".join([*declared, *rows, "level l { period 100 [ms] table t }", ""])


def _tiny_cell(cuts: Sequence[str], rng: Rng) -> str:
    one, other = rng.sample(list(cuts), 2)
    return rng.choice((f"< {one}", f">= {one}", f"> {other}", f"<= {other}", one, f"/= {one}"))


def _tiny_table(rng: Rng, heads: Sequence[Heading], conditions: Sequence[str], rests: str) -> str:
    shown = rng.sample(list(heads), rng.randint(0, 3))
    shown += (
        [Heading("when", lambda rng: rng.choice(list(conditions)))] if not shown or rng.randrange(3) else []
    )
    rows = [f"  | line | {' | '.join(each.text for each in shown)} || o |"]
    for at in range(rng.choice((1, 2, 2, 3, 4))):
        cells = [head.cells(rng) if rng.randrange(4) else "" for head in shown]
        rows.append(f"  | n{at} | {' | '.join(cells)} || {rng.randrange(3)} |")
    if not rng.randrange(3):
        rest = rng.choice(("DEFAULT", "DEFAULT", "DEFAULT unreachable"))
        rows.append(f"  | rest | {' | '.join([rest, *('' for _ in shown[1:])])} || 1 |")
    return "\n".join([f"table t{rests} {{", *rows, "}"])


@dataclass(frozen=True, slots=True)
class Every:
    """All inputs of a table that its assumptions allow, and the lines that match each."""

    program: Program
    inputs: list[tuple[dict[str, Value], frozenset[str]]]
    over: frozenset[str]

    @classmethod
    def of(cls, text: str, more: Collection[str] = ()) -> "Every | None":
        """Try every input of table `t`, over further variables, too."""
        program = compile_text(text)
        if not isinstance(program, Program):
            return None
        [table] = program.tables
        assumed = [each.condition for each in program.assumed(table)]
        names = dict(zip((str(each.name) for each in table.lines), names_of(table), strict=True))
        reads = set(table.variables).union(more, *map(read_by, assumed))
        kinds = {str(v.name): v.type for v in program.variables if v.name in reads}
        if prod(high - low + 1 for low, high in map(key_bounds, kinds.values())) > MOST_TINY:
            return None
        ends = [(kind, *key_bounds(kind)) for kind in kinds.values()]
        values = [[value_of_key(kind, key) for key in range(low, high + 1)] for kind, low, high in ends]
        found = []
        for point in product(*values):
            at = initial(program) | dict(zip(kinds, point, strict=True))
            try:
                if all(fold(each, at) for each in assumed):
                    found.append((at, frozenset(names[str(each)] for each in matching_lines(table, at))))
            except UNDEFINED:
                return None
        return cls(program, found, frozenset(kinds))

    @property
    def table(self) -> Table:
        """The one table."""
        return self.program.tables[0]

    @property
    def must_cover(self) -> bool:
        """Whether some line must match: there is no DEFAULT that may be reached."""
        return self.table.default is None or self.table.default.unreachable

    def unmatched(self) -> set[str]:
        """The inputs that no line matches."""
        return {_point(at) for at, lines in self.inputs if not lines}

    def twice(self) -> set[str]:
        """The inputs that several lines match."""
        return {_point(at) for at, lines in self.inputs if len(lines) > 1}


MOST_TINY = 20_000


def _point(at: dict[str, Value]) -> str:
    return repr(sorted(at.items()))


def told_of_all(file: Path, text: str) -> tuple[Counter[str], list[str]]:
    """Check a table and hold each finding, region, share and proved proposal against every input; what was held.

    Raises:
        AssertionError: Something is not so.
    """
    text = _laid_out(text)
    every = Every.of(text)
    came = Counter[str]()
    if every is None or not every.inputs:
        return came, []
    file.write_text(text, encoding="utf-8")
    report = _report(file)
    of_table = [each for each in report.diagnostics if each.witnesses and each.witnesses[0].table == "t"]
    open_ = {each.code for each in report.diagnostics} & {Code.UNDECIDED}
    codes = {each.code for each in of_table}
    gap, twice = every.unmatched(), every.twice()
    if not open_:
        wanted = Code.GAP if every.program.tables[0].default is None else Code.DEFAULT_REACHED
        wanted = wanted if every.must_cover else Code.DEFAULT_COVERS
        assert (wanted in codes) == bool(gap), (codes, len(gap), text)
        assert (Code.OVERLAP in codes) == bool(twice), (codes, len(twice), text)
    for finding in of_table:
        if finding.code in (Code.GAP, Code.DEFAULT_REACHED, Code.DEFAULT_COVERS):
            came += _shared(finding, every, gap, text)
        for witness in (
            finding.witnesses if finding.code in (Code.GAP, Code.OVERLAP, Code.DEFAULT_COVERS) else ()
        ):
            came += _region(finding, witness, every, text)
        came[
            f"{finding.code} {'with' if any(each.certain for each in finding.proposals) else 'without'} help"
        ] += 1
    kept = []
    for finding in report.diagnostics:
        for proposal in finding.proposals:
            came[f"{finding.code} {'proved' if proposal.certain else 'not proved'}"] += 1
            if proposal.certain:
                kept.append(_mended(report, finding, proposal, every))
    return came, kept


def _laid_out(text: str) -> str:
    return formatted(Source("t.rcs", text)) or text


def _shared(finding: Diagnostic, every: Every, gap: set[str], text: str) -> Counter[str]:
    told = re.search(r"([\d,]+) of ([\d,]+) \(", finding.message)
    if told is None:
        return Counter([f"{finding.code} without share"])
    many, whole = (int(each.replace(",", "")) for each in told.groups())
    whole_of_all = len(every.inputs)  # over what assumptions read, too, which may narrow nothing
    assert many * whole_of_all == len(gap) * whole, (finding.message, len(gap), whole_of_all, text)
    left = finding.more + sum(witness.inputs or 1 for witness in finding.witnesses)
    assert left == many, (finding, text)
    return Counter([f"{finding.code} with share"])


def _region(finding: Diagnostic, witness: WitnessColumn, every: Every, text: str) -> Counter[str]:
    """Hold a region against every input in it."""
    names = dict(zip((str(each.name) for each in every.table.lines), names_of(every.table), strict=True))
    said = {names[line.name] for line in witness.lines}
    told = zip(witness.variables, witness.values, strict=True)
    given = {name: unspelled(every.program.kinds[name], value) for name, value in told}
    there = [lines for at, lines in every.inputs if all(at[name] == value for name, value in given.items())]
    assert there, (witness, text)
    assert all(said <= lines if said else not lines for lines in there), (witness, text)
    whole = all((said <= lines if said else not lines) for _, lines in every.inputs)
    if not witness.region and not whole:
        return Counter([f"{finding.code} without region"])
    claimed = "true" if not witness.region else " and ".join(f"({each})" for each in witness.region)
    claimed = re.sub(r"was_([a-z]+)", r"was \1", claimed)
    program = compile_text(text + f"assume region_ : {claimed}\n")
    if not isinstance(program, Program):
        return Counter([f"{finding.code} region not read"])
    condition = program.assumptions[-1].condition
    inside = [lines for at, lines in every.inputs if fold(condition, at)]
    assert inside, (witness, text)
    assert all(said <= lines if said else not lines for lines in inside), (witness, text)
    if set(witness.variables) == every.over:
        assert witness.inputs in (None, len(inside)), (witness, len(inside), text)
    return Counter([f"{finding.code} with region"])


def _mended(report: Report, finding: Diagnostic, proposal: Proposal, every: Every) -> str:
    """Write a proposal that is called proved, and hold it against every input: no input is worse off, and the finding is gone."""
    source = report.sources[finding.primary.span.file]
    new = with_proposal(source, proposal)
    where = f"{proposal.title!r} of\n{source.text}\nwritten:\n{new}"
    assert new is not None, where
    assert _laid_out(new) == new, where
    after = Every.of(new, every.over)
    assert after is not None, where
    assert after.unmatched() <= every.unmatched(), where
    assert after.twice() <= every.twice(), where
    if finding.code is Code.GAP:
        assert not after.unmatched() if proposal.whole else after.unmatched() < every.unmatched(), where
    if finding.code is Code.OVERLAP:
        names = dict(zip((str(each.name) for each in every.table.lines), names_of(every.table), strict=True))
        pairs = [{names[line.name] for line in each.lines} for each in finding.witnesses]
        assert not any(pair <= lines for pair in pairs for _, lines in after.inputs), where
    return new


def tiny_campaign(count: int, seed: int, first: int = 0) -> tuple[Counter[str], dict[int, str]]:
    """Draw so many small tables and hold all that is said of them against every input; what was held, and what is not so."""
    came, failed = Counter[str](), dict[int, str]()
    for number in range(first, first + count):
        rng = random.Random(f"{seed} {number} tiny")
        text = next(
            (each for each in (tiny(rng) for _ in range(20)) if isinstance(compile_text(each), Program)), ""
        )
        with tempfile.TemporaryDirectory(prefix="rcsc-wrong-") as place:
            try:
                came += told_of_all(Path(place) / "wrong.rcs", text)[0]
            except Exception as bug:  # noqa: BLE001  # whatever it is, it is told with its number
                failed[number] = f"{type(bug).__name__}: {str(bug)[-2500:]}"
                print(f"table {number}: {failed[number]}", file=sys.stderr, flush=True)
    return came, failed


def _one(place: Path, text: str, rng: Rng, number: int, seen: Seen) -> None:
    """Run the commands; what is late counts if it is so three times, each as slow as a loop beside it: others slow the processor."""
    (place / "rcsc.toml").touch()
    state = rng.getstate()
    took_s, errors = _timed(place, text, rng)
    for _ in range(2):
        if any(_is_late(*each) for each in took_s.items()):
            slowed = _slowed()
            rng.setstate(state)
            again_s, _ = _timed(place, text, rng)
            slowed = min(slowed, _slowed())
            took_s = {name: min(once_s, again_s[name] / slowed) for name, once_s in took_s.items()}
    late = [f"{name} {once_s:.1f} s" for name, once_s in took_s.items() if _is_late(name, once_s)]
    wrong = set(errors) - {Code.UNDECIDED.value}  # what is only left open is a proof that is not finished
    if wrong and late:
        seen.late[number] = late
    else:
        seen.right += len(late)
    for name, once_s in took_s.items():
        if wrong:
            seen.slowest[name] = max(seen.slowest.get(name, (0.0, -1)), (once_s, number))
    seen.codes.update(set(errors))
    seen.codes["two and more"] += len(errors) > 1


def _wrong_soon(place: Path) -> bool:
    """Whether something is known to be wrong with few steps."""
    told = _run(("check", "--no-cache", "--steps", "0.2", str(place / "wrong.rcs")))
    return bool(set(re.findall(r"error\[(RCS\d+)\]", told)) - {Code.UNDECIDED.value})


def _slowed() -> float:
    """Count in a loop, and return how much longer that takes than where nothing else runs; 1 at least."""
    begun, counted = time.process_time(), 0
    for number in range(1_000_000):
        counted += number * number
    return max(1.0, (time.process_time() - begun) / LOOP_S)


def _is_late(name: str, took_s: float) -> bool:
    return took_s > (MOST_OF_PROOFS_CPU_S if name in ("graph --lines", "diff") else MOST_CPU_S)


def _timed(place: Path, text: str, rng: Rng) -> tuple[dict[str, float], list[str]]:
    """Run the commands; what each took of the processor, and the errors that `check` tells."""
    took_s: dict[str, float] = {}
    errors: list[str] = []
    for name, does in commands(place, text, rng, every=False):
        begun = time.process_time()
        try:
            with ending():
                answer = does()
        except HangsError:
            raise
        except Exception as bug:
            raise AssertionError(f"{name}: {type(bug).__name__}: {bug}") from bug
        took_s[name] = max(took_s.get(name, 0.0), time.process_time() - begun)
        errors = re.findall(r"error\[(RCS\d+)\]", str(answer)) if name == "check" else errors
    return took_s, errors


def main() -> None:
    """A long run, by command."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--count", type=int, default=1_000)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--first", type=int, default=0, help="the number of the first")
    arguments.add_argument(
        "--helps", action="store_true", help="write out so many proposals that are called proved"
    )
    arguments.add_argument(
        "--tiny", action="store_true", help="small tables: all that is said of each against every input"
    )
    arguments.add_argument("--show", action="store_true", help="print the first, and no more")
    given = arguments.parse_args()
    os.environ["NO_COLOR"] = "1"
    if given.show:
        print(drawn(random.Random(f"{given.seed} {given.first}")))
        return
    if given.tiny:
        came, untrue = tiny_campaign(given.count, given.seed, given.first)
        for kind, often in sorted(came.items()):
            print(f"{kind:24} {often:6}")
        print(f"{given.count} tables, seed {given.seed}: {len(untrue)} of which something is not so")
        return
    if given.helps:
        many, tables, failed = helps_campaign(given.count, given.seed, given.first)
        print(
            f"{many} proposals of {tables} tables, seed {given.seed}: {len(failed)} tables of which something does not hold"
        )
        return
    seen = campaign(given.count, given.seed, given.first)
    for name, (took_s, number) in sorted(seen.slowest.items(), key=lambda each: -each[1][0]):
        print(f"{name:24} at most {took_s:6.2f} s of the processor, table {number}")
    for code, many in sorted(seen.codes.items()):
        print(f"{code:24} {many:6}")
    for number, what in seen.late.items():
        print(f"table {number} is late: {', '.join(what)}")
    for number, why in seen.failed.items():
        print(f"table {number} failed: {why}")
    print(
        f"{given.count} tables, seed {given.seed}: {len(seen.late)} late, {len(seen.failed)} failed; "
        f"{seen.right} times it took longer on one that is right"
    )


if __name__ == "__main__":
    main()

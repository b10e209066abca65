"""The index of a dossier as a page that is handed to an assessor: what was looked at, what it shows and lacks, what is accepted.

In: a `Dossier`, plain values. Out: one HTML file without a script; places lead to the page of texts beside it (`documents`). A section
that has nothing says so.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import groupby
from operator import attrgetter

from rcsc.code.testing.figures import counted
from rcsc.views.pages.documents import framed, led, row, tabled
from rcsc.views.pages.frame import quoted

_PLACE = re.compile(r"(?P<file>[^:\s]+\.(?:c|h|rcs)):(?P<line>\d+)")
_NONE = '<span class="soft">none</span>'


@dataclass(frozen=True, slots=True)
class AcceptedPoint:
    """A finding that is meant: a deviation from a guideline, or what a tool finds and a reason explains.

    Attributes:
        rule: The guideline or the check.
        where: File and line, as a person would look it up.
        reason: Why it is meant.
    """

    rule: str
    where: str
    reason: str


@dataclass(frozen=True, slots=True)
class ShownKind:
    """A kind of evidence of one program.

    Attributes:
        summary: What it is about.
        figures: What it shows, a line each.
        lacks: What it does not show: place, and what with the reason.
        missing: The tool that is not installed; empty where it is.
        accepted: What is meant, with reasons.
        files: Path below the dossier, and SHA-256, of each file that it kept.
    """

    name: str
    summary: str
    figures: Sequence[str]
    lacks: Sequence[tuple[str, str]]
    missing: str
    accepted: Sequence[AcceptedPoint]
    files: Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class ShownProgram:
    """A program or system of a dossier.

    Attributes:
        name: What its folder is called.
        source: The file that it is declared in, or described.
        looked_at: Which C was looked at, in words.
        code: Path on the page of texts, and SHA-256, of each file of C.
        kinds: Its evidence.
    """

    name: str
    source: str
    looked_at: str
    code: Sequence[tuple[str, str]]
    kinds: Sequence[ShownKind]


@dataclass(frozen=True, slots=True)
class Dossier:
    """What the page says.

    Attributes:
        made: Sentences about when, by whom and how it was made, with names in backticks.
        tools: Kind, tool and version.
        programs: What evidence was made of.
        texts: The paths on the page of texts.
    """

    made: Sequence[str]
    tools: Sequence[tuple[str, str, str]]
    programs: Sequence[ShownProgram]
    texts: Sequence[str]


def dossier_page(dossier: Dossier) -> str:
    """Return the page."""
    body = ["<h1>Evidence</h1>", *(f"<p>{quoted(line)}</p>" for line in dossier.made)]
    body += ["<h2>What it comes to</h2>", _overview(dossier)]
    body += ["<h2>Tools</h2>", _table({"kind": 16, "tool": 24, "version": 60}, dossier.tools)]
    for program in dossier.programs:
        body += _program(program, dossier.texts)
    return framed("Evidence", body)


def _overview(dossier: Dossier) -> str:
    rows = [
        row(
            f'<a href="#{_anchor(program.name, kind.name)}">{escape(program.name)}</a>',
            escape(kind.name),
            _comes_to(kind),
            str(len(kind.accepted)) if kind.accepted else _NONE,
        )
        for program in dossier.programs
        for kind in program.kinds
    ]
    without = [
        row(escape(each.name), _NONE, '<span class="bad">no C was there to look at</span>', _NONE)
        for each in dossier.programs
        if not each.kinds
    ]
    widths = {"program": 22, "kind": 16, "comes to": 46, "accepted with a reason": 16}
    return tabled(widths, rows + without) if rows or without else "<p>Nothing was looked at.</p>"


def _comes_to(kind: ShownKind) -> str:
    if kind.missing:
        return f'<span class="bad">shows nothing: {quoted(kind.missing)}</span>'
    if kind.lacks:
        return f'<span class="bad">lacks {counted(len(kind.lacks), "point")}</span>'
    return "lacks nothing"


def _program(program: ShownProgram, texts: Sequence[str]) -> Iterator[str]:
    yield f'<h2 id="{escape(program.name)}">{escape(program.name)}</h2>'
    yield f"<p>Of {_linked(program.source, texts)}. Looked at: {quoted(program.looked_at)}.</p>"
    rows = (row(_linked(path, texts), f"<code>{digest}</code>") for path, digest in program.code)
    yield tabled({"C": 40, "SHA-256": 60}, rows) if program.code else "<p>There is no C of it.</p>"
    for kind in program.kinds:
        yield f'<h3 id="{_anchor(program.name, kind.name)}">{escape(kind.name)}: {escape(kind.summary)}</h3>'
        yield from _kind(program, kind, texts)


def _kind(program: ShownProgram, kind: ShownKind, texts: Sequence[str]) -> Iterator[str]:
    own = {path.rpartition("/")[2]: path for path, _ in program.code}
    if kind.missing:
        yield f'<p><span class="bad">Shows nothing: {quoted(kind.missing)}</span></p>'
        return
    yield f"<ul>{''.join(f'<li>{quoted(line)}</li>' for line in kind.figures)}</ul>"
    if kind.lacks:
        yield '<p class="bad">What it lacks</p>'
        rows = (row(_placed(where, own, texts), quoted(what)) for where, what in kind.lacks)
        yield tabled({"where": 25, "what, and why": 75}, rows)
    else:
        yield "<p>It lacks nothing.</p>"
    if kind.accepted:
        yield "<p>Accepted, each with its reason</p>"
        yield tabled({"rule": 18, "reason": 52, "places": 30}, _accepted(kind.accepted, own, texts))
    rows = (
        row(f'<a href="{escape(path)}">{escape(path)}</a>', f"<code>{digest}</code>")
        for path, digest in kind.files
    )
    yield tabled({"file": 40, "SHA-256": 60}, rows) if kind.files else "<p>It keeps no file.</p>"


def _accepted(points: Sequence[AcceptedPoint], own: Mapping[str, str], texts: Sequence[str]) -> Iterator[str]:
    """Yield a row for each rule and reason, with all its places."""
    known = attrgetter("rule", "reason")
    for (rule, reason), same in groupby(sorted(points, key=known), key=known):
        places = ", ".join(_placed(where, own, texts) for where in dict.fromkeys(one.where for one in same))
        yield row(quoted(rule), quoted(reason), places)


def _placed(where: str, own: Mapping[str, str], texts: Sequence[str]) -> str:
    """Return a place, as a link where the text is there that it is in."""
    found = _PLACE.fullmatch(where)
    path = "" if found is None else own.get(found["file"], found["file"])
    if found is None or path not in texts:
        return quoted(where)
    return led(path, found["line"], escape(where))


def _linked(path: str, texts: Sequence[str]) -> str:
    shown = f"<code>{escape(path)}</code>"
    return led(path, 1, shown) if path in texts else shown


def _table(widths: Mapping[str, int], rows: Sequence[tuple[str, ...]]) -> str:
    if not rows:
        return "<p>No tool was asked.</p>"
    return tabled(widths, (row(*map(escape, cells)) for cells in rows))


def _anchor(program: str, kind: str) -> str:
    return escape(f"{program}-{kind}")

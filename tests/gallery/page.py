"""The gallery's page: sizes and findings out of the tables, words out of each entry's own page, features out of the sources."""

import re
from collections import Counter
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from rcsc import check
from rcsc.base.diagnostics.diagnostic import Severity
from tests.support.programs.stages import shipped

REPO = Path(__file__).parents[2]
GALLERY = REPO / "tables" / "gallery"
PAGE = GALLERY / "README.md"
ENTRIES = tuple(sorted(path.parent for path in GALLERY.glob("*/README.md")))
MENDED = sorted(
    path for path in GALLERY.glob("*/*.rcs") if path.name != "words.rcs" and "published" not in path.name
)
"""Tables that are not as published."""

NAMES = {
    "RCS401": "gap",
    "RCS402": "overlap",
    "RCS403": "line that never matches",
    "RCS412": "index out of range",
    "RCS417": "broken invariant",
}
"""What one finding of a code is called."""
ALWAYS_TOLD = ("RCS401", "RCS402")

FEATURES = {
    "named sets": r"^set ",
    "`not in`": r"\bnot in\b",
    "`-` or a blank for what does not count, `DEFAULT` for all else": r"\| DEFAULT",
    "masks of a word": r"(?<!\w)(?:0b)?(?=[01x ]*x)[01x]{4}[ _][01x]{4}(?!\w)",
    "a matrix, or a column for each result": r"^table \w+ (?:by .* )?giving ",
    "conditions over several variables, under `when`": r"\| when +\|",
    "`was`, `@T`, `@F`, `@C`": r"\bwas\b|@[TFC]\(",
    "time: `for`": r"\bfor \d",
    "several tables in a cycle": r"^level \w+ \{[^}]*^  table [^}]*^  table ",
    "an order between lines: `above`": r"^ *\|[^|\n]*\babove\b",
    "lines that do the same: `same`": r"^ *\|[^|\n]*\bsame\b",
    "facts about inputs and state: `assume`": r"^assume ",
    "invariants": r"^invariant ",
    "properties over cycles, for `rcsc prove`": r"^property ",
    "procedures": r"^procedure ",
    "arrays": r"\barray\[",
}
"""A feature of the language, and what its use looks like in a source without its comments."""


def page() -> str:
    """Return the gallery's page as it ought to be: what is made stands between its marks, all else as it is."""
    text = PAGE.read_text(encoding="utf-8")
    for name, rows in (
        ("findings", findings_table()),
        ("features", features_table()),
        ("lacks", lacks_table()),
    ):
        before, mark, rest = text.partition(f"<!-- {name} -->\n")
        _, end, after = rest.partition(f"<!-- end of {name} -->")
        assert all((mark, end)), f"{PAGE}: no place for {name}"
        text = before + mark + rows + end + after
    return text


def written(paths: Iterable[Path]) -> str:
    """Return paths as a command has them, from the root."""
    return " ".join(str(path.relative_to(REPO)) for path in paths)


def findings_table() -> str:
    """Return a row for each table as published, in the order of the entries, and how many findings they have."""
    head = ("entry", "source", "theirs", "here", "findings", "the one that matters")
    rows = table(head, [row for entry in ENTRIES for row in findings_of(entry)])
    return f"{rows}\n{totals()}"


def findings_of(entry: Path) -> list[tuple[str, ...]]:
    """Return the rows of an entry; each of its files as published is named in its page once, or each table of one."""
    described = words_of(entry)
    told = [name for name, *_ in described]
    for path in entry.glob("*published.rcs"):
        here = [name for name in told if name.partition(":")[0] == path.name]
        assert here in ([path.name], names_of(path)), f"{path}: {here}"
    rows: list[tuple[str, ...]] = []
    for name, source, theirs, matters in described:
        file, _, own = name.partition(":")
        short = own or file.removesuffix("published.rcs").strip("_")
        link = f"[{entry.name}]({entry.name}/README.md) {short}".strip()
        path = entry / file
        rows.append((link, source, theirs, size(path, own), findings(path, own), matters))
    return rows


def names_of(path: Path) -> list[str]:
    """Return what an entry's page calls the tables of a file where it tells them one by one: `FILE:TABLE`."""
    return [f"{path.name}:{published.name}" for published in shipped(str(path), REPO).tables]


def words_of(entry: Path) -> list[tuple[str, str, str, str]]:
    """Return what an entry's page says of its tables: file, source, what the source has, the finding that matters."""
    last = (entry / "README.md").read_text(encoding="utf-8").partition("## On the gallery's page\n")[2]
    rows = re.findall(r"^\| `(\S+)` \| (.*?) \| (.*?) \| (.*?) \|$", last, re.MULTILINE)
    return [(file, source, theirs, matters) for file, source, theirs, matters in rows]


def size(path: Path, name: str) -> str:
    """Return how many lines and columns of conditions a table has, as `8 x 1`; of several, how many lines they have."""
    tables = [table for table in shipped(str(path), REPO).tables if name in {"", table.name}]
    if len(tables) > 1:
        return f"{sum(len(table.lines) for table in tables)} in {len(tables)} tables"
    return f"{len(tables[0].lines)} x {len(tables[0].columns)}"


def findings(path: Path, name: str) -> str:
    """Return how many findings of each kind `rcsc check` has of a table, or of all of a file, as `1 gap, 2 overlaps`."""
    return in_words(numbers(path, name))


def totals() -> str:
    """Return a sentence on all tables as published together."""
    files = [path for entry in ENTRIES for path in sorted(entry.glob("*published.rcs"))]
    tables = sum(len(shipped(str(path), REPO).tables) for path in files)
    every = sum((numbers(path, "") for path in files), Counter[str]())
    return f"{len(ENTRIES)} entries, {tables} tables as published: {in_words(every)}.\n"


@cache
def numbers(path: Path, name: str) -> Counter[str]:
    """Return how many errors of each code `rcsc check` has of a table, or of all of a file; an overlap is a pair of lines."""
    every = [found for found in check(path).diagnostics if found.severity is Severity.ERROR]
    assert all("table `" in found.message for found in every) or not name, path
    errors = [found for found in every if not name or f"table `{name}`" in found.message]
    of_code = Counter(found.code.value for found in errors)
    assert of_code.keys() <= NAMES.keys(), f"{path}: {of_code}"
    of_code["RCS402"] = len(
        {
            (witness.table, *(line.name for line in witness.lines))
            for found in errors
            if found.code.value == "RCS402"
            for witness in found.witnesses
        }
    )
    return of_code


def in_words(of_code: Counter[str]) -> str:
    """Return numbers of findings in words; gaps and overlaps always."""
    return ", ".join(
        counted(of_code[code], name) for code, name in NAMES.items() if of_code[code] or code in ALWAYS_TOLD
    )


def counted(number: int, what: str) -> str:
    """Return `1 gap`, `2 gaps`."""
    many = {
        "line that never matches": "lines that never match",
        "index out of range": "indexes out of range",
    }.get(what, f"{what}s")
    return f"{number} {what if number == 1 else many}"


def features_table() -> str:
    """Return a row for each feature that an entry uses: the entries whose sources have it."""
    sources = {entry: sources_of(entry) for entry in ENTRIES}
    rows = [
        (
            feature,
            ", ".join(
                entry.name
                for entry, text in sources.items()
                if re.search(use, text, re.MULTILINE | re.DOTALL)
            ),
        )
        for feature, use in FEATURES.items()
    ]
    return table(("feature", "entries that use it"), [row for row in rows if row[1]])


def sources_of(entry: Path) -> str:
    """Return all sources of an entry without their comments."""
    texts = (path.read_text(encoding="utf-8") for path in sorted(entry.glob("*.rcs")))
    return "\n".join(re.sub(r"#.*", "", text) for text in texts)


def lacks_table() -> str:
    """Return a row for each entry that says what it lacks."""
    lacks = (
        (
            entry.name,
            re.search(r"^\*Lacks\.\* (.*)$", (entry / "README.md").read_text(encoding="utf-8"), re.MULTILINE),
        )
        for entry in ENTRIES
    )
    return table(
        ("entry", "what it lacks, and writes instead"), [(name, said[1]) for name, said in lacks if said]
    )


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = (head, ("---",) * len(head), *rows)
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines).replace(" --- ", "---")

"""What a dossier is of: digests of every file, versions, options, target, date and who ran it; and whether a checkout is that still.

In: what was looked at and made. Out: the record that lies beside the index; or, of a kept one, each file that is another now. Places of
tables and of generated code are those seen from where the command runs: the checkout. Those of reports begin in the dossier.
"""

import getpass
import hashlib
import json
import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rcsc import __version__
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files.read import CheckedFields, Malformed, content, json_of, text
from rcsc.base.host.tools import Absent, c_compiler, run_command
from rcsc.code.testing.boards import BOARDS
from rcsc.driver.compile import CodeFound
from rcsc.driver.settings import Conclusion, Settings
from rcsc.views.evidence.kind import Evidence

INDEX, RECORD = "index.html", "index.json"
FORM = 2
"""Version of the record's form; it rises when a member changes its meaning or goes away."""
EPOCH = "SOURCE_DATE_EPOCH"
MOST_PROGRAMS = 10_000


@dataclass(frozen=True, slots=True)
class Part:
    """A program or system of a dossier.

    Attributes:
        tables: Files that it is declared in.
        code: Its C, as it was looked at.
        kinds: Its evidence.
    """

    source: str
    tables: tuple[str, ...]
    code: CodeFound
    kinds: Mapping[str, Evidence]

    @property
    def files(self) -> dict[str, str]:
        """What is kept of it, by path below its folder: the reports, and C that lies nowhere else."""
        kept = {
            f"{kind}/{path}": text for kind, made in self.kinds.items() for path, text in made.files.items()
        }
        return (
            kept if self.code.folder is not None else {**{f"code/{p}": t for p, t in self.c.items()}, **kept}
        )

    @property
    def c(self) -> dict[str, str]:
        """Its C and headers, text by path below the generated folder."""
        there = {path: text for path, text in self.code.files.items() if path not in self.code.lacking}
        return {path: text for path, text in there.items() if path.endswith((".c", ".h"))}


@dataclass(frozen=True, slots=True)
class Making:
    """How a dossier was made.

    Attributes:
        by: Who ran the command.
        date: When, in UTC.
        versions: Of the tools of each kind.
    """

    by: str
    date: str
    settings: Settings
    versions: Mapping[str, Mapping[str, str]]

    def told(self) -> dict[str, Any]:
        """Return it as plain values, by what each is called."""
        options = self.settings.options
        return {
            "form": FORM,
            "tool": {"name": "rcsc", "version": __version__},
            "command": "evidence",
            "date": self.date,
            "by": self.by,
            "paths": list(self.settings.paths),
            "options": {"steps": options.steps, "memory_mb": options.memory_mb, "solver": options.solver},
            "target": {"host": _host(), "boards": _boards() if "resources" in self.versions else []},
            "tools": {kind: dict(versions) for kind, versions in self.versions.items()},
        }


def user() -> str:
    """Return the name of the user; "unknown" where the machine has none."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "unknown"


def today() -> str:
    """Return the date and time in UTC: those of `SOURCE_DATE_EPOCH`, where it is set.

    Raises:
        ValueError: It is no number of seconds.
    """
    said = os.environ.get(EPOCH)
    now = datetime.now(UTC) if said is None else datetime.fromtimestamp(int(said), UTC)
    return now.strftime("%Y-%m-%dT%H:%M:%SZ")


def _host() -> str:
    """Return the machine that the compiler makes programs for, which ran what was run on no board."""
    compiler = c_compiler()
    if isinstance(compiler, Absent):
        return "no C compiler"
    return run_command([compiler, "-dumpmachine"], Path(), 60.0).out.strip()


def _boards() -> list[str]:
    return [board.name for board in BOARDS if not board.absent()]


def sha256(data: bytes | str) -> str:
    """Return the digest of bytes, or of a text in UTF-8."""
    return hashlib.sha256(data if isinstance(data, bytes) else data.encode()).hexdigest()


def record(making: Making, parts: Mapping[str, Part], pages: Mapping[str, str]) -> str:
    """Return the record of a dossier as JSON.

    Args:
        making: How it was made.
        parts: Programs and systems, by the names of their folders.
        pages: Its index, and the texts that this leads to, by name.
    """
    seen: dict[str, dict[str, str]] = {}
    programs = []
    for name, part in parts.items():
        code, folder = {}, part.code.folder
        if folder is not None:
            code = {str(folder / path): sha256(text) for path, text in sorted(part.c.items())}
            seen.setdefault(str(folder / "c"), {}).update(code)
        programs.append(
            {
                "program": name,
                "source": part.source,
                "looked_at": part.code.words,
                "tables": {path: sha256(content(Path(path))) for path in part.tables},
                "code": code,
                "reports": {f"{name}/{path}": sha256(text) for path, text in sorted(part.files.items())},
            }
        )
    beside = sorted(path for where in seen for path in _c_in(Path(where)) if path not in seen[where])
    digests = {name: sha256(text) for name, text in pages.items()}
    document = {**making.told(), "pages": digests, "programs": programs, "not_looked_at": beside}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def heading(making: Making) -> tuple[str, ...]:
    """Return the sentences of the index that say how the dossier was made."""
    told = making.told()
    options = ", ".join(f"{name} {value}" for name, value in told["options"].items())
    target = ", ".join([told["target"]["host"], *told["target"]["boards"]])
    of = ", ".join(making.settings.paths)
    return (
        f"Made {making.date} by {making.by}, with rcsc {__version__}, of {of}. Options: {options}. Target: {target}.",
        "Every table is proved: exactly one line matches; `rcsc check` says what that trusts.",
        "What levels do over time and together is proved by `rcsc prove`; `rcsc trace` leads from requirements to code and tests.",
        f"`{RECORD}` has the SHA-256 of every file; `rcsc evidence --check` holds them against a checkout.",
    )


def superseded(folder: Path, files: Collection[str]) -> Iterator[Path]:
    """Yield the files that an earlier dossier in this folder had and this one has not, as they were written.

    Args:
        folder: Of the dossier.
        files: Paths below it that this one has.
    """
    try:
        kept = _of_the_folder(CheckedFields(json_of(text(folder / RECORD)), RECORD))
    except (OSError, Malformed):
        return
    for path, digest in kept.items():
        here = folder / path
        if (
            path not in files
            and folder.resolve() in here.resolve().parents
            and _differs(here, digest) is None
        ):
            yield here


# --- a dossier that was kept ------------------------------------------------------------------


def held(folder: Path) -> Conclusion:
    """Hold a dossier against this checkout: each file that differs, is missing, or is new.

    Raises:
        OSError: It has no record.
        Malformed: The record is none.
    """
    document = CheckedFields(json_of(text(folder / RECORD)), RECORD)
    document.whole("form", FORM, FORM)
    digests = {str(folder / path): sha for path, sha in _of_the_folder(document).items()}
    looked: dict[str, str] = {}
    for program in document.each("programs", MOST_PROGRAMS):
        looked |= {**_digests(program, "tables"), **_digests(program, "code")}
    beside = set(_paths(document.value.get("not_looked_at", [])))
    known = {**looked, **digests}
    changed = [one for path, sha in sorted(known.items()) if (one := _differs(Path(path), sha))]
    parents = {str(Path(path).parent) for path in looked if path.endswith((".c", ".h"))}
    here = {str(path) for path in folder.rglob("*") if path.is_file()} - {str(folder / RECORD)}
    there = {path for parent in parents for path in _c_in(Path(parent))} - beside
    new = sorted((here | there) - known.keys())
    found = (*changed, *(_finding(path, "is new: no evidence was made of it") for path in new))
    tool = document.table("tool").text("version")
    made = f"made {document.text('date')} by {document.text('by')} with rcsc {tool}"
    same = f"{len(known) - len(changed)} of {len(known)} files are those of {folder}"
    return Conclusion(Report(found), f"{same}, {made}")


def _of_the_folder(document: CheckedFields) -> dict[str, str]:
    """Return the digests of what lies in the folder of a record: pages and reports, by path below it."""
    found = _digests(document, "pages")
    for program in document.each("programs", MOST_PROGRAMS):
        found |= _digests(program, "reports")
    return found


def _digests(program: CheckedFields, key: str) -> dict[str, str]:
    value = program.table(key).value
    for path in _paths(list(value)):
        program.table(key).text(path)
    return dict(value)


def _paths(values: Any) -> list[str]:
    """Return the values, if they are relative paths.

    Raises:
        Malformed: One is none.
    """
    if not isinstance(values, list) or any(not isinstance(one, str) or os.path.isabs(one) for one in values):
        raise Malformed(f"{RECORD} names a file otherwise than by a relative path")
    return values


def _c_in(folder: Path) -> Iterator[str]:
    """Yield the C and headers of a folder, which may be gone."""
    if folder.is_dir():
        yield from (str(path) for path in sorted(folder.iterdir()) if path.suffix in {".c", ".h"})


def _differs(path: Path, sha: str) -> Diagnostic | None:
    try:
        there = sha256(content(path))
    except OSError:
        return _finding(str(path), "is missing")
    except Malformed as error:
        return _finding(str(path), f"differs from what the evidence is of: it {error}")
    return None if there == sha else _finding(str(path), "differs from what the evidence is of")


def _finding(path: str, what: str) -> Diagnostic:
    helps = ("`rcsc evidence` makes the dossier anew",)
    return Diagnostic(Code.DOSSIER_OLD, f"`{path}` {what}", Label(Span(path, 0, 0)), help=helps)

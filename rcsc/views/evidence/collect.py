"""All the evidence that was asked for: proved programs to files in a folder, an index and findings."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files.read import text
from rcsc.code.emit.generated import written
from rcsc.code.testing.apart import Ended, apart
from rcsc.driver.compile import (
    CodeFound,
    code_of,
    files_of,
    files_of_system,
    generated_of,
    planned,
    systems_in,
    with_programs,
)
from rcsc.driver.pipeline import Proved, proved
from rcsc.driver.settings import CodeWanted, Conclusion, Settings
from rcsc.lang.model import ProvedProgram
from rcsc.lang.resolve import closure
from rcsc.views.evidence import analysers, coverage, model_check, resources, runtime
from rcsc.views.evidence.dossier import INDEX, RECORD, Making, Part, heading, record, sha256, superseded
from rcsc.views.evidence.kind import Evidence, Kind, Missed, Shortfall, Subject
from rcsc.views.evidence.misra import compliance
from rcsc.views.evidence.whole import Whole
from rcsc.views.evidence.whole import collect as collect_whole
from rcsc.views.pages.documents import TEXTS, texts_page
from rcsc.views.pages.dossier_page import Dossier, ShownKind, ShownProgram, dossier_page

KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "coverage": coverage.KIND,
        "runtime": runtime.KIND,
        "analysers": analysers.KIND,
        "model-check": model_check.KIND,
        "resources": resources.KIND,
        "misra": compliance.KIND,
    }
)
"""By the names that `--only` takes, in the order in which they are made and listed. A new one is a module and its line here."""


def collect(
    settings: Settings, kinds: Collection[str], folder: Path, code: CodeWanted, by: str, date: str
) -> Conclusion:
    """Prove every table, make each kind of evidence of every program, and write it.

    Args:
        settings: Which tables and systems, and how they are proved.
        kinds: Names among `KINDS`.
        folder: Where the files go: `folder/PROGRAM/KIND/...`, with an index and a record. Files of the same names are replaced.
        code: Which generated files are looked at.
        by: Who runs the command.
        date: When.

    Raises:
        BadDescription: A system is not in order.
    """
    project = proved(with_programs(settings, tuple(systems_in(settings.paths))))
    report = project.report()
    if report.failed:
        return Conclusion(report, "no evidence was made: not everything is proved")
    made: dict[str, Part] = {}
    diagnostics: list[Diagnostic] = []
    names = [name for name in KINDS if name in kinds]
    for looks in _subjects(settings, project, code, diagnostics):
        if other := next(
            (part for name, part in made.items() if name.casefold() == looks.name.casefold()), None
        ):
            diagnostics.append(_same_name(looks.name, looks.root, other.source))
            continue
        of_one: dict[str, Evidence] = {}
        for name in names if not looks.code.lacking else ():
            settings.progress(f"{looks.root}: {name}")
            missed = of_one["coverage"].missed if "coverage" in of_one else None
            of_one[name] = looks.at(name, missed, settings.progress)
            diagnostics += _findings(looks.root, name, of_one[name])
        diagnostics += looks.code.stale
        made[looks.name] = Part(looks.root, looks.tables, looks.code, of_one)
    settings.progress("")
    making = Making(by, date, settings, {name: KINDS[name].versions() for name in names})
    files = _files(making, made)
    old = tuple(superseded(folder, files))
    diagnostics += written(files, folder)
    for path in old:
        path.unlink(missing_ok=True)
    return Conclusion(project.report(tuple(diagnostics)), _closing(folder, made))


Look = Callable[[str, tuple[Missed, ...] | None, Callable[[str], None]], Evidence]


@dataclass(frozen=True, slots=True)
class _Looks:
    """A program or system to make evidence of: its name, root and files, its code, and its evidence by kind."""

    name: str
    root: str
    tables: tuple[str, ...]
    code: CodeFound
    look: Look

    def at(self, kind: str, missed: tuple[Missed, ...] | None, progress: Callable[[str], None]) -> Evidence:
        """Make evidence of a kind; of code that is not what the tables give, in a process of its own, which it may end.

        Args:
            kind: Its name.
            missed: What was not covered, where that was measured before.
            progress: Called with each step.
        """
        if not self.code.stale:
            return self.look(kind, missed, progress)
        made = apart(self.look, kind, missed, progress=progress, silent_s=LONGEST_S)
        return Evidence((), shortfalls=(Shortfall(self.name, made.why),)) if isinstance(made, Ended) else made


LONGEST_S = 4000.0
"""Seconds in which a kind tells of no progress, at most: twice the longest time limit of a tool."""


def _subjects(
    settings: Settings, project: Proved, code: CodeWanted, clashes: list[Diagnostic]
) -> Iterator[_Looks]:
    """Yield every program, then every system; put systems without C among `clashes`."""
    systems = tuple(systems_in(settings.paths))
    for root, program in project.executable:
        found = code_of(root, partial(files_of, program, ("c",)), code, systems)
        subject = _subject(program, found, settings)
        tables = tuple(sorted(name for name in closure(root, project.loaded) if Path(name).is_file()))
        yield _Looks(program.program.name, root, tables, found, partial(_looked, subject))
    for path in systems:
        generated = generated_of(project, (path,), ("c",), defensive=False)
        clashes += generated.clashes
        if not generated.clashes:
            found = code_of(str(path), partial(files_of_system, path, project, ("c",)), code, (path,))
            system = Whole(generated.systems[path], found.files)
            yield _Looks(system.system.word, str(path), (str(path),), found, partial(_whole, system))


def _looked(
    subject: Subject, kind: str, missed: tuple[Missed, ...] | None, progress: Callable[[str], None]
) -> Evidence:
    return KINDS[kind].collect(replace(subject, progress=progress, missed=missed))


def _whole(
    system: Whole, kind: str, missed: tuple[Missed, ...] | None, progress: Callable[[str], None]
) -> Evidence:
    return collect_whole(replace(system, progress=progress, missed=missed), kind)


def _subject(program: ProvedProgram, found: CodeFound, settings: Settings) -> Subject:
    return Subject(program, planned(program, defensive=found.defensive), found.files, settings.options)


def _same_name(name: str, root: str, other: str) -> Diagnostic:
    """Report that no evidence was made of a program: its files would be those of another."""
    message = f"no evidence of `{root}`: its folder `{name}` has that of `{other}`"
    helps = ("make the evidence of each by itself, with a folder of its own, or rename one of the files",)
    return Diagnostic(Code.NAME_COLLISION, message, Label(Span(root, 0, 0)), help=helps)


def _findings(root: str, kind: str, evidence: Evidence) -> Iterator[Diagnostic]:
    """Yield one finding for a kind that lacks something, with every shortfall as a note."""
    if evidence.missing:
        message = f"no evidence of kind `{kind}`: {evidence.missing}"
        yield Diagnostic(Code.EVIDENCE_LACKS, message, Label(Span(root, 0, 0)))
    elif evidence.shortfalls:
        count = len(evidence.shortfalls)
        message = f"the evidence of kind `{kind}` lacks {count} {'point' if count == 1 else 'points'}"
        notes = tuple(f"{short.where}: {short.what}" for short in evidence.shortfalls)
        yield Diagnostic(Code.EVIDENCE_LACKS, message, Label(Span(root, 0, 0)), notes=notes)


def _files(making: Making, made: Mapping[str, Part]) -> dict[str, str]:
    """Return every file, the index with the texts that it leads to, and the record, by path below the folder."""
    files = {f"{name}/{path}": text for name, part in made.items() for path, text in part.files.items()}
    texts = _texts(made)
    pages = {INDEX: dossier_page(_dossier(making, made, tuple(texts))), TEXTS: texts_page(texts)}
    return {**files, **pages, RECORD: record(making, made, pages)}


def _texts(made: Mapping[str, Part]) -> dict[str, str]:
    """Return the tables and the C that were looked at, by path."""
    tables = {path: text(Path(path)) for part in made.values() for path in part.tables}
    return tables | {_path(name, part, path): c for name, part in made.items() for path, c in part.c.items()}


def _path(name: str, part: Part, path: str) -> str:
    """Return where a file of C lies; of C that lies nowhere, where its dossier keeps it."""
    return str(part.code.folder / path) if part.code.folder is not None else f"{name}/code/{path}"


def _dossier(making: Making, made: Mapping[str, Part], texts: Sequence[str]) -> Dossier:
    """Return what the index says."""
    tools = [(kind, *tool) for kind, versions in making.versions.items() for tool in versions.items()]
    programs = [
        ShownProgram(
            name,
            part.source,
            part.code.words,
            [(_path(name, part, path), sha256(c)) for path, c in sorted(part.c.items())],
            [_shown(name, kind, evidence) for kind, evidence in part.kinds.items()],
        )
        for name, part in made.items()
    ]
    return Dossier(heading(making), tools, programs, texts)


def _shown(program: str, kind: str, evidence: Evidence) -> ShownKind:
    lacks = [(short.where, short.what) for short in evidence.shortfalls]
    files = [(f"{program}/{kind}/{path}", sha256(each)) for path, each in evidence.files.items()]
    summary = KINDS[kind].summary
    return ShownKind(kind, summary, evidence.figures, lacks, evidence.missing, evidence.accepted, files)


def _closing(folder: Path, made: Mapping[str, Part]) -> str:
    lines = [
        f"{name}: {line}"
        for name, part in made.items()
        for line in (
            f"evidence of {part.code.words}",
            *(f for made in part.kinds.values() for f in made.figures),
        )
    ]
    return "\n".join([*lines, f"the evidence is in {folder / INDEX}"])

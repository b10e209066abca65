"""All the evidence that was asked for: proved programs to files in a folder, an index and findings."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files import write_atomically
from rcsc.code.emit import emitted
from rcsc.driver.compile import Generated, planned, systems_in, tables_in
from rcsc.driver.pipeline import Proved, proved
from rcsc.driver.settings import Conclusion, Settings
from rcsc.lang.model import ProvedProgram
from rcsc.views.evidence.kind import Evidence, Subject
from rcsc.views.evidence.kinds import KINDS
from rcsc.views.evidence.whole import kinds as whole
from rcsc.views.evidence.whole.kinds import Whole

INDEX = "index.md"


def collect(settings: Settings, kinds: Collection[str], folder: Path) -> Conclusion:
    """Prove every table, make each kind of evidence of every program, and write it.

    Args:
        settings: Which tables and systems, and how they are proved.
        kinds: Names among `KINDS`.
        folder: Where the files go: `folder/PROGRAM/KIND/...`, with an index. Files of the same names are replaced.

    Raises:
        BadDescription: A system is not in order.
    """
    project = proved(_of_tables(settings))
    report = project.report()
    if report.failed:
        return Conclusion(report, "no evidence was made: not everything is proved")
    made: dict[str, dict[str, Evidence]] = {}
    diagnostics: list[Diagnostic] = []
    names = [name for name in KINDS if name in kinds]
    roots: dict[str, str] = {}
    for root, looks in _subjects(settings, project, diagnostics):
        if (other := roots.setdefault(looks.name.casefold(), root)) != root:
            diagnostics.append(_same_name(looks.name, root, other))
            continue
        of_one = made[looks.name] = {}
        for name in names:
            settings.progress(f"{root}: {name}")
            of_one[name] = looks.at(name)
            diagnostics += _findings(root, name, of_one[name])
    settings.progress("")
    diagnostics += _written(folder, made)
    return Conclusion(project.report(tuple(diagnostics)), _closing(folder, made))


@dataclass(frozen=True, slots=True)
class _Looks:
    """A program or system to make evidence of: its name, and its evidence by kind."""

    name: str
    at: Callable[[str], Evidence]


def _subjects(settings: Settings, project: Proved, clashes: list[Diagnostic]) -> Iterator[tuple[str, _Looks]]:
    """Yield every program by its root, then every system by its description; put systems without C among `clashes`."""
    for root, program in project.executable:
        subject = _subject(program, settings)
        yield root, _Looks(program.program.name, partial(_looked, subject))
    for path in systems_in(settings.paths):
        generated = Generated(("c",), defensive=False)
        for root, program in project.executable:
            generated.add_program(root, program)
        generated.add_system(path)
        clashes += generated.clashes
        if not generated.clashes:
            system = Whole(generated.systems[path], generated.files, settings.progress)
            yield str(path), _Looks(system.system.word, partial(whole.collect, system))


def _looked(subject: Subject, kind: str) -> Evidence:
    return KINDS[kind].collect(subject)


def _of_tables(settings: Settings) -> Settings:
    """Return the settings with the programs of the systems' levels among the paths."""
    return replace(settings, paths=tables_in(settings.paths, tuple(systems_in(settings.paths))))


def _subject(program: ProvedProgram, settings: Settings) -> Subject:
    plan = planned(program)
    return Subject(program, plan, emitted(plan), settings.options, settings.progress)


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


def _written(folder: Path, made: Mapping[str, Mapping[str, Evidence]]) -> Iterator[Diagnostic]:
    """Write every file and the index; yield a diagnostic for each that the operating system refuses."""
    files = {
        f"{program}/{kind}/{path}": text
        for program, kinds in made.items()
        for kind, evidence in kinds.items()
        for path, text in evidence.files.items()
    }
    for path, text in {**files, INDEX: _index(made)}.items():
        try:
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            write_atomically(folder / path, text.encode())
        except OSError as error:
            yield Diagnostic(
                Code.NOT_WRITTEN,
                f"`{folder / path}`: cannot be written: {error.strerror}",
                Label(Span(str(folder), 0, 0)),
            )


def _index(made: Mapping[str, Mapping[str, Evidence]]) -> str:
    """Return a page with the results of each program and kind, the shortfalls, and links to the files."""
    parts = ["# Evidence", ""]
    for program, kinds in made.items():
        parts += [f"## {program}", ""]
        for kind, evidence in kinds.items():
            parts += [f"### {kind}: {KINDS[kind].summary}", ""]
            parts += [f"- {line}" for line in _told(evidence)]
            parts += [f"- [{path}]({program}/{kind}/{path})" for path in evidence.files]
            parts.append("")
    return "\n".join(parts)


def _told(evidence: Evidence) -> Iterator[str]:
    yield from evidence.figures
    if evidence.missing:
        yield f"shows nothing: {evidence.missing}"
    yield from (f"lacks: {short.where}: {short.what}" for short in evidence.shortfalls)


def _closing(folder: Path, made: Mapping[str, Mapping[str, Evidence]]) -> str:
    lines = [
        f"{program}: {line}"
        for program, kinds in made.items()
        for evidence in kinds.values()
        for line in evidence.figures
    ]
    return "\n".join([*lines, f"the evidence is in {folder / INDEX}"])

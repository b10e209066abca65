"""Texts that are open over the files on disk, and what is known of them.

In: texts as they are typed. Out: answers. One thread at a time has things proved: solvers are not shared; any may open and read.
Nothing is kept on disk, and the cache of earlier runs is not asked: what is typed is mostly new.
"""

import os
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity, WitnessColumn, sort_key
from rcsc.base.diagnostics.report import TableReport, resting
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.memory import uncollected
from rcsc.compose.proof.system import NoProgramError
from rcsc.compose.together.words import LevelsRead, levels_read, system_naming
from rcsc.desk.editor.grid import grids
from rcsc.desk.editor.memo import Memo, OutdatedError
from rcsc.desk.editor.names.find import Names, Party
from rcsc.desk.editor.places import Area, Lines, difference
from rcsc.desk.editor.recovery import Meaning, Rest, rest_of
from rcsc.desk.editor.values import (
    BEING_PROVED,
    GIVEN_UP,
    Answer,
    Finding,
    Repair,
    Standing,
    Witness,
    WitnessLine,
    standing,
)
from rcsc.driver.proofs import table_report
from rcsc.lang.model import Program
from rcsc.lang.project import PROJECT_FILE, Loaded, load, project_root
from rcsc.lang.resolve import resolve
from rcsc.lang.written.changes import with_proposal, with_spelling
from rcsc.lang.written.tables import WrittenTable, tables_of
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import WRONG_STEPS, Options
from rcsc.proof.symbolic.remembered import remembering
from rcsc.proof.table.mending import COUNTED, key, mended, serious
from rcsc.proof.table.program import prove_program
from rcsc.run.description import BadDescription, Description, LevelSpec
from rcsc.run.log.across import parties

if TYPE_CHECKING:
    from rcsc.lang.syntax import tree

BOM = "\ufeff"
GLANCE_STEPS = 200_000
"""Steps of Z3 a question while somebody types: some hundredths of a second."""
MOST_OF_A_REPAIR = 2 * WRONG_STEPS
"""Steps in which the text that a repair makes is checked; one that takes more is not offered."""
GLANCE_S = 0.06
"""How long who has typed waits for a glance, in seconds: what is not found by then is left open, and the answer is put together."""
LEAST_S = 0.02
"""Processor time that a glance is given however long it is held up, so that a busy machine tells something, too."""
_LEFT_OPEN = {Code.UNDECIDED}
"""Findings that a larger budget may take away."""


@dataclass(frozen=True, slots=True)
class Reading:
    """A file read as the texts were, with all that it uses; nothing is proved of it.

    Attributes:
        path: The file.
        loaded: What was read.
        program: None where the text is not in order.
        rest: What is looked at instead.
        wrong: Why it is not in order.
        levels: Of a file of requirements across levels, what they are about.
    """

    path: str
    loaded: Loaded
    program: Program | None
    rest: Rest | None
    wrong: tuple[Diagnostic, ...]
    levels: LevelsRead | None = None

    @property
    def nearest(self) -> Program | None:
        """The program, or the rest of it."""
        return self.program if self.rest is None else self.rest.program

    @property
    def files(self) -> "Mapping[str, tree.File]":
        """Every file that parses, and the rest of each that does not; those of the levels that requirements are about, too."""
        own = self.loaded.files if self.rest is None else {**self.loaded.files, **self.rest.loaded.files}
        return {**{name: file for each in self._levels for name, file in each.files.items()}, **own}

    @property
    def sources(self) -> Mapping[str, Source]:
        """Every text as it is."""
        rest = {} if self.rest is None else self.rest.loaded.sources
        levels = {name: source for each in self._levels for name, source in each.sources.items()}
        return {**levels, **rest, **self.loaded.sources}

    @property
    def names(self) -> Names:
        """The names of all that is read."""
        across = {} if self.levels is None else {self.path: _parties(self.levels)}
        return Names(self.files, self.sources, self.nearest, across)

    @property
    def _levels(self) -> tuple[Loaded, ...]:
        return () if self.levels is None else tuple(self.levels.loaded.values())


@dataclass(frozen=True, slots=True)
class Checked:
    """A file checked as the texts were.

    Attributes:
        diagnostics: What `rcsc check` says of the file.
        meanwhile: What else was found in the rest.
        reports: Of each table, by file and name.
    """

    reading: Reading
    diagnostics: tuple[Diagnostic, ...]
    meanwhile: tuple[Diagnostic, ...]
    reports: Mapping[tuple[str, str], TableReport]


class Workspace:
    """Open texts over the disk.

    Attributes:
        options: How proofs are made.
        memo: What was proved of earlier texts.
    """

    def __init__(self, options: Options | None = None) -> None:
        smt.for_threads()  # who edits waits in one thread for what another proves
        self.options = options or Options()
        self.memo = Memo()
        self._overlay: Mapping[str, str] = {}
        self._readings: dict[str, Reading] = {}
        self._levels: dict[Path, LevelsRead] = {}
        self._reads = threading.Lock()
        self._checked: dict[str, Checked] = {}
        self._answers: dict[str, tuple[Checked, Answer]] = {}

    # --- texts ---

    def open(self, file: str, text: str) -> None:
        """Let a text stand for a file, whether or not there is one on disk; again for each change.

        Args:
            file: Its path; it need not exist.
            text: All of it. A byte order mark is no part of what it says.
        """
        blank = " " if text.startswith(BOM) else ""
        self._overlay = {**self._overlay, os.path.realpath(file): blank + text.removeprefix(BOM)}

    def close(self, file: str) -> None:
        """Return to the text on disk."""
        gone = os.path.realpath(file)
        self._overlay = {path: text for path, text in self._overlay.items() if path != gone}

    @property
    def overlay(self) -> Mapping[str, str]:
        """The open texts, by real path."""
        return self._overlay

    def text(self, file: str) -> str:
        """Return the text of a file: the open one, else the one on disk; empty if none can be read."""
        open_text = self._overlay.get(os.path.realpath(file))
        if open_text is not None:
            return open_text
        loaded = load([file], overlay=self._overlay)
        return loaded.sources[file].text if file in loaded.sources else ""

    def trial(self, texts: Mapping[str, str]) -> "Workspace":
        """Return another workspace of the same texts, with some replaced, that shares the verdicts of this one.

        Args:
            texts: By path.
        """
        other = Workspace(self.options)
        other.memo = self.memo
        other._overlay = {**self._overlay, **{os.path.realpath(path): text for path, text in texts.items()}}
        return other

    # --- answers ---

    def answered(self, path: str) -> Answer | None:
        """Return the last answer to a file, if no text that it depends on has changed since; prove nothing."""
        known, checked = self._answers.get(path), self._checked.get(path)
        if known is None or checked is None or checked.reading is not self.reading(path):
            return None
        return known[1]

    def check(self, file: str, go_on: Callable[[], bool] = lambda: True) -> Answer:
        """Check a file and all that it uses, as the texts are now.

        Args:
            file: Its path; answers name files by absolute paths.
            go_on: Asked from time to time; where it says no the answer is given up.

        Raises:
            OutdatedError: Nobody waits for the answer.
        """
        path = os.path.normpath(os.path.abspath(file))
        with self._asking(go_on):
            return self._answer(path, self.checked(path))

    def glance(
        self, file: str, go_on: Callable[[], bool] = lambda: True, since_s: float | None = None
    ) -> Answer:
        """Check a file in a moment: return the answer, or one that is not final where a question needs more steps.

        Args:
            file: As for `check`.
            go_on: As for `check`.
            since_s: Since when somebody waits, by `time.monotonic`; from now on where it is None.

        Raises:
            OutdatedError: Nobody waits for the answer.
        """
        path = os.path.normpath(os.path.abspath(file))
        over = _spent(time.monotonic() if since_s is None else since_s)
        with self._asking(go_on):
            reading = self.reading(path)
            known = self._checked.get(path)
            if known is not None and known.reading is reading:
                return self._answer(path, known)
            before = smt.unanswered()
            steps = min(GLANCE_STEPS, self.options.steps)
            options = replace(self.options, steps=steps, cpu_s=GLANCE_S, brief=True)
            self.memo.keeps_all = False
            try:
                with smt.until(over, breaks_off=True):
                    checked = self._check(reading, options)
            finally:
                self.memo.keeps_all = True
            self.memo.asked()
            if smt.unanswered() == before:
                self._checked[path] = checked
                return self._answer(path, checked)
            return _answer(path, checked, final=False)

    def given_up(self, file: str, error: Exception) -> Answer:
        """Return the answer where a bug in rcsc prevented one: a finding that reports it, and unproved tables.

        Args:
            file: As for `check`; its text, which may be at fault, is only split into tables.
            error: Is printed, too.
        """
        traceback.print_exception(error, file=sys.stderr)
        path = os.path.normpath(os.path.abspath(file))
        told = Diagnostic(
            Code.INTERNAL,
            f"a bug in rcsc: {type(error).__name__} as it looked at this file",
            Label(Span(path, 0, 0)),
            help=("undo the last change and make it in another way; please report it with the text",),
        )
        texts = {path: self._overlay.get(os.path.realpath(path), "")}
        files = _Files({path: Source(path, texts[path])})
        tables = tuple(grids(path, files.of(path), None, lambda _: GIVEN_UP))
        return Answer(path, (_finding(files, told, meanwhile=False),), tables, whole=False, texts=texts)

    def _answer(self, path: str, checked: Checked) -> Answer:
        known = self._answers.get(path)
        if known is None or known[0] is not checked:
            self._answers[path] = known = (checked, _answer(path, checked))
        return known[1]

    @contextmanager
    def _asking(self, go_on: Callable[[], bool]) -> Iterator[None]:
        """Prove only while somebody waits.

        Raises:
            OutdatedError: Nobody waits any more.
        """
        self.memo.go_on = go_on
        with (
            uncollected(),
            remembering(self.memo.answers),
            smt.until(lambda: not go_on(), breaks_off=True),
        ):
            yield
        if not go_on():
            raise OutdatedError

    @uncollected()
    def reading(self, path: str) -> Reading:
        """Read a file, from memory if no text that it depends on has changed; any thread may ask.

        Args:
            path: Absolute and normal.
        """
        with self._reads:
            overlay = self._overlay
            loaded = load([path], overlay=overlay)
            before = self._readings.get(path)
            system = system_naming(path)
            levels = None if system is None else self._levels_of(system, overlay)
            if before is not None and _alike(before.loaded, loaded) and before.levels is levels:
                return before
            if system is not None and levels is None:  # which is told of the level that is not in order
                reading = Reading(path, loaded, None, None, loaded.diagnostics)
            else:
                means = resolve if levels is None else levels.means
                reading = replace(_read(path, loaded, overlay, means), levels=levels)
            self._readings[path] = reading
            return reading

    def _levels_of(self, system: Path, overlay: Mapping[str, str]) -> LevelsRead | None:
        """Read the levels of a system as the texts are; a level that is not in order as it last was, None where it never was."""
        before = self._levels.get(system)

        def read(path: Path, described: Description, spec: LevelSpec) -> tuple[Program, Loaded]:
            now = described.load(path, spec, overlay)
            known = None if before is None or spec.name not in before.programs else before
            if now is None:
                raise NoProgramError(spec.name)
            if known is not None and _alike(known.loaded[spec.name], now):
                return known.programs[spec.name], known.loaded[spec.name]
            program = resolve(now.roots[0], now)
            if isinstance(program, Program):
                return program, now
            if known is None:
                raise NoProgramError(spec.name)
            return known.programs[spec.name], known.loaded[spec.name]

        try:
            now = levels_read(system, read)
        except (BadDescription, NoProgramError):
            return before
        if before is not None and now.system == before.system and _all_alike(before.loaded, now.loaded):
            return before
        self._levels[system] = now
        return now

    def checked(self, path: str) -> Checked:
        """Check a file, from memory if no text that it depends on has changed."""
        reading = self.reading(path)
        before = self._checked.get(path)
        if before is None or before.reading is not reading:
            before = self._check(reading, self.options)
            self.memo.asked()
            self._checked[path] = before
        return before

    def _check(self, reading: Reading, options: Options) -> Checked:
        if reading.program is not None and reading.levels is None:
            found, reports = self._proved(reading, reading.program, options)
            every = tuple(sorted({*reading.wrong, *found}, key=sort_key))
            return Checked(reading, every, (), reports)
        if reading.rest is None:
            return Checked(reading, reading.wrong, (), {})
        found = (
            ()
            if reading.rest.program is None or reading.levels is not None
            else self._proved(reading, reading.rest.program, options, reading.rest.harmed)[0]
        )
        more = {*reading.rest.wrong, *serious(found)} - set(reading.wrong)
        return Checked(reading, reading.wrong, tuple(sorted(more, key=sort_key)), {})

    def _proved(
        self, reading: Reading, program: Program, options: Options, harmed: Sequence[Span] = ()
    ) -> tuple[tuple[Diagnostic, ...], dict[tuple[str, str], TableReport]]:
        """Prove a program; return its findings and a report of each table, without those in declarations of which a part was left out."""
        names = [table.name for table in program.tables if not _inside(table.span, harmed)]
        verdict = prove_program(program, options, only=names, known=self.memo)
        reports = {}
        for each in verdict.tables:
            report = resting(table_report(each, program), verdict.unproved, verdict.unsafe)
            reports[report.file, report.table] = report
        loaded = reading.loaded if reading.rest is None else reading.rest.loaded
        told = mended(verdict, reading.path, loaded, options, self.memo)
        if harmed:
            told = tuple(each for each in told if not _inside(each.primary.span, harmed))
        return told, reports

    def project(self, file: str) -> tuple[str, ...]:
        """Return the files that may belong with one: those of its project, or without a project file those beside it alone.

        Args:
            file: Absolute and normal.
        """
        root = project_root(file)
        if os.path.isfile(os.path.join(root, PROJECT_FILE)):
            found = load([root], overlay=self._overlay).given
        else:
            names = os.listdir(root) if os.path.isdir(root) else []
            found = tuple(os.path.join(root, name) for name in sorted(names) if name.endswith(".rcs"))
        return tuple(dict.fromkeys((file, *map(os.path.normpath, found))))

    def read_all(self, files: Sequence[str], over: Mapping[str, str] | None = None) -> Loaded:
        """Read files and all that they use, as the texts are.

        Args:
            files: Absolute.
            over: Texts that stand for what is open, by path.
        """
        texts = {os.path.realpath(path): text for path, text in (over or {}).items()}
        return load(files, overlay={**self._overlay, **texts})

    # --- repairs ---

    def repairs(self, finding: Finding) -> tuple[Repair, ...]:
        """Return the repairs of a finding. Each was made and checked: with it the finding is gone, and no other has come."""
        checked = next(
            (
                each
                for path, each in self._checked.items()
                if finding.told in (*each.diagnostics, *each.meanwhile)
                and each.reading is self.reading(path)  # in an older text the same stood elsewhere
            ),
            None,
        )
        if checked is None or not finding.mendable:
            return ()
        return tuple(self._repairs(checked, finding.told))

    def _repairs(self, checked: Checked, told: Diagnostic) -> Iterator[Repair]:
        source = checked.reading.loaded.sources.get(told.primary.span.file)
        if source is None:
            return
        for proposal in told.proposals:
            text = with_proposal(source, proposal)
            outcome = None if text is None else self._outcome(checked, source, told, text)
            if text is not None and outcome is not None:
                edits = difference(source.name, Lines(source.text), text)
                known = proposal.proved if proposal.certain else ""
                yield Repair(proposal.title, known, edits, outcome, certain=proposal.certain)
        spelt = with_spelling(source, told)
        if spelt is not None:
            text, meant = spelt
            edits = difference(source.name, Lines(source.text), text)
            yield Repair(f"write `{meant}`", "", edits, clears=False, certain=False)

    def _outcome(self, checked: Checked, source: Source, told: Diagnostic, text: str) -> bool | None:
        """Tell whether a text has no error in the table; return None where the finding stays, or another has come."""
        trial = self.trial({source.name: text})
        with smt.together(MOST_OF_A_REPAIR, of_all=True):
            after = trial.checked(checked.reading.path)
        before = {key(each) for each in serious(checked.diagnostics)}
        now = {key(each) for each in serious(after.diagnostics)}
        messages = {each.message for each in after.diagnostics}
        gone = key(told) not in now or (told.code in COUNTED and told.message not in messages)
        if after.reading.program is None or not gone or now - before:
            return None
        table = told.proposals[0].table
        wrong = any(table in _names_in(after.reading.loaded, each) for each in serious(after.diagnostics))
        return not wrong


def _inside(span: Span, wholes: Iterable[Span]) -> bool:
    """Tell whether a place is in one of several declarations."""
    return any(whole.file == span.file and whole.start <= span.start < whole.end for whole in wholes)


def _read(path: str, loaded: Loaded, overlay: Mapping[str, str], means: Meaning) -> Reading:
    resolved = means(path, loaded) if path in loaded.files else ()
    if isinstance(resolved, Program):
        return Reading(path, loaded, resolved, None, loaded.diagnostics)
    wrong = tuple(sorted({*loaded.diagnostics, *resolved}, key=sort_key))
    return Reading(path, loaded, None, rest_of(path, loaded, wrong, overlay, means), wrong)


def _spent(since_s: float) -> Callable[[], bool]:
    """Return a function that tells, in any thread, whether this one has used up a glance for somebody who waits since then."""
    clock = time.pthread_getcpuclockid(threading.get_ident())
    begun_s = time.clock_gettime(clock)
    return lambda: time.monotonic() - since_s >= GLANCE_S and time.clock_gettime(clock) - begun_s >= LEAST_S


def _alike(before: Loaded, now: Loaded) -> bool:
    return (before.roots, before.sources, before.diagnostics, before.uses) == (
        now.roots,
        now.sources,
        now.diagnostics,
        now.uses,
    )


def _parties(levels: LevelsRead) -> dict[str, Party]:
    """Return the parties of a system, by name."""
    found = {name: Party() for name in parties(levels.system, levels.programs)}
    for name, program in levels.programs.items():
        files = frozenset(map(os.path.realpath, levels.loaded[name].files))
        found[name] = Party(files, program)
    return found


def _all_alike(before: Mapping[str, Loaded], now: Mapping[str, Loaded]) -> bool:
    return before.keys() == now.keys() and all(_alike(before[name], now[name]) for name in now)


def _names_in(loaded: Loaded, diagnostic: Diagnostic) -> set[str]:
    """Return the tables in whose text a finding stands: one, or none."""
    span = diagnostic.primary.span
    text = loaded.sources[span.file].text if span.file in loaded.sources else ""
    return {table.name for table in tables_of(text) if table.start <= span.start <= table.end}


# --- answers ---------------------------------------------------------------------------


@dataclass(slots=True)
class _Files:
    """The texts that an answer points into, by lines, and their tables."""

    sources: Mapping[str, Source]
    lines: dict[str, Lines] = field(default_factory=dict)
    tables: dict[str, tuple[WrittenTable, ...]] = field(default_factory=dict)

    def area(self, span: Span) -> Area:
        """Return the area of a span; the beginning of a file that was not read."""
        return self.of(span.file).area(span.file, span.start, span.end)

    def of(self, file: str) -> Lines:
        """Return a text by lines."""
        if file not in self.lines:
            self.lines[file] = Lines(self.sources[file].text if file in self.sources else "")
        return self.lines[file]

    def table(self, span: Span) -> str:
        """Return the table in whose text a span begins; empty for none."""
        if span.file not in self.tables:
            self.tables[span.file] = tuple(tables_of(self.of(span.file).text))
        return next(
            (each.name for each in self.tables[span.file] if each.start <= span.start <= each.end), ""
        )


def _answer(path: str, checked: Checked, *, final: bool = True) -> Answer:
    """Build the answer; one that is not final leaves out the findings about open questions."""
    reading = checked.reading
    files = _Files(reading.sources)
    told = [(each, False) for each in checked.diagnostics] + [(each, True) for each in checked.meanwhile]
    if not final:
        told = [(each, meanwhile) for each, meanwhile in told if each.code not in _LEFT_OPEN]
    told.sort(key=lambda each: sort_key(each[0]))
    findings = tuple(_finding(files, each, meanwhile) for each, meanwhile in told)
    errors = [each for each in findings if each.severity == Severity.ERROR]
    broken = "" if reading.program is not None or not errors else _first(errors[0])

    def standing_of(table: WrittenTable) -> Standing:
        inside = [each.message for each in errors if (each.area.file, each.table) == (path, table.name)]
        report = checked.reports.get((path, table.name))
        if not final and not inside:  # of no table it is known that nothing is left open of it
            return BEING_PROVED
        return standing(report, inside, broken)

    tables = tuple(grids(path, files.of(path), reading.nearest, standing_of))
    texts = {file: source.text for file, source in reading.sources.items()}
    return Answer(path, findings, tables, reading.program is not None, final, texts)


def _first(error: Finding) -> str:
    """Return the reason why a program is not proved: its first error."""
    place = f"{os.path.basename(error.area.file)}:{error.area.start}"
    return f"the program is not in order: {error.message} ({place})"


def _finding(files: _Files, told: Diagnostic, meanwhile: bool) -> Finding:
    spelt = any("did you mean" in each for each in told.help)
    return Finding(
        told.code.value,
        told.severity.value,
        told.message,
        files.area(told.primary.span),
        tuple((files.area(label.span), label.message) for label in told.related),
        told.notes,
        told.help,
        tuple(_witness(files, each) for each in told.witnesses),
        files.table(told.primary.span),
        told.more,
        meanwhile,
        bool(told.proposals) or spelt,
        told,
    )


def _witness(files: _Files, column: WitnessColumn) -> Witness:
    lines = tuple(
        WitnessLine(line.name, line.cells, None if line.span is None else files.area(line.span))
        for line in column.lines
    )
    values = tuple(zip(column.variables, column.values, strict=True))
    return Witness(column.table, values, lines, column.region, column.inputs)

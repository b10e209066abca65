"""Whether what would mend a finding does so: the one place in which a proposal comes to be called proved.

In: findings with proposals, and the texts that they are about. Out: the same findings. Each proposal was made in a text, and that text was
taken through the whole pipeline: parsed, resolved, proved. Where the finding is gone then, and no other has come, it is *proved*; where
another has come, or the text says no table any more, it is not offered; where nobody could tell, within the budget or at all,
it is offered, and said to be not proved. So what a help says holds of the text that it makes: a cell of a line
that stands above another changes what that one matches, too.

Cost: a proof of one table a proposal; of at most `MOST_TRIED` of them, and of as many cells as `MOST_CELLS`.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from functools import partial
from typing import Protocol

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Proposal, Severity, WitnessColumn
from rcsc.base.diagnostics.source import Source
from rcsc.lang.interpret import UNDEFINED, initial, matching_lines
from rcsc.lang.model import Program, Table, unspelled
from rcsc.lang.project import Loaded
from rcsc.lang.resolve import resolve
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.parse import parse
from rcsc.lang.written.changes import with_proposal
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import WRONG_STEPS, Options
from rcsc.proof.table.certificate import must_cover
from rcsc.proof.table.program import Nothing, ProgramVerdict, prove_program
from rcsc.proof.table.regions import partition
from rcsc.proof.table.verdict import DeadLine, Gap, Overlap, TableVerdict

MOST_TRIED = 60
"""Proposals of one program that are tried."""
MOST_CELLS = 60_000
"""Cells of the tables that are proved anew for them, all together."""
STEPS_OF_A_CELL = 60
"""What a cell of a table costs that is read and decided anew, in steps of Z3."""


class Outcome(Enum):
    """The outcome of trying a proposal."""

    HOLDS = auto()
    CLOSES = auto()  # all of a gap, of which it was to close a part
    FAILS = auto()
    OPEN = auto()


class Remembers(Protocol):
    """Outcomes of earlier trials in this process, for a caller that checks one text after another."""

    def outcome(
        self, program: Program, table: Table, proposal: Proposal, make: Callable[[], Outcome]
    ) -> Outcome:
        """Return the kept outcome for an equal table in an equal rest of the program, else try the proposal."""


def mended(
    verdict: ProgramVerdict, root: str, loaded: Loaded, options: Options, known: Remembers | None = None
) -> tuple[Diagnostic, ...]:
    """Return a verdict's findings after trying each proposal.

    Args:
        verdict: Of the program that `root` resolves to.
        root: The file that was checked.
        loaded: All texts.
        options: Limits of a trial, and of all together.
        known: Outcomes of earlier trials.
    """
    if not any(finding.proposals for finding in verdict.findings):
        return verdict.findings
    if options.brief:
        smt.leave_open("whether a repair mends")
        return verdict.findings
    trials = _Trials(verdict, root, loaded, replace(options, brief=True, bare=True, jobs=1), known)
    with smt.together(min(2 * WRONG_STEPS, options.together), of_all=True):
        return tuple(_tried(finding, trials) for finding in verdict.findings)


def _tried(finding: Diagnostic, trials: "_Trials") -> Diagnostic:
    """Return the finding with only the proposals that did not fail; its helps and notes tell each outcome."""
    kept: list[Proposal] = []
    said: dict[str, str] = {}
    for proposal in finding.proposals:
        outcome = trials.outcome(finding, proposal)
        if outcome is Outcome.OPEN and proposal.sure:
            outcome = Outcome.FAILS
        whole = proposal.closing() if outcome is Outcome.CLOSES else proposal
        new = replace(whole, certain=outcome in (Outcome.HOLDS, Outcome.CLOSES))
        said[proposal.said] = "" if outcome is Outcome.FAILS else new.said
        kept += [] if outcome is Outcome.FAILS else [new]
    return replace(
        finding, proposals=tuple(kept), help=_said(finding.help, said), notes=_said(finding.notes, said)
    )


def _said(sentences: Iterable[str], said: Mapping[str, str]) -> tuple[str, ...]:
    return tuple(new for each in sentences if (new := said.get(each, each)))


def serious(findings: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return all but the notes."""
    return [each for each in findings if each.severity is not Severity.NOTE]


COUNTED = {Code.GAP, Code.DEFAULT_REACHED}
"""Findings whose message counts inputs: of a table there is one."""


def key(finding: Diagnostic) -> tuple[str, str]:
    """Return the key by which findings before and after are compared; counts do not enter it."""
    counts = finding.code in COUNTED or finding.only_listed
    table = next((witness.table for witness in finding.witnesses), "")
    return finding.code.value, table if counts else finding.message


def names_of(table: Table) -> tuple[str, ...]:
    """Return what a line is known by in two versions of a table; where its name may be made of what its row says, by its place."""
    printed = table.turned
    return (
        tuple(str(line.name) for line in table.lines) if printed is None else tuple(map(str, printed.places))
    )


@dataclass(frozen=True, slots=True)
class Wrong:
    """The errors of a table, by names, so that one version of it can be compared with another.

    Attributes:
        pairs: Lines that overlap.
        dead: Lines that never match.
        gap: Whether inputs match no line; `left`, how many, where that was counted.
        falls: Whether these fall to DEFAULT, which may be.
        whole: Whether it was decided, and all was found.
    """

    pairs: frozenset[frozenset[str]]
    dead: frozenset[str]
    gap: bool
    left: int | None
    falls: bool
    whole: bool

    @classmethod
    def of(cls, verdict: TableVerdict) -> "Wrong":
        """Collect a verdict's errors by name."""
        names, pairs, dead, gaps = names_of(verdict.table), set[frozenset[str]](), set[str](), list[Gap]()
        whole = True
        for each in verdict.findings:
            match each:
                case Overlap(first=first, second=second):
                    pairs.add(frozenset((names[first], names[second])))
                case DeadLine(line=line):
                    dead.add(names[line])
                case Gap():
                    gaps.append(each)
                case _:
                    whole = False
        left = sum(gap.count[0] for gap in gaps if gap.count) if all(gap.count for gap in gaps) else None
        whole = whole and len(pairs) < partition.MOST_PAIRS
        return cls(frozenset(pairs), frozenset(dead), bool(gaps), left, not must_cover(verdict.table), whole)

    def within(self, other: "Wrong") -> bool:
        """Return whether every error is also one of the other version, no more inputs are left, and a DEFAULT is still reached."""
        fewer = self.left is None or other.left is None or self.left <= other.left
        gap = self.gap <= other.gap and (not self.falls or self.gap == other.gap)
        return self.pairs <= other.pairs and self.dead <= other.dead and gap and fewer


def written(root: str, loaded: Loaded, file: str, proposal: Proposal) -> Program | None:
    """Return the program once a proposal is written into its text; None where the text then makes no program.

    Args:
        root: The file that is resolved.
        loaded: All texts.
        file: Where the table stands.
        proposal: The changes to write.
    """
    source = loaded.sources.get(file)
    text = None if source is None else with_proposal(source, proposal)
    return None if text is None else of_text(root, loaded, Source(file, text))


def of_text(root: str, loaded: Loaded, new: Source) -> Program | None:
    """Return the program once a new text replaces its file's; None where the text then makes no program."""
    parsed = parse(new)
    if not isinstance(parsed, tree.File):
        return None
    files = {**loaded.files, new.name: parsed}
    sources = {**loaded.sources, new.name: new}
    program = resolve(root, replace(loaded, files=files, sources=sources))
    return program if isinstance(program, Program) else None


@dataclass(slots=True)
class _Trials:
    """Trials of the proposals of one verdict, within one budget."""

    verdict: ProgramVerdict
    root: str
    loaded: Loaded
    options: Options
    known: Remembers | None
    tried: int = 0
    cells: int = 0
    told: set[tuple[str, str]] = field(init=False)
    before: dict[str, Wrong] = field(init=False)

    def __post_init__(self) -> None:
        """Record the errors before any trial."""
        self.told = {key(each) for each in serious(self.verdict.findings)}
        self.before = {str(each.table.name): Wrong.of(each) for each in self.verdict.tables}

    def outcome(self, finding: Diagnostic, proposal: Proposal) -> Outcome:
        """Try a proposal and return the outcome; nothing is tried past the budget."""
        table = next((each for each in self.verdict.program.tables if each.name == proposal.table), None)
        if table is None:
            return Outcome.OPEN
        self.tried += 1
        cells = len(table.lines) * (len(table.columns) + 1)
        self.cells += cells
        if self.tried > MOST_TRIED or self.cells > MOST_CELLS or smt.gives_up("whether a repair mends"):
            return Outcome.OPEN
        if smt.charge(STEPS_OF_A_CELL * cells):
            return Outcome.OPEN
        make = partial(self._trial, finding, proposal)
        if self.known is None:
            return make()
        return self.known.outcome(self.verdict.program, table, proposal, make)

    def _trial(self, finding: Diagnostic, proposal: Proposal) -> Outcome:
        program = written(self.root, self.loaded, finding.primary.span.file, proposal)
        names = () if program is None else [each for each in program.tables if each.name == proposal.table]
        if program is None or len(names) != 1:
            return Outcome.FAILS
        [table] = names
        try:
            after = prove_program(program, self.options, only=[table.name], known=Silent())
        except smt.troubles():
            return Outcome.OPEN
        return self._compared(finding, proposal, after)

    def _compared(self, finding: Diagnostic, proposal: Proposal, after: ProgramVerdict) -> Outcome:
        """Compare the verdicts before and after: the finding must be gone, and no new one have come."""
        [table] = [each for each in after.tables if each.table.name == proposal.table]
        was, now = self.before.get(proposal.table), Wrong.of(table)
        elsewhere = {key(each) for each in serious(after.findings)} - self.told
        if was is None or not was.whole or not now.whole or any(Code.UNDECIDED in each for each in elsewhere):
            return Outcome.OPEN
        if after.unmet - self.verdict.unmet:  # a declaration may have become one that never applies
            return Outcome.OPEN
        left = table.table.turned is not None and now.gap and None in (was.left, now.left)
        if (
            elsewhere or not now.within(was) or left
        ):  # other lines of the row or the column may have lost inputs
            return Outcome.FAILS
        match finding.code:
            case Code.OVERLAP if not proposal.whole:
                before = next(each for each in self.verdict.program.tables if each.name == proposal.table)
                known = dict(zip((str(line.name) for line in before.lines), names_of(before), strict=True))
                told = (frozenset(known[line.name] for line in each.lines) for each in finding.witnesses)
                gone = now.pairs.isdisjoint(told)
            case Code.OVERLAP:
                gone = not now.pairs
            case Code.DEAD_LINE:
                gone = len(now.dead) < len(was.dead)
            case Code.DEFAULT_DEAD:
                gone = table.table.default is not None and table.table.default.unreachable
            case Code.GAP if not proposal.whole and finding.witnesses:
                gone = _matches_one(after.program, table.table, finding.witnesses[0])
                if gone and not now.gap:
                    return Outcome.CLOSES
            case _:
                gone = not now.gap
        return Outcome.HOLDS if gone else Outcome.FAILS


class Silent(Nothing):
    """A store that knows nothing and makes no diagnostics; a table's errors are taken from its verdict."""

    def told(self, _verdict: TableVerdict, _unproved: frozenset[str], _make: object) -> list[Diagnostic]:
        """Return no diagnostics."""
        return []


def _matches_one(program: Program, table: Table, witness: WitnessColumn) -> bool:
    """Return whether exactly one line matches an input that none did."""
    kinds = program.kinds
    values = zip(witness.variables, witness.values, strict=True)
    try:
        now = initial(program) | {name: unspelled(kinds[name], text) for name, text in values}
        return len(matching_lines(table, now)) == 1
    except (KeyError, ValueError, *UNDEFINED):
        return False

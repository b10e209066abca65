"""What an editor is answered: plain frozen values, with places as lines and columns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.report import NOT_PROVED, TableReport, Verdict, named
from rcsc.desk.editor.places import Area, Edit
from rcsc.lang.model import Standing as Declared


class State(StrEnum):
    """The state of a table's proof, in the words that every view shows."""

    PROVED = "proved"
    TRUSTING = "proved, trusting"
    CONDITIONAL = "conditional"
    STALE = "stale"
    UNDECIDED = "undecided"
    REFUTED = "refuted"
    ERRORS = "has errors"


@dataclass(frozen=True, slots=True)
class Standing:
    """The state of a table, and why; the one value that gutter, lens, status line and studio show.

    Attributes:
        why: Of `proved` how, of the others the reason; one sentence without a full stop.
    """

    state: State
    why: str

    def __str__(self) -> str:
        """Return state and reason."""
        return f"{self.state.value}: {self.why}" if self.why else self.state.value


@dataclass(frozen=True, slots=True)
class WitnessLine:
    """A line that matches a witness: its name, where it stands, and its cell for each variable of the witness."""

    name: str
    cells: tuple[str, ...]
    area: Area | None


@dataclass(frozen=True, slots=True)
class Witness:
    """An input that shows a finding.

    Attributes:
        values: Name and text of each variable, in declared order.
        region: The conditions for which all inputs do the same; empty where nobody grew one.
        inputs: How many inputs that are; None where nobody counted.
    """

    table: str
    values: tuple[tuple[str, str], ...]
    lines: tuple[WitnessLine, ...]
    region: tuple[str, ...]
    inputs: int | None


@dataclass(frozen=True, slots=True)
class Finding:
    """One finding.

    Attributes:
        code: `RCS401`.
        severity: `error`, `warning` or `note`.
        related: Other places, and what is said of each.
        table: The table in which it is; empty for none.
        more: Inputs that have no witness here.
        meanwhile: Whether it was found with what is broken in the text left out; `rcsc check` does not say it, as yet.
        mendable: Whether `Workspace.repairs` may have something for it.
        told: The finding as `rcsc check` has it.
    """

    code: str
    severity: str
    message: str
    area: Area
    related: tuple[tuple[Area, str], ...]
    notes: tuple[str, ...]
    help: tuple[str, ...]
    witnesses: tuple[Witness, ...]
    table: str
    more: int
    meanwhile: bool
    mendable: bool
    told: Diagnostic = field(repr=False)


@dataclass(frozen=True, slots=True)
class Repair:
    """A change of texts that mends a finding; it was made and checked before it is offered.

    Attributes:
        title: What it does, in the imperative.
        proved: What is proved of the text with it, in words; empty where it is only checked.
        edits: To be made together.
        clears: Whether nothing is then wrong with the table.
        certain: Whether it was proved, not only checked that the finding goes: a likely spelling is not.
    """

    title: str
    proved: str
    edits: tuple[Edit, ...]
    clears: bool
    certain: bool


@dataclass(frozen=True, slots=True)
class GridColumn:
    """A column of a table.

    Attributes:
        heading: As written, pieces joined.
        kind: `condition`, `output`, `procedures` or `requirements`.
        type: In words, as it would be declared; empty where it is not known.
        unit: `mm/s`; empty for none.
        areas: Where it stands, a piece a row.
    """

    heading: str
    kind: str
    type: str
    unit: str
    areas: tuple[Area, ...]


@dataclass(frozen=True, slots=True)
class GridCell:
    """A cell: its text, pieces joined, and where each piece stands; an empty one has an empty area where it would be written."""

    text: str
    areas: tuple[Area, ...]


@dataclass(frozen=True, slots=True)
class GridRow:
    """A line.

    Attributes:
        name: Of the line.
        cells: One a column.
        default: Whether it is the DEFAULT line; it then has no conditions.
        share: How many of the inputs in the declared ranges it matches, and of how many; None where nobody counted.
        area: Its rows of the first part of the table.
        lines: The names of the lines that stand in it: in a turned table one a cell.
    """

    name: str
    cells: tuple[GridCell, ...]
    default: bool
    share: tuple[int, int] | None
    area: Area
    stub: GridCell
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Grid:
    """A table as data.

    Attributes:
        name: What it is called; `area` is where that stands.
        first: The heading of the first column: `line`, or of a turned table what its rows are by.
    """

    name: str
    area: Area
    columns: tuple[GridColumn, ...]
    rows: tuple[GridRow, ...]
    standing: Standing
    first: str = "line"


# --- the state of a table ---

BEING_PROVED = Standing(State.STALE, "it is being proved as it is now")
GIVEN_UP = Standing(State.UNDECIDED, "a bug in rcsc: nothing is proved of it as it is now")
NEVER_LOOKED_AT = Standing(State.STALE, "the program that it belongs to is not in order")


def standing(report: TableReport | None, errors: Sequence[str], broken: str = "") -> Standing:
    """Return the state of a table: the one place that decides it, so that no two views disagree.

    - *proved*: exactly one line matches every input in the declared ranges, whatever else happens.
    - *proved, trusting*: the same, as long as what the tables declare as assumed of their inputs is so.
    - *conditional*: the same, as long as something holds that is itself not proved.
    - *refuted*: for some input no line matches, or several do.
    - *undecided*: the solvers gave up.
    - *has errors*: another error stands in the table.
    - *stale*: nobody has looked at it as it is now: the program that it belongs to is not in order, or is still being proved.

    Args:
        report: What a check of the text as it is now says of the table; None where it does not come to that.
        errors: Messages of the errors that stand in the table.
        broken: The first error elsewhere, which keeps the table from being looked at.
    """
    refuted = report is not None and report.verdict is Verdict.REFUTED
    if errors:
        more = f", and {len(errors) - 1} more" if len(errors) > 1 else ""
        return Standing(State.REFUTED if refuted else State.ERRORS, f"{errors[0]}{more}")
    if report is None:
        return Standing(State.STALE, broken) if broken else NEVER_LOOKED_AT
    if report.verdict is Verdict.UNDECIDED:
        return Standing(State.UNDECIDED, "it could not be decided")
    if refuted:
        return Standing(State.REFUTED, "not exactly one line matches every input")
    claimed = [f"`{name}` is {was}" for name, was in report.assumptions if was != Declared.PROVED.value]
    if report.verdict is Verdict.CONDITIONAL and not any(was == NOT_PROVED for _, was in report.assumptions):
        claimed.append("what is wrong elsewhere does not happen")
    if claimed:
        conditional = report.verdict is Verdict.CONDITIONAL
        return Standing(State.CONDITIONAL if conditional else State.TRUSTING, named(claimed))
    also = ", confirmed by Z3" if report.confirmed_by_z3 else ""
    return Standing(State.PROVED, f"exactly one line matches every input{also}")


@dataclass(frozen=True, slots=True)
class Answer:
    """The state of a file and of all that it uses, as the texts are.

    Attributes:
        file: The absolute path.
        findings: In order of file and place; those of used files, too.
        tables: Those that the file itself declares, in order.
        whole: Whether the text is in order, so that `rcsc check` comes to verdicts.
        final: Whether nothing is left open that takes longer; what is, is not told as yet, and its table is stale.
        texts: The texts that it points into, by path: what stands at a place now may be another's.
    """

    file: str
    findings: tuple[Finding, ...]
    tables: tuple[Grid, ...]
    whole: bool
    final: bool = True
    texts: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)

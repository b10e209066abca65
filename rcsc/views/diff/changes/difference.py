"""What changed, as data: frozen values that every output form shows.

Texts in them are in table words.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from rcsc.lang.model import Scalar
from rcsc.lang.model import Value as Scalars
from rcsc.proof.table.verdict import Region
from rcsc.views.diff.changes.align import Declaration


class PartSort(StrEnum):
    """What a change is of."""

    EFFECT = "effect"  # the procedures, command out or status differ
    FAULT = "fault"  # none or several lines match, in one of the versions or otherwise than before
    LINE = "line"  # another line, the same effect: no change of meaning
    CONDITION = "condition"  # a condition that is true in one version only


class Basis(StrEnum):
    """What it rests on that nothing else changed."""

    DIGEST = "digest"  # both versions say the same, word for word of the model
    SOLVER = "z3"  # unsatisfiable outside the regions


@dataclass(frozen=True, slots=True)
class Where:
    """A region of inputs.

    Attributes:
        boxes: As keys, disjoint; a variable left out is free.
        words: The same as conditions, one a variable that is not free; one tuple a box.
        exact: Whether the boxes are the whole region; else they are part of it, and `also` says all of it.
        also: What must hold besides, in words; empty where the boxes say it all.
        inputs: How many inputs the boxes hold, of how many; None where not countable.
    """

    boxes: tuple[Region, ...]
    words: tuple[tuple[str, ...], ...]
    exact: bool
    also: str
    inputs: tuple[int, int] | None


@dataclass(frozen=True, slots=True)
class Value:
    """A leaf that is left otherwise.

    Attributes:
        headings: Of the actions that write it.
        before, after: In general; empty where that takes too many words.
        at: Before and after at the least witness.
    """

    leaf: str
    headings: tuple[str, ...]
    before: str
    after: str
    at: tuple[str, str]


@dataclass(frozen=True, slots=True)
class Change:
    """One region, and what happens there before and after.

    Attributes:
        before, after: What matches there: `line 3`, `no line`; for a procedure its name.
        witness: The least input, by variable, in words.
        point: The same as values.
        least: Whether it is the least; with doubles it may be any input of the region.
        values: What is left otherwise there.
        relied_on: Whether the assumptions of one version at least hold somewhere in it; else nobody proved anything of it.
    """

    sort: PartSort
    before: str
    after: str
    where: Where
    witness: tuple[tuple[str, str], ...]
    point: tuple[tuple[str, Scalars], ...]
    least: bool = True
    values: tuple[Value, ...] = ()
    relied_on: bool = True


@dataclass(frozen=True, slots=True)
class ComparedPart:
    """One table, procedure, level or condition that both versions have, or one alone.

    Attributes:
        what: `table`, `procedure`, `preprocess`, `postprocess`, `assumption`, `invariant`, `property`, `level`.
        notes: What changed that is no region: a table that is new or gone, a period.
        changes: Of meaning.
        moved: The same effect by another line.
        basis: None where nothing is proved: it is new, gone, or cannot be compared.
        inputs: How many inputs there are; None where not countable.
    """

    what: str
    name: str
    notes: tuple[str, ...] = ()
    changes: tuple[Change, ...] = ()
    moved: tuple[Change, ...] = ()
    basis: Basis | None = None
    queries: int = 0
    inputs: int | None = None

    @property
    def changed(self) -> bool:
        """Whether the part's meaning changed."""
        return bool(self.notes or self.changes)


@dataclass(frozen=True, slots=True)
class Transition:
    """A step that one version can take and the other cannot, in the state graph of a level.

    Attributes:
        variable: The state.
        by: Lines, `table acquire, line 4`.
        trace: States from the first, each with the line that leads on; ends with this step. Empty where no trace is known.
        witness: The least input of the step, by variable.
    """

    variable: str
    before: str
    after: str
    by: tuple[str, ...]
    trace: tuple[tuple[str, str], ...]
    witness: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Traces:
    """A level's state graph, compared. Inputs are free under the tables' assumptions; what levels do together is not looked at."""

    level: str
    new: tuple[Transition, ...]
    gone: tuple[Transition, ...]


@dataclass(frozen=True, slots=True)
class Follows:
    """A table's lines in successive cycles, compared: pairs of which the second can match in the cycle after the first.

    Attributes:
        new: Pairs of the later version alone.
        gone: Pairs of the earlier version alone; a line that was only renamed has its new name.
        decided: Whether the solver answered; else nothing is known.
    """

    level: str
    table: str
    new: tuple[tuple[str, str], ...] = ()
    gone: tuple[tuple[str, str], ...] = ()
    decided: bool = True


@dataclass(frozen=True, slots=True)
class ProgramDifference:
    """Two versions of one program.

    Attributes:
        name: As it was given: a path below the two sides.
        declarations: Variables and enumerations that changed.
        parts: Tables first, then procedures, levels, conditions.
        undecided: What the solver gave up on: nothing is proved of the program then.
        follows: Of tables whose lines can follow otherwise than before; only where it was asked for.
        kinds: What regions count values by, for each leaf.
        requirements: Which places name other requirements than before; no meaning changes with that.
    """

    name: str
    declarations: tuple[Declaration, ...] = ()
    parts: tuple[ComparedPart, ...] = ()
    traces: tuple[Traces, ...] = ()
    undecided: tuple[str, ...] = ()
    follows: tuple[Follows, ...] = ()
    kinds: Mapping[str, Scalar] = field(default_factory=dict, compare=False, repr=False)
    requirements: tuple[str, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether anything means something else."""
        return bool(self.declarations) or any(part.changed for part in self.parts)


@dataclass(frozen=True, slots=True)
class Difference:
    """Two versions of a set of tables.

    Attributes:
        before, after: What was compared, as given.
        notes: Programs that are new or gone.
    """

    before: str
    after: str
    programs: tuple[ProgramDifference, ...]
    notes: tuple[str, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether anything means something else."""
        return bool(self.notes) or any(program.changed for program in self.programs)

    @property
    def undecided(self) -> bool:
        """Whether something was left open."""
        return any(program.undecided for program in self.programs)

    def parts(self) -> Iterator[tuple[ProgramDifference, ComparedPart]]:
        """Yield every part with its program."""
        for program in self.programs:
            for part in program.parts:
                yield program, part

"""What a kind of evidence takes and gives."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from rcsc.base.host.tools import version_of
from rcsc.code.emit import emitted
from rcsc.code.emit.plan import Plan
from rcsc.driver.settings import silent
from rcsc.lang.model import Program, ProvedProgram
from rcsc.proof.solvers.options import Options
from rcsc.views.pages.dossier_page import AcceptedPoint


@dataclass(frozen=True, slots=True)
class Subject:
    """A proved program, and its emitted files.

    Attributes:
        files: The generated files that are looked at, text by path below the generated folder.
        options: The options of proofs, where a kind makes some.
        progress: Called with each step.
        missed: What was not covered, where that was measured before.
    """

    proved: ProvedProgram
    plan: Plan
    files: Mapping[str, str]
    options: Options
    progress: Callable[[str], None] = silent
    missed: "tuple[Missed, ...] | None" = None

    @property
    def program(self) -> Program:
        """The program that was proved."""
        return self.proved.program

    def defensive(self) -> "Subject":
        """Return the same program with the C that trusts no state, as its tables give it: `rcsc compile --defensive`."""
        plan = replace(self.plan, defensive=True)
        return replace(self, plan=plan, files=emitted(plan, ("c",)))


@dataclass(frozen=True, slots=True)
class Shortfall:
    """Something that the evidence does not show.

    Attributes:
        where: File and line, of the C or of a table, as a person would look it up.
        what: The missing part, and the reason.
    """

    where: str
    what: str


@dataclass(frozen=True, slots=True)
class Missed:
    """A condition or statement that was not covered.

    Attributes:
        what: The condition, and the outcome that was not seen.
        reason: The reason why it cannot be covered; empty where none is known.
    """

    function: str
    line: int
    what: str
    reason: str


@dataclass(frozen=True, slots=True)
class Evidence:
    """The result of one kind for one program.

    Attributes:
        figures: Lines for the terminal and the index.
        files: The files to keep, by path below the folder of the program and kind.
        shortfalls: The parts that are not shown; none for evidence that is whole.
        missing: The tool that is not installed, and what would install it; then nothing is shown.
        missed: What was not covered, where that was measured; None where it was not.
        accepted: The findings that are meant, each with its reason.
    """

    figures: tuple[str, ...]
    files: Mapping[str, str] = field(default_factory=dict)
    shortfalls: tuple[Shortfall, ...] = ()
    missing: str = ""
    missed: tuple[Missed, ...] | None = None
    accepted: tuple[AcceptedPoint, ...] = ()


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of evidence.

    Attributes:
        summary: Its subject in a few words, for the help and the index.
        collect: Makes it for one program.
        versions: Asks its tools, by name, for their versions; `ABSENT` of one that is not installed.
    """

    summary: str
    collect: Callable[[Subject], Evidence]
    versions: Callable[[], Mapping[str, str]] = dict


def excused(source: str, missed: Iterable[Missed]) -> Iterator[AcceptedPoint]:
    """Yield what was not covered of a file of C, and cannot be."""
    for each in missed:
        if each.reason:
            yield AcceptedPoint(f"not covered: {each.what}", f"{source}:{each.line}", each.reason)


ABSENT = "not installed"


def versions_of(*commands: Sequence[str]) -> dict[str, str]:
    """Return what tools tell of their versions, by name."""
    return {Path(command[0]).name: version_of(*command) or ABSENT for command in commands}

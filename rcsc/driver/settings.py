"""What the commands are given, and what they hand back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.report import Report, TableReport

if TYPE_CHECKING:
    from rcsc.lang.model import Program, ProvedProgram
    from rcsc.lang.project import Instance
    from rcsc.proof.solvers.options import Options


def silent(_doing: str) -> None:
    """Show no progress."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The files to work on, and how.

    Attributes:
        paths: Files, folders, or `-`.
        stdin: The text that `-` stands for.
        instances: Which of the paths are no files, but instances of one.
        use_cache: Whether earlier proofs may be used and new ones kept.
        progress: Called with what is being done; with an empty text when it is over.
    """

    paths: tuple[str, ...]
    options: "Options"
    stdin: bytes | None = None
    use_cache: bool = True
    progress: Callable[[str], None] = silent
    instances: "Mapping[str, Instance]" = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class CodeWanted:
    """The generated code to look at: what lies in a folder, or what the tables give now.

    Attributes:
        folder: The generated folder; None for the one beside the project, if its files are there.
        anew: Whether to look at no folder.
    """

    folder: Path | None = None
    anew: bool = False


@dataclass(frozen=True, slots=True)
class Conclusion:
    """A report, and a closing line for people."""

    report: Report
    closing: str = ""


@dataclass(frozen=True, slots=True)
class Proof:
    """The result for one root file.

    Attributes:
        program: None where it does not resolve.
        proved: None where something is not proved, or was proved by an earlier run only.
        certificate: Makes the certificate, which few ask for; gives None where something is not proved.
    """

    root: str
    diagnostics: tuple[Diagnostic, ...]
    program: "Program | None" = None
    tables: tuple[TableReport, ...] = ()
    proved: "ProvedProgram | None" = None
    certificate: Callable[[], Mapping[str, object] | None] = lambda: None


@dataclass(frozen=True, slots=True)
class TestEffort:
    """The effort of `rcsc test`.

    Attributes:
        examples: Inputs for each matcher, and sequences for each step and cycle.
        cycles: Longest sequence.
        deep: Whether the C is mutated and the emulated target is asked about as many inputs as it can.
        esbmc_s: Time limit of the model checker for one function, in seconds; 0 leaves it out.
        cortex: Whether an emulated Cortex-M3 is asked.
        mutants: How many mutants of each table (and of the C, where `deep`); 0 for none, -1 for all.
        vectors: Where to write vectors that cover the whole C.
        sessions: Where to write the sessions that were drawn for them.
        plant: The plant in which systems alone are run, in as many episodes as there are examples; None for everything, and for the
            plant that a campaign takes.
    """

    examples: int = 200
    cycles: int = 8
    deep: bool = False
    esbmc_s: float = 0.0
    cortex: bool = True
    mutants: int = 24
    vectors: Path | None = None
    sessions: Path | None = None
    plant: str | None = None

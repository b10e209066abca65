r"""The commands as functions: what `import rcsc` gives.

>>> import rcsc
>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> with TemporaryDirectory() as folder:
...     _ = Path(folder, "a.rcs").write_text("input a : bool\ntable t {\n| line | a ||\n|------|---||\n| 1 | true ||\n}\n")
...     report = rcsc.check(folder, cache=False)
>>> [(found.code.value, found.witnesses[0].values) for found in report.diagnostics]
[('RCS401', ('false',))]

Results are frozen values. What is wrong with tables is in a report; what keeps a function from doing its work (a
description that cannot be, a plant that does not fit) is raised as `rcsc.CodedError`, with its code and what helps.
Nothing is printed, and nothing ends the process.

Nothing here is trusted for a verdict: each function is one call of the driver, of `compose` or of `run`. Importing
`rcsc` imports nothing else; a name is imported when it is first asked for.

Modules, in the order the data flows: `proofs` (`check`, `compile`, `prove`), `running` (`load_system`, `run`).
"""

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.base.diagnostics.report import Report, Verdict
from rcsc.base.diagnostics.source import Position, Span
from rcsc.front.api.proofs import (
    Claim,
    Consequence,
    Proof,
    Requirement,
    Unproved,
    check,
    compile,  # noqa: A004  # as the command is called
    prove,
)
from rcsc.front.api.running import LoadedSystem, RowOutcome, Run, load_system, run

__all__ = [
    "Claim",
    "CodedError",
    "Consequence",
    "Diagnostic",
    "LoadedSystem",
    "Position",
    "Proof",
    "Report",
    "Requirement",
    "RowOutcome",
    "Run",
    "Severity",
    "Span",
    "Unproved",
    "Verdict",
    "check",
    "compile",
    "load_system",
    "prove",
    "run",
]

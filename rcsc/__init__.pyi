# What `import rcsc` gives, for type checkers; at run time each name is imported when it is first asked for.

from rcsc.api import Claim as Claim
from rcsc.api import CodedError as CodedError
from rcsc.api import Consequence as Consequence
from rcsc.api import Diagnostic as Diagnostic
from rcsc.api import LoadedSystem as LoadedSystem
from rcsc.api import Position as Position
from rcsc.api import Proof as Proof
from rcsc.api import Report as Report
from rcsc.api import RowOutcome as RowOutcome
from rcsc.api import Run as Run
from rcsc.api import Severity as Severity
from rcsc.api import Span as Span
from rcsc.api import Unproved as Unproved
from rcsc.api import Verdict as Verdict
from rcsc.api import check as check
from rcsc.api import compile as compile  # noqa: A004  # as the command is called
from rcsc.api import load_system as load_system
from rcsc.api import prove as prove
from rcsc.api import run as run

__version__: str
__all__ = [
    "Claim",
    "CodedError",
    "Consequence",
    "Diagnostic",
    "LoadedSystem",
    "Position",
    "Proof",
    "Report",
    "RowOutcome",
    "Run",
    "Severity",
    "Span",
    "Unproved",
    "Verdict",
    "__version__",
    "check",
    "compile",
    "load_system",
    "prove",
    "run",
]

# What `import rcsc` gives, for type checkers; at run time each name is imported when it is first asked for.

from rcsc.front.api import Claim as Claim
from rcsc.front.api import CodedError as CodedError
from rcsc.front.api import Consequence as Consequence
from rcsc.front.api import Diagnostic as Diagnostic
from rcsc.front.api import LoadedSystem as LoadedSystem
from rcsc.front.api import Position as Position
from rcsc.front.api import Proof as Proof
from rcsc.front.api import Report as Report
from rcsc.front.api import Requirement as Requirement
from rcsc.front.api import RowOutcome as RowOutcome
from rcsc.front.api import Run as Run
from rcsc.front.api import Severity as Severity
from rcsc.front.api import Span as Span
from rcsc.front.api import Unproved as Unproved
from rcsc.front.api import Verdict as Verdict
from rcsc.front.api import check as check
from rcsc.front.api import compile as compile  # noqa: A004  # as the command is called
from rcsc.front.api import load_system as load_system
from rcsc.front.api import prove as prove
from rcsc.front.api import run as run

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
    "Requirement",
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

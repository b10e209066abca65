"""The names that extern procedures give of the user's functions: nothing else comes into generated code."""

import keyword
import re

from rcsc.diagnostics.codes import Code
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.model import Extern
from rcsc.lang.reserved import C_COMPOSED, C_KEYWORDS, C_MACROS
from rcsc.lang.syntax import tree

_PYTHON = re.compile(r"[a-z_]\w*(\.[a-z_]\w*)*:[a-z_]\w*", re.ASCII | re.IGNORECASE)
_C = re.compile(r"[a-z]\w{0,62}", re.ASCII | re.IGNORECASE)
_C_WORDS = C_KEYWORDS | C_MACROS | C_COMPOSED


def extern(scope: Scope, written: tree.ProcedureDecl) -> Extern:
    """The names, after a report of each that does not fit.

    Source: ISO C99, 6.4.1 (keywords) and 5.2.4.1 (63 significant characters of an internal name).
    """
    python, c = written.python, written.c
    if not _PYTHON.fullmatch(python) or any(map(keyword.iskeyword, re.split("[.:]", python))):
        message = f"`{python}` does not name a Python function"
        scope.report(Code.EXTERN_NAME, message, written.name.span, "write `package.module:function`")
    if not _C.fullmatch(c) or c in _C_WORDS:
        message = f"`{c}` does not name a C function"
        scope.report(
            Code.EXTERN_NAME,
            message,
            written.name.span,
            "write a C identifier of at most 63 characters that no library keeps",
        )
    return Extern(python, c)

"""The emitted C matcher is the table, for all inputs: a complete check a variable at a time, for any size.

In: a program, its emitted C, one of its tables. Out: how many cells were compared, or what differs.

Why this is complete. The matcher's shape is read from its text (`matcher_text` refuses any other): the mask
of an input is the AND of one entry of each table, the entry found by classes that each read one leaf, or by
the truth of a condition; the line follows from the mask alone. So it is enough that
1. the class of a leaf is right for every value: the emitted expression compares the leaf with constants
   only, so it is constant between them, and it is evaluated in the compiled C at every value of a small leaf,
   else at the range's ends, at every constant in the text and at every bound of the table's own boxes, each
   with both neighbours;
2. every entry of every table is the AND of the cells of its classes, bit k for line k: all entries that some
   input finds are compared, as the compiled C has them;
3. the truth of a condition is the table's test: compared on edges here; that it is so for all inputs is
   ESBMC's part;
4. the tail gives k for the mask with only bit k, the DEFAULT line or -1 for none, -2 for several: run for
   every single bit, none, and every pair (up to 2,048 lines; of larger ones each line with some others).
"""

import ctypes
from collections.abc import Mapping
from pathlib import Path

from rcsc.base.host.children import scratch
from rcsc.base.host.tools import Absent, c_compiler, run_command, write_c
from rcsc.code.testing.executors.externs import STAND_INS
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.matchers.cells import Checked, Checker, Compared
from rcsc.code.testing.matchers.matcher_c import self_test_c
from rcsc.code.testing.matchers.matcher_text import (
    ShapeError,
    matcher_text,
)
from rcsc.lang.model import (
    Program,
    Table,
)

__all__ = ["Checked", "Compared", "check_matcher"]

FLAGS = ("-std=gnu11", "-O1", "-w", "-ffp-contract=off", "-shared", "-fPIC")
MOST_SHOWN = 5


def check_matcher(
    program: Program, symbols: Symbols, files: Mapping[str, str], table: Table
) -> Checked | tuple[str, ...] | Absent:
    """Compares the emitted C matcher of `table` with the table.

    Args:
        program: The program.
        symbols: Names in its emitted C.
        files: The emitted files, text by path.
        table: One of its tables.
    """
    compiler = c_compiler()
    if isinstance(compiler, Absent):
        return compiler
    source = next(text for path, text in files.items() if Path(path).name == symbols.source)
    named = (source, symbols.lines[table.name], symbols.struct)
    try:
        parts = matcher_text(*named)
    except ShapeError as error:
        return (f"the emitted C has not the shape that the check is about: {error}",)
    with scratch("matcher") as place:
        beside = [name for name in write_c(files, place) if name == STAND_INS]
        (place / "check.c").write_text(self_test_c(program, symbols, table, parts), "utf-8")
        ran = run_command([compiler, *FLAGS, "-o", "check.so", "check.c", *beside], place, 300.0)
        if ran.status != 0:
            return ("the self-test does not compile", *ran.err.strip().splitlines()[:MOST_SHOWN])
        library = ctypes.CDLL(str(place / "check.so"))
        checker = Checker(program, symbols, table, parts, library)
        checked = checker.all()
    return tuple(checker.wrong[:MOST_SHOWN]) or checked

"""The emitted functions that the suite tests, in one order for all of it.

In: a program and its symbols. Out: targets.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.model import Program


@dataclass(frozen=True, slots=True)
class ComparedFunction:
    """An emitted function and the reference that it must equal.

    Attributes:
        kind: `line` (which line matches), `batch` (the same for many inputs), `step`, `cycle` or `init`.
        number: Position of its table or level in the program; 0 for `init`.
    """

    function: str
    kind: str
    number: int


def targets(program: Program, symbols: Symbols) -> Iterator[ComparedFunction]:
    """Every emitted function that has a reference, matchers first."""
    for number, table in enumerate(program.tables):
        yield ComparedFunction(symbols.lines[table.name], "line", number)
    for number, table in enumerate(program.tables):
        yield ComparedFunction(symbols.batches[table.name], "batch", number)
    for number, table in enumerate(program.tables):
        yield ComparedFunction(symbols.steps[table.name], "step", number)
    for number, level in enumerate(program.levels):
        yield ComparedFunction(symbols.cycles[level.name], "cycle", number)
    yield ComparedFunction(symbols.init, "init", 0)


def is_matcher(target: ComparedFunction) -> bool:
    """Whether the function only says which line matches."""
    return target.kind in ("line", "batch")


def call_of(symbols: Symbols, target: ComparedFunction, place: str) -> list[str]:
    """C statements that call the function on the struct at `place` and leave its result in `result`."""
    if target.kind == "batch":
        copies = f"const {symbols.struct} pair[2] = {{*({place}), *({place})}}; int32_t got[2] = {{-9, -8}};"
        same = "const int32_t result = (got[0] == got[1]) ? got[0] : -7;"
        return [copies, f"{target.function}(pair, got, 2u);", same]
    if target.kind == "init":
        return [f"{target.function}({place}); const int32_t result = 0;"]
    return [f"const int32_t result = {target.function}({place});"]


def reference_of(target: ComparedFunction) -> str:
    """Name of the reference's function."""
    names = {"step": f"ref_t{target.number}_step", "cycle": f"ref_l{target.number}_cycle", "init": "ref_init"}
    return names.get(target.kind, f"ref_t{target.number}_line")

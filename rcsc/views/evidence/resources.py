"""What each function needs: bytes of code and of stack, and instructions, on small processors.

In: a program and its C. Out: for each processor and function, what an image of that function alone takes; the stack that its
longest chain of calls takes; the most instructions that a call took, over drawn sessions on an emulated processor; and the
instructions of its longest path, where the assembly tells one (`assembly`).

The sessions begin in the initial state or in drawn states that `check` accepts, and go on with drawn inputs; besides, each table
meets combinations of the values of its own test variables. Values are ends of ranges, constants and their neighbours.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path

from rcsc.base.host.children import scratch
from rcsc.base.host.files import csv_text, read
from rcsc.base.host.tools import BuildFailed, ending, run_command
from rcsc.code.emit.plan import Plan
from rcsc.code.testing.boards import BOARDS, HARNESS, OPTIMIZED, Board, compiled, link, run_image
from rcsc.code.testing.cortex import leaf_values, loops
from rcsc.code.testing.executors.externs import STAND_INS, c_stand_ins, externs
from rcsc.code.testing.executors.symbols import Symbols, symbols_of
from rcsc.lang.model import Kind as VariableKind
from rcsc.lang.model import Program
from rcsc.views.evidence.assembly import Assembly, Bounds, UnboundedError, of_compiler, of_disassembly
from rcsc.views.evidence.kind import Evidence, Kind, Shortfall, Subject, versions_of

SESSIONS, CYCLES = 64, 12
"""Drawn sessions, and the cycles in each."""
COMBINATIONS = 1024
"""Combinations of a table's test variables that it meets at most."""
TOLD = re.compile(r"rcsc (\w+) (\d+) (\d+) (\d+)")
FRAME = re.compile(r"[^\t]*:([\w.$]+)\t(\d+)\t([\w,]+)")
LOOP = re.compile(r"/\* (?:at most )?(?:(\d+) times|once) \*/$")
OVERRUN = 0xFFFF_FFFF
TOOL_S = 60.0
TOOLS = "packages gcc-arm-none-eabi and qemu-system-arm, gcc-riscv64-unknown-elf and qemu-system-misc"


@dataclass(frozen=True, slots=True)
class Need:
    """The needs of one function on one board.

    Attributes:
        frame: Bytes of its own stack.
        chain: Bytes of stack of its deepest chain of calls, without what the compiler's library takes; None where a frame is not static.
        alone: Bytes of code and constants of an image with it alone; None for a function of the file's own.
        calls: The number of its calls in the sessions; 0 for a function of the file's own.
        observed: The most instructions that a call took.
        deepest: The most bytes of stack that a call took, with those of the compiler's library.
        bound: Instructions of its longest path; None where `unbounded` says why.
    """

    board: str
    function: str
    code: int
    frame: int
    chain: int | None
    alone: int | None
    calls: int
    observed: int | None
    deepest: int | None
    bound: int | None
    unbounded: str


def collect(subject: Subject) -> Evidence:
    """Measure every board whose tools are installed."""
    present = [board for board in BOARDS if not board.absent()]
    if not present:
        return Evidence((), missing=f"no cross compiler with its emulator is installed ({TOOLS})")
    needs: list[Need] = []
    short = [
        Shortfall(board.name, f"not measured: {board.absent()} not installed")
        for board in BOARDS
        if board not in present
    ]
    for board in present:
        subject.progress(f"{subject.program.name}: {board.name}")
        measured = measure(board, subject.plan, subject.files)
        if isinstance(measured, BuildFailed):
            short.append(Shortfall(board.name, measured.text))
        else:
            needs += measured
            short += _doubts(measured)
    files = {"resources.csv": _csv(needs), "resources.md": _page(subject.program.name, present, needs)}
    return Evidence(tuple(_figures(needs)), files, tuple(short))


KIND = Kind(
    "stack, code and instructions of each function, on emulated Cortex-M and RISC-V",
    collect,
    lambda: versions_of(*([tool, "--version"] for b in BOARDS for tool in (b.compiler[0], b.emulator[0]))),
)


def measure(board: Board, plan: Plan, files: Mapping[str, str]) -> list[Need] | BuildFailed:
    """Measure the needs of each function of a program on a board, those that others call first.

    Args:
        board: A board whose tools are installed.
        plan: The program's plan.
        files: Its emitted files, text by path.
    """
    program = plan.program
    symbols = symbols_of(program, files)
    sources = {path: text for path, text in files.items() if path.endswith((".c", ".h"))}
    if externs(program):
        sources[STAND_INS] = c_stand_ins(program, symbols)
    entries = _entries(plan, symbols)
    with scratch("resources") as place:
        said = run_image(board, place, sources, image_c(plan, symbols, entries))
        if isinstance(said, BuildFailed):
            return said
        told = {match[1]: tuple(map(int, match.groups()[1:])) for match in TOLD.finditer(said)}
        if not set(entries) <= told.keys():
            return BuildFailed(f"the image ended early: {said[-200:]!r}")
        image = _disassembled(board, place)
        if isinstance(image, BuildFailed):
            return image
        return list(_needs(board, place, symbols, entries, told, image))


def _disassembled(board: Board, place: Path) -> Assembly | BuildFailed:
    """Return the disassembled image; the tools' output where they do not even name `main`."""
    dumped = run_command([f"{board.tools}objdump", "-d", "--no-show-raw-insn", "image.elf"], place, TOOL_S)
    named = run_command([f"{board.tools}nm", "image.elf"], place, TOOL_S)
    for tool, ran, word in (("objdump", dumped, "<main>:"), ("nm", named, " main\n")):
        if ran.status != 0 or word not in ran.out:
            return BuildFailed(
                f"{board.tools}{tool} does not tell what the image holds: {ending(ran, TOOL_S)[:300]}"
            )
    return of_disassembly(dumped.out, named.out)


def _entries(plan: Plan, symbols: Symbols) -> dict[str, str]:
    """Return the functions that callers use and that take time of their own, each with the statement before its call.

    A table that some assumption stops is not matched by itself: `line` may be asked only where that holds.
    """
    lines = [symbols.lines[table.table.name] for table in plan.tables if not table.stops]
    steps = [*symbols.steps.values(), *symbols.cycles.values()]
    return {symbols.init: "", f"{symbols.program}_check": "", **dict.fromkeys((*lines, *steps), "")}


def image_c(plan: Plan, symbols: Symbols, entries: Mapping[str, str]) -> str:
    """Return C that runs the sessions and prints the needs of each entry."""
    program, struct = plan.program, symbols.struct
    script = ("extern uint32_t rcsc_script;",) if externs(program) else ()
    drawn = ("rcsc_script = any(64u);",) if externs(program) else ()
    parts = [HARNESS, f'#include "{symbols.header}"', *script, *leaf_values(program, symbols)]
    parts += [f"static seen_t none, seen[{len(entries)}];", f"static {struct} a, b, c;"]
    parts += _inputs(program, symbols)
    parts += [f"static void all(void) {{ {' '.join(drawn)}"]
    parts += [f"c = a; measure((call_t){name}, &c, &seen[{at}]);" for at, name in enumerate(entries)]
    parts += ["}", "int main(void) {", "measure(nothing, &a, &none);"]
    parts += [f"for (uint32_t n = 0u; n < {SESSIONS}u; n++) {{", f"{symbols.init}(&a); b = a; scatter(&b);"]
    parts += [f"if (((n % 2u) == 1u) && ({symbols.program}_check(&b) == -1)) {{ a = b; }}"]
    parts += [f"for (uint32_t k = 0u; k < {CYCLES}u; k++) {{ draw(&a); all();"]
    parts += [f"{name}(&a);" for name in (*symbols.cycles.values(), *symbols.steps.values())[:1]]
    parts += ["} }"]
    for table in program.tables:
        begun, given, ended = loops(program, symbols, table, COMBINATIONS)
        parts += ["{", *begun]
        parts.append(
            f"{symbols.init}(&a); b = a; scatter(&b); if ({symbols.program}_check(&b) == -1) {{ a = b; }}"
        )
        parts += ["b = a;", *(f"b.{each}" for each in given)]
        parts += [f"if ({symbols.program}_check(&b) == -1) {{ a = b; all(); }}", *ended, "}"]
    parts += [f'tell("{name}", &seen[{at}], &none);' for at, name in enumerate(entries)]
    return "\n".join((*parts, "return 0; }")) + "\n"


def _inputs(program: Program, symbols: Symbols) -> Iterator[str]:
    """Yield C that gives a state the inputs of a drawn one, most of the time only some of them."""
    yield f"static void draw({symbols.struct} *s) {{ static {symbols.struct} drawn; drawn = *s; scatter(&drawn);"
    for variable in program.variables:
        if variable.kind is VariableKind.INPUT:
            place = symbols.path(variable.name)
            yield f"if (any(2u) == 0u) {{ s->{place} = drawn.{place}; }}"
    yield "}"


# --- what the compiler says ---


def _needs(
    board: Board,
    place: Path,
    symbols: Symbols,
    entries: Mapping[str, str],
    told: Mapping[str, tuple[int, ...]],
    image: Assembly,
) -> Iterator[Need]:
    stem = Path(symbols.source).stem
    compiled(board, place, (*OPTIMIZED, "-I.", "-g", "-fstack-usage", "-S", f"{stem}.c", "-o", f"{stem}.s"))
    text = read.text(place / f"{stem}.c")
    program = of_compiler(read.text(place / f"{stem}.s"))
    bounds = Bounds(program, image, _loops(text))
    frames = _frames(read.text(place / f"{stem}.su"))
    codes = _codes(board, place, f"{stem}.o")
    for function in sorted(program.routines, key=lambda name: (name in entries, name)):
        frame = frames.get(_original(function), (0, True))
        chain = _chain(function, bounds, frames)
        bound, reason = _bound(bounds, function)
        seen: tuple[int | None, int, int | None, int | None] = None, 0, None, None
        if function in entries:
            calls, observed, deepest = told[function]
            most = None if observed == OVERRUN else observed
            seen = _alone(board, place, function), calls, most, deepest
        yield Need(board.name, function, codes.get(function, 0), frame[0], chain, *seen, bound, reason)


def _loops(text: str) -> dict[int, int]:
    """Return how often each loop of the C runs, by the line in which it begins."""
    lines = text.splitlines()
    bounds: dict[int, int] = {}
    for at, line in enumerate(lines, 1):
        if (found := LOOP.search(line)) is not None:
            loop = next((n for n in range(at, at + 8) if re.match(r" +(?:for|while) \(", lines[n - 1])), at)
            first = at if re.match(r" +(?:for|while) \(", line) else loop
            count = int(found[1] or 1)
            bounds |= dict.fromkeys(range(first, max(first, at) + 1), count)
    return bounds


def _original(function: str) -> str:
    """Return the name under which the compiler reports the frame of a function that it made of another."""
    return re.sub(r"\.\d+$", "", function)


def _frames(text: str) -> dict[str, tuple[int, bool]]:
    """Return the frame of each function in bytes, and whether its size is fixed."""
    found: dict[str, tuple[int, bool]] = {}
    for match in FRAME.finditer(text):
        name, size, how = _original(match[1]), int(match[2]), match[3]
        before, static = found.get(name, (0, True))
        found[name] = max(before, size), static and how == "static"
    return found


def _chain(
    function: str, bounds: Bounds, frames: Mapping[str, tuple[int, bool]], above: tuple[str, ...] = ()
) -> int | None:
    """Return the stack of the deepest chain of calls within the file; None where a frame is not static, or a chain has no end."""
    if function in above:
        return None
    own, static = frames.get(_original(function), (0, True))
    called = [name for name in bounds.calls(function) if name in bounds.program.routines]
    chains = [_chain(name, bounds, frames, (*above, function)) for name in called]
    whole = [chain for chain in chains if chain is not None]
    return own + max(whole, default=0) if static and len(whole) == len(chains) else None


def _bound(bounds: Bounds, function: str) -> tuple[int | None, str]:
    try:
        return bounds.of(function), ""
    except UnboundedError as reason:
        return None, str(reason)


def _codes(board: Board, place: Path, compiled_file: str) -> dict[str, int]:
    """Return the number of bytes of the code of each function."""
    said = run_command([f"{board.tools}nm", "-S", compiled_file], place, TOOL_S).out
    rows = (line.split() for line in said.splitlines())
    return {row[3]: int(row[1], 16) for row in rows if len(row) == 4 and row[2] in "tT"}


def _alone(board: Board, place: Path, function: str) -> int | None:
    """Return the bytes of code and constants of an image with one function and its needs, the compiler's library included."""
    objects = [path.name for path in sorted(place.glob("*.o")) if path.name not in {"image.o", "copies.o"}]
    alone = ("-Wl,--gc-sections", f"-Wl,-e,{function}", "-Wl,--unresolved-symbols=ignore-all")
    made = link(board, place, objects, "alone.elf", *alone)
    if isinstance(made, BuildFailed):
        return None
    said = run_command([f"{board.tools}size", "alone.elf"], place, TOOL_S).out.splitlines()
    return int(said[1].split()[0]) if len(said) == 2 else None


# --- what is told ---


def _doubts(needs: Sequence[Need]) -> Iterator[Shortfall]:
    """Yield a shortfall for each figure that contradicts another or is not whole."""
    for need in needs:
        where = f"{need.board}, {need.function}"
        if need.calls and need.observed is None:
            yield Shortfall(where, "a call took more instructions than the counter holds")
        if need.bound is not None and need.observed is not None and need.observed > need.bound:
            yield Shortfall(
                where, f"a call took {need.observed} instructions, and {need.bound} was told as the bound"
            )
        if need.code == 0 or (need.calls and need.alone is None):
            yield Shortfall(where, "nm or size does not tell its bytes")
        if need.chain is None:
            yield Shortfall(where, "its stack is not known when it is compiled, or it calls itself")


COLUMNS = (
    "board", "function", "code_bytes", "frame_bytes", "chain_bytes", "image_bytes", "calls", "observed_instructions",
    "observed_stack_bytes", "bound_instructions", "no_bound_because",
)  # fmt: skip


def _csv(needs: Sequence[Need]) -> str:
    rows = (["" if value is None else value for value in astuple(need)] for need in needs)
    return csv_text([COLUMNS, *rows])


def _page(name: str, boards: Sequence[Board], needs: Sequence[Need]) -> str:
    parts = [f"# What the functions of {name} need", "", *_INTRODUCTION]
    parts += [
        f"- {board.name}: {board.version}; `{' '.join((*board.compiler[1:], *OPTIMIZED))}`"
        for board in boards
    ]
    for board in boards:
        own = [need for need in needs if need.board == board.name]
        parts += ["", f"## {board.name}", ""]
        parts += _rows([need for need in own if need.calls], entries=True)
        parts += ["", "Functions of the file's own:", ""]
        parts += _rows([need for need in own if not need.calls], entries=False)
    return "\n".join(parts) + "\n"


_INTRODUCTION = (
    "Bytes of code are the function's own; of its image, all code and constants that are left where it alone is linked",
    "(`--gc-sections`), the compiler's library included. Stack is that of the deepest chain of calls within the file, as the",
    "compiler tells frames; observed, the most that a call took, the compiler's library included. Instructions are those of the",
    "dearest call in drawn sessions on an emulated processor: the largest seen, not the largest there is. The bound is the longest",
    "path through the assembly, each loop as often as its comment in the C says and once more: no call takes more, while the",
    "compiler turns no loop into one that runs oftener. No figure is a time: the emulator knows no pipeline and no wait states.",
    "",
)


def _rows(needs: Sequence[Need], *, entries: bool) -> Iterator[str]:
    """Yield a table of Markdown."""
    heads = ENTRY_COLUMNS if entries else OWN_COLUMNS
    yield f"| {' | '.join(heads)} |"
    yield f"|{'|'.join(['---', *['---:'] * (len(heads) - 1)])}|"
    for n in needs:
        bound = str(n.bound) if n.bound is not None else f"none: {n.unbounded}"
        seen: tuple[object, ...] = (n.code, n.alone, n.chain, n.deepest, n.calls, n.observed, bound)
        cells = seen if entries else (n.code, n.frame, n.chain, bound)
        yield f"| `{n.function}` | {' | '.join('-' if cell is None else str(cell) for cell in cells)} |"


ENTRY_COLUMNS = (
    "function", "code", "image", "stack", "stack observed", "calls", "instructions observed", "bound",
)  # fmt: skip
OWN_COLUMNS = ("function", "code", "frame", "stack", "bound")


def _figures(needs: Sequence[Need]) -> Iterator[str]:
    """Yield for each board the deepest stack and the dearest call."""
    for board in dict.fromkeys(need.board for need in needs):
        own = [need for need in needs if need.board == board and need.calls]
        deep = max(own, key=lambda need: need.deepest or 0)
        dear = max(own, key=lambda need: need.observed or 0)
        bounded = sum(need.bound is not None for need in own)
        yield (
            f"{board}: at most {deep.deepest} bytes of stack ({deep.function}) and {dear.observed} instructions "
            f"({dear.function}) observed; {bounded} of {len(own)} functions have a bound"
        )

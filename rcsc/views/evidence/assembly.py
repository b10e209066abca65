"""How long a path through a function can be, and how deep its stack: read from the assembly that the compiler wrote.

In: the text of a compiler for Arm's Thumb or 32-bit RISC-V, or a disassembly. Out: for each function the instructions of its
longest path, or why there is no bound. A path is one of the graph of branches; which of them data can take is not asked, so the
figure is a bound and not the longest run. A loop counts as often as the comment at the loop of the C says, and once more; a jump
by a table goes to each of its entries; a call costs the bound of what it calls. Where a function of the compiler's own library
has a loop, or another jump than these, there is none: so it is with arithmetic on reals where no processor does it.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

CONDITIONS = "eq ne cs hs cc lo mi pl vs vc hi ls ge lt gt le".split()
JUMPS = frozenset({"b", "j"})
BRANCHES = frozenset({"cbz", "cbnz", *(f"b{condition}" for condition in CONDITIONS)})
BRANCHES_RISCV = frozenset(
    "beq bne blt bge bltu bgeu bgt ble bgtu bleu beqz bnez blez bgez bltz bgtz".split()
)
CALLS = frozenset({"bl", "call", "jal"})
CASES = "__gnu_thumb1_case_"
"""Prefix of the library's functions that jump by the table after their call."""
FUNCTION = re.compile(r"\t\.type\t([\w.$]+), ?[%@]function")
LABEL = re.compile(r"([\w.$]+):")
DATA = re.compile(r"\t\.(?:byte|2byte|short|hword|word|4byte)\t(.*)")
PLACE = re.compile(r"\t\.loc (\d+) (\d+)")
ALIAS = re.compile(r"\t\.(?:thumb_)?set\s([\w.$]+),([\w.$]+)$", re.MULTILINE)
"""A function that was found to be another's equal."""
COPIES = frozenset({"memcpy", "memset"})
SIZE = re.compile(r"(?:r2, #|a2,)(\d+)$")
LOCAL = re.compile(r"\.L[\w$]*")
HEAD = re.compile(r"[0-9a-f]+ <([\w.$]+)>:")
LINE = re.compile(r" *([0-9a-f]+):\t(.*)")
TARGET = re.compile(r"\b([0-9a-f]+) <([\w.$]+)(\+0x[0-9a-f]+)?>")


class UnboundedError(Exception):
    """There is no bound; the text has the reason."""


@dataclass(frozen=True, slots=True)
class Instruction:
    """An instruction.

    Attributes:
        line: Of the C that it was made of; 0 where nothing says so.
    """

    name: str
    operands: str
    line: int = 0

    @property
    def target(self) -> str:
        """The label or place to which it goes: its last operand."""
        return self.operands.split(",")[-1].strip().removesuffix("@long jump").strip()

    @property
    def cost(self) -> int:
        """The number of instructions that the assembler makes of it at most."""
        if self.name in {"call", "tail", "la", "lla"}:
            return 2
        if self.name == "li":
            return 1 if -2048 <= int(self.target, 0) < 2048 else 2
        return 1


@dataclass(slots=True)
class Routine:
    """A function: its instructions, where its labels stand among them, and the labels that each table of jumps names."""

    code: list[Instruction] = field(default_factory=list)
    labels: dict[str, int] = field(default_factory=dict)


@dataclass(slots=True)
class Assembly:
    """The content of a text of assembly.

    Attributes:
        tables: For each label that data follow, the labels among them.
    """

    routines: dict[str, Routine] = field(default_factory=dict)
    tables: dict[str, list[str]] = field(default_factory=dict)


def of_compiler(text: str) -> Assembly:
    """Read the assembly that a compiler wrote."""
    made = Assembly()
    functions = set(FUNCTION.findall(text))
    routine, last, line = Routine(), "", 0
    for raw in text.splitlines():
        if (label := LABEL.match(raw)) is not None:
            last = label[1]
            if last in functions:
                routine = made.routines[last] = Routine()
            routine.labels[last] = len(routine.code)
        elif (place := PLACE.match(raw)) is not None:
            line = int(place[2])
        elif (data := DATA.match(raw)) is not None:
            made.tables.setdefault(last, []).extend(LOCAL.findall(data[1].removesuffix(f"-{last}"))[:1])
        elif raw.startswith("\t") and not raw.startswith(("\t.", "\t@", "\t#")):
            name, _, rest = raw.strip().partition("\t")
            routine.code.append(
                Instruction(name.split(".")[0] if name[0] != "f" else name, _bare(rest), line)
            )
    made.routines |= {alias: made.routines[of] for alias, of in ALIAS.findall(text) if of in made.routines}
    return made


def _bare(operands: str) -> str:
    """Return operands without a comment."""
    return re.split(r"\s*(?:@|\t#)", operands)[0].strip()


def of_disassembly(text: str, symbols: str) -> Assembly:
    """Read the output of `objdump -d --no-show-raw-insn`, and of `nm` for all names of a place."""
    made = Assembly()
    routine = Routine()
    for raw in text.splitlines():
        if (head := HEAD.match(raw)) is not None:
            routine = made.routines.setdefault(head[1], Routine())
            here = head[1]
        elif (found := LINE.match(raw)) is not None and not found[2].startswith("."):
            name, _, rest = found[2].partition("\t")
            routine.labels[f".L{int(found[1], 16):x}"] = len(routine.code)
            target = TARGET.search(rest)
            if target is not None:
                own = target[2] == here and target[3]
                rest = rest[: target.start()] + (f".L{target[1]}" if own else target[2] + (target[3] or ""))
            routine.code.append(Instruction(name.split(".")[0], re.split(r"\s*[@;#]\s", rest)[0].strip()))
    places = {
        int(row[0], 16): row[2] for row in map(str.split, symbols.splitlines()) if row[-1] in made.routines
    }
    for place, _, name in (row for row in map(str.split, symbols.splitlines()) if len(row) == 3):
        same = places.get(int(place, 16))
        if same is not None and name not in made.routines:
            made.routines[name] = made.routines[same]
    return made


@dataclass(slots=True)
class Bounds:
    """Longest paths of the functions of a program.

    Attributes:
        program: The compiler's assembly of it.
        library: The linked image, for what else it calls.
        loops: How often the loop that begins in each line of the C runs.
    """

    program: Assembly
    library: Assembly
    loops: Mapping[int, int]
    known: dict[str, int | str] = field(default_factory=dict)
    open: list[str] = field(default_factory=list)

    def of(self, function: str) -> int:
        """Return the number of instructions of the longest path, with that of the return.

        Raises:
            UnboundedError: None can be told, or what it calls has none.
        """
        if function in self.open:
            raise UnboundedError(f"`{function}` calls itself")
        if function not in self.known:
            self.open.append(function)
            try:
                self.known[function] = self._longest(function, self.loops)
            except UnboundedError as reason:
                self.known[function] = str(reason)
            finally:
                self.open.pop()
        found = self.known[function]
        if isinstance(found, str):
            raise UnboundedError(found)
        return found

    def calls(self, function: str) -> frozenset[str]:
        """Return the functions that it calls, or jumps to at its end."""
        _, routine = self._routine(function)
        ends = (step.target for step in routine.code if step.name in CALLS | JUMPS | {"tail"})
        return frozenset(end for end in ends if not end.startswith(".L"))

    def _routine(self, function: str) -> tuple[Assembly, Routine]:
        for assembly in (self.program, self.library):
            if function in assembly.routines:
                return assembly, assembly.routines[function]
        raise UnboundedError(f"calls `{function}`, which is not in the image by itself")

    def _called(self, routine: Routine, at: int, function: str) -> int:
        """Return the cost of a call; a function that copies runs as many rounds as it is given bytes."""
        if function not in COPIES:
            return self.of(function)
        for step in reversed(routine.code[:at]):
            size = SIZE.match(step.operands)
            if size is not None and step.name in {"li", "mov", "movs"}:
                return self._longest(function, {0: int(size[1])})
            if step.name in CALLS or step.operands.startswith(("r2", "a2")):
                break
        raise UnboundedError(f"calls `{function}`, and nothing says for how many bytes")

    def _longest(self, function: str, loops: Mapping[int, int]) -> int:
        assembly, routine = self._routine(function)
        graph: dict[int, tuple[int, ...]] = {}
        costs: dict[int, int] = {}
        reached = [0]
        while reached:
            at = reached.pop()
            if at >= len(routine.code):
                raise UnboundedError(f"`{function}` goes on in what follows it")
            if at not in graph:
                goes, called = _successors(assembly, routine, at)
                rounds = (self._called(routine, at, name) for name in called)
                graph[at], costs[at] = tuple(goes), routine.code[at].cost + sum(rounds)
                reached += goes
        lines = {at: step.line for at, step in enumerate(routine.code)}
        try:
            return _path(graph, costs, 0, lines, loops)
        except UnboundedError as reason:
            raise UnboundedError(f"`{function}` {reason}") from None


def _successors(assembly: Assembly, routine: Routine, at: int) -> tuple[list[int], list[str]]:
    """Return the places within its function where an instruction may go, and the functions that run before that."""
    step, labels = routine.code[at], routine.labels
    name, target, after = step.name, step.target, at + 1
    if name in CALLS:
        if target.startswith(CASES):
            return _table(assembly, routine, at, follows=True), [target]
        return [after], [target]
    if name in JUMPS or name == "tail":
        return ([labels[target]], []) if target in labels else ([], [target])
    if name in BRANCHES or (name in BRANCHES_RISCV and name not in BRANCHES):
        if target not in labels:
            return [after], [target]
        return [labels[target], after], []
    if (returns := _returns(step)) is not None:
        return ([after] if returns else []), []
    if name in {"tbb", "tbh"}:
        return _table(assembly, routine, at, follows=True), []
    if name == "jr" or (name == "mov" and step.operands.startswith("pc")):
        return _table(assembly, routine, at, follows=False), []
    if re.match(r"bl?x|jalr?|blx", name) or re.match(r"pc\b", step.operands):
        raise UnboundedError(f"goes where `{name} {step.operands}` says")
    return [after], []


def _returns(step: Instruction) -> bool | None:
    """Return whether a return has a condition; None for an instruction that is no return."""
    name, operands = step.name, step.operands
    for stem in ("bx", "pop", "ldmfd", "ldmia", "ldr"):
        condition = name.removeprefix(stem)
        if name.startswith(stem) and (not condition or condition in CONDITIONS):
            wanted = {"bx": r"lr$", "ldr": r"pc, \[sp\]"}.get(stem, r".*\bpc\}")
            return bool(condition) if re.match(wanted, operands) else None
    return False if name == "ret" or (name, operands) == ("jr", "ra") else None


def _table(assembly: Assembly, routine: Routine, at: int, *, follows: bool) -> list[int]:
    """Return the entries of a jump's table: it follows the instruction, or is the last whose address was taken before it."""
    if follows:
        named = [label for label, place in routine.labels.items() if place == at + 1]
    else:
        before = (LOCAL.findall(step.operands) for step in reversed(routine.code[:at]))
        named = [label for labels in before for label in labels if assembly.tables.get(label)]
    for label in named:
        ends = [routine.labels[end] for end in assembly.tables.get(label, ()) if end in routine.labels]
        if ends:
            return sorted(set(ends))
    raise UnboundedError("jumps by a table that cannot be read")


def _path(
    graph: Mapping[int, Sequence[int]],
    costs: Mapping[int, int],
    entry: int,
    lines: Mapping[int, int],
    loops: Mapping[int, int],
) -> int:
    """Return the cost of the dearest path from the entry; a loop costs its dearest round as often as it can run and once more."""
    best = 0
    reached: dict[int, int] = {entry: 0}
    for part in _components(graph, entry):  # in the order in which they run
        cyclic = len(part) > 1 or any(node in graph[node] for node in part)
        headers = [node for node in part if node in reached]
        if not cyclic:
            through = reached[headers[0]] + costs[headers[0]]
        else:
            through = max(reached[node] for node in headers) + _loop(
                part, headers, graph, costs, lines, loops
            )
        best = max(best, through)
        for node in part:
            for after in graph[node]:
                if after not in part:
                    reached[after] = max(reached.get(after, 0), through)
    return best


def _loop(
    part: frozenset[int],
    headers: Sequence[int],
    graph: Mapping[int, Sequence[int]],
    costs: Mapping[int, int],
    lines: Mapping[int, int],
    loops: Mapping[int, int],
) -> int:
    if len(headers) != 1:
        raise UnboundedError("has a loop with several entries")
    bounds = [loops[lines[node]] for node in part if lines[node] in loops]
    if not bounds:
        raise UnboundedError("has a loop, and nothing says how often it runs")
    inner = {node: [to for to in graph[node] if to in part and to != headers[0]] for node in part}
    return (max(bounds) + 1) * _path(inner, costs, headers[0], lines, loops)


def _components(graph: Mapping[int, Sequence[int]], entry: int) -> list[frozenset[int]]:
    """Return the strongly connected parts that are reached, each after all that lead to it.

    Source: R. Tarjan, "Depth-first search and linear graph algorithms", 1972; without recursion.
    """
    order: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    on_stack: set[int] = set()
    parts: list[frozenset[int]] = []
    work: list[tuple[int, Iterator[int]]] = []

    def enter(node: int) -> None:
        order[node] = low[node] = len(order)
        stack.append(node)
        on_stack.add(node)
        work.append((node, iter(graph[node])))

    enter(entry)
    while work:
        node, rest = work[-1]
        for after in rest:
            if after not in order:
                enter(after)
                break
            if after in on_stack:
                low[node] = min(low[node], order[after])
        else:
            work.pop()
            if work:
                low[work[-1][0]] = min(low[work[-1][0]], low[node])
            if low[node] == order[node]:
                part = frozenset(stack[stack.index(node) :])
                del stack[stack.index(node) :]
                on_stack -= part
                parts.append(part)
    return parts[::-1]

"""A Promela model of one level in its environment, or of several levels on top of one another.

In: a system's transition systems, which levels, a `Breadth`. Out: a `Model`: its text, what it checks, and what each name stands for. Every
level steps at any moment; what it does in a cycle is one atomic step (with `Breadth.split` two: it reads, and later it acts). The buffers
between two levels of the model are the outputs themselves, read whole.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.promela.cycle.aims import Aim, Aims
from rcsc.compose.promela.cycle.environment import STALE
from rcsc.compose.promela.cycle.flows import Flows, Group
from rcsc.compose.promela.cycle.level_cycle import Machine, Maker
from rcsc.compose.promela.cycle.stated import LeftOut
from rcsc.compose.promela.cycle.statements import BOOL, NO, Block, read
from rcsc.compose.promela.instance import Breadth, Domain, Smaller
from rcsc.compose.promela.lazy_copy import LazyCopy, lazy_copies
from rcsc.compose.promela.liveness import mentioned, needed
from rcsc.compose.promela.spell import Nodes, Speller, drawn_flag, identifiers, rendered
from rcsc.lang.model import Expr, Kind, Read, Scalar, Value, earlier

TOLD = "cycle"
"""First word of the line that a trail prints for each cycle; then the level, table, line, and each told name's value."""
BROKEN = "broken"
"""First word of the line that it prints where a check fails; then its number."""
RESTARTED, TAKEN = "restart", "take"
"""First words where a level begins anew, and where it reads what the others say; then its name."""
NONE = -1
"""Told of a name that has no value."""


@dataclass(frozen=True, slots=True)
class Model:
    """A model, and how to read what it says.

    Attributes:
        levels: From the top down.
        text: Promela.
        aims: What it checks, by number.
        told: By level, the names whose values a trail tells.
        domains: What the values stand for.
        leading: Numbers that others are counted from, by the name of each number.
        copies: What is drawn in the place of what.
        left_out: What the programs state and the instance cannot speak of.
    """

    levels: tuple[str, ...]
    text: str
    aims: tuple[Aim, ...]
    told: Mapping[str, tuple[str, ...]]
    domains: Mapping[str, Domain]
    leading: Mapping[str, str]
    copies: tuple[LazyCopy, ...]
    progress: bool = False
    left_out: tuple[LeftOut, ...] = ()


def emit(
    system: Mapping[str, TransitionSystem],
    levels: tuple[str, ...],
    breadth: Breadth | None = None,
    skipped: frozenset[Aim] = frozenset(),
    *,
    progress: bool = False,
) -> Model:
    """The model of these levels, from the top down.

    Args:
        system: Every level's transition system.
        levels: Those in the model; the rest is outside and keeps to its contract.
        breadth: How much of the system the instance has.
        skipped: Checks that are left out.
        progress: Ask whether every command ends instead; of one level without subordinates.
    """
    aims = Aims(skipped)
    inside = {name: system[name] for name in levels}
    makers = [Maker(system[name], system, inside, aims) for name in levels]
    return _Writer(_machines(makers), breadth or Breadth(), aims, progress).model()


def _machines(makers: Iterable[Maker]) -> list[Machine]:
    """Drafted first: what the programs state is said of what the whole model does."""
    drafts = [(one, one.draft()) for one in makers]
    kinds: dict[str, Scalar] = {STALE: BOOL}
    for one, _ in drafts:
        kinds |= one.flat.kinds
    blocks = [block for _, draft in drafts for block in (draft.take, draft.cycle, draft.restart)]
    groups = Flows(kinds).groups([one for block in blocks for one in block])
    numbers = frozenset(name for one, _ in drafts for name in one.around.numbers)
    return [one.machine(draft, groups, numbers) for one, draft in drafts]


@dataclass(slots=True)
class _Writer:
    machines: list[Machine]
    breadth: Breadth
    aims: Aims
    progress: bool
    kinds: dict[str, Scalar] = field(init=False)
    starts: dict[str, Value] = field(init=False)
    lazy: frozenset[str] = field(init=False)
    groups: dict[str, Group] = field(init=False)
    domains: dict[str, Domain] = field(init=False)
    between: frozenset[str] = field(init=False)
    steps: list[Block] = field(init=False)
    names: dict[str, str] = field(init=False)
    copies: tuple[LazyCopy, ...] = ()
    scratch: int = 0

    def __post_init__(self) -> None:
        self.kinds = {STALE: BOOL}
        self.starts = {STALE: 0}
        for one in self.machines:
            self.kinds |= one.flat.kinds
            self.starts |= one.flat.starts
        self.lazy = frozenset().union(*(one.flat.lazy for one in self.machines))
        blocks = [block for one in self.machines for block in (one.take, one.cycle, one.restart)]
        self.groups = Flows(self.kinds).groups([one for block in blocks for one in block])
        numbers = frozenset(name for one in self.machines for name in one.numbers)
        full = frozenset().union(*(one.full for one in self.machines))
        smaller = Smaller(self.breadth, self.kinds, self.starts, full, numbers, self.lazy)
        self.domains = smaller.domains(self.groups)
        watched: list[Expr] = [read(STALE, BOOL)] if len(self.machines) > 1 else []
        watched += [one.ended for one in self.machines if self.progress and one.ended != NO]
        left, self.between = needed(blocks, watched)
        left, copies = lazy_copies(left, self.lazy, self.between)
        self._draw_later(copies)
        self.copies = copies
        left, self.between = needed(left, watched)
        self.steps = list(left)
        used = sorted({*self.between, *(name for block in left for name in mentioned(block))})
        self.names = identifiers(sorted(used, key=list(self.kinds).index))

    def _draw_later(self, copies: Iterable[LazyCopy]) -> None:
        """A copy is drawn as what it was copied from would have been."""
        for one in copies:
            self.lazy |= {one.name}
            if isinstance(one.value, Read):
                source = self.domains[one.value.name]
                self.domains[one.name] = replace(
                    self.domains[one.name], drawn=source.drawn, words=source.words
                )

    # --- the text ---

    def model(self) -> Model:
        bodies = [line for at in range(len(self.machines)) for line in self._process(at)]
        text = "\n".join([*self._header(), *self._declared(), "", *bodies, ""])
        told = {one.level: self._told(one) for one in self.machines}
        leading = {name: lead for lead, _ in self._rings() for name in self.groups[lead].names}
        return Model(
            tuple(one.level for one in self.machines), text, tuple(self.aims.met), told, self.domains, leading,
            self.copies, self.progress, tuple(out for one in self.machines for out in one.left_out),
        )  # fmt: skip

    def _header(self) -> Iterator[str]:
        levels = " over ".join(one.level for one in self.machines)
        yield f"/* Generated by rcsc from the tables of {levels}. Do not edit."
        yield " * A small instance: what is found is run; what is not found is no proof."
        yield f" * {self.breadth}"
        for name in self.names:
            domain = self.domains[name]
            if domain.words:
                yield f" * {name}: {domain.words}"
        for number, aim in enumerate(self.aims.met):
            yield f" * check {number}: {aim.shown}"
        for machine in self.machines:
            yield from (f" * not checked: {out.shown}" for out in machine.left_out)
        yield " */"

    def _declared(self) -> Iterator[str]:
        """Leaves begin with their values; whatever else is drawn has none before the first cycle, which is as free as any other."""
        leaves = {one.flat.name(v.name) for one in self.machines for v in one.flat.program.variables}
        for name, spelled in self.names.items():
            domain = self.domains[name]
            start = domain.encoded(self.starts[name]) if name in self.between else 0
            yield f"{_type(domain)} {spelled} = {start}; /* {name} */"
            if name in self.lazy:
                yield f"bit {drawn_flag(spelled)} = {int(name in self.between and name in leaves)};"
        yield from (f"bit scratch_{at};" for at in range(self.scratch))

    def _process(self, at: int) -> Iterator[str]:
        machine = self.machines[at]
        take, cycle, restart = self.steps[3 * at : 3 * at + 3]
        split = self.breadth.split and bool(take)
        if split:
            parts = [
                [f"      {_printed(TAKEN, machine)};", *self._step(machine, take)],
                self._step(machine, cycle),
            ]
        else:
            parts = [self._step(machine, (*take, *cycle))]
        first = self._step(machine, restart) if restart else []
        yield f"active proctype {_process_name(machine.level)}() {{"
        if first:
            yield from (
                "  if",
                "  :: skip",
                "  :: atomic {",
                f"      {_printed(RESTARTED, machine)};",
                *first,
                "     }",
                "  fi;",
            )
        yield from ("  end_0: do", "  ::")  # to wait there for ever, numbers gone round, is no deadlock
        for number, part in enumerate(parts):
            label = f"end_{number}: " if number else ""
            guard = f"!{self.names[STALE]}" if STALE in self.names else "true"
            yield from (f"    {label}atomic {{", f"      {guard};", *part, "    };")
        if self.progress:
            yield from self._labelled(machine)
        yield from ("  od", "}")

    def _labelled(self, machine: Machine) -> Iterator[str]:
        text = Speller(self.names, self.domains, frozenset(), lambda _: ()).text(machine.ended)
        yield from ("    if", f"    :: {text} -> progress: skip", "    :: else", "    fi;")

    def _step(self, machine: Machine, block: Block) -> list[str]:
        tell = self._tell(machine)
        speller = Speller(
            self.names, self.domains, self.lazy, lambda obligation: self._alarm(obligation, tell), tell
        )
        nodes: Nodes = speller.block(block)
        self.scratch = max(self.scratch, speller.deepest)
        nodes += tuple(self._cleared(block, speller.deepest))
        nodes += tuple(self._turned())
        return list(rendered(nodes, "      "))

    def _alarm(self, obligation: int, tell: str) -> Iterator[str]:
        if not self.progress:
            yield tell
            yield f'printf("{BROKEN} {obligation}\\n")'
            yield "assert(false)"

    def _told(self, machine: Machine) -> tuple[str, ...]:
        own = machine.flat.program.variables
        inputs = {machine.flat.name(v.name) for v in own if v.kind is Kind.INPUT}
        inputs |= {machine.flat.name(earlier(v.name)) for v in own if v.kind is Kind.INPUT}
        prefix = f"{machine.level}:"
        return tuple(
            name for name in self.names if name.startswith(prefix) and (name in inputs or name in self.lazy)
        )

    def _tell(self, machine: Machine) -> str:
        told = self._told(machine)
        values = [
            f"({drawn_flag(self.names[name])} -> {self.names[name]} : {NONE})"
            if name in self.lazy
            else self.names[name]
            for name in told
        ]
        values = [self.names[machine.table], self.names[machine.line], *values]
        pattern = " ".join(["%d"] * len(values))
        return f'printf("{TOLD} {machine.level} {pattern}\\n", {", ".join(values)})'

    def _cleared(self, block: Block, scratch: int) -> Iterator[str]:
        """What is not needed any more stands at 0, so that states that only differ there are one."""
        for name in dict.fromkeys(mentioned(block)):
            if name not in self.between:
                yield f"{self.names[name]} = 0"
                if name in self.lazy:
                    yield f"{drawn_flag(self.names[name])} = 0"
        yield from (f"scratch_{at} = 0" for at in range(scratch))

    def _turned(self) -> Iterator[str]:
        """Numbers that are only compared for equality count from one of them: states that only differ in where they are, are one."""
        for lead, ring in self._rings():
            size, first = self.domains[lead].size, self.names[lead]
            for name in ring:
                if name != lead:
                    yield f"{self.names[name]} = ({self.names[name]} + {size} - {first}) % {size}"
            yield f"{first} = 0"

    def _rings(self) -> Iterator[tuple[str, list[str]]]:
        done: set[int] = set()
        preferred = [name for one in self.machines for name in one.numbers]
        for name in (*preferred, *self.names):
            group = self.groups.get(name)
            if group is None or id(group) in done or name not in self.between or not self.domains[name].size:
                continue
            done.add(id(group))
            if not group.tests and not group.given and not group.paired:
                yield name, [one for one in group.names if one in self.between]


def _printed(word: str, machine: Machine) -> str:
    return f'printf("{word} {machine.level}\\n")'


def _process_name(level: str) -> str:
    return f"level_{level}"


def _type(domain: Domain) -> str:
    if domain.low >= 0 and domain.high <= 1:
        return "bit"
    if domain.low >= 0 and domain.high <= 255:
        return "byte"
    return "short" if domain.low >= -32768 and domain.high <= 32767 else "int"

"""The whole system in one process: all levels and what stands outside them, one control tick at a time.

In each tick every level that is due takes the buffers as the tick before left them, all run, and all give: what a
level sees does not depend on the order of the levels, and is the same with every executor.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

from rcsc.base.host.described import Document, KeyPath, nearest
from rcsc.lang.restart import ECHO, NUMBER
from rcsc.run.adopt import Restarted, restart
from rcsc.run.buffers import Buffers, CommonMemory
from rcsc.run.description import BadDescription, Description, of_a_link
from rcsc.run.executors import CExecutor, Executor, PythonExecutor, Twins, build, refuse_unproved
from rcsc.run.levels import Query, RunningLevel, misfit, running_level
from rcsc.run.levels import StateTableError as StateTableError  # noqa: PLC0414  # callers look for it here
from rcsc.run.signature import Leaf, Signature, Values, generated_files, signature

Kind = Literal["c", "python", "both"]
"""Of executors: `both` runs the C, and holds the Python against it in every cycle."""


class Outside(Protocol):
    """A part outside the levels: a robot, a hand, a camera, a workstation."""

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """Read the buffers as the tick before left them; return the values to publish."""
        ...


@dataclass(slots=True)
class System:
    """Levels from the top down, the parts outside, and the buffers between.

    Attributes:
        tick: Ticks done so far.
        watch: Called after each tick.
        restarts: Levels that were started again before the present tick, in order; who watches the tick sees them.
        forms: For each buffer with a level at an end, the format of what it can hold (`Signature.form`).
    """

    description: Description
    levels: tuple[RunningLevel, ...]
    outside: tuple[Outside, ...]
    buffers: Buffers = field(default_factory=CommonMemory)
    tick: int = 0
    watch: list[Callable[["System", tuple[RunningLevel, ...]], None]] = field(default_factory=list)
    restarts: list[Restarted] = field(default_factory=list)
    forms: Mapping[str, str] = field(init=False)

    def __post_init__(self) -> None:
        """Find the formats of the buffers with a level at an end."""
        taken = {take.buffer: take.form for level in self.levels for take in level.takes}
        self.forms = taken | {
            give.buffer: level.sign.form(range(give.first, give.end))
            for level in self.levels
            for give in level.gives
        }

    def step(self) -> None:
        """Run one control tick.

        Raises:
            StateTableError: A level was refused an input, no line or several matched, or what stands outside published no such values.
        """
        due = tuple(
            level
            for level in self.levels
            if self.tick * self.description.tick_ms % level.level.period_ms == 0
        )
        for level in due:
            level.take(self.buffers)
        given = [part.step(self.tick, self.buffers.latest) for part in self.outside]
        faulty = [level for level in due if level.run()]
        for level in due:
            level.give(self.buffers)
        for published in given:
            if not isinstance(published, Mapping):
                raise StateTableError(
                    f"what stands outside published a `{type(published).__name__}`, and no buffers"
                )
            for name, values in published.items():
                self._publish(name, values)
        self.tick += 1
        for watch in self.watch:
            watch(self, due)
        self.restarts.clear()
        for level in faulty:
            raise StateTableError(_message(level, self.tick))

    def _publish(self, name: str, values: Values) -> None:
        """Raises: StateTableError: What stands outside published what the buffer cannot hold."""
        if name in self.forms and (wrong := misfit(self.forms[name], values)):
            raise StateTableError(f"buffer `{name}` cannot hold what was published: {wrong}")
        self.buffers.publish(name, values)

    def restart(self, name: str, checkpoint: Values | None = None, written: Buffers | None = None) -> None:
        """Restart a level before the next tick, as if its process had been killed and started again.

        Args:
            name: The level's.
            checkpoint: What it goes on from: all leaves and the trace; None where that is lost, too.
            written: The buffers as they were written, where readers may see something older; None where they do not.

        Raises:
            KeyError: There is no level of that name.
        """
        self.restarts.append(restart(self.level(name), self.buffers, checkpoint, written))

    def level(self, name: str) -> RunningLevel:
        """Return a level by its name.

        Raises:
            KeyError: There is no level of that name.
        """
        return next((level for level in self.levels if level.name == name), None) or _missing(name)


def _missing(name: str) -> RunningLevel:
    raise KeyError(name)


def _message(level: RunningLevel, tick: int) -> str:
    return f"level `{level.name}`, table `{level.table}`, cycle {tick}: {level.fault_text}"


def signatures(system: Description, *, fitting: bool = True) -> dict[str, Signature]:
    """Read the signature of each level's program, by the level's name.

    Args:
        system: The description.
        fitting: Whether the levels are to run together, and so must fit each other.

    Raises:
        BadDescription: A program is not there, or the description does not fit the programs.
    """
    signs, page = {}, system.review()
    for at, spec in enumerate(system.levels):
        path, *_ = generated_files(system.generated, spec.program)
        place: KeyPath = ("level", at, "name" if spec.program == spec.name else "program")
        try:
            signs[spec.name] = signature(path)
        except OSError:
            compiled = sorted(file.stem for file in path.parent.glob("*.json"))
            helps = nearest(spec.program, compiled) or ("run `rcsc compile`",)
            page.wrong(place, f"program `{spec.program}` is not compiled: `{path}` cannot be read", *helps)
        except ValueError as error:
            page.wrong(place, str(error))
    if page.faults:
        raise page.bad(BadDescription)
    if fitting:
        check_fit(system, signs)
    return signs


def check_fit(system: Description, signs: Mapping[str, Signature]) -> None:
    """Check the description's levels and variables against their programs.

    Raises:
        BadDescription: Something does not fit; all misfits are reported at once.
    """
    page = system.review()
    for at, spec in enumerate(system.levels):
        sign = signs[spec.name]
        level = next((level for level in sign.levels if level.name == spec.name), None)
        if level is None:
            names = [level.name for level in sign.levels]
            page.wrong(
                ("level", at, "name"),
                f"program `{sign.program}` has no level `{spec.name}`",
                *nearest(spec.name, names),
            )
        elif level.period_ms % system.tick_ms:
            page.wrong(
                ("tick_ms",),
                f"`tick_ms` is {system.tick_ms}, and level `{spec.name}` runs every {level.period_ms} ms: no whole number of ticks",
                f"the period stands in program `{sign.program}`",
            )
        for number, feed in enumerate(spec.feeds):
            path: KeyPath = ("level", at, "feed", number)
            _check_variable(page, (*path, "into"), sign, feed.into, "input")
            for place, key in enumerate(feed.keys):
                _check_variable(page, (*path, "keys", place), sign, key, scalar=True)
    for wire in system.wires:
        for end, kind in ((wire.source, ""), (wire.target, "input")):
            owner, _, variable = end.partition(".")
            if owner in signs:
                _check_variable(page, system.place_of(wire), signs[owner], variable, kind)
    if not page.faults:
        _check_ends(page, system, signs)
        _check_readers(page, system, signs)
    for name, shown in system.displays.items():
        for place, text in enumerate(shown):
            owner, _, variable = text.partition(".")
            if owner not in signs:
                page.wrong(("displays", name, place), f"there is no level `{owner}` to show", *nearest(owner, list(signs)))  # fmt: skip
            else:
                _check_variable(page, ("displays", name, place), signs[owner], variable, scalar=True)
    if page.faults:
        raise page.bad(BadDescription)


def _check_variable(
    page: Document, path: KeyPath, sign: Signature, variable: str, kind: str = "", *, scalar: bool = False
) -> None:
    """Note a variable that the program lacks, that is of another kind, or that is no scalar where one is wanted."""
    try:
        leaves = sign.leaves_of(variable)
    except KeyError:
        names = sorted({part for leaf in sign.leaves for part in (leaf.name, leaf.name.partition(".")[0])})
        page.wrong(path, f"program `{sign.program}` has no variable `{variable}`", *nearest(variable, names))
        return
    if kind and any(leaf.kind != kind for leaf in leaves):
        page.wrong(path, f"`{variable}` of program `{sign.program}` is filled, and is no {kind}")
    if scalar and variable not in sign.index:
        page.wrong(path, f"`{variable}` of program `{sign.program}` has {len(leaves)} parts; name one")


def _check_ends(page: Document, system: Description, signs: Mapping[str, Signature]) -> None:
    """Note buffers between levels whose two ends have different types."""
    for wire in system.wires:
        ends = []
        for end in (wire.source, wire.target):
            owner, _, variable = end.partition(".")
            if owner in signs:
                leaves = signs[owner].leaves_of(variable)
                ends.append(
                    [(leaf.name.removeprefix(variable), leaf.c_type, leaf.members) for leaf in leaves]
                )
        if len(ends) == 2 and ends[0] != ends[1]:
            page.wrong(system.place_of(wire), f"`{wire.source}` and `{wire.target}` hold other things")


def _check_readers(page: Document, system: Description, signs: Mapping[str, Signature]) -> None:
    """Note buffers of several readers that carry orders or reports, or that the readers declare otherwise."""
    for source, targets in system.readers().items():
        ends = {end: _leaves(signs, end) for end in targets if end.partition(".")[0] in signs}
        if len(targets) == 1 or not ends:
            continue
        first = next(iter(ends))
        if {NUMBER, ECHO} & {leaf.name.rpartition(".")[2] for leaf in ends[first]}:
            wrong = of_a_link(source, targets, first.partition(".")[0], source.partition(".")[0])
            page.wrong(("buffers", source, 1), *wrong)
            continue
        whole = (
            source.partition(".")[0] not in signs
        )  # what a level gives is held against each reader by itself
        for end, leaves in ends.items():
            if other := _otherwise(ends[first], leaves, whole=whole):
                page.wrong(
                    ("buffers", source, targets.index(end)),
                    f"`{first}` and `{end}` read one buffer, `{source}`, and differ: {other}",
                    "declare both alike: with one type, of a file that both `use`, and one initial value",
                )


def _leaves(signs: Mapping[str, Signature], end: str) -> tuple[Leaf, ...]:
    level, _, variable = end.partition(".")
    return signs[level].leaves_of(variable)


def _otherwise(first: Sequence[Leaf], other: Sequence[Leaf], *, whole: bool) -> str:
    """Return how two readers of one buffer declare it otherwise; the initial value alone, where not the whole type counts."""
    if whole and [(leaf.c_type, leaf.members) for leaf in first] != [
        (leaf.c_type, leaf.members) for leaf in other
    ]:
        return "they are of other types"
    for one, two in zip(first, other, strict=True):
        if whole and (one.low, one.high, one.unit) != (two.low, two.high, two.unit):
            return f"{_range(one)} against {_range(two)}"
        if one.initial != two.initial:
            return f"`{one.name}` begins with {one.shown(one.initial)}, `{two.name}` with {two.shown(two.initial)}"
    return ""


def _range(leaf: Leaf) -> str:
    return f"`{leaf.name}` from {leaf.low} to {leaf.high}{f' {leaf.unit}' if leaf.unit else ''}"


def check_answered(system: Description, queries: Mapping[str, Query]) -> None:
    """Check that every query of a feed has an answer.

    Raises:
        BadDescription: A query has none.
    """
    page = system.review()
    for at, spec in enumerate(system.levels):
        for number, feed in enumerate(spec.feeds):
            if feed.query not in queries:
                helps = nearest(feed.query, list(queries)) or (
                    f"the plant answers it with a method `def {feed.query}(self, key)`",
                )
                where = ("level", at, "feed", number, "query")
                page.wrong(
                    where, f"nobody answers `{feed.query}`, which fills `{spec.name}.{feed.into}`", *helps
                )
    if page.faults:
        raise page.bad(BadDescription)


def executors(system: Description, signs: Mapping[str, Signature], kind: Kind) -> dict[str, Executor]:
    """Build an executor for each level.

    Raises:
        BadDescription: A program has no such level.
        NotBuilt: The C could not be built.
    """
    levels = {name: sign.level_of(name) for name, sign in signs.items()}
    python = {
        name: PythonExecutor(system.generated, sign, levels[name])
        for name, sign in signs.items()
        if kind != "c"
    }
    if kind == "python":
        return dict(python)
    library = build(system.generated, list({sign.program: sign for sign in signs.values()}.values()))
    c = {name: CExecutor(library, sign, levels[name]) for name, sign in signs.items()}
    return (
        dict(c) if kind == "c" else {name: Twins(sign, c[name], python[name]) for name, sign in signs.items()}
    )


def assemble(
    system: Description, kind: Kind, queries: Mapping[str, Query], outside: Iterable[Outside] = ()
) -> System:
    """Assemble the system, ready for its first tick.

    Raises:
        BadDescription: It does not fit together, or its executors are made of tables that are not proved.
        NotBuilt: The C could not be built.
    """
    refuse_unproved(system)
    signs = signatures(system)
    check_answered(system, queries)
    by_level = executors(system, signs, kind)
    levels: Sequence[RunningLevel] = [
        running_level(spec, system, signs[spec.name], by_level[spec.name], queries) for spec in system.levels
    ]
    return System(system, tuple(levels), tuple(outside))

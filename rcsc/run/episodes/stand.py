"""The test stand: a system with all that its declarations say about what may happen to it.

In: a description, compiled, with the sources of its levels. Out: a `Stand`: signatures, resolved programs, who orders whom, which buffers
there are, the values at which something may turn. It is read once as long as none of its files changes.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

from rcsc.code.testing.executors.edges import leaf_edges, outside
from rcsc.lang.model import Admit, Program, Property, Scalar, Value, Variable, VariableName, value_of_key
from rcsc.lang.restart import NUMBER, PROTOCOL, After
from rcsc.run.description import Description, description, places
from rcsc.run.faults import faults_of
from rcsc.run.log.across import stated_across
from rcsc.run.log.required import program_of
from rcsc.run.orders.roles import Served, field_of, ordered
from rcsc.run.orders.script import OutsideBuffer, outside_buffers
from rcsc.run.plant.load import chosen
from rcsc.run.plant.staging import StageOrder, staged
from rcsc.run.signature import Leaf, Signature, generated_files
from rcsc.run.system import signatures

SOURCES = ("*.rcs", "*.py", "*.xml")


@dataclass(frozen=True, slots=True)
class Field:
    """A field from outside that a reading may hold.

    Attributes:
        name: As a script calls it; `buffer` and `place` say where it is, `level` and `leaf` who takes it, and as what.
        edges: Values of its type at which something may turn.
        refused: Values that the level refuses, some of them; `past`, those that it moves to the edge of its range.
    """

    name: str
    buffer: str
    place: int
    level: str
    leaf: Leaf
    edges: tuple[Value, ...]
    refused: tuple[Value, ...]
    past: tuple[Value, ...] = ()

    def refuses(self, value: Value) -> bool:
        """Whether the level refuses a value."""
        leaf = self.leaf
        if leaf.clamp:  # it is moved to the edge, unless it is no number
            return bool(self.refused) and value != value  # noqa: PLR0124
        low, high = (0, len(leaf.members) - 1) if leaf.members else (leaf.low, leaf.high)
        return bool(self.refused) and low is not None and high is not None and not low <= value <= high


@dataclass(frozen=True, slots=True)
class Stand:
    """A system to be played with.

    Attributes:
        path: Of the description.
        programs: By the level's name, as its source says now.
        links: Who takes numbered orders, from levels and from outside; `served` are those ordered from outside.
        buffers: All that something may happen to.
        outside: Those that no level fills.
        edges: By level and leaf, the values at which something may turn.
        fields: From outside, but those that the protocol fills.
        across: Properties, requirements and assumptions across levels.
        files: All that this was read from, with the times of the files.
    """

    path: Path
    system: Description
    signs: Mapping[str, Signature]
    programs: Mapping[str, Program]
    links: tuple[Served, ...]
    buffers: tuple[str, ...]
    outside: tuple[OutsideBuffer, ...]
    edges: Mapping[str, Mapping[str, tuple[Value, ...]]] = field(repr=False)
    fields: tuple[Field, ...] = field(repr=False)
    files: tuple[tuple[str, int], ...] = field(repr=False)
    across: tuple[Property, ...] = ()

    @property
    def served(self) -> tuple[Served, ...]:
        """The levels that are ordered from outside."""
        return tuple(link for link in self.links if link.party not in self.signs)

    def stands_outside(self, plant: str = "") -> bool:
        """Whether a plant stands outside the levels.

        Raises:
            BadPlant: The description has none of that name.
        """
        return chosen(self.system, plant or None) is not None

    @property
    def protocol(self) -> frozenset[str]:
        """The buffers that carry numbered orders and the reports on them."""
        return frozenset(name for link in self.links for name in (link.order, link.report))


def stand(path: Path, generated: Path | None = None) -> Stand:
    """Return the stand of a description; the same as long as none of its files changes.

    Args:
        path: Of the description.
        generated: Where its executors are; None for where it says itself.

    Raises:
        BadDescription: The description is not in order, a program is not compiled, or its source is not there.
    """
    return _stand(path, generated, _files(path, generated))


def _files(path: Path, generated: Path | None) -> tuple[tuple[str, int], ...]:
    """Return every file that a stand is made of, with its time: all sources, plants and models beside the description and its levels."""
    system = _described(path, path.stat().st_mtime_ns if path.is_file() else 0)
    tried = [place for spec in system.levels for place in places(path, spec.source)]
    tried += [system.requirements] if system.requirements else []
    folders = dict.fromkeys((path.parent, *(place.parent for place in tried)))
    files = [file for folder in folders for end in SOURCES for file in sorted(folder.glob(end))]
    symbols = [generated_files(generated or system.generated, spec.program)[0] for spec in system.levels]
    return tuple((str(file), file.stat().st_mtime_ns) for file in (path, *files, *symbols) if file.is_file())


@lru_cache(maxsize=8)
def _described(path: Path, _time_ns: int) -> Description:
    return description(path)


@lru_cache(maxsize=8)
def _stand(path: Path, generated: Path | None, files: tuple[tuple[str, int], ...]) -> Stand:
    system = description(path)
    system = replace(system, generated=generated or system.generated)
    signs = signatures(system)
    programs = {spec.name: program_of(path, system, spec) for spec in system.levels}
    edges = {name: _edges(program) for name, program in programs.items()}
    buffers = outside_buffers(system, signs)
    across = stated_across(system, programs)
    return Stand(
        path, system, signs, programs, ordered(system, signs), tuple(system.readers()),
        buffers, edges, tuple(_fields(system, signs, buffers, programs, edges)), files,
        () if across is None else across[0].stated,
    )  # fmt: skip


def _edges(program: Program) -> dict[str, tuple[Value, ...]]:
    kinds: Mapping[VariableName, Scalar] = {variable.name: variable.type for variable in program.variables}
    return {
        name: tuple(value_of_key(kinds[VariableName(name)], key) for key in keys)
        for name, keys in leaf_edges(program).items()
    }


def _fields(
    system: Description,
    signs: Mapping[str, Signature],
    buffers: tuple[OutsideBuffer, ...],
    programs: Mapping[str, Program],
    edges: Mapping[str, Mapping[str, tuple[Value, ...]]],
) -> list[Field]:
    """Return the fields from outside that are not the protocol's: of an order none, of a report those that a device measures."""
    read_by = system.readers()
    fields = []
    keys = {(spec.name, key) for spec in system.levels for feed in spec.feeds for key in feed.keys}
    for buffer in buffers:
        readers = [(end.partition(".")[0], end.partition(".")[2]) for end in read_by[buffer.name]]
        level = readers[0][0]  # the others declare it alike
        runs = [signs[name].leaves_of(variable) for name, variable in readers]
        repeated = {
            adopted.leaf for adopted in programs[level].adopted.values() if isinstance(adopted, After)
        }
        numbered = {field_of(leaf) for leaf in buffer.leaves} & set(PROTOCOL)
        if NUMBER in numbered:
            continue
        for place, (column, leaf) in enumerate(zip(buffer.columns, buffer.leaves, strict=True)):
            if (numbered and field_of(leaf) in PROTOCOL) or leaf.name in repeated:
                continue
            variable = programs[level].variable(leaf.name)
            asked = (level, leaf.name) in keys  # a feed is asked about it before the level refuses it
            refused = () if asked else tuple(_refused(variable))
            past = () if asked else tuple(_past(variable))
            turns = dict.fromkeys(
                value
                for (name, _), run in zip(readers, runs, strict=True)
                for value in edges[name][run[place].name]
            )
            fields.append(Field(column, buffer.name, place, level, leaf, tuple(turns), refused, past))
    return fields


def _refused(variable: Variable) -> Iterator[Value]:
    """Yield values that a level refuses: those outside the range, or, where they are moved to its edge, what is no number."""
    for value in outside(variable.type):
        if variable.admit is Admit.REJECT or value != value:  # noqa: PLR0124
            yield value


def _past(variable: Variable) -> Iterator[Value]:
    """Yield values that a level moves to the edge of its range."""
    if variable.admit is Admit.CLAMP:
        yield from (value for value in outside(variable.type) if math.isfinite(value))


_SWITCHES: dict[tuple[tuple[tuple[str, int], ...], str], tuple[str, ...]] = {}
"""What plants declare, by the stand's files and the plant's name: to ask a plant is to make one."""


def switches(its: Stand, plant: str = "") -> tuple[str, ...]:
    """Return the faults that a plant declares, in order; of one whose episodes are of a kind of its own, which draws them, none.

    Raises:
        CodedError: The plant is not in order.
    """
    spec = next((one for one in its.system.plants if plant in {"", one.name}), None)
    if spec is not None and spec.campaign:
        return ()
    key = its.files, plant
    if key not in _SWITCHES:
        stage = staged(StageOrder(str(its.path), plant), its.system, its.signs)
        _SWITCHES[key] = faults_of(stage.outside)
    return _SWITCHES[key]

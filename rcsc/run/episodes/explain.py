"""Which injected fault explains that something does not hold, if one does.

In: what was changed in buffers against what they promise. Out: for a `Broken` the fault, in words, or nothing. Values that are lost,
late or read twice explain nothing, nor does a restart: the proofs allow them. An order, a report or another value of a level that
comes again when it is older misleads the level that takes it, and from then on whoever exchanges buffers with that level. A field from
outside that holds a value of its range explains no more than an assumption about values that follow from it, and what the plant says of
itself.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

from rcsc.lang.leaves import expressions, read_by, written_by
from rcsc.lang.model import Call, Program
from rcsc.run.episodes.cycle import Broken
from rcsc.run.episodes.stand import Stand


@dataclass(slots=True)
class Explanations:
    """What was misled so far.

    Attributes:
        misled: Levels that saw what no buffer may say, each with the fault.
        forged: By level, its leaves that did not come as the plant said, each with the fault.
        repeated: Levels that were misled by older values that came again, each with the fault.
    """

    stand: Stand
    misled: dict[str, str] = field(default_factory=dict)
    forged: dict[str, dict[str, str]] = field(default_factory=dict)
    repeated: dict[str, str] = field(default_factory=dict)

    def note(self, changed: Mapping[str, str], places: Mapping[str, Collection[int]] | None = None) -> None:
        """A tick is done.

        Args:
            changed: Buffers that did not say what was published in time, each with the fault.
            places: Of such a buffer, the leaves that did not; none where all may not have.
        """
        for level, other in self._neighbours():
            for known in (self.misled, self.repeated):
                if level in known:
                    known.setdefault(other, known[level])
        for wire in self.stand.system.wires:
            because = changed.get(wire.source)
            level, _, variable = wire.target.partition(".")
            if because is None or level not in self.stand.signs:
                continue
            if not (places or {}).get(wire.source):
                self.repeated.setdefault(level, because)
            if wire.source in self.stand.protocol or wire.source.partition(".")[0] in self.stand.signs:
                self.misled.setdefault(level, because)
            else:
                sign = self.stand.signs[level]
                false = (places or {}).get(wire.source) or range(len(sign.record(variable)))
                names = (
                    sign.leaves[at].name for place, at in enumerate(sign.record(variable)) if place in false
                )
                self.forged.setdefault(level, {}).update(dict.fromkeys(names, because))

    def _neighbours(self) -> Iterator[tuple[str, str]]:
        """Yield pairs of levels with a buffer between them, both ways."""
        for wire in self.stand.system.wires:
            source, target = wire.source.partition(".")[0], wire.target.partition(".")[0]
            if source in self.stand.signs and target in self.stand.signs:
                yield source, target
                yield target, source

    def because(self, broken: Broken) -> str:
        """Return the fault that explains it; empty for none."""
        if broken.proved:
            return self.repeated.get(broken.level, "")
        if not broken.level:
            faults = [
                *self.misled.values(),
                *(why for leaves in self.forged.values() for why in leaves.values()),
            ]
            return faults[0] if faults else ""
        if broken.level in self.misled:
            return self.misled[broken.level]
        forged = self.forged.get(broken.level, {}) if broken.leaves else {}
        for leaf, because in forged.items():
            if set(follows(self.stand.programs[broken.level], leaf)) & set(broken.leaves):
                self.misled[broken.level] = because  # it was proved of levels whose assumptions hold
                return because
        return ""


def follows(program: Program, leaf: str) -> set[str]:
    """Return the leaf, and all leaves that are assigned what was computed from it."""
    flows = list(_flows(program))
    known, size = {leaf}, 0
    while len(known) > size:
        size = len(known)
        for reads, writes in flows:
            if known & reads:
                known |= writes
    return known


def _flows(program: Program) -> Iterator[tuple[set[str], set[str]]]:
    """Yield what is read and what is written from it; of a procedure all that it may read, with all that it may write."""
    writes = {procedure.name: set(map(str, procedure.writes)) for procedure in program.procedures}
    for procedure in program.procedures:
        yield set(map(str, procedure.reads)), writes[procedure.name]
    for table in program.tables:
        for statement in (action.statement for line in table.lines for action in line.actions):
            read = {str(name) for expr in expressions(statement) for name in read_by(expr)}
            called = writes[statement.procedure] if isinstance(statement, Call) else set()
            yield read, called | set(map(str, written_by(statement)))
    for variable in program.variables:
        if variable.deferred_until is not None:
            yield {f"{variable.name}.next"}, {str(variable.name)}

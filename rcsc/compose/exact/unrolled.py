"""Cycles of a circuit one after the other, as clauses of one incremental solver.

In: a circuit. Out: literals of the last cycle, under which there is such a run or none.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.compose.exact.circuit import EARLY, Circuit, Frame
from rcsc.proof.solvers.sat import Sat
from rcsc.proof.symbolic.bits import FALSE, TRUE, Literal, known_both


@dataclass(slots=True)
class Unrolled:
    """A run of so many cycles.

    Attributes:
        begins: Which of the first frames it begins with; None for any state.
        cycles: How many there are.
        broken: For each obligation the literal that the last cycle breaks it, in a run that keeps to the contract up to there.
    """

    circuit: Circuit
    begins: int | None
    sat: Sat = field(default_factory=lambda: Sat([[TRUE]]))
    cycles: int = 0
    broken: list[Literal] = field(default_factory=list)
    _count: int = TRUE
    _gates: dict[tuple[Literal, Literal], Literal] = field(default_factory=dict)
    _inputs: list[Mapping[Literal, Literal]] = field(default_factory=list)
    _latches: list[Literal] = field(default_factory=list)
    _on: Literal = TRUE

    def __post_init__(self) -> None:
        if self.begins is None:
            self._latches = [self.fresh() for _ in self.circuit.latches]

    def fresh(self) -> Literal:
        """Return a new variable."""
        self._count += 1
        return self._count

    def further(self) -> None:
        """Add a cycle after the last, which goes on."""
        if self._on != TRUE:
            self.sat.add([self._on])
        first = self.begins is not None and not self.cycles
        frame = self.circuit.firsts[self.begins or 0] if first else self.circuit.step
        of = self._copied(frame)
        valid = self._read(of, frame.valid)
        goes_on = self._read(of, frame.goes_on)
        self._on = self._both(valid, goes_on)
        self.broken = [
            self._both(valid if key[0] in EARLY else self._on, -self._read(of, holds))
            for key, holds in zip(self.circuit.wanted, frame.holds, strict=True)
        ]
        self._latches = [self._read(of, bit) for bit in frame.after]
        self._inputs.append(of)
        self.cycles += 1

    @property
    def latches(self) -> tuple[Literal, ...]:
        """The latches after the last cycle."""
        return tuple(self._latches)

    def same(self, a: Literal, b: Literal) -> Literal:
        """Return the literal that two others are the same."""
        return self._both(-self._both(a, -b), -self._both(-a, b))

    def difference(self, a: Sequence[Literal], b: Sequence[Literal]) -> tuple[Literal, ...]:
        """Return the bits of the difference of two numbers of as many bits, round."""
        bits, carry = [], TRUE
        for one, other in zip(a, b, strict=True):
            half = self.same(one, other)  # of `one` and the opposite of `other`: one of them holds
            bits.append(-self.same(half, carry))
            carry = -self._both(-self._both(half, carry), -self._both(one, -other))
        return tuple(bits)

    def never(self, names: Iterable[str]) -> list[Literal]:
        """Return the literals that none of these truth values, which the environment gives, holds in any cycle."""
        words = [self.circuit.given[name].word for name in names if name in self.circuit.given]
        return [-of[bit] for of in self._inputs for (bit,) in words if bit in of]

    def given(self) -> list[dict[str, int]]:
        """Return what the environment gives in each cycle of the last model, by variable."""
        every = []
        for of in self._inputs:
            cycle = {}
            for name, one in self.circuit.given.items():
                bits = [self._read(of, bit) for bit in one.word if abs(bit) == TRUE or abs(bit) in of]
                if len(bits) == len(one.word):
                    cycle[name] = _key(
                        [bit == TRUE or (bit != FALSE and self.sat.value(bit)) for bit in bits]
                    )
            every.append(cycle)
        return every

    def _copied(self, frame: Frame) -> dict[Literal, Literal]:
        """Copy the gates of a frame; return the literal of each variable."""
        needed = self.circuit.needed(frame.outputs)
        of = dict(zip(self.circuit.latches, self._latches, strict=False))
        for variable in self.circuit.inputs(needed):
            of[variable] = self.fresh()
        for gate, (a, b) in self.circuit.ands.items():
            if gate in needed:
                of[gate] = self._both(self._read(of, a), self._read(of, b))
        return of

    @staticmethod
    def _read(of: Mapping[Literal, Literal], literal: Literal) -> Literal:
        if abs(literal) == TRUE:
            return literal
        return of[literal] if literal > 0 else -of[-literal]

    def _both(self, a: Literal, b: Literal) -> Literal:
        if (known := known_both(a, b)) is not None:
            return known
        key = (a, b) if a < b else (b, a)
        gate = self._gates.get(key)
        if gate is None:
            gate = self._gates[key] = self.fresh()
            for clause in ([-gate, a], [-gate, b], [gate, -a, -b]):
                self.sat.add(clause)
        return gate


def _key(bits: list[bool]) -> int:
    """Return the number of two's complement; of a single bit, its value."""
    if len(bits) == 1:
        return int(bits[0])
    return sum(1 << at for at, bit in enumerate(bits[:-1]) if bit) - (bits[-1] << (len(bits) - 1))

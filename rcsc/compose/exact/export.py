"""A circuit for other people's model checkers: as AIGER, bit by bit, or as BTOR2, in which states and inputs are words.

In: a circuit. Out: a file with an output for each obligation, which is 1 where it is broken. Latch `started` tells a first cycle
from a later one, input `restarts` a first one from that after a restart; once latch `ended` is 1, the environment has broken the contract
or the cycle has ended in a fault, and nothing is bad any more.

Source: Biere, Heljanko and Wieringa, "AIGER 1.9 and beyond", 2011; Niemetz, Preiner, Wolf and Biere, "BTOR2, BtorMC and Boolector 3.0",
2018.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from rcsc.compose.exact.circuit import EARLY, Circuit, Gate
from rcsc.proof.symbolic.bits import TRUE, Literal, Word, known_both

STARTED, ENDED, RESTARTS = "started", "ended", "restarts"


@dataclass(slots=True)
class _Whole:
    """The frames of a circuit as one, with gates of its own after theirs."""

    circuit: Circuit
    ands: dict[Literal, Gate] = field(init=False)
    count: int = field(init=False)
    _made: dict[Gate, Literal] = field(init=False)
    started: Literal = field(init=False)
    ended: Literal = field(init=False)
    restarts: Literal = field(init=False)

    def __post_init__(self) -> None:
        self.ands, self.count = dict(self.circuit.ands), self.circuit.count
        self._made = {gate: variable for variable, gate in self.ands.items()}
        self.started, self.ended, self.restarts = (self._fresh() for _ in range(3))

    def _fresh(self) -> Literal:
        self.count += 1
        return self.count

    def both(self, a: Literal, b: Literal) -> Literal:
        """Return the literal of *a and b*."""
        if (known := known_both(a, b)) is not None:
            return known
        gate = min(a, b), max(a, b)
        if gate not in self._made:
            self._made[gate] = made = self._fresh()
            self.ands[made] = gate
        return self._made[gate]

    def choice(self, when: Literal, then: Literal, orelse: Literal) -> Literal:
        """Return `then` or `orelse`."""
        if then == orelse:
            return then
        return -self.both(-self.both(when, then), -self.both(-when, orelse))

    def of(self, part: Sequence[Literal]) -> Literal:
        """Choose among the literals of the frames: the first ones', then that of a later cycle."""
        first, *others, later = part
        for other in others:
            first = self.choice(self.restarts, other, first)
        return self.choice(self.started, later, first)


@dataclass(frozen=True, slots=True)
class _System:
    """The frames of a circuit as one transition system.

    Attributes:
        latches: The literal of each latch after a cycle; `bad`, that of each output.
    """

    whole: _Whole
    latches: dict[Literal, Literal]
    bad: dict[str, Literal]


def _system(circuit: Circuit, wanted: Iterable[int] | None, *, together: bool) -> _System:
    whole, frames = _Whole(circuit), (*circuit.firsts, circuit.step)
    valid = whole.both(-whole.ended, whole.of([frame.valid for frame in frames]))
    on = whole.both(valid, whole.of([frame.goes_on for frame in frames]))
    places = range(len(circuit.wanted)) if wanted is None else list(wanted)
    bad = {
        " ".join(filter(None, circuit.wanted[at])): whole.both(
            valid if circuit.wanted[at][0] in EARLY else on,
            -whole.of([frame.holds[at] for frame in frames]),
        )
        for at in places
    }
    if together:
        fine = TRUE
        for one in bad.values():
            fine = whole.both(fine, -one)
        bad = {"all": -fine}
    latches = {whole.started: TRUE, whole.ended: -on}
    latches |= {
        latch: whole.of([frame.after[at] for frame in frames]) for at, latch in enumerate(circuit.latches)
    }
    return _System(whole, latches, bad)


def aiger(circuit: Circuit, wanted: Iterable[int] | None = None, *, together: bool = False) -> bytes:
    """Return a circuit in binary AIGER, with outputs for these obligations, by position; or one for all of them `together`."""
    made = _system(circuit, wanted, together=together)
    whole = made.whole
    names = {whole.started: STARTED, whole.ended: ENDED, whole.restarts: RESTARTS, **dict(_names(circuit))}
    return _written(whole, made.latches, made.bad, names)


def btor2(circuit: Circuit, wanted: Iterable[int] | None = None) -> bytes:
    """Return a circuit in BTOR2, with a bad state for each of these obligations, by position."""
    made = _system(circuit, wanted, together=False)
    lines = _Lines()
    zero = lines.add("zero", lines.sort(1))  # a value with which a state begins stands before it
    words = {
        STARTED: (made.whole.started,), ENDED: (made.whole.ended,), **dict(zip(circuit.leaves, circuit.words, strict=True)),
    }  # fmt: skip
    inputs = {RESTARTS: (made.whole.restarts,), **{name: given.word for name, given in circuit.given.items()}}
    states = {name: lines.word("state", name, word) for name, word in words.items()}
    for name, word in inputs.items():
        lines.word("input", name, word)
    known = {*made.whole.ands, *made.latches, *map(abs, (bit for word in inputs.values() for bit in word))}
    for open_ in sorted(set(range(TRUE + 1, made.whole.count + 1)) - known):
        lines.word("input", f"open {open_}", (open_,))
    for gate in sorted(made.whole.ands):
        lines.gate(gate, made.whole.ands[gate])
    for name, word in words.items():
        lines.next(states[name], [made.latches.get(bit, bit) for bit in word])
    for name in (STARTED, ENDED):
        lines.add("init", lines.sort(1), states[name], zero)
    for name, literal in made.bad.items():
        lines.add("bad", lines.of(literal), _symbol(name))
    return "".join(f"{line}\n" for line in lines.written).encode()


@dataclass(slots=True)
class _Lines:
    """The lines of a BTOR2 file, each under its number."""

    written: list[str] = field(default_factory=list)
    _sorts: dict[int, int] = field(default_factory=dict)
    _nodes: dict[Literal, int] = field(default_factory=dict)

    def add(self, *parts: object) -> int:
        """Write a line; return its number."""
        self.written.append(" ".join(map(str, (len(self.written) + 1, *parts))))
        return len(self.written)

    def sort(self, width: int) -> int:
        """Return the sort of words of so many bits."""
        if width not in self._sorts:
            self._sorts[width] = self.add("sort", "bitvec", width)
        return self._sorts[width]

    def word(self, kind: str, name: str, word: Word) -> int:
        """Declare a word, and its bits that are variables."""
        sort, bit_sort = self.sort(len(word)), self.sort(1)
        number = self.add(kind, sort, _symbol(name))
        for at, bit in enumerate(word):
            if abs(bit) != TRUE:
                self._nodes[bit] = number if len(word) == 1 else self.add("slice", bit_sort, number, at, at)
        return number

    def gate(self, gate: Literal, parts: Gate) -> None:
        """Write a conjunction."""
        self._nodes[gate] = self.add("and", self.sort(1), *map(self.of, parts))

    def of(self, literal: Literal) -> int:
        """Return the number of a literal; the opposite of a line is its negative."""
        if abs(literal) == TRUE and TRUE not in self._nodes:
            self._nodes[TRUE] = self.add("one", self.sort(1))
        return self._nodes[literal] if literal > 0 else -self._nodes[-literal]

    def next(self, state: int, bits: Sequence[Literal]) -> None:
        """State what a word is after a cycle, lowest bit first."""
        value = self.of(bits[0])
        for width, bit in enumerate(bits[1:], 2):
            value = self.add("concat", self.sort(width), self.of(bit), value)
        self.add("next", self.sort(len(bits)), state, value)


def _symbol(name: str) -> str:
    return "_".join(name.split())


def _names(circuit: Circuit) -> Iterator[tuple[Literal, str]]:
    """Name each latch and input by its variable, and the place of its bit."""
    words = dict(zip(circuit.leaves, circuit.words, strict=True))
    words |= {name: given.word for name, given in circuit.given.items()}
    for name, word in words.items():
        for place, bit in enumerate(word):
            if abs(bit) != TRUE:
                yield abs(bit), f"{name}[{place}]" if len(word) > 1 else name


def _written(
    whole: _Whole, latches: dict[Literal, Literal], bad: dict[str, Literal], names: dict[Literal, str]
) -> bytes:
    needed, waiting = set[Literal](), [abs(literal) for literal in bad.values()]
    while waiting:
        variable = waiting.pop()
        if variable not in needed and variable != TRUE:
            needed.add(variable)
            waiting += map(abs, whole.ands.get(variable, ()))
            waiting += [abs(latches[variable])] if variable in latches else []
    kept = [latch for latch in latches if latch in needed]
    inputs = sorted(needed.difference(whole.ands, latches))
    gates = [gate for gate in sorted(whole.ands) if gate in needed]
    number = {variable: at for at, variable in enumerate((*inputs, *kept, *gates), 1)}

    def code(literal: Literal) -> int:
        if abs(literal) == TRUE:
            return int(literal > 0)
        return 2 * number[abs(literal)] + (literal < 0)

    lines = [f"aig {len(number)} {len(inputs)} {len(kept)} {len(bad)} {len(gates)}"]
    lines += [str(code(latches[latch])) for latch in kept]
    lines += [str(code(literal)) for literal in bad.values()]
    written = bytearray("".join(f"{line}\n" for line in lines).encode())
    for gate in gates:
        low, high = sorted(map(code, whole.ands[gate]))
        for difference in (2 * number[gate] - high, high - low):
            written += _seven_bits_each(difference)
    named = [("i", inputs), ("l", kept)]
    symbols = [
        f"{sort}{at} {_one_line(names[one])}"
        for sort, every in named
        for at, one in enumerate(every)
        if one in names
    ]
    symbols += [f"o{at} {_one_line(name)}" for at, name in enumerate(bad)]
    return bytes(written) + "".join(f"{line}\n" for line in symbols).encode()


def _one_line(name: str) -> str:
    return " ".join(name.split())


def _seven_bits_each(number: int) -> bytes:
    parts = bytearray()
    while number > 0x7F:  # seven bits, and one that more follow
        parts.append(number & 0x7F | 0x80)
        number >>= 7
    parts.append(number)
    return bytes(parts)

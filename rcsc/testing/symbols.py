"""What the emitted executors call things, read from the symbol file that is emitted beside them.

In: the text of `<program>.json`. Out: names of files, functions and leaves, in C and in Python.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class LeafSymbol:
    """A leaf in the executors.

    Attributes:
        path: Its place in the C struct, `emove_status.echo`.
        c_type: Its C type, `uint8_t`.
        attribute: Its attribute in the Python class.
    """

    path: str
    c_type: str
    attribute: str


@dataclass(frozen=True, slots=True)
class Trace:
    """The places of the trace in the struct; `who` is a C expression of the struct."""

    line_path: str = "line"
    fault_at_path: str = "fault_at"
    failed_path: str = "assumptions_failed"

    def line(self, who: str) -> str:
        """The line taken."""
        return f"{who}.{self.line_path}"

    def fault_at(self, who: str) -> str:
        """The leaf that was refused."""
        return f"{who}.{self.fault_at_path}"

    def failed(self, who: str, number: int) -> str:
        """Whether monitored assumption `number` failed."""
        return f"((({who}.{self.failed_path}) >> {number}) & 1u)"


@dataclass(frozen=True, slots=True)
class Symbols:
    """Every name that the suite uses.

    Attributes:
        leaves: By name of the leaf, in declared order.
        lines: By table: function that says which line matches.
        steps: By table: function of one step.
        batches: By table: function for many inputs.
        cycles: By level: function of one cycle.
    """

    program: str
    struct: str
    header: str
    source: str
    init: str
    leaves: Mapping[str, LeafSymbol]
    lines: Mapping[str, str]
    steps: Mapping[str, str]
    batches: Mapping[str, str]
    cycles: Mapping[str, str]
    positions: Mapping[str, int] = field(default_factory=dict)
    trace: Trace = Trace()

    def path(self, name: str) -> str:
        """Place of a leaf in the struct."""
        return self.leaves[name].path

    def c_type(self, name: str) -> str:
        """C type of a leaf."""
        return self.leaves[name].c_type

    def fault_at(self, name: str) -> int:
        """What `fault_at` says when this leaf is refused."""
        return self.positions[name]

    def leaf_at(self, number: int) -> str:
        """The leaf that `fault_at` means."""
        return next((name for name, at in self.positions.items() if at == number), f"leaf {number}")

"""The emitted Python, driven as the interpreter and the C are.

In: a program, its symbols, its emitted files. Out: what each cycle left behind. The module's text is run as
it is, from memory, under a name of its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from rcsc.code.testing.executors.externs import PythonStandIns
from rcsc.code.testing.executors.reference_file import fault_named, monitored
from rcsc.code.testing.executors.sessions import Seen, Stimuli
from rcsc.code.testing.executors.symbols import Symbols, text_of
from rcsc.code.testing.executors.targets import ComparedFunction
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Program, Snapshot, Value

RAISED = -1
"""Stands for a fault code where the executor raised an exception, which none may."""


@dataclass(frozen=True, slots=True)
class PythonUnderTest:
    """The emitted module of one program."""

    program: Program
    symbols: Symbols
    module: ModuleType

    def function(self, target: ComparedFunction) -> Any:
        """The Python function of a target: the C name without the program's."""
        return getattr(self.module, target.function.removeprefix(f"{self.symbols.program}_"))

    def state(self, snapshot: Snapshot) -> Any:
        """A state with these values."""
        state = getattr(self.module, self.symbols.state_class)()
        self.put(state, snapshot)
        return state

    def put(self, state: Any, values: Snapshot) -> None:
        """Sets leaves of a state."""
        for name, value in values.items():
            setattr(state, self.symbols.leaves[name].attribute, value)

    def leaves(self, state: Any) -> dict[str, Value]:
        """Every leaf of a state."""
        return {name: getattr(state, leaf.attribute) for name, leaf in self.symbols.leaves.items()}

    def initial(self) -> dict[str, Value]:
        """A new state's leaves."""
        return self.leaves(getattr(self.module, self.symbols.state_class)())

    def run(self, target: ComparedFunction, session: Stimuli) -> list[Seen]:
        """Runs a session; the state is carried from cycle to cycle."""
        function, state = self.function(target), self.state(session.start)
        seen = []
        for readings in session.readings:
            self.put(state, readings)
            try:
                seen.append(self.seen(function(state), state))
            except Exception as error:  # noqa: BLE001  # whatever it raises is a finding
                seen.append(Seen(RAISED, f"raised {error!r}", -1, (), self.leaves(state)))
        return seen

    def seen(self, fault: int, state: Any) -> Seen:
        """The state after a cycle in the common words."""
        words = [getattr(state, word) for word in self.symbols.failed]
        names = enumerate(monitored(self.program))
        failed = tuple(name for at, name in names if words[at // 64] >> at % 64 & 1)
        at = fault_named(self.program, self.symbols, fault, state.fault_at)
        line = state.line if fault in (Fault.OK, Fault.EXTERN) else -1
        if fault != state.fault:
            at = f"returned {fault}, kept {state.fault}"
        return Seen(fault, at, line, failed, self.leaves(state))

    def line(self, target: ComparedFunction, snapshot: Snapshot) -> int:
        """What the emitted `line` or `lines` function gives."""
        if target.kind == "batch":
            line, other = self.function(target)([self.state(snapshot), self.state(snapshot)])
            return int(line) if line == other else -7
        return int(self.function(target)(self.state(snapshot)))


def python_executor(
    program: Program, symbols: Symbols, files: Mapping[str, str], stand_ins: PythonStandIns
) -> PythonUnderTest:
    """The emitted Python of a program, ready to run.

    Args:
        program: The program.
        symbols: Names in its emitted files.
        files: The emitted files, text by path.
        stand_ins: Stand-ins for the program's externs.
    """
    text = text_of(symbols.module, files)
    module = stand_ins.load(text, f"rcsc_tested_{symbols.program}")
    return PythonUnderTest(program, symbols, module)

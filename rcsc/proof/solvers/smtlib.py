"""A second solver to put questions to: cvc5, which has no part in any proof. The only importer of cvc5."""

from typing import Any

from rcsc.base.host.children import interruptible

CVC5_STEPS = 20_000_000
"""Budget of cvc5 a question, in its own resource units, of which it uses about a million a second."""


def cvc5_refutes(text: str, steps: int = CVC5_STEPS) -> bool:
    """Return whether cvc5 finds the script unsatisfiable within so many of its resource units; false where it is not installed."""
    return cvc5_says(text, steps) == "unsat"


def cvc5_says(text: str, steps: int = CVC5_STEPS) -> str:
    """Return cvc5's last answer to the script; "" where cvc5 is not installed, or fails."""
    try:
        import cvc5  # type: ignore[import-untyped, unused-ignore]  # optional, and heavy to load
    except ImportError:
        return ""
    solver: Any = cvc5.Solver()
    solver.setOption("rlimit-per", str(steps))
    solver.setOption("tlimit-per", str(steps // 50))  # ms: a backstop, twenty times what the steps take
    reader: Any = cvc5.InputParser(solver)
    reader.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, text, "question")
    symbols = reader.getSymbolManager()
    answer = ""
    try:
        with interruptible():
            while not (command := reader.nextCommand()).isNull():
                answer = command.invoke(solver, symbols)
    except RuntimeError:
        return ""
    return str(answer).strip()

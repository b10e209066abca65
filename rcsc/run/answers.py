"""Give executors the answers of extern procedures in the run of a finding, instead of the user's functions.

In: the answers of one cycle, as (procedure, results). Executors that were made for a finding call `of_NAME` here in Python, and in C
functions that read the same results from `rcsc_answers` (`stand_ins`).
"""

import ctypes
import struct
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeAlias

from rcsc.run.executors import CExecutor, Executor
from rcsc.run.signature import FORMATS, REALS, Value, c_range

Answers: TypeAlias = Sequence[tuple[str, tuple[Value, ...]]]

MOST = 4096
"""Results of one cycle that a C executor can be told."""
MODULE, OF = __name__, "of_"
HEAD = f"""
#include <string.h>
__attribute__((weak)) uint64_t rcsc_answers[{MOST}];
__attribute__((weak)) uint32_t rcsc_answer;
"""
_left: list[tuple[str, tuple[Value, ...]]] = []


def __getattr__(name: str) -> Callable[..., Any]:
    """Return the function of an extern procedure, which returns its next recorded answer.

    Raises:
        AttributeError: The name is none of an extern procedure.
    """
    if not name.startswith(OF):
        raise AttributeError(name)

    def answer(*_args: Value) -> Any:
        at = next((at for at, (procedure, _) in enumerate(_left) if procedure == name.removeprefix(OF)), None)
        if at is None:
            raise LookupError(f"nothing is said of what `{name.removeprefix(OF)}` gives here")
        results = _left.pop(at)[1]
        return results[0] if len(results) == 1 else results

    return answer


def told(executor: Executor, answers: Answers) -> None:
    """Give these answers to the executor's next cycle."""
    _left[:] = answers
    if isinstance(executor, CExecutor):
        words = [_word(value) for _, results in answers for value in results][:MOST]
        executor.write("rcsc_answers", (ctypes.c_uint64 * MOST)(*words))
        executor.write("rcsc_answer", ctypes.c_uint32(0))


def _word(value: Value) -> int:
    """Return the 64 bits of a value."""
    if isinstance(value, float):
        (bits,) = struct.unpack("<Q", struct.pack("<d", value))
        return int(bits)
    return int(value) % 2**64


def fits(c_type: str, value: Value) -> bool:
    """Tell whether a C function of the type can return the value."""
    if c_type not in FORMATS or c_type in REALS:
        return True
    low, high = c_range(c_type)
    return bool(low <= value <= high)


def stand_in(function: str, given: Iterable[tuple[str, str]], results: Iterable[tuple[str, str]]) -> str:
    """Return a C stub that replays recorded answers; arguments and results as (type, name)."""
    ins, outs = list(given), list(results)
    parameters = [*(f"{kind} {name}" for kind, name in ins), *(f"{kind} *{name}_out" for kind, name in outs)]
    body = [f"    (void){name};" for _, name in ins]
    for kind, name in outs:
        if kind == "float":
            body.append("    double given;")
            body.append("    (void)memcpy(&given, &rcsc_answers[rcsc_answer], sizeof(double));")
            body.append(f"    *{name}_out = (float)given;")
        elif kind == "double":
            body.append(f"    (void)memcpy({name}_out, &rcsc_answers[rcsc_answer], sizeof(double));")
        else:
            body.append(f"    *{name}_out = ({kind})rcsc_answers[rcsc_answer];")
        body.append(f"    rcsc_answer = (rcsc_answer + 1U) % {MOST}U;")
    return "\n".join(
        [f"__attribute__((weak)) void {function}({', '.join(parameters) or 'void'})", "{", *body, "}\n"]
    )

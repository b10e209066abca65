"""What the published ACQUIRE does when the buffer is empty, cycle by cycle: `python -m tests.published`.

The table of Fig. 8 and the procedures of Fig. 9 as printed, stepped by the reference interpreter (they do not prove, so nothing is
compiled of them), with the protocol of section 9 and a level below that takes two cycles to echo.
"""

from dataclasses import dataclass
from pathlib import Path

from rcsc.lang.interpret import initial, run_table
from rcsc.lang.model import Enum, Program, Value, Variable
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve

FILE = Path(__file__).parents[1] / "tables" / "examples" / "acquire_published.rcs"
ECHO_AFTER = 2
"""Cycles until the level below echoes."""


@dataclass(frozen=True, slots=True)
class Cycle:
    """What one cycle left."""

    line: str
    cur_state: str
    pending: str
    output_command: str
    status_report: str
    failure: str


def published() -> Program:
    """The program of the published listing."""
    loaded = load([str(FILE)])
    program = resolve(loaded.roots[0], loaded)
    assert isinstance(program, Program)
    return program


def empty_buffer(cycles: int = 8) -> list[Cycle]:
    """LOCATE is done and no box top is left: line 7 matches, and PICKUP finds the buffer empty."""
    program = published()
    kinds = {str(v.name): v for v in program.variables}
    begin = {
        "new_command": "false", "ref_command_in": "locate", "status_in": "done", "cur_state": "state_3",
        "cur_state.next": "state_3", "obj_ptr_in": "tbox", "remember_current_loc": "buffer", "old_output_command": "locate",
        "output_command": "locate", "source_spec": "true",
    }  # fmt: skip
    now: dict[str, Value] = {
        **initial(program),
        **{name: _value(kinds[name], word) for name, word in begin.items()},
    }
    now["tbuffer_boxt"] = 0
    found, sent, waited = [], int(now["inc_command_out"]), 0
    for _ in range(cycles):
        outcome = run_table(program, program.tables[0], now)
        now = dict(outcome.snapshot)
        found.append(
            Cycle(
                str(outcome.line),
                *(
                    _word(kinds[name], now[name])
                    for name in ("cur_state", "cur_state.next", "output_command", "status_report", "failure")
                ),
            )
        )
        if now["output_command"] != now["old_output_command"]:
            sent, waited = sent + 1, 0
        now |= {"old_output_command": now["output_command"], "inc_command_out": sent}
        waited += 1
        if waited >= ECHO_AFTER:  # the level below has seen the order: it works on it, then it is done
            status = "executing" if waited < 2 * ECHO_AFTER else "done"
            now |= {
                "inc_command_echo_in": sent,
                "ref_command_in": now["output_command"],
                "status_in": _value(kinds["status_in"], status),
            }
    return found


def _value(variable: Variable, word: str) -> Value:
    return variable.type.members.index(word) if isinstance(variable.type, Enum) else word == "true"


def _word(variable: Variable, value: Value) -> str:
    return variable.type.members[int(value)] if isinstance(variable.type, Enum) else str(value)


def main() -> None:
    """Prints the cycles."""
    print(f"{'cycle':>5}  {'line':5}{'cur_state':12}{'pending':12}{'command':10}{'status':11}failure")
    for at, cycle in enumerate(empty_buffer(), 1):
        print(
            f"{at:5}  {cycle.line:5}{cycle.cur_state:12}{cycle.pending:12}{cycle.output_command:10}{cycle.status_report:11}{cycle.failure}"
        )


if __name__ == "__main__":
    main()

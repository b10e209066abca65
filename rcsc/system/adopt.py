"""How a level starts that has lost its state: what stands in its buffers is old, and PAUSE goes down.

In: a signature and values: an initial state with the inputs as the buffers hold them now; its own orders that stand. Out: values to
start from.
The convention of the tables: input `command` with `inc_command`, state `inc_command_seen`, orders named `to_NAME`, and the input
`NAME` that echoes them.
"""

from collections.abc import Mapping

from rcsc.system.buffers import Buffers
from rcsc.system.levels import RunningLevel
from rcsc.system.signature import Signature, Value, Values

NUMBERS = 65536
ORDER = "to_"
# How an order is numbered, and where the level below repeats the number; the camera's pictures are numbered, too.
ECHOES = {"inc_command": "inc_command_echo", "number": "number"}
# A member, by its name, for a state; the failure stands until the next command.
FAILED = {
    "status_report": "failed",
    "failure": "restart",
    "cur_state": "f_state",
    "cur_state.next": "f_state",
}


def standing(level: RunningLevel, buffers: Buffers) -> dict[int, Value]:
    """What a level's own orders and reports say that still stand in the buffers, by the positions of the leaves."""
    return {
        give.first + at: value
        for give in level.gives
        for at, value in enumerate(buffers.latest(give.buffer) or ())
    }


def adopt(sign: Signature, values: Values, stands: Mapping[int, Value] | None = None) -> Values:
    """The values with which a level starts safely, whatever is in its buffers.

    The order in the command buffer counts as seen, and has failed; each level below gets PAUSE with a number that no order had
    before: the next after the order that stands, which it may not have echoed yet; after what it echoed where none stands. What a
    program has no variable for is left as it is.

    Args:
        sign: The level's program.
        values: All leaves and the trace; states and outputs initial.
        stands: What its own buffers hold, of `standing`.
    """
    now = list(values)
    for name, member in FAILED.items():
        at = sign.index.get(name)
        if at is not None and member in sign.leaves[at].members:
            now[at] = sign.leaves[at].members.index(member)
    if "inc_command_seen" in sign.index and "command.inc_command" in sign.index:
        now[sign.index["inc_command_seen"]] = now[sign.index["command.inc_command"]]
    for at, leaf in enumerate(sign.leaves):
        if leaf.kind == "output" and leaf.name.startswith(ORDER):
            now[at] = _order(sign, leaf.name, now, at, stands or {})
    return tuple(now)


def _order(sign: Signature, name: str, now: list[Value], at: int, stands: Mapping[int, Value]) -> Value:
    """What a leaf of an order starts with: a number not yet echoed, the first command, which rests; the others stay."""
    record, _, part = name.partition(".")
    if part == "input_command":
        return 0
    echo = sign.index.get(f"{record.removeprefix(ORDER)}.{ECHOES.get(part, '')}")
    return now[at] if echo is None else (int(stands.get(at, now[echo])) + 1) % NUMBERS

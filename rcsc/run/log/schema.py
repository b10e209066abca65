"""Describe a log in itself: the layout of each message for other tools, and each level's signature for rcsc.

In: signatures and descriptions. Out: their texts, and back. The canonical bytes of a state (little-endian, unpadded, in
order) are at the same time a ROS 1 message of plain fields, so that any viewer of MCAP files decodes them.

Source: MCAP specification, registry of well-known encodings (`ros1`, `ros1msg`); ROS 1 `msg` format.
"""

import hashlib
import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import IntEnum
from pathlib import Path

from rcsc.base.host.files.names import file_name, shown
from rcsc.base.host.files.read import CheckedFields, content, json_of
from rcsc.run.adopt import Begun
from rcsc.run.description import LONGEST_MS, MOST_LEVELS, Description, LevelSpec, Wire, level_of, wire_of
from rcsc.run.signature import FORMATS, Leaf, Signature, generated_files, restart_written, signature_of

FORMAT = "1"
SYSTEM, PROGRAMS = "rcsc.system", "rcsc.programs"
"""Names of the metadata records."""
SIGNATURE = "rcsc.signature"
"""Key of a level's channel that holds its program's signature."""
LEVELS, BUFFERS, RESTARTS = "/levels/", "/buffers/", "/restarts/"
GAPS, TAKEN = "/gaps/", "/taken/"
"""How the topics of channels begin; the last two are of levels that run in processes of their own."""
EVENTS = "/events"
"""The topic of what became of processes."""

ROS = {
    "bool": "bool", "uint8_t": "uint8", "int8_t": "int8", "uint16_t": "uint16", "int16_t": "int16",
    "uint32_t": "uint32", "int32_t": "int32", "uint64_t": "uint64", "int64_t": "int64", "double": "float64", "float": "float32",
}  # fmt: skip
"""Types of leaves as messages name them."""
_TRACE_FIELDS = (
    "int32 line # place of the line in its table, from 0; -1 for none",
    "int32 fault # 0 for none",
    "int32 fault_at # place of the leaf that was refused; -1 for none",
)
_FAILED_FIELD = "uint64 {} # one bit an assumption that is checked"


def message_definition(leaves: Sequence[Leaf], failed: Sequence[str] | None = None) -> str:
    """The fields of a message, one a line, an enumeration's members as constants before it.

    Args:
        leaves: What the message holds.
        failed: Words of failed assumptions; with them the trace comes after the leaves.
    """
    rows = [row for leaf in leaves for row in _field(leaf)]
    if failed is not None:
        rows += [*_TRACE_FIELDS, *map(_FAILED_FIELD.format, failed)]
    return "\n".join(rows) + "\n"


def _field(leaf: Leaf) -> Iterable[str]:
    kind, name = ROS[leaf.c_type], leaf.attribute
    for value, member in enumerate(leaf.members):
        yield f"{kind} {name.upper()}_{member.upper()}={value}"
    comment = " ".join(f"{leaf.name} ({leaf.kind}{', ' + leaf.unit if leaf.unit else ''}) {leaf.doc}".split())
    yield f"{kind} {name} # {comment}"


def restart_topic(begun: Begun, level: str) -> str:
    """The channel of a level's restarts of one kind: `/restarts/anew/task`."""
    return f"{RESTARTS}{begun.value}/{level}"


def restart_of(topic: str) -> tuple[Begun, str]:
    """Return the parts of a `restart_topic`.

    Raises:
        ValueError: A kind that this version does not know.
    """
    begun, _, level = topic.removeprefix(RESTARTS).partition("/")
    return Begun(begun), level


class Gap(IntEnum):
    """The reason why a log has no record of a cycle that a level's period has."""

    NOT_RUN = 0  # the level had no cycle then
    UNSEEN = 1  # it had, and what it left could not be read


GAP_FIELDS = "uint8 why # 0: the level had no cycle then; 1: it had, and what it left could not be read\n"
EVENT_FIELDS = "string process\nstring what\n"


@dataclass(frozen=True, slots=True)
class LoggedEvent:
    """What became of a process.

    Attributes:
        tick: That of the cycle that was its next.
    """

    tick: int
    process: str
    what: str

    @property
    def content(self) -> bytes:
        """The content of its message."""
        texts = [text.encode() for text in (self.process, self.what)]
        return b"".join(len(text).to_bytes(4, "little") + text for text in texts)


def event_of(tick: int, content: bytes) -> LoggedEvent:
    """Return the event of a message.

    Raises:
        ValueError: It is none.
    """
    texts, rest = [], content
    for _ in range(2):
        size = int.from_bytes(rest[:4], "little")
        texts.append(rest[4 : 4 + size].decode())
        rest = rest[4 + size :]
    event = LoggedEvent(tick, *texts)
    if event.content != content or not all(text.isprintable() for text in texts):
        raise ValueError(f"{shown(repr(content)[:40])} is no event")
    return event


def taken_layout(buffers: Sequence[str]) -> tuple[str, struct.Struct]:
    """Return the fields of the message that says of which ticks the buffers were that a level took, and its layout."""
    fields = [
        f"uint64 {name.replace('.', '_')} # the tick in which {name} was given; 0 for none\n"
        for name in buffers
    ]
    return "".join(fields), struct.Struct(f"<{len(buffers)}Q")


def message_format(leaves: Iterable[Leaf]) -> str:
    """The same for `struct`, without the trace."""
    return "<" + "".join(FORMATS[leaf.c_type] for leaf in leaves)


def compact(value: object) -> str:
    """A value as JSON, always the same text for the same value."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False)


def signature_text(sign: Signature) -> str:
    """A signature as text."""
    written = asdict(sign)
    del written["restart"]
    if sign.serves is None:
        del written["serves"]
    for key in ("unset", "sees"):
        if not written[key]:
            del written[key]
    for level in written["levels"]:
        if not level["stages"]:
            del level["stages"]
    declared = restart_written(sign)
    return compact({**written, **({"restart": declared} if declared is not None else {})})


def signature_from(text: str) -> Signature:
    """A signature from its text.

    Raises:
        Malformed: It is none.
    """
    return signature_of(CheckedFields(json_of(text), "signature"))


def system_facts(system: Description) -> dict[str, str]:
    """Return the description without its paths, which differ between machines."""
    return {
        "format": FORMAT,
        "name": system.name,
        "tick_ms": str(system.tick_ms),
        "levels": compact([_level(level) for level in system.levels]),
        "wires": compact([[wire.source, wire.target] for wire in system.wires]),
    }


def _level(level: LevelSpec) -> dict[str, object]:
    """Return a level as a log has it: only an instance says of which tables, with which constants."""
    return {name: value for name, value in asdict(level).items() if value or name == "feeds"}


def system_of(facts: Mapping[str, str], generated: Path, database: Path) -> Description:
    """The description again, with paths of here.

    Raises:
        KeyError, TypeError, ValueError: The facts are none.
    """
    if facts["format"] != FORMAT:
        raise ValueError(f"format {facts['format']}, not {FORMAT}")
    levels = tuple(
        map(level_of, CheckedFields({"levels": json_of(facts["levels"])}).each("levels", MOST_LEVELS))
    )
    wires = tuple(wire_of(source, target) for source, target in json_of(facts["wires"]))
    tick_ms = CheckedFields({"tick_ms": int(facts["tick_ms"])}).whole("tick_ms", 1, LONGEST_MS)
    return Description(file_name(facts["name"], "name"), generated, database, tick_ms, levels, wires)


def fingerprints(system: Description) -> dict[str, str]:
    """Return a digest of everything generated for each program: equal digests, equal tables."""
    digests = {}
    for program in sorted({level.program for level in system.levels}):
        digest = hashlib.sha256()
        for path in generated_files(system.generated, program):
            text = content(path) if path.is_file() else b""
            digest.update(f"{path.parent.name}/{path.name} {len(text)}\n".encode() + text)
        digests[program] = digest.hexdigest()
    return digests


def outside_wires(system: Description) -> tuple[Wire, ...]:
    """The buffers that no level fills, each once, with its first reader."""
    levels = {level.name for level in system.levels}
    return tuple(
        Wire(source, targets[0])
        for source, targets in system.readers().items()
        if source.partition(".")[0] not in levels
    )

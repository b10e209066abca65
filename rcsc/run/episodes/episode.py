"""An episode: one run of a system with all that happens to it from outside, as a value.

In: orders, and what goes wrong from which tick to which. Out: the same as JSON and, without what goes wrong, as a script for `rcsc run`.
An episode has the same outcome in every process, and with both kinds of executors.
"""

import json
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass
from itertools import chain
from random import Random
from typing import ClassVar, Literal, Self, TypeAlias, get_args, get_type_hints

from rcsc.base.host.files import csv_text
from rcsc.base.host.files.names import shown
from rcsc.base.host.files.plain import plain, read
from rcsc.base.host.files.read import json_of
from rcsc.run.system import Kind

Harm = Literal["lost", "late", "doubled", "stale"]
FAULTS = {
    "lost": "a buffer: what is published in some cycles never arrives, and the value before stays",
    "late": "a buffer: values arrive some cycles late, in order",
    "doubled": "a buffer: each value is read in two cycles, and every other one never",
    "stale": "a buffer: an older value comes again, which breaks what the protocol promises",
    "reading": "a field from outside: it holds a value of its range's or a table's edge, whatever the plant says",
    "refused": "a field from outside: it holds a value that the level refuses",
    "restarted": "a level: it loses its state, and starts anew",
    "changed order": "an order: it comes before the one before it has ended",
}
"""Classes of faults that follow from declarations; those of a plant come by their names."""
Setting: TypeAlias = bool | int | float | str
"""A value as a script has it: an enumeration's member by its name."""
MOST_TICK = 2_000_000
MOST_ELEMENTS = 10_000


@dataclass(frozen=True, slots=True)
class FieldValue:
    """A field of an order, by its name in the record."""

    name: str
    value: Setting


@dataclass(frozen=True, slots=True)
class OrderSpec:
    """An order from outside.

    Attributes:
        level: Who is ordered.
        command: By its member's name.
        fields: Those that are not as the variable is at first.
        wait: Ticks after the end of the order before it to the same level; 0 is at its very end.
        interrupts: It comes `wait` ticks after the one before was given, whether that has ended or not.
        faults: The plant's faults that are on while it is under way.
    """

    level: str
    command: str
    fields: tuple[FieldValue, ...] = ()
    wait: int = 0
    interrupts: bool = False
    faults: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class BufferFault:
    """What happens to a buffer, named by its source, in these ticks, the last included; `ticks` is how late, or how old, a value is."""

    buffer: str
    kind: Harm
    first_tick: int
    last_tick: int
    ticks: int = 3


@dataclass(frozen=True, slots=True)
class Reading:
    """A field from outside holds a value in these ticks, the last included.

    Attributes:
        field: Named as a column of a script is, `base.bumper`.
        refused: Whether the value is one that the level must refuse.
    """

    field: str
    value: Setting
    first_tick: int
    last_tick: int
    refused: bool = False


@dataclass(frozen=True, slots=True)
class Restart:
    """A level loses its state before it runs in this tick."""

    tick: int
    level: str


@dataclass(frozen=True, slots=True)
class Switch:
    """A fault of the plant's own is on in these ticks, the last included."""

    fault: str
    first_tick: int
    last_tick: int


class SavedEpisode:
    """An episode that travels as JSON; a frozen dataclass of plain values and tuples.

    Attributes:
        LISTS: Its fields that hold any number of things, those first that a smaller episode can best do without.
    """

    __slots__ = ()
    LISTS: ClassVar[tuple[str, ...]]

    def to_json(self) -> str:
        """Return text that `from_json` reads; the same for the same episode."""
        return json.dumps(plain(self), indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read an episode that `to_json` wrote; what is missing is as usual.

        Raises:
            ValueError: The text is none.
        """
        values = json_of(text)
        if not isinstance(values, dict):
            raise ValueError("no episode: no table of names and values")  # noqa: TRY004  # what was read, not what was called
        if stray := sorted(set(values) - set(usual := plain(cls()))):
            raise ValueError(f"an episode has no {shown(stray[0])}")
        for name, kind in get_type_hints(cls).items():
            if name in cls.LISTS and isinstance(values.get(name), list):
                values[name] = [_filled(get_args(kind)[0], element) for element in values[name]]
        episode: Self = read(cls, {**usual, **values})
        return episode


def _filled(kind: type, element: object) -> object:
    """Return an element of a list as it was read, with the defaults of what it does not say."""
    if not isinstance(element, dict) or not is_dataclass(kind):
        return element
    return {
        field.name: plain(field.default) for field in fields(kind) if field.default is not MISSING
    } | element


@dataclass(frozen=True, slots=True)
class Episode(SavedEpisode):
    """One run.

    Attributes:
        plant: What stands outside, as `--plant` names it; empty for the description's first.
        seed: For a plant that takes one.
        ticks: The run takes so many at least.

    Raises:
        ValueError: A word that is none, or a number out of reach.
    """

    LISTS: ClassVar[tuple[str, ...]] = ("switches", "readings", "restarts", "harms", "orders")
    PLAINER: ClassVar[tuple[str, ...]] = ()

    plant: str = ""
    executor: Kind = "c"
    seed: int = 0
    orders: tuple[OrderSpec, ...] = ()
    harms: tuple[BufferFault, ...] = ()
    readings: tuple[Reading, ...] = ()
    restarts: tuple[Restart, ...] = ()
    switches: tuple[Switch, ...] = ()
    ticks: int = 0

    def __post_init__(self) -> None:
        """Refuse what no episode can be."""
        words = ((self.executor, get_args(Kind)), *((harm.kind, get_args(Harm)) for harm in self.harms))
        for word, known in words:
            if word not in known:
                raise ValueError(f"{shown(word)} is none of {', '.join(known)}")
        if not 0 <= self.seed < 2**64:
            raise ValueError(f"the seed {self.seed} lies outside 0 .. {2**64 - 1}")
        if any(len(getattr(self, name)) > MOST_ELEMENTS for name in self.LISTS):
            raise ValueError(f"more than {MOST_ELEMENTS} elements in a list")
        for name, number in self._ticks():
            if not 0 <= number <= MOST_TICK:
                raise ValueError(f"`{name}` is {number}, and lies between 0 and {MOST_TICK}")
        windows: tuple[BufferFault | Reading | Switch, ...] = (*self.harms, *self.readings, *self.switches)
        for window in windows:
            if window.first_tick > window.last_tick:
                raise ValueError(f"a window from tick {window.first_tick} to {window.last_tick} has no tick")

    def _ticks(self) -> Iterator[tuple[str, int]]:
        """Yield every number of ticks in it, by the name of its field."""
        yield "ticks", self.ticks
        for element in chain.from_iterable(getattr(self, name) for name in self.LISTS):
            for name in ("wait", "ticks", "tick", "first_tick", "last_tick"):
                if hasattr(element, name):
                    yield name, getattr(element, name)

    def told(self) -> tuple[str, ...]:
        """Return the events of the episode in words, a line each."""
        return (
            *(
                _order_told(order, first=all(order.level != before.level for before in self.orders[:at]))
                for at, order in enumerate(self.orders)
            ),
            *map(harm_told, self.harms),
            *(
                f"{window_told(reading)}: `{reading.field}` = {_cell(reading.value)}"
                for reading in self.readings
            ),
            *(
                f"before tick {restart.tick}: level `{restart.level}` starts anew"
                for restart in self.restarts
            ),
            *(f"{window_told(switch)}: the plant's fault `{switch.fault}`" for switch in self.switches),
        )

    def script(self) -> str:
        """Return its orders as a script that `rcsc run --script` reads, one after the other."""
        columns = list(dict.fromkeys(field.name for order in self.orders for field in order.fields))
        several = len({order.level for order in self.orders}) > 1
        faulty = any(order.faults for order in self.orders)
        head = [
            "command",
            *(["level"] if several else []),
            *columns,
            "cycles",
            *(["fault"] if faulty else []),
        ]
        rows: list[list[Setting]] = [[*head]]
        for at, order in enumerate(self.orders):
            after = self.orders[at + 1] if at + 1 < len(self.orders) else None
            given = {field.name: _in_file(field.value) for field in order.fields}
            if order.wait and not order.interrupts:
                waits = ["", *([""] if several else []), *("" for _ in columns), str(order.wait)]
                rows.append([*waits, *([""] if faulty else [])])
            cycles = str(max(after.wait, 1)) if after is not None and after.interrupts else ""
            level = [order.level] if several else []
            ends = [cycles, *([" ".join(order.faults)] if faulty else [])]
            rows.append([order.command, *level, *(given.get(name, "") for name in columns), *ends])
        return csv_text(rows)


def by_seed(seed: int) -> Random:
    """Return what draws the episode of a seed."""
    return Random(f"episode {seed}")  # noqa: S311  # repeatable on purpose


def happens(random: Random, share: float) -> bool:
    """Whether something happens that does in this share of all cases; the simplest answer is no.

    Whole numbers alone are drawn: floats Hypothesis takes from edges, and copies from one place to another.
    """
    return random.randrange(_PARTS) >= round(_PARTS * (1 - share))


_PARTS = 100
"""Into which chances are divided: Hypothesis draws small numbers more often where there are more of them."""


_HARMS = {
    "lost": "loses what is published",
    "late": "is late",
    "doubled": "gives each value twice",
    "stale": "gives older values again",
}


def harm_told(harm: BufferFault) -> str:
    """Say what happens to a buffer, and when."""
    return f"{window_told(harm)}: buffer `{harm.buffer}` {_HARMS[harm.kind]}"


def window_told(window: BufferFault | Reading | Switch) -> str:
    """Return the ticks of a window in words."""
    if window.first_tick == window.last_tick:
        return f"tick {window.first_tick}"
    return f"ticks {window.first_tick} .. {window.last_tick}"


def _order_told(order: OrderSpec, *, first: bool) -> str:
    fields = "".join(f" {field.name}={_cell(field.value)}" for field in order.fields)
    after = (
        "the beginning"
        if first
        else "the order before it"
        if order.interrupts
        else "the end of the one before"
    )
    faults = "".join(f", with the plant's fault `{fault}`" for fault in order.faults)
    return f"`{order.level}` is ordered `{order.command}`{fields}, {order.wait} ticks after {after}{faults}"


def _in_file(value: Setting) -> Setting:
    """Return a value as a file's writer takes it: numbers as they are, for a text that begins with a sign would be a formula."""
    return _cell(value) if isinstance(value, bool | str) else value


def _cell(value: Setting) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)

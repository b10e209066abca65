"""What two levels say to each other, and a level that is to be written."""

from dataclasses import dataclass, field

STATUS = "  status : status done done failed failed executing executing\n"


OTHER_STATUS = "  status : status done done failed executing executing failed\n"


@dataclass(frozen=True, slots=True)
class Link:
    """What two levels say to each other: fields of the order, a stream in it, and one in the report.

    Attributes:
        twice: Whether both ends declare it; `differs`, whether they do so otherwise.
    """

    at: int
    commands: tuple[str, ...]
    field_: bool = False
    stream: bool = False
    flow: bool = False
    twice: bool = False
    differs: str = ""

    @property
    def name(self) -> str:
        return f"k{self.at}"

    @property
    def rest(self) -> str:
        return self.commands[0]

    @property
    def fields(self) -> tuple[str, ...]:
        """The fields of its order, streams too."""
        return (*(["k"] if self.field_ else []), *(["sp"] if self.stream else []))

    def text(self, differs: str = "") -> str:
        """Its declaration, perhaps as another one has it."""
        fields = [*(["k : bool"] if self.field_ else []), *(["stream sp : bool"] if self.stream else [])]
        if differs == "stream":
            fields = [
                one.replace("stream ", "") if one.startswith("stream") else f"stream {one}" for one in fields
            ]
        order = f"  order {{ {' '.join(fields)} }}\n" if fields else ""
        flow = " stream flow : bool" if self.flow else ""
        rest = self.commands[1] if differs == "rest" else self.rest
        status = OTHER_STATUS if differs == "status" else STATUS
        why = "why : why restart begun_anew" if differs != "restart" else "why : why"
        reason = "reason " if differs != "reason" else ""
        return (
            f"link {self.name} {{\n  command : c{self.at} rest {rest}\n{status}{order}"
            f"  report {{ {reason}{why}{flow} }}\n}}\n"
        )

    @property
    def ways_to_differ(self) -> tuple[str, ...]:
        """How its other declaration may differ."""
        more = ("stream",) if self.stream or self.field_ else ()
        return ("status", "restart", "reason", *more)


@dataclass
class Plan:
    """A level that is to be written.

    Attributes:
        link: To its superior; None where it takes no orders, and `peer`, the superior's name.
        below: Its subordinates, each with its link.
        calm: Whether it states nothing that is likely to break: else endings are not looked at.
        gives: Plain outputs that lead to other levels; `takes`, plain inputs from them.
        parts: What it has, in words: the kinds that a system shows.
    """

    name: str
    link: Link | None
    peer: str
    below: tuple[tuple[str, Link], ...]
    declared: bool
    calm: bool = False
    gives: list[str] = field(default_factory=list)
    takes: list[str] = field(default_factory=list)
    parts: set[str] = field(default_factory=set)


@dataclass(frozen=True, slots=True)
class Drawn:
    """A system as text.

    Attributes:
        differs: How two declarations of one link differ; blank where they do not: then there is an error.
        kinds: What is in it, in words.
    """

    files: tuple[tuple[str, str], ...]
    differs: str
    kinds: frozenset[str]
    slips: tuple[str, ...]

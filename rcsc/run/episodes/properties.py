"""What holds in every cycle of every episode: no state-table error, assumptions, the protocol, ends, the user's own properties.

In: a stand and a plant. Out: a `Property` for each. Those of the tables are evaluated by the reference interpreter.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from rcsc.lang import model
from rcsc.lang.interpret import UNDEFINED, holds
from rcsc.lang.leaves import read_by, spoken_of
from rcsc.lang.model import BEFORE, Value
from rcsc.run.episodes.across import AcrossHolds
from rcsc.run.episodes.cycle import Broken, Cycle, Property
from rcsc.run.episodes.operator import Given
from rcsc.run.episodes.proved.claims import NOTHING, Claims
from rcsc.run.episodes.proved.watch import ProvedHolds
from rcsc.run.episodes.stand import Stand
from rcsc.run.executors import Twins
from rcsc.run.levels import RunningLevel
from rcsc.run.log.required import LevelWatch, watch_of
from rcsc.run.orders.roles import Served, field_of
from rcsc.run.plant.bind import BoundPlant, raised
from rcsc.run.signature import FAULTS, STOPPED, Signature, Values

REFUSED = FAULTS.index("input refused")
NO_ERROR = "no state-table error"
REFUSES = "refuses what lies out of range"
ENDS = "every command ends"
AGREE = "C and Python do the same"


class ExecutorsAgree:
    """The C and the Python of a level leave the same of every cycle, where both run."""

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield each level of which they do not, with the first value that differs."""
        for level in cycle.ran:
            if isinstance(level.executor, Twins) and level.executor.difference:
                yield Broken(
                    AGREE, f"level `{level.name}`, {level.ran}: {level.executor.difference}", level.name
                )


class NoStateTableError:
    """Exactly one line of each table matches, and no input is refused that lies in its range."""

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield each level that met a fault, with the fault."""
        for level in cycle.ran:
            if level.fault not in (0, STOPPED) and not was_refused(cycle, level):
                text = f"level `{level.name}`, table `{level.table}`: {level.sign.fault_text(level.values)}"
                yield Broken(NO_ERROR, text, level.name)


def was_refused(cycle: Cycle, level: RunningLevel) -> bool:
    """Whether the level refused what the episode gives it to refuse."""
    return level.fault == REFUSED and level.sign.fault_at(level.values) in cycle.refused.get(level.name, ())


class Refuses:
    """A level refuses a value out of range, and nothing but its inputs changes."""

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield each value that was taken, and each change."""
        for level in cycle.ran:
            leaves = cycle.refused.get(level.name)
            if not leaves:
                continue
            if level.fault != REFUSED:
                name = min(leaves)
                yield Broken(REFUSES, f"level `{level.name}` took `{name}` = {level.value(name)}", level.name)
            elif changed := _changed(level, cycle.before[level.name]):
                yield Broken(REFUSES, f"level `{level.name}` changed `{changed}` in that cycle", level.name)


def _changed(level: RunningLevel, before: Values) -> str:
    """Return a leaf that is no input and has another value now; an output that is safe may have."""
    for leaf, was, now in zip(level.sign.leaves, before, level.values, strict=False):
        if leaf.kind == "state" and was != now:
            return leaf.name
    return ""


class AssumptionsHold:
    """What the proofs take for granted and the executors check is so."""

    def __init__(self, stand: Stand) -> None:
        self._reads = {
            (name, str(assumption.name)): tuple(dict.fromkeys(map(str, read_by(assumption.condition))))
            for name, program in stand.programs.items()
            for assumption in program.assumptions
        }

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield the assumptions that failed, with the values."""
        for level in cycle.ran:
            if level.fault in (0, STOPPED):
                for name in level.sign.failures(level.values):
                    reads = self._reads.get((level.name, name), ())
                    where = f"level `{level.name}`, {level.ran}"
                    message = f"{where}: {shown(level.sign, level.values, reads)}"
                    yield Broken(f"{level.name}: assumption {name}", message, level.name, reads)


@dataclass(slots=True)
class LevelProperty:
    """A property that a program declares, or that comes with the protocol.

    Attributes:
        now, before: Where what it reads stands among the level's values, and what it reads of the cycle before.
        held: The values that it was asked about last, where it held: most cycles change none of them.
    """

    level: str
    property: model.Property
    now: Mapping[str, int]
    before: Mapping[str, int]
    held: list[Value] | None = None

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield the values on which it does not hold; what a refused cycle left of inputs alone breaks nothing."""
        level = cycle.levels[self.level]
        if level not in cycle.ran or level.fault:
            return
        values, left, taken = level.values, cycle.left[self.level], cycle.before[self.level]
        read = [*(values[at] for at in self.now.values()), *(left[at] for at in self.before.values())]
        if read == self.held:
            return
        what = self._wrong(values, left)
        if what is None or (left != taken and self._wrong(values, _inputs_of(level, taken, left)) is None):
            self.held = read if what is None else None
            return
        leaves = level.sign.leaves
        words = [f"`{name}` = {leaves[at].shown(values[at])}" for name, at in self.now.items()]
        words += [f"`{name}` = {leaves[at].shown(left[at])}" for name, at in self.before.items()]
        where = level.ran if level.level.stages else f"line `{level.line}`"
        text = f"`{self.property.text}` is false in {where}: {what}{', '.join(words)}"
        yield Broken(f"{self.level}: {self.property.name}", text, self.level)

    def _wrong(self, values: Values, earlier: Values) -> str | None:
        """Return why it does not hold: blank where it is false, why it is not defined; None where it holds."""
        snapshot: dict[str, Value] = {name: values[at] for name, at in self.now.items()}
        snapshot |= {name: earlier[at] for name, at in self.before.items()}
        try:
            return None if holds(self.property.condition, snapshot) else ""
        except UNDEFINED as error:
            return f"not defined ({error}): "


@dataclass(slots=True)
class LevelRequirement:
    """What a program requires over time, or assumes of what comes from outside: where that is broken, no level is at fault.

    Each cycle of the level is one of the run, a refused one, too.
    """

    level: str
    its: LevelWatch

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield the values of the cycle that breaks it."""
        level = cycle.levels[self.level]
        if self.level in cycle.restarted:
            self.its.watch.begin()
        if level in cycle.ran and (shown := self.its.broken(cycle.left[self.level], level.values)):
            yield self._broken(level, shown)

    def _broken(self, level: RunningLevel, shown: str) -> Broken:
        stated = self.its.stated
        if not stated.assumed:
            where = level.ran if level.level.stages else f"line `{level.line}`"
            text = f"`{stated.text}` is broken in {where}: {shown}"
            return Broken(f"{self.level}: {stated.name}", text, self.level)
        text = f"what comes from outside does not keep `{stated.text}`: {shown}"
        inputs = tuple(name for name, at in self.its.reads.items() if level.sign.leaves[at].kind == "input")
        return Broken(f"{self.level}: assumption {stated.name}", text, self.level, inputs, outside=True)


def _inputs_of(level: RunningLevel, taken: Values, left: Values) -> Values:
    """Return what a cycle left, with the inputs that were taken last: a refused one took none."""
    inputs = {at for at, leaf in enumerate(level.sign.leaves) if leaf.kind == "input"}
    return tuple(taken[at] if at in inputs else value for at, value in enumerate(left))


def _of_level(level: str, sign: Signature, stated: model.Property) -> LevelProperty | LevelRequirement:
    if stated.monitor is not None:
        return LevelRequirement(level, watch_of(stated, sign))
    reads = list(map(str, spoken_of(stated)))
    now = {name: sign.index[name] for name in reads if not name.startswith(BEFORE)}
    before = {name: sign.index[name.removeprefix(BEFORE)] for name in reads if name.startswith(BEFORE)}
    return LevelProperty(level, stated, now, before)


@dataclass(slots=True)
class TakesInTurn:
    """A level answers orders that were given to it, each once, in the order in which they were given."""

    link: Served
    at: int
    given: dict[int, int] = field(default_factory=dict)  # when each number was given last
    count: int = 0
    latest: int = -1
    echoed: int = 0

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield an answer to what was never ordered, or to what had been answered before."""
        said, level = cycle.said.get(self.link.order), cycle.levels[self.link.level]
        if said is not None and int(said[self.link.number]) != self.latest:
            self.latest, self.count = int(said[self.link.number]), self.count + 1
            self.given[self.latest] = self.count
        if level not in cycle.ran:
            return
        echo = int(level.values[self.at + self.link.echo])  # a cycle that ends in a fault publishes, too
        if echo not in self.given:
            text = f"`{self.link.report}` answers order {echo}, which `{self.link.order}` never had"
            yield Broken(f"{self.link.level}: answers what was ordered", text, level.name)
        elif self.given[echo] < self.echoed:
            text = f"`{self.link.report}` answers order {echo} again, after a later one"
            yield Broken(f"{self.link.level}: takes each order once", text, level.name)
        else:
            self.echoed = self.given[echo]


@dataclass(slots=True)
class NumbersOrders:
    """A level gives an order that differs from its last one the next number.

    Attributes:
        places: Of the fields that may not change without one.
    """

    link: Served
    places: tuple[int, ...]
    last: Values | None = None

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield the field that changed."""
        was, now = self.last, cycle.said.get(self.link.order)
        self.last = now
        if was is None or now is None or was[self.link.number] != now[self.link.number]:
            return
        leaves = self.link.order_leaves
        for at in (at for at in self.places if was[at] != now[at]):
            field_ = field_of(leaves[at])
            text = (
                f"`{self.link.order}.{field_}` was {leaves[at].shown(was[at])} and is {leaves[at].shown(now[at])} "
                f"in order {now[self.link.number]}"
            )
            yield Broken(f"{self.link.party}: numbers each order", text, self.link.party)


def numbered(stand: Stand, link: Served) -> tuple[int, ...]:
    """Return places of an order's fields that change with its number only: those that its giver does not declare as streams."""
    roles, record = stand.programs[link.party].roles, link.order.partition(".")[2]
    named = None
    for role in () if roles is None else roles.subordinates:
        named = set(map(str, role.numbered)) if role.order == record else named
    fields = {
        at: f"{record}.{field_of(leaf)}" for at, leaf in enumerate(link.order_leaves) if at != link.number
    }
    return tuple(at for at, name in fields.items() if named is None or name in named)


@dataclass(slots=True)
class AnswerStays:
    """What was answered of an order stays until the next, but of the order to rest.

    The standard properties of a level with `roles` leave out an answer that is given in the cycle which takes the order.

    An order that stands when the level starts anew has failed. What `rcsc prove` asks of such a level in every cycle, this asks of each
    that runs, whether or not it was proved; a cycle that a fault ends publishes, too.

    Attributes:
        at: Where the level's report begins among its leaves; `order` is where the order does.
        told: The command of the order taken last; `last`, what was reported of it, or of an older one.
        anew: In which cycle the level started anew last.
    """

    link: Served
    at: int
    order: int
    told: int
    last: tuple[int, str]
    anew: int = 0

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield an answer that changed, with both statuses."""
        link, level = self.link, cycle.levels[self.link.level]
        if level.name in cycle.restarted:
            stood = cycle.before[level.name][self.order : self.order + len(link.order_leaves)]
            self.last, self.told = (int(stood[link.number]), link.failed), int(stood[link.command])
            self.anew = cycle.tick
        if level not in cycle.ran:
            return
        echo = int(level.values[self.at + link.echo])
        status = link.report_leaves[link.status].shown(level.values[self.at + link.status])
        was, told = self.last, self.told
        if level.fault != REFUSED:
            self.last, self.told = (echo, status), int(level.values[self.order + link.command])
        if was[0] != echo or was[1] == status or told == link.rest or told != self.told:
            return
        if was[1] in (link.done, link.failed):
            text = f"order {echo} of `{link.order}` was {was[1]}, and is {status}"
            if self.anew:
                text += f"; the level started anew in cycle {self.anew}: `state NAME : TYPE restart VALUE` says with what"
            yield Broken(f"{link.level}: {was[1]} stays {was[1]}", text, level.name)


@dataclass(slots=True)
class Ends:
    """A command ends in done or failed, in so many cycles in which no fault is at work."""

    most: int
    left: dict[str, int] = field(default_factory=dict)
    known: dict[str, Given] = field(default_factory=dict)

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield each command that is late."""
        for line in cycle.operator.lines:
            name, given = line.served.level, line.given
            if given is None or line.ended is not None:
                self.known.pop(name, None)
                continue
            if self.known.get(name) is not given:
                self.known[name], self.left[name] = given, self.most
            if not cycle.faulty:
                self.left[name] -= 1
            if self.left[name] == 0:
                level = cycle.levels[name]
                text = (
                    f"`{given.text}` has not ended in {self.most} cycles without a fault: line `{level.line}`"
                )
                yield Broken(f"{name}: {ENDS}", text, name)


class PlantHolds:
    """What the plant's own properties say: methods whose result is declared as `Property`."""

    def __init__(self) -> None:
        self._asked: tuple[tuple[BoundPlant, str], ...] | None = None

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield the properties that are false, or raise."""
        if self._asked is None:
            self._asked = tuple((plant, name) for plant in cycle.plants for name in plant.properties)
        for plant, name in self._asked:
            try:
                if getattr(plant.plant, name)():
                    continue
                words = plant.shown()
            except Exception as error:  # noqa: BLE001  # the user's code
                words = raised(error)
            yield Broken(f"plant: {name}", words)


def shown(sign: Signature, values: Values, names: tuple[str, ...]) -> str:
    """Return leaves with their values, in words."""
    return ", ".join(
        f"`{name}` = {sign.leaves[sign.index[name]].shown(values[sign.index[name]])}"
        for name in names
        if name in sign.index
    )


def properties(stand: Stand, within: int, claims: Claims = NOTHING) -> list[Property]:
    """Return everything that watches an episode of a system.

    Args:
        stand: The system.
        within: Cycles without a fault in which every command ends.
        claims: What was proved of the system.
    """
    watching: list[Property] = [ExecutorsAgree(), NoStateTableError(), Refuses(), AssumptionsHold(stand)]
    for name, program in stand.programs.items():
        watching += [_of_level(name, stand.signs[name], stated) for stated in program.stated]
    for link in stand.links:
        sign = stand.signs[link.level]
        at = sign.record(link.report.partition(".")[2]).start
        first = int(link.order_leaves[link.number].initial)
        echo = int(link.report_leaves[link.echo].initial)
        watching.append(TakesInTurn(link, at, {first: 0, echo: 0}))
        if link.party in stand.programs:
            watching.append(NumbersOrders(link, numbered(stand, link)))
        told = int(link.order_leaves[link.command].initial)
        said = echo, link.report_leaves[link.status].shown(link.report_leaves[link.status].initial)
        watching.append(AnswerStays(link, at, sign.index[link.order_leaves[0].name], told, said))
    watching += [AcrossHolds(stand, claims)] if stand.across else []
    proved = [ProvedHolds(claims, stand)] if claims.levels else []
    return [*watching, Ends(within), PlantHolds(), *proved]

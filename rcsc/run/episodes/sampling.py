"""Episodes that are drawn, leaning on edges: orders from the declared commands and ranges, and what goes wrong from the declared buffers.

In: a `Random`. Out: an `Episode`. One in five has no fault; the others have one, or several. A worker makes episode number N of a campaign
from N alone (`by_seed`). Hypothesis gives a `Random` of its own, and so draws every order, fault and tick (`rcsc.run.campaign.search`):
the simplest answers, the first choice, the lowest number and no chance taken, make the simplest episode.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random

from rcsc.base.diagnostics.coded import CodedError
from rcsc.run.episodes.episode import (
    FAULTS,
    BufferFault,
    Episode,
    FieldValue,
    Harm,
    OrderSpec,
    Reading,
    Restart,
    Setting,
    Switch,
    by_seed,
    happens,
)
from rcsc.run.episodes.operator import NO_NUMBER, between, setting_of
from rcsc.run.episodes.stand import Field, Stand, stand, switches
from rcsc.run.orders.roles import Served, field_of
from rcsc.run.orders.script import read_script, script_path
from rcsc.run.signature import Value

NOMINAL, SCRIPTED, PLAIN = 0.2, 0.3, 0.5
"""How often nothing goes wrong, orders are those of a script, and a field is as at first."""
MOST_ORDERS, MOST_FAULTS = 4, 4
LATEST, SOON = 11, 300
"""Binary logarithm of the latest tick at which something begins; half of all begin before `SOON`."""
LASTING = (1, 2, 5, 20, 60, 200)
LONG = (1000, 4000)
"""Ticks of a window: of a buffer, or else of a plant's fault too."""
TOGETHER = 0.5
"""How often a restart comes while an input is refused, or lies outside its range."""
STILL, REFUSED = 0.15, 0.08
"""Where no plant is given: how often a field from outside never moves, and how often a value of it is a refused one."""
PAST = 0.1
"""How often a value is one that the level moves to the edge of its range."""
MOVING = (30, 100, 300)
"""Ticks in which it does."""
UNORDERED = (50, 200, 1000)
"""Ticks of an episode of a system that nobody orders."""

HARMS: tuple[Harm, ...] = ("lost", "lost", "late", "late", "doubled", "stale")
"""As often as each is drawn."""

Add = Callable[[Random, Stand, Episode], Episode]


def draw(seed: int, system: Path, plant: str = "", script: str = "") -> Episode:
    """Return the episode of a seed.

    Args:
        seed: Which.
        system: The description, compiled.
        plant: What stands outside, as `--plant` names it; empty for the description's first.
        script: The orders to be given, changed a little; empty for drawn ones, and now and then the description's own.

    Raises:
        CodedError: The system, its plant or the script is not in order.
    """
    return draw_on(stand(system), seed, plant, script)


def draw_on(its: Stand, seed: int, plant: str = "", script: str = "") -> Episode:
    """Return the episode of a seed, on a stand.

    Raises:
        CodedError: As `draw`.
    """
    return replace(drawn(by_seed(seed), its, plant, script), seed=seed)


def drawn(random: Random, its: Stand, plant: str = "", script: str = "") -> Episode:
    """Return an episode of what `random` says.

    Raises:
        CodedError: As `draw`.
    """
    orders = tuple(_orders(random, its, script, plant))
    ticks = 0 if orders else random.choice(UNORDERED)
    outside = () if its.stands_outside(plant) else tuple(moving(random, its))
    episode = Episode(plant, orders=orders, readings=outside, ticks=ticks)
    adds = _kinds(its, switches(its, plant))
    if not adds or not happens(random, 1 - NOMINAL):
        return episode
    for _ in range(random.randint(2, MOST_FAULTS) if happens(random, 0.4) else 1):
        episode = random.choice(adds)(random, its, episode)
    return episode


# --- orders ---


def _orders(random: Random, its: Stand, script: str, plant: str) -> Iterator[OrderSpec]:
    """Yield the orders to every level: of a script as they are, or each after, at or before the end of the one before."""
    rows = scripted(its, script, plant) if script or happens(random, SCRIPTED) else ()
    if rows:
        for row in rows:
            wait, interrupts = _when(random, 0.15)
            yield replace(row, wait=wait, interrupts=interrupts)
        return
    for level in its.served:
        for at in range(random.randint(1, MOST_ORDERS)):
            yield _order(random, its, level, first=at == 0)


def _order(random: Random, its: Stand, level: Served, *, first: bool) -> OrderSpec:
    fields = []
    for place, leaf in enumerate(level.order_leaves):
        if place == level.command:
            command = random.choice(leaf.members)
        elif place != level.number and happens(random, 1 - PLAIN):
            value = between(random, leaf, its.edges[level.level][leaf.name])
            fields.append(FieldValue(field_of(leaf), setting_of(leaf, value)))
    wait, interrupts = (random.choice((0, 0, 1, 3)), False) if first else _when(random, 0.3)
    return OrderSpec(level.level, command, tuple(fields), wait, interrupts)


def _when(random: Random, often: float) -> tuple[int, bool]:
    """When an order is given; `often` it comes before the end of the one before."""
    if happens(random, often):
        return tick(random), True
    return random.choice((0, 0, 0, 1, 2, 30)), False


def scripted(its: Stand, script: str, plant: str = "") -> tuple[OrderSpec, ...]:
    """Return the orders of a script with their faults; of the description's own, if nobody says which, as far as it is one of orders.

    Raises:
        BadScript: It is not in order.
    """
    own = its.system.script
    file = script_path(script, its.path.parent) if script else own
    if file is None:
        return ()
    try:
        rows = read_script(file, its.system, its.signs, switches(its, plant))
    except CodedError:
        if script:
            raise
        return ()  # a plant's own kind of script
    return tuple(
        OrderSpec(
            row.served.level,
            str(dict(_values(row.served, row.order))[row.served.command]),
            tuple(_fields(row.served, row.order)),
            faults=row.faults,
        )
        for row in rows
        if row.served is not None
    )


def _fields(level: Served, order: Sequence[Value]) -> Iterator[FieldValue]:
    for place, value in _values(level, order):
        leaf = level.order_leaves[place]
        if place != level.command and value != setting_of(leaf, leaf.initial):
            yield FieldValue(field_of(leaf), value)


def _values(level: Served, order: Sequence[Value]) -> Iterator[tuple[int, bool | int | float | str]]:
    """Yield the place of each field but the number, and what it is in words."""
    places = [place for place in range(len(level.order_leaves)) if place != level.number]
    for place, value in zip(places, order, strict=True):
        yield place, setting_of(level.order_leaves[place], value)


# --- what goes wrong ---


def tick(random: Random) -> int:
    """Return a tick at which something may be under way; early ones oftener than late ones."""
    return (
        int(2 ** (random.randint(0, 8 * LATEST) / 8)) - 1 if happens(random, 0.5) else random.randint(0, SOON)
    )


def _window(random: Random, lasting: Sequence[int]) -> tuple[int, int]:
    first = tick(random)
    return first, first + random.choice(lasting) - 1


def _harm(random: Random, its: Stand, episode: Episode) -> Episode:
    kind: Harm = random.choice(HARMS)
    fault = BufferFault(random.choice(its.buffers), kind, *_window(random, LASTING), random.choice((1, 3, 8)))
    return replace(episode, harms=(*episode.harms, fault))


def _restart(random: Random, its: Stand, episode: Episode) -> Episode:
    """A level starts anew at any moment; where inputs are refused or lie outside their ranges, often while one does."""
    past = {field.name: field.past for field in its.fields}
    refused = [
        reading for reading in episode.readings if reading.refused or reading.value in past[reading.field]
    ]
    at = tick(random)
    if refused and happens(random, TOGETHER):
        window = random.choice(refused)
        at = random.randint(window.first_tick, window.last_tick)
    restart = Restart(at, random.choice(list(its.signs)))
    return replace(episode, restarts=(*episode.restarts, restart))


def _reading(random: Random, its: Stand, episode: Episode) -> Episode:
    field = random.choice(its.fields)
    return _held(episode, Reading(field.name, _read(random, field), *_window(random, LASTING)))


def _read(random: Random, field: Field) -> Setting:
    """Return a value that the level takes, as it is or at the edge of its range."""
    if field.past and happens(random, PAST):
        return setting_of(field.leaf, random.choice(field.past))
    return setting_of(field.leaf, between(random, field.leaf, field.edges))


def _refused(random: Random, its: Stand, episode: Episode) -> Episode:
    field = random.choice([field for field in its.fields if field.refused])
    value = refusable(random, field)
    return _held(episode, Reading(field.name, value, *_window(random, LASTING), refused=True))


def refusable(random: Random, field: Field) -> Setting:
    """Return a value that the level refuses; what is no finite number is none at all, for JSON has no other."""
    value = random.choice(field.refused)
    if isinstance(value, float) and not math.isfinite(value):
        return NO_NUMBER
    return setting_of(field.leaf, value)


def moving(random: Random, its: Stand) -> Iterator[Reading]:
    """Yield what comes from outside where no plant is given: values that change at any moment, edges oftener, now and then refused ones."""
    for field in its.fields:
        if not happens(random, 1 - STILL):
            continue
        at, last, lasting = 0, random.choice(MOVING), random.choice(LASTING)
        while at < last:
            ticks = random.choice((1, lasting, 2 * lasting))
            refused = bool(field.refused) and happens(random, REFUSED)
            value = refusable(random, field) if refused else _read(random, field)
            yield Reading(field.name, value, at, at + ticks - 1, refused=refused)
            at += ticks


def _held(episode: Episode, reading: Reading) -> Episode:
    return replace(episode, readings=(*episode.readings, reading))


def _kinds(its: Stand, faults: Sequence[str]) -> list[Add]:
    """Return the injections of a system, each as often as it is drawn."""

    def switch(random: Random, _: Stand, episode: Episode) -> Episode:
        window = _window(random, (*LASTING, *LONG))
        return replace(episode, switches=(*episode.switches, Switch(random.choice(faults), *window)))

    kinds: list[Add] = [_restart] * 2 if its.signs else []
    kinds += [_harm] * 4 if its.buffers else []
    kinds += [_reading] * 2 if its.fields else []
    kinds += [_refused] if any(field.refused for field in its.fields) else []
    return kinds + ([switch] * 3 if faults else [])


# --- what it is called ---


def fault_names(system: Path, plant: str = "") -> tuple[str, ...]:
    """Return every class of faults of a system, in the order in which summaries show them.

    Raises:
        CodedError: The system or its plant is not in order.
    """
    return (*FAULTS, *switches(stand(system), plant))


def fault_classes(episode: Episode, system: Path | None = None) -> tuple[str, ...]:  # noqa: ARG001  # as every kind of episodes has it
    """Return the classes of faults that an episode has, each once; none where nothing goes wrong in it."""
    has = {
        *(harm.kind for harm in episode.harms),
        *("refused" if reading.refused else "reading" for reading in episode.readings),
        *(["restarted"] if episode.restarts else []),
        *(["changed order"] if any(order.interrupts for order in episode.orders) else []),
    }
    ordered = (fault for order in episode.orders for fault in order.faults)
    switched = dict.fromkeys([*(one.fault for one in episode.switches), *ordered])
    return (*(name for name in FAULTS if name in has), *switched)

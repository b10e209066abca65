"""A plant's object bound to the buffers of a system: every field checked, then read and written in every tick.

In: a class, a description and signatures. Out: a `BoundPlant`, which stands outside the levels as anything else does.
"""

import ast
import copy
import inspect
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.described import BadFile, Document, KeyPath, nearest
from rcsc.base.host.files.read import xml_of
from rcsc.run.declared_plant import PlantSpec
from rcsc.run.description import Description
from rcsc.run.levels import StateTableError
from rcsc.run.orders.roles import served
from rcsc.run.plant import fields
from rcsc.run.plant.held import held_of, put_back
from rcsc.run.plant.space import Space
from rcsc.run.plant.values import BadValue, Link, Misfit, link, shape
from rcsc.run.signature import Leaf, Signature, Values

FieldPath = tuple[str, ...]
PARTIES = "say whom the plant stands for: `parties = [...]`"
"""What helps where a plant is taken to stand for somebody else, too."""


class BadPlant(BadFile):
    """A plant cannot be loaded, or does not fit the levels; nothing has moved."""

    code = Code.BAD_PLANT


class PlantFailed(StateTableError):  # noqa: N818  # what happened, not an error of ours
    """A plant raised, or one of its fields has a value that no buffer holds; says which, and when."""

    code = Code.BAD_PLANT


@dataclass(frozen=True, slots=True)
class Buffer:
    """A buffer between the levels and a plant.

    Attributes:
        name: Of the buffer.
        end: Its far end, `party.field`; the key of what a model binds to it.
        field: The attribute of the plant, part by part.
        leaves: What the level has at its end; `variable` is what it calls them, with its own name before it.
        gives: Whether the plant fills it.
        path: Where it stands in the description.
    """

    name: str
    end: str
    field: FieldPath
    leaves: tuple[Leaf, ...]
    variable: str
    gives: bool
    path: KeyPath


@dataclass(slots=True)
class BoundPlant:
    """A plant that stands outside the levels: `rcsc.run.system.Outside`.

    Attributes:
        plant: The user's object; whoever switches its faults does so here.
        takes: Buffers of the levels, and what puts their values into fields; `gives` the other way.
        seconds: Of a tick.
    """

    plant: Any
    takes: tuple[tuple[Buffer, Link], ...]
    gives: tuple[tuple[Buffer, Link], ...]
    seconds: float

    def __deepcopy__(self, memo: dict[int, Any]) -> "BoundPlant":
        """Copy the plant as it is now; share its bindings, which never change.

        Raises:
            PlantFailed: It cannot be copied.
        """
        with told("the plant cannot be copied"):
            return BoundPlant(copy.deepcopy(self.plant, memo), self.takes, self.gives, self.seconds)

    @property
    def over(self) -> bool:
        """True once the plant reports the end of the run.

        Raises:
            PlantFailed: The plant raised.
        """
        with told("the plant's `over` failed"):
            return bool(getattr(self.plant, "over", False))

    @property
    def pictures(self) -> dict[str, Callable[[], str]]:
        """The functions that draw the plant, by kind of picture; empty where its class has no `picture`."""
        return {"plant": self._drawn} if callable(getattr(self.plant, "picture", None)) else {}

    def space(self) -> Space | None:
        """Return the plant's scene in space; None where its class has no method `space`.

        Raises:
            PlantFailed: The method raised.
        """
        offered = getattr(self.plant, "space", None)
        if not callable(offered):
            return None
        with told("the plant's `space` failed"):
            space: Space = offered()
            return space

    def _drawn(self) -> str:
        """Draw the plant as an SVG document. Raises PlantFailed: `picture` raised, or gave something else."""
        with told("the plant's `picture` failed"):
            text = self.plant.picture()
            if not isinstance(text, str):
                raise TypeError(f"it gave a {type(text).__name__}, which is no text")
            root = str(xml_of(text).tag)
            if root.rpartition("}")[2] != "svg":
                raise ValueError(f"it gave a document of `{root}`, which is no SVG")
            return text

    @property
    def faults(self) -> tuple[str, ...]:
        """The names of its fault switches: fields of type `Fault`."""
        return fields.faults(type(self.plant))

    def switch(self, fault: str, *, on: bool) -> None:
        """Switch a fault on or off."""
        setattr(self.plant, fault, on)

    def state(self) -> dict[str, Any]:
        """Return the plant's state in plain values: the result of its own `state()`, else its attributes without its faults.

        Raises:
            NotKept: The plant has a value that no file holds.
        """
        return {"plant": held_of(self.plant, self.faults)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state.

        Raises:
            ValueError: The state is none of this class.
        """
        if set(state) != {"plant"}:
            raise ValueError("not the state of a plant")
        put_back(self.plant, state["plant"], self.faults)

    @property
    def properties(self) -> tuple[str, ...]:
        """The names of its own properties: methods whose result is a `Property`."""
        return fields.properties(type(self.plant))

    def shown(self) -> str:
        """Return its fields and their present values, for a report."""
        bound = [*self.takes, *self.gives]
        return ", ".join(f"{buffer.end} = {self._field(buffer)}" for buffer, _ in bound)

    def _field(self, buffer: Buffer) -> object:
        value: object = self.plant
        for part in buffer.field:
            value = getattr(value, part, None)
        return value

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """Run one tick: set fields from the levels, call the plant's `step`, give fields to the levels.

        Raises:
            PlantFailed: The plant raised, or a field has a value that its buffer cannot hold.
        """
        with told(f"the plant failed in cycle {tick + 1}"):
            for buffer, to_field in self.takes:
                values = latest(buffer.name)
                if values is not None:
                    self._put(buffer.field, to_field.taken(iter(values)))
            self.plant.step(self.seconds)
        return {buffer.name: self._given(tick, buffer, to_leaves) for buffer, to_leaves in self.gives}

    def _put(self, field: FieldPath, value: object) -> None:
        owner = self.plant
        for part in field[:-1]:
            owner = getattr(owner, part)
        setattr(owner, field[-1], value)

    def _given(self, tick: int, buffer: Buffer, to_leaves: Link) -> Values:
        try:
            value = self.plant
            for part in buffer.field:
                value = getattr(value, part)
            return tuple(to_leaves.given(value))
        except BadValue as error:
            where, what = error.args
            field = f"{'.'.join(buffer.field)}{where}"
            raise PlantFailed(f"the plant's `{field}` {what}, in cycle {tick + 1}") from error
        except (Exception, SystemExit) as error:  # a field may be any code of the user's
            what = (
                f"is missing: {error}"
                if isinstance(error, AttributeError)
                else f"cannot be read: {raised(error)}"
            )
            raise PlantFailed(
                f"the plant's `{'.'.join(buffer.field)}` {what}, in cycle {tick + 1}"
            ) from error


@contextmanager
def told(what: str) -> Iterator[None]:
    """Report any exception of a user's code as a failure of the plant.

    Raises:
        PlantFailed: The code raised.
    """
    try:
        yield
    except (Exception, SystemExit, GeneratorExit) as error:
        raise PlantFailed(f"{what}: {raised(error)}") from error


def raised(error: BaseException) -> str:
    """Return the exception of a user's code, and its place: `ZeroDivisionError: division by zero (plant.py, line 12)`."""
    frames = traceback.extract_tb(error.__traceback__)
    message = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    if isinstance(error, SyntaxError) and error.filename:
        return f"{type(error).__name__}: {error.msg} ({Path(error.filename).name}, line {error.lineno})"
    last = next((frame for frame in reversed(frames) if not frame.filename.startswith("<")), None)
    return message if last is None else f"{message} ({Path(last.filename).name}, line {last.lineno})"


# --- which buffers ---


def parties_of(system: Description, signs: Mapping[str, Signature], spec: PlantSpec) -> tuple[str, ...]:
    """Return the parties that a plant stands for: those that it names, else all outside that order no level."""
    if spec.parties is not None:
        return spec.parties
    order = {level.party for level in served(system, signs)}
    ends = [end.partition(".")[0] for wire in system.wires for end in (wire.source, wire.target)]
    return tuple(dict.fromkeys(party for party in ends if party not in signs and party not in order))


def buffers_of(
    system: Description, signs: Mapping[str, Signature], parties: Sequence[str]
) -> tuple[Buffer, ...]:
    """Return the buffers between the levels and these parties, with the plant's field of each."""
    buffers: dict[str, Buffer] = {}
    for wire in system.wires:
        for end, other, gives in ((wire.source, wire.target, True), (wire.target, wire.source, False)):
            party, _, name = end.partition(".")
            level, _, variable = other.partition(".")
            if party in parties and level in signs and end not in buffers:  # of several readers the first
                leaves, place = signs[level].leaves_of(variable), system.place_of(wire)
                buffers[end] = Buffer(
                    wire.source, end, (party, *name.split(".")), leaves, other, gives, place
                )
    return tuple(buffers.values())


# --- checked once ---


def bind(
    system: Description,
    signs: Mapping[str, Signature],
    spec: PlantSpec,
    of: type,
    seed: int = 0,
) -> BoundPlant:
    """Make an object of a plant's class, and bind it to the buffers of a system.

    Raises:
        BadPlant: The class does not fit; everything that does not is told, each at its buffer's line.
    """
    page = plant_page(system)
    parties = parties_of(system, signs, spec)
    _check_parties(page, system, signs, spec, parties)
    links: list[tuple[Buffer, Link]] = []
    try:
        hints = fields.annotations(of)
    except fields.NoField as error:
        page.wrong(spec.path, str(error))
        raise page.bad(BadPlant) from error
    for buffer in buffers_of(system, signs, parties):
        at = _bound(page, buffer, of, hints)
        if at is not None:
            links.append(at)
    _check_twice(page, of, links)
    _check_step(page, spec, of)
    if page.faults:
        raise page.bad(BadPlant)
    plant = _constructed(page, spec, of, seed)
    for buffer, to_field in links:
        _prepare(page, plant, buffer, to_field)
    if page.faults:
        raise page.bad(BadPlant)
    takes = tuple((buffer, to_field) for buffer, to_field in links if not buffer.gives)
    gives = tuple((buffer, to_field) for buffer, to_field in links if buffer.gives)
    return BoundPlant(plant, takes, gives, system.tick_ms / 1000)


def plant_page(system: Description) -> Document:
    """Return a page for findings about a plant, with the places of the description."""
    return replace(system.review(), code=Code.BAD_PLANT)


def _check_parties(
    page: Document,
    system: Description,
    signs: Mapping[str, Signature],
    spec: PlantSpec,
    parties: Sequence[str],
) -> None:
    """Note parties that no buffer has, and a plant without any party."""
    known = list(dict.fromkeys(e.partition(".")[0] for w in system.wires for e in (w.source, w.target)))
    outside = [party for party in known if party not in signs]
    for at, party in enumerate(spec.parties or ()):
        if party not in outside:
            page.wrong(
                (*spec.path, "parties", at),
                f"no buffer has a party `{party}` outside the levels",
                *nearest(party, outside),
            )
    if not parties:
        page.wrong(
            spec.path,
            "there is nobody outside the levels for whom the plant could stand",
            "give `[buffers]` an end that is no level's",
        )


def _bound(page: Document, buffer: Buffer, of: type, hints: Mapping[str, Any]) -> tuple[Buffer, Link] | None:
    """Return a buffer and its link; where it does not fit, note that and return None."""
    field = buffer.field if buffer.field[0] in hints else buffer.field[1:]
    misfits: list[Misfit] = []
    field_link: Link | None = None
    try:
        kind = _kind(of, hints, field)
        field_link = link(
            shape(buffer.leaves, buffer.variable.partition(".")[2]), kind, misfits, gives=buffer.gives
        )
    except fields.NoField as error:
        misfits.append(Misfit("", str(error)))
    except KeyError as error:
        _missing(page, buffer, *error.args)
        return None
    way = "fills" if buffer.gives else "takes"
    for misfit in misfits:
        where = f"`{'.'.join(field)}{misfit.place}` of `{of.__name__}`{line_of(of, field[0])}"
        page.wrong(buffer.path, f"{where} {misfit.message}: it {way} `{buffer.variable}`", *misfit.helps)
    return None if field_link is None else (replace(buffer, field=field), field_link)


def _missing(page: Document, buffer: Buffer, owner: str, name: str, known: Sequence[str]) -> None:
    wants = "fills" if buffer.gives else "takes"
    helps = nearest(name, known) or (f"add `{name}: {_suggested(buffer.leaves)}` to the class",)
    message = f"class `{owner}` has no field `{name}`, which {wants} `{buffer.variable}`"
    page.wrong(buffer.path, message, *helps, f"if the plant does not stand for `{_party(buffer)}`: {PARTIES}")


def _check_twice(page: Document, of: type, links: Sequence[tuple[Buffer, Link]]) -> None:
    """Note fields that are the end of two buffers: of two parties, which a class tells apart by an attribute for each."""
    ends: dict[FieldPath, Buffer] = {}
    for buffer, _ in links:
        first = ends.setdefault(buffer.field, buffer)
        if first is not buffer:
            message = (
                f"`{'.'.join(buffer.field)}` of `{of.__name__}` would be `{first.end}` and `{buffer.end}`"
            )
            page.wrong(
                buffer.path,
                message,
                PARTIES,
                f"or give the class an attribute `{_party(buffer)}` with the field in it",
            )


def _party(buffer: Buffer) -> str:
    return buffer.end.partition(".")[0]


def _suggested(leaves: Sequence[Leaf]) -> str:
    """Return the annotation that fits a scalar; `...` for a record."""
    if len(leaves) > 1:
        return "..."
    [leaf] = leaves
    if leaf.members:
        return f"Literal[{', '.join(repr(member) for member in leaf.members)}]"
    return {"bool": "bool", "double": "float", "float": "float"}.get(leaf.c_type, "int")


def _kind(of: type, hints: Mapping[str, Any], field: FieldPath) -> fields.FieldType:
    """Return the type of a field.

    Raises:
        KeyError: The field does not exist; arguments: the class, the name, the names of its fields.
        NoField: No buffer could hold its values.
    """
    owner, name = of.__name__, field[0]
    for at, name in enumerate(field):
        if name not in hints:
            raise KeyError(owner, name, list(hints))
        kind = fields.field_type(hints[name])
        if at == len(field) - 1:
            return kind
        if not isinstance(kind, fields.Record):
            raise fields.NoField(f"is `{fields.shown(kind)}`, which has no fields")
        owner, hints = kind.make.__name__, kind.hints
    raise KeyError(owner, name, list(hints))


def line_of(of: type, field: str) -> str:
    """Return the place where a class declares a field: ` (plant.py:7)`; empty where it is not known."""
    try:
        file, (text, first) = Path(inspect.getfile(of)).name, inspect.getsourcelines(of)
        body = ast.parse(inspect.cleandoc("\n" + "".join(text))).body[0]
    except (OSError, TypeError, SyntaxError, IndexError):
        return ""
    lines = (
        node.lineno
        for node in getattr(body, "body", ())
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.target.id == field
    )
    line = next(lines, None)
    return "" if line is None else f" ({file}:{first + line - 1})"


def _check_step(page: Document, spec: PlantSpec, of: type) -> None:
    step = getattr(of, "step", None)
    if not callable(step):
        page.wrong(spec.path, f"class `{of.__name__}` has no method `step(self, seconds)`")
        return
    try:
        inspect.signature(step).bind(None, 0.04)
    except (TypeError, ValueError):
        declared = f"`step{inspect.signature(step)}`"
        page.wrong(
            spec.path,
            f"class `{of.__name__}` has {declared}, which cannot be called with the seconds of a tick",
            "write `def step(self, seconds: float) -> None`",
        )


def _constructed(page: Document, spec: PlantSpec, of: type, seed: int) -> Any:
    """Construct an object of the class, with the `seed` where it takes one.

    Raises:
        BadPlant: The constructor failed.
    """
    try:
        parameters = inspect.signature(of).parameters
        return of(seed=seed) if "seed" in parameters else of()
    except (Exception, SystemExit) as error:
        page.wrong(
            spec.path,
            f"`{of.__name__}()` failed: {raised(error)}",
            "a plant is made without arguments, or with `seed` alone",
        )
        raise page.bad(BadPlant) from error


def _prepare(page: Document, plant: Any, buffer: Buffer, to_field: Link) -> None:
    """Make the object itself own the field, with the variable's first value where the class gives none.

    A class that cannot be made of the fields is noted here, and not found out while the system runs.
    """
    try:
        first = to_field.taken(iter(leaf.initial for leaf in buffer.leaves))
        owner = plant
        for part in buffer.field[:-1]:
            owner = _own(owner, part)
        if hasattr(owner, buffer.field[-1]):
            _own(owner, buffer.field[-1])
        else:
            setattr(owner, buffer.field[-1], first)
    except (Exception, SystemExit) as error:  # noqa: BLE001  # of the user's classes
        helps = "a class of fields is made of them, by name: all others need a default"
        page.wrong(buffer.path, f"`{'.'.join(buffer.field)}` cannot be made: {raised(error)}", helps)


def _own(owner: Any, name: str) -> Any:
    """Return an attribute, and make it one that no other object shares."""
    held = getattr(owner, name, None)
    if held is None:
        kind = fields.field_type(fields.annotations(type(owner))[name])
        held = fields.made_of(kind, {}) if isinstance(kind, fields.Record) else None
        setattr(owner, name, held)
    elif name not in getattr(owner, "__dict__", {name: None}):
        held = copy.deepcopy(held)
        setattr(owner, name, held)
    return held

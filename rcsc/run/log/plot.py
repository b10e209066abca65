"""Pictures of a log: values over time, or over another value.

A number that nobody has set yet (`rcsc.run.unset`) is a gap.

In: a log and names of columns. Out: an SVG or PNG file, the same bytes for the same log and version of matplotlib.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.base.host.files import written_whole
from rcsc.run.log.export import valued
from rcsc.run.log.queries import BadCondition, named_columns, nearest
from rcsc.run.log.read import Log
from rcsc.run.log.states import LogColumn
from rcsc.run.signature import Value

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH_IN, _ROW_IN = 9.0, 1.6


@dataclass(frozen=True, slots=True)
class _Series:
    """One column over all ticks; members as their numbers, what is not set as NaN."""

    name: str
    column: LogColumn
    values: list[float]

    @property
    def label(self) -> str:
        """Name and unit, and whether there is nothing to be seen."""
        said = f"{self.name} ({self.column.unit})" if self.column.unit else self.name
        return f"{said}: never set" if all(map(isnan, self.values)) else said


def plot(log: Log, names: Sequence[str], path: Path, against: str | None = None) -> None:
    """Draws columns, one below the other, over time or over `against`.

    Raises:
        BadCondition: There is no such column, or it is text.
        ModuleNotFoundError: matplotlib is not installed.
        OSError: The file could not be written.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    wanted = _series(log, [*names, *([against] if against else [])])
    drawn, over = wanted[: len(names)], wanted[len(names) :]
    with mpl.rc_context({"svg.hashsalt": "rcsc", "font.size": 8.0}):
        figure = Figure(figsize=(_WIDTH_IN, _ROW_IN * len(drawn) + 0.6), layout="constrained")
        places = figure.subplots(len(drawn), 1, sharex=True, squeeze=False)[:, 0]
        for axes, series in zip(places, drawn, strict=True):
            _draw(axes, log, series, over[0] if over else None)
        places[-1].set_xlabel(over[0].label if over else "time (s)")
        metadata = {"Date": None} if path.suffix == ".svg" else None
        with written_whole(path) as beside:
            figure.savefig(beside, metadata=metadata)


def _draw(axes: "Axes", log: Log, series: _Series, over: _Series | None) -> None:
    if over is None:
        axes.step(
            [tick * log.tick_ms / 1000 for tick in log.ticks], series.values, where="post", linewidth=1.0
        )
    else:
        axes.plot(over.values, series.values, linewidth=1.0, marker=".", markersize=3.0)
        if over.column.members:
            axes.set_xticks(range(len(over.column.members)), over.column.members, rotation=45)
    axes.set_title(series.label, loc="left")
    axes.grid(visible=True, linewidth=0.3)
    members = ("false", "true") if series.column.c_type == "bool" else series.column.members
    if members:
        seen = sorted({int(value) for value in series.values if value >= 0})
        axes.set_yticks(seen, [members[at] for at in seen])


def _series(log: Log, names: Sequence[str]) -> list[_Series]:
    known = named_columns(log.levels)
    for name in names:
        if name not in known:
            raise BadCondition(nearest(name, known))
        if not (known[name][1].members or known[name][1].c_type):
            raise BadCondition(f"`{name}` is text, which has no place on an axis")
    curves = [_Series(name, known[name][1], []) for name in names]
    for _, values in valued(log, {name: known[name] for name in dict.fromkeys(names)}):
        by_name = dict(zip(dict.fromkeys(names), values, strict=True))
        for series in curves:
            series.values.append(_number(series.column, by_name[series.name]))
    return curves


def _number(column: LogColumn, value: Value | str | None) -> float:
    if value is None:
        return nan
    if isinstance(value, str):
        return float(column.members.index(value)) if value in column.members else -1.0
    return float(value)

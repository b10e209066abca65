"""Cost by size, drawn: `python -m tests.bench.drawn FILE.svg [--limit S] [--most LINES]`; a quarter of an hour on two processors.

Proofs by lines for each kind of table, beside other ways to decide the same tables, in seconds of the processor; matches by lines, in
C by instructions beside a scan of all lines, in Python by time beside nested ifs. Both axes are logarithmic: a straight line is a power of
the size. A tool's line ends where it takes longer than the limit. The figure has its own colours for light and for dark pages.
"""

import argparse
import importlib
import io
import math
import re
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcsc.base.host.files import write_atomically
from rcsc.lang.model import Program, Table
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.decide import prove_table
from tests.bench import executors
from tests.bench.made import families
from tests.bench.made.peers import installed
from tests.bench.proofs import compiled, limited

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OURS = "rcsc"
KINDS = {
    "box": ("each condition looks at one of 20 variables", 20, (16, 64, 256, 1024, 4096, 16384)),
    "linear": ("conditions are planes over 6 variables", 6, (16, 64, 256, 1024)),
}
"""What each kind of table is, its variables, and its sizes."""
MATCHED = (16, 64, 256, 1024)

INK, GRID = "#000001", "#000002"
LINES = ("#000010", "#000011", "#000012", "#000013", "#000014", "#000015")
"""What matplotlib is told; the figure has a style for each instead."""
STYLES = (
    (INK, "ink", "#1f2328", "#e6edf3"),
    (GRID, "grid", "#d8dee4", "#30363d"),
    (LINES[0], "ours", "#0550ae", "#79c0ff"),
    (LINES[1], "b", "#bc4c00", "#ffa657"),
    (LINES[2], "c", "#1a7f37", "#7ee787"),
    (LINES[3], "d", "#8250df", "#d2a8ff"),
    (LINES[4], "e", "#9a6700", "#e3b341"),
    (LINES[5], "f", "#a40e4c", "#ff9bce"),
)
"""For each its name, and how it looks on a light page and on a dark one."""
MARKS = "os^Dv<"
LOOKS = {
    label: at
    for at, labels in enumerate(
        (
            (OURS,),
            ("Python, all pairs", "scan of all lines", "nested ifs, unchecked"),
            ("numpy, all pairs",),
            ("Z3, all pairs",),
            ("Z3, two queries",),
            ("cvc5, two queries",),
        )
    )
    for label in labels
}
"""The style and the mark of each tool, the same in all panels."""


@dataclass(frozen=True, slots=True)
class Series:
    """What one tool costs: lines of the table, and the cost; none where it is over the limit at once."""

    label: str
    points: tuple[tuple[int, float], ...]


@dataclass(frozen=True, slots=True)
class Panel:
    """One of the drawings.

    Attributes:
        unit: Of the costs.
    """

    title: str
    unit: str
    series: tuple[Series, ...]


# --- measured ---


def spent(tool: str, family: str, lines: int, variables: int) -> str:
    """Seconds of the processor that a tool takes to prove a made table.

    Raises:
        AssertionError: It says something else than what is so by construction.
    """
    program = compiled(getattr(families, family)(lines, variables, lines + variables))
    [table] = program.tables
    peers = {peer.name: peer for peer in installed()}
    if tool in peers and peers[tool].package:
        importlib.import_module(peers[tool].package)  # which is no part of the proof
    begun = time.process_time()
    right = peers[tool].decide(program, table) if tool in peers else _proved(program, table)
    took = time.process_time() - begun
    assert right, (tool, family, lines)
    return repr(took)


def _proved(program: Program, table: Table) -> bool:
    """What rcsc says of a table, without another solver's word."""
    return not prove_table(program, table, Options(solver="boxes")).findings


def proofs(family: str, limit_s: float, most: int) -> Panel:
    """Proofs of one kind of table, by every tool that takes it."""
    what, variables, sizes = KINDS[family]
    tools = [OURS, *(peer.name for peer in installed() if peer.relational or family == "box")]
    series = tuple(
        Series(tool, tuple(_until_late(tool, family, variables, [n for n in sizes if n <= most], limit_s)))
        for tool in tools
    )
    return Panel(f"Proof: {what}", "CPU seconds", series)


def _until_late(
    tool: str, family: str, variables: int, sizes: Sequence[int], limit_s: float
) -> Iterator[tuple[int, float]]:
    """The tables that a tool proves within the limit, up to the first that it does not."""
    for lines in sizes:
        took = limited(limit_s, spent, tool, family, lines, variables)
        print(f"{family:8}{lines:7}  {tool:20}{took:.8}", flush=True)
        if took == "failed":
            raise AssertionError(f"{tool} fails at {lines} lines of {family}")
        if took == "-":
            return
        yield lines, float(took)


def matches(most: int) -> list[Panel]:
    """Matches of tables of boxes, in C and in Python."""
    variables = KINDS["box"][1]
    costs: dict[str, list[tuple[int, float]]] = {name: [] for name in ("C", "scan", "Python", "nested")}
    for lines in (lines for lines in MATCHED if lines <= most):
        program = compiled(families.box(lines, variables, lines + variables))
        one = executors.measured(f"{lines} lines", program)
        print(one, flush=True)
        costs["C"].append((lines, one.ours))
        costs["scan"].append((lines, one.scan))
        costs["Python"].append((lines, one.python_ns))
        if one.nested_ns is not None:
            costs["nested"].append((lines, one.nested_ns))
    points = {name: tuple(cost) for name, cost in costs.items()}
    return [
        Panel("Match in C", "instructions", (Series(OURS, points["C"]), Series("scan of all lines", points["scan"]))),
        Panel("Match in Python", "ns", (Series(OURS, points["Python"]), Series("nested ifs, unchecked", points["nested"]))),
    ]  # fmt: skip


# --- drawn ---


def drawn(panels: Sequence[Panel], below: str) -> str:
    """The panels as SVG, two a row, with a line of text below.

    Raises:
        ModuleNotFoundError: matplotlib is not installed.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    rows = math.ceil(len(panels) / 2)
    inked: dict[Any, str] = dict.fromkeys(
        ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color"), INK
    )
    with mpl.rc_context({"svg.hashsalt": "rcsc", "svg.fonttype": "none", "font.size": 9.0}):
        mpl.rcParams.update(inked)
        figure = Figure(figsize=(9.6, 3.6 * rows + 0.3), layout=ConstrainedLayoutEngine(h_pad=0.12))
        figure.patch.set_visible(False)
        places = figure.subplots(rows, 2, squeeze=False).flat
        for axes, panel in zip(places, panels, strict=False):
            _draw(axes, panel)
        for axes in list(places)[len(panels) :]:
            axes.set_visible(False)
        figure.supxlabel(below, fontsize=8.0)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None, "Title": "Cost by size"})
    return _styled(text.getvalue())


def _draw(axes: "Axes", panel: Panel) -> None:
    axes.patch.set_visible(False)
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    for series in panel.series:
        if series.points:
            at = LOOKS[series.label]
            lines, costs = zip(*series.points, strict=True)
            axes.plot(
                lines, costs, color=LINES[at], marker=MARKS[at], label=series.label,
                linewidth=1.2 if at else 2.6, markersize=4.0 if at else 6.0, zorder=3 if at else 4,
            )  # fmt: skip
    sizes = sorted({lines for series in panel.series for lines, _ in series.points})
    axes.set_xticks(sizes, [f"{lines:,}" for lines in sizes])
    axes.minorticks_off()
    axes.set_xlabel("lines of the table")
    axes.set_ylabel(panel.unit)
    axes.set_title(panel.title, loc="left", fontsize=9.5)
    axes.grid(visible=True, color=GRID, linewidth=0.6, zorder=0)
    axes.spines[["top", "right"]].set_visible(False)
    if sizes:
        axes.legend(frameon=False, fontsize=8.0, loc="best")


def _styled(svg: str) -> str:
    """The figure with a style in place of each colour, which the page it stands on chooses."""
    for colour, name, *_ in STYLES:
        svg = svg.replace(colour, f"var(--{name})")
    light, dark = (" ".join(f"--{style[1]}: {style[place]};" for style in STYLES) for place in (2, 3))
    style = f"<style>svg {{ {light} }} @media (prefers-color-scheme: dark) {{ svg {{ {dark} }} }}</style>"
    return re.sub(r"(<svg\b[^>]*>)", lambda head: f"{head[1]}\n {style}", svg, count=1)


def main(arguments: Iterable[str] | None = None) -> None:
    """Measures and draws."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("file", type=Path, help="where the SVG goes")
    asked.add_argument(
        "--limit", type=float, default=20.0, help="seconds of the clock for a tool and a table"
    )
    asked.add_argument("--most", type=int, default=16384, help="lines of the largest table")
    given = asked.parse_args(None if arguments is None else list(arguments))
    panels = [*(proofs(kind, given.limit, given.most) for kind in KINDS), *matches(given.most)]
    below = f"One run on one machine: compare lines of a panel, not seconds. A line ends where a proof takes more than {given.limit:g} s."
    write_atomically(given.file, drawn(panels, below).encode())


if __name__ == "__main__":
    main()

"""`rcsc studio`: tables, proof, running levels and cell in one page."""

import contextlib
import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.host.children import scratch
from rcsc.base.host.guard import door
from rcsc.base.host.trust import Agreement
from rcsc.desk.shell.opening import Opening
from rcsc.front.commands.shared.extras import need
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.scaffold import TEMPLATES, gallery, make
from rcsc.front.commands.shared.systems import ATTACH, EXECUTOR, PLANT, SYSTEM, NoSystem, meant, tables_meant
from rcsc.lang.project import project_root
from rcsc.run.description import description
from rcsc.run.processes.attach import find

if TYPE_CHECKING:
    from rcsc.desk.studio.hub import Concern, Hub
    from rcsc.desk.studio.runs.live import Pace
    from rcsc.desk.studio.scene import Drawer
    from rcsc.desk.studio.start import Next, Starts


@click.command(
    "studio",
    epilog="""\b
Examples:
  rcsc studio my_robot                the system in a folder, with its plant and the script that it names
  rcsc studio make_boxt               a script of the system that is here, row by row
  rcsc studio --plant mujoco          with another of its plants
  rcsc studio --attach                a system that runs in processes, also one that somebody else started
  rcsc studio --alone                 nothing outside the levels: what comes in is set by hand
  rcsc studio tables/examples/grip.rcs    a table, with its proof and its graph; a folder of tables, too""",
)
@click.argument("target", metavar="[SYSTEM|SCRIPT|TABLES]", required=False)
@SYSTEM
@click.option("--script", default=None, metavar="SCRIPT",
              help="Who gives orders: a CSV or TOML file, or the name of one here or in its scripts/; else its own.")  # fmt: skip
@PLANT
@EXECUTOR
@ATTACH
@click.option("--by-hand", is_flag=True, help="No script gives orders: they are typed.")
@click.option("--alone", is_flag=True,
              help="Nothing outside the levels, and no database: what comes in is set by hand.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, metavar="N",
              help="Seed of the plant's random numbers.")  # fmt: skip
@click.option("--log", "logs", multiple=True, type=There(dir_okay=False, path_type=Path), metavar="FILE",
              help="A log to look at, wherever it lies (repeatable); the first is shown at once.")  # fmt: skip
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=0,
    metavar="N",
    help="Where to listen; else the project's usual port, or a free one.",
)
@click.option("--open", "opens", is_flag=True, help="Open the page in this machine's browser.")
@click.option("--trust", "trusts", is_flag=True,
              help="Agree that the code of SYSTEM's folder runs, now and later; else the page asks, once a folder.")  # fmt: skip
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    target: str | None, system: Path | None, script: str | None, plant: str | None, executor: str, attached: str | None,
    by_hand: bool, alone: bool, seed: int, logs: tuple[Path, ...], port: int, opens: bool, trusts: bool,
) -> int:  # fmt: skip
    """Open one page for SYSTEM: its tables, their proof, the levels as they run, and what stands outside them.

    SYSTEM is a system's description or a folder that has one; SCRIPT names a script of the system that is here; TABLES is a file of
    tables, or a folder of them that belongs to no system: nothing runs then. Tables, proofs and graphs are shown at once; the folder's
    plant, extern procedures and executors run when somebody has agreed to that, in the page or by --trust. The page is for a browser on
    this machine; its address has a token that nobody else knows. With nothing here and nothing named it opens on what may be opened: tables
    that were opened before, new projects, published tables. Ctrl-C ends it; what was typed and not saved is kept, and it says where.
    """
    need("studio")
    from rcsc.desk.studio.start import Next  # of an extra

    kind: Literal["c", "python"] = "c" if executor == "c" else "python"
    if attached is not None:
        if target or system or script or plant or by_hand or alone:
            raise click.UsageError("--attach names what runs: leave system, script and plant out")
        found = find(attached)
        chosen = Next(Opening(found.system, kind, attached=found))
    else:
        try:
            chosen = _meant(target, logs, system, script)
        except NoSystem:
            if target or system or script or plant or by_hand or alone or trusts:
                raise
            serve(None, port=port, opens=opens)  # nothing is here: the page says what may be opened
            return 0
        if by_hand and chosen.opening.script:
            raise click.UsageError(
                f"`{chosen.opening.script}` gives orders, and --by-hand says that nobody does"
            )
        how = replace(
            chosen.opening, kind=kind, plant=plant or "", alone=alone, seed=seed, ordered=not by_hand
        )
        chosen = replace(chosen, opening=how)
    if trusts:
        _agreement(chosen).give()
    serve(chosen, port=port, opens=opens, logs=logs)
    return 0


def serve(
    chosen: "Next | None",
    *,
    port: int = 0,
    opens: bool = False,
    logs: Sequence[Path] = (),
    runs_at: float | None = None,
) -> None:
    """Serve the page until Ctrl-C, and print which texts were kept; anew, at the same address, whenever the page opens another thing.

    Args:
        chosen: What is in it; None where the page is to say what may be opened.
        port: Where to listen; 0 for a free one.
        opens: Whether a browser is opened.
        logs: That the user names; the first is shown at once.
        runs_at: Run at once, so many times as fast as the clock; None where the page says when.
    """
    from rcsc.desk.studio.runs.live import WATCHED, Pace  # of an extra
    from rcsc.desk.studio.server import Server, usual_port
    from rcsc.desk.studio.start import Start

    project = Path.cwd() if chosen is None else _agreement(chosen).folder
    server, partings = Server(port, usual=usual_port(project)), list[str]()
    pace = WATCHED if runs_at is None else Pace(runs_at, runs=True)
    with contextlib.suppress(KeyboardInterrupt), contextlib.ExitStack() as held:
        starts = _starts(held)
        for number in itertools.count():
            start = Start(starts, "" if chosen is None else _name(chosen), number, server.hub, server.stop)
            try:
                server.serve(
                    [*_concerns(chosen, server.hub, logs, pace), start],
                    partial(_told, chosen, number, opens, held),
                )
            finally:
                partings += server.hub.partings
            if start.chosen is None:
                break
            chosen, server, logs, pace = start.chosen, server.again(), (), WATCHED
    click.echo("\n".join(("the studio is closed", *partings)))


def _concerns(chosen: "Next | None", hub: "Hub", logs: Sequence[Path], pace: "Pace") -> "Sequence[Concern]":
    from rcsc.desk.studio.project import concerns  # of an extra
    from rcsc.desk.studio.runs.live import Pace
    from rcsc.desk.studio.start import remember

    if chosen is None:
        return ()
    opening = chosen.opening
    if opening.attached is not None:
        pace = Pace(None, runs=True)  # its own
    if not chosen.copy:
        remember(opening.path if opening.path.is_file() else chosen.first or opening.path.parent)
    drawer, agreement = _drawer(opening.path), _agreement(chosen)
    return concerns(opening, hub, agreement, logs, pace, drawer, chosen.first, proves=chosen.copy)


def _told(
    chosen: "Next | None", number: int, opens: bool, held: contextlib.ExitStack, address: str
) -> None:  # bound by `partial`
    """Print where the studio is, or, the address being known, what is open there now."""
    click.echo(f"now open there: {_name(chosen)}" if chosen and number else f"the studio is at {address}")
    if chosen is not None and chosen.opening.path.is_file():
        agreement = _agreement(chosen)
        if not agreement.given:
            click.echo(
                f"none of the code in {agreement.folder} runs before the page, or --trust, says that it may"
            )
    if opens and not number:
        click.launch(held.enter_context(door(address)).as_uri())


def _agreement(chosen: "Next") -> Agreement:
    return Agreement(Path(project_root(str(chosen.opening.path))), given=chosen.agreed)


def _name(chosen: "Next") -> str:
    """Return what is open, as one would name it to a command."""
    path = chosen.opening.path
    return str(path if path.is_file() else chosen.first or path.parent)


def _meant(
    target: str | None, logs: Sequence[Path] = (), system: Path | None = None, script: str | None = None
) -> "Next":
    """Find what is meant by a target, a system and a script; its code runs once that was agreed to.

    Raises:
        CodedError, click.UsageError: It is nothing that can be opened.
    """
    from rcsc.desk.studio.start import Next  # of an extra

    tables = tables_meant(target, logs) if system is None and script is None else None
    path, named = meant(target, system, script) if tables is None else (tables, "")
    if path.is_file():
        description(path)  # what is wrong with it is told here; what is wrong with its tables, in the page
    first = Path(target) if target is not None and tables is not None else None
    return Next(Opening(path, script=named, ordered=True), first)


def _starts(held: contextlib.ExitStack) -> "Starts":
    """Return what the page may choose from; copies of published tables go with `held`."""
    from rcsc.desk.studio.start import Starts  # of an extra

    def mean(path: Path) -> "Next":
        try:
            return _meant(str(path))
        except click.UsageError as error:
            raise Refused(Code.STUDIO, error.message) from error

    def made(folder: Path, kind: str) -> None:
        refused = make(folder, kind)
        if isinstance(refused, Diagnostic):
            raise Refused(refused.code, refused.message, "name a folder that is not there yet, or is empty")

    copies = cache(lambda: held.enter_context(scratch("gallery")))
    return Starts(Path.cwd(), TEMPLATES, gallery(), mean, made, copies)


def _drawer(path: Path) -> "Drawer | None":
    """Return the drawer of the paper's cell; None where the system has none, or the extra `cell` is not installed."""
    if not path.is_file():
        return None
    try:
        from rcsc.front.commands.shared.cells import Drawn  # of an extra
    except ModuleNotFoundError:
        return None
    drawn = Drawn(path)
    return drawn if drawn.can else None

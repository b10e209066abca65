"""`rcsc studio`: tables, proof, running levels and cell in one page."""

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from rcsc.base.host.guard import door
from rcsc.base.host.trust import Agreement
from rcsc.desk.shell.opening import Opening
from rcsc.front.commands.shared.extras import need
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.systems import ATTACH, EXECUTOR, PLANT, SYSTEM, meant, tables_meant
from rcsc.lang.project import project_root
from rcsc.run.description import description
from rcsc.run.processes.attach import find

if TYPE_CHECKING:
    from rcsc.desk.studio.scene import Drawer


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
    "--port", type=click.IntRange(0, 65535), default=0, metavar="N", help="Where to listen; else a free one."
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
    this machine; its address has a token that nobody else knows. Ctrl-C ends it; what was typed and not saved is kept, and it says where.
    """
    need("studio")
    if attached is not None:
        if target or system or script or plant or by_hand or alone:
            raise click.UsageError("--attach names what runs: leave system, script and plant out")
        found = find(attached)
        agreement = Agreement(Path(project_root(str(found.system))))
        if trusts:
            agreement.give()
        held: Literal["c", "python"] = "c" if executor == "c" else "python"
        serve(Opening(found.system, held, attached=found), agreement, port=port, opens=opens, logs=logs)
        return 0
    tables = tables_meant(target, logs) if system is None and script is None else None
    path, named = meant(target, system, script) if tables is None else (tables, "")
    if by_hand and named:
        raise click.UsageError(f"`{named}` gives orders, and --by-hand says that nobody does")
    if path.is_file():
        description(path)  # what is wrong with it is told here; what is wrong with its tables, in the page
    kind: Literal["c", "python"] = "c" if executor == "c" else "python"
    opening = Opening(path, kind, plant or "", named, alone, seed, ordered=not by_hand)
    agreement = Agreement(Path(project_root(str(path))))
    if trusts:
        agreement.give()
    first = Path(target) if target is not None and tables is not None else None
    serve(opening, agreement, port=port, opens=opens, logs=logs, first=first)
    return 0


def serve(
    opening: Opening,
    agreement: Agreement,
    *,
    port: int = 0,
    opens: bool = False,
    logs: Sequence[Path] = (),
    first: Path | None = None,
    runs_at: float | None = None,
) -> None:
    """Serve the page until Ctrl-C, and print which texts were kept.

    Args:
        opening: What is in it.
        agreement: Whether the code of its folder may run.
        port: Where to listen; 0 for a free one.
        opens: Whether a browser is opened.
        logs: That the user names; the first is shown at once.
        first: The file, or the folder, whose tables are shown first; else those of the system.
        runs_at: Run at once, so many times as fast as the clock; None where the page says when.
    """
    from rcsc.desk.studio.project import concerns  # of an extra
    from rcsc.desk.studio.runs.live import WATCHED, Pace
    from rcsc.desk.studio.server import Server

    server = Server(port)

    def told(address: str) -> None:
        click.echo(f"the studio is at {address}")
        if opening.path.is_file() and not agreement.given:
            click.echo(
                f"none of the code in {agreement.folder} runs before the page, or --trust, says that it may"
            )
        if opens:
            click.launch(held.enter_context(door(address)).as_uri())

    pace = WATCHED if runs_at is None else Pace(runs_at, runs=True)
    if opening.attached is not None:
        pace = Pace(None, runs=True)  # its own
    answer = concerns(opening, server.hub, agreement, logs, pace, _drawer(opening.path), first)
    with contextlib.suppress(KeyboardInterrupt), contextlib.ExitStack() as held:
        server.serve(answer, told)
    click.echo("\n".join(("the studio is closed", *server.hub.partings)))


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

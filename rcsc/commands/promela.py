"""`rcsc promela`: the levels of a system as Promela models, and what Spin finds in them."""

import os
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rcsc.commands.shared.systems import Stopped, stop, system_path
from rcsc.host import children

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from rcsc.compose.contract.transition import TransitionSystem
    from rcsc.compose.promela.assemble import Model
    from rcsc.compose.promela.instance import Breadth
    from rcsc.compose.promela.selection import Wanted
    from rcsc.compose.promela.spin import Checked, Search


@click.command(
    short_help="Check the levels again, with Spin, in a small instance.",
    epilog="""\b
Examples:
  rcsc promela                                  every level alone, and over its subordinates
  rcsc promela --levels gripper                 one level in its environment
  rcsc promela --levels task,emove --bitstate   two levels together, as far as it comes in a minute
  rcsc promela --write models                   the models, for Spin by hand; nothing is run""",
)
@click.argument(
    "system", required=False, type=click.Path(exists=True, dir_okay=False, path_type=Path), metavar="[SYSTEM]"
)
@click.option("--levels", "only", multiple=True, metavar="A,B",
              help="A model of these levels, the superior first (repeatable); else all that `rcsc promela` knows of.")  # fmt: skip
@click.option("--seconds", type=click.FloatRange(min=0, min_open=True), default=60.0, show_default=True,
              help="Time of the search in each model.")  # fmt: skip
@click.option("--memory", "memory_mb", type=click.IntRange(min=64), default=4096, show_default=True, metavar="MB",
              help="Memory of the search in each model.")  # fmt: skip
@click.option("--numbers", type=click.IntRange(3, 16), default=4, show_default=True,
              help="Command numbers before they go round.")  # fmt: skip
@click.option("--values", type=click.IntRange(1, 8), default=1, show_default=True,
              help="Values of data from outside, at least.")  # fmt: skip
@click.option("--most", type=click.IntRange(2, 16), default=2, show_default=True,
              help="Values of data from outside, at most.")  # fmt: skip
@click.option("--gap", type=click.IntRange(1, 1000), default=1, show_default=True,
              help="Steps of a counter between two constants that it is compared with.")  # fmt: skip
@click.option(
    "--split", is_flag=True, help="A level reads what others in the model say some time before it acts."
)
@click.option("--bitstate", is_flag=True, help="Keep two bits a state: comes further, is never exhaustive.")
@click.option("--jobs", "-j", type=click.IntRange(min=1), default=min(2, os.cpu_count() or 1), show_default=True,
              help="Models looked at at once.")  # fmt: skip
@click.option("--without-deferral", is_flag=True,
              help="As if every next state were taken at once, not when its command is echoed: a demonstration.")  # fmt: skip
@click.option("--write", "folder", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Only write the models to DIR.")  # fmt: skip
def promela(  # noqa: PLR0913, PLR0917  # as many as there are options
    system: Path | None, only: tuple[str, ...], seconds: float, memory_mb: int, numbers: int, values: int, most: int,
    gap: int, split: bool, bitstate: bool, jobs: int, without_deferral: bool, folder: Path | None,
) -> int:  # fmt: skip
    """Check the levels of SYSTEM with Spin, in models that another translation makes of the same tables.

    No proof: a small instance is looked through, with few numbers, short counters and few values from outside; the header of each model
    says which. Printed of each model: whether every state was looked at, what its tables state that it cannot speak of, and, where
    something is broken, the run that breaks it; at the end, how many obligations of each sort there were.
    """
    from rcsc.compose.contract.variants import undeferred
    from rcsc.compose.promela.instance import Breadth
    from rcsc.compose.promela.spin import Search
    from rcsc.compose.proof.system import NoProgramError, transition_systems
    from rcsc.diagnostics.codes import Code
    from rcsc.run.description import BadDescription

    try:
        made = transition_systems(system_path(system))
    except NoProgramError as error:
        raise Stopped(Code.BAD_SYSTEM, str(error)) from error
    except BadDescription as error:
        stop(error)
    if without_deferral:
        made = {name: one.of(undeferred(one.program)) for name, one in made.items()}
    models = _chosen(made, only)
    breadth = Breadth(numbers, values, most, gap, split)
    if folder is not None:
        return _write(folder, made, models, breadth)
    return _check(made, models, breadth, Search(seconds, memory_mb, bitstate=bitstate), jobs)


def _chosen(made: "Mapping[str, TransitionSystem]", only: tuple[str, ...]) -> "list[Wanted]":
    """The models that are asked for.

    Raises:
        click.UsageError: There is no such level, or one does not stand below the first.
    """
    from rcsc.compose.promela.selection import Wanted, can_end, wanted

    if not only:
        return list(wanted(made))
    found = []
    for text in only:
        names = tuple(text.split(","))
        for name in names:
            if name not in made:
                raise click.UsageError(f"there is no level `{name}`; there are {', '.join(made)}")
        for name in names[1:]:
            above = made[name].links.above
            if above is None or above.name not in names:
                raise click.UsageError(f"`{name}` stands below none of the others of `{text}`")
        found.append(Wanted(names))
        if len(names) == 1 and can_end(made[names[0]]):
            found.append(Wanted(names, progress=True))
    return found


def _models(
    made: "Mapping[str, TransitionSystem]", models: "list[Wanted]", breadth: "Breadth"
) -> "Iterator[tuple[Wanted, Model]]":
    from rcsc.compose.promela.assemble import emit

    for one in models:
        yield one, emit(made, one.levels, breadth, progress=one.progress)


def _write(
    folder: Path, made: "Mapping[str, TransitionSystem]", models: "list[Wanted]", breadth: "Breadth"
) -> int:
    from rcsc.host.files import write_atomically

    folder.mkdir(parents=True, exist_ok=True)
    for one, model in _models(made, models, breadth):
        name = "_".join((*one.levels, "progress") if one.progress else one.levels)
        write_atomically(folder / f"{name}.pml", model.text.encode())
        click.echo(f"{folder / name}.pml: {one.shown}")
    return 0


def _check(
    made: "Mapping[str, TransitionSystem]",
    models: "list[Wanted]",
    breadth: "Breadth",
    search: "Search",
    jobs: int,
) -> int:
    from rcsc.compose.promela.spin import SpinError, check
    from rcsc.diagnostics.codes import Code
    from rcsc.host.tools import Absent

    click.echo(f"a small instance, no proof: {breadth}")
    broken = 0
    with children.searchers(jobs) as pool:
        waiting = [
            (one, model, pool.submit(check, model, search)) for one, model in _models(made, models, breadth)
        ]
        for one, model, future in waiting:
            try:
                checked = future.result()
            except SpinError as error:
                raise Stopped(Code.INTERNAL, f"Spin refuses the model of {one.shown}: {error}") from error
            if isinstance(checked, Absent):
                raise Stopped(Code.NO_SPIN, checked.reason)
            broken += _say(made, one, model, checked)
    _say_obligations(model for _, model, _ in waiting)
    return 1 if broken else 0


def _say(made: "Mapping[str, TransitionSystem]", one: "Wanted", model: "Model", checked: "Checked") -> bool:
    """One model; whether something in it is broken."""
    from rcsc.compose.promela.trail import run_of
    from rcsc.diagnostics.codes import Code

    how = "every state" if checked.exhaustive else "bitstate" if checked.bitstate else "NOT every state"
    head = click.style(one.shown, bold=True)
    if not checked.failed:
        good = "they do" if model.progress else "nothing broken"
        click.echo(f"{head}  {how}, {checked.states}, in {checked.seconds:.1f} s: {good}")
        _say_left_out(model)
        return False
    if model.progress:  # nothing that the tables promise
        click.echo(f"{head}  no: one goes on for as long as the outside never says what it waits for")
        return False
    click.echo(f"{head}  after {checked.states} states: broken")
    _say_left_out(model)
    run = run_of(model, made, checked.trail)
    click.echo(f"error[{Code.NOT_COMPOSED.value}]: {run.aim.shown}: broken, as Spin finds", err=True)
    note = (
        "run by the interpreter, which breaks it too"
        if run.ran
        else f"in the small instance only: {run.reason}"
    )
    click.echo(f"  = note: broken in {run.cycles} cycles, {note}", err=True)
    for line in run.lines:
        click.echo(f"  {line}", err=True)
    return True


def _say_left_out(model: "Model") -> None:
    """What the tables state and this model does not check; a model for progress checks nothing of it anyway."""
    for out in () if model.progress else model.left_out:
        click.echo(f"  not checked: {out.shown}")


def _say_obligations(models: "Iterable[Model]") -> None:
    """How many different obligations of each sort there were in the models, but for those that only ask whether commands end."""
    from rcsc.compose.contract.obligations import Sort

    every = {aim for model in models if not model.progress for aim in model.aims}
    counts = Counter(aim.what for aim in every)
    click.echo(f"{len(every)} goals:")
    for sort in filter(counts.__getitem__, Sort):
        click.echo(f"{counts[sort]:5}  {sort}")

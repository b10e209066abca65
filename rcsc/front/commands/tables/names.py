"""`rcsc names`: the data dictionary of a system, or of tables."""

import json
from collections.abc import Iterator
from pathlib import Path

import click

from rcsc.driver.compile import systems_in, with_programs
from rcsc.driver.settings import Settings
from rcsc.front.commands.shared.graphs import OUT, WrongError, written
from rcsc.front.commands.shared.options import PATHS
from rcsc.front.commands.shared.systems import NoSystem, system_path
from rcsc.lang.model import Program
from rcsc.lang.project import Loaded, load
from rcsc.lang.resolve import resolve
from rcsc.proof.solvers.options import Options
from rcsc.run.description import Description, description
from rcsc.views.trace.names import NamedVariable, named, names_csv, names_json, names_page, names_text

FORMS = {"text": ".txt", "csv": ".csv", "json": ".json", "html": ".html"}


@click.command(
    "names",
    epilog="""\b
Examples:
  rcsc names                              every variable of the system here
  rcsc names tables/system.toml -o names.html   as a page; .csv and .json are known, too
  rcsc names gripper.rcs --find width     those in whose name, meaning or type `width` stands

\b
Exit status: 0 they are shown, 1 the tables are not in order, 2 usage.""",
)
@PATHS
@click.option("--form", type=click.Choice(list(FORMS)), default=None,
              help="text, csv, json or html; else by the ending of FILE, else text.")  # fmt: skip
@click.option(
    "--find",
    "asked",
    default="",
    metavar="WORD",
    help="Those alone in whose name, meaning or type the word stands.",
)
@OUT
def command(paths: tuple[str, ...], form: str | None, asked: str, out: Path | None) -> int:
    """List the variables of a system's levels, or of tables: the data dictionary.

    Of each: kind, type, unit, range, its value at first and after a restart, its meaning (`##`), the buffer that brings or takes it, the
    lines, procedures and claims that write and read it, and their requirements. Nothing is proved; the names are those of `run`, `shell`,
    `log` and the generated code.
    """
    try:
        found = [one for one in dictionary(paths) if one.speaks_of(asked)]
    except WrongError as error:
        return error.shown("names")
    if not found:
        raise click.UsageError(
            f"nothing here has `{asked}` in its name, meaning or type" if asked else "there is no variable"
        )
    by_ending = {ending: name for name, ending in FORMS.items()}
    chosen = form or by_ending.get(out.suffix if out else "", "text")
    match chosen:
        case "csv":
            text = names_csv(found)
        case "json":
            text = json.dumps(names_json(found), indent=2, ensure_ascii=False) + "\n"
        case "html":
            text = names_page("Data dictionary", found)
        case _:
            text = names_text(found)
    written(text, out)
    return 0


def dictionary(paths: tuple[str, ...]) -> Iterator[NamedVariable]:
    """Yield the variables of all levels that paths name, in order of levels.

    Raises:
        BadDescription: A system is not in order.
        WrongError: Tables are not in order.
    """
    systems = tuple(systems_in(paths or _here()))
    described = [description(path) for path in systems]
    tables = tuple(
        path for path in paths if not any(systems_in((path,)))
    )  # of a system's folder its levels alone
    asked = with_programs(Settings(tables, Options()), systems)
    loaded = load(asked.paths or (".",), instances=asked.instances)
    if loaded.diagnostics:
        raise WrongError(loaded.diagnostics, loaded.sources)
    programs = [resolve(root, loaded) for root in loaded.roots]
    wrong = [each for program in programs if not isinstance(program, Program) for each in program]
    if wrong:
        raise WrongError(tuple(wrong), loaded.sources)
    for program in programs:
        if isinstance(program, Program):
            yield from named(program, _places(program, loaded), _system_of(program, described))


def _here() -> tuple[str, ...]:
    """Return the system that is here; nothing where there is none."""
    try:
        return (str(system_path(None)),)
    except NoSystem:
        return ()


def _system_of(program: Program, described: list[Description]) -> Description | None:
    levels = ((system, spec.program) for system in described for spec in system.levels)
    return next((system for system, name in levels if name == program.name), None)


def _places(program: Program, loaded: Loaded) -> dict[str, str]:
    """Return file and line of each variable's declaration."""
    found = {}
    for variable in program.variables:
        source = loaded.sources.get(variable.span.file)
        if source is not None:
            found[str(variable.name)] = f"{source.name}:{source.position(variable.span.start).line}"
    return found

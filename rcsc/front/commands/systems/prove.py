"""`rcsc prove`: the levels of a system proved together.

Where nothing has changed since all was proved, what is known is printed, and nothing of the proof is imported.
"""

import os
from pathlib import Path

import click

from rcsc.base.host.cache import open_cache
from rcsc.driver.outline import recall_lines
from rcsc.front.commands.shared.extras import need
from rcsc.front.commands.shared.options import steps_option
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import say
from rcsc.front.commands.shared.systems import system_path


@click.command(
    "prove",
    epilog="""\b
Examples:
  rcsc prove                                   the system in system.toml, here or in tables/
  rcsc prove my_robot                          the system in a folder
  rcsc prove tables/system.toml --level task   one level in its environment
  rcsc prove --certificate proof               the invariants as SMT-LIB, for another solver
  rcsc prove --export aiger questions          each level and what it owes, for another model checker
  rcsc prove --level task --without-deferral   what section 9 warns of: the shortest trace
  rcsc prove --show calm --report calm.html    all that is known of a requirement, as a page
  rcsc prove --log found                       each trace as a log, for `rcsc replay` and `rcsc log`
  rcsc prove --level task --coverage           what requirements speak of, and what none would notice
  rcsc prove --where "stock = 0"               traces that begin with an empty stock
  rcsc prove --case tests/found/a.json         a frozen finding, again""",
)
@click.argument("system", required=False, type=There(path_type=Path), metavar="[SYSTEM]")
@click.option("--level", "only", multiple=True, metavar="NAME", help="Only this level (repeatable).")
@click.option("--requirement", "required", multiple=True, metavar="NAME",
              help="Of the requirements across levels, answer only this one (repeatable).")  # fmt: skip
@steps_option(80, " All questions about one level get 50 times as many together.")
@click.option("--jobs", "-j", type=click.IntRange(min=1), default=None, show_default="as many as processors, or 1 for small levels",
              help="Levels proved at once.")  # fmt: skip
@click.option("--trace", "cycles", type=click.IntRange(min=0, max=1000), default=None, metavar="N",
              show_default="8, or some more than a time takes that a table asks for, at most 100",
              help="For what is not proved, look for a trace of at most N cycles; 0 does not look.")  # fmt: skip
@click.option("--follow", "further", type=click.IntRange(min=0, max=1000), default=4, show_default=True, metavar="N",
              help="Follow each trace on for at most N cycles, up to what the superior takes; 0 does not.")  # fmt: skip
@click.option("--where", "begins", multiple=True, metavar="VALUES",
              help='Search traces from these initial values: "leaf = value, level.leaf = value". No verdict depends on it.')  # fmt: skip
@click.option("--log", "logs", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Keep each trace in DIR as a log that `rcsc replay` steps and `rcsc log` draws, with its executors.")  # fmt: skip
@click.option("--freeze", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Keep each trace in DIR as a case for --case: a test that fails until the tables are mended.")  # fmt: skip
@click.option("--case", "cases", multiple=True, type=There(dir_okay=False, path_type=Path), metavar="FILE",
              help="Run a frozen case on the tables as they are, and nothing else (repeatable).")  # fmt: skip
@click.option("--without-deferral", is_flag=True,
              help="As if every next state were taken at once, not when its command is echoed: a demonstration.")  # fmt: skip
@click.option("--first-match", is_flag=True,
              help="As if of several lines that match the first ran: a demonstration.")  # fmt: skip
@click.option("--without-default", is_flag=True,
              help="As if every DEFAULT line were declared unreachable: shows what falls to them.")  # fmt: skip
@click.option("--certificate", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Write each level's questions to DIR as SMT-LIB: each is to be answered `unsat`.")  # fmt: skip
@click.option("--certify", "confirms", is_flag=True,
              help="Put the same questions to cvc5, which has no part in the proof.")  # fmt: skip
@click.option("--export", "exports", type=(click.Choice(["aiger", "btor2"]), click.Path(file_okay=False, path_type=Path)),
              default=None, metavar="aiger|btor2 DIR",
              help="Write each level, exact, and what it owes to DIR for another model checker, and prove nothing.")  # fmt: skip
@click.option("--show", "shows", multiple=True, metavar="NAME",
              help="Print a run that asks for the response of the requirement over time NAME, and prove nothing (repeatable).")  # fmt: skip
@click.option("--report", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="PAGE",
              help="With --show NAME: prove the levels, and write a page about that requirement, to be handed on: its verdict, what it "
              "rests on and trusts, the lines that have a part in it, a run; one file that needs nothing else.")  # fmt: skip
@click.option("--coverage", is_flag=True,
              help="Print, too, what each property and requirement needs, and what can be left out unnoticed.")  # fmt: skip
@click.option("--no-cache", is_flag=True, help="Prove everything anew.")
@click.option("--progress", is_flag=True,
              help="Print each level and requirement on standard error once it is done; a terminal always shows it, and what it "
              "took last time.")  # fmt: skip
@click.option("--strict", is_flag=True,
              help="Exit with status 1 also where a claim was not looked at, or rests on an unproved one.")  # fmt: skip
@click.option("--invariants", is_flag=True, help="Print the invariant of each level, too.")
@click.option("--json", "as_json", is_flag=True, help="The result as JSON.")
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    system: Path | None, only: tuple[str, ...], required: tuple[str, ...], steps: int, jobs: int | None, cycles: int | None,
    further: int, begins: tuple[str, ...], logs: Path | None,
    freeze: Path | None, cases: tuple[Path, ...], without_deferral: bool, first_match: bool, without_default: bool,
    certificate: Path | None, confirms: bool, exports: tuple[str, Path] | None, shows: tuple[str, ...],
    report: Path | None, coverage: bool, no_cache: bool, progress: bool, strict: bool, invariants: bool, as_json: bool,
) -> int:  # fmt: skip
    """Prove that the levels of SYSTEM work together, however late each sees and answers what another says.

    Each level is proved in its environment: every command at any moment, every delay, repetition and loss in the buffers, every
    answer of the database. What it assumes of a neighbour is proved of that neighbour. Printed: each
    assumption with its new standing, what is guaranteed between levels, and for what fails the shortest run that shows it.
    """
    for extra in (*(["certify"] if confirms else []), *(["log"] if logs or report else [])):
        need(extra)
    if report is not None and len(shows) != 1:
        raise click.UsageError("--report is of one requirement: `--show NAME` says which")
    if only and required:
        raise click.UsageError("--level proves levels alone, --requirement is about what several do together")
    path = None if cases else system_path(system)
    rules = {
        "without-deferral": without_deferral,
        "first-match": first_match,
        "without-default": without_default,
    }
    variants = tuple(name for name, wanted in rules.items() if wanted)
    cache = (
        None if no_cache or variants or path is None else open_cache(path.parent)
    )  # a variant is nobody's tables
    key = tuple(
        map(
            str,
            (os.getcwd(), path, only, required, steps, cycles, further, begins, strict, invariants, as_json),
        )
    )
    if (
        cache is not None
        and path is not None
        and not (logs or freeze or certificate or confirms or exports or shows or coverage or progress)
    ):
        known = recall_lines(cache, path, key)
        if known is not None:
            for line in known:
                say(line)
            return 0
    from rcsc.front.commands.systems.proving import (  # what is known is printed without
        Asked,
        exported,
        paged,
        proved,
        run_cases,
        shown_by_runs,
    )

    if path is None:
        return run_cases(cases)
    if exports is not None:
        return exported(path, only, *exports)
    if report is not None:
        return paged(path, shows[0], report, cycles, cache)
    if shows:
        return shown_by_runs(path, shows, cycles)
    asked = Asked(
        only, required, steps, jobs, cycles, further, begins, logs, freeze, variants, certificate, confirms, progress, strict, invariants,
        as_json, coverage,
    )  # fmt: skip
    return proved(path, asked, cache, key)

"""`rcsc check`: every table proved."""

import click

from rcsc.base.host.memory import last_work
from rcsc.driver.check import check
from rcsc.front.commands.shared.options import PATHS, proving, settings_of, showing
from rcsc.front.commands.shared.show import Output, finish
from rcsc.proof.solvers.options import Options


@click.command(
    "check",
    epilog="""\b
Examples:
  rcsc check                     everything below this folder
  rcsc check tables/task -j 2    one folder, two tables at once
  rcsc check --solver both       ask Z3 about every table, however large
  rcsc check --solver z3         let Z3 alone decide, and nothing else
  cat grip.rcs | rcsc check -    a text from a pipe
  rcsc check --format line       one line a finding, for an editor""",
)
@PATHS
@proving
@showing
def command(paths: tuple[str, ...], options: Options, use_cache: bool, output: Output) -> int:
    """Prove that exactly one line of each table matches, for every input.

    PATH is a file, a folder (all `*.rcs` below it) or `-`, standard input; without any it is this folder. For
    each finding the least input is shown as a column beside the lines that match it, then the region that it
    stands for, and what would help. What was proved once is not proved again until something changes. An assumption is shown
    as assumed, as monitored, or as proved where `rcsc prove` has shown that the levels of these very files keep it.
    """
    with last_work():
        return finish(check(settings_of(options, use_cache, output, paths)), "check", output)

"""The commands, and where each is: a module is imported when its command is run, or asked for its help, and not before.

So that nobody waits for what he does not use, laziness stands here alone. Each module has its command under the name `command`.
"""

from importlib import import_module
from typing import Any

import click

from rcsc import __version__
from rcsc.base.diagnostics.coded import CodedError
from rcsc.front.commands.shared.extras import lacking
from rcsc.front.commands.shared.stopped import stopped

_EPILOG = """\b
Examples:
  rcsc check                          check every table below this folder
  rcsc check tables/task/acquire.rcs  check one file and what it uses
  rcsc check --sarif -o rcsc.sarif    for a code-scanning service
  rcsc compile tables --check         is generated/ fresh?
  rcsc explain RCS402                 what a finding means, with an example

\b
Exit status: 0 proved, 1 findings, 2 usage, 3 a bug in rcsc."""

BY_TASK = {
    "Start": {
        "new": "Make a small project.",
        "systems.studio": "Open tables, proof, running levels and cell in one page.",
        "tables.lsp": "Serve an editor as tables are typed.",
        "completion": "Print a shell's completion script.",
    },
    "Tables": {
        "tables.check": "Prove that exactly one line of each table matches.",
        "explain": "Say what a code means.",
        "tables.fmt": "Align tables.",
        "tables.diff": "Show what changed in meaning, and prove that nothing else did.",
        "tables.graph": "Draw a table's state graph.",
        "tables.table": "Make a table of a state graph.",
    },
    "Systems": {
        "systems.prove": "Prove the levels of a system together, for any delay.",
        "systems.campaign": "Run many episodes of a system, with faults; shrink what breaks a property.",
        "tables.names": "List the variables of a system: its data dictionary.",
    },
    "Run": {
        "systems.run": "Run a system with its plant, by a script of orders.",
        "systems.shell": "Run, step and change a system by hand.",
        "systems.log": "Say what a recorded run did.",
        "systems.replay": "Run a recorded run again and compare.",
        "systems.db": "Build, check and show the cell's database.",
    },
    "Code": {
        "tables.compile": "Write the executors of proved tables, in Python and C.",
        "tables.test": "Test the generated executors against the tables.",
    },
    "For a safety case": {
        "tables.trace": "Trace lines to requirements, code, tests and proofs, and code back to lines.",
        "tables.evidence": "Make what a safety case asks of the generated C.",
        "tables.certify": "Re-check a proof without the prover.",
    },
}
"""Commands by task, as `rcsc --help` lists them: the module of each, whose last name is the command's, and what it does."""
COMMANDS = {module: summary for commands in BY_TASK.values() for module, summary in commands.items()}


class Group(click.Group):
    """Commands by name and summary, each imported when the command line has named it."""

    def format_commands(self, _: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by task."""
        for task, commands in BY_TASK.items():
            with formatter.section(task):
                rows = [(module.rpartition(".")[2], summary) for module, summary in commands.items()]
                formatter.write_dl([(f"{name:10}", summary) for name, summary in rows])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that the first argument names, and the remaining arguments for it."""
        name, summary, rest = super().resolve_command(ctx, args)
        return name, None if summary is None else imported(str(summary.name)), rest

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command that `ctx` names.

        Raises:
            Stopped: Something that the command was given is not in order, or a package of an extra is not installed.
        """
        try:
            return super().invoke(ctx)
        except CodedError as error:
            raise stopped(error) from error
        except ModuleNotFoundError as error:
            if (lacks := lacking(error)) is None:
                raise
            raise lacks from error


def imported(name: str) -> click.Command:
    """Import the command of this name from its module."""
    module = next(module for module in COMMANDS if module.rpartition(".")[2] == name)
    command: click.Command = import_module(f"rcsc.front.commands.{module}").command
    return command


@click.group(
    "rcsc",
    cls=Group,
    commands=[
        click.Command(module.rpartition(".")[2], short_help=summary) for module, summary in COMMANDS.items()
    ],
    epilog=_EPILOG,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, "-V", "--version", message="rcsc %(version)s")
def commands() -> None:
    """Prove robot-control state tables, and compile the proved ones to Python and C.

    In every cycle exactly one line of a table must match. `rcsc check` proves that it does, whatever comes
    in, or shows an input for which it does not.
    """

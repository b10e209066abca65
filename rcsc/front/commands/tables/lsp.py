"""`rcsc lsp`: the language server."""

import sys

import click

from rcsc.base.host.files.read import standard_input
from rcsc.front.commands.shared.extras import need
from rcsc.front.commands.shared.options import steps_option
from rcsc.proof.solvers.options import Options

PATIENCE_S = 5.0
"""Processor time of one question, in seconds: no question can be interrupted, and the next key waits for it."""


@click.command(
    "lsp",
    epilog="""\b
Examples:
  rcsc lsp            an editor runs this, and speaks to it on standard input and output""",
)
@click.option(
    "--stdio", is_flag=True, help="Standard input and output, which is all there is; some editors say so."
)
@steps_option(20)
def command(stdio: bool, steps: int) -> int:  # noqa: ARG001 - editors give it
    """Serve an editor: findings, proved repairs, hovers and the like as tables are typed, in the language server protocol.

    Texts stand for files as they are typed, saved or not. The standing of each table is said in one of four states: proved, rests on an
    assumption, stale, failed.
    """
    need("lsp")
    from rcsc.desk.editor.server.serve import serve  # keep lazy: its packages are an extra

    serve(Options(steps=steps, cpu_s=PATIENCE_S), standard_input(), sys.stdout.buffer)
    return 0

"""`rcsc completion`: a shell's completion script."""

import click
from click.shell_completion import get_completion_class


@click.command(
    "completion",
    epilog="""\b
Examples:
  bash: eval "$(rcsc completion bash)"     in ~/.bashrc
  zsh:  eval "$(rcsc completion zsh)"      in ~/.zshrc
  fish: rcsc completion fish > ~/.config/fish/completions/rcsc.fish""",
)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def command(shell: str) -> int:
    """Print the script that lets SHELL complete rcsc's commands and options."""
    kind = get_completion_class(shell)
    if kind is None:  # pragma: no cover  # click has all three
        raise click.UsageError(f"no completion for {shell}")
    click.echo(kind(click.get_current_context().find_root().command, {}, "rcsc", "_RCSC_COMPLETE").source())
    return 0

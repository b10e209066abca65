"""Paths that must be there; of one that is not, the message names what is near."""

from pathlib import Path
from typing import Any

import click


class There(click.Path):
    """A path that is there; of one that is not, the message names what is near."""

    def __init__(self, **kinds: Any) -> None:
        super().__init__(exists=True, **kinds)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path; say which is near where it is not there."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            from rcsc.base.host.described import near_path  # keep lazy: most paths are there

            told = (error.message.removesuffix("."), *near_path(Path(value)))
            message = "; ".join(told) if len(told) > 1 else error.message
            raise click.BadParameter(message, error.ctx, error.param) from error

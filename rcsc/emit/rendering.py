"""The templates; the only importer of Jinja2."""

from collections.abc import Mapping
from functools import cache

import jinja2

from rcsc.emit.code_tree import IN_C, IN_PYTHON


@cache
def environment() -> jinja2.Environment:
    """A strict environment: a template that misspells an attribute fails."""
    templates = jinja2.Environment(
        loader=jinja2.PackageLoader("rcsc.emit"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - the output is C and Python, not HTML
    )
    templates.filters |= {"c": IN_C.lines, "python": IN_PYTHON.lines}
    return templates


def render(template: str, view: Mapping[str, object]) -> str:
    """The template laid out with these values."""
    return environment().get_template(template).render(view)

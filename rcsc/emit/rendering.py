"""The templates; the only importer of Jinja2."""

from functools import cache

import jinja2


@cache
def environment() -> jinja2.Environment:
    """Strict: a template that misspells an attribute fails."""
    return jinja2.Environment(
        loader=jinja2.PackageLoader("rcsc.emit"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - the output is C and Python, not HTML
    )


def render(template: str, plan: object) -> str:
    """The template laid out with one frozen value, called `plan`."""
    return environment().get_template(template).render(plan=plan)

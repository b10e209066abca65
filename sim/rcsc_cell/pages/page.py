"""Pages: one HTML file that needs nothing else, has no scripts and fetches nothing, and says so to the browser.

In: a template of this folder, and what it shows. Out: its text; what is shown is escaped.
"""

import jinja2
from markupsafe import Markup, escape

PAGES = jinja2.Environment(
    loader=jinja2.PackageLoader("rcsc_cell", "pages"),
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    autoescape=True,
)


def quoted(text: str) -> Markup:
    """A text whose names stand in backticks, with the names set apart."""
    pieces = text.split("`")
    if len(pieces) % 2 == 0:  # one is left over: nothing is meant by any
        return escape(text)
    return Markup("").join(
        Markup("<code>{}</code>").format(piece) if at % 2 else escape(piece)
        for at, piece in enumerate(pieces)
    )


PAGES.filters["quoted"] = quoted

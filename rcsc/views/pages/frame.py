"""Templates of pages, and a script that a page names by its hash.

In: a package's folder of templates, which may extend `page.html.jinja`. Out: an environment in which what is shown is escaped.
"""

import base64
import hashlib
import json
from typing import Any

import jinja2
from markupsafe import Markup, escape

from rcsc.base.host.files.write import compressed


def environment(package: str, folder: str) -> jinja2.Environment:
    """Return the templates of a package's folder, beside those that all pages have in common."""
    templates = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [jinja2.PackageLoader(package, folder), jinja2.PackageLoader("rcsc.views", "pages")]
        ),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
    )
    templates.filters["quoted"] = quoted
    return templates


def quoted(text: str) -> Markup:
    """Mark up a text: names that stand in backticks become code."""
    pieces = text.split("`")
    if len(pieces) % 2 == 0:  # one is left over: nothing is meant by any
        return escape(text)
    return Markup("").join(
        Markup("<code>{}</code>").format(piece) if at % 2 else escape(piece)
        for at, piece in enumerate(pieces)
    )


def palette() -> str:
    """Return the style sheet of the colours that all pages have."""
    return PAGES.get_template("palette.css").render()


def hashed(script: str) -> str:
    """Return a script's name in a policy: its SHA-256."""
    return f"sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}"


def packed(data: Any) -> Markup:
    """Pack data for a `script` element that is not run: gzip in base64, harmless in HTML; equal data give equal text."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return Markup(base64.b64encode(compressed(text.encode())).decode())  # noqa: S704  # nothing is left that means something to HTML


PAGES = environment("rcsc.views", "pages")
"""The templates of this folder."""

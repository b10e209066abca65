"""Files that show what is shared: a film, or a finding.

In: what is shown, as the pages of the studio have it. Out: the text of one HTML file; the same for the same.
"""

import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from markupsafe import Markup

from rcsc.pages.frame import embedded, environment, hashed

PARTS = ("make.js", "exchanges.js", "player.js")
"""Parts of the studio's page, of which a file's script is made."""
_MODULE = re.compile(r"^import .*\n|^export (?=const|function|class)", re.MULTILINE)


def script(text: str) -> str:
    """Return what a module does, with nothing that it takes from others or gives them."""
    return _MODULE.sub("", text)


@cache
def player() -> str:
    """Return the script of a film."""
    page = files("rcsc.studio").joinpath("page")
    parts = [script(page.joinpath(part).read_text(encoding="utf-8")) for part in PARTS]
    return '"use strict";\n{\n' + "\n".join(parts) + "}\n"


def of_film(title: str, film: dict[str, Any]) -> str:
    """Return the file of a moment and the ticks around it.

    Args:
        title: Whose run it is.
        film: As `film` has it.
    """
    code = Markup(player())  # noqa: S704  # the project's own
    return _TEMPLATES.get_template("moment.html.jinja").render(
        title=title, film=film, data=embedded(film), script=code, hash=hashed(code)
    )


def of_finding(
    title: str, table: dict[str, Any] | None, finding: dict[str, Any], repairs: Sequence[dict[str, Any]]
) -> str:
    """Return the file of a finding.

    Args:
        title: Whose table it is.
        table: As the grid has it; None where the finding is of none.
        finding: Likewise.
        repairs: That were checked.
    """
    shown = finding["witnesses"][0] if finding["witnesses"] else None
    return _TEMPLATES.get_template("finding.html.jinja").render(
        title=title, table=table, finding=finding, repairs=repairs, witness=shown
    )


_TEMPLATES = environment("rcsc.studio", "share")

"""What stands in a file that shows a run: the film, as its script unpacks it."""

import base64
import gzip
import json
import re
from typing import Any


def film_of(text: str) -> dict[str, Any]:
    [data] = re.findall(r'<script type="application/gzip" id="film">(.*?)</script>', text, re.DOTALL)
    film: dict[str, Any] = json.loads(gzip.decompress(base64.b64decode(data)))
    return film


def standing(changes: list[list[Any]], tick: int) -> Any:
    """What stands at a tick, of what is told where it changes."""
    return [told for at, told in changes if at <= tick][-1]


def values_at(film: dict[str, Any], level: str, tick: int) -> dict[str, str]:
    """Every variable of a level at a tick, in words."""
    every = film["variables"][level]
    return {name: standing(one["changes"], tick) for name, one in every.items()}


def unset_in(film: dict[str, Any], name: str, tick: int) -> bool:
    """Whether nobody has set a variable by a tick."""
    level, _, variable = name.partition(".")
    return any(first <= tick <= last for first, last in film["variables"][level][variable]["unset"])

"""What stands in a file that shows a run: the ticks, as its script unpacks them; of a film, its pictures."""

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageSequence

Picture = npt.NDArray[np.uint8]


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


def pictures(film: Path) -> list[Picture]:
    """The pictures of a film, decoded."""
    if film.suffix == ".mp4":
        with av.open(str(film)) as opened:
            return [frame.to_ndarray(format="rgb24").astype(np.uint8) for frame in opened.decode(video=0)]
    with Image.open(film) as opened:
        return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(opened)]


def blue(picture: Picture) -> tuple[float, float]:
    """Where the robot's blue is: the middle of its pixels, across and down."""
    red, green, blue = (picture[:, :, part].astype(int) for part in range(3))
    rows, columns = np.nonzero((blue > red + 50) & (blue > green + 25))
    return float(columns.mean()), float(rows.mean())

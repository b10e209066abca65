"""A run as a film: what stands outside in space, with the time and the line of each level below it.

In: a system that runs. Out: an MP4, GIF or WebP file. Poses are kept while the system runs, and photographed when it is over, so that the
same run gives the same pictures.
"""

import io
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import accumulate
from pathlib import Path

import av
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from rcsc.base.host.files.write import write_atomically
from rcsc.run.levels import RunningLevel
from rcsc.run.plant.models.camera import Camera
from rcsc.run.plant.space import Space, space_of
from rcsc.run.system import System

FORMS = (".mp4", ".gif", ".webp")
FRAMES_A_SECOND = 25
WIDTH_PX, HEIGHT_PX = 800, 500
LARGEST_PX, SMALLEST_PX = 15, 10
"""Of letters of the caption."""
MOST_SEEN = 200
"""Moments that the eye is placed by."""
_BAND_PX, _BESIDE_PX = 46, 14
_INK, _SOFT, _PAPER = (30, 36, 42), (85, 96, 106), (246, 248, 250)
Lines = Sequence[tuple[str, str]]
"""Tables, each with the line that it ran."""
Caption = tuple[tuple[str, str], ...]
"""What stands beside each other below a picture: a name, and below it what is said of it."""


@dataclass(slots=True)
class Frame:
    """A picture to be made.

    Attributes:
        poses: Seven numbers a body.
        caption: What is said of it.
    """

    poses: "array[float]"
    caption: Caption


@dataclass(slots=True)
class Filming:
    """Keeps what a film of a run needs; in `System.watch`.

    Attributes:
        speed: Times as fast as the clock.
    """

    speed: float
    frames: list[Frame] = field(default_factory=list)
    _first: int = -1

    def __call__(self, system: System, due: tuple[RunningLevel, ...]) -> None:  # noqa: ARG002  # as all who watch
        """Take the tick that has just ended."""
        space = space_of(system.outside)
        if space is not None:
            lines = ((level.name, level.lines) for level in system.levels)
            self.take(system.tick, system.description.tick_ms, lambda: array("f", space.poses()), lines)

    def take(
        self, tick: int, tick_ms: int, poses: Callable[[], "array[float]"], lines: Iterable[tuple[str, Lines]]
    ) -> None:
        """Keep a tick, for each picture of the film that shows it.

        Args:
            tick: One after the last that was taken.
            tick_ms: How long one lasts.
            poses: Gives where everything is after it.
            lines: By level the tables and lines that it ran last.
        """
        self._first = tick if self._first < 0 else self._first
        tick_s = Fraction(tick_ms, 1000)
        ends_s = (tick - self._first + 1) * tick_s
        while len(self.frames) * Fraction(self.speed) / FRAMES_A_SECOND < ends_s:
            self.frames.append(Frame(poses(), _caption(float(tick * tick_s), self.speed, lines)))


def _caption(at_s: float, speed: float, lines: Iterable[tuple[str, Lines]]) -> Caption:
    """The time, with how fast it goes, and the line that each level ran last."""
    ran = (
        (name, ", ".join(f"{table}: {line}" for table, line in several if line)) for name, several in lines
    )
    return (("time" if speed == 1 else f"{speed:g} times as fast", f"{at_s:.2f} s"), *ran)


def filmed(
    form: str, frames: Sequence[Frame], space: Space, view: str, made: Callable[[int], None] = lambda _: None
) -> bytes:
    """Photograph the frames, and return the film.

    Args:
        form: One of `FORMS`.
        frames: At least one.
        space: Of the plant that ran; only its shapes are looked at.
        view: From where, as `camera.VIEWS` calls it.
        made: Takes the number of pictures so far, before each.

    Raises:
        NoPictureError: Nothing draws here without a screen.
    """
    apart = -(-len(frames) // MOST_SEEN)
    camera = Camera(
        space, WIDTH_PX, HEIGHT_PX - _BAND_PX, view, within=[frame.poses for frame in frames[::apart]]
    )
    captions = _Captions(frames)

    def pictures() -> Iterator[Image.Image]:
        for number, frame in enumerate(frames):
            made(number)
            yield captions.below(Image.fromarray(camera.picture(frame.poses)), frame)

    film = io.BytesIO()
    try:
        if form == ".mp4":
            _mp4(film, pictures())
        else:
            _animated(film, pictures(), form.removeprefix("."))
    finally:
        camera.close()
    return film.getvalue()


def write(path: Path, frames: Sequence[Frame], space: Space, view: str) -> None:
    """Write a film, whose form the suffix says.

    Raises:
        NoPictureError: Nothing draws here without a screen.
        OSError: The file cannot be written.
    """
    write_atomically(path, filmed(path.suffix, frames, space, view))


class _Captions:
    """Writes captions: a column for each part, as wide as the widest of it, so that nothing moves from one to the next."""

    def __init__(self, frames: Sequence[Frame]) -> None:
        """Args: frames: Of the film; their captions have the same parts."""
        parts = [
            {part for pair in column for part in pair}
            for column in zip(*(frame.caption for frame in frames), strict=True)
        ]
        for size in range(LARGEST_PX, SMALLEST_PX - 1, -1):
            self._font = ImageFont.load_default(size)
            wide = [max(map(self._font.getlength, column)) + _BESIDE_PX for column in parts]
            self._lefts = [_BESIDE_PX, *(_BESIDE_PX + at for at in accumulate(wide))]
            if self._lefts[-1] <= WIDTH_PX:
                break

    def below(self, picture: Image.Image, frame: Frame) -> Image.Image:
        """Return a picture with the caption of its frame."""
        whole = Image.new("RGB", (WIDTH_PX, HEIGHT_PX), _PAPER)
        whole.paste(picture, (0, 0))
        draw = ImageDraw.Draw(whole)
        for left, (name, text) in zip(self._lefts, frame.caption, strict=False):  # the last is where they end
            draw.text((left, HEIGHT_PX - 0.7 * _BAND_PX), name, fill=_SOFT, font=self._font, anchor="lm")
            draw.text((left, HEIGHT_PX - 0.3 * _BAND_PX), text, fill=_INK, font=self._font, anchor="lm")
        return whole


def _mp4(to: io.BytesIO, pictures: Iterator[Image.Image]) -> None:
    with av.open(to, "w", format="mp4") as film:
        stream = film.add_stream("libx264", rate=FRAMES_A_SECOND, options={"crf": "20"})
        stream.width, stream.height, stream.pix_fmt = WIDTH_PX, HEIGHT_PX, "yuv420p"
        for picture in pictures:
            film.mux(stream.encode(av.VideoFrame.from_ndarray(np.asarray(picture), format="rgb24")))
        film.mux(stream.encode())


def _animated(to: io.BytesIO, pictures: Iterator[Image.Image], form: str) -> None:
    first = next(pictures)
    first.save(
        to, form, save_all=True, append_images=pictures, duration=1000 // FRAMES_A_SECOND, loop=0, quality=60, method=4
    )  # fmt: skip

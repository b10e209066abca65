"""A run as a film: what stands outside in space, with the time and the line of each level below it.

In: a system that runs. Out: an MP4, GIF or WebP file. Poses are kept while the system runs, and photographed when it is over, so that the
same run gives the same pictures.
"""

import io
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
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
_BAND_PX, _BESIDE_PX = 30, 10
_INK, _PAPER = (30, 36, 42), (246, 248, 250)


@dataclass(slots=True)
class Frame:
    """A picture to be made.

    Attributes:
        poses: Seven numbers a body.
        caption: What stands below it.
    """

    poses: "array[float]"
    caption: str


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
        """Keep the poses of a tick, for each picture of the film that shows it."""
        space = space_of(system.outside)
        if space is None:
            return
        self._first = system.tick if self._first < 0 else self._first
        tick_s = Fraction(system.description.tick_ms, 1000)
        ends_s = (system.tick - self._first + 1) * tick_s
        while len(self.frames) * Fraction(self.speed) / FRAMES_A_SECOND < ends_s:
            self.frames.append(Frame(array("f", space.poses()), _caption(system, tick_s)))


def _caption(system: System, tick_s: Fraction) -> str:
    """The time, and the line that each level ran last."""
    lines = (
        (level.name, " ".join(f"{table}: {line}" for table, line in level.lines if line))
        for level in system.levels
    )
    said = "   ".join(f"{name}  {line}" for name, line in lines if line)
    return f"{float(system.tick * tick_s):.2f} s   {said}"


def write(path: Path, frames: list[Frame], space: Space, view: str) -> None:
    """Photograph the frames, and write the film.

    Args:
        path: The file; its suffix is one of `FORMS`.
        frames: At least one.
        space: Of the plant that ran.
        view: From where, as `camera.VIEWS` calls it.

    Raises:
        NoPictureError: Nothing draws here without a screen.
        OSError: The file cannot be written.
    """
    camera = Camera(space, WIDTH_PX, HEIGHT_PX - _BAND_PX, view)
    font = _font(max((frame.caption for frame in frames), key=len))
    try:
        pictures = (_with_caption(camera, frame, font) for frame in frames)
        film = io.BytesIO()
        if path.suffix == ".mp4":
            _mp4(film, pictures)
        else:
            _animated(film, pictures, path.suffix.removeprefix("."))
    finally:
        camera.close()
    write_atomically(path, film.getvalue())


def _font(longest: str) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The largest letters in which the longest caption has room."""
    sizes = range(LARGEST_PX, SMALLEST_PX - 1, -1)
    fonts = [ImageFont.load_default(size) for size in sizes]
    return next((font for font in fonts if font.getlength(longest) <= WIDTH_PX - 2 * _BESIDE_PX), fonts[-1])


def _with_caption(
    camera: Camera, frame: Frame, font: ImageFont.FreeTypeFont | ImageFont.ImageFont
) -> Image.Image:
    picture = Image.new("RGB", (WIDTH_PX, HEIGHT_PX), _PAPER)
    picture.paste(Image.fromarray(camera.picture(frame.poses)), (0, 0))
    middle = (_BESIDE_PX, HEIGHT_PX - _BAND_PX // 2)
    ImageDraw.Draw(picture).text(middle, frame.caption, fill=_INK, font=font, anchor="lm")
    return picture


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

"""Film of recorded runs.

python -m docs.film recordings/*.mcap --output film.mp4
python -m docs.film recordings/three-cylinders.mcap --gif docs/guide/run.gif
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import matplotlib as mpl
import numpy as np
import tyro
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from docs.film.picture import Painter
from docs.film.recorded_run import RecordedRun

RATE = 30
"""Rate of the video [Hz]."""
GIF_RATE = 12
"""Rate of a GIF [Hz]."""
TITLE_TIME = 2.5
"""Time that a run stands still below its title [s]."""
REST_TIME = 2.5
"""Time that a run stands still at its end [s]."""
VIEW_ANGLE = -1.05
"""Angle of the camera about the vertical, from the x axis [rad]."""
GIF_COLORS = 64
"""Number of colours of a GIF."""
FONT = Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
"""Font of titles and figures."""


@dataclass(frozen=True)
class FilmSettings:
    """Files that are read and written."""

    recordings: tyro.conf.Positional[tuple[Path, ...]]
    """Recordings, in the order of the film."""
    output: Path | None = None
    """Video to write (.mp4)."""
    gif: Path | None = None
    """GIF to write, of the first recording."""
    size: tuple[int, int] = (1280, 720)
    """Columns and rows of the video [pixels]."""
    gif_size: tuple[int, int] = (480, 288)
    """Columns and rows of the GIF [pixels]."""


def main(settings: FilmSettings) -> None:
    """Write a video of all recordings, a GIF of the first one, or both.

    Args:
        settings: Files.

    Raises:
        ValueError: A recording cannot be read or holds no run; the video cannot be written.
    """
    if settings.output is not None:
        _write_video(settings)
    if settings.gif is not None:
        _write_gif(settings.recordings[0], settings.gif, settings.gif_size)


def frames(
    run: RecordedRun, size: tuple[int, int], rate: int
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """Yield the pictures of a run, blue first.

    Args:
        run: Run.
        size: Columns and rows [pixels].
        rate: Pictures a second [Hz].
    """
    rope, limits = run.scenario.rope, run.scenario.limits
    whole = np.concatenate([run.at(0.0).nodes, run.at(run.duration).nodes, run.at(0.0).goal])
    low, high = whole.min(0), whole.max(0)
    middle = (low + high) / 2.0 - np.array([0.0, 0.0, 0.05])
    distance = 0.7 + 1.2 * float(np.linalg.norm(high - low))
    away = np.array([0.75 * np.cos(VIEW_ANGLE), 0.75 * np.sin(VIEW_ANGLE), 0.6])
    painter = Painter(size, tuple(middle + distance * away), tuple(middle))
    title = run.scenario.description or run.scenario.name
    for k in range(round((TITLE_TIME + run.duration + REST_TIME) * rate)):
        time = k / rate - TITLE_TIME
        instant = run.at(min(max(time, 0.0), run.duration))
        image = painter.paint(instant, rope.diameter / 2.0, limits.gripper_radius)
        yield _captioned(image, title, max(time, 0.0), 1e3 * instant.error)


def _captioned(image: np.ndarray, title: str, time: float, error: float) -> np.ndarray:
    """The picture with its title above and time and error below."""
    height = image.shape[0]
    picture = Image.fromarray(image)
    draw = ImageDraw.Draw(picture)
    size = max(height // 30, 11)
    small = ImageFont.truetype(FONT, size)
    lines = "\n".join(textwrap.wrap(title, round(1.7 * image.shape[1] / size)))
    draw.multiline_text((size, size), lines, (235, 235, 235), small)
    text = f"{time:4.1f} s     distance to the goal {error:.1f} mm"
    draw.text((size, height - 2 * size), text, (235, 235, 235), small)
    return np.asarray(picture)


def _write_video(settings: FilmSettings) -> None:
    code = cv2.VideoWriter.fourcc(*"mp4v")
    video = cv2.VideoWriter(str(settings.output), code, RATE, settings.size)
    if not video.isOpened():
        raise ValueError(f"{settings.output} cannot be written; name a file that ends with .mp4")
    count = 0
    for file in settings.recordings:
        for image in frames(RecordedRun(file), settings.size, RATE):
            video.write(image)
            count += 1
    video.release()
    print(f"{settings.output}: {count / RATE:.0f} s")


def _write_gif(recording: Path, file: Path, size: tuple[int, int]) -> None:
    # One palette for all pictures, so that only what moves is stored.
    images = [Image.fromarray(i[..., ::-1]) for i in frames(RecordedRun(recording), size, GIF_RATE)]
    palette = images[len(images) // 2].quantize(GIF_COLORS)
    first, *others = [i.quantize(palette=palette, dither=Image.Dither.NONE) for i in images]
    first.save(file, save_all=True, append_images=others, duration=1000 // GIF_RATE, loop=0)
    print(f"{file}: {len(images) / GIF_RATE:.0f} s, {file.stat().st_size} bytes")


if __name__ == "__main__":
    main(tyro.cli(FilmSettings, description=__doc__))

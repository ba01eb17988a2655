"""GIF of a recorded run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from PIL import Image

from shared.recording import Recording
from shared.video.recorded_run import RecordedRun
from shared.video.video import Picture, VideoSettings, run_pictures

GIF = VideoSettings(size=(480, 288), rate=12, title_time=1.0)
"""Settings of a GIF."""
GIF_COLORS = 64
"""Number of colours of a GIF."""


def write_gif(recording: Recording, file: Path, settings: VideoSettings = GIF) -> float:
    """Write a GIF of a recorded run, and return its duration [s]."""
    return encode_gif(run_pictures(RecordedRun(recording), settings), file, settings)


def encode_gif(pictures: Iterable[Picture], file: Path, settings: VideoSettings = GIF) -> float:
    """Write pictures as a GIF and return its duration [s]."""
    # One palette for all pictures, so that only what moves is stored; in it, small things keep
    # their colour.
    images = [Image.fromarray(p[..., ::-1]) for p in pictures]
    palette = images[len(images) // 2].quantize(GIF_COLORS, Image.Quantize.MAXCOVERAGE)
    first, *others = [i.quantize(palette=palette, dither=Image.Dither.NONE) for i in images]
    duration = 1000 // settings.rate
    first.save(file, save_all=True, append_images=others, duration=duration, loop=0)
    return len(images) / settings.rate

"""Video of recorded runs: pictures of each run in real time, below its title."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import av
import cv2
import numpy as np
from jaxtyping import UInt8

from shared.recording import Recording
from shared.video.framing import Rectangle, Viewpoint, azimuth_of, frame, points_of
from shared.video.picture import Renderer
from shared.video.recorded_run import RecordedRun

Picture = UInt8[np.ndarray, "h w 3"]
"""Picture, blue first."""


@dataclass(frozen=True)
class VideoSettings:
    """Size and duration of a video."""

    size: tuple[int, int] = (1280, 720)
    """Columns and rows [pixels]."""
    rate: int = 25
    """Pictures a second [Hz]."""
    title_time: float = 2.5
    """Time that a run stands still at its start [s]."""
    rest_time: float = 2.5
    """Time that a run stands still at its end [s]."""


VIDEO = VideoSettings()
"""Settings of a video."""
CODEC = "libvpx-vp9"
"""Encoder of a video in an MP4 file: VP9, which browsers play."""
CODEC_OPTIONS = {"deadline": "realtime", "cpu-used": "7", "crf": "24", "b:v": "0"}
"""Settings of the encoder: fast, at a constant quality."""
AREA: Rectangle = (0.04, 0.2, 0.96, 0.91)
"""Part of the picture in which the run is seen, between title and measures."""
INSET_WIDTH = 0.24
"""Width of the camera's image in that of the picture [-]."""
INSET_MARGIN = 0.015
"""Distance of the camera's image from the edges, in the width of the picture [-]."""
TEXT_COLOR = (235, 235, 235)
"""Colour of text: blue, green, red."""
FONT, TEXT_WEIGHT = "sans", 400
"""Font of OpenCV, and its weight."""


def write_video(
    recordings: Sequence[Recording],
    file: Path,
    settings: VideoSettings = VIDEO,
    watch: Callable[[float], None] | None = None,
) -> float:
    """Write a video of recorded runs, one after the other, and return its duration [s]."""

    def pictures() -> Iterator[Picture]:
        for number, recording in enumerate(recordings):
            run = RecordedRun(recording)
            count = picture_count(run, settings)
            for k, picture in enumerate(run_pictures(run, settings)):
                if watch:
                    watch((number + k / count) / len(recordings))
                yield picture

    return encode_video(pictures(), file, settings)


def encode_video(pictures: Iterable[Picture], file: Path, settings: VideoSettings = VIDEO) -> float:
    """Write pictures as a video and return its duration [s]."""
    if file.suffix != ".mp4":
        raise ValueError(f"a video is named *.mp4, got {file}")
    # Under its final name only once it is whole.
    count, unfinished = 0, file.with_name(f".{file.name}")
    try:
        with av.open(str(unfinished), "w") as video:
            stream = video.add_stream(CODEC, settings.rate, options=CODEC_OPTIONS)
            stream.width, stream.height = settings.size
            stream.pix_fmt = "yuv420p"
            for picture in pictures:
                video.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "bgr24")))
                count += 1
            video.mux(stream.encode(None))
        unfinished.replace(file)
    except OSError as error:
        raise ValueError(
            f"{file} cannot be written ({error.strerror}); is its folder there, and writable?"
        ) from error
    finally:
        unfinished.unlink(missing_ok=True)
    return count / settings.rate


def picture_count(run: RecordedRun, settings: VideoSettings = VIDEO) -> int:
    """Return the number of pictures of a run."""
    total = settings.title_time + run.duration + settings.rest_time
    return round(total * settings.rate)


def run_pictures(run: RecordedRun, settings: VideoSettings = VIDEO) -> Iterator[Picture]:
    """Yield the pictures of a run."""
    rope, limits = run.scenario.rope, run.scenario.limits
    viewpoint, inset = _viewpoint(run, settings.size)
    renderer = Renderer(settings.size, viewpoint.eye, viewpoint.target)
    title = run.scenario.description or run.scenario.name
    for k in range(picture_count(run, settings)):
        time = k / settings.rate - settings.title_time
        instant = run.at(min(max(time, 0.0), run.duration))
        picture = renderer.paint(instant, rope.diameter / 2.0, limits.gripper_radius)
        if instant.view is not None:
            _show_view(picture, instant.view, inset)
        _caption(picture, title, max(time, 0.0), 1e3 * instant.error)
        yield picture


def write_text(picture: Picture, text: str, place: tuple[int, int], size: int) -> None:
    """Write a line of text into a picture, from its lower left corner on [pixels]."""
    cv2.putText(picture, text, place, TEXT_COLOR, cv2.FontFace(FONT), size, TEXT_WEIGHT)


def _viewpoint(run: RecordedRun, size: tuple[int, int]) -> tuple[Viewpoint, Rectangle]:
    """Viewpoint of a run, and the right corner for the camera's image that leads it nearest."""
    points, azimuth, view = points_of(run), azimuth_of(run), run.at(0.0).view
    columns, rows = (4, 3) if view is None else (view.shape[1], view.shape[0])
    height = INSET_WIDTH * rows / columns * size[0] / size[1]
    left, margin = 1.0 - INSET_MARGIN - INSET_WIDTH, INSET_MARGIN * size[0] / size[1]
    corners: list[Rectangle] = [
        (left, upper, left + INSET_WIDTH, upper + height)
        for upper in (margin, 1.0 - margin - height)
    ]
    views = [
        (frame(points, size, azimuth, AREA, None if view is None else corner), corner)
        for corner in corners
    ]
    return min(views, key=lambda pair: pair[0].distance)


def _show_view(picture: Picture, view: Picture, area: Rectangle) -> None:
    """Put the camera's image into a part of the picture."""
    rows, columns = picture.shape[:2]
    left, upper, right, lower = (
        round(share * count) for share, count in zip(area, (columns, rows) * 2, strict=True)
    )
    size = (right - left, lower - upper)
    picture[upper:lower, left:right] = cv2.resize(view, size, interpolation=cv2.INTER_AREA)


def _caption(picture: Picture, title: str, time: float, error: float) -> None:
    """Write the title above, and time and error below."""
    height, width = picture.shape[:2]
    size = max(height // 30, 13)
    for k, line in enumerate(textwrap.wrap(title, round(1.3 * width / size))):
        write_text(picture, line, (size, round((2.0 + 1.3 * k) * size)), size)
    text = f"{time:4.1f} s     distance to the goal {error:.1f} mm"
    write_text(picture, text, (size, height - size), size)

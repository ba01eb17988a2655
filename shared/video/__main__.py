"""Video of recorded runs, with the percentage that is done on standard output."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import tyro

from shared.recording import Recording
from shared.video.video import VideoSettings, write_video

SETTINGS = VideoSettings(size=(960, 540), rate=15, title_time=1.0, rest_time=1.0)
"""Settings of the video: a quarter of the time of `VIDEO`, because a cell runs beside."""
NICENESS = 19
"""Scheduling priority, nice(2): a cell that runs comes first."""


def main(
    recordings: Annotated[tuple[Path, ...], tyro.conf.Positional],
    /,
    output: Path,
    settings: VideoSettings = SETTINGS,
) -> None:
    """Write a video of recorded runs, one after the other.

    Args:
        recordings: Recordings.
        output: Video, *.mp4.
        settings: Size and duration.
    """
    os.nice(NICENESS)
    printed = -1

    def show(fraction: float) -> None:
        nonlocal printed
        if (percent := int(100.0 * fraction)) > printed:
            printed = percent
            # A parent that has died reads no more, and this ends the process, too.
            print(percent, flush=True)

    write_video(tuple(map(Recording.open, recordings)), output, settings, show)


if __name__ == "__main__":
    tyro.cli(main)

"""`lariat export FILE`: a recording for other tools."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import tyro

from cli.export import foxglove_layout, rerun_file, ros2_bag, tables
from lariat.configuration import ConfigurationError, refusing
from shared.recording import Recording

Format = Literal["csv", "parquet", "ros2", "rerun", "foxglove-layout", "lerobot", "video", "gif"]
"""Formats of `lariat export`."""
OUTPUT_NAMES: dict[Format, str] = {
    "csv": "{stem}_csv",
    "parquet": "{stem}_parquet",
    "ros2": "{stem}_ros2",
    "rerun": "{stem}.rrd",
    "foxglove-layout": "{stem}.foxglove.json",
    "lerobot": "{stem}_lerobot",
    "video": "{stem}.mp4",
    "gif": "{stem}.gif",
}
"""Name of the written file or folder by the format; it lies beside the recording."""
JOINING: tuple[Format, ...] = ("lerobot", "video")
"""Formats that join several recordings."""


def main(
    files: tyro.conf.Positional[tuple[Path, ...]],
    /,
    to: Format,
    output: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None,
) -> int:
    """Export a recording for other tools, or several as one data set.

    csv and parquet write one table for each topic with values; ros2 a rosbag2 of standard messages;
    rerun a file of Rerun's own with the arrangement of its views beside it; foxglove-layout the
    arrangement of Foxglove's and Lichtblick's panels for this recording; lerobot a data set with an
    episode for each of several recordings; video and gif pictures of the run, drawn from its
    messages in real time.

    Examples:
      lariat export recordings/run.mcap --to csv
      lariat export recordings/run.mcap --to ros2 --output /tmp/bag
      lariat export recordings/run.mcap --to foxglove-layout
      lariat export recordings/*.mcap --to lerobot --output /tmp/dataset
      lariat export recordings/*.mcap --to video --output /tmp/film.mp4

    Args:
        files: The recording, whole or cut; several for lerobot and video.
        to: Format of the export.
        output: File or folder to write, which must not exist. Default: beside a single recording.
    """
    if len(files) != 1 and to not in JOINING:
        raise ConfigurationError(
            f"--to {to} takes one recording and was given {len(files)}; several are joined by "
            f"--to {' and --to '.join(JOINING)}"
        )
    if output is None and len(files) != 1:
        raise ConfigurationError(
            f"{len(files)} recordings need --output PATH for what they are joined to"
        )
    path = output or _beside(next(iter(files)), to)
    if path.exists():
        raise ConfigurationError(f"{path} exists; name another --output or remove it")
    with refusing(f"cannot export {', '.join(map(str, files))}"):
        recordings = tuple(map(Recording.open, files))
        for recording in recordings:
            recording.start()
        try:
            print(write(recordings, to, path))
        except ModuleNotFoundError as error:
            raise ConfigurationError(
                f"--to {to} needs {error.name}, which is not installed; run in the clone: "
                "pip install -e '.[viewers]'"
            ) from error
    for recording in recordings:
        if count := recording.door.refused:
            print(
                f"lariat: {count} messages of {recording.path} that cannot be read are left out",
                file=sys.stderr,
            )
    return 0


def _beside(file: Path, to: Format) -> Path:
    return file.with_name(OUTPUT_NAMES[to].format(stem=file.stem))


def write(recordings: tuple[Recording, ...], to: Format, path: Path) -> str:
    """Write an export, of several recordings for a data set or video; return a line about it."""
    recording = recordings[0]
    match to:
        case "csv":
            return tables.write_csv(recording, path)
        case "parquet":
            return tables.write_parquet(recording, path)
        case "ros2":
            return ros2_bag.write(recording, path)
        case "rerun":
            return rerun_file.write(recording, path)
        case "foxglove-layout":
            return foxglove_layout.write(recording, path)
        case "lerobot":
            # Imported late: only this format needs pyarrow and OpenCV.
            from cli.export.lerobot import files

            return files.write(recordings, path)
        case "video" | "gif":
            # Imported late: only these formats need OpenCV and Pillow.
            from shared.video import gif, video

            if to == "gif":
                duration = gif.write_gif(recording, path)
            else:
                duration = video.write_video(recordings, path)
            return f"{path}: {duration:.0f} s"

"""`lariat export FILE`: a recording for other tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro

from cli.export import foxglove_layout, rerun_file, ros2_bag, tables
from shared.configuration import ConfigurationError
from shared.recording import Recording

Format = Literal["csv", "parquet", "ros2", "rerun", "foxglove-layout"]
"""Formats of `lariat export`."""
OUTPUT_NAMES: dict[Format, str] = {
    "csv": "{stem}_csv",
    "parquet": "{stem}_parquet",
    "ros2": "{stem}_ros2",
    "rerun": "{stem}.rrd",
    "foxglove-layout": "{stem}.foxglove.json",
}
"""Name of the written file or folder by the format; it lies beside the recording."""


def main(
    file: tyro.conf.Positional[Path],
    /,
    to: Format,
    output: Annotated[Path | None, tyro.conf.arg(metavar="PATH")] = None,
) -> int:
    """Export a recording for other tools.

    csv and parquet write one table for each topic with values; ros2 a rosbag2 of standard messages;
    rerun a file of Rerun's own with the arrangement of its views beside it; foxglove-layout the
    arrangement of Foxglove's and Lichtblick's panels for this recording.

    Examples:
      lariat export recordings/run.mcap --to csv
      lariat export recordings/run.mcap --to ros2 --output /tmp/bag
      lariat export recordings/run.mcap --to foxglove-layout

    Args:
        file: The recording, whole or cut.
        to: Format of the export.
        output: File or folder to write, which must not exist. Default: beside the recording.
    """
    path = output or file.with_name(OUTPUT_NAMES[to].format(stem=file.stem))
    if path.exists():
        raise ConfigurationError(f"{path} exists; name another --output or remove it")
    try:
        recording = Recording.open(file)
        print(write(recording, to, path))
    except ValueError as error:
        raise ConfigurationError(f"cannot export {file}: {error}") from error
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            f"--to {to} needs {error.name}, which is not installed; run in the clone: "
            "pip install -e './stack[viewers]'"
        ) from error
    except OSError as error:
        raise ConfigurationError(f"cannot write {path}: {error}") from error
    return 0


def write(recording: Recording, to: Format, path: Path) -> str:
    """Write an export.

    Args:
        recording: The recording.
        to: Format of the export.
        path: File or folder to write.

    Returns:
        One line about what was written.

    Raises:
        ValueError: The recording cannot be read, or lacks what the format needs.
        OSError: The path cannot be written.
        ModuleNotFoundError: The format needs a library that is not installed.
    """
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

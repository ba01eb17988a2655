"""Reading of regular files of a bounded size: no device, no pipe, nothing outside of a folder."""

from __future__ import annotations

import os
from pathlib import Path


def read_file(path: Path, max_size: int) -> bytes:
    """Return the content of a regular file.

    Args:
        path: The file, or a link to it.
        max_size: Largest size [bytes].

    Raises:
        ValueError: The path is no regular file, or the file is larger; the text says which.
        OSError: The file cannot be read.
    """
    # A device or a pipe may never end, and opening a pipe may never return.
    if path.exists() and not path.is_file():
        raise ValueError("not a regular file")
    with path.open("rb") as stream:
        content = stream.read(max_size + 1)
    if len(content) > max_size:
        raise ValueError(f"larger than {max_size / 2**20:g} MiB")
    return content


def path_inside(folder: Path, name: str) -> Path:
    """Return the path of a file by its name, which may not lead out of its folder.

    Args:
        folder: The folder.
        name: Relative path inside of it.

    Raises:
        ValueError: The name is absolute, contains `..`, or is a link to a place outside.
    """
    path = folder / name
    outside = Path(name).is_absolute() or ".." in Path(name).parts or "\0" in name
    # realpath, unlike resolve, takes links that lead in a circle: whoever opens them is refused.
    if outside or not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise ValueError(f"{name!r} lies outside of {folder}; place the file in that folder")
    return path

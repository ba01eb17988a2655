"""NumPy arrays from files: the size that a header claims is bounded before room is taken for it."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import IO

import numpy as np


def read_array(stream: IO[bytes], max_size: int) -> np.ndarray:
    """Return the array of an NPY file.

    Args:
        stream: The file, at its begin; it can be read again from there.
        max_size: Largest size of the array [bytes].

    Raises:
        ValueError: The array is larger, holds objects, or the file is damaged.
    """
    major, _ = np.lib.format.read_magic(stream)
    headers = np.lib.format.read_array_header_1_0, np.lib.format.read_array_header_2_0
    shape, _, dtype = headers[major > 1](stream)
    # NumPy takes the room that a header claims before it finds out that the file is shorter.
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize > max_size:
        raise ValueError(f"an array claims shape {shape}, more than {max_size / 2**20:g} MiB")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)


def read_arrays(path: Path, names: Sequence[str], max_size: int) -> list[np.ndarray]:
    """Return arrays of an NPZ file by their names.

    Args:
        path: The file.
        names: Names of the arrays.
        max_size: Largest size of each [bytes].

    Raises:
        KeyError: The file lacks one; the error's argument lists those that it has.
        ValueError: An array is larger or holds objects, or the file is damaged.
        OSError: The file cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            own = [name.removesuffix(".npy") for name in archive.namelist()]
            for name in names:
                if name not in own:
                    raise KeyError(name, own)
            return [_member(archive, name, max_size) for name in names]
    except zipfile.BadZipFile as error:
        raise ValueError(str(error)) from error


def _member(archive: zipfile.ZipFile, name: str, max_size: int) -> np.ndarray:
    with archive.open(f"{name}.npy") as stream:
        return read_array(stream, max_size)

"""Depth images from files: PNG of 16 bits, or NumPy arrays."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.files.bounded_file import read_file
from lariat.files.image_header import MAX_PIXEL_COUNT, PNG_SIGNATURE, check_image

MAX_DEPTH_SIZE = 128 * 2**20
"""Largest file of a depth image [bytes]."""
PNG_UNIT = 1e-3
"""Length of the unit of a PNG, as most depth cameras write it, if none is given [m]."""
SUFFIXES = (".png", ".npy")
"""Endings of the files that are read."""


def read_depth(path: Path, scale: float | None = None) -> Float64[np.ndarray, "h w"]:
    """Return the depth of each pixel; zero or not finite without a measurement [m].

    Args:
        path: PNG of 16 bits, or `.npy` file of a two-dimensional array.
        scale: Length of the file's unit [m]; by default a millimetre in a PNG, a metre in an array.

    Raises:
        ValueError: The file is of another kind, too large, or damaged; the text says which.
        OSError: The file cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{path} ends in {suffix!r}; give a depth image as PNG or NPY")
    content = read_file(path, MAX_DEPTH_SIZE)
    image = _png(content) if suffix == ".png" else _array(content)
    unit = scale if scale is not None else PNG_UNIT if suffix == ".png" else 1.0
    return unit * image.astype(np.float64)


def _png(content: bytes) -> np.ndarray:
    import cv2

    if not content.startswith(PNG_SIGNATURE):
        raise ValueError("is damaged, or no PNG")
    check_image(content)
    image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise ValueError("is damaged, or no PNG")
    if image.dtype != np.uint16 or image.ndim != 2:
        raise ValueError(f"has pixels of {image.dtype}{image.shape[2:]}; a depth image has 16 bits")
    return image


def _array(content: bytes) -> np.ndarray:
    file = io.BytesIO(content)
    try:
        shape = _claimed_shape(file)
        # NumPy takes the room that a header claims before it finds out that the file is shorter.
        holds = len(shape) == 2 and 1 <= math.prod(shape) <= MAX_PIXEL_COUNT
        image = np.load(file, allow_pickle=False) if holds else None
    except (ValueError, EOFError) as error:
        raise ValueError(f"is damaged, or no array: {error}") from error
    if image is None:
        raise ValueError(
            f"has shape {shape}; a depth image has rows and columns, and at most "
            f"{MAX_PIXEL_COUNT} pixels"
        )
    if image.dtype.kind not in "fui":
        raise ValueError("holds no array of numbers")
    return image


def _claimed_shape(file: io.BytesIO) -> tuple[int, ...]:
    """Return the shape that the header of an NPY file claims; the file is at its begin again."""
    major, _ = np.lib.format.read_magic(file)
    headers = np.lib.format.read_array_header_1_0, np.lib.format.read_array_header_2_0
    shape, _, _ = headers[major > 1](file)
    file.seek(0)
    return shape

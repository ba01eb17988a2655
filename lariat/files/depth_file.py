"""Depth images from files: PNG of 16 bits, or NumPy arrays."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.files.array_file import read_array
from lariat.files.bounded_file import read_file
from lariat.files.image_header import MAX_PIXEL_COUNT, PNG_SIGNATURE

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

    from lariat.files.image_file import decode_image

    if not content.startswith(PNG_SIGNATURE):
        raise ValueError("is no PNG")
    image = decode_image(content, cv2.IMREAD_UNCHANGED)
    if image.dtype != np.uint16 or image.ndim != 2:
        raise ValueError(f"has pixels of {image.dtype}{image.shape[2:]}; a depth image has 16 bits")
    return image


def _array(content: bytes) -> np.ndarray:
    try:
        image = read_array(io.BytesIO(content), MAX_DEPTH_SIZE)
    except (ValueError, EOFError) as error:
        raise ValueError(f"is damaged, or no array: {error}") from error
    if image.ndim != 2 or not 1 <= image.size <= MAX_PIXEL_COUNT:
        raise ValueError(
            f"has shape {image.shape}; a depth image has rows and columns, and at most "
            f"{MAX_PIXEL_COUNT} pixels"
        )
    if image.dtype.kind not in "fui":
        raise ValueError("holds no array of numbers")
    return image

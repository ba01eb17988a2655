"""Pixels of image files of others; what the decoding library prints is read, not shown."""

from __future__ import annotations

import cv2
import numpy as np

from lariat.files.image_header import MAX_PIXEL_COUNT, check_image
from lariat.files.library_output import kept_prints

DAMAGE = ("libpng error", "premature end")
"""Words of libpng and libjpeg about missing pixels; warnings about colour profiles are others."""


def decode_image(content: bytes, flags: int, max_pixel_count: int = MAX_PIXEL_COUNT) -> np.ndarray:
    """Return the pixels of a PNG or a JPEG, in OpenCV's order of colours.

    It redirects the standard error of the whole process for a moment: for commands, not services.

    Args:
        content: Content of the file.
        flags: Flags of `cv2.imdecode`.
        max_pixel_count: Largest number of pixels.

    Raises:
        ValueError: It is no such image, has too many pixels, or is damaged.
    """
    check_image(content, max_pixel_count)
    with kept_prints() as printed:
        try:
            image = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
        except cv2.error:
            image = None
    if image is None or any(words in line for line in printed for words in DAMAGE):
        raise ValueError("the image is damaged")
    return image

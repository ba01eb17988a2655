"""Pixels of image files of others; what the decoding library prints is read, not shown."""

from __future__ import annotations

import os
import tempfile

import cv2
import numpy as np

from lariat.files.image_header import MAX_PIXEL_COUNT, check_image

STANDARD_ERROR = 2
"""File descriptor to which libpng and libjpeg print."""
DAMAGE = (b"libpng error", b"premature end")
"""Words of these libraries about pixels that are missing; warnings about colour profiles are none
of them."""


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
    shown = os.dup(STANDARD_ERROR)
    try:
        with tempfile.TemporaryFile() as printed:
            os.dup2(printed.fileno(), STANDARD_ERROR)
            try:
                image = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
            except cv2.error:
                image = None
            finally:
                os.dup2(shown, STANDARD_ERROR)
            printed.seek(0)
            said = printed.read()
    finally:
        os.close(shown)
    if image is None or any(words in said for words in DAMAGE):
        raise ValueError("the image is damaged")
    return image

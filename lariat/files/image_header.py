"""Header of a compressed image: its size is known and bounded before a pixel is decoded.

A PNG of a few megabytes can claim gigabytes of pixels, and a progressive JPEG can repeat its scans
until decoding takes minutes.
"""

from __future__ import annotations

import struct

import numpy as np

MAX_PIXEL_COUNT = 2**24
"""Largest number of pixels of an image on the bus; decoding takes up to 0.8 s."""
MAX_SCAN_COUNT = 64
"""Largest number of scans of a JPEG; a progressive one has about ten."""
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
JPEG_START = b"\xff\xd8\xff"
_START_OF_SCAN = 0xFF, 0xDA
_FRAME_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Markers of a JPEG's frame header, which holds its size."""
_BARE_MARKERS = frozenset({0x01, *range(0xD0, 0xD9)})
"""Markers of a JPEG without a length and content."""


def check_image(data: bytes, max_pixel_count: int = MAX_PIXEL_COUNT) -> tuple[int, int]:
    """Return width and height [pixels] of a PNG or a JPEG that is cheap enough to decode.

    Args:
        data: Content of the image file.
        max_pixel_count: Largest number of pixels.

    Raises:
        ValueError: The data is neither a PNG nor a JPEG, or decoding it would take too long.
    """
    if data.startswith(PNG_SIGNATURE):
        width, height = _png_size(data)
    elif data.startswith(JPEG_START):
        width, height = _jpeg_size(data)
        scans = _scan_count(data)
        if scans > MAX_SCAN_COUNT:
            raise ValueError(f"the JPEG has {scans} scans, more than {MAX_SCAN_COUNT}")
    else:
        raise ValueError(f"the image ({len(data)} bytes) is neither a PNG nor a JPEG")
    if not 0 < width * height <= max_pixel_count:
        raise ValueError(f"the image has {width} x {height} pixels; 1 to {max_pixel_count} decode")
    return width, height


def _scan_count(data: bytes) -> int:
    """Number of scans of a JPEG."""
    # `bytes.count` takes six times as long.
    values, (first, second) = np.frombuffer(data, np.uint8), _START_OF_SCAN
    return int(np.count_nonzero((values[:-1] == first) & (values[1:] == second)))


def _png_size(data: bytes) -> tuple[int, int]:
    # The header chunk must be the first one: length, type, width, height.
    if len(data) < 24 or data[12:16] != b"IHDR":
        raise ValueError("the PNG has no header")
    return struct.unpack(">II", data[16:24])


def _jpeg_size(data: bytes) -> tuple[int, int]:
    position = 2
    while position + 4 <= len(data) and data[position] == 0xFF:
        marker = data[position + 1]
        if marker == 0xFF:  # A fill byte before the marker.
            position += 1
        elif marker in _BARE_MARKERS:
            position += 2
        elif marker in _FRAME_MARKERS and position + 9 <= len(data):
            height, width = struct.unpack(">HH", data[position + 5 : position + 9])
            return width, height
        else:
            position += 2 + struct.unpack(">H", data[position + 2 : position + 4])[0]
    raise ValueError("the JPEG has no frame header")

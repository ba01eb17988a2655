"""Header of an image: its size without its pixels."""

from __future__ import annotations

import struct
import zlib
from contextlib import suppress

import cv2
import numpy as np
import pytest

from lariat.files.image_header import MAX_SCAN_COUNT, PNG_SIGNATURE, check_image


def png_header(width: int, height: int) -> bytes:
    """Begin of a PNG that claims a size."""
    body = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return PNG_SIGNATURE + struct.pack(">I", 13) + body + struct.pack(">I", zlib.crc32(body))


@pytest.mark.parametrize("ending", [".png", ".jpg"])
@pytest.mark.parametrize("flags", [[], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]])
def test_size_is_the_one_of_the_decoded_image(ending: str, flags: list[int]) -> None:
    picture = np.zeros((7, 13, 3), np.uint8)
    if ending == ".png":
        flags = []
    assert check_image(cv2.imencode(ending, picture, flags)[1].tobytes()) == (13, 7)


def test_png_that_claims_gigabytes_of_pixels_is_refused() -> None:
    with pytest.raises(ValueError, match="30000 x 30000 pixels"):
        check_image(png_header(30000, 30000))


def test_image_without_pixels_is_refused() -> None:
    with pytest.raises(ValueError, match="0 x 5 pixels"):
        check_image(png_header(0, 5))


def test_jpeg_of_endless_scans_is_refused() -> None:
    data = cv2.imencode(".jpg", np.zeros((8, 8, 3), np.uint8))[1].tobytes()
    scan = data[data.index(b"\xff\xda") : -2]
    with pytest.raises(ValueError, match="scans"):
        check_image(data[:-2] + MAX_SCAN_COUNT * scan + data[-2:])


@pytest.mark.parametrize(
    "data", [b"", b"GIF89a", PNG_SIGNATURE, b"\xff\xd8\xff", b"\xff\xd8\xff\xe0\0"]
)
def test_what_has_no_header_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"neither|no header|no frame header"):
        check_image(data)


def test_no_cut_of_an_image_raises_anything_else() -> None:
    data = cv2.imencode(".jpg", np.zeros((8, 8, 3), np.uint8))[1].tobytes()
    for length in range(len(data)):
        with suppress(ValueError):
            assert check_image(data[:length]) == (8, 8)

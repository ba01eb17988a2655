from __future__ import annotations

import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from services.perception.decoding import decode_color, decode_frame
from shared.camera_messages import color_message

COLOR_IMAGE = CompressedImage(
    data=cv2.imencode(".jpg", np.zeros((4, 4, 3), np.uint8))[1].tobytes(), format="jpeg"
)
PIXELS = np.arange(16, dtype="<u2").reshape(4, 4)
DEPTH_IMAGE = RawImage(width=4, height=4, encoding="16UC1", step=8, data=PIXELS.tobytes())


@pytest.mark.parametrize(
    ("color", "depth", "reason"),
    [
        (CompressedImage(data=b"x"), DEPTH_IMAGE, "colour image"),
        (
            COLOR_IMAGE,
            RawImage(width=4, height=4, encoding="16UC1", step=8, data=b"xy"),
            "2 bytes, too few",
        ),
        (
            COLOR_IMAGE,
            RawImage(width=4, height=4, encoding="rgb8", step=16, data=bytes(64)),
            "'rgb8'",
        ),
    ],
    ids=["color", "truncated", "encoding"],
)
def test_images_that_cannot_be_decoded_are_named(
    color: CompressedImage, depth: RawImage, reason: str
) -> None:
    assert reason in str(decode_frame(color, depth))


def test_integer_depth_is_returned_unchanged() -> None:
    images = decode_frame(COLOR_IMAGE, DEPTH_IMAGE)
    assert not isinstance(images, str)
    np.testing.assert_array_equal(images[1], PIXELS)


def test_float_depth_is_rounded_to_millimetres_and_invalid_values_become_zero() -> None:
    metres = np.array([[np.nan, 0.5004], [np.inf, -1.0]], "<f4")
    depth = RawImage(width=2, height=2, encoding="32FC1", step=8, data=metres.tobytes())
    images = decode_frame(COLOR_IMAGE, depth)
    assert not isinstance(images, str)
    assert images[1].tolist() == [[0, 500], [0, 0]]


def test_red_of_a_jpeg_is_the_first_channel() -> None:
    red = np.zeros((16, 16, 3), np.uint8)
    red[..., 0] = 200
    color, _ = decode_frame(color_message(red), DEPTH_IMAGE)
    assert color.flags.c_contiguous  # pyright: ignore[reportAttributeAccessIssue]
    assert np.max(np.abs(color.astype(int) - red)) < 3  # pyright: ignore[reportAttributeAccessIssue]


def test_the_brightness_is_that_of_the_colours() -> None:
    image = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
    color = color_message(cv2.GaussianBlur(image, (9, 9), 3.0))
    rgb, grey = decode_color(color), decode_color(color, grey=True)
    assert rgb is not None
    assert grey is not None
    difference = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(int) - grey
    assert grey.ndim == 2
    assert np.max(np.abs(difference)) <= 2

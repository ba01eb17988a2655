"""Camera messages as arrays."""

from __future__ import annotations

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from jaxtyping import UInt8, UInt16

from lariat.geometry.cameras import Picture

DEPTH_PIXEL_BYTES = {"16UC1": 2, "mono16": 2, "32FC1": 4}
"""Supported depth encodings and their bytes per pixel."""


def decode_color(color: CompressedImage, grey: bool = False) -> Picture | None:
    """Return RGB, or the brightness alone, in a third of the time; None where that fails."""
    data = np.frombuffer(color.data, np.uint8)
    how = cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR_RGB
    # An image without a byte is an error of OpenCV, not a failure.
    return cv2.imdecode(data, how) if len(data) else None  # pyright: ignore[reportReturnType]


def decode_frame(
    color: CompressedImage, depth: RawImage, grey: bool = False
) -> tuple[Picture, UInt16[np.ndarray, "h w"]] | str:
    """Return RGB and depth [mm], or the reason why the messages cannot be decoded."""
    picture = decode_color(color, grey)
    if picture is None:
        return f"the colour image ({color.format}, {len(color.data)} bytes) cannot be decoded"
    if depth.encoding not in DEPTH_PIXEL_BYTES:
        return (
            f"the depth image is encoded as {depth.encoding!r}; publish 16UC1, millimetres in "
            "little-endian order, or 32FC1, metres"
        )
    size = DEPTH_PIXEL_BYTES[depth.encoding]
    step = depth.step or size * depth.width
    # Each access copies the bytes.
    data = depth.data
    if step < size * depth.width or len(data) < step * depth.height or not data:
        return (
            f"the depth image holds {len(data)} bytes, too few for "
            f"{depth.width} x {depth.height} pixels of {8 * size} bits"
        )
    rows = np.frombuffer(data, np.uint8)[: step * depth.height].reshape(depth.height, step)
    row = rows[:, : size * depth.width]
    z = row.view("<u2").astype(np.uint16, copy=False) if size == 2 else _metres_to_millimetres(row)
    return picture, z


def _metres_to_millimetres(rows: UInt8[np.ndarray, "h b"]) -> UInt16[np.ndarray, "h w"]:
    """Convert float metres to whole millimetres; invalid and out-of-range depths become 0."""
    z = 1e3 * np.ascontiguousarray(rows).view("<f4").astype(np.float64)
    measured = np.isfinite(z) & (z > 0.0) & (z < 65535.0)
    return np.rint(np.where(measured, z, 0.0)).astype(np.uint16)

"""Camera messages as arrays."""

from __future__ import annotations

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from jaxtyping import UInt8, UInt16

DEPTH_ENCODINGS = ("16UC1", "mono16")


def decoded(
    color: CompressedImage, depth: RawImage
) -> tuple[UInt8[np.ndarray, "h w 3"], UInt16[np.ndarray, "h w"]] | str:
    """RGB and depth [mm], or why they cannot be read."""
    bgr = None
    if color.data:
        bgr = cv2.imdecode(np.frombuffer(color.data, np.uint8), cv2.IMREAD_COLOR)
    if bgr is None:
        return f"the colour image ({color.format}, {len(color.data)} bytes) cannot be decoded"
    if depth.encoding not in DEPTH_ENCODINGS:
        return (
            f"the depth image is encoded as {depth.encoding!r}; publish 16UC1, millimetres in "
            "little-endian order"
        )
    step = depth.step or 2 * depth.width
    if step < 2 * depth.width or len(depth.data) < step * depth.height or not depth.data:
        return (
            f"the depth image holds {len(depth.data)} bytes, too few for "
            f"{depth.width} x {depth.height} pixels of 16 bits"
        )
    rows = np.frombuffer(depth.data, np.uint8)[: step * depth.height].reshape(depth.height, step)
    z = rows[:, : 2 * depth.width].view("<u2").astype(np.uint16, copy=False)
    return np.ascontiguousarray(bgr[..., ::-1]), z

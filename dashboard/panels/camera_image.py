"""Camera image with the perceived rope drawn into it, decoded in a thread of its own."""

from __future__ import annotations

import threading
from itertools import pairwise

import cv2
import numpy as np
import viser
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from jaxtyping import Float64, UInt8

from dashboard.scene.certainty import certainty_colors
from lariat.files.image_header import check_image
from lariat.geometry.cameras import Camera
from lariat.geometry.poses import Pose
from shared.camera_messages import intrinsics_of
from shared.messages import NodeChain, chain

UPDATE_PERIOD = 0.125
"""Time between two images on the page [s]."""
IMAGE_WIDTH = 480
"""Width of the image on the page [pixels]."""
SUBPIXEL_BITS = 4
"""Fractional bits of drawn coordinates, so that a slowly moving line does not jump."""
MAX_COORDINATE = 2**20
"""Largest drawn coordinate, within the range of OpenCV [1/16 pixels]."""


class CameraImage:
    """The newest image, at most every `UPDATE_PERIOD`; images in between are skipped."""

    def __init__(
        self, server: viser.ViserServer, T_world_camera: Pose, label: str | None = None
    ) -> None:
        self._server = server
        self._pose = T_world_camera
        # Hidden until the first image: not every cell has a camera.
        self._handle = server.gui.add_image(
            np.zeros((8, 8, 3), np.uint8),
            label=label,
            format="jpeg",
            jpeg_quality=80,
            visible=False,
        )
        self._newest: tuple[bytes, NodeChain | None, CameraCalibration | None] | None = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="camera image", daemon=True)
        self._thread.start()

    def show(
        self, image: CompressedImage, rope: NodeChain | None, calibration: CameraCalibration | None
    ) -> None:
        """Replace the image to show next."""
        self._newest = (image.data, rope, calibration)

    def close(self) -> None:
        """Stop the thread."""
        self._closed.set()
        self._thread.join(timeout=1.0)

    def _run(self) -> None:
        while not self._closed.wait(UPDATE_PERIOD):
            newest, self._newest = self._newest, None
            if newest is None or not self._server.get_clients():
                continue
            data, rope, calibration = newest
            image = decode(data)
            if image is None:
                continue
            if rope is not None and calibration is not None:
                draw_rope(image, rope, Camera(intrinsics_of(calibration), self._pose))
            height = round(IMAGE_WIDTH * image.shape[0] / image.shape[1])
            image = cv2.resize(image, (IMAGE_WIDTH, height), interpolation=cv2.INTER_LINEAR)
            # One message to the browsers, and not one for each property of the element.
            with self._server.atomic():
                self._handle.image = image
                if not self._handle.visible:
                    self._handle.visible = True


def decode(data: bytes) -> UInt8[np.ndarray, "h w 3"] | None:
    """Decode a compressed image to RGB; None if it is damaged or too large."""
    try:
        check_image(data)
    except ValueError:
        return None
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR_RGB)


def draw_rope(image: UInt8[np.ndarray, "h w 3"], rope: NodeChain, camera: Camera) -> None:
    """Draw the chain into the image, coloured by the certainty of its nodes."""
    nodes: Float64[np.ndarray, "n 3"] = chain(rope.positions)
    if len(nodes) < 2:
        return
    pixels, depth = camera.project(nodes)
    if not np.all(np.isfinite(pixels)) or np.any(depth <= 0.0):
        return
    scaled = np.clip(pixels * 2.0**SUBPIXEL_BITS, -MAX_COORDINATE, MAX_COORDINATE)
    points = scaled.round().astype(np.int32)
    colors = certainty_colors(rope)[:-1]
    # One call for each stretch of a colour: most nodes have that of their neighbour.
    starts = [0, *(1 + np.flatnonzero(np.any(colors[1:] != colors[:-1], axis=1)))]
    for start, end in pairwise([*starts, len(colors)]):
        stretch = points[start : end + 1]
        cv2.polylines(
            image, [stretch], False, colors[start].tolist(), 2, cv2.LINE_AA, SUBPIXEL_BITS
        )

"""The camera's picture with the perceived rope drawn into it, from a thread of its own."""

from __future__ import annotations

import threading

import cv2
import numpy as np
import viser
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from jaxtyping import Float64, UInt8

from dashboard.scene.scene_view import certainty_colors
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.poses import Pose
from shared.messages import NodeChain, chain

PERIOD = 0.125
"""Between two pictures [s]."""
WIDTH = 480
"""Of the picture on the page [pixels]."""


class CameraView:
    """Shows the newest picture eight times a second; what comes between is skipped."""

    def __init__(self, server: viser.ViserServer, T_world_camera: Pose) -> None:
        self._server = server
        self._pose = T_world_camera
        # Not every cell has a camera: without pictures there is nothing to see here.
        self._handle = server.gui.add_image(
            np.zeros((8, 8, 3), np.uint8), format="jpeg", jpeg_quality=80, visible=False
        )
        self._newest: tuple[bytes, NodeChain | None, CameraCalibration | None] | None = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._work, name="camera view", daemon=True)
        self._thread.start()

    def show(
        self, image: CompressedImage, rope: NodeChain | None, calibration: CameraCalibration | None
    ) -> None:
        """Offers a picture, with the rope to draw into it."""
        self._newest = (image.data, rope, calibration)

    def close(self) -> None:
        """Ends the thread."""
        self._closed.set()
        self._thread.join(timeout=1.0)

    def _work(self) -> None:
        while not self._closed.wait(PERIOD):
            newest, self._newest = self._newest, None
            if newest is None or not self._server.get_clients():
                continue
            data, rope, calibration = newest
            picture = decoded(data)
            if picture is None:
                continue
            if rope is not None and calibration is not None:
                draw_rope(picture, rope, Camera(intrinsics(calibration), self._pose))
            height = round(WIDTH * picture.shape[0] / picture.shape[1])
            self._handle.image = cv2.resize(picture, (WIDTH, height), interpolation=cv2.INTER_AREA)
            if not self._handle.visible:
                self._handle.visible = True


def decoded(data: bytes) -> UInt8[np.ndarray, "h w 3"] | None:
    """The RGB picture of a compressed one; None where it is damaged."""
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR) if data else None
    return None if picture is None else cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)


def intrinsics(calibration: CameraCalibration) -> Intrinsics:
    """The pinhole of a calibration message."""
    k = calibration.K
    return Intrinsics(calibration.width, calibration.height, k[0], k[4], k[2], k[5])


def draw_rope(picture: UInt8[np.ndarray, "h w 3"], rope: NodeChain, camera: Camera) -> None:
    """Draws the chain into the picture, node by node in the colour of its certainty."""
    nodes: Float64[np.ndarray, "n 3"] = chain(rope.positions)
    if len(nodes) < 2:
        return
    pixels, depth = camera.project(nodes)
    if not np.all(np.isfinite(pixels)) or np.any(depth <= 0.0):
        return
    # A sixteenth of a pixel keeps a slowly moving line from trembling.
    points = np.clip(pixels * 16.0, -(2**20), 2**20).round().astype(np.int32)
    for k, color in enumerate(certainty_colors(rope)[:-1].tolist()):
        cv2.line(picture, points[k].tolist(), points[k + 1].tolist(), color, 2, cv2.LINE_AA, 4)

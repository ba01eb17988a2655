"""Pairing of camera images with the ropes that were seen in them."""

from __future__ import annotations

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from dashboard.panels.camera_image import CameraImage
from dashboard.subscriptions import latest_with_age
from shared import topics
from shared.messages import stamp_of
from shared.runtime.service import Inbox

MAX_SKEW = 1_000_000
"""Largest time between an image and the rope that is drawn into it [ns]: exposures of several
cameras that are as near to each other are perceived as one."""
MAX_WAITING_IMAGES = 8
"""Largest number of images that wait for the rope that is seen in them."""


class CameraFeed:
    """Images of one camera that wait for a rope of their instant, and are shown with it."""

    def __init__(self, name: str, image: CameraImage) -> None:
        self._image = image
        self._color = topics.CAMERA_COLOR.at(name)
        self._calibration = topics.CAMERA_CALIBRATION.at(name)
        self._waiting: dict[int, CompressedImage] = {}
        self._is_first = True

    def clear(self) -> None:
        """Drop the waiting images and show the next one at once, for a jump in a recording."""
        self._waiting.clear()
        self._is_first = True

    def close(self) -> None:
        """Stop the image's thread."""
        self._image.close()

    def update(self, inbox: Inbox, now: int) -> None:
        """Take new images and ropes."""
        if image := inbox.fresh(self._color):
            self._waiting[stamp_of(image.message)] = image.message
            if self._is_first:
                self._is_first = False
                self._image.show(image.message, None, None)
            while len(self._waiting) > MAX_WAITING_IMAGES:
                # Images without a rope are shown too, only later.
                self._image.show(self._waiting.pop(min(self._waiting)), None, None)
        if rope := inbox.fresh(topics.ROPE_NODES):
            near = [s for s in self._waiting if abs(s - rope.message.stamp) <= MAX_SKEW]
            if near:
                calibration, _ = latest_with_age(inbox, self._calibration, now)
                self._image.show(self._waiting[max(near)], rope.message, calibration)
                self._waiting = {s: i for s, i in self._waiting.items() if s > max(near)}

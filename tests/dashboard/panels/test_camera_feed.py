from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from dashboard.panels.camera_feed import MAX_SKEW, MAX_WAITING_IMAGES, CameraFeed
from lariat.scenario.cameras import DEFAULT_CAMERA
from shared import topics
from shared.messages import NodeChain, timestamp
from shared.runtime.service import Mailbox, Received
from shared.topics import Topic

COLOR = topics.CAMERA_COLOR.at(DEFAULT_CAMERA)
CALIBRATION = topics.CAMERA_CALIBRATION.at(DEFAULT_CAMERA)


class ShownImages:
    """Stand-in for the page's image: keeps what it is given."""

    def __init__(self) -> None:
        self.shown: list[tuple[bytes, bool]] = []

    def show(
        self, image: CompressedImage, rope: NodeChain | None, calibration: CameraCalibration | None
    ) -> None:
        self.shown.append((image.data, rope is not None and calibration is not None))


class Feed:
    """A feed with the messages that it is sent, one step each."""

    def __init__(self) -> None:
        self.image = ShownImages()
        self.feed = CameraFeed(DEFAULT_CAMERA, self.image)  # pyright: ignore[reportArgumentType]
        self._mailbox = Mailbox((COLOR, CALIBRATION, topics.ROPE_NODES))
        self._sequence = 0

    def send(self, topic: Topic, message: object) -> None:
        self._sequence += 1
        self._mailbox.deliver(topic.key, Received(message, "test", self._sequence, 0))
        self.feed.update(self._mailbox.take(), 0)

    def send_image(self, stamp: int) -> None:
        self.send(COLOR, CompressedImage(timestamp=timestamp(stamp), data=b"%d" % stamp))

    def send_rope(self, stamp: int) -> None:
        self.send(topics.ROPE_NODES, NodeChain(stamp=stamp, positions=np.zeros(6)))


def test_image_waits_for_the_rope_of_its_stamp() -> None:
    feed = Feed()
    feed.send(CALIBRATION, CameraCalibration())
    feed.send_image(1)
    feed.send_image(2)
    assert feed.image.shown == [(b"1", False)]
    feed.send_rope(2)
    assert feed.image.shown == [(b"1", False), (b"2", True)]
    feed.send_rope(1)
    assert len(feed.image.shown) == 2


def test_an_image_is_shown_with_a_rope_of_nearly_the_same_instant() -> None:
    feed = Feed()
    feed.send(CALIBRATION, CameraCalibration())
    feed.send_image(1)
    feed.send_image(1 + MAX_SKEW)
    feed.send_rope(2 + MAX_SKEW)
    assert feed.image.shown[1:] == [(b"%d" % (1 + MAX_SKEW), True)]
    feed.send_image(3 * MAX_SKEW)
    feed.send_rope(5 * MAX_SKEW)
    assert len(feed.image.shown) == 2


def test_images_without_a_rope_are_shown_late() -> None:
    feed = Feed()
    for stamp in range(1, MAX_WAITING_IMAGES + 2):
        feed.send_image(stamp)
    assert feed.image.shown == [(b"1", False), (b"1", False)]


def test_first_image_after_a_jump_is_shown_at_once() -> None:
    feed = Feed()
    feed.send_image(1)
    feed.feed.clear()
    feed.send_image(7)
    assert feed.image.shown == [(b"1", False), (b"7", False)]

"""Services whose clocks differ: ages stay, stamps are those of the own clock."""

from __future__ import annotations

from collections.abc import Iterator

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from lariat.trajectory import SECOND
from shared import topics
from shared.messages import Scene
from shared.runtime.service import Inbox, Publication, Received
from stack import services
from tests.closed_loop.bad_network import CLOCK_OFFSETS, HOUR, with_clock_offsets


class Listener:
    """Service that publishes when it heard the newest scene, by its own clock."""

    name = "perception"
    reads = (topics.SCENE_STATE,)
    writes = (topics.SCENE_STATE,)
    rate = 30.0
    latency = 0.0

    def warm_up(self) -> None:
        pass

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        heard = [inbox.latest(topics.SCENE_STATE), inbox.fresh(topics.SCENE_STATE)]
        heard += [*inbox.every(topics.SCENE_STATE), *(inbox.joined(topics.SCENE_STATE) or ())]
        ages = {now - item.received for item in heard if item}
        assert ages == {SECOND}
        yield Publication(topics.SCENE_STATE, Scene(stamp=now))


def test_service_steps_on_its_own_clock_and_ages_stay() -> None:
    (service,) = with_clock_offsets([Listener()], {"perception": HOUR})
    item = Received(Scene(), "lariat", 0, SECOND)
    key = topics.SCENE_STATE.key
    inbox = Inbox({key: item}, {key: (item,)})
    ((_, message),) = service.step(inbox, 2 * SECOND)
    assert message.stamp == 2 * SECOND + HOUR
    assert service.rate == Listener.rate


def test_every_offset_is_that_of_a_service() -> None:
    for offsets in CLOCK_OFFSETS.values():
        assert offsets.keys() <= set(services.NAMES)


def test_camera_stamps_its_images_by_its_own_clock() -> None:
    color = topics.CAMERA_COLOR.at("overhead")
    image = CompressedImage()
    image.timestamp.FromNanoseconds(5 * SECOND)

    class Camera(Listener):
        name = "sim"

        def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
            yield Publication(color, image)

    (camera,) = with_clock_offsets([Camera()], {"sim": -2 * SECOND})
    ((_, published),) = camera.step(Inbox({}, {}), 6 * SECOND)
    assert published.timestamp.ToNanoseconds() == 3 * SECOND
    assert image.timestamp.ToNanoseconds() == 5 * SECOND

"""Any publisher of color, depth and calibration can be the camera."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest
import zenoh

from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.trajectory import SECOND
from services.perception.service import PerceptionService
from shared import topics
from shared.messages import chain
from shared.runtime.service import Mailbox
from tests.services.perception.cell import Cell as Lab
from tests.services.perception.cell import scenario
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live

COLOR = topics.CAMERA_COLOR.at(DEFAULT_CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(DEFAULT_CAMERA)
CALIBRATION = topics.CAMERA_CALIBRATION.at(DEFAULT_CAMERA)


@pytest.fixture
def cell() -> Iterator[Cell]:
    with ExitStack() as stack:
        yield Cell(stack)


def test_a_plain_publisher_of_color_depth_and_calibration_is_a_camera(cell: Cell) -> None:
    lab = Lab(scenario())
    lab.run(0.3)
    of = scenario()
    perception = PerceptionService(replace(of, sensing=replace(of.sensing, outside=True)))
    bus = cell("perception")
    mailbox = Mailbox(perception.reads)
    subscribers = [bus.subscribe(t) for t in (COLOR, DEPTH, CALIBRATION)]

    config = zenoh.Config()
    config.insert_json5("connect/endpoints", json.dumps([cell.hub]))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("transport/shared_memory/enabled", "false")
    config.insert_json5("namespace", json.dumps(cell.namespace))
    received: set[str] = set()

    def sent() -> bool:
        # No attachment, no sequence: nothing that only our own publishers know of.
        for topic in (CALIBRATION, COLOR, DEPTH):
            session.put(
                topic.key,
                lab.has_subscribers[topic.key][
                    -1 if topic != CALIBRATION else 0
                ].SerializeToString(),
                encoding=f"application/protobuf;{topic.type.DESCRIPTOR.full_name}",
            )
        for subscriber in subscribers:
            for key, item in subscriber.take():
                received.add(key)
                mailbox.deliver(key, item)
        return len(received) == 3

    with zenoh.open(config) as session:
        until(sent)
    (seen,) = [m for t, m in perception.step(mailbox.take(), 2 * SECOND) if t == topics.ROPE_NODES]
    truth = list(lab.truth().values())[-1]
    assert seen.lost == ""
    assert np.mean(np.linalg.norm(chain(seen.positions) - truth, axis=1)) < 3e-3

"""Recording of a small cell, as the recorder writes it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.Log_pb2 import Log

from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmSetpoints, Setpoints, timestamp
from shared.recording import Writer
from shared.topics import Topic
from tests.services.recorder.view import cell

STEP = SECOND // 10


def recording(
    folder: Path,
    drawn: bool = True,
    spoil: Callable[[Topic, bytes, int], bytes] = lambda topic, payload, k: payload,
) -> Path:
    """Recording of ten messages of each drawn topic, 0.1 s apart, with images, logs, setpoints.

    Args:
        folder: Folder of the recording.
        drawn: Whether it has the drawing of the cell.
        spoil: Returns what is written as the k-th payload of a topic.
    """
    scenario = cell.scenario(folder)
    writer = Writer(folder / "small.mcap", scenario, cell.NOW)
    view = cell.CellView(scenario)
    for k in range(10):
        now = cell.NOW + k * STEP
        said = [*cell.messages(scenario, now), *_others(now)]
        for topic, message in said:
            view.take(topic.key, message.SerializeToString())
        for topic, message in [*said, *(view.draw(now) if drawn else ())]:
            payload = spoil(topic, message.SerializeToString(), k)
            writer.write(topic, payload, "test-0", k, now, now - STEP // 10)
    writer.close()
    return writer.path


def _others(now: int):
    jpeg = CompressedImage(
        timestamp=timestamp(now), frame_id=DEFAULT_CAMERA, format="jpeg", data=b"\xff\xd8"
    )
    yield topics.CAMERA_COLOR.at(DEFAULT_CAMERA), jpeg
    log = Log(timestamp=timestamp(now), level=Log.WARNING, name="sim", message="late", line=7)
    yield topics.LOG.at("sim"), log
    arm = ArmSetpoints(
        arm="right", positions=[0.2, 0.0, 0.3, 0.2, 0.0, 0.4], orientations=[1, 0, 0, 0] * 2
    )
    yield topics.ARM_SETPOINTS, Setpoints(stamp=now, t0=now + STEP, dt=20_000_000, arms=[arm])

"""Time from the exposure of an image to the gateway that follows the setpoints resting on it.

Every message carries the stamp of the image that it rests on, or the number of the setpoints that
it answers, and recordings hold the time at which each was published. So one image is followed
through every process: camera, perception, controller, gateway. The clocks are those of the
publishers, which on one machine are the same.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from lariat.scenario.cameras import DEFAULT_CAMERA
from shared import topics
from shared.messages import stamp_of
from shared.recording import Recording

COLOR = topics.CAMERA_COLOR.at(DEFAULT_CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(DEFAULT_CAMERA)

STAGES = ("image published", "rope published", "setpoints published", "setpoints accepted")
"""Stages on the way, in their order; each is reached when a process publishes."""


@dataclass(frozen=True)
class Latency:
    """Time from exposure to one stage."""

    stage: str
    """One of `STAGES`."""
    images: int
    """Number of images that were followed so far."""
    p50_ms: float
    """Median [ms]."""
    p99_ms: float
    """99th percentile [ms]."""


def latencies(recordings: Iterable[Recording]) -> list[Latency]:
    """Return the latencies of each stage that an image of the recordings has reached."""
    delays: dict[str, list[float]] = {stage: [] for stage in STAGES}
    for recording in recordings:
        for stage, times in _reached(recording).items():
            delays[stage] += [1e-6 * (sent - exposed) for exposed, sent in times.items()]
    return [_latency(stage, values) for stage, values in delays.items() if values]


def _reached(recording: Recording) -> dict[str, dict[int, int]]:
    """For each stage, when an image reached it [ns], by the time of its exposure [ns]."""
    reached: dict[str, dict[int, int]] = {stage: {} for stage in STAGES}
    # Setpoints whose acceptance is still to come: image by session and number.
    waiting: dict[tuple[str, int], int] = {}
    image, rope, setpoints, accepted = (reached[stage] for stage in STAGES)
    for entry in recording.messages():
        sent = entry.publish_time
        match entry.key:
            case COLOR.key | DEPTH.key:
                stamp = stamp_of(entry.parse())
                image[stamp] = max(image.get(stamp, sent), sent)
            case topics.ROPE_NODES.key:
                rope.setdefault(stamp_of(entry.parse()), sent)
            case topics.ARM_SETPOINTS.key:
                message = entry.parse()
                if message.image_stamp and message.image_stamp not in setpoints:
                    setpoints[message.image_stamp] = sent
                    waiting[message.session, message.sequence] = message.image_stamp
            case topics.ARM_STATE.key:
                message = entry.parse()
                for session, sequence in list(waiting):
                    if session == message.session and sequence <= message.sequence:
                        accepted[waiting.pop((session, sequence))] = sent
    return reached


def _latency(stage: str, values: list[float]) -> Latency:
    p50, p99 = np.quantile(values, [0.5, 0.99])
    return Latency(stage, len(values), round(float(p50), 3), round(float(p99), 3))

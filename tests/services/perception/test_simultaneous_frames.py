"""Which frames of several cameras are processed together, and when."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from services.perception.rope_camera import Exposure
from services.perception.simultaneous_frames import MAX_WAIT, SimultaneousFrames

FRAME = 33_000_000
STEP = 5_000_000
BEGIN = 1_000 * FRAME


@dataclass
class StandIn:
    """Camera without images."""

    exposure: Exposure | None = None
    fault: str = ""

    def expose(self, stamp: int, arrival: int) -> None:
        images = np.zeros((1, 1, 3), np.uint8), np.zeros((1, 1), np.uint16)
        self.exposure = Exposure(images, stamp, arrival)


def cameras(count: int) -> tuple[list[Any], SimultaneousFrames]:
    stands: list[Any] = [StandIn() for _ in range(count)]
    return stands, SimultaneousFrames(stands)


def taken(frames: SimultaneousFrames, now: int) -> tuple[int, int]:
    """Number of cameras that are due, and the stamp."""
    due, stamp = frames.due(now)
    for camera in due:
        camera.exposure = None
    return len(due), stamp


def test_a_single_camera_is_due_at_once() -> None:
    (camera,), frames = cameras(1)
    for k in range(3):
        camera.expose(BEGIN + k * FRAME, BEGIN)
        assert taken(frames, BEGIN) == (1, BEGIN + k * FRAME)


def test_frames_of_one_instant_are_due_together() -> None:
    (one, other), frames = cameras(2)
    one.expose(BEGIN, BEGIN)
    assert taken(frames, BEGIN)[0] == 0
    other.expose(BEGIN + 500_000, BEGIN + STEP)
    assert taken(frames, BEGIN + STEP) == (2, BEGIN + 500_000)


def test_cameras_that_expose_at_their_own_times_are_not_waited_for_again() -> None:
    (one, other), frames = cameras(2)
    one.expose(BEGIN, BEGIN)
    assert taken(frames, BEGIN)[0] == 0
    assert taken(frames, BEGIN + MAX_WAIT) == (1, BEGIN)
    other.expose(BEGIN + FRAME // 2, BEGIN + FRAME // 2)
    assert taken(frames, BEGIN + FRAME // 2) == (1, BEGIN + FRAME // 2)
    one.expose(BEGIN + FRAME, BEGIN + FRAME)
    assert taken(frames, BEGIN + FRAME) == (1, BEGIN + FRAME)


def test_a_camera_that_has_failed_is_not_waited_for() -> None:
    (one, other), frames = cameras(2)
    other.fault = "no frame of camera 'other' for 0.3 s"
    one.expose(BEGIN, BEGIN)
    assert taken(frames, BEGIN) == (1, BEGIN)


def test_a_frame_older_than_the_last_one_is_dropped() -> None:
    (one, other), frames = cameras(2)
    one.expose(BEGIN + FRAME, BEGIN)
    assert taken(frames, BEGIN + MAX_WAIT) == (1, BEGIN + FRAME)
    other.expose(BEGIN, BEGIN + MAX_WAIT)
    assert taken(frames, BEGIN + MAX_WAIT + STEP)[0] == 0
    assert other.exposure is None

"""Selection of the frames of several cameras that show the rope at the same instant."""

from __future__ import annotations

from collections.abc import Sequence

from services.perception.rope_camera import Exposure, RopeCamera

MAX_SKEW = 1_000_000
"""Largest difference between the exposures of one instant [ns]; a rope at 0.5 m/s moves by 0.5 mm
in it."""
MAX_AGE = 1_000_000_000
"""Age from which on an exposure is not late, but its clock has begun anew [ns]."""
MAX_WAIT = 25_000_000
"""Longest time for which a frame waits for those of the other cameras [ns]."""


class SimultaneousFrames:
    """Frames that are due, those of one instant together.

    Cameras that expose at the same instant are waited for; those that do not are processed one by
    one as their frames arrive.
    """

    def __init__(self, cameras: Sequence[RopeCamera]) -> None:
        self._cameras = cameras
        self._last = 0
        self._synchronous = True

    def due(self, now: int) -> tuple[list[RopeCamera], int]:
        """Return the cameras whose exposures are due at `now` [ns], and the time of these [ns].

        No camera is due while there is no exposure, or one that is waited for.
        """
        for camera in self._cameras:
            if camera.exposure is not None and self._is_outdated(camera.exposure):
                camera.exposure = None
        waiting = [(c, c.exposure) for c in self._cameras if c.exposure is not None]
        if not waiting:
            return [], now
        stamp = min(exposure.stamp for _, exposure in waiting)
        together = [(c, e) for c, e in waiting if e.stamp - stamp <= MAX_SKEW]
        expected = [c for c in self._cameras if not c.fault]
        if len(together) < len(expected):
            others_come = len(waiting) < len(expected)
            waited = now - min(exposure.arrival for _, exposure in together)
            if self._synchronous and others_come and waited < MAX_WAIT:
                return [], now
            self._synchronous = False
        else:
            self._synchronous = True
        self._last = max(e.stamp for _, e in together)
        return [camera for camera, _ in together], self._last

    def _is_outdated(self, exposure: Exposure) -> bool:
        """Whether a later exposure of another camera is processed already."""
        return len(self._cameras) > 1 and -MAX_AGE < exposure.stamp - self._last <= 0

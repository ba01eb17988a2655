"""Other ropes, hands and arms that move through the simulated view on given paths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.scenario.distractors import Distractor
from lariat.simulation.camera.rgbd_camera import Tube

NODE_DISTANCE = 0.01
"""Distance of the nodes by which a curved axis is drawn [m]."""


class MovingTubes:
    """Distractors of a scenario as tubes, displaced with the time of a run."""

    def __init__(self, distractors: Sequence[Distractor]) -> None:
        self._distractors = distractors
        self._axes = [_axis(np.array(d.points)) for d in distractors]

    def at(self, run_time: float) -> list[Tube]:
        """Return the tubes at a time since the start of the run [s]."""
        return [
            Tube(axis + _shift(d, run_time), d.diameter / 2.0, d.color)
            for d, axis in zip(self._distractors, self._axes, strict=True)
        ]


def _axis(points: Float64[np.ndarray, "k 3"]) -> Float64[np.ndarray, "n 3"]:
    if len(points) < 3:
        return points
    count = round(polylines.length(points) / NODE_DISTANCE) + 2
    return polylines.resample_smooth(points, max(count, len(points)))


def _shift(distractor: Distractor, run_time: float) -> Float64[np.ndarray, "3"]:
    if not distractor.times:
        return np.zeros(3)
    shifts = np.array(distractor.shifts)
    return np.array([np.interp(run_time, distractor.times, shifts[:, k]) for k in range(3)])

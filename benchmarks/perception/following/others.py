"""Other ropes that are reported beside a followed one, against those that are there."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from benchmarks.perception.following.frames import VIEW, TrueFrame
from lariat.geometry import polylines
from lariat.geometry.obstacles import TABLE
from lariat.perception.centerline.estimate import CenterlineEstimate
from lariat.perception.other_ropes.other_ropes import FollowedRope, OtherRopes
from lariat.perception.other_ropes.search import SearchBeside
from lariat.perception.other_ropes.thin_structures import RgbdView
from lariat.perception.rgbd.line_of_sight import line_of_sight
from lariat.scenario.sections import Limits
from lariat.simulation.camera.rgbd_camera import Tube
from lariat.simulation.camera.sensor_noise import SensorNoise

MAX_DIAMETER = 0.03
"""Diameter of a tube above which it is no rope but a forearm [m]."""
FIRST_TIME = 1.0 / 3.0
"""Time from which ropes are compared [s]."""
NEAR = 0.01
"""Distance from the true axis up to which a point is right; past an end, its radius more [m]."""
POINT_COUNT = 1000
"""Number of points of each true axis that are compared: half a millimetre apart."""


@dataclass
class OthersFigures:
    """What is counted over the frames of a case."""

    visible: int = 0
    """Number of visible points of true axes."""
    reported: int = 0
    """Number of these beside a reported line."""
    errors: list[Float64[np.ndarray, "k"]] = field(default_factory=list)
    """Distances of reported points from the nearest true axis, where they are on it [m]."""
    wrong: int = 0
    """Number of reported points that are seen, and on no true axis."""
    wrong_frames: int = 0
    """Number of frames with such a point."""
    frames: int = 0
    diameters: list[float] = field(default_factory=list)
    """Reported diameters, relative to the true ones [-]."""
    times: list[float] = field(default_factory=list)
    """Processor times of a search [ms]."""

    def row(self) -> dict[str, float | str]:
        """Return the row of the table."""
        errors = np.concatenate([np.zeros(0), *self.errors])
        there = bool(self.visible)
        low, high = np.percentile(self.diameters, (5, 95)) if self.diameters else (np.nan, np.nan)
        return {
            "frames": self.frames,
            "reported_of_visible_%": 100.0 * self.reported / self.visible if there else "—",
            "median_mm": 1e3 * float(np.median(errors)) if len(errors) else "—",
            "p99_mm": 1e3 * float(np.percentile(errors, 99)) if len(errors) else "—",
            "false_points": self.wrong,
            "frames_with_false_points": self.wrong_frames,
            "diameter_over_true": f"{low:.2f} to {high:.2f}" if self.diameters else "—",
            "ms_p50": float(np.median(self.times)),
            "ms_p99": float(np.percentile(self.times, 99)),
        }


class OthersFollower:
    """Follows the other ropes of a sequence, and compares them with the true ones."""

    def __init__(self, radius: float, figures: OthersFigures) -> None:
        """
        Args:
            radius: Radius of the held rope [m].
            figures: Figures to count in.
        """
        self._radius, self._figures = radius, figures
        self._search = SearchBeside(Limits(), 2.0 * radius, SensorNoise().depth_sigma)
        self._others = OtherRopes()

    def take(self, frame: TrueFrame, estimate: CenterlineEstimate, stamp: int) -> None:
        """Take in a frame, and count.

        Args:
            frame: The frame.
            estimate: Estimate of the held rope.
            stamp: Time of the exposure [ns].
        """
        others, depth = self._others, frame.images.depth
        if self._search.due(stamp):
            started = time.process_time()
            view = RgbdView(lambda: frame.images.color, depth, VIEW, estimate.bias)
            lines = self._search.lines(estimate, [view], [TABLE], (frame.left, frame.right))
            others.update(lines, lambda p: line_of_sight(p, self._radius, depth, VIEW), stamp)
            self._figures.times.append(1e3 * (time.process_time() - started))
        if frame.time >= FIRST_TIME:
            ropes = [tube for tube in frame.tubes if 2.0 * tube.radius < MAX_DIAMETER]
            self._count(frame, others.ropes, ropes)

    def _count(self, frame: TrueFrame, followed: list[FollowedRope], ropes: list[Tube]) -> None:
        figures = self._figures
        figures.frames += 1
        reported = np.concatenate([np.zeros((0, 3)), *(rope.points for rope in followed)])
        for tube in ropes:
            axis = polylines.resample(tube.nodes, POINT_COUNT)
            sight = line_of_sight(axis, tube.radius, frame.images.depth, VIEW)
            visible = axis[sight.there]
            figures.visible += len(visible)
            figures.reported += int(np.sum(_distances(visible, reported) < NEAR))
        wrong = 0
        for rope in followed:
            points = np.concatenate(
                [np.zeros((0, 3)), *(part.points for part in rope.parts if part.seen)]
            )
            distances = [
                _distances(points, polylines.resample(tube.nodes, POINT_COUNT)) for tube in ropes
            ]
            reach = [d - tube.radius for d, tube in zip(distances, ropes, strict=True)]
            nowhere = np.full(len(points), np.inf)
            nearest = np.min([nowhere, *distances], axis=0)
            figures.errors.append(nearest[nearest < NEAR])
            wrong += int(np.sum(np.min([nowhere, *reach], axis=0) >= NEAR))
            if distances and len(points):
                tube = ropes[int(np.argmin([np.median(d) for d in distances]))]
                figures.diameters.append(rope.diameter / (2.0 * tube.radius))
        figures.wrong += wrong
        figures.wrong_frames += wrong > 0


def _distances(
    points: Float64[np.ndarray, "k 3"], others: Float64[np.ndarray, "m 3"]
) -> Float64[np.ndarray, "k"]:
    """Distance of each point from the nearest of others [m]."""
    if not len(others):
        return np.full(len(points), np.inf)
    return np.min(polylines.point_distances(points, others), axis=1)

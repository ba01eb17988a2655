"""Default tracker: the last estimate, moved along with the grips, is the prior of the next frame.

Where the image leaves doubt, and in the first frame, the shape at rest of the rod between the grips
is a further prior.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jaxtyping import Float64, UInt16

from lariat.geometry import polylines
from lariat.geometry.cameras import Picture
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import (
    MAX_INCONSISTENCY,
    CenterlineEstimate,
    ChainLength,
    OtherLine,
    ShapePrior,
)
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.other_ropes.other_ropes import OtherRopes, SeenLine, is_away
from lariat.perception.rgbd.depth_bias import DepthBias
from lariat.perception.rgbd.line_of_sight import Sight, line_of_sight
from lariat.perception.tracking.motion_uncertainty import MotionUncertainty
from lariat.perception.tracking.wrong_chain import WrongChainModel
from lariat.rod import Rod, RodProperties

log = logging.getLogger(__name__)

WARM_UP_COLOR = (255, 255, 255)
"""Red, green, blue of the rope in the warm-up image, where the rope's colour is not given."""

MIN_LENGTH_COUNT, MAX_LENGTH_COUNT = 5, 100
"""Measurements of the length up to which every frame makes one, and that are averaged at most."""
LENGTH_PERIOD = 10
"""Number of frames between two measurements of the length after that."""
MAX_LENGTH_ERROR = 0.03
"""Largest deviation of the measured length from the given one, as a share [-]."""
MAX_LEARNT_P_WRONG = 0.03
"""Probability of a wrong chain below which the lines beside it are taken for other ropes [-]."""
KNOWN_POINT_DISTANCE = 0.003
"""Distance of the points of another rope where it is expected [m]."""
SIGMA_SCALE = 1.12
"""Factor on the standard deviations of a single frame [-]: neighbouring pixels and frames err
together; measured by `lariat bench perception following --sequences 3 --seed 300`."""
SHARED_NOISE_SHARE = 0.55
"""Share of the depth noise of neighbouring pixels together that a node keeps [-]."""
LENGTH_BIAS = 0.004
"""Deviation of the measured length up to which the given one may be right, as a share [-]: depth
noise, the width of the rope and its curvature between nodes lengthen a chain."""


@dataclass(frozen=True)
class TrackerSettings:
    """Uncertainty of the priors."""

    max_age: int = 500_000_000
    """Age above which an estimate is no longer a prior [ns]."""
    drift_speed: float = 0.03
    """Speed of the rope relative to the interpolated motion of its ends [m/s]."""
    grip_lag: float = 0.3
    """Share of the grips' motion that the rope between them may not follow."""
    min_sigma: float = 5e-4
    """Standard deviation that each frame adds even without elapsed time or motion [m]."""
    rest_shape_sigma: float = 0.02
    """Standard deviation of the rod's shape at rest [m]; stiffness and swing are unknown."""


class LengthMean:
    """Length of the rope between its grips, from the frames that show it whole.

    The given length may be wrong, and grips hold the rope a few millimetres from where they seem
    to: a chain of another length leaves the rope in its bends.
    """

    def __init__(self) -> None:
        self._ratio, self._count, self._frame = 1.0, 0, 0
        self._given_wrong = False

    def now(self) -> ChainLength:
        """Return the length to fit with, and whether to measure it in the next frame."""
        self._frame += 1
        often = self._count < MIN_LENGTH_COUNT
        # Once found wrong, the given length does not return: a chain that changes its length moves.
        self._given_wrong |= not often and abs(self._ratio - 1.0) > LENGTH_BIAS
        ratio = self._ratio if self._given_wrong else 1.0
        return ChainLength(ratio, often or self._frame % LENGTH_PERIOD == 0)

    def take(self, measured: float | None) -> None:
        """Take in the length that a frame shows, relative to the given one."""
        if measured is None:
            return
        self._count = min(self._count + 1, MAX_LENGTH_COUNT)
        bounded = min(max(measured, 1.0 - MAX_LENGTH_ERROR), 1.0 + MAX_LENGTH_ERROR)
        self._ratio += (bounded - self._ratio) / self._count


class CenterlineTracker:
    """Tracks the rope with the centreline estimator and the rod as a model."""

    def __init__(
        self,
        estimator: CenterlineEstimator,
        properties: RodProperties,
        bodies: Sequence[Obstacle] = (),
        settings: TrackerSettings | None = None,
    ) -> None:
        """
        Args:
            estimator: Estimator of single frames.
            properties: Properties of the rope as far as they are known.
            bodies: Obstacles in view; the depth bias is measured on the table among them.
            settings: Uncertainty of the priors.
        """
        self.camera = estimator.camera
        self._estimator = estimator
        self._settings = settings or TrackerSettings()
        self._rod = Rod(properties, estimator.rope.node_count)
        self._last: CenterlineEstimate | None = None
        self._stamp = 0
        self._grips: tuple[Pose | None, Pose | None] = (None, None)
        self._rest_failed = False
        self._bias = DepthBias(estimator.camera, bodies)
        self._length = LengthMean()
        self.wrong_chain = WrongChainModel()
        self._others = OtherRopes()
        self._motion = MotionUncertainty()

    def forget(self) -> None:
        """Drop the last estimate and the measured length: another rope may be there."""
        self._last = None
        self._length = LengthMean()
        self.wrong_chain.forget()
        self._others.forget()

    def warm_up(self, left: Pose, right: Pose) -> None:
        """Compile the fit on an image of a stripe, and the rod."""
        i, color = self.camera.intrinsics, self._estimator.settings.rope_color
        image = np.zeros((i.height, i.width, 3), np.uint8)
        depth = np.full((i.height, i.width), 900, np.uint16)
        middle = i.height // 2
        image[middle - 4 : middle + 4, i.width // 4 : -i.width // 4] = color or WARM_UP_COLOR
        self._estimator.estimate(image, depth, left, right)
        self._shape_at_rest(left, right)

    def track(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None,
        right: Pose | None,
        stamp: int,
    ) -> CenterlineEstimate:
        """Estimate the rope in the next frame; arguments as in `CameraTracker.track`."""
        prior, bias = self._propagated(left, right, stamp), self._bias.update(depth)
        estimate = self._estimator.estimate(
            color,
            depth,
            left,
            right,
            prior,
            cache(lambda: self._shape_at_rest(left, right)),
            bias,
            self._length.now(),
            self._expected_others(),
        )
        self._length.take(estimate.length_ratio)
        rope, wrong = self._estimator.rope, 0.0
        unseen = 1.0 - float(np.mean(estimate.observed)) if estimate.others else 0.0
        added = self._motion.take((left, right), rope.node_count, stamp, unseen * rope.length)
        if not estimate.lost:
            self.adopt(_continued(estimate, prior), left, right, stamp)
            if prior is None:
                self.wrong_chain.forget()
            wrong = self.wrong_chain.take(estimate.inconsistency, stamp)
        # Beside a chain that may lie on another rope, ours would be taken for the other one.
        sure, diameter = wrong < MAX_LEARNT_P_WRONG, 2.0 * rope.radius
        lines = [
            SeenLine(line.points, diameter)
            for line in estimate.others
            if sure and is_away(line.points, (left, right))
        ]
        self._others.update(lines, lambda points: self._look(points, depth), stamp)
        if estimate.lost:
            return estimate
        shared = SHARED_NOISE_SHARE * self._bias.shared_noise
        sigma = np.hypot(SIGMA_SCALE * estimate.sigma, np.hypot(added, shared))
        return replace(estimate, sigma=sigma, p_wrong=wrong, bias=bias)

    def _expected_others(self) -> list[OtherLine]:
        """Lines of the other ropes where they were seen last."""
        lines = []
        for line, _ in (line for rope in self._others.ropes for line in rope.lines):
            count = max(2, round(polylines.length(line) / KNOWN_POINT_DISTANCE))
            points = polylines.resample(line, count)
            lines.append(OtherLine(self.camera.project(points)[0], points))
        return lines

    def _look(self, points: Float64[np.ndarray, "k 3"], depth: UInt16[np.ndarray, "h w"]) -> Sight:
        return line_of_sight(points, self._estimator.rope.radius, depth, self.camera)

    def adopt(
        self, estimate: CenterlineEstimate, left: Pose | None, right: Pose | None, stamp: int
    ) -> None:
        """Take an estimate as the next frame's prior, unless it is doubtful."""
        if estimate.inconsistency < MAX_INCONSISTENCY:
            self._last, self._stamp, self._grips = estimate, stamp, (left, right)

    def _shape_at_rest(self, left: Pose | None, right: Pose | None) -> ShapePrior | None:
        """Shape of the rod at rest between the grips; None where it cannot rest."""
        if left is None or right is None:
            return None
        try:
            rest = self._rod.rest(left, right)
        except ValueError as error:
            # Log once, not with every frame in which an arm is too far away.
            if not self._rest_failed:
                log.warning("the rod's shape at rest is no prior: %s", error)
            self._rest_failed = True
            return None
        self._rest_failed = False
        count = self._estimator.rope.node_count
        return ShapePrior(rest.state.positions, np.full(count, self._settings.rest_shape_sigma))

    def _propagated(self, left: Pose | None, right: Pose | None, stamp: int) -> ShapePrior | None:
        """Last estimate, each node moved by the interpolated motion of the grips."""
        s = self._settings
        if self._last is None or not 0 <= stamp - self._stamp <= s.max_age:
            return None
        shifts = [
            np.zeros(3) if now is None or then is None else now.position - then.position
            for then, now in zip(self._grips, (left, right), strict=True)
        ]
        along = np.linspace(0.0, 1.0, len(self._last.positions))[:, None]
        positions = self._last.positions + (1.0 - along) * shifts[0] + along * shifts[1]
        moved = max(float(np.linalg.norm(shift)) for shift in shifts)
        added = s.drift_speed * (stamp - self._stamp) / 1e9 + s.grip_lag * moved
        sigma: Float64[np.ndarray, "n"] = np.hypot(self._last.sigma, added + s.min_sigma)
        return ShapePrior(positions, sigma)


def _continued(estimate: CenterlineEstimate, prior: ShapePrior | None) -> CenterlineEstimate:
    """Estimate beside other ropes; nodes that the frame makes less certain stay as expected.

    Otherwise a frame in which two ropes look like one would let the rope be expected anywhere, and
    the other rope be followed from the next frame on.
    """
    if prior is None or not estimate.others:
        return estimate
    expected = estimate.sigma > prior.sigma
    return replace(
        estimate,
        positions=np.where(expected[:, None], prior.positions, estimate.positions),
        sigma=np.where(expected, prior.sigma, estimate.sigma),
    )

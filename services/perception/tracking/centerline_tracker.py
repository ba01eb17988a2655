"""From frame to frame: the last estimate, carried along with the grips, is expected next.

Where the image leaves doubt, and at the start, the rod at rest between the grips is asked for the
shape that it would have.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64, UInt8, UInt16

from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties
from services.perception.centerline.estimate import Estimate, Expected
from services.perception.centerline.estimator import DOUBTFUL, CenterlineEstimator
from services.perception.rgbd.depth_bias import DepthBias

log = logging.getLogger(__name__)

FORGETTING = 500_000_000
"""An estimate older than this is no help [ns]."""
DRIFT = 0.03
"""How fast the rope's middle may leave the place that its ends suggest [m/s]."""
SLIP = 0.3
"""Part of the grips' motion that the rope between them need not follow."""
MODEL_SIGMA = 0.02
"""Of the rod at rest: stiffness and swing are not known [m]."""


class Tracker:
    """Remembers where the rope was."""

    def __init__(
        self,
        estimator: CenterlineEstimator,
        believed: RodProperties,
        bodies: Sequence[Obstacle] = (),
    ) -> None:
        """
        Args:
            estimator: Reads single frames.
            believed: The rope as far as it is known.
            bodies: In view; the table among them says how far depth is off.
        """
        self.estimator = estimator
        self._rod = Rod(believed, estimator.rope.node_count)
        self._last: Estimate | None = None
        self._stamp = 0
        self._grips: tuple[Pose | None, Pose | None] = (None, None)
        self._complained = False
        self._bias = DepthBias(estimator.camera, bodies)

    def forget(self) -> None:
        """Starts anew with the next frame."""
        self._last = None

    def follow(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None,
        right: Pose | None,
        stamp: int,
    ) -> Estimate:
        """The rope in the next frame; arguments as of `CenterlineEstimator.estimate`.

        Args:
            stamp: Of the frame [ns].
        """
        expected = self._expected(left, right, stamp)
        estimate = self.estimator.estimate(
            color,
            depth,
            left,
            right,
            expected,
            lambda: self.at_rest(left, right),
            self._bias.look(depth),
        )
        # What is doubtful must not become tomorrow's certainty.
        if not estimate.lost and estimate.doubt < DOUBTFUL:
            self._last, self._stamp, self._grips = estimate, stamp, (left, right)
        return estimate

    def at_rest(self, left: Pose | None, right: Pose | None) -> Expected | None:
        """How the believed rope would hang between the grips."""
        if left is None or right is None:
            return None
        try:
            rest = self._rod.rest(left, right)
        except ValueError as error:
            # Once, not with every frame in which an arm stands too far off.
            if not self._complained:
                log.warning("no shape to expect: %s", error)
            self._complained = True
            return None
        self._complained = False
        count = self.estimator.rope.node_count
        return Expected(rest.state.positions, np.full(count, MODEL_SIGMA))

    def _expected(self, left: Pose | None, right: Pose | None, stamp: int) -> Expected | None:
        if self._last is None or not 0 <= stamp - self._stamp <= FORGETTING:
            return None
        shifts = [
            np.zeros(3) if now is None or then is None else now.position - then.position
            for then, now in zip(self._grips, (left, right), strict=True)
        ]
        s = np.linspace(0.0, 1.0, len(self._last.positions))[:, None]
        positions = self._last.positions + (1.0 - s) * shifts[0] + s * shifts[1]
        moved = max(float(np.linalg.norm(shift)) for shift in shifts)
        doubt = DRIFT * (stamp - self._stamp) / 1e9 + SLIP * moved
        sigma: Float64[np.ndarray, "n"] = np.hypot(self._last.sigma, doubt + 5e-4)
        return Expected(positions, sigma)

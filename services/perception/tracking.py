"""From frame to frame: the last estimate, carried along with the grips, is expected next."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, UInt8, UInt16

from services.perception.centerline import CenterlineEstimator, Estimate, Expected
from shared.geometry.poses import Pose

FORGETTING = 500_000_000
"""An estimate older than this is no help [ns]."""
DRIFT = 0.03
"""How fast the rope's middle may leave the place that its ends suggest [m/s]."""
SLIP = 0.3
"""Part of the grips' motion that the rope between them need not follow."""


class Tracker:
    """Remembers where the rope was."""

    def __init__(self, estimator: CenterlineEstimator) -> None:
        self.estimator = estimator
        self._last: Estimate | None = None
        self._stamp = 0
        self._grips: tuple[Pose | None, Pose | None] = (None, None)

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
        estimate = self.estimator.estimate(color, depth, left, right, expected)
        if not estimate.lost:
            self._last, self._stamp, self._grips = estimate, stamp, (left, right)
        return estimate

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

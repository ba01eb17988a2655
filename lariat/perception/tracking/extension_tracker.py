"""Perception from outside, in the place of Lariat's rope tracker."""

from __future__ import annotations

import numpy as np
from jaxtyping import UInt16

from lariat.geometry.cameras import Camera, Picture
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import CenterlineEstimate, RopeDimensions
from lariat.protocols import PerceptionSetup, RopePerception
from lariat.scenario.extensions import Extension, ExtensionFault
from lariat.trajectory import NANOSECONDS

MIN_SIGMA = 1e-5
"""Least standard deviation that is passed on [m]; estimators divide by it."""


class ExtensionTracker:
    """Tracker of a rope by a `lariat.protocols.RopePerception`."""

    def __init__(self, extension: Extension, camera: Camera, rope: RopeDimensions) -> None:
        """Create the tracker of one camera.

        Args:
            extension: Its name.
            camera: Camera at its calibrated pose.
            rope: Length, radius and number of nodes.

        Raises:
            ConfigurationError: The class cannot be imported or is no perception.
        """
        self.camera = camera
        self._extension, self._count = extension, rope.node_count
        setup = PerceptionSetup(camera, rope.length, 2.0 * rope.radius, rope.node_count)
        self._perception: RopePerception = extension.create(("reset", "locate"), setup)
        self._fault = ""

    def forget(self) -> None:
        try:
            with self._extension.guarded("reset"):
                self._perception.reset()
            self._fault = ""
        except ExtensionFault as fault:
            self._fault = str(fault)

    def adopt(
        self, estimate: CenterlineEstimate, left: Pose | None, right: Pose | None, stamp: int
    ) -> None:
        """Do nothing: an own perception keeps what it needs."""

    def warm_up(self, left: Pose, right: Pose) -> None:
        """Do nothing: a perception prepares itself in its constructor."""

    def track(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None,
        right: Pose | None,
        stamp: int,
    ) -> CenterlineEstimate:
        """Estimate the rope in a frame; arguments as in `CameraTracker.track`."""
        if self._fault:
            return CenterlineEstimate.failed(self._fault)
        try:
            return self._estimate(color, depth, left, right, stamp)
        except ExtensionFault as fault:
            return CenterlineEstimate.failed(str(fault))

    def _estimate(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None,
        right: Pose | None,
        stamp: int,
    ) -> CenterlineEstimate:
        own, n = self._extension, self._count
        with own.guarded("locate"):
            located = self._perception.locate(
                color.copy(), depth.copy(), (left, right), stamp * NANOSECONDS
            )
            if located is None:
                return CenterlineEstimate.failed(f"{own} does not see the rope")
            nodes, sigma, observed = located.nodes, located.sigma, located.observed
        nodes = own.checked("locate", nodes, (n, 3))
        sigma = own.checked("locate", sigma, (n,))
        observed = own.checked("locate", observed, (n,)) != 0.0
        return CenterlineEstimate(nodes, np.maximum(sigma, MIN_SIGMA), observed)

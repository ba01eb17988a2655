"""Protocol of a rope tracker."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from jaxtyping import UInt16

from lariat.geometry.cameras import Camera, Picture
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import CenterlineEstimate


class CameraTracker(Protocol):
    """Follows one rope through the frames of one camera."""

    camera: Camera

    def track(
        self,
        color: Picture,
        depth: UInt16[np.ndarray, "h w"],
        left: Pose | None,
        right: Pose | None,
        stamp: int,
    ) -> CenterlineEstimate:
        """Estimate the rope in the next frame.

        Args:
            color: Red, green, blue.
            depth: Depth image [mm], 0 where nothing was measured.
            left: Grip that holds the left end; None when it is free or unknown.
            right: Grip that holds the right end.
            stamp: Time of the exposure [ns].
        """
        ...

    def adopt(
        self, estimate: CenterlineEstimate, left: Pose | None, right: Pose | None, stamp: int
    ) -> None:
        """Take over an estimate that other cameras have added to.

        Args:
            estimate: The estimate, in which the rope is not lost.
            left: Grip that held the left end; None when it was free or unknown.
            right: Grip that held the right end.
            stamp: Time of the exposures [ns].
        """
        ...

    def forget(self) -> None:
        """Drop all state from earlier frames."""
        ...

    def warm_up(self, left: Pose, right: Pose) -> None:
        """Compile what `track` needs, with grips at which the rope may rest."""
        ...

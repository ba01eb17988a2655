"""Search of ropes beside the held one, by colour and by depth."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from lariat.geometry.grippers import gripper_capsules
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import CenterlineEstimate
from lariat.perception.other_ropes.foreground_mask import KnownScene
from lariat.perception.other_ropes.other_ropes import SeenLine, is_away
from lariat.perception.other_ropes.thin_structures import RgbdView, thin_structures
from lariat.perception.tracking.centerline_tracker import MAX_LEARNT_P_WRONG
from lariat.scenario.sections import Limits

PERIOD = 50_000_000
"""Least time between two searches [ns]: one takes as long as following the held rope."""


class SearchBeside:
    """Finds the lines of other ropes in the images of all cameras.

    Those of the held rope's colour come with its estimate; all others are found by their depth.
    """

    def __init__(self, limits: Limits, diameter: float, depth_sigma: float) -> None:
        """
        Args:
            limits: Limits, which give the grippers' size.
            diameter: Diameter of the held rope, which others of its colour are taken to have [m].
            depth_sigma: Standard deviation of a single depth [m].
        """
        self._limits, self._diameter, self._depth_sigma = limits, diameter, depth_sigma
        self._searched = -PERIOD

    def warm_up(self) -> None:
        """Let OpenCV compute its table of colours, which takes a tenth of a second."""
        cv2.cvtColor(np.zeros((1, 1, 3), np.uint8), cv2.COLOR_RGB2LAB)

    def due(self, stamp: int) -> bool:
        """Return whether images are to be searched; if so, the next ones are not until `PERIOD`.

        Args:
            stamp: Time of the exposure [ns].
        """
        if 0 <= stamp - self._searched < PERIOD:
            return False
        self._searched = stamp
        return True

    def lines(
        self,
        estimate: CenterlineEstimate,
        views: Sequence[RgbdView],
        obstacles: Sequence[Obstacle],
        grips: tuple[Pose | None, Pose | None],
    ) -> list[SeenLine]:
        """Return the lines; those of its colour only beside a held rope that surely lies there.

        Args:
            estimate: Estimate of the held rope.
            views: Newest images.
            obstacles: Obstacles where they are now.
            grips: Left and right grip, None where there is none.
        """
        if estimate.lost:
            return []
        sure = estimate.p_wrong < MAX_LEARNT_P_WRONG
        lines = [SeenLine(line.points, self._diameter) for line in estimate.others if sure]
        grippers = gripper_capsules(*grips, self._limits.gripper_reach, self._limits.gripper_radius)
        scene = KnownScene(estimate, 0.5 * self._diameter, obstacles, grippers)
        structures = [
            line for view in views for line in thin_structures(view, scene, self._depth_sigma)
        ]
        return lines + [line for line in structures if is_away(line.points, grips)]

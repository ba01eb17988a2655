"""Driver of an end that is clamped to the world."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from services.robot_gateway.drivers.driver import ArmFeedback
from services.robot_gateway.drivers.ideal import IdealDriver


class FixedDriver(IdealDriver):
    """Driver of a clamp, which ignores its commands."""

    name = "fixed"
    moves = False

    def step(
        self, now: int, target: Pose | None, velocity: Float64[np.ndarray, "2 3"]
    ) -> ArmFeedback:
        return super().step(now, None, velocity)

"""Settings that a client makes on the emulated arm and with little or no effect on its motion."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from services.cr5_emulator.motions import JOINT_RANGE


@dataclass
class ClientSettings:
    """Settings, kept until the controller is switched off."""

    blending: int = 0
    """CP [%]; stored without effect."""
    collision_level: int = 3
    """0 (off) to 5 (most sensitive); stored without effect."""
    load_switch: int = 0
    skin_on: bool = False
    post_collision: int = 0
    """Reaction to a collision: 0 stops, 1 pauses."""
    back_distance: float = 0.0
    """Distance of the retreat after a collision [mm]."""
    tcp_speed: float | None = None
    """Speed of straight motions [mm/s]; None: their ratio of the maximum."""
    frame_offset: Float64[np.ndarray, "6"] = field(default_factory=lambda: np.zeros(6))
    """Offset of the user frame that StartRTOffset applies [mm, deg]."""
    axis_limits: Float64[np.ndarray, "6 2"] = field(
        default_factory=lambda: np.stack([-JOINT_RANGE, JOINT_RANGE], axis=1)
    )
    """Least and greatest angle of each joint [rad]."""

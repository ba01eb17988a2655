"""What clients set on the emulated arm that changes little or nothing of how it moves."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from services.cr5_emulator.motions import JOINT_RANGE


@dataclass
class Preferences:
    """Kept until the controller is switched off."""

    blending: int = 0
    """CP [%]: kept, not played."""
    collision_level: int = 3
    """0 (off) to 5 (most sensitive): the arm meets nothing."""
    load_switch: int = 0
    skin_on: bool = False
    post_collision: int = 0
    """0 stops after a collision, 1 pauses."""
    back_distance: float = 0.0
    """Gone back after a collision [mm]."""
    tcp_speed: float | None = None
    """Of straight motions instead of their share [mm/s]."""
    force_control: bool = False
    force: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """By the command that set it."""
    frame_offset: Float64[np.ndarray, "6"] = field(default_factory=lambda: np.zeros(6))
    """Of the user frame, for StartRTOffset [mm, deg]."""
    axis_limits: Float64[np.ndarray, "6 2"] = field(
        default_factory=lambda: np.stack([-JOINT_RANGE, JOINT_RANGE], axis=1)
    )
    """Of the joints [rad]."""

"""Whether an arm stands, by the speed of its grip."""

from __future__ import annotations

import math

from shared.messages import ArmState

REST_SPEED, REST_TURN_RATE = 0.002, 0.02
"""Speeds below which a grip stands [m/s], [rad/s]; a goal that is held needs less."""


def stands(arm: ArmState) -> bool:
    """Return whether a grip is known to stand."""
    return (
        len(arm.linear_velocity) == 3
        and math.hypot(*arm.linear_velocity) < REST_SPEED
        and math.hypot(*arm.angular_velocity) < REST_TURN_RATE
    )

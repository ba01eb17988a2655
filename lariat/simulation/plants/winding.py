"""Twist of a plant's rope, wound up at its right grip."""

from __future__ import annotations

import math

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.plant import Plant

WINDING_STEP = 0.05
"""Duration of one step of the winding [s]."""
WINDING_PER_STEP = 0.02
"""Turns of the right grip in one step of the winding [-]."""


def wind(plant: Plant, left: Pose, right: Pose, turns: float) -> None:
    """Turn the right grip about its axis, which twists the rope between the grips.

    Args:
        plant: Plant whose rope is held by the two grips.
        left: Pose of the left grip.
        right: Pose of the right grip, before and, for whole turns, after the winding.
        turns: Twist to add [turns].
    """
    count = math.ceil(abs(turns) / WINDING_PER_STEP)
    for k in range(1, count + 1):
        spin = poses.exponential(np.array([0.0, 0.0, 2.0 * math.pi * turns * k / count]))
        wound = Pose(right.position, poses.multiply(right.orientation, spin))
        plant.step(EndMotion(left), EndMotion(wound), WINDING_STEP)

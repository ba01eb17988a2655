"""State of the cell in which a path begins: at rest, now or where the arms will stop."""

from __future__ import annotations

import numpy as np

from lariat.scenario import SIDES
from shared.messages import ArmStates, NodeChain, Setpoints, arm_pose, chain

MAX_START_SPEED = 2e-3
"""Speed of a grip below which it is at rest [m/s]."""
MAX_START_ANGULAR_SPEED = 1e-2
"""Angular speed of a grip below which it is at rest [rad/s]."""


def at_rest(arms: ArmStates) -> bool:
    """Whether no grip moves: a path begins at rest."""
    return all(
        np.linalg.norm(arm.linear_velocity) < MAX_START_SPEED
        and np.linalg.norm(arm.angular_velocity) < MAX_START_ANGULAR_SPEED
        for arm in arms.arms
    )


def stopped(arms: ArmStates, setpoints: Setpoints) -> ArmStates:
    """State of the arms where their setpoints end."""
    ahead = ArmStates()
    ahead.CopyFrom(arms)
    ends = {end.arm: end for end in setpoints.arms}
    for arm in ahead.arms:
        if arm.arm in ends:
            arm.position[:] = ends[arm.arm].positions[-3:]
            arm.orientation[:] = ends[arm.arm].orientations[-4:]
    return ahead


def moved(rope: NodeChain, arms: ArmStates, ahead: ArmStates) -> NodeChain:
    """Chain whose nodes have moved with the grips, to where the arms will stand."""
    nodes = chain(rope.positions)
    if not len(nodes):
        return rope
    left, right = (arm_pose(ahead, side).position - arm_pose(arms, side).position for side in SIDES)
    share = np.linspace(0.0, 1.0, len(nodes))[:, None]
    copy = NodeChain()
    copy.CopyFrom(rope)
    copy.positions[:] = (nodes + (1.0 - share) * left + share * right).ravel()
    return copy

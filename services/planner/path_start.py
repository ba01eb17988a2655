"""State of the cell in which a path begins: at rest, now or where the arms will stop."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lariat.safety.constraints.arm_kinematics import ArmKinematics
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


def stopped(
    arms: ArmStates, setpoints: Setpoints, kinematics: Mapping[str, ArmKinematics]
) -> ArmStates | None:
    """State of the arms where their setpoints end; None where an arm's joints are unknown."""
    ahead = ArmStates()
    ahead.CopyFrom(arms)
    ends = {end.arm: end for end in setpoints.arms}
    for arm in ahead.arms:
        if arm.arm not in ends:
            continue
        positions = np.reshape(ends[arm.arm].positions, (-1, 3))
        orientations = np.reshape(ends[arm.arm].orientations, (-1, 4))
        arm.position[:], arm.orientation[:] = positions[-1], orientations[-1]
        if arm.arm in kinematics:
            near = np.array(arm.joints)
            if len(near) != kinematics[arm.arm].joint_range.shape[1]:
                return None
            joints = kinematics[arm.arm].follow(positions, orientations, near)
            if joints is None:
                return None
            arm.joints[:] = joints[-1]
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

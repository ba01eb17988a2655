"""Installation of a CR5 in a scenario's cell: kinematics, joint angles at the start, tether."""

from __future__ import annotations

import numpy as np

from lariat.arms.cr5_kinematics import Kinematics
from lariat.arms.installation import joints_at
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Scenario, Side
from lariat.scenario.placement import base_of, tool_of
from lariat.scenario.sections import End

JointDegrees = tuple[float, float, float, float, float, float]
"""Joint angles [deg]."""


def kinematics_of(end: End) -> Kinematics:
    """Create the kinematics of the arm of an end, with its base and tool."""
    return Kinematics(base_of(end), tool_of(end))


def start_joints(kinematics: Kinematics, start: Pose, side: Side) -> JointDegrees:
    """Return joint angles for a grip pose, on the branch farthest from singularities [deg].

    Args:
        kinematics: The arm.
        start: Grip pose at the scenario's start.
        side: End of the rope, for the error message.

    Raises:
        ConfigurationError: The start is out of reach.
    """
    joints = joints_at(kinematics, side, start)
    first, second, third, fourth, fifth, sixth = np.degrees(joints).tolist()
    return first, second, third, fourth, fifth, sixth


def tether_of(scenario: Scenario, side: Side) -> tuple[float, ...]:
    """Return the plant's rope as the emulator's tether; empty when its other end moves.

    Fixed end in the base [m], length [m], stiffness [N/m] and grip in the flange frame [m].
    """
    other = "right" if side == "left" else "left"
    if scenario.end(other).driver != "fixed":
        return ()
    grips = dict(zip(SIDES, scenario.grips(scenario.start), strict=True))
    end, rope = scenario.end(side), scenario.plant_rope
    anchor = base_of(end).inverse() @ grips[other]
    tool = tool_of(end)
    stiffness = rope.stretch_stiffness / rope.length
    return (*anchor.position.tolist(), rope.length, stiffness, *tool.position.tolist())


def scenario_joints(scenario: Scenario, side: Side) -> JointDegrees:
    """Return the joint angles of an end's arm at the scenario's start [deg].

    Raises:
        ConfigurationError: The start is out of reach.
    """
    start = dict(zip(SIDES, scenario.grips(scenario.start), strict=True))[side]
    return start_joints(kinematics_of(scenario.end(side)), start, side)

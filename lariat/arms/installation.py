"""Installation of the arms of a scenario's cell: kinematics of each end's arm."""

from __future__ import annotations

from lariat.arms.cr5_kinematics import Kinematics
from lariat.arms.description import arm_description
from lariat.arms.kinematics import Joints, UrdfKinematics
from lariat.configuration import ConfigurationError
from lariat.geometry.poses import Pose
from lariat.scenario import Scenario, Side
from lariat.scenario.placement import base_of, tool_of


def kinematics_of(scenario: Scenario, side: Side) -> UrdfKinematics | None:
    """Return the kinematics of an end's arm, with its base and tool.

    None for an end without an arm, and for an arm whose class alone knows its URDF.

    Raises:
        ValueError: The URDF of the arm cannot be used.
    """
    end = scenario.end(side)
    if end.driver == "cr5":
        return Kinematics(base_of(end), tool_of(end))
    described = arm_description(scenario, side)
    if described is None:
        return None
    return UrdfKinematics(described.urdf, described.flange, base_of(end), tool_of(end))


def start_joints(scenario: Scenario, side: Side, start: Pose) -> Joints | None:
    """Return the joint angles of an end's arm at the scenario's start [rad]; None without an arm.

    Raises:
        ConfigurationError: The arm's URDF cannot be used, or the start is out of its reach.
    """
    try:
        kinematics = kinematics_of(scenario, side)
    except ValueError as error:
        raise ConfigurationError(f"ends.{side}: {error}") from error
    return None if kinematics is None else joints_at(kinematics, side, start)


def joints_at(kinematics: UrdfKinematics, side: Side, start: Pose) -> Joints:
    """Return joint angles for a grip pose, on the branch farthest from singularities [rad].

    Raises:
        ConfigurationError: The pose is out of reach.
    """
    joints = kinematics.solve_anywhere(start)
    if joints is None:
        raise ConfigurationError(
            f"ends.{side}: the start grip at {start.position.round(3).tolist()} m is out of the "
            "arm's reach; move base_position or turn the tool"
        )
    return joints

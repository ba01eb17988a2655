"""Installation of the arms of a scenario's cell: kinematics of each end's arm."""

from __future__ import annotations

from lariat.arms.cr5_kinematics import Kinematics
from lariat.arms.description import arm_description
from lariat.arms.kinematics import UrdfKinematics
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

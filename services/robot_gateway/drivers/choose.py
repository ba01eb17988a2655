"""The driver of each end, from the scenario."""

from __future__ import annotations

from services.robot_gateway.drivers.driver import Driver
from services.robot_gateway.drivers.ideal import FixedDriver, IdealDriver
from services.robot_gateway.rules import Body
from shared.geometry.poses import Pose
from shared.scenario import Scenario, Side


def drivers_of(scenario: Scenario, starts: tuple[Pose, Pose]) -> tuple[Driver, Driver]:
    """Left and right."""
    left, right = (_driver(scenario, side, start) for side, start in _ends(starts))
    return left, right


def bodies_of(scenario: Scenario) -> tuple[Body, Body]:
    """The grippers' bodies, left and right: capsules that point away from the rope."""
    limits = scenario.limits
    # The height counts to the far end of the capsule, caps included.
    reach = max(limits.gripper_height - limits.gripper_radius, 0.0)
    return (
        Body(end=(0.0, 0.0, -reach), radius=limits.gripper_radius),
        Body(end=(0.0, 0.0, reach), radius=limits.gripper_radius),
    )


def _ends(starts: tuple[Pose, Pose]) -> tuple[tuple[Side, Pose], tuple[Side, Pose]]:
    return ("left", starts[0]), ("right", starts[1])


def _driver(scenario: Scenario, side: Side, start: Pose) -> Driver:
    match scenario.end(side).driver:
        case "fixed":
            return FixedDriver(start)
        case "ideal":
            return IdealDriver(start)
        case other:
            raise ValueError(f"ends.{side}.driver = {other!r} has no driver")

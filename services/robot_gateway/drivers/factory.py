"""Factory of the drivers of a scenario's ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lariat.configuration import ConfigurationError
from lariat.geometry.poses import Pose
from lariat.protocols.arm import Arm, ArmFacts, ArmSetup
from lariat.scenario import SIDES, Scenario, Side
from lariat.scenario.extensions import Extension
from lariat.scenario.placement import base_of, tool_of
from lariat.scenario.sections import DRIVERS
from services.robot_gateway.drivers.cr5.link import Link
from services.robot_gateway.drivers.driver import Driver
from services.robot_gateway.drivers.ideal import FixedDriver, IdealDriver

INCLUDED_ARMS = {
    "ros2": "services.robot_gateway.drivers.ros2:Ros2Arm",
    "simulated": "services.robot_gateway.drivers.simulated:SimulatedArm",
    "ur": "services.robot_gateway.drivers.ur:UrArm",
}
"""Classes of the arms of Lariat's own that follow joint angles."""


def drivers_of(
    scenario: Scenario,
    starts: tuple[Pose, Pose],
    emulators: Mapping[Side, str],
    links: Mapping[Side, Link],
) -> tuple[Driver, Driver]:
    """Create the drivers of the left and the right end."""
    left, right = (
        _driver(scenario, side, start, links.get(side), emulators.get(side, ""))
        for side, start in zip(SIDES, starts, strict=True)
    )
    return left, right


def _driver(
    scenario: Scenario, side: Side, start: Pose, link: Link | None, emulator: str
) -> Driver:
    match scenario.end(side).driver:
        case "fixed":
            return FixedDriver(start)
        case "ideal":
            return IdealDriver(start)
        case "cr5":
            return _cr5(scenario, side, start, link, emulator)
        case _:
            return _joint_arm(scenario, side, start)


def _cr5(scenario: Scenario, side: Side, start: Pose, link: Link | None, emulator: str) -> Driver:
    # Only a cell with such an arm needs Pinocchio.
    from lariat.arms.cr5_installation import kinematics_of, start_joints
    from services.robot_gateway.drivers.cr5.driver import Cr5Driver
    from services.robot_gateway.drivers.cr5.power_sequences import EnableSettings
    from services.robot_gateway.drivers.cr5.tcp_link import TcpLink

    end = scenario.end(side)
    kinematics = kinematics_of(end)
    start_joints(kinematics, start, side)  # raises when the start is out of reach
    kinematics.compile()
    if link is None:
        host = end.address or emulator
        if not host:
            raise ConfigurationError(
                f"ends.{side} is a CR5 without an address: start its emulator with "
                f"`python -m services.cr5_emulator --scenario FILE --side {side}` and hand its "
                f"host to the gateway with --{side}-emulator, or write ends.{side}.address"
            )
        link = TcpLink(host)
    return Cr5Driver(
        link,
        kinematics,
        scenario.limits,
        emulated=not end.address,
        tool_output=end.tool_output,
        settings=EnableSettings(end.load, end.load_center, end.collision_level),
    )


def _joint_arm(scenario: Scenario, side: Side, start: Pose) -> Driver:
    """Driver of an arm behind `lariat.protocols.Arm`; without an address it is simulated."""
    # Only a cell with such an arm needs Pinocchio.
    from lariat.arms.installation import joints_at
    from lariat.arms.kinematics import UrdfKinematics
    from services.robot_gateway.drivers.joint_arm import JointArmDriver

    end = scenario.end(side)
    named = Extension(f"ends.{side}.driver", INCLUDED_ARMS.get(end.driver, end.driver), DRIVERS)
    facts = getattr(named.load(), "facts", None)
    if not isinstance(facts, ArmFacts):
        raise ConfigurationError(f"{named} lacks facts = ArmFacts(…) of lariat.protocols")
    if facts.simulated and end.address:
        raise ConfigurationError(f"{named} is simulated; remove ends.{side}.address")
    if not facts.simulated and not end.address:
        named = replace(named, name=INCLUDED_ARMS["simulated"])
    if not (facts.urdf or end.urdf) or not (facts.flange or end.flange):
        raise ConfigurationError(f"{named} states no URDF; give ends.{side}.urdf and .flange")
    urdf, flange = scenario.folder / (facts.urdf or end.urdf), facts.flange or end.flange
    try:
        kinematics = UrdfKinematics(urdf, flange, base_of(end), tool_of(end))
    except ValueError as error:
        raise ConfigurationError(f"ends.{side}: {error}") from error
    joints = joints_at(kinematics, side, start)
    kinematics.compile()
    limits = scenario.limits
    setup = ArmSetup(side, end.address, urdf, flange, joints, limits.joint_speed)
    arm: Arm = named.create(("enable", "disable", "set_gripper", "step", "close"), setup)
    return JointArmDriver(end.driver, arm, named, kinematics, limits)

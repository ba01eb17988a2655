"""Factory of the drivers of a scenario's ends."""

from __future__ import annotations

from collections.abc import Mapping

from lariat.geometry.poses import Pose
from services.robot_gateway.drivers.cr5.link import Link
from services.robot_gateway.drivers.driver import Driver
from services.robot_gateway.drivers.fixed import FixedDriver
from services.robot_gateway.drivers.ideal import IdealDriver
from shared.configuration import ConfigurationError
from shared.scenario import SIDES, Scenario, Side


def drivers_of(
    scenario: Scenario,
    starts: tuple[Pose, Pose],
    emulators: Mapping[Side, str],
    links: Mapping[Side, Link],
) -> tuple[Driver, Driver]:
    """Create the drivers of the left and the right end.

    Args:
        scenario: The cell.
        starts: Grip poses at the scenario's start.
        emulators: Hosts of the emulators that stand in for arms without an address.
        links: Links to arms that the caller provides; they are used in place of an address.

    Raises:
        ConfigurationError: An arm cannot be reached, by kinematics or by address.
    """
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


def _cr5(scenario: Scenario, side: Side, start: Pose, link: Link | None, emulator: str) -> Driver:
    # Only a cell with such an arm needs Pinocchio.
    from services.robot_gateway.drivers.cr5.driver import Cr5Driver
    from services.robot_gateway.drivers.cr5.power_sequences import EnableSettings
    from services.robot_gateway.drivers.cr5.tcp_link import TcpLink
    from shared.cr5.installation import kinematics_of, start_joints

    end = scenario.end(side)
    kinematics = kinematics_of(end)
    start_joints(kinematics, start, side)  # raises when the start is out of reach
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
        scenario.limits.joint_speed,
        emulated=not end.address,
        tool_output=end.tool_output,
        settings=EnableSettings(end.load, end.load_center, end.collision_level),
    )

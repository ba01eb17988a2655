"""The driver of each end, from the scenario."""

from __future__ import annotations

from collections.abc import Mapping

from lariat.geometry.poses import Pose
from services.robot_gateway.constraints.motion_constraints import Body
from services.robot_gateway.drivers.driver import Driver
from services.robot_gateway.drivers.ideal import FixedDriver, IdealDriver
from shared.scenario import SIDES, Scenario, Side


def drivers_of(
    scenario: Scenario, starts: tuple[Pose, Pose], emulators: Mapping[Side, str]
) -> tuple[Driver, Driver]:
    """Left and right.

    Args:
        emulators: Hosts of emulated arms; one that is not listed runs in this process.
    """
    left, right = (
        _driver(scenario, s, p, emulators.get(s, "")) for s, p in zip(SIDES, starts, strict=True)
    )
    return left, right


def bodies_of(scenario: Scenario) -> tuple[Body, Body]:
    """The grippers' bodies, left and right: capsules that point away from the rope."""
    limits = scenario.limits
    reach = limits.gripper_reach
    return (
        Body(end=(0.0, 0.0, -reach), radius=limits.gripper_radius),
        Body(end=(0.0, 0.0, reach), radius=limits.gripper_radius),
    )


def _driver(scenario: Scenario, side: Side, start: Pose, emulator: str) -> Driver:
    match scenario.end(side).driver:
        case "fixed":
            return FixedDriver(start)
        case "ideal":
            return IdealDriver(start)
        case "cr5":
            return _cr5(scenario, side, start, emulator)


def _cr5(scenario: Scenario, side: Side, start: Pose, emulator: str) -> Driver:
    # Only a cell with such an arm needs Pinocchio.
    from services.cr5_emulator.core import Emulator
    from services.cr5_emulator.options import Options
    from services.robot_gateway.drivers.cr5.driver import Cr5Driver
    from services.robot_gateway.drivers.cr5.enable_sequence import Settings
    from services.robot_gateway.drivers.cr5.link import MemoryNetwork, TcpNetwork
    from shared.cr5.installation import kinematics_of, start_joints, tether_of

    end = scenario.end(side)
    kinematics = kinematics_of(end)
    joints = start_joints(kinematics, start, side)
    if end.address or emulator:
        network = TcpNetwork(end.address or emulator)
    else:
        options = Options(
            firmware=end.firmware,
            calibrated=end.calibrated,
            joints=joints,
            tether=tether_of(scenario, side),
        )
        network = MemoryNetwork(Emulator(options))
    return Cr5Driver(
        network,
        kinematics,
        scenario.limits.joint_speed,
        emulated=not end.address,
        tool_output=end.tool_output,
        settings=Settings(end.load, end.load_center, end.collision_level),
    )

"""A cell with a fixed left end and an emulated CR5 at the right one, on simulated time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lariat.arms.cr5_kinematics import Kinematics
from lariat.geometry import poses
from lariat.geometry.grippers import gripper_bodies
from lariat.geometry.obstacles import TABLE
from lariat.geometry.poses import Pose
from lariat.safety.constraints.motion_constraints import CellBoundaries
from lariat.safety.guard.consent import SignOfLife
from lariat.safety.guard.force_limit import ForceLimit
from lariat.safety.motion.follower import SetpointFollower
from lariat.scenario.sections import Limits
from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.options import EmulatorOptions
from services.robot_gateway.cell import Cell
from services.robot_gateway.drivers.cr5.driver import Cr5Driver
from services.robot_gateway.drivers.ideal import FixedDriver
from services.robot_gateway.status import CellStatus
from stack.simulation.emulated_arms import MemoryLink
from tests.services.robot_gateway.cells import ALONG_X, BOOT, LIMITS, START, TICK, Driven

BASE = Pose(np.array([0.72, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
TOOL = Pose(np.array([0.0, 0.0, 0.12]), np.array([0.0, 1.0, 0.0, 0.0]))
GRIPS = (
    Pose(np.array([-0.2, 0.0, 0.3]), ALONG_X),
    Pose(np.array([0.12, -0.10, 0.28]), ALONG_X),
)


class ArmWorld(Driven):
    """A cell, its clock, and the emulator's own log of joint motion."""

    def __init__(
        self,
        firmware: str = "v3",
        automatic: bool = True,
        begin: Pose = GRIPS[1],
        simulated: bool = False,
        **options: object,
    ) -> None:
        self._simulated = simulated
        kinematics = Kinematics(BASE, TOOL)
        joints = kinematics.solve_anywhere(begin)
        assert joints is not None
        values = {"firmware": firmware, "joints": tuple(np.degrees(joints)), "power_on_time": 0.5}
        self.emulator = Emulator(EmulatorOptions(**{**values, **options}), start=START * 1e-9)
        self.now = START
        self.tick = TICK
        """Time between two steps of the gateway [ns]."""
        self.start_gateway(automatic)
        self.commanded: list[np.ndarray] = []
        self.measured: list[np.ndarray] = []
        self.joint_speeds: list[tuple[float, float]] = []
        self._sequence = self._command = self._signs = 0
        self.held_command = ""
        """Command whose button a person holds."""

    def start_gateway(self, automatic: bool = False) -> None:
        """Start a gateway, which connects to the arm as it is."""
        kinematics = Kinematics(BASE, TOOL)
        driver = Cr5Driver(MemoryLink(self.emulator), kinematics, Limits(), emulated=True)
        driver.reaches_hardware = not self._simulated
        self.driver = driver
        bodies = gripper_bodies(0.048, 0.012)
        boundaries = CellBoundaries(3.0, ((-2.0, -2.0, 0.01), (2.0, 2.0, 2.0)), bodies)
        follower = SetpointFollower(LIMITS, boundaries, GRIPS, [1], [driver.joint_constraints])
        drivers = (FixedDriver(GRIPS[0]), driver)
        self.cell = Cell(follower, drivers, GRIPS, BOOT, automatic, ForceLimit(20.0))
        self.cell.take_scene([TABLE])
        self.report: CellStatus = self.cell.step(self.now)

    @property
    def seconds(self) -> float:
        return (self.now - START) * 1e-9

    @property
    def mode(self) -> str:
        return self.report.safety.mode

    def step(self) -> CellStatus:
        self.now += self.tick
        if self.held_command:
            self._signs += 1
            sign = SignOfLife(self.held_command, BOOT, self._signs, self.now - self.tick)
            self.cell.take_sign_of_life(sign, self.now)
        self.report = self.cell.step(self.now)
        pose = self.report.arms[1].pose
        self.commanded.append(self.cell.follower.state.positions[0])
        self.measured.append(GRIPS[1].position if pose is None else pose.position)
        speed = float(np.max(np.abs(self.emulator.controller.joint_speed)))
        self.joint_speeds.append((self.seconds, speed))
        return self.report

    def until_ready(self) -> None:
        """Until the arm is armed, enabled and may move."""
        for _ in range(500):
            self.step()
            if self.mode == "armed" and self.report.arms[1].ready:
                self.run(0.05)
                return
        raise AssertionError(f"not ready: {self.report}")

    def go_on(self) -> None:
        """Acknowledge a stop, and resume once the arm is ready."""
        assert self.command("acknowledge") == ""
        for _ in range(500):
            if self.command("resume") == "":
                break
            self.step()
        self.until_ready()

    def approach(self) -> str:
        """Command the approach over the distance that is shown, and hold the button."""
        self.held_command = f"command-{self._command + 1}"
        return self.command("approach")


def circle(centre: np.ndarray, radius: float, speed: float) -> Callable[[float], np.ndarray]:
    """Round a circle in a plane that is level with nothing, from rest over a second on."""
    y, z = np.array([0.0, 1.0, 0.0]), np.array([-0.5, 0.0, 0.87])

    def path(t: float) -> np.ndarray:
        t = max(t, 0.0)
        eased = t - 0.5 if t > 1.0 else t**3 - 0.5 * t**4
        angle = speed / radius * eased
        return centre + radius * (np.sin(angle) * y + (1.0 - np.cos(angle)) * z)

    return path


def off_path(measured: np.ndarray, path: np.ndarray) -> float:
    """Distance of a point to a chain of points [m]."""
    start, way = path[:-1], np.diff(path, axis=0)
    along = np.sum((measured - start) * way, axis=1) / np.maximum(np.sum(way**2, axis=1), 1e-18)
    nearest = start + np.clip(along, 0.0, 1.0)[:, None] * way
    return float(np.min(np.linalg.norm(nearest - measured, axis=1)))


def turned(a: np.ndarray, b: np.ndarray) -> float:
    """Angle between two orientations [rad]."""
    return float(np.linalg.norm(poses.logarithm(poses.multiply(a, poses.conjugate(b)))))

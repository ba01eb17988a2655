"""Two CR5s at the two ends of one rope, in one gateway."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.safety.constraints.sphere_distance import Spheres, sphere_distances
from lariat.safety.guard.operator_commands import OperatorCommand
from lariat.scenario import SIDES, load
from lariat.trajectory import SetpointChunk
from services.robot_gateway.service import build
from services.robot_gateway.status import CellStatus
from services.robot_gateway.writer_control import WriterChunk
from stack.simulation.emulated_arms import emulated_links
from tests.services.robot_gateway.cells import ALONG_X, START, TICK, smooth_step, stopping

SCENARIO = load(Path(__file__).parents[3] / "scenarios" / "two-arms.toml")


class TwoArms:
    """The cell of the scenario with its clock; its emulators are in memory."""

    def __init__(self) -> None:
        links = emulated_links(SCENARIO, first_step=START)
        self.cell = build(SCENARIO, "boot", links=links).cell
        self.drivers = self.cell.arms.drivers
        self.emulators = [links[side].emulator for side in SIDES]
        self.now = START
        self.report: CellStatus = self.cell.step(self.now)
        self.speeds: list[np.ndarray] = []
        self.gaps: list[float] = []
        self._sequence = 0
        for _ in range(1500):
            if self.report.safety.mode == "armed" and self.cell.arms.ready:
                break
            self.step()
        self.run(0.1)
        assert self.report.safety.mode == "armed", self.report

    def step(self) -> None:
        self.now += TICK
        self.report = self.cell.step(self.now)
        self.speeds.append(
            np.array([np.max(np.abs(e.controller.joint_speed)) for e in self.emulators])
        )

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.008)):
            self.step()

    def follow(self, ways: np.ndarray, seconds: float, duration: float) -> None:
        """Both grips by these ways [m] from where they are, as long as it lasts."""
        here, since = self.cell.follower.state.positions.copy(), self.now
        due = end = self.now
        while self.now < end + round(seconds * 1e9):
            if self.now >= due:
                times = (self.now - since) * 1e-9 + 0.02 * np.arange(16)
                points = stopping(np.array([here + smooth_step(t, duration) * ways for t in times]))
                turns = np.tile(ALONG_X, (len(points), 2, 1))
                chunk = SetpointChunk(self.now, 0.02, points, turns)
                self._sequence += 1
                self.cell.take_chunks([WriterChunk(chunk, "writer", self._sequence, self.now)])
                due += 20_000_000
            self.step()
            self.gaps.append(self.gap())

    def gap(self) -> float:
        """Between the arms, links and grippers, by the joints that the emulators have [m]."""
        rows = []
        for k, (driver, emulator) in enumerate(zip(self.drivers, self.emulators, strict=True)):
            kinematics, joints = driver.joint_constraints.kinematics, emulator.controller.joints
            links = Spheres(*kinematics.link_spheres(joints[None]))
            grip = kinematics.grip(joints)  # pyright: ignore[reportAttributeAccessIssue]
            constraints = self.cell.follower.constraints
            body = constraints.gripper_spheres(k, grip.position[None], grip.orientation[None])
            rows.append(Spheres.joined([links, body]))
        return float(sphere_distances(*rows)[0])


SIDEWAYS = np.array([[0.0, 0.10, 0.0], [0.0, 0.10, 0.0]])


@pytest.mark.parametrize(("fault", "cause"), [("collision", "alarm"), ("frozen", "lost_link")])
def test_fault_of_one_arm_stops_both_and_a_person_lets_both_go_on(fault: str, cause: str) -> None:
    world = TwoArms()
    # Armed by itself, as emulated arms are; from here on as real ones.
    world.cell._simulated = False
    world.follow(SIDEWAYS, 0.7, 1.4)
    assert np.all(world.speeds[-1] > 0.05), "both move"
    world.emulators[0].inject(fault)
    begun = len(world.speeds)
    world.follow(0.0 * SIDEWAYS, 0.6, 1.4)
    assert (world.report.safety.mode, world.report.safety.cause) == ("fault", cause)
    assert world.report.safety.detail.startswith("left: ")
    after = np.array(world.speeds[begun:])
    # Braking has begun within 150 ms of the fault, in both arms, and both rest.
    peak = np.argmax(after >= 0.98 * np.max(after, axis=0), axis=0)
    last = [np.nonzero(after[:, k] >= 0.98 * np.max(after[:, k]))[0][-1] for k in (0, 1)]
    assert max(last) * 0.008 <= 0.15, (peak, last)
    assert np.all(after[-1] < 0.01)
    joints = [e.controller.joints.copy() for e in world.emulators]
    world.emulators[0].heal(fault)
    world.follow(SIDEWAYS, 0.4, 1.4)
    # One point may have been under way to an arm that did not listen for a while.
    under_way = (0.02 if fault == "frozen" else 2e-3, 2e-3)
    for emulator, before, most in zip(world.emulators, joints, under_way, strict=True):
        np.testing.assert_allclose(emulator.controller.joints, before, atol=most)
    for action, seconds in (("acknowledge", 1.5), ("resume", 0.1)):
        command = OperatorCommand(action, "boot", world.now, action, session="writer")
        world.cell.take_command(command, world.now)
        world.run(seconds)
        assert world.report.rejection == ""
    world.follow(SIDEWAYS, 1.0, 1.4)
    assert world.report.safety.mode == "moving", world.report
    assert np.all(np.max(world.speeds[-60:], axis=0) > 0.05)


def test_arms_that_would_touch_are_kept_apart_by_their_links() -> None:
    world = TwoArms()
    # Past each other at 55 mm: the grips are far enough apart, the wrists are not.
    past = np.array([[0.29, 0.0, 0.0], [-0.29, 0.055, 0.0]])
    world.follow(past, 4.0, 4.0)
    assert world.report.rule == "spacing", world.report
    grips = world.cell.follower.state.positions
    assert np.linalg.norm(grips[1] - grips[0]) > 0.04, "not the spacing of the grips"
    least = min(world.gaps)
    assert least > 0.004, f"{1e3 * least:.1f} mm between the arms"
    assert least < 0.03, "it stops near, not at the start"

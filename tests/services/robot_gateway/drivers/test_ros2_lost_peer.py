"""Controller of a ROS 2 arm that is killed or falls silent in motion: the cell brakes and holds.

With `pytest -s` it prints how long that takes.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack

import numpy as np
import pytest

from lariat.arms.installation import start_joints
from lariat.arms.urdf import Urdf
from lariat.scenario import Scenario
from lariat.scenario.settings import load_with
from services.robot_gateway.service import build
from shared import topics
from shared.messages import ArmCommand, ArmSetpoints, ArmStates, Setpoints
from shared.runtime.service import Inbox, Received
from tests.robots import UR5
from tests.services.robot_gateway.cells import stopping
from tests.services.robot_gateway.drivers.trajectory_controller import CONTROLLER
from tests.shared.cell import free_port

pytestmark = pytest.mark.live

TICK = 0.008
RAMP = 0.5
"""Time until the speed is reached [s]."""
ATTEMPTS = 8
SPEED = 0.05
"""Speed of the grip when the controller is lost [m/s]."""


class Bench:
    """Gateway on the system's clock, and a controller in a process of its own."""

    def __init__(self) -> None:
        router = f"tcp/127.0.0.1:{free_port()}"
        settings = (
            *UR5.settings("right"),
            "ends.right.driver=ros2",
            f"ends.right.address={router}/{CONTROLLER}",
        )
        self.scenario: Scenario = load_with("fixed-end", settings)
        start = self.scenario.grips(self.scenario.start)[1]
        joints = start_joints(self.scenario, "right", start)
        assert joints is not None
        names = [joint.name for joint in Urdf(UR5.path).chain(UR5.flange)]
        module = "tests.services.robot_gateway.drivers.trajectory_controller"
        numbers = (",".join(names), ",".join(map(repr, joints.tolist())))
        self.controller = subprocess.Popen([sys.executable, "-m", module, router, *numbers])
        self.start = start
        self.gateway = build(self.scenario, "gateway-0")
        self.sequence = 0
        self.began = 0.0
        """Time at which the writer began [s]; 0 before."""
        self.state: ArmStates = self.step()

    def step(self, *messages: tuple[topics.Topic, object]) -> ArmStates:
        time.sleep(TICK)
        now = time.time_ns()
        arrived: dict[str, list[Received]] = {}
        for topic, message in messages:
            self.sequence += 1
            arrived[topic.key] = [Received(message, "writer-0", self.sequence, now)]
        ((_, self.state),) = self.gateway.step(Inbox({}, arrived), now)
        return self.state

    def until(self, condition: Callable[[ArmStates], object]) -> None:
        """Steps until a condition holds; the writer goes on once it has begun."""
        deadline = time.monotonic() + 30.0
        while not condition(self.move() if self.began else self.step()):
            assert time.monotonic() < deadline, self.state

    def begins_to_move(self) -> bool:
        """Whether the arm is at full speed."""
        self.arm()
        self.began = time.monotonic()
        while time.monotonic() - self.began < RAMP + 0.1 and not self.state.cause:
            self.move()
        return self.state.mode == ArmStates.MOVING

    def arm(self) -> None:
        """Arms as a person does."""
        self.until(lambda s: s.arms[1].mode == "following")
        command = ArmCommand(
            id="arm",
            action=ArmCommand.ARM,
            boot=self.state.boot,
            answers=self.state.stamp,
            session=self.state.next_session,
        )
        self.step((topics.ARM_COMMAND, command))
        assert not self.state.refusal
        self.until(lambda s: s.may_move and s.mode == ArmStates.ARMED)

    def move(self) -> ArmStates:
        """Setpoints along y that reach the speed within the ramp."""
        t = (time.monotonic() - self.began + 0.02 * np.arange(16)) / RAMP
        way = RAMP * np.where(t < 1.0, t**3 - 0.5 * t**4, t - 0.5) * SPEED
        points = stopping((self.start.position + np.outer(way, [0.0, 1.0, 0.0]))[:, None])
        arm = ArmSetpoints(
            arm="right",
            positions=points.ravel(),
            orientations=np.tile(self.start.orientation, len(points)),
        )
        now = time.time_ns()
        message = Setpoints(
            session="writer", sequence=self.sequence, t0=now, dt=20_000_000, arms=[arm]
        )
        return self.step((topics.ARM_SETPOINTS, message))

    def close(self) -> None:
        self.controller.kill()
        self.controller.wait()
        self.gateway.cell.close()


def moving_bench(stack: ExitStack) -> Bench:
    """Bench whose arm moves; where the computer was busy and stopped it, another one."""
    for _ in range(ATTEMPTS):
        bench = Bench()
        stack.callback(bench.close)
        if bench.begins_to_move():
            return bench
    raise AssertionError("the arm never moved: the computer is too busy")


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "silent"])
def test_a_controller_that_ends_in_motion_is_a_lost_link(end: signal.Signals) -> None:
    with ExitStack() as stack:
        bench = moving_bench(stack)
        bench.controller.send_signal(end)
        ended = time.monotonic()
        bench.until(lambda s: s.cause == "lost_link")
        print(f"noticed after {1e3 * (time.monotonic() - ended):.0f} ms")
        follower = bench.gateway.cell.follower
        assert bench.state.braking or follower.resting
        # The writer goes on, and is not followed.
        bench.until(lambda _: follower.resting)
        print(f"at rest after {1e3 * (time.monotonic() - ended):.0f} ms")
        stands = follower.state.positions.copy()
        for _ in range(20):
            bench.move()
        np.testing.assert_array_equal(follower.state.positions, stands)
        assert not bench.state.may_move
        assert bench.state.needs_acknowledgement

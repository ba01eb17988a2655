"""Controller of a ROS 2 arm that is killed or falls silent in motion: the cell brakes and holds.

The cell's clock goes on with the peer's messages while it lives, so that a busy computer plays no
part.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lariat.arms.installation import start_joints
from lariat.arms.urdf import Urdf
from lariat.scenario import Scenario
from lariat.scenario.settings import load_with
from services.robot_gateway.drivers.ros2 import SILENCE
from services.robot_gateway.service import build
from shared import topics
from shared.messages import ArmCommand, ArmSetpoints, ArmStates, Setpoints
from shared.runtime.free_port import free_port
from shared.runtime.service import Inbox, Received
from tests.robots import UR5
from tests.services.robot_gateway.cells import stopping
from tests.services.robot_gateway.drivers.trajectory_controller import CONTROLLER

pytestmark = pytest.mark.live

TICK = 0.008
RAMP = 0.5
"""Time until the speed is reached [s]."""
WAIT = 5.0
"""Longest wait for a message of the living peer [s]."""
BRAKING = 0.15
"""Most time from the lost link until the command rests [s]."""
SPEED = 0.05
"""Speed of the grip when the controller is lost [m/s]."""


class Feed:
    """Joint states of the peer, for which a tick waits while it lives."""

    def __init__(self, states: Any) -> None:
        self._states, self._waiting = states, []

    def wait(self) -> None:
        deadline = time.monotonic() + WAIT
        while not self._waiting and time.monotonic() < deadline:
            self._waiting += self._states.take()
            time.sleep(TICK / 8)

    def take(self) -> list[Any]:
        waiting, self._waiting = [*self._waiting, *self._states.take()], []
        return waiting


class Bench:
    """Gateway on the system's clock, and a controller in a process of its own."""

    def __init__(self, real: bool = False) -> None:
        """With `real`, on the system's clock, to measure times."""
        self.real, self.now, self.lives = real, time.time_ns(), True
        self.feed: Feed | None = None
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
        self.driver: Any = self.gateway.cell.arms.drivers[1]
        self.driver = self.driver._arm
        self.sequence = 0
        self.began = 0
        """Time at which the writer began [ns]; 0 before."""
        self.state: ArmStates = self.step()

    def step(self, *messages: tuple[topics.Topic, object]) -> ArmStates:
        """One tick, on the cell's clock or on the system's."""
        time.sleep(TICK)
        self.now = time.time_ns() if self.real else self.now + round(1e9 * TICK)
        link, now = self.driver._link, self.now
        if link is not None and not self.real:
            if self.feed is None:
                self.feed = Feed(link.states)
                self.driver._link = replace(link, states=self.feed)
            if self.lives:
                self.feed.wait()
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
        self.began = self.now
        while self.now - self.began < 1e9 * (RAMP + 0.1) and not self.state.cause:
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
        t = (1e-9 * (self.now - self.began) + 0.02 * np.arange(16)) / RAMP
        way = RAMP * np.where(t < 1.0, t**3 - 0.5 * t**4, t - 0.5) * SPEED
        points = stopping((self.start.position + np.outer(way, [0.0, 1.0, 0.0]))[:, None])
        arm = ArmSetpoints(
            arm="right",
            positions=points.ravel(),
            orientations=np.tile(self.start.orientation, len(points)),
        )
        message = Setpoints(
            session="writer", sequence=self.sequence, t0=self.now, dt=20_000_000, arms=[arm]
        )
        return self.step((topics.ARM_SETPOINTS, message))

    def close(self) -> None:
        self.controller.kill()
        self.controller.wait()
        self.gateway.cell.close()

    def end(self, signal: signal.Signals) -> None:
        """End the peer."""
        self.controller.send_signal(signal)
        self.lives = False

    @property
    def resting(self) -> bool:
        return self.gateway.cell.follower.resting


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "silent"])
def test_a_controller_that_ends_in_motion_is_a_lost_link(end: signal.Signals) -> None:
    with ExitStack() as stack:
        bench = Bench()
        stack.callback(bench.close)
        assert bench.begins_to_move(), bench.state
        bench.end(end)
        ended = bench.now
        bench.until(lambda s: s.cause == "lost_link")
        lost = bench.now
        assert bench.state.braking or bench.resting
        # The writer goes on, and is not followed.
        bench.until(lambda _: bench.resting)
        assert bench.now - lost <= 1e9 * BRAKING
        if end == signal.SIGSTOP:
            # Joint states at 200 Hz, and what was on its way.
            assert lost - ended <= 1e9 * (SILENCE[0] + 2 * TICK)
        follower = bench.gateway.cell.follower
        stands = follower.state.positions.copy()
        for _ in range(20):
            bench.move()
        np.testing.assert_array_equal(follower.state.positions, stands)
        assert not bench.state.may_move
        assert bench.state.needs_acknowledgement

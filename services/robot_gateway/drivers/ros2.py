"""Arm that a ROS 2 controller moves (ros2_control's joint trajectory controller, or one like it).

The address names ROS 2's router and the controller, `tcp/HOST:7447/joint_trajectory_controller`.
Joint angles stream as trajectories of one point on the controller's topic, or, where there is none,
as goals of its action `follow_joint_trajectory`, each of which takes the place of the one before.
The controller ends at its last point when the stream ends. An arm whose `/joint_states` stop for
five of their periods is a lost link. It has not been run on a robot.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from lariat.arms.urdf import Urdf
from lariat.configuration import ConfigurationError
from lariat.protocols.arm import ArmFacts, ArmReading, ArmSetup, Joints
from lariat.trajectory import SECOND
from shared.bus import BusError
from shared.ros2.actions import ActionClient, ClientGoal, Status
from shared.ros2.node import Node, Publisher, Subscription
from shared.ros2.router import environment_domain
from shared.ros2.types import FOLLOW_TRAJECTORY, duration, ros
from shared.ros2.wire import Qos

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
POINT_PERIOD = 0.02
"""Least time between two points [s]."""
LOOKAHEAD = SECOND // 20
"""Time in which the arm is to be at a point [ns]."""
GOAL_LOOKAHEAD = SECOND // 10
"""The same where every point is a goal, which waits until the one before is accepted [ns]."""
GOAL_PERIOD = 0.05
"""Least time between two goals [s], in which the end of the one before is heard of."""
SILENT_PERIODS = 5.0
"""Number of periods of the joint state after which the arm counts as silent [-]."""
SILENCE = (0.04, 0.1)
"""Least and largest age of the joint state from which it does [s]."""
PERIOD_SMOOTHING = 0.05
"""Share of the newest time between two joint states in their period [-]."""
RETRY_TIME = 1.0
"""Time between two attempts to join the graph [s]."""
JOINT_STATES = Qos(depth=8)
"""Quality of the joint state: the newest counts, all are counted."""


@dataclass(frozen=True)
class _Link:
    """Node of this arm and what it exchanges."""

    node: Node
    states: Subscription
    commands: Publisher
    goals: _Goals


class _Goals:
    """Points as goals of the controller's action, one after the other."""

    def __init__(self, client: ActionClient) -> None:
        self._client = client
        self._sent: ClientGoal | None = None
        self._sent_at = -np.inf
        self.problem = ""
        """Why the controller does not follow, until the arm is enabled again."""

    @property
    def matched(self) -> bool:
        """Whether the controller serves the action."""
        return self._client.matched

    @property
    def answered(self) -> bool:
        """Whether it has accepted or rejected the newest goal."""
        return self._sent is None or self._sent.accepted is not None

    def free(self, time: float) -> bool:
        """Return whether the next goal can be sent at a time [s]."""
        return not self.problem and self.answered and time - self._sent_at >= GOAL_PERIOD

    def poll(self) -> None:
        """Take the controller's answers to the newest goal."""
        sent = self._sent
        if sent is None:
            return
        try:
            sent.poll()
        except (ValueError, TimeoutError) as error:
            self.problem = f"gives no answer to a goal: {error}"
        if sent.accepted is False:
            self.problem = "rejects a goal; it has to let a goal take the place of another"
        elif sent.status is Status.ABORTED:
            self.problem = f"gives a goal up: {sent.result.error_string or sent.result.error_code}"
        if self.problem:
            self._sent = None

    def send(self, trajectory: Any, time: float) -> None:
        """Send a trajectory, which replaces the one that is executed."""
        if self._sent is not None:
            self._client.forget(self._sent.id)
        goal = ros(f"{FOLLOW_TRAJECTORY}_Goal", trajectory=trajectory)
        self._sent, self._sent_at = self._client.send(goal), time


class Ros2Arm:
    """Arm behind a joint trajectory controller, without a gripper."""

    facts = ArmFacts(tracking_limit=0.03)

    def __init__(self, setup: ArmSetup) -> None:
        """Create the arm; its thread joins the graph with the first step."""
        self._router, self._controller = _address(setup)
        self._domain = environment_domain()
        self._names = [joint.name for joint in Urdf(setup.urdf).chain(setup.flange)]
        self._side = setup.side
        self._link: _Link | None = None
        self._problem = f"no ROS 2 router answers at {self._router}"
        self._thread: threading.Thread | None = None
        self._ended = threading.Event()
        self._enabled = False
        self._joints: Joints | None = None
        self._velocities: Joints | None = None
        self._heard = -np.inf
        """Time of the newest joint state [s]."""
        self._period = SILENCE[1] / SILENT_PERIODS
        """Mean time between two [s]."""
        self._sent = -np.inf
        """Time of the newest point [s]."""

    def enable(self) -> None:
        self._enabled = True
        if self._link:
            self._link.goals.problem = ""

    def disable(self) -> None:
        self._enabled = False

    def set_gripper(self, close: bool) -> None:
        """Do nothing: a trajectory controller has no gripper."""

    def close(self) -> None:
        self._ended.set()
        if self._link:
            self._link.node.close()

    def step(self, time: float, target: Joints | None) -> ArmReading:
        if self._thread is None:
            self._thread = threading.Thread(target=self._join, name="ros2", daemon=True)
            self._thread.start()
        link = self._link
        if link is None:
            return ArmReading(None, connected=False, faults=(self._problem,), mode="no router")
        if taken := sum(self._take(message) for message in link.states.take()):
            if np.isfinite(self._heard):
                share = 1.0 - (1.0 - PERIOD_SMOOTHING) ** taken
                self._period += share * ((time - self._heard) / taken - self._period)
            self._heard = time
        heard = time - self._heard < min(max(SILENT_PERIODS * self._period, SILENCE[0]), SILENCE[1])
        streams = link.commands.matched
        link.goals.poll()
        # A controller that has gone is a lost link as well: it is heard of before the silence.
        follows = streams or link.goals.matched
        if target is not None and self._enabled and heard and follows:
            if streams and time - self._sent >= POINT_PERIOD:
                link.commands.put(self._trajectory(target, LOOKAHEAD))
                self._sent = time
            elif not streams and link.goals.free(time):
                link.goals.send(self._trajectory(target, GOAL_LOOKAHEAD), time)
        problem = link.goals.problem if self._enabled and not streams else ""
        if not follows:
            problem = "neither subscribes to joint_trajectory nor serves follow_joint_trajectory"
        return ArmReading(
            self._joints,
            self._velocities,
            ready=self._enabled and heard and follows and not problem,
            connected=heard and follows,
            faults=(f"{self._controller} {problem}",) if heard and problem else (),
            mode="following" if heard and follows else "silent",
        )

    def _join(self) -> None:
        """Join the graph, as soon as there is a router."""
        while not self._ended.is_set():
            try:
                node = Node(
                    f"lariat_{self._side}", "/lariat", self._domain, self._router, serve=False
                )
                states = node.subscription(
                    "/joint_states", "sensor_msgs/msg/JointState", JOINT_STATES
                )
                commands = node.publisher(f"/{self._controller}/joint_trajectory", TRAJECTORY)
                action = f"/{self._controller}/follow_joint_trajectory"
                goals = _Goals(ActionClient(node, action, FOLLOW_TRAJECTORY))
                self._link = _Link(node, states, commands, goals)
                return
            except BusError as error:
                self._problem = str(error)
                self._ended.wait(RETRY_TIME)

    def _take(self, message: Any) -> bool:
        """Take the angles of a joint state that has all joints of this arm; whether it does."""
        places = {name: k for k, name in enumerate(message.name)}
        if not places.keys() >= set(self._names) or len(message.position) != len(message.name):
            return False
        order = [places[name] for name in self._names]
        joints = np.asarray(message.position, float)[order]
        # ros2_control writes NaN for what it has not read.
        if not np.isfinite(joints).all():
            return False
        whole = len(message.velocity) == len(message.name)
        velocities = np.asarray(message.velocity, float)[order] if whole else np.array([np.nan])
        self._joints = joints
        self._velocities = velocities if np.isfinite(velocities).all() else None
        return True

    def _trajectory(self, target: Joints, lookahead: int) -> Any:
        point = ros(
            "trajectory_msgs/msg/JointTrajectoryPoint",
            positions=np.asarray(target, float),
            time_from_start=duration(lookahead),
        )
        # A stamp of zero begins at once, whatever the clock of the other machine.
        return ros(TRAJECTORY, joint_names=self._names, points=[point])


def _address(setup: ArmSetup) -> tuple[str, str]:
    """Router and controller of an arm's address."""
    scheme, _, rest = setup.address.partition("/")
    place, _, controller = rest.partition("/")
    if scheme not in ("tcp", "tls", "udp", "quic") or ":" not in place or not controller:
        raise ConfigurationError(
            f"ends.{setup.side}.address = {setup.address!r} names no ROS 2 controller; write "
            "'tcp/ROUTER:7447/joint_trajectory_controller'"
        )
    return f"{scheme}/{place}", controller.strip("/")

"""Messages of a cell as its services would send them, for pages without a stack.

The rope is a parabola between two grips, no rod: good enough to draw, not to measure.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from dashboard.subscriptions import SERVICES
from lariat.geometry import polylines
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Scenario, Side
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.scenario.rod_properties import rod_properties
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import (
    IDLE,
    RUNNING,
    ArmState,
    ArmStates,
    Estimate,
    Goal,
    Health,
    NodeChain,
    Parameters,
    Path,
    Plan,
    RodParameters,
    Scene,
    TaskState,
    grip,
    obstacle_message,
)
from shared.runtime.service import Mailbox, Publication, Received, Reflex, Service
from shared.topics import Topic


def hanging(left: np.ndarray, right: np.ndarray, length: float, count: int) -> np.ndarray:
    """A parabola of the given length between two points [m]."""
    t = np.linspace(0.0, 1.0, 400)[:, None]

    def sagging(sag: float) -> np.ndarray:
        return left + t * (right - left) - 4.0 * t * (1.0 - t) * np.array([0.0, 0.0, sag])

    low, high = 0.0, 2.0 * length
    for _ in range(40):
        middle = (low + high) / 2.0
        short = polylines.length(sagging(middle)) < length
        low, high = (middle, high) if short else (low, middle)
    return polylines.resample(sagging(low), count)


class Stage:
    """Delivers messages to one service and steps it."""

    def __init__(self, service: Service, scenario: Scenario) -> None:
        self.scenario = scenario
        self.now = 1_000 * SECOND
        self.goal_revision = 1
        """Number of the goal that the controller has."""
        self._goal: Goal | None = None
        self._service = service
        self._mailbox = Mailbox(service.reads)
        self._at_once: list[Publication] = []
        self._reflex: Reflex | None = getattr(service, "reflex", None)
        if reflex := self._reflex:
            reflex.connect(lambda m: self._at_once.append(Publication(reflex.writes, m)))
        self._sequence = 0
        self._kinematics: dict[Side, Any] = {}
        self._shapes: dict[float, np.ndarray] = {}

    def send(self, topic: Topic, message: object) -> None:
        """One message on its way."""
        self._sequence += 1
        self._mailbox.deliver(topic.key, Received(message, "stage", self._sequence, self.now))
        if self._reflex and topic.key == self._reflex.reads.key:
            self._reflex.take(message)

    def step(self, seconds: float = 1.0 / 30.0) -> list[Publication]:
        """The service's answer, some time later."""
        self.now += round(seconds * SECOND)
        publications = list(self._service.step(self._mailbox.take(), self.now))
        at_once = [self._at_once.pop(0) for _ in range(len(self._at_once))]
        return at_once + publications

    def nodes(self, fraction: float) -> np.ndarray:
        """The rope on its way from start to goal."""
        if fraction in self._shapes:
            return self._shapes[fraction]
        start, goal = (
            np.array([g.position for g in self.scenario.grips(s)])
            for s in (self.scenario.start, self.scenario.goal)
        )
        over = np.array([0.0, 0.0, 0.1 * np.sin(np.pi * fraction)])
        left, right = (1.0 - fraction) * start + fraction * goal + over
        rope = self.scenario.rope
        self._shapes[fraction] = hanging(left, right, rope.length, rope.node_count)
        return self._shapes[fraction]

    def set_goal(self, goal: Goal) -> None:
        """Let the controller have another goal than the scenario's."""
        self._goal, self.goal_revision = goal, self.goal_revision + 1

    def goal(self) -> Goal:
        """The goal as the controller publishes it."""
        if self._goal is not None:
            return self._goal
        left, right = self.scenario.grips(self.scenario.goal)
        return Goal(positions=self.nodes(1.0).ravel(), left=grip(left), right=grip(right))

    def arms(self, nodes: np.ndarray, **fields: object) -> ArmStates:
        """Both arms at the ends of the rope."""
        grips = self.scenario.grips(self.scenario.start)
        arms = [
            ArmState(
                arm=side,
                driver=self.scenario.end(side).driver,
                position=nodes[end],
                orientation=pose.orientation,
                gripper_closed=True,
                joints=self._joints(side, Pose(nodes[end], pose.orientation)),
            )
            for side, end, pose in zip(SIDES, (0, -1), grips, strict=True)
        ]
        return ArmStates(
            **{"stamp": self.now, "boot": "boot-1", "mode": ArmStates.ARMED, "arms": arms, **fields}
        )

    def _joints(self, side: Side, grip: Pose) -> list[float]:
        """Joint angles at which the arm of an end has its grip in a pose [rad]; none without."""
        if self.scenario.end(side).driver != "cr5":
            return []
        if side not in self._kinematics:
            # Imported late: only a cell with arms needs Pinocchio.
            from lariat.arms.installation import kinematics_of

            self._kinematics[side] = kinematics_of(self.scenario, side)
        start = self.scenario.grips(self.scenario.start)[SIDES.index(side)]
        near = self._kinematics[side].solve_anywhere(start)
        return self._kinematics[side].solve(grip, near).tolist()

    def play(self, fraction: float) -> None:
        """Send every message of a running cell at one moment of its run."""
        scenario, nodes = self.scenario, self.nodes(fraction)
        count = len(nodes)
        sigma = 0.001 + 0.004 * np.sin(np.linspace(0.0, np.pi, count)) ** 8
        observed = np.abs(np.arange(count) - 0.7 * count) > 2
        error = polylines.mean_node_distance(nodes, self.nodes(1.0))
        running = 0.0 < fraction < 1.0
        task = TaskState(
            stamp=self.now,
            state=RUNNING if running else IDLE,
            goal=self.goal(),
            goal_revision=self.goal_revision,
            run="20260101-three-cylinders",
            run_started=1_000 * SECOND if running else 0,
            settings={"adapt": "false"},
            error=error,
            clearance=0.02 + 0.05 * (2.0 * fraction - 1.0) ** 2,
        )
        ahead = [self.nodes(min(1.0, fraction + 0.03 * k)) for k in range(1, 6)]
        way = [self.nodes(f) for f in np.linspace(0.0, 1.0, 40)]
        stiffness = rod_properties(scenario.rope).bending_stiffness
        rod = RodParameters(
            bending_stiffness=Estimate(
                value=stiffness * (1.0 + 0.2 * fraction),
                standard_deviation=0.1 * stiffness * (1.2 - fraction),
            ),
            length=Estimate(value=1.01 * scenario.plant_rope.length, standard_deviation=0.002),
        )
        for topic, message in (
            (topics.TASK_STATE, task),
            (
                topics.ROPE_NODES,
                NodeChain(stamp=self.now, positions=nodes.ravel(), sigma=sigma, observed=observed),
            ),
            (topics.ROPE_TRUTH, NodeChain(stamp=self.now, positions=nodes.ravel() + 0.001)),
            (
                topics.CONTROLLER_PLAN,
                Plan(
                    stamp=self.now,
                    node_count=count,
                    nodes=np.concatenate(ahead).ravel(),
                    cost={"goal": 3.0, "clearance": 1.0},
                ),
            ),
            (
                topics.CONTROLLER_PATH,
                Path(
                    left_positions=np.array([w[0] for w in way]).ravel(),
                    right_positions=np.array([w[-1] for w in way]).ravel(),
                    nodes=np.concatenate(way).ravel(),
                    node_count=count,
                ),
            ),
            (
                topics.CONTROLLER_PARAMETERS,
                Parameters(stamp=self.now, rod=rod, prediction_error=1e-3),
            ),
            (topics.ARM_STATE, self.arms(nodes, mode=ArmStates.MOVING)),
            (
                topics.SCENE_STATE,
                Scene(revision=1, obstacles=[obstacle_message(b) for b in scenario.bodies]),
            ),
        ):
            self.send(topic, message)
        for name in SERVICES:
            health = Health(service=name, period_ms=20.0, step_p50_ms=4.2, step_p99_ms=9.1)
            health.input_age_ms["rope/nodes"] = 33.0
            self.send(topics.HEALTH.at(name), health)

    def picture(self) -> None:
        """One camera image, a grey ramp."""
        width, height = self.scenario.sensing.resolution
        ramp = np.tile(np.linspace(30, 90, width).astype(np.uint8), (height, 1))
        data = cv2.imencode(".jpg", cv2.cvtColor(ramp, cv2.COLOR_GRAY2BGR))[1].tobytes()
        self.send(topics.CAMERA_COLOR.at(DEFAULT_CAMERA), CompressedImage(data=data, format="jpeg"))

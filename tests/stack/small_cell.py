"""A cell small enough to check by hand: a straight rope whose ends go straight to the goal."""

from __future__ import annotations

import numpy as np

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Scenario, parse
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import (
    IDLE,
    REACHED,
    RUNNING,
    ArmSetpoints,
    ArmState,
    ArmStates,
    Goal,
    NodeChain,
    Setpoints,
    TaskRequest,
    TaskState,
    arm_pose,
    chain,
    grip,
)
from shared.runtime.service import Inbox, Publication

TEXT = """
name = "small"
[rope]
length = 0.40
diameter = 0.01
node_count = 5
[start]
line = [[-0.195, 0.0, 0.3], [0.195, 0.0, 0.3]]
[goal]
line = [[-0.195, 0.2, 0.3], [0.195, 0.2, 0.3]]
[[obstacles]]
name = "post"
shape = "sphere"
position = [0.0, 0.1, 0.36]
radius = 0.03
[run]
time_limit = 3.0
tolerance = 0.002
"""
"""The rope's axis passes the post at 30 mm, its surface at 25 mm."""

SPEED = 0.1
"""Of the ends [m/s]."""


class Rope:
    """A straight chain between the grips, seen without error."""

    name, reads = "sim", (topics.ARM_STATE,)
    writes = (topics.ROPE_TRUTH, topics.ROPE_NODES)
    rate, latency = 30.0, 0.01

    def __init__(self, count: int) -> None:
        self.count = count

    def warm_up(self) -> None: ...

    def step(self, inbox: Inbox, now: int):
        arms = inbox.latest(topics.ARM_STATE)
        if arms is None:
            return
        ends = np.array([arm_pose(arms.message, side).position for side in SIDES])
        nodes = polylines.resample(ends, self.count)
        message = NodeChain(stamp=now, positions=nodes.ravel())
        yield Publication(topics.ROPE_TRUTH, message)
        yield Publication(topics.ROPE_NODES, message)


class Arms:
    """Ends that are where the newest setpoint says."""

    name, reads = "robot_gateway", (topics.ARM_SETPOINTS,)
    writes = (topics.ARM_STATE,)
    rate, latency = 125.0, 0.002

    def __init__(self, grips: tuple[Pose, Pose]) -> None:
        self.grips = list(grips)

    def warm_up(self) -> None: ...

    def step(self, inbox: Inbox, now: int):
        for setpoints in inbox.every(topics.ARM_SETPOINTS):
            for k, arm in enumerate(setpoints.message.arms):
                self.grips[k] = Pose(chain(arm.positions)[-1], poses.IDENTITY)
        arms = [
            ArmState(arm=side, position=g.position, orientation=g.orientation)
            for side, g in zip(SIDES, self.grips, strict=True)
        ]
        yield Publication(
            topics.ARM_STATE,
            ArmStates(stamp=now, boot="arms", mode=ArmStates.ARMED, may_move=True, arms=arms),
        )


class Straight:
    """Moves both ends to the goal along straight lines."""

    name = "controller"
    reads = (topics.TASK_REQUEST, topics.ARM_STATE, topics.ROPE_NODES)
    writes = (topics.TASK_STATE, topics.ARM_SETPOINTS)
    rate, latency = 50.0, 0.01

    def __init__(self, scenario: Scenario, speed: float) -> None:
        goal, count = scenario.grips(scenario.goal), scenario.rope.node_count
        self.goal = [g.position for g in goal]
        self.ends = [g.position for g in scenario.grips(scenario.start)]
        self.arrived = 0
        nodes = polylines.resample(np.array(self.goal), count)
        self.state = TaskState(
            goal=Goal(positions=nodes.ravel(), left=grip(goal[0]), right=grip(goal[1]))
        )
        self.step_length = speed / self.rate

    def warm_up(self) -> None: ...

    def step(self, inbox: Inbox, now: int):
        for request in inbox.every(topics.TASK_REQUEST):
            if request.message.action == TaskRequest.START:
                self.state.state, self.state.run_started = RUNNING, now
            self.state.last_request = request.message.id
        rope = inbox.latest(topics.ROPE_NODES)
        if self.state.state != IDLE and rope:
            nodes, wanted = chain(rope.message.positions), chain(self.state.goal.positions)
            self.state.error = polylines.mean_node_distance(nodes, wanted)
            for k, goal in enumerate(self.goal):
                way = goal - self.ends[k]
                way *= min(1.0, self.step_length / max(float(np.linalg.norm(way)), 1e-12))
                self.ends[k] = self.ends[k] + way
            arms = [ArmSetpoints(arm=s, positions=e) for s, e in zip(SIDES, self.ends, strict=True)]
            yield Publication(topics.ARM_SETPOINTS, Setpoints(stamp=now, arms=arms))
            self.arrived = (self.arrived or now) if self.state.error < 1e-6 else 0
            if self.arrived and now > self.arrived + 0.3 * SECOND:
                self.state.state = REACHED
        self.state.stamp = now
        yield Publication(topics.TASK_STATE, self.state)


def scenario(folder, text: str = TEXT) -> Scenario:
    return parse(text, folder)


def members(scenario: Scenario, speed: float = SPEED):
    return (
        Rope(scenario.rope.node_count),
        Straight(scenario, speed),
        Arms(scenario.grips(scenario.start)),
    )

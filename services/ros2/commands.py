"""Commands of ROS 2 nodes as requests on the bus, and their answers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from lariat.geometry.poses import Pose
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import (
    ArmCommand,
    Goal,
    Obstacle,
    Scene,
    SceneRequest,
    TaskRequest,
    TaskState,
    grip,
)
from shared.messages.validation import decode
from shared.ros2.node import Node, Request
from shared.ros2.table import Table
from shared.ros2.types import TRIGGER, ros, wxyz, xyz
from shared.runtime.service import Inbox, Publication
from shared.topics import Topic

ANSWER_TIMEOUT = 3 * SECOND
"""Longest wait for the answer to a request [ns]."""
MAX_PENDING = 64
"""Most requests that wait for an answer."""
TASK_ACTIONS = {
    "start": TaskRequest.START,
    "pause": TaskRequest.PAUSE,
    "stop": TaskRequest.STOP,
    "reset": TaskRequest.RESET,
}
"""Requests to the run, by the name of their service."""
SOLIDS = {1: "box", 2: "sphere", 3: "cylinder"}
"""Shape of each type of shape_msgs/SolidPrimitive that becomes an obstacle."""
ADD, REMOVE, MOVE = 0, 1, 3
"""Operations of moveit_msgs/CollisionObject."""


@dataclass
class Pending:
    """Request on the bus that has not been answered."""

    sent: int
    """Time of its sending [ns]."""
    asked: tuple[Request, ...]
    """Service requests to answer; empty where nobody waits."""
    outcome: tuple[bool, str] | None = None
    """Whether it was carried out, and why not."""


class Commands:
    """Services and topics by which ROS 2 nodes command the cell."""

    reads = (topics.TASK_STATE, topics.SCENE_STATE, topics.RUN_RESULT, topics.ARM_STATE)
    writes = (topics.TASK_REQUEST, topics.SCENE_REQUEST, topics.ARM_HOLD, topics.ARM_TRAJECTORY)

    def __init__(self, node: Node, session: str, table: Table) -> None:
        inputs = table.inputs
        self._services = {n: node.service(inputs[n].name, inputs[n].type) for n in TASK_ACTIONS}
        self._hold = node.service(inputs["hold"].name, TRIGGER)
        self._goals, self._objects = (
            node.subscription(row.name, row.type, row.qos)
            for row in (inputs["goal"], inputs["collision_object"])
        )
        self._world = table.settings.world_frame
        self._door = node.door
        self._session, self._count = session, 0
        self._hold_id = ""
        self._pending: dict[str, Pending] = {}
        self._queued: list[Publication] = []

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Yield the requests of all nodes, and answer those that have been handled."""
        for name, service in self._services.items():
            if asked := tuple(service.take()):
                self.request_task(TASK_ACTIONS[name], now, asked)
        for message in self._goals.take():
            with self._door.guard("ROS 2 goal"):
                self.request_task(TaskRequest.SET_GOAL, now, goal=self.goal_of(message))
        for message in self._objects.take():
            with self._door.guard("ROS 2 collision_object"):
                for action, obstacle in scene_changes(message, _scene(inbox), self._world):
                    request = SceneRequest(stamp=now, action=action, obstacle=obstacle)
                    request = _checked(topics.SCENE_REQUEST, request)
                    request.id = self._next(now)
                    self._queued.append(Publication(topics.SCENE_REQUEST, request))
        self._answer(inbox, now)
        # One hold for all who ask before it is answered: a state names the newest command alone.
        if asked := tuple(self._hold.take()):
            if holding := self._pending.get(self._hold_id):
                holding.asked += asked
            else:
                self._hold_id = self._next(now, asked)
        if self._hold_id in self._pending:
            # Sent until it is answered: a person's command may have hidden the answer.
            hold = ArmCommand(id=self._hold_id, stamp=now, action=ArmCommand.HOLD)
            self._queued.append(Publication(topics.ARM_HOLD, hold))
        queued, self._queued = self._queued, []
        yield from queued

    def request_task(
        self,
        action: TaskRequest.Action,
        now: int,
        asked: tuple[Request, ...] = (),
        goal: Goal | None = None,
    ) -> Pending:
        """Send a request to the controller with the next step."""
        id = self._next(now, asked)
        request = TaskRequest(id=id, stamp=now, action=action, goal=goal)
        self._queued.append(Publication(topics.TASK_REQUEST, request))
        return self._pending[id]

    def goal_of(self, message: Any) -> Goal:
        """Return the goal of a message; see `goal_of_poses`."""
        goal = goal_of_poses(message, self._world)
        request = TaskRequest(action=TaskRequest.SET_GOAL, goal=goal)
        return _checked(topics.TASK_REQUEST, request).goal

    def _next(self, now: int, asked: tuple[Request, ...] = ()) -> str:
        """Id of a new request, whose answer is waited for."""
        self._count += 1
        id = f"{self._session}-{self._count}"
        if len(self._pending) >= MAX_PENDING:
            self._end(next(iter(self._pending)), False, "too many requests")
        self._pending[id] = Pending(now, asked)
        return id

    def _answer(self, inbox: Inbox, now: int) -> None:
        states = [inbox.latest(topic) for topic in (topics.TASK_STATE, topics.SCENE_STATE)]
        answers = [(s.message.last_request, s.message.refusal) for s in states if s is not None]
        if arms := inbox.latest(topics.ARM_STATE):
            answers.append((arms.message.last_command, arms.message.refusal))
        for id, refusal in answers:
            if id in self._pending:
                self._end(id, not refusal, refusal)
        for id in [i for i, p in self._pending.items() if now - p.sent > ANSWER_TIMEOUT]:
            self._end(id, False, "no process has answered; lariat status shows which run")

    def _end(self, id: str, success: bool, message: str) -> None:
        pending = self._pending.pop(id)
        pending.outcome = success, message
        for asked in pending.asked:
            asked.reply(ros(f"{TRIGGER}_Response", success=success, message=message))
        if not pending.asked and not success:
            self._door.refuse("ROS 2 request", message)


def _checked(topic: Topic, request: Any) -> Any:
    """Request as its readers take it."""
    return decode(topic, request.SerializeToString())


def goal_of_poses(message: Any, world: str) -> Goal:
    """Return the goal of a geometry_msgs/PoseArray in the frame `world`.

    Two poses are those of the grips, between which the rope rests. More are nodes from left to
    right; the first and the last one have the orientations of the grips.
    """
    if message.header.frame_id not in ("", world):
        raise ValueError(
            f"the goal is in the frame {message.header.frame_id!r}; give it in {world!r}"
        )
    if len(message.poses) < 2:
        raise ValueError("a goal has the poses of both grips, or one for each node")
    places = np.array([xyz(p.position) for p in message.poses])
    left, right = (
        grip(Pose(np.array(xyz(p.position)), np.array(wxyz(p.orientation))))
        for p in (message.poses[0], message.poses[-1])
    )
    nodes = places.ravel().tolist() if len(places) > 2 else []
    return Goal(positions=nodes, left=left, right=right)


def scene_changes(
    message: Any, scene: Scene, world: str
) -> Iterator[tuple[SceneRequest.Action, Obstacle]]:
    """Yield the changes of the scene that a moveit_msgs/CollisionObject asks for."""
    if message.header.frame_id not in ("", world):
        raise ValueError(f"{message.id!r} is in {message.header.frame_id!r}; give it in {world!r}")
    mine = [o.name for o in scene.obstacles if o.name.partition(".")[0] == message.id]
    if message.operation == REMOVE:
        yield from ((SceneRequest.REMOVE, Obstacle(name=name)) for name in mine)
        return
    if message.meshes or message.planes:
        raise ValueError(f"{message.id!r} has meshes or planes; give boxes, spheres or cylinders")
    origin = Pose(np.array(xyz(message.pose.position)), np.array(wxyz(message.pose.orientation)))
    for k, (solid, place) in enumerate(
        zip(message.primitives, message.primitive_poses, strict=False)
    ):
        obstacle = _obstacle(f"{message.id}.{k}", solid, place, origin)
        present = obstacle.name in mine
        if message.operation == MOVE and not present:
            raise ValueError(f"{message.id!r} is not in the scene")
        yield (SceneRequest.MOVE if present else SceneRequest.ADD), obstacle


def _obstacle(name: str, solid: Any, place: Any, origin: Pose) -> Obstacle:
    if solid.type not in SOLIDS:
        raise ValueError(f"{name!r} is no box, sphere or cylinder")
    local = Pose(np.array(xyz(place.position)), np.array(wxyz(place.orientation)))
    pose = origin @ local if np.any(origin.orientation) else local
    place = {"position": pose.position, "orientation": pose.orientation}
    obstacle = Obstacle(name=name, shape=SOLIDS[solid.type], **place)
    sizes = [float(size) for size in solid.dimensions]
    if obstacle.shape == "box":
        obstacle.size.extend(sizes)
    elif obstacle.shape == "sphere":
        (obstacle.radius,) = sizes
    else:
        obstacle.height, obstacle.radius = sizes
    return obstacle


def _scene(inbox: Inbox) -> Scene:
    newest = inbox.latest(topics.SCENE_STATE)
    return newest.message if newest else Scene()


def task_state(inbox: Inbox) -> TaskState:
    """Return the newest state of the run."""
    newest = inbox.latest(topics.TASK_STATE)
    return newest.message if newest else TaskState()

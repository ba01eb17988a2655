"""Cell in simulated time whose arms and camera are reached through ROS 2 alone.

The wire is real, between sessions of their own: a stand-in of ros2_control moves each arm, with
lag, and a node publishes the simulated camera. A step waits for what was sent to it, so that the
speed of the computer plays no part; an image that does not come is lost.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

from lariat.arms.description import CR5_FLANGE, CR5_URDF
from lariat.arms.installation import start_joints
from lariat.arms.urdf import Urdf
from lariat.scenario import SIDES, Scenario, Side
from lariat.scenario.settings import load_with
from lariat.trajectory import NANOSECONDS
from services.camera.ros2 import Ros2Camera
from services.camera.service import CameraService
from services.camera.stream import CameraStream
from services.robot_gateway.service import build as build_gateway
from services.sim.service import build as build_sim
from shared import topics
from shared.ros2.node import Node, Publisher
from shared.ros2.outputs import outputs
from shared.runtime.free_port import free_port
from shared.runtime.service import Inbox, Publication
from shared.topics import Topic
from stack import services
from stack.simulation import closed_loop
from stack.simulation.closed_loop import RunOutcome
from stack.simulation.simulated_time import START, session_id
from tests.closed_loop.loop import SCENARIOS
from tests.services.robot_gateway.drivers.trajectory_controller import TrajectoryController
from tests.shared.cell import until

CAMERA = "overhead"
IMAGES = (topics.CAMERA_COLOR, topics.CAMERA_DEPTH, topics.CAMERA_CALIBRATION)
SENT = ("color/image_raw", "depth/image_raw", "color/camera_info")
"""Topics of the camera, in the namespace of its name."""


class Feed:
    """Subscription that can be waited for."""

    def __init__(self, subscription: Any) -> None:
        self._subscription = subscription
        self.count = 0
        """Number of messages that have arrived."""
        self.lost = 0
        self._waiting: list[Any] = []

    def wait(self, count: int, lossy: bool = False) -> None:
        """Waits until so many messages have arrived, or are lost."""
        deadline = time.monotonic() + (2.0 if lossy else 30.0)
        while self._collect() < count:
            time.sleep(1e-4)
            if time.monotonic() > deadline:
                assert lossy, f"{self.count} of {count} messages"
                self.lost += count - self.count
                self.count = count

    def take(self) -> list[Any]:
        self._collect()
        waiting, self._waiting = self._waiting, []
        return waiting

    def _collect(self) -> int:
        arrived = list(self._subscription.take())
        self._waiting += arrived
        self.count += len(arrived)
        return self.count


class ArmsOverRos:
    """Gateway whose arms are behind controllers of ROS 2."""

    def __init__(self, scenario: Scenario, router: str, action: bool) -> None:
        """With `action`, they take goals of FollowJointTrajectory, one after the other."""
        self._gateway = build_gateway(scenario, session_id("robot_gateway"))
        self.name, self.reads, self.writes = (
            self._gateway.name,
            self._gateway.reads,
            self._gateway.writes,
        )
        self.rate, self.latency, self.door = (
            self._gateway.rate,
            self._gateway.latency,
            self._gateway.door,
        )
        self._now = START * NANOSECONDS
        self._arms: list[tuple[Any, Any]] = []
        self._action = action
        for k, side in enumerate(SIDES):
            end = scenario.end(side)
            if end.driver != "ros2":
                continue
            joints = start_joints(scenario, side, scenario.grips(scenario.start)[k])
            assert joints is not None
            names = [joint.name for joint in Urdf(Path(end.urdf)).chain(end.flange)]
            controller = TrajectoryController(
                router, names, joints, action, f"{side}_controller", clock=lambda: self._now
            )
            driver: Any = self._gateway.cell.arms.drivers[k]
            self._arms.append((driver._arm, controller))

    def warm_up(self) -> None:
        """Joins the graph."""
        for arm, controller in self._arms:
            arm.step(self._now, None)
            until(lambda arm=arm: arm._link is not None, 30.0)
            link = arm._link
            commands = link.goals if self._action else link.commands
            until(lambda commands=commands: commands.matched, 30.0)
            arm._link = replace(link, states=Feed(link.states))
            if controller.server:
                controller.server._send = Feed(controller.server._send)
            else:
                controller._commands = Feed(controller._commands)
            until(lambda controller=controller: controller._states.matched, 30.0)

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        self._now = now * NANOSECONDS
        for arm, controller in self._arms:
            link, server = arm._link, controller.server
            if server:
                server._send.wait(link.goals._client._send._sequence)
            else:
                controller._commands.wait(link.commands._sequence)
            controller.step()
            if server:
                until(lambda link=link: link.goals.poll() or link.goals.answered, 30.0)
        # Every arm hears the joint states of all.
        sent = sum(controller._states._sequence for _, controller in self._arms)
        for arm, _ in self._arms:
            arm._link.states.wait(sent)
        yield from self._gateway.step(inbox, now)

    def close(self) -> None:
        self._gateway.cell.close()
        for _, controller in self._arms:
            controller.node.close()

    @property
    def points(self) -> list[int]:
        """Numbers of commands that the controllers have taken."""
        return [controller.points for _, controller in self._arms]


class CameraNode:
    """Simulator whose images go to ROS 2, and nowhere else."""

    def __init__(self, scenario: Scenario, router: str) -> None:
        self._sim = build_sim(scenario, session_id("sim"))
        self.name, self.reads, self.rate = self._sim.name, self._sim.reads, self._sim.rate
        self.wakes, self.latency, self.door = self._sim.wakes, 0.0, self._sim.door
        self.writes: Sequence[Topic] = (topics.ROPE_TRUTH,)
        self._node = Node("camera", f"/{CAMERA}", router=router)
        rows = [next(o for o in outputs() if o.name == f"camera/{{name}}/{name}") for name in SENT]
        self._converters = {
            source.at(CAMERA).key: (row.convert, self._node.publisher(name, row.type, row.qos))
            for source, row, name in zip(IMAGES, rows, SENT, strict=True)
        }

    def warm_up(self) -> None:
        self._sim.warm_up()
        until(lambda: all(p.matched for p in self.publishers), 30.0)

    @property
    def publishers(self) -> list[Publisher]:
        """Publishers of colour, depth and intrinsics."""
        return [publisher for _, publisher in self._converters.values()]

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        for publication in self._sim.step(inbox, now):
            if publication.topic.key in self._converters:
                convert, publisher = self._converters[publication.topic.key]
                publisher.put(convert(publication.message))
            else:
                yield publication

    def close(self) -> None:
        self._node.close()


class CameraOverRos(CameraService):
    """Camera service whose source is the node's camera."""

    rate = 250.0

    def __init__(self, scenario: Scenario, node: CameraNode, router: str) -> None:
        names = [f"/{CAMERA}/{name}" for name in SENT]
        self._source: Any = Ros2Camera(*names, router, 0)
        self._publishers = node.publishers
        super().__init__([CameraStream(CAMERA, self._source, 0.0)])
        self.latency = scenario.sensing.latency
        for name in ("_color", "_depth", "_info"):
            setattr(self._source, name, Feed(getattr(self._source, name)))

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        feeds = (self._source._color, self._source._depth, self._source._info)
        for feed, publisher in zip(feeds, self._publishers, strict=True):
            feed.wait(publisher._sequence, lossy=True)
        yield from super().step(inbox, now)


def run(name: str, folder: Path, action: bool = False) -> tuple[RunOutcome, list[int]]:
    """A scenario with CR5s behind ROS 2; its outcome, and the commands that each arm got."""
    router = f"tcp/127.0.0.1:{free_port()}"
    plain = load_with(SCENARIOS / f"{name}.toml")
    sides: list[Side] = [side for side in SIDES if plain.end(side).driver != "fixed"]
    changes = []
    for side in sides:
        # Joints of several arms in one graph have prefixes.
        urdf = folder / f"{side}.urdf"
        urdf.write_text(CR5_URDF.read_text().replace('"joint_', f'"{side}_joint_'))
        changes += [
            f"ends.{side}.driver=ros2",
            f"ends.{side}.address={router}/{side}_controller",
            f"ends.{side}.urdf={urdf}",
            f"ends.{side}.flange={CR5_FLANGE}",
            f"ends.{side}.arm_automatically=false",
        ]
    scenario = load_with(SCENARIOS / f"{name}.toml", changes)
    with ExitStack() as stack:
        router_node = Node("router", router=router)
        stack.callback(router_node.close)
        arms = ArmsOverRos(scenario, router, action)
        stack.callback(arms.close)
        camera = CameraNode(scenario, router)
        stack.callback(camera.close)
        members: list[Any] = [camera, arms]
        if scenario.sensing.source == "camera":
            over = CameraOverRos(scenario, camera, router)
            stack.callback(over.close)
            members.append(over)
        members += [
            services.build(each, scenario, session_id(each), START)
            for each in ("perception", "planner", "controller")
        ]
        outcome = closed_loop.run(scenario, stop_after=0.5, members=tuple(members))
        return outcome, arms.points

"""The stand-in for the lab: moves the true rope with the arms and takes pictures of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from services.sim.camera.marker_plates import Plate
from services.sim.camera.rgbd_camera import DARK, RgbdCamera, SensorNoise
from services.sim.marked_obstacles import StandingObstacles
from services.sim.plants.plant import EndMotion
from services.sim.world import World
from shared import topics
from shared.messages import ArmStates, NodeChain, poses_known, scene_obstacles, timestamp
from shared.scenario import Scenario
from shared.service import SECOND, Inbox, Publication

COLOR = topics.CAMERA_COLOR.at(topics.CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(topics.CAMERA)
CALIBRATION = topics.CAMERA_CALIBRATION.at(topics.CAMERA)

SILENCE = SECOND // 10
"""Without arm states for this long the grips are taken to stand still [ns]."""
JPEG_QUALITY = 95


class SimService:
    """The rope, its surroundings and a camera."""

    name = "sim"
    reads = (topics.ARM_STATE, topics.SCENE_STATE, topics.SCENE_REQUEST, topics.TASK_STATE)
    writes = (topics.ROPE_TRUTH, COLOR, DEPTH, CALIBRATION)
    rate = 60.0

    def __init__(self, scenario: Scenario) -> None:
        sensing = scenario.sensing
        self.latency = sensing.latency
        self._scenario = scenario
        self._period = round(SECOND / sensing.rate)
        self._world = World(scenario)
        self._standing = StandingObstacles(scenario)
        self._world.set_obstacles(self._standing.among(scenario.bodies))
        self._radius = scenario.plant_rope.diameter / 2.0
        self._takes_pictures = sensing.source == "camera" and not sensing.outside
        self._camera = RgbdCamera(
            scenario_camera(scenario),
            SensorNoise(
                depth_sigma=sensing.depth_noise,
                depth_bias=sensing.depth_bias,
                depth_quantum=sensing.depth_quantum,
                edge_dropout=sensing.edge_dropout,
                edge_mixing=sensing.edge_dropout,
            ),
            seed=scenario.seed,
            rope_color=scenario.plant.color,
        )
        self._due: int | None = None
        self._frame = 0
        self._calibrated = -SECOND
        self._scene_revision: tuple[int, int] | None = None
        self._reset_count: int | None = None

    def warm_up(self) -> None:
        """Takes a picture that nobody sees."""
        if self._takes_pictures:
            list(self._picture(0))

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Follows the arms; publishes truth and images at the camera's rate."""
        self._surround(inbox, now)
        arrived = [r.message for r in inbox.every(topics.ARM_STATE) if poses_known(r.message)]
        for states in arrived:
            self._follow(states)
        # One picture a step at most: a late process must not fall further behind with its pictures.
        if arrived or self._world.instant is None:
            yield from self._published(self._world.instant or now)
        elif now - self._world.instant > SILENCE:
            self._world.stand(now)
            yield from self._published(now)

    def _surround(self, inbox: Inbox, now: int) -> None:
        task = inbox.latest(topics.TASK_STATE)
        if task is not None:
            self._standing.follow(task.message, now)
        for request in inbox.every(topics.SCENE_REQUEST):
            self._standing.ask(request.message)
        scene = inbox.latest(topics.SCENE_STATE)
        if scene is None:
            return
        self._standing.answer(scene.message)
        revision = (scene.message.revision, self._standing.revision)
        if revision != self._scene_revision:
            self._scene_revision = revision
            self._world.set_obstacles(self._standing.among(scene_obstacles(scene.message)))

    def _follow(self, states: ArmStates) -> None:
        left, right = (_motion(states, arm) for arm in ("left", "right"))
        if self._reset_count is not None and states.reset_count != self._reset_count:
            self._world.reset()
        self._reset_count = states.reset_count
        self._world.advance(left, right, states.stamp)

    def _published(self, instant: int) -> Iterator[Publication]:
        if self._due is not None and instant < self._due:
            return
        # The grid stays where it is unless time has jumped past it.
        late = self._due is None or instant >= self._due + self._period
        self._due = (instant if late or self._due is None else self._due) + self._period
        nodes = self._world.nodes
        yield Publication(
            topics.ROPE_TRUTH,
            NodeChain(
                stamp=instant,
                positions=nodes.ravel(),
                sigma=np.zeros(len(nodes)),
                observed=[True] * len(nodes),
            ),
        )
        if self._takes_pictures:
            if instant - self._calibrated >= SECOND:
                self._calibrated = instant
                yield Publication(CALIBRATION, calibration(self._camera.camera, instant))
            self._frame += 1
            yield from self._picture(instant)

    def _picture(self, instant: int) -> Iterator[Publication]:
        world, limits = self._world, self._scenario.limits
        left, right = world.grips
        bodies = [
            *world.obstacles,
            gripper(left, -1.0, limits.gripper_radius, limits.gripper_height),
            gripper(right, 1.0, limits.gripper_radius, limits.gripper_height),
        ]
        table = self._scenario.plant.table_color
        colors = [table if o.shape == "half_space" else DARK for o in bodies]
        plates = self._standing.plates(world.obstacles)
        if (marker := self._scenario.sensing.flange_marker) is not None:
            grip = left if marker.side == "left" else right
            plates.append(Plate(marker.at(grip), marker.size, marker.marker))
        frame = self._camera.take(world.nodes, self._radius, bodies, colors, self._frame, plates)
        bgr = np.ascontiguousarray(frame.color[..., ::-1])
        jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
        stamp = timestamp(instant)
        yield Publication(
            COLOR,
            CompressedImage(
                timestamp=stamp, frame_id=topics.CAMERA, data=jpeg.tobytes(), format="jpeg"
            ),
        )
        # Uncompressed: a PNG of noise costs more than the rendering, and again on the other side.
        height, width = frame.depth.shape
        yield Publication(
            DEPTH,
            RawImage(
                timestamp=stamp,
                frame_id=topics.CAMERA,
                width=width,
                height=height,
                encoding="16UC1",
                step=2 * width,
                data=frame.depth.astype("<u2", copy=False).tobytes(),
            ),
        )


def build(scenario: Scenario, session: str) -> SimService:
    """The service of a scenario."""
    return SimService(scenario)


def scenario_camera(scenario: Scenario) -> Camera:
    """The camera where it truly is."""
    s, known = scenario.sensing, scenario.camera_pose
    intrinsics = Intrinsics.symmetric(*s.resolution, math.radians(s.field_of_view))
    turn = poses.exponential(np.radians(scenario.plant.camera_turn))
    place = known.position + np.array(scenario.plant.camera_shift)
    return Camera(intrinsics, Pose(place, poses.multiply(turn, known.orientation)))


def calibration(camera: Camera, instant: int) -> CameraCalibration:
    """The message of a pinhole without distortion."""
    i = camera.intrinsics
    return CameraCalibration(
        timestamp=timestamp(instant),
        frame_id=topics.CAMERA,
        width=i.width,
        height=i.height,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=[i.fx, 0.0, i.cx, 0.0, i.fy, i.cy, 0.0, 0.0, 1.0],
        R=np.eye(3).ravel(),
        P=[i.fx, 0.0, i.cx, 0.0, 0.0, i.fy, i.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def gripper(grip: Pose, side: float, radius: float, height: float) -> Obstacle:
    """The body that holds an end: a capsule from the grip away from the rope.

    Args:
        grip: Where it holds the rope.
        side: +1 at the right end, -1 at the left one: the way from the rope along the grip's z.
        radius: Of the capsule [m].
        height: From the grip to its far end [m].
    """
    span = max(height - radius, 0.0)
    away = poses.rotate(grip.orientation, np.array([0.0, 0.0, side]))
    body = Obstacle("capsule", (0.0, 0.0, 0.0), radius=radius, height=span)
    return replace(
        body,
        position=tuple(grip.position + 0.5 * span * away),
        orientation=tuple(grip.orientation),
    )


def _motion(states: ArmStates, arm: str) -> EndMotion:
    for state in states.arms:
        if state.arm == arm:
            return EndMotion(
                Pose(np.array(state.position), np.array(state.orientation)),
                np.array(state.linear_velocity),
                np.array(state.angular_velocity),
            )
    raise KeyError(f"no arm {arm!r} in {[s.arm for s in states.arms]}")

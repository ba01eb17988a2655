"""Sees the rope in the camera's frames, and owns the scene."""

from __future__ import annotations

import logging
import math
from bisect import bisect_left
from collections import deque
from collections.abc import Iterator

import numpy as np
from jaxtyping import UInt8, UInt16

from lariat.geometry import polylines, poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.poses import Pose
from lariat.rod import RodProperties
from services.perception.centerline.estimate import CenterlineSettings, Estimate, RopeModel
from services.perception.centerline.estimator import DOUBTFUL, CenterlineEstimator
from services.perception.markers.marker_obstacles import MarkedObstacles
from services.perception.rgbd.camera_view import CameraView
from services.perception.scene import Refused, Surroundings
from services.perception.tracking.centerline_tracker import Tracker
from services.perception.tracking.paper_baseline import paper_estimate
from shared import topics
from shared.messages import (
    ArmStates,
    NodeChain,
    Scene,
    SceneRequest,
    TaskState,
    arm_pose,
    chain,
    obstacle_message,
    poses_known,
    scene_obstacles,
    stamp_of,
)
from shared.scenario import Scenario
from shared.service import SECOND, Inbox, Publication

log = logging.getLogger(__name__)

COLOR = topics.CAMERA_COLOR.at(topics.CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(topics.CAMERA)
CALIBRATION = topics.CAMERA_CALIBRATION.at(topics.CAMERA)

GRAVITY = 9.81
"""[m/s^2]."""
TRUTH_SIGMA = 1e-5
"""Of nodes that are copied from the truth [m]; never zero, since weights divide by it."""
PATIENCE = 3 * SECOND // 10
"""Without a frame for this long the camera is called silent [ns]."""
CALIBRATION_DUE = 2 * SECOND
"""So long after its first frame a camera must have told its calibration [ns]; it does so every
second."""
REMINDER = SECOND // 4
"""How often silence is repeated [ns]."""
FROZEN = 8
"""Identical frames in a row: no sensor is that quiet."""
CONTRADICTED = 8
"""Doubtful frames in a row after which the rope is not seen at all."""
ARM_HISTORY = 200
"""Arm states kept for interpolation to an image's stamp."""


class PerceptionService:
    """From images to `rope/nodes`; from requests to `scene/state`."""

    name = "perception"
    reads = (
        COLOR,
        DEPTH,
        CALIBRATION,
        topics.ARM_STATE,
        topics.ROPE_TRUTH,
        topics.SCENE_REQUEST,
        topics.TASK_STATE,
    )
    writes = (topics.ROPE_NODES, topics.SCENE_STATE)
    rate = 60.0
    latency = 0.010

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        believed = {k: v for k, v in vars(scenario.rope).items() if k != "node_count"}
        self._believed = RodProperties(**believed)
        self._rope = RopeModel(
            scenario.rope.length,
            scenario.rope.diameter / 2.0,
            scenario.rope.node_count,
            GRAVITY * scenario.rope.linear_density / self._believed.bending_stiffness,
        )
        marked = scenario.marked
        # What happens to a marked obstacle is seen, not told.
        told = [e for e in scenario.events if e.move_obstacle not in marked]
        self._surroundings = Surroundings(scenario.bodies, told, self._rope.radius)
        bodies = {o.name: o for o in scenario.bodies}
        self._marked = (
            MarkedObstacles(
                {o.marker: bodies[name] for name, o in marked.items()},
                {o.marker: o.marker_size for o in marked.values()},
                scenario.rope.diameter,
            )
            if marked or scenario.sensing.flange_marker is not None
            else None
        )
        self._view = CameraView(topics.CAMERA, self._tracker)
        self._arms: deque[tuple[int, Pose, Pose]] = deque(maxlen=ARM_HISTORY)
        self._nodes: np.ndarray | None = None
        self._random = np.random.default_rng(scenario.seed)
        self._reset_count = 0
        self._request = ("", "")
        self._published = -SECOND
        self._published_revision = 0
        self._first_frame: int | None = None
        self._last_frame: int | None = None
        self._reminded = 0
        self._doubtful = 0
        self.note = ""

    def warm_up(self) -> None:
        """Compiles the fit on a stripe, and the rod that is asked in doubt."""
        if self._scenario.sensing.source == "camera":
            s = self._scenario.sensing
            i = Intrinsics.symmetric(*s.resolution, math.radians(s.field_of_view))
            tracker = self._tracker(i)
            image = np.zeros((i.height, i.width, 3), np.uint8)
            depth = np.full((i.height, i.width), 900, np.uint16)
            middle = i.height // 2
            stripe = s.rope_color or (255, 255, 255)
            image[middle - 4 : middle + 4, i.width // 4 : -i.width // 4] = stripe
            grips = self._scenario.grips(self._scenario.start)
            tracker.estimator.estimate(image, depth, *grips)
            tracker.at_rest(*grips)

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Looks at the newest frame and answers every request."""
        for received in inbox.every(topics.ARM_STATE):
            if poses_known(received.message):
                self._remember(received.message)
        task = inbox.latest(topics.TASK_STATE)
        if task is not None:
            self._follow(task.message, now)
        if self._scenario.sensing.source == "truth":
            truth = inbox.fresh(topics.ROPE_TRUTH)
            if truth is not None:
                yield Publication(topics.ROPE_NODES, self._copied(truth.message))
        else:
            yield from self._seen(inbox, now)
        for received in inbox.every(topics.SCENE_REQUEST):
            self._handle(received.message)
            yield self._scene(now)
        stale = now - self._published >= SECOND
        if stale or self._surroundings.revision != self._published_revision:
            yield self._scene(now)

    def _seen(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        frame = inbox.joined(COLOR, DEPTH)
        if frame is None:
            if self._last_frame is None:
                self._last_frame = now
            silence = now - self._last_frame
            if silence > PATIENCE and now - self._reminded >= REMINDER:
                self._reminded = now
                reason = f"no frame of camera {topics.CAMERA!r} for {silence / 1e9:.1f} s"
                yield self._lost(reason, now)
            return
        self._last_frame = now
        if self._first_frame is None:
            self._first_frame = now
        color, depth = frame[0].message, frame[1].message
        stamp = stamp_of(color)
        calibration = inbox.latest(CALIBRATION)
        if calibration is None and now - self._first_frame < CALIBRATION_DUE:
            return
        if self._view.repeated(color, depth):
            # No news is not a look at the rope, even before it is called frozen.
            if self._view.repeats >= FROZEN:
                count = self._view.repeats + 1
                yield self._lost(f"camera {topics.CAMERA!r} is frozen: {count} same frames", stamp)
            return
        images = self._view.images(color, depth, calibration.message if calibration else None)
        tracker = self._view.tracker
        if isinstance(images, str) or tracker is None:
            yield self._lost(str(images), stamp)
            return
        if self._marked is not None:
            images = (self._followed(*images, stamp, tracker.estimator.camera), images[1])
        left, right = self._grips(stamp)
        if self._scenario.sensing.method == "paper":
            estimate = self._as_in_the_paper(images, tracker.estimator.camera, left)
        else:
            estimate = tracker.follow(*images, left, right, stamp)
        yield self._chain(estimate, stamp)

    def _followed(
        self,
        color: UInt8[np.ndarray, "h w 3"],
        depth: UInt16[np.ndarray, "h w"],
        stamp: int,
        camera: Camera,
    ) -> UInt8[np.ndarray, "h w 3"]:
        """Moves marked obstacles to where they are seen; the image comes back without markers."""
        assert self._marked is not None
        dark, moves = self._marked.look(color, depth, stamp, camera, self._surroundings.obstacles)
        for move in moves:
            try:
                # What is seen is true, whether or not it lies on the rope.
                self._surroundings.move(move.name, move.position, move.orientation)
            except Refused as refusal:
                log.warning("marker of %s: %s", move.name, refusal)
        return dark

    def _as_in_the_paper(
        self,
        images: tuple[UInt8[np.ndarray, "h w 3"], UInt16[np.ndarray, "h w"]],
        camera: Camera,
        left: Pose | None,
    ) -> Estimate:
        start = left or self._scenario.grips(self._scenario.start)[0]
        threshold = self._scenario.sensing.threshold
        return paper_estimate(*images, camera, start.position, self._rope, threshold)

    def _tracker(self, intrinsics: Intrinsics) -> Tracker:
        return Tracker(self._estimator(intrinsics), self._believed, self._scenario.bodies)

    def _estimator(self, intrinsics: Intrinsics) -> CenterlineEstimator:
        s = self._scenario.sensing
        return CenterlineEstimator(
            Camera(intrinsics, self._scenario.camera_pose),
            self._rope,
            CenterlineSettings(
                threshold=s.threshold,
                rope_color=s.rope_color,
                depth_sigma=s.depth_noise,
                depth_quantum=s.depth_quantum,
            ),
        )

    def _chain(self, estimate: Estimate, stamp: int) -> Publication:
        if estimate.lost:
            return self._lost(estimate.lost, stamp)
        self._doubtful = self._doubtful + 1 if estimate.doubt > DOUBTFUL else 0
        if self._doubtful >= CONTRADICTED:
            return self._lost(
                "what the camera sees contradicts the grips and the rope's length; if nothing "
                "hides the rope, calibrate the camera (lariat calibrate)",
                stamp,
            )
        self._say("")
        self._nodes = estimate.positions
        return Publication(
            topics.ROPE_NODES,
            NodeChain(
                stamp=stamp,
                positions=estimate.positions.ravel(),
                sigma=estimate.sigma,
                observed=estimate.observed.tolist(),
            ),
        )

    def _lost(self, reason: str, stamp: int) -> Publication:
        self._say(reason)
        return Publication(topics.ROPE_NODES, NodeChain(stamp=stamp, lost=reason))

    def _say(self, reason: str) -> None:
        if bool(reason) != bool(self.note):
            if reason:
                log.warning("rope lost: %s", reason)
            else:
                log.info("rope in sight again")
        self.note = reason

    def _copied(self, truth: NodeChain) -> NodeChain:
        nodes = chain(truth.positions)
        if len(nodes) != self._rope.node_count:
            nodes = polylines.resampled(nodes, self._rope.node_count)
        noise = self._scenario.sensing.node_noise
        if noise:
            nodes = nodes + noise * self._random.normal(size=nodes.shape)
        self._nodes = nodes
        return NodeChain(
            stamp=truth.stamp,
            positions=nodes.ravel(),
            sigma=np.full(len(nodes), max(noise, TRUTH_SIGMA)),
            observed=[True] * len(nodes),
        )

    def _remember(self, states: ArmStates) -> None:
        if not self._arms or states.stamp > self._arms[-1][0]:
            self._arms.append((states.stamp, arm_pose(states, "left"), arm_pose(states, "right")))
        elif states.stamp < self._arms[-1][0] - SECOND:
            # Another gateway with another clock.
            self._arms.clear()

    def _grips(self, stamp: int) -> tuple[Pose | None, Pose | None]:
        """Where the grips were when an image was taken."""
        if not self._arms:
            return None, None
        index = bisect_left(self._arms, stamp, key=lambda row: row[0])
        if index == 0 or index == len(self._arms):
            _, left, right = self._arms[min(index, len(self._arms) - 1)]
            return left, right
        (t0, *before), (t1, *after) = self._arms[index - 1], self._arms[index]
        part = (stamp - t0) / (t1 - t0)
        left, right = (
            Pose(
                (1.0 - part) * a.position + part * b.position,
                poses.slerp(a.orientation, b.orientation, part),
            )
            for a, b in zip(before, after, strict=True)
        )
        return left, right

    def _follow(self, task: TaskState, now: int) -> None:
        if task.reset_count != self._reset_count:
            self._reset_count = task.reset_count
            self._surroundings.reset()
            if self._view.tracker is not None:
                self._view.tracker.forget()
            self._nodes = None
        for refusal in self._surroundings.follow_run(task.run_started, now):
            log.warning(refusal)

    def _handle(self, request: SceneRequest) -> None:
        refusal = ""
        try:
            match request.action:
                case SceneRequest.ADD:
                    (obstacle,) = scene_obstacles(Scene(obstacles=[request.obstacle]))
                    self._surroundings.add(obstacle, self._nodes)
                case SceneRequest.MOVE:
                    o = request.obstacle
                    if len(o.position) != 3 or len(o.orientation) not in (0, 4):
                        raise Refused(
                            f"moving {o.name!r} takes a position of 3 numbers and an orientation "
                            f"of 4 or none, got {list(o.position)} and {list(o.orientation)}"
                        )
                    self._surroundings.move(o.name, o.position, o.orientation, self._nodes)
                case SceneRequest.REMOVE:
                    self._surroundings.remove(request.obstacle.name)
                case unknown:
                    raise Refused(f"there is no action {unknown}; use ADD, MOVE or REMOVE")
        except ValueError as error:
            refusal = str(error)
            log.warning("scene request %s refused: %s", request.id, refusal)
        self._request = (request.id, refusal)

    def _scene(self, now: int) -> Publication:
        self._published = now
        self._published_revision = self._surroundings.revision
        return Publication(
            topics.SCENE_STATE,
            Scene(
                stamp=now,
                revision=self._surroundings.revision,
                obstacles=[obstacle_message(o) for o in self._surroundings.obstacles],
                last_request=self._request[0],
                refusal=self._request[1],
            ),
        )


def build(scenario: Scenario, session: str) -> PerceptionService:
    """The service of a scenario."""
    return PerceptionService(scenario)

"""Perception service: camera frames to ropes, scene requests to `scene/state`."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from functools import partial, reduce
from operator import or_

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import (
    MAX_INCONSISTENCY,
    CenterlineEstimate,
)
from lariat.perception.clock_check import ClockCheck
from lariat.perception.fusion import fuse
from lariat.perception.other_ropes.other_ropes import SeenLine
from lariat.perception.other_ropes.search import SearchBeside
from lariat.perception.rgbd.line_of_sight import Sight
from lariat.perception.scenario_trackers import (
    camera_tracker,
    marker_obstacles,
    needs_brightness_alone,
    rope_dimensions,
)
from lariat.perception.scene import SceneChangeRefused, SceneOwner
from lariat.perception.tracking.grip_history import GripHistory
from lariat.reset_counter import ResetCounter
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from services.perception.other_ropes_publisher import OthersPublisher
from services.perception.rope_camera import RopeCamera
from services.perception.scene_motion import SceneMotionPublisher
from services.perception.scene_requests import SceneRequests
from services.perception.simulated_truth import SimulatedTruth
from services.perception.simultaneous_frames import SimultaneousFrames
from shared import topics
from shared.door import Door
from shared.messages import NodeChain, TaskState, arm_pose, chain, poses_known
from shared.runtime.service import Inbox, Publication
from shared.topics import Topic

log = logging.getLogger(__name__)

OTHER_READS = (topics.ARM_STATE, topics.ROPE_TRUTH, topics.SCENE_REQUEST, topics.TASK_STATE)
"""Topics that it reads beside those of the cameras."""
MAX_INCONSISTENT_FRAMES = 8
"""Number of inconsistent frames in a row from which the rope is reported as lost."""
CONTRADICTED = (
    "the image contradicts the grips and the rope's length; if nothing hides the rope, it has left "
    "a grip, or the camera needs a calibration (lariat calibrate)"
)
"""Reason why a doubtful rope is lost."""
BESIDE_ANOTHER = (
    "the image contradicts the grips and the rope's length: the rope is not told from another one "
    "that lies on it or along it; move the other one away, or see whether the rope has left a grip"
)
"""The same beside other ropes, for one of which a rope that has left a grip is taken."""


class PerceptionService:
    """Publishes the rope's nodes for every frame, and the scene on every change."""

    name = "perception"
    reads: Sequence[Topic] = (
        topics.CAMERA_COLOR,
        topics.CAMERA_DEPTH,
        topics.CAMERA_CALIBRATION,
        *OTHER_READS,
    )
    writes = (topics.ROPE_NODES, topics.ROPE_OTHERS, topics.SCENE_STATE, topics.SCENE_MOTION)
    rate = 60.0
    latency = 0.010

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._rope = rope_dimensions(scenario)
        # Events do not move obstacles with a marker: their poses are measured.
        events = [e for e in scenario.events if e.move_obstacle not in scenario.marked_obstacles]
        moving = frozenset(motion.name for motion in scenario.obstacle_motions())
        self._scene = SceneOwner(scenario.bodies, events, self._rope.radius, moving)
        self._motion = SceneMotionPublisher(scenario)
        self.door = Door()
        self._requests = SceneRequests(self._scene, self.door)
        self._cameras = [
            RopeCamera(
                setup.name,
                partial(camera_tracker, scenario, setup),
                marker_obstacles(scenario),
                grey=needs_brightness_alone(scenario),
            )
            for setup in scenario.camera_setups
        ]
        self._frames = SimultaneousFrames(self._cameras)
        self.reads = (*(t for c in self._cameras for t in c.reads), *OTHER_READS)
        self.wakes = tuple(c.wakes for c in self._cameras)
        self._grips = GripHistory()
        self._clock_check = ClockCheck()
        self._truth = SimulatedTruth(
            self._rope.node_count, scenario.sensing.node_noise, scenario.seed
        )
        self._nodes: np.ndarray | None = None
        self._others = OthersPublisher()
        self._search = SearchBeside(
            scenario.limits, scenario.rope.diameter, scenario.sensing.depth_noise
        )
        # A search is made one step after its images, mostly one without images of its own.
        self._next_search: tuple[Callable[[], Sequence[SeenLine]], int] | None = None
        self._resets, self._restores = ResetCounter(), ResetCounter()
        self._published = -SECOND
        self._published_revision = 0
        self._inconsistent_frames = 0
        self._is_lost = False
        self.note = ""

    def warm_up(self) -> None:
        """Compile what the tracker needs."""
        if self._scenario.sensing.source == "camera":
            for setup in self._scenario.camera_setups:
                tracker = camera_tracker(self._scenario, setup)
                tracker.warm_up(*self._scenario.grips(self._scenario.start))
            self._search.warm_up()

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Process the newest frame and every request."""
        for received in inbox.every(topics.ARM_STATE):
            arms = received.message
            with self.door.guard(topics.ARM_STATE.key):
                if poses_known(arms):
                    self._grips.add(arms.stamp, arm_pose(arms, "left"), arm_pose(arms, "right"))
                self._clock_check.take(arms.stamp, received.received)
        task = inbox.latest(topics.TASK_STATE)
        if task is not None:
            with self.door.guard(topics.TASK_STATE.key):
                self._follow_task(task.message, now)
        if self._scenario.sensing.source == "truth":
            truth = inbox.fresh(topics.ROPE_TRUTH)
            if truth is not None and truth.message.positions:
                with self.door.guard(topics.ROPE_TRUTH.key):
                    perceived = self._truth.perceive(truth.message)
                    self._nodes = chain(perceived.positions)
                    yield Publication(topics.ROPE_NODES, perceived)
        else:
            with self.door.guard("the images of the cameras") as outcome:
                yield from self._process_cameras(inbox, now)
            if outcome.refusal:
                for camera in self._cameras:
                    camera.forget()
        for received in inbox.every(topics.SCENE_REQUEST):
            self._requests.handle(received.message, self._nodes)
            yield self._scene_state(now)
        stale = now - self._published >= SECOND
        if stale or self._scene.revision != self._published_revision:
            yield self._scene_state(now)
        yield from self._motion.due(now)

    def _process_cameras(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        faults = [f for camera in self._cameras if (f := camera.receive(inbox, now)) is not None]
        search, self._next_search = self._next_search, None
        due, stamp = self._frames.due(now)
        if due and (fault := self._clock_check.fault(stamp, now)):
            yield self._lost(fault, stamp)
        elif due:
            grips = self._grips.at(stamp)
            estimate = self._perceived(due, stamp, *grips)
            yield self._rope_nodes(estimate, stamp)
            if self._search.due(stamp):
                views = [camera.processed for camera in due]
                obstacles = self._motion.at(self._scene.obstacles, stamp)
                lines = partial(self._search.lines, estimate, views, obstacles, grips)
                self._next_search = lines, stamp
        elif faults and all(camera.fault for camera in self._cameras):
            yield self._lost("; ".join(c.fault for c in self._cameras), faults[0].stamp)
        if search is not None:
            lines, stamp = search
            yield from self._others.publications(lines(), self._look, stamp, now)

    def _perceived(
        self, due: Sequence[RopeCamera], stamp: int, left: Pose | None, right: Pose | None
    ) -> CenterlineEstimate:
        """Rope in the newest images of some cameras, taken at `stamp` [ns] between two grips."""
        for camera in due:
            self._follow_markers(camera)
        estimate = fuse([camera.track(left, right) for camera in due])
        if len(self._cameras) > 1 and not estimate.lost:
            for camera in self._cameras:
                camera.adopt(estimate, left, right, stamp)
        return estimate

    def _look(self, points: Float64[np.ndarray, "k 3"]) -> Sight:
        """What all cameras see at points of a rope's axis."""
        return reduce(or_, (c.look(points, self._rope.radius) for c in self._cameras))

    def _follow_markers(self, camera: RopeCamera) -> None:
        """Move obstacles to where a camera sees their markers.

        Of several cameras that see one marker, the first in the file counts: calibrations differ,
        and the obstacle must not go back and forth between them.
        """
        first = self._cameras[: self._cameras.index(camera)]
        for move in camera.follow_markers(self._scene.obstacles):
            if any(move.name in other.marked_in_view for other in first):
                continue
            try:
                # An observed pose is accepted whether or not it overlaps the rope.
                self._scene.move(move.name, move.position, move.orientation)
            except SceneChangeRefused as refusal:
                log.warning("marker of %s: %s", move.name, refusal)

    def _rope_nodes(self, estimate: CenterlineEstimate, stamp: int) -> Publication:
        if estimate.lost:
            return self._lost(estimate.lost, stamp)
        self._inconsistent_frames = (
            self._inconsistent_frames + 1 if estimate.inconsistency > MAX_INCONSISTENCY else 0
        )
        if self._inconsistent_frames >= MAX_INCONSISTENT_FRAMES:
            reason = BESIDE_ANOTHER if estimate.others else CONTRADICTED
            return self._lost(reason, stamp, estimate.p_wrong)
        self._set_note("")
        self._nodes = estimate.positions
        return Publication(
            topics.ROPE_NODES,
            NodeChain(
                stamp=stamp,
                positions=estimate.positions.ravel(),
                sigma=estimate.sigma,
                observed=estimate.observed.tolist(),
                p_wrong=estimate.p_wrong,
            ),
        )

    def _lost(self, reason: str, stamp: int, p_wrong: float = 0.0) -> Publication:
        self._set_note(reason)
        return Publication(topics.ROPE_NODES, NodeChain(stamp=stamp, lost=reason, p_wrong=p_wrong))

    def _set_note(self, lost: str) -> None:
        if bool(lost) != self._is_lost:
            if lost:
                log.warning("rope lost: %s", lost)
            else:
                log.info("rope found again")
        self._is_lost = bool(lost)
        faults = "; ".join(camera.fault for camera in self._cameras if camera.fault)
        if faults and not lost and not self.note:
            log.warning("the rope is seen without one camera: %s", faults)
        self.note = lost or faults

    def _follow_task(self, task: TaskState, now: int) -> None:
        if self._restores.advanced(task.restore_count):
            self._scene.restore()
        if self._resets.advanced(task.reset_count):
            self._scene.reset()
            self._motion.reset(task)
            for camera in self._cameras:
                camera.forget()
            self._nodes = None
            self._others.forget()
            self._next_search = None
        self._motion.take_task(task)
        for refusal in self._scene.follow_run(task.run_started, now):
            log.warning(refusal)

    def _scene_state(self, now: int) -> Publication:
        self._published = now
        self._published_revision = self._scene.revision
        return Publication(topics.SCENE_STATE, self._requests.state(now))


def build(scenario: Scenario, session: str) -> PerceptionService:
    """Create the perception service of a scenario."""
    return PerceptionService(scenario)

"""Sim service: moves the true rope with the arms and takes images of it."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence

import numpy as np

from lariat.geometry.grippers import gripper_capsules
from lariat.geometry.obstacle_motion import ObstacleMotion, obstacles_at
from lariat.geometry.poses import Pose
from lariat.reset_counter import ResetCounter
from lariat.scenario import Scenario
from lariat.simulation.camera.marker_plates import MarkerPlate
from lariat.simulation.distractors import MovingTubes
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.world import World
from lariat.trajectory import NANOSECONDS, SECOND
from services.sim.lab_camera import LabCamera
from services.sim.marked_obstacles import MarkedObstacles
from services.sim.options import SimOptions
from shared import topics
from shared.door import Door
from shared.messages import (
    RUNNING,
    ArmStates,
    NodeChain,
    TaskState,
    arm_state,
    obstacle_motions,
    poses_known,
    scene_obstacles,
)
from shared.runtime.service import Inbox, Publication
from shared.topics import Topic

log = logging.getLogger(__name__)

BODY_COLOR = (98, 102, 110)
"""Colour of obstacles and grippers in the lab's light; below the brightness of a white rope."""
ARM_STATE_TIMEOUT = SECOND // 10
"""Time without arm states after which the grips are taken to stand still [ns]."""


class SimService:
    """True rope, its surroundings, and its cameras."""

    name = "sim"
    reads = (
        topics.ARM_STATE,
        topics.SCENE_STATE,
        topics.SCENE_MOTION,
        topics.SCENE_REQUEST,
        topics.TASK_STATE,
    )
    writes: Sequence[Topic] = (
        topics.ROPE_TRUTH,
        topics.CAMERA_COLOR,
        topics.CAMERA_DEPTH,
        topics.CAMERA_CALIBRATION,
    )
    # The rope moves in small steps, and an image is taken as soon as its instant is reached.
    wakes = (topics.ARM_STATE,)
    rate = 60.0

    def __init__(self, scenario: Scenario) -> None:
        sensing = scenario.sensing
        self.latency = sensing.latency
        self.door = Door()
        self._scenario = scenario
        self._period = round(SECOND / sensing.rate)
        self._world = World(scenario)
        self._marked = MarkedObstacles(scenario)
        self._standing = self._marked.merged(scenario.bodies)
        """Obstacles, moving ones where they stand before a run."""
        self._motions: tuple[ObstacleMotion, ...] = ()
        self._world.set_obstacles(self._standing)
        self._tubes = MovingTubes(scenario.distractors)
        self._run_started = 0
        takes_images = sensing.source == "camera" and not sensing.outside
        self._cameras = [
            LabCamera(scenario, setup, number)
            for number, setup in enumerate(scenario.camera_setups if takes_images else ())
        ]
        self.writes = (topics.ROPE_TRUTH, *(t for c in self._cameras for t in c.writes))
        self._due: int | None = None
        self._frame = 0
        self._scene_revision: tuple[int, int] | None = None
        self._resets = ResetCounter()
        self._slipped_run = 0
        """Start of the run in which the rope has slipped out of a grip [ns]."""

    def warm_up(self) -> None:
        """Compile the cameras' kernels by images that are not published."""
        list(self._take_images(0))

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Follow the arms; publish truth and images at the cameras' rate."""
        with self.door.guard("the scene"):
            self._update_obstacles(inbox, now)
        arrived = [r.message for r in inbox.every(topics.ARM_STATE) if poses_known(r.message)]
        for states in arrived:
            with self.door.guard(topics.ARM_STATE.key):
                self._follow(states)
        # At most one image in a step: a late process must not fall further behind.
        if arrived or self._world.instant is None:
            yield from self._observe(self._world.instant or now)
        elif now - self._world.instant > ARM_STATE_TIMEOUT:
            self._world.hold(now)
            yield from self._observe(now)

    def _update_obstacles(self, inbox: Inbox, now: int) -> None:
        task = inbox.latest(topics.TASK_STATE)
        if task is not None:
            self._run_started = task.message.run_started
            self._marked.update_task(task.message, now)
            self._release_if_due(task.message, now)
        for request in inbox.every(topics.SCENE_REQUEST):
            self._marked.take_request(request.message)
        if (motion := inbox.fresh(topics.SCENE_MOTION)) is not None:
            self._motions = obstacle_motions(motion.message)
            self._move_obstacles(self._world.instant or now)
        scene = inbox.latest(topics.SCENE_STATE)
        if scene is None:
            return
        self._marked.take_scene(scene.message)
        revision = (scene.message.revision, self._marked.revision)
        if revision != self._scene_revision:
            self._scene_revision = revision
            self._standing = self._marked.merged(scene_obstacles(scene.message))
            self._move_obstacles(self._world.instant or now)

    def _move_obstacles(self, instant: int) -> None:
        """Put moving obstacles where they are at an instant [ns]."""
        self._world.set_obstacles(
            obstacles_at(self._standing, self._motions, instant * NANOSECONDS)
        )

    def _release_if_due(self, task: TaskState, now: int) -> None:
        """Let the rope slip out of a grip at its time in a run."""
        slip, begun = self._scenario.plant.slip, task.run_started
        due = task.state == RUNNING and now - begun >= round(slip.time * SECOND)
        if slip.side and due and begun != self._slipped_run:
            self._slipped_run = begun
            self._world.release(slip.side)

    def _follow(self, states: ArmStates) -> None:
        left, right = (_motion(states, arm) for arm in ("left", "right"))
        if self._resets.advanced(states.reset_count):
            self._world.reset()
        if self._motions:
            self._move_obstacles(states.stamp)
        self._world.advance(left, right, states.stamp)

    def _observe(self, instant: int) -> Iterator[Publication]:
        """Publish truth and image of an instant [ns], if a frame of the camera is due."""
        if self._due is not None and instant < self._due:
            return
        # Frames stay on their grid unless time has jumped past it.
        late = self._due is None or instant >= self._due + self._period
        self._due = (instant if late or self._due is None else self._due) + self._period
        nodes = self._world.nodes
        limited = self._scenario.limits.tension is not None
        yield Publication(
            topics.ROPE_TRUTH,
            NodeChain(
                stamp=instant,
                positions=nodes.ravel().tolist(),
                sigma=[0.0] * len(nodes),
                observed=[True] * len(nodes),
                tension=self._world.tension if limited else 0.0,
            ),
        )
        for camera in self._cameras:
            yield from camera.publish_calibration(instant)
        self._frame += 1
        yield from self._take_images(instant)

    def _take_images(self, instant: int) -> Iterator[Publication]:
        if not self._cameras:
            return
        world, limits = self._world, self._scenario.limits
        left, right = world.grips
        bodies = [
            *world.obstacles,
            *gripper_capsules(left, right, limits.gripper_reach, limits.gripper_radius),
        ]
        table_color = self._scenario.plant.table_color
        colors = [table_color if o.shape == "half_space" else BODY_COLOR for o in bodies]
        plates = self._marked.plates(world.obstacles)
        if (marker := self._scenario.sensing.flange_marker) is not None:
            grip = left if marker.side == "left" else right
            plates.append(MarkerPlate(marker.at(grip), marker.size, marker.marker))
        run_time = (instant - self._run_started) / SECOND if self._run_started else 0.0
        tubes = self._tubes.at(run_time)
        for camera in self._cameras:
            yield from camera.publish_images(
                world.nodes, bodies, colors, plates, tubes, self._frame, instant
            )


def build(scenario: Scenario, session: str, options: SimOptions | None = None) -> SimService:
    """Build the service of a scenario; without options in simulated time."""
    if options:
        scenario = scenario.live if options.real_time else scenario
        plant = scenario.plant_rope
        log.info(
            "the simulated rope (%s) has %d nodes, the controller's %d",
            scenario.plant.model,
            plant.node_count,
            scenario.rope.node_count,
        )
    return SimService(scenario)


def _motion(states: ArmStates, arm: str) -> EndMotion:
    state = arm_state(states, arm)
    return EndMotion(
        Pose(np.array(state.position[:]), np.array(state.orientation[:])),
        np.array(state.linear_velocity[:]),
        np.array(state.angular_velocity[:]),
    )

"""Controller on the bus: inbox to `RopeController`, its outputs to publications."""

from __future__ import annotations

from collections.abc import Iterator

from lariat.control.mpc.receding_horizon import Command
from lariat.control.run.reasons import Reason
from lariat.rope_controller import RopeController
from lariat.scenario import Scenario
from lariat.trajectory import SetpointChunk
from services.controller.messages import (
    arm_condition,
    chunk_message,
    draft_request,
    grip_motion,
    hold_message,
    path_offer,
    plan_message,
    preview_message,
    rope_observation,
    task_request,
)
from services.controller.status import StatusPublisher
from shared import topics
from shared.door import Door
from shared.messages import obstacle_motions, poses_known, scene_obstacles
from shared.other_ropes import other_rope_obstacles
from shared.runtime.service import Inbox, Publication, Received


class ControllerService:
    """Step from inbox to publications."""

    name = "controller"
    reads = (
        topics.ROPE_NODES,
        topics.ARM_STATE,
        topics.ROPE_OTHERS,
        topics.SCENE_STATE,
        topics.SCENE_MOTION,
        topics.CONTROLLER_PATH,
        topics.TASK_REQUEST,
        topics.TASK_GOAL_DRAFT,
    )
    writes = (
        topics.ARM_SETPOINTS,
        topics.CONTROLLER_PLAN,
        topics.CONTROLLER_PARAMETERS,
        topics.TASK_STATE,
        topics.TASK_GOAL_PREVIEW,
        topics.RUN_RESULT,
    )
    wakes = (topics.ROPE_NODES,)
    rate = 50.0
    latency = 0.010

    def __init__(self, scenario: Scenario, session: str) -> None:
        self.controller = RopeController(scenario)
        self.door = Door()
        self._session, self._sequence = session, 0
        self._status = StatusPublisher(self.controller)
        self._path: Received | None = None
        """Message of the latest answer of the planner."""

    @property
    def note(self) -> str:
        """Condition that keeps the controller from working, for its health; empty otherwise."""
        return self.controller.note

    def warm_up(self) -> None:
        """Compile all kernels."""
        self.controller.warm_up()

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Take in what arrived, then control and report."""
        controller = self.controller
        self._take_arms(inbox)
        if (rope := inbox.fresh(topics.ROPE_NODES)) is not None:
            with self.door.guard(topics.ROPE_NODES.key):
                controller.take_rope(rope_observation(rope.message), now)
        for request in inbox.every(topics.TASK_REQUEST):
            with self.door.guard(topics.TASK_REQUEST.key):
                controller.carry_out(task_request(request.message), now)
        controller.begin_due_goals(now)
        self._take_scene(inbox, now)
        path = inbox.latest(topics.CONTROLLER_PATH)
        if path is not None and path is not self._path:
            self._path = path
            with self.door.guard(topics.CONTROLLER_PATH.key):
                controller.take_path(path_offer(path.message))
        draft = inbox.fresh(topics.TASK_GOAL_DRAFT)
        if draft is not None:
            with self.door.guard(topics.TASK_GOAL_DRAFT.key):
                preview = controller.preview(*draft_request(draft.message))
                message = preview_message(preview, draft.message.id, now)
                yield Publication(topics.TASK_GOAL_PREVIEW, message)
        for output in controller.step(now):
            yield self._publication(output, now)
        yield from self._status.due(now)

    def _take_arms(self, inbox: Inbox) -> None:
        arrived = inbox.every(topics.ARM_STATE)
        if arrived and poses_known(arrived[-1].message):
            with self.door.guard(topics.ARM_STATE.key):
                arms = arrived[-1].message
                self._status.slow_pauses = arms.slow_pauses
                condition = arm_condition(arms, self._session)
                self.controller.take_arms(grip_motion(arms), condition, arms.stamp)

    def _take_scene(self, inbox: Inbox, now: int) -> None:
        controller = self.controller
        scene = inbox.latest(topics.SCENE_STATE)
        if scene is not None and scene.message.revision != controller.scene.revision:
            with self.door.guard(topics.SCENE_STATE.key):
                controller.take_scene(scene_obstacles(scene.message), scene.message.revision)
        motion = inbox.fresh(topics.SCENE_MOTION)
        if motion is not None:
            with self.door.guard(topics.SCENE_MOTION.key):
                run = motion.message.run_started
                controller.take_motions(obstacle_motions(motion.message), run)
        controller.scene.advance(now)
        others = inbox.fresh(topics.ROPE_OTHERS)
        if others is not None:
            with self.door.guard(topics.ROPE_OTHERS.key):
                revision = others.message.revision
                controller.take_others(other_rope_obstacles(others.message), revision)

    def _publication(self, output: Command | SetpointChunk | Reason, now: int) -> Publication:
        """Message of a horizon, of setpoints, or of a reason to hold the arms."""
        if isinstance(output, Command):
            return Publication(topics.CONTROLLER_PLAN, plan_message(output))
        self._sequence += 1
        if isinstance(output, Reason):
            message = hold_message(output, now, self._session, self._sequence)
        else:
            stamp = self.controller.rope.image_stamp
            message = chunk_message(output, now, self._session, self._sequence, stamp)
        return Publication(topics.ARM_SETPOINTS, message)


def build(scenario: Scenario, session: str) -> ControllerService:
    """Create the controller of a scenario."""
    return ControllerService(scenario, session)

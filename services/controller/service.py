"""Controller on the bus: inbox to publications.

It owns the task (`run`), estimates the rope's state and material (`estimation`), turns observations
and planned paths into setpoints for the arms (`control_loop`, `mpc`), and supervises the run
(`supervision`).
"""

from __future__ import annotations

from collections.abc import Iterator

from lariat.configuration import ConfigurationError
from lariat.control.control_loop import ControlLoop
from lariat.control.estimation.rope_tracker import RopeTracker
from lariat.control.extensions.method_faults import MethodFaults
from lariat.control.mpc.collision_scene import CollisionScene
from lariat.control.mpc.receding_horizon import Command
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run.goal_events import GoalEvents
from lariat.control.run.goals import GoalFactory
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.run.requests import carry_out, preview
from lariat.control.run.state_machine import RunState
from lariat.control.run.task import RequestRefused, Task
from lariat.control.supervision.path_choice import PathOffer
from lariat.control.supervision.progress import ProgressMonitor
from lariat.control.supervision.replanning import Replanning
from lariat.control.supervision.rope_watch import RopeWatch
from lariat.controllers import (
    adaptation,
    check,
    expected_lag,
    prediction_rod,
    receding_horizon_controller,
    state_estimator,
)
from lariat.rod import Rod
from lariat.safety.motion_contract import SETPOINT_PERIOD
from lariat.scenario import SIDES, Scenario
from lariat.scenario.extensions import ExtensionFault
from lariat.scenario.rod_properties import rod_properties
from lariat.trajectory import MotionState, SetpointChunk
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
from shared.messages import (
    ArmStates,
    GoalDraft,
    TaskRequest,
    obstacle_motions,
    poses_known,
    scene_obstacles,
)
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
        """Create the controller of a scenario.

        Args:
            scenario: Rope, cell, goal and control settings.
            session: Id of this process start, which its setpoints carry.
        """
        self._scenario, self._session = scenario, session
        rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
        start = scenario.grips(scenario.start)
        self._goals = GoalFactory(scenario, rod, start)
        self.task = Task(
            self._goals.from_shape(scenario.goal),
            settings={"adapt": "true" if scenario.control.adapt else "false"},
            resettable=not any(scenario.end(side).address for side in SIDES),
        )
        self._model = prediction_rod(scenario, rod)
        estimator = state_estimator(scenario.control, self._model, MotionState.at_rest(*start), 0)
        self.rope = RopeTracker(estimator, adaptation(scenario, rod), round(scenario.start.turns))
        self.scene = CollisionScene(scenario)
        estimator.supports = self.scene.supports
        self.progress = ProgressMonitor(
            scenario.run.tolerance,
            scenario.rope.diameter / 2.0,
            angle_tolerance=scenario.run.angle_tolerance,
        )
        self._faults = MethodFaults(self.task)
        self._replanning = Replanning(self.task)
        self._watch = RopeWatch(self.task, self.rope, self.progress, self._replanning)
        self._loop = ControlLoop(
            scenario,
            self.task,
            self.rope,
            self.scene,
            self.progress,
            self._replanning,
            self._faults,
            receding_horizon_controller(
                scenario.control,
                scenario.limits,
                scenario.moves,
                estimator,
                expected_lag(scenario),
            ),
        )
        self._status = StatusPublisher(self.task, self.progress, estimator, self.rope.adaptation)
        self._goal_events = GoalEvents(scenario.events, scenario.next_goals)
        self._arms: ArmStates | None = None
        """Newest state of arms between which the rope can hang."""
        self._path: Received | None = None
        """Message of the latest answer of the planner."""
        self._offer: PathOffer | None = None
        """Latest answer of the planner."""
        self._sequence = 0

    @property
    def note(self) -> str:
        """Condition that keeps the controller from working, for its health; empty otherwise."""
        return self._faults.last if self._obstruction is None else str(self._obstruction)

    @property
    def _obstruction(self) -> Reason | None:
        """Reason why no run can begin, whatever is requested."""
        problem = self.rope.problem
        return Reason(ReasonCode.WAITING_FOR_GRIPS, {"problem": problem}) if problem else None

    def warm_up(self) -> None:
        """Compile all kernels by controlling a rope at its goal.

        Raises:
            ConfigurationError: A controller or estimator from outside fails at once, or a part of
                the rope does not take the shape of a later goal.
        """
        try:
            self._goals.prepare()
            self._control_at_rest()
        except (ExtensionFault, RequestRefused) as fault:
            raise ConfigurationError(str(fault)) from fault

    def _control_at_rest(self) -> None:
        start = MotionState.at_rest(*self._goals.start)
        estimator = state_estimator(self._scenario.control, self._model, start, 0)
        controller = receding_horizon_controller(
            self._scenario.control, self._scenario.limits, self._scenario.moves, estimator
        )
        nodes, dt = estimator.nodes, SETPOINT_PERIOD
        controller.follow(ReferenceTrajectory.standing(estimator.motion, nodes, dt * 1e-9), dt)
        for k in (1, 2, 3):
            estimator.advance(estimator.motion, k * dt)
            controller.step(k * dt, nodes, self.scene.avoidance(self.task, 0.0))

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Take in what arrived, then control and report."""
        with self._faults.blaming():
            self._take_arms(inbox)
        with self._faults.blaming():
            self._take_rope(inbox, now)
        for request in inbox.every(topics.TASK_REQUEST):
            self._carry_out(request.message, now)
        self._goal_events.apply_due(now, self.task, self._goals.from_shape)
        self._take_scene(inbox)
        self._take_motions(inbox, now)
        self._take_others(inbox)
        path = inbox.latest(topics.CONTROLLER_PATH)
        if path is not None and path is not self._path:
            self._path, self._offer = path, path_offer(path.message)
        draft = inbox.fresh(topics.TASK_GOAL_DRAFT)
        if draft is not None:
            yield self._preview(draft.message, now)
        if self._arms is not None:
            yield from self._control(now, self._arms)
        yield from self._status.due(now, arms_known=self._arms is not None)

    def _take_arms(self, inbox: Inbox) -> None:
        arrived = inbox.every(topics.ARM_STATE)
        if not arrived or not poses_known(arrived[-1].message):
            return
        arms: ArmStates = arrived[-1].message
        self._arms = arms
        self.task.take_reset_count(arms.reset_count)
        motion = grip_motion(arms)
        if not self.rope.advance(motion, arms.stamp, arms.reset_count):
            self._loop.disengage()
            if not self.rope.begin(motion, arms.stamp):
                self._arms = None

    def _take_rope(self, inbox: Inbox, now: int) -> None:
        item = inbox.fresh(topics.ROPE_NODES)
        if item is None or self._arms is None:
            return
        seen, following = rope_observation(item.message), self._loop.following
        rope = self.rope.observe(
            seen, now, adapts=self.task.adapts, resting=self._loop.resting, following=following
        )
        if rope is not None:
            self._watch.observe(seen, rope, self.scene.obstacles, following=following)

    def _carry_out(self, message: TaskRequest, now: int) -> None:
        request, scene = task_request(message), self.scene.obstacles
        arms = None if self._arms is None else arm_condition(self._arms, self._session)
        if carry_out(request, self.task, self._goals, scene, arms, now, self._obstruction):
            self._goal_events.restart()
            if self._faults.last:
                self._faults.last = ""
                self.rope.forget()
            self._replanning.begin_run()
            self.progress.begin(now, self.task.replan_count)

    def _take_scene(self, inbox: Inbox) -> None:
        item = inbox.latest(topics.SCENE_STATE)
        if item is not None and item.message.revision != self.scene.revision:
            self.scene.update(scene_obstacles(item.message), item.message.revision)
            self.rope.estimator.supports = self.scene.supports
            self._loop.review_scene()

    def _take_motions(self, inbox: Inbox, now: int) -> None:
        item = inbox.fresh(topics.SCENE_MOTION)
        if item is not None and item.message.run_started != self.scene.run_started:
            motions = obstacle_motions(item.message)
            self.scene.update_motions(motions, item.message.run_started)
        self.scene.advance(now)

    def _take_others(self, inbox: Inbox) -> None:
        item = inbox.fresh(topics.ROPE_OTHERS)
        if item is None:
            return
        changed = item.message.revision != self.scene.others_revision
        self.scene.update_others(other_rope_obstacles(item.message), item.message.revision)
        if changed:
            self._loop.review_scene()

    def _preview(self, draft: GoalDraft, now: int) -> Publication:
        running = self.task.state is RunState.RUNNING
        found = preview(draft_request(draft), self._goals, self.scene.obstacles, running)
        return Publication(topics.TASK_GOAL_PREVIEW, preview_message(found, draft.id, now))

    def _control(self, now: int, arms: ArmStates) -> Iterator[Publication]:
        for output in self._loop.step(now, arm_condition(arms, self._session), self._offer):
            yield self._publication(output, now)
        if self._goal_events.apply_reached(self.task, self._goals.from_shape):
            self._replanning.begin_run()

    def _publication(self, output: Command | SetpointChunk | Reason, now: int) -> Publication:
        """Message of a horizon, of setpoints, or of a reason to hold the arms."""
        if isinstance(output, Command):
            return Publication(topics.CONTROLLER_PLAN, plan_message(output))
        self._sequence += 1
        if isinstance(output, Reason):
            message = hold_message(output, now, self._session, self._sequence)
        else:
            stamp = self.rope.image_stamp
            message = chunk_message(output, now, self._session, self._sequence, stamp)
        return Publication(topics.ARM_SETPOINTS, message)


def build(scenario: Scenario, session: str) -> ControllerService:
    """Create the controller of a scenario.

    Args:
        scenario: Rope, cell, goal and control settings.
        session: Id of this process start.

    Raises:
        ConfigurationError: Method, solver and adaptation do not fit together.
    """
    check(scenario)
    return ControllerService(scenario, session)

"""Controller on the bus: inbox to publications.

It owns the task (`run`), estimates the rope's state and material (`estimation`) and turns
observations and planned paths into setpoints for the arms (`mpc`).
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.rod import Rod
from lariat.trajectory import MotionState, SetpointChunk
from services.controller.estimation.adaptation import apply_material
from services.controller.estimation.observation_registration import (
    away_from_grips,
    registered_nodes,
)
from services.controller.estimation.prediction_monitor import PredictionMonitor
from services.controller.messages import (
    RopeObservation,
    arm_condition,
    chunk_message,
    draft_request,
    grip_motion,
    hold_message,
    path_offer,
    plan_message,
    preview_message,
    reference_trajectory,
    rope_observation,
    task_request,
)
from services.controller.model_factory import (
    adaptation,
    check,
    expected_lag,
    prediction_rod,
    receding_horizon_controller,
    state_estimator,
)
from services.controller.mpc.collision_scene import CollisionScene
from services.controller.mpc.receding_horizon import Command
from services.controller.mpc.reference_trajectory import ReferenceTrajectory
from services.controller.run.clearance_guard import ClearanceGuard
from services.controller.run.goal_events import GoalEvents
from services.controller.run.goals import GoalFactory
from services.controller.run.progress import ProgressMonitor
from services.controller.run.reasons import Reason, ReasonCode
from services.controller.run.requests import carry_out, preview
from services.controller.run.slip_detector import SlipDetector
from services.controller.run.snag_detector import SnagDetector
from services.controller.run.state_machine import RunState
from services.controller.run.supervisor import RunSupervisor
from services.controller.run.task import RequestRefused, Task
from services.controller.status import StatusPublisher
from shared import topics
from shared.configuration import ConfigurationError
from shared.extensions import ExtensionFault
from shared.messages import ArmStates, TaskRequest, obstacle_motions, poses_known, scene_obstacles
from shared.motion_contract import SETPOINT_PERIOD
from shared.other_ropes import other_rope_obstacles
from shared.reset_counter import ResetCounter
from shared.scenario import SIDES, Scenario
from shared.scenario.rod_properties import rod_properties
from shared.service import SECOND, Inbox, Publication

log = logging.getLogger(__name__)

MAX_GAP = 10 * SECOND
"""Time between two arm states above which the estimate begins anew [ns]."""
CLEARANCE_STRIDE = 5
"""Points of a path per shape whose clearance is checked when the scene changes."""


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
    rate = 50.0
    latency = 0.010

    def __init__(self, scenario: Scenario, session: str) -> None:
        """Create the controller of a scenario.

        Args:
            scenario: Rope, cell, goal and control settings.
            session: Id of this process start, which its setpoints carry.
        """
        self._node_count = scenario.rope.node_count
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
        self._moves = scenario.moves
        self.estimator = state_estimator(
            scenario.control, self._model, MotionState.at_rest(*start), 0
        )
        self.adaptation = adaptation(scenario, rod)
        self.controller = receding_horizon_controller(
            scenario.control,
            scenario.limits,
            self._moves,
            self.estimator,
            expected_lag(scenario),
        )
        self.predictions = PredictionMonitor()
        self.guard = ClearanceGuard(scenario.rope.diameter / 2.0, scenario.control.clearance)
        self.snag_detector = SnagDetector()
        self._slip_detector = SlipDetector()
        self.progress = ProgressMonitor(
            scenario.run.tolerance,
            scenario.rope.diameter / 2.0,
            angle_tolerance=scenario.run.angle_tolerance,
        )
        self.supervisor = RunSupervisor(self.task, self.progress, self.adaptation)
        self.scene = CollisionScene(scenario)
        self.estimator.supports = self.scene.supports
        self._status = StatusPublisher(self.task, self.progress, self.estimator, self.adaptation)
        self._goal_events = GoalEvents(scenario.events, scenario.next_goals)
        self._arms: ArmStates | None = None
        self._obstruction: Reason | None = None
        """Reason why no run can begin, whatever is requested."""
        self._fault = ""
        """Fault of a controller or estimator from outside, until the next run."""
        self._resets = ResetCounter()
        self._estimate_begun = False
        """Whether the state estimate began where the arms were; False where it must begin anew."""
        self._last_seen: int | None = None
        self._doubt = 0.0
        """Probability that the newest nodes are not those of the rope [-]."""
        self._observed: Float64[np.ndarray, "n 3"] = self.estimator.nodes
        """Nodes of the rope as observed last; estimated ones where it was not seen [m]."""
        self._start_clearance = np.inf
        """Clearance of the rope at the start of the present path [m]."""
        self._others_revision = 0
        self._image_stamp = 0
        self._sequence = 0

    @property
    def note(self) -> str:
        """Condition that keeps the controller from working, for its health; empty otherwise."""
        return self._fault if self._obstruction is None else str(self._obstruction)

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
            self._scenario.control, self._scenario.limits, self._moves, estimator
        )
        nodes, dt = estimator.nodes, SETPOINT_PERIOD
        controller.follow(ReferenceTrajectory.standing(estimator.motion, nodes, dt * 1e-9), dt)
        for k in (1, 2, 3):
            estimator.advance(estimator.motion, k * dt)
            controller.step(k * dt, nodes, self.scene.avoidance(self.task, 0.0))

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Take in what arrived, then control and report."""
        with self._blaming():
            self._take_arms(inbox)
        with self._blaming():
            self._take_rope(inbox, now)
        for request in inbox.every(topics.TASK_REQUEST):
            self._carry_out(request.message, now)
        self._goal_events.apply_due(now, self.task, self._goals.from_shape)
        self._take_scene(inbox)
        self._take_motions(inbox, now)
        self._take_others(inbox)
        draft = inbox.fresh(topics.TASK_GOAL_DRAFT)
        if draft is not None:
            wanted = draft_request(draft.message)
            running = self.task.state is RunState.RUNNING
            found = preview(wanted, self._goals, self.scene.obstacles, running)
            answer = preview_message(found, draft.message.id, now)
            yield Publication(topics.TASK_GOAL_PREVIEW, answer)
        if self._arms is not None:
            yield from self._control(inbox, now, self._arms)
        yield from self._status.due(now, arms_known=self._arms is not None)

    @contextmanager
    def _blaming(self) -> Iterator[None]:
        """Give up the run, and name the cause, when a class from outside fails in the block."""
        try:
            yield
        except ExtensionFault as fault:
            if str(fault) != self._fault:
                log.error("%s", fault)
            self._fault = str(fault)
            self.supervisor.method_failed(self._fault)

    def _take_arms(self, inbox: Inbox) -> None:
        arrived = inbox.every(topics.ARM_STATE)
        if not arrived or not poses_known(arrived[-1].message):
            return
        arms: ArmStates = arrived[-1].message
        self._arms = arms
        self.task.take_reset_count(arms.reset_count)
        motion = grip_motion(arms)
        if self._resets.advanced(arms.reset_count):
            self._estimate_begun = False
        if self._estimate_begun and abs(arms.stamp - self.estimator.time) < MAX_GAP:
            self.estimator.advance(motion, arms.stamp)
            return
        self.controller.disengage()
        self._last_seen = None
        turns = round(self._scenario.start.turns)
        self._estimate_begun = self._restart_estimate(motion, arms.stamp, turns=turns)
        if not self._estimate_begun:
            self._arms = None

    def _restart_estimate(
        self, motion: MotionState, stamp: int, nodes: np.ndarray | None = None, turns: int = 0
    ) -> bool:
        """Restart the state estimate; False where the rope does not reach from grip to grip.

        An arm may stand anywhere before it is armed.
        """
        try:
            self.estimator.restart(motion, stamp, nodes, turns)
        except ValueError as error:
            if self._obstruction is None:
                log.warning("waiting for the grips: %s", error)
            self._obstruction = Reason(ReasonCode.WAITING_FOR_GRIPS, {"problem": str(error)})
            return False
        self._obstruction = None
        return True

    def _take_rope(self, inbox: Inbox, now: int) -> None:
        item = inbox.fresh(topics.ROPE_NODES)
        if item is None or self._arms is None:
            return
        # A rope that perception has lost is not seen, however doubtful it was before.
        self._doubt = item.message.doubt if item.message.positions else 0.0
        if self._doubt > self.supervisor.settings.max_doubt:
            return
        if not item.message.positions or item.message.stamp < self.estimator.start_time:
            return
        if len(item.message.positions) != 3 * self._node_count:
            return  # A chain of another rope.
        estimator = self.estimator
        rope = seen = rope_observation(item.message)
        if self.task.adapts:
            rope = self._registered(seen)
        estimator.observe(rope.stamp, rope.nodes, rope.sigma, rope.observed)
        if estimator.diverged and self.controller.resting:
            self._restart_estimate(estimator.motion, estimator.time, rope.nodes, estimator.turns)
        estimate = estimator.model_nodes_at(rope.stamp) + estimator.offset
        self._observed = np.where(rope.observed[:, None], rope.nodes, estimate)
        self.predictions.observe(rope.stamp, rope.nodes, rope.sigma, rope.observed)
        if np.any(rope.observed):
            # Bridged nodes alone are no observation of the rope.
            self._last_seen, self._image_stamp = now, rope.stamp
        if self.task.adapts:
            change = self.adaptation.update(
                estimator, rope.stamp, rope.nodes, rope.sigma, rope.observed
            )
            if change is not None:
                moving = self.controller.reference is not None
                apply_material(estimator, self.adaptation, change, moving=moving)
        # The run is judged by the estimate, because noise would add to every distance.
        model = estimator.model_nodes_at(rope.stamp)
        goal = self.task.goal
        self.progress.observe(
            rope.stamp,
            model + estimator.offset,
            goal.nodes,
            self.scene.obstacles,
            goal.counted,
            # The model's ends lie in the grips: noise would turn observed tangents.
            goal.angle(model),
        )
        self._detect_slip(seen)
        self._detect_snag(rope)

    def _registered(self, rope: RopeObservation) -> RopeObservation:
        """Observation of a rope whose length and grips are being learnt."""
        model = self.estimator.model_nodes_at(rope.stamp)
        length = self.estimator.rod.properties.length
        nodes = registered_nodes(rope.nodes, model, length)
        return replace(rope, nodes=nodes, observed=away_from_grips(rope.observed, length))

    def _detect_slip(self, rope: RopeObservation) -> None:
        """Give up when the rope has slipped out of a grip."""
        if self.task.state is not RunState.RUNNING:
            self._slip_detector.reset()
            return
        grips = self.estimator.model_nodes_at(rope.stamp)[[0, -1]]
        slip = self._slip_detector.observe(rope.nodes, rope.observed, grips)
        if slip is None:
            return
        self._slip_detector.reset()
        self.supervisor.slipped(slip)
        log.warning("%s", self.task.reason)

    def _detect_snag(self, rope: RopeObservation) -> None:
        """Give up when the rope hangs on something, before the grips stretch it."""
        # A rope that has left a grip looks taut beside the model.
        following = self.controller.reference is not None and not self._slip_detector.suspects
        if self.task.state is not RunState.RUNNING or not following:
            self.snag_detector.reset()
            return
        model = self.estimator.model_nodes_at(rope.stamp)
        length = self.estimator.rod.properties.length
        snag = self.snag_detector.observe(
            rope.stamp,
            rope.nodes,
            model,
            rope.observed,
            length,
            leaning=self.estimator.leaning,
        )
        if snag is None:
            return
        self.snag_detector.reset()
        if self.estimator.switch_equilibrium(rope.nodes, rope.observed):
            log.info(
                "the rope rests in another equilibrium than the model; the model is restarted there"
            )
            return
        if self.supervisor.snagged(snag, self.predictions.max_deviation):
            log.warning("%s", self.task.reason)
        else:
            log.info("the rope stays behind the model; the arms stop, for another path from there")

    def _carry_out(self, message: TaskRequest, now: int) -> None:
        request, scene = task_request(message), self.scene.obstacles
        arms = None if self._arms is None else arm_condition(self._arms, self._session)
        if carry_out(request, self.task, self._goals, scene, arms, now, self._obstruction):
            self._goal_events.restart()
            if self._fault:
                self._fault, self._estimate_begun = "", False
            self.supervisor.begin_run()
            self.progress.begin(now, self.task.replan_count)

    def _take_scene(self, inbox: Inbox) -> None:
        item = inbox.latest(topics.SCENE_STATE)
        if item is not None and item.message.revision != self.scene.revision:
            self.scene.update(scene_obstacles(item.message), item.message.revision)
            self.estimator.supports = self.scene.supports
            self._review_path()

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
        self.scene.update_others(other_rope_obstacles(item.message))
        if item.message.revision != self._others_revision:
            self._others_revision = item.message.revision
            self._review_path()

    def _review_path(self) -> None:
        """Request another path where the rest of the present one is not clear any more."""
        if self.controller.reference is not None and self.task.state is RunState.RUNNING:
            ahead = self.controller.remaining_nodes[::CLEARANCE_STRIDE]
            clearance = self.progress.clearance_along(ahead, self.scene.still)
            self.supervisor.path_obstructed(clearance)

    def _control(self, inbox: Inbox, now: int, arms: ArmStates) -> Iterator[Publication]:
        reason = self._hold_reason(now, arms)
        if reason is not None:
            self.controller.disengage()
            self.supervisor.released()
            yield self._hold(now, reason)
            return
        reason = self._waiting_reason(inbox, now)
        if reason is not None:
            chunk = None if self.controller.resting else self.controller.brake(now)
            if chunk is None:
                self.controller.disengage()
                yield self._hold(now, reason)
            else:
                yield self._setpoints(now, chunk)
            return
        goal = self.task.goal
        self.controller.oriented = goal.left_oriented, goal.right_oriented
        self.controller.counted = goal.counted if goal.ends_only else None
        avoidance = self.scene.avoidance(self.task, self.progress.error)
        reference = self.controller.reference
        assert reference is not None
        command = None
        with self._blaming():
            # Path and free rest of a part's goal are planned with what has been learnt since.
            wanted = goal.completed(reference.nodes[-1])
            command = self.controller.step(now, wanted, avoidance)
        if command is None:
            chunk = self.controller.brake(now)
            assert chunk is not None
            yield self._setpoints(now, chunk)
            return
        time_step = round(self.controller.optimizer.time_step * SECOND)
        yield Publication(topics.CONTROLLER_PLAN, plan_message(command, time_step))
        if self._must_stop(command):
            chunk = self.controller.brake(now)
            assert chunk is not None
            yield self._setpoints(now, chunk)
            return
        yield self._setpoints(now, command.chunk)
        self.predictions.take_plan(command.plan_start, time_step, command.plan.nodes)
        self.supervisor.judge(now, reference, at_end=self.controller.at_end)
        if self._goal_events.apply_reached(self.task, self._goals.from_shape):
            self.supervisor.begin_run()

    def _must_stop(self, command: Command) -> bool:
        """Whether to stop instead, for another path.

        The rope has turned out to be another one, moves otherwise than predicted, or is about to
        touch an obstacle.
        """
        if self.task.state is not RunState.RUNNING:
            return False
        deviation = self.predictions.deviation
        if not self.controller.at_end and (
            self.supervisor.outdated() or self.supervisor.unforeseen(deviation)
        ):
            return True
        threat = self.guard.check(
            self._observed,
            self.estimator.nodes,
            command.plan.nodes,
            deviation,
            self.scene.avoided,
            min(self._start_clearance, self.scene.goal_clearance(self.task)),
        )
        if threat is None:
            return False
        obstacle = [o for o in self.scene.avoided if o.name == threat.obstacle]
        ahead = self.controller.remaining_nodes[::CLEARANCE_STRIDE]
        clearance = self.progress.clearance_along(ahead, obstacle)
        log.info("%s", self.supervisor.threatened(threat, clearance))
        return True

    def _hold_reason(self, now: int, arms: ArmStates) -> Reason | None:
        """Reason to publish nothing but a hold; None when the arms can be controlled."""
        condition = arm_condition(arms, self._session)
        following = self.controller.reference is not None
        reason = self.supervisor.hold_reason(
            now, condition, self._last_seen, following=following, doubt=self._doubt
        )
        if reason is not None:
            return reason
        tracking_error = self.controller.tracking_error()
        return self.supervisor.unfollowed_reason(
            condition,
            tracking_error,
            following=following,
            deviation=self.predictions.max_deviation,
        )

    def _waiting_reason(self, inbox: Inbox, now: int) -> Reason | None:
        """Reason why there is nothing to follow, after taking a new path; None when there is."""
        if self.supervisor.follows_latest and self.controller.reference is not None:
            return None
        if not self.controller.resting:
            return Reason(ReasonCode.COMING_TO_REST)
        if not self._scenario.control.planner:
            here, nodes = self.estimator.motion, self.estimator.nodes
            standing = ReferenceTrajectory.standing(here, nodes, SETPOINT_PERIOD * 1e-9)
            self.controller.follow(standing, now)
            self.supervisor.follow(None)
            self._begin_path()
            return None
        item = inbox.latest(topics.CONTROLLER_PATH)
        if item is not None and item.message.node_count not in (0, self._node_count):
            item = None  # A path of another rope.
        moves = bool(self._scenario.obstacle_motions())
        if moves and item is not None and item.message.motion_run_started != self.task.run_started:
            item = None  # A path that does not know where the obstacles move in this run.
        offer = None if item is None else path_offer(item.message)
        reason = self.supervisor.review(offer, now)
        if item is None or reason is not None:
            return reason
        reference = reference_trajectory(item.message)
        reason = self.supervisor.review_start(reference, self.estimator.motion)
        reason = reason or self.supervisor.review_departure(
            now, item.message.start_after, item.message.start_before
        )
        if reason is not None:
            return reason
        self.controller.follow(reference, now)
        self.supervisor.follow(offer)
        self._begin_path()
        if item.message.others_revision != self._others_revision:
            self._review_path()
        return None

    def _begin_path(self) -> None:
        """Forget the predictions before a path, and measure the clearance at its start."""
        self.predictions.begin_path()
        self._start_clearance = self.progress.clearance_of(self.estimator.nodes, self.scene.still)

    def _setpoints(self, now: int, chunk: SetpointChunk) -> Publication:
        self._sequence += 1
        message = chunk_message(chunk, now, self._session, self._sequence, self._image_stamp)
        return Publication(topics.ARM_SETPOINTS, message)

    def _hold(self, now: int, reason: Reason) -> Publication:
        self._sequence += 1
        message = hold_message(reason, now, self._session, self._sequence)
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

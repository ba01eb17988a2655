"""Owns the task, and turns what is seen and planned into setpoints for the arms."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import numpy as np

from lariat.rod import Rod
from lariat.trajectory import MotionState
from services.controller.estimation.state_estimator import StateEstimator
from services.controller.messages import (
    chunk_message,
    motion_of,
    plan_message,
    reference_trajectory,
)
from services.controller.model_factory import (
    adaptation,
    check,
    free_components,
    prediction_rod,
    receding_horizon_controller,
)
from services.controller.mpc.collision_scene import CollisionScene
from services.controller.mpc.receding_horizon import Command
from services.controller.mpc.reference_trajectory import ReferenceTrajectory
from services.controller.run.goals import GoalFactory
from services.controller.run.progress import ProgressMonitor
from services.controller.run.requests import carry_out, preview
from services.controller.run.snag_detector import SnagDetector
from services.controller.run.state_machine import Course
from services.controller.run.task import Task
from services.controller.status import StatusPublisher
from shared import topics
from shared.messages import (
    ArmStates,
    NodeChain,
    Setpoints,
    TaskRequest,
    chain,
    poses_known,
    scene_obstacles,
)
from shared.motion_contract import SETPOINT_PERIOD
from shared.scenario import SIDES, Scenario
from shared.scenario.rod_properties import rod_properties
from shared.service import SECOND, Inbox, Publication

log = logging.getLogger(__name__)

BLIND = 9 * SECOND // 20
"""Control goes on without a fresh look at the rope for this long [ns]: half a second, less what an
arm takes to follow, so that it has begun to brake in time."""
STRAYED = 0.04
"""Distance between command and arm at which the command is given up [m]: a CR5 is 0.1 s behind, and
the gateway watches how far it is off its path."""
REFUSED = 8
"""Chunks that the gateway refuses in a row before it is taken for more than a passing matter."""
TAUT = 0.98
"""Distance of the grips, as a share of the rope's length, from which a rod has no rest shape to be
put into that is worth the name [-]."""
START_APART = 0.003
"""Most distance of a path's start from the grips [m]."""
LEAST_CLEARANCE = 0.005
"""What is left of a path must keep this, or another one is asked for [m]."""


class ControllerService:
    """The controller on the bus."""

    name = "controller"
    reads = (
        topics.ROPE_NODES,
        topics.ARM_STATE,
        topics.SCENE_STATE,
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
        self._scenario, self._session = scenario, session
        self._rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
        self._moves = free_components(scenario)
        start = scenario.grips(scenario.start)
        self._goals = GoalFactory(scenario, self._rod, start)
        resettable = not any(scenario.end(side).address for side in SIDES)
        self.task = Task(
            self._goals.of_shape(scenario.goal),
            settings={"adapt": "true" if scenario.control.adapt else "false"},
            resettable=resettable,
        )
        self._model = prediction_rod(scenario, self._rod)
        self.estimate = StateEstimator(self._model, MotionState.at_rest(*start), 0)
        self.adaptation = adaptation(scenario, self._model)
        self.loop = receding_horizon_controller(
            scenario.control, scenario.limits, self._moves, self.estimate
        )
        self.snag = SnagDetector(scenario.rope.length)
        self.monitor = ProgressMonitor(scenario.run.tolerance, scenario.rope.diameter / 2.0)
        self.course = Course(self.task, self.monitor, self.adaptation)
        self.scene = CollisionScene(scenario)
        self.estimate.supports = self.scene.supports
        self._reports = StatusPublisher(self.task, self.monitor, self.estimate, self.adaptation)
        self._arms: ArmStates | None = None
        self.note = ""
        self._resets: int | None = None
        self._seen = 0
        self._followed: tuple[int, int] | None = None
        self._planned_anew = ""
        """Run for which another path was asked for because the one at hand was none."""
        self._sequence = 0
        self._image_stamp = 0
        self._events = sorted(
            (e for e in scenario.events if e.goal is not None), key=lambda e: e.time
        )
        self._events_done = 0

    def warm_up(self) -> None:
        """Compiles by controlling a rope that already is where it shall be."""
        start = self._goals.start
        estimate = StateEstimator(self._model, MotionState.at_rest(*start), 0)
        loop = receding_horizon_controller(
            self._scenario.control, self._scenario.limits, self._moves, estimate
        )
        nodes = estimate.nodes
        loop.follow(
            ReferenceTrajectory.standing(estimate.motion, nodes, SETPOINT_PERIOD * 1e-9),
            SETPOINT_PERIOD,
        )
        for k in (1, 2, 3):
            estimate.advance(estimate.motion, k * SETPOINT_PERIOD)
            loop.step(k * SETPOINT_PERIOD, nodes, self.scene.avoidance(self.task, 0.0))

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """One step of control."""
        self._take_arms(inbox)
        self._take_rope(inbox, now)
        for request in inbox.every(topics.TASK_REQUEST):
            self._answer(request.message, now)
        self._take_events(now)
        self._take_scene(inbox)
        draft = inbox.fresh(topics.TASK_GOAL_DRAFT)
        if draft is not None:
            shown = preview(draft.message, self._goals, self.scene.obstacles, now)
            yield Publication(topics.TASK_GOAL_PREVIEW, shown)
        if self._arms is not None:
            yield from self._control(inbox, now)
        yield from self._reports.due(now, arms_known=self._arms is not None)

    def _take_arms(self, inbox: Inbox) -> None:
        arrived = inbox.every(topics.ARM_STATE)
        if not arrived or not poses_known(arrived[-1].message):
            return
        arms: ArmStates = arrived[-1].message
        self._arms = arms
        motion = motion_of(arms)
        if self._resets != arms.reset_count or self.estimate.time == 0:
            self.loop.disengage()
            self._seen = 0
            turns = round(self._scenario.start.turns)
            if not self._begin_anew(motion, arms.stamp, turns=turns):
                self._arms = None
                return
            self._resets = arms.reset_count
        else:
            self.estimate.advance(motion, arms.stamp)

    def _begin_anew(
        self, motion: MotionState, stamp: int, nodes: np.ndarray | None = None, turns: int = 0
    ) -> bool:
        """Lets the estimate begin again; False where no rope reaches from grip to grip.

        An arm may stand anywhere before it is armed.
        """
        try:
            self.estimate.restart(motion, stamp, nodes, turns)
        except ValueError as error:
            if not self.note:
                log.warning("waiting for the grips: %s", error)
            self.note = f"waiting for the grips: {error}"
            return False
        self.note = ""
        return True

    def _take_rope(self, inbox: Inbox, now: int) -> None:
        item = inbox.fresh(topics.ROPE_NODES)
        if item is None or self._arms is None:
            return
        rope: NodeChain = item.message
        if not rope.positions or rope.stamp < self.estimate.start_time:
            return
        nodes = chain(rope.positions)
        count = len(nodes)
        sigma = np.array(rope.sigma) if rope.sigma else np.zeros(count)
        observed = np.array(rope.observed) if rope.observed else np.ones(count, dtype=bool)
        self.estimate.observe(rope.stamp, nodes, sigma, observed)
        if self.estimate.diverged and self.loop.resting:
            self._begin_anew(self.estimate.motion, self.estimate.time, nodes, self.estimate.turns)
        if np.any(observed):
            # Guesses at what is hidden are no look at the rope.
            self._seen, self._image_stamp = now, rope.stamp
        if self.task.adapts:
            change = self.adaptation.look(self.estimate, rope.stamp, nodes, sigma, observed)
            if change is not None:
                self._become(change)
        # Noise would add to every distance: the run is judged by the estimate.
        believed = self.estimate.model_nodes_at(rope.stamp) + self.estimate.offset
        self.monitor.look(rope.stamp, believed, self.task.goal.nodes, self.scene.obstacles)
        self._watch(rope.stamp, nodes, observed)

    def _become(self, change: np.ndarray) -> None:
        """Goes on with the rod that was learnt, by which its rest shape changes so much [m]."""
        rod = self._model.with_properties(self.adaptation.properties)
        positions = self.estimate.motion.positions
        apart = np.linalg.norm(positions[1] - positions[0])
        begun = self.loop.reference is not None
        if self.adaptation.standing and not begun and apart < TAUT * rod.properties.length:
            self.estimate.rest_with_material(rod)
        else:
            self.estimate.change_material(rod, change)

    def _watch(self, stamp: int, nodes: np.ndarray, observed: np.ndarray) -> None:
        """Gives up when the rope hangs on something, before the grips pull on it."""
        if self.task.state != "running" or self.loop.reference is None:
            self.snag.begin()
            return
        caught = self.snag.look(stamp, nodes, self.estimate.model_nodes_at(stamp), observed)
        if not caught:
            return
        self.snag.begin()
        if self.estimate.switch_equilibrium(nodes, observed):
            log.info("the rope rests in another shape than the model; the model takes it")
            return
        log.warning(caught)
        self.task.enter("failed", caught)

    def _take_events(self, now: int) -> None:
        if self.task.state not in ("running", "reached"):
            return
        while self._events_done < len(self._events):
            event = self._events[self._events_done]
            if now < self.task.run_started + round(event.time * SECOND):
                return
            self._events_done += 1
            assert event.goal is not None
            self.task.set_goal(self._goals.of_shape(event.goal))
            self.task.enter("running", f"the goal changed {event.time:g} s into the run")

    def _take_scene(self, inbox: Inbox) -> None:
        item = inbox.latest(topics.SCENE_STATE)
        if item is None or item.message.revision == self.scene.revision:
            return
        self.scene.lay(scene_obstacles(item.message), item.message.revision)
        self.estimate.supports = self.scene.supports
        if self.loop.reference is None or self.task.state != "running":
            return
        ahead = self.loop.remaining_nodes[::5]
        if self.monitor.clearance_of(ahead, self.scene.avoided) < LEAST_CLEARANCE:
            self.task.ask_for_path()

    def _answer(self, request: TaskRequest, now: int) -> None:
        obstacles = self.scene.obstacles
        if carry_out(request, self.task, self._goals, obstacles, self._arms, now, self.note):
            self._events_done = 0
            self.course.begin()
            self.monitor.begin(now, self.task.replan_count)

    def _control(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        halted = self._halted(now)
        if halted:
            self.loop.disengage()
            self.course.let_go()
            yield self._hold(now, halted)
            return
        waiting = self._waiting(inbox, now)
        if waiting:
            chunk = None if self.loop.resting else self.loop.brake(now)
            if chunk is None:
                self.loop.disengage()
                yield self._hold(now, waiting)
            else:
                yield self._setpoints(now, chunk)
            return
        goal = self.task.goal
        self.loop.oriented = goal.left_oriented, goal.right_oriented
        avoidance = self.scene.avoidance(self.task, self.monitor.error)
        command = self.loop.step(now, goal.nodes, avoidance)
        yield self._setpoints(now, command.chunk)
        yield Publication(topics.CONTROLLER_PLAN, self._plan(command))
        if self.loop.reference is not None:
            self.course.judge(now, self.loop.reference, self.loop.at_end)

    def _halted(self, now: int) -> str:
        """Why nothing may be sent but a hold; empty when there is no such reason."""
        arms, task = self._arms, self.task
        assert arms is not None
        if task.state not in ("running", "reached"):
            return task.reason
        if arms.needs_acknowledgement or arms.mode in (ArmStates.DISARMED, ArmStates.FAULT):
            return f"the arms do not follow: {arms.reason}"
        if task.reset_count != arms.reset_count:
            return "waiting for the arms to reset"
        if now - self._seen > BLIND or self._seen == 0:
            if self.loop.reference is not None:
                task.ask_for_path()
            return f"the rope has not been seen for {BLIND / SECOND:g} s"
        barred = self._barred(arms)
        if barred:
            self.course.barred(barred)
        return barred

    def _barred(self, arms: ArmStates) -> str:
        """Why the arms do not follow what they are sent; empty when they do."""
        refused = arms.session == self._session and arms.refused_sequence > arms.sequence + REFUSED
        if refused and self.loop.reference is not None:
            return f"the gateway refuses the way ({arms.refusal})"
        if self.loop.tracking_error() > STRAYED:
            return f"an arm is {1e3 * self.loop.tracking_error():.0f} mm from where it should be"
        return ""

    def _waiting(self, inbox: Inbox, now: int) -> str:
        """Why there is nothing to follow, after taking a path that is new; empty when there is."""
        task = self.task
        wanted = (task.goal_revision, task.replan_count)
        if self._followed == wanted and self.loop.reference is not None:
            return ""
        if not self.loop.resting:
            return "coming to rest before another path"
        if not self._scenario.control.planner:
            here = self.estimate.motion
            self.loop.follow(
                ReferenceTrajectory.standing(here, self.estimate.nodes, SETPOINT_PERIOD * 1e-9), now
            )
            self._followed = wanted
            return ""
        item = inbox.latest(topics.CONTROLLER_PATH)
        if item is None:
            return "waiting for a path"
        path = item.message
        if (path.goal_revision, path.replan_count) != wanted:
            return "waiting for a path"
        if not path.left_positions:
            if path.stamp < task.run_started and self._planned_anew != task.run:
                # What stood in the way before this run began may be gone.
                self._planned_anew = task.run
                task.ask_for_path()
                return "waiting for a path"
            task.enter("failed", path.reason)
            return path.reason
        if self.course.learning(now):
            return "learning the rope before it is moved"
        if self.course.outdated(path.bending_stiffness):
            return "the rope has turned out to be another one; waiting for a path"
        track = reference_trajectory(path)
        apart = np.linalg.norm(track.positions[0] - self.estimate.motion.positions, axis=1)
        if np.max(apart) > START_APART:
            task.ask_for_path()
            return "the path begins elsewhere; waiting for another"
        self.loop.follow(track, now)
        self.course.follow(path.bending_stiffness)
        self._followed = wanted
        return ""

    def _setpoints(self, now: int, chunk) -> Publication:
        self._sequence += 1
        message = chunk_message(chunk, now, self._session, self._sequence, self._image_stamp)
        return Publication(topics.ARM_SETPOINTS, message)

    def _hold(self, now: int, reason: str) -> Publication:
        self._sequence += 1
        return Publication(
            topics.ARM_SETPOINTS,
            Setpoints(
                stamp=now, session=self._session, sequence=self._sequence, hold=True, reason=reason
            ),
        )

    def _plan(self, command: Command):
        return plan_message(command, round(self.loop.optimizer.time_step * SECOND))


def build(scenario: Scenario, session: str) -> ControllerService:
    """The controller of a scenario."""
    check(scenario)
    return ControllerService(scenario, session)

"""Controller of a rope: arms, images, scene and paths in, setpoints for the arms out.

It owns the task (`control.run`), estimates the rope's state and material (`control.estimation`),
turns observations and planned paths into setpoints (`control.control_loop`, `control.mpc`), and
supervises the run (`control.supervision`). It reads no clock and sends nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from lariat.configuration import ConfigurationError
from lariat.control.control_loop import ControlLoop
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.rope_tracker import RopeTracker
from lariat.control.extensions.method_faults import MethodFaults
from lariat.control.mpc.collision_scene import CollisionScene
from lariat.control.mpc.receding_horizon import Command
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run import live_settings
from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.goal_events import GoalEvents
from lariat.control.run.goals import GoalFactory, Pull
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.run.requests import Preview, Request, RequestAction, carry_out, preview
from lariat.control.run.state_machine import RunState
from lariat.control.run.task import RequestRefused, Task
from lariat.control.supervision.path_choice import PathOffer
from lariat.control.supervision.progress import ProgressMonitor
from lariat.control.supervision.replanning import Replanning
from lariat.control.supervision.rope_watch import RopeWatch
from lariat.controllers import (
    OPTIMIZER_KEYS,
    adaptation,
    check,
    expected_lag,
    horizon_optimizer,
    live_keys,
    prediction_rod,
    receding_horizon_controller,
    state_estimator,
)
from lariat.geometry.obstacle_motion import ObstacleMotion
from lariat.geometry.obstacles import Obstacle
from lariat.rod.strains import tensions
from lariat.safety.motion_contract import SETPOINT_PERIOD
from lariat.scenario import Goal, Scenario
from lariat.scenario.extensions import ExtensionFault
from lariat.trajectory import MotionState, SetpointChunk


class RopeController:
    """Controller of one rope between two grips, for the goals of a task."""

    def __init__(self, scenario: Scenario) -> None:
        """Create the controller of a scenario; its first goal is the scenario's.

        Args:
            scenario: Rope, cell, goal and control settings.

        Raises:
            ConfigurationError: Method, solver and adaptation do not fit together.
            ValueError: The rope has no shape at rest at the start or at the goal.
        """
        check(scenario)
        self._scenario, self._control = scenario, scenario.control
        self._goals = GoalFactory.of_scenario(scenario)
        rod, start = self._goals.rod, self._goals.start
        self.task = Task(
            self._goals.from_shape(scenario.goal),
            settings=live_settings.texts(scenario.control, live_keys(scenario.control)),
            usual_pace=scenario.control.pace,
            pace=scenario.control.pace,
            resettable=scenario.simulated,
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
        self._goal_events = GoalEvents(scenario.events, scenario.next_goals)
        self._offer: PathOffer | None = None
        """Latest answer of the planner."""
        self._arms: ArmCondition | None = None
        """Condition of arms between which the rope can hang; None before they have reported."""

    @property
    def arms_known(self) -> bool:
        """Whether the arms have reported grips between which the rope can hang."""
        return self._arms is not None

    @property
    def note(self) -> str:
        """Condition that keeps the controller from working; empty otherwise."""
        return self._faults.last if self._obstruction is None else str(self._obstruction)

    @property
    def _obstruction(self) -> Reason | None:
        """Reason why no run can begin, whatever is requested."""
        problem = self.rope.problem
        return Reason(ReasonCode.WAITING_FOR_GRIPS, {"problem": problem}) if problem else None

    @property
    def tension(self) -> float:
        """Largest tension of the model's rope [N]; 0 where `limits.tension` bounds none."""
        if self._scenario.limits.tension is None:
            return 0.0
        estimator = self.rope.estimator
        nodes = estimator.state.positions
        return max(0.0, float(np.max(tensions(nodes, estimator.rod.properties))))

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

    def take_arms(self, motion: MotionState, condition: ArmCondition, stamp: int) -> None:
        """Take in what the arms report.

        Args:
            motion: Measured motion of both grips.
            condition: Condition of the arms.
            stamp: Time of that motion [ns].
        """
        with self._faults.blaming():
            self._arms = condition
            self.task.take_reset_count(condition.reset_count)
            if not self.rope.advance(motion, stamp, condition.reset_count):
                self._loop.disengage()
                if not self.rope.begin(motion, stamp):
                    self._arms = None

    def take_rope(self, seen: RopeObservation, now: int) -> None:
        """Take in an observation of the rope at `now` [ns]; before the arms, nothing is known."""
        if self._arms is None:
            return
        following = self._loop.following
        with self._faults.blaming():
            rope = self.rope.observe(
                seen, now, adapts=self.task.adapts, resting=self._loop.resting, following=following
            )
            if rope is not None:
                self._watch.observe(seen, rope, self.scene.obstacles, following=following)

    def carry_out(self, request: Request, now: int) -> None:
        """Carry out a request of a person at `now` [ns]; `task` holds the answer."""
        scene = self.scene.obstacles
        if request.action is RequestAction.SET:
            carry_out(request, self.task, self._goals, scene, self._arms, now)
            self._take_settings()
        elif carry_out(request, self.task, self._goals, scene, self._arms, now, self._obstruction):
            self._goal_events.restart()
            if self._faults.last:
                self._faults.last = ""
                self.rope.forget()
            self._replanning.begin_run()
            self.progress.begin(now, self.task.replan_count)

    def _take_settings(self) -> None:
        """Act upon the task's settings: another optimizer, clearance or pace."""
        control = live_settings.applied(self._control, self.task.settings)
        before, self._control = self._control, control
        controller = self._loop.controller
        keys = OPTIMIZER_KEYS.get(control.method, ())
        if live_settings.texts(control, keys) != live_settings.texts(before, keys):
            controller.optimizer = horizon_optimizer(
                control,
                self._scenario.moves,
                controller.offset_limits,
                self._scenario.rope.node_count,
            )
        if (control.clearance, control.pace) != (before.clearance, before.pace):
            self._loop.keep_clearance(control.clearance)
            self.task.usual_pace = self.task.pace = control.pace
            self.task.request_path()

    def begin_due_goals(self, now: int) -> None:
        """Set the goals whose time in the run has come at `now` [ns]."""
        self._goal_events.apply_due(now, self.task, self._goals.from_shape)

    def take_scene(self, obstacles: Sequence[Obstacle], revision: int) -> None:
        """Replace the obstacles of the scene by those of another revision."""
        if revision != self.scene.revision:
            self.scene.update(tuple(obstacles), revision)
            self.rope.estimator.supports = self.scene.supports
            self._loop.review_scene()

    def take_motions(self, motions: Sequence[ObstacleMotion], run_started: int) -> None:
        """Take in how obstacles move in the run that began at `run_started` [ns]."""
        if run_started != self.scene.run_started:
            self.scene.update_motions(tuple(motions), run_started)

    def take_others(self, ropes: Sequence[Obstacle], revision: int) -> None:
        """Replace the other ropes in view, which are obstacles, by those of a revision."""
        changed = revision != self.scene.others_revision
        self.scene.update_others(tuple(ropes), revision)
        if changed:
            self._loop.review_scene()

    def take_path(self, offer: PathOffer) -> None:
        """Take in an answer of the planner."""
        self._offer = offer

    def preview(self, request: Goal, pull: Pull | None = None) -> Preview:
        """Return the goal between grips that are being dragged, or why there is none.

        Args:
            request: Goal without nodes.
            pull: Node that is pulled, and where to [m]; None where the grips stay.
        """
        running = self.task.state is RunState.RUNNING
        return preview(request, pull, self._goals, self.scene.obstacles, running)

    def step(self, now: int) -> Iterator[Command | SetpointChunk | Reason]:
        """Yield setpoints or a reason to hold, then the command of a new horizon if there is one.

        Args:
            now: Present time [ns].
        """
        if self._arms is None:
            return
        yield from self._loop.step(now, self._arms, self._offer)
        if self._goal_events.apply_reached(self.task, self._goals.from_shape):
            self._replanning.begin_run()

"""Control loop: hold, come to rest, take a path, or follow it by one more horizon."""

from __future__ import annotations

from collections.abc import Iterator

from lariat.control.estimation.rope_tracker import RopeTracker
from lariat.control.extensions.method_faults import MethodFaults
from lariat.control.mpc.collision_scene import CollisionScene
from lariat.control.mpc.receding_horizon import Command, RecedingHorizonController
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.run.state_machine import RunState
from lariat.control.run.task import Task
from lariat.control.supervision.clearance_guard import ClearanceGuard
from lariat.control.supervision.path_choice import PathChoice, PathOffer
from lariat.control.supervision.path_watch import PathWatch
from lariat.control.supervision.progress import ProgressMonitor
from lariat.control.supervision.replanning import Replanning
from lariat.safety.motion_contract import SETPOINT_PERIOD
from lariat.scenario import Scenario
from lariat.trajectory import SetpointChunk


class ControlLoop:
    """Control of one task's rope, from what is known of it to setpoints for the arms."""

    def __init__(
        self,
        scenario: Scenario,
        task: Task,
        rope: RopeTracker,
        scene: CollisionScene,
        progress: ProgressMonitor,
        replanning: Replanning,
        faults: MethodFaults,
        controller: RecedingHorizonController,
    ) -> None:
        """Create the loop, which follows nothing yet.

        Args:
            controller: Controller of the arms, e.g. of `lariat.controllers`.
        """
        self._task, self._rope, self._scene = task, rope, scene
        self._progress, self._faults = progress, faults
        self._planned = scenario.control.planner
        self.controller = controller
        self._paths = PathChoice(
            task,
            rope.adaptation,
            replanning,
            scenario.rope.node_count,
            certain_clearance=scenario.control.certain_clearance,
            obstacles_move=bool(scenario.obstacle_motions()),
        )
        self._guard = ClearanceGuard(scenario.rope.diameter / 2.0, scenario.control.clearance)
        self._watch = PathWatch(
            task, rope, scene, self.controller, progress, self._guard, replanning, self._paths
        )

    @property
    def following(self) -> bool:
        """Whether a path is being followed."""
        return self.controller.reference is not None

    @property
    def resting(self) -> bool:
        """Whether the commanded motion has come to rest."""
        return self.controller.resting

    def keep_clearance(self, clearance: float) -> None:
        """Take another desired distance of the rope's surface from obstacles [m]."""
        self._scene.clearance = clearance
        self._guard.want(clearance)

    def disengage(self) -> None:
        """Drop what is followed; the gateway then decides where the arms stop."""
        self.controller.disengage()

    def review_scene(self) -> None:
        """Request another path where the present one is not clear of a changed scene."""
        self._watch.review_scene()

    def step(
        self, now: int, arms: ArmCondition, offer: PathOffer | None
    ) -> Iterator[Command | SetpointChunk | Reason]:
        """Yield setpoints or a reason to hold, then the command of a new horizon if there is one.

        Args:
            now: Present time [ns].
            offer: Latest answer of the planner; None before the first one.
        """
        reason = self._watch.hold_reason(arms, now)
        if reason is not None:
            self.controller.disengage()
            self._watch.released()
            yield reason
            return
        reason = self._waiting_reason(now, offer)
        if reason is not None:
            chunk = None if self.controller.resting else self.controller.brake(now)
            if chunk is None:
                self.controller.disengage()
            yield reason if chunk is None else chunk
            return
        reference = self.controller.reference
        assert reference is not None
        command = None
        with self._faults.blaming():
            command = self._command(now, reference)
        stops = command is None or self._watch.must_stop(command)
        chunk = self.controller.brake(now) if stops else command.chunk
        assert chunk is not None
        # The arms wait for it, nobody for the horizon.
        yield chunk
        if command is not None:
            yield command
        if stops:
            return
        self._rope.predictions.take_plan(command.plan_start, command.plan_step, command.plan.nodes)
        self._watch.judge(now, reference, at_end=self.controller.at_end)

    def _command(self, now: int, reference: ReferenceTrajectory) -> Command:
        """Command of the next horizon along a path."""
        goal = self._task.goal
        self.controller.oriented = goal.left_oriented, goal.right_oriented  # pyright: ignore[reportAttributeAccessIssue]
        self.controller.counted = goal.counted if goal.ends_only else None
        avoidance = self._scene.avoidance(self._task, self._progress.error)
        # Path and free rest of a part's goal are planned with what has been learnt since.
        completed = goal.completed(reference.nodes[-1])
        return self.controller.step(now, completed, avoidance)

    def _waiting_reason(self, now: int, offer: PathOffer | None) -> Reason | None:
        """Reason why there is nothing to follow, after taking a new path; None when there is."""
        if self._paths.follows_latest and self.following:
            return None
        if not self.controller.resting:
            return Reason(ReasonCode.COMING_TO_REST)
        rope = self._rope.estimator
        # At the goal the arms go on where they stand: another path would lay a cable anew.
        if not self._planned or self._task.state is RunState.REACHED:
            dt = SETPOINT_PERIOD * 1e-9
            self._follow(ReferenceTrajectory.standing(rope.motion, rope.nodes, dt), None, now)
            return None
        reason = self._paths.review(offer, now)
        if offer is None or reason is not None:
            return reason
        reference = offer.trajectory()
        reason = self._paths.review_start(offer, reference, rope.motion, now)
        if reason is None:
            self._follow(reference, offer, now)
            if offer.others_revision != self._scene.others_revision:
                self._watch.review_scene()
        return reason

    def _follow(self, reference: ReferenceTrajectory, offer: PathOffer | None, now: int) -> None:
        """Follow a path, and forget the predictions before it."""
        self.controller.follow(reference, now)
        self._paths.follow(offer)
        self._rope.predictions.begin_path()
        self._watch.begin_path()

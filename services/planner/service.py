"""Planner service: a whole path for each goal, scene and request of the controller."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lariat.control.run.live_settings import applied
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.planning import whole_path
from lariat.planning.cell_problem import arms_of, problem_of
from lariat.planning.certain_clearance import certain_clearance
from lariat.planning.extension import ExtensionPlanner
from lariat.planning.moving_obstacles import divided, plan_departure
from lariat.planning.problem import Problem, WholePath
from lariat.planning.rope_model import RopeModel
from lariat.scenario import SIDES, Goal, Scenario
from lariat.scenario.extensions import extension
from lariat.scenario.sections import PATH_PLANNERS
from lariat.trajectory import NANOSECONDS, SECOND
from services.planner.parameter_update import update
from services.planner.path_start import at_rest, moved, stopped
from shared import topics
from shared.door import Door
from shared.messages import (
    RUNNING,
    ArmStates,
    NodeChain,
    Path,
    Scene,
    SceneMotion,
    TaskState,
    arm_pose,
    chain,
    goal_of,
    obstacle_motions,
    poses_known,
    scene_obstacles,
)
from shared.other_ropes import other_rope_obstacles
from shared.runtime.service import Inbox, Publication

if TYPE_CHECKING:
    from lariat.planning.arms.cell_arms import CellArms

FIRST_PLANNING_TIME = SECOND // 2
"""Time that the first plan is expected to take [ns], after which a path among moving obstacles may
begin."""


class PlannerService:
    """Publishes a whole path for each goal, scene and request."""

    name = "planner"
    reads = (
        topics.TASK_STATE,
        topics.SCENE_STATE,
        topics.SCENE_MOTION,
        topics.ROPE_OTHERS,
        topics.ARM_STATE,
        topics.ARM_SETPOINTS,
        topics.ROPE_NODES,
        topics.CONTROLLER_PARAMETERS,
    )
    writes = (topics.CONTROLLER_PATH,)
    rate = 10.0
    latency = 0.200
    longest_step = 30.0
    """Longest duration of a step [s]; a plan takes one to four on a loaded machine, and several
    times as long where the random trees are needed."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self.longest_step = max(self.longest_step, scenario.control.planning_time)
        self.door = Door()
        self._moves = scenario.moves
        self._rope = RopeModel(scenario.rope, self._moves)
        own = extension("control.path_planner", scenario.control.path_planner, PATH_PLANNERS)
        self._find = (
            whole_path.plan if own is None else ExtensionPlanner(own, scenario, self._moves).plan
        )
        self._arms = arms_of(scenario)
        self._planned: tuple[int, ...] | None = None
        self._mismatch = 0.0
        """Clearance that is added for the distance of rod and rope, as seen at rest last [m]."""
        self._planning_since = 0
        """Time at which the last plan was begun, until its duration is known [ns]."""
        self._planning_time = FIRST_PLANNING_TIME
        """Time after which the next plan is expected [ns]."""
        self._path: Path | None = None
        self._published = 0

    def warm_up(self) -> None:
        """Compile by planning once, from the scenario's start to a goal 10 mm above it."""
        grips = self._scenario.grips(self._scenario.start)
        state = self._rope.rod.rest(*grips).state
        shift = np.array([0.0, 0.0, 0.01]) * self._moves.any(axis=1).all()
        raised = (Pose(g.position + shift, g.orientation) for g in grips)
        goal = Goal(state.positions + shift, *raised)
        self._find(
            problem_of(
                self._scenario,
                self._rope,
                state,
                grips,
                goal,
                self._scenario.bodies,
                self._arms,
            )
        )

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Publish a path when one is due, and repeat the last one once a second."""
        task = inbox.latest(topics.TASK_STATE)
        scene = inbox.latest(topics.SCENE_STATE)
        arms = inbox.latest(topics.ARM_STATE)
        if task is None or arms is None or scene is None or not task.message.goal.positions:
            return
        if self._planning_since:
            self._planning_time, self._planning_since = now - self._planning_since, 0
        others = inbox.latest(topics.ROPE_OTHERS)
        motion = inbox.latest(topics.SCENE_MOTION)
        motions = motion.message if motion is not None else SceneMotion()
        revisions = (
            task.message.goal_revision,
            scene.message.revision,
            others.message.revision if others is not None else 0,
            task.message.replan_count,
            motions.run_started,
        )
        if revisions == self._planned or not poses_known(arms.message):
            begin = None
        elif at_rest(arms.message):
            begin = arms.message
        else:
            begin = self._stop_ahead(inbox, task.message, scene.message, arms.message)
        if begin is not None:
            rope = inbox.latest(topics.ROPE_NODES)
            nodes = rope.message if rope is not None else None
            if begin is not arms.message and nodes is not None:
                nodes = moved(nodes, arms.message, begin)
            parameters = inbox.latest(topics.CONTROLLER_PARAMETERS)
            self._planned = revisions
            self._planning_since = now
            self._path = Path(
                stamp=begin.stamp,
                goal_revision=task.message.goal_revision,
                scene_revision=scene.message.revision,
                replan_count=task.message.replan_count,
            )
            with self.door.guard("a goal to plan for") as outcome:
                if parameters is not None:
                    states_certain = self._scenario.control.certain_clearance is not None
                    update(self._rope, parameters.message, states_certain)
                beside = other_rope_obstacles(others.message) if others is not None else ()
                self._path = self._plan(task.message, scene.message, motions, beside, begin, nodes)
            if outcome.refusal:
                self._path.reason = f"the planner cannot plan for this goal: {outcome.refusal}"
            self._path.others_revision = revisions[2]
            self._path.motion_run_started = motions.run_started
            self._published = 0
        if self._path is not None and now - self._published >= SECOND:
            self._published = now
            yield Publication(topics.CONTROLLER_PATH, self._path)

    def _stop_ahead(
        self, inbox: Inbox, task: TaskState, scene: Scene, arms: ArmStates
    ) -> ArmStates | None:
        """State of the arms where they will stop before another path; None while it is unknown.

        The controller brakes for another goal or request. Its setpoints then end where the arms
        will stand, so that the path from there is planned on the way. Where neither goal nor scene
        has changed, the rope was not where the model has it: it has to be seen at rest first.
        """
        item = inbox.latest(topics.ARM_SETPOINTS)
        if item is None or self._planned is None:
            return None
        setpoints = item.message
        asked = (task.goal_revision, task.replan_count)
        brakes = asked != (self._planned[0], self._planned[3]) and task.state == RUNNING
        changed = (task.goal_revision, scene.revision) != self._planned[:2]
        if not (brakes and changed) or setpoints.hold or setpoints.stamp < task.stamp:
            return None
        kinematics = {} if self._arms is None else self._arms.arms
        return stopped(arms, setpoints, {SIDES[k]: arm for k, arm in kinematics.items()})

    def _plan(
        self,
        task: TaskState,
        scene: Scene,
        motions: SceneMotion,
        others: tuple[Obstacle, ...],
        arms: ArmStates,
        rope: NodeChain | None,
    ) -> Path:
        """Message of a path from the current state to the goal, clear of scene and other ropes."""
        seen = chain(rope.positions) if rope is not None and rope.positions else None
        sigma = np.array(rope.sigma if rope is not None else ())
        grips = self._rope.ends(arm_pose(arms, "left"), arm_pose(arms, "right"))
        message = Path(
            stamp=arms.stamp,
            goal_revision=task.goal_revision,
            scene_revision=scene.revision,
            replan_count=task.replan_count,
            bending_stiffness=self._rope.rod.properties.bending_stiffness,
        )
        departure = (arms.stamp + self._planning_time) * NANOSECONDS
        still, moving = divided(scene_obstacles(scene), obstacle_motions(motions), departure)
        obstacles = (*still, *others)
        try:
            state = self._rope.rest_state(grips, seen, obstacles, round(task.turns))
        except ValueError as error:
            message.reason = f"the rod has no shape at rest between the grips: {error}"
            return message
        goal = self._rope.goal(goal_of(task.goal), obstacles)
        problem = problem_of(
            self._scenario,
            self._rope,
            state,
            grips,
            goal,
            obstacles,
            self._present_arms(arms),
            task.replan_count,
        )
        if at_rest(arms):
            self._mismatch = self._rope.mismatch_margin(state, seen, sigma)
        margin = max(task.clearance_margin, self._mismatch)
        problem = replace(
            problem,
            clearance=self._clearance(task) + margin,
            spare_clearance=margin,
            pace=task.pace if task.pace else 1.0,
        )
        if not moving:
            _write_path(message, problem, self._find(problem))
            return message
        chosen = plan_departure(problem, moving, departure, self._find)
        _write_path(message, problem, chosen.path)
        message.start_after = round(chosen.after / NANOSECONDS)
        message.start_before = round(chosen.before / NANOSECONDS)
        return message

    def _clearance(self, task: TaskState) -> float:
        """Desired clearance: the scenario's, or another one that people have set meanwhile [m]."""
        return applied(self._scenario.control, dict(task.settings)).clearance

    def _present_arms(self, message: ArmStates) -> CellArms | None:
        """Arms with the joints that they report."""
        if self._arms is None:
            return None
        reported = {state.arm: state.joints for state in message.arms}
        joints = {k: np.array(reported.get(SIDES[k], ()), dtype=float) for k in self._arms.arms}
        complete = {k: row for k, row in joints.items() if len(row) == len(self._arms.joints[k])}
        return replace(self._arms, joints={**self._arms.joints, **complete})


def build(scenario: Scenario, session: str) -> PlannerService:
    """Create the planner service of a scenario."""
    return PlannerService(scenario)


def _write_path(message: Path, problem: Problem, path: WholePath) -> None:
    """Write a path of the rope's ends into the message of the grippers' path."""
    message.certain_clearance = certain_clearance(problem, path)
    path = path.of_grippers(problem)
    message.reached, message.reason = path.reached, path.reason
    message.blocked = path.blocked
    message.dt = round(path.dt * SECOND)
    message.left_positions.extend(path.positions[:, 0].ravel().tolist())
    message.left_orientations.extend(path.orientations[:, 0].ravel().tolist())
    message.right_positions.extend(path.positions[:, 1].ravel().tolist())
    message.right_orientations.extend(path.orientations[:, 1].ravel().tolist())
    message.nodes.extend(path.nodes.ravel().tolist())
    message.node_count = path.nodes.shape[1]
    message.final_error, message.clearance = path.final_error, path.clearance

"""Planner service: a whole path for each goal, scene and request of the controller."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle, pack
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodState, add_turns, count_turns_along, state_along
from lariat.rod.part_fit import fit_part
from lariat.trajectory import NANOSECONDS
from services.planner import whole_path
from services.planner.extension import ExtensionPlanner
from services.planner.moving_obstacles import divided, plan_departure
from services.planner.parameter_update import (
    is_learnt,
    unsure_properties,
    updated_properties,
)
from services.planner.problem import Problem, WholePath
from shared import topics
from shared.extensions import extension
from shared.messages import (
    RUNNING,
    ArmStates,
    Goal,
    NodeChain,
    Parameters,
    Path,
    RodParameters,
    Scene,
    SceneMotion,
    TaskState,
    arm_pose,
    chain,
    grip_pose,
    obstacle_motions,
    poses_known,
    scene_obstacles,
)
from shared.messages.parameters import held_ends
from shared.other_ropes import other_rope_obstacles
from shared.scenario import SIDES, Scenario
from shared.scenario.rod_properties import rod_properties
from shared.scenario.sections import PATH_PLANNERS
from shared.service import SECOND, Inbox, Publication

if TYPE_CHECKING:
    from services.planner.arms.cell_arms import CellArms

log = logging.getLogger(__name__)

MAX_START_SPEED = 2e-3
"""Speed of a grip below which it is at rest [m/s]."""
MAX_START_ANGULAR_SPEED = 1e-2
"""Angular speed of a grip below which it is at rest [rad/s]."""
FIRST_PLANNING_TIME = SECOND // 2
"""Time that the first plan is expected to take [ns], after which a path among moving obstacles may
begin."""
SAME_SHAPE_DISTANCE = 0.02
"""Mean node distance between the observed rope and the rod at rest below which both have the same
shape [m]."""
COVERED_MISMATCH = 0.002
"""Root mean square distance of rod and rope at rest that a path's own reserve covers [m]."""
MISMATCH_DEVIATIONS = 2.0
"""Distances beyond that one that are added to the clearance [-]."""
MAX_MISMATCH_MARGIN = 0.015
"""Largest clearance that is added for the distance of rod and rope [m]."""


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
        self._given = rod_properties(scenario.rope)
        self._rod = Rod(self._given, scenario.rope.node_count)
        self._variants: tuple[Rod, ...] = ()
        """Rods with one identified property off by its standard deviation each."""
        self._held = held_ends(RodParameters())
        """Poses of the rope's ends in the frames of the grips. Paths are planned for the ends."""
        self._moves = scenario.moves
        own = extension("control.path_planner", scenario.control.path_planner, PATH_PLANNERS)
        self._find = (
            whole_path.plan if own is None else ExtensionPlanner(own, scenario, self._moves).plan
        )
        self._arms = _arms_of(scenario)
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
        state = self._rod.rest(*grips).state
        shift = np.array([0.0, 0.0, 0.01]) * self._moves.any(axis=1).all()
        goal = tuple(Pose(g.position + shift, g.orientation) for g in grips)
        self._find(
            self.problem(
                state, grips, state.positions + shift, (goal[0], goal[1]), self._scenario.bodies
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
        wanted = (
            task.message.goal_revision,
            scene.message.revision,
            others.message.revision if others is not None else 0,
            task.message.replan_count,
            motions.run_started,
        )
        if wanted == self._planned or not poses_known(arms.message):
            begin = None
        elif _at_rest(arms.message):
            begin = arms.message
        else:
            begin = self._stop_ahead(inbox, task.message, scene.message, arms.message)
        if begin is not None:
            rope = inbox.latest(topics.ROPE_NODES)
            nodes = rope.message if rope is not None else None
            if begin is not arms.message and nodes is not None:
                nodes = _moved(nodes, arms.message, begin)
            parameters = inbox.latest(topics.CONTROLLER_PARAMETERS)
            if parameters is not None:
                self._update_properties(parameters.message)
            self._planned = wanted
            beside = other_rope_obstacles(others.message) if others is not None else ()
            self._planning_since = now
            self._path = self._plan(task.message, scene.message, motions, beside, begin, nodes)
            self._path.others_revision = wanted[2]
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
        if self._arms is not None or item is None or self._planned is None:
            return None  # Joints where the arms stop are not known.
        setpoints = item.message
        asked = (task.goal_revision, task.replan_count)
        brakes = asked != (self._planned[0], self._planned[3]) and task.state == RUNNING
        changed = (task.goal_revision, scene.revision) != self._planned[:2]
        if not (brakes and changed) or setpoints.hold or setpoints.stamp < task.stamp:
            return None
        ahead = ArmStates()
        ahead.CopyFrom(arms)
        ends = {end.arm: end for end in setpoints.arms}
        for arm in ahead.arms:
            if arm.arm in ends:
                arm.position[:] = ends[arm.arm].positions[-3:]
                arm.orientation[:] = ends[arm.arm].orientations[-4:]
        return ahead

    def _update_properties(self, parameters: Parameters) -> None:
        """Plan with the properties that the controller has identified."""
        if is_learnt(parameters.rod):
            try:
                properties = updated_properties(self._given, parameters.rod)
                unsure = unsure_properties(properties, parameters.rod)
            except ValueError as error:
                log.warning("identified properties are not used: %s", error)
                return
            self._rod = self._rod.with_properties(properties)
            self._held = held_ends(parameters.rod)
            self._variants = tuple(self._rod.with_properties(p) for p in unsure)

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
        grips = self._ends(arm_pose(arms, "left"), arm_pose(arms, "right"))
        message = Path(
            stamp=arms.stamp,
            goal_revision=task.goal_revision,
            scene_revision=scene.revision,
            replan_count=task.replan_count,
            bending_stiffness=self._rod.properties.bending_stiffness,
        )
        departure = (arms.stamp + self._planning_time) * NANOSECONDS
        still, moving = divided(scene_obstacles(scene), obstacle_motions(motions), departure)
        obstacles = (*still, *others)
        try:
            state = self._rest_state(grips, rope, obstacles, round(task.turns))
        except ValueError as error:
            message.reason = f"the rod has no shape at rest between the grips: {error}"
            return message
        goal, goal_grips = self._goal(task.goal, obstacles)
        problem = self.problem(
            state,
            grips,
            goal,
            goal_grips,
            obstacles,
            (task.goal.left_oriented, task.goal.right_oriented),
            round(task.goal.turns),
            task.replan_count,
            task.goal.ends_only,
        )
        if _at_rest(arms):
            self._mismatch = self._mismatch_margin(state, rope)
        margin = max(task.clearance_margin, self._mismatch)
        problem = replace(
            problem,
            clearance=problem.clearance + margin,
            spare_clearance=margin,
            pace=task.pace if task.pace else 1.0,
            arms=self._present_arms(arms),
        )
        if not moving:
            _write_path(message, self._find(problem).of_grippers(problem))
            return message
        found = plan_departure(problem, moving, departure, self._find)
        _write_path(message, found.path.of_grippers(problem))
        message.start_after = round(found.after / NANOSECONDS)
        message.start_before = round(found.before / NANOSECONDS)
        return message

    def _present_arms(self, message: ArmStates) -> CellArms | None:
        """Arms with the joints that they report."""
        if self._arms is None:
            return None
        reported = {state.arm: state.joints for state in message.arms}
        joints = {k: np.array(reported.get(SIDES[k], ()), dtype=float) for k in self._arms.arms}
        known = {k: row for k, row in joints.items() if len(row) == len(self._arms.joints[k])}
        return replace(self._arms, joints={**self._arms.joints, **known})

    def _ends(self, left: Pose, right: Pose) -> tuple[Pose, Pose]:
        """Poses of the rope's ends between two grips."""
        return left @ self._held[0], right @ self._held[1]

    def _goal(
        self, goal: Goal, obstacles: tuple[Obstacle, ...]
    ) -> tuple[Float64[np.ndarray, "n 3"], tuple[Pose, Pose]]:
        """Nodes and ends of a goal; beside a part that counts, they are fitted with this rod.

        Where the ends alone count, the rope's own ends are to come to the goal's poses.
        """
        nodes = self._resampled(chain(goal.positions))
        if goal.ends_only:
            ends = grip_pose(goal.left), grip_pose(goal.right)
            try:
                supports = [o for o in obstacles if o.support]
                packed = pack(supports) if supports else None
                return self._rod.rest(*ends, obstacles=packed).state.positions, ends
            except ValueError:
                return nodes, ends
        ends = self._ends(grip_pose(goal.left), grip_pose(goal.right))
        if not goal.part:
            return nodes, ends
        supports = [o for o in obstacles if o.support]
        counted = polylines.within(nodes, *goal.part)
        try:
            fit = fit_part(
                self._rod,
                ends,
                self._moves,
                nodes[counted],
                counted,
                goal.turns,
                pack(supports) if supports else None,
            )
        except ValueError:
            return nodes, ends
        return np.where(counted[:, None], nodes, fit.state.positions), fit.grips

    def _rest_state(
        self,
        grips: tuple[Pose, Pose],
        rope: NodeChain | None,
        obstacles: tuple[Obstacle, ...],
        turns: int,
    ) -> RodState:
        """State at rest between the grips, with the observed shape and the given turns of twist."""
        supports = [o for o in obstacles if o.support]
        packed = pack(supports) if supports else None
        state = self._rod.rest(*grips, obstacles=packed).state
        if rope is None or not rope.positions:
            return self._rest_with_turns(state, turns, grips, packed)
        observed = self._resampled(chain(rope.positions))
        guess = add_turns(state_along(observed, grips[0].orientation, grips[1].orientation), turns)
        # The turns are those of the observed shape.
        state = self._rest_with_turns(
            state, count_turns_along(guess, state.positions), grips, packed
        )
        if polylines.mean_node_distance(state.positions, observed) < SAME_SHAPE_DISTANCE:
            return state
        other = self._rod.rest(*grips, guess=guess, obstacles=packed).state
        return min(
            (state, other), key=lambda s: polylines.mean_node_distance(s.positions, observed)
        )

    def _rest_with_turns(
        self,
        state: RodState,
        turns: int,
        grips: tuple[Pose, Pose],
        supports: Float64[np.ndarray, "m 12"] | None,
    ) -> RodState:
        """State at rest to which another one relaxes when turns of twist are added to it."""
        if not turns:
            return state
        return self._rod.rest(*grips, guess=add_turns(state, turns), obstacles=supports).state

    def _mismatch_margin(self, state: RodState, rope: NodeChain | None) -> float:
        """Clearance that is added where the rod at rest is not where the rope is seen [m]."""
        if rope is None or not rope.positions:
            return 0.0
        missed = self._resampled(chain(rope.positions)) - state.positions
        noise = 3.0 * float(np.mean(np.square(rope.sigma))) if rope.sigma else 0.0
        square = float(np.mean(np.sum(missed**2, axis=1))) - noise
        mismatch = math.sqrt(max(square, 0.0)) - COVERED_MISMATCH
        return min(MISMATCH_DEVIATIONS * max(mismatch, 0.0), MAX_MISMATCH_MARGIN)

    def _resampled(self, nodes: Float64[np.ndarray, "k 3"]) -> Float64[np.ndarray, "n 3"]:
        """Chain with as many nodes as the rod, by arc length."""
        count = self._rod.node_count
        return nodes if len(nodes) == count else polylines.resample_smooth(nodes, count)

    def problem(
        self,
        state: RodState,
        grips: tuple[Pose, Pose],
        goal: np.ndarray,
        goal_grips: tuple[Pose, Pose],
        obstacles: tuple[Obstacle, ...],
        oriented: tuple[bool, bool] = (False, False),
        turns: int = 0,
        replan_count: int = 0,
        ends_only: bool = False,
    ) -> Problem:
        """Return the planning problem of this cell from one shape to another.

        Args:
            state: Rope at rest between the grips.
            grips: Grips at the start.
            goal: Nodes of the goal [m].
            goal_grips: Grips of the goal.
            obstacles: Obstacles of the scene, supports among them. The regions that the scenario
                keeps the rope in join them.
            oriented: Whether the orientation of each goal grip is prescribed.
            turns: Whole turns of twist of the goal.
            replan_count: Number of requests for another path.
            ends_only: Whether the ends alone are the goal.
        """
        scenario = self._scenario
        return Problem(
            rod=self._rod,
            state=state,
            grips=grips,
            goal=goal,
            goal_grips=goal_grips,
            moves=self._moves,
            variants=self._variants,
            held=self._held,
            obstacles=(*(o for o in obstacles if not o.support), *scenario.regions),
            supports=tuple(o for o in obstacles if o.support),
            limits=scenario.limits,
            clearance=scenario.control.clearance,
            tolerance=scenario.run.tolerance,
            oriented=oriented,
            ends_only=ends_only,
            angle_tolerance=scenario.run.angle_tolerance,
            turns=turns,
            # A repeated request tries other random paths.
            seed=scenario.seed + replan_count,
            planning_time=scenario.control.planning_time,
            arms=self._arms,
        )


def build(scenario: Scenario, session: str) -> PlannerService:
    """Create the planner service of a scenario."""
    return PlannerService(scenario)


def _arms_of(scenario: Scenario) -> CellArms | None:
    """Arms of a scenario; None where no end has one."""
    if all(scenario.end(side).driver in ("fixed", "ideal") for side in SIDES):
        return None
    # Only a cell with arms needs Pinocchio.
    from services.planner.arms.cell_arms import CellArms

    return CellArms.of(scenario)


def _at_rest(arms: ArmStates) -> bool:
    """Whether no grip moves: a path begins at rest."""
    return all(
        np.linalg.norm(arm.linear_velocity) < MAX_START_SPEED
        and np.linalg.norm(arm.angular_velocity) < MAX_START_ANGULAR_SPEED
        for arm in arms.arms
    )


def _moved(rope: NodeChain, arms: ArmStates, ahead: ArmStates) -> NodeChain:
    """Chain whose nodes have moved with the grips, to where the arms will stand."""
    nodes = chain(rope.positions)
    if not len(nodes):
        return rope
    left, right = (arm_pose(ahead, side).position - arm_pose(arms, side).position for side in SIDES)
    share = np.linspace(0.0, 1.0, len(nodes))[:, None]
    moved = NodeChain()
    moved.CopyFrom(rope)
    moved.positions[:] = (nodes + (1.0 - share) * left + share * right).ravel()
    return moved


def _write_path(message: Path, path: WholePath) -> None:
    """Write a path into its message."""
    message.reached, message.reason = path.reached, path.reason
    message.blocked = path.blocked
    message.dt = round(path.dt * SECOND)
    message.left_positions.extend(path.positions[:, 0].ravel())
    message.left_orientations.extend(path.orientations[:, 0].ravel())
    message.right_positions.extend(path.positions[:, 1].ravel())
    message.right_orientations.extend(path.orientations[:, 1].ravel())
    message.nodes.extend(path.nodes.ravel())
    message.node_count = path.nodes.shape[1]
    message.final_error, message.clearance = path.final_error, path.clearance
